//! Triangles against the rays of one tile, in object order (HM08 §5.1), sixteen rays at a time.
//!
//! A tile is kept in blocks of 4 x 4 pixels: block (bx, by) holds lanes `(by * stride + bx) * 16 ..`, pixel
//! (x, y) of the block in lane `y * 4 + x`. Each pixel has the nearness of its closest triangle so far and that
//! triangle's id: a visibility buffer, 8 bytes a pixel. Rays are never stored; they follow from the raster.
//!
//! Cost: per triangle and block about 20 vector instructions.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*, u32x16};

use super::edges::{EdgeLanes, EdgeRecord, Origin, VertexLanes, set_up};
use super::{LANES, NEARNESS_BAND, SimdLevel};

/// Side of a block in pixels.
pub(crate) const BLOCK: u32 = 4;

/// Id of "no triangle".
pub(crate) const NONE: u32 = u32::MAX;

/// Nearness and triangle of every pixel of a tile, block by block.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileBuffer {
    pub(crate) nearness: Vec<[f32; LANES]>,
    pub(crate) prim: Vec<[u32; LANES]>,
    /// Blocks in a row.
    pub(crate) stride: u32,
    /// Pixels whose answer f32 could not tell, to be settled exactly.
    pub(crate) unsure: Vec<Unsure>,
}

/// A pixel, the triangle that may be its closest, and an upper bound of that triangle's nearness there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsure {
    pub(crate) block: u32,
    pub(crate) lane: u32,
    pub(crate) prim: u32,
    pub(crate) at_most: f32,
}

/// Inclusive range of blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BlockRect {
    pub(crate) x: [u32; 2],
    pub(crate) y: [u32; 2],
}

impl TileBuffer {
    /// Empties the tile and gives it `blocks` columns and rows of blocks.
    pub(crate) fn clear(&mut self, blocks: [u32; 2]) {
        let count = (blocks[0] * blocks[1]) as usize;
        self.stride = blocks[0];
        self.nearness.clear();
        self.nearness.resize(count, [0.0; LANES]);
        self.prim.clear();
        self.prim.resize(count, [NONE; LANES]);
        self.unsure.clear();
    }
}

/// Where a tile lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TilePlace {
    /// Raster point of its corner.
    pub(crate) origin: [u32; 2],
    /// Columns and rows of blocks.
    pub(crate) blocks: [u32; 2],
    /// See [`crate::view::View::rounding`].
    pub(crate) rounding: f32,
}

/// Draws up to sixteen projected triangles; returns a bit for every lane that could not be set up.
pub(crate) fn draw_batch(
    level: SimdLevel,
    tile: &mut TileBuffer,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    place: &TilePlace,
) -> u32 {
    dispatch!(level.0, simd => draw_batch_impl(simd, tile, vertices, edges, place))
}

#[inline(always)]
fn draw_batch_impl<S: Simd>(
    simd: S,
    tile: &mut TileBuffer,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    place: &TilePlace,
) -> u32 {
    let TilePlace {
        origin,
        blocks,
        rounding,
    } = *place;
    let [ox, oy] = origin.map(|v| v as f32);
    let reach = (blocks[0].max(blocks[1]) * BLOCK) as f32;
    set_up(
        simd,
        vertices,
        Origin::Point { x: ox, y: oy, reach },
        rounding,
        edges,
    );
    let lanes = u32::MAX >> (32 - vertices.count as u32);
    let mut good = edges.good & lanes;
    let bad = lanes & !good;
    while good != 0 {
        let lane = good.trailing_zeros() as usize;
        good &= good - 1;
        let rect = vertices.rect_of_lane(lane, [ox, oy], blocks);
        let record = edges.record(lane, vertices.prim[lane]);
        draw_impl(simd, tile, &record, rect);
    }
    bad
}

impl VertexLanes {
    /// Blocks of a tile that a triangle's rectangle touches; `None` if a vertex does not lie in front.
    pub(crate) fn block_rect(&self, lane: usize, origin: [u32; 2], blocks: [u32; 2]) -> Option<BlockRect> {
        let ahead = self.nearness.iter().all(|n| n[lane] >= 0.0);
        ahead.then(|| self.rect_of_lane(lane, origin.map(|v| v as f32), blocks))
    }

