//! Frames with several eye rays a pixel, spread over the pixel, a lens and the time that a shutter is open.
//!
//! Source: HM08 §5.1 (depth of field and motion blur through a perspective grid); Cook, Porter and Carpenter 1984
//! (distributed rays). Eye rays nearly share an origin, shadow rays end in a light: each of these vantages has
//! perspective grids of triangles that move. A directional light, whose rays share no point, uses the camera's.
//!
//! ```text
//! pixel --MovingCamera::ray--> ray, time --MovingAt::closest--> surface of that time
//!                                          MovingAt::shadows of each light at that time --> colour, averaged
//! ```
//!
//! Every decision is exact at its own time, and a pixel's samples depend on its place alone, so the picture is the same
//! for any number of threads. Layers but colour and alpha show the middle of the pixel and of the lens when the
//! shutter opens. Limits: lights stand still while the shutter is open; triangles are those that have area when it opens; all
//! triangles cast shadows from both sides; surfaces send out no rays of their own.

mod light;

use std::borrow::Cow;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use rayward_scene::{AlphaMode, FrameGeometry, PosedCamera, PosedLight, Scene};
use rayward_trace::exact::ExactHit;
use rayward_trace::solids::{Crossing, Solid, SolidGrids, SolidReceiver};
use rayward_trace::{
    Candidates, FaceOptions, Light, MovingAt, MovingGrids, MovingTriangles, Ray, Receiver, ViewRay,
};

use crate::geometry::triangles;
use crate::lens::{Lens, MovingCamera};
use crate::pixel_samples::PixelSample;
use crate::plan::{FramePlan, LightPlan};
use crate::shade::object_of;
use crate::solids::{self, first_ids};
use crate::{
    CameraFrame, Error, Film, FrameStats, Layers, Progress, RenderOptions, RenderedFrame, Result, Sample,
    Shader, ShadingLight, StructureStats, Surface, SurfacePoint, TileMut,
};
use light::{FrameLight, RayIndex, Seen};

/// Where everything is when the shutter closes.
#[derive(Clone, Copy, Debug)]
pub struct Shutter<'g> {
    /// The geometry, of the same scene as that of the opening.
    pub geometry: &'g FrameGeometry,
    /// The camera.
    pub camera: &'g PosedCamera,
}

/// Slices of the shutter with grids of their own.
const SLICES: u32 = 6;

/// Side of a tile in pixels.
const TILE: u32 = 16;

/// Layers less visible than this are left out.
const INVISIBLE: f32 = 1.0 / 512.0;

/// What all pixels of a frame share.
struct Frame<'f> {
    shader: &'f Shader<'f>,
    open: &'f FrameGeometry,
    close: &'f FrameGeometry,
    camera: MovingCamera<'f>,
    moving: MovingTriangles<'f>,
    eye: MovingGrids<'f>,
    /// Grids of solids around the eye, if there are any.
    solids: Option<SolidGrids<'f>>,
    lights: Vec<FrameLight<'f>>,
    /// Whether each material is masked or blended; empty if none is.
    transparent: Vec<bool>,
    options: &'f RenderOptions,
}

/// Working memory of one thread.
#[derive(Default)]
struct Work {
    hits: Vec<(u32, ExactHit)>,
    blockers: Vec<u32>,
    shadow_rays: u64,
}

