//! `teapot-mirror`: a teapot on a mirror plane between coloured balls, about 16k triangles.
//!
//! Body, lid, handle and spout are closed solids that overlap where they join. The mirror is a metal of
//! roughness 0. The teapot's outline is our own, after the proportions of the well-known one.

use glam::{Vec2, Vec3, dvec3, vec2, vec3};

use super::shapes::{Ends, Surface, bezier, cuboid, geosphere, lathe, loft, rings, smooth_path, tube};
use super::stage::{Stage, placed, standing};
use crate::Scene;

/// The whole scene.
pub(super) fn teapot_mirror() -> Scene {
    let mut stage = Stage::new("teapot-mirror");
    let glaze = stage.matte("glaze", [0.10, 0.32, 0.50], 0.15);
    let mirror = stage.metal("mirror", [0.92, 0.93, 0.93], 0.0);
    let frame = stage.matte("frame", [0.20, 0.11, 0.06], 0.5);
    let teapot = stage.solid("teapot", teapot(), glaze);
    stage.place("teapot", teapot, None, standing(vec3(0.0, -0.004, 0.0), 0.45));
    stage.show(
        "mirror",
        cuboid(vec3(-2.4, -0.06, -2.0), vec3(2.4, 0.0, 2.0), [1, 1, 1]),
        mirror,
    );
    let bars = Surface::joined([
        cuboid(vec3(-2.55, -0.1, -2.15), vec3(2.55, 0.05, -2.0), [12, 1, 1]),
        cuboid(vec3(-2.55, -0.1, 2.0), vec3(2.55, 0.05, 2.15), [12, 1, 1]),
        cuboid(vec3(-2.55, -0.1, -2.05), vec3(-2.4, 0.05, 2.05), [1, 1, 10]),
        cuboid(vec3(2.4, -0.1, -2.05), vec3(2.55, 0.05, 2.05), [1, 1, 10]),
    ]);
    stage.show("frame", bars, frame);
    let balls = [
        (vec3(-1.45, 0.0, 0.75), 0.22, [0.70, 0.16, 0.07]),
        (vec3(1.25, 0.0, 1.15), 0.16, [0.72, 0.52, 0.10]),
        (vec3(1.35, 0.0, -1.05), 0.30, [0.16, 0.42, 0.14]),
    ];
    for (at, radius, color) in balls {
        let paint = stage.matte("ball", color, 0.4);
        let ball = stage.solid("ball", geosphere(6), paint);
        stage.place(
            "ball",
            ball,
            None,
            placed(at + Vec3::Y * (radius - 0.003), 0.0, radius),
        );
    }
    let middle = dvec3(0.0, 0.5, 0.0);
    stage.camera("front", dvec3(0.6, 2.2, 4.6), dvec3(0.05, 0.42, 0.0), 36.0);
    stage.camera("low", dvec3(-3.6, 0.8, 2.6), dvec3(0.0, 0.35, 0.0), 36.0);
    stage.lamp("key", dvec3(-3.0, 5.5, 4.0), middle, 0.88, [1.0, 0.96, 0.9]);
    stage.lamp("fill", dvec3(4.5, 3.0, 3.0), middle, 0.22, [0.85, 0.92, 1.0]);
    stage.scene
}

/// A teapot about 1 m high with its spout along +X, standing on y = 0.
fn teapot() -> Surface {
    let outline: Vec<Vec2> = [vec2(0.0, 0.0), vec2(0.42, 0.0)]
        .into_iter()
        .chain(bezier(
            [
                vec2(0.48, 0.02),
                vec2(0.52, 0.10),
                vec2(0.68, 0.16),
                vec2(0.68, 0.36),
            ],
            12,
        ))
        .chain(
            bezier(
                [
                    vec2(0.68, 0.36),
                    vec2(0.68, 0.52),
                    vec2(0.58, 0.66),
                    vec2(0.49, 0.78),
                ],
                14,
            )
            .into_iter()
            .skip(1),
        )
        .chain([vec2(0.485, 0.805), vec2(0.47, 0.815), vec2(0.45, 0.80)])
        .chain(bezier(
            [
                vec2(0.46, 0.77),
                vec2(0.62, 0.55),
                vec2(0.66, 0.20),
                vec2(0.40, 0.06),
            ],
            10,
        ))
        .chain([vec2(0.0, 0.05)])
        .collect();
    let lid: Vec<Vec2> = [vec2(0.0, 0.74), vec2(0.43, 0.74)]
        .into_iter()
        .chain(bezier(
            [
                vec2(0.455, 0.80),
                vec2(0.40, 0.87),
                vec2(0.10, 0.88),
                vec2(0.07, 0.92),
            ],
            12,
        ))
        .chain(
            bezier(
                [
                    vec2(0.05, 0.95),
                    vec2(0.14, 0.99),
                    vec2(0.13, 1.07),
                    vec2(0.0, 1.08),
                ],
                8,
            )
            .into_iter()
            .skip(1),
        )
        .collect();
    let handle = smooth_path(
        &[
            vec3(-0.46, 0.70, 0.0),
            vec3(-0.70, 0.73, 0.0),
            vec3(-0.92, 0.69, 0.0),
            vec3(-0.98, 0.54, 0.0),
            vec3(-0.88, 0.36, 0.0),
            vec3(-0.62, 0.24, 0.0),
        ],
        9,
    );
    let thick: Vec<f32> = (0..handle.len()).map(|_| 0.06).collect();
    let handle = tube(&handle, &thick, 20).warped(|p| p * vec3(1.0, 1.0, 1.35));
    Surface::joined([lathe(&outline, 76), lathe(&lid, 72), handle, spout()])
}

/// A bent cone that narrows and flares to an open mouth with a short hollow.
fn spout() -> Surface {
    let knots = [
        vec3(0.50, 0.24, 0.0),
        vec3(0.74, 0.30, 0.0),
        vec3(0.88, 0.48, 0.0),
        vec3(0.98, 0.68, 0.0),
        vec3(1.12, 0.80, 0.0),
    ];
    let path = smooth_path(&knots, 8);
    let last = path.len() - 1;
    let radii: Vec<f32> = (0..=last)
        .map(|i| {
            let share = i as f32 / last as f32;
            0.20 - 0.145 * (share * 1.35).min(1.0).powf(0.8) + 0.03 * (share - 0.8).max(0.0) * 5.0
        })
        .collect();
    let inner: Vec<f32> = radii.iter().map(|r| r - 0.014).collect();
    let mut rows = rings(&path, &radii, 28);
    // Over the thin rim and back inside.
    rows.extend(rings(&path, &inner, 28).into_iter().rev().take(7));
    loft(&rows, Ends::Fans(path[0], path[last - 6]))
}
