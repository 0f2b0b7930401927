//! Cameras and lights by scene name, from a JSON file beside the scenes.
//!
//! The file is one object; each key names a scene, each value is a [`CameraEntry`]:
//!
//! ```json
//! { "bunny": { "file": "bench/bunny.ply", "eye": [0, 1, 3], "target": [0, 0, 0], "up": [0, 1, 0],
//!              "vfov_deg": 40, "point_light": [2, 3, 1],
//!              "area_light": { "center": [0, 3, 0], "edge_u": [1, 0, 0], "edge_v": [0, 0, 1] } } }
//! ```
//!
//! Only `eye` and `target` have to be there; other keys are ignored. Coordinates are those of the posed scene (metres,
//! +Y up). The file has positions of lights, not their power: see [`CameraEntry::lights`].

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use serde::Deserialize;

use crate::load::read_file;
use crate::{Error, FrameGeometry, LightKind, PosedCamera, PosedLight, Projection};

/// One scene's camera and lights.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct CameraEntry {
    /// The scene file, relative to the camera file.
    pub file: Option<String>,
    /// Number of triangles the scene is known to have.
    pub triangles: Option<u64>,
    /// Camera position.
    #[serde(deserialize_with = "vector")]
    pub eye: DVec3,
    /// A point the camera looks at.
    #[serde(deserialize_with = "vector")]
    pub target: DVec3,
    /// A direction that is up in the picture; need not be perpendicular to the view.
    #[serde(default = "y_axis", deserialize_with = "vector")]
    pub up: DVec3,
    /// Full vertical field of view, degrees.
    #[serde(default = "default_vfov")]
    pub vfov_deg: f64,
    /// Position of a point light.
    #[serde(default, deserialize_with = "optional_vector")]
    pub point_light: Option<DVec3>,
    /// A rectangular light.
    pub area_light: Option<AreaLight>,
}

/// A one-sided rectangle that shines along the cross product of its edges.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct AreaLight {
    /// Its centre.
    #[serde(deserialize_with = "vector")]
    pub center: DVec3,
    /// One edge, over the full width.
    #[serde(deserialize_with = "vector")]
    pub edge_u: DVec3,
    /// The other edge, over the full height.
    #[serde(deserialize_with = "vector")]
    pub edge_v: DVec3,
}

fn vector<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    <[f64; 3]>::deserialize(deserializer).map(DVec3::from_array)
}

fn optional_vector<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<DVec3>, D::Error> {
    Ok(Option::<[f64; 3]>::deserialize(deserializer)?.map(DVec3::from_array))
}

fn y_axis() -> DVec3 {
    DVec3::Y
}

fn default_vfov() -> f64 {
    45.0
}

/// Reads a camera file: entries by scene name.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read; [`Error::Malformed`] with line and column, or the scene's name, if
/// it is not such a file or a camera in it cannot see (target at the eye, field of view not in (0, 180)).
pub fn read_camera_file(path: &Path) -> Result<BTreeMap<String, CameraEntry>, Error> {
    let bytes = read_file(path).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })?;
    let malformed = |place: String, problem: String| Error::Malformed {
        path: path.into(),
        place,
        problem,
    };
    let entries: BTreeMap<String, CameraEntry> = serde_json::from_slice(&bytes).map_err(|e| {
        let message = e.to_string();
        let message = message
            .rsplit_once(" at line ")
            .map_or(message.as_str(), |(m, _)| m);
        malformed(
            format!("line {}, column {}", e.line(), e.column()),
            message.to_owned(),
        )
    })?;
    for (name, entry) in &entries {
        entry
            .check()
            .map_err(|problem| malformed(format!("scene {name:?}"), problem.into()))?;
    }
    Ok(entries)
}

/// The entry for a scene file: the one whose `file` ends like the scene's path, else the one named like its stem.
pub fn find_camera<'a>(entries: &'a BTreeMap<String, CameraEntry>, scene: &Path) -> Option<&'a CameraEntry> {
    let by_file = entries.values().find(|e| {
        e.file
            .as_ref()
            .is_some_and(|f| !f.is_empty() && scene.ends_with(f))
    });
    by_file.or_else(|| entries.get(scene.file_stem()?.to_str()?))
}

