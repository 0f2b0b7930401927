//! Posing: from a [`Scene`] and a time to the [`FrameGeometry`] of one frame.
//!
//! Source: glTF 2.0 §3.5 (nodes), §3.7 (skins, morph targets), §3.11 (animations). The steps are those of the
//! specification: animation channels replace local transforms and morph weights, node transforms are
//! chained to world matrices, morph targets are added in mesh space, and a vertex is then moved by its node or, if
//! it is skinned, by its joints alone.
//!
//! All of it is f64 until a position, relative to [`FrameGeometry::origin`], is rounded once to f32. The
//! origin is the world's zero unless the scene is far from it (see [`origin`]); it comes from the rest pose
//! and so stays where it is while an animation plays.
//!
//! Cost: vertices and triangles are worked on in chunks of fixed size over the threads; each element is
//! computed on its own, so the result does not depend on the number of threads. A frame that is posed again into
//! the same [`FrameGeometry`] reuses its memory.

mod animation;
mod lights;
mod motion;
pub(crate) mod origin;
mod triangles;
mod vertices;

use glam::{DMat3, DMat4, DVec3};

pub use motion::ObjectMotion;

use crate::{FrameGeometry, Node, ObjectRange, PosedSolid, Primitive, Scene, Transform};

impl Scene {
    /// The frame at `time` seconds: animation 0 plays if there is one, clamped before its first and after its last
    /// key.
    ///
    /// # Panics
    /// If an index of the scene is out of range, which no loader lets happen, or if the frame has more than
    /// `u32::MAX` vertices or triangles.
    pub fn at(&self, time: f32) -> FrameGeometry {
        let mut frame = FrameGeometry::default();
        self.at_into(time, &mut frame);
        frame
    }

    /// As [`Scene::at`], but into a frame whose memory is reused.
    ///
    /// # Panics
    /// As [`Scene::at`].
    pub fn at_into(&self, time: f32, frame: &mut FrameGeometry) {
        self.at_animation(Some(0), time, frame);
    }

    /// As [`Scene::at_into`], with the choice of the animation that plays. `None`, or an index beyond the last
    /// animation, gives the rest pose.
    ///
    /// # Panics
    /// As [`Scene::at`].
    pub fn at_animation(&self, animation: Option<usize>, time: f32, frame: &mut FrameGeometry) {
        let (pose, world) = posed_nodes(self, animation, time);
        frame.origin = origin::choose(self);
        let draws = draws(self, &pose, &world);
        vertices::write(&draws, frame);
        triangles::write(&draws, frame);
        frame.solids = solids(self, &world, frame.origin);

        lights::pose_cameras(self, &world, &mut frame.cameras);
        lights::pose_lights(self, &world, &mut frame.lights);
    }

    /// Number of vertices and triangles that [`Scene::at`] has to hold, instances counted each time.
    pub fn posed_size(&self) -> (u64, u64) {
        let primitives = self
            .nodes
            .iter()
            .filter_map(|n| n.mesh)
            .flat_map(|m| &self.meshes[m].primitives);
        primitives.fold((0, 0), |(vertices, triangles), p| {
            (
                vertices + p.positions.len() as u64,
                triangles + p.triangles.len() as u64,
            )
        })
    }
}

/// Every node's local pose at a time, and its world matrix.
fn posed_nodes(scene: &Scene, animation: Option<usize>, time: f32) -> (animation::LocalPose, Vec<DMat4>) {
    let mut pose = animation::LocalPose::rest(scene);
    if let Some(animation) = animation.and_then(|i| scene.animations.get(i)) {
        pose.play(animation, time);
    }
    let world = world_matrices(&scene.nodes, &pose.transforms);
    (pose, world)
}

/// All solids, in node order.
fn solids(scene: &Scene, world: &[DMat4], origin: DVec3) -> Vec<PosedSolid> {
    let nodes = scene.nodes.iter().zip(world).zip(0..);
    let posed = |((node, matrix), index): ((&Node, &DMat4), u32)| {
        let solid = &scene.solids[node.solid?];
        Some(PosedSolid {
            shape: solid.shape.placed(matrix, origin),
            material: solid.material as u32,
            node: index,
        })
    };
    nodes.filter_map(posed).collect()
}

