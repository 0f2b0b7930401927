//! Area lights against brute force, sample by sample, at every level.

use glam::{DVec3, Vec3};

use super::*;
use crate::test_meshes::{Mesh, Numbers};
use crate::{AreaLightGrid, BruteForce, Casts, FaceOptions};

/// Surface points seen from `eye`, and free points.
fn receivers(mesh: &Mesh, eye: Vec3, count: usize, seed: u64) -> Vec<Receiver> {
    let triangles = mesh.triangles();
    let mut numbers = Numbers(seed);
    let mut found = Vec::new();
    for _ in 0..count {
        // Sixteen close to each other, as in a block of pixels.
        let at = numbers.point();
        for _ in 0..16 {
            let ray = crate::Ray::new(eye, at + numbers.point() * 0.02 - eye);
            let closest = BruteForce::new(triangles).closest(&ray);
            found.extend(closest.map(|(prim, hit)| Receiver::on_surface(&ray, hit.t, prim)));
        }
        // Some known far worse than rays know them, as if the eye were far off.
        if let Some(receiver) = found.last_mut() {
            receiver.error *= [1.0, 2f64.powi(25), 2f64.powi(38)][(numbers.bits() % 3) as usize];
        }
        found.extend([(); 3].map(|()| Receiver::free((eye + numbers.point() * 2.0).as_dvec3())));
    }
    found
}

fn check(name: &str, mesh: &Mesh, receivers: &[Receiver], light: AreaLight, count: u32) -> AreaCounts {
    let triangles = mesh.triangles();
    let samples = Samples::new(count, 7);
    let pixels: Vec<u32> = (0..receivers.len() as u32).map(|i| i * 31 + 5).collect();
    let brute = BruteForce::new(triangles);
    let expected: Vec<Vec<u32>> = receivers
        .iter()
        .zip(&pixels)
        .map(|(r, &pixel)| brute.visible_samples(r, &light, &samples, pixel))
        .collect();
    let mut counts = AreaCounts::default();
    let topology = Topology::analyse(&triangles);
    for level in SimdLevel::available() {
        let tree = AreaLightTree::build(light, triangles, &|_| Casts::Both, level).with_topology(&topology);
        let (mut scratch, mut bits) = (AreaScratch::default(), Vec::new());
        tree.visible(receivers, &pixels, &samples, &mut scratch, &mut bits);
        for (i, (got, want)) in bits.chunks(samples.words()).zip(&expected).enumerate() {
            let place = || format!("{name}, {}, {light:?}, {i}: {:?}", level.name(), receivers[i]);
            assert_eq!(got, want, "{}", place());
        }
        counts = scratch.counts;
    }
    for resolution in [None, Some([24, 20, 4])] {
        let options = FaceOptions {
            resolution,
            ..FaceOptions::default()
        };
        let grid = AreaLightGrid::build(light, triangles, &|_| Casts::Both, &options);
        let (mut scratch, mut bits) = (AreaScratch::default(), Vec::new());
        grid.visible(receivers, &pixels, &samples, &mut scratch, &mut bits);
        for (i, (got, want)) in bits.chunks(samples.words()).zip(&expected).enumerate() {
            let place = || format!("{name}, {resolution:?}, {light:?}, {i}: {:?}", receivers[i]);
            assert_eq!(got, want, "{}", place());
        }
        assert_eq!(scratch.counts.receivers, counts.receivers);
    }
    counts
}

fn lights() -> Vec<AreaLight> {
    let (u, v) = (Vec3::new(0.2, 0.0, 0.1), Vec3::new(-0.05, 0.2, 0.1));
    let down = |center: Vec3, size: f32| AreaLight::rectangle(center, Vec3::X * size, Vec3::Z * size);
    vec![
        down(Vec3::new(0.5, 3.0, 0.4), 0.3),
        down(Vec3::new(0.1, 0.9, 0.2), 0.4),
        AreaLight::rectangle(Vec3::new(0.05, 0.02, -0.03), u, v),
        AreaLight::disk(Vec3::new(-1.2, 0.3, 0.4), u, v * 3.0),
        AreaLight::disk(Vec3::new(1e4, 2e4, -1e4), Vec3::X * -900.0, Vec3::Z * 900.0),
        AreaLight::sphere(Vec3::new(1.5, 1.8, 1.1), 0.4),
        AreaLight::sphere(Vec3::new(0.1, -0.2, 0.05), 0.3),
        AreaLight::sphere(Vec3::new(0.4, 0.5, 0.1), 1e-3),
        AreaLight::sun(Vec3::new(0.3, 1.0, 0.2), 0.05),
        AreaLight::sun(Vec3::Y, 0.6),
    ]
}

