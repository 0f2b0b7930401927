//! Vertices of the frame: morphed, moved, rounded once.

use glam::{DMat3, DMat4, DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::motion::influences;
use super::{Draw, Motion, take};
use crate::{FrameGeometry, MorphTarget};

/// Vertices a task works on: some 100 KB of output, small enough to balance and large enough not to matter.
const CHUNK: usize = 8192;

/// Where one task writes: vertices `first..first + x.len()` of one draw. Slices of absent attributes are empty.
struct Chunk<'a, 'd> {
    draw: &'a Draw<'d>,
    first: usize,
    x: &'a mut [f32],
    y: &'a mut [f32],
    z: &'a mut [f32],
    normals: &'a mut [Vec3],
    tangents: &'a mut [Vec4],
    uvs: &'a mut [Vec2],
    uvs1: &'a mut [Vec2],
    colors: &'a mut [Vec4],
}

/// Fills positions and attributes of the frame.
pub(super) fn write(draws: &[Draw], frame: &mut FrameGeometry) {
    let count = draws.last().map_or(0, |d| d.object.vertices.end as usize);
    let length = |present: &dyn Fn(&Draw) -> bool| if draws.iter().any(present) { count } else { 0 };
    for axis in [&mut frame.x, &mut frame.y, &mut frame.z] {
        axis.resize(count, 0.0);
    }
    let attributes = &mut frame.attributes;
    attributes
        .normals
        .resize(length(&|d| !d.primitive.normals.is_empty()), Vec3::ZERO);
    attributes
        .tangents
        .resize(length(&|d| !d.primitive.tangents.is_empty()), Vec4::ZERO);
    attributes
        .uvs
        .resize(length(&|d| !d.primitive.uvs.is_empty()), Vec2::ZERO);
    attributes
        .uvs1
        .resize(length(&|d| !d.primitive.uvs1.is_empty()), Vec2::ZERO);
    attributes
        .colors
        .resize(length(&|d| !d.primitive.colors.is_empty()), Vec4::ONE);

    let origin = frame.origin;
    chunks(draws, frame).into_par_iter().for_each(|mut chunk| {
        chunk.write_positions(origin);
        chunk.write_normals();
        chunk.write_tangents();
        let (first, primitive) = (chunk.first, chunk.draw.primitive);
        copy(chunk.uvs, &primitive.uvs, first, Vec2::ZERO);
        copy(chunk.uvs1, &primitive.uvs1, first, Vec2::ZERO);
        copy(chunk.colors, &primitive.colors, first, Vec4::ONE);
    });
}

fn chunks<'a, 'd>(draws: &'a [Draw<'d>], frame: &'a mut FrameGeometry) -> Vec<Chunk<'a, 'd>> {
    let (mut x, mut y, mut z) = (&mut frame.x[..], &mut frame.y[..], &mut frame.z[..]);
    let attributes = &mut frame.attributes;
    let (mut normals, mut tangents) = (&mut attributes.normals[..], &mut attributes.tangents[..]);
    let (mut uvs, mut uvs1) = (&mut attributes.uvs[..], &mut attributes.uvs1[..]);
    let mut colors = &mut attributes.colors[..];
    let mut chunks = Vec::new();
    for draw in draws {
        let count = draw.object.vertices.len();
        for first in (0..count).step_by(CHUNK) {
            let n = CHUNK.min(count - first);
            chunks.push(Chunk {
                draw,
                first,
                x: take(&mut x, n),
                y: take(&mut y, n),
                z: take(&mut z, n),
                normals: take(&mut normals, n),
                tangents: take(&mut tangents, n),
                uvs: take(&mut uvs, n),
                uvs1: take(&mut uvs1, n),
                colors: take(&mut colors, n),
            });
        }
    }
    chunks
}

impl Chunk<'_, '_> {
    fn write_positions(&mut self, origin: DVec3) {
        let draw = self.draw;
        for i in 0..self.x.len() {
            let v = self.first + i;
            let local = draw.morphed(draw.primitive.positions[v], v, |target| &target.positions);
            let world = match &draw.motion {
                Motion::Rigid(matrix) => matrix.transform_point3(local),
                Motion::Skinned(joints) => draw.blend(joints, v).transform_point3(local),
            };
            let p = (world - origin).as_vec3();
            (self.x[i], self.y[i], self.z[i]) = (p.x, p.y, p.z);
        }
    }

    fn write_normals(&mut self) {
        let draw = self.draw;
        if draw.primitive.normals.is_empty() {
            self.normals.fill(Vec3::ZERO);
            return;
        }
        let rigid = match &draw.motion {
            Motion::Rigid(matrix) => normal_matrix(matrix),
            Motion::Skinned(_) => DMat3::IDENTITY,
        };
        for (i, normal) in self.normals.iter_mut().enumerate() {
            let v = self.first + i;
            let local = draw.morphed(draw.primitive.normals[v], v, |target| &target.normals);
            let world = match &draw.motion {
                Motion::Rigid(_) => rigid * local,
                Motion::Skinned(joints) => normal_matrix(&draw.blend(joints, v)) * local,
            };
            *normal = world.normalize_or_zero().as_vec3();
        }
    }

    fn write_tangents(&mut self) {
        let draw = self.draw;
        if draw.primitive.tangents.is_empty() {
            self.tangents.fill(Vec4::ZERO);
            return;
        }
        let handedness = if draw.mirrored { -1.0 } else { 1.0 };
        for (i, tangent) in self.tangents.iter_mut().enumerate() {
            let v = self.first + i;
            let base = draw.primitive.tangents[v];
            let local = draw.morphed(base.truncate(), v, |target| &target.tangents);
            let world = match &draw.motion {
                Motion::Rigid(matrix) => matrix.transform_vector3(local),
                Motion::Skinned(joints) => draw.blend(joints, v).transform_vector3(local),
            };
            *tangent = world.normalize_or_zero().as_vec3().extend(base.w * handedness);
        }
    }
}

impl Draw<'_> {
    /// A base value plus the weighted displacements of vertex `v`.
    #[inline]
    fn morphed(&self, base: Vec3, v: usize, values: impl Fn(&MorphTarget) -> &[Vec3]) -> DVec3 {
        let targets = &self.primitive.morph_targets;
        self.morphs
            .iter()
            .fold(base.as_dvec3(), |sum, &(target, weight)| {
                sum + values(&targets[target])
                    .get(v)
                    .map_or(DVec3::ZERO, |d| d.as_dvec3() * weight)
            })
    }

    /// The weighted mean of the joint matrices of vertex `v`.
    #[inline]
    fn blend(&self, joints: &[DMat4], v: usize) -> DMat4 {
        influences(self.primitive, v)
            .into_iter()
            .filter(|(_, weight)| *weight != 0.0)
            .fold(DMat4::ZERO, |sum, (joint, weight)| sum + joints[joint] * weight)
    }
}

/// The inverse transpose up to a positive factor, as the matrix of cofactors: it exists for flattening transforms
/// too. Its sign is that of the determinant, which has to go, or mirroring would turn normals inward.
fn normal_matrix(matrix: &DMat4) -> DMat3 {
    let m = DMat3::from_mat4(*matrix);
    let cofactors = DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    if m.determinant() < 0.0 {
        cofactors * -1.0
    } else {
        cofactors
    }
}

/// Copies vertex attributes that no transform touches.
fn copy<T: Copy>(to: &mut [T], from: &[T], first: usize, absent: T) {
    if from.is_empty() {
        to.fill(absent);
    } else if !to.is_empty() {
        to.copy_from_slice(&from[first..first + to.len()]);
    }
}
