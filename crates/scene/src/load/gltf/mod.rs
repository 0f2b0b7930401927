//! glTF 2.0 and GLB (Khronos glTF 2.0 specification, sections cited as "glTF 2.0 §").
//!
//! The JSON model is that of the `gltf` crate; its readers and its validation trust indices and sizes, so this
//! loader does both itself: [`source`] hands out only bytes that exist, [`accessor`] only elements that exist.
//! A file that breaks the format is an error with its place; what a file merely asks for beyond what is
//! supported is a notice.
//!
//! Read: the default scene's nodes with meshes (indexed and not, triangles, strips, fans), skins, morph targets,
//! animations, cameras, materials, textures (PNG, JPEG), and the extensions of `container::KNOWN_EXTENSIONS`.
//! `extras.radius` of a punctual light is its radius in metres for soft shadows, `extras.rayward_solid` of a node a
//! [`solid`].
//!
//! [`LoadOptions`] become a node without name above the scene's roots. Lengths that no node scales (light range
//! and radius, thickness, attenuation distance, orthographic size) are multiplied with the scale; intensities
//! are kept, as candela and lux do not depend on the unit of length of a file.
//!
//! Cost: linear in the file, plus the decoded images. Limits: [`MAX_VERTICES`] vertices and as many triangles,
//! both in the file and with every instance counted; [`MAX_NODES`] nodes with instances; images as
//! [`image`] states.

mod accessor;
mod animation;
mod container;
mod image;
mod lens;
mod material;
mod mesh;
mod node;
mod skin;
mod solid;
mod source;

use std::path::Path;

use glam::Vec3;

use self::source::Source;
use crate::{DEFAULT_AMBIENT, Error, LoadOptions, Notice, Scene};

/// Most vertices, and most triangles, of a scene with all its instances.
const MAX_VERTICES: usize = 1 << 27;
/// Most nodes of a scene, instances included.
const MAX_NODES: usize = 1 << 22;

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let bytes = super::read_file(path).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })?;
    let mut notices = Notices::default();
    let source = Source::new(path, container::parse(path, &bytes, &mut notices)?)?;

    let meshes = mesh::read(&source, &mut notices)?;
    let mut tree = node::read(&source, options, &meshes, &mut notices)?;
    let triangles = tree.count_triangles(&source, &meshes)?;
    if triangles == 0 && tree.count_solids() == 0 {
        let count = |n: usize, one: &str, many: &str| format!("{n} {}", if n == 1 { one } else { many });
        let (nodes, meshes) = (source.root.nodes.len(), source.root.meshes.len());
        let detail = format!(
            "{}, {}",
            count(nodes, "node", "nodes"),
            count(meshes, "mesh", "meshes")
        );
        return Err(Error::Empty {
            path: path.into(),
            detail,
        });
    }
    let materials = material::read(&source, options, &mut notices)?;
    let animations = animation::read(&source, &mut tree, &meshes, &mut notices)?;
    let scene = Scene {
        name: path
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
            .unwrap_or_default(),
        cameras: lens::cameras(&source, options)?,
        lights: lens::lights(&source, options, &mut notices)?,
        ambient: if tree.nodes.iter().any(|node| node.light.is_some()) {
            Vec3::ZERO
        } else {
            DEFAULT_AMBIENT
        },
        images: image::decode(&source, &materials.images)?,
        materials: materials.materials,
        samplers: materials.samplers,
        nodes: tree.nodes,
        solids: tree.solids,
        skins: tree.skins,
        meshes,
        animations,
        notices: notices.finish(),
    };
    solid::check(&source, &scene)?;
    Ok(scene)
}

fn malformed(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Error {
    Error::Malformed {
        path: path.into(),
        place: place.into(),
        problem: problem.into(),
    }
}

/// How messages call a thing: `mesh 3 "roof"`.
fn place(kind: &str, index: usize, name: Option<&String>) -> String {
    match name {
        Some(name) if !name.is_empty() => format!("{kind} {index} {name:?}"),
        _ => format!("{kind} {index}"),
    }
}

/// Collects notices; the same message at further places is only counted.
#[derive(Default)]
struct Notices {
    said: Vec<(Notice, usize)>,
}

impl Notices {
    fn say(&mut self, place: impl Into<String>, message: impl Into<String>) {
        let message = message.into();
        match self.said.iter_mut().find(|(notice, _)| notice.message == message) {
            Some((_, more)) => *more += 1,
            None => self.said.push((
                Notice {
                    place: place.into(),
                    message,
                },
                0,
            )),
        }
    }

    fn finish(self) -> Vec<Notice> {
        let with_count = |(mut notice, more): (Notice, usize)| {
            if more > 0 {
                notice.place += &format!(" and {more} more");
            }
            notice
        };
        self.said.into_iter().map(with_count).collect()
    }
}
