//! Choice of the frame's f64 origin.
//!
//! The rule: take the box around the rest pose, with centre `c` and half diagonal `r`. If `c` is within
//! [`NEAR`] half diagonals of the world's zero the origin is zero, and positions are what the file says. Otherwise the
//! origin is `c` rounded to a multiple of the power of two next above `r`, so that the subtraction is exact for
//! most files and a moved scene keeps its bits if it was moved by such a multiple.
//!
//! The box is that of all solids and of at most [`SAMPLES`] vertices a primitive: the rule needs a place and a size, not a
//! bound, and a frame should not cost a pass over all vertices for it.

use glam::{DMat4, DVec3};

use super::world_matrices;
use crate::{Scene, Transform};

/// Distance from zero, in half diagonals, up to which f32 loses at most four bits of the scene's own detail.
const NEAR: f64 = 16.0;
/// Vertices looked at per primitive.
const SAMPLES: usize = 64;

/// The origin of every frame of the scene.
pub(super) fn choose(scene: &Scene) -> DVec3 {
    let Some((lo, hi)) = rest_bounds(scene) else {
        return DVec3::ZERO;
    };
    of_box(lo, hi)
}

/// The rule for the box between two corners.
pub(crate) fn of_box(lo: DVec3, hi: DVec3) -> DVec3 {
    let center = lo.midpoint(hi);
    let radius = (hi - lo).length() / 2.0;
    if center.abs().max_element() <= NEAR * radius {
        return DVec3::ZERO;
    }
    let step = 2f64.powi(radius.max(f64::MIN_POSITIVE).log2().ceil().max(-1000.0) as i32);
    let rounded = (center / step).round() * step;
    if rounded.is_finite() { rounded } else { DVec3::ZERO }
}

fn rest_bounds(scene: &Scene) -> Option<(DVec3, DVec3)> {
    let local: Vec<Transform> = scene.nodes.iter().map(|n| n.transform).collect();
    let world = world_matrices(&scene.nodes, &local);
    let mut bounds: Option<(DVec3, DVec3)> = None;
    let mut add = |p: DVec3| {
        if p.is_finite() {
            bounds = Some(bounds.map_or((p, p), |(lo, hi)| (lo.min(p), hi.max(p))));
        }
    };
    for (index, node) in scene.nodes.iter().enumerate() {
        let solid = node.solid.map(|solid| &scene.solids[solid].shape);
        let around = solid.and_then(|shape| shape.placed(&world[index], DVec3::ZERO).bounds());
        around.into_iter().flatten().for_each(&mut add);
        let Some(mesh) = node.mesh else { continue };
        let skin = node.skin.map(|s| &scene.skins[s]);
        for primitive in &scene.meshes[mesh].primitives {
            match skin {
                Some(skin) if !primitive.joints.is_empty() => {
                    let pairs = skin.joints.iter().zip(&skin.inverse_bind);
                    let joints: Vec<DMat4> = pairs.map(|(&j, bind)| world[j] * bind.as_dmat4()).collect();
                    for i in sample(primitive.positions.len()) {
                        let joint = joints[usize::from(primitive.joints[i][0])];
                        add(joint.transform_point3(primitive.positions[i].as_dvec3()));
                    }
                }
                _ => {
                    for i in sample(primitive.positions.len()) {
                        add(world[index].transform_point3(primitive.positions[i].as_dvec3()));
                    }
                }
            }
        }
    }
    bounds
}

/// Evenly spread indices below `n`.
fn sample(n: usize) -> impl Iterator<Item = usize> {
    (0..n).step_by(n.div_ceil(SAMPLES).max(1))
}
