//! Any structure, any class of rays, any scene: time, steps, builds, memory and answers of each beside the others.
//!
//! | class | rays | asked for |
//! |---|---|---|
//! | `eye` | of all pixels | closest hit |
//! | `hard` | from what the eye sees to the light | whether anything is between |
//! | `soft` | from what the eye sees to eight points of an area light | the same |
//! | `reflection` | from what the eye sees, mirrored there | closest hit |
//! | `random` | between random points of the scene's box and beyond | closest hit |
//! | `through` | the same | all hits |
//!
//! Rays of a class are the same for all, in the order of blocks of 4 x 4 pixels in squares of 16 x 16, on one thread.
//! Answers are compared before anything is timed; whose answers differ in more than a stated share gets no times, unless
//! it samples the scene by design.

mod rays;
mod subjects;

use rayward::trace::SimdLevel;
use serde::Serialize;

use crate::embree;
use crate::{BenchScene, Machine, Result, Spread, Stopwatch, workers};
pub use rays::RayClass;
pub(crate) use rays::mirrored_rays;
use rays::{Answer, RaySet};
pub(crate) use subjects::General;
use subjects::Subject;

/// Share of the rays whose answers may differ: rays of f32 peers through edges and along grazing surfaces.
pub const TOLERATED_SHARE: f64 = 0.005;

/// Name of what tests every triangle.
pub const BRUTE: &str = "brute force";

/// What is measured.
#[derive(Clone, Debug)]
pub struct StructuresOptions {
    /// Rays of a class, about.
    pub rays: u32,
    /// Classes of rays.
    pub classes: Vec<RayClass>,
    /// Runs of each measurement.
    pub runs: usize,
    /// Texels along the longest side of layered depth cubes.
    pub cube: u32,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
    /// Whether other libraries are measured too.
    pub peers: bool,
}

/// Results of all scenes.
#[derive(Clone, Debug, Serialize)]
pub struct StructuresReport {
    /// What it was measured on.
    pub machine: Machine,
    /// Runs of each measurement.
    pub runs: usize,
    /// Share of the rays whose answers may differ.
    pub tolerated_share: f64,
    /// One entry a scene.
    pub scenes: Vec<SceneStructures>,
}

/// One scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneStructures {
    /// Scene.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// The structures, as they were built.
    pub structures: Vec<Structure>,
    /// One entry a class of rays.
    pub classes: Vec<ClassRows>,
}

/// A structure as it was built.
#[derive(Clone, Debug, Serialize)]
pub struct Structure {
    /// Its name.
    pub name: String,
    /// What it is.
    pub what: &'static str,
    /// Processor time of its build on one thread, milliseconds.
    pub build_ms: f64,
    /// Bytes held, where it tells.
    pub bytes: Option<usize>,
}

/// All structures for one class of rays.
#[derive(Clone, Debug, Serialize)]
pub struct ClassRows {
    /// The class.
    pub class: &'static str,
    /// What its rays are.
    pub what: &'static str,
    /// One entry for each structure that takes such rays.
    pub rows: Vec<StructureRow>,
}

/// One structure for one class of rays.
#[derive(Clone, Debug, Serialize)]
pub struct StructureRow {
    /// The structure.
    pub structure: String,
    /// Rays.
    pub rays: usize,
    /// Those that hit something.
    pub hits: usize,
    /// Those whose answer is not that of the hierarchy.
    pub differing: usize,
    /// Whether these are few enough for a time to be told, or differ by design.
    pub same_answers: bool,
    /// Processor time a ray, nanoseconds.
    pub ns_per_ray: Option<f64>,
    /// Nodes, cells and texels that a ray opens, where they are counted.
    pub nodes_per_ray: Option<f64>,
    /// Triangles that a ray is tested with, where they are counted.
    pub tests_per_ray: Option<f64>,
}

impl StructuresReport {
    /// Whether all answers were the same, or as near as samples can be.
    pub fn same_answers(&self) -> bool {
        let rows = self
            .scenes
            .iter()
            .flat_map(|scene| &scene.classes)
            .flat_map(|class| &class.rows);
        rows.into_iter().all(|row| row.same_answers)
    }
}

/// Measures these scenes.
///
/// # Errors
/// [`crate::Error`], if a library of Embree cannot be used, a camera not be taken, or threads not be started.
pub fn measure(
    scenes: &[BenchScene],
    options: &StructuresOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<StructuresReport> {
    let libraries = if options.peers {
        embree::libraries()?
    } else {
        Vec::new()
    };
    let pool = workers::pool(1, options.pinned)?;
    let mut report = StructuresReport {
        machine: Machine::describe(options.level, 1, options.pinned),
        runs: options.runs,
        tolerated_share: TOLERATED_SHARE,
        scenes: Vec::new(),
    };
    for scene in scenes {
        progress(&format!("{}: building all structures", scene.name));
        let subjects = pool.install(|| subjects::all(scene, options, &libraries))?;
        let mut classes = Vec::new();
        for &class in &options.classes {
            progress(&format!("{}: {}", scene.name, class.name()));
            let set = pool.install(|| RaySet::new(scene, class, options))?;
            classes.push(pool.install(|| of_class(&set, &subjects, options)));
        }
        report.scenes.push(SceneStructures {
            scene: scene.name.clone(),
            triangles: scene.geometry.triangle_count(),
            structures: subjects.iter().map(Subject::structure).collect(),
            classes,
        });
    }
    Ok(report)
}

fn of_class(set: &RaySet, subjects: &[Subject], options: &StructuresOptions) -> ClassRows {
    let mut truth: Vec<Answer> = Vec::new();
    let mut taking = Vec::new();
    let mut rows = Vec::new();
    for subject in subjects {
        let mut answers = Vec::new();
        if !(subject.answer)(set, &mut answers) {
            continue;
        }
        if truth.is_empty() {
            truth.clone_from(&answers);
        }
        let differing = answers.iter().zip(&truth).filter(|(a, b)| a.differs(b)).count();
        let rays = answers.len();
        let few = differing as f64 <= rays as f64 * TOLERATED_SHARE;
        let per_ray = |count: u64| count as f64 / rays.max(1) as f64;
        let counted = subject.count.as_ref().and_then(|count| count(set));
        rows.push(StructureRow {
            structure: subject.name.clone(),
            rays,
            hits: answers.iter().filter(|answer| answer.hits()).count(),
            differing,
            same_answers: few || subject.samples,
            ns_per_ray: None,
            nodes_per_ray: counted.map(|c| per_ray(c.nodes)),
            tests_per_ray: counted.map(|c| per_ray(c.triangles)),
        });
        taking.push(subject);
    }
    let mut times = vec![Vec::new(); rows.len()];
    let mut answers = Vec::new();
    for round in 0..options.runs {
        for turn in 0..rows.len() {
            let i = (round + turn) % rows.len();
            if rows[i].same_answers {
                times[i].push(Stopwatch::time(|| (taking[i].answer)(set, &mut answers)).1.cpu);
            }
        }
    }
    for (row, times) in rows.iter_mut().zip(times).filter(|(_, times)| !times.is_empty()) {
        row.ns_per_ray = Some(Spread::of(times).median * 1e6 / row.rays.max(1) as f64);
    }
    ClassRows {
        class: set.class.name(),
        what: set.class.what(),
        rows,
    }
}
