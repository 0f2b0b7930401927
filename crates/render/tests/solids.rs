//! Frames of solids that are not made of triangles: pictures against references bit for bit, shadows and normals against
//! formulas.

use glam::{DQuat, DVec3, Vec3, Vec4};
use rayward::scene::{
    AlphaMode, FrameGeometry, LightKind, Material, Mesh, Node, PosedCamera, PosedLight, Primitive,
    Projection, Scene, Shape, Solid, Transform, builtin, square_light_at,
};
use rayward::{Film, Layers, Lens, NO_ID, RenderOptions, RenderedFrame, Renderer, Shutter};

fn options() -> RenderOptions {
    RenderOptions {
        width: 40,
        height: 30,
        samples: 2,
        layers: Layers::ALL,
        ..RenderOptions::default()
    }
}

fn render(
    scene: &Scene,
    frame: &FrameGeometry,
    lights: &[PosedLight],
    options: &RenderOptions,
) -> RenderedFrame {
    Renderer::new(scene)
        .render(frame, &frame.cameras[0], lights, options, &|_| {})
        .expect("valid input")
}

/// The scene's lights, one with a size, and the sun.
fn lights(frame: &FrameGeometry) -> Vec<PosedLight> {
    let mut lights = frame.lights.clone();
    lights.push(square_light_at(&frame.lights[0], frame));
    lights.push(PosedLight {
        direction: DVec3::new(-0.5, -1.0, -0.4).normalize(),
        power: Vec3::splat(0.7),
        kind: LightKind::Directional { half_angle: 0.0 },
        ..frame.lights[0].clone()
    });
    lights
}

fn assert_same(found: &Film, wanted: &Film, what: &str) {
    let bits = |v: &Vec3| v.to_array().map(f32::to_bits);
    let apart = |i: &usize| bits(&found.color[*i]) != bits(&wanted.color[*i]);
    let first = (0..found.color.len()).find(apart);
    assert!(
        first.is_none(),
        "{what}: pixel {first:?} is {:?}, should be {:?}",
        first.map(|i| found.color[i]),
        first.map(|i| wanted.color[i])
    );
    assert!(
        found.prim == wanted.prim && found.object == wanted.object,
        "{what}: ids"
    );
    assert!(
        found.normal == wanted.normal && found.depth == wanted.depth,
        "{what}"
    );
    assert!(found.alpha == wanted.alpha, "{what}: alpha");
}

/// The scene `solids` without its ball of triangles, which are many.
fn few_triangles() -> Scene {
    let mut scene = builtin::build("solids").expect("it exists");
    for node in scene
        .nodes
        .iter_mut()
        .filter(|node| node.name.starts_with("ball of"))
    {
        node.mesh = None;
    }
    scene
}

#[test]
fn every_structure_shows_the_picture_of_every_solid_and_triangle_tested() {
    let scene = few_triangles();
    let frame = scene.at(0.7);
    let lights = lights(&frame);
    let few = FrameGeometry {
        lights: lights.clone(),
        ..frame.clone()
    };
    for (what, options) in [
        ("reflections", options()),
        (
            "the paper",
            RenderOptions {
                paper: true,
                bounces: 0,
                ..options()
            },
        ),
        (
            "samples of pixels",
            RenderOptions {
                pixel_samples: 2,
                bounces: 1,
                diffuse_bounces: 1,
                width: 20,
                height: 15,
                ..options()
            },
        ),
    ] {
        let found = render(&scene, &few, &lights, &options);
        let reference = RenderOptions {
            reference: true,
            ..options
        };
        let wanted = render(&scene, &few, &lights, &reference);
        assert_same(&found.film, &wanted.film, what);
        let solids = frame.triangle_count() as u32..frame.triangle_count() as u32 + frame.solids.len() as u32;
        let on_solids = found.film.prim.iter().filter(|prim| solids.contains(prim));
        assert!(
            on_solids.count() * 8 > found.film.prim.len(),
            "{what}: solids are seen"
        );
    }
}

#[test]
fn so_do_frames_with_a_lens_and_a_shutter() {
    let scene = few_triangles();
    let (frame, close) = (scene.at(0.7), scene.at(0.9));
    let with = |reference: bool| {
        let options = RenderOptions {
            lens: Some(Lens {
                radius: 0.05,
                focus: 6.0,
            }),
            pixel_samples: 2,
            reference,
            ..options()
        };
        let shutter = Shutter {
            geometry: &close,
            camera: &frame.cameras[0],
        };
        Renderer::new(&scene)
            .render_shutter(
                &frame,
                &frame.cameras[0],
                shutter,
                &lights(&frame),
                &options,
                &|_| {},
            )
            .expect("valid input")
            .film
    };
    let (found, wanted) = (with(false), with(true));
    assert_same(&found, &wanted, "lens and shutter");
    let first = frame.triangle_count() as u32;
    assert!(found.prim.iter().any(|prim| *prim >= first && *prim != NO_ID));
}

