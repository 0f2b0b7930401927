//! `solids`: what is not made of triangles, among some that is.
//!
//! Spheres of paint, metal and glass, capsules, a cylinder, and the three operations: a die with bores (an intersection,
//! then differences), a bowl, a lens, a molecule (a union). They stand on slabs of triangles, before a ball of triangles.
//! The die turns, a capsule swings and a ball rolls in the bowl, in 4 s.

use glam::{DQuat, DVec3, Quat, dvec3, vec3};

use super::shapes::{cuboid, geosphere, rounded_cuboid};
use super::stage::{Stage, placed, sampled, standing};
use crate::{Material, Scene, Shape, Transform};

/// Length of the animation, seconds.
const DURATION: f32 = 4.0;

/// The whole scene.
pub(super) fn solids() -> Scene {
    let mut stage = Stage::new("solids");
    let stone = stage.matte("stone", [0.46, 0.45, 0.42], 0.9);
    let slate = stage.matte("slate", [0.16, 0.18, 0.21], 0.6);
    let clay = stage.matte("clay", [0.55, 0.20, 0.11], 0.7);
    stage.show(
        "floor",
        cuboid(vec3(-6.0, -0.2, -5.0), vec3(6.0, 0.0, 5.0), [1, 1, 1]),
        stone,
    );
    let pedestal = stage.solid(
        "pedestal",
        rounded_cuboid(
            vec3(-0.75, -0.25, -0.75),
            vec3(0.75, 0.25, 0.75),
            0.06,
            2,
            [2, 1, 2],
        ),
        slate,
    );
    stage.place("pedestal", pedestal, None, standing(vec3(0.0, 0.25, 0.0), 0.0));
    let ball = stage.solid("ball of triangles", geosphere(6), clay);
    stage.place(
        "ball of triangles",
        ball,
        None,
        placed(vec3(-1.3, 0.55, -2.1), 0.0, 0.55),
    );

    let die = die(&mut stage);
    let ball = bowl(&mut stage);
    let pendulum = capsules(&mut stage);
    others(&mut stage);

    let swing = stage.animation("turning");
    let (times, turns) = sampled(DURATION, 24, |phase| {
        Quat::from_rotation_y(phase * std::f32::consts::TAU)
    });
    stage.turn(swing, die, times, turns);
    let (times, places) = sampled(DURATION, 24, |phase| {
        let (sin, cos) = (phase * std::f32::consts::TAU).sin_cos();
        vec3(1.75 + 0.20 * cos, 0.40, 0.95 + 0.20 * sin)
    });
    stage.slide(swing, ball, times, places);
    let (times, turns) = sampled(DURATION, 24, |phase| {
        Quat::from_rotation_z(0.5 * (phase * std::f32::consts::TAU).sin())
    });
    stage.turn(swing, pendulum, times, turns);

    let middle = dvec3(0.0, 0.7, 0.0);
    stage.camera("front", dvec3(0.9, 2.5, 6.4), dvec3(0.05, 0.72, 0.0), 34.0);
    stage.camera("low", dvec3(-4.2, 0.9, 3.6), dvec3(0.1, 0.75, 0.0), 36.0);
    stage.lamp("key", dvec3(-3.5, 6.0, 4.5), middle, 0.85, [1.0, 0.95, 0.88]);
    stage.lamp("fill", dvec3(5.0, 4.0, 3.0), middle, 0.25, [0.8, 0.9, 1.0]);
    stage.scene
}

