//! The papers' tables with our figures beside theirs, and a line for each of their claims.
//!
//! HM08, Tables 1 to 5, VMV07, Table 1, and the claims of their texts. Scenes are the built-in stand-ins, and the real meshes where a folder of
//! scenes has them. The paper's figures are of one core of 2006; the machine of ours is told in the head.

use rayward::trace::{AreaLightTree, Casts, SimdLevel, Visibility};
use serde::Serialize;

use crate::claims::{Claim, Evidence};
use crate::contender::{Contender, FrameKind, Job};
use crate::cubes::{self, CubeLine};
use crate::frames::{self, FrameReport, FramesOptions, Row};
use crate::ours::{Rayward, Ways, eye_grid, tile_side};
use crate::papers::{TABLE_1, TABLE_4, TABLES_2_3};
use crate::steps::{self, StepReport};
use crate::{BenchScene, Machine, Picture, Result, Spread, Stopwatch, workers};

/// What is measured.
#[derive(Clone, Debug)]
pub struct TablesOptions {
    /// Size of Table 1's pictures; those of Tables 2 to 4 are square and as high as 1024 to its 1200.
    pub size: [u32; 2],
    /// Threads of the last columns of Table 1.
    pub threads: usize,
    /// Runs of each figure.
    pub runs: usize,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
    /// Whether each worker thread keeps to a processor of its own.
    pub pinned: bool,
    /// Texels along the longest side of the layered depth cubes.
    pub cubes: Vec<u32>,
    /// Folder of scenes, with a camera file.
    pub folder: Option<std::path::PathBuf>,
}

/// All tables and claims.
#[derive(Clone, Debug, Serialize)]
pub struct TablesReport {
    /// What it was measured on.
    pub machine: Machine,
    /// Width and height of Table 1.
    pub size: [u32; 2],
    /// Runs of each figure.
    pub runs: usize,
    /// Table 1.
    pub frames: Vec<FrameLine>,
    /// Tables 2 and 3.
    pub peers: Vec<PeerLine>,
    /// Table 4.
    pub raster: RasterLine,
    /// Table 5.
    pub steps: StepReport,
    /// What HM08 claims.
    pub claims: Vec<Claim>,
    /// VMV07's Table 1.
    pub cubes: Vec<CubeLine>,
    /// What VMV07 claims.
    pub cube_claims: Vec<Claim>,
}

/// One kind of frame of one scene in Table 1.
#[derive(Clone, Debug, Serialize)]
pub struct FrameLine {
    /// Name in the paper.
    pub paper_scene: &'static str,
    /// What was rendered.
    pub scene: String,
    /// Thousand triangles in the paper.
    pub paper_ktriangles: u32,
    /// Triangles.
    pub triangles: usize,
    /// Kind of frame.
    pub frame: &'static str,
    /// Frames a second in the paper.
    pub paper_fps: f64,
    /// Frames a second on one thread.
    pub fps: f64,
    /// Frames a second on all threads.
    pub fps_parallel: f64,
    /// Million rays a second in the paper.
    pub paper_mray_per_s: f64,
    /// Million rays a second on one thread.
    pub mray_per_s: f64,
    /// Share of the build in the paper.
    pub paper_build: f64,
    /// Share of the builds; hard shadows have none apart from their answers, there it is that of the eye grid.
    pub build: f64,
    /// Share of the shadow rays that were lit without a test of any triangle, where that was counted.
    pub untested: Option<f64>,
}

/// One kind of frame of one scene in Tables 2 and 3.
#[derive(Clone, Debug, Serialize)]
pub struct PeerLine {
    /// Name in the paper.
    pub paper_scene: &'static str,
    /// What was rendered.
    pub scene: String,
    /// Kind of frame.
    pub frame: &'static str,
    /// Ours over the others in the paper: regular grid, hierarchy with its rebuild, hierarchy prebuilt.
    pub paper_ratios: [Option<f64>; 3],
    /// Frames a second, everything rebuilt.
    pub fps: f64,
    /// Frames a second of the regular grid, prebuilt.
    pub grid_fps: Option<f64>,
    /// Frames a second of the fastest hierarchy with its build in every frame.
    pub rebuilt_fps: Option<f64>,
    /// Frames a second of the fastest prebuilt hierarchy.
    pub prebuilt_fps: Option<f64>,
    /// Which is the fastest prebuilt.
    pub fastest: Option<String>,
}

