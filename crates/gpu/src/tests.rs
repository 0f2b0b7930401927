//! An adapter, meshes and rays for tests. Without an adapter tests say so and pass; with CI=true they fail.

use glam::Vec3;
use rayward_trace::{Ray, Triangles};

use crate::{Error, Gpu};

pub(crate) fn gpu() -> Option<Gpu> {
    match Gpu::open(None) {
        Ok(gpu) => Some(gpu),
        Err(problem @ Error::NoAdapter { .. }) if std::env::var("CI").as_deref() != Ok("true") => {
            eprintln!("SKIPPED: {problem}");
            None
        }
        Err(problem) => panic!("{problem}"),
    }
}

/// Deterministic numbers in [-1, 1).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 40) as f32) / (1u64 << 23) as f32 - 1.0
    }

    pub(crate) fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

#[derive(Default)]
pub(crate) struct Mesh {
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
    pub(crate) indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub(crate) fn vertex(&mut self, p: Vec3) -> u32 {
        self.x.push(p.x);
        self.y.push(p.y);
        self.z.push(p.z);
        self.x.len() as u32 - 1
    }

    pub(crate) fn triangle(&mut self, corners: [Vec3; 3]) {
        let indices = corners.map(|p| self.vertex(p));
        self.indices.push(indices);
    }

    pub(crate) fn triangles(&self) -> Triangles<'_> {
        Triangles::new(&self.x, &self.y, &self.z, &self.indices)
    }

    pub(crate) fn soup(seed: u64, count: usize, size: f32) -> Self {
        let mut numbers = Numbers(seed);
        let mut mesh = Self::default();
        for _ in 0..count {
            let center = numbers.point();
            mesh.triangle([(); 3].map(|()| center + numbers.point() * size));
        }
        mesh
    }

    /// A lumpy sphere.
    pub(crate) fn lump(rings: u32) -> Self {
        let mut mesh = Self::default();
        let at = |i: u32, j: u32| {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * (j % (2 * rings)) as f32 / (2 * rings) as f32,
            );
            let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            d * (1.0 + 0.3 * (5.0 * d.x).sin() * (4.0 * d.y).cos())
        };
        for (i, j) in (0..rings).flat_map(|i| (0..2 * rings).map(move |j| (i, j))) {
            mesh.triangle([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            mesh.triangle([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        mesh
    }

    /// What is hard: slivers, huge and tiny triangles, the same ones twice, coplanar overlaps, a grid seen along its
    /// planes, triangles that are broken, all of it a little off.
    pub(crate) fn awkward() -> Self {
        let mut mesh = Self::soup(5, 40, 0.2);
        let mut numbers = Numbers(17);
        for _ in 0..40 {
            let (from, along) = (numbers.point(), numbers.point());
            let thin = numbers.point() * 10f32.powf(-3.5 + 2.5 * numbers.next());
            mesh.triangle([from, from + along, from + along * 0.5 + thin]);
        }
        for _ in 0..40 {
            let center = numbers.point();
            mesh.triangle([(); 3].map(|()| center + numbers.point() * 1e-3));
        }
        for i in 0..8 {
            let z = i as f32 * 0.25 - 1.0;
            let [a, b, c] = [
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(1.0, -1.0, z),
                Vec3::new(0.0, 1.0, z),
            ];
            mesh.triangle([a, b, c]);
            if i % 2 == 0 {
                mesh.triangle([a * 0.5, b * 0.5, c * 0.5].map(|p| Vec3::new(p.x, p.y, z)));
                mesh.triangle([b, c, a]);
            }
        }
        mesh.triangle([
            Vec3::splat(-1.3),
            Vec3::new(1.3, -1.2, -1.3),
            Vec3::new(0.1, 0.2, 1.4),
        ]);
        mesh.triangle([Vec3::ZERO, Vec3::ONE, Vec3::ONE]);
        mesh.triangle([Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 0.0), Vec3::X]);
        for i in 0..mesh.x.len() {
            mesh.x[i] += 0.1;
        }
        mesh
    }
}

pub(crate) fn meshes() -> [Mesh; 3] {
    [Mesh::soup(1, 300, 0.3), Mesh::lump(24), Mesh::awkward()]
}

pub(crate) fn rays(seed: u64, count: usize) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|i| {
            let (from, mut dir) = (numbers.point() * 1.5, numbers.point());
            match i % 9 {
                0 => dir = Vec3::AXES[i / 9 % 3] * dir.x.signum(),
                1 | 2 => dir[i / 9 % 3] = 0.0,
                _ => {}
            }
            Ray::new(from, dir)
        })
        .collect()
}
