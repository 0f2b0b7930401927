//! The cube as a frame's structure for rays from anywhere to anywhere, and for what all pixels see and their shadows, hard
//! and soft.
//!
//! Eye rays and rays to lights without a size go through perspective grids of their vantages ([`GpuGrid`]), unless the cube is
//! to answer these, too ([`Through`]).
//!
//! The hierarchy is built beside them: it answers rays that f32 cannot, batches too small to be worth the way to the
//! device, and what frames ask ray by ray. So a picture that the CPU shades is the same with and without a GPU, bit for bit; see
//! [`crate::GpuShading`] for others. If the device
//! fails, the hierarchy answers all, and [`GpuSecondary::problem`] says why.

use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use rayward::trace::ldc::StepCounts;
use rayward::trace::{Accel, Bvh, Light, Receiver, SurfaceRay, Triangles, View, ViewRay};
use rayward::{BuiltTracer, SecondaryBuilder, SecondaryTracer, SurfaceHit};

use crate::ldc::StillCube;
use crate::{Cube, CubeOptions, Error, Gpu, GpuGrid, GridGeometry, Result, TraceStats};

/// Rays below which a batch stays on the CPU.
const WORTHWHILE: usize = 256;

/// What answers rays that share an origin or a direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Through {
    /// A perspective grid for each vantage.
    #[default]
    Grids,
    /// The cube, as for all other rays.
    Cube,
}

/// Builds cubes for frames.
#[derive(Debug)]
pub struct GpuSecondary {
    gpu: Gpu,
    options: CubeOptions,
    through: Through,
    still: Mutex<StillCube>,
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
            through: Through::default(),
            still: Mutex::default(),
            done: Mutex::default(),
        }
    }

    /// The same, with eye rays and rays to lights without a size going this way.
    pub fn with_vantages(self, through: Through) -> Self {
        Self { through, ..self }
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
        let mut still = self.still.lock().unwrap_or_else(PoisonError::into_inner);
        let built = still.build(&self.gpu, triangles, &self.options);
        drop(still);
        let cube = self.noted(built, |_| TraceStats::default());
        let sent = (self.through == Through::Grids).then(|| GridGeometry::new(&self.gpu, triangles));
        let grids = sent.and_then(|sent| self.noted(sent, |_| TraceStats::default()));
        let kept = cube.as_ref().is_some_and(|c| c.rebuilt() < c.stats().triangles);
        BuiltTracer {
            name: if kept {
                "layered depth cube on the GPU, what stands still kept"
            } else {
                "layered depth cube on the GPU"
            },
            bytes: cpu.bytes() + cube.as_ref().map_or(0, |c| c.bytes() as usize),
            cells: cube.as_ref().map_or(0, |c| c.texels() as usize),
            references: cube.as_ref().map_or(0, |c| c.samples() as usize),
            tracer: Arc::new(FrameCube {
                of: self,
                cube,
                grids,
                cpu,
            }),
        }
    }

    fn takes_arrays(&self) -> bool {
        true
    }
}

/// The cube of one frame; `None` if it could not be built.
#[derive(Debug)]
struct FrameCube<'g> {
    of: &'g GpuSecondary,
    cube: Option<Cube<'g>>,
    /// What grids of vantages are built over, if they answer.
    grids: Option<GridGeometry<'g>>,
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

    fn seen(&self, view: &View, pixels: &[[u32; 2]]) -> Option<Vec<Option<u32>>> {
        let cube = self.cube_for(pixels.len())?;
        if let Some(geometry) = &self.grids {
            let grid = GpuGrid::of_camera(geometry, view);
            let answers = grid.and_then(|grid| grid.seen(pixels, &self.cpu));
            return self.of.noted(answers, |a| a.1).map(|a| a.0);
        }
        let rays: Vec<ViewRay> = pixels.iter().map(|&[x, y]| view.pixel_ray(x, y)).collect();
        let answers = cube.seen(&rays, &self.cpu);
        self.of.noted(answers, |a| a.1).map(|a| a.0)
    }

    fn shadowed(&self, receivers: &[Receiver], light: &Light) -> Option<Vec<bool>> {
        let cube = self.cube_for(receivers.len())?;
        if let Some(geometry) = &self.grids {
            let answers = GpuGrid::of_light(geometry, light).and_then(|grid| {
                grid.map(|grid| grid.shadowed(receivers, light, &self.cpu))
                    .transpose()
            });
            if let Some(answers) = self
                .of
                .noted(answers, |a| a.as_ref().map_or_else(TraceStats::default, |a| a.1))?
            {
                return Some(answers.0);
            }
        }
        let queries: Vec<(Receiver, Light)> = receivers.iter().map(|r| (*r, *light)).collect();
        let answers = cube.shadowed(&queries, &self.cpu);
        self.of.noted(answers, |a| a.1).map(|a| a.0)
    }

    fn hidden(&self, queries: &[(Receiver, Light)]) -> Option<Vec<bool>> {
        let answers = self
            .cube_for(queries.len())
            .and_then(|cube| self.of.noted(cube.shadowed(queries, &self.cpu), |a| a.1));
        let on_cpu = || {
            queries
                .iter()
                .map(|(r, l)| Accel::shadowed(&self.cpu, r, l))
                .collect()
        };
        Some(answers.map_or_else(on_cpu, |a| a.0))
    }
}
