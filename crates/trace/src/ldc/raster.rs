//! A triangle over one raster of the cube: which direction it belongs to, which texels it covers, and the plane
//! that its samples carry (VMV07, construction of the layered depth cube).
//!
//! Routing: a triangle goes to the direction its normal faces most, ties to the lower axis. There its depth rises by
//! at most one texel per texel on either raster axis, which is what lets a sample stand for its texel. A needle
//! whose normal rounding has spoilt goes where its length is not steep.
//!
//! Coverage is of texel centres, rows and columns half-open so that neighbours share no sample and leave none out
//! (up to the rounding of an edge, which they share), or conservative: every texel within [`REACH`] of the triangle.

use glam::DVec3;

use super::frame::{CubeFrame, Raster};
use crate::Triangles;

/// Which texels of a raster get a sample of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// Those whose centre it covers, as graphics hardware samples.
    Centre,
    /// All that it touches. Only this can answer exactly.
    #[default]
    Conservative,
}

/// How far beyond a texel's edge a conservative sample reaches, in texels: above the error of a line in texel
/// coordinates.
pub(crate) const REACH: f64 = 1.0 / 256.0;

/// Normals shorter than this share of their factors are not trusted.
const NEEDLE: f64 = 1.0 / (1u64 << 30) as f64;

/// A triangle in the raster it is routed to; coordinates are (u, v, w).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Routed {
    pub(crate) axis: usize,
    corners: [DVec3; 3],
    /// Depth of the plane at the raster's origin and its slopes; `None` for a needle.
    plane: Option<[f64; 3]>,
    /// Least and largest depth.
    pub(crate) depth: [f64; 2],
}

/// What one texel gets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fragment {
    pub(crate) column: u32,
    pub(crate) row: u32,
    /// Depth of the plane at the texel's centre, in texels.
    pub(crate) depth: f32,
    /// Least and largest depth of the triangle within reach of the texel.
    pub(crate) range: [f32; 2],
    /// Slopes of depth, 127 for 1; [`NO_PLANE`] for a needle.
    pub(crate) slopes: [i8; 2],
}

/// Slopes of a sample that knows its depth only to within a texel.
pub(crate) const NO_PLANE: [i8; 2] = [i8::MIN; 2];

impl Routed {
    pub(crate) fn new(frame: &CubeFrame, triangles: &Triangles, prim: u32) -> Self {
        let [a, b, c] = triangles.corners(prim).map(|p| p.as_dvec3());
        // Scaled first: the smallest and the largest f32 have no square in f64's range otherwise.
        let (e1, e2) = ((b - a) / frame.side, (c - a) / frame.side);
        let normal = e1.cross(e2);
        let needle = normal.length() <= NEEDLE * e1.length() * e2.length();
        let axis = if needle {
            let long = longest([e1, e2, e2 - e1]).abs();
            [2, 1, 0]
                .into_iter()
                .fold(0, |best, axis| if long[axis] <= long[best] { axis } else { best })
        } else {
            let n = normal.abs();
            (1..3).fold(0, |best, axis| if n[axis] > n[best] { axis } else { best })
        };
        let raster = Raster::new(frame, axis);
        let corners = [a, b, c].map(|p| raster.turned(frame.texel(p)));
        let n = raster.turned(normal);
        let plane = (!needle).then(|| {
            let (gu, gv) = (-n.x / n.z, -n.y / n.z);
            [corners[0].z - gu * corners[0].x - gv * corners[0].y, gu, gv]
        });
        let [z0, z1, z2] = corners.map(|p| p.z);
        Self {
            axis,
            corners,
            plane,
            depth: [z0.min(z1).min(z2), z0.max(z1).max(z2)],
        }
    }

    /// Rows that may have samples, from `from` to before `to`.
    pub(crate) fn rows(&self, raster: &Raster) -> [u32; 2] {
        let [v0, v1, v2] = self.corners.map(|p| p.y);
        let end = f64::from(raster.size[1]);
        let low = (v0.min(v1).min(v2) - REACH).clamp(0.0, end - 1.0);
        let high = (v0.max(v1).max(v2) + REACH).clamp(0.0, end - 1.0);
        [low as u32, high as u32 + 1]
    }

    /// About how many samples it gets, rather more.
    pub(crate) fn estimated_samples(&self) -> f64 {
        let [a, b, c] = self.corners.map(|p| p.truncate());
        let extent = a.max(b).max(c) - a.min(b).min(c);
        (b - a).perp_dot(c - a).abs() * 0.5 + extent.x + extent.y + 2.0
    }

