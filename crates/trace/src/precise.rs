//! One triangle in a view, in f64: for the few that f32 lanes cannot set up.
//!
//! In homogeneous raster coordinates `p_i` = (x, y, w) the edge functions are `p_j x p_k` dotted with (x, y, 1)
//! (Olano and Greer 1997): no clipping is needed for triangles that reach behind the center of projection. Their
//! sign is oriented so that every ray that hits (t > 0) sees all three non-negative; that orientation is exact.
//! Nearness comes from the plane's normal N: `(d . N) / (a_0 . N)` for the ray direction d and corner `a_0` from the
//! center, which is off by little unless the center nearly lies in the plane. The raster's origin is moved next to the triangle first, so that products of
//! coordinates stay small and errors with them. Cost: some 150 operations; used for triangles that cross the
//! center's plane, lie far outside of the raster or are nearly edge-on, and to bin large ones.

use glam::{DVec3, Vec3, Vec3Swizzles};
use robust::{Coord3D, orient3d};

use crate::kernel::edges::EdgeRecord;
use crate::kernel::{NEARNESS_BAND, ROUNDOFF};
use crate::view::{Arrangement, View};

/// Bound on the relative f64 error of a product of two sums of a few terms; generous.
const PRODUCT_ERROR: f64 = 1.0 / (1u64 << 47) as f64;

/// Nearness over the raster, and its error: a share of itself and a constant.
#[derive(Clone, Copy, Debug)]
struct NearnessPlane {
    /// Coefficients (of x, of y, constant) from the triangle's origin.
    plane: DVec3,
    share: f64,
    constant: f64,
}

impl NearnessPlane {
    fn new(view: &View, [v0, v1, v2]: [Vec3; 3], origin: [f64; 2]) -> Self {
        let (v0, v1, v2) = (v0.as_dvec3(), v1.as_dvec3(), v2.as_dvec3());
        let (edge1, edge2, a0) = (v1 - v0, v2 - v0, v0 - view.center.as_dvec3());
        let normal = edge1.cross(edge2);
        let terms = edge1.yzx().abs() * edge2.zxy().abs() + edge1.zxy().abs() * edge2.yzx().abs();
        // Bound on the error of the normal's dot product with a vector below `v`.
        let doubt = |v: DVec3| terms.dot(v) * 2f64.powi(-48);
        let (right, up) = (view.right / view.scale_x, view.up / view.scale_y);
        let [cx, cy] = view.middle;
        let offset = right * (origin[0] - cx) + up * (cy - origin[1]);
        let farthest = |middle: f64, size: u32| middle.abs().max((f64::from(size) - middle).abs());
        let offsets = right.abs() * farthest(cx, view.width) + up.abs() * farthest(cy, view.height);
        match view.arrangement {
            Arrangement::Perspective => {
                let height = a0.dot(normal);
                Self {
                    plane: DVec3::new(
                        right.dot(normal),
                        -up.dot(normal),
                        (view.forward + offset).dot(normal),
                    ) / height,
                    share: doubt(a0.abs()) / height.abs(),
                    constant: doubt(view.forward.abs() + offsets) / height.abs(),
                }
            }
            Arrangement::Parallel { reach } => {
                let steepness = view.forward.dot(normal);
                let depth = (a0 - offset).dot(normal) / steepness;
                Self {
                    plane: DVec3::new(
                        right.dot(normal) / steepness,
                        -up.dot(normal) / steepness,
                        reach - depth,
                    ),
                    share: 0.0,
                    constant: (doubt(a0.abs() + offsets) + reach * doubt(view.forward.abs()))
                        / steepness.abs()
                        + reach * 2f64.powi(-48),
                }
            }
        }
    }
}

/// Edge functions, nearness plane and their error bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreciseTriangle {
    /// Raster point that the rest is relative to.
    origin: [f64; 2],
    points: [DVec3; 3],
    /// Coefficients (of x, of y, constant); inside is where all are non-negative.
    edges: [DVec3; 3],
    /// Bound on the error of each edge function, per unit of |x| + |y| + 1.
    edge_errors: [f64; 3],
    nearness: NearnessPlane,
    /// See [`View::rounding`].
    rounding: f64,
    /// Nearness above which a point is not certain to lie in front of the view's start.
    ceiling: f64,
}

