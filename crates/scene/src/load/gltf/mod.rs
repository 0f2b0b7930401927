use std::path::Path;

use crate::{Error, LoadOptions, Scene};

pub(super) fn load(path: &Path, _options: &LoadOptions) -> Result<Scene, Error> {
    Err(Error::UnknownFormat { path: path.into(), found: "not read yet".into() })
}
