//! Surfaces shaded as arrays: the CPU's own shading through the seam gives the pictures of shading one by one, but for the order of
//! sums.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{
    Coat, FrameGeometry, LightKind, PosedLight, Scene, builtin, default_camera, default_lights,
};
use rayward::{
    Antialias, Beam, CpuShading, Environment, Layers, Picture, RenderOptions, RenderedFrame, Renderer,
    Shader, ShadingBuilder, ShadingLight, Surface, SurfacePoint, SurfaceShader,
};

/// The CPU's shading as one of arrays, or one that always fails.
#[derive(Debug)]
struct Cpu<'s> {
    shader: Shader<'s>,
    fails: bool,
}

#[derive(Debug)]
struct Frame<'g> {
    of: &'g Cpu<'g>,
    geometry: &'g FrameGeometry,
    lights: Vec<ShadingLight>,
}

impl Frame<'_> {
    fn cpu(&self) -> Option<CpuShading<'_>> {
        (!self.of.fails).then_some(CpuShading {
            shader: &self.of.shader,
            geometry: self.geometry,
            lights: &self.lights,
        })
    }
}

impl SurfaceShader for Frame<'_> {
    fn surfaces(&self, points: &[SurfacePoint]) -> Option<Vec<Surface>> {
        self.cpu().map(|cpu| cpu.surfaces(points))
    }

    fn lit(&self, surfaces: &[Surface], beams: &[Beam]) -> Option<Vec<Vec3>> {
        self.cpu().map(|cpu| cpu.lit(surfaces, beams))
    }
}

impl ShadingBuilder for Cpu<'static> {
    fn build<'g>(
        &'g self,
        geometry: &'g FrameGeometry,
        lights: &[ShadingLight],
    ) -> Option<Arc<dyn SurfaceShader + 'g>> {
        Some(Arc::new(Frame {
            of: self,
            geometry,
            lights: lights.to_vec(),
        }))
    }
}

/// A scene of which some surfaces are mirrors, some glass, some coated and some rough.
fn varied(name: &str) -> Scene {
    let mut scene = builtin::build(name).expect("a built-in scene");
    for (i, material) in scene.materials.iter_mut().enumerate() {
        if i % 3 == 1 {
            material.sheen.color = Vec3::new(0.7, 0.5, 0.3);
            material.sheen.roughness = 0.4;
        }
        match i % 5 {
            0 => (material.metallic, material.roughness) = (1.0, 0.0),
            1 => {
                material.coat = Coat {
                    factor: 0.8,
                    roughness: if i % 2 == 0 { 0.0 } else { 0.2 },
                    ..material.coat
                };
            }
            2 => (material.transmission, material.thickness, material.roughness) = (0.9, 0.3, 0.1),
            3 => (material.transmission, material.roughness) = (0.8, 0.0),
            _ => material.emissive = Vec3::new(0.1, 0.2, 0.0),
        }
    }
    scene
}

fn sky() -> Environment {
    let bright = |i: u32| if i % 37 == 5 { 9.0 } else { 0.4 };
    let pixels = (0..32 * 16).map(|i| Vec4::new(bright(i), 0.5, bright(i + 3), 1.0));
    let picture = Picture {
        width: 32,
        height: 16,
        pixels: pixels.collect(),
        srgb: false,
    };
    Environment::new(&picture, Path::new("sky")).expect("it is valid")
}

/// The scene's lights, and one of each kind with a size.
fn lights(geometry: &FrameGeometry, eye: DVec3, made_up: Vec<PosedLight>) -> Vec<PosedLight> {
    let mut lights = if geometry.lights.is_empty() {
        made_up
    } else {
        geometry.lights[..1].to_vec()
    };
    for (at, kind) in [
        (DVec3::new(0.3, 0.6, 0.0), LightKind::Point { radius: 0.3 }),
        (DVec3::new(-0.3, 0.6, 0.2), LightKind::Disk { radius: 0.3 }),
        (DVec3::ZERO, LightKind::Directional { half_angle: 0.05 }),
    ] {
        lights.push(PosedLight {
            position: eye + at,
            direction: DVec3::new(0.2, -1.0, 0.3).normalize(),
            axis_x: DVec3::X,
            axis_y: DVec3::Z,
            kind,
            ..lights[0].clone()
        });
    }
    lights
}

/// The frame one by one, and the same through shading of arrays.
fn both(
    scene: &Scene,
    sky: Option<&Environment>,
    options: &RenderOptions,
    fails: bool,
) -> [RenderedFrame; 2] {
    let geometry = scene.at(0.4);
    let camera = geometry.cameras.first().cloned();
    let camera = camera.unwrap_or_else(|| default_camera(&geometry, 1.5));
    let lights = lights(&geometry, camera.eye, default_lights(&camera));
    let mut renderer = Renderer::new(scene);
    renderer.set_environment(sky.cloned());
    let mut render = |builder: Option<Arc<dyn ShadingBuilder>>| {
        renderer.set_shading(builder);
        let picture = renderer.render(&geometry, &camera, &lights, options, &|_| ());
        picture.expect("a picture")
    };
    let leaked: &'static Scene = Box::leak(Box::new(scene.clone()));
    let shader = Shader::new(leaked);
    [render(None), render(Some(Arc::new(Cpu { shader, fails })))]
}

fn small() -> RenderOptions {
    let layers = Layers {
        alpha: true,
        depth: true,
        prim: true,
        normal: true,
        ..Layers::default()
    };
    RenderOptions {
        width: 48,
        height: 32,
        samples: 3,
        environment_samples: 4,
        bounces: 3,
        diffuse_bounces: 1,
        layers,
        ..RenderOptions::default()
    }
}

fn check(name: &str, [one, array]: &[RenderedFrame; 2]) {
    assert_eq!(array.film.prim, one.film.prim, "{name}");
    assert_eq!(array.film.depth, one.film.depth, "{name}");
    assert_eq!(array.film.normal, one.film.normal, "{name}");
    assert_eq!(array.film.alpha, one.film.alpha, "{name}");
    for (i, (a, b)) in array.film.color.iter().zip(&one.film.color).enumerate() {
        let off = (*a - *b).abs().max_element();
        assert!(
            off <= 2e-5 * (1.0 + b.max_element()),
            "{name}: pixel {i}: {a} instead of {b}"
        );
    }
    assert_eq!(array.stats.secondary_rays, one.stats.secondary_rays, "{name}");
    assert_eq!(array.stats.shadow_rays, one.stats.shadow_rays, "{name}");
}

#[test]
fn arrays_give_the_same_pictures() {
    let options = small();
    let sky = sky();
    for name in ["teapot-mirror", "office", "forest", "solids", "walker"] {
        let scene = varied(name);
        for sky in [None, Some(&sky)] {
            check(name, &both(&scene, sky, &options, false));
        }
    }
}

#[test]
fn what_fails_is_stood_in_for() {
    let scene = varied("teapot-mirror");
    check("failing", &both(&scene, Some(&sky()), &small(), true));
}

#[test]
fn samples_of_pixels_shadows_left_out_and_the_papers_parameters_too() {
    let scene = builtin::build("teapot-mirror").expect("a built-in scene");
    let coverage = RenderOptions {
        antialias: Antialias::Coverage,
        pixel_samples: 4,
        ..small()
    };
    check("coverage", &both(&scene, None, &coverage, false));
    let unshadowed = RenderOptions {
        shadows: false,
        ..small()
    };
    check("without shadows", &both(&scene, None, &unshadowed, false));
    let paper = RenderOptions {
        paper: true,
        ..small()
    };
    check("paper", &both(&scene, None, &paper, false));
}
