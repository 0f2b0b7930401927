//! The query of an area light's tree for a block of receivers: search, cull, sample, test.
//!
//! One call is one `dispatch!`, for up to sixteen batches of sixteen receivers, four to a square. The tree is searched by
//! boxes once for all of them. What is found is held against the box and the shaft of each square and copied
//! together; that may show that all is dark, because one triangle hides the whole light, or many that hang together
//! ([`super::cover`]). What is left is tested for each batch, where its box is met by some receiver's rays, and with those
//! samples alone whose bundle of rays meets it ([`super::bundles`]). Samples are made only once a triangle needs
//! them, so a batch that is certainly lit costs its share of the search.

use std::ops::Range;

use fearless_simd::{Simd, dispatch};

use super::bundles::{Bundles, WIDTH};
use super::cover::{Found, Sheets, Surfaces};
use super::light_points::{Askers, SamplePoints, light_points};
use super::lines::{
    Answers, Candidate, CornerLanes, EdgeSides, Group, LightBox, ReceiverLanes, Unsure, set_up,
};
use super::shaft::{
    Bounds, Boxes, FrameLanes, Places, Reach, ReceiverBox, Search, culled, overlapped, surface_axes,
};
use super::{LANES, SimdLevel};
use crate::{AreaLight, Samples};

/// Batches in a square.
const SQUARE: usize = 4;

/// Batches in a block.
pub(crate) const BATCHES: usize = 4 * SQUARE;

/// A tree as the kernel walks it: `levels[0]` has a box for each triangle, in groups of sixteen; each further level has
/// one for each sixteen of the level before. The last has one group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeLanes<'t> {
    pub(crate) frame: &'t FrameLanes,
    pub(crate) levels: &'t [Vec<Boxes>],
    pub(crate) groups: &'t [Group],
    pub(crate) surfaces: Surfaces<'t>,
}

/// What is asked: a light's samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightLanes<'t> {
    pub(crate) light: &'t AreaLight,
    pub(crate) light_box: &'t LightBox,
    pub(crate) samples: &'t Samples,
    pub(crate) unit: f32,
}

/// Working memory of a block.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockWork {
    pub(crate) receivers: [ReceiverLanes; BATCHES],
    pub(crate) askers: [Askers; BATCHES],
    pub(crate) answers: [Answers; BATCHES],
    points: SamplePoints,
    bundles: Bundles,
    /// For each slot, the receivers that still see their sample.
    open: Vec<u32>,
    stack: Vec<(u32, u32)>,
    bounds: [Bounds; BATCHES],
    /// Groups of the tree whose boxes the block's rays may meet, and which of them.
    leaves: Vec<(u32, u32)>,
    /// Triangles found for a square.
    found: Found,
    sheets: Sheets,
    /// Receivers found dark by what hides the whole light.
    pub(crate) covered: u64,
    /// Nodes searched: sixteen boxes each.
    pub(crate) nodes: u64,
    /// Triangles tested against a sample of each of sixteen receivers.
    pub(crate) tests: u64,
}

/// Closes the samples that triangles certainly hide from the receivers `active` of each batch, and notes unsure ones.
/// Returns a bit for each batch in which any triangle came into question.
pub(crate) fn query(
    level: SimdLevel,
    tree: &TreeLanes,
    light: &LightLanes,
    active: [u32; BATCHES],
    work: &mut BlockWork,
) -> u32 {
    dispatch!(level.0, simd => query_impl(simd, tree, light, active, work))
}

#[inline(always)]
fn query_impl<S: Simd>(
    simd: S,
    tree: &TreeLanes,
    light: &LightLanes,
    active: [u32; BATCHES],
    work: &mut BlockWork,
) -> u32 {
    for (batch, &lanes) in active.iter().enumerate() {
        work.bounds[batch] = if lanes == 0 {
            Bounds::NONE
        } else {
            Places::of(simd, tree.frame, &work.receivers[batch]).bounds(simd, lanes)
        };
    }
    search(simd, tree, work);
    let mut asked = 0;
    for first in (0..BATCHES).step_by(SQUARE) {
        let square = first..first + SQUARE;
        if active[square.clone()] == [0; SQUARE] || work.leaves.is_empty() {
            continue;
        }
        match narrow(simd, (tree, light), square.clone(), &active, work) {
            Findings::Nothing => (),
            Findings::Darkness => asked |= close(square, &active, work),
            Findings::Triangles => {
                for batch in square.filter(|&batch| active[batch] != 0) {
                    if test_batch(simd, (tree, light), batch, active[batch], work) {
                        asked |= 1 << batch;
                    }
                }
            }
        }
    }
    asked
}

