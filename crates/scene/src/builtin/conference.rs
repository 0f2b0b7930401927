//! `conference`: a room with a long table and thirty upholstered chairs; the stand-in for the Conference of HM08
//! Table 1 (282k triangles, from whole walls down to the wheels of a chair).
//!
//! Every part is a closed solid. The room spans 13 m by 7.4 m by 3.2 m, the table lies along X.

use std::f32::consts::{FRAC_PI_2, PI, TAU};

use glam::{Quat, Vec3, dvec3, vec2, vec3};

use super::shapes::{Surface, cuboid, geosphere, lathe, plank, rounded_cuboid, smooth_path, tube};
use super::stage::{Stage, standing};
use crate::{Material, Scene};

/// Half of the room's length, width and its height.
const ROOM: Vec3 = vec3(6.5, 3.2, 3.7);
/// Half of the table's length and width, and its height.
const TABLE: Vec3 = vec3(4.4, 0.74, 0.95);

/// The whole scene.
pub(super) fn conference() -> Scene {
    let mut stage = Stage::new("conference");
    room(&mut stage);
    panels(&mut stage);
    table(&mut stage);
    chairs(&mut stage);
    lamps(&mut stage);
    things_on_the_table(&mut stage);
    let middle = dvec3(0.0, 0.74, 0.0);
    stage.camera("corner", dvec3(-5.9, 2.3, 3.1), dvec3(0.2, 0.55, -0.5), 52.0);
    stage.camera("seat", dvec3(3.4, 1.35, 1.9), dvec3(-1.5, 0.85, -0.7), 55.0);
    // The key light is close below a panel, which keeps it off the ceiling.
    stage.lamp("key", dvec3(-1.2, 2.78, 0.3), middle, 0.9, [1.0, 0.95, 0.86]);
    stage.lamp(
        "bounce",
        dvec3(-2.2, 1.7, 2.5),
        dvec3(0.0, 1.2, 0.0),
        0.2,
        [0.9, 0.94, 1.0],
    );
    stage.lamp(
        "far bounce",
        dvec3(4.2, 1.9, 2.3),
        dvec3(4.2, 1.2, 0.0),
        0.2,
        [0.9, 0.94, 1.0],
    );
    stage.scene
}

/// Walls as slabs around the room: two triangles a face.
fn room(stage: &mut Stage) {
    let carpet = stage.matte("carpet", [0.30, 0.10, 0.09], 1.0);
    let plaster = stage.matte("plaster", [0.74, 0.70, 0.62], 0.9);
    let white = stage.matte("ceiling", [0.80, 0.78, 0.74], 0.9);
    let (x, y, z) = (ROOM.x, ROOM.y, ROOM.z);
    let slab = |low: Vec3, high: Vec3| cuboid(low, high, [1, 1, 1]);
    stage.show(
        "floor",
        slab(vec3(-x - 0.2, -0.2, -z - 0.2), vec3(x + 0.2, 0.0, z + 0.2)),
        carpet,
    );
    stage.show(
        "ceiling",
        slab(vec3(-x - 0.2, y, -z - 0.2), vec3(x + 0.2, y + 0.2, z + 0.2)),
        white,
    );
    let walls = Surface::joined([
        slab(vec3(-x - 0.2, -0.1, -z - 0.2), vec3(-x, y + 0.1, z + 0.2)),
        slab(vec3(x, -0.1, -z - 0.2), vec3(x + 0.2, y + 0.1, z + 0.2)),
        slab(vec3(-x - 0.1, -0.1, -z - 0.2), vec3(x + 0.1, y + 0.1, -z)),
        slab(vec3(-x - 0.1, -0.1, z), vec3(x + 0.1, y + 0.1, z + 0.2)),
    ]);
    stage.show("walls", walls, plaster);
    let screen = stage.matte("screen", [0.85, 0.86, 0.87], 0.8);
    let dark = stage.matte("screen frame", [0.05, 0.05, 0.06], 0.4);
    let frame = rounded_cuboid(
        vec3(x - 0.1, 1.0, -1.55),
        vec3(x + 0.1, 2.75, 1.55),
        0.03,
        3,
        [1, 6, 10],
    );
    stage.show("screen frame", frame, dark);
    stage.show(
        "screen",
        slab(vec3(x - 0.11, 1.08, -1.47), vec3(x, 2.67, 1.47)),
        screen,
    );
}

