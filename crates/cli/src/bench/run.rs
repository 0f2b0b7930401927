//! Measures what was asked for, and tells it as text, JSON, rows, or a report in a folder.

use std::path::{Path, PathBuf};

use rayward::image_io::write_png;
use rayward::trace::SimdLevel;
use rayward_bench::ablation::{self, AblationOptions};
use rayward_bench::all::{self, AllOptions};
use rayward_bench::build::{self, BuildOptions};
use rayward_bench::frames::{self, FramesOptions, FramesReport};
use rayward_bench::report::{Document, Section, sections};
use rayward_bench::scaling::{self, ScalingOptions};
use rayward_bench::structures::{self, StructuresOptions};
use rayward_bench::tables::{self, TablesOptions};
use rayward_bench::{BenchScene, Machine, Picture, table};
use serde::Serialize;

use super::{
    AblationArgs, AllArgs, BenchArgs, BuildArgs, FramesArgs, MeasureArgs, RunArgs, ScalingArgs,
    StructuresArgs, TablesArgs, What,
};
use crate::failure::{Code, Failure};
use crate::report;

/// Measures and tells.
pub(crate) fn run(args: &BenchArgs) -> Result<(), Failure> {
    match &args.what {
        What::Frames(args) => run_frames(args),
        What::Scaling(args) => run_scaling(args),
        What::Build(args) => run_build(args),
        What::Tables(args) => run_tables(args),
        What::Ablation(args) => run_ablation(args),
        What::Structures(args) => run_structures(args),
        What::All(args) => run_all(args),
    }
}

impl From<rayward_bench::Error> for Failure {
    fn from(error: rayward_bench::Error) -> Self {
        use rayward_bench::Error;
        let code = match error {
            Error::Rayward(error) => return error.into(),
            Error::UnknownScene { .. } => Code::Usage,
            Error::Scene { .. } | Error::Embree { .. } => Code::Input,
            _ => Code::Runtime,
        };
        Self::new(code, error)
    }
}

fn run_frames(args: &FramesArgs) -> Result<(), Failure> {
    let options = FramesOptions {
        width: args.resolution.width,
        height: args.resolution.height,
        kinds: args.frames.iter().map(|&kind| kind.into()).collect(),
        threads: args.threads as usize,
        runs: args.run.run.runs as usize,
        peers: !args.no_peers,
        pinned: args.run.run.pin,
        ..FramesOptions::default()
    };
    let scenes = load(&args.scenes, &args.run)?;
    let mut problem = None;
    let mut keep = |name: &str, picture: &Picture| {
        if let (Some(folder), None) = (&args.pictures, &problem) {
            problem = write(folder, name, &options, picture).err();
        }
    };
    let measured = frames::measure(
        &scenes,
        &options,
        &mut |what| args.run.run.progress(what),
        &mut keep,
    )?;
    if let Some(problem) = problem {
        return Err(problem);
    }
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::frames(&measured),
        &table::frames_csv(&measured),
    )?;
    judge(&measured)
}

fn run_scaling(args: &ScalingArgs) -> Result<(), Failure> {
    let options = ScalingOptions {
        quick: args.quick,
        threads: args.threads.map_or_else(cores, |threads| threads as usize),
        runs: args.run.run.runs as usize,
        level: SimdLevel::detect(),
        pinned: args.run.run.pin,
    };
    let measured = scaling::measure(&options, &mut |what| args.run.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::scaling(&measured),
        &table::scaling_csv(&measured),
    )
}

fn run_build(args: &BuildArgs) -> Result<(), Failure> {
    let options = BuildOptions {
        width: args.resolution.width,
        height: args.resolution.height,
        threads: args.threads as usize,
        runs: args.run.run.runs as usize,
        level: SimdLevel::detect(),
        pinned: args.run.run.pin,
    };
    let scenes = load(&args.scenes, &args.run)?;
    let measured = build::measure(&scenes, &options, &mut |what| args.run.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::build(&measured),
        &table::build_csv(&measured),
    )
}

fn run_tables(args: &TablesArgs) -> Result<(), Failure> {
    let options = TablesOptions {
        size: [args.resolution.width, args.resolution.height],
        threads: args.threads.map_or_else(cores, |threads| threads as usize),
        runs: args.run.run.runs as usize,
        level: SimdLevel::detect(),
        pinned: args.run.run.pin,
        cubes: args.cubes.clone(),
        folder: folder(),
    };
    let measured = tables::measure(&options, &mut |what| args.run.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::tables(&measured),
        &table::tables_csv(&measured),
    )
}

fn run_ablation(args: &AblationArgs) -> Result<(), Failure> {
    let options = AblationOptions {
        width: args.resolution.width,
        height: args.resolution.height,
        threads: args.threads as usize,
        runs: args.run.run.runs as usize,
        level: SimdLevel::detect(),
        pinned: args.run.run.pin,
    };
    let scenes = load_or(&args.scenes, &ablation::SCENES, &args.run)?;
    let measured = ablation::measure(&scenes, &options, &mut |what| args.run.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::ablation(&measured),
        &table::frames_csv(&measured),
    )?;
    judge(&measured)
}

