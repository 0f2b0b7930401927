//! How far an eye and a light are from the planes of sixteen triangles, in f64 lanes.
//!
//! Differences of f32 coordinates and their products are nearly exact in f64, so slivers have their normals, too. Cost: some 35
//! operations of eight lanes, a square root and a division.

use fearless_simd::{Simd, dispatch, f64x8, prelude::*};
use glam::DVec3;

use super::doubles::{HALF, Three, cross, dot, minus};
use super::planes::{CornerLanes, widened};
use super::{LANES, SimdLevel};
use crate::Light;
use crate::view::{Arrangement, View};

/// Triangles done together.
pub(crate) const TRIANGLES: usize = LANES;

/// Corners of each.
pub(crate) const CORNERS: usize = 3;

/// What sees triangles, and what falls on them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facing {
    eye: End,
    light: End,
}

#[derive(Clone, Copy, Debug)]
enum End {
    At(DVec3),
    /// Infinitely far off in this direction.
    Towards(DVec3),
}

impl Facing {
    pub(crate) fn new(view: &View, light: &Light) -> Self {
        Self {
            eye: match view.arrangement {
                Arrangement::Perspective => End::At(view.center.as_dvec3()),
                Arrangement::Parallel { .. } => End::Towards(-view.forward),
            },
            light: match *light {
                Light::Point(p) => End::At(p.as_dvec3()),
                Light::Directional(d) => End::Towards(d.as_dvec3().normalize_or_zero()),
            },
        }
    }
}

/// Of triangles given by the coordinates of their corners, and a fourth word, the light's distance from their planes, or the cosine of its
/// direction, positive on the side that the eye sees. 0 for triangles without area.
pub(crate) fn facing(level: SimdLevel, facing: &Facing, corners: &CornerLanes) -> [f32; TRIANGLES] {
    dispatch!(level.0, simd => facing_impl(simd, facing, corners))
}

#[inline(always)]
fn facing_impl<S: Simd>(simd: S, facing: &Facing, corners: &CornerLanes) -> [f32; TRIANGLES] {
    let [a, b, c] = [
        widened(simd, &corners[0]),
        widened(simd, &corners[1]),
        widened(simd, &corners[2]),
    ];
    let mut values = [[0.0; HALF]; 2];
    for (half, value) in values.iter_mut().enumerate() {
        *value = facing_half(simd, facing, [a[half], b[half], c[half]]).into();
    }
    std::array::from_fn(|lane| values[lane / HALF][lane % HALF] as f32)
}

#[inline(always)]
fn facing_half<S: Simd>(simd: S, facing: &Facing, [a, b, c]: [Three<S>; 3]) -> f64x8<S> {
    let zero = f64x8::splat(simd, 0.0);
    let (u, v) = (minus(b, a), minus(c, a));
    let normal = cross(u, v);
    let length = dot(normal, normal).sqrt();
    let seen = height(simd, &facing.eye, a, normal);
    let light = height(simd, &facing.light, a, normal);
    let value = seen.simd_lt(zero).select(-light, light) / length;
    (length.simd_gt(zero) & value.simd_eq(value)).select(value, zero)
}

/// An end's height over a plane through `from`, times the length of the normal.
#[inline(always)]
fn height<S: Simd>(simd: S, end: &End, from: Three<S>, normal: Three<S>) -> f64x8<S> {
    let splat = |v: f64| f64x8::splat(simd, v);
    match *end {
        End::At(p) => dot(minus([splat(p.x), splat(p.y), splat(p.z)], from), normal),
        End::Towards(d) => dot([splat(d.x), splat(d.y), splat(d.z)], normal),
    }
}
