//! Borrowed triangles: positions as a structure of arrays and three corner indices each.

use glam::{DVec3, Vec3};

/// Indexed triangles. Every index must be smaller than the number of vertices.
///
/// A triangle takes part only if its corners are finite and it has area; see [`Triangles::is_degenerate`].
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// Vertex x.
    pub x: &'a [f32],
    /// Vertex y.
    pub y: &'a [f32],
    /// Vertex z.
    pub z: &'a [f32],
    /// Corners of each triangle; its position here is its id.
    pub indices: &'a [[u32; 3]],
}

impl<'a> Triangles<'a> {
    /// Triangles over these arrays.
    ///
    /// # Panics
    /// If the coordinate arrays differ in length or an index is out of range.
    pub fn new(x: &'a [f32], y: &'a [f32], z: &'a [f32], indices: &'a [[u32; 3]]) -> Self {
        assert!(
            x.len() == y.len() && y.len() == z.len(),
            "coordinate arrays differ in length"
        );
        let largest = indices.iter().flatten().copied().max();
        assert!(
            largest.is_none_or(|i| (i as usize) < x.len()),
            "triangle index out of range"
        );
        Self { x, y, z, indices }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// One vertex.
    #[inline]
    pub fn vertex(&self, i: u32) -> Vec3 {
        let i = i as usize;
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    /// The three corners of a triangle.
    #[inline]
    pub fn corners(&self, prim: u32) -> [Vec3; 3] {
        let [a, b, c] = self.indices[prim as usize];
        [self.vertex(a), self.vertex(b), self.vertex(c)]
    }

    /// Geometric normal in f64, not normalised; counter-clockwise front.
    #[inline]
    pub fn normal(&self, prim: u32) -> DVec3 {
        let [a, b, c] = self.corners(prim).map(Vec3::as_dvec3);
        (b - a).cross(c - a)
    }

    /// Whether the triangle is left out: a corner is not finite or the f64 normal vanishes. Leaving out a
    /// triangle without area opens no crack, since its edges coincide with those of its neighbours.
    #[inline]
    pub fn is_degenerate(&self, prim: u32) -> bool {
        let corners = self.corners(prim);
        !corners.iter().all(|p| p.is_finite()) || self.normal(prim) == DVec3::ZERO
    }
}
