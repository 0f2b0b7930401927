//! Light of an environment behind thin walls: counted once, whether drawn directions or diffuse rays find it.

use std::path::Path;

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{Material, Mesh, Node, PosedCamera, Primitive, Projection, Sampler, Scene};
use rayward::{Environment, Picture, RenderOptions, Renderer};

fn square(height: f32, half: f32, material: usize) -> Primitive {
    let corner = |[x, z]: [f32; 2]| Vec3::new(x * half, height, z * half);
    Primitive {
        positions: [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
            .map(corner)
            .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Primitive::default()
    }
}

/// Mean of what a camera below a wall, or without it, sees of the floor under a white sky.
fn floor(wall: bool) -> Vec3 {
    let mut primitives = vec![square(0.0, 1.0, 0)];
    if wall {
        primitives.push(square(2.0, 50.0, 1));
    }
    let clear = Material {
        transmission: 1.0,
        ior: 1.0,
        roughness: 0.0,
        double_sided: true,
        ..Material::default()
    };
    let scene = Scene {
        nodes: vec![Node {
            mesh: Some(0),
            ..Node::default()
        }],
        meshes: vec![Mesh {
            primitives,
            ..Mesh::default()
        }],
        materials: vec![Material::default(), clear],
        samplers: vec![Sampler::default()],
        ..Scene::default()
    };
    let camera = PosedCamera {
        name: String::new(),
        eye: DVec3::Y,
        forward: DVec3::NEG_Y,
        up: DVec3::NEG_Z,
        projection: Projection::Orthographic {
            half_height: 0.5,
            aspect: None,
        },
    };
    let picture = Picture {
        width: 8,
        height: 4,
        pixels: vec![Vec4::ONE; 32],
        srgb: false,
    };
    let options = RenderOptions {
        width: 32,
        height: 32,
        pixel_samples: 4,
        samples: 4,
        environment_samples: 4,
        diffuse_bounces: 2,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene);
    let sky = Environment::new(&picture, Path::new("sky")).expect("it is valid");
    renderer.set_environment(Some(sky));
    let rendered = renderer.render(&scene.at(0.0), &camera, &[], &options, &|_| ());
    let film = rendered.expect("valid input").film;
    film.color.iter().sum::<Vec3>() / film.color.len() as f32
}

#[test]
fn a_clear_wall_changes_nothing() {
    let [without, with] = [false, true].map(floor);
    assert!(
        (without - with).abs().max_element() < 0.02,
        "{without} and {with}"
    );
    assert!(without.x > 0.8);
}
