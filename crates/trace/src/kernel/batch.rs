//! Sixteen triangles of a tile at once: rectangles, edge functions and which blocks they may reach, in lanes; then
//! drawn one by one (HM08 §5.1).
//!
//! Four sizes of triangle. One that holds no pixel centre ends in the lanes. A tiny one, of up to 4 x 4 pixels, knows
//! from the lanes which of them it covers. A small one, of up to 4 x 4 blocks, knows which of them it may reach, and
//! is drawn into those that do not hide it. Larger ones go patch by patch, see [`super::tile`].
//!
//! Cost: about 25 vector instructions a triangle to set up, 12 for reach or coverage, and what drawing it costs: 20
//! scalar instructions a pixel of a tiny triangle, 20 vector instructions a block of a larger one.

use std::ops::Range;

use fearless_simd::{Simd, dispatch, f32x16, i32x16, mask32x16, prelude::*};

use super::edges::{EdgeLanes, LaneOrigin, largest, set_up_lanes};
use super::project::{REST_ERROR, unpack_rests};
use super::tile::{
    BLOCK, BlockRect, TileBuffer, draw, draw_flat, evaluate, merge, pixel_lanes, range_in_block, square,
};
use super::{LANES, NEARNESS_BAND, ROUNDOFF, SimdLevel, bits_of, linear, linear3, load3, max3, min3};
use crate::clusters::CLUSTER;

/// Projected triangles that wait until a batch is full, corners as they lie in memory.
#[derive(Clone, Debug)]
pub(crate) struct TriangleQueue {
    corners: [[[f32; 4]; ROOM]; 3],
    prim: [u32; ROOM],
    pub(crate) count: usize,
    /// Triangles that the lanes could not set up.
    pub(crate) left: Vec<Left>,
    /// How many have been set up.
    pub(crate) set_up: u64,
}

/// What fits into a queue: a whole cluster may come to a batch that is nearly full.
const ROOM: usize = CLUSTER + LANES;

/// A triangle to be set up in f64; the blocks of its rectangle, if all of its vertices lie in front.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Left {
    pub(crate) prim: u32,
    pub(crate) rect: Option<BlockRect>,
}

impl Default for TriangleQueue {
    fn default() -> Self {
        Self {
            corners: [[[0.0; 4]; ROOM]; 3],
            prim: [0; ROOM],
            count: 0,
            left: Vec::new(),
            set_up: 0,
        }
    }
}

impl TriangleQueue {
    /// Adds a triangle; there must be room.
    #[inline(always)]
    pub(crate) fn push(&mut self, prim: u32, corners: [[f32; 4]; 3]) {
        let lane = self.count;
        self.corners[0][lane] = corners[0];
        self.corners[1][lane] = corners[1];
        self.corners[2][lane] = corners[2];
        self.prim[lane] = prim;
        self.count += 1;
    }

    /// Takes the first triangles out.
    #[inline(always)]
    fn take(&mut self, taken: usize) {
        for corners in &mut self.corners {
            corners.copy_within(taken..self.count, 0);
        }
        self.prim.copy_within(taken..self.count, 0);
        self.count -= taken;
        self.set_up += taken as u64;
    }
}

/// x and y from `origin`, and nearness, of the three corners of sixteen triangles from the `first`.
#[inline(always)]
pub(super) fn corner_lanes<S: Simd, const N: usize>(
    simd: S,
    corners: &[[[f32; 4]; N]; 3],
    first: usize,
    origin: [f32; 2],
) -> [[f32x16<S>; 3]; 3] {
    let [ax, ay, an] = vertex_lanes(simd, &corners[0][first..first + LANES], origin);
    let [bx, by, bn] = vertex_lanes(simd, &corners[1][first..first + LANES], origin);
    let [cx, cy, cn] = vertex_lanes(simd, &corners[2][first..first + LANES], origin);
    [[ax, bx, cx], [ay, by, cy], [an, bn, cn]]
}

