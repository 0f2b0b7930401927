//! Arrivals shaded as arrays ([`SurfaceShader`]): surfaces of a wave are made at once, what reaches them is asked of the
//! structures, as an array if they take such, and all light is added up at once.
//!
//! The same light as in `light.rs`, whose functions stand here for one arrival after the other.

use glam::Vec3;
use rayward_trace::{AreaLight, Light, Receiver};

use super::light::lit_surface;
use super::{Arrival, BounceWork, Flight, SURROUNDING};
use crate::secondary::{SecondaryTracer, SurfaceHit};
use crate::shade::{Beam, LightRays, Source, SurfaceShader, lobes_face, reaches, reaches_from};
use crate::tile::{TileShader, soft};
use crate::{ShadingLight, Surface};

/// Kinds of light to be added to arrivals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Wanted {
    /// What needs no light.
    rest: bool,
    /// That of lights.
    lights: bool,
    /// That of the environment.
    environment: bool,
}

/// A beam, if nothing is between an arrival and where it comes from.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    arrival: usize,
    /// Index of the light, if it is one.
    light: Option<usize>,
    end: Light,
    beam: Beam,
}

/// Surfaces with the arrivals that they belong to, and the light that may reach them.
#[derive(Debug, Default)]
struct Wave {
    surfaces: Vec<Surface>,
    owners: Vec<usize>,
    beams: Vec<Beam>,
    candidates: Vec<Candidate>,
}

impl Wave {
    fn add(&mut self, owner: usize, surface: Surface) -> u32 {
        self.surfaces.push(surface);
        self.owners.push(owner);
        (self.surfaces.len() - 1) as u32
    }
}

