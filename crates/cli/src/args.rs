//! The command line.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use glam::{DVec3, Vec3};
use rayward::Shard;
use rayward::scene::builtin;

use crate::bench::BenchArgs;
use crate::values::{
    self, Antialiasing, Casters, Exposure, Filter, GpuShadingUse, GpuUse, LayerName, LightValue, Operator,
    SecondaryUse, Shadows, Shown, Size, Span, Up,
};

const HELP: &str = "\
Examples:
  rayward render                                  the built-in scene `courtyard` to rayward.png
  rayward render model.glb -o model.png           a picture of a file
  rayward info model.glb                          what is in it
  rayward compare before.png after.png            exit code 5 if they differ

Exit codes:
  0    done
  1    runtime failure, for instance an output that cannot be written
  2    usage: the command line makes no sense
  3    an input cannot be read, is malformed or not supported
  4    an input or a picture is over a limit
  5    compare: the pictures differ by more than is tolerated
  130  interrupted by Ctrl-C (143 terminated, 129 hung up); no file is left unfinished";

const RENDER_HELP: &str = "\
Coordinates are those of the scene as it is rendered: metres, right-handed, +Y up.

Examples:
  rayward render
  rayward render --builtin forest --time 1.5 --resolution 1280x720 -o forest.png
  rayward render part.stl --up z --scale 0.001 -o part.png
  rayward render city.glb --camera-position 40,30,60 --light sun:1,2,1 -o city.png
  rayward render --builtin walker --time 0.4 --shutter 0.04 --pixel-samples 32 -o walk.png
  rayward render --aperture 0.2 --focus 8 -o blurred.png
  rayward render --antialias coverage -o smooth.png
  rayward render model.glb --environment sky.hdr --exposure auto -o model.png
  rayward render model.glb --light square:0,3,1:0.5 --samples 64 -o soft.png
  rayward render model.glb --layers depth,normal -o model.exr
  rayward render model.glb --layers motion,cost -o costs.exr
  rayward render model.glb --show nodes -o nodes.png
  rayward render model.glb --npy layers --json > summary.json
  rayward render model.glb --shard 2/4            the second of four processes that share the picture
  rayward render model.glb -o - | display";

const ANIMATE_HELP: &str = "\
Frame K shows the moment K / rate; the last frame is the one before the end. With --json, one object a frame and line.

Examples:
  rayward animate --builtin walker -o walk-####.png
  rayward animate model.glb --animation Run --rate 30 --seconds 0..2 -o out/run-###.exr
  rayward animate model.glb --frames 0..120 --turn 360 -o turn-####.png
  rayward animate model.glb --turn 360 --frames 0..48 -o turn.gif
  rayward animate model.glb --resume              goes on after it was stopped
  rayward animate model.glb --shard 1/4           the first of four processes that share the frames";

const MERGE_HELP: &str = "\
Parts are those that `rayward render --shard` makes: joined they are the picture that one run of it makes, bit for bit,
with the tone map given here. A movie is an --output of .apng, .gif or, by an installed ffmpeg, .mp4, .webm or .mkv.

Examples:
  rayward render --shard 1/2                      on one machine
  rayward render --shard 2/2                      on another
  rayward merge rayward-*-of-2.exr -o courtyard.png
  rayward merge walk-????.png --rate 30 -o walk.gif";

/// Pictures of scenes, ray traced on the CPU: one structure for every camera and light, rebuilt every frame
#[derive(Debug, Parser)]
#[command(name = "rayward", version, arg_required_else_help = true, after_help = HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Render a scene to a picture
    Render(Box<RenderArgs>),
    /// Render the frames of an animation, or of a turn around the scene, to numbered pictures or a movie
    Animate(Box<AnimateArgs>),
    /// Join the parts of a picture, or numbered pictures to a movie
    Merge(MergeArgs),
    /// Say what is in a scene, and what of it will be skipped
    Info(InfoArgs),
    /// Compare two pictures of the same size
    Compare(CompareArgs),
    /// Say what this build uses of this machine, and test that it works
    Doctor(DoctorArgs),
    /// Measure, beside other ray tracers
    Bench(BenchArgs),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}

