//! How well and how fast the layered depth cube answers, on the CPU and on a GPU, beside the hierarchy that is its truth.
//!
//! `cargo bench -p rayward-gpu --bench ldc [-- SCENE... RAYS]`. For each scene and resolution: time of every build, samples,
//! layers, memory; then, over the same rays, how often each hit test misses, hits what is not there or another
//! triangle, how far off it is, and the time and steps of a ray. A third of the rays are random, a third along axes
//! or in a plane of two, a third are the reflections of what a camera sees. The CPU traces a million, or as many as are
//! asked for, on one thread, the GPU, if there is one, ten thousand of them; times are medians of three, of what takes
//! minutes of one.
//!
//! A hit test *misses* where it finds nothing or only what lies more than 1.5 texels behind the truth; its hit is *false*
//! where the truth is nothing or lies as far behind. Either is told again for rays outside of a band of a texel around
//! silhouettes: those of which no parallel ray one texel aside has the answer that was given.
//!
//! Built-in scenes always; the meshes of `RAYWARD_SCENES` where it is set. Run as a test it does little.

mod common;

use std::collections::{HashMap, HashSet};
use std::time::Instant;

use common::{Start, start};
use glam::{DVec3, Vec3};
use rayward::CameraFrame;
use rayward_gpu::trace::ldc::{Coverage, DepthFormat, Hierarchy, HitTest, LdcBuild, StepCounts, Steps, TILE};
use rayward_gpu::trace::{Bvh, Hit, Ldc, LdcOptions, Light, Ray, Receiver, Triangles, View, ViewRay, exact};
use rayward_gpu::{Cube, CubeOptions, Gpu, GpuBvh, GpuGrid, GridGeometry, TraceStats};
use rayward_scene::{FrameGeometry, LoadOptions, default_camera, default_lights};

fn main() {
    let Start {
        test,
        names,
        count,
        gpu,
    } = start();
    let (resolutions, rays): (&[u32], usize) = if test {
        (&[64], 300)
    } else {
        (&[512, 1024], count.unwrap_or(1_000_000))
    };
    let names = if test {
        vec!["blob-1k".into()]
    } else if names.is_empty() {
        scenes()
    } else {
        names
    };
    for name in names {
        let geometry = load(&name);
        for &resolution in resolutions {
            report(&name, &geometry, resolution, rays, gpu.as_ref().ok());
        }
    }
}

fn scenes() -> Vec<String> {
    let built_in = ["blob-69k", "courtyard", "office", "collide"];
    let mut names: Vec<String> = built_in.map(String::from).to_vec();
    if std::env::var_os("RAYWARD_SCENES").is_some() {
        let meshes = [
            "bunny69k",
            "conference331k",
            "sponza66k",
            "crytek_sponza279k",
            "forest174k",
            "dragon_bunny252k",
            "teapot_in_stadium28k",
        ];
        names.extend(meshes.map(|n| format!("{n}.ply")));
    }
    names
}

fn load(name: &str) -> FrameGeometry {
    if name.ends_with(".ply") {
        let folder = std::env::var_os("RAYWARD_SCENES").expect("names the scenes");
        let file = std::path::Path::new(&folder).join("bench").join(name);
        rayward_scene::load(&file, &LoadOptions::default())
            .expect("a mesh")
            .at(0.0)
    } else {
        rayward_scene::builtin::build(name)
            .expect("a built-in scene")
            .at(0.0)
    }
}

/// Numbers in [-1, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 40) as f32) / (1u64 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// Pixels of the camera whose reflections are traced.
const PIXELS: [u32; 2] = [1500, 1000];

/// A camera's view, and the end of its light's shadow rays.
fn camera(geometry: &FrameGeometry) -> (View, Light) {
    let [width, height] = PIXELS;
    let posed = default_camera(geometry, f64::from(width) / f64::from(height));
    let camera = CameraFrame::new(&posed, geometry.origin, width, height).expect("a camera");
    let light = rayward::shadow_end(&default_lights(&posed)[0], geometry.origin);
    (camera.view(geometry), light)
}

