//! [`PerspectiveGrids`]: any ray through the perspective grids of a point.
//!
//! Source: HM08 §3 and §5.3: a grid in the perspective space of a point serves rays that nearly pass through it: those
//! of a lens, of an area light, of an eye that moves. Six faces take any ray; the farther rays are from the center and
//! the more they run across, the more cells they pass.
//!
//! Layout: a [`crate::Grid3`]-like grid a face, see `faces.rs` and `grid3/`; 4 bytes a reference and a cell. Answers
//! equal [`crate::BruteForce`]'s bit for bit. Cost: a face looks at all triangles when it is built.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use crate::faces::{FaceGrids, FaceOptions};
use crate::grid3::{self, Outline, RaySpan};
use crate::queries::{self, Candidates};
use crate::{Accel, BuildStats, Count, Hit, Light, Ray, Receiver, Triangles, ViewRay};

/// Perspective grids around a center, over the triangles of one frame.
#[derive(Clone, Debug)]
pub struct PerspectiveGrids<'a> {
    triangles: Triangles<'a>,
    grids: FaceGrids,
    stats: BuildStats,
}

impl<'a> PerspectiveGrids<'a> {
    /// Builds over all triangles that are finite and have area, in parallel; the same for any number of threads. Any
    /// `center` will do; one that rays pass close by is fast.
    pub fn build(center: DVec3, triangles: Triangles<'a>, options: &FaceOptions) -> Self {
        let outline = |prim: u32| {
            let corners = triangles.corners(prim).map(Vec3::as_dvec3);
            (!triangles.is_degenerate(prim)).then_some(Outline::Triangle(corners))
        };
        Self {
            triangles,
            grids: FaceGrids::build(center, triangles.len(), options, outline),
            stats: grid3::stats(&triangles),
        }
    }

    /// What was built and what was left out.
    pub fn stats(&self) -> BuildStats {
        self.stats
    }

    /// Cells of the faces that hold something.
    pub fn cell_count(&self) -> usize {
        self.grids.cell_count()
    }

    /// References in all cells and in the near list.
    pub fn reference_count(&self) -> usize {
        self.grids.reference_count()
    }

    /// Triangles that reach the cube around the center in which the perspective spaces end.
    pub fn near_count(&self) -> usize {
        self.grids.near_count()
    }

    /// Memory of the grids in bytes, the triangles themselves left out.
    pub fn bytes(&self) -> usize {
        self.grids.bytes()
    }
}

impl Candidates for PerspectiveGrids<'_> {
    fn corners(&self, prim: u32) -> [Vec3; 3] {
        self.triangles.corners(prim)
    }

    fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.grids.each_candidate(ray, range, count, visit)
    }
}

impl Accel for PerspectiveGrids<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        queries::intersect(self, ray)
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.any(ray, &mut ())
    }

    fn all_hits(&self, ray: &Ray, hits: &mut Vec<Hit>) {
        queries::all_hits(self, ray, hits);
    }

    fn shadowed(&self, receiver: &Receiver, light: &Light) -> bool {
        self.shadows(receiver, light, &mut ())
    }
}
