//! The receivers of one light tile in a hierarchy of boxes, and casters drawn over them in object order: hard shadows the
//! way of an irregular Z-buffer (Aila and Laine 2004; Johnson et al. 2005), sixteen lanes at a time.
//!
//! Receivers stay in the blocks of 4 x 4 pixels that the eye sees them in, for what is close together there is as a rule close
//! together in the light's raster: an *entry* is what of a block lies together. Entries are put in order along a Morton
//! curve, and sixteen successive ones make a node with a box each; sixteen nodes make a node above them, up to one. A
//! caster is held against the sixteen boxes of a node: may it reach into a box, before the box's farthest receiver? Where
//! it covers a box before the nearest receiver all of that box is dark. In the end it is held against the receivers of
//! those entries that are left, and an entry that is dark is not looked at again.
//!
//! Sixteen casters that together reach few entries search for them once, see [`near`].
//!
//! Layout: 12 bytes an entry and 32 bytes for its place in a node. Cost: about 60 ns an entry to put in order, 35 vector
//! instructions a caster and node, 25 a caster and entry.

use fearless_simd::{Simd, dispatch, f32x16, mask32x16, prelude::*, u32x16};

use super::edges::{EdgeLanes, EdgeRecord, Origin, VertexLanes, set_up};
use super::pixels::{BlockPoints, Entry, LIGHT_TILE};
use super::tile::NONE;
use super::{LANES, NEARNESS_BAND, SimdLevel, bits_of, max3, min3};
use crate::visibility::VisibleTile;
use near::{Near, draw_near};

mod near;

/// Columns and rows of the cells that the Morton curve passes.
const CURVE_SIDE: u32 = 32;

/// Levels of nodes at most: sixteen to this power are more entries than a frame has blocks.
const LEVELS: usize = 6;

/// A light tile's receivers.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReceiverTile {
    held: Vec<Held>,
    /// Level by level, from those whose lanes are entries to the one on top.
    nodes: Vec<Node>,
    /// Where each level starts among the nodes.
    levels: Vec<usize>,
    /// Of every cell of the curve where its entries go.
    next: Vec<u32>,
    /// Rectangle of all, and the nearness of the farthest.
    min: [f32; 2],
    max: [f32; 2],
    least: f32,
    /// Smaller casters cover no box.
    mean_side: f32,
    near: Near,
    /// Triples of entry, lane and triangle that f32 could not tell.
    pub(crate) unsure: Vec<(u32, u32, u32)>,
}

/// The receivers of an entry.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Held {
    /// Where its points are.
    part: u16,
    points: u32,
    /// A bit for each receiver.
    pub(crate) all: u16,
    /// A bit for each receiver that is not in shadow yet.
    pub(crate) open: u16,
    /// Whether a caster was held against it.
    pub(crate) tested: bool,
}

/// Sixteen boxes: entries or nodes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    /// Of x and y the low and the high sides, a little apart.
    sides: [[[f32; LANES]; 2]; 2],
    farthest: [f32; LANES],
    nearest: [f32; LANES],
    /// The triangle that all receivers of a box lie on, if it is one.
    own: [u32; LANES],
    /// A bit for each box in which somebody asks.
    asks: u32,
}

impl Node {
    const EMPTY: Self = Self {
        sides: [[[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]]; 2],
        farthest: [f32::INFINITY; LANES],
        nearest: [f32::NEG_INFINITY; LANES],
        own: [NONE; LANES],
        asks: 0,
    };
}

/// All points, and what the eye sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Points<'p> {
    /// Part by part of the eye's tiles.
    pub(crate) parts: &'p [&'p [BlockPoints]],
    pub(crate) tiles: &'p [VisibleTile],
    /// Of nearer receivers than this it is not known that a caster lies farther from them than their error.
    pub(crate) surest: f32,
}

impl Held {
    /// The points that its lanes are among.
    #[inline(always)]
    pub(crate) fn points<'p>(&self, points: Points<'p>) -> &'p BlockPoints {
        &points.parts[self.part as usize][self.points as usize]
    }
}

impl ReceiverTile {
    /// The entries, in an order of their own.
    pub(crate) fn held(&self) -> &[Held] {
        &self.held
    }

    /// Notes that a receiver is in shadow.
    pub(crate) fn close(&mut self, entry: u32, lane: u32) {
        self.held[entry as usize].open &= !(1 << lane);
    }

