//! The node forest (glTF 2.0 §3.5): order, transforms, instances and what hangs on the nodes.
//!
//! Kept are the nodes of the default scene (the first scene if none is called default, all roots if there are no
//! scenes), parents before children. Joints outside of the scene come along without what they show.
//! `EXT_mesh_gpu_instancing` becomes one child node an instance.

use glam::{DMat4, DQuat, DVec3};
use gltf::json;
use gltf::json::accessor::Type;

use super::accessor::Elements;
use super::lens::punctual;
use super::source::Source;
use super::{MAX_NODES, MAX_VERTICES, Notices, place, skin, solid};
use crate::{Error, LoadOptions, Mesh, Node, Skin, Solid, Transform, UpAxis};

/// The nodes of the scene and where they come from.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    pub(super) solids: Vec<Solid>,
    pub(super) skins: Vec<Skin>,
    /// For each node of the file its index in `nodes`.
    pub(super) index: Vec<Option<usize>>,
    /// For each node of the file whether its mesh is shown by instances instead of by itself.
    pub(super) instanced: Vec<bool>,
}

/// Reads the default scene's nodes.
pub(super) fn read(
    source: &Source<'_>,
    options: &LoadOptions,
    meshes: &[Mesh],
    notices: &mut Notices,
) -> Result<Tree, Error> {
    let file_nodes = &source.root.nodes;
    let parents = parents(source)?;
    let roots = scene_roots(source, &parents)?;
    let mut order = Vec::new();
    let mut seen = vec![false; file_nodes.len()];
    roots
        .iter()
        .for_each(|&root| walk(source, root, true, &mut seen, &mut order));

    let mut skins = skin::Used::default();
    for &(i, _) in &order {
        if let (Some(_), Some(index)) = (file_nodes[i].mesh, file_nodes[i].skin) {
            skins.add(source.index(index, source.root.skins.len(), "skin", &node_place(source, i))?);
        }
    }
    for joint in skins.joints(source)? {
        if !seen[joint] {
            notices.say(
                node_place(source, joint),
                "joints outside of the scene are used where they are",
            );
            let root = std::iter::successors(Some(joint), |&node| parents[node])
                .last()
                .unwrap_or(joint);
            walk(source, root, false, &mut seen, &mut order);
        }
    }

    let mut count = order.len() + 1;
    for &(i, _) in &order {
        count += Instances::of(source, i)?.map_or(0, |instances| instances.count);
        if count > MAX_NODES {
            let what = format!("the count of {count} nodes up to here");
            return Err(source.too_large(node_place(source, i), what, MAX_NODES.to_string()));
        }
    }
    let last_joint = |mesh: &Mesh| {
        mesh.primitives
            .iter()
            .flat_map(|p| p.joints.as_flattened())
            .copied()
            .max()
    };
    let last_joints = meshes.iter().map(last_joint).collect();
    let mut builder = Builder {
        source,
        meshes,
        last_joints,
        skins: &skins,
        notices,
        nodes: Vec::new(),
        solids: Vec::new(),
        leaves: 0,
        top: None,
    };
    builder.top = builder.push_options(options);
    let mut index = vec![None; file_nodes.len()];
    let mut instanced = vec![false; file_nodes.len()];
    for (i, shown) in order {
        let parent = parents[i].and_then(|parent| index[parent]);
        index[i] = Some(builder.nodes.len());
        instanced[i] = builder.push(i, parent, shown)?;
    }
    let (nodes, solids) = (builder.nodes, builder.solids);
    let skins = skins.read(source, &index)?;
    Ok(Tree {
        nodes,
        solids,
        skins,
        index,
        instanced,
    })
}

fn node_place(source: &Source<'_>, i: usize) -> String {
    place("node", i, source.root.nodes[i].name.as_ref())
}

/// Each node's parent; an error if a node has several or is its own ancestor.
fn parents(source: &Source<'_>) -> Result<Vec<Option<usize>>, Error> {
    let nodes = &source.root.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for &child in node.children.iter().flatten() {
            let child = source.index(child, nodes.len(), "child node", &node_place(source, i))?;
            if let Some(other) = parents[child] {
                let problem = format!("it is a child of node {other} and of node {i}; a node has one parent");
                return Err(source.malformed(node_place(source, child), problem));
            }
            parents[child] = Some(i);
        }
    }
    let mut seen = vec![false; nodes.len()];
    let roots = (0..nodes.len()).filter(|&i| parents[i].is_none());
    roots.for_each(|root| walk(source, root, true, &mut seen, &mut Vec::new()));
    match seen.iter().position(|seen| !seen) {
        None => Ok(parents),
        Some(i) => Err(source.malformed(
            node_place(source, i),
            "the node is its own ancestor or below such a one",
        )),
    }
}

