//! Materials, textures and samplers (glTF 2.0 §3.8, §3.9) with the `KHR_materials_*` extensions.
//!
//! `KHR_materials_pbrSpecularGlossiness` maps exactly onto a dielectric with coloured reflection: F0 of the
//! metallic-roughness model is 0.04 times the specular colour, so that colour is the specular factor / 0.04
//! (above 1 for metals), roughness is 1 - glossiness, and the glossiness in a texture's alpha becomes a
//! roughness image of its own.

mod layers;

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use gltf::json::extensions::texture::TextureTransform as FileTransform;
use gltf::json::material::AlphaMode as FileAlphaMode;
use gltf::json::texture::{Info, MagFilter, MinFilter, WrappingMode};

use super::image::{Derivation, Wanted};
use super::source::Source;
use super::{Notices, place};
use crate::{AlphaMode, Error, LoadOptions, Material, Sampler, TextureRef, TextureTransform, Wrap};

/// Reflectance at normal incidence for an index of refraction of 1.5.
const DIELECTRIC_F0: f32 = 0.04;

/// The materials with what they refer to.
pub(super) struct Materials {
    pub(super) materials: Vec<Material>,
    pub(super) samplers: Vec<Sampler>,
    /// Images to decode, in the order of [`TextureRef::image`].
    pub(super) images: Vec<Wanted>,
}

/// Reads all materials; index 0 is the format's default one.
pub(super) fn read(
    source: &Source<'_>,
    options: &LoadOptions,
    notices: &mut Notices,
) -> Result<Materials, Error> {
    let samplers = read_samplers(source)?;
    let mut textures = Textures {
        source,
        notices,
        images: Vec::new(),
        index: HashMap::new(),
    };
    let mut materials = vec![Material {
        metallic: 1.0,
        ..Material::default()
    }];
    for (i, material) in source.root.materials.iter().enumerate() {
        let place = place("material", i, material.name.as_ref());
        let mut out = core_material(material, &mut textures, &place)?;
        if let Some(extensions) = &material.extensions {
            extend(&mut out, extensions, &mut textures, options.scale as f32, &place)?;
        }
        if !out.base_color.is_finite() || !out.emissive.is_finite() {
            return Err(source.malformed(place, "its colour or emission is not finite"));
        }
        materials.push(out);
    }
    Ok(Materials {
        materials,
        samplers,
        images: textures.images,
    })
}

/// The properties of the core format.
fn core_material(
    material: &json::Material,
    textures: &mut Textures<'_>,
    place: &str,
) -> Result<Material, Error> {
    let pbr = &material.pbr_metallic_roughness;
    let cutoff = material.alpha_cutoff.unwrap_or_default().0;
    let mut out = Material {
        name: material.name.clone().unwrap_or_default(),
        base_color: Vec4::from_array(pbr.base_color_factor.0),
        base_color_texture: textures.info(pbr.base_color_texture.as_ref(), place, "baseColorTexture")?,
        metallic: pbr.metallic_factor.0.clamp(0.0, 1.0),
        roughness: pbr.roughness_factor.0.clamp(0.0, 1.0),
        metallic_roughness_texture: textures.info(
            pbr.metallic_roughness_texture.as_ref(),
            place,
            "metallicRoughnessTexture",
        )?,
        emissive: Vec3::from_array(material.emissive_factor.0),
        emissive_texture: textures.info(material.emissive_texture.as_ref(), place, "emissiveTexture")?,
        alpha_mode: match textures.source.valid(&material.alpha_mode, "alphaMode", place)? {
            FileAlphaMode::Opaque => AlphaMode::Opaque,
            FileAlphaMode::Mask => AlphaMode::Mask { cutoff },
            FileAlphaMode::Blend => AlphaMode::Blend,
        },
        double_sided: material.double_sided,
        ..Material::default()
    };
    if let Some(normal) = &material.normal_texture {
        (out.normal_texture, out.normal_scale) = textures.normal(normal, place, "normalTexture")?;
    }
    if let Some(occlusion) = &material.occlusion_texture {
        let others = occlusion.extensions.as_ref().map(|e| &e.others);
        out.occlusion_texture = textures.bare(
            occlusion.index,
            occlusion.tex_coord,
            others,
            place,
            "occlusionTexture",
        )?;
        out.occlusion_strength = occlusion.strength.0.clamp(0.0, 1.0);
    }
    Ok(out)
}

