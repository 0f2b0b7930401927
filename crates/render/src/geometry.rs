//! What the structures take of a frame: its triangles as slices, its lights as ends of shadow rays.

use glam::DVec3;
use rayward_scene::{FrameGeometry, LightKind, PosedLight};
use rayward_trace::{Light, Triangles};

/// The frame's triangles, in the local frame.
pub fn triangles(geometry: &FrameGeometry) -> Triangles<'_> {
    // Called for every hit, so without the checks of `Triangles::new`.
    Triangles {
        x: &geometry.x,
        y: &geometry.y,
        z: &geometry.z,
        indices: &geometry.indices,
    }
}

/// Where a light's shadow rays end, in the local frame of this origin. Area lights stand for their centre.
pub fn shadow_end(light: &PosedLight, origin: DVec3) -> Light {
    match light.kind {
        LightKind::Directional { .. } => Light::Directional((-light.direction).as_vec3()),
        _ => Light::Point((light.position - origin).as_vec3()),
    }
}