/// Where the scene comes from.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub(crate) struct SourceArgs {
    /// Scene file: .glb, .gltf, .obj, .ply or .stl
    pub(crate) scene: Option<PathBuf>,
    /// A built-in scene instead of a file
    #[arg(long, value_name = "NAME", conflicts_with = "scene",
        value_parser = PossibleValuesParser::new(builtin::NAMES))]
    pub(crate) builtin: Option<String>,
    /// The file's up axis
    #[arg(
        long,
        value_name = "AXIS",
        default_value = "y",
        requires = "scene",
        conflicts_with = "builtin"
    )]
    pub(crate) up: Up,
    /// Metres per unit of the file
    #[arg(long, value_name = "METRES", default_value_t = 1.0, value_parser = values::positive, requires = "scene",
        conflicts_with = "builtin")]
    pub(crate) scale: f64,
}

/// Which moment of the scene.
#[derive(Debug, Args)]
#[command(next_help_heading = "Scene")]
pub(crate) struct MomentArgs {
    /// Moment of the animation in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, value_parser = values::single,
        allow_hyphen_values = true)]
    pub(crate) time: f32,
    /// Which animation plays, by name or index; the first unless given
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) animation: Option<String>,
}

impl MomentArgs {
    /// The same animation this much later.
    pub(crate) fn after(&self, seconds: f64) -> Self {
        Self {
            time: (f64::from(self.time) + seconds) as f32,
            animation: self.animation.clone(),
        }
    }
}

/// Camera and lights.
#[derive(Debug, Args)]
#[command(next_help_heading = "Camera and lights")]
pub(crate) struct ViewArgs {
    /// A camera of the scene by name or index; the first unless given
    #[arg(long, value_name = "NAME|INDEX", conflicts_with_all = ["camera_file", "camera_position"])]
    pub(crate) camera: Option<String>,
    /// Camera and light from a JSON file of entries by scene; its point light is used, or else its area light
    #[arg(long, value_name = "FILE", conflicts_with = "camera_position")]
    pub(crate) camera_file: Option<PathBuf>,
    /// The entry of the camera file; the one of the scene's file unless given
    #[arg(long, value_name = "NAME", requires = "camera_file")]
    pub(crate) camera_entry: Option<String>,
    /// Place of the camera, x,y,z
    #[arg(long, value_name = "POINT", value_parser = values::vector, allow_hyphen_values = true)]
    pub(crate) camera_position: Option<DVec3>,
    /// Point that the camera looks at; the middle of the scene unless given
    #[arg(long, value_name = "POINT", value_parser = values::vector, allow_hyphen_values = true,
        requires = "camera_position")]
    pub(crate) camera_target: Option<DVec3>,
    /// Direction that is up in the picture
    #[arg(long, value_name = "DIRECTION", value_parser = values::direction, allow_hyphen_values = true,
        requires = "camera_position", default_value = "0,1,0")]
    pub(crate) camera_up: DVec3,
    /// Full vertical field of view in degrees, for whichever camera is used
    #[arg(long, value_name = "DEGREES", value_parser = values::field_of_view)]
    pub(crate) camera_vfov: Option<f64>,
    /// The camera file's area light instead of its point light
    #[arg(long, requires = "camera_file")]
    pub(crate) area_light: bool,
    /// A light instead of the scene's, repeatable: point:x,y,z[:candela] stands there, sun:x,y,z[:lux[:degrees]] shines
    /// from that direction and is so many degrees across. Lights with soft shadows: sphere:x,y,z:radius[:candela];
    /// disk:x,y,z:radius[:nits] and square:x,y,z:side[:nits], which face the middle of the scene. Without an
    /// intensity, a white matt surface in the middle of the scene shows radiance 1
    #[arg(long = "light", value_name = "LIGHT", value_parser = values::light)]
    pub(crate) lights: Vec<LightValue>,
    /// Image of the light from all directions, .hdr or .exr, equirectangular with +Z in the middle: lights the
    /// scene, and is seen behind it and in mirrors. No light is made up then
    #[arg(long, value_name = "FILE")]
    pub(crate) environment: Option<PathBuf>,
    /// Turn of the environment around +Y in degrees, counter-clockwise as seen from above
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, value_parser = values::single,
        allow_hyphen_values = true, requires = "environment")]
    pub(crate) environment_rotation: f32,
    /// Factor on the environment's radiance
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = values::factor,
        requires = "environment")]
    pub(crate) environment_intensity: f32,
    /// Directions of the environment that each surface seen asks about
    #[arg(long, value_name = "NUMBER", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=4096),
        requires = "environment")]
    pub(crate) environment_samples: u32,
}

