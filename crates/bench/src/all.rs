//! Everything in one report: frames, the papers' tables, curves, ablations, structures, builds.
//!
//! What falls short comes first.

use rayward::scene;
use rayward::trace::SimdLevel;
use serde::Serialize;

use crate::ablation::{self, AblationOptions};
use crate::build::{self, BuildOptions, BuildReport};
use crate::claims::{Claim, Verdict};
use crate::frames::{self, FramesOptions, FramesReport};
use crate::pictures;
use crate::report::{Document, Item, Picture, Section, sections};
use crate::scaling::{self, ScalingOptions, ScalingReport};
use crate::structures::{self, RayClass, StructuresOptions, StructuresReport};
use crate::table::number;
use crate::tables::{self, TablesOptions, TablesReport};
use crate::{BenchScene, Machine, Result};

/// How much is measured.
#[derive(Clone, Debug)]
pub struct AllOptions {
    /// Small sizes, for a look and for tests.
    pub quick: bool,
    /// Threads of what is measured with several.
    pub threads: usize,
    /// Runs of each measurement.
    pub runs: usize,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
    /// Folder of scenes, with a camera file.
    pub folder: Option<std::path::PathBuf>,
    /// Scenes of frames and builds; unless there are any, the meshes of the folder or else the built-in ones.
    pub scenes: Vec<String>,
}

/// All measurements.
#[derive(Clone, Debug, Serialize)]
pub struct AllReport {
    /// Frames beside others.
    pub frames: FramesReport,
    /// The papers' tables.
    pub tables: TablesReport,
    /// Costs of a ray.
    pub scaling: ScalingReport,
    /// Builds and threads.
    pub build: BuildReport,
    /// Improvements taken away.
    pub ablation: FramesReport,
    /// Structures for any ray.
    pub structures: StructuresReport,
    /// Pictures of what was measured.
    #[serde(skip)]
    pub pictures: Vec<Picture>,
    /// What rays cost in one of them, pixel by pixel.
    #[serde(skip)]
    pub heat_maps: Vec<Picture>,
}

/// Ratios to the fastest other ray tracer that Rayward is made for, by kind of frame.
const BARS: [(&str, f64); 3] = [("eye", 5.0), ("eye+hard", 2.5), ("eye+soft8", 3.0)];

/// Measures everything.
///
/// # Errors
/// [`crate::Error`], if a scene cannot be read, Embree not be used, or threads not be started.
pub fn measure(options: &AllOptions, progress: &mut dyn FnMut(&str)) -> Result<AllReport> {
    let &AllOptions {
        quick,
        threads,
        runs,
        level,
        pinned,
        ..
    } = options;
    let folder = options.folder.as_deref();
    let [width, height] = size(quick);
    let load = |names: &[&str]| -> Result<Vec<BenchScene>> {
        names.iter().map(|name| BenchScene::load(name, folder)).collect()
    };
    let names: Vec<&str> = match (quick, folder) {
        _ if !options.scenes.is_empty() => options.scenes.iter().map(String::as_str).collect(),
        (true, _) => vec!["blob-1k"],
        (false, None) => crate::all_scenes(false).collect(),
        (false, Some(_)) => crate::all_scenes(true)
            .filter(|name| !scene::builtin::NAMES.contains(name))
            .collect(),
    };
    let scenes = load(&names)?;
    let frames = FramesOptions {
        width,
        height,
        runs,
        level,
        pinned,
        ..FramesOptions::default()
    };
    let build = BuildOptions {
        width,
        height,
        threads,
        runs,
        level,
        pinned,
    };
    let scaling = ScalingOptions {
        quick,
        threads,
        runs,
        level,
        pinned,
    };
    let few: &[&str] = if quick { &["blob-1k"] } else { &ablation::SCENES };
    let some = load(few)?;
    Ok(AllReport {
        frames: frames::measure(&scenes, &frames, progress, &mut |_, _| ())?,
        build: build::measure(&scenes, &build, progress)?,
        tables: tables::measure(&of_tables(options), progress)?,
        ablation: ablation::measure(&some, &of_ablations(options), progress)?,
        structures: structures::measure(&some, &of_structures(options), progress)?,
        scaling: scaling::measure(&scaling, progress)?,
        pictures: pictures::of_scenes(quick, progress)?,
        heat_maps: pictures::heat_maps(quick, progress)?,
    })
}

