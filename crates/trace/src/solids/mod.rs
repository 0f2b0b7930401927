//! Solids that are not made of triangles: spheres, cylinders, capsules, boxes, and what constructive solid geometry makes
//! of them. [`SolidGrids`] is their structure for any ray, [`EyeSolids`] that of a camera's, [`crossings`] the definition of
//! every answer.
//!
//! Source: HM08 §3: non-polygonal objects are put into a perspective grid by the bounds of their transformed bounding
//! boxes, and met in world space.
//!
//! *The definition.* A line passes a convex leaf in one interval of its parameter, computed in f64: the closest approach
//! to the centre or axis first, then half the chord from what is left of the squared radius, which keeps its digits
//! from far away. It is cut to the leaf's bounding box, so that no rounding puts a hit where a grid would not look.
//! Touching is missing: intervals without length do not count. A tree combines the intervals of its leaves; where
//! ends of both sides coincide the left one's surface is met. Hits are the ends of the intervals that remain; equal
//! parameters go to the smaller id of a solid.
//!
//! A receiver lies on a leaf; seen from there, the end of that leaf's interval that is nearer to it *is* it, at 0. So a
//! sphere does not shadow itself at any angle, and there is no offset to choose.
//!
//! Cost: some 20 ns a leaf, and a few small allocations a tree. Units are the caller's.

mod between;
mod eye;
mod grids;

use glam::DVec3;

use crate::{Light, Receiver, ViewRay};

pub use eye::{EyeSolids, SolidHits};
pub use grids::{SolidGrids, SolidsAt};

/// A solid in the frame's local space.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// All points within `radius` of `center`.
    Sphere {
        /// The centre.
        center: DVec3,
        /// The radius, above 0.
        radius: f64,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Middle of one end.
        from: DVec3,
        /// Middle of the other.
        to: DVec3,
        /// The radius, above 0.
        radius: f64,
    },
    /// All points within `radius` of the segment between two points.
    Capsule {
        /// One end of the segment.
        from: DVec3,
        /// The other; may be the same.
        to: DVec3,
        /// The radius, above 0.
        radius: f64,
    },
    /// A box of any orientation.
    Box {
        /// The middle.
        center: DVec3,
        /// From the middle to the middles of three faces, at right angles.
        half: [DVec3; 3],
    },
    /// What is in either.
    Union(Box<[Solid; 2]>),
    /// What is in both.
    Intersection(Box<[Solid; 2]>),
    /// What is in the first but not in the second.
    Difference(Box<[Solid; 2]>),
}

/// Where a line passes the surface of a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Parameter along the line.
    pub t: f64,
    /// Which leaf's surface it is, counted from left to right.
    pub leaf: u32,
    /// Unit normal of the surface, out of the solid.
    pub normal: DVec3,
    /// Whether the line enters the solid here.
    pub enters: bool,
}

/// A point that asks whether solids hide a light from it, or what solid a ray from it meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidReceiver {
    /// The point.
    pub point: DVec3,
    /// Bound on its distance from the surface.
    pub error: f64,
    /// The solid and the leaf it lies on; `None` for a point that is on no solid.
    pub on: Option<(u32, u32)>,
}

impl SolidReceiver {
    /// The receiver where a ray crosses the surface of solid `id`.
    pub fn along(ray: &ViewRay, id: u32, solid: &Solid, crossing: &Crossing) -> Self {
        let Receiver { point, error, .. } = Receiver::along(ray, crossing.t, u32::MAX);
        // The crossing was computed from the solid's own coordinates, too.
        let size = solid
            .bounds()
            .map_or(0.0, |[low, high]| low.abs().max(high.abs()).max_element());
        Self {
            point,
            error: error.max(size * 2f64.powi(-40)),
            on: Some((id, crossing.leaf)),
        }
    }

