//! STL, binary and ASCII.
//!
//! A binary file is 80 bytes of anything, a count and 50 bytes a facet; its size tells it from ASCII, since many
//! binary files begin with `solid` too. Corners with the same bits become one vertex. Each solid of an ASCII file
//! is a primitive. Facet normals are not kept: they are those of the triangles, and shading falls back to these.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;

use super::plain::{Source, counted, number};
use super::polygon::Triangulator;
use crate::{Error, LoadOptions, Notice, Primitive, Scene};

const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let source = Source { path };
    let bytes = source.read()?;
    let mut notices = Vec::new();
    let primitives = if is_ascii(&bytes) {
        read_ascii(source, &String::from_utf8_lossy(&bytes))?
    } else {
        vec![read_binary(source, &bytes, &mut notices)?]
    };
    let primitives: Vec<Primitive> = primitives
        .into_iter()
        .filter(|p| !p.triangles.is_empty())
        .collect();
    if primitives.is_empty() {
        return Err(source.empty("0 facets"));
    }
    let mut scene = source.scene(primitives, options);
    scene.notices = notices;
    Ok(scene)
}

fn is_ascii(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let solid = start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid");
    let exact_binary = facet_count(bytes).is_some_and(|n| bytes.len() == HEADER_BYTES + n * FACET_BYTES);
    solid && !exact_binary && !bytes.iter().take(4096).any(|&b| b == 0)
}

fn facet_count(bytes: &[u8]) -> Option<usize> {
    bytes
        .get(80..84)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
}

fn read_binary(source: Source, bytes: &[u8], notices: &mut Vec<Notice>) -> Result<Primitive, Error> {
    let Some(count) = facet_count(bytes) else {
        let found = format!(
            "{} bytes are less than a header, and it does not begin with \"solid\"",
            bytes.len()
        );
        return Err(source.malformed("byte 0", found));
    };
    let body = &bytes[HEADER_BYTES..];
    if body.len() / FACET_BYTES < count {
        let problem = format!(
            "{count} facets promised, the file ends in facet {}",
            body.len() / FACET_BYTES
        );
        return Err(source.malformed(format!("byte {}", bytes.len()), problem));
    }
    notices.extend(counted(
        body.len() - count * FACET_BYTES,
        "end of file",
        "bytes after the last facet ignored",
    ));
    let mut solid = Solid::default();
    for facet in body.chunks_exact(FACET_BYTES).take(count) {
        let float = |at: usize| f32::from_le_bytes([facet[at], facet[at + 1], facet[at + 2], facet[at + 3]]);
        let corner = |at: usize| Vec3::new(float(at), float(at + 4), float(at + 8));
        let triangle = [12, 24, 36].map(|at| solid.vertex(corner(at)));
        solid.primitive.triangles.push(triangle);
    }
    Ok(solid.primitive)
}

fn read_ascii(source: Source, text: &str) -> Result<Vec<Primitive>, Error> {
    let mut solids = Vec::new();
    let mut solid = Solid::default();
    let mut triangulator = Triangulator::default();
    let mut facet: Option<Vec<Vec3>> = None;
    let mut last_line = 0;
    for (index, line) in text.lines().enumerate() {
        last_line = index + 1;
        let place = || format!("line {last_line}");
        let mut tokens = line.split_ascii_whitespace();
        let Some(keyword) = tokens.next() else { continue };
        match (keyword.to_ascii_lowercase().as_str(), &mut facet) {
            ("facet", None) => facet = Some(Vec::new()),
            ("vertex", Some(corners)) => {
                let mut next = || tokens.next().and_then(number).map(|n| n as f32);
                let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                    return Err(source.malformed(place(), "a vertex needs three numbers"));
                };
                corners.push(Vec3::new(x, y, z));
            }
            ("endfacet", Some(corners)) => {
                if corners.len() < 3 {
                    let problem = format!("a facet of {} vertices", corners.len());
                    return Err(source.malformed(place(), problem));
                }
                solid.add_polygon(corners, &mut triangulator);
                facet = None;
            }
            ("solid" | "endsolid", None) => {
                solids.push(std::mem::take(&mut solid).primitive);
            }
            ("outer" | "endloop", Some(_)) => {}
            (other, _) => {
                let problem = format!("{other:?} is out of place here");
                return Err(source.malformed(place(), problem));
            }
        }
    }
    if facet.is_some() {
        return Err(source.malformed(format!("line {last_line}"), "the file ends inside a facet"));
    }
    solids.push(solid.primitive);
    Ok(solids)
}

/// A primitive whose corners are welded as they come.
#[derive(Default)]
struct Solid {
    primitive: Primitive,
    vertices: HashMap<[u32; 3], u32>,
}

impl Solid {
    fn vertex(&mut self, position: Vec3) -> u32 {
        // Adding zero makes the two zeros one.
        let key = (position + Vec3::ZERO).to_array().map(f32::to_bits);
        *self.vertices.entry(key).or_insert_with(|| {
            self.primitive.positions.push(position);
            (self.primitive.positions.len() - 1) as u32
        })
    }

    fn add_polygon(&mut self, corners: &[Vec3], triangulator: &mut Triangulator) {
        triangulator.triangulate(
            corners.len(),
            |i| corners[i],
            |triangle| {
                let triangle = triangle.map(|i| self.vertex(corners[i]));
                self.primitive.triangles.push(triangle);
            },
        );
    }
}
