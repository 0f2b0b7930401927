//! Which triangles may lie between an area light and a batch of receivers, sixteen boxes or triangles at a time.
//!
//! In the perspective space of a point behind the light (X and Y are raster coordinates, n is nearness) the ray from a
//! receiver (X0, Y0, w) to a point of the light at (s, t) and depth u is the line
//!
//! ```text
//! X(n) = X0 + (s - u X0) pz / (pz - u) (n - w),   pz = 1 / w
//! ```
//!
//! so rays drift sideways in proportion to n - w, how much nearer to the light they are: not at all beside their receiver,
//! fully beside the light. A box is searched only if it is nearer than the farthest receiver and the batch's rectangle, drifted
//! by the smallest and the largest slope up to the box, overlaps it. Parallel views have the same form, with directions
//! instead of points.
//!
//! Triangles that pass are tested against the batch's shaft, the hull of the light's box and the receivers' box: out
//! if all receivers are before its plane, or all lines of the shaft pass outside of one of its edges. That takes some
//! 80 operations for sixteen triangles; every error is on the side of keeping.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::lines::{Group, LightBox, ReceiverLanes, abs3, dot, each3, minor};
use super::{LANES, load3, splat3};

/// Sixteen boxes in a light's perspective space. 384 bytes.
#[derive(Clone, Debug)]
#[repr(C)]
pub(crate) struct Boxes {
    pub(crate) x: [[f32; LANES]; 2],
    pub(crate) y: [[f32; LANES]; 2],
    /// Nearness of the nearest point.
    pub(crate) nearest: [f32; LANES],
    /// Nearness of the farthest point.
    pub(crate) farthest: [f32; LANES],
}

/// The smallest of all, halving by halving.
#[inline]
fn least(mut v: [f32; LANES]) -> f32 {
    for half in [8, 4, 2, 1] {
        for i in 0..half {
            v[i] = if v[i + half] < v[i] { v[i + half] } else { v[i] };
        }
    }
    v[0]
}

#[inline]
fn most(v: [f32; LANES]) -> f32 {
    -least(v.map(|v| -v))
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
            farthest: [FAR; LANES],
        }
    }
}

impl Boxes {
    /// The box around all of them that are not empty.
    pub(crate) fn hull(&self) -> [f32; 6] {
        [
            least(self.x[0]),
            most(self.x[1]),
            least(self.y[0]),
            most(self.y[1]),
            most(self.nearest),
            least(self.farthest),
        ]
    }

    /// Sets one of them: smallest and largest x, y, and the nearness of the nearest and the farthest point.
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, [x0, x1, y0, y1, nearest, farthest]: [f32; 6]) {
        let lane = lane % LANES;
        (self.x[0][lane], self.x[1][lane]) = (x0, x1);
        (self.y[0][lane], self.y[1][lane]) = (y0, y1);
        self.nearest[lane] = nearest;
        self.farthest[lane] = farthest;
    }

    /// One of them, as [`Self::set`] takes it.
    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> [f32; 6] {
        let lane = lane % LANES;
        let ([x0, x1], [y0, y1]) = (&self.x, &self.y);
        [
            x0[lane],
            x1[lane],
            y0[lane],
            y1[lane],
            self.nearest[lane],
            self.farthest[lane],
        ]
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
    /// Depths of the light's nearest and its farthest point.
    pub(crate) near: f32,
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

/// Each of sixteen receivers in a light's perspective space, like [`Bounds`].
pub(crate) struct Places<S: Simd> {
    pub(crate) x: [f32x16<S>; 2],
    pub(crate) y: [f32x16<S>; 2],
    pub(crate) depth: [f32x16<S>; 2],
}

impl<S: Simd> Places<S> {
    #[inline(always)]
    pub(crate) fn of(simd: S, frame: &FrameLanes, receivers: &ReceiverLanes) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let p = load3(simd, &receivers.p);
        let center = splat3(simd, frame.center);
        let p = [p[0] - center[0], p[1] - center[1], p[2] - center[2]];
        let size = frame.center[0].abs() + frame.center[1].abs() + frame.center[2].abs();
        let error = (f32x16::from_slice(simd, &receivers.size) * splat(3.0) + splat(size))
            * splat(8.0 * f32::EPSILON);
        let depth = plain(simd, p, frame.forward);
        let depths = [depth - error, depth + error];
        let (along, above) = (plain(simd, p, frame.right), -plain(simd, p, frame.up));
        let (x, y) = if frame.reach.is_some() {
            ([along - error, along + error], [above - error, above + error])
        } else {
            (
                divided(simd, along, depth, error),
                divided(simd, above, depth, error),
            )
        };
        Self { x, y, depth: depths }
    }

    /// A bit for each of less depth than that.
    #[inline(always)]
    pub(crate) fn nearer(&self, simd: S, depth: f32) -> u32 {
        self.depth[0].simd_lt(f32x16::splat(simd, depth)).to_bitmask() as u32
    }

    /// Bounds of those whose bits are set in `active`.
    #[inline(always)]
    pub(crate) fn bounds(&self, simd: S, active: u32) -> Bounds {
        let active = mask_of(simd, active);
        Bounds {
            x: range_of(simd, active, self.x),
            y: range_of(simd, active, self.y),
            depth: range_of(simd, active, self.depth),
        }
    }
}