/// A floor of one square at y = 0 and a sphere above it, seen from above at an angle.
fn sphere_over_floor(material: Material) -> Scene {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let floor = Primitive {
        positions: vec![corner(-4., -4.), corner(-4., 4.), corner(4., 4.), corner(4., -4.)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Primitive::default()
    };
    Scene {
        materials: vec![Material::default(), material],
        samplers: vec![Default::default()],
        meshes: vec![Mesh {
            primitives: vec![floor],
            ..Mesh::default()
        }],
        solids: vec![Solid {
            shape: Shape::Sphere {
                center: DVec3::ZERO,
                radius: 0.5,
            },
            material: 1,
        }],
        nodes: vec![
            Node {
                mesh: Some(0),
                ..Node::default()
            },
            Node {
                solid: Some(0),
                transform: Transform::Trs {
                    translation: CENTER,
                    rotation: DQuat::from_rotation_x(1.0),
                    scale: DVec3::splat(RADIUS * 2.0),
                },
                ..Node::default()
            },
        ],
        ..Scene::default()
    }
}

const CENTER: DVec3 = DVec3::new(0.3, 1.2, -0.2);
const RADIUS: f64 = 0.8;

fn view() -> PosedCamera {
    let eye = DVec3::new(0.5, 4.0, 6.0);
    let forward = (DVec3::new(0.0, 0.6, 0.0) - eye).normalize();
    PosedCamera {
        name: String::new(),
        eye,
        forward,
        up: DVec3::Y.reject_from_normalized(forward).normalize(),
        projection: Projection::Perspective {
            vfov: 0.8,
            aspect: None,
        },
    }
}

fn lamp(position: DVec3) -> PosedLight {
    PosedLight {
        name: String::new(),
        position,
        direction: DVec3::NEG_Y,
        axis_x: DVec3::X,
        axis_y: DVec3::Z,
        power: Vec3::splat(60.0),
        range: f32::INFINITY,
        kind: LightKind::Point { radius: 0.0 },
    }
}

#[test]
fn a_sphere_casts_the_shadow_of_the_formula_and_shows_its_normals() {
    let scene = sphere_over_floor(Material::default());
    let mut frame = scene.at(0.0);
    let (camera, light) = (view(), lamp(DVec3::new(-2.0, 5.0, 1.0)));
    frame.cameras = vec![camera.clone()];
    let options = RenderOptions {
        ambient: Vec3::ZERO,
        background: Vec3::ZERO,
        width: 160,
        height: 120,
        ..options()
    };
    let film = render(&scene, &frame, std::slice::from_ref(&light), &options).film;
    let eye = rayward::CameraFrame::new(&camera, frame.origin, 160, 120)
        .expect("a camera")
        .view(&frame);
    let (mut on_sphere, mut dark, mut lit) = (0, 0, 0);
    for i in 0..film.prim.len() {
        let ray = eye.pixel_ray(i as u32 % 160, i as u32 / 160);
        let point = ray.origin + ray.dir * f64::from(film.depth[i]);
        match film.prim[i] {
            NO_ID => assert_eq!(film.color[i], Vec3::ZERO),
            2 => {
                assert_eq!(film.object[i], 1);
                let normal = (point - CENTER) / RADIUS;
                assert!((normal.length() - 1.0).abs() < 1e-5);
                assert!((film.normal[i].as_dvec3() - normal).length() < 1e-5);
                let cosine = normal.dot((light.position - point).normalize());
                let is_lit = film.color[i] != Vec3::ZERO;
                assert!(is_lit == (cosine > 0.0) || cosine.abs() < 1e-4, "{i}: {cosine}");
                on_sphere += 1;
            }
            _ => {
                let towards = light.position - point;
                let along = (CENTER - point).dot(towards) / towards.length_squared();
                let distance = (point + towards * along - CENTER).length();
                let is_dark = film.color[i] == Vec3::ZERO;
                assert!(
                    is_dark == (distance < RADIUS) || (distance - RADIUS).abs() < 1e-4,
                    "{i}: {distance}"
                );
                dark += usize::from(is_dark);
                lit += usize::from(!is_dark);
            }
        }
    }
    assert!(
        on_sphere > 500 && dark > 300 && lit > 3000,
        "{on_sphere} {dark} {lit}"
    );
}

#[test]
fn a_mirror_ball_shows_the_floor_and_a_clear_one_the_floor_behind() {
    let mirror = Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    };
    // With the index of air a ball of glass is not there but for the light it keeps off the floor.
    let clear = Material {
        transmission: 1.0,
        roughness: 0.0,
        ior: 1.0,
        specular: 0.0,
        thickness: 1.0,
        ..Material::default()
    };
    let shown = |material: Option<Material>| {
        let mut scene = sphere_over_floor(material.clone().unwrap_or_default());
        if material.is_none() {
            scene.nodes.pop();
        }
        let mut frame = scene.at(0.0);
        frame.cameras = vec![view()];
        let options = RenderOptions {
            ambient: Vec3::ONE,
            background: SKY,
            width: 64,
            height: 48,
            ..options()
        };
        render(&scene, &frame, &[], &options).film
    };
    let (mirror, clear, without) = (shown(Some(mirror)), shown(Some(clear)), shown(None));
    let ball: Vec<usize> = (0..mirror.prim.len()).filter(|&i| mirror.prim[i] == 2).collect();
    let is = |color: Vec3, wanted: Vec3| (color - wanted).abs().max_element() < 1e-3;
    for &i in &ball {
        let color = mirror.color[i];
        assert!(is(color, Vec3::ONE) || is(color, SKY), "{i}: {color}");
        assert!(is(clear.color[i], without.color[i]), "{i}: {}", clear.color[i]);
    }
    let sky = ball.iter().filter(|&&i| is(mirror.color[i], SKY)).count();
    assert!(
        ball.len() > 60 && sky > 10 && sky + 10 < ball.len(),
        "{sky} of {}",
        ball.len()
    );
}

