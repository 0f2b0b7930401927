//! Lit pixels against brute force, at every level, for eyes and lights everywhere.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::*;
use crate::kernel::casters::{CasterLanes, LightRaster, sift_casters};
use crate::kernel::pixels::{Asking, LightFaces, TileRays, project_receivers};
use crate::kernel::planes::find_planes;
use crate::test_meshes::{Mesh, Numbers, axes, looking};
use crate::{Accel, BruteForce, Casts, EyeGrid, EyeGridOptions, Receiver};

/// Every pixel of a view by brute force: `None` where nothing is seen, else the triangle and whether the light
/// reaches it.
fn reference(triangles: &Triangles, view: &View, query: &LightQuery) -> Vec<Option<(u32, bool)>> {
    let finite = |prim: u32| triangles.corners(prim).iter().all(|c| c.is_finite());
    let prims: Vec<u32> = (0..triangles.len() as u32).filter(|&p| finite(p)).collect();
    let casters: Vec<u32> = prims
        .iter()
        .copied()
        .filter(|&p| takes_part(&query.light, triangles, (query.rule)(p), p))
        .collect();
    let pixel = |i: u32| {
        let ray = view.pixel_ray(i % view.width, i / view.width);
        let hit = |&prim: &u32| {
            let hit = exact::hit(ray.origin, ray.dir, triangles.corners(prim))?;
            (hit.t > 0.0).then_some((hit.t, prim))
        };
        let closest = prims.iter().filter_map(hit);
        let (t, prim) = closest.reduce(|a, b| if b.0 < a.0 { b } else { a })?;
        let receiver = Receiver::along(&ray, t, prim);
        let hides = |&p: &u32| exact::shadows(triangles, p, &receiver, &query.light);
        let lit = query.faces(triangles, prim) && !casters.iter().any(hides);
        Some((prim, lit))
    };
    let pixels = 0..view.width * view.height;
    pixels.into_par_iter().map(pixel).collect()
}

/// Panics where a pixel differs; returns how many are seen, lit, untested and decided exactly.
fn check(name: &str, mesh: &Mesh, view: View, query: &LightQuery) -> [u64; 4] {
    let triangles = mesh.triangles();
    let expected = reference(&triangles, &view, query);
    let clusters = Clusters::new(&triangles);
    let (mut counts, mut scratch) = (LitCounts::default(), LitScratch::default());
    // What an earlier light has left there.
    let other = LightQuery {
        light: Light::Point(Vec3::new(0.2, 0.1, -0.4)),
        cone: None,
        ..*query
    };
    for level in SimdLevel::available() {
        let grid = EyeGrid::build(view, triangles, EyeGridOptions::default(), level);
        let visibility = Visibility::trace(&grid, &|| ());
        LitPixels::find(&visibility, &triangles, &clusters, &other, level, &mut scratch);
        let lit = LitPixels::find(&visibility, &triangles, &clusters, query, level, &mut scratch);
        let brute = BruteForce::new(triangles);
        let all = |receivers: &[Receiver]| {
            let dark = receivers.par_iter().map(|r| brute.shadowed(r, &query.light));
            Some(dark.collect())
        };
        let every_side = (0..triangles.len() as u32).all(|p| (query.rule)(p) == Casts::Both);
        let asked = LitPixels::asked(&visibility, &triangles, query, all).filter(|_| every_side);
        for index in 0..grid.tile_count() {
            let tile = grid.tile(index);
            for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                let [px, py] = [tile.x + x, tile.y + y];
                let want = expected[(py * view.width + px) as usize];
                let seen = visibility.prim(index, x, y);
                let got = seen.map(|prim| (prim, lit.is_lit(index, x, y)));
                if let Some(asked) = &asked {
                    let got = seen.map(|prim| (prim, asked.is_lit(index, x, y)));
                    assert_eq!(got, want, "asked, {name}, {px} {py}");
                }
                let place = || format!("{name}, {}, {:?}, {px} {py}", level.name(), query.light);
                assert_eq!(got, want, "{}", place());
            }
        }
        counts = lit.counts;
    }
    let lit = expected.iter().filter(|e| e.is_some_and(|e| e.1)).count() as u64;
    let seen = expected.iter().flatten().count() as u64;
    [seen, lit, counts.untested, counts.exact_pairs]
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