impl PreciseTriangle {
    /// `None` if no ray of the view can hit: the triangle has no area, is not finite, or is seen edge-on.
    pub(crate) fn new(view: &View, corners: [Vec3; 3]) -> Option<Self> {
        if !corners.iter().all(|c| c.is_finite()) {
            return None;
        }
        let orientation = orientation(view, corners);
        if orientation == 0.0 {
            return None;
        }
        let homogeneous = corners.map(|c| view.homogeneous(c.as_dvec3()));
        let origin = raster_point_near(view, homogeneous.map(|h| h.p));
        let points = homogeneous.map(|h| h.p - DVec3::new(origin[0], origin[1], 0.0) * h.p.z);
        let [p0, p1, p2] = points;
        let edges = [
            p1.cross(p2) * orientation,
            p2.cross(p0) * orientation,
            p0.cross(p1) * orientation,
        ];

        // Sizes of the coordinates now, and of those whose rounding they carry.
        let size = points.map(|p| p.abs().element_sum());
        let parallel = matches!(view.arrangement, Arrangement::Parallel { .. });
        let center = view.center.as_dvec3();
        let scale = view.scale_x.abs().max(view.scale_y.abs());
        let raster = view.middle[0].abs() + view.middle[1].abs() + f64::from(view.width + view.height);
        let spans = corners.map(|c| {
            let distance = (c.as_dvec3() - center).length();
            if parallel {
                (distance + center.length()) * scale + raster
            } else {
                distance * (scale + raster)
            }
        });
        let carried: [f64; 3] = std::array::from_fn(|i| homogeneous[i].p.abs().element_sum() + spans[i]);
        let error = |j: usize, k: usize| {
            PRODUCT_ERROR * (size[j] * size[k] + (carried[j] * size[k] + size[j] * carried[k]) / 8.0)
        };
        let edge_errors = [error(1, 2), error(2, 0), error(0, 1)];
        let plane = NearnessPlane::new(view, corners, origin);
        let ceiling = match view.arrangement {
            Arrangement::Perspective => f64::INFINITY,
            Arrangement::Parallel { reach } => reach * (1.0 - f64::from(NEARNESS_BAND)),
        };
        Some(Self {
            origin,
            points,
            edges,
            edge_errors,
            nearness: plane,
            rounding: view.rounding(),
            ceiling,
        })
    }

    /// The range of x in which rays with y from `top` to `bottom` may hit; never too small. `None` if none may.
    pub(crate) fn row_span(&self, top: f64, bottom: f64) -> Option<[f64; 2]> {
        let (top, bottom) = (top - self.origin[1], bottom - self.origin[1]);
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (edge, error) in self.edges.iter().zip(self.edge_errors) {
            // Over the row, e(x, y) + error (|x| + |y| + 1) is at most rest + edge.x x + error |x|.
            let at = |y: f64| edge.y * y + error * (y.abs() + 1.0);
            let rest = at(top).max(at(bottom)) + edge.z;
            if edge.x.abs() <= 2.0 * error {
                continue;
            }
            // Where edge.x dominates, x beyond the root by its error's share cannot be inside.
            let root = -rest / edge.x;
            let slack = root.abs() * (2.0 * error / edge.x.abs()) + root.abs() * 1e-12 + self.rounding;
            if edge.x > 0.0 {
                from = from.max(root - slack);
            } else {
                to = to.min(root + slack);
            }
        }
        (from <= to).then(|| [from + self.origin[0], to + self.origin[0]])
    }

    /// Raster rectangle (min, max) that holds all of the triangle that the view sees; `None` if nothing.
    ///
    /// The part inside the view's pyramid is cut out in homogeneous coordinates, so that no division by a depth
    /// near zero occurs unless the triangle passes through the center itself. Cuts leave as much more as rounding of
    /// the largest coordinate may take away.
    pub(crate) fn bounds(&self, view: &View) -> Option<[[f64; 2]; 2]> {
        let (width, height) = (f64::from(view.width), f64::from(view.height));
        let whole = Some([[0.0, 0.0], [width, height]]);
        let [ox, oy] = self.origin;
        let planes = [
            DVec3::new(1.0, 0.0, ox),
            DVec3::new(0.0, 1.0, oy),
            DVec3::new(-1.0, 0.0, width - ox),
            DVec3::new(0.0, -1.0, height - oy),
        ];
        let size = self
            .points
            .iter()
            .map(|p| p.abs().element_sum())
            .fold(0.0, f64::max);
        let rounding = size * 2f64.powi(-49);
        let mut polygon: Vec<DVec3> = self.points.to_vec();
        for plane in planes {
            polygon = clip(&polygon, plane, rounding * 2.0 * plane.abs().element_sum());
            if polygon.is_empty() {
                return None;
            }
        }
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in polygon {
            // Inside the pyramid only its tip has no depth; there the triangle may cover everything.
            let [x, y] = [p.x / p.z, p.y / p.z];
            let errors = [x, y].map(|v| rounding * (1.0 + v.abs()) / (p.z - rounding));
            if !(p.z > 2.0 * rounding && errors.iter().all(|error| error.is_finite())) {
                return whole;
            }
            let [x, y] = [x + ox, y + oy];
            min = [min[0].min(x - errors[0]), min[1].min(y - errors[1])];
            max = [max[0].max(x + errors[0]), max[1].max(y + errors[1])];
        }
        let slack = (width + height) * 1e-7;
        Some([min.map(|v| v - slack), max.map(|v| v + slack)])
    }

