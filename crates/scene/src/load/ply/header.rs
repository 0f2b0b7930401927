//! The header: what elements a file has, and how their rows are written.

use super::Problem;

/// How the body is written.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A number type.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in a binary body.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value that stands for full intensity in a colour.
    pub(super) fn color_unit(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32767.0,
            Self::U16 => 65535.0,
            Self::I32 => 2_147_483_647.0,
            Self::U32 => 4_294_967_295.0,
            Self::F32 | Self::F64 => 1.0,
        }
    }
}

/// One number, or a list with its length before it.
#[derive(Clone, Copy)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// A texture that `MeshLab` names in a comment.
    pub(super) texture_file: Option<String>,
}

/// Reads the header; also gives the position of the body's first byte.
pub(super) fn parse(bytes: &[u8]) -> Result<(Header, usize), Problem> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut texture_file = None;
    let mut position = 0;
    for number in 1.. {
        let fail = |problem: &str| Problem {
            place: format!("line {number}"),
            problem: problem.into(),
        };
        let Some((line, next)) = next_line(bytes, position) else {
            return Err(fail("the file ends before end_header"));
        };
        position = next;
        let line = String::from_utf8_lossy(line);
        let mut tokens = line.split_ascii_whitespace();
        let keyword = tokens.next().unwrap_or("");
        let words: Vec<&str> = tokens.collect();
        match (keyword, &words[..]) {
            ("ply", _) if number == 1 => {}
            _ if number == 1 => return Err(fail("does not begin with \"ply\"")),
            ("format", [name, _version]) => {
                encoding = Some(match *name {
                    "ascii" => Encoding::Ascii,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(fail("unknown format")),
                });
            }
            ("comment", ["TextureFile", name, ..]) => texture_file = Some((*name).to_owned()),
            ("comment" | "obj_info" | "", _) => {}
            ("element", [name, count]) => {
                let count = count.parse().map_err(|_| fail("the count is not a number"))?;
                elements.push(Element {
                    name: (*name).to_owned(),
                    count,
                    properties: Vec::new(),
                });
            }
            ("property", words) => {
                let element = elements
                    .last_mut()
                    .ok_or_else(|| fail("a property before any element"))?;
                element
                    .properties
                    .push(property(words).ok_or_else(|| fail("unknown property type"))?);
            }
            ("end_header", _) => break,
            _ => return Err(fail("not a line of a PLY header")),
        }
    }
    let encoding = encoding.ok_or_else(|| Problem {
        place: "header".into(),
        problem: "there is no format line".into(),
    })?;
    Ok((
        Header {
            encoding,
            elements,
            texture_file,
        },
        position,
    ))
}

fn property(words: &[&str]) -> Option<Property> {
    let (kind, name) = match words {
        ["list", count, item, name] => (
            Kind::List {
                count: Scalar::parse(count)?,
                item: Scalar::parse(item)?,
            },
            name,
        ),
        [scalar, name] => (Kind::Scalar(Scalar::parse(scalar)?), name),
        _ => return None,
    };
    Some(Property {
        name: (*name).to_owned(),
        kind,
    })
}

/// The line at `start` without its end (LF, CR LF or CR), and where the next begins.
fn next_line(bytes: &[u8], start: usize) -> Option<(&[u8], usize)> {
    let rest = bytes.get(start..)?;
    let end = rest.iter().position(|&b| b == b'\n' || b == b'\r')?;
    let width = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
    Some((&rest[..end], start + end + width))
}
