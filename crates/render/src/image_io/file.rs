//! Files as wholes: read at once, written beside their place and renamed.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

use crate::{Error, Result};

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
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".rayward-");
    #[cfg(unix)]
    {
        // The mode of any new file, reduced by the umask, instead of the private mode of temporary ones.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut buffered = BufWriter::with_capacity(1 << 16, builder.tempfile_in(folder)?);
    if let Some(permissions) = kept {
        buffered.get_ref().as_file().set_permissions(permissions)?;
    }
    encode(&mut buffered)?;
    buffered
        .into_inner()
        .map_err(io::IntoInnerError::into_error)?
        .persist(target)
        .map_err(|e| e.error)?;
    Ok(())
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
