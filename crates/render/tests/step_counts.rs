//! HM08, Table 5: shadow rays of an area light pass far fewer cells of a perspective grid than of a regular one with
//! as many cells.

use glam::{DVec3, Vec3};
use rayward::scene::builtin;
use rayward::trace::space::Perspective;
use rayward::trace::{Candidates, Counters, Grid3, Light, Ray, Receiver, Triangles};

/// A square light above the scene and the receivers seen from its camera.
struct Setting {
    light: DVec3,
    forward: DVec3,
    half_side: f64,
    receivers: Vec<Receiver>,
}

/// Points of the light: 8 for each receiver, in strata that differ from one receiver to the next.
fn sample(setting: &Setting, receiver: usize, k: usize) -> Light {
    let right = setting.forward.any_orthonormal_vector();
    let up = right.cross(setting.forward);
    let jitter = |salt: u64| {
        let bits = ((receiver * 8 + k) as u64 + 1).wrapping_mul(salt);
        ((bits ^ (bits >> 31)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 11) as f64 / (1u64 << 53) as f64
    };
    let x = ((k % 4) as f64 + jitter(0x9e37_79b9_7f4a_7c15)) / 2.0 - 1.0;
    let y = ((k / 4) as f64 + jitter(0xbf58_476d_1ce4_e5b9)) - 1.0;
    Light::Point((setting.light + (right * x + up * y) * setting.half_side).as_vec3())
}

fn setting(triangles: Triangles, grid: &impl Candidates, eye: Vec3, target: Vec3) -> Setting {
    let vertices = || (0..triangles.x.len() as u32).map(|i| triangles.vertex(i));
    let low = vertices().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
    let high = vertices().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
    let (middle, size) = ((low + high) * 0.5, (high - low).length());
    let light = middle + DVec3::new(0.3, 0.9, 0.2) * size;
    let ahead = (target - eye).normalize();
    let right = ahead.cross(Vec3::Y).normalize();
    let up = right.cross(ahead);
    let mut receivers = Vec::new();
    for y in 0..60 {
        for x in 0..96 {
            let offset = right * ((x as f32 - 47.5) / 60.0) + up * ((y as f32 - 29.5) / -60.0);
            let ray = Ray::new(eye, ahead + offset);
            if let Some((prim, hit)) = grid.closest(&ray, &mut ()) {
                receivers.push(Receiver::on_surface(&ray, hit.t, prim));
            }
        }
    }
    Setting {
        light,
        forward: (middle - light).normalize(),
        half_side: size * 0.02,
        receivers,
    }
}

/// The pyramid of the light that holds all triangles and all of the light's rays to them.
fn pyramid(setting: &Setting, triangles: Triangles) -> Perspective {
    let right = setting.forward.any_orthonormal_vector();
    let mut space = Perspective {
        center: setting.light,
        right,
        up: right.cross(setting.forward),
        forward: setting.forward,
        tan_x: 0.0,
        tan_y: 0.0,
        near: f64::INFINITY,
        far: 0.0,
    };
    for i in 0..triangles.x.len() as u32 {
        let v = space.view(triangles.vertex(i).as_dvec3());
        space.tan_x = space.tan_x.max((v.x / v.z).abs());
        space.tan_y = space.tan_y.max((v.y / v.z).abs());
        (space.near, space.far) = (space.near.min(v.z), space.far.max(v.z));
    }
    (space.near, space.far) = (space.near * 0.999, space.far * 1.001);
    // A ray starts at most this far beside the center and comes nearer to its straight line all the way.
    let guard = setting.half_side * std::f64::consts::SQRT_2 / space.near;
    (space.tan_x, space.tan_y) = (space.tan_x + guard, space.tan_y + guard);
    space
}

/// Cells a ray, tests a ray, and the answers.
fn cast(grid: &impl Candidates, setting: &Setting) -> (f64, f64, Vec<bool>) {
    let mut count = Counters::default();
    let mut shadows = Vec::new();
    for (i, receiver) in setting.receivers.iter().enumerate() {
        shadows.extend((0..8).map(|k| grid.shadows(receiver, &sample(setting, i, k), &mut count)));
    }
    let rays = shadows.len() as f64;
    (count.nodes as f64 / rays, count.triangles as f64 / rays, shadows)
}

#[test]
fn soft_shadow_rays_pass_less_than_a_third_of_the_cells() {
    let scene = builtin::build("courtyard").expect("it is built in");
    let frame = scene.at(0.0);
    let triangles = Triangles::new(&frame.x, &frame.y, &frame.z, &frame.indices);
    let camera = &frame.cameras[0];
    let eye = (camera.eye - frame.origin).as_vec3();

    let regular = Grid3::in_world(triangles, Some([54; 3]));
    let setting = setting(triangles, &regular, eye, eye + camera.forward.as_vec3());
    assert!(setting.receivers.len() > 2000, "{}", setting.receivers.len());
    let space = pyramid(&setting, triangles);
    let (steps, tests, shadows) = cast(&regular, &setting);
    let share = shadows.iter().filter(|s| **s).count() as f64 / shadows.len() as f64;
    assert!((0.05..0.95).contains(&share), "{share} of the rays end in shadow");

    for (name, grid) in [
        ("evenly spaced", Grid3::new(space, triangles, [200, 200, 4], None)),
        ("one slab", Grid3::new(space, triangles, [400, 400, 1], None)),
    ] {
        let (fewer, tests_there, same) = cast(&grid, &setting);
        println!(
            "{name}: {steps:.1} cells a ray of 54^3, {fewer:.1} of {:?}: {:.3}; tests {tests:.1}, {tests_there:.1}; \
             {share:.2} in shadow; references {}, {}",
            grid.cells(),
            fewer / steps,
            regular.reference_count(),
            grid.reference_count()
        );
        assert!(same == shadows, "{name}: the grids answer alike");
        assert!(fewer < steps / 3.0, "{name}: {fewer} of {steps} cells");
    }
}
