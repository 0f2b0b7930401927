//! Procedural scenes, seeded and ours.
mod blob;
mod courtyard;
mod random;
mod shapes;
mod stage;
mod statue;
use crate::{Error, Scene};

/// Names of all built-in scenes.
pub const NAMES: &[&str] = &[
    "courtyard",
    "blob-1k",
    "blob-4k",
    "blob-16k",
    "blob-69k",
    "collide",
];

/// Makes a built-in scene.
///
/// # Errors
/// [`Error::UnknownBuiltin`].
pub fn build(name: &str) -> Result<Scene, Error> {
    Ok(match name {
        "blob-1k" => blob::blob(name, 7),
        "blob-4k" => blob::blob(name, 14),
        "blob-16k" => blob::blob(name, 28),
        "blob-69k" => blob::blob(name, 59),
        "collide" => blob::collide(),
        "courtyard" => courtyard::courtyard(),
        _ => {
            return Err(Error::UnknownBuiltin {
                name: name.into(),
                known: NAMES.join(", "),
            });
        }
    })
}
