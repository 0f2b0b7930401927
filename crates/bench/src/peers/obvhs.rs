//! `obvhs`: single rays, compressed eight-wide nodes or binary ones.

use std::time::Duration;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayward::trace::Triangles;

use super::{PacketTracer, Peer};
use crate::Stopwatch;
use crate::packet::{LANES, Packet, Rays, Valid};

/// Which of its trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ObvhsTree {
    /// Compressed, eight children a node.
    Wide,
    /// Binary.
    Binary,
}

enum Tree {
    Wide(CwBvh),
    Binary(Bvh2),
}

/// A tree over triangles in leaf order.
pub(crate) struct Obvhs {
    tree: Tree,
    triangles: Vec<RtTriangle>,
    prims: Vec<u32>,
}

impl Obvhs {
    /// Builds at its medium quality.
    pub(crate) fn build(triangles: &Triangles, kind: ObvhsTree) -> Peer<Self> {
        let corners = |prim: u32| triangles.corners(prim).map(Vec3A::from);
        let input: Vec<Triangle> = (0..triangles.len() as u32)
            .map(|prim| {
                let [v0, v1, v2] = corners(prim);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let (tree, build) = Stopwatch::time(|| {
            let (params, mut core) = (BvhBuildParams::medium_build(), Duration::ZERO);
            match kind {
                ObvhsTree::Wide => Tree::Wide(build_cwbvh_from_tris(&input, params, &mut core)),
                ObvhsTree::Binary => Tree::Binary(build_bvh2_from_tris(&input, params, &mut core)),
            }
        });
        let (name, prims) = match &tree {
            Tree::Wide(tree) => ("obvhs, wide", tree.primitive_indices.clone()),
            Tree::Binary(tree) => ("obvhs, binary", tree.primitive_indices.clone()),
        };
        let triangles = prims
            .iter()
            .map(|&prim| RtTriangle::from(&input[prim as usize]))
            .collect();
        Peer {
            name: name.into(),
            build,
            tracer: Self {
                tree,
                triangles,
                prims,
            },
        }
    }

    fn ray(rays: &Rays, lane: usize) -> Ray {
        let vector = |v: &[[f32; LANES]; 3]| Vec3A::from(Vec3::new(v[0][lane], v[1][lane], v[2][lane]));
        Ray::new(
            vector(&rays.origin),
            vector(&rays.dir),
            rays.near[lane],
            rays.far[lane],
        )
    }
}

impl PacketTracer for Obvhs {
    type Scratch = ();

    fn closest(&self, valid: &Valid, packet: &mut Packet, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            let ray = Self::ray(&packet.rays, lane);
            let mut hit = RayHit::none();
            let test = |ray: &Ray, i: usize| self.triangles[i].intersect(ray);
            let found = match &self.tree {
                Tree::Wide(tree) => tree.ray_traverse(ray, &mut hit, test),
                Tree::Binary(tree) => tree.ray_traverse(ray, &mut hit, test),
            };
            if found {
                packet.rays.far[lane] = hit.t;
                packet.hits.prim[lane] = self.prims[hit.primitive_id as usize];
            }
        }
    }

    fn occluded(&self, valid: &Valid, rays: &mut Rays, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            let ray = Self::ray(rays, lane);
            let test = |ray: &Ray, i: usize| self.triangles[i].intersect(ray);
            let miss = match &self.tree {
                Tree::Wide(tree) => tree.ray_traverse_miss(ray, test),
                Tree::Binary(tree) => tree.ray_traverse_miss(ray, test),
            };
            if !miss {
                rays.far[lane] = f32::NEG_INFINITY;
            }
        }
    }
}
