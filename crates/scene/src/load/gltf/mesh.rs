//! Meshes (glTF 2.0 §3.7): primitives to indexed triangles with their attributes and morph targets.
//!
//! Where a primitive uses few of its accessor's vertices (files that share one vertex buffer), only those are
//! kept, so memory is in proportion to triangles, not to primitives times vertices.

use glam::{Vec2, Vec3, Vec4};
use gltf::json;
use gltf::json::accessor::{Accessor, Type};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, accessor::ComponentType};

use super::accessor::Elements;
use super::source::Source;
use super::{MAX_VERTICES, Notices, place};
use crate::{Error, Mesh, MorphTarget, Primitive};

/// Unused vertices are dropped where there are more vertices than this for each triangle.
const VERTICES_PER_TRIANGLE: u64 = 6;

/// Reads all meshes. Primitives without triangles are left out.
pub(super) fn read(source: &Source<'_>, notices: &mut Notices) -> Result<Vec<Mesh>, Error> {
    check_sizes(source)?;
    let mut reader = Reader { source, notices };
    source
        .root
        .meshes
        .iter()
        .enumerate()
        .map(|(i, mesh)| reader.mesh(i, mesh))
        .collect()
}

/// Primitives may share accessors, so memory is not bounded by the file's size: what all of them would take is
/// compared with the limits before anything is read.
fn check_sizes(source: &Source<'_>) -> Result<(), Error> {
    let count =
        |index: Option<&Index<Accessor>>| index.and_then(|&index| source.root.get(index)).map(|a| a.count.0);
    let (mut vertices, mut corners) = (0_u64, 0_u64);
    for (m, mesh) in source.root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let positions =
                count(primitive.attributes.get(&Checked::Valid(Semantic::Positions))).unwrap_or(0);
            let own_corners = count(primitive.indices.as_ref()).unwrap_or(positions);
            let kept = positions.min(own_corners.saturating_mul(VERTICES_PER_TRIANGLE));
            let copies = 1 + primitive.targets.as_ref().map_or(0, Vec::len) as u64;
            vertices = vertices.saturating_add(kept.saturating_mul(copies));
            corners = corners.saturating_add(own_corners);
            let limit = MAX_VERTICES as u64;
            for (count, what, limit) in [
                (vertices, "vertices", limit),
                (corners, "triangle corners", 3 * limit),
            ] {
                if count > limit {
                    let place = format!("{}, primitive {p}", place("mesh", m, mesh.name.as_ref()));
                    let what = format!("the count of {count} {what} up to here");
                    return Err(source.too_large(place, what, limit.to_string()));
                }
            }
        }
    }
    Ok(())
}

struct Reader<'s, 'n> {
    source: &'s Source<'s>,
    notices: &'n mut Notices,
}

