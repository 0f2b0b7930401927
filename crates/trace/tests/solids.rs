//! Solids: grids equal brute force, also at times of a shutter and pixel by pixel, intervals are those of point membership,
//! and spheres do not shadow themselves.

mod support;

use glam::DVec3;
use rayward_trace::solids::{Crossing, EyeSolids, Solid, SolidGrids, SolidHits, SolidReceiver, crossings};
use rayward_trace::{FaceOptions, Light, Tile, View, ViewRay};
use support::Random;

fn point(random: &mut Random, size: f32) -> DVec3 {
    (random.in_cube() * size).as_dvec3()
}

fn leaf(random: &mut Random, center: DVec3, size: f64) -> Solid {
    let radius = size * (0.2 + f64::from(random.unit()));
    let (from, to) = (center, center + random.direction().as_dvec3() * size * 2.0);
    match random.below(5) {
        0 => Solid::Cylinder { from, to, radius },
        1 => Solid::Capsule { from, to, radius },
        // Along an axis, where rays can be parallel.
        2 => Solid::Cylinder {
            from,
            to: from + DVec3::AXES[random.below(3)] * size,
            radius,
        },
        3 => {
            let axis = (to - from).normalize();
            let (u, v) = axis.any_orthonormal_pair();
            let turned = random.below(2) == 0;
            Solid::Box {
                center,
                half: if turned {
                    [axis * size, u * radius, v * size]
                } else {
                    [DVec3::X * radius, DVec3::Z * size, DVec3::Y * size * 0.5]
                },
            }
        }
        _ => Solid::Sphere { center, radius },
    }
}

fn tree(random: &mut Random, center: DVec3, size: f64, depth: u32) -> Solid {
    if depth == 0 {
        let off = point(random, size as f32);
        return leaf(random, center + off, size);
    }
    let pair = Box::new([
        tree(random, center, size, depth - 1),
        tree(random, center, size, depth - 1),
    ]);
    match random.below(3) {
        0 => Solid::Union(pair),
        1 => Solid::Intersection(pair),
        _ => Solid::Difference(pair),
    }
}

fn solids(seed: u64, scale: f64, offset: DVec3) -> Vec<Solid> {
    let mut random = Random::new(seed);
    let mut solids: Vec<_> = (0..60)
        .map(|i| {
            let center = offset + point(&mut random, 1.0) * scale;
            tree(&mut random, center, scale * 0.15, i % 3)
        })
        .collect();
    // Copies tie; some are nothing.
    solids.extend_from_within(..10);
    let sphere = |center: DVec3, radius: f64| Solid::Sphere { center, radius };
    solids.push(sphere(offset, 0.0));
    solids.push(sphere(DVec3::NAN, 1.0));
    solids.push(sphere(offset, f64::INFINITY));
    let pair = [sphere(offset, scale * 0.1), sphere(offset + scale, scale * 0.1)];
    solids.push(Solid::Intersection(Box::new(pair)));
    solids
}

fn ray(random: &mut Random, scale: f64, offset: DVec3) -> ViewRay {
    let far = [1.0, 3.0, 1e4][random.below(3)];
    let origin = offset + point(random, 1.0) * scale * far;
    let mut dir = offset + point(random, 1.0) * scale - origin;
    if random.below(4) == 0 {
        dir = DVec3::AXES[random.below(3)] * scale;
    }
    ViewRay { origin, dir }
}

fn bits(hits: &[(u32, Crossing)]) -> Vec<(u32, u64, u32, bool)> {
    let all = hits.iter();
    all.map(|(id, c)| (*id, c.t.to_bits(), c.leaf, c.enters))
        .collect()
}

