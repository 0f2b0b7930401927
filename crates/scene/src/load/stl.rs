//! STL, binary and ASCII.
//!
//! A binary file is 80 bytes of anything, a count and 50 bytes a facet; its size tells it from ASCII, since many
//! binary files begin with `solid` too. Corners with the same bits become one vertex. Each solid of an ASCII file
//! is a primitive. Facet normals are not kept: they are those of the triangles, and shading falls back to these.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::base::Base;
use super::plain::{Source, counted, number};
use super::polygon::Triangulator;
use crate::{Error, LoadOptions, Notice, Primitive, Scene};

const HEADER_BYTES: usize = 84;
const FACET_BYTES: usize = 50;

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let source = Source { path };
    let bytes = source.read()?;
    let mut notices = Vec::new();
    let solids = if is_ascii(&bytes) {
        read_ascii(source, &String::from_utf8_lossy(&bytes))?
    } else {
        vec![read_binary(source, &bytes, &mut notices)?]
    };
    let base = Base::of(solids.iter().flat_map(|solid| &solid.corners).copied());
    let primitives: Vec<Primitive> = solids
        .iter()
        .filter(|solid| !solid.facets.is_empty())
        .map(|solid| solid.primitive(base))
        .collect();
    if primitives.is_empty() {
        return Err(source.empty("0 facets"));
    }
    let mut scene = source.scene(primitives, base, options);
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

fn read_binary(source: Source, bytes: &[u8], notices: &mut Vec<Notice>) -> Result<Solid, Error> {
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
        let corner = |at: usize| Vec3::new(float(at), float(at + 4), float(at + 8)).as_dvec3();
        solid.corners.extend([12, 24, 36].map(corner));
        solid.facets.push(3);
    }
    Ok(solid)
}

fn read_ascii(source: Source, text: &str) -> Result<Vec<Solid>, Error> {
    let mut solids = Vec::new();
    let mut solid = Solid::default();
    let mut facet: Option<u32> = None;
    let mut last_line = 0;
    for (index, line) in text.lines().enumerate() {
        last_line = index + 1;
        let place = || format!("line {last_line}");
        let mut tokens = line.split_ascii_whitespace();
        let Some(keyword) = tokens.next() else { continue };
        match (keyword.to_ascii_lowercase().as_str(), &mut facet) {
            ("facet", None) => facet = Some(0),
            ("vertex", Some(corners)) => {
                let mut next = || tokens.next().and_then(number);
                let (Some(x), Some(y), Some(z)) = (next(), next(), next()) else {
                    return Err(source.malformed(place(), "a vertex needs three numbers"));
                };
                solid.corners.push(DVec3::new(x, y, z));
                *corners += 1;
            }
            ("endfacet", Some(corners)) => {
                if *corners < 3 {
                    let problem = format!("a facet of {corners} vertices");
                    return Err(source.malformed(place(), problem));
                }
                solid.facets.push(*corners);
                facet = None;
            }
            ("solid" | "endsolid", None) => {
                solids.push(std::mem::take(&mut solid));
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
    solids.push(solid);
    Ok(solids)
}

/// The facets of a solid as they come.
#[derive(Default)]
struct Solid {
    /// Corners of all facets, one after the other.
    corners: Vec<DVec3>,
    /// Number of corners of each facet.
    facets: Vec<u32>,
}

impl Solid {
    /// Its triangles, with corners at the same place made one vertex.
    fn primitive(&self, base: Base) -> Primitive {
        let mut primitive = Primitive::default();
        let mut vertices: HashMap<[u32; 3], u32> = HashMap::new();
        let mut triangulator = Triangulator::default();
        let mut rest = &self.corners[..];
        for &count in &self.facets {
            let (corners, after) = rest.split_at(count as usize);
            rest = after;
            let corner = |i: usize| base.local(corners[i]);
            triangulator.triangulate(corners.len(), corner, |triangle| {
                let triangle = triangle.map(|i| {
                    // Adding zero makes the two zeros one.
                    let key = (corner(i) + Vec3::ZERO).to_array().map(f32::to_bits);
                    *vertices.entry(key).or_insert_with(|| {
                        primitive.positions.push(corner(i));
                        (primitive.positions.len() - 1) as u32
                    })
                });
                primitive.triangles.push(triangle);
            });
        }
        primitive
    }
}
