//! The receivers of one light tile, sorted by cell, and casters drawn over them in object order: hard shadows the
//! way of an irregular Z-buffer (Aila and Laine 2004; Johnson et al. 2005), sixteen lanes at a time.
//!
//! Cells lie in blocks of 4 x 4, as pixels do in the eye's tiles: cell (x, y) of a block is lane `y * 4 + x`. The receivers of a cell
//! fill whole groups of sixteen. A caster is first held against the sixteen cells of a block: where may it reach
//! into a cell, and is it before the cell's farthest receiver? Then against the groups of the cells that are left.
//!
//! Layout: 16 bytes a receiver, groups half empty at worst; 8 bytes a cell. Cost: about 30 vector instructions a caster
//! and block of cells, 25 a caster and group.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*, u32x16};

use super::edges::{EdgeLanes, EdgeRecord, Origin, VertexLanes, set_up};
use super::pixels::{BlockPoints, Entry, LIGHT_TILE};
use super::{LANES, NEARNESS_BAND, SimdLevel};

/// Cells of a block in each direction.
const BLOCK: u32 = 4;

/// Lanes without a receiver.
const NOBODY: u32 = u32::MAX;

/// Receivers a cell is to have about; more make more pairs that do not meet, fewer leave lanes empty.
const RECEIVERS_A_CELL: usize = 24;

/// Smallest and largest number of blocks of cells in each direction of a light tile. A cell is at most four raster units
/// wide, for no farther outside of its rectangle a triangle's edges are known.
const BLOCKS: [u32; 2] = [4, 16];

/// A light tile's receivers.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReceiverTile {
    /// Raster units per side of a cell.
    side: f32,
    /// Blocks of cells in a row.
    blocks: u32,
    /// First group of every cell, and the end.
    starts: Vec<u32>,
    /// Per block of cells, the nearness of each cell's farthest receiver; infinite if nobody asks there any more.
    farthest: Vec<[f32; LANES]>,
    groups: Vec<Group>,
    /// Cells of the receivers, entry by entry, while they are sorted.
    cells: Vec<[u32; LANES]>,
    /// The nearness of the farthest receiver of all.
    least: f32,
    /// Pairs of group, lane and triangle that f32 could not tell.
    pub(crate) unsure: Vec<(u32, u32, u32)>,
}

/// Up to sixteen receivers of a cell.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Group {
    x: [f32; LANES],
    y: [f32; LANES],
    nearness: [f32; LANES],
    /// Entry times sixteen plus lane.
    pub(crate) id: [u32; LANES],
    /// A bit for each receiver that is not in shadow yet.
    pub(crate) open: u32,
    /// A bit for each receiver.
    pub(crate) all: u32,
    /// Whether a caster was held against it.
    pub(crate) tested: bool,
}

const EMPTY: Group = Group {
    x: [0.0; LANES],
    y: [0.0; LANES],
    nearness: [f32::INFINITY; LANES],
    id: [NOBODY; LANES],
    open: 0,
    all: 0,
    tested: false,
};

