//! The triangles of a cluster as casters of a light: projected, and sifted sixteen at a time by where they lie.
//!
//! Vertices are projected in f64 and rounded once, see [`super::project`]. Cost: about 40 operations a vertex, 40
//! instructions and 12 stores a triangle.

use fearless_simd::{Simd, dispatch, f32x16, i32x16, mask32x16, prelude::*};

use super::edges::{VertexLanes, area_error, coordinate_error};
use super::pixels::LIGHT_TILE;
use super::project::project_lanes;
use super::{LANES, NEARNESS_BAND, SimdLevel, bits_of, load3, max3, min3};
use crate::clusters::CLUSTER;
use crate::view::View;

/// A light's raster: the view and its light tiles in each direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightRaster<'v> {
    pub(crate) view: &'v View,
    pub(crate) tiles: u32,
    /// See [`View::rounding`].
    pub(crate) rounding: f32,
    /// Whether front faces turn from x to y in the raster: the sign of a triangle's area is the side that the light sees.
    pub(crate) right_handed: bool,
}

impl<'v> LightRaster<'v> {
    pub(crate) fn new(view: &'v View, tiles: u32) -> Self {
        Self {
            view,
            tiles,
            rounding: view.rounding() as f32,
            right_handed: view.right.cross(view.up).dot(view.forward) > 0.0,
        }
    }
}

/// The triangles of a cluster, in batches of sixteen.
#[derive(Clone, Debug)]
pub(crate) struct CasterLanes {
    vertices: ClusterVertices,
    pub(crate) batches: [CasterBatch; BATCHES],
}

/// x, y and nearness of a cluster's vertices, sixteen each.
pub(super) type ClusterVertices = [[[f32; LANES]; 3]; BATCHES * 3];

/// Batches of a cluster.
pub(super) const BATCHES: usize = CLUSTER / LANES;

/// Sixteen triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct CasterBatch {
    pub(crate) corners: VertexLanes,
    /// First column and row, last column and row of the light tiles of each.
    pub(crate) tiles: [[i32; LANES]; 4],
    /// A nearness that each does not exceed, widened by the band; infinite if it is not known.
    pub(crate) nearest: [f32; LANES],
    /// A bit for each triangle that lies in front and reaches into the raster.
    pub(crate) ahead: u32,
    /// A bit for each that lies neither in front nor behind.
    pub(crate) crossing: u32,
    /// A bit for each whose front the light certainly sees, and for each whose back it does.
    pub(crate) sides: [u32; 2],
}

impl CasterBatch {
    /// Whether the light sees a triangle's front, if that is certain.
    #[inline(always)]
    pub(crate) fn front(&self, lane: usize) -> Option<bool> {
        let [front, back] = self.sides.map(|lanes| lanes >> lane & 1 != 0);
        (front || back).then_some(front)
    }
}

impl Default for CasterLanes {
    fn default() -> Self {
        Self {
            vertices: [[[0.0; LANES]; 3]; BATCHES * 3],
            batches: std::array::from_fn(|_| CasterBatch::default()),
        }
    }
}

/// Projects a cluster, whose vertices lie at `points`: sixteen x, y and z, and so on. Returns the number of batches.
pub(crate) fn sift_casters(
    level: SimdLevel,
    raster: &LightRaster,
    points: &[[f32; LANES]],
    corners: &[[u8; 3]],
    out: &mut CasterLanes,
) -> usize {
    dispatch!(level.0, simd => sift_casters_impl(simd, raster, points, corners, out));
    corners.len().div_ceil(LANES)
}

#[inline(always)]
fn sift_casters_impl<S: Simd>(
    simd: S,
    raster: &LightRaster,
    points: &[[f32; LANES]],
    corners: &[[u8; 3]],
    out: &mut CasterLanes,
) {
    project_cluster(simd, raster.view, points, &mut out.vertices);
    for (corners, batch) in corners.chunks(LANES).zip(&mut out.batches) {
        pick_corners(&out.vertices, corners, &mut batch.corners);
        place(simd, raster, u32::MAX >> (32 - corners.len() as u32), batch);
    }
}

