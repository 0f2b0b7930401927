//! Samples of the cube as they are stored, in three formats of depth.
//!
//! A sample is the plane of one triangle over one texel: depth at the texel's centre, two slopes, the triangle's id.
//! Normal, colour and material follow from the id when a hit is shaded, as VMV07 defers shading; the geometric normal
//! also from the slopes. 10 bytes with f32 depth, 8 with u16 or f16.

use std::ops::Range;

use half::f16;

use super::build::Stack;
use super::raster::{Fragment, NO_PLANE};

/// How depth is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthFormat {
    /// 16-bit float in [0, 1], as in VMV07: up to a quarter of a texel off at 1024 texels.
    F16,
    /// 16-bit fixed point: 1/128 of a texel off at 1024 texels.
    U16,
    /// 32-bit float.
    #[default]
    F32,
}

/// A stored depth. `scale` is the cube's size along the direction, in texels.
pub(crate) trait Depth: Copy + Send + Sync {
    fn stored(depth: f32, scale: f32) -> Self;
    fn texels(self, scale: f32) -> f32;
    /// Bound on the error of a stored depth, in texels.
    fn error(scale: f32) -> f32;
}

impl Depth for f32 {
    fn stored(depth: f32, _: f32) -> Self {
        depth
    }
    #[inline(always)]
    fn texels(self, _: f32) -> f32 {
        self
    }
    fn error(scale: f32) -> f32 {
        scale * f32::EPSILON
    }
}

impl Depth for u16 {
    fn stored(depth: f32, scale: f32) -> Self {
        (depth / scale * f32::from(Self::MAX) + 0.5) as Self
    }
    #[inline(always)]
    fn texels(self, scale: f32) -> f32 {
        f32::from(self) * (scale / f32::from(Self::MAX))
    }
    fn error(scale: f32) -> f32 {
        // Half a step and rounding; depths just below 0 are stored as 0.
        scale / f32::from(Self::MAX) * 0.51 + scale * f32::EPSILON + 1.0 / 64.0
    }
}

impl Depth for f16 {
    fn stored(depth: f32, scale: f32) -> Self {
        Self::from_f32(depth / scale)
    }
    #[inline(always)]
    fn texels(self, scale: f32) -> f32 {
        self.to_f32() * scale
    }
    fn error(scale: f32) -> f32 {
        // Eleven bits of numbers up to 1.
        scale / 4096.0 * 1.01 + scale * f32::EPSILON
    }
}

/// One triangle's plane over one texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample<D> {
    pub(crate) prim: u32,
    pub(crate) depth: D,
    pub(crate) slopes: [i8; 2],
}

impl<D: Depth> Sample<D> {
    pub(crate) fn of(fragment: &Fragment, prim: u32, scale: f32) -> Self {
        Self {
            prim,
            depth: D::stored(fragment.depth, scale),
            slopes: fragment.slopes,
        }
    }
}

/// A sample and where it is, for looking at a cube and for comparing cubes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexelSample {
    /// Index of the texel in memory order: tiles of 8 x 8 in rows, texels of a tile in rows.
    pub texel: u32,
    /// Triangle id.
    pub prim: u32,
    /// Depth at the texel's centre, in texels.
    pub depth: f32,
    /// Slopes of depth, 127 for 1; none if the sample has no plane.
    pub slopes: Option<[i8; 2]>,
}

/// Depths that are compared together; so many follow the last sample's.
const BLOCK: usize = 16;

/// Samples by texel in memory order, then by depth: an array for each of what they hold, for of most of them only the
/// depth is looked at.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layers<D> {
    depths: Vec<D>,
    slopes: Vec<[i8; 2]>,
    prims: Vec<u32>,
}

impl<D: Depth> Layers<D> {
    pub(crate) fn with_capacity(samples: usize) -> Self {
        Self {
            depths: Vec::with_capacity(samples + BLOCK),
            slopes: Vec::with_capacity(samples),
            prims: Vec::with_capacity(samples),
        }
    }

    pub(crate) fn push(&mut self, sample: Sample<D>) {
        self.depths.push(sample.depth);
        self.slopes.push(sample.slopes);
        self.prims.push(sample.prim);
    }

    /// When all samples are there.
    pub(crate) fn finished(mut self) -> Self {
        self.depths.extend([D::stored(0.0, 1.0); BLOCK]);
        self
    }

    pub(crate) fn len(&self) -> usize {
        self.prims.len()
    }

    #[inline(always)]
    pub(crate) fn get(&self, index: usize) -> Sample<D> {
        Sample {
            prim: self.prims[index],
            depth: self.depths[index],
            slopes: self.slopes[index],
        }
    }

    /// Those of a texel's samples whose depth is between two. Which ones come before is counted, sixteen at a time, without
    /// a branch; longer lists are halved first.
    #[inline(always)]
    pub(crate) fn between(&self, list: Range<usize>, [low, high]: [f32; 2], scale: f32) -> Range<usize> {
        let Range { start: mut from, end } = list;
        let mut left = end - from;
        while left > BLOCK {
            let half = left / 2;
            from += if self.depths[from + half - 1].texels(scale) < low {
                half
            } else {
                0
            };
            left -= half;
        }
        let block: &[D; BLOCK] = self.depths[from..].first_chunk().expect("finished");
        let mut before = 0;
        for (i, depth) in block.iter().enumerate() {
            before += usize::from((i < left) & (depth.texels(scale) < low));
        }
        from += before;
        // These are few.
        let beyond = self.depths[from..end]
            .iter()
            .position(|depth| depth.texels(scale) > high);
        from..beyond.map_or(end, |count| from + count)
    }

    fn bytes(&self) -> usize {
        size_of_val(&*self.depths) + size_of_val(&*self.slopes) + size_of_val(&*self.prims)
    }
}

/// The samples of a direction with their texels.
pub(crate) fn listed<D: Depth>(stack: &Stack, samples: &Layers<D>) -> Vec<TexelSample> {
    let mut all = Vec::with_capacity(samples.len());
    for (texel, range) in stack.texels.windows(2).enumerate() {
        all.extend(
            (range[0].start as usize..range[1].start as usize)
                .map(|index| samples.get(index))
                .map(|sample| TexelSample {
                    texel: texel as u32,
                    prim: sample.prim,
                    depth: sample.depth.texels(stack.scale),
                    slopes: (sample.slopes != NO_PLANE).then_some(sample.slopes),
                }),
        );
    }
    all
}

/// All samples of one direction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Samples {
    F16(Layers<f16>),
    U16(Layers<u16>),
    F32(Layers<f32>),
}

impl Samples {
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::F16(s) => s.len(),
            Self::U16(s) => s.len(),
            Self::F32(s) => s.len(),
        }
    }

    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::F16(s) => s.bytes(),
            Self::U16(s) => s.bytes(),
            Self::F32(s) => s.bytes(),
        }
    }
}