/// The least of the first and the largest of the second among these lanes.
#[inline(always)]
pub(crate) fn range_of<S: Simd>(
    simd: S,
    active: fearless_simd::mask32x16<S>,
    [low, high]: [f32x16<S>; 2],
) -> [f32; 2] {
    let far = f32x16::splat(simd, FAR);
    [
        active.select(low, far).reduce_min(),
        active.select(high, -far).reduce_max(),
    ]
}

/// The scalar product with a vector that is the same for all lanes, not fused.
#[inline(always)]
pub(crate) fn plain<S: Simd>(simd: S, v: [f32x16<S>; 3], w: [f32; 3]) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    v[0] * splat(w[0]) + v[1] * splat(w[1]) + v[2] * splat(w[2])
}

/// Bounds of a raster coordinate.
#[inline(always)]
fn divided<S: Simd>(simd: S, side: f32x16<S>, depth: f32x16<S>, error: f32x16<S>) -> [f32x16<S>; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let low = depth - error;
    let known = low.simd_gt(splat(0.0));
    let at = side / depth;
    let slack = error * (splat(1.0) + at.abs()) / low * splat(1.01) + at.abs() * splat(4.0 * f32::EPSILON);
    [
        known.select(at - slack, splat(-FAR)).max(splat(-FAR)),
        known.select(at + slack, splat(FAR)).min(splat(FAR)),
    ]
}

/// Where the rays of each of sixteen receivers may pass, like [`Search`].
pub(crate) struct Reach<S: Simd> {
    x: [f32x16<S>; 2],
    y: [f32x16<S>; 2],
    nearness: [f32x16<S>; 2],
    slopes: [[f32x16<S>; 2]; 2],
}

impl<S: Simd> Reach<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, frame: &FrameLanes, places: &Places<S>) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let (x, y, depth) = (places.x, places.y, places.depth);
        if let Some(reach) = frame.reach {
            let rounding = reach * 4.0 * f32::EPSILON;
            let half = [splat(frame.half[0]), splat(frame.half[1])];
            return Self {
                x,
                y,
                nearness: [
                    splat(reach - rounding) - depth[1],
                    splat(reach + rounding) - depth[0],
                ],
                slopes: [[-half[0], half[0]], [-half[1], half[1]]],
            };
        }
        let (zero, far) = (splat(0.0), splat(FAR));
        let (less, more) = (splat(1.0 - 2.0 * f32::EPSILON), splat(1.0 + 2.0 * f32::EPSILON));
        Self {
            x,
            y,
            nearness: [
                depth[1].simd_gt(zero).select(less / depth[1], -far),
                depth[0].simd_gt(zero).select(more / depth[0], far),
            ],
            slopes: [
                slope_range(simd, frame, frame.half[0], x, depth),
                slope_range(simd, frame, frame.half[1], y, depth),
            ],
        }
    }

    /// A bit for each receiver whose rays may meet a box.
    #[inline(always)]
    pub(crate) fn meets(&self, simd: S, [x0, x1, y0, y1, nearest, farthest]: [f32; 6]) -> u32 {
        let splat = |v: f32| f32x16::splat(simd, v);
        let nearer = splat(nearest) - self.nearness[0];
        let lengths = lengths(simd, nearer, splat(farthest) - self.nearness[1]);
        let [left, right] = drifted(self.x, self.slopes[0], lengths);
        let [top, bottom] = drifted(self.y, self.slopes[1], lengths);
        let hit = nearer.simd_ge(splat(0.0))
            & right.simd_ge(splat(x0))
            & left.simd_le(splat(x1))
            & bottom.simd_ge(splat(y0))
            & top.simd_le(splat(y1));
        hit.to_bitmask() as u32
    }
}

