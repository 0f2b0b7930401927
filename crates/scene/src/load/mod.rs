//! From a file to a [`Scene`]: the format is chosen by content where it has a magic, else by the name's ending.

mod gltf;
mod obj;
mod ply;
mod stl;

use std::path::Path;

use crate::{Error, Scene};

/// What the reader is told besides the file itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadOptions {
    /// The file's up axis; the scene is turned so that +Y is up.
    pub up: UpAxis,
    /// Metres per unit of the file.
    pub scale: f64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self { up: UpAxis::Y, scale: 1.0 }
    }
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpAxis {
    /// +Y, as in glTF.
    #[default]
    Y,
    /// +Z, as in CAD and surveying.
    Z,
}

/// Reads a scene.
///
/// # Errors
/// One of [`Error`], naming the file and the place in it.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    match ending.as_str() {
        "glb" | "gltf" => gltf::load(path, options),
        "obj" => obj::load(path, options),
        "ply" => ply::load(path, options),
        "stl" => stl::load(path, options),
        _ => Err(Error::UnknownFormat { path: path.into(), found: format!("ending {ending:?}") }),
    }
}
