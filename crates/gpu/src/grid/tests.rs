//! Grids of cameras and lights beside brute force.

use glam::{DVec3, Vec3};
use rayward_trace::{BruteForce, Bvh, Light, Receiver, View};

use super::*;
use crate::tests::{Mesh, Numbers, gpu, meshes, rays};

fn looking(from: Vec3, at: Vec3, tan: f64, size: [u32; 2]) -> View {
    let forward = (at - from).as_dvec3().normalize();
    let right = forward.any_orthonormal_vector();
    View::perspective(from, [right, right.cross(forward), forward], [tan; 2], size)
}

fn views() -> [View; 4] {
    let [right, up, forward] = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    [
        looking(Vec3::new(2.5, 1.0, 2.0), Vec3::ZERO, 0.5, [70, 45]),
        // Among the triangles, and through a vertex of the grid of coplanar ones.
        looking(Vec3::new(0.2, 0.1, 0.3), Vec3::X, 1.5, [64, 64]),
        looking(
            Vec3::new(0.1, 0.0, -0.75),
            Vec3::new(1.1, 0.3, -0.75),
            1.0,
            [33, 64],
        ),
        View::parallel(Vec3::Z * 4.0, [right, up, forward], [1.4; 2], 64.0, [64, 50]),
    ]
}

#[test]
fn cameras_see_what_brute_force_does() {
    let Some(gpu) = gpu() else { return };
    for (k, mesh) in meshes().iter().enumerate() {
        let triangles = mesh.triangles();
        let bvh = Bvh::build(triangles);
        let geometry = GridGeometry::new(&gpu, triangles).unwrap_or_else(|e| panic!("{e}"));
        for (v, view) in views().iter().enumerate() {
            let grid = GpuGrid::of_camera(&geometry, view).unwrap_or_else(|e| panic!("{e}"));
            let pixels: Vec<[u32; 2]> = (0..view.height)
                .flat_map(|y| (0..view.width).map(move |x| [x, y]))
                .collect();
            let (seen, stats) = grid.seen(&pixels, &bvh).unwrap_or_else(|e| panic!("{e}"));
            let mut hits = 0;
            for (&[x, y], &prim) in pixels.iter().zip(&seen) {
                let ray = view.pixel_ray(x, y);
                let truth = first(triangles, &ray);
                assert_eq!(prim, truth, "mesh {k}, view {v}, pixel {x}, {y}");
                hits += usize::from(prim.is_some());
            }
            assert!(hits > 200, "mesh {k}, view {v}: {hits}");
            // The last mesh has triangles within others, where nothing is certain.
            assert!(k == 2 || stats.unsure < pixels.len() / 10, "{stats:?}");
            assert!(grid.bytes() > 8 * grid.entries());
        }
    }
}

/// The closest triangle of an eye ray, all tested.
fn first(triangles: Triangles, ray: &ViewRay) -> Option<u32> {
    let hit = |prim| {
        let corners = triangles.corners(prim);
        let finite = corners.iter().all(|p| p.is_finite());
        let hit = rayward_trace::exact::hit(ray.origin, ray.dir, corners);
        hit.filter(|hit| finite && hit.t > 0.0).map(|hit| (hit.t, prim))
    };
    let all = (0..triangles.len() as u32).filter_map(hit);
    all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
        .map(|(_, prim)| prim)
}