fn query(light: Light, view: &View, rule: CastRule<'static>) -> LightQuery<'static> {
    let eye = match view.arrangement {
        Arrangement::Perspective => Light::Point(view.center),
        Arrangement::Parallel { .. } => Light::Directional((-view.forward).as_vec3()),
    };
    LightQuery {
        light,
        cone: None,
        eye,
        rule,
    }
}

const BOTH: CastRule<'static> = &|_| Casts::Both;

fn check_lights(name: &str, mesh: &Mesh, view: View, lights: Vec<Light>) -> [u64; 4] {
    let mut sum = [0; 4];
    for light in lights {
        let counts = check(name, mesh, view, &query(light, &view, BOTH));
        sum = std::array::from_fn(|i| sum[i] + counts[i]);
    }
    sum
}

#[test]
fn equals_brute_force_for_lights_everywhere() {
    for (name, mesh) in [
        ("soup", Mesh::soup(3, 400, 0.3, 1.0)),
        ("blob", Mesh::blob(24)),
        ("awkward", Mesh::awkward()),
    ] {
        for eye in [Vec3::new(0.2, 0.5, 2.5), Vec3::new(0.1, 0.05, 0.0)] {
            let view = looking(eye, Vec3::new(0.05, 0.0, -0.1), 0.5, [70, 45]);
            let [seen, lit, untested, exact] = check_lights(name, &mesh, view, lights());
            println!("{name}: {seen} seen, {lit} lit, {untested} untested, {exact} exact pairs");
            assert!(seen > 7 * 500 && lit > 100);
        }
    }
}

#[test]
fn equals_brute_force_at_any_scale_and_offset() {
    for (scale, offset) in [(1e-3, 0.0), (1e-3, 1.0), (1e3, 1e6), (1e6, 1e6), (1.0, 1e5)] {
        let offset = Vec3::new(offset, -offset, offset * 0.5);
        let mesh = Mesh::blob(16).scaled(scale, offset);
        let eye = Vec3::new(0.2, 0.5, 2.5) * scale + offset;
        let view = looking(eye, offset, 0.5, [60, 40]);
        let positions = [Vec3::new(2.0, 3.0, 1.0), Vec3::new(0.1, 0.1, 0.0)];
        let lights = positions.map(|p| Light::Point(p * scale + offset)).to_vec();
        check_lights(&format!("scale {scale} offset {offset}"), &mesh, view, lights);
    }
}

/// Rounding of surface points is then as large as what tells shadows apart.
#[test]
fn an_eye_far_from_a_small_scene_and_its_light() {
    for (distance, scale) in [(1e3, 1e-4), (1e5, 1e-3), (1e6, 1e-4), (1e6, 3e-6)] {
        for (name, mesh) in [("soup", Mesh::soup(3, 400, 0.3, 1.0)), ("blob", Mesh::blob(24))] {
            let mesh = mesh.scaled(scale, Vec3::ZERO);
            let eye = Vec3::new(0.2, 0.5, 0.9) * distance;
            let view = looking(eye, Vec3::ZERO, f64::from(scale / distance), [70, 45]);
            let positions = [Vec3::new(2.0, 3.0, 1.0), Vec3::new(0.5, 0.7, 0.6)];
            let lights = positions.map(|p| Light::Point(p * scale)).to_vec();
            let [seen, lit, _, exact] = check_lights(name, &mesh, view, lights);
            println!("{name}, {distance} from {scale}: {seen} seen, {lit} lit, {exact} exact pairs");
            assert!(seen > 500 && lit > 50, "{seen} seen, {lit} lit");
        }
    }
}

#[test]
fn small_triangles_and_many_receivers_a_cell() {
    // From afar a light sees all of the ground in few of its tiles.
    let mut mesh = Mesh::blob(48).scaled(0.02, Vec3::new(0.01, 0.03, 0.0));
    let far = Vec3::new(60.0, 0.0, 0.0);
    let far_z = Vec3::new(0.0, 0.0, 60.0);
    mesh.triangle([-far - far_z, far - far_z, far_z]);
    mesh.triangle([
        Vec3::new(-50.0, 1.0, -50.0),
        Vec3::new(-50.0, 1.1, -50.0),
        Vec3::new(-50.0, 1.0, -49.0),
    ]);
    let view = looking(Vec3::new(0.05, 0.08, 0.1), Vec3::ZERO, 0.5, [80, 50]);
    let lights = vec![
        Light::Point(Vec3::new(0.1, 0.2, 0.05)),
        Light::Directional(Vec3::new(0.4, 1.0, 0.3)),
    ];
    let [seen, lit, _, exact] = check_lights("far ground", &mesh, view, lights);
    println!("{seen} seen, {lit} lit, {exact} exact pairs");
    assert!(lit > 250 && lit < seen);
}

#[test]
fn an_eye_with_parallel_rays() {
    let mesh = Mesh::soup(21, 300, 0.3, 1.0);
    let axes = axes(DVec3::new(-0.3, -0.5, -1.0));
    let view = View::parallel(Vec3::new(0.9, 1.5, 3.0), axes, [1.5, 1.0], 40.0, [60, 40]);
    let [_, lit, ..] = check_lights("parallel eye", &mesh, view, lights());
    assert!(lit > 500);
}

#[test]
fn back_faces_and_nothing_as_casters() {
    let mesh = Mesh::blob(20);
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [60, 40]);
    let some: CastRule = &|prim| [Casts::Back, Casts::Nothing, Casts::Both][prim as usize % 3];
    let back: CastRule = &|_| Casts::Back;
    for rule in [back, some] {
        for light in lights() {
            check("rules", &mesh, view, &query(light, &view, rule));
        }
    }
}

