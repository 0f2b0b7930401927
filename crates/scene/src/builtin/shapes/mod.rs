//! Shape helpers of the built-in scenes: welded triangle surfaces and the few ways to make them.
//!
//! Every maker returns a closed 2-manifold with outward faces unless it says otherwise, so that solids may be
//! joined by plain interpenetration and each part stays closed. Units: metres.

mod cuboid;
mod geosphere;
mod loft;

pub(super) use cuboid::{cuboid, rounded_cuboid};
pub(super) use geosphere::geosphere;
pub(super) use loft::{Ends, arc, bezier, disc_loop, lathe, loft, plank, ribbon, rings, smooth_path, tube};

use glam::{Affine3A, Vec3};

use crate::Primitive;

/// An indexed surface in which every position occurs once: neighbours share vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Surface {
    /// Vertex positions.
    pub(super) positions: Vec<Vec3>,
    /// Counter-clockwise corner indices.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Adds another surface as a part of its own; nothing is welded.
    pub(super) fn join(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(&other.positions);
        self.triangles
            .extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    }

    /// All parts as one surface.
    pub(super) fn joined(parts: impl IntoIterator<Item = Self>) -> Self {
        let mut whole = Self::default();
        for part in parts {
            whole.join(&part);
        }
        whole
    }

    /// Moved by an affine map; mirrors keep their faces outward.
    pub(super) fn moved(mut self, by: Affine3A) -> Self {
        for p in &mut self.positions {
            *p = by.transform_point3(*p);
        }
        if by.matrix3.determinant() < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
        self
    }

    /// Moved by an offset.
    pub(super) fn at(self, offset: Vec3) -> Self {
        self.moved(Affine3A::from_translation(offset))
    }

    /// Every position replaced by its image under `map`, which should be smooth and keep orientation.
    pub(super) fn warped(mut self, map: impl Fn(Vec3) -> Vec3) -> Self {
        for p in &mut self.positions {
            *p = map(*p);
        }
        self
    }

    /// The surface as a primitive with shading normals: faces that meet at less than `crease` degrees are
    /// shaded as one smooth surface, others get a sharp edge (their vertices are split).
    pub(super) fn into_primitive(self, crease: f32, material: usize) -> Primitive {
        let areas: Vec<Vec3> = self.triangles.iter().map(|&t| self.area_normal(t)).collect();
        let units: Vec<Vec3> = areas.iter().map(|n| n.normalize_or_zero()).collect();
        let (starts, faces) = self.faces_of_vertices();
        let limit = crease.to_radians().cos();
        let mut primitive = Primitive {
            triangles: self.triangles.clone(),
            material,
            ..Primitive::default()
        };
        for (v, &position) in self.positions.iter().enumerate() {
            let around = &faces[starts[v] as usize..starts[v + 1] as usize];
            let first = primitive.positions.len();
            for &f in around {
                let own = units[f as usize];
                let alike = around.iter().filter(|&&g| units[g as usize].dot(own) >= limit);
                let normal = alike.map(|&g| areas[g as usize]).sum::<Vec3>().normalize_or(own);
                // Equal sets of faces sum in the same order, so equal normals are equal in bits.
                let known = primitive.normals[first..].iter().position(|&n| n == normal);
                let index = first + known.unwrap_or(primitive.normals.len() - first);
                if known.is_none() {
                    primitive.positions.push(position);
                    primitive.normals.push(normal);
                }
                let f = f as usize;
                for (new, &old) in primitive.triangles[f].iter_mut().zip(&self.triangles[f]) {
                    if old as usize == v {
                        *new = index as u32;
                    }
                }
            }
        }
        primitive
    }

    /// The surface as a primitive that is shaded smoothly all over; its vertices stay shared.
    pub(super) fn into_smooth_primitive(self, material: usize) -> Primitive {
        let mut normals = vec![Vec3::ZERO; self.positions.len()];
        for &t in &self.triangles {
            let area = self.area_normal(t);
            for i in t {
                normals[i as usize] += area;
            }
        }
        let normals = normals.into_iter().map(Vec3::normalize_or_zero).collect();
        let Self { positions, triangles } = self;
        Primitive {
            positions,
            normals,
            triangles,
            material,
            ..Primitive::default()
        }
    }

    /// Face normal times twice the area.
    fn area_normal(&self, [a, b, c]: [u32; 3]) -> Vec3 {
        let [a, b, c] = [a, b, c].map(|i| self.positions[i as usize]);
        (b - a).cross(c - a)
    }

    /// For each vertex the faces around it: `faces[starts[v]..starts[v + 1]]`, in face order.
    fn faces_of_vertices(&self) -> (Vec<u32>, Vec<u32>) {
        let mut starts = vec![0u32; self.positions.len() + 1];
        for &i in self.triangles.iter().flatten() {
            starts[i as usize + 1] += 1;
        }
        for v in 0..self.positions.len() {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut faces = vec![0u32; self.triangles.len() * 3];
        for (f, t) in self.triangles.iter().enumerate() {
            for &i in t {
                faces[next[i as usize] as usize] = f as u32;
                next[i as usize] += 1;
            }
        }
        (starts, faces)
    }
}
