//! Other ray tracers as contenders: packets of 4 x 4 pixels into a structure that was built before.
//!
//! A shadow ray goes from the hit, as f32 arithmetic finds it, to the light; its ends are cut off by a ten-thousandth of
//! its length, as is usual where hits are not exact.

mod bvh;
mod obvhs;
mod regular;

use rayon::prelude::*;
use rayward::trace::{BLOCK_LANES, Facets, HitBlocks, Light, View, darken};

use crate::contender::{Contender, FrameKind, Job, PATTERN, SOFT_SAMPLES};
use crate::packet::{LANES, Lanes, NOTHING, Packet, Rays, Valid};
use crate::{Picture, Time};

pub(crate) use bvh::BvhOfShapes;
pub(crate) use obvhs::{Obvhs, ObvhsTree};
pub(crate) use regular::RegularGrid;

/// Share of a shadow ray that is cut off at both of its ends.
pub(crate) const CUT: f32 = 1e-4;

/// A structure that is asked for packets.
pub(crate) trait PacketTracer: Sync {
    /// Working memory of a thread.
    type Scratch: Default + Send;

    /// Closest hits: `far` and `hits.prim` of those rays that hit something.
    fn closest(&self, valid: &Valid, packet: &mut Packet, scratch: &mut Self::Scratch);

    /// Any hits: `far` becomes minus infinity.
    fn occluded(&self, valid: &Valid, rays: &mut Rays, scratch: &mut Self::Scratch);
}

/// A structure with its name and what it took to build.
pub(crate) struct Peer<T> {
    pub(crate) name: String,
    pub(crate) build: Time,
    pub(crate) tracer: T,
}

/// Working memory of a thread: a tile of hits, packets for both kinds of rays.
#[derive(Default)]
struct Work<S> {
    scratch: S,
    prim: Vec<Lanes<u32>>,
    depth: Vec<Lanes<f32>>,
    lit: Vec<[u8; BLOCK_LANES]>,
    eye: Packet,
    shadow: Packet,
}

/// What a peer has found in a tile.
struct TileOfPeer<'w, S> {
    stride: u32,
    work: &'w Work<S>,
}

impl<S> HitBlocks for TileOfPeer<'_, S> {
    const DEPTH: bool = true;

    #[inline]
    fn block(&self, column: u32, row: u32) -> (&[u32; BLOCK_LANES], &[f32; BLOCK_LANES]) {
        let block = (row * self.stride + column) as usize;
        (&self.work.prim[block], &self.work.depth[block])
    }
}

/// Directions of eye rays: affine in the raster point.
struct EyeRays {
    origin: [f32; 3],
    /// At raster point (0, 0), its change along x, and along y.
    dir: [[f32; 3]; 3],
}

impl EyeRays {
    fn new(view: &View) -> Self {
        let [at, x, y] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| view.ray(x, y).dir);
        Self {
            origin: view.center.to_array(),
            dir: [at, x - at, y - at].map(|v| v.as_vec3().to_array()),
        }
    }

    /// Rays through the centres of a block's pixels.
    #[inline]
    fn aim(&self, corner: [u32; 2], packet: &mut Packet) {
        let [x0, y0] = corner.map(|v| v as f32 + 0.5);
        let rays = &mut packet.rays;
        for i in 0..3 {
            rays.origin[i] = [self.origin[i]; LANES];
            let base = self.dir[0][i] + x0 * self.dir[1][i] + y0 * self.dir[2][i];
            let (dx, dy) = (self.dir[1][i], self.dir[2][i]);
            rays.dir[i] = std::array::from_fn(|l| base + (l % 4) as f32 * dx + (l / 4) as f32 * dy);
        }
        rays.near = [0.0; LANES];
        rays.far = [f32::INFINITY; LANES];
        packet.hits.prim = [NOTHING; LANES];
        packet.hits.geometry = [NOTHING; LANES];
    }
}

impl<T: PacketTracer> Contender for Peer<T> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn build(&self) -> Option<Time> {
        Some(self.build)
    }

    fn draw(&self, job: &Job, picture: &mut Picture) -> u64 {
        let (facets, rays) = (job.facets(), EyeRays::new(&job.view));
        let tiles = picture
            .tiles_mut()
            .map_init(Work::<T::Scratch>::default, |work, out| {
                let count = out.blocks.len();
                work.prim.resize(count, [NOTHING; LANES]);
                work.depth.resize(count, [0.0; LANES]);
                work.lit.resize(count, [0; LANES]);
                let mut asked = 0;
                for block in 0..count {
                    let (bx, by) = (block as u32 % out.stride, block as u32 / out.stride);
                    let corner = [out.corner[0] + bx * 4, out.corner[1] + by * 4];
                    rays.aim(corner, &mut work.eye);
                    self.tracer
                        .closest(&Valid([-1; LANES]), &mut work.eye, &mut work.scratch);
                    work.prim[block] = work.eye.hits.prim;
                    work.depth[block] = work.eye.rays.far;
                    asked += match job.kind {
                        FrameKind::Eye => 0,
                        FrameKind::EyeHard => self.ask(job.light, &facets, block, work),
                        FrameKind::EyeSoft => self.ask_area(job, &facets, corner, block, work),
                    };
                }
                let hits = TileOfPeer {
                    stride: out.stride,
                    work,
                };
                facets.shade(&hits, out.corner, out.stride, out.blocks);
                let samples = match job.kind {
                    FrameKind::Eye => return asked,
                    FrameKind::EyeHard => 1,
                    FrameKind::EyeSoft => SOFT_SAMPLES as u8,
                };
                for (block, lit) in out.blocks.iter_mut().zip(&work.lit) {
                    darken(block, lit, samples);
                }
                asked
            });
        tiles.sum()
    }
}

