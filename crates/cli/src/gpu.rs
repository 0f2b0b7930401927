//! What there is of GPUs, whether the first one answers rays as it should, and frames on it.

use std::sync::Arc;

use glam::Vec3;
use rayward::scene::builtin;
use rayward::trace::{Accel, Bvh, Ray};
use rayward::{CubeBuilder, Renderer, triangles};
use rayward_gpu::{AdapterSummary, Cube, CubeOptions, Gpu, GpuSecondary, adapters};
use serde::Serialize;

use crate::args::RunArgs;
use crate::failure::{Code, Failure};
use crate::report::{self, thousands};
use crate::values::{GpuUse, SecondaryUse};

/// The device that frames are made with, if they are.
pub(crate) struct Device(Option<Arc<GpuSecondary>>, GpuUse);

impl Device {
    /// Opens what was asked for and has the renderer use it.
    pub(crate) fn open(args: &RunArgs, renderer: &mut Renderer) -> Result<Self, Failure> {
        if args.secondary == SecondaryUse::Cube {
            renderer.set_secondary(Arc::new(CubeBuilder::default()));
        }
        let none = Self(None, args.gpu);
        if args.gpu == GpuUse::Off {
            return Ok(none);
        }
        let problem = match Gpu::open(None) {
            Ok(gpu) if args.gpu == GpuUse::On || !gpu.adapter().software => {
                let device = Arc::new(GpuSecondary::new(gpu, CubeOptions::default()));
                renderer.set_secondary(Arc::clone(&device) as Arc<_>);
                return Ok(Self(Some(device), args.gpu));
            }
            Ok(gpu) => format!("{} is software", gpu.adapter().name),
            Err(problem) => problem.to_string(),
        };
        if args.gpu == GpuUse::On {
            return Err(Failure::new(Code::Runtime, problem));
        }
        if !args.quiet {
            report::note(&format!("on the CPU: {}", report::clean(&problem)));
        }
        Ok(none)
    }

    /// Tells what it has done. An error of a device that was to be used is ours, too.
    pub(crate) fn close(&self, quiet: bool) -> Result<(), Failure> {
        let Self(Some(device), asked) = self else {
            return Ok(());
        };
        let name = report::clean(&device.gpu().adapter().name);
        match device.problem() {
            Some(problem) if *asked == GpuUse::On => Err(Failure::new(Code::Runtime, problem)),
            Some(problem) => {
                report::note(&format!("on the CPU: {}", report::clean(&problem.to_string())));
                Ok(())
            }
            None => {
                let stats = device.stats();
                if !quiet {
                    report::note(&format!(
                        "{name}: {} rays, {} of them answered on the CPU",
                        thousands(stats.rays),
                        thousands(stats.unsure)
                    ));
                }
                Ok(())
            }
        }
    }
}

/// The findings; its fields are those of the JSON object.
#[derive(Serialize)]
pub(crate) struct GpuFindings {
    adapters: Vec<AdapterFinding>,
    /// The adapter that is used where a GPU is asked for.
    used: Option<String>,
    /// Why none is.
    off: Option<String>,
}

#[derive(Serialize)]
struct AdapterFinding {
    name: String,
    backend: String,
    driver: String,
    /// Whether it is the CPU in disguise.
    software: bool,
    problem: Option<String>,
}

impl From<AdapterSummary> for AdapterFinding {
    fn from(adapter: AdapterSummary) -> Self {
        Self {
            name: adapter.name,
            backend: adapter.backend,
            driver: adapter.driver,
            software: adapter.software,
            problem: adapter.problem,
        }
    }
}

/// Looks for GPUs and tests the first.
pub(crate) fn findings() -> GpuFindings {
    let tested = test();
    GpuFindings {
        adapters: adapters().into_iter().map(AdapterFinding::from).collect(),
        used: tested.as_ref().ok().cloned(),
        off: tested.err(),
    }
}

/// Builds a small cube and compares its answers; the adapter's name, or what is wrong.
fn test() -> Result<String, String> {
    let gpu = Gpu::open(None).map_err(|e| e.to_string())?;
    let name = gpu.adapter().name.clone();
    let scene = builtin::build("blob-1k").map_err(|e| e.to_string())?;
    let frame = scene.at(0.0);
    let triangles = triangles(&frame);
    let options = CubeOptions {
        resolution: 64,
        ..CubeOptions::default()
    };
    let cube = Cube::build(&gpu, triangles, &options).map_err(|e| e.to_string())?;
    let cpu = Bvh::build(triangles);
    let rays: Vec<Ray> = (0..256u32)
        .map(|i| {
            let [x, y] = [i % 16, i / 16].map(|k| k as f32 * 0.2 - 1.5);
            let from = Vec3::new(x, y, 3.0);
            Ray::new(from, Vec3::new(y * 0.3, 0.5, 0.0) - from)
        })
        .collect();
    let (hits, _) = cube.closest(&rays, &cpu).map_err(|e| e.to_string())?;
    let same = rays
        .iter()
        .zip(&hits)
        .all(|(ray, hit)| *hit == cpu.intersect(ray));
    if same {
        Ok(name)
    } else {
        Err(format!("{name}: its answers are not what they have to be"))
    }
}

impl GpuFindings {
    /// Lines for people.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = self
            .adapters
            .iter()
            .map(|a| {
                let kind = if a.software { ", software" } else { "" };
                let state = match (&a.problem, &self.used) {
                    (Some(problem), _) => format!("cannot be used: {problem}"),
                    (None, Some(used)) if *used == a.name => "passed: exact answers".into(),
                    (None, _) => "not used".into(),
                };
                format!("gpu         {}, {}{kind}: {state}", a.name, a.backend)
            })
            .collect();
        if let Some(off) = &self.off {
            lines.push(format!("gpu         off: {off}"));
        }
        lines
    }
}
