//! Checked reading of accessors (glTF 2.0 §3.6.2): dense, strided, sparse and zero-filled.
//!
//! Nothing is believed before it is compared with the bytes that exist: an accessor costs memory in proportion
//! to its data, except zero-filled ones, which are limited to [`MAX_ZERO_FILLED`] elements.

use std::borrow::Cow;

use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::{Index, Value};

use super::source::{Source, span};
use super::{MAX_VERTICES, place};
use crate::Error;

/// Most elements of an accessor that has no buffer view.
const MAX_ZERO_FILLED: u64 = 1 << 22;

/// The elements of one accessor.
pub(super) struct Elements<'a> {
    /// Where it lies, for messages.
    pub(super) place: String,
    /// Number of elements.
    pub(super) count: usize,
    /// Components an element.
    pub(super) components: usize,
    /// Storage of a component.
    pub(super) kind: ComponentType,
    /// Whether integers mean fractions.
    pub(super) normalized: bool,
    /// At least `(count - 1) * stride` bytes and one element.
    bytes: Cow<'a, [u8]>,
    stride: usize,
}

impl Source<'_> {
    /// The accessor with that index, if it holds one of the element types `shapes`.
    pub(super) fn elements(
        &self,
        index: Index<Accessor>,
        shapes: &[Type],
        referrer: &str,
    ) -> Result<Elements<'_>, Error> {
        let i = self.index(index, self.root.accessors.len(), "accessor", referrer)?;
        let accessor = &self.root.accessors[i];
        let place = format!("{referrer}, {}", place("accessor", i, accessor.name.as_ref()));
        let kind = self.valid(&accessor.component_type, "componentType", &place)?.0;
        let shape = self.valid(&accessor.type_, "type", &place)?;
        if !shapes.contains(&shape) {
            return Err(self.malformed(place, format!("it holds {shape:?} where {shapes:?} is needed")));
        }
        let count = accessor.count.0;
        if count > MAX_VERTICES as u64 {
            return Err(self.too_large(place, format!("its count of {count}"), MAX_VERTICES.to_string()));
        }
        let components = shape.multiplicity();
        let size = components * kind.size();
        let (bytes, stride) = self.dense(accessor, size, &place)?;
        let mut elements = Elements {
            place,
            count: count as usize,
            components,
            kind,
            normalized: accessor.normalized,
            bytes,
            stride,
        };
        if accessor.sparse.is_some() {
            self.apply_sparse(accessor, size, &mut elements)?;
        }
        Ok(elements)
    }

    /// The bytes before sparse values are put in, and their stride.
    fn dense(&self, accessor: &Accessor, size: usize, place: &str) -> Result<(Cow<'_, [u8]>, usize), Error> {
        let count = accessor.count.0;
        let Some(view_index) = accessor.buffer_view else {
            if count > MAX_ZERO_FILLED {
                let what = format!("its count of {count} without a bufferView");
                return Err(self.too_large(place, what, MAX_ZERO_FILLED.to_string()));
            }
            return Ok((Cow::Owned(vec![0; count as usize * size]), size));
        };
        let view = self.view(view_index, place)?;
        let stride = self.root.buffer_views[view_index.value()]
            .byte_stride
            .map_or(size, |stride| stride.0);
        if stride < size || stride > 1 << 16 {
            let problem = format!("byteStride is {stride}, an element has {size} bytes");
            return Err(self.malformed(place, problem));
        }
        if count == 0 {
            return Ok((Cow::Borrowed(&[]), stride));
        }
        let start = accessor.byte_offset.unwrap_or_default().0;
        let length = (count - 1) * stride as u64 + size as u64;
        let bytes = span(view, start, length).ok_or_else(|| {
            let (v, has) = (view_index.value(), view.len());
            let problem = format!("{length} bytes from byte {start} on are needed, bufferView {v} has {has}");
            self.malformed(place, problem)
        })?;
        Ok((Cow::Borrowed(bytes), stride))
    }

    /// Replaces the elements that the accessor's sparse part names.
    fn apply_sparse(
        &self,
        accessor: &Accessor,
        size: usize,
        elements: &mut Elements<'_>,
    ) -> Result<(), Error> {
        let Some(sparse) = &accessor.sparse else {
            return Ok(());
        };
        let place = format!("{}, sparse", elements.place);
        let kind = self
            .valid(&sparse.indices.component_type, "componentType", &place)?
            .0;
        let count = sparse.count.0;
        let part = |view, start: u64, size: usize| -> Result<&[u8], Error> {
            let bytes = self.view(view, &place)?;
            let needed = count
                .checked_mul(size as u64)
                .and_then(|length| span(bytes, start, length));
            needed.ok_or_else(|| {
                let problem = format!("{count} entries of {size} bytes do not fit into its bufferView");
                self.malformed(&place, problem)
            })
        };
        let indices = part(
            sparse.indices.buffer_view,
            sparse.indices.byte_offset.0,
            kind.size(),
        )?;
        let values = part(sparse.values.buffer_view, sparse.values.byte_offset.0, size)?;
        let indices = indices
            .chunks_exact(kind.size())
            .map(|bytes| integer(kind, bytes) as usize);
        let stride = elements.stride;
        let bytes = elements.bytes.to_mut();
        for (entry, (i, value)) in indices.zip(values.chunks_exact(size)).enumerate() {
            if i >= elements.count {
                let problem = format!("entry {entry} replaces element {i} of {}", elements.count);
                return Err(self.malformed(place, problem));
            }
            bytes[i * stride..][..size].copy_from_slice(value);
        }
        Ok(())
    }

    /// The accessor index in a JSON value of an extension.
    pub(super) fn accessor_index(&self, value: &Value, place: &str) -> Result<Index<Accessor>, Error> {
        let index = value.as_u64().and_then(|i| u32::try_from(i).ok());
        index
            .map(Index::new)
            .ok_or_else(|| self.malformed(place, format!("{value} is not an accessor index")))
    }
}