/// The four words each of sixteen vertices, as lanes.
#[inline(always)]
pub(super) fn four_lanes<S: Simd>(simd: S, words: &[[f32; 4]]) -> [f32x16<S>; 4] {
    let words = words.as_flattened();
    let first = f32x16::from_slice(simd, &words[..LANES]);
    let second = f32x16::from_slice(simd, &words[LANES..2 * LANES]);
    let third = f32x16::from_slice(simd, &words[2 * LANES..3 * LANES]);
    let fourth = f32x16::from_slice(simd, &words[3 * LANES..]);
    let (even, odd) = first.deinterleave(second);
    let (even_high, odd_high) = third.deinterleave(fourth);
    let (first, third) = even.deinterleave(even_high);
    let (second, fourth) = odd.deinterleave(odd_high);
    [first, second, third, fourth]
}

/// x and y from `origin`, and nearness, of sixteen vertices' words.
#[inline(always)]
fn vertex_lanes<S: Simd>(simd: S, words: &[[f32; 4]], origin: [f32; 2]) -> [f32x16<S>; 3] {
    let [x, y, nearness, rests] = four_lanes(simd, words);
    let [x_rest, y_rest] = unpack_rests(simd, rests);
    // The first difference is exact for vertices in or next to the tile.
    let x = (x - f32x16::splat(simd, origin[0])) + x_rest;
    let y = (y - f32x16::splat(simd, origin[1])) + y_rest;
    [x, y, nearness]
}

/// Where a tile lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TilePlace {
    /// Raster point of its corner.
    pub(crate) origin: [u32; 2],
    /// Columns and rows of pixels.
    pub(crate) size: [u32; 2],
    /// See [`crate::view::View::rounding`].
    pub(crate) rounding: f32,
    /// Whether blocks and patches hide what is behind them.
    pub(crate) hierarchy: bool,
}

impl TilePlace {
    /// All blocks of the tile.
    pub(crate) fn blocks(&self) -> BlockRect {
        BlockRect {
            x: [0, (self.size[0] - 1) / BLOCK],
            y: [0, (self.size[1] - 1) / BLOCK],
        }
    }

    /// The blocks of the tile that touch a rectangle of the raster's pixels (first column and row, last column and
    /// row), which touches the tile.
    pub(crate) fn blocks_of(&self, pixels: [u32; 4]) -> BlockRect {
        let range = |axis: usize| {
            let (start, last) = (self.origin[axis], self.size[axis] - 1);
            let first = pixels[axis].saturating_sub(start).min(last);
            [first, pixels[axis + 2].saturating_sub(start).min(last)].map(|p| p / BLOCK)
        };
        BlockRect {
            x: range(0),
            y: range(1),
        }
    }
}

/// What the lanes know of a batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct BatchLanes {
    edges: EdgeLanes,
    /// Bound on the nearness, widened by the band.
    nearest: [f32; LANES],
    /// First and last column, first and last row of blocks.
    rect: [[i32; LANES]; 4],
    /// Of the 4 x 4 blocks from the first of each rectangle, a bit for those that may be reached.
    reach: [i32; LANES],
    /// First pixel column and row of each rectangle.
    pixel: [[i32; LANES]; 2],
    /// Of the 4 x 4 pixels from there, a bit for those that may be covered, and for those that are.
    covers: [[i32; LANES]; 2],
    /// Nearness at the first of these pixels.
    pixel_nearness: [f32; LANES],
}

impl BatchLanes {
    /// Blocks of a triangle's rectangle.
    #[inline(always)]
    fn rect(&self, lane: usize) -> BlockRect {
        let at = |i: usize| self.rect[i][lane] as u32;
        BlockRect {
            x: [at(0), at(1)],
            y: [at(2), at(3)],
        }
    }
}

/// Draws the full batches of the queue, or `all` of it, and takes them out. Corners count from raster point `origin`.
pub(crate) fn draw_queue(
    level: SimdLevel,
    tile: &mut TileBuffer,
    queue: &mut TriangleQueue,
    lanes: &mut BatchLanes,
    place: &TilePlace,
    (origin, all): ([f32; 2], bool),
) {
    let ready = if all {
        queue.count
    } else {
        queue.count / LANES * LANES
    };
    if ready == 0 {
        return;
    }
    dispatch!(level.0, simd => {
        for first in (0..ready).step_by(LANES) {
            let batch = first..ready.min(first + LANES);
            draw_batch(simd, tile, queue, lanes, place, (origin, batch));
        }
    });
    queue.take(ready);
}

