//! `rayward animate`: the frames of an animation, or of a turn around the scene, to numbered pictures or a movie.
//!
//! Frame k shows the moment k / rate. Every frame is rendered by itself, so frames that were left out, made by
//! another process or made again are the same to the bit; files are put in place as wholes, so one that is there is
//! done. Geometry and renderer are kept from frame to frame, and structures are built anew in each.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DQuat;
use rayward::image_io::{MovieOptions, is_movie, remove_abandoned, write_movie};
use rayward::scene::{FrameGeometry, PosedCamera};
use rayward::{FrameStats, RenderOptions, RenderedFrame, Renderer};
use serde::Serialize;

use crate::args::{AnimateArgs, FrameArgs, TargetArgs};
use crate::failure::{Code, Failure};
use crate::gpu::{Device, DeviceSummary};
use crate::input::{self, Input};
use crate::machine;
use crate::output::Targets;
use crate::progress::Bar;
use crate::render::{check_costs, check_memory, environment, lens, options, picture};
use crate::report::{self, count, duration, milliseconds};
use crate::values::Span;
use crate::view::View;

/// One frame; its fields are those of the JSON object, one to a line.
#[derive(Serialize)]
struct FrameReport {
    frame: u32,
    time_s: f64,
    file: String,
    triangles: usize,
    eye_rays: u64,
    shadow_rays: u64,
    pose_ms: f64,
    build_ms: f64,
    trace_ms: f64,
    write_ms: f64,
    peak_memory_bytes: Option<u64>,
    /// What a GPU did up to here, if frames are made on one.
    gpu: Option<DeviceSummary>,
}

/// What all frames share.
struct Job<'a> {
    args: &'a AnimateArgs,
    input: &'a Input,
    animation: usize,
    frames: Span<u32>,
    options: RenderOptions,
    renderer: Renderer<'a>,
    device: Device,
    geometry: FrameGeometry,
}

/// Renders all frames that were asked for and are not there.
pub(crate) fn run(args: &AnimateArgs) -> Result<(), Failure> {
    let start = Instant::now();
    let level = machine::simd_level(args.run.simd.as_deref())?;
    let movie = is_movie(&args.output);
    if movie && (args.frames.resume || args.frames.shard.is_some()) {
        return Err(Failure::new(
            Code::Usage,
            format_args!(
                "--output {}: a movie is made in one go; --resume and --shard are for numbered pictures, which \
                 `rayward merge` joins",
                args.output.display()
            ),
        ));
    }
    let first = target(args, 0)?;
    let options = RenderOptions {
        layers: first.layers,
        level,
        environment_samples: args.view.environment_samples,
        ..options(&args.picture)
    };
    check_memory(&options, first.bytes_a_pixel())?;
    check_costs(&options, &args.picture, &args.run)?;
    machine::start_threads(args.run.threads)?;
    let bar = Bar::of_frames(!args.run.quiet);
    bar.phase("reading");
    let environment = environment(&args.view)?;
    let input = Input::read(&args.source)?;
    input.check_size()?;
    let animation = input.animation(args.animation.as_deref())?;
    let frames = frames(&args.frames, &input, animation)?;
    let wanted: Vec<u32> = (frames.start..frames.end)
        .filter(|&frame| args.frames.shard.is_none_or(|shard| shard.has(frame)))
        .filter(|&frame| !(args.frames.resume && numbered(&args.output, frame).is_file()))
        .collect();

    if args.frames.resume {
        clean_up(&args.output)?;
    }
    bar.phase("rendering");
    bar.frames(wanted.len() as u64);
    let mut renderer = Renderer::new(&input.scene);
    renderer.set_environment(environment);
    let device = Device::open(&args.run, &mut renderer)?;
    let mut job = Job {
        args,
        input: &input,
        animation,
        frames,
        options,
        renderer,
        device,
        geometry: FrameGeometry::default(),
    };
    if movie {
        job.movie(&wanted, &first, &bar)?;
    } else {
        for &frame in &wanted {
            job.frame(frame, &bar, |rendered| {
                target(args, frame)?.write(&mut rendered.film)
            })?;
        }
    }
    drop(bar);
    job.device.close(args.run.quiet)?;
    if !args.run.quiet {
        let there = (frames.end - frames.start) as usize - wanted.len();
        report::note(&format!(
            "{} rendered in {}, {there} left out",
            count(wanted.len(), "frame"),
            duration(start.elapsed())
        ));
    }
    Ok(())
}