impl Elements<'_> {
    fn component(&self, element: usize, component: usize) -> &[u8] {
        &self.bytes[element * self.stride + component * self.kind.size()..][..self.kind.size()]
    }

    /// Element `i` as numbers; normalised integers become fractions. Components beyond the element's own stay 0.
    pub(super) fn floats<const N: usize>(&self, i: usize) -> [f32; N] {
        let mut out = [0.0; N];
        for (c, value) in out.iter_mut().enumerate().take(self.components) {
            *value = number(self.kind, self.normalized, self.component(i, c));
        }
        out
    }

    /// Component `c` of element `i` as an unsigned integer. The kind must be an unsigned one.
    pub(super) fn integer(&self, i: usize, c: usize) -> u32 {
        integer(self.kind, self.component(i, c))
    }

    /// Whether components are unsigned integers.
    pub(super) fn is_unsigned(&self) -> bool {
        matches!(
            self.kind,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        )
    }

    /// All elements as `map` of their numbers, or those that `pick` names.
    pub(super) fn gather<const N: usize, T>(
        &self,
        pick: Option<&[u32]>,
        map: impl Fn([f32; N]) -> T,
    ) -> Vec<T> {
        match pick {
            Some(pick) => pick.iter().map(|&i| map(self.floats(i as usize))).collect(),
            None => (0..self.count).map(|i| map(self.floats(i))).collect(),
        }
    }
}

/// A component as a number (glTF 2.0 §3.11 for normalised integers).
fn number(kind: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, unit) = match (kind, bytes) {
        (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (ComponentType::I8, &[a]) => (f32::from(a as i8), 127.0),
        (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32767.0),
        (ComponentType::U8, _) => (integer(kind, bytes) as f32, 255.0),
        (ComponentType::U16, _) => (integer(kind, bytes) as f32, 65535.0),
        _ => (integer(kind, bytes) as f32, u32::MAX as f32),
    };
    if normalized {
        (value / unit).max(-1.0)
    } else {
        value
    }
}

/// A component of unsigned kind.
fn integer(kind: ComponentType, bytes: &[u8]) -> u32 {
    match (kind, bytes) {
        (ComponentType::U8, &[a]) => u32::from(a),
        (ComponentType::U16, &[a, b]) => u32::from(u16::from_le_bytes([a, b])),
        (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
        _ => 0,
    }
}
