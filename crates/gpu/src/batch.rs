//! Arrays of rays to answers, whatever structure on the device traces them.
//!
//! Rays are clipped to the cube's frame in f64 here and rounded once. What comes back of an exact query is a triangle that
//! is certainly hit first, the certainty that there is none, or neither; parameters are then computed from the triangle
//! as [`trace::exact`](rayward_trace::exact) does, and what is unsure is asked of a structure on the CPU.
//!
//! Where there are two structures, of what stands still and of what moves, rays pass through one after the other, ended
//! by what they met in the first; which of two hits is the nearer is decided in f64.

use glam::DVec3;
use rayon::prelude::*;
use rayward_trace::exact::{self, ExactHit};
use rayward_trace::ldc::{Clipped, CubeFrame, StepCounts};
use rayward_trace::{Accel, Bvh, Hit, Light, Ray, Receiver, SurfaceRay, Triangles, View, ViewRay};
use wgpu::Buffer;

use crate::grid::Place;
use crate::ldc::TraceStats;
use crate::ldc::layout::{Found, Query, TexelRay};
use crate::ldc::shaders::Program;
use crate::{Gpu, Result};

/// Rays of one submission: few enough that no driver takes it for a hang.
const BATCH: usize = 1 << 17;
/// States of `query.wgsl`.
const MISS: u32 = 0;
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

    /// The line of an eye ray.
    fn seen(ray: &ViewRay) -> Self {
        let (origin, dir) = (ray.origin, ray.dir);
        Self {
            origin,
            dir,
            range: [0.0, f64::INFINITY],
            skip: u32::MAX,
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
struct Prepared {
    ray: TexelRay,
    start: f64,
    /// Texels for a unit of the ray's own parameter.
    scale: f64,
    too_far: bool,
}

/// What one ray was answered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    pub(crate) state: u32,
    pub(crate) prim: u32,
    /// Where, unless any hit will do; of hits by samples without its place in the triangle.
    pub(crate) hit: ExactHit,
}

impl Answer {
    const MISS: Self = Self {
        state: MISS,
        prim: u32::MAX,
        hit: ExactHit {
            t: f64::INFINITY,
            u: 0.0,
            v: 0.0,
        },
    };

    /// That of both structures.
    fn joined(self, other: Self, any: bool) -> Self {
        let sure = |a: Self| a.state == HIT && any;
        if self.state == MISS || sure(other) {
            return other;
        }
        if other.state == MISS || sure(self) || self.state == UNSURE {
            return self;
        }
        let nearer = other.hit.t < self.hit.t || (other.hit.t == self.hit.t && other.prim < self.prim);
        if other.state == UNSURE || nearer {
            other
        } else {
            self
        }
    }

    /// Whether nothing else can change it.
    fn is_final(&self, any: bool) -> bool {
        self.state == if any { HIT } else { UNSURE }
    }
}

/// What an array of rays was answered.
pub(crate) struct Answers {
    pub(crate) each: Vec<Answer>,
    steps: StepCounts,
}

impl Answers {
    pub(crate) fn stats(&self) -> TraceStats {
        TraceStats {
            rays: self.each.len(),
            unsure: self.each.iter().filter(|a| a.state == UNSURE).count(),
            steps: self.steps,
        }
    }
}

/// What is asked of the structures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Asked {
    /// The first triangle.
    Closest,
    /// Whether there is any.
    Any,
    /// The first sample, by a hit test's number and tolerance.
    Sample(u32, f32),
}

impl Asked {
    fn query(self, rays: usize) -> Query {
        let (test, tolerance) = match self {
            Self::Sample(test, tolerance) => (test, tolerance),
            _ => (0, 0.0),
        };
        Query {
            rays: rays as u32,
            test,
            tolerance,
            any: u32::from(self == Self::Any),
        }
    }
}

/// A structure in the device's memory.
pub(crate) struct Structure<'c> {
    pub(crate) frame: CubeFrame,
    /// Whether there is nothing in it.
    pub(crate) empty: bool,
    /// Whether its exact answers can be certain.
    pub(crate) complete: bool,
    /// Its buffers; those of rays, answers and query are added for each batch.
    pub(crate) bindings: Vec<(u32, &'c Buffer)>,
    /// What tells the place of a ray, by its number, in structures that rays do not walk through.
    pub(crate) placing: Option<&'c Placing<'c>>,
}