/// The ray that a pixel sends on from the surface it sees, mirrored there.
fn seen_mirrored(view: &View, triangles: Triangles, bvh: &Bvh, cube: &Ldc, at: [f32; 2]) -> Option<Ray> {
    let [x, y] = [0, 1].map(|i| ((at[i] + 1.0) * 0.5 * PIXELS[i] as f32) as u32);
    let pixel = view.pixel_ray(x, y);
    let eye = Ray::new(pixel.origin.as_vec3(), pixel.dir.as_vec3());
    let (prim, hit) = bvh.closest(&eye, &mut ())?;
    let (normal, along) = (triangles.normal(prim).normalize_or_zero(), eye.dir.as_dvec3());
    let mirrored: DVec3 = along - normal * (2.0 * along.dot(normal));
    let point = (eye.origin.as_dvec3() + along * hit.t).as_vec3();
    Some(cube.leaving(point, normal.as_vec3(), mirrored.as_vec3()))
}

fn rays(geometry: &FrameGeometry, bvh: &Bvh, cube: &Ldc, count: usize) -> Vec<Ray> {
    let triangles = rayward::triangles(geometry);
    let finite = (0..triangles.len() as u32).filter(|&p| !triangles.is_degenerate(p));
    let (low, high) = finite
        .flat_map(|p| triangles.corners(p))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let (view, _) = camera(geometry);
    let mut numbers = Numbers(1);
    (0..count)
        .map(|i| {
            let (from, mut dir) = (middle + half * numbers.point() * 1.1, numbers.point());
            match i % 6 {
                0 => dir = Vec3::AXES[i / 6 % 3] * dir.x.signum(),
                1 => dir[i / 6 % 3] = 0.0,
                2 | 3 => {
                    if let Some(ray) = seen_mirrored(&view, triangles, bvh, cube, [dir.x, dir.y]) {
                        return ray;
                    }
                }
                _ => {}
            }
            Ray::new(from, dir)
        })
        .collect()
}

/// The result of the last of three runs and their median time in milliseconds.
fn timed<R>(run: impl FnMut() -> R) -> (R, f64) {
    times(3, run)
}

fn times<R>(runs: usize, mut run: impl FnMut() -> R) -> (R, f64) {
    let mut times = vec![0.0; runs];
    let mut last = None;
    for time in &mut times {
        let start = Instant::now();
        last = Some(run());
        *time = start.elapsed().as_secs_f64() * 1e3;
    }
    times.sort_by(f64::total_cmp);
    (last.expect("ran"), times[runs / 2])
}

/// Finds the triangle and parameter of a ray's closest hit.
type Find<'a> = &'a dyn Fn(&Ray, &mut StepCounts) -> Option<(u32, f64)>;

/// Texels by which a hit may be off.
const OFF: f64 = 1.5;

/// Counts of one hit test against the truth.
#[derive(Default)]
struct Errors {
    missed: usize,
    false_hits: usize,
    /// Of both, outside of the band around silhouettes.
    clear: [usize; 2],
    /// Rays of the former that are missed, with what they should hit.
    missed_clear: Vec<(Ray, u32, f64)>,
    wrong_triangle: usize,
    /// Of both that hit, in texels.
    off: Vec<f64>,
}

/// The truth about one ray.
struct Judge<'a> {
    bvh: &'a Bvh<'a>,
    /// Side of a texel.
    texel: f64,
}