#[inline(always)]
fn draw_batch<S: Simd>(
    simd: S,
    tile: &mut TileBuffer,
    queue: &mut TriangleQueue,
    lanes: &mut BatchLanes,
    place: &TilePlace,
    (origin, batch): ([f32; 2], Range<usize>),
) {
    let corners = corner_lanes(simd, &queue.corners, batch.start, origin);
    let used = u32::MAX >> (32 - batch.len() as u32);
    let sets = prepare(simd, corners, lanes, place);
    let prims = &queue.prim[batch];
    let good = sets.good & used;
    if place.hierarchy {
        if good & sets.tiny != 0 {
            cover_tiny(simd, lanes);
        }
        if good & sets.small & !sets.tiny != 0 {
            reach_small(simd, lanes);
        }
        for lane in Bits(good & sets.tiny) {
            draw_tiny(tile, lanes, lane, prims[lane]);
        }
        for lane in Bits(good & sets.small & !sets.tiny) {
            draw_small(simd, tile, lanes, lane, prims[lane]);
        }
        for lane in Bits(good & !sets.small) {
            let record = lanes.edges.record(lane, prims[lane]);
            draw::<S, false>(simd, tile, &record, lanes.rect(lane), lanes.nearest[lane]);
        }
        tile.refresh(simd);
    } else {
        for lane in Bits(good) {
            let record = lanes.edges.record(lane, prims[lane]);
            draw_flat(simd, tile, &record, lanes.rect(lane));
        }
    }
    for lane in Bits((sets.bad | sets.behind) & used) {
        let known = sets.bad & (1 << lane) != 0;
        queue.left.push(Left {
            prim: prims[lane],
            rect: known.then(|| lanes.rect(lane)),
        });
    }
}

/// Positions of the bits that are set.
pub(crate) struct Bits(pub(crate) u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let first = self.0.trailing_zeros() as usize;
        let any = self.0 != 0;
        self.0 &= self.0.wrapping_sub(1);
        any.then_some(first)
    }
}

/// Lanes by what is to be done with them.
struct Sets {
    good: u32,
    /// Up to 4 x 4 pixels.
    tiny: u32,
    /// Up to 4 x 4 blocks; all tiny ones are.
    small: u32,
    /// Not set up, but all vertices lie in front and the rectangle holds.
    bad: u32,
    /// A vertex does not lie in front.
    behind: u32,
}

#[inline(always)]
fn prepare<S: Simd>(
    simd: S,
    corners: [[f32x16<S>; 3]; 3],
    lanes: &mut BatchLanes,
    place: &TilePlace,
) -> Sets {
    let splat = |v: f32| f32x16::splat(simd, v);
    let [x, y, nearness] = corners;
    let zero = splat(0.0);
    let ahead = nearness[0].simd_ge(zero) & nearness[1].simd_ge(zero) & nearness[2].simd_ge(zero);
    let [x_first, x_last] = pixel_range(simd, x, place.size[0]);
    let [y_first, y_last] = pixel_range(simd, y, place.size[1]);
    let holds_centre = x_first.simd_le(x_last) & y_first.simd_le(y_last);
    let [x0, x1] = block_range(simd, [x_first, x_last], &mut lanes.rect, 0);
    let [y0, y1] = block_range(simd, [y_first, y_last], &mut lanes.rect, 2);
    let side = splat(BLOCK as f32);
    let origin = LaneOrigin {
        x: x0 * side,
        y: y0 * side,
        reach: [(x1 - x0) * side + side, (y1 - y0) * side + side],
    };
    // Differences to the tile's corner are rounded twice.
    let eps = largest(x, y) * splat(2.1 * ROUNDOFF) + splat(place.rounding + 2.0 * REST_ERROR);
    set_up_lanes(simd, corners, &origin, eps, &mut lanes.edges);
    let most = max3(nearness);
    (most * splat(1.0 + NEARNESS_BAND)).store_slice(&mut lanes.nearest);
    x_first.to_int::<i32x16<S>>().store_slice(&mut lanes.pixel[0]);
    y_first.to_int::<i32x16<S>>().store_slice(&mut lanes.pixel[1]);
    let small = up_to_four(simd, [x0, x1], [y0, y1]);
    let tiny = up_to_four(simd, [x_first, x_last], [y_first, y_last]);

    let (ahead, holds_centre) = (bits_of(simd, ahead), bits_of(simd, holds_centre));
    Sets {
        good: lanes.edges.good & holds_centre,
        tiny,
        small,
        bad: !lanes.edges.good & ahead & holds_centre,
        behind: !ahead,
    }
}

