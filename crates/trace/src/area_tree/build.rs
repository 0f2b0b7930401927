//! Building a light's trees: boxes in perspective space, sorted along a curve, cut into sixteens.
//!
//! A triangle has one entry, wherever it reaches, so there is nothing to choose a resolution for. Entries are sorted
//! by size class, then by the bits of their middle's place in the raster and its depth (a Morton curve); sixteen in a row
//! share a node, sixteen nodes in a row their parent. Size classes keep a large triangle from stretching the boxes of
//! small neighbours. The bits of depth follow after a fixed number of those of the raster ([`crate::kernel::light_boxes`]).
//! Cost: 120 to 200 ns a triangle, most of it memory: corners anywhere, and the new tree.

use std::ops::Range;

use rayon::prelude::*;

use super::frame::{Frame, Local};
use crate::kernel::area::set_up_group;
use crate::kernel::light_boxes::{self, Corners, Curve, Sight};
use crate::kernel::lines::{CornerLanes, Group};
use crate::kernel::project::RasterVertex;
use crate::kernel::shaft::Boxes;
use crate::kernel::{LANES, SimdLevel};
use crate::light_grid::{CastRule, Casts};
use crate::{AreaLight, Triangles};

/// A triangle that takes part in a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    bounds: [f32; 6],
    /// Twice or four times the triangle's id: bit 0 is set if it is turned with its back to the light, bit 1 if its plane
    /// crosses the light.
    tag: u32,
    /// Its place on the curve.
    key: u32,
}

const BACK: u32 = 1;
const CROSSING: u32 = 2;

/// Triangles at most: ids share a word with two flags.
pub(super) const MOST_TRIANGLES: usize = 1 << 30;

/// Triangles done by one task.
const CHUNK: usize = 8 * 1024;

/// The entries of a frame. Triangles that are all front and cast with their back alone are left out, like those
/// without area.
pub(super) fn entries(
    frame: &Frame,
    light: &AreaLight,
    triangles: &Triangles,
    rule: CastRule,
    level: SimdLevel,
) -> Vec<Entry> {
    let vertices = crate::eye_grid::project_all(level, &frame.view, triangles);
    let sight = frame.sight(light);
    let finder = Finder {
        frame,
        curve: curve(&sight, &vertices, frame.lanes.reach.is_some()),
        sight,
        triangles,
        vertices: &vertices,
        rule,
        level,
    };
    let chunks: Vec<Vec<Entry>> = (0..triangles.len().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| finder.chunk(chunk * CHUNK..((chunk + 1) * CHUNK).min(triangles.len())))
        .collect();
    chunks.concat()
}

/// The curve over all vertices that lie ahead.
fn curve(sight: &Sight, vertices: &[RasterVertex], parallel: bool) -> Curve {
    let [scale, unit] = sight.scale;
    let none = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    let range_of = |vertices: &[RasterVertex]| {
        let (mut low, mut high) = none;
        for v in vertices {
            if v.nearness > 0.0 && v.nearness <= sight.limit {
                let [x, y, nearness] = [v.x * scale, v.y * scale, v.nearness * unit];
                let share = if parallel {
                    1.0
                } else {
                    1.0 / (1.0 + x.abs() + y.abs())
                };
                let depth = if parallel { -nearness } else { 1.0 / nearness };
                for (axis, at) in [x * share, y * share, depth].into_iter().enumerate() {
                    low[axis] = if at < low[axis] { at } else { low[axis] };
                    high[axis] = if at > high[axis] { at } else { high[axis] };
                }
            }
        }
        (low, high)
    };
    let (low, high) = vertices.par_chunks(CHUNK).map(range_of).reduce(
        || none,
        |(low, high), (l, h)| {
            let axes = [0, 1, 2];
            (axes.map(|i| low[i].min(l[i])), axes.map(|i| high[i].max(h[i])))
        },
    );
    let inverse = [0, 1, 2].map(|axis| {
        let range = high[axis] - low[axis];
        if range > 0.0 { 1.0 / range } else { 0.0 }
    });
    Curve {
        low,
        inverse,
        parallel,
    }
}

/// What finds the entries of a frame.
struct Finder<'f> {
    frame: &'f Frame,
    sight: Sight,
    curve: Curve,
    triangles: &'f Triangles<'f>,
    vertices: &'f [RasterVertex],
    rule: CastRule<'f>,
    level: SimdLevel,
}

