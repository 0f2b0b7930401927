//! Frames with reflections, refractions and an environment: against brute force bit for bit, and against closed
//! forms.

use std::path::Path;

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{Coat, FrameGeometry, LightKind, Material, PosedCamera, PosedLight, Scene, builtin};
use rayward::trace::SimdLevel;
use rayward::{Environment, Film, Picture, RenderOptions, Renderer, Shader};

/// A sky of one radiance, or one that is bright in a corner.
fn sky(texel: impl Fn(u32, u32) -> Vec3) -> Environment {
    let pixels = (0..64 * 32)
        .map(|i| Vec4::from((texel(i % 64, i / 64), 1.0)))
        .collect();
    let picture = Picture {
        width: 64,
        height: 32,
        pixels,
        srgb: false,
    };
    Environment::new(&picture, Path::new("sky")).expect("it is valid")
}

fn bright_corner(x: u32, y: u32) -> Vec3 {
    Vec3::new(0.4, 0.5, 0.7)
        * if (20..24).contains(&x) && (6..9).contains(&y) {
            40.0
        } else {
            1.0
        }
}

fn render(scene: &Scene, environment: Option<Environment>, options: &RenderOptions, lights: bool) -> Film {
    let geometry = without_teapot(scene, scene.at(0.0));
    let mut renderer = Renderer::new(scene);
    renderer.set_environment(environment);
    let lights = if lights { all_kinds(&geometry) } else { Vec::new() };
    renderer
        .render(&geometry, &geometry.cameras[0], &lights, options, &|_| ())
        .expect("valid input")
        .film
}

/// The triangles of all but the teapot, which has most of them.
fn without_teapot(scene: &Scene, geometry: FrameGeometry) -> FrameGeometry {
    let (mut indices, mut objects) = (Vec::new(), Vec::new());
    for object in &geometry.objects {
        if scene.materials[object.material as usize].name == "glaze" {
            continue;
        }
        let first = indices.len() as u32;
        let range = object.triangles.start as usize..object.triangles.end as usize;
        indices.extend_from_slice(&geometry.indices[range]);
        let mut object = object.clone();
        object.triangles = first..indices.len() as u32;
        objects.push(object);
    }
    FrameGeometry {
        indices,
        objects,
        ..geometry
    }
}

/// The scene's lights, and one with a size.
fn all_kinds(geometry: &FrameGeometry) -> Vec<PosedLight> {
    let mut lights = geometry.lights.clone();
    let ball = PosedLight {
        position: lights[0].position + DVec3::new(-1.0, 0.5, 0.0),
        kind: LightKind::Point { radius: 0.4 },
        ..lights[0].clone()
    };
    lights.push(ball);
    lights
}

const SMALL: [u32; 2] = [32, 24];

fn options() -> RenderOptions {
    RenderOptions {
        width: SMALL[0],
        height: SMALL[1],
        environment_samples: 2,
        samples: 3,
        pixel_samples: 2,
        ..RenderOptions::default()
    }
}

/// The teapot's scene with some of its balls of glass, frosted, or see-through.
fn glassy() -> Scene {
    let mut scene = builtin::build("teapot-mirror").expect("it exists");
    let glass = Material {
        transmission: 1.0,
        roughness: 0.0,
        thickness: 1.0,
        attenuation_color: Vec3::new(0.9, 0.4, 0.2),
        attenuation_distance: 0.4,
        ..Material::default()
    };
    let mut balls = scene.materials.iter_mut().filter(|m| m.name == "ball");
    *balls.next().expect("three balls") = glass.clone();
    *balls.next().expect("three balls") = Material {
        roughness: 0.4,
        thickness: 0.0,
        ..glass
    };
    let last = balls.next().expect("three balls");
    last.alpha_mode = rayward::scene::AlphaMode::Blend;
    last.base_color.w = 0.5;
    scene
}

#[test]
fn every_structure_shows_the_picture_of_brute_force() {
    let scene = glassy();
    for (environment, diffuse_bounces) in [(None, 0), (Some(sky(bright_corner)), 1)] {
        let options = RenderOptions {
            diffuse_bounces,
            ..options()
        };
        let reference = RenderOptions {
            reference: true,
            ..options
        };
        let expected = render(&scene, environment.clone(), &reference, true);
        for level in SimdLevel::available() {
            let film = render(
                &scene,
                environment.clone(),
                &RenderOptions { level, ..options },
                true,
            );
            assert!(film.color == expected.color, "with {}", level.name());
        }
    }
}

#[test]
fn the_picture_does_not_depend_on_threads() {
    let scene = glassy();
    let of = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| render(&scene, Some(sky(bright_corner)), &options(), true))
    };
    assert!(of(1) == of(3));
}

/// Makes everything of one material.
fn all_of(material: Material) -> Scene {
    let mut scene = builtin::build("blob-1k").expect("it exists");
    scene.materials.fill(material);
    scene
}

