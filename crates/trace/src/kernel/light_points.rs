//! Samples of an area light for sixteen receivers at once: the points of [`crate::AreaLight::sample`], bit for bit.
//!
//! Cost: some 90 vector operations a sample, for all sixteen. Only multiplications, additions, divisions and roots,
//! which are rounded alike at every level; nothing here may be fused.

use fearless_simd::{Simd, f32x16, i32x16, prelude::*, u32x16};

use super::lines::each3;
use super::{LANES, load3};
use crate::area_light::{COS, SIN, Shape};
use crate::samples::{DIMENSION, HASH, SCRAMBLE, second};
use crate::{AreaLight, Samples};

/// Sixteen receivers as the samples need them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Askers {
    /// The pixel of each.
    pub(crate) pixel: [u32; LANES],
    /// Each receiver relative to the light's middle.
    pub(crate) offset: [[f32; LANES]; 3],
}

/// Samples of sixteen receivers by their place on the light: slot by slot the samples, at most one of each receiver, that
/// lie in the same box of the unit square. The first points of a (0, 2)-sequence lie in boxes of their own.
#[derive(Clone, Debug, Default)]
pub(crate) struct SamplePoints {
    /// Offsets from the light's middle: for each slot, x, y and z of sixteen receivers.
    pub(crate) offsets: Vec<[[f32; LANES]; 3]>,
    /// For each slot, the receivers that have a sample in it.
    pub(crate) lanes: Vec<u32>,
    /// For each slot, the sample of each of them.
    pub(crate) sample: Vec<[u8; LANES]>,
}

/// Finds the samples. `unit` is a factor that offsets are scaled by, a power of two.
#[inline(always)]
pub(crate) fn light_points<S: Simd>(
    simd: S,
    light: &AreaLight,
    samples: &Samples,
    askers: &Askers,
    unit: f32,
    out: &mut SamplePoints,
) {
    let bits = samples.count().next_power_of_two().trailing_zeros();
    let (column_bits, row_bits) = (bits.div_ceil(2), bits / 2);
    out.offsets.resize(1 << bits, [[0.0; LANES]; 3]);
    out.lanes.clear();
    out.lanes.resize(1 << bits, 0);
    out.sample.resize(1 << bits, [0; LANES]);
    let splat = |v: f32| f32x16::splat(simd, v);
    let lanes = |v: glam::Vec3| [splat(v.x), splat(v.y), splat(v.z)];
    let (axes, center) = ([lanes(light.half_u), lanes(light.half_v)], lanes(light.center));
    let zero = [splat(0.0); 3];
    let (middle, [u, v]) = match light.shape {
        Shape::Sphere => outline(simd, light.radius, askers),
        _ => (zero, axes),
    };
    let seed = u32x16::splat(simd, samples.seed());
    let base = hash(simd, u32x16::from_slice(simd, &askers.pixel) ^ seed);
    let seeds = [base, hash(simd, base + u32x16::splat(simd, DIMENSION))];
    let two_to = |bits: u32| splat((1u32 << bits) as f32);
    let mut offsets = [[0.0; LANES]; 3];
    for k in 0..samples.count() {
        let x = unit_float(simd, scrambled(simd, k, seeds[0]));
        let y = unit_float(simd, scrambled(simd, second(k), seeds[1]));
        let column: i32x16<S> = (x * two_to(column_bits)).to_int();
        let row: i32x16<S> = (y * two_to(row_bits)).to_int();
        let slots: [i32; LANES] = ((row << column_bits) + column).into();
        let (x, y) = (x * splat(2.0) - splat(1.0), y * splat(2.0) - splat(1.0));
        let [x, y] = match light.shape {
            Shape::Rectangle => [x, y],
            _ => disk(simd, x, y),
        };
        for axis in 0..3 {
            let offset = u[axis] * x + v[axis] * y;
            let offset = match light.shape {
                Shape::Sphere => middle[axis] + offset,
                _ => offset,
            };
            // The sample is the rounded point, which the offset is then taken from.
            let rounded = center[axis] + offset;
            ((rounded - center[axis]) * splat(unit)).store_slice(&mut offsets[axis]);
        }
        let ([x, y, z], all) = (&offsets, &mut out.offsets[..]);
        for lane in 0..LANES {
            let slot = slots[lane] as usize;
            let [to_x, to_y, to_z] = &mut all[slot];
            (to_x[lane], to_y[lane], to_z[lane]) = (x[lane], y[lane], z[lane]);
            out.lanes[slot] |= 1 << lane;
            out.sample[slot][lane] = k as u8;
        }
    }
}

#[inline(always)]
fn hash<S: Simd>(simd: S, mut x: u32x16<S>) -> u32x16<S> {
    x ^= x >> 16;
    x *= u32x16::splat(simd, HASH[0]);
    x ^= x >> 15;
    x *= u32x16::splat(simd, HASH[1]);
    x ^ (x >> 16)
}

#[inline(always)]
fn scrambled<S: Simd>(simd: S, x: u32, seed: u32x16<S>) -> u32x16<S> {
    let splat = |v: u32| u32x16::splat(simd, v);
    let mut x = seed + splat(x ^ x.wrapping_mul(SCRAMBLE[0]));
    x *= (seed >> 16) | splat(1);
    x ^= x * splat(SCRAMBLE[1]);
    x ^= x * splat(SCRAMBLE[2]);
    // Reversed by halves, quarters, and so on.
    for (shift, mask) in [
        (1, 0x5555_5555),
        (2, 0x3333_3333),
        (4, 0x0f0f_0f0f),
        (8, 0x00ff_00ff),
    ] {
        x = ((x >> shift) & splat(mask)) | ((x & splat(mask)) << shift);
    }
    (x >> 16) | (x << 16)
}

