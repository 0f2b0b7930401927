//! From what `rayward` shades with to rows of the shaders' arrays, and back.
//!
//! Numbers of lights, kinds and flags are those of the constants in `surface.wgsl`, `texture.wgsl`, `attributes.wgsl` and
//! `lit.wgsl`.

use bytemuck::Zeroable;
use glam::{Vec3, Vec4};
use rayon::prelude::*;
use rayward::scene::{AlphaMode, FrameGeometry, Sampler, Wrap};
use rayward::shade::{Coat, Distribution, ShaderMaterial, SurfaceFinish, Traced};
use rayward::texture::{Encoding, Texture};
use rayward::trace::Light;
use rayward::{Beam, ShadingLight, Source, Surface, SurfacePoint, triangles};

use super::layout::{BeamRow, Lamp, Material, Point, Row, Triangle, Use};

/// Stands for what there is none of.
pub(super) const NOTHING: u32 = u32::MAX;

const UNLIT: u32 = 1;
const THIN: u32 = 2;
const FRONT: u32 = 4;

/// A material; `textures` are the numbers of its uses of images.
pub(super) fn material(material: &ShaderMaterial, textures: [u32; 11]) -> Material {
    let (alpha_mode, cutoff) = match material.alpha_mode {
        AlphaMode::Opaque => (0, 0.0),
        AlphaMode::Mask { cutoff } => (1, cutoff),
        AlphaMode::Blend => (2, 0.0),
    };
    let mut numbers = [NOTHING; 12];
    numbers[..11].copy_from_slice(&textures);
    Material {
        base_color: material.base_color.to_array(),
        emissive: material.emissive.to_array(),
        metallic: material.metallic,
        specular_color: material.specular_color.to_array(),
        roughness: material.roughness,
        absorption: material.absorption.to_array(),
        ior_reflectance: material.ior_reflectance,
        specular: material.specular,
        transmission: material.transmission,
        ior: material.ior,
        normal_scale: material.normal_scale,
        occlusion_strength: material.occlusion_strength,
        alpha_mode,
        cutoff,
        flags: if material.unlit { UNLIT } else { 0 } | if material.thin { THIN } else { 0 },
        coat_factor: material.coat.factor,
        coat_roughness: material.coat.roughness,
        coat_normal_scale: material.coat.normal_scale,
        pad: 0,
        textures: numbers,
    }
}

/// A use of an image whose levels begin at this number.
pub(super) fn image_use(texture: &Texture, encoding: Encoding, [first_level, levels]: [u32; 2]) -> Use {
    let Sampler {
        wrap_u,
        wrap_v,
        mag_nearest,
        min_nearest,
        mipmaps,
    } = texture.sampler;
    let wrap = |wrap: Wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::MirroredRepeat => 1,
        Wrap::ClampToEdge => 2,
    };
    let bits = [
        (mag_nearest, 16),
        (min_nearest, 32),
        (mipmaps, 64),
        (texture.uv_set > 0, 128),
        (encoding == Encoding::Srgb, 256),
    ];
    let flags: u32 = bits.iter().map(|&(set, bit)| if set { bit } else { 0 }).sum();
    let [a, b] = texture.columns.map(|column| column.to_array());
    Use {
        columns: [a[0], a[1], b[0], b[1]],
        offset: texture.offset.to_array(),
        density: texture.density,
        flags: flags | wrap(wrap_u) | wrap(wrap_v) << 2,
        first_level,
        levels,
        pad_a: 0,
        pad_b: 0,
    }
}

/// All triangles of a frame, their planes in f64 as on the CPU.
pub(super) fn triangle_rows(geometry: &FrameGeometry) -> Vec<Triangle> {
    let all = triangles(geometry);
    let of_object = |object: &rayward::scene::ObjectRange| {
        let material = object.material;
        object.triangles.clone().into_par_iter().map(move |prim| {
            let [a, b, c] = all.corners(prim);
            let plane = (b - a).as_dvec3().cross((c - a).as_dvec3());
            let [corner_a, corner_b, corner_c] = geometry.indices[prim as usize];
            Triangle {
                normal: plane.normalize_or_zero().as_vec3().to_array(),
                doubled_area: plane.length() as f32,
                corner_a,
                corner_b,
                corner_c,
                material,
            }
        })
    };
    geometry.objects.par_iter().flat_map(of_object).collect()
}

/// Attributes of all vertices, one after the other, and where each begins: normals, tangents, colours, both sets of texture
/// coordinates; positions come first.
pub(super) fn vertices(geometry: &FrameGeometry) -> (Vec<f32>, [u32; 5]) {
    let attributes = &geometry.attributes;
    let corners = geometry.x.iter().zip(&geometry.y).zip(&geometry.z);
    let mut all: Vec<f32> = corners.flat_map(|((&x, &y), &z)| [x, y, z]).collect();
    let mut starts = [NOTHING; 5];
    let mut append = |start: &mut u32, values: &[f32]| {
        if !values.is_empty() {
            *start = all.len() as u32;
            all.extend_from_slice(values);
        }
    };
    let flat3 = |values: &[Vec3]| values.iter().flat_map(Vec3::to_array).collect::<Vec<_>>();
    let flat4 = |values: &[Vec4]| values.iter().flat_map(Vec4::to_array).collect::<Vec<_>>();
    append(&mut starts[0], &flat3(&attributes.normals));
    append(&mut starts[1], &flat4(&attributes.tangents));
    append(&mut starts[2], &flat4(&attributes.colors));
    for (start, uvs) in starts[3..].iter_mut().zip([&attributes.uvs, &attributes.uvs1]) {
        append(
            start,
            &uvs.iter().flat_map(|uv| uv.to_array()).collect::<Vec<_>>(),
        );
    }
    (all, starts)
}

