//! One tile: eye hits, surfaces, shadows light by light, colours (HM08 §3: eye rays drive everything, shadow
//! rays are spawned for a tile of hits at a time).

mod soft;

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};
use rayward_scene::FrameGeometry;
use rayward_trace::exact::{self, ExactHit};
use rayward_trace::{
    AreaCounts, AreaScratch, Bvh, Light, Receiver, ShadowScratch, Tile, TileHits, TileVeils, ViewRay,
};

use crate::geometry::triangles;
use crate::plan::LightPlan;
use crate::shade::{ambient, direct, object_of};
use crate::structures::{FrameStructures, LightShadows};
use crate::{CameraFrame, RenderOptions, Shader, ShadingLight, Surface, SurfacePoint};
use crate::{Sample, TileMut};

/// Everything a tile needs to know of its frame.
pub(crate) struct TileShader<'f> {
    pub(crate) shader: &'f Shader<'f>,
    pub(crate) geometry: &'f FrameGeometry,
    pub(crate) camera: &'f CameraFrame,
    pub(crate) lights: &'f [ShadingLight],
    pub(crate) ends: &'f [Option<LightPlan>],
    pub(crate) structures: &'f FrameStructures<'f>,
    /// Where the eye rays come from.
    pub(crate) eye: Light,
    pub(crate) options: &'f RenderOptions,
}

/// Working memory of one thread.
#[derive(Default)]
pub(crate) struct TileWork {
    hits: TileHits,
    points: Vec<ShadedPoint>,
    receivers: Vec<Receiver>,
    asked: Vec<(u32, Vec3)>,
    shadow: Vec<bool>,
    scratch: ShadowScratch,
    pixels: Vec<u32>,
    visible: Vec<u32>,
    area: AreaScratch,
    veils: TileVeils,
    veil_scratch: ShadowScratch,
    passed: Vec<Vec3>,
    filters: Vec<u32>,
}

/// What has been seen of a pixel so far.
struct Seen {
    sample: Sample,
    /// Share of the pixel that nothing covers yet.
    left: f32,
}

/// A surface seen by a pixel, one of several behind each other if those before are transparent.
struct ShadedPoint {
    x: u32,
    y: u32,
    surface: Surface,
    receiver: Receiver,
    /// Share of the pixel that shows it.
    weight: f32,
    color: Vec3,
}

/// Counts of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileCounts {
    pub(crate) shadow_rays: u64,
    pub(crate) exact_pixels: u64,
    pub(crate) lit_by_cell: u64,
}

impl TileCounts {
    pub(crate) fn sum(self, other: Self) -> Self {
        Self {
            shadow_rays: self.shadow_rays + other.shadow_rays,
            exact_pixels: self.exact_pixels + other.exact_pixels,
            lit_by_cell: self.lit_by_cell + other.lit_by_cell,
        }
    }
}

/// The pixels of a tile in squares of 8 x 8, and within these of 4 x 4: those that follow each other see surfaces close
/// to each other.
fn in_blocks(width: u32, height: u32) -> impl Iterator<Item = [u32; 2]> {
    let blocks = (0..height)
        .step_by(8)
        .flat_map(move |y| (0..width).step_by(8).map(move |x| [x, y]));
    let squares = blocks.flat_map(|[x, y]| (0..4).map(move |i| [x + i % 2 * 4, y + i / 2 * 4]));
    let pixels = squares.flat_map(|[x, y]| (0..16).map(move |i| [x + i % 4, y + i / 4]));
    pixels.filter(move |[x, y]| *x < width && *y < height)
}

/// Layers less visible than this are left out.
const INVISIBLE: f32 = 1.0 / 512.0;

