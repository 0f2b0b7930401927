//! Triangles of the frame: renumbered, wound so that the front stays the front, and without those that no ray
//! can hit.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Draw, take};
use crate::FrameGeometry;

/// Triangles a task works on.
const CHUNK: usize = 16384;

/// What one task did.
#[derive(Clone, Copy, Default)]
struct Outcome {
    kept: usize,
    non_finite: usize,
    degenerate: usize,
}

/// Fills indices, objects and the counts of dropped triangles; the vertices have to be there.
pub(super) fn write(draws: &[Draw], frame: &mut FrameGeometry) {
    let count = draws.last().map_or(0, |d| d.object.triangles.end as usize);
    let mut indices = std::mem::take(&mut frame.indices);
    indices.resize(count, [0; 3]);

    let mut rest = &mut indices[..];
    let mut chunks = Vec::new();
    for (object, draw) in draws.iter().enumerate() {
        for triangles in draw.primitive.triangles.chunks(CHUNK) {
            chunks.push((object, triangles, take(&mut rest, triangles.len())));
        }
    }
    let outcomes: Vec<(usize, usize, Outcome)> = chunks
        .into_par_iter()
        .map(|(object, from, to)| (object, from.len(), keep(&draws[object], from, to, frame)))
        .collect();

    frame.objects.clear();
    frame.objects.extend(draws.iter().map(|d| d.object.clone()));
    for object in &mut frame.objects {
        object.triangles = 0..0;
    }
    let (mut read, mut written) = (0, 0);
    let mut total = Outcome::default();
    for (object, len, outcome) in outcomes {
        // Only a chunk behind a dropped triangle has to move.
        if read != written {
            indices.copy_within(read..read + outcome.kept, written);
        }
        read += len;
        written += outcome.kept;
        frame.objects[object].triangles.end += outcome.kept as u32;
        total.non_finite += outcome.non_finite;
        total.degenerate += outcome.degenerate;
    }
    indices.truncate(written);
    let mut start = 0;
    for object in &mut frame.objects {
        let end = start + object.triangles.end;
        object.triangles = start..end;
        start = end;
    }
    frame.indices = indices;
    frame.dropped_non_finite = total.non_finite;
    frame.dropped_degenerate = total.degenerate;
}

/// Writes the triangles that can be hit to the front of `to`, in order.
fn keep(draw: &Draw, from: &[[u32; 3]], to: &mut [[u32; 3]], frame: &FrameGeometry) -> Outcome {
    let offset = draw.object.vertices.start;
    let mut outcome = Outcome::default();
    for &[a, b, c] in from {
        let [b, c] = if draw.mirrored { [c, b] } else { [b, c] };
        let triangle = [a, b, c].map(|i| i + offset);
        let corners = triangle.map(|i| frame.position(i));
        if !corners.iter().all(|p| p.is_finite()) {
            outcome.non_finite += 1;
        } else if has_no_area(corners) {
            outcome.degenerate += 1;
        } else {
            to[outcome.kept] = triangle;
            outcome.kept += 1;
        }
    }
    outcome
}

fn has_no_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a) == DVec3::ZERO
}