pub(super) fn point(point: &SurfacePoint) -> Point {
    Point {
        view: point.view.to_array(),
        footprint: point.footprint,
        prim: point.prim,
        u: point.u,
        v: point.v,
        pad: 0,
    }
}

pub(super) fn surface_row(surface: &Surface) -> Row {
    let flag = |set: bool, bit: u32| if set { bit } else { 0 };
    Row {
        position: surface.position.to_array(),
        flags: flag(surface.unlit, UNLIT) | flag(surface.thin, THIN) | flag(surface.front, FRONT),
        geometric_normal: surface.geometric_normal.to_array(),
        alpha: surface.alpha,
        normal: surface.normal.to_array(),
        metallic: surface.metallic,
        view: surface.view.to_array(),
        roughness: surface.roughness,
        base_color: surface.base_color.to_array(),
        specular: surface.specular,
        f0: surface.f0.to_array(),
        transmission: surface.transmission,
        emissive: surface.emissive.to_array(),
        ior: surface.ior,
        absorption: surface.absorption.to_array(),
        occlusion: surface.occlusion,
        coat_normal: surface.coat.normal.to_array(),
        coat_reflectance: surface.coat.reflectance,
        coat_passed: surface.coat.passed,
        coat_roughness: surface.coat.roughness,
        pad_a: 0,
        pad_b: 0,
    }
}

pub(super) fn surface(row: &Row) -> Surface {
    Surface {
        position: row.position.into(),
        geometric_normal: row.geometric_normal.into(),
        normal: row.normal.into(),
        view: row.view.into(),
        base_color: row.base_color.into(),
        alpha: row.alpha,
        metallic: row.metallic,
        roughness: row.roughness,
        f0: row.f0.into(),
        specular: row.specular,
        transmission: row.transmission,
        ior: row.ior,
        thin: row.flags & THIN != 0,
        absorption: row.absorption.into(),
        emissive: row.emissive.into(),
        occlusion: row.occlusion,
        unlit: row.flags & UNLIT != 0,
        front: row.flags & FRONT != 0,
        finish: SurfaceFinish::NONE,
        coat: Coat {
            reflectance: row.coat_reflectance,
            passed: row.coat_passed,
            roughness: row.coat_roughness,
            normal: row.coat_normal.into(),
        },
    }
}

pub(super) fn lamp(light: &ShadingLight) -> Lamp {
    let (kind, scale, offset) = match light.distribution {
        Distribution::Directional => (0, 0.0, 0.0),
        Distribution::Point => (1, 0.0, 0.0),
        Distribution::Spot { scale, offset } => (2, scale, offset),
        Distribution::Cosine => (3, 0.0, 0.0),
    };
    Lamp {
        position: light.position.to_array(),
        kind,
        direction: light.direction.to_array(),
        inverse_range2: light.inverse_range2,
        power: light.power.to_array(),
        radius: light.radius,
        scale,
        offset,
        pad_a: 0,
        pad_b: 0,
    }
}

pub(super) fn beam(beam: &Beam) -> BeamRow {
    let row = BeamRow {
        share: beam.share.to_array(),
        ..BeamRow::zeroed()
    };
    match beam.source {
        Source::Around { radiance, traced } => BeamRow {
            kind: 0,
            which: lobes(traced),
            radiance: radiance.to_array(),
            ..row
        },
        Source::Light(which) => BeamRow {
            kind: 1,
            which,
            ..row
        },
        Source::Sample {
            light: which,
            end,
            density,
            drawn,
        } => {
            let (end, kind) = match end {
                Light::Point(position) => (position, 2),
                Light::Directional(towards) => (towards, 3),
            };
            BeamRow {
                end: end.to_array(),
                kind,
                which,
                density,
                drawn_own: drawn[0],
                drawn_coat: drawn[1],
                ..row
            }
        }
        Source::Direction {
            towards,
            radiance,
            density,
            drawn,
        } => BeamRow {
            end: towards.to_array(),
            kind: 4,
            radiance: radiance.to_array(),
            density,
            drawn_own: drawn[0],
            drawn_coat: drawn[1],
            drawn_diffuse: drawn[2],
            ..row
        },
    }
}

fn lobes(traced: Traced) -> u32 {
    let bits = [
        traced.reflection,
        traced.transmission,
        traced.diffusion,
        traced.coat,
    ];
    bits.iter()
        .zip(0..)
        .map(|(&set, bit)| u32::from(set) << bit)
        .sum()
}

/// Beams sorted by their surfaces, in the order they are given, and where those of each surface begin.
pub(super) fn by_surface(beams: &[Beam], surfaces: usize) -> (Vec<BeamRow>, Vec<u32>) {
    let mut firsts = vec![0; surfaces + 1];
    for beam in beams {
        firsts[beam.surface as usize + 1] += 1;
    }
    for i in 0..surfaces {
        firsts[i + 1] += firsts[i];
    }
    let mut next = firsts.clone();
    let mut rows = vec![BeamRow::zeroed(); beams.len()];
    for each in beams {
        let place = &mut next[each.surface as usize];
        rows[*place as usize] = beam(each);
        *place += 1;
    }
    (rows, firsts)
}