/// How far rays go beside a box at most and at least, a little apart, which covers the rounding of what is made of them.
#[inline(always)]
fn lengths<S: Simd>(simd: S, most: f32x16<S>, least: f32x16<S>) -> [f32x16<S>; 2] {
    let zero = f32x16::splat(simd, 0.0);
    [
        most.max(zero) * f32x16::splat(simd, 1.00001),
        least.max(zero) * f32x16::splat(simd, 0.99999),
    ]
}

/// A range after rays of these slopes have gone these lengths.
#[inline(always)]
fn drifted<S: Simd>(
    range: [f32x16<S>; 2],
    slopes: [f32x16<S>; 2],
    [most, least]: [f32x16<S>; 2],
) -> [f32x16<S>; 2] {
    [
        range[0] + (slopes[0] * most).min(slopes[0] * least),
        range[1] + (slopes[1] * most).max(slopes[1] * least),
    ]
}

/// Smallest and largest slopes along an axis of the rays from receivers at these places to a light that reaches so far to
/// both sides.
#[inline(always)]
fn slope_range<S: Simd>(
    simd: S,
    frame: &FrameLanes,
    half: f32,
    at: [f32x16<S>; 2],
    depth: [f32x16<S>; 2],
) -> [f32x16<S>; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (near, far, most) = (splat(frame.near), splat(frame.depth), splat(FAR));
    let known = depth[0].simd_gt(splat(frame.depth * 1.001)) & depth[0].simd_gt(splat(0.0));
    // With depths as far apart as that, this covers what cancels in their difference.
    let steep = depth[0] / (depth[0] - far) * splat(1.001);
    let flat = depth[1] / (depth[1] - near) * splat(0.999);
    let size = far.mul_add(at[0].abs().max(at[1].abs()), splat(half)) * splat(8.0 * f32::EPSILON);
    let low = -splat(half) - (near * at[1]).max(far * at[1]) - size;
    let high = splat(half) - (near * at[0]).min(far * at[0]) + size;
    let (low, high) = ((low * steep).min(low * flat), (high * steep).max(high * flat));
    [
        known.select(low.max(-most), -most),
        known.select(high.min(most), most),
    ]
}

impl Default for Bounds {
    fn default() -> Self {
        Self::NONE
    }
}

impl Bounds {
    /// Bounds of nothing.
    pub(crate) const NONE: Self = Self {
        x: [FAR, -FAR],
        y: [FAR, -FAR],
        depth: [FAR, -FAR],
    };

