//! The triangles of a cluster that a tile may see: projected for the tile, then sifted sixteen at a time, so that only
//! those are set up that hold a pixel centre and are not hidden.
//!
//! Vertices are projected once a tile in f64, counted from the tile's corner, and rounded then: no coordinate is
//! large, so bounds on errors are tight. Cost: about 30 operations a vertex and 25 instructions a triangle.

use fearless_simd::{Simd, dispatch, f32x16, prelude::*};

use super::batch::{
    BatchLanes, Bits, TilePlace, TriangleQueue, block_range, corner_lanes, pixel_range, up_to_four,
};
use super::project::project_lanes;
use super::tile::{BlockRect, TileBuffer, hides};
use super::{LANES, NEARNESS_BAND, SimdLevel, bits_of, max3, min3};
use crate::clusters::CLUSTER;
use crate::view::View;

/// Working memory for one cluster.
#[derive(Clone, Debug)]
pub(crate) struct ClusterLanes {
    vertices: [[f32; 4]; VERTICES],
    corners: [[[f32; 4]; LANES]; 3],
    rect: [[i32; LANES]; 4],
    nearest: [f32; LANES],
}

/// Vertices of a cluster at most.
const VERTICES: usize = 3 * CLUSTER;
const _: () = assert!(VERTICES.is_multiple_of(LANES));

impl Default for ClusterLanes {
    fn default() -> Self {
        Self {
            vertices: [[0.0; 4]; VERTICES],
            corners: [[[0.0; 4]; LANES]; 3],
            rect: [[0; LANES]; 4],
            nearest: [0.0; LANES],
        }
    }
}

/// Memory of one thread for drawing a tile.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileWork {
    pub(crate) queue: TriangleQueue,
    pub(crate) lanes: BatchLanes,
    cluster: ClusterLanes,
}

/// A cluster as a tile meets it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    /// Its triangles.
    pub(crate) prims: &'a [u32],
    /// Of each triangle the corners, as numbers of vertices.
    pub(crate) corners: &'a [[u8; 3]],
    /// Sixteen x, sixteen y and sixteen z of vertices, and so on; the last are filled up with anything.
    pub(crate) points: &'a [[f32; LANES]],
    /// The blocks of the tile that it may reach.
    pub(crate) rect: BlockRect,
    /// Bound on its nearness, widened by the band.
    pub(crate) nearest: f32,
}

/// Puts those triangles of a cluster that are to be set up into the queue; returns whether it was hidden whole.
pub(crate) fn sift_cluster(
    level: SimdLevel,
    tile: &TileBuffer,
    work: &mut TileWork,
    seen: &Seen,
    place: &TilePlace,
    view: &View,
) -> bool {
    dispatch!(level.0, simd => sift_cluster_impl(simd, tile, work, seen, place, view))
}

#[inline(always)]
fn sift_cluster_impl<S: Simd>(
    simd: S,
    tile: &TileBuffer,
    work: &mut TileWork,
    seen: &Seen,
    place: &TilePlace,
    view: &View,
) -> bool {
    if place.hierarchy && hides(simd, tile, seen.rect, seen.nearest) {
        return true;
    }
    let TileWork {
        queue, cluster: own, ..
    } = work;
    project(simd, view, seen.points, place, &mut own.vertices);
    let batches = seen.corners.chunks(LANES).zip(seen.prims.chunks(LANES));
    for (corners, prims) in batches {
        let kept = sift(simd, own, corners, place);
        for lane in Bits(kept.both()) {
            let small = kept.small & (1 << lane) != 0;
            if small && place.hierarchy && own.hidden(tile, lane) {
                continue;
            }
            let corners = [own.corners[0][lane], own.corners[1][lane], own.corners[2][lane]];
            queue.push(prims[lane], corners);
        }
    }
    false
}