/// What was found between some receivers and the light.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Findings {
    Nothing,
    /// Nothing of the light is seen.
    Darkness,
    Triangles,
}

/// Closes all samples of some batches; returns a bit for each.
fn close(batches: Range<usize>, active: &[u32; BATCHES], work: &mut BlockWork) -> u32 {
    let mut asked = 0;
    for batch in batches.filter(|&batch| active[batch] != 0) {
        let open = &mut work.answers[batch].open;
        open.iter_mut().for_each(|open| *open &= !active[batch]);
        work.covered += u64::from(active[batch].count_ones());
        asked |= 1 << batch;
    }
    asked
}

/// The bounds of the receivers of some batches.
fn bounds_of(batches: Range<usize>, work: &BlockWork) -> Bounds {
    let bounds = work.bounds[batches].iter();
    bounds.fold(Bounds::NONE, |all, batch| all.union(batch))
}

/// The box around the receivers of some batches.
#[inline(always)]
fn box_of<S: Simd>(simd: S, batches: Range<usize>, active: &[u32; BATCHES], work: &BlockWork) -> ReceiverBox {
    let fullest = batches.clone().max_by_key(|&batch| active[batch].count_ones());
    let fullest = fullest.unwrap_or(0);
    let axes = surface_axes(&work.receivers[fullest], active[fullest]);
    ReceiverBox::of(simd, axes, &work.receivers[batches.clone()], &active[batches])
}

/// Lists the leaves of the tree that the block's rays may meet.
#[inline(always)]
fn search<S: Simd>(simd: S, tree: &TreeLanes, work: &mut BlockWork) {
    let search = Search::new(tree.frame, &bounds_of(0..BATCHES, work));
    work.leaves.clear();
    work.stack.clear();
    work.stack.push((tree.levels.len() as u32 - 1, 0));
    while let Some((depth, index)) = work.stack.pop() {
        work.nodes += 1;
        let mut hit = overlapped(simd, &tree.levels[depth as usize][index as usize], &search);
        if depth == 0 {
            if hit != 0 {
                work.leaves.push((index, hit));
            }
            continue;
        }
        // The first child last, to be popped first.
        while hit != 0 {
            let child = 31 - hit.leading_zeros();
            hit &= !(1 << child);
            work.stack.push((depth - 1, index * LANES as u32 + child));
        }
    }
}

/// Copies those of the block's triangles that may come between the receivers of a square and the light together.
#[inline(always)]
fn narrow<S: Simd>(
    simd: S,
    (tree, light): (&TreeLanes, &LightLanes),
    square: Range<usize>,
    active: &[u32; BATCHES],
    work: &mut BlockWork,
) -> Findings {
    let search = Search::new(tree.frame, &bounds_of(square.clone(), work));
    let shape = box_of(simd, square, active, work);
    let found = &mut work.found;
    found.clear();
    for &(index, lanes) in &work.leaves {
        let boxes = &tree.levels[0][index as usize];
        let hit = overlapped(simd, boxes, &search) & lanes;
        if hit == 0 {
            continue;
        }
        let group = &tree.groups[index as usize];
        let culled = culled(simd, group, light.light_box, &shape, hit);
        if culled.covering() != 0 {
            return Findings::Darkness;
        }
        let mut kept = culled.kept;
        while kept != 0 {
            let lane = kept.trailing_zeros();
            kept &= kept - 1;
            found.push((index, boxes), lane, &culled);
        }
    }
    if found.count() == 0 {
        return Findings::Nothing;
    }
    work.sheets.locate(&tree.surfaces, found);
    if work.sheets.hide(&tree.surfaces, found) {
        Findings::Darkness
    } else {
        Findings::Triangles
    }
}

