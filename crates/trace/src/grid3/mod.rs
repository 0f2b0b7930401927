//! [`Grid3`]: triangles in the cells of a 3-D grid, in world space or in the perspective space of a point.
//!
//! Source: HM08 §3, §4 and §5.3; in world space it is the regular grid that the paper measures against (Table 5).
//! "A structure is a partition and a space": the same partition, the same build and the same walk serve every
//! [`Space`], and triangles are always met in world space by [`crate::exact`]. The walk is Amanatides and Woo's (1987),
//! but with every crossing computed from its plane, see `partition.rs`; a mailbox of 256 entries keeps most
//! triangles from being tested twice (after Kirk and Arvo 1991, without a list a thread).
//!
//! Layout: 4 bytes a reference and a cell, see `cells.rs`; cells along z side by side. Triangles are taken by id from
//! the caller's arrays. Units are the triangles', f64 throughout.
//!
//! Answers equal [`crate::BruteForce`]'s bit for bit wherever the space holds all that a ray may meet, which the world
//! space of [`Grid3::in_world`] always does.
//!
//! Limits: a perspective space shows one pyramid beyond its near plane; [`crate::PerspectiveGrids`] adds the rest. Rays
//! whose coordinates exceed the cells' width so much that f64 cannot tell cells apart (some 2^30 times) are tested
//! with every triangle.

mod cells;
mod overlap;
mod partition;
mod slices;
mod walk;

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::queries::{self, Candidates};
use crate::space::{Space, World};
use crate::{Accel, BuildStats, Count, Hit, Light, Ray, Receiver, Triangles, ViewRay};

pub(crate) use overlap::Outline;
pub(crate) use overlap::reaches_cube;
pub(crate) use partition::Partition;
pub(crate) use slices::PACKET;
pub use walk::RaySpan;
pub(crate) use walk::{Mailbox, SpaceGrid, Walk};

/// Cells of a grid at most; a finer resolution is halved along its longest axis until it fits.
const MOST_CELLS: u64 = 1 << 26;

/// A 3-D grid over the triangles of one frame.
#[derive(Clone, Debug)]
pub struct Grid3<'a, S> {
    triangles: Triangles<'a>,
    grid: SpaceGrid<S>,
    /// Largest coordinate in magnitude.
    magnitude: f64,
    stats: BuildStats,
}

impl<'a> Grid3<'a, World> {
    /// A grid in world space around all triangles. `None` chooses cubes, about four for each triangle.
    pub fn in_world(triangles: Triangles<'a>, resolution: Option<[u32; 3]>) -> Self {
        let kept = kept(&triangles);
        let corners = |&prim: &u32| triangles.corners(prim);
        let [low, high] = kept
            .par_iter()
            .map(corners)
            .map(|[a, b, c]| [a.min(b).min(c).as_dvec3(), a.max(b).max(c).as_dvec3()])
            .reduce(
                || [DVec3::INFINITY, DVec3::NEG_INFINITY],
                |a, b| [a[0].min(b[0]), a[1].max(b[1])],
            );
        if kept.is_empty() {
            let space = World {
                min: DVec3::ZERO,
                max: DVec3::ONE,
            };
            return Self::new(space, triangles, [1; 3], None);
        }
        // Flat geometry has cells too; and all of it lies well within the box.
        let size = high - low;
        let size = size.max(DVec3::splat(size.max_element() / 1024.0));
        let (margin, middle) = (size / 1024.0, (low + high) * 0.5);
        let space = World {
            min: middle - size * 0.5 - margin,
            max: middle + size * 0.5 + margin,
        };
        let resolution = resolution.unwrap_or_else(|| {
            let shape = size / size.max_element();
            let per_side = (4.0 * kept.len() as f64 / shape.element_product()).cbrt();
            (shape * per_side).ceil().to_array().map(|n| n as u32)
        });
        Self::new(space, triangles, resolution, None)
    }
}

