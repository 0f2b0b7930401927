//! The query of an area light's tree for a block of receivers: search, cull, sample, test.
//!
//! One call is one `dispatch!`, for up to sixteen batches of sixteen receivers, four to a square. The tree is searched by
//! boxes once for all of them. What is found is held against the box and the shaft of each square and copied
//! together; that may show that all is dark, because one triangle hides the whole light, or many that hang together
//! ([`super::cover`]). What is left is held against each batch and, by box and plane, against each of its receivers. A few
//! triangles are then held against all of the light, which may leave no sample in question; else samples are made, and each
//! bundle of rays ([`super::bundles`]) is tested against the triangles whose boxes it meets, until none of its samples is
//! seen. Samples are made only once a triangle needs them, so a batch that is certainly lit costs its share of the search.
//!
//! Around the edge of something receivers lie apart. Near and far ones of a batch are then tested one after the other, and a
//! square's triangles are those that some batch's rays may meet.

use std::ops::Range;

use fearless_simd::{Simd, dispatch, f32x16, prelude::*};

use super::bundles::bundles;
use super::cover::{Found, Sheets, Surfaces};
use super::light_points::{Askers, SamplePoints, light_points};
use super::lines::{Answers, CornerLanes, Group, LightBox, Rays, ReceiverLanes, Unsure, set_up};
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
    bundles: Vec<Search>,
    rays: Rays,
    met: Met,
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
                    let parts = parts(simd, tree, batch, active[batch], work);
                    for (lanes, bounds) in parts.into_iter().filter(|part| part.0 != 0) {
                        if test_batch(simd, (tree, light), (batch, &bounds), lanes, work) {
                            asked |= 1 << batch;
                        }
                    }
                }
            }
        }
    }
    asked
}

