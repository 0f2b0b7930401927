//! OpenEXR: all layers of a film in one part, lossless.
//!
//! | layer | channels | type |
//! |---|---|---|
//! | colour, alpha | `R G B`, `A` | f32 |
//! | depth | `depth.Z` | f32 |
//! | distance | `distance.D` | f32 |
//! | normal | `N.X N.Y N.Z` | f32 |
//! | object, prim | `id.object`, `id.prim` | u32 |
//! | bary | `bary.u bary.v` | f32 |

use std::io::{self, Cursor, Seek, Write};
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::meta::MetaData;
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage, read};
use glam::Vec4;

use super::file;
use super::picture::{Picture, SizeCheck};
use crate::{Error, Film, Result};

/// Writes all layers of a film.
///
/// # Errors
/// [`Error::Write`] for what the system says.
pub fn write_exr(path: &Path, film: &Film) -> Result<()> {
    file::write(path, |sink| encode(sink, film))
}

/// Writes the same to anything that takes bytes and can seek, for instance a buffer.
///
/// # Errors
/// As [`write_exr`]; the path in the error is `-`.
pub fn encode_exr(sink: impl Write + Seek, film: &Film) -> Result<()> {
    encode(sink, film).map_err(|source| Error::write(Path::new("-"), source))
}

fn floats<T>(name: &str, layer: &[T], value: impl Fn(&T) -> f32) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(layer.iter().map(value).collect()))
}

fn encode(sink: impl Write + Seek, film: &Film) -> io::Result<()> {
    let mut channels = vec![
        floats("R", &film.color, |c| c.x),
        floats("G", &film.color, |c| c.y),
        floats("B", &film.color, |c| c.z),
        floats("A", &film.alpha, |&a| a),
        floats("depth.Z", &film.depth, |&d| d),
        floats("distance.D", &film.distance, |&d| d),
        floats("N.X", &film.normal, |n| n.x),
        floats("N.Y", &film.normal, |n| n.y),
        floats("N.Z", &film.normal, |n| n.z),
        AnyChannel::new("id.object", FlatSamples::U32(film.object.clone())),
        AnyChannel::new("id.prim", FlatSamples::U32(film.prim.clone())),
        floats("bary.u", &film.bary, |b| b.x),
        floats("bary.v", &film.bary, |b| b.y),
    ];
    channels.retain(|channel| channel.sample_data.len() > 0);
    let layer = Layer::new(
        (film.width() as usize, film.height() as usize),
        LayerAttributes {
            software_name: Some("rayward".into()),
            ..LayerAttributes::default()
        },
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.into()),
    );
    Image::from_layer(layer).write().to_buffered(sink).map_err(to_io)
}

fn to_io(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(error) => error,
        other => io::Error::other(other.to_string()),
    }
}

/// The colour of the first part that has any.
pub(super) fn decode(check: SizeCheck, bytes: &[u8]) -> Result<Picture> {
    let path = check.path;
    let malformed = |error: exr::error::Error| Error::malformed(path, format_args!("OpenEXR: {error}"));
    for header in MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(malformed)?
        .headers
    {
        let size = header.layer_size;
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        check.pixels(side(size.x()), side(size.y()))?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(malformed)?;
    for layer in &image.layer_data {
        let channel = |name: &str| layer.channel_data.list.iter().find(|c| c.name.eq(name));
        let grey = channel("Y");
        let Some(rgb) = ["R", "G", "B"]
            .map(|name| channel(name).or(grey))
            .into_iter()
            .collect::<Option<Vec<_>>>()
        else {
            continue;
        };
        let alpha = channel("A");
        let (width, height) = (layer.size.x(), layer.size.y());
        let whole = |c: &&AnyChannel<FlatSamples>| c.sample_data.len() == width * height;
        if !rgb.iter().chain(&alpha).all(whole) {
            return Err(Error::malformed(path, "OpenEXR: a colour channel is subsampled"));
        }
        let value = |c: &AnyChannel<FlatSamples>, i| c.sample_data.value_by_flat_index(i).to_f32();
        let pixel = |i| {
            let [r, g, b] = [0, 1, 2].map(|c| value(rgb[c], i));
            Vec4::new(r, g, b, alpha.map_or(1.0, |a| value(a, i)))
        };
        let pixels = (0..width * height).map(pixel).collect();
        return Ok(Picture {
            width: width as u32,
            height: height as u32,
            pixels,
            srgb: false,
        });
    }
    Err(Error::malformed(
        path,
        "OpenEXR: no part has the channels R, G, B or Y",
    ))
}