impl<T: PacketTracer> Peer<T> {
    /// One shadow ray from every hit of a block that is turned towards the light.
    #[inline]
    fn ask(&self, light: Light, facets: &Facets, block: usize, work: &mut Work<T::Scratch>) -> u64 {
        work.lit[block] = [0; LANES];
        let Some((valid, depth)) = turned_to_light(&work.eye, facets) else {
            return 0;
        };
        work.shadow.rays.origin = points(&work.eye, &depth);
        let shadow = &mut work.shadow.rays;
        match light {
            Light::Point(p) => aim_at(shadow, &[[p.x; LANES], [p.y; LANES], [p.z; LANES]]),
            Light::Directional(d) => {
                shadow.dir = [[d.x; LANES], [d.y; LANES], [d.z; LANES]];
                shadow.near = depth.map(|d| CUT * d);
                shadow.far = [f32::INFINITY; LANES];
            }
        }
        self.tracer.occluded(&valid, shadow, &mut work.scratch);
        work.lit[block] = std::array::from_fn(|l| open(&valid, shadow, l));
        valid.count()
    }

    /// Shadow rays to the points of the area light, sixteen pixels at a time.
    #[inline]
    fn ask_area(
        &self,
        job: &Job,
        facets: &Facets,
        corner: [u32; 2],
        block: usize,
        work: &mut Work<T::Scratch>,
    ) -> u64 {
        work.lit[block] = [0; LANES];
        let Some((mut valid, depth)) = turned_to_light(&work.eye, facets) else {
            return 0;
        };
        let asked = valid.count() * u64::from(SOFT_SAMPLES);
        work.shadow.rays.origin = points(&work.eye, &depth);
        let (normal, center) = (job.area.normal().as_vec3(), job.area_center());
        let shadow = &mut work.shadow.rays;
        for l in 0..LANES {
            let offset: f32 = (0..3)
                .map(|i| (shadow.origin[i][l] - center[i]) * normal[i])
                .sum();
            // What is behind the light gets nothing of it.
            valid.0[l] &= -i32::from(offset > 0.0);
        }
        if valid.count() == 0 {
            return asked;
        }
        let [x, y] = corner.map(|v| v % PATTERN / 4);
        for ends in &job.points[(y * (PATTERN / 4) + x) as usize] {
            aim_at(shadow, ends);
            self.tracer.occluded(&valid, shadow, &mut work.scratch);
            for (l, lit) in work.lit[block].iter_mut().enumerate() {
                *lit += open(&valid, shadow, l);
            }
        }
        asked
    }
}

/// Which rays have hit a side that is turned towards the light, and the depth of these, 0 elsewhere; `None` if there are
/// none.
#[inline]
fn turned_to_light(eye: &Packet, facets: &Facets) -> Option<(Valid, Lanes<f32>)> {
    let turned = |prim: u32| prim != NOTHING && facets.facet(prim) > 0.0;
    let turned = eye.hits.prim.map(turned);
    let depth = |l: usize| if turned[l] { eye.rays.far[l] } else { 0.0 };
    let valid = Valid(turned.map(|turned| -i32::from(turned)));
    (valid.count() > 0).then(|| (valid, std::array::from_fn(depth)))
}

/// Points at these depths.
#[inline]
fn points(eye: &Packet, depth: &Lanes<f32>) -> [Lanes<f32>; 3] {
    let along = |i: usize, l: usize| eye.rays.origin[i][l] + depth[l] * eye.rays.dir[i][l];
    std::array::from_fn(|i| std::array::from_fn(|l| along(i, l)))
}

/// Aims rays at these ends.
#[inline]
fn aim_at(rays: &mut Rays, ends: &[Lanes<f32>; 3]) {
    for ((dir, end), origin) in rays.dir.iter_mut().zip(ends).zip(&rays.origin) {
        *dir = std::array::from_fn(|l| end[l] - origin[l]);
    }
    rays.near = [CUT; LANES];
    rays.far = [1.0 - CUT; LANES];
}

/// 1 for a ray that was asked about and met nothing.
#[inline]
fn open(valid: &Valid, rays: &Rays, lane: usize) -> u8 {
    u8::from(valid.0[lane] != 0 && rays.far[lane] >= 0.0)
}
