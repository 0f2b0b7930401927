//! The hierarchy on a device beside brute force.

use rayward_trace::{Accel, BruteForce, Bvh, Hit, Light, Ray, Receiver, Triangles};

use super::GpuBvh;
use crate::tests::{Mesh, gpu, meshes, rays};

/// One that knows nothing: every answer that is left is the device's own.
pub(crate) struct Silent;

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

#[test]
fn answers_are_those_of_brute_force() {
    let Some(gpu) = gpu() else { return };
    for mesh in meshes() {
        let (brute, bvh) = (BruteForce::new(mesh.triangles()), Bvh::build(mesh.triangles()));
        let tree = GpuBvh::new(&gpu, mesh.triangles(), &bvh).unwrap_or_else(|e| panic!("{e}"));
        let rays = rays(11, 3000);
        let (hits, stats) = tree.closest(&rays, &brute).unwrap_or_else(|e| panic!("{e}"));
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, brute.intersect(ray), "{ray:?}");
        }
        assert!(hits.iter().flatten().count() > 300);
        assert!(stats.unsure < rays.len() / 3, "{stats:?}");
        assert!(stats.steps.cells > 0 && stats.steps.triangles > 0);
        let light = Light::Point(glam::Vec3::new(0.3, 2.0, 1.5));
        let queries: Vec<_> = rays
            .iter()
            .filter_map(|ray| {
                brute
                    .closest(ray)
                    .map(|(prim, hit)| (Receiver::on_surface(ray, hit.t, prim), light))
            })
            .collect();
        let (dark, _) = tree.shadowed(&queries, &brute).unwrap_or_else(|e| panic!("{e}"));
        for ((receiver, light), dark) in queries.iter().zip(dark) {
            assert_eq!(dark, brute.shadowed(receiver, light), "{receiver:?}");
        }
    }
}

#[test]
fn what_is_certain_is_right_and_most_is_certain() {
    let Some(gpu) = gpu() else { return };
    let mesh = Mesh::lump(60);
    let (brute, bvh) = (BruteForce::new(mesh.triangles()), Bvh::build(mesh.triangles()));
    let tree = GpuBvh::new(&gpu, mesh.triangles(), &bvh).unwrap_or_else(|e| panic!("{e}"));
    let rays = rays(3, 2000);
    let (hits, stats) = tree.closest(&rays, &Silent).unwrap_or_else(|e| panic!("{e}"));
    let mut missed = 0;
    for (ray, hit) in rays.iter().zip(&hits) {
        let truth = brute.intersect(ray);
        assert!(hit.is_none() || *hit == truth, "{ray:?} {hit:?} {truth:?}");
        missed += usize::from(*hit != truth);
    }
    assert!(
        missed <= stats.unsure && stats.unsure < rays.len() / 50,
        "{missed} {stats:?}"
    );
}

#[test]
fn nothing_is_hit_without_triangles() {
    let Some(gpu) = gpu() else { return };
    let nothing = Triangles::new(&[], &[], &[], &[]);
    let tree = GpuBvh::new(&gpu, nothing, &Bvh::build(nothing)).unwrap_or_else(|e| panic!("{e}"));
    let (hits, _) = tree
        .closest(&rays(1, 10), &Silent)
        .unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(hits, [None; 10]);
}
