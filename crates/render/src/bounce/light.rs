//! The light of surfaces that paths have come to: from lights, and from an environment.
//!
//! A light seen by a mirror that a diffuse ray found by chance would be a rare and very bright dot in the picture. Such
//! mirrors show no lights, so their caustics are those of the environment alone.
//!
//! A light with a size is seen by the rays of mirrors and glossy reflections, and through boundaries of volumes, as what it
//! is: a shape before all that lies behind it, which hides nothing. Glossy reflections have samples of it as well; each
//! counts by the balance heuristic, as below. Limits: the eye sees no lights, neither through thin walls.
//!
//! Shadows are asked of the general structure, both sides of all triangles casting: the rule by which back faces
//! alone may cast is one about what the eye sees.
//!
//! The environment lights a surface twice over: by directions drawn by importance from the environment, and by the
//! rays drawn from the surface's lobes that meet nothing. Each counts with its share of the two densities (the
//! balance heuristic of Veach and Guibas 1995), lobe by lobe, so a mirror sees the environment by its ray alone and
//! plaster by drawn directions.

use std::ops::ControlFlow;

use glam::Vec3;
use rayward_trace::{AreaLight, Light, exact};

use super::{Arrival, BounceWork, Flight, GLOSSY, SURROUNDING, absorbed};
use crate::geometry::triangles;
use crate::secondary::SecondaryTracer;
use crate::shade::{Iridescence, LightRays, SurfaceFinish, direct, direct_beside, lobes, lobes_lit};
use crate::solids::FrameSolids;
use crate::tile::{TileShader, soft};
use crate::{ShadingLight, Surface};

/// Whether rays of a reflection see lights with a size; rougher ones have their samples alone.
pub(super) fn shows_lights(mirror: &Surface) -> bool {
    mirror.roughness <= GLOSSY
}

/// An arrival's surface as lights are seen by it: that of a mirror on the way of a diffuse ray reflects none.
pub(super) fn lit_surface(arrival: &Arrival) -> Surface {
    let mut surface = arrival.surface;
    if arrival.diffused && surface.coat.roughness < lobes::SMOOTH {
        surface.coat.reflectance = 0.0;
    }
    if !(arrival.diffused && lobes::is_smooth(&surface)) {
        return surface;
    }
    Surface {
        base_color: surface.base_color * (1.0 - surface.metallic),
        metallic: 0.0,
        f0: Vec3::ZERO,
        specular: 0.0,
        finish: SurfaceFinish {
            iridescence: Iridescence::NONE,
            ..surface.finish
        },
        ..surface
    }
}

