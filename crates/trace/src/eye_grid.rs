//! The tiled perspective grid of a camera (HM08 §5.1).
//!
//! The raster of a [`View`] is cut into square tiles; the grid has no split along depth. A build projects the
//! vertices and sorts the triangles into tiles; tracing a tile takes its triangles in object order and
//! tests each against the rays of its rectangle, the rays coming from the raster's formula.
//!
//! Layout: 16 bytes a vertex, about 4 bytes a triangle and tile, 8 bytes a pixel while a tile is traced. Rebuilt
//! every frame. Answers: exactly those of testing every triangle with [`crate::exact`] for
//! [`View::pixel_ray`].

use rayon::prelude::*;

use crate::Triangles;
use crate::bins::{Binning, Bins, CellGrid};
use crate::exact::{self, ExactHit};
use crate::kernel::SimdLevel;
use crate::kernel::edges::{EdgeLanes, VertexLanes};
use crate::kernel::project::{RasterVertex, project};
use crate::kernel::tile::{BLOCK, BlockRect, NONE, TileBuffer, TilePlace, draw, draw_batch};
use crate::kernel::{LANES, NEARNESS_BAND};
use crate::precise::PreciseTriangle;
use crate::view::{View, ViewRay};

/// Parameters of an [`EyeGrid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeGridOptions {
    /// Side of a tile in pixels, from 4 to 256; rounded up to a multiple of 4.
    pub tile: u32,
    /// How triangles are put into tiles.
    pub binning: Binning,
}

impl Default for EyeGridOptions {
    fn default() -> Self {
        Self {
            tile: 64,
            binning: Binning::Overlap,
        }
    }
}

impl EyeGridOptions {
    /// The literal parameters of HM08: tiles of 100 x 100 pixels, filled by bounding rectangle.
    pub fn paper() -> Self {
        Self {
            tile: 100,
            binning: Binning::Rectangle,
        }
    }
}

/// A camera's grid over one frame's triangles.
#[derive(Clone, Debug)]
pub struct EyeGrid<'a> {
    view: View,
    triangles: Triangles<'a>,
    level: SimdLevel,
    rounding: f32,
    vertices: Vec<RasterVertex>,
    grid: CellGrid,
    bins: Bins,
}

/// A tile: its index, and its rectangle of pixels in the raster.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Index, counted in rows.
    pub index: u32,
    /// First pixel column.
    pub x: u32,
    /// First pixel row.
    pub y: u32,
    /// Columns within the raster.
    pub width: u32,
    /// Rows within the raster.
    pub height: u32,
}

/// Working memory of one thread for tracing tiles, and the hits of the last one.
#[derive(Clone, Debug, Default)]
pub struct TileHits {
    buffer: TileBuffer,
    vertices: VertexLanes,
    edges: EdgeLanes,
    /// Pairs of pixel and triangle settled by the exact decision in the last tile.
    pub exact_pixels: usize,
}

impl TileHits {
    /// Triangle seen by pixel (x, y) of the tile, counted from the tile's corner.
    #[inline]
    pub fn prim(&self, x: u32, y: u32) -> Option<u32> {
        let block = (y / BLOCK) * self.buffer.stride + x / BLOCK;
        let lane = (y % BLOCK) * BLOCK + x % BLOCK;
        let prim = self.buffer.prim[block as usize][lane as usize];
        (prim != NONE).then_some(prim)
    }
}

/// Vertices projected by one task.
const VERTEX_CHUNK: usize = 16 * 1024;

impl<'a> EyeGrid<'a> {
    /// Builds the grid, on all threads of the current rayon pool.
    pub fn build(view: View, triangles: Triangles<'a>, options: EyeGridOptions, level: SimdLevel) -> Self {
        let side = options.tile.clamp(BLOCK, 256).next_multiple_of(BLOCK);
        let cells = [view.width.div_ceil(side), view.height.div_ceil(side)];
        let grid = CellGrid {
            cells,
            side: side as f32,
            size: [view.width as f32, view.height as f32],
            pixel_centres: true,
        };
        let vertices = project_all(level, &view, &triangles);
        let bins = Bins::build(&view, &triangles, &vertices, &grid, options.binning, |_| true);
        Self {
            view,
            triangles,
            level,
            rounding: view.rounding() as f32,
            vertices,
            grid,
            bins,
        }
    }

    /// The view it was built for.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Side of a tile in pixels; tiles at the right and bottom edge may be smaller.
    pub fn tile_side(&self) -> u32 {
        self.grid.side as u32
    }

    /// Number of tiles.
    pub fn tile_count(&self) -> u32 {
        self.grid.cells[0] * self.grid.cells[1]
    }

