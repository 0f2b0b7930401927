//! Eye rays that tell of every pass: each time that a triangle is found to be closer than those before it (HM08 §5.1).
//!
//! Triangles are drawn one at a time, and the pixels of the rectangle of each are looked through. Cost: one set-up for each
//! instead of for sixteen, 5 ns a block of its rectangle, and what the caller does with a pass.

use crate::kernel::LANES;
use crate::kernel::batch::TilePlace;
use crate::kernel::project::RasterVertex;
use crate::kernel::tile::{BLOCK, BlockRect, NONE};
use crate::{EyeGrid, Tile, TileHits};

use super::Content;

impl EyeGrid<'_> {
    /// As [`Self::trace_tile`], telling `pass` of every pixel each time that a triangle is found there that is closer than
    /// those before: column and row in the tile, and triangle. The last told of is the one seen. A grid over clusters tells
    /// of that one only.
    pub fn trace_tile_passes(&self, tile: &Tile, hits: &mut TileHits, mut pass: impl FnMut(u32, u32, u32)) {
        let place = TilePlace {
            origin: [tile.x, tile.y],
            size: [tile.width, tile.height],
            rounding: self.rounding,
            hierarchy: self.hierarchy,
        };
        let mut told = std::mem::take(&mut hits.told);
        told.clear();
        match &self.content {
            Content::Clusters { .. } => self.trace_tile(tile, hits),
            Content::Triangles { vertices, bins } => {
                hits.buffer.clear(place.size);
                let corner = place.origin.map(|v| v as f32);
                for &prim in bins.cell(tile.index as usize).flatten() {
                    hits.counts.triangles += 1;
                    let corners = self.triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
                    hits.work.queue.push(prim, corners.map(RasterVertex::words));
                    self.draw_waiting(&place, (corner, true), hits);
                    changed(hits, tile, rect_of(&place, corners), &mut told, &mut pass);
                }
                self.settle(tile, hits);
            }
        }
        changed(hits, tile, place.blocks(), &mut told, &mut pass);
        hits.told = told;
    }
}

/// The blocks of a tile that a triangle may reach.
fn rect_of(place: &TilePlace, [a, b, c]: [&RasterVertex; 3]) -> BlockRect {
    if !(a.nearness >= 0.0 && b.nearness >= 0.0 && c.nearness >= 0.0) {
        return place.blocks();
    }
    // Below 0 becomes 0; a pixel more on either side.
    let first = |v: [f32; 3]| (v[0].min(v[1]).min(v[2]) - 1.0) as u32;
    let last = |v: [f32; 3]| (v[0].max(v[1]).max(v[2]) + 1.0) as u32;
    let (x, y) = ([a.x, b.x, c.x], [a.y, b.y, c.y]);
    place.blocks_of([first(x), first(y), last(x), last(y)])
}

/// Tells of the pixels in some blocks whose triangle is not the one told of last.
fn changed(
    hits: &TileHits,
    tile: &Tile,
    rect: BlockRect,
    told: &mut Vec<[u32; LANES]>,
    pass: &mut impl FnMut(u32, u32, u32),
) {
    let buffer = &hits.buffer;
    told.resize(buffer.blocks.len(), [NONE; LANES]);
    for (row, column) in (rect.y[0]..=rect.y[1]).flat_map(|y| (rect.x[0]..=rect.x[1]).map(move |x| (y, x))) {
        let block = buffer.block(column, row);
        let (now, told) = (&buffer.blocks[block].prim, &mut told[block]);
        if now == told {
            continue;
        }
        for lane in 0..LANES {
            let (x, y) = (
                column * BLOCK + lane as u32 % BLOCK,
                row * BLOCK + lane as u32 / BLOCK,
            );
            if now[lane] != told[lane] && x < tile.width && y < tile.height {
                pass(x, y, now[lane]);
            }
        }
        *told = *now;
    }
}