#[test]
fn grids_equal_brute_force() {
    let places = [(1.0, DVec3::ZERO), (1e-3, DVec3::ONE), (1e3, DVec3::splat(1e6))];
    for (k, (scale, offset)) in places.into_iter().enumerate() {
        let seed = 40 + k as u64;
        let solids = solids(seed, scale, offset);
        let brute = SolidGrids::every([&solids, &solids]);
        let mut random = Random::new(seed);
        let centers = [offset, offset + DVec3::X * scale * 5.0];
        let grids = centers.map(|center| SolidGrids::build(center, &solids, &FaceOptions::default()));
        let (mut seen, mut dark, mut hits) = (0, 0, Vec::new());
        for i in 0..3000 {
            let ray = ray(&mut random, scale, offset);
            let range = [
                [0.0, f64::INFINITY],
                [-1.0, 0.7],
                [f64::NEG_INFINITY, f64::INFINITY],
            ][i % 3];
            let place = || format!("seed {seed}, ray {i}: {ray:?} {range:?}");
            let mut truth: Vec<_> = (0..)
                .zip(&solids)
                .flat_map(|(id, solid)| crossings(solid, &ray, None).into_iter().map(move |c| (id, c)))
                .filter(|(_, c)| c.t > range[0] && c.t <= range[1])
                .collect();
            truth.sort_by(|(p, a), (q, b)| a.t.total_cmp(&b.t).then(p.cmp(q)));
            let closest = brute.closest(&ray, range, None, &mut ());
            assert_eq!(
                bits(closest.as_slice()),
                bits(&truth[..truth.len().min(1)]),
                "{}",
                place()
            );
            let receiver = closest.map(|(id, c)| SolidReceiver {
                point: ray.origin + ray.dir * c.t,
                error: 0.0,
                on: Some((id, c.leaf)),
            });
            let lights = [
                Light::Point((offset + point(&mut random, 2.0) * scale).as_vec3()),
                Light::Directional(random.direction()),
            ];
            seen += usize::from(closest.is_some());
            for grids in &grids {
                grids.all(&ray, range, &mut (), &mut hits);
                assert_eq!(bits(&hits), bits(&truth), "{}", place());
                let found = grids.closest(&ray, range, None, &mut ());
                assert_eq!(bits(found.as_slice()), bits(closest.as_slice()), "{}", place());
                if let Some(receiver) = &receiver {
                    let leaving = ViewRay {
                        origin: receiver.point,
                        dir: random.direction().as_dvec3() * scale,
                    };
                    let truth = brute.closest(&leaving, [0.0, f64::INFINITY], receiver.on, &mut ());
                    let found = grids.closest(&leaving, [0.0, f64::INFINITY], receiver.on, &mut ());
                    assert_eq!(bits(found.as_slice()), bits(truth.as_slice()), "{}", place());
                    assert!(truth.is_none_or(|(id, c)| Some((id, c.leaf)) != receiver.on || c.t > 1e-9));
                }
                for (receiver, light) in receiver.iter().flat_map(|r| lights.iter().map(move |l| (r, l))) {
                    let truth = brute.shadows(receiver, light, &mut ());
                    dark += usize::from(truth);
                    assert_eq!(grids.shadows(receiver, light, &mut ()), truth, "{}", place());
                }
            }
        }
        assert!(seen > 500 && dark > 300, "{seen} {dark}");
    }
}

