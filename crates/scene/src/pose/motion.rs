//! What moves the vertices of a frame, for those who pose vertices themselves, as a graphics device does.
//!
//! Matrices are f64 and relative to the frame's origin, so that they lose nothing far from the world's zero when they
//! are rounded. Cost: 128 bytes a joint or rigid object.

use glam::{DMat4, DVec3};

use super::{Motion, draws, origin, posed_nodes};
use crate::{Primitive, Scene};

/// What moves the vertices of one drawn primitive.
#[derive(Clone, Debug)]
pub struct ObjectMotion<'a> {
    /// Where its vertices are at rest, and how much each joint moves them.
    pub primitive: &'a Primitive,
    /// From mesh space to the frame's: for each joint of the skin, or the only one.
    pub matrices: Vec<DMat4>,
    /// Whether vertices follow their joints; all follow the first matrix if not.
    pub skinned: bool,
    /// Morph targets that have any effect: index and weight.
    pub morphs: Vec<(usize, f64)>,
}

impl ObjectMotion<'_> {
    /// Vertex `v` in mesh space.
    pub fn local(&self, v: usize) -> DVec3 {
        let base = self.primitive.positions[v].as_dvec3();
        self.morphs.iter().fold(base, |sum, &(target, weight)| {
            let moved = self.primitive.morph_targets[target].positions.get(v);
            sum + moved.map_or(DVec3::ZERO, |d| d.as_dvec3() * weight)
        })
    }

    /// Matrices that move vertex `v`, and their shares, which sum up to 1.
    pub fn influences(&self, v: usize) -> [(usize, f64); 4] {
        if self.skinned {
            influences(self.primitive, v)
        } else {
            [(0, 1.0), (0, 0.0), (0, 0.0), (0, 0.0)]
        }
    }
}

/// Joints of a skinned vertex and their shares. Weights in f32 miss a sum of 1 by some 1e-7, which far from the world's
/// zero would be a visible shift.
#[inline]
pub(super) fn influences(primitive: &Primitive, v: usize) -> [(usize, f64); 4] {
    let weights = primitive.weights[v].as_dvec4();
    let total = weights.element_sum();
    let scale = if total > 0.0 { total.recip() } else { 0.0 };
    let joints = primitive.joints[v];
    [0, 1, 2, 3].map(|i| (usize::from(joints[i]), weights[i] * scale))
}

impl Scene {
    /// What moves the vertices of [`Scene::at_animation`]'s frame at this time, object by object in their order.
    ///
    /// # Panics
    /// As [`Scene::at`].
    pub fn motions(&self, animation: Option<usize>, time: f32) -> Vec<ObjectMotion<'_>> {
        let (pose, world) = posed_nodes(self, animation, time);
        let to_frame = DMat4::from_translation(-origin::choose(self));
        let all = draws(self, &pose, &world).into_iter().map(|draw| {
            let (matrices, skinned) = match draw.motion {
                Motion::Rigid(matrix) => (vec![matrix], false),
                Motion::Skinned(joints) => (joints, true),
            };
            ObjectMotion {
                primitive: draw.primitive,
                matrices: matrices.iter().map(|matrix| to_frame * *matrix).collect(),
                skinned,
                morphs: draw.morphs,
            }
        });
        all.collect()
    }
}
