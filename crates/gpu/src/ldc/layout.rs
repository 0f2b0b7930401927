//! What goes to and comes from the shaders, field by field as they declare it.

use bytemuck::{Pod, Zeroable};

/// The cube's layout: `Frame` of `common.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Frame {
    pub(crate) size: [u32; 3],
    pub(crate) triangles: u32,
    pub(crate) first_texel: [u32; 4],
    pub(crate) levels: u32,
    pub(crate) conservative: u32,
    pub(crate) occupancy: u32,
    pub(crate) doubt: f32,
    pub(crate) depth: u32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
    pub(crate) pad_c: u32,
    pub(crate) cells: [[u32; 4]; 9],
}

/// `Scan` of `scan.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Scan {
    pub(crate) count: u32,
    pub(crate) blocks: u32,
    pub(crate) pad: [u32; 2],
}

/// `Raise` of `levels.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Raise {
    pub(crate) axis: u32,
    pub(crate) level: u32,
    pub(crate) rows: u32,
    pub(crate) rows_below: u32,
}

/// `Ray` of `walk.wgsl`: within the cube, in texels.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TexelRay {
    pub(crate) origin: [f32; 3],
    pub(crate) end: f32,
    pub(crate) dir: [f32; 3],
    pub(crate) t_min: f32,
    pub(crate) t_max: f32,
    pub(crate) before: f32,
    pub(crate) skip: u32,
    pub(crate) pad: u32,
}

/// `Found` of `walk.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Found {
    pub(crate) t: f32,
    pub(crate) prim: u32,
    pub(crate) state: u32,
    pub(crate) cells: u32,
    pub(crate) texels: u32,
    pub(crate) samples: u32,
    pub(crate) triangles: u32,
    pub(crate) pad: u32,
}

/// `Query` of `walk.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Query {
    pub(crate) rays: u32,
    pub(crate) test: u32,
    pub(crate) tolerance: f32,
    pub(crate) any: u32,
}
