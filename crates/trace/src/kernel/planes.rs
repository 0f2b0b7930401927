//! Sixteen triangles as eye rays meet them, and on which sides of them two places lie, in f64 lanes.
//!
//! Every value has the operations of [`crate::exact::attributes`] in its order and without fused multiply-adds, so that
//! hit parameters made of them are those of single rays, bit for bit. Cost: some 70 operations of eight lanes, twice.

use fearless_simd::{Simd, dispatch, f64x8, mask64x8, prelude::*};
use glam::DVec3;

use super::batch::four_lanes;
use super::doubles::{HALF, Three, abs, cross, dot, minus, splat3};
use super::{LANES, SimdLevel};
use crate::Light;

/// A generous bound on the relative error of a difference, 2^-46.
const ROUNDING: f64 = 1.0 / (1u64 << 46) as f64;

/// A triangle as eye rays from one center meet it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PixelPlane {
    pub(super) normal: [f64; 3],
    /// Sums of which less than this share is left have cancelled.
    pub(super) doubt: [f64; 3],
    /// Height of the triangle's plane over the center; not a number if it has cancelled.
    pub(super) height: f64,
}

impl PixelPlane {
    /// One whose every pixel is to be done by itself.
    pub(crate) fn unsound(self) -> Self {
        Self {
            height: f64::NAN,
            ..self
        }
    }
}

/// Corners of sixteen triangles: x, y, z and anything.
pub(crate) type CornerLanes = [[[f32; 4]; LANES]; 3];

/// On which side of sixteen triangles a place lies, as [`crate::exact::side`] has it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sides {
    /// A bit for each triangle of which that is beyond doubt.
    known: u32,
    /// A bit for each of whose front it certainly is.
    front: u32,
}

impl Sides {
    /// Whether it is the front of that triangle, if that is beyond doubt.
    #[inline(always)]
    pub(crate) fn front(&self, lane: usize) -> Option<bool> {
        (self.known >> lane & 1 != 0).then_some(self.front >> lane & 1 != 0)
    }
}

/// The planes of sixteen triangles as seen from `center`, and the sides of `ends`.
pub(crate) fn find_planes<const ENDS: usize>(
    level: SimdLevel,
    center: DVec3,
    corners: &CornerLanes,
    ends: [&Light; ENDS],
) -> ([PixelPlane; LANES], [Sides; ENDS]) {
    dispatch!(level.0, simd => find_planes_impl(simd, center, corners, ends))
}

#[inline(always)]
fn find_planes_impl<S: Simd, const ENDS: usize>(
    simd: S,
    center: DVec3,
    corners: &CornerLanes,
    ends: [&Light; ENDS],
) -> ([PixelPlane; LANES], [Sides; ENDS]) {
    let mut planes = [PixelPlane::default(); LANES];
    let mut sides = [Sides::default(); ENDS];
    let [a, b, c] = [
        widened(simd, &corners[0]),
        widened(simd, &corners[1]),
        widened(simd, &corners[2]),
    ];
    for half in 0..2 {
        let corners = [a[half], b[half], c[half]];
        let planes = &mut planes[half * HALF..(half + 1) * HALF];
        let triangles = find_half(simd, center, corners, planes);
        for (sides, end) in sides.iter_mut().zip(ends) {
            let (known, front) = triangles.side(simd, end);
            sides.known |= (known.to_bitmask() as u32) << (half * HALF);
            sides.front |= (front.to_bitmask() as u32) << (half * HALF);
        }
    }
    (planes, sides)
}

/// The lower and the upper half of sixteen points.
#[inline(always)]
pub(super) fn widened<S: Simd>(simd: S, points: &[[f32; 4]; LANES]) -> [Three<S>; 2] {
    let [x, y, z, _] = four_lanes(simd, points);
    let (x, y, z) = (x.widen(), y.widen(), z.widen());
    [[x.0, y.0, z.0], [x.1, y.1, z.1]]
}

/// What tells the sides of eight triangles.
struct Half<S: Simd> {
    first: Three<S>,
    normal: Three<S>,
    doubt: Three<S>,
    size: f64x8<S>,
}

#[inline(always)]
fn find_half<S: Simd>(
    simd: S,
    center: DVec3,
    [v0, v1, v2]: [Three<S>; 3],
    planes: &mut [PixelPlane],
) -> Half<S> {
    let (edge1, edge2) = (minus(v1, v0), minus(v2, v0));
    let a0 = minus(v0, splat3(simd, center));
    let normal = cross(edge1, edge2);
    let height = dot(a0, normal);
    let ([ax, ay, az], [bx, by, bz]) = (abs(edge1), abs(edge2));
    let share = f64x8::splat(simd, 1.0 / (1u64 << 27) as f64);
    let doubt = [
        (ay * bz + az * by) * share,
        (az * bx + ax * bz) * share,
        (ax * by + ay * bx) * share,
    ];
    let sound = height.abs().simd_gt(dot(doubt, abs(a0)));
    let sound_height = sound.select(height, f64x8::splat(simd, f64::NAN));
    let (n, d, heights) = (stored(normal), stored(doubt), <[f64; HALF]>::from(sound_height));
    for (lane, plane) in planes.iter_mut().enumerate() {
        *plane = PixelPlane {
            normal: [n[0][lane], n[1][lane], n[2][lane]],
            doubt: [d[0][lane], d[1][lane], d[2][lane]],
            height: heights[lane],
        };
    }
    Half {
        first: v0,
        normal,
        doubt,
        size: largest([ax, ay, az]).max(largest([bx, by, bz])),
    }
}

/// Three coordinates of eight triangles.
#[inline(always)]
fn stored<S: Simd>([x, y, z]: Three<S>) -> [[f64; HALF]; 3] {
    [x.into(), y.into(), z.into()]
}

impl<S: Simd> Half<S> {
    /// The triangles of which it is known on which side an end lies, and those of which that is the front.
    #[inline(always)]
    fn side(&self, simd: S, end: &Light) -> (mask64x8<S>, mask64x8<S>) {
        let (value, bound) = match *end {
            Light::Point(position) => {
                let a = minus(splat3(simd, position.as_dvec3()), self.first);
                // The exact side rounds differences of positions, each by 2^-53 of its size.
                let far = largest(abs(a)) + self.size;
                let share = f64x8::splat(simd, ROUNDING);
                let rounding = far * far * (self.size + far * share) * share;
                (dot(a, self.normal), dot(self.doubt, abs(a)) + rounding)
            }
            Light::Directional(direction) => {
                let d = splat3(simd, direction.as_dvec3());
                (dot(d, self.normal), dot(self.doubt, abs(d)))
            }
        };
        let front = value.simd_gt(f64x8::splat(simd, 0.0));
        (value.abs().simd_gt(bound), front)
    }
}

#[inline(always)]
fn largest<S: Simd>([x, y, z]: Three<S>) -> f64x8<S> {
    x.max(y).max(z)
}