/// Renders a frame; `close` is where everything is when the shutter closes.
pub(crate) fn render(
    (scene, shader): (&Scene, &Shader),
    open: (&FrameGeometry, &PosedCamera),
    close: Shutter,
    lights: &[PosedLight],
    options: &RenderOptions,
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<RenderedFrame> {
    let (geometry, camera) = open;
    check(camera, options.lens)?;
    let frames = [camera, close.camera]
        .map(|camera| CameraFrame::new(camera, geometry.origin, options.width, options.height));
    let [camera_open, camera_close] = frames;
    let (camera_open, camera_close) = (camera_open?, camera_close?);
    let mut film = Film::new(options.width, options.height, options.layers)?;
    let start = Instant::now();
    let mut stats = FrameStats {
        triangles: geometry.triangle_count(),
        dropped_non_finite: geometry.dropped_non_finite,
        dropped_degenerate: geometry.dropped_degenerate,
        solids: geometry.solids.len(),
        eye_rays: options.pixels() * u64::from(options.pixel_samples.max(1)),
        ..FrameStats::default()
    };
    let closing = closing(geometry, close.geometry);
    let moving = MovingTriangles::new(triangles(geometry), triangles(&closing));
    let middle = (camera_open.eye.as_dvec3() + camera_close.eye.as_dvec3()) * 0.5;
    let shapes = [geometry, close.geometry].map(solids::solids);
    let movers = Movers {
        triangles: moving,
        solids: &shapes,
        reference: options.reference,
    };
    let eye = movers.grids(middle, "grids around the eye".into(), &mut stats);
    let frame_lights = movers.lights((geometry, lights), options, &mut stats);
    let frame = Frame {
        shader,
        open: geometry,
        close: &closing,
        camera: MovingCamera {
            open: &camera_open,
            close: &camera_close,
            lens: options.lens,
        },
        moving,
        eye,
        solids: movers.solid_grids(middle),
        lights: frame_lights,
        transparent: transparent(scene, geometry),
        options,
    };
    stats.build = start.elapsed();

    let start = Instant::now();
    let mut tiles = film.tiles_mut(TILE, TILE);
    let (done, total) = (AtomicU64::new(0), tiles.len() as u64);
    stats.shadow_rays = tiles
        .par_iter_mut()
        .map_init(Work::default, |work, tile| {
            work.shadow_rays = 0;
            frame.tile(tile, work);
            progress(Progress {
                done: done.fetch_add(1, Ordering::Relaxed) + 1,
                total,
            });
            work.shadow_rays
        })
        .sum();
    drop(tiles);
    stats.trace = start.elapsed();
    Ok(RenderedFrame { film, stats })
}

/// The triangles of the opening at their places when the shutter closes. A frame leaves out triangles without area,
/// which need not be the same at both times.
fn closing<'g>(open: &FrameGeometry, close: &'g FrameGeometry) -> Cow<'g, FrameGeometry> {
    if open.indices == close.indices {
        return Cow::Borrowed(close);
    }
    Cow::Owned(FrameGeometry {
        indices: open.indices.clone(),
        objects: open.objects.clone(),
        ..close.clone()
    })
}

fn check(camera: &PosedCamera, lens: Option<Lens>) -> Result<()> {
    let usable = |lens: Lens| {
        let positive = lens.focus > 0.0 && lens.focus.is_finite();
        positive && lens.radius >= 0.0 && lens.radius.is_finite()
    };
    if lens.is_none_or(usable) {
        return Ok(());
    }
    Err(Error::Camera {
        name: camera.name.clone(),
        problem: "the lens has a negative radius or is focused on nothing before it",
    })
}

/// What moves while the shutter is open.
#[derive(Clone, Copy)]
struct Movers<'f> {
    triangles: MovingTriangles<'f>,
    solids: &'f [Vec<Solid>; 2],
    /// Whether every triangle and every solid is tested.
    reference: bool,
}

impl<'f> Movers<'f> {
    fn grids(self, center: DVec3, name: String, stats: &mut FrameStats) -> MovingGrids<'f> {
        if self.reference {
            return MovingGrids::every(self.triangles);
        }
        let start = Instant::now();
        let grids = MovingGrids::build(center, self.triangles, SLICES, &FaceOptions::default());
        stats.structures.push(StructureStats {
            name,
            build: start.elapsed(),
            bytes: grids.bytes(),
            cells: grids.cell_count(),
            references: grids.reference_count(),
        });
        grids
    }

    /// None without solids.
    fn solid_grids(self, center: DVec3) -> Option<SolidGrids<'f>> {
        let [open, close] = self.solids;
        if open.is_empty() {
            return None;
        }
        Some(if self.reference {
            SolidGrids::every([open, close])
        } else {
            SolidGrids::moving(center, [open, close], &FaceOptions::default())
        })
    }

    /// All lights with what is around those that have a place.
    fn lights(
        self,
        (geometry, lights): (&FrameGeometry, &[PosedLight]),
        options: &RenderOptions,
        stats: &mut FrameStats,
    ) -> Vec<FrameLight<'f>> {
        let plan = FramePlan::new(geometry, lights, options);
        let light = |(light, plan): (&PosedLight, &Option<LightPlan>)| {
            let end = plan.as_ref().map(|plan| plan.light);
            let place = end.and_then(|end| match end {
                Light::Point(position) => Some(position.as_dvec3()),
                Light::Directional(_) => None,
            });
            let name = || format!("grids around light {:?}", light.name);
            FrameLight {
                shading: ShadingLight::new(light, geometry.origin),
                end,
                area: plan.as_ref().and_then(|plan| plan.area),
                grids: place.map(|place| self.grids(place, name(), stats)),
                solids: place.and_then(|place| self.solid_grids(place)),
            }
        };
        lights.iter().zip(&plan.lights).map(light).collect()
    }
}

