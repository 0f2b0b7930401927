//! Triangles sorted into the cells of a view's raster (HM08 §3 and §7; sort-middle).
//!
//! The triangles are cut into chunks; each chunk projects nothing and shares nothing: it finds the cell
//! rectangle of its triangles and sorts them by cell with a counting sort of its own. A cell's list is the
//! concatenation of the chunks' slices, so no merge, no atomics, and the same lists for any number of threads.
//! Layout: 4 bytes a reference and 4 bytes a cell and chunk. A triangle over more than 2 x 2 cells is put only
//! into cells that its edges may reach, so a long thin triangle does not fill its rectangle.

use rayon::prelude::*;

use crate::Triangles;
use crate::kernel::project::RasterVertex;
use crate::precise::PreciseTriangle;
use crate::view::View;

/// How triangles are put into cells.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Binning {
    /// Into the cells their edges may reach.
    #[default]
    Overlap,
    /// Into all cells of their bounding rectangle, as HM08 does.
    Rectangle,
}

/// The cells of a raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellGrid {
    /// Columns and rows.
    pub(crate) cells: [u32; 2],
    /// Side of a cell in raster units.
    pub(crate) side: f32,
    /// Width and height of the raster; cells at its end may reach beyond.
    pub(crate) size: [f32; 2],
    /// Whether a triangle matters only if it may cover a half-integer raster point (a pixel centre).
    pub(crate) pixel_centres: bool,
}

/// Sorted references of one chunk.
#[derive(Clone, Debug, Default)]
struct Chunk {
    starts: Vec<u32>,
    refs: Vec<u32>,
}

/// All references, by cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bins {
    chunks: Vec<Chunk>,
}

/// Triangles in a chunk at least: below, the per-cell starts would cost more than the references.
const SMALLEST_CHUNK: usize = 32 * 1024;

/// Chunks at most: every chunk has a start for every cell.
const CHUNKS: usize = 16;

impl Bins {
    /// Sorts those triangles of `prims` for which `keep` holds.
    pub(crate) fn build(
        view: &View,
        triangles: &Triangles,
        vertices: &[RasterVertex],
        grid: &CellGrid,
        binning: Binning,
        keep: impl Fn(u32) -> bool + Sync,
    ) -> Self {
        let count = triangles.len();
        let chunk_size = count.div_ceil(CHUNKS).max(SMALLEST_CHUNK);
        let chunks = (0..count.div_ceil(chunk_size))
            .into_par_iter()
            .map(|chunk| {
                let prims = (chunk * chunk_size) as u32..((chunk + 1) * chunk_size).min(count) as u32;
                let mut pairs = Vec::with_capacity(prims.len());
                for prim in prims {
                    if keep(prim) {
                        bin(view, triangles, vertices, grid, binning, prim, &mut pairs);
                    }
                }
                Chunk::sorted(&pairs, (grid.cells[0] * grid.cells[1]) as usize)
            })
            .collect();
        Self { chunks }
    }

    /// The triangles of a cell, in slices.
    pub(crate) fn cell(&self, cell: usize) -> impl Iterator<Item = &[u32]> {
        self.chunks
            .iter()
            .map(move |chunk| &chunk.refs[chunk.starts[cell] as usize..chunk.starts[cell + 1] as usize])
    }

    /// Renumbers the references from triangle ids to positions in the returned list of the triangles that are
    /// referred to at all, in ascending order.
    pub(crate) fn number_references(&mut self, triangles: usize) -> Vec<u32> {
        let mut number = vec![0u32; triangles];
        for &prim in self.chunks.iter().flat_map(|c| &c.refs) {
            number[prim as usize] = 1;
        }
        let mut prims = Vec::new();
        for (prim, number) in number.iter_mut().enumerate() {
            if *number != 0 {
                *number = prims.len() as u32;
                prims.push(prim as u32);
            }
        }
        self.chunks
            .par_iter_mut()
            .flat_map(|c| &mut c.refs)
            .for_each(|r| *r = number[*r as usize]);
        prims
    }

