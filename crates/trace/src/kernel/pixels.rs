//! Surface points of a tile's pixels, and where a light sees them, sixteen pixels at a time.
//!
//! The hit parameter of a pixel on its triangle is computed in f64 lanes with the operations of
//! [`crate::exact::attributes`] in its order and without fused multiply-adds, so the points are those of
//! [`crate::Receiver::along`], bit for bit. Pixels whose sums cancel are reported, to be done one by one. Where a light sees
//! points is found in fewer operations, unless that could show ([`Quick`]).
//!
//! Cost: some 30 vector instructions for sixteen pixels and each of their triangles, and 60 to project them.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, i32x16, mask32x16, mask64x8, prelude::*, u32x16};
use glam::DVec3;

use super::batch::Bits;
use super::doubles::{HALF, Three, minus, splat3};
use super::planes::PixelPlane;
use super::project::project_relative;
use super::tile::{BLOCK, NONE};
use super::{LANES, SimdLevel, bits_of};
use crate::view::{Arrangement, View};

/// The eye rays of a tile, as sums of a part for the column and one for the row.
#[derive(Clone, Debug, Default)]
pub(crate) struct TileRays {
    parallel: bool,
    center: DVec3,
    forward: DVec3,
    /// Per column of blocks: x, y and z of the four columns, twice.
    columns: Vec<[[f64; HALF]; 3]>,
    /// Per half row of blocks: x, y and z of the two rows, four times each.
    rows: Vec<[[f64; HALF]; 3]>,
    /// The same and `forward`.
    ahead: Vec<[[f64; HALF]; 3]>,
}

impl TileRays {
    /// The rays of the pixels from (x, y) on, in so many columns and rows of blocks; the operations of
    /// [`View::ray`].
    pub(crate) fn set(&mut self, view: &View, [x, y]: [u32; 2], blocks: [u32; 2]) {
        let [cx, cy] = view.middle;
        self.parallel = matches!(view.arrangement, Arrangement::Parallel { .. });
        (self.center, self.forward) = (view.center.as_dvec3(), view.forward);
        let split = |v: &dyn Fn(usize) -> DVec3| {
            let mut lanes = [[0.0; HALF]; 3];
            let [x, y, z] = &mut lanes;
            for (i, ((x, y), z)) in x.iter_mut().zip(y).zip(z).enumerate() {
                [*x, *y, *z] = v(i).to_array();
            }
            lanes
        };
        self.columns.clear();
        self.columns.extend((0..blocks[0]).map(|block| {
            split(&|i| {
                let x = f64::from(x + block * BLOCK + i as u32 % BLOCK) + 0.5;
                view.right * ((x - cx) / view.scale_x)
            })
        }));
        self.rows.clear();
        self.rows.extend((0..blocks[1] * 2).map(|half| {
            split(&|i| {
                let y = f64::from(y + half * (BLOCK / 2) + i as u32 / BLOCK) + 0.5;
                view.up * ((cy - y) / view.scale_y)
            })
        }));
        self.ahead.clone_from(&self.rows);
        for ahead in &mut self.ahead {
            for (axis, lanes) in ahead.iter_mut().enumerate() {
                lanes.iter_mut().for_each(|lane| *lane += view.forward[axis]);
            }
        }
    }

    /// A bound on the coordinates of all starts.
    pub(crate) fn farthest_start(&self) -> f64 {
        let largest =
            |lanes: &[[f64; HALF]; 3]| lanes.as_flattened().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let beside = if self.parallel {
            let most = |all: &[[[f64; HALF]; 3]]| all.iter().map(largest).fold(0.0, f64::max);
            most(&self.columns) + most(&self.rows)
        } else {
            0.0
        };
        self.center.abs().max_element() + beside
    }

