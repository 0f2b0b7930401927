//! The pixels of each of the eye's tiles as receivers in a light's raster.

use rayon::prelude::*;

use super::LightQuery;
use crate::kernel::pixels::{
    Asking, BlockPoints, Entry, LightFaces, Span, TileRays, find_spans, hit_parameters, project_receivers,
};
use crate::kernel::planes::{CornerLanes, PixelPlane, find_planes};
use crate::kernel::{LANES, SimdLevel};
use crate::view::{Arrangement, View};
use crate::visibility::{Visibility, VisibleTile};
use crate::{Light, Triangles, exact};

/// The receivers of some of the eye's tiles: a part of all.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) points: Vec<BlockPoints>,
    /// Sorted by light tile.
    entries: Vec<Entry>,
    /// Where the entries of each light tile start, and the end.
    starts: Vec<u32>,
    /// Per light tile, the nearness of its farthest receiver; infinite without one.
    pub(super) farthest: Vec<f32>,
    /// Per tile and block, the pixels that are turned to the light.
    pub(super) asked: Vec<Vec<u16>>,
    pub(super) receivers: u64,
    pub(super) undisturbed: u64,
}

impl Part {
    /// The entries of a light tile.
    pub(super) fn of_tile(&self, tile: usize) -> &[Entry] {
        &self.entries[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    /// A counting sort of entries into light tiles.
    fn sort(&mut self, entries: &[Entry], tiles: usize) {
        self.starts.clear();
        self.starts.resize(tiles + 1, 0);
        self.farthest.clear();
        self.farthest.resize(tiles, f32::INFINITY);
        self.entries.clear();
        for entry in entries {
            let tile = entry.light_tile as usize;
            self.starts[tile + 1] += 1;
            self.farthest[tile] = self.farthest[tile].min(entry.farthest);
        }
        for i in 0..tiles {
            self.starts[i + 1] += self.starts[i];
        }
        let mut next = self.starts.clone();
        let Some(&any) = entries.first() else { return };
        self.entries.resize(entries.len(), any);
        for entry in entries {
            let slot = &mut next[entry.light_tile as usize];
            self.entries[*slot as usize] = *entry;
            *slot += 1;
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<BlockPoints>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.starts.capacity() * 8
            + self.asked.iter().map(|a| a.capacity() * 2).sum::<usize>()
    }
}

/// Tiles of the eye's in a part at least: few, so that all threads have some.
const PART: usize = 16;

/// Parts at most, for each light tile looks through all of them.
const PARTS: usize = 1024;

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct GatherWork {
    /// The eye's rays of the tile.
    pub(crate) rays: TileRays,
    spans: Vec<Span>,
    /// The triangles seen in a tile, their corners and planes.
    prims: Vec<u32>,
    corners: Vec<CornerLanes>,
    planes: Vec<PixelPlane>,
    /// Whether each asks.
    asking: Vec<bool>,
    table: PrimTable,
    /// Hit parameters, block by block.
    pub(crate) t: Vec<[f64; LANES]>,
    /// A bit for each pixel of each block that asks.
    pub(crate) asked: Vec<u16>,
    unsound: Vec<(u32, u32)>,
    entries: Vec<Entry>,
}

/// Finds the receivers of all tiles; they are kept in `parts`, whatever these held. There are so many light tiles in
/// all faces together.
pub(super) fn gather(
    visibility: &Visibility,
    triangles: &Triangles,
    query: &LightQuery,
    (faces, light_tiles): (&LightFaces, usize),
    level: SimdLevel,
    parts: &mut Vec<Part>,
) {
    let tiles = visibility.tiles();
    let size = tiles.len().div_ceil(PARTS).max(PART);
    parts.resize_with(tiles.len().div_ceil(size), Part::default);
    let both = parts.par_iter_mut().zip(tiles.par_chunks(size)).enumerate();
    both.for_each_init(GatherWork::default, |work, (index, (part, tiles))| {
        part.points.clear();
        part.asked.clear();
        work.entries.clear();
        for (i, tile) in tiles.iter().enumerate() {
            let asks = |prim, sides| query.asks(triangles, prim, sides);
            let ends = [&query.light, &query.eye];
            work.find((visibility.view(), ends), triangles, tile, asks, level);
            let asking = Asking {
                eye_tile: (index * size + i) as u32,
                part: index as u16,
                prims: &tile.prims,
                rays: &work.rays,
                t: &work.t,
                pixels: &work.asked,
            };
            project_receivers(level, &asking, faces, &mut part.points, &mut work.entries);
            part.asked.push(work.asked.clone());
        }
        let pixels = |bits: &u16| u64::from(bits.count_ones());
        part.receivers = part.asked.iter().flatten().map(pixels).sum();
        let held: u64 = work.entries.iter().map(|e| pixels(&e.lanes)).sum();
        part.undisturbed = part.receivers - held;
        part.sort(&work.entries, light_tiles);
    });
}

impl GatherWork {
    /// Finds the surface points of those pixels of a tile whose triangle `asks`, which is told whether these ends lie in
    /// front of it, where that is beyond doubt.
    pub(crate) fn find<const ENDS: usize>(
        &mut self,
        (view, ends): (&View, [&Light; ENDS]),
        triangles: &Triangles,
        tile: &VisibleTile,
        asks: impl Fn(u32, [Option<bool>; ENDS]) -> bool,
        level: SimdLevel,
    ) {
        self.find_spans((view, ends), triangles, tile, asks, level);
        self.find_points(view, triangles, tile, level);
    }

    /// The pixels that see the same triangle, as far as they ask.
    fn find_spans<const ENDS: usize>(
        &mut self,
        (view, ends): (&View, [&Light; ENDS]),
        triangles: &Triangles,
        tile: &VisibleTile,
        asks: impl Fn(u32, [Option<bool>; ENDS]) -> bool,
        level: SimdLevel,
    ) {
        self.prims.clear();
        self.table.clear();
        let (prims, table) = (&mut self.prims, &mut self.table);
        let mut position_of = |prim: u32| {
            table.entry(prim, || {
                prims.push(prim);
                prims.len() as u32 - 1
            })
        };
        find_spans(level, &tile.prims, &mut position_of, &mut self.spans);
        self.find_planes((view, ends), triangles, asks, level);
        self.asked.clear();
        self.asked.resize(tile.prims.len(), 0);
        let (asking, asked) = (&self.asking, &mut self.asked);
        self.spans.retain(|span| {
            let asks = asking[span.plane as usize];
            asked[span.block as usize] |= if asks { span.pixels as u16 } else { 0 };
            asks
        });
    }

    /// The planes of the triangles that are seen. Corners may lie anywhere in memory: they are read in a loop of its own,
    /// so that the processor waits for several at a time.
    fn find_planes<const ENDS: usize>(
        &mut self,
        (view, ends): (&View, [&Light; ENDS]),
        triangles: &Triangles,
        asks: impl Fn(u32, [Option<bool>; ENDS]) -> bool,
        level: SimdLevel,
    ) {
        let in_lanes = matches!(view.arrangement, Arrangement::Perspective);
        let batches = self.prims.len().div_ceil(LANES);
        self.corners.resize(batches, [[[0.0; 4]; LANES]; 3]);
        for (prims, corners) in self.prims.chunks(LANES).zip(&mut self.corners) {
            for (lane, &prim) in prims.iter().enumerate() {
                let [a, b, c] = triangles.corners(prim);
                corners[0][lane] = a.extend(0.0).to_array();
                corners[1][lane] = b.extend(0.0).to_array();
                corners[2][lane] = c.extend(0.0).to_array();
            }
        }
        self.planes.clear();
        self.asking.clear();
        for (prims, corners) in self.prims.chunks(LANES).zip(&self.corners) {
            let (planes, sides) = find_planes(level, view.center.as_dvec3(), corners, ends);
            self.planes.extend_from_slice(&planes);
            let asking = prims.iter().enumerate().map(|(lane, &prim)| {
                let sides = sides.map(|sides| sides.front(lane));
                asks(prim, sides)
            });
            self.asking.extend(asking);
        }
        if !in_lanes {
            self.planes.iter_mut().for_each(|plane| *plane = plane.unsound());
        }
    }

    /// Hit parameters of all pixels that ask.
    fn find_points(&mut self, view: &View, triangles: &Triangles, tile: &VisibleTile, level: SimdLevel) {
        let blocks = [tile.stride, tile.prims.len() as u32 / tile.stride];
        self.rays.set(view, [tile.tile.x, tile.tile.y], blocks);
        self.t.clear();
        self.t.resize(tile.prims.len(), [0.0; LANES]);
        self.unsound.clear();
        hit_parameters(
            level,
            &self.rays,
            &self.spans,
            &self.planes,
            &mut self.t,
            &mut self.unsound,
        );
        for &(block, mut lanes) in &self.unsound {
            while lanes != 0 {
                let lane = lanes.trailing_zeros();
                lanes &= lanes - 1;
                let ray = tile.ray(view, block, lane);
                let prim = tile.prims[block as usize][lane as usize];
                match exact::attributes(ray.origin, ray.dir, triangles.corners(prim)) {
                    Some(hit) => self.t[block as usize][lane as usize] = hit.t,
                    None => self.asked[block as usize] &= !(1 << lane),
                }
            }
        }
    }
}

/// Positions of the triangles seen in a tile: open addressing, emptied by counting up.
#[derive(Debug, Default)]
struct PrimTable {
    slots: Vec<(u32, u32, u32)>,
    round: u32,
    used: usize,
}

impl PrimTable {
    fn clear(&mut self) {
        self.round += 1;
        self.used = 0;
        if self.slots.is_empty() {
            self.slots.resize(1024, (0, 0, 0));
        }
    }

    #[inline]
    fn entry(&mut self, prim: u32, make: impl FnOnce() -> u32) -> u32 {
        if self.used * 2 > self.slots.len() {
            self.grow();
        }
        let slot = self.slot(prim);
        let (round, _, value) = self.slots[slot];
        if round == self.round {
            return value;
        }
        let value = make();
        self.slots[slot] = (self.round, prim, value);
        self.used += 1;
        value
    }

    /// The slot of a triangle, or the free one where it belongs.
    #[inline]
    fn slot(&self, prim: u32) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = prim.wrapping_mul(0x9e37_79b1) as usize & mask;
        while self.slots[slot].0 == self.round && self.slots[slot].1 != prim {
            slot = (slot + 1) & mask;
        }
        slot
    }

    #[cold]
    fn grow(&mut self) {
        let larger = vec![(0, 0, 0); self.slots.len() * 2];
        for (round, prim, value) in std::mem::replace(&mut self.slots, larger) {
            if round == self.round {
                let slot = self.slot(prim);
                self.slots[slot] = (round, prim, value);
            }
        }
    }
}
