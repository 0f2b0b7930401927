//! The three ways in which light goes on at a surface, as rays are drawn from them: reflected, transmitted and
//! diffused.
//!
//! Reflection draws a microfacet among those that the viewer sees (Heitz, *Sampling the GGX Distribution of
//! Visible Normals*, JCGT 7(4), 2018), so that its weight is Fresnel's reflectance times the share of facets that
//! the light sees too. Transmission draws the same facets and passes them by Snell's law: the boundary of a volume
//! bends the ray, a thin wall (`thickness` 0) lets it through straight, or spread about that where it is rough, as
//! `KHR_materials_transmission` and `KHR_materials_volume` define it. The base colour tints each passage.
//!
//! Below [`SMOOTH`] of roughness a lobe is one direction: no random number changes it, and its density is infinite.
//!
//! Limits: rough glass passes what its rays meet, but shows no highlights of points and directions behind it; radiance
//! is not scaled inside of a volume, which shows only where the camera or a light is in one.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::{Vec2, Vec3};

use super::Surface;
use super::brdf::{MIN_ALPHA, reflectance};
use super::finish::anisotropy::Facets;

/// Roughness below which a surface is a mirror, or clear.
pub const SMOOTH: f32 = 0.0316;

/// A way on from a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe {
    /// Unit direction in which the ray goes on.
    pub towards: Vec3,
    /// What of the radiance from there goes to the viewer.
    pub weight: Vec3,
    /// Probability density of the direction, per steradian; infinite if there was no choice.
    pub density: f32,
}

/// Where a reflected ray goes on; `None` if the surface takes it up itself.
pub fn reflected(surface: &Surface, random: [f32; 2]) -> Option<Lobe> {
    let normal = surface_seen(surface);
    let view = surface.view;
    if is_smooth(surface) {
        let mirrored = 2.0 * normal.dot(view) * normal - view;
        return Some(Lobe {
            towards: above(mirrored, surface.geometric_normal),
            weight: reflectance(surface, view.dot(normal)),
            density: f32::INFINITY,
        });
    }
    let facets = facets(surface, normal);
    let half = visible_facet(&facets, view, random);
    let towards = 2.0 * half.dot(view) * half - view;
    let cos_light = normal.dot(towards);
    if cos_light <= 0.0 || surface.geometric_normal.dot(towards) <= 0.0 {
        return None;
    }
    let weight = reflectance(surface, view.dot(half)) * lit_share(surface, normal, towards);
    Some(Lobe {
        towards,
        weight,
        density: reflection_density(surface, towards),
    })
}

/// Density with which [`reflected`] draws a direction; 0 for smooth surfaces, which draw none.
pub fn reflection_density(surface: &Surface, towards: Vec3) -> f32 {
    let normal = surface_seen(surface);
    let (cos_view, cos_light) = (normal.dot(surface.view), normal.dot(towards));
    if is_smooth(surface) || cos_light <= 0.0 {
        return 0.0;
    }
    let alpha = alpha(surface);
    let half = (towards + surface.view).normalize_or(normal);
    // The density of a seen facet over the 4 (v.h) by which reflection spreads directions.
    let seen = match surface.finish.anisotropy.facets(normal, alpha) {
        Some(facets) => facets.distribution(half) * facets.seen_share(surface.view),
        None => super::brdf::distribution(normal, half, alpha) * seen_share(cos_view, alpha),
    };
    seen / (4.0 * cos_view)
}

/// Where a transmitted ray goes on; `None` for a surface that transmits nothing, and where the drawn facet reflects
/// all. Whether it is inside of a volume then is [`Surface::enters_volume`].
pub fn transmitted(surface: &Surface, random: [f32; 2]) -> Option<Lobe> {
    let through = surface.transmission * (1.0 - surface.metallic);
    if through <= 0.0 {
        return None;
    }
    let normal = surface_seen(surface);
    let view = surface.view;
    let smooth = is_smooth(surface);
    let half = if smooth {
        normal
    } else {
        visible_facet(&facets(surface, normal), view, random)
    };
    let cos = view.dot(half);
    // What is reflected in one colour is not missing in its opposite.
    let passed = (1.0 - super::brdf::dielectric_reflectance(surface, cos).max_element()).max(0.0);
    let towards = if surface.thin {
        let reflected = 2.0 * cos * half - view;
        // A smooth wall is straight to the last bit, so that what lies behind is seen undistorted.
        if smooth {
            -view
        } else {
            reflected - 2.0 * reflected.dot(normal) * normal
        }
    } else {
        refracted(view, half, surface.relative_ior())?
    };
    let cos_light = -normal.dot(towards);
    if cos_light <= 0.0 {
        return None;
    }
    let shadowed = if smooth {
        1.0
    } else {
        lit_share(surface, normal, towards)
    };
    Some(Lobe {
        towards: above(towards, -surface.geometric_normal),
        weight: surface.base_color
            * passed
            * (through * shadowed * surface.coat.passed * surface.finish.sheen.passed),
        density: f32::INFINITY,
    })
}