/// Table 4.
#[derive(Clone, Debug, Serialize)]
pub struct RasterLine {
    /// What was rendered.
    pub scene: String,
    /// Share of the window that it covers.
    pub covered: f64,
    /// Million triangles a second in whole frames with that share, and in the paper.
    pub mtriangles_per_s: [f64; 2],
    /// Million vertices a second in whole frames with the model out of sight, and in the paper.
    pub mvertices_per_s: [f64; 2],
}

/// Measures everything.
///
/// # Errors
/// [`crate::Error`], if a scene cannot be read or threads not be started.
pub fn measure(options: &TablesOptions, progress: &mut dyn FnMut(&str)) -> Result<TablesReport> {
    let machine = Machine::describe(options.level, options.threads, options.pinned);
    let frames = table_1(options, progress)?;
    let peers = tables_2_3(options, progress)?;
    progress("Table 4");
    let raster = table_4(options)?;
    progress("Table 5");
    let steps = steps::measure(&BenchScene::load("courtyard", None)?)?;
    let cubes = cubes::table(options, progress)?;
    let evidence = Evidence {
        threads: options.threads,
        frames: &frames,
        peers: &peers,
        raster: &raster,
        steps: &steps,
    };
    Ok(TablesReport {
        claims: evidence.claims(),
        machine,
        size: options.size,
        runs: options.runs,
        frames,
        peers,
        raster,
        steps,
        cube_claims: cubes::claims(&cubes),
        cubes,
    })
}

fn table_1(options: &TablesOptions, progress: &mut dyn FnMut(&str)) -> Result<Vec<FrameLine>> {
    let pool = |threads| workers::pool(threads, options.pinned);
    let (one, all) = (pool(1)?, pool(options.threads)?);
    let ours = Rayward::new(Ways::usual());
    let mut lines = Vec::new();
    for paper in &TABLE_1 {
        let mesh = options.folder.as_ref().and(paper.mesh);
        for name in [Some(paper.builtin), mesh].into_iter().flatten() {
            let scene = BenchScene::load(name, options.folder.as_deref())?;
            for (kind, [paper_fps, paper_build, paper_mray]) in FrameKind::ALL.into_iter().zip(paper.kinds) {
                progress(&format!("Table 1: {name}, {}", kind.name()));
                let job = Job::new(&scene, options.size, kind, options.level)?;
                let mut picture = Picture::new(options.size[0], options.size[1], tile_side());
                let mut times = [Vec::new(), Vec::new()];
                let mut shadow_rays = 0;
                for run in 0..=options.runs {
                    for (pool, times) in [&one, &all].into_iter().zip(&mut times) {
                        let (asked, time) =
                            pool.install(|| Stopwatch::time(|| ours.draw(&job, &mut picture)));
                        shadow_rays = asked;
                        if run > 0 {
                            times.push(time.wall);
                        }
                    }
                }
                let [seconds, parallel] = times.map(|times| Spread::of(times).median / 1e3);
                let rays = u64::from(options.size[0]) * u64::from(options.size[1]) + shadow_rays;
                let build = one.install(|| {
                    Spread::of((0..options.runs).map(|_| Stopwatch::time(|| build(&job)).1.wall)).median / 1e3
                });
                lines.push(FrameLine {
                    paper_scene: paper.name,
                    scene: scene.name.clone(),
                    paper_ktriangles: paper.ktriangles,
                    triangles: scene.geometry.triangle_count(),
                    frame: kind.name(),
                    paper_fps,
                    fps: 1.0 / seconds,
                    fps_parallel: 1.0 / parallel,
                    paper_mray_per_s: paper_mray,
                    mray_per_s: rays as f64 / 1e6 / seconds,
                    paper_build,
                    build: build / seconds,
                    untested: (kind == FrameKind::EyeHard).then(|| untested(&job)),
                });
            }
        }
    }
    Ok(lines)
}

/// Builds the structures of a frame that are apart from its answers.
fn build(job: &Job) {
    let eye = eye_grid(job);
    std::hint::black_box(&eye);
    if job.kind == FrameKind::EyeSoft {
        let tree = AreaLightTree::build(job.area, job.scene.triangles(), &|_| Casts::Both, job.level);
        std::hint::black_box(&tree);
    }
}

fn untested(job: &Job) -> f64 {
    let visibility = Visibility::trace(&eye_grid(job), &|| ());
    let counts = Rayward::new(Ways::usual())
        .lit(job, &visibility, job.light)
        .counts;
    counts.untested as f64 / counts.receivers.max(1) as f64
}

