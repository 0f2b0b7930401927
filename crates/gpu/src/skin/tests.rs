//! Vertices posed on the device beside those of `Scene::at`, and cubes of them beside brute force.

use glam::{DMat4, DVec3, Vec3};
use rayward::scene::{MorphTarget, Scene, Transform, builtin};
use rayward_trace::ldc::{Coverage, CubeFrame, DepthFormat, Hierarchy, LdcBuild};
use rayward_trace::{Accel, BruteForce, Bvh, Ray, Triangles};

use super::GpuSkin;
use crate::bvh::tests::Silent;
use crate::tests::{Numbers, gpu};
use crate::{Cube, CubeOptions, PosedVertices, StillCube};

const OPTIONS: CubeOptions = CubeOptions {
    resolution: 96,
    build: LdcBuild::Csr(Coverage::Conservative),
    depth: DepthFormat::F32,
    hierarchy: Hierarchy::Pyramid,
    max_samples: 1 << 26,
};

fn scene(name: &str) -> Scene {
    builtin::build(name).expect("a built-in scene")
}

/// The walker, and all of its meshes blown up a little.
fn morphed() -> Scene {
    let mut scene = scene("walker");
    for mesh in &mut scene.meshes {
        mesh.weights = vec![0.3];
        for primitive in &mut mesh.primitives {
            let moved = primitive.positions.iter().map(|p| *p * 0.1 + Vec3::splat(0.01));
            primitive.morph_targets = vec![MorphTarget {
                positions: moved.collect(),
                ..MorphTarget::default()
            }];
        }
    }
    scene
}

/// The walker somewhere else.
fn moved(by: DVec3) -> Scene {
    let mut scene = scene("walker");
    for node in scene.nodes.iter_mut().filter(|node| node.parent.is_none()) {
        let matrix = DMat4::from_translation(by) * node.transform.matrix();
        node.transform = Transform::Matrix(matrix);
    }
    scene
}

/// The sum of the magnitudes of what is added up for each vertex's coordinates.
fn magnitudes(scene: &Scene, time: f32) -> Vec<DVec3> {
    let motions = scene.motions(Some(0), time);
    let all = motions.iter().flat_map(|motion| {
        (0..motion.primitive.positions.len()).map(move |v| {
            let local = motion.local(v).abs();
            let of = |(joint, share): (usize, f64)| {
                let m = motion.matrices[joint];
                let [x, y, z, w] = [m.x_axis, m.y_axis, m.z_axis, m.w_axis].map(|c| c.truncate().abs());
                (x * local.x + y * local.y + z * local.z + w) * share
            };
            motion.influences(v).into_iter().map(of).sum()
        })
    });
    all.collect()
}

#[test]
fn vertices_are_those_of_the_scene_within_the_stated_error() {
    let Some(gpu) = gpu() else { return };
    let far = moved(DVec3::new(2e5, 0.0, -3e5));
    for (name, scene) in [
        ("walker", scene("walker")),
        ("courtyard", scene("courtyard")),
        ("morphed", morphed()),
        ("far", far),
    ] {
        let skin = GpuSkin::new(&gpu, &scene).unwrap_or_else(|e| panic!("{e}"));
        let rest = scene.at(0.0);
        for time in [0.0, 0.3, 0.71] {
            let frame = scene.at(time);
            let posed = skin.pose(Some(0), time).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(posed.positions[0].len(), frame.x.len());
            assert_eq!(skin.vertices(), frame.x.len());
            let mut moving = 0;
            for (v, magnitude) in magnitudes(&scene, time).into_iter().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|axis| posed.positions[axis][v]);
                let expected = frame.position(v as u32);
                // And the rounding of the scene's own, which is to f64 in the world and to f32 here.
                let world = frame.origin.abs().max_element() * 2f64.powi(-50);
                let allowed = magnitude * (13.0 / f64::from(1 << 24)) + world;
                let off = (Vec3::new(x, y, z).as_dvec3() - expected.as_dvec3()).abs();
                assert!(
                    off.cmple(allowed).all(),
                    "{name} at {time}, vertex {v}: {off} {allowed}"
                );
                moving += usize::from(expected.distance(rest.position(v as u32)) > 0.01);
            }
            assert!(time == 0.0 || moving > 100, "{name} at {time}: {moving} move");
        }
    }
}

