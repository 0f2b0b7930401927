//! [`Bvh`]: a bounding volume hierarchy for arbitrary rays (reflection, refraction, single queries).
//!
//! Source: PLOC clustering with reinsertion (Meister and Bittner 2018), as `obvhs` implements it; widened to
//! four children a node.
//!
//! Layout: 128 bytes a node with its four child boxes side by side, 40 bytes a triangle in leaf order (its corners,
//! so that a leaf test touches one run of memory), at most four triangles a leaf. Units are the triangles'.
//!
//! Answers equal [`crate::BruteForce`]'s bit for bit: box tests are conservative (see the header of `bvh/slab.rs`),
//! an f64 filter drops triangles that are certainly missed, and [`crate::exact`] decides on the rest.
//!
//! Limits: build once, trace often; there is no refit. Coordinates beyond 2^125 are traced correctly, but every
//! triangle is tested.

mod build;
mod node;
mod slab;
mod surface;

use std::ops::ControlFlow;

use crate::brute::{hit_in_range, rounded, write_sorted};
use crate::exact::{self, ExactHit, Filter};
use crate::{Accel, BuildStats, Count, Hit, Light, Ray, Receiver, Triangles, ViewRay};
use build::{Built, Leaf};
pub use node::Node;
use node::{INNER, WIDTH};
use slab::Slab;

/// A hierarchy over the triangles of one frame. See the [module](self).
#[derive(Clone, Debug)]
pub struct Bvh<'a> {
    triangles: Triangles<'a>,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    stack: usize,
    reach: f64,
    stats: BuildStats,
}

/// Stack entries kept without allocation; deeper trees allocate their stack for each ray.
const INLINE_STACK: usize = 64;

impl<'a> Bvh<'a> {
    /// Builds over all triangles that are finite and have area, in parallel; the same for any number of threads.
    pub fn build(triangles: Triangles<'a>) -> Self {
        let Built {
            nodes,
            leaves,
            stack,
            reach,
            stats,
        } = build::build(&triangles);
        Self {
            triangles,
            nodes,
            leaves,
            stack,
            reach,
            stats,
        }
    }

    /// What was built and what was left out.
    pub fn stats(&self) -> BuildStats {
        self.stats
    }

