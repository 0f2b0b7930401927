//! Coat, thin film, sheen and anisotropy: the extensions of which the `gltf` crate has no model, read from their JSON
//! (`KHR_materials_clearcoat`, `_iridescence`, `_sheen`, `_anisotropy`).
//!
//! Factors and roughnesses are cut to their ranges; what is no number or no texture is an error that names the material
//! and the extension.

use gltf::json;
use gltf::json::texture::Info;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::Textures;
use crate::{Anisotropy, Coat, Error, Iridescence, Material, Sheen};

type Extensions = serde_json::Map<String, json::Value>;

/// Adds what these extensions say.
pub(super) fn extend(
    out: &mut Material,
    extensions: &Extensions,
    textures: &mut Textures<'_>,
    place: &str,
) -> Result<(), Error> {
    if let Some(file) = read(extensions, "KHR_materials_clearcoat", textures, place)? {
        out.coat = coat(&file, textures, place)?;
    }
    if let Some(file) = read(extensions, "KHR_materials_iridescence", textures, place)? {
        out.iridescence = iridescence(&file, textures, place)?;
    }
    if let Some(file) = read(extensions, "KHR_materials_sheen", textures, place)? {
        out.sheen = sheen(&file, textures, place)?;
    }
    if let Some(file) = read(extensions, "KHR_materials_anisotropy", textures, place)? {
        out.anisotropy = anisotropy(&file, textures, place)?;
    }
    Ok(())
}

/// One extension, if the material has it.
fn read<T: DeserializeOwned>(
    extensions: &Extensions,
    name: &str,
    textures: &Textures<'_>,
    place: &str,
) -> Result<Option<T>, Error> {
    let Some(value) = extensions.get(name) else {
        return Ok(None);
    };
    let problem = |e| textures.source.malformed(place, format!("{name}: {e}"));
    serde_json::from_value(value.clone()).map(Some).map_err(problem)
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct FileCoat {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<json::material::NormalTexture>,
}

fn coat(file: &FileCoat, textures: &mut Textures<'_>, place: &str) -> Result<Coat, Error> {
    let mut out = Coat {
        factor: file.clearcoat_factor.clamp(0.0, 1.0),
        texture: textures.info(file.clearcoat_texture.as_ref(), place, "clearcoatTexture")?,
        roughness: file.clearcoat_roughness_factor.clamp(0.0, 1.0),
        roughness_texture: textures.info(
            file.clearcoat_roughness_texture.as_ref(),
            place,
            "clearcoatRoughnessTexture",
        )?,
        ..Coat::default()
    };
    if let Some(normal) = &file.clearcoat_normal_texture {
        (out.normal_texture, out.normal_scale) = textures.normal(normal, place, "clearcoatNormalTexture")?;
    }
    Ok(out)
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct FileIridescence {
    iridescence_factor: f32,
    iridescence_texture: Option<Info>,
    iridescence_ior: Option<f32>,
    iridescence_thickness_minimum: Option<f32>,
    iridescence_thickness_maximum: Option<f32>,
    iridescence_thickness_texture: Option<Info>,
}

fn iridescence(
    file: &FileIridescence,
    textures: &mut Textures<'_>,
    place: &str,
) -> Result<Iridescence, Error> {
    let usual = Iridescence::default();
    let thickness = file.iridescence_thickness_texture.as_ref();
    let length = |length: Option<f32>, usual: f32| length.unwrap_or(usual).max(0.0);
    Ok(Iridescence {
        factor: file.iridescence_factor.clamp(0.0, 1.0),
        texture: textures.info(file.iridescence_texture.as_ref(), place, "iridescenceTexture")?,
        ior: file.iridescence_ior.unwrap_or(usual.ior).max(1.0),
        thickness_min: length(file.iridescence_thickness_minimum, usual.thickness_min),
        thickness_max: length(file.iridescence_thickness_maximum, usual.thickness_max),
        thickness_texture: textures.info(thickness, place, "iridescenceThicknessTexture")?,
    })
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct FileSheen {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

fn sheen(file: &FileSheen, textures: &mut Textures<'_>, place: &str) -> Result<Sheen, Error> {
    let roughness = file.sheen_roughness_texture.as_ref();
    Ok(Sheen {
        color: file.sheen_color_factor.map(|c| c.clamp(0.0, 1.0)).into(),
        color_texture: textures.info(file.sheen_color_texture.as_ref(), place, "sheenColorTexture")?,
        roughness: file.sheen_roughness_factor.clamp(0.0, 1.0),
        roughness_texture: textures.info(roughness, place, "sheenRoughnessTexture")?,
    })
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
struct FileAnisotropy {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

fn anisotropy(file: &FileAnisotropy, textures: &mut Textures<'_>, place: &str) -> Result<Anisotropy, Error> {
    Ok(Anisotropy {
        strength: file.anisotropy_strength.clamp(0.0, 1.0),
        rotation: file.anisotropy_rotation,
        texture: textures.info(file.anisotropy_texture.as_ref(), place, "anisotropyTexture")?,
    })
}
