//! A tile's visibility buffer, and one triangle drawn into it (HM08 §5.1), sixteen rays at a time.
//!
//! Sixteen is also how a tile is divided: a patch is 4 x 4 blocks, a block is 4 x 4 pixels. Each pixel has the
//! nearness of its closest triangle so far and that triangle's id, 8 bytes; each block has the smallest nearness of
//! its pixels, which hides what is farther before its edges are evaluated. One vector holds a block's pixels, or
//! what is to be known of a patch's blocks. Rays are never stored; they follow from the raster. Pixels beyond the
//! raster are as near as can be, so nothing is ever drawn there.
//!
//! Cost: about 25 vector instructions for a triangle and a patch, and 20 for each block that is not decided with
//! its patch.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*, u32x16};

use super::edges::EdgeRecord;
use super::{LANES, NEARNESS_BAND, SimdLevel, bits_of, linear, linear3, min3, splat3};

/// Side of a block in pixels, and of a patch in blocks.
pub(crate) const BLOCK: u32 = 4;

/// Side of a patch in pixels.
pub(crate) const PATCH: u32 = BLOCK * BLOCK;

/// Id of "no triangle".
pub(crate) const NONE: u32 = u32::MAX;

/// What the pixels of a block of 4 x 4 see; pixel (x, y) of the block is at `y * 4 + x`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct BlockPixels {
    /// Nearness of the triangle seen, a few units of 1e-5 of itself off; of no meaning where none is.
    pub nearness: [f32; LANES],
    /// The triangle seen, or [`Self::NONE`].
    pub prim: [u32; LANES],
}

impl BlockPixels {
    /// Stands for "no triangle".
    pub const NONE: u32 = NONE;

    const EMPTY: Self = Self {
        nearness: [0.0; LANES],
        prim: [NONE; LANES],
    };
}

/// Nearness and triangle of every pixel of a tile. Patches lie in rows; a patch's blocks lie together.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileBuffer {
    pub(crate) blocks: Vec<BlockPixels>,
    /// Of every block the smallest nearness of its pixels, or less.
    pub(crate) farthest: Vec<f32>,
    /// Blocks of which `farthest` may have become too small.
    stale: Vec<u32>,
    size: [u32; 2],
    /// Patches in a row.
    pub(crate) stride: u32,
    /// Pixels whose answer f32 could not tell, to be settled exactly.
    pub(crate) unsure: Vec<Unsure>,
}

/// A pixel and the triangle that may be its closest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsure {
    pub(crate) block: u32,
    pub(crate) lane: u32,
    pub(crate) prim: u32,
    /// Nearness of the triangle there; infinite where it is not known.
    pub(crate) nearness: f32,
    /// Whether the triangle certainly covers the pixel.
    pub(crate) covers: bool,
}

/// Inclusive range of blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BlockRect {
    pub(crate) x: [u32; 2],
    pub(crate) y: [u32; 2],
}

impl TileBuffer {
    /// Empties the tile and gives it a size in pixels.
    pub(crate) fn clear(&mut self, [width, height]: [u32; 2]) {
        let patches = [width.div_ceil(PATCH), height.div_ceil(PATCH)];
        let count = patches[0] as usize * patches[1] as usize * LANES;
        self.stride = patches[0];
        self.size = [width, height];
        self.stale.clear();
        self.blocks.clear();
        self.blocks.resize(count, BlockPixels::EMPTY);
        self.farthest.clear();
        self.farthest.resize(count, 0.0);
        self.unsure.clear();
        if width % PATCH != 0 || height % PATCH != 0 {
            self.shut(patches.map(|n| n * PATCH), [width, height]);
        }
    }

    /// Puts the pixels beyond the raster before everything.
    fn shut(&mut self, padded: [u32; 2], size: [u32; 2]) {
        for (x, y) in (0..padded[1]).flat_map(|y| (0..padded[0]).map(move |x| (x, y))) {
            if x >= size[0] || y >= size[1] {
                let (block, lane) = self.place(x, y);
                self.blocks[block].nearness[lane] = f32::INFINITY;
            }
        }
        for (farthest, block) in self.farthest.iter_mut().zip(&self.blocks) {
            *farthest = block.nearness.into_iter().fold(f32::INFINITY, f32::min);
        }
    }

    /// Block of a pixel, and the pixel's place in it.
    #[inline]
    pub(crate) fn place(&self, x: u32, y: u32) -> (usize, usize) {
        let block = self.block(x / BLOCK, y / BLOCK);
        (block, (y % BLOCK * BLOCK + x % BLOCK) as usize)
    }