/// Tells the place of the ray of a number: its cell, its view.
pub(crate) type Placing<'c> = dyn Fn(usize) -> Option<(u32, &'c View)> + Sync + 'c;

/// One structure or two, and the program that traces rays through them.
pub(crate) struct Traced<'c> {
    pub(crate) gpu: &'c Gpu,
    pub(crate) triangles: Triangles<'c>,
    pub(crate) program: &'static Program,
    pub(crate) structures: Vec<Structure<'c>>,
}

impl Traced<'_> {
    /// The closest hits.
    pub(crate) fn closest(&self, rays: &[Ray], cpu: &impl Accel) -> Result<(Vec<Option<Hit>>, TraceStats)> {
        let answers = self.trace(rays.len(), |i| Line::of(&rays[i]), Asked::Closest)?;
        let hits = answers
            .each
            .par_iter()
            .zip(rays)
            .map(|(answer, ray)| match answer.state {
                UNSURE => cpu.intersect(ray),
                HIT => Some(Hit {
                    t: answer.hit.t as f32,
                    u: answer.hit.u as f32,
                    v: answer.hit.v as f32,
                    prim: answer.prim,
                }),
                _ => None,
            });
        Ok((hits.collect(), answers.stats()))
    }

    /// The first triangles that rays meet after they left their surfaces.
    pub(crate) fn after(&self, rays: &[SurfaceRay], cpu: &Bvh) -> Result<(Vec<SurfaceHit>, TraceStats)> {
        let answers = self.trace(rays.len(), |i| Line::after(&rays[i]), Asked::Closest)?;
        let hits = answers
            .each
            .par_iter()
            .zip(rays)
            .map(|(answer, ray)| match answer.state {
                UNSURE => cpu.after(ray, &mut ()),
                HIT => Some((answer.prim, answer.hit)),
                _ => None,
            });
        Ok((hits.collect(), answers.stats()))
    }

    /// The first triangle in front of the start of each ray.
    pub(crate) fn seen(&self, rays: &[ViewRay], cpu: &Bvh) -> Result<(Vec<Option<u32>>, TraceStats)> {
        let answers = self.trace(rays.len(), |i| Line::seen(&rays[i]), Asked::Closest)?;
        let asked = answers.each.par_iter().zip(rays);
        let seen = asked.map_init(Vec::new, |hits, (answer, ray)| match answer.state {
            UNSURE => {
                cpu.along(ray, &mut (), hits);
                hits.first().map(|&(_, prim)| prim)
            }
            state => (state == HIT).then_some(answer.prim),
        });
        Ok((seen.collect(), answers.stats()))
    }

    /// Whether some triangle lies between each receiver and its light.
    pub(crate) fn shadowed(
        &self,
        queries: &[(Receiver, Light)],
        cpu: &impl Accel,
    ) -> Result<(Vec<bool>, TraceStats)> {
        let line = |i: usize| Line::between(&queries[i].0, &queries[i].1);
        let answers = self.trace(queries.len(), line, Asked::Any)?;
        let asked = answers.each.par_iter().zip(queries);
        let shadowed = asked.map(|(answer, (receiver, light))| match answer.state {
            UNSURE => cpu.shadowed(receiver, light),
            state => state == HIT,
        });
        Ok((shadowed.collect(), answers.stats()))
    }

    /// What one structure says of a ray.
    fn answer(
        &self,
        structure: &Structure,
        line: &Line,
        prepared: &Prepared,
        found: &Found,
        asked: Asked,
    ) -> Answer {
        let unsure = Answer {
            state: UNSURE,
            ..Answer::MISS
        };
        let sampled = matches!(asked, Asked::Sample(..));
        if prepared.too_far || !(structure.complete || sampled) || found.state == UNSURE {
            return unsure;
        }
        if found.state != HIT {
            return Answer::MISS;
        }
        let hit = match asked {
            Asked::Any => Some(Answer::MISS.hit),
            Asked::Closest => exact::attributes(line.origin, line.dir, self.triangles.corners(found.prim)),
            Asked::Sample(..) => Some(ExactHit {
                t: prepared.start + f64::from(found.t) / prepared.scale,
                ..Answer::MISS.hit
            }),
        };
        hit.map_or(unsure, |hit| Answer {
            state: HIT,
            prim: found.prim,
            hit,
        })
    }
}

