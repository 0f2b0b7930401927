//! Whole pictures shaded on a device, beside the CPU's.

use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{
    AlphaMode, Coat, Image, LightKind, Sampler, Scene, TextureRef, TextureTransform, Wrap, builtin,
    default_camera, default_lights,
};
use rayward::{
    Antialias, CompareOptions, Environment, Film, Layers, Picture, RenderOptions, Renderer, ToneMap,
    ToneMapper, compare,
};
use rayward_gpu::{CubeOptions, Error, Gpu, GpuSecondary, GpuShading};

/// Largest mean FLIP of two pictures of one frame.
const FLIP: f64 = 1e-3;

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

/// The built-in scene with textures, mirrors, glass, coats and, if asked for, surfaces that are seen through.
fn varied(name: &str, veils: bool) -> Scene {
    let mut scene = builtin::build(name).expect("a built-in scene");
    let texel = |i: u32| {
        let (x, y) = (i % 24, i / 24);
        let check = if (x / 3 + y / 3) % 2 == 0 { 230 } else { 90 };
        [
            check,
            (x * 10) as u8,
            200 - (y * 9) as u8,
            if x % 6 < 3 { 255 } else { 40 },
        ]
    };
    let image = scene.images.len();
    scene.images.push(Image {
        name: "checks".into(),
        width: 24,
        height: 17,
        texels: (0..24 * 17).map(texel).collect(),
    });
    let sampler = scene.samplers.len();
    for (wrap, nearest) in [
        (Wrap::MirroredRepeat, false),
        (Wrap::ClampToEdge, true),
        (Wrap::Repeat, false),
    ] {
        scene.samplers.push(Sampler {
            wrap_u: wrap,
            wrap_v: Wrap::Repeat,
            mag_nearest: nearest,
            min_nearest: nearest,
            mipmaps: !nearest,
        });
    }
    let texture = |i: usize| TextureRef {
        image,
        sampler: sampler + i % 3,
        uv_set: 0,
        transform: TextureTransform::default(),
    };
    for (i, material) in scene.materials.iter_mut().enumerate() {
        if i % 3 == 1 {
            material.sheen.color = Vec3::new(0.7, 0.5, 0.3);
            material.sheen.roughness = 0.4;
        }
        material.base_color_texture = material.base_color_texture.or(Some(texture(i)));
        match i % 6 {
            0 => (material.metallic, material.roughness) = (1.0, 0.0),
            1 => {
                material.normal_texture = Some(texture(i));
                material.coat = Coat {
                    factor: 0.8,
                    roughness: 0.1,
                    ..material.coat
                };
            }
            2 => (material.transmission, material.thickness, material.roughness) = (0.9, 0.3, 0.1),
            3 => material.metallic_roughness_texture = Some(texture(i)),
            4 => material.emissive = Vec3::new(0.1, 0.2, 0.0),
            _ if veils => material.alpha_mode = AlphaMode::Blend,
            _ => material.unlit = true,
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

/// The frame by the CPU, and shaded on the device; how many surfaces were.
fn both(
    device: &Arc<GpuSecondary>,
    scene: &Scene,
    sky: Option<Environment>,
    options: &RenderOptions,
) -> ([Film; 2], u64) {
    let geometry = scene.at(0.3);
    let camera = geometry.cameras.first().cloned();
    let camera = camera.unwrap_or_else(|| default_camera(&geometry, 1.5));
    let mut lights = if geometry.lights.is_empty() {
        default_lights(&camera)
    } else {
        geometry.lights.clone()
    };
    let mut lamp = lights[0].clone();
    lamp.kind = LightKind::Point { radius: 0.4 };
    lamp.position = camera.eye + DVec3::new(0.5, 0.7, 0.1);
    lights.push(lamp);
    let mut renderer = Renderer::new(scene);
    renderer.set_environment(sky);
    let render = |renderer: &mut Renderer| {
        let rendered = renderer.render(&geometry, &camera, &lights, options, &|_| ());
        rendered.expect("a picture").film
    };
    let cpu = render(&mut renderer);
    let shading = Arc::new(GpuShading::new(device, renderer.shader()).expect("it fits"));
    renderer.set_secondary(Arc::clone(device) as Arc<_>);
    renderer.set_shading(Some(Arc::clone(&shading) as Arc<_>));
    let on_device = render(&mut renderer);
    assert_eq!((device.problem(), shading.problem()), (None, None));
    ([cpu, on_device], shading.stats().surfaces)
}

/// Compares both pictures; returns the largest difference of a byte.
fn check(what: &str, [cpu, device]: &[Film; 2]) -> u8 {
    let prims = device.prim.iter().zip(&cpu.prim);
    let other: Vec<_> = prims.enumerate().filter(|(_, (a, b))| a != b).collect();
    assert!(other.is_empty(), "{what}: pixels and triangles {other:?}");
    assert_eq!(device.depth, cpu.depth, "{what}");
    let pictures = [cpu, device].map(|film| Picture::from(film).to_srgb());
    let found = compare(&pictures[0], &pictures[1], &CompareOptions::default()).expect("one size");
    let bytes = [cpu, device].map(|film| ToneMapper::new(ToneMap::None).encode(film));
    let off = bytes[0].iter().zip(&bytes[1]).map(|(a, b)| a.abs_diff(*b));
    let (most, differing) = (off.clone().max().unwrap_or(0), off.filter(|&off| off > 1).count());
    println!(
        "{what}: mean FLIP {:.6}, {differing} bytes off by more than 1, at most {most}",
        found.mean_flip
    );
    assert!(found.mean_flip <= FLIP, "{what}: {}", found.mean_flip);
    // A ray that a mirror sends, or one side of a texel, may be another one here and there.
    assert!(
        differing * 500 <= bytes[0].len(),
        "{what}: {differing} of {}",
        bytes[0].len()
    );
    if let Ok(folder) = std::env::var("RAYWARD_SHADING_PICTURES") {
        let rgb: Vec<u8> = bytes.concat();
        let path = Path::new(&folder).join(format!("{what}.png"));
        rayward::image_io::write_png(&path, cpu.width(), 2 * cpu.height(), &rgb).expect("a folder");
    }
    most
}

fn small() -> RenderOptions {
    RenderOptions {
        width: 96,
        height: 64,
        samples: 4,
        environment_samples: 4,
        bounces: 3,
        layers: Layers {
            depth: true,
            prim: true,
            ..Layers::default()
        },
        ..RenderOptions::default()
    }
}

#[test]
fn built_in_scenes_as_they_are_look_the_same() {
    let Some(device) = device() else { return };
    for name in [
        "courtyard",
        "forest",
        "office",
        "teapot-mirror",
        "walker",
        "collide",
        "solids",
    ] {
        let scene = builtin::build(name).expect("a built-in scene");
        let (films, surfaces) = both(&device, &scene, None, &small());
        check(name, &films);
        // Of solids it makes none.
        assert!(surfaces > 500 || name == "solids", "{name}: {surfaces}");
    }
}

#[test]
fn textures_mirrors_glass_veils_and_an_environment_look_the_same() {
    let Some(device) = device() else { return };
    for (name, veils, lit_by_sky) in [
        ("office", false, false),
        ("teapot-mirror", false, true),
        ("office", true, true),
        ("solids", true, false),
    ] {
        let scene = varied(name, veils);
        let sky = lit_by_sky.then(sky);
        let (films, _) = both(&device, &scene, sky, &small());
        check(&format!("{name} varied, veils {veils}, sky {lit_by_sky}"), &films);
    }
}

#[test]
fn samples_of_pixels_and_diffuse_light_look_the_same() {
    let Some(device) = device() else { return };
    let scene = varied("teapot-mirror", false);
    let options = RenderOptions {
        pixel_samples: 2,
        antialias: Antialias::Coverage,
        diffuse_bounces: 1,
        bounces: 2,
        ..small()
    };
    check("coverage, diffuse", &both(&device, &scene, None, &options).0);
}