fn sphere(center: DVec3, radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

fn cylinder(from: DVec3, to: DVec3, radius: f64) -> Shape {
    Shape::Cylinder { from, to, radius }
}

fn capsule(from: DVec3, to: DVec3, radius: f64) -> Shape {
    Shape::Capsule { from, to, radius }
}

fn block(center: DVec3, half: DVec3) -> Shape {
    Shape::Box {
        center,
        half: [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z],
    }
}

/// A rounded cube bored through along its axes; its node.
fn die(stage: &mut Stage) -> usize {
    let red = stage.matte("lacquer", [0.52, 0.05, 0.04], 0.25);
    let bore = |axis: DVec3| cylinder(axis * -1.0, axis, 0.30);
    let rounded = Shape::Intersection(vec![
        block(DVec3::ZERO, DVec3::splat(0.55)),
        sphere(DVec3::ZERO, 0.74),
    ]);
    let die = Shape::Difference(vec![rounded, bore(DVec3::X), bore(DVec3::Y), bore(DVec3::Z)]);
    stage.show_solid("die", die, red, standing(vec3(0.0, 1.05, 0.0), 0.5))
}

/// Half a hollow sphere with a foot, and a ball in it, whose node is returned.
fn bowl(stage: &mut Stage) -> usize {
    let glaze = stage.matte("glaze", [0.09, 0.27, 0.42], 0.3);
    let yellow = stage.matte("ball", [0.72, 0.50, 0.06], 0.4);
    let at = dvec3(1.75, 0.72, 0.95);
    let hollow = Shape::Difference(vec![
        sphere(at, 0.70),
        sphere(at, 0.62),
        block(at + DVec3::Y * 0.5, dvec3(0.8, 0.5, 0.8)),
    ]);
    let foot = cylinder(dvec3(at.x, 0.0, at.z), dvec3(at.x, 0.09, at.z), 0.30);
    let bowl = Shape::Union(vec![hollow, foot]);
    stage.show_solid("bowl", bowl, glaze, Transform::default());
    let ball = sphere(DVec3::ZERO, 0.24);
    stage.show_solid(
        "rolling ball",
        ball,
        yellow,
        standing(vec3(1.95, 0.40, 0.95), 0.0),
    )
}

/// Two capsules that lean against each other, and one that swings from them; the node of that.
fn capsules(stage: &mut Stage) -> usize {
    let green = stage.matte("enamel", [0.10, 0.34, 0.16], 0.35);
    let steel = stage.metal("steel", [0.62, 0.63, 0.65], 0.3);
    let top = dvec3(-2.3, 1.75, 0.3);
    for side in [-1.0, 1.0] {
        let foot = dvec3(-2.3, 0.09, 0.3 + 0.75 * side);
        stage.show_solid("leg", capsule(foot, top, 0.09), green, Transform::default());
    }
    let bob = Shape::Union(vec![
        capsule(DVec3::ZERO, dvec3(0.0, -1.05, 0.0), 0.035),
        capsule(dvec3(-0.14, -1.15, 0.0), dvec3(0.14, -1.15, 0.0), 0.15),
    ]);
    let at = Transform::Trs {
        translation: top,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
    };
    stage.show_solid("pendulum", bob, steel, at)
}

/// A mirror ball, a glass ball, a lens and a molecule.
fn others(stage: &mut Stage) {
    let still = Transform::default();
    let chrome = stage.metal("chrome", [0.88, 0.89, 0.90], 0.0);
    stage.show_solid(
        "mirror ball",
        sphere(dvec3(1.55, 0.75, -1.6), 0.75),
        chrome,
        still,
    );
    let glass = stage.material(Material {
        name: "glass".into(),
        transmission: 1.0,
        roughness: 0.0,
        thickness: 1.0,
        attenuation_distance: 1.2,
        attenuation_color: vec3(0.75, 0.95, 0.88),
        ..Material::default()
    });
    stage.show_solid("glass ball", sphere(dvec3(-1.15, 0.42, 1.6), 0.42), glass, still);
    let lens = Shape::Intersection(vec![
        sphere(dvec3(0.45, 0.5, 2.35), 0.6),
        sphere(dvec3(0.45, 0.5, 1.45), 0.6),
        // Cut flat to stand on.
        block(dvec3(0.45, 0.6, 1.9), DVec3::splat(0.46)),
    ]);
    stage.show_solid("lens", lens, glass, standing(vec3(0.0, -0.14, 0.0), 0.0));
    let blue = stage.matte("blue", [0.12, 0.20, 0.50], 0.3);
    let at = dvec3(-0.1, 0.30, -1.5);
    let ends = [
        dvec3(-0.55, 1.0, 0.0),
        dvec3(0.6, 1.1, 0.2),
        dvec3(0.05, 1.75, -0.3),
    ];
    let mut parts = vec![sphere(at, 0.3)];
    for end in ends {
        parts.extend([capsule(at, at + end, 0.08), sphere(at + end, 0.22)]);
    }
    stage.show_solid(
        "molecule",
        Shape::Union(parts),
        blue,
        standing(vec3(-0.2, 0.0, -0.6), 0.0),
    );
}
