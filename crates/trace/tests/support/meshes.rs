//! Meshes.

use std::collections::HashMap;

use glam::Vec3;
use rayward_trace::Triangles;

use super::Random;

#[derive(Clone, Debug)]
pub struct Mesh {
    pub name: String,
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
    pub indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn new(name: &str, positions: &[Vec3], indices: Vec<[u32; 3]>) -> Self {
        Self {
            name: name.into(),
            x: positions.iter().map(|p| p.x).collect(),
            y: positions.iter().map(|p| p.y).collect(),
            z: positions.iter().map(|p| p.z).collect(),
            indices,
        }
    }

    pub fn triangles(&self) -> Triangles<'_> {
        Triangles::new(&self.x, &self.y, &self.z, &self.indices)
    }

    pub fn positions(&self) -> Vec<Vec3> {
        (0..self.x.len())
            .map(|i| Vec3::new(self.x[i], self.y[i], self.z[i]))
            .collect()
    }

    pub fn map(&self, name: &str, f: impl Fn(Vec3) -> Vec3) -> Self {
        let positions: Vec<Vec3> = self.positions().into_iter().map(f).collect();
        Self::new(&format!("{} {name}", self.name), &positions, self.indices.clone())
    }

    /// Scaled about the origin, then moved.
    pub fn placed(&self, scale: f32, offset: Vec3) -> Self {
        self.map(&format!("x {scale:e} at {offset}"), |p| p * scale + offset)
    }

    /// Both meshes in one.
    pub fn and(mut self, other: &Self) -> Self {
        let base = self.x.len() as u32;
        self.name = format!("{} and {}", self.name, other.name);
        self.x.extend(&other.x);
        self.y.extend(&other.y);
        self.z.extend(&other.z);
        self.indices
            .extend(other.indices.iter().map(|t| t.map(|i| i + base)));
        self
    }
}

/// Unconnected triangles in the unit cube with edges up to `size`.
pub fn soup(seed: u64, count: usize, size: f32) -> Mesh {
    let mut random = Random::new(seed);
    let mut positions = Vec::new();
    for _ in 0..count {
        let centre = random.in_cube();
        positions.extend([0; 3].map(|_| centre + random.in_cube() * size));
    }
    let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(&format!("soup of {count} (seed {seed})"), &positions, indices)
}

/// A subdivided icosahedron around the origin with counter-clockwise outward faces; 20 * 4^level triangles.
pub fn icosphere(level: u32) -> Mesh {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let mut positions: Vec<Vec3> = [
        (-1., g, 0.),
        (1., g, 0.),
        (-1., -g, 0.),
        (1., -g, 0.),
        (0., -1., g),
        (0., 1., g),
        (0., -1., -g),
        (0., 1., -g),
        (g, 0., -1.),
        (g, 0., 1.),
        (-g, 0., -1.),
        (-g, 0., 1.),
    ]
    .map(|(x, y, z)| Vec3::new(x, y, z).normalize())
    .to_vec();
    let mut indices: Vec<[u32; 3]> = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    for _ in 0..level {
        let mut middles: HashMap<(u32, u32), u32> = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(((positions[a as usize] + positions[b as usize]) * 0.5).normalize());
                positions.len() as u32 - 1
            })
        };
        indices = indices
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh::new(&format!("icosphere {level}"), &positions, indices)
}

/// A closed, bumpy, not convex surface around the origin, star-shaped about it.
pub fn blob(level: u32) -> Mesh {
    let mut mesh = icosphere(level).map("bumpy", |p| {
        p * (1.0 + 0.25 * (5.0 * p.x).sin() * (4.0 * p.y).cos() + 0.1 * (17.0 * p.z + 3.0 * p.x).sin())
    });
    mesh.name = format!("blob {level}");
    mesh
}

/// Needles and near-degenerate triangles.
pub fn slivers(seed: u64, count: usize) -> Mesh {
    let mut random = Random::new(seed);
    let mut positions = Vec::new();
    for i in 0..count {
        let (a, b) = (random.in_cube(), random.in_cube());
        let width = 10f32.powi(-((i % 8) as i32));
        positions.extend([a, b, a.lerp(b, random.unit()) + random.in_cube() * width]);
    }
    let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(&format!("slivers (seed {seed})"), &positions, indices)
}

/// Fans of triangles around shared centres.
pub fn fans(seed: u64, fans: usize, blades: u32) -> Mesh {
    let mut random = Random::new(seed);
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for _ in 0..fans {
        let centre = positions.len() as u32;
        let (at, u, v) = (random.in_cube(), random.direction(), random.direction());
        positions.push(at);
        for k in 0..blades {
            let angle = k as f32 / blades as f32 * std::f32::consts::TAU;
            positions.push(at + u * angle.cos() + v * angle.sin());
            indices.push([centre, centre + 1 + k, centre + 1 + (k + 1) % blades]);
        }
    }
    Mesh::new(&format!("fans (seed {seed})"), &positions, indices)
}