    /// Index of the block at these block coordinates.
    #[inline(always)]
    pub(crate) fn block(&self, x: u32, y: u32) -> usize {
        let patch = y / BLOCK * self.stride + x / BLOCK;
        (patch * PATCH + y % BLOCK * BLOCK + x % BLOCK) as usize
    }

    /// Of the 4 x 4 pixels from (x, y), a bit for those of the tile.
    #[inline(always)]
    pub(super) fn within(&self, x: u32, y: u32) -> u32 {
        let left = |start: u32, size: u32| (size - 1 - start).min(BLOCK - 1);
        square(left(x, self.size[0]), left(y, self.size[1]))
    }

    /// Takes a triangle into one pixel, which it may cover, or does.
    #[inline(always)]
    pub(super) fn merge_pixel(&mut self, [x, y]: [u32; 2], nearness: f32, prim: u32, covers: bool) {
        let (block, lane) = self.place(x, y);
        let pixels = &mut self.blocks[block];
        let stored = pixels.nearness[lane];
        if nearness * (1.0 + NEARNESS_BAND) < stored {
            return;
        }
        if covers && nearness * (1.0 - NEARNESS_BAND) > stored {
            pixels.nearness[lane] = nearness;
            pixels.prim[lane] = prim;
            if self.stale.last() != Some(&(block as u32)) {
                self.stale.push(block as u32);
            }
        } else {
            self.unsure.push(Unsure {
                block: block as u32,
                lane: lane as u32,
                prim,
                nearness,
                covers,
            });
        }
    }

    /// Finds anew the smallest nearness of blocks that changed pixel by pixel.
    #[inline(always)]
    pub(super) fn refresh<S: Simd>(&mut self, simd: S) {
        for block in self.stale.drain(..) {
            let pixels = &self.blocks[block as usize].nearness;
            self.farthest[block as usize] = f32x16::from_slice(simd, pixels).reduce_min();
        }
    }

    /// Pixel of a lane of a block.
    pub(crate) fn pixel(&self, block: u32, lane: u32) -> [u32; 2] {
        let (patch, block) = (block / PATCH, block % PATCH);
        let x = (patch % self.stride * BLOCK + block % BLOCK) * BLOCK + lane % BLOCK;
        let y = (patch / self.stride * BLOCK + block / BLOCK) * BLOCK + lane / BLOCK;
        [x, y]
    }
}

/// Whether all pixels of these blocks have something nearer than `nearest`.
#[inline(always)]
pub(super) fn hides<S: Simd>(simd: S, tile: &TileBuffer, rect: BlockRect, nearest: f32) -> bool {
    let nearest = f32x16::splat(simd, nearest);
    for py in rect.y[0] / BLOCK..=rect.y[1] / BLOCK {
        for px in rect.x[0] / BLOCK..=rect.x[1] / BLOCK {
            let first = ((py * tile.stride + px) * PATCH) as usize;
            let farthest = f32x16::from_slice(simd, &tile.farthest[first..first + LANES]);
            if bits_of(simd, !farthest.simd_gt(nearest)) & blocks_within(rect, px, py) != 0 {
                return false;
            }
        }
    }
    true
}

/// Draws one triangle that `record` sets up in f64, unless `nearest` says that it is hidden.
pub(crate) fn draw_precise(
    level: SimdLevel,
    tile: &mut TileBuffer,
    rect: BlockRect,
    nearest: f32,
    record: impl FnOnce() -> Option<EdgeRecord>,
) {
    if dispatch!(level.0, simd => hides(simd, tile, rect, nearest)) {
        return;
    }
    if let Some(record) = record() {
        dispatch!(level.0, simd => draw::<_, true>(simd, tile, &record, rect, f32::INFINITY));
    }
}

/// Offsets of a block's pixel centres from its corner.
#[inline(always)]
pub(super) fn pixel_lanes<S: Simd>(simd: S) -> [f32x16<S>; 2] {
    [
        f32x16::from_fn(simd, |i| (i % BLOCK as usize) as f32 + 0.5),
        f32x16::from_fn(simd, |i| (i / BLOCK as usize) as f32 + 0.5),
    ]
}

