//! Every structure for arbitrary rays gives brute force's answers, bit for bit.

mod support;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rayward_trace::ldc::{DepthFormat, Hierarchy};
use rayward_trace::{
    Accel, BruteForce, Bvh, Candidates, Casts, Counters, FaceOptions, Grid3, Hit, Ldc, LdcOptions, Light,
    LightGridOptions, PerspectiveGrids, PointLightGrid, PointLightTree, Ray, Receiver, ShadowScratch,
    SimdLevel, SurfaceRay, Topology, Triangles,
};
use support::meshes::{self, Mesh};
use support::{Random, rays};

/// A row of the table: a structure's name, for how many rays a mesh it is tried, and how to build it.
type Structure = (
    &'static str,
    usize,
    for<'a> fn(Triangles<'a>) -> Box<dyn Accel + 'a>,
);

// Brute force against itself only shows that its queries agree with each other.
const STRUCTURES: [Structure; 12] = [
    ("BruteForce", 300, |t| Box::new(BruteForce::new(t))),
    ("Bvh", 3000, |t| Box::new(Bvh::build(t))),
    ("Ldc", 3000, |t| Box::new(Ldc::build(t, &deep_cube()))),
    ("small Ldc", 3000, |t| Box::new(Ldc::build(t, &small_cube()))),
    ("Ldc as the paper stores it", 3000, |t| {
        Box::new(Ldc::build(t, &paper_cube()))
    }),
    ("Grid3 in world", 3000, |t| Box::new(Grid3::in_world(t, None))),
    ("Grid3 of uneven cells", 600, |t| {
        Box::new(Grid3::in_world(t, Some([54, 7, 1])))
    }),
    ("PerspectiveGrids around a vertex", 3000, |t| {
        Box::new(PerspectiveGrids::build(
            some_vertex(&t),
            t,
            &FaceOptions::default(),
        ))
    }),
    ("PerspectiveGrids around zero", 600, |t| {
        let options = FaceOptions {
            resolution: Some([50, 41, 4]),
            uniform_depth: true,
            ..FaceOptions::default()
        };
        Box::new(PerspectiveGrids::build(DVec3::ZERO, t, &options))
    }),
    ("PerspectiveGrids with a large near cube", 600, |t| {
        let options = FaceOptions {
            resolution: Some([16, 16, 9]),
            near_share: 0.3,
            ..FaceOptions::default()
        };
        Box::new(PerspectiveGrids::build(some_vertex(&t) * 1.5, t, &options))
    }),
    ("PerspectiveGrids from far away", 600, |t| {
        let center = (some_vertex(&t) + DVec3::X) * 300.0;
        Box::new(PerspectiveGrids::build(center, t, &FaceOptions::default()))
    }),
    ("PerspectiveGrids around nowhere", 100, |t| {
        Box::new(PerspectiveGrids::build(DVec3::NAN, t, &FaceOptions::default()))
    }),
];

/// All levels of the pyramid.
fn deep_cube() -> LdcOptions {
    LdcOptions {
        resolution: 200,
        ..LdcOptions::default()
    }
}

/// A cube in which many triangles share a texel.
fn small_cube() -> LdcOptions {
    LdcOptions {
        resolution: 24,
        depth: DepthFormat::U16,
        hierarchy: Hierarchy::Flat,
        ..LdcOptions::default()
    }
}

/// 16-bit float depth and one level of tiles, but with the coverage that exact answers need.
fn paper_cube() -> LdcOptions {
    LdcOptions {
        build: LdcOptions::default().build,
        hierarchy: Hierarchy::Tiles { log2: [2, 4] },
        ..LdcOptions::paper(100)
    }
}

/// The first finite vertex, if there is one.
fn some_vertex(triangles: &Triangles) -> DVec3 {
    let mut vertices = (0..triangles.x.len() as u32).map(|i| triangles.vertex(i));
    let vertex = vertices.find(|v| v.is_finite());
    vertex.map_or(DVec3::ZERO, Vec3::as_dvec3)
}

fn bits(hit: &Hit) -> [u32; 4] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim]
}