impl Judge<'_> {
    /// Whether one hit lies more than [`OFF`] texels before another; nothing lies behind everything.
    fn before(&self, ray: &Ray, a: Option<(u32, f64)>, b: Option<(u32, f64)>) -> bool {
        let texels = f64::from(ray.dir.length()) / self.texel;
        a.is_some_and(|(_, a)| b.is_none_or(|(_, b)| (b - a) * texels > OFF))
    }

    /// Whether a parallel ray a texel aside, or half of one, has this answer.
    fn near_silhouette(&self, ray: &Ray, found: Option<(u32, f64)>) -> bool {
        let (u, v) = ray.dir.normalize().any_orthonormal_pair();
        [0.5, 1.0].into_iter().any(|reach| {
            (0..16).any(|i| {
                let (sin, cos) = (i as f32 * std::f32::consts::TAU / 16.0).sin_cos();
                let beside = Ray {
                    origin: ray.origin + (u * cos + v * sin) * (reach * self.texel as f32),
                    ..*ray
                };
                let hit = self
                    .bvh
                    .closest(&beside, &mut ())
                    .map(|(prim, hit)| (prim, hit.t));
                !self.before(ray, hit, found) && !self.before(ray, found, hit)
            })
        })
    }
}

impl Errors {
    fn add(&mut self, ray: &Ray, found: Option<(u32, f64)>, truth: Option<(u32, f64)>, judge: &Judge) {
        let missed = judge.before(ray, truth, found);
        let is_false = judge.before(ray, found, truth);
        self.missed += usize::from(missed);
        self.false_hits += usize::from(is_false);
        if (missed || is_false) && !judge.near_silhouette(ray, found) {
            self.clear[usize::from(is_false)] += 1;
            let truth = truth.filter(|_| missed);
            self.missed_clear.extend(truth.map(|(prim, t)| (*ray, prim, t)));
        }
        if let (Some(found), Some(truth)) = (found, truth) {
            self.wrong_triangle += usize::from(found.0 != truth.0);
            let texels = f64::from(ray.dir.length()) / judge.texel;
            self.off.push((found.1 - truth.1).abs() * texels);
        }
    }

    fn print(&mut self, name: &str, rays: usize, microseconds: f64, steps: &StepCounts) {
        self.off.sort_by(f64::total_cmp);
        let at = |share: f64| {
            self.off
                .get((self.off.len() as f64 * share) as usize)
                .copied()
                .unwrap_or(0.0)
        };
        let percent = |n: usize| n as f64 / rays as f64 * 100.0;
        let [clear_missed, clear_false] = self.clear;
        let each = |n: u64| n as f64 / rays as f64;
        println!(
            "  {name:<24} missed {:.3} % false {:.3} % clear of silhouettes {:.4} % {:.4} % other triangle {} = {:.2} %  error p50 {:.4} p95 {:.4} p99 {:.3}  {microseconds:.2} us  cells {:.1} texels {:.1} samples {:.1} tests {:.2}",
            percent(self.missed),
            percent(self.false_hits),
            percent(clear_missed),
            percent(clear_false),
            self.wrong_triangle,
            percent(self.wrong_triangle),
            at(0.5),
            at(0.95),
            at(0.99),
            each(steps.cells),
            each(steps.texels),
            each(steps.samples),
            each(steps.triangles),
        );
    }
}

/// The test on planes.
const PLANE: HitTest = HitTest::Plane { margin: 0.25 };

