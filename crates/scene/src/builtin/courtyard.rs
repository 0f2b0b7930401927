//! `courtyard`: a court enclosed by two storeys of arcades, with a fountain, benches, vases and people; the
//! stand-in for the Courtyard of HM08 Table 1 (31k triangles of even size).
//!
//! Every part is a closed solid, sunk a little into what carries it. The long side runs along X; the court
//! measures 17.5 m by 12.5 m inside the columns.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Affine3A, Quat, Vec2, Vec3, dvec3, vec2, vec3};

use super::figure::{Clothes, STRIDE, figure};
use super::shapes::{Surface, arc, cuboid, lathe, ribbon, rounded_cuboid};
use super::stage::{Stage, placed, standing};
use super::statue::hare;
use crate::Scene;

/// Width of a bay from column to column.
const BAY: f32 = 2.5;
/// Bays along X and Z.
const BAYS: (usize, usize) = (7, 5);
/// From the columns back to the wall.
const DEPTH: f32 = 3.0;
/// Heights: springing of the lower arches, floor of the gallery, springing of its arches, top of the wall.
const LEVELS: [f32; 4] = [2.6, 4.4, 6.3, 8.0];

struct Paints {
    stone: usize,
    plaster: usize,
    light_tile: usize,
    dark_tile: usize,
    roof: usize,
    wood: usize,
    clay: usize,
    leaf: usize,
    water: usize,
    bronze: usize,
}

/// The whole scene.
pub(super) fn courtyard() -> Scene {
    let mut stage = Stage::new("courtyard");
    let paints = Paints {
        stone: stage.matte("sandstone", [0.72, 0.60, 0.44], 0.8),
        plaster: stage.matte("plaster", [0.78, 0.56, 0.38], 0.9),
        light_tile: stage.matte("light tile", [0.66, 0.58, 0.47], 0.5),
        dark_tile: stage.matte("dark tile", [0.34, 0.21, 0.15], 0.5),
        roof: stage.matte("roof tile", [0.52, 0.20, 0.11], 0.8),
        wood: stage.matte("wood", [0.30, 0.16, 0.08], 0.6),
        clay: stage.matte("clay", [0.60, 0.26, 0.14], 0.7),
        leaf: stage.matte("leaf", [0.13, 0.30, 0.08], 0.7),
        water: stage.matte("water", [0.06, 0.20, 0.24], 0.05),
        bronze: stage.metal("bronze", [0.60, 0.42, 0.24], 0.4),
    };
    floor(&mut stage, &paints);
    walls(&mut stage, &paints);
    for side in 0..4 {
        arcade(&mut stage, &paints, side);
    }
    fountain(&mut stage, &paints);
    furniture(&mut stage, &paints);
    people(&mut stage);
    let middle = dvec3(0.0, 1.6, -1.0);
    stage.camera("court", dvec3(-7.3, 2.4, 5.4), dvec3(0.8, 2.3, -2.0), 54.0);
    stage.camera("gallery", dvec3(8.2, 6.2, 5.6), dvec3(-1.5, 0.8, -1.5), 55.0);
    stage.camera("axis", dvec3(0.0, 1.7, 6.8), dvec3(0.0, 2.8, 0.0), 60.0);
    stage.lamp("sun", dvec3(-13.0, 33.0, 12.5), middle, 0.85, [1.0, 0.95, 0.84]);
    stage.lamp(
        "sky",
        dvec3(2.5, 7.2, 2.5),
        dvec3(0.0, 3.0, -8.0),
        0.22,
        [0.75, 0.87, 1.0],
    );
    stage.scene
}

fn half_size() -> Vec2 {
    vec2(BAYS.0 as f32, BAYS.1 as f32) * BAY / 2.0
}

