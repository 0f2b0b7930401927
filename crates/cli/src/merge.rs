//! `rayward merge`: numbered pictures to a movie.
//!
//! What shares of `rayward animate` rendered becomes the movie that one run of it makes, to the bit.

use rayward::image_io::{MovieOptions, Picture, is_movie, read_picture_up_to, write_movie};

use crate::args::MergeArgs;
use crate::failure::{Code, Failure};
use crate::machine;
use crate::progress::Bar;

/// Memory that a picture takes while it is read and encoded, in bytes a pixel.
const PIXEL_BYTES: u64 = 40;

/// Joins all pictures.
pub(crate) fn run(args: &MergeArgs) -> Result<(), Failure> {
    if !is_movie(&args.output) {
        return Err(Failure::new(
            Code::Usage,
            format_args!(
                "--output {}: the ending has to be .apng, .gif, .mp4, .webm or .mkv",
                args.output.display()
            ),
        ));
    }
    let bar = Bar::of_frames(!args.quiet);
    bar.phase("joining");
    bar.frames(args.pictures.len() as u64);
    let limit = machine::available_memory().map_or(u64::MAX, |bytes| bytes / PIXEL_BYTES);
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
    write_movie(&args.output, &options, |rgb| {
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
