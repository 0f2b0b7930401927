//! How near the casters of a cell come (HM08 §5.2: the nearest of a cell lights what is before it).

use rayon::prelude::*;

use crate::Triangles;
use crate::bins::Bins;
use crate::kernel::NEARNESS_BAND;
use crate::kernel::points::Caster;
use crate::kernel::project::RasterVertex;
use crate::view::View;

/// For every cell the bound on its casters' nearness: of each the smaller of its largest vertex and its plane's
/// largest value over the cell's corners.
pub(super) fn nearest_per_cell(
    view: &View,
    triangles: &Triangles,
    vertices: &[RasterVertex],
    bins: &Bins,
    prims: &[u32],
    casters: &[Caster],
) -> Vec<f32> {
    let columns = view.width as usize;
    // Casters not larger than a cell are bounded by their nearest vertex; the others, marked by a bound below 0,
    // by their plane as well.
    let bounds: Vec<f32> = prims
        .par_iter()
        .map(|&prim| {
            let [a, b, c] = triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
            let extent = |v: [f32; 3]| v[0].max(v[1]).max(v[2]) - v[0].min(v[1]).min(v[2]);
            let small = extent([a.x, b.x, c.x]) <= 1.0 && extent([a.y, b.y, c.y]) <= 1.0;
            let usable = a.nearness > 0.0 && b.nearness > 0.0 && c.nearness > 0.0;
            let largest = a.nearness.max(b.nearness).max(c.nearness) * (1.0 + NEARNESS_BAND);
            if small && usable { largest } else { -1.0 }
        })
        .collect();
    let mut nearest = vec![0.0f32; columns * view.height as usize];
    nearest
        .par_chunks_mut(columns)
        .enumerate()
        .for_each(|(row, nearest)| {
            for (column, nearest) in nearest.iter_mut().enumerate() {
                let corner = [column as f32, row as f32];
                for &r in bins.cell(row * columns + column).flatten() {
                    let mut bound = bounds[r as usize];
                    if bound < 0.0 {
                        let corners =
                            triangles.indices[prims[r as usize] as usize].map(|i| &vertices[i as usize]);
                        bound = nearness_bound(&casters[r as usize], corners, corner);
                    }
                    *nearest = nearest.max(bound);
                }
            }
        });
    nearest
}

/// A bound on a caster's nearness over a cell.
#[inline]
fn nearness_bound(caster: &Caster, corners: [&RasterVertex; 3], cell: [f32; 2]) -> f32 {
    let vertex_bound = if corners.iter().all(|v| v.nearness > 0.0) {
        corners[0]
            .nearness
            .max(corners[1].nearness)
            .max(corners[2].nearness)
    } else {
        f32::INFINITY
    };
    let plane_bound = plane_range(caster, corners, cell)[1];
    vertex_bound.min(plane_bound) * (1.0 + NEARNESS_BAND)
}

/// Bounds of the nearness of a caster's plane over that part of a cell in which the caster may be.
#[inline]
pub(super) fn plane_range(caster: &Caster, corners: [&RasterVertex; 3], cell: [f32; 2]) -> [f32; 2] {
    let Caster { record, origin } = caster;
    // Points belong to a cell by clamping too, so the cell is taken a little larger. A plane is known to its
    // error only within its triangle's rectangle, and only there it matters.
    let [a, b, c] = corners;
    let known = corners.iter().all(|v| v.nearness > 0.0);
    let range = |axis: usize, v: [f32; 3]| {
        let (low, high) = (cell[axis] - 0.01, cell[axis] + 1.01);
        let (low, high) = if known {
            (
                low.max(v[0].min(v[1]).min(v[2])),
                high.min(v[0].max(v[1]).max(v[2])),
            )
        } else {
            (low, high)
        };
        [low - origin[axis], high - origin[axis]]
    };
    let term = |g: f32, [low, high]: [f32; 2]| {
        let (first, second) = (g * low, g * high);
        let size = g.abs() * low.abs().max(high.abs());
        [first.min(second), first.max(second), size]
    };
    let x = term(record.nearness_x, range(0, [a.x, b.x, c.x]));
    let y = term(record.nearness_y, range(1, [a.y, b.y, c.y]));
    let rounding = (record.nearness.abs() + x[2] + y[2]) * 1e-6;
    [
        record.nearness + x[0] + y[0] - rounding,
        (record.nearness + x[1] + y[1]).max(record.floor) + rounding,
    ]
}
