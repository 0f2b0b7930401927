//! Antialiasing that shades what a pixel shows once, not once a sample.
//!
//! Source: multisampling, where visibility is known for each sample and colour for each triangle; and Fatahalian, Boulos,
//! Hegarty, Akeley, Mark, Moreton and Hanrahan, *Reducing Shading on GPUs using Quad-Fragment Merging*, SIGGRAPH 2010,
//! where neighbours of a smooth mesh are shaded as one. Here the samples of a pixel that see one smooth surface in the
//! same light are a *share* of it; the first of them is shaded, and stands for as many as follow.
//!
//! What a sample sees comes from the eye's grid of its shifted raster, and which hard lights reach it from the lights'
//! receiver grids: a bit a sample and light. Where something is transparent there are none, and each sample is looked up in
//! the lights' grids of casters and of veils; samples that get the same eighths of the light are shaded as one. So edges of things and of hard shadows are as smooth as with all samples
//! shaded, at the cost of their visibility alone.
//!
//! What cannot be told without shading is shaded for each sample: whatever is seen through veils, solids, an environment
//! behind everything, and materials that are mirrors or glass, for what these show has edges of its own. Limits: lights with
//! a size, drawn reflections, and an environment as light are seen by the first samples of shares alone, hence with their
//! noise.
//!
//! Layout: 40 bytes a share, first one for each pixel of the tile in rows, then those that follow, linked. Cost of a
//! sample that joins a share: about 10 ns on the same triangle, 100 ns on another.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rayward_scene::{FrameGeometry, Scene};
use rayward_trace::{Receiver, Tile, ViewRay, exact};

use super::{TileShader, TileWork};
use crate::geometry::triangles;
use crate::shade::{lobes, object_of};
use crate::structures::LightShadows;
use crate::{Film, NO_ID, RenderOptions, TileMut};

/// Cosine of the largest angle between the planes of two triangles that are shaded as one: 11 degrees.
const SMOOTH: f64 = 0.98;

/// The end of a list of shares.
const END: u32 = u32::MAX;

/// What all tiles share.
pub(crate) struct Sharing {
    /// Offsets of all samples.
    pub(crate) offsets: Vec<[f64; 2]>,
    /// Whether each object may show others sharply.
    sharp: Vec<bool>,
}

/// What a sample of a pixel sees, where that is an opaque triangle or nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Glance {
    /// The triangle, or [`NO_ID`].
    prim: u32,
    /// Which lights reach it, hashed.
    lights: u32,
}

/// Samples of a pixel that are shaded as one.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// What the first of them sees; `None` if no other can join.
    seen: Option<Glance>,
    /// The first of them.
    sample: u32,
    /// How many they are.
    count: u32,
    /// The pixel's next share.
    next: u32,
    color: Vec3,
    alpha: f32,
}

/// The shares of all pixels of a tile.
#[derive(Debug)]
pub(crate) struct TileShares {
    width: u32,
    shares: Vec<Share>,
    /// The share and its pixel, of those that the current sample is the first of.
    begun: Vec<[u32; 2]>,
}

impl Sharing {
    pub(crate) fn new(scene: &Scene, geometry: &FrameGeometry, options: &RenderOptions) -> Self {
        let offset = |k| options.pixel_filter.offset(k);
        let sharp = |material: u32| {
            let material = &scene.materials[material as usize];
            let coated = material.coat.factor > 0.0 && material.coat.roughness < lobes::SMOOTH;
            !material.unlit && (material.roughness < lobes::SMOOTH || material.transmission > 0.0 || coated)
        };
        Self {
            offsets: (0..options.pixel_samples).map(offset).collect(),
            sharp: geometry.objects.iter().map(|o| sharp(o.material)).collect(),
        }
    }
}

impl Share {
    /// Of no samples.
    const NONE: Self = Self {
        seen: None,
        sample: 0,
        count: 0,
        next: END,
        color: Vec3::ZERO,
        alpha: 0.0,
    };
}

impl TileShares {
    /// Of no samples yet.
    pub(crate) fn new(tile: &Tile) -> Self {
        Self {
            width: tile.width,
            shares: vec![Share::NONE; (tile.width * tile.height) as usize],
            begun: Vec::new(),
        }
    }