/// The roots of the scene to show, each once.
fn scene_roots(source: &Source<'_>, parents: &[Option<usize>]) -> Result<Vec<usize>, Error> {
    let scenes = &source.root.scenes;
    let scene = match source.root.scene {
        Some(index) => source.index(index, scenes.len(), "scene", "scene")?,
        None if scenes.is_empty() => {
            return Ok((0..parents.len()).filter(|&i| parents[i].is_none()).collect());
        }
        None => 0,
    };
    let place = place("scene", scene, scenes[scene].name.as_ref());
    let mut roots = Vec::new();
    for &node in &scenes[scene].nodes {
        let i = source.index(node, parents.len(), "node", &place)?;
        if let Some(parent) = parents[i] {
            let problem = format!("node {i} is listed as a root but is a child of node {parent}");
            return Err(source.malformed(place, problem));
        }
        roots.push(i);
    }
    Ok(roots)
}

/// Appends a node and all below it, parents first, each with `shown`. The nodes must form a forest.
fn walk(source: &Source<'_>, root: usize, shown: bool, seen: &mut [bool], order: &mut Vec<(usize, bool)>) {
    let mut stack = vec![root];
    while let Some(i) = stack.pop() {
        if !std::mem::replace(&mut seen[i], true) {
            order.push((i, shown));
            stack.extend(
                source.root.nodes[i]
                    .children
                    .iter()
                    .flatten()
                    .rev()
                    .map(json::Index::value),
            );
        }
    }
}

struct Builder<'b> {
    source: &'b Source<'b>,
    meshes: &'b [Mesh],
    /// The largest joint index in each mesh.
    last_joints: Vec<Option<u16>>,
    skins: &'b skin::Used,
    notices: &'b mut Notices,
    nodes: Vec<Node>,
    solids: Vec<Solid>,
    /// What all solids up to here are made of.
    leaves: usize,
    /// The node that applies the options, parent of all roots.
    top: Option<usize>,
}

impl Builder<'_> {
    fn push_options(&mut self, options: &LoadOptions) -> Option<usize> {
        if *options == LoadOptions::default() {
            return None;
        }
        let rotation = match options.up {
            UpAxis::Y => DQuat::IDENTITY,
            UpAxis::Z => DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        };
        let scale = DVec3::splat(options.scale);
        let transform = Transform::Trs {
            translation: DVec3::ZERO,
            rotation,
            scale,
        };
        self.nodes.push(Node {
            transform,
            ..Node::default()
        });
        Some(0)
    }

    /// Appends a node of the file and its instances; whether it has instances.
    fn push(&mut self, i: usize, parent: Option<usize>, shown: bool) -> Result<bool, Error> {
        let source = self.source;
        let node = &source.root.nodes[i];
        let place = node_place(source, i);
        let mut out = Node {
            name: node.name.clone().unwrap_or_default(),
            parent: parent.or(self.top),
            transform: transform(source, node, &place)?,
            ..Node::default()
        };
        if shown {
            if let Some(solid) = solid::read(source, i, &place, &mut self.leaves)? {
                out.solid = Some(self.solids.len());
                self.solids.push(solid);
            }
            self.attach(node, &mut out, &place)?;
        }
        let Some(instances) = Instances::of(source, i)?.filter(|_| shown) else {
            self.nodes.push(out);
            return Ok(false);
        };
        if out.skin.take().is_some() {
            self.notices.say(&place, "an instanced mesh is not skinned");
        }
        let parent = Some(self.nodes.len());
        let (mesh, weights) = (out.mesh.take(), std::mem::take(&mut out.weights));
        let name = out.name.clone();
        self.nodes.push(out);
        for k in 0..instances.count {
            let transform = instances.transform(source, k)?;
            let (name, weights) = (name.clone(), weights.clone());
            self.nodes.push(Node {
                name,
                parent,
                transform,
                mesh,
                weights,
                ..Node::default()
            });
        }
        Ok(true)
    }

    /// Sets what a node shows.
    fn attach(&mut self, node: &json::Node, out: &mut Node, place: &str) -> Result<(), Error> {
        let source = self.source;
        if let Some(camera) = node.camera {
            out.camera = Some(source.index(camera, source.root.cameras.len(), "camera", place)?);
        }
        if let Some(light) = node
            .extensions
            .as_ref()
            .and_then(|e| e.khr_lights_punctual.as_ref())
        {
            out.light = Some(source.index(light.light, punctual(source).len(), "light", place)?);
        }
        let Some(mesh) = node.mesh else { return Ok(()) };
        let mesh = source.index(mesh, self.meshes.len(), "mesh", place)?;
        out.mesh = Some(mesh);
        if let Some(skin) = node.skin {
            out.skin = self.skins.position(skin.value());
            let joints = source.root.skins[skin.value()].joints.len();
            if let Some(joint) = self.last_joints[mesh].filter(|&joint| usize::from(joint) >= joints) {
                let problem = format!(
                    "mesh {mesh} uses joint {joint}, skin {} has {joints}",
                    skin.value()
                );
                return Err(source.malformed(place, problem));
            }
        }
        if let Some(weights) = &node.weights {
            out.weights = weights.clone();
            let targets = self.meshes[mesh].weights.len();
            if weights.len() != targets {
                let message = "the number of weights is not that of the morph targets; weights are cut or 0";
                self.notices.say(place, message);
                out.weights.resize(targets, 0.0);
            }
        }
        Ok(())
    }
}

