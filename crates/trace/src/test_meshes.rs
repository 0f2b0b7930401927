//! Meshes and views for the tests of this crate.

use glam::{DVec3, Vec3};

use crate::Triangles;
use crate::view::View;

/// Deterministic numbers in [-1, 1).
pub(crate) struct Numbers(pub(crate) u64);

impl Numbers {
    /// All 64 bits of the next one; the upper ones are the better ones.
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        self.0
    }

    pub(crate) fn next(&mut self) -> f32 {
        ((self.bits() >> 40) as f32) / (1u64 << 23) as f32 - 1.0
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

    pub(crate) fn soup(seed: u64, count: usize, size: f32, spread: f32) -> Self {
        let mut numbers = Numbers(seed);
        let mut mesh = Self::default();
        for _ in 0..count {
            let center = numbers.point() * spread;
            let corners = [(); 3].map(|()| center + numbers.point() * size);
            mesh.triangle(corners);
        }
        mesh
    }

    /// A bumpy closed surface around the origin.
    pub(crate) fn blob(rings: u32) -> Self {
        let mut mesh = Self::default();
        let sectors = rings * 2;
        for i in 0..=rings {
            for j in 0..sectors {
                let (theta, phi) = (
                    std::f32::consts::PI * i as f32 / rings as f32,
                    std::f32::consts::TAU * j as f32 / sectors as f32,
                );
                let radius = 1.0 + 0.15 * (5.0 * theta).sin() * (4.0 * phi).cos();
                let ring = theta.sin();
                mesh.vertex(Vec3::new(ring * phi.cos(), theta.cos(), ring * phi.sin()) * radius);
            }
        }
        for i in 0..rings {
            for j in 0..sectors {
                let at = |di: u32, dj: u32| (i + di) * sectors + (j + dj) % sectors;
                mesh.indices.push([at(0, 0), at(0, 1), at(1, 0)]);
                mesh.indices.push([at(1, 0), at(0, 1), at(1, 1)]);
            }
        }
        mesh
    }

    /// Coplanar overlaps, duplicates, slivers, a huge ground, and triangles that are left out.
    pub(crate) fn awkward() -> Self {
        let mut mesh = Self::soup(5, 40, 0.5, 1.0);
        let quad = [
            Vec3::new(-0.5, -0.5, 0.1),
            Vec3::new(0.5, -0.5, 0.1),
            Vec3::new(0.5, 0.5, 0.1),
        ];
        for i in 0..6 {
            mesh.triangle(quad.map(|p| p + Vec3::new(0.03 * i as f32, 0.0, 0.0)));
            mesh.triangle(quad);
        }
        for i in 0..20 {
            let y = i as f32 * 0.05 - 0.5;
            mesh.triangle([
                Vec3::new(-3.0, y, 0.4),
                Vec3::new(3.0, y, 0.2),
                Vec3::new(3.0, y + 1e-6, 0.2),
            ]);
        }
        let far = 1e5;
        mesh.triangle([
            Vec3::new(-far, -0.8, -far),
            Vec3::new(far, -0.8, -far),
            Vec3::new(0.0, -0.8, far),
        ]);
        mesh.triangle([Vec3::ZERO; 3]);
        mesh.triangle([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]);
        mesh.triangle([Vec3::NAN, Vec3::X, Vec3::Y]);
        mesh.triangle([Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::X, Vec3::Y]);
        mesh
    }

    pub(crate) fn scaled(mut self, scale: f32, offset: Vec3) -> Self {
        for (values, offset) in [
            (&mut self.x, offset.x),
            (&mut self.y, offset.y),
            (&mut self.z, offset.z),
        ] {
            values.iter_mut().for_each(|v| *v = *v * scale + offset);
        }
        self
    }
}

pub(crate) fn axes(forward: DVec3) -> [DVec3; 3] {
    let forward = forward.normalize();
    let right = forward.cross(DVec3::new(0.1, 1.0, 0.05)).normalize();
    [right, right.cross(forward), forward]
}

pub(crate) fn looking(from: Vec3, at: Vec3, tan: f64, size: [u32; 2]) -> View {
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    View::perspective(from, axes((at - from).as_dvec3()), [tan * aspect, tan], size)
}
