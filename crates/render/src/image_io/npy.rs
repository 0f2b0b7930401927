//! NumPy arrays, format 1.0: one layer of a film, little endian, C order.
//!
//! Shapes: `(height, width)` for scalars, `(height, width, 3)` for colour and normal, `(height, width, 2)` for
//! barycentrics and motion, `(height, width, 6)` for costs. Types: `<f4`, `<u4` for ids.

use std::io::{self, Write};
use std::path::Path;

use glam::Vec4;

use super::file;
use super::picture::{Picture, SizeCheck};
use crate::film::LayerKind;
use crate::{Error, Film, Result};

const MAGIC: &[u8] = b"\x93NUMPY";

/// Writes one layer of a film.
///
/// # Errors
/// [`Error::MissingLayer`] if the film does not hold it, [`Error::Write`] for what the system says.
pub fn write_npy(path: &Path, film: &Film, layer: LayerKind) -> Result<()> {
    check(film, layer)?;
    file::write(path, |sink| encode(sink, film, layer))
}

/// Writes the same to anything that takes bytes, for instance standard output.
///
/// # Errors
/// As [`write_npy`]; the path in the error is `-`.
pub fn encode_npy(sink: impl Write, film: &Film, layer: LayerKind) -> Result<()> {
    check(film, layer)?;
    encode(sink, film, layer).map_err(|source| Error::write(Path::new("-"), source))
}

fn check(film: &Film, layer: LayerKind) -> Result<()> {
    if film.holds(layer) {
        Ok(())
    } else {
        Err(Error::MissingLayer { layer: layer.name() })
    }
}

fn encode(mut sink: impl Write, film: &Film, layer: LayerKind) -> io::Result<()> {
    let mut put = |kind: &str, channels: usize, values: &mut dyn Iterator<Item = [u8; 4]>| {
        sink.write_all(&header(kind, film.width(), film.height(), channels))?;
        let mut block = Vec::with_capacity(BLOCK);
        for value in values {
            block.extend_from_slice(&value);
            if block.len() == BLOCK {
                sink.write_all(&block)?;
                block.clear();
            }
        }
        sink.write_all(&block)?;
        sink.flush()
    };
    match layer {
        LayerKind::Color => put(
            "<f4",
            3,
            &mut film.color.iter().flat_map(|c| c.to_array().map(f32::to_le_bytes)),
        ),
        LayerKind::Alpha => put("<f4", 1, &mut film.alpha.iter().map(|a| a.to_le_bytes())),
        LayerKind::Depth => put("<f4", 1, &mut film.depth.iter().map(|d| d.to_le_bytes())),
        LayerKind::Distance => put("<f4", 1, &mut film.distance.iter().map(|d| d.to_le_bytes())),
        LayerKind::Normal => put(
            "<f4",
            3,
            &mut film
                .normal
                .iter()
                .flat_map(|n| n.to_array().map(f32::to_le_bytes)),
        ),
        LayerKind::Object => put("<u4", 1, &mut film.object.iter().map(|id| id.to_le_bytes())),
        LayerKind::Prim => put("<u4", 1, &mut film.prim.iter().map(|id| id.to_le_bytes())),
        LayerKind::Bary => put(
            "<f4",
            2,
            &mut film.bary.iter().flat_map(|b| b.to_array().map(f32::to_le_bytes)),
        ),
        LayerKind::Motion => put(
            "<f4",
            2,
            &mut film
                .motion
                .iter()
                .flat_map(|m| m.to_array().map(f32::to_le_bytes)),
        ),
        LayerKind::Cost => put(
            "<f4",
            6,
            &mut film.cost.iter().flat_map(|c| c.to_array().map(f32::to_le_bytes)),
        ),
    }
}

/// Bytes gathered before they go to the sink.
const BLOCK: usize = 1 << 16;

/// Magic, version, length and dictionary, padded so that the data starts at a multiple of 64.
fn header(kind: &str, width: u32, height: u32, channels: usize) -> Vec<u8> {
    let shape = match channels {
        1 => format!("({height}, {width})"),
        _ => format!("({height}, {width}, {channels})"),
    };
    let mut dictionary = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    let fixed = MAGIC.len() + 4;
    let padding = (fixed + dictionary.len() + 1).next_multiple_of(64) - (fixed + dictionary.len() + 1);
    dictionary.extend(std::iter::repeat_n(' ', padding));
    dictionary.push('\n');
    [
        MAGIC,
        &[1, 0],
        &(dictionary.len() as u16).to_le_bytes(),
        dictionary.as_bytes(),
    ]
    .concat()
}