#[test]
fn moving_solids_are_those_of_their_time() {
    let mut random = Random::new(45);
    let open: Vec<_> = (0..30)
        .map(|i| tree(&mut random, DVec3::ZERO, 0.2, i % 3))
        .collect();
    let moved = |v: DVec3| v * 1.1 + DVec3::new(0.3, -0.2, 0.1);
    let close: Vec<_> = open
        .iter()
        .zip(0..)
        .map(|(solid, i)| {
            if i % 4 == 0 {
                solid.clone()
            } else {
                shifted(solid, &moved)
            }
        })
        .collect();
    let grids = SolidGrids::moving(DVec3::Z * 3.0, [&open, &close], &FaceOptions::default());
    let mut hits = 0;
    for i in 0..2000 {
        let time = f64::from(random.unit());
        let now: Vec<_> = (0..open.len() as u32)
            .map(|id| grids.at(time).solid(id).into_owned())
            .collect();
        let (brute, ray) = (
            SolidGrids::every([&now, &now]),
            ray(&mut random, 0.4, DVec3::ZERO),
        );
        let range = [0.0, f64::INFINITY];
        let (truth, found) = (
            brute.closest(&ray, range, None, &mut ()),
            grids.at(time).closest(&ray, range, None, &mut ()),
        );
        assert_eq!(bits(found.as_slice()), bits(truth.as_slice()), "{i} at {time}");
        hits += usize::from(truth.is_some());
        let light = Light::Point(random.in_cube());
        let receiver = SolidReceiver {
            point: point(&mut random, 1.0),
            error: 0.0,
            on: None,
        };
        let dark = brute.shadows(&receiver, &light, &mut ());
        assert_eq!(grids.at(time).shadows(&receiver, &light, &mut ()), dark, "{i}");
    }
    assert!(hits > 500, "{hits}");
}

/// The solid with its points moved.
fn shifted(solid: &Solid, by: &impl Fn(DVec3) -> DVec3) -> Solid {
    let pair = |pair: &[Solid; 2]| Box::new([shifted(&pair[0], by), shifted(&pair[1], by)]);
    match solid {
        Solid::Sphere { center, radius } => Solid::Sphere {
            center: by(*center),
            radius: radius * 1.2,
        },
        Solid::Cylinder { from, to, radius } => Solid::Cylinder {
            from: by(*from),
            to: by(*to),
            radius: *radius,
        },
        Solid::Capsule { from, to, radius } => Solid::Capsule {
            from: by(*from),
            to: by(*to),
            radius: radius * 0.7,
        },
        Solid::Box { center, half } => Solid::Box {
            center: by(*center),
            half: *half,
        },
        Solid::Union(both) => Solid::Union(pair(both)),
        Solid::Intersection(both) => Solid::Intersection(pair(both)),
        Solid::Difference(both) => Solid::Difference(pair(both)),
    }
}

#[test]
fn pixels_see_what_their_rays_meet() {
    let solids = solids(46, 1.0, DVec3::ZERO);
    let brute = SolidGrids::every([&solids, &solids]);
    let (eye, size) = (DVec3::new(0.1, 0.2, 1.3).as_vec3(), [70, 52]);
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let views = [
        View::perspective(eye, axes, [0.7, 0.5], size),
        // From among the solids, so that boxes reach behind the eye.
        View::perspective((DVec3::Z * 0.2).as_vec3(), axes, [3.0, 2.0], size),
        View::parallel(eye, axes, [1.1, 0.8], 20.0, size),
    ];
    for (which, view) in views.into_iter().enumerate() {
        let eye = EyeSolids::build(view, &solids, 16);
        let (mut hits, mut seen) = (SolidHits::default(), 0);
        for (index, corner) in (0..52u32.div_ceil(16))
            .flat_map(|y| (0..70u32.div_ceil(16)).map(move |x| [x * 16, y * 16]))
            .enumerate()
        {
            let tile = Tile {
                index: index as u32,
                x: corner[0],
                y: corner[1],
                width: (70 - corner[0]).min(16),
                height: (52 - corner[1]).min(16),
            };
            eye.trace_tile(&tile, &mut hits);
            for [x, y] in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| [x, y])) {
                let ray = view.pixel_ray(tile.x + x, tile.y + y);
                let truth = brute.closest(&ray, [0.0, f64::INFINITY], None, &mut ());
                let found = hits.at(x, y).copied();
                assert_eq!(
                    bits(found.as_slice()),
                    bits(truth.as_slice()),
                    "view {which}, {tile:?}, {x} {y}"
                );
                seen += usize::from(truth.is_some());
            }
        }
        assert!(seen > 500, "view {which}: {seen}");
    }
}

