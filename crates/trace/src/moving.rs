//! [`MovingGrids`]: any ray at any time within a shutter, through the perspective grids of a point.
//!
//! Source: HM08 §5.1 names motion blur as a use of perspective grids whose rays are not all at one time. A triangle
//! that moves is in the cells of the box it passes through, transformed into the perspective space; one that stands
//! still is in the cells it meets. The shutter is cut into slices with grids of their own, so that boxes stay small. Which
//! triangle a ray meets is decided at the ray's own time.
//!
//! *The definition.* At time s in \[0, 1\] each coordinate of a vertex is `fl32(a + (b - a) s)`, computed in f64 from
//! its values at the shutter's opening and closing and rounded once. So the triangles of one time are an ordinary
//! mesh ([`MovingTriangles::at`]): shared vertices stay shared, nothing cracks, and [`crate::exact`] decides as ever.
//! Rounding is monotone, so that the rounded vertex stays in its box. A triangle without area at one time takes
//! part at the others.
//!
//! Limits: vertices move on straight lines, so a wheel that turns far within the shutter shrinks in between. Cost: that
//! of [`crate::PerspectiveGrids`] for each slice, and more the larger the boxes of the moving triangles are.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use crate::faces::{FaceGrids, FaceOptions, each_of};
use crate::grid3::{Outline, RaySpan};
use crate::queries::{self, Candidates};
use crate::{Accel, Count, Hit, Light, Ray, Receiver, Triangles, ViewRay};

/// The same triangles when the shutter opens and when it closes.
#[derive(Clone, Copy, Debug)]
pub struct MovingTriangles<'a> {
    open: Triangles<'a>,
    close: Triangles<'a>,
    /// Whether both are the same arrays, so that nothing moves.
    still: bool,
}

/// Vertices of one time, as [`Triangles`] take them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vertices {
    /// Vertex x.
    pub x: Vec<f32>,
    /// Vertex y.
    pub y: Vec<f32>,
    /// Vertex z.
    pub z: Vec<f32>,
}

fn between(a: f32, b: f32, time: f64) -> f32 {
    let (a, b) = (f64::from(a), f64::from(b));
    (a + (b - a) * time) as f32
}

impl<'a> MovingTriangles<'a> {
    /// Triangles that move from their places in `open` to those in `close`.
    ///
    /// # Panics
    /// If the two do not have the same triangles of as many vertices.
    pub fn new(open: Triangles<'a>, close: Triangles<'a>) -> Self {
        assert!(
            open.indices == close.indices && open.x.len() == close.x.len(),
            "the triangles of the two times differ"
        );
        let same = |a: &[f32], b: &[f32]| std::ptr::eq(a, b);
        let still = same(open.x, close.x) && same(open.y, close.y) && same(open.z, close.z);
        Self { open, close, still }
    }

    /// The corners of a triangle at a time from 0 to 1.
    #[inline]
    pub fn corners(&self, prim: u32, time: f64) -> [Vec3; 3] {
        if self.still {
            return self.open.corners(prim);
        }
        let (open, close) = (self.open.corners(prim), self.close.corners(prim));
        [0, 1, 2].map(|i| {
            let axis = |axis: usize| between(open[i][axis], close[i][axis], time);
            Vec3::new(axis(0), axis(1), axis(2))
        })
    }

    /// All vertices at a time from 0 to 1.
    pub fn at(&self, time: f64) -> Vertices {
        let all = |open: &[f32], close: &[f32]| {
            let pairs = open.iter().zip(close);
            pairs.map(|(&a, &b)| between(a, b, time)).collect()
        };
        Vertices {
            x: all(self.open.x, self.close.x),
            y: all(self.open.y, self.close.y),
            z: all(self.open.z, self.close.z),
        }
    }

    /// Whether any vertex moves.
    pub fn any_moves(&self) -> bool {
        !self.still
            && (self.open.x != self.close.x || self.open.y != self.close.y || self.open.z != self.close.z)
    }

