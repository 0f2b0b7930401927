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
//! | motion | `motion.X motion.Y` | f32 |
//! | cost | `cost.nodes` and so on, [`PixelCost::NAMES`] | f32 |
//!
//! A part of a picture has two texts besides: `raywardShard`, like `2/4`, and `raywardPicture`, the checksum of the picture
//! in hexadecimal digits.

use std::io::{self, Cursor, Seek, Write};
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatImage, FlatSamples, Image, Layer};
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage, read};
use glam::{Vec2, Vec3, Vec4};

use super::file;
use super::picture::{Picture, SizeCheck};
use crate::{Error, Film, Layers, Part, PixelCost, Result};

/// Names of the texts that a part of a picture has.
const SHARD: &str = "raywardShard";
const PICTURE: &str = "raywardPicture";

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
        floats("motion.X", &film.motion, |m| m.x),
        floats("motion.Y", &film.motion, |m| m.y),
    ];
    for (number, name) in PixelCost::NAMES.iter().enumerate() {
        let name = format!("cost.{name}");
        channels.push(floats(&name, &film.cost, |cost| cost.to_array()[number]));
    }
    channels.retain(|channel| channel.sample_data.len() > 0);
    let mut attributes = LayerAttributes {
        software_name: Some("rayward".into()),
        ..LayerAttributes::default()
    };
    if let Some(part) = film.part() {
        let mut put = |name: &str, text: String| {
            let text = AttributeValue::Text(Text::from(text.as_str()));
            attributes.other.insert(Text::from(name), text);
        };
        put(SHARD, part.shard.to_string());
        put(PICTURE, format!("{:016x}", part.picture));
    }
    let layer = Layer::new(
        (film.width() as usize, film.height() as usize),
        attributes,
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

/// The layers of a file, once their sizes are known to be usable.
fn layers(check: SizeCheck, bytes: &[u8]) -> Result<FlatImage> {
    let malformed = |error: exr::error::Error| Error::malformed(check.path, format_args!("OpenEXR: {error}"));
    for header in MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(malformed)?
        .headers
    {
        let size = header.layer_size;
        let side = |side: usize| u32::try_from(side).unwrap_or(u32::MAX);
        check.pixels(side(size.x()), side(size.y()))?;
    }
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(malformed)
}

/// Whether these bytes start like an OpenEXR file.
pub(super) fn is_exr(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x76\x2f\x31\x01")
}

/// A part of a picture, as it was written.
pub(super) fn decode_part(check: SizeCheck, bytes: &[u8]) -> Result<(Film, Part)> {
    let fail = |problem: &str| Error::malformed(check.path, problem);
    let strange = || fail("it is no part of a picture, as `rayward render --shard` makes them");
    if !is_exr(bytes) {
        return Err(strange());
    }
    let image = layers(check, bytes)?;
    let [layer] = image.layer_data.as_slice() else {
        return Err(strange());
    };
    let text = |name: &str| match layer.attributes.other.get(&Text::from(name))? {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    };
    let part = text(SHARD).zip(text(PICTURE)).and_then(|(shard, picture)| {
        Some(Part {
            shard: shard.parse().ok()?,
            picture: u64::from_str_radix(&picture, 16).ok()?,
        })
    });
    let part = part.ok_or_else(strange)?;
    let pixels = layer.size.area();
    let (mut floats, mut ids) = (Vec::new(), Vec::new());
    for channel in &layer.channel_data.list {
        match &channel.sample_data {
            FlatSamples::F32(values) if values.len() == pixels => {
                floats.push((channel.name.to_string(), values));
            }
            FlatSamples::U32(values) if values.len() == pixels => {
                ids.push((channel.name.to_string(), values));
            }
            _ => {}
        }
    }
    let float = |name: &str| Some(floats.iter().find(|(own, _)| own == name)?.1);
    let pair = |u: &str, v: &str| Some((float(u)?, float(v)?));
    let triple = |x: &str, y: &str, z: &str| Some((float(x)?, float(y)?, float(z)?));
    let id = |name: &str| Some(ids.iter().find(|(own, _)| own == name)?.1.clone());
    let vectors = |(x, y, z): (&Vec<f32>, &Vec<f32>, &Vec<f32>)| -> Vec<Vec3> {
        (0..pixels).map(|i| Vec3::new(x[i], y[i], z[i])).collect()
    };
    let points = |(u, v): (&Vec<f32>, &Vec<f32>)| -> Vec<Vec2> {
        (0..pixels).map(|i| Vec2::new(u[i], v[i])).collect()
    };

    // Layers are put in one by one, so none is made before.
    let size = [layer.size.x(), layer.size.y()].map(|side| side as u32);
    let mut film = Film::new(size[0], size[1], Layers::default())?;
    film.color = triple("R", "G", "B")
        .map(vectors)
        .ok_or_else(|| fail("OpenEXR: no channels R, G and B of single precision"))?;
    film.alpha = float("A").cloned().unwrap_or_default();
    film.depth = float("depth.Z").cloned().unwrap_or_default();
    film.distance = float("distance.D").cloned().unwrap_or_default();
    film.normal = triple("N.X", "N.Y", "N.Z").map(vectors).unwrap_or_default();
    film.object = id("id.object").unwrap_or_default();
    film.prim = id("id.prim").unwrap_or_default();
    film.bary = pair("bary.u", "bary.v").map(points).unwrap_or_default();
    film.motion = pair("motion.X", "motion.Y").map(points).unwrap_or_default();
    film.cost = costs(&float).unwrap_or_default();
    film.note_layers();
    film.part = Some(part);
    Ok((film, part))
}

/// The costs, from their channels.
fn costs<'c>(float: &impl Fn(&str) -> Option<&'c Vec<f32>>) -> Option<Vec<PixelCost>> {
    let mut channels: [&[f32]; 6] = [&[]; 6];
    for (channel, name) in channels.iter_mut().zip(PixelCost::NAMES) {
        *channel = float(&format!("cost.{name}"))?;
    }
    let pixel = |i: usize| channels.map(|channel| channel[i]).into();
    Some((0..channels[0].len()).map(pixel).collect())
}

/// The colour of the first part that has any.
pub(super) fn decode(check: SizeCheck, bytes: &[u8]) -> Result<Picture> {
    let path = check.path;
    let image = layers(check, bytes)?;
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