impl Finder<'_> {
    fn chunk(&self, prims: Range<usize>) -> Vec<Entry> {
        let mut entries = Vec::with_capacity(prims.len());
        let (mut corners, mut bounds) = (Corners::default(), [[0.0; LANES]; 6]);
        for first in prims.clone().step_by(LANES) {
            let count = (prims.end - first).min(LANES);
            self.gather(first, count, &mut corners);
            let seen = light_boxes::look(self.level, &self.sight, &corners, &mut bounds);
            let mut kept = seen.area & !(seen.apart & seen.ahead) & (u32::MAX >> (32 - count));
            let mut others = kept & !seen.ahead;
            while others != 0 {
                let lane = others.trailing_zeros() as usize;
                others &= others - 1;
                match self
                    .frame
                    .bounds(self.triangles, self.vertices, (first + lane) as u32)
                {
                    Some(found) => (0..6).for_each(|i| bounds[i][lane] = found[i]),
                    None => kept &= !(1 << lane),
                }
            }
            let keys = light_boxes::places(self.level, &self.curve, &bounds);
            while kept != 0 {
                let lane = kept.trailing_zeros() as usize;
                kept &= kept - 1;
                let prim = (first + lane) as u32;
                let [front, back] = [seen.front, seen.back].map(|bits| bits >> lane & 1 != 0);
                let casts = (self.rule)(prim);
                if casts == Casts::Nothing || (casts == Casts::Back && front) {
                    continue;
                }
                let entry = |flags: u32| Entry {
                    bounds: std::array::from_fn(|i| bounds[i][lane]),
                    tag: prim << 2 | flags,
                    key: keys[lane],
                };
                if front {
                    entries.push(entry(0));
                } else if back {
                    entries.push(entry(BACK));
                } else {
                    entries.extend([entry(CROSSING), entry(CROSSING | BACK)]);
                }
            }
        }
        entries
    }

    /// Puts the corners of triangles in a row into lanes.
    #[inline]
    fn gather(&self, first: usize, count: usize, out: &mut Corners) {
        let Triangles { x, y, z, indices } = self.triangles;
        for (lane, corners) in indices[first..first + count].iter().enumerate() {
            for (corner, &index) in corners.iter().enumerate() {
                let index = index as usize;
                let vertex = &self.vertices[index];
                let raster = &mut out.raster[corner];
                (raster[0][lane], raster[1][lane], raster[2][lane]) = (vertex.x, vertex.y, vertex.nearness);
                let position = &mut out.position[corner];
                (position[0][lane], position[1][lane], position[2][lane]) = (x[index], y[index], z[index]);
            }
        }
    }
}

/// A bit for each triangle that has an entry.
pub(super) fn present(entries: &[Entry], triangles: usize) -> Vec<u64> {
    let mut bits = vec![0; triangles.div_ceil(64)];
    for entry in entries {
        let prim = entry.tag >> 2;
        bits[prim as usize / 64] |= 1 << (prim % 64);
    }
    bits
}

/// The entries by their places on the curve; equal ones stay in order.
pub(super) fn sort(entries: &[Entry]) -> Vec<u32> {
    const BITS: u32 = 10;
    let mut pairs: Vec<(u32, u32)> = entries
        .par_iter()
        .enumerate()
        .map(|(i, entry)| (entry.key, i as u32))
        .collect();
    let mut sorted = vec![(0, 0); pairs.len()];
    for pass in 0..3 {
        let digit = |key: u32| (key >> (pass * BITS)) as usize & ((1 << BITS) - 1);
        let mut next = vec![0u32; 1 << BITS];
        for &(key, _) in &pairs {
            next[digit(key)] += 1;
        }
        let mut sum = 0;
        for n in &mut next {
            (*n, sum) = (sum, sum + *n);
        }
        for &pair in &pairs {
            let slot = &mut next[digit(pair.0)];
            sorted[*slot as usize] = pair;
            *slot += 1;
        }
        std::mem::swap(&mut pairs, &mut sorted);
    }
    pairs.into_iter().map(|(_, i)| i).collect()
}

