//! The cosine between a triangle and the direction to a light, to 8 bits, for a tile of pixels.
//!
//! Over a flat triangle the distance of the light from the triangle's plane is one number, `facet`, so that the
//! cosine at a point is `facet / |light - point|`. With nearness instead of depth the whole expression is scaled
//! by it and needs no reciprocal.
//!
//! Cost: some 30 vector instructions, one of them a square root and one a division, for sixteen pixels, and a
//! look-up of each pixel's facet. Rounding shows in the last of the 8 bits at most.

use fearless_simd::{Simd, SimdFloat, dispatch, f32x16, prelude::*, u32x16};

use super::tile::{BLOCK, NONE};
use super::{LANES, SimdLevel};

/// Value of a pixel that sees nothing.
pub(crate) const BACKGROUND: u8 = 0;

/// Value of a surface that no light reaches; light adds up to what is left of 255.
pub(crate) const DARK: f32 = 32.0;

/// Rays and light of one frame, relative to the center of the view: a pixel's ray at raster point (x, y) is
/// `origin(x, y) + depth * dir(x, y)`, both affine, in rows of constant, x and y.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LambertFrame {
    pub(crate) dir: [[f32; 3]; 3],
    pub(crate) origin: [[f32; 3]; 3],
    /// The light; `None` if it comes from a direction, and facets are cosines already.
    pub(crate) light: Option<[f32; 3]>,
    /// Of a parallel view, see [`crate::view::Arrangement`].
    pub(crate) reach: f32,
    /// Whether the view is parallel.
    pub(crate) parallel: bool,
}

/// Where a tile of blocks lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LambertTile {
    /// Blocks in a row.
    pub(crate) stride: u32,
    /// Raster point of the tile's corner.
    pub(crate) corner: [u32; 2],
    /// Whether blocks have depth, not nearness.
    pub(crate) depth: bool,
}

/// Shades the blocks of a tile; `block` gives ids and nearness or depth of the one in a column and a row, `facet` a
/// triangle's.
pub(crate) fn lambert<'t>(
    level: SimdLevel,
    frame: &LambertFrame,
    tile: &LambertTile,
    block: impl Fn(u32, u32) -> (&'t [u32; LANES], &'t [f32; LANES]),
    facet: impl Fn(u32) -> f32,
    out: &mut [[u8; LANES]],
) {
    dispatch!(level.0, simd => lambert_impl(simd, frame, tile, &block, &facet, out));
}

#[inline(always)]
fn lambert_impl<'t, S: Simd>(
    simd: S,
    frame: &LambertFrame,
    tile: &LambertTile,
    block: &impl Fn(u32, u32) -> (&'t [u32; LANES], &'t [f32; LANES]),
    facet: &impl Fn(u32) -> f32,
    out: &mut [[u8; LANES]],
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let lane_x = f32x16::from_fn(simd, |i| (i % BLOCK as usize) as f32 + 0.5);
    let lane_y = f32x16::from_fn(simd, |i| (i / BLOCK as usize) as f32 + 0.5);
    for (i, out) in out.iter_mut().enumerate() {
        let (column, row) = (i as u32 % tile.stride, i as u32 / tile.stride);
        let (prims, order) = block(column, row);
        let seen = !u32x16::from_slice(simd, prims).simd_eq(u32x16::splat(simd, NONE));
        if seen.all_false() {
            *out = [BACKGROUND; LANES];
            continue;
        }
        let facets = facets_of(prims, facet);
        let mut value = f32x16::from_slice(simd, &facets);
        if let Some(light) = frame.light {
            let x = lane_x + splat((tile.corner[0] + column * BLOCK) as f32);
            let y = lane_y + splat((tile.corner[1] + row * BLOCK) as f32);
            let affine = |rows: &[[f32; 3]; 3], i: usize| {
                splat(rows[1][i]).mul_add(x, splat(rows[2][i]).mul_add(y, splat(rows[0][i])))
            };
            let order = f32x16::from_slice(simd, order);
            // The light seen from the point, times `scale`.
            let (scale, depth, scaled) = match (tile.depth, frame.parallel) {
                (true, _) => (splat(1.0), order, false),
                (false, true) => (splat(1.0), splat(frame.reach) - order, false),
                (false, false) => (order, splat(1.0), true),
            };
            let offset = |i: usize| {
                let to_light = if scaled {
                    scale * splat(light[i])
                } else {
                    splat(light[i])
                };
                let along = depth * affine(&frame.dir, i);
                if frame.parallel {
                    to_light - along - affine(&frame.origin, i)
                } else {
                    to_light - along
                }
            };
            let (dx, dy, dz) = (offset(0), offset(1), offset(2));
            let squared = dx.mul_add(dx, dy.mul_add(dy, dz * dz));
            value = value * scale / squared.max(splat(f32::MIN_POSITIVE)).sqrt();
        }
        let light = value.max(splat(0.0)).min(splat(1.0)) * splat(255.0 - DARK);
        let shown = seen.select(light + splat(DARK + 0.5), splat(f32::from(BACKGROUND)));
        let shown: [f32; LANES] = shown.into();
        *out = shown.map(|v| v as u8);
    }
}

/// One look-up where all pixels see one triangle.
#[inline(always)]
fn facets_of(prims: &[u32; LANES], facet: &impl Fn(u32) -> f32) -> [f32; LANES] {
    if prims.iter().all(|&p| p == prims[0]) {
        [facet(prims[0]); LANES]
    } else {
        std::array::from_fn(|i| if prims[i] == NONE { 0.0 } else { facet(prims[i]) })
    }
}
