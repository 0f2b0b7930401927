//! PLY: ASCII and binary of both byte orders.
//!
//! Source: G. Turk, *The PLY Polygon File Format* (1994), with the `tristrips` element of the Stanford scans
//! and the usual names for normals, colours and texture coordinates. Read with own code, since a reader has to
//! take numbers as programs write them (`nan`, `.5`), tell where a file breaks, and be neither slowed nor made to
//! allocate by a header that lies: before an element is read its promised count is compared with the bytes that
//! are left. Every PLY number is exact as f64, so one path reads all types. Cost: some 0.15 us a triangle.

mod body;
mod header;

use std::path::Path;

use glam::{DVec3, Vec2, Vec3, Vec4};

use self::body::Body;
use self::header::{Element, Header, Kind};
use super::base::Base;
use super::plain::{Source, counted, linear_from_srgb};
use super::polygon::Triangulator;
use crate::{Error, LoadOptions, Notice, Primitive, Scene};

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let source = Source { path };
    let bytes = source.read()?;
    let (header, start) = header::parse(&bytes).map_err(|e| source.malformed(e.place, e.problem))?;
    let mut body = Body::new(&bytes, start, header.encoding);
    let mut reader = Reader::default();
    for element in &header.elements {
        reader
            .element(element, &mut body)
            .map_err(|e| source.malformed(e.place, e.problem))?;
    }
    reader.finish(source, &header, options)
}

/// Where and how a file breaks the format.
struct Problem {
    place: String,
    problem: String,
}

/// What has been read so far.
#[derive(Default)]
struct Reader {
    /// Positions of the vertices; those of the primitive follow when all are known.
    positions: Vec<DVec3>,
    primitive: Primitive,
    /// Corners of all polygons, one after the other: triangulated at the end, when all vertices are known.
    corners: Vec<u32>,
    /// Number of corners of each polygon.
    sizes: Vec<u32>,
    /// Triangles of strips.
    strips: Vec<[u32; 3]>,
    /// Faces of fewer than three corners.
    points_and_lines: usize,
    vertices_seen: bool,
    notices: Vec<Notice>,
}

/// What a vertex property is for: an index into the row of a vertex.
const ROLES: [(&[&str], usize); 12] = [
    (&["x"], 0),
    (&["y"], 1),
    (&["z"], 2),
    (&["nx"], 3),
    (&["ny"], 4),
    (&["nz"], 5),
    (&["red", "r", "diffuse_red"], 6),
    (&["green", "g", "diffuse_green"], 7),
    (&["blue", "b", "diffuse_blue"], 8),
    (&["alpha", "a", "diffuse_alpha"], 9),
    (&["s", "u", "texture_u", "texture_s"], 10),
    (&["t", "v", "texture_v", "texture_t"], 11),
];