impl Reader<'_, '_> {
    fn mesh(&mut self, i: usize, mesh: &json::Mesh) -> Result<Mesh, Error> {
        let place = place("mesh", i, mesh.name.as_ref());
        let targets = |p: &json::mesh::Primitive| p.targets.as_ref().map_or(0, Vec::len);
        let target_count = mesh.primitives.first().map_or(0, targets);
        let mut primitives = Vec::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("{place}, primitive {p}");
            if targets(primitive) != target_count {
                let problem = format!(
                    "{} morph targets, primitive 0 has {target_count}",
                    targets(primitive)
                );
                return Err(self.source.malformed(place, problem));
            }
            primitives.extend(self.primitive(primitive, &place)?);
        }
        let mut weights = mesh.weights.clone().unwrap_or_default();
        if !weights.is_empty() && weights.len() != target_count {
            self.notices.say(
                &place,
                "the number of weights is not that of the morph targets; weights are cut or 0",
            );
        }
        weights.resize(target_count, 0.0);
        Ok(Mesh {
            name: mesh.name.clone().unwrap_or_default(),
            primitives,
            weights,
        })
    }

    fn primitive(
        &mut self,
        primitive: &json::mesh::Primitive,
        place: &str,
    ) -> Result<Option<Primitive>, Error> {
        let source = self.source;
        let mode = source.valid(&primitive.mode, "mode", place)?;
        if matches!(
            mode,
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip
        ) {
            self.notices.say(place, "points and lines are not shown");
            return Ok(None);
        }
        let Some(&positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            self.notices
                .say(place, "a primitive without POSITION shows nothing");
            return Ok(None);
        };
        let positions = source.elements(positions, &[Type::Vec3], place)?;
        let corners = self.corners(primitive, &positions, place)?;
        let mut triangles = self.assemble(mode, &corners, place);
        if triangles.is_empty() {
            self.notices
                .say(place, "a primitive without triangles shows nothing");
            return Ok(None);
        }
        let pick = compact(&mut triangles, positions.count);
        let targets = primitive.targets.as_deref().unwrap_or_default();

        let attributes = Attributes {
            source,
            primitive,
            place,
            count: positions.count,
            pick: pick.as_deref(),
        };
        let colors = attributes.colors()?;
        let (joints, weights) = attributes.joints()?;
        let material = match primitive.material {
            None => 0,
            Some(index) => 1 + source.index(index, source.root.materials.len(), "material", place)?,
        };
        Ok(Some(Primitive {
            positions: positions.gather(pick.as_deref(), Vec3::from_array),
            normals: attributes.read(Semantic::Normals, Type::Vec3, Vec3::from_array)?,
            tangents: attributes.read(Semantic::Tangents, Type::Vec4, Vec4::from_array)?,
            uvs: attributes.read(Semantic::TexCoords(0), Type::Vec2, Vec2::from_array)?,
            uvs1: attributes.read(Semantic::TexCoords(1), Type::Vec2, Vec2::from_array)?,
            colors,
            joints,
            weights,
            triangles,
            morph_targets: targets
                .iter()
                .enumerate()
                .map(|(i, target)| attributes.target(i, target))
                .collect::<Result<_, _>>()?,
            material,
        }))
    }

    /// The vertex of every corner, in file order and in range.
    fn corners(
        &self,
        primitive: &json::mesh::Primitive,
        positions: &Elements<'_>,
        place: &str,
    ) -> Result<Vec<u32>, Error> {
        let Some(index) = primitive.indices else {
            return Ok((0..positions.count as u32).collect());
        };
        let indices = self.source.elements(index, &[Type::Scalar], place)?;
        if !indices.is_unsigned() {
            let problem = format!("indices are {:?} instead of unsigned integers", indices.kind);
            return Err(self.source.malformed(indices.place, problem));
        }
        let corners: Vec<u32> = (0..indices.count).map(|i| indices.integer(i, 0)).collect();
        match corners
            .iter()
            .position(|&corner| corner as usize >= positions.count)
        {
            None => Ok(corners),
            Some(i) => {
                let problem = format!(
                    "index {i} is {}, there are {} vertices",
                    corners[i], positions.count
                );
                Err(self.source.malformed(indices.place, problem))
            }
        }
    }

    /// Triangles of a list, strip or fan, with the winding of glTF 2.0 §3.7.2.1. The stitches of strips (two
    /// equal corners) are not triangles.
    fn assemble(&mut self, mode: Mode, corners: &[u32], place: &str) -> Vec<[u32; 3]> {
        let solid = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let windows = corners.array_windows::<3>().enumerate();
        match mode {
            Mode::TriangleStrip => {
                let turned =
                    |(i, &[a, b, c]): (usize, &[u32; 3])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] };
                windows.map(turned).filter(solid).collect()
            }
            Mode::TriangleFan => {
                let hub = corners.first().copied().unwrap_or_default();
                let rim = corners.get(1..).unwrap_or_default();
                rim.array_windows::<2>()
                    .map(|&[a, b]| [a, b, hub])
                    .filter(solid)
                    .collect()
            }
            _ => {
                let (triangles, rest) = corners.as_chunks::<3>();
                if !rest.is_empty() {
                    self.notices
                        .say(place, "corners beyond the last whole triangle are left out");
                }
                triangles.to_vec()
            }
        }
    }
}

/// Renumbers triangles that use few of `count` vertices; the used ones in ascending order, else `None`.
fn compact(triangles: &mut [[u32; 3]], count: usize) -> Option<Vec<u32>> {
    if triangles.len() as u64 * VERTICES_PER_TRIANGLE >= count as u64 {
        return None;
    }
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    for corner in triangles.iter_mut().flatten() {
        *corner = used.partition_point(|&vertex| vertex < *corner) as u32;
    }
    Some(used)
}

/// Reads the attributes of one primitive.
struct Attributes<'a> {
    source: &'a Source<'a>,
    primitive: &'a json::mesh::Primitive,
    place: &'a str,
    /// Elements that each attribute must have.
    count: usize,
    /// The ones to keep.
    pick: Option<&'a [u32]>,
}

