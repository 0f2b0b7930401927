//! Visibility of whole frames at 1920 x 1200 on one thread, every structure rebuilt for every frame.
//!
//! `eye`: grid built, closest triangle of every pixel found. `eye_and_hard_shadows`: the same, then every pixel told
//! whether one light reaches it. `eye_and_looked_up_shadows`: the same by HM08's own way, the light's grid built and
//! one shadow ray looked up from every pixel that sees a surface; `eye_and_dark_cells`: with cells that also know what
//! they hide whole; `eye_and_shadows_by_tree`: in a hierarchy, whose predicted steps are printed beside those taken.
//! `eye_and_soft_shadows`: eight samples of a square light. No shading. Items are pixels and shadow rays.
//!
//! Built-in scenes always; the meshes of `RAYWARD_SCENES` (a folder with `cameras.json`) where it is set. Run
//! as a test (`cargo test --benches`) the raster is small.

use std::path::Path;
use std::sync::Mutex;

use divan::Bencher;
use divan::counter::ItemsCount;
use rayward::scene::{self, FrameGeometry, LoadOptions, PosedCamera, PosedLight};
use rayward::trace::{
    AreaLight, AreaLightTree, AreaScratch, Casts, Clusters, EyeGrid, EyeGridOptions, Light, LightGridOptions,
    LightQuery, LitPixels, LitScratch, PointLightGrid, PointLightTree, Receiver, Samples, ShadowScratch,
    SimdLevel, TileHits, Topology, View, Visibility, exact,
};
use rayward::{CameraFrame, FramePlan, RenderOptions, shadow_end, triangles};

fn main() {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()
        .expect("one pool");
    divan::main();
}

/// Names of the scenes that are there.
fn scenes() -> Vec<String> {
    let built_in = [
        "courtyard",
        "forest",
        "office",
        "conference",
        "blob-1k",
        "blob-16k",
        "blob-69k",
        "collide",
    ];
    let mut names: Vec<String> = built_in.map(String::from).to_vec();
    if std::env::var_os("RAYWARD_SCENES").is_some_and(|value| !value.is_empty()) && !is_test() {
        let meshes = [
            "bunny69k",
            "conference331k",
            "sponza66k",
            "crytek_sponza279k",
            "forest174k",
            "dragon_bunny252k",
        ];
        names.extend(meshes.map(|n| format!("{n}.ply")));
    }
    names
}

fn is_test() -> bool {
    !std::env::args().any(|a| a == "--bench")
}

struct Frame {
    name: String,
    geometry: FrameGeometry,
    /// Found once, as an animation would.
    clusters: Clusters,
    topology: Topology,
    camera: PosedCamera,
    light: PosedLight,
    /// The light with a size.
    area: AreaLight,
}

/// The scene of that name; the last one is kept, for benchmarks of one scene follow each other.
fn with_frame<R>(name: &str, use_it: impl FnOnce(&Frame) -> R) -> R {
    static LAST: Mutex<Option<Frame>> = Mutex::new(None);
    let mut last = LAST.lock().expect("no benchmark panics");
    if last.as_ref().is_none_or(|f| f.name != name) {
        *last = Some(load(name));
    }
    use_it(last.as_ref().expect("just loaded"))
}

fn load(name: &str) -> Frame {
    let Some(mesh) = name.strip_suffix(".ply") else {
        let geometry = scene::builtin::build(name).expect("a built-in scene").at(0.0);
        let (camera, light) = (geometry.cameras[0].clone(), geometry.lights[0].clone());
        let area = area(&geometry, scene::square_light_at(&light, &geometry));
        return Frame {
            name: name.into(),
            clusters: Clusters::new(&triangles(&geometry)),
            topology: Topology::analyse(&triangles(&geometry)),
            geometry,
            camera,
            light,
            area,
        };
    };
    let folder = std::env::var_os("RAYWARD_SCENES").expect("checked");
    let folder = Path::new(&folder);
    let cameras = scene::read_camera_file(&folder.join("cameras.json")).expect("a camera file");
    let entry = &cameras[mesh];
    let file = folder.join("bench").join(name);
    let geometry = scene::load(&file, &LoadOptions::default())
        .expect("a mesh")
        .at(0.0);
    let mut lights = entry.lights();
    let area = area(&geometry, lights.pop().expect("an area light"));
    Frame {
        name: name.into(),
        clusters: Clusters::new(&triangles(&geometry)),
        topology: Topology::analyse(&triangles(&geometry)),
        geometry,
        camera: entry.camera(),
        light: lights.pop().expect("a point light"),
        area,
    }
}

