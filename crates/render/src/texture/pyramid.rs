//! Mip pyramids: every level half the size of the one before, rounded down, averaged in linear light.
//!
//! A texel of a level is the area average of the texels it covers: 2x2 of them, or 3 in a direction whose size is
//! odd. Colour and alpha are averaged independently, as GPUs do.

use std::borrow::Cow;

use glam::Vec4;
use rayon::prelude::*;
use rayward_scene::Image;

use crate::tonemap::{encode_srgb8, linear_from_srgb8};

/// What the bytes of an image mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Colour with the sRGB transfer function; alpha is linear.
    Srgb,
    /// Numbers: byte / 255.
    Linear,
}

/// One level of a pyramid.
#[derive(Clone, Debug)]
pub struct Level<'s> {
    /// Texels of a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The texels in the image's own encoding, row by row.
    pub texels: Cow<'s, [[u8; 4]]>,
}

/// An image and, if asked for, its smaller versions down to one texel.
#[derive(Clone, Debug)]
pub struct Pyramid<'s> {
    /// Index of the image in the scene.
    pub image: usize,
    /// What its bytes mean.
    pub encoding: Encoding,
    /// The image first, if asked for all others down to one texel.
    pub levels: Vec<Level<'s>>,
    /// Value of each byte of a colour.
    decode: &'static [f32; 256],
}

/// Whether the image is what its size says and not empty.
pub(super) fn has_texels(image: &Image) -> bool {
    image.width > 0
        && image.height > 0
        && image.texels.len() as u64 == u64::from(image.width) * u64::from(image.height)
}

static BYTES: [f32; 256] = {
    let mut values = [0.0; 256];
    let mut byte = 0;
    while byte < 256 {
        values[byte] = byte as f32 / 255.0;
        byte += 1;
    }
    values
};

impl<'s> Pyramid<'s> {
    pub(super) fn new(index: usize, image: &'s Image, encoding: Encoding, mipmaps: bool) -> Self {
        let decode = match encoding {
            Encoding::Srgb => linear_from_srgb8(),
            Encoding::Linear => &BYTES,
        };
        let base = Level {
            width: image.width,
            height: image.height,
            texels: Cow::Borrowed(&image.texels),
        };
        let mut pyramid = Self {
            image: index,
            encoding,
            levels: vec![base],
            decode,
        };
        while mipmaps
            && pyramid
                .levels
                .last()
                .is_some_and(|level| level.width > 1 || level.height > 1)
        {
            let next = pyramid.halved(&pyramid.levels[pyramid.levels.len() - 1]);
            pyramid.levels.push(next);
        }
        pyramid
    }

    /// A texel as numbers: linear colour and alpha.
    #[inline]
    pub(super) fn texel(&self, level: &Level, x: u32, y: u32) -> Vec4 {
        let [r, g, b, a] = level.texels[y as usize * level.width as usize + x as usize];
        let value = |byte: u8| self.decode[byte as usize];
        Vec4::new(value(r), value(g), value(b), BYTES[a as usize])
    }

    fn encode(&self, value: Vec4) -> [u8; 4] {
        let byte = |v: f32| (v * 255.0 + 0.5) as u8;
        match self.encoding {
            Encoding::Srgb => [
                encode_srgb8(value.x),
                encode_srgb8(value.y),
                encode_srgb8(value.z),
                byte(value.w),
            ],
            Encoding::Linear => value.to_array().map(byte),
        }
    }

    fn halved(&self, finer: &Level) -> Level<'static> {
        let (width, height) = ((finer.width / 2).max(1), (finer.height / 2).max(1));
        let rows = (0..height).into_par_iter().flat_map_iter(|y| {
            let rows = Cover::new(y, height, finer.height);
            (0..width).map(move |x| self.encode(self.average(finer, Cover::new(x, width, finer.width), rows)))
        });
        Level {
            width,
            height,
            texels: Cow::Owned(rows.collect()),
        }
    }

    fn average(&self, level: &Level, columns: Cover, rows: Cover) -> Vec4 {
        let mut sum = Vec4::ZERO;
        for (y, row_weight) in rows.texels() {
            for (x, column_weight) in columns.texels() {
                sum += self.texel(level, x, y) * (row_weight * column_weight);
            }
        }
        sum
    }
}

/// What one texel of the next level covers of a row or column: from `start` to `end`, in texels.
#[derive(Clone, Copy)]
struct Cover {
    start: f32,
    end: f32,
}

impl Cover {
    fn new(index: u32, size: u32, finer_size: u32) -> Self {
        let bound = |i: u32| (u64::from(i) * u64::from(finer_size)) as f64 / f64::from(size);
        Self {
            start: bound(index) as f32,
            end: bound(index + 1) as f32,
        }
    }

    /// Covered texels with their share of the whole.
    fn texels(self) -> impl Iterator<Item = (u32, f32)> {
        let Self { start, end } = self;
        (start.floor() as u32..end.ceil() as u32).map(move |texel| {
            let covered = end.min(texel as f32 + 1.0) - start.max(texel as f32);
            (texel, covered / (end - start))
        })
    }
}
