//! Materials as shading takes them: textures resolved, constants worked out.
//!
//! Fields are those of [`rayward_scene::Material`], whose documentation says what they mean, but for what is said here.

use glam::{Vec3, Vec4};
use rayward_scene::{AlphaMode, Material, Scene, TextureRef};

use super::finish::Finish;
use super::surface::Lookup;
use crate::casters::is_thin_glass;
use crate::texture::{Encoding, Texture, Textures};

/// A material with its textures resolved.
#[derive(Clone, Debug)]
pub struct ShaderMaterial {
    /// Base colour and alpha.
    pub base_color: Vec4,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Emitted radiance.
    pub emissive: Vec3,
    /// Reflectance at normal incidence by the index of refraction alone.
    pub ior_reflectance: f32,
    /// Weight of the dielectric's reflection.
    pub specular: f32,
    /// Its colour.
    pub specular_color: Vec3,
    /// Share of light transmitted instead of diffused.
    pub transmission: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Whether there is no volume behind.
    pub thin: bool,
    /// Whether light passes it straight on.
    pub thin_glass: bool,
    /// Absorption of the volume, per metre.
    pub absorption: Vec3,
    /// Scale of the normal map's first two components.
    pub normal_scale: f32,
    /// How much of the occlusion counts.
    pub occlusion_strength: f32,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// Whether it shows its base colour without any lighting.
    pub unlit: bool,
    /// Whether it has any texture.
    pub textured: bool,
    /// Colour and alpha.
    pub base_color_texture: Option<Texture>,
    /// Roughness in green, metallic in blue.
    pub metallic_roughness_texture: Option<Texture>,
    /// Normal map.
    pub normal_texture: Option<Texture>,
    /// Occlusion in red.
    pub occlusion_texture: Option<Texture>,
    /// Emission.
    pub emissive_texture: Option<Texture>,
    /// Weight of the reflection in alpha.
    pub specular_texture: Option<Texture>,
    /// Colour of the reflection.
    pub specular_color_texture: Option<Texture>,
    /// Transmission in red.
    pub transmission_texture: Option<Texture>,
    /// Film, sheen and anisotropy, if it has any.
    pub(super) finish: Option<Box<Finish>>,
    /// What lies over it.
    pub coat: ShaderCoat,
}

/// A coat with its textures resolved.
#[derive(Clone, Debug)]
pub struct ShaderCoat {
    /// Share of the surface that it covers.
    pub factor: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Scale of its normal map.
    pub normal_scale: f32,
    /// Share in red.
    pub texture: Option<Texture>,
    /// Roughness in green.
    pub roughness_texture: Option<Texture>,
    /// Normal map.
    pub normal_texture: Option<Texture>,
}

/// The texture references of a material that shading uses, with their encodings.
pub(super) fn references(material: &Material) -> [(Option<TextureRef>, Encoding); 11] {
    [
        (material.base_color_texture, Encoding::Srgb),
        (material.metallic_roughness_texture, Encoding::Linear),
        (material.normal_texture, Encoding::Linear),
        (material.occlusion_texture, Encoding::Linear),
        (material.emissive_texture, Encoding::Srgb),
        (material.specular_texture, Encoding::Linear),
        (material.specular_color_texture, Encoding::Srgb),
        (material.transmission_texture, Encoding::Linear),
        (material.coat.texture, Encoding::Linear),
        (material.coat.roughness_texture, Encoding::Linear),
        (material.coat.normal_texture, Encoding::Linear),
    ]
}

/// Absorption per metre that leaves `attenuation_color` of white light after `attenuation_distance`
/// (`KHR_materials_volume`).
fn absorption(material: &Material) -> Vec3 {
    // A colour of exactly 0 would need infinite absorption; this leaves less than a millionth.
    let left = material.attenuation_color.clamp(Vec3::splat(1e-6), Vec3::ONE);
    if material.thickness > 0.0 && material.attenuation_distance > 0.0 {
        -Vec3::new(left.x.ln(), left.y.ln(), left.z.ln()) / material.attenuation_distance
    } else {
        Vec3::ZERO
    }
}

