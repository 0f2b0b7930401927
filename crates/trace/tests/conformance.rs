//! Every structure for arbitrary rays gives brute force's answers, bit for bit.

mod support;

use rayward_trace::{Accel, BruteForce, Bvh, Hit, Ray, Triangles};
use support::meshes::{self, Mesh};
use support::rays;

/// A row of the table: a structure's name and how to build it.
type Structure = (&'static str, for<'a> fn(Triangles<'a>) -> Box<dyn Accel + 'a>);

const STRUCTURES: [Structure; 2] =
    [("BruteForce", |t| Box::new(BruteForce::new(t))), ("Bvh", |t| Box::new(Bvh::build(t)))];

fn bits(hit: &Hit) -> [u32; 4] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim]
}

fn same(a: &[Hit], b: &[Hit]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| bits(a) == bits(b))
}

/// Panics with all that is needed to repeat the case if the structure differs from brute force.
fn check(name: &str, structure: &dyn Accel, mesh: &Mesh, seed: u64, i: usize, ray: &Ray, truth: &[Hit]) {
    let mut all = vec![Hit { t: 0.0, u: 0.0, v: 0.0, prim: 0 }];
    structure.all_hits(ray, &mut all);
    let closest = structure.intersect(ray);
    let place = || format!("{name} on {}, seed {seed}, ray {i}: {ray:?}", mesh.name);
    assert!(same(&all, truth), "{}\nall hits {all:?}\nshould be {truth:?}", place());
    assert!(same(closest.as_slice(), &truth[..truth.len().min(1)]), "{}\n{closest:?}\nshould be first of {truth:?}", place());
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
        for (name, build) in STRUCTURES {
            let structure = build(mesh.triangles());
            for (i, (ray, truth)) in rays.iter().zip(&truth).enumerate() {
                check(name, &*structure, mesh, seed, i, ray, truth);
            }
        }
    }
}