/// First and last pixel of a tile whose centres lie between the smallest and the largest of `v`, a little widened.
#[inline(always)]
pub(super) fn pixel_range<S: Simd>(simd: S, v: [f32x16<S>; 3], size: u32) -> [f32x16<S>; 2] {
    // Pixel centres lie at half units; 1/64 is far above the rounding of a coordinate below the guard.
    let low = min3(v) - f32x16::splat(simd, 0.5 + 1.0 / 64.0);
    let high = max3(v) - f32x16::splat(simd, 0.5 - 1.0 / 64.0);
    let last = f32x16::splat(simd, size as f32 - 1.0);
    [low.max(f32x16::splat(simd, 0.0)).ceil(), high.min(last).floor()]
}

/// First and last block of a range of pixels, which go to `rect[at]` and the next.
#[inline(always)]
pub(super) fn block_range<S: Simd>(
    simd: S,
    [first, last]: [f32x16<S>; 2],
    rect: &mut [[i32; LANES]; 4],
    at: usize,
) -> [f32x16<S>; 2] {
    let to_block = f32x16::splat(simd, 1.0 / BLOCK as f32);
    let (first, last) = ((first * to_block).floor(), (last * to_block).floor());
    first.to_int::<i32x16<S>>().store_slice(&mut rect[at]);
    last.to_int::<i32x16<S>>().store_slice(&mut rect[at + 1]);
    [first, last]
}

/// A bit for each rectangle of up to 4 x 4.
#[inline(always)]
pub(super) fn up_to_four<S: Simd>(simd: S, x: [f32x16<S>; 2], y: [f32x16<S>; 2]) -> u32 {
    let three = f32x16::splat(simd, 3.0);
    bits_of(simd, (x[1] - x[0]).simd_le(three) & (y[1] - y[0]).simd_le(three))
}

/// Which of the 4 x 4 blocks from the first of their rectangles the edges may reach.
#[inline(always)]
fn reach_small<S: Simd>(simd: S, lanes: &mut BatchLanes) {
    let edges = &lanes.edges;
    let (a, b, c) = (
        load3(simd, &edges.a),
        load3(simd, &edges.b),
        load3(simd, &edges.c),
    );
    let most = [
        c[0] + range_in_block(simd, a[0], b[0])[0],
        c[1] + range_in_block(simd, a[1], b[1])[0],
        c[2] + range_in_block(simd, a[2], b[2])[0],
    ];
    let mut reach = i32x16::splat(simd, 0);
    for row in 0..BLOCK {
        for column in 0..BLOCK {
            let (x, y) = ((column * BLOCK) as f32, (row * BLOCK) as f32);
            let at = [f32x16::splat(simd, x), f32x16::splat(simd, y)];
            let inside = min3(linear3(a, b, most, at));
            let reached = inside.simd_ge(f32x16::splat(simd, -1.0));
            reach |= marked(simd, reached, row * BLOCK + column);
        }
    }
    reach.store_slice(&mut lanes.reach);
}

