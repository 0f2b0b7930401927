//! `office`: a room of a few desks, chairs and cabinets in about a thousand large triangles; the stand-in for ERW6 of
//! HM08 Table 1.
//!
//! Everything is a closed box: the walls are slabs around the room, with openings for the windows and the door. The
//! room spans 8 m by 6 m by 2.8 m; the lamp hangs from the ceiling.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Affine3A, Quat, Vec3, dvec3, vec3};

use super::shapes::{Surface, cuboid};
use super::stage::{Stage, standing};
use crate::{Material, Scene};

/// The whole scene.
pub(super) fn office() -> Scene {
    let mut stage = Stage::new("office");
    room(&mut stage);
    windows_and_door(&mut stage);
    workplaces(&mut stage);
    cabinets(&mut stage);
    small_things(&mut stage);
    stage.camera("door", dvec3(-3.5, 1.7, 2.6), dvec3(0.75, 0.9, -0.9), 56.0);
    stage.camera("window", dvec3(3.6, 1.9, -2.5), dvec3(-1.2, 0.7, 0.9), 60.0);
    // The key light is close below its panel, which keeps it off the ceiling.
    let desk = dvec3(0.0, 0.75, -0.5);
    stage.lamp("lamp", dvec3(0.3, 2.42, 0.25), desk, 1.1, [1.0, 0.96, 0.88]);
    stage.lamp(
        "bounce",
        dvec3(-1.2, 1.25, 1.0),
        dvec3(0.0, 0.8, 0.0),
        0.3,
        [0.85, 0.92, 1.0],
    );
    stage.scene
}

/// A box of the fewest triangles.
fn block(low: [f32; 3], high: [f32; 3]) -> Surface {
    cuboid(low.into(), high.into(), [1, 1, 1])
}

fn room(stage: &mut Stage) {
    let carpet = stage.matte("carpet", [0.22, 0.27, 0.33], 1.0);
    let white = stage.matte("ceiling", [0.80, 0.79, 0.76], 0.9);
    let wall = stage.matte("wall", [0.70, 0.68, 0.60], 0.9);
    stage.show("floor", block([-4.2, -0.2, -3.2], [4.2, 0.0, 3.2]), carpet);
    stage.show("ceiling", block([-4.2, 2.8, -3.2], [4.2, 3.0, 3.2]), white);
    // Slabs reach into each other instead of sharing edges, so that each stays closed by itself.
    let mut walls = Surface::joined([
        // Left wall, with a door between 0.4 and 1.4.
        block([-4.2, -0.1, -3.2], [-4.0, 2.9, 0.4]),
        block([-4.2, -0.1, 1.4], [-4.0, 2.9, 3.2]),
        block([-4.19, 2.1, 0.38], [-4.0, 2.88, 1.42]),
        block([4.0, -0.1, -3.2], [4.2, 2.9, 3.2]),
        block([-4.1, -0.1, 3.0], [4.1, 2.9, 3.19]),
        // Window wall: below, above and between two windows.
        block([-4.1, -0.1, -3.19], [4.1, 0.9, -3.0]),
        block([-4.1, 2.3, -3.19], [4.1, 2.9, -3.0]),
    ]);
    for (left, right) in [(-4.05, -3.1), (-0.5, 0.5), (3.1, 4.05)] {
        walls.join(&block([left, 0.88, -3.18], [right, 2.32, -3.0]));
    }
    stage.show("walls", walls, wall);
    let glow = stage.material(Material {
        name: "lamp".into(),
        emissive: Vec3::splat(0.95),
        ..Material::default()
    });
    stage.show("lamp", block([-0.4, 2.45, -0.1], [1.0, 2.5, 0.6]), glow);
    let cord = stage.matte("cord", [0.05, 0.05, 0.05], 0.6);
    stage.show("cord", block([0.29, 2.48, 0.24], [0.31, 2.85, 0.26]), cord);
}

fn windows_and_door(stage: &mut Stage) {
    let frame = stage.matte("window frame", [0.75, 0.74, 0.70], 0.6);
    let sky = stage.material(Material {
        name: "window pane".into(),
        base_color: vec3(0.4, 0.55, 0.7).extend(1.0),
        emissive: vec3(0.42, 0.55, 0.72),
        roughness: 0.1,
        ..Material::default()
    });
    let mut bars = Surface::default();
    let mut panes = Surface::default();
    for x in [-1.8, 1.8] {
        panes.join(&block([x - 1.32, 0.88, -3.13], [x + 1.32, 2.32, -3.10]));
        bars.join(&block([x - 0.03, 0.9, -3.15], [x + 0.03, 2.3, -3.04]));
        bars.join(&block([x - 1.3, 1.75, -3.15], [x + 1.3, 1.81, -3.04]));
    }
    stage.show("window frames", bars, frame);
    stage.show("window panes", panes, sky);
    let wood = stage.matte("door", [0.42, 0.25, 0.13], 0.6);
    let brass = stage.metal("handle", [0.75, 0.60, 0.32], 0.35);
    stage.show("door", block([-4.14, 0.01, 0.4], [-4.06, 2.1, 1.4]), wood);
    stage.show("handle", block([-4.07, 1.0, 0.48], [-4.0, 1.04, 0.62]), brass);
}

