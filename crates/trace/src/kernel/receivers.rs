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
        let (scale, last) = (1.0 / self.side, (cells - 1) as f32);
        let count = (cells * cells) as usize;
        self.starts.clear();
        self.starts.resize(count + 1, 0);
        self.cells.clear();
        self.cells.reserve(entries.len());
        for entry in entries {
            let points = points_of(entry);
            let x = cell_index(simd, &points.x, scale, last);
            let y = cell_index(simd, &points.y, scale, last);
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

/// Column or row of cells of sixteen coordinates.
#[inline(always)]
fn cell_index<S: Simd>(simd: S, v: &[f32; LANES], scale: f32, last: f32) -> u32x16<S> {
    let scaled = f32x16::from_slice(simd, v) * f32x16::splat(simd, scale);
    let kept = scaled
        .max(f32x16::splat(simd, 0.0))
        .min(f32x16::splat(simd, last));
    kept.to_int::<u32x16<S>>()
}

/// a x + b y + c. A function of its own, and not a closure, so that it is compiled for the caller's instruction set.
#[inline(always)]
fn plane<S: Simd>(simd: S, [a, b, c]: [f32; 3], x: f32x16<S>, y: f32x16<S>) -> f32x16<S> {
    let (a, b, c) = (
        f32x16::splat(simd, a),
        f32x16::splat(simd, b),
        f32x16::splat(simd, c),
    );
    a.mul_add(x, b.mul_add(y, c))
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

    /// The caster in that lane; anywhere, if a corner does not lie in front.
    #[inline(always)]
    pub(crate) fn of_lane(vertices: &VertexLanes, lane: usize, corner: [f32; 2]) -> Self {
        let range = |v: &[[f32; LANES]; 3], corner: f32| {
            let [a, b, c] = [v[0][lane] - corner, v[1][lane] - corner, v[2][lane] - corner];
            (a.min(b).min(c), a.max(b).max(c))
        };
        let (x, y) = (range(&vertices.x, corner[0]), range(&vertices.y, corner[1]));
        let n = &vertices.nearness;
        let [a, b, c] = [n[0][lane], n[1][lane], n[2][lane]];
        if !(a >= 0.0 && b >= 0.0 && c >= 0.0) {
            return Self::ANYWHERE;
        }
        // Far outside of the raster a vertex has an order but no nearness.
        let known = a > 0.0 && b > 0.0 && c > 0.0;
        Self {
            min: [x.0, y.0],
            max: [x.1, y.1],
            nearest: if known { a.max(b).max(c) } else { f32::INFINITY },
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
    let block_side = tile.side * BLOCK as f32;
    let last = (tile.blocks - 1) as f32;
    let (low, high) = (area.min, area.max);
    let index = |v: f32| (v.max(0.0) / block_side).min(last) as u32;
    for by in index(low[1] - SLACK)..=index(high[1] + SLACK) {
        for bx in index(low[0] - SLACK)..=index(high[0] + SLACK) {
            let block = (by * tile.blocks + bx) as usize;
            let corner = [bx as f32 * block_side, by as f32 * block_side];
            let farthest = &tile.farthest[block];
            let mut cells = reached_cells(simd, tile.side, record, area, corner, farthest);
            while cells != 0 {
                let cell = block * LANES + cells.trailing_zeros() as usize;
                cells &= cells - 1;
                draw_on_cell(simd, tile, record, cell, own);
            }
        }
    }
}

/// Column and row of a cell in its block.
const COLUMN: [f32; LANES] = [
    0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0, 0.0, 1.0, 2.0, 3.0,
];
const ROW: [f32; LANES] = [
    0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0,
];

/// The cells of a block that a caster may reach before their farthest receiver. `corner` is the block's.
#[inline(always)]
fn reached_cells<S: Simd>(
    simd: S,
    side: f32,
    record: &EdgeRecord,
    area: &CasterArea,
    corner: [f32; 2],
    farthest: &[f32; LANES],
) -> u32 {
    // A point may be put into the neighbouring cell by rounding.
    let (low, side) = (-SLACK, side + 2.0 * SLACK);
    let step = side - 2.0 * SLACK;
    let x_low = f32x16::from_slice(simd, &COLUMN)
        .mul_add(f32x16::splat(simd, step), f32x16::splat(simd, corner[0] + low));
    let y_low = f32x16::from_slice(simd, &ROW)
        .mul_add(f32x16::splat(simd, step), f32x16::splat(simd, corner[1] + low));
    let (x_high, y_high) = (
        x_low + f32x16::splat(simd, side),
        y_low + f32x16::splat(simd, side),
    );

    // Each edge function where it is largest in the cell.
    let EdgeRecord { a, b, c, .. } = *record;
    let edge_0 = corner_plane(simd, [a[0], b[0], c[0]], [x_low, x_high], [y_low, y_high]);
    let edge_1 = corner_plane(simd, [a[1], b[1], c[1]], [x_low, x_high], [y_low, y_high]);
    let edge_2 = corner_plane(simd, [a[2], b[2], c[2]], [x_low, x_high], [y_low, y_high]);
    let inside = edge_0.min(edge_1).min(edge_2);

    // The part of the cell that lies in the caster's rectangle, for its plane is known only there.
    let x_low = x_low.max(f32x16::splat(simd, area.min[0]));
    let x_high = x_high.min(f32x16::splat(simd, area.max[0]));
    let y_low = y_low.max(f32x16::splat(simd, area.min[1]));
    let y_high = y_high.min(f32x16::splat(simd, area.max[1]));
    let slack = f32x16::splat(simd, 2.0 * SLACK);
    let apart = (x_low - x_high).max(y_low - y_high).simd_gt(slack);

    let slopes = [record.nearness_x, record.nearness_y, record.nearness];
    let n = corner_plane(simd, slopes, [x_low, x_high], [y_low, y_high]);
    // The floor is far above the plane's error. Written so that what is not a number is kept.
    let bound = (n + f32x16::splat(simd, record.floor)).min(f32x16::splat(simd, area.nearest));
    let bound = bound * f32x16::splat(simd, 1.0 + 2.0 * NEARNESS_BAND);
    let hidden = bound.simd_lt(f32x16::from_slice(simd, farthest));
    (!hidden & !apart & inside.simd_ge(f32x16::splat(simd, -1.01))).to_bitmask() as u32
}

/// The largest value of a x + b y + c over sixteen rectangles.
#[inline(always)]
fn corner_plane<S: Simd>(
    simd: S,
    coefficients: [f32; 3],
    [x_low, x_high]: [f32x16<S>; 2],
    [y_low, y_high]: [f32x16<S>; 2],
) -> f32x16<S> {
    let x = if coefficients[0] > 0.0 { x_high } else { x_low };
    let y = if coefficients[1] > 0.0 { y_high } else { y_low };
    plane(simd, coefficients, x, y)
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
    let x = f32x16::from_slice(simd, &group.x);
    let y = f32x16::from_slice(simd, &group.y);
    let EdgeRecord { a, b, c, .. } = *record;
    let inside = plane(simd, [a[0], b[0], c[0]], x, y)
        .min(plane(simd, [a[1], b[1], c[1]], x, y))
        .min(plane(simd, [a[2], b[2], c[2]], x, y));
    let covered = inside.simd_ge(f32x16::splat(simd, -1.0));
    if covered.all_false() {
        return (0, 0);
    }
    let nearness = f32x16::from_slice(simd, &group.nearness);
    let slopes = [record.nearness_x, record.nearness_y, record.nearness];
    let n = plane(simd, slopes, x, y);
    let (floor, ceiling) = (
        f32x16::splat(simd, record.floor),
        f32x16::splat(simd, record.ceiling),
    );
    let vague = !(n.simd_ge(floor) & n.simd_le(ceiling));
    let farther = n * f32x16::splat(simd, 1.0 + NEARNESS_BAND);
    let possible = covered & (farther.simd_ge(nearness) | vague);
    let nearer = n * f32x16::splat(simd, 1.0 - NEARNESS_BAND);
    let certain = inside.simd_gt(f32x16::splat(simd, 1.0)) & !vague;
    let sure = possible & certain & nearer.simd_gt(nearness);
    (possible.to_bitmask() as u32, sure.to_bitmask() as u32)
}
