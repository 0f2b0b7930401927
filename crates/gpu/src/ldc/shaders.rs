//! The shaders: files joined to programs, and their entry points.

/// A program and its name in messages.
pub(crate) struct Program {
    pub(crate) name: &'static str,
    pub(crate) source: &'static str,
}

pub(crate) const RASTER: Program = Program {
    name: "raster.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("span.wgsl"),
        include_str!("routed.wgsl"),
        include_str!("raster.wgsl"),
        include_str!("peel.wgsl"),
    ),
};

pub(crate) const SCAN: Program = Program {
    name: "scan.wgsl",
    source: include_str!("scan.wgsl"),
};

pub(crate) const SORT: Program = Program {
    name: "sort.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("shell.wgsl"),
        include_str!("sort.wgsl")
    ),
};

pub(crate) const PACK: Program = Program {
    name: "pack.wgsl",
    source: concat!(include_str!("common.wgsl"), include_str!("pack.wgsl")),
};

pub(crate) const LEVELS: Program = Program {
    name: "levels.wgsl",
    source: concat!(include_str!("common.wgsl"), include_str!("levels.wgsl")),
};

pub(crate) const SAMPLED: Program = Program {
    name: "sampled.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("query.wgsl"),
        include_str!("walk.wgsl"),
        include_str!("sampled.wgsl"),
        include_str!("entry.wgsl"),
    ),
};

pub(crate) const EXACT: Program = Program {
    name: "exact.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("query.wgsl"),
        include_str!("meet.wgsl"),
        include_str!("walk.wgsl"),
        include_str!("exact.wgsl"),
        include_str!("entry.wgsl"),
    ),
};

pub(crate) const TREE: Program = Program {
    name: "bvh.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("query.wgsl"),
        include_str!("meet.wgsl"),
        include_str!("../bvh/bvh.wgsl"),
        include_str!("entry.wgsl"),
    ),
};

pub(crate) const GRID: Program = Program {
    name: "grid.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("span.wgsl"),
        include_str!("shell.wgsl"),
        include_str!("../grid/grid.wgsl"),
    ),
};

pub(crate) const LOOK: Program = Program {
    name: "look.wgsl",
    source: concat!(
        include_str!("common.wgsl"),
        include_str!("query.wgsl"),
        include_str!("meet.wgsl"),
        include_str!("../grid/look.wgsl"),
        include_str!("entry.wgsl"),
    ),
};

pub(crate) const SKIN: Program = Program {
    name: "skin.wgsl",
    source: include_str!("../skin/skin.wgsl"),
};

pub(crate) const SURFACES: Program = Program {
    name: "attributes.wgsl",
    source: concat!(
        include_str!("../shade/surface.wgsl"),
        include_str!("../shade/attributes.wgsl"),
        include_str!("../shade/texture.wgsl"),
    ),
};

pub(crate) const LIT: Program = Program {
    name: "lit.wgsl",
    source: concat!(
        include_str!("../shade/surface.wgsl"),
        include_str!("../shade/brdf.wgsl"),
        include_str!("../shade/lit.wgsl"),
    ),
};

