//! The metallic-roughness model of the glTF 2.0 specification, appendix B, with `KHR_materials_ior`,
//! `KHR_materials_specular` and, for what is reflected, `KHR_materials_transmission`: a transmitting surface
//! reflects by Fresnel's equations instead of Schlick's approximation and diffuses what it does not transmit.
//!
//! ```text
//! f     = mix(dielectric, metal, metallic)
//! metal = (base + (1 - base) (1 - v.h)^5) S
//! dielectric = (1 - w max(F)) base / pi + w F S,   F = F0 + (1 - F0) (1 - v.h)^5
//! S = D V: Trowbridge-Reitz (GGX) distribution and height-correlated Smith visibility, alpha = roughness^2
//! ```
//!
//! Films, sheen and anisotropy come in where a surface has them ([`super::SurfaceFinish`]).
//!
//! Limits: single scattering, so a metal of roughness 1 seen head on reflects 31 % only; the specification's mix
//! lets smooth white dielectrics gain light at grazing views (a third at 86 degrees); alpha is at least
//! [`MIN_ALPHA`], so that a mirror still shows the highlight of a point light.

use std::f32::consts::PI;

use glam::Vec3;

use super::Surface;

/// Smallest width of the microfacet distribution.
pub const MIN_ALPHA: f32 = 1e-3;

/// The BRDF below the coat for light from the unit direction `towards`, per steradian, without the cosine.
#[inline]
pub fn evaluate(surface: &Surface, towards: Vec3) -> Vec3 {
    diffuse(surface, towards) + specular(surface, towards)
}

/// The part of [`evaluate`] that cosine-drawn rays stand for: diffuse light and sheen.
#[inline]
pub fn diffuse(surface: &Surface, towards: Vec3) -> Vec3 {
    let sheen = &surface.finish.sheen;
    let below = lambertian(surface, towards) * sheen.passed;
    if sheen.color == Vec3::ZERO {
        return below;
    }
    below + sheen.evaluate(surface.normal, surface.view, towards) * surface.coat.passed
}

/// The diffuse light of the metallic-roughness model below the coat.
#[inline]
fn lambertian(surface: &Surface, towards: Vec3) -> Vec3 {
    let half = (towards + surface.view).normalize_or(surface.normal);
    let reflected = dielectric_reflectance(surface, surface.view.dot(half));
    let share = (1.0 - surface.metallic) * (1.0 - surface.transmission) / PI;
    surface.base_color * ((1.0 - reflected.max_element()).max(0.0) * share * surface.coat.passed)
}

/// The reflected part of [`evaluate`].
#[inline]
pub fn specular(surface: &Surface, towards: Vec3) -> Vec3 {
    let (normal, view) = (surface.normal, surface.view);
    let half = (towards + view).normalize_or(normal);
    let cos_light = normal.dot(towards).max(0.0);
    // Interpolated normals can lean away from the viewer; there the limit of the model goes on.
    let cos_view = normal.dot(view).max(1e-4);
    let alpha = (surface.roughness * surface.roughness).max(MIN_ALPHA);
    let lobe = match surface.finish.anisotropy.facets(normal, alpha) {
        Some(facets) => facets.distribution(half) * facets.visibility(view, towards),
        None => distribution(normal, half, alpha) * visibility(cos_light, cos_view, alpha),
    };
    reflectance(surface, view.dot(half)) * lobe
}

/// What a facet below the coat reflects at this cosine between its normal and the viewer.
#[inline]
pub fn reflectance(surface: &Surface, cos: f32) -> Vec3 {
    let grazing = schlick(cos);
    let base = surface.base_color;
    let metal = base + (Vec3::ONE - base) * grazing;
    let metal = surface.finish.iridescence.over(metal, base, cos);
    let passed = surface.coat.passed * surface.finish.sheen.passed;
    dielectric_reflectance(surface, cos).lerp(metal, surface.metallic) * passed
}

/// What a facet of the dielectric reflects: Schlick's rise from `f0` to 1 or, where light passes, Fresnel's, which
/// knows total reflection.
#[inline]
pub fn dielectric_reflectance(surface: &Surface, cos: f32) -> Vec3 {
    let rise = if surface.transmission > 0.0 {
        match fresnel(cos.abs(), surface.relative_ior()) {
            Some(exact) => {
                let ratio = (surface.ior - 1.0) / (surface.ior + 1.0);
                let least = ratio * ratio;
                ((exact - least) / (1.0 - least)).clamp(0.0, 1.0)
            }
            None => return Vec3::ONE,
        }
    } else {
        schlick(cos)
    };
    let bare = surface.specular * (surface.f0 + (Vec3::ONE - surface.f0) * rise);
    let head_on = surface.specular * surface.f0;
    surface.finish.iridescence.over(bare, head_on, cos)
}

/// Fresnel's reflectance of unpolarised light; `ratio` is the index of refraction on the viewer's side over that
/// behind. `None` at total reflection.
fn fresnel(cos: f32, ratio: f32) -> Option<f32> {
    let behind2 = 1.0 - ratio * ratio * (1.0 - cos * cos).max(0.0);
    if behind2 <= 0.0 {
        return None;
    }
    let behind = behind2.sqrt();
    let across = (ratio * cos - behind) / (ratio * cos + behind);
    let along = (cos - ratio * behind) / (cos + ratio * behind);
    Some(0.5 * (across * across + along * along))
}

#[inline]
pub(super) fn schlick(cos: f32) -> f32 {
    let grazing = (1.0 - cos.abs()).max(0.0);
    grazing * grazing * (grazing * grazing) * grazing
}

/// Trowbridge-Reitz distribution. The usual denominator (n.h)^2 (alpha^2 - 1) + 1 loses all digits at small
/// alpha; |n x h|^2 is the same as 1 - (n.h)^2 and keeps them.
#[inline]
pub(super) fn distribution(normal: Vec3, half: Vec3, alpha: f32) -> f32 {
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
