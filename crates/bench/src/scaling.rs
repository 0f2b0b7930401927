//! What a ray costs against triangles, pixels, lights, samples and threads: one curve for each, all else fixed.
//!
//! Frames are those of [`crate::frames`], Rayward alone, every structure rebuilt. A curve of a cost per ray that stays
//! flat says that the structures keep up; one that rises says what they do not hide.

use rayward::CasterPolicy;
use rayward::trace::{Samples, SimdLevel};
use serde::Serialize;

use crate::contender::{Contender, FrameKind, Job};
use crate::ours::{Rayward, tile_side};
use crate::{BenchScene, Machine, Picture, Result, Stopwatch, Times};

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
    pub value: u64,
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
}

struct Sizes {
    /// Frequencies of geospheres with 20 times their square triangles.
    blobs: &'static [u32],
    resolutions: &'static [[u32; 2]],
    lights: &'static [usize],
    samples: &'static [u32],
    usual: [u32; 2],
}

const FULL: Sizes = Sizes {
    blobs: &[7, 22, 71, 224, 707],
    resolutions: &[[640, 400], [1280, 800], [1920, 1200], [3840, 2160], [7680, 4320]],
    lights: &[1, 4, 16, 64],
    samples: &[1, 4, 16, 64, 256],
    usual: [1920, 1200],
};

const QUICK: Sizes = Sizes {
    blobs: &[7, 22],
    resolutions: &[[64, 40], [128, 80]],
    lights: &[1, 2],
    samples: &[1, 16],
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
        let points = sizes.resolutions.iter().map(|&size| {
            progress(&format!("resolution {}x{}, {}", size[0], size[1], kind.name()));
            let value = u64::from(size[0]) * u64::from(size[1]);
            one_thread(options, &Job::new(&scene, size, kind, options.level)?, value, 1)
        });
        curves.push(Curve {
            parameter: "pixels",
            scene: SCENE.into(),
            frame: kind.name(),
            points: points.collect::<Result<_>>()?,
        });
    }
    let hard = Job::new(&scene, sizes.usual, FrameKind::EyeHard, options.level)?;
    let points = sizes.lights.iter().map(|&lights| {
        progress(&format!("lights {lights}"));
        one_thread(options, &hard, lights as u64, lights)
    });
    curves.push(Curve {
        parameter: "lights",
        scene: SCENE.into(),
        frame: FrameKind::EyeHard.name(),
        points: points.collect::<Result<_>>()?,
    });
    let points = sizes.samples.iter().map(|&samples| {
        progress(&format!("samples {samples}"));
        let mut soft = Job::new(&scene, sizes.usual, FrameKind::EyeSoft, options.level)?;
        soft.samples = Samples::new(samples, 1);
        one_thread(options, &soft, u64::from(samples), 1)
    });
    curves.push(Curve {
        parameter: "samples",
        scene: SCENE.into(),
        frame: "eye+soft",
        points: points.collect::<Result<_>>()?,
    });
    let points = (1..=options.threads).map(|threads| {
        progress(&format!("threads {threads}"));
        point(options, &hard, threads, threads as u64, 1)
    });
    curves.push(Curve {
        parameter: "threads",
        scene: SCENE.into(),
        frame: FrameKind::EyeHard.name(),
        points: points.collect::<Result<_>>()?,
    });
    Ok(ScalingReport {
        machine: Machine::describe(options.level, options.threads),
        runs: options.runs,
        curves,
    })
}

fn against_triangles(
    options: &ScalingOptions,
    sizes: &Sizes,
    kind: FrameKind,
    progress: &mut dyn FnMut(&str),
) -> Result<Curve> {
    let mut points = Vec::new();
    for &frequency in sizes.blobs {
        let triangles = 20 * u64::from(frequency) * u64::from(frequency);
        progress(&format!("triangles {triangles}, {}", kind.name()));
        let scene = BenchScene::new("blob", rayward::scene::builtin::blob_of(frequency), None)?;
        points.push(one_thread(
            options,
            &Job::new(&scene, sizes.usual, kind, options.level)?,
            triangles,
            1,
        )?);
    }
    Ok(Curve {
        parameter: "triangles",
        scene: "blob".into(),
        frame: kind.name(),
        points,
    })
}

fn one_thread(options: &ScalingOptions, job: &Job, value: u64, lights: usize) -> Result<Point> {
    point(options, job, 1, value, lights)
}

fn point(options: &ScalingOptions, job: &Job, threads: usize, value: u64, lights: usize) -> Result<Point> {
    let ours = Rayward::new(CasterPolicy::Auto);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
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
    Ok(Point {
        value,
        triangles: job.scene.geometry.triangle_count(),
        resolution: [width, height],
        rays,
        times,
        ns_per_ray: times.cpu_ms.median * 1e6 / rays as f64,
        wall_ns_per_ray: times.wall_ms.median * 1e6 / rays as f64,
    })
}