/// Chequered tiles on a slab; the slab's own top lies deeper and shows in the joints.
fn floor(stage: &mut Stage, paints: &Paints) {
    let reach = half_size() + DEPTH + 0.4;
    let slab = cuboid(
        vec3(-reach.x, -0.4, -reach.y),
        vec3(reach.x, -0.03, reach.y),
        [8, 1, 6],
    );
    stage.show("ground", slab, paints.stone);
    let size = BAY / 2.0;
    let counts = (BAYS.0 * 2 + 4, BAYS.1 * 2 + 4);
    let mut tiles = [Surface::default(), Surface::default()];
    for (i, j) in (0..counts.0).flat_map(|i| (0..counts.1).map(move |j| (i, j))) {
        let corner = vec2(i as f32 - counts.0 as f32 / 2.0, j as f32 - counts.1 as f32 / 2.0) * size;
        let low = vec3(corner.x + 0.012, -0.08, corner.y + 0.012);
        let high = vec3(corner.x + size - 0.012, 0.0, corner.y + size - 0.012);
        tiles[(i + j) % 2].join(&cuboid(low, high, [1, 1, 1]));
    }
    let [light, dark] = tiles;
    stage.show("light tiles", light, paints.light_tile);
    stage.show("dark tiles", dark, paints.dark_tile);
}

/// Outer walls with doors and windows set before them, the gallery's floor and the roof.
fn walls(stage: &mut Stage, paints: &Paints) {
    let inner = half_size();
    let outer = inner + DEPTH;
    let mut plaster = Surface::default();
    let mut slabs = Surface::default();
    let mut roof = Surface::default();
    for side in 0..4 {
        let (turn, along, back) = side_frame(side);
        let (length, count) = (outer[along], outer[along] as usize);
        // The short walls end inside the long ones.
        let end = length + [0.4, 0.2][side % 2];
        let wall = cuboid(
            vec3(-end, -0.2, 0.0),
            vec3(end, LEVELS[3] + 1.1, 0.4),
            [count, 5, 1],
        );
        let to_wall = turn * Affine3A::from_translation(vec3(0.0, 0.0, back + DEPTH));
        plaster.join(&wall.moved(to_wall));
        // A hair longer than the mitre: neighbours overlap instead of sharing a face.
        let mitre = |z: f32| inner[along] + z + 0.01;
        let slab = |low: f32, high: f32, front: f32, rear: f32| {
            let quarter = |x: f32, z: f32| vec2(x * mitre(z), z);
            let (left, right) = (
                [front, rear].map(|z| quarter(-1.0, z)),
                [front, rear].map(|z| quarter(1.0, z)),
            );
            mitred(left, right, low, high)
        };
        let to_columns = turn * Affine3A::from_translation(vec3(0.0, 0.0, back));
        slabs.join(&slab(LEVELS[1] - 0.3, LEVELS[1], -0.32, DEPTH + 0.2).moved(to_columns));
        let eaves = slab(LEVELS[3] - 0.25, LEVELS[3], -0.75, DEPTH + 0.8);
        let slope = |p: Vec3| vec3(p.x, p.y + 0.32 * (p.z + 0.75), p.z);
        roof.join(&eaves.warped(slope).moved(to_columns));
    }
    stage.show("walls", plaster, paints.plaster);
    stage.show("gallery floor", slabs, paints.stone);
    stage.show("roof", roof, paints.roof);
    openings(stage, paints);
}

/// A slab whose ends are cut along given lines (front and rear corner of the left and right end).
fn mitred(left: [Vec2; 2], right: [Vec2; 2], low: f32, high: f32) -> Surface {
    cuboid(Vec3::ZERO, Vec3::ONE, [BAYS.0, 1, 2]).warped(|p| {
        let edge = |e: [Vec2; 2]| e[0].lerp(e[1], p.z);
        let at = edge(left).lerp(edge(right), p.x);
        vec3(at.x, low + (high - low) * p.y, at.y)
    })
}

/// Turn about the court's centre that brings side `side` to +Z, index of its length in X/Z and distance of its
/// columns.
fn side_frame(side: usize) -> (Affine3A, usize, f32) {
    let along = side % 2;
    (
        Affine3A::from_rotation_y(side as f32 * FRAC_PI_2),
        along,
        half_size()[1 - along],
    )
}

