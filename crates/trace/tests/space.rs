//! The maps between world and the spaces that structures partition.

mod support;

use glam::{DMat3, DVec3, Vec3};
use rayward_trace::space::{Face, FaceIntervals, Orthographic, Perspective, Space, World};
use rayward_trace::{Ray, ViewRay};
use support::Random;

fn frame(random: &mut Random) -> [DVec3; 3] {
    let turn = DMat3::from_euler(
        glam::EulerRot::XYZ,
        f64::from(random.signed()) * 3.0,
        f64::from(random.signed()) * 1.5,
        f64::from(random.signed()) * 3.0,
    );
    [turn.x_axis, turn.y_axis, turn.z_axis]
}

fn perspective(random: &mut Random, far: f64) -> Perspective {
    let [right, up, forward] = frame(random);
    Perspective {
        center: random.in_cube().as_dvec3() * 5.0,
        right,
        up,
        forward,
        tan_x: 0.3 + f64::from(random.unit()),
        tan_y: 0.3 + f64::from(random.unit()),
        near: 0.1,
        far,
    }
}

fn orthographic(random: &mut Random) -> Orthographic {
    let [right, up, forward] = frame(random);
    let center = random.in_cube().as_dvec3();
    Orthographic {
        center,
        right,
        up,
        forward,
        half_x: 3.0,
        half_y: 2.0,
        near: -1.0,
        far: 4.0,
    }
}

fn ray(random: &mut Random, t_max: f32) -> Ray {
    let mut ray = Ray::new(random.in_cube() * 8.0, random.direction());
    (ray.t_min, ray.t_max) = (-1.0, t_max);
    ray
}

#[test]
fn points_go_there_and_back() {
    let mut random = Random::new(1);
    for k in 0..2000 {
        let space = perspective(&mut random, if k % 2 == 0 { 100.0 } else { f64::INFINITY });
        let q = DVec3::new(
            random.signed().into(),
            random.signed().into(),
            random.unit().into(),
        );
        let p = space.world(q);
        assert!((space.point(p) - q).length() < 1e-11, "{q} {}", space.point(p));
        let space = orthographic(&mut random);
        assert!((space.point(space.world(q)) - q).length() < 1e-13);
    }
}

#[test]
fn depth_runs_from_zero_to_one() {
    let mut random = Random::new(2);
    let space = perspective(&mut random, 50.0);
    let at = |depth: f64| space.point(space.center + space.forward * depth).z;
    assert!(at(space.near).abs() < 1e-12 && (at(space.far) - 1.0).abs() < 1e-12);
    assert!((1..500).all(|i| at(0.1 * f64::from(i)) < at(0.1 * f64::from(i + 1))));
}

/// A ray's points map to the space ray's points, `t` and `s` convert into each other, and the segment lies within
/// the limits.
fn check_ray(space: &impl Space, ray: &Ray, seed: usize) -> bool {
    let Some(mapped) = space.ray(ray) else {
        return false;
    };
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let reaches = if mapped.t_end.is_finite() { 20 } else { 19 };
    for i in 0..=reaches {
        let s = f64::from(i) / 20.0;
        let t = mapped.t_of_s(s);
        assert!(
            (mapped.s_of_t(t) - s).abs() < 1e-12,
            "case {seed}: s {s} t {t} back {}",
            mapped.s_of_t(t)
        );
        assert!(
            t >= mapped.t_start - 1e-12 && t <= mapped.t_end + 1e-10,
            "case {seed}: t {t} of {mapped:?}"
        );
        let (from_world, on_line) = (space.point(o + d * t), mapped.at(s));
        assert!(
            (from_world - on_line).length() < 1e-9,
            "case {seed}: {from_world} {on_line}"
        );
    }
    true
}

#[test]
fn a_line_stays_a_line_and_parameters_convert() {
    let mut random = Random::new(3);
    let mut mapped = [0; 4];
    for k in 0..4000 {
        let t_max = if k % 3 == 0 { f32::INFINITY } else { 30.0 };
        let far = if k % 2 == 0 { 40.0 } else { f64::INFINITY };
        let ray = ray(&mut random, t_max);
        let space = perspective(&mut random, far);
        mapped[k % 2] += usize::from(check_ray(&space, &ray, k));
        if let Some(r) = space.ray(&ray) {
            let inside = |q: DVec3| {
                q.x.abs() < 1.0 + 1e-9 && q.y.abs() < 1.0 + 1e-9 && q.z > -1e-9 && q.z < 1.0 + 1e-9
            };
            assert!(inside(r.start) && inside(r.end), "case {k}: {r:?}");
        }
        mapped[2] += usize::from(check_ray(&orthographic(&mut random), &ray, k));
        let world = World {
            min: DVec3::splat(-4.0),
            max: DVec3::splat(6.0),
        };
        mapped[3] += usize::from(check_ray(&world, &ray, k));
    }
    assert!(mapped.iter().all(|&n| n > 400), "{mapped:?}");
}