    /// What half a block's pixels add to the direction, or to the start in a parallel view.
    #[inline(always)]
    fn offsets<S: Simd>(&self, simd: S, block: usize, half: usize) -> [f64x8<S>; 3] {
        let stride = self.columns.len();
        let [cx, cy, cz] = &self.columns[block % stride];
        let [rx, ry, rz] = &self.rows[block / stride * 2 + half];
        [
            f64x8::from_slice(simd, cx) + f64x8::from_slice(simd, rx),
            f64x8::from_slice(simd, cy) + f64x8::from_slice(simd, ry),
            f64x8::from_slice(simd, cz) + f64x8::from_slice(simd, rz),
        ]
    }

    /// Directions in a perspective view.
    #[inline(always)]
    fn directions<S: Simd>(&self, simd: S, block: usize, half: usize) -> [f64x8<S>; 3] {
        let [x, y, z] = self.offsets(simd, block, half);
        let splat = |v: f64| f64x8::splat(simd, v);
        let DVec3 { x: fx, y: fy, z: fz } = self.forward;
        [splat(fx) + x, splat(fy) + y, splat(fz) + z]
    }

    /// The points at parameter `t`; the operations of [`crate::Receiver::along`].
    #[inline(always)]
    pub(super) fn points<S: Simd>(&self, simd: S, block: usize, half: usize, t: f64x8<S>) -> [f64x8<S>; 3] {
        let splat = |v: f64| f64x8::splat(simd, v);
        let (center, forward) = (self.center, self.forward);
        let (cx, cy, cz) = (splat(center.x), splat(center.y), splat(center.z));
        let (fx, fy, fz) = (splat(forward.x), splat(forward.y), splat(forward.z));
        let [x, y, z] = self.offsets(simd, block, half);
        if self.parallel {
            [cx + x + fx * t, cy + y + fy * t, cz + z + fz * t]
        } else {
            [cx + (fx + x) * t, cy + (fy + y) * t, cz + (fz + z) * t]
        }
    }
}

impl TileRays {
    /// The points at parameter `t` of perspective rays as seen from a light, of which the center of the rays is `center`
    /// away. Not those of [`Self::points`] to the bit, for half the operations: see [`Quick`].
    #[inline(always)]
    fn seen_from<S: Simd>(
        &self,
        simd: S,
        (block, half): (usize, usize),
        center: Three<S>,
        t: f64x8<S>,
    ) -> Three<S> {
        let stride = self.columns.len();
        let [cx, cy, cz] = &self.columns[block % stride];
        let [rx, ry, rz] = &self.ahead[block / stride * 2 + half];
        let x = f64x8::from_slice(simd, cx) + f64x8::from_slice(simd, rx);
        let y = f64x8::from_slice(simd, cy) + f64x8::from_slice(simd, ry);
        let z = f64x8::from_slice(simd, cz) + f64x8::from_slice(simd, rz);
        [
            x.mul_add(t, center[0]),
            y.mul_add(t, center[1]),
            z.mul_add(t, center[2]),
        ]
    }
}

/// Pixels of a block (a bit each) that see the same triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub(crate) block: u32,
    pub(crate) pixels: u32,
    /// Position of the triangle's plane.
    pub(crate) plane: u32,
}

/// Finds the spans of a tile. `plane_of` tells the position of a triangle's plane.
pub(crate) fn find_spans(
    level: SimdLevel,
    prims: &[[u32; LANES]],
    plane_of: &mut dyn FnMut(u32) -> u32,
    spans: &mut Vec<Span>,
) {
    spans.clear();
    dispatch!(level.0, simd => find_spans_impl(simd, prims, plane_of, spans));
}

#[inline(always)]
fn find_spans_impl<S: Simd>(
    simd: S,
    prims: &[[u32; LANES]],
    plane_of: &mut dyn FnMut(u32) -> u32,
    spans: &mut Vec<Span>,
) {
    // Neighbouring blocks often see the same triangle.
    let mut last = (NONE, 0);
    for (block, prims) in prims.iter().enumerate() {
        let lanes = u32x16::from_slice(simd, prims);
        let mut left = !equal(simd, lanes, NONE) & (u32::MAX >> (32 - LANES));
        while left != 0 {
            let prim = prims[left.trailing_zeros() as usize];
            let pixels = equal(simd, lanes, prim);
            left &= !pixels;
            if prim != last.0 {
                last = (prim, plane_of(prim));
            }
            spans.push(Span {
                block: block as u32,
                pixels,
                plane: last.1,
            });
        }
    }
}

