//! Cells that casters cover whole: beyond them every receiver is dark without a test.
//!
//! HM08 §5.2 keeps the nearest caster of a cell, before which everything is lit, and names precomputed silhouette edges as
//! something else that a cell could keep. This is what they are good for. Take casters of a cell that hang together by
//! edges, all turned the same way. As a point moves over the cell, the number of them that its ray meets changes only
//! where it passes an edge that is not shared by two of them. So if no such edge reaches into the cell, all of its points
//! meet equally many: if one meets any, all receivers behind the farthest of these casters are in shadow. Only cells that
//! silhouettes pass are left to be tested.
//!
//! Which triangles are neighbours is a hint that the topology gives; that they share an edge is looked at, for vertices may
//! have moved. A receiver that lies on one of the casters is not behind the farthest.
//!
//! Layout: 4 bytes a cell; 44 bytes a caster while building. Cost: some 60 ns a reference.

use glam::Vec3;
use rayon::prelude::*;

use super::nearest::plane_range;
use crate::bins::Bins;
use crate::kernel::points::Caster;
use crate::kernel::project::RasterVertex;
use crate::kernel::{NEARNESS_BAND, ROUNDOFF};
use crate::view::View;
use crate::{Topology, Triangles};

/// What a cell's casters are, as parts of sheets.
pub(super) struct Sheets<'s> {
    triangles: &'s Triangles<'s>,
    vertices: &'s [RasterVertex],
    prims: &'s [u32],
    casters: &'s [Caster],
    members: Vec<Member>,
}

/// A caster among its neighbours.
#[derive(Clone, Copy)]
struct Member {
    corners: [[f32; 2]; 3],
    /// For each edge, first the one across from the first corner, the caster that shares it and is turned alike.
    links: [u32; 3],
    /// Nearness of the farthest corner; 0 where too little is known of the caster for it to belong to a sheet.
    least: f32,
    /// Whether it is larger than a cell.
    large: bool,
}

/// No caster.
const NONE: u32 = u32::MAX;

/// How far beyond a cell its sheets are looked at: more than points and vertices may be off, less than the distance
/// within which casters are put into cells.
const MARGIN: f64 = 1.0 / 256.0;

impl<'s> Sheets<'s> {
    /// Of the casters of a face, in order of their triangles `prims`.
    pub(super) fn new(
        triangles: &'s Triangles,
        vertices: &'s [RasterVertex],
        (prims, casters): (&'s [u32], &'s [Caster]),
        topology: &Topology,
    ) -> Self {
        let mut position = vec![NONE; triangles.len()];
        for (at, &prim) in prims.iter().enumerate() {
            position[prim as usize] = at as u32;
        }
        let turns: Vec<i8> = prims
            .par_iter()
            .map(|&p| turn(corners(triangles, vertices, p)))
            .collect();
        let member = |(at, &prim): (usize, &u32)| {
            let v = corners(triangles, vertices, prim);
            let range = |v: [f32; 3]| v[0].max(v[1]).max(v[2]) - v[0].min(v[1]).min(v[2]);
            let large = range(v.map(|v| v.x)) > 1.0 || range(v.map(|v| v.y)) > 1.0;
            let link = |edge: usize| {
                let next = topology.neighbours()[prim as usize][edge];
                let place = position.get(next as usize).copied().unwrap_or(NONE);
                let alike = place != NONE && turns[place as usize] == turns[at];
                let shared = alike && shares(triangles.corners(prim), triangles.corners(next), edge);
                if shared { place } else { NONE }
            };
            let nearness = v.map(|v| v.nearness);
            Member {
                corners: v.map(|v| [v.x, v.y]),
                links: [0, 1, 2].map(link),
                least: if turns[at] == 0 {
                    0.0
                } else {
                    nearness[0].min(nearness[1]).min(nearness[2])
                },
                large,
            }
        };
        Self {
            members: prims.par_iter().enumerate().map(member).collect(),
            triangles,
            vertices,
            prims,
            casters,
        }
    }

    /// For every cell of a view's raster, a nearness below which all receivers are in shadow; 0 where none is known.
    pub(super) fn dark_per_cell(&self, view: &View, bins: &Bins) -> Vec<f32> {
        let columns = view.width as usize;
        let mut dark = vec![0.0f32; columns * view.height as usize];
        let rows = dark.par_chunks_mut(columns).enumerate();
        rows.for_each_init(Work::default, |work, (row, dark)| {
            for (column, dark) in dark.iter_mut().enumerate() {
                work.list.clear();
                work.list.extend(bins.cell(row * columns + column).flatten());
                if !work.list.is_empty() {
                    *dark = self.dark(work, [column as f32, row as f32]);
                }
            }
        });
        dark
    }