    /// Counts a sample of a pixel. `false` if it is the first of a share; `alike` tells whether the triangle that an earlier
    /// sample saw is shaded as one with that of this one.
    fn join(
        &mut self,
        pixel: u32,
        sample: u32,
        seen: Option<Glance>,
        alike: impl Fn(u32, u32) -> bool,
    ) -> bool {
        let first = Share {
            seen,
            sample,
            count: 1,
            ..Share::NONE
        };
        let mut at = pixel;
        let new = self.shares.len() as u32;
        loop {
            let share = &mut self.shares[at as usize];
            if share.count == 0 {
                *share = first;
                break;
            }
            if let (Some(seen), Some(other)) = (&seen, &share.seen)
                && seen.lights == other.lights
                && (seen.prim == other.prim || alike(other.prim, share.sample))
            {
                share.count += 1;
                return true;
            }
            if share.next == END || seen.is_none() {
                let next = share.next;
                share.next = new;
                at = new;
                self.shares.push(Share { next, ..first });
                break;
            }
            at = share.next;
        }
        self.begun.push([at, pixel]);
        false
    }

    /// Keeps what was shaded of the shares just begun.
    pub(super) fn keep(&mut self, out: &mut TileMut) {
        for [share, pixel] in self.begun.drain(..) {
            let (x, y) = ((pixel % self.width) as usize, pixel / self.width);
            let share = &mut self.shares[share as usize];
            share.color = out.color_row(y)[x];
            share.alpha = out.alpha_row(y).map_or(0.0, |row| row[x]);
        }
    }

    /// Makes the pixels of a tile the means of their shares, weighed by their samples.
    fn finish(&self, out: &mut TileMut) {
        for pixel in 0..out.width * out.height {
            let (mut color, mut alpha, mut count) = (Vec3::ZERO, 0.0, 0.0);
            let mut at = pixel;
            while let Some(share) = self.shares.get(at as usize) {
                let samples = share.count as f32;
                color += share.color * samples;
                alpha += share.alpha * samples;
                count += samples;
                at = share.next;
            }
            // Tiles that nobody asks for have none.
            if count > 0.0 {
                let (x, y) = ((pixel % self.width) as usize, pixel / self.width);
                out.color_row(y)[x] = color / count;
                if let Some(row) = out.alpha_row(y) {
                    row[x] = alpha / count;
                }
            }
        }
    }
}

/// Makes colour and alpha of a film what the shares of its tiles say.
pub(crate) fn finish(shares: &[TileShares], film: &mut Film, side: u32) {
    let mut tiles = film.tiles_mut(side, side);
    let tiles = tiles.par_iter_mut().zip(shares);
    tiles.for_each(|(out, shares)| shares.finish(out));
}

