//! Where the triangles of a cluster lie in a camera's raster, sixteen at a time: for clusters that are too large on the raster
//! to be put into tiles whole.
//!
//! Vertices are projected in f64 and rounded once, see [`super::project`]. Cost: about 40 operations a vertex, 30
//! instructions and 12 stores a triangle.

use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*};

use super::batch::pixel_range;
use super::casters::{BATCHES, ClusterVertices, pick_corners, project_cluster};
use super::edges::VertexLanes;
use super::{LANES, NEARNESS_BAND, SimdLevel, bits_of, load3, max3};
use crate::view::View;

/// The triangles of a cluster, in batches of sixteen.
#[derive(Clone, Debug)]
pub(crate) struct ClusterRects {
    vertices: ClusterVertices,
    corners: VertexLanes,
    pub(crate) batches: [RectBatch; BATCHES],
}

/// Sixteen triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct RectBatch {
    /// First column and row, last column and row of the pixels whose centres lie in the rectangle of each.
    pub(crate) pixels: [[i32; LANES]; 4],
    /// Bound on the nearness of each, widened by the band.
    pub(crate) nearest: [f32; LANES],
    /// A bit for each triangle whose rectangle holds a pixel centre.
    pub(crate) seen: u32,
    /// A bit for each of which nothing is known: it reaches behind the view's start, or far out of the raster.
    pub(crate) unknown: u32,
}

impl RectBatch {
    /// First pixel column and row, last pixel column and row of one.
    #[inline(always)]
    pub(crate) fn rect(&self, lane: usize) -> [u32; 4] {
        let at = |i: usize| self.pixels[i][lane] as u32;
        [at(0), at(1), at(2), at(3)]
    }
}

impl Default for ClusterRects {
    fn default() -> Self {
        Self {
            vertices: [[[0.0; LANES]; 3]; BATCHES * 3],
            corners: VertexLanes::default(),
            batches: std::array::from_fn(|_| RectBatch::default()),
        }
    }
}

/// Projects a cluster, whose vertices lie at `points`: sixteen x, y and z, and so on. Returns the number of batches.
pub(crate) fn find_rects(
    level: SimdLevel,
    view: &View,
    points: &[[f32; LANES]],
    corners: &[[u8; 3]],
    out: &mut ClusterRects,
) -> usize {
    dispatch!(level.0, simd => find_rects_impl(simd, view, points, corners, out));
    corners.len().div_ceil(LANES)
}

#[inline(always)]
fn find_rects_impl<S: Simd>(
    simd: S,
    view: &View,
    points: &[[f32; LANES]],
    corners: &[[u8; 3]],
    out: &mut ClusterRects,
) {
    project_cluster(simd, view, points, &mut out.vertices);
    for (corners, batch) in corners.chunks(LANES).zip(&mut out.batches) {
        pick_corners(&out.vertices, corners, &mut out.corners);
        let used = u32::MAX >> (32 - corners.len() as u32);
        find_batch(simd, [view.width, view.height], used, &out.corners, batch);
    }
}

#[inline(always)]
fn find_batch<S: Simd>(simd: S, size: [u32; 2], used: u32, corners: &VertexLanes, batch: &mut RectBatch) {
    let zero = f32x16::splat(simd, 0.0);
    let nearness = load3(simd, &corners.nearness);
    let known = nearness[0].simd_gt(zero) & nearness[1].simd_gt(zero) & nearness[2].simd_gt(zero);
    let behind = nearness[0].simd_lt(zero) & nearness[1].simd_lt(zero) & nearness[2].simd_lt(zero);
    let bound = max3(nearness) * f32x16::splat(simd, 1.0 + 2.0 * NEARNESS_BAND);
    bound.store_slice(&mut batch.nearest);
    let mut seen = known;
    for (axis, lanes) in [&corners.x, &corners.y].into_iter().enumerate() {
        let [first, last] = pixel_range(simd, load3(simd, lanes), size[axis]);
        seen &= first.simd_le(last);
        first.to_int::<i32x16<S>>().store_slice(&mut batch.pixels[axis]);
        last.to_int::<i32x16<S>>()
            .store_slice(&mut batch.pixels[axis + 2]);
    }
    batch.seen = bits_of(simd, seen) & used;
    batch.unknown = !bits_of(simd, known | behind) & used;
}
