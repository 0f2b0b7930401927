//! What a surface has besides the metallic-roughness model: a thin film, sheen, and roughness that depends on the direction.
//!
//! ```text
//! Material --Finish::new, once--> Finish (textures resolved; None if the material has none of it)
//!                                    --at a point--> SurfaceFinish: Iridescence, Sheen, Anisotropy
//! ```
//!
//! [`Iridescence`] takes the place of Fresnel's reflectance, [`Sheen`] is a lobe of its own over all of the surface but its
//! coat, [`Anisotropy`] the shape of the distribution of microfacets.
//!
//! Limits: the film is told from the viewer's side of a volume as from outside; shadows of thin walls know its reflectance
//! head on; solids have no direction, hence no anisotropy.

pub(super) mod anisotropy;
pub(super) mod iridescence;
pub(super) mod sheen;

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};
use rayward_scene::{Material, Scene, TextureRef};

pub use anisotropy::Anisotropy;
pub use iridescence::Iridescence;
pub use sheen::Sheen;

use crate::texture::{Encoding, Texture, Textures};

/// The finish of a surface at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceFinish {
    /// The thin film.
    pub iridescence: Iridescence,
    /// The fibres.
    pub sheen: Sheen,
    /// The direction in which the surface is rougher.
    pub anisotropy: Anisotropy,
}

impl SurfaceFinish {
    /// Nothing of all that.
    pub const NONE: Self = Self {
        iridescence: Iridescence::NONE,
        sheen: Sheen::NONE,
        anisotropy: Anisotropy::NONE,
    };
}

/// The texture references of a material's finish, with their encodings.
pub(super) fn references(material: &Material) -> [(Option<TextureRef>, Encoding); 5] {
    let (film, sheen) = (&material.iridescence, &material.sheen);
    [
        (film.texture, Encoding::Linear),
        (film.thickness_texture, Encoding::Linear),
        (sheen.color_texture, Encoding::Srgb),
        (sheen.roughness_texture, Encoding::Linear),
        (material.anisotropy.texture, Encoding::Linear),
    ]
}

/// The finish of a material, its textures resolved.
#[derive(Clone, Debug)]
pub(super) struct Finish {
    film_factor: f32,
    film_ior: f32,
    thickness: [f32; 2],
    sheen_color: Vec3,
    sheen_roughness: f32,
    anisotropy_strength: f32,
    /// Direction of the rotation, as cosine and sine.
    turn: Vec2,
    film_texture: Option<Texture>,
    thickness_texture: Option<Texture>,
    sheen_color_texture: Option<Texture>,
    sheen_roughness_texture: Option<Texture>,
    /// Of the anisotropy.
    pub(super) direction_texture: Option<Texture>,
}

impl Finish {
    /// `None` for materials without any.
    pub(super) fn new(material: &Material, scene: &Scene, textures: &Textures) -> Option<Self> {
        let (film, sheen, grain) = (&material.iridescence, &material.sheen, &material.anisotropy);
        if film.factor == 0.0 && sheen.color == Vec3::ZERO && grain.strength == 0.0 {
            return None;
        }
        let [
            film_texture,
            thickness_texture,
            sheen_color_texture,
            sheen_roughness_texture,
            direction_texture,
        ] = references(material)
            .map(|(reference, encoding)| reference.and_then(|r| textures.resolve(scene, &r, encoding)));
        Some(Self {
            film_factor: film.factor,
            film_ior: film.ior,
            thickness: [film.thickness_min, film.thickness_max],
            sheen_color: sheen.color,
            sheen_roughness: sheen.roughness,
            anisotropy_strength: grain.strength,
            turn: Vec2::from_angle(grain.rotation),
            film_texture,
            thickness_texture,
            sheen_color_texture,
            sheen_roughness_texture,
            direction_texture,
        })
    }

    /// Whether the finish asks for texture coordinates, if only for their direction.
    pub(super) fn is_textured(&self) -> bool {
        let textures = [
            &self.film_texture,
            &self.thickness_texture,
            &self.sheen_color_texture,
            &self.sheen_roughness_texture,
        ];
        self.anisotropy_strength > 0.0 || textures.iter().any(|texture| texture.is_some())
    }

    /// The film at a point; `texel` looks a texture up there.
    pub(super) fn film(&self, texel: &impl Fn(&Option<Texture>) -> Option<Vec4>) -> Iridescence {
        if self.film_factor == 0.0 {
            return Iridescence::NONE;
        }
        let [least, most] = self.thickness;
        let share = texel(&self.thickness_texture).map_or(1.0, |texel| texel.y);
        Iridescence {
            strength: self.film_factor * texel(&self.film_texture).map_or(1.0, |texel| texel.x),
            ior: self.film_ior,
            thickness: least + (most - least) * share,
        }
    }

    /// The finish at a point that is seen at this cosine to the normal. `frame` gives the tangent and the bitangent there,
    /// if there are any.
    pub(super) fn at(
        &self,
        cos: f32,
        texel: impl Fn(&Option<Texture>) -> Option<Vec4>,
        frame: impl FnOnce() -> Option<[Vec3; 2]>,
    ) -> SurfaceFinish {
        let sheen = if self.sheen_color == Vec3::ZERO {
            Sheen::NONE
        } else {
            let color = texel(&self.sheen_color_texture).map_or(Vec3::ONE, |texel| texel.xyz());
            let roughness = texel(&self.sheen_roughness_texture).map_or(1.0, |texel| texel.w);
            Sheen::new(self.sheen_color * color, self.sheen_roughness * roughness, cos)
        };
        SurfaceFinish {
            iridescence: self.film(&texel),
            sheen,
            anisotropy: self.grain(&texel, frame),
        }
    }

    fn grain(
        &self,
        texel: &impl Fn(&Option<Texture>) -> Option<Vec4>,
        frame: impl FnOnce() -> Option<[Vec3; 2]>,
    ) -> Anisotropy {
        if self.anisotropy_strength == 0.0 {
            return Anisotropy::NONE;
        }
        let texel = texel(&self.direction_texture).unwrap_or(Vec4::new(1.0, 0.5, 1.0, 1.0));
        let direction = (texel.xy() * 2.0 - Vec2::ONE).normalize_or(Vec2::X);
        let direction = self.turn.rotate(direction);
        frame().map_or(Anisotropy::NONE, |[tangent, bitangent]| Anisotropy {
            strength: self.anisotropy_strength * texel.z,
            direction: tangent * direction.x + bitangent * direction.y,
        })
    }
}