    /// Memory of the hierarchy in bytes, the triangles themselves left out.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.leaves)
    }

    /// Its nodes, the root first, for tracers elsewhere; none without triangles.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Triangle ids in the order of the leaves.
    pub fn leaf_prims(&self) -> impl ExactSizeIterator<Item = u32> + '_ {
        self.leaves.iter().map(|leaf| leaf.prim)
    }

    /// Entries that the stack of a traversal can ever need.
    pub fn stack(&self) -> usize {
        self.stack
    }

    /// [`Accel::intersect`] in f64, counting the work.
    pub fn closest(&self, ray: &Ray, count: &mut impl Count) -> Option<(u32, ExactHit)> {
        let mut slab = self.slab(ray)?;
        let filter = Filter::new(ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut best: Option<(u32, ExactHit)> = None;
        self.walk(&mut slab, count, |leaf, slab| {
            if filter.certain_miss(&leaf.corners) {
                return ControlFlow::Continue(());
            }
            if let Some(hit) = hit_in_range(&self.triangles, leaf.prim, ray) {
                let closer = best.is_none_or(|(prim, b)| hit.t < b.t || (hit.t == b.t && leaf.prim < prim));
                if closer {
                    best = Some((leaf.prim, hit));
                    slab.shorten(hit.t);
                }
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// [`Accel::occluded`], counting the work.
    pub fn any(&self, ray: &Ray, count: &mut impl Count) -> bool {
        let Some(mut slab) = self.slab(ray) else {
            return false;
        };
        let filter = Filter::new(ray.origin.as_dvec3(), ray.dir.as_dvec3());
        let mut found = false;
        self.walk(&mut slab, count, |leaf, _| {
            found = !filter.certain_miss(&leaf.corners)
                && hit_in_range(&self.triangles, leaf.prim, ray).is_some();
            if found {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        found
    }

    /// [`Accel::shadowed`], counting the work.
    pub fn shadows(&self, receiver: &Receiver, light: &Light, count: &mut impl Count) -> bool {
        self.each_shadow(receiver, light, count, |_| ControlFlow::Break(()))
    }

    /// Calls `visit` with the triangles between a receiver and a light, in no order that means anything, until it
    /// breaks. Returns whether it did.
    pub fn each_shadow(
        &self,
        receiver: &Receiver,
        light: &Light,
        count: &mut impl Count,
        mut visit: impl FnMut(u32) -> ControlFlow<()>,
    ) -> bool {
        // The same origins and directions as `exact::shadows`. A negative error bound would let crossings behind
        // either end count.
        let beyond = if receiver.error >= 0.0 { 0.0 } else { f64::INFINITY };
        let (origin, dir, t_min, t_max) = match *light {
            Light::Point(position) => {
                let origin = position.as_dvec3();
                (origin, receiver.point - origin, 0.0, 1.0 + beyond)
            }
            Light::Directional(direction) => (receiver.point, direction.as_dvec3(), -beyond, f64::INFINITY),
        };
        let Some(mut slab) = Slab::new(origin, dir, t_min, t_max, self.reach) else {
            return false;
        };
        let filter = Filter::new(origin, dir);
        let mut broken = false;
        self.walk(&mut slab, count, |leaf, _| {
            let hidden = !filter.certain_miss(&leaf.corners)
                && exact::shadows(&self.triangles, leaf.prim, receiver, light);
            if hidden && visit(leaf.prim).is_break() {
                broken = true;
                return ControlFlow::Break(());
            }
            ControlFlow::Continue(())
        });
        broken
    }

    /// All triangles in front of the start of an f64 ray, as parameters and ids in ascending order.
    pub fn along(&self, ray: &ViewRay, count: &mut impl Count, hits: &mut Vec<(f64, u32)>) {
        hits.clear();
        let Some(mut slab) = Slab::new(ray.origin, ray.dir, 0.0, f64::INFINITY, self.reach) else {
            return;
        };
        let filter = Filter::new(ray.origin, ray.dir);
        self.walk(&mut slab, count, |leaf, _| {
            if !filter.certain_miss(&leaf.corners) {
                let hit = exact::hit(ray.origin, ray.dir, self.triangles.corners(leaf.prim));
                hits.extend(hit.filter(|h| h.t > 0.0).map(|h| (h.t, leaf.prim)));
            }
            ControlFlow::Continue(())
        });
        hits.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }

    fn slab(&self, ray: &Ray) -> Option<Slab> {
        if !ray.is_valid() {
            return None;
        }
        let (t_min, t_max) = (f64::from(ray.t_min), f64::from(ray.t_max));
        Slab::new(
            ray.origin.as_dvec3(),
            ray.dir.as_dvec3(),
            t_min,
            t_max,
            self.reach,
        )
    }

    /// Calls `visit` with every triangle whose leaf the ray may enter, nearer leaves first as far as boxes tell.
    #[inline(always)]
    fn walk<C: Count>(
        &self,
        slab: &mut Slab,
        count: &mut C,
        visit: impl FnMut(&Leaf, &mut Slab) -> ControlFlow<()>,
    ) {
        if self.stack <= INLINE_STACK {
            self.walk_with(&mut [Entry::default(); INLINE_STACK], slab, count, visit);
        } else {
            self.walk_with(&mut vec![Entry::default(); self.stack], slab, count, visit);
        }
    }

    #[inline(always)]
    fn walk_with<C: Count>(
        &self,
        stack: &mut [Entry],
        slab: &mut Slab,
        count: &mut C,
        mut visit: impl FnMut(&Leaf, &mut Slab) -> ControlFlow<()>,
    ) {
        if self.nodes.is_empty() {
            return;
        }
        stack[0] = Entry {
            near: f32::NEG_INFINITY,
            first: 0,
            count: INNER,
        };
        let mut held = 1;
        while held > 0 {
            held -= 1;
            let entry = stack[held];
            if entry.near > slab.t_max {
                continue;
            }
            if entry.count != INNER {
                let leaves = &self.leaves[entry.first as usize..][..entry.count as usize];
                count.triangles(leaves.len());
                for leaf in leaves {
                    if visit(leaf, slab).is_break() {
                        return;
                    }
                }
                continue;
            }
            count.node();
            let node = &self.nodes[entry.first as usize];
            let (near, hit) = slab.enter(node);
            let bottom = held;
            for lane in 0..WIDTH {
                if hit[lane] {
                    // Insertion sort: the nearest child ends up on top.
                    let child = Entry {
                        near: near[lane],
                        first: node.first[lane],
                        count: node.count[lane],
                    };
                    let mut at = held;
                    while at > bottom && stack[at - 1].near < child.near {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = child;
                    held += 1;
                }
            }
        }
    }
}

/// A node or a run of leaves waiting on the stack.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    near: f32,
    first: u32,
    count: u32,
}

impl Accel for Bvh<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.closest(ray, &mut ()).map(|(prim, hit)| rounded(prim, &hit))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.any(ray, &mut ())
    }

    fn all_hits(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        let mut found = Vec::new();
        if let Some(mut slab) = self.slab(ray) {
            self.walk(&mut slab, &mut (), |leaf, _| {
                found.extend(hit_in_range(&self.triangles, leaf.prim, ray).map(|hit| (leaf.prim, hit)));
                ControlFlow::Continue(())
            });
        }
        write_sorted(found, hits);
    }

    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool {
        self.shadows(receiver, light, &mut ())
    }
}
