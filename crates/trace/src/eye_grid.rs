//! The tiled perspective grid of a camera (HM08 §5.1).
//!
//! The raster of a [`View`] is cut into square tiles; the grid has no split along depth. A build projects the
//! vertices and sorts the triangles into tiles; tracing a tile takes its triangles in object order and
//! tests each against the rays of its rectangle, the rays coming from the raster's formula.
//!
//! Layout: 16 bytes a vertex, about 4 bytes a triangle and tile, 8 bytes a pixel while a tile is traced. Rebuilt
//! every frame. Answers: exactly those of testing every triangle with [`crate::exact`] for
//! [`View::pixel_ray`].

use glam::Vec3;
use rayon::prelude::*;

use crate::Triangles;
use crate::bins::{Binning, Bins, CellGrid};
use crate::clusters::Clusters;
use crate::exact;
use crate::facets::HitBlocks;
use crate::kernel::SimdLevel;
use crate::kernel::batch::{Left, TilePlace, draw_queue};
use crate::kernel::cluster::{Seen, TileWork, sift_cluster};
use crate::kernel::edges::EdgeRecord;
use crate::kernel::project::{RasterVertex, project};
use crate::kernel::tile::{BLOCK, BlockPixels, BlockRect, NONE, TileBuffer, draw_precise};
use crate::kernel::{LANES, NEARNESS_BAND};
use crate::precise::PreciseTriangle;
use crate::view::{View, ViewRay};
use lists::{Crossing, Item, Single, TileLists};

/// Parameters of an [`EyeGrid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EyeGridOptions {
    /// Side of a tile in pixels, from 4 to 256; rounded up to a multiple of 4.
    pub tile: u32,
    /// How triangles are put into tiles.
    pub binning: Binning,
    /// Whether what blocks of pixels have found hides what is behind them.
    pub hierarchy: bool,
}

impl Default for EyeGridOptions {
    fn default() -> Self {
        Self {
            tile: 64,
            binning: Binning::Overlap,
            hierarchy: true,
        }
    }
}

impl EyeGridOptions {
    /// The literal parameters of HM08: tiles of 100 x 100 pixels, filled by bounding rectangle, no hierarchy.
    pub fn paper() -> Self {
        Self {
            tile: 100,
            binning: Binning::Rectangle,
            hierarchy: false,
        }
    }
}

/// A camera's grid over one frame's triangles.
#[derive(Clone, Debug)]
pub struct EyeGrid<'a> {
    view: View,
    triangles: Triangles<'a>,
    level: SimdLevel,
    hierarchy: bool,
    rounding: f32,
    grid: CellGrid,
    content: Content<'a>,
}

/// What tiles are drawn from.
#[derive(Clone, Debug)]
enum Content<'a> {
    /// All triangles, projected and sorted.
    Triangles { vertices: Vec<RasterVertex>, bins: Bins },
    /// Clusters, whose triangles are projected when a tile asks.
    Clusters {
        clusters: &'a Clusters,
        lists: TileLists,
    },
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
    work: TileWork,
    singles: Singles,
    /// Triangles that were told of, see [`EyeGrid::trace_tile_passes`].
    told: Vec<[u32; LANES]>,
    /// Pairs of pixel and triangle settled by the exact decision in the last tile.
    pub exact_pixels: usize,
    /// Totals of all tiles traced with this memory.
    pub counts: EyeCounts,
}

/// What was done, and left out, in tracing tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EyeCounts {
    /// Clusters that a tile asked about.
    pub clusters: u64,
    /// Those that were hidden whole.
    pub clusters_hidden: u64,
    /// Triangles looked at, once a tile.
    pub triangles: u64,
    /// Those that were set up, as they hold a pixel centre and are not hidden.
    pub set_up: u64,
    /// Those of them that had to be set up in f64.
    pub precise: u64,
    /// Pairs of pixel and triangle settled by the exact decision.
    pub exact_pixels: u64,
}

impl TileHits {
    /// Side of a block of [`Self::block`] in pixels.
    pub const BLOCK: u32 = BLOCK;

    /// The pixels of the block in column x and row y, which exists for every pixel of the tile.
    #[inline]
    pub fn block(&self, x: u32, y: u32) -> &BlockPixels {
        &self.buffer.blocks[self.buffer.block(x, y)]
    }

