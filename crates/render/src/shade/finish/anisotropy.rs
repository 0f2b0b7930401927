//! Microfacets that lean farther in one direction than across it (`KHR_materials_anisotropy`), as of brushed metal.
//!
//! The roughness along the direction is `mix(alpha, 1, strength^2)`, that across it the surface's own `alpha`. Distribution
//! and height-correlated Smith visibility are those of Heitz, *Understanding the Masking-Shadowing Function in
//! Microfacet-Based BRDFs*, JCGT 3(2), 2014, which the extension has as well; its cut of the visibility at 1, made for short
//! floats, is left out.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

/// The direction in which a surface is rougher.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// 0 without any.
    pub strength: f32,
    /// Along the surface, of any length; either end is the same.
    pub direction: Vec3,
}

impl Anisotropy {
    /// The same in all directions.
    pub const NONE: Self = Self {
        strength: 0.0,
        direction: Vec3::X,
    };

    /// The facets about a normal, rough by `alpha` across the direction; `None` if they are the same in all directions.
    #[inline]
    pub(in super::super) fn facets(&self, normal: Vec3, alpha: f32) -> Option<Facets> {
        if self.strength == 0.0 {
            return None;
        }
        let along = self.direction.reject_from_normalized(normal).try_normalize()?;
        Some(Facets {
            axes: [along, normal.cross(along), normal],
            alphas: Vec2::new(alpha + (1.0 - alpha) * self.strength * self.strength, alpha),
        })
    }
}

/// The distribution of microfacets about a normal.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Facets {
    /// Along, across and the normal.
    pub(in super::super) axes: [Vec3; 3],
    /// Roughness along and across.
    pub(in super::super) alphas: Vec2,
}

impl Facets {
    /// Facets that are the same in all directions.
    pub(in super::super) fn even(normal: Vec3, alpha: f32) -> Self {
        let (along, across) = normal.any_orthonormal_pair();
        Self {
            axes: [along, across, normal],
            alphas: Vec2::splat(alpha),
        }
    }

    fn local(&self, direction: Vec3) -> Vec3 {
        Vec3::from_array(self.axes.map(|axis| axis.dot(direction)))
    }

    /// Density of facets with this normal.
    #[inline]
    pub(in super::super) fn distribution(&self, half: Vec3) -> f32 {
        let half = self.local(half);
        if half.z <= 0.0 {
            return 0.0;
        }
        let both = self.alphas.x * self.alphas.y;
        let scaled = (half.truncate() * Vec2::new(self.alphas.y, self.alphas.x)).extend(half.z * both);
        let width = both / scaled.length_squared();
        both * width * width / PI
    }

    /// Masking and shadowing over 4 (n.l) (n.v).
    #[inline]
    pub(in super::super) fn visibility(&self, view: Vec3, towards: Vec3) -> f32 {
        let [cos_view, cos_light] = [view, towards].map(|side| self.axes[2].dot(side));
        let (cos_view, cos_light) = (cos_view.max(1e-4), cos_light.max(0.0));
        0.5 / (cos_light * self.stretch(view) + cos_view * self.stretch(towards))
    }

    /// Smith's share of facets that are seen from a direction.
    pub(in super::super) fn seen_share(&self, view: Vec3) -> f32 {
        let cos = self.axes[2].dot(view);
        2.0 * cos / (cos + self.stretch(view))
    }

    /// Of the facets that the viewer sees, the share that the light sees too, heights correlated; the light may be on either
    /// side.
    pub(in super::super) fn lit_share(&self, view: Vec3, towards: Vec3) -> f32 {
        let [cos_view, cos_light] = [view, towards].map(|side| self.axes[2].dot(side));
        let both =
            2.0 * cos_view * cos_light / (cos_light * self.stretch(view) + cos_view * self.stretch(towards));
        (both / self.seen_share(view)).min(1.0)
    }

    /// Length of a unit direction after its parts along the surface have shrunk by the roughness.
    fn stretch(&self, direction: Vec3) -> f32 {
        let local = self.local(direction);
        (local.truncate() * self.alphas).extend(local.z).length()
    }
}