fn tables_2_3(options: &TablesOptions, progress: &mut dyn FnMut(&str)) -> Result<Vec<PeerLine>> {
    let side = options.size[1] * 1024 / 1200;
    let options = FramesOptions {
        width: side,
        height: side,
        kinds: vec![FrameKind::Eye, FrameKind::EyeHard],
        threads: 1,
        runs: options.runs,
        level: options.level,
        pinned: options.pinned,
        peers: true,
        regular_grid: true,
    };
    let mut lines = Vec::new();
    for paper in &TABLES_2_3 {
        let scene = BenchScene::load(paper.builtin, None)?;
        let kind = if paper.hard {
            FrameKind::EyeHard
        } else {
            FrameKind::Eye
        };
        let options = FramesOptions {
            kinds: vec![kind],
            ..options.clone()
        };
        let mut tell = |what: &str| progress(&format!("Tables 2 and 3: {what}"));
        let report = frames::measure(&[scene], &options, &mut tell, &mut |_, _| ())?;
        let frame = &report.frames[0];
        let fps = |row: &Row, built: bool| {
            let build = if built { row.kept_build_ms? } else { 0.0 };
            Some(1e3 / (row.times?.wall_ms.median + build))
        };
        let fastest = |grid: bool, built: bool| {
            let rows = frame.rows.iter().filter(|row| !row.ours && is_grid(row) == grid);
            let timed = rows.filter_map(|row| Some((fps(row, built)?, &row.contender)));
            timed.max_by(|a, b| a.0.total_cmp(&b.0))
        };
        let over = |other: Option<f64>| other.map(|other| paper.ours / other);
        lines.push(PeerLine {
            paper_scene: paper.name,
            scene: frame.scene.clone(),
            frame: frame.frame,
            paper_ratios: [over(paper.grid), over(paper.bvh[0]), over(paper.bvh[1])],
            fps: ours(frame),
            grid_fps: fastest(true, false).map(|(fps, _)| fps),
            rebuilt_fps: fastest(false, true).map(|(fps, _)| fps),
            prebuilt_fps: fastest(false, false).map(|(fps, _)| fps),
            fastest: fastest(false, false).map(|(_, name)| name.clone()),
        });
    }
    Ok(lines)
}

fn is_grid(row: &Row) -> bool {
    row.contender == "regular grid"
}

fn ours(frame: &FrameReport) -> f64 {
    frame.rows[0]
        .times
        .map_or(0.0, |times| 1e3 / times.wall_ms.median)
}

fn table_4(options: &TablesOptions) -> Result<RasterLine> {
    let side = options.size[1] * 1024 / 1200;
    let name = if options.folder.is_some() {
        "bunny69k"
    } else {
        "blob-69k"
    };
    let mut scene = BenchScene::load(name, options.folder.as_deref())?;
    let pool = workers::pool(1, options.pinned)?;
    let ours = Rayward::new(Ways::usual());
    let mut picture = Picture::new(side, side, tile_side());
    let covered = |scene: &BenchScene| -> Result<f64> {
        let job = Job::new(scene, [side; 2], FrameKind::Eye, options.level)?;
        let visibility = Visibility::trace(&eye_grid(&job), &|| ());
        let seen = visibility.seen() as f64;
        Ok(seen / f64::from(side * side))
    };
    // The area goes with the square of the distance.
    for _ in 0..4 {
        let share = covered(&scene)?;
        scene.step_back((share / 0.05).sqrt());
    }
    let share = covered(&scene)?;
    let mut rate = |scene: &BenchScene, items: usize| -> Result<f64> {
        let job = Job::new(scene, [side; 2], FrameKind::Eye, options.level)?;
        let mut draw = || {
            pool.install(|| Stopwatch::time(|| ours.draw(&job, &mut picture)))
                .1
                .wall
        };
        draw();
        Ok(items as f64 / 1e3 / Spread::of((0..options.runs).map(|_| draw())).median)
    };
    let triangles = rate(&scene, scene.geometry.triangle_count())?;
    scene.turn_away();
    let vertices = rate(&scene, scene.geometry.x.len())?;
    Ok(RasterLine {
        scene: scene.name,
        covered: share,
        mtriangles_per_s: [triangles, TABLE_4[0]],
        mvertices_per_s: [vertices, TABLE_4[1]],
    })
}
