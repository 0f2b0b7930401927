//! Wavefront OBJ with its MTL material libraries.
//!
//! Source: the *Advanced Visualizer* manual, appendix B1 (object files) and the MTL description of 1995. Read:
//! `v` (with colours), `vt`, `vn`, `f`, `usemtl`, `mtllib`; polygons of any shape; negative indices; indices to
//! vertices that come later. All faces of one material form one primitive, in which corners with the same three
//! indices are one vertex. Read with own code, since errors have to name a line and concave polygons to keep
//! their shape. Cost: some 1 us a triangle, most of it for numbers and for finding equal corners.
//!
//! Texture coordinates have their origin at the bottom left in the file and at the top left in a [`Scene`].

mod mtl;

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::{DVec3, Vec2, Vec3, Vec4};

use self::mtl::Library;
use super::base::Base;
use super::plain::{Source, counted, linear_from_srgb, number};
use super::polygon::Triangulator;
use crate::{Error, LoadOptions, Notice, Primitive, Scene};

pub(super) fn load(path: &Path, options: &LoadOptions) -> Result<Scene, Error> {
    let source = Source { path };
    let bytes = source.read()?;
    let text = decode(source, &bytes)?;
    let mut file = ObjFile::default();
    for (line, text) in logical_lines(&text) {
        file.statement(text.trim(), line)
            .map_err(|p| source.malformed(format!("line {line}"), p))?;
    }
    let mut notices = file.notices();
    let mut library = Library::default();
    for names in &file.libraries {
        library.read(source, names, &mut notices)?;
    }

    let base = Base::of(file.positions.iter().copied());
    let mut primitives = Vec::new();
    let mut scene = source.scene(Vec::new(), base, options);
    for (name, faces) in file.faces_by_material() {
        let mut primitive = file.primitive(source, base, &faces)?;
        if primitive.triangles.is_empty() {
            continue;
        }
        if let Some(name) = name {
            primitive.material = library.material(source, name, &mut scene, &mut notices)?;
        }
        primitives.push(primitive);
    }
    if primitives.is_empty() {
        return Err(source.empty(format!(
            "{} vertices, {} faces",
            file.positions.len(),
            file.faces.len()
        )));
    }
    notices.extend(library.notices());
    scene.meshes[0].primitives = primitives;
    scene.notices = notices;
    Ok(scene)
}

/// The text; names in other encodings than UTF-8 lose their special characters.
fn decode<'a>(source: Source, bytes: &'a [u8]) -> Result<Cow<'a, str>, Error> {
    if bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF") {
        return Err(source.malformed("byte 0", "the text is UTF-16; it has to be UTF-8 or ASCII"));
    }
    if let Some(zero) = bytes.iter().position(|&b| b == 0) {
        return Err(source.malformed(format!("byte {zero}"), "not text: there is a zero byte"));
    }
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    Ok(String::from_utf8_lossy(bytes))
}

/// Lines with their numbers; a backslash at the end of a line joins it with the next one.
fn logical_lines(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.lines().enumerate();
    std::iter::from_fn(move || {
        let (index, line) = lines.next()?;
        let Some(start) = line.trim_end().strip_suffix('\\') else {
            return Some((index + 1, line.into()));
        };
        let mut joined = start.to_owned();
        for (_, line) in lines.by_ref() {
            joined.push(' ');
            match line.trim_end().strip_suffix('\\') {
                Some(start) => joined.push_str(start),
                None => {
                    joined.push_str(line);
                    break;
                }
            }
        }
        Some((index + 1, joined.into()))
    })
}

/// The words of a statement, up to a comment.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_ascii_whitespace().take_while(|w| !w.starts_with('#'))
}

/// One corner of a face: position, texture coordinate and normal, counted from 0; [`ABSENT`] where not given.
type Corner = [u32; 3];
const ABSENT: u32 = u32::MAX;

/// One `f` statement: a range of the corners.
struct Face {
    first: u32,
    count: u32,
    line: u32,
    /// Index into the names of `usemtl`, or [`ABSENT`].
    material: u32,
}

