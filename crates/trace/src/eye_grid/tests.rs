//! The eye grid against brute force, at every level and in every arrangement.

use glam::{DVec3, Vec3};

use super::*;
use crate::Clusters;
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

/// The ways to build and trace that must not differ.
fn arrangements() -> Vec<(EyeGridOptions, bool)> {
    let flat = EyeGridOptions {
        tile: 20,
        binning: Binning::Rectangle,
        hierarchy: false,
    };
    let uneven = EyeGridOptions {
        tile: 36,
        binning: Binning::Rectangle,
        hierarchy: true,
    };
    vec![
        (EyeGridOptions::default(), false),
        (EyeGridOptions::default(), true),
        (flat, false),
        (flat, true),
        (uneven, true),
    ]
}

/// Compares all arrangements at all levels with brute force; returns what the default one over clusters counted.
fn check_against(name: &str, mesh: &Mesh, clusters: &Clusters, view: View) -> EyeCounts {
    let triangles = mesh.triangles();
    let mut expected = Vec::new();
    for y in 0..view.height {
        for x in 0..view.width {
            expected.push(brute(&triangles, &view.pixel_ray(x, y)));
        }
    }
    let mut counts = EyeCounts::default();
    for level in SimdLevel::available() {
        for (i, (options, clustered)) in arrangements().into_iter().enumerate() {
            let grid = if clustered {
                EyeGrid::build_clustered(view, triangles, clusters, options, level)
            } else {
                EyeGrid::build(view, triangles, options, level)
            };
            let mut hits = TileHits::default();
            for index in 0..grid.tile_count() {
                let tile = grid.tile(index);
                grid.trace_tile(&tile, &mut hits);
                for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                    let (px, py) = (tile.x + x, tile.y + y);
                    let want = expected[(py * view.width + px) as usize];
                    let (got, level) = (hits.prim(x, y), level.name());
                    assert_eq!(
                        got, want,
                        "{name}, {level}, {options:?}, clusters {clustered}, pixel {px} {py}"
                    );
                }
            }
            if i == 1 {
                counts = hits.counts;
            }
        }
    }
    counts
}

fn check(name: &str, mesh: &Mesh, view: View) -> EyeCounts {
    let counts = check_against(name, mesh, &Clusters::new(&mesh.triangles()), view);
    println!("{name}: {counts:?}");
    counts
}

#[test]
fn equals_brute_force_from_outside_inside_and_within() {
    let size = [97, 61];
    let soup = Mesh::soup(1, 300, 0.3, 1.0);
    check(
        "soup outside",
        &soup,
        looking(Vec3::new(2.0, 1.0, 3.0), Vec3::ZERO, 0.5, size),
    );
    check(
        "soup inside",
        &soup,
        looking(Vec3::new(0.1, 0.1, 0.1), Vec3::X, 1.0, size),
    );
    let blob = Mesh::blob(24);
    check(
        "blob outside",
        &blob,
        looking(Vec3::new(0.5, 1.5, 3.0), Vec3::ZERO, 0.5, size),
    );
    check(
        "blob inside",
        &blob,
        looking(Vec3::new(0.05, 0.0, 0.1), Vec3::NEG_X, 2.0, size),
    );
    // Triangles of less than a pixel, of a few pixels, of a few blocks.
    for (rings, distance) in [(60, 9.0), (40, 5.0), (14, 2.5)] {
        let blob = Mesh::blob(rings);
        let from = Vec3::new(0.05, 0.15, 1.0) * distance;
        check("sizes", &blob, looking(from, Vec3::ZERO, 0.5, size));
    }
}

