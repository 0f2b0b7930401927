//! The eye grid against brute force, at every level and in every arrangement.

use glam::{DVec3, Vec3};

use super::*;
use crate::kernel::SimdLevel;
use crate::test_meshes::{Mesh, Numbers, axes, looking};

/// Closest triangle by testing all.
fn brute(triangles: &Triangles, ray: &ViewRay) -> Option<u32> {
    let hits = (0..triangles.len() as u32).filter_map(|prim| {
        let corners = triangles.corners(prim);
        let finite = corners.iter().all(|c| c.is_finite());
        let hit = finite
            .then(|| exact::hit(ray.origin, ray.dir, corners))
            .flatten()?;
        (hit.t > 0.0).then_some((hit.t, prim))
    });
    hits.reduce(|a, b| if b.0 < a.0 { b } else { a })
        .map(|(_, prim)| prim)
}

fn check(name: &str, mesh: &Mesh, view: View, options: EyeGridOptions) -> (usize, usize) {
    let triangles = mesh.triangles();
    let mut expected = Vec::new();
    for y in 0..view.height {
        for x in 0..view.width {
            expected.push(brute(&triangles, &view.pixel_ray(x, y)));
        }
    }
    let mut exact_pixels = 0;
    for level in SimdLevel::available() {
        let grid = EyeGrid::build(view, triangles, options, level);
        let mut hits = TileHits::default();
        for index in 0..grid.tile_count() {
            let tile = grid.tile(index);
            grid.trace_tile(&tile, &mut hits);
            exact_pixels += hits.exact_pixels;
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let (px, py) = (tile.x + x, tile.y + y);
                    let want = expected[(py * view.width + px) as usize];
                    let got = hits.prim(x, y);
                    assert_eq!(
                        got,
                        want,
                        "{name}, {}, {options:?}, pixel {px} {py}",
                        level.name()
                    );
                }
            }
        }
    }
    let levels = SimdLevel::available().len();
    (expected.iter().flatten().count(), exact_pixels / levels)
}

fn check_both(name: &str, mesh: &Mesh, view: View) {
    let (covered, exact) = check(name, mesh, view, EyeGridOptions::default());
    println!("{name}: {covered} pixels covered, {exact} decided exactly");
    check(
        name,
        mesh,
        view,
        EyeGridOptions {
            tile: 20,
            binning: Binning::Rectangle,
        },
    );
}

#[test]
fn equals_brute_force_from_outside_inside_and_within() {
    let size = [97, 61];
    let soup = Mesh::soup(1, 300, 0.3, 1.0);
    check_both(
        "soup outside",
        &soup,
        looking(Vec3::new(2.0, 1.0, 3.0), Vec3::ZERO, 0.5, size),
    );
    check_both(
        "soup inside",
        &soup,
        looking(Vec3::new(0.1, 0.1, 0.1), Vec3::X, 1.0, size),
    );
    let blob = Mesh::blob(24);
    check_both(
        "blob outside",
        &blob,
        looking(Vec3::new(0.5, 1.5, 3.0), Vec3::ZERO, 0.5, size),
    );
    check_both(
        "blob inside",
        &blob,
        looking(Vec3::new(0.05, 0.0, 0.1), Vec3::NEG_X, 2.0, size),
    );
    let fine = Mesh::blob(60);
    check_both(
        "tiny triangles",
        &fine,
        looking(Vec3::new(0.5, 1.5, 9.0), Vec3::ZERO, 0.5, size),
    );
}

