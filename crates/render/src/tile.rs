//! One tile: eye hits, surfaces, shadows light by light, colours (HM08 §3: eye rays drive everything, shadow
//! rays are spawned for a tile of hits at a time).

pub(crate) mod coverage;
mod passes;
pub(crate) mod soft;
mod solids;
mod together;

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};
use rayward_scene::FrameGeometry;
use rayward_trace::exact::{self, ExactHit};
use rayward_trace::solids::SolidHits;
use rayward_trace::{
    AreaCounts, AreaScratch, Light, Receiver, ShadowScratch, Tile, TileHits, TileVeils, ViewRay,
};

use crate::bounce::BounceWork;
use crate::geometry::triangles;
use crate::plan::LightPlan;
use crate::reference::EveryTriangle;
use crate::secondary::SecondaryTracer;
use crate::shade::{Beam, Source, SurfaceShader, direct, object_of, reaches};
use crate::solids::{FrameSolids, OnSolid};
use crate::structures::{FrameStructures, LightShadows};
use crate::{CameraFrame, Environment, RenderOptions, Shader, ShadingLight, Surface, SurfacePoint};
use crate::{Sample, TileMut};
use coverage::{Sharing, TileShares};
use passes::Passes;
use together::Together;

/// Everything a tile needs to know of its frame.
pub(crate) struct TileShader<'f> {
    pub(crate) shader: &'f Shader<'f>,
    pub(crate) geometry: &'f FrameGeometry,
    pub(crate) camera: &'f CameraFrame,
    pub(crate) lights: &'f [ShadingLight],
    pub(crate) ends: &'f [Option<LightPlan>],
    pub(crate) structures: &'f FrameStructures<'f>,
    /// What is not made of triangles, if anything.
    pub(crate) solids: Option<&'f FrameSolids<'f>>,
    /// Where the eye rays come from.
    pub(crate) eye: Light,
    pub(crate) environment: Option<&'f Environment>,
    /// What answers the rays that surfaces send, if they send any.
    pub(crate) secondary: Option<&'f dyn SecondaryTracer>,
    /// What shades arrays, if surfaces are not shaded one by one.
    pub(crate) shading: Option<&'f dyn SurfaceShader>,
    /// What tests every triangle for every ray, if that is asked for.
    pub(crate) reference: Option<EveryTriangle<'f>>,
    /// Which sample of the pixels this is.
    pub(crate) sample: u32,
    pub(crate) options: &'f RenderOptions,
}

/// Working memory of one thread.
#[derive(Default)]
pub(crate) struct TileWork {
    hits: TileHits,
    solid_hits: SolidHits,
    pub(crate) points: Vec<ShadedPoint>,
    pub(crate) bounce: BounceWork,
    receivers: Vec<Receiver>,
    asked: Vec<(u32, Vec3)>,
    shadow: Vec<bool>,
    scratch: ShadowScratch,
    pixels: Vec<u32>,
    visible: Vec<u32>,
    area: AreaScratch,
    passes: Passes,
    /// Pixels that are to be seen.
    wanted: Vec<[u32; 2]>,
    together: Together,
    surfaces: u64,
    veils: TileVeils,
    veil_scratch: ShadowScratch,
    passed: Vec<Vec3>,
    filters: Vec<u32>,
    along: Vec<(f64, u32)>,
}

/// A surface where a ray meets a triangle, and its light that needs no shadow rays.
pub(crate) struct Shaded {
    prim: u32,
    object: u32,
    t: f64,
    bary: Vec2,
    color: Vec3,
    surface: Surface,
}

/// What has been seen of a pixel so far.
struct Seen {
    sample: Sample,
    /// Share of the pixel that nothing covers yet.
    left: f32,
}

/// A surface seen by a pixel, one of several behind each other if those before are transparent.
pub(crate) struct ShadedPoint {
    pub(crate) x: u32,
    pub(crate) y: u32,
    pub(crate) surface: Surface,
    pub(crate) receiver: Receiver,
    pub(crate) on: OnSolid,
    /// Share of the pixel that shows it.
    pub(crate) weight: f32,
    color: Vec3,
}

/// Counts of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileCounts {
    pub(crate) shadow_rays: u64,
    pub(crate) secondary_rays: u64,
    pub(crate) exact_pixels: u64,
    pub(crate) lit_by_cell: u64,
    pub(crate) dark_by_cell: u64,
    pub(crate) surfaces: u64,
}

