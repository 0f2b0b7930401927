//! Three coordinates in eight f64 lanes, half of a batch.

use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

use glam::DVec3;

use super::LANES;

/// Lanes of f64 in half of a batch.
pub(super) const HALF: usize = LANES / 2;

pub(super) type Three<S> = [f64x8<S>; 3];

/// Half of three arrays of lanes: the lower one for 0.
#[inline(always)]
pub(super) fn load<S: Simd>(simd: S, v: &[[f32; LANES]; 3], half: usize) -> Three<S> {
    [
        load_axis(simd, &v[0], half),
        load_axis(simd, &v[1], half),
        load_axis(simd, &v[2], half),
    ]
}

#[inline(always)]
fn load_axis<S: Simd>(simd: S, v: &[f32; LANES], half: usize) -> f64x8<S> {
    let (low, high) = f32x16::from_slice(simd, v).widen();
    if half == 0 { low } else { high }
}

#[inline(always)]
pub(super) fn splat3<S: Simd>(simd: S, v: DVec3) -> Three<S> {
    [
        f64x8::splat(simd, v.x),
        f64x8::splat(simd, v.y),
        f64x8::splat(simd, v.z),
    ]
}

#[inline(always)]
pub(super) fn minus<S: Simd>(a: Three<S>, b: Three<S>) -> Three<S> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(super) fn abs<S: Simd>(v: Three<S>) -> Three<S> {
    [v[0].abs(), v[1].abs(), v[2].abs()]
}

#[inline(always)]
pub(super) fn sum<S: Simd>(v: Three<S>) -> f64x8<S> {
    v[0] + v[1] + v[2]
}

#[inline(always)]
pub(super) fn dot<S: Simd>(a: Three<S>, b: Three<S>) -> f64x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The cross product, its terms in glam's order.
#[inline(always)]
pub(super) fn cross<S: Simd>(a: Three<S>, b: Three<S>) -> Three<S> {
    [
        a[1] * b[2] - b[1] * a[2],
        a[2] * b[0] - b[2] * a[0],
        a[0] * b[1] - b[0] * a[1],
    ]
}
