//! Solids: spheres, cylinders, capsules, boxes, and what constructive solid geometry makes of them.
//!
//! A solid hangs on a node as a mesh does, has one material, and is posed by the node's world matrix, which has to be free
//! of shear and of unequal scale: a sphere stays a sphere. It has no texture coordinates. Units: the node's; posed, metres
//! relative to [`crate::FrameGeometry::origin`]. All of it is f64; nothing is rounded to f32.

use glam::{DMat3, DMat4, DVec3};

/// A solid of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// What it looks like in its node's space.
    pub shape: Shape,
    /// Index into [`crate::Scene::materials`]; its alpha mode and textures are not used.
    pub material: usize,
}

/// A solid of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedSolid {
    /// Its shape, relative to [`crate::FrameGeometry::origin`].
    pub shape: Shape,
    /// Index into the scene's materials.
    pub material: u32,
    /// Index into the scene's nodes.
    pub node: u32,
}

/// The shape of a solid.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// All points within `radius` of `center`.
    Sphere {
        /// The centre.
        center: DVec3,
        /// The radius.
        radius: f64,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Middle of one end.
        from: DVec3,
        /// Middle of the other.
        to: DVec3,
        /// The radius.
        radius: f64,
    },
    /// All points within `radius` of the segment between two points.
    Capsule {
        /// One end of the segment.
        from: DVec3,
        /// The other.
        to: DVec3,
        /// The radius.
        radius: f64,
    },
    /// A box.
    Box {
        /// The middle.
        center: DVec3,
        /// From the middle to the middles of three faces, at right angles.
        half: [DVec3; 3],
    },
    /// What is in any of these.
    Union(Vec<Shape>),
    /// What is in all of these.
    Intersection(Vec<Shape>),
    /// What is in the first of these and in none of the others.
    Difference(Vec<Shape>),
}

impl Shape {
    /// The shape moved by a matrix and then by `-origin`. Lengths take its mean scale.
    pub fn placed(&self, matrix: &DMat4, origin: DVec3) -> Self {
        let scale = DMat3::from_mat4(*matrix).determinant().abs().cbrt();
        self.moved(
            &|p| matrix.transform_point3(p) - origin,
            &|v| matrix.transform_vector3(v),
            scale,
        )
    }

    fn moved(&self, point: &impl Fn(DVec3) -> DVec3, vector: &impl Fn(DVec3) -> DVec3, scale: f64) -> Self {
        let all = |parts: &[Self]| {
            parts
                .iter()
                .map(|part| part.moved(point, vector, scale))
                .collect()
        };
        match self {
            Self::Sphere { center, radius } => Self::Sphere {
                center: point(*center),
                radius: radius * scale,
            },
            Self::Cylinder { from, to, radius } => Self::Cylinder {
                from: point(*from),
                to: point(*to),
                radius: radius * scale,
            },
            Self::Capsule { from, to, radius } => Self::Capsule {
                from: point(*from),
                to: point(*to),
                radius: radius * scale,
            },
            Self::Box { center, half } => Self::Box {
                center: point(*center),
                half: half.map(vector),
            },
            Self::Union(parts) => Self::Union(all(parts)),
            Self::Intersection(parts) => Self::Intersection(all(parts)),
            Self::Difference(parts) => Self::Difference(all(parts)),
        }
    }

    /// Smallest and largest corner of a box around the shape; `None` if nothing is in it.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let sound = |[low, high]: [DVec3; 2]| low.cmple(high).all().then_some([low, high]);
        match self {
            Self::Sphere { center, radius } => sound([*center - *radius, *center + *radius]),
            Self::Cylinder { from, to, radius } | Self::Capsule { from, to, radius } => {
                sound([from.min(*to) - *radius, from.max(*to) + *radius])
            }
            Self::Box { center, half } => {
                let reach = half[0].abs() + half[1].abs() + half[2].abs();
                sound([*center - reach, *center + reach])
            }
            Self::Union(parts) => parts
                .iter()
                .filter_map(Self::bounds)
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]),
            Self::Intersection(parts) => {
                let boxes: Option<Vec<_>> = parts.iter().map(Self::bounds).collect();
                sound(
                    boxes?
                        .into_iter()
                        .reduce(|a, b| [a[0].max(b[0]), a[1].min(b[1])])?,
                )
            }
            Self::Difference(parts) => parts.first()?.bounds(),
        }
    }

    /// The number of spheres, cylinders, capsules and boxes that it is made of.
    pub fn leaf_count(&self) -> usize {
        match self {
            Self::Union(parts) | Self::Intersection(parts) | Self::Difference(parts) => {
                parts.iter().map(Self::leaf_count).sum()
            }
            _ => 1,
        }
    }
}
