//! Rays that leave what a tile sees: reflections, refractions and, on request, diffuse light from other surfaces
//! (VMV07 §1 traces the same rays after the first surfaces are known; its structure for them is another one).
//!
//! They go in waves, one a bounce: all rays of the tile are traced together, the surfaces they meet are lit, and send
//! out the next wave. A surface that both reflects and transmits sends out both rays; none is dropped by chance, only
//! where less than [`FAINT`] of the pixel is left. The first rough surface that is seen, by the eye or in mirrors and
//! through clear glass, draws as many rays for a lobe as a light with a size has samples, times the share of the pixel
//! that they bring light to; later surfaces draw one.
//!
//! ```text
//! depart: surface --lobes--> flights --SecondaryTracer--> arrive: surface --light--> lit, departs again
//!                                            '--nothing met--> beyond: environment or background
//! ```
//!
//! Limits: a volume inside of another one ends the outer one. Reflections rougher than [`GLOSSY`] see the
//! environment but no surfaces unless diffuse light is traced, too. Lights shine straight through thin
//! walls, but not through boundaries of volumes, which cast shadows like all else: such light is found only by diffuse
//! rays that meet the glass.

mod beams;
mod light;

use glam::Vec3;
use rayward_trace::solids::{Crossing, SolidReceiver};
use rayward_trace::{Light, Receiver, Samples, SurfaceRay, Tile, ViewRay, exact};

use crate::secondary::{SecondaryTracer, SurfaceHit};
use crate::shade::lobes::{self, Lobe};
use crate::shade::{Traced, around, brdf, object_of};
use crate::solids::OnSolid;
use crate::tile::{ShadedPoint, TileShader, TileWork};
use crate::{Surface, SurfacePoint, TileMut};

/// Roughness above which reflections of surfaces are not traced unless diffuse light is.
pub(crate) const GLOSSY: f32 = 0.4;

/// A ray of which less than this reaches the pixel is not sent.
const FAINT: f32 = 1.0 / 4096.0;

/// Masked and blended surfaces, and thin walls, that a ray passes at most.
const MOST_PASSED: u32 = 64;

/// Purposes of random numbers; the first choices at a surface are those of rays.
const REFLECTED: u32 = 1;
const TRANSMITTED: u32 = 2;
const DIFFUSED: u32 = 3;
const SURROUNDING: u32 = 4;
const COATED: u32 = 8;

/// Which of all paths of a frame this is: what its random numbers depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Path(u32);

impl Path {
    /// The path that goes on from this one by one choice among several.
    fn branch(self, choice: u32) -> Self {
        Self(self.0.wrapping_mul(0x2c1b_3c6d).wrapping_add(choice))
    }
}

/// A ray on its way, with all it will need where it arrives.
#[derive(Clone, Copy, Debug)]
struct Flight {
    pixel: [u32; 2],
    /// Share of what it meets that the pixel shows.
    weight: Vec3,
    /// The same while only smooth lobes were on its way, else 0.
    sharp: f32,
    ray: SurfaceRay,
    /// The solid it starts on, if any.
    on: OnSolid,
    /// Density with which its direction was drawn, and how many directions were drawn from the environment there.
    density: f32,
    drawn: f32,
    /// Bounces up to here, and surfaces passed since.
    bounces: u32,
    passed: u32,
    /// Absorption of the volume it runs in.
    absorption: Vec3,
    /// Whether it sees the surrounding light where nothing is, instead of the background.
    diffuse: bool,
    /// Whether it or one before it was such.
    diffused: bool,
    /// Whether it sees lights with a size.
    shows_lights: bool,
    cone: Cone,
    path: Path,
}

impl Flight {
    /// Absorption on the way to a surface. A ray that leaves a volume it did not enter has been in it from the start.
    fn absorption_until(&self, surface: &Surface) -> Vec3 {
        if !surface.front && !surface.thin && self.absorption == Vec3::ZERO {
            surface.absorption * surface.transmission.ceil()
        } else {
            self.absorption
        }
    }

    /// The pixel's footprint after this distance.
    fn cone_after(&self, distance: f32) -> Cone {
        Cone {
            width: self.cone.width + self.cone.spread * distance,
            ..self.cone
        }
    }
}

/// Width of a sample's footprint along a ray, metres, and its growth per metre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    pub(crate) width: f32,
    spread: f32,
}

