//! The cube on a device beside `trace::ldc`, and exact answers beside brute force.

use std::collections::BTreeSet;

use glam::{DVec3, Vec3};
use rayward_trace::ldc::{Coverage, DepthFormat, Hierarchy, HitTest, LdcBuild, TexelSample};
use rayward_trace::{Accel, BruteForce, Bvh, Hit, Ldc, LdcOptions, Light, Ray, Receiver, SurfaceRay};

use super::{Cube, CubeOptions, StillCube};
use crate::tests::{Mesh, Numbers, gpu, meshes, rays};
use crate::{Error, Gpu};

const CENTRE: LdcBuild = LdcBuild::Csr(Coverage::Centre);
const CONSERVATIVE: LdcBuild = LdcBuild::Csr(Coverage::Conservative);

fn options(build: LdcBuild) -> CubeOptions {
    CubeOptions {
        resolution: 72,
        build,
        ..CubeOptions::default()
    }
}

fn reference(options: &CubeOptions) -> LdcOptions {
    LdcOptions {
        resolution: options.resolution,
        build: options.build,
        depth: DepthFormat::F32,
        hierarchy: options.hierarchy,
        max_samples: u64::MAX,
    }
}

/// Rays through the middle of things, a third of them along axes or in planes of two.
fn built<'a>(gpu: &'a Gpu, mesh: &'a Mesh, options: &CubeOptions) -> Cube<'a> {
    Cube::build(gpu, mesh.triangles(), options).unwrap_or_else(|e| panic!("{e}"))
}