fn area(geometry: &FrameGeometry, light: PosedLight) -> AreaLight {
    let plan = FramePlan::new(geometry, &[light], &RenderOptions::default());
    let area = plan.lights[0].as_ref().and_then(|light| light.area);
    area.expect("a light with a size")
}

fn view(frame: &Frame) -> View {
    let (width, height) = if is_test() { (96, 60) } else { (1920, 1200) };
    let camera = CameraFrame::new(&frame.camera, frame.geometry.origin, width, height).expect("valid");
    camera.view(&frame.geometry)
}

/// Closest triangles of all pixels, given to `see` tile by tile as receivers with their pixels, blocks of 8 x 8
/// pixels and in these squares of 4 x 4 together.
fn trace(frame: &Frame, mut see: impl FnMut(&[Receiver], &[u32])) {
    let triangles = triangles(&frame.geometry);
    let grid = EyeGrid::build_clustered(
        view(frame),
        triangles,
        &frame.clusters,
        EyeGridOptions::default(),
        SimdLevel::detect(),
    );
    let (mut hits, mut receivers, mut pixels) = (TileHits::default(), Vec::new(), Vec::new());
    for index in 0..grid.tile_count() {
        let tile = grid.tile(index);
        grid.trace_tile(&tile, &mut hits);
        receivers.clear();
        pixels.clear();
        let blocks = (0..tile.height).step_by(8);
        let blocks = blocks.flat_map(|y| (0..tile.width).step_by(8).map(move |x| (x, y)));
        let squares = blocks.flat_map(|(x, y)| (0..4).map(move |i| (x + i % 2 * 4, y + i / 2 * 4)));
        for (x, y) in squares.flat_map(|(x, y)| (0..16).map(move |i| (x + i % 4, y + i / 4))) {
            if x >= tile.width || y >= tile.height {
                continue;
            }
            let Some(prim) = hits.prim(x, y) else { continue };
            let ray = grid.view().pixel_ray(tile.x + x, tile.y + y);
            if let Some(hit) = exact::attributes(ray.origin, ray.dir, triangles.corners(prim)) {
                let (point, error) = (ray.origin + ray.dir * hit.t, hit.t * 1e-12);
                receivers.push(Receiver { point, error, prim });
                pixels.push((tile.y + y) * grid.view().width + tile.x + x);
            }
        }
        see(&receivers, &pixels);
    }
}

#[divan::bench(args = scenes())]
fn eye(bencher: Bencher, name: &str) {
    with_frame(name, |frame| {
        let triangles = triangles(&frame.geometry);
        let view = view(frame);
        bencher
            .counter(ItemsCount::new(view.width * view.height))
            .bench_local(|| {
                let (clusters, options) = (&frame.clusters, EyeGridOptions::default());
                let grid = EyeGrid::build_clustered(view, triangles, clusters, options, SimdLevel::detect());
                let mut hits = TileHits::default();
                for index in 0..grid.tile_count() {
                    grid.trace_tile(&grid.tile(index), &mut hits);
                }
                hits
            });
    });
}

#[divan::bench(args = scenes())]
fn eye_and_hard_shadows(bencher: Bencher, name: &str) {
    with_frame(name, |frame| {
        let (view, triangles) = (view(frame), triangles(&frame.geometry));
        let query = LightQuery {
            light: shadow_end(&frame.light, frame.geometry.origin),
            cone: None,
            eye: Light::Point(view.center),
            rule: &|_| Casts::Both,
        };
        let mut scratch = LitScratch::default();
        let mut run = || {
            let level = SimdLevel::detect();
            let options = EyeGridOptions::default();
            let grid = EyeGrid::build_clustered(view, triangles, &frame.clusters, options, level);
            let visibility = Visibility::trace(&grid, &|| ());
            LitPixels::find(
                &visibility,
                &triangles,
                &frame.clusters,
                &query,
                level,
                &mut scratch,
            )
        };
        let counts = run().counts;
        if !is_test() {
            println!("{name}: {counts:?}");
        }
        let rays = u64::from(view.width * view.height) + counts.receivers;
        bencher.counter(ItemsCount::new(rays)).bench_local(run);
    });
}