/// Largest difference of any colour from 1.
fn off_by(film: &Film) -> f32 {
    film.color
        .iter()
        .map(|&c| (c - Vec3::ONE).abs().max_element())
        .fold(0.0, f32::max)
}

#[test]
fn mirrors_and_clear_glass_vanish_in_an_even_sky() {
    let mirror = Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    };
    let glass = Material {
        transmission: 1.0,
        roughness: 0.0,
        thickness: 1.0,
        ..Material::default()
    };
    let pane = Material {
        thickness: 0.0,
        ..glass.clone()
    };
    for material in [mirror, glass, pane] {
        let scene = all_of(material);
        let options = RenderOptions {
            bounces: 64,
            ..options()
        };
        let film = render(&scene, Some(sky(|_, _| Vec3::ONE)), &options, false);
        // What is left out: rays of less than a 4096th of a pixel.
        assert!(off_by(&film) < 0.02, "{}", off_by(&film));
    }
}

#[test]
fn a_coat_on_black_is_the_mirror_of_a_black_dielectric() {
    let black = Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
        ..Material::default()
    };
    let mirror = Material {
        roughness: 0.0,
        ..black.clone()
    };
    let coated = Material {
        specular: 0.0,
        coat: Coat {
            factor: 1.0,
            ..Coat::default()
        },
        ..black
    };
    for bounces in [0, 3] {
        let options = RenderOptions { bounces, ..options() };
        let show = |material: &Material| {
            let sky = Some(sky(bright_corner));
            render(&all_of(material.clone()), sky, &options, false)
        };
        let (mirror, coat) = (show(&mirror), show(&coated));
        let off = mirror.color.iter().zip(&coat.color).map(|(a, b)| (*a - *b).abs());
        let off = off.fold(0.0, |most: f32, off| most.max(off.max_element()));
        assert!(off < 1e-4, "{off} after {bounces}");
        let lit = mirror.color.iter().filter(|color| color.max_element() > 0.1);
        assert!(lit.count() > 20, "there is something to see");
    }
}

#[test]
fn light_goes_straight_through_thin_walls_in_their_colour() {
    let passed = |material: Material| {
        let scene = all_of(material);
        let geometry = scene.at(0.0);
        Shader::new(&scene).transmittance(&geometry, 0, 0, [0.3, 0.3], false)
    };
    let pane = Material {
        transmission: 0.5,
        base_color: Vec4::new(1.0, 0.5, 0.25, 1.0),
        ..Material::default()
    };
    let expected = Vec3::new(1.0, 0.5, 0.25) * 0.5 * 0.96;
    assert!((passed(pane.clone()) - expected).abs().max_element() < 1e-6);
    let volume = Material {
        thickness: 1.0,
        ..pane.clone()
    };
    assert_eq!(passed(volume), Vec3::ZERO, "volumes bend light");
    let metal = Material {
        metallic: 1.0,
        ..pane
    };
    assert_eq!(passed(metal), Vec3::ZERO);
}

#[test]
fn a_white_matt_body_shows_its_share_of_an_even_sky() {
    let white = Material {
        specular: 0.0,
        ..Material::default()
    };
    let scene = all_of(white);
    let options = RenderOptions {
        environment_samples: 256,
        diffuse_bounces: 8,
        pixel_samples: 4,
        ..options()
    };
    // All light that a white body takes up leaves it again: it vanishes, too, up to noise.
    let film = render(&scene, Some(sky(|_, _| Vec3::ONE)), &options, false);
    let mean = film.color.iter().map(|c| f64::from(c.y)).sum::<f64>() / film.color.len() as f64;
    assert!((mean - 1.0).abs() < 0.01, "{mean}");
}

#[test]
fn more_samples_of_a_pixel_keep_the_layers_of_its_centre() {
    let scene = builtin::build("blob-1k").expect("it exists");
    let layers = rayward::Layers::ALL;
    let one = render(
        &scene,
        None,
        &RenderOptions {
            layers,
            pixel_samples: 1,
            ..options()
        },
        true,
    );
    let many = render(
        &scene,
        None,
        &RenderOptions {
            layers,
            pixel_samples: 16,
            ..options()
        },
        true,
    );
    assert!(one.depth == many.depth && one.prim == many.prim && one.normal == many.normal);
    let edges = many
        .alpha
        .iter()
        .filter(|&&alpha| alpha > 0.0 && alpha < 1.0)
        .count();
    assert!(edges > 20, "{edges} pixels are covered in part");
    assert!(one.color != many.color);
}

#[test]
fn a_plain_background_hides_the_environment_but_not_from_mirrors() {
    let mirror = Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    };
    let scene = all_of(mirror);
    let options = RenderOptions {
        background: Vec3::ZERO,
        show_environment: false,
        pixel_samples: 1,
        bounces: 64,
        layers: rayward::Layers {
            alpha: true,
            ..rayward::Layers::default()
        },
        ..options()
    };
    let film = render(&scene, Some(sky(|_, _| Vec3::ONE)), &options, false);
    for (color, alpha) in film.color.iter().zip(&film.alpha) {
        assert!((color.y - alpha).abs() < 0.02, "{color} where {alpha} is covered");
    }
    assert!(film.alpha.contains(&1.0) && film.alpha.contains(&0.0));
}

