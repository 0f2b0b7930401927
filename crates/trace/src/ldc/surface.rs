//! What frames ask of a structure for any ray: rays that leave surfaces, what lies along a ray or towards a light.

use std::ops::ControlFlow;

use super::{Ldc, Line, Mailbox, Steps, widened};
use crate::exact::{self, ExactHit, Filter};
use crate::surface_ray::before;
use crate::{Light, Receiver, SurfaceRay, ViewRay};

impl Ldc<'_> {
    /// The first triangle that a ray meets after it left its surface, and where.
    pub fn after(&self, ray: &SurfaceRay, steps: &mut impl Steps) -> Option<(u32, ExactHit)> {
        let ViewRay { origin, dir } = ray.line();
        // A negative error bound lets crossings behind the start count.
        let beyond = if ray.from.error >= 0.0 { 0.0 } else { f64::INFINITY };
        let line = Line {
            origin,
            dir,
            t_min: -beyond,
            t_max: f64::INFINITY,
        };
        let filter = Filter::new(origin, dir);
        let mut seen = Mailbox::default();
        let mut best: Option<(u32, ExactHit)> = None;
        self.candidates(line.is_valid(), &line, steps, |prim, t_end| {
            if !seen.first(prim) || filter.certain_miss(&self.triangles.corners(prim)) {
                return ControlFlow::Continue(());
            }
            if let Some(hit) = ray.meets(&self.triangles, prim) {
                let found = (prim, hit);
                if best.as_ref().is_none_or(|best| before(&found, best)) {
                    best = Some(found);
                    *t_end = t_end.min(widened(hit.t));
                }
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// Calls `visit` with the triangles between a receiver and a light, in no order that means anything, until it
    /// breaks. Returns whether it did.
    pub fn each_shadow(
        &self,
        receiver: &Receiver,
        light: &Light,
        steps: &mut impl Steps,
        mut visit: impl FnMut(u32) -> ControlFlow<()>,
    ) -> bool {
        // The same origins, directions and ranges as the hierarchy's, for the same reasons.
        let beyond = if receiver.error >= 0.0 { 0.0 } else { f64::INFINITY };
        let line = match *light {
            Light::Point(position) => Line {
                origin: position.as_dvec3(),
                dir: receiver.point - position.as_dvec3(),
                t_min: 0.0,
                t_max: 1.0 + beyond,
            },
            Light::Directional(direction) => Line {
                origin: receiver.point,
                dir: direction.as_dvec3(),
                t_min: -beyond,
                t_max: f64::INFINITY,
            },
        };
        let filter = Filter::new(line.origin, line.dir);
        let mut broken = false;
        // Those visited; a mailbox forgets.
        let mut visited = Vec::new();
        let mut seen = Mailbox::default();
        self.candidates(line.is_valid(), &line, steps, |prim, _| {
            let hidden = seen.first(prim)
                && !filter.certain_miss(&self.triangles.corners(prim))
                && exact::shadows(&self.triangles, prim, receiver, light);
            if hidden && !visited.contains(&prim) {
                if visit(prim).is_break() {
                    broken = true;
                    return ControlFlow::Break(());
                }
                visited.push(prim);
            }
            ControlFlow::Continue(())
        });
        broken
    }

    /// All triangles in front of the start of an f64 ray, as parameters and ids in ascending order.
    pub fn along(&self, ray: &ViewRay, steps: &mut impl Steps, hits: &mut Vec<(f64, u32)>) {
        hits.clear();
        let line = Line {
            origin: ray.origin,
            dir: ray.dir,
            t_min: 0.0,
            t_max: f64::INFINITY,
        };
        let filter = Filter::new(ray.origin, ray.dir);
        self.candidates(line.is_valid(), &line, steps, |prim, _| {
            if !filter.certain_miss(&self.triangles.corners(prim)) {
                let hit = exact::hit(ray.origin, ray.dir, self.triangles.corners(prim));
                hits.extend(hit.filter(|h| h.t > 0.0).map(|h| (h.t, prim)));
            }
            ControlFlow::Continue(())
        });
        hits.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        hits.dedup();
    }
}