    /// The same point as a receiver of what triangles cast.
    pub fn among_triangles(&self) -> Receiver {
        Receiver {
            point: self.point,
            error: self.error,
            prim: u32::MAX,
        }
    }
}

impl From<&Receiver> for SolidReceiver {
    /// A point of a triangle, or a free one.
    fn from(receiver: &Receiver) -> Self {
        Self {
            point: receiver.point,
            error: receiver.error,
            on: None,
        }
    }
}

/// An interval of a line within a solid.
type Inside = [Crossing; 2];

/// The crossings of a line with a solid, ascending. `own` is the leaf that the line's origin lies on, if any.
pub fn crossings(solid: &Solid, ray: &ViewRay, own: Option<u32>) -> Vec<Crossing> {
    let mut leaf = 0;
    solid.inside(ray, own, &mut leaf).into_flattened()
}

impl Solid {
    /// The box around the solid; `None` if it is nothing: empty, or not finite.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let usable = |[low, high]: [DVec3; 2]| {
            let real = low.is_finite() && high.is_finite() && low.cmplt(high).all();
            real.then_some([low, high])
        };
        let around = |points: &[DVec3], radius: f64| {
            let low = points.iter().fold(DVec3::INFINITY, |low, &p| low.min(p - radius));
            let high = points
                .iter()
                .fold(DVec3::NEG_INFINITY, |high, &p| high.max(p + radius));
            (radius > 0.0).then(|| usable([low, high])).flatten()
        };
        match self {
            Self::Sphere { center, radius } => around(&[*center], *radius),
            Self::Cylinder { from, to, .. } if from == to => None,
            Self::Cylinder { from, to, radius } | Self::Capsule { from, to, radius } => {
                around(&[*from, *to], *radius)
            }
            Self::Box { center, half } => {
                let reach = half[0].abs() + half[1].abs() + half[2].abs();
                let flat = half.contains(&DVec3::ZERO);
                (!flat).then(|| usable([*center - reach, *center + reach]))?
            }
            Self::Union(both) => match (both[0].bounds(), both[1].bounds()) {
                (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
                (a, b) => a.or(b),
            },
            Self::Intersection(both) => {
                let (a, b) = (both[0].bounds()?, both[1].bounds()?);
                usable([a[0].max(b[0]), a[1].min(b[1])])
            }
            Self::Difference(both) => both[0].bounds(),
        }
    }

    /// The intervals of a line within the solid, ascending and apart; `leaf` counts the leaves passed.
    fn inside(&self, ray: &ViewRay, own: Option<u32>, leaf: &mut u32) -> Vec<Inside> {
        let mut both = |pair: &[Self; 2]| {
            let left = pair[0].inside(ray, own, leaf);
            (left, pair[1].inside(ray, own, leaf))
        };
        match self {
            Self::Union(pair) => {
                let (a, b) = both(pair);
                combined(&a, &b, false, |a, b| a || b)
            }
            Self::Intersection(pair) => {
                let (a, b) = both(pair);
                combined(&a, &b, false, |a, b| a && b)
            }
            Self::Difference(pair) => {
                let (a, b) = both(pair);
                combined(&a, &b, true, |a, b| a && !b)
            }
            _ => {
                let index = *leaf;
                *leaf += 1;
                let found = self.chord(ray).map(|[from, to]| {
                    if own != Some(index) {
                        [from, to]
                    } else if from.abs() <= to.abs() {
                        [0.0, to]
                    } else {
                        [from, 0.0]
                    }
                });
                let crossing = |t: f64, enters: bool| Crossing {
                    t,
                    leaf: index,
                    normal: self.normal(ray.origin + ray.dir * t),
                    enters,
                };
                let found = found.filter(|[from, to]| from < to);
                found
                    .map(|[from, to]| [crossing(from, true), crossing(to, false)])
                    .into_iter()
                    .collect()
            }
        }
    }

    /// The interval of a line within a leaf.
    fn chord(&self, ray: &ViewRay) -> Option<[f64; 2]> {
        let [low, high] = self.bounds()?;
        let within = (0..3).try_fold([f64::NEG_INFINITY, f64::INFINITY], |range, axis| {
            both(
                range,
                slab(ray.origin[axis], ray.dir[axis], low[axis], high[axis])?,
            )
        })?;
        let found = match self {
            Self::Sphere { center, radius } => round(ray.origin - *center, ray.dir, *radius)?,
            Self::Cylinder { from, to, radius } => body(ray, *from, *to, *radius)?,
            Self::Capsule { from, to, radius } => {
                // Convex: from the first entry to the last exit of its three parts.
                let parts = [
                    round(ray.origin - *from, ray.dir, *radius),
                    round(ray.origin - *to, ray.dir, *radius),
                    (from != to).then(|| body(ray, *from, *to, *radius)).flatten(),
                ];
                let parts = parts.into_iter().flatten();
                parts.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?
            }
            Self::Box { center, half } => {
                let origin = ray.origin - *center;
                let all = [f64::NEG_INFINITY, f64::INFINITY];
                half.iter().try_fold(all, |range, half| {
                    let square = half.length_squared();
                    both(
                        range,
                        slab(origin.dot(*half), ray.dir.dot(*half), -square, square)?,
                    )
                })?
            }
            _ => return None,
        };
        both(within, found)
    }

    /// Unit normal of a leaf at a point of its surface.
    fn normal(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Sphere { center, .. } => (p - *center).normalize_or_zero(),
            Self::Cylinder { from, to, radius } => {
                let axis = *to - *from;
                let along = (p - *from).dot(axis) / axis.length_squared();
                let beside = p - *from - axis * along;
                // The surface that the point is nearest to, by its distance from each.
                let length = axis.length();
                let to_side = (radius - beside.length()).abs();
                let (to_start, to_end) = ((along * length).abs(), ((1.0 - along) * length).abs());
                if to_side <= to_start.min(to_end) {
                    beside.normalize_or_zero()
                } else if to_end <= to_start {
                    axis / length
                } else {
                    -axis / length
                }
            }
            Self::Capsule { from, to, .. } => {
                let axis = *to - *from;
                let along = (p - *from).dot(axis) / axis.length_squared();
                let along = if along > 0.0 { along.min(1.0) } else { 0.0 };
                (p - *from - axis * along).normalize_or_zero()
            }
            Self::Box { center, half } => {
                // That of the face which is nearest.
                let across = half.map(|half| (p - *center).dot(half) / half.length());
                let inward = |axis: usize| (half[axis].length() - across[axis].abs()).abs();
                let nearest = (1..3).fold(
                    0,
                    |best, axis| {
                        if inward(axis) < inward(best) { axis } else { best }
                    },
                );
                half[nearest].normalize_or_zero() * across[nearest].signum()
            }
            _ => DVec3::ZERO,
        }
    }
}

