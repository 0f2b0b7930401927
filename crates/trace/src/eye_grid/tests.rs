//! The eye grid against brute force, at every level and in every arrangement.

use glam::{DVec3, Vec3};

use super::*;
use crate::kernel::SimdLevel;

/// Deterministic numbers in [-1, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 40) as f32) / (1u64 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

#[derive(Default)]
struct Mesh {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    indices: Vec<[u32; 3]>,
}

impl Mesh {
    fn vertex(&mut self, p: Vec3) -> u32 {
        self.x.push(p.x);
        self.y.push(p.y);
        self.z.push(p.z);
        self.x.len() as u32 - 1
    }

    fn triangle(&mut self, corners: [Vec3; 3]) {
        let indices = corners.map(|p| self.vertex(p));
        self.indices.push(indices);
    }

    fn triangles(&self) -> Triangles<'_> {
        Triangles::new(&self.x, &self.y, &self.z, &self.indices)
    }

    fn soup(seed: u64, count: usize, size: f32, spread: f32) -> Self {
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
    fn blob(rings: u32) -> Self {
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
    fn awkward() -> Self {
        let mut mesh = Self::soup(5, 40, 0.5, 1.0);
        let quad = [Vec3::new(-0.5, -0.5, 0.1), Vec3::new(0.5, -0.5, 0.1), Vec3::new(0.5, 0.5, 0.1)];
        for i in 0..6 {
            mesh.triangle(quad.map(|p| p + Vec3::new(0.03 * i as f32, 0.0, 0.0)));
            mesh.triangle(quad);
        }
        for i in 0..20 {
            let y = i as f32 * 0.05 - 0.5;
            mesh.triangle([Vec3::new(-3.0, y, 0.4), Vec3::new(3.0, y, 0.2), Vec3::new(3.0, y + 1e-6, 0.2)]);
        }
        let far = 1e5;
        mesh.triangle([Vec3::new(-far, -0.8, -far), Vec3::new(far, -0.8, -far), Vec3::new(0.0, -0.8, far)]);
        mesh.triangle([Vec3::ZERO; 3]);
        mesh.triangle([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]);
        mesh.triangle([Vec3::NAN, Vec3::X, Vec3::Y]);
        mesh.triangle([Vec3::new(f32::INFINITY, 0.0, 0.0), Vec3::X, Vec3::Y]);
        mesh
    }

    fn scaled(mut self, scale: f32, offset: Vec3) -> Self {
        for (values, offset) in [(&mut self.x, offset.x), (&mut self.y, offset.y), (&mut self.z, offset.z)] {
            values.iter_mut().for_each(|v| *v = *v * scale + offset);
        }
        self
    }
}

fn axes(forward: DVec3) -> [DVec3; 3] {
    let forward = forward.normalize();
    let right = forward.cross(DVec3::new(0.1, 1.0, 0.05)).normalize();
    [right, right.cross(forward), forward]
}

fn looking(from: Vec3, at: Vec3, tan: f64, size: [u32; 2]) -> View {
    let aspect = f64::from(size[0]) / f64::from(size[1]);
    View::perspective(from, axes((at - from).as_dvec3()), [tan * aspect, tan], size)
}

/// Closest triangle by testing all.
fn brute(triangles: &Triangles, ray: &ViewRay) -> Option<u32> {
    let hits = (0..triangles.len() as u32).filter_map(|prim| {
        let corners = triangles.corners(prim);
        let finite = corners.iter().all(|c| c.is_finite());
        let hit = finite.then(|| exact::hit(ray.origin, ray.dir, corners)).flatten()?;
        (hit.t > 0.0).then_some((hit.t, prim))
    });
    hits.reduce(|a, b| if b.0 < a.0 { b } else { a }).map(|(_, prim)| prim)
}

fn check(name: &str, mesh: &Mesh, view: View, options: EyeGridOptions) -> (usize, usize) {
    let triangles = mesh.triangles();
    let mut expected = Vec::new();
    for y in 0..view.height {
        for x in 0..view.width {
            expected.push(brute(&triangles, &view.pixel_ray(x, y)));
        }
    }
    let mut exact_pixels = 0;
    for level in SimdLevel::available() {
        let grid = EyeGrid::build(view, triangles, options, level);
        let mut hits = TileHits::default();
        for index in 0..grid.tile_count() {
            let tile = grid.tile(index);
            grid.trace_tile(&tile, &mut hits);
            exact_pixels += hits.exact_pixels;
            for y in 0..tile.height {
                for x in 0..tile.width {
                    let (px, py) = (tile.x + x, tile.y + y);
                    let want = expected[(py * view.width + px) as usize];
                    let got = hits.prim(x, y);
                    assert_eq!(got, want, "{name}, {}, {options:?}, pixel {px} {py}", level.name());
                }
            }
        }
    }
    let levels = SimdLevel::available().len();
    (expected.iter().flatten().count(), exact_pixels / levels)
}

fn check_both(name: &str, mesh: &Mesh, view: View) {
    let (covered, exact) = check(name, mesh, view, EyeGridOptions::default());
    println!("{name}: {covered} pixels covered, {exact} decided exactly");
    check(name, mesh, view, EyeGridOptions { tile: 20, binning: Binning::Rectangle });
}

#[test]
fn equals_brute_force_from_outside_inside_and_within() {
    let size = [97, 61];
    let soup = Mesh::soup(1, 300, 0.3, 1.0);
    check_both("soup outside", &soup, looking(Vec3::new(2.0, 1.0, 3.0), Vec3::ZERO, 0.5, size));
    check_both("soup inside", &soup, looking(Vec3::new(0.1, 0.1, 0.1), Vec3::X, 1.0, size));
    let blob = Mesh::blob(24);
    check_both("blob outside", &blob, looking(Vec3::new(0.5, 1.5, 3.0), Vec3::ZERO, 0.5, size));
    check_both("blob inside", &blob, looking(Vec3::new(0.05, 0.0, 0.1), Vec3::NEG_X, 2.0, size));
    let fine = Mesh::blob(60);
    check_both("tiny triangles", &fine, looking(Vec3::new(0.5, 1.5, 9.0), Vec3::ZERO, 0.5, size));
}

#[test]
fn equals_brute_force_on_awkward_triangles() {
    let mesh = Mesh::awkward();
    let size = [64, 64];
    check_both("awkward", &mesh, looking(Vec3::new(0.3, 0.2, 2.5), Vec3::ZERO, 0.4, size));
    check_both("awkward, low", &mesh, looking(Vec3::new(0.0, -0.79999, 2.5), Vec3::new(0.0, -0.7, 0.0), 0.7, size));
    check_both("on a plane", &mesh, looking(Vec3::new(0.3, -0.8, 2.5), Vec3::new(0.3, -0.8, 0.0), 0.7, size));
    // Rays along lattice directions of a lattice mesh pass exactly through vertices and edges.
    let mut lattice = Mesh::default();
    for i in 0..16 {
        for j in 0..16 {
            let p = |di: i32, dj: i32| Vec3::new((i + di - 8) as f32, (j + dj - 8) as f32, 0.0);
            lattice.triangle([p(0, 0), p(1, 0), p(1, 1)]);
            lattice.triangle([p(0, 0), p(1, 1), p(0, 1)]);
        }
    }
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
    let head_on = View::perspective(Vec3::new(0.0, 0.0, 8.0), axes, [1.0, 1.0], [63, 63]);
    check_both("lattice", &lattice, head_on);
    let parallel = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.0, 8.0], 40.0, [64, 64]);
    check_both("lattice, parallel", &lattice, parallel);
    let through_vertices = View::parallel(Vec3::new(0.0, 0.0, 8.0), axes, [8.5, 8.5], 40.0, [17, 17]);
    check_both("lattice, parallel, vertices", &lattice, through_vertices);
}

