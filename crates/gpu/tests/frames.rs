//! Whole pictures: the same with the hierarchy, the cube on the CPU and the cube on a GPU.

use std::sync::Arc;

use glam::DVec3;
use rayward::scene::{LightKind, Scene, builtin, default_camera, default_lights};
use rayward::{CubeBuilder, Film, Layers, RenderOptions, Renderer, SecondaryBuilder};
use rayward_gpu::{CubeOptions, Error, Gpu, GpuSecondary};

/// A scene with mirrors.
fn shiny(name: &str) -> Scene {
    let mut scene = builtin::build(name).expect("a built-in scene");
    for (i, material) in scene.materials.iter_mut().enumerate() {
        if i % 2 == 0 {
            material.metallic = 1.0;
            material.roughness = 0.0;
        }
    }
    scene
}

fn rendered(scene: &Scene, options: &RenderOptions, builder: Option<Arc<dyn SecondaryBuilder>>) -> Film {
    let frame = scene.at(0.0);
    let camera = default_camera(&frame, 1.5);
    let lights = default_lights(&camera);
    let mut renderer = Renderer::new(scene);
    if let Some(builder) = builder {
        renderer.set_secondary(builder);
    }
    let picture = renderer.render(&frame, &camera, &lights, options, &|_| ());
    picture.expect("a picture").film
}

/// A device, if there is one; with CI=true there has to be.
fn device() -> Option<Arc<GpuSecondary>> {
    match Gpu::open(None) {
        Ok(gpu) => Some(Arc::new(GpuSecondary::new(gpu, CubeOptions::default()))),
        Err(problem @ Error::NoAdapter { .. }) if std::env::var("CI").as_deref() != Ok("true") => {
            eprintln!("SKIPPED on a GPU: {problem}");
            None
        }
        Err(problem) => panic!("{problem}"),
    }
}

#[test]
fn what_the_camera_sees_and_soft_shadows_are_the_same_on_the_device() {
    let Some(device) = device() else { return };
    let scene = builtin::build("office").expect("a built-in scene");
    let frame = scene.at(0.0);
    let camera = default_camera(&frame, 1.5);
    let mut lights = default_lights(&camera);
    let mut lamp = lights[0].clone();
    lamp.kind = LightKind::Point { radius: 0.4 };
    lamp.position = camera.eye + DVec3::new(0.5, 0.7, 0.1);
    lights.push(lamp);
    let mut layers = Layers::default();
    (layers.prim, layers.depth, layers.bary) = (true, true, true);
    // The last is of an odd size and has pixels of several samples.
    for (width, height, pixel_samples, lights) in [
        (96, 64, 1, &lights[..1]),
        (96, 64, 1, &lights[1..]),
        (75, 53, 2, &lights[..]),
    ] {
        let options = RenderOptions {
            width,
            height,
            samples: 5,
            pixel_samples,
            layers,
            ..RenderOptions::default()
        };
        let mut renderer = Renderer::new(&scene);
        let render = |renderer: &mut Renderer| {
            let rendered = renderer.render(&frame, &camera, lights, &options, &|_| ());
            rendered.expect("a picture")
        };
        let expected = render(&mut renderer).film;
        let before = device.stats().rays;
        renderer.set_secondary(Arc::clone(&device) as Arc<dyn SecondaryBuilder>);
        let on_gpu = render(&mut renderer);
        assert_eq!(device.problem(), None);
        assert_eq!(on_gpu.film.prim, expected.prim, "{width} x {height}");
        assert_eq!(on_gpu.film.depth, expected.depth);
        assert_eq!(on_gpu.film.bary, expected.bary);
        assert_eq!(on_gpu.film.color, expected.color, "{width} x {height}");
        // All eye rays, and what the lights were asked.
        let asked = u64::from(width * height * pixel_samples);
        let rays = (device.stats().rays - before) as u64;
        assert!(rays > asked + asked / 4, "{rays} rays of {asked} pixels");
        let built = on_gpu.stats.structures.iter().map(|s| &*s.name);
        assert!(
            !built
                .clone()
                .any(|name| name.contains("tree") || name == "eye grid")
        );
    }
}

#[test]
fn what_stands_still_keeps_its_cube_over_frames() {
    let device = device();
    let scene = shiny("teapot-mirror");
    let frames: Vec<_> = [0.0, 0.0, 0.2, 0.3]
        .map(|moved| {
            let mut frame = scene.at(0.0);
            let last = frame.x.len() / 4;
            frame.x.iter_mut().take(last).for_each(|x| *x += moved);
            frame
        })
        .into_iter()
        .collect();
    let camera = default_camera(&frames[0], 1.5);
    let lights = default_lights(&camera);
    let options = RenderOptions {
        width: 96,
        height: 64,
        bounces: 2,
        ..RenderOptions::default()
    };
    let builders: Vec<Arc<dyn SecondaryBuilder>> = [Arc::new(CubeBuilder::default()) as _]
        .into_iter()
        .chain(device.clone().map(|device| device as _))
        .collect();
    for builder in builders {
        let mut renderer = Renderer::new(&scene);
        renderer.set_secondary(builder);
        for (n, frame) in frames.iter().enumerate() {
            let rendered = renderer.render(frame, &camera, &lights, &options, &|_| ());
            let rendered = rendered.expect("a picture");
            let expected = Renderer::new(&scene).render(frame, &camera, &lights, &options, &|_| ());
            assert_eq!(
                rendered.film.color,
                expected.expect("a picture").film.color,
                "{n}"
            );
            // In the first frame nothing is kept yet, in the third it is made again of less.
            let kept = rendered.stats.structures.iter().any(|s| s.name.contains("kept"));
            assert_eq!(kept, n == 1 || n == 3, "{n}: {:?}", rendered.stats.structures);
        }
    }
    assert_eq!(device.and_then(|device| device.problem()), None);
}

#[test]
fn pictures_are_the_same_through_the_cube() {
    let device = device();
    for name in ["office", "teapot-mirror"] {
        let scene = shiny(name);
        let options = RenderOptions {
            width: 96,
            height: 64,
            bounces: 2,
            ..RenderOptions::default()
        };
        let expected = rendered(&scene, &options, None);
        let cube = rendered(&scene, &options, Some(Arc::new(CubeBuilder::default())));
        assert_eq!(cube.color, expected.color, "{name}");
        let dull = RenderOptions {
            bounces: 0,
            ..options
        };
        assert_ne!(
            rendered(&scene, &dull, None).color,
            expected.color,
            "{name} has no mirrors"
        );
        if let Some(device) = &device {
            let before = device.stats().rays;
            let builder = Arc::clone(device) as Arc<dyn SecondaryBuilder>;
            let on_gpu = rendered(&scene, &options, Some(builder));
            assert_eq!(device.problem(), None);
            assert_eq!(on_gpu.color, expected.color, "{name}");
            assert!(device.stats().rays > before + 1000, "{:?}", device.stats());
        }
    }
    if let Some(device) = device {
        let scene = shiny("blob-1k");
        let options = RenderOptions {
            width: 96,
            height: 64,
            ..RenderOptions::default()
        };
        let expected = rendered(&scene, &options, None);
        device.gpu().destroy();
        let builder = Arc::clone(&device) as Arc<dyn SecondaryBuilder>;
        assert_eq!(rendered(&scene, &options, Some(builder)).color, expected.color);
        assert!(
            matches!(device.problem(), Some(Error::Lost { .. })),
            "{:?}",
            device.problem()
        );
    }
}
