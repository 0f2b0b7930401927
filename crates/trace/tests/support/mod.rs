//! Seeded meshes and rays that are hard on ray tracers, shared by the test programs.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "a module shared by test programs, each of which uses a part"
)]

pub mod meshes;
pub mod rays;

use glam::Vec3;

/// The `SplitMix64` generator: small, and the same everywhere.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5851_f42d_4c95_7f2d)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    /// In [-1, 1).
    pub fn signed(&mut self) -> f32 {
        self.unit() * 2.0 - 1.0
    }

    /// In the cube [-1, 1)^3.
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// In the unit ball, not too close to its centre.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if v.length() > 0.1 && v.length() <= 1.0 {
                return v;
            }
        }
    }
}