/// Adds what the extensions say. Lengths are multiplied with `scale`.
fn extend(
    out: &mut Material,
    extensions: &json::extensions::material::Material,
    textures: &mut Textures<'_>,
    scale: f32,
    place: &str,
) -> Result<(), Error> {
    if let Some(strength) = &extensions.emissive_strength {
        out.emissive *= strength.emissive_strength.0;
    }
    if let Some(transmission) = &extensions.transmission {
        out.transmission = transmission.transmission_factor.0.clamp(0.0, 1.0);
        let texture = transmission.transmission_texture.as_ref();
        out.transmission_texture = textures.info(texture, place, "transmissionTexture")?;
    }
    if let Some(volume) = &extensions.volume {
        out.thickness = volume.thickness_factor.0.max(0.0) * scale;
        out.thickness_texture =
            textures.info(volume.thickness_texture.as_ref(), place, "thicknessTexture")?;
        let distance = volume.attenuation_distance.0;
        out.attenuation_distance = if distance > 0.0 {
            distance * scale
        } else {
            f32::INFINITY
        };
        out.attenuation_color = Vec3::from_array(volume.attenuation_color.0);
    }
    if let Some(specular) = &extensions.specular {
        out.specular = specular.specular_factor.0.clamp(0.0, 1.0);
        out.specular_texture = textures.info(specular.specular_texture.as_ref(), place, "specularTexture")?;
        out.specular_color = Vec3::from_array(specular.specular_color_factor.0).max(Vec3::ZERO);
        let texture = specular.specular_color_texture.as_ref();
        out.specular_color_texture = textures.info(texture, place, "specularColorTexture")?;
    }
    if let Some(ior) = &extensions.ior {
        match ior.ior.0 {
            // Defined as "reflects everything", for converted specular-glossiness materials.
            0.0 => out.specular_color /= DIELECTRIC_F0,
            ior => out.ior = ior.max(1.0),
        }
    }
    if let Some(glossy) = &extensions.pbr_specular_glossiness {
        specular_glossiness(out, glossy, textures, place)?;
    }
    layers::extend(out, &extensions.others, textures, place)?;
    out.unlit = extensions.unlit.is_some();
    Ok(())
}

fn specular_glossiness(
    out: &mut Material,
    glossy: &json::extensions::material::PbrSpecularGlossiness,
    textures: &mut Textures<'_>,
    place: &str,
) -> Result<(), Error> {
    let glossiness = glossy.glossiness_factor.0.clamp(0.0, 1.0);
    out.base_color = Vec4::from_array(glossy.diffuse_factor.0);
    out.base_color_texture = textures.info(glossy.diffuse_texture.as_ref(), place, "diffuseTexture")?;
    out.metallic = 0.0;
    out.roughness = 1.0 - glossiness;
    out.metallic_roughness_texture = None;
    out.specular = 1.0;
    out.specular_color = Vec3::from_array(glossy.specular_factor.0) / DIELECTRIC_F0;
    let name = "specularGlossinessTexture";
    let texture = glossy.specular_glossiness_texture.as_ref();
    out.specular_color_texture = textures.info(texture, place, name)?;
    if let Some(info) = texture {
        let derivation = Derivation::roughness(glossiness);
        out.metallic_roughness_texture = textures.texture(Use::of(info), derivation, place, name)?;
        if out.metallic_roughness_texture.is_some() {
            out.roughness = 1.0;
        }
    }
    textures.notices.say(
        place,
        "KHR_materials_pbrSpecularGlossiness is converted to metallic-roughness",
    );
    Ok(())
}

/// One use of a texture.
struct Use<'a> {
    index: json::Index<json::Texture>,
    uv_set: u32,
    transform: Option<&'a FileTransform>,
}

impl<'a> Use<'a> {
    fn of(info: &'a Info) -> Self {
        let extensions = info.extensions.as_ref();
        Self {
            index: info.index,
            uv_set: info.tex_coord,
            transform: extensions.and_then(|e| e.texture_transform.as_ref()),
        }
    }
}

/// Resolves textures and collects the images that are needed.
struct Textures<'a> {
    source: &'a Source<'a>,
    notices: &'a mut Notices,
    images: Vec<Wanted>,
    index: HashMap<Wanted, usize>,
}