    /// References in all cells.
    pub(crate) fn reference_count(&self) -> usize {
        self.chunks.iter().map(|c| c.refs.len()).sum()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        self.chunks
            .iter()
            .map(|c| (c.refs.capacity() + c.starts.capacity()) * 4)
            .sum()
    }
}

impl Chunk {
    fn sorted(pairs: &[(u32, u32)], cells: usize) -> Self {
        let mut starts = vec![0u32; cells + 1];
        for &(cell, _) in pairs {
            starts[cell as usize + 1] += 1;
        }
        for i in 0..cells {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut refs = vec![0; pairs.len()];
        for &(cell, prim) in pairs {
            let slot = &mut next[cell as usize];
            refs[*slot as usize] = prim;
            *slot += 1;
        }
        Self { starts, refs }
    }
}

/// Raster points and vertices below the guard are known to 1/512 of a unit or better; a cell's triangles are those
/// that come this close to it.
const SLACK: f32 = 1.0 / 64.0;

/// Inclusive cell rectangle of raster bounds; `None` if it holds nothing that matters.
#[inline]
fn cell_rect(grid: &CellGrid, min: [f32; 2], max: [f32; 2]) -> Option<[[u32; 2]; 2]> {
    let mut rect = [[0; 2]; 2];
    for axis in 0..2 {
        let limit = grid.size[axis];
        let (low, high) = (min[axis] - SLACK, max[axis] + SLACK);
        // Written so that NaN is refused.
        if !(low <= high && high >= 0.0 && low < limit) {
            return None;
        }
        let (mut low, mut high) = (low.max(0.0), high.min(limit));
        if grid.pixel_centres {
            // Half-integers within; conversions to integers cut off, and a function call each for `floor` and
            // `ceil` would be a third of the cost of binning.
            let last = (high + 0.5) as i32 - 1;
            let first = (low - 0.5) as i32;
            let first = first + i32::from((first as f32) < low - 0.5);
            if first > last {
                return None;
            }
            (low, high) = (first as f32, last as f32);
        }
        let last = grid.cells[axis] - 1;
        rect[0][axis] = ((low / grid.side) as u32).min(last);
        rect[1][axis] = ((high / grid.side) as u32).min(last);
    }
    Some(rect)
}

#[inline]
fn bin(
    view: &View,
    triangles: &Triangles,
    vertices: &[RasterVertex],
    grid: &CellGrid,
    binning: Binning,
    prim: u32,
    pairs: &mut Vec<(u32, u32)>,
) {
    let corners = triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
    if corners.iter().all(|v| v.nearness < 0.0) {
        return;
    }
    let ahead = corners.iter().all(|v| v.nearness >= 0.0);
    let mut precise = None;
    let rect = if ahead {
        let [a, b, c] = corners;
        let min = [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)];
        let max = [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)];
        cell_rect(grid, min, max)
    } else {
        precise = PreciseTriangle::new(view, triangles.corners(prim));
        let bounds = precise.as_ref().and_then(|p| p.bounds(view));
        bounds.and_then(|[min, max]| cell_rect(grid, min.map(|v| v as f32), max.map(|v| v as f32)))
    };
    let Some([[x0, y0], [x1, y1]]) = rect else { return };
    let columns = grid.cells[0];
    let large = x1 > x0 + 1 || y1 > y0 + 1;
    if !large || binning == Binning::Rectangle {
        for y in y0..=y1 {
            pairs.extend((x0..=x1).map(|x| (y * columns + x, prim)));
        }
        return;
    }
    let Some(precise) = precise.or_else(|| PreciseTriangle::new(view, triangles.corners(prim))) else {
        return;
    };
    let side = f64::from(grid.side);
    for y in y0..=y1 {
        let (top, slack) = (f64::from(y) * side, f64::from(SLACK));
        let Some([from, to]) = precise.row_span(top - slack, top + side + slack) else {
            continue;
        };
        let (from, to) = ((from - slack) / side, (to + slack) / side);
        let column = |x: f64| x.clamp(f64::from(x0), f64::from(x1)) as u32;
        if to >= f64::from(x0) && from <= f64::from(x1 + 1) {
            pairs.extend((column(from)..=column(to)).map(|x| (y * columns + x, prim)));
        }
    }
}
