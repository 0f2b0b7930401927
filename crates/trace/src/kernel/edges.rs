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
use super::{LANES, NEARNESS_BAND, ROUNDOFF};

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
    let load = |lanes: &[f32; LANES]| f32x16::from_slice(simd, lanes);
    let x = [load(&v.x[0]), load(&v.x[1]), load(&v.x[2])];
    let y = [load(&v.y[0]), load(&v.y[1]), load(&v.y[2])];
    let n = [load(&v.nearness[0]), load(&v.nearness[1]), load(&v.nearness[2])];
    let (x_min, x_max) = (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]));
    let (y_min, y_max) = (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]));
    let (w, h) = (x_max - x_min, y_max - y_min);
    let largest = x_min.abs().max(x_max.abs()).max(y_min.abs().max(y_max.abs()));
    // Half an ulp of the largest coordinate: vertices, and raster points that were projected themselves.
    let eps = largest * splat(1.05 * ROUNDOFF) + splat(rounding);
    let (ox, oy, reach) = match origin {
        Origin::Point { x, y, reach } => (splat(x), splat(y), splat(reach)),
        Origin::OwnCorner => (x[0], y[0], splat(MARGIN)),
    };

    let (x01, y01) = (x[1] - x[0], y[1] - y[0]);
    let (x02, y02) = (x[2] - x[0], y[2] - y[0]);
    let area = x01 * y02 - x02 * y01;
    let area_error = eps * splat(4.0) * (w + h) + splat(8.0 * ROUNDOFF) * w * h;
    let orientation = splat(1.0).copysign(area);

    // How far, at most, an evaluated point lies from any vertex, and how far the origin from either.
    let (near_x, near_y) = (w + splat(MARGIN), h + splat(MARGIN));
    let (far_x, far_y) = (w + reach, h + reach);
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let (ex, ey) = (x[k] - x[j], y[k] - y[j]);
        let (ax, ay) = (ex.abs(), ey.abs());
        let bound = eps * splat(2.0) * (near_x + near_y + ax + ay)
            + splat(12.0 * ROUNDOFF) * (ax * far_y + ay * far_x);
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

    // Error of n inside the triangle: of the differences, of the area, of the raster point, of the evaluation.
    let n_min = n[0].min(n[1]).min(n[2]);
    let n_max = n[0].max(n[1]).max(n[2]);
    let shift = (gx.abs() + gy.abs()) * eps * splat(2.0);
    let spread = n01.abs().max(n02.abs());
    let inverse = inverse.abs();
    let differences = inverse
        * (w * h * splat(4.0 * ROUNDOFF) * (n_max * splat(2.0) + spread * splat(4.0))
            + eps * spread * splat(4.0) * (w + h));
    let evaluation = splat(6.0 * ROUNDOFF) * (n_max + gx.abs() * far_x + gy.abs() * far_y);
    // The area divides both slopes alike, so its error scales n(q) - n0 as a whole.
    let error = differences + spread * inverse * area_error + shift + evaluation;

    let good = area.abs().simd_gt(area_error * splat(2.0))
        & error.simd_lt(n_min * splat(NEARNESS_BAND * 0.25))
        & n_min.simd_gt(splat(0.0));
    out.good = good.to_bitmask() as u32;
}