    /// Whether the depths are much the same.
    #[inline(always)]
    pub(crate) fn are_close(&self) -> bool {
        self.depth[1] < 1.1 * self.depth[0]
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
pub(crate) fn mask_of<S: Simd>(simd: S, bits: u32) -> fearless_simd::mask32x16<S> {
    let set = f32x16::from_fn(simd, |i| if bits & (1 << i) != 0 { 1.0 } else { 0.0 });
    set.simd_gt(f32x16::splat(simd, 0.0))
}

/// What is searched for: the rays from receivers within bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    x: [f32; 2],
    y: [f32; 2],
    /// Nearness of the farthest and of the nearest receiver.
    nearness: [f32; 2],
    /// Smallest and largest sideways drift of rays per unit of nearness, along x and y: what is below 0 of each, and above.
    slopes: [[[f32; 2]; 2]; 2],
}

/// What is below 0 of the slopes along an axis, and above: one of the two is 0.
#[inline(always)]
fn parted([low, high]: [f32; 2]) -> [[f32; 2]; 2] {
    [[low.min(0.0), low.max(0.0)], [high.min(0.0), high.max(0.0)]]
}

impl Search {
    #[inline(always)]
    pub(crate) fn new(frame: &FrameLanes, bounds: &Bounds) -> Self {
        let Bounds { x, y, depth } = *bounds;
        if let Some(reach) = frame.reach {
            let rounding = reach * 4.0 * f32::EPSILON;
            return Self {
                x,
                y,
                nearness: [reach - depth[1] - rounding, reach - depth[0] + rounding],
                slopes: frame.half.map(|half| parted([-half, half])),
            };
        }
        let rounding = 2.0 * f32::EPSILON;
        let nearness = |depth: f32, sign: f32| {
            if depth > 0.0 {
                (1.0 + sign * rounding) / depth
            } else {
                FAR * sign
            }
        };
        Self {
            x,
            y,
            nearness: [nearness(depth[1], -1.0), nearness(depth[0], 1.0)],
            slopes: [
                parted(Self::slopes(frame, frame.half[0], x, depth)),
                parted(Self::slopes(frame, frame.half[1], y, depth)),
            ],
        }
    }

    /// The same receivers, with slopes along x and y of some of their rays.
    #[inline(always)]
    pub(crate) fn with_slopes(self, [x, y]: [[f32; 2]; 2]) -> Self {
        let slopes = [parted(x), parted(y)];
        Self { slopes, ..self }
    }

    /// As [`slope_range`].
    #[inline(always)]
    fn slopes(frame: &FrameLanes, half: f32, at: [f32; 2], depth: [f32; 2]) -> [f32; 2] {
        let (near, far) = (frame.near, frame.depth);
        // Written so that what is not a number becomes FAR.
        if depth[0] > far * 1.001 && depth[0] > 0.0 {
            let steep = depth[0] / (depth[0] - far) * 1.001;
            let flat = depth[1] / (depth[1] - near) * 0.999;
            let size = (half + far * at[0].abs().max(at[1].abs())) * (8.0 * f32::EPSILON);
            let low = -half - (near * at[1]).max(far * at[1]) - size;
            let high = half - (near * at[0]).min(far * at[0]) + size;
            [
                (low * steep).min(low * flat).max(-FAR),
                (high * steep).max(high * flat).min(FAR),
            ]
        } else {
            [-FAR, FAR]
        }
    }
}

/// A bit for each of sixteen boxes that the rays may meet.
#[inline(always)]
pub(crate) fn overlapped<S: Simd>(simd: S, boxes: &Boxes, batch: &Search) -> u32 {
    let splat = |v: f32| f32x16::splat(simd, v);
    let nearer = f32x16::from_slice(simd, &boxes.nearest) - splat(batch.nearness[0]);
    let farther = f32x16::from_slice(simd, &boxes.farthest) - splat(batch.nearness[1]);
    let lengths = lengths(simd, nearer, farther);
    let [most, least] = lengths;
    let mut hit = nearer.simd_ge(splat(0.0));
    for (sides, range, [low, high]) in [
        (&boxes.x, batch.x, &batch.slopes[0]),
        (&boxes.y, batch.y, &batch.slopes[1]),
    ] {
        // One of the two products is 0.
        let left = most.mul_add(splat(low[0]), least.mul_add(splat(low[1]), splat(range[0])));
        let right = most.mul_add(splat(high[1]), least.mul_add(splat(high[0]), splat(range[1])));
        hit = hit
            & f32x16::from_slice(simd, &sides[0]).simd_le(right)
            & f32x16::from_slice(simd, &sides[1]).simd_ge(left);
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
    /// Their largest coordinate.
    size: f32,
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

/// The largest of the values of these lanes, or 0.
#[inline(always)]
fn largest<S: Simd>(simd: S, active: fearless_simd::mask32x16<S>, v: &[f32; LANES]) -> f32 {
    let v = f32x16::from_slice(simd, v);
    active.select(v, f32x16::splat(simd, 0.0)).reduce_max()
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
            size = size.max(largest(simd, active, &receivers.size));
            edge_error = edge_error.max(largest(simd, active, &receivers.edge_error));
            plane_error = plane_error.max(largest(simd, active, &receivers.plane_error));
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
            size,
            edge_error,
            plane_error,
        }
    }
}

/// What triangles of a group are for a shaft, a bit each. What is said of others than those kept means nothing.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Culled {
    /// Some line of the shaft may meet it.
    pub(crate) kept: u32,
    /// Its plane certainly lies between all receivers and all of the light.
    pub(crate) between: u32,
    /// The line in the middle of the shaft certainly passes inside of all edges.
    pub(crate) middle: u32,
    /// Not all lines certainly pass inside of this edge.
    pub(crate) cut: [u32; 3],
}