/// A bit for each lane with that value.
#[inline(always)]
fn equal<S: Simd>(simd: S, lanes: u32x16<S>, value: u32) -> u32 {
    bits_of(simd, lanes.simd_eq(u32x16::splat(simd, value)))
}

/// Hit parameters of the pixels in `spans`, in ascending order of blocks, into `t`. `unsound` gets block and pixels
/// whose parameter is not good.
pub(crate) fn hit_parameters(
    level: SimdLevel,
    rays: &TileRays,
    spans: &[Span],
    planes: &[PixelPlane],
    t: &mut [[f64; LANES]],
    unsound: &mut Vec<(u32, u32)>,
) {
    dispatch!(level.0, simd => hit_parameters_impl(simd, rays, spans, planes, t, unsound));
}

#[inline(always)]
fn hit_parameters_impl<S: Simd>(
    simd: S,
    rays: &TileRays,
    spans: &[Span],
    planes: &[PixelPlane],
    t: &mut [[f64; LANES]],
    unsound: &mut Vec<(u32, u32)>,
) {
    let splat = |v: f64| f64x8::splat(simd, v);
    for same_block in spans.chunk_by(|a, b| a.block == b.block) {
        let block = same_block[0].block as usize;
        let mut bad = 0;
        for half in 0..2 {
            let shift = half * HALF;
            let [x, y, z] = rays.directions(simd, block, half);
            let (ax, ay, az) = (x.abs(), y.abs(), z.abs());
            let mut found = splat(0.0);
            for span in same_block {
                let PixelPlane {
                    normal,
                    doubt,
                    height,
                } = planes[span.plane as usize];
                let steepness = x * splat(normal[0]) + y * splat(normal[1]) + z * splat(normal[2]);
                let least = splat(doubt[0]) * ax + splat(doubt[1]) * ay + splat(doubt[2]) * az;
                let value = splat(height) / steepness;
                let pixels = mask64x8::from_bitmask(simd, u64::from(span.pixels >> shift) & 0xff);
                let sound = steepness.abs().simd_gt(least) & value.simd_eq(value);
                bad |= ((pixels & !sound).to_bitmask() as u32) << shift;
                found = pixels.select(value, found);
            }
            found.store_slice(&mut t[block][shift..shift + HALF]);
        }
        if bad != 0 {
            unsound.push((block as u32, bad));
        }
    }
}

/// The views of a light as receivers are projected into them.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightFaces {
    pub(crate) views: Vec<View>,
    /// Of a light among the geometry, the view of each of a cube's faces, in the order +X, -X, +Y, -Y, +Z, -Z.
    pub(crate) cube: Option<[Option<u32>; 6]>,
}

/// Sixteen receivers as a light sees them. 200 bytes.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct BlockPoints {
    pub(crate) x: [f32; LANES],
    pub(crate) y: [f32; LANES],
    pub(crate) nearness: [f32; LANES],
    /// The eye's tile.
    pub(crate) eye_tile: u32,
    /// Block of that tile.
    pub(crate) block: u32,
}

/// Receivers of a block that lie together in one light tile. 44 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Light tile, counted through all faces.
    pub(crate) light_tile: u32,
    /// Position of the block's points among those of its part of the eye's tiles.
    pub(crate) points: u32,
    /// That part.
    pub(crate) part: u16,
    /// A bit for each receiver.
    pub(crate) lanes: u16,
    /// The triangle that all of them lie on; [`NONE`] if there are several.
    pub(crate) own: u32,
    /// Rectangle of them, from the light tile's corner.
    pub(crate) min: [f32; 2],
    pub(crate) max: [f32; 2],
    /// Smallest and largest nearness of them.
    pub(crate) farthest: f32,
    pub(crate) nearest: f32,
}

