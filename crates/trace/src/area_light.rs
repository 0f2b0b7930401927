//! Lights with a size, and the points of them that shadow rays end at.
//!
//! A sample of a light is an f32 point, so that the exact decision ([`crate::exact::shadows`]) towards it is the same
//! as towards a point light that stands there. A receiver's answer is one bit a sample.
//!
//! Rectangles and disks shine to one side and have the same points for all receivers of a pixel. A sphere shows each
//! receiver the disk that its outline spans, at right angles to the line of sight: uniform points of it, weighted
//! with the cosine at the disk, estimate the sphere's light without bias, and none is wasted on the far side. The
//! sun is a disk of directions.
//!
//! Arithmetic of points is f32 multiplications, additions, divisions and roots in a stated order, without fused
//! operations: the same bits at every level.

use glam::{DVec3, Vec3};

use crate::{Light, Receiver, Samples};

/// A light with a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaLight {
    pub(crate) shape: Shape,
    /// The middle; of the sun, the unit direction towards it.
    pub(crate) center: Vec3,
    /// From the middle to the ends, at right angles; of a sphere, unused.
    pub(crate) half_u: Vec3,
    pub(crate) half_v: Vec3,
    /// Radius of a sphere.
    pub(crate) radius: f32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Rectangle,
    Disk,
    Sphere,
    Sun,
}

impl AreaLight {
    /// A rectangle with these half edges that shines along `half_u x half_v`.
    pub fn rectangle(center: Vec3, half_u: Vec3, half_v: Vec3) -> Self {
        Self {
            shape: Shape::Rectangle,
            center,
            half_u,
            half_v,
            radius: 0.0,
        }
    }

    /// A disk with these perpendicular radii that shines along `half_u x half_v`.
    pub fn disk(center: Vec3, half_u: Vec3, half_v: Vec3) -> Self {
        Self {
            shape: Shape::Disk,
            ..Self::rectangle(center, half_u, half_v)
        }
    }

    /// A sphere.
    pub fn sphere(center: Vec3, radius: f32) -> Self {
        Self {
            shape: Shape::Sphere,
            radius,
            ..Self::rectangle(center, Vec3::ZERO, Vec3::ZERO)
        }
    }

    /// Light from a cone of directions around the one towards the sun, whose half angle in radians is below a
    /// quarter turn.
    pub fn sun(towards: Vec3, half_angle: f32) -> Self {
        let towards = towards.normalize_or_zero();
        let (u, v) = towards.as_dvec3().normalize_or(DVec3::Y).any_orthonormal_pair();
        let tan = f64::from(half_angle.clamp(0.0, 1.5)).tan();
        Self {
            shape: Shape::Sun,
            ..Self::rectangle(towards, (u * tan).as_vec3(), (v * tan).as_vec3())
        }
    }

    /// Whether the light's samples are directions.
    pub(crate) fn is_sun(&self) -> bool {
        self.shape == Shape::Sun
    }

    /// Whether its samples lie in a plane, between its half edges on both sides.
    pub(crate) fn is_flat(&self) -> bool {
        self.shape != Shape::Sphere
    }

    /// Whether the light stands or shines somewhere at all.
    pub fn is_valid(&self) -> bool {
        let finite = self.center.is_finite() && self.half_u.is_finite() && self.half_v.is_finite();
        finite && self.radius.is_finite() && !(self.is_sun() && self.center == Vec3::ZERO)
    }

    /// The side to which it shines, not normalised; zero for a sphere, the sun, and where there is no area.
    pub fn normal(&self) -> DVec3 {
        match self.shape {
            Shape::Rectangle | Shape::Disk => self.half_u.as_dvec3().cross(self.half_v.as_dvec3()),
            Shape::Sphere | Shape::Sun => DVec3::ZERO,
        }
    }

    /// Whether it shines towards a point at all. A point behind a rectangle or disk sees no sample of it, nor does one
    /// that is not finite. Without area there is no behind.
    #[inline]
    pub fn shines_at(&self, point: DVec3) -> bool {
        let normal = self.normal();
        point.is_finite() && (normal == DVec3::ZERO || (point - self.center.as_dvec3()).dot(normal) > 0.0)
    }

