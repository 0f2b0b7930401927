//! Frames of scenes by all contenders: pictures compared, then times.

use std::time::Duration;

use rayward::CasterPolicy;
use rayward::trace::SimdLevel;
use serde::Serialize;

use crate::contender::{Contender, FrameKind, Job};
use crate::embree::{self, Library, Quality};
use crate::ours::{Rayward, Ways, tile_side};
use crate::peers::{BvhOfShapes, Obvhs, ObvhsTree, RegularGrid};
use crate::{BenchScene, Difference, Machine, Picture, Result, Stopwatch, Time, Times, workers};

/// Share of the pixels in which a picture may differ: rays of f32 peers through edges and along grazing surfaces.
pub const TOLERATED_SHARE: f64 = 0.005;

/// A frame that takes longer than this is drawn once, to compare it, and that time counts.
const DEAR: Duration = Duration::from_secs(20);

/// What is measured.
#[derive(Clone, Debug)]
pub struct FramesOptions {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Kinds of frames.
    pub kinds: Vec<FrameKind>,
    /// Threads for every contender, and for their builds.
    pub threads: usize,
    /// Runs of each contender.
    pub runs: usize,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
    /// Whether other ray tracers are measured too.
    pub peers: bool,
    /// Whether our own regular grid is among them, ray by ray: slow.
    pub regular_grid: bool,
}

impl Default for FramesOptions {
    fn default() -> Self {
        Self {
            width: 1920,
            height: 1200,
            kinds: FrameKind::ALL.to_vec(),
            threads: 1,
            runs: 5,
            level: SimdLevel::detect(),
            pinned: false,
            peers: true,
            regular_grid: false,
        }
    }
}

/// Results of all scenes.
#[derive(Clone, Debug, Serialize)]
pub struct FramesReport {
    /// What it was measured on.
    pub machine: Machine,
    /// Versions of Embree that were found, with the width of their packets.
    pub embree: Vec<String>,
    /// Width of the pictures.
    pub width: u32,
    /// Height of the pictures.
    pub height: u32,
    /// Runs of each contender.
    pub runs: usize,
    /// Share of the pixels in which a picture may differ from Rayward's.
    pub tolerated_share: f64,
    /// One entry for each scene and kind of frame.
    pub frames: Vec<FrameReport>,
}

/// One kind of frame of one scene.
#[derive(Clone, Debug, Serialize)]
pub struct FrameReport {
    /// Scene.
    pub scene: String,
    /// Its triangles.
    pub triangles: usize,
    /// Kind of frame.
    pub frame: &'static str,
    /// Rays from the eye.
    pub eye_rays: u64,
    /// Rays to the light.
    pub shadow_rays: u64,
    /// Processor time of the fastest peer over ours; `None` without a peer that passed.
    pub ratio: Option<f64>,
    /// The fastest peer.
    pub best_peer: Option<String>,
    /// One entry a contender, Rayward first.
    pub rows: Vec<Row>,
}

/// One contender's frame.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Contender.
    pub contender: String,
    /// Whether it is Rayward.
    pub ours: bool,
    /// Pixels that differ from Rayward's by more than rounding.
    pub differing_pixels: u64,
    /// Whether these are few enough for times to be told.
    pub same_picture: bool,
    /// Wall time of building what is kept between frames, milliseconds; it is in no frame's time.
    pub kept_build_ms: Option<f64>,
    /// Times of the frame, ours with all builds; `None` if the picture is another one.
    pub times: Option<Times>,
    /// Million rays a second of processor time.
    pub mray_per_s: Option<f64>,
    /// Processor time over that of Rayward.
    pub over_rayward: Option<f64>,
}

impl FramesReport {
    /// Whether all pictures were the same.
    pub fn same_pictures(&self) -> bool {
        self.frames
            .iter()
            .flat_map(|f| &f.rows)
            .all(|row| row.same_picture)
    }
}

/// A contender that threads can share.
pub(crate) type Drawer<'s> = dyn Contender + Send + Sync + 's;

/// Gets every picture that is compared, with a name.
pub type PictureSink<'p> = &'p mut (dyn FnMut(&str, &Picture) + Send);

/// Measures these scenes. `progress` is told what is being done; `pictures` gets every picture with a name.
///
/// # Errors
/// [`crate::Error`], if a library of Embree that was asked for cannot be used, a camera not be taken, or threads not be
/// started.
pub fn measure(
    scenes: &[BenchScene],
    options: &FramesOptions,
    progress: &mut dyn FnMut(&str),
    pictures: PictureSink,
) -> Result<FramesReport> {
    let libraries = if options.peers {
        embree::libraries()?
    } else {
        Vec::new()
    };
    let pool = workers::pool(options.threads, options.pinned)?;
    let mut report = FramesReport {
        machine: Machine::describe(options.level, options.threads, options.pinned),
        embree: libraries.iter().map(Library::description).collect(),
        width: options.width,
        height: options.height,
        runs: options.runs,
        tolerated_share: TOLERATED_SHARE,
        frames: Vec::new(),
    };
    for scene in scenes {
        progress(&format!("{}: building the structures of the peers", scene.name));
        let contenders = pool.install(|| contenders(scene, options, &libraries))?;
        for &kind in &options.kinds {
            let job = Job::new(scene, [options.width, options.height], kind, options.level)?;
            progress(&format!("{}: {}", scene.name, kind.name()));
            let frame = pool.install(|| measure_frame(&job, &contenders, options.runs, pictures));
            report.frames.push(frame);
        }
    }
    Ok(report)
}