/// Distance along the middle of the picture through a pane.
#[test]
fn a_volume_absorbs_by_the_way_through_it() {
    let left = Vec3::new(0.5, 0.25, 1.0);
    let volume = Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.0,
        thickness: 1.0,
        attenuation_color: left,
        attenuation_distance: 2.0,
        ..Material::default()
    };
    let scene = all_of(volume);
    let mut geometry = scene.at(0.0);
    // A box around everything seen, of which the eye looks through exactly 3 metres.
    let (low, high) = (Vec3::new(-50.0, -50.0, -8.0), Vec3::new(50.0, 50.0, -5.0));
    let corner = |i: u32| {
        Vec3::new(
            [low.x, high.x][(i & 1) as usize],
            [low.y, high.y][(i >> 1 & 1) as usize],
            [low.z, high.z][(i >> 2) as usize],
        )
    };
    geometry.x = (0..8).map(|i| corner(i).x).collect();
    geometry.y = (0..8).map(|i| corner(i).y).collect();
    geometry.z = (0..8).map(|i| corner(i).z).collect();
    geometry.attributes = Default::default();
    geometry.origin = DVec3::ZERO;
    // The sides seen, both turned outwards: z = high first, then z = low.
    geometry.indices = vec![[4, 5, 7], [4, 7, 6], [0, 3, 1], [0, 2, 3]];
    geometry.objects.truncate(1);
    geometry.objects[0].triangles = 0..4;
    geometry.objects[0].vertices = 0..8;
    let camera = PosedCamera {
        eye: DVec3::ZERO,
        forward: DVec3::NEG_Z,
        up: DVec3::Y,
        ..geometry.cameras[0].clone()
    };
    let options = RenderOptions {
        width: 3,
        height: 3,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene);
    renderer.set_environment(Some(sky(|_, _| Vec3::ONE)));
    let film = renderer
        .render(&geometry, &camera, &[], &options, &|_| ())
        .expect("valid")
        .film;
    let expected = Vec3::new(left.x.powf(1.5), left.y.powf(1.5), 1.0);
    assert!(
        (film.color[4] - expected).abs().max_element() < 1e-4,
        "{} {expected}",
        film.color[4]
    );
}

/// A wall under a sky, of which a clear pane covers the right half.
#[test]
fn what_is_behind_clear_glass_is_no_noisier() {
    let mut scene = builtin::build("teapot-mirror").expect("it exists");
    let pane = Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.0,
        ..Material::default()
    };
    let wall = Material {
        roughness: 1.0,
        ..Material::default()
    };
    scene.materials[1..3].clone_from_slice(&[wall, pane]);
    let mut geometry = scene.at(0.0);
    let square = |left: f32, z: f32| {
        [
            [left, -90.0, z],
            [90.0, -90.0, z],
            [90.0, 90.0, z],
            [left, 90.0, z],
        ]
    };
    let corners = [square(-90.0, -10.0), square(0.0, -5.0)].concat();
    [geometry.x, geometry.y, geometry.z] =
        [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).collect());
    geometry.attributes = Default::default();
    geometry.origin = DVec3::ZERO;
    geometry.indices = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
    geometry.objects.truncate(2);
    for (object, first) in geometry.objects.iter_mut().zip([0, 1]) {
        object.triangles = first * 2..first * 2 + 2;
        object.vertices = first * 4..first * 4 + 4;
        object.material = first + 1;
    }
    let camera = PosedCamera {
        eye: DVec3::ZERO,
        forward: DVec3::NEG_Z,
        up: DVec3::Y,
        ..geometry.cameras[0].clone()
    };
    let options = RenderOptions {
        width: 32,
        height: 32,
        environment_samples: 16,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene);
    renderer.set_environment(Some(sky(bright_corner)));
    let rendered = renderer.render(&geometry, &camera, &[], &options, &|_| ());
    let film = rendered.expect("valid").film;
    let [direct, behind] = [0, 16].map(|first| {
        let side = |pixel: &usize| pixel % 32 / 16 == first / 16;
        let seen: Vec<f32> = (0..32 * 32)
            .filter(side)
            .map(|pixel| film.color[pixel].y)
            .collect();
        let mean = seen.iter().sum::<f32>() / seen.len() as f32;
        let variance = seen.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / seen.len() as f32;
        (mean, variance)
    });
    assert!((direct.0 / behind.0 - 1.0).abs() < 0.03, "{direct:?} {behind:?}");
    assert!(
        direct.1 > 0.0 && behind.1 < 2.0 * direct.1,
        "{direct:?} {behind:?}"
    );
}