/// A surface that a path has come to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    pixel: [u32; 2],
    weight: Vec3,
    /// Share of the pixel that shows the surface by smooth lobes alone: what its samples are worth.
    sharp: f32,
    /// Whether a diffuse ray is on the path.
    diffused: bool,
    /// Whether the last ray of the path sees lights with a size.
    shows_lights: bool,
    /// Density of that ray, and directions drawn from the environment where it started.
    density: f32,
    drawn: f32,
    surface: Surface,
    receiver: Receiver,
    on: OnSolid,
    bounces: u32,
    cone: Cone,
    path: Path,
    /// Absorption of the volume the path came through.
    absorption: Vec3,
    /// From where the surface is seen.
    seen_from: Light,
    /// Light it sends back along the path.
    pub(crate) color: Vec3,
}

impl Arrival {
    /// The point as a receiver of what solids cast.
    fn among_solids(&self) -> SolidReceiver {
        SolidReceiver {
            on: self.on,
            ..SolidReceiver::from(&self.receiver)
        }
    }
}

/// Working memory of one thread.
#[derive(Debug, Default)]
pub(crate) struct BounceWork {
    flights: Vec<Flight>,
    next: Vec<Flight>,
    rays: Vec<SurfaceRay>,
    hits: Vec<SurfaceHit>,
    pub(crate) arrivals: Vec<Arrival>,
    filters: Vec<u32>,
    /// Rays from surfaces to others, and to lights and the environment.
    pub(crate) secondary_rays: u64,
    pub(crate) shadow_rays: u64,
}

