//! Whether some of the triangles that were found hide all of a light from all of a set of receivers.
//!
//! The segments between the receivers and the light are a connected set. Take triangles whose plane lies between all
//! receivers and all of the light. As a segment is moved, the number of them that it meets changes only where it passes an
//! edge; where it passes an edge that two of them share, lying on different sides of it, it leaves one and enters the other. So if every
//! edge that some segment may meet is shared in this way, all segments meet equally many: if one meets any, nothing in
//! the set is lit. This is the argument of silhouettes (Laine et al. 2005), used to prove darkness without a test: a smooth surface of
//! small triangles hides as one large triangle does.
//!
//! A neighbour that was culled is met by no segment, so neither is the edge. Which triangles are neighbours is a hint that
//! the topology gives; that they have an edge in common is looked at, for vertices may have moved.
//!
//! Cost: some 20 operations a triangle of the sheet.

use super::LANES;
use super::lines::{Group, Record};
use super::shaft::{Boxes, Culled};
use crate::Triangles;

/// What is known of a triangle that was found, a bit each: an edge that some segment may meet, from bit 0 on for each edge.
const CUT: u8 = 1;
/// It lies between all receivers and all of the light.
const BETWEEN: u8 = 1 << 3;
/// The segment in the middle meets it.
const MIDDLE: u8 = 1 << 4;
/// It belongs to the sheet that is looked at.
const SHEET: u8 = 1 << 5;
/// It belongs to a sheet that does not hide everything.
const OPEN: u8 = 1 << 6;

/// Its record is copied.
const COPIED: u8 = 1 << 7;

/// Triangles found, copied together.
#[derive(Clone, Debug, Default)]
pub(crate) struct Found {
    /// Where each is in the tree: group and lane.
    pub(crate) places: Vec<(u32, u32)>,
    /// Their boxes, copied together.
    pub(crate) boxes: Vec<Boxes>,
    /// The triangles, as far as they are known.
    records: Vec<Record>,
    flags: Vec<u8>,
    /// Whether some triangle may begin a sheet.
    seeds: bool,
}

impl Found {
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.places.clear();
        self.flags.clear();
        self.seeds = false;
    }

    pub(crate) fn count(&self) -> usize {
        self.places.len()
    }

    /// Adds a triangle of a group.
    #[inline(always)]
    pub(crate) fn push(&mut self, (group, boxes): (u32, &Boxes), lane: u32, culled: &Culled) {
        let (to, at) = (self.count() / LANES, self.count() % LANES);
        if to == self.boxes.len() {
            self.boxes.push(Boxes::default());
        }
        self.boxes[to].set(at, boxes.get(lane as usize));
        self.places.push((group, lane));
        if self.records.len() < self.places.len() {
            self.records.push(Record::default());
        }
        self.note(culled, lane as usize);
    }

    /// Notes what is known of the next triangle.
    #[inline(always)]
    fn note(&mut self, culled: &Culled, lane: usize) {
        let flags = flags_of(culled, lane);
        self.seeds |= flags & (BETWEEN | MIDDLE) == BETWEEN | MIDDLE;
        self.flags.push(flags);
    }

    /// One of the triangles, copied from the tree when it is first asked for.
    #[inline(always)]
    pub(crate) fn record(&mut self, groups: &[Group], index: usize) -> &Record {
        if self.flags[index] & COPIED == 0 {
            self.flags[index] |= COPIED;
            let (group, lane) = self.places[index];
            self.records[index] = Record::of(&groups[group as usize], lane as usize);
        }
        &self.records[index]
    }

    /// One that was asked for before.
    #[inline(always)]
    pub(crate) fn copied(&self, index: usize) -> &Record {
        &self.records[index]
    }

    /// The lanes of a group that hold triangles.
    #[inline(always)]
    pub(crate) fn lanes(&self, group: usize) -> u32 {
        u32::MAX >> (32 - (self.count() - group * LANES).min(LANES))
    }

    #[inline(always)]
    fn prim(&self, groups: &[Group], index: usize) -> u32 {
        let (group, lane) = self.places[index];
        groups[group as usize].prim[lane as usize]
    }

    #[inline(always)]
    fn is_back(&self, groups: &[Group], index: usize) -> bool {
        let (group, lane) = self.places[index];
        groups[group as usize].back >> lane & 1 != 0
    }
}

