//! [`Cube`]: the layered depth cube in a GPU's memory; `trace::ldc` in WGSL.
//!
//! VMV07 routes triangles in a geometry shader, which WebGPU has not, and peels, which takes as many passes as there
//! are layers. Here everything is compute: a thread per row of a triangle works out the routing again (some fifty
//! operations), texels count their samples, a prefix sum gives each its place, a second sweep fills them in, and each
//! texel sorts its few by depth and id, so that the order of threads leaves no trace. Peeling is there for comparison
//! (`CubeOptions::build`).
//!
//! Layout: 4 bytes a texel, 12 a sample (id, depth, slopes; 8 with 16 bits of depth, once it is built), 16 a cell, 12 a triangle and 12 a vertex. The samples'
//! 128 MiB binding allows 11 million of them; a scene that would have more gets a cube of half the resolution, a
//! quarter and so on. Cost: a sweep costs what its samples do; a ray some hundred steps. Limits: resolution up to
//! 2048, where f32 texel coordinates still resolve 1/8192 of a texel. Texels of more than 1,024 samples are in no order, and
//! exact rays that take more than 4,000 rounds are asked of the CPU: Mesa's software driver leaves a thread's loops after some
//! 65,000, done or not.

pub(crate) mod build;
pub(crate) mod layout;
pub(crate) mod shaders;
mod still;
#[cfg(test)]
mod tests;
mod trace;

use std::sync::Arc;

use half::f16;

pub use still::StillCube;

use rayward_trace::ldc::{Coverage, CubeFrame, DepthFormat, Hierarchy, LdcBuild, StepCounts, TexelSample};
use rayward_trace::{BuildStats, Triangles};
use wgpu::Buffer;

use crate::{Gpu, Result};

/// Parameters of a cube.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CubeOptions {
    /// Texels along the longest side of the scene's box, 16 to 2048.
    pub resolution: u32,
    /// How samples are made.
    pub build: LdcBuild,
    /// How their depth is stored.
    pub depth: DepthFormat,
    /// What lies above the texels.
    pub hierarchy: Hierarchy,
    /// The resolution is halved until there are no more samples than this, nor than fit a binding.
    pub max_samples: u64,
}

impl Default for CubeOptions {
    fn default() -> Self {
        Self {
            resolution: 512,
            build: LdcBuild::Csr(Coverage::Conservative),
            depth: DepthFormat::F32,
            hierarchy: Hierarchy::Pyramid,
            max_samples: 1 << 26,
        }
    }
}

/// The layered depth cube over the triangles of one frame, in a GPU's memory, or two: of what stands still over a row of
/// frames and of what moves ([`rayward_trace::ldc::StillCube`]).
#[derive(Debug)]
pub struct Cube<'a> {
    gpu: &'a Gpu,
    triangles: Triangles<'a>,
    /// One or two.
    stacks: Vec<Arc<Stacks>>,
    stats: BuildStats,
    /// Triangles whose samples are of this frame.
    rebuilt: usize,
}

/// The stacks over some triangles.
#[derive(Debug)]
pub(crate) struct Stacks {
    frame: CubeFrame,
    layout: layout::Frame,
    depth: DepthFormat,
    /// Samples of all directions, those that equal depths have left over included.
    samples: u64,
    layers: u32,
    /// Whether its samples name every triangle over a texel.
    complete: bool,
    buffers: Buffers,
}

#[derive(Debug)]
struct Buffers {
    frame: Buffer,
    positions: Buffer,
    indices: Buffer,
    starts: Buffer,
    samples: Buffer,
    cells: Buffer,
}

/// What tracing a batch of rays took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TraceStats {
    /// Rays traced.
    pub rays: usize,
    /// Rays whose answer f32 could not tell, which were answered on the CPU.
    pub unsure: usize,
    /// Steps of all rays on the GPU.
    pub steps: StepCounts,
}

impl Stacks {
    /// Samples of one direction as three words, as they were before they were packed but for the depth's bits.
    fn unpacked(&self, gpu: &Gpu, [from, to]: [u64; 2], axis: usize) -> Result<Vec<[u32; 3]>> {
        let scale = self.layout.size[axis] as f32;
        let share = |bits: u32| match self.depth {
            DepthFormat::F16 => f16::from_bits((bits >> 16) as u16).to_f32(),
            _ => (bits >> 16) as f32 / f32::from(u16::MAX),
        };
        if self.depth == DepthFormat::F32 {
            return gpu.read(&self.buffers.samples, from, to - from);
        }
        let packed: Vec<[u32; 2]> = gpu.read(&self.buffers.samples, from, to - from)?;
        let one = |[prim, bits]: [u32; 2]| [prim, (share(bits) * scale).to_bits(), bits & 0xffff];
        Ok(packed.into_iter().map(one).collect())
    }
}

impl Buffers {
    fn bytes(&self) -> u64 {
        let all = [
            &self.frame,
            &self.positions,
            &self.indices,
            &self.starts,
            &self.samples,
            &self.cells,
        ];
        all.map(Buffer::size).iter().sum()
    }
}

impl Cube<'_> {
    /// What was built and what was left out.
    pub fn stats(&self) -> BuildStats {
        self.stats
    }

    /// Triangles whose samples were made for this frame, not kept from one before.
    pub fn rebuilt(&self) -> usize {
        self.rebuilt
    }

    /// Where the cube lies; the first if there are two.
    pub fn frame(&self) -> CubeFrame {
        self.stacks[0].frame
    }

    /// Texels of all directions.
    pub fn texels(&self) -> u64 {
        let texels = |stacks: &Arc<Stacks>| u64::from(stacks.layout.first_texel[3]);
        self.stacks.iter().map(texels).sum()
    }

    /// Samples of all directions.
    pub fn samples(&self) -> u64 {
        self.stacks.iter().map(|stacks| stacks.samples).sum()
    }

    /// Samples in the fullest texel: VMV07's number of peeling passes.
    pub fn layers(&self) -> u32 {
        self.stacks.iter().map(|stacks| stacks.layers).fold(0, u32::max)
    }

    /// Memory of the cube on the device in bytes, triangles included.
    pub fn bytes(&self) -> u64 {
        self.stacks.iter().map(|stacks| stacks.buffers.bytes()).sum()
    }

    /// All samples of one direction, by texel in memory order, then by depth; of the first cube if there are two.
    pub fn texel_samples(&self, axis: usize) -> Result<Vec<TexelSample>> {
        let stacks = &self.stacks[0];
        let Stacks { layout, buffers, .. } = &**stacks;
        let [first, end] = [0, 1].map(|i| u64::from(layout.first_texel[axis + i]));
        let starts: Vec<u32> = self.gpu.read(&buffers.starts, first, end - first + 1)?;
        let (from, to) = (u64::from(starts[0]), u64::from(starts[starts.len() - 1]));
        let samples = stacks.unpacked(self.gpu, [from, to], axis)?;
        let mut all = Vec::with_capacity(samples.len());
        for (texel, range) in starts.windows(2).enumerate() {
            let [a, b] = [range[0] - starts[0], range[1] - starts[0]].map(|i| i as usize);
            let kept = samples[a..b].iter().filter(|s| s[0] != u32::MAX);
            all.extend(kept.map(|&[prim, depth, slopes]| TexelSample {
                texel: texel as u32,
                prim,
                depth: f32::from_bits(depth),
                slopes: (slopes != 0x8080).then_some([slopes as u8 as i8, (slopes >> 8) as u8 as i8]),
            }));
        }
        Ok(all)
    }
}