fn run_structures(args: &StructuresArgs) -> Result<(), Failure> {
    let options = StructuresOptions {
        rays: args.number,
        classes: args.rays.iter().map(|&class| class.into()).collect(),
        runs: args.run.run.runs as usize,
        cube: args.cube,
        level: SimdLevel::detect(),
        pinned: args.run.run.pin,
        peers: !args.no_peers,
    };
    let scenes = load_or(&args.scenes, &ablation::SCENES, &args.run)?;
    let measured = structures::measure(&scenes, &options, &mut |what| args.run.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        &measured.machine,
        sections::structures(&measured),
        &table::structures_csv(&measured),
    )?;
    if measured.same_answers() {
        return Ok(());
    }
    let message = format!(
        "answers differ for more than {} % of the rays; the report says which",
        measured.tolerated_share * 100.0
    );
    Err(Failure::new(Code::Beyond, message))
}

fn run_all(args: &AllArgs) -> Result<(), Failure> {
    let options = AllOptions {
        quick: args.quick,
        threads: args.threads.map_or_else(cores, |threads| threads as usize),
        runs: args.run.runs as usize,
        level: SimdLevel::detect(),
        pinned: args.run.pin,
        folder: folder(),
        scenes: args.scenes.clone(),
    };
    let measured = all::measure(&options, &mut |what| args.run.progress(what))?;
    tell_document(&args.run, &measured, &measured.document(command()))?;
    judge(&measured.frames)?;
    judge(&measured.ablation)
}

/// What was asked for, as it may be typed again.
fn command() -> String {
    let words = std::env::args()
        .skip(1)
        .map(|word| match word.contains([' ', '\'']) {
            true => format!("{word:?}"),
            false => word,
        });
    let words: Vec<_> = std::iter::once("rayward".to_owned()).chain(words).collect();
    words.join(" ")
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The folder of further scenes.
fn folder() -> Option<PathBuf> {
    std::env::var_os("RAYWARD_SCENES")
        .filter(|folder| !folder.is_empty())
        .map(PathBuf::from)
}

/// The scenes of these names, or all.
fn load(names: &[String], args: &MeasureArgs) -> Result<Vec<BenchScene>, Failure> {
    let all: Vec<_> = rayward_bench::all_scenes(folder().is_some()).collect();
    load_or(names, &all, args)
}

/// The scenes of these names, or the others if there are none.
fn load_or(names: &[String], others: &[&str], args: &MeasureArgs) -> Result<Vec<BenchScene>, Failure> {
    let folder = folder();
    let names: Vec<&str> = match names {
        [] => others.to_vec(),
        names => names.iter().map(String::as_str).collect(),
    };
    let load = |name: &str| {
        args.run.progress(&format!("{name}: reading"));
        Ok(BenchScene::load(name, folder.as_deref())?)
    };
    names.into_iter().map(load).collect()
}

impl RunArgs {
    fn progress(&self, what: &str) {
        if !self.quiet {
            report::note(&report::clean(what));
        }
    }
}

/// Writes a report in the form that was asked for.
fn tell(
    args: &MeasureArgs,
    json: &impl Serialize,
    machine: &Machine,
    sections: Vec<Section>,
    csv: &str,
) -> Result<(), Failure> {
    let document = Document {
        title: "Rayward: measurements".into(),
        machine: machine.clone(),
        command: command(),
        sections,
    };
    if args.csv {
        write_report(&args.run, &document)?;
        return to_stdout(csv);
    }
    tell_document(&args.run, json, &document)
}

fn tell_document(args: &RunArgs, json: &impl Serialize, document: &Document) -> Result<(), Failure> {
    write_report(args, document)?;
    if args.json {
        return report::to_stdout_json(json);
    }
    to_stdout(&document.text())
}

fn write_report(args: &RunArgs, document: &Document) -> Result<(), Failure> {
    match &args.report {
        Some(folder) => Ok(document.write(folder)?),
        None => Ok(()),
    }
}

fn to_stdout(text: &str) -> Result<(), Failure> {
    let lines: Vec<_> = text.lines().map(report::clean).collect();
    report::to_stdout((lines.join("\n") + "\n").as_bytes())
}

fn judge(report: &FramesReport) -> Result<(), Failure> {
    if report.same_pictures() {
        return Ok(());
    }
    let message = format!(
        "pictures differ in more than {} % of the pixels; the report says which",
        report.tolerated_share * 100.0
    );
    Err(Failure::new(Code::Beyond, message))
}

/// A gray picture named after what it shows.
fn write(folder: &Path, name: &str, options: &FramesOptions, picture: &Picture) -> Result<(), Failure> {
    let plain = |c: char| {
        if c.is_ascii_alphanumeric() || "-+.".contains(c) {
            c
        } else {
            '_'
        }
    };
    let file = folder.join(name.chars().map(plain).collect::<String>() + ".png");
    std::fs::create_dir_all(folder).map_err(|source| rayward::Error::Write {
        path: folder.into(),
        source,
    })?;
    let rgb: Vec<u8> = picture.rows().iter().flat_map(|&v| [v; 3]).collect();
    Ok(write_png(&file, options.width, options.height, &rgb)?)
}
