//! Triangles against up to sixteen raster points of one cell, every one of them that may lie before each point: what
//! masked and blended surfaces ask, where one hit does not settle a ray.
//!
//! Cost: about 25 vector instructions for sixteen points and one triangle, as for [`super::points::shadowed`].

use fearless_simd::{Simd, dispatch, f32x16, prelude::*, u32x16};

use super::SimdLevel;
use super::points::{Caster, Met, PointLanes, met};

/// A triangle that lies before a point, or may.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Veiled {
    /// The point.
    pub(crate) lane: u32,
    pub(crate) prim: u32,
    /// Whether the point's ray is certain to meet the triangle, at whatever depth.
    pub(crate) met: bool,
}

/// Notes the triangles `refs` that may lie before one of the `open` points (a bit each), in their order.
pub(crate) fn veiled(
    level: SimdLevel,
    points: &PointLanes,
    open: u32,
    casters: &[Caster],
    refs: &[u32],
    found: &mut Vec<Veiled>,
) {
    dispatch!(level.0, simd => veiled_impl(simd, points, open, casters, refs, found));
}

#[inline(always)]
fn veiled_impl<S: Simd>(
    simd: S,
    points: &PointLanes,
    open: u32,
    casters: &[Caster],
    refs: &[u32],
    found: &mut Vec<Veiled>,
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let x = f32x16::from_slice(simd, &points.x);
    let y = f32x16::from_slice(simd, &points.y);
    let nearness = f32x16::from_slice(simd, &points.nearness);
    for &r in refs {
        let caster = &casters[r as usize];
        let record = &caster.record;
        let Some(Met { inside, possible, .. }) = met(simd, caster, [x, y, nearness]) else {
            continue;
        };
        let own = u32x16::from_slice(simd, &points.own).simd_eq(u32x16::splat(simd, record.prim));
        let mut left = possible.to_bitmask() as u32 & !(own.to_bitmask() as u32) & open;
        let met = inside.simd_gt(splat(1.0)).to_bitmask() as u32;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            found.push(Veiled {
                lane,
                prim: record.prim,
                met: met >> lane & 1 != 0,
            });
        }
    }
}