#[test]
fn equals_brute_force_for_lights_everywhere() {
    let mut total = AreaCounts::default();
    for (name, mesh) in [
        ("soup", Mesh::soup(3, 300, 0.3, 1.0)),
        ("blob", Mesh::blob(16)),
        ("awkward", Mesh::awkward()),
    ] {
        for eye in [Vec3::new(0.2, 0.5, 2.5), Vec3::new(0.1, 0.05, 0.0)] {
            let receivers = receivers(&mesh, eye, 4, 11);
            for light in lights() {
                let counts = check(name, &mesh, &receivers, light, 5);
                total.untested += counts.untested;
                total.exact_pairs += counts.exact_pairs;
                total.tests += counts.tests;
            }
        }
    }
    assert!(
        total.untested > 500 && total.tests > 500 && total.exact_pairs > 10,
        "{total:?}"
    );
}

#[test]
fn equals_brute_force_for_any_number_of_samples() {
    let mesh = Mesh::soup(9, 200, 0.3, 1.0);
    let receivers = receivers(&mesh, Vec3::new(0.2, 0.5, 2.5), 3, 2);
    for count in [1, 2, 31, 32, 33, 64, 256] {
        for light in [lights()[0], lights()[5]] {
            check("counts", &mesh, &receivers, light, count);
        }
    }
}

#[test]
fn equals_brute_force_at_any_scale_and_offset() {
    for (scale, offset) in [
        (1e-3, 0.0),
        (1e-3, 1.0),
        (1e3, 1e6),
        (1e6, 1e6),
        (1.0, 1e5),
        (1e-25, 0.0),
        (1e20, 0.0),
    ] {
        let offset = Vec3::new(offset, -offset, offset * 0.5);
        let mesh = Mesh::blob(12).scaled(scale, offset);
        let mut numbers = Numbers(4);
        let receivers: Vec<_> = (0..100)
            .map(|_| Receiver::free((numbers.point() * 2.0 * scale + offset).as_dvec3()))
            .collect();
        let place = |p: Vec3| p * scale + offset;
        for light in [
            AreaLight::rectangle(
                place(Vec3::new(0.2, 2.0, 0.1)),
                Vec3::X * scale * 0.3,
                Vec3::Z * scale * 0.3,
            ),
            AreaLight::sphere(place(Vec3::new(0.1, 0.1, 0.0)), 0.3 * scale),
            AreaLight::sun(Vec3::new(1.0, 2.0, 0.5), 0.1),
        ] {
            check(
                &format!("scale {scale} offset {offset}"),
                &mesh,
                &receivers,
                light,
                4,
            );
        }
    }
}

#[test]
fn a_light_without_area_gives_the_hard_shadow_of_its_middle() {
    let mesh = Mesh::blob(16);
    let receivers = receivers(&mesh, Vec3::new(0.2, 0.5, 2.5), 8, 3);
    let position = Vec3::new(0.7, 1.4, 0.4);
    for light in [
        AreaLight::rectangle(position, Vec3::ZERO, Vec3::ZERO),
        AreaLight::rectangle(position, Vec3::X, Vec3::ZERO),
        AreaLight::disk(position, Vec3::ZERO, Vec3::ZERO),
        AreaLight::sphere(position, 0.0),
        AreaLight::sun(position, 0.0),
    ] {
        check("no area", &mesh, &receivers, light, 3);
        if light.half_u != Vec3::ZERO && !light.is_sun() {
            continue;
        }
        let end = if light.is_sun() {
            Light::Directional(light.center)
        } else {
            Light::Point(position)
        };
        let tree = AreaLightTree::build(light, mesh.triangles(), &|_| Casts::Both, SimdLevel::detect());
        let mut bits = Vec::new();
        let pixels = vec![0; receivers.len()];
        tree.visible(
            &receivers,
            &pixels,
            &Samples::new(3, 1),
            &mut AreaScratch::default(),
            &mut bits,
        );
        for (receiver, bits) in receivers.iter().zip(bits) {
            let prims = 0..mesh.indices.len() as u32;
            let dark = prims
                .into_iter()
                .any(|p| exact::shadows(&mesh.triangles(), p, receiver, &end));
            assert_eq!(bits, if dark { 0 } else { 7 }, "{light:?} {receiver:?}");
        }
    }
}

