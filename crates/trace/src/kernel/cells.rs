//! Which cells of a raster sixteen projected triangles may reach, by their bounding rectangles (HM08 §3).
//!
//! Cost: some 60 vector instructions and 48 moves of vertices for sixteen triangles.

use fearless_simd::{Simd, dispatch, f32x16, i32x16, mask32x16, prelude::*};

use super::batch::corner_lanes;
use super::project::RasterVertex;
use super::{LANES, SimdLevel, bits_of, max3, min3};
use crate::bins::{CellGrid, SLACK};

/// Sixteen triangles by cells.
#[derive(Clone, Debug, Default)]
pub(crate) struct CellRects {
    corners: [[[f32; 4]; LANES]; 3],
    /// First column and row, last column and row of the cells of each.
    pub(crate) cells: [[i32; LANES]; 4],
    /// A bit for each triangle that lies in front and may matter in some cell.
    pub(crate) ahead: u32,
    /// A bit for each that lies neither in front nor behind, of which nothing else is told.
    pub(crate) crossing: u32,
}

/// Finds the cells of up to sixteen triangles.
pub(crate) fn cell_rects(
    level: SimdLevel,
    grid: &CellGrid,
    vertices: &[RasterVertex],
    triangles: &[[u32; 3]],
    out: &mut CellRects,
) {
    dispatch!(level.0, simd => cell_rects_impl(simd, grid, vertices, triangles, out));
}

#[inline(always)]
fn cell_rects_impl<S: Simd>(
    simd: S,
    grid: &CellGrid,
    vertices: &[RasterVertex],
    triangles: &[[u32; 3]],
    out: &mut CellRects,
) {
    for (lane, &[a, b, c]) in triangles.iter().enumerate() {
        out.corners[0][lane] = vertices[a as usize].words();
        out.corners[1][lane] = vertices[b as usize].words();
        out.corners[2][lane] = vertices[c as usize].words();
    }
    let used = u32::MAX >> (32 - triangles.len() as u32);
    let [x, y, nearness] = corner_lanes(simd, &out.corners, 0, [0.0; 2]);
    let zero = f32x16::splat(simd, 0.0);
    let ahead = nearness[0].simd_ge(zero) & nearness[1].simd_ge(zero) & nearness[2].simd_ge(zero);
    let behind = nearness[0].simd_lt(zero) & nearness[1].simd_lt(zero) & nearness[2].simd_lt(zero);
    let matters = range(simd, grid, 0, x, &mut out.cells) & range(simd, grid, 1, y, &mut out.cells);
    out.ahead = bits_of(simd, ahead & matters) & used;
    out.crossing = !bits_of(simd, ahead | behind) & used;
}

/// First and last cell on an axis, which go to `cells`; whether anything of the triangles matters there.
#[inline(always)]
fn range<S: Simd>(
    simd: S,
    grid: &CellGrid,
    axis: usize,
    v: [f32x16<S>; 3],
    cells: &mut [[i32; LANES]; 4],
) -> mask32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let (zero, half, limit) = (splat(0.0), splat(0.5), splat(grid.size[axis]));
    let (low, high) = (min3(v) - splat(SLACK), max3(v) + splat(SLACK));
    // What is no number is refused.
    let mut matters = low.simd_le(high) & high.simd_ge(zero) & low.simd_lt(limit);
    let (mut low, mut high) = (low.max(zero), high.min(limit));
    if grid.pixel_centres {
        // Half-integers within.
        (low, high) = ((low - half).ceil(), (high + half).floor() - splat(1.0));
        matters &= low.simd_le(high);
    }
    let (side, last) = (splat(grid.side), splat(grid.cells[axis] as f32 - 1.0));
    let first = (low / side).min(last).max(zero).to_int::<i32x16<S>>();
    let end = (high / side).min(last).max(zero).to_int::<i32x16<S>>();
    first.store_slice(&mut cells[axis]);
    end.store_slice(&mut cells[axis + 2]);
    matters
}