#[test]
fn geometry_too_large_to_be_projected() {
    let mut mesh = Mesh::soup(2, 30, 0.3, 1.0);
    // Out of the eye's sight.
    mesh.triangle([
        Vec3::new(1e33, 1.0, 1e33),
        Vec3::new(-1e33, 2.0, 1e33),
        Vec3::new(0.0, 1.5, 5.0),
    ]);
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [30, 20]);
    check_lights("huge", &mesh, view, lights());
}

#[test]
fn lights_that_are_no_numbers_reach_what_faces_them() {
    let mesh = Mesh::soup(4, 60, 0.3, 1.0);
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [30, 20]);
    let lights = vec![
        Light::Point(Vec3::NAN),
        Light::Directional(Vec3::ZERO),
        Light::Directional(Vec3::new(f32::INFINITY, 1.0, 0.0)),
    ];
    check_lights("no numbers", &mesh, view, lights);
}

#[test]
fn a_spot_lights_cone_is_one_face() {
    let mesh = Mesh::soup(9, 300, 0.3, 1.0);
    let triangles = mesh.triangles();
    let clusters = Clusters::new(&triangles);
    let position = Vec3::new(0.1, 2.5, 0.2);
    let axis = DVec3::new(0.1, -1.0, 0.05).normalize();
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [90, 60]);
    let with = |cone| LightQuery {
        cone,
        ..query(Light::Point(position), &view, BOTH)
    };
    let half_angle = 0.5;
    let mut scratch = LitScratch::default();
    let level = SimdLevel::detect();
    let grid = EyeGrid::build(view, triangles, EyeGridOptions::default(), level);
    let visibility = Visibility::trace(&grid, &|| ());
    let [all, within] = [None, Some(Cone { axis, half_angle })].map(|cone| {
        LitPixels::find(
            &visibility,
            &triangles,
            &clusters,
            &with(cone),
            level,
            &mut scratch,
        )
    });
    let mut compared = 0;
    for (index, tile) in visibility.tiles().iter().enumerate() {
        for (x, y) in (0..tile.tile.height).flat_map(|y| (0..tile.tile.width).map(move |x| (x, y))) {
            let (block, lane) = place(tile.stride, x, y);
            let Some(receiver) = tile.receiver(&view, &triangles, block as u32, lane as u32) else {
                continue;
            };
            if (receiver.point - position.as_dvec3()).angle_between(axis) < half_angle {
                assert_eq!(
                    all.is_lit(index as u32, x, y),
                    within.is_lit(index as u32, x, y),
                    "{receiver:?}"
                );
                compared += 1;
            }
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let mesh = Mesh::soup(12, 2000, 0.2, 1.0);
    let triangles = mesh.triangles();
    let clusters = Clusters::new(&triangles);
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [300, 200]);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool");
        pool.install(|| {
            let (level, mut scratch) = (SimdLevel::detect(), LitScratch::default());
            let grid = EyeGrid::build(view, triangles, EyeGridOptions::default(), level);
            let visibility = Visibility::trace(&grid, &|| ());
            let query = query(Light::Point(Vec3::new(0.1, 0.2, 0.3)), &view, BOTH);
            let lit = LitPixels::find(&visibility, &triangles, &clusters, &query, level, &mut scratch);
            let bits: Vec<_> = lit.tiles.into_iter().map(|t| t.lit).collect();
            (bits, lit.counts)
        })
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn large_casters_put_out_many_pixels_at_once() {
    // A roof of two triangles over most of a hilly ground, and a blob over the rest.
    let mut mesh = Mesh::blob(12).scaled(0.3, Vec3::new(-1.6, 0.9, 0.2));
    let corner = |x: i32, z: i32| {
        let (x, z) = (x as f32 * 0.25, z as f32 * 0.25);
        Vec3::new(x, 0.1 * (x * 3.0).sin() * (z * 2.0).cos(), z)
    };
    for (x, z) in (-8..8).flat_map(|x| (-8..8).map(move |z| (x, z))) {
        mesh.triangle([corner(x, z), corner(x, z + 1), corner(x + 1, z)]);
        mesh.triangle([corner(x + 1, z), corner(x, z + 1), corner(x + 1, z + 1)]);
    }
    let roof = |x: f32, z: f32| Vec3::new(x, 0.8 + 0.05 * x, z);
    mesh.triangle([roof(-0.7, -3.0), roof(3.0, 3.0), roof(3.0, -3.0)]);
    mesh.triangle([roof(-0.7, -3.0), roof(-0.7, 3.0), roof(3.0, 3.0)]);
    let view = looking(
        Vec3::new(-1.5, 0.6, 2.8),
        Vec3::new(0.3, 0.0, 0.0),
        0.5,
        [120, 70],
    );
    let [seen, lit, ..] = check_lights("roof", &mesh, view, lights());
    assert!(lit > 2000 && lit * 2 < seen, "{lit} of {seen} lit");
}

#[test]
fn the_second_of_two_equal_triangles_casts() {
    let mut mesh = Mesh::soup(5, 200, 0.3, 1.0);
    let first = mesh.indices.clone();
    mesh.indices.extend(&first);
    let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [60, 40]);
    let second: CastRule = &|prim| if prim < 200 { Casts::Nothing } else { Casts::Both };
    let light = Light::Point(Vec3::new(0.7, 0.9, 0.4));
    let [_, lit, ..] = check("copies", &mesh, view, &query(light, &view, second));
    let none: CastRule = &|_| Casts::Nothing;
    let [_, all, ..] = check("copies", &mesh, view, &query(light, &view, none));
    assert!(lit < all, "{lit} {all}");
}

