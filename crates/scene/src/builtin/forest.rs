//! `forest`: a glade with trees, mushrooms, grass, two hares, butterflies and a walking figure; the stand-in for
//! frame 20 of the Fairy Forest of HM08 Table 1 (174k triangles of very different size, animated).
//!
//! Ground triangles are metres wide, blades of grass millimetres. Trees sway, the figure walks, a hare hops and the
//! butterflies flutter, all by node animation (the figure by its skin too), 4 s.

use std::f32::consts::{PI, TAU};

use glam::{DQuat, EulerRot, Quat, Vec2, Vec3, dvec3, vec2, vec3};

use super::figure::{Clothes, STRIDE, figure};
use super::plants::{mushroom, tree, tuft};
use super::random::{Random, fractal_noise};
use super::shapes::{Surface, cuboid, geosphere, tube};
use super::stage::{CREASE, Stage, placed, sampled, standing};
use super::statue::hare;
use crate::{Material, Scene, Transform};

/// Triangles of the whole scene; grass makes up what the rest leaves.
const TRIANGLES: usize = 174_000;
const SECONDS: f32 = 4.0;
const BLADES: usize = 44;
/// Where the hares are at the start, X and Z.
const SITTING: Vec2 = vec2(-1.35, 2.3);
const HOPPING: Vec2 = vec2(2.6, 2.2);

/// The whole scene.
pub(super) fn forest() -> Scene {
    let mut stage = Stage::new("forest");
    let animation = stage.animation("forest");
    let mut random = Random::new(20);
    let soil = stage.matte("soil", [0.20, 0.24, 0.07], 1.0);
    let mesh = stage.mesh("ground", vec![ground().into_primitive(60.0, soil)]);
    stage.place("ground", mesh, None, standing(Vec3::ZERO, 0.0));
    trees(&mut stage, animation, &mut random);
    mushrooms(&mut stage, &mut random);
    hares(&mut stage, animation);
    butterflies(&mut stage, animation, &mut random);
    wanderer(&mut stage, animation);
    grass(&mut stage, &mut random);
    let middle = dvec3(0.0, 1.2, 0.0);
    stage.camera("glade", dvec3(0.6, 1.35, 6.6), dvec3(-0.1, 1.45, 0.0), 50.0);
    stage.camera("hare", dvec3(-0.9, 0.55, 4.9), dvec3(-1.3, 0.35, 2.4), 45.0);
    stage.lamp("sun", dvec3(-11.0, 24.0, 17.0), middle, 0.88, [1.0, 0.94, 0.80]);
    stage.lamp("sky", dvec3(5.0, 7.0, 12.0), middle, 0.16, [0.75, 0.88, 1.0]);
    stage.scene
}

/// Height of the ground.
fn relief(at: Vec2) -> f32 {
    let distance = at.length();
    let rim = ((distance - 9.0) / 14.0).max(0.0);
    0.12 * fractal_noise(vec3(at.x * 0.35, 0.5, at.y * 0.35), 2, 3) * (distance / 4.0).min(1.0)
        + 3.0 * rim * rim
}

fn on_ground(at: Vec2) -> Vec3 {
    vec3(at.x, relief(at), at.y)
}

/// A closed slab with hills on top.
fn ground() -> Surface {
    cuboid(vec3(-26.0, -1.0, -26.0), vec3(26.0, 0.0, 26.0), [26, 1, 26])
        .warped(|p| if p.y < 0.0 { p } else { on_ground(vec2(p.x, p.z)) })
}

/// Four kinds of tree around the glade, none between it and the camera.
fn trees(stage: &mut Stage, animation: usize, random: &mut Random) {
    let bark = stage.matte("bark", [0.20, 0.12, 0.07], 1.0);
    let greens = [
        [0.10, 0.26, 0.04],
        [0.16, 0.32, 0.05],
        [0.28, 0.34, 0.05],
        [0.07, 0.20, 0.06],
    ];
    let kinds: Vec<usize> = greens
        .iter()
        .zip([5.6, 6.4, 4.6, 7.2])
        .map(|(&green, height)| {
            let leaf = double_sided(stage, "leaves", green);
            let (wood, leaves) = tree(random, height, 11, 1_300);
            stage.mesh(
                "tree",
                vec![
                    wood.into_primitive(CREASE, bark),
                    leaves.into_primitive(0.0, leaf),
                ],
            )
        })
        .collect();
    for i in 0..22 {
        let turn = -0.12 * PI - (i as f32 + random.between(0.2, 0.8)) / 22.0 * 1.28 * PI;
        let distance = [4.6, 7.4, 10.6, 14.0][i % 4] + random.between(-0.6, 0.8);
        let at = vec2(turn.cos(), turn.sin()) * vec2(1.1, 1.0) * distance + vec2(0.0, 0.6);
        let transform = placed(on_ground(at), random.unit() * TAU, random.between(0.85, 1.15));
        let node = stage.place("tree", kinds[(i * 3 + i / 4) % 4], None, transform);
        if i % 2 == 0 {
            sway(stage, animation, node, random.unit());
        }
    }
}

