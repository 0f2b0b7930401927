//! Sixteen raster points in the hierarchy of a light, whose nodes hold sixteen boxes of the light's raster: hard shadow
//! rays in the manner of Hunt and Mark's adaptive structures.
//!
//! A ray of the light is a raster point, so a node is entered by those points that lie in its rectangle and not before the
//! nearest of its casters. A node's boxes are held against the rectangle of all points first, sixteen boxes at once; then
//! each box that is left against the points, sixteen at once.
//!
//! Cost: 10 vector instructions a node and 10 a box that is left, 25 a caster.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*};

use super::points::{Caster, PointLanes, open_past};
use super::shaft::{Boxes, FAR, mask_of};
use super::{LANES, SimdLevel};

/// Sixteen boxes and what is in them. 448 bytes.
#[derive(Clone, Debug, Default)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) boxes: Boxes,
    /// Position of a node, or with [`CASTER`] of a caster.
    pub(crate) child: [u32; LANES],
}

/// Marks a caster among the children.
pub(crate) const CASTER: u32 = 1 << 31;

/// Working memory of a walk, and what it counted.
#[derive(Clone, Debug, Default)]
pub(crate) struct Walk {
    stack: Vec<(u32, u32)>,
    /// Nodes entered, once for each point.
    pub(crate) nodes: u64,
    /// Casters in whose box a point lay, once for each point.
    pub(crate) tests: u64,
    /// A bit for each point of the last sixteen in whose way some caster's box was.
    pub(crate) tested: u32,
    /// Pairs of lane and triangle that f32 could not tell.
    pub(crate) unsure: Vec<(u32, u32)>,
}

/// Walks the tree from its first node; returns those of the `active` points that no caster certainly shadows.
pub(crate) fn walk(
    level: SimdLevel,
    (nodes, casters): (&[Node], &[Caster]),
    points: &PointLanes,
    active: u32,
    walk: &mut Walk,
) -> u32 {
    dispatch!(level.0, simd => walk_impl(simd, (nodes, casters), points, active, walk))
}

#[inline(always)]
fn walk_impl<S: Simd>(
    simd: S,
    (nodes, casters): (&[Node], &[Caster]),
    points: &PointLanes,
    active: u32,
    walk: &mut Walk,
) -> u32 {
    let at = [
        f32x16::from_slice(simd, &points.x),
        f32x16::from_slice(simd, &points.y),
        f32x16::from_slice(simd, &points.nearness),
    ];
    let mask = mask_of(simd, active);
    let around = Around {
        low: [least(simd, mask, at[0]), least(simd, mask, at[1])],
        high: [most(simd, mask, at[0]), most(simd, mask, at[1])],
        farthest: least(simd, mask, at[2]),
    };
    let mut open = active;
    walk.tested = 0;
    walk.unsure.clear();
    walk.stack.clear();
    walk.stack.push((0, active));
    while let Some((index, lanes)) = walk.stack.pop() {
        let lanes = lanes & open;
        if lanes == 0 {
            continue;
        }
        walk.nodes += u64::from(lanes.count_ones());
        let node = &nodes[index as usize];
        let mut hit = met(simd, &node.boxes, &around);
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let within = within(simd, node.boxes.get(lane), at) & lanes & open;
            if within == 0 {
                continue;
            }
            let child = node.child[lane];
            if child & CASTER == 0 {
                walk.stack.push((child, within));
                continue;
            }
            walk.tests += u64::from(within.count_ones());
            walk.tested |= within;
            let caster = &casters[(child & !CASTER) as usize];
            let left = open_past(simd, caster, (at, points), within, &mut walk.unsure);
            open &= left | !within;
        }
    }
    open
}

#[inline(always)]
fn least<S: Simd>(simd: S, mask: fearless_simd::mask32x16<S>, v: f32x16<S>) -> f32 {
    mask.select(v, f32x16::splat(simd, FAR)).reduce_min()
}

#[inline(always)]
fn most<S: Simd>(simd: S, mask: fearless_simd::mask32x16<S>, v: f32x16<S>) -> f32 {
    mask.select(v, f32x16::splat(simd, -FAR)).reduce_max()
}

/// What bounds the points.
struct Around {
    low: [f32; 2],
    high: [f32; 2],
    /// Nearness of the farthest.
    farthest: f32,
}

/// A bit for each box that some point may lie in.
#[inline(always)]
fn met<S: Simd>(simd: S, boxes: &Boxes, around: &Around) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let hit = f32x16::from_slice(simd, &boxes.nearest).simd_ge(splat(around.farthest))
        & f32x16::from_slice(simd, &boxes.x[0]).simd_le(splat(around.high[0]))
        & f32x16::from_slice(simd, &boxes.x[1]).simd_ge(splat(around.low[0]))
        & f32x16::from_slice(simd, &boxes.y[0]).simd_le(splat(around.high[1]))
        & f32x16::from_slice(simd, &boxes.y[1]).simd_ge(splat(around.low[1]));
    hit.to_bitmask() as u32
}

/// A bit for each point that lies in a box, and not before it.
#[inline(always)]
fn within<S: Simd>(simd: S, [x0, x1, y0, y1, nearest, _]: [f32; 6], [x, y, n]: [f32x16<S>; 3]) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let hit = x.simd_ge(splat(x0))
        & x.simd_le(splat(x1))
        & y.simd_ge(splat(y0))
        & y.simd_le(splat(y1))
        & n.simd_le(splat(nearest));
    hit.to_bitmask() as u32
}
