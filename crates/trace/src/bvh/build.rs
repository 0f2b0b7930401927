//! Building: `obvhs` clusters the boxes (PLOC), then its binary tree is widened to four children a node.
//!
//! Two things keep the clustering sound for any input. It sees boxes mapped to the unit cube, so that no area
//! overflows; and each box is grown by a small amount hashed from its index. Without that, rows of equal boxes tie
//! in cost, every box prefers its right neighbour, one pair a round is merged, and the build takes quadratic time
//! and gives a tree as deep as the row is long. The boxes traversed are computed afresh from the triangles.
//!
//! The result does not depend on the number of threads.

use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

use super::node::{Bounds, INNER, Node, WIDTH};
use crate::{BuildStats, Triangles};

const MAX_LEAF: u32 = 4;
/// Cost of opening a node in triangle tests.
const NODE_COST: f32 = 1.0;
/// Share of the nodes that the first reinsertion pass reconsiders; later passes take less.
const REINSERTION: f32 = 0.02;
/// Growth of a box before clustering, at most, as a share of its own size and of the scene.
const JITTER_OWN: f32 = 1.0 / 64.0;
const JITTER_SCENE: f32 = 1.0 / (1u32 << 20) as f32;

/// A triangle in leaf order. 40 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    pub(super) corners: [Vec3; 3],
    pub(super) prim: u32,
}

/// What building makes.
pub(super) struct Built {
    /// The root first; empty without triangles.
    pub(super) nodes: Vec<Node>,
    pub(super) leaves: Vec<Leaf>,
    /// Entries a traversal stack can ever need.
    pub(super) stack: usize,
    /// Largest magnitude of a coordinate.
    pub(super) reach: f64,
    pub(super) stats: BuildStats,
}

/// Builds over all triangles that are finite and have area.
pub(super) fn build(triangles: &Triangles) -> Built {
    let (prims, stats) = usable(triangles);
    let boxes: Vec<Bounds> = prims
        .par_iter()
        .map(|&p| Bounds::of(&triangles.corners(p)))
        .collect();
    let Some(scene) = boxes.par_iter().copied().reduce_with(|a, b| a.union(&b)) else {
        return Built {
            nodes: Vec::new(),
            leaves: Vec::new(),
            stack: 0,
            reach: 0.0,
            stats,
        };
    };
    let tree = cluster(&boxes, &scene);
    let order = &tree.primitive_indices;
    let leaves = order
        .par_iter()
        .map(|&i| Leaf {
            corners: triangles.corners(prims[i as usize]),
            prim: prims[i as usize],
        })
        .collect();
    let (nodes, stack) = widen(&tree, &true_bounds(&tree, &boxes));
    let reach = f64::from(scene.min.abs().max(scene.max.abs()).max_element());
    Built {
        nodes,
        leaves,
        stack,
        reach,
        stats,
    }
}

/// Ids of the triangles that take part.
fn usable(triangles: &Triangles) -> (Vec<u32>, BuildStats) {
    let prims: Vec<u32> = (0..triangles.len() as u32)
        .into_par_iter()
        .filter(|&p| !triangles.is_degenerate(p))
        .collect();
    let non_finite = (0..triangles.len() as u32)
        .into_par_iter()
        .filter(|&p| !triangles.corners(p).iter().all(|c| c.is_finite()))
        .count();
    let stats = BuildStats {
        triangles: prims.len(),
        dropped_non_finite: non_finite,
        dropped_degenerate: triangles.len() - prims.len() - non_finite,
    };
    (prims, stats)
}

fn cluster(boxes: &[Bounds], scene: &Bounds) -> Bvh2 {
    let (low, high) = (scene.min.as_dvec3(), scene.max.as_dvec3());
    let scale = 1.0 / (high - low).max_element();
    let unit = |p: Vec3A| ((p.as_dvec3() - low) * scale).as_vec3a();
    let input: Vec<Aabb> = boxes
        .par_iter()
        .enumerate()
        .map(|(i, b)| {
            let (min, max) = (unit(b.min), unit(b.max));
            let share = (hashed(i as u32) >> 8) as f32 / (1u32 << 24) as f32;
            let grow = ((max - min).max_element() * JITTER_OWN + JITTER_SCENE) * share;
            Aabb::new(min - grow, max + grow)
        })
        .collect();
    let mut tree = PlocBuilder::with_capacity(input.len()).build(
        PlocSearchDistance::Low,
        &input,
        (0..input.len() as u32).collect(),
        SortPrecision::U64,
        2,
    );
    ReinsertionOptimizer::default().run(&mut tree, REINSERTION, None);
    collapse(&mut tree, MAX_LEAF, NODE_COST);
    tree
}

