//! From a file to a [`Scene`]: the format is chosen by content where it has a magic, else by the name's ending.
//!
//! glTF (`glTF` or JSON) and PLY (`ply`) announce themselves, whatever the file is called. OBJ and STL do not,
//! so their ending decides; without a known ending, `{` is taken for glTF and `solid` for STL.
//! Limit: [`MAX_FILE_BYTES`] a file.

mod base;
mod gltf;
mod obj;
mod plain;
mod ply;
mod polygon;
mod stl;

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use crate::{Error, Scene};

/// Largest file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 16 << 30;

/// What the reader is told besides the file itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadOptions {
    /// The file's up axis; the scene is turned so that +Y is up.
    pub up: UpAxis,
    /// Metres per unit of the file, finite and above 0.
    pub scale: f64,
}

impl Default for LoadOptions {
    fn default() -> Self {
        Self {
            up: UpAxis::Y,
            scale: 1.0,
        }
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

/// The formats that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Gltf,
    Obj,
    Ply,
    Stl,
}

/// Reads a scene.
///
/// # Errors
/// One of [`Error`], naming the file and the place in it.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let (mut file, size) = open(path).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })?;
    if size == 0 {
        return Err(Error::Empty {
            path: path.into(),
            detail: "the file has 0 bytes".into(),
        });
    }
    if size > MAX_FILE_BYTES {
        return Err(Error::TooLarge {
            path: path.into(),
            place: "file".into(),
            what: format!("its size of {size} bytes"),
            limit: format!("{MAX_FILE_BYTES} bytes"),
        });
    }
    let mut head = [0; 64];
    let length = read_head(&mut file, &mut head).map_err(|source| Error::Io {
        path: path.into(),
        source,
    })?;
    drop(file);
    match format_of(path, &head[..length]) {
        Ok(Format::Gltf) => gltf::load(path, options),
        Ok(Format::Obj) => obj::load(path, options),
        Ok(Format::Ply) => ply::load(path, options),
        Ok(Format::Stl) => stl::load(path, options),
        Err(found) => Err(Error::UnknownFormat {
            path: path.into(),
            found,
        }),
    }
}

/// Opens a regular file and tells its size. A pipe or device could block or never end.
fn open(path: &Path) -> io::Result<(File, u64)> {
    let kind = std::fs::metadata(path)?;
    if kind.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"));
    }
    if !kind.is_file() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "it is not a regular file",
        ));
    }
    Ok((File::open(path)?, kind.len()))
}

/// Reads a whole regular file of up to [`MAX_FILE_BYTES`].
pub(crate) fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    let (file, size) = open(path)?;
    if size > MAX_FILE_BYTES {
        let message = format!("its {size} bytes are over the limit of {MAX_FILE_BYTES}");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    let mut bytes = Vec::new();
    bytes.try_reserve_exact(usize::try_from(size).unwrap_or(usize::MAX))?;
    file.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Fills `head` as far as the file goes.
fn read_head(file: &mut File, head: &mut [u8]) -> io::Result<usize> {
    let mut length = 0;
    while length < head.len() {
        match file.read(&mut head[length..])? {
            0 => break,
            n => length += n,
        }
    }
    Ok(length)
}

/// The format by magic, then by ending, then by a weak sign; or what was found instead.
fn format_of(path: &Path, head: &[u8]) -> Result<Format, String> {
    if head.starts_with(b"glTF") {
        return Ok(Format::Gltf);
    }
    if head.starts_with(b"ply\n") || head.starts_with(b"ply\r") {
        return Ok(Format::Ply);
    }
    let ending = path
        .extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_ascii_lowercase();
    match ending.as_str() {
        "glb" | "gltf" => return Ok(Format::Gltf),
        "obj" => return Ok(Format::Obj),
        "ply" => return Ok(Format::Ply),
        "stl" => return Ok(Format::Stl),
        _ => {}
    }
    let text = head.trim_ascii_start();
    if text.starts_with(b"{") {
        Ok(Format::Gltf)
    } else if text.starts_with(b"solid") {
        Ok(Format::Stl)
    } else {
        let start = head[..head.len().min(8)].escape_ascii();
        Err(match ending.as_str() {
            "" => format!("no ending, content begins with \"{start}\""),
            _ => format!("ending .{ending}, content begins with \"{start}\""),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magic_beats_ending_and_ending_beats_weak_signs() {
        let of = |name: &str, head: &[u8]| format_of(Path::new(name), head);
        assert_eq!(of("a.obj", b"glTF\x02\0\0\0"), Ok(Format::Gltf));
        assert_eq!(of("a.stl", b"ply\r\nformat"), Ok(Format::Ply));
        assert_eq!(of("a.OBJ", b"solid ground\n"), Ok(Format::Obj));
        assert_eq!(of("a.glb", b"junk"), Ok(Format::Gltf));
        assert_eq!(of("a", b" {\"asset\""), Ok(Format::Gltf));
        assert_eq!(of("a.dat", b"solid x"), Ok(Format::Stl));
        let found = of("a.png", b"\x89PNG\r\n\x1a\n").unwrap_err();
        assert!(found.contains(".png") && found.contains("\\x89PNG"), "{found}");
    }
}