impl TileShader<'_> {
    /// The surfaces of all hits, in their order, where arrays are shaded.
    pub(super) fn made_together(
        &self,
        flights: &[Flight],
        hits: &[SurfaceHit],
    ) -> std::vec::IntoIter<Surface> {
        let Some(shading) = self.shading else {
            return Vec::new().into_iter();
        };
        let met = flights.iter().zip(hits);
        let at = |(flight, hit): (&Flight, &SurfaceHit)| {
            Some(self.met_at(flight, hit.as_ref()?.0, &hit.as_ref()?.1))
        };
        let points: Vec<_> = met.filter_map(at).collect();
        self.surfaces(shading, &points).into_iter()
    }

    /// As [`Self::resting`]; where arrays are shaded, what is not left to them.
    pub(super) fn resting_unless_together(&self, surface: &Surface, bounces: u32) -> Vec3 {
        if self.shading.is_none() {
            return self.resting(surface, bounces);
        }
        let mut light = Vec3::ZERO;
        self.show_environment(surface, self.traced(surface, bounces), &mut light);
        light
    }

    /// Adds all light to the arrivals of a wave.
    pub(super) fn light_up_arrivals(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork) {
        if let Some(shading) = self.shading {
            let all = Wanted {
                rest: true,
                lights: true,
                environment: true,
            };
            self.light_together(shading, tracer, all, work);
        } else {
            self.illuminate_arrivals(tracer, work);
            self.surround(tracer, work);
        }
    }

    /// Adds the light of all sources to arrivals on solids, which have all other light.
    pub(crate) fn illuminate_solid_arrivals(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork) {
        if let Some(shading) = self.shading {
            let lights = Wanted {
                rest: false,
                lights: true,
                environment: false,
            };
            self.light_together(shading, tracer, lights, work);
        } else {
            self.illuminate_arrivals(tracer, work);
        }
    }

    /// Adds the light of the environment to arrivals that have all other light.
    pub(super) fn surround_arrivals(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork) {
        if let Some(shading) = self.shading {
            let environment = Wanted {
                rest: false,
                lights: false,
                environment: true,
            };
            self.light_together(shading, tracer, environment, work);
        } else {
            self.surround(tracer, work);
        }
    }

    fn light_together(
        &self,
        shading: &dyn SurfaceShader,
        tracer: &dyn SecondaryTracer,
        wanted: Wanted,
        work: &mut BounceWork,
    ) {
        let mut wave = Wave::default();
        for (i, arrival) in work.arrivals.iter().enumerate() {
            let surface = wave.add(i, arrival.surface);
            if wanted.rest {
                let (radiance, traced) = self.surrounding(&arrival.surface, arrival.bounces);
                wave.beams.push(Beam {
                    surface,
                    share: Vec3::ONE,
                    source: Source::Around { radiance, traced },
                });
            }
            if wanted.lights && !arrival.surface.unlit {
                self.propose_lights(i, surface, arrival, &mut wave);
            }
            if wanted.environment && !arrival.surface.unlit && arrival.weight != Vec3::ZERO {
                self.propose_environment(i, surface, arrival, &mut wave);
            }
        }
        self.keep_unhidden(tracer, work, &mut wave);
        if wave.beams.is_empty() {
            return;
        }
        let lit = self.lit(shading, &wave.surfaces, &wave.beams);
        for (&owner, lit) in wave.owners.iter().zip(lit) {
            work.arrivals[owner].color += lit;
        }
    }

    /// Proposes the light of all sources that an arrival is turned to.
    fn propose_lights(&self, owner: usize, own: u32, arrival: &Arrival, wave: &mut Wave) {
        let surface = lit_surface(arrival);
        let at = if surface == arrival.surface {
            own
        } else {
            wave.add(owner, surface)
        };
        for (index, (light, plan)) in self.lights.iter().zip(self.ends).enumerate() {
            let Some(plan) = plan else {
                wave.beams.push(Beam {
                    surface: at,
                    share: Vec3::ONE,
                    source: Source::Light(index as u32),
                });
                continue;
            };
            if let Some(area) = &plan.area {
                self.propose_samples(owner, at, arrival, (index, light, area), wave);
            } else if reaches(&surface, light) && self.is_turned_to(&plan.light, arrival) {
                wave.candidates.push(Candidate {
                    arrival: owner,
                    light: Some(index),
                    end: plan.light,
                    beam: Beam {
                        surface: at,
                        share: Vec3::ONE,
                        source: Source::Light(index as u32),
                    },
                });
            }
        }
    }

    /// Proposes the samples of a light with a size.
    fn propose_samples(
        &self,
        owner: usize,
        at: u32,
        arrival: &Arrival,
        (index, light, area): (usize, &ShadingLight, &AreaLight),
        wave: &mut Wave,
    ) {
        if !area.shines_at(arrival.receiver.point) {
            return;
        }
        let surface = wave.surfaces[at as usize];
        let samples = soft::samples(self.options, index, self.sample);
        let rays = if arrival.diffused {
            LightRays::default()
        } else {
            self.light_rays(&surface, arrival.bounces, arrival.sharp)
        };
        let share = Vec3::splat(1.0 / samples.count() as f32);
        for k in 0..samples.count() {
            let end = area.sample(&samples, arrival.path.0, arrival.receiver.point, k);
            if reaches_from(&surface, light, area, &end) && self.is_turned_to(&end, arrival) {
                wave.candidates.push(Candidate {
                    arrival: owner,
                    light: Some(index),
                    end,
                    beam: Beam {
                        surface: at,
                        share,
                        source: self.sample_source(index, area, end, &surface, &rays),
                    },
                });
            }
        }
    }

    /// Proposes directions drawn from the environment.
    fn propose_environment(&self, owner: usize, at: u32, arrival: &Arrival, wave: &mut Wave) {
        let Some(environment) = self.environment else {
            return;
        };
        let surface = &arrival.surface;
        let rays = self.environment_rays(surface, (arrival.bounces, arrival.sharp));
        let directions = self.directions(arrival.sharp);
        for i in 0..directions {
            let random = self.draw(arrival.path, SURROUNDING, self.sample * directions + i);
            let sample = environment.sample(random);
            if sample.radiance.max_element() <= 0.0 || !lobes_face(surface, sample.towards) {
                continue;
            }
            wave.candidates.push(Candidate {
                arrival: owner,
                light: None,
                end: Light::Directional(sample.towards),
                beam: Beam {
                    surface: at,
                    share: Vec3::ONE,
                    source: Source::Direction {
                        towards: sample.towards,
                        radiance: sample.radiance,
                        density: directions as f32 * sample.density,
                        drawn: rays,
                    },
                },
            });
        }
    }

    /// Makes beams of those candidates that something is let through to.
    fn keep_unhidden(&self, tracer: &dyn SecondaryTracer, work: &mut BounceWork, wave: &mut Wave) {
        work.shadow_rays += wave.candidates.len() as u64;
        // Where all or nothing is let through, by triangles alone, an array of rays can be asked.
        let plain = !self.structures.transparent && self.solids.is_none() && self.options.shadows;
        let hidden = plain.then(|| {
            let query = |c: &Candidate| -> (Receiver, Light) { (work.arrivals[c.arrival].receiver, c.end) };
            tracer.hidden(&wave.candidates.iter().map(query).collect::<Vec<_>>())
        });
        if let Some(hidden) = hidden.flatten() {
            let kept = wave.candidates.iter().zip(hidden).filter(|(_, hidden)| !hidden);
            wave.beams.extend(kept.map(|(candidate, _)| candidate.beam));
            return;
        }
        for candidate in &wave.candidates {
            let arrival = &work.arrivals[candidate.arrival];
            let end = (candidate.light, &candidate.end);
            let passed = self.passed(tracer, arrival, end, &mut work.filters);
            if passed != Vec3::ZERO {
                wave.beams.push(Beam {
                    share: candidate.beam.share * passed,
                    ..candidate.beam
                });
            }
        }
    }
}
