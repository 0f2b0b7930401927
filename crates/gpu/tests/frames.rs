//! Whole pictures: the same with the hierarchy, the cube on the CPU and the cube on a GPU.

use std::sync::Arc;

use rayward::scene::{Scene, builtin, default_camera, default_lights};
use rayward::{CubeBuilder, Film, RenderOptions, Renderer, SecondaryBuilder};
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

#[test]
fn pictures_are_the_same_through_the_cube() {
    let gpu = match Gpu::open(None) {
        Ok(gpu) => Some(gpu),
        Err(problem @ Error::NoAdapter { .. }) if std::env::var("CI").as_deref() != Ok("true") => {
            eprintln!("SKIPPED on a GPU: {problem}");
            None
        }
        Err(problem) => panic!("{problem}"),
    };
    let device = gpu.map(|gpu| Arc::new(GpuSecondary::new(gpu, CubeOptions::default())));
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