impl TileShader<'_> {
    /// Adds the light of all sources to the arrivals that they reach.
    pub(crate) fn illuminate_arrivals(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork) {
        for (index, (light, end)) in self.lights.iter().zip(self.ends).enumerate() {
            for arrival in &mut work.arrivals {
                let surface = lit_surface(arrival);
                let Some(plan) = end else {
                    if let Some(incident) = direct(&surface, light) {
                        arrival.color += incident.radiance;
                    }
                    continue;
                };
                if let Some(area) = &plan.area {
                    let (light, filters) = ((index, light, area), &mut work.filters);
                    arrival.color += self.soft_light(tracer, arrival, light, filters, &mut work.shadow_rays);
                } else if let Some(incident) = direct(&surface, light)
                    && self.is_turned_to(&plan.light, arrival)
                {
                    work.shadow_rays += 1;
                    let end = (Some(index), &plan.light);
                    let passed = self.passed(tracer, arrival, end, &mut work.filters);
                    arrival.color += incident.radiance * passed;
                }
            }
        }
    }

    /// Mean of what an arrival receives from the samples of a light with a size.
    fn soft_light(
        &self,
        tracer: &dyn SecondaryTracer,
        arrival: &Arrival,
        (index, light, area): (usize, &ShadingLight, &AreaLight),
        filters: &mut Vec<u32>,
        asked: &mut u64,
    ) -> Vec3 {
        let (surface, receiver) = (&lit_surface(arrival), &arrival.receiver);
        if surface.unlit || !area.shines_at(receiver.point) {
            return Vec3::ZERO;
        }
        let samples = soft::samples(self.options, index, self.sample);
        let rays = if arrival.diffused {
            LightRays::default()
        } else {
            self.light_rays(surface, arrival.bounces, arrival.sharp)
        };
        // What the eye sees of solids is lit in the paper's way where triangles are.
        let whole = (self.options.paper && arrival.bounces == 0).then(|| direct(surface, light));
        let mut sum = Vec3::ZERO;
        for k in 0..samples.count() {
            let end = area.sample(&samples, arrival.path.0, receiver.point, k);
            if let Some(incident) = whole.unwrap_or_else(|| direct_beside(surface, light, area, &end, &rays))
                && self.is_turned_to(&end, arrival)
            {
                *asked += 1;
                sum += incident.radiance * self.passed(tracer, arrival, (Some(index), &end), filters);
            }
        }
        sum / samples.count() as f32
    }

    /// How many rays of the reflections of a surface see lights with a size.
    pub(crate) fn light_rays(&self, surface: &Surface, bounces: u32, sharp: f32) -> LightRays {
        let traced = self.traced(surface, bounces);
        let drawn = |mirror: &Surface, traced: bool| {
            if traced && shows_lights(mirror) && !self.options.paper {
                self.reflected_rays(mirror, sharp)
            } else {
                0
            }
        };
        let coat = surface.coated().map_or(0, |coat| drawn(&coat, traced.coat));
        LightRays {
            samples: self.options.samples,
            drawn: [drawn(surface, traced.reflection), coat],
        }
    }

    /// What a ray sees of the lights with a size before it meets something at a distance.
    pub(super) fn lights_along(&self, flight: &Flight, end: f32) -> Vec3 {
        if !flight.shows_lights {
            return Vec3::ZERO;
        }
        let (from, dir) = (flight.ray.from.point, flight.ray.dir);
        let mut seen = Vec3::ZERO;
        for (light, plan) in self.lights.iter().zip(self.ends) {
            let Some(area) = plan.as_ref().and_then(|plan| plan.area.as_ref()) else {
                continue;
            };
            if !area.shines_at(from) || !area.is_valid() {
                continue;
            }
            let (density, Some(distance)) = area.met(from, dir) else {
                continue;
            };
            if distance > end {
                continue;
            }
            let sample = if distance.is_finite() {
                Light::Point((from + dir.as_dvec3() * f64::from(distance)).as_vec3())
            } else {
                Light::Directional(dir)
            };
            if let Some(incident) = light.incident_from(area, &sample, from.as_vec3()) {
                let drawn = density * self.options.samples as f32;
                let share = if flight.density.is_finite() {
                    flight.density / (flight.density + drawn)
                } else {
                    1.0
                };
                // A volume that never ends is none.
                let absorption = if distance.is_finite() {
                    flight.absorption
                } else {
                    Vec3::ZERO
                };
                seen += incident.radiance * absorbed(absorption, distance) * (density * share);
            }
        }
        seen
    }

    /// Adds the light of the environment to all arrivals.
    pub(super) fn surround(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork) {
        let Some(environment) = self.environment else {
            return;
        };
        for arrival in &mut work.arrivals {
            let surface = &arrival.surface;
            if surface.unlit || arrival.weight == Vec3::ZERO {
                continue;
            }
            let rays = self.environment_rays(surface, (arrival.bounces, arrival.sharp));
            let directions = self.directions(arrival.sharp);
            for i in 0..directions {
                let random = self.draw(arrival.path, SURROUNDING, self.sample * directions + i);
                let sample = environment.sample(random);
                let towards = sample.towards;
                if surface.geometric_normal.dot(towards) <= 0.0 {
                    continue;
                }
                let drawn = directions as f32 * sample.density;
                let lit = lobes_lit(surface, towards, drawn, rays) * sample.radiance;
                if lit.max_element() <= 0.0 {
                    continue;
                }
                work.shadow_rays += 1;
                let end = Light::Directional(towards);
                arrival.color += lit * self.passed(tracer, arrival, (None, &end), &mut work.filters);
            }
        }
    }

    /// Rays of a surface that see the environment where nothing is in between: of its own reflection, its coat's, and of diffuse
    /// light; 0 of what is not traced.
    pub(super) fn environment_rays(&self, surface: &Surface, (bounces, sharp): (u32, f32)) -> [u32; 3] {
        let traced = self.traced(surface, bounces);
        let coat = surface.coated().filter(|_| traced.coat);
        [
            if traced.reflection {
                self.reflected_rays(surface, sharp)
            } else {
                0
            },
            coat.map_or(0, |coat| self.reflected_rays(&coat, sharp)),
            if traced.diffusion {
                self.diffused_rays(surface, sharp)
            } else {
                0
            },
        ]
    }

    /// Radiance where a ray meets nothing.
    pub(super) fn beyond(&self, flight: &Flight) -> Vec3 {
        match self.environment {
            Some(environment) => {
                let towards = flight.ray.dir;
                let drawn = flight.drawn * environment.density(towards);
                let share = if drawn > 0.0 && flight.density.is_finite() {
                    flight.density / (flight.density + drawn)
                } else {
                    1.0
                };
                environment.radiance(towards) * share
            }
            None if flight.diffuse => self.options.ambient,
            None => self.options.background,
        }
    }

    /// Share of a light, which has an index if it is one of the scene's, that reaches an arrival.
    pub(super) fn passed(
        &self,
        tracer: &dyn SecondaryTracer,
        arrival: &Arrival,
        (light, end): (Option<usize>, &Light),
        filters: &mut Vec<u32>,
    ) -> Vec3 {
        if !self.options.shadows {
            return Vec3::ONE;
        }
        let hides = |solids: &FrameSolids| solids.hides(light, &arrival.among_solids(), end);
        if self.solids.is_some_and(hides) {
            return Vec3::ZERO;
        }
        let receiver = &arrival.receiver;
        filters.clear();
        let some_pass = self.structures.transparent;
        let mut blocked = false;
        tracer.each_between(receiver, end, &mut |prim| {
            blocked = !some_pass || self.is_opaque(prim);
            filters.push(prim);
            if blocked {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        if blocked {
            return Vec3::ZERO;
        }
        self.let_through(receiver, end, filters)
    }

    /// Whether a light is on the side of an arrival's triangle that is seen. What faces the light on a solid is told by its
    /// normal alone, which is that of shading.
    pub(super) fn is_turned_to(&self, end: &Light, arrival: &Arrival) -> bool {
        if arrival.on.is_some() {
            return true;
        }
        let corners = triangles(self.geometry).corners(arrival.receiver.prim);
        exact::same_side(corners, end, &arrival.seen_from)
    }
}
