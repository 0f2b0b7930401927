//! What a ray costs against triangles, pixels, lights, samples, the light's size, depth complexity, threads, and against
//! how far from their common point rays start: one curve for each, all else fixed.
//!
//! Frames are those of [`crate::frames`], Rayward alone, every structure rebuilt. A curve of a cost per ray that stays
//! flat says that the structures keep up; one that rises says what they do not hide.

mod distance;

use rayward::trace::{Samples, SimdLevel};
use serde::Serialize;

use crate::contender::{Contender, FrameKind, Job};
use crate::ours::{Rayward, Ways, tile_side};
use crate::{BenchScene, Machine, Picture, Result, Stopwatch, Times, workers};

/// What is measured.
#[derive(Clone, Debug)]
pub struct ScalingOptions {
    /// Small sizes only, for a look and for tests.
    pub quick: bool,
    /// Most threads; the other curves are measured with one.
    pub threads: usize,
    /// Runs of each point.
    pub runs: usize,
    /// Instruction set of the kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
}

/// All curves.
#[derive(Clone, Debug, Serialize)]
pub struct ScalingReport {
    /// What it was measured on.
    pub machine: Machine,
    /// Runs of each point.
    pub runs: usize,
    /// The curves.
    pub curves: Vec<Curve>,
}

/// Costs against one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// What changes.
    pub parameter: &'static str,
    /// Scene, or kind of scene.
    pub scene: String,
    /// Kind of frame.
    pub frame: &'static str,
    /// The points, by growing value.
    pub points: Vec<Point>,
}

/// One point of a curve.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Value of the parameter.
    pub value: f64,
    /// Triangles of the scene.
    pub triangles: usize,
    /// Width and height.
    pub resolution: [u32; 2],
    /// All rays.
    pub rays: u64,
    /// Times of the frame.
    pub times: Times,
    /// Processor time a ray, nanoseconds.
    pub ns_per_ray: f64,
    /// Wall time a ray, nanoseconds.
    pub wall_ns_per_ray: f64,
    /// Cells that a ray passes and triangles that it is tested with, where they are counted.
    pub steps: Option<[f64; 2]>,
}

struct Sizes {
    /// Frequencies of geospheres with 20 times their square triangles.
    blobs: &'static [u32],
    resolutions: &'static [[u32; 2]],
    lights: &'static [usize],
    samples: &'static [u32],
    /// Sides of the light, of its usual one.
    sides: &'static [f32],
    /// Blobs, one behind the other.
    layers: &'static [usize],
    /// Distances of origins, of the scene's diagonal.
    distances: &'static [f32],
    usual: [u32; 2],
}

const FULL: Sizes = Sizes {
    blobs: &[7, 22, 71, 224, 707],
    resolutions: &[[640, 400], [1280, 800], [1920, 1200], [3840, 2160], [7680, 4320]],
    lights: &[1, 4, 16, 64],
    samples: &[1, 4, 16, 64, 256],
    sides: &[0.1, 0.3, 1.0, 3.0, 10.0],
    layers: &[1, 4, 16, 64],
    distances: &[1e-4, 1e-3, 1e-2, 1e-1, 1.0],
    usual: [1920, 1200],
};

const QUICK: Sizes = Sizes {
    blobs: &[7, 22],
    resolutions: &[[64, 40], [128, 80]],
    lights: &[1, 2],
    samples: &[1, 16],
    sides: &[1.0, 3.0],
    layers: &[1, 3],
    distances: &[1e-3, 1e-1],
    usual: [96, 60],
};

/// Scene of the curves whose parameter is not its triangles.
const SCENE: &str = "courtyard";

