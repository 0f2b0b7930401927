//! Assembly of a built-in scene: materials, meshes, nodes, cameras and lights by a line each.

use glam::{DMat3, DQuat, DVec3, Quat, Vec3, Vec4};

use super::shapes::Surface;
use crate::{
    Animation, Camera, Channel, ChannelTarget, DEFAULT_AMBIENT, Interpolation, Light, LightKind, Material,
    Mesh, Node, Primitive, Projection, Sampler, Scene, Shape, Solid, Transform,
};

/// A scene under construction.
#[derive(Debug)]
pub(super) struct Stage {
    pub(super) scene: Scene,
}

impl Stage {
    /// An empty scene with the default material and sampler.
    pub(super) fn new(name: &str) -> Self {
        Self {
            scene: Scene {
                name: name.into(),
                materials: vec![Material::default()],
                samplers: vec![Sampler::default()],
                ambient: DEFAULT_AMBIENT,
                ..Scene::default()
            },
        }
    }

    /// Adds an opaque dielectric of linear colour.
    pub(super) fn matte(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        self.material(Material {
            roughness,
            ..paint(name, color)
        })
    }

    /// Adds a metal of linear colour.
    pub(super) fn metal(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        self.material(Material {
            metallic: 1.0,
            roughness,
            ..paint(name, color)
        })
    }

    /// Adds any material.
    pub(super) fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Adds a mesh of finished primitives.
    pub(super) fn mesh(&mut self, name: &str, primitives: Vec<Primitive>) -> usize {
        self.scene.meshes.push(Mesh {
            name: name.into(),
            primitives,
            weights: Vec::new(),
        });
        self.scene.meshes.len() - 1
    }

    /// Adds a mesh of one surface, smooth where faces meet at less than [`CREASE`].
    pub(super) fn solid(&mut self, name: &str, surface: Surface, material: usize) -> usize {
        self.mesh(name, vec![surface.into_primitive(CREASE, material)])
    }

    /// Adds a node.
    pub(super) fn node(&mut self, node: Node) -> usize {
        self.scene.nodes.push(node);
        self.scene.nodes.len() - 1
    }

    /// Shows a mesh under an optional parent.
    pub(super) fn place(&mut self, name: &str, mesh: usize, parent: Option<usize>, at: Transform) -> usize {
        self.node(Node {
            name: name.into(),
            mesh: Some(mesh),
            parent,
            transform: at,
            ..Node::default()
        })
    }

    /// Adds a bare node with a translation, to be turned by an animation.
    pub(super) fn place_joint(&mut self, name: &str, parent: usize, offset: Vec3) -> usize {
        let transform = standing(offset, 0.0);
        self.node(Node {
            name: name.into(),
            parent: Some(parent),
            transform,
            ..Node::default()
        })
    }

    /// Adds a surface and shows it where it is.
    pub(super) fn show(&mut self, name: &str, surface: Surface, material: usize) -> usize {
        let mesh = self.solid(name, surface, material);
        self.place(name, mesh, None, Transform::default())
    }

    /// Adds a solid that is not made of triangles and shows it.
    pub(super) fn show_solid(&mut self, name: &str, shape: Shape, material: usize, at: Transform) -> usize {
        self.scene.solids.push(Solid { shape, material });
        let solid = Some(self.scene.solids.len() - 1);
        self.node(Node {
            name: name.into(),
            solid,
            transform: at,
            ..Node::default()
        })
    }