/// Draws a triangle into the blocks of `rect` that it may reach; its record counts from the corner of the
/// rectangle's first block. `nearest` bounds its nearness, widened by the
/// band. `PRECISE` records may be vague, others are known where they cover.
#[inline(always)]
pub(super) fn draw<S: Simd, const PRECISE: bool>(
    simd: S,
    tile: &mut TileBuffer,
    record: &EdgeRecord,
    rect: BlockRect,
    nearest: f32,
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let [pixel_x, pixel_y] = pixel_lanes(simd);
    let half = splat(0.5);
    let side = splat(BLOCK as f32);
    let (block_x, block_y) = ((pixel_x - half) * side, (pixel_y - half) * side);
    let (a, b, c) = (
        splat3(simd, record.a),
        splat3(simd, record.b),
        splat3(simd, record.c),
    );
    let plane = splat3(simd, [record.nearness_x, record.nearness_y, record.nearness]);
    let [most0, least0] = range_in_block(simd, a[0], b[0]);
    let [most1, least1] = range_in_block(simd, a[1], b[1]);
    let [most2, least2] = range_in_block(simd, a[2], b[2]);
    let [rise, fall] = range_in_block(simd, plane[0], plane[1]);
    let farther = splat(1.0 + NEARNESS_BAND);
    let mut corners = [[0.0f32; LANES]; 4];

    let start = [(rect.x[0] * BLOCK) as f32, (rect.y[0] * BLOCK) as f32];

    for py in rect.y[0] / BLOCK..=rect.y[1] / BLOCK {
        let y = block_y + splat((py * PATCH) as f32 - start[1]);
        for px in rect.x[0] / BLOCK..=rect.x[1] / BLOCK {
            let x = block_x + splat((px * PATCH) as f32 - start[0]);
            let edges = linear3(a, b, c, [x, y]);
            let nearness = linear(plane[0], plane[1], plane[2], [x, y]);
            let any = min3([edges[0] + most0, edges[1] + most1, edges[2] + most2]);
            let all = min3([edges[0] + least0, edges[1] + least1, edges[2] + least2]);
            let first = ((py * tile.stride + px) * PATCH) as usize;
            let mut reached = any.simd_ge(splat(-1.0));
            let farthest = f32x16::from_slice(simd, &tile.farthest[first..first + LANES]);
            let bound = ((nearness + rise) * farther).min(splat(nearest));
            let mut open = bound.simd_ge(farthest);
            if PRECISE {
                let known = (nearness + fall).simd_ge(splat(record.floor))
                    & (nearness + rise).simd_le(splat(record.ceiling));
                open |= !known;
            }
            reached &= open;
            let mut reached = bits_of(simd, reached) & blocks_within(rect, px, py);
            if reached == 0 {
                continue;
            }
            let accepted = bits_of(simd, all.simd_gt(splat(1.0)));
            edges[0].store_slice(&mut corners[0]);
            edges[1].store_slice(&mut corners[1]);
            edges[2].store_slice(&mut corners[2]);
            nearness.store_slice(&mut corners[3]);
            while reached != 0 {
                let lane = reached.trailing_zeros() as usize;
                reached &= reached - 1;
                let pixel = [pixel_x, pixel_y];
                let nearness = linear(plane[0], plane[1], splat(corners[3][lane]), pixel);
                if accepted & (1 << lane) != 0 {
                    merge::<S, true, PRECISE>(simd, tile, first + lane, nearness, nearness, record);
                } else {
                    let corner = [corners[0][lane], corners[1][lane], corners[2][lane]];
                    let inside = min3(linear3(a, b, splat3(simd, corner), pixel));
                    merge::<S, false, PRECISE>(simd, tile, first + lane, inside, nearness, record);
                }
            }
        }
    }
}

/// What a linear function rises at most and at least from a block's corner to its pixel centres: one of the outermost
/// has the extreme.
#[inline(always)]
pub(super) fn range_in_block<S: Simd>(simd: S, a: f32x16<S>, b: f32x16<S>) -> [f32x16<S>; 2] {
    let (first, last) = (f32x16::splat(simd, 0.5), f32x16::splat(simd, BLOCK as f32 - 0.5));
    let (ax, bx, ay, by) = (a * first, a * last, b * first, b * last);
    [ax.max(bx) + ay.max(by), ax.min(bx) + ay.min(by)]
}

/// Edge functions' least, and nearness, at points relative to a record's.
#[inline(always)]
pub(super) fn evaluate<S: Simd>(simd: S, record: &EdgeRecord, at: [f32x16<S>; 2]) -> [f32x16<S>; 2] {
    let (a, b, c) = (
        splat3(simd, record.a),
        splat3(simd, record.b),
        splat3(simd, record.c),
    );
    let plane = splat3(simd, [record.nearness_x, record.nearness_y, record.nearness]);
    [
        min3(linear3(a, b, c, at)),
        linear(plane[0], plane[1], plane[2], at),
    ]
}

