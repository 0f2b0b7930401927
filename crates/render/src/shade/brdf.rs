//! The metallic-roughness model of the glTF 2.0 specification, appendix B, with `KHR_materials_ior` and
//! `KHR_materials_specular`.
//!
//! ```text
//! f     = mix(dielectric, metal, metallic)
//! metal = (base + (1 - base) (1 - v.h)^5) S
//! dielectric = (1 - w max(F)) base / pi + w F S,   F = F0 + (1 - F0) (1 - v.h)^5
//! S = D V: Trowbridge-Reitz (GGX) distribution and height-correlated Smith visibility, alpha = roughness^2
//! ```
//!
//! Limits: single scattering, so a metal of roughness 1 seen head on reflects 31 % only; the specification's mix
//! lets smooth white dielectrics gain light at grazing views (a third at 86 degrees); alpha is at least
//! [`MIN_ALPHA`], so that a mirror still shows the highlight of a point light.

use std::f32::consts::PI;

use glam::Vec3;

use super::Surface;

/// Smallest width of the microfacet distribution.
pub const MIN_ALPHA: f32 = 1e-3;

/// The BRDF for light from the unit direction `towards`, per steradian, without the cosine.
#[inline]
pub fn evaluate(surface: &Surface, towards: Vec3) -> Vec3 {
    let (normal, view) = (surface.normal, surface.view);
    let half = (towards + view).normalize_or(normal);
    let cos_light = normal.dot(towards).max(0.0);
    // Interpolated normals can lean away from the viewer; there the limit of the model goes on.
    let cos_view = normal.dot(view).max(1e-4);
    let grazing = (1.0 - view.dot(half).abs()).max(0.0);
    let fresnel = grazing * grazing * (grazing * grazing) * grazing;

    let alpha = (surface.roughness * surface.roughness).max(MIN_ALPHA);
    let lobe = distribution(normal, half, alpha) * visibility(cos_light, cos_view, alpha);

    let base = surface.base_color;
    let metal = (base + (Vec3::ONE - base) * fresnel) * lobe;
    let reflected = surface.specular * (surface.f0 + (Vec3::ONE - surface.f0) * fresnel);
    let dielectric = base * ((1.0 - reflected.max_element()) / PI) + reflected * lobe;
    dielectric.lerp(metal, surface.metallic)
}

/// Trowbridge-Reitz distribution. The usual denominator (n.h)^2 (alpha^2 - 1) + 1 loses all digits at small
/// alpha; |n x h|^2 is the same as 1 - (n.h)^2 and keeps them.
#[inline]
fn distribution(normal: Vec3, half: Vec3, alpha: f32) -> f32 {
    let cos = normal.dot(half);
    if cos <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let spread = a2 * cos * cos + normal.cross(half).length_squared();
    a2 / (PI * spread * spread)
}

/// Height-correlated Smith masking and shadowing over 4 (n.l) (n.v).
#[inline]
fn visibility(cos_light: f32, cos_view: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let view = cos_light * (cos_view * cos_view * (1.0 - a2) + a2).sqrt();
    let light = cos_view * (cos_light * cos_light * (1.0 - a2) + a2).sqrt();
    0.5 / (view + light)
}
