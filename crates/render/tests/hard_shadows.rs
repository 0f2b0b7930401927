//! Whole pictures with hard shadows against brute force: every pixel's colour and id, bit for bit.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rayward::scene::{FrameGeometry, LightKind, PosedCamera, PosedLight, Scene, builtin};
use rayward::shade::{ambient, direct, object_of};
use rayward::trace::{Accel, BruteForce, Light, Receiver, SimdLevel, Triangles, exact};
use rayward::{
    CameraFrame, CasterPolicy, Film, Layers, LightSteps, NO_ID, RenderOptions, Renderer, Shader,
    ShadingLight, ShadowStructure, SurfacePoint, shadow_end, triangles,
};

/// The closest triangle on a ray whose direction is f64, by testing all.
fn closest(triangles: &Triangles, origin: DVec3, dir: DVec3) -> Option<(u32, f64)> {
    (0..triangles.len() as u32)
        .filter_map(|prim| Some((prim, exact::hit(origin, dir, triangles.corners(prim))?.t)))
        .filter(|hit| hit.1 > 0.0)
        .reduce(|a, b| if b.1 < a.1 { b } else { a })
}

/// Colour and id of one pixel by brute force.
fn reference_pixel(
    scene: &Shader,
    geometry: &FrameGeometry,
    camera: &CameraFrame,
    lights: &[PosedLight],
    options: &RenderOptions,
    [x, y]: [u32; 2],
) -> (Vec3, u32) {
    let triangles = triangles(geometry);
    let ray = camera.view(geometry).pixel_ray(x, y);
    let Some((prim, t)) = closest(&triangles, ray.origin, ray.dir) else {
        return (options.background, NO_ID);
    };
    let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim)).expect("it was hit");
    let point = SurfacePoint {
        prim,
        object: object_of(geometry, prim),
        u: hit.u as f32,
        v: hit.v as f32,
        view: (-ray.dir.normalize()).as_vec3(),
        footprint: camera.footprint(t as f32),
    };
    let surface = scene.surface(geometry, &point);
    let receiver = Receiver::along(&ray, t, prim);
    let seen = exact::side(triangles.corners(prim), &Light::Point(camera.eye));
    let mut color = ambient(&surface, options.ambient);
    for light in lights {
        let Some(incident) = direct(&surface, &ShadingLight::new(light, geometry.origin)) else {
            continue;
        };
        let end = shadow_end(light, geometry.origin);
        let lit = exact::side(triangles.corners(prim), &end);
        let same_side = (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0);
        if same_side && !BruteForce::new(triangles).shadowed(&receiver, &end) {
            color += incident.radiance;
        }
    }
    (color, prim)
}

fn render(
    scene: &Scene,
    geometry: &FrameGeometry,
    camera: &PosedCamera,
    lights: &[PosedLight],
    options: &RenderOptions,
) -> Film {
    Renderer::new(scene)
        .render(geometry, camera, lights, options, &|_| ())
        .expect("valid input")
        .film
}

fn check(name: &str, time: f32, size: [u32; 2], alter: impl Fn(&mut FrameGeometry)) {
    let scene = builtin::build(name).expect("it exists");
    let mut geometry = scene.at(time);
    alter(&mut geometry);
    let camera = geometry.cameras[0].clone();
    let options = RenderOptions {
        width: size[0],
        height: size[1],
        bounces: 0,
        layers: Layers {
            prim: true,
            ..Layers::default()
        },
        ..RenderOptions::default()
    };
    let frame = CameraFrame::new(&camera, geometry.origin, size[0], size[1]).expect("valid camera");
    let shader = Shader::new(&scene);
    let expected: Vec<(Vec3, u32)> = (0..size[0] * size[1])
        .into_par_iter()
        .map(|i| {
            reference_pixel(
                &shader,
                &geometry,
                &frame,
                &geometry.lights,
                &options,
                [i % size[0], i / size[0]],
            )
        })
        .collect();
    for level in SimdLevel::available() {
        for casters in [CasterPolicy::Auto, CasterPolicy::Both] {
            let options = RenderOptions {
                level,
                casters,
                ..options
            };
            let film = render(&scene, &geometry, &camera, &geometry.lights, &options);
            for (i, (color, prim)) in expected.iter().enumerate() {
                let place = [i as u32 % size[0], i as u32 / size[0]];
                assert_eq!(
                    film.prim[i],
                    *prim,
                    "{name}, {}, {casters:?}, pixel {place:?}",
                    level.name()
                );
                assert_eq!(
                    film.color[i],
                    *color,
                    "{name}, {}, {casters:?}, pixel {place:?}",
                    level.name()
                );
            }
            assert!(
                film.prim.iter().any(|p| *p != NO_ID),
                "{name}: an empty picture proves nothing"
            );
        }
    }
}

