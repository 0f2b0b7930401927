//! Plants of the forest: trees, grass tufts and mushrooms.
//!
//! Trunks, branches and mushrooms are closed; leaves and blades are single open triangles or pairs of them with
//! a double-sided material.

use std::f32::consts::TAU;

use glam::{Quat, Vec2, Vec3, vec2, vec3};

use super::random::Random;
use super::shapes::{Surface, lathe, smooth_path, tube};

/// Wood and leaves of a broad-leaved tree about `height` tall that stands on y = 0.
pub(super) fn tree(random: &mut Random, height: f32, branches: usize, leaves: usize) -> (Surface, Surface) {
    let bend = vec3(random.between(-0.06, 0.06), 0.0, random.between(-0.06, 0.06)) * height;
    let knots = [
        vec3(0.0, -0.3, 0.0),
        vec3(0.0, 0.25, 0.0),
        bend + Vec3::Y * height * 0.45,
        bend * 0.4 + Vec3::Y * height * 0.9,
    ];
    let trunk = smooth_path(&knots, 5);
    let thick = height * 0.036;
    let radii: Vec<f32> = (0..trunk.len())
        .map(|i| {
            let share = i as f32 / (trunk.len() - 1) as f32;
            thick * (1.0 - 0.9 * share) * (1.0 + 0.9 * (-share * 9.0).exp())
        })
        .collect();
    let mut wood = tube(&trunk, &radii, 12);
    let mut foliage = Surface::default();
    for i in 0..branches {
        let share = (i as f32 + random.unit()) / branches as f32;
        let turn = Quat::from_rotation_y(i as f32 * 2.4 + random.between(-0.4, 0.4));
        let spot = trunk[((0.42 + 0.5 * share) * (trunk.len() - 1) as f32) as usize];
        let reach = height * (0.34 - 0.2 * share) * random.between(0.85, 1.15);
        let rise = 0.35 + 0.6 * share;
        let tip = spot + turn * vec3(reach, reach * rise, 0.0);
        let path = smooth_path(
            &[
                spot,
                spot + turn * vec3(reach * 0.5, reach * rise * 0.3, 0.0),
                tip,
            ],
            3,
        );
        let radii: Vec<f32> = (0..path.len())
            .map(|k| thick * 0.32 * (1.0 - 0.13 * k as f32))
            .collect();
        wood.join(&tube(&path, &radii, 5));
        cluster(
            &mut foliage,
            random,
            spot.lerp(tip, 0.75),
            reach * 0.62,
            leaves / (branches + 1),
        );
    }
    cluster(
        &mut foliage,
        random,
        knots[3],
        height * 0.14,
        leaves - leaves / (branches + 1) * branches,
    );
    (wood, foliage)
}

/// Leaves on a flattened ball; each leaf is two triangles folded along its rib.
fn cluster(foliage: &mut Surface, random: &mut Random, centre: Vec3, radius: f32, leaves: usize) {
    for _ in 0..leaves {
        let out = direction(random);
        let distance = radius * (0.55 + 0.45 * random.unit());
        let base = centre + out * vec3(1.0, 0.72, 1.0) * distance;
        let size = random.between(0.13, 0.22);
        let rib = (out + direction(random) * 0.8 - Vec3::Y * 0.4).normalize_or(Vec3::X) * size;
        let side = rib.cross(direction(random)).normalize_or(Vec3::Z) * size * 0.36;
        let fold = rib.cross(side).normalize_or(Vec3::Y) * size * 0.12;
        let middle = base + rib * 0.45 + fold;
        let at = foliage.positions.len() as u32;
        foliage
            .positions
            .extend([base, base + rib, middle + side, middle - side]);
        foliage
            .triangles
            .extend([[at, at + 1, at + 2], [at, at + 3, at + 1]]);
    }
}

/// A tuft of bent blades of three triangles each.
pub(super) fn tuft(random: &mut Random, blades: usize) -> Surface {
    let mut grass = Surface::default();
    for _ in 0..blades {
        let lean = Quat::from_rotation_y(random.unit() * TAU);
        let root = lean * vec3(0.10 * random.unit(), -0.01, 0.0);
        let height = random.between(0.14, 0.34);
        let bow = lean * Vec3::X * height * random.between(0.2, 0.7);
        let side = lean * Vec3::Z * 0.007;
        let waist = root + bow * 0.3 + Vec3::Y * height * 0.6;
        let at = grass.positions.len() as u32;
        let tip = root + bow + Vec3::Y * height;
        grass.positions.extend([
            root + side,
            root - side,
            waist + side * 0.8,
            waist - side * 0.8,
            tip,
        ]);
        grass.triangles.extend([
            [at, at + 1, at + 2],
            [at + 1, at + 3, at + 2],
            [at + 2, at + 3, at + 4],
        ]);
    }
    grass
}

/// Stem, cap and the cap's spots of a mushroom about 1 m tall (to be scaled).
pub(super) fn mushroom() -> [Surface; 3] {
    let stem = [
        vec2(0.0, -0.1),
        vec2(0.16, -0.1),
        vec2(0.17, 0.1),
        vec2(0.12, 0.35),
        vec2(0.10, 0.62),
        vec2(0.12, 0.72),
        vec2(0.0, 0.72),
    ];
    let mut cap = vec![
        vec2(0.0, 0.66),
        vec2(0.12, 0.66),
        vec2(0.36, 0.60),
        vec2(0.46, 0.56),
    ];
    cap.extend((0..=8).map(|i| {
        let angle = i as f32 / 9.0 * TAU / 4.0;
        vec2(0.48 * angle.cos(), 0.58 + 0.42 * angle.sin())
    }));
    cap.push(Vec2::new(0.0, 1.0));
    let spots = (0..9).map(|i| {
        let (turn, angle) = (i as f32 * 2.4, 0.35 + 0.9 * (i as f32 / 8.0));
        let out = Quat::from_rotation_y(turn) * vec3(0.48 * angle.cos(), 0.42 * angle.sin(), 0.0);
        let size = 0.05 + 0.02 * (i % 3) as f32;
        let facing = Quat::from_rotation_arc(Vec3::Y, out.normalize());
        let spot = lathe(
            &[vec2(0.0, -0.4), vec2(0.9, -0.1), vec2(0.7, 0.25), vec2(0.0, 0.4)],
            8,
        );
        spot.warped(|p| facing * (p * vec3(size, size * 0.45, size)) + out + Vec3::Y * 0.58)
    });
    [lathe(&stem, 16), lathe(&cap, 28), Surface::joined(spots)]
}

fn direction(random: &mut Random) -> Vec3 {
    let (turn, height) = (random.unit() * TAU, random.between(-1.0, 1.0));
    let radius = (1.0 - height * height).sqrt();
    vec3(radius * turn.cos(), height, radius * turn.sin())
}
