//! Files as wholes: read at once, written beside their place and renamed.
//!
//! A process that is told to end does not unwind, so nothing would remove the files it has begun. They are therefore
//! listed, and [`discard_unfinished`] removes them from whatever thread the end comes to. One that is killed leaves them;
//! while it lives it holds a lock on each, so that [`remove_abandoned`] knows those that nobody works at.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

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

/// What names of temporary files begin with; [`RANDOM`] letters and digits follow, then the ending of the target.
const PREFIX: &str = ".rayward-";

/// Letters and digits that tell temporary files apart.
const RANDOM: usize = 6;

/// How old an empty file is before it counts as abandoned: it may have been made just now and not be locked yet.
const ABANDONED_EMPTY: Duration = Duration::from_secs(60);

/// Removes what killed processes have left unfinished in a folder, and tells how many files that were: files that are named
/// as those of this library with this ending, and locked by nobody. Where files cannot be locked nothing is removed.
///
/// # Errors
/// [`Error::Read`] if the folder cannot be listed, [`Error::Write`] if a file cannot be removed.
pub fn remove_abandoned(folder: &Path, ending: &str) -> Result<usize> {
    let entries = fs::read_dir(folder).map_err(|source| Error::read(folder, source))?;
    let mut removed = 0;
    for entry in entries {
        let entry = entry.map_err(|source| Error::read(folder, source))?;
        if !is_temporary(&entry.file_name().to_string_lossy(), ending) || !is_abandoned(&entry) {
            continue;
        }
        match fs::remove_file(entry.path()) {
            Ok(()) => removed += 1,
            // Another process that goes on here was faster.
            Err(error) if error.kind() == io::ErrorKind::NotFound => (),
            Err(source) => return Err(Error::write(&entry.path(), source)),
        }
    }
    Ok(removed)
}

fn is_temporary(name: &str, ending: &str) -> bool {
    let random = || name.strip_prefix(PREFIX)?.strip_suffix(ending)?.strip_suffix('.');
    random().is_some_and(|text| text.len() == RANDOM && text.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Whether nobody works at a temporary file.
#[cfg(unix)]
fn is_abandoned(entry: &fs::DirEntry) -> bool {
    let Ok(found) = entry.metadata() else {
        return false;
    };
    // What is written to is locked, so only an empty file can be younger than its lock.
    let young = || {
        let age = found.modified().ok().and_then(|at| at.elapsed().ok());
        age.is_none_or(|age| age < ABANDONED_EMPTY)
    };
    found.is_file()
        && !(found.len() == 0 && young())
        && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok())
}

/// Locks keep others from writing there, hence none are held.
#[cfg(not(unix))]
fn is_abandoned(_entry: &fs::DirEntry) -> bool {
    false
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
        // Where there are no locks, others leave the file alone.
        #[cfg(unix)]
        let _ = file.as_file().try_lock();
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
    builder.prefix(PREFIX).rand_bytes(RANDOM);
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

    #[cfg(unix)]
    #[test]
    fn only_what_is_certainly_abandoned_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let removed = || remove_abandoned(folder.path(), "png").unwrap();
        let file = |name: &str, content: &str| fs::write(folder.path().join(name), content).unwrap();
        let begun = begin(&folder.path().join("a.png"), None).unwrap();
        begun.file.as_file().write_all(b"so far").unwrap();
        for kept in [
            "frame.png",
            ".rayward-a1B2c3.exr",
            ".rayward-notes.png",
            ".rayward-a1-2c3.png",
            "a.rayward-a1B2c3.png",
        ] {
            file(kept, "of others");
        }
        file(".rayward-begun1.png", "");
        fs::create_dir(folder.path().join(".rayward-folder.png")).unwrap();
        assert_eq!(removed(), 0);
        file(".rayward-a1B2c3.png", "left by a process that was killed");
        let empty = File::options()
            .write(true)
            .open(folder.path().join(".rayward-begun1.png"))
            .unwrap();
        let long_ago = std::time::SystemTime::now() - 2 * ABANDONED_EMPTY;
        empty.set_modified(long_ago).unwrap();
        assert_eq!(removed(), 2);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 7);
        begun.put_in_place(&folder.path().join("a.png")).unwrap();
        assert_eq!(fs::read(folder.path().join("a.png")).unwrap(), b"so far");
    }
}
