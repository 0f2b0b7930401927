//! Vertices to raster points, sixteen at a time.
//!
//! Arithmetic is f64 and rounded once at the end: the error of a raster coordinate is half an ulp of f32, some
//! 6e-5 pixels at full HD, and that is what the edge bounds are built on. Cost: about 40 operations a vertex.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, i32x16, prelude::*};

use super::doubles::{Three, minus, splat3};
use super::{LANES, SimdLevel};
use crate::Triangles;
use crate::view::{Arrangement, View};

/// A projected vertex: raster x and y and nearness.
///
/// `nearness` tells what it is good for: above 0, everything; 0, it lies in front but so far outside of the
/// raster that only the order of coordinates means anything; below 0, it lies behind the view's start; not a
/// number, nothing is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub(crate) struct RasterVertex {
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) nearness: f32,
    /// What rounding cut off from x (low half) and y (high half), in units of [`REST`].
    rest: i32,
}

impl RasterVertex {
    /// x, y, nearness and the bits of the rest, as they lie in memory.
    #[inline(always)]
    pub(crate) fn words(&self) -> [f32; 4] {
        [self.x, self.y, self.nearness, f32::from_bits(self.rest as u32)]
    }
}

/// Raster coordinates beyond this are far outside; below, f32 resolves 1/512 of a unit.
const GUARD: f32 = 16384.0;

/// Unit of what rounding cuts off from a coordinate below the guard: at most 2^14 of them.
const REST: f32 = 1.0 / (1u32 << 25) as f32;

/// Bound on the error of a coordinate and its rest together.
pub(crate) const REST_ERROR: f32 = REST;

/// Projects vertices `first..first + out.len()`.
pub(crate) fn project(
    level: SimdLevel,
    view: &View,
    triangles: &Triangles,
    first: usize,
    out: &mut [RasterVertex],
) {
    dispatch!(level.0, simd => project_impl(simd, view, triangles, first, out));
}

#[inline(always)]
fn project_impl<S: Simd>(
    simd: S,
    view: &View,
    triangles: &Triangles,
    first: usize,
    out: &mut [RasterVertex],
) {
    let range = first..first + out.len();
    let (xs, ys, zs) = (
        &triangles.x[range.clone()],
        &triangles.y[range.clone()],
        &triangles.z[range],
    );
    let chunks = out
        .chunks_mut(LANES)
        .zip(xs.chunks(LANES))
        .zip(ys.chunks(LANES))
        .zip(zs.chunks(LANES));
    for (((out, x), y), z) in chunks {
        let points = if out.len() == LANES {
            [
                f32x16::from_slice(simd, x),
                f32x16::from_slice(simd, y),
                f32x16::from_slice(simd, z),
            ]
        } else {
            [padded(simd, x), padded(simd, y), padded(simd, z)]
        };
        let vertices = project_lanes(simd, view, points, [0.0; 2]);
        let [x, y, nearness] = vertices.0;
        let (x, y, nearness) = (
            <[f32; LANES]>::from(x),
            <[f32; LANES]>::from(y),
            <[f32; LANES]>::from(nearness),
        );
        let rest = <[i32; LANES]>::from(vertices.1);
        for (i, vertex) in out.iter_mut().enumerate() {
            *vertex = RasterVertex {
                x: x[i],
                y: y[i],
                nearness: nearness[i],
                rest: rest[i],
            };
        }
    }
}

/// Less than sixteen values.
#[inline(always)]
fn padded<S: Simd>(simd: S, values: &[f32]) -> f32x16<S> {
    let mut lanes = [0.0; LANES];
    lanes[..values.len()].copy_from_slice(values);
    f32x16::from_slice(simd, &lanes)
}

