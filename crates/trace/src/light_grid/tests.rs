//! The light grid against brute force, at every level, for lights everywhere.

use glam::{DVec3, Vec3};

use super::*;
use crate::test_meshes::{Mesh, Numbers};

/// Surface points seen from `eye` in all directions, with the eye's side of their triangles.
fn receivers(mesh: &Mesh, eye: Vec3, count: usize, seed: u64) -> Vec<Receiver> {
    let triangles = mesh.triangles();
    let mut numbers = Numbers(seed);
    let mut found = Vec::new();
    for _ in 0..count {
        let ray = crate::Ray::new(eye, numbers.point() - eye);
        let closest = (0..triangles.len() as u32)
            .filter_map(|prim| Some((crate::brute::hit_in_range(&triangles, prim, &ray)?.t, prim)))
            .reduce(|a, b| if b.0 < a.0 { b } else { a });
        found.extend(closest.map(|(t, prim)| Receiver::on_surface(&ray, t, prim)));
        // Free points, some within the geometry.
        found.push(Receiver::free((eye + numbers.point() * 2.0).as_dvec3()));
    }
    found
}

fn check(name: &str, mesh: &Mesh, receivers: &[Receiver], light: Light, rule: CastRule) -> ShadowCounts {
    let triangles = mesh.triangles();
    let in_shadow = |r: &Receiver| {
        (0..triangles.len() as u32).any(|prim| {
            triangles.corners(prim).iter().all(|c| c.is_finite())
                && exact::shadows(&triangles, prim, r, &light)
        })
    };
    let expected: Vec<bool> = receivers.iter().map(in_shadow).collect();
    let mut counts = ShadowCounts::default();
    for level in SimdLevel::available() {
        for options in [LightGridOptions::default(), LightGridOptions::paper()] {
            let grid = PointLightGrid::build(light, triangles, rule, options, level);
            let mut scratch = ShadowScratch::default();
            let mut shadow = Vec::new();
            grid.shadowed(receivers, &mut scratch, &mut shadow);
            for (i, (got, want)) in shadow.iter().zip(&expected).enumerate() {
                let receiver = &receivers[i];
                assert_eq!(
                    got,
                    want,
                    "{name}, {}, {light:?}, {options:?}, {receiver:?}",
                    level.name()
                );
            }
            counts = scratch.counts;
            let spared = |receiver: &&Receiver| grid.cell_of(receiver).is_some_and(|cell| cell.spared);
            assert_eq!(receivers.iter().filter(spared).count() as u64, counts.lit_by_cell);
            for (receiver, _) in receivers.iter().zip(&shadow).filter(|(_, shadow)| **shadow) {
                let cell = grid.cell_of(receiver);
                assert!(cell.is_none_or(|cell| cell.casters > 0 && !cell.spared));
            }
        }
    }
    counts
}

fn lights() -> Vec<Light> {
    vec![
        Light::Point(Vec3::new(3.0, 4.0, 2.0)),
        Light::Point(Vec3::new(0.05, 0.02, -0.03)),
        Light::Point(Vec3::new(0.7, 0.9, 0.4)),
        Light::Point(Vec3::new(0.0, -0.8, 0.3)),
        Light::Point(Vec3::new(1e4, 2e4, -1e4)),
        Light::Directional(Vec3::new(0.3, 1.0, 0.2)),
        Light::Directional(Vec3::Y),
    ]
}

#[test]
fn equals_brute_force_with_casters_of_both_sides() {
    let eye = Vec3::new(0.2, 0.5, 2.5);
    for (name, mesh) in [
        ("soup", Mesh::soup(3, 400, 0.3, 1.0)),
        ("blob", Mesh::blob(24)),
        ("awkward", Mesh::awkward()),
    ] {
        for eye in [eye, Vec3::new(0.1, 0.05, 0.0)] {
            let receivers = receivers(&mesh, eye, 400, 11);
            for light in lights() {
                check(name, &mesh, &receivers, light, &|_| Casts::Both);
            }
        }
    }
}

