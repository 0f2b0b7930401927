//! The geometry of one frame: flat world-space triangles.
//!
//! Layout: structure of arrays, so that structures transform vertices in vector lanes. Positions are f32
//! relative to [`FrameGeometry::origin`] (f64, world): a scene far from the world's origin keeps its precision.
//! Units: metres. Cost: 12 bytes a vertex and 16 a triangle, plus 16 to 60 bytes a vertex of attributes.

use std::ops::Range;

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::{LightKind, PosedSolid, Projection};

/// All triangles of one frame with the posed cameras and lights. Triangle ids (`prim`) index `indices`.
///
/// Triangles with a corner that is not finite, or with zero area, are not in here: they are counted in
/// `dropped_non_finite` and `dropped_degenerate`. Their vertices stay, so a vertex that no triangle uses need
/// not be finite.
#[derive(Clone, Debug, Default)]
pub struct FrameGeometry {
    /// World position of the local zero point: zero, unless the scene's rest pose lies more than 16 of its half
    /// diagonals away from the world's zero. The same at all times.
    pub origin: DVec3,
    /// Vertex x, relative to `origin`.
    pub x: Vec<f32>,
    /// Vertex y, relative to `origin`.
    pub y: Vec<f32>,
    /// Vertex z, relative to `origin`.
    pub z: Vec<f32>,
    /// Corner indices of each triangle. Front faces are counter-clockwise (mirrored transforms are unmirrored).
    pub indices: Vec<[u32; 3]>,
    /// Per-vertex attributes; each vector is empty (no object has it) or as long as `x`.
    pub attributes: VertexAttributes,
    /// One entry per drawn primitive, in triangle order; their ranges tile `0..indices.len()`.
    pub objects: Vec<ObjectRange>,
    /// Solids that are not made of triangles.
    pub solids: Vec<PosedSolid>,
    /// Cameras in world space.
    pub cameras: Vec<PosedCamera>,
    /// Lights in world space.
    pub lights: Vec<PosedLight>,
    /// Triangles left out because a corner was not finite.
    pub dropped_non_finite: usize,
    /// Triangles left out because they had no area.
    pub dropped_degenerate: usize,
}

/// Attributes used for shading only.
#[derive(Clone, Debug, Default)]
pub struct VertexAttributes {
    /// Unit shading normals in world space; the zero vector where an object has none.
    pub normals: Vec<Vec3>,
    /// Unit tangents in world space, w is the handedness.
    pub tangents: Vec<Vec4>,
    /// First texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Second texture coordinates.
    pub uvs1: Vec<Vec2>,
    /// Linear vertex colours; white where an object has none.
    pub colors: Vec<Vec4>,
}

/// Where one drawn primitive lies in the frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectRange {
    /// Its triangles.
    pub triangles: Range<u32>,
    /// Its vertices.
    pub vertices: Range<u32>,
    /// Index into the scene's materials.
    pub material: u32,
    /// Index into the scene's nodes.
    pub node: u32,
    /// Whether its material is double-sided.
    pub double_sided: bool,
}

/// A camera in world space.
#[derive(Clone, Debug)]
pub struct PosedCamera {
    /// Name, possibly empty.
    pub name: String,
    /// World position.
    pub eye: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Unit up direction, perpendicular to `forward`.
    pub up: DVec3,
    /// The lens.
    pub projection: Projection,
}

/// A light in world space.
#[derive(Clone, Debug)]
pub struct PosedLight {
    /// Name, possibly empty.
    pub name: String,
    /// World position (meaningless for directional lights).
    pub position: DVec3,
    /// Unit direction in which it shines.
    pub direction: DVec3,
    /// Unit local X axis in world space (width of rectangles).
    pub axis_x: DVec3,
    /// Unit local Y axis in world space (height of rectangles).
    pub axis_y: DVec3,
    /// Linear colour times intensity, in the units of [`crate::Light::intensity`].
    pub power: Vec3,
    /// Distance at which it ends, metres.
    pub range: f32,
    /// Shape.
    pub kind: LightKind,
}

impl FrameGeometry {
    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len()
    }

    /// Position of vertex `i` relative to `origin`.
    pub fn position(&self, i: u32) -> Vec3 {
        let i = i as usize;
        Vec3::new(self.x[i], self.y[i], self.z[i])
    }

    /// Whether there is nothing to see.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty() && self.solids.is_empty()
    }

    /// Smallest and largest corner of the box around all vertices of triangles and all solids, relative to `origin`;
    /// `None` without any.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let corners = self.indices.iter().flatten().map(|&i| self.position(i));
        let outward = |[low, high]: [DVec3; 2]| {
            let low = low.as_vec3().to_array().map(f32::next_down);
            let high = high.as_vec3().to_array().map(f32::next_up);
            [Vec3::from_array(low), Vec3::from_array(high)]
        };
        let solids = self.solids.iter().filter_map(|solid| solid.shape.bounds());
        let mut corners = corners.chain(solids.flat_map(outward));
        let first = corners.next()?;
        Some(corners.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
    }
}