impl Job<'_> {
    /// Renders a frame, has it written, which gives its files, and reports it.
    fn frame(
        &mut self,
        frame: u32,
        bar: &Bar,
        write: impl FnOnce(&mut RenderedFrame) -> Result<Vec<PathBuf>, Failure>,
    ) -> Result<(), Failure> {
        let args = self.args;
        let pose = Instant::now();
        let mut geometry = std::mem::take(&mut self.geometry);
        let view = self.pose(f64::from(frame), &mut geometry)?;
        let other = |frames: f64| {
            let mut other = FrameGeometry::default();
            let camera = self.pose(f64::from(frame) + frames, &mut other)?.camera;
            Ok::<_, Failure>((other, camera))
        };
        let shutter = args.picture.shutter;
        let closed = shutter
            .map(|seconds| other(seconds * args.frames.rate))
            .transpose()?;
        // Nothing is before the first moment.
        let moves = self.options.layers.motion && frame > 0;
        let before = moves.then(|| other(-1.0)).transpose()?;
        let pose_ms = milliseconds(pose.elapsed());
        let options = RenderOptions {
            lens: lens(&args.picture, &view.camera, &geometry),
            ambient: args.picture.ambient.unwrap_or(view.ambient),
            ..self.options
        };
        let seen = (&geometry, &view);
        let others = (closed.as_ref(), before.as_ref());
        let mut rendered = picture(&mut self.renderer, seen, others, &options, &|_| ())?;
        self.geometry = geometry;
        let writing = Instant::now();
        let files = write(&mut rendered)?;
        bar.next_frame();
        if args.run.json {
            let write_ms = milliseconds(writing.elapsed());
            let time = f64::from(frame) / args.frames.rate;
            let report = FrameReport {
                gpu: self.device.summary(),
                ..FrameReport::new(frame, time, &files, &rendered.stats, pose_ms, write_ms)
            };
            report::to_stdout_json_line(&report)?;
        }
        Ok(())
    }

    /// Poses a frame, or a moment between two, and its view.
    fn pose(&self, frame: f64, geometry: &mut FrameGeometry) -> Result<View, Failure> {
        let (args, frames) = (self.args, self.frames);
        let time = (frame / args.frames.rate) as f32;
        self.input
            .scene
            .at_animation(Some(self.animation), time, geometry);
        let aspect = f64::from(self.options.width) / f64::from(self.options.height);
        let mut view = View::choose(&args.view, self.input, geometry, aspect)?;
        if let Some(degrees) = args.frames.turn {
            let share = (frame - f64::from(frames.start)) / f64::from(frames.end - frames.start);
            turn(&mut view.camera, geometry, (degrees * share).to_radians());
        }
        Ok(view)
    }

    /// Renders all frames into one file.
    fn movie(&mut self, frames: &[u32], target: &Targets, bar: &Bar) -> Result<(), Failure> {
        let path = &self.args.output;
        let [width, height] = target.encoded_size(self.options.width, self.options.height);
        let movie = MovieOptions {
            width,
            height,
            frames: frames.len() as u32,
            rate: self.args.frames.rate,
        };
        let mut next = frames.iter();
        write_movie(path, &movie, |rgb| match next.next() {
            Some(&frame) => self.frame(frame, bar, |rendered| {
                *rgb = target.encode(&rendered.film)?.rgb;
                Ok(vec![path.clone()])
            }),
            None => Ok(()),
        })
    }
}