/// Doors below and shuttered windows above, one for every second bay.
fn openings(stage: &mut Stage, paints: &Paints) {
    let door = Surface::joined([
        cuboid(vec3(-0.6, -0.05, -0.06), vec3(-0.02, 2.3, 0.1), [1, 2, 1]),
        cuboid(vec3(0.02, -0.05, -0.06), vec3(0.6, 2.3, 0.1), [1, 2, 1]),
    ]);
    let frame = arch_block(1.2, 1.56, 2.3, 0.0, 0.18);
    let posts = [-1.0, 1.0].map(|side| {
        cuboid(
            vec3(side * 0.69 - 0.1, -0.05, -0.13),
            vec3(side * 0.69 + 0.1, 2.32, 0.1),
            [1, 3, 1],
        )
    });
    let frame = Surface::joined(posts.into_iter().chain([frame.at(vec3(0.0, 0.0, -0.03))]));
    let door = stage.solid("door", door, paints.wood);
    let frame = stage.solid("door frame", frame, paints.stone);
    for side in 0..4 {
        let (turn, along, back) = side_frame(side);
        for bay in (0..[BAYS.0, BAYS.1][along]).filter(|b| b % 2 == 1) {
            let x = (bay as f32 + 0.5) * BAY - half_size()[along];
            for level in [0.0, LEVELS[1]] {
                let at = turn.transform_point3(vec3(x, level, back + DEPTH));
                let yaw = side as f32 * FRAC_PI_2;
                stage.place("door", door, None, standing(at, yaw));
                if level == 0.0 {
                    stage.place("door frame", frame, None, standing(at, yaw));
                }
            }
        }
    }
}

/// A wall piece `width` wide over a round arch of clear span `span`: from the springing at height `spring` up to
/// `crown` above the arch's top (or, at 0, a band of even width), `thick` deep.
fn arch_block(span: f32, width: f32, spring: f32, crown: f32, thick: f32) -> Surface {
    let radius = span / 2.0;
    let mut lower = arc(vec2(0.0, spring), Vec2::splat(radius), 1.0, 0.0, 8);
    let upper = if crown == 0.0 {
        arc(vec2(0.0, spring), Vec2::splat(width / 2.0), 1.0, 0.0, 8)
    } else {
        lower.insert(0, vec2(-width / 2.0, spring));
        lower.push(vec2(width / 2.0, spring));
        lower.iter().map(|p| vec2(p.x, spring + radius + crown)).collect()
    };
    ribbon(&lower, &upper, vec2(-thick / 2.0, thick / 2.0), 1, 1)
}

/// One side of the two arcades: columns, arches, cornices and the gallery's balustrade.
fn arcade(stage: &mut Stage, paints: &Paints, side: usize) {
    let (turn, along, back) = side_frame(side);
    let count = [BAYS.0, BAYS.1][along];
    let yaw = side as f32 * FRAC_PI_2;
    let storeys = [
        (0.0, LEVELS[0], LEVELS[1] - 0.3),
        (LEVELS[1], LEVELS[2], LEVELS[3] - 0.02),
    ];
    for (storey, (foot, spring, top)) in storeys.into_iter().enumerate() {
        let column = stage.solid(
            "column",
            column(spring - foot, 0.19 - 0.03 * storey as f32, 10 - 2 * storey),
            paints.stone,
        );
        let span = BAY - 0.42;
        // Neighbours overlap by a hair instead of sharing a face.
        let arch = arch_block(
            span,
            BAY + 0.004,
            spring,
            top - spring - span / 2.0,
            0.41 - 0.04 * storey as f32,
        );
        let arch = stage.solid("arch", arch, paints.plaster);
        for i in 0..count {
            let x = i as f32 * BAY - half_size()[along];
            // The last column of a side is the first of the next.
            let at = turn.transform_point3(vec3(x, foot, back));
            stage.place("column", column, None, standing(at, yaw));
            let at = turn.transform_point3(vec3(x + BAY / 2.0, 0.0, back));
            stage.place("arch", arch, None, standing(at, yaw));
        }
    }
    let rail = balustrade();
    let rail = stage.solid("balustrade", rail, paints.stone);
    for i in 0..count {
        let x = (i as f32 + 0.5) * BAY - half_size()[along];
        let at = turn.transform_point3(vec3(x, LEVELS[1], back));
        stage.place("balustrade", rail, None, standing(at, yaw));
    }
}