fn samples(cube: &Cube, axis: usize) -> Vec<TexelSample> {
    cube.texel_samples(axis).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn sweeping_and_peeling_make_the_same_samples() {
    let Some(gpu) = gpu() else { return };
    for mesh in meshes() {
        let [swept, peeled] = [CENTRE, LdcBuild::Peel].map(|build| built(&gpu, &mesh, &options(build)));
        assert_eq!(swept.layers(), peeled.layers());
        for axis in 0..3 {
            let (a, b) = (samples(&swept, axis), samples(&peeled, axis));
            assert!(a.len() > 100);
            assert_eq!(a, b, "axis {axis}");
        }
    }
}

/// The lump in whole 1/256ths of a texel of a cube of this resolution, so that f32 rounds nothing.
fn on_lattice(resolution: u32) -> Mesh {
    let mut mesh = Mesh::lump(20);
    let size = (resolution - 2) as f32;
    let least = [&mesh.x, &mesh.y, &mesh.z].map(|v| v.iter().copied().fold(f32::INFINITY, f32::min));
    let extent = [&mesh.x, &mesh.y, &mesh.z]
        .iter()
        .zip(least)
        .map(|(v, low)| v.iter().copied().fold(0.0, |m: f32, x| m.max(x - low)))
        .fold(0.0, f32::max);
    for (values, low) in [&mut mesh.x, &mut mesh.y, &mut mesh.z].into_iter().zip(least) {
        for value in values.iter_mut() {
            *value = ((*value - low) / extent * size * 256.0).round() / 256.0;
        }
    }
    mesh
}

#[test]
fn samples_are_those_of_the_reference() {
    let Some(gpu) = gpu() else { return };
    for build in [CENTRE, CONSERVATIVE] {
        let (exact, rounded) = (on_lattice(72), Mesh::soup(1, 300, 0.3));
        for (mesh, exact) in [(&exact, true), (&rounded, false)] {
            let options = options(build);
            let cube = built(&gpu, mesh, &options);
            let ldc = Ldc::build(mesh.triangles(), &reference(&options));
            assert_eq!(cube.frame(), ldc.frame());
            for axis in 0..3 {
                let (own, other) = (samples(&cube, axis), ldc.texel_samples(axis));
                let places =
                    |all: &[TexelSample]| all.iter().map(|s| (s.texel, s.prim)).collect::<BTreeSet<_>>();
                let (a, b) = (places(&own), places(&other));
                let different = a.symmetric_difference(&b).count();
                let allowed = if exact { 0 } else { b.len() / 500 };
                assert!(
                    different <= allowed,
                    "{build:?}, axis {axis}: {different} of {}",
                    b.len()
                );
                let depths: std::collections::BTreeMap<_, _> =
                    other.iter().map(|s| ((s.texel, s.prim), s)).collect();
                for sample in &own {
                    let Some(same) = depths.get(&(sample.texel, sample.prim)) else {
                        continue;
                    };
                    let near = (sample.depth - same.depth).abs() < 0.01;
                    assert!(near || sample.slopes.is_none(), "{sample:?} {same:?}");
                }
            }
        }
    }
}

#[test]
fn exact_answers_are_those_of_brute_force() {
    let Some(gpu) = gpu() else { return };
    for (mesh, resolution) in meshes().iter().zip([72, 256, 200]) {
        let brute = BruteForce::new(mesh.triangles());
        for hierarchy in [
            Hierarchy::Pyramid,
            Hierarchy::Flat,
            Hierarchy::Tiles { log2: [2, 4] },
        ] {
            let options = CubeOptions {
                resolution,
                hierarchy,
                ..CubeOptions::default()
            };
            let cube = built(&gpu, mesh, &options);
            let rays = rays(11, 3000);
            let (hits, stats) = cube.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
            let mut count = 0;
            for (ray, hit) in rays.iter().zip(&hits) {
                assert_eq!(*hit, brute.intersect(ray), "{ray:?}");
                count += usize::from(hit.is_some());
            }
            assert!(count > 300, "{count}");
            assert!(stats.unsure < rays.len() / 3, "{stats:?}");
        }
    }
}

#[test]
fn what_the_device_calls_certain_is_certain() {
    let Some(gpu) = gpu() else { return };
    // An accel that knows nothing: every answer that is left is the device's own.
    struct Silent;
    impl Accel for Silent {
        fn intersect(&self, _: &Ray) -> Option<Hit> {
            None
        }
        fn all_hits(&self, _: &Ray, hits: &mut Vec<Hit>) {
            hits.clear();
        }
        fn shadowed(&self, _: &Receiver, _: &Light) -> bool {
            false
        }
    }
    let mesh = Mesh::lump(60);
    let brute = BruteForce::new(mesh.triangles());
    let cube = built(&gpu, &mesh, &CubeOptions::default());
    let rays = rays(3, 2000);
    let (hits, stats) = cube.closest(&rays, &Silent).unwrap_or_else(|e| panic!("{e}"));
    let missed = rays
        .iter()
        .zip(&hits)
        .filter(|(ray, hit)| {
            let truth = brute.intersect(ray);
            assert!(hit.is_none() || **hit == truth, "{ray:?} {hit:?} {truth:?}");
            **hit != truth
        })
        .count();
    assert!(missed <= stats.unsure, "{missed} {stats:?}");
    assert!(stats.unsure < rays.len() / 50, "{stats:?}");
    let not_exact = built(&gpu, &mesh, &options(CENTRE));
    let (_, stats) = not_exact.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(stats.unsure, rays.len());
}

#[test]
fn shadows_are_those_of_brute_force() {
    let Some(gpu) = gpu() else { return };
    for mesh in meshes() {
        let brute = BruteForce::new(mesh.triangles());
        let cube = built(&gpu, &mesh, &CubeOptions::default());
        let mut queries = Vec::new();
        for ray in rays(7, 1500) {
            let Some((prim, hit)) = brute.closest(&ray) else {
                continue;
            };
            let receiver = Receiver::on_surface(&ray, hit.t, prim);
            queries.push((receiver, Light::Point(Vec3::new(1.6, 0.3, 1.2))));
            queries.push((receiver, Light::Directional(Vec3::new(0.2, 0.5, 1.0))));
            queries.push((
                Receiver::free(ray.origin.as_dvec3()),
                Light::Point(Vec3::new(0.1, 0.2, 0.3)),
            ));
        }
        let (dark, stats) = cube.shadowed(&queries, &brute).unwrap_or_else(|e| panic!("{e}"));
        for ((receiver, light), dark) in queries.iter().zip(&dark) {
            assert_eq!(*dark, brute.shadowed(receiver, light), "{receiver:?} {light:?}");
        }
        let count = dark.iter().filter(|d| **d).count();
        assert!(
            count > 100 && count < queries.len() - 100,
            "{count} of {}",
            queries.len()
        );
        assert!(stats.unsure < queries.len() / 3, "{stats:?}");
    }
}

#[test]
fn rays_that_leave_surfaces_meet_what_brute_force_does() {
    let Some(gpu) = gpu() else { return };
    for (k, mesh) in meshes().iter().enumerate() {
        let (brute, bvh) = (BruteForce::new(mesh.triangles()), Bvh::build(mesh.triangles()));
        let cube = built(&gpu, mesh, &CubeOptions::default());
        let mut numbers = Numbers(23);
        let leaving: Vec<SurfaceRay> = rays(8, 3000)
            .iter()
            .filter_map(|ray| {
                let (prim, hit) = brute.closest(ray)?;
                Some(SurfaceRay {
                    from: Receiver::on_surface(ray, hit.t, prim),
                    dir: numbers.point(),
                })
            })
            .collect();
        let (hits, stats) = cube.after(&leaving, &bvh).unwrap_or_else(|e| panic!("{e}"));
        for (ray, hit) in leaving.iter().zip(&hits) {
            assert_eq!(*hit, brute.after(ray), "{ray:?}");
        }
        let count = hits.iter().flatten().count();
        assert!(count > 100, "{count} of {}", leaving.len());
        // The last mesh has triangles within others, where nothing is certain.
        assert!(k == 2 || stats.unsure < leaving.len() / 5, "{stats:?}");
    }
}

#[test]
fn hits_of_samples_are_those_of_the_reference() {
    let Some(gpu) = gpu() else { return };
    let tests = [
        HitTest::Strict { tolerance: 1.0 },
        HitTest::Interval { tolerance: 0.5 },
        HitTest::Plane { margin: 0.25 },
    ];
    let mesh = Mesh::lump(40);
    for build in [CENTRE, CONSERVATIVE] {
        let options = CubeOptions {
            resolution: 128,
            build,
            ..CubeOptions::default()
        };
        let cube = built(&gpu, &mesh, &options);
        let ldc = Ldc::build(mesh.triangles(), &reference(&options));
        let rays = rays(5, 3000);
        for test in tests {
            let (hits, _) = cube
                .closest_sampled(&rays, test)
                .unwrap_or_else(|e| panic!("{e}"));
            let (mut different, mut count) = (0, 0);
            for (ray, hit) in rays.iter().zip(&hits) {
                let other = ldc.closest_sampled(ray, test, &mut ());
                count += usize::from(other.is_some());
                let same = match (hit, &other) {
                    (None, None) => true,
                    (Some(a), Some(b)) => {
                        a.prim == b.prim
                            && f64::from((a.t - b.t).abs() * ray.dir.length()) < 0.01 * ldc.texel_size()
                    }
                    _ => false,
                };
                different += usize::from(!same);
            }
            assert!(count > 300, "{count}");
            assert!(
                different * 200 <= count,
                "{build:?} {test:?}: {different} of {count}"
            );
        }
    }
}

#[test]
fn levels_save_steps_and_change_nothing() {
    let Some(gpu) = gpu() else { return };
    let mesh = Mesh::lump(40);
    let rays = rays(9, 1000);
    let test = HitTest::Plane { margin: 0.25 };
    let [flat, tiles, pyramid] = [
        Hierarchy::Flat,
        Hierarchy::Tiles { log2: [3; 2] },
        Hierarchy::Pyramid,
    ]
    .map(|hierarchy| {
        let options = CubeOptions {
            resolution: 256,
            build: CENTRE,
            hierarchy,
            ..CubeOptions::default()
        };
        let cube = built(&gpu, &mesh, &options);
        cube.closest_sampled(&rays, test)
            .unwrap_or_else(|e| panic!("{e}"))
    });
    assert_eq!(flat.0, tiles.0);
    assert_eq!(flat.0, pyramid.0);
    let [flat, tiles, pyramid] = [flat, tiles, pyramid].map(|(_, stats)| stats.steps);
    assert_eq!(flat.cells, 0);
    assert!(tiles.texels * 3 < flat.texels, "{tiles:?} {flat:?}");
    assert!(
        pyramid.cells + pyramid.texels < tiles.cells + tiles.texels,
        "{pyramid:?} {tiles:?}"
    );
}

#[test]
fn too_many_samples_make_a_smaller_cube() {
    let Some(gpu) = gpu() else { return };
    let mesh = Mesh::soup(6, 400, 1.0);
    let options = CubeOptions {
        max_samples: 200_000,
        ..CubeOptions::default()
    };
    let cube = built(&gpu, &mesh, &options);
    assert!((20_000..200_000).contains(&cube.samples()), "{}", cube.samples());
    let brute = BruteForce::new(mesh.triangles());
    let rays = rays(7, 500);
    let (hits, _) = cube.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
    for (ray, hit) in rays.iter().zip(&hits) {
        assert_eq!(*hit, brute.intersect(ray));
    }
    let tiny = CubeOptions {
        max_samples: 10,
        ..options
    };
    let problem = Cube::build(&gpu, mesh.triangles(), &tiny).map(|_| ());
    assert!(
        matches!(problem, Err(Error::Limits { limit: 10, .. })),
        "{problem:?}"
    );
}

#[test]
fn nothing_is_hit_in_an_empty_cube_and_odd_rays_hit_nothing() {
    let Some(gpu) = gpu() else { return };
    let (empty, lump) = (Mesh::default(), Mesh::lump(8));
    for build in [CENTRE, LdcBuild::Peel, CONSERVATIVE] {
        let cube = built(&gpu, &empty, &options(build));
        let ray = Ray::new(Vec3::ONE, Vec3::NEG_ONE);
        let brute = BruteForce::new(empty.triangles());
        let (hits, _) = cube.closest(&[ray], &brute).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(hits, [None]);
    }
    let cube = built(&gpu, &lump, &CubeOptions::default());
    let brute = BruteForce::new(lump.triangles());
    let odd = [
        Ray::new(Vec3::NAN, Vec3::X),
        Ray::new(Vec3::ONE, Vec3::ZERO),
        Ray::new(Vec3::splat(1e30), Vec3::NEG_ONE),
        Ray::new(Vec3::new(-1e6, 0.0, 0.0), Vec3::X * 1e-20),
        Ray {
            t_max: 1.0,
            ..Ray::new(Vec3::X * -3.0, Vec3::X * 2.0)
        },
        Ray {
            t_min: 2.0,
            ..Ray::new(Vec3::X * -3.0, Vec3::X)
        },
        Ray {
            t_min: f32::NEG_INFINITY,
            ..Ray::new(Vec3::X * 9.0, Vec3::X)
        },
    ];
    let (hits, _) = cube.closest(&odd, &brute).unwrap_or_else(|e| panic!("{e}"));
    let truth: Vec<_> = odd.iter().map(|ray| brute.intersect(ray)).collect();
    assert_eq!(hits, truth);
    assert!(cube.closest(&[], &brute).is_ok_and(|(hits, _)| hits.is_empty()));
    assert_eq!(DVec3::ZERO, cube.frame().texel(cube.frame().corner));
}

#[test]
fn two_cubes_answer_as_brute_force_does() {
    let Some(gpu) = gpu() else { return };
    let (lump, mover) = (Mesh::lump(24), Mesh::lump(6));
    let frame = |time: f32| {
        let mut mesh = Mesh::lump(24);
        let first = mesh.x.len() as u32;
        mesh.x.extend(mover.x.iter().map(|x| x * 0.3 + 1.2 - time));
        mesh.y.extend(mover.y.iter().map(|y| y * 0.3));
        mesh.z.extend(mover.z.iter().map(|z| z * 0.3 + time));
        mesh.indices
            .extend(mover.indices.iter().map(|c| c.map(|i| i + first)));
        mesh
    };
    let options = CubeOptions {
        resolution: 128,
        ..CubeOptions::default()
    };
    let mut still = StillCube::default();
    let taking_part = |mesh: &Mesh| built(&gpu, mesh, &options).stats().triangles;
    let (all, moving) = (taking_part(&frame(0.0)), taking_part(&mover));
    for (n, expected) in [all, all, moving, moving].into_iter().enumerate() {
        let mesh = frame(n as f32 * 0.4);
        let (brute, bvh) = (BruteForce::new(mesh.triangles()), Bvh::build(mesh.triangles()));
        let cube = still.build(&gpu, mesh.triangles(), &options);
        let cube = cube.unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(cube.rebuilt(), expected, "frame {n}");
        assert_eq!(cube.stacks.len(), if n == 0 { 1 } else { 2 });
        let rays = rays(n as u64, 2000);
        let (hits, stats) = cube.closest(&rays, &bvh).unwrap_or_else(|e| panic!("{e}"));
        let (mut of_mover, mut lit) = (0, 0);
        let light = Light::Point(Vec3::new(1.6, 0.3, 1.2));
        let mut queries = Vec::new();
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, brute.intersect(ray), "frame {n}: {ray:?}");
            of_mover += usize::from(hit.is_some_and(|hit| hit.prim as usize >= lump.indices.len()));
            if let Some((prim, hit)) = brute.closest(ray) {
                queries.push((Receiver::on_surface(ray, hit.t, prim), light));
            }
        }
        assert!(of_mover > 10, "frame {n}: {of_mover}");
        assert!(stats.unsure < rays.len() / 10, "{stats:?}");
        let (dark, _) = cube.shadowed(&queries, &bvh).unwrap_or_else(|e| panic!("{e}"));
        for ((receiver, light), dark) in queries.iter().zip(&dark) {
            assert_eq!(*dark, brute.shadowed(receiver, light), "{receiver:?}");
            lit += usize::from(!dark);
        }
        assert!(lit > 50 && lit + 50 < queries.len(), "{lit} of {}", queries.len());
        let test = HitTest::Plane { margin: 0.25 };
        let (planes, _) = cube
            .closest_sampled(&rays, test)
            .unwrap_or_else(|e| panic!("{e}"));
        let alike = planes.iter().zip(&hits);
        let alike = alike.filter(|(a, b)| a.is_some() == b.is_some()).count();
        assert!(alike * 100 > rays.len() * 97, "{alike} alike by samples");
    }
}

