//! [`Ldc`]: the layered depth cube (VMV07), the scene resampled into three stacks of layered depth images.
//!
//! Every triangle goes to the one of three axis-aligned rasters that it faces most, as a sample in every texel it
//! covers; a texel keeps its samples sorted by depth, the layers. An arbitrary ray is followed through the three
//! rasters in turn, the one it runs along most first, by a 2-D DDA over min/max tiles and texels; a hit shortens it
//! for the rasters that remain. Rebuilding is two sweeps over the triangles without a sort of the scene, so it suits
//! scenes that change in every frame.
//!
//! Two kinds of answers:
//!
//! - By samples ([`Ldc::closest_sampled`]), as in the paper: the cube stands for the scene. See [`HitTest`].
//! - Exact ([`Accel`]): with conservative coverage a texel's samples name all triangles over it, and
//!   [`crate::exact`] decides on those whose plane the ray crosses there. Answers equal [`crate::BruteForce`]'s bit
//!   for bit.
//!
//! A frame of an animation may have two of them, one of what has stood still so far and is kept ([`StillCube`]), one of
//! what moves; a ray is followed through the one it enters first, and what it meets there shortens it for the other.
//!
//! Layout: 8 bytes a texel, 8 or 10 bytes a sample (`ldc/samples.rs`), 16 bytes a cell (`ldc/levels.rs`); texels in
//! tiles of 8 x 8. Limits: rays that start more than 2^36 texels away test every triangle; triangles much larger than
//! the scene's rest leave all of that in few texels, which stays right but slow.

mod build;
mod frame;
mod levels;
mod raster;
mod sampled;
mod samples;
mod still;
mod surface;
#[cfg(test)]
mod tests;
mod walk;

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec3;

pub use frame::{Clipped, CubeFrame, TILE, TexelRay};
pub use levels::Hierarchy;
pub use raster::Coverage;
pub use sampled::HitTest;
pub use samples::{DepthFormat, TexelSample};
pub use still::{StillCube, Stillness};
pub use walk::{StepCounts, Steps};

use crate::brute::{hit_in_range, rounded, write_sorted};
use crate::exact::{ExactHit, Filter};
use crate::{Accel, BuildStats, Hit, Light, Ray, Receiver, Triangles};
use build::Stack;
use frame::widened;
use raster::{NO_PLANE, REACH};
use samples::{Depth, Layers, Samples};
use walk::{Reach, walk};

/// How samples are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LdcBuild {
    /// One sweep: count, scan, fill, sort.
    Csr(Coverage),
    /// VMV07: a pass to count layers, then one for each; covers texel centres. The same samples as the sweep, for
    /// comparison.
    Peel,
}

impl LdcBuild {
    fn coverage(self) -> Coverage {
        match self {
            Self::Csr(coverage) => coverage,
            Self::Peel => Coverage::Centre,
        }
    }
}

/// Parameters of a cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LdcOptions {
    /// Texels along the longest side of the scene's box, 16 to 4096.
    pub resolution: u32,
    /// How samples are made.
    pub build: LdcBuild,
    /// How their depth is stored.
    pub depth: DepthFormat,
    /// What lies above the texels.
    pub hierarchy: Hierarchy,
    /// The resolution is halved until there are no more samples than this, by an estimate.
    pub max_samples: u64,
}

impl Default for LdcOptions {
    fn default() -> Self {
        Self {
            resolution: 512,
            build: LdcBuild::Csr(Coverage::Conservative),
            depth: DepthFormat::F32,
            hierarchy: Hierarchy::Pyramid,
            max_samples: 1 << 26,
        }
    }
}

impl LdcOptions {
    /// As VMV07 had it: peeled, 16-bit float depth, one level of tiles. The paper does not say how large these are;
    /// 8 x 8 here.
    pub fn paper(resolution: u32) -> Self {
        Self {
            resolution,
            build: LdcBuild::Peel,
            depth: DepthFormat::F16,
            hierarchy: Hierarchy::Tiles { log2: [3; 2] },
            ..Self::default()
        }
    }
}