fn holds(solid: &Solid, p: DVec3) -> bool {
    let beside = |from: DVec3, to: DVec3, ends: bool| {
        let axis = to - from;
        let along = (p - from).dot(axis) / axis.length_squared();
        let near = from + axis * along.clamp(0.0, 1.0);
        ((0.0..=1.0).contains(&along) || ends, (p - near).length())
    };
    match solid {
        Solid::Sphere { center, radius } => (p - *center).length() < *radius,
        Solid::Cylinder { from, to, radius } => {
            let (between, distance) = beside(*from, *to, false);
            between && distance < *radius
        }
        Solid::Capsule { from, to, radius } => beside(*from, *to, true).1 < *radius,
        Solid::Box { center, half } => half
            .iter()
            .all(|half| (p - *center).dot(*half).abs() < half.length_squared()),
        Solid::Union(pair) => holds(&pair[0], p) || holds(&pair[1], p),
        Solid::Intersection(pair) => holds(&pair[0], p) && holds(&pair[1], p),
        Solid::Difference(pair) => holds(&pair[0], p) && !holds(&pair[1], p),
    }
}

#[test]
fn crossings_part_inside_from_outside_and_normals_point_out() {
    let mut random = Random::new(51);
    let (mut inside, mut checked) = (0, 0);
    for i in 0..6000 {
        let solid = tree(&mut random, DVec3::ZERO, 0.5, i % 4);
        let ray = ray(&mut random, 1.0, DVec3::ZERO);
        let found = crossings(&solid, &ray, None);
        assert!(
            found.iter().zip(0..).all(|(c, k)| c.enters == (k % 2 == 0)),
            "{found:?}"
        );
        let mut ends: Vec<f64> = found.iter().map(|c| c.t).collect();
        assert!(ends.is_sorted());
        let [first, last] = [ends.first(), ends.last()].map(|t| t.copied().unwrap_or(0.0));
        ends.insert(0, first - 1.0);
        ends.push(last + 1.0);
        for (k, pair) in ends.windows(2).enumerate() {
            // Where two surfaces all but coincide, rounding may have either first.
            if pair[1] - pair[0] > 1e-6 {
                let p = ray.origin + ray.dir * (0.5 * (pair[0] + pair[1]));
                assert_eq!(holds(&solid, p), k % 2 == 1, "{solid:?} {ray:?} at {p}");
                inside += k % 2;
                checked += 1;
            }
        }
        for crossing in &found {
            assert!((crossing.normal.length() - 1.0).abs() < 1e-9);
            let facing = crossing.normal.dot(ray.dir) / ray.dir.length();
            assert!(
                if crossing.enters {
                    facing < 1e-4
                } else {
                    facing > -1e-4
                },
                "{solid:?} {crossing:?}"
            );
        }
    }
    assert!(inside > 500 && checked > 4000, "{inside} {checked}");
}

#[test]
fn a_sphere_does_not_shadow_itself() {
    let mut random = Random::new(52);
    for i in 0..20_000 {
        let center = point(&mut random, 1.0) * if i % 2 == 0 { 1.0 } else { 1e5 };
        let solids = [Solid::Sphere { center, radius: 0.5 }];
        let brute = SolidGrids::every([&solids, &solids]);
        let from = center + random.direction().as_dvec3().normalize() * 3.0;
        let ray = ViewRay {
            origin: from,
            dir: center + point(&mut random, 0.4) - from,
        };
        let Some((_, hit)) = brute.closest(&ray, [0.0, f64::INFINITY], None, &mut ()) else {
            continue;
        };
        let receiver = SolidReceiver {
            point: ray.origin + ray.dir * hit.t,
            error: 0.0,
            on: Some((0, hit.leaf)),
        };
        let light = random.direction().as_dvec3().normalize();
        let cosine = light.dot(hit.normal);
        if cosine.abs() > 1e-4 {
            let dark = brute.shadows(&receiver, &Light::Directional(light.as_vec3()), &mut ());
            assert_eq!(dark, cosine < 0.0, "{i}: {cosine}");
        }
    }
}