/// `rayward render`
#[derive(Debug, Args)]
#[command(after_help = RENDER_HELP)]
pub(crate) struct RenderArgs {
    #[command(flatten)]
    pub(crate) source: SourceArgs,
    #[command(flatten)]
    pub(crate) moment: MomentArgs,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    #[command(flatten)]
    pub(crate) target: TargetArgs,
    /// How long before the moment of --time motion starts, for the layer motion and --show motion
    #[arg(long, value_name = "SECONDS", value_parser = values::positive, default_value_t = 1.0 / 24.0,
        help_heading = "Output")]
    pub(crate) motion_time: f64,
    /// The I-th of N shares of the picture, I/N: an .exr file, rayward-I-of-N.exr unless --output names another, which
    /// `rayward merge` joins with the others
    #[arg(long, value_name = "I/N", value_parser = values::shard, conflicts_with = "npy", help_heading = "Output")]
    pub(crate) shard: Option<Shard>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// `rayward animate`
#[derive(Debug, Args)]
#[command(after_help = ANIMATE_HELP)]
pub(crate) struct AnimateArgs {
    #[command(flatten)]
    pub(crate) source: SourceArgs,
    /// Which animation plays, by name or index; the first unless given
    #[arg(long, value_name = "NAME|INDEX", help_heading = "Scene")]
    pub(crate) animation: Option<String>,
    #[command(flatten)]
    pub(crate) frames: FrameArgs,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    #[command(flatten)]
    pub(crate) picture: PictureArgs,
    /// File of a frame, .png, .exr or .npy: # stands for a digit of its number. Or a movie: .apng, .gif, and by an
    /// installed ffmpeg .mp4, .webm, .mkv
    #[arg(
        short,
        long,
        value_name = "FILE",
        default_value = "frame-####.png",
        help_heading = "Output"
    )]
    pub(crate) output: PathBuf,
    /// Layers for .exr besides the colour; all but motion and cost unless given. Motion is that since the frame before
    #[arg(long, value_name = "LAYERS", value_delimiter = ',', help_heading = "Output")]
    pub(crate) layers: Vec<LayerName>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// `rayward merge`