/// The layered depth cube over the triangles of one frame, or two: of what stands still and of what moves. See the
/// [module](self).
#[derive(Clone, Debug)]
pub struct Ldc<'a> {
    triangles: Triangles<'a>,
    /// One or two.
    cubes: Vec<Arc<Cube>>,
    stats: BuildStats,
    /// Triangles whose samples are of this frame.
    rebuilt: usize,
}

/// Three stacks over some of the triangles.
#[derive(Debug)]
struct Cube {
    /// Those that take part.
    prims: Vec<u32>,
    frame: CubeFrame,
    stacks: [Stack; 3],
    /// Whether its samples name every triangle over a texel.
    complete: bool,
}

impl Cube {
    fn over(triangles: &Triangles, prims: Vec<u32>, options: &LdcOptions) -> Self {
        let frame = build::fitting_frame(triangles, &prims, options);
        let stacks = build::build(&frame, triangles, &prims, options);
        Self {
            prims,
            frame,
            stacks,
            complete: options.build == LdcBuild::Csr(Coverage::Conservative),
        }
    }

    fn clip(&self, line: &Line) -> Clipped {
        self.frame.clip(line.origin, line.dir, line.t_min, line.t_max)
    }

    fn bytes(&self) -> usize {
        let stack = |s: &Stack| {
            let cells: usize = s.levels.iter().map(|l| size_of_val(&*l.cells)).sum();
            size_of_val(&*s.texels) + s.samples.bytes() + cells
        };
        size_of_val(&*self.prims) + self.stacks.iter().map(stack).sum::<usize>()
    }

    /// [`Ldc::candidates`] of one cube, for a line clipped to it. Returns whether `visit` broke.
    #[inline(always)]
    fn candidates(
        &self,
        clipped: Clipped,
        t_end: &mut f64,
        steps: &mut impl Steps,
        visit: &mut impl FnMut(u32, &mut f64) -> ControlFlow<()>,
    ) -> bool {
        let inside = match clipped {
            Clipped::Inside(inside) if self.complete => inside,
            Clipped::Misses => return false,
            _ => {
                return self.prims.iter().any(|&prim| {
                    steps.triangle();
                    visit(prim, t_end).is_break()
                });
            }
        };
        // Where the line leaves the cube is no end of it.
        let mut end = inside.t_max.min(*t_end);
        let mut visit = |prim: u32, end: &mut f64| {
            let flow = visit(prim, t_end);
            *end = end.min(*t_end);
            flow
        };
        for axis in axis_order(inside.dir) {
            let stack = &self.stacks[axis];
            let broken = match &stack.samples {
                Samples::F16(s) => crossed(stack, s, &inside, &mut end, steps, &mut visit),
                Samples::U16(s) => crossed(stack, s, &inside, &mut end, steps, &mut visit),
                Samples::F32(s) => crossed(stack, s, &inside, &mut end, steps, &mut visit),
            };
            if broken {
                return true;
            }
        }
        false
    }
}

/// Where a clipped line enters; what cannot be clipped comes first.
fn entry(clipped: &Clipped) -> f64 {
    match clipped {
        Clipped::Inside(inside) => inside.t_min,
        Clipped::Misses => f64::INFINITY,
        Clipped::TooFar => f64::NEG_INFINITY,
    }
}

/// Directions in the order they are searched: the one along which the ray runs most has the shortest way through
/// its raster.
fn axis_order(dir: DVec3) -> [usize; 3] {
    let d = dir.abs();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| d[b].total_cmp(&d[a]));
    order
}

/// A line whose triangles are asked for.
struct Line {
    origin: DVec3,
    dir: DVec3,
    t_min: f64,
    t_max: f64,
}

impl Line {
    fn of(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            dir: ray.dir.as_dvec3(),
            t_min: f64::from(ray.t_min),
            t_max: f64::from(ray.t_max),
        }
    }

    fn is_valid(&self) -> bool {
        self.origin.is_finite() && self.dir.is_finite() && self.dir != DVec3::ZERO
    }
}

