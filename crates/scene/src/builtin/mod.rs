//! Procedural scenes, seeded and ours.
use crate::{Error, Scene};

/// Names of all built-in scenes.
pub const NAMES: &[&str] = &[];

/// Makes a built-in scene.
///
/// # Errors
/// [`Error::UnknownBuiltin`].
pub fn build(name: &str) -> Result<Scene, Error> {
    Err(Error::UnknownBuiltin { name: name.into(), known: NAMES.join(", ") })
}