/// World matrix of every node. A parent comes before its children, so one pass is enough.
fn world_matrices(nodes: &[Node], local: &[Transform]) -> Vec<DMat4> {
    let mut world = Vec::with_capacity(nodes.len());
    for (node, transform) in nodes.iter().zip(local) {
        let local = transform.matrix();
        world.push(node.parent.map_or(local, |parent: usize| world[parent] * local));
    }
    world
}

/// One primitive at one node, with what moves its vertices.
struct Draw<'a> {
    primitive: &'a Primitive,
    motion: Motion,
    /// Morph targets that have any effect now: index and weight.
    morphs: Vec<(usize, f64)>,
    /// Whether the motion mirrors, so that the winding has to be reversed.
    mirrored: bool,
    object: ObjectRange,
}

/// What takes a vertex from mesh space to the world.
enum Motion {
    /// The node's world matrix.
    Rigid(DMat4),
    /// World matrix times inverse bind matrix of each joint.
    Skinned(Vec<DMat4>),
}

impl Motion {
    /// Skinned motion has no single determinant: the majority of the joints decides.
    fn mirrors(&self) -> bool {
        let negative = |m: &DMat4| DMat3::from_mat4(*m).determinant() < 0.0;
        match self {
            Self::Rigid(matrix) => negative(matrix),
            Self::Skinned(joints) => joints.iter().filter(|m| negative(m)).count() * 2 > joints.len(),
        }
    }
}

/// What is drawn, in node order, with the ranges before any triangle is dropped.
fn draws<'a>(scene: &'a Scene, pose: &animation::LocalPose, world: &[DMat4]) -> Vec<Draw<'a>> {
    let (vertices, triangles) = scene.posed_size();
    let limit = u64::from(u32::MAX);
    assert!(
        vertices <= limit && triangles <= limit,
        "{vertices} vertices, {triangles} triangles in a frame"
    );

    let mut draws = Vec::new();
    let (mut first_vertex, mut first_triangle) = (0, 0);
    for (index, node) in scene.nodes.iter().enumerate() {
        let Some(mesh) = node.mesh else { continue };
        let mesh = &scene.meshes[mesh];
        for primitive in &mesh.primitives {
            let motion = match node.skin {
                Some(skin) if !primitive.joints.is_empty() => {
                    let skin = &scene.skins[skin];
                    let joints = skin.joints.iter().zip(&skin.inverse_bind);
                    Motion::Skinned(joints.map(|(&j, bind)| world[j] * bind.as_dmat4()).collect())
                }
                _ => Motion::Rigid(world[index]),
            };
            let weights = pose.weights[index].iter().take(primitive.morph_targets.len());
            let morphs = weights
                .enumerate()
                .filter(|&(_, &w)| w != 0.0)
                .map(|(i, &w)| (i, f64::from(w)));
            let end_vertex = first_vertex + primitive.positions.len() as u32;
            let end_triangle = first_triangle + primitive.triangles.len() as u32;
            draws.push(Draw {
                primitive,
                mirrored: motion.mirrors(),
                motion,
                morphs: morphs.collect(),
                object: ObjectRange {
                    triangles: first_triangle..end_triangle,
                    vertices: first_vertex..end_vertex,
                    material: primitive.material as u32,
                    node: index as u32,
                    double_sided: scene.materials[primitive.material].double_sided,
                },
            });
            (first_vertex, first_triangle) = (end_vertex, end_triangle);
        }
    }
    draws
}

/// Takes the first `n` elements off a slice, or nothing from an empty one: a missing attribute has no elements.
fn take<'a, T>(slice: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let n = n.min(slice.len());
    let (head, tail) = std::mem::take(slice).split_at_mut(n);
    *slice = tail;
    head
}
