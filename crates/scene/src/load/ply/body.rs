//! The rows after the header, read as f64 number by number.

use super::Problem;
use super::header::{Element, Encoding, Kind, Scalar};
use crate::load::plain::number;

/// A position in the body.
pub(super) struct Body<'a> {
    bytes: &'a [u8],
    position: usize,
    encoding: Encoding,
    /// End of the current line in an ASCII body.
    line_end: usize,
    /// Name and number of the current row, for messages.
    row: (&'a str, usize),
}

impl<'a> Body<'a> {
    pub(super) fn new(bytes: &'a [u8], position: usize, encoding: Encoding) -> Self {
        Self {
            bytes,
            position,
            encoding,
            line_end: position,
            row: ("", 0),
        }
    }

    /// Refuses an element whose rows cannot be in the bytes that are left, however short they are.
    pub(super) fn check_room(&self, element: &Element) -> Result<(), Problem> {
        let least = |kind: Kind| match (kind, self.encoding) {
            // A digit and a space or line end.
            (_, Encoding::Ascii) => 2,
            (Kind::Scalar(scalar) | Kind::List { count: scalar, .. }, _) => scalar.bytes(),
        };
        let row: usize = element.properties.iter().map(|p| least(p.kind)).sum();
        // The last line of a text need not have an end.
        let left = self.bytes.len() - self.position + usize::from(self.encoding == Encoding::Ascii);
        if left / row >= element.count {
            return Ok(());
        }
        let problem = format!(
            "the header promises {} rows, the file has room for {} at most",
            element.count,
            left / row
        );
        Err(Problem {
            place: format!("element {}", element.name),
            problem,
        })
    }

    /// Goes to the next row; in an ASCII body to the next line that is not blank.
    pub(super) fn begin_row(&mut self, element: &'a Element, index: usize) -> Result<(), Problem> {
        self.row = (&element.name, index);
        if self.encoding != Encoding::Ascii {
            return Ok(());
        }
        let rest = &self.bytes[self.line_end..];
        let Some(blank) = rest.iter().position(|b| !b.is_ascii_whitespace()) else {
            self.position = self.bytes.len();
            return Err(self.fail("the file ends here"));
        };
        self.position = self.line_end + blank;
        let line = &rest[blank..];
        let length = line
            .iter()
            .position(|&b| b == b'\n' || b == b'\r')
            .unwrap_or(line.len());
        self.line_end = self.position + length;
        Ok(())
    }

    /// The next number.
    pub(super) fn scalar(&mut self, scalar: Scalar) -> Result<f64, Problem> {
        match self.encoding {
            Encoding::Ascii => self.token(),
            Encoding::LittleEndian => self.binary(scalar, false),
            Encoding::BigEndian => self.binary(scalar, true),
        }
    }

    /// The next list.
    pub(super) fn list(&mut self, count: Scalar, item: Scalar, values: &mut Vec<f64>) -> Result<(), Problem> {
        values.clear();
        for _ in 0..self.list_length(count, item)? {
            values.push(self.scalar(item)?);
        }
        Ok(())
    }

    /// Passes over a property.
    pub(super) fn skip(&mut self, kind: Kind) -> Result<(), Problem> {
        match kind {
            Kind::Scalar(scalar) => self.scalar(scalar).map(|_| ()),
            Kind::List { count, item } => {
                for _ in 0..self.list_length(count, item)? {
                    self.scalar(item)?;
                }
                Ok(())
            }
        }
    }

    fn list_length(&mut self, count: Scalar, item: Scalar) -> Result<usize, Problem> {
        let length = self.scalar(count)?;
        let room = match self.encoding {
            Encoding::Ascii => (self.line_end - self.position).div_ceil(2),
            _ => (self.bytes.len() - self.position) / item.bytes(),
        };
        if length >= 0.0 && length.fract() == 0.0 && length <= room as f64 {
            return Ok(length as usize);
        }
        Err(self.fail(&format!(
            "a list of {length} entries, with room for {room} at most"
        )))
    }

    #[inline]
    fn binary(&mut self, scalar: Scalar, big_endian: bool) -> Result<f64, Problem> {
        let mut raw = [0; 8];
        let size = scalar.bytes();
        let Some(bytes) = self.bytes.get(self.position..self.position + size) else {
            return Err(self.fail("the file ends here"));
        };
        self.position += size;
        raw[..size].copy_from_slice(bytes);
        if big_endian {
            raw[..size].reverse();
        }
        let [a, b, c, d, ..] = raw;
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes([a])),
            Scalar::U8 => f64::from(a),
            Scalar::I16 => f64::from(i16::from_le_bytes([a, b])),
            Scalar::U16 => f64::from(u16::from_le_bytes([a, b])),
            Scalar::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Scalar::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Scalar::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Scalar::F64 => f64::from_le_bytes(raw),
        })
    }

    fn token(&mut self) -> Result<f64, Problem> {
        let line = &self.bytes[self.position..self.line_end];
        let start = line
            .iter()
            .position(|b| !b.is_ascii_whitespace())
            .unwrap_or(line.len());
        let length = line[start..]
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(line.len() - start);
        if length == 0 {
            return Err(self.fail("the line has too few numbers"));
        }
        let token = &line[start..start + length];
        self.position += start + length;
        let value = std::str::from_utf8(token).ok().and_then(number);
        value.ok_or_else(|| self.fail(&format!("\"{}\" is not a number", token.escape_ascii())))
    }

    /// A problem at the current position.
    fn fail(&self, problem: &str) -> Problem {
        let (element, row) = self.row;
        let place = match self.encoding {
            Encoding::Ascii => {
                let line = 1 + self.bytes[..self.position]
                    .iter()
                    .filter(|&&b| b == b'\n')
                    .count();
                format!("line {line} ({element} {row})")
            }
            _ => format!("byte {} ({element} {row})", self.position),
        };
        Problem {
            place,
            problem: problem.into(),
        }
    }
}