impl<'a> Ldc<'a> {
    /// Builds over all triangles that are finite and have area, in parallel; the same for any number of threads.
    pub fn build(triangles: Triangles<'a>, options: &LdcOptions) -> Self {
        let (prims, stats) = build::usable(&triangles);
        Self {
            triangles,
            cubes: vec![Arc::new(Cube::over(&triangles, prims, options))],
            rebuilt: stats.triangles,
            stats,
        }
    }

    /// What was built and what was left out.
    pub fn stats(&self) -> BuildStats {
        self.stats
    }

    /// Triangles whose samples were made for this frame, not kept from one before.
    pub fn rebuilt(&self) -> usize {
        self.rebuilt
    }

    /// Side of a texel, in units of the triangles.
    pub fn texel_size(&self) -> f64 {
        self.frame().side
    }

    /// Texels along each axis, margins included; of the first cube if there are two.
    pub fn size(&self) -> [u32; 3] {
        self.frame().size
    }

    /// Where the cube lies; the first if there are two.
    pub fn frame(&self) -> CubeFrame {
        self.cubes[0].frame
    }

    /// Texels of all directions.
    pub fn texels(&self) -> usize {
        let stacks = self.cubes.iter().flat_map(|cube| &cube.stacks);
        stacks.map(|stack| stack.raster.texels()).sum()
    }

    /// All samples of one direction, by texel in memory order, then by depth; of the first cube if there are two.
    pub fn texel_samples(&self, axis: usize) -> Vec<TexelSample> {
        let stack = &self.cubes[0].stacks[axis];
        match &stack.samples {
            Samples::F16(s) => samples::listed(stack, s),
            Samples::U16(s) => samples::listed(stack, s),
            Samples::F32(s) => samples::listed(stack, s),
        }
    }

    /// Samples of each direction.
    pub fn samples(&self) -> [usize; 3] {
        let of = |axis: usize| self.cubes.iter().map(move |cube| cube.stacks[axis].samples.len());
        [0, 1, 2].map(|axis| of(axis).sum())
    }

    /// Samples in the fullest texel of each direction: VMV07's number of layered depth images.
    pub fn layers(&self) -> [u32; 3] {
        let of = |axis: usize| self.cubes.iter().map(move |cube| cube.stacks[axis].layers);
        [0, 1, 2].map(|axis| of(axis).fold(0, u32::max))
    }

    /// Memory of the cube in bytes, the triangles themselves left out.
    pub fn bytes(&self) -> usize {
        self.cubes.iter().map(|cube| cube.bytes()).sum()
    }