    /// The bound of one cell, whose casters are listed in ascending order.
    fn dark(&self, work: &mut Work, cell: [f32; 2]) -> f32 {
        let Work { list, sheets } = work;
        sheets.clear();
        sheets.extend((0..list.len() as u32).map(|own| Sheet {
            parent: own,
            least: f32::INFINITY,
            ..Sheet::default()
        }));
        for i in 0..list.len() {
            let member = &self.members[list[i] as usize];
            if member.least <= 0.0 {
                sheets[i].broken = true;
                continue;
            }
            for edge in 0..3 {
                let (p, q) = (member.corners[(edge + 1) % 3], member.corners[(edge + 2) % 3]);
                if !reaches(p, q, cell) {
                    continue;
                }
                match list.binary_search(&member.links[edge]) {
                    Ok(other) => join(sheets, i as u32, other as u32),
                    Err(_) => sheets[i].broken = true,
                }
            }
        }
        let middle = [cell[0] + 0.5, cell[1] + 0.5];
        for i in 0..list.len() {
            let (root, broken) = (root(sheets, i as u32) as usize, sheets[i].broken);
            let at = list[i] as usize;
            let (member, caster) = (&self.members[at], &self.casters[at]);
            let mut least = member.least;
            // Others know their plane less well.
            if member.large && !broken && caster.record.floor == 0.0 {
                let v = corners(self.triangles, self.vertices, self.prims[at]);
                least = least.max(plane_range(caster, v, cell)[0]);
            }
            let sheet = &mut sheets[root];
            sheet.broken |= broken;
            sheet.least = sheet.least.min(least);
            sheet.covers |= !broken && covers(caster, middle);
        }
        let whole = sheets.iter().filter(|sheet| sheet.covers && !sheet.broken);
        let dark = whole.fold(0.0f32, |dark, sheet| dark.max(sheet.least));
        dark * (1.0 - 2.0 * NEARNESS_BAND)
    }
}

/// Working memory of one thread.
#[derive(Default)]
struct Work {
    list: Vec<u32>,
    sheets: Vec<Sheet>,
}

/// A caster of a cell; of those that hang together the root has what is known of all.
#[derive(Clone, Copy, Default)]
struct Sheet {
    parent: u32,
    /// Whether it may end within the cell.
    broken: bool,
    /// Whether it certainly covers the middle of the cell.
    covers: bool,
    /// Nearness of its farthest point.
    least: f32,
}

fn root(sheets: &mut [Sheet], mut i: u32) -> u32 {
    while sheets[i as usize].parent != i {
        let above = sheets[sheets[i as usize].parent as usize].parent;
        sheets[i as usize].parent = above;
        i = above;
    }
    i
}

fn join(sheets: &mut [Sheet], a: u32, b: u32) {
    let (a, b) = (root(sheets, a), root(sheets, b));
    sheets[a.max(b) as usize].parent = a.min(b);
}

#[inline]
fn corners<'v>(triangles: &Triangles, vertices: &'v [RasterVertex], prim: u32) -> [&'v RasterVertex; 3] {
    triangles.indices[prim as usize].map(|i| &vertices[i as usize])
}

/// Which way round a triangle certainly lies in the raster; 0 if that is not certain, or a corner is not in front.
fn turn([a, b, c]: [&RasterVertex; 3]) -> i8 {
    if !(a.nearness > 0.0 && b.nearness > 0.0 && c.nearness > 0.0) {
        return 0;
    }
    let [x0, y0, x1, y1, x2, y2] = [a.x, a.y, b.x, b.y, c.x, c.y].map(f64::from);
    let (ux, uy, vx, vy) = (x1 - x0, y1 - y0, x2 - x0, y2 - y0);
    let largest = [x0, y0, x1, y1, x2, y2]
        .into_iter()
        .fold(1.0, |m: f64, v| m.max(v.abs()));
    let error = largest * f64::from(ROUNDOFF) * 4.0;
    let area = ux * vy - uy * vx;
    let bound = error * (ux.abs() + uy.abs() + vx.abs() + vy.abs()) + error * error * 4.0;
    if area > bound {
        1
    } else if area < -bound {
        -1
    } else {
        0
    }
}

/// Whether two triangles share an edge of the first, running the other way.
fn shares(own: [Vec3; 3], other: [Vec3; 3], edge: usize) -> bool {
    let (from, to) = (own[(edge + 1) % 3], own[(edge + 2) % 3]);
    (0..3).any(|i| other[i] == to && other[(i + 1) % 3] == from)
}

/// Whether an edge may reach into a cell.
#[inline]
fn reaches(p: [f32; 2], q: [f32; 2], cell: [f32; 2]) -> bool {
    let half = 0.5 + MARGIN;
    let from_middle = |v: [f32; 2]| [0, 1].map(|i| f64::from(v[i]) - f64::from(cell[i]) - 0.5);
    let ([px, py], [qx, qy]) = (from_middle(p), from_middle(q));
    if px.min(qx) > half || px.max(qx) < -half || py.min(qy) > half || py.max(qy) < -half {
        return false;
    }
    let (dx, dy) = (qx - px, qy - py);
    (dx * py - dy * px).abs() <= (dx.abs() + dy.abs()) * half
}

/// Whether a caster certainly covers a raster point.
fn covers(Caster { record, origin }: &Caster, point: [f32; 2]) -> bool {
    let (x, y) = (point[0] - origin[0], point[1] - origin[1]);
    // The kernels fuse these; the bound has room for either rounding.
    (0..3).all(|i| record.a[i] * x + record.b[i] * y + record.c[i] > 1.5)
}
