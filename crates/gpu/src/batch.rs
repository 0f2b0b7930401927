//! Arrays of rays to answers, whatever structure on the device traces them.
//!
//! Rays are clipped to the cube's frame in f64 here and rounded once. What comes back of an exact query is a triangle that
//! is certainly hit first, the certainty that there is none, or neither; parameters are then computed from the triangle
//! as [`trace::exact`](rayward_trace::exact) does, and what is unsure is asked of a structure on the CPU.

use glam::DVec3;
use rayon::prelude::*;
use rayward_trace::exact::{self, ExactHit};
use rayward_trace::ldc::{Clipped, CubeFrame, StepCounts};
use rayward_trace::{Accel, Bvh, Hit, Light, Ray, Receiver, SurfaceRay, Triangles};
use wgpu::Buffer;

use crate::ldc::TraceStats;
use crate::ldc::layout::{Found, Query, TexelRay};
use crate::ldc::shaders::Program;
use crate::{Gpu, Result};

/// Rays of one submission: few enough that no driver takes it for a hang.
const BATCH: usize = 1 << 17;
/// States of `query.wgsl`.
pub(crate) const HIT: u32 = 1;
const UNSURE: u32 = 2;
/// Stands for no end in a shader.
const FAR: f64 = 1e30;

/// The first triangle that a ray meets, and where.
pub(crate) type SurfaceHit = Option<(u32, ExactHit)>;

/// A line whose triangles are asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    origin: DVec3,
    dir: DVec3,
    range: [f64; 2],
    skip: u32,
    valid: bool,
}

impl Line {
    pub(crate) fn of(ray: &Ray) -> Self {
        Self {
            origin: ray.origin.as_dvec3(),
            dir: ray.dir.as_dvec3(),
            range: [f64::from(ray.t_min), f64::from(ray.t_max)],
            skip: u32::MAX,
            valid: ray.is_valid(),
        }
    }

    /// The line that [`SurfaceRay::meets`] tests.
    fn after(ray: &SurfaceRay) -> Self {
        let (origin, dir) = (ray.from.point, ray.dir.as_dvec3());
        Self {
            origin,
            dir,
            range: [ray.from.error / dir.length(), f64::INFINITY],
            skip: ray.from.prim,
            valid: origin.is_finite() && dir.is_finite() && dir != DVec3::ZERO,
        }
    }

    /// The line that `exact::blocks` tests.
    fn between(receiver: &Receiver, light: &Light) -> Self {
        let (origin, dir, range) = match *light {
            Light::Point(position) => {
                let origin = position.as_dvec3();
                let dir = receiver.point - origin;
                (origin, dir, [0.0, 1.0 - receiver.error / dir.length()])
            }
            Light::Directional(direction) => {
                let dir = direction.as_dvec3();
                (
                    receiver.point,
                    dir,
                    [receiver.error / dir.length(), f64::INFINITY],
                )
            }
        };
        Self {
            origin,
            dir,
            range,
            skip: receiver.prim,
            valid: origin.is_finite() && dir.is_finite() && dir != DVec3::ZERO,
        }
    }
}

/// A ray as the shader takes it, and what turns its parameters back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prepared {
    ray: TexelRay,
    pub(crate) start: f64,
    /// Texels for a unit of the ray's own parameter.
    pub(crate) scale: f64,
    too_far: bool,
}

/// What a batch was answered.
pub(crate) struct Answers {
    pub(crate) found: Vec<Found>,
    pub(crate) prepared: Vec<Prepared>,
    steps: StepCounts,
}

impl Answers {
    fn new(count: usize) -> Self {
        Self {
            found: Vec::with_capacity(count),
            prepared: Vec::with_capacity(count),
            steps: StepCounts::default(),
        }
    }

    /// State of the `i`-th answer.
    pub(crate) fn state(&self, i: usize) -> u32 {
        if self.prepared[i].too_far {
            UNSURE
        } else {
            self.found[i].state
        }
    }

    pub(crate) fn stats(&self) -> TraceStats {
        TraceStats {
            rays: self.found.len(),
            unsure: (0..self.found.len()).filter(|&i| self.state(i) == UNSURE).count(),
            steps: self.steps,
        }
    }
}

/// A structure in the device's memory, and the entry point that traces rays through it.
pub(crate) struct Traced<'c> {
    pub(crate) gpu: &'c Gpu,
    pub(crate) triangles: Triangles<'c>,
    pub(crate) frame: CubeFrame,
    /// Whether there is nothing in it.
    pub(crate) empty: bool,
    /// Whether its exact answers can be certain.
    pub(crate) complete: bool,
    pub(crate) program: &'static Program,
    pub(crate) entry: &'static str,
    /// Buffers of the structure; those of rays, answers and query are added for each batch.
    pub(crate) bindings: Vec<(u32, &'c Buffer)>,
}