/// Of 4 x 4 places in rows of four a bit for those in columns 0 to `x` and rows 0 to `y`, both at most 3.
#[inline(always)]
pub(super) fn square(x: u32, y: u32) -> u32 {
    let (columns, rows) = ((2 << x) - 1, (0x10 << (4 * y)) - 1);
    (columns * 0x1111) & rows
}

/// A bit for every block of patch (px, py) that lies in `rect`.
#[inline(always)]
fn blocks_within(rect: BlockRect, px: u32, py: u32) -> u32 {
    let range = |[first, last]: [u32; 2], patch: u32| {
        let start = patch * BLOCK;
        let (first, last) = (first.max(start) - start, (last - start).min(BLOCK - 1));
        (2 << last) - (1u32 << first)
    };
    let (columns, rows) = (range(rect.x, px), range(rect.y, py));
    // Bit i of the rows moves to bit 4 i, then every row takes the columns.
    let rows = (rows & 1) | (rows & 2) << 3 | (rows & 4) << 6 | (rows & 8) << 9;
    rows * columns
}

/// Draws without looking at more than one block at a time, as HM08 does.
#[inline(always)]
pub(super) fn draw_flat<S: Simd>(simd: S, tile: &mut TileBuffer, record: &EdgeRecord, rect: BlockRect) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let [pixel_x, pixel_y] = pixel_lanes(simd);
    for by in rect.y[0]..=rect.y[1] {
        let y = pixel_y + splat(((by - rect.y[0]) * BLOCK) as f32);
        for bx in rect.x[0]..=rect.x[1] {
            let x = pixel_x + splat(((bx - rect.x[0]) * BLOCK) as f32);
            let [inside, nearness] = evaluate(simd, record, [x, y]);
            let block = tile.block(bx, by);
            merge::<S, false, false>(simd, tile, block, inside, nearness, record);
        }
    }
}

/// Takes a triangle into the pixels of a block: `inside` is the least of its edge functions, not looked at if the
/// triangle covers the whole block.
#[inline(always)]
pub(super) fn merge<S: Simd, const ALL: bool, const PRECISE: bool>(
    simd: S,
    tile: &mut TileBuffer,
    block: usize,
    inside: f32x16<S>,
    nearness: f32x16<S>,
    record: &EdgeRecord,
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let pixels = &mut tile.blocks[block];
    let stored = f32x16::from_slice(simd, &pixels.nearness);
    let mut possible = (nearness * splat(1.0 + NEARNESS_BAND)).simd_ge(stored);
    let mut sure = (nearness * splat(1.0 - NEARNESS_BAND)).simd_gt(stored);
    let mut known = nearness;
    if PRECISE {
        // A plane outside of its range, or of unknown range, is not known well enough to be called hidden.
        let vague = !(nearness.simd_ge(splat(record.floor)) & nearness.simd_le(splat(record.ceiling)));
        possible |= vague & stored.simd_lt(splat(f32::INFINITY));
        sure &= !vague;
        known = vague.select(splat(f32::INFINITY), nearness);
    }
    let covers = inside.simd_gt(splat(1.0));
    if !ALL {
        possible &= inside.simd_ge(splat(-1.0));
        sure &= covers;
    }
    if possible.all_false() {
        return;
    }
    let merged = sure.select(nearness, stored);
    merged.store_slice(&mut pixels.nearness);
    let prim = u32x16::from_slice(simd, &pixels.prim);
    sure.select(u32x16::splat(simd, record.prim), prim)
        .store_slice(&mut pixels.prim);
    tile.farthest[block] = merged.reduce_min();
    let unsure = bits_of(simd, possible & !sure);
    if unsure != 0 {
        let covers = if ALL { u32::MAX } else { bits_of(simd, covers) };
        note_unsure(tile, block as u32, [unsure, covers], record.prim, known.into());
    }
}

#[cold]
fn note_unsure(
    tile: &mut TileBuffer,
    block: u32,
    [mut unsure, covers]: [u32; 2],
    prim: u32,
    nearness: [f32; LANES],
) {
    while unsure != 0 {
        let lane = unsure.trailing_zeros();
        unsure &= unsure - 1;
        tile.unsure.push(Unsure {
            block,
            lane,
            prim,
            nearness: nearness[lane as usize],
            covers: covers & (1 << lane) != 0,
        });
    }
}
