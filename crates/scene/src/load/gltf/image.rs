//! Images (glTF 2.0 §3.8.3): PNG and JPEG from buffer views, data URIs and files, decoded in parallel.
//!
//! Limits: [`MAX_SIDE`] texels a side, [`MAX_TEXELS`] in all images together. Both are checked against the
//! images' headers before anything is decoded.

use std::borrow::Cow;
use std::io::Cursor;

use image::{ImageError, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;

use super::place;
use super::source::Source;
use crate::{Error, Image};

/// Most texels in width and in height.
const MAX_SIDE: u32 = 16384;
/// Most texels of all images together (2 GiB at four bytes).
const MAX_TEXELS: u64 = 1 << 29;

/// An image of the file that the scene needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Wanted {
    /// Index in the file.
    pub(super) image: usize,
    /// What is made of it.
    pub(super) derivation: Derivation,
}

/// How a scene's image comes from a file's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Derivation {
    /// As it is.
    None,
    /// Green becomes 1 - `glossiness` * alpha / 255 (`glossiness` in units of 1/65535); red and blue are 0.
    Roughness {
        /// The factor.
        glossiness: u16,
    },
}

impl Derivation {
    /// Roughness from an alpha channel that holds glossiness.
    pub(super) fn roughness(glossiness: f32) -> Self {
        Self::Roughness {
            glossiness: (glossiness.clamp(0.0, 1.0) * 65535.0).round() as u16,
        }
    }

    fn apply(self, texels: &mut [[u8; 4]]) {
        let Self::Roughness { glossiness } = self else {
            return;
        };
        let factor = f32::from(glossiness) / 65535.0;
        for texel in texels {
            *texel = [0, (255.0 - factor * f32::from(texel[3])).round() as u8, 0, 255];
        }
    }
}

/// An image's file content.
struct Encoded<'a> {
    wanted: Wanted,
    name: String,
    place: String,
    bytes: Cow<'a, [u8]>,
    format: ImageFormat,
}

/// Decodes the images, in the given order.
pub(super) fn decode(source: &Source<'_>, wanted: &[Wanted]) -> Result<Vec<Image>, Error> {
    let mut texels = 0;
    let mut encoded = Vec::with_capacity(wanted.len());
    for &wanted in wanted {
        let image = Encoded::read(source, wanted)?;
        let (width, height) = image.size(source)?;
        texels += u64::from(width) * u64::from(height);
        if texels > MAX_TEXELS {
            let what = format!("the sum of {texels} texels up to here");
            return Err(source.too_large(image.place, what, MAX_TEXELS.to_string()));
        }
        encoded.push(image);
    }
    let decoded: Vec<Result<Image, Error>> = encoded.par_iter().map(|image| image.decode(source)).collect();
    // Collected first, so that of several broken images the same one is named on every run.
    decoded.into_iter().collect()
}

impl<'a> Encoded<'a> {
    fn read(source: &'a Source<'_>, wanted: Wanted) -> Result<Self, Error> {
        let image = &source.root.images[wanted.image];
        let place = place("image", wanted.image, image.name.as_ref());
        let (bytes, from) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => (Cow::Owned(source.read_uri(uri, &place)?), uri.as_str()),
            (None, Some(view)) => (Cow::Borrowed(source.view(view, &place)?), ""),
            (None, None) => return Err(source.malformed(place, "neither a uri nor a bufferView")),
        };
        let from = if from.starts_with("data:") { "" } else { from };
        let named = image.name.as_deref().filter(|name| !name.is_empty());
        let name = named.map_or_else(
            || {
                if from.is_empty() {
                    place.clone()
                } else {
                    from.into()
                }
            },
            String::from,
        );
        let place = if from.is_empty() {
            place
        } else {
            format!("{place} ({from})")
        };
        match image::guess_format(&bytes) {
            Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => Ok(Self {
                wanted,
                name,
                place,
                bytes,
                format,
            }),
            _ => {
                let start = bytes[..bytes.len().min(8)].escape_ascii();
                let problem = format!("neither PNG nor JPEG, the content begins with \"{start}\"");
                Err(source.malformed(place, problem))
            }
        }
    }

    fn reader(&self) -> ImageReader<Cursor<&[u8]>> {
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE);
        limits.max_image_height = Some(MAX_SIDE);
        // Eight bytes a texel (16-bit RGBA) and as much again for working memory.
        limits.max_alloc = Some(u64::from(MAX_SIDE).pow(2) * 16);
        let mut reader = ImageReader::with_format(Cursor::new(self.bytes.as_ref()), self.format);
        reader.limits(limits);
        reader
    }

    fn size(&self, source: &Source<'_>) -> Result<(u32, u32), Error> {
        let (width, height) = self
            .reader()
            .into_dimensions()
            .map_err(|e| self.error(source, &e))?;
        if width > MAX_SIDE || height > MAX_SIDE {
            let what = format!("its size of {width}x{height}");
            return Err(source.too_large(&self.place, what, format!("{MAX_SIDE}x{MAX_SIDE}")));
        }
        Ok((width, height))
    }

    fn decode(&self, source: &Source<'_>) -> Result<Image, Error> {
        let pixels = self
            .reader()
            .decode()
            .map_err(|e| self.error(source, &e))?
            .into_rgba8();
        let (width, height) = pixels.dimensions();
        let mut texels = pixels.as_raw().as_chunks::<4>().0.to_vec();
        self.wanted.derivation.apply(&mut texels);
        Ok(Image {
            name: self.name.clone(),
            width,
            height,
            texels,
        })
    }

    fn error(&self, source: &Source<'_>, error: &ImageError) -> Error {
        match error {
            ImageError::Limits(limit) => source.too_large(
                &self.place,
                format!("its size ({limit})"),
                format!("{MAX_SIDE}x{MAX_SIDE}"),
            ),
            _ => source.malformed(&self.place, error.to_string()),
        }
    }
}
