//! All casters in between against brute force, for lights everywhere and at every level.

use glam::Vec3;

use super::*;
use crate::test_meshes::{Mesh, Numbers};
use crate::{Casts, Light, LightGridOptions, SimdLevel};

/// Points on triangles and in free space.
fn receivers(mesh: &Mesh, count: u32) -> Vec<Receiver> {
    let triangles = mesh.triangles();
    let mut numbers = Numbers(7);
    let mut found = Vec::new();
    for i in 0..count {
        found.push(Receiver::free(numbers.point().as_dvec3() * 1.5));
        let prim = i * 7 % triangles.len() as u32;
        let [a, b, c] = triangles.corners(prim).map(Vec3::as_dvec3);
        let point = a * 0.2 + b * 0.3 + c * 0.5;
        found.push(Receiver {
            point,
            error: point.abs().max_element() * 1e-12,
            prim,
        });
    }
    found
}

type Found = Vec<Vec<(u32, ExactHit)>>;

fn check(name: &str, mesh: &Mesh, light: Light) -> usize {
    let triangles = mesh.triangles();
    let receivers = receivers(mesh, 150);
    let rule = |prim: u32| {
        if prim.is_multiple_of(3) {
            Casts::Nothing
        } else {
            Casts::Both
        }
    };
    let between = |receiver: &Receiver| {
        let finite = |prim: &u32| triangles.corners(*prim).iter().all(|c| c.is_finite());
        let prims = (0..triangles.len() as u32).filter(|prim| !prim.is_multiple_of(3) && finite(prim));
        prims
            .filter_map(|prim| Some((prim, exact::shadow_hit(&triangles, prim, receiver, &light)?)))
            .collect()
    };
    let expected: Found = receivers.iter().map(between).collect();
    for level in SimdLevel::available() {
        for options in [LightGridOptions::default(), LightGridOptions::paper()] {
            let grid = PointLightGrid::build(light, triangles, &rule, options, level);
            let mut scratch = ShadowScratch::default();
            let mut found: Found = vec![Vec::new(); receivers.len()];
            grid.each_between(&receivers, &mut scratch, |i, prim, hit| {
                found[i].push((prim, *hit));
                ControlFlow::Continue(())
            });
            let mut first: Found = vec![Vec::new(); receivers.len()];
            grid.each_between(&receivers, &mut scratch, |i, prim, hit| {
                first[i].push((prim, *hit));
                ControlFlow::Break(())
            });
            for (i, want) in expected.iter().enumerate() {
                let place = format!("{name}, {}, {light:?}, {:?}", level.name(), receivers[i]);
                assert_eq!(&found[i], want, "{place}");
                assert_eq!(
                    first[i],
                    want.iter().take(1).copied().collect::<Vec<_>>(),
                    "{place}"
                );
            }
        }
    }
    expected.iter().map(Vec::len).sum()
}

#[test]
fn equals_brute_force() {
    let meshes = [
        ("soup", Mesh::soup(3, 200, 0.4, 1.0)),
        ("blob", Mesh::blob(16)),
        ("awkward", Mesh::awkward()),
    ];
    for (name, mesh) in &meshes {
        for light in [
            Light::Point(Vec3::new(3.0, 4.0, 2.0)),
            Light::Point(Vec3::new(0.05, 0.02, -0.03)),
            Light::Point(Vec3::new(1e4, 2e4, -1e4)),
            Light::Directional(Vec3::new(0.3, 1.0, 0.2)),
        ] {
            let pairs = check(name, mesh, light);
            assert!(pairs > 20, "{name}, {light:?}: {pairs} pairs prove little");
        }
    }
}

#[test]
fn equals_brute_force_at_any_scale_and_where_nothing_can_be_projected() {
    for (scale, offset) in [(1e-3, 1.0), (1e3, 1e6), (1e31, 0.0)] {
        let offset = Vec3::new(offset, -offset, offset * 0.5);
        let mesh = Mesh::blob(10).scaled(scale, offset);
        check(
            &format!("scale {scale}"),
            &mesh,
            Light::Point(Vec3::new(2.0, 3.0, 1.0) * scale + offset),
        );
    }
}
