//! What is seen through against brute force: every hit of every pixel, in order, with its parameters.

use glam::{DVec3, Vec3};

use super::*;
use crate::test_meshes::{Mesh, axes, looking};
use crate::{EyeGrid, EyeGridOptions};

/// All hits of a ray by testing every triangle, by `t`, then id.
fn brute(triangles: &Triangles, ray: &ViewRay, keep: &dyn Fn(u32) -> bool) -> Vec<VeilHit> {
    let hit = |prim: u32| {
        let corners = triangles.corners(prim);
        let finite = keep(prim) && corners.iter().all(|c| c.is_finite());
        let hit = exact::hit(ray.origin, ray.dir, corners).filter(|hit| finite && hit.t > 0.0)?;
        Some(VeilHit { prim, hit })
    };
    let mut hits: Vec<_> = (0..triangles.len() as u32).filter_map(hit).collect();
    hits.sort_by(|a, b| a.hit.t.total_cmp(&b.hit.t));
    hits
}

/// Every `opaque`-th triangle is opaque, the others are not.
fn check(name: &str, mesh: &Mesh, view: View, opaque: u32, tile: u32) -> usize {
    let triangles = mesh.triangles();
    let is_veil = |prim: u32| opaque == 0 || !prim.is_multiple_of(opaque);
    let mut count = 0;
    for level in SimdLevel::available() {
        let options = EyeGridOptions {
            tile,
            ..EyeGridOptions::default()
        };
        let tiles = EyeGrid::build(view, triangles, options, level);
        let grid = EyeVeils::build(view, triangles, is_veil, level);
        let mut veils = TileVeils::default();
        for index in 0..tiles.tile_count() {
            let tile = tiles.tile(index);
            let ray = |x, y| view.pixel_ray(tile.x + x, tile.y + y);
            let walls = |x, y| brute(&triangles, &ray(x, y), &|prim| !is_veil(prim));
            let wall = |x: u32, y: u32| walls(x, y).first().map(|hit| hit.prim);
            grid.trace_tile(&tile, wall, &mut veils);
            for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                let mut expected = brute(&triangles, &ray(x, y), &is_veil);
                if let Some(wall) = walls(x, y).first() {
                    expected.retain(|veil| (veil.hit.t, veil.prim) < (wall.hit.t, wall.prim));
                }
                let place = format!("{name}, {}, {} {}", level.name(), tile.x + x, tile.y + y);
                assert_eq!(veils.pixel(x, y), expected, "{place}");
                count += expected.len();
            }
        }
    }
    count / SimdLevel::available().len()
}

#[test]
fn equals_brute_force_from_outside_inside_and_within() {
    let soup = Mesh::soup(1, 120, 0.5, 1.0);
    let outside = looking(Vec3::new(2.0, 1.0, 3.0), Vec3::ZERO, 0.4, [43, 30]);
    let inside = looking(Vec3::new(0.1, 0.1, 0.1), Vec3::X, 1.0, [43, 30]);
    for (name, view) in [("outside", outside), ("inside", inside)] {
        for opaque in [0, 2, 5] {
            let hits = check(name, &soup, view, opaque, 64);
            assert!(hits > 250, "{name}: {hits} hits prove little");
        }
    }
    let blob = Mesh::blob(20);
    check(
        "tiny",
        &blob,
        looking(Vec3::new(0.5, 1.5, 9.0), Vec3::ZERO, 0.3, [40, 40]),
        0,
        20,
    );
    check(
        "sides",
        &blob,
        looking(Vec3::new(0.5, 1.5, 3.0), Vec3::ZERO, 0.5, [33, 41]),
        3,
        12,
    );
}

#[test]
fn equals_brute_force_on_awkward_triangles_and_in_parallel_views() {
    let mesh = Mesh::awkward();
    let from = Vec3::new(0.3, 0.2, 2.5);
    check("awkward", &mesh, looking(from, Vec3::ZERO, 0.4, [48, 36]), 0, 64);
    // Within the pile: what lies behind the start of a parallel view is not seen.
    for center in [from, Vec3::ZERO] {
        let view = View::parallel(
            center,
            axes(DVec3::new(-0.2, -0.1, -1.0)),
            [1.0, 0.8],
            1e6,
            [40, 32],
        );
        check("parallel", &mesh, view, 4, 64);
    }
}

#[test]
fn equals_brute_force_at_any_scale() {
    for (scale, offset) in [(1e-3, 1.0), (1e3, 1e6), (1e6, 0.0)] {
        let offset = Vec3::new(offset, -offset, offset * 0.5);
        let mesh = Mesh::blob(12).scaled(scale, offset);
        let from = Vec3::new(0.5, 1.5, 3.0) * scale + offset;
        check(
            &format!("scale {scale}"),
            &mesh,
            looking(from, offset, 0.4, [32, 24]),
            3,
            64,
        );
    }
}
