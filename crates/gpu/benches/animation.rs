//! What frames of an animation cost whose structures for any ray are built anew in each: the layered depth cube, whole or
//! with what stands still kept, and the general hierarchy; on a GPU, there also of vertices that are posed on it, and on
//! the CPU.
//!
//! `cargo bench -p rayward-gpu --bench animation [-- SCENE RAYS]`. A built-in scene, `courtyard` if none is named, through
//! which a skinned figure walks: nine frames, a tenth of a second apart, of which the first two are not counted, for they
//! compile shaders and build all that is kept. In each frame every structure is built and traced with the same rays, the
//! reflections of what a camera sees, on one thread, and all answers have to be alike. Medians over frames, of build, of a
//! ray, and of a frame with so many rays beside the whole cube's. A cube or hierarchy on a GPU needs the CPU's hierarchy
//! for what f32 cannot tell; it is counted with them ("of it, the CPU's").
//!
//! Run as a test it does little.

mod common;

use std::time::Instant;

use common::{Start, start};
use rayward::CameraFrame;
use rayward_gpu::trace::{Bvh, Ldc, LdcOptions, Receiver, SurfaceRay, Triangles, View, exact, ldc};
use rayward_gpu::{Cube, CubeOptions, Gpu, GpuBvh, GpuSkin, StillCube, TraceStats};
use rayward_scene::{FrameGeometry, Scene, default_camera};

/// Frames that are not counted.
const WARM: usize = 2;

fn main() {
    let Start {
        test,
        names,
        count,
        gpu,
    } = start();
    let name = names.first().map_or("courtyard", String::as_str);
    let (name, resolutions, rays, frames): (_, &[u32], _, _) = if test {
        ("walker", &[64], 100, 4)
    } else {
        (name, &[512, 1024], count.unwrap_or(10_000), 9)
    };
    let scene = rayward_scene::builtin::build(name).expect("a built-in scene");
    for &resolution in resolutions {
        animated(&scene, resolution, rays, frames, gpu.as_ref().ok());
    }
}

/// One way to answer rays, and its times of each frame in milliseconds.
#[derive(Default)]
struct Way {
    name: &'static str,
    builds: Vec<f64>,
    /// Parts of the builds.
    of_cpu: Vec<f64>,
    traces: Vec<f64>,
    rebuilt: usize,
    unsure: usize,
}

/// All ways in the order in which they were first told of.
#[derive(Default)]
struct Ways {
    all: Vec<Way>,
    counted: bool,
}

impl Ways {
    fn tell(&mut self, name: &'static str, milliseconds: [f64; 3], rebuilt: usize, unsure: usize) {
        if !self.counted {
            return;
        }
        let at = self.all.iter().position(|way| way.name == name);
        let at = at.unwrap_or_else(|| {
            let way = Way {
                name,
                ..Way::default()
            };
            self.all.push(way);
            self.all.len() - 1
        });
        let way = &mut self.all[at];
        let [build, of_cpu, trace] = milliseconds;
        way.builds.push(build);
        way.of_cpu.push(of_cpu);
        way.traces.push(trace);
        (way.rebuilt, way.unsure) = (rebuilt, unsure);
    }

    fn print(&self, rays: usize) {
        let frame = |way: &Way| median(&way.builds) + median(&way.traces);
        let Some(first) = self.all.first() else { return };
        for way in &self.all {
            println!(
                "  {:<42} built {:>8.1} ms (of it, the CPU's {:.1}; {} triangles), a ray {:>7.2} us, a frame {:>8.1} ms, {:.2} of the first's; unsure {:.2} %",
                way.name,
                median(&way.builds),
                median(&way.of_cpu),
                way.rebuilt,
                median(&way.traces) * 1e3 / rays as f64,
                frame(way),
                frame(way) / frame(first),
                way.unsure as f64 * 100.0 / rays as f64,
            );
        }
    }
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn timed<R>(run: impl FnOnce() -> R) -> (R, f64) {
    let start = Instant::now();
    let made = run();
    (made, start.elapsed().as_secs_f64() * 1e3)
}

/// Reflections of what the pixels of a view see, as many as pixels see something.
fn reflections(view: &View, triangles: &Triangles, bvh: &Bvh) -> Vec<SurfaceRay> {
    let pixels = (0..view.height).flat_map(|y| (0..view.width).map(move |x| (x, y)));
    let mut hits = Vec::new();
    let reflected = pixels.filter_map(|(x, y)| {
        let ray = view.pixel_ray(x, y);
        bvh.along(&ray, &mut (), &mut hits);
        let &(_, prim) = hits.first()?;
        let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim))?;
        let normal = triangles.normal(prim).normalize_or_zero();
        let dir = ray.dir - normal * (2.0 * ray.dir.dot(normal));
        Some(SurfaceRay {
            from: Receiver::along(&ray, hit.t, prim),
            dir: dir.as_vec3(),
        })
    });
    reflected.collect()
}

/// The hierarchy that answers for a frame, and the frame's rays.
struct Asked<'a> {
    triangles: Triangles<'a>,
    bvh: Bvh<'a>,
    built: f64,
    rays: Vec<SurfaceRay>,
    truth: Vec<Option<(u32, exact::ExactHit)>>,
    traced: f64,
}

impl<'a> Asked<'a> {
    fn of(triangles: Triangles<'a>, view: &View) -> Self {
        let (bvh, built) = timed(|| Bvh::build(triangles));
        let rays = reflections(view, &triangles, &bvh);
        let (truth, traced) = timed(|| rays.iter().map(|ray| bvh.after(ray, &mut ())).collect());
        Self {
            triangles,
            bvh,
            built,
            rays,
            truth,
            traced,
        }
    }