/// Whether these bytes start like a NumPy array.
pub(super) fn is_npy(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// The element types that are read.
#[derive(Clone, Copy)]
enum Element {
    Unsigned,
    Signed,
    Float,
}

/// An image of one to four channels.
pub(super) fn decode(check: SizeCheck, bytes: &[u8]) -> Result<Picture> {
    let path = check.path;
    let fail = |problem: &str| Error::malformed(path, format_args!("NPY: {problem}"));
    let (dictionary, data) = split(bytes).ok_or_else(|| fail("the header is cut off"))?;
    if entry(dictionary, "fortran_order") != Some("False") {
        return Err(fail("only C order is read"));
    }
    let kind = entry(dictionary, "descr").ok_or_else(|| fail("no element type"))?;
    let (element, size, big) =
        element(kind).ok_or_else(|| fail(&format!("element type {kind} is not read")))?;
    let shape = entry(dictionary, "shape")
        .and_then(dimensions)
        .ok_or_else(|| fail("no shape"))?;
    let (height, width, channels) = match *shape {
        [height, width] => (height, width, 1),
        [height, width, channels @ 1..=4] => (height, width, channels as usize),
        _ => return Err(fail("the shape is neither (h, w) nor (h, w, 1..4)")),
    };
    let pixels = check.pixels(width, height)?;
    if data.len() != pixels * channels * size {
        return Err(fail(&format!(
            "{} bytes of data for a shape of {:?} {kind}",
            data.len(),
            shape
        )));
    }
    let srgb = matches!((element, size), (Element::Unsigned, 1));
    let scale = if srgb { 1.0 / 255.0 } else { 1.0 };
    let pixel = |bytes: &[u8]| {
        let mut values = [0.0; 4];
        for (value, bytes) in values.iter_mut().zip(bytes.chunks_exact(size)) {
            *value = (number(bytes, element, big) * scale) as f32;
        }
        let [r, g, b, a] = values;
        match channels {
            1 => Vec4::new(r, r, r, 1.0),
            2 | 3 => Vec4::new(r, g, b, 1.0),
            _ => Vec4::new(r, g, b, a),
        }
    };
    Ok(Picture {
        width,
        height,
        pixels: data.chunks_exact(channels * size).map(pixel).collect(),
        srgb,
    })
}

/// Dictionary and data; versions 2 and 3 have a longer length field.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (length, rest) = match bytes.get(MAGIC.len())? {
        1 => (
            usize::from(u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?)),
            bytes.get(10..)?,
        ),
        _ => (
            u32::from_le_bytes(bytes.get(8..12)?.try_into().ok()?) as usize,
            bytes.get(12..)?,
        ),
    };
    let (dictionary, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(dictionary).ok()?, data))
}

/// The value of a key: a quoted word, a parenthesised list or a bare word, without quotes or parentheses.
fn entry<'a>(dictionary: &'a str, key: &str) -> Option<&'a str> {
    let start = dictionary.find(&format!("'{key}'"))? + key.len() + 2;
    let value = dictionary[start..].trim_start().strip_prefix(':')?.trim_start();
    match value.chars().next()? {
        '\'' => value[1..].split('\'').next(),
        '(' => value[1..].split(')').next(),
        _ => value.split([',', '}']).next().map(str::trim),
    }
}

fn dimensions(shape: &str) -> Option<Vec<u32>> {
    shape
        .split(',')
        .map(str::trim)
        .filter(|d| !d.is_empty())
        .map(|d| d.parse().ok())
        .collect()
}

/// Kind, bytes and whether big endian.
fn element(kind: &str) -> Option<(Element, usize, bool)> {
    let big = kind.starts_with('>');
    let (element, size) = match kind.trim_start_matches(['<', '>', '|', '=']) {
        "b1" | "u1" => (Element::Unsigned, 1),
        "u2" => (Element::Unsigned, 2),
        "u4" => (Element::Unsigned, 4),
        "i1" => (Element::Signed, 1),
        "i2" => (Element::Signed, 2),
        "i4" => (Element::Signed, 4),
        "f4" => (Element::Float, 4),
        "f8" => (Element::Float, 8),
        _ => return None,
    };
    Some((element, size, big))
}

fn number(bytes: &[u8], element: Element, big: bool) -> f64 {
    let mut little = [0; 8];
    little[..bytes.len()].copy_from_slice(bytes);
    if big {
        little[..bytes.len()].reverse();
    }
    let bits = u64::from_le_bytes(little);
    match (element, bytes.len()) {
        (Element::Unsigned, _) => bits as f64,
        (Element::Signed, size) => {
            let unused = 64 - 8 * size as u32;
            ((bits << unused) as i64 >> unused) as f64
        }
        (Element::Float, 4) => f64::from(f32::from_bits(bits as u32)),
        (Element::Float, _) => f64::from_bits(bits),
    }
}