#[test]
fn nothing_and_nonsense() {
    let receivers = [DVec3::ZERO, DVec3::NAN, DVec3::splat(1e300)].map(Receiver::free);
    let soup = Mesh::soup(1, 20, 0.3, 1.0);
    for mesh in [&Mesh::default(), &soup] {
        for light in [
            lights()[0],
            AreaLight::sphere(Vec3::NAN, 1.0),
            AreaLight::sphere(Vec3::ZERO, f32::INFINITY),
            AreaLight::rectangle(Vec3::ZERO, Vec3::NAN, Vec3::X),
            AreaLight::sun(Vec3::ZERO, 0.1),
            AreaLight::sun(Vec3::NAN, 0.1),
        ] {
            check("nonsense", mesh, &receivers, light, 2);
        }
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
        for light in [lights()[0], lights()[5], lights()[8]] {
            check("huge", &mesh, &receivers, light, 4);
        }
    }
}

#[test]
fn receivers_around_and_behind_the_light() {
    // A lampshade: triangles as near to the light as its own size, and some that its plane cuts.
    let mut mesh = Mesh::soup(21, 60, 0.1, 0.35);
    let center = Vec3::new(0.02, 0.03, 0.01);
    for i in 0..12 {
        let angle = i as f32 * 0.5;
        let side = Vec3::new(angle.cos(), 0.0, angle.sin()) * 0.3;
        mesh.triangle([
            center + side - Vec3::Y * 0.2,
            center + side + Vec3::Y * 0.2,
            center + side * 1.3,
        ]);
    }
    let mut numbers = Numbers(77);
    let receivers: Vec<_> = (0..400)
        .map(|i| Receiver::free((center + numbers.point() * [0.1, 0.5, 3.0][i % 3]).as_dvec3()))
        .collect();
    for light in [
        AreaLight::rectangle(center, Vec3::X * 0.1, Vec3::Z * 0.1),
        AreaLight::rectangle(center, Vec3::Z * 0.1, Vec3::X * 0.1),
        AreaLight::disk(center, Vec3::X * 0.3, Vec3::Z * 0.3),
        AreaLight::sphere(center, 0.05),
        AreaLight::sphere(center, 0.4),
    ] {
        check("lampshade", &mesh, &receivers, light, 8);
    }
}

#[test]
fn casters_that_face_the_light_may_be_left_out_of_closed_meshes() {
    let mesh = Mesh::blob(20);
    let triangles = mesh.triangles();
    let eye = Vec3::new(0.2, 0.5, 2.5);
    let light = AreaLight::rectangle(Vec3::new(1.0, 3.0, 1.0), Vec3::X * 0.5, Vec3::Z * 0.5);
    let mut receivers = receivers(&mesh, eye, 60, 17);
    let samples = Samples::new(8, 0);
    // Of a receiver whose own plane the light crosses only some samples are asked about.
    receivers.retain(|r| r.prim != u32::MAX && light.side(triangles.corners(r.prim)) != 0.0);
    receivers.retain(|r| {
        let n = triangles.normal(r.prim);
        n.dot(light.center.as_dvec3() - r.point) * n.dot(eye.as_dvec3() - r.point) > 0.0
    });
    assert!(receivers.len() > 100);
    let pixels = vec![3; receivers.len()];
    let visible = |casts: Casts| {
        let tree = AreaLightTree::build(light, triangles, &|_| casts, SimdLevel::detect());
        let mut bits = Vec::new();
        tree.visible(
            &receivers,
            &pixels,
            &samples,
            &mut AreaScratch::default(),
            &mut bits,
        );
        (bits, tree.reference_count())
    };
    let (both, back) = (visible(Casts::Both), visible(Casts::Back));
    assert_eq!(both.0, back.0);
    assert!(back.1 < both.1 * 3 / 4 && both.0.contains(&255) && both.0.iter().any(|&b| b != 255));
    assert_eq!(visible(Casts::Nothing), (vec![255; receivers.len()], 0));
}

