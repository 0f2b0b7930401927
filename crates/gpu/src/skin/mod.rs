//! [`GpuSkin`]: the vertices of an animated scene, posed on the device, and cubes of them there (VMV07 skins in its vertex
//! stage and peels what comes out of it).
//!
//! The formula is that of [`Scene::at`], the weighted mean of the joints' matrices times the vertex at rest, in f32. With
//! u = 2^-24 matrices and shares are rounded to u each, their products and sums add 4 u, the product with the vertex 4 u:
//! a posed coordinate is known to 12 u of the sum of all products' magnitudes, rounding of a morphed vertex included. So
//! positions are *not* those of the CPU's frames bit by bit, and `--gpu` frames, which are to be those of the CPU, do not
//! take them.
//!
//! Answers are exact nevertheless: the positions are read back once and *are* the frame's ([`PosedVertices::triangles`]),
//! for everything that is asked of the CPU, and the cube is built of the very same numbers, which have not left the
//! device. There they are turned into texel coordinates in f32, by a subtraction, a product and the rounding of 1 / side:
//! 3 u of the coordinate where the CPU has u. For that the cube's corner is moved to numbers that f32 has, by at most an
//! eighth of a texel, and `meet.wgsl` allows for the difference (`Frame::doubt`): with corners known to 3 u S, the ray's
//! point to 4 u S, its 12 A (5 u S + u A) becomes 12 A (7 u S + u A). Where f32 is too coarse for the corner, far from zero,
//! coordinates come from the CPU as for other cubes.
//!
//! Layout: 12 bytes a vertex at rest, 32 for its joints, 48 a joint; 12 a posed vertex and 12 for it in the cube. Limits:
//! vertices that are not finite may come out as anything; morph targets are added up on the CPU and sent when they change.

#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec3};
use rayward::scene::{ObjectMotion, Scene};
use rayward_trace::Triangles;
use rayward_trace::ldc::CubeFrame;
use wgpu::Buffer;

use crate::ldc::build::groups;
use crate::ldc::shaders::SKIN;
use crate::{Gpu, Result};

/// `Skin` of `skin.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Skin {
    pub(crate) corner: [f32; 3],
    pub(crate) vertices: u32,
    pub(crate) per_side: f32,
    /// The end of the shader's structure.
    pub(crate) pad: [u32; 3],
}

/// `Influence` of `skin.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Influence {
    pub(crate) joints: [u32; 4],
    pub(crate) shares: [f32; 4],
}

/// A scene's vertices at rest on the device, with the joints that move them.
#[derive(Debug)]
pub struct GpuSkin<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    vertices: usize,
    morphs: bool,
    rest: Buffer,
    influences: Buffer,
}

/// The vertices of one frame as the device has posed them, there and here.
#[derive(Debug)]
pub struct PosedVertices<'a> {
    gpu: &'a Gpu,
    positions: [Vec<f32>; 3],
    device: Buffer,
}

