//! Rays aimed at a mesh's weak points.

use glam::Vec3;
use rayward_trace::Ray;

use super::{Random, meshes::Mesh};

/// The box of a mesh's finite vertices: centre and half extents.
fn bounds(mesh: &Mesh) -> (Vec3, Vec3) {
    let finite = || mesh.positions().into_iter().filter(|p| p.is_finite());
    let low = finite().fold(Vec3::MAX, Vec3::min);
    let high = finite().fold(Vec3::MIN, Vec3::max);
    if mesh.x.is_empty() {
        (Vec3::ZERO, Vec3::ONE)
    } else {
        (low * 0.5 + high * 0.5, high * 0.5 - low * 0.5)
    }
}

/// A point of the mesh at which neighbours meet or which is otherwise special.
fn target(mesh: &Mesh, random: &mut Random) -> Vec3 {
    let [a, b, c] = corners(mesh, random);
    match random.below(5) {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a + (b - a) * random.unit(),
        3 => (a + b + c) / 3.0,
        _ => {
            let (u, v) = (random.unit(), random.unit());
            a + (b - a) * (u * (1.0 - v)) + (c - a) * v
        }
    }
}

/// Corners of some triangle; of a made-up one if there is none.
fn corners(mesh: &Mesh, random: &mut Random) -> [Vec3; 3] {
    if mesh.indices.is_empty() {
        return [Vec3::ZERO, Vec3::X, Vec3::Y];
    }
    mesh.indices[random.below(mesh.indices.len())].map(|i| mesh.triangles().vertex(i))
}

/// A ray in a triangle's plane but for rounding; half of the time through points of the lattice that its edges
/// span, with zero components made minute.
fn in_plane([a, b, c]: [Vec3; 3], random: &mut Random) -> Ray {
    let exact = random.below(2) == 0;
    let mut share = || {
        let s = random.signed() * 4.0;
        if exact { s.round() } else { s }
    };
    let from = a + (b - a) * share() + (c - a) * share();
    let mut ray = aimed(from, a + (b - a) * share() + (c - a) * share());
    if exact {
        let axis = random.below(3);
        if ray.dir[axis] == 0.0 {
            ray.dir[axis] = 10f32.powi(-(random.below(30) as i32));
        }
    }
    ray
}

/// `count` rays of every kind the suite knows.
pub fn adversarial(mesh: &Mesh, seed: u64, count: usize) -> Vec<Ray> {
    let mut random = Random::new(seed);
    let (centre, half) = bounds(mesh);
    let within = |random: &mut Random| centre + half * random.in_cube();
    let around = |random: &mut Random| centre + half * random.in_cube() * 3.0;
    (0..count)
        .map(|kind| one(mesh, kind, &mut random, &within, &around))
        .collect()
}

fn one(
    mesh: &Mesh,
    kind: usize,
    random: &mut Random,
    within: &impl Fn(&mut Random) -> Vec3,
    around: &impl Fn(&mut Random) -> Vec3,
) -> Ray {
    let target = target(mesh, random);
    let mut ray = match kind % 10 {
        // Anywhere.
        0 => Ray::new(around(random), random.direction()),
        // Along an axis through a special point, from a face of its neighbours' boxes or from beyond.
        1 | 2 => {
            let axis = Vec3::AXES[random.below(3)] * if random.below(2) == 0 { 1.0 } else { -1.0 };
            let back = if kind % 10 == 1 {
                random.below(3) as f32
            } else {
                random.unit()
            };
            let size = (within(random) - target).abs().max_element();
            Ray::new(target - axis * (back * size), axis)
        }
        // At a special point from outside, from inside, and from the surface.
        3 | 4 => aimed(around(random), target),
        5 => aimed(within(random), target),
        6 => aimed(target, within(random)),
        7 => in_plane(corners(mesh, random), random),
        // Along an edge, from one end or from before it.
        8 => {
            let [a, b, _] = corners(mesh, random);
            aimed(a - (b - a) * random.below(2) as f32, b)
        }
        // Far away.
        _ => aimed(target + (around(random) - target) * 1e4, target),
    };
    limit(&mut ray, random);
    ray
}

fn aimed(from: Vec3, to: Vec3) -> Ray {
    Ray::new(from, to - from)
}

/// Gives some rays a range, a direction of unusual length or a component that is no number.
fn limit(ray: &mut Ray, random: &mut Random) {
    match random.below(12) {
        0 => ray.t_max = 1.0,
        1 => ray.t_min = 1.0,
        2 => (ray.t_min, ray.t_max) = (0.5, random.unit() * 2.0),
        3 => (ray.t_min, ray.t_max) = (-random.unit() * 3.0, 0.5),
        4 => ray.t_min = f32::NEG_INFINITY,
        5 => ray.dir *= 10f32.powi(random.below(40) as i32 - 20),
        6 => ray.dir[random.below(3)] *= 1e-30,
        7 => ray.dir[random.below(3)] = 0.0,
        8 if random.below(4) == 0 => {
            let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][random.below(3)];
            match random.below(4) {
                0 => ray.origin[random.below(3)] = bad,
                1 => ray.dir[random.below(3)] = bad,
                2 => ray.t_min = bad,
                _ => ray.t_max = bad,
            }
        }
        9 if random.below(4) == 0 => ray.dir = Vec3::ZERO,
        _ => {}
    }
}

/// A ray from `origin` at a vertex, an edge point or a centre of a mesh.
pub fn at_seam(mesh: &Mesh, origin: Vec3, random: &mut Random) -> Ray {
    loop {
        let ray = aimed(origin, target(mesh, random));
        if ray.is_valid() {
            return ray;
        }
    }
}
