//! Lights prepared for one frame: positions in the local frame, distributions as a scale and an offset.
//!
//! Units are those of `KHR_lights_punctual`: candela for point and spot lights, lux for directional ones; rectangles and
//! disks have a radiance in nits. A sample of a light with a size is a small light with the power of the whole
//! ([`ShadingLight::incident_from`]): of a rectangle or disk with the cosine at the light, of a sphere as the disk that
//! its outline spans, which has the sphere's radiance, candela over the area of its cross section.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use rayward_scene::{LightKind, PosedLight};
use rayward_trace::{AreaLight, Light};

/// What arrives at a point from one light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incident {
    /// Unit direction from the point to the light.
    pub towards: Vec3,
    /// Distance to the light in metres; infinite for directional lights.
    pub distance: f32,
    /// From [`ShadingLight::incident`]: irradiance of a surface that faces the light. From [`super::direct`]:
    /// radiance that the surface sends to the viewer.
    pub radiance: Vec3,
}

/// One light of a frame, ready for shading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadingLight {
    /// Position in the local frame, metres.
    pub position: Vec3,
    /// Unit direction in which it shines.
    pub direction: Vec3,
    /// Intensity, illuminance, or radiance times area.
    pub power: Vec3,
    /// 1 / range^2, 0 without a range.
    pub inverse_range2: f32,
    /// Of a sphere; 0 for others.
    pub radius: f32,
    /// How its light is spread.
    pub distribution: Distribution,
}

/// How the light of a source is spread over directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// From one direction, the same everywhere.
    Directional,
    /// Evenly.
    Point,
    /// Squared linear falloff in the cosine between the two angles.
    Spot {
        /// Falloff for a unit of the cosine.
        scale: f32,
        /// Falloff at a cosine of 0.
        offset: f32,
    },
    /// One side of a plane.
    Cosine,
}

