//! Textures: images with their mip pyramids, sampled as glTF's samplers prescribe.
//!
//! A [`Texture`] is one use of an image by a material: pyramid, wrapping, filtering, and the affine map of
//! `KHR_texture_transform`. Filtering is bilinear in a level and linear between two levels, in linear light.
//! Which level is the caller's choice ([`Textures::sample`] takes it in levels, 0 the image itself).
//!
//! Layout: 4 bytes a texel in the image's own encoding; level 0 is borrowed from the scene, the other levels cost
//! another third and exist only for samplers that ask for mipmaps. Cost: some 40 ns for a bilinear sample.
//! Limits: no anisotropic filtering; levels are rounded to eight bits like on any GPU.

mod pyramid;

use glam::{Vec2, Vec4};
use rayon::prelude::*;
use rayward_scene::{Sampler, Scene, TextureRef, Wrap};

pub use pyramid::{Encoding, Level, Pyramid};

/// One use of an image.
#[derive(Clone, Copy, Debug)]
pub struct Texture {
    /// Index of its pyramid.
    pub pyramid: usize,
    /// Wrapping and filtering.
    pub sampler: Sampler,
    /// Texture coordinate set, 0 or 1.
    pub uv_set: u8,
    /// Columns of the linear part of the texture transform.
    pub columns: [Vec2; 2],
    /// Its offset.
    pub offset: Vec2,
    /// Half the binary logarithm of texels per unit of texture coordinate area.
    pub density: f32,
}

impl Texture {
    /// Texture coordinates after `KHR_texture_transform`.
    #[inline]
    pub fn transform(&self, uv: Vec2) -> Vec2 {
        self.columns[0] * uv.x + self.columns[1] * uv.y + self.offset
    }

    /// The level at which one texel is as large as a footprint of this area in texture coordinates (before the
    /// texture transform).
    #[inline]
    pub fn level_of(&self, uv_area: f32) -> f32 {
        self.density + 0.5 * uv_area.log2()
    }
}

/// The images of a scene in the encodings its materials use them in.
#[derive(Clone, Debug, Default)]
pub struct Textures<'s> {
    pyramids: Vec<Pyramid<'s>>,
}

/// A texture reference to be resolved, with how its image is to be read.
#[derive(Clone, Copy, Debug)]
struct Use {
    image: usize,
    encoding: Encoding,
    mipmaps: bool,
}

impl<'s> Textures<'s> {
    /// Builds the pyramids for these references, in parallel. References to images without texels are left out.
    pub fn new(scene: &'s Scene, references: &[(TextureRef, Encoding)]) -> Self {
        let mut uses: Vec<Use> = Vec::new();
        for (reference, encoding) in references {
            if scene
                .images
                .get(reference.image)
                .is_none_or(|image| !pyramid::has_texels(image))
            {
                continue;
            }
            let mipmaps = scene
                .samplers
                .get(reference.sampler)
                .is_some_and(|sampler| sampler.mipmaps);
            match uses
                .iter_mut()
                .find(|u| u.image == reference.image && u.encoding == *encoding)
            {
                Some(known) => known.mipmaps |= mipmaps,
                None => uses.push(Use {
                    image: reference.image,
                    encoding: *encoding,
                    mipmaps,
                }),
            }
        }
        let pyramids = uses
            .par_iter()
            .map(|u| Pyramid::new(u.image, &scene.images[u.image], u.encoding, u.mipmaps))
            .collect();
        Self { pyramids }
    }

    /// The pyramids, as [`Texture::pyramid`] counts them.
    pub fn pyramids(&self) -> &[Pyramid<'s>] {
        &self.pyramids
    }

