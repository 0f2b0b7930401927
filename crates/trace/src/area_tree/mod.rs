//! The tree of one area light, in the perspective space of the light (HM08 §5.3; Hunt and Mark's adaptive structures).
//!
//! HM08 asks for soft shadows with a 3-D perspective grid and packets of four rays that leave one receiver. Here the
//! perspective space has a hierarchy, since triangles near a light and large ones reach over many cells, and what is
//! asked is a block: 256 neighbouring receivers with all their samples. A search finds the triangles whose boxes
//! may come between the block and the light, where rays drift sideways the less the nearer a triangle is to the
//! receivers; where there are none, receivers are lit without a sample having been made. The rest is culled
//! against the shaft of each 64 receivers, which may show that they are dark as a whole ([`crate::kernel::cover`]), and
//! tested for each sixteen: a triangle against one sample of each, of those samples whose bundle of rays meets its box
//! ([`crate::kernel::bundles`], [`crate::kernel::lines`]). Samples that are decided are not tested again. Pixels of a tile are
//! receivers made in lanes ([`TileSamples`]); any receivers may be asked for one by one ([`AreaLightTree::visible`]).
//!
//! Answers: exactly those of [`crate::BruteForce::visible_samples`], bit for bit. Kernels filter with error bounds;
//! pairs within them are decided by [`crate::exact`].
//!
//! Layout: 1.5 KB for sixteen triangles and 0.4 KB for their boxes, some 120 bytes a triangle; 90 more a triangle while
//! building. Spheres have six trees, with one sixth of the triangles each and those that reach over. Rebuilt every
//! frame. Limits: where coordinates pass 1e30, or there are more than 2^30 triangles, each is tested exactly.

mod build;
mod frame;
mod pixels;

use glam::DVec3;

use crate::kernel::area::{BATCHES, BlockWork, LightLanes, TreeLanes, query};
use crate::kernel::cover::Surfaces;
use crate::kernel::lines::{Answers, Group};
use crate::kernel::shaft::Boxes;
use crate::kernel::{LANES, SimdLevel};
use crate::light_grid::CastRule;
use crate::{AreaLight, Light, Receiver, Samples, Topology, Triangles, exact};
use build::MOST_TRIANGLES;
use frame::{Frame, Local};
pub use pixels::{SeenTile, TileSamples};

/// Coordinates beyond this are not put into a tree.
const LARGEST: f64 = 1e30;

/// Receivers that are searched for together.
const BLOCK: usize = BATCHES * LANES;

/// Receivers farther off than this many extents of the geometry are tested exactly.
const FAR_RECEIVER: f64 = 1e12;

/// An area light's tree over one frame's triangles.
#[derive(Clone, Debug)]
pub struct AreaLightTree<'a> {
    light: AreaLight,
    triangles: Triangles<'a>,
    level: SimdLevel,
    neighbours: &'a [[u32; 3]],
    local: Option<Local>,
    faces: Vec<Face>,
    /// Casters to be tested one by one, where there is no tree.
    unsorted: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Face {
    frame: Frame,
    levels: Vec<Vec<Boxes>>,
    groups: Vec<Group>,
    references: usize,
    /// A bit for each triangle that takes part.
    present: Vec<u64>,
}

/// What became of the samples asked about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaCounts {
    /// Receivers.
    pub receivers: u64,
    /// Samples asked about.
    pub samples: u64,
    /// Those found lit without a test, or dark because the light shines elsewhere.
    pub untested: u64,
    /// Receivers that were found dark as a whole, by one triangle or a sheet that hides all of the light.
    pub covered: u64,
    /// Nodes searched, for up to 256 receivers each.
    pub nodes: u64,
    /// Triangles tested against a sample of each of sixteen receivers.
    pub tests: u64,
    /// Samples of receivers and triangles decided exactly.
    pub exact_pairs: u64,
}

/// Working memory of one thread for queries of area lights.
#[derive(Clone, Debug, Default)]
pub struct AreaScratch {
    work: BlockWork,
    /// Totals of all queries made with this memory.
    pub counts: AreaCounts,
}