    /// Traces a cube on the device and tells of it.
    fn told(&self, ways: &mut Ways, name: &'static str, cube: &Cube, built: f64) {
        let (answers, traced) = timed(|| cube.after(&self.rays, &self.bvh).expect("answers"));
        self.compared(
            ways,
            name,
            answers,
            [built + self.built, self.built, traced],
            cube.rebuilt(),
        );
    }

    fn compared(
        &self,
        ways: &mut Ways,
        name: &'static str,
        (hits, stats): (Vec<Option<(u32, exact::ExactHit)>>, TraceStats),
        milliseconds: [f64; 3],
        rebuilt: usize,
    ) {
        assert!(hits == self.truth, "{name} answers as the hierarchy does");
        ways.tell(name, milliseconds, rebuilt, stats.unsure);
    }
}

/// Cubes that keep what stands still, of a row of frames.
struct Kept {
    device: StillCube,
    posed: StillCube,
    cpu: ldc::StillCube,
}

fn animated(scene: &Scene, resolution: u32, rays: usize, frames: usize, gpu: Option<&Gpu>) {
    let options = LdcOptions {
        resolution,
        ..LdcOptions::default()
    };
    let mut kept = Kept {
        device: StillCube::default(),
        posed: StillCube::default(),
        cpu: ldc::StillCube::new(options),
    };
    let skin = gpu.map(|gpu| GpuSkin::new(gpu, scene).expect("vertices"));
    let mut ways = Ways::default();
    let mut count = 0;
    for n in 0..frames {
        ways.counted = n >= WARM.min(frames - 1);
        let time = n as f32 * 0.1;
        let (geometry, posing) = timed(|| scene.at(time));
        let view = view(&geometry, rays);
        let asked = Asked::of(rayward::triangles(&geometry), &view);
        count = asked.rays.len();
        if let (Some(gpu), Some(skin)) = (gpu, &skin) {
            on_gpu(&mut ways, &asked, &mut kept, gpu, resolution);
            posed_there(&mut ways, &geometry, &mut kept, skin, (&view, time), resolution);
        }
        on_cpu(&mut ways, &asked, &mut kept.cpu, &options);
        ways.tell("vertices posed on the CPU", [posing, posing, 0.0], 0, 0);
    }
    println!("{} at {resolution}: {count} rays a frame", scene.name);
    ways.print(count);
}

/// A view of about so many pixels.
fn view(geometry: &FrameGeometry, pixels: usize) -> View {
    let height = ((pixels as f64 / 1.5).sqrt() as u32).max(1);
    let width = height * 3 / 2;
    let posed = default_camera(geometry, f64::from(width) / f64::from(height));
    CameraFrame::new(&posed, geometry.origin, width, height)
        .expect("a camera")
        .view(geometry)
}

fn on_gpu(ways: &mut Ways, asked: &Asked, kept: &mut Kept, gpu: &Gpu, resolution: u32) {
    let options = CubeOptions {
        resolution,
        ..CubeOptions::default()
    };
    let (cube, built) = timed(|| Cube::build(gpu, asked.triangles, &options).expect("a cube"));
    asked.told(ways, "GPU cube, whole", &cube, built);
    drop(cube);
    let (cube, built) = timed(|| kept.device.build(gpu, asked.triangles, &options).expect("a cube"));
    asked.told(ways, "GPU cube, what stands still kept", &cube, built);
    drop(cube);
    let (tree, sent) = timed(|| GpuBvh::new(gpu, asked.triangles, &asked.bvh).expect("a hierarchy"));
    let (answers, traced) = timed(|| tree.after(&asked.rays, &asked.bvh).expect("answers"));
    let all = asked.triangles.len();
    let times = [sent + asked.built, asked.built, traced];
    asked.compared(ways, "GPU hierarchy", answers, times, all);
}

fn posed_there(
    ways: &mut Ways,
    geometry: &FrameGeometry,
    kept: &mut Kept,
    skin: &GpuSkin,
    (view, time): (&View, f32),
    resolution: u32,
) {
    let options = CubeOptions {
        resolution,
        ..CubeOptions::default()
    };
    let (posed, posing) = timed(|| skin.pose(Some(0), time).expect("vertices"));
    ways.tell("vertices posed on the GPU, read back", [posing, 0.0, 0.0], 0, 0);
    // Its own rays: they start on its surfaces.
    let asked = Asked::of(posed.triangles(&geometry.indices), view);
    let (cube, built) = timed(|| Cube::build_posed(&posed, &geometry.indices, &options).expect("a cube"));
    asked.told(ways, "GPU cube of vertices posed there, whole", &cube, built);
    drop(cube);
    let mut build = || kept.posed.build_posed(&posed, &geometry.indices, &options);
    let (cube, built) = timed(|| build().expect("a cube"));
    asked.told(ways, "GPU cube of vertices posed there, kept", &cube, built);
}

fn on_cpu(ways: &mut Ways, asked: &Asked, still: &mut ldc::StillCube, options: &LdcOptions) {
    let mut traced_by = |name, cube: &Ldc, built: f64| {
        let trace = || asked.rays.iter().map(|ray| cube.after(ray, &mut ())).collect();
        let (hits, traced): (Vec<_>, _) = timed(trace);
        let nothing = TraceStats::default();
        asked.compared(
            ways,
            name,
            (hits, nothing),
            [built, built, traced],
            cube.rebuilt(),
        );
    };
    let (cube, built) = timed(|| Ldc::build(asked.triangles, options));
    traced_by("CPU cube, whole", &cube, built);
    let (cube, built) = timed(|| still.build(asked.triangles));
    traced_by("CPU cube, what stands still kept", &cube, built);
    let all = asked.triangles.len();
    let times = [asked.built, asked.built, asked.traced];
    ways.tell("CPU hierarchy", times, all, 0);
}