    /// The texture of one reference; `None` if its image is missing or the reference was not among those given
    /// to [`Self::new`].
    pub fn resolve(&self, scene: &Scene, reference: &TextureRef, encoding: Encoding) -> Option<Texture> {
        let pyramid = self
            .pyramids
            .iter()
            .position(|p| p.image == reference.image && p.encoding == encoding)?;
        let transform = &reference.transform;
        let (sin, cos) = transform.rotation.sin_cos();
        // Counter-clockwise as seen with v downwards, so with the opposite sine of a right-handed frame.
        let columns = [
            Vec2::new(cos, -sin) * transform.scale.x,
            Vec2::new(sin, cos) * transform.scale.y,
        ];
        let base = &self.pyramids[pyramid].levels[0];
        let texels = base.width as f32 * base.height as f32;
        Some(Texture {
            pyramid,
            sampler: scene.samplers.get(reference.sampler).copied().unwrap_or_default(),
            uv_set: reference.uv_set,
            columns,
            offset: transform.offset,
            density: 0.5 * (texels * columns[0].perp_dot(columns[1]).abs()).log2(),
        })
    }

    /// The filtered texel at these coordinates (before the texture transform), linear, alpha not premultiplied.
    /// `level` is used by samplers with mipmaps only; it decides between magnification and minification for all.
    pub fn sample(&self, texture: &Texture, uv: Vec2, level: f32) -> Vec4 {
        let pyramid = &self.pyramids[texture.pyramid];
        let uv = texture.transform(uv);
        let sampler = &texture.sampler;
        let minified = level > 0.0;
        let nearest = if minified {
            sampler.min_nearest
        } else {
            sampler.mag_nearest
        };
        let one = |level: &Level| {
            let texel = if nearest { at_nearest } else { at_linear };
            texel(pyramid, level, sampler, uv)
        };
        let last = pyramid.levels.len() - 1;
        if !minified || !sampler.mipmaps || last == 0 {
            return one(&pyramid.levels[0]);
        }
        let level = level.min(last as f32);
        let fine = level as usize;
        let fraction = level - fine as f32;
        let color = one(&pyramid.levels[fine]);
        if fraction == 0.0 {
            color
        } else {
            color.lerp(one(&pyramid.levels[fine + 1]), fraction)
        }
    }
}

/// A coordinate brought into \[0, 1\].
#[inline]
fn wrapped(coordinate: f32, wrap: Wrap) -> f32 {
    match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::MirroredRepeat => {
            let period = coordinate - 2.0 * (0.5 * coordinate).floor();
            if period > 1.0 { 2.0 - period } else { period }
        }
        Wrap::ClampToEdge => coordinate.clamp(0.0, 1.0),
    }
}

/// The two texel indices around a wrapped coordinate and the weight of the second. A mirrored image continues
/// with its edge texel like a clamped one, so only repetition needs the other side. A coordinate that is not a
/// number selects texel 0.
#[inline]
fn neighbours(coordinate: f32, size: u32, wrap: Wrap) -> (u32, u32, f32) {
    let x = wrapped(coordinate, wrap) * size as f32 - 0.5;
    let floor = x.floor();
    let last = size as i32 - 1;
    let (before, after) = (floor as i32, floor as i32 + 1);
    let (first, second) = match wrap {
        Wrap::Repeat => (
            if before < 0 { last } else { before },
            if after > last { 0 } else { after },
        ),
        Wrap::MirroredRepeat | Wrap::ClampToEdge => (before.max(0), after.min(last)),
    };
    let weight = x - floor;
    (
        first.min(last) as u32,
        second as u32,
        if weight >= 0.0 { weight } else { 0.0 },
    )
}

#[inline]
fn at_linear(pyramid: &Pyramid, level: &Level, sampler: &Sampler, uv: Vec2) -> Vec4 {
    let (x0, x1, wx) = neighbours(uv.x, level.width, sampler.wrap_u);
    let (y0, y1, wy) = neighbours(uv.y, level.height, sampler.wrap_v);
    let row = |y| pyramid.texel(level, x0, y).lerp(pyramid.texel(level, x1, y), wx);
    row(y0).lerp(row(y1), wy)
}

#[inline]
fn at_nearest(pyramid: &Pyramid, level: &Level, sampler: &Sampler, uv: Vec2) -> Vec4 {
    let index =
        |coordinate, size: u32, wrap| ((wrapped(coordinate, wrap) * size as f32) as u32).min(size - 1);
    pyramid.texel(
        level,
        index(uv.x, level.width, sampler.wrap_u),
        index(uv.y, level.height, sampler.wrap_v),
    )
}

#[cfg(test)]
mod tests;
