//! Errors of the measurements.

/// Why something could not be measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene could not be read, or a camera not used.
    #[error(transparent)]
    Rayward(#[from] rayward::Error),
    /// A name is neither a built-in scene, nor a mesh of the scenes folder, nor a file.
    #[error("{name}: neither a built-in scene nor a file; built-in are {known}")]
    UnknownScene {
        /// What was asked for.
        name: String,
        /// The built-in scenes, and the meshes of the scenes folder.
        known: String,
    },
    /// A scene cannot be measured.
    #[error("{name}: {problem}")]
    Scene {
        /// The scene.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The library named by `RAYWARD_EMBREE` cannot be used, or a library of Embree fails.
    #[error("Embree, {library}: {problem}")]
    Embree {
        /// The file.
        library: String,
        /// What is wrong with it.
        problem: String,
    },
    /// Worker threads could not be started.
    #[error("cannot start threads: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
    /// Worker threads could not be kept to processors of their own.
    #[error("cannot pin threads: {0}")]
    Pin(&'static str),
}

impl From<rayward::scene::Error> for Error {
    fn from(error: rayward::scene::Error) -> Self {
        Self::Rayward(error.into())
    }
}

/// Result of a measurement.
pub type Result<T> = std::result::Result<T, Error>;
