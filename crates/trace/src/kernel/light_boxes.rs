//! Sixteen triangles as a frame of an area light sees them: boxes, sides, and their places on the curve that sorts them
//! into a tree (HM08 §5.3; [`crate::AreaLightTree`]).
//!
//! Sides and areas come from f64 lanes by the expressions of [`crate::AreaLight::side`] and
//! [`crate::Triangles::is_degenerate`]: the same operations in the same order, so that the answers are theirs. Boxes hold for
//! triangles that lie ahead of the frame's center, the others need the frame's slow way. Cost: some 250 operations for all
//! sixteen, and nine divisions.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, i32x16, prelude::*};
use glam::DVec3;

use super::doubles::{HALF, abs, cross, dot, load, minus, sum};
use super::shaft::FAR;
use super::{LANES, SimdLevel, bits_of, max3, min3};

/// A frame and its light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sight {
    /// Factors of raster coordinates and of nearness.
    pub(crate) scale: [f32; 2],
    /// What is nearer than this lies behind a flat light.
    pub(crate) limit: f32,
    /// Of a cube's face, how far beside its pyramid triangles still matter.
    pub(crate) reach: Option<f32>,
    /// Middle of the light, or the direction towards the sun.
    pub(crate) center: DVec3,
    pub(crate) is_sun: bool,
    /// Half sides of a box around all samples.
    pub(crate) half: DVec3,
}

/// Sixteen triangles by their corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct Corners {
    /// Raster x, y and nearness.
    pub(crate) raster: [[[f32; LANES]; 3]; 3],
    /// Positions.
    pub(crate) position: [[[f32; LANES]; 3]; 3],
}

/// What is found out about them, a bit a triangle.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// Those with area and finite corners.
    pub(crate) area: u32,
    /// All of the light is before their front, or behind their back.
    pub(crate) front: u32,
    pub(crate) back: u32,
    /// Those whose box holds; all others are either behind the frame or need another way.
    pub(crate) ahead: u32,
    /// Of those, what cannot come between a receiver of the frame and the light.
    pub(crate) apart: u32,
}

/// Looks at sixteen triangles; `bounds` are smallest and largest x and y, largest and smallest nearness.
pub(crate) fn look(
    level: SimdLevel,
    sight: &Sight,
    corners: &Corners,
    bounds: &mut [[f32; LANES]; 6],
) -> Seen {
    dispatch!(level.0, simd => look_impl(simd, sight, corners, bounds))
}

#[inline(always)]
fn look_impl<S: Simd>(simd: S, sight: &Sight, corners: &Corners, bounds: &mut [[f32; LANES]; 6]) -> Seen {
    let mut seen = Seen::default();
    for half in 0..2 {
        let [area, front, back] = sides(simd, sight, &corners.position, half);
        let shift = half * HALF;
        seen.area |= area << shift;
        seen.front |= front << shift;
        seen.back |= back << shift;
    }
    let splat = |v: f32| f32x16::splat(simd, v);
    let at = |value: usize| {
        [
            f32x16::from_slice(simd, &corners.raster[0][value]),
            f32x16::from_slice(simd, &corners.raster[1][value]),
            f32x16::from_slice(simd, &corners.raster[2][value]),
        ]
    };
    let (x, y, nearness) = (at(0), at(1), at(2));
    let zero = splat(0.0);
    let ahead = nearness[0].simd_gt(zero) & nearness[1].simd_gt(zero) & nearness[2].simd_gt(zero);
    seen.ahead = bits_of(simd, ahead);
    let (nearest, farthest) = (max3(nearness), min3(nearness));
    let limit = splat(sight.limit);
    let mut apart = farthest.simd_gt(limit);
    let (low, high) = ([min3(x), min3(y)], [max3(x), max3(y)]);
    if let Some(reach) = sight.reach {
        for (axis, at) in [x, y].into_iter().enumerate() {
            let mut beyond = [low[axis].simd_gt(splat(1.0)), high[axis].simd_lt(splat(-1.0))];
            for corner in 0..3 {
                let edge = splat(1.0) + splat(reach) * nearness[corner] + splat(1e-5);
                beyond[0] &= at[corner].simd_gt(edge);
                beyond[1] &= (-at[corner]).simd_gt(edge);
            }
            apart = apart | beyond[0] | beyond[1];
        }
    }
    seen.apart = bits_of(simd, apart);
    for axis in 0..2 {
        wider(simd, low[axis], sight.scale[0], -1.0).store_slice(&mut bounds[2 * axis]);
        wider(simd, high[axis], sight.scale[0], 1.0).store_slice(&mut bounds[2 * axis + 1]);
    }
    let (unit, far) = (splat(sight.scale[1]), splat(FAR));
    let nearest = nearest.min(limit) * unit * splat(1.0 + 4.0 * f32::EPSILON);
    nearest.min(far).store_slice(&mut bounds[4]);
    let farthest = farthest * unit;
    let farthest = farthest - farthest.abs() * splat(4.0 * f32::EPSILON);
    farthest.max(-far).store_slice(&mut bounds[5]);
    seen
}

/// Raster coordinates scaled and moved outwards by what rounding may have done.
#[inline(always)]
fn wider<S: Simd>(simd: S, v: f32x16<S>, scale: f32, side: f32) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let v = v * splat(scale);
    let v = v + splat(side) * (v.abs() * splat(2.0 * f32::EPSILON) + splat(1e-37));
    v.max(splat(-FAR)).min(splat(FAR))
}

