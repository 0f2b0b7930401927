//! Solids in glTF: `extras.rayward_solid` of a node, an object with the index of a material and a shape.
//!
//! ```json
//! { "name": "die", "extras": { "rayward_solid": { "material": 0, "shape": { "difference": [
//!     { "intersection": [ { "box": { "min": [-1, -1, -1], "max": [1, 1, 1] } }, { "sphere": { "radius": 1.3 } } ] },
//!     { "cylinder": { "from": [0, -2, 0], "to": [0, 2, 0], "radius": 0.5 } } ] } } } }
//! ```
//!
//! Shapes are `sphere` (`center`, the zero point if left out, `radius`), `cylinder` and `capsule` (`from`, `to`, `radius`),
//! `box` (`min`, `max`), and lists: `union`, `intersection` and `difference`, the first without all others. Other
//! programs ignore extras, so such a file stays a valid glTF. Limits: [`MAX_LEAVES`] a solid, [`MAX_ALL_LEAVES`] a file.

use glam::{DMat3, DVec3};
use serde::Deserialize;

use super::node::Tree;
use super::source::Source;
use crate::{AlphaMode, Animation, ChannelTarget, Error, Material, Scene, Shape, Solid, Transform};

/// The key in a node's extras.
pub(super) const KEY: &str = "rayward_solid";
/// Most spheres, cylinders, capsules and boxes of one solid.
const MAX_LEAVES: usize = 1 << 12;
/// The same of all solids of a file.
const MAX_ALL_LEAVES: usize = 1 << 22;
/// Unequal scale that may be rounding.
const ROUNDING: f64 = 1e-5;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FileSolid {
    material: Option<usize>,
    shape: FileShape,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum FileShape {
    Sphere {
        #[serde(default)]
        center: [f64; 3],
        radius: f64,
    },
    Cylinder {
        from: [f64; 3],
        to: [f64; 3],
        radius: f64,
    },
    Capsule {
        from: [f64; 3],
        to: [f64; 3],
        radius: f64,
    },
    Box {
        min: [f64; 3],
        max: [f64; 3],
    },
    Union(Vec<FileShape>),
    Intersection(Vec<FileShape>),
    Difference(Vec<FileShape>),
}

impl FileShape {
    /// The shape, or what is wrong with it.
    fn shape(self) -> Result<Shape, String> {
        let vector = |v: [f64; 3]| DVec3::from_array(v);
        let positive = |radius: f64, kind: &str| {
            let sound = radius > 0.0 && radius.is_finite();
            sound
                .then_some(radius)
                .ok_or_else(|| format!("the radius of a {kind} is {radius}; it has to be finite and above 0"))
        };
        let parts = |parts: Vec<Self>, kind: &str| {
            if parts.is_empty() {
                return Err(format!("the list of a {kind} is empty"));
            }
            parts.into_iter().map(Self::shape).collect()
        };
        Ok(match self {
            Self::Sphere { center, radius } => Shape::Sphere {
                center: vector(center),
                radius: positive(radius, "sphere")?,
            },
            Self::Cylinder { from, to, .. } if from == to => {
                return Err("the ends of a cylinder are at one place".into());
            }
            Self::Cylinder { from, to, radius } => Shape::Cylinder {
                from: vector(from),
                to: vector(to),
                radius: positive(radius, "cylinder")?,
            },
            Self::Capsule { from, to, radius } => Shape::Capsule {
                from: vector(from),
                to: vector(to),
                radius: positive(radius, "capsule")?,
            },
            Self::Box { min, max } => {
                let (min, max) = (vector(min), vector(max));
                let half = (max - min) * 0.5;
                if !half.cmpgt(DVec3::ZERO).all() {
                    return Err("the min of a box is not below its max on every axis".into());
                }
                Shape::Box {
                    center: min.midpoint(max),
                    half: [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z],
                }
            }
            Self::Union(list) => Shape::Union(parts(list, "union")?),
            Self::Intersection(list) => Shape::Intersection(parts(list, "intersection")?),
            Self::Difference(list) => Shape::Difference(parts(list, "difference")?),
        })
    }
}

/// Reads the solid of a node of the file, if it is one; `before` counts the leaves of all solids up to here.
pub(super) fn read(
    source: &Source<'_>,
    node: usize,
    place: &str,
    before: &mut usize,
) -> Result<Option<Solid>, Error> {
    let Some(value) = source.solids.get(node).filter(|value| !value.is_null()) else {
        return Ok(None);
    };
    let place = format!("{place}, extras.{KEY}");
    let solid = FileSolid::deserialize(value).map_err(|e| source.malformed(&place, e.to_string()))?;
    let shape = solid
        .shape
        .shape()
        .map_err(|problem| source.malformed(&place, problem))?;
    let leaves = shape.leaf_count();
    *before += leaves;
    if leaves > MAX_LEAVES {
        let what = format!("the count of {leaves} spheres, cylinders, capsules and boxes");
        return Err(source.too_large(place, what, MAX_LEAVES.to_string()));
    }
    if *before > MAX_ALL_LEAVES {
        let what = format!("the count of {before} spheres, cylinders, capsules and boxes up to here");
        return Err(source.too_large(place, what, MAX_ALL_LEAVES.to_string()));
    }
    let materials = source.root.materials.len();
    let material = match solid.material {
        // Index 0 of the scene's is the default one.
        None => 0,
        Some(index) if index < materials => index + 1,
        Some(index) => {
            let problem = format!("material {index} does not exist, there are {materials}");
            return Err(source.malformed(place, problem));
        }
    };
    Ok(Some(Solid { shape, material }))
}

/// Refuses what a solid cannot be: transparent, textured, sheared or scaled unequally.
pub(super) fn check(source: &Source<'_>, scene: &Scene) -> Result<(), Error> {
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(solid) = node.solid else { continue };
        let place = format!("node {:?}, extras.{KEY}", node.name);
        let material = &scene.materials[scene.solids[solid].material];
        if material.alpha_mode != AlphaMode::Opaque {
            return Err(source.malformed(place, "a solid's material has to have the alphaMode OPAQUE"));
        }
        if is_textured(material) {
            let problem = "a solid's material cannot have textures: solids have no texture coordinates";
            return Err(source.malformed(place, problem));
        }
        let mut above = Some(index);
        while let Some(at) = above {
            let animated = scene.animations.iter().any(|animation| bends(animation, at));
            if animated || !keeps_shape(&scene.nodes[at].transform) {
                let problem = format!(
                    "node {:?} scales it unequally along its axes, or shears it",
                    scene.nodes[at].name
                );
                return Err(source.malformed(place, problem));
            }
            above = scene.nodes[at].parent;
        }
    }
    Ok(())
}

