//! Samples, cells and walks. That exact answers are right is a matter of `tests/conformance.rs`.

use glam::{DVec3, Vec3};

use super::build::Stack;
use super::levels::slots;
use super::samples::Sample;
use super::*;
use crate::test_meshes::{Mesh, Numbers};

fn meshes() -> [Mesh; 3] {
    [Mesh::soup(1, 300, 0.3, 1.0), Mesh::blob(24), Mesh::awkward()]
}

fn options(build: LdcBuild) -> LdcOptions {
    LdcOptions {
        resolution: 72,
        build,
        ..LdcOptions::default()
    }
}

const CENTRE: LdcBuild = LdcBuild::Csr(Coverage::Centre);

/// Prim, depth in texels and texel of all samples.
fn listed(stack: &Stack) -> Vec<(u32, f32, usize)> {
    fn list<D: Depth>(stack: &Stack, samples: &Layers<D>) -> Vec<(u32, f32, usize)> {
        (0..stack.raster.texels())
            .flat_map(|texel| {
                let range = stack.texels[texel].start as usize..stack.texels[texel + 1].start as usize;
                range
                    .map(|index| samples.get(index))
                    .map(move |s| (s.prim, s.depth.texels(stack.scale), texel))
            })
            .collect()
    }
    match &stack.samples {
        Samples::F16(s) => list(stack, s),
        Samples::U16(s) => list(stack, s),
        Samples::F32(s) => list(stack, s),
    }
}

/// Rays through the middle of things, a third of them along axes or in planes of two.
fn rays(seed: u64, count: usize) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|i| {
            let (from, mut dir) = (numbers.point() * 1.5, numbers.point());
            match i % 9 {
                0 => dir = Vec3::AXES[i / 9 % 3] * dir.x.signum(),
                1 | 2 => dir[i / 9 % 3] = 0.0,
                _ => {}
            }
            Ray::new(from, dir)
        })
        .collect()
}

#[test]
fn sweeping_and_peeling_make_the_same_samples() {
    for mesh in meshes() {
        for depth in [DepthFormat::F16, DepthFormat::U16, DepthFormat::F32] {
            let [swept, peeled] = [CENTRE, LdcBuild::Peel].map(|build| {
                let options = LdcOptions {
                    depth,
                    ..options(build)
                };
                Ldc::build(mesh.triangles(), &options)
            });
            assert!(swept.samples().iter().sum::<usize>() > 100);
            assert_eq!(swept.layers(), peeled.layers());
            for (a, b) in swept.cubes[0].stacks.iter().zip(&peeled.cubes[0].stacks) {
                assert_eq!(a, b);
            }
        }
    }
}

#[test]
fn layers_are_sorted_and_their_number_is_the_depth_complexity() {
    let mesh = Mesh::soup(2, 300, 0.3, 1.0);
    let ldc = Ldc::build(mesh.triangles(), &options(CENTRE));
    for stack in &ldc.cubes[0].stacks {
        let samples = listed(stack);
        let mut fullest = 0;
        for list in samples.chunk_by(|a, b| a.2 == b.2) {
            fullest = fullest.max(list.len() as u32);
            assert!(list.is_sorted_by(|a, b| a.1 < b.1));
        }
        assert_eq!(fullest, stack.layers);
        assert!(fullest > 3);
    }
}

#[test]
fn every_triangle_goes_to_the_direction_it_faces() {
    for mesh in meshes() {
        let triangles = mesh.triangles();
        let ldc = Ldc::build(triangles, &LdcOptions::default());
        let mut direction = vec![None; triangles.len()];
        for stack in &ldc.cubes[0].stacks {
            for (prim, _, _) in listed(stack) {
                let axis = direction[prim as usize].get_or_insert(stack.raster.axis);
                assert_eq!(*axis, stack.raster.axis);
            }
        }
        for (prim, axis) in direction.into_iter().enumerate() {
            let normal = triangles.normal(prim as u32).abs();
            // Conservative coverage leaves out none that takes part, slivers and coplanar ones included.
            assert_eq!(axis.is_none(), triangles.is_degenerate(prim as u32));
            let [a, b, c] = triangles.corners(prim as u32);
            let sound = normal.length() > 1e-6 * f64::from((b - a).length() * (c - a).length());
            if let Some(axis) = axis.filter(|_| sound) {
                assert_eq!(normal[axis], normal.max_element(), "triangle {prim}");
            }
        }
    }
}