    /// [`Accel::intersect`] in f64, counting the work.
    pub fn closest(&self, ray: &Ray, steps: &mut impl Steps) -> Option<(u32, ExactHit)> {
        let filter = Filter::new(ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut best: Option<(u32, ExactHit)> = None;
        let mut seen = Mailbox::default();
        self.candidates(ray.is_valid(), &Line::of(ray), steps, |prim, t_end| {
            if !seen.first(prim) || filter.certain_miss(&self.triangles.corners(prim)) {
                return ControlFlow::Continue(());
            }
            if let Some(hit) = hit_in_range(&self.triangles, prim, ray) {
                let closer = best.is_none_or(|(p, b)| hit.t < b.t || (hit.t == b.t && prim < p));
                if closer {
                    best = Some((prim, hit));
                    *t_end = t_end.min(widened(hit.t));
                }
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// [`Accel::occluded`], counting the work.
    pub fn any(&self, ray: &Ray, steps: &mut impl Steps) -> bool {
        let filter = Filter::new(ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut found = false;
        let mut seen = Mailbox::default();
        self.candidates(ray.is_valid(), &Line::of(ray), steps, |prim, _| {
            found = seen.first(prim)
                && !filter.certain_miss(&self.triangles.corners(prim))
                && hit_in_range(&self.triangles, prim, ray).is_some();
            if found {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        found
    }

    /// [`Accel::shadowed`], counting the work.
    pub fn shadows(&self, receiver: &Receiver, light: &Light, steps: &mut impl Steps) -> bool {
        self.each_shadow(receiver, light, steps, |_| ControlFlow::Break(()))
    }

    /// Calls `visit` with every triangle that the line may meet, some more than once, until it breaks. `visit` may
    /// lower the end of the line through its last argument.
    #[inline(always)]
    fn candidates(
        &self,
        valid: bool,
        line: &Line,
        steps: &mut impl Steps,
        mut visit: impl FnMut(u32, &mut f64) -> ControlFlow<()>,
    ) {
        if !valid {
            return;
        }
        let mut in_order = [None, None];
        for (slot, cube) in in_order.iter_mut().zip(&self.cubes) {
            *slot = Some((cube, cube.clip(line)));
        }
        if let [Some(one), Some(other)] = &in_order
            && entry(&other.1) < entry(&one.1)
        {
            in_order.swap(0, 1);
        }
        let mut t_end = line.t_max;
        for (cube, clipped) in in_order.into_iter().flatten() {
            if cube.candidates(clipped, &mut t_end, steps, &mut visit) {
                return;
            }
        }
    }
}

/// A sample whose plane stays farther than this from the ray within its texel is not crossed: slopes are known to
/// 1/254 over half a texel either way, and samples reach a little beyond their texels.
const PLANE_SLACK: f32 = 1.0 / 127.0 + 4.0 * REACH as f32;

/// How far a sample's plane departs from its depth over the texel: slopes are at most 1 either way. A sample without a
/// plane stands for as much.
pub(crate) const PLANE_REACH: f32 = 1.0 + 1.0 / 64.0;

/// Calls `visit` with the triangles whose planes the ray crosses in the texels of one direction. Returns whether it
/// broke off.
#[inline(always)]
fn crossed<D: Depth>(
    stack: &Stack,
    samples: &Layers<D>,
    ray: &TexelRay,
    t_end: &mut f64,
    steps: &mut impl Steps,
    visit: &mut impl FnMut(u32, &mut f64) -> ControlFlow<()>,
) -> bool {
    let slack = PLANE_SLACK + D::error(stack.scale);
    let mut tests = 0;
    let mut broken = false;
    let reach = Reach {
        cell: 0.0,
        texel: 0.0,
        sample: slack + PLANE_REACH,
    };
    walk(
        stack,
        samples,
        ray,
        t_end,
        reach,
        steps,
        |near, segment, t_end| {
            for sample in near.map(|index| samples.get(index)) {
                let needle = sample.slopes == NO_PLANE;
                let slopes = if needle { [0; 2] } else { sample.slopes };
                let [a, b] = segment.above(sample.depth.texels(stack.scale), slopes);
                let slack = if needle { slack + 1.0 } else { slack };
                if a.min(b) > slack || a.max(b) < -slack {
                    continue;
                }
                tests += 1;
                if visit(sample.prim, t_end).is_break() {
                    broken = true;
                    return ControlFlow::Break(());
                }
            }
            ControlFlow::Continue(())
        },
    );
    for _ in 0..tests {
        steps.triangle();
    }
    broken
}

/// The triangles a ray was tested with last, so that one that lies over several texels is not tested in each.
struct Mailbox([u32; 16]);

impl Default for Mailbox {
    fn default() -> Self {
        Self([u32::MAX; 16])
    }
}

impl Mailbox {
    /// Whether the triangle is not known to have been here.
    #[inline(always)]
    fn first(&mut self, prim: u32) -> bool {
        let slot = &mut self.0[prim as usize % 16];
        let first = *slot != prim;
        *slot = prim;
        first
    }
}

impl Accel for Ldc<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.closest(ray, &mut ()).map(|(prim, hit)| rounded(prim, &hit))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.any(ray, &mut ())
    }

    fn all_hits(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        let mut found = Vec::new();
        self.candidates(ray.is_valid(), &Line::of(ray), &mut (), |prim, _| {
            found.extend(hit_in_range(&self.triangles, prim, ray).map(|hit| (prim, hit)));
            ControlFlow::Continue(())
        });
        found.sort_unstable_by_key(|(prim, _)| *prim);
        found.dedup_by_key(|(prim, _)| *prim);
        write_sorted(found, hits);
    }

    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool {
        self.shadows(receiver, light, &mut ())
    }
}
