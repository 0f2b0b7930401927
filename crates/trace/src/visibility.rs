//! What the eye sees, kept for a whole frame: the closest triangle of every pixel.
//!
//! HM08 §5.2 names two ways to serve many lights within little memory: grids on demand, or one light at a time over
//! stored eye hits. This is the second: only the triangle is stored, for the hit point follows from the view's
//! formula ([`crate::exact::attributes`]). Layout: tile by tile of the [`EyeGrid`], blocks of 4 x 4 pixels, 4 bytes a
//! pixel.

use rayon::prelude::*;

use crate::kernel::LANES;
use crate::kernel::tile::{BLOCK, NONE};
use crate::{EyeGrid, Receiver, Tile, TileHits, Triangles, View, ViewRay, exact};

/// The closest triangle of every pixel of a view.
#[derive(Clone, Debug)]
pub struct Visibility {
    view: View,
    tiles: Vec<VisibleTile>,
    exact_pixels: u64,
    seen: u64,
}

/// The pixels of one tile.
#[derive(Clone, Debug)]
pub(crate) struct VisibleTile {
    pub(crate) tile: Tile,
    /// Blocks in a row.
    pub(crate) stride: u32,
    /// Triangle of every pixel, block by block; [`NONE`] where there is none, and outside of the raster.
    pub(crate) prims: Vec<[u32; LANES]>,
}

impl Visibility {
    /// Traces all tiles of a grid, on all threads of the current rayon pool; `done` is told after each, from any
    /// thread.
    pub fn trace(grid: &EyeGrid, done: &(dyn Fn() + Sync)) -> Self {
        Self::trace_some(grid, &|_| true, &|_, _| done())
    }

    /// As [`Self::trace`], giving each tile and its hits to `use_it`, from any thread.
    pub fn trace_and(grid: &EyeGrid, use_it: &(dyn Fn(&Tile, &TileHits) + Sync)) -> Self {
        Self::trace_some(grid, &|_| true, use_it)
    }

    /// As [`Self::trace_and`] for the tiles that are wanted; the pixels of others see nothing.
    pub fn trace_some(
        grid: &EyeGrid,
        wanted: &(dyn Fn(&Tile) -> bool + Sync),
        use_it: &(dyn Fn(&Tile, &TileHits) + Sync),
    ) -> Self {
        let traced: Vec<(VisibleTile, u64, u64)> = (0..grid.tile_count())
            .into_par_iter()
            .map_init(TileHits::default, |hits, index| {
                let tile = grid.tile(index);
                if !wanted(&tile) {
                    return (VisibleTile::blind(tile), 0, 0);
                }
                grid.trace_tile(&tile, hits);
                use_it(&tile, hits);
                let tile = VisibleTile::of(tile, hits);
                let seen = tile.seen();
                (tile, hits.exact_pixels as u64, seen)
            })
            .collect();
        let exact_pixels = traced.iter().map(|t| t.1).sum();
        let seen = traced.iter().map(|t| t.2).sum();
        Self {
            seen,
            view: *grid.view(),
            tiles: traced.into_iter().map(|t| t.0).collect(),
            exact_pixels,
        }
    }

    /// As [`Self::trace_some`] by something that answers all pixels at once: `seen` is given those of all tiles that are
    /// wanted and tells the closest triangle of each. `None` if it does not answer.
    pub fn asked(
        grid: &EyeGrid,
        wanted: &dyn Fn(&Tile) -> bool,
        seen: impl FnOnce(&[[u32; 2]]) -> Option<Vec<Option<u32>>>,
    ) -> Option<Self> {
        let tiles = (0..grid.tile_count()).map(|index| grid.tile(index));
        let mut tiles: Vec<VisibleTile> = tiles.map(VisibleTile::blind).collect();
        let mut places = Vec::new();
        let mut pixels = Vec::new();
        for (index, tile) in tiles.iter().enumerate().filter(|(_, tile)| wanted(&tile.tile)) {
            let own = (0..tile.tile.height).flat_map(|y| (0..tile.tile.width).map(move |x| [x, y]));
            for [x, y] in own {
                places.push((index, place(tile.stride, x, y)));
                pixels.push([tile.tile.x + x, tile.tile.y + y]);
            }
        }
        let answers = seen(&pixels)?;
        let mut count = 0;
        for ((index, (block, lane)), prim) in places.into_iter().zip(answers) {
            count += u64::from(prim.is_some());
            tiles[index].prims[block][lane] = prim.unwrap_or(NONE);
        }
        Some(Self {
            view: *grid.view(),
            tiles,
            exact_pixels: 0,
            seen: count,
        })
    }