/// Bevelled wooden panels between pilasters along the three other walls.
fn panels(stage: &mut Stage) {
    let walnut = stage.matte("walnut", [0.32, 0.17, 0.085], 0.5);
    let maple = stage.matte("maple", [0.56, 0.38, 0.21], 0.5);
    let panel = rounded_cuboid(vec3(-0.5, 0.16, -0.02), vec3(0.5, 1.0, 0.045), 0.03, 2, [2, 2, 1]);
    let upper = rounded_cuboid(vec3(-0.5, 1.14, -0.02), vec3(0.5, 2.6, 0.045), 0.03, 2, [2, 3, 1]);
    let lower = stage.solid("lower panel", panel, walnut);
    let upper = stage.solid("upper panel", upper, maple);
    let pilaster = rounded_cuboid(
        vec3(-0.06, -0.02, -0.02),
        vec3(0.06, 2.9, 0.09),
        0.02,
        1,
        [1, 4, 1],
    );
    let pilaster = stage.solid("pilaster", pilaster, walnut);
    let row = |stage: &mut Stage, from: Vec3, along: Vec3, count: usize, yaw: f32| {
        for i in 0..count {
            let at = from + along * (i as f32 + 0.5);
            stage.place("lower panel", lower, None, standing(at, yaw));
            stage.place("upper panel", upper, None, standing(at, yaw));
            stage.place("pilaster", pilaster, None, standing(from + along * i as f32, yaw));
        }
    };
    let step = 2.0 * ROOM.x / 11.0;
    row(stage, vec3(-ROOM.x, 0.0, -ROOM.z), Vec3::X * step, 11, 0.0);
    row(stage, vec3(ROOM.x, 0.0, ROOM.z), Vec3::NEG_X * step, 11, PI);
    let step = 2.0 * ROOM.z / 6.0;
    row(
        stage,
        vec3(-ROOM.x, 0.0, ROOM.z),
        Vec3::NEG_Z * step,
        6,
        FRAC_PI_2,
    );
    let cornice = stage.matte("cornice", [0.70, 0.66, 0.58], 0.8);
    let (x, z) = (ROOM.x, ROOM.z);
    for side in [-1.0, 1.0] {
        let path = [
            vec3(-x, 3.06, side * (z - 0.05)),
            vec3(x, 3.06, side * (z - 0.05)),
        ];
        stage.show("cornice", plank(&path, 0.09, 0.07, Vec3::Y), cornice);
    }
}

/// The half width of the table top at a place along its length: a barrel shape.
fn barrel(x: f32) -> f32 {
    TABLE.z * (1.0 - 0.28 * (x / TABLE.x).powi(2))
}

fn table(stage: &mut Stage) {
    let wood = stage.matte("table top", [0.42, 0.21, 0.09], 0.25);
    let dark = stage.matte("table leg", [0.10, 0.055, 0.03], 0.5);
    let half = vec3(TABLE.x, 0.03, 1.0);
    let top = rounded_cuboid(-half, half, 0.028, 4, [64, 1, 16])
        .warped(|p| vec3(p.x, p.y + TABLE.y - 0.03, p.z * barrel(p.x)));
    stage.show("table top", top, wood);
    for x in [-3.0, 0.0, 3.0] {
        let leg = rounded_cuboid(
            vec3(x - 0.5, -0.02, -0.3),
            vec3(x + 0.5, 0.7, 0.3),
            0.06,
            4,
            [6, 6, 4],
        );
        stage.show("table leg", leg, dark);
    }
}

/// Twelve chairs on each long side, one at each end, four along the wall.
fn chairs(stage: &mut Stage) {
    let leather = stage.matte("leather", [0.07, 0.12, 0.20], 0.45);
    let chrome = stage.metal("chrome", [0.75, 0.76, 0.78], 0.25);
    let rubber = stage.matte("rubber", [0.03, 0.03, 0.03], 0.7);
    let arm_wood = stage.matte("arm", [0.38, 0.20, 0.10], 0.4);
    let [cushions, arms, base, wheels] = chair();
    let chair = stage.mesh(
        "chair",
        vec![
            cushions.into_primitive(60.0, leather),
            arms.into_primitive(60.0, arm_wood),
            base.into_primitive(50.0, chrome),
            wheels.into_primitive(60.0, rubber),
        ],
    );
    let mut place = |at: Vec3, yaw: f32| stage.place("chair", chair, None, standing(at, yaw));
    for i in 0..12 {
        let x = (i as f32 - 5.5) * 0.71;
        for side in [-1.0, 1.0] {
            let stray = ((i * 7 + if side > 0.0 { 3 } else { 0 }) % 5) as f32 - 2.0;
            let at = vec3(x, 0.0, side * (barrel(x) + 0.36 + 0.025 * stray.abs()));
            // Chairs look along +Z at yaw 0 and turn towards the table.
            place(at, if side > 0.0 { PI } else { 0.0 } + 0.06 * stray);
        }
    }
    place(vec3(-TABLE.x - 0.45, 0.0, 0.0), FRAC_PI_2 + 0.1);
    place(vec3(TABLE.x + 0.45, 0.0, 0.1), -FRAC_PI_2);
    for i in 0..4 {
        place(vec3((i as f32 - 1.5) * 2.2, 0.0, -ROOM.z + 0.55), 0.04 * i as f32);
    }
}