impl Culled {
    /// Those that certainly hide all of the light from all receivers.
    #[inline(always)]
    pub(crate) fn covering(&self) -> u32 {
        self.kept & self.between & !(self.cut[0] | self.cut[1] | self.cut[2])
    }
}

/// How far the box of these half axes reaches along a direction.
#[inline(always)]
fn over<S: Simd>(simd: S, axes: &[[f32; 3]; 3], v: [f32x16<S>; 3]) -> f32x16<S> {
    dot(simd, v, axes[0]).abs() + dot(simd, v, axes[1]).abs() + dot(simd, v, axes[2]).abs()
}

/// Sorts out the triangles `candidates` of a group.
#[inline(always)]
pub(crate) fn culled<S: Simd>(
    simd: S,
    group: &Group,
    light: &LightBox,
    receivers: &ReceiverBox,
    candidates: u32,
) -> Culled {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (p, h, axes) = (receivers.middle, receivers.half, &receivers.axes);
    let normal = load3(simd, &group.normal);
    let plane = dot(simd, normal, p) - f32x16::from_slice(simd, &group.height);
    let thickness = over(simd, axes, normal);
    // The box has rounding errors of its own.
    let plane_slack = splat(receivers.plane_error * 2.0);
    let behind = !(plane - thickness).simd_gt(plane_slack);
    let mut kept = behind.to_bitmask() as u32 & candidates;
    if kept == 0 {
        return Culled::default();
    }
    let between = (plane + thickness).simd_lt(-plane_slack);
    let slack = splat(receivers.edge_error * 2.0 + light.slack(receivers.size));
    let mut least_middle = splat(f32::INFINITY);
    let mut cut = [0; 3];
    for (i, cut) in cut.iter_mut().enumerate() {
        let (m, e) = (load3(simd, &group.m[i]), load3(simd, &group.e[i]));
        let (at, half) = (splat3(simd, p), splat3(simd, h));
        let gradient = [
            minor(e, at, [1, 2], m[0]),
            minor(e, at, [2, 0], m[1]),
            minor(e, at, [0, 1], m[2]),
        ];
        let sizes = abs3(e);
        let spreads = [
            sizes[1] * half[2] + sizes[2] * half[1],
            sizes[2] * half[0] + sizes[0] * half[2],
            sizes[0] * half[1] + sizes[1] * half[0],
        ];
        let mut middle = dot(simd, gradient, light.middle);
        let mut spread = light.spread(simd, gradient) + dot(simd, spreads, light.reach);
        if light.weight != 0.0 {
            middle -= dot(simd, m, p);
            spread += over(simd, axes, m);
        }
        kept &= !((middle + spread).simd_lt(-slack).to_bitmask() as u32);
        if kept == 0 {
            return Culled::default();
        }
        *cut = !((middle - spread).simd_gt(slack).to_bitmask() as u32);
        least_middle = least_middle.min(middle);
    }
    Culled {
        kept,
        between: between.to_bitmask() as u32 & !group.crossing,
        middle: least_middle.simd_gt(slack).to_bitmask() as u32,
        cut,
    }
}