impl<'a> AreaLightTree<'a> {
    /// Builds the tree, on all threads of the current rayon pool.
    pub fn build(light: AreaLight, triangles: Triangles<'a>, rule: CastRule, level: SimdLevel) -> Self {
        let mut tree = Self {
            light,
            triangles,
            level,
            neighbours: &[],
            local: None,
            faces: Vec::new(),
            unsorted: Vec::new(),
        };
        let Some((min, max)) = bounds(&triangles).filter(|_| light.is_valid()) else {
            return tree;
        };
        let half = light.half_box().as_dvec3();
        let largest = min.abs().max(max.abs()).max(light.center.as_dvec3().abs() + half);
        if largest.max_element() > LARGEST || triangles.len() >= MOST_TRIANGLES {
            let casts = |&prim: &u32| rule(prim) != crate::Casts::Nothing;
            let finite = |&prim: &u32| triangles.corners(prim).iter().all(|c| c.is_finite());
            tree.unsorted = (0..triangles.len() as u32).filter(finite).filter(casts).collect();
            return tree;
        }
        let local = Local::new(&light, min, max);
        tree.local = Some(local);
        tree.faces = frame::frames(&light, &local, min, max)
            .into_iter()
            .map(|frame| Face::build(frame, &local, &light, &triangles, rule, level))
            .collect();
        tree
    }

    /// Tells the tree which triangles hang together, so that many small ones can hide the light as one large one does.
    /// It changes no answer.
    ///
    /// # Panics
    /// If the topology is not that of as many triangles.
    pub fn with_topology(mut self, topology: &'a Topology) -> Self {
        self.neighbours = topology.neighbours();
        assert_eq!(self.neighbours.len(), self.triangles.len(), "of these triangles");
        self
    }

    /// The light.
    pub fn light(&self) -> &AreaLight {
        &self.light
    }

    /// Nodes of all trees: sixteen boxes each.
    pub fn node_count(&self) -> usize {
        self.faces.iter().flat_map(|f| &f.levels).map(Vec::len).sum()
    }

    /// Triangles in all trees; those whose plane crosses the light count twice.
    pub fn reference_count(&self) -> usize {
        self.faces.iter().map(|f| f.references).sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let groups: usize = self
            .faces
            .iter()
            .map(|f| f.groups.len() * size_of::<Group>())
            .sum();
        groups + self.node_count() * size_of::<Boxes>()
    }

    /// For each receiver, which samples of the light it sees: [`Samples::words`] words each, one bit a sample.
    /// `pixels` has the pixel of each receiver. Neighbours in the list should be neighbours in space: each 256 are
    /// searched for together, each 64 culled for, and each sixteen tested; points that are not finite fill
    /// up and count nowhere.
    ///
    /// # Panics
    /// If there are not as many pixels as receivers.
    pub fn visible(
        &self,
        receivers: &[Receiver],
        pixels: &[u32],
        samples: &Samples,
        scratch: &mut AreaScratch,
        bits: &mut Vec<u32>,
    ) {
        assert_eq!(receivers.len(), pixels.len(), "a pixel for each receiver");
        bits.clear();
        bits.resize(receivers.len() * samples.words(), 0);
        let blocks = receivers.chunks(BLOCK).zip(pixels.chunks(BLOCK));
        for ((receivers, pixels), bits) in blocks.zip(bits.chunks_mut(BLOCK * samples.words())) {
            self.block(receivers, pixels, samples, scratch, bits);
        }
    }

    fn block(
        &self,
        receivers: &[Receiver],
        pixels: &[u32],
        samples: &Samples,
        scratch: &mut AreaScratch,
        bits: &mut [u32],
    ) {
        let work = &mut scratch.work;
        let mut asking = Asking::default();
        let batches = || receivers.chunks(LANES).zip(pixels.chunks(LANES)).enumerate();
        for (batch, (receivers, pixels)) in batches() {
            for (lane, receiver) in receivers.iter().enumerate() {
                if !receiver.point.is_finite() {
                    continue;
                }
                asking.all[batch] |= 1 << lane;
                if self.light.shines_at(receiver.point) {
                    let fits = match &self.local {
                        Some(local) => place(&self.light, local, receiver, [batch, lane], work),
                        None => self.unsorted.is_empty(),
                    };
                    let lanes = if fits { &mut asking.near } else { &mut asking.far };
                    lanes[batch] |= 1 << lane;
                }
            }
            work.askers[batch].pixel[..pixels.len()].copy_from_slice(pixels);
        }
        self.answer(
            &asking,
            samples,
            &|batch, lane| receivers[batch * LANES + lane],
            scratch,
        );
        for (batch, _) in batches() {
            let words = samples.words();
            let bits = &mut bits[batch * LANES * words..];
            for (k, &open) in scratch.work.answers[batch].open.iter().enumerate() {
                let mut open = open;
                while open != 0 {
                    bits[open.trailing_zeros() as usize * words + k / 32] |= 1 << (k % 32);
                    open &= open - 1;
                }
            }
        }
    }

