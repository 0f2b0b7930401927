//! Edge functions and nearness planes of sixteen projected triangles at once.
//!
//! For a raster point q relative to an origin, each record evaluates
//!
//! ```text
//! g_i(q) = a_i q.x + b_i q.y + c_i        i = 0, 1, 2
//! n(q)   = nearness_x q.x + nearness_y q.y + nearness
//! ```
//!
//! where `g_i` is the i-th edge function divided by a bound on its own error: min(g) > 1 is certainly inside,
//! min(g) < -1 certainly outside, between is unsure. n(q) is within a quarter of
//! [`super::NEARNESS_BAND`] of the truth, relatively, wherever `floor <= n(q) <= ceiling`.
//!
//! The bounds cover the rounding of the projected vertices (half an ulp) and of this arithmetic. Triangles for
//! which they cannot be met (nearly edge-on, or with an unusable vertex) are reported, for
//! [`crate::precise`] to set up.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::project::RasterVertex;
use super::{LANES, NEARNESS_BAND, ROUNDOFF, load3, max3, min3};

/// What the kernels know of one triangle. 60 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct EdgeRecord {
    pub(crate) a: [f32; 3],
    pub(crate) b: [f32; 3],
    pub(crate) c: [f32; 3],
    pub(crate) nearness_x: f32,
    pub(crate) nearness_y: f32,
    pub(crate) nearness: f32,
    pub(crate) floor: f32,
    pub(crate) ceiling: f32,
    /// The triangle.
    pub(crate) prim: u32,
}

impl Default for EdgeRecord {
    fn default() -> Self {
        Self {
            a: [0.0; 3],
            b: [0.0; 3],
            c: [0.0; 3],
            nearness_x: 0.0,
            nearness_y: 0.0,
            nearness: 0.0,
            floor: 0.0,
            ceiling: f32::INFINITY,
            prim: u32::MAX,
        }
    }
}

/// Sixteen triangles as lanes of their three vertices.
#[derive(Clone, Debug)]
pub(crate) struct VertexLanes {
    pub(crate) x: [[f32; LANES]; 3],
    pub(crate) y: [[f32; LANES]; 3],
    pub(crate) nearness: [[f32; LANES]; 3],
    pub(crate) prim: [u32; LANES],
    pub(crate) count: usize,
}

impl Default for VertexLanes {
    fn default() -> Self {
        let zero = [[0.0; LANES]; 3];
        Self {
            x: zero,
            y: zero,
            nearness: zero,
            prim: [u32::MAX; LANES],
            count: 0,
        }
    }
}

impl VertexLanes {
    #[inline(always)]
    pub(crate) fn push(&mut self, prim: u32, vertices: [&RasterVertex; 3]) {
        let lane = self.count;
        for (corner, vertex) in vertices.into_iter().enumerate() {
            self.x[corner][lane] = vertex.x;
            self.y[corner][lane] = vertex.y;
            self.nearness[corner][lane] = vertex.nearness;
        }
        self.prim[lane] = prim;
        self.count += 1;
    }

    /// As [`Self::push`], from x, y and nearness of the three corners.
    #[inline(always)]
    pub(crate) fn push_lanes(&mut self, prim: u32, x: [f32; 3], y: [f32; 3], nearness: [f32; 3]) {
        let lane = self.count;
        for corner in 0..3 {
            self.x[corner][lane] = x[corner];
            self.y[corner][lane] = y[corner];
            self.nearness[corner][lane] = nearness[corner];
        }
        self.prim[lane] = prim;
        self.count += 1;
    }
}

/// Records of the lanes, and a bit for every lane whose record is good.
#[derive(Clone, Debug, Default)]
pub(crate) struct EdgeLanes {
    pub(crate) a: [[f32; LANES]; 3],
    pub(crate) b: [[f32; LANES]; 3],
    pub(crate) c: [[f32; LANES]; 3],
    pub(crate) nearness_x: [f32; LANES],
    pub(crate) nearness_y: [f32; LANES],
    pub(crate) nearness: [f32; LANES],
    pub(crate) good: u32,
}

