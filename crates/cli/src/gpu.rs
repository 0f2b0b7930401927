//! What there is of GPUs, whether the first one answers rays as it should, and frames on it.

use std::sync::Arc;

use glam::Vec3;
use rayward::scene::builtin;
use rayward::trace::{Accel, Bvh, Ray};
use rayward::{CubeBuilder, Renderer, triangles};
use rayward_gpu::{AdapterSummary, Cube, CubeOptions, Error, Gpu, GpuSecondary, GpuShading, adapters};
use serde::Serialize;

use crate::args::RunArgs;
use crate::failure::{Code, Failure};
use crate::report::{self, thousands};
use crate::values::{GpuShadingUse, GpuUse, SecondaryUse};

/// The device that frames are made with, if they are.
pub(crate) struct Device {
    tracing: Option<Arc<GpuSecondary>>,
    shading: Option<Arc<GpuShading>>,
    /// Why the CPU shades though the device was to.
    not_shading: Option<String>,
    asked: GpuUse,
}

/// What a device has done so far; its fields are those of the JSON object.
#[derive(Serialize)]
pub(crate) struct DeviceSummary {
    adapter: String,
    /// Rays traced on it.
    rays: usize,
    /// Those of them that f32 could not tell, answered on the CPU.
    unsure_rays: usize,
    /// `device` or `cpu`.
    shading: &'static str,
    /// Why it is the CPU though the device was to.
    shading_problem: Option<String>,
    /// Surfaces made on it.
    surfaces: u64,
    /// Beams of light added up on it.
    beams: u64,
}

impl Device {
    /// Opens what was asked for and has the renderer use it.
    pub(crate) fn open(args: &RunArgs, renderer: &mut Renderer) -> Result<Self, Failure> {
        if args.secondary == SecondaryUse::Cube {
            renderer.set_secondary(Arc::new(CubeBuilder::default()));
        }
        let mut opened = Self {
            tracing: None,
            shading: None,
            not_shading: None,
            asked: args.gpu,
        };
        if args.gpu == GpuUse::Off {
            return Ok(opened);
        }
        let problem = match Gpu::open(None) {
            Ok(gpu) if args.gpu == GpuUse::On || !gpu.adapter().software => {
                let device = Arc::new(GpuSecondary::new(gpu, CubeOptions::default()));
                renderer.set_secondary(Arc::clone(&device) as Arc<_>);
                if args.gpu_shading == GpuShadingUse::Device {
                    opened.shade(&device, renderer);
                }
                opened.tracing = Some(device);
                return Ok(opened);
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
        Ok(opened)
    }

    /// Has frames shaded there, if the scene fits.
    fn shade(&mut self, device: &Arc<GpuSecondary>, renderer: &mut Renderer) {
        match GpuShading::new(device, renderer.shader()) {
            Ok(shading) => {
                let shading = Arc::new(shading);
                renderer.set_shading(Some(Arc::clone(&shading) as Arc<_>));
                self.shading = Some(shading);
            }
            Err(problem) => self.not_shading = Some(problem.to_string()),
        }
    }

    /// Why the CPU shades, or has shaded in part, though the device was to.
    fn shading_problem(&self) -> Option<String> {
        let failed = self.shading.as_ref().and_then(|shading| shading.problem());
        failed
            .map(|problem| problem.to_string())
            .or_else(|| self.not_shading.clone())
    }

    /// What it has done so far; `None` on the CPU.
    pub(crate) fn summary(&self) -> Option<DeviceSummary> {
        let device = self.tracing.as_ref()?;
        let (stats, problem) = (device.stats(), self.shading_problem());
        let shaded = self
            .shading
            .as_ref()
            .map(|shading| shading.stats())
            .unwrap_or_default();
        Some(DeviceSummary {
            adapter: device.gpu().adapter().name.clone(),
            rays: stats.rays,
            unsure_rays: stats.unsure,
            shading: if self.shading.is_some() && problem.is_none() {
                "device"
            } else {
                "cpu"
            },
            shading_problem: problem,
            surfaces: shaded.surfaces,
            beams: shaded.beams,
        })
    }

    /// Tells what it has done. An error of a device that was to be used is ours, too; what does not fit its limits is left to the
    /// CPU, and told.
    pub(crate) fn close(&self, quiet: bool) -> Result<(), Failure> {
        let Some(device) = &self.tracing else {
            return Ok(());
        };
        let shading = self.shading.as_ref().and_then(|shading| shading.problem());
        let shading = shading.filter(|problem| !matches!(problem, Error::Limits { .. }));
        match device.problem().or(shading) {
            Some(problem) if self.asked == GpuUse::On => {
                return Err(Failure::new(Code::Runtime, problem));
            }
            Some(problem) => {
                report::note(&format!("on the CPU: {}", report::clean(&problem.to_string())));
                return Ok(());
            }
            None => {}
        }
        if let Some(problem) = self.shading_problem() {
            report::note(&format!("shaded on the CPU: {}", report::clean(&problem)));
        }
        if let Some(done) = self.summary().filter(|_| !quiet) {
            let shaded = if done.shading == "device" {
                format!("{} surfaces shaded", thousands(done.surfaces))
            } else {
                "shaded on the CPU".to_owned()
            };
            report::note(&format!(
                "{}: {} rays, {} of them answered on the CPU; {shaded}",
                report::clean(&done.adapter),
                thousands(done.rays),
                thousands(done.unsure_rays),
            ));
        }
        Ok(())
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