/// Side of a light tile in units of the face's raster.
pub(crate) const LIGHT_TILE: u32 = 64;

/// The pixels of one of the eye's tiles that ask about a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asking<'a> {
    pub(crate) eye_tile: u32,
    /// The part of the eye's tiles that this one belongs to.
    pub(crate) part: u16,
    /// What each pixel sees, block by block.
    pub(crate) prims: &'a [[u32; LANES]],
    pub(crate) rays: &'a TileRays,
    /// Hit parameters, block by block.
    pub(crate) t: &'a [[f64; LANES]],
    /// A bit for each pixel of each block.
    pub(crate) pixels: &'a [u16],
}

/// Projects the surface points of the pixels that ask. Each that a caster may come before gets its lane in one of the
/// `entries`, whose points are relative to their light tile.
pub(crate) fn project_receivers(
    level: SimdLevel,
    asking: &Asking,
    faces: &LightFaces,
    points: &mut Vec<BlockPoints>,
    entries: &mut Vec<Entry>,
) {
    dispatch!(level.0, simd => project_receivers_impl(simd, asking, faces, points, entries));
}

#[inline(always)]
fn project_receivers_impl<S: Simd>(
    simd: S,
    asking: &Asking,
    faces: &LightFaces,
    points: &mut Vec<BlockPoints>,
    entries: &mut Vec<Entry>,
) {
    let Asking { rays, t, pixels, .. } = *asking;
    let Some(first) = faces.views.first() else {
        return;
    };
    let light = first.center.as_dvec3();
    let quick = Quick::new(rays, faces);
    for (block, &asked) in pixels.iter().enumerate() {
        if asked == 0 {
            continue;
        }
        let (low, high) = t[block].split_at(HALF);
        let t = [f64x8::from_slice(simd, low), f64x8::from_slice(simd, high)];
        let halves = if quick.any {
            let center = splat3(simd, rays.center - light);
            [
                rays.seen_from(simd, (block, 0), center, t[0]),
                rays.seen_from(simd, (block, 1), center, t[1]),
            ]
        } else {
            exact_halves(simd, rays, light, block, t)
        };
        let of_face = faces_of(simd, faces, &halves, u32::from(asked));
        let any = |bits, &lanes: &u32| bits << 1 | u32::from(lanes != 0);
        for face in Bits(of_face.iter().rev().fold(0, any)) {
            let lanes = of_face[face];
            let view = &faces.views[face];
            let mut projected = project_block(simd, view, &halves);
            if !quick.suffices(simd, face, projected[2], lanes) {
                projected = project_block(simd, view, &exact_halves(simd, rays, light, block, t));
            }
            let place = (view, face as u32, block);
            sort_block(simd, asking, place, lanes, projected, points, entries);
        }
    }
}

/// The points of a block as seen from a light, rounded as [`crate::Receiver::along`] has them.
#[inline(always)]
fn exact_halves<S: Simd>(
    simd: S,
    rays: &TileRays,
    light: DVec3,
    block: usize,
    t: [f64x8<S>; 2],
) -> [Three<S>; 2] {
    let light = splat3(simd, light);
    [
        minus(rays.points(simd, block, 0, t[0]), light),
        minus(rays.points(simd, block, 1, t[1]), light),
    ]
}

/// Bound on what receivers in a light's raster may be off by, in its units, for not being rounded as exact decisions round
/// them: to be added to [`View::rounding`]. Far below what rounding to f32 does to them.
pub(crate) const QUICK_ERROR: f64 = 1.0 / (1u64 << 20) as f64;

/// Where points made by [`TileRays::seen_from`] are good enough to be projected. A few roundings of the coordinates of eye
/// and light, at 2^-53 each, tell them from exact ones; seen from close by they grow with nearness.
struct Quick {
    /// Whether it may be tried.
    any: bool,
    /// For each face the nearness of the nearest point that may be projected.
    nearest: [f32; 6],
}