/// What two intervals share, if it has length.
fn both(a: [f64; 2], b: [f64; 2]) -> Option<[f64; 2]> {
    let (from, to) = (a[0].max(b[0]), a[1].min(b[1]));
    (from < to).then_some([from, to])
}

/// The parameters at which a coordinate is between two values.
fn slab(origin: f64, dir: f64, low: f64, high: f64) -> Option<[f64; 2]> {
    if dir == 0.0 {
        return (low <= origin && origin <= high).then_some([f64::NEG_INFINITY, f64::INFINITY]);
    }
    let (s, t) = ((low - origin) / dir, (high - origin) / dir);
    Some([s.min(t), s.max(t)])
}

/// The interval within `radius` of the zero point.
fn round(origin: DVec3, dir: DVec3, radius: f64) -> Option<[f64; 2]> {
    let square = dir.length_squared();
    let middle = -origin.dot(dir) / square;
    let closest = origin + dir * middle;
    let left = radius * radius - closest.length_squared();
    if left.is_nan() || left <= 0.0 {
        return None;
    }
    let half = (left / square).sqrt();
    Some([middle - half, middle + half])
}

/// The interval within a cylinder.
fn body(ray: &ViewRay, from: DVec3, to: DVec3, radius: f64) -> Option<[f64; 2]> {
    let (axis, origin) = (to - from, ray.origin - from);
    let square = axis.length_squared();
    let ends = slab(origin.dot(axis), ray.dir.dot(axis), 0.0, square)?;
    let across = |v: DVec3| v - axis * (v.dot(axis) / square);
    let (origin, dir) = (across(origin), across(ray.dir));
    if dir == DVec3::ZERO {
        return (origin.length_squared() < radius * radius).then_some(ends);
    }
    both(ends, round(origin, dir, radius)?)
}

