//! Seeded randomness: a `SplitMix64` generator and lattice noise made from the same mixing function.
//!
//! Source: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014. The same seed
//! gives the same values on every machine.

use glam::{IVec3, Vec3};

/// The generator: a counter that is mixed.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    /// Starts a sequence.
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// A value in [0, 1).
    pub(super) fn unit(&mut self) -> f32 {
        self.state = self.state.wrapping_add(STEP);
        (mix(self.state) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// A value in [low, high).
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// Smooth noise in [-1, 1]: hashed values at integer points, blended with quintic weights.
pub(super) fn noise(p: Vec3, seed: u64) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let cell = cell.as_ivec3();
    let value = |x: i32, y: i32, z: i32| {
        let at = cell + IVec3::new(x, y, z);
        let key = [at.x, at.y, at.z]
            .iter()
            .fold(seed, |key, &c| mix(key.wrapping_add(c as u64).wrapping_add(STEP)));
        (key >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    let mix_x = |y, z| value(0, y, z) + (value(1, y, z) - value(0, y, z)) * w.x;
    let mix_y = |z| mix_x(0, z) + (mix_x(1, z) - mix_x(0, z)) * w.y;
    mix_y(0) + (mix_y(1) - mix_y(0)) * w.z
}

/// `octaves` of [`noise`], each of twice the frequency and half the height of the one before.
pub(super) fn fractal_noise(p: Vec3, octaves: u32, seed: u64) -> f32 {
    (0..octaves)
        .map(|o| noise(p * (1u32 << o) as f32, seed.wrapping_add(u64::from(o))) / (1u32 << o) as f32)
        .sum()
}

const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