    /// Takes the receivers of these entries.
    pub(crate) fn set<'e>(&mut self, level: SimdLevel, entries: impl Iterator<Item = &'e [Entry]> + Clone) {
        let all = || entries.clone().flatten();
        self.next.clear();
        self.next.resize((CURVE_SIDE * CURVE_SIDE) as usize + 1, 0);
        let mut width = 0.0;
        for entry in all() {
            self.next[place_on_curve(entry) + 1] += 1;
            width += (entry.max[0] - entry.min[0]).max(entry.max[1] - entry.min[1]);
        }
        for i in 1..self.next.len() {
            self.next[i] += self.next[i - 1];
        }
        let count = self.next[self.next.len() - 1] as usize;
        self.mean_side = 2.0 * width / count as f32;
        self.held.clear();
        self.held.resize(count, Held::default());
        self.nodes.clear();
        self.nodes.resize(count.div_ceil(LANES), Node::EMPTY);
        for entry in all() {
            let slot = &mut self.next[place_on_curve(entry)];
            let at = *slot as usize;
            *slot += 1;
            self.held[at] = Held {
                part: entry.part,
                points: entry.points,
                all: entry.lanes,
                open: entry.lanes,
                tested: false,
            };
            let (node, lane) = (&mut self.nodes[at / LANES], at % LANES);
            for axis in 0..2 {
                node.sides[axis][0][lane] = entry.min[axis] - SLACK;
                node.sides[axis][1][lane] = entry.max[axis] + SLACK;
            }
            node.farthest[lane] = entry.farthest;
            node.nearest[lane] = entry.nearest;
            node.own[lane] = entry.own;
            node.asks |= 1 << lane;
        }
        self.unsure.clear();
        dispatch!(level.0, simd => self.join(simd));
    }

    /// Nodes above nodes, up to one.
    #[inline(always)]
    fn join<S: Simd>(&mut self, simd: S) {
        self.levels.clear();
        self.levels.push(0);
        let mut first = 0;
        while self.nodes.len() - first > 1 {
            let end = self.nodes.len();
            for at in (first..end).step_by(LANES) {
                let mut above = Node::EMPTY;
                for (lane, node) in self.nodes[at..(at + LANES).min(end)].iter().enumerate() {
                    for axis in 0..2 {
                        let [low, high] = &node.sides[axis];
                        above.sides[axis][0][lane] = f32x16::from_slice(simd, low).reduce_min();
                        above.sides[axis][1][lane] = f32x16::from_slice(simd, high).reduce_max();
                    }
                    above.farthest[lane] = f32x16::from_slice(simd, &node.farthest).reduce_min();
                    above.nearest[lane] = f32x16::from_slice(simd, &node.nearest).reduce_max();
                    let own = u32x16::from_slice(simd, &node.own);
                    let others = bits_of(simd, own.simd_eq(u32x16::splat(simd, node.own[0])));
                    if node.asks & !others == 0 {
                        above.own[lane] = node.own[0];
                    }
                    above.asks |= 1 << lane;
                }
                self.nodes.push(above);
            }
            self.levels.push(end);
            first = end;
        }
        if let Some(top) = self.nodes.last() {
            for axis in 0..2 {
                let [low, high] = &top.sides[axis];
                self.min[axis] = f32x16::from_slice(simd, low).reduce_min();
                self.max[axis] = f32x16::from_slice(simd, high).reduce_max();
            }
            self.least = f32x16::from_slice(simd, &top.farthest).reduce_min();
        }
    }

    /// Notes that everything in these boxes of a node is in shadow.
    #[cold]
    fn shut(&mut self, level: usize, node: usize, mut lanes: u32) {
        while lanes != 0 {
            let below = node * LANES + lanes.trailing_zeros() as usize;
            let range = |level: usize, count: usize| {
                let size = 1 << (4 * level);
                (below * size).min(count)..((below + 1) * size).min(count)
            };
            let all = range(level, self.held.len());
            for held in &mut self.held[all] {
                held.tested = true;
                held.open = 0;
            }
            for inner in 0..level {
                let (start, end) = (self.levels[inner], self.levels[inner + 1]);
                let shut = range(level - 1 - inner, end - start);
                for node in &mut self.nodes[start..end][shut] {
                    node.asks = 0;
                }
            }
            self.forget(level, node, lanes & lanes.wrapping_neg());
            lanes &= lanes - 1;
        }
    }

    /// Notes that nobody asks in a box of a node any more.
    #[inline(always)]
    fn forget(&mut self, mut level: usize, mut node: usize, mut lane: u32) {
        loop {
            let asks = &mut self.nodes[self.levels[level] + node].asks;
            *asks &= !lane;
            level += 1;
            if *asks != 0 || level == self.levels.len() {
                return;
            }
            lane = 1 << (node % LANES);
            node /= LANES;
        }
    }
}