/// Says what samples there are of the triangles that rays should have hit.
fn why_missed(cube: &Ldc, triangles: Triangles, missed: &[(Ray, u32, f64)]) {
    let wanted: HashSet<u32> = missed.iter().map(|&(_, prim, _)| prim).collect();
    let mut texels: HashMap<u32, HashSet<u32>> = HashMap::new();
    for sample in (0..3).flat_map(|axis| cube.texel_samples(axis)) {
        if wanted.contains(&sample.prim) {
            texels.entry(sample.prim).or_default().insert(sample.texel);
        }
    }
    let [mut nowhere, mut elsewhere, mut there] = [0; 3];
    for (ray, prim, t) in missed {
        let axis = triangles.normal(*prim).abs().max_position();
        let point = ray.origin.as_dvec3() + ray.dir.as_dvec3() * *t;
        let at = cube.frame().texel(point).to_array();
        let [column, row] = [1, 2].map(|i| at[(axis + i) % 3] as u32);
        let columns = cube.size()[(axis + 1) % 3];
        let tile = (row / TILE) * (columns / TILE) + column / TILE;
        let texel = tile * TILE * TILE + (row % TILE) * TILE + column % TILE;
        match texels.get(prim) {
            None => nowhere += 1,
            Some(own) if own.contains(&texel) => there += 1,
            Some(_) => elsewhere += 1,
        }
    }
    println!(
        "  {:<24} of {} missed: {nowhere} on triangles without a sample, {elsewhere} with none in the texel of the hit, {there} with one",
        "",
        missed.len()
    );
}