#[inline(always)]
fn flags_of(culled: &Culled, lane: usize) -> u8 {
    let bit = |mask: u32, flag: u8| (mask >> lane & 1) as u8 * flag;
    bit(culled.between, BETWEEN)
        | bit(culled.middle, MIDDLE)
        | bit(culled.cut[0], CUT)
        | bit(culled.cut[1], CUT << 1)
        | bit(culled.cut[2], CUT << 2)
}

/// The triangles as surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfaces<'t> {
    pub(crate) triangles: &'t Triangles<'t>,
    /// For each triangle those across its edges, first the one across from the first corner; empty if nothing is known.
    pub(crate) neighbours: &'t [[u32; 3]],
    /// The groups of the tree.
    pub(crate) groups: &'t [Group],
    /// A bit for each triangle that is in the tree.
    pub(crate) present: &'t [u64],
}

impl Surfaces<'_> {
    /// The triangle in the tree that has the edge across from that corner in common, running the other way.
    fn across(&self, prim: u32, edge: usize) -> Option<u32> {
        let next = self.neighbours[prim as usize][edge];
        let present = self.present.get(next as usize / 64)? >> (next % 64) & 1 != 0;
        if !present {
            return None;
        }
        let (own, other) = (self.triangles.corners(prim), self.triangles.corners(next));
        let (from, to) = (own[(edge + 1) % 3], own[(edge + 2) % 3]);
        let shared = (0..3).any(|i| other[i] == to && other[(i + 1) % 3] == from);
        shared.then_some(next)
    }
}

/// Working memory of [`Sheets::hide`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Sheets {
    /// Where each triangle is among those found, if it is.
    place: Vec<u32>,
    queue: Vec<u32>,
}

impl Sheets {
    /// Notes where the triangles found are.
    pub(crate) fn locate(&mut self, surfaces: &Surfaces, found: &Found) {
        if !surfaces.neighbours.is_empty() {
            self.place.resize(surfaces.neighbours.len(), 0);
            (0..found.count()).for_each(|i| self.place[found.prim(surfaces.groups, i) as usize] = i as u32);
        }
    }

    /// Whether triangles certainly hide all of the light from all receivers. They have to be located.
    pub(crate) fn hide(&mut self, surfaces: &Surfaces, found: &mut Found) -> bool {
        if !found.seeds || surfaces.neighbours.is_empty() {
            return false;
        }
        for seed in 0..found.count() {
            let begins = BETWEEN | MIDDLE;
            if found.flags[seed] & (begins | OPEN) == begins {
                if self.is_closed(surfaces, found, seed) {
                    return true;
                }
                self.queue.iter().for_each(|&i| found.flags[i as usize] |= OPEN);
            }
        }
        false
    }

    /// Whether all edges of the sheet of a triangle that segments may meet lie within it. The queue is left with the sheet, as
    /// far as it was looked at.
    fn is_closed(&mut self, surfaces: &Surfaces, found: &mut Found, seed: usize) -> bool {
        self.queue.clear();
        self.queue.push(seed as u32);
        found.flags[seed] |= SHEET;
        let mut at = 0;
        while at < self.queue.len() {
            let index = self.queue[at] as usize;
            at += 1;
            let prim = found.prim(surfaces.groups, index);
            let cut = found.flags[index];
            for edge in (0..3).filter(|edge| cut & CUT << edge != 0) {
                let Some(next) = surfaces.across(prim, edge) else {
                    return false;
                };
                let place = self.place[next as usize] as usize;
                if place >= found.count() || found.prim(surfaces.groups, place) != next {
                    continue;
                }
                let flags = found.flags[place];
                let turned = found.is_back(surfaces.groups, place) != found.is_back(surfaces.groups, index);
                if turned || flags & BETWEEN == 0 || flags & OPEN != 0 {
                    return false;
                }
                if flags & SHEET == 0 {
                    found.flags[place] |= SHEET;
                    self.queue.push(place as u32);
                }
            }
        }
        true
    }
}