/// A column with base and capital that ends at `height` with a square plate.
fn column(height: f32, radius: f32, sides: usize) -> Surface {
    let r = radius;
    let profile = [
        vec2(0.0, 0.05),
        vec2(r * 1.35, 0.05),
        vec2(r * 1.4, 0.22),
        vec2(r * 1.05, 0.30),
        vec2(r, 0.5),
        vec2(r * 0.86, height - 0.36),
        vec2(r * 1.0, height - 0.32),
        vec2(r * 1.3, height - 0.1),
        vec2(0.0, height - 0.1),
    ];
    let plate =
        |low: f32, high: f32, half: f32| cuboid(vec3(-half, low, -half), vec3(half, high, half), [1, 1, 1]);
    Surface::joined([
        lathe(&profile, sides),
        plate(-0.05, 0.12, r * 1.5),
        plate(height - 0.14, height + 0.03, r * 1.45),
    ])
}

/// Rail, plinth and balusters of one bay, centred, standing on y = 0.
fn balustrade() -> Surface {
    let half = BAY / 2.0 - 0.1;
    let profile = [
        vec2(0.0, 0.06),
        vec2(0.05, 0.06),
        vec2(0.085, 0.28),
        vec2(0.04, 0.52),
        vec2(0.06, 0.76),
        vec2(0.0, 0.76),
    ];
    let mut rail = Surface::joined([
        cuboid(vec3(-half, -0.05, -0.11), vec3(half, 0.08, 0.11), [2, 1, 1]),
        cuboid(vec3(-half, 0.74, -0.13), vec3(half, 0.88, 0.13), [2, 1, 1]),
    ]);
    for i in 0..3 {
        rail.join(&lathe(&profile, 6).at(vec3((i as f32 - 1.0) * 0.6, 0.0, 0.0)));
    }
    rail
}

/// A round basin with an upper bowl and a hare on top.
fn fountain(stage: &mut Stage, paints: &Paints) {
    let basin = [
        vec2(0.0, -0.05),
        vec2(2.0, -0.05),
        vec2(2.0, 0.16),
        vec2(1.85, 0.2),
        vec2(1.8, 0.5),
        vec2(1.95, 0.58),
        vec2(1.95, 0.68),
        vec2(1.6, 0.68),
        vec2(1.6, 0.2),
        vec2(0.0, 0.2),
    ];
    let bowl = [
        vec2(0.0, 0.1),
        vec2(0.42, 0.1),
        vec2(0.36, 0.62),
        vec2(0.16, 0.78),
        vec2(0.14, 1.2),
        vec2(0.22, 1.34),
        vec2(0.6, 1.46),
        vec2(0.88, 1.66),
        vec2(0.92, 1.76),
        vec2(0.82, 1.76),
        vec2(0.5, 1.58),
        vec2(0.2, 1.54),
        vec2(0.18, 1.9),
        vec2(0.3, 1.96),
        vec2(0.3, 2.04),
        vec2(0.0, 2.04),
    ];
    let pool = |radius: f32, low: f32, high: f32| {
        lathe(
            &[
                vec2(0.0, low),
                vec2(radius, low),
                vec2(radius, high),
                vec2(0.0, high),
            ],
            24,
        )
    };
    stage.show("basin", lathe(&basin, 24), paints.stone);
    stage.show("bowl", lathe(&bowl, 18), paints.stone);
    stage.show(
        "water",
        Surface::joined([pool(1.65, 0.1, 0.56), pool(0.8, 1.5, 1.7)]),
        paints.water,
    );
    let statue = stage.mesh("hare", vec![hare(7).into_smooth_primitive(paints.bronze)]);
    stage.place("hare", statue, None, placed(vec3(0.0, 2.03, 0.0), -0.8, 0.95));
}