#[test]
fn a_lost_device_is_one_error() {
    let Some(gpu) = gpu() else { return };
    let mesh = Mesh::lump(8);
    let brute = BruteForce::new(mesh.triangles());
    let cube = built(&gpu, &mesh, &options(CONSERVATIVE));
    gpu.destroy();
    let problem = cube.closest(&rays(1, 10), &brute).map(|_| ());
    assert!(matches!(problem, Err(Error::Lost { .. })), "{problem:?}");
    let text = problem.err().map(|e| e.to_string()).unwrap_or_default();
    assert!(text.contains(&gpu.adapter().name), "{text}");
    let unknown = Gpu::open(Some("no such adapter")).map(|_| ());
    assert!(matches!(unknown, Err(Error::NoAdapter { .. })), "{unknown:?}");
}

#[test]
fn sixteen_bits_of_depth_are_near_and_answers_stay_exact() {
    let Some(gpu) = gpu() else { return };
    // Of the cube's size: half a step and depths below 0, a step of numbers above 1/2.
    for (depth, error) in [
        (DepthFormat::U16, 0.51 / 65535.0 + 0.016 / 72.0),
        (DepthFormat::F16, 1.0 / 2048.0),
    ] {
        for build in [CENTRE, LdcBuild::Peel, CONSERVATIVE] {
            for mesh in meshes() {
                let full = options(build);
                let packed = CubeOptions { depth, ..full };
                let [full, cube] = [full, packed].map(|options| built(&gpu, &mesh, &options));
                assert!(cube.bytes() < full.bytes());
                for axis in 0..3 {
                    let (a, b) = (samples(&full, axis), samples(&cube, axis));
                    let size = cube.frame().size[axis] as f32;
                    assert_eq!(a.len(), b.len());
                    let mut rounded = 0;
                    for (a, b) in a.iter().zip(&b) {
                        let told = |s: &TexelSample| (s.texel, s.prim, s.slopes);
                        assert_eq!(told(a), told(b));
                        let off = (a.depth - b.depth).abs();
                        let outside = a.depth < 0.0 || a.depth > size;
                        assert!(off <= error * size || outside, "{depth:?} {a:?} {b:?}");
                        rounded += usize::from(off > 0.0);
                    }
                    assert!(rounded > a.len() / 2, "{rounded} of {}", a.len());
                }
                assert_answers_as_the_reference(&cube, &mesh, depth, build);
            }
        }
    }
}

