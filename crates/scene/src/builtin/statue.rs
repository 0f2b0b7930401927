//! Closed organic surfaces in the manner of scanned statues: a seated hare and a coiled serpent.
//!
//! The hare is a geodesic sphere shrunk from outside, along rays towards its centre, onto a smooth union of
//! ellipsoids, then roughened by noise. The serpent is a tube with a head, a crest and scales. Both are closed
//! 2-manifolds of genus 0 that stand on y = 0 and look along +Z. Cost: about 1 us a vertex on one core.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Quat, Vec3, vec3};
use rayon::prelude::*;

use super::random::fractal_noise;
use super::shapes::{Ends, Surface, geosphere, loft, smooth_path};

/// A seated hare about 1 m tall, of `20 * frequency^2` triangles.
pub(super) fn hare(frequency: u32) -> Surface {
    let limbs = hare_limbs();
    let mut surface = geosphere(frequency);
    surface.positions.par_iter_mut().for_each(|p| {
        let ray = crowd(*p);
        let skin = shrink(&limbs, heart(ray), ray);
        // Paws are met at a shallow angle, where roughness would comb the surface.
        let rough = 0.011 * ramp(skin.y, 0.02, 0.22) * fractal_noise(skin * 8.0, 4, 11);
        *p = skin + ray * rough;
        // The sole is flat.
        p.y = p.y.max(0.0);
    });
    surface
}

/// Where the rays towards the feet and those towards the ears come from: between these two points every part of
/// the outside is met at a good angle.
const BELLY: Vec3 = vec3(0.0, 0.20, 0.03);
const HEAD: Vec3 = vec3(0.0, 0.58, 0.09);
const EAR: Vec3 = vec3(0.085, 0.80, 0.03);
/// Radius of the blends between limbs, metres.
const BLEND: f32 = 0.06;

struct Ellipsoid {
    centre: Vec3,
    /// Largest half axis.
    reach: f32,
    shrink: Vec3,
    into_axes: Mat3,
}

impl Ellipsoid {
    /// A first-order estimate of the distance, exact on the surface; anything above `limit` when it is beyond.
    fn distance(&self, p: Vec3, limit: f32) -> f32 {
        let away = p - self.centre;
        let beyond = (limit + self.reach).max(0.0);
        if away.length_squared() > beyond * beyond {
            return f32::INFINITY;
        }
        let q = (self.into_axes * away) * self.shrink;
        let length = q.length();
        length * (length - 1.0) / (q * self.shrink).length().max(1e-6)
    }
}

fn hare_limbs() -> Vec<Ellipsoid> {
    let limb = |centre: [f32; 3], half_axes: [f32; 3], pitch: f32, roll: f32| Ellipsoid {
        centre: centre.into(),
        reach: Vec3::from(half_axes).max_element(),
        shrink: Vec3::from(half_axes).recip(),
        into_axes: (Mat3::from_rotation_z(roll) * Mat3::from_rotation_x(pitch)).transpose(),
    };
    let mut limbs = vec![
        limb([0.0, 0.25, -0.03], [0.19, 0.25, 0.22], 0.25, 0.0),
        limb([0.0, 0.18, -0.14], [0.20, 0.18, 0.19], 0.0, 0.0),
        limb([0.0, 0.36, 0.08], [0.14, 0.19, 0.13], 0.2, 0.0),
        limb([0.0, 0.60, 0.12], [0.115, 0.115, 0.14], 0.1, 0.0),
        limb([0.0, 0.575, 0.23], [0.065, 0.058, 0.065], 0.0, 0.0),
        limb([0.0, 0.13, -0.34], [0.075, 0.075, 0.07], 0.0, 0.0),
    ];
    for side in [-1.0, 1.0] {
        limbs.extend([
            limb([side * 0.06, 0.565, 0.17], [0.06, 0.055, 0.06], 0.0, 0.0),
            limb([side * 0.085, 0.83, 0.02], [0.048, 0.19, 0.03], -0.2, side * -0.2),
            limb([side * 0.17, 0.17, -0.08], [0.10, 0.17, 0.18], 0.0, side * 0.1),
            limb([side * 0.18, 0.045, 0.06], [0.06, 0.055, 0.12], 0.0, 0.0),
            limb([side * 0.08, 0.19, 0.17], [0.05, 0.19, 0.055], 0.0, 0.0),
            limb([side * 0.085, 0.035, 0.195], [0.055, 0.05, 0.065], 0.0, 0.0),
        ]);
    }
    limbs
}

/// Draws directions together around the ears, whose solid angle is small for their surface.
fn crowd(direction: Vec3) -> Vec3 {
    [-1.0, 1.0].iter().fold(direction, |d, side| {
        let axis = (EAR * vec3(*side, 1.0, 1.0) - HEAD).normalize();
        let angle = d.angle_between(axis);
        let turn = angle * 0.55 * (-(angle / 0.5).powi(2)).exp();
        match d.cross(axis).try_normalize() {
            Some(pole) => Quat::from_axis_angle(pole, turn) * d,
            None => d,
        }
    })
}

