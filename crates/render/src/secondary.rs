//! What answers rays from anywhere to anywhere: those that leave surfaces, those that pass transparent ones. A batch in,
//! hits out.

use std::fmt::Debug;
use std::ops::ControlFlow;

use rayward_trace::exact::ExactHit;
use rayward_trace::{Bvh, Light, Receiver, SurfaceRay, ViewRay};

/// The first triangle that a ray meets, and where; `None` if it meets none.
pub type SurfaceHit = Option<(u32, ExactHit)>;

/// A structure for rays from anywhere to anywhere.
///
/// Those that answer exactly agree with [`rayward_trace::BruteForce`] bit for bit, and so do the pictures made with
/// them.
pub trait SecondaryTracer: Debug + Send + Sync {
    /// Replaces `hits` by the answers to the rays, in their order.
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>);

    /// Calls `visit` with the triangles between a receiver and a light, in no order that means anything, until it
    /// breaks.
    fn each_between(&self, receiver: &Receiver, light: &Light, visit: &mut dyn FnMut(u32) -> ControlFlow<()>);

    /// Replaces `hits` by all triangles in front of the start of a ray, as parameters and ids in ascending order.
    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>);
}

impl SecondaryTracer for Bvh<'_> {
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.after(ray, &mut ())));
    }

    fn each_between(
        &self,
        receiver: &Receiver,
        light: &Light,
        visit: &mut dyn FnMut(u32) -> ControlFlow<()>,
    ) {
        self.each_shadow(receiver, light, &mut (), visit);
    }

    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>) {
        Bvh::along(self, ray, &mut (), hits);
    }
}
