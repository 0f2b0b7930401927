//! What a tile sees of solids, and the light that reaches them.
//!
//! Points of solids are lit as those that reflected rays meet are ([`crate::bounce`]): there, too, triangles are asked of
//! the structure for other rays.

use glam::{Vec2, Vec3};
use rayward_trace::solids::{Crossing, SolidReceiver};
use rayward_trace::{Light, Receiver, Tile, ViewRay};

use super::{Seen, ShadedPoint, TileShader, TileWork};
use crate::Sample;

impl TileShader<'_> {
    /// Finds the solids that the pixels of a tile see.
    pub(super) fn trace_solids(&self, tile: &Tile, work: &mut TileWork) {
        if let Some(solids) = self.solids.filter(|_| self.reference.is_none()) {
            solids.eye.trace_tile(tile, &mut work.solid_hits);
        }
    }

    /// The solid that a pixel would see if there were no triangles.
    pub(super) fn solid_at(
        &self,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        work: &TileWork,
    ) -> Option<(u32, Crossing)> {
        let solids = self.solids?;
        if self.reference.is_some() {
            return solids.closest(ray, [0.0, f64::INFINITY], None);
        }
        work.solid_hits.at(x, y).copied()
    }

    /// Notes the surface of a solid where a ray meets it; nothing is seen behind.
    pub(super) fn note_solid(
        &self,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        (id, crossing): &(u32, Crossing),
        seen: &mut Seen,
        points: &mut Vec<ShadedPoint>,
    ) {
        let Some(solids) = self.solids else { return };
        let receiver = solids.receiver(ray, *id, crossing);
        let view = (-ray.dir.normalize()).as_vec3();
        let surface = self
            .shader
            .solid_surface(solids.material(*id), receiver.point, crossing, view);
        if seen.left == 1.0 {
            let [object, prim] = solids.ids(*id);
            let depth = crossing.t as f32;
            seen.sample = Sample {
                depth,
                distance: depth * ray.dir.length() as f32,
                normal: surface.normal,
                object,
                prim,
                bary: Vec2::ZERO,
                ..seen.sample
            };
        }
        points.push(ShadedPoint {
            x,
            y,
            receiver: receiver.among_triangles(),
            on: receiver.on,
            weight: seen.left,
            color: self.resting(&surface, 0),
            surface,
        });
        seen.left = 0.0;
    }

    /// Whether a solid hides a point of a triangle from one end of a light.
    pub(super) fn solid_hides(&self, light: usize, receiver: &Receiver, end: &Light) -> bool {
        let hides = |solids: &crate::solids::FrameSolids| {
            solids.hides(Some(light), &SolidReceiver::from(receiver), end)
        };
        self.solids.is_some_and(hides)
    }

    /// Adds the light of all sources to the points of solids.
    pub(super) fn illuminate_solids(&self, tile: &Tile, work: &mut TileWork) {
        let Some(tracer) = self.structures.others.as_deref() else {
            return;
        };
        let TileWork { points, bounce, .. } = work;
        let on_solids = || points.iter().filter(|point| point.on.is_some());
        bounce.arrivals.clear();
        bounce
            .arrivals
            .extend(on_solids().map(|point| self.arrival(tile, point)));
        self.illuminate_solid_arrivals(tracer, bounce);
        let lit: Vec<Vec3> = bounce.arrivals.iter().map(|arrival| arrival.color).collect();
        let on_solids = points.iter_mut().filter(|point| point.on.is_some());
        for (point, color) in on_solids.zip(lit) {
            point.color += color;
        }
    }
}
