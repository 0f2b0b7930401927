//! Hits of samples, without their triangles: the tests that VMV07 uses, and one on the sample's plane.
//!
//! | test | a sample is hit if | the hit |
//! |---|---|---|
//! | `Strict` | the point halfway through its texel is nearer than the tolerance (VMV07, as written) | that point |
//! | `Interval` | its depth is within the tolerance of the ray's depths in its texel | where depths are equal |
//! | `Plane` | the ray crosses its plane over its texel, widened by a margin | the crossing |
//!
//! Lengths are in texels. VMV07's 0.001 of the scene's size is 1 texel at a resolution of 1000. With centre coverage
//! slivers that cover no centre are missed by all of them.

use std::ops::ControlFlow;

use glam::Vec3;

use super::build::Stack;
use super::frame::{Clipped, TexelRay};
use super::raster::NO_PLANE;
use super::samples::{Depth, Layers, Samples};
use super::walk::{Reach, Segment, Steps, walk};
use super::{Cube, Ldc, PLANE_REACH, axis_order};
use crate::exact;
use crate::{Hit, Ray};

/// When a ray hits a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HitTest {
    /// The ray's point at the middle of its way through the texel is nearer than this to the sample, in texels.
    Strict {
        /// Largest distance.
        tolerance: f32,
    },
    /// The sample's depth is among the ray's depths over the texel, or this near to them, in texels.
    Interval {
        /// Largest difference.
        tolerance: f32,
    },
    /// The ray crosses the sample's plane over the texel, or this far outside of it, in texels.
    Plane {
        /// How far the plane reaches beyond its texel. Slopes are known to 1/254, so that planes of neighbouring
        /// texels do not quite join: below 1/4, grazing rays slip through now and then.
        margin: f32,
    },
}

impl HitTest {
    /// The paper's 0.001 of the scene's longest side as a tolerance in texels.
    pub fn paper_tolerance(resolution: u32) -> f32 {
        0.001 * resolution as f32
    }

    /// How far from its depth a sample may be hit. `steepness`: change of the ray's depth over a texel across.
    fn reach(self, steepness: f32) -> Reach {
        match self {
            Self::Strict { tolerance } | Self::Interval { tolerance } => Reach {
                cell: tolerance,
                texel: tolerance,
                sample: tolerance + 1.0 / 64.0,
            },
            // Its slopes are at most 1 either way, and beyond the texel the ray has other depths.
            Self::Plane { margin } => {
                let beyond = margin * (2.0 + 1.01 * steepness);
                Reach {
                    cell: 2.0 * margin,
                    texel: beyond,
                    sample: PLANE_REACH + beyond,
                }
            }
        }
    }

    /// Parameter at which a sample is hit.
    #[inline(always)]
    fn hit(self, segment: &Segment, depth: f32, slopes: [i8; 2], lateral: f64) -> Option<f64> {
        let [t0, t1] = segment.t;
        match self {
            Self::Strict { tolerance } => {
                let middle = |ends: [f32; 2]| (ends[0] + ends[1]) * 0.5;
                let offset = Vec3::new(middle(segment.u), middle(segment.v), middle(segment.w) - depth);
                (offset.length_squared() < tolerance * tolerance).then_some((t0 + t1) * 0.5)
            }
            Self::Interval { tolerance } => {
                let [a, b] = segment.w;
                let near = depth >= a.min(b) - tolerance && depth <= a.max(b) + tolerance;
                let share = f64::from((depth - a) / (b - a));
                // Parallel to the raster: no share, any point will do.
                let share = if share.is_finite() {
                    share.clamp(0.0, 1.0)
                } else {
                    0.0
                };
                near.then_some(t0 + (t1 - t0) * share)
            }
            Self::Plane { margin } => {
                let [a, b] = segment.above(depth, slopes);
                // The rate from the whole segment; both ends are then moved out along the ray.
                let rate = f64::from(b - a) / (t1 - t0);
                let t = t0 - f64::from(a) / rate;
                let slack = f64::from(margin) * lateral;
                (rate != 0.0 && t >= t0 - slack && t <= t1 + slack).then_some(t)
            }
        }
    }
}

