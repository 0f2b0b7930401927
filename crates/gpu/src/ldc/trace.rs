//! Tracing arrays of rays: `walk.wgsl` with `sampled.wgsl` or `exact.wgsl`.

use rayon::prelude::*;
use rayward_trace::exact;
use rayward_trace::ldc::HitTest;
use rayward_trace::{Accel, Bvh, Hit, Light, Ray, Receiver, SurfaceRay};

use super::layout::Query;
use super::shaders::{EXACT, SAMPLED};
use super::{Cube, TraceStats};
use crate::Result;
use crate::batch::{HIT, Line, QUERY, SurfaceHit, Traced};

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
        let query = Query {
            test: kind,
            tolerance,
            ..QUERY
        };
        let answers = self.sampled().trace(rays.len(), |i| Line::of(&rays[i]), query)?;
        let hits = (0..rays.len())
            .into_par_iter()
            .map(|i| {
                let (found, prepared) = (&answers.found[i], &answers.prepared[i]);
                let t = prepared.start + f64::from(found.t) / prepared.scale;
                (answers.state(i) == HIT).then(|| self.sampled_hit(&rays[i], t, found.prim))
            })
            .collect();
        Ok((hits, answers.stats()))
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
        let b = &self.buffers;
        traced.bindings.extend([(1, &b.positions), (2, &b.indices)]);
        Traced {
            program: &EXACT,
            entry: "trace_exact",
            ..traced
        }
    }

    fn sampled(&self) -> Traced<'_> {
        let b = &self.buffers;
        Traced {
            gpu: self.gpu,
            triangles: self.triangles,
            frame: self.frame,
            empty: self.samples == 0,
            complete: self.complete,
            program: &SAMPLED,
            entry: "trace_sampled",
            bindings: vec![(0, &b.frame), (3, &b.starts), (4, &b.samples), (5, &b.cells)],
        }
    }
}
