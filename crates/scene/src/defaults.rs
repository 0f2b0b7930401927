//! A camera and lights for scenes that have none.
//!
//! The camera looks from the front right and slightly above (30 and 20 degrees), the usual three-quarter view
//! of a model that faces +Z, and is as near as the bounding box allows. The key light comes from the upper left
//! of the camera, as readers of shaded pictures expect, and some light from all around fills what it does not reach.

use std::f64::consts::PI;

use glam::{DMat3, DVec3, Vec3};

use crate::{FrameGeometry, LightKind, PosedCamera, PosedLight, Projection};

/// Radiance from all around that goes with [`default_lights`], so that nothing is black.
pub const DEFAULT_AMBIENT: Vec3 = Vec3::splat(0.1);

/// Vertical field of view of the made-up camera, radians.
const VFOV: f64 = 40.0 * PI / 180.0;
/// Share of the view that the box fills in the tighter direction.
const FILL: f64 = 0.9;
/// Angle of the view to the right of +Z and above the horizon, radians.
const AZIMUTH: f64 = 30.0 * PI / 180.0;
const ELEVATION: f64 = 20.0 * PI / 180.0;
/// Radiance that a white matt surface facing the light shows.
const KEY_RADIANCE: f64 = 0.9;

/// A camera that shows all of the frame in a picture of this width over height. A frame without triangles, or of one
/// point, is looked at from 2 metres.
pub fn default_camera(frame: &FrameGeometry, aspect: f64) -> PosedCamera {
    let (lo, hi) = frame
        .bounds()
        .map_or((DVec3::ZERO, DVec3::ZERO), |(l, h)| (l.as_dvec3(), h.as_dvec3()));
    let center = (lo + hi) / 2.0;
    let half = (hi - lo) / 2.0;

    let back = DVec3::new(
        ELEVATION.cos() * AZIMUTH.sin(),
        ELEVATION.sin(),
        ELEVATION.cos() * AZIMUTH.cos(),
    );
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let camera_from_world = DMat3::from_cols(right, up, back).transpose();

    let aspect = if aspect.is_finite() && aspect > 0.0 {
        aspect
    } else {
        1.0
    };
    let tan_y = (VFOV / 2.0).tan() * FILL;
    let tan_x = tan_y * aspect;
    // A corner at (x, y, z) before the camera at distance d is in view if |x| <= tan_x (d - z).
    let distance = corners(half).map(|corner| {
        let p = camera_from_world * corner;
        p.z + (p.x.abs() / tan_x).max(p.y.abs() / tan_y)
    });
    let distance = distance.into_iter().fold(0.0, f64::max);
    let distance = if distance > 0.0 { distance } else { 2.0 };
    PosedCamera {
        name: "made up".into(),
        eye: frame.origin + center + back * distance,
        forward: -back,
        up,
        projection: Projection::Perspective {
            vfov: VFOV,
            aspect: None,
        },
    }
}

/// A key light from the upper left of the camera: sharp, parallel, strong enough that a white matt surface that
/// faces it shows radiance 0.9. It depends on the direction of view only, so a frame of any size is lit alike.
pub fn default_lights(camera: &PosedCamera) -> Vec<PosedLight> {
    let right = camera.forward.cross(camera.up);
    let towards = (camera.up * 1.0 - right * 0.8 - camera.forward * 1.2).normalize();
    let axis_x = right.reject_from_normalized(towards).normalize();
    vec![PosedLight {
        name: "made up".into(),
        position: camera.eye,
        direction: -towards,
        axis_x,
        axis_y: towards.cross(axis_x),
        power: Vec3::splat((PI * KEY_RADIANCE) as f32),
        range: f32::INFINITY,
        kind: LightKind::Directional { half_angle: 0.0 },
    }]
}

fn corners(half: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        half * DVec3::new(sign(0), sign(1), sign(2))
    })
}