impl<'a> GpuSkin<'a> {
    /// Sends a scene's vertices to the device.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene) -> Result<Self> {
        let motions = scene.motions(None, 0.0);
        let mut influences = Vec::new();
        let mut first = 0;
        for motion in &motions {
            influences.extend((0..motion.primitive.positions.len()).map(|v| {
                let each = motion.influences(v);
                Influence {
                    joints: each.map(|(joint, _)| first + joint as u32),
                    shares: each.map(|(_, share)| share as f32),
                }
            }));
            first += motion.matrices.len() as u32;
        }
        Ok(Self {
            gpu,
            scene,
            vertices: influences.len(),
            morphs: motions.iter().any(|m| !m.primitive.morph_targets.is_empty()),
            rest: gpu.uploaded("vertices at rest", &at_rest(&motions))?,
            influences: gpu.uploaded("joints of vertices", &influences)?,
        })
    }

    /// Vertices, in the order of [`Scene::at`]'s frames.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// Poses all vertices for a time, as [`Scene::at_animation`] does.
    ///
    /// # Errors
    /// Those of the device.
    pub fn pose(&self, animation: Option<usize>, time: f32) -> Result<PosedVertices<'a>> {
        let gpu = self.gpu;
        let motions = self.scene.motions(animation, time);
        let rows: Vec<[f32; 4]> = motions.iter().flat_map(|m| &m.matrices).flat_map(rows).collect();
        let joints = gpu.uploaded("matrices of joints", &rows)?;
        let morphed = if self.morphs {
            Some(gpu.uploaded("morphed vertices", &at_rest(&motions))?)
        } else {
            None
        };
        let constants = gpu.uniform("skinning", &constants(self.vertices, DVec3::ZERO, 1.0))?;
        let device = gpu.storage("posed vertices", 12 * self.vertices as u64)?;
        let bindings = [
            (0, &constants),
            (1, morphed.as_ref().unwrap_or(&self.rest)),
            (2, &self.influences),
            (3, &joints),
            (4, &device),
        ];
        gpu.dispatch(&SKIN, "pose", &bindings, groups(self.vertices as u64))?;
        let posed: Vec<[f32; 3]> = gpu.read(&device, 0, self.vertices as u64)?;
        let positions = [0, 1, 2].map(|axis| posed.iter().map(|p| p[axis]).collect());
        Ok(PosedVertices {
            gpu,
            positions,
            device,
        })
    }
}

fn constants(vertices: usize, corner: DVec3, side: f64) -> Skin {
    Skin {
        corner: corner.as_vec3().to_array(),
        vertices: vertices as u32,
        per_side: (1.0 / side) as f32,
        pad: [0; 3],
    }
}

/// Vertices in mesh space.
fn at_rest(motions: &[ObjectMotion]) -> Vec<[f32; 3]> {
    let of = |motion: &ObjectMotion| {
        let all = 0..motion.primitive.positions.len();
        all.map(|v| motion.local(v).as_vec3().to_array())
            .collect::<Vec<_>>()
    };
    motions.iter().flat_map(of).collect()
}

/// The rows of an affine matrix.
fn rows(matrix: &DMat4) -> [[f32; 4]; 3] {
    let transposed = matrix.transpose();
    [0, 1, 2].map(|row| transposed.col(row).as_vec4().to_array())
}

impl<'a> PosedVertices<'a> {
    /// The frame's triangles at these vertices.
    ///
    /// # Panics
    /// If an index is beyond the last vertex, as [`Triangles::new`].
    pub fn triangles<'s>(&'s self, indices: &'s [[u32; 3]]) -> Triangles<'s> {
        let [x, y, z] = &self.positions;
        Triangles::new(x, y, z, indices)
    }

    pub(crate) fn gpu(&self) -> &'a Gpu {
        self.gpu
    }

    /// The cube's frame with a corner that the device can subtract exactly; `None` if f32 is too coarse there.
    pub(crate) fn frame(frame: &CubeFrame) -> Option<CubeFrame> {
        let corner = frame.corner.as_vec3().as_dvec3();
        let near = (corner - frame.corner).abs().max_element() <= frame.side / 8.0;
        // A product by what is not a normal number is known to nothing.
        let per_side = (1.0 / frame.side) as f32;
        (near && per_side.is_normal()).then_some(CubeFrame { corner, ..*frame })
    }

    /// The vertices in texel coordinates of such a frame.
    pub(crate) fn texels(&self, frame: &CubeFrame) -> Result<Buffer> {
        let (gpu, vertices) = (self.gpu, self.positions[0].len());
        let constants = gpu.uniform(
            "texel coordinates",
            &constants(vertices, frame.corner, frame.side),
        )?;
        let texels = gpu.storage("vertices", 12 * vertices as u64)?;
        let bindings = [(0, &constants), (4, &self.device), (5, &texels)];
        gpu.dispatch(&SKIN, "to_texels", &bindings, groups(vertices as u64))?;
        Ok(texels)
    }
}
