//! Vertices to raster points, sixteen at a time.
//!
//! Arithmetic is f64 and rounded once at the end: the error of a raster coordinate is half an ulp of f32, some
//! 6e-5 pixels at full HD, and that is what the edge bounds are built on. Cost: about 40 operations a vertex.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, prelude::*};

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
    padding: f32,
}

/// Raster coordinates beyond this are far outside; below, f32 resolves 1/512 of a unit.
const GUARD: f32 = 16384.0;

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
        let vertices = if out.len() == LANES {
            let load = |s: &[f32]| f32x16::from_slice(simd, s);
            project_lanes(simd, view, [load(x), load(y), load(z)])
        } else {
            let load = |s: &[f32]| f32x16::from_fn(simd, |i| s.get(i).copied().unwrap_or(0.0));
            project_lanes(simd, view, [load(x), load(y), load(z)])
        };
        let [x, y, nearness] = vertices.map(<[f32; LANES]>::from);
        for (i, vertex) in out.iter_mut().enumerate() {
            *vertex = RasterVertex {
                x: x[i],
                y: y[i],
                nearness: nearness[i],
                padding: 0.0,
            };
        }
    }
}

/// Raster x, y and nearness of sixteen points.
#[inline(always)]
pub(crate) fn project_lanes<S: Simd>(simd: S, view: &View, points: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let [(xl, xh), (yl, yh), (zl, zh)] = points.map(|p| p.widen());
    let low = project_half(simd, view, [xl, yl, zl]);
    let high = project_half(simd, view, [xh, yh, zh]);
    let x = low[0].narrow(high[0]);
    let y = low[1].narrow(high[1]);
    let nearness = low[2].narrow(high[2]);
    let guard = f32x16::splat(simd, GUARD);
    let zero = f32x16::splat(simd, 0.0);
    let inside = x.abs().simd_lt(guard) & y.abs().simd_lt(guard);
    let ahead = nearness.simd_gt(zero);
    let known = x.simd_eq(x) & y.simd_eq(y) & nearness.is_finite();
    let marked = (ahead & !inside).select(zero, nearness);
    [x, y, known.select(marked, f32x16::splat(simd, f32::NAN))]
}

#[inline(always)]
fn project_half<S: Simd>(simd: S, view: &View, points: [f64x8<S>; 3]) -> [f64x8<S>; 3] {
    let splat = |v: f64| f64x8::splat(simd, v);
    let center = view.center.as_dvec3();
    let a = [
        points[0] - splat(center.x),
        points[1] - splat(center.y),
        points[2] - splat(center.z),
    ];
    let dot = |axis: glam::DVec3| a[0] * splat(axis.x) + a[1] * splat(axis.y) + a[2] * splat(axis.z);
    let (along, above, depth) = (dot(view.right), dot(view.up), dot(view.forward));
    let [cx, cy] = view.middle;
    match view.arrangement {
        Arrangement::Perspective => {
            let inverse = splat(1.0) / depth;
            let x = splat(cx) + along * splat(view.scale_x) * inverse;
            let y = splat(cy) - above * splat(view.scale_y) * inverse;
            [x, y, inverse]
        }
        Arrangement::Parallel { reach } => {
            let x = splat(cx) + along * splat(view.scale_x);
            let y = splat(cy) - above * splat(view.scale_y);
            let ahead = depth.simd_gt(splat(0.0));
            [x, y, ahead.select(splat(reach) - depth, splat(-1.0))]
        }
    }
}