#[test]
fn shadows_through_grids_are_those_of_brute_force() {
    let Some(gpu) = gpu() else { return };
    let lights = [
        Light::Point(Vec3::new(3.0, 1.0, 2.0)),
        // Among the triangles: six faces.
        Light::Point(Vec3::new(0.3, 0.2, 0.1)),
        Light::Directional(Vec3::new(0.2, 0.5, 1.0)),
    ];
    for (k, mesh) in meshes().iter().enumerate() {
        let triangles = mesh.triangles();
        let (brute, bvh) = (BruteForce::new(triangles), Bvh::build(triangles));
        let geometry = GridGeometry::new(&gpu, triangles).unwrap_or_else(|e| panic!("{e}"));
        let mut receivers: Vec<Receiver> = rays(7, 2500)
            .iter()
            .filter_map(|ray| {
                let (prim, hit) = brute.closest(ray)?;
                Some(Receiver::on_surface(ray, hit.t, prim))
            })
            .collect();
        // Some that the light's raster does not show.
        let mut numbers = Numbers(4);
        receivers.extend((0..50).map(|_| Receiver::free(numbers.point().as_dvec3() * 4.0)));
        for light in &lights {
            let grid = GpuGrid::of_light(&geometry, light).unwrap_or_else(|e| panic!("{e}"));
            let grid = grid.expect("it can be projected");
            let answers = grid.shadowed(&receivers, light, &bvh);
            let (dark, stats) = answers.unwrap_or_else(|e| panic!("{e}"));
            let mut count = 0;
            for (receiver, dark) in receivers.iter().zip(&dark) {
                assert_eq!(
                    *dark,
                    brute.shadowed(receiver, light),
                    "{k} {light:?} {receiver:?}"
                );
                count += usize::from(*dark);
            }
            assert!(count > 30, "{count} of {}", receivers.len());
            assert!(k == 2 || stats.unsure < receivers.len() / 3, "{stats:?}");
        }
    }
}

#[test]
fn what_cannot_be_projected_has_no_grid_and_nothing_has_an_empty_one() {
    let Some(gpu) = gpu() else { return };
    let mut huge = Mesh::lump(6);
    huge.x.iter_mut().for_each(|x| *x *= 1e32);
    let geometry = GridGeometry::new(&gpu, huge.triangles()).unwrap_or_else(|e| panic!("{e}"));
    let grid = GpuGrid::of_light(&geometry, &Light::Point(Vec3::ZERO));
    assert!(grid.is_ok_and(|grid| grid.is_none()));
    let empty = Mesh::default();
    let geometry = GridGeometry::new(&gpu, empty.triangles()).unwrap_or_else(|e| panic!("{e}"));
    let bvh = Bvh::build(empty.triangles());
    let grid = GpuGrid::of_camera(&geometry, &views()[0]).unwrap_or_else(|e| panic!("{e}"));
    let (seen, _) = grid.seen(&[[1, 2]], &bvh).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(seen, [None]);
    let light = Light::Directional(Vec3::Z);
    let grid = GpuGrid::of_light(&geometry, &light).unwrap_or_else(|e| panic!("{e}"));
    let grid = grid.expect("a grid of nothing");
    let receivers = [Receiver::free(DVec3::ONE)];
    let answers = grid.shadowed(&receivers, &light, &bvh);
    assert!(answers.is_ok_and(|(dark, _)| dark == [false]));
}

#[test]
fn cells_too_long_to_be_put_in_order_are_left_to_the_cpu() {
    let Some(gpu) = gpu() else { return };
    // Thousands of triangles behind each other, those in front mostly with a hole where the rays are.
    let mut numbers = Numbers(9);
    let mut mesh = Mesh::default();
    for _ in 0..20_000 {
        let z = numbers.next();
        let middle = Vec3::new(numbers.next() * 0.2, numbers.next() * 0.2, z);
        mesh.triangle([(); 3].map(|()| middle + numbers.point() * Vec3::new(0.05, 0.05, 0.0)));
    }
    let triangles = mesh.triangles();
    let bvh = Bvh::build(triangles);
    let geometry = GridGeometry::new(&gpu, triangles).unwrap_or_else(|e| panic!("{e}"));
    let view = looking(Vec3::new(0.02, 0.01, 6.0), Vec3::ZERO, 0.06, [16, 16]);
    let grid = GpuGrid::of_camera(&geometry, &view).unwrap_or_else(|e| panic!("{e}"));
    let pixels: Vec<[u32; 2]> = (0..256).map(|i| [i % 16, i / 16]).collect();
    let (seen, stats) = grid.seen(&pixels, &bvh).unwrap_or_else(|e| panic!("{e}"));
    for (&[x, y], &prim) in pixels.iter().zip(&seen) {
        assert_eq!(prim, first(triangles, &view.pixel_ray(x, y)), "{x}, {y}");
    }
    assert!(stats.unsure > 100, "{stats:?}");
}
