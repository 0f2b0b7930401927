//! Sheen of cloth (`KHR_materials_sheen`): fibres that stand about the normal send light back at grazing angles.
//!
//! Source: Estevez and Kulla, *Production Friendly Microfacet Sheen BRDF*, SIGGRAPH course, 2017: a distribution that grows
//! with the sine of the angle to the normal, and a fit of its shadowing.
//!
//! ```text
//! f = sheen + passed * below,   passed = 1 - max(colour) E(n.v)
//! ```
//!
//! `E` is what white sheen reflects of light from all around. It comes from a table of 32 x 16 integrals, made at its first
//! use in some 50 ms. As `passed` depends on the viewer alone, sheen lies over a surface as a coat does.
//!
//! Limits: the shadowing term for the light's direction is left out of `passed`, as the extension allows; roughness is at
//! least 0.07; what the surface emits passes the fibres without loss.

use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::OnceLock;

use glam::Vec3;
use rayon::prelude::*;

/// Fibres that stand closer to the normal are not told apart.
const MIN_ROUGHNESS: f32 = 0.07;

/// Cosines and roughnesses of the table.
const COSINES: usize = 32;
const ROUGHNESSES: usize = 16;

/// The sheen of a surface, as it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Linear colour; black without sheen.
    pub color: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
    /// What it reflects of a white surrounding.
    pub reflectance: Vec3,
    /// Share of light that it leaves to the surface below.
    pub passed: f32,
}

impl Sheen {
    /// No sheen.
    pub const NONE: Self = Self {
        color: Vec3::ZERO,
        roughness: 0.0,
        reflectance: Vec3::ZERO,
        passed: 1.0,
    };

    /// Sheen that is seen at this cosine to the normal.
    pub(super) fn new(color: Vec3, roughness: f32, cos: f32) -> Self {
        let reflectance = color * around(cos, roughness);
        Self {
            color,
            roughness,
            reflectance,
            passed: 1.0 - reflectance.max_element(),
        }
    }

    /// The lobe for light from the unit direction `towards`, per steradian, without the cosine.
    #[inline]
    pub fn evaluate(&self, normal: Vec3, view: Vec3, towards: Vec3) -> Vec3 {
        if self.color == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let half = (towards + view).normalize_or(normal);
        let [cos_view, cos_light] = [view, towards].map(|side| normal.dot(side).max(1e-4));
        self.color * lobe(cos_view, cos_light, normal.dot(half), alpha(self.roughness))
    }
}

fn alpha(roughness: f32) -> f32 {
    let roughness = roughness.max(MIN_ROUGHNESS);
    roughness * roughness
}

/// White sheen by the cosines of view, light and the direction between them.
fn lobe(cos_view: f32, cos_light: f32, cos_half: f32, alpha: f32) -> f32 {
    let sin2 = (1.0 - cos_half * cos_half).max(0.0);
    let distribution = (2.0 + 1.0 / alpha) * sin2.powf(0.5 / alpha) * (0.5 * FRAC_1_PI);
    distribution
        / ((1.0 + shadowing(cos_view, alpha) + shadowing(cos_light, alpha)) * 4.0 * cos_view * cos_light)
}

/// The fit of Smith's integral.
fn shadowing(cos: f32, alpha: f32) -> f32 {
    let smooth = (1.0 - alpha) * (1.0 - alpha);
    let mix = |rough: f32, smoothest: f32| rough + (smoothest - rough) * smooth;
    let fit = |x: f32| {
        mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
            + mix(-1.97760, -1.27393) * x
            + mix(-4.32054, -4.85967)
    };
    if cos < 0.5 {
        fit(cos).exp()
    } else {
        (2.0 * fit(0.5) - fit(1.0 - cos)).exp()
    }
}

/// What white sheen reflects of light from all around.
fn around(cos: f32, roughness: f32) -> f32 {
    static TABLE: OnceLock<Vec<f32>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let entry = |i: usize| integral(table_cosine(i % COSINES), table_roughness(i / COSINES));
        (0..COSINES * ROUGHNESSES).into_par_iter().map(entry).collect()
    });
    let place = |at: f32, count: usize| {
        let at = at.clamp(0.0, (count - 1) as f32);
        let first = (at as usize).min(count - 2);
        (first, at - first as f32)
    };
    let (i, x) = place(cos * COSINES as f32 - 0.5, COSINES);
    let share = (roughness - MIN_ROUGHNESS) / (1.0 - MIN_ROUGHNESS);
    let (j, y) = place(share * (ROUGHNESSES - 1) as f32, ROUGHNESSES);
    let row = |j: usize| {
        let [a, b] = [table[j * COSINES + i], table[j * COSINES + i + 1]];
        a + (b - a) * x
    };
    row(j) + (row(j + 1) - row(j)) * y
}

fn table_cosine(i: usize) -> f32 {
    (i as f32 + 0.5) / COSINES as f32
}

fn table_roughness(j: usize) -> f32 {
    MIN_ROUGHNESS + (1.0 - MIN_ROUGHNESS) * j as f32 / (ROUGHNESSES - 1) as f32
}

/// The lobe times the cosine, over all directions of light: midpoints of rings, denser where fibres shine most.
fn integral(cos_view: f32, roughness: f32) -> f32 {
    const RINGS: usize = 48;
    const STEPS: usize = 24;
    let alpha = alpha(roughness);
    let sin_view = (1.0 - cos_view * cos_view).sqrt();
    let mut sum = 0.0;
    for ring in 0..RINGS {
        // cos = x^2, so that d(cos) = 2 x dx.
        let x = (ring as f32 + 0.5) / RINGS as f32;
        let cos = x * x;
        let sin = (1.0 - cos * cos).sqrt();
        for step in 0..STEPS {
            let turn = (step as f32 + 0.5) / STEPS as f32 * PI;
            let length2 = 2.0 + 2.0 * (sin * sin_view * turn.cos() + cos * cos_view);
            let cos_half = (cos + cos_view) / length2.max(1e-12).sqrt();
            sum += lobe(cos_view, cos, cos_half, alpha) * cos * 2.0 * x;
        }
    }
    (sum * 2.0 * PI / (RINGS * STEPS) as f32).min(1.0)
}
