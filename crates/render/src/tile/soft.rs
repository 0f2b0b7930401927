//! The light of a source with a size: samples, and the share of them that a surface sees (HM08 §5.3).
//!
//! A surface receives the mean of what its samples send to it, each as a small light of its own with its own cosines
//! and distance. HM08 measures visibility alone: there the light of the middle is multiplied with the share of samples
//! seen.

use glam::{DVec3, Vec3};
use rayward_trace::{AreaLight, Light, Receiver, Samples, Tile, exact};

use super::{TileShader, TileWork};
use crate::geometry::triangles;
use crate::secondary::SecondaryTracer;
use crate::shade::{Beam, LightRays, Source, direct, direct_beside, reaches_from};
use crate::structures::LightShadows;
use crate::{RenderOptions, Surface};

/// The samples of a light: each light, and each sample of the pixels, has sets of its own.
pub(crate) fn samples(options: &RenderOptions, light: usize, sample: u32) -> Samples {
    let own = (light as u32).wrapping_mul(0x9e37_79b9);
    let own = own.wrapping_add(sample.wrapping_mul(0xc2b2_ae35));
    Samples::new(options.samples, options.seed.wrapping_add(own))
}

/// Fills up with nobody where a pixel lies in another square of 4 x 4 or 8 x 8 than the one before: those that are tested
/// or culled for together are to lie close together.
fn fill_up(
    square: &mut Option<[u32; 2]>,
    pixel: [u32; 2],
    receivers: &mut Vec<Receiver>,
    pixels: &mut Vec<u32>,
) {
    let here = pixel.map(|v| v / 4);
    if let Some(last) = square.replace(here).filter(|last| *last != here) {
        let together = if last.map(|v| v / 2) == here.map(|v| v / 2) {
            16
        } else {
            64
        };
        let size = receivers.len().next_multiple_of(together);
        receivers.resize(size, Receiver::free(DVec3::NAN));
        pixels.resize(size, 0);
    }
}

/// Asks for the samples that each receiver sees as one array; returns how many were asked for. Who fails to answer has
/// nothing see anything.
fn ask(
    arrays: &dyn SecondaryTracer,
    area: &AreaLight,
    samples: &Samples,
    (receivers, pixels): (&[Receiver], &[u32]),
    bits: &mut Vec<u32>,
) -> u64 {
    let of = |(receiver, pixel): (&Receiver, &u32)| {
        let (receiver, pixel) = (*receiver, *pixel);
        (0..samples.count()).map(move |k| (receiver, area.sample(samples, pixel, receiver.point, k)))
    };
    let somebody = |(receiver, _): &(&Receiver, &u32)| !receiver.point.is_nan();
    let queries: Vec<(Receiver, Light)> = receivers
        .iter()
        .zip(pixels)
        .filter(somebody)
        .flat_map(of)
        .collect();
    let hidden = arrays.hidden(&queries).unwrap_or_default();
    let mut answers = hidden.chunks(samples.count() as usize);
    bits.clear();
    for receiver in receivers {
        let own = bits.len();
        bits.resize(own + samples.words(), 0);
        if receiver.point.is_nan() {
            continue;
        }
        for (k, hidden) in answers.next().unwrap_or_default().iter().enumerate() {
            bits[own + k / 32] |= u32::from(!hidden) << (k % 32);
        }
    }
    queries.len() as u64
}