/// Measures all curves.
///
/// # Errors
/// [`crate::Error`], if threads cannot be started.
pub fn measure(options: &ScalingOptions, progress: &mut dyn FnMut(&str)) -> Result<ScalingReport> {
    let sizes = if options.quick { QUICK } else { FULL };
    let scene = BenchScene::load(SCENE, None)?;
    let mut curves = Vec::new();
    for kind in FrameKind::ALL {
        curves.push(against_triangles(options, &sizes, kind, progress)?);
        curves.push(curve("pixels", kind.name(), sizes.resolutions, |&size| {
            progress(&format!("resolution {}x{}, {}", size[0], size[1], kind.name()));
            let value = f64::from(size[0]) * f64::from(size[1]);
            one_thread(options, &Job::new(&scene, size, kind, options.level)?, value, 1)
        })?);
    }
    let hard = Job::new(&scene, sizes.usual, FrameKind::EyeHard, options.level)?;
    let soft = || Job::new(&scene, sizes.usual, FrameKind::EyeSoft, options.level);
    curves.push(curve("lights", hard.kind.name(), sizes.lights, |&lights| {
        progress(&format!("lights {lights}"));
        one_thread(options, &hard, lights as f64, lights)
    })?);
    curves.push(curve("samples", "eye+soft", sizes.samples, |&samples| {
        progress(&format!("samples {samples}"));
        let samples_of = Samples::new(samples, 1);
        let job = Job {
            samples: samples_of,
            ..soft()?
        };
        one_thread(options, &job, f64::from(samples), 1)
    })?);
    curves.push(curve("light size", "eye+soft8", sizes.sides, |&side| {
        progress(&format!("light size {side}"));
        let area = scene.area_light_of_size(side);
        one_thread(options, &Job { area, ..soft()? }, f64::from(side), 1)
    })?);
    curves.extend(against_layers(options, &sizes, progress)?);
    let threads: Vec<usize> = (1..=options.threads).collect();
    curves.push(curve("threads", hard.kind.name(), &threads, |&threads| {
        progress(&format!("threads {threads}"));
        point(options, &hard, threads, threads as f64, 1)
    })?);
    curves.extend(distance::curves(
        options,
        sizes.usual,
        sizes.distances,
        &scene,
        progress,
    )?);
    Ok(ScalingReport {
        machine: Machine::describe(options.level, options.threads, options.pinned),
        runs: options.runs,
        curves,
    })
}

/// A curve of the usual scene.
fn curve<V>(
    parameter: &'static str,
    frame: &'static str,
    values: &[V],
    point: impl FnMut(&V) -> Result<Point>,
) -> Result<Curve> {
    Ok(Curve {
        parameter,
        scene: SCENE.into(),
        frame,
        points: values.iter().map(point).collect::<Result<_>>()?,
    })
}

fn against_triangles(
    options: &ScalingOptions,
    sizes: &Sizes,
    kind: FrameKind,
    progress: &mut dyn FnMut(&str),
) -> Result<Curve> {
    let points = curve("triangles", kind.name(), sizes.blobs, |&frequency| {
        let triangles = 20 * u64::from(frequency) * u64::from(frequency);
        progress(&format!("triangles {triangles}, {}", kind.name()));
        let scene = BenchScene::new("blob", rayward::scene::builtin::blob_of(frequency), None)?;
        let job = Job::new(&scene, sizes.usual, kind, options.level)?;
        one_thread(options, &job, triangles as f64, 1)
    })?;
    let scene = "blob".into();
    Ok(Curve { scene, ..points })
}

/// Blobs behind each other, of which the camera sees the first.
fn against_layers(
    options: &ScalingOptions,
    sizes: &Sizes,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Curve>> {
    let kinds = [FrameKind::Eye, FrameKind::EyeHard];
    let of_kind = |kind: FrameKind| {
        let points = curve("depth complexity", kind.name(), sizes.layers, |&layers| {
            progress(&format!("depth complexity {layers}, {}", kind.name()));
            let blob = rayward::scene::builtin::blob_of(22);
            let scene = BenchScene::new("blob", blob, None)?.stacked(layers);
            let job = Job::new(&scene, sizes.usual, kind, options.level)?;
            one_thread(options, &job, layers as f64, 1)
        })?;
        let scene = "blobs in a row".into();
        Ok(Curve { scene, ..points })
    };
    kinds.into_iter().map(of_kind).collect()
}

fn one_thread(options: &ScalingOptions, job: &Job, value: f64, lights: usize) -> Result<Point> {
    point(options, job, 1, value, lights)
}

fn point(options: &ScalingOptions, job: &Job, threads: usize, value: f64, lights: usize) -> Result<Point> {
    let ours = Rayward::new(Ways::usual());
    let pool = workers::pool(threads, options.pinned)?;
    let lights = job.scene.lights_around(lights);
    let (width, height) = (job.view.width, job.view.height);
    let mut picture = Picture::new(width, height, tile_side());
    let mut frame = || match lights.len() {
        1 => ours.draw(job, &mut picture),
        _ => ours.ask_lights(job, &lights),
    };
    let (asked, times) = pool.install(|| {
        let asked = frame();
        let runs: Vec<_> = (0..options.runs).map(|_| Stopwatch::time(&mut frame).1).collect();
        (asked, Times::of(&runs))
    });
    let rays = u64::from(width) * u64::from(height) + asked;
    Ok(Point::new(value, job, rays, times))
}

impl Point {
    fn new(value: f64, job: &Job, rays: u64, times: Times) -> Self {
        Self {
            value,
            triangles: job.scene.geometry.triangle_count(),
            resolution: [job.view.width, job.view.height],
            rays,
            times,
            ns_per_ray: times.cpu_ms.median * 1e6 / rays as f64,
            wall_ns_per_ray: times.wall_ms.median * 1e6 / rays as f64,
            steps: None,
        }
    }
}