/// Which of the 4 x 4 pixels from the first of their rectangles the triangles may cover, and which they do.
#[inline(always)]
fn cover_tiny<S: Simd>(simd: S, lanes: &mut BatchLanes) {
    let first = [first_centre(simd, lanes, 0), first_centre(simd, lanes, 1)];
    let edges = &lanes.edges;
    let (a, b) = (load3(simd, &edges.a), load3(simd, &edges.b));
    let corner = linear3(a, b, load3(simd, &edges.c), first);
    let zero = i32x16::splat(simd, 0);
    let (mut may, mut does) = (zero, zero);
    for row in 0..BLOCK {
        for column in 0..BLOCK {
            let at = [
                f32x16::splat(simd, column as f32),
                f32x16::splat(simd, row as f32),
            ];
            let inside = min3(linear3(a, b, corner, at));
            let k = row * BLOCK + column;
            may |= marked(simd, inside.simd_ge(f32x16::splat(simd, -1.0)), k);
            does |= marked(simd, inside.simd_gt(f32x16::splat(simd, 1.0)), k);
        }
    }
    let slope_x = f32x16::from_slice(simd, &edges.nearness_x);
    let slope_y = f32x16::from_slice(simd, &edges.nearness_y);
    let nearness = linear(slope_x, slope_y, f32x16::from_slice(simd, &edges.nearness), first);
    may.store_slice(&mut lanes.covers[0]);
    does.store_slice(&mut lanes.covers[1]);
    nearness.store_slice(&mut lanes.pixel_nearness);
}

/// Column or row of the first pixel centre, from the corner of the first block, which the edges count from.
#[inline(always)]
fn first_centre<S: Simd>(simd: S, lanes: &BatchLanes, axis: usize) -> f32x16<S> {
    let pixel = i32x16::from_slice(simd, &lanes.pixel[axis]);
    let block = i32x16::from_slice(simd, &lanes.rect[2 * axis]);
    (pixel - (block << 2)).to_float::<f32x16<S>>() + f32x16::splat(simd, 0.5)
}

/// Bit `k` in the lanes of a mask.
#[inline(always)]
fn marked<S: Simd>(simd: S, mask: mask32x16<S>, k: u32) -> i32x16<S> {
    mask.select(i32x16::splat(simd, 1 << k), i32x16::splat(simd, 0))
}

/// Draws a triangle of up to 4 x 4 pixels.
#[inline(always)]
fn draw_tiny(tile: &mut TileBuffer, lanes: &BatchLanes, lane: usize, prim: u32) {
    let (x, y) = (lanes.pixel[0][lane] as u32, lanes.pixel[1][lane] as u32);
    let [may, does] = [lanes.covers[0][lane] as u32, lanes.covers[1][lane] as u32];
    let within = tile.within(x, y);
    for k in Bits(may & within) {
        let (dx, dy) = (k as u32 % BLOCK, k as u32 / BLOCK);
        let slopes = lanes.edges.nearness_x[lane] * dx as f32 + lanes.edges.nearness_y[lane] * dy as f32;
        let nearness = lanes.pixel_nearness[lane] + slopes;
        tile.merge_pixel([x + dx, y + dy], nearness, prim, does & (1 << k) != 0);
    }
}

/// Draws a triangle of up to 4 x 4 blocks.
#[inline(always)]
fn draw_small<S: Simd>(simd: S, tile: &mut TileBuffer, lanes: &BatchLanes, lane: usize, prim: u32) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let [pixel_x, pixel_y] = pixel_lanes(simd);
    let nearest = lanes.nearest[lane];
    let BlockRect { x, y } = lanes.rect(lane);
    let record = lanes.edges.record(lane, prim);
    for k in Bits(lanes.reach[lane] as u32 & square(x[1] - x[0], y[1] - y[0])) {
        let (dx, dy) = (k as u32 % BLOCK, k as u32 / BLOCK);
        let block = tile.block(x[0] + dx, y[0] + dy);
        if nearest < tile.farthest[block] {
            continue;
        }
        let (px, py) = (
            pixel_x + splat((dx * BLOCK) as f32),
            pixel_y + splat((dy * BLOCK) as f32),
        );
        let [inside, nearness] = evaluate(simd, &record, [px, py]);
        merge::<S, false, false>(simd, tile, block, inside, nearness, &record);
    }
}