#[test]
fn structures_give_the_same_pictures() {
    for (name, size) in [
        ("blob-4k", [160, 120]),
        ("office", [160, 100]),
        ("courtyard", [160, 100]),
        ("forest", [120, 80]),
    ] {
        let scene = builtin::build(name).expect("it exists");
        let mut geometry = scene.at(0.5);
        scatter_lights(&mut geometry, 3);
        let with = |shadow_structure| {
            let options = RenderOptions {
                width: size[0],
                height: size[1],
                layers: Layers::ALL,
                shadow_structure,
                ..RenderOptions::default()
            };
            let mut renderer = Renderer::new(&scene);
            let camera = &geometry.cameras[0];
            let frame = renderer.render(&geometry, camera, &geometry.lights, &options, &|_| ());
            frame.expect("valid input")
        };
        let auto = with(ShadowStructure::Auto);
        assert!(
            auto.stats.lights.iter().all(|light| light.costs.is_some()),
            "{name}"
        );
        for (structure, used) in [
            (ShadowStructure::Receivers, "receivers"),
            (ShadowStructure::Grid, "grid"),
            (ShadowStructure::Tree, "tree"),
        ] {
            let frame = with(structure);
            assert!(frame.film == auto.film, "{name}, {structure:?}");
            let lights = &frame.stats.lights;
            let alike = lights.iter().all(|l| l.structure == used && l.costs.is_none());
            assert!(alike, "{name}, {lights:?}");
            // A light inside of a blob is asked by nobody.
            let passed = |s: LightSteps| s.rays > 0 && s.measured.nodes > 0.5;
            let passed = lights.iter().any(|light| light.steps.is_some_and(passed));
            assert_eq!(passed, used == "tree", "{name}, {lights:?}");
        }
    }
}

#[test]
fn shading_on_every_pass_is_the_same_picture() {
    let scene = builtin::build("courtyard").expect("it exists");
    let geometry = scene.at(0.5);
    let camera = &geometry.cameras[0];
    for shadows in [true, false] {
        let with = |paper| {
            let options = RenderOptions {
                width: 240,
                height: 150,
                layers: Layers::ALL,
                casters: CasterPolicy::Back,
                shadows,
                paper,
                ..RenderOptions::default()
            };
            let frame = Renderer::new(&scene).render(&geometry, camera, &geometry.lights, &options, &|_| ());
            frame.expect("valid input")
        };
        let (paper, once) = (with(true), with(false));
        assert!(paper.film == once.film, "shadows {shadows}");
        let passes = [paper, once].map(|frame| frame.stats.surfaces);
        assert!(passes[0] > passes[1] * 11 / 10 && passes[1] > 0, "{passes:?}");
    }
}

#[test]
fn closed_models() {
    check("blob-1k", 0.0, [80, 60], |_| ());
    check("blob-4k", 0.0, [64, 48], |_| ());
}

#[test]
fn rooms_and_figures() {
    check("office", 0.0, [96, 64], |_| ());
    check("walker", 0.3, [64, 64], |_| ());
    check("teapot-mirror", 0.0, [48, 32], |_| ());
}

#[test]
fn many_parts() {
    check("courtyard", 1.0, [48, 32], |_| ());
}

#[test]
fn an_eye_inside_of_a_closed_model() {
    // From within, the surface is a room: back faces alone would not do.
    for light_inside in [true, false] {
        check("blob-1k", 0.0, [48, 32], |geometry| {
            let (low, high) = geometry.bounds().expect("triangles");
            let at = |share: f32| geometry.origin + low.lerp(high, share).as_dvec3();
            let (eye, light) = (at(0.45), at(0.5));
            geometry.cameras[0].eye = eye;
            if light_inside {
                geometry.lights[0].kind = LightKind::Point { radius: 0.0 };
                geometry.lights[0].position = light;
                geometry.lights[0].power = Vec3::splat(1.0);
            }
            geometry.lights.truncate(1);
        });
    }
}

