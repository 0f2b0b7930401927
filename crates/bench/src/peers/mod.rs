//! Other ray tracers as contenders: packets of 4 x 4 pixels into a structure that was built before.
//!
//! A shadow ray goes from the hit, as f32 arithmetic finds it, to the light; its ends are cut off by a ten-thousandth of
//! its length, as is usual where hits are not exact.

mod obvhs;

use rayon::prelude::*;
use rayward::trace::{BLOCK_LANES, HitBlocks, Light, View, darken};

use crate::contender::{Contender, FrameKind, Job};
use crate::packet::{LANES, Lanes, NOTHING, Packet, Rays, Valid};
use crate::{Picture, Time};

pub(crate) use obvhs::{Obvhs, ObvhsTree};

/// Share of a shadow ray that is cut off at both of its ends.
const CUT: f32 = 1e-4;

/// A structure that is asked for packets.
pub(crate) trait PacketTracer: Sync {
    /// Closest hits: `far` and `hits.prim` of those rays that hit something.
    fn closest(&self, valid: &Valid, packet: &mut Packet);

    /// Any hits: `far` becomes minus infinity.
    fn occluded(&self, valid: &Valid, rays: &mut Rays);
}

/// A structure with its name and what it took to build.
pub(crate) struct Peer<T> {
    pub(crate) name: String,
    pub(crate) build: Time,
    pub(crate) tracer: T,
}

/// Working memory of a thread: a tile of hits, packets for both kinds of rays.
#[derive(Default)]
struct Work {
    prim: Vec<Lanes<u32>>,
    depth: Vec<Lanes<f32>>,
    lit: Vec<[u8; BLOCK_LANES]>,
    eye: Packet,
    shadow: Packet,
}

/// What a peer has found in a tile.
struct TileOfPeer<'w> {
    stride: u32,
    work: &'w Work,
}

impl HitBlocks for TileOfPeer<'_> {
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
        let tiles = picture.tiles_mut().map_init(Work::default, |work, out| {
            let count = out.blocks.len();
            work.prim.resize(count, [NOTHING; LANES]);
            work.depth.resize(count, [0.0; LANES]);
            work.lit.resize(count, [0; LANES]);
            let mut asked = 0;
            for block in 0..count {
                let (bx, by) = (block as u32 % out.stride, block as u32 / out.stride);
                let corner = [out.corner[0] + bx * 4, out.corner[1] + by * 4];
                rays.aim(corner, &mut work.eye);
                self.tracer.closest(&Valid([-1; LANES]), &mut work.eye);
                work.prim[block] = work.eye.hits.prim;
                work.depth[block] = work.eye.rays.far;
                if job.kind == FrameKind::EyeHard {
                    asked += self.ask(job.light, block, work);
                }
            }
            let hits = TileOfPeer {
                stride: out.stride,
                work,
            };
            facets.shade(&hits, out.corner, out.stride, out.blocks);
            if job.kind == FrameKind::EyeHard {
                for (block, lit) in out.blocks.iter_mut().zip(&work.lit) {
                    darken(block, lit, 1);
                }
            }
            asked
        });
        tiles.sum()
    }
}

impl<T: PacketTracer> Peer<T> {
    /// One shadow ray from every hit of a block.
    #[inline]
    fn ask(&self, light: Light, block: usize, work: &mut Work) -> u64 {
        let (eye, shadow) = (&work.eye, &mut work.shadow.rays);
        let valid = Valid(eye.hits.prim.map(|prim| if prim == NOTHING { 0 } else { -1 }));
        let asked = valid.0.iter().filter(|&&v| v != 0).count();
        if asked == 0 {
            work.lit[block] = [0; LANES];
            return 0;
        }
        let depth = eye.hits.prim.map(|prim| prim != NOTHING);
        let depth: Lanes<f32> = std::array::from_fn(|l| if depth[l] { eye.rays.far[l] } else { 0.0 });
        for i in 0..3 {
            let point: Lanes<f32> =
                std::array::from_fn(|l| eye.rays.origin[i][l] + depth[l] * eye.rays.dir[i][l]);
            shadow.dir[i] = match light {
                Light::Point(p) => point.map(|v| p[i] - v),
                Light::Directional(d) => [d[i]; LANES],
            };
            shadow.origin[i] = point;
        }
        match light {
            Light::Point(_) => {
                shadow.near = [CUT; LANES];
                shadow.far = [1.0 - CUT; LANES];
            }
            Light::Directional(_) => {
                shadow.near = depth.map(|d| CUT * d);
                shadow.far = [f32::INFINITY; LANES];
            }
        }
        self.tracer.occluded(&valid, shadow);
        let open = |l: usize| u8::from(valid.0[l] != 0 && shadow.far[l] >= 0.0);
        work.lit[block] = std::array::from_fn(open);
        asked as u64
    }
}