fn same(a: &[Hit], b: &[Hit]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// Panics with all that is needed to repeat the case if the structure differs from brute force.
fn check(name: &str, structure: &dyn Accel, mesh: &Mesh, seed: u64, i: usize, ray: &Ray, truth: &[Hit]) {
    let mut all = vec![Hit {
        t: 0.0,
        u: 0.0,
        v: 0.0,
        prim: 0,
    }];
    structure.all_hits(ray, &mut all);
    let closest = structure.intersect(ray);
    let place = || format!("{name} on {}, seed {seed}, ray {i}: {ray:?}", mesh.name);
    assert!(
        same(&all, truth),
        "{}\nall hits {all:?}\nshould be {truth:?}",
        place()
    );
    assert!(
        same(closest.as_slice(), &truth[..truth.len().min(1)]),
        "{}\n{closest:?}\nshould be first of {truth:?}",
        place()
    );
    assert_eq!(structure.occluded(ray), !truth.is_empty(), "{}", place());
}

#[test]
fn all_structures_agree_with_brute_force() {
    for (k, mesh) in meshes::table().iter().enumerate() {
        let seed = 100 + k as u64;
        let brute = BruteForce::new(mesh.triangles());
        let rays = rays::adversarial(mesh, seed, 3000);
        let truth: Vec<Vec<Hit>> = rays
            .iter()
            .map(|ray| {
                let mut hits = Vec::new();
                brute.all_hits(ray, &mut hits);
                hits
            })
            .collect();
        for (name, count, build) in STRUCTURES {
            let structure = build(mesh.triangles());
            for (i, (ray, truth)) in rays.iter().zip(&truth).enumerate().take(count) {
                check(name, &*structure, mesh, seed, i, ray, truth);
            }
        }
    }
}

/// Points on the mesh as rays find them, and one in the air. Some are known far worse than rays know them, as if the eye were
/// far off.
fn receivers(mesh: &Mesh, seed: u64, count: usize) -> Vec<Receiver> {
    let brute = BruteForce::new(mesh.triangles());
    let seen = rays::adversarial(mesh, seed, count);
    let mut receivers: Vec<Receiver> = seen
        .iter()
        .filter_map(|ray| {
            brute
                .closest(ray)
                .map(|(prim, hit)| Receiver::on_surface(ray, hit.t, prim))
        })
        .collect();
    for (i, receiver) in receivers.iter_mut().enumerate() {
        receiver.error *= [1.0, 1.0, 2f64.powi(22), 1.0, 2f64.powi(30), 2f64.powi(38)][i % 6];
    }
    receivers.push(Receiver::free(seen[0].origin.as_dvec3()));
    receivers
}

/// Lights near and far, inside and outside, at vertices and along axes; some that are no numbers.
fn lights(mesh: &Mesh, random: &mut Random) -> Vec<Light> {
    let positions = mesh.positions();
    let some = if positions.is_empty() {
        Vec3::ONE
    } else {
        positions[random.below(positions.len())]
    };
    let other = if positions.is_empty() {
        Vec3::Y
    } else {
        positions[random.below(positions.len())]
    };
    vec![
        Light::Point(some * 3.0 - other),
        Light::Point(some),
        Light::Point(some.midpoint(other)),
        Light::Directional(random.direction()),
        Light::Directional(some - other),
        Light::Directional(Vec3::AXES[random.below(3)]),
        Light::Directional(Vec3::NEG_Y * 1e-12),
        Light::Directional(Vec3::ZERO),
        Light::Point(Vec3::new(0.0, f32::NAN, 0.0)),
        Light::Directional(Vec3::new(f32::INFINITY, 1.0, 0.0)),
    ]
}

#[test]
fn all_structures_cast_the_same_shadows() {
    for (k, mesh) in meshes::table().iter().enumerate() {
        let seed = 500 + k as u64;
        let brute = BruteForce::new(mesh.triangles());
        let receivers = receivers(mesh, seed, 120);
        let lights = lights(mesh, &mut Random::new(seed));
        let structures = STRUCTURES[1..]
            .iter()
            .map(|(name, _, build)| (name, build(mesh.triangles())))
            .collect::<Vec<_>>();
        for receiver in &receivers {
            for light in &lights {
                let truth = brute.shadowed(receiver, light);
                for (name, structure) in &structures {
                    let place = || format!("{name} on {}, seed {seed}: {receiver:?} {light:?}", mesh.name);
                    assert_eq!(structure.shadowed(receiver, light), truth, "{}", place());
                }
            }
        }
    }
}

#[test]
fn structures_of_lights_cast_the_same_shadows() {
    let level = SimdLevel::detect();
    let (mut decided, mut asked) = (0, 0);
    for (k, mesh) in meshes::table().iter().enumerate() {
        let seed = 1300 + k as u64;
        let triangles = mesh.triangles();
        let brute = BruteForce::new(triangles);
        let topology = Topology::analyse(&triangles);
        let receivers = receivers(mesh, seed, 80);
        for light in lights(mesh, &mut Random::new(seed)) {
            let both = |_| Casts::Both;
            let options = LightGridOptions::default();
            let grid =
                PointLightGrid::build_with_topology(light, triangles, &topology, &both, options, level);
            let tree = PointLightTree::build(light, triangles, &both, None, level);
            let mut scratch = ShadowScratch::default();
            let (mut by_grid, mut by_tree) = (Vec::new(), Vec::new());
            grid.shadowed(&receivers, &mut scratch, &mut by_grid);
            decided += scratch.counts.dark_by_cell;
            tree.shadowed(&receivers, &mut scratch, &mut by_tree);
            asked += scratch.counts.receivers;
            for (i, receiver) in receivers.iter().enumerate() {
                let truth = brute.shadowed(receiver, &light);
                let place = || format!("{}, seed {seed}: {receiver:?} {light:?}", mesh.name);
                assert_eq!(by_grid[i], truth, "grid, {}", place());
                assert_eq!(by_tree[i], truth, "tree, {}", place());
            }
        }
    }
    assert!(
        decided > 20 && asked > 10_000,
        "{decided} of {asked} dark by cell"
    );
}

#[test]
fn rays_that_leave_a_surface_meet_the_same_triangle() {
    for (k, mesh) in meshes::table().iter().enumerate() {
        let seed = 900 + k as u64;
        let brute = BruteForce::new(mesh.triangles());
        let bvh = Bvh::build(mesh.triangles());
        let ldc = Ldc::build(mesh.triangles(), &LdcOptions::default());
        let mut random = Random::new(seed);
        for mut from in receivers(mesh, seed, 400) {
            let directions = [
                random.direction(),
                Vec3::AXES[random.below(3)],
                random.direction() * 1e-20,
                Vec3::ZERO,
                Vec3::new(f32::NAN, 1.0, 0.0),
            ];
            for error in [from.error, -1.0] {
                from.error = error;
                for dir in directions {
                    let ray = SurfaceRay { from, dir };
                    let found = bvh.after(&ray, &mut ());
                    assert_eq!(found, brute.after(&ray), "{}, seed {seed}: {ray:?}", mesh.name);
                    let in_cube = ldc.after(&ray, &mut ());
                    assert_eq!(in_cube, found, "cube, {}, seed {seed}: {ray:?}", mesh.name);
                    let (mut all, mut others) = (Vec::new(), Vec::new());
                    bvh.along(&ray.line(), &mut (), &mut all);
                    ldc.along(&ray.line(), &mut (), &mut others);
                    assert_eq!(all, others, "{}, seed {seed}: {ray:?}", mesh.name);
                }
            }
        }
    }
}

#[test]
fn a_convex_surface_does_not_shadow_itself() {
    for (k, (scale, offset)) in [
        (1.0, Vec3::ZERO),
        (1e-3, Vec3::ONE),
        (1e3, Vec3::splat(-1e4)),
        (1e6, Vec3::splat(1e6)),
    ]
    .into_iter()
    .enumerate()
    {
        let seed = 700 + k as u64;
        let mut random = Random::new(seed);
        let mesh = meshes::icosphere(4).placed(scale, offset);
        let bvh = Bvh::build(mesh.triangles());
        let mut facing = 0;
        for i in 0..20_000 {
            let ray = rays::at_seam(
                &mesh,
                offset + random.direction().normalize() * (scale * 4.0),
                &mut random,
            );
            let Some((prim, hit)) = bvh.closest(&ray, &mut ()) else {
                continue;
            };
            let receiver = Receiver::on_surface(&ray, hit.t, prim);
            let away = random.direction().normalize();
            for light in [
                Light::Point(offset + away * (scale * 5.0)),
                Light::Directional(away),
            ] {
                let towards = light.towards(receiver.point).normalize();
                let cosine = towards.dot(mesh.triangles().normal(prim).normalize());
                // Rounded to the grid of its offset the surface is convex but for that rounding.
                if cosine > 0.1 {
                    facing += 1;
                    assert!(
                        !bvh.shadowed(&receiver, &light),
                        "{}, seed {seed}, {i}: {receiver:?} {light:?}",
                        mesh.name
                    );
                }
            }
        }
        assert!(facing > 5000, "{facing}");
    }
}

/// Whether no ray from inside a closed mesh at its seams gets out; the number of rays.
fn no_ray_escapes(structure: &dyn Accel, mesh: &Mesh, origins: &[Vec3], seed: u64, rays: usize) -> usize {
    let topology = Topology::analyse(&mesh.triangles());
    origins
        .par_iter()
        .enumerate()
        .filter(|(_, origin)| topology.winding_number(&mesh.triangles(), 0, origin.as_dvec3()) == 1)
        .map(|(k, &origin)| {
            let seed = seed * 1000 + k as u64;
            let mut random = Random::new(seed);
            for i in 0..rays {
                let ray = rays::at_seam(mesh, origin, &mut random);
                let found = structure.intersect(&ray).is_some();
                assert!(found, "lost in {}, seed {seed}, ray {i}: {ray:?}", mesh.name);
                assert!(
                    structure.occluded(&ray),
                    "any differs in {}, seed {seed}, ray {i}: {ray:?}",
                    mesh.name
                );
            }
            rays
        })
        .sum()
}

const PLACES: [(f32, Vec3); 10] = [
    (1.0, Vec3::ZERO),
    (1e-3, Vec3::ZERO),
    (1e3, Vec3::ZERO),
    (1e6, Vec3::ZERO),
    (1e-3, Vec3::new(1.0, -10.0, 100.0)),
    (1.0, Vec3::new(1e3, 1e4, -1e5)),
    (1.0, Vec3::splat(1e6)),
    (1e2, Vec3::new(-1e6, 1e6, 0.0)),
    (1e4, Vec3::splat(-1e6)),
    (1e6, Vec3::new(1e6, 0.0, -1e6)),
];

#[test]
fn closed_meshes_are_watertight() {
    let mut cast = 0;
    for (k, (scale, offset)) in PLACES.into_iter().enumerate() {
        for (j, mesh) in [meshes::icosphere(3), meshes::blob(4)].into_iter().enumerate() {
            let mesh = mesh.placed(scale, offset);
            let seed = (10 * k + j) as u64;
            let mut random = Random::new(seed);
            let origins: Vec<Vec3> = (0..10)
                .map(|_| offset + random.in_cube() * (scale * 0.4))
                .collect();
            let bvh = Bvh::build(mesh.triangles());
            cast += no_ray_escapes(&bvh, &mesh, &origins, seed, 6000);
            no_ray_escapes(
                &BruteForce::new(mesh.triangles()),
                &mesh,
                &origins[..2],
                seed,
                150,
            );
        }
    }
    assert!(cast >= 1_000_000, "only {cast} rays");
}

#[test]
fn building_does_not_depend_on_the_number_of_threads() {
    let mesh = meshes::blob(6).and(&meshes::soup(77, 20_000, 0.02));
    let rays = rays::adversarial(&mesh, 78, 3000);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        let bvh = pool.install(|| Bvh::build(mesh.triangles()));
        let world = pool.install(|| Grid3::in_world(mesh.triangles(), None));
        let center = DVec3::new(0.1, 0.2, 3.0);
        let options = FaceOptions::default();
        let faces = pool.install(|| PerspectiveGrids::build(center, mesh.triangles(), &options));
        // One count for each: the lists are the same, not only the answers.
        let mut work = [Counters::default(); 3];
        let hits: Vec<_> = rays
            .iter()
            .map(|ray| {
                [
                    bvh.closest(ray, &mut work[0]),
                    world.closest(ray, &mut work[1]),
                    faces.closest(ray, &mut work[2]),
                ]
            })
            .collect();
        (hits, work)
    };
    let one = with(1);
    assert_eq!(one, with(2));
    assert_eq!(one, with(5));
}

