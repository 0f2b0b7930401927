//! Rays that leave a surface: reflected, refracted and scattered ones.
//!
//! They start in a [`Receiver`], so what keeps a surface from shadowing itself keeps a ray from meeting the surface
//! it leaves: the triangle itself is left out by its id, crossings within the receiver's error do not count, and
//! there is no offset to choose. A ray that goes through the surface starts in the same way.

use glam::Vec3;

use crate::exact::{self, ExactHit};
use crate::{BruteForce, Light, Receiver, Triangles, ViewRay};

/// A ray from a point of a surface, without an end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceRay {
    /// Where it starts.
    pub from: Receiver,
    /// Direction; need not be normalised. One that is not finite, or zero, meets nothing.
    pub dir: Vec3,
}

impl SurfaceRay {
    /// The same ray as origin and direction in f64.
    pub fn line(&self) -> ViewRay {
        ViewRay {
            origin: self.from.point,
            dir: self.dir.as_dvec3(),
        }
    }

    /// The eye of someone who looks along the ray, as [`exact::side`] takes it: which side of a triangle is met.
    pub fn looked_at_from(&self) -> Light {
        Light::Directional(-self.dir)
    }

    /// The exact hit of one triangle, if the ray meets it.
    #[inline]
    pub fn meets(&self, triangles: &Triangles, prim: u32) -> Option<ExactHit> {
        let corners = triangles.corners(prim);
        if prim == self.from.prim || !corners.iter().all(|corner| corner.is_finite()) {
            return None;
        }
        let dir = self.dir.as_dvec3();
        exact::hit(self.from.point, dir, corners).filter(|hit| hit.t * dir.length() > self.from.error)
    }
}

/// Whether the first of two hits comes before the second: ties in `t` go to the smaller id.
#[inline]
pub(crate) fn before(a: &(u32, ExactHit), b: &(u32, ExactHit)) -> bool {
    a.1.t < b.1.t || (a.1.t == b.1.t && a.0 < b.0)
}

impl BruteForce<'_> {
    /// The first triangle that a ray meets after it left its surface, and where.
    pub fn after(&self, ray: &SurfaceRay) -> Option<(u32, ExactHit)> {
        if !ray.dir.is_finite() || ray.dir == Vec3::ZERO || !ray.from.point.is_finite() {
            return None;
        }
        let triangles = self.triangles();
        (0..triangles.len() as u32)
            .filter_map(|prim| Some((prim, ray.meets(triangles, prim)?)))
            .reduce(|best, next| if before(&next, &best) { next } else { best })
    }
}
