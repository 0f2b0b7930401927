//! How well and how fast the layered depth cube answers, on the CPU and on a GPU, beside the hierarchy that is its truth.
//!
//! `cargo bench -p rayward-gpu --bench ldc [-- SCENE... RAYS]`. For each scene and resolution: time of every build, samples,
//! layers, memory; then, over the same rays, how often each hit test misses, hits what is not there or another
//! triangle, how far off it is, and the time and steps of a ray. A third of the rays are random, a third along axes
//! or in a plane of two, a third leave surfaces as reflections. The CPU traces a million, or as many as are asked for, on one thread, the GPU, if
//! there is one, ten thousand of them; times are medians of three.
//!
//! Built-in scenes always; the meshes of `RAYWARD_SCENES` where it is set. Run as a test it does little.

use std::time::Instant;

use glam::{DVec3, Vec3};
use rayward_gpu::trace::ldc::{Coverage, DepthFormat, Hierarchy, HitTest, LdcBuild, StepCounts};
use rayward_gpu::trace::{Bvh, Hit, Ldc, LdcOptions, Ray, Triangles};
use rayward_gpu::{Cube, CubeOptions, Gpu, GpuBvh, TraceStats};
use rayward_scene::{FrameGeometry, LoadOptions};

fn main() {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("one pool");
    let test = !std::env::args().any(|a| a == "--bench");
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let count = words.iter().find_map(|word| word.parse().ok());
    let named: Vec<String> = words
        .into_iter()
        .filter(|w| w.parse::<usize>().is_err())
        .collect();
    let (resolutions, rays): (&[u32], usize) = if test {
        (&[64], 300)
    } else {
        (&[512, 1024], count.unwrap_or(1_000_000))
    };
    let names = if test {
        vec!["blob-1k".into()]
    } else if named.is_empty() {
        scenes()
    } else {
        named
    };
    let gpu = Gpu::open(None);
    match &gpu {
        Ok(gpu) => println!("GPU: {}, {}", gpu.adapter().name, gpu.adapter().driver),
        Err(problem) => println!("GPU: {problem}"),
    }
    for name in names {
        let geometry = load(&name);
        let triangles = Triangles {
            x: &geometry.x,
            y: &geometry.y,
            z: &geometry.z,
            indices: &geometry.indices,
        };
        for &resolution in resolutions {
            report(&name, triangles, resolution, rays, gpu.as_ref().ok());
        }
    }
}