/// The hit tests on samples, with cubes for them.
fn by_samples<'c>(
    resolution: u32,
    paper: &'c Ldc<'c>,
    sampled: &'c Ldc<'c>,
    exact: &'c Ldc<'c>,
) -> [(&'static str, &'c Ldc<'c>, HitTest); 5] {
    let tolerance = HitTest::paper_tolerance(resolution);
    [
        ("strict, paper", paper, HitTest::Strict { tolerance }),
        ("interval, paper", paper, HitTest::Interval { tolerance }),
        (
            "interval, half a texel",
            sampled,
            HitTest::Interval { tolerance: 0.5 },
        ),
        ("plane", sampled, PLANE),
        ("plane, conservative", exact, PLANE),
    ]
}

fn report(name: &str, geometry: &FrameGeometry, resolution: u32, count: usize, gpu: Option<&Gpu>) {
    let triangles = rayward::triangles(geometry);
    let options = |build, depth, hierarchy| LdcOptions {
        resolution,
        build,
        depth,
        hierarchy,
        ..LdcOptions::default()
    };
    let centre = LdcBuild::Csr(Coverage::Centre);
    let conservative = LdcBuild::Csr(Coverage::Conservative);
    let (bvh, bvh_ms) = timed(|| Bvh::build(triangles));
    let build = |build, depth, hierarchy| timed(|| Ldc::build(triangles, &options(build, depth, hierarchy)));
    let peeled = options(LdcBuild::Peel, DepthFormat::F32, Hierarchy::Pyramid);
    let (_, peel_ms) = times(1, || Ldc::build(triangles, &peeled));
    let (paper, _) = build(centre, DepthFormat::F16, Hierarchy::Tiles { log2: [3; 2] });
    let (sampled, centre_ms) = build(centre, DepthFormat::F32, Hierarchy::Pyramid);
    let (exact, exact_ms) = build(conservative, DepthFormat::F32, Hierarchy::Pyramid);
    println!(
        "{name} at {resolution}: {} triangles; build ms: peel {peel_ms:.0}, sweep {centre_ms:.0}, conservative {exact_ms:.0}, hierarchy {bvh_ms:.0}; samples {} and {}, layers {:?}, MB {:.1} and {:.1}, hierarchy {:.1}",
        triangles.len(),
        sampled.samples().iter().sum::<usize>(),
        exact.samples().iter().sum::<usize>(),
        sampled.layers(),
        sampled.bytes() as f64 / 1e6,
        exact.bytes() as f64 / 1e6,
        bvh.bytes() as f64 / 1e6,
    );
    let rays = rays(geometry, &bvh, &sampled, count);
    let start = Instant::now();
    let truth: Vec<Option<(u32, f64)>> = rays
        .iter()
        .map(|ray| bvh.closest(ray, &mut ()).map(|(prim, hit)| (prim, hit.t)))
        .collect();
    let per_ray = |start: Instant| start.elapsed().as_secs_f64() * 1e6 / rays.len() as f64;
    println!(
        "  hierarchy {:.2} us, {} of {} rays hit",
        per_ray(start),
        truth.iter().flatten().count(),
        rays.len()
    );
    let judge = Judge {
        bvh: &bvh,
        texel: sampled.texel_size(),
    };
    let measure = |name: &str, find: Find| {
        let mut steps = StepCounts::default();
        let start = Instant::now();
        let found: Vec<_> = rays.iter().map(|ray| find(ray, &mut steps)).collect();
        let time = per_ray(start);
        let mut errors = Errors::default();
        for ((ray, found), truth) in rays.iter().zip(found).zip(&truth) {
            errors.add(ray, found, *truth, &judge);
        }
        errors.print(name, rays.len(), time, &steps);
        errors
    };
    for (name, cube, test) in by_samples(resolution, &paper, &sampled, &exact) {
        let errors = measure(name, &|ray, steps| {
            cube.closest_sampled(ray, test, steps)
                .map(|hit| (hit.prim, f64::from(hit.t)))
        });
        if test == PLANE && !errors.missed_clear.is_empty() {
            why_missed(cube, triangles, &errors.missed_clear);
        }
    }
    measure("exact", &|ray, steps| {
        exact.closest(ray, steps).map(|(prim, hit)| (prim, hit.t))
    });
    fours(&exact, &rays);
    if let Some(gpu) = gpu {
        let few = Few::of(&rays, &truth, judge);
        on_gpu(gpu, triangles, &bvh, resolution, &few);
        vantages(gpu, geometry, &bvh, resolution);
    }
}

/// What VMV07 leaves open, counted: how many of four lanes would be busy if four layers of a texel were tested at once, and
/// if four rays went in step.
#[derive(Default)]
struct Fours {
    layers: u64,
    batches: u64,
    /// Cells and texels.
    places: u64,
}

impl Steps for Fours {
    fn cell(&mut self) {
        self.places += 1;
    }
    fn texel(&mut self) {
        self.places += 1;
    }
    fn samples(&mut self, count: usize) {
        self.layers += count as u64;
        self.batches += count.div_ceil(4) as u64;
    }
    fn triangle(&mut self) {}
}

/// Counts over some of the rays, each with three parallel ones beside it, a texel apart.
fn fours(cube: &Ldc, rays: &[Ray]) {
    let (mut all, mut in_step) = (Fours::default(), 0);
    for ray in rays.iter().step_by(11) {
        let (right, up) = ray.dir.normalize().any_orthonormal_pair();
        let mut longest = 0;
        for beside in [Vec3::ZERO, right, up, right + up] {
            let before = all.places;
            let beside = Ray {
                origin: ray.origin + beside * cube.texel_size() as f32,
                ..*ray
            };
            cube.closest(&beside, &mut all);
            longest = longest.max(all.places - before);
        }
        in_step += 4 * longest;
    }
    let percent = |part: u64, whole: u64| part as f64 / whole.max(1) as f64 * 100.0;
    println!(
        "  {:<24} of four lanes busy: {:.0} % with four layers at once, {:.0} % with four rays; {:.2} layers tested a place",
        "",
        percent(all.layers, 4 * all.batches),
        percent(all.places, in_step),
        all.layers as f64 / all.places.max(1) as f64,
    );
}

/// Rays for the GPU, and what they hit.
struct Few<'a> {
    rays: Vec<Ray>,
    truth: Vec<Option<(u32, f64)>>,
    judge: Judge<'a>,
}

impl<'a> Few<'a> {
    /// Ten thousand, every kind in the same share.
    fn of(rays: &[Ray], truth: &[Option<(u32, f64)>], judge: Judge<'a>) -> Self {
        let stride = (rays.len() / 10_000).max(1) | 1;
        Self {
            rays: rays.iter().step_by(stride).take(10_000).copied().collect(),
            truth: truth.iter().step_by(stride).take(10_000).copied().collect(),
            judge,
        }
    }

