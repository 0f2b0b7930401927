//! The scene as a file describes it, before it is posed at a time.
//!
//! Everything refers to everything else by index into the vectors of [`Scene`]; loaders guarantee that every
//! index is in range and that the node hierarchy is a forest (no cycles, one parent at most).

use glam::{DMat4, DQuat, DVec3, Mat4, Quat, Vec2, Vec3, Vec4};

use crate::{Image, Material, Notice, Sampler, Solid};

/// A whole scene: what one file, or one procedural generator, holds.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Name for people: the file's stem or the built-in's name.
    pub name: String,
    /// The node forest; a node's parent, if any, always comes before it in this vector.
    pub nodes: Vec<Node>,
    /// Meshes, referred to by nodes.
    pub meshes: Vec<Mesh>,
    /// Materials, referred to by primitives. Index 0 always exists and is the default material.
    pub materials: Vec<Material>,
    /// Decoded images, referred to by texture references.
    pub images: Vec<Image>,
    /// Samplers, referred to by texture references. Index 0 always exists (repeat, linear).
    pub samplers: Vec<Sampler>,
    /// Solids, referred to by nodes.
    pub solids: Vec<Solid>,
    /// Skins, referred to by nodes.
    pub skins: Vec<Skin>,
    /// Animations in file order.
    pub animations: Vec<Animation>,
    /// Cameras, referred to by nodes.
    pub cameras: Vec<Camera>,
    /// Lights, referred to by nodes.
    pub lights: Vec<Light>,
    /// Radiance from all around that the scene is meant to be seen in, beside its lights: that of the built-in scenes,
    /// [`crate::DEFAULT_AMBIENT`] for files that place no light, and none for those that do.
    pub ambient: Vec3,
    /// What the loader skipped, repaired or did not understand; each said once.
    pub notices: Vec<Notice>,
}

/// One node of the hierarchy.
#[derive(Clone, Debug, Default)]
pub struct Node {
    /// Name from the file, possibly empty.
    pub name: String,
    /// Index of the parent in [`Scene::nodes`], always smaller than the node's own.
    pub parent: Option<usize>,
    /// Transform relative to the parent.
    pub transform: Transform,
    /// Mesh shown at this node.
    pub mesh: Option<usize>,
    /// Skin that deforms the mesh; the node's own transform is then ignored, as glTF prescribes.
    pub skin: Option<usize>,
    /// Morph weights of this node; empty means the mesh's own defaults.
    pub weights: Vec<f32>,
    /// Solid shown at this node.
    pub solid: Option<usize>,
    /// Camera at this node, looking along its local -Z.
    pub camera: Option<usize>,
    /// Light at this node, shining along its local -Z.
    pub light: Option<usize>,
}

/// A local transform: decomposed (so that it can be animated) or a plain matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// Translation, rotation (unit quaternion) and scale, applied as T * R * S.
    Trs {
        /// Translation in the parent's units.
        translation: DVec3,
        /// Rotation, normalised.
        rotation: DQuat,
        /// Scale per axis; may be negative or zero.
        scale: DVec3,
    },
    /// Any affine matrix, column major.
    Matrix(DMat4),
}

impl Default for Transform {
    fn default() -> Self {
        Self::Trs {
            translation: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            scale: DVec3::ONE,
        }
    }
}

impl Transform {
    /// The transform as a matrix.
    pub fn matrix(&self) -> DMat4 {
        match *self {
            Self::Trs {
                translation,
                rotation,
                scale,
            } => DMat4::from_scale_rotation_translation(scale, rotation, translation),
            Self::Matrix(matrix) => matrix,
        }
    }
}

/// A mesh: primitives with one material each, all sharing the morph weights.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Name from the file, possibly empty.
    pub name: String,
    /// The parts of the mesh.
    pub primitives: Vec<Primitive>,
    /// Default morph weights; as long as every primitive's `morph_targets`.
    pub weights: Vec<f32>,
}

