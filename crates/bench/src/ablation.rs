//! What each improvement brings: frames with one of them taken away, and in the papers' ways, beside the usual ones.
//!
//! All ways draw the same picture, which is compared; times are taken in turns. A way that is slower by a factor says what
//! the improvement is worth in that scene.

use rayward::CasterPolicy;
use rayward::trace::{Binning, EyeGridOptions, FaceOptions, LightGridOptions, SimdLevel};

use crate::contender::{FrameKind, Job};
use crate::frames::{Drawer, FramesReport, TOLERATED_SHARE, measure_frame};
use crate::ours::{LookUp, Rayward, Ways};
use crate::{BenchScene, Machine, Result, workers};

/// What is measured.
#[derive(Clone, Debug)]
pub struct AblationOptions {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Threads.
    pub threads: usize,
    /// Runs of each way.
    pub runs: usize,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
}

/// Built-in scenes that are measured unless others are asked for.
pub const SCENES: [&str; 3] = ["blob-69k", "courtyard", "conference"];

/// Measures these scenes in all ways; the first row of each frame has the usual ones.
///
/// # Errors
/// [`crate::Error`], if a camera cannot be taken or threads not be started.
pub fn measure(
    scenes: &[BenchScene],
    options: &AblationOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<FramesReport> {
    let pool = workers::pool(options.threads, options.pinned)?;
    let mut report = FramesReport {
        machine: Machine::describe(options.level, options.threads, options.pinned),
        embree: Vec::new(),
        width: options.width,
        height: options.height,
        runs: options.runs,
        tolerated_share: TOLERATED_SHARE,
        frames: Vec::new(),
    };
    for kind in FrameKind::ALL {
        for scene in scenes {
            let ways: Vec<Box<Drawer>> = ways(kind, scene.geometry.triangle_count())
                .into_iter()
                .map(|ways| Box::new(Rayward::new(ways)) as Box<Drawer>)
                .collect();
            progress(&format!("{}: {}", scene.name, kind.name()));
            let job = Job::new(scene, [options.width, options.height], kind, options.level)?;
            let frame = pool.install(|| measure_frame(&job, &ways, options.runs, &mut |_, _| ()));
            report.frames.push(frame);
        }
    }
    Ok(report)
}

/// Triangles up to which soft shadows are found through HM08's grid, ray by ray: beyond, one frame takes many minutes.
pub const MOST_FOLLOWED: usize = 100_000;

/// The ways of one kind of frame of so many triangles, the usual one first.
fn ways(kind: FrameKind, triangles: usize) -> Vec<Ways> {
    let usual = Ways::usual();
    let mut all = vec![named("all improvements", usual)];
    all.extend(match kind {
        FrameKind::Eye => eye_ways(usual).to_vec(),
        FrameKind::EyeHard => hard_ways(usual).to_vec(),
        FrameKind::EyeSoft => soft_ways(usual, triangles),
    });
    let levels = SimdLevel::available();
    let narrower = levels.get(1..).unwrap_or_default().iter();
    all.extend(narrower.map(|&level| Ways {
        level: Some(level),
        ..named(level.name(), usual)
    }));
    all
}

fn named(name: &'static str, ways: Ways) -> Ways {
    Ways { name, ..ways }
}

/// All contenders write pictures in tiles of one size; that is all that is not the paper's.
fn eye_as_in_the_paper(usual: Ways) -> EyeGridOptions {
    EyeGridOptions {
        tile: usual.eye.tile,
        ..EyeGridOptions::paper()
    }
}

fn eye_ways(usual: Ways) -> [Ways; 4] {
    let eye = |name, eye, clusters| Ways {
        name,
        eye,
        clusters,
        ..usual
    };
    let hides_nothing = EyeGridOptions {
        hierarchy: false,
        ..usual.eye
    };
    let by_rectangle = EyeGridOptions {
        binning: Binning::Rectangle,
        ..usual.eye
    };
    [
        eye("no clusters", usual.eye, false),
        eye("nothing hides anything", hides_nothing, true),
        eye("binned by rectangle", by_rectangle, true),
        eye("HM08's way", eye_as_in_the_paper(usual), false),
    ]
}

fn hard_ways(usual: Ways) -> [Ways; 6] {
    let casters = CasterPolicy::Both;
    let looked_up = |name, in_what| Ways {
        looked_up: Some(in_what),
        ..named(name, usual)
    };
    let paper = Ways {
        eye: eye_as_in_the_paper(usual),
        clusters: false,
        looked_up: Some(LookUp::Grid(LightGridOptions::paper())),
        ..usual
    };
    let keeps_memory = false;
    [
        named("both sides cast", Ways { casters, ..usual }),
        looked_up("looked up in a grid", LookUp::Grid(LightGridOptions::default())),
        looked_up("looked up in a grid, dark cells", LookUp::DarkCells),
        looked_up("looked up in a tree", LookUp::Tree),
        named(
            "memory made anew",
            Ways {
                keeps_memory,
                ..usual
            },
        ),
        named("HM08's way", paper),
    ]
}

fn soft_ways(usual: Ways, triangles: usize) -> Vec<Ways> {
    let (sheets, followed) = (false, Some(FaceOptions::paper()));
    let mut all = vec![named("no sheets", Ways { sheets, ..usual })];
    if triangles <= MOST_FOLLOWED {
        all.push(named("HM08's grid", Ways { followed, ..usual }));
    }
    all
}