    /// The triangle as the kernels take it, relative to raster point `origin` and for use within `reach` of it.
    pub(crate) fn record(&self, prim: u32, origin: [f64; 2], reach: f64) -> EdgeRecord {
        let [x, y] = [origin[0] - self.origin[0], origin[1] - self.origin[1]];
        let extent = x.abs() + y.abs() + 2.0 * reach + 1.0;
        let at_origin = |p: DVec3| DVec3::new(p.x, p.y, p.x * x + p.y * y + p.z);
        let rounding = |p: DVec3| {
            let slope = p.x.abs() + p.y.abs();
            8.0 * f64::from(ROUNDOFF) * (slope * reach + p.z.abs()) + slope * self.rounding
        };
        let mut record = EdgeRecord {
            prim,
            ..EdgeRecord::default()
        };
        for i in 0..3 {
            let edge = at_origin(self.edges[i]);
            let edge = edge / (1.01 * (self.edge_errors[i] * extent + rounding(edge)));
            (record.a[i], record.b[i], record.c[i]) = (edge.x as f32, edge.y as f32, edge.z as f32);
        }
        let plane = at_origin(self.nearness.plane);
        (record.nearness_x, record.nearness_y, record.nearness) =
            (plane.x as f32, plane.y as f32, plane.z as f32);
        let share = f64::from(NEARNESS_BAND) / 4.0 - self.nearness.share;
        record.floor = if share > f64::from(NEARNESS_BAND) / 8.0 {
            ((self.nearness.constant + rounding(plane)) / share) as f32
        } else {
            f32::INFINITY
        };
        record.ceiling = self.ceiling as f32;
        record
    }
}

/// A raster point close to the triangle: where its first corner in front lies, kept to the raster.
fn raster_point_near(view: &View, points: [DVec3; 3]) -> [f64; 2] {
    let front = points.iter().find(|p| p.z > 0.0);
    front.map_or(view.middle, |p| {
        let limit = |v: f64, size: u32| v.clamp(0.0, f64::from(size)).round();
        [limit(p.x / p.z, view.width), limit(p.y / p.z, view.height)]
    })
}

/// Exact sign of the edge functions inside the triangle: which way round it lies in the raster.
fn orientation(view: &View, corners: [Vec3; 3]) -> f64 {
    let coord = |p: DVec3| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    let zero = coord(DVec3::ZERO);
    let [v0, v1, v2] = corners.map(Vec3::as_dvec3);
    let volume = match view.arrangement {
        Arrangement::Perspective => {
            let c = view.center.as_dvec3();
            orient3d(coord(v0 - c), coord(v1 - c), coord(v2 - c), zero)
        }
        Arrangement::Parallel { .. } => orient3d(coord(v1 - v0), coord(v2 - v0), coord(view.forward), zero),
    };
    let handedness = -view.right.cross(view.up).dot(view.forward);
    if volume == 0.0 {
        0.0
    } else {
        volume.signum() * handedness.signum()
    }
}

/// The part of a convex polygon where `plane . p >= -slack` (Sutherland and Hodgman).
fn clip(polygon: &[DVec3], plane: DVec3, slack: f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (dp, dq) = (plane.dot(p) + slack, plane.dot(q) + slack);
        if dp >= 0.0 {
            kept.push(p);
        }
        if (dp >= 0.0) != (dq >= 0.0) {
            kept.push(p + (q - p) * (dp / (dp - dq)));
        }
    }
    kept
}