impl ShaderMaterial {
    pub(super) fn new(material: &Material, scene: &Scene, textures: &Textures) -> Self {
        let resolved = references(material)
            .map(|(reference, encoding)| reference.and_then(|r| textures.resolve(scene, &r, encoding)));
        let ratio = (material.ior - 1.0) / (material.ior + 1.0);
        let finish = Finish::new(material, scene, textures).map(Box::new);
        Self {
            base_color: material.base_color,
            metallic: material.metallic,
            roughness: material.roughness,
            emissive: material.emissive,
            ior_reflectance: ratio * ratio,
            specular: material.specular,
            specular_color: material.specular_color,
            transmission: material.transmission,
            ior: material.ior,
            thin: material.thickness <= 0.0,
            thin_glass: is_thin_glass(material),
            absorption: absorption(material),
            normal_scale: material.normal_scale,
            occlusion_strength: material.occlusion_strength,
            alpha_mode: material.alpha_mode,
            unlit: material.unlit,
            textured: resolved.iter().any(Option::is_some)
                || finish.as_ref().is_some_and(|finish| finish.is_textured()),
            finish,
            base_color_texture: resolved[0],
            metallic_roughness_texture: resolved[1],
            normal_texture: resolved[2],
            occlusion_texture: resolved[3],
            emissive_texture: resolved[4],
            specular_texture: resolved[5],
            specular_color_texture: resolved[6],
            transmission_texture: resolved[7],
            coat: ShaderCoat {
                factor: material.coat.factor,
                roughness: material.coat.roughness,
                normal_scale: material.coat.normal_scale,
                texture: resolved[8],
                roughness_texture: resolved[9],
                normal_texture: resolved[10],
            },
        }
    }

    pub(super) fn is_opaque(&self) -> bool {
        self.alpha_mode == AlphaMode::Opaque && !self.thin_glass
    }

    /// Share of light that goes straight through what is covered, but for its colour.
    pub(super) fn passed(&self, lookup: &Lookup) -> f32 {
        if !self.thin_glass {
            return 0.0;
        }
        let texel = |texture| lookup.get(texture).unwrap_or(Vec4::ONE);
        let metallic = (self.metallic * texel(&self.metallic_roughness_texture).z).clamp(0.0, 1.0);
        let through = self.transmission * texel(&self.transmission_texture).x;
        let bare = Vec3::splat(self.ior_reflectance * self.specular);
        let film = self
            .finish
            .as_ref()
            .map(|finish| finish.film(&|texture| lookup.get(texture)));
        let reflected = film.map_or(bare, |film| film.over(bare, bare, 1.0));
        through * (1.0 - metallic) * (1.0 - reflected.max_element()).max(0.0)
    }

    pub(super) fn coverage(&self, alpha: f32) -> f32 {
        match self.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => f32::from(u8::from(alpha >= cutoff)),
            AlphaMode::Blend => alpha.clamp(0.0, 1.0),
        }
    }

    /// Whether it has a film, sheen or anisotropy: what shades arrays is not asked for its surfaces.
    pub fn has_finish(&self) -> bool {
        self.finish.is_some()
    }

    /// All its textures but those of a film, sheen and anisotropy, in a fixed order: base colour, metallic and roughness,
    /// normal, occlusion, emission, weight and colour of the reflection, transmission, and the coat's share, roughness and
    /// normal.
    pub fn textures(&self) -> [Option<&Texture>; 11] {
        [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.emissive_texture,
            &self.specular_texture,
            &self.specular_color_texture,
            &self.transmission_texture,
            &self.coat.texture,
            &self.coat.roughness_texture,
            &self.coat.normal_texture,
        ]
        .map(Option::as_ref)
    }
}