/// Cushions, arms, base and wheels of a chair that looks along +Z.
fn chair() -> [Surface; 4] {
    let seat = rounded_cuboid(
        vec3(-0.26, 0.40, -0.25),
        vec3(0.26, 0.51, 0.27),
        0.05,
        3,
        [12, 1, 12],
    );
    let seat = seat.warped(|p| {
        let quilt = (p.x / 0.26 * PI * 1.5).cos().abs() * (p.z / 0.27 * PI * 1.5).cos().abs();
        let front = (p.z - 0.1).max(0.0);
        vec3(
            p.x,
            p.y + if p.y > 0.46 { 0.018 * quilt } else { 0.0 } - 0.9 * front * front,
            p.z,
        )
    });
    let back = rounded_cuboid(
        vec3(-0.25, 0.56, -0.05),
        vec3(0.25, 1.12, 0.04),
        0.04,
        3,
        [10, 10, 1],
    );
    let back = back.warped(|p| {
        let share = (p.y - 0.56) / 0.56;
        let narrow = 1.0 - 0.16 * share * share;
        let quilt = if p.z > 0.01 {
            0.012 * (p.x / 0.25 * PI * 1.5).cos().abs()
        } else {
            0.0
        };
        let curl = 1.2 * p.x * p.x - 0.16 * share - 0.05 * (share * PI).sin();
        vec3(p.x * narrow, p.y, p.z + quilt + curl - 0.22)
    });
    let profile = [
        vec2(0.0, 0.09),
        vec2(0.05, 0.09),
        vec2(0.055, 0.14),
        vec2(0.03, 0.17),
        vec2(0.028, 0.30),
        vec2(0.045, 0.32),
        vec2(0.05, 0.37),
        vec2(0.14, 0.39),
        vec2(0.14, 0.42),
        vec2(0.0, 0.42),
    ];
    let spine = smooth_path(
        &[
            vec3(0.0, 0.41, -0.1),
            vec3(0.0, 0.42, -0.29),
            vec3(0.0, 0.62, -0.27),
        ],
        6,
    );
    let mut base = Surface::joined([lathe(&profile, 20), tube(&spine, &[0.022; 13], 10)]);
    let mut wheels = Surface::default();
    for i in 0..5 {
        let turn = Quat::from_rotation_y(i as f32 / 5.0 * TAU + 0.3);
        let path: Vec<Vec3> = (0..=5)
            .map(|k| {
                let share = k as f32 / 5.0;
                turn * vec3(0.02 + 0.29 * share, 0.115 - 0.04 * share * share, 0.0)
            })
            .collect();
        base.join(&tube(&path, &[0.026, 0.025, 0.023, 0.021, 0.018, 0.015], 8));
        wheels.join(&geosphere(2).warped(|p| turn * (p * vec3(0.032, 0.032, 0.02) + vec3(0.30, 0.031, 0.0))));
    }
    [Surface::joined([seat, back]), arms(), base, wheels]
}

/// Both arms of a chair.
fn arms() -> Surface {
    Surface::joined([-1.0, 1.0].map(|side| {
        let knots = [
            vec3(side * 0.22, 0.45, 0.14),
            vec3(side * 0.30, 0.46, 0.16),
            vec3(side * 0.315, 0.58, 0.17),
            vec3(side * 0.315, 0.685, 0.12),
            vec3(side * 0.315, 0.70, -0.06),
            vec3(side * 0.30, 0.69, -0.22),
            vec3(side * 0.22, 0.70, -0.27),
        ];
        let path = smooth_path(&knots, 5);
        let radii: Vec<f32> = path
            .iter()
            .map(|p| if p.y > 0.66 { 0.025 } else { 0.019 })
            .collect();
        tube(&path, &radii, 8)
    }))
}

