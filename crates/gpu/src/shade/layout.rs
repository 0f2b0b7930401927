//! What goes to and comes from the shaders of this folder, field by field as they declare it.

use bytemuck::{Pod, Zeroable};

/// `Shading` of `attributes.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Shading {
    pub(crate) points: u32,
    pub(crate) normals: u32,
    pub(crate) tangents: u32,
    pub(crate) colors: u32,
    pub(crate) uvs: u32,
    pub(crate) uvs1: u32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
    pub(crate) srgb: [[f32; 4]; 64],
}

/// `Point` of `attributes.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Point {
    pub(crate) view: [f32; 3],
    pub(crate) footprint: f32,
    pub(crate) prim: u32,
    pub(crate) u: f32,
    pub(crate) v: f32,
    pub(crate) pad: u32,
}

/// `Triangle` of `attributes.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Triangle {
    pub(crate) normal: [f32; 3],
    pub(crate) doubled_area: f32,
    pub(crate) corner_a: u32,
    pub(crate) corner_b: u32,
    pub(crate) corner_c: u32,
    pub(crate) material: u32,
}

/// `Material` of `attributes.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Material {
    pub(crate) base_color: [f32; 4],
    pub(crate) emissive: [f32; 3],
    pub(crate) metallic: f32,
    pub(crate) specular_color: [f32; 3],
    pub(crate) roughness: f32,
    pub(crate) absorption: [f32; 3],
    pub(crate) ior_reflectance: f32,
    pub(crate) specular: f32,
    pub(crate) transmission: f32,
    pub(crate) ior: f32,
    pub(crate) normal_scale: f32,
    pub(crate) occlusion_strength: f32,
    pub(crate) alpha_mode: u32,
    pub(crate) cutoff: f32,
    pub(crate) flags: u32,
    pub(crate) coat_factor: f32,
    pub(crate) coat_roughness: f32,
    pub(crate) coat_normal_scale: f32,
    pub(crate) pad: u32,
    pub(crate) textures: [u32; 12],
}

/// `Use` of `texture.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Use {
    pub(crate) columns: [f32; 4],
    pub(crate) offset: [f32; 2],
    pub(crate) density: f32,
    pub(crate) flags: u32,
    pub(crate) first_level: u32,
    pub(crate) levels: u32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
}

/// `Level` of `texture.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) first: u32,
    pub(crate) pad: u32,
}

/// `Surface` of `surface.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Row {
    pub(crate) position: [f32; 3],
    pub(crate) flags: u32,
    pub(crate) geometric_normal: [f32; 3],
    pub(crate) alpha: f32,
    pub(crate) normal: [f32; 3],
    pub(crate) metallic: f32,
    pub(crate) view: [f32; 3],
    pub(crate) roughness: f32,
    pub(crate) base_color: [f32; 3],
    pub(crate) specular: f32,
    pub(crate) f0: [f32; 3],
    pub(crate) transmission: f32,
    pub(crate) emissive: [f32; 3],
    pub(crate) ior: f32,
    pub(crate) absorption: [f32; 3],
    pub(crate) occlusion: f32,
    pub(crate) coat_normal: [f32; 3],
    pub(crate) coat_reflectance: f32,
    pub(crate) coat_passed: f32,
    pub(crate) coat_roughness: f32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
}

/// `Lit` of `lit.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Lit {
    pub(crate) surfaces: u32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
    pub(crate) pad_c: u32,
}

/// `Lamp` of `lit.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Lamp {
    pub(crate) position: [f32; 3],
    pub(crate) kind: u32,
    pub(crate) direction: [f32; 3],
    pub(crate) inverse_range2: f32,
    pub(crate) power: [f32; 3],
    pub(crate) radius: f32,
    pub(crate) scale: f32,
    pub(crate) offset: f32,
    pub(crate) pad_a: u32,
    pub(crate) pad_b: u32,
}

/// `Beam` of `lit.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct BeamRow {
    pub(crate) end: [f32; 3],
    pub(crate) kind: u32,
    pub(crate) share: [f32; 3],
    pub(crate) which: u32,
    pub(crate) radiance: [f32; 3],
    pub(crate) density: f32,
    pub(crate) drawn_own: u32,
    pub(crate) drawn_coat: u32,
    pub(crate) drawn_diffuse: u32,
    pub(crate) pad: u32,
}
