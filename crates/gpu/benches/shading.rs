//! What shading costs on the CPU and on a GPU, by itself and in whole frames.
//!
//! `cargo bench -p rayward-gpu --bench shading [-- SCENE... WIDTH]`. For each scene: surfaces of all that the camera sees, then the
//! light of its lights on them, 65,536 points at a time as the device takes them; then a frame with all rays on the device,
//! shaded by either. One thread; times are medians of [`RUNS`], both ways in turn. Run as a test it does little.

mod common;

use std::sync::Arc;
use std::time::Instant;

use common::{Start, start};
use glam::Vec3;
use rayward::scene::{FrameGeometry, builtin, default_camera, default_lights};
use rayward::shade::object_of;
use rayward::trace::{Bvh, exact};
use rayward::{
    Beam, CameraFrame, CpuShading, RenderOptions, Renderer, Shader, ShadingBuilder, ShadingLight, Source,
    Surface, SurfacePoint, SurfaceShader, triangles,
};
use rayward_gpu::{CubeOptions, GpuSecondary, GpuShading};

/// How often each is measured.
const RUNS: usize = 5;

fn main() {
    let Start {
        test,
        names,
        count,
        gpu,
    } = start();
    let names = match (test, names.is_empty()) {
        (true, _) => vec!["blob-1k".to_owned()],
        (_, true) => ["courtyard", "office", "conference"].map(str::to_owned).into(),
        _ => names,
    };
    let Ok(gpu) = gpu else { return };
    let device = Arc::new(GpuSecondary::new(gpu, CubeOptions::default()));
    let width = if test {
        64
    } else {
        count.map_or(960, |width| width as u32)
    };
    for name in names {
        measure(&device, &name, [width, (width * 5 / 8).max(1)]);
    }
}

/// Milliseconds of the middle one of several runs of each of two ways, in turn.
fn medians(mut ways: [&mut dyn FnMut(); 2]) -> [f64; 2] {
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..RUNS {
        for (way, times) in ways.iter_mut().zip(&mut times) {
            let start = Instant::now();
            way();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

/// Where the camera's rays meet triangles.
fn points(geometry: &FrameGeometry, camera: &CameraFrame) -> Vec<SurfacePoint> {
    let (view, bvh) = (camera.view(geometry), Bvh::build(triangles(geometry)));
    let mut hits = Vec::new();
    let mut points = Vec::new();
    for pixel in 0..camera.width * camera.height {
        let ray = view.pixel_ray(pixel % camera.width, pixel / camera.width);
        bvh.along(&ray, &mut (), &mut hits);
        let Some(&(_, prim)) = hits.first() else { continue };
        let corners = triangles(geometry).corners(prim);
        let Some(hit) = exact::attributes(ray.origin, ray.dir, corners) else {
            continue;
        };
        points.push(SurfacePoint {
            prim,
            object: object_of(geometry, prim),
            u: hit.u as f32,
            v: hit.v as f32,
            view: (-ray.dir.normalize()).as_vec3(),
            footprint: camera.footprint(hit.t as f32),
        });
    }
    points
}

fn measure(device: &Arc<GpuSecondary>, name: &str, [width, height]: [u32; 2]) {
    let scene = builtin::build(name).expect("a built-in scene");
    let geometry = scene.at(0.0);
    let aspect = f64::from(width) / f64::from(height);
    let camera = geometry.cameras.first().cloned();
    let camera = camera.unwrap_or_else(|| default_camera(&geometry, aspect));
    let lights = if geometry.lights.is_empty() {
        default_lights(&camera)
    } else {
        geometry.lights.clone()
    };
    let shader = Shader::new(&scene);
    let shading = Arc::new(GpuShading::new(device, &shader).expect("the scene fits"));
    let own: Vec<_> = lights
        .iter()
        .map(|light| ShadingLight::new(light, geometry.origin))
        .collect();
    let frame = shading.build(&geometry, &own).expect("the frame fits");
    let cpu = CpuShading {
        shader: &shader,
        geometry: &geometry,
        lights: &own,
    };
    let posed = CameraFrame::new(&camera, geometry.origin, width, height).expect("a valid size");
    let points = points(&geometry, &posed);
    let ways: [&dyn SurfaceShader; 2] = [&cpu, &*frame];
    let make = |way: usize| ways[way].surfaces(&points).expect("a working device");
    let [on_cpu, on_device] = medians([&mut || drop(make(0)), &mut || drop(make(1))]);
    println!(
        "{name}: {} surfaces, ms: CPU {on_cpu:.1}, device {on_device:.1}",
        points.len()
    );

    let surfaces: Vec<Surface> = make(0);
    let beams: Vec<Beam> = (0..surfaces.len() as u32)
        .flat_map(|surface| {
            (0..own.len() as u32).map(move |light| Beam {
                surface,
                share: Vec3::ONE,
                source: Source::Light(light),
            })
        })
        .collect();
    let light = |way: usize| ways[way].lit(&surfaces, &beams).expect("a working device");
    let [on_cpu, on_device] = medians([&mut || drop(light(0)), &mut || drop(light(1))]);
    println!(
        "{name}: {} beams, ms: CPU {on_cpu:.1}, device {on_device:.1}",
        beams.len()
    );

    let options = RenderOptions {
        width,
        height,
        ..RenderOptions::default()
    };
    let mut renderers = [Renderer::new(&scene), Renderer::new(&scene)];
    for renderer in &mut renderers {
        renderer.set_secondary(Arc::clone(device) as Arc<_>);
    }
    let [by_cpu, by_device] = &mut renderers;
    by_device.set_shading(Some(Arc::clone(&shading) as Arc<_>));
    let render = |renderer: &mut Renderer| {
        let picture = renderer.render(&geometry, &camera, &lights, &options, &|_| ());
        drop(picture.expect("a picture"));
    };
    let [on_cpu, on_device] = medians([&mut || render(by_cpu), &mut || render(by_device)]);
    println!(
        "{name}: frame with its rays on the device, ms: shaded by the CPU {on_cpu:.0}, there {on_device:.0}"
    );
    assert_eq!((device.problem(), shading.problem()), (None, None));
}
