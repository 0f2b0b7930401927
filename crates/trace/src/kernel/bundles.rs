//! Bundles: the rays from sixteen neighbouring receivers to samples in the same place on the light.
//!
//! In a light's perspective space ([`super::shaft`]) the ray from a receiver at X0 with nearness w to a sample at (s, u) is
//! X(n) = X0 + S (n - w) with the slope S = (s - u X0) pz / (pz - u). Of sixteen neighbours with samples of one slot
//! ([`super::light_points`]) neither X0 nor S differs by much, while all slots together spread over the light. So a triangle
//! meets few of the bundles of a batch, and which is told from its box for eight bundles at once.
//!
//! Errors: slopes are intervals that hold what rounding of samples, receivers and these operations may do; where an interval would
//! be no use, it has no end. Cost: some 60 operations a slot, 25 a triangle and eight slots.

use fearless_simd::{Simd, f32x8, f32x16, prelude::*};

use super::light_points::SamplePoints;
use super::lines::{LightBox, each3, load3};
use super::shaft::{Bounds, FAR, FrameLanes, Places, mask_of, plain};

/// Bundles told apart at once.
pub(crate) const WIDTH: usize = 8;

/// Smallest and largest slopes of eight bundles.
#[derive(Clone, Copy, Debug)]
struct Slopes {
    x: [[f32; WIDTH]; 2],
    y: [[f32; WIDTH]; 2],
}

/// The bundles of a batch.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bundles {
    slopes: Vec<Slopes>,
    bounds: Bounds,
    /// Nearness of the farthest and the nearest receiver.
    farthest: f32,
    nearest: f32,
}

impl Bundles {
    /// Takes the rays from the receivers `active`, which have these bounds, to their samples.
    #[inline(always)]
    pub(crate) fn set<S: Simd>(
        &mut self,
        simd: S,
        (frame, light): (&FrameLanes, &LightBox),
        places: &Places<S>,
        points: &SamplePoints,
        (active, bounds): (u32, &Bounds),
    ) {
        self.bounds = *bounds;
        let [low, high] = bounds.depth;
        let rounding = 4.0 * f32::EPSILON;
        (self.farthest, self.nearest) = match frame.reach {
            Some(reach) => (reach - high - reach * rounding, reach - low + reach * rounding),
            None if low > 0.0 => ((1.0 - rounding) / high, (1.0 + rounding) / low),
            None => (-FAR, FAR),
        };
        self.slopes.clear();
        for (slot, (offsets, lanes)) in points.offsets.iter().zip(&points.lanes).enumerate() {
            if slot % WIDTH == 0 {
                // Nothing meets what is empty.
                let none = [[FAR; WIDTH], [-FAR; WIDTH]];
                self.slopes.push(Slopes { x: none, y: none });
            }
            let lanes = lanes & active;
            if lanes == 0 {
                continue;
            }
            let d = load3(simd, offsets);
            let [x, y] = match frame.reach {
                Some(_) => parallel_slopes(simd, (frame, light), d),
                None => slopes(simd, (frame, light), places, d),
            };
            let mask = mask_of(simd, lanes);
            let far = f32x16::splat(simd, FAR);
            let all = self.slopes.last_mut().expect("pushed above");
            all.x[0][slot % WIDTH] = mask.select(x[0], far).reduce_min();
            all.x[1][slot % WIDTH] = mask.select(x[1], -far).reduce_max();
            all.y[0][slot % WIDTH] = mask.select(y[0], far).reduce_min();
            all.y[1][slot % WIDTH] = mask.select(y[1], -far).reduce_max();
        }
    }

    /// A bit for each of eight bundles that may meet a box.
    #[inline(always)]
    pub(crate) fn met<S: Simd>(
        &self,
        simd: S,
        eight: usize,
        [x0, x1, y0, y1, nearest, farthest]: [f32; 6],
    ) -> u32 {
        let splat = |v: f32| f32x8::splat(simd, v);
        // Wider than what rounding of these few operations may do.
        let most = splat((nearest - self.farthest).max(0.0) * 1.00001);
        let least = splat((farthest - self.nearest).max(0.0) * 0.99999);
        let slopes = &self.slopes[eight];
        let Bounds { x, y, .. } = self.bounds;
        let lengths = [most, least];
        let left = splat(x[0]) + drift(simd, &slopes.x[0], lengths)[0];
        let right = splat(x[1]) + drift(simd, &slopes.x[1], lengths)[1];
        let top = splat(y[0]) + drift(simd, &slopes.y[0], lengths)[0];
        let bottom = splat(y[1]) + drift(simd, &slopes.y[1], lengths)[1];
        let apart = left.simd_gt(splat(x1))
            | right.simd_lt(splat(x0))
            | top.simd_gt(splat(y1))
            | bottom.simd_lt(splat(y0));
        !(apart.to_bitmask() as u32) & 0xff
    }
}

/// How far rays of these slopes go aside over two lengths, the smaller value first.
#[inline(always)]
fn drift<S: Simd>(simd: S, slope: &[f32; WIDTH], [most, least]: [f32x8<S>; 2]) -> [f32x8<S>; 2] {
    let slope = f32x8::from_slice(simd, slope);
    let (a, b) = (slope * most, slope * least);
    [a.min(b), a.max(b)]
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
    let q = each3(|axis| d[axis] - splat(frame.center[axis]));
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
    let q = each3(|axis| d[axis] + splat(light.middle[axis]));
    let towards = -plain(simd, q, frame.forward);
    let known = towards.simd_gt(splat(0.1));
    let range = |across: f32x16<S>| {
        let slope = across / towards;
        let slack = error * (splat(1.0) + slope.abs()) / towards * splat(1.2);
        [
            known.select(slope - slack, splat(-FAR)),
            known.select(slope + slack, splat(FAR)),
        ]
    };
    let right = range(plain(simd, q, frame.right));
    let down = range(-plain(simd, q, frame.up));
    [right, down]
}
