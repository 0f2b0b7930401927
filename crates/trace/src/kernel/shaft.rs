//! Which triangles may lie between an area light and a batch of receivers, sixteen boxes or triangles at a time.
//!
//! In the perspective space of a point behind the light (X and Y are raster coordinates, n is nearness) the ray from a
//! receiver (X0, Y0, w) to a point of the light at (s, t) and depth u is the line
//!
//! ```text
//! X(n) = X0 + (s - u X0) pz / (pz - u) (n - w),   pz = 1 / w
//! ```
//!
//! so rays drift sideways by at most `drift` (n - w), where n - w is how much nearer to the light they are: not at all
//! beside their receiver, fully beside the light. A box is searched only if it is nearer than the farthest receiver
//! and the batch's rectangle, grown by the drift up to the box's nearest point, overlaps it. Parallel views have the
//! same form, with directions instead of points.
//!
//! Triangles that pass are tested against the batch's shaft, the hull of the light's box and the receivers' box: out
//! if all receivers are before its plane, or all lines of the shaft pass outside of one of its edges. That takes some
//! 80 operations for sixteen triangles; every error is on the side of keeping.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::LANES;
use super::lines::{Group, LightBox, ReceiverLanes, abs3, dot, each3, load3};

/// Sixteen boxes in a light's perspective space. 320 bytes.
#[derive(Clone, Debug)]
#[repr(C)]
pub(crate) struct Boxes {
    pub(crate) x: [[f32; LANES]; 2],
    pub(crate) y: [[f32; LANES]; 2],
    /// Nearness of the nearest point.
    pub(crate) nearest: [f32; LANES],
}

/// Larger than every coordinate that occurs, small enough to be multiplied.
pub(crate) const FAR: f32 = 1e30;

impl Default for Boxes {
    /// Boxes that nothing overlaps.
    fn default() -> Self {
        Self {
            x: [[FAR; LANES], [-FAR; LANES]],
            y: [[FAR; LANES], [-FAR; LANES]],
            nearest: [-FAR; LANES],
        }
    }
}

impl Boxes {
    /// The box around all of them that are not empty.
    pub(crate) fn hull(&self) -> [f32; 5] {
        let low = |v: &[f32; LANES]| v.iter().copied().fold(FAR, f32::min);
        let high = |v: &[f32; LANES]| v.iter().copied().fold(-FAR, f32::max);
        [
            low(&self.x[0]),
            high(&self.x[1]),
            low(&self.y[0]),
            high(&self.y[1]),
            high(&self.nearest),
        ]
    }

    /// Sets one of them: smallest and largest x, y, and the nearness.
    pub(crate) fn set(&mut self, lane: usize, [x0, x1, y0, y1, nearest]: [f32; 5]) {
        (self.x[0][lane], self.x[1][lane]) = (x0, x1);
        (self.y[0][lane], self.y[1][lane]) = (y0, y1);
        self.nearest[lane] = nearest;
    }
}

/// A frame as the kernels see it: lengths scaled, relative to the same origin as the receivers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameLanes {
    pub(crate) right: [f32; 3],
    pub(crate) up: [f32; 3],
    pub(crate) forward: [f32; 3],
    pub(crate) center: [f32; 3],
    /// Half extents of the light across the view; as tangents in a parallel view.
    pub(crate) half: [f32; 2],
    /// Depth of the light's farthest point.
    pub(crate) depth: f32,
    /// In a parallel view, nearness + depth.
    pub(crate) reach: Option<f32>,
}

/// Bounds of receivers in a light's perspective space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    pub(crate) x: [f32; 2],
    pub(crate) y: [f32; 2],
    /// Smallest and largest depth.
    pub(crate) depth: [f32; 2],
}

