//! `rayward merge`: the parts of a picture to the picture, numbered pictures to a movie.
//!
//! What shares of `rayward render` or `rayward animate` rendered becomes what one run of it makes, to the bit.

use std::path::Path;

use rayward::image_io::{MovieOptions, Picture, is_movie, join_parts, read_picture_up_to, write_movie};
use rayward::{Error, LayerKind};

use crate::args::MergeArgs;
use crate::failure::{Code, Failure};
use crate::machine;
use crate::output::Targets;
use crate::progress::Bar;

/// Memory that a picture takes while it is read and encoded, in bytes a pixel.
const PIXEL_BYTES: u64 = 40;

/// The same of a part with all layers: the joined film, the part's, and its channels as read.
const PART_BYTES: u64 = 4 * 52;

/// Joins everything.
pub(crate) fn run(args: &MergeArgs) -> Result<(), Failure> {
    let bar = Bar::of_frames(!args.quiet);
    bar.phase("joining");
    bar.frames(args.pictures.len() as u64);
    match &args.target.output {
        Some(path) if is_movie(path) => movie(args, path, &bar),
        _ => picture(args, &bar),
    }
}

fn limit(pixel: u64) -> u64 {
    machine::available_memory().map_or(u64::MAX, |bytes| bytes / pixel)
}

/// Joins the parts of a picture.
fn picture(args: &MergeArgs, bar: &Bar) -> Result<(), Failure> {
    let targets = Targets::new(&args.target, &args.tone, false)?;
    let mut film = join_parts(&args.pictures, limit(PART_BYTES), || bar.next_frame())?;
    let missing = |kind: &LayerKind| targets.asked.has(*kind) && !film.holds(*kind);
    if let Some(kind) = LayerKind::ALL.into_iter().find(missing) {
        return Err(Error::MissingLayer { layer: kind.name() }.into());
    }
    bar.phase("writing");
    targets.write(&mut film)?;
    Ok(())
}

/// Joins pictures to a movie.
fn movie(args: &MergeArgs, path: &Path, bar: &Bar) -> Result<(), Failure> {
    if args.target.npy.is_some() || !args.target.layers.is_empty() {
        return Err(Failure::new(Code::Usage, "--npy, --layers: a movie has neither"));
    }
    if args.tone.tone_map.is_some() || args.tone.exposure.is_some() || args.tone.show.is_some() {
        return Err(Failure::new(
            Code::Usage,
            "--tone-map, --exposure, --show: a movie is made of pictures as they are",
        ));
    }
    let limit = limit(PIXEL_BYTES);
    let mut first = Some(read_picture_up_to(&args.pictures[0], limit)?);
    let [width, height] = first
        .as_ref()
        .map_or([0; 2], |picture| [picture.width, picture.height]);
    let options = MovieOptions {
        width,
        height,
        frames: args.pictures.len() as u32,
        rate: args.rate,
    };
    let mut paths = args.pictures.iter();
    write_movie(path, &options, |rgb| {
        let Some(path) = paths.next() else { return Ok(()) };
        let picture = match first.take() {
            Some(picture) => picture,
            None => read_picture_up_to(path, limit)?,
        };
        if [picture.width, picture.height] != [width, height] {
            let size = format!("{}x{}", picture.width, picture.height);
            return Err(Failure::new(
                Code::Input,
                format_args!(
                    "{}: it is {size}, the first picture {width}x{height}",
                    path.display()
                ),
            ));
        }
        encode(&picture, rgb);
        bar.next_frame();
        Ok(())
    })
}

/// Three sRGB bytes a pixel.
fn encode(picture: &Picture, rgb: &mut Vec<u8>) {
    rgb.clear();
    let byte = |v: f32| (v * 255.0).round() as u8;
    let bytes = |p: &glam::Vec4| [byte(p.x), byte(p.y), byte(p.z)];
    rgb.extend(picture.to_srgb().pixels.iter().flat_map(bytes));
}