    /// Triangle seen by pixel (x, y) of the tile, counted from the tile's corner.
    #[inline]
    pub fn prim(&self, x: u32, y: u32) -> Option<u32> {
        let (block, lane) = self.buffer.place(x, y);
        let prim = self.buffer.blocks[block].prim[lane];
        (prim != NONE).then_some(prim)
    }
}

impl HitBlocks for TileHits {
    const DEPTH: bool = false;

    #[inline]
    fn block(&self, column: u32, row: u32) -> (&[u32; LANES], &[f32; LANES]) {
        let block = TileHits::block(self, column, row);
        (&block.prim, &block.nearness)
    }
}

/// Vertices projected by one task.
const VERTEX_CHUNK: usize = 16 * 1024;

impl<'a> EyeGrid<'a> {
    /// Builds the grid, on all threads of the current rayon pool.
    pub fn build(view: View, triangles: Triangles<'a>, options: EyeGridOptions, level: SimdLevel) -> Self {
        Self::build_of(view, triangles, |_| true, options, level)
    }

    /// As [`EyeGrid::build`], of those triangles alone for which `keep` holds.
    pub fn build_of(
        view: View,
        triangles: Triangles<'a>,
        keep: impl Fn(u32) -> bool + Sync,
        options: EyeGridOptions,
        level: SimdLevel,
    ) -> Self {
        let grid = cells(&view, &options);
        let vertices = project_all(level, &view, &triangles);
        let bins = Bins::build(&view, &triangles, &vertices, &grid, options.binning, keep);
        let content = Content::Triangles { vertices, bins };
        Self::new(view, triangles, grid, content, options, level)
    }

    /// Builds the grid over clusters of the triangles: the same answers, in a time that follows what is visible. The
    /// clusters may have been made when the vertices lay elsewhere.
    ///
    /// # Panics
    /// If the clusters are of another number of triangles.
    pub fn build_clustered(
        view: View,
        triangles: Triangles<'a>,
        clusters: &'a Clusters,
        options: EyeGridOptions,
        level: SimdLevel,
    ) -> Self {
        assert_eq!(
            clusters.triangle_count(),
            triangles.len(),
            "clusters of other triangles"
        );
        let grid = cells(&view, &options);
        let lists = TileLists::build((&view, level), &triangles, clusters, &grid, options.binning);
        let content = Content::Clusters { clusters, lists };
        Self::new(view, triangles, grid, content, options, level)
    }