    /// One of so many of them.
    fn fewer(&self, stride: usize) -> Self {
        let stride = stride | 1;
        Self {
            rays: self.rays.iter().step_by(stride).copied().collect(),
            truth: self.truth.iter().step_by(stride).copied().collect(),
            judge: Judge { ..self.judge },
        }
    }

    fn print(&self, name: &str, (hits, stats): &(Vec<Option<Hit>>, TraceStats), milliseconds: f64) {
        let mut errors = Errors::default();
        for ((ray, hit), truth) in self.rays.iter().zip(hits).zip(&self.truth) {
            let found = hit.map(|hit| (hit.prim, f64::from(hit.t)));
            let truth = truth.map(|(prim, t)| (prim, f64::from(t as f32)));
            errors.add(ray, found, truth, &self.judge);
        }
        let microseconds = milliseconds * 1e3 / self.rays.len() as f64;
        errors.print(name, self.rays.len(), microseconds, &stats.steps);
        if stats.unsure > 0 {
            let share = stats.unsure as f64 / self.rays.len() as f64 * 100.0;
            println!("  {:<24} unsure {share:.2} %", "");
        }
    }
}

/// The same on a GPU.
fn on_gpu(gpu: &Gpu, triangles: Triangles, bvh: &Bvh, resolution: u32, few: &Few) {
    let centre = LdcBuild::Csr(Coverage::Centre);
    let conservative = LdcBuild::Csr(Coverage::Conservative);
    let build = |build, hierarchy, runs| {
        let options = CubeOptions {
            resolution,
            build,
            hierarchy,
            ..CubeOptions::default()
        };
        times(runs, || Cube::build(gpu, triangles, &options).expect("a cube"))
    };
    // Once before, for what a first use compiles.
    build(centre, Hierarchy::Pyramid, 1);
    let (sampled, centre_ms) = build(centre, Hierarchy::Pyramid, 3);
    let (exact, exact_ms) = build(conservative, Hierarchy::Pyramid, 3);
    let (_, peel_ms) = build(LdcBuild::Peel, Hierarchy::Pyramid, 1);
    println!(
        "  GPU build ms: peel {peel_ms:.0}, sweep {centre_ms:.0}, conservative {exact_ms:.0}; samples {} and {}, MB {:.1} and {:.1}",
        sampled.samples(),
        exact.samples(),
        sampled.bytes() as f64 / 1e6,
        exact.bytes() as f64 / 1e6,
    );
    let tolerance = HitTest::paper_tolerance(resolution);
    for (name, test) in [
        ("GPU strict", HitTest::Strict { tolerance }),
        ("GPU interval", HitTest::Interval { tolerance }),
        ("GPU plane", PLANE),
    ] {
        let (answers, ms) = timed(|| sampled.closest_sampled(&few.rays, test).expect("answers"));
        few.print(name, &answers, ms);
    }
    let (answers, trace_ms) = timed(|| exact.closest(&few.rays, bvh).expect("answers"));
    few.print("GPU exact", &answers, trace_ms);
    let sent = || GpuBvh::new(gpu, triangles, &Bvh::build(triangles)).expect("a hierarchy");
    let (tree, tree_ms) = timed(sent);
    println!(
        "  GPU hierarchy: built on the CPU and sent in {tree_ms:.0} ms, MB {:.1}",
        tree.bytes() as f64 / 1e6
    );
    let (answers, ms) = timed(|| tree.closest(&few.rays, bvh).expect("answers"));
    few.print("GPU hierarchy", &answers, ms);
    let million = |build: f64, trace: f64| (build + trace * 1e6 / few.rays.len() as f64) / 1e3;
    println!(
        "  a frame of a million rays, built anew: cube {:.1} s, hierarchy {:.1} s",
        million(exact_ms, trace_ms),
        million(tree_ms, ms)
    );
    drop((sampled, exact, tree));
    let fewer = few.fewer(10);
    for (name, hierarchy) in [
        ("GPU exact, one level", Hierarchy::Tiles { log2: [3; 2] }),
        ("GPU exact, flat", Hierarchy::Flat),
    ] {
        let (cube, _) = build(conservative, hierarchy, 1);
        let (answers, ms) = times(1, || cube.closest(&fewer.rays, bvh).expect("answers"));
        fewer.print(name, &answers, ms);
    }
}