/// Indexed triangles in local space with per-vertex attributes. An empty attribute vector means "absent";
/// a present one has one entry per position.
#[derive(Clone, Debug, Default)]
pub struct Primitive {
    /// Vertex positions; finite values are not promised, see [`crate::Scene::at`].
    pub positions: Vec<Vec3>,
    /// Vertex normals.
    pub normals: Vec<Vec3>,
    /// Tangents, w is the handedness of the bitangent.
    pub tangents: Vec<Vec4>,
    /// First texture coordinate set; origin at the top left as in glTF.
    pub uvs: Vec<Vec2>,
    /// Second texture coordinate set.
    pub uvs1: Vec<Vec2>,
    /// Linear vertex colours with alpha.
    pub colors: Vec<Vec4>,
    /// Four joint indices a vertex, into [`Skin::joints`].
    pub joints: Vec<[u16; 4]>,
    /// Four joint weights a vertex, summing to 1.
    pub weights: Vec<Vec4>,
    /// Corner indices, every one smaller than `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Displacements for morphing.
    pub morph_targets: Vec<MorphTarget>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// Displacements of one morph target; absent attributes are empty.
#[derive(Clone, Debug, Default)]
pub struct MorphTarget {
    /// Added to positions, times the weight.
    pub positions: Vec<Vec3>,
    /// Added to normals, times the weight.
    pub normals: Vec<Vec3>,
    /// Added to tangents (xyz), times the weight.
    pub tangents: Vec<Vec3>,
}

/// Joints and their inverse bind matrices.
#[derive(Clone, Debug, Default)]
pub struct Skin {
    /// Name from the file, possibly empty.
    pub name: String,
    /// Node indices of the joints.
    pub joints: Vec<usize>,
    /// One per joint: from mesh space to the joint's space in bind pose.
    pub inverse_bind: Vec<Mat4>,
}

/// One named animation: channels that drive node properties.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Name from the file, possibly empty.
    pub name: String,
    /// The channels.
    pub channels: Vec<Channel>,
}

impl Animation {
    /// Time of the last key, in seconds.
    pub fn duration(&self) -> f32 {
        self.channels
            .iter()
            .filter_map(|c| c.times.last().copied())
            .fold(0.0, f32::max)
    }
}

/// One animated property of one node.
#[derive(Clone, Debug)]
pub struct Channel {
    /// The node that is driven.
    pub node: usize,
    /// Key times in seconds, strictly increasing, at least one.
    pub times: Vec<f32>,
    /// How to interpolate between keys.
    pub interpolation: Interpolation,
    /// The driven property and its key values. With [`Interpolation::CubicSpline`] there are three entries a
    /// key: in-tangent, value, out-tangent.
    pub target: ChannelTarget,
}

/// Key values of a channel, by property.
#[derive(Clone, Debug)]
pub enum ChannelTarget {
    /// Node translation.
    Translation(Vec<Vec3>),
    /// Node rotation.
    Rotation(Vec<Quat>),
    /// Node scale.
    Scale(Vec<Vec3>),
    /// Morph weights, `targets` values a key (three times that for cubic splines).
    Weights {
        /// Number of morph targets.
        targets: usize,
        /// The weights, key after key.
        values: Vec<f32>,
    },
}

/// Interpolation between keys, as glTF defines it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the key before.
    Step,
    /// Linear; spherical for rotations.
    #[default]
    Linear,
    /// Cubic Hermite spline with given tangents.
    CubicSpline,
}

/// A camera's lens; where it stands is its node's business.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name from the file, possibly empty.
    pub name: String,
    /// The projection.
    pub projection: Projection,
}

/// Lens of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Central projection.
    Perspective {
        /// Full vertical field of view, radians, in (0, pi).
        vfov: f64,
        /// Width over height, if the file prescribes one.
        aspect: Option<f64>,
    },
    /// Parallel projection.
    Orthographic {
        /// Half the height of the view, metres.
        half_height: f64,
        /// Width over height, if the file prescribes one.
        aspect: Option<f64>,
    },
}

/// A light's emission; where it stands is its node's business.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name from the file, possibly empty.
    pub name: String,
    /// Linear colour, multiplied with the intensity.
    pub color: Vec3,
    /// Candela for point and spot lights, lux for directional ones, nits (radiance) for area lights.
    pub intensity: f32,
    /// Distance at which the light ends, metres; infinite by default.
    pub range: f32,
    /// Shape and distribution.
    pub kind: LightKind,
}

/// Shape of a light, in the local space of its node (it shines along -Z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// A point, or a sphere when `radius` is above 0.
    Point {
        /// Radius in metres for soft shadows; 0 is a true point.
        radius: f32,
    },
    /// Parallel light along the node's -Z.
    Directional {
        /// Half angle of the disk it comes from, radians; 0 is sharp.
        half_angle: f32,
    },
    /// A cone along the node's -Z with glTF's squared falloff between the two half angles.
    Spot {
        /// Half angle of full intensity, radians.
        inner: f32,
        /// Half angle at which it ends, radians.
        outer: f32,
        /// Radius in metres for soft shadows; 0 is a true point.
        radius: f32,
    },
    /// A one-sided rectangle in the node's XY plane, centred, shining along -Z.
    Rectangle {
        /// Full width along X, metres.
        width: f32,
        /// Full height along Y, metres.
        height: f32,
    },
    /// A one-sided disk in the node's XY plane, shining along -Z.
    Disk {
        /// Radius in metres.
        radius: f32,
    },
}