/// Exact answers of a conservative cube, and those by samples beside the CPU's.
fn assert_answers_as_the_reference(cube: &Cube, mesh: &Mesh, depth: DepthFormat, build: LdcBuild) {
    let rays = rays(23, 1000);
    if build == CONSERVATIVE {
        let brute = BruteForce::new(mesh.triangles());
        let (hits, stats) = cube.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, brute.intersect(ray), "{depth:?} {ray:?}");
        }
        assert!(stats.unsure < rays.len() / 3, "{stats:?}");
    }
    let reference = LdcOptions {
        depth,
        ..reference(&options(build))
    };
    let ldc = Ldc::build(mesh.triangles(), &reference);
    for test in [
        HitTest::Interval { tolerance: 0.5 },
        HitTest::Plane { margin: 0.25 },
    ] {
        let (hits, _) = cube
            .closest_sampled(&rays, test)
            .unwrap_or_else(|e| panic!("{e}"));
        let alike = rays.iter().zip(&hits).filter(|(ray, hit)| {
            let other = ldc.closest_sampled(ray, test, &mut ());
            hit.map(|h| h.prim) == other.map(|h| h.prim)
        });
        let alike = alike.count();
        assert!(
            alike > rays.len() * 96 / 100,
            "{depth:?} {build:?} {test:?}: {alike}"
        );
    }
}