/// Where the points of entries are found.
pub(crate) type PointsOf<'p> = &'p (dyn Fn(&Entry) -> &'p BlockPoints + Sync);

impl ReceiverTile {
    /// The groups of receivers.
    pub(crate) fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Notes that a receiver is in shadow.
    pub(crate) fn close(&mut self, group: u32, lane: u32) {
        self.groups[group as usize].open &= !(1 << lane);
    }

    /// Takes the receivers of these entries.
    pub(crate) fn set(&mut self, level: SimdLevel, entries: &[Entry], points_of: PointsOf) {
        dispatch!(level.0, simd => self.set_impl(simd, entries, points_of));
    }

    #[inline(always)]
    fn set_impl<S: Simd>(&mut self, simd: S, entries: &[Entry], points_of: PointsOf) {
        let receivers: usize = entries.iter().map(|e| e.lanes.count_ones() as usize).sum();
        let wanted = (receivers as f32 / RECEIVERS_A_CELL as f32).sqrt() / BLOCK as f32;
        self.blocks = (wanted.ceil() as u32).clamp(BLOCKS[0], BLOCKS[1]);
        let cells = self.blocks * BLOCK;
        self.side = LIGHT_TILE as f32 / cells as f32;
        let splat = |v: f32| f32x16::splat(simd, v);
        let scale = splat(1.0 / self.side);
        let last = splat((cells - 1) as f32);
        let count = (cells * cells) as usize;
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        self.cells.clear();
        self.cells.reserve(entries.len());
        for entry in entries {
            let points = points_of(entry);
            let index = |v: &[f32; LANES]| {
                let scaled = (f32x16::from_slice(simd, v) * scale).max(splat(0.0)).min(last);
                scaled.to_int::<u32x16<S>>()
            };
            let (x, y) = (index(&points.x), index(&points.y));
            let block = (y >> 2) * self.blocks + (x >> 2);
            let cell: [u32; LANES] = (block * 16 + (y & 3) * 4 + (x & 3)).into();
            let mut lanes = u32::from(entry.lanes);
            while lanes != 0 {
                self.starts[cell[lanes.trailing_zeros() as usize] as usize] += 1;
                lanes &= lanes - 1;
            }
            self.cells.push(cell);
        }
        self.make_groups();
        self.fill(entries, points_of);
    }

    /// From the number of receivers of each cell to its first group.
    fn make_groups(&mut self) {
        let mut groups = 0;
        for start in &mut self.starts {
            let own = start.div_ceil(LANES as u32);
            *start = groups * LANES as u32;
            groups += own;
        }
        self.groups.clear();
        self.groups.resize(groups as usize, EMPTY);
        self.farthest.clear();
        self.farthest
            .resize(self.starts.len() / LANES, [f32::INFINITY; LANES]);
        self.least = f32::INFINITY;
        self.unsure.clear();
    }

    /// Puts the receivers into the groups; `starts` counts receivers on entry and groups on return.
    #[inline(always)]
    fn fill(&mut self, entries: &[Entry], points_of: PointsOf) {
        for (i, (entry, cells)) in entries.iter().zip(&self.cells).enumerate() {
            let points = points_of(entry);
            self.least = self.least.min(entry.farthest);
            let mut lanes = u32::from(entry.lanes);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let cell = cells[lane] as usize;
                let at = self.starts[cell] as usize;
                self.starts[cell] += 1;
                let (group, slot) = (&mut self.groups[at / LANES], at % LANES);
                group.x[slot] = points.x[lane];
                group.y[slot] = points.y[lane];
                group.nearness[slot] = points.nearness[lane];
                group.id[slot] = (i * LANES + lane) as u32;
            }
        }
        // Every entry is now the end of its cell's receivers, within its last group.
        let mut first = 0;
        for cell in 0..self.starts.len() - 1 {
            let end = self.starts[cell];
            self.starts[cell] = first;
            let mut farthest = f32::INFINITY;
            let mut left = end.saturating_sub(first * LANES as u32);
            while left > 0 {
                let group = &mut self.groups[first as usize];
                group.all = u32::MAX >> (32 - left.min(LANES as u32));
                group.open = group.all;
                farthest = group.nearness.iter().fold(farthest, |a, b| a.min(*b));
                left = left.saturating_sub(LANES as u32);
                first += 1;
            }
            self.farthest[cell / LANES][cell % LANES] = farthest;
        }
        *self.starts.last_mut().expect("never empty") = first;
    }
}

/// Which triangle a receiver lies on.
pub(crate) type OwnPrim<'p> = &'p (dyn Fn(u32) -> u32 + Sync);

/// Draws up to sixteen casters over the receivers of a light tile whose corner is raster point `corner`. Returns a bit for every
/// lane that could not be set up.
pub(crate) fn draw_casters(
    level: SimdLevel,
    tile: &mut ReceiverTile,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    (corner, rounding): ([f32; 2], f32),
    own: OwnPrim,
) -> u32 {
    dispatch!(level.0, simd => draw_casters_impl(simd, tile, vertices, edges, (corner, rounding), own))
}

#[inline(always)]
fn draw_casters_impl<S: Simd>(
    simd: S,
    tile: &mut ReceiverTile,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    (corner, rounding): ([f32; 2], f32),
    own: OwnPrim,
) -> u32 {
    let origin = Origin::Point {
        x: corner[0],
        y: corner[1],
        // Receivers a little outside of the raster belong to its border.
        reach: (LIGHT_TILE + 2) as f32,
    };
    set_up(simd, vertices, origin, rounding, edges);
    let lanes = u32::MAX >> (32 - vertices.count as u32);
    let mut good = edges.good & lanes;
    let bad = lanes & !good;
    while good != 0 {
        let lane = good.trailing_zeros() as usize;
        good &= good - 1;
        let area = CasterArea::of_lane(vertices, lane, corner);
        let record = edges.record(lane, vertices.prim[lane]);
        draw_impl(simd, tile, &record, &area, own);
    }
    bad
}

/// What bounds a caster in a light tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CasterArea {
    /// Rectangle (min, max) relative to the tile's corner.
    min: [f32; 2],
    max: [f32; 2],
    /// A nearness it does not exceed; infinite if its plane bounds nothing either.
    nearest: f32,
}