#[test]
fn samples_between_two_depths_are_those_that_a_look_at_all_finds() {
    fn check<D: Depth>(scale: f32) {
        let mut numbers = Numbers(8);
        let mut lists = Vec::new();
        let mut layers = Layers::<D>::with_capacity(0);
        for length in 0..70 {
            let mut depths: Vec<f32> = (0..length)
                .map(|_| (numbers.next() * 40.0 + 45.0).round())
                .collect();
            depths.sort_by(f32::total_cmp);
            let start = layers.len();
            for depth in depths {
                layers.push(Sample {
                    prim: 0,
                    depth: D::stored(depth, scale),
                    slopes: [0; 2],
                });
            }
            lists.push(start..layers.len());
        }
        let layers = layers.finished();
        let mut found = 0;
        for list in lists {
            for _ in 0..40 {
                let low = (numbers.next() * 45.0 + 45.0).round();
                let high = low + (numbers.next() + 1.0).powi(4).round();
                let near = layers.between(list.clone(), [low, high], scale);
                let inside = |&i: &usize| (low..=high).contains(&layers.get(i).depth.texels(scale));
                let all: Vec<usize> = list.clone().filter(inside).collect();
                assert_eq!(near.clone().collect::<Vec<_>>(), all, "{list:?} {low} {high}");
                found += all.len();
            }
        }
        assert!(found > 2000, "{found}");
    }
    check::<f32>(96.0);
    check::<u16>(96.0);
    check::<half::f16>(96.0);
}

#[test]
fn cells_bound_their_samples() {
    for mesh in meshes() {
        for hierarchy in [Hierarchy::Pyramid, Hierarchy::Tiles { log2: [1, 4] }] {
            let options = LdcOptions {
                hierarchy,
                ..options(CENTRE)
            };
            let ldc = Ldc::build(mesh.triangles(), &options);
            for stack in &ldc.cubes[0].stacks {
                for (_, depth, texel) in listed(stack) {
                    let (tile, within) = (texel / 64, texel % 64);
                    let columns = stack.raster.size[0] as usize / 8;
                    let column = (tile % columns * 8 + within % 8) as u32;
                    let row = (tile / columns * 8 + within / 8) as u32;
                    assert_eq!(stack.raster.index(column, row), texel);
                    for level in &stack.levels {
                        let cell = level.cell(column >> level.shift[0], row >> level.shift[1]);
                        assert!(cell.min <= depth && depth <= cell.max);
                        assert!(cell.occupied & slots(depth, depth, 64.0 / stack.scale) != 0);
                    }
                }
            }
        }
    }
}

#[test]
fn all_hierarchies_find_the_same() {
    let tests = [
        HitTest::Strict { tolerance: 1.0 },
        HitTest::Interval { tolerance: 0.5 },
        HitTest::Plane { margin: 0.25 },
    ];
    for mesh in meshes() {
        let cubes = [
            Hierarchy::Flat,
            Hierarchy::Tiles { log2: [3, 3] },
            Hierarchy::Tiles { log2: [2, 4] },
            Hierarchy::Pyramid,
        ]
        .map(|hierarchy| {
            let options = LdcOptions {
                hierarchy,
                ..options(CENTRE)
            };
            Ldc::build(mesh.triangles(), &options)
        });
        let mut hits = 0;
        for ray in rays(3, 3000) {
            for test in tests {
                let [flat, rest @ ..] = cubes
                    .each_ref()
                    .map(|cube| cube.closest_sampled(&ray, test, &mut ()));
                assert!(
                    rest.iter().all(|found| *found == flat),
                    "{ray:?} {test:?}: {flat:?}, {rest:?}"
                );
                let any = cubes[3].any_sampled(&ray, test, &mut ());
                assert_eq!(any, flat.is_some(), "{ray:?} {test:?}");
                hits += usize::from(any);
            }
        }
        assert!(hits > 300, "{hits}");
    }
}

#[test]
fn the_pyramid_saves_steps() {
    let mesh = Mesh::blob(64);
    let steps = |hierarchy| {
        let options = LdcOptions {
            hierarchy,
            ..LdcOptions::default()
        };
        let ldc = Ldc::build(mesh.triangles(), &options);
        let mut steps = StepCounts::default();
        for ray in rays(4, 500) {
            ldc.closest(&ray, &mut steps);
        }
        steps
    };
    let [flat, tiles, pyramid] = [
        Hierarchy::Flat,
        Hierarchy::Tiles { log2: [3; 2] },
        Hierarchy::Pyramid,
    ]
    .map(steps);
    assert_eq!(flat.cells, 0);
    assert!(tiles.texels * 3 < flat.texels, "{tiles:?} {flat:?}");
    assert!(
        pyramid.cells + pyramid.texels < tiles.cells + tiles.texels,
        "{pyramid:?} {tiles:?}"
    );
    assert!(pyramid.triangles <= flat.triangles, "{pyramid:?} {flat:?}");
}

/// A square through the origin with this normal.
fn square(normal: Vec3) -> Mesh {
    let right = normal.any_orthonormal_vector();
    let up = normal.cross(right);
    let corner = |x: f32, y: f32| right * x + up * y;
    let mut mesh = Mesh::default();
    mesh.triangle([corner(-1., -1.), corner(1., -1.), corner(1., 1.)]);
    mesh.triangle([corner(-1., -1.), corner(1., 1.), corner(-1., 1.)]);
    mesh
}

