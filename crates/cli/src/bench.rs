//! `rayward bench`: measurements beside other ray tracers, see the crate `rayward-bench`. Its arguments; `bench/run.rs`
//! measures and tells.

mod run;

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};
use rayward_bench::FrameKind;
use rayward_bench::structures::RayClass;

use crate::values::{self, Size};
pub(crate) use run::run;

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
  rayward bench tables
  rayward bench structures model.glb --rays random --csv
  rayward bench all --report report";

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
    /// What a ray costs against triangles, pixels, lights, samples, the light's size, depth complexity, threads and origins
    Scaling(ScalingArgs),
    /// Builds alone, and what further threads bring
    Build(BuildArgs),
    /// The tables and claims of both papers, with our figures beside theirs
    Tables(TablesArgs),
    /// Frames with one improvement taken away, and in the papers' ways; exit code 5 if pictures differ
    Ablation(AblationArgs),
    /// Any structure for any class of rays; exit code 5 if answers differ
    Structures(StructuresArgs),
    /// All of these, with what falls short first
    All(AllArgs),
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
    /// Resolutions of the layered depth cubes
    #[arg(long, value_name = "TEXELS", value_delimiter = ',', default_values = ["512", "1024"], value_parser = texels())]
    cubes: Vec<u32>,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench ablation`
#[derive(Debug, Args)]
struct AblationArgs {
    /// Built-in scenes, scenes of the scenes folder by name, or files; a few built-in ones unless given
    scenes: Vec<String>,
    /// Width and height of the pictures
    #[arg(long, value_name = "WxH", value_parser = values::size, default_value = "960x600")]
    resolution: Size,
    /// Worker threads
    #[arg(long, value_name = "NUMBER", default_value_t = 1, value_parser = threads())]
    threads: u32,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench structures`
#[derive(Debug, Args)]
struct StructuresArgs {
    /// Built-in scenes, scenes of the scenes folder by name, or files; a few built-in ones unless given
    scenes: Vec<String>,
    /// Classes of rays
    #[arg(long, value_name = "CLASSES", value_delimiter = ',', default_values = ["eye", "hard", "soft", "reflection", "random", "through"])]
    rays: Vec<Class>,
    /// Rays of a class, about
    #[arg(long, value_name = "NUMBER", default_value_t = 100_000, value_parser = clap::value_parser!(u32).range(1..=100_000_000))]
    number: u32,
    /// Texels along the longest side of the layered depth cubes
    #[arg(long, value_name = "TEXELS", default_value_t = 512, value_parser = texels())]
    cube: u32,
    /// Only Rayward
    #[arg(long)]
    no_peers: bool,
    #[command(flatten)]
    run: MeasureArgs,
}

/// `rayward bench all`
#[derive(Debug, Args)]
struct AllArgs {
    /// Scenes of frames and builds; the meshes of the scenes folder, or else the built-in scenes, unless given
    scenes: Vec<String>,
    /// Small sizes only
    #[arg(long)]
    quick: bool,
    /// Most worker threads; one for each core unless given
    #[arg(long, value_name = "NUMBER", value_parser = threads())]
    threads: Option<u32>,
    #[command(flatten)]
    run: RunArgs,
}

fn texels() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(16..=4096)
}

fn threads() -> clap::builder::RangedI64ValueParser<u32> {
    clap::value_parser!(u32).range(1..=1024)
}

/// How it is measured and told.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
struct RunArgs {
    /// Runs of each measurement
    #[arg(long, value_name = "NUMBER", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    runs: u32,
    /// Keep each worker thread on a processor of its own
    #[arg(long)]
    pin: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Folder for the report as a page (index.html) and as Markdown (report.md), with its plots
    #[arg(long, value_name = "FOLDER")]
    report: Option<PathBuf>,
    /// Nothing but errors on standard error
    #[arg(short, long)]
    quiet: bool,
}

/// The same, of what has rows.
#[derive(Debug, Args)]
#[command(next_help_heading = "Measuring")]
struct MeasureArgs {
    #[command(flatten)]
    run: RunArgs,
    /// Comma-separated values on standard output
    #[arg(long, conflicts_with = "json")]
    csv: bool,
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

/// A class of rays by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Class {
    /// Of all pixels, closest hits
    Eye,
    /// From what the eye sees to the light
    Hard,
    /// From what the eye sees to eight points of an area light
    Soft,
    /// Mirrored by what the eye sees, closest hits
    Reflection,
    /// Between random points, closest hits
    Random,
    /// Between random points, all hits
    Through,
}

impl From<Class> for RayClass {
    fn from(class: Class) -> Self {
        match class {
            Class::Eye => Self::Eye,
            Class::Hard => Self::Hard,
            Class::Soft => Self::Soft,
            Class::Reflection => Self::Reflection,
            Class::Random => Self::Random,
            Class::Through => Self::Through,
        }
    }
}