#[test]
fn traversal_leaves_most_of_the_scene_alone() {
    let mesh = meshes::blob(6);
    let bvh = Bvh::build(mesh.triangles());
    let world = Grid3::in_world(mesh.triangles(), None);
    let center = DVec3::new(0.0, 0.5, 2.5);
    let faces = PerspectiveGrids::build(center, mesh.triangles(), &FaceOptions::default());
    let mut random = Random::new(80);
    let [mut by_bvh, mut by_world, mut by_faces, mut at_home] = [Counters::default(); 4];
    let rays = 2000;
    for _ in 0..rays {
        let from = random.direction().normalize() * 3.0;
        let ray = Ray::new(from, random.in_cube() - from);
        bvh.closest(&ray, &mut by_bvh);
        world.closest(&ray, &mut by_world);
        faces.closest(&ray, &mut by_faces);
        // Along an axis: two components are zero.
        let axis = random.below(3);
        let mut from = random.in_cube();
        from[axis] = -3.0;
        let ray = Ray::new(from, Vec3::AXES[axis]);
        bvh.any(&ray, &mut by_bvh);
        world.any(&ray, &mut by_world);
        faces.any(&ray, &mut by_faces);
        // Nearly through the center, as from a lens there.
        let from = center.as_vec3() + random.in_cube() * 0.01;
        faces.closest(&Ray::new(from, random.in_cube() - from), &mut at_home);
    }
    for (work, nodes, triangles) in [
        (by_bvh, 80, 80),
        (by_world, 160, 80),
        (by_faces, 400, 800),
        (at_home, 8, 40),
    ] {
        assert!(work.nodes < rays * nodes, "{work:?}, at most {nodes} a ray");
        assert!(
            work.triangles < rays * triangles,
            "{work:?}, at most {triangles} a ray"
        );
    }
}