impl Ldc<'_> {
    /// The nearest hit by the samples alone: fast, and wrong by what sampling loses. Each direction is searched up to
    /// its first hit, which shortens the ray for those after it (VMV07).
    ///
    /// `u` and `v` are those of the triangle's plane at the hit, moved into the triangle.
    pub fn closest_sampled(&self, ray: &Ray, test: HitTest, steps: &mut impl Steps) -> Option<Hit> {
        let (t, prim) = self.search(ray, test, false, steps)?;
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let at = exact::attributes(origin, dir, self.triangles.corners(prim));
        let (u, v) = at.map_or((0.0, 0.0), |a| (a.u.clamp(0.0, 1.0), a.v.clamp(0.0, 1.0)));
        Some(Hit {
            t: t as f32,
            u: u as f32,
            v: v.min(1.0 - u) as f32,
            prim,
        })
    }

    /// Whether any sample is hit: the first found ends the search.
    pub fn any_sampled(&self, ray: &Ray, test: HitTest, steps: &mut impl Steps) -> bool {
        self.search(ray, test, true, steps).is_some()
    }

    /// A secondary ray that does not hit the samples it leaves from: it starts one and a half texels above its
    /// surface and counts hits from where it is two texels away from it.
    pub fn leaving(&self, point: Vec3, normal: Vec3, dir: Vec3) -> Ray {
        let texel = self.texel_size() as f32;
        let (normal, along) = (normal.normalize_or_zero(), dir.normalize_or_zero());
        let side = if normal.dot(along) < 0.0 { -normal } else { normal };
        let steep = side.dot(along).max(0.1);
        Ray {
            origin: point + side * (1.5 * texel),
            t_min: 2.0 * texel / steep / dir.length(),
            ..Ray::new(point, dir)
        }
    }

    fn search(&self, ray: &Ray, test: HitTest, any: bool, steps: &mut impl Steps) -> Option<(f64, u32)> {
        if !ray.is_valid() {
            return None;
        }
        let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
        let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut best = None;
        for cube in &self.cubes {
            let t_end = best.map_or(t_max, |(t, _)| t);
            let Clipped::Inside(inside) = cube.frame.clip(origin, dir, t_min, t_end) else {
                continue;
            };
            best = nearest(best, cube.search(&inside, test, any, [t_min, t_max], steps));
            if any && best.is_some() {
                break;
            }
        }
        best
    }
}

impl Cube {
    fn search(
        &self,
        inside: &TexelRay,
        test: HitTest,
        any: bool,
        range: [f64; 2],
        steps: &mut impl Steps,
    ) -> Option<(f64, u32)> {
        let mut best = None;
        let mut t_end = inside.t_max;
        for axis in axis_order(inside.dir) {
            let stack = &self.stacks[axis];
            let found = match &stack.samples {
                Samples::F16(s) => in_stack(stack, s, inside, test, range, &mut t_end, steps),
                Samples::U16(s) => in_stack(stack, s, inside, test, range, &mut t_end, steps),
                Samples::F32(s) => in_stack(stack, s, inside, test, range, &mut t_end, steps),
            };
            best = nearest(best, found);
            if any && best.is_some() {
                break;
            }
        }
        best
    }
}

/// The nearer of two hits: a plane's margin may put one beyond one found before.
fn nearest(old: Option<(f64, u32)>, new: Option<(f64, u32)>) -> Option<(f64, u32)> {
    match (old, new) {
        (Some(old), Some(new)) => Some(if nearer(&new, &old) { new } else { old }),
        (old, new) => new.or(old),
    }
}

fn nearer(a: &(f64, u32), b: &(f64, u32)) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

/// The first hit in one direction.
fn in_stack<D: Depth>(
    stack: &Stack,
    samples: &Layers<D>,
    ray: &TexelRay,
    test: HitTest,
    range: [f64; 2],
    t_end: &mut f64,
    steps: &mut impl Steps,
) -> Option<(f64, u32)> {
    let across = stack.raster.turned(ray.dir);
    // Parameter per texel across the raster.
    let lateral = 1.0 / across.x.hypot(across.y);
    let mut best: Option<(f64, u32)> = None;
    let steepness = (across.z.abs() * lateral) as f32;
    walk(
        stack,
        samples,
        ray,
        t_end,
        test.reach(steepness),
        steps,
        |near, segment, t_end| {
            for sample in near.map(|index| samples.get(index)) {
                let slopes = if sample.slopes == NO_PLANE {
                    [0; 2]
                } else {
                    sample.slopes
                };
                let hit = test.hit(segment, sample.depth.texels(stack.scale), slopes, lateral);
                let Some(t) = hit.filter(|&t| t > range[0] && t <= range[1]) else {
                    continue;
                };
                if best.is_none_or(|b| nearer(&(t, sample.prim), &b)) {
                    best = Some((t, sample.prim));
                }
            }
            match best {
                Some((t, _)) => {
                    *t_end = t.min(*t_end);
                    ControlFlow::Break(())
                }
                None => ControlFlow::Continue(()),
            }
        },
    );
    best
}