/// A long lamp panel and six bowls hanging in a row.
fn lamps(stage: &mut Stage) {
    let brass = stage.metal("brass", [0.72, 0.56, 0.28], 0.3);
    let glow = stage.material(Material {
        name: "lamp".into(),
        emissive: vec3(0.95, 0.88, 0.75),
        ..Material::default()
    });
    let panel = rounded_cuboid(vec3(-4.0, 2.84, -0.9), vec3(4.0, 2.94, 0.9), 0.04, 3, [16, 1, 4]);
    stage.show("lamp panel", panel, glow);
    let mut rods = Surface::default();
    for (x, z) in [(-3.6, -0.7), (-3.6, 0.7), (3.6, -0.7), (3.6, 0.7)] {
        rods.join(&tube(&[vec3(x, 2.9, z), vec3(x, 3.3, z)], &[0.012, 0.012], 10));
    }
    stage.show("rods", rods, brass);
    let shade: Vec<_> = [
        (0.0, 0.0),
        (0.10, 0.01),
        (0.17, 0.05),
        (0.21, 0.12),
        (0.215, 0.13),
        (0.205, 0.13),
        (0.16, 0.075),
        (0.09, 0.04),
        (0.0, 0.035),
    ]
    .map(|(r, y)| vec2(r, y))
    .to_vec();
    let shade = stage.solid("shade", lathe(&shade, 36), brass);
    let bulb = stage.solid("bulb", geosphere(6).warped(|p| p * 0.06 + Vec3::Y * 0.1), glow);
    let cord = tube(&[vec3(0.0, 0.1, 0.0), vec3(0.0, 0.52, 0.0)], &[0.006, 0.006], 8);
    let cord = stage.solid("cord", cord, brass);
    for i in 0..6 {
        let at = vec3((i as f32 - 2.5) * 1.3, 2.36, 0.0);
        for (name, mesh) in [("shade", shade), ("bulb", bulb), ("cord", cord)] {
            stage.place(name, mesh, None, standing(at, 0.0));
        }
    }
}

/// Cups, notepads with pencils, two jugs and a telephone-like conference speaker.
fn things_on_the_table(stage: &mut Stage) {
    let china = stage.matte("china", [0.82, 0.81, 0.77], 0.25);
    let paper = stage.matte("paper", [0.85, 0.83, 0.74], 0.9);
    let yellow = stage.matte("pencil", [0.75, 0.50, 0.06], 0.5);
    let steel = stage.metal("steel", [0.66, 0.68, 0.70], 0.3);
    let dark = stage.matte("dark plastic", [0.05, 0.05, 0.055], 0.4);
    let outline = |points: &[(f32, f32)]| points.iter().map(|&(r, y)| vec2(r, y)).collect::<Vec<_>>();
    let cup = outline(&[
        (0.0, -0.002),
        (0.024, -0.002),
        (0.026, 0.008),
        (0.036, 0.03),
        (0.041, 0.075),
        (0.038, 0.075),
        (0.032, 0.03),
        (0.0, 0.012),
    ]);
    let handle: Vec<Vec3> = (0..=10)
        .map(|i| {
            let (sin, cos) = (i as f32 / 10.0 * PI - FRAC_PI_2).sin_cos();
            vec3(0.034 + 0.024 * cos, 0.042 + 0.02 * sin, 0.0)
        })
        .collect();
    let cup = Surface::joined([lathe(&cup, 24), tube(&handle, &[0.004; 11], 8)]);
    let cup = stage.solid("cup", cup, china);
    let pad = rounded_cuboid(
        vec3(-0.105, -0.002, -0.15),
        vec3(0.105, 0.012, 0.15),
        0.003,
        2,
        [4, 1, 6],
    );
    let pad = stage.solid("notepad", pad, paper);
    let pencil = tube(
        &[
            vec3(-0.08, 0.015, 0.02),
            vec3(0.08, 0.015, 0.05),
            vec3(0.1, 0.015, 0.054),
        ],
        &[0.004, 0.004, 0.0005],
        6,
    );
    let pencil = stage.solid("pencil", pencil, yellow);
    for i in 0..12 {
        let x = (i as f32 - 5.5) * 0.71;
        for side in [-1.0, 1.0] {
            let at = vec3(x, TABLE.y, side * (barrel(x) - 0.24));
            let yaw = 0.1 * ((i * 5) % 7) as f32 - 0.3;
            stage.place("notepad", pad, None, standing(at, yaw));
            stage.place("pencil", pencil, None, standing(at, yaw));
            if (i + usize::from(side > 0.0)) % 2 == 0 {
                let beside = at + vec3(0.22, 0.0, -0.06 * side);
                stage.place("cup", cup, None, standing(beside, i as f32));
            }
        }
    }
    let jug = outline(&[
        (0.0, -0.003),
        (0.06, -0.003),
        (0.075, 0.02),
        (0.08, 0.09),
        (0.05, 0.17),
        (0.045, 0.23),
        (0.055, 0.26),
        (0.03, 0.28),
        (0.0, 0.30),
    ]);
    let jug = stage.solid("jug", lathe(&jug, 32), steel);
    for x in [-1.6, 1.9] {
        stage.place("jug", jug, None, standing(vec3(x, TABLE.y, 0.1), 0.0));
    }
    let speaker = geosphere(10).warped(|p| {
        let arm = 1.0 + 0.25 * (3.0 * p.z.atan2(p.x)).cos() * (1.0 - p.y.abs());
        vec3(p.x * 0.15 * arm, (p.y * 0.05).max(-0.01), p.z * 0.15 * arm)
    });
    stage.show("speaker", speaker.at(vec3(0.1, TABLE.y + 0.008, 0.0)), dark);
}