fn scenes() -> Vec<String> {
    let mut names: Vec<String> = ["blob-69k", "courtyard", "conference"].map(String::from).to_vec();
    if std::env::var_os("RAYWARD_SCENES").is_some() {
        let meshes = [
            "bunny69k",
            "conference331k",
            "sponza66k",
            "forest174k",
            "dragon_bunny252k",
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

fn rays(triangles: Triangles, bvh: &Bvh, cube: &Ldc, count: usize) -> Vec<Ray> {
    let finite = (0..triangles.len() as u32).filter(|&p| !triangles.is_degenerate(p));
    let (low, high) = finite
        .flat_map(|p| triangles.corners(p))
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
    let mut numbers = Numbers(1);
    (0..count)
        .map(|i| {
            let (from, mut dir) = (middle + half * numbers.point() * 1.1, numbers.point());
            match i % 6 {
                0 => dir = Vec3::AXES[i / 6 % 3] * dir.x.signum(),
                1 => dir[i / 6 % 3] = 0.0,
                2 | 3 => {
                    let ray = Ray::new(from, dir);
                    if let Some((prim, hit)) = bvh.closest(&ray, &mut ()) {
                        let normal = triangles.normal(prim).normalize_or_zero();
                        let along = dir.as_dvec3();
                        let mirrored: DVec3 = along - normal * (2.0 * along.dot(normal));
                        let point = (from.as_dvec3() + along * hit.t).as_vec3();
                        return cube.leaving(point, normal.as_vec3(), mirrored.as_vec3());
                    }
                }
                _ => {}
            }
            Ray::new(from, dir)
        })
        .collect()
}

/// The result of the last of three runs and their median time in milliseconds.
fn timed<R>(mut run: impl FnMut() -> R) -> (R, f64) {
    let mut times = [0.0; 3];
    let mut last = None;
    for time in &mut times {
        let start = Instant::now();
        last = Some(run());
        *time = start.elapsed().as_secs_f64() * 1e3;
    }
    times.sort_by(f64::total_cmp);
    (last.expect("ran"), times[1])
}

/// Finds the triangle and parameter of a ray's closest hit.
type Find<'a> = &'a dyn Fn(&Ray, &mut StepCounts) -> Option<(u32, f64)>;

/// Counts of one hit test against the truth.
#[derive(Default)]
struct Errors {
    missed: usize,
    false_hits: usize,
    wrong_triangle: usize,
    /// Of both that hit, in texels.
    off: Vec<f64>,
}

impl Errors {
    fn add(&mut self, found: Option<(u32, f64)>, truth: Option<(u32, f64)>, texels: f64) {
        match (found, truth) {
            (None, None) => {}
            (None, Some(_)) => self.missed += 1,
            (Some(_), None) => self.false_hits += 1,
            (Some(found), Some(truth)) => {
                self.wrong_triangle += usize::from(found.0 != truth.0);
                self.off.push((found.1 - truth.1).abs() * texels);
            }
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
        let far = self.off.iter().filter(|&&e| e > 1.5).count();
        let each = |n: u64| n as f64 / rays as f64;
        println!(
            "  {name:<24} missed {:.3} % false {:.3} % other triangle {:.2} % beyond 1.5 texels {:.3} %  error p50 {:.4} p95 {:.4} p99 {:.3}  {microseconds:.2} us  cells {:.1} texels {:.1} samples {:.1} tests {:.2}",
            percent(self.missed),
            percent(self.false_hits),
            percent(self.wrong_triangle),
            percent(far),
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

fn report(name: &str, triangles: Triangles, resolution: u32, count: usize, gpu: Option<&Gpu>) {
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
    let (_, peel_ms) = build(LdcBuild::Peel, DepthFormat::F32, Hierarchy::Pyramid);
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
    let rays = rays(triangles, &bvh, &sampled, count);
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
    let measure = |name: &str, find: Find| {
        let mut steps = StepCounts::default();
        let start = Instant::now();
        let found: Vec<_> = rays.iter().map(|ray| find(ray, &mut steps)).collect();
        let time = per_ray(start);
        let mut errors = Errors::default();
        for ((ray, found), truth) in rays.iter().zip(found).zip(&truth) {
            errors.add(found, *truth, f64::from(ray.dir.length()) / sampled.texel_size());
        }
        errors.print(name, rays.len(), time, &steps);
    };
    let tolerance = HitTest::paper_tolerance(resolution);
    for (name, cube, test) in [
        ("strict, paper", &paper, HitTest::Strict { tolerance }),
        ("interval, paper", &paper, HitTest::Interval { tolerance }),
        (
            "interval, half a texel",
            &sampled,
            HitTest::Interval { tolerance: 0.5 },
        ),
        ("plane", &sampled, HitTest::Plane { margin: 0.25 }),
    ] {
        measure(name, &|ray, steps| {
            cube.closest_sampled(ray, test, steps)
                .map(|hit| (hit.prim, f64::from(hit.t)))
        });
    }
    measure("exact", &|ray, steps| {
        exact.closest(ray, steps).map(|(prim, hit)| (prim, hit.t))
    });
    if let Some(gpu) = gpu {
        // Every kind of ray in the same share.
        let stride = (rays.len() / 10_000).max(1) | 1;
        let some: Vec<usize> = (0..rays.len()).step_by(stride).take(10_000).collect();
        let few = Few {
            rays: some.iter().map(|&i| rays[i]).collect(),
            truth: some.iter().map(|&i| truth[i]).collect(),
            texel: sampled.texel_size(),
        };
        on_gpu(gpu, triangles, &bvh, resolution, &few);
    }
}

/// Rays for the GPU, and what they hit.
struct Few {
    rays: Vec<Ray>,
    truth: Vec<Option<(u32, f64)>>,
    texel: f64,
}

impl Few {
    fn print(&self, name: &str, (hits, stats): &(Vec<Option<Hit>>, TraceStats), milliseconds: f64) {
        let mut errors = Errors::default();
        for ((ray, hit), truth) in self.rays.iter().zip(hits).zip(&self.truth) {
            let found = hit.map(|hit| (hit.prim, f64::from(hit.t)));
            errors.add(found, *truth, f64::from(ray.dir.length()) / self.texel);
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
    let build = |build, hierarchy| {
        let options = CubeOptions {
            resolution,
            build,
            hierarchy,
            ..CubeOptions::default()
        };
        // Once before, for what a first use compiles.
        let built = || Cube::build(gpu, triangles, &options).expect("a cube");
        built();
        timed(built)
    };
    let (_, peel_ms) = build(LdcBuild::Peel, Hierarchy::Pyramid);
    let (sampled, centre_ms) = build(centre, Hierarchy::Pyramid);
    let (exact, exact_ms) = build(conservative, Hierarchy::Pyramid);
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
        ("GPU plane", HitTest::Plane { margin: 0.25 }),
    ] {
        let (answers, ms) = timed(|| sampled.closest_sampled(&few.rays, test).expect("answers"));
        few.print(name, &answers, ms);
    }
    let (answers, ms) = timed(|| exact.closest(&few.rays, bvh).expect("answers"));
    few.print("GPU exact", &answers, ms);
    let sent = || GpuBvh::new(gpu, triangles, &Bvh::build(triangles)).expect("a hierarchy");
    let (tree, tree_ms) = timed(sent);
    println!(
        "  GPU hierarchy: built on the CPU and sent in {tree_ms:.0} ms, MB {:.1}",
        tree.bytes() as f64 / 1e6
    );
    let (answers, ms) = timed(|| tree.closest(&few.rays, bvh).expect("answers"));
    few.print("GPU hierarchy", &answers, ms);
    for (name, hierarchy) in [
        ("GPU exact, one level", Hierarchy::Tiles { log2: [3; 2] }),
        ("GPU exact, flat", Hierarchy::Flat),
    ] {
        let (cube, _) = build(conservative, hierarchy);
        let (answers, ms) = timed(|| cube.closest(&few.rays, bvh).expect("answers"));
        few.print(name, &answers, ms);
    }
}