#[test]
fn builders_count_what_they_leave_out() {
    let mesh = meshes::broken(1);
    let stats = Bvh::build(mesh.triangles()).stats();
    let finite = |t: &[u32; 3]| t.iter().all(|&i| mesh.triangles().vertex(i).is_finite());
    assert_eq!(
        stats.dropped_non_finite,
        mesh.indices.iter().filter(|t| !finite(t)).count()
    );
    assert!(stats.dropped_non_finite > 10 && stats.dropped_degenerate > 10);
    assert_eq!(
        stats.triangles + stats.dropped_non_finite + stats.dropped_degenerate,
        mesh.indices.len()
    );
    assert_eq!(
        Bvh::build(meshes::empty().triangles()).stats(),
        Default::default()
    );
}

#[test]
fn a_receiver_counts_its_error_only_near_itself() {
    let mesh = meshes::single();
    let bvh = Bvh::build(mesh.triangles());
    let above = |error| Receiver {
        point: DVec3::new(0.0, 0.0, -1.0),
        error,
        prim: u32::MAX,
    };
    for light in [Light::Directional(Vec3::Z), Light::Point(Vec3::Z)] {
        assert!(bvh.shadowed(&above(0.5), &light));
        assert!(!bvh.shadowed(&above(1.5), &light));
        assert!(!bvh.shadowed(
            &Receiver {
                prim: 0,
                ..above(0.0)
            },
            &light
        ));
        assert!(!bvh.shadowed(&above(f64::NAN), &light));
    }
    let brute = BruteForce::new(mesh.triangles());
    let behind = Receiver {
        point: DVec3::new(0.0, 0.0, 0.5),
        error: -1.0,
        prim: u32::MAX,
    };
    for light in [Light::Directional(Vec3::Z), Light::Point(Vec3::Z)] {
        assert_eq!(bvh.shadowed(&behind, &light), brute.shadowed(&behind, &light));
    }
}