impl Quick {
    #[inline(always)]
    fn new(rays: &TileRays, faces: &LightFaces) -> Self {
        let mut nearest = [0.0; 6];
        for (nearest, view) in nearest.iter_mut().zip(&faces.views) {
            let coordinates = rays.center.abs().max_element() + view.center.as_dvec3().abs().max_element();
            let allowed = QUICK_ERROR / view.spread() / 2f64.powi(-46);
            let beside = f64::from(view.width) / view.scale_x + f64::from(view.height) / view.scale_y;
            *nearest = match view.arrangement {
                // Part of the error is in proportion to the distance of the point.
                Arrangement::Perspective if allowed > 64.0 => (allowed * 0.5 / coordinates) as f32,
                Arrangement::Parallel { reach } => {
                    let far = coordinates + reach + beside;
                    // Nearness is off by a share of `far`, which its band must hold, too.
                    let good = allowed > far && reach * 2f64.powi(24) > far;
                    if good { f32::INFINITY } else { 0.0 }
                }
                _ => 0.0,
            };
        }
        let any = !rays.parallel && nearest.iter().any(|&n| n > 0.0);
        Self { any, nearest }
    }

    /// Whether these points of a block are good enough in a face.
    #[inline(always)]
    fn suffices<S: Simd>(&self, simd: S, face: usize, nearness: f32x16<S>, lanes: u32) -> bool {
        let close = nearness.abs().simd_le(f32x16::splat(simd, self.nearest[face]));
        !self.any || lanes & !bits_of(simd, close) == 0
    }
}

/// Which of the asked points lie in which view.
#[inline(always)]
fn faces_of<S: Simd>(simd: S, faces: &LightFaces, halves: &[Three<S>; 2], asked: u32) -> [u32; 6] {
    let mut of_face = [0; 6];
    match (&faces.cube, faces.views.first()) {
        (_, None) => (),
        (None, _) => of_face[0] = asked,
        (Some(cube), Some(_)) => {
            let of_cube = cube_faces(simd, halves);
            for (face, lanes) in cube.iter().zip(of_cube) {
                if let Some(face) = face {
                    of_face[*face as usize] = lanes & asked;
                }
            }
        }
    }
    of_face
}

#[inline(always)]
fn project_block<S: Simd>(simd: S, view: &View, halves: &[Three<S>; 2]) -> [f32x16<S>; 3] {
    let low = project_relative(simd, view, halves[0]);
    let high = project_relative(simd, view, halves[1]);
    [
        low[0].narrow(high[0]),
        low[1].narrow(high[1]),
        low[2].narrow(high[2]),
    ]
}

/// Which points lie in which of a cube's faces: those whose axis is closest to the direction. Rounding at a seam does not
/// matter, for neighbouring faces overlap.
#[inline(always)]
fn cube_faces<S: Simd>(simd: S, [low, high]: &[Three<S>; 2]) -> [u32; 6] {
    let x = low[0].narrow(high[0]);
    let y = low[1].narrow(high[1]);
    let z = low[2].narrow(high[2]);
    let largest = x.abs().max(y.abs()).max(z.abs());
    let mut rest = u32::MAX >> (32 - LANES);
    let mut of_face = [0; 6];
    let zero = f32x16::splat(simd, 0.0);
    let signs = [x.simd_gt(zero), y.simd_gt(zero), z.simd_gt(zero)];
    let longest = [
        x.abs().simd_ge(largest),
        y.abs().simd_ge(largest),
        z.abs().simd_ge(largest),
    ];
    for axis in 0..3 {
        let along = longest[axis].to_bitmask() as u32 & rest;
        let positive = signs[axis].to_bitmask() as u32;
        of_face[2 * axis] = along & positive;
        of_face[2 * axis + 1] = along & !positive;
        rest &= !along;
    }
    of_face
}

