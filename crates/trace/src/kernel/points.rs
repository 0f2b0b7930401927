//! Triangles against scattered raster points, sixteen at a time: the hard shadow rays of one cell of a light's
//! grid (HM08 §5.2), which all leave the light's position and end at the points.
//!
//! Cost: about 25 vector instructions for sixteen points and one triangle.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*};

use super::edges::EdgeRecord;
use super::{LANES, NEARNESS_BAND, SimdLevel};

/// A caster: its record relative to `origin`, a raster point of its own. 80 bytes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct Caster {
    pub(crate) record: EdgeRecord,
    pub(crate) origin: [f32; 2],
}

/// Up to sixteen points that share a cell.
#[derive(Clone, Debug)]
pub(crate) struct PointLanes {
    pub(crate) x: [f32; LANES],
    pub(crate) y: [f32; LANES],
    pub(crate) nearness: [f32; LANES],
    /// The triangle each point lies on, which does not shadow it.
    pub(crate) own: [u32; LANES],
    pub(crate) count: usize,
}

impl Default for PointLanes {
    fn default() -> Self {
        Self { x: [0.0; LANES], y: [0.0; LANES], nearness: [0.0; LANES], own: [0; LANES], count: 0 }
    }
}

/// Tests the points against the casters `refs` until all are shadowed. Returns a bit for every point that
/// certainly is; `unsure(lane, prim)` is told of pairs that f32 could not tell, whether or not the point is
/// found in shadow later.
pub(crate) fn shadowed(
    level: SimdLevel,
    points: &PointLanes,
    casters: &[Caster],
    refs: &[u32],
    unsure: &mut Vec<(u32, u32)>,
) -> u32 {
    dispatch!(level.0, simd => shadowed_impl(simd, points, casters, refs, unsure))
}

#[inline(always)]
fn shadowed_impl<S: Simd>(
    simd: S,
    points: &PointLanes,
    casters: &[Caster],
    refs: &[u32],
    unsure: &mut Vec<(u32, u32)>,
) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let x = f32x16::from_slice(simd, &points.x);
    let y = f32x16::from_slice(simd, &points.y);
    let nearness = f32x16::from_slice(simd, &points.nearness);
    let (nearer, farther) = (splat(1.0 - NEARNESS_BAND), splat(1.0 + NEARNESS_BAND));
    let all = u32::MAX >> (32 - points.count as u32);
    let mut open = all;
    for &r in refs {
        let Caster { record, origin } = &casters[r as usize];
        let (px, py) = (x - splat(origin[0]), y - splat(origin[1]));
        let plane = |a: f32, b: f32, c: f32| splat(a).mul_add(px, splat(b).mul_add(py, splat(c)));
        let g = |i: usize| plane(record.a[i], record.b[i], record.c[i]);
        let inside = g(0).min(g(1)).min(g(2));
        let covered = inside.simd_ge(splat(-1.0));
        if covered.all_false() {
            continue;
        }
        let n = plane(record.nearness_x, record.nearness_y, record.nearness);
        let vague = n.simd_lt(splat(record.floor)) | n.simd_gt(splat(record.ceiling));
        let possible = covered & ((n * farther).simd_ge(nearness) | vague);
        let mut candidates = possible.to_bitmask() as u32 & open;
        if candidates == 0 {
            continue;
        }
        for lane in 0..points.count {
            candidates &= !(u32::from(points.own[lane] == record.prim) << lane);
        }
        let sure = inside.simd_gt(splat(1.0)) & (n * nearer).simd_gt(nearness) & !vague;
        let sure = sure.to_bitmask() as u32 & candidates;
        open &= !sure;
        let mut rest = candidates & !sure;
        while rest != 0 {
            unsure.push((rest.trailing_zeros(), record.prim));
            rest &= rest - 1;
        }
        if open == 0 {
            break;
        }
    }
    all & !open
}
