//! The surface points of pixels as the kernels of area lights take them, sixteen at a time.
//!
//! Points are made in f64 lanes, bit for bit those of [`crate::Receiver::along`] ([`super::pixels`]), and rounded to f32
//! relative to the light's origin, as one by one. Bounds on their errors are those of a receiver or a little larger.
//!
//! Cost: some 80 vector instructions for sixteen receivers.

use fearless_simd::{Simd, dispatch, f32x16, f64x8, mask64x8, prelude::*};
use glam::DVec3;

use super::doubles::HALF;
use super::light_points::Askers;
use super::lines::{LightBox, ReceiverLanes};
use super::pixels::TileRays;
use super::{LANES, SimdLevel, bits_of};

/// What receivers are relative to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Origin<'l> {
    /// Where f32 coordinates start, and what they are scaled by.
    pub(crate) origin: DVec3,
    pub(crate) unit: f64,
    /// The light's middle, and the direction it shines along; zero if it shines to all sides.
    pub(crate) center: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) light: &'l LightBox,
    /// Points farther off, in scaled coordinates, are not for the kernels.
    pub(crate) farthest: f32,
}

/// The pixels of some blocks of a tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PixelPoints<'p> {
    pub(crate) rays: &'p TileRays,
    /// A bound on coordinates of where the rays start.
    pub(crate) eye: f64,
    /// Hit parameters, block by block.
    pub(crate) t: &'p [[f64; LANES]],
    /// Triangle of every pixel, block by block.
    pub(crate) prims: &'p [[u32; LANES]],
}

/// Makes the receivers `asked` (a bit each) of a list of blocks. Gives, for each block, those that the light shines at: which
/// are in lanes, and which are too far off.
pub(crate) fn place_blocks(
    level: SimdLevel,
    origin: &Origin,
    points: &PixelPoints,
    blocks: &[Option<(u32, u16)>],
    (receivers, askers): (&mut [ReceiverLanes], &mut [Askers]),
    lanes: [&mut [u32]; 2],
) {
    dispatch!(level.0, simd => place_blocks_impl(simd, origin, points, blocks, (receivers, askers), lanes));
}

#[inline(always)]
fn place_blocks_impl<S: Simd>(
    simd: S,
    origin: &Origin,
    points: &PixelPoints,
    blocks: &[Option<(u32, u16)>],
    (receivers, askers): (&mut [ReceiverLanes], &mut [Askers]),
    [near, far]: [&mut [u32]; 2],
) {
    for (batch, block) in blocks.iter().enumerate() {
        (near[batch], far[batch]) = (0, 0);
        let Some((block, asked)) = *block else { continue };
        if asked != 0 {
            let lanes = (&mut receivers[batch], &mut askers[batch]);
            [near[batch], far[batch]] = place_block(simd, origin, points, (block as usize, asked), lanes);
        }
    }
}

#[inline(always)]
fn place_block<S: Simd>(
    simd: S,
    origin: &Origin,
    points: &PixelPoints,
    (block, asked): (usize, u16),
    (receivers, askers): (&mut ReceiverLanes, &mut Askers),
) -> [u32; 2] {
    let (low, high) = points.t[block].split_at(HALF);
    let halves = [
        points.rays.points(simd, block, 0, f64x8::from_slice(simd, low)),
        points.rays.points(simd, block, 1, f64x8::from_slice(simd, high)),
    ];
    let lit = shone_at(simd, origin, halves[0]) | shone_at(simd, origin, halves[1]) << HALF;
    let mut size = f32x16::splat(simd, 0.0);
    let (from, center) = (origin.origin.to_array(), origin.center.to_array());
    for axis in 0..3 {
        let [low, high] = [halves[0][axis], halves[1][axis]];
        let (at, unit) = (f64x8::splat(simd, from[axis]), f64x8::splat(simd, origin.unit));
        let p: f32x16<S> = ((low - at) * unit).narrow((high - at) * unit);
        p.store_slice(&mut receivers.p[axis]);
        size = size.max(p.abs());
        let middle = f64x8::splat(simd, center[axis]);
        (low - middle)
            .narrow(high - middle)
            .store_slice(&mut askers.offset[axis]);
    }
    size.store_slice(&mut receivers.size);
    let [edge, plane] = errors(simd, origin, points.eye, size);
    edge.store_slice(&mut receivers.edge_error);
    plane.store_slice(&mut receivers.plane_error);
    receivers.own = points.prims[block];
    let near = bits_of(simd, size.simd_lt(f32x16::splat(simd, origin.farthest)));
    let asked = lit & u32::from(asked);
    [asked & near, asked & !near]
}

/// The operations of [`crate::AreaLight::shines_at`] for finite points.
#[inline(always)]
fn shone_at<S: Simd>(simd: S, origin: &Origin, p: [f64x8<S>; 3]) -> u32 {
    let splat = |v: f64| f64x8::splat(simd, v);
    let (zero, infinite) = (splat(0.0), splat(f64::INFINITY));
    let largest = [p[0].abs(), p[1].abs(), p[2].abs()];
    let finite: mask64x8<S> =
        largest[0].simd_lt(infinite) & largest[1].simd_lt(infinite) & largest[2].simd_lt(infinite);
    let (center, normal) = (origin.center, origin.normal);
    if normal == DVec3::ZERO {
        return finite.to_bitmask() as u32;
    }
    let x = (p[0] - splat(center.x)) * splat(normal.x);
    let y = (p[1] - splat(center.y)) * splat(normal.y);
    let z = (p[2] - splat(center.z)) * splat(normal.z);
    (finite & (x + y + z).simd_gt(zero)).to_bitmask() as u32
}

/// Bounds as [`LightBox::errors`] has them.
#[inline(always)]
fn errors<S: Simd>(simd: S, origin: &Origin, eye: f64, size: f32x16<S>) -> [f32x16<S>; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    // A receiver's own error is 2^-40 of the coordinates of the eye and of the way from there, which are below this.
    let largest = eye * 2.0 + origin.origin.abs().max_element();
    let own = 2f64.powi(-40) * 1.001;
    let fixed = (largest * origin.unit * own) as f32;
    let own = size.mul_add(splat(own as f32), splat(fixed));
    let light = origin.light;
    let far = (size * splat(3.0) / splat(light.plane_scale)).max(splat(1.0));
    let [edge_roundoff, plane_roundoff] = LightBox::ROUNDOFFS;
    let largest = splat(light.largest());
    let edge = if light.weight == 0.0 {
        largest * far
    } else {
        size + largest
    };
    // A little more, for these operations may be rounded otherwise than one by one.
    let plane = far.mul_add(splat(plane_roundoff), own * splat(2.0 / light.plane_scale));
    [edge * splat(edge_roundoff * 1.0001), plane * splat(1.0001)]
}
