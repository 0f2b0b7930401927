//! Drops triangles that a line certainly misses, in plain f64, before the exact decision.
//!
//! The edge functions of [`super`] are evaluated without their error terms. Each sums six products of three
//! factors, so it is within some 10 * 2^-53 of 6 |d| |a|^2 with the largest components of direction and
//! corners; two values of opposite sign beyond 2^-44 |d| |a|^2 are certain.

use glam::{DVec3, Vec3};

/// The filter of one line.
pub(crate) struct Filter {
    origin: DVec3,
    dir: DVec3,
    bound: f64,
}

impl Filter {
    pub(crate) fn new(origin: DVec3, dir: DVec3) -> Self {
        Self {
            origin,
            dir,
            bound: dir.abs().max_element() * f64::from_bits((1023 - 44) << 52),
        }
    }

    #[inline(always)]
    pub(crate) fn certain_miss(&self, corners: &[Vec3; 3]) -> bool {
        let [a0, a1, a2] = corners.map(|c| c.as_dvec3() - self.origin);
        // d . (a x b) = b . (d x a): the first two products are shared by the three edges.
        let (c0, c1) = (self.dir.cross(a0), self.dir.cross(a1));
        let (e0, e1, e2) = (c1.dot(a2), -c0.dot(a2), c0.dot(a1));
        let size = a0.abs().max(a1.abs()).max(a2.abs()).max_element();
        let bound = self.bound * size * size;
        let low = e0.min(e1).min(e2);
        let high = e0.max(e1).max(e2);
        low < -bound && high > bound
    }
}