#[derive(Debug, Args)]
#[command(after_help = MERGE_HELP)]
pub(crate) struct MergeArgs {
    /// All parts of a picture, or pictures of one size in the order of the movie
    #[arg(required = true, value_name = "FILES")]
    pub(crate) pictures: Vec<PathBuf>,
    /// Pictures a second, for a movie
    #[arg(long, value_name = "NUMBER", default_value_t = 24.0, value_parser = values::positive)]
    pub(crate) rate: f64,
    #[command(flatten)]
    pub(crate) tone: ToneArgs,
    #[command(flatten)]
    pub(crate) target: TargetArgs,
    /// No progress
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Which frames.
#[derive(Debug, Args)]
#[command(next_help_heading = "Frames")]
pub(crate) struct FrameArgs {
    /// Frames a second
    #[arg(long, value_name = "NUMBER", default_value_t = 24.0, value_parser = values::positive)]
    pub(crate) rate: f64,
    /// Frames from the first to the one before the end, FIRST..END; all of the animation unless given
    #[arg(long, value_name = "FRAMES", value_parser = values::frames, conflicts_with = "seconds")]
    pub(crate) frames: Option<Span<u32>>,
    /// The same by time, FROM..TO in seconds
    #[arg(long, value_name = "TIME", value_parser = values::seconds)]
    pub(crate) seconds: Option<Span<f64>>,
    /// The camera goes around the scene, by so many degrees over all frames
    #[arg(long, value_name = "DEGREES", value_parser = values::degrees, allow_hyphen_values = true)]
    pub(crate) turn: Option<f64>,
    /// Frames whose file is there are left out, and what a killed run has left unfinished is removed
    #[arg(long)]
    pub(crate) resume: bool,
    /// The I-th of N shares of the frames, I/N
    #[arg(long, value_name = "I/N", value_parser = values::shard)]
    pub(crate) shard: Option<Shard>,
}

/// How the picture is made.
#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub(crate) struct PictureArgs {
    /// Width in pixels; follows from the height at 16:9, or is 1920
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) width: Option<u32>,
    /// Height in pixels; follows from the width at 16:9, or is 1080
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) height: Option<u32>,
    /// Width and height in one
    #[arg(long, value_name = "WxH", value_parser = values::size, conflicts_with_all = ["width", "height"])]
    pub(crate) resolution: Option<Size>,
    /// Lights cast no shadows
    #[arg(long)]
    pub(crate) no_shadows: bool,
    /// Samples of a light with a size, and of a glossy reflection, for each surface that a pixel sees
    #[arg(long, value_name = "NUMBER", default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub(crate) samples: u32,
    /// Chooses the samples: the same number gives the same picture
    #[arg(long, value_name = "NUMBER", default_value_t = 0)]
    pub(crate) seed: u32,
    /// Which sides of triangles cast shadows
    #[arg(long, value_name = "SIDES", default_value = "auto", conflicts_with = "paper")]
    pub(crate) casters: Casters,
    /// What finds the hard shadows of a light without a size; auto takes what is predicted to cost least. The picture does
    /// not depend on it
    #[arg(long, value_name = "STRUCTURE", default_value = "auto",
        conflicts_with_all = ["paper", "reference", "aperture", "shutter"])]
    pub(crate) shadow_structure: Shadows,
    /// Blended surfaces colour the light they let through, as stained glass does; they dim it otherwise
    #[arg(long, conflicts_with = "no_shadows")]
    pub(crate) tinted_shadows: bool,
    #[command(flatten)]
    pub(crate) tone: ToneArgs,
    /// Linear colour where nothing is seen, r,g,b, also before an environment
    #[arg(long, value_name = "COLOR", value_parser = values::color)]
    pub(crate) background: Option<Vec3>,
    /// Linear colour of the light from all around, r,g,b; 0.1 where lights are made up and in built-in scenes, none with
    /// lights of a file or the command line
    #[arg(long, value_name = "COLOR", value_parser = values::color, conflicts_with = "environment")]
    pub(crate) ambient: Option<Vec3>,
    /// Longest chain of reflections and refractions; 0 traces none
    #[arg(long, value_name = "NUMBER", default_value_t = 8, value_parser = clap::value_parser!(u32).range(0..=64))]
    pub(crate) bounces: u32,
    /// How many of these may be diffuse, for light from other surfaces; needs many samples
    #[arg(long, value_name = "NUMBER", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=64))]
    pub(crate) diffuse_bounces: u32,
    /// Eye rays a pixel, whose mean it is, against jagged edges and noise; 1, or 16 with a lens, a shutter or --antialias
    /// coverage
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(crate) pixel_samples: Option<u32>,
    /// How many of these are shaded. coverage has smooth edges, also of hard shadows, for a fraction of the time; its
    /// --pixel-samples are 16 unless given
    #[arg(long, value_name = "WAY", default_value = "samples",
        conflicts_with_all = ["paper", "reference", "aperture", "shutter", "shadow_structure"])]
    pub(crate) antialias: Antialiasing,
    /// How a pixel weighs its samples, without a lens or a shutter
    #[arg(long, value_name = "FILTER", default_value = "blackman-harris")]
    pub(crate) pixel_filter: Filter,
    /// Diameter of the camera's lens: what is not in the plane of focus is blurred. A lens of 50 mm at f/2 has 0.025
    #[arg(long, value_name = "METRES", value_parser = values::positive, conflicts_with = "environment")]
    pub(crate) aperture: Option<f64>,
    /// Distance of the plane of focus along the view; to the middle of the scene unless given
    #[arg(long, value_name = "METRES", value_parser = values::positive, requires = "aperture")]
    pub(crate) focus: Option<f64>,
    /// How long the shutter is open from the moment of --time on, in which things move on straight lines; lights
    /// stand still
    #[arg(long, value_name = "SECONDS", value_parser = values::positive, conflicts_with = "environment")]
    pub(crate) shutter: Option<f64>,
    /// The literal parameters of Hunt and Mark 2008: 100x100 tiles, 200x200 light grids, binning by bounding
    /// rectangle, back faces alone as casters, surfaces shaded on every pass that finds a closer one, soft shadows as the
    /// share of a light that is seen
    #[arg(long)]
    pub(crate) paper: bool,
    /// Test every triangle for every ray, in f64, to check the structures: the same picture, bit for bit. Small
    /// pictures only
    #[arg(long, conflicts_with = "paper")]
    pub(crate) reference: bool,
}

