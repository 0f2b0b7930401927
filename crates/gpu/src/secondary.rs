//! The cube as a frame's structure for rays from anywhere to anywhere, and for the hard shadows of all pixels.
//!
//! The hierarchy is built beside it: it answers rays that f32 cannot, batches too small to be worth the way to the
//! device, and what frames ask ray by ray. So a picture is the same with and without a GPU, bit for bit. If the device
//! fails, the hierarchy answers all, and [`GpuSecondary::problem`] says why.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use rayward::trace::ldc::StepCounts;
use rayward::trace::{Bvh, Light, Receiver, SurfaceRay, Triangles, ViewRay};
use rayward::{BuiltTracer, SecondaryBuilder, SecondaryTracer, SurfaceHit};

use crate::{Cube, CubeOptions, Error, Gpu, Result, TraceStats};

/// Rays below which a batch stays on the CPU.
const WORTHWHILE: usize = 256;

/// Builds cubes for frames.
#[derive(Debug)]
pub struct GpuSecondary {
    gpu: Gpu,
    options: CubeOptions,
    done: Mutex<Done>,
}

/// What frames have asked so far.
#[derive(Debug, Default)]
struct Done {
    stats: TraceStats,
    problem: Option<Error>,
}

impl GpuSecondary {
    /// For frames on this device.
    pub fn new(gpu: Gpu, options: CubeOptions) -> Self {
        Self {
            gpu,
            options,
            done: Mutex::default(),
        }
    }

    /// What it runs on.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// Rays traced on the device since it was made.
    pub fn stats(&self) -> TraceStats {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).stats
    }

    /// The first error of the device. From then on the CPU has answered.
    pub fn problem(&self) -> Option<Error> {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done.problem.clone()
    }

    /// Notes how an operation went.
    fn noted<T>(&self, result: Result<T>, stats: impl FnOnce(&T) -> TraceStats) -> Option<T> {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        match result {
            Ok(answer) => {
                let more = stats(&answer);
                done.stats.rays += more.rays;
                done.stats.unsure += more.unsure;
                done.stats.steps = StepCounts {
                    cells: done.stats.steps.cells + more.steps.cells,
                    texels: done.stats.steps.texels + more.steps.texels,
                    samples: done.stats.steps.samples + more.steps.samples,
                    triangles: done.stats.steps.triangles + more.steps.triangles,
                };
                Some(answer)
            }
            Err(problem) => {
                done.problem.get_or_insert(problem);
                None
            }
        }
    }
}

impl SecondaryBuilder for GpuSecondary {
    fn build<'g>(&'g self, triangles: Triangles<'g>) -> BuiltTracer<'g> {
        let cpu = Bvh::build(triangles);
        let built = Cube::build(&self.gpu, triangles, &self.options);
        let cube = self.noted(built, |_| TraceStats::default());
        let size = cube
            .as_ref()
            .map_or([0; 3], |c| c.frame().size.map(|side| side as usize));
        let [width, height, depth] = size;
        BuiltTracer {
            name: "layered depth cube on the GPU",
            bytes: cpu.bytes() + cube.as_ref().map_or(0, |c| c.bytes() as usize),
            cells: width * height + height * depth + depth * width,
            references: cube.as_ref().map_or(0, |c| c.samples() as usize),
            tracer: Arc::new(FrameCube { of: self, cube, cpu }),
        }
    }

    fn takes_shadows(&self) -> bool {
        true
    }
}

/// The cube of one frame; `None` if it could not be built.
#[derive(Debug)]
struct FrameCube<'g> {
    of: &'g GpuSecondary,
    cube: Option<Cube<'g>>,
    cpu: Bvh<'g>,
}

impl FrameCube<'_> {
    /// The cube, for a batch of this many rays.
    fn cube_for(&self, rays: usize) -> Option<&Cube<'_>> {
        let usable = rays >= WORTHWHILE && self.of.problem().is_none();
        self.cube.as_ref().filter(|_| usable)
    }
}

impl SecondaryTracer for FrameCube<'_> {
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>) {
        let answers = self
            .cube_for(rays.len())
            .and_then(|cube| self.of.noted(cube.after(rays, &self.cpu), |a| a.1));
        match answers {
            Some((answers, _)) => *hits = answers,
            None => self.cpu.trace(rays, hits),
        }
    }

    fn each_between(
        &self,
        receiver: &Receiver,
        light: &Light,
        visit: &mut dyn FnMut(u32) -> ControlFlow<()>,
    ) {
        self.cpu.each_between(receiver, light, visit);
    }

    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>) {
        SecondaryTracer::along(&self.cpu, ray, hits);
    }

    fn shadowed(&self, receivers: &[Receiver], light: &Light) -> Option<Vec<bool>> {
        let cube = self.cube_for(receivers.len())?;
        let queries: Vec<(Receiver, Light)> = receivers.iter().map(|r| (*r, *light)).collect();
        let answers = cube.shadowed(&queries, &self.cpu);
        self.of.noted(answers, |a| a.1).map(|a| a.0)
    }
}