/// The content of an OBJ file, as it is.
#[derive(Default)]
struct ObjFile {
    positions: Vec<DVec3>,
    /// Linear colours; as many as positions once one was given.
    colors: Vec<Vec4>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    corners: Vec<Corner>,
    faces: Vec<Face>,
    materials: Vec<String>,
    material: Option<u32>,
    libraries: Vec<String>,
    /// Faces of fewer than three corners.
    short_faces: usize,
    /// Statements without meaning here, and how many of each.
    skipped: BTreeMap<String, usize>,
}

impl ObjFile {
    fn statement(&mut self, text: &str, line: usize) -> Result<(), String> {
        let (keyword, rest) = text.split_once([' ', '\t']).unwrap_or((text, ""));
        match keyword {
            "v" => self.vertex(rest)?,
            "vt" => {
                let [u, v, _] = numbers(rest, 1)?.map(|n| n as f32);
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }
            "vn" => self.normals.push(DVec3::from_array(numbers(rest, 3)?).as_vec3()),
            "f" | "fo" => self.face(rest, line)?,
            "usemtl" => {
                let name = rest.trim();
                let known = self.materials.iter().position(|m| m == name);
                let index = known.unwrap_or_else(|| {
                    self.materials.push(name.to_owned());
                    self.materials.len() - 1
                });
                self.material = Some(index as u32);
            }
            "mtllib" => self.libraries.push(rest.trim().to_owned()),
            "" | "o" | "g" | "s" | "mg" | "lod" => {}
            comment if comment.starts_with('#') => {}
            other => *self.skipped.entry(other.chars().take(32).collect()).or_default() += 1,
        }
        Ok(())
    }

    fn vertex(&mut self, text: &str) -> Result<(), String> {
        self.positions.push(DVec3::from_array(numbers(text, 3)?));
        // After the position: nothing, a weight, a colour, or both.
        let extra = words(text).count().saturating_sub(3);
        if extra >= 3 {
            let mut color = [1.0; 3];
            for (component, word) in color.iter_mut().zip(words(text).skip(extra.min(4))) {
                *component = float(word)?;
            }
            let [r, g, b] = color.map(linear_from_srgb);
            self.colors.resize(self.positions.len() - 1, Vec4::ONE);
            self.colors.push(Vec4::new(r, g, b, 1.0));
        }
        Ok(())
    }

    fn face(&mut self, text: &str, line: usize) -> Result<(), String> {
        let first = self.corners.len();
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for word in words(text) {
            let mut corner = [ABSENT; 3];
            for (slot, part) in word.split('/').enumerate() {
                if part.is_empty() && slot > 0 {
                    continue;
                }
                let index = corner
                    .get_mut(slot)
                    .ok_or_else(|| format!("{word:?} has more than three indices"))?;
                *index = absolute(part, counts[slot])?;
            }
            self.corners.push(corner);
        }
        let count = self.corners.len() - first;
        if count < 3 {
            self.corners.truncate(first);
            self.short_faces += 1;
            return Ok(());
        }
        self.faces.push(Face {
            first: first as u32,
            count: count as u32,
            line: line as u32,
            material: self.material.unwrap_or(ABSENT),
        });
        Ok(())
    }

    fn notices(&self) -> Vec<Notice> {
        let skipped = self.skipped.iter();
        let skipped =
            skipped.filter_map(|(name, &n)| counted(n, "file", &format!("statements {name:?} skipped")));
        counted(
            self.short_faces,
            "file",
            "faces of fewer than three corners skipped",
        )
        .into_iter()
        .chain(skipped)
        .collect()
    }

    /// Faces of each material that is used, in order of first use.
    fn faces_by_material(&self) -> Vec<(Option<&str>, Vec<&Face>)> {
        let mut groups: Vec<(u32, Vec<&Face>)> = Vec::new();
        let mut group_of: HashMap<u32, usize> = HashMap::new();
        for face in &self.faces {
            let group = *group_of.entry(face.material).or_insert_with(|| {
                groups.push((face.material, Vec::new()));
                groups.len() - 1
            });
            groups[group].1.push(face);
        }
        let named = |(m, faces)| (self.materials.get(m as usize).map(String::as_str), faces);
        groups.into_iter().map(named).collect()
    }