    /// Columns of one row that get a sample, from the first to before the second.
    fn columns(&self, coverage: Coverage, row: u32, end: u32) -> [u32; 2] {
        let (row, last) = (f64::from(row), f64::from(end));
        match coverage {
            Coverage::Centre => {
                let [low, high] = self.crossing(row + 0.5);
                // Centres at or beyond `low` and before `high`.
                let first = |x: f64| (x - 0.5).ceil().clamp(0.0, last) as u32;
                if low < high {
                    [first(low), first(high)]
                } else {
                    [0, 0]
                }
            }
            Coverage::Conservative => {
                let [low, high] = self.extent(row - REACH, row + 1.0 + REACH);
                if low <= high {
                    let clamp = |x: f64| x.clamp(0.0, last - 1.0) as u32;
                    [clamp(low - REACH), clamp(high + REACH) + 1]
                } else {
                    [0, 0]
                }
            }
        }
    }

    /// Where the triangle's outline crosses a line v = const; each edge counts its lower end only.
    fn crossing(&self, v: f64) -> [f64; 2] {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in self.edges() {
            if (a.y <= v) == (b.y <= v) {
                continue;
            }
            // In one order for both triangles at an edge.
            let (a, b) = if (a.y, a.x, a.z) < (b.y, b.x, b.z) {
                (a, b)
            } else {
                (b, a)
            };
            let u = a.x + (b.x - a.x) * ((v - a.y) / (b.y - a.y));
            (low, high) = (low.min(u), high.max(u));
        }
        [low, high]
    }

    /// Extent in u of the part of the triangle between two lines v = const.
    fn extent(&self, from: f64, to: f64) -> [f64; 2] {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (a, b) in self.edges() {
            if a.y.max(b.y) < from || a.y.min(b.y) > to {
                continue;
            }
            for v in [a.y.clamp(from, to), b.y.clamp(from, to)] {
                let share = (v - a.y) / (b.y - a.y);
                // A level edge divides by zero; both of its ends are within.
                let ends = if share.is_finite() {
                    let u = a.x + (b.x - a.x) * share.clamp(0.0, 1.0);
                    [u, u]
                } else {
                    [a.x, b.x]
                };
                (low, high) = (low.min(ends[0].min(ends[1])), high.max(ends[0].max(ends[1])));
            }
        }
        [low, high]
    }

    fn edges(&self) -> [(DVec3, DVec3); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }

    /// Calls `emit` with the samples of one row, by column.
    pub(crate) fn fragments(
        &self,
        raster: &Raster,
        coverage: Coverage,
        row: u32,
        mut emit: impl FnMut(Fragment),
    ) {
        let [from, to] = self.columns(coverage, row, raster.size[0]);
        for column in from..to {
            let (u, v) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
            let [least, largest] = self.depth;
            let (depth, spread, slopes) = match self.plane {
                Some([at_origin, gu, gv]) => (
                    at_origin + gu * u + gv * v,
                    (gu.abs() + gv.abs()) * (0.5 + REACH),
                    [gu, gv].map(|g| (g * 127.0).round().clamp(-127.0, 127.0) as i8),
                ),
                None => (self.depth_along_needle(u, v), 1.0 + REACH, NO_PLANE),
            };
            // A sample that names its triangle is needed where that is, one that stands for it over all of its texel.
            let [least, largest] = match coverage {
                Coverage::Conservative => [least, largest],
                Coverage::Centre => [f64::NEG_INFINITY, f64::INFINITY],
            };
            let near = depth.clamp(least, largest);
            emit(Fragment {
                column,
                row,
                depth: depth as f32,
                range: [
                    ((near - spread).max(least) - REACH) as f32,
                    ((near + spread).min(largest) + REACH) as f32,
                ],
                slopes,
            });
        }
    }

    /// Depth of the longest edge where it passes a texel's centre on the raster axis it follows.
    fn depth_along_needle(&self, u: f64, v: f64) -> f64 {
        let (a, b) = self
            .edges()
            .into_iter()
            .max_by(|(a, b), (c, d)| a.distance_squared(*b).total_cmp(&c.distance_squared(*d)))
            .unwrap_or_default();
        let d = b - a;
        let share = if d.x.abs() >= d.y.abs() {
            (u - a.x) / d.x
        } else {
            (v - a.y) / d.y
        };
        if share.is_finite() {
            a.z + d.z * share.clamp(0.0, 1.0)
        } else {
            a.z
        }
    }
}

fn longest(edges: [DVec3; 3]) -> DVec3 {
    edges
        .into_iter()
        .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        .unwrap_or_default()
}
