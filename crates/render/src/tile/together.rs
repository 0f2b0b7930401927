//! The points that a tile sees, shaded as arrays ([`SurfaceShader`]): what its pixels' rays meet is found first, then all
//! surfaces are made at once; the light that reaches them is noted as beams, and all beams are added up at once.
//!
//! Of several surfaces behind each other all are made, also those that turn out not to be seen. Points of solids have no
//! triangle; their surfaces are made one by one.

use rayward_trace::exact::{self, ExactHit};
use rayward_trace::{Tile, ViewRay};

use super::{INVISIBLE, Seen, ShadedPoint, TileShader, TileWork};
use crate::geometry::triangles;
use crate::shade::{Beam, CpuShading, Source, SurfaceFinish, SurfaceShader};
use crate::{Sample, Surface, SurfacePoint, TileMut};
use glam::Vec3;

/// Working memory.
#[derive(Default)]
pub(crate) struct Together {
    /// What rays meet, pixel after pixel, front to back.
    hits: Vec<(u32, ExactHit)>,
    points: Vec<SurfacePoint>,
    /// Where the hits of each pixel end.
    ends: Vec<usize>,
    /// The light that reaches the tile's points.
    pub(super) beams: Vec<Beam>,
}

impl TileShader<'_> {
    /// What stands in for a shader of arrays that fails.
    pub(crate) fn on_cpu(&self) -> CpuShading<'_> {
        CpuShading {
            shader: self.shader,
            geometry: self.geometry,
            lights: self.lights,
        }
    }

    /// Makes an array of surfaces. What masked and blended ones cover decides what is seen behind them, so it is that of the
    /// CPU to the bit.
    pub(crate) fn surfaces(&self, shading: &dyn SurfaceShader, points: &[SurfacePoint]) -> Vec<Surface> {
        let Some(mut made) = shading.surfaces(points) else {
            return self.on_cpu().surfaces(points);
        };
        let materials = self.shader.materials();
        for (surface, point) in made.iter_mut().zip(points) {
            let material = self.geometry.objects[point.object as usize].material;
            if materials[material as usize].has_finish() {
                *surface = self.shader.surface(self.geometry, point);
            } else if self.structures.transparent && !self.shader.is_opaque(self.geometry, point.object) {
                surface.alpha = self.shader.coverage(self.geometry, point);
            }
        }
        made
    }

    /// What surfaces send of the light of their beams. That of films, sheen and anisotropy is the CPU's.
    pub(crate) fn lit(&self, shading: &dyn SurfaceShader, surfaces: &[Surface], beams: &[Beam]) -> Vec<Vec3> {
        let finished = |beam: &&Beam| surfaces[beam.surface as usize].finish != SurfaceFinish::NONE;
        let plain: Vec<Beam> = beams.iter().filter(|beam| !finished(beam)).copied().collect();
        let Some(mut lit) = shading.lit(surfaces, &plain) else {
            return self.on_cpu().lit(surfaces, beams);
        };
        if plain.len() < beams.len() {
            let others: Vec<Beam> = beams.iter().filter(finished).copied().collect();
            let own = self.on_cpu().lit(surfaces, &others);
            lit.iter_mut().zip(own).for_each(|(lit, own)| *lit += own);
        }
        lit
    }

    /// Notes the surfaces that these pixels see, as [`Self::see`] does.
    pub(super) fn see_together(
        &self,
        shading: &dyn SurfaceShader,
        tile: &Tile,
        pixels: &[[u32; 2]],
        work: &mut TileWork,
        out: &mut TileMut,
    ) {
        let mut together = std::mem::take(&mut work.together);
        together.hits.clear();
        together.points.clear();
        together.ends.clear();
        together.beams.clear();
        let view = self.structures.eye.view();
        let ray = |[x, y]: [u32; 2]| view.pixel_ray(tile.x + x, tile.y + y);
        for &pixel in pixels {
            self.meet(tile, pixel, &ray(pixel), work, &mut together);
            together.ends.push(together.hits.len());
        }
        work.surfaces += together.hits.len() as u64;
        let surfaces = self.surfaces(shading, &together.points);
        let mut first = 0;
        for (&pixel, &end) in pixels.iter().zip(&together.ends) {
            let ray = ray(pixel);
            let mut seen = Seen {
                sample: Sample::background(Vec3::ZERO),
                left: 1.0,
            };
            let met = together.hits[first..end].iter().zip(&together.points[first..end]);
            for ((&(prim, hit), at), surface) in met.zip(&surfaces[first..end]) {
                let shaded = self.shaded(at.object, (prim, &hit), *surface, Vec3::ZERO);
                let first_of_its = work.points.len();
                self.note(pixel, &ray, shaded, &mut seen, &mut work.points);
                if let Some(point) = work.points.get(first_of_its) {
                    together.beams.push(self.rest(first_of_its, point));
                }
                if seen.left < INVISIBLE {
                    seen.left = 0.0;
                    break;
                }
            }
            first = end;
            if let Some(solid) = self.solid_at(pixel, &ray, work).filter(|_| seen.left > 0.0) {
                self.note_solid(pixel, &ray, &solid, &mut seen, &mut work.points);
            }
            out.put(pixel[0], pixel[1], &self.finished(seen, &ray));
        }
        for point in work.points.iter_mut().filter(|point| point.on.is_none()) {
            let traced = self.traced(&point.surface, 0);
            self.show_environment(&point.surface, traced, &mut point.color);
        }
        work.together = together;
    }

    /// Finds what the ray of a pixel meets up to the first opaque triangle or solid.
    fn meet(&self, tile: &Tile, [x, y]: [u32; 2], ray: &ViewRay, work: &TileWork, together: &mut Together) {
        let solid = self.solid_at([x, y], ray, work);
        let end = solid.map_or(f64::INFINITY, |(_, crossing)| crossing.t);
        if self.structures.veils.is_some() {
            let through = work.veils.pixel(x, y).iter();
            let before = through.take_while(|veil| veil.hit.t <= end);
            together.hits.extend(before.map(|veil| (veil.prim, veil.hit)));
        }
        let seen = self.structures.seen(tile, x, y);
        if let Some(prim) = seen.unwrap_or_else(|| work.hits.prim(x, y)) {
            let corners = triangles(self.geometry).corners(prim);
            let hit = exact::attributes(ray.origin, ray.dir, corners);
            together
                .hits
                .extend(hit.filter(|hit| hit.t <= end).map(|hit| (prim, hit)));
        }
        let new = together.points.len();
        let point = |(prim, hit): &(u32, ExactHit)| self.point_at(ray, *prim, hit);
        together.points.extend(together.hits[new..].iter().map(point));
    }

    /// The light of a point that needs no light.
    fn rest(&self, index: usize, point: &ShadedPoint) -> Beam {
        let (radiance, traced) = self.surrounding(&point.surface, 0);
        Beam {
            surface: index as u32,
            share: Vec3::ONE,
            source: Source::Around { radiance, traced },
        }
    }

    /// Adds the light of all beams to the points of the tile.
    pub(super) fn add_beams(&self, shading: &dyn SurfaceShader, work: &mut TileWork) {
        if work.together.beams.is_empty() {
            return;
        }
        let surfaces: Vec<Surface> = work.points.iter().map(|point| point.surface).collect();
        let lit = self.lit(shading, &surfaces, &work.together.beams);
        for (point, lit) in work.points.iter_mut().zip(lit) {
            point.color += lit;
        }
    }
}