/// Where the ray in this direction starts.
fn heart(ray: Vec3) -> Vec3 {
    BELLY.lerp(HEAD, (0.5 + 0.6 * ray.y).clamp(0.0, 1.0))
}

/// The outermost point of the limbs' smooth union on a ray.
fn shrink(limbs: &[Ellipsoid], heart: Vec3, ray: Vec3) -> Vec3 {
    let mut reach = 0.62;
    for _ in 0..40 {
        let p = heart + ray * reach;
        let nearest = limbs
            .iter()
            .fold(0.6, |near, l| smooth_min(near, l.distance(p, near + BLEND)));
        reach -= nearest * 0.85;
        if nearest < 2e-4 {
            break;
        }
    }
    heart + ray * reach.max(0.05)
}

fn smooth_min(a: f32, b: f32) -> f32 {
    let h = (BLEND - (a - b).abs()).max(0.0) / BLEND;
    a.min(b) - h * h * BLEND / 4.0
}

/// A coiled serpent with raised head, about 1.3 m tall, of `2 * sides * rings` triangles.
pub(super) fn serpent(sides: usize, rings: usize) -> Surface {
    let spine = smooth_path(&serpent_knots(), 40);
    let lengths: Vec<f32> = std::iter::once(0.0)
        .chain(spine.windows(2).scan(0.0, |sum, pair| {
            *sum += pair[0].distance(pair[1]);
            Some(*sum)
        }))
        .collect();
    let total = lengths[lengths.len() - 1];
    let point = |share: f32| {
        let at = (share * total).clamp(0.0, total);
        let i = lengths.partition_point(|&l| l < at).clamp(1, spine.len() - 1);
        spine[i - 1].lerp(spine[i], (at - lengths[i - 1]) / (lengths[i] - lengths[i - 1]))
    };
    let rows: Vec<Vec<Vec3>> = (0..rings)
        .into_par_iter()
        .map(|i| {
            let share = (i as f32 + 0.5) / rings as f32;
            let along = (point(share + 0.004) - point(share - 0.004)).normalize();
            let side = Vec3::Y.cross(along).normalize_or(Vec3::X);
            let up = along.cross(side);
            let centre = point(share);
            (0..sides)
                .map(|j| centre + serpent_skin(share, j as f32 / sides as f32, side, up, total))
                .collect()
        })
        .collect();
    loft(&rows, Ends::Fans(spine[0], spine[spine.len() - 1]))
}

/// Offset of the skin from the spine at a share of the length and a turn around it (0.25 is the back).
fn serpent_skin(share: f32, turn: f32, side: Vec3, up: Vec3, total: f32) -> Vec3 {
    let (sin, cos) = (turn * TAU).sin_cos();
    let trunk = 0.105 * (share * 1.35).min(1.0).powf(0.7) * (1.0 - 0.35 * ramp(share, 0.75, 0.9));
    let head = 0.055 * bump(share, 0.955, 0.035);
    let tip = (1.0 - ramp(share, 0.975, 1.0).powi(2)).max(0.0).sqrt();
    let radius = ((trunk + head) * tip).max(0.002);
    let scales = 0.035 * ((share * total / 0.045 * PI).sin() * (turn * 18.0 * PI).sin()).abs();
    let crest = 0.55 * (1.0 - ramp(share, 0.86, 0.92)) * ramp(share, 0.1, 0.3);
    let spike =
        (-((turn - 0.25) / 0.025).powi(2)).exp() * (0.4 + 0.6 * (share * total / 0.09 * PI).sin().abs());
    let brow = 0.5 * bump(share, 0.963, 0.012) * (bump(turn, 0.12, 0.03) + bump(turn, 0.38, 0.03));
    let rise = radius * (1.0 + scales + crest * spike + brow);
    let flat = 1.0 - 0.25 * bump(share, 0.97, 0.04);
    let offset = side * (cos * rise * (1.0 + 0.15 * bump(share, 0.95, 0.03))) + up * (sin * rise * flat);
    offset * (1.0 + 0.02 * fractal_noise(offset * 30.0 + vec3(share * total * 12.0, 0.0, 0.0), 3, 23))
}

/// One and a half turns on the ground, inward, then up and forward.
fn serpent_knots() -> Vec<Vec3> {
    let mut knots: Vec<Vec3> = (0..=12)
        .map(|i| {
            let t = i as f32 / 12.0;
            let angle = -0.6 * PI + t * 3.0 * PI;
            let radius = 0.62 - 0.34 * t;
            vec3(radius * angle.cos(), 0.11 + 0.12 * t * t, radius * angle.sin())
        })
        .collect();
    knots.extend([
        vec3(-0.08, 0.28, 0.25),
        vec3(-0.17, 0.42, 0.14),
        vec3(-0.13, 0.66, 0.01),
        vec3(-0.04, 0.90, -0.07),
        vec3(0.0, 1.09, -0.03),
        vec3(0.0, 1.18, 0.11),
        vec3(0.0, 1.16, 0.28),
        vec3(0.0, 1.13, 0.42),
    ]);
    knots
}

fn ramp(x: f32, from: f32, to: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn bump(x: f32, centre: f32, width: f32) -> f32 {
    (-((x - centre) / width).powi(2)).exp()
}