impl CasterArea {
    /// A caster that may be anywhere in the tile.
    pub(crate) const ANYWHERE: Self = Self {
        min: [f32::NEG_INFINITY; 2],
        max: [f32::INFINITY; 2],
        nearest: f32::INFINITY,
    };

    #[inline(always)]
    fn of_lane(vertices: &VertexLanes, lane: usize, corner: [f32; 2]) -> Self {
        let range = |v: &[[f32; LANES]; 3], corner: f32| {
            let [a, b, c] = [v[0][lane] - corner, v[1][lane] - corner, v[2][lane] - corner];
            (a.min(b).min(c), a.max(b).max(c))
        };
        let (x, y) = (range(&vertices.x, corner[0]), range(&vertices.y, corner[1]));
        let n = &vertices.nearness;
        Self {
            min: [x.0, y.0],
            max: [x.1, y.1],
            nearest: n[0][lane].max(n[1][lane]).max(n[2][lane]),
        }
    }
}

/// Draws a caster that was set up elsewhere.
pub(crate) fn draw_caster(
    level: SimdLevel,
    tile: &mut ReceiverTile,
    record: &EdgeRecord,
    area: &CasterArea,
    own: OwnPrim,
) {
    dispatch!(level.0, simd => draw_impl(simd, tile, record, area, own));
}

/// How far outside of its rectangle a caster may be met, in raster units: vertices and receivers below the guard are
/// known to 1/512 of a unit or better.
const SLACK: f32 = 1.0 / 64.0;

#[inline(always)]
fn draw_impl<S: Simd>(
    simd: S,
    tile: &mut ReceiverTile,
    record: &EdgeRecord,
    area: &CasterArea,
    own: OwnPrim,
) {
    if area.nearest * (1.0 + 2.0 * NEARNESS_BAND) < tile.least {
        return;
    }
    let splat = |v: f32| f32x16::splat(simd, v);
    let block_side = tile.side * BLOCK as f32;
    let last = tile.blocks - 1;
    let block_range = |axis: usize| {
        let index = |v: f32| (v.max(0.0) / block_side).min(last as f32) as u32;
        index(area.min[axis] - SLACK)..=index(area.max[axis] + SLACK)
    };
    let reach = CellReach::new(simd, tile.side, record, area);
    for by in block_range(1) {
        for bx in block_range(0) {
            let block = by * tile.blocks + bx;
            let farthest = f32x16::from_slice(simd, &tile.farthest[block as usize]);
            let corner = [splat(bx as f32 * block_side), splat(by as f32 * block_side)];
            let mut cells = reach.cells(simd, record, corner, farthest);
            while cells != 0 {
                let cell = block * LANES as u32 + cells.trailing_zeros();
                cells &= cells - 1;
                draw_on_cell(simd, tile, record, cell as usize, own);
            }
        }
    }
}

/// A caster as it is held against sixteen cells at once.
struct CellReach<S: Simd> {
    /// Where in a cell, from its block's corner, each edge function is largest.
    edge_x: [f32x16<S>; 3],
    edge_y: [f32x16<S>; 3],
    low: [f32x16<S>; 2],
    high: [f32x16<S>; 2],
    min: [f32x16<S>; 2],
    max: [f32x16<S>; 2],
    /// Whether nearness grows with x, with y.
    grows: [bool; 2],
    nearest: f32x16<S>,
}

