//! `rayward render`: a scene to a picture.

use std::time::Instant;

use rayward::scene::{FrameGeometry, PosedCamera};
use rayward::{
    Antialias, Environment, Lens, Moment, Progress, RenderOptions, RenderedFrame, Renderer, Shutter,
    add_motion,
};

use crate::args::{PictureArgs, RenderArgs, RunArgs, ViewArgs};
use crate::failure::{Code, Failure};
use crate::gpu::Device;
use crate::input::{self, Input};
use crate::machine;
use crate::output::Targets;
use crate::progress::Bar;
use crate::report;
use crate::summary::{Summary, Times};
use crate::values::{Antialiasing, GpuUse, Size};
use crate::view::View;

/// Renders, writes and tells what it cost.
pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    let start = Instant::now();
    let targets = targets(args)?;
    let level = machine::simd_level(args.run.simd.as_deref())?;
    machine::start_threads(args.run.threads)?;
    let options = RenderOptions {
        layers: targets.layers,
        shard: args.shard,
        level,
        environment_samples: args.view.environment_samples,
        ..options(&args.picture)
    };

    check_memory(&options, targets.bytes_a_pixel())?;
    check_costs(&options, &args.picture, &args.run)?;

    let bar = Bar::new(!args.run.quiet);
    bar.phase("reading");
    let environment = environment(&args.view)?;
    let input = Input::read(&args.source)?;
    bar.phase("posing");
    let pose_start = Instant::now();
    let frame = input.pose(&args.moment)?;
    let pose = pose_start.elapsed();
    check_not_empty(&input, &frame)?;
    let aspect = f64::from(options.width) / f64::from(options.height);
    let view = View::choose(&args.view, &input, &frame, aspect)?;

    bar.phase("preparing");
    let prepare_start = Instant::now();
    let mut renderer = Renderer::new(&input.scene);
    renderer.set_environment(environment);
    let device = Device::open(&args.run, &mut renderer)?;
    let prepare = prepare_start.elapsed();
    bar.phase("rendering");
    let show = |progress| bar.show(progress);
    let options = RenderOptions {
        lens: lens(&args.picture, &view.camera, &frame),
        ambient: args.picture.ambient.unwrap_or(view.ambient),
        ..options
    };
    let close = |seconds| {
        let close = input.pose(&args.moment.after(seconds))?;
        let camera = View::choose(&args.view, &input, &close, aspect)?.camera;
        Ok::<_, Failure>((close, camera))
    };
    let closed = args.picture.shutter.map(close).transpose()?;
    // Nothing is before the first moment.
    let moves = options.layers.motion && args.moment.time > 0.0;
    let before = moves
        .then(|| close(-args.motion_time.min(f64::from(args.moment.time))))
        .transpose()?;
    let others = (closed.as_ref(), before.as_ref());
    let mut rendered = picture(&mut renderer, (&frame, &view), others, &options, &show)?;
    device.close(args.run.quiet)?;
    bar.phase("writing");
    let write_start = Instant::now();
    let files = targets.write(&mut rendered.film)?;
    let write = write_start.elapsed();
    drop(bar);

    if args.run.quiet && !args.run.json {
        return Ok(());
    }
    let times = Times {
        load: input.load,
        pose,
        prepare,
        write,
        total: start.elapsed(),
    };
    let summary = Summary::new(
        &input,
        &args.moment,
        &view,
        &options,
        &rendered.stats,
        &times,
        files,
    )
    .with_device(&device);
    tell(&summary, args.run.json)
}

/// Tells what a picture was made of and what it cost.
fn tell(summary: &Summary, json: bool) -> Result<(), Failure> {
    if json {
        return report::to_stdout_json(summary);
    }
    report::note(&summary.text());
    Ok(())
}

/// Where the picture, or the part of it, goes.
fn targets(args: &RenderArgs) -> Result<Targets, Failure> {
    let (target, tone, json) = (&args.target, &args.picture.tone, args.run.json);
    match args.shard {
        Some(shard) => Targets::of_part(target, shard, tone, json),
        None => Targets::new(target, tone, json),
    }
}

/// A scene that only lost triangles is no empty scene.
fn check_not_empty(input: &Input, frame: &FrameGeometry) -> Result<(), Failure> {
    if !frame.is_empty() {
        return Ok(());
    }
    let (broken, flat) = (frame.dropped_non_finite, frame.dropped_degenerate);
    Err(Failure::new(
        Code::Input,
        format_args!(
            "{}: no triangles are left: {broken} not finite, {flat} without area",
            input.path.display()
        ),
    ))
}

/// Costs are told of structures that frames on the CPU without a lens or a shutter have.
pub(crate) fn check_costs(
    options: &RenderOptions,
    picture: &PictureArgs,
    run: &RunArgs,
) -> Result<(), Failure> {
    let other = [
        (picture.aperture.is_some(), "--aperture"),
        (picture.shutter.is_some(), "--shutter"),
        (picture.reference, "--reference"),
        (run.gpu != GpuUse::Off, "--gpu"),
    ];
    match other.into_iter().find(|(given, _)| *given) {
        Some((_, name)) if options.layers.cost => Err(Failure::new(
            Code::Usage,
            format_args!("{name}: costs are counted of other structures than those it uses"),
        )),
        _ => Ok(()),
    }
}