    /// The light's point of a receiver's sample: a position, or a direction of the sun.
    pub fn sample(&self, samples: &Samples, pixel: u32, point: DVec3, k: u32) -> Light {
        let [x, y] = samples.point(pixel, k).map(|v| v * 2.0 - 1.0);
        let [x, y] = if self.shape == Shape::Rectangle {
            [x, y]
        } else {
            disk([x, y])
        };
        match self.shape {
            Shape::Rectangle | Shape::Disk => Light::Point(self.center + (self.half_u * x + self.half_v * y)),
            Shape::Sun => Light::Directional(self.center + (self.half_u * x + self.half_v * y)),
            Shape::Sphere => {
                let outline = Outline::new(self, point);
                Light::Point(self.center + (outline.middle + (outline.u * x + outline.v * y)))
            }
        }
    }

    /// Area that a receiver sees samples of: of a sphere, the disk that its outline spans. 0 for the sun.
    pub fn area_towards(&self, point: DVec3) -> f32 {
        match self.shape {
            Shape::Rectangle => 4.0 * self.normal().length() as f32,
            Shape::Disk => std::f32::consts::PI * self.normal().length() as f32,
            Shape::Sphere => std::f32::consts::PI * Outline::new(self, point).u.length_squared(),
            Shape::Sun => 0.0,
        }
    }

    /// Density per steradian with which one of the samples that a point has lies in a unit direction, and where the direction
    /// meets the light, if it does: its distance, infinite for the sun. For a point that the light shines at.
    ///
    /// The density is that of the plane of the samples, also beside the light; 0 where the direction leaves from the plane.
    pub fn met(&self, point: DVec3, dir: Vec3) -> (f32, Option<f32>) {
        let outline;
        let (to, u, v) = match self.shape {
            Shape::Rectangle | Shape::Disk => (
                (self.center.as_dvec3() - point).as_vec3(),
                self.half_u,
                self.half_v,
            ),
            Shape::Sun => (self.center, self.half_u, self.half_v),
            Shape::Sphere => {
                outline = Outline::new(self, point);
                let to = (self.center.as_dvec3() - point).as_vec3() + outline.middle;
                (to, outline.u, outline.v)
            }
        };
        let normal = u.cross(v);
        let (area, steep) = (normal.length(), normal.dot(dir));
        let distance = normal.dot(to) / steep;
        if distance.is_nan() || distance <= 0.0 || area == 0.0 {
            return (0.0, None);
        }
        let whole = match self.shape {
            Shape::Rectangle => 4.0,
            _ => std::f32::consts::PI,
        };
        let density = distance * distance / (whole * steep.abs());
        let offset = dir * distance - to;
        let [x, y] = [u, v].map(|half| offset.dot(half) / half.length_squared());
        let met = match self.shape {
            Shape::Rectangle => x.abs().max(y.abs()) <= 1.0,
            _ => x * x + y * y <= 1.0,
        };
        let distance = if self.is_sun() { f32::INFINITY } else { distance };
        (density, met.then_some(distance))
    }

    /// On which side of a triangle all of the light is: above 0 its front, below 0 its back, 0 neither for certain.
    pub fn side(&self, corners: [Vec3; 3]) -> f64 {
        let [v0, v1, v2] = corners.map(Vec3::as_dvec3);
        let (a, b) = (v1 - v0, v2 - v0);
        let normal = a.cross(b);
        let center = self.center.as_dvec3();
        let from = if self.is_sun() { center } else { center - v0 };
        let half = self.half_box().as_dvec3();
        let middle = normal.dot(from);
        let sizes = a.abs().element_sum() * b.abs().element_sum() * (from.abs() + half).element_sum();
        let certain = middle.abs() > normal.abs().dot(half) + sizes * 1e-12;
        if certain { middle } else { 0.0 }
    }

    /// Smallest and largest corner of a box that holds all samples; `None` for the sun.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let half = self.half_box();
        (!self.is_sun()).then(|| [self.center - half, self.center + half])
    }

    /// Half sides of a box around the light's middle that holds all samples, f32 rounding included.
    pub(crate) fn half_box(&self) -> Vec3 {
        let spans = match self.shape {
            Shape::Sphere => Vec3::splat(self.radius.abs()),
            _ => self.half_u.abs() + self.half_v.abs(),
        };
        spans * 1.00001 + (self.center.abs() + spans) * (2.0 * f32::EPSILON)
    }
}

/// The disk of a sphere that a receiver sees, relative to the sphere's centre.
struct Outline {
    middle: Vec3,
    u: Vec3,
    v: Vec3,
}