impl Traced<'_> {
    /// The closest hits.
    pub(crate) fn closest(&self, rays: &[Ray], cpu: &impl Accel) -> Result<(Vec<Option<Hit>>, TraceStats)> {
        let answers = self.trace(rays.len(), |i| Line::of(&rays[i]), QUERY)?;
        let hits = (0..rays.len())
            .into_par_iter()
            .map(|i| match self.certain(&answers, i) {
                UNSURE => cpu.intersect(&rays[i]),
                HIT => self.hit(&rays[i], answers.found[i].prim),
                _ => None,
            })
            .collect();
        Ok((hits, self.stats_of(&answers)))
    }

    /// The first triangles that rays meet after they left their surfaces.
    pub(crate) fn after(&self, rays: &[SurfaceRay], cpu: &Bvh) -> Result<(Vec<SurfaceHit>, TraceStats)> {
        let answers = self.trace(rays.len(), |i| Line::after(&rays[i]), QUERY)?;
        let hits = (0..rays.len())
            .into_par_iter()
            .map(|i| match self.certain(&answers, i) {
                UNSURE => cpu.after(&rays[i], &mut ()),
                HIT => {
                    let prim = answers.found[i].prim;
                    let (origin, dir) = (rays[i].from.point, rays[i].dir.as_dvec3());
                    let hit = exact::attributes(origin, dir, self.triangles.corners(prim))?;
                    Some((prim, hit))
                }
                _ => None,
            })
            .collect();
        Ok((hits, self.stats_of(&answers)))
    }

    /// Whether some triangle lies between each receiver and its light.
    pub(crate) fn shadowed(
        &self,
        queries: &[(Receiver, Light)],
        cpu: &impl Accel,
    ) -> Result<(Vec<bool>, TraceStats)> {
        let any = Query { any: 1, ..QUERY };
        let line = |i: usize| Line::between(&queries[i].0, &queries[i].1);
        let answers = self.trace(queries.len(), line, any)?;
        let shadowed = (0..queries.len())
            .into_par_iter()
            .map(|i| match self.certain(&answers, i) {
                UNSURE => cpu.shadowed(&queries[i].0, &queries[i].1),
                state => state == HIT,
            })
            .collect();
        Ok((shadowed, self.stats_of(&answers)))
    }

    /// What is certain of an exact answer.
    fn certain(&self, answers: &Answers, i: usize) -> u32 {
        if self.complete { answers.state(i) } else { UNSURE }
    }

    fn stats_of(&self, answers: &Answers) -> TraceStats {
        let stats = answers.stats();
        TraceStats {
            unsure: if self.complete { stats.unsure } else { stats.rays },
            ..stats
        }
    }

    /// The hit of a triangle that is certainly hit.
    fn hit(&self, ray: &Ray, prim: u32) -> Option<Hit> {
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let at = exact::attributes(origin, dir, self.triangles.corners(prim))?;
        Some(Hit {
            t: at.t as f32,
            u: at.u as f32,
            v: at.v as f32,
            prim,
        })
    }

    fn prepare(&self, line: &Line) -> Prepared {
        let missing = Prepared {
            ray: TexelRay {
                origin: [0.0; 3],
                end: -1.0,
                dir: [0.0, 0.0, 1.0],
                t_min: 0.0,
                t_max: 0.0,
                before: 0.0,
                skip: u32::MAX,
                pad: 0,
            },
            start: 0.0,
            scale: 1.0,
            too_far: false,
        };
        if !line.valid || self.empty {
            return missing;
        }
        let [t_min, t_max] = line.range;
        let inside = match self.frame.clip(line.origin, line.dir, t_min, t_max) {
            Clipped::Inside(inside) => inside,
            Clipped::Misses => return missing,
            Clipped::TooFar => {
                return Prepared {
                    too_far: true,
                    ..missing
                };
            }
        };
        let scale = inside.dir.abs().max_element();
        let along = |t: f64| ((t - inside.t_min) * scale).clamp(-FAR, FAR);
        let origin = inside.origin + inside.dir * inside.t_min;
        let end = along(inside.t_max);
        Prepared {
            ray: TexelRay {
                origin: origin.as_vec3().to_array(),
                // Beyond the rounding of what lies at the end.
                end: (end * (1.0 + 1e-6) + 1e-3) as f32,
                dir: (inside.dir / scale).as_vec3().to_array(),
                t_min: along(t_min) as f32,
                t_max: along(t_max) as f32,
                before: (inside.t_min.abs() * scale) as f32,
                skip: line.skip,
                pad: 0,
            },
            start: inside.t_min,
            scale,
            too_far: false,
        }
    }

    /// Answers of all rays, in batches.
    pub(crate) fn trace(
        &self,
        count: usize,
        line: impl Fn(usize) -> Line + Sync,
        query: Query,
    ) -> Result<Answers> {
        let mut answers = Answers::new(count);
        for first in (0..count).step_by(BATCH) {
            let batch: Vec<Prepared> = (first..count.min(first + BATCH))
                .into_par_iter()
                .map(|i| self.prepare(&line(i)))
                .collect();
            let found = self.trace_batch(&batch, query)?;
            for f in &found {
                answers.steps.cells += u64::from(f.cells);
                answers.steps.texels += u64::from(f.texels);
                answers.steps.samples += u64::from(f.samples);
                answers.steps.triangles += u64::from(f.triangles);
            }
            answers.found.extend(found);
            answers.prepared.extend(batch);
        }
        Ok(answers)
    }

    fn trace_batch(&self, batch: &[Prepared], query: Query) -> Result<Vec<Found>> {
        let gpu = self.gpu;
        let rays: Vec<TexelRay> = batch.iter().map(|p| p.ray).collect();
        let query = Query {
            rays: rays.len() as u32,
            ..query
        };
        let query = gpu.uniform("a batch of rays", &query)?;
        let rays = gpu.uploaded("rays", &rays)?;
        let found = gpu.storage("hits", (size_of::<Found>() * batch.len()) as u64)?;
        let mut bindings = self.bindings.clone();
        bindings.extend([(6, &rays), (7, &found), (8, &query)]);
        let groups = (batch.len() as u64).div_ceil(64);
        gpu.dispatch(self.program, self.entry, &bindings, groups)?;
        gpu.read(&found, 0, batch.len() as u64)
    }
}

/// A query for closest hits.
pub(crate) const QUERY: Query = Query {
    rays: 0,
    test: 0,
    tolerance: 0.0,
    any: 0,
};