#[test]
fn equals_brute_force_at_any_scale_and_offset() {
    for (scale, offset) in [(1e-3, 0.0), (1e-3, 1.0), (1e3, 1e6), (1e6, 1e6), (1.0, 1e5)] {
        let offset = Vec3::new(offset, -offset, offset * 0.5);
        let mesh = Mesh::blob(16).scaled(scale, offset);
        let receivers = receivers(&mesh, Vec3::new(0.2, 0.5, 2.5) * scale + offset, 300, 5);
        for position in [Vec3::new(2.0, 3.0, 1.0), Vec3::new(0.1, 0.1, 0.0)] {
            let light = Light::Point(position * scale + offset);
            check(
                &format!("scale {scale} offset {offset}"),
                &mesh,
                &receivers,
                light,
                &|_| Casts::Both,
            );
        }
    }
}

#[test]
fn back_faces_suffice_for_what_an_outside_viewer_sees() {
    let mesh = Mesh::blob(24);
    let triangles = mesh.triangles();
    let eye = Vec3::new(0.2, 0.5, 2.5);
    for light in lights()
        .into_iter()
        .filter(|l| *l != Light::Point(Vec3::new(0.05, 0.02, -0.03)))
    {
        // Receivers on the side turned away from the light are dark without a ray, so nobody asks about them.
        let mut receivers = receivers(&mesh, eye, 3000, 17);
        receivers.retain(|r| {
            let faces = |n: DVec3, towards: DVec3| n.dot(towards);
            r.prim != u32::MAX && {
                let n = triangles.normal(r.prim);
                faces(n, light.towards(r.point)) * faces(n, eye.as_dvec3() - r.point) > 0.0
            }
        });
        let inside = matches!(light, Light::Point(p) if p.length() < 1.1);
        if !inside {
            let counts = check("blob", &mesh, &receivers, light, &|_| Casts::Back);
            assert!(
                counts.receivers > 100,
                "too few receivers to mean anything: {counts:?}"
            );
        }
    }
}

#[test]
fn a_convex_surface_never_shadows_its_lit_side() {
    // The bumps of a blob shadow each other; a plain sphere must not shadow what faces the light.
    let mut mesh = Mesh::blob(20);
    for i in 0..mesh.x.len() {
        let p = Vec3::new(mesh.x[i], mesh.y[i], mesh.z[i]).normalize();
        (mesh.x[i], mesh.y[i], mesh.z[i]) = (p.x, p.y, p.z);
    }
    let triangles = mesh.triangles();
    for light in [
        Light::Point(Vec3::new(2.0, 3.0, 1.0)),
        Light::Directional(Vec3::new(1.0, 0.5, 0.2)),
    ] {
        let mut receivers = receivers(&mesh, Vec3::new(0.0, 0.3, 2.5), 4000, 23);
        receivers.retain(|r| {
            let outward = |n: DVec3| n * n.dot(r.point).signum();
            r.prim != u32::MAX && outward(triangles.normal(r.prim)).dot(light.towards(r.point)) > 0.0
        });
        assert!(receivers.len() > 300);
        let grid = PointLightGrid::build(
            light,
            triangles,
            &|_| Casts::Both,
            LightGridOptions::default(),
            SimdLevel::detect(),
        );
        let mut shadow = Vec::new();
        grid.shadowed(&receivers, &mut ShadowScratch::default(), &mut shadow);
        assert!(shadow.iter().all(|s| !s), "acne");
    }
}