/// What the lanes call the front of a triangle is what the exact decision does, and they know of nearly all.
#[test]
fn sides_are_those_of_the_exact_decision() {
    let (mut known, mut all) = (0, 0);
    for (mesh, light) in [Mesh::blob(24), Mesh::soup(5, 600, 0.2, 1.0)]
        .iter()
        .flat_map(|mesh| lights().into_iter().map(move |light| (mesh, light)))
    {
        let triangles = mesh.triangles();
        let clusters = Clusters::new(&triangles);
        let faces = crate::light_views::views(&light, &triangles, None, None).expect("it is finite");
        for (view, level) in faces
            .views
            .iter()
            .flat_map(|view| SimdLevel::available().into_iter().map(move |level| (view, level)))
        {
            let size = [f64::from(view.width), f64::from(view.height)];
            let view = view.window([0.0; 2], size, [4 * LIGHT_TILE; 2]);
            let raster = LightRaster::new(&view, 4);
            let mut lanes = CasterLanes::default();
            for index in 0..clusters.len() {
                let (cluster, mut points) = (clusters.cluster(index), Vec::new());
                clusters.place(index, &triangles, &mut points);
                sift_casters(level, &raster, &points, cluster.corners, &mut lanes);
                for (i, &prim) in cluster.prims.iter().enumerate() {
                    let batch = &lanes.batches[i / 16];
                    if batch.ahead >> (i % 16) & 1 == 0 {
                        continue;
                    }
                    all += 1;
                    if let Some(front) = batch.front(i % 16) {
                        known += 1;
                        let side = exact::side(triangles.corners(prim), &light);
                        assert!(side != 0.0 && (side > 0.0) == front, "{light:?} {prim}");
                    }
                }
            }
        }
    }
    assert!(known > 10_000 && known * 100 > all * 96, "{known} of {all}");
}

