//! Items in the cells of the six faces around a point: what [`crate::PerspectiveGrids`] and its relatives for other
//! items than triangles share (HM08 §3: six faces; §4: the singularity at the center).
//!
//! Each face is a perspective space with a grid of its own; neighbours overlap by [`GUARD`], so that no item and no
//! ray is lost between them to rounding. A ray's line is cut into at most six intervals, one for each face, and these
//! are walked by ascending start until nothing nearer can follow. What reaches the cube of half-size `near` around
//! the center, where the spaces end, is in a list of its own and tested by rays that enter the cube.
//!
//! Limits: a ray whose coordinates exceed the near cube so much that f64 cannot tell cells apart is tested with every
//! item.

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;

use crate::grid3::{Mailbox, Outline, Partition, RaySpan, SpaceGrid, Walk, fitting, reaches_cube};
use crate::space::{Face, FaceIntervals, Perspective, Space};
use crate::{Count, ViewRay};

pub(crate) use crate::grid3::PACKET;

/// By how much the pyramids are wider than 90 degrees, and the cube for the near list larger than that of the spaces.
const GUARD: f64 = 1.0 / 1024.0;

/// Cells and depths of the faces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FaceOptions {
    /// Cells along x, y and z of each face; `None` chooses from the number of items.
    pub resolution: Option<[u32; 3]>,
    /// Depth planes evenly spaced in the perspective space, as HM08 seems to have them, instead of where they part the
    /// items evenly.
    pub uniform_depth: bool,
    /// Half-size of the near cube as a share of the distance of the farthest item, where items come nearer than that.
    pub near_share: f64,
}

impl Default for FaceOptions {
    fn default() -> Self {
        Self {
            resolution: None,
            uniform_depth: false,
            near_share: 1.0 / 4096.0,
        }
    }
}

/// Items around a center.
#[derive(Clone, Debug)]
pub(crate) struct FaceGrids {
    center: DVec3,
    near: f64,
    spaces: [Perspective; 6],
    /// Empty if the center is of no use, else one for each face; `None` where there is nothing.
    faces: Vec<Option<SpaceGrid<Perspective>>>,
    near_items: Vec<u32>,
    items: u32,
    magnitude: f64,
}

impl FaceGrids {
    /// Sorts items 0 .. `items` into the cells around `center`; those without an outline are left out.
    pub(crate) fn build(
        center: DVec3,
        items: usize,
        options: &FaceOptions,
        outline: impl Fn(u32) -> Option<Outline> + Sync,
    ) -> Self {
        let survey = Survey::of(center, items, &outline);
        let near =
            (survey.nearest * (1.0 - GUARD)).max(survey.farthest * options.near_share.clamp(1e-6, 0.5));
        let far = survey.farthest * (1.0 + 2.0 * GUARD);
        let tan = 1.0 + GUARD;
        let spaces = Face::ALL.map(|face| Perspective {
            tan_x: tan,
            tan_y: tan,
            ..face.perspective(center, near, far)
        });
        let mut grids = Self {
            center,
            near,
            spaces,
            faces: Vec::new(),
            near_items: Vec::new(),
            items: items as u32,
            magnitude: survey.magnitude,
        };
        // Not so without items, and around a center that is not finite.
        if !(near > 0.0 && near < far && far.is_finite()) {
            return grids;
        }
        let resolution = fitting(options.resolution.unwrap_or_else(|| {
            let a_layer = (items as f64 / 6.0).sqrt().ceil();
            [(2.0 * a_layer) as u32, (2.0 * a_layer) as u32, 4].map(|n| n.min(512))
        }));
        let inner = (!options.uniform_depth).then(|| survey.depth_planes(near, far, resolution[2]));
        let build = |space: &Perspective| {
            let partition = Partition::new(space.limits(), resolution, inner.as_deref());
            let grid = SpaceGrid::build(*space, partition, items, &outline);
            (grid.cells.reference_count() > 0).then_some(grid)
        };
        grids.faces = spaces.iter().map(build).collect();
        let cube = near * (1.0 + 2.0 * GUARD);
        grids.near_items = (0..items as u32)
            .into_par_iter()
            .filter(|&item| outline(item).is_some_and(|outline| reaches_cube(&outline, center, cube)))
            .collect();
        grids
    }

    fn resolves(&self, magnitude: f64) -> bool {
        !self.faces.is_empty() && self.faces.iter().flatten().all(|grid| grid.resolves(magnitude))
    }

