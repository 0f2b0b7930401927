//! Cameras (glTF 2.0 §3.10) and `KHR_lights_punctual`.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;
use gltf::json;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::{Light as PunctualLight, Type as LightType};

use super::source::Source;
use super::{Notices, place};
use crate::{Camera, Error, Light, LightKind, LoadOptions, Projection};

/// Reads all cameras.
pub(super) fn cameras(source: &Source<'_>, options: &LoadOptions) -> Result<Vec<Camera>, Error> {
    let read = |(i, camera): (usize, &json::Camera)| {
        let place = place("camera", i, camera.name.as_ref());
        let projection = match source.valid(&camera.type_, "type", &place)? {
            CameraType::Perspective => camera.perspective.as_ref().map(|lens| Projection::Perspective {
                vfov: f64::from(lens.yfov),
                aspect: lens
                    .aspect_ratio
                    .map(f64::from)
                    .filter(|&aspect| aspect > 0.0 && aspect.is_finite()),
            }),
            CameraType::Orthographic => camera.orthographic.as_ref().map(|lens| Projection::Orthographic {
                half_height: f64::from(lens.ymag.abs()) * options.scale,
                aspect: Some(f64::from(lens.xmag / lens.ymag).abs()).filter(|&a| a > 0.0 && a.is_finite()),
            }),
        };
        let sound = match projection {
            Some(Projection::Perspective { vfov, .. }) => vfov > 0.0 && vfov < std::f64::consts::PI,
            Some(Projection::Orthographic { half_height, .. }) => {
                half_height > 0.0 && half_height.is_finite()
            }
            None => return Err(source.malformed(place, "the object that its type calls for is missing")),
        };
        match projection {
            Some(projection) if sound => Ok(Camera {
                name: camera.name.clone().unwrap_or_default(),
                projection,
            }),
            _ => Err(source.malformed(place, "yfov is outside (0, pi) or ymag is 0")),
        }
    };
    source.root.cameras.iter().enumerate().map(read).collect()
}

/// The file's punctual lights.
pub(super) fn punctual<'a>(source: &'a Source<'_>) -> &'a [PunctualLight] {
    let extensions = source.root.extensions.as_ref();
    let lights = extensions.and_then(|extensions| extensions.khr_lights_punctual.as_ref());
    lights.map_or(&[], |lights| lights.lights.as_slice())
}

/// Reads all lights.
pub(super) fn lights(
    source: &Source<'_>,
    options: &LoadOptions,
    notices: &mut Notices,
) -> Result<Vec<Light>, Error> {
    let scale = options.scale as f32;
    let mut lights = Vec::new();
    for (i, light) in punctual(source).iter().enumerate() {
        let place = place("light", i, light.name.as_ref());
        let radius = source.light_radii.get(i).copied().unwrap_or_default() * scale;
        let kind = match source.valid(&light.type_, "type", &place)? {
            LightType::Directional => LightKind::Directional { half_angle: 0.0 },
            LightType::Point => LightKind::Point { radius },
            LightType::Spot => {
                let spot = light.spot.clone().unwrap_or_default();
                let outer = match light.spot {
                    Some(_) => spot.outer_cone_angle,
                    None => std::f32::consts::FRAC_PI_4,
                };
                if !(outer > 0.0 && outer <= FRAC_PI_2 && (0.0..outer).contains(&spot.inner_cone_angle)) {
                    notices.say(
                        &place,
                        "cone angles outside 0 <= inner < outer <= pi/2 are clamped",
                    );
                }
                let outer = if outer > 0.0 {
                    outer.min(FRAC_PI_2)
                } else {
                    std::f32::consts::FRAC_PI_4
                };
                LightKind::Spot {
                    inner: spot.inner_cone_angle.max(0.0).min(outer),
                    outer,
                    radius,
                }
            }
        };
        let color = Vec3::from_array(light.color);
        if !color.is_finite()
            || !light.intensity.is_finite()
            || color.min_element() < 0.0
            || light.intensity < 0.0
        {
            return Err(source.malformed(place, "color or intensity is negative or not finite"));
        }
        lights.push(Light {
            name: light.name.clone().unwrap_or_default(),
            color,
            intensity: light.intensity,
            range: light
                .range
                .filter(|&range| range > 0.0)
                .map_or(f32::INFINITY, |range| range * scale),
            kind,
        });
    }
    Ok(lights)
}