    /// What holds a triangle from one time to another: coordinates only grow or only fall in between.
    fn outline(&self, prim: u32, [from, to]: [f64; 2]) -> Option<Outline> {
        let (open, close) = (self.open.corners(prim), self.close.corners(prim));
        if !open.iter().chain(&close).all(|p| p.is_finite()) {
            return None;
        }
        if open == close {
            return Some(Outline::Triangle(open.map(Vec3::as_dvec3)));
        }
        let points = [self.corners(prim, from), self.corners(prim, to)];
        let points = points.as_flattened();
        let low = points.iter().fold(Vec3::INFINITY, |low, &p| low.min(p));
        let high = points.iter().fold(Vec3::NEG_INFINITY, |high, &p| high.max(p));
        Some(Outline::boxed(low.as_dvec3(), high.as_dvec3()))
    }
}

/// Perspective grids over moving triangles.
#[derive(Clone, Debug)]
pub struct MovingGrids<'a> {
    triangles: MovingTriangles<'a>,
    /// One for each slice of the shutter; none if every triangle is tested.
    slices: Vec<FaceGrids>,
}

impl<'a> MovingGrids<'a> {
    /// Builds over all triangles that are finite at both times, in parallel; the same for any number of threads. Any
    /// `center` will do; one that rays pass close by is fast. The shutter is cut into this many slices if anything
    /// moves.
    pub fn build(center: DVec3, triangles: MovingTriangles<'a>, slices: u32, options: &FaceOptions) -> Self {
        let count = triangles.open.len();
        let slices = if triangles.any_moves() { slices.max(1) } else { 1 };
        let time = |slice: u32| f64::from(slice) / f64::from(slices);
        let build = |slice: u32| {
            let times = [time(slice), time(slice + 1)];
            FaceGrids::build(center, count, options, |prim| triangles.outline(prim, times))
        };
        Self {
            triangles,
            slices: (0..slices).map(build).collect(),
        }
    }

    /// No grids: every ray is tested with every triangle by the exact decision alone, the definition of the right answer.
    pub fn every(triangles: MovingTriangles<'a>) -> Self {
        Self {
            triangles,
            slices: Vec::new(),
        }
    }

    /// The triangles at a time from 0 to 1.
    pub fn at(&self, time: f64) -> MovingAt<'_> {
        let time = time.clamp(0.0, 1.0);
        // The slice that holds the time, by the same quotients as in the build.
        let count = self.slices.len();
        let slice = (1..count)
            .take_while(|&k| k as f64 / count as f64 <= time)
            .count();
        MovingAt {
            triangles: &self.triangles,
            grids: self.slices.get(slice),
            time,
        }
    }

    /// Cells of the faces that hold something, in all slices.
    pub fn cell_count(&self) -> usize {
        self.slices.iter().map(FaceGrids::cell_count).sum()
    }

    /// References in all cells and in the near list.
    pub fn reference_count(&self) -> usize {
        self.slices.iter().map(FaceGrids::reference_count).sum()
    }

    /// Memory of the grids in bytes, the triangles themselves left out.
    pub fn bytes(&self) -> usize {
        self.slices.iter().map(FaceGrids::bytes).sum()
    }
}

/// Moving triangles at one time.
#[derive(Clone, Copy, Debug)]
pub struct MovingAt<'g> {
    triangles: &'g MovingTriangles<'g>,
    grids: Option<&'g FaceGrids>,
    time: f64,
}

impl Candidates for MovingAt<'_> {
    fn corners(&self, prim: u32) -> [Vec3; 3] {
        self.triangles.corners(prim, self.time)
    }

    fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        match self.grids {
            Some(grids) => grids.each_candidate(ray, range, count, visit),
            None => each_of(self.triangles.open.len() as u32, ray, range, count, visit),
        }
    }

    fn is_filtered(&self) -> bool {
        self.grids.is_some()
    }
}

impl Accel for MovingAt<'_> {
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