#[test]
fn texels_too_long_to_be_put_in_order_are_answered_right() {
    let Some(gpu) = gpu() else { return };
    // Thousands of triangles behind each other, so that their texels have as many samples.
    let mut numbers = Numbers(4);
    let mut mesh = Mesh::default();
    for _ in 0..12_000 {
        let middle = numbers.point() * Vec3::new(0.1, 0.1, 1.0);
        mesh.triangle([(); 3].map(|()| middle + numbers.point() * Vec3::new(0.2, 0.2, 0.0)));
    }
    let brute = BruteForce::new(mesh.triangles());
    let cube = built(
        &gpu,
        &mesh,
        &CubeOptions {
            resolution: 32,
            ..CubeOptions::default()
        },
    );
    let rays: Vec<Ray> = (0..600)
        .map(|i| {
            let from = numbers.point() * Vec3::new(0.3, 0.3, 1.0);
            let across = Vec3::new(numbers.next(), numbers.next(), numbers.next() * 0.1);
            Ray::new(from, if i % 2 == 0 { Vec3::Z } else { across })
        })
        .collect();
    let (hits, stats) = cube.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
    for (ray, hit) in rays.iter().zip(&hits) {
        assert_eq!(*hit, brute.intersect(ray), "{ray:?}");
    }
    assert!(stats.unsure > 100, "{stats:?}");
}
