//! A parsed glTF with its buffers: everything a part of the loader reads through, every index checked.
//!
//! Buffers are loaded eagerly (the BIN chunk is borrowed, data URIs are decoded, files are read); a buffer that
//! the file leaves undefined is an error only when something reads it. URIs: `data:` and percent-encoded
//! relative paths; absolute paths and other schemes are refused.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use base64::Engine;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, buffer};

use super::container::Container;
use super::{malformed, place};
use crate::Error;
use crate::load::{MAX_FILE_BYTES, read_file};

/// The parsed file and its binary data.
pub(super) struct Source<'a> {
    pub(super) path: &'a Path,
    pub(super) root: Root,
    pub(super) light_radii: Vec<f32>,
    pub(super) solids: Vec<serde_json::Value>,
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// Bytes read from URIs so far: a file may name one large file many times.
    bytes_read: AtomicU64,
}

impl<'a> Source<'a> {
    /// Loads the buffers of a parsed file.
    pub(super) fn new(path: &'a Path, container: Container<'a>) -> Result<Self, Error> {
        let Container {
            root,
            light_radii,
            solids,
            bin,
        } = container;
        let mut source = Self {
            path,
            root,
            light_radii,
            solids,
            buffers: Vec::new(),
            bytes_read: AtomicU64::new(0),
        };
        for i in 0..source.root.buffers.len() {
            let buffer = source.load_buffer(i, bin)?;
            source.buffers.push(buffer);
        }
        Ok(source)
    }

    fn load_buffer(&self, i: usize, bin: Option<&'a [u8]>) -> Result<Option<Cow<'a, [u8]>>, Error> {
        let buffer = &self.root.buffers[i];
        let place = place("buffer", i, buffer.name.as_ref());
        let bytes = match (&buffer.uri, bin) {
            (Some(uri), _) => Cow::Owned(self.read_uri(uri, &place)?),
            (None, Some(bin)) if i == 0 => Cow::Borrowed(bin),
            (None, _) => return Ok(None),
        };
        let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        if bytes.len() < length {
            let problem = format!("byteLength is {length}, there are {} bytes", bytes.len());
            return Err(self.malformed(place, problem));
        }
        Ok(Some(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(length);
                Cow::Owned(bytes)
            }
        }))
    }

    /// An [`Error::Malformed`] in this file.
    pub(super) fn malformed(&self, place: impl Into<String>, problem: impl Into<String>) -> Error {
        malformed(self.path, place, problem)
    }

    /// An [`Error::TooLarge`] in this file.
    pub(super) fn too_large(&self, place: impl Into<String>, what: String, limit: String) -> Error {
        Error::TooLarge {
            path: self.path.into(),
            place: place.into(),
            what,
            limit,
        }
    }

    /// The index as a number if it is below `len`, the number of things of that `kind`.
    pub(super) fn index<T>(
        &self,
        index: Index<T>,
        len: usize,
        kind: &str,
        place: &str,
    ) -> Result<usize, Error> {
        let i = index.value();
        if i < len {
            return Ok(i);
        }
        Err(self.malformed(place, format!("{kind} {i} does not exist, there are {len}")))
    }

    /// The value of an enumeration, if it is one that glTF knows.
    pub(super) fn valid<T: Copy>(&self, value: &Checked<T>, what: &str, place: &str) -> Result<T, Error> {
        match value {
            Checked::Valid(value) => Ok(*value),
            Checked::Invalid => Err(self.malformed(place, format!("unknown value of \"{what}\""))),
        }
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: Index<buffer::View>, place: &str) -> Result<&[u8], Error> {
        let i = self.index(view, self.root.buffer_views.len(), "bufferView", place)?;
        let view = &self.root.buffer_views[i];
        let place = format!("{place}, bufferView {i}");
        let b = self.index(view.buffer, self.buffers.len(), "buffer", &place)?;
        let Some(bytes) = &self.buffers[b] else {
            return Err(self.malformed(place, format!("buffer {b} has neither a uri nor a BIN chunk")));
        };
        let (start, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        span(bytes, start, length).ok_or_else(|| {
            let problem = format!(
                "bytes {start} + {length} are beyond the {} of buffer {b}",
                bytes.len()
            );
            self.malformed(place, problem)
        })
    }

    /// The content behind a URI.
    pub(super) fn read_uri(&self, uri: &str, place: &str) -> Result<Vec<u8>, Error> {
        if let Some(data) = uri.strip_prefix("data:") {
            return decode_data_uri(data).map_err(|problem| self.malformed(place, problem));
        }
        let target = self.resolve(uri, place)?;
        let bytes = read_file(&target).map_err(|source| Error::Reference {
            path: self.path.into(),
            place: place.into(),
            target,
            source,
        })?;
        let total = self.bytes_read.fetch_add(bytes.len() as u64, Ordering::Relaxed) + bytes.len() as u64;
        if total > MAX_FILE_BYTES {
            let what = format!("the sum of {total} bytes in referenced files");
            return Err(self.too_large(place, what, MAX_FILE_BYTES.to_string()));
        }
        Ok(bytes)
    }

    /// The file that a relative URI means.
    fn resolve(&self, uri: &str, place: &str) -> Result<PathBuf, Error> {
        let scheme = uri.split_once(':').map(|(scheme, _)| scheme).filter(|s| {
            s.starts_with(|c: char| c.is_ascii_alphabetic())
                && s.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
        });
        let relative = percent_encoding::percent_decode_str(uri).decode_utf8();
        let problem = match (scheme, &relative) {
            (Some(_), _) => "has a scheme other than data:",
            (_, Err(_)) => "is not UTF-8 after percent decoding",
            (_, Ok(name)) if name.contains('\0') => "contains a zero byte",
            (_, Ok(name)) if name.is_empty() => "is empty",
            (_, Ok(name)) if name.starts_with(['/', '\\']) || Path::new(name.as_ref()).has_root() => {
                "is an absolute path"
            }
            (_, Ok(name)) => {
                let folder = self.path.parent().unwrap_or(Path::new(""));
                return Ok(folder.join(name.as_ref()));
            }
        };
        let shown: String = uri.chars().take(80).collect();
        Err(self.malformed(
            place,
            format!("uri {shown:?} {problem}; only data: and relative paths are read"),
        ))
    }
}

/// `bytes[start..start + length]`, if that exists.
pub(super) fn span(bytes: &[u8], start: u64, length: u64) -> Option<&[u8]> {
    let end = usize::try_from(start.checked_add(length)?).ok()?;
    bytes.get(usize::try_from(start).ok()?..end)
}

/// Decodes what follows `data:`.
fn decode_data_uri(data: &str) -> Result<Vec<u8>, String> {
    let (header, payload) = data.split_once(',').ok_or("the data: URI has no comma")?;
    if !header.ends_with(";base64") {
        return Ok(percent_encoding::percent_decode_str(payload).collect());
    }
    // Writers disagree on padding, so both forms are taken.
    let config = base64::engine::GeneralPurposeConfig::new()
        .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent);
    let engine = base64::engine::GeneralPurpose::new(&base64::alphabet::STANDARD, config);
    engine
        .decode(payload)
        .map_err(|e| format!("the data: URI is not base64: {e}"))
}