impl TileShader<'_> {
    /// Point `k` of the random ones that a path has for a purpose.
    fn draw(&self, path: Path, purpose: u32, k: u32) -> [f32; 2] {
        let seed = self.options.seed.wrapping_add(purpose.wrapping_mul(0x85eb_ca6b));
        Samples::new(1, seed).point(path.0, k)
    }

    /// Which lobes of a surface go on after this many bounces.
    pub(crate) fn traced(&self, surface: &Surface, bounces: u32) -> Traced {
        if self.secondary.is_none() || surface.unlit || bounces >= self.options.bounces {
            return Traced::default();
        }
        let diffusion = bounces < self.options.diffuse_bounces;
        let coat = &surface.coat;
        Traced {
            coat: coat.reflectance > 0.0 && (diffusion || coat.roughness <= GLOSSY),
            reflection: diffusion || surface.roughness <= GLOSSY,
            transmission: surface.transmission > 0.0,
            diffusion,
        }
    }

    /// Light of a surface that comes neither from a light nor along a traced ray: its own, and that from around.
    pub(crate) fn resting(&self, surface: &Surface, bounces: u32) -> Vec3 {
        let (surrounding, traced) = self.surrounding(surface, bounces);
        let mut light = around(surface, surrounding, traced);
        self.show_environment(surface, traced, &mut light);
        light
    }

    /// Radiance of the surrounding for lobes of a surface that are not traced, and those that are.
    pub(crate) fn surrounding(&self, surface: &Surface, bounces: u32) -> (Vec3, Traced) {
        let radiance = if self.environment.is_some() {
            Vec3::ZERO
        } else {
            self.options.ambient
        };
        (radiance, self.traced(surface, bounces))
    }

    /// Adds the environment as mirrors that are not traced show it.
    pub(crate) fn show_environment(&self, surface: &Surface, traced: Traced, light: &mut Vec3) {
        let Some(environment) = self.environment.filter(|_| !surface.unlit) else {
            return;
        };
        let mut show = |mirror: &Surface, traced: bool| {
            if !traced
                && lobes::is_smooth(mirror)
                && let Some(lobe) = lobes::reflected(mirror, [0.5; 2])
            {
                // No direction that is drawn from the environment falls into a mirror's lobe.
                *light += lobe.weight * environment.radiance(lobe.towards);
            }
        };
        show(surface, traced.reflection);
        if let Some(coat) = surface.coated() {
            show(&coat, traced.coat);
        }
    }

    /// What is seen along a ray where no surface is.
    pub(crate) fn backdrop(&self, ray: &ViewRay) -> Vec3 {
        match self.environment {
            Some(environment) if self.options.show_environment => {
                environment.radiance(ray.dir.normalize().as_vec3())
            }
            _ => self.options.background,
        }
    }

    /// Adds what the points that a tile sees receive from the environment and from other surfaces.
    pub(crate) fn go_on(&self, tile: &Tile, work: &mut TileWork, out: &mut TileMut) {
        let Some(tracer) = self.secondary else {
            return;
        };
        let TileWork { points, bounce, .. } = work;
        bounce.arrivals.clear();
        bounce
            .arrivals
            .extend(points.iter().map(|point| self.arrival(tile, point)));
        self.surround_arrivals(tracer, bounce);
        for arrival in &bounce.arrivals {
            add(out, arrival.pixel, arrival.weight * arrival.color);
        }
        self.follow(tracer, bounce, out);
    }

    /// A point that the eye sees as one where paths begin, without its light.
    pub(crate) fn arrival(&self, tile: &Tile, point: &ShadedPoint) -> Arrival {
        let depth = (point.receiver.point - self.camera.eye.as_dvec3()).dot(self.camera.forward);
        let [x, y] = [tile.x + point.x, tile.y + point.y];
        Arrival {
            pixel: [point.x, point.y],
            weight: Vec3::splat(point.weight),
            sharp: 1.0,
            diffused: false,
            shows_lights: false,
            density: f32::INFINITY,
            drawn: 0.0,
            surface: point.surface,
            receiver: point.receiver,
            on: point.on,
            bounces: 0,
            cone: self.cone(depth as f32),
            path: Path(y.wrapping_mul(self.camera.width).wrapping_add(x)),
            absorption: Vec3::ZERO,
            seen_from: self.eye,
            color: Vec3::ZERO,
        }
    }

    /// The footprint of a sample where its ray has this depth.
    pub(crate) fn cone(&self, depth: f32) -> Cone {
        let share = self.options.footprint_share();
        Cone {
            width: self.camera.footprint(depth) * share,
            spread: if self.camera.orthographic {
                0.0
            } else {
                self.camera.footprint(1.0) * share
            },
        }
    }

    /// Follows the paths that go on from these arrivals, which are lit already, and adds what they bring.
    fn follow(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork, out: &mut TileMut) {
        work.next.clear();
        for arrival in &work.arrivals {
            self.depart(arrival, &mut work.next);
        }
        while !work.next.is_empty() {
            std::mem::swap(&mut work.flights, &mut work.next);
            work.rays.clear();
            work.rays.extend(work.flights.iter().map(|flight| flight.ray));
            tracer.trace(&work.rays, &mut work.hits);
            work.secondary_rays += work.rays.len() as u64;
            work.arrivals.clear();
            work.next.clear();
            for flight in &work.flights {
                self.measure_ray(flight.pixel, &flight.ray, out);
            }
            let mut made = self.made_together(&work.flights, &work.hits);
            for (flight, hit) in work.flights.iter().zip(&work.hits) {
                let made = hit.and_then(|_| made.next());
                let end = hit.map_or(f64::INFINITY, |(_, hit)| hit.t);
                let solid = self.solid_before(flight, end);
                let nearest = solid.map_or(end, |(_, crossing)| crossing.t);
                let lights = self.lights_along(flight, nearest as f32);
                if lights != Vec3::ZERO {
                    add(out, flight.pixel, flight.weight * lights);
                }
                if let Some(solid) = solid {
                    self.arrive_on_solid(flight, &solid, &mut work.arrivals);
                    continue;
                }
                match hit {
                    Some(hit) => self.arrive(flight, hit, made, &mut work.arrivals, &mut work.next),
                    None => add(out, flight.pixel, flight.weight * self.beyond(flight)),
                }
            }
            self.light_up_arrivals(tracer, work);
            for arrival in &work.arrivals {
                add(out, arrival.pixel, arrival.weight * arrival.color);
                self.depart(arrival, &mut work.next);
            }
        }
    }

    /// The surface that a ray meets; a ray that it lets pass goes on.
    fn arrive(
        &self,
        flight: &Flight,
        &(prim, hit): &(u32, exact::ExactHit),
        made: Option<Surface>,
        arrivals: &mut Vec<Arrival>,
        next: &mut Vec<Flight>,
    ) {
        let distance = hit.t as f32 * flight.ray.dir.length();
        let cone = flight.cone_after(distance);
        let surface = made.unwrap_or_else(|| {
            self.shader
                .surface(self.geometry, &self.met_at(flight, prim, &hit))
        });
        let inside = flight.absorption_until(&surface);
        let weight = flight.weight * absorbed(inside, distance);
        let receiver = Receiver::along(&flight.ray.line(), hit.t, prim);
        if surface.alpha < 1.0 && flight.passed < MOST_PASSED {
            next.push(Flight {
                weight: weight * (1.0 - surface.alpha),
                ray: SurfaceRay {
                    from: receiver,
                    dir: flight.ray.dir,
                },
                on: None,
                passed: flight.passed + 1,
                absorption: inside,
                cone,
                ..*flight
            });
        }
        if surface.alpha > 0.0 {
            arrivals.push(Arrival {
                pixel: flight.pixel,
                weight: weight * surface.alpha,
                sharp: flight.sharp,
                diffused: flight.diffused,
                shows_lights: flight.shows_lights,
                density: flight.density,
                drawn: flight.drawn,
                receiver,
                on: None,
                bounces: flight.bounces,
                cone,
                path: flight.path,
                absorption: inside,
                seen_from: flight.ray.looked_at_from(),
                color: self.resting_unless_together(&surface, flight.bounces),
                surface,
            });
        }
    }

    /// Where a ray meets a triangle, for a surface to be made.
    fn met_at(&self, flight: &Flight, prim: u32, hit: &exact::ExactHit) -> SurfacePoint {
        let length = flight.ray.dir.length();
        SurfacePoint {
            prim,
            object: object_of(self.geometry, prim),
            u: hit.u as f32,
            v: hit.v as f32,
            view: -flight.ray.dir / length,
            footprint: flight.cone_after(hit.t as f32 * length).width,
        }
    }

    /// The solid that a ray meets before this parameter.
    fn solid_before(&self, flight: &Flight, end: f64) -> Option<(u32, Crossing)> {
        let ray = flight.ray.line();
        let start = flight.ray.from.error / ray.dir.length();
        let found = self.solids?.closest(&ray, [start, end], flight.on)?;
        (found.1.t < end).then_some(found)
    }

    /// As [`Self::arrive`], where the ray meets a solid.
    fn arrive_on_solid(
        &self,
        flight: &Flight,
        (id, crossing): &(u32, Crossing),
        arrivals: &mut Vec<Arrival>,
    ) {
        let Some(solids) = self.solids else { return };
        let length = flight.ray.dir.length();
        let distance = crossing.t as f32 * length;
        let receiver = solids.receiver(&flight.ray.line(), *id, crossing);
        let view = -flight.ray.dir / length;
        let surface = self
            .shader
            .solid_surface(solids.material(*id), receiver.point, crossing, view);
        let inside = flight.absorption_until(&surface);
        arrivals.push(Arrival {
            pixel: flight.pixel,
            weight: flight.weight * absorbed(inside, distance),
            sharp: flight.sharp,
            diffused: flight.diffused,
            shows_lights: flight.shows_lights,
            density: flight.density,
            drawn: flight.drawn,
            receiver: receiver.among_triangles(),
            on: receiver.on,
            bounces: flight.bounces,
            cone: flight.cone_after(distance),
            path: flight.path,
            absorption: inside,
            seen_from: flight.ray.looked_at_from(),
            color: self.resting_unless_together(&surface, flight.bounces),
            surface,
        });
    }

    /// Sends out the rays of all lobes of a surface that are traced.
    fn depart(&self, arrival: &Arrival, next: &mut Vec<Flight>) {
        let surface = &arrival.surface;
        let traced = self.traced(surface, arrival.bounces);
        if traced.reflection {
            self.send_mirrored(arrival, (REFLECTED, surface), next);
        }
        if traced.coat
            && let Some(coat) = surface.coated()
        {
            self.send_mirrored(arrival, (COATED, &coat), next);
        }
        if traced.transmission {
            let behind = match (surface.thin, surface.enters_volume()) {
                (true, _) => arrival.absorption,
                (false, true) => surface.absorption,
                (false, false) => Vec3::ZERO,
            };
            let smooth = lobes::is_smooth(surface);
            let rays = self.rays(arrival.sharp, smooth, surface.transmission);
            let draw = |random| lobes::transmitted(surface, random);
            self.send(arrival, (TRANSMITTED, surface), rays, behind, draw, next);
        }
        if traced.diffusion {
            let rays = self.diffused_rays(surface, arrival.sharp);
            let draw = |random| lobes::diffused(surface, random);
            self.send(arrival, (DIFFUSED, surface), rays, arrival.absorption, draw, next);
        }
    }

    /// Sends out the rays of a reflection, of the surface or its coat.
    fn send_mirrored(&self, arrival: &Arrival, (purpose, mirror): (u32, &Surface), next: &mut Vec<Flight>) {
        let rays = self.reflected_rays(mirror, arrival.sharp);
        let draw = |random| lobes::reflected(mirror, random);
        self.send(arrival, (purpose, mirror), rays, arrival.absorption, draw, next);
    }

    /// How many rays a lobe draws that passes on about this share of its light, at a surface that this share of the
    /// pixel shows sharply.
    fn rays(&self, sharp: f32, smooth: bool, share: f32) -> u32 {
        if smooth {
            1
        } else {
            worth(self.options.samples, sharp * share.clamp(0.0, 1.0))
        }
    }

    /// As [`Self::rays`], of the reflection.
    fn reflected_rays(&self, surface: &Surface, sharp: f32) -> u32 {
        let share = brdf::reflectance(surface, surface.normal.dot(surface.view)).max_element();
        self.rays(sharp, lobes::is_smooth(surface), share)
    }

    /// As [`Self::rays`], of diffuse light.
    fn diffused_rays(&self, surface: &Surface, sharp: f32) -> u32 {
        let share = surface.base_color.max(surface.finish.sheen.reflectance);
        self.rays(sharp, false, share.max_element())
    }

    /// How many directions to the environment a surface draws.
    fn directions(&self, sharp: f32) -> u32 {
        worth(self.options.environment_samples, sharp)
    }

    /// Sends out the rays of one lobe, of the surface or its coat.
    fn send(
        &self,
        arrival: &Arrival,
        (purpose, surface): (u32, &Surface),
        rays: u32,
        absorption: Vec3,
        draw: impl Fn([f32; 2]) -> Option<Lobe>,
        next: &mut Vec<Flight>,
    ) {
        let drawn = match self.environment {
            None => 0.0,
            Some(_) => self.directions(arrival.sharp) as f32,
        };
        let smooth = purpose != DIFFUSED && lobes::is_smooth(surface);
        let shows_lights = match purpose {
            DIFFUSED => false,
            TRANSMITTED => !surface.thin || arrival.shows_lights,
            _ => light::shows_lights(surface),
        } && !self.options.paper;
        let diffuse = purpose == DIFFUSED || (purpose != TRANSMITTED && surface.roughness > GLOSSY);
        for i in 0..rays {
            let k = self.sample * rays + i;
            let Some(lobe) = draw(self.draw(arrival.path, purpose, k)) else {
                continue;
            };
            // Drawn directions see through a thin wall: what lies behind it is met as if the wall were not there.
            let (density, drawn) = if purpose == TRANSMITTED && surface.thin {
                (arrival.density, arrival.drawn)
            } else {
                (lobe.density * rays as f32, drawn)
            };
            let weight = arrival.weight * lobe.weight;
            if weight.max_element() < FAINT {
                continue;
            }
            // Rough lobes blur what they see: a share of their width stands for that of the pixel.
            let spread = if lobe.density.is_finite() {
                (1.0 / (1.0 + lobe.density)).sqrt() * 0.25
            } else {
                0.0
            };
            next.push(Flight {
                pixel: arrival.pixel,
                weight: weight / rays as f32,
                sharp: if smooth {
                    arrival.sharp * lobe.weight.max_element().min(1.0)
                } else {
                    0.0
                },
                ray: SurfaceRay {
                    from: arrival.receiver,
                    dir: lobe.towards,
                },
                on: arrival.on,
                density,
                drawn,
                bounces: arrival.bounces + 1,
                passed: 0,
                absorption,
                diffuse,
                diffused: diffuse || arrival.diffused,
                shows_lights: shows_lights && !arrival.diffused,
                cone: Cone {
                    spread: arrival.cone.spread.max(spread),
                    ..arrival.cone
                },
                path: arrival.path.branch(purpose + 4 * i),
            });
        }
    }
}

/// How many of these samples a share of the pixel is worth, one at least.
fn worth(samples: u32, share: f32) -> u32 {
    ((samples as f32 * share).ceil() as u32).clamp(1, samples.max(1))
}

/// What a volume leaves of light after this distance (Beer and Lambert).
fn absorbed(absorption: Vec3, distance: f32) -> Vec3 {
    if absorption == Vec3::ZERO {
        Vec3::ONE
    } else {
        (absorption * -distance).exp()
    }
}

fn add(out: &mut TileMut, [x, y]: [u32; 2], light: Vec3) {
    out.color_row(y)[x as usize] += light;
}
