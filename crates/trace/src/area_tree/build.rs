//! Building a light's trees: boxes in perspective space, sorted along a curve, cut into sixteens.
//!
//! A triangle has one entry, wherever it reaches, so there is nothing to choose a resolution for. Entries are sorted
//! by size class, then by the bits of their middle's place in the raster and its depth (a Morton curve); sixteen in a row
//! share a node, sixteen nodes in a row their parent. Size classes keep a large triangle from stretching the boxes of
//! small neighbours. The bits of depth follow after a fixed number of those of the raster.

use rayon::prelude::*;

use super::frame::{Frame, Local};
use crate::kernel::area::set_up_group;
use crate::kernel::lines::{CornerLanes, Group};
use crate::kernel::shaft::Boxes;
use crate::kernel::{LANES, SimdLevel};
use crate::light_grid::{CastRule, Casts};
use crate::{AreaLight, Triangles};

/// A triangle that takes part in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    bounds: [f32; 6],
    /// Twice or four times the triangle's id: bit 0 is set if it is turned with its back to the light, bit 1 if its plane
    /// crosses the light.
    tag: u32,
}

const BACK: u32 = 1;
const CROSSING: u32 = 2;

/// Triangles at most: ids share a word with two flags.
pub(super) const MOST_TRIANGLES: usize = 1 << 30;

/// Triangles done by one task.
const CHUNK: usize = 8 * 1024;

/// The entries of a frame. Triangles that are all front and cast with their back alone are left out, like those
/// without area.
pub(super) fn entries(
    frame: &Frame,
    light: &AreaLight,
    triangles: &Triangles,
    rule: CastRule,
    level: SimdLevel,
) -> Vec<Entry> {
    let vertices = crate::eye_grid::project_all(level, &frame.view, triangles);
    let chunks = triangles.len().div_ceil(CHUNK);
    let chunk = |chunk: usize| {
        let prims = (chunk * CHUNK) as u32..((chunk + 1) * CHUNK).min(triangles.len()) as u32;
        let mut entries = Vec::with_capacity(prims.len());
        for prim in prims {
            let casts = rule(prim);
            if casts == Casts::Nothing {
                continue;
            }
            let Some(bounds) = frame.bounds(triangles, &vertices, prim) else {
                continue;
            };
            if triangles.is_degenerate(prim) {
                continue;
            }
            let side = light.side(triangles.corners(prim));
            if casts == Casts::Back && side > 0.0 {
                continue;
            }
            let tag = prim << 2;
            if side > 0.0 {
                entries.push(Entry { bounds, tag });
            } else if side < 0.0 {
                entries.push(Entry {
                    bounds,
                    tag: tag | BACK,
                });
            } else {
                entries.push(Entry {
                    bounds,
                    tag: tag | CROSSING,
                });
                entries.push(Entry {
                    bounds,
                    tag: tag | CROSSING | BACK,
                });
            }
        }
        entries
    };
    (0..chunks).into_par_iter().flat_map_iter(chunk).collect()
}

/// A bit for each triangle that has an entry.
pub(super) fn present(entries: &[Entry], triangles: usize) -> Vec<u64> {
    let mut bits = vec![0; triangles.div_ceil(64)];
    for entry in entries {
        let prim = entry.tag >> 2;
        bits[prim as usize / 64] |= 1 << (prim % 64);
    }
    bits
}

/// Sorts the entries by the keys, which have at most 30 bits; equal ones stay in order.
pub(super) fn sort(entries: &[Entry], key: impl Fn(&Entry) -> u32 + Sync) -> Vec<u32> {
    const BITS: u32 = 10;
    let mut pairs: Vec<(u32, u32)> = entries
        .par_iter()
        .enumerate()
        .map(|(i, entry)| (key(entry), i as u32))
        .collect();
    let mut sorted = vec![(0, 0); pairs.len()];
    for pass in 0..3 {
        let digit = |key: u32| (key >> (pass * BITS)) as usize & ((1 << BITS) - 1);
        let mut next = vec![0u32; 1 << BITS];
        for &(key, _) in &pairs {
            next[digit(key)] += 1;
        }
        let mut sum = 0;
        for n in &mut next {
            (*n, sum) = (sum, sum + *n);
        }
        for &pair in &pairs {
            let slot = &mut next[digit(pair.0)];
            sorted[*slot as usize] = pair;
            *slot += 1;
        }
        std::mem::swap(&mut pairs, &mut sorted);
    }
    pairs.into_iter().map(|(_, i)| i).collect()
}

/// Where an entry's bits of depth stand among those of its place in the raster: after this many bits of the latter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Order {
    pub(super) depth_after: u32,
}

/// Bits of raster place in each direction, of depth, and of the size class: 30 in all.
const PLACE_BITS: u32 = 12;
const DEPTH_BITS: u32 = 3;
const CLASS_BITS: u32 = 3;

/// Ranges of the entries' middles, mapped, and of their depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranges {
    low: [f32; 3],
    high: [f32; 3],
    parallel: bool,
}