    /// The tile of that index.
    pub fn tile(&self, index: u32) -> Tile {
        let side = self.grid.side as u32;
        let (x, y) = (
            index % self.grid.cells[0] * side,
            index / self.grid.cells[0] * side,
        );
        let (width, height) = (side.min(self.view.width - x), side.min(self.view.height - y));
        Tile {
            index,
            x,
            y,
            width,
            height,
        }
    }

    /// References from tiles to triangles.
    pub fn reference_count(&self) -> usize {
        self.bins.reference_count()
    }

    /// Bytes held by the grid.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.vertices.capacity() * size_of::<RasterVertex>()
    }

    /// Finds the closest triangle of every pixel of a tile.
    pub fn trace_tile(&self, tile: &Tile, hits: &mut TileHits) {
        let blocks = [tile.width.div_ceil(BLOCK), tile.height.div_ceil(BLOCK)];
        hits.buffer.clear(blocks);
        for prims in self.bins.cell(tile.index as usize) {
            for batch in prims.chunks(LANES) {
                self.draw_batch(tile, blocks, batch, hits);
            }
        }
        self.settle(tile, hits);
    }

    fn draw_batch(&self, tile: &Tile, blocks: [u32; 2], prims: &[u32], hits: &mut TileHits) {
        let TileHits {
            buffer,
            vertices,
            edges,
            ..
        } = hits;
        vertices.count = 0;
        for &prim in prims {
            let corners = self.triangles.indices[prim as usize].map(|i| &self.vertices[i as usize]);
            vertices.push(prim, corners);
        }
        let place = TilePlace {
            origin: [tile.x, tile.y],
            blocks,
            rounding: self.rounding,
        };
        let mut bad = draw_batch(self.level, buffer, vertices, edges, &place);
        while bad != 0 {
            let lane = bad.trailing_zeros() as usize;
            bad &= bad - 1;
            let rect = vertices.block_rect(lane, [tile.x, tile.y], blocks);
            self.draw_precise(tile, blocks, prims[lane], rect, buffer);
        }
    }

    /// Draws a triangle that the lanes could not set up; `rect` is `None` where it may cover the whole tile.
    fn draw_precise(
        &self,
        tile: &Tile,
        blocks: [u32; 2],
        prim: u32,
        rect: Option<BlockRect>,
        buffer: &mut TileBuffer,
    ) {
        let Some(precise) = PreciseTriangle::new(&self.view, self.triangles.corners(prim)) else {
            return;
        };
        let whole = BlockRect {
            x: [0, blocks[0] - 1],
            y: [0, blocks[1] - 1],
        };
        let reach = f64::from(blocks[0].max(blocks[1]) * BLOCK);
        let record = precise.record(prim, [f64::from(tile.x), f64::from(tile.y)], reach);
        draw(self.level, buffer, &record, rect.unwrap_or(whole));
    }

    /// Decides the unsure pixels exactly.
    fn settle(&self, tile: &Tile, hits: &mut TileHits) {
        let buffer = &mut hits.buffer;
        hits.exact_pixels = 0;
        let unsure_pixels = std::mem::take(&mut buffer.unsure);
        for unsure in &unsure_pixels {
            let (block, lane) = (unsure.block as usize, unsure.lane as usize);
            let x = (unsure.block % buffer.stride) * BLOCK + unsure.lane % BLOCK;
            let y = (unsure.block / buffer.stride) * BLOCK + unsure.lane / BLOCK;
            let outside = x >= tile.width || y >= tile.height;
            // A closer triangle may have come after this one.
            if outside || unsure.at_most < buffer.nearness[block][lane] * (1.0 - NEARNESS_BAND) {
                continue;
            }
            hits.exact_pixels += 1;
            let ray = self.view.pixel_ray(tile.x + x, tile.y + y);
            let Some(hit) = self.exact_hit(&ray, unsure.prim) else {
                continue;
            };
            let stored = buffer.prim[block][lane];
            let closer = stored == NONE
                || self
                    .exact_hit(&ray, stored)
                    .is_none_or(|s| (hit.t, unsure.prim) < (s.t, stored));
            if closer {
                buffer.prim[block][lane] = unsure.prim;
                buffer.nearness[block][lane] = self.view.nearness(hit.t) as f32;
            }
        }
        buffer.unsure = unsure_pixels;
    }

    fn exact_hit(&self, ray: &ViewRay, prim: u32) -> Option<ExactHit> {
        exact::hit(ray.origin, ray.dir, self.triangles.corners(prim)).filter(|h| h.t > 0.0)
    }
}

/// Projects all vertices of the triangles.
pub(crate) fn project_all(level: SimdLevel, view: &View, triangles: &Triangles) -> Vec<RasterVertex> {
    let mut vertices = vec![RasterVertex::default(); triangles.x.len()];
    vertices
        .par_chunks_mut(VERTEX_CHUNK)
        .enumerate()
        .for_each(|(i, out)| project(level, view, triangles, i * VERTEX_CHUNK, out));
    vertices
}

#[cfg(test)]
mod tests;