/// Raster points from the tile's corner.
#[inline(always)]
fn project<S: Simd>(
    simd: S,
    view: &View,
    points: &[[f32; LANES]],
    place: &TilePlace,
    out: &mut [[f32; 4]; VERTICES],
) {
    let origin = [f64::from(place.origin[0]), f64::from(place.origin[1])];
    for (points, out) in points.chunks_exact(3).zip(out.chunks_mut(LANES)) {
        let points = [
            f32x16::from_slice(simd, &points[0]),
            f32x16::from_slice(simd, &points[1]),
            f32x16::from_slice(simd, &points[2]),
        ];
        let (projected, rests) = project_lanes(simd, view, points, origin);
        let [x, y, nearness] = projected;
        let rests = rests.bitcast::<f32x16<S>>();
        let (x_low, x_high) = x.interleave(nearness);
        let (y_low, y_high) = y.interleave(rests);
        let words = out.as_flattened_mut();
        let (first, second) = x_low.interleave(y_low);
        let (third, fourth) = x_high.interleave(y_high);
        first.store_slice(&mut words[..LANES]);
        second.store_slice(&mut words[LANES..2 * LANES]);
        third.store_slice(&mut words[2 * LANES..3 * LANES]);
        fourth.store_slice(&mut words[3 * LANES..]);
    }
}

/// Lanes that are to be set up.
struct Kept {
    /// With a rectangle of up to 4 x 4 blocks.
    small: u32,
    large: u32,
}

impl Kept {
    #[inline(always)]
    fn both(&self) -> u32 {
        self.small | self.large
    }
}

impl ClusterLanes {
    /// Whether the blocks of a small rectangle hide the triangle.
    #[inline(always)]
    fn hidden(&self, tile: &TileBuffer, lane: usize) -> bool {
        let at = |i: usize| self.rect[i][lane] as u32;
        let nearest = self.nearest[lane];
        for y in at(2)..=at(3) {
            for x in at(0)..=at(1) {
                if tile.farthest[tile.block(x, y)] <= nearest {
                    return false;
                }
            }
        }
        true
    }
}

/// Which of up to sixteen triangles may cover a pixel centre of the tile.
#[inline(always)]
fn sift<S: Simd>(simd: S, own: &mut ClusterLanes, corners: &[[u8; 3]], place: &TilePlace) -> Kept {
    for (lane, corner) in corners.iter().enumerate() {
        own.corners[0][lane] = own.vertices[corner[0] as usize];
        own.corners[1][lane] = own.vertices[corner[1] as usize];
        own.corners[2][lane] = own.vertices[corner[2] as usize];
    }
    let [x, y, nearness] = corner_lanes(simd, &own.corners, 0, [0.0; 2]);
    let zero = f32x16::splat(simd, 0.0);
    let used = u32::MAX >> (32 - corners.len() as u32);
    let ahead = nearness[0].simd_ge(zero) & nearness[1].simd_ge(zero) & nearness[2].simd_ge(zero);
    let all_behind = nearness[0].simd_lt(zero) & nearness[1].simd_lt(zero) & nearness[2].simd_lt(zero);
    // In front, but so far outside that nothing bounds the nearness.
    let bounded = bits_of(simd, min3(nearness).simd_gt(zero));
    let x = pixel_range(simd, x, place.size[0]);
    let y = pixel_range(simd, y, place.size[1]);
    let holds_centre = x[0].simd_le(x[1]) & y[0].simd_le(y[1]);
    let x = block_range(simd, x, &mut own.rect, 0);
    let y = block_range(simd, y, &mut own.rect, 2);
    (max3(nearness) * f32x16::splat(simd, 1.0 + NEARNESS_BAND)).store_slice(&mut own.nearest);
    let (ahead, all_behind) = (bits_of(simd, ahead), bits_of(simd, all_behind));
    let centre = bits_of(simd, holds_centre) & ahead & used;
    let small = centre & bounded & up_to_four(simd, x, y);
    Kept {
        small,
        large: (centre & !small) | (!ahead & !all_behind & used),
    }
}