fn is_textured(material: &Material) -> bool {
    [
        material.base_color_texture,
        material.metallic_roughness_texture,
        material.normal_texture,
        material.occlusion_texture,
        material.emissive_texture,
        material.transmission_texture,
        material.thickness_texture,
        material.specular_texture,
        material.specular_color_texture,
    ]
    .iter()
    .any(Option::is_some)
}

fn keeps_shape(transform: &Transform) -> bool {
    let columns = match transform {
        Transform::Trs { scale, .. } => return is_even(*scale),
        Transform::Matrix(matrix) => DMat3::from_mat4(*matrix),
    };
    let axes = [columns.x_axis, columns.y_axis, columns.z_axis];
    let lengths = DVec3::from_array(axes.map(DVec3::length));
    let skew = |a: usize, b: usize| axes[a].dot(axes[b]).abs() > ROUNDING * lengths[a] * lengths[b];
    is_even(lengths) && !skew(0, 1) && !skew(1, 2) && !skew(2, 0)
}

fn is_even(scale: DVec3) -> bool {
    let scale = scale.abs();
    scale.max_element() - scale.min_element() <= ROUNDING * scale.max_element()
}

/// Whether an animation scales a node unequally.
fn bends(animation: &Animation, node: usize) -> bool {
    let own = animation.channels.iter().filter(|channel| channel.node == node);
    own.into_iter().any(|channel| match &channel.target {
        ChannelTarget::Scale(values) => !values.iter().all(|scale| is_even(scale.as_dvec3())),
        _ => false,
    })
}

impl Tree {
    /// Nodes that show a solid.
    pub(super) fn count_solids(&self) -> usize {
        self.nodes.iter().filter(|node| node.solid.is_some()).count()
    }
}