const SKY: Vec3 = Vec3::new(0.0, 0.0, 5.0);

#[test]
fn panes_before_a_solid_are_seen_and_those_behind_are_not() {
    let mut scene = sphere_over_floor(Material {
        base_color: Vec4::new(0.0, 1.0, 0.0, 1.0),
        ..Material::default()
    });
    scene.materials.push(Material {
        base_color: Vec4::new(1.0, 0.0, 0.0, 0.5),
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    });
    let pane = |z: f32| Primitive {
        positions: vec![
            Vec3::new(-3.0, 0.1, z),
            Vec3::new(3.0, 0.1, z),
            Vec3::new(3.0, 5.0, z),
            Vec3::new(-3.0, 5.0, z),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: 2,
        ..Primitive::default()
    };
    let with = |z: f32| {
        let mut scene = scene.clone();
        scene.meshes[0].primitives.push(pane(z));
        let mut frame = scene.at(0.0);
        frame.cameras = vec![view()];
        let options = RenderOptions {
            ambient: Vec3::ONE,
            width: 64,
            height: 48,
            ..options()
        };
        let lights = [
            lamp(DVec3::new(-2.0, 5.0, 5.0)),
            square_light_at(&lamp(DVec3::Y * 6.0), &frame),
        ];
        let found = render(&scene, &frame, &[], &options).film;
        let lit = render(&scene, &frame, &lights, &options).film;
        let reference = RenderOptions {
            reference: true,
            ..options
        };
        assert_same(&lit, &render(&scene, &frame, &lights, &reference).film, "panes");
        found
    };
    let (before, behind) = (with(2.0), with(-2.0));
    // The middle of the ball.
    let middle = 22 * 64 + 33;
    assert_eq!(behind.color[middle], Vec3::new(0.0, 1.0, 0.0));
    assert!(
        (before.color[middle] - Vec3::new(0.5, 0.5, 0.0)).length() < 1e-5,
        "{}",
        before.color[middle]
    );
}

#[test]
fn a_frame_of_solids_alone_is_a_frame() {
    let mut scene = sphere_over_floor(Material::default());
    scene.nodes[0].mesh = None;
    scene.meshes.clear();
    let mut frame = scene.at(0.0);
    assert!(frame.triangle_count() == 0 && !frame.is_empty());
    frame.cameras = vec![view()];
    let film = render(&scene, &frame, &[lamp(DVec3::new(0.0, 5.0, 5.0))], &options()).film;
    assert!(film.prim.iter().filter(|prim| **prim == 0).count() > 30);
    assert!(film.prim.iter().all(|prim| *prim == 0 || *prim == NO_ID));
    let (low, high) = frame.bounds().expect("a sphere");
    let (wanted_low, wanted_high) = (CENTER - RADIUS, CENTER + RADIUS);
    assert!((low.as_dvec3() - wanted_low).length() < 1e-5 && (high.as_dvec3() - wanted_high).length() < 1e-5);
}
