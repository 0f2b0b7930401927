//! The layered depth cube (VMV07) and perspective grids (HM08) on any GPU that wgpu reaches: Vulkan, Metal, DirectX 12.
//!
//! | file | job |
//! |---|---|
//! | `device.rs` | adapters, the opened device, its errors |
//! | `commands.rs` | buffers, dispatches, reading back |
//! | `ldc/build.rs`, `raster.wgsl` and others | triangles to a cube |
//! | `ldc/trace.rs`, `walk.wgsl` and others | rays through a cube |
//! | `bvh/`, `bvh.wgsl` | rays through a hierarchy, for comparison |
//! | `grid/`, `grid.wgsl`, `look.wgsl` | rays of a vantage through its perspective grid (HM08) |
//! | `batch.rs` | arrays of rays to answers, for all of these |
//! | `skin/`, `skin.wgsl` | vertices of animated scenes, posed on the device |
//! | `secondary.rs` | the cube in frames of `rayward` |
//! | `shade/`, `attributes.wgsl`, `lit.wgsl` and others | surfaces of frames, textures and the light they send |
//!
//! [`trace::ldc`] is the reference of every stage. Rays are arrays in, answers arrays out. Hits by samples are those
//! of the reference but for rounding. Exact answers are those of [`trace::BruteForce`] bit for bit: the GPU has f32
//! only, so it says of each ray either what is certain in spite of rounding or that it cannot tell, and what it cannot
//! tell is asked of a structure on the CPU.
//!
//! ```
//! use rayward_gpu::trace::{Bvh, Ray, Triangles};
//! use rayward_gpu::{Cube, CubeOptions, Error, Gpu};
//!
//! let (x, y, z) = ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]);
//! let triangles = Triangles::new(&x, &y, &z, &[[0, 1, 2]]);
//! let ray = Ray::new([0.2, 0.2, 1.0].into(), [0.0, 0.0, -1.0].into());
//! match Gpu::open(None) {
//!     Ok(gpu) => {
//!         let cube = Cube::build(&gpu, triangles, &CubeOptions::default())?;
//!         let (hits, _) = cube.closest(&[ray], &Bvh::build(triangles))?;
//!         assert_eq!(hits[0].map(|hit| (hit.prim, hit.t)), Some((0, 1.0)));
//!     }
//!     Err(problem) => assert!(matches!(problem, Error::NoAdapter { .. })),
//! }
//! # Ok::<(), Error>(())
//! ```

mod batch;
mod bvh;
mod commands;
mod device;
mod error;
mod grid;
mod ldc;
mod secondary;
mod shade;
mod skin;
#[cfg(test)]
mod tests;

pub use rayward_trace as trace;

pub use bvh::GpuBvh;
pub use device::{AdapterSummary, Gpu, adapters};
pub use error::{Error, Result};
pub use grid::{GpuGrid, GridGeometry};
pub use ldc::{Cube, CubeOptions, StillCube, TraceStats};
pub use secondary::{GpuSecondary, Through};
pub use shade::{GpuShading, ShadeStats};
pub use skin::{GpuSkin, PosedVertices};
