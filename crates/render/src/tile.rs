//! One tile: eye hits, surfaces, shadows light by light, colours (HM08 §3: eye rays drive everything, shadow
//! rays are spawned for a tile of hits at a time).

use glam::{DVec3, Vec2, Vec3};
use rayward_scene::FrameGeometry;
use rayward_trace::{Accel, Bvh, Hit, Light, Ray, Receiver, ShadowScratch, Tile, TileHits, exact};

use crate::casters::{CasterRules, triangles};
use crate::plan::LightPlan;
use crate::shade::{ambient, direct, object_of};
use crate::structures::FrameStructures;
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
    pub(crate) rules: &'f CasterRules<'f>,
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
    layers: Vec<Hit>,
    filters: Vec<Hit>,
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

/// Layers less visible than this are left out.
const INVISIBLE: f32 = 1.0 / 512.0;

impl TileShader<'_> {
    /// Renders the tile of that index into its part of the film.
    pub(crate) fn render(&self, index: u32, work: &mut TileWork, out: &mut TileMut) -> TileCounts {
        let tile = self.structures.eye.tile(index);
        self.structures.eye.trace_tile(&tile, &mut work.hits);
        work.points.clear();
        work.scratch.counts = rayward_trace::ShadowCounts::default();
        for y in 0..tile.height {
            for x in 0..tile.width {
                let sample = self.see(&tile, [x, y], work);
                out.put(x, y, &sample);
            }
        }
        for light in 0..self.lights.len() {
            self.illuminate(light, work);
        }
        for point in &work.points {
            out.color_row(point.y)[point.x as usize] += point.color * point.weight;
        }
        TileCounts {
            shadow_rays: work.scratch.counts.receivers,
            exact_pixels: work.hits.exact_pixels as u64,
            lit_by_cell: work.scratch.counts.lit_by_cell,
        }
    }

    /// Notes the surfaces that a pixel sees; returns the pixel without their light.
    fn see(&self, tile: &Tile, [x, y]: [u32; 2], work: &mut TileWork) -> Sample {
        let mut sample = Sample::background(self.options.background);
        let Some(prim) = work.hits.prim(x, y) else {
            return sample;
        };
        let ray = self.structures.eye.view().pixel_ray(tile.x + x, tile.y + y);
        let eye_ray = Ray::new(ray.origin.as_vec3(), ray.dir.as_vec3());
        let corners = triangles(self.geometry).corners(prim);
        let Some(hit) = exact::attributes(ray.origin, ray.dir, corners) else {
            return sample;
        };
        let object = object_of(self.geometry, prim);
        let (t, length) = (hit.t as f32, ray.dir.length() as f32);
        let point = SurfacePoint {
            prim,
            object,
            u: hit.u as f32,
            v: hit.v as f32,
            view: (-ray.dir.normalize()).as_vec3(),
            footprint: self.camera.footprint(t),
        };
        let surface = self.shader.surface(self.geometry, &point);
        sample = Sample {
            color: Vec3::ZERO,
            alpha: 1.0,
            depth: t,
            distance: t * length,
            normal: surface.normal,
            object,
            prim,
            bary: Vec2::new(point.u, point.v),
        };
        let receiver = Receiver::on_surface(&eye_ray, hit.t, prim);
        let receiver = Receiver {
            point: ray.origin + ray.dir * hit.t,
            ..receiver
        };
        let first = ShadedPoint {
            x,
            y,
            receiver,
            weight: surface.alpha,
            color: self.glow(&surface),
            surface,
        };
        let mut left = 1.0 - first.weight;
        work.points.push(first);
        let first_hit = Hit {
            t,
            u: point.u,
            v: point.v,
            prim,
        };
        if let (true, Some(bvh)) = (left > 0.0, &self.structures.layers) {
            left = self.see_through(bvh, &eye_ray, &first_hit, [x, y], work);
        }
        sample.alpha = 1.0 - left;
        sample.color = self.options.background * left;
        sample
    }

    /// Notes what is seen behind a surface that does not cover its pixel, front to back; returns the share of the
    /// pixel that nothing covers.
    fn see_through(&self, bvh: &Bvh, ray: &Ray, first: &Hit, [x, y]: [u32; 2], work: &mut TileWork) -> f32 {
        let mut left = 1.0 - work.points.last().map_or(0.0, |point| point.weight);
        bvh.all_hits(ray, &mut work.layers);
        for hit in work
            .layers
            .iter()
            .filter(|h| h.prim != first.prim && h.t >= first.t)
        {
            let object = object_of(self.geometry, hit.prim);
            let point = SurfacePoint {
                prim: hit.prim,
                object,
                u: hit.u,
                v: hit.v,
                view: -ray.dir.normalize(),
                footprint: self.camera.footprint(hit.t),
            };
            let surface = self.shader.surface(self.geometry, &point);
            let exact = exact::attributes(
                ray.origin.as_dvec3(),
                ray.dir.as_dvec3(),
                triangles(self.geometry).corners(hit.prim),
            );
            let t = exact.map_or(f64::from(hit.t), |h| h.t);
            let receiver = Receiver::on_surface(ray, t, hit.prim);
            let weight = left * surface.alpha;
            left -= weight;
            if weight > 0.0 {
                work.points.push(ShadedPoint {
                    x,
                    y,
                    receiver,
                    weight,
                    color: self.glow(&surface),
                    surface,
                });
            }
            if left < INVISIBLE {
                return 0.0;
            }
        }
        left
    }

    /// Light that needs no shadow ray.
    fn glow(&self, surface: &Surface) -> Vec3 {
        ambient(surface, self.options.ambient)
    }

    /// Adds the light of one source to all points of the tile that it reaches.
    fn illuminate(&self, light: usize, work: &mut TileWork) {
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
            if let Some(incident) = direct(&point.surface, &self.lights[light]) {
                receivers.push(point.receiver);
                asked.push((i as u32, incident.radiance));
            }
        }
        match &self.structures.lights[light] {
            Some(grid) => grid.shadowed(receivers, scratch, shadow),
            None => {
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

    /// Share of the light that masked and blended triangles let through to a receiver.
    fn transmittance(&self, bvh: &Bvh, receiver: &Receiver, light: &Light, hits: &mut Vec<Hit>) -> f32 {
        let triangles = triangles(self.geometry);
        let towards: DVec3 = light.towards(receiver.point);
        let mut ray = Ray::new(receiver.point.as_vec3(), towards.as_vec3());
        if matches!(light, Light::Point(_)) {
            ray.t_max = 1.0;
        }
        bvh.all_hits(&ray, hits);
        let mut passed = 1.0;
        for hit in hits {
            let filters =
                self.rules.is_transparent(hit.prim) && exact::shadows(&triangles, hit.prim, receiver, light);
            if filters {
                let object = object_of(self.geometry, hit.prim);
                passed *= 1.0
                    - self
                        .shader
                        .coverage(self.geometry, hit.prim, object, hit.u, hit.v);
            }
        }
        passed
    }
}
