//! The regular grid in world space that HM08 compares with, one ray after the other: our own, exact and not made for speed.

use glam::Vec3;
use rayward::trace::space::World;
use rayward::trace::{Candidates, Grid3, Ray, Triangles};

use super::{PacketTracer, Peer};
use crate::Stopwatch;
use crate::packet::{LANES, Packet, Rays, Valid};

/// A grid over all triangles, of the resolution that it chooses itself.
pub(crate) struct RegularGrid<'s>(Grid3<'s, World>);

impl<'s> RegularGrid<'s> {
    pub(crate) fn build(triangles: Triangles<'s>) -> Peer<Self> {
        let (grid, build) = Stopwatch::time(|| Grid3::in_world(triangles, None));
        Peer {
            name: "regular grid".into(),
            build,
            tracer: Self(grid),
        }
    }

    fn ray(rays: &Rays, lane: usize) -> Ray {
        let vector = |v: &[[f32; LANES]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        Ray {
            t_min: rays.near[lane],
            t_max: rays.far[lane],
            ..Ray::new(vector(&rays.origin), vector(&rays.dir))
        }
    }
}

impl PacketTracer for RegularGrid<'_> {
    type Scratch = ();

    fn closest(&self, valid: &Valid, packet: &mut Packet, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            if let Some((prim, hit)) = self.0.closest(&Self::ray(&packet.rays, lane), &mut ()) {
                packet.rays.far[lane] = hit.t as f32;
                packet.hits.prim[lane] = prim;
            }
        }
    }

    fn occluded(&self, valid: &Valid, rays: &mut Rays, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            if self.0.any(&Self::ray(rays, lane), &mut ()) {
                rays.far[lane] = f32::NEG_INFINITY;
            }
        }
    }
}