    /// Visits the items that the ray may meet with a parameter in `range`.
    #[inline]
    pub(crate) fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        mut visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(mut walk) = Walk::new(ray, range) else {
            return ControlFlow::Continue(());
        };
        if !self.resolves(self.magnitude + ray.origin.abs().max_element()) {
            return walk.visit(0..self.items, count, &mut visit);
        }
        if !self.near_items.is_empty() && self.enters_cube(ray, walk.span.range()) {
            count.node();
            walk.visit(self.near_items.iter().copied(), count, &mut visit)?;
        }
        for (face, [start, _]) in FaceIntervals::new(&self.spaces, ray, walk.span.range()).faces() {
            if *start > walk.span.range()[1] {
                break;
            }
            if let Some(grid) = &self.faces[*face as usize] {
                grid.walk(&mut walk, count, &mut visit)?;
            }
        }
        ControlFlow::Continue(())
    }

    /// Visits the items that the live ones of four rays may meet with a parameter in `range`, cells around all of them at
    /// once; `visit` takes rays that are done out of the live ones. Rays that are not finite have to be among the dead.
    pub(crate) fn each_of_packet(
        &self,
        rays: &[ViewRay; PACKET],
        range: [f64; 2],
        live: &mut u32,
        count: &mut impl Count,
        mut visit: impl FnMut(u32, &mut u32),
    ) {
        let range = RaySpan::new(range).range();
        let lanes = |live: u32| (0..PACKET).filter(move |lane| live >> lane & 1 != 0);
        let largest = lanes(*live).map(|lane| rays[lane].origin.abs().max_element());
        let largest = largest.fold(0.0, f64::max);
        if !self.resolves(self.magnitude + largest) {
            return (0..self.items).for_each(|item| visit(item, live));
        }
        let mut mailbox = Mailbox::new();
        if !self.near_items.is_empty() && lanes(*live).any(|lane| self.enters_cube(&rays[lane], range)) {
            count.node();
            for &item in &self.near_items {
                if mailbox.is_new(item) {
                    visit(item, live);
                }
            }
        }
        for (grid, space) in self.faces.iter().zip(&self.spaces) {
            let Some(grid) = grid else { continue };
            let segment = |lane: usize| {
                let asked = *live >> lane & 1 != 0;
                asked.then(|| space.segment(&rays[lane], range)).flatten()
            };
            let segments: [_; PACKET] = std::array::from_fn(segment);
            if segments.iter().any(Option::is_some) {
                grid.slices(&segments, live, &mut mailbox, count, &mut visit);
            }
        }
    }

    /// Whether the ray comes near the cube in which the spaces end.
    fn enters_cube(&self, ray: &ViewRay, [mut enter, mut leave]: [f64; 2]) -> bool {
        let half = self.near * (1.0 + GUARD);
        let from = ray.origin - self.center;
        for axis in 0..3 {
            if ray.dir[axis] == 0.0 {
                if from[axis].abs() > half {
                    return false;
                }
                continue;
            }
            let s = (-half - from[axis]) / ray.dir[axis];
            let t = (half - from[axis]) / ray.dir[axis];
            enter = enter.max(s.min(t));
            leave = leave.min(s.max(t));
        }
        enter <= leave
    }

    /// Cells of all faces that hold something.
    pub(crate) fn cell_count(&self) -> usize {
        self.faces
            .iter()
            .flatten()
            .map(|grid| grid.partition.cell_count())
            .sum()
    }

    /// References in all cells and in the near list.
    pub(crate) fn reference_count(&self) -> usize {
        let cells = self
            .faces
            .iter()
            .flatten()
            .map(|grid| grid.cells.reference_count());
        cells.sum::<usize>() + self.near_items.len()
    }

    /// Items in the near list.
    pub(crate) fn near_count(&self) -> usize {
        self.near_items.len()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        let cells = self.faces.iter().flatten().map(|grid| grid.cells.bytes());
        cells.sum::<usize>() + self.near_items.capacity() * 4
    }
}

/// Visits items 0 .. `items` without any structure.
pub(crate) fn each_of(
    items: u32,
    ray: &ViewRay,
    range: [f64; 2],
    count: &mut impl Count,
    mut visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
) -> ControlFlow<()> {
    match Walk::new(ray, range) {
        Some(mut walk) => walk.visit(0..items, count, &mut visit),
        None => ControlFlow::Continue(()),
    }
}

/// Where the items are, seen from the center; distances are largest components.
struct Survey {
    nearest: f64,
    farthest: f64,
    magnitude: f64,
    /// Distances of the middles of some items, ascending.
    sample: Vec<f64>,
}

/// Items whose distances place the depth planes.
const SAMPLE: usize = 4096;

impl Survey {
    fn of(center: DVec3, items: usize, outline: &(impl Fn(u32) -> Option<Outline> + Sync)) -> Self {
        let measure = |item: u32| {
            let outline = outline(item)?;
            let points = || outline.points().iter().map(|&p| p - center);
            let low = points().fold(DVec3::INFINITY, DVec3::min);
            let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
            let nearest = low.max(-high).max(DVec3::ZERO).max_element();
            let farthest = high.abs().max(low.abs()).max_element();
            let magnitude = outline.points().iter().map(|p| p.abs().max_element());
            Some([nearest, farthest, magnitude.fold(0.0, f64::max)])
        };
        let [nearest, farthest, magnitude] = (0..items as u32).into_par_iter().filter_map(measure).reduce(
            || [f64::INFINITY, 0.0, 0.0],
            |a, b| [a[0].min(b[0]), a[1].max(b[1]), a[2].max(b[2])],
        );
        let middle = |item: u32| {
            let outline = outline(item)?;
            let points = outline.points();
            let sum: DVec3 = points.iter().sum();
            Some((sum / points.len() as f64 - center).abs().max_element())
        };
        let mut sample: Vec<f64> = (0..items as u32)
            .step_by(items.div_ceil(SAMPLE).max(1))
            .filter_map(middle)
            .collect();
        sample.sort_unstable_by(f64::total_cmp);
        Self {
            nearest,
            farthest,
            magnitude,
            sample,
        }
    }

    /// Inner planes of Z that part the items evenly.
    fn depth_planes(&self, near: f64, far: f64, slabs: u32) -> Vec<f64> {
        let plane = |i: u32| {
            let at = self.sample.len() * i as usize / slabs as usize;
            let depth = self.sample.get(at).copied().unwrap_or(near).clamp(near, far);
            (1.0 / near - 1.0 / depth) / (1.0 / near - 1.0 / far)
        };
        (1..slabs).map(plane).collect()
    }
}