impl Textures<'_> {
    fn info(&mut self, info: Option<&Info>, place: &str, name: &str) -> Result<Option<TextureRef>, Error> {
        let Some(info) = info else { return Ok(None) };
        self.texture(Use::of(info), Derivation::None, place, name)
    }

    /// A normal map and its scale.
    fn normal(
        &mut self,
        normal: &json::material::NormalTexture,
        place: &str,
        name: &str,
    ) -> Result<(Option<TextureRef>, f32), Error> {
        let others = normal.extensions.as_ref().map(|e| &e.others);
        let texture = self.bare(normal.index, normal.tex_coord, others, place, name)?;
        Ok((texture, normal.scale))
    }

    /// A texture whose extensions the model of the `gltf` crate has only as JSON.
    fn bare(
        &mut self,
        index: json::Index<json::Texture>,
        uv_set: u32,
        extensions: Option<&serde_json::Map<String, json::Value>>,
        place: &str,
        name: &str,
    ) -> Result<Option<TextureRef>, Error> {
        let transform = self.transform(extensions, place)?;
        let texture = Use {
            index,
            uv_set,
            transform: transform.as_ref(),
        };
        self.texture(texture, Derivation::None, place, name)
    }

    /// `KHR_texture_transform` where the model of the `gltf` crate has only JSON for it.
    fn transform(
        &self,
        others: Option<&serde_json::Map<String, json::Value>>,
        place: &str,
    ) -> Result<Option<FileTransform>, Error> {
        let Some(value) = others.and_then(|others| others.get("KHR_texture_transform")) else {
            return Ok(None);
        };
        let problem = |e: serde_json::Error| {
            self.source
                .malformed(place, format!("KHR_texture_transform: {e}"))
        };
        serde_json::from_value(value.clone()).map(Some).map_err(problem)
    }

    fn texture(
        &mut self,
        texture: Use<'_>,
        derivation: Derivation,
        place: &str,
        name: &str,
    ) -> Result<Option<TextureRef>, Error> {
        let source = self.source;
        let place = format!("{place}, {name}");
        let i = source.index(texture.index, source.root.textures.len(), "texture", &place)?;
        let file_texture = &source.root.textures[i];
        if file_texture.source.value() == u32::MAX as usize {
            self.notices
                .say(place, "a texture without a PNG or JPEG image is left out");
            return Ok(None);
        }
        let place = format!("{place}, texture {i}");
        let image = source.index(file_texture.source, source.root.images.len(), "image", &place)?;
        let sampler = match file_texture.sampler {
            None => 0,
            Some(sampler) => 1 + source.index(sampler, source.root.samplers.len(), "sampler", &place)?,
        };
        let uv_set = texture
            .transform
            .and_then(|transform| transform.tex_coord)
            .unwrap_or(texture.uv_set);
        if uv_set > 1 {
            self.notices.say(
                place,
                "a texture of the third or a later coordinate set is left out",
            );
            return Ok(None);
        }
        let wanted = Wanted { image, derivation };
        let next = self.images.len();
        let index = *self.index.entry(wanted).or_insert(next);
        if index == next {
            self.images.push(wanted);
        }
        let transform = texture
            .transform
            .map_or_else(TextureTransform::default, |t| TextureTransform {
                offset: Vec2::from_array(t.offset.0),
                rotation: t.rotation.0,
                scale: Vec2::from_array(t.scale.0),
            });
        Ok(Some(TextureRef {
            image: index,
            sampler,
            uv_set: uv_set as u8,
            transform,
        }))
    }
}

/// The samplers of the file behind the default one.
fn read_samplers(source: &Source<'_>) -> Result<Vec<Sampler>, Error> {
    let wrap = |mode: WrappingMode| match mode {
        WrappingMode::ClampToEdge => Wrap::ClampToEdge,
        WrappingMode::MirroredRepeat => Wrap::MirroredRepeat,
        WrappingMode::Repeat => Wrap::Repeat,
    };
    let mut samplers = vec![Sampler::default()];
    for (i, sampler) in source.root.samplers.iter().enumerate() {
        let place = place("sampler", i, sampler.name.as_ref());
        let mag = sampler
            .mag_filter
            .as_ref()
            .map(|filter| source.valid(filter, "magFilter", &place))
            .transpose()?;
        let min = sampler
            .min_filter
            .as_ref()
            .map(|filter| source.valid(filter, "minFilter", &place))
            .transpose()?;
        samplers.push(Sampler {
            wrap_u: wrap(source.valid(&sampler.wrap_s, "wrapS", &place)?),
            wrap_v: wrap(source.valid(&sampler.wrap_t, "wrapT", &place)?),
            mag_nearest: mag == Some(MagFilter::Nearest),
            min_nearest: matches!(
                min,
                Some(MinFilter::Nearest | MinFilter::NearestMipmapNearest | MinFilter::NearestMipmapLinear)
            ),
            mipmaps: min.is_some_and(|filter| !matches!(filter, MinFilter::Nearest | MinFilter::Linear)),
        });
    }
    Ok(samplers)
}