/// Tests a batch against its square's triangles; returns whether any came into question.
#[inline(always)]
fn test_batch<S: Simd>(
    simd: S,
    (tree, light): (&TreeLanes, &LightLanes),
    batch: usize,
    active: u32,
    work: &mut BlockWork,
) -> bool {
    let bounds = work.bounds[batch];
    let search = Search::new(tree.frame, &bounds);
    let receivers = &work.receivers[batch];
    let places = Places::of(simd, tree.frame, receivers);
    let reach = Reach::new(simd, tree.frame, &places);
    let (mut asked, mut left) = (false, active);
    for i in 0..work.found.count().div_ceil(LANES) {
        let boxes = &work.found.boxes[i];
        let mut hit = overlapped(simd, boxes, &search) & work.found.lanes(i);
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let extent = boxes.get(lane);
            let lanes = reach.meets(simd, extent) & left;
            if lanes == 0 {
                continue;
            }
            let (group, place) = work.found.places[i * LANES + lane];
            let (group, place) = (&tree.groups[group as usize], place as usize);
            let candidate = Candidate::new(simd, receivers, group, place, light.light_box, lanes);
            let Some(candidate) = candidate else { continue };
            if !asked {
                asked = true;
                let (points, askers) = (&mut work.points, &work.askers[batch]);
                light_points(simd, light.light, light.samples, askers, light.unit, points);
                let rays = (tree.frame, light.light_box);
                work.bundles.set(simd, rays, &places, points, (active, &bounds));
                work.open.clear();
                work.open.extend(points.lanes.iter().map(|lanes| lanes & active));
            }
            let test = BundleTest {
                receivers,
                light_box: light.light_box,
                points: &work.points,
                bundles: &work.bundles,
            };
            let (open, unsure) = (&mut work.open, &mut work.answers[batch].unsure);
            work.tests += test.test(simd, &candidate, (group, place, extent), open, unsure);
        }
        if asked && i % 4 == 3 {
            left = work.open.iter().fold(0, |all, open| all | open);
            if left == 0 {
                break;
            }
        }
    }
    if asked {
        close_slots(active, &work.points, &work.open, &mut work.answers[batch]);
    }
    asked
}

/// What a triangle is tested against.
struct BundleTest<'w> {
    receivers: &'w ReceiverLanes,
    light_box: &'w LightBox,
    points: &'w SamplePoints,
    bundles: &'w Bundles,
}

impl BundleTest<'_> {
    /// Closes the samples that a triangle certainly hides, and notes unsure ones; returns the bundles tested.
    #[inline(always)]
    fn test<S: Simd>(
        &self,
        simd: S,
        candidate: &Candidate,
        (group, lane, extent): (&Group, usize, [f32; 6]),
        open: &mut [u32],
        unsure: &mut Vec<Unsure>,
    ) -> u64 {
        let mut tests = 0;
        let mut sides: Option<EdgeSides<S>> = None;
        for eight in 0..open.len().div_ceil(WIDTH) {
            let mut met = self.bundles.met(simd, eight, extent);
            while met != 0 {
                let slot = eight * WIDTH + met.trailing_zeros() as usize;
                met &= met - 1;
                if slot >= open.len() || open[slot] & candidate.lanes == 0 {
                    continue;
                }
                tests += 1;
                if sides.is_none() {
                    let (receivers, light) = (self.receivers, self.light_box);
                    sides = Some(EdgeSides::new(simd, receivers, group, lane, light));
                }
                let Some(sides) = &sides else { continue };
                let d = &self.points.offsets[slot];
                let [sure, perhaps] = candidate.hides(simd, self.receivers, self.light_box, sides, d);
                open[slot] &= !sure;
                let mut perhaps = perhaps & open[slot];
                while perhaps != 0 {
                    let lane = perhaps.trailing_zeros();
                    perhaps &= perhaps - 1;
                    unsure.push(Unsure {
                        sample: u32::from(self.points.sample[slot][lane as usize]),
                        lane,
                        prim: candidate.prim,
                    });
                }
            }
        }
        tests
    }
}

/// From slots to samples.
fn close_slots(active: u32, points: &SamplePoints, open: &[u32], answers: &mut Answers) {
    for ((open, lanes), sample) in open.iter().zip(&points.lanes).zip(&points.sample) {
        let mut closed = lanes & active & !open;
        while closed != 0 {
            let lane = closed.trailing_zeros() as usize;
            closed &= closed - 1;
            answers.open[usize::from(sample[lane])] &= !(1 << lane);
        }
    }
}

/// Sets up sixteen triangles, see [`set_up`].
pub(crate) fn set_up_group(
    level: SimdLevel,
    corners: &CornerLanes,
    origin: [f32; 3],
    unit: f32,
    light: &LightBox,
    out: &mut Group,
) {
    dispatch!(level.0, simd => set_up(simd, corners, origin, unit, light, out));
}
