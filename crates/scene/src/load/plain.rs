//! What the plain mesh formats (OBJ, PLY, STL) share: one file of polygons, no hierarchy, no facing rule.

use std::path::Path;

use glam::{DMat4, DVec3, DVec4};

use super::base::Base;
use super::read_file;
use crate::{
    DEFAULT_AMBIENT, Error, LoadOptions, Material, Mesh, Node, Notice, Primitive, Sampler, Scene, Transform,
    UpAxis,
};

/// The file that is being read, for reading it and for naming it in errors.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
}

impl Source<'_> {
    pub(super) fn read(&self) -> Result<Vec<u8>, Error> {
        read_file(self.path).map_err(|source| Error::Io {
            path: self.path.into(),
            source,
        })
    }

    pub(super) fn malformed(&self, place: impl Into<String>, problem: impl Into<String>) -> Error {
        Error::Malformed {
            path: self.path.into(),
            place: place.into(),
            problem: problem.into(),
        }
    }

    pub(super) fn empty(&self, detail: impl Into<String>) -> Error {
        Error::Empty {
            path: self.path.into(),
            detail: detail.into(),
        }
    }

    /// A scene of one node whose transform adds the base and then turns and scales the file's coordinates.
    pub(super) fn scene(&self, primitives: Vec<Primitive>, base: Base, options: &LoadOptions) -> Scene {
        let stem = self
            .path
            .file_stem()
            .map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default();
        Scene {
            nodes: vec![Node {
                name: stem.clone(),
                transform: world_from_file(base, options),
                mesh: Some(0),
                ..Node::default()
            }],
            meshes: vec![Mesh {
                name: stem.clone(),
                primitives,
                weights: Vec::new(),
            }],
            materials: vec![default_material()],
            samplers: vec![Sampler::default()],
            ambient: DEFAULT_AMBIENT,
            name: stem,
            ..Scene::default()
        }
    }
}

/// These formats do not say which side of a surface is meant to be seen, so both are.
pub(super) fn default_material() -> Material {
    Material {
        double_sided: true,
        ..Material::default()
    }
}

/// The root transform. Written as a matrix, since a rotation by a quaternion would not be exact.
fn world_from_file(Base(base): Base, options: &LoadOptions) -> Transform {
    let s = options.scale;
    let turned = match options.up {
        UpAxis::Y if s == 1.0 && base == DVec3::ZERO => return Transform::default(),
        UpAxis::Y => DMat4::from_diagonal(DVec4::new(s, s, s, 1.0)),
        UpAxis::Z => DMat4::from_cols(
            DVec4::new(s, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 0.0, -s, 0.0),
            DVec4::new(0.0, s, 0.0, 0.0),
            DVec4::W,
        ),
    };
    Transform::Matrix(turned * DMat4::from_translation(base))
}

/// A notice about `count` things at once, or none.
pub(super) fn counted(count: usize, place: &str, message: &str) -> Option<Notice> {
    (count > 0).then(|| Notice {
        place: place.into(),
        message: format!("{message}: {count}"),
    })
}

/// A number as C and C++ programs print it: also `nan`, `-inf` and the `1.#IND` of old Microsoft libraries.
///
/// The f64 nearest to the text, or its neighbour where the nearest lies in the middle between two f32: `as f32`
/// then gives what the text itself would be rounded to, not what two roundings make of it.
pub(super) fn number(token: &str) -> Option<f64> {
    /// The first of the bits of an f64 that an f32 has no room for.
    const HALF: u64 = 1 << 28;
    let Ok(value) = token.parse::<f64>() else {
        return token.contains(".#").then_some(f64::NAN);
    };
    // Below the normal numbers an f32 has room for less.
    let tie = value.to_bits() & (2 * HALF - 1) == HALF
        || (value != 0.0 && value.abs() < f64::from(f32::MIN_POSITIVE));
    let once = match token.parse::<f32>() {
        Ok(once) if tie => f64::from(once),
        _ => return Some(value),
    };
    if f64::from(value as f32) == once {
        Some(value)
    } else if once > value {
        Some(value.next_up())
    } else {
        Some(value.next_down())
    }
}

/// The linear value of an sRGB one.
pub(super) fn linear_from_srgb(s: f32) -> f32 {
    if s <= 0.04045 {
        s / 12.92
    } else {
        ((s + 0.055) / 1.055).powf(2.4)
    }
}