impl Bounds {
    /// Bounds of the receivers whose bits are set in `active`.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(simd: S, frame: &FrameLanes, receivers: &ReceiverLanes, active: u32) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let p = load3(simd, &receivers.p);
        let p = each3(|axis| p[axis] - splat(frame.center[axis]));
        let plain = |a: [f32; 3]| p[0] * splat(a[0]) + p[1] * splat(a[1]) + p[2] * splat(a[2]);
        let (along, above, depth) = (plain(frame.right), plain(frame.up), plain(frame.forward));
        let size = frame.center[0].abs() + frame.center[1].abs() + frame.center[2].abs();
        let error = (f32x16::from_slice(simd, &receivers.size) * splat(3.0) + splat(size))
            * splat(8.0 * f32::EPSILON);
        let active = mask_of(simd, active);
        let least = |v: f32x16<S>| active.select(v, splat(FAR)).reduce_min();
        let most = |v: f32x16<S>| active.select(v, splat(-FAR)).reduce_max();
        let (low, high) = (depth - error, depth + error);
        let known = low.simd_gt(splat(0.0));
        let range = |side: f32x16<S>| {
            if frame.reach.is_some() {
                return [least(side - error), most(side + error)];
            }
            let at = side / depth;
            let slack =
                error * (splat(1.0) + at.abs()) / low * splat(1.01) + at.abs() * splat(4.0 * f32::EPSILON);
            let from = known.select(at - slack, splat(-FAR));
            let to = known.select(at + slack, splat(FAR));
            [least(from.max(splat(-FAR))), most(to.min(splat(FAR)))]
        };
        Self {
            x: range(along),
            y: range(-above),
            depth: [least(low), most(high)],
        }
    }

    /// The bounds of both.
    #[inline(always)]
    pub(crate) fn union(&self, other: &Self) -> Self {
        let union = |a: [f32; 2], b: [f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            x: union(self.x, other.x),
            y: union(self.y, other.y),
            depth: union(self.depth, other.depth),
        }
    }
}

/// Lanes whose bits are set.
#[inline(always)]
fn mask_of<S: Simd>(simd: S, bits: u32) -> fearless_simd::mask32x16<S> {
    let set = f32x16::from_fn(simd, |i| if bits & (1 << i) != 0 { 1.0 } else { 0.0 });
    set.simd_gt(f32x16::splat(simd, 0.0))
}

/// What is searched for: the rays from receivers within bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    x: [f32; 2],
    y: [f32; 2],
    /// Nearness of the farthest receiver.
    farthest: f32,
    /// Sideways drift of rays per unit of nearness.
    drift: [f32; 2],
}

impl Search {
    #[inline(always)]
    pub(crate) fn new(frame: &FrameLanes, bounds: &Bounds) -> Self {
        let Bounds { x, y, depth } = *bounds;
        if let Some(reach) = frame.reach {
            return Self {
                x,
                y,
                farthest: reach - depth[1] - reach * 4.0 * f32::EPSILON,
                drift: frame.half,
            };
        }
        let drift = |half: f32, range: [f32; 2]| {
            // Written so that what is not a number becomes FAR.
            if depth[0] > frame.depth * 1.001 && depth[0] > 0.0 {
                let slope = half + frame.depth * range[0].abs().max(range[1].abs());
                (slope * depth[0] / (depth[0] - frame.depth) * 1.0001).min(FAR)
            } else {
                FAR
            }
        };
        Self {
            x,
            y,
            farthest: if depth[1] > 0.0 {
                (1.0 - 2.0 * f32::EPSILON) / depth[1]
            } else {
                -FAR
            },
            drift: [drift(frame.half[0], x), drift(frame.half[1], y)],
        }
    }
}

/// A bit for each of sixteen boxes that the rays may meet.
#[inline(always)]
pub(crate) fn overlapped<S: Simd>(simd: S, boxes: &Boxes, batch: &Search) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let load = |v: &[f32; LANES]| f32x16::from_slice(simd, v);
    let nearer = load(&boxes.nearest) - splat(batch.farthest);
    let mut hit = nearer.simd_ge(splat(0.0));
    for (sides, range, drift) in [
        (&boxes.x, batch.x, batch.drift[0]),
        (&boxes.y, batch.y, batch.drift[1]),
    ] {
        let drift = nearer * splat(drift);
        // The slack covers the rounding of these few operations.
        let low = splat(range[0]) - drift * splat(1.00001);
        let high = drift * splat(1.00001) + splat(range[1]);
        hit = hit & load(&sides[0]).simd_le(high) & load(&sides[1]).simd_ge(low);
    }
    hit.to_bitmask() as u32
}

/// A box of receivers, with axes of its own: two along the surface they are on, as far as there is one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReceiverBox {
    middle: [f32; 3],
    /// Half sides.
    axes: [[f32; 3]; 3],
    /// Half sides of the box along the coordinate axes around it.
    half: [f32; 3],
    /// The largest of the receivers' error bounds of edges and planes, see [`ReceiverLanes`].
    edge_error: f32,
    plane_error: f32,
}