impl Reader {
    fn element<'a>(&mut self, element: &'a Element, body: &mut Body<'a>) -> Result<(), Problem> {
        // Rows of nothing take no bytes: a count of any size must not be looped over.
        if element.properties.is_empty() {
            return Ok(());
        }
        body.check_room(element)?;
        let list = |name: &str| name == "vertex_indices" || name == "vertex_index";
        let indices = element
            .properties
            .iter()
            .position(|p| list(&p.name) && matches!(p.kind, Kind::List { .. }));
        match (element.name.as_str(), indices) {
            ("vertex", _) if !self.vertices_seen => self.vertices(element, body),
            ("face", Some(indices)) => self.lists(element, body, indices, Self::polygon),
            ("tristrips", Some(indices)) => self.lists(element, body, indices, Self::strip),
            (name, _) => {
                let message = format!(
                    "{} rows of an element without meaning here ignored",
                    element.count
                );
                self.notices.push(Notice {
                    place: format!("element {name}"),
                    message,
                });
                self.lists(element, body, usize::MAX, |_, _| {})
            }
        }
    }

    fn vertices<'a>(&mut self, element: &'a Element, body: &mut Body<'a>) -> Result<(), Problem> {
        self.vertices_seen = true;
        let role = |name: &str| {
            ROLES
                .iter()
                .find(|(names, _)| names.contains(&name))
                .map(|&(_, i)| i)
        };
        let roles: Vec<Option<usize>> = element.properties.iter().map(|p| role(&p.name)).collect();
        let has = |range: std::ops::Range<usize>| range.into_iter().all(|i| roles.contains(&Some(i)));
        if !has(0..3) {
            let problem = "there is no x, y and z".into();
            return Err(Problem {
                place: "element vertex".into(),
                problem,
            });
        }
        let (normals, colors, uvs) = (has(3..6), has(6..9), has(10..12));
        let mut row = [0.0; 12];
        row[9] = 1.0;
        for index in 0..element.count {
            body.begin_row(element, index)?;
            for (property, role) in element.properties.iter().zip(&roles) {
                match (property.kind, *role) {
                    (Kind::Scalar(scalar), Some(role)) => {
                        let value = body.scalar(scalar)?;
                        let unit = if (6..10).contains(&role) {
                            scalar.color_unit()
                        } else {
                            1.0
                        };
                        row[role] = value / unit;
                    }
                    (kind, _) => body.skip(kind)?,
                }
            }
            self.positions.push(DVec3::new(row[0], row[1], row[2]));
            let [_, _, _, nx, ny, nz, r, g, b, a, u, v] = row.map(|value| value as f32);
            let primitive = &mut self.primitive;
            if normals {
                primitive.normals.push(Vec3::new(nx, ny, nz));
            }
            if colors {
                let [r, g, b] = [r, g, b].map(linear_from_srgb);
                primitive.colors.push(Vec4::new(r, g, b, a));
            }
            if uvs {
                primitive.uvs.push(Vec2::new(u, 1.0 - v));
            }
        }
        Ok(())
    }

    /// Reads rows of which one list matters.
    fn lists<'a>(
        &mut self,
        element: &'a Element,
        body: &mut Body<'a>,
        wanted: usize,
        mut take: impl FnMut(&mut Self, &[f64]),
    ) -> Result<(), Problem> {
        let mut values = Vec::new();
        for index in 0..element.count {
            body.begin_row(element, index)?;
            for (i, property) in element.properties.iter().enumerate() {
                match property.kind {
                    Kind::List { count, item } if i == wanted => body.list(count, item, &mut values)?,
                    kind => body.skip(kind)?,
                }
            }
            take(self, &values);
        }
        Ok(())
    }

    fn polygon(&mut self, values: &[f64]) {
        self.corners.extend(values.iter().map(|&v| index(v)));
        self.sizes.push(values.len() as u32);
        self.points_and_lines += usize::from(values.len() < 3);
    }

    /// A strip turns its winding over with each triangle; a negative index starts the next strip.
    fn strip(&mut self, values: &[f64]) {
        for strip in values.split(|&v| v < 0.0) {
            for (i, corners) in strip.windows(3).enumerate() {
                let [a, b, c] = [corners[0], corners[1], corners[2]].map(index);
                self.strips.push(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }

    fn finish(mut self, source: Source, header: &Header, options: &LoadOptions) -> Result<Scene, Error> {
        let count = self.positions.len();
        let base = Base::of(self.positions.iter().copied());
        self.primitive.positions = self.positions.iter().map(|&p| base.local(p)).collect();
        self.positions = Vec::new();
        let outside = |i: &u32| *i as usize >= count;
        let out_of_range = |place: String| {
            source.malformed(
                place,
                format!("a vertex index is not below {count}, their number"),
            )
        };
        let mut triangulator = Triangulator::default();
        let mut rest = &self.corners[..];
        let positions = &self.primitive.positions;
        let triangles = &mut self.primitive.triangles;
        for (face, &size) in self.sizes.iter().enumerate() {
            let (corners, after) = rest.split_at(size as usize);
            rest = after;
            if corners.iter().any(outside) {
                return Err(out_of_range(format!("face {face}")));
            }
            let position = |i: usize| positions[corners[i] as usize];
            triangulator.triangulate(corners.len(), position, |t| triangles.push(t.map(|i| corners[i])));
        }
        if let Some(triangle) = self.strips.iter().position(|t| t.iter().any(outside)) {
            return Err(out_of_range(format!("tristrips, triangle {triangle}")));
        }
        triangles.append(&mut self.strips);
        if triangles.is_empty() {
            return Err(source.empty(format!("{count} vertices, {} faces", self.sizes.len())));
        }
        let skipped = counted(
            self.points_and_lines,
            "element face",
            "faces of fewer than three corners skipped",
        );
        let mut scene = source.scene(vec![self.primitive], base, options);
        scene.notices = self.notices;
        scene.notices.extend(skipped);
        scene
            .notices
            .extend(header.texture_file.iter().map(|name| Notice {
                place: "header".into(),
                message: format!("texture {name:?} named in a comment ignored"),
            }));
        Ok(scene)
    }
}

/// A vertex index; what is none becomes one that is out of range.
fn index(value: f64) -> u32 {
    if value >= 0.0 { value as u32 } else { u32::MAX }
}