impl CameraEntry {
    fn check(&self) -> Result<(), &'static str> {
        let view = self.target - self.eye;
        if !view.is_finite() || view == DVec3::ZERO {
            return Err("eye and target have to be finite and apart");
        }
        if !(self.vfov_deg > 0.0 && self.vfov_deg < 180.0) {
            return Err("vfov_deg has to be above 0 and below 180");
        }
        Ok(())
    }

    /// The camera in world space.
    pub fn camera(&self) -> PosedCamera {
        let forward = (self.target - self.eye).try_normalize().unwrap_or(DVec3::NEG_Z);
        let up = self.up.reject_from_normalized(forward).try_normalize();
        PosedCamera {
            name: String::new(),
            eye: self.eye,
            forward,
            up: up.unwrap_or_else(|| forward.any_orthonormal_vector()),
            projection: Projection::Perspective {
                vfov: self.vfov_deg.to_radians(),
                aspect: None,
            },
        }
    }

    /// The lights in world space, point light first. Each is given the power that shows a white matt surface at
    /// the camera's target which faces the light with radiance 1 (irradiance pi).
    pub fn lights(&self) -> Vec<PosedLight> {
        let point = self.point_light.map(|p| point_light_for(p, self.target));
        let area = self.area_light.map(|a| a.light_for(self.target));
        point.into_iter().chain(area).collect()
    }
}

/// A point light at `position` with the intensity that gives a surface at `center` facing it irradiance pi, so
/// that a white matt one shows radiance 1.
pub fn point_light_for(position: DVec3, center: DVec3) -> PosedLight {
    let to_center = center - position;
    let intensity = std::f64::consts::PI * to_center.length_squared();
    let direction = to_center.try_normalize().unwrap_or(DVec3::NEG_Y);
    let (axis_x, axis_y) = direction.any_orthonormal_pair();
    PosedLight {
        name: String::new(),
        position,
        direction,
        axis_x,
        axis_y,
        power: Vec3::splat(intensity as f32),
        range: f32::INFINITY,
        kind: LightKind::Point { radius: 0.0 },
    }
}

/// A square in the place of a light, a tenth of its distance wide, that faces the middle of the scene; for a light without
/// a place as far away as the scene is large.
pub fn square_light_at(light: &PosedLight, geometry: &FrameGeometry) -> PosedLight {
    let (low, high) = geometry.bounds().unwrap_or_default();
    let middle = geometry.origin + (low + high).as_dvec3() * 0.5;
    let position = match light.kind {
        LightKind::Directional { .. } => middle - light.direction * f64::from((high - low).length()),
        _ => light.position,
    };
    let side = (position.distance(middle) * 0.1) as f32;
    PosedLight {
        kind: LightKind::Rectangle {
            width: side,
            height: side,
        },
        ..point_light_for(position, middle)
    }
}

impl AreaLight {
    /// The light with the radiance that gives a surface at `center` facing it irradiance pi, reckoned as if all of
    /// it were at its centre; the cosine at the light is left out where it would be below a tenth.
    fn light_for(&self, center: DVec3) -> PosedLight {
        let normal = self.edge_u.cross(self.edge_v);
        let direction = normal.try_normalize().unwrap_or(DVec3::NEG_Y);
        let axis_x = self
            .edge_u
            .try_normalize()
            .unwrap_or_else(|| direction.any_orthonormal_vector());
        let to_center = center - self.center;
        let cosine = to_center.normalize_or(direction).dot(direction).max(0.1);
        let radiance = std::f64::consts::PI * to_center.length_squared() / (normal.length() * cosine);
        PosedLight {
            name: String::new(),
            position: self.center,
            direction,
            axis_x,
            // The light is in its X-Y plane and shines along -Z.
            axis_y: axis_x.cross(direction),
            power: Vec3::splat(if radiance.is_finite() {
                radiance as f32
            } else {
                0.0
            }),
            range: f32::INFINITY,
            kind: LightKind::Rectangle {
                width: self.edge_u.length() as f32,
                height: self.edge_v.length() as f32,
            },
        }
    }
}