/// Unit axes for a box of receivers: those of the surface between the active lanes. Any axes would be right.
pub(crate) fn surface_axes(receivers: &ReceiverLanes, active: u32) -> [[f32; 3]; 3] {
    use glam::Vec3;
    let at = |lane: u32| Vec3::from(each3(|axis| receivers.p[axis][lane as usize]));
    let first = active.trailing_zeros();
    let last = 31 - active.leading_zeros();
    let (a, b) = (at(first), at(last));
    let along = b - a;
    // Of some lanes the one farthest from the line between the first and the last.
    let mut across = Vec3::ZERO;
    for lane in (first..last)
        .skip(3)
        .step_by(3)
        .filter(|lane| active & (1 << lane) != 0)
    {
        let normal = along.cross(at(lane) - a);
        if normal.length_squared() > across.length_squared() {
            across = normal;
        }
    }
    match (along.try_normalize(), across.try_normalize()) {
        (Some(u), Some(n)) => [u, n.cross(u), n].map(|axis| axis.to_array()),
        _ => Vec3::AXES.map(|axis| axis.to_array()),
    }
}

impl ReceiverBox {
    /// The box of the receivers whose bits are set in `active`, for each batch.
    #[inline(always)]
    pub(crate) fn of<S: Simd>(
        simd: S,
        axes: [[f32; 3]; 3],
        batches: &[ReceiverLanes],
        active: &[u32],
    ) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (mut low, mut high) = ([FAR; 3], [-FAR; 3]);
        let (mut size, mut edge_error, mut plane_error) = (0f32, 0f32, 0f32);
        for (receivers, &active) in batches.iter().zip(active) {
            if active == 0 {
                continue;
            }
            let active = mask_of(simd, active);
            let p = load3(simd, &receivers.p);
            for i in 0..3 {
                let at = dot(simd, p, axes[i]);
                low[i] = low[i].min(active.select(at, splat(FAR)).reduce_min());
                high[i] = high[i].max(active.select(at, splat(-FAR)).reduce_max());
            }
            let most = |v: &[f32; LANES]| {
                let v = f32x16::from_slice(simd, v);
                active.select(v, splat(0.0)).reduce_max()
            };
            size = size.max(most(&receivers.size));
            edge_error = edge_error.max(most(&receivers.edge_error));
            plane_error = plane_error.max(most(&receivers.plane_error));
        }
        // Rounding of these sums, and axes that are not quite orthogonal.
        let slack = size * 16.0 * f32::EPSILON;
        let half = each3(|i| (high[i] - low[i]) * 0.5 + slack);
        let share = each3(|i| (high[i] + low[i]) * 0.5);
        let axis = |k: usize| axes[0][k] * share[0] + axes[1][k] * share[1] + axes[2][k] * share[2];
        let scaled = each3(|i| each3(|k| axes[i][k] * half[i]));
        Self {
            middle: each3(axis),
            axes: scaled,
            half: each3(|k| scaled[0][k].abs() + scaled[1][k].abs() + scaled[2][k].abs()),
            edge_error,
            plane_error,
        }
    }
}

/// Of the triangles `candidates` of a group, those that may meet a line of the shaft.
#[inline(always)]
pub(crate) fn culled<S: Simd>(
    simd: S,
    group: &Group,
    light: &LightBox,
    receivers: &ReceiverBox,
    candidates: u32,
) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (p, h, axes) = (receivers.middle, receivers.half, &receivers.axes);
    let over = |v: [f32x16<S>; 3]| {
        dot(simd, v, axes[0]).abs() + dot(simd, v, axes[1]).abs() + dot(simd, v, axes[2]).abs()
    };
    let normal = load3(simd, &group.normal);
    let before = dot(simd, normal, p) - f32x16::from_slice(simd, &group.height) - over(normal);
    // The box has rounding errors of its own.
    let slack = |error: f32| splat(error * 2.0);
    let mut kept = !before.simd_gt(slack(receivers.plane_error));
    if (kept.to_bitmask() as u32 & candidates) == 0 {
        return 0;
    }
    for i in 0..3 {
        let (m, e) = (load3(simd, &group.m[i]), load3(simd, &group.e[i]));
        let cross = |a: usize, b: usize, add: f32x16<S>| e[a].mul_add(splat(p[b]), add) - e[b] * splat(p[a]);
        let gradient = [cross(1, 2, m[0]), cross(2, 0, m[1]), cross(0, 1, m[2])];
        let sizes = abs3(e);
        let spread = |a: usize, b: usize| sizes[a] * splat(h[b]) + sizes[b] * splat(h[a]);
        let spreads = [spread(1, 2), spread(2, 0), spread(0, 1)];
        let mut most = dot(simd, gradient, light.middle)
            + dot(simd, abs3(gradient), light.half)
            + dot(simd, spreads, light.reach);
        if light.weight != 0.0 {
            most = most - dot(simd, m, p) + over(m);
        }
        kept &= !most.simd_lt(-slack(receivers.edge_error));
    }
    kept.to_bitmask() as u32 & candidates
}