impl TileShader<'_> {
    /// Renders the tile of that index into its part of the film.
    pub(crate) fn render(&self, index: u32, work: &mut TileWork, out: &mut TileMut) -> TileCounts {
        let tile = self.structures.eye.tile(index);
        let traced = self.structures.visibility.is_some();
        if !traced {
            self.structures.eye.trace_tile(&tile, &mut work.hits);
        }
        if let Some(veils) = &self.structures.veils {
            let (hits, structures) = (&work.hits, self.structures);
            let opaque = |x, y| structures.seen(&tile, x, y).unwrap_or_else(|| hits.prim(x, y));
            veils.trace_tile(&tile, opaque, &mut work.veils);
        }
        work.points.clear();
        work.scratch.counts = rayward_trace::ShadowCounts::default();
        work.area.counts = AreaCounts::default();
        for [x, y] in in_blocks(tile.width, tile.height) {
            let sample = self.see(&tile, [x, y], work);
            out.put(x, y, &sample);
        }
        for light in 0..self.lights.len() {
            match &self.structures.lights[light] {
                LightShadows::Area(tree) => self.illuminate_softly(light, tree, &tile, work),
                _ => self.illuminate(light, index, work),
            }
        }
        for point in &work.points {
            out.color_row(point.y)[point.x as usize] += point.color * point.weight;
        }
        TileCounts {
            shadow_rays: work.scratch.counts.receivers + work.area.counts.samples,
            exact_pixels: if traced { 0 } else { work.hits.exact_pixels as u64 },
            lit_by_cell: work.scratch.counts.lit_by_cell + work.area.counts.untested,
        }
    }

    /// Notes the surfaces that a pixel sees, front to back until they cover it; returns the pixel without their
    /// light. The layers are those of the first surface of which anything is seen.
    fn see(&self, tile: &Tile, [x, y]: [u32; 2], work: &mut TileWork) -> Sample {
        let background = Sample::background(self.options.background);
        let TileWork {
            hits, veils, points, ..
        } = work;
        let through = match &self.structures.veils {
            Some(_) => veils.pixel(x, y),
            None => &[],
        };
        let opaque = self
            .structures
            .seen(tile, x, y)
            .unwrap_or_else(|| hits.prim(x, y));
        if opaque.is_none() && through.is_empty() {
            return background;
        }
        let ray = self.structures.eye.view().pixel_ray(tile.x + x, tile.y + y);
        let mut seen = Seen {
            sample: background,
            left: 1.0,
        };
        for veil in through {
            self.note([x, y], &ray, veil.prim, &veil.hit, &mut seen, points);
            if seen.left < INVISIBLE {
                seen.left = 0.0;
                break;
            }
        }
        if let Some(prim) = opaque.filter(|_| seen.left > 0.0)
            && let Some(hit) = exact::attributes(ray.origin, ray.dir, triangles(self.geometry).corners(prim))
        {
            self.note([x, y], &ray, prim, &hit, &mut seen, points);
        }
        seen.sample.alpha = 1.0 - seen.left;
        seen.sample.color = self.options.background * seen.left;
        seen.sample
    }

    /// Notes a surface where a ray meets it, if any of it is seen.
    fn note(
        &self,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        prim: u32,
        hit: &ExactHit,
        seen: &mut Seen,
        points: &mut Vec<ShadedPoint>,
    ) {
        let (depth, object) = (hit.t as f32, object_of(self.geometry, prim));
        let bary = Vec2::new(hit.u as f32, hit.v as f32);
        let surface = self.shader.surface(
            self.geometry,
            &SurfacePoint {
                prim,
                object,
                u: bary.x,
                v: bary.y,
                view: (-ray.dir.normalize()).as_vec3(),
                footprint: self.camera.footprint(depth),
            },
        );
        let weight = seen.left * surface.alpha;
        if weight <= 0.0 {
            return;
        }
        if seen.left == 1.0 {
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
            receiver: Receiver::along(ray, hit.t, prim),
            weight,
            color: ambient(&surface, self.options.ambient),
            surface,
        });
    }

    /// Adds the light of one source to all points of the tile that it reaches.
    fn illuminate(&self, light: usize, tile: u32, work: &mut TileWork) {
        if let LightShadows::Pixels(lit) = &self.structures.lights[light] {
            for point in &mut work.points {
                let reached = lit.is_lit(tile, point.x, point.y);
                if let (true, Some(incident)) = (reached, direct(&point.surface, &self.lights[light])) {
                    point.color += incident.radiance;
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
            ..
        } = work;
        receivers.clear();
        asked.clear();
        for (i, point) in points.iter().enumerate() {
            if let Some(incident) = direct(&point.surface, &self.lights[light])
                && self.faces(light, &point.receiver)
            {
                receivers.push(point.receiver);
                asked.push((i as u32, incident.radiance));
            }
        }
        match &self.structures.lights[light] {
            LightShadows::Grid(grid) => grid.shadowed(receivers, scratch, shadow),
            LightShadows::Nothing | LightShadows::Pixels(_) | LightShadows::Area(_) => {
                shadow.clear();
                shadow.resize(receivers.len(), false);
            }
        }
        // From here on those that nothing opaque hides.
        let mut kept = shadow.iter().map(|in_shadow| !in_shadow);
        receivers.retain(|_| kept.next() == Some(true));
        let mut kept = shadow.iter().map(|in_shadow| !in_shadow);
        asked.retain(|_| kept.next() == Some(true));
        self.pass(light, receivers, veil_scratch, passed);
        for (&(i, radiance), &passed) in asked.iter().zip(&*passed) {
            points[i as usize].color += radiance * passed;
        }
    }

    /// Whether a light is on the side of a surface that the eye sees. Casters are chosen by the same decision, so
    /// that rounding at a terminator cannot let light through.
    fn faces(&self, light: usize, receiver: &Receiver) -> bool {
        let Some(plan) = &self.ends[light] else {
            return true;
        };
        let corners = triangles(self.geometry).corners(receiver.prim);
        let (lit, seen) = (exact::side(corners, &plan.light), exact::side(corners, &self.eye));
        (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0)
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
    fn transmittance(&self, bvh: &Bvh, receiver: &Receiver, light: &Light, filters: &mut Vec<u32>) -> Vec3 {
        let (origin, dir) = exact::shadow_line(receiver, light);
        filters.clear();
        bvh.each_shadow(receiver, light, &mut (), |prim| {
            filters.push(prim);
            ControlFlow::Continue(())
        });
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
