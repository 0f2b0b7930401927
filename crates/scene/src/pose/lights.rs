//! Cameras and lights of the frame in world space; both look along their node's local -Z.
//!
//! A node's scale, the file's unit included, applies to lengths (area lights, light radii, the view of a parallel
//! camera); intensities and ranges stay as given, as `KHR_lights_punctual` has it.

use glam::{DMat3, DMat4, DVec3};

use crate::{LightKind, PosedCamera, PosedLight, Projection, Scene};

pub(super) fn pose_cameras(scene: &Scene, world: &[DMat4], cameras: &mut Vec<PosedCamera>) {
    cameras.clear();
    for (node, matrix) in scene.nodes.iter().zip(world) {
        let Some(camera) = node.camera else { continue };
        let camera = &scene.cameras[camera];
        let [_, up, back] = axes(matrix);
        let projection = match camera.projection {
            Projection::Orthographic { half_height, aspect } => Projection::Orthographic {
                half_height: half_height * matrix.y_axis.truncate().length(),
                aspect,
            },
            perspective @ Projection::Perspective { .. } => perspective,
        };
        cameras.push(PosedCamera {
            name: if camera.name.is_empty() {
                node.name.clone()
            } else {
                camera.name.clone()
            },
            eye: matrix.w_axis.truncate(),
            forward: -back,
            up,
            projection,
        });
    }
}

pub(super) fn pose_lights(scene: &Scene, world: &[DMat4], lights: &mut Vec<PosedLight>) {
    lights.clear();
    for (node, matrix) in scene.nodes.iter().zip(world) {
        let Some(light) = node.light else { continue };
        let light = &scene.lights[light];
        let [axis_x, axis_y, back] = axes(matrix);
        lights.push(PosedLight {
            name: if light.name.is_empty() {
                node.name.clone()
            } else {
                light.name.clone()
            },
            position: matrix.w_axis.truncate(),
            direction: -back,
            axis_x,
            axis_y,
            power: light.color * light.intensity,
            range: light.range,
            kind: scaled(light.kind, matrix),
        });
    }
}

/// Right, up and back of a node: orthonormal, and right-handed even where the node mirrors, since neither a
/// lens nor a light can be mirrored.
fn axes(matrix: &DMat4) -> [DVec3; 3] {
    let back = matrix.z_axis.truncate().try_normalize().unwrap_or(DVec3::Z);
    let up = matrix.y_axis.truncate().reject_from_normalized(back);
    let up = up
        .try_normalize()
        .unwrap_or_else(|| back.any_orthonormal_vector());
    [up.cross(back), up, back]
}

/// A light's shape with its lengths in world units.
fn scaled(kind: LightKind, matrix: &DMat4) -> LightKind {
    let across = matrix.x_axis.truncate().length() as f32;
    let along = matrix.y_axis.truncate().length() as f32;
    let mean = DMat3::from_mat4(*matrix).determinant().abs().cbrt() as f32;
    match kind {
        LightKind::Point { radius } => LightKind::Point {
            radius: radius * mean,
        },
        LightKind::Spot { inner, outer, radius } => LightKind::Spot {
            inner,
            outer,
            radius: radius * mean,
        },
        LightKind::Rectangle { width, height } => LightKind::Rectangle {
            width: width * across,
            height: height * along,
        },
        LightKind::Disk { radius } => LightKind::Disk {
            radius: radius * (across * along).sqrt(),
        },
        directional @ LightKind::Directional { .. } => directional,
    }
}