impl TileShader<'_> {
    /// Adds the light of one source with a size to all points of the tile that it reaches.
    pub(super) fn illuminate_softly(&self, light: usize, area: &AreaLight, tile: &Tile, work: &mut TileWork) {
        let samples = samples(self.options, light, self.sample);
        work.receivers.clear();
        work.pixels.clear();
        work.asked.clear();
        let mut square = None;
        for (i, point) in work.points.iter().enumerate() {
            let radiance = if self.options.paper {
                direct(&point.surface, &self.lights[light]).map(|incident| incident.radiance)
            } else {
                (!point.surface.unlit).then_some(Vec3::ZERO)
            };
            if let Some(radiance) = radiance.filter(|_| point.on.is_none())
                && area.shines_at(point.receiver.point)
                && self.may_face(area, &point.receiver)
            {
                fill_up(
                    &mut square,
                    [point.x, point.y],
                    &mut work.receivers,
                    &mut work.pixels,
                );
                work.receivers.push(point.receiver);
                work.pixels
                    .push((tile.y + point.y) * self.camera.width + tile.x + point.x);
                work.asked.push((i as u32, radiance));
            }
        }
        if !self.find_visible(light, area, &samples, work) {
            return;
        }
        let share = 1.0 / samples.count() as f32;
        let somebody = (0..work.receivers.len()).filter(|&n| !work.receivers[n].point.is_nan());
        for (n, &(i, radiance)) in somebody.zip(&work.asked) {
            let visible = &work.visible[n * samples.words()..(n + 1) * samples.words()];
            if visible.iter().all(|&word| word == 0) {
                continue;
            }
            let (receiver, pixel) = (work.receivers[n], work.pixels[n]);
            let surface = work.points[i as usize].surface;
            let surface = &surface;
            let rays = self.light_rays(surface, 0, 1.0);
            let certain = area.side(triangles(self.geometry).corners(receiver.prim)) != 0.0;
            let mut sum = Vec3::ZERO;
            for k in (0..samples.count()).filter(|k| visible[*k as usize / 32] >> (k % 32) & 1 != 0) {
                let end = area.sample(&samples, pixel, receiver.point, k);
                if !certain && !self.faces_end(&end, &receiver) {
                    continue;
                }
                let sent = if self.options.paper {
                    Some(radiance)
                } else if self.shading.is_some() {
                    reaches_from(surface, &self.lights[light], area, &end).then_some(Vec3::ONE)
                } else {
                    let incident = direct_beside(surface, &self.lights[light], area, &end, &rays);
                    incident.map(|incident| incident.radiance)
                };
                if let Some(sent) = sent
                    && !self.solid_hides(light, &receiver, &end)
                {
                    let passed = match self.structures.layers.as_deref() {
                        Some(all) => self.transmittance(all, &receiver, &end, &mut work.filters),
                        None => Vec3::ONE,
                    };
                    if self.shading.is_some() {
                        work.together.beams.push(Beam {
                            surface: i,
                            share: passed * share,
                            source: self.sample_source(light, area, end, surface, &rays),
                        });
                    } else {
                        sum += sent * passed;
                    }
                }
            }
            work.points[i as usize].color += sum * share;
        }
    }

    /// A sample of a light as where light comes from.
    pub(crate) fn sample_source(
        &self,
        light: usize,
        area: &AreaLight,
        end: Light,
        surface: &Surface,
        rays: &LightRays,
    ) -> Source {
        let towards = match end {
            Light::Point(position) => position - surface.position,
            Light::Directional(direction) => direction,
        };
        Source::Sample {
            light: light as u32,
            end,
            density: rays.density(area, surface.position, towards.normalize_or_zero()),
            drawn: rays.drawn,
        }
    }

    /// Finds which samples each receiver sees; `false` if nothing tells.
    fn find_visible(&self, light: usize, area: &AreaLight, samples: &Samples, work: &mut TileWork) -> bool {
        let TileWork {
            receivers,
            pixels,
            area: scratch,
            visible,
            ..
        } = work;
        match (&self.structures.lights[light], &self.reference) {
            (LightShadows::Area(tree), _) => tree.visible(receivers, pixels, samples, scratch, visible),
            (LightShadows::AreaGrid(grid), _) => grid.visible(receivers, pixels, samples, scratch, visible),
            (LightShadows::Asked, _) => {
                let Some(arrays) = &self.structures.arrays else {
                    return false;
                };
                scratch.counts.samples += ask(&**arrays, area, samples, (receivers, pixels), visible);
            }
            (_, Some(every)) => {
                let opaque = |prim| self.is_opaque(prim);
                every.visible(&opaque, area, samples, (receivers, pixels), visible);
            }
            _ => return false,
        }
        true
    }

    /// Whether some of a light may be on the side of a surface that the eye sees.
    fn may_face(&self, area: &AreaLight, receiver: &Receiver) -> bool {
        let corners = triangles(self.geometry).corners(receiver.prim);
        let (lit, seen) = (area.side(corners), exact::side(corners, &self.eye));
        lit == 0.0 || (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0)
    }

    /// As [`Self::faces`], for a sample.
    fn faces_end(&self, end: &Light, receiver: &Receiver) -> bool {
        let corners = triangles(self.geometry).corners(receiver.prim);
        exact::same_side(corners, end, &self.eye)
    }
}
