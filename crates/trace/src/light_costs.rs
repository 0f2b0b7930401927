//! What the ways to a light's hard shadows are expected to cost, before any of them is gone.
//!
//! A ray of a light is a point of its raster, so what it meets follows from areas (Havran 2000): casters that cover `A` times
//! the area of the raster lie over `A` rays on average, and their rectangles, twice as large, hold `2 A`. A sample of the
//! casters is projected and measured; everything else are costs of a receiver, a caster, a reference, a node and a test,
//! measured on one core at some 3 GHz. Only their ratios matter. Cost: 0.3 ms a light and face.

use crate::light_grid::{CastRule, Cone, takes_part};
use crate::light_views::views;
use crate::{Light, Triangles};

/// Predicted times on one thread, builds included, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowCosts {
    /// [`crate::LitPixels`].
    pub receivers: f64,
    /// [`crate::PointLightGrid`].
    pub grid: f64,
    /// [`crate::PointLightTree`].
    pub tree: f64,
}

/// Casters that are measured.
const SAMPLE: usize = 4096;

impl ShadowCosts {
    /// For so many receivers, spread over the light's raster.
    pub fn predict(
        light: &Light,
        triangles: &Triangles,
        rule: CastRule,
        cone: Option<Cone>,
        receivers: u64,
    ) -> Self {
        let receivers = receivers as f64;
        let step = (triangles.len() / SAMPLE).max(1);
        let cast = |prim: &u32| takes_part(light, triangles, rule(*prim), *prim);
        let sample: Vec<u32> = (0..triangles.len() as u32).step_by(step).filter(cast).collect();
        let mut costs = Self {
            receivers: receivers * RECEIVER_GATHERED,
            grid: receivers * RECEIVER_SORTED,
            tree: receivers * RECEIVER_WALKED,
        };
        let faces = views(light, triangles, cone, None).unwrap_or_default();
        for view in &faces.views {
            let mut extents = Extents::default();
            for &prim in &sample {
                let h = triangles.corners(prim).map(|c| view.homogeneous(c.as_dvec3()));
                if h.iter().all(|h| h.p.z > 0.0) {
                    let at = |axis: usize, size: u32| h.map(|h| (h.p[axis] / h.p.z / f64::from(size)) as f32);
                    extents.add([at(0, view.width), at(1, view.height)], step as f64);
                }
            }
            let share = receivers / faces.views.len() as f64;
            costs.receivers += extents.count * CASTER_DRAWN + share * extents.area * CASTER_OVER_RECEIVER;
            costs.grid += extents.grid(f64::from(extents.resolution(share)), share);
            costs.tree += extents.tree(share);
        }
        // Every vertex is projected, for each face but where clusters are left out first.
        let vertices = triangles.x.len() as f64;
        let projected = vertices * faces.views.len() as f64 * VERTEX;
        Self {
            receivers: (costs.receivers + vertices * VERTEX) * 1e-6,
            grid: (costs.grid + projected) * 1e-6,
            tree: (costs.tree + projected) * 1e-6,
        }
    }
}

// Nanoseconds, from eight scenes on a busy machine.
const VERTEX: f64 = 8.0;
const RECEIVER_GATHERED: f64 = 40.0;
const RECEIVER_SORTED: f64 = 120.0;
const RECEIVER_WALKED: f64 = 10.0;
const CASTER_DRAWN: f64 = 800.0;
const CASTER_OVER_RECEIVER: f64 = 6.0;
const CASTER_BINNED: f64 = 400.0;
const CASTER_CUT: f64 = 1200.0;
const REFERENCE: f64 = 42.0;
const CELL: f64 = 3.0;
const RECEIVER_AND_REFERENCE: f64 = 8.0;
const RECEIVER_AND_NODE: f64 = 30.0;
const RECEIVER_AND_BOX: f64 = 2.0;

/// How much of a face's raster casters cover.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extents {
    /// Casters.
    count: f64,
    /// Half the perimeters of their rectangles, in sides of the raster.
    perimeter: f64,
    /// Half the areas of their rectangles, in areas of the raster: larger triangles are put only where their edges reach.
    area: f64,
}

impl Extents {
    /// Counts in a triangle that stands for `weight` of them: x and y of its corners, in sides of the raster.
    #[inline]
    pub(crate) fn add(&mut self, corners: [[f32; 3]; 2], weight: f64) {
        let extent = |v: [f32; 3]| {
            let low = v[0].min(v[1]).min(v[2]).max(0.0);
            let high = v[0].max(v[1]).max(v[2]).min(1.0);
            f64::from(high - low)
        };
        let [w, h] = corners.map(extent);
        if w >= 0.0 && h >= 0.0 {
            self.count += weight;
            self.perimeter += (w + h) * weight;
            self.area += 0.5 * w * h * weight;
        }
    }

    /// A grid of N x N cells holds n + P N + A N^2 references.
    fn references(&self, side: f64) -> f64 {
        self.count + self.perimeter * side + self.area * side * side
    }

    /// Each reference is tested once for every batch of receivers that share its cell: at least once, and for all batches
    /// together as often as a cell has references.
    fn grid(&self, side: f64, receivers: f64) -> f64 {
        let references = self.references(side);
        self.count * CASTER_BINNED
            + references * REFERENCE
            + side * side * CELL
            + receivers * RECEIVER_AND_REFERENCE * references / (side * side)
    }

    /// A ray lies in two boxes for each caster over it; it enters a node a level, and some more.
    fn tree(&self, receivers: f64) -> f64 {
        let boxes = 2.0 * self.area;
        let nodes = self.count.max(1.0).log(9.0) + boxes * 0.2;
        self.count * CASTER_CUT + receivers * (nodes * RECEIVER_AND_NODE + boxes * RECEIVER_AND_BOX)
    }

    /// The number of cells in each direction at which building a grid and asking it cost the least together.
    pub(crate) fn resolution(&self, receivers: f64) -> u32 {
        // What changes with the resolution, timed by itself: the fill of a reference, and a test that is one of many.
        const FILL: f64 = 12.0;
        const TEST: f64 = 0.7;
        let cost = |side: u32| {
            let (side, references) = (f64::from(side), self.references(f64::from(side)));
            references * FILL + side * side * CELL + receivers * TEST * references / (side * side)
        };
        let candidates = [32, 64, 96, 128, 192, 256, 384, 512, 768, 1024];
        candidates
            .into_iter()
            .min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
            .unwrap_or(32)
    }
}