fn size(quick: bool) -> [u32; 2] {
    if quick { [96, 60] } else { [1920, 1200] }
}

fn of_tables(options: &AllOptions) -> TablesOptions {
    TablesOptions {
        size: size(options.quick),
        threads: options.threads,
        runs: options.runs,
        level: options.level,
        pinned: options.pinned,
        cubes: if options.quick {
            vec![32, 64]
        } else {
            vec![512, 1024]
        },
        folder: options.folder.clone().filter(|_| !options.quick),
    }
}

fn of_ablations(options: &AllOptions) -> AblationOptions {
    let [width, height] = size(options.quick).map(|side| side / 2);
    AblationOptions {
        width,
        height,
        threads: 1,
        runs: options.runs,
        level: options.level,
        pinned: options.pinned,
    }
}

fn of_structures(options: &AllOptions) -> StructuresOptions {
    StructuresOptions {
        rays: if options.quick { 500 } else { 100_000 },
        classes: RayClass::ALL.to_vec(),
        runs: options.runs,
        cube: if options.quick { 32 } else { 512 },
        level: options.level,
        pinned: options.pinned,
        peers: true,
    }
}

impl AllReport {
    /// The whole report.
    pub fn sections(&self) -> Vec<Section> {
        let pictures = |title: &str, pictures: &[Picture]| Section {
            items: pictures.iter().cloned().map(Item::Picture).collect(),
            ..Section::new(title)
        };
        let mut all = vec![self.overview()];
        let mut frames = sections::frames(&self.frames).into_iter();
        all.extend(frames.next());
        all.extend(sections::tables(&self.tables));
        all.extend(sections::build(&self.build));
        all.extend(sections::scaling(&self.scaling));
        all.extend(sections::ablation(&self.ablation));
        all.extend(sections::structures(&self.structures));
        all.push(pictures("Some of the scenes", &self.pictures));
        all.push(pictures("Where rays are dear", &self.heat_maps));
        all.extend(frames);
        all
    }

    /// What falls short of the papers, of others and of what was set out for, then what does not.
    fn overview(&self) -> Section {
        let (mut short, mut met) = (Vec::new(), Vec::new());
        for (kind, bar) in BARS {
            let frames = self.frames.frames.iter().filter(|frame| frame.frame == kind);
            let ratios: Vec<(f64, &str)> = frames
                .filter_map(|frame| Some((frame.ratio?, frame.scene.as_str())))
                .collect();
            let below: Vec<_> = ratios.iter().filter(|(ratio, _)| *ratio < bar).collect();
            let told = |ratios: &[&(f64, &str)]| {
                let each: Vec<_> = ratios
                    .iter()
                    .map(|(ratio, scene)| format!("{} {scene}", number(*ratio)))
                    .collect();
                each.join(", ")
            };
            if !below.is_empty() {
                short.push(format!(
                    "{kind}: {bar} times the fastest other ray tracer was set out for; in {} of {} scenes it is less: {}.",
                    below.len(),
                    ratios.len(),
                    told(&below)
                ));
            }
            let above: Vec<_> = ratios.iter().filter(|(ratio, _)| *ratio >= bar).collect();
            if !above.is_empty() {
                met.push(format!(
                    "{kind}, at least {bar} times the fastest: {}.",
                    told(&above)
                ));
            }
        }
        let claims = |paper: &str, claims: &[Claim], short: &mut Vec<String>, met: &mut Vec<String>| {
            for claim in claims {
                let line = format!("{paper}, \"{}\": {}.", claim.claim, claim.figures);
                match claim.verdict {
                    Verdict::Not => short.push(line),
                    Verdict::Exceeded => met.push(line),
                    Verdict::Reproduced | Verdict::NotMeasured => {}
                }
            }
        };
        claims("HM08", &self.tables.claims, &mut short, &mut met);
        claims("VMV07", &self.tables.cube_claims, &mut short, &mut met);
        if short.is_empty() {
            short.push("Nothing that was measured.".into());
        }
        let mut section = Section::new("What falls short").list(short);
        if !met.is_empty() {
            section = section
                .text("What goes beyond the papers, or reaches what was set out for:")
                .list(met);
        }
        section
    }

    /// As a document.
    pub fn document(&self, command: String) -> Document {
        Document {
            title: "Rayward: measurements".into(),
            machine: Machine {
                threads: self.build.machine.threads,
                ..self.frames.machine.clone()
            },
            command,
            sections: self.sections(),
        }
    }
}
