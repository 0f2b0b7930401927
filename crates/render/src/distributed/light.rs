//! The light of surfaces that distributed rays see, at the time of each ray.
//!
//! Lights with a size are sampled as in other frames ([`crate::tile::soft`]): each ray's surface takes
//! [`crate::RenderOptions::samples`] of them, other ones for each ray of a pixel.

use glam::Vec3;
use rayward_trace::exact;
use rayward_trace::solids::{SolidGrids, SolidReceiver};
use rayward_trace::{AreaLight, Candidates, Light, MovingAt, MovingGrids, Receiver};

use super::{Frame, Work};
use crate::shade::{ambient, direct, direct_from, object_of};
use crate::solids::OnSolid;
use crate::tile::soft;
use crate::{ShadingLight, Surface};

/// A light, and what finds its shadows.
pub(super) struct FrameLight<'f> {
    pub(super) shading: ShadingLight,
    /// Where its shadow rays end; `None` if it casts no shadows.
    pub(super) end: Option<Light>,
    /// With its size, if it has one.
    pub(super) area: Option<AreaLight>,
    /// Those around a light that has a place.
    pub(super) grids: Option<MovingGrids<'f>>,
    pub(super) solids: Option<SolidGrids<'f>>,
}

/// Which ray of which pixel: what its random numbers depend on.
#[derive(Clone, Copy)]
pub(super) struct RayIndex {
    pub(super) pixel: u32,
    pub(super) sample: u32,
    pub(super) time: f64,
}

/// A point that a ray sees.
pub(super) struct Seen<'s> {
    pub(super) surface: &'s Surface,
    pub(super) receiver: Receiver,
    /// The solid it is on, if any.
    pub(super) on: OnSolid,
    /// Where the ray came from: which side of a triangle is seen.
    pub(super) from: Light,
}

impl Frame<'_> {
    /// What a surface sends back along the ray.
    pub(super) fn shaded(&self, seen: &Seen, ray: RayIndex, work: &mut Work) -> Vec3 {
        let mut color = ambient(seen.surface, self.options.ambient);
        for (index, light) in self.lights.iter().enumerate() {
            let Some(end) = &light.end else {
                color +=
                    direct(seen.surface, &light.shading).map_or(Vec3::ZERO, |incident| incident.radiance);
                continue;
            };
            if let Some(area) = &light.area {
                color += self.soft_light(seen, (index, light, area), ray, work);
            } else if let Some(incident) = direct(seen.surface, &light.shading) {
                color += incident.radiance * self.reached(seen, light, end, ray.time, work);
            }
        }
        color
    }

    /// Mean of what a surface receives from the samples of a light with a size.
    fn soft_light(
        &self,
        seen: &Seen,
        (index, light, area): (usize, &FrameLight, &AreaLight),
        ray: RayIndex,
        work: &mut Work,
    ) -> Vec3 {
        if seen.surface.unlit || !area.shines_at(seen.receiver.point) {
            return Vec3::ZERO;
        }
        let whole = self.options.paper.then(|| direct(seen.surface, &light.shading));
        let samples = soft::samples(self.options, index, ray.sample);
        let mut sum = Vec3::ZERO;
        for k in 0..samples.count() {
            let end = area.sample(&samples, ray.pixel, seen.receiver.point, k);
            let each = || direct_from(seen.surface, &light.shading, area, &end);
            if let Some(incident) = whole.unwrap_or_else(each) {
                sum += incident.radiance * self.reached(seen, light, &end, ray.time, work);
            }
        }
        sum / samples.count() as f32
    }

    /// Share of a light, or of one end of it, that reaches a point.
    fn reached(&self, seen: &Seen, light: &FrameLight, end: &Light, time: f64, work: &mut Work) -> Vec3 {
        if seen.on.is_none() {
            let corners = self.moving.corners(seen.receiver.prim, time);
            if !exact::same_side(corners, end, &seen.from) {
                return Vec3::ZERO;
            }
        }
        work.shadow_rays += 1;
        if let Some(solids) = light.solids.as_ref().or(self.solids.as_ref()) {
            let receiver = SolidReceiver {
                on: seen.on,
                ..SolidReceiver::from(&seen.receiver)
            };
            if solids.at(time).shadows(&receiver, end, &mut ()) {
                return Vec3::ZERO;
            }
        }
        let now = light.grids.as_ref().unwrap_or(&self.eye).at(time);
        self.passed(&now, &seen.receiver, end, work)
    }

    /// Share of a light that triangles let through to a receiver.
    fn passed(&self, now: &MovingAt, receiver: &Receiver, light: &Light, work: &mut Work) -> Vec3 {
        if self.transparent.is_empty() {
            let lit = !now.shadows(receiver, light, &mut ());
            return Vec3::splat(f32::from(u8::from(lit)));
        }
        let (origin, dir) = exact::shadow_line(receiver, light);
        let tinted = self.options.tinted_shadows;
        now.blockers(receiver, light, &mut (), &mut work.blockers);
        let mut passed = Vec3::ONE;
        for &prim in &work.blockers {
            let object = object_of(self.open, prim);
            if !self.transparent[self.open.objects[object as usize].material as usize] {
                return Vec3::ZERO;
            }
            if let Some(hit) = exact::attributes(origin, dir, now.corners(prim)) {
                let place = [hit.u as f32, hit.v as f32];
                passed *= self.shader.transmittance(self.open, prim, object, place, tinted);
            }
        }
        passed
    }
}
