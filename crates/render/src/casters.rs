//! Which triangles cast shadows from which side.
//!
//! HM08 §5.2 draws the back faces of models that are assumed to be closed. Here closedness is found out
//! ([`Topology`]), and the rule is applied to the components where it cannot change an answer: closed, opaque,
//! and neither the eye nor the light inside. Every ray from what the eye sees to the light then leaves such a
//! component as often as it enters it.

use glam::DVec3;
use rayward_scene::{AlphaMode, FrameGeometry, Material, Scene};
use rayward_trace::{AreaLight, Casts, Light, Topology};

use crate::CasterPolicy;
use crate::geometry::triangles;

/// Per component, whether the eye is outside; per triangle, whether it is opaque.
#[derive(Clone, Debug)]
pub struct CasterRules<'t> {
    topology: &'t Topology,
    policy: CasterPolicy,
    candidates: Vec<bool>,
    transparent: Vec<bool>,
}

impl<'t> CasterRules<'t> {
    /// Which triangles hang together.
    pub(crate) fn topology(&self) -> &'t Topology {
        self.topology
    }

    /// The rules for an eye at this point of the local frame; `None` for a parallel camera, which has no one
    /// point to be inside of anything.
    pub fn new(
        scene: &Scene,
        geometry: &FrameGeometry,
        topology: &'t Topology,
        policy: CasterPolicy,
        eye: Option<DVec3>,
    ) -> Self {
        let triangles = triangles(geometry);
        let transparent = transparent_triangles(scene, geometry);
        let mut candidates: Vec<bool> = (0..topology.components.len() as u32)
            .map(|c| {
                let closed = topology.components[c as usize].closed;
                closed && eye.is_some_and(|eye| topology.winding_number(&triangles, c, eye) == 0)
            })
            .collect();
        for (component, transparent) in topology.component_of_triangle.iter().zip(&transparent) {
            if let Some(candidate) = candidates.get_mut(*component as usize) {
                *candidate &= !transparent;
            }
        }
        Self {
            topology,
            policy,
            candidates,
            transparent,
        }
    }

    /// Whether a triangle lets light through, so that it belongs into grids of its own.
    pub fn is_transparent(&self, prim: u32) -> bool {
        self.transparent.get(prim as usize).copied().unwrap_or(false)
    }

    /// Whether there is any such triangle.
    pub fn any_transparent(&self) -> bool {
        !self.transparent.is_empty()
    }

    /// What each triangle casts in this light.
    pub fn for_light(&self, geometry: &FrameGeometry, light: &Light) -> impl Fn(u32) -> Casts + Sync {
        let triangles = triangles(geometry);
        let outside = |c: u32| match *light {
            Light::Directional(_) => true,
            Light::Point(p) => self.topology.winding_number(&triangles, c, p.as_dvec3()) == 0,
        };
        self.rule(self.components_where(outside))
    }

    /// What each triangle casts in a light with a size: as in that of each of its points, with none of which a
    /// component differs unless its surface passes through the light.
    pub fn for_area(&self, geometry: &FrameGeometry, light: &AreaLight) -> impl Fn(u32) -> Casts + Sync {
        let triangles = triangles(geometry);
        let mut touched = vec![false; self.candidates.len()];
        if let Some([low, high]) = light.bounds() {
            let components = &self.topology.component_of_triangle;
            for (prim, &component) in components.iter().enumerate() {
                let [a, b, c] = triangles.corners(prim as u32);
                let apart = a.min(b).min(c).cmpgt(high) | a.max(b).max(c).cmplt(low);
                if let Some(touched) = touched.get_mut(component as usize).filter(|_| !apart.any()) {
                    *touched = true;
                }
            }
        }
        let outside = |c: u32| {
            !touched[c as usize]
                && light.bounds().is_none_or(|[low, high]| {
                    let middle = (low.as_dvec3() + high.as_dvec3()) * 0.5;
                    self.topology.winding_number(&triangles, c, middle) == 0
                })
        };
        self.rule(self.components_where(outside))
    }

    /// For each component whether it is a candidate of which this holds.
    fn components_where(&self, outside: impl Fn(u32) -> bool) -> Vec<bool> {
        (0..self.candidates.len() as u32)
            .map(|c| self.candidates[c as usize] && outside(c))
            .collect()
    }

    fn rule(&self, back_faces_suffice: Vec<bool>) -> impl Fn(u32) -> Casts + Sync {
        move |prim| {
            if self.is_transparent(prim) {
                return Casts::Nothing;
            }
            let component = self.topology.component_of_triangle[prim as usize] as usize;
            match self.policy {
                CasterPolicy::Both => Casts::Both,
                CasterPolicy::Back => Casts::Back,
                CasterPolicy::Auto if back_faces_suffice.get(component) == Some(&true) => Casts::Back,
                CasterPolicy::Auto => Casts::Both,
            }
        }
    }
}

/// Per triangle, whether its material is masked, blended or a thin wall that transmits; empty if none is.
pub(crate) fn transparent_triangles(scene: &Scene, geometry: &FrameGeometry) -> Vec<bool> {
    let transparent = |material: u32| {
        let material = &scene.materials[material as usize];
        material.alpha_mode != AlphaMode::Opaque || is_thin_glass(material)
    };
    if !geometry.objects.iter().any(|o| transparent(o.material)) {
        return Vec::new();
    }
    let objects = geometry.objects.iter();
    objects
        .flat_map(|o| std::iter::repeat_n(transparent(o.material), o.triangles.len()))
        .collect()
}

/// Whether light goes straight through a material: volumes bend it.
pub(crate) fn is_thin_glass(material: &Material) -> bool {
    material.transmission > 0.0 && material.thickness <= 0.0 && material.metallic < 1.0
}