#[test]
fn a_spot_lights_cone_is_one_face() {
    let mesh = Mesh::soup(9, 300, 0.3, 1.0);
    let triangles = mesh.triangles();
    let position = Vec3::new(0.1, 2.5, 0.2);
    let axis = DVec3::new(0.1, -1.0, 0.05).normalize();
    let cone = Cone {
        axis,
        half_angle: 0.5,
    };
    let mut receivers = receivers(&mesh, Vec3::new(0.2, 0.5, 2.5), 600, 29);
    receivers.retain(|r| (r.point - position.as_dvec3()).angle_between(axis) < 0.5);
    let light = Light::Point(position);
    let options = LightGridOptions {
        cone: Some(cone),
        ..LightGridOptions::default()
    };
    let grid = PointLightGrid::build(light, triangles, &|_| Casts::Both, options, SimdLevel::detect());
    assert_eq!(grid.faces.len(), 1);
    let mut shadow = Vec::new();
    grid.shadowed(&receivers, &mut ShadowScratch::default(), &mut shadow);
    for (receiver, got) in receivers.iter().zip(&shadow) {
        let want = (0..triangles.len() as u32).any(|prim| exact::shadows(&triangles, prim, receiver, &light));
        assert_eq!(*got, want, "{receiver:?}");
    }
}

#[test]
fn nothing_and_nonsense_shadow_nothing() {
    let mesh = Mesh::default();
    let receivers = [Receiver::free(DVec3::ZERO), Receiver::free(DVec3::NAN)];
    for light in lights() {
        check("empty", &mesh, &receivers, light, &|_| Casts::Both);
    }
    let soup = Mesh::soup(1, 20, 0.3, 1.0);
    for light in [
        Light::Point(Vec3::NAN),
        Light::Directional(Vec3::ZERO),
        Light::Directional(Vec3::NAN),
    ] {
        check("nonsense", &soup, &receivers, light, &|_| Casts::Both);
    }
}

#[test]
fn a_light_within_a_triangle_is_not_hidden_by_it() {
    let mut numbers = Numbers(91);
    let coarse = |p: Vec3| (p * 1048576.0).round() / 1048576.0;
    for _ in 0..40 {
        let mut mesh = Mesh::soup(3, 10, 0.5, 1.0);
        let corners = [(); 3].map(|()| coarse(numbers.point()));
        mesh.triangle(corners);
        let light = Light::Point((corners[0] * 2.0 + corners[1] + corners[2]) * 0.25);
        let receivers = [(); 40].map(|()| Receiver::free((numbers.point() * 2.0).as_dvec3()));
        check("within", &mesh, &receivers, light, &|_| Casts::Both);
    }
}

#[test]
fn lights_as_far_as_the_sun() {
    let mesh = Mesh::soup(13, 200, 0.3, 1.0);
    let triangles = mesh.triangles();
    let mut numbers = Numbers(55);
    for distance in [1e6, 1e9, 1e10, 1.5e11] {
        let position = Vec3::new(0.4, 0.8, -0.45) * distance;
        // Just inside of edges, some way behind the triangle.
        let receivers: Vec<Receiver> = (0..1000)
            .map(|i| {
                let [a, b, c] = triangles.corners(i % 200).map(Vec3::as_dvec3);
                let share = f64::from(numbers.next()).abs();
                let edge = a + (b - a) * share;
                let inside = edge + (c - edge) * 1e-6 * f64::from(numbers.next()).abs();
                Receiver::free(inside - (position.as_dvec3() - inside).normalize() * 2.0)
            })
            .collect();
        check("far", &mesh, &receivers, Light::Point(position), &|_| Casts::Both);
    }
}

#[test]
fn a_huge_vertex_does_not_take_the_shadows() {
    for huge in [1e29, 1e31, 3.4e38] {
        let mut mesh = Mesh::default();
        let over = |x: f32, z: f32| Vec3::new(x, 0.5, z);
        mesh.triangle([over(-1.0, -1.0), over(1.0, -1.0), over(0.0, 1.0)]);
        mesh.triangle([
            Vec3::new(5.0, 0.0, 0.0),
            Vec3::new(huge, 1.0, 0.0),
            Vec3::new(5.0, 1.0, 1.0),
        ]);
        let receivers = [(0.0, 0.0), (0.0, 9.0)].map(|(x, z)| Receiver::free(DVec3::new(x, -1.0, z)));
        for light in [Light::Point(Vec3::Y), Light::Directional(Vec3::Y)] {
            check("huge", &mesh, &receivers, light, &|_| Casts::Both);
        }
    }
}
