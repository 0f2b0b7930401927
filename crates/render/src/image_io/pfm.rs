//! Portable float maps: three header lines, then f32 rows from the bottom up; the sign of the scale tells the
//! byte order.

use glam::Vec4;

use super::picture::{Picture, SizeCheck};
use crate::{Error, Result};

/// Whether these bytes start like a portable float map.
pub(super) fn is_pfm(bytes: &[u8]) -> bool {
    matches!(bytes, [b'P', b'F' | b'f', space, ..] if space.is_ascii_whitespace())
}

pub(super) fn decode(check: SizeCheck, bytes: &[u8]) -> Result<Picture> {
    let path = check.path;
    let fail = |problem: &str| Error::malformed(path, format_args!("PFM: {problem}"));
    let mut rest = bytes;
    let mut word = || {
        let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let length = rest[start..].iter().take(64).position(u8::is_ascii_whitespace)?;
        let word = std::str::from_utf8(&rest[start..start + length]).ok()?;
        // One white space character ends the header's last word; what follows is data.
        rest = &rest[start + length + 1..];
        Some(word)
    };
    let mut header = || {
        Some((
            word()?,
            word()?.parse().ok()?,
            word()?.parse().ok()?,
            word()?.parse::<f32>().ok()?,
        ))
    };
    let (kind, width, height, scale) =
        header().ok_or_else(|| fail("the header is cut off or not in numbers"))?;
    let channels = if kind == "PF" { 3 } else { 1 };
    let pixels = check.pixels(width, height)?;
    if rest.len() != pixels * channels * 4 {
        return Err(fail(&format!(
            "{} bytes of data for {width}x{height}x{channels} floats",
            rest.len()
        )));
    }
    let value = |bytes: &[u8]| {
        let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
        if scale < 0.0 {
            f32::from_le_bytes(bytes)
        } else {
            f32::from_be_bytes(bytes)
        }
    };
    let pixel = |bytes: &[u8]| {
        let at = |c: usize| value(&bytes[4 * c.min(channels - 1)..]);
        Vec4::new(at(0), at(1), at(2), 1.0)
    };
    let rows = rest.chunks_exact(width as usize * channels * 4).rev();
    let pixels = rows
        .flat_map(|row| row.chunks_exact(channels * 4).map(pixel))
        .collect();
    Ok(Picture {
        width,
        height,
        pixels,
        srgb: false,
    })
}