impl TileShader<'_> {
    /// Whether another sample has been shaded for this one of a pixel, which is counted.
    pub(super) fn joins(
        &self,
        sharing: &Sharing,
        shares: &mut TileShares,
        tile: &Tile,
        [x, y]: [u32; 2],
        work: &mut TileWork,
    ) -> bool {
        let [column, row] = [tile.x + x, tile.y + y];
        let view = self.structures.eye.view();
        let ray = view.pixel_ray(column, row);
        let seen = self.glance(sharing, tile, [x, y], &ray, work);
        let here = sharing.offsets[self.sample as usize];
        let alike = |prim: u32, sample: u32| {
            let there = sharing.offsets[sample as usize];
            let other = view
                .shifted([there[0] - here[0], there[1] - here[1]])
                .pixel_ray(column, row);
            seen.is_some_and(|seen| self.are_one((prim, &other), (seen.prim, &ray)))
        };
        shares.join(y * tile.width + x, self.sample, seen, alike)
    }

    /// What a sample of a pixel sees, if that can be told without shading it.
    fn glance(
        &self,
        sharing: &Sharing,
        tile: &Tile,
        [x, y]: [u32; 2],
        ray: &ViewRay,
        work: &mut TileWork,
    ) -> Option<Glance> {
        let through_veils = self.structures.veils.is_some() && !work.veils.pixel(x, y).is_empty();
        if through_veils || self.solid_at([x, y], ray, work).is_some() {
            return None;
        }
        let seen = self.structures.seen(tile, x, y);
        let Some(prim) = seen.unwrap_or_else(|| work.hits.prim(x, y)) else {
            let plain = self.environment.is_none() || !self.options.show_environment;
            return plain.then_some(Glance {
                prim: NO_ID,
                lights: 0,
            });
        };
        let object = object_of(self.geometry, prim);
        if sharing.sharp[object as usize] {
            return None;
        }
        let lights = self.lights_at(tile, [x, y], (ray, prim), work);
        Some(Glance { prim, lights })
    }

    /// How much of each light without a size reaches a surface, hashed.
    fn lights_at(
        &self,
        tile: &Tile,
        [x, y]: [u32; 2],
        (ray, prim): (&ViewRay, u32),
        work: &mut TileWork,
    ) -> u32 {
        let receiver = || {
            let corners = triangles(self.geometry).corners(prim);
            let hit = exact::attributes(ray.origin, ray.dir, corners);
            hit.map(|hit| Receiver::along(ray, hit.t, prim))
        };
        let beside_solids = |light: usize| {
            let end = self.ends[light].as_ref().map(|plan| plan.light);
            let hidden = receiver()
                .zip(end)
                .is_some_and(|(receiver, end)| self.solid_hides(light, &receiver, &end));
            !hidden
        };
        let mut hash = 0u32;
        for (light, shadows) in self.structures.lights.iter().enumerate() {
            let reaching = match shadows {
                LightShadows::Pixels(lit) => u32::from(lit.is_lit(tile.index, x, y)),
                LightShadows::Grid(_) | LightShadows::Tree(..) => {
                    receiver().map_or(0, |receiver| self.eighths(light, receiver, work))
                }
                _ => continue,
            };
            let reached = reaching > 0 && (self.solids.is_none() || beside_solids(light));
            let reaching = if reached { reaching } else { 0 };
            hash = hash.wrapping_mul(0x9e37_79b1).wrapping_add(1 + reaching);
        }
        hash
    }

    /// How many eighths of a light's red, green and blue reach a receiver, as digits.
    fn eighths(&self, light: usize, receiver: Receiver, work: &mut TileWork) -> u32 {
        if !self.faces(light, &receiver) {
            return 0;
        }
        let TileWork {
            scratch,
            shadow,
            veil_scratch,
            passed,
            ..
        } = work;
        let receivers = [receiver];
        self.hidden(light, &receivers, scratch, shadow);
        if shadow[0] {
            return 0;
        }
        self.pass(light, &receivers, veil_scratch, passed);
        let digits = passed[0].to_array().map(|share| (share * 8.0).round() as u32);
        digits.into_iter().fold(0, |all, digit| all * 9 + digit)
    }

    /// Whether two triangles that rays of one pixel meet are shaded as one: parts of one object, hardly turned against each
    /// other, each met in the other's plane but for the width of a pixel.
    fn are_one(&self, (a, ray_a): (u32, &ViewRay), (b, ray_b): (u32, &ViewRay)) -> bool {
        if a == NO_ID || b == NO_ID || object_of(self.geometry, a) != object_of(self.geometry, b) {
            return false;
        }
        let (a, b) = (self.facet(a, ray_a), self.facet(b, ray_b));
        let depth = (a.at - self.camera.eye.as_dvec3()).dot(self.camera.forward);
        let pixel = f64::from(self.camera.footprint(depth as f32));
        let between = b.at - a.at;
        a.normal.dot(b.normal) >= SMOOTH
            && between.dot(a.normal).abs() <= pixel
            && between.dot(b.normal).abs() <= pixel
    }

    fn facet(&self, prim: u32, ray: &ViewRay) -> Facet {
        let [a, b, c] = triangles(self.geometry).corners(prim).map(|v| v.as_dvec3());
        let plane = (b - a).cross(c - a).normalize_or_zero();
        let towards = plane.dot(ray.dir);
        Facet {
            normal: plane * -towards.signum(),
            at: ray.origin + ray.dir * ((a - ray.origin).dot(plane) / towards),
        }
    }
}

/// The plane of a triangle where a ray meets it.
struct Facet {
    /// Towards the viewer.
    normal: DVec3,
    at: DVec3,
}