/// Projects the vertices of a cluster.
#[inline(always)]
pub(super) fn project_cluster<S: Simd>(
    simd: S,
    view: &View,
    points: &[[f32; LANES]],
    vertices: &mut ClusterVertices,
) {
    for (points, out) in points.chunks_exact(3).zip(vertices) {
        let points = [
            f32x16::from_slice(simd, &points[0]),
            f32x16::from_slice(simd, &points[1]),
            f32x16::from_slice(simd, &points[2]),
        ];
        let ([x, y, nearness], _) = project_lanes(simd, view, points, [0.0; 2]);
        x.store_slice(&mut out[0]);
        y.store_slice(&mut out[1]);
        nearness.store_slice(&mut out[2]);
    }
}

/// The corners of up to sixteen triangles, given as numbers of vertices.
#[inline(always)]
pub(super) fn pick_corners(vertices: &ClusterVertices, corners: &[[u8; 3]], lanes: &mut VertexLanes) {
    for (lane, numbers) in corners.iter().enumerate() {
        for (corner, number) in numbers.iter().enumerate() {
            let (block, at) = (*number as usize / LANES, *number as usize % LANES);
            let [x, y, nearness] = &vertices[block];
            lanes.x[corner][lane] = x[at];
            lanes.y[corner][lane] = y[at];
            lanes.nearness[corner][lane] = nearness[at];
        }
    }
}

/// How far outside of its rectangle a caster may be met, see [`crate::bins`].
const SLACK: f32 = 1.0 / 64.0;

/// Where the triangles of a batch lie.
#[inline(always)]
fn place<S: Simd>(simd: S, raster: &LightRaster, used: u32, batch: &mut CasterBatch) {
    let zero = f32x16::splat(simd, 0.0);
    let nearness = load3(simd, &batch.corners.nearness);
    let (least, most) = (min3(nearness), max3(nearness));
    let ahead = nearness[0].simd_ge(zero) & nearness[1].simd_ge(zero) & nearness[2].simd_ge(zero);
    let behind = nearness[0].simd_lt(zero) & nearness[1].simd_lt(zero) & nearness[2].simd_lt(zero);
    // Far outside of the raster a vertex has an order but no nearness.
    let known = ahead & least.simd_gt(zero);
    let bound = most * f32x16::splat(simd, 1.0 + 2.0 * NEARNESS_BAND);
    known
        .select(bound, f32x16::splat(simd, f32::INFINITY))
        .store_slice(&mut batch.nearest);
    let mut seen = ahead;
    for (axis, lanes) in [&batch.corners.x, &batch.corners.y].into_iter().enumerate() {
        let (slack, limit) = (
            f32x16::splat(simd, SLACK),
            f32x16::splat(simd, (raster.tiles * LIGHT_TILE) as f32),
        );
        let lanes = load3(simd, lanes);
        let (low, high) = (min3(lanes) - slack, max3(lanes) + slack);
        seen = seen & low.simd_le(high) & high.simd_ge(zero) & low.simd_lt(limit);
        let scale = f32x16::splat(simd, 1.0 / LIGHT_TILE as f32);
        let last = f32x16::splat(simd, raster.tiles as f32 - 1.0);
        let first = (low * scale).max(zero).min(last).to_int::<i32x16<S>>();
        let end = (high * scale).max(zero).min(last).to_int::<i32x16<S>>();
        first.store_slice(&mut batch.tiles[axis]);
        end.store_slice(&mut batch.tiles[axis + 2]);
    }
    batch.ahead = bits_of(simd, seen) & used;
    batch.crossing = !bits_of(simd, ahead | behind) & used;
    let [positive, negative] = orientations(simd, raster.rounding, &batch.corners);
    let (positive, negative) = (bits_of(simd, positive & known), bits_of(simd, negative & known));
    batch.sides = if raster.right_handed {
        [positive, negative]
    } else {
        [negative, positive]
    };
}

/// The triangles whose area in the raster certainly is positive, and those whose certainly is negative.
#[inline(always)]
fn orientations<S: Simd>(simd: S, rounding: f32, corners: &VertexLanes) -> [mask32x16<S>; 2] {
    let (x, y) = (load3(simd, &corners.x), load3(simd, &corners.y));
    let area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    let error = area_error(simd, x, y, coordinate_error(simd, x, y, rounding)) * f32x16::splat(simd, 2.0);
    [area.simd_gt(error), area.simd_lt(-error)]
}
