//! Cameras and lights by scene name, from a JSON file beside the scenes.
use std::path::Path;

use crate::Error;

/// One scene's camera and lights.
#[derive(Clone, Debug)]
pub struct CameraEntry {}

/// Reads a camera file.
///
/// # Errors
/// As [`Error`].
pub fn read_camera_file(path: &Path) -> Result<Vec<CameraEntry>, Error> {
    Err(Error::UnknownFormat { path: path.into(), found: String::new() })
}
