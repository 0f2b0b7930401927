//! The cosine between a triangle and the direction to a light, to 8 bits, for a tile of pixels.
//!
//! Over a flat triangle the distance of the light from the triangle's plane is one number, `facet`, so that the
//! cosine at a point is `facet / |light - point|`. With nearness instead of depth the whole expression is scaled
//! by it and needs no reciprocal.
//!
//! Cost: some 25 vector instructions, one of them a square root and one a division, for sixteen pixels, and a
//! look-up of each pixel's facet. Rounding shows in the last of the 8 bits at most.

use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*, u32x16};

use super::tile::{BLOCK, NONE};
use super::{LANES, SimdLevel, load3, splat3};

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
/// triangle's, and 0 for [`NONE`], if it is known, and `find` those of a block of which one is not.
pub(crate) fn lambert<'t>(
    level: SimdLevel,
    frame: &LambertFrame,
    tile: &LambertTile,
    block: impl Fn(u32, u32) -> (&'t [u32; LANES], &'t [f32; LANES]),
    (facet, find): (
        impl Fn(u32) -> Option<f32>,
        impl Fn(&[u32; LANES]) -> [f32; LANES],
    ),
    out: &mut [[u8; LANES]],
) {
    dispatch!(level.0, simd => lambert_impl(simd, frame, tile, &block, (&facet, &find), out));
}

#[inline(always)]
fn lambert_impl<'t, S: Simd>(
    simd: S,
    frame: &LambertFrame,
    tile: &LambertTile,
    block: &impl Fn(u32, u32) -> (&'t [u32; LANES], &'t [f32; LANES]),
    (facet, find): (
        &impl Fn(u32) -> Option<f32>,
        &impl Fn(&[u32; LANES]) -> [f32; LANES],
    ),
    out: &mut [[u8; LANES]],
) {
    // What pixels of a block add to its first pixel's ray.
    let (dir, origin) = (lane_offsets(&frame.dir), lane_offsets(&frame.origin));
    for (i, out) in out.iter_mut().enumerate() {
        let (column, row) = (i as u32 % tile.stride, i as u32 / tile.stride);
        let (prims, order) = block(column, row);
        let lanes = u32x16::from_slice(simd, prims);
        let seen = !lanes.simd_eq(u32x16::splat(simd, NONE));
        if seen.all_false() {
            *out = [BACKGROUND; LANES];
            continue;
        }
        let uniform = lanes.simd_eq(u32x16::splat(simd, prims[0])).all_true();
        let mut value = if uniform {
            let facet = facet(prims[0]).unwrap_or_else(|| find(prims)[0]);
            f32x16::splat(simd, facet)
        } else {
            let facets = known_facets(prims, facet).unwrap_or_else(|| find(prims));
            f32x16::from_slice(simd, &facets)
        };
        if let Some(light) = frame.light {
            let corner = [tile.corner[0] + column * BLOCK, tile.corner[1] + row * BLOCK];
            let dir = affine(simd, &frame.dir, &dir, corner);
            let order = f32x16::from_slice(simd, order);
            value = if frame.parallel {
                let origin = affine(simd, &frame.origin, &origin, corner);
                let depth = if tile.depth {
                    order
                } else {
                    f32x16::splat(simd, frame.reach) - order
                };
                cosines_at_depth(simd, light, [dir, origin], depth, value)
            } else if tile.depth {
                let origin = [f32x16::splat(simd, 0.0); 3];
                cosines_at_depth(simd, light, [dir, origin], order, value)
            } else {
                cosines(simd, light, dir, order, value)
            };
        }
        let zero = f32x16::splat(simd, 0.0);
        let light = value.max(zero).min(f32x16::splat(simd, 1.0));
        let light = light * f32x16::splat(simd, 255.0 - DARK) + f32x16::splat(simd, DARK + 0.5);
        let shown = seen.select(light, f32x16::splat(simd, f32::from(BACKGROUND)));
        let shown: [i32; LANES] = shown.to_int::<i32x16<S>>().into();
        for lane in 0..LANES {
            out[lane] = shown[lane] as u8;
        }
    }
}

/// Cosines from facets, of a perspective view: the light as seen from the points is scaled by nearness, which saves a
/// reciprocal.
#[inline(always)]
fn cosines<S: Simd>(
    simd: S,
    light: [f32; 3],
    dir: [f32x16<S>; 3],
    nearness: f32x16<S>,
    facets: f32x16<S>,
) -> f32x16<S> {
    let light = splat3(simd, light);
    let mut squared = f32x16::splat(simd, f32::MIN_POSITIVE);
    for axis in 0..3 {
        let offset = nearness * light[axis] - dir[axis];
        squared = offset.mul_add(offset, squared);
    }
    facets * nearness / squared.sqrt()
}

/// Cosines from facets at points of known depth.
#[inline(always)]
fn cosines_at_depth<S: Simd>(
    simd: S,
    light: [f32; 3],
    [dir, origin]: [[f32x16<S>; 3]; 2],
    depth: f32x16<S>,
    facets: f32x16<S>,
) -> f32x16<S> {
    let light = splat3(simd, light);
    let mut squared = f32x16::splat(simd, f32::MIN_POSITIVE);
    for axis in 0..3 {
        let offset = light[axis] - depth * dir[axis] - origin[axis];
        squared = offset.mul_add(offset, squared);
    }
    facets / squared.sqrt()
}

/// x and y of an affine function's slopes for the pixels of a block, counted from its corner.
#[inline(always)]
fn lane_offsets(rows: &[[f32; 3]; 3]) -> [[f32; LANES]; 3] {
    let mut offsets = [[0.0; LANES]; 3];
    for (axis, offsets) in offsets.iter_mut().enumerate() {
        for (lane, offset) in offsets.iter_mut().enumerate() {
            let (x, y) = (lane % BLOCK as usize, lane / BLOCK as usize);
            *offset = rows[1][axis] * (x as f32 + 0.5) + rows[2][axis] * (y as f32 + 0.5);
        }
    }
    offsets
}

/// An affine function at the pixels of the block with that corner.
#[inline(always)]
fn affine<S: Simd>(
    simd: S,
    rows: &[[f32; 3]; 3],
    offsets: &[[f32; LANES]; 3],
    corner: [u32; 2],
) -> [f32x16<S>; 3] {
    let (x, y) = (corner[0] as f32, corner[1] as f32);
    let mut start = [0.0; 3];
    for (axis, start) in start.iter_mut().enumerate() {
        *start = rows[0][axis] + rows[1][axis] * x + rows[2][axis] * y;
    }
    let (start, offsets) = (splat3(simd, start), load3(simd, offsets));
    [
        start[0] + offsets[0],
        start[1] + offsets[1],
        start[2] + offsets[2],
    ]
}

/// The facets of a block, if all are known. Its pixels change triangles in no order that a processor could foresee, so each is
/// looked up.
#[inline(always)]
fn known_facets(prims: &[u32; LANES], facet: &impl Fn(u32) -> Option<f32>) -> Option<[f32; LANES]> {
    let mut facets = [0.0; LANES];
    let mut known = true;
    for lane in 0..LANES {
        let value = facet(prims[lane]);
        known &= value.is_some();
        facets[lane] = value.unwrap_or(0.0);
    }
    known.then_some(facets)
}