/// Geometry and camera of another moment.
pub(crate) type Other = (FrameGeometry, PosedCamera);

/// The picture of a frame; others are what is seen when the shutter closes, and before, for motion, if asked for.
pub(crate) fn picture(
    renderer: &mut Renderer,
    (frame, view): (&FrameGeometry, &View),
    (closed, before): (Option<&Other>, Option<&Other>),
    options: &RenderOptions,
    show: &(dyn Fn(Progress) + Sync),
) -> Result<RenderedFrame, Failure> {
    let (camera, lights) = (&view.camera, &view.lights);
    let mut rendered = match closed {
        Some((geometry, closing)) => {
            let shutter = Shutter {
                geometry,
                camera: closing,
            };
            renderer.render_shutter(frame, camera, shutter, lights, options, show)
        }
        None => renderer.render(frame, camera, lights, options, show),
    }?;
    if let Some((geometry, camera)) = before {
        let now = Moment {
            geometry: frame,
            camera: &view.camera,
        };
        add_motion(&mut rendered.film, now, Moment { geometry, camera })?;
    }
    Ok(rendered)
}

/// A picture that cannot fit is an error now instead of a killed process later.
///
/// `pixel` is what it takes in bytes, film and writing together.
pub(crate) fn check_memory(options: &RenderOptions, pixel: u64) -> Result<(), Failure> {
    let (width, height) = (options.width, options.height);
    let mean = match options.antialias {
        _ if options.pixel_samples <= 1 => 0,
        // Colour and alpha once more, and some shares of 40 bytes.
        Antialias::Coverage => 80,
        // Colour and alpha once more, to sum them up.
        _ => 16,
    };
    let bytes = u128::from(width) * u128::from(height) * u128::from(pixel + mean);
    match machine::available_memory() {
        Some(memory) if bytes > u128::from(memory) => Err(Failure::new(
            Code::Limit,
            format_args!(
                "a picture of {width}x{height} takes {bytes} bytes to make and write, {memory} could be had now"
            ),
        )),
        _ => Ok(()),
    }
}

/// The environment asked for, turned and scaled.
pub(crate) fn environment(args: &ViewArgs) -> Result<Option<Environment>, Failure> {
    let Some(file) = &args.environment else {
        return Ok(None);
    };
    let read = Environment::read(file)?;
    Ok(Some(
        read.turned(args.environment_rotation.to_radians())
            .scaled(args.environment_intensity),
    ))
}

/// The lens asked for, focused on the middle of the scene if on nothing else.
pub(crate) fn lens(args: &PictureArgs, camera: &PosedCamera, frame: &FrameGeometry) -> Option<Lens> {
    let middle = || (input::center(frame) - camera.eye).dot(camera.forward);
    args.aperture.map(|diameter| Lens {
        radius: 0.5 * diameter,
        focus: args.focus.unwrap_or_else(middle),
    })
}

/// What the arguments ask of a frame.
pub(crate) fn options(args: &PictureArgs) -> RenderOptions {
    let defaults = RenderOptions::default();
    let size = size(args, &defaults);
    let coverage = args.antialias == Antialiasing::Coverage;
    let several = args.aperture.is_some() || args.shutter.is_some() || coverage;
    RenderOptions {
        width: size.width,
        height: size.height,
        shadows: !args.no_shadows,
        casters: args.casters.into(),
        shadow_structure: args.shadow_structure.into(),
        samples: args.samples,
        seed: args.seed,
        tinted_shadows: args.tinted_shadows,
        background: args.background.unwrap_or(defaults.background),
        show_environment: args.background.is_none(),
        bounces: args.bounces,
        diffuse_bounces: args.diffuse_bounces.min(args.bounces),
        pixel_filter: args.pixel_filter.into(),
        pixel_samples: args.pixel_samples.unwrap_or(if several { 16 } else { 1 }),
        antialias: args.antialias.into(),
        paper: args.paper,
        reference: args.reference,
        ..defaults
    }
}

/// The size asked for; a side that was left out follows from the other at the aspect of the defaults.
fn size(args: &PictureArgs, defaults: &RenderOptions) -> Size {
    let follow = |side: u32, from: u32, to: u32| {
        let followed = (f64::from(side) * f64::from(to) / f64::from(from)).round();
        (followed as u32).max(1)
    };
    let (w, h) = (defaults.width, defaults.height);
    if let Some(size) = args.resolution {
        return size;
    }
    let (width, height) = match (args.width, args.height) {
        (Some(width), Some(height)) => (width, height),
        (Some(width), None) => (width, follow(width, w, h)),
        (None, Some(height)) => (follow(height, h, w), height),
        (None, None) => (w, h),
    };
    Size { width, height }
}
