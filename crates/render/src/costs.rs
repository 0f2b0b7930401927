//! What rays cost, pixel by pixel: for people who look at structures rather than at pictures.
//!
//! Frames count nothing of the kind. Where the layer [`crate::Layers::cost`] is asked for, tiles are gone over a second
//! time: the structure for any ray is asked again, now counting, for the eye ray and all rays that surfaces sent; and
//! the grid that HM08 §5.2 builds for a light is built besides, and its cells are looked at where the surfaces lie.

use std::sync::Arc;

use rayward_trace::ldc::StepCounts;
use rayward_trace::{Counters, PointLightGrid, Receiver, SurfaceRay};

use crate::secondary::SecondaryTracer;
use crate::tile::{TileShader, TileWork};
use crate::{Film, TileMut};

/// What the rays of one pixel cost, those of its first sample.
///
/// The first four are of the structure for any ray, which answers what surfaces send out; the eye ray is asked of it,
/// too, so that there is something to see in every scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelCost {
    /// Nodes of the hierarchy that were opened.
    pub nodes: f32,
    /// Triangles tested.
    pub tests: f32,
    /// Cells of the layered depth cube looked at, above its texels.
    pub cells: f32,
    /// Its texels looked at.
    pub texels: f32,
    /// Casters listed by the cells in which the surfaces that are seen lie, of a grid for each light without a size.
    pub casters: f32,
    /// Those of them that need no test, since the surface lies before the nearest of its cell.
    pub spared: f32,
}

impl PixelCost {
    /// Names of the numbers, in their order.
    pub const NAMES: [&'static str; 6] = ["nodes", "tests", "cells", "texels", "casters", "spared"];

    /// The numbers.
    pub fn to_array(self) -> [f32; 6] {
        let Self {
            nodes,
            tests,
            cells,
            texels,
            casters,
            spared,
        } = self;
        [nodes, tests, cells, texels, casters, spared]
    }

    pub(crate) fn add(&mut self, other: Self) {
        let sum = |i: usize| self.to_array()[i] + other.to_array()[i];
        *self = [0, 1, 2, 3, 4, 5].map(sum).into();
    }
}

impl From<[f32; 6]> for PixelCost {
    fn from([nodes, tests, cells, texels, casters, spared]: [f32; 6]) -> Self {
        Self {
            nodes,
            tests,
            cells,
            texels,
            casters,
            spared,
        }
    }
}

impl From<Counters> for PixelCost {
    fn from(counters: Counters) -> Self {
        Self {
            nodes: counters.nodes as f32,
            tests: counters.triangles as f32,
            ..Self::default()
        }
    }
}

impl From<StepCounts> for PixelCost {
    fn from(counts: StepCounts) -> Self {
        Self {
            tests: counts.triangles as f32,
            cells: counts.cells as f32,
            texels: counts.texels as f32,
            ..Self::default()
        }
    }
}

/// What is asked once more, counting.
#[derive(Debug)]
pub(crate) struct Measured<'g> {
    /// The structure for any ray.
    pub(crate) any: Arc<dyn SecondaryTracer + 'g>,
    /// The grids of lights without a size.
    pub(crate) lights: Vec<PointLightGrid<'g>>,
}

impl Measured<'_> {
    /// What the light cells around a receiver say.
    fn cells(&self, receiver: &Receiver) -> PixelCost {
        let mut cost = PixelCost::default();
        for cell in self.lights.iter().filter_map(|grid| grid.cell_of(receiver)) {
            cost.casters += cell.casters as f32;
            cost.spared += if cell.spared { cell.casters as f32 } else { 0.0 };
        }
        cost
    }
}

impl TileShader<'_> {
    /// Notes what the eye rays of a tile would cost, and what lights' cells hold where they end.
    pub(crate) fn measure(&self, measured: &Measured, work: &TileWork, out: &mut TileMut) {
        let view = self.structures.eye.view();
        for y in 0..out.height {
            for x in 0..out.width {
                let eye = view.pixel_ray(out.x + x, out.y + y);
                let ray = SurfaceRay {
                    from: Receiver::free(eye.origin),
                    dir: eye.dir.as_vec3(),
                };
                if let Some(cost) = out.cost(x, y) {
                    *cost = measured.any.cost(&ray);
                }
            }
        }
        for point in &work.points {
            if let Some(cost) = out.cost(point.x, point.y) {
                cost.add(measured.cells(&point.receiver));
            }
        }
    }

    /// Adds what the rays that surfaces send cost.
    pub(crate) fn measure_ray(&self, pixel: [u32; 2], ray: &SurfaceRay, out: &mut TileMut) {
        if let Some(measured) = &self.structures.measured
            && let Some(cost) = out.cost(pixel[0], pixel[1])
        {
            cost.add(measured.any.cost(ray));
        }
    }
}

impl Film {
    /// One of the numbers of [`PixelCost`], by its place among [`PixelCost::NAMES`].
    pub fn cost_of(&self, number: usize) -> impl Iterator<Item = f32> {
        self.cost.iter().map(move |cost| cost.to_array()[number])
    }
}
