//! Files as wholes: read at once, written beside their place and renamed.
//!
//! A process that is told to end does not unwind, so nothing would remove the files it has begun. They are therefore
//! listed, and [`discard_unfinished`] removes them from whatever thread the end comes to.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

use crate::{Error, Result};

/// Files that are begun and not yet in their place.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// While this lives no file is begun or put in its place: whoever tries waits.
#[derive(Debug)]
pub struct Discarded {
    _lock: MutexGuard<'static, Vec<PathBuf>>,
}

/// Removes every file that the process has begun to write, for a process that is about to end. A file is then there
/// as a whole or not at all. What is returned should live until the end.
pub fn discard_unfinished() -> Discarded {
    let mut files = unfinished();
    for path in files.drain(..) {
        // If it is gone already, that is what is wanted.
        let _ = fs::remove_file(path);
    }
    Discarded { _lock: files }
}

/// An entry of the list, taken off when it goes.
struct Listed(PathBuf);

impl Drop for Listed {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.0);
    }
}

/// A temporary file that is listed as unfinished. Fields go in this order: first the file, then its entry.
struct Begun {
    file: NamedTempFile,
    _listed: Listed,
}

impl Begun {
    fn new(builder: &tempfile::Builder<'_, '_>, folder: &Path) -> io::Result<Self> {
        // Made and listed under one lock, so that it is discarded too or not begun at all.
        let mut files = unfinished();
        let file = builder.tempfile_in(folder)?;
        let path = file.path().to_path_buf();
        files.push(path.clone());
        let _listed = Listed(path);
        Ok(Self { file, _listed })
    }

    fn put_in_place(self, target: &Path) -> io::Result<()> {
        let lock = unfinished();
        let put = self.file.persist(target).map_err(|e| e.error);
        drop(lock);
        put.map(|_| ())
    }
}

/// What encoders write to.
pub(super) trait Sink: Write + Seek {}
impl<T: Write + Seek> Sink for T {}

/// Fills the file at `path` by `encode`. An existing file is replaced only when all is written, and
/// keeps its permissions; symbolic links are followed, devices and pipes are written directly.
pub(super) fn write(path: &Path, encode: impl FnOnce(&mut dyn Sink) -> io::Result<()>) -> Result<()> {
    write_inner(path, encode).map_err(|source| Error::write(path, source))
}

fn write_inner(path: &Path, encode: impl FnOnce(&mut dyn Sink) -> io::Result<()>) -> io::Result<()> {
    let resolved = fs::canonicalize(path);
    let target = resolved.as_deref().unwrap_or(path);
    let mut kept = None;
    match fs::metadata(target) {
        Ok(found) if found.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(found) if !found.is_file() => {
            // A pipe cannot seek, so the whole is made first.
            let mut bytes = io::Cursor::new(Vec::new());
            encode(&mut bytes)?;
            return File::options()
                .write(true)
                .open(target)?
                .write_all(bytes.get_ref());
        }
        Ok(found) if found.permissions().readonly() => return Err(io::ErrorKind::PermissionDenied.into()),
        Ok(found) => kept = Some(found.permissions()),
        Err(_) => {}
    }
    let begun = begin(target, kept)?;
    let mut buffered = BufWriter::with_capacity(1 << 16, begun.file.as_file());
    encode(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    begun.put_in_place(target)
}

/// Writes a file of these bytes. An existing file is replaced only when all is written.
///
/// # Errors
/// [`Error::Write`](crate::Error::Write), naming the file.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    write(path, |sink| sink.write_all(bytes))
}

/// As [`write`], for a file that another process fills: `make` gets the path of an empty file of the same ending.
pub(super) fn write_by_path(path: &Path, make: impl FnOnce(&Path) -> io::Result<()>) -> Result<()> {
    let write = || {
        let resolved = fs::canonicalize(path);
        let target = resolved.as_deref().unwrap_or(path);
        let kept = match fs::metadata(target) {
            Ok(found) if !found.is_file() => return Err(io::Error::other("it is not a regular file")),
            Ok(found) if found.permissions().readonly() => {
                return Err(io::ErrorKind::PermissionDenied.into());
            }
            found => found.ok().map(|found| found.permissions()),
        };
        let begun = begin(target, kept)?;
        make(begun.file.path())?;
        begun.put_in_place(target)
    };
    write().map_err(|source| Error::write(path, source))
}

/// An empty temporary file beside its target, with the permissions that the target has or will have.
fn begin(target: &Path, kept: Option<fs::Permissions>) -> io::Result<Begun> {
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let ending = target.extension().map(|ending| {
        let mut suffix = std::ffi::OsString::from(".");
        suffix.push(ending);
        suffix
    });
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rayward-");
    if let Some(suffix) = &ending {
        builder.suffix(suffix);
    }
    #[cfg(unix)]
    {
        // The mode of any new file, reduced by the umask, instead of the private mode of temporary ones.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let begun = Begun::new(&builder, folder)?;
    if let Some(permissions) = kept {
        begun.file.as_file().set_permissions(permissions)?;
    }
    Ok(begun)
}

/// The whole content of a regular file; a pipe or a device may never end.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let regular = |found: fs::Metadata| {
        if found.is_dir() || found.is_file() {
            Ok(())
        } else {
            Err(io::Error::other("it is not a regular file"))
        }
    };
    fs::metadata(path)
        .and_then(regular)
        .and_then(|()| fs::read(path))
        .map_err(|source| Error::read(path, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        let failing = |sink: &mut dyn Sink| {
            sink.write_all(&[7; 100_000])?;
            Err(io::Error::other("the disk is full"))
        };
        assert!(matches!(write(&path, failing), Err(Error::Write { .. })));
        assert!(!path.exists());
        write(&path, |sink| sink.write_all(b"whole")).unwrap();
        assert!(matches!(write(&path, failing), Err(Error::Write { .. })));
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        assert_eq!(
            fs::read_dir(folder.path()).unwrap().count(),
            1,
            "no temporary file is left"
        );
    }
}
