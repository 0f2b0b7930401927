//! `blob-*` and `collide`: closed scanned-mesh-like surfaces, stand-ins for the bunnies and the dragon with the
//! bunny of HM08 Table 1.

use glam::{Vec3, dvec3, vec3};

use super::stage::{Stage, placed, sampled, standing};
use super::statue::{hare, serpent};
use crate::Scene;

/// One hare of `20 * frequency^2` triangles and nothing else.
pub(super) fn blob(name: &str, frequency: u32) -> Scene {
    let mut stage = Stage::new(name);
    let clay = stage.matte("clay", [0.76, 0.52, 0.36], 0.7);
    let mesh = stage.mesh("hare", vec![hare(frequency).into_smooth_primitive(clay)]);
    stage.place("hare", mesh, None, standing(Vec3::ZERO, 0.0));
    let heart = dvec3(0.0, 0.47, 0.0);
    stage.camera("front", dvec3(1.15, 0.85, 2.0), heart, 30.0);
    stage.camera("side", dvec3(-2.3, 0.7, 0.4), heart, 30.0);
    stage.lamp("key", dvec3(-2.0, 4.0, 4.0), heart, 0.85, [1.0, 0.97, 0.92]);
    stage.lamp("fill", dvec3(5.0, 1.5, 2.0), heart, 0.22, [0.85, 0.92, 1.0]);
    stage.scene
}

/// A hare and a coiled serpent; the hare slides into contact with the coil and back, once in 4 s.
pub(super) fn collide() -> Scene {
    let mut stage = Stage::new("collide");
    let clay = stage.matte("clay", [0.76, 0.52, 0.36], 0.7);
    let jade = stage.matte("jade", [0.20, 0.46, 0.30], 0.35);
    let hare_mesh = stage.mesh("hare", vec![hare(59).into_smooth_primitive(clay)]);
    let serpent_mesh = stage.mesh("serpent", vec![serpent(128, 713).into_smooth_primitive(jade)]);
    let away = vec3(-1.75, 0.0, 0.1);
    let hare_node = stage.place("hare", hare_mesh, None, standing(away, 1.2));
    stage.place(
        "serpent",
        serpent_mesh,
        None,
        placed(vec3(0.55, 0.0, 0.0), -0.5, 1.3),
    );
    let (times, path) = sampled(4.0, 32, |phase| {
        let closeness = 0.5 - 0.5 * (phase * std::f32::consts::TAU).cos();
        away + vec3(1.33 * closeness, 0.0, 0.0)
    });
    let animation = stage.animation("collide");
    stage.slide(animation, hare_node, times, path);
    let middle = dvec3(-0.25, 0.6, 0.0);
    stage.camera("front", dvec3(-0.6, 1.9, 4.6), middle, 31.0);
    stage.lamp("key", dvec3(-2.5, 5.0, 4.0), middle, 0.85, [1.0, 0.97, 0.92]);
    stage.lamp("fill", dvec3(5.0, 2.0, 3.0), middle, 0.2, [0.85, 0.92, 1.0]);
    stage.scene
}
