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
    let topology = Topology::analyse(&triangles);
    let (mut counts, mut dark) = (ShadowCounts::default(), 0);
    for (k, level) in SimdLevel::available().into_iter().enumerate() {
        let tree = crate::PointLightTree::build(light, triangles, rule, None, level);
        let mut shadow = Vec::new();
        tree.shadowed(receivers, &mut ShadowScratch::default(), &mut shadow);
        for (i, receiver) in receivers.iter().enumerate() {
            let place = || format!("tree, {name}, {}, {light:?}, {receiver:?}", level.name());
            assert_eq!(shadow[i], expected[i], "{}", place());
        }
        let coarse = LightGridOptions {
            resolution: Some(24),
            ..LightGridOptions::default()
        };
        let (usual, paper) = (LightGridOptions::default(), LightGridOptions::paper());
        let ways = [
            (usual, false),
            (paper, false),
            (usual, true),
            (coarse, true),
            (paper, true),
        ];
        // Cells that are covered whole are found without lanes.
        let ways = if k == 0 { &ways[..] } else { &ways[..2] };
        for &(options, whole) in ways {
            let grid = if whole {
                PointLightGrid::build_with_topology(light, triangles, &topology, rule, options, level)
            } else {
                PointLightGrid::build(light, triangles, rule, options, level)
            };
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
            let untested = counts.lit_by_cell + counts.dark_by_cell;
            assert_eq!(receivers.iter().filter(spared).count() as u64, untested);
            for (receiver, _) in receivers.iter().zip(&shadow).filter(|(_, shadow)| **shadow) {
                assert!(grid.cell_of(receiver).is_none_or(|cell| cell.casters > 0));
            }
            if whole {
                dark += counts.dark_by_cell;
            }
        }
    }
    counts.dark_by_cell = dark;
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

#[test]
fn what_a_sheet_hides_is_dark_without_a_test() {
    let mesh = Mesh::blob(40);
    let mut numbers = Numbers(71);
    // Below and beside a ball, seen from above.
    let receivers: Vec<Receiver> = (0..4000)
        .map(|_| {
            let at = numbers.point() * 1.6;
            Receiver::free(DVec3::new(f64::from(at.x), -1.5, f64::from(at.z)))
        })
        .collect();
    for light in [
        Light::Point(Vec3::new(0.2, 9.0, 0.1)),
        Light::Directional(Vec3::Y),
    ] {
        for rule in [Casts::Both, Casts::Back] {
            let triangles = mesh.triangles();
            let topology = Topology::analyse(&triangles);
            let options = LightGridOptions {
                resolution: Some(64),
                ..LightGridOptions::default()
            };
            let cast = |_| rule;
            let level = SimdLevel::detect();
            let grid =
                PointLightGrid::build_with_topology(light, triangles, &topology, &cast, options, level);
            let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
            grid.shadowed(&receivers, &mut scratch, &mut shadow);
            let in_shadow = shadow.iter().filter(|s| **s).count() as u64;
            let dark = scratch.counts.dark_by_cell;
            assert!(
                in_shadow > 800 && dark * 10 > in_shadow * 8,
                "{dark} of {in_shadow}, {light:?}"
            );
        }
    }
}

#[test]
fn holes_in_a_sheet_let_light_through() {
    // A grating of quads in one plane, every third one left out; and one whose vertices have moved apart since the
    // topology was found.
    let mut mesh = Mesh::default();
    let side = 12u32;
    for i in 0..(side + 1) * (side + 1) {
        let at = |v: u32| v as f32 / side as f32 * 2.0 - 1.0;
        mesh.vertex(Vec3::new(at(i % (side + 1)), 0.5, at(i / (side + 1))));
    }
    for i in (0..side * side).filter(|i| i % 3 != 0) {
        let a = i / side * (side + 1) + i % side;
        mesh.indices.push([a, a + 1, a + side + 1]);
        mesh.indices.push([a + 1, a + side + 2, a + side + 1]);
    }
    let mut numbers = Numbers(73);
    let receivers = [(); 2000].map(|()| Receiver::free((numbers.point() - Vec3::Y).as_dvec3()));
    for light in [
        Light::Point(Vec3::new(0.3, 5.0, 0.2)),
        Light::Directional(Vec3::Y),
    ] {
        let counts = check("grating", &mesh, &receivers, light, &|_| Casts::Both);
        assert!(counts.dark_by_cell > 100, "{counts:?}");
    }
}

#[test]
fn a_tree_passes_what_its_metric_predicts() {
    // So few casters that hardly a ray ends before it has passed all of its nodes.
    for (seed, size) in [(1, 0.02), (2, 0.04), (3, 0.06)] {
        let mesh = Mesh::soup(seed, 3000, size, 1.0);
        let light = Light::Directional(Vec3::Y);
        let level = SimdLevel::detect();
        let tree = crate::PointLightTree::build(light, mesh.triangles(), &|_| Casts::Both, None, level);
        let mut numbers = Numbers(seed + 10);
        let receivers: Vec<Receiver> = (0..20_000)
            .map(|_| Receiver::free(numbers.point().as_dvec3()))
            .collect();
        let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
        tree.shadowed(&receivers, &mut scratch, &mut shadow);
        let (counts, predicted) = (scratch.counts, tree.predicted());
        let rays = counts.receivers as f64;
        let measured = [counts.nodes as f64 / rays, counts.tests as f64 / rays];
        for (measured, predicted) in measured.into_iter().zip([predicted.nodes, predicted.triangles]) {
            let ratio = measured / predicted;
            assert!(
                (0.8..1.25).contains(&ratio),
                "{measured} instead of {predicted}, size {size}"
            );
        }
        // Of 3000 triangles, in some 330 nodes.
        assert!(measured[0] < 12.0, "{measured:?}");
    }
}

#[test]
fn costs_follow_receivers_and_casters() {
    let mesh = Mesh::blob(40);
    let light = Light::Point(Vec3::new(3.0, 4.0, 2.0));
    let predict =
        |receivers| crate::ShadowCosts::predict(&light, &mesh.triangles(), &|_| Casts::Both, None, receivers);
    let (few, many) = (predict(1000), predict(1_000_000));
    for (few, many) in [
        (few.receivers, many.receivers),
        (few.grid, many.grid),
        (few.tree, many.tree),
    ] {
        assert!(few > 0.0 && many > few + 30.0, "{few} and {many} ms");
    }
}
