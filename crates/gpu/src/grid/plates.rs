//! Triangles as seen from a vantage: flat, cut off at the view's sides.
//!
//! All of it in f64, rounded once. What lies wholly before the view and not far beside it is taken as it is; the rest is cut
//! in homogeneous coordinates, where the sides of the raster also cut off what lies behind the vantage. What is seen edge-on
//! from the vantage itself covers all.

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rayon::prelude::*;
use rayward_trace::{Triangles, View};

/// `REACH` of `common.wgsl`.
const REACH: f64 = 1.0 / 256.0;

/// Coordinates as they are lie within so many cells of the raster: f32 knows them to 2^-11.
const GUARD: f64 = 1024.0;

/// How far beyond the raster triangles are cut, in cells.
const MARGIN: f64 = 1.0;

/// `Plate` of `grid.wgsl`: a triangle in a face of the grid, in cells.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Plate {
    pub(crate) ax: f32,
    pub(crate) ay: f32,
    pub(crate) bx: f32,
    pub(crate) by: f32,
    pub(crate) cx: f32,
    pub(crate) cy: f32,
    /// All of it lies at least as deep.
    pub(crate) depth: f32,
    pub(crate) prim: u32,
    /// First cell of the face.
    pub(crate) first: u32,
    /// Its first row.
    pub(crate) row: u32,
}

/// The plates of these triangles in a view on a raster of cells whose first is `first`, and the number of rows of each.
pub(crate) fn plates(view: &View, triangles: &Triangles, prims: &[u32], first: u32) -> Vec<(Plate, u32)> {
    let parts = prims.par_chunks(4096).map(|chunk| {
        let mut found = Vec::new();
        for &prim in chunk {
            let corners = triangles.corners(prim).map(|p| p.as_dvec3());
            shown(view, corners, &mut |flat, depth| {
                let rows = rows(view, &flat);
                let [[ax, ay], [bx, by], [cx, cy]] = flat.map(|p| p.map(|v| v as f32));
                let plate = Plate {
                    ax,
                    ay,
                    bx,
                    by,
                    cx,
                    cy,
                    depth,
                    prim,
                    first,
                    row: rows[0],
                };
                found.push((plate, rows[1] - rows[0]));
            });
        }
        found
    });
    parts.flatten_iter().collect()
}

/// Rows within reach, from the first to before the second.
fn rows(view: &View, flat: &[[f64; 2]; 3]) -> [u32; 2] {
    let last = f64::from(view.height) - 1.0;
    let [a, b, c] = flat.map(|p| p[1]);
    let low = (a.min(b).min(c) - REACH).clamp(0.0, last);
    let high = (a.max(b).max(c) + REACH).clamp(0.0, last);
    [low as u32, high as u32 + 1]
}

/// Calls `emit` with what the raster shows of a triangle, as triangles in raster coordinates, and a bound on its depth.
fn shown(view: &View, corners: [DVec3; 3], emit: &mut impl FnMut([[f64; 2]; 3], f32)) {
    let center = view.center.as_dvec3();
    let seen = corners.map(|p| view.homogeneous(p).p);
    let [width, height] = [view.width, view.height].map(f64::from);
    let outside = |of: &dyn Fn(DVec3) -> f64| seen.iter().all(|&p| of(p) < -MARGIN * p.z.abs());
    if outside(&|p| p.x)
        || outside(&|p| p.y)
        || outside(&|p| width * p.z - p.x)
        || outside(&|p| height * p.z - p.y)
    {
        return;
    }
    let depths = corners.map(|p| (p - center).dot(view.forward));
    let [least, size] = [
        depths.iter().copied().fold(f64::INFINITY, f64::min),
        depths.iter().map(|d| d.abs()).fold(0.0, f64::max),
    ];
    let flat = seen.map(|p| [p.x / p.z, p.y / p.z]);
    let near = |v: f64, end: f64| v > -GUARD && v < end + GUARD;
    let plain = least > size * 1e-9 && flat.iter().all(|&[x, y]| near(x, width) && near(y, height));
    let parallel = seen.iter().all(|p| p.z == 1.0);
    if (plain || parallel) && flat.iter().all(|&[x, y]| near(x, width) && near(y, height)) {
        // Rounded down, beyond the rounding of depths.
        emit(flat, (least - size * 1e-6) as f32);
        return;
    }
    let mut cut = vec![seen[0], seen[1], seen[2]];
    for side in [
        DVec3::new(1.0, 0.0, MARGIN),
        DVec3::new(-1.0, 0.0, width + MARGIN),
        DVec3::new(0.0, 1.0, MARGIN),
        DVec3::new(0.0, -1.0, height + MARGIN),
    ] {
        cut = behind(&cut, side);
    }
    if cut.is_empty() {
        return;
    }
    let all = [[0.0, 0.0], [2.0 * width, 0.0], [0.0, 2.0 * height]];
    let largest = seen.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    if cut.iter().any(|p| p.z <= largest * 1e-12) {
        emit(all, f32::NEG_INFINITY);
        return;
    }
    let flat: Vec<[f64; 2]> = cut.iter().map(|p| [p.x / p.z, p.y / p.z]).collect();
    for pair in flat[1..].windows(2) {
        emit([flat[0], pair[0], pair[1]], f32::NEG_INFINITY);
    }
}

/// The part of a polygon on one side of a plane through the vantage.
fn behind(polygon: &[DVec3], side: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (p, q) = (side.dot(a), side.dot(b));
        if p >= 0.0 {
            kept.push(a);
        }
        if (p >= 0.0) != (q >= 0.0) {
            kept.push(a + (b - a) * (p / (p - q)));
        }
    }
    kept
}