/// Rays about what stands at the middle of the scene.
fn rays(seed: u64, around: Vec3, size: f32, count: usize) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    let ray = |i| {
        let (from, mut dir) = (around + numbers.point() * size, numbers.point());
        if i % 5 == 0 {
            dir[i / 5 % 3] = 0.0;
        }
        Ray::new(from, dir)
    };
    (0..count).map(ray).collect()
}

/// Asks a cube of posed vertices for rays, of itself alone and together with the CPU.
fn assert_exact(cube: &Cube, triangles: Triangles, rays: &[Ray]) {
    let (brute, bvh) = (BruteForce::new(triangles), Bvh::build(triangles));
    let truth: Vec<_> = rays.iter().map(|ray| brute.intersect(ray)).collect();
    let (hits, stats) = cube.closest(rays, &bvh).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(hits, truth);
    let (sure, _) = cube.closest(rays, &Silent).unwrap_or_else(|e| panic!("{e}"));
    let unsure = sure.iter().zip(&truth).filter(|(hit, truth)| hit != truth);
    assert!(unsure.clone().all(|(hit, _)| hit.is_none()));
    assert!(
        unsure.count() <= stats.unsure && stats.unsure < rays.len() / 20,
        "{stats:?}"
    );
    assert!(truth.iter().flatten().count() > rays.len() / 10);
}

#[test]
fn cubes_of_posed_vertices_are_exact_and_what_stands_still_is_kept() {
    let Some(gpu) = gpu() else { return };
    for (scene, count) in [
        (scene("walker"), 1500),
        (morphed(), 500),
        (scene("courtyard"), 300),
    ] {
        let skin = GpuSkin::new(&gpu, &scene).unwrap_or_else(|e| panic!("{e}"));
        let mut still = StillCube::default();
        for (n, time) in [0.0, 0.2, 0.45].into_iter().enumerate() {
            let indices = scene.at(time).indices;
            let posed = skin.pose(Some(0), time).unwrap_or_else(|e| panic!("{e}"));
            let rays = rays(n as u64, Vec3::new(0.0, 0.9, 0.0), 1.2, count);
            let whole = Cube::build_posed(&posed, &indices, &OPTIONS).unwrap_or_else(|e| panic!("{e}"));
            assert_exact(&whole, posed.triangles(&indices), &rays);
            let built = still.build_posed(&posed, &indices, &OPTIONS);
            let built = built.unwrap_or_else(|e| panic!("{e}"));
            assert_exact(&built, posed.triangles(&indices), &rays);
            // All of the walker's ground is too few triangles for a cube of its own.
            let kept = scene.name == "courtyard" && n == 2;
            assert_eq!(
                built.rebuilt() < built.stats().triangles / 2,
                kept,
                "{} {n}",
                scene.name
            );
        }
    }
}

#[test]
fn texel_coordinates_are_known_to_three_units_of_the_last_place() {
    let Some(gpu) = gpu() else { return };
    // As far from zero as frames leave a scene of this size.
    for by in [DVec3::ZERO, DVec3::new(100.0, -3.0, 50.0)] {
        let scene = moved(by);
        let skin = GpuSkin::new(&gpu, &scene).unwrap_or_else(|e| panic!("{e}"));
        let posed = skin.pose(Some(0), 0.4).unwrap_or_else(|e| panic!("{e}"));
        let indices = scene.at(0.4).indices;
        let prims: Vec<u32> = (0..indices.len() as u32).collect();
        let triangles = posed.triangles(&indices);
        let around = CubeFrame::around(&triangles, &prims, 512);
        let frame = PosedVertices::frame(&around).expect("f32 is fine enough");
        assert!((frame.corner - around.corner).abs().max_element() < around.side / 100.0);
        let texels = posed.texels(&frame).unwrap_or_else(|e| panic!("{e}"));
        let texels: Vec<[f32; 3]> = gpu
            .read(&texels, 0, skin.vertices() as u64)
            .unwrap_or_else(|e| panic!("{e}"));
        for (v, texel) in texels.into_iter().enumerate() {
            let expected = frame.texel(triangles.vertex(v as u32).as_dvec3());
            let off = (Vec3::from_array(texel).as_dvec3() - expected).abs();
            let allowed = expected.abs() * (3.01 / f64::from(1 << 24));
            assert!(off.cmple(allowed).all(), "{by} {v}: {texel:?} {expected}");
        }
    }
    let far = CubeFrame {
        corner: DVec3::new(1e6 + 0.03, 0.0, 0.0),
        side: 0.1,
        size: [512; 3],
    };
    assert_eq!(PosedVertices::frame(&far), None);
}