impl Tree {
    /// Triangles with all instances; an error if they, or their vertices, are too many.
    pub(super) fn count_triangles(&self, source: &Source<'_>, meshes: &[Mesh]) -> Result<usize, Error> {
        let size = |mesh: &Mesh| {
            mesh.primitives
                .iter()
                .fold((0, 0), |(t, v), p| (t + p.triangles.len(), v + p.positions.len()))
        };
        let sizes: Vec<_> = meshes.iter().map(size).collect();
        let (mut triangles, mut vertices) = (0_usize, 0_usize);
        for mesh in self.nodes.iter().filter_map(|node| node.mesh) {
            triangles = triangles.saturating_add(sizes[mesh].0);
            vertices = vertices.saturating_add(sizes[mesh].1);
        }
        for (count, what) in [(triangles, "triangles"), (vertices, "vertices")] {
            if count > MAX_VERTICES {
                let what = format!("the sum of {count} {what} of all instances");
                return Err(source.too_large("scene", what, MAX_VERTICES.to_string()));
            }
        }
        Ok(triangles)
    }
}

fn transform(source: &Source<'_>, node: &json::Node, place: &str) -> Result<Transform, Error> {
    let transform = match &node.matrix {
        Some(matrix) => Transform::Matrix(DMat4::from_cols_array(&matrix.map(f64::from))),
        None => trs(
            node.translation,
            node.rotation.map(|rotation| rotation.0),
            node.scale,
        ),
    };
    if transform.matrix().is_finite() {
        Ok(transform)
    } else {
        Err(source.malformed(place, "its transform is not finite"))
    }
}

fn trs(translation: Option<[f32; 3]>, rotation: Option<[f32; 4]>, scale: Option<[f32; 3]>) -> Transform {
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let unit = |q: [f32; 4]| {
        let q = DQuat::from_array(q.map(f64::from));
        if q.length_squared() > 0.0 && q.is_finite() {
            q.normalize()
        } else {
            DQuat::IDENTITY
        }
    };
    Transform::Trs {
        translation: translation.map_or(DVec3::ZERO, vector),
        rotation: rotation.map_or(DQuat::IDENTITY, unit),
        scale: scale.map_or(DVec3::ONE, vector),
    }
}

/// The attributes of `EXT_mesh_gpu_instancing` on one node.
struct Instances<'a> {
    place: String,
    count: usize,
    translation: Option<Elements<'a>>,
    rotation: Option<Elements<'a>>,
    scale: Option<Elements<'a>>,
}

impl<'a> Instances<'a> {
    /// The instances of a node of the file, if it has a mesh and the extension.
    fn of(source: &'a Source<'_>, i: usize) -> Result<Option<Self>, Error> {
        let node = &source.root.nodes[i];
        let extension = node
            .extensions
            .as_ref()
            .and_then(|e| e.others.get("EXT_mesh_gpu_instancing"));
        match extension.filter(|_| node.mesh.is_some()) {
            Some(extension) => Self::read(source, extension, &node_place(source, i)).map(Some),
            None => Ok(None),
        }
    }

    fn read(source: &'a Source<'_>, extension: &json::Value, place: &str) -> Result<Self, Error> {
        let place = format!("{place}, EXT_mesh_gpu_instancing");
        let attributes = extension.get("attributes");
        let read = |name: &str, shape: Type| -> Result<Option<Elements<'a>>, Error> {
            let Some(index) = attributes.and_then(|attributes| attributes.get(name)) else {
                return Ok(None);
            };
            let place = format!("{place}, {name}");
            Ok(Some(source.elements(
                source.accessor_index(index, &place)?,
                &[shape],
                &place,
            )?))
        };
        let translation = read("TRANSLATION", Type::Vec3)?;
        let rotation = read("ROTATION", Type::Vec4)?;
        let scale = read("SCALE", Type::Vec3)?;
        let present = || [&translation, &rotation, &scale].into_iter().flatten();
        let Some(count) = present().map(|elements| elements.count).next() else {
            return Err(source.malformed(
                place,
                "there is no TRANSLATION, ROTATION or SCALE to count instances by",
            ));
        };
        if present().any(|elements| elements.count != count) {
            return Err(source.malformed(place, "its attributes differ in number"));
        }
        Ok(Self {
            place,
            count,
            translation,
            rotation,
            scale,
        })
    }

    fn transform(&self, source: &Source<'_>, k: usize) -> Result<Transform, Error> {
        let transform = trs(
            self.translation.as_ref().map(|elements| elements.floats(k)),
            self.rotation.as_ref().map(|elements| elements.floats(k)),
            self.scale.as_ref().map(|elements| elements.floats(k)),
        );
        if transform.matrix().is_finite() {
            Ok(transform)
        } else {
            Err(source.malformed(
                &self.place,
                format!("the transform of instance {k} is not finite"),
            ))
        }
    }
}