impl<S: Simd> CellReach<S> {
    #[inline(always)]
    fn new(simd: S, side: f32, record: &EdgeRecord, area: &CasterArea) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        // A point may be put into the neighbouring cell by rounding, and into the border's from outside.
        let (low, high) = (-SLACK, side + SLACK);
        let x = f32x16::from_fn(simd, |i| (i % BLOCK as usize) as f32) * splat(side);
        let y = f32x16::from_fn(simd, |i| (i / BLOCK as usize) as f32) * splat(side);
        let ends = |v: f32x16<S>| (v + splat(low), v + splat(high));
        let ((x_low, x_high), (y_low, y_high)) = (ends(x), ends(y));
        let pick = |slope: f32, low: f32x16<S>, high: f32x16<S>| if slope > 0.0 { high } else { low };
        Self {
            edge_x: [
                pick(record.a[0], x_low, x_high),
                pick(record.a[1], x_low, x_high),
                pick(record.a[2], x_low, x_high),
            ],
            edge_y: [
                pick(record.b[0], y_low, y_high),
                pick(record.b[1], y_low, y_high),
                pick(record.b[2], y_low, y_high),
            ],
            low: [x_low, y_low],
            high: [x_high, y_high],
            min: [splat(area.min[0]), splat(area.min[1])],
            max: [splat(area.max[0]), splat(area.max[1])],
            grows: [record.nearness_x > 0.0, record.nearness_y > 0.0],
            nearest: splat(area.nearest),
        }
    }

    /// The cells of a block that the caster may reach before their farthest receiver.
    #[inline(always)]
    fn cells(&self, simd: S, record: &EdgeRecord, corner: [f32x16<S>; 2], farthest: f32x16<S>) -> u32 {
        let splat = |v: f32| f32x16::splat(simd, v);
        let edge = |i: usize| {
            let (x, y) = (self.edge_x[i] + corner[0], self.edge_y[i] + corner[1]);
            splat(record.a[i]).mul_add(x, splat(record.b[i]).mul_add(y, splat(record.c[i])))
        };
        let mut reached = edge(0).min(edge(1)).min(edge(2)).simd_ge(splat(-1.01));
        let bounded = record.floor == 0.0 && record.ceiling == f32::INFINITY;
        // The part of each cell that lies in the caster's rectangle, for its plane is known only there.
        let mut part = |axis: usize| {
            let low = (self.low[axis] + corner[axis]).max(self.min[axis]);
            let high = (self.high[axis] + corner[axis]).min(self.max[axis]);
            reached &= (low - high).simd_le(splat(2.0 * SLACK));
            if self.grows[axis] { high } else { low }
        };
        let (x, y) = (part(0), part(1));
        if bounded {
            let plane = splat(record.nearness_x)
                .mul_add(x, splat(record.nearness_y).mul_add(y, splat(record.nearness)));
            let nearest = plane.min(self.nearest) * splat(1.0 + 2.0 * NEARNESS_BAND);
            reached &= nearest.simd_ge(farthest);
        } else {
            reached &= farthest.simd_lt(splat(f32::INFINITY));
        }
        reached.to_bitmask() as u32
    }
}

/// Holds a caster against the receivers of one cell.
#[inline(always)]
fn draw_on_cell<S: Simd>(simd: S, tile: &mut ReceiverTile, record: &EdgeRecord, cell: usize, own: OwnPrim) {
    let groups = tile.starts[cell] as usize..tile.starts[cell + 1] as usize;
    let mut closed = false;
    for index in groups.clone() {
        let group = &mut tile.groups[index];
        if group.open == 0 {
            continue;
        }
        group.tested = true;
        let (mut candidates, sure) = cover(simd, group, record);
        candidates &= group.open;
        while candidates != 0 {
            let lane = candidates.trailing_zeros();
            candidates &= candidates - 1;
            if own(group.id[lane as usize]) == record.prim {
                continue;
            }
            if sure & 1 << lane != 0 {
                group.open &= !(1 << lane);
            } else {
                tile.unsure.push((index as u32, lane, record.prim));
            }
        }
        closed |= group.open == 0;
    }
    if closed && tile.groups[groups].iter().all(|g| g.open == 0) {
        tile.farthest[cell / LANES][cell % LANES] = f32::INFINITY;
    }
}

/// The receivers of a group that a caster may shadow, and those among them that it certainly shadows, unless it is their own triangle.
#[inline(always)]
fn cover<S: Simd>(simd: S, group: &Group, record: &EdgeRecord) -> (u32, u32) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let x = f32x16::from_slice(simd, &group.x);
    let y = f32x16::from_slice(simd, &group.y);
    let plane = |a: f32, b: f32, c: f32| splat(a).mul_add(x, splat(b).mul_add(y, splat(c)));
    let g = |i: usize| plane(record.a[i], record.b[i], record.c[i]);
    let inside = g(0).min(g(1)).min(g(2));
    let covered = inside.simd_ge(splat(-1.0));
    if covered.all_false() {
        return (0, 0);
    }
    let nearness = f32x16::from_slice(simd, &group.nearness);
    let n = plane(record.nearness_x, record.nearness_y, record.nearness);
    let vague = !(n.simd_ge(splat(record.floor)) & n.simd_le(splat(record.ceiling)));
    let farther = n * splat(1.0 + NEARNESS_BAND);
    let possible = covered & (farther.simd_ge(nearness) | vague);
    let nearer = n * splat(1.0 - NEARNESS_BAND);
    let sure = possible & inside.simd_gt(splat(1.0)) & nearer.simd_gt(nearness) & !vague;
    (possible.to_bitmask() as u32, sure.to_bitmask() as u32)
}