impl Ranges {
    pub(super) fn of(entries: &[Entry], parallel: bool) -> Self {
        let all = Self {
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
            parallel,
        };
        entries
            .par_iter()
            .fold(
                || all,
                |ranges, entry| {
                    let at = ranges.place(entry);
                    Self {
                        low: [0, 1, 2].map(|i| ranges.low[i].min(at[i])),
                        high: [0, 1, 2].map(|i| ranges.high[i].max(at[i])),
                        parallel,
                    }
                },
            )
            .reduce(
                || all,
                |a, b| Self {
                    low: [0, 1, 2].map(|i| a.low[i].min(b.low[i])),
                    high: [0, 1, 2].map(|i| a.high[i].max(b.high[i])),
                    parallel,
                },
            )
    }

    /// A raster point on a finite square: perspective space has no border.
    fn mapped(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        if self.parallel {
            return [x, y];
        }
        let size = 1.0 + x.abs() + y.abs();
        [x / size, y / size]
    }

    /// Mapped middle and depth.
    fn place(&self, entry: &Entry) -> [f32; 3] {
        let [x0, x1, y0, y1, nearest, _] = entry.bounds;
        let [x, y] = self.mapped([(x0 + x1) * 0.5, (y0 + y1) * 0.5]);
        [x, y, if self.parallel { -nearest } else { 1.0 / nearest }]
    }

    /// The sort key of an entry.
    pub(super) fn key(&self, entry: &Entry, order: Order) -> u32 {
        let at = self.place(entry);
        let share = |axis: usize, bits: u32| {
            let range = self.high[axis] - self.low[axis];
            let share = (at[axis] - self.low[axis]) / range * (1 << bits) as f32;
            // What is not a number becomes 0.
            (share as u32).min((1 << bits) - 1)
        };
        let [x0, x1, y0, y1, ..] = entry.bounds;
        let (low, high) = (self.mapped([x0, y0]), self.mapped([x1, y1]));
        let extent = |axis: usize| (high[axis] - low[axis]) / (self.high[axis] - self.low[axis]);
        let extent = extent(0).max(extent(1));
        // 0 for what spans half of the raster, one more for each halving.
        let class = if extent > 0.0 {
            (-extent.log2()).clamp(0.0, 7.0) as u32
        } else {
            7
        };
        let place = spread(share(0, PLACE_BITS)) << 1 | spread(share(1, PLACE_BITS));
        let depth = share(2, DEPTH_BITS);
        let below = 2 * PLACE_BITS - order.depth_after;
        let key = ((place >> below) << DEPTH_BITS | depth) << below | (place & ((1 << below) - 1));
        class << (2 * PLACE_BITS + DEPTH_BITS) | key
    }
}

const _: () = assert!(2 * PLACE_BITS + DEPTH_BITS + CLASS_BITS == 30);

/// Puts a zero before each of the lowest 16 bits.
fn spread(mut v: u32) -> u32 {
    v = (v | v << 8) & 0x00ff_00ff;
    v = (v | v << 4) & 0x0f0f_0f0f;
    v = (v | v << 2) & 0x3333_3333;
    (v | v << 1) & 0x5555_5555
}

/// Boxes of the sorted entries and of their ancestors, up to a root.
pub(super) fn levels(entries: &[Entry], sorted: &[u32]) -> Vec<Vec<Boxes>> {
    let leaves = sorted
        .par_chunks(LANES)
        .map(|chunk| {
            let mut boxes = Boxes::default();
            for (lane, &i) in chunk.iter().enumerate() {
                boxes.set(lane, entries[i as usize].bounds);
            }
            boxes
        })
        .collect();
    let mut levels: Vec<Vec<Boxes>> = vec![leaves];
    while let Some(last) = levels.last().filter(|last| last.len() > 1) {
        let parents = last
            .par_chunks(LANES)
            .map(|chunk| {
                let mut boxes = Boxes::default();
                for (lane, child) in chunk.iter().enumerate() {
                    boxes.set(lane, child.hull());
                }
                boxes
            })
            .collect();
        levels.push(parents);
    }
    levels
}

/// The triangles of the sorted entries as the kernels take them.
pub(super) fn groups(
    entries: &[Entry],
    sorted: &[u32],
    triangles: &Triangles,
    local: &Local,
    level: SimdLevel,
) -> Vec<Group> {
    let mut groups = vec![Group::default(); sorted.len().div_ceil(LANES)];
    groups.par_iter_mut().zip(sorted.par_chunks(LANES)).for_each_init(
        CornerLanes::default,
        |corners, (group, chunk)| {
            (group.crossing, group.back) = (0, 0);
            for (lane, &i) in chunk.iter().enumerate() {
                let tag = entries[i as usize].tag;
                let prim = tag >> 2;
                group.prim[lane] = prim;
                group.crossing |= u32::from(tag & CROSSING != 0) << lane;
                group.back |= (tag & BACK) << lane;
                corners.side[lane] = if tag & BACK != 0 { -1.0 } else { 1.0 };
                for (corner, at) in triangles.corners(prim).into_iter().enumerate() {
                    for axis in 0..3 {
                        corners.v[corner][axis][lane] = at[axis];
                    }
                }
            }
            let unit = local.unit as f32;
            set_up_group(level, corners, local.origin.to_array(), unit, &local.light, group);
        },
    );
    groups
}
