//! An image as read from a file, whatever its format.

use std::io::Cursor;
use std::path::Path;

use glam::Vec4;
use image::{DynamicImage, ImageDecoder, ImageReader, ImageResult};

use super::{exr, file, npy, pfm};
use crate::error::{MAX_PIXELS, check_size};
use crate::tonemap::{decode_srgb, encode_srgb};
use crate::{Error, Film, Result};

/// Pixels in the values of their file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue, alpha; `width * height` of them, row 0 on top. Grey is in all three, missing alpha is 1.
    pub pixels: Vec<Vec4>,
    /// Whether colours are sRGB encoded; linear otherwise.
    pub srgb: bool,
}

impl Picture {
    /// The same picture with sRGB encoded colours; linear ones are cut off at 0 and 1 first.
    pub fn to_srgb(&self) -> Self {
        if self.srgb {
            self.clone()
        } else {
            self.converted(true, |linear| encode_srgb(linear.clamp(0.0, 1.0)))
        }
    }

    /// The same picture with linear colours.
    pub fn to_linear(&self) -> Self {
        if self.srgb {
            self.converted(false, decode_srgb)
        } else {
            self.clone()
        }
    }

    fn converted(&self, srgb: bool, transfer: impl Fn(f64) -> f64) -> Self {
        let value = |v: f32| transfer(f64::from(v)) as f32;
        let pixels = self
            .pixels
            .iter()
            .map(|p| Vec4::new(value(p.x), value(p.y), value(p.z), p.w))
            .collect();
        Self {
            pixels,
            srgb,
            ..*self
        }
    }
}

impl From<&Film> for Picture {
    fn from(film: &Film) -> Self {
        let alpha = film.alpha.iter().copied().chain(std::iter::repeat(1.0));
        let pixels = film
            .color
            .iter()
            .zip(alpha)
            .map(|(color, alpha)| color.extend(alpha))
            .collect();
        Self {
            width: film.width(),
            height: film.height(),
            pixels,
            srgb: false,
        }
    }
}

/// Reads an image; its format is known by its first bytes.
///
/// # Errors
/// [`Error::Read`] for what the system says, [`Error::UnknownImageFormat`], [`Error::MalformedImage`],
/// [`Error::ImageTooLarge`].
pub fn read_picture(path: &Path) -> Result<Picture> {
    read_picture_up_to(path, MAX_PIXELS)
}

/// As [`read_picture`], but without reading the pixels if there are more than `limit`.
///
/// # Errors
/// As [`read_picture`].
pub fn read_picture_up_to(path: &Path, limit: u64) -> Result<Picture> {
    let bytes = file::read(path)?;
    let check = SizeCheck::new(path, limit);
    match () {
        () if exr::is_exr(&bytes) => exr::decode(check, &bytes),
        () if npy::is_npy(&bytes) => npy::decode(check, &bytes),
        () if pfm::is_pfm(&bytes) => pfm::decode(check, &bytes),
        () => decode(check, &bytes),
    }
}

/// Checks the size that a file's header promises before anything of that size is made.
#[derive(Clone, Copy)]
pub(super) struct SizeCheck<'a> {
    pub(super) path: &'a Path,
    limit: u64,
}

impl<'a> SizeCheck<'a> {
    pub(super) fn new(path: &'a Path, limit: u64) -> Self {
        let limit = limit.min(MAX_PIXELS);
        Self { path, limit }
    }

    /// The number of pixels.
    pub(super) fn pixels(self, width: u32, height: u32) -> Result<usize> {
        let pixels = u64::from(width) * u64::from(height);
        if pixels > self.limit {
            return Err(Error::ImageTooLarge {
                path: self.path.into(),
                width,
                height,
                limit: self.limit,
            });
        }
        check_size(width, height).map_err(|error| Error::malformed(self.path, error))
    }
}

/// PNG, JPEG and HDR.
fn decode(check: SizeCheck, bytes: &[u8]) -> Result<Picture> {
    let path = check.path;
    let mut cursor = Cursor::new(bytes);
    let decoded = decode_from(check, &mut cursor)?;
    let image = decoded.map_err(|error| {
        // Decoders read ahead, so the place is that of the next byte they would have asked for.
        let place = format_args!("near byte {} of {}", cursor.position(), bytes.len());
        Error::malformed(path, format_args!("{place}: {error}"))
    })?;
    let (width, height) = (image.width(), image.height());
    let (pixels, srgb) = match &image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => (
            image.into_rgba32f().pixels().map(|p| Vec4::from(p.0)).collect(),
            false,
        ),
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let rgba = image.into_rgba16();
            (
                rgba.pixels()
                    .map(|p| Vec4::from(p.0.map(|v| f32::from(v) / 65535.0)))
                    .collect(),
                true,
            )
        }
        _ => {
            let rgba = image.into_rgba8();
            (
                rgba.pixels()
                    .map(|p| Vec4::from(p.0.map(|v| f32::from(v) / 255.0)))
                    .collect(),
                true,
            )
        }
    };
    Ok(Picture {
        width,
        height,
        pixels,
        srgb,
    })
}

/// The outer error is one of the file as a whole, the inner one belongs to the place the decoder has come to.
fn decode_from(check: SizeCheck, cursor: &mut Cursor<&[u8]>) -> Result<ImageResult<DynamicImage>> {
    let mut reader = ImageReader::new(cursor)
        .with_guessed_format()
        .map_err(|source| Error::read(check.path, source))?;
    if reader.format().is_none() {
        return Err(Error::UnknownImageFormat {
            path: check.path.into(),
            known: "PNG, JPEG, EXR, HDR, NPY and PFM",
        });
    }
    // The size is checked here; beyond it the formats need little.
    reader.no_limits();
    let decoder = match reader.into_decoder() {
        Ok(decoder) => decoder,
        Err(error) => return Ok(Err(error)),
    };
    let (width, height) = decoder.dimensions();
    check.pixels(width, height)?;
    Ok(DynamicImage::from_decoder(decoder))
}