impl Outline {
    /// From inside, the sphere is its centre.
    fn new(light: &AreaLight, point: DVec3) -> Self {
        let q = (point - light.center.as_dvec3()).as_vec3();
        let r = light.radius;
        let d2 = q.x * q.x + q.y * q.y + q.z * q.z;
        // Written so that what is not a number counts as inside.
        let outside = d2 > r * r;
        if !outside {
            return Self {
                middle: Vec3::ZERO,
                u: Vec3::ZERO,
                v: Vec3::ZERO,
            };
        }
        let inverse = 1.0 / d2.sqrt();
        let n = q * inverse;
        let sin = r * inverse;
        let radius = r * (1.0 - sin * sin).max(0.0).sqrt();
        // Duff et al. 2017.
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        let u = Vec3::new(1.0 + sign * (n.x * n.x * a), sign * b, -(sign * n.x));
        let v = Vec3::new(b, sign + n.y * n.y * a, -n.y);
        Self {
            middle: n * (r * sin),
            u: u * radius,
            v: v * radius,
        }
    }
}

/// Coefficients of sin and cos up to an eighth of a turn, in even powers; a few units in the last place are right.
pub(crate) const SIN: [f32; 4] = [1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0];
pub(crate) const COS: [f32; 5] = [1.0, -0.5, 1.0 / 24.0, -1.0 / 720.0, 1.0 / 40320.0];

/// From the square \[-1, 1\]^2 to the unit disk, keeping areas (Shirley and Chiu 1997).
fn disk([x, y]: [f32; 2]) -> [f32; 2] {
    let wide = x.abs() > y.abs();
    let (radius, other) = if wide { (x, y) } else { (y, x) };
    let angle = if radius == 0.0 { 0.0 } else { other / radius } * std::f32::consts::FRAC_PI_4;
    let t = angle * angle;
    let sin = (((SIN[3] * t + SIN[2]) * t + SIN[1]) * t + SIN[0]) * angle * radius;
    let cos = ((((COS[4] * t + COS[3]) * t + COS[2]) * t + COS[1]) * t + COS[0]) * radius;
    if wide { [cos, sin] } else { [sin, cos] }
}

