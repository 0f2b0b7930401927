//! Where vertices lie with regard to the faces of a cube around a light, sixteen at a time.
//!
//! A face's pyramid has four sides. A triangle whose corners all lie outside of the same one has no part in the face,
//! so bits of corners, joined by "and", tell its faces without projecting it. Cost: about 70 vector instructions for
//! sixteen vertices and all six faces.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, prelude::*, u32x16};
use glam::Vec3;

use super::{LANES, SimdLevel};
use crate::Triangles;

/// Tangent of a pyramid's half angle as triangles are held against it: more than the receivers' own by far more than
/// rounding.
const TAN: f32 = 1.0005;

/// For vertices `first..first + out.len()`, four bits a face, in the order +X, -X, +Y, -Y, +Z, -Z: the sides of its
/// pyramid that they lie outside of. What is not a number lies outside of none.
pub(crate) fn outside_bits(
    level: SimdLevel,
    center: Vec3,
    triangles: &Triangles,
    first: usize,
    out: &mut [u32],
) {
    dispatch!(level.0, simd => outside_bits_impl(simd, center, triangles, first, out));
}

#[inline(always)]
fn outside_bits_impl<S: Simd>(simd: S, center: Vec3, triangles: &Triangles, first: usize, out: &mut [u32]) {
    let range = first..first + out.len();
    let axes = [triangles.x, triangles.y, triangles.z].map(|values| &values[range.clone()]);
    for (block, out) in out.chunks_mut(LANES).enumerate() {
        let from = block * LANES;
        let relative = |values: &[f32], center: f32| {
            let values = &values[from..from + out.len()];
            let lanes = if values.len() == LANES {
                f32x16::from_slice(simd, values)
            } else {
                f32x16::from_fn(simd, |i| values.get(i).copied().unwrap_or(0.0))
            };
            let (low, high) = lanes.widen();
            let c = f64x8::splat(simd, f64::from(center));
            (low - c).narrow(high - c)
        };
        let relative = [
            relative(axes[0], center.x),
            relative(axes[1], center.y),
            relative(axes[2], center.z),
        ];
        let bits: [u32; LANES] = bits(simd, relative).into();
        out.copy_from_slice(&bits[..out.len()]);
    }
}

#[inline(always)]
fn bits<S: Simd>(simd: S, relative: [f32x16<S>; 3]) -> u32x16<S> {
    let zero = u32x16::splat(simd, 0);
    let mut bits = zero;
    for axis in 0..3 {
        for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
            let edge = relative[axis] * f32x16::splat(simd, sign * TAN);
            for other in 0..2 {
                let v = relative[(axis + 1 + other) % 3];
                let bit = 1 << (4 * (2 * axis + side) + 2 * other);
                let above = v.simd_gt(edge).select(u32x16::splat(simd, bit), zero);
                let below = (-v).simd_gt(edge).select(u32x16::splat(simd, bit << 1), zero);
                bits = bits | above | below;
            }
        }
    }
    bits
}

/// The faces (a bit each) in which a triangle may have a part.
#[inline]
pub(crate) fn faces_of(corners: [u32; 3]) -> u8 {
    let [a, b, c] = corners;
    let outside = a & b & c;
    let outside = outside | outside >> 1;
    let outside = outside | outside >> 2;
    (0..6).fold(0, |faces, face| {
        faces | u8::from(outside >> (4 * face) & 1 == 0) << face
    })
}