/// Two slow swings about the foot.
fn sway(stage: &mut Stage, animation: usize, node: usize, start: f32) {
    let (times, turns) = sampled(SECONDS, 16, |phase| {
        let swing = ((phase * 2.0 + start) * TAU).sin() * 0.015;
        Quat::from_euler(EulerRot::YXZ, start * TAU, swing, swing * 0.6)
    });
    stage.turn(animation, node, times, turns);
}

fn mushrooms(stage: &mut Stage, random: &mut Random) {
    let [stem, cap, spots] = mushroom();
    let pale = stage.matte("mushroom stem", [0.70, 0.62, 0.50], 0.8);
    let white = stage.matte("mushroom spots", [0.82, 0.78, 0.70], 0.7);
    let kinds = [[0.62, 0.06, 0.03], [0.55, 0.26, 0.06]].map(|color| {
        let red = stage.matte("mushroom cap", color, 0.35);
        let parts = [(&stem, pale), (&cap, red), (&spots, white)];
        stage.mesh(
            "mushroom",
            parts.map(|(s, m)| s.clone().into_primitive(CREASE, m)).to_vec(),
        )
    });
    let large = [
        (vec2(1.9, 0.6), 1.5),
        (vec2(2.6, 1.3), 0.9),
        (vec2(-2.9, -0.4), 1.1),
    ];
    for (i, (at, size)) in large.into_iter().enumerate() {
        stage.place(
            "mushroom",
            kinds[i / 2],
            None,
            placed(on_ground(at), i as f32, size),
        );
    }
    for i in 0..22 {
        let turn = i as f32 / 22.0 * TAU + random.between(-0.1, 0.1);
        let at = vec2(turn.cos(), turn.sin()) * random.between(2.6, 3.8);
        let size = random.between(0.16, 0.42);
        if [SITTING, HOPPING].iter().any(|hare| hare.distance(at) < 0.9) {
            continue;
        }
        stage.place("mushroom", kinds[i % 2], None, placed(on_ground(at), turn, size));
    }
}

/// One hare sits, one hops across the glade.
fn hares(stage: &mut Stage, animation: usize) {
    let fur = stage.matte("brown fur", [0.40, 0.24, 0.13], 1.0);
    let pale = stage.matte("grey fur", [0.50, 0.46, 0.42], 1.0);
    for (name, color, frequency) in [("sitting hare", fur, 22), ("hopping hare", pale, 14)] {
        let mesh = stage.mesh("hare", vec![hare(frequency).into_smooth_primitive(color)]);
        let start = if color == fur { SITTING } else { HOPPING };
        let yaw = if color == fur { 0.5 } else { -1.9 };
        let node = stage.place(name, mesh, None, placed(on_ground(start), yaw, 0.62));
        if color == pale {
            let (times, path) = sampled(SECONDS, 48, |phase| {
                let hop = phase * 5.0;
                let along = (hop.floor() + smooth(hop.fract())) * 0.45;
                let at = start + vec2(yaw.sin(), yaw.cos()) * along;
                on_ground(at) + Vec3::Y * (hop.fract() * PI).sin().max(0.0) * 0.22
            });
            stage.slide(animation, node, times, path);
        }
    }
}