impl<'a, S: Space> Grid3<'a, S> {
    /// Builds over all triangles that are finite and have area, in parallel; the same for any number of threads.
    /// `inner` are the inner planes of z, ascending, in the space's coordinates, where they shall not be evenly
    /// spaced; they then say how many cells there are along z.
    pub fn new(space: S, triangles: Triangles<'a>, resolution: [u32; 3], inner: Option<&[f64]>) -> Self {
        let partition = Partition::new(space.limits(), fitting(resolution), inner);
        let outline = |prim: u32| {
            let corners = triangles.corners(prim).map(Vec3::as_dvec3);
            (!triangles.is_degenerate(prim)).then_some(Outline::Triangle(corners))
        };
        let grid = SpaceGrid::build(space, partition, triangles.len(), outline);
        Self {
            triangles,
            grid,
            magnitude: magnitude(&triangles),
            stats: stats(&triangles),
        }
    }

    /// What was built and what was left out.
    pub fn stats(&self) -> BuildStats {
        self.stats
    }

    /// Cells along the axes.
    pub fn cells(&self) -> [u32; 3] {
        self.grid.partition.cells()
    }

    /// References in all cells.
    pub fn reference_count(&self) -> usize {
        self.grid.cells.reference_count()
    }

    /// Memory of the grid in bytes, the triangles themselves left out.
    pub fn bytes(&self) -> usize {
        self.grid.cells.bytes()
    }
}

/// The resolution, made coarser where it has too many cells.
pub(crate) fn fitting(resolution: [u32; 3]) -> [u32; 3] {
    let mut cells = resolution.map(|n| n.clamp(1, partition::MAX_CELLS));
    while cells.iter().map(|&n| u64::from(n)).product::<u64>() > MOST_CELLS {
        let longest = (0..3).max_by_key(|&axis| cells[axis]).unwrap_or(0);
        cells[longest] = cells[longest].div_ceil(2);
    }
    cells
}

/// Largest coordinate of the finite vertices in magnitude.
pub(crate) fn magnitude(triangles: &Triangles) -> f64 {
    let largest = |values: &[f32]| {
        let finite = values.par_iter().filter(|v| v.is_finite());
        finite.map(|v| v.abs()).reduce(|| 0.0, f32::max)
    };
    [triangles.x, triangles.y, triangles.z]
        .map(largest)
        .into_iter()
        .fold(0.0, f32::max)
        .into()
}

/// The triangles that take part.
pub(crate) fn kept(triangles: &Triangles) -> Vec<u32> {
    let all = (0..triangles.len() as u32).into_par_iter();
    all.filter(|&prim| !triangles.is_degenerate(prim)).collect()
}

/// What takes part and what does not.
pub(crate) fn stats(triangles: &Triangles) -> BuildStats {
    let finite = |prim: u32| triangles.corners(prim).iter().all(|p| p.is_finite());
    let prims = || (0..triangles.len() as u32).into_par_iter();
    let degenerate = prims().filter(|&prim| triangles.is_degenerate(prim)).count();
    let dropped_non_finite = prims().filter(|&prim| !finite(prim)).count();
    BuildStats {
        triangles: triangles.len() - degenerate,
        dropped_non_finite,
        dropped_degenerate: degenerate - dropped_non_finite,
    }
}

impl<S: Space> Candidates for Grid3<'_, S> {
    fn corners(&self, prim: u32) -> [Vec3; 3] {
        self.triangles.corners(prim)
    }

    fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        mut visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(mut walk) = Walk::new(ray, range) else {
            return ControlFlow::Continue(());
        };
        if !self
            .grid
            .resolves(self.magnitude + ray.origin.abs().max_element())
        {
            return walk.visit(0..self.triangles.len() as u32, count, &mut visit);
        }
        self.grid.walk(&mut walk, count, &mut visit)
    }
}

impl Accel for Grid3<'_, World> {
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
