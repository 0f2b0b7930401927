//! [`GpuBvh`]: the general hierarchy in a GPU's memory, traced in a shader: what VMV07 planned to compare its cube with.
//!
//! The hierarchy is that of [`Bvh`], built on the CPU and sent to the device for every frame, in the cube's texel
//! coordinates, so that rays, triangle tests and what is unsure are the same as in [`crate::Cube`].
//!
//! Layout: 128 bytes a node, 4 a reference, 12 a triangle and 12 a vertex. Limits: 2^24 nodes of a 128 MiB binding
//! divided by 16, a million; trees in which more than 96 children can wait at a time are refused.

#[cfg(test)]
pub(crate) mod tests;

use bytemuck::{Pod, Zeroable};
use rayward_trace::ldc::CubeFrame;
use rayward_trace::{Accel, Bvh, BvhNode, Hit, Light, Ray, Receiver, SurfaceRay, Triangles};
use wgpu::Buffer;

use crate::batch::{Structure, SurfaceHit, Traced};
use crate::ldc::build::{Placed, usable};
use crate::ldc::shaders::TREE;
use crate::{Error, Gpu, Result, TraceStats};

/// `STACK` of `bvh.wgsl`.
const STACK: usize = 96;

/// `REACH` of `common.wgsl`, by which boxes grow.
const REACH: f64 = 1.0 / 256.0;

/// Stands for no bound in a shader.
const FAR: f64 = 1e30;

/// `Node` of `bvh.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Node {
    pub(crate) low_x: [f32; 4],
    pub(crate) high_x: [f32; 4],
    pub(crate) low_y: [f32; 4],
    pub(crate) high_y: [f32; 4],
    pub(crate) low_z: [f32; 4],
    pub(crate) high_z: [f32; 4],
    pub(crate) first: [u32; 4],
    pub(crate) count: [u32; 4],
}

impl Node {
    fn of(node: &BvhNode, frame: &CubeFrame) -> Self {
        let corner = frame.corner.to_array();
        let face = |axis: usize, upper: usize| {
            let grown = if upper == 1 { REACH } else { -REACH };
            node.bounds[axis][upper].map(|at| {
                let texels = (f64::from(at) - corner[axis]) / frame.side + grown;
                // A missing child has no bounds at all.
                texels.clamp(-FAR, FAR) as f32
            })
        };
        Self {
            low_x: face(0, 0),
            high_x: face(0, 1),
            low_y: face(1, 0),
            high_y: face(1, 1),
            low_z: face(2, 0),
            high_z: face(2, 1),
            first: node.first,
            count: node.count,
        }
    }
}

/// A hierarchy over the triangles of one frame, in a GPU's memory.
#[derive(Debug)]
pub struct GpuBvh<'a> {
    gpu: &'a Gpu,
    triangles: Triangles<'a>,
    placed: Placed,
    empty: bool,
    nodes: Buffer,
    leaves: Buffer,
}

impl<'a> GpuBvh<'a> {
    /// Sends a hierarchy over these triangles to the device.
    ///
    /// # Errors
    /// [`Error::Limits`], if it does not fit a binding or is too deep; those of the device.
    pub fn new(gpu: &'a Gpu, triangles: Triangles<'a>, bvh: &Bvh) -> Result<Self> {
        let (prims, _) = usable(&triangles);
        if bvh.stack() > STACK {
            return Err(Error::Limits {
                adapter: gpu.name(),
                what: "children of the hierarchy that wait",
                needed: bvh.stack() as u64,
                limit: STACK as u64,
            });
        }
        let placed = Placed::new(gpu, &triangles, &prims)?;
        let mut nodes: Vec<Node> = bvh
            .nodes()
            .iter()
            .map(|node| Node::of(node, &placed.frame))
            .collect();
        let empty = nodes.is_empty();
        // A binding has room for one node at least.
        nodes.resize(nodes.len().max(1), Node::zeroed());
        let leaves: Vec<u32> = bvh.leaf_prims().collect();
        Ok(Self {
            gpu,
            triangles,
            placed,
            empty,
            nodes: gpu.uploaded("nodes of the hierarchy", &nodes)?,
            leaves: gpu.uploaded("leaves of the hierarchy", &leaves)?,
        })
    }

    /// Memory on the device in bytes, triangles included.
    pub fn bytes(&self) -> u64 {
        self.placed.bytes() + self.nodes.size() + self.leaves.size()
    }

    /// [`crate::Cube::closest`].
    ///
    /// # Errors
    /// Those of the device.
    pub fn closest(&self, rays: &[Ray], cpu: &impl Accel) -> Result<(Vec<Option<Hit>>, TraceStats)> {
        self.traced().closest(rays, cpu)
    }

    /// [`crate::Cube::after`].
    ///
    /// # Errors
    /// Those of the device.
    pub fn after(&self, rays: &[SurfaceRay], cpu: &Bvh) -> Result<(Vec<SurfaceHit>, TraceStats)> {
        self.traced().after(rays, cpu)
    }

    /// [`crate::Cube::shadowed`].
    ///
    /// # Errors
    /// Those of the device.
    pub fn shadowed(
        &self,
        queries: &[(Receiver, Light)],
        cpu: &impl Accel,
    ) -> Result<(Vec<bool>, TraceStats)> {
        self.traced().shadowed(queries, cpu)
    }

    fn traced(&self) -> Traced<'_> {
        let mut bindings = self.placed.bindings().to_vec();
        bindings.extend([(3, &self.nodes), (4, &self.leaves)]);
        let tree = Structure {
            frame: self.placed.frame,
            empty: self.empty,
            complete: true,
            bindings,
            placing: None,
        };
        Traced {
            gpu: self.gpu,
            triangles: self.triangles,
            program: &TREE,
            structures: vec![tree],
        }
    }
}
