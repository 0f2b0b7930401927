//! The small contract that every structure for arbitrary rays keeps, and what structures count.

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

    /// Replaces the contents of `hits` by every hit in the ray's range: by ascending `t` (compared in f64, before
    /// it is rounded into the hit), equal ones by ascending id, each triangle at most once.
    fn all_hits(&self, ray: &Ray, hits: &mut Vec<Hit>);

    /// Whether some triangle other than the receiver's own lies between it and the light.
    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool;
}

/// What a builder took in and what it left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BuildStats {
    /// Triangles in the structure.
    pub triangles: usize,
    /// Triangles left out because a corner is not finite.
    pub dropped_non_finite: usize,
    /// Triangles left out because they have no area.
    pub dropped_degenerate: usize,
}

/// Receives the events of a traversal. The implementation for `()` does nothing and compiles to nothing.
pub trait Count {
    /// One node was opened.
    fn node(&mut self);
    /// This many triangles were tested.
    fn triangles(&mut self, tests: usize);
}

impl Count for () {
    #[inline(always)]
    fn node(&mut self) {}
    #[inline(always)]
    fn triangles(&mut self, _tests: usize) {}
}

/// Work done by traversals, summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Nodes opened.
    pub nodes: u64,
    /// Triangles tested.
    pub triangles: u64,
}

impl Count for Counters {
    #[inline]
    fn node(&mut self) {
        self.nodes += 1;
    }
    #[inline]
    fn triangles(&mut self, tests: usize) {
        self.triangles += tests as u64;
    }
}
