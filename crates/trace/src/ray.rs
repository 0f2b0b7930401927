//! Rays, hits and the two ends of a shadow ray.

use glam::{DVec3, Vec3};

use crate::ViewRay;

/// A ray: points `origin + t * dir` with `t_min < t <= t_max`. 32 bytes; `dir` need not be normalised.
///
/// A ray with a component that is not finite (but for `t_max`), or with a zero direction, hits nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Start point.
    pub origin: Vec3,
    /// Hits at or before this parameter do not count.
    pub t_min: f32,
    /// Direction; `t` is measured in its length.
    pub dir: Vec3,
    /// Hits beyond this parameter do not count; may be infinite.
    pub t_max: f32,
}

impl Ray {
    /// A ray from `origin` along `dir` without an end.
    pub fn new(origin: Vec3, dir: Vec3) -> Self {
        Self {
            origin,
            t_min: 0.0,
            dir,
            t_max: f32::INFINITY,
        }
    }

    /// Whether the ray can hit anything at all.
    pub fn is_valid(&self) -> bool {
        self.origin.is_finite() && self.dir.is_finite() && self.dir != Vec3::ZERO && self.t_min < self.t_max
    }
}

/// Where a ray meets a triangle. 16 bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// Parameter of the hit along the ray.
    pub t: f32,
    /// Barycentric weight of corner 1.
    pub u: f32,
    /// Barycentric weight of corner 2; corner 0 has `1 - u - v`.
    pub v: f32,
    /// Triangle id.
    pub prim: u32,
}

/// A point on a surface that asks whether a light sees it.
///
/// The point is kept in f64 with a bound on its own error, so that the surface it lies on never shadows it and
/// no user has to choose an offset: the triangle itself is left out by its id, and crossings nearer than
/// `error` are the surface's own neighbours seen through rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// The point.
    pub point: DVec3,
    /// Bound on the distance of `point` from the surface's plane.
    pub error: f64,
    /// The triangle the point lies on, or `u32::MAX` for a free point.
    pub prim: u32,
}

impl Receiver {
    /// The receiver at parameter `t` of a ray (f64, see [`crate::exact::hit`]) on triangle `prim`.
    pub fn on_surface(ray: &Ray, t: f64, prim: u32) -> Self {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        Self::along(&ViewRay { origin, dir }, t, prim)
    }

    /// As [`Receiver::on_surface`], for a ray of a view.
    pub fn along(ray: &ViewRay, t: f64, prim: u32) -> Self {
        let ViewRay { origin, dir } = *ray;
        let along = dir * t;
        // One rounding each for product and sum and a few for t make some 2^-50 of these magnitudes; 2^-40
        // leaves room for grazing views, where an error in depth grows by the inverse cosine.
        let error = (origin.abs() + along.abs()).max_element() * 2f64.powi(-40);
        Self {
            point: origin + along,
            error,
            prim,
        }
    }

    /// A point in free space, for instance a sensor.
    pub fn free(point: DVec3) -> Self {
        Self {
            point,
            error: 0.0,
            prim: u32::MAX,
        }
    }
}

/// The other end of a shadow ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A point light at this position.
    Point(Vec3),
    /// Parallel light that comes from this direction (towards the light; need not be normalised).
    Directional(Vec3),
}

impl Light {
    /// Direction from `point` towards the light, not normalised.
    pub fn towards(&self, point: DVec3) -> DVec3 {
        match *self {
            Self::Point(position) => position.as_dvec3() - point,
            Self::Directional(direction) => direction.as_dvec3(),
        }
    }
}