/// The same few triangles many times over, some turned around, and others in the same planes.
pub fn duplicates(seed: u64, copies: usize) -> Mesh {
    let mut random = Random::new(seed);
    let mut positions: Vec<Vec3> = (0..12).map(|_| random.in_cube()).collect();
    // A grid in the plane z = 0.25 with triangles that overlap.
    positions
        .extend((0..16).map(|i| Vec3::new((i % 4) as f32 / 2.0 - 0.75, (i / 4) as f32 / 2.0 - 0.75, 0.25)));
    let mut indices = Vec::new();
    for i in 0..copies {
        let k = 3 * (i as u32 % 4);
        indices.push(if i % 3 == 0 {
            [k, k + 2, k + 1]
        } else {
            [k, k + 1, k + 2]
        });
        indices.push([0; 3].map(|_| 12 + random.below(16) as u32));
    }
    Mesh::new(&format!("duplicates (seed {seed})"), &positions, indices)
}

/// Two triangles of `size` as ground.
pub fn ground(size: f32) -> Mesh {
    let p = |x: f32, z: f32| Vec3::new(x, -1.0, z) * Vec3::new(size, 1.0, size);
    let corners = [p(-1., -1.), p(1., -1.), p(1., 1.), p(-1., 1.)];
    Mesh::new(
        &format!("ground of {size:e}"),
        &corners,
        vec![[0, 2, 1], [0, 3, 2]],
    )
}

/// A soup with corners that are NaN or infinite and with triangles without area.
pub fn broken(seed: u64) -> Mesh {
    let mut mesh = soup(seed, 300, 0.4);
    mesh.name = format!("broken soup (seed {seed})");
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let mut random = Random::new(seed);
    for i in (0..300).step_by(7) {
        // Mostly a single corner: the others still make finite edges.
        let corner = 3 * i + random.below(3);
        mesh.x[corner] = bad[random.below(3)];
        if i % 4 == 0 {
            mesh.y[3 * i + random.below(3)] = bad[random.below(3)];
        }
    }
    for i in (0..300).step_by(11) {
        let [a, b, _] = mesh.indices[i];
        mesh.indices[i] = if i % 2 == 0 { [a, b, b] } else { [a, a, a] };
    }
    mesh
}

/// One triangle.
pub fn single() -> Mesh {
    Mesh::new(
        "single",
        &[
            Vec3::new(-0.5, -0.5, 0.0),
            Vec3::new(0.5, -0.5, 0.0),
            Vec3::new(0.0, 0.5, 0.0),
        ],
        vec![[0, 1, 2]],
    )
}

/// Nothing.
pub fn empty() -> Mesh {
    Mesh::new("empty", &[], vec![])
}

/// A flat sheet of squares, all in one axis-aligned plane, with exactly equal spacing.
pub fn sheet(n: u32) -> Mesh {
    let positions: Vec<Vec3> = (0..(n + 1) * (n + 1))
        .map(|i| Vec3::new((i % (n + 1)) as f32, 2.0, (i / (n + 1)) as f32))
        .collect();
    let indices = (0..n * n)
        .flat_map(|i| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]
        })
        .collect();
    Mesh::new(&format!("sheet {n}"), &positions, indices)
}

/// Large triangles with small whole coordinates, so that rays can lie exactly in their planes or miss that by a
/// hair that f64 cannot resolve beside the other terms.
pub fn lattice(seed: u64, count: usize) -> Mesh {
    let mut random = Random::new(seed);
    let positions: Vec<Vec3> = (0..3 * count).map(|_| (random.in_cube() * 8.0).round()).collect();
    let indices = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh::new(&format!("lattice (seed {seed})"), &positions, indices)
}

/// Every mesh of the conformance table.
pub fn table() -> Vec<Mesh> {
    let mut meshes = vec![
        empty(),
        single(),
        soup(1, 10, 0.5),
        soup(2, 1000, 0.1),
        soup(3, 300, 1.5),
        icosphere(0),
        icosphere(2),
        icosphere(3),
        blob(3),
        slivers(4, 400),
        fans(5, 12, 40),
        duplicates(6, 150),
        sheet(12),
        lattice(10, 60),
        lattice(11, 600),
        ground(1e4).and(&icosphere(2).placed(1e-2, Vec3::new(0.3, -0.9, 0.2))),
        ground(1e6).and(&soup(7, 100, 0.2)),
        broken(8),
    ];
    for (scale, offset) in [
        (1e-3, Vec3::ZERO),
        (1e6, Vec3::ZERO),
        (1.0, Vec3::splat(1e3)),
        (1.0, Vec3::new(1e6, -1e6, 3e5)),
        (1e3, Vec3::new(-1e6, 0.0, 1e6)),
        (1e-3, Vec3::new(1.0, 20.0, -300.0)),
        (1e6, Vec3::splat(1e6)),
        (1e-20, Vec3::ZERO),
        (1e18, Vec3::ZERO),
        (1e-42, Vec3::ZERO),
        (1e38, Vec3::ZERO),
    ] {
        meshes.push(blob(2).placed(scale, offset));
        meshes.push(soup(9, 200, 0.3).placed(scale, offset));
    }
    meshes
}