/// A well mixed function of the index (the finaliser of `MurmurHash3`).
fn hashed(i: u32) -> u32 {
    let mut h = i;
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Nodes of the binary tree, every child after its parent.
fn preorder(tree: &Bvh2) -> Vec<u32> {
    let mut order = Vec::with_capacity(tree.nodes.len());
    let mut stack = vec![0u32];
    while let Some(i) = stack.pop() {
        order.push(i);
        let node = &tree.nodes[i as usize];
        if !node.is_leaf() {
            stack.extend([node.first_index, node.first_index + 1]);
        }
    }
    order
}

/// Boxes of the binary tree's nodes around the real triangles.
fn true_bounds(tree: &Bvh2, boxes: &[Bounds]) -> Vec<Bounds> {
    let nothing = Bounds {
        min: Vec3A::INFINITY,
        max: Vec3A::NEG_INFINITY,
    };
    let mut bounds = vec![nothing; tree.nodes.len()];
    for i in preorder(tree).into_iter().rev() {
        let node = &tree.nodes[i as usize];
        let first = node.first_index as usize;
        bounds[i as usize] = if node.is_leaf() {
            let prims = &tree.primitive_indices[first..first + node.prim_count as usize];
            prims
                .iter()
                .fold(nothing, |all, &p| all.union(&boxes[p as usize]))
        } else {
            bounds[first].union(&bounds[first + 1])
        };
    }
    bounds
}

/// The binary tree with four children a node: of a node's children the largest inner one is replaced by its own
/// two until there are four. Also gives the stack a traversal needs.
fn widen(tree: &Bvh2, bounds: &[Bounds]) -> (Vec<Node>, usize) {
    let mut nodes = vec![Node::EMPTY];
    // Binary node to be opened, where its children go, entries on the stack when it is opened.
    let mut work = vec![(0u32, 0usize, 0usize)];
    let mut stack = 0;
    while let Some((source, target, held)) = work.pop() {
        let children = open(tree, bounds, source);
        let mut node = Node::EMPTY;
        let held = held + children.len() - 1;
        stack = stack.max(held + 1);
        for (lane, &child) in children.iter().enumerate() {
            node.set_box(lane, &bounds[child as usize]);
            let binary = &tree.nodes[child as usize];
            if binary.is_leaf() {
                node.first[lane] = binary.first_index;
                node.count[lane] = binary.prim_count;
            } else {
                node.first[lane] = nodes.len() as u32;
                node.count[lane] = INNER;
                work.push((child, nodes.len(), held));
                nodes.push(Node::EMPTY);
            }
        }
        nodes[target] = node;
    }
    (nodes, stack)
}

/// Up to four nodes of the binary tree that together are `source`.
fn open(tree: &Bvh2, bounds: &[Bounds], source: u32) -> Vec<u32> {
    let mut children = vec![source];
    while children.len() < WIDTH {
        let area = |&i: &usize| bounds[children[i] as usize].half_area();
        let largest = (0..children.len())
            .filter(|&i| !tree.nodes[children[i] as usize].is_leaf())
            .max_by(|a, b| area(a).total_cmp(&area(b)));
        let Some(largest) = largest else { break };
        let first = tree.nodes[children[largest] as usize].first_index;
        children[largest] = first;
        children.push(first + 1);
    }
    children
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles side by side, `spacing` apart.
    fn row(count: u32, spacing: f32) -> Built {
        let (mut x, mut y) = (Vec::new(), Vec::new());
        for i in 0..count {
            let left = i as f32 * spacing;
            x.extend([left, left + 1.0, left]);
            y.extend([0.0, 0.0, 1.0]);
        }
        let indices: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        build(&Triangles::new(&x, &y, &vec![0.0; x.len()], &indices))
    }

    #[test]
    fn equal_boxes_make_a_shallow_tree() {
        // A power of two of them, so that no rounding breaks the ties; and all in one place.
        for (count, spacing) in [(1 << 13, 1.0), (1 << 13, 0.0)] {
            let built = row(count, spacing);
            assert!(
                built.stack < 200,
                "a stack of {} for spacing {spacing}",
                built.stack
            );
        }
    }
}