/// Points made in few operations are projected as if they had been rounded like those of the exact decision, or left to be
/// made again.
#[test]
fn receivers_lie_where_their_rounded_points_do() {
    let mut numbers = Numbers(8);
    let size = 4 * LIGHT_TILE;
    let mut seen = 0;
    for (distance, scale) in [(3.0, 1.0), (1e3, 1.0), (1e3, 1e-4), (1e6, 1e-3), (1e6, 1e-5)] {
        let eye = Vec3::new(0.2, 0.5, 0.9) * distance;
        let view = looking(eye, Vec3::ZERO, f64::from(scale / distance), [32, 32]);
        let light = Vec3::new(2.0, 3.0, 1.0) * scale;
        let faces = LightFaces {
            views: vec![looking(light, Vec3::ZERO, 0.6, [size; 2])],
            cube: None,
        };
        let mut rays = TileRays::default();
        rays.set(&view, [0, 0], [8, 8]);
        let depth = eye.as_dvec3().length();
        let mut lanes = || [(); 16].map(|()| depth + f64::from(numbers.next() * scale));
        let (t, pixels): (Vec<_>, Vec<_>) = (0..64).map(|_| (lanes(), u16::MAX)).unzip();
        let asking = Asking {
            eye_tile: 0,
            part: 0,
            prims: &[[0; 16]; 64],
            rays: &rays,
            t: &t,
            pixels: &pixels,
        };
        for level in SimdLevel::available() {
            let (mut points, mut entries) = (Vec::new(), Vec::new());
            project_receivers(level, &asking, &faces, &mut points, &mut entries);
            for (entry, lane) in entries.iter().flat_map(|e| (0..16).map(move |lane| (e, lane))) {
                if entry.lanes >> lane & 1 == 0 {
                    continue;
                }
                seen += 1;
                let at = &points[entry.points as usize];
                let (block, lane) = (at.block, lane as u32);
                let ray = view.pixel_ray(block % 8 * 4 + lane % 4, block / 8 * 4 + lane / 4);
                let exact = Receiver::along(&ray, t[block as usize][lane as usize], 0).point;
                let h = faces.views[0].homogeneous(exact);
                let corner = [entry.light_tile % 4, entry.light_tile / 4].map(|i| f64::from(i * LIGHT_TILE));
                for (found, want) in [
                    (f64::from(at.x[lane as usize]) + corner[0], h.p.x / h.p.z),
                    (f64::from(at.y[lane as usize]) + corner[1], h.p.y / h.p.z),
                ] {
                    let bound = f64::from(size) * 2f64.powi(-24) + QUICK_ERROR;
                    assert!(
                        (found - want).abs() < bound,
                        "{found} {want}, {distance} from {scale}"
                    );
                }
            }
        }
    }
    assert!(seen > 3000, "{seen}");
}

/// Sides that lanes of f64 are sure of are those of the exact decision, also next to a triangle's plane.
#[test]
fn sides_of_planes_are_those_of_the_exact_decision() {
    let mut numbers = Numbers(21);
    let (mut known, mut all) = (0, 0);
    for scale in [1.0, 1e4, 1e-3] {
        for _ in 0..400 {
            let offset = numbers.point() * scale * 50.0;
            let mut places = [[[0.0; 4]; 16]; 3];
            let corners = [(); 16].map(|()| [(); 3].map(|()| numbers.point() * scale + offset));
            for (lane, corner) in (0..16).flat_map(|lane| (0..3).map(move |corner| (lane, corner))) {
                places[corner][lane] = corners[lane][corner].extend(0.0).to_array();
            }
            // A point of the first triangle, as far as f32 has it, and a direction along its plane.
            let [a, b, c] = corners[0];
            let ends = [
                Light::Point(a + (b - a) * 0.3 + (c - a) * numbers.next()),
                Light::Directional(b - a),
            ];
            let center = numbers.point().as_dvec3();
            for level in SimdLevel::available() {
                let (_, sides) = find_planes(level, center, &places, [&ends[0], &ends[1]]);
                for (lane, corners) in corners.iter().enumerate() {
                    for (sides, end) in sides.iter().zip(&ends) {
                        all += 1;
                        if let Some(front) = sides.front(lane) {
                            known += 1;
                            let side = exact::side(*corners, end);
                            assert!(side != 0.0 && (side > 0.0) == front, "{corners:?} {end:?}");
                        }
                    }
                }
            }
        }
    }
    assert!(known * 100 > all * 90 && known < all, "{known} of {all}");
}