#[inline(always)]
fn within<S: Simd>(simd: S, v: f32x16<S>, size: u32) -> mask32x16<S> {
    let end = f32x16::splat(simd, size as f32 + 1.0);
    v.simd_ge(f32x16::splat(simd, -1.0)) & v.simd_le(end)
}

/// Column or row of light tiles.
#[inline(always)]
fn tile_index<S: Simd>(simd: S, v: f32x16<S>, tiles: u32) -> i32x16<S> {
    let scaled = v * f32x16::splat(simd, 1.0 / LIGHT_TILE as f32);
    let last = f32x16::splat(simd, tiles as f32 - 1.0);
    let kept = scaled.max(f32x16::splat(simd, 0.0)).min(last);
    kept.to_int::<i32x16<S>>()
}

/// How far from each other the receivers of an entry may lie on either axis, in units of the face's raster: a block that
/// shows an edge of something has receivers far apart.
const TOGETHER: f32 = 6.0;

/// Puts the points of a block into the light tiles of one face.
#[inline(always)]
fn sort_block<S: Simd>(
    simd: S,
    asking: &Asking,
    (view, face, block): (&View, u32, usize),
    asked: u32,
    [x, y, nearness]: [f32x16<S>; 3],
    points: &mut Vec<BlockPoints>,
    entries: &mut Vec<Entry>,
) {
    // Elsewhere no caster can come before a point.
    let ahead = nearness.simd_gt(f32x16::splat(simd, 0.0));
    let seen = within(simd, x, view.width) & within(simd, y, view.height) & ahead;
    let mut left = bits_of(simd, seen) & asked;
    if left == 0 {
        return;
    }
    let tiles = [view.width, view.height].map(|size| size / LIGHT_TILE);
    let column = tile_index(simd, x, tiles[0]);
    let row = tile_index(simd, y, tiles[1]);
    let tile = (row * tiles[0] as i32 + column).bitcast::<u32x16<S>>();
    let position = points.len() as u32;
    let side = f32x16::splat(simd, LIGHT_TILE as f32);
    let x = x - column.to_float::<f32x16<S>>() * side;
    let y = y - row.to_float::<f32x16<S>>() * side;
    let prims = &asking.prims[block];
    let at = BlockPoints {
        x: x.into(),
        y: y.into(),
        nearness: nearness.into(),
        eye_tile: asking.eye_tile,
        block: block as u32,
    };
    let tile_of = <[u32; LANES]>::from(tile);
    let seen_prims = u32x16::from_slice(simd, prims);
    let reach = f32x16::splat(simd, TOGETHER);
    while left != 0 {
        let first = left.trailing_zeros() as usize;
        let near_x = (x - f32x16::splat(simd, at.x[first])).abs().simd_le(reach);
        let near_y = (y - f32x16::splat(simd, at.y[first])).abs().simd_le(reach);
        let same = tile.simd_eq(u32x16::splat(simd, tile_of[first])) & near_x & near_y;
        let same = bits_of(simd, same) & left;
        left &= !same;
        let lanes = mask32x16::from_bitmask(simd, u64::from(same));
        let own = equal(simd, seen_prims, prims[first]);
        entries.push(Entry {
            light_tile: face * tiles[0] * tiles[1] + tile_of[first],
            points: position,
            part: asking.part,
            lanes: same as u16,
            own: if same & !own == 0 { prims[first] } else { NONE },
            min: [least(simd, lanes, x), least(simd, lanes, y)],
            max: [-least(simd, lanes, -x), -least(simd, lanes, -y)],
            farthest: least(simd, lanes, nearness),
            nearest: -least(simd, lanes, -nearness),
        });
    }
    points.push(at);
}

/// The least value among these lanes.
#[inline(always)]
fn least<S: Simd>(simd: S, lanes: mask32x16<S>, v: f32x16<S>) -> f32 {
    lanes.select(v, f32x16::splat(simd, f32::INFINITY)).reduce_min()
}
