//! Build and traversal of the structures on a blob of 69k triangles.
//!
//! `cargo bench -p rayward-trace --bench structures`; as a test each runs once.

#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::LazyLock;

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::Vec3;
use rayward_trace::{Accel, Bvh, Counters, Hit, Light, Ray, Receiver, Topology};
use support::Random;
use support::meshes::{self, Mesh};

/// 81,920 triangles, of which a fifth is cut away to make 69k.
static BLOB: LazyLock<Mesh> = LazyLock::new(|| {
    let mut mesh = meshes::blob(6);
    mesh.indices.truncate(69_000);
    mesh
});

/// Edge of the square of eye rays.
const SIDE: usize = 64;

fn main() {
    let bvh = Bvh::build(BLOB.triangles());
    for (name, rays) in [("eye", eye_rays()), ("random", random_rays())] {
        let mut work = Counters::default();
        let hits = rays
            .iter()
            .filter(|ray| bvh.closest(ray, &mut work).is_some())
            .count();
        let per_ray = |n: u64| n as f64 / rays.len() as f64;
        println!(
            "{name}: {} rays, {hits} hits, {:.1} nodes and {:.1} triangles a ray",
            rays.len(),
            per_ray(work.nodes),
            per_ray(work.triangles)
        );
    }
    divan::main();
}

fn eye_rays() -> Vec<Ray> {
    let at = |i: usize| (i as f32 + 0.5) / SIDE as f32 * 2.4 - 1.2;
    let eye = Vec3::new(0.0, 0.0, 4.0);
    (0..SIDE * SIDE)
        .map(|i| Ray::new(eye, Vec3::new(at(i % SIDE), at(i / SIDE), 0.0) - eye))
        .collect()
}

fn random_rays() -> Vec<Ray> {
    let mut random = Random::new(1);
    (0..SIDE * SIDE)
        .map(|_| Ray::new(random.in_cube(), random.direction()))
        .collect()
}

#[divan::bench]
fn bvh_build(bencher: Bencher) {
    let triangles = BLOB.triangles();
    bencher
        .counter(ItemsCount::new(triangles.len()))
        .bench(|| Bvh::build(triangles));
}

#[divan::bench]
fn topology(bencher: Bencher) {
    let triangles = BLOB.triangles();
    bencher
        .counter(ItemsCount::new(triangles.len()))
        .bench(|| Topology::analyse(&triangles));
}

fn closest(bencher: Bencher, rays: &[Ray]) {
    let bvh = Bvh::build(BLOB.triangles());
    bencher.counter(ItemsCount::new(rays.len())).bench(|| {
        rays.iter()
            .filter_map(|ray| bvh.intersect(ray))
            .map(|hit: Hit| hit.t)
            .sum::<f32>()
    });
}

#[divan::bench]
fn bvh_eye(bencher: Bencher) {
    closest(bencher, &eye_rays());
}

#[divan::bench]
fn bvh_random(bencher: Bencher) {
    closest(bencher, &random_rays());
}

#[divan::bench]
fn bvh_shadow(bencher: Bencher) {
    let bvh = Bvh::build(BLOB.triangles());
    let receivers: Vec<Receiver> = eye_rays()
        .iter()
        .filter_map(|ray| {
            bvh.closest(ray, &mut ())
                .map(|(prim, hit)| Receiver::on_surface(ray, hit.t, prim))
        })
        .collect();
    let light = Light::Point(Vec3::new(3.0, 4.0, 2.0));
    bencher.counter(ItemsCount::new(receivers.len())).bench(|| {
        receivers
            .iter()
            .filter(|receiver| bvh.shadowed(receiver, &light))
            .count()
    });
}