impl ShadingLight {
    /// The light relative to the frame's origin.
    pub fn new(light: &PosedLight, origin: DVec3) -> Self {
        let (distribution, area) = match light.kind {
            LightKind::Directional { .. } => (Distribution::Directional, 1.0),
            LightKind::Point { .. } => (Distribution::Point, 1.0),
            LightKind::Spot { inner, outer, .. } => {
                let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-3);
                (
                    Distribution::Spot {
                        scale,
                        offset: -outer.cos() * scale,
                    },
                    1.0,
                )
            }
            LightKind::Rectangle { width, height } => (Distribution::Cosine, width * height),
            LightKind::Disk { radius } => (Distribution::Cosine, PI * radius * radius),
        };
        let has_range = light.range > 0.0 && light.range.is_finite();
        Self {
            position: (light.position - origin).as_vec3(),
            direction: light.direction.as_vec3().normalize_or(Vec3::NEG_Z),
            power: light.power * area,
            inverse_range2: if has_range {
                1.0 / (light.range * light.range)
            } else {
                0.0
            },
            radius: match light.kind {
                LightKind::Point { radius } | LightKind::Spot { radius, .. } => radius,
                _ => 0.0,
            },
            distribution,
        }
    }

    /// What arrives at a point in the local frame; `None` outside of the light's reach or cone.
    #[inline]
    pub fn incident(&self, point: Vec3) -> Option<Incident> {
        if self.distribution == Distribution::Directional {
            return Some(Incident {
                towards: -self.direction,
                distance: f32::INFINITY,
                radiance: self.power,
            });
        }
        self.incident_at(self.position, point)
    }

    /// What arrives at a point from a sample of the light's surface, as if all of the light were like it.
    #[inline]
    pub fn incident_from(&self, area: &AreaLight, sample: &Light, point: Vec3) -> Option<Incident> {
        let position = match *sample {
            Light::Directional(direction) => {
                return Some(Incident {
                    towards: direction.try_normalize()?,
                    distance: f32::INFINITY,
                    radiance: self.power,
                });
            }
            Light::Point(position) => position,
        };
        let mut incident = self.incident_at(position, point)?;
        if self.radius > 0.0 {
            let axis = (point - self.position).normalize_or_zero();
            let share = area.area_towards(point.as_dvec3()) / (PI * self.radius * self.radius);
            // From inside, the sphere is a point.
            if share > 0.0 {
                incident.radiance *= share * -incident.towards.dot(axis);
            }
        }
        Some(incident)
    }

    /// As [`Self::incident_from`], with the size of the light that shading knows.
    pub(crate) fn incident_beside(&self, sample: &Light, point: Vec3) -> Option<Incident> {
        let area = AreaLight::sphere(self.position, self.radius);
        self.incident_from(&area, sample, point)
    }

    /// What arrives at a point from the light if it stood at `position`.
    #[inline]
    fn incident_at(&self, position: Vec3, point: Vec3) -> Option<Incident> {
        let offset = position - point;
        let distance2 = offset.length_squared();
        let distance = distance2.sqrt();
        if distance2 == 0.0 {
            return None;
        }
        let towards = offset / distance;
        let cos = -towards.dot(self.direction);
        let angular = match self.distribution {
            Distribution::Spot { scale, offset } => {
                let falloff = (cos * scale + offset).clamp(0.0, 1.0);
                falloff * falloff
            }
            Distribution::Cosine => cos.max(0.0),
            Distribution::Point | Distribution::Directional => 1.0,
        };
        // The window of KHR_lights_punctual: 1 - (distance / range)^4, 0 beyond the range.
        let reach = distance2 * self.inverse_range2;
        let window = (1.0 - reach * reach).max(0.0);
        let radiance = self.power * (angular * window / distance2);
        (radiance != Vec3::ZERO).then_some(Incident {
            towards,
            distance,
            radiance,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_4, FRAC_PI_6};

    use super::*;

    const FAR: DVec3 = DVec3::new(1e7, -1e7, 1e7);

    /// A light of power 8 at `FAR` + 2 up that shines down.
    fn light(kind: LightKind, range: f32) -> ShadingLight {
        let posed = PosedLight {
            name: String::new(),
            position: FAR + 2.0 * DVec3::Y,
            direction: DVec3::NEG_Y,
            axis_x: DVec3::X,
            axis_y: DVec3::Z,
            power: Vec3::splat(8.0),
            range,
            kind,
        };
        ShadingLight::new(&posed, FAR)
    }

    fn irradiance(light: &ShadingLight, point: Vec3) -> f32 {
        light.incident(point).map_or(0.0, |incident| incident.radiance.x)
    }

    #[test]
    fn point_lights_fall_off_with_the_square() {
        let light = light(LightKind::Point { radius: 0.0 }, f32::INFINITY);
        let incident = light.incident(Vec3::ZERO).unwrap();
        assert_eq!(
            (incident.towards, incident.distance, incident.radiance),
            (Vec3::Y, 2.0, Vec3::splat(2.0))
        );
        assert!((irradiance(&light, Vec3::new(0.0, -2.0, 0.0)) - 0.5).abs() < 1e-6);
        assert_eq!(light.incident(2.0 * Vec3::Y), None);
    }

    #[test]
    fn the_range_is_a_window() {
        let light = light(LightKind::Point { radius: 0.0 }, 4.0);
        assert!((irradiance(&light, Vec3::ZERO) - 2.0 * (1.0 - 1.0 / 16.0)).abs() < 1e-6);
        assert_eq!(light.incident(Vec3::new(0.0, -2.0, 0.0)), None);
        assert_eq!(light.incident(Vec3::new(0.0, -9.0, 0.0)), None);
    }

    #[test]
    fn directional_lights_are_the_same_everywhere() {
        let light = light(LightKind::Directional { half_angle: 0.0 }, f32::INFINITY);
        for point in [Vec3::ZERO, Vec3::splat(1e6)] {
            let incident = light.incident(point).unwrap();
            assert_eq!((incident.towards, incident.radiance), (Vec3::Y, Vec3::splat(8.0)));
            assert_eq!(incident.distance, f32::INFINITY);
        }
    }

    #[test]
    fn spots_end_at_their_outer_angle() {
        let kind = LightKind::Spot {
            inner: FRAC_PI_6,
            outer: FRAC_PI_4,
            radius: 0.0,
        };
        let light = light(kind, f32::INFINITY);
        let at = |angle: f32| {
            irradiance(&light, Vec3::new(2.0 * angle.tan(), 0.0, 0.0)) / angle.cos().powi(2) / 2.0
        };
        assert!((at(0.0) - 1.0).abs() < 1e-6 && (at(FRAC_PI_6 - 1e-3) - 1.0).abs() < 1e-6);
        assert_eq!(at(FRAC_PI_4 + 1e-3), 0.0);
        let middle = ((FRAC_PI_6.cos() + FRAC_PI_4.cos()) / 2.0).acos();
        assert!(
            (at(middle) - 0.25).abs() < 1e-4,
            "half the way in the cosine, squared"
        );
        assert_eq!(irradiance(&light, 4.0 * Vec3::Y), 0.0, "nothing behind it");
    }

    #[test]
    fn area_lights_shine_from_their_centre_to_one_side() {
        let rectangle = light(
            LightKind::Rectangle {
                width: 0.5,
                height: 2.0,
            },
            f32::INFINITY,
        );
        assert!((irradiance(&rectangle, Vec3::ZERO) - 2.0).abs() < 1e-6);
        assert_eq!(irradiance(&rectangle, 4.0 * Vec3::Y), 0.0);
        let slanted = irradiance(&rectangle, Vec3::new(2.0, 0.0, 0.0));
        assert!((slanted - 1.0 / 2f32.sqrt()).abs() < 1e-6, "8 cos 45 / 8");
        let disk = light(LightKind::Disk { radius: 1.0 }, f32::INFINITY);
        assert!((irradiance(&disk, Vec3::ZERO) - 2.0 * PI).abs() < 1e-5);
    }
}