#[inline(always)]
fn unit_float<S: Simd>(simd: S, bits: u32x16<S>) -> f32x16<S> {
    // Below 2^24, so that the conversion of signed numbers does, which more machines have.
    (bits >> 8).bitcast::<i32x16<S>>().to_float::<f32x16<S>>() * f32x16::splat(simd, 1.0 / (1 << 24) as f32)
}

#[inline(always)]
fn disk<S: Simd>(simd: S, x: f32x16<S>, y: f32x16<S>) -> [f32x16<S>; 2] {
    let splat = |v: f32| f32x16::splat(simd, v);
    let wide = x.abs().simd_gt(y.abs());
    let (radius, other) = (wide.select(x, y), wide.select(y, x));
    let share = radius.simd_eq(splat(0.0)).select(splat(0.0), other / radius);
    let angle = share * splat(std::f32::consts::FRAC_PI_4);
    let t = angle * angle;
    let mut sin = splat(SIN[3]);
    for c in [SIN[2], SIN[1], SIN[0]] {
        sin = sin * t + splat(c);
    }
    let mut cos = splat(COS[4]);
    for c in [COS[3], COS[2], COS[1], COS[0]] {
        cos = cos * t + splat(c);
    }
    let (sin, cos) = (sin * angle * radius, cos * radius);
    [wide.select(cos, sin), wide.select(sin, cos)]
}

/// Middle and axes of the disks that a sphere's outline spans.
#[inline(always)]
fn outline<S: Simd>(simd: S, radius: f32, askers: &Askers) -> ([f32x16<S>; 3], [[f32x16<S>; 3]; 2]) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let q = load3(simd, &askers.offset);
    let (r, one, zero) = (splat(radius), splat(1.0), splat(0.0));
    let d2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
    let outside = d2.simd_gt(r * r);
    let inverse = one / d2.sqrt();
    let n = each3(|axis| q[axis] * inverse);
    let sine = r * inverse;
    let size = r * (one - sine * sine).max(zero).sqrt();
    let sign = one.copysign(n[2]);
    let a = -one / (sign + n[2]);
    let b = n[0] * n[1] * a;
    let u = [one + sign * (n[0] * n[0] * a), sign * b, -(sign * n[0])];
    let v = [b, sign + n[1] * n[1] * a, -n[1]];
    let depth = r * sine;
    let seen = |v: f32x16<S>| outside.select(v, zero);
    (
        each3(|axis| seen(n[axis] * depth)),
        [
            each3(|axis| seen(u[axis] * size)),
            each3(|axis| seen(v[axis] * size)),
        ],
    )
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::test_meshes::Numbers;
    use crate::{Light, SimdLevel};

    #[test]
    fn sixteen_receivers_get_the_points_of_each() {
        let center = Vec3::new(0.3, -100.7, 2000.1);
        let (u, v) = (Vec3::new(0.3, 0.1, 0.0), Vec3::new(-0.1, 0.3, 0.7));
        let lights = [
            AreaLight::rectangle(center, u, v),
            AreaLight::disk(center, u, v),
            AreaLight::sphere(center, 0.7),
            AreaLight::sun(Vec3::new(0.1, -1.0, 0.2), 0.3),
        ];
        let mut numbers = Numbers(7);
        let mut points = [(); LANES].map(|()| center.as_dvec3() + numbers.point().as_dvec3() * 2.0);
        // One inside of the sphere.
        points[3] = center.as_dvec3() + DVec3::splat(0.1);
        let mut askers = Askers::default();
        for (lane, point) in points.iter().enumerate() {
            askers.pixel[lane] = 1000 + lane as u32 * 77;
            let offset = (*point - center.as_dvec3()).as_vec3().to_array();
            (0..3).for_each(|axis| askers.offset[axis][lane] = offset[axis]);
        }
        let samples = Samples::new(37, 11);
        for light in lights {
            for level in SimdLevel::available() {
                let mut out = SamplePoints::default();
                dispatch!(level.0, simd => light_points(simd, &light, &samples, &askers, 1.0, &mut out));
                for (lane, point) in points.iter().enumerate() {
                    let mut seen = [false; 37];
                    for (slot, offsets) in out.offsets.iter().enumerate() {
                        if out.lanes[slot] & 1 << lane == 0 {
                            continue;
                        }
                        let k = out.sample[slot][lane];
                        assert!(!std::mem::replace(&mut seen[usize::from(k)], true));
                        let end = light.sample(&samples, askers.pixel[lane], *point, u32::from(k));
                        let (Light::Point(end) | Light::Directional(end)) = end;
                        let want = (end - light.center).to_array();
                        let got = [0, 1, 2].map(|axis| offsets[axis][lane]);
                        assert_eq!(
                            got.map(f32::to_bits),
                            want.map(f32::to_bits),
                            "{light:?} {k} {}",
                            level.name()
                        );
                    }
                    assert_eq!(seen, [true; 37]);
                }
            }
        }
    }
}