/// Where along the curve the middle of an entry lies.
#[inline(always)]
fn place_on_curve(entry: &Entry) -> usize {
    let cell = |axis: usize| {
        let middle = (entry.min[axis] + entry.max[axis]) * (0.5 * CURVE_SIDE as f32 / LIGHT_TILE as f32);
        middle.clamp(0.0, CURVE_SIDE as f32 - 1.0) as u32
    };
    let spread = |v: u32| {
        let v = (v | v << 4) & 0x0f0f;
        let v = (v | v << 2) & 0x3333;
        (v | v << 1) & 0x5555
    };
    (spread(cell(0)) | spread(cell(1)) << 1) as usize
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

/// Draws up to sixteen casters over the receivers of a light tile whose corner is raster point `corner`. Returns a bit for every
/// lane that could not be set up.
pub(crate) fn draw_casters(
    level: SimdLevel,
    tile: &mut ReceiverTile,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    (corner, rounding): ([f32; 2], f32),
    points: Points,
) -> u32 {
    dispatch!(level.0, simd => draw_casters_impl(simd, tile, vertices, edges, (corner, rounding), points))
}

#[inline(always)]
fn draw_casters_impl<S: Simd>(
    simd: S,
    tile: &mut ReceiverTile,
    vertices: &VertexLanes,
    edges: &mut EdgeLanes,
    (corner, rounding): ([f32; 2], f32),
    points: Points,
) -> u32 {
    let lanes = u32::MAX >> (32 - vertices.count as u32);
    let mut areas = AreaLanes::default();
    let wanted = lanes & areas.set(simd, tile, vertices, corner);
    if wanted == 0 {
        return 0;
    }
    let few = areas
        .around(simd, wanted)
        .is_some_and(|area| tile.find_near(simd, &area));
    if few && tile.near.count == 0 {
        return 0;
    }
    let origin = Origin::Point {
        x: corner[0],
        y: corner[1],
        // Receivers a little outside of the raster belong to its border.
        reach: (LIGHT_TILE + 2) as f32,
    };
    set_up(simd, vertices, origin, rounding, edges);
    let mut good = edges.good & wanted;
    let bad = wanted & !good;
    while good != 0 {
        let lane = good.trailing_zeros() as usize;
        good &= good - 1;
        let area = CasterArea {
            min: [areas.min[0][lane], areas.min[1][lane]],
            max: [areas.max[0][lane], areas.max[1][lane]],
            nearest: areas.nearest[lane],
        };
        let record = edges.record(lane, vertices.prim[lane]);
        if few {
            draw_near(simd, tile, &record, &area, points);
        } else {
            draw_impl(simd, tile, &record, &area, points);
        }
    }
    bad
}

/// What bounds sixteen casters.
#[derive(Default)]
struct AreaLanes {
    min: [[f32; LANES]; 2],
    max: [[f32; LANES]; 2],
    nearest: [f32; LANES],
    /// A bit for each of which all this is known.
    known: u32,
}

impl AreaLanes {
    /// Returns a bit for each caster that may come before a receiver of the tile.
    #[inline(always)]
    fn set<S: Simd>(&mut self, simd: S, tile: &ReceiverTile, v: &VertexLanes, corner: [f32; 2]) -> u32 {
        let nearness = super::load3(simd, &v.nearness);
        let nearest = max3(nearness);
        nearest.store_slice(&mut self.nearest);
        let mut apart = f32x16::splat(simd, f32::NEG_INFINITY);
        for (axis, lanes) in [&v.x, &v.y].into_iter().enumerate() {
            let origin = f32x16::splat(simd, corner[axis]);
            let lanes = super::load3(simd, lanes);
            let (min, max) = (min3(lanes) - origin, max3(lanes) - origin);
            min.store_slice(&mut self.min[axis]);
            max.store_slice(&mut self.max[axis]);
            let before = f32x16::splat(simd, tile.min[axis]) - max;
            let behind = min - f32x16::splat(simd, tile.max[axis]);
            apart = apart.max(before).max(behind);
        }
        // Nothing is known of the others.
        let known = min3(nearness).simd_gt(f32x16::splat(simd, 0.0));
        let hidden = nearest * f32x16::splat(simd, 1.0 + 2.0 * NEARNESS_BAND);
        let hidden = hidden.simd_lt(f32x16::splat(simd, tile.least));
        let apart = apart.simd_gt(f32x16::splat(simd, 2.0 * SLACK));
        self.known = bits_of(simd, known);
        !bits_of(simd, known & (apart | hidden))
    }
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
    points: Points,
) {
    dispatch!(level.0, simd => draw_impl(simd, tile, record, area, points));
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
    points: Points,
) {
    let side = (area.max[0] - area.min[0]).min(area.max[1] - area.min[1]);
    let how = (largest_at(record), side >= tile.mean_side);
    let top = tile.levels.len() - 1;
    let (mut at, mut left) = ([0; LEVELS], [0; LEVELS]);
    let mut level = top;
    left[top] = tile.enter(simd, (top, 0), record, area, how, points.surest);
    loop {
        if left[level] == 0 {
            if level == top {
                return;
            }
            level += 1;
            continue;
        }
        let below = at[level] * LANES + left[level].trailing_zeros() as usize;
        left[level] &= left[level] - 1;
        if level == 0 {
            draw_on_entry(simd, tile, record, below, points);
        } else {
            level -= 1;
            at[level] = below;
            left[level] = tile.enter(simd, (level, below), record, area, how, points.surest);
        }
    }
}

impl ReceiverTile {
    /// The boxes of a node that a caster is to be held against; those that it covers are shut.
    #[inline(always)]
    fn enter<S: Simd>(
        &mut self,
        simd: S,
        (level, index): (usize, usize),
        record: &EdgeRecord,
        area: &CasterArea,
        (largest, may_cover): (Sides, bool),
        surest: f32,
    ) -> u32 {
        let node = &self.nodes[self.levels[level] + index];
        let mut reached = reached_boxes(simd, node, record, area, largest) & node.asks;
        if may_cover && reached != 0 {
            let covered = covered_boxes(simd, node, record, largest, surest) & reached;
            if covered != 0 {
                reached &= !covered;
                self.shut(level, index, covered);
            }
        }
        reached
    }
}

/// Which sides of a box give the largest value of the edge functions, as positions among a node's sides: looked up, for
/// branches on signs would be guessed wrong.
type Sides = [[usize; 2]; 3];

#[inline(always)]
fn largest_at(record: &EdgeRecord) -> Sides {
    let side = |slope: f32| usize::from(slope > 0.0);
    let EdgeRecord { a, b, .. } = record;
    [
        [side(a[0]), side(b[0])],
        [side(a[1]), side(b[1])],
        [side(a[2]), side(b[2])],
    ]
}

/// The least of the edge functions, each at one side of the boxes in x and y.
#[inline(always)]
fn edges_at<S: Simd>(simd: S, node: &Node, record: &EdgeRecord, sides: Sides) -> f32x16<S> {
    let EdgeRecord { a, b, c, .. } = *record;
    let mut least = f32x16::splat(simd, f32::INFINITY);
    for edge in 0..3 {
        let x = f32x16::from_slice(simd, &node.sides[0][sides[edge][0]]);
        let y = f32x16::from_slice(simd, &node.sides[1][sides[edge][1]]);
        least = least.min(plane(simd, [a[edge], b[edge], c[edge]], x, y));
    }
    least
}

/// The boxes of a node that a caster may reach before their farthest receiver.
#[inline(always)]
fn reached_boxes<S: Simd>(
    simd: S,
    node: &Node,
    record: &EdgeRecord,
    area: &CasterArea,
    largest: Sides,
) -> u32 {
    let inside = edges_at(simd, node, record, largest);
    let reached = inside.simd_ge(f32x16::splat(simd, -1.01));

    // The part of the box that lies in the caster's rectangle, for its plane is known only there.
    let [[x_low, x_high], [y_low, y_high]] = &node.sides;
    let x_low = f32x16::from_slice(simd, x_low).max(f32x16::splat(simd, area.min[0]));
    let x_high = f32x16::from_slice(simd, x_high).min(f32x16::splat(simd, area.max[0]));
    let y_low = f32x16::from_slice(simd, y_low).max(f32x16::splat(simd, area.min[1]));
    let y_high = f32x16::from_slice(simd, y_high).min(f32x16::splat(simd, area.max[1]));
    let slack = f32x16::splat(simd, 2.0 * SLACK);
    let apart = (x_low - x_high).max(y_low - y_high).simd_gt(slack);

    let n = largest_plane(simd, record, [x_low, x_high], [y_low, y_high]);
    // The floor is far above the plane's error. Written so that what is not a number is kept.
    let bound = (n + f32x16::splat(simd, record.floor)).min(f32x16::splat(simd, area.nearest));
    let bound = bound * f32x16::splat(simd, 1.0 + 2.0 * NEARNESS_BAND);
    let hidden = bound.simd_lt(f32x16::from_slice(simd, &node.farthest));
    let own = u32x16::from_slice(simd, &node.own).simd_eq(u32x16::splat(simd, record.prim));
    bits_of(simd, reached & !(hidden | apart | own))
}

/// The largest nearness of a caster's plane over sixteen rectangles.
#[inline(always)]
fn largest_plane<S: Simd>(
    simd: S,
    record: &EdgeRecord,
    [x_low, x_high]: [f32x16<S>; 2],
    [y_low, y_high]: [f32x16<S>; 2],
) -> f32x16<S> {
    let (a, b) = (record.nearness_x, record.nearness_y);
    let x = f32x16::splat(simd, a.max(0.0)) * x_high;
    let x = f32x16::splat(simd, a.min(0.0)).mul_add(x_low, x);
    let y = f32x16::splat(simd, b.max(0.0)).mul_add(y_high, f32x16::splat(simd, record.nearness));
    let y = f32x16::splat(simd, b.min(0.0)).mul_add(y_low, y);
    x + y
}

/// The boxes of a node that a caster certainly covers, before their nearest receiver, which is not nearer than `surest`.
#[inline(always)]
fn covered_boxes<S: Simd>(simd: S, node: &Node, record: &EdgeRecord, largest: Sides, surest: f32) -> u32 {
    let [[ax, ay], [bx, by], [cx, cy]] = largest;
    let least_at = [[1 - ax, 1 - ay], [1 - bx, 1 - by], [1 - cx, 1 - cy]];
    // Twice what is certain for one receiver.
    let covers = edges_at(simd, node, record, least_at).simd_gt(f32x16::splat(simd, 2.0));
    let [[x_low, x_high], [y_low, y_high]] = &node.sides;
    let x = [f32x16::from_slice(simd, x_low), f32x16::from_slice(simd, x_high)];
    let y = [f32x16::from_slice(simd, y_low), f32x16::from_slice(simd, y_high)];
    // With its sides exchanged a box gives the least value.
    let least = largest_plane(simd, record, [x[1], x[0]], [y[1], y[0]]);
    let most = largest_plane(simd, record, x, y);
    let known: mask32x16<S> =
        least.simd_ge(f32x16::splat(simd, record.floor)) & most.simd_le(f32x16::splat(simd, record.ceiling));
    let nearer = least * f32x16::splat(simd, 1.0 - 2.0 * NEARNESS_BAND);
    let nearest = f32x16::from_slice(simd, &node.nearest);
    let nearer = nearer.simd_gt(nearest) & nearest.simd_le(f32x16::splat(simd, surest));
    bits_of(simd, covers & known & nearer)
}

/// Holds a caster against the receivers of one entry.
#[inline(always)]
fn draw_on_entry<S: Simd>(
    simd: S,
    tile: &mut ReceiverTile,
    record: &EdgeRecord,
    index: usize,
    points: Points,
) {
    let held = &mut tile.held[index];
    held.tested = true;
    let (candidates, sure) = cover(simd, held.points(points), points, record);
    let open = u32::from(held.open);
    let mut unsure = candidates & !sure & open;
    held.open &= !(sure as u16);
    while unsure != 0 {
        let lane = unsure.trailing_zeros();
        unsure &= unsure - 1;
        tile.unsure.push((index as u32, lane, record.prim));
    }
    if held.open == 0 {
        tile.forget(0, index / LANES, 1 << (index % LANES));
    }
}

/// The receivers of a block that a caster may shadow, and those among them that it certainly shadows; not those that
/// lie on it.
#[inline(always)]
fn cover<S: Simd>(simd: S, block: &BlockPoints, points: Points, record: &EdgeRecord) -> (u32, u32) {
    let x = f32x16::from_slice(simd, &block.x);
    let y = f32x16::from_slice(simd, &block.y);
    let EdgeRecord { a, b, c, .. } = *record;
    let inside = plane(simd, [a[0], b[0], c[0]], x, y)
        .min(plane(simd, [a[1], b[1], c[1]], x, y))
        .min(plane(simd, [a[2], b[2], c[2]], x, y));
    let covered = inside.simd_ge(f32x16::splat(simd, -1.0));
    if covered.all_false() {
        return (0, 0);
    }
    let seen = &points.tiles[block.eye_tile as usize].prims[block.block as usize];
    let own = u32x16::from_slice(simd, seen).simd_eq(u32x16::splat(simd, record.prim));
    let covered = covered & !own;
    if covered.all_false() {
        return (0, 0);
    }
    let nearness = f32x16::from_slice(simd, &block.nearness);
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
    let certain = certain & nearness.simd_le(f32x16::splat(simd, points.surest));
    let sure = possible & certain & nearer.simd_gt(nearness);
    (bits_of(simd, possible), bits_of(simd, sure))
}
