//! What a batch of casters may reach, searched for once: triangles of one cluster lie together, and most of them are
//! smaller than a box.
//!
//! The entries that meet the rectangle around all casters of the batch are copied into nodes of their own, and each
//! caster is held against these. Batches that meet more than a few are drawn caster by caster from the top.
//!
//! Layout: 36 bytes an entry, up to 64. Cost: 25 vector instructions a batch and node, 14 moves an entry.

use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

use super::{
    AreaLanes, CasterArea, LEVELS, Node, Points, ReceiverTile, SLACK, covered_boxes, draw_on_entry,
    largest_at, reached_boxes,
};
use crate::kernel::edges::EdgeRecord;
use crate::kernel::{LANES, NEARNESS_BAND, bits_of};

/// Entries that the casters of a batch may reach, copied together.
#[derive(Clone, Debug)]
pub(super) struct Near {
    nodes: [Node; NEAR / LANES],
    entries: [u32; NEAR],
    pub(super) count: usize,
}

/// Entries of a [`Near`] at most. Casters that reach more, for they are large or lie apart, search by themselves.
const NEAR: usize = 4 * LANES;

impl Default for Near {
    fn default() -> Self {
        Self {
            nodes: [Node::EMPTY; NEAR / LANES],
            entries: [0; NEAR],
            count: 0,
        }
    }
}

impl Near {
    /// Adds an entry, a lane of a node; there must be room.
    #[inline(always)]
    fn push(&mut self, node: &Node, lane: usize, entry: usize) {
        let (to, at) = (&mut self.nodes[self.count / LANES], self.count % LANES);
        if at == 0 {
            *to = Node::EMPTY;
        }
        for axis in 0..2 {
            to.sides[axis][0][at] = node.sides[axis][0][lane];
            to.sides[axis][1][at] = node.sides[axis][1][lane];
        }
        to.farthest[at] = node.farthest[lane];
        to.nearest[at] = node.nearest[lane];
        to.own[at] = node.own[lane];
        to.asks |= 1 << at;
        self.entries[self.count] = entry as u32;
        self.count += 1;
    }
}

impl AreaLanes {
    /// What bounds all of these casters; `None` if nothing is known of one.
    #[inline(always)]
    pub(super) fn around<S: Simd>(&self, simd: S, casters: u32) -> Option<CasterArea> {
        if casters & !self.known != 0 {
            return None;
        }
        let lanes = mask32x16::from_bitmask(simd, u64::from(casters));
        Some(CasterArea {
            min: [least(simd, lanes, &self.min[0]), least(simd, lanes, &self.min[1])],
            max: [most(simd, lanes, &self.max[0]), most(simd, lanes, &self.max[1])],
            nearest: most(simd, lanes, &self.nearest),
        })
    }
}

#[inline(always)]
fn least<S: Simd>(simd: S, lanes: mask32x16<S>, v: &[f32; LANES]) -> f32 {
    let others = f32x16::splat(simd, f32::INFINITY);
    lanes.select(f32x16::from_slice(simd, v), others).reduce_min()
}

#[inline(always)]
fn most<S: Simd>(simd: S, lanes: mask32x16<S>, v: &[f32; LANES]) -> f32 {
    let others = f32x16::splat(simd, f32::NEG_INFINITY);
    lanes.select(f32x16::from_slice(simd, v), others).reduce_max()
}

/// Draws a caster over the entries near its batch.
#[inline(always)]
pub(super) fn draw_near<S: Simd>(
    simd: S,
    tile: &mut ReceiverTile,
    record: &EdgeRecord,
    area: &CasterArea,
    points: Points,
) {
    let largest = largest_at(record);
    let side = (area.max[0] - area.min[0]).min(area.max[1] - area.min[1]);
    for index in 0..tile.near.count.div_ceil(LANES) {
        let node = &tile.near.nodes[index];
        let mut reached = reached_boxes(simd, node, record, area, largest) & node.asks;
        let mut covered = 0;
        if side >= tile.mean_side && reached != 0 {
            covered = covered_boxes(simd, node, record, largest, points.surest) & reached;
        }
        while reached != 0 {
            let lane = reached.trailing_zeros();
            reached &= reached - 1;
            let entry = tile.near.entries[index * LANES + lane as usize] as usize;
            if covered >> lane & 1 != 0 {
                tile.shut_entry(entry);
            } else {
                draw_on_entry(simd, tile, record, entry, points);
            }
            if tile.held[entry].open == 0 {
                tile.near.nodes[index].asks &= !(1 << lane);
            }
        }
    }
}

impl ReceiverTile {
    /// Copies the entries that something within `area` may reach before their farthest receiver; whether they are few.
    #[inline(always)]
    pub(super) fn find_near<S: Simd>(&mut self, simd: S, area: &CasterArea) -> bool {
        self.near.count = 0;
        let top = self.levels.len() - 1;
        let (mut at, mut left) = ([0; LEVELS], [0; LEVELS]);
        let mut level = top;
        left[top] = near_boxes(simd, &self.nodes[self.levels[top]], area);
        loop {
            if left[level] == 0 {
                if level == top {
                    return true;
                }
                level += 1;
                continue;
            }
            let lane = left[level].trailing_zeros() as usize;
            let below = at[level] * LANES + lane;
            left[level] &= left[level] - 1;
            if level > 0 {
                level -= 1;
                at[level] = below;
                left[level] = near_boxes(simd, &self.nodes[self.levels[level] + below], area);
            } else if self.near.count == NEAR {
                return false;
            } else {
                self.near.push(&self.nodes[below / LANES], lane, below);
            }
        }
    }

    /// Notes that everything in an entry is in shadow.
    #[cold]
    fn shut_entry(&mut self, entry: usize) {
        let held = &mut self.held[entry];
        (held.tested, held.open) = (true, 0);
        self.forget(0, entry / LANES, 1 << (entry % LANES));
    }
}

/// The boxes of a node that something within `area` may reach before their farthest receiver, where somebody asks.
#[inline(always)]
fn near_boxes<S: Simd>(simd: S, node: &Node, area: &CasterArea) -> u32 {
    let [[x_low, x_high], [y_low, y_high]] = &node.sides;
    let right = f32x16::from_slice(simd, x_low) - f32x16::splat(simd, area.max[0]);
    let left = f32x16::splat(simd, area.min[0]) - f32x16::from_slice(simd, x_high);
    let below = f32x16::from_slice(simd, y_low) - f32x16::splat(simd, area.max[1]);
    let above = f32x16::splat(simd, area.min[1]) - f32x16::from_slice(simd, y_high);
    let apart = right
        .max(left)
        .max(below)
        .max(above)
        .simd_gt(f32x16::splat(simd, 2.0 * SLACK));
    let bound = f32x16::splat(simd, area.nearest * (1.0 + 2.0 * NEARNESS_BAND));
    let hidden = bound.simd_lt(f32x16::from_slice(simd, &node.farthest));
    !bits_of(simd, apart | hidden) & node.asks
}
