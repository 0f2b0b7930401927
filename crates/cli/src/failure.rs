//! How the program ends when it does not end well.

use std::process::ExitCode;

use rayward::{Error, scene};

use crate::report;

/// Exit codes, as documented in `rayward --help`; those of signals are made where these are caught.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Code {
    /// The system refused something: an output could not be written, threads not started.
    Runtime = 1,
    /// The command line makes no sense.
    Usage = 2,
    /// An input cannot be read, breaks its format or needs what is not supported.
    Input = 3,
    /// An input or a picture is over a limit.
    Limit = 4,
    /// Two pictures differ by more than is tolerated.
    Beyond = 5,
}

impl From<Code> for ExitCode {
    fn from(code: Code) -> Self {
        Self::from(code as u8)
    }
}

/// An exit code and what to say about it.
#[derive(Debug)]
pub(crate) struct Failure {
    /// What the process exits with.
    pub(crate) code: Code,
    /// What is wrong and where; nothing is said if it is empty.
    message: String,
}

impl Failure {
    /// A failure told in one line.
    pub(crate) fn new(code: Code, message: impl std::fmt::Display) -> Self {
        Self {
            code,
            message: report::clean(&message.to_string()),
        }
    }

    /// A failure told in several lines of our own making.
    pub(crate) fn lines(code: Code, message: &str) -> Self {
        Self {
            code,
            message: message.into(),
        }
    }

    /// A failure without words: the reader of our output has gone, or the result was already told.
    pub(crate) fn silent(code: Code) -> Self {
        Self::lines(code, "")
    }

    /// Tells it on standard error.
    pub(crate) fn say(&self) {
        if !self.message.is_empty() {
            report::note(&format!("rayward: error: {}", self.message));
        }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        let code = match &error {
            Error::Scene(error) => return Self::new(code_of_scene(error), error),
            Error::Read { .. }
            | Error::MalformedImage { .. }
            | Error::UnknownImageFormat { .. }
            | Error::MissingParts { .. }
            | Error::MissingLayer { .. }
            | Error::Camera { .. } => Code::Input,
            Error::ImageSize { .. } | Error::ImageTooLarge { .. } => Code::Limit,
            Error::SizeMismatch { .. } => Code::Beyond,
            _ => Code::Runtime,
        };
        Self::new(code, error)
    }
}

impl From<scene::Error> for Failure {
    fn from(error: scene::Error) -> Self {
        Self::new(code_of_scene(&error), error)
    }
}

fn code_of_scene(error: &scene::Error) -> Code {
    match error {
        scene::Error::TooLarge { .. } => Code::Limit,
        scene::Error::UnknownBuiltin { .. } => Code::Usage,
        _ => Code::Input,
    }
}
