//! Rays that leave a surface through the hierarchy.

use std::ops::ControlFlow;

use super::slab::Slab;
use super::{Bvh, Filter};
use crate::exact::ExactHit;
use crate::surface_ray::before;
use crate::{Count, SurfaceRay};

impl Bvh<'_> {
    /// The first triangle that a ray meets after it left its surface, and where.
    pub fn after(&self, ray: &SurfaceRay, count: &mut impl Count) -> Option<(u32, ExactHit)> {
        let line = ray.line();
        // As for shadow rays, a negative error bound would let crossings behind the start count.
        let t_min = if ray.from.error >= 0.0 {
            0.0
        } else {
            f64::NEG_INFINITY
        };
        let mut slab = Slab::new(line.origin, line.dir, t_min, f64::INFINITY, self.reach)?;
        let filter = Filter::new(line.origin, line.dir);
        let mut best: Option<(u32, ExactHit)> = None;
        self.walk(&mut slab, count, |leaf, slab| {
            if filter.certain_miss(&leaf.corners) {
                return ControlFlow::Continue(());
            }
            if let Some(hit) = ray.meets(&self.triangles, leaf.prim) {
                let found = (leaf.prim, hit);
                if best.as_ref().is_none_or(|best| before(&found, best)) {
                    best = Some(found);
                    slab.shorten(hit.t);
                }
            }
            ControlFlow::Continue(())
        });
        best
    }
}
