//! `bvh`: single rays, binary nodes over boxes of shapes, whose tests are the caller's.
//!
//! Its own test of a triangle leaves out those turned away, so triangles are tested as [`super::Obvhs`] tests them. Its
//! iterators know no end of a ray: boxes come in the order in which the ray enters them, and here the search ends at the
//! first one behind the hit, or behind the end.

use ::bvh::aabb::{Aabb, Bounded};
use ::bvh::bounding_hierarchy::{BHShape, BoundingHierarchy};
use ::bvh::bvh::Bvh;
use ::bvh::ray::Ray;
use glam::{Vec3, Vec3A};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use rayward::trace::Triangles;

use super::{PacketTracer, Peer};
use crate::Stopwatch;
use crate::packet::{LANES, Packet, Rays, Valid};

/// A triangle as a shape.
struct Shape {
    bounds: Aabb<f32, 3>,
    triangle: RtTriangle,
    prim: u32,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// Its tree over triangles in their own order.
pub(crate) struct BvhOfShapes {
    tree: Bvh<f32, 3>,
    shapes: Vec<Shape>,
}

/// One ray, for boxes and for triangles. Boxes are met at distances, triangles at parameters.
struct Query {
    boxes: Ray<f32, 3>,
    ray: obvhs::ray::Ray,
    length: f32,
}

impl Query {
    fn new(rays: &Rays, lane: usize) -> Self {
        let [origin, dir] = [&rays.origin, &rays.dir].map(|v| v.map(|axis| axis[lane]));
        let [o, d] = [origin, dir].map(|v| Vec3A::from(Vec3::from(v)));
        Self {
            boxes: Ray::new(origin.into(), dir.into()),
            ray: obvhs::ray::Ray::new(o, d, rays.near[lane], rays.far[lane]),
            length: d.length(),
        }
    }

    /// Whether a box is entered behind parameter `t`.
    fn enters_behind(&self, bounds: &Aabb<f32, 3>, t: f32) -> bool {
        let entry = self.boxes.intersection_slice_for_aabb(bounds);
        entry.is_some_and(|(entry, _)| entry > t * self.length)
    }
}

impl BvhOfShapes {
    /// Builds by its surface area heuristic, on all threads.
    pub(crate) fn build(triangles: &Triangles) -> Peer<Self> {
        let shape = |prim: u32| {
            let corners = triangles.corners(prim);
            let [v0, v1, v2] = corners.map(Vec3A::from);
            let bounds = corners.iter().fold(Aabb::empty(), |bounds, corner| {
                bounds.grow(&corner.to_array().into())
            });
            let triangle = RtTriangle::from(&Triangle { v0, v1, v2 });
            Shape {
                bounds,
                triangle,
                prim,
                node: 0,
            }
        };
        let mut shapes: Vec<Shape> = (0..triangles.len() as u32).map(shape).collect();
        let (tree, build) = Stopwatch::time(|| Bvh::build_par(&mut shapes));
        Peer {
            name: "crate bvh".into(),
            build,
            tracer: Self { tree, shapes },
        }
    }
}

impl PacketTracer for BvhOfShapes {
    type Scratch = ();

    fn closest(&self, valid: &Valid, packet: &mut Packet, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            let mut query = Query::new(&packet.rays, lane);
            for shape in self
                .tree
                .nearest_traverse_iterator(&query.boxes.clone(), &self.shapes)
            {
                if query.enters_behind(&shape.bounds, query.ray.tmax) {
                    break;
                }
                let t = shape.triangle.intersect(&query.ray);
                if t < query.ray.tmax {
                    query.ray.tmax = t;
                    packet.rays.far[lane] = t;
                    packet.hits.prim[lane] = shape.prim;
                }
            }
        }
    }

    fn occluded(&self, valid: &Valid, rays: &mut Rays, (): &mut ()) {
        for lane in (0..LANES).filter(|&lane| valid.0[lane] != 0) {
            let query = Query::new(rays, lane);
            let mut shapes = self.tree.traverse_iterator(&query.boxes, &self.shapes);
            if shapes.any(|shape| shape.triangle.intersect(&query.ray) < f32::INFINITY) {
                rays.far[lane] = f32::NEG_INFINITY;
            }
        }
    }
}