impl Structure<'_> {
    /// Places of a batch's rays, the first of which has this number. A ray without a place has no way left, and no answer.
    fn places(&self, first: usize, lines: &[Line], batch: &mut [Prepared]) -> Vec<Place> {
        let Some(placing) = self.placing else {
            return Vec::new();
        };
        let asked = batch.par_iter_mut().zip(lines).enumerate();
        let place = |(i, (prepared, line)): (usize, (&mut Prepared, &Line))| {
            if prepared.ray.end < 0.0 {
                return Place::default();
            }
            let Some((cell, view)) = placing(first + i) else {
                prepared.ray.end = -1.0;
                prepared.too_far = true;
                return Place::default();
            };
            let start = line.origin + line.dir * prepared.start - view.center.as_dvec3();
            Place {
                cell,
                depth: start.dot(view.forward) as f32,
                rate: (line.dir.dot(view.forward) / prepared.scale) as f32,
                pad: 0,
            }
        };
        asked.map(place).collect()
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
}

impl Traced<'_> {
    /// Answers of all rays, in batches.
    pub(crate) fn trace(
        &self,
        count: usize,
        line: impl Fn(usize) -> Line + Sync,
        asked: Asked,
    ) -> Result<Answers> {
        let mut answers = Answers {
            each: Vec::with_capacity(count),
            steps: StepCounts::default(),
        };
        let any = asked == Asked::Any;
        for first in (0..count).step_by(BATCH) {
            let mut batch = vec![Answer::MISS; BATCH.min(count - first)];
            for structure in &self.structures {
                // Rays that are answered already have no way left.
                let lines: Vec<Line> = batch
                    .par_iter()
                    .enumerate()
                    .map(|(i, answer)| {
                        let line = line(first + i);
                        Line {
                            range: [line.range[0], line.range[1].min(beyond(answer.hit.t))],
                            valid: line.valid && !answer.is_final(any),
                            ..line
                        }
                    })
                    .collect();
                let mut prepared: Vec<Prepared> =
                    lines.par_iter().map(|line| structure.prepare(line)).collect();
                let places = structure.places(first, &lines, &mut prepared);
                let found = self.trace_batch(structure, &prepared, &places, asked)?;
                for f in &found {
                    answers.steps.cells += u64::from(f.cells);
                    answers.steps.texels += u64::from(f.texels);
                    answers.steps.samples += u64::from(f.samples);
                    answers.steps.triangles += u64::from(f.triangles);
                }
                let asked_of = lines.par_iter().zip(&prepared).zip(&found);
                batch = std::mem::take(&mut batch)
                    .into_par_iter()
                    .zip(asked_of)
                    .map(|(answer, ((line, prepared), found))| {
                        if answer.is_final(any) {
                            return answer;
                        }
                        answer.joined(self.answer(structure, line, prepared, found, asked), any)
                    })
                    .collect();
            }
            answers.each.extend(batch);
        }
        Ok(answers)
    }

    fn trace_batch(
        &self,
        structure: &Structure,
        batch: &[Prepared],
        places: &[Place],
        asked: Asked,
    ) -> Result<Vec<Found>> {
        let gpu = self.gpu;
        let rays: Vec<TexelRay> = batch.iter().map(|p| p.ray).collect();
        let query = gpu.uniform("a batch of rays", &asked.query(rays.len()))?;
        let rays = gpu.uploaded("rays", &rays)?;
        let found = gpu.storage("hits", (size_of::<Found>() * batch.len()) as u64)?;
        let mut bindings = structure.bindings.clone();
        bindings.extend([(6, &rays), (7, &found), (8, &query)]);
        let placed;
        if structure.placing.is_some() {
            placed = gpu.uploaded("places of rays", places)?;
            bindings.push((9, &placed));
        }
        let groups = (batch.len() as u64).div_ceil(64);
        gpu.dispatch(self.program, "trace", &bindings, groups)?;
        gpu.read(&found, 0, batch.len() as u64)
    }
}

/// An end of a ray beyond the error of a hit's parameter.
fn beyond(t: f64) -> f64 {
    t + t.abs() * (1.0 / (1u64 << 20) as f64)
}
