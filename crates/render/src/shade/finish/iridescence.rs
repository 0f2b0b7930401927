//! Colours of thin films (`KHR_materials_iridescence`): what is reflected at a film's two sides interferes.
//!
//! Source: Belcour and Barla, *A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence*, ACM
//! TOG 36(4), 2017, §4, as the extension simplifies it: Schlick's approximation at both sides, phases of 0 or pi, the base's
//! index of refraction from its reflectance head on. The eye's response to interference is a sum of Gaussians of the
//! wavenumber, so their Fourier transforms at the film's path difference give its colour without a sum over wavelengths.
//!
//! Units: nanometres. Limits: two reflections inside of the film, as in the extension; colours outside of sRGB's gamut are cut.

use std::f32::consts::{PI, TAU};

use glam::{Mat3, Vec3};

/// A film on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iridescence {
    /// How much of the reflectance is the film's; 0 without one.
    pub strength: f32,
    /// Index of refraction.
    pub ior: f32,
    /// Nanometres.
    pub thickness: f32,
}

impl Iridescence {
    /// No film.
    pub const NONE: Self = Self {
        strength: 0.0,
        ior: 1.3,
        thickness: 0.0,
    };

    /// The reflectance of a facet that would reflect `bare` without a film, and `head_on` seen from its normal.
    #[inline]
    pub fn over(&self, bare: Vec3, head_on: Vec3, cos: f32) -> Vec3 {
        if self.strength == 0.0 {
            bare
        } else {
            bare.lerp(self.reflectance(head_on, cos.abs().min(1.0)), self.strength)
        }
    }

    /// The film's own reflectance over a base that reflects `head_on`, for a cosine from 0 to 1.
    fn reflectance(&self, head_on: Vec3, cos: f32) -> Vec3 {
        let ratio = 1.0 / self.ior;
        let below = (1.0 - ratio * ratio * (1.0 - cos * cos)).max(0.0).sqrt();
        let top = schlick(Vec3::splat(normal_reflectance(self.ior, 1.0)), cos).x;
        let passed = 1.0 - top;
        // A base that reflects all would have an infinite index of refraction.
        let root = (head_on + 1e-4).min(Vec3::splat(0.9999)).map(f32::sqrt);
        let base_ior = (Vec3::ONE + root) / (Vec3::ONE - root);
        let base = schlick(base_ior.map(|ior| normal_reflectance(ior, self.ior)), below);

        // The film is denser than air, so that the wave is turned over when it is reflected at the top from outside, and
        // at the bottom where the base is thinner.
        let shift = base_ior.map(|ior| if ior < self.ior { TAU } else { PI });
        let path = 2.0 * self.ior * self.thickness * below;
        let both = (base * top).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
        let through = passed * passed * base / (Vec3::ONE - both);
        let mut sum = through + top;
        let mut amplitude = through - passed;
        for order in [1.0, 2.0] {
            amplitude *= both.map(f32::sqrt);
            sum += amplitude * 2.0 * response(order * path, order * shift);
        }
        sum.max(Vec3::ZERO)
    }
}

/// Fresnel's reflectance head on between two indices of refraction.
fn normal_reflectance(there: f32, here: f32) -> f32 {
    let ratio = (there - here) / (there + here);
    ratio * ratio
}

fn schlick(head_on: Vec3, cos: f32) -> Vec3 {
    head_on + (Vec3::ONE - head_on) * super::super::brdf::schlick(cos)
}

/// What the eye makes of waves that are a path difference, in nanometres, and a phase apart: linear RGB, that of XYZ 1 at 0 and 0.
fn response(path: f32, shift: Vec3) -> Vec3 {
    /// Of the Gaussians that stand for the CIE's observer: height, centre and variance in wavenumbers, per metre.
    const HEIGHT: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
    const CENTRE: Vec3 = Vec3::new(1.681e6, 1.7953e6, 2.2084e6);
    const VARIANCE: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
    /// The second lobe of X.
    const BLUE: [f32; 3] = [9.747e-14, 2.2399e6, 4.5282e9];
    const SUM: f32 = 1.0685e-7;
    const RGB_FROM_XYZ: Mat3 = Mat3::from_cols(
        Vec3::new(3.240_454_2, -0.969_266, 0.055_643_4),
        Vec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
        Vec3::new(-0.498_531_4, 0.041_556, 1.057_225_2),
    );
    let phase = TAU * path * 1e-9;
    let wave = |height: f32, centre: f32, variance: f32, shift: f32| {
        height * (TAU * variance).sqrt() * (centre * phase + shift).cos() * (-variance * phase * phase).exp()
    };
    let lobe = |i: usize| wave(HEIGHT[i], CENTRE[i], VARIANCE[i], shift[i]);
    let mut xyz = Vec3::new(lobe(0), lobe(1), lobe(2));
    xyz.x += wave(BLUE[0], BLUE[1], BLUE[2], shift.x);
    RGB_FROM_XYZ * (xyz / SUM)
}