    fn new(
        view: View,
        triangles: Triangles<'a>,
        grid: CellGrid,
        content: Content<'a>,
        options: EyeGridOptions,
        level: SimdLevel,
    ) -> Self {
        Self {
            view,
            triangles,
            level,
            hierarchy: options.hierarchy,
            rounding: view.rounding() as f32,
            grid,
            content,
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

    /// References from tiles to triangles, or to clusters of them.
    pub fn reference_count(&self) -> usize {
        match &self.content {
            Content::Triangles { bins, .. } => bins.reference_count(),
            Content::Clusters { lists, .. } => lists.reference_count(),
        }
    }

    /// Bytes held by the grid; clusters are the caller's.
    pub fn bytes(&self) -> usize {
        match &self.content {
            Content::Triangles { vertices, bins } => {
                bins.bytes() + vertices.capacity() * size_of::<RasterVertex>()
            }
            Content::Clusters { lists, .. } => lists.bytes(),
        }
    }

    /// Finds the closest triangle of every pixel of a tile.
    pub fn trace_tile(&self, tile: &Tile, hits: &mut TileHits) {
        hits.buffer.clear([tile.width, tile.height]);
        let place = TilePlace {
            origin: [tile.x, tile.y],
            size: [tile.width, tile.height],
            rounding: self.rounding,
            hierarchy: self.hierarchy,
        };
        let corner = match &self.content {
            Content::Triangles { vertices, bins } => {
                let origin = place.origin.map(|v| v as f32);
                for &prim in bins.cell(tile.index as usize).flatten() {
                    hits.counts.triangles += 1;
                    let corners = self.triangles.indices[prim as usize].map(|i| vertices[i as usize].words());
                    hits.work.queue.push(prim, corners);
                    if hits.work.queue.count == LANES {
                        self.draw_waiting(&place, (origin, false), hits);
                    }
                }
                origin
            }
            Content::Clusters { clusters, lists } => {
                self.draw_clusters(&place, clusters, lists.tile(tile.index as usize), lists, hits);
                [0.0; 2]
            }
        };
        self.draw_waiting(&place, (corner, true), hits);
        self.settle(tile, hits);
    }

    fn draw_clusters(
        &self,
        place: &TilePlace,
        clusters: &Clusters,
        items: impl Iterator<Item = Item>,
        lists: &TileLists,
        hits: &mut TileHits,
    ) {
        hits.singles.prims.clear();
        for item in items {
            match item {
                Item::Single(index) => {
                    hits.singles.push(lists.single(index));
                    if hits.singles.prims.len() == LANES {
                        self.draw_singles(place, hits);
                    }
                }
                Item::Crossing(index) => self.draw_crossing(place, lists.crossing(index), hits),
                Item::Cluster(index) => {
                    let screen = lists.screen(index);
                    let cluster = clusters.cluster(index as usize);
                    let seen = Seen {
                        prims: cluster.prims,
                        corners: cluster.corners,
                        points: lists.points(index),
                        rect: place.blocks_of(screen.pixels),
                        nearest: screen.nearest,
                    };
                    let (buffer, work) = (&mut hits.buffer, &mut hits.work);
                    let hidden = sift_cluster(self.level, buffer, work, &seen, place, &self.view);
                    hits.counts.clusters += 1;
                    if hidden {
                        hits.counts.clusters_hidden += 1;
                    } else {
                        hits.counts.triangles += seen.prims.len() as u64;
                        self.draw_waiting(place, ([0.0; 2], false), hits);
                    }
                }
            }
        }
        self.draw_singles(place, hits);
    }

    /// Draws the triangles that came one by one, as a cluster of their own.
    fn draw_singles(&self, place: &TilePlace, hits: &mut TileHits) {
        let singles = &hits.singles;
        let seen = Seen {
            prims: &singles.prims,
            corners: &Singles::CORNERS[..singles.prims.len()],
            points: &singles.points,
            rect: place.blocks(),
            nearest: f32::INFINITY,
        };
        let (buffer, work) = (&mut hits.buffer, &mut hits.work);
        sift_cluster(self.level, buffer, work, &seen, place, &self.view);
        hits.counts.triangles += hits.singles.prims.len() as u64;
        hits.singles.prims.clear();
        self.draw_waiting(place, ([0.0; 2], false), hits);
    }

    /// Draws a triangle that reaches behind the start of the view.
    fn draw_crossing(&self, place: &TilePlace, crossing: &Crossing, hits: &mut TileHits) {
        hits.counts.triangles += 1;
        hits.counts.set_up += 1;
        hits.counts.precise += 1;
        let rect = place.blocks_of(crossing.pixels);
        let nearest = if self.hierarchy {
            crossing.nearest
        } else {
            f32::INFINITY
        };
        draw_precise(self.level, &mut hits.buffer, rect, nearest, || {
            Some(place.record(&crossing.precise, crossing.prim, rect))
        });
    }

    /// Draws the triangles that wait, counted from `origin`: full batches, or `all`.
    fn draw_waiting(&self, place: &TilePlace, (origin, all): ([f32; 2], bool), hits: &mut TileHits) {
        let (queue, lanes) = (&mut hits.work.queue, &mut hits.work.lanes);
        draw_queue(self.level, &mut hits.buffer, queue, lanes, place, (origin, all));
        self.draw_left(place, hits);
    }

    /// Draws the triangles that the lanes could not set up.
    fn draw_left(&self, place: &TilePlace, hits: &mut TileHits) {
        hits.counts.set_up += std::mem::take(&mut hits.work.queue.set_up);
        hits.counts.precise += hits.work.queue.left.len() as u64;
        for Left { prim, rect } in hits.work.queue.left.drain(..) {
            let rect = rect.unwrap_or(place.blocks());
            let corners = self.triangles.corners(prim);
            // Not bounded by its vertices: where t is hardly known, all that is known is that it lies in the box.
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let nearest = if self.hierarchy {
                self.view.nearest_in_box(a.min(b).min(c), a.max(b).max(c)) * f64::from(1.0 + NEARNESS_BAND)
            } else {
                f64::INFINITY
            };
            draw_precise(self.level, &mut hits.buffer, rect, nearest as f32, || {
                let precise = PreciseTriangle::new(&self.view, corners)?;
                Some(place.record(&precise, prim, rect))
            });
        }
    }

    /// Decides the unsure pixels exactly.
    fn settle(&self, tile: &Tile, hits: &mut TileHits) {
        let buffer = &mut hits.buffer;
        hits.exact_pixels = 0;
        let unsure_pixels = std::mem::take(&mut buffer.unsure);
        for unsure in &unsure_pixels {
            let (block, lane) = (unsure.block as usize, unsure.lane as usize);
            let pixels = &mut buffer.blocks[block];
            let (stored, at) = (pixels.prim[lane], pixels.nearness[lane]);
            // A closer triangle may have come after this one.
            if unsure.nearness * (1.0 + NEARNESS_BAND) < at {
                continue;
            }
            hits.exact_pixels += 1;
            let [x, y] = buffer.pixel(unsure.block, unsure.lane);
            let ray = self.view.pixel_ray(tile.x + x, tile.y + y);
            let corners = self.triangles.corners(unsure.prim);
            if !unsure.covers && !exact::meets(ray.origin, ray.dir, corners) {
                continue;
            }
            let known = unsure.nearness < f32::INFINITY;
            let mut nearness = unsure.nearness;
            if !known || (stored != NONE && nearness * (1.0 - NEARNESS_BAND) <= at) {
                let Some(t) = self.exact_t(&ray, unsure.prim) else {
                    continue;
                };
                let behind = |&s: &f64| (s, stored) < (t, unsure.prim);
                if stored != NONE && self.exact_t(&ray, stored).as_ref().is_some_and(behind) {
                    continue;
                }
                nearness = self.view.nearness(t) as f32;
            }
            let pixels = &mut buffer.blocks[block];
            pixels.prim[lane] = unsure.prim;
            pixels.nearness[lane] = nearness;
        }
        buffer.unsure = unsure_pixels;
        hits.counts.exact_pixels += hits.exact_pixels as u64;
    }

    /// Where a ray meets a triangle that it is known to meet, if that lies in front.
    fn exact_t(&self, ray: &ViewRay, prim: u32) -> Option<f64> {
        let hit = exact::attributes(ray.origin, ray.dir, self.triangles.corners(prim))?;
        (hit.t > 0.0).then_some(hit.t)
    }
}

impl TilePlace {
    /// A triangle as it is drawn into these blocks.
    fn record(&self, precise: &PreciseTriangle, prim: u32, rect: BlockRect) -> EdgeRecord {
        let start = |axis: usize, block: u32| f64::from(self.origin[axis] + block * BLOCK);
        let blocks = (rect.x[1] - rect.x[0]).max(rect.y[1] - rect.y[0]) + 1;
        precise.record(
            prim,
            [start(0, rect.x[0]), start(1, rect.y[0])],
            f64::from(blocks * BLOCK),
        )
    }
}

/// Single triangles that wait to be drawn, as a cluster.
#[derive(Clone, Debug, Default)]
struct Singles {
    prims: Vec<u32>,
    points: [[f32; LANES]; 9],
}

impl Singles {
    const CORNERS: [[u8; 3]; LANES] = {
        let mut corners = [[0; 3]; LANES];
        let mut i = 0;
        while i < LANES {
            let first = 3 * i as u8;
            corners[i] = [first, first + 1, first + 2];
            i += 1;
        }
        corners
    };

    fn push(&mut self, single: &Single) {
        let first = 3 * self.prims.len();
        for (i, corner) in single.corners.into_iter().enumerate() {
            let (batch, lane) = ((first + i) / LANES, (first + i) % LANES);
            self.points[3 * batch][lane] = corner.x;
            self.points[3 * batch + 1][lane] = corner.y;
            self.points[3 * batch + 2][lane] = corner.z;
        }
        self.prims.push(single.prim);
    }
}

/// The tiles of a view.
fn cells(view: &View, options: &EyeGridOptions) -> CellGrid {
    let side = options.tile.clamp(BLOCK, 256).next_multiple_of(BLOCK);
    CellGrid {
        cells: [view.width.div_ceil(side), view.height.div_ceil(side)],
        side: side as f32,
        size: [view.width as f32, view.height as f32],
        pixel_centres: true,
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

mod lists;
mod passes;
#[cfg(test)]
mod tests;
