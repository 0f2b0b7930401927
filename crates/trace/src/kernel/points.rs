//! Triangles against scattered raster points, sixteen at a time: the hard shadow rays of one cell of a light's
//! grid (HM08 §5.2), which all leave the light's position and end at the points.
//!
//! Cost: about 25 vector instructions for sixteen points and one triangle.

use fearless_simd::{Simd, dispatch, f32x16, mask32x16, prelude::*, u32x16};

use super::edges::{EdgeLanes, EdgeRecord, Origin, VertexLanes, set_up};
use super::{LANES, NEARNESS_BAND, SimdLevel};

/// A caster: its record relative to `origin`, a raster point of its own. 68 bytes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(crate) struct Caster {
    pub(crate) record: EdgeRecord,
    pub(crate) origin: [f32; 2],
}

/// Where a receiver lies in a light's raster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RasterPlace {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) nearness: f32,
    /// What is nearer than this is farther from the receiver than the receiver's error.
    pub(crate) beyond: f32,
}

/// Up to sixteen points that share a cell.
#[derive(Clone, Debug)]
pub(crate) struct PointLanes {
    pub(crate) x: [f32; LANES],
    pub(crate) y: [f32; LANES],
    pub(crate) nearness: [f32; LANES],
    /// What is nearer than this is beyond what each point may be off by.
    beyond: [f32; LANES],
    /// The triangle each point lies on, which does not shadow it.
    pub(crate) own: [u32; LANES],
}

impl Default for PointLanes {
    fn default() -> Self {
        Self {
            x: [0.0; LANES],
            y: [0.0; LANES],
            nearness: [0.0; LANES],
            beyond: [0.0; LANES],
            own: [0; LANES],
        }
    }
}

impl PointLanes {
    /// Sets one of them, which lies on triangle `own`.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, place: &RasterPlace, own: u32) {
        (self.x[lane], self.y[lane]) = (place.x, place.y);
        (self.nearness[lane], self.beyond[lane]) = (place.nearness, place.beyond);
        self.own[lane] = own;
    }
}

/// Sets up sixteen casters.
pub(crate) fn set_up_casters(level: SimdLevel, vertices: &VertexLanes, rounding: f32, out: &mut EdgeLanes) {
    dispatch!(level.0, simd => set_up(simd, vertices, Origin::OwnCorner, rounding, out));
}

/// How a caster stands to the lines of sixteen points.
pub(super) struct Met<S: Simd> {
    /// Above 1 a line certainly passes inside of the caster, below -1 certainly outside.
    pub(super) inside: f32x16<S>,
    /// The caster's, where the line meets its plane.
    pub(super) nearness: f32x16<S>,
    /// Where that nearness means nothing.
    pub(super) vague: mask32x16<S>,
    /// Whether it may lie between.
    pub(super) possible: mask32x16<S>,
}

/// `None` if no line meets it. Points are x, y and nearness.
#[inline(always)]
pub(super) fn met<S: Simd>(simd: S, caster: &Caster, [x, y, nearness]: [f32x16<S>; 3]) -> Option<Met<S>> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let Caster { record, origin } = caster;
    let at = [x - splat(origin[0]), y - splat(origin[1])];
    let g0 = plane(simd, at, [record.a[0], record.b[0], record.c[0]]);
    let g1 = plane(simd, at, [record.a[1], record.b[1], record.c[1]]);
    let g2 = plane(simd, at, [record.a[2], record.b[2], record.c[2]]);
    let inside = g0.min(g1).min(g2);
    let covered = inside.simd_ge(splat(-1.0));
    if covered.all_false() {
        return None;
    }
    let n = plane(simd, at, [record.nearness_x, record.nearness_y, record.nearness]);
    let vague = !(n.simd_ge(splat(record.floor)) & n.simd_le(splat(record.ceiling)));
    let farther = splat(1.0 + NEARNESS_BAND);
    Some(Met {
        inside,
        nearness: n,
        vague,
        possible: covered & ((n * farther).simd_ge(nearness) | vague),
    })
}

/// Value of `a x + b y + c`.
#[inline(always)]
fn plane<S: Simd>(simd: S, [x, y]: [f32x16<S>; 2], [a, b, c]: [f32; 3]) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    splat(a).mul_add(x, splat(b).mul_add(y, splat(c)))
}

/// Tests the `open` points (a bit each) against the casters `refs` until all are shadowed. Returns those that are
/// still open; `unsure` collects pairs of lane and triangle that f32 could not tell, whether or not the point
/// is found in shadow later.
pub(crate) fn shadowed(
    level: SimdLevel,
    points: &PointLanes,
    open: u32,
    casters: &[Caster],
    refs: &[u32],
    unsure: &mut Vec<(u32, u32)>,
) -> u32 {
    dispatch!(level.0, simd => shadowed_impl(simd, points, open, casters, refs, unsure))
}

#[inline(always)]
fn shadowed_impl<S: Simd>(
    simd: S,
    points: &PointLanes,
    mut open: u32,
    casters: &[Caster],
    refs: &[u32],
    unsure: &mut Vec<(u32, u32)>,
) -> u32 {
    let at = [
        f32x16::from_slice(simd, &points.x),
        f32x16::from_slice(simd, &points.y),
        f32x16::from_slice(simd, &points.nearness),
    ];
    for &r in refs {
        open = open_past(simd, &casters[r as usize], (at, points), open, unsure);
        if open == 0 {
            break;
        }
    }
    open
}

/// Of the `open` points those that one caster does not certainly shadow; `unsure` as in [`shadowed`].
#[inline(always)]
pub(super) fn open_past<S: Simd>(
    simd: S,
    caster: &Caster,
    (at, points): ([f32x16<S>; 3], &PointLanes),
    open: u32,
    unsure: &mut Vec<(u32, u32)>,
) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let prim = caster.record.prim;
    let Some(Met {
        inside,
        nearness: n,
        vague,
        possible,
    }) = met(simd, caster, at)
    else {
        return open;
    };
    let mut candidates = possible.to_bitmask() as u32 & open;
    if candidates == 0 {
        return open;
    }
    let own = u32x16::from_slice(simd, &points.own).simd_eq(u32x16::splat(simd, prim));
    candidates &= !(own.to_bitmask() as u32);
    let beyond = f32x16::from_slice(simd, &points.beyond);
    let sure = inside.simd_gt(splat(1.0)) & (n * splat(1.0 - NEARNESS_BAND)).simd_gt(beyond) & !vague;
    let sure = sure.to_bitmask() as u32 & candidates;
    let mut rest = candidates & !sure;
    while rest != 0 {
        unsure.push((rest.trailing_zeros(), prim));
        rest &= rest - 1;
    }
    open & !sure
}