impl crate::BruteForce<'_> {
    /// Which samples of a light a receiver sees, one bit each from the lowest of the first word on: the definition.
    pub fn visible_samples(
        &self,
        receiver: &Receiver,
        light: &AreaLight,
        samples: &Samples,
        pixel: u32,
    ) -> Vec<u32> {
        use crate::Accel;
        let mut bits = vec![0; samples.words()];
        if light.shines_at(receiver.point) {
            for k in 0..samples.count() {
                let end = light.sample(samples, pixel, receiver.point, k);
                if !light.is_valid() || !self.shadowed(receiver, &end) {
                    bits[k as usize / 32] |= 1 << (k % 32);
                }
            }
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_on_the_light() {
        let samples = Samples::new(64, 5);
        let (center, u, v) = (Vec3::new(1.0, 2.0, 3.0), Vec3::X * 0.5, Vec3::Z * 0.25);
        let receiver = DVec3::new(4.0, -1.0, 2.0);
        let mut mean = [Vec3::ZERO; 4];
        let lights = [
            AreaLight::rectangle(center, u, v),
            AreaLight::disk(center, u, v),
            AreaLight::sphere(center, 0.5),
            AreaLight::sun(Vec3::new(0.0, 3.0, 4.0), 0.1),
        ];
        for pixel in 0..50 {
            for k in 0..64 {
                for (light, mean) in lights.iter().zip(&mut mean) {
                    let (Light::Point(p) | Light::Directional(p)) =
                        light.sample(&samples, pixel, receiver, k);
                    let offset = p - light.center;
                    *mean += offset / (50.0 * 64.0);
                    assert!(offset.abs().cmple(light.half_box()).all(), "{light:?} {offset}");
                    let share = [
                        offset.dot(u) / u.length_squared(),
                        offset.dot(v) / v.length_squared(),
                    ];
                    match light.shape {
                        Shape::Rectangle => {
                            assert!(offset.y == 0.0 && share.iter().all(|s| s.abs() < 1.0001));
                        }
                        Shape::Disk => {
                            assert!(offset.y == 0.0 && share[0].hypot(share[1]) < 1.0001);
                        }
                        Shape::Sphere => {
                            let line = (receiver.as_vec3() - center).normalize();
                            let along = offset.dot(line);
                            let distance = (receiver.as_vec3() - center).length();
                            assert!((along - 0.25 / distance).abs() < 1e-5, "in the outline's plane");
                            assert!(offset.length() < 0.50001);
                        }
                        Shape::Sun => assert!(p.angle_between(light.center) < 0.1001),
                    }
                }
            }
        }
        let sphere =
            (receiver.as_vec3() - center).normalize() * 0.25 / (receiver.as_vec3() - center).length();
        assert!(mean[0].length() < 2e-3 && mean[1].length() < 2e-3 && mean[3].length() < 2e-3);
        assert!((mean[2] - sphere).length() < 2e-3);
    }

    #[test]
    fn points_of_a_disk_are_uniform() {
        // Half of the area lies within 1 / sqrt(2) of the middle, and in each quarter a quarter.
        let samples = Samples::new(256, 1);
        let light = AreaLight::disk(Vec3::ZERO, Vec3::X, Vec3::Z);
        let (mut near, mut quarter) = (0, 0);
        for pixel in 0..100 {
            for k in 0..256 {
                let Light::Point(p) = light.sample(&samples, pixel, DVec3::ZERO, k) else {
                    unreachable!("not a sun");
                };
                near += u32::from(p.length_squared() < 0.5);
                quarter += u32::from(p.x > p.z.abs());
            }
        }
        assert!((f64::from(near) / 25_600.0 - 0.5).abs() < 0.005, "{near}");
        assert!((f64::from(quarter) / 25_600.0 - 0.25).abs() < 0.005, "{quarter}");
    }

    #[test]
    fn directions_meet_what_samples_lie_on() {
        let (center, u, v) = (Vec3::new(1.0, 2.0, 3.0), Vec3::X * 0.5, Vec3::NEG_Z * 0.25);
        let lights = [
            AreaLight::rectangle(center, v, u),
            AreaLight::disk(center, v, u),
            AreaLight::sphere(center, 0.5),
            AreaLight::sun(Vec3::new(0.3, 0.8, 0.1), 0.4),
        ];
        let point = DVec3::new(1.5, -0.5, 2.0);
        const N: u16 = 1000;
        for light in lights {
            assert!(light.shines_at(point), "{light:?}");
            // The density over all directions that meet the light is 1.
            let (mut all, mut met) = (0.0, 0);
            let step = std::f64::consts::TAU / f64::from(N) / f64::from(N);
            for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                let y = (f32::from(i) + 0.5) / f32::from(N);
                let (sin, cos) = ((f32::from(j) + 0.5) / f32::from(N) * std::f32::consts::TAU).sin_cos();
                let across = (1.0 - y * y).sqrt();
                if let (density, Some(_)) = light.met(point, Vec3::new(across * cos, y, across * sin)) {
                    all += f64::from(density) * step;
                    met += 1;
                }
            }
            assert!(met > 1000 && (all - 1.0).abs() < 0.02, "{light:?}: {all}");
            let samples = Samples::new(64, 5);
            for k in 0..64 {
                let (dir, far) = match light.sample(&samples, 0, point, k) {
                    Light::Point(p) => {
                        let to = p - point.as_vec3();
                        (to.normalize(), to.length())
                    }
                    Light::Directional(dir) => (dir.normalize(), f32::INFINITY),
                };
                let distance = light.met(point, dir).1.expect("samples lie on the light");
                assert!(
                    distance == far || (distance - far).abs() < 1e-5,
                    "{distance} for {far}"
                );
                assert_eq!(light.met(point, -dir), (0.0, None));
            }
        }
    }

    #[test]
    fn planes_shine_to_one_side() {
        let light = AreaLight::rectangle(Vec3::Y, Vec3::X, Vec3::Z);
        assert!(
            light.shines_at(DVec3::ZERO) && !light.shines_at(DVec3::Y) && !light.shines_at(2.0 * DVec3::Y)
        );
        assert!(!light.shines_at(DVec3::NAN) && !AreaLight::sphere(Vec3::ZERO, 1.0).shines_at(DVec3::NAN));
        assert!(AreaLight::rectangle(Vec3::Y, Vec3::ZERO, Vec3::ZERO).shines_at(2.0 * DVec3::Y));
        assert!((light.area_towards(DVec3::ZERO) - 4.0).abs() < 1e-6);
        let sphere = AreaLight::sphere(Vec3::ZERO, 1.0).area_towards(DVec3::X * 2.0);
        assert!((sphere - std::f32::consts::PI * 0.75).abs() < 1e-5);
    }
}
