//! `rayward bench`: measurements beside other ray tracers, see the crate `rayward-bench`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand, ValueEnum};
use rayward::image_io::write_png;
use rayward::trace::SimdLevel;
use rayward_bench::build::{self, BuildOptions};
use rayward_bench::frames::{self, FramesOptions, FramesReport};
use rayward_bench::scaling::{self, ScalingOptions};
use rayward_bench::tables::{self, TablesOptions};
use rayward_bench::{BenchScene, FrameKind, Picture, table};

use crate::failure::{Code, Failure};
use crate::report;
use crate::values::{self, Size};

const HELP: &str = "\
Environment:
  RAYWARD_SCENES  folder of further scenes, with a cameras.json
  RAYWARD_EMBREE  shared library of Embree 3 or 4, or several separated as in PATH; the system's unless given

Examples:
  rayward bench frames
  rayward bench frames blob-69k model.glb --frames eye --runs 9
  rayward bench frames --json > frames.json
  rayward bench scaling --quick
  rayward bench build courtyard
  rayward bench tables";

/// `rayward bench`
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Whole frames of scenes, beside other ray tracers; exit code 5 if pictures differ
    Frames(FramesArgs),
    /// What a ray costs against triangles, pixels, lights, samples and threads
    Scaling(ScalingArgs),
    /// Builds alone, and what further threads bring
    Build(BuildArgs),
    /// The tables and claims of Hunt and Mark's paper, with our figures beside theirs
    Tables(TablesArgs),
}

/// `rayward bench frames`
#[derive(Debug, Args)]
struct FramesArgs {
    /// Built-in scenes, scenes of the scenes folder by name, or files; all that are there unless given
    scenes: Vec<String>,
    /// Kinds of frames
    #[arg(long, value_name = "KINDS", value_delimiter = ',', default_values = ["eye", "eye+hard", "eye+soft8"])]
    frames: Vec<Kind>,
    /// Width and height of the pictures
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1920x1200")]
    resolution: Size,
    /// Worker threads of every contender
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = threads())]
    threads: u32,
    /// Only Rayward
    #[arg(long)]
    no_peers: bool,
    /// Folder for the pictures that were compared
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench scaling`
#[derive(Debug, Args)]
struct ScalingArgs {
    /// Small sizes only
    #[arg(long)]
    quick: bool,
    /// Most worker threads; one for each core unless given
    #[arg(long, value_name = "NUMBER", value_parser = threads())]
    threads: Option<u32>,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench build`
#[derive(Debug, Args)]
struct BuildArgs {
    /// Built-in scenes, scenes of the scenes folder by name, or files; all that are there unless given
    scenes: Vec<String>,
    /// Width and height of the pictures
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1920x1200")]
    resolution: Size,
    /// Worker threads that one is compared with
    #[arg(long, value_name = "NUMBER", default_value_t = 2, value_parser = threads())]
    threads: u32,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench tables`
#[derive(Debug, Args)]
struct TablesArgs {
    /// Width and height of Table 1's pictures; the others are square
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "1920x1200")]
    resolution: Size,
    /// Worker threads of the parallel columns; one for each core unless given
    #[arg(long, value_name = "NUMBER", value_parser = threads())]
    threads: Option<u32>,
    #[command(flatten)]
    run: MeasureArgs,
}

fn threads() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=1024)
}

/// How it is measured and told.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
struct MeasureArgs {
    /// Runs of each measurement
    #[arg(long, value_name = "NUMBER", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    runs: u32,
    /// One JSON object on standard output
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Comma-separated values on standard output
    #[arg(long)]
    csv: bool,
    /// Nothing but errors on standard error
    #[arg(short, long)]
    quiet: bool,
}

/// A kind of frame by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// Eye rays
    Eye,
    /// Eye rays, and a hard shadow ray from every hit
    #[value(name = "eye+hard")]
    EyeHard,
    /// Eye rays, and eight shadow rays from every hit to an area light
    #[value(name = "eye+soft8")]
    EyeSoft,
}

impl From<Kind> for FrameKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Eye => Self::Eye,
            Kind::EyeHard => Self::EyeHard,
            Kind::EyeSoft => Self::EyeSoft,
        }
    }
}

/// Measures and tells.
pub(crate) fn run(args: &BenchArgs) -> Result<(), Failure> {
    match &args.what {
        What::Frames(args) => run_frames(args),
        What::Scaling(args) => run_scaling(args),
        What::Build(args) => run_build(args),
        What::Tables(args) => run_tables(args),
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
        runs: args.run.runs as usize,
        peers: !args.no_peers,
        ..FramesOptions::default()
    };
    let scenes = load(&args.scenes, &args.run)?;
    let mut problem = None;
    let mut keep = |name: &str, picture: &Picture| {
        if let (Some(folder), None) = (&args.pictures, &problem) {
            problem = write(folder, name, &options, picture).err();
        }
    };
    let measured = frames::measure(&scenes, &options, &mut |what| args.run.progress(what), &mut keep)?;
    if let Some(problem) = problem {
        return Err(problem);
    }
    tell(
        &args.run,
        &measured,
        table::frames(&measured),
        table::frames_csv(&measured),
    )?;
    judge(&measured)
}

fn run_scaling(args: &ScalingArgs) -> Result<(), Failure> {
    let options = ScalingOptions {
        quick: args.quick,
        threads: args.threads.map_or_else(cores, |threads| threads as usize),
        runs: args.run.runs as usize,
        level: SimdLevel::detect(),
    };
    let measured = scaling::measure(&options, &mut |what| args.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        table::scaling(&measured),
        table::scaling_csv(&measured),
    )
}

fn run_build(args: &BuildArgs) -> Result<(), Failure> {
    let options = BuildOptions {
        width: args.resolution.width,
        height: args.resolution.height,
        threads: args.threads as usize,
        runs: args.run.runs as usize,
        level: SimdLevel::detect(),
    };
    let scenes = load(&args.scenes, &args.run)?;
    let measured = build::measure(&scenes, &options, &mut |what| args.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        table::build(&measured),
        table::build_csv(&measured),
    )
}

fn run_tables(args: &TablesArgs) -> Result<(), Failure> {
    let options = TablesOptions {
        size: [args.resolution.width, args.resolution.height],
        threads: args.threads.map_or_else(cores, |threads| threads as usize),
        runs: args.run.runs as usize,
        level: SimdLevel::detect(),
        folder: folder(),
    };
    let measured = tables::measure(&options, &mut |what| args.run.progress(what))?;
    tell(
        &args.run,
        &measured,
        table::tables(&measured),
        table::tables_csv(&measured),
    )
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
    let folder = folder();
    let names: Vec<&str> = match names {
        [] => rayward_bench::all_scenes(folder.is_some()).collect(),
        names => names.iter().map(String::as_str).collect(),
    };
    let load = |name: &str| {
        args.progress(&format!("{name}: reading"));
        Ok(BenchScene::load(name, folder.as_deref())?)
    };
    names.into_iter().map(load).collect()
}

impl MeasureArgs {
    fn progress(&self, what: &str) {
        if !self.quiet {
            report::note(&report::clean(what));
        }
    }
}

/// Writes a report in the form that was asked for.
fn tell(args: &MeasureArgs, json: &impl serde::Serialize, text: String, csv: String) -> Result<(), Failure> {
    if args.json {
        return report::to_stdout_json(json);
    }
    let text = if args.csv { csv } else { text };
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
