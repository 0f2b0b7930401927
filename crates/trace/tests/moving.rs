//! Moving triangles at any time of the shutter are the mesh of that time.

mod support;

use glam::{DVec3, Quat, Vec3};
use rayward_trace::{
    Accel, BruteForce, Candidates, FaceOptions, Hit, Light, MovingGrids, MovingTriangles, Receiver,
    Triangles, exact,
};
use support::meshes::{self, Mesh};
use support::{Random, rays};

/// Pairs of poses: still, shifted, turned, collapsed to a point, some vertices astray, one mesh beside a still one.
fn poses() -> Vec<(Mesh, Mesh)> {
    let turn = Quat::from_rotation_y(1.9);
    let blob = meshes::blob(2);
    let scattered = |mesh: &Mesh| {
        let astray = |p: Vec3| Vec3::new((50.0 * p.y).sin(), (40.0 * p.z).sin(), (60.0 * p.x).sin());
        mesh.map("scattered", |p| p + astray(p) * 0.2)
    };
    let mut lost = meshes::soup(33, 300, 0.3);
    lost.x[5] = f32::NAN;
    let still = meshes::ground(50.0);
    vec![
        (blob.clone(), blob.clone()),
        (blob.clone(), blob.placed(1.0, Vec3::new(0.7, 0.1, -0.4))),
        (blob.clone(), blob.map("turned", |p| turn * p)),
        (blob.clone(), blob.map("gone", |_| Vec3::splat(0.25))),
        (meshes::soup(32, 400, 0.2), scattered(&meshes::soup(32, 400, 0.2))),
        (meshes::soup(33, 300, 0.3), lost),
        (
            blob.clone().and(&still),
            blob.map("turned", |p| turn * p).and(&still),
        ),
        (
            blob.placed(1e3, Vec3::splat(1e6)),
            blob.placed(1e3, Vec3::new(1.001e6, 1e6, 1e6)),
        ),
    ]
}

fn bits(hits: &[Hit]) -> Vec<[u32; 4]> {
    let all = hits.iter();
    all.map(|hit| [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim])
        .collect()
}

#[test]
fn moving_grids_equal_brute_force_at_every_time() {
    for (k, (open, close)) in poses().iter().enumerate() {
        let seed = 900 + k as u64;
        let mut random = Random::new(seed);
        let moving = MovingTriangles::new(open.triangles(), close.triangles());
        let centers = [
            DVec3::ZERO,
            open.positions()[0].as_dvec3(),
            open.positions()[1].as_dvec3() * 4.0,
        ];
        let options = FaceOptions::default();
        let slices = [3, 1, 7].into_iter();
        let grids: Vec<_> = centers
            .into_iter()
            .zip(slices)
            .map(|(center, slices)| MovingGrids::build(center, moving, slices, &options))
            .collect();
        for time in [0.0, 1.0, 1.0 / 3.0, 0.123_456_789] {
            let there = moving.at(time);
            let mut mesh = open.clone();
            (mesh.x, mesh.y, mesh.z) = (there.x, there.y, there.z);
            // What has no place at one of the two times is at none.
            let finite =
                |mesh: &Mesh, t: &[u32; 3]| t.iter().all(|&i| mesh.triangles().vertex(i).is_finite());
            for t in &mut mesh.indices {
                if !(finite(open, t) && finite(close, t)) {
                    *t = [t[0]; 3];
                }
            }
            let brute = BruteForce::new(mesh.triangles());
            let light = Light::Point(random.in_cube() * 3.0);
            let mut truth = Vec::new();
            let mut hits = Vec::new();
            for (i, ray) in rays::adversarial(&mesh, seed, 120).iter().enumerate() {
                brute.all_hits(ray, &mut truth);
                let place = || format!("{} to {}, time {time}, ray {i}: {ray:?}", open.name, close.name);
                let receiver = brute
                    .closest(ray)
                    .map(|(prim, hit)| Receiver::on_surface(ray, hit.t, prim));
                for grids in &grids {
                    let now = grids.at(time);
                    now.all_hits(ray, &mut hits);
                    assert_eq!(bits(&hits), bits(&truth), "{}", place());
                    assert_eq!(
                        bits(now.intersect(ray).as_slice()),
                        bits(&truth[..truth.len().min(1)]),
                        "{}",
                        place()
                    );
                    assert_eq!(now.occluded(ray), !truth.is_empty(), "{}", place());
                    if let Some(receiver) = &receiver {
                        let mut blockers = Vec::new();
                        now.blockers(receiver, &light, &mut (), &mut blockers);
                        let finite =
                            |&prim: &u32| mesh.triangles().corners(prim).iter().all(|p| p.is_finite());
                        let all = (0..mesh.indices.len() as u32).filter(finite);
                        let truth = all.filter(|&p| exact::shadows(&mesh.triangles(), p, receiver, &light));
                        assert!(blockers.iter().copied().eq(truth), "{}", place());
                        assert_eq!(
                            now.shadowed(receiver, &light),
                            brute.shadowed(receiver, &light),
                            "{}",
                            place()
                        );
                    }
                }
            }
        }
    }
}

#[test]
#[should_panic(expected = "differ")]
fn two_times_have_the_same_triangles() {
    let (a, b) = (meshes::single(), meshes::soup(1, 1, 0.1));
    let turned = Triangles::new(&b.x, &b.y, &b.z, &[[0, 2, 1]]);
    let _ = MovingTriangles::new(a.triangles(), turned);
}