fn smooth(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// Butterflies: a body and two wings that turn about it.
fn butterflies(stage: &mut Stage, animation: usize, random: &mut Random) {
    let dark = stage.matte("butterfly body", [0.05, 0.04, 0.04], 0.8);
    let path = [-0.05, -0.02, 0.03, 0.06].map(|z| vec3(0.0, 0.0, z));
    let body = stage.solid(
        "butterfly body",
        tube(&path, &[0.002, 0.008, 0.009, 0.004], 6),
        dark,
    );
    for i in 0..7 {
        let color = [[0.75, 0.45, 0.05], [0.12, 0.30, 0.75], [0.80, 0.75, 0.60]][i % 3];
        let paint = double_sided(stage, "butterfly wing", color);
        let wing = stage.mesh("butterfly wing", vec![wing().into_primitive(60.0, paint)]);
        // On both sides of the fairy's way.
        let aside = if i % 2 == 0 {
            random.between(0.9, 2.3)
        } else {
            random.between(-2.8, -2.0)
        };
        let home = vec3(aside, random.between(0.7, 2.0), random.between(-0.5, 3.0));
        let (start, radius) = (random.unit(), random.between(0.25, 0.6));
        let node = stage.place("butterfly", body, None, placed(home, 0.0, 1.1));
        let (times, flight) = sampled(SECONDS, 48, |phase| {
            let angle = (phase + start) * TAU;
            home + vec3(
                angle.cos() * radius,
                0.12 * (angle * 3.0).sin(),
                angle.sin() * radius,
            )
        });
        stage.slide(animation, node, times, flight);
        let (times, turns) = sampled(SECONDS, 48, |phase| {
            Quat::from_rotation_y(PI - (phase + start) * TAU)
        });
        stage.turn(animation, node, times, turns);
        for side in [0.0, PI] {
            let node = stage.place("butterfly wing", wing, Some(node), standing(Vec3::ZERO, 0.0));
            let (times, turns) = sampled(SECONDS, 96, |phase| {
                let beat = 0.35 + 0.75 * ((phase * 12.0 + start) * TAU).sin();
                Quat::from_rotation_z(if side == 0.0 { beat } else { PI - beat })
            });
            stage.turn(animation, node, times, turns);
        }
    }
}

/// One wing in the XZ plane, spread along +X.
fn wing() -> Surface {
    let outline = [
        vec3(0.0, 0.0, 0.03),
        vec3(0.07, 0.004, 0.09),
        vec3(0.13, 0.0, 0.085),
        vec3(0.125, 0.0, 0.03),
        vec3(0.085, 0.004, 0.0),
        vec3(0.10, 0.0, -0.04),
        vec3(0.07, 0.0, -0.09),
        vec3(0.03, 0.004, -0.075),
        vec3(0.0, 0.0, -0.02),
    ];
    let mut wing = Surface {
        positions: outline.to_vec(),
        triangles: Vec::new(),
    };
    wing.positions.push(vec3(0.05, 0.006, 0.005));
    wing.triangles.extend((0..8).map(|i| [9, i, i + 1]));
    wing
}

/// A child-sized fairy with wings and a round lantern that walks through the glade.
fn wanderer(stage: &mut Stage, animation: usize) {
    let clothes = Clothes {
        skin: stage.matte("skin", [0.70, 0.44, 0.33], 0.6),
        hair: stage.matte("hair", [0.45, 0.20, 0.06], 0.5),
        shirt: stage.matte("violet cloth", [0.32, 0.12, 0.45], 0.9),
        trousers: stage.matte("green cloth", [0.10, 0.26, 0.12], 0.9),
        shoes: stage.matte("leather", [0.18, 0.09, 0.04], 0.5),
    };
    let (from, yaw, size, cycles) = (vec3(-1.3, 0.02, -1.0), 0.35, 0.8, 4);
    let fairy = figure(stage, "fairy", clothes, placed(from, yaw, size));
    fairy.walk(stage, animation, 1.0, cycles, 0.0);
    let way = Quat::from_rotation_y(yaw) * Vec3::Z * STRIDE * size * cycles as f32;
    stage.slide(animation, fairy.root, vec![0.0, SECONDS], vec![from, from + way]);
    let gauze = double_sided(stage, "fairy wing", [0.55, 0.72, 0.80]);
    let wing = stage.mesh("fairy wing", vec![wing().into_primitive(60.0, gauze)]);
    for side in [-1.0, 1.0] {
        let transform = Transform::Trs {
            translation: dvec3(0.02 * side, 0.1, -0.1),
            rotation: DQuat::from_euler(EulerRot::YXZ, 0.25 * side, -1.35, 0.0),
            scale: dvec3(4.5 * side, 4.5, 4.5),
        };
        stage.place("fairy wing", wing, Some(fairy.chest()), transform);
    }
    let glow = stage.material(Material {
        name: "lantern".into(),
        emissive: vec3(0.9, 0.65, 0.2),
        ..Material::default()
    });
    let lantern = stage.solid("lantern", geosphere(5).warped(|p| p * 0.06 - Vec3::Y * 0.2), glow);
    stage.place(
        "lantern",
        lantern,
        Some(fairy.left_hand()),
        standing(Vec3::ZERO, 0.0),
    );
}

fn double_sided(stage: &mut Stage, name: &str, color: [f32; 3]) -> usize {
    let material = stage.matte(name, color, 0.8);
    stage.scene.materials[material].double_sided = true;
    material
}

/// Tufts all over the glade, denser in the middle, as many as the budget allows.
fn grass(stage: &mut Stage, random: &mut Random) {
    let kinds = [[0.16, 0.34, 0.05], [0.24, 0.38, 0.07], [0.10, 0.26, 0.05]].map(|color| {
        let paint = double_sided(stage, "grass", color);
        stage.mesh("tuft", vec![tuft(random, BLADES).into_primitive(60.0, paint)])
    });
    let count = TRIANGLES.saturating_sub(stage.triangle_count()) / (BLADES * 3);
    for i in 0..count {
        let turn = random.unit() * TAU;
        let at = vec2(turn.cos(), turn.sin()) * (0.6 + 7.0 * random.unit().powf(0.8));
        let transform = placed(on_ground(at), random.unit() * TAU, random.between(0.7, 1.3));
        stage.place("tuft", kinds[i % 3], None, transform);
    }
}