/// Receivers of which each sixteen, 64 and 256 lie close together, under the middle of a sheet; a sheet of triangles smaller
/// than what they span, and a light above.
fn under_a_sheet() -> (Mesh, Vec<Receiver>, AreaLight) {
    let (mut mesh, mut numbers) = (Mesh::default(), Numbers(3));
    let at = |i: i32, j: i32| {
        let height = 0.1 * ((i * 7 + j * 3) % 5) as f32 * 0.1;
        Vec3::new(i as f32 * 0.04, 0.5 + height, j as f32 * 0.04)
    };
    for (i, j) in (-15..15).flat_map(|i| (-15..15).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        mesh.triangle([a, b, c]);
        mesh.triangle([a, c, d]);
    }
    let mut place = |_| {
        let p = numbers.point() * 0.1 + Vec3::new(0.01, -0.5, 0.02);
        Receiver::free(p.as_dvec3())
    };
    let receivers = (0..512).map(&mut place).collect();
    let light = AreaLight::rectangle(Vec3::Y * 1.5, Vec3::X * 0.1, Vec3::Z * 0.1);
    (mesh, receivers, light)
}

#[test]
fn small_triangles_that_hang_together_hide_the_light_from_all() {
    let (mesh, receivers, light) = under_a_sheet();
    let counts = check("sheet", &mesh, &receivers, light, 8);
    assert_eq!((counts.covered, counts.tests), (512, 0), "{counts:?}");
}

#[test]
fn light_comes_through_gaps_between_them() {
    // A triangle that is missing, one that is turned round, one moved away after the topology was found, and a second
    // one in the same place: each breaks the sheet or does not, and answers are right.
    let (whole, receivers, light) = under_a_sheet();
    let middle = 15 * 30 + 15;
    let samples = Samples::new(8, 7);
    let pixels: Vec<u32> = (0..512).collect();
    for change in 0..4 {
        let (mut mesh, ..) = under_a_sheet();
        let triangle = 2 * middle;
        let corners = mesh.indices[triangle];
        let mut topology = Topology::analyse(&whole.triangles());
        match change {
            0 => {
                mesh.indices.remove(triangle);
                topology = Topology::analyse(&mesh.triangles());
            }
            1 => {
                mesh.indices[triangle].swap(0, 1);
                topology = Topology::analyse(&mesh.triangles());
            }
            2 => corners.iter().for_each(|&i| mesh.x[i as usize] += 0.03),
            _ => {
                mesh.indices.push(corners);
                topology = Topology::analyse(&mesh.triangles());
            }
        }
        let triangles = mesh.triangles();
        let brute = BruteForce::new(triangles);
        let expected: Vec<u32> = receivers
            .iter()
            .zip(&pixels)
            .flat_map(|(r, &pixel)| brute.visible_samples(r, &light, &samples, pixel))
            .collect();
        let seen: u32 = expected.iter().map(|bits| bits.count_ones()).sum();
        assert_eq!(seen > 0, change == 0 || change == 2, "change {change}: {seen}");
        for level in SimdLevel::available() {
            let tree =
                AreaLightTree::build(light, triangles, &|_| Casts::Both, level).with_topology(&topology);
            let mut bits = Vec::new();
            let mut scratch = AreaScratch::default();
            tree.visible(&receivers, &pixels, &samples, &mut scratch, &mut bits);
            assert!(bits == expected, "change {change}, {}", level.name());
        }
    }
}

#[test]
fn a_triangle_that_does_not_cast_is_a_gap() {
    let (mesh, receivers, light) = under_a_sheet();
    let (samples, pixels) = (Samples::new(8, 7), vec![3; 512]);
    let topology = Topology::analyse(&mesh.triangles());
    let missing = 2 * (15 * 30 + 15);
    let rule = |prim: u32| {
        if prim == missing {
            Casts::Nothing
        } else {
            Casts::Both
        }
    };
    let tree = AreaLightTree::build(light, mesh.triangles(), &rule, SimdLevel::detect());
    let tree = tree.with_topology(&topology);
    let (mut scratch, mut bits) = (AreaScratch::default(), Vec::new());
    tree.visible(&receivers, &pixels, &samples, &mut scratch, &mut bits);
    assert!(scratch.counts.covered == 0 && bits.iter().any(|&b| b != 0));
}