impl FrameReport {
    fn new(
        frame: u32,
        time_s: f64,
        files: &[PathBuf],
        stats: &FrameStats,
        pose_ms: f64,
        write_ms: f64,
    ) -> Self {
        Self {
            frame,
            time_s,
            file: files
                .first()
                .map(|file| file.display().to_string())
                .unwrap_or_default(),
            triangles: stats.triangles,
            eye_rays: stats.eye_rays,
            shadow_rays: stats.shadow_rays,
            pose_ms,
            build_ms: milliseconds(stats.build),
            trace_ms: milliseconds(stats.trace),
            write_ms,
            peak_memory_bytes: machine::peak_memory(),
            gpu: None,
        }
    }
}

/// Removes what a run that was killed has left unfinished where the frames go.
fn clean_up(pattern: &Path) -> Result<(), Failure> {
    let folder = match pattern.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if let Some(ending) = pattern.extension().and_then(|ending| ending.to_str()) {
        remove_abandoned(folder, ending)?;
    }
    Ok(())
}

/// Where a frame goes, checked.
fn target(args: &AnimateArgs, frame: u32) -> Result<Targets, Failure> {
    if args.output.as_os_str() == "-" {
        return Err(Failure::new(Code::Usage, "--output -: frames go to files"));
    }
    let name = if is_movie(&args.output) {
        // Its pictures are made as those of a PNG are.
        args.output.with_extension("png")
    } else {
        numbered(&args.output, frame)
    };
    let target = TargetArgs {
        output: Some(name),
        npy: None,
        layers: args.layers.clone(),
    };
    Targets::new(&target, &args.picture.tone, false)
}

/// The file of a frame: the last run of `#` in the name stands for its number, or the end of the stem does.
fn numbered(pattern: &Path, frame: u32) -> PathBuf {
    let name = pattern.file_name().unwrap_or_default().to_string_lossy();
    let name = match name.rfind('#') {
        Some(last) => {
            let stem = name[..=last].trim_end_matches('#');
            let width = last + 1 - stem.len();
            format!("{stem}{frame:0width$}{}", &name[last + 1..])
        }
        None => {
            let dot = name.rfind('.').unwrap_or(name.len());
            format!("{}-{frame:04}{}", &name[..dot], &name[dot..])
        }
    };
    pattern.with_file_name(name)
}

/// The frames asked for: by number, by time, or all of the animation.
fn frames(args: &FrameArgs, input: &Input, animation: usize) -> Result<Span<u32>, Failure> {
    if let Some(frames) = args.frames {
        return Ok(frames);
    }
    let seconds = match (args.seconds, input.scene.animations.get(animation)) {
        (Some(seconds), _) => seconds,
        (None, Some(animation)) => Span {
            start: 0.0,
            end: f64::from(animation.duration()),
        },
        (None, None) => {
            return Err(Failure::new(
                Code::Usage,
                format_args!(
                    "--frames or --seconds: {} has no animation that says how many",
                    input.path.display()
                ),
            ));
        }
    };
    let frame = |seconds: f64| (seconds * args.rate - 1e-6).ceil().max(0.0) as u32;
    let span = Span {
        start: frame(seconds.start),
        end: frame(seconds.end),
    };
    if span.start < span.end {
        Ok(span)
    } else {
        Err(Failure::new(
            Code::Usage,
            "--seconds: there is no frame in this time",
        ))
    }
}

/// Turns a camera around the vertical axis through the middle of the frame.
fn turn(camera: &mut PosedCamera, geometry: &FrameGeometry, angle: f64) {
    let center = input::center(geometry);
    let rotation = DQuat::from_rotation_y(angle);
    camera.eye = center + rotation * (camera.eye - center);
    camera.forward = rotation * camera.forward;
    camera.up = rotation * camera.up;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_hold_the_number_of_the_frame() {
        let name = |pattern: &str| numbered(Path::new(pattern), 7).display().to_string();
        assert_eq!(name("a/frame-####.png"), "a/frame-0007.png");
        assert_eq!(name("#.exr"), "7.exr");
        assert_eq!(name("b#/walk.png"), "b#/walk-0007.png");
        assert_eq!(name("a##b#.png"), "a##b7.png");
    }
}