impl TileCounts {
    pub(crate) fn sum(self, other: Self) -> Self {
        Self {
            shadow_rays: self.shadow_rays + other.shadow_rays,
            secondary_rays: self.secondary_rays + other.secondary_rays,
            exact_pixels: self.exact_pixels + other.exact_pixels,
            lit_by_cell: self.lit_by_cell + other.lit_by_cell,
            dark_by_cell: self.dark_by_cell + other.dark_by_cell,
            surfaces: self.surfaces + other.surfaces,
        }
    }
}

/// The pixels of a tile in squares of 16 x 16, within these of 8 x 8 and of 4 x 4: those that follow each other see surfaces
/// close to each other.
fn in_blocks(width: u32, height: u32) -> impl Iterator<Item = [u32; 2]> {
    let blocks = (0..height)
        .step_by(16)
        .flat_map(move |y| (0..width).step_by(16).map(move |x| [x, y]));
    let quarters =
        move |[x, y]: [u32; 2], side: u32| (0..4).map(move |i| [x + i % 2 * side, y + i / 2 * side]);
    let squares = blocks
        .flat_map(move |at| quarters(at, 8))
        .flat_map(move |at| quarters(at, 4));
    let pixels = squares.flat_map(|[x, y]| (0..16).map(move |i| [x + i % 4, y + i / 4]));
    pixels.filter(move |[x, y]| *x < width && *y < height)
}

/// Layers less visible than this are left out.
const INVISIBLE: f32 = 1.0 / 512.0;