fn contenders<'s>(
    scene: &'s BenchScene,
    options: &FramesOptions,
    libraries: &[Library],
) -> Result<Vec<Box<Drawer<'s>>>> {
    let triangles = scene.triangles();
    let mut contenders: Vec<Box<Drawer<'s>>> = vec![Box::new(Rayward::new(Ways::usual()))];
    if options.kinds.iter().any(|&kind| kind != FrameKind::Eye) {
        let ways = Ways {
            name: "rayward, both sides cast",
            casters: CasterPolicy::Both,
            ..Ways::usual()
        };
        contenders.push(Box::new(Rayward::new(ways)));
    }
    if options.peers {
        contenders.push(Box::new(Obvhs::build(&triangles, ObvhsTree::Wide)));
        contenders.push(Box::new(Obvhs::build(&triangles, ObvhsTree::Binary)));
        contenders.push(Box::new(BvhOfShapes::build(&triangles)));
    }
    if options.regular_grid {
        contenders.push(Box::new(RegularGrid::build(triangles)));
    }
    for library in libraries {
        for quality in Quality::ALL {
            contenders.push(Box::new(library.build(&triangles, quality, options.threads)?));
        }
    }
    Ok(contenders)
}

pub(crate) fn measure_frame(
    job: &Job,
    contenders: &[Box<Drawer>],
    runs: usize,
    pictures: PictureSink,
) -> FrameReport {
    let (width, height) = (job.view.width, job.view.height);
    let takes_part = |c: &&Drawer| job.kind != FrameKind::Eye || !c.only_shadows();
    let contenders: Vec<&Drawer> = contenders.iter().map(|c| &**c).filter(takes_part).collect();
    let mut shadow_rays = 0;
    let mut first: Option<Picture> = None;
    let mut rows: Vec<Row> = Vec::new();
    let mut times: Vec<Vec<Time>> = Vec::new();
    // This also warms up: caches, and the memory that allocators keep.
    for contender in &contenders {
        let mut picture = Picture::new(width, height, tile_side());
        let (asked, time) = Stopwatch::time(|| contender.draw(job, &mut picture));
        times.push(if time.wall > DEAR { vec![time] } else { Vec::new() });
        let name = format!("{}-{}-{}", job.scene.name, job.kind.name(), contender.name());
        pictures(&name, &picture);
        let difference = first
            .as_ref()
            .map_or(Difference::default(), |f| f.difference(&picture));
        let share = difference.pixels as f64 / (f64::from(width) * f64::from(height));
        if first.is_none() {
            (first, shadow_rays) = (Some(picture), asked);
        }
        rows.push(Row {
            contender: contender.name(),
            ours: contender.build().is_none(),
            differing_pixels: difference.pixels,
            same_picture: share <= TOLERATED_SHARE,
            kept_build_ms: contender.build().map(|t| t.wall.as_secs_f64() * 1e3),
            times: None,
            mray_per_s: None,
            over_rayward: None,
        });
    }
    let rays = u64::from(width) * u64::from(height) + shadow_rays;
    time_all(job, &contenders, &mut rows, times, runs, rays);
    let best = |ours: bool| {
        let rows = rows.iter().filter(move |row| row.ours == ours);
        let timed = rows.filter_map(|row| Some((row.times?.cpu_ms.median, &row.contender)));
        timed.min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let ratio = best(false)
        .zip(rows[0].times)
        .map(|(peer, ours)| peer.0 / ours.cpu_ms.median);
    FrameReport {
        scene: job.scene.name.clone(),
        triangles: job.scene.geometry.triangle_count(),
        frame: job.kind.name(),
        eye_rays: u64::from(width) * u64::from(height),
        shadow_rays,
        ratio,
        best_peer: best(false).map(|(_, name)| name.clone()),
        rows,
    }
}

/// Runs all that draw the same picture and have no time yet in turns, each round beginning with another one.
fn time_all(
    job: &Job,
    contenders: &[&Drawer],
    rows: &mut [Row],
    mut times: Vec<Vec<Time>>,
    runs: usize,
    rays: u64,
) {
    let mut picture = Picture::new(job.view.width, job.view.height, tile_side());
    let again: Vec<bool> = times.iter().map(Vec::is_empty).collect();
    for round in 0..runs {
        for turn in 0..contenders.len() {
            let i = (round + turn) % contenders.len();
            if rows[i].same_picture && again[i] {
                let (_, time) = Stopwatch::time(|| contenders[i].draw(job, &mut picture));
                times[i].push(time);
            }
        }
    }
    for (row, times) in rows.iter_mut().zip(&times) {
        if row.same_picture && !times.is_empty() {
            let times = Times::of(times);
            row.mray_per_s = Some(rays as f64 / 1e3 / times.cpu_ms.median);
            row.times = Some(times);
        }
    }
    if let Some(ours) = rows.first().and_then(|row| row.times) {
        for row in rows {
            row.over_rayward = row.times.map(|t| t.cpu_ms.median / ours.cpu_ms.median);
        }
    }
}
