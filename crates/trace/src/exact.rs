//! The one decision whether a ray meets a triangle. Every structure's answer is this answer.
//!
//! For a ray (o, d) and corners v0, v1, v2 let `a_i = v_i - o`. The three edge functions
//!
//! ```text
//! e0 = d . (a1 x a2)     e1 = d . (a2 x a0)     e2 = d . (a0 x a1)
//! ```
//!
//! are the signed volumes between the ray and the edges. The ray meets the triangle if no two of them have
//! opposite signs and not all vanish (a ray within the triangle's plane misses it). The signs are exact:
//! adaptive predicates (Shewchuk 1997) decide where f64 rounding could not. A ray through a shared edge therefore
//! meets one of the two triangles, or both, never none; around a vertex likewise. This is watertight by
//! construction, without a tie rule, at any scale and offset.
//!
//! The parameter is t = (a0 . N) / (d . N) with N = (v1 - v0) x (v2 - v0), in f64, in this order of operations:
//! it decides which of two triangles is closer, equal values going to the smaller id. Where cancellation has left
//! less than a few digits it is computed without loss, so that every `t` is within 2^-22 of its true value.
//!
//! Cost: some 60 f64 operations when the filter decides. Limits: corners are rounded once, `a_i = fl(v_i - o)`;
//! for f32 input whose exponents differ by less than 29 that is exact.

mod filter;

use glam::{DVec3, Vec3, Vec3Swizzles};
use robust::{Coord3D, orient3d};

use crate::determinant::determinant;
use crate::{Light, Receiver, Triangles};

pub(crate) use filter::Filter;

/// An exact hit: parameters in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExactHit {
    /// Parameter along the ray.
    pub t: f64,
    /// Barycentric weight of corner 1.
    pub u: f64,
    /// Barycentric weight of corner 2.
    pub v: f64,
}

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

/// d . (a x b) with the exact sign.
#[inline]
fn volume(a: DVec3, b: DVec3, d: DVec3) -> f64 {
    const ZERO: Coord3D<f64> = Coord3D {
        x: 0.0,
        y: 0.0,
        z: 0.0,
    };
    orient3d(coord(a), coord(b), coord(d), ZERO)
}

/// Whether the line o + t d meets the triangle, and where. The caller checks the range of `t`.
///
/// `None` for triangles without area and for rays within the triangle's plane.
#[inline]
pub fn hit(origin: DVec3, dir: DVec3, corners: [Vec3; 3]) -> Option<ExactHit> {
    if meets(origin, dir, corners) {
        attributes(origin, dir, corners)
    } else {
        None
    }
}

/// The decision of [`hit`] alone, for triangles with area.
#[inline]
pub(crate) fn meets(origin: DVec3, dir: DVec3, [v0, v1, v2]: [Vec3; 3]) -> bool {
    let [a0, a1, a2] = [
        v0.as_dvec3() - origin,
        v1.as_dvec3() - origin,
        v2.as_dvec3() - origin,
    ];
    let e0 = volume(a1, a2, dir);
    let e1 = volume(a2, a0, dir);
    if e0 * e1 < 0.0 {
        return false;
    }
    let e2 = volume(a0, a1, dir);
    let negative = e0 < 0.0 || e1 < 0.0 || e2 < 0.0;
    let positive = e0 > 0.0 || e1 > 0.0 || e2 > 0.0;
    negative != positive
}

/// Where the line o + t d meets the triangle, given that it does: the same values as [`hit`], without the
/// decision.
///
/// `None` for triangles without area.
#[inline]
pub fn attributes(origin: DVec3, dir: DVec3, corners: [Vec3; 3]) -> Option<ExactHit> {
    let [v0, v1, v2] = corners.map(Vec3::as_dvec3);
    let (a0, edge1, edge2) = (v0 - origin, v1 - v0, v2 - v0);
    let normal = edge1.cross(edge2);
    if normal == DVec3::ZERO {
        return None;
    }
    let (height, steepness) = (a0.dot(normal), dir.dot(normal));
    let moment = a0.cross(dir);
    let hit = ExactHit {
        t: height / steepness,
        u: edge2.dot(moment) / steepness,
        v: -edge1.dot(moment) / steepness,
    };
    // Sums of which less than this is left have lost too much for t to be within 2^-23 of its value.
    let terms = edge1.yzx().abs() * edge2.zxy().abs() + edge1.zxy().abs() * edge2.yzx().abs();
    let doubt = terms * (1.0 / (1u64 << 27) as f64);
    let sound = height.abs() > doubt.dot(a0.abs()) && steepness.abs() > doubt.dot(dir.abs());
    Some(if sound {
        hit
    } else {
        careful(dir, corners.map(|c| c.as_dvec3() - origin))
    })
}

/// The same values from determinants that have lost nothing. Structures prune by where hits lie, and grids know
/// exactly what lies in front: a `t` that cancellation has put elsewhere would be found or not depending on the
/// structure.
#[cold]
fn careful(dir: DVec3, [a0, a1, a2]: [DVec3; 3]) -> ExactHit {
    // d . N is the sum of the edge functions, which have one sign on a hit.
    let [e0, e1, e2] = [(a1, a2), (a2, a0), (a0, a1)].map(|(a, b)| determinant(dir, a, b));
    let steepness = e0 + e1 + e2;
    ExactHit {
        // An origin in the plane is at 0, not at -0.
        t: determinant(a0, a1, a2) / steepness + 0.0,
        u: e1 / steepness,
        v: e2 / steepness,
    }
}

