//! Tracing arrays of rays: `walk.wgsl` with `sampled.wgsl` or `exact.wgsl`.

use rayon::prelude::*;
use rayward_trace::exact;
use rayward_trace::ldc::HitTest;
use rayward_trace::{Accel, Bvh, Hit, Light, Ray, Receiver, SurfaceRay, ViewRay};

use super::shaders::{EXACT, SAMPLED};
use super::{Cube, Stacks, TraceStats};
use crate::Result;
use crate::batch::{Asked, HIT, Line, Structure, SurfaceHit, Traced};

impl Cube<'_> {
    /// The closest hits, equal to [`rayward_trace::BruteForce`]'s bit for bit. `cpu`, over the same triangles, is
    /// asked about rays that f32 cannot answer; of a cube without conservative coverage that is all of them.
    ///
    /// # Errors
    /// Those of the device.
    pub fn closest(&self, rays: &[Ray], cpu: &impl Accel) -> Result<(Vec<Option<Hit>>, TraceStats)> {
        self.exact().closest(rays, cpu)
    }

    /// The first triangles that rays meet after they left their surfaces: [`Bvh::after`] of arrays, bit for bit.
    ///
    /// # Errors
    /// Those of the device.
    pub fn after(&self, rays: &[SurfaceRay], cpu: &Bvh) -> Result<(Vec<SurfaceHit>, TraceStats)> {
        self.exact().after(rays, cpu)
    }

    /// The first triangle in front of the start of each ray.
    ///
    /// # Errors
    /// Those of the device.
    pub fn seen(&self, rays: &[ViewRay], cpu: &Bvh) -> Result<(Vec<Option<u32>>, TraceStats)> {
        self.exact().seen(rays, cpu)
    }

    /// Whether some triangle lies between each receiver and its light: [`Accel::shadowed`] of arrays.
    ///
    /// # Errors
    /// Those of the device.
    pub fn shadowed(
        &self,
        queries: &[(Receiver, Light)],
        cpu: &impl Accel,
    ) -> Result<(Vec<bool>, TraceStats)> {
        self.exact().shadowed(queries, cpu)
    }

    /// The nearest hits by the samples alone: [`rayward_trace::Ldc::closest_sampled`] of arrays, but for rounding.
    pub fn closest_sampled(&self, rays: &[Ray], test: HitTest) -> Result<(Vec<Option<Hit>>, TraceStats)> {
        let (kind, tolerance) = match test {
            HitTest::Strict { tolerance } => (0, tolerance),
            HitTest::Interval { tolerance } => (1, tolerance),
            HitTest::Plane { margin } => (2, margin),
        };
        let asked = Asked::Sample(kind, tolerance);
        let answers = self.sampled().trace(rays.len(), |i| Line::of(&rays[i]), asked)?;
        let hits = answers.each.par_iter().zip(rays).map(|(answer, ray)| {
            (answer.state == HIT).then(|| self.sampled_hit(ray, answer.hit.t, answer.prim))
        });
        Ok((hits.collect(), answers.stats()))
    }

    /// The hit of a sample, moved into its triangle.
    fn sampled_hit(&self, ray: &Ray, t: f64, prim: u32) -> Hit {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let at = exact::attributes(origin, dir, self.triangles.corners(prim));
        let (u, v) = at.map_or((0.0, 0.0), |a| (a.u.clamp(0.0, 1.0), a.v.clamp(0.0, 1.0)));
        Hit {
            t: t as f32,
            u: u as f32,
            v: v.min(1.0 - u) as f32,
            prim,
        }
    }

    fn exact(&self) -> Traced<'_> {
        let mut traced = self.sampled();
        for (structure, stacks) in traced.structures.iter_mut().zip(&self.stacks) {
            let b = &stacks.buffers;
            structure.bindings.extend([(1, &b.positions), (2, &b.indices)]);
        }
        Traced {
            program: &EXACT,
            ..traced
        }
    }

    fn sampled(&self) -> Traced<'_> {
        Traced {
            gpu: self.gpu,
            triangles: self.triangles,
            program: &SAMPLED,
            structures: self.stacks.iter().map(|stacks| structure(stacks)).collect(),
        }
    }
}

/// Stacks without the triangles that exact answers need.
fn structure(stacks: &Stacks) -> Structure<'_> {
    let b = &stacks.buffers;
    Structure {
        frame: stacks.frame,
        empty: stacks.samples == 0,
        complete: stacks.complete,
        bindings: vec![(0, &b.frame), (3, &b.starts), (4, &b.samples), (5, &b.cells)],
        placing: None,
    }
}
