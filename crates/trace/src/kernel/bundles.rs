//! Bundles: the rays from sixteen neighbouring receivers to samples in the same place on the light.
//!
//! In a light's perspective space ([`super::shaft`]) the ray from a receiver at X0 with nearness w to a sample at (s, u) is
//! X(n) = X0 + S (n - w) with the slope S = (s - u X0) pz / (pz - u). Of sixteen neighbours with samples of one slot
//! ([`super::light_points`]) neither X0 nor S differs by much, while all slots together spread over the light. So a triangle
//! meets few of the bundles of a batch. A bundle is searched for like the rays of many receivers, with slopes of its own.
//!
//! Errors: slopes are intervals that hold what rounding of samples, receivers and these operations may do; where an interval would
//! be no use, it has no end. Cost: some 60 operations a slot, 15 for sixteen triangles and a slot.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::light_points::SamplePoints;
use super::lines::LightBox;
use super::shaft::{FAR, FrameLanes, Places, Search, mask_of, plain, range_of};
use super::{load3, splat3};

/// The bundle of each slot, from the receivers `active`. `search` is that of all their rays.
#[inline(always)]
pub(crate) fn bundles<S: Simd>(
    simd: S,
    (frame, light): (&FrameLanes, &LightBox),
    places: &Places<S>,
    points: &SamplePoints,
    (active, search): (u32, &Search),
    out: &mut Vec<Search>,
) {
    out.clear();
    for (offsets, lanes) in points.offsets.iter().zip(&points.lanes) {
        let d = load3(simd, offsets);
        let [x, y] = match frame.reach {
            Some(_) => parallel_slopes(simd, (frame, light), d),
            None => slopes(simd, (frame, light), places, d),
        };
        let mask = mask_of(simd, lanes & active);
        out.push(search.with_slopes([range_of(simd, mask, x), range_of(simd, mask, y)]));
    }
}

/// Smallest and largest slopes along x and y of the rays to the samples `d`, in perspective.
#[inline(always)]
fn slopes<S: Simd>(
    simd: S,
    (frame, light): (&FrameLanes, &LightBox),
    places: &Places<S>,
    d: [f32x16<S>; 3],
) -> [[f32x16<S>; 2]; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let center = frame.center.iter().map(|c| c.abs()).sum::<f32>();
    let error = splat((light.reach.iter().sum::<f32>() * 3.0 + center) * (8.0 * f32::EPSILON));
    let middle = splat3(simd, frame.center);
    let q = [d[0] - middle[0], d[1] - middle[1], d[2] - middle[2]];
    let (s, t, u) = (
        plain(simd, q, frame.right),
        -plain(simd, q, frame.up),
        plain(simd, q, frame.forward),
    );
    let [near, far] = places.depth;
    let (depth, vague) = ((near + far) * splat(0.5), (far - near) * splat(0.5));
    let ratio = depth / (depth - u);
    // How much of the ratio may be wrong.
    let share = (vague + error) * splat(1.1) / (near - u - error) + splat(8.0 * f32::EPSILON);
    let known = near.simd_gt(splat(frame.depth * 1.001))
        & near.simd_gt(splat(0.0))
        & share.simd_gt(splat(0.0))
        & share.simd_lt(splat(0.1));
    slope_pair(
        simd,
        [s, t],
        u,
        [places.x, places.y],
        [ratio, share, error],
        known,
    )
}

#[inline(always)]
fn slope_pair<S: Simd>(
    simd: S,
    ends: [f32x16<S>; 2],
    u: f32x16<S>,
    starts: [[f32x16<S>; 2]; 2],
    [ratio, share, error]: [f32x16<S>; 3],
    known: fearless_simd::mask32x16<S>,
) -> [[f32x16<S>; 2]; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let mut pair = [[splat(0.0); 2]; 2];
    for i in 0..2 {
        let [low, high] = starts[i];
        let (at, vague) = ((low + high) * splat(0.5), (high - low) * splat(0.5));
        let drift = ends[i] - u * at;
        let sizes = ends[i].abs() + (u * at).abs();
        let off = error * (splat(1.0) + at.abs() + vague) * splat(1.1)
            + u.abs() * vague * splat(1.1)
            + sizes * splat(8.0 * f32::EPSILON);
        let slope = drift * ratio;
        let slack = (off + drift.abs() * share) * ratio.abs() * splat(1.2);
        let known = known & slack.simd_lt(splat(1e15)) & slope.abs().simd_lt(splat(1e15));
        pair[i] = [
            known.select(slope - slack, splat(-FAR)),
            known.select(slope + slack, splat(FAR)),
        ];
    }
    pair
}

/// As [`slopes`], where samples are directions.
#[inline(always)]
fn parallel_slopes<S: Simd>(
    simd: S,
    (frame, light): (&FrameLanes, &LightBox),
    d: [f32x16<S>; 3],
) -> [[f32x16<S>; 2]; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let error = splat(light.reach.iter().sum::<f32>() * (32.0 * f32::EPSILON));
    let middle = splat3(simd, light.middle);
    let q = [d[0] + middle[0], d[1] + middle[1], d[2] + middle[2]];
    let towards = -plain(simd, q, frame.forward);
    let known = towards.simd_gt(splat(0.1));
    let (one, wide, far) = (splat(1.0), splat(1.2), splat(FAR));
    let across = [plain(simd, q, frame.right), -plain(simd, q, frame.up)];
    let mut pair = [[far; 2]; 2];
    for (pair, across) in pair.iter_mut().zip(across) {
        let slope = across / towards;
        let slack = error * (one + slope.abs()) / towards * wide;
        *pair = [
            known.select(slope - slack, -far),
            known.select(slope + slack, far),
        ];
    }
    pair
}