#[test]
fn equals_brute_force_at_any_scale_and_offset() {
    for scale in [1e-3, 1.0, 1e3, 1e6] {
        for offset in [0.0, 1e3, 1e6] {
            let offset = Vec3::new(offset, -offset, offset * 0.5);
            let mesh = Mesh::blob(12).scaled(scale, offset);
            let from = Vec3::new(0.5, 1.5, 3.0) * scale + offset;
            if from == offset {
                continue;
            }
            let name = format!("scale {scale}, offset {offset}");
            check_both(&name, &mesh, looking(from, offset, 0.5, [48, 40]));
        }
    }
}

#[test]
fn equals_brute_force_in_parallel_views() {
    let soup = Mesh::soup(2, 300, 0.3, 1.0);
    for direction in [DVec3::new(1.0, -2.0, 0.5), DVec3::NEG_Z] {
        let axes = axes(direction);
        let view = View::parallel((direction.normalize() * -4.0).as_vec3(), axes, [1.5, 1.2], 40.0, [80, 64]);
        check_both("parallel", &soup, view);
        let within = View::parallel(Vec3::ZERO, axes, [1.5, 1.2], 40.0, [80, 64]);
        check_both("parallel, from within", &soup, within);
    }
}

#[test]
fn empty_input_gives_empty_tiles() {
    check_both("empty", &Mesh::default(), looking(Vec3::Z, Vec3::ZERO, 0.5, [20, 20]));
}
