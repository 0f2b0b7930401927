//! Builds alone, and what a second thread brings to them and to whole frames.

use rayon::ThreadPool;
use rayward::trace::{EyeGrid, EyeGridOptions, SimdLevel, Visibility};
use serde::Serialize;

use crate::contender::{Contender, FrameKind, Job};
use crate::ours::{Rayward, Ways, eye_grid, tile_side};
use crate::{BenchScene, Machine, Picture, Result, Spread, Stopwatch, workers};

/// What is measured.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Threads that one thread is compared with.
    pub threads: usize,
    /// Runs of each measurement.
    pub runs: usize,
    /// Instruction set of the kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
}

/// Results of all scenes.
#[derive(Clone, Debug, Serialize)]
pub struct BuildReport {
    /// What it was measured on.
    pub machine: Machine,
    /// Runs of each measurement.
    pub runs: usize,
    /// One entry a scene.
    pub scenes: Vec<SceneBuilds>,
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneBuilds {
    /// Scene.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// The grid of the camera: clusters sorted into tiles.
    pub eye_grid: Scaled,
    /// Hard shadows of all pixels, caster rules included.
    pub shadows: Scaled,
    /// A grid of all triangles for the camera: projection and binning of every one.
    pub binning: Scaled,
    /// The whole frame, eye rays and hard shadows.
    pub frame: Scaled,
    /// References from tiles to triangles in the grid of all.
    pub references: usize,
}

/// One piece of work with one thread and with several.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Scaled {
    /// Processor time on one thread, milliseconds.
    pub cpu_ms: Spread,
    /// Million triangles a second of processor time, on one thread.
    pub mtriangles_per_s: f64,
    /// Wall time on one thread, milliseconds.
    pub wall_ms: Spread,
    /// Wall time on all of them, milliseconds.
    pub wall_ms_parallel: Spread,
    /// The former over the latter, of medians.
    pub speed_up: f64,
    /// As `speed_up`, of the smallest: what is left of it where other programs run too.
    pub speed_up_of_fastest: f64,
}

/// Measures these scenes.
///
/// # Errors
/// [`crate::Error`], if a camera cannot be taken or threads not be started.
pub fn measure(
    scenes: &[BenchScene],
    options: &BuildOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<BuildReport> {
    let pool = |threads| workers::pool(threads, options.pinned);
    let pools = [pool(1)?, pool(options.threads)?];
    let mut report = BuildReport {
        machine: Machine::describe(options.level, options.threads, options.pinned),
        runs: options.runs,
        scenes: Vec::new(),
    };
    let ours = Rayward::new(Ways::usual());
    for scene in scenes {
        progress(&scene.name);
        let size = [options.width, options.height];
        let job = Job::new(scene, size, FrameKind::EyeHard, options.level)?;
        let triangles = scene.geometry.triangle_count();
        let scaled = |work: &mut (dyn FnMut() + Send)| scaled(&pools, options.runs, triangles, work);
        let view = job.view;
        let all = || EyeGrid::build(view, scene.triangles(), EyeGridOptions::default(), job.level);
        let visibility = Visibility::trace(&eye_grid(&job), &|| ());
        let mut picture = Picture::new(options.width, options.height, tile_side());
        report.scenes.push(SceneBuilds {
            scene: scene.name.clone(),
            triangles,
            eye_grid: scaled(&mut || drop(eye_grid(&job))),
            binning: scaled(&mut || drop(all())),
            shadows: scaled(&mut || drop(ours.lit(&job, &visibility, job.light))),
            frame: scaled(&mut || {
                ours.draw(&job, &mut picture);
            }),
            references: all().reference_count(),
        });
    }
    Ok(report)
}

/// Runs the work on both pools in turns.
fn scaled(pools: &[ThreadPool; 2], runs: usize, triangles: usize, work: &mut (dyn FnMut() + Send)) -> Scaled {
    let mut times = [Vec::new(), Vec::new()];
    // The first run warms up and does not count.
    for run in 0..=runs {
        for (pool, times) in pools.iter().zip(&mut times) {
            let ((), time) = pool.install(|| Stopwatch::time(&mut *work));
            if run > 0 {
                times.push(time);
            }
        }
    }
    let wall = |i: usize| Spread::of(times[i].iter().map(|t| t.wall));
    let cpu_ms = Spread::of(times[0].iter().map(|t| t.cpu));
    let (one, all) = (wall(0), wall(1));
    let ratio = |a: f64, b: f64| if b > 0.0 { a / b } else { 0.0 };
    Scaled {
        cpu_ms,
        mtriangles_per_s: ratio(triangles as f64 / 1e3, cpu_ms.median),
        wall_ms: one,
        wall_ms_parallel: all,
        speed_up: ratio(one.median, all.median),
        speed_up_of_fastest: ratio(one.min, all.min),
    }
}