#[test]
fn equals_brute_force_on_awkward_triangles() {
    let mesh = Mesh::awkward();
    let size = [64, 64];
    check(
        "awkward",
        &mesh,
        looking(Vec3::new(0.3, 0.2, 2.5), Vec3::ZERO, 0.4, size),
    );
    check(
        "awkward, low",
        &mesh,
        looking(
            Vec3::new(0.0, -0.79999, 2.5),
            Vec3::new(0.0, -0.7, 0.0),
            0.7,
            size,
        ),
    );
    check(
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
    check("lattice", &lattice, head_on);
    let parallel = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.0, 8.0], 40.0, [64, 64]);
    check("lattice, parallel", &lattice, parallel);
    let through_vertices = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.5, 8.5], 40.0, [17, 17]);
    check("lattice, parallel, vertices", &lattice, through_vertices);
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
            check(&name, &mesh, looking(from, offset, 0.5, [48, 40]));
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
        check("parallel", &soup, view);
        let within = View::parallel(Vec3::ZERO, axes, [1.5, 1.2], 40.0, [80, 64]);
        check("parallel, from within", &soup, within);
    }
}

#[test]
fn empty_input_gives_empty_tiles() {
    check(
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
        check(
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
    check(
        "thin",
        &mesh,
        View::perspective(Vec3::ZERO, axes, [1.0, 1.0], [63, 63]),
    );
}

#[test]
fn hidden_clusters_are_skipped_and_nothing_else() {
    // Walls behind each other, finely divided, the farthest first; one has a hole, and something leans on it.
    let mut mesh = Mesh::default();
    let cells = 24;
    for wall in (0..6).rev() {
        for cell in 0..cells * cells {
            let (i, j) = (cell % cells, cell / cells);
            if wall < 3 && i > 10 && i < 14 && j > 10 && j < 14 {
                continue;
            }
            let at = |di: i32, dj: i32| {
                let step = 2.0 / cells as f32;
                let (x, y) = ((i + di) as f32 * step - 1.0, (j + dj) as f32 * step - 1.0);
                Vec3::new(x, y, -0.1 * wall as f32 + 0.05 * x) * 1.5
            };
            mesh.triangle([at(0, 0), at(1, 0), at(1, 1)]);
            mesh.triangle([at(0, 0), at(1, 1), at(0, 1)]);
        }
    }
    let leaning = [
        Vec3::new(-0.4, -0.4, 0.3),
        Vec3::new(0.4, -0.4, 0.3),
        Vec3::new(0.0, 0.6, -0.5),
    ];
    mesh.triangle(leaning);
    let view = looking(Vec3::new(0.2, 0.1, 3.0), Vec3::ZERO, 0.4, [160, 130]);
    let counts = check("walls", &mesh, view);
    assert!(counts.clusters_hidden * 3 > counts.clusters, "{counts:?}");
    assert!(counts.set_up * 4 < counts.triangles * 3, "{counts:?}");
}

#[test]
fn clusters_survive_animation() {
    let mut mesh = Mesh::soup(9, 500, 0.2, 1.0);
    let clusters = Clusters::new(&mesh.triangles());
    let mut numbers = Numbers(5);
    for i in 0..mesh.x.len() {
        let p = numbers.point();
        (mesh.x[i], mesh.y[i], mesh.z[i]) = (mesh.y[i] + 0.2 * p.x, p.y, mesh.x[i] - p.z);
    }
    let view = looking(Vec3::new(1.0, 0.5, 2.0), Vec3::ZERO, 0.7, [90, 70]);
    check_against("moved", &mesh, &clusters, view);
}

#[test]
fn any_number_of_threads_gives_the_same_lists() {
    let mesh = Mesh::soup(4, 20_000, 0.1, 1.0);
    let clusters = Clusters::new(&mesh.triangles());
    let view = looking(Vec3::new(0.0, 0.2, 1.5), Vec3::ZERO, 1.0, [300, 200]);
    let lists = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let (triangles, options) = (mesh.triangles(), EyeGridOptions::default());
        let build = || EyeGrid::build_clustered(view, triangles, &clusters, options, SimdLevel::detect());
        let grid = pool.install(build);
        let mut hits = TileHits::default();
        let mut all = Vec::new();
        for index in 0..grid.tile_count() {
            let tile = grid.tile(index);
            grid.trace_tile(&tile, &mut hits);
            all.extend(
                (0..tile.height)
                    .flat_map(|y| (0..tile.width).map(move |x| (x, y)))
                    .map(|(x, y)| hits.prim(x, y)),
            );
        }
        (grid.reference_count(), hits.counts, all)
    };
    assert_eq!(lists(1), lists(2));
}

#[test]
fn blocks_show_what_pixels_do() {
    let mesh = Mesh::blob(20);
    let view = looking(Vec3::new(0.5, 1.5, 3.0), Vec3::ZERO, 0.5, [70, 50]);
    let grid = EyeGrid::build(
        view,
        mesh.triangles(),
        EyeGridOptions::default(),
        SimdLevel::detect(),
    );
    let mut hits = TileHits::default();
    for index in 0..grid.tile_count() {
        let tile = grid.tile(index);
        grid.trace_tile(&tile, &mut hits);
        for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
            let block = hits.block(x / TileHits::BLOCK, y / TileHits::BLOCK);
            let lane = (y % TileHits::BLOCK * TileHits::BLOCK + x % TileHits::BLOCK) as usize;
            let prim = block.prim[lane];
            assert_eq!(hits.prim(x, y), (prim != BlockPixels::NONE).then_some(prim));
            if let Some(prim) = hits.prim(x, y) {
                let ray = view.pixel_ray(tile.x + x, tile.y + y);
                let hit = exact::hit(ray.origin, ray.dir, mesh.triangles().corners(prim)).unwrap();
                let nearness = f64::from(block.nearness[lane]) * hit.t;
                assert!((nearness - 1.0).abs() < 1e-5, "{nearness}");
            }
        }
    }
}
#[test]
fn equals_brute_force_with_a_triangle_of_any_size_in_view() {
    let size = [70, 45];
    for huge in [1e12, 1e19, 1e25, 1e30, 1e33, 1e38] {
        let mut mesh = Mesh::soup(6, 60, 0.3, 1.0);
        mesh.triangle([
            Vec3::new(-huge, -0.4 * huge, -huge),
            Vec3::new(huge, -0.5 * huge, -huge),
            Vec3::new(0.1 * huge, huge, -0.9 * huge),
        ]);
        mesh.triangle([
            Vec3::new(-huge, -1.0, huge),
            Vec3::new(huge, -1.0, huge),
            Vec3::new(0.0, -1.1, -huge),
        ]);
        let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, size);
        check(&format!("huge {huge:e}"), &mesh, view);
    }
}

