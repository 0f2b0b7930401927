//! Brute force in f64: the definition of the right answer.
//!
//! Every triangle is tested with [`crate::exact`]. Cost: some 30 ns a triangle and ray. Tie-break: of hits at
//! equal f64 `t`, the smallest id wins.

use std::cmp::Ordering;

use glam::Vec3;

use crate::exact::{self, ExactHit};
use crate::{Accel, Hit, Light, Ray, Receiver, Triangles};

/// Tests every triangle.
#[derive(Clone, Copy, Debug)]
pub struct BruteForce<'a> {
    triangles: Triangles<'a>,
}

impl<'a> BruteForce<'a> {
    /// A caster over these triangles; nothing is built.
    pub fn new(triangles: Triangles<'a>) -> Self {
        Self { triangles }
    }

    pub(crate) fn triangles(&self) -> &Triangles<'a> {
        &self.triangles
    }

    /// All hits in the ray's range by ascending id, with their triangle ids.
    pub fn hits(&self, ray: &Ray) -> impl Iterator<Item = (u32, ExactHit)> + '_ {
        let ray = *ray;
        let count = if ray.is_valid() {
            self.triangles.len() as u32
        } else {
            0
        };
        (0..count).filter_map(move |prim| Some((prim, hit_in_range(&self.triangles, prim, &ray)?)))
    }

    /// The closest hit in f64, with its triangle id.
    pub fn closest(&self, ray: &Ray) -> Option<(u32, ExactHit)> {
        self.hits(ray)
            .reduce(|best, next| if next.1.t < best.1.t { next } else { best })
    }
}

/// The exact hit of one triangle if it lies in the ray's range.
#[inline]
pub fn hit_in_range(triangles: &Triangles, prim: u32, ray: &Ray) -> Option<ExactHit> {
    hit_corners(triangles.corners(prim), ray)
}

/// [`hit_in_range`] of a triangle with these corners.
#[inline]
pub(crate) fn hit_corners(corners: [Vec3; 3], ray: &Ray) -> Option<ExactHit> {
    if !corners.iter().all(|p| p.is_finite()) {
        return None;
    }
    exact::hit(ray.origin.as_dvec3(), ray.dir.as_dvec3(), corners)
        .filter(|h| h.t > f64::from(ray.t_min) && h.t <= f64::from(ray.t_max))
}

/// Rounds an exact hit to the public form.
pub(crate) fn rounded(prim: u32, hit: &ExactHit) -> Hit {
    Hit {
        t: hit.t as f32,
        u: hit.u as f32,
        v: hit.v as f32,
        prim,
    }
}

/// Sorts exact hits as [`Accel::all_hits`] promises and writes them out rounded.
pub(crate) fn write_sorted(mut found: Vec<(u32, ExactHit)>, hits: &mut Vec<Hit>) {
    // Not `total_cmp`: -0 and 0 tie. No `t` is NaN, since it lies in a range.
    found.sort_unstable_by(|(p, a), (q, b)| a.t.partial_cmp(&b.t).unwrap_or(Ordering::Equal).then(p.cmp(q)));
    hits.clear();
    hits.extend(found.iter().map(|(prim, hit)| rounded(*prim, hit)));
}

impl Accel for BruteForce<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.closest(ray).map(|(prim, hit)| rounded(prim, &hit))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.hits(ray).next().is_some()
    }

    fn all_hits(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        write_sorted(self.hits(ray).collect(), hits);
    }

    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool {
        (0..self.triangles.len() as u32).any(|prim| {
            self.triangles.corners(prim).iter().all(|p| p.is_finite())
                && exact::shadows(&self.triangles, prim, receiver, light)
        })
    }
}