#[test]
fn rays_through_the_center_are_parallel_to_depth() {
    let mut random = Random::new(4);
    for _ in 0..500 {
        let space = perspective(&mut random, f64::INFINITY);
        let q = DVec3::new(random.signed().into(), random.signed().into(), 0.5) * 0.9;
        let d = (space.world(q) - space.center).normalize();
        let (near, far) = (
            space.point(space.center + d * 1.0),
            space.point(space.center + d * 90.0),
        );
        assert!((near - far).truncate().length() < 1e-12);
    }
}

#[test]
fn nothing_behind_the_near_plane_is_mapped() {
    let space = Face::PosZ.perspective(DVec3::ZERO, 1.0, f64::INFINITY);
    let behind = Ray::new(Vec3::new(0.0, 0.0, 0.5), Vec3::new(0.3, 0.0, -1.0));
    assert_eq!(space.ray(&behind), None);
    let along = Ray::new(Vec3::new(-9.0, 0.0, 0.999), Vec3::X);
    assert_eq!(space.ray(&along), None);
    let crossing = space
        .ray(&Ray::new(Vec3::new(0.0, 0.0, -3.0), Vec3::new(0.1, 0.0, 1.0)))
        .expect("it comes out");
    assert_eq!((crossing.t_start, crossing.t_end), (4.0, f64::INFINITY));
    assert!(space.ray(&Ray::new(Vec3::NAN, Vec3::X)).is_none());
}

#[test]
fn clipping_keeps_what_lies_beyond_the_near_plane() {
    let mut random = Random::new(5);
    let mut seen = [0; 5];
    for case in 0..3000 {
        let space = perspective(&mut random, f64::INFINITY);
        let corners = [0; 3].map(|_| space.center + random.in_cube().as_dvec3());
        let polygon = space.clip_triangle(corners);
        let points = polygon.points();
        seen[points.len()] += 1;
        assert!(
            points.iter().all(|p| p.z >= space.near),
            "case {case}: {polygon:?}"
        );
        // Areas of the two sides of the plane add up: clip by the plane from the other side too.
        let view = corners.map(|p| space.view(p));
        let normal = (view[1] - view[0]).cross(view[2] - view[0]);
        let area = |p: &[DVec3]| {
            (1..p.len().max(2) - 1)
                .map(|i| (p[i] - p[0]).cross(p[i + 1] - p[0]).dot(normal))
                .sum::<f64>()
        };
        let flipped = Perspective {
            center: space.center + space.forward * (2.0 * space.near),
            forward: -space.forward,
            ..space
        };
        let other = flipped.clip_triangle([corners[0], corners[2], corners[1]]);
        let rest: Vec<DVec3> = other
            .points()
            .iter()
            .map(|p| DVec3::new(p.x, p.y, -p.z))
            .collect();
        let whole = area(&view);
        assert!(
            ((area(points) - area(&rest)) / whole - 1.0).abs() < 1e-9,
            "case {case}"
        );
        // A cut edge is the same from both of its triangles.
        let there = space.clip_segment(corners[0], corners[1]);
        let back = space.clip_segment(corners[1], corners[0]).map(|[a, b]| [b, a]);
        assert_eq!(there, back, "case {case}");
        assert_eq!(
            there.is_some(),
            view[0].z >= space.near || view[1].z >= space.near
        );
    }
    assert!(seen[0] > 100 && seen[3] > 100 && seen[4] > 100, "{seen:?}");
}

#[test]
fn faces_have_right_handed_axes_and_share_space_by_the_largest_component() {
    for (i, face) in Face::ALL.into_iter().enumerate() {
        let [right, up, forward] = face.axes();
        assert_eq!(right.cross(up), forward);
        assert_eq!(Face::of(forward), face);
        assert_eq!(face as usize, i);
    }
    // Ties go to x before y before z.
    assert_eq!(Face::of(DVec3::new(1.0, -1.0, 1.0)), Face::PosX);
    assert_eq!(Face::of(DVec3::new(-1.0, 1.0, 1.0)), Face::NegX);
    assert_eq!(Face::of(DVec3::new(0.0, -1.0, 1.0)), Face::NegY);
    let mut random = Random::new(6);
    for _ in 0..2000 {
        let v = random.in_cube().as_dvec3() + DVec3::splat(1e-9);
        let q = Face::of(v).perspective(DVec3::ZERO, 1e-3, f64::INFINITY).point(v);
        assert!(q.x.abs() <= 1.0 && q.y.abs() <= 1.0, "{v}");
    }
}