fn transparent(scene: &Scene, geometry: &FrameGeometry) -> Vec<bool> {
    let transparent = |material: usize| scene.materials[material].alpha_mode != AlphaMode::Opaque;
    if !geometry
        .objects
        .iter()
        .any(|object| transparent(object.material as usize))
    {
        return Vec::new();
    }
    (0..scene.materials.len()).map(transparent).collect()
}

fn line(ray: &Ray) -> ViewRay {
    ViewRay {
        origin: ray.origin.as_dvec3(),
        dir: ray.dir.as_dvec3(),
    }
}

impl Frame<'_> {
    fn tile(&self, tile: &mut TileMut, work: &mut Work) {
        let samples = self.options.pixel_samples.max(1);
        let share = 1.0 / samples as f32;
        for y in 0..tile.height {
            for x in 0..tile.width {
                let (px, py) = (tile.x + x, tile.y + y);
                if self.options.shard.is_some_and(|shard| !shard.has_pixel(px, py)) {
                    continue;
                }
                let mut pixel = if self.options.layers == Layers::default() {
                    Sample::background(Vec3::ZERO)
                } else {
                    self.middle(px, py, work)
                };
                (pixel.color, pixel.alpha) = (Vec3::ZERO, 0.0);
                for index in 0..samples {
                    let sample = PixelSample::new(px, py, index);
                    let place = RayIndex {
                        pixel: py * self.options.width + px,
                        sample: index,
                        time: sample.time,
                    };
                    let (color, alpha) = self.radiance(&self.camera.ray(px, py, &sample), place, work);
                    pixel.color += color * share;
                    pixel.alpha += alpha * share;
                }
                tile.put(x, y, &pixel);
            }
        }
    }

    /// What the middle of a pixel sees through the middle of the lens when the shutter opens.
    fn middle(&self, x: u32, y: u32, work: &mut Work) -> Sample {
        let middle = PixelSample {
            pixel: [0.5; 2],
            lens: [0.5; 2],
            time: 0.0,
        };
        let ray = self.camera.ray(x, y, &middle);
        let first = self.see(&ray, &self.eye.at(0.0), work).copied();
        let end = first.map_or(f64::INFINITY, |(_, hit)| hit.t);
        if let Some((id, crossing)) = self.solid_before(&ray, 0.0, end) {
            let [object, prim] = first_ids(self.open).map(|first| first + id);
            let depth = crossing.t as f32;
            return Sample {
                color: Vec3::ZERO,
                alpha: 0.0,
                depth,
                distance: depth * ray.dir.length(),
                normal: self.solid_surface(&ray, 0.0, id, &crossing).0.normal,
                object,
                prim,
                bary: Vec2::ZERO,
            };
        }
        let Some((prim, hit)) = first else {
            return Sample::background(Vec3::ZERO);
        };
        let depth = hit.t as f32;
        Sample {
            color: Vec3::ZERO,
            alpha: 0.0,
            depth,
            distance: depth * ray.dir.length(),
            normal: self.surface(&ray, 0.0, prim, &hit).normal,
            object: object_of(self.open, prim),
            prim,
            bary: Vec2::new(hit.u as f32, hit.v as f32),
        }
    }

    /// Notes what a ray meets: the closest triangle, or all in order if some are transparent. Returns the first.
    fn see<'w>(&self, ray: &Ray, now: &MovingAt, work: &'w mut Work) -> Option<&'w (u32, ExactHit)> {
        if self.transparent.is_empty() {
            work.hits.clear();
            work.hits.extend(now.closest(ray, &mut ()));
        } else {
            now.every(ray, &mut (), &mut work.hits);
            work.hits
                .sort_unstable_by(|(p, a), (q, b)| a.t.total_cmp(&b.t).then(p.cmp(q)));
        }
        work.hits.first()
    }

    /// Colour and coverage that one ray sees.
    fn radiance(&self, ray: &Ray, place: RayIndex, work: &mut Work) -> (Vec3, f32) {
        let time = place.time;
        let now = self.eye.at(time);
        self.see(ray, &now, work);
        let hits = std::mem::take(&mut work.hits);
        // Where all is opaque there is one hit at most.
        let end = match hits.last() {
            Some((_, hit)) if self.transparent.is_empty() => hit.t,
            _ => f64::INFINITY,
        };
        let solid = self.solid_before(ray, time, end);
        let solid_t = solid.map_or(f64::INFINITY, |(_, crossing)| crossing.t);
        let (mut color, mut left) = (Vec3::ZERO, 1.0);
        for (prim, hit) in hits.iter().take_while(|(_, hit)| hit.t <= solid_t) {
            let surface = self.surface(ray, time, *prim, hit);
            let weight = left * surface.alpha;
            if weight > 0.0 {
                let seen = Seen {
                    surface: &surface,
                    receiver: Receiver::on_surface(ray, hit.t, *prim),
                    on: None,
                    from: Light::Point(ray.origin),
                };
                color += self.shaded(&seen, place, work) * weight;
                left -= weight;
            }
            if left < INVISIBLE {
                left = 0.0;
                break;
            }
        }
        work.hits = hits;
        if let Some((id, crossing)) = solid.filter(|_| left > 0.0) {
            let (surface, receiver) = self.solid_surface(ray, time, id, &crossing);
            let seen = Seen {
                surface: &surface,
                receiver: receiver.among_triangles(),
                on: receiver.on,
                from: Light::Point(ray.origin),
            };
            color += self.shaded(&seen, place, work) * left;
            left = 0.0;
        }
        (color + self.options.background * left, 1.0 - left)
    }

    /// The solid that a ray meets before this parameter.
    fn solid_before(&self, ray: &Ray, time: f64, end: f64) -> Option<(u32, Crossing)> {
        let solids = self.solids.as_ref()?.at(time);
        let found = solids.closest(&line(ray), [0.0, end], None, &mut ())?;
        (found.1.t < end).then_some(found)
    }

    /// The surface of a solid where a ray crosses it.
    fn solid_surface(&self, ray: &Ray, time: f64, id: u32, crossing: &Crossing) -> (Surface, SolidReceiver) {
        let solid = self.solids.as_ref().map(|solids| solids.at(time).solid(id));
        let solid = solid.expect("it has been met");
        let receiver = SolidReceiver::along(&line(ray), id, &solid, crossing);
        let material = self.open.solids[id as usize].material;
        let view = (-ray.dir).normalize();
        let surface = self
            .shader
            .solid_surface(material, receiver.point, crossing, view);
        (surface, receiver)
    }

    /// The surface at a hit at a time. Attributes that move are between those of the shutter's two ends.
    fn surface(&self, ray: &Ray, time: f64, prim: u32, hit: &ExactHit) -> Surface {
        let point = SurfacePoint {
            prim,
            object: object_of(self.open, prim),
            u: hit.u as f32,
            v: hit.v as f32,
            view: (-ray.dir).normalize(),
            footprint: self.camera.open.footprint(hit.t as f32) * self.options.footprint_share(),
        };
        let opening = self.shader.surface(self.open, &point);
        if self.moving.corners(prim, 1.0) == self.moving.corners(prim, 0.0) {
            return opening;
        }
        let corners = self.moving.corners(prim, time);
        let there = self.shader.surface(self.close, &point);
        let s = time as f32;
        let [a, b, c] = corners;
        let outward = (b - a)
            .as_dvec3()
            .cross((c - a).as_dvec3())
            .normalize_or_zero()
            .as_vec3();
        let side = if outward.dot(point.view) < 0.0 { -1.0 } else { 1.0 };
        let geometric_normal = outward * side;
        // Either end may show its other side; normals are mixed on the side of the opening's.
        let facing = |surface: &Surface| {
            if surface.front {
                surface.normal
            } else {
                -surface.normal
            }
        };
        let normal = facing(&opening).lerp(facing(&there), s).normalize_or(outward) * side;
        Surface {
            position: a + (b - a) * point.u + (c - a) * point.v,
            geometric_normal,
            normal,
            front: side > 0.0,
            ..opening
        }
    }
}
