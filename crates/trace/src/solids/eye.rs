//! [`EyeSolids`]: the solids that each pixel of a view shows.
//!
//! Source: HM08 §3 (transformed bounding boxes) and §5.1: in the camera's perspective space a solid's box covers a
//! rectangle of pixels, and a tile takes its solids in order and tests the pixels of their rectangles. Layout: a list of
//! solids a tile. Cost: that of the pixels covered by boxes; others cost nothing.

use super::{Crossing, Solid, first};
use crate::{Tile, View};

/// The solids of each tile of a raster, with their pixels.
#[derive(Clone, Debug)]
pub struct EyeSolids<'a> {
    solids: &'a [Solid],
    view: View,
    side: u32,
    columns: u32,
    /// For each tile the solids, ascending, with first and last column and row of the raster.
    tiles: Vec<Vec<(u32, [[u32; 2]; 2])>>,
}

/// What the pixels of a tile see of solids. Working memory of one thread.
#[derive(Clone, Debug, Default)]
pub struct SolidHits {
    /// Row by row; empty if no box reaches the tile.
    hits: Vec<Option<(u32, Crossing)>>,
    width: u32,
}

impl SolidHits {
    /// The first crossing that the ray of pixel (x, y) of the tile meets, with its solid.
    #[inline]
    pub fn at(&self, x: u32, y: u32) -> Option<&(u32, Crossing)> {
        self.hits.get((y * self.width + x) as usize)?.as_ref()
    }
}

impl<'a> EyeSolids<'a> {
    /// Sorts the solids into square tiles of this side.
    pub fn build(view: View, solids: &'a [Solid], side: u32) -> Self {
        let side = side.max(1);
        let columns = view.width.div_ceil(side);
        let mut tiles = vec![Vec::new(); (columns * view.height.div_ceil(side)) as usize];
        for (id, solid) in (0..).zip(solids) {
            let Some([columns_of, rows_of]) = pixels(&view, solid) else {
                continue;
            };
            for y in rows_of[0] / side..=rows_of[1] / side {
                for x in columns_of[0] / side..=columns_of[1] / side {
                    tiles[(y * columns + x) as usize].push((id, [columns_of, rows_of]));
                }
            }
        }
        Self {
            solids,
            view,
            side,
            columns,
            tiles,
        }
    }

    /// Finds what each pixel of a tile sees.
    pub fn trace_tile(&self, tile: &Tile, out: &mut SolidHits) {
        out.hits.clear();
        out.width = tile.width;
        let here = (tile.y / self.side) * self.columns + tile.x / self.side;
        let solids = &self.tiles[here as usize];
        if solids.is_empty() {
            return;
        }
        out.hits.resize((tile.width * tile.height) as usize, None);
        for &(id, [columns, rows]) in solids {
            for y in rows[0].max(tile.y)..=rows[1].min(tile.y + tile.height - 1) {
                for x in columns[0].max(tile.x)..=columns[1].min(tile.x + tile.width - 1) {
                    let place = (y - tile.y) * tile.width + x - tile.x;
                    let best = &mut out.hits[place as usize];
                    let ray = self.view.pixel_ray(x, y);
                    let range = [0.0, f64::INFINITY];
                    if let Some(next) = first(&self.solids[id as usize], id, &ray, range, None)
                        && best.is_none_or(|(_, best)| next.t < best.t)
                    {
                        *best = Some((id, next));
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let lists = self.tiles.iter();
        let held = lists.map(|list| size_of_val(&**list) + size_of_val(list));
        held.sum()
    }

    /// Tiles.
    pub fn tile_count(&self) -> usize {
        self.tiles.len()
    }

    /// References in all tiles.
    pub fn reference_count(&self) -> usize {
        self.tiles.iter().map(Vec::len).sum()
    }
}

/// First and last column, and row, of the pixels that may show a solid.
fn pixels(view: &View, solid: &Solid) -> Option<[[u32; 2]; 2]> {
    let [low, high] = solid.bounds()?;
    let window = view.window_of_box(low, high)?;
    let span = |axis: usize, size: u32| {
        // Far more than rounding; conversions saturate.
        let (from, to) = (window.min[axis] - 1.0, window.max[axis] + 1.0);
        let last = size.checked_sub(1)?;
        (to >= 0.0 && from <= f64::from(size)).then(|| [(from as u32).min(last), (to as u32).min(last)])
    };
    Some([span(0, view.width)?, span(1, view.height)?])
}