    /// The triangles of these faces, with corners that are the same made one vertex.
    fn primitive(&self, source: Source, base: Base, faces: &[&Face]) -> Result<Primitive, Error> {
        let mut primitive = Primitive::default();
        let (mut has_uvs, mut has_normals) = (false, false);
        let mut vertex_of: HashMap<Corner, u32> = HashMap::new();
        let mut triangulator = Triangulator::default();
        let mut polygon = Vec::new();
        for face in faces {
            let corners = &self.corners[face.first as usize..(face.first + face.count) as usize];
            polygon.clear();
            for &corner in corners {
                self.check(corner)
                    .map_err(|p| source.malformed(format!("line {}", face.line), p))?;
                has_uvs |= corner[1] != ABSENT;
                has_normals |= corner[2] != ABSENT;
                polygon.push(*vertex_of.entry(corner).or_insert_with(|| {
                    self.add_vertex(corner, base, &mut primitive);
                    (primitive.positions.len() - 1) as u32
                }));
            }
            let positions = &primitive.positions;
            let triangles = &mut primitive.triangles;
            let position = |i: usize| positions[polygon[i] as usize];
            triangulator.triangulate(polygon.len(), position, |t| triangles.push(t.map(|i| polygon[i])));
        }
        if !has_uvs {
            primitive.uvs = Vec::new();
        }
        if !has_normals {
            primitive.normals = Vec::new();
        }
        Ok(primitive)
    }

    fn check(&self, corner: Corner) -> Result<(), String> {
        let lists = [
            ("vertex", self.positions.len()),
            ("texture coordinate", self.uvs.len()),
            ("normal", self.normals.len()),
        ];
        for (slot, (index, (what, count))) in corner.into_iter().zip(lists).enumerate() {
            if index as usize >= count && (index != ABSENT || slot == 0) {
                return Err(format!(
                    "{what} {} is asked for, there are {count}",
                    u64::from(index) + 1
                ));
            }
        }
        Ok(())
    }

    fn add_vertex(&self, [position, uv, normal]: Corner, base: Base, primitive: &mut Primitive) {
        let place = base.local(self.positions[position as usize]);
        primitive.positions.push(place);
        primitive
            .uvs
            .push(self.uvs.get(uv as usize).copied().unwrap_or_default());
        primitive
            .normals
            .push(self.normals.get(normal as usize).copied().unwrap_or_default());
        if !self.colors.is_empty() {
            primitive
                .colors
                .push(self.colors.get(position as usize).copied().unwrap_or(Vec4::ONE));
        }
    }
}

/// An index counted from 0, from one counted from 1 or, if negative, from the end.
fn absolute(text: &str, count: usize) -> Result<u32, String> {
    let index: i64 = text.parse().map_err(|_| format!("{text:?} is not an index"))?;
    let absolute = if index < 0 {
        count as i64 + index
    } else {
        index - 1
    };
    match u32::try_from(absolute) {
        Ok(absolute) if index != 0 => Ok(absolute.min(ABSENT - 1)),
        _ if index == 0 => Err("index 0: they start at 1".into()),
        _ => Err(format!(
            "index {index} is out of range, there are {count} before this line"
        )),
    }
}

/// Up to three numbers, of which `needed` have to be there.
fn numbers(text: &str, needed: usize) -> Result<[f64; 3], String> {
    let mut values = [0.0; 3];
    let mut count = 0;
    for (value, word) in values.iter_mut().zip(words(text)) {
        *value = real(word)?;
        count += 1;
    }
    if count < needed {
        Err(format!("{count} numbers where {needed} are needed"))
    } else {
        Ok(values)
    }
}

fn real(word: &str) -> Result<f64, String> {
    number(word).ok_or_else(|| format!("{word:?} is not a number"))
}

fn float(word: &str) -> Result<f32, String> {
    real(word).map(|value| value as f32)
}