/// The receivers `active` of a batch, or the near and the far ones of those that lie apart, with their bounds.
#[inline(always)]
fn parts<S: Simd>(
    simd: S,
    tree: &TreeLanes,
    batch: usize,
    active: u32,
    work: &BlockWork,
) -> [(u32, Bounds); 2] {
    let bounds = work.bounds[batch];
    if bounds.are_close() {
        return [(active, bounds), (0, Bounds::NONE)];
    }
    let places = Places::of(simd, tree.frame, &work.receivers[batch]);
    let near = places.nearer(simd, (bounds.depth[0] * bounds.depth[1]).sqrt()) & active;
    let far = active & !near;
    [(near, places.bounds(simd, near)), (far, places.bounds(simd, far))]
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
        close_lanes(active[batch], &mut work.answers[batch]);
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
    let bounds = bounds_of(square.clone(), work);
    let search = Search::new(tree.frame, &bounds);
    // Around the edge of something its receivers lie apart, with much between them that no ray of theirs meets. What is left
    // then says nothing of sheets, for the rays of each batch alone are not connected with those of the others.
    let apart = !bounds.are_close();
    let of_batch = |batch: usize| Search::new(tree.frame, &work.bounds[square.start + batch]);
    let batches: [Search; SQUARE] = std::array::from_fn(of_batch);
    let shape = box_of(simd, square, active, work);
    let found = &mut work.found;
    found.clear();
    for &(index, lanes) in &work.leaves {
        let boxes = &tree.levels[0][index as usize];
        let mut hit = overlapped(simd, boxes, &search) & lanes;
        if apart && hit != 0 {
            let mut met = 0;
            for batch in &batches {
                met |= overlapped(simd, boxes, batch);
            }
            hit &= met;
        }
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
    if apart {
        return Findings::Triangles;
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
    (batch, bounds): (usize, &Bounds),
    active: u32,
    work: &mut BlockWork,
) -> bool {
    let search = Search::new(tree.frame, bounds);
    let places = Places::of(simd, tree.frame, &work.receivers[batch]);
    let reach = Reach::new(simd, tree.frame, &places);
    work.met.clear();
    for i in 0..work.found.count().div_ceil(LANES) {
        let hit = overlapped(simd, &work.found.boxes[i], &search) & work.found.lanes(i);
        meet(simd, tree.groups, (&reach, i, hit), (batch, active), work);
    }
    if work.met.lanes.is_empty() {
        return false;
    }
    let (mut left, mut dark) = (active, 0);
    if work.met.lanes.len() <= FEW {
        let [mixed, covered] = over_light(simd, light, batch, work);
        (left, dark) = (mixed & !covered, covered);
        if left == 0 {
            close_lanes(dark, &mut work.answers[batch]);
            return true;
        }
    }
    let (points, askers) = (&mut work.points, &work.askers[batch]);
    light_points(simd, light.light, light.samples, askers, light.unit, points);
    let rays = (tree.frame, light.light_box);
    bundles(simd, rays, &places, points, (left, &search), &mut work.bundles);
    for slot in 0..work.bundles.len() {
        test_slot(simd, light, (batch, slot), left, work);
    }
    close_lanes(dark, &mut work.answers[batch]);
    true
}

/// Triangles up to which a batch is held against each for all of the light, before any sample is made.
const FEW: usize = 12;

/// Triangles that may come between the receivers of a batch and the light.
#[derive(Clone, Debug, Default)]
struct Met {
    /// Their boxes, sixteen together.
    boxes: Vec<Boxes>,
    /// Where each is among those found for the square.
    found: Vec<u32>,
    /// The receivers in question.
    lanes: Vec<u32>,
}

impl Met {
    fn clear(&mut self) {
        self.found.clear();
        self.lanes.clear();
    }

    #[inline(always)]
    fn push(&mut self, extent: [f32; 6], found: usize, lanes: u32) {
        let (to, at) = (self.lanes.len() / LANES, self.lanes.len() % LANES);
        if to == self.boxes.len() {
            self.boxes.push(Boxes::default());
        }
        self.boxes[to].set(at, extent);
        self.found.push(found as u32);
        self.lanes.push(lanes);
    }
}

/// Adds those of sixteen triangles that were found to those met: some receiver's rays meet the box, and it is not before
/// the triangle.
#[inline(always)]
fn meet<S: Simd>(
    simd: S,
    groups: &[Group],
    (reach, i, hit): (&Reach<S>, usize, u32),
    (batch, active): (usize, u32),
    work: &mut BlockWork,
) {
    let mut hit = hit;
    while hit != 0 {
        let lane = hit.trailing_zeros() as usize;
        hit &= hit - 1;
        let extent = work.found.boxes[i].get(lane);
        let lanes = reach.meets(simd, extent) & active;
        if lanes == 0 {
            continue;
        }
        let record = work.found.record(groups, i * LANES + lane);
        let [lanes, _] = record.before(simd, &work.receivers[batch], lanes);
        if lanes != 0 {
            work.met.push(extent, i * LANES + lane, lanes);
        }
    }
}

/// Of a batch, those receivers of which the triangles that were met leave samples in question, and those from which one of
/// them hides all of the light. Of each triangle only the receivers of which it leaves some stay in question.
#[inline(always)]
fn over_light<S: Simd>(simd: S, light: &LightLanes, batch: usize, work: &mut BlockWork) -> [u32; 2] {
    let receivers = &work.receivers[batch];
    let size = f32x16::from_slice(simd, &receivers.size);
    let bound = f32x16::from_slice(simd, &receivers.edge_error) * f32x16::splat(simd, 2.0)
        + light.light_box.slacks(simd, size);
    let [mut mixed, mut covered] = [0; 2];
    for (&found, lanes) in work.met.found.iter().zip(&mut work.met.lanes) {
        let record = work.found.copied(found as usize);
        let [some, all] = record.over_light(simd, receivers, (light.light_box, bound), *lanes);
        *lanes = some;
        mixed |= some;
        covered |= all;
    }
    [mixed, covered]
}

/// Tests the bundle of a slot, from the receivers `active`, against those triangles whose boxes it meets.
#[inline(always)]
fn test_slot<S: Simd>(
    simd: S,
    light: &LightLanes,
    (batch, slot): (usize, usize),
    active: u32,
    work: &mut BlockWork,
) {
    let (receivers, answers) = (&work.receivers[batch], &mut work.answers[batch]);
    let all = work.points.lanes[slot] & active;
    let (mut open, sample) = (all, &work.points.sample[slot]);
    if all == 0 {
        return;
    }
    let rays = &mut work.rays;
    rays.set(simd, receivers, light.light_box, &work.points.offsets[slot]);
    let met = &work.met;
    for (i, lanes) in met.lanes.chunks(LANES).enumerate() {
        let mut hit = overlapped(simd, &met.boxes[i], &work.bundles[slot]);
        hit &= u32::MAX >> (32 - lanes.len());
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let asking = open & lanes[lane];
            if asking == 0 {
                continue;
            }
            work.tests += 1;
            let record = work.found.copied(met.found[i * LANES + lane] as usize);
            let [sure, mut perhaps] = record.hides(simd, receivers, light.light_box, rays, asking);
            open &= !sure;
            while perhaps != 0 {
                let lane = perhaps.trailing_zeros();
                perhaps &= perhaps - 1;
                answers.unsure.push(Unsure {
                    sample: u32::from(sample[lane as usize]),
                    lane,
                    prim: record.prim,
                });
            }
        }
        if open == 0 {
            break;
        }
    }
    let mut closed = all & !open;
    while closed != 0 {
        let lane = closed.trailing_zeros() as usize;
        closed &= closed - 1;
        answers.open[usize::from(sample[lane])] &= !(1 << lane);
    }
}

/// Closes all samples of these receivers.
fn close_lanes(lanes: u32, answers: &mut Answers) {
    if lanes != 0 {
        answers.open.iter_mut().for_each(|open| *open &= !lanes);
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