/// How light becomes what is displayed.
#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub(crate) struct ToneArgs {
    /// From linear colour to what is displayed, for PNG; `none`, or `exposure` where --exposure is given
    #[arg(long, value_name = "OPERATOR")]
    pub(crate) tone_map: Option<Operator>,
    /// Photographic stops, for the tone maps exposure and aces; auto makes the picture's middle a mid grey
    #[arg(long, value_name = "STOPS|auto", value_parser = values::exposure, allow_hyphen_values = true)]
    pub(crate) exposure: Option<Exposure>,
    /// PNG and movies show this in false colours, with a legend, instead of the picture
    #[arg(long, value_name = "MEASURE", conflicts_with_all = ["tone_map", "exposure"])]
    pub(crate) show: Option<Shown>,
}

/// Where the picture goes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct TargetArgs {
    /// File to write, by its ending: .png, .exr (linear, with layers), .npy (linear colour); - is PNG to
    /// standard output. It is rayward.png unless given here or by --npy
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// Folder for one NumPy array a layer: color.npy, depth.npy and so on
    #[arg(long, value_name = "FOLDER")]
    pub(crate) npy: Option<PathBuf>,
    /// Layers for .exr and --npy besides the colour; all but motion and cost unless given
    #[arg(long, value_name = "LAYERS", value_delimiter = ',')]
    pub(crate) layers: Vec<LayerName>,
}

/// How the program runs.
#[derive(Debug, Args)]
#[command(next_help_heading = "Run")]
pub(crate) struct RunArgs {
    /// Worker threads; one for each core unless given. The picture does not depend on it
    #[arg(long, value_name = "NUMBER", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub(crate) threads: Option<u32>,
    /// Instruction set: one that `rayward doctor` lists; the best unless given. The picture does not depend on it
    #[arg(long, value_name = "LEVEL")]
    pub(crate) simd: Option<String>,
    /// Frames on a GPU: eye rays, shadows, reflections and refractions, exact as on the CPU, and shading, up to rounding; auto
    /// takes the CPU where there is none but software
    #[arg(long, value_name = "on|auto|off", default_value = "off", default_missing_value = "on", num_args = 0..=1,
        require_equals = true, conflicts_with_all = ["aperture", "shutter", "reference", "secondary"])]
    pub(crate) gpu: GpuUse,
    /// What shades frames with --gpu; with cpu the picture has the bits of one without --gpu
    #[arg(long, value_name = "WHAT", default_value = "device", requires = "gpu")]
    pub(crate) gpu_shading: GpuShadingUse,
    /// What answers reflections and refractions on the CPU. The picture does not depend on it
    #[arg(long, value_name = "STRUCTURE", default_value = "hierarchy",
        conflicts_with_all = ["aperture", "shutter", "reference"])]
    pub(crate) secondary: SecondaryUse,
    /// The summary as one JSON object on standard output
    #[arg(long)]
    pub(crate) json: bool,
    /// Nothing but errors on standard error
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// `rayward info`
#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    pub(crate) source: SourceArgs,
    #[command(flatten)]
    pub(crate) moment: MomentArgs,
    /// One JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// `rayward compare`
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// The reference: PNG, JPEG, EXR, HDR, NPY or PFM
    pub(crate) a: PathBuf,
    /// The picture compared with it
    pub(crate) b: PathBuf,
    /// Largest mean FLIP (0 equal to 1) that passes; without it no pixel may differ
    #[arg(long, value_name = "FLIP", value_parser = values::not_negative)]
    pub(crate) tolerance: Option<f64>,
    /// PNG to write with the FLIP of every pixel: black where equal, pale yellow where different
    #[arg(long, value_name = "FILE")]
    pub(crate) difference: Option<PathBuf>,
    /// One JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

/// `rayward doctor`
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// One JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        super::Cli::command().debug_assert();
    }
}