/// Three desks, each with a chair, drawers, a screen and a keyboard.
fn workplaces(stage: &mut Stage) {
    let beech = stage.matte("beech", [0.62, 0.44, 0.26], 0.6);
    let grey = stage.matte("grey steel", [0.32, 0.33, 0.35], 0.5);
    let dark = stage.matte("dark plastic", [0.05, 0.05, 0.06], 0.4);
    let blue = stage.matte("blue cloth", [0.08, 0.16, 0.36], 0.9);
    let desk = Surface::joined([
        block([-0.8, 0.71, -0.4], [0.8, 0.75, 0.4]),
        block([-0.78, -0.01, -0.38], [-0.74, 0.72, 0.38]),
        block([0.74, -0.01, -0.38], [0.78, 0.72, 0.38]),
        block([-0.75, 0.3, -0.36], [0.75, 0.72, -0.33]),
    ]);
    let drawers = Surface::joined([
        block([0.34, 0.05, -0.3], [0.72, 0.72, 0.34]),
        block([0.37, 0.38, 0.33], [0.69, 0.69, 0.36]),
    ]);
    let screen = Surface::joined([
        block([-0.3, 0.86, -0.2], [0.3, 1.22, -0.16]),
        block([-0.03, 0.75, -0.22], [0.03, 1.0, -0.19]),
        block([-0.24, 0.745, 0.08], [0.24, 0.775, 0.24]),
    ]);
    let seat = Surface::joined([
        block([-0.24, 0.42, -0.22], [0.24, 0.5, 0.24]),
        block([-0.23, 0.49, 0.2], [0.23, 1.0, 0.26]),
    ]);
    let stand = Surface::joined([
        block([-0.025, 0.05, -0.025], [0.025, 0.43, 0.025]),
        block([-0.3, 0.0, -0.03], [0.3, 0.06, 0.03]),
        block([-0.03, 0.0, -0.3], [0.03, 0.055, 0.3]),
    ]);
    let part = |surface: &Surface, material| surface.clone().into_primitive(0.0, material);
    let desk = stage.mesh(
        "desk",
        vec![part(&desk, beech), part(&drawers, grey), part(&screen, dark)],
    );
    let chair = stage.mesh("chair", vec![part(&seat, blue), part(&stand, grey)]);
    // Yaw 0 faces +Z; the chair stands on that side of its desk.
    for (x, z, yaw, turn) in [
        (-1.2, -0.9, 0.0, 0.5),
        (-1.2, -1.75, PI, -0.3),
        (1.6, -1.2, 0.0, -0.4),
    ] {
        let at = vec3(x, 0.0, z);
        stage.place("desk", desk, None, standing(at, yaw));
        let seat = at + Quat::from_rotation_y(yaw) * vec3(-0.1, 0.0, 0.72);
        stage.place("chair", chair, None, standing(seat, yaw + turn));
    }
}

/// Cabinets along the right and rear wall, a shelf with books, a side table.
fn cabinets(stage: &mut Stage) {
    let oak = stage.matte("oak", [0.46, 0.30, 0.17], 0.6);
    let grey = stage.matte("filing cabinet", [0.48, 0.50, 0.46], 0.5);
    let cabinet = Surface::joined([
        block([-0.5, 0.0, -0.25], [0.5, 1.9, 0.22]),
        block([-0.485, 0.06, 0.2], [-0.01, 1.86, 0.24]),
        block([0.01, 0.06, 0.2], [0.485, 1.86, 0.24]),
    ]);
    let cabinet = stage.solid("cabinet", cabinet, oak);
    for z in [0.2, 1.25] {
        stage.place("cabinet", cabinet, None, standing(vec3(3.73, 0.0, z), -FRAC_PI_2));
    }
    let mut filing = block([-0.25, 0.0, -0.3], [0.25, 1.3, 0.28]);
    for i in 0..3 {
        let low = 0.04 + i as f32 * 0.415;
        filing.join(&block([-0.23, low, 0.26], [0.23, low + 0.395, 0.3]));
    }
    let filing = stage.solid("filing cabinet", filing, grey);
    stage.place(
        "filing cabinet",
        filing,
        None,
        standing(vec3(2.75, 0.0, 2.66), PI),
    );
    let board = stage.matte("board", [0.82, 0.83, 0.82], 0.3);
    stage.show("board", block([0.0, 1.0, 2.95], [2.2, 2.1, 3.01]), board);
}

/// Books on a wall shelf, a bin, paper and a rug.
fn small_things(stage: &mut Stage) {
    let oak = stage.matte("shelf", [0.50, 0.33, 0.19], 0.6);
    stage.show("shelf", block([3.7, 1.45, -2.4], [4.01, 1.48, -0.5]), oak);
    let colors = [[0.50, 0.08, 0.06], [0.08, 0.20, 0.38], [0.52, 0.42, 0.10]];
    let mut books = [Surface::default(), Surface::default(), Surface::default()];
    for i in 0..6 {
        let z = -2.3 + i as f32 * 0.08 + if i > 3 { 0.4 } else { 0.0 };
        let height = 0.24 + 0.05 * ((i * 5) % 3) as f32;
        books[i % 3].join(&block([3.74, 1.475, z], [3.96, 1.475 + height, z + 0.07]));
    }
    for (book, color) in books.into_iter().zip(colors) {
        let paint = stage.matte("book", color, 0.7);
        stage.show("books", book, paint);
    }
    let bin = stage.matte("bin", [0.30, 0.09, 0.07], 0.7);
    stage.show(
        "bin",
        block([-0.15, 0.0, -0.55], [0.15, 0.38, -0.25]).at(vec3(0.35, 0.0, 0.0)),
        bin,
    );
    let paper = stage.matte("paper", [0.85, 0.84, 0.80], 0.9);
    let turned = Affine3A::from_rotation_translation(Quat::from_rotation_y(0.3), vec3(-1.75, 0.75, -0.75));
    stage.show(
        "paper",
        block([-0.1, -0.005, -0.15], [0.1, 0.012, 0.15]).moved(turned),
        paper,
    );
    let rug = stage.matte("rug", [0.40, 0.14, 0.10], 1.0);
    stage.show("rug", block([-2.6, -0.01, 0.7], [1.2, 0.015, 2.3]), rug);
}