    /// The view it was seen in.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Triangle seen by pixel (x, y) of a tile of the grid, counted from the tile's corner.
    #[inline]
    pub fn prim(&self, tile: u32, x: u32, y: u32) -> Option<u32> {
        let tile = &self.tiles[tile as usize];
        let (block, lane) = place(tile.stride, x, y);
        let prim = tile.prims[block][lane];
        (prim != NONE).then_some(prim)
    }

    /// Pixels that see a triangle.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// Pairs of pixel and triangle that were settled by the exact decision.
    pub fn exact_pixels(&self) -> u64 {
        self.exact_pixels
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(|t| t.prims.capacity() * 4 * LANES).sum()
    }

    pub(crate) fn tiles(&self) -> &[VisibleTile] {
        &self.tiles
    }
}

/// Block and lane of a pixel of a tile.
#[inline]
pub(crate) fn place(stride: u32, x: u32, y: u32) -> (usize, usize) {
    let block = (y / BLOCK) * stride + x / BLOCK;
    let lane = (y % BLOCK) * BLOCK + x % BLOCK;
    (block as usize, lane as usize)
}

impl VisibleTile {
    /// A tile whose pixels see nothing.
    fn blind(tile: Tile) -> Self {
        let (stride, rows) = (tile.width.div_ceil(BLOCK), tile.height.div_ceil(BLOCK));
        Self {
            tile,
            stride,
            prims: vec![[NONE; LANES]; (stride * rows) as usize],
        }
    }

    pub(crate) fn of(tile: Tile, hits: &TileHits) -> Self {
        let (stride, rows) = (tile.width.div_ceil(BLOCK), tile.height.div_ceil(BLOCK));
        let mut prims = Vec::with_capacity((stride * rows) as usize);
        for row in 0..rows {
            for column in 0..stride {
                prims.push(hits.block(column, row).prim);
            }
        }
        // Blocks reach beyond the raster's edge.
        if !tile.width.is_multiple_of(BLOCK) || !tile.height.is_multiple_of(BLOCK) {
            for y in 0..rows * BLOCK {
                for x in 0..stride * BLOCK {
                    if x >= tile.width || y >= tile.height {
                        let (block, lane) = place(stride, x, y);
                        prims[block][lane] = NONE;
                    }
                }
            }
        }
        Self { tile, stride, prims }
    }

    /// Pixels that see a triangle.
    fn seen(&self) -> u64 {
        let mut seen = 0;
        for block in &self.prims {
            for &prim in block {
                seen += u32::from(prim != NONE);
            }
        }
        u64::from(seen)
    }

    /// The ray of a pixel, by block and lane.
    #[inline]
    pub(crate) fn ray(&self, view: &View, block: u32, lane: u32) -> ViewRay {
        let [x, y] = self.pixel(block, lane);
        view.pixel_ray(x, y)
    }

    /// A pixel of the raster, by block and lane.
    #[inline]
    pub(crate) fn pixel(&self, block: u32, lane: u32) -> [u32; 2] {
        [
            self.tile.x + block % self.stride * BLOCK + lane % BLOCK,
            self.tile.y + block / self.stride * BLOCK + lane / BLOCK,
        ]
    }

    /// The surface point a pixel sees, by block and lane; `None` if it sees nothing.
    pub(crate) fn receiver(
        &self,
        view: &View,
        triangles: &Triangles,
        block: u32,
        lane: u32,
    ) -> Option<Receiver> {
        let prim = self.prims[block as usize][lane as usize];
        if prim == NONE {
            return None;
        }
        let ray = self.ray(view, block, lane);
        let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim))?;
        Some(Receiver::along(&ray, hit.t, prim))
    }
}