    #[inline(always)]
    fn rect_of_lane(&self, lane: usize, origin: [f32; 2], blocks: [u32; 2]) -> BlockRect {
        let pick = |v: &[[f32; LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        BlockRect {
            x: block_range(pick(&self.x), origin[0], blocks[0]),
            y: block_range(pick(&self.y), origin[1], blocks[1]),
        }
    }
}

/// Blocks whose pixel centres lie between the smallest and the largest of `v`, a little widened.
#[inline(always)]
fn block_range(v: [f32; 3], origin: f32, blocks: u32) -> [u32; 2] {
    // Pixel centres lie at half units; 1/64 is far above the rounding of a coordinate below the guard.
    let low = v[0].min(v[1]).min(v[2]) - origin - 0.5 - 1.0 / 64.0;
    let high = v[0].max(v[1]).max(v[2]) - origin - 0.5 + 1.0 / 64.0;
    let last = (blocks * BLOCK - 1) as f32;
    let first = low.max(0.0).ceil().min(last) as u32;
    let end = high.clamp(0.0, last) as u32;
    [first / BLOCK, end / BLOCK]
}

/// Draws one triangle that was set up elsewhere.
pub(crate) fn draw(level: SimdLevel, tile: &mut TileBuffer, record: &EdgeRecord, rect: BlockRect) {
    dispatch!(level.0, simd => draw_impl(simd, tile, record, rect));
}

#[inline(always)]
fn draw_impl<S: Simd>(simd: S, tile: &mut TileBuffer, record: &EdgeRecord, rect: BlockRect) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let lane_x = f32x16::from_fn(simd, |i| (i % BLOCK as usize) as f32 + 0.5);
    let lane_y = f32x16::from_fn(simd, |i| (i / BLOCK as usize) as f32 + 0.5);
    let base = |a: f32, b: f32, c: f32| splat(a).mul_add(lane_x, splat(b).mul_add(lane_y, splat(c)));
    let EdgeRecord { a, b, c, .. } = *record;
    let base_edges = [
        base(a[0], b[0], c[0]),
        base(a[1], b[1], c[1]),
        base(a[2], b[2], c[2]),
    ];
    let base_nearness = base(record.nearness_x, record.nearness_y, record.nearness);
    let (nearer, farther) = (splat(1.0 - NEARNESS_BAND), splat(1.0 + NEARNESS_BAND));

    for by in rect.y[0]..=rect.y[1] {
        let y = (by * BLOCK) as f32;
        let row = (by * tile.stride) as usize;
        for bx in rect.x[0]..=rect.x[1] {
            let x = (bx * BLOCK) as f32;
            let g = |i: usize| base_edges[i] + splat(a[i] * x + b[i] * y);
            let inside = g(0).min(g(1)).min(g(2));
            let covered = inside.simd_ge(splat(-1.0));
            if covered.all_false() {
                continue;
            }
            let block = row + bx as usize;
            let nearness = base_nearness + splat(record.nearness_x * x + record.nearness_y * y);
            let stored = f32x16::from_slice(simd, &tile.nearness[block]);
            // A plane outside of its range, or of unknown range, is not known well enough to be called hidden.
            let vague = !(nearness.simd_ge(splat(record.floor)) & nearness.simd_le(splat(record.ceiling)));
            let possible = covered & ((nearness * farther).simd_ge(stored) | vague);
            if possible.all_false() {
                continue;
            }
            let sure = inside.simd_gt(splat(1.0)) & (nearness * nearer).simd_gt(stored) & !vague & possible;
            let unsure = (possible & !sure).to_bitmask() as u32;
            sure.select(nearness, stored)
                .store_slice(&mut tile.nearness[block]);
            let prim = u32x16::from_slice(simd, &tile.prim[block]);
            sure.select(u32x16::splat(simd, record.prim), prim)
                .store_slice(&mut tile.prim[block]);
            if unsure != 0 {
                let at_most = vague.select(splat(f32::INFINITY), nearness * farther);
                note_unsure(
                    &mut tile.unsure,
                    block as u32,
                    unsure,
                    record.prim,
                    at_most.into(),
                );
            }
        }
    }
}

#[cold]
fn note_unsure(list: &mut Vec<Unsure>, block: u32, mut lanes: u32, prim: u32, at_most: [f32; LANES]) {
    while lanes != 0 {
        let lane = lanes.trailing_zeros();
        lanes &= lanes - 1;
        list.push(Unsure {
            block,
            lane,
            prim,
            at_most: at_most[lane as usize],
        });
    }
}