/// Which side of a triangle a light sees: positive for the front, negative for the back, 0 edge-on. The sign is
/// exact.
#[inline]
pub fn side(corners: [Vec3; 3], light: &Light) -> f64 {
    let [v0, v1, v2] = corners.map(Vec3::as_dvec3);
    match *light {
        Light::Point(position) => {
            let from = position.as_dvec3();
            -volume(v0 - from, v1 - from, v2 - from)
        }
        Light::Directional(direction) => volume(v1 - v0, v2 - v0, direction.as_dvec3()),
    }
}

/// Whether a light and an eye are on the same side of a triangle; one that is seen edge-on by either has none.
#[inline]
pub fn same_side(corners: [Vec3; 3], light: &Light, eye: &Light) -> bool {
    let (lit, seen) = (side(corners, light), side(corners, eye));
    (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0)
}

/// Whether triangle `prim` lies strictly between a receiver and a light, the receiver's own triangle and its
/// error bound left out.
#[inline]
pub fn shadows(triangles: &Triangles, prim: u32, receiver: &Receiver, light: &Light) -> bool {
    shadow_hit(triangles, prim, receiver, light).is_some()
}

/// [`shadows`] for a triangle with these corners, which is not the receiver's own.
#[inline]
pub fn blocks(corners: [Vec3; 3], receiver: &Receiver, light: &Light) -> bool {
    between(corners, receiver, light).is_some()
}

/// As [`shadows`], with the hit along [`shadow_line`].
#[inline]
pub fn shadow_hit(triangles: &Triangles, prim: u32, receiver: &Receiver, light: &Light) -> Option<ExactHit> {
    let own = prim == receiver.prim;
    if own {
        None
    } else {
        between(triangles.corners(prim), receiver, light)
    }
}

#[inline]
fn between(corners: [Vec3; 3], receiver: &Receiver, light: &Light) -> Option<ExactHit> {
    let (origin, dir) = shadow_line(receiver, light);
    let hit = hit(origin, dir, corners)?;
    lies_between(&hit, dir, receiver, light).then_some(hit)
}

/// Origin and direction of the line on which a receiver and a light lie.
#[inline]
pub fn shadow_line(receiver: &Receiver, light: &Light) -> (DVec3, DVec3) {
    match *light {
        // From the light, so that all rays of one light see the same rounded corners.
        Light::Point(position) => (position.as_dvec3(), receiver.point - position.as_dvec3()),
        Light::Directional(direction) => (receiver.point, direction.as_dvec3()),
    }
}

/// Whether a hit along the [`shadow_line`] of direction `dir` lies between its ends, the receiver's error bound left
/// out.
#[inline]
pub(crate) fn lies_between(hit: &ExactHit, dir: DVec3, receiver: &Receiver, light: &Light) -> bool {
    match light {
        Light::Point(_) => hit.t > 0.0 && (1.0 - hit.t) * dir.length() > receiver.error,
        Light::Directional(_) => hit.t * dir.length() > receiver.error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::Numbers;

    type Whole = [i128; 3];

    fn volume_of(a: Whole, b: Whole, c: Whole) -> i128 {
        let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
        a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)
    }

    /// Rays that all but lie in large triangles, in whole numbers: what is left of 60 bits is a few.
    #[test]
    fn t_is_right_where_cancellation_leaves_nothing() {
        let mut numbers = Numbers(11);
        let mut whole = |size: f32| [(); 3].map(|()| (numbers.next() * size).round() as i128);
        let (mut hits, mut in_plane) = (0, 0);
        for _ in 0..40_000 {
            let [a, b, c, share, off, lean] = [4e6, 4e6, 4e6, 3.0, 1.2, 1.2].map(&mut whole);
            let at = |i: usize, s: i128, t: i128| a[i] + (b[i] - a[i]) * s + (c[i] - a[i]) * t;
            let origin: Whole = std::array::from_fn(|i| at(i, share[0], share[1]) + off[i]);
            let target: Whole = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3 + lean[i]);
            let from_origin = |p: Whole| -> Whole { std::array::from_fn(|i| p[i] - origin[i]) };
            let vector = |p: Whole| DVec3::from_array(p.map(|v| v as f64));
            let corners = [a, b, c].map(|p| vector(p).as_vec3());
            let dir = from_origin(target);
            let Some(hit) = hit(vector(origin), vector(dir), corners) else {
                continue;
            };
            hits += 1;
            let [a0, a1, a2] = [a, b, c].map(from_origin);
            let steepness = volume_of(dir, a1, a2) + volume_of(dir, a2, a0) + volume_of(dir, a0, a1);
            let height = volume_of(a0, a1, a2);
            in_plane += usize::from(height == 0);
            let t = height as f64 / steepness as f64;
            assert!(
                (hit.t - t).abs() <= t.abs() * 2f64.powi(-22),
                "{hit:?}, t should be {t}"
            );
        }
        assert!(hits > 3000 && in_plane > 20, "{hits} {in_plane}");
    }
}
