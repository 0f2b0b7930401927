//! The small contract that every structure for arbitrary rays keeps.

use crate::{Hit, Light, Ray, Receiver};

/// Closest hit and any hit of single rays. This is the contract for truth and tests; speed lives in methods
/// whose signature is the class of rays ([`crate::EyeGrid`], [`crate::PointLightGrid`]).
///
/// All implementations agree on every answer, prims included; ties in `t` go to the smaller id.
pub trait Accel: Sync {
    /// The closest hit.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Whether there is any hit.
    fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_some()
    }

    /// Whether some triangle other than the receiver's own lies between it and the light.
    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool;
}