/// The tree over the sorted entries: the boxes of sixteen each and of their ancestors, up to a root, and the triangles of
/// each sixteen as the kernels take them.
pub(super) fn tree(
    entries: &[Entry],
    sorted: &[u32],
    triangles: &Triangles,
    local: &Local,
    level: SimdLevel,
) -> (Vec<Vec<Boxes>>, Vec<Group>) {
    let sixteen = |corners: &mut CornerLanes, chunk: &[u32]| {
        let (mut boxes, mut group) = (Boxes::default(), Group::default());
        for (lane, &i) in chunk.iter().enumerate() {
            let Entry { bounds, tag, .. } = entries[i as usize];
            boxes.set(lane, bounds);
            group.prim[lane] = tag >> 2;
            group.crossing |= u32::from(tag & CROSSING != 0) << lane;
            group.back |= (tag & BACK) << lane;
            corners.side[lane] = if tag & BACK != 0 { -1.0 } else { 1.0 };
        }
        // One array after the other, so that what is fetched from memory does not wait for each other.
        let mut indices = [[0; 3]; LANES];
        for (indices, &prim) in indices.iter_mut().zip(&group.prim[..chunk.len()]) {
            *indices = triangles.indices[prim as usize];
        }
        for (lane, indices) in indices[..chunk.len()].iter().enumerate() {
            for (v, &index) in corners.v.iter_mut().zip(indices) {
                let index = index as usize;
                v[0][lane] = triangles.x[index];
                v[1][lane] = triangles.y[index];
                v[2][lane] = triangles.z[index];
            }
        }
        let unit = local.unit as f32;
        set_up_group(
            level,
            corners,
            local.origin.to_array(),
            unit,
            &local.light,
            &mut group,
        );
        (boxes, group)
    };
    let (mut leaves, mut groups) = (Vec::new(), Vec::new());
    sorted
        .par_chunks(LANES)
        .map_init(CornerLanes::default, sixteen)
        .unzip_into_vecs(&mut leaves, &mut groups);
    (ancestors(leaves), groups)
}

/// The boxes of leaves and of their ancestors, up to a root.
fn ancestors(leaves: Vec<Boxes>) -> Vec<Vec<Boxes>> {
    let parent = |children: &[Boxes]| {
        let mut boxes = Boxes::default();
        for (lane, child) in children.iter().enumerate() {
            boxes.set(lane, child.hull());
        }
        boxes
    };
    let mut levels = vec![leaves];
    while let Some(last) = levels.last().filter(|last| last.len() > 1) {
        let parents = last.par_chunks(LANES).map(parent).collect();
        levels.push(parents);
    }
    levels
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::{bounds, frame};
    use super::*;
    use crate::test_meshes::{Mesh, Numbers};

    /// Small, large, crossing, far, without area, and with corners that are no numbers.
    fn mesh() -> Mesh {
        let mut mesh = Mesh::soup(5, 300, 0.2, 2.0);
        let mut numbers = Numbers(11);
        for i in 0..60 {
            let [a, b, c] = [numbers.point(), numbers.point(), numbers.point()];
            let corners = match i % 6 {
                0 => [a * 3.0, b * 3.0, c * 3.0],
                1 => [a, b, a],
                2 => [a, (a + b) * 0.5, b],
                3 => [a * 1e6, b, c],
                4 => [a, b * 1e-6 + a, c * 1e-6 + a],
                _ => [Vec3::new(f32::NAN, a.y, a.z), b, c],
            };
            mesh.triangle(corners);
        }
        mesh
    }

    #[test]
    fn lanes_find_what_is_found_one_by_one() {
        let mesh = mesh();
        let triangles = mesh.triangles();
        let (min, max) = bounds(&triangles).unwrap();
        let (u, v) = (Vec3::X * 0.4, Vec3::Z * 0.3);
        let lights = [
            AreaLight::rectangle(Vec3::new(0.1, 0.7, 0.2), u, v),
            AreaLight::sphere(Vec3::new(0.1, 0.3, -0.4), 0.2),
            AreaLight::sun(Vec3::new(0.3, -1.0, 0.2), 0.02),
        ];
        for light in lights {
            let local = Local::new(&light, min, max);
            for frame in frame::frames(&light, &local, min, max) {
                for level in SimdLevel::available() {
                    let vertices = crate::eye_grid::project_all(level, &frame.view, &triangles);
                    let rule = |prim: u32| [Casts::Both, Casts::Back, Casts::Nothing][prim as usize % 3];
                    let found = entries(&frame, &light, &triangles, &rule, level);
                    let mut expected = Vec::new();
                    for prim in 0..triangles.len() as u32 {
                        let side = light.side(triangles.corners(prim));
                        let casts = rule(prim);
                        let none = casts == Casts::Nothing || (casts == Casts::Back && side > 0.0);
                        let Some(bounds) = frame.bounds(&triangles, &vertices, prim) else {
                            continue;
                        };
                        if none || triangles.is_degenerate(prim) {
                            continue;
                        }
                        let flags: &[u32] = match side {
                            s if s > 0.0 => &[0],
                            s if s < 0.0 => &[BACK],
                            _ => &[CROSSING, CROSSING | BACK],
                        };
                        expected.extend(flags.iter().map(|flags| (prim << 2 | flags, bounds)));
                    }
                    let found: Vec<_> = found.iter().map(|entry| (entry.tag, entry.bounds)).collect();
                    assert_eq!(found, expected, "{light:?}, {}", level.name());
                    assert!(found.len() > 100);
                }
            }
        }
    }
}