/// Of eight triangles, bits of those with area, and of those before whose front and behind whose back all of the light is.
#[inline(always)]
fn sides<S: Simd>(simd: S, sight: &Sight, corners: &[[[f32; LANES]; 3]; 3], half: usize) -> [u32; 3] {
    let splat = |v: f64| f64x8::splat(simd, v);
    let (v0, v1, v2) = (
        load(simd, &corners[0], half),
        load(simd, &corners[1], half),
        load(simd, &corners[2], half),
    );
    let (a, b) = (minus(v1, v0), minus(v2, v0));
    let normal = cross(a, b);
    let size = sum(abs(normal));
    let zero = splat(0.0);
    let area = size.simd_gt(zero) & size.simd_lt(splat(f64::INFINITY));
    let center = [
        splat(sight.center.x),
        splat(sight.center.y),
        splat(sight.center.z),
    ];
    let from = if sight.is_sun { center } else { minus(center, v0) };
    let half_box = [splat(sight.half.x), splat(sight.half.y), splat(sight.half.z)];
    let middle = dot(normal, from);
    let [x, y, z] = abs(from);
    let reach = sum([x + half_box[0], y + half_box[1], z + half_box[2]]);
    let sizes = sum(abs(a)) * sum(abs(b)) * reach;
    let certain = middle
        .abs()
        .simd_gt(dot(abs(normal), half_box) + sizes * splat(1e-12));
    [
        area.to_bitmask() as u32,
        (certain & middle.simd_gt(zero)).to_bitmask() as u32,
        (certain & middle.simd_lt(zero)).to_bitmask() as u32,
    ]
}

/// The curve through perspective space along which a tree's triangles are sorted: 12 bits of each direction of the raster
/// interleaved, three of depth among them, all behind a class of sizes that keeps a large triangle from stretching the
/// boxes of small neighbours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    /// Where x, y and depth start, and one over how far they go.
    pub(crate) low: [f32; 3],
    pub(crate) inverse: [f32; 3],
    /// Whether raster coordinates are those of a parallel frame, which need no finite square.
    pub(crate) parallel: bool,
}

/// Bits of raster place in each direction, of depth, and of the size class: 30 in all.
const PLACE_BITS: u32 = 12;
const DEPTH_BITS: u32 = 3;
const CLASS_BITS: u32 = 3;

/// After how many bits of the raster place those of depth follow.
const DEPTH_AFTER: u32 = 10;

const _: () = assert!(2 * PLACE_BITS + DEPTH_BITS + CLASS_BITS == 30);

/// Where the boxes of sixteen triangles lie on a curve, as keys to be sorted.
pub(crate) fn places(level: SimdLevel, curve: &Curve, bounds: &[[f32; LANES]; 6]) -> [u32; LANES] {
    dispatch!(level.0, simd => places_impl(simd, curve, bounds))
}

#[inline(always)]
fn places_impl<S: Simd>(simd: S, curve: &Curve, bounds: &[[f32; LANES]; 6]) -> [u32; LANES] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let at = |value: usize| f32x16::from_slice(simd, &bounds[value]);
    let (x0, x1, y0, y1, nearest) = (at(0), at(1), at(2), at(3), at(4));
    let half = splat(0.5);
    let middle = mapped(simd, curve, [(x0 + x1) * half, (y0 + y1) * half]);
    let (low, high) = (mapped(simd, curve, [x0, y0]), mapped(simd, curve, [x1, y1]));
    let depth = if curve.parallel {
        -nearest
    } else {
        splat(1.0) / nearest
    };
    let extent = |axis: usize| (high[axis] - low[axis]) * splat(curve.inverse[axis]);
    let extent = extent(0).max(extent(1));
    // 0 for what spans half of the raster, one more for each halving.
    let mut class = i32x16::splat(simd, 0);
    let mut halved = 1.0;
    for _ in 1..1 << CLASS_BITS {
        halved *= 0.5;
        let one = extent
            .simd_le(splat(halved))
            .select(i32x16::splat(simd, 1), i32x16::splat(simd, 0));
        class += one;
    }
    let x = spread(simd, share(simd, curve, 0, middle[0], PLACE_BITS));
    let y = spread(simd, share(simd, curve, 1, middle[1], PLACE_BITS));
    let place = (x << 1) | y;
    let depth = share(simd, curve, 2, depth, DEPTH_BITS);
    let below = 2 * PLACE_BITS - DEPTH_AFTER;
    let upper = ((place >> below) << DEPTH_BITS) | depth;
    let lower = place & i32x16::splat(simd, (1 << below) - 1);
    let class = class << (2 * PLACE_BITS + DEPTH_BITS);
    let keys: [i32; LANES] = (class | (upper << below) | lower).into();
    keys.map(|key| key as u32)
}

/// A raster point on a finite square: perspective space has no border.
#[inline(always)]
fn mapped<S: Simd>(simd: S, curve: &Curve, [x, y]: [f32x16<S>; 2]) -> [f32x16<S>; 2] {
    if curve.parallel {
        return [x, y];
    }
    let one = f32x16::splat(simd, 1.0);
    let share = one / (one + x.abs() + y.abs());
    [x * share, y * share]
}

/// A coordinate as a whole number of so many bits.
#[inline(always)]
fn share<S: Simd>(simd: S, curve: &Curve, axis: usize, at: f32x16<S>, bits: u32) -> i32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    let most = (1 << bits) - 1;
    let share = (at - splat(curve.low[axis])) * splat(curve.inverse[axis] * (1 << bits) as f32);
    let whole: i32x16<S> = share.max(splat(0.0)).min(splat(most as f32)).to_int();
    // What is no number becomes anything.
    whole & i32x16::splat(simd, most)
}

/// Puts a zero before each of the lowest 16 bits.
#[inline(always)]
fn spread<S: Simd>(simd: S, mut v: i32x16<S>) -> i32x16<S> {
    for (shift, mask) in [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ] {
        v = (v | (v << shift)) & i32x16::splat(simd, mask);
    }
    v
}