/// Eye rays and the shadow rays of a light, of every 10th pixel either way: through grids of their vantages and through the cube.
fn vantages(gpu: &Gpu, geometry: &FrameGeometry, bvh: &Bvh, resolution: u32) {
    let triangles = rayward::triangles(geometry);
    let (view, light) = camera(geometry);
    let options = CubeOptions {
        resolution,
        ..CubeOptions::default()
    };
    let cube = Cube::build(gpu, triangles, &options).expect("a cube");
    let pixels: Vec<[u32; 2]> = (0..view.height)
        .step_by(10)
        .flat_map(|y| (0..view.width).step_by(10).map(move |x| [x, y]))
        .collect();
    let rays: Vec<ViewRay> = pixels.iter().map(|&[x, y]| view.pixel_ray(x, y)).collect();
    let (sent, sent_ms) = timed(|| GridGeometry::new(gpu, triangles).expect("triangles"));
    let (grid, build_ms) = timed(|| GpuGrid::of_camera(&sent, &view).expect("a grid"));
    let (seen, seen_ms) = timed(|| grid.seen(&pixels, bvh).expect("answers"));
    let (by_cube, cube_ms) = timed(|| cube.seen(&rays, bvh).expect("answers"));
    assert_eq!(seen.0, by_cube.0, "grid and cube see the same");
    let told = |what: &str, milliseconds: f64, stats: &TraceStats| {
        let each = |n: u64| n as f64 / stats.rays.max(1) as f64;
        println!(
            "  {what:<24} {:.2} us a ray, cells and texels {:.1} samples or entries {:.1} tests {:.2} unsure {:.2} %",
            milliseconds * 1e3 / stats.rays.max(1) as f64,
            each(stats.steps.cells + stats.steps.texels),
            each(stats.steps.samples),
            each(stats.steps.triangles),
            stats.unsure as f64 * 100.0 / stats.rays.max(1) as f64,
        );
    };
    println!(
        "  triangles sent {sent_ms:.0} ms, camera grid {build_ms:.0} ms, {} entries, {:.1} MB",
        grid.entries(),
        grid.bytes() as f64 / 1e6
    );
    told("camera, grid", seen_ms, &seen.1);
    told("camera, cube", cube_ms, &by_cube.1);
    let receivers: Vec<Receiver> = rays
        .iter()
        .zip(&seen.0)
        .filter_map(|(ray, prim)| {
            let corners = triangles.corners((*prim)?);
            let hit = exact::attributes(ray.origin, ray.dir, corners)?;
            Some(Receiver::along(ray, hit.t, (*prim)?))
        })
        .collect();
    let queries: Vec<(Receiver, Light)> = receivers.iter().map(|r| (*r, light)).collect();
    let (grid, build_ms) = timed(|| GpuGrid::of_light(&sent, &light).expect("a grid"));
    let grid = grid.expect("triangles that can be projected");
    let (dark, dark_ms) = timed(|| grid.shadowed(&receivers, &light, bvh).expect("answers"));
    let (by_cube, cube_ms) = timed(|| cube.shadowed(&queries, bvh).expect("answers"));
    assert_eq!(dark.0, by_cube.0, "grid and cube shadow the same");
    println!(
        "  light grid {build_ms:.0} ms, {} entries, {:.1} MB",
        grid.entries(),
        grid.bytes() as f64 / 1e6
    );
    told("light, grid", dark_ms, &dark.1);
    told("light, cube", cube_ms, &by_cube.1);
}