impl EdgeLanes {
    /// The record of one lane.
    #[inline(always)]
    pub(crate) fn record(&self, lane: usize, prim: u32) -> EdgeRecord {
        let pick = |v: &[[f32; LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        EdgeRecord {
            a: pick(&self.a),
            b: pick(&self.b),
            c: pick(&self.c),
            nearness_x: self.nearness_x[lane],
            nearness_y: self.nearness_y[lane],
            nearness: self.nearness[lane],
            floor: 0.0,
            ceiling: f32::INFINITY,
            prim,
        }
    }
}

/// Where the records' raster points are counted from.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Origin {
    /// One point for all, evaluated up to `reach` away from it on either axis.
    Point { x: f32, y: f32, reach: f32 },
    /// Each triangle's own corner 0.
    OwnCorner,
}

/// How far outside of a triangle's bounding rectangle its record is evaluated at most, on either axis.
const MARGIN: f32 = 4.0;

/// Sets up all lanes. `rounding` bounds the f64 error of projected raster coordinates, see
/// [`crate::view::View::rounding`].
#[inline(always)]
pub(crate) fn set_up<S: Simd>(simd: S, v: &VertexLanes, origin: Origin, rounding: f32, out: &mut EdgeLanes) {
    let splat = |value: f32| f32x16::splat(simd, value);
    let (x, y, nearness) = (load3(simd, &v.x), load3(simd, &v.y), load3(simd, &v.nearness));
    let origin = match origin {
        Origin::Point { x, y, reach } => LaneOrigin {
            x: splat(x),
            y: splat(y),
            reach: [splat(reach); 2],
        },
        Origin::OwnCorner => LaneOrigin {
            x: x[0],
            y: y[0],
            reach: [splat(MARGIN); 2],
        },
    };
    let eps = coordinate_error(simd, x, y, rounding);
    set_up_lanes(simd, [x, y, nearness], &origin, eps, out);
}

/// Bound on the error of coordinates that were rounded once: half an ulp of the largest, of vertices and of raster points
/// that were projected themselves.
#[inline(always)]
pub(crate) fn coordinate_error<S: Simd>(
    simd: S,
    x: [f32x16<S>; 3],
    y: [f32x16<S>; 3],
    rounding: f32,
) -> f32x16<S> {
    largest(x, y) * f32x16::splat(simd, 1.05 * ROUNDOFF) + f32x16::splat(simd, rounding)
}

/// Bound on the error of a triangle's area in the raster, twice its size, if coordinates are off by `eps`.
#[inline(always)]
pub(crate) fn area_error<S: Simd>(
    simd: S,
    x: [f32x16<S>; 3],
    y: [f32x16<S>; 3],
    eps: f32x16<S>,
) -> f32x16<S> {
    let (w, h) = (max3(x) - min3(x), max3(y) - min3(y));
    eps * f32x16::splat(simd, 4.0) * (w + h) + f32x16::splat(simd, 8.0 * ROUNDOFF) * w * h
}

/// Largest magnitude of a coordinate.
#[inline(always)]
pub(crate) fn largest<S: Simd>(x: [f32x16<S>; 3], y: [f32x16<S>; 3]) -> f32x16<S> {
    max3([x[0].abs(), x[1].abs(), x[2].abs()]).max(max3([y[0].abs(), y[1].abs(), y[2].abs()]))
}

/// Where each lane's raster points are counted from, and how far they lie from there at most on either axis.
pub(crate) struct LaneOrigin<S: Simd> {
    pub(crate) x: f32x16<S>,
    pub(crate) y: f32x16<S>,
    pub(crate) reach: [f32x16<S>; 2],
}

/// As [`set_up`], from x, y and nearness of the three corners; `eps` bounds the error of a coordinate.
///
/// Nearness inside of the triangle: an interpolant is off by no more than its values and corners are, so the
/// rounding of corners costs their error times the slope, however thin the triangle. The rest is the rounding of the
/// slopes themselves.
#[inline(always)]
pub(crate) fn set_up_lanes<S: Simd>(
    simd: S,
    [x, y, n]: [[f32x16<S>; 3]; 3],
    origin: &LaneOrigin<S>,
    eps: f32x16<S>,
    out: &mut EdgeLanes,
) {
    let splat = |value: f32| f32x16::splat(simd, value);
    let (x_min, x_max) = (min3(x), max3(x));
    let (y_min, y_max) = (min3(y), max3(y));
    let (w, h) = (x_max - x_min, y_max - y_min);
    let LaneOrigin { x: ox, y: oy, reach } = *origin;

    let (x01, y01) = (x[1] - x[0], y[1] - y[0]);
    let (x02, y02) = (x[2] - x[0], y[2] - y[0]);
    let area = x01 * y02 - x02 * y01;
    let area_error = area_error(simd, x, y, eps);
    let orientation = splat(1.0).copysign(area);

    // How far, at most, an evaluated point lies from any vertex, and how far the origin from either.
    let (near_x, near_y) = (w + splat(MARGIN), h + splat(MARGIN));
    let (far_x, far_y) = (w + reach[0], h + reach[1]);
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let (ex, ey) = (x[k] - x[j], y[k] - y[j]);
        let (ax, ay) = (ex.abs(), ey.abs());
        let bound = eps * splat(2.0) * (near_x + near_y + ax + ay)
            + splat(14.0 * ROUNDOFF) * (ax * far_y + ay * far_x);
        let scale = orientation / (bound * splat(1.02) + splat(f32::MIN_POSITIVE));
        let constant = ex * (oy - y[j]) - ey * (ox - x[j]);
        (-ey * scale).store_slice(&mut out.a[i]);
        (ex * scale).store_slice(&mut out.b[i]);
        (constant * scale).store_slice(&mut out.c[i]);
    }

    let (n01, n02) = (n[1] - n[0], n[2] - n[0]);
    let inverse = splat(1.0) / area;
    let gx = (n01 * y02 - n02 * y01) * inverse;
    let gy = (n02 * x01 - n01 * x02) * inverse;
    gx.store_slice(&mut out.nearness_x);
    gy.store_slice(&mut out.nearness_y);
    (n[0] + gx * (ox - x[0]) + gy * (oy - y[0])).store_slice(&mut out.nearness);

    let (n_min, n_max) = (min3(n), max3(n));
    let shift = (gx.abs() + gy.abs()) * eps * splat(2.0);
    let spread = n01.abs().max(n02.abs());
    // Of the products; the area divides both slopes alike, so its error scales n(q) - n0 as a whole.
    let slopes = spread * inverse.abs() * w * h * splat(32.0 * ROUNDOFF);
    let evaluation =
        splat(ROUNDOFF) * (n_max * splat(12.0) + (gx.abs() * far_x + gy.abs() * far_y) * splat(8.0));
    let error = shift + slopes + evaluation;

    let good = area.abs().simd_gt(area_error * splat(2.0))
        & error.simd_lt(n_min * splat(NEARNESS_BAND * 0.25))
        & n_min.simd_gt(splat(0.0));
    out.good = good.to_bitmask() as u32;
}