#[test]
fn equals_brute_force_on_awkward_triangles() {
    let mesh = Mesh::awkward();
    let size = [64, 64];
    check_both(
        "awkward",
        &mesh,
        looking(Vec3::new(0.3, 0.2, 2.5), Vec3::ZERO, 0.4, size),
    );
    check_both(
        "awkward, low",
        &mesh,
        looking(
            Vec3::new(0.0, -0.79999, 2.5),
            Vec3::new(0.0, -0.7, 0.0),
            0.7,
            size,
        ),
    );
    check_both(
        "on a plane",
        &mesh,
        looking(Vec3::new(0.3, -0.8, 2.5), Vec3::new(0.3, -0.8, 0.0), 0.7, size),
    );
    // Rays along lattice directions of a lattice mesh pass exactly through vertices and edges.
    let mut lattice = Mesh::default();
    for i in 0..16 {
        for j in 0..16 {
            let p = |di: i32, dj: i32| Vec3::new((i + di - 8) as f32, (j + dj - 8) as f32, 0.0);
            lattice.triangle([p(0, 0), p(1, 0), p(1, 1)]);
            lattice.triangle([p(0, 0), p(1, 1), p(0, 1)]);
        }
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let head_on = View::perspective(Vec3::new(0.0, 0.0, 8.0), axes, [1.0, 1.0], [63, 63]);
    check_both("lattice", &lattice, head_on);
    let parallel = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.0, 8.0], 40.0, [64, 64]);
    check_both("lattice, parallel", &lattice, parallel);
    let through_vertices = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.5, 8.5], 40.0, [17, 17]);
    check_both("lattice, parallel, vertices", &lattice, through_vertices);
}

#[test]
fn equals_brute_force_at_any_scale_and_offset() {
    for scale in [1e-3, 1.0, 1e3, 1e6] {
        for offset in [0.0, 1e3, 1e6] {
            let offset = Vec3::new(offset, -offset, offset * 0.5);
            let mesh = Mesh::blob(12).scaled(scale, offset);
            let from = Vec3::new(0.5, 1.5, 3.0) * scale + offset;
            if from == offset {
                continue;
            }
            let name = format!("scale {scale}, offset {offset}");
            check_both(&name, &mesh, looking(from, offset, 0.5, [48, 40]));
        }
    }
}

#[test]
fn equals_brute_force_in_parallel_views() {
    let soup = Mesh::soup(2, 300, 0.3, 1.0);
    for direction in [DVec3::new(1.0, -2.0, 0.5), DVec3::NEG_Z] {
        let axes = axes(direction);
        let view = View::parallel(
            (direction.normalize() * -4.0).as_vec3(),
            axes,
            [1.5, 1.2],
            40.0,
            [80, 64],
        );
        check_both("parallel", &soup, view);
        let within = View::parallel(Vec3::ZERO, axes, [1.5, 1.2], 40.0, [80, 64]);
        check_both("parallel, from within", &soup, within);
    }
}

#[test]
fn empty_input_gives_empty_tiles() {
    check_both(
        "empty",
        &Mesh::default(),
        looking(Vec3::Z, Vec3::ZERO, 0.5, [20, 20]),
    );
}

/// Coordinates with so few bits that sums of a few are exact.
fn coarse(p: Vec3) -> Vec3 {
    (p * 1048576.0).round() / 1048576.0
}

#[test]
fn an_eye_within_a_triangle_does_not_see_it() {
    let mut numbers = Numbers(77);
    for _ in 0..24 {
        let mut mesh = Mesh::soup(3, 10, 0.5, 1.0);
        let corners = [(); 3].map(|()| coarse(numbers.point()));
        mesh.triangle(corners);
        let eye = (corners[0] * 2.0 + corners[1] + corners[2]) * 0.25;
        check_both(
            "within",
            &mesh,
            looking(eye, eye + numbers.point(), 1.0, [16, 16]),
        );
    }
}

#[test]
fn a_triangle_whose_volume_rounds_to_nothing_is_still_seen() {
    let mut mesh = Mesh::default();
    let far = [(-20.0, -20.0), (20.0, -20.0), (0.0, 20.0)];
    mesh.triangle(far.map(|(x, y)| Vec3::new(x, y, -10.0)));
    let thin = 1e-30;
    mesh.triangle([
        Vec3::new(-1.0, -thin, -2.0),
        Vec3::new(1.0, -thin, -2.0),
        Vec3::new(0.0, thin, -5.0),
    ]);
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    check_both(
        "thin",
        &mesh,
        View::perspective(Vec3::ZERO, axes, [1.0, 1.0], [63, 63]),
    );
}
