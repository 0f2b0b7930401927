//! What there is of GPUs, and whether the first one answers rays as it should.

use glam::Vec3;
use rayward::scene::builtin;
use rayward::trace::{Accel, Bvh, Ray};
use rayward::triangles;
use rayward_gpu::{AdapterSummary, Cube, CubeOptions, Gpu, adapters};
use serde::Serialize;

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