    /// Answers for receivers that are in lanes: which samples of each are seen, in the block's work. `receiver` gives one by
    /// batch and lane.
    fn answer(
        &self,
        asking: &Asking,
        samples: &Samples,
        receiver: &dyn Fn(usize, usize) -> Receiver,
        scratch: &mut AreaScratch,
    ) {
        let Asking { all, near, far } = asking;
        let work = &mut scratch.work;
        for (batch, answers) in work.answers.iter_mut().enumerate() {
            answers.unsure.clear();
            answers.open.clear();
            answers
                .open
                .resize(samples.count() as usize, near[batch] | far[batch]);
        }
        let asked = self.ask(samples, *near, work);
        let counts = &mut scratch.counts;
        for (batch, answers) in work.answers.iter_mut().enumerate() {
            if all[batch] == 0 {
                continue;
            }
            let pixels = &work.askers[batch].pixel;
            let receiver = |lane: usize| receiver(batch, lane);
            counts.exact_pairs += self.resolve(&receiver, pixels, samples, answers);
            if far[batch] != 0 {
                self.test_all(&receiver, pixels, samples, far[batch], &mut answers.open);
            }
            let tested = far[batch] | if asked & (1 << batch) == 0 { 0 } else { near[batch] };
            let [asking, tested] = [all[batch], tested].map(|lanes| u64::from(lanes.count_ones()));
            let samples = u64::from(samples.count());
            counts.receivers += asking;
            counts.samples += asking * samples;
            counts.untested += (asking - tested) * samples;
        }
        counts.nodes += std::mem::take(&mut work.nodes);
        counts.tests += std::mem::take(&mut work.tests);
        counts.covered += std::mem::take(&mut work.covered);
    }

    /// Has the kernels close what they can of the receivers `near`; returns a bit for each batch in which there was
    /// something to test.
    fn ask(&self, samples: &Samples, near: [u32; BATCHES], work: &mut BlockWork) -> u32 {
        let Some(local) = &self.local else { return 0 };
        let light = LightLanes {
            light: &self.light,
            light_box: &local.light,
            samples,
            unit: if self.light.is_sun() {
                1.0
            } else {
                local.unit as f32
            },
        };
        let mut asked = 0;
        for (index, face) in self.faces.iter().enumerate() {
            let mut lanes = near;
            if self.faces.len() > 1 {
                for (lanes, askers) in lanes.iter_mut().zip(&work.askers) {
                    *lanes = lanes_of(index, &askers.offset, *lanes);
                }
            }
            if lanes != [0; BATCHES] && !face.groups.is_empty() {
                asked |= query(
                    self.level,
                    &face.lanes(&self.triangles, self.neighbours),
                    &light,
                    lanes,
                    work,
                );
            }
        }
        asked
    }

    /// Decides the unsure pairs; returns how many were left to decide.
    fn resolve(
        &self,
        receiver: &dyn Fn(usize) -> Receiver,
        pixels: &[u32; LANES],
        samples: &Samples,
        answers: &mut Answers,
    ) -> u64 {
        let mut decided = 0;
        for unsure in &answers.unsure {
            let (open, lane) = (&mut answers.open[unsure.sample as usize], unsure.lane as usize);
            if *open & 1 << lane == 0 {
                continue;
            }
            decided += 1;
            let receiver = receiver(lane);
            let end = self
                .light
                .sample(samples, pixels[lane], receiver.point, unsure.sample);
            if exact::shadows(&self.triangles, unsure.prim, &receiver, &end) {
                *open &= !(1 << lane);
            }
        }
        decided
    }

