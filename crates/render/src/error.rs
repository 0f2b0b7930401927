//! Errors of the library: each names the file or the value it is about.

use std::path::{Path, PathBuf};

/// Why something could not be rendered, read, written or compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene could not be read.
    #[error(transparent)]
    Scene(#[from] rayward_scene::Error),
    /// A file could not be opened or read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file could not be written. Nothing was left at its place that was not there before.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file, or `-` for standard output.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// An image file breaks its format's rules or uses a part of it that is not read here.
    #[error("{}: {problem}", path.display())]
    MalformedImage {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where if that is known.
        problem: String,
    },
    /// The file's name and content fit no image format that is known.
    #[error("{}: not an image format that is known here; known are {known}", path.display())]
    UnknownImageFormat {
        /// The file.
        path: PathBuf,
        /// The formats that are known for this use.
        known: &'static str,
    },
    /// An image has no pixels, too many of them, or data of another length.
    #[error("an image of {width}x{height} {problem}")]
    ImageSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// An image file has more pixels than are to be read.
    #[error("{}: an image of {width}x{height} is over the limit of {limit} pixels", path.display())]
    ImageTooLarge {
        /// The file.
        path: PathBuf,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// The most pixels.
        limit: u64,
    },
    /// Two images that should be compared differ in size.
    #[error("the images differ in size: {a_width}x{a_height} and {b_width}x{b_height}")]
    SizeMismatch {
        /// Width of the first image in pixels.
        a_width: u32,
        /// Height of the first image in pixels.
        a_height: u32,
        /// Width of the second image in pixels.
        b_width: u32,
        /// Height of the second image in pixels.
        b_height: u32,
    },
    /// Not all parts of a picture are there.
    #[error("{missing} of the {of} parts of the picture {} missing, {first}/{of} first", if *missing == 1 { "is" } else { "are" })]
    MissingParts {
        /// How many are not.
        missing: u32,
        /// How many there should be.
        of: u32,
        /// The first that is not there, counted from 1.
        first: u32,
    },
    /// A layer was asked for that the film does not hold.
    #[error("the film holds no {layer} layer")]
    MissingLayer {
        /// The layer's name.
        layer: &'static str,
    },
    /// Samples of a pixel cannot be shaded as one in such a frame.
    #[error("antialiasing by coverage does not go together with {with}")]
    Antialias {
        /// What else was asked for.
        with: &'static str,
    },
    /// The camera has no usable picture: a lens or an axis that is not finite, or out of range.
    #[error("camera {name:?}: {problem}")]
    Camera {
        /// Name of the camera, possibly empty.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

/// Results of the library.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(crate) fn read(path: &Path, source: std::io::Error) -> Self {
        Self::Read {
            path: path.into(),
            source,
        }
    }

    pub(crate) fn write(path: &Path, source: impl Into<std::io::Error>) -> Self {
        Self::Write {
            path: path.into(),
            source: source.into(),
        }
    }

    pub(crate) fn malformed(path: &Path, problem: impl std::fmt::Display) -> Self {
        Self::MalformedImage {
            path: path.into(),
            problem: problem.to_string(),
        }
    }
}

/// The most pixels an image may have.
pub(crate) const MAX_PIXELS: u64 = 1 << 30;

/// Checks that an image has pixels and not more than memory can be meant to hold.
pub(crate) fn check_size(width: u32, height: u32) -> Result<usize> {
    let pixels = u64::from(width) * u64::from(height);
    match pixels {
        0 => Err(Error::ImageSize {
            width,
            height,
            problem: "has no pixels",
        }),
        1..=MAX_PIXELS => Ok(pixels as usize),
        _ => Err(Error::ImageSize {
            width,
            height,
            problem: "is over the limit of 2^30 pixels",
        }),
    }
}