/// All programs.
#[cfg(test)]
pub(crate) const ALL: [&Program; 13] = [
    &RASTER, &SCAN, &SORT, &PACK, &LEVELS, &SAMPLED, &EXACT, &TREE, &GRID, &LOOK, &SKIN, &SURFACES, &LIT,
];

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};

    use super::*;
    use crate::bvh::Node;
    use crate::grid::{Grid, Place, Plate};
    use crate::ldc::layout::{Found, Frame, Query, Raise, Scan, TexelRay};
    use crate::shade::layout::{BeamRow, Lamp, Level, Lit, Material, Point, Row, Shading, Triangle, Use};
    use crate::skin::{Influence, Skin};

    fn parsed(program: &Program) -> (naga::Module, ModuleInfo) {
        let module = naga::front::wgsl::parse_str(program.source)
            .unwrap_or_else(|e| panic!("{}: {}", program.name, e.emit_to_string(program.source)));
        // Plain WebGPU, to which conversions from and to 16 bits belong.
        let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let info = Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}: {}", program.name, e.emit_to_string(program.source)));
        (module, info)
    }

    #[test]
    fn shaders_are_valid_and_translate_to_every_backend() {
        for program in ALL {
            let (module, info) = parsed(program);
            let spirv =
                naga::back::spv::write_vec(&module, &info, &naga::back::spv::Options::default(), None);
            assert!(spirv.is_ok(), "{}: {:?}", program.name, spirv.err());
            let metal = naga::back::msl::Options {
                fake_missing_bindings: true,
                ..naga::back::msl::Options::default()
            };
            let msl = naga::back::msl::write_string(
                &module,
                &info,
                &metal,
                &naga::back::msl::PipelineOptions::default(),
            );
            assert!(msl.is_ok(), "{}: {:?}", program.name, msl.err());
            let options = naga::back::hlsl::Options::default();
            let pipeline = naga::back::hlsl::PipelineOptions::default();
            let mut text = String::new();
            let hlsl =
                naga::back::hlsl::Writer::new(&mut text, &options, &pipeline).write(&module, &info, None);
            assert!(hlsl.is_ok(), "{}: {:?}", program.name, hlsl.err());
        }
    }

    #[test]
    fn no_stage_has_more_storage_buffers_or_threads_than_every_device_takes() {
        for program in ALL {
            let (module, info) = parsed(program);
            for (index, entry) in module.entry_points.iter().enumerate() {
                let uses = info.get_entry_point(index);
                let buffers = module
                    .global_variables
                    .iter()
                    .filter(|(handle, variable)| {
                        matches!(variable.space, naga::AddressSpace::Storage { .. })
                            && !uses[*handle].is_empty()
                    })
                    .count();
                assert!(
                    buffers <= 8,
                    "{} {}: {buffers} storage buffers",
                    program.name,
                    entry.name
                );
                let threads: u32 = entry.workgroup_size.iter().product();
                assert!(
                    threads <= 256,
                    "{} {}: {threads} threads",
                    program.name,
                    entry.name
                );
            }
        }
    }

    /// Offsets of the members of a shader's structure, and its size.
    fn members(program: &Program, name: &str) -> (Vec<(String, usize)>, usize) {
        let (module, _) = parsed(program);
        let found = module.types.iter().find_map(|(_, ty)| match &ty.inner {
            naga::TypeInner::Struct { members, span } if ty.name.as_deref() == Some(name) => {
                let offsets = members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                    .collect();
                Some((offsets, *span as usize))
            }
            _ => None,
        });
        found.unwrap_or_else(|| panic!("{}: no structure {name}", program.name))
    }

    macro_rules! same_layout {
        ($program:expr, $name:literal, $type:ty, $($field:ident),+) => {
            let (offsets, size) = members(&$program, $name);
            let own = [$((stringify!($field).to_owned(), offset_of!($type, $field))),+];
            assert_eq!(offsets, own, "{}", $name);
            assert_eq!(size, size_of::<$type>(), "{}", $name);
        };
    }

    #[test]
    fn structures_are_laid_out_as_in_the_shaders() {
        same_layout!(
            RASTER,
            "Frame",
            Frame,
            size,
            triangles,
            first_texel,
            levels,
            conservative,
            occupancy,
            doubt,
            depth,
            pad_a,
            pad_b,
            pad_c,
            cells
        );
        same_layout!(SCAN, "Scan", Scan, count, blocks, pad);
        same_layout!(
            TREE, "Node", Node, low_x, high_x, low_y, high_y, low_z, high_z, first, count
        );
        same_layout!(LEVELS, "Raise", Raise, axis, level, rows, rows_below);
        same_layout!(GRID, "Grid", Grid, columns, rows, plates, cells);
        same_layout!(
            GRID, "Plate", Plate, ax, ay, bx, by, cx, cy, depth, prim, first, row
        );
        same_layout!(LOOK, "Place", Place, cell, depth, rate, pad);
        same_layout!(SKIN, "Influence", Influence, joints, shares);
        same_layout!(SKIN, "Skin", Skin, corner, vertices, per_side);
        for program in [SAMPLED, EXACT, TREE, LOOK] {
            same_layout!(
                program, "Ray", TexelRay, origin, end, dir, t_min, t_max, before, skip, pad
            );
            same_layout!(
                program, "Found", Found, t, prim, state, cells, texels, samples, triangles, pad
            );
            same_layout!(program, "Query", Query, rays, test, tolerance, any);
        }
    }

    #[test]
    fn what_surfaces_are_made_of_is_laid_out_as_in_the_shaders() {
        same_layout!(
            SURFACES, "Shading", Shading, points, normals, tangents, colors, uvs, uvs1, pad_a, pad_b, srgb
        );
        same_layout!(SURFACES, "Point", Point, view, footprint, prim, u, v, pad);
        same_layout!(
            SURFACES,
            "Triangle",
            Triangle,
            normal,
            doubled_area,
            corner_a,
            corner_b,
            corner_c,
            material
        );
        same_layout!(
            SURFACES,
            "Material",
            Material,
            base_color,
            emissive,
            metallic,
            specular_color,
            roughness,
            absorption,
            ior_reflectance,
            specular,
            transmission,
            ior,
            normal_scale,
            occlusion_strength,
            alpha_mode,
            cutoff,
            flags,
            coat_factor,
            coat_roughness,
            coat_normal_scale,
            pad,
            textures
        );
        same_layout!(
            SURFACES,
            "Use",
            Use,
            columns,
            offset,
            density,
            flags,
            first_level,
            levels,
            pad_a,
            pad_b
        );
        same_layout!(SURFACES, "Level", Level, width, height, first, pad);
    }

    #[test]
    fn light_is_laid_out_as_in_the_shaders() {
        same_layout!(LIT, "Lit", Lit, surfaces, pad_a, pad_b, pad_c);
        same_layout!(
            LIT,
            "Lamp",
            Lamp,
            position,
            kind,
            direction,
            inverse_range2,
            power,
            radius,
            scale,
            offset,
            pad_a,
            pad_b
        );
        same_layout!(
            LIT,
            "Beam",
            BeamRow,
            end,
            kind,
            share,
            which,
            radiance,
            density,
            drawn_own,
            drawn_coat,
            drawn_diffuse,
            pad
        );
    }

    #[test]
    fn surfaces_are_laid_out_as_in_the_shaders() {
        for program in [SURFACES, LIT] {
            same_layout!(
                program,
                "Surface",
                Row,
                position,
                flags,
                geometric_normal,
                alpha,
                normal,
                metallic,
                view,
                roughness,
                base_color,
                specular,
                f0,
                transmission,
                emissive,
                ior,
                absorption,
                occlusion,
                coat_normal,
                coat_reflectance,
                coat_passed,
                coat_roughness,
                pad_a,
                pad_b
            );
        }
    }
}
