//! From "which triangles may this ray meet" to all answers about rays.
//!
//! A grid only proposes triangles; which of them a ray meets, which hit is the closest and which triangle lies between
//! a receiver and a light is decided here, once, by [`crate::exact`], after a filter in f64 has dropped those that are
//! certainly missed: nearly all.

use std::ops::ControlFlow;

use glam::Vec3;

use crate::brute::{hit_corners, rounded, write_sorted};
use crate::exact::{self, ExactHit, Filter};
use crate::grid3::RaySpan;
use crate::{Count, Hit, Light, Ray, Receiver, ViewRay};

/// A structure that proposes triangles to a ray.
pub trait Candidates: Sync {
    /// The corners of a triangle.
    fn corners(&self, prim: u32) -> [Vec3; 3];

    /// Calls `visit` with every triangle that the ray may meet with a parameter in `range`, roughly front to back and
    /// possibly more than once, until it breaks. `visit` may shorten the ray's span.
    fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()>;

    /// Whether triangles that are certainly missed may be dropped before the exact decision: not where that is to be
    /// checked.
    fn is_filtered(&self) -> bool {
        true
    }

    /// The closest hit in f64, with its triangle id.
    fn closest(&self, ray: &Ray, count: &mut impl Count) -> Option<(u32, ExactHit)> {
        let mut best: Option<(u32, ExactHit)> = None;
        let _ = each_hit(self, ray, count, |prim, hit, span| {
            if best.is_none_or(|(other, b)| hit.t < b.t || (hit.t == b.t && prim < other)) {
                best = Some((prim, hit));
                span.shorten(hit.t);
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// Whether there is any hit.
    fn any(&self, ray: &Ray, count: &mut impl Count) -> bool {
        each_hit(self, ray, count, |_, _, _| ControlFlow::Break(())).is_break()
    }

    /// Replaces `hits` by all hits in f64 with their triangle ids, each triangle once, in no order.
    fn every(&self, ray: &Ray, count: &mut impl Count, hits: &mut Vec<(u32, ExactHit)>) {
        hits.clear();
        let _ = each_hit(self, ray, count, |prim, hit, _| {
            hits.push((prim, hit));
            ControlFlow::Continue(())
        });
        hits.sort_unstable_by_key(|(prim, _)| *prim);
        hits.dedup_by_key(|(prim, _)| *prim);
    }

    /// Whether some triangle other than the receiver's own lies between it and the light.
    fn shadows(&self, receiver: &Receiver, light: &Light, count: &mut impl Count) -> bool {
        let Some((ray, range)) = shadow_ray(receiver, light) else {
            return false;
        };
        let filter = filter_of(self, &ray);
        let visit = |prim: u32, _: &mut RaySpan| {
            if prim != receiver.prim && blocks(self.corners(prim), filter.as_ref(), receiver, light) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        self.each_candidate(&ray, range, count, visit).is_break()
    }

    /// Replaces `prims` by all triangles that lie between a receiver and a light, ascending.
    fn blockers(&self, receiver: &Receiver, light: &Light, count: &mut impl Count, prims: &mut Vec<u32>) {
        prims.clear();
        let Some((ray, range)) = shadow_ray(receiver, light) else {
            return;
        };
        let filter = filter_of(self, &ray);
        let _ = self.each_candidate(&ray, range, count, |prim, _| {
            if prim != receiver.prim && blocks(self.corners(prim), filter.as_ref(), receiver, light) {
                prims.push(prim);
            }
            ControlFlow::Continue(())
        });
        prims.sort_unstable();
        prims.dedup();
    }
}

fn filter_of<C: Candidates + ?Sized>(candidates: &C, ray: &ViewRay) -> Option<Filter> {
    candidates.is_filtered().then(|| Filter::new(ray.origin, ray.dir))
}

/// Whether a triangle with these corners lies between a receiver that is not on it and a light.
#[inline]
fn blocks(corners: [Vec3; 3], filter: Option<&Filter>, receiver: &Receiver, light: &Light) -> bool {
    !filter.is_some_and(|filter| filter.certain_miss(&corners))
        && corners.iter().all(|p| p.is_finite())
        && exact::blocks(corners, receiver, light)
}

/// The ray that [`exact::shadows`] sends, and its range. A negative error bound lets crossings behind either end count.
pub(crate) fn shadow_ray(receiver: &Receiver, light: &Light) -> Option<(ViewRay, [f64; 2])> {
    let beyond = if receiver.error >= 0.0 { 0.0 } else { f64::INFINITY };
    let (origin, dir, range) = match *light {
        Light::Point(position) => {
            let origin = position.as_dvec3();
            (origin, receiver.point - origin, [0.0, 1.0 + beyond])
        }
        Light::Directional(direction) => (receiver.point, direction.as_dvec3(), [-beyond, f64::INFINITY]),
    };
    let usable = origin.is_finite() && dir.is_finite();
    usable.then_some((ViewRay { origin, dir }, range))
}

fn each_hit<C: Candidates + ?Sized>(
    candidates: &C,
    ray: &Ray,
    count: &mut impl Count,
    mut visit: impl FnMut(u32, ExactHit, &mut RaySpan) -> ControlFlow<()>,
) -> ControlFlow<()> {
    if !ray.is_valid() {
        return ControlFlow::Continue(());
    }
    let line = ViewRay {
        origin: ray.origin.as_dvec3(),
        dir: ray.dir.as_dvec3(),
    };
    let range = [f64::from(ray.t_min), f64::from(ray.t_max)];
    let filter = filter_of(candidates, &line);
    candidates.each_candidate(&line, range, count, |prim, span| {
        let corners = candidates.corners(prim);
        if filter
            .as_ref()
            .is_some_and(|filter| filter.certain_miss(&corners))
        {
            return ControlFlow::Continue(());
        }
        match hit_corners(corners, ray) {
            Some(hit) => visit(prim, hit, span),
            None => ControlFlow::Continue(()),
        }
    })
}

/// [`crate::Accel::intersect`].
pub(crate) fn intersect(candidates: &impl Candidates, ray: &Ray) -> Option<Hit> {
    candidates
        .closest(ray, &mut ())
        .map(|(prim, hit)| rounded(prim, &hit))
}

/// [`crate::Accel::all_hits`].
pub(crate) fn all_hits(candidates: &impl Candidates, ray: &Ray, hits: &mut Vec<Hit>) {
    let mut found = Vec::new();
    candidates.every(ray, &mut (), &mut found);
    write_sorted(found, hits);
}
