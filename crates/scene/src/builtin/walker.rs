//! `walker`: a skinned figure (about 1.7k triangles with the ground) walking on the spot, one cycle a second.

use glam::{Vec3, dvec3, vec3};

use super::figure::{Clothes, figure};
use super::shapes::cuboid;
use super::stage::{Stage, standing};
use crate::Scene;

/// The whole scene.
pub(super) fn walker() -> Scene {
    let mut stage = Stage::new("walker");
    let ground = stage.matte("ground", [0.46, 0.50, 0.44], 0.9);
    let clothes = Clothes {
        skin: stage.matte("skin", [0.66, 0.38, 0.26], 0.6),
        hair: stage.matte("hair", [0.10, 0.05, 0.03], 0.5),
        shirt: stage.matte("shirt", [0.62, 0.12, 0.08], 0.8),
        trousers: stage.matte("trousers", [0.08, 0.13, 0.28], 0.9),
        shoes: stage.matte("shoes", [0.12, 0.07, 0.04], 0.4),
    };
    stage.show(
        "ground",
        cuboid(vec3(-6.0, -0.1, -6.0), vec3(6.0, 0.0, 6.0), [2, 1, 2]),
        ground,
    );
    let walker = figure(&mut stage, "walker", clothes, standing(Vec3::ZERO, 0.0));
    let animation = stage.animation("walk");
    walker.walk(&mut stage, animation, 1.0, 1, 0.0);
    let middle = dvec3(0.0, 0.88, 0.0);
    stage.camera("front", dvec3(2.2, 1.5, 2.9), middle, 34.0);
    stage.camera("side", dvec3(3.6, 1.0, 0.0), middle, 34.0);
    stage.lamp("key", dvec3(-3.0, 6.0, 4.5), middle, 0.85, [1.0, 0.96, 0.9]);
    stage.lamp("fill", dvec3(5.0, 3.0, 2.0), middle, 0.25, [0.85, 0.92, 1.0]);
    stage.scene
}
