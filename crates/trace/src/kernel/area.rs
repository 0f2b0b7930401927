//! The query of an area light's tree for a block of receivers: search, cull, sample, test.
//!
//! One call is one `dispatch!`, for up to four batches of sixteen receivers. The tree is searched once for all of them,
//! and what is found is culled against the shaft of all; the few triangles that are left are copied together, culled
//! once more against the shaft of each batch, and tested. Samples are made only once a triangle needs them, so a batch
//! that is certainly lit costs its share of the search.

use fearless_simd::{Simd, dispatch};

use super::light_points::{Askers, light_points};
use super::lines::{Answers, CornerLanes, Group, LightBox, ReceiverLanes, candidate, set_up};
use super::shaft::{Bounds, Boxes, FrameLanes, ReceiverBox, Search, culled, overlapped, surface_axes};
use super::{LANES, SimdLevel};
use crate::{AreaLight, Samples};

/// Batches in a block.
pub(crate) const BATCHES: usize = 4;

/// A tree as the kernel walks it: `levels[0]` has a box for each triangle, in groups of sixteen; each further level has
/// one for each sixteen of the level before. The last has one group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TreeLanes<'t> {
    pub(crate) frame: &'t FrameLanes,
    pub(crate) levels: &'t [Vec<Boxes>],
    pub(crate) groups: &'t [Group],
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
    points: Vec<[[f32; LANES]; 3]>,
    stack: Vec<(u32, u32)>,
    found: Vec<Group>,
    /// Nodes searched: sixteen boxes each.
    pub(crate) nodes: u64,
    /// Triangles that some receiver of a batch may have to be tested against.
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
    let mut bounds: Option<Bounds> = None;
    let (mut axes, mut most) = ([[0.0; 3]; 3], 0);
    for (receivers, &active) in work.receivers.iter().zip(&active) {
        if active != 0 {
            let batch = Bounds::of(simd, tree.frame, receivers, active);
            bounds = Some(bounds.map_or(batch, |all| all.union(&batch)));
        }
        if active.count_ones() > most {
            most = active.count_ones();
            axes = surface_axes(receivers, active);
        }
    }
    let Some(bounds) = bounds else { return 0 };
    let block = ReceiverBox::of(simd, axes, &work.receivers, &active);
    let found = search(simd, tree, light, &Search::new(tree.frame, &bounds), &block, work);
    let mut asked = 0;
    if found != 0 {
        for (batch, &active) in active.iter().enumerate() {
            if active != 0 && test_batch(simd, light, batch, active, found, work) {
                asked |= 1 << batch;
            }
        }
    }
    asked
}

/// Copies the triangles that may come between a block of receivers and the light together; returns how many.
#[inline(always)]
fn search<S: Simd>(
    simd: S,
    tree: &TreeLanes,
    light: &LightLanes,
    search: &Search,
    block: &ReceiverBox,
    work: &mut BlockWork,
) -> usize {
    let mut found = 0;
    work.stack.clear();
    work.stack.push((tree.levels.len() as u32 - 1, 0));
    while let Some((depth, index)) = work.stack.pop() {
        work.nodes += 1;
        let mut hit = overlapped(simd, &tree.levels[depth as usize][index as usize], search);
        if depth > 0 {
            // The first child last, to be popped first.
            while hit != 0 {
                let child = 31 - hit.leading_zeros();
                hit &= !(1 << child);
                work.stack.push((depth - 1, index * LANES as u32 + child));
            }
            continue;
        }
        if hit == 0 {
            continue;
        }
        let group = &tree.groups[index as usize];
        hit = culled(simd, group, light.light_box, block, hit);
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            if found / LANES == work.found.len() {
                work.found.push(Group::default());
            }
            work.found[found / LANES].copy(found % LANES, group, lane);
            found += 1;
        }
    }
    found
}

/// Tests a batch against the first `found` triangles that a search copied together; returns whether any came into
/// question.
#[inline(always)]
fn test_batch<S: Simd>(
    simd: S,
    light: &LightLanes,
    batch: usize,
    active: u32,
    found: usize,
    work: &mut BlockWork,
) -> bool {
    let receivers = &work.receivers[batch];
    let axes = surface_axes(receivers, active);
    let shape = ReceiverBox::of(simd, axes, std::slice::from_ref(receivers), &[active]);
    let answers = &mut work.answers[batch];
    let (mut left, mut sampled, mut asked) = (active, false, false);
    for (i, group) in work.found.iter().take(found.div_ceil(LANES)).enumerate() {
        let lanes = (found - i * LANES).min(LANES) as u32;
        let mut hit = culled(simd, group, light.light_box, &shape, u32::MAX >> (32 - lanes));
        while hit != 0 {
            let lane = hit.trailing_zeros() as usize;
            hit &= hit - 1;
            let Some(candidate) = candidate(simd, receivers, group, lane, light.light_box, left) else {
                continue;
            };
            work.tests += 1;
            asked = true;
            if candidate.needs_samples() && !sampled {
                sampled = true;
                let askers = &work.askers[batch];
                light_points(
                    simd,
                    light.light,
                    light.samples,
                    askers,
                    light.unit,
                    &mut work.points,
                );
            }
            // Where no sample is needed, there has to be one of each all the same.
            work.points
                .resize(light.samples.count() as usize, [[0.0; LANES]; 3]);
            left = active & candidate.test(simd, receivers, light.light_box, &work.points, answers);
            if left == 0 {
                return true;
            }
        }
    }
    asked
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