    /// Adds a camera at `eye` that looks at `target`; `vfov` in degrees.
    pub(super) fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, vfov: f64) {
        let projection = Projection::Perspective {
            vfov: vfov.to_radians(),
            aspect: None,
        };
        self.scene.cameras.push(Camera {
            name: name.into(),
            projection,
        });
        let camera = Some(self.scene.cameras.len() - 1);
        let transform = looking(eye, target);
        self.node(Node {
            name: name.into(),
            camera,
            transform,
            ..Node::default()
        });
    }

    /// Adds a point light that gives a white surface facing it at `target` the radiance `brightness`.
    pub(super) fn lamp(&mut self, name: &str, at: DVec3, target: DVec3, brightness: f32, color: [f32; 3]) {
        let distance = at.distance(target) as f32;
        self.scene.lights.push(Light {
            name: name.into(),
            color: color.into(),
            intensity: brightness * std::f32::consts::PI * distance * distance,
            range: f32::INFINITY,
            kind: LightKind::Point { radius: 0.0 },
        });
        let light = Some(self.scene.lights.len() - 1);
        self.node(Node {
            name: name.into(),
            light,
            transform: looking(at, target),
            ..Node::default()
        });
    }

    /// Adds a linear translation track of `node` to `animation`.
    pub(super) fn slide(&mut self, animation: usize, node: usize, times: Vec<f32>, values: Vec<Vec3>) {
        self.track(animation, node, times, ChannelTarget::Translation(values));
    }

    /// Adds a spherical-linear rotation track of `node` to `animation`.
    pub(super) fn turn(&mut self, animation: usize, node: usize, times: Vec<f32>, values: Vec<Quat>) {
        self.track(animation, node, times, ChannelTarget::Rotation(values));
    }

    /// Adds an animation without tracks.
    pub(super) fn animation(&mut self, name: &str) -> usize {
        self.scene.animations.push(Animation {
            name: name.into(),
            channels: Vec::new(),
        });
        self.scene.animations.len() - 1
    }

    /// Number of triangles that the scene shows, instances counted.
    pub(super) fn triangle_count(&self) -> usize {
        let count = |mesh: usize| -> usize {
            self.scene.meshes[mesh]
                .primitives
                .iter()
                .map(|p| p.triangles.len())
                .sum()
        };
        self.scene.nodes.iter().filter_map(|n| n.mesh).map(count).sum()
    }

    fn track(&mut self, animation: usize, node: usize, times: Vec<f32>, target: ChannelTarget) {
        let channel = Channel {
            node,
            times,
            interpolation: Interpolation::Linear,
            target,
        };
        self.scene.animations[animation].channels.push(channel);
    }
}

/// Largest angle between faces that are shaded as one smooth surface, degrees.
pub(super) const CREASE: f32 = 40.0;

/// A transform without scale: turned by `yaw` radians about +Y, then moved.
pub(super) fn standing(at: Vec3, yaw: f32) -> Transform {
    placed(at, yaw, 1.0)
}

/// A transform with uniform scale: scaled, turned by `yaw` radians about +Y, then moved.
pub(super) fn placed(at: Vec3, yaw: f32, scale: f32) -> Transform {
    Transform::Trs {
        translation: at.as_dvec3(),
        rotation: DQuat::from_rotation_y(f64::from(yaw)),
        scale: DVec3::splat(f64::from(scale)),
    }
}

/// Times and values of a track: `keys` equal steps over `duration`, the last equal to the first's phase + 1.
pub(super) fn sampled<T>(duration: f32, keys: usize, value: impl Fn(f32) -> T) -> (Vec<f32>, Vec<T>) {
    (0..=keys)
        .map(|i| i as f32 / keys as f32)
        .map(|phase| (phase * duration, value(phase)))
        .unzip()
}

fn looking(from: DVec3, to: DVec3) -> Transform {
    let back = (from - to).normalize();
    let up = if back.y.abs() > 0.999 {
        DVec3::NEG_Z
    } else {
        DVec3::Y
    };
    let right = up.cross(back).normalize();
    let rotation = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    Transform::Trs {
        translation: from,
        rotation,
        scale: DVec3::ONE,
    }
}

fn paint(name: &str, [r, g, b]: [f32; 3]) -> Material {
    Material {
        name: name.into(),
        base_color: Vec4::new(r, g, b, 1.0),
        ..Material::default()
    }
}
