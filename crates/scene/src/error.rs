//! Errors and notices of the loaders: each names the file and the place in it.

use std::path::PathBuf;

/// Why a scene could not be read. Nothing is returned by halves: a loader gives a whole scene or one of these.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file could not be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that the scene refers to (a buffer, a texture, a material library) could not be read.
    #[error("{}: {place}: cannot read {}: {source}", path.display(), target.display())]
    Reference {
        /// The scene file.
        path: PathBuf,
        /// What refers to it, for instance `image 3 "bark"`.
        place: String,
        /// The file referred to.
        target: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file name has no known ending and the content no known magic.
    #[error("{}: not a scene format that is read here ({found}); known are .glb .gltf .obj .ply .stl", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// What was found instead.
        found: String,
    },
    /// The content breaks its format's rules.
    #[error("{}: {place}: {problem}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, byte offset or object (for instance `mesh 3 "roof", primitive 0, accessor 7`).
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// The file is valid but requires something that is not supported.
    #[error("{}: requires {what}, which is not supported", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The extension or feature by name.
        what: String,
    },
    /// The file asks for more than the stated limit.
    #[error("{}: {place}: {what} is over the limit of {limit}", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What is too large, with its size.
        what: String,
        /// The limit.
        limit: String,
    },
    /// There is nothing to show.
    #[error("{}: no triangles in it ({detail})", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// What was there instead.
        detail: String,
    },
    /// A built-in scene of that name does not exist.
    #[error("no built-in scene is called {name:?}; there are: {known}")]
    UnknownBuiltin {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
}

/// Something a loader skipped or repaired, to be told once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// Where in the file.
    pub place: String,
    /// What was done about it.
    pub message: String,
}

impl std::fmt::Display for Notice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}
