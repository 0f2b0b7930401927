//! Clear coats (`KHR_materials_clearcoat`): a thin dielectric over a surface, with a normal and a roughness of its own.
//!
//! ```text
//! coated = (1 - r) surface + r S,   r = factor (0.04 + 0.96 (1 - |n.v|)^5)
//! ```
//!
//! `n` is the coat's normal, and S what a mirror of its roughness would send. As `r` depends on the viewer alone, a coat
//! is a white mirror of weight `r` beside a surface of weight `1 - r`, and shading knows no more of it. What the surface
//! emits and transmits passes the coat as well.
//!
//! Limits: the shadows of coated glass do not know the coat. Light is not bent on its way through.

use glam::Vec3;

use super::Surface;
use super::brdf::schlick;
use super::finish::SurfaceFinish;
use super::lobes::seen_normal;

/// Reflectance of a coat seen head on: that of an index of refraction of 1.5.
const HEAD_ON: f32 = 0.04;

/// The coat of a surface, as it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Share of light that it reflects; 0 without a coat.
    pub reflectance: f32,
    /// Share that it leaves to the surface below.
    pub passed: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Unit normal on the viewer's side.
    pub normal: Vec3,
}

impl Coat {
    /// No coat.
    pub const NONE: Self = Self {
        reflectance: 0.0,
        passed: 1.0,
        roughness: 0.0,
        normal: Vec3::Z,
    };

    /// A coat that covers a share of the surface, with its normal and the geometric one, seen from a direction.
    pub(super) fn new(factor: f32, roughness: f32, [normal, geometric]: [Vec3; 2], view: Vec3) -> Self {
        let cos = seen_normal([normal, geometric], view).dot(view);
        let reflectance = factor * (HEAD_ON + (1.0 - HEAD_ON) * schlick(cos));
        Self {
            reflectance,
            passed: 1.0 - reflectance,
            roughness,
            normal,
        }
    }
}

impl Surface {
    /// The coat alone, as a white mirror of its own; `None` without one.
    #[inline]
    pub fn coated(&self) -> Option<Self> {
        if self.coat.reflectance <= 0.0 {
            return None;
        }
        Some(Self {
            normal: self.coat.normal,
            base_color: Vec3::ZERO,
            metallic: 0.0,
            roughness: self.coat.roughness,
            f0: Vec3::ONE,
            specular: self.coat.reflectance,
            transmission: 0.0,
            emissive: Vec3::ZERO,
            finish: SurfaceFinish::NONE,
            coat: Coat::NONE,
            ..*self
        })
    }
}