#[test]
fn passes_come_nearer_and_end_with_what_is_seen() {
    let view = looking(Vec3::new(2.0, 1.0, 3.0), Vec3::ZERO, 0.5, [97, 61]);
    for mesh in [Mesh::soup(1, 300, 0.3, 1.0), Mesh::awkward()] {
        let triangles = mesh.triangles();
        let clusters = Clusters::new(&triangles);
        for (options, clustered) in arrangements() {
            let level = SimdLevel::detect();
            let grid = if clustered {
                EyeGrid::build_clustered(view, triangles, &clusters, options, level)
            } else {
                EyeGrid::build(view, triangles, options, level)
            };
            let (mut hits, mut seen, mut passes) = (TileHits::default(), 0, 0);
            for index in 0..grid.tile_count() {
                let tile = grid.tile(index);
                let mut last = vec![None; (tile.width * tile.height) as usize];
                grid.trace_tile_passes(&tile, &mut hits, |x, y, prim| {
                    let before = last[(y * tile.width + x) as usize].replace(prim);
                    let ray = view.pixel_ray(tile.x + x, tile.y + y);
                    let t = |prim| {
                        exact::hit(ray.origin, ray.dir, triangles.corners(prim))
                            .expect("a hit")
                            .t
                    };
                    let nearer = before.is_none_or(|before| (t(prim), prim) < (t(before), before));
                    assert!(nearer, "{before:?} before {prim}, {options:?}");
                    passes += 1;
                });
                for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                    let got = last[(y * tile.width + x) as usize];
                    assert_eq!(got, hits.prim(x, y), "{options:?}, clusters {clustered}");
                    seen += usize::from(got.is_some());
                }
            }
            // Object order finds farther ones first, and often.
            let (least, most) = if clustered {
                (seen, seen)
            } else {
                (seen + 1, seen * 10)
            };
            assert!(
                passes >= least && passes <= most,
                "{passes} passes for {seen} pixels"
            );
        }
    }
}
