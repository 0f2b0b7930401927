//! Solids of a frame (HM08 §3: objects that are not polygons), and the structures that find them.
//!
//! | rays | structure |
//! |---|---|
//! | eye rays | `EyeSolids`: the pixels of each solid's box |
//! | shadow rays of a light | `SolidGrids` around it; of a directional one those around the eye |
//! | rays that leave surfaces | those around the eye |
//!
//! They stand beside the structures for triangles: of two answers the nearer one counts, a triangle at equal parameters.
//! Triangles between a solid and a light are asked of the hierarchy for other rays. Solids are opaque: light goes
//! through one only along rays that its material refracts.

use glam::DVec3;
use rayward_scene::{FrameGeometry, PosedSolid, Shape};
use rayward_trace::solids::{Crossing, EyeSolids, Solid, SolidGrids, SolidReceiver};
use rayward_trace::{FaceOptions, Light, View, ViewRay};

use crate::RenderOptions;
use crate::plan::FramePlan;
use crate::structures::FrameStructures;

/// A solid and the leaf of it that a point lies on.
pub(crate) type OnSolid = Option<(u32, u32)>;

/// The frame's solids in the local frame, in their order.
pub fn solids(geometry: &FrameGeometry) -> Vec<Solid> {
    geometry.solids.iter().map(|solid| shape(&solid.shape)).collect()
}

/// The structures over the solids of a frame.
#[derive(Debug)]
pub(crate) struct FrameSolids<'s> {
    shapes: &'s [Solid],
    posed: &'s [PosedSolid],
    /// The ids of objects and triangles go on with those of solids.
    first_ids: [u32; 2],
    pub(crate) eye: EyeSolids<'s>,
    side: u32,
    around_eye: SolidGrids<'s>,
    /// One for each light that has a place.
    around_lights: Vec<Option<SolidGrids<'s>>>,
}

impl<'s> FrameSolids<'s> {
    /// Builds over these shapes of the frame's solids, if there are any, and has the frame's structures note the cost.
    pub(crate) fn of_frame(
        shapes: &'s [Solid],
        geometry: &'s FrameGeometry,
        view: View,
        plan: &FramePlan,
        options: &RenderOptions,
        structures: &mut FrameStructures,
    ) -> Option<Self> {
        if shapes.is_empty() {
            return None;
        }
        let raster = (view, structures.eye.tile_side());
        let build = || Self::build(shapes, geometry, raster, plan, options.reference);
        Some(structures.timed("grids of solids", build, Self::size))
    }

    /// `side` is that of the eye's tiles. For references every solid is tested instead.
    fn build(
        shapes: &'s [Solid],
        geometry: &'s FrameGeometry,
        (view, side): (View, u32),
        plan: &FramePlan,
        reference: bool,
    ) -> Self {
        let grids = |center: DVec3| {
            if reference {
                SolidGrids::every([shapes; 2])
            } else {
                SolidGrids::build(center, shapes, &FaceOptions::default())
            }
        };
        let around = |light: Light| match light {
            Light::Point(position) => Some(grids(position.as_dvec3())),
            Light::Directional(_) => None,
        };
        let lights = plan.lights.iter().map(|plan| around(plan.as_ref()?.light));
        Self {
            shapes,
            posed: &geometry.solids,
            first_ids: first_ids(geometry),
            eye: EyeSolids::build(view, shapes, side),
            side,
            around_eye: grids(view.center.as_dvec3()),
            around_lights: lights.collect(),
        }
    }

    /// The same for another view of the same camera.
    pub(crate) fn looking(self, view: View) -> Self {
        Self {
            eye: EyeSolids::build(view, self.shapes, self.side),
            ..self
        }
    }

    /// What the structures hold: bytes, cells, references.
    fn size(&self) -> [usize; 3] {
        let grids = self.around_lights.iter().flatten().chain([&self.around_eye]);
        let eye = [
            self.eye.bytes(),
            self.eye.tile_count(),
            self.eye.reference_count(),
        ];
        grids.fold(eye, |[bytes, cells, references], grids| {
            [
                bytes + grids.bytes(),
                cells + grids.cell_count(),
                references + grids.reference_count(),
            ]
        })
    }

    /// The first crossing of a ray with a parameter in this range; `on` is what the ray starts on.
    pub(crate) fn closest(&self, ray: &ViewRay, range: [f64; 2], on: OnSolid) -> Option<(u32, Crossing)> {
        self.around_eye.closest(ray, range, on, &mut ())
    }

    /// Whether a solid lies between a receiver and a point or direction of a light, given by its index if it is one.
    pub(crate) fn hides(&self, light: Option<usize>, receiver: &SolidReceiver, end: &Light) -> bool {
        let around = light.and_then(|light| self.around_lights[light].as_ref());
        around.unwrap_or(&self.around_eye).shadows(receiver, end, &mut ())
    }

    /// Where a ray crosses the surface of a solid.
    pub(crate) fn receiver(&self, ray: &ViewRay, id: u32, crossing: &Crossing) -> SolidReceiver {
        SolidReceiver::along(ray, id, &self.shapes[id as usize], crossing)
    }

    /// Index into the scene's materials.
    pub(crate) fn material(&self, id: u32) -> u32 {
        self.posed[id as usize].material
    }

    /// The ids of a solid among objects and among triangles.
    pub(crate) fn ids(&self, id: u32) -> [u32; 2] {
        self.first_ids.map(|first| first + id)
    }
}

/// The first ids of solids among objects and among triangles.
pub(crate) fn first_ids(geometry: &FrameGeometry) -> [u32; 2] {
    [geometry.objects.len() as u32, geometry.triangle_count() as u32]
}

fn shape(of: &Shape) -> Solid {
    match of {
        Shape::Sphere { center, radius } => Solid::Sphere {
            center: *center,
            radius: *radius,
        },
        Shape::Cylinder { from, to, radius } => Solid::Cylinder {
            from: *from,
            to: *to,
            radius: *radius,
        },
        Shape::Capsule { from, to, radius } => Solid::Capsule {
            from: *from,
            to: *to,
            radius: *radius,
        },
        Shape::Box { center, half } => Solid::Box {
            center: *center,
            half: *half,
        },
        Shape::Union(parts) => all(parts, Solid::Union),
        Shape::Intersection(parts) => all(parts, Solid::Intersection),
        Shape::Difference(parts) => match parts.split_first() {
            Some((first, rest)) if !rest.is_empty() => {
                Solid::Difference(Box::new([shape(first), all(rest, Solid::Union)]))
            }
            _ => all(parts, Solid::Union),
        },
    }
}

/// Many as a tree of pairs, which is no deeper than it has to be; of none, nothing.
fn all(parts: &[Shape], pair: fn(Box<[Solid; 2]>) -> Solid) -> Solid {
    match parts {
        [] => Solid::Sphere {
            center: DVec3::ZERO,
            radius: 0.0,
        },
        [one] => shape(one),
        _ => {
            let (left, right) = parts.split_at(parts.len() / 2);
            pair(Box::new([all(left, pair), all(right, pair)]))
        }
    }
}
