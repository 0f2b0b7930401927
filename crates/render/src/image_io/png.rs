//! PNG: eight bits a channel, tagged as sRGB.

use std::io::{self, Write};
use std::path::Path;

use super::file;
use crate::error::check_size;
use crate::{Error, Result};

/// Writes an image of three sRGB bytes a pixel, row 0 on top.
///
/// # Errors
/// [`Error::ImageSize`] if the bytes do not match the size, [`Error::Write`] for what the system says.
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    check(width, height, rgb)?;
    file::write(path, |sink| encode(sink, width, height, rgb))
}

/// Writes the same to anything that takes bytes, for instance standard output.
///
/// # Errors
/// As [`write_png`]; the path in the error is `-`.
pub fn encode_png(sink: impl Write, width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    check(width, height, rgb)?;
    encode(sink, width, height, rgb).map_err(|source| Error::write(Path::new("-"), source))
}

fn check(width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    if check_size(width, height)? * 3 != rgb.len() {
        return Err(Error::ImageSize {
            width,
            height,
            problem: "does not match the number of its bytes",
        });
    }
    Ok(())
}

fn encode(sink: impl Write, width: u32, height: u32, rgb: &[u8]) -> io::Result<()> {
    let mut encoder = png::Encoder::new(sink, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    Ok(writer.finish()?)
}