/// Raster x and y from `origin` and nearness of sixteen points, and what rounding cut off.
#[inline(always)]
pub(crate) fn project_lanes<S: Simd>(
    simd: S,
    view: &View,
    points: [f32x16<S>; 3],
    origin: [f64; 2],
) -> ([f32x16<S>; 3], i32x16<S>) {
    let [x, y, z] = points;
    let ((xl, xh), (yl, yh), (zl, zh)) = (x.widen(), y.widen(), z.widen());
    let mut low = project_half(simd, view, [xl, yl, zl]);
    let mut high = project_half(simd, view, [xh, yh, zh]);
    for axis in 0..2 {
        low[axis] -= f64x8::splat(simd, origin[axis]);
        high[axis] -= f64x8::splat(simd, origin[axis]);
    }
    let x = low[0].narrow(high[0]);
    let y = low[1].narrow(high[1]);
    let nearness = low[2].narrow(high[2]);
    let guard = f32x16::splat(simd, GUARD);
    let zero = f32x16::splat(simd, 0.0);
    let inside = x.abs().simd_lt(guard) & y.abs().simd_lt(guard);
    let ahead = nearness.simd_gt(zero);
    let known = x.simd_eq(x) & y.simd_eq(y) & nearness.is_finite();
    let marked = (ahead & !inside).select(zero, nearness);
    let x_rest = inside.select(rest(simd, x, low[0], high[0]), zero);
    let y_rest = inside.select(rest(simd, y, low[1], high[1]), zero);
    let low_half = i32x16::splat(simd, 0xffff);
    let rests = (x_rest.to_int::<i32x16<S>>() & low_half) | (y_rest.to_int::<i32x16<S>>() << 16);
    ([x, y, known.select(marked, f32x16::splat(simd, f32::NAN))], rests)
}

/// What rounding to f32 cut off, in units of [`REST`].
#[inline(always)]
fn rest<S: Simd>(simd: S, rounded: f32x16<S>, low: f64x8<S>, high: f64x8<S>) -> f32x16<S> {
    let (rounded_low, rounded_high) = rounded.widen();
    (low - rounded_low).narrow(high - rounded_high) * f32x16::splat(simd, 1.0 / REST)
}

/// The dot product of sixteen vectors' halves with one.
#[inline(always)]
fn dot<S: Simd>(simd: S, a: [f64x8<S>; 3], axis: glam::DVec3) -> f64x8<S> {
    let (x, y, z) = (
        f64x8::splat(simd, axis.x),
        f64x8::splat(simd, axis.y),
        f64x8::splat(simd, axis.z),
    );
    a[0].mul_add(x, a[1].mul_add(y, a[2] * z))
}

/// The two rests that belong to x and y.
#[inline(always)]
pub(crate) fn unpack_rests<S: Simd>(simd: S, rests: f32x16<S>) -> [f32x16<S>; 2] {
    let rests = rests.bitcast::<i32x16<S>>();
    let unit = f32x16::splat(simd, REST);
    [
        ((rests << 16) >> 16).to_float::<f32x16<S>>() * unit,
        (rests >> 16).to_float::<f32x16<S>>() * unit,
    ]
}

#[inline(always)]
fn project_half<S: Simd>(simd: S, view: &View, points: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
    project_relative(simd, view, minus(points, splat3(simd, view.center.as_dvec3())))
}

/// Raster x and y and nearness of eight points, given by what they differ from the view's center.
#[inline(always)]
pub(crate) fn project_relative<S: Simd>(simd: S, view: &View, a: Three<S>) -> [f64x8<S>; 3] {
    let splat = |v: f64| f64x8::splat(simd, v);
    let (along, above) = (dot(simd, a, view.right), dot(simd, a, view.up));
    let depth = dot(simd, a, view.forward);
    let [cx, cy] = view.middle;
    let (along, above) = (along * splat(view.scale_x), above * splat(-view.scale_y));
    match view.arrangement {
        Arrangement::Perspective => {
            let inverse = splat(1.0) / depth;
            let x = along.mul_add(inverse, splat(cx));
            let y = above.mul_add(inverse, splat(cy));
            [x, y, inverse]
        }
        Arrangement::Parallel { reach } => {
            let ahead = depth.simd_gt(splat(0.0));
            let nearness = ahead.select(splat(reach) - depth, splat(-1.0));
            [along + splat(cx), above + splat(cy), nearness]
        }
    }
}
