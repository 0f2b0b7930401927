//! The only vector code of the crate.
//!
//! Rules: one generic kernel a file, over sixteen f32 lanes at every level; `dispatch!` once per call on a tile
//! or batch, never per ray; no `unsafe`. What holds more than an operation or two is an `#[inline(always)]` function,
//! not a closure: a closure that is not inlined does not know the level, and each of its operations becomes a call. A kernel never decides a hit on the strength of rounded arithmetic:
//! it classifies lanes as certainly in, certainly out or unsure with an error bound, and unsure lanes go to
//! [`crate::exact`]. That is why fused multiply-adds are allowed here and the answers are still the same at every
//! level.

pub(crate) mod area;
pub(crate) mod askers;
pub(crate) mod batch;
pub(crate) mod bundles;
pub(crate) mod casters;
pub(crate) mod cluster;
pub(crate) mod cover;
mod doubles;
pub(crate) mod edges;
pub(crate) mod facing;
pub(crate) mod lambert;
pub(crate) mod light_boxes;
pub(crate) mod light_points;
pub(crate) mod light_tree;
pub(crate) mod lines;
pub(crate) mod pixels;
pub(crate) mod planes;
pub(crate) mod points;
pub(crate) mod project;
pub(crate) mod receivers;
pub(crate) mod rects;
pub(crate) mod shaft;
pub(crate) mod tile;
pub(crate) mod veils;

use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*};

/// Lanes of every kernel.
pub(crate) const LANES: usize = 16;

/// Unit roundoff of f32: half the distance from 1 to the next number.
pub(crate) const ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// Relative width of the band in which two nearnesses count as unsure. Planes are only used by the kernels
/// where they are known to a quarter of it.
pub(crate) const NEARNESS_BAND: f32 = 1.0 / 32768.0;

/// An instruction set the kernels are compiled for. Detected once and passed down.
#[derive(Clone, Copy, Debug)]
pub struct SimdLevel(pub(crate) Level);

impl SimdLevel {
    /// The best level of this machine.
    pub fn detect() -> Self {
        Self(Level::new())
    }

    /// Every level that runs on this machine, best first. The scalar fallback is among them only where it is
    /// the baseline, or with the feature `scalar`.
    pub fn available() -> Vec<Self> {
        let best = Level::new();
        let mut levels = Vec::new();
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        {
            levels.extend(best.as_avx512().map(|s| s.level()));
            levels.extend(best.as_avx2().map(|s| s.level()));
            levels.extend(best.as_sse4_2().map(|s| s.level()));
            levels.extend(best.as_sse2().map(|s| s.level()));
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        levels.push(best);
        #[cfg(feature = "scalar")]
        levels.push(Level::fallback());
        levels.into_iter().map(Self).collect()
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        match self.0 {
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx512(_) => "AVX-512",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Avx2(_) => "AVX2",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse4_2(_) => "SSE4.2",
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Level::Sse2(_) => "SSE2",
            #[cfg(target_arch = "aarch64")]
            Level::Neon(_) => "NEON",
            _ => "scalar",
        }
    }
}

impl Default for SimdLevel {
    fn default() -> Self {
        Self::detect()
    }
}

/// Three values in all lanes.
#[inline(always)]
fn splat3<S: Simd>(simd: S, v: [f32; 3]) -> [f32x16<S>; 3] {
    [
        f32x16::splat(simd, v[0]),
        f32x16::splat(simd, v[1]),
        f32x16::splat(simd, v[2]),
    ]
}

/// Three arrays of lanes.
#[inline(always)]
fn load3<S: Simd>(simd: S, v: &[[f32; LANES]; 3]) -> [f32x16<S>; 3] {
    [
        f32x16::from_slice(simd, &v[0]),
        f32x16::from_slice(simd, &v[1]),
        f32x16::from_slice(simd, &v[2]),
    ]
}

/// `a x + b y + c`.
#[inline(always)]
fn linear<S: Simd>(a: f32x16<S>, b: f32x16<S>, c: f32x16<S>, [x, y]: [f32x16<S>; 2]) -> f32x16<S> {
    a.mul_add(x, b.mul_add(y, c))
}

/// Three linear functions at a point.
#[inline(always)]
fn linear3<S: Simd>(
    a: [f32x16<S>; 3],
    b: [f32x16<S>; 3],
    c: [f32x16<S>; 3],
    at: [f32x16<S>; 2],
) -> [f32x16<S>; 3] {
    [
        linear(a[0], b[0], c[0], at),
        linear(a[1], b[1], c[1], at),
        linear(a[2], b[2], c[2], at),
    ]
}

#[inline(always)]
fn min3<S: Simd>(v: [f32x16<S>; 3]) -> f32x16<S> {
    v[0].min(v[1]).min(v[2])
}

#[inline(always)]
fn max3<S: Simd>(v: [f32x16<S>; 3]) -> f32x16<S> {
    v[0].max(v[1]).max(v[2])
}

/// A bit for every lane of a mask, in the cheapest way at every level.
#[inline(always)]
fn bits_of<S: Simd>(simd: S, mask: mask32x16<S>) -> u32 {
    let (low, high) = simd.split_mask32x16(mask);
    low.to_bitmask() as u32 | (high.to_bitmask() as u32) << 8
}
