//! `rayward doctor`: what this build uses of this machine, and whether it works.

use glam::Vec3;
use rayward::scene::{FrameGeometry, builtin};
use rayward::trace::SimdLevel;
use rayward::{RenderOptions, Renderer};
use serde::Serialize;

use crate::args::DoctorArgs;
use crate::failure::{Code, Failure};
use crate::gpu::{self, GpuFindings};
use crate::machine;
use crate::report;

/// The built-in scene of the self-test: some thousand triangles, a few milliseconds.
const TEST_SCENE: &str = "blob-1k";

/// The findings; its fields are those of the JSON object.
#[derive(Serialize)]
struct Findings {
    version: &'static str,
    system: &'static str,
    processor: &'static str,
    simd: &'static str,
    simd_levels: Vec<&'static str>,
    threads: usize,
    memory_bytes: Option<u64>,
    memory_available_bytes: Option<u64>,
    /// Whether the same picture came out at every instruction set.
    self_test: bool,
    gpu: GpuFindings,
    missing: Vec<&'static str>,
}

/// Looks, tests and tells; fails if the self-test does.
pub(crate) fn run(args: &DoctorArgs) -> Result<(), Failure> {
    machine::start_threads(None)?;
    let levels = SimdLevel::available();
    let best = SimdLevel::detect();
    let findings = Findings {
        version: env!("CARGO_PKG_VERSION"),
        system: std::env::consts::OS,
        processor: std::env::consts::ARCH,
        simd: best.name(),
        simd_levels: levels.iter().map(SimdLevel::name).collect(),
        threads: rayon::current_num_threads(),
        memory_bytes: machine::total_memory(),
        memory_available_bytes: machine::available_memory(),
        self_test: self_test(&levels)?,
        gpu: gpu::findings(),
        missing: missing(best),
    };
    if args.json {
        report::to_stdout_json(&findings)?;
    } else {
        report::to_stdout(findings.text().as_bytes())?;
    }
    if findings.self_test {
        Ok(())
    } else {
        Err(Failure::new(
            Code::Runtime,
            "the pictures of the self-test are not what they have to be",
        ))
    }
}

/// What would make it faster or tell more.
fn missing(best: SimdLevel) -> Vec<&'static str> {
    let mut missing = Vec::new();
    if matches!(best.name(), "SSE2" | "SSE4.2" | "scalar") {
        missing.push("AVX2 or better: pictures take about twice as long without it");
    }
    if machine::peak_memory().is_none() {
        missing.push("/proc: peak memory cannot be told");
    }
    missing
}

/// Renders a small picture at each level: the same each time, and it shows something.
fn self_test(levels: &[SimdLevel]) -> Result<bool, Failure> {
    let scene = builtin::build(TEST_SCENE)?;
    let frame: FrameGeometry = scene.at(0.0);
    let mut renderer = Renderer::new(&scene);
    let camera = rayward::scene::default_camera(&frame, 4.0 / 3.0);
    let lights = rayward::scene::default_lights(&camera);
    let mut pictures: Vec<Vec<Vec3>> = Vec::new();
    for &level in levels {
        let options = RenderOptions {
            width: 64,
            height: 48,
            level,
            ..RenderOptions::default()
        };
        let rendered = renderer.render(&frame, &camera, &lights, &options, &|_| ())?;
        pictures.push(rendered.film.color);
    }
    let same = pictures.windows(2).all(|pair| pair[0] == pair[1]);
    let background = RenderOptions::default().background;
    let seen = pictures
        .iter()
        .all(|picture| picture.iter().any(|&color| color != background));
    Ok(same && seen)
}

impl Findings {
    fn text(&self) -> String {
        let memory = |bytes: Option<u64>| bytes.map_or("unknown".into(), report::bytes);
        let mut lines = vec![
            format!(
                "rayward     {} on {} {}",
                self.version, self.system, self.processor
            ),
            format!("simd        {} of {}", self.simd, self.simd_levels.join(", ")),
            format!("threads     {}", self.threads),
            format!(
                "memory      {}, {} available",
                memory(self.memory_bytes),
                memory(self.memory_available_bytes)
            ),
            format!(
                "self-test   {}",
                if self.self_test {
                    "passed: the same picture at every instruction set"
                } else {
                    "FAILED"
                }
            ),
        ];
        lines.extend(self.gpu.lines());
        if self.missing.is_empty() {
            lines.push("missing     nothing that this build uses".into());
        }
        lines.extend(self.missing.iter().map(|what| format!("missing     {what}")));
        lines.push(String::new());
        lines.join("\n")
    }
}