/// Where a diffused ray goes on; `None` for surfaces that diffuse nothing.
pub fn diffused(surface: &Surface, random: [f32; 2]) -> Option<Lobe> {
    let radius = random[0].sqrt();
    let (sin, cos) = (random[1] * TAU).sin_cos();
    let height = (1.0 - random[0]).max(0.0).sqrt();
    let (tangent, bitangent) = surface.normal.any_orthonormal_pair();
    let towards = (tangent * (radius * cos) + bitangent * (radius * sin) + surface.normal * height)
        .normalize_or(surface.normal);
    if surface.geometric_normal.dot(towards) <= 0.0 || height <= 0.0 {
        return None;
    }
    let weight = super::brdf::diffuse(surface, towards) * std::f32::consts::PI;
    (weight != Vec3::ZERO).then(|| Lobe {
        towards,
        weight,
        density: diffusion_density(surface, towards),
    })
}

/// Density with which [`diffused`] draws a direction.
pub fn diffusion_density(surface: &Surface, towards: Vec3) -> f32 {
    surface.normal.dot(towards).max(0.0) * FRAC_1_PI
}

/// Whether reflection and transmission have one direction.
pub fn is_smooth(surface: &Surface) -> bool {
    surface.roughness < SMOOTH && surface.finish.anisotropy.strength == 0.0
}

/// The direction behind a facet by Snell's law; `ratio` is the index of refraction on the viewer's side over that
/// behind. `None` at total reflection.
fn refracted(view: Vec3, half: Vec3, ratio: f32) -> Option<Vec3> {
    let cos = view.dot(half);
    let below = 1.0 - ratio * ratio * (1.0 - cos * cos).max(0.0);
    (below > 0.0).then(|| (half * (ratio * cos - below.sqrt()) - view * ratio).normalize_or(-view))
}

fn surface_seen(surface: &Surface) -> Vec3 {
    seen_normal([surface.normal, surface.geometric_normal], surface.view)
}

/// The first of two normals, bent towards the viewer where interpolation or a normal map has turned it away.
pub(super) fn seen_normal([normal, geometric]: [Vec3; 2], view: Vec3) -> Vec3 {
    const LEAST: f32 = 0.01;
    let cos = normal.dot(view);
    if cos >= LEAST {
        normal
    } else {
        (normal + view * (LEAST - cos)).normalize_or(geometric)
    }
}

/// The direction itself, or mirrored to the side of a plane on which it belongs: interpolated normals can send a
/// ray to the wrong side of its triangle.
fn above(towards: Vec3, plane: Vec3) -> Vec3 {
    let cos = towards.dot(plane);
    if cos > 0.0 {
        towards
    } else {
        (towards + plane * (1e-3 - 2.0 * cos)).normalize_or(plane)
    }
}

fn alpha(surface: &Surface) -> f32 {
    (surface.roughness * surface.roughness).max(MIN_ALPHA)
}

/// Smith's share of facets that are seen from a direction.
fn seen_share(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    2.0 * cos / (cos + (a2 + (1.0 - a2) * cos * cos).sqrt())
}

/// Of the facets that the viewer sees, the share that the light sees too, heights correlated; the light may be on either
/// side.
fn lit_share(surface: &Surface, normal: Vec3, towards: Vec3) -> f32 {
    let alpha = alpha(surface);
    if let Some(facets) = surface.finish.anisotropy.facets(normal, alpha) {
        return facets.lit_share(surface.view, towards);
    }
    let (cos_view, cos_light) = (normal.dot(surface.view), normal.dot(towards).abs());
    let a2 = alpha * alpha;
    let slope = |cos: f32| (a2 + (1.0 - a2) * cos * cos).sqrt();
    let (view, light) = (cos_light * slope(cos_view), cos_view * slope(cos_light));
    let both = 2.0 * cos_view * cos_light / (view + light);
    (both / seen_share(cos_view, alpha)).min(1.0)
}

/// The facets of a surface about a normal.
fn facets(surface: &Surface, normal: Vec3) -> Facets {
    let alpha = alpha(surface);
    let own = surface.finish.anisotropy.facets(normal, alpha);
    own.unwrap_or_else(|| Facets::even(normal, alpha))
}

/// A facet's normal, drawn among those that the viewer sees.
fn visible_facet(facets: &Facets, view: Vec3, random: [f32; 2]) -> Vec3 {
    let Facets {
        axes: [tangent, bitangent, normal],
        alphas,
    } = *facets;
    let local = Vec3::new(view.dot(tangent), view.dot(bitangent), view.dot(normal));
    let stretched = Vec3::new(local.x * alphas.x, local.y * alphas.y, local.z).normalize_or(Vec3::Z);
    // A disk seen from the stretched view, the half of it that lies behind squeezed.
    let first = Vec2::new(-stretched.y, stretched.x)
        .normalize_or(Vec2::X)
        .extend(0.0);
    let second = stretched.cross(first);
    let (sin, cos) = (random[1] * TAU).sin_cos();
    let (x, mut y) = (random[0].sqrt() * cos, random[0].sqrt() * sin);
    let squeeze = 0.5 * (1.0 + stretched.z);
    y = (1.0 - squeeze) * (1.0 - x * x).max(0.0).sqrt() + squeeze * y;
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let facet = first * x + second * y + stretched * z;
    let facet = Vec3::new(facet.x * alphas.x, facet.y * alphas.y, facet.z.max(1e-6)).normalize_or(Vec3::Z);
    (tangent * facet.x + bitangent * facet.y + normal * facet.z).normalize_or(normal)
}