impl TileShader<'_> {
    /// Renders the tile of that index into its part of the film; what its shares know of already is left out.
    pub(crate) fn render(
        &self,
        index: u32,
        work: &mut TileWork,
        mut shares: Option<(&Sharing, &mut TileShares)>,
        out: &mut TileMut,
    ) -> TileCounts {
        let tile = self.structures.eye.tile(index);
        // References trace pixel by pixel.
        let traced = self.structures.visibility.is_some() || self.reference.is_some();
        work.surfaces = 0;
        if !traced && self.options.paper {
            self.shade_passes(&tile, work);
        } else if !traced {
            self.structures.eye.trace_tile(&tile, &mut work.hits);
        }
        if let Some(veils) = &self.structures.veils {
            let (hits, structures) = (&work.hits, self.structures);
            let opaque = |x, y| structures.seen(&tile, x, y).unwrap_or_else(|| hits.prim(x, y));
            veils.trace_tile(&tile, opaque, &mut work.veils);
        }
        self.trace_solids(&tile, work);
        work.points.clear();
        (work.bounce.secondary_rays, work.bounce.shadow_rays) = (0, 0);
        work.scratch.counts = rayward_trace::ShadowCounts::default();
        work.area.counts = AreaCounts::default();
        let mut wanted = std::mem::take(&mut work.wanted);
        wanted.clear();
        wanted.extend(in_blocks(tile.width, tile.height));
        if let Some((sharing, shares)) = &mut shares {
            wanted.retain(|&pixel| !self.joins(sharing, shares, &tile, pixel, work));
        }
        if let Some(shading) = self.shading {
            self.see_together(shading, &tile, &wanted, work, out);
        } else {
            for &[x, y] in &wanted {
                let sample = self.see(&tile, [x, y], work);
                out.put(x, y, &sample);
            }
        }
        work.wanted = wanted;
        for light in self.shadowed_lights() {
            match &self.structures.lights[light] {
                LightShadows::Area(tree) => self.illuminate_softly(light, tree.light(), &tile, work),
                _ => match self.ends[light].as_ref().and_then(|plan| plan.area.as_ref()) {
                    Some(area) => self.illuminate_softly(light, area, &tile, work),
                    None => self.illuminate(light, index, work),
                },
            }
        }
        if let Some(shading) = self.shading {
            self.add_beams(shading, work);
        }
        self.illuminate_solids(&tile, work);
        for point in &work.points {
            out.color_row(point.y)[point.x as usize] += point.color * point.weight;
        }
        if let Some(measured) = &self.structures.measured {
            self.measure(measured, work, out);
        }
        self.go_on(&tile, work, out);
        if let Some((_, shares)) = shares {
            shares.keep(out);
        }
        TileCounts {
            shadow_rays: work.scratch.counts.receivers + work.area.counts.samples + work.bounce.shadow_rays,
            secondary_rays: work.bounce.secondary_rays,
            exact_pixels: if traced { 0 } else { work.hits.exact_pixels as u64 },
            lit_by_cell: work.scratch.counts.lit_by_cell + work.area.counts.untested,
            dark_by_cell: work.scratch.counts.dark_by_cell,
            surfaces: work.surfaces,
        }
    }

    /// Notes the surfaces that a pixel sees, front to back until they cover it; returns the pixel without their
    /// light. The layers are those of the first surface of which anything is seen.
    fn see(&self, tile: &Tile, [x, y]: [u32; 2], work: &mut TileWork) -> Sample {
        let ray = self.structures.eye.view().pixel_ray(tile.x + x, tile.y + y);
        let mut seen = Seen {
            sample: Sample::background(Vec3::ZERO),
            left: 1.0,
        };
        if let Some(every) = &self.reference {
            self.see_each(every, [x, y], &ray, &mut seen, work);
        } else {
            self.see_through(tile, [x, y], &ray, &mut seen, work);
        }
        self.finished(seen, &ray)
    }

    /// The pixel with what is seen behind all surfaces.
    fn finished(&self, mut seen: Seen, ray: &ViewRay) -> Sample {
        seen.sample.alpha = 1.0 - seen.left;
        if seen.left > 0.0 {
            seen.sample.color = self.backdrop(ray) * seen.left;
        }
        seen.sample
    }

    /// Notes the surfaces that a pixel sees by the camera's grids.
    fn see_through(
        &self,
        tile: &Tile,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        seen: &mut Seen,
        work: &mut TileWork,
    ) {
        let solid = self.solid_at([x, y], ray, work);
        let solid_t = solid.map_or(f64::INFINITY, |(_, crossing)| crossing.t);
        let TileWork {
            hits,
            veils,
            points,
            passes,
            surfaces,
            ..
        } = work;
        let through = match &self.structures.veils {
            Some(_) => veils.pixel(x, y),
            None => &[],
        };
        let opaque = self
            .structures
            .seen(tile, x, y)
            .unwrap_or_else(|| hits.prim(x, y));
        for veil in through.iter().take_while(|veil| veil.hit.t <= solid_t) {
            *surfaces += 1;
            self.note([x, y], ray, self.shade(ray, veil.prim, &veil.hit), seen, points);
            if seen.left < INVISIBLE {
                seen.left = 0.0;
                break;
            }
        }
        if seen.left <= 0.0 {
            return;
        }
        let shaded = opaque.and_then(|prim| {
            passes.take(tile, [x, y]).or_else(|| {
                *surfaces += 1;
                self.shade_hit(ray, prim)
            })
        });
        if let Some(shaded) = shaded.filter(|shaded| shaded.t <= solid_t) {
            self.note([x, y], ray, shaded, seen, points);
        } else if let Some(solid) = solid {
            self.note_solid([x, y], ray, &solid, seen, points);
        }
    }

    /// The surface of a triangle that a ray is known to meet.
    fn shade_hit(&self, ray: &ViewRay, prim: u32) -> Option<Shaded> {
        let corners = triangles(self.geometry).corners(prim);
        let hit = exact::attributes(ray.origin, ray.dir, corners)?;
        Some(self.shade(ray, prim, &hit))
    }

    /// As [`Self::see_through`], every triangle tested.
    fn see_each(
        &self,
        every: &EveryTriangle,
        pixel: [u32; 2],
        ray: &ViewRay,
        seen: &mut Seen,
        work: &mut TileWork,
    ) {
        every.along(ray, &mut work.along);
        let solid = self.solid_at(pixel, ray, work);
        let solid_t = solid.map_or(f64::INFINITY, |(_, crossing)| crossing.t);
        for &(_, prim) in work.along.iter().take_while(|(t, _)| *t <= solid_t) {
            let corners = triangles(self.geometry).corners(prim);
            if let Some(hit) = exact::attributes(ray.origin, ray.dir, corners) {
                work.surfaces += 1;
                self.note(pixel, ray, self.shade(ray, prim, &hit), seen, &mut work.points);
            }
            if seen.left < INVISIBLE {
                seen.left = 0.0;
                break;
            }
        }
        if let Some(solid) = solid.filter(|_| seen.left > 0.0) {
            self.note_solid(pixel, ray, &solid, seen, &mut work.points);
        }
    }

    /// The surface where a ray meets a triangle, and its light that needs no shadow rays.
    fn shade(&self, ray: &ViewRay, prim: u32, hit: &ExactHit) -> Shaded {
        let point = self.point_at(ray, prim, hit);
        let surface = self.shader.surface(self.geometry, &point);
        let color = self.resting(&surface, 0);
        self.shaded(point.object, (prim, hit), surface, color)
    }

    /// Where a ray meets a triangle, for a surface to be made.
    fn point_at(&self, ray: &ViewRay, prim: u32, hit: &ExactHit) -> SurfacePoint {
        SurfacePoint {
            prim,
            object: object_of(self.geometry, prim),
            u: hit.u as f32,
            v: hit.v as f32,
            view: (-ray.dir.normalize()).as_vec3(),
            footprint: self.cone(hit.t as f32).width,
        }
    }

    /// A surface where a ray meets a triangle, with this light.
    fn shaded(&self, object: u32, (prim, hit): (u32, &ExactHit), surface: Surface, color: Vec3) -> Shaded {
        Shaded {
            prim,
            object,
            t: hit.t,
            bary: Vec2::new(hit.u as f32, hit.v as f32),
            color,
            surface,
        }
    }

    /// Notes a surface where a ray meets it, if any of it is seen.
    fn note(
        &self,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        shaded: Shaded,
        seen: &mut Seen,
        points: &mut Vec<ShadedPoint>,
    ) {
        let Shaded {
            prim,
            object,
            t,
            bary,
            color,
            surface,
        } = shaded;
        let weight = seen.left * surface.alpha;
        if weight <= 0.0 {
            return;
        }
        if seen.left == 1.0 {
            let depth = t as f32;
            seen.sample = Sample {
                depth,
                distance: depth * ray.dir.length() as f32,
                normal: surface.normal,
                object,
                prim,
                bary,
                ..seen.sample
            };
        }
        seen.left -= weight;
        points.push(ShadedPoint {
            x,
            y,
            receiver: Receiver::along(ray, t, prim),
            on: None,
            weight,
            color,
            surface,
        });
    }

    /// Adds the light of one source to all points of the tile that it reaches.
    fn illuminate(&self, light: usize, tile: u32, work: &mut TileWork) {
        let end = self.ends[light].as_ref().map(|plan| plan.light);
        let beside_solids =
            |receiver: &Receiver| !end.is_some_and(|end| self.solid_hides(light, receiver, &end));
        if let LightShadows::Pixels(lit) = &self.structures.lights[light] {
            for (i, point) in work.points.iter_mut().enumerate() {
                if point.on.is_none()
                    && lit.is_lit(tile, point.x, point.y)
                    && let Some(radiance) = self.reflected(&point.surface, light)
                    && beside_solids(&point.receiver)
                {
                    self.add(light, (i, point), (radiance, Vec3::ONE), &mut work.together.beams);
                }
            }
            return;
        }
        let TileWork {
            points,
            receivers,
            asked,
            shadow,
            scratch,
            veil_scratch,
            passed,
            filters,
            together,
            ..
        } = work;
        receivers.clear();
        asked.clear();
        for (i, point) in points.iter().enumerate() {
            if point.on.is_none()
                && let Some(radiance) = self.reflected(&point.surface, light)
                && self.faces(light, &point.receiver)
                && beside_solids(&point.receiver)
            {
                receivers.push(point.receiver);
                asked.push((i as u32, radiance));
            }
        }
        self.hidden(light, receivers, scratch, shadow);
        // From here on those that nothing opaque hides.
        let mut kept = shadow.iter().map(|in_shadow| !in_shadow);
        receivers.retain(|_| kept.next() == Some(true));
        let mut kept = shadow.iter().map(|in_shadow| !in_shadow);
        asked.retain(|_| kept.next() == Some(true));
        if let (Some(every), Some(plan)) = (&self.reference, &self.ends[light]) {
            let share = |receiver| self.transmittance(every, receiver, &plan.light, filters);
            passed.clear();
            passed.extend(receivers.iter().map(share));
        } else {
            self.pass(light, receivers, veil_scratch, passed);
        }
        for (&(i, radiance), &passed) in asked.iter().zip(&*passed) {
            let point = (i as usize, &mut points[i as usize]);
            self.add(light, point, (radiance, passed), &mut together.beams);
        }
    }

    /// Which receivers an opaque triangle hides from a light without a size.
    fn hidden(
        &self,
        light: usize,
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        shadow: &mut Vec<bool>,
    ) {
        match &self.structures.lights[light] {
            LightShadows::Grid(grid) => grid.shadowed(receivers, scratch, shadow),
            LightShadows::Tree(tree, passed) => {
                let before = scratch.counts;
                tree.shadowed(receivers, scratch, shadow);
                passed.add(&before, &scratch.counts);
            }
            LightShadows::Reference => self.shadowed_by_any(light, receivers, shadow),
            LightShadows::Nothing
            | LightShadows::Pixels(_)
            | LightShadows::Area(_)
            | LightShadows::AreaGrid(_)
            | LightShadows::Asked => {
                shadow.clear();
                shadow.resize(receivers.len(), false);
            }
        }
    }

    /// What a surface reflects of a light if nothing is in between; `None` if the light does not reach it. Where arrays are
    /// shaded it is not known yet, and nothing is told but that.
    fn reflected(&self, surface: &Surface, light: usize) -> Option<Vec3> {
        let light = &self.lights[light];
        if self.shading.is_some() {
            return reaches(surface, light).then_some(Vec3::ZERO);
        }
        direct(surface, light).map(|incident| incident.radiance)
    }

    /// Adds what a point reflects of the share of a light that arrives, or notes that it does.
    fn add(
        &self,
        light: usize,
        (index, point): (usize, &mut ShadedPoint),
        (radiance, share): (Vec3, Vec3),
        beams: &mut Vec<Beam>,
    ) {
        if self.shading.is_none() {
            point.color += radiance * share;
            return;
        }
        beams.push(Beam {
            surface: index as u32,
            share,
            source: Source::Light(light as u32),
        });
    }

    /// Which receivers an opaque triangle hides from a light, all tested.
    fn shadowed_by_any(&self, light: usize, receivers: &[Receiver], shadow: &mut Vec<bool>) {
        if let (Some(every), Some(plan)) = (&self.reference, &self.ends[light]) {
            every.shadowed(&|prim| self.is_opaque(prim), &plan.light, receivers, shadow);
        }
    }

    /// Whether a triangle lets no light through.
    pub(crate) fn is_opaque(&self, prim: u32) -> bool {
        let object = object_of(self.geometry, prim);
        self.shader.is_opaque(self.geometry, object)
    }

    /// Whether a light is on the side of a surface that the eye sees. Casters are chosen by the same decision, so
    /// that rounding at a terminator cannot let light through.
    fn faces(&self, light: usize, receiver: &Receiver) -> bool {
        let Some(plan) = &self.ends[light] else {
            return true;
        };
        let corners = triangles(self.geometry).corners(receiver.prim);
        exact::same_side(corners, &plan.light, &self.eye)
    }

    /// Share of a light that masked and blended triangles let through to each receiver. The product is taken in the
    /// order of ids, so it does not depend on the structure.
    fn pass(
        &self,
        light: usize,
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        passed: &mut Vec<Vec3>,
    ) {
        passed.clear();
        passed.resize(receivers.len(), Vec3::ONE);
        let Some(grid) = &self.structures.light_veils[light] else {
            return;
        };
        let (geometry, tinted) = (self.geometry, self.options.tinted_shadows);
        grid.each_between(receivers, scratch, |i, prim, hit| {
            let (object, u, v) = (object_of(geometry, prim), hit.u as f32, hit.v as f32);
            passed[i] *= self.shader.transmittance(geometry, prim, object, [u, v], tinted);
            if passed[i] == Vec3::ZERO {
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
    }

    /// As [`Self::pass`], of one receiver and any light.
    fn transmittance(
        &self,
        all: &dyn SecondaryTracer,
        receiver: &Receiver,
        light: &Light,
        filters: &mut Vec<u32>,
    ) -> Vec3 {
        filters.clear();
        all.each_between(receiver, light, &mut |prim| {
            filters.push(prim);
            ControlFlow::Continue(())
        });
        self.let_through(receiver, light, filters)
    }

    /// Share of the light that these triangles between a receiver and a light let through.
    pub(crate) fn let_through(&self, receiver: &Receiver, light: &Light, filters: &mut [u32]) -> Vec3 {
        let (origin, dir) = exact::shadow_line(receiver, light);
        // In a fixed order: the product of rounded numbers depends on it.
        filters.sort_unstable();
        let (geometry, tinted) = (self.geometry, self.options.tinted_shadows);
        let passed = |&prim: &u32| {
            let hit = exact::attributes(origin, dir, triangles(geometry).corners(prim))?;
            let place = [hit.u as f32, hit.v as f32];
            let object = object_of(geometry, prim);
            Some(self.shader.transmittance(geometry, prim, object, place, tinted))
        };
        filters.iter().filter_map(passed).product()
    }
}
