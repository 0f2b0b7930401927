//! Materials, images and samplers: the metallic-roughness model of glTF 2.0 with its common extensions.

use glam::{Vec2, Vec3, Vec4};

/// A surface's appearance. All colours are linear.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name from the file, possibly empty.
    pub name: String,
    /// Base colour and alpha.
    pub base_color: Vec4,
    /// Texture multiplied with the base colour (sRGB).
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0 mirror to 1 rough.
    pub roughness: f32,
    /// Roughness in green, metallic in blue (linear).
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map (linear).
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Ambient occlusion in red (linear).
    pub occlusion_texture: Option<TextureRef>,
    /// How strongly occlusion applies.
    pub occlusion_strength: f32,
    /// Emitted radiance, `KHR_materials_emissive_strength` included.
    pub emissive: Vec3,
    /// Texture multiplied with the emission (sRGB).
    pub emissive_texture: Option<TextureRef>,
    /// Treatment of alpha.
    pub alpha_mode: AlphaMode,
    /// Whether back faces are shown.
    pub double_sided: bool,
    /// Shown without lighting.
    pub unlit: bool,
    /// Share of light transmitted instead of diffused.
    pub transmission: f32,
    /// Transmission in red (linear).
    pub transmission_texture: Option<TextureRef>,
    /// Index of refraction.
    pub ior: f32,
    /// Thickness of the volume, 0 for thin walls, metres.
    pub thickness: f32,
    /// Thickness in green (linear).
    pub thickness_texture: Option<TextureRef>,
    /// Distance at which white light takes on `attenuation_color`, metres.
    pub attenuation_distance: f32,
    /// Colour after `attenuation_distance`.
    pub attenuation_color: Vec3,
    /// Strength of dielectric reflection.
    pub specular: f32,
    /// Specular strength in alpha (linear).
    pub specular_texture: Option<TextureRef>,
    /// Colour of dielectric reflection at normal incidence: a factor on the reflectance that `ior` gives (0.04 for
    /// 1.5). It may be above 1; the product is to be cut at 1.
    pub specular_color: Vec3,
    /// Specular colour (sRGB).
    pub specular_color_texture: Option<TextureRef>,
    /// A thin film that colours reflections.
    pub iridescence: Iridescence,
    /// Fibres that scatter light at grazing angles.
    pub sheen: Sheen,
    /// A direction in which the surface is rougher.
    pub anisotropy: Anisotropy,
    /// What lies over all of that.
    pub coat: Coat,
}

/// A film as thin as light's wavelengths (`KHR_materials_iridescence`), without one by default.
#[derive(Clone, Debug)]
pub struct Iridescence {
    /// How much of the reflection is the film's, 0 to 1.
    pub factor: f32,
    /// Factor in red (linear).
    pub texture: Option<TextureRef>,
    /// Index of refraction of the film.
    pub ior: f32,
    /// Thickness where the texture is 0, nanometres.
    pub thickness_min: f32,
    /// Thickness where the texture is 1, and without a texture, nanometres.
    pub thickness_max: f32,
    /// Thickness in green (linear).
    pub thickness_texture: Option<TextureRef>,
}

impl Default for Iridescence {
    fn default() -> Self {
        Self {
            factor: 0.0,
            texture: None,
            ior: 1.3,
            thickness_min: 100.0,
            thickness_max: 400.0,
            thickness_texture: None,
        }
    }
}

/// The fibres of cloth (`KHR_materials_sheen`), without any by default.
#[derive(Clone, Debug, Default)]
pub struct Sheen {
    /// Linear colour; black is no sheen.
    pub color: Vec3,
    /// Texture multiplied with the colour (sRGB).
    pub color_texture: Option<TextureRef>,
    /// How far fibres lean away from the normal, 0 to 1.
    pub roughness: f32,
    /// Roughness in alpha (linear).
    pub roughness_texture: Option<TextureRef>,
}

/// Roughness that depends on the direction (`KHR_materials_anisotropy`), as of brushed metal; none by default.
#[derive(Clone, Debug, Default)]
pub struct Anisotropy {
    /// How much rougher the surface is along the direction, 0 to 1.
    pub strength: f32,
    /// Angle from the tangent to the direction, counter-clockwise, radians.
    pub rotation: f32,
    /// Direction in red and green, to be turned by the rotation, strength in blue (linear).
    pub texture: Option<TextureRef>,
}

/// A clear layer over a surface (`KHR_materials_clearcoat`), without one by default.
#[derive(Clone, Debug)]
pub struct Coat {
    /// How much of the surface it covers, 0 to 1.
    pub factor: f32,
    /// Factor in red (linear).
    pub texture: Option<TextureRef>,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Roughness in green (linear).
    pub roughness_texture: Option<TextureRef>,
    /// Tangent-space normal map (linear); the coat does not follow that of the surface below.
    pub normal_texture: Option<TextureRef>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
}

impl Default for Coat {
    fn default() -> Self {
        Self {
            factor: 0.0,
            texture: None,
            roughness: 0.0,
            roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
        }
    }
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            occlusion_texture: None,
            occlusion_strength: 1.0,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            transmission: 0.0,
            transmission_texture: None,
            ior: 1.5,
            thickness: 0.0,
            thickness_texture: None,
            attenuation_distance: f32::INFINITY,
            attenuation_color: Vec3::ONE,
            specular: 1.0,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            iridescence: Iridescence::default(),
            sheen: Sheen::default(),
            anisotropy: Anisotropy::default(),
            coat: Coat::default(),
        }
    }
}

/// Treatment of alpha.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Solid where alpha reaches the cutoff, absent elsewhere.
    Mask {
        /// The cutoff.
        cutoff: f32,
    },
    /// Layered over what lies behind.
    Blend,
}

/// Use of an image by a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::images`].
    pub image: usize,
    /// Index into [`crate::Scene::samplers`].
    pub sampler: usize,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u8,
    /// `KHR_texture_transform`.
    pub transform: TextureTransform,
}

/// Affine map of texture coordinates: offset + rotation * (scale * uv).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureTransform {
    /// Offset.
    pub offset: Vec2,
    /// Counter-clockwise rotation in radians, as `KHR_texture_transform` defines it.
    pub rotation: f32,
    /// Scale.
    pub scale: Vec2,
}

impl Default for TextureTransform {
    fn default() -> Self {
        Self {
            offset: Vec2::ZERO,
            rotation: 0.0,
            scale: Vec2::ONE,
        }
    }
}

/// A decoded image: 8-bit RGBA, row 0 on top, not premultiplied, values as stored (sRGB or linear by use).
#[derive(Clone, PartialEq)]
pub struct Image {
    /// Name or file it came from, for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<[u8; 4]>,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({:?}, {}x{})", self.name, self.width, self.height)
    }
}

/// Filtering and wrapping of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sampler {
    /// Wrapping in u.
    pub wrap_u: Wrap,
    /// Wrapping in v.
    pub wrap_v: Wrap,
    /// Nearest texel when magnified instead of linear.
    pub mag_nearest: bool,
    /// Nearest texel when minified instead of linear.
    pub min_nearest: bool,
    /// Whether the file asks for mipmaps.
    pub mipmaps: bool,
}

/// What happens outside of \[0, 1\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats mirrored.
    MirroredRepeat,
    /// The edge texel goes on.
    ClampToEdge,
}
