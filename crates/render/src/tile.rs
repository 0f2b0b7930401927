//! One tile: eye hits, surfaces, shadows light by light, colours (HM08 §3: eye rays drive everything, shadow
//! rays are spawned for a tile of hits at a time).

mod soft;

use std::ops::ControlFlow;

use glam::{Vec2, Vec3};
use rayward_scene::FrameGeometry;
use rayward_trace::{
    AreaCounts, AreaScratch, Bvh, Light, Receiver, ShadowScratch, Tile, TileHits, ViewRay, exact,
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
    layers: Vec<(f64, u32)>,
    filters: Vec<u32>,
}

/// A surface seen by a pixel, or one of several behind each other.
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

    /// Notes the surfaces that a pixel sees; returns the pixel without their light.
    fn see(&self, tile: &Tile, [x, y]: [u32; 2], work: &mut TileWork) -> Sample {
        let background = Sample::background(self.options.background);
        let seen = self.structures.seen(tile, x, y);
        let Some(prim) = seen.unwrap_or_else(|| work.hits.prim(x, y)) else {
            return background;
        };
        let ray = self.structures.eye.view().pixel_ray(tile.x + x, tile.y + y);
        let Some((hit, first)) = self.point([x, y], &ray, prim, 1.0) else {
            return background;
        };
        let (depth, covered) = (hit.t as f32, first.weight);
        let mut sample = Sample {
            color: Vec3::ZERO,
            alpha: 1.0,
            depth,
            distance: depth * ray.dir.length() as f32,
            normal: first.surface.normal,
            object: object_of(self.geometry, prim),
            prim,
            bary: Vec2::new(hit.u as f32, hit.v as f32),
        };
        work.points.push(first);
        let mut left = 1.0 - covered;
        if let (true, Some(bvh)) = (left > 0.0, &self.structures.layers) {
            left = self.see_through(bvh, [x, y], &ray, (hit.t, prim), left, work);
        }
        sample.alpha = 1.0 - left;
        sample.color = self.options.background * left;
        sample
    }

    /// Where a ray meets a triangle that it is known to meet, and the surface there; `left` is the share of the
    /// pixel that nothing before it covers.
    fn point(
        &self,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        prim: u32,
        left: f32,
    ) -> Option<(exact::ExactHit, ShadedPoint)> {
        let hit = exact::attributes(ray.origin, ray.dir, triangles(self.geometry).corners(prim))?;
        let surface = self.shader.surface(
            self.geometry,
            &SurfacePoint {
                prim,
                object: object_of(self.geometry, prim),
                u: hit.u as f32,
                v: hit.v as f32,
                view: (-ray.dir.normalize()).as_vec3(),
                footprint: self.camera.footprint(hit.t as f32),
            },
        );
        let point = ShadedPoint {
            x,
            y,
            receiver: Receiver::along(ray, hit.t, prim),
            weight: left * surface.alpha,
            color: ambient(&surface, self.options.ambient),
            surface,
        };
        Some((hit, point))
    }

    /// Notes what is seen behind a surface that does not cover its pixel, front to back; returns the share of the
    /// pixel that nothing covers.
    fn see_through(
        &self,
        bvh: &Bvh,
        pixel: [u32; 2],
        ray: &ViewRay,
        first: (f64, u32),
        mut left: f32,
        work: &mut TileWork,
    ) -> f32 {
        bvh.along(ray, &mut (), &mut work.layers);
        for &(_, prim) in work.layers.iter().skip_while(|hit| **hit != first).skip(1) {
            let Some((_, point)) = self.point(pixel, ray, prim, left) else {
                continue;
            };
            left -= point.weight;
            if point.weight > 0.0 {
                work.points.push(point);
            }
            if left < INVISIBLE {
                return 0.0;
            }
        }
        left
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
            filters,
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
        for ((&(i, radiance), receiver), _) in asked
            .iter()
            .zip(&*receivers)
            .zip(&*shadow)
            .filter(|(_, in_shadow)| !**in_shadow)
        {
            let passed = match (&self.structures.layers, &self.ends[light]) {
                (Some(bvh), Some(plan)) => self.transmittance(bvh, receiver, &plan.light, filters),
                _ => 1.0,
            };
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

    /// Share of the light that masked and blended triangles let through to a receiver.
    fn transmittance(&self, bvh: &Bvh, receiver: &Receiver, light: &Light, filters: &mut Vec<u32>) -> f32 {
        let (origin, dir) = match *light {
            Light::Point(position) => (position.as_dvec3(), receiver.point - position.as_dvec3()),
            Light::Directional(direction) => (receiver.point, direction.as_dvec3()),
        };
        filters.clear();
        bvh.each_shadow(receiver, light, &mut (), |prim| {
            filters.push(prim);
            ControlFlow::Continue(())
        });
        filters.sort_unstable();
        let coverage = |&prim: &u32| {
            let hit = exact::attributes(origin, dir, triangles(self.geometry).corners(prim))?;
            let object = object_of(self.geometry, prim);
            let (u, v) = (hit.u as f32, hit.v as f32);
            Some(self.shader.coverage(self.geometry, prim, object, u, v))
        };
        filters
            .iter()
            .filter_map(coverage)
            .map(|covered| 1.0 - covered)
            .product()
    }
}
