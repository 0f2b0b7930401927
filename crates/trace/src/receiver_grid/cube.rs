//! Which triangles and vertices each face of a light among the geometry has to look at.

use rayon::prelude::*;

use crate::Triangles;
use crate::kernel::cube::{faces_of, outside_bits};
use crate::kernel::pixels::LightFaces;
use crate::kernel::project::{RasterVertex, project};
use crate::kernel::{LANES, SimdLevel};
use crate::view::View;

/// Vertices or triangles done by one task.
const CHUNK: usize = 16 * 1024;

/// Parts of the geometry by face; everything is in the only face of other lights.
pub(super) struct FaceParts {
    /// Per triangle, a bit for each of the cube's faces; empty without a cube.
    triangles: Vec<u8>,
    /// As `triangles`, per sixteen vertices.
    vertices: Vec<u8>,
    /// The cube's face of each view.
    cube_faces: Vec<u8>,
}

impl FaceParts {
    pub(super) fn of(triangles: &Triangles, faces: &LightFaces, level: SimdLevel) -> Self {
        let mut parts = Self {
            triangles: Vec::new(),
            vertices: Vec::new(),
            cube_faces: vec![0; faces.views.len()],
        };
        let (Some(cube), Some(view)) = (&faces.cube, faces.views.first()) else {
            return parts;
        };
        for (cube_face, face) in cube.iter().enumerate() {
            if let Some(face) = face {
                parts.cube_faces[*face as usize] = cube_face as u8;
            }
        }
        let mut bits = vec![0u32; triangles.x.len()];
        bits.par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(i, out)| outside_bits(level, view.center, triangles, i * CHUNK, out));
        let of_corners = |t: &[u32; 3]| faces_of(t.map(|i| bits[i as usize]));
        parts.triangles = triangles.indices.par_iter().map(of_corners).collect();
        parts.vertices = needed_vertices(triangles, &parts.triangles);
        parts
    }

    /// Whether a triangle may have a part in a view.
    #[inline]
    pub(super) fn has(&self, face: u32, prim: u32) -> bool {
        self.triangles.is_empty() || self.triangles[prim as usize] >> self.cube_faces[face as usize] & 1 != 0
    }

    /// Projects the vertices of a view's triangles; the others are left as they are.
    pub(super) fn project(
        &self,
        face: u32,
        view: &View,
        triangles: &Triangles,
        level: SimdLevel,
        vertices: &mut Vec<RasterVertex>,
    ) {
        vertices.resize(triangles.x.len(), RasterVertex::default());
        let needed = |block: usize| {
            self.vertices.is_empty() || self.vertices[block] >> self.cube_faces[face as usize] & 1 != 0
        };
        vertices
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, out)| {
                let first = chunk * CHUNK / LANES;
                let blocks = out.len().div_ceil(LANES);
                let mut at = 0;
                while at < blocks {
                    let run = (at..blocks).take_while(|&b| needed(first + b)).count();
                    if run == 0 {
                        at += 1;
                        continue;
                    }
                    let range = at * LANES..((at + run) * LANES).min(out.len());
                    project(
                        level,
                        view,
                        triangles,
                        chunk * CHUNK + range.start,
                        &mut out[range],
                    );
                    at += run;
                }
            });
    }
}

/// Per sixteen vertices, the faces of the triangles that use one of them.
fn needed_vertices(triangles: &Triangles, faces: &[u8]) -> Vec<u8> {
    let blocks = triangles.x.len().div_ceil(LANES);
    let none = || vec![0u8; blocks];
    triangles
        .indices
        .par_chunks(faces.len().div_ceil(8).max(CHUNK))
        .zip(faces.par_chunks(faces.len().div_ceil(8).max(CHUNK)))
        .map(|(indices, faces)| {
            let mut needed = none();
            for (corners, faces) in indices.iter().zip(faces) {
                for corner in corners {
                    needed[*corner as usize / LANES] |= faces;
                }
            }
            needed
        })
        .reduce(none, |mut a, b| {
            a.iter_mut().zip(b).for_each(|(a, b)| *a |= b);
            a
        })
}