#[test]
fn six_faces_cover_a_ray_but_for_the_near_cube() {
    let mut random = Random::new(7);
    let near = 0.25;
    let (mut through_cube, mut most) = (0, 0);
    for case in 0..5000 {
        let center = random.in_cube().as_dvec3() * 0.5;
        let mut ray = Ray::new(random.in_cube() * 2.0, random.direction());
        if case % 4 == 0 {
            // Through the center's neighbourhood.
            ray.dir = center.as_vec3() + random.in_cube() * 0.3 - ray.origin;
        }
        if case % 7 == 0 {
            ray.dir[random.below(3)] = 0.0;
        }
        (ray.t_min, ray.t_max) = (-2.0, 5.0);
        let spaces = Face::ALL.map(|face| face.perspective(center, near, f64::INFINITY));
        let line = ViewRay {
            origin: ray.origin.as_dvec3(),
            dir: ray.dir.as_dvec3(),
        };
        let intervals = FaceIntervals::new(&spaces, &line, [ray.t_min.into(), ray.t_max.into()]);
        let intervals = intervals.faces();
        most = most.max(intervals.len());
        assert!(intervals.is_sorted_by(|(_, a), (_, b)| a[0] <= b[0]));
        let at = |t: f64| ray.origin.as_dvec3() + ray.dir.as_dvec3() * t - center;
        let mut last = f64::from(ray.t_min);
        for (face, [t_in, t_out]) in intervals
            .iter()
            .copied()
            .chain([(Face::PosX, [f64::from(ray.t_max); 2])])
        {
            if t_in > last {
                // A gap: all of it lies in the near cube.
                through_cube += 1;
                for i in 0..=8 {
                    let distance = at(last + (t_in - last) * f64::from(i) / 8.0).abs().max_element();
                    assert!(
                        distance <= near * (1.0 + 1e-9),
                        "case {case}: gap at distance {distance}"
                    );
                }
            }
            if t_out > t_in {
                let middle = at((t_in + t_out) * 0.5);
                let largest = middle.abs().max_element();
                assert!(
                    face.axes()[2].dot(middle) >= largest * (1.0 - 1e-9),
                    "case {case}: {face:?} at {middle}"
                );
                assert!(
                    largest >= near * (1.0 - 1e-9),
                    "case {case}: inside the near cube"
                );
            }
            last = last.max(t_out);
        }
    }
    assert!(through_cube > 500 && most >= 4, "{through_cube} {most}");
}

/// What a space says of triangles, of hulls and of its own error holds for the points in them.
fn check_shapes(space: &impl Space, shown: impl Fn(DVec3) -> bool, random: &mut Random) -> usize {
    let corners = [0; 3].map(|_| random.in_cube().as_dvec3() * 4.0);
    let (polygon, hull) = (space.polygon(corners), space.hull(&corners));
    let mut points = 0;
    for _ in 0..20 {
        let (u, v) = (f64::from(random.unit()), f64::from(random.unit()));
        let p = corners[0] * (1.0 - u) + corners[1] * (u * (1.0 - v)) + corners[2] * (u * v);
        if !shown(p) {
            continue;
        }
        points += 1;
        let q = space.point(p);
        let [low, high] = hull.expect("a point of it is shown");
        let slack = space.error(8.0) * 64.0 + DVec3::splat(1e-12) * q.abs();
        assert!(
            q.cmpge(low - slack).all() && q.cmple(high + slack).all(),
            "{q} {low} {high}"
        );
        let by_polygon = polygon
            .points()
            .iter()
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], &p| {
                [low.min(p), high.max(p)]
            });
        assert!(
            (by_polygon[0] - low).abs().max_element()
                <= slack.max_element() * low.abs().max_element().max(1.0)
        );
        assert!(
            (by_polygon[1] - high).abs().max_element()
                <= slack.max_element() * high.abs().max_element().max(1.0)
        );
    }
    points
}

#[test]
fn hulls_and_polygons_hold_what_is_shown() {
    let mut random = Random::new(8);
    let mut points = 0;
    for case in 0..2000 {
        let space = perspective(&mut random, if case % 2 == 0 { 100.0 } else { f64::INFINITY });
        let shown = |p: DVec3| space.view(p).z >= space.near;
        points += check_shapes(&space, shown, &mut random);
        check_shapes(&orthographic(&mut random), |_| true, &mut random);
        let world = World {
            min: DVec3::splat(-4.0),
            max: DVec3::splat(4.0),
        };
        check_shapes(&world, |_| true, &mut random);
    }
    assert!(points > 10_000, "{points}");
}