#[test]
fn a_sheet_that_hides_the_light_from_some_is_no_sheet_for_others() {
    // A square of receivers around an edge: two batches in its middle, and one far below and aside on either side, of which
    // one sees the light through a hole in the same sheet. What lies between them is met by no ray of any.
    let mut mesh = Mesh::default();
    let at = |i: i32, j: i32| Vec3::new(i as f32 * 0.1 + 0.03, 1.0, j as f32 * 0.1 + 0.04);
    for (i, j) in (-60..60).flat_map(|i| (-60..60).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        if !((30..36).contains(&i) && (-3..3).contains(&j)) {
            mesh.triangle([a, b, c]);
            mesh.triangle([a, c, d]);
        }
    }
    let mut numbers = Numbers(3);
    let light = AreaLight::rectangle(Vec3::Y * 2.0, Vec3::X * 0.05, Vec3::Z * 0.05);
    // Receivers that are level have a box whose sides are, so that all of it lies below the sheet.
    for (depth, jitter) in [
        (0.0, Vec3::ONE),
        (-8.0, Vec3::ONE),
        (-8.0, Vec3::new(1.0, 0.0, 1.0)),
    ] {
        // Below the middle of the hole, on the line that goes through it from the light.
        let seeing = Vec3::new(3.3 * (2.0 - depth), depth, 0.0);
        let places = [
            Vec3::new(-seeing.x, depth, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
            seeing,
        ];
        let place = |i: usize| Receiver::free((places[i / 16] + numbers.point() * jitter * 0.02).as_dvec3());
        let receivers: Vec<_> = (0..64).map(place).collect();
        let counts = check("hole", &mesh, &receivers, light, 8);
        assert!(counts.tests > 0, "{counts:?}");
        let tree = AreaLightTree::build(light, mesh.triangles(), &|_| Casts::Both, SimdLevel::detect());
        let mut bits = Vec::new();
        let (samples, mut scratch) = (Samples::new(8, 7), AreaScratch::default());
        tree.visible(&receivers, &[1; 64], &samples, &mut scratch, &mut bits);
        assert!(bits[..48].iter().all(|&b| b == 0) && bits[48..].iter().any(|&b| b != 0));
    }
}

#[test]
fn a_plane_through_the_light_hides_a_part_of_it() {
    // All lines from the receivers through the light pass inside of one triangle, some of them behind the light.
    let far = |x: f32, z: f32| Vec3::new(x, 2.0, z) * Vec3::new(100.0, 1.0, 100.0);
    let mut mesh = Mesh::default();
    mesh.triangle([far(-1.0, -1.0), far(1.0, -1.0), far(0.0, 1.0)]);
    let mut numbers = Numbers(5);
    let place = |_| Receiver::free((Vec3::Z * 3.0 + numbers.point() * 0.02).as_dvec3());
    let receivers: Vec<_> = (0..64).map(place).collect();
    let (middle, x, y) = (Vec3::Y * 2.0, Vec3::X * 0.5, Vec3::Y * 0.5);
    for light in [AreaLight::sphere(middle, 0.5), AreaLight::rectangle(middle, x, y)] {
        check("through the light", &mesh, &receivers, light, 8);
        let (brute, samples) = (BruteForce::new(mesh.triangles()), Samples::new(8, 7));
        let seen = |r: &Receiver| brute.visible_samples(r, &light, &samples, 1)[0].count_ones();
        let seen: u32 = receivers.iter().map(seen).sum();
        assert!(seen > 100 && seen < 400, "{light:?}: {seen}");
    }
}

#[test]
fn light_passes_beside_the_fold_of_a_sheet() {
    // At the fold two triangles share an edge, but lie on the same side of it.
    let mut mesh = Mesh::default();
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let [a, b] = [at(-1.0, 0.5, -1.0), at(-1.0, 0.5, 1.0)];
    let [c, d] = [at(0.02, 0.5, 1.0), at(0.02, 0.5, -1.0)];
    let [e, f] = [at(-1.0, 0.45, -1.0), at(-1.0, 0.45, 1.0)];
    for corners in [[a, b, c], [a, c, d], [d, c, f], [d, f, e]] {
        mesh.triangle(corners);
    }
    let (_, receivers, light) = under_a_sheet();
    check("fold", &mesh, &receivers, light, 8);
    let samples = Samples::new(8, 7);
    let brute = BruteForce::new(mesh.triangles());
    let seen = receivers
        .iter()
        .map(|r| brute.visible_samples(r, &light, &samples, 1)[0].count_ones());
    let seen: u32 = seen.sum();
    assert!(seen > 500 && seen < 3500, "{seen}");
}