impl<'a> Attributes<'a> {
    /// The elements of an attribute, if the primitive has it.
    fn elements(&self, semantic: Semantic, shapes: &[Type]) -> Result<Option<Elements<'a>>, Error> {
        let place = format!("{}, {}", self.place, semantic.to_string());
        let index = self.primitive.attributes.get(&Checked::Valid(semantic));
        index
            .map(|&index| self.checked(index, shapes, &place))
            .transpose()
    }

    fn checked(&self, index: Index<Accessor>, shapes: &[Type], place: &str) -> Result<Elements<'a>, Error> {
        let elements = self.source.elements(index, shapes, place)?;
        if elements.count == self.count {
            return Ok(elements);
        }
        let problem = format!("{} elements for {} vertices", elements.count, self.count);
        Err(self.source.malformed(elements.place, problem))
    }

    fn read<const N: usize, T>(
        &self,
        semantic: Semantic,
        shape: Type,
        map: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, Error> {
        let elements = self.elements(semantic, &[shape])?;
        Ok(elements
            .map(|elements| elements.gather(self.pick, map))
            .unwrap_or_default())
    }

    fn target(&self, i: usize, target: &json::mesh::MorphTarget) -> Result<MorphTarget, Error> {
        let read = |index: Option<Index<Accessor>>, name: &str| -> Result<Vec<Vec3>, Error> {
            let Some(index) = index else { return Ok(Vec::new()) };
            let place = format!("{}, morph target {i}, {name}", self.place);
            Ok(self
                .checked(index, &[Type::Vec3], &place)?
                .gather(self.pick, Vec3::from_array))
        };
        Ok(MorphTarget {
            positions: read(target.positions, "POSITION")?,
            normals: read(target.normals, "NORMAL")?,
            tangents: read(target.tangents, "TANGENT")?,
        })
    }

    /// Colours; integers are fractions whether flagged so or not, alpha is 1 where absent.
    fn colors(&self) -> Result<Vec<Vec4>, Error> {
        let Some(mut elements) = self.elements(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? else {
            return Ok(Vec::new());
        };
        elements.normalized = true;
        let opaque = elements.components == 3;
        Ok(elements.gather(self.pick, |[r, g, b, a]| {
            Vec4::new(r, g, b, if opaque { 1.0 } else { a })
        }))
    }

    /// The four strongest joints of each vertex, from up to four sets, with weights that sum to 1.
    fn joints(&self) -> Result<(Vec<[u16; 4]>, Vec<Vec4>), Error> {
        let mut sets = Vec::new();
        for set in 0..4 {
            let joints = self.elements(Semantic::Joints(set), &[Type::Vec4])?;
            let weights = self.elements(Semantic::Weights(set), &[Type::Vec4])?;
            let (joints, mut weights) = match (joints, weights) {
                (Some(joints), Some(weights)) => (joints, weights),
                (None, None) => break,
                (Some(one), None) | (None, Some(one)) => {
                    return Err(self
                        .source
                        .malformed(one.place, "JOINTS and WEIGHTS do not come in pairs"));
                }
            };
            if !matches!(joints.kind, ComponentType::U8 | ComponentType::U16) {
                let problem = format!("joints are {:?} instead of U8 or U16", joints.kind);
                return Err(self.source.malformed(joints.place, problem));
            }
            weights.normalized = true;
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            return Ok((Vec::new(), Vec::new()));
        }
        let influence = |vertex: usize| strongest(&sets, vertex);
        Ok(match self.pick {
            Some(pick) => pick.iter().map(|&vertex| influence(vertex as usize)).unzip(),
            None => (0..self.count).map(influence).unzip(),
        })
    }
}

/// The four largest influences on a vertex, normalised. A vertex without any is bound to its first joint.
fn strongest(sets: &[(Elements<'_>, Elements<'_>)], vertex: usize) -> ([u16; 4], Vec4) {
    let mut best = [(0.0_f32, 0_u16); 4];
    for (joints, weights) in sets {
        let values: [f32; 4] = weights.floats(vertex);
        for (c, &weight) in values.iter().enumerate() {
            let mut entry = (weight, joints.integer(vertex, c) as u16);
            if !(weight > 0.0 && weight.is_finite()) {
                continue;
            }
            for slot in &mut best {
                if entry.0 > slot.0 {
                    std::mem::swap(slot, &mut entry);
                }
            }
        }
    }
    let weights = Vec4::from_array(best.map(|(weight, _)| weight));
    let joints = best.map(|(_, joint)| joint);
    let sum = weights.element_sum();
    if sum > 0.0 && sum.is_finite() {
        return (joints, weights / sum);
    }
    let first = sets[0].0.integer(vertex, 0) as u16;
    ([first, 0, 0, 0], Vec4::X)
}