    /// Tests receivers exactly against every caster.
    fn test_all(
        &self,
        receiver: &dyn Fn(usize) -> Receiver,
        pixels: &[u32; LANES],
        samples: &Samples,
        lanes: u32,
        open: &mut [u32],
    ) {
        for lane in (0..LANES).filter(|lane| lanes & (1 << lane) != 0) {
            let receiver = receiver(lane);
            for (k, open) in open.iter_mut().enumerate() {
                let end: Light = self.light.sample(samples, pixels[lane], receiver.point, k as u32);
                let hides = |prim: u32| exact::shadows(&self.triangles, prim, &receiver, &end);
                let in_trees = self.faces.iter().flat_map(Face::prims);
                if self.unsorted.iter().copied().chain(in_trees).any(hides) {
                    *open &= !(1 << lane);
                }
            }
        }
    }
}

/// The receivers of a block, a bit each, by batch.
#[derive(Clone, Copy, Debug, Default)]
struct Asking {
    /// All.
    all: [u32; BATCHES],
    /// Those that the light shines at and that are in lanes.
    near: [u32; BATCHES],
    /// Those that the light shines at and that are too far off for that.
    far: [u32; BATCHES],
}

/// Those of the lanes whose receivers are in a face of the cube. Neighbouring faces overlap by more than rounding of these
/// offsets does.
fn lanes_of(face: usize, offset: &[[f32; LANES]; 3], lanes: u32) -> u32 {
    let within = |lane: &usize| {
        let from = DVec3::from(offset.map(|v| f64::from(v[*lane])));
        lanes & (1 << lane) != 0 && frame::face_of(from) == face
    };
    (0..LANES).filter(within).fold(0, |bits, lane| bits | 1 << lane)
}

/// Puts a receiver into a lane; `false` if it is too far off for f32.
#[inline]
fn place(
    light: &AreaLight,
    local: &Local,
    receiver: &Receiver,
    [batch, lane]: [usize; 2],
    work: &mut BlockWork,
) -> bool {
    let p = (receiver.point - local.origin.as_dvec3()) * local.unit;
    let fits = p.abs().max_element() < FAR_RECEIVER;
    let p = p.as_vec3();
    let size = p.abs().max_element();
    let lanes = &mut work.receivers[batch];
    for axis in 0..3 {
        lanes.p[axis][lane] = p[axis];
    }
    lanes.size[lane] = size;
    [lanes.edge_error[lane], lanes.plane_error[lane]] =
        local.light.errors(size, (receiver.error * local.unit) as f32);
    lanes.own[lane] = receiver.prim;
    let offset = (receiver.point - light.center.as_dvec3()).as_vec3();
    for axis in 0..3 {
        work.askers[batch].offset[axis][lane] = offset[axis];
    }
    fits
}

impl Face {
    fn build(
        frame: Frame,
        local: &Local,
        light: &AreaLight,
        triangles: &Triangles,
        rule: CastRule,
        level: SimdLevel,
    ) -> Self {
        let entries = build::entries(&frame, light, triangles, rule, level);
        let sorted = build::sort(&entries);
        let (levels, groups) = build::tree(&entries, &sorted, triangles, local, level);
        let present = build::present(&entries, triangles.len());
        Self {
            present,
            frame,
            levels,
            groups,
            references: entries.len(),
        }
    }

    /// Triangles of the tree; the last group may have lanes to spare.
    fn prims(&self) -> impl Iterator<Item = u32> {
        self.groups
            .iter()
            .flat_map(|group| group.prim)
            .take(self.references)
    }

    fn lanes<'t>(&'t self, triangles: &'t Triangles<'t>, neighbours: &'t [[u32; 3]]) -> TreeLanes<'t> {
        TreeLanes {
            surfaces: Surfaces {
                triangles,
                neighbours,
                groups: &self.groups,
                present: &self.present,
            },
            frame: &self.frame.lanes,
            levels: &self.levels,
            groups: &self.groups,
        }
    }
}

/// Smallest and largest coordinates of all finite vertices.
fn bounds(triangles: &Triangles) -> Option<(DVec3, DVec3)> {
    let range = |values: &[f32]| {
        let finite = values.iter().filter(|v| v.is_finite());
        finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| {
            (low.min(v), high.max(v))
        })
    };
    let axes = [triangles.x, triangles.y, triangles.z].map(range);
    let known = !triangles.is_empty() && axes.iter().all(|(low, high)| low <= high);
    known.then(|| {
        let corner = |at: fn((f32, f32)) -> f32| DVec3::from(axes.map(|a| f64::from(at(a))));
        (corner(|a| a.0), corner(|a| a.1))
    })
}

#[cfg(test)]
mod tests;