/// Shares of the rays through a plane of any orientation that miss it, and the largest error of a hit in texels.
fn plane_rates(test: HitTest, planes: u64, rays: usize) -> (f64, f64) {
    let (mut cast, mut missed, mut worst) = (0, 0, 0.0f64);
    for seed in 0..planes {
        let mut numbers = Numbers(seed);
        let normal = numbers.point().normalize_or(Vec3::X);
        let mesh = square(normal);
        let ldc = Ldc::build(mesh.triangles(), &options(CENTRE));
        for _ in 0..rays {
            let target = mesh
                .triangles()
                .corners(0)
                .into_iter()
                .map(|c| c * (0.25 * numbers.next()))
                .sum::<Vec3>();
            let dir = numbers.point();
            if dir.normalize().dot(normal).abs() < 0.05 {
                continue;
            }
            let ray = Ray::new(target - dir, dir);
            cast += 1;
            let truth = f64::from(-ray.origin.dot(normal) / dir.dot(normal));
            match ldc.closest_sampled(&ray, test, &mut ()) {
                None => missed += 1,
                Some(hit) => {
                    let error = (f64::from(hit.t) - truth).abs() * f64::from(dir.length()) / ldc.texel_size();
                    worst = worst.max(error);
                }
            }
        }
    }
    (f64::from(missed) / f64::from(cast), worst)
}

#[test]
fn hit_tests_miss_planes_as_often_as_derived() {
    // Rates of 4e4 rays on planes of every orientation: 3.1 % at a tolerance of one texel, 22.5 % at half of one.
    let (missed, _) = plane_rates(HitTest::Strict { tolerance: 1.0 }, 60, 400);
    assert!((0.005..0.07).contains(&missed), "{missed}");
    let (missed, _) = plane_rates(HitTest::Strict { tolerance: 0.5 }, 60, 400);
    assert!((0.14..0.32).contains(&missed), "{missed}");
    let (missed, worst) = plane_rates(HitTest::Interval { tolerance: 1.0 }, 60, 400);
    assert_eq!(missed, 0.0);
    assert!(worst > 0.5, "{worst}");
    // Slopes are known to 1/254: neighbouring samples do not quite join, and a ray at 3 degrees makes twenty times
    // of the difference.
    let (missed, worst) = plane_rates(HitTest::Plane { margin: 0.0 }, 60, 400);
    assert!(missed < 0.01, "{missed}");
    assert!(worst < 0.2, "{worst}");
    let (missed, worst) = plane_rates(HitTest::Plane { margin: 0.25 }, 60, 400);
    assert_eq!(missed, 0.0);
    assert!(worst < 0.2, "{worst}");
}

#[test]
fn rays_that_leave_a_surface_do_not_hit_it() {
    let mut numbers = Numbers(9);
    for _ in 0..40 {
        let normal = numbers.point().normalize_or(Vec3::X);
        let mesh = square(normal);
        let ldc = Ldc::build(mesh.triangles(), &options(CENTRE));
        for _ in 0..100 {
            let from = mesh
                .triangles()
                .corners(0)
                .into_iter()
                .map(|c| c * (0.3 * numbers.next()))
                .sum::<Vec3>();
            let dir = numbers.point();
            if dir.normalize().dot(normal).abs() < 0.02 {
                continue;
            }
            let ray = ldc.leaving(from, normal, dir);
            for test in [
                HitTest::Plane { margin: 0.25 },
                HitTest::Interval { tolerance: 0.5 },
            ] {
                assert!(!ldc.any_sampled(&ray, test, &mut ()), "{ray:?}");
            }
        }
    }
}

#[test]
fn building_does_not_depend_on_the_number_of_threads() {
    let mesh = Mesh::soup(5, 20_000, 0.1, 1.0);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let ldc = pool.install(|| Ldc::build(mesh.triangles(), &options(LdcOptions::default().build)));
        ldc.cubes[0].stacks.clone()
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn too_many_samples_make_a_smaller_cube() {
    let mesh = Mesh::soup(6, 400, 1.0, 1.0);
    let build = |max_samples| {
        let options = LdcOptions {
            max_samples,
            ..LdcOptions::default()
        };
        Ldc::build(mesh.triangles(), &options)
    };
    let (large, small) = (build(u64::MAX), build(200_000));
    assert!(large.samples().iter().sum::<usize>() > 1_000_000);
    let samples = small.samples().iter().sum::<usize>();
    assert!((20_000..200_000).contains(&samples), "{samples}");
    for ray in rays(7, 300) {
        assert_eq!(small.intersect(&ray), large.intersect(&ray));
    }
}

#[test]
fn nothing_is_hit_in_an_empty_cube() {
    let mesh = Mesh::default();
    for build in [CENTRE, LdcBuild::Peel, LdcOptions::default().build] {
        let ldc = Ldc::build(mesh.triangles(), &options(build));
        let ray = Ray::new(Vec3::ONE, Vec3::NEG_ONE);
        assert_eq!(ldc.intersect(&ray), None);
        assert_eq!(
            ldc.closest_sampled(&ray, HitTest::Plane { margin: 1.0 }, &mut ()),
            None
        );
    }
    assert_eq!(axis_order(DVec3::new(1.0, -3.0, 2.0)), [1, 2, 0]);
}