/// Intervals where `inside` holds of being in `a` and being in `b`; `turned` turns the surfaces of `b` around.
fn combined(a: &[Inside], b: &[Inside], turned: bool, inside: impl Fn(bool, bool) -> bool) -> Vec<Inside> {
    let (mut ends_a, mut ends_b) = (a.as_flattened(), b.as_flattened());
    let (mut in_a, mut in_b, mut was) = (false, false, false);
    let mut entered: Option<Crossing> = None;
    let mut found = Vec::new();
    loop {
        let t = match (ends_a.first(), ends_b.first()) {
            (Some(a), Some(b)) => a.t.min(b.t),
            (Some(end), None) | (None, Some(end)) => end.t,
            (None, None) => return found,
        };
        // All that ends or begins here, the right side first, so that the left one's surface is met.
        let mut at = None;
        while let Some((end, rest)) = ends_b.split_first().filter(|(end, _)| end.t <= t) {
            (in_b, ends_b) = (end.enters, rest);
            let sign = if turned { -1.0 } else { 1.0 };
            at = Some(Crossing {
                normal: end.normal * sign,
                ..*end
            });
        }
        while let Some((end, rest)) = ends_a.split_first().filter(|(end, _)| end.t <= t) {
            (in_a, ends_a) = (end.enters, rest);
            at = Some(*end);
        }
        let is = inside(in_a, in_b);
        if let Some(mut crossing) = at.filter(|_| is != was) {
            crossing.enters = is;
            match entered.take() {
                None => entered = Some(crossing),
                Some(from) => found.push([from, crossing]),
            }
        }
        was = is;
    }
}

/// The ray from a receiver to a light, with the range in which crossings hide it.
fn towards(receiver: &SolidReceiver, light: &Light) -> (ViewRay, [f64; 2]) {
    let dir = light.towards(receiver.point);
    let end = match light {
        Light::Point(_) => 1.0,
        Light::Directional(_) => f64::INFINITY,
    };
    let ray = ViewRay {
        origin: receiver.point,
        dir,
    };
    (ray, [receiver.error / dir.length(), end])
}

/// Whether a solid lies between a receiver and a light.
fn blocks(solid: &Solid, id: u32, receiver: &SolidReceiver, light: &Light) -> bool {
    let (ray, [from, to]) = towards(receiver, light);
    let all = crossings(solid, &ray, own_leaf(receiver.on, id));
    all.iter().any(|crossing| crossing.t > from && crossing.t < to)
}

/// The leaf of solid `id` that a ray starts on.
fn own_leaf(on: Option<(u32, u32)>, id: u32) -> Option<u32> {
    on.filter(|on| on.0 == id).map(|on| on.1)
}

/// The first crossing of a solid in a range; see [`SolidGrids::closest`].
fn first(
    solid: &Solid,
    id: u32,
    ray: &ViewRay,
    [from, to]: [f64; 2],
    on: Option<(u32, u32)>,
) -> Option<Crossing> {
    let all = crossings(solid, ray, own_leaf(on, id));
    all.into_iter().find(|c| c.t > from && c.t <= to)
}
