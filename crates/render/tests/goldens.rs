//! Pictures as they were when they were last looked at: mirror, glass, environment, what is seen through.
//!
//! They are equal to the last bit on every CPU. One that differs, or is missing, is written to the folder for temporary
//! files that the failure names. Where the change is meant, look at it and put it in place of the old one.

use std::path::{Path, PathBuf};

use glam::{Vec3, Vec4};
use rayward::image_io::write_png;
use rayward::scene::{AlphaMode, Material, Scene, builtin};
use rayward::{Environment, Picture, RenderOptions, Renderer, ToneMap, ToneMapper, read_picture};

/// The largest that a golden may be, in bytes.
const LARGEST: u64 = 64 << 10;

const WIDTH: u32 = 144;
const HEIGHT: u32 = 96;

fn check(name: &str, scene: &Scene, environment: Option<Environment>, options: RenderOptions) {
    let options = RenderOptions {
        width: WIDTH,
        height: HEIGHT,
        pixel_samples: 2,
        ambient: scene.ambient,
        ..options
    };
    let geometry = scene.at(0.0);
    let lights = if environment.is_some() {
        Vec::new()
    } else {
        geometry.lights.clone()
    };
    let mut renderer = Renderer::new(scene);
    renderer.set_environment(environment);
    let rendered = renderer.render(&geometry, &geometry.cameras[0], &lights, &options, &|_| ());
    let film = rendered.expect("valid input").film;
    let rgb = ToneMapper::new(ToneMap::None).encode(&film);
    compare(name, &rgb);
}

fn compare(name: &str, rgb: &[u8]) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/goldens")
        .join(name);
    let there = std::fs::metadata(&golden).is_ok_and(|file| file.len() <= LARGEST);
    let same = || {
        let picture = read_picture(&golden).expect("a picture");
        let bytes = |p: &Vec4| [p.x, p.y, p.z].map(|v| (v * 255.0).round() as u8);
        let pixels: Vec<u8> = picture.pixels.iter().flat_map(bytes).collect();
        (picture.width, picture.height) == (WIDTH, HEIGHT) && pixels == rgb
    };
    if there && same() {
        return;
    }
    let now = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    write_png(&now, WIDTH, HEIGHT, rgb).expect("a file");
    let what = if there {
        "is another"
    } else {
        "is missing or too large"
    };
    panic!("the picture {} {what}: now {}", golden.display(), now.display());
}

/// The teapot's scene with its three balls of these materials.
fn balls(materials: [Material; 3]) -> Scene {
    let mut scene = builtin::build("teapot-mirror").expect("it exists");
    let balls = scene.materials.iter_mut().filter(|m| m.name == "ball");
    for (ball, material) in balls.zip(materials) {
        *ball = Material {
            name: "ball".into(),
            ..material
        };
    }
    scene
}

fn glass() -> Material {
    Material {
        transmission: 1.0,
        roughness: 0.0,
        thickness: 1.0,
        ..Material::default()
    }
}

/// Bright towards the zenith and in one patch, dark below.
fn sky() -> Environment {
    let texel = |i: u32| {
        let (x, y) = (i % 64, i / 64);
        let patch = (14..18).contains(&x) && (7..10).contains(&y);
        let height = (31 - y) as f32 / 31.0;
        let color = Vec3::new(0.3 + 0.2 * height, 0.4 + 0.3 * height, 0.4 + 0.6 * height);
        Vec4::from((color * if patch { 30.0 } else { 0.6 }, 1.0))
    };
    let picture = Picture {
        width: 64,
        height: 32,
        pixels: (0..64 * 32).map(texel).collect(),
        srgb: false,
    };
    Environment::new(&picture, Path::new("sky")).expect("it is valid")
}

#[test]
fn mirrors() {
    let scene = builtin::build("teapot-mirror").expect("it exists");
    check("mirror.png", &scene, None, RenderOptions::default());
}

#[test]
fn glasses() {
    let amber = Material {
        attenuation_color: Vec3::new(0.9, 0.4, 0.1),
        attenuation_distance: 0.3,
        ..glass()
    };
    let frosted = Material {
        roughness: 0.4,
        thickness: 0.0,
        ..glass()
    };
    let scene = balls([glass(), amber, frosted]);
    check("glass.png", &scene, None, RenderOptions::default());
}

#[test]
fn environments() {
    let metal = |roughness: f32| Material {
        base_color: Vec4::new(0.9, 0.7, 0.4, 1.0),
        metallic: 1.0,
        roughness,
        ..Material::default()
    };
    let scene = balls([metal(0.0), metal(0.3), glass()]);
    let options = RenderOptions {
        environment_samples: 8,
        ..RenderOptions::default()
    };
    check("environment.png", &scene, Some(sky()), options);
}

#[test]
fn what_is_seen_through() {
    let veil = |red: f32, alpha: f32| Material {
        base_color: Vec4::new(red, 0.5, 1.0 - red, alpha),
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    };
    let scene = balls([veil(1.0, 0.3), veil(0.1, 0.6), veil(0.5, 0.1)]);
    let options = RenderOptions {
        tinted_shadows: true,
        ..RenderOptions::default()
    };
    check("veils.png", &scene, None, options);
}