/// Point lights all over the geometry.
fn scatter_lights(geometry: &mut FrameGeometry, count: usize) {
    let (low, high) = geometry.bounds().expect("triangles");
    let mut light = geometry.lights[0].clone();
    light.kind = LightKind::Point { radius: 0.0 };
    light.power = Vec3::splat(2.0);
    geometry.lights = (0..count)
        .map(|i| {
            let share = |step: f64| (i as f64 * step).fract() as f32;
            let place = Vec3::new(share(0.618), 0.2 + 0.75 * share(0.755), share(0.570));
            let position = geometry.origin + (low + (high - low) * place).as_dvec3();
            PosedLight {
                position,
                ..light.clone()
            }
        })
        .collect();
}

#[test]
fn sixty_four_lights() {
    check("office", 0.0, [32, 20], |geometry| scatter_lights(geometry, 64));
}

#[test]
fn memory_does_not_grow_with_lights() {
    let scene = builtin::build("courtyard").expect("it exists");
    let mut geometry = scene.at(1.0);
    scatter_lights(&mut geometry, 64);
    let options = RenderOptions {
        width: 480,
        height: 300,
        ..RenderOptions::default()
    };
    let camera = geometry.cameras[0].clone();
    let lights = std::mem::take(&mut geometry.lights);
    let frame = Renderer::new(&scene)
        .render(&geometry, &camera, &lights, &options, &|_| ())
        .expect("valid input");
    let grids = frame.stats.structures.iter();
    let bytes: Vec<usize> = grids
        .filter(|s| s.name.starts_with("receiver grid"))
        .map(|s| s.bytes)
        .collect();
    assert_eq!(bytes.len(), 64);
    // While a light is done: 25 bytes a pixel at most, 20 a vertex and its clusters, and 52 a triangle that is referred to
    // once, of which there are fewer than half.
    let most = 480 * 300 * 25 + geometry.x.len() * 20 + geometry.triangle_count() * 26 + (1 << 20);
    assert!(bytes.iter().all(|&b| b > 0 && b <= most), "{bytes:?}, {most}");
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let scene = builtin::build("courtyard").expect("it exists");
    let geometry = scene.at(0.5);
    let options = RenderOptions {
        width: 320,
        height: 200,
        layers: Layers::ALL,
        ..RenderOptions::default()
    };
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            render(
                &scene,
                &geometry,
                &geometry.cameras[0],
                &geometry.lights,
                &options,
            )
        })
    };
    assert!(on(1) == on(2));
}

#[test]
fn a_hundred_kilometres_away_is_the_same_picture() {
    let near = builtin::build("walker").expect("it exists");
    let mut far = near.clone();
    // A whole number of the origin's steps, so that positions stay the same to the bit.
    let offset = DVec3::new(102_400.0, 0.0, -102_400.0);
    for node in far.nodes.iter_mut().filter(|n| n.parent.is_none()) {
        let moved = glam::DMat4::from_translation(offset) * node.transform.matrix();
        node.transform = rayward::scene::Transform::Matrix(moved);
    }
    let options = RenderOptions {
        width: 160,
        height: 120,
        layers: Layers {
            prim: true,
            ..Layers::default()
        },
        ..RenderOptions::default()
    };
    let [near, far] = [&near, &far].map(|scene| {
        let geometry = scene.at(0.0);
        render(scene, &geometry, &geometry.cameras[0], &geometry.lights, &options)
    });
    let pixels = near.color.len();
    let others = (0..pixels).filter(|&i| near.prim[i] != far.prim[i]).count();
    assert!(
        others * 1000 <= pixels,
        "{others} of {pixels} pixels see another triangle"
    );
    let differing = (0..pixels)
        .filter(|&i| near.prim[i] == far.prim[i])
        .filter(|&i| (near.color[i] - far.color[i]).abs().max_element() > 1e-3)
        .count();
    assert!(
        differing * 1000 <= pixels,
        "{differing} of {pixels} pixels have another colour"
    );
}