/// Benches, vases with shrubs and trimmed trees.
fn furniture(stage: &mut Stage, paints: &Paints) {
    let seat = rounded_cuboid(vec3(-0.9, 0.4, -0.24), vec3(0.9, 0.48, 0.24), 0.03, 1, [3, 1, 1]);
    let leg = |x: f32| cuboid(vec3(x - 0.08, -0.03, -0.2), vec3(x + 0.08, 0.42, 0.2), [1, 2, 2]);
    let bench = stage.solid(
        "bench",
        Surface::joined([seat, leg(-0.62), leg(0.62)]),
        paints.wood,
    );
    for (x, z, yaw) in [
        (0.0, -4.6, 0.0),
        (0.0, 4.6, PI),
        (4.9, 0.0, FRAC_PI_2),
        (-4.9, 0.0, FRAC_PI_2),
    ] {
        stage.place("bench", bench, None, standing(vec3(x, 0.0, z), yaw));
    }
    let profile = [
        vec2(0.0, -0.03),
        vec2(0.26, -0.03),
        vec2(0.26, 0.06),
        vec2(0.17, 0.12),
        vec2(0.30, 0.34),
        vec2(0.38, 0.58),
        vec2(0.34, 0.78),
        vec2(0.27, 0.86),
        vec2(0.36, 0.96),
        vec2(0.30, 0.96),
        vec2(0.24, 0.86),
        vec2(0.0, 0.84),
    ];
    let vase = stage.solid("vase", lathe(&profile, 10), paints.clay);
    let shrub = super::shapes::geosphere(4).warped(|p| {
        let swell = 1.0 + 0.22 * super::random::fractal_noise(p * 2.6, 2, 5);
        vec3(p.x * 0.42, p.y * 0.46, p.z * 0.42) * swell + vec3(0.0, 1.22, 0.0)
    });
    let shrub = stage.mesh("shrub", vec![shrub.into_smooth_primitive(paints.leaf)]);
    let corners = [
        vec3(6.6, 0.0, 4.4),
        vec3(-6.6, 0.0, -4.4),
        vec3(6.6, 0.0, -4.4),
        vec3(-3.2, 0.0, -4.6),
    ];
    for (i, at) in corners.into_iter().enumerate() {
        stage.place("vase", vase, None, standing(at, 0.0));
        stage.place("shrub", shrub, None, standing(at, i as f32));
    }
}

/// One walks across the court in four seconds, one waits by the fountain.
fn people(stage: &mut Stage) {
    let mut clothes = Clothes {
        skin: stage.matte("skin", [0.62, 0.36, 0.25], 0.6),
        hair: stage.matte("hair", [0.06, 0.04, 0.03], 0.5),
        shirt: stage.matte("red cloth", [0.55, 0.08, 0.06], 0.9),
        trousers: stage.matte("grey cloth", [0.14, 0.14, 0.16], 0.9),
        shoes: stage.matte("leather", [0.10, 0.05, 0.03], 0.5),
    };
    let waiting = figure(stage, "waiting", clothes, standing(vec3(2.7, 0.0, 1.0), -1.9));
    waiting.bend_arms(stage, [(0.35, 1.5), (0.35, 1.45)]);
    clothes.shirt = stage.matte("blue cloth", [0.07, 0.16, 0.42], 0.9);
    let (from, yaw, cycles) = (vec3(-4.5, 0.0, -2.7), 0.55, 4);
    let walking = figure(stage, "walking", clothes, standing(from, yaw));
    let animation = stage.animation("walk");
    walking.walk(stage, animation, 1.0, cycles, 0.0);
    let way = Quat::from_rotation_y(yaw) * Vec3::Z * STRIDE * cycles as f32;
    stage.slide(
        animation,
        walking.root,
        vec![0.0, cycles as f32],
        vec![from, from + way],
    );
}
