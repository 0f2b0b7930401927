//! Frames of distributed rays: antialiasing, depth of field, motion blur.

use glam::{DQuat, DVec3, Vec3};
use rayward::scene::{
    FrameGeometry, Light, LightKind, Material, Mesh, Node, PosedCamera, Primitive, Projection, Scene,
    Transform, builtin,
};
use rayward::{Layers, Lens, RenderOptions, RenderedFrame, Renderer, Shutter};

/// A square of side 2 at each place, facing +z, and a light behind the camera.
fn squares(places: &[DVec3]) -> Scene {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let square = Primitive {
        positions: vec![corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Primitive::default()
    };
    let mut scene = Scene {
        materials: vec![Material::default()],
        samplers: vec![Default::default()],
        meshes: vec![Mesh {
            primitives: vec![square],
            ..Mesh::default()
        }],
        lights: vec![Light {
            name: "lamp".into(),
            color: Vec3::ONE,
            intensity: 300.0,
            range: f32::INFINITY,
            kind: LightKind::Point { radius: 0.0 },
        }],
        ..Scene::default()
    };
    let at = |translation: DVec3| Transform::Trs {
        translation,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
    };
    scene.nodes.extend(places.iter().map(|&place| Node {
        transform: at(place),
        mesh: Some(0),
        ..Node::default()
    }));
    scene.nodes.push(Node {
        transform: at(DVec3::new(0.0, 1.0, 12.0)),
        light: Some(0),
        ..Node::default()
    });
    scene
}

/// At z = 10, looking along -z at the squares around the origin.
fn camera() -> PosedCamera {
    PosedCamera {
        name: "test".into(),
        eye: DVec3::new(0.0, 0.0, 10.0),
        forward: DVec3::NEG_Z,
        up: DVec3::Y,
        projection: Projection::Perspective {
            vfov: 0.6,
            aspect: None,
        },
    }
}

fn options(pixel_samples: u32) -> RenderOptions {
    RenderOptions {
        width: 48,
        height: 36,
        pixel_samples,
        layers: Layers::ALL,
        background: Vec3::ZERO,
        ..RenderOptions::default()
    }
}

fn render(scene: &Scene, frame: &FrameGeometry, options: &RenderOptions) -> RenderedFrame {
    Renderer::new(scene)
        .render(frame, &camera(), &frame.lights, options, &|_| {})
        .expect("it renders")
}

fn open(scene: &Scene, frames: [&FrameGeometry; 2], options: &RenderOptions) -> RenderedFrame {
    let [frame, close] = frames;
    let shutter = Shutter {
        geometry: close,
        camera: &camera(),
    };
    Renderer::new(scene)
        .render_shutter(frame, &camera(), shutter, &frame.lights, options, &|_| {})
        .expect("it renders")
}

/// Share of the pixels that are partly covered.
fn soft_share(rendered: &RenderedFrame) -> f64 {
    let alpha = &rendered.film.alpha;
    alpha.iter().filter(|a| **a > 0.02 && **a < 0.98).count() as f64 / alpha.len() as f64
}

#[test]
fn what_is_in_focus_is_sharp_and_the_rest_is_not() {
    let scene = squares(&[DVec3::ZERO]);
    let frame = scene.at(0.0);
    let with = |focus: f64| RenderOptions {
        lens: Some(Lens { radius: 0.4, focus }),
        ..options(64)
    };
    let sharp = soft_share(&render(&scene, &frame, &options(64)));
    let focused = soft_share(&render(&scene, &frame, &with(10.0)));
    let blurred = soft_share(&render(&scene, &frame, &with(5.0)));
    assert!(sharp > 0.0 && focused < sharp * 1.3, "{sharp} {focused}");
    assert!(blurred > focused * 2.5, "{focused} {blurred}");
    // Light is spread, not lost.
    let sum = |focus| -> f32 { render(&scene, &frame, &with(focus)).film.alpha.iter().sum() };
    assert!((sum(10.0) / sum(5.0) - 1.0).abs() < 0.02);
}

#[test]
fn a_moving_square_covers_pixels_for_its_share_of_the_time() {
    let there = |x: f64| squares(&[DVec3::new(x, 0.0, 0.0)]);
    let (scene, close) = (there(-1.0), there(1.0));
    let (frame, frame_close) = (scene.at(0.0), close.at(0.0));
    let rendered = open(&scene, [&frame, &frame_close], &options(256));
    // Row 18 is the middle: at z = 0 a pixel is 2 * 10 * tan(0.3) / 36 wide.
    let width = 20.0 * 0.3f64.tan() / 36.0;
    for x in 0..48 {
        let from = (f64::from(x) - 24.0) * width;
        // The square is over x from time (x - 0) / 2 to (x + 2) / 2, as it goes from [-2, 0] to [0, 2].
        let covered = |x: f64| ((x + 2.0) / 2.0).clamp(0.0, 1.0) - (x / 2.0).clamp(0.0, 1.0);
        let expected = (0..100)
            .map(|i| covered(from + width * (f64::from(i) + 0.5) / 100.0))
            .sum::<f64>()
            / 100.0;
        let found = f64::from(rendered.film.alpha[18 * 48 + x as usize]);
        assert!(
            (found - expected).abs() < 0.05,
            "pixel {x}: {found}, should be {expected}"
        );
    }
}

#[test]
fn a_shutter_over_a_still_scene_changes_nothing() {
    let scene = builtin::build("walker").expect("it is built in");
    let frame = scene.at(0.3);
    let again = scene.at(0.3);
    let sharp = RenderOptions {
        lens: Some(Lens {
            radius: 0.0,
            focus: 9.0,
        }),
        ..options(4)
    };
    let still = render(&scene, &frame, &sharp);
    let opened = open(&scene, [&frame, &again], &sharp);
    assert_eq!(still.film.color, opened.film.color);
    // Layers are those of the middle of the pixel, as without samples.
    let plain = render(&scene, &frame, &options(1));
    let same = plain
        .film
        .prim
        .iter()
        .zip(&still.film.prim)
        .filter(|(a, b)| a == b);
    assert!(same.count() * 1000 >= plain.film.prim.len() * 998);
}

#[test]
fn shadows_move_with_what_casts_them() {
    // A caster between the light and a wall, away from the wall; it moves up out of the light's way.
    let wall = DVec3::new(0.0, 0.0, -3.0);
    let scene_at = |y: f64| squares(&[wall, wall + DVec3::new(0.0, y, 8.0)]);
    let (scene, gone) = (scene_at(1.3), scene_at(3.3));
    let (frame, frame_gone) = (scene.at(0.0), gone.at(0.0));
    let light = |film: &rayward::Film| film.color[18 * 48 + 24].x;
    let still = open(&scene, [&frame, &frame], &options(64));
    let moved = open(&scene, [&frame, &frame_gone], &options(64));
    let clear = open(&gone, [&frame_gone, &frame_gone], &options(64));
    let (dark, between, bright) = (light(&still.film), light(&moved.film), light(&clear.film));
    assert!(dark < between && between < bright, "{dark} {between} {bright}");
    assert!(
        between > 0.8 * bright,
        "the caster is gone most of the time: {between} of {bright}"
    );
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let scene = builtin::build("walker").expect("it is built in");
    let (frame, close) = (scene.at(0.3), scene.at(0.36));
    let options = RenderOptions {
        lens: Some(Lens {
            radius: 0.05,
            focus: 9.0,
        }),
        ..options(2)
    };
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let rendered = pool.install(|| open(&scene, [&frame, &close], &options));
        (
            rendered.film.color,
            rendered.film.prim,
            rendered.stats.shadow_rays,
        )
    };
    assert!(with(1) == with(3));
}

#[test]
fn a_lens_without_focus_is_an_error() {
    let scene = squares(&[DVec3::ZERO]);
    let frame = scene.at(0.0);
    for (radius, focus) in [
        (0.1, 0.0),
        (0.1, -3.0),
        (-1.0, 3.0),
        (f64::NAN, 3.0),
        (0.1, f64::INFINITY),
    ] {
        let options = RenderOptions {
            lens: Some(Lens { radius, focus }),
            ..options(2)
        };
        let result = Renderer::new(&scene).render(&frame, &camera(), &frame.lights, &options, &|_| {});
        assert!(
            matches!(result, Err(rayward::Error::Camera { .. })),
            "{radius} {focus}"
        );
    }
}