/// Answers for receivers, one entry each.
type Ask<'a> = Box<dyn Fn(&[Receiver], &mut ShadowScratch, &mut Vec<bool>) + 'a>;

/// Times eye rays and a shadow ray from everything seen, asked of what `build` makes for a light; says what was counted.
fn look_up(bencher: Bencher, name: &str, build: impl for<'a> Fn(&'a Frame, Light) -> Ask<'a>) {
    with_frame(name, |frame| {
        let light = shadow_end(&frame.light, frame.geometry.origin);
        let (mut asked, view) = (0, view(frame));
        trace(frame, |receivers, _| asked += receivers.len());
        let rays = (view.width * view.height) as usize + asked;
        let run = || {
            let ask = build(frame, light);
            let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
            trace(frame, |receivers, _| ask(receivers, &mut scratch, &mut shadow));
            scratch.counts
        };
        if !is_test() {
            println!("{name}: {:?}", run());
        }
        bencher.counter(ItemsCount::new(rays)).bench_local(run);
    });
}

#[divan::bench(args = scenes())]
fn eye_and_looked_up_shadows(bencher: Bencher, name: &str) {
    look_up(bencher, name, |frame, light| {
        let (triangles, options) = (triangles(&frame.geometry), LightGridOptions::default());
        let level = SimdLevel::detect();
        let grid = PointLightGrid::build(light, triangles, &|_| Casts::Both, options, level);
        Box::new(move |receivers, scratch, shadow| grid.shadowed(receivers, scratch, shadow))
    });
}

#[divan::bench(args = scenes())]
fn eye_and_dark_cells(bencher: Bencher, name: &str) {
    look_up(bencher, name, |frame, light| {
        let (triangles, topology) = (triangles(&frame.geometry), &frame.topology);
        let (options, level) = (LightGridOptions::default(), SimdLevel::detect());
        let cast = |_| Casts::Both;
        let grid = PointLightGrid::build_with_topology(light, triangles, topology, &cast, options, level);
        Box::new(move |receivers, scratch, shadow| grid.shadowed(receivers, scratch, shadow))
    });
}

#[divan::bench(args = scenes())]
fn eye_and_shadows_by_tree(bencher: Bencher, name: &str) {
    if !is_test() {
        with_frame(name, |frame| {
            let tree = tree(frame, shadow_end(&frame.light, frame.geometry.origin));
            let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
            trace(frame, |receivers, _| {
                tree.shadowed(receivers, &mut scratch, &mut shadow);
            });
            let (counts, predicted) = (scratch.counts, tree.predicted());
            let mean = |sum: u64| sum as f64 / counts.receivers as f64;
            println!(
                "{name}: {:.1} nodes a ray predicted, {:.1} entered; {:.1} triangles predicted, {:.1} tested",
                predicted.nodes,
                mean(counts.nodes),
                predicted.triangles,
                mean(counts.tests)
            );
        });
    }
    look_up(bencher, name, |frame, light| {
        let tree = tree(frame, light);
        Box::new(move |receivers, scratch, shadow| tree.shadowed(receivers, scratch, shadow))
    });
}

fn tree(frame: &Frame, light: Light) -> PointLightTree<'_> {
    let (triangles, level) = (triangles(&frame.geometry), SimdLevel::detect());
    PointLightTree::build(light, triangles, &|_| Casts::Both, None, level)
}

#[divan::bench(args = scenes())]
fn eye_and_soft_shadows(bencher: Bencher, name: &str) {
    with_frame(name, |frame| {
        let (mut asked, view) = (0, view(frame));
        trace(frame, |receivers, _| asked += receivers.len());
        let samples = Samples::new(8, 0);
        let rays = (view.width * view.height) as usize + asked * samples.count() as usize;
        bencher.counter(ItemsCount::new(rays)).bench_local(|| {
            let triangles = triangles(&frame.geometry);
            let tree = AreaLightTree::build(frame.area, triangles, &|_| Casts::Both, SimdLevel::detect());
            let (mut scratch, mut visible) = (AreaScratch::default(), Vec::new());
            trace(frame, |receivers, pixels| {
                tree.visible(receivers, pixels, &samples, &mut scratch, &mut visible);
            });
            scratch.counts
        });
    });
}
