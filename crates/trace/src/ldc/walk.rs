//! Following a ray through one direction of the cube: a 2-D DDA over cells of all levels (VMV07, ray traversal).
//!
//! The ray's projection walks over the raster. In a cell of a coarse level its depths in there are compared with the
//! cell's bounds; where they meet, the cells below are walked over before the next one. Texels with samples are given to
//! `visit`. Which of two edges a ray reaches first is a coin's toss, so a step has no branch on it.
//!
//! Positions are whole texels, and a cell's exit is computed from its edge, not accumulated, so the walk always
//! advances and ends. The texels visited are those of a line within 2^-14 texels of the true one; samples reach
//! [`super::raster::REACH`] beyond their texel. The segments of consecutive cells join without gaps.

use std::ops::{ControlFlow, Range};

use super::build::Stack;
use super::frame::{Raster, TexelRay};
use super::levels::{Cell, Level, Texel, coarse_slots, slots};
use super::samples::{Depth, Layers};

/// Receives the steps of a traversal. The implementation for `()` does nothing and compiles to nothing.
pub trait Steps {
    /// A cell above the texels was looked at.
    fn cell(&mut self);
    /// A texel was looked at.
    fn texel(&mut self);
    /// This many samples were looked at.
    fn samples(&mut self, count: usize);
    /// A triangle was tested.
    fn triangle(&mut self);
}

impl Steps for () {
    #[inline(always)]
    fn cell(&mut self) {}
    #[inline(always)]
    fn texel(&mut self) {}
    #[inline(always)]
    fn samples(&mut self, _: usize) {}
    #[inline(always)]
    fn triangle(&mut self) {}
}

/// Steps of traversals, summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepCounts {
    /// Cells looked at, on all levels above the texels.
    pub cells: u64,
    /// Texels looked at.
    pub texels: u64,
    /// Samples looked at.
    pub samples: u64,
    /// Triangles tested.
    pub triangles: u64,
}

impl Steps for StepCounts {
    #[inline]
    fn cell(&mut self) {
        self.cells += 1;
    }
    #[inline]
    fn texel(&mut self) {
        self.texels += 1;
    }
    #[inline]
    fn samples(&mut self, count: usize) {
        self.samples += count as u64;
    }
    #[inline]
    fn triangle(&mut self) {
        self.triangles += 1;
    }
}

/// A ray's way through one texel, coordinates relative to the texel's centre.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    /// Parameters at which it enters and leaves.
    pub(crate) t: [f64; 2],
    /// Raster coordinates and depth at either.
    pub(crate) u: [f32; 2],
    pub(crate) v: [f32; 2],
    pub(crate) w: [f32; 2],
}

impl Segment {
    #[inline(always)]
    fn of(march: &March, passage: &Passage) -> Self {
        let t = [march.t, passage.end];
        let (x, y) = (&march.way.x, &march.way.y);
        let (u, v) = (f64::from(march.x.cell) + 0.5, f64::from(march.y.cell) + 0.5);
        Self {
            t,
            u: [(x.at(t[0]) - u) as f32, (x.at(t[1]) - u) as f32],
            v: [(y.at(t[0]) - v) as f32, (y.at(t[1]) - v) as f32],
            w: passage.w,
        }
    }

    /// How far a plane's depth lies below the ray at both ends.
    #[inline(always)]
    pub(crate) fn above(&self, depth: f32, slopes: [i8; 2]) -> [f32; 2] {
        let slope = |g: i8| f32::from(g) * (1.0 / 127.0);
        let (gu, gv) = (slope(slopes[0]), slope(slopes[1]));
        let above = |i: usize| self.w[i] - (depth + gu * self.u[i] + gv * self.v[i]);
        [above(0), above(1)]
    }
}

/// A ray along one axis of a raster.
struct Across {
    origin: f64,
    dir: f64,
    /// What crossings are counted from: the origin, or what makes them infinite where the ray never leaves.
    start: f64,
    inverse: f64,
    forward: bool,
    step: i32,
    size: i32,
}

impl Across {
    fn new(origin: f64, dir: f64, size: u32) -> Self {
        let still = dir == 0.0;
        Self {
            origin,
            dir,
            start: if still { f64::NEG_INFINITY } else { origin },
            inverse: if still { 1.0 } else { 1.0 / dir },
            forward: dir > 0.0,
            step: if dir > 0.0 { 1 } else { -1 },
            size: size as i32,
        }
    }

    #[inline(always)]
    fn at(&self, t: f64) -> f64 {
        self.origin + t * self.dir
    }

    /// Texel of the ray's point, between two.
    #[inline(always)]
    fn texel(&self, t: f64, within: &Range<i32>) -> i32 {
        // Casts cut off and saturate.
        (self.at(t) as i32).max(within.start).min(within.end - 1)
    }

    /// Parameter at which the ray crosses an edge.
    #[inline(always)]
    fn crossing(&self, edge: f64) -> f64 {
        (edge - self.start) * self.inverse
    }
}

/// A ray's way over cells of one size along one axis.
struct Along<'a> {
    across: &'a Across,
    cell: i32,
    first: i32,
    count: u32,
    /// Where the ray leaves the cell.
    edge: f64,
    exit: f64,
    /// From edge to edge.
    width: f64,
}

impl<'a> Along<'a> {
    /// From the cell at `t` over those, 2^`shift` texels wide, that the texels are in.
    #[inline(always)]
    fn new(across: &'a Across, t: f64, texels: &Range<i32>, shift: u32) -> Self {
        let cell = across.texel(t, texels) >> shift;
        let first = texels.start >> shift;
        let edge = f64::from((cell + i32::from(across.forward)) << shift);
        Self {
            across,
            cell,
            first,
            count: (((texels.end - 1) >> shift) - first + 1) as u32,
            edge,
            exit: across.crossing(edge),
            width: f64::from(across.step << shift),
        }
    }

    /// To the next cell, or not. No branch: nobody could guess it.
    #[inline(always)]
    fn step(&mut self, moves: bool) {
        self.edge += if moves { self.width } else { 0.0 };
        self.exit = self.across.crossing(self.edge);
        self.cell += if moves { self.across.step } else { 0 };
    }

    #[inline(always)]
    fn outside(&self) -> bool {
        (self.cell - self.first) as u32 >= self.count
    }
}

/// Whether depths meet what a cell holds.
#[inline(always)]
fn meets(cell: &Cell, [a, b]: [f32; 2], reach: f32, per_texel: f32) -> bool {
    let (low, high) = (a.min(b) - reach, a.max(b) + reach);
    low <= cell.max && high >= cell.min && slots(low, high, per_texel) & cell.occupied != 0
}

/// Whether depths pass where a texel has samples.
#[inline(always)]
fn occupied(texel: &Texel, [a, b]: [f32; 2], reach: f32, per_texel: f32) -> bool {
    let passed = coarse_slots(a.min(b) - reach, a.max(b) + reach, per_texel);
    passed & texel.occupied != 0
}

/// How far from the ray something may be that counts, in texels of depth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// Bounds of a cell.
    pub(crate) cell: f32,
    /// What a texel's samples span.
    pub(crate) texel: f32,
    /// Depth of a sample at its texel's centre, from what the ray has over the texel.
    pub(crate) sample: f32,
}

/// A ray over a raster: its projection and its depth.
struct Way {
    x: Across,
    y: Across,
    /// Depth at 0 and its change.
    depth: [f64; 2],
}

impl Way {
    fn new(raster: &Raster, ray: &TexelRay) -> Self {
        let (origin, dir) = (raster.turned(ray.origin), raster.turned(ray.dir));
        Self {
            x: Across::new(origin.x, dir.x, raster.size[0]),
            y: Across::new(origin.y, dir.y, raster.size[1]),
            depth: [origin.z, dir.z],
        }
    }

    #[inline(always)]
    fn depth_at(&self, t: f64) -> f32 {
        (self.depth[0] + t * self.depth[1]) as f32
    }
}

/// Where a ray is among the cells of one size in a rectangle of texels.
struct March<'a> {
    way: &'a Way,
    x: Along<'a>,
    y: Along<'a>,
    t: f64,
    depth: f32,
}

/// A ray's way through a cell, up to the end of the ray at most.
struct Passage {
    /// Whether it goes on to another row, not to another column.
    sideways: bool,
    exit: f64,
    end: f64,
    /// Depths at either end.
    w: [f32; 2],
}

impl<'a> March<'a> {
    #[inline(always)]
    fn new(way: &'a Way, t: f64, [columns, rows]: &[Range<i32>; 2], [sx, sy]: [u32; 2]) -> Self {
        Self {
            way,
            x: Along::new(&way.x, t, columns, sx),
            y: Along::new(&way.y, t, rows, sy),
            t,
            depth: way.depth_at(t),
        }
    }

    #[inline(always)]
    fn passage(&self, t_end: f64) -> Passage {
        let sideways = self.y.exit < self.x.exit;
        // Rounding must not turn a segment around.
        let exit = larger(if sideways { self.y.exit } else { self.x.exit }, self.t);
        let end = smaller(exit, t_end);
        Passage {
            sideways,
            exit,
            end,
            w: [self.depth, self.way.depth_at(end)],
        }
    }

    /// Goes on to the next cell, if the rectangle has one.
    #[inline(always)]
    fn goes_on(&mut self, passage: &Passage) -> bool {
        (self.t, self.depth) = (passage.exit, passage.w[1]);
        self.x.step(!passage.sideways);
        self.y.step(passage.sideways);
        !(self.x.outside() | self.y.outside())
    }
}

/// What a walk through one direction looks at.
struct Search<'a, D> {
    stack: &'a Stack,
    samples: &'a Layers<D>,
    way: Way,
    reach: Reach,
    /// 64 over the cube's size.
    per_texel: f32,
}

impl<D: Depth> Search<'_, D> {
    /// Walks over the cells of the first of these levels within a rectangle of texels, from `t` on, and through those
    /// whose samples the ray may meet. Breaks where the ray ends.
    fn cells(
        &self,
        levels: &[Level],
        t: f64,
        texels: &[Range<i32>; 2],
        t_end: &mut f64,
        steps: &mut impl Steps,
        visit: &mut impl FnMut(Range<usize>, &Segment, &mut f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some((level, below)) = levels.split_first() else {
            return self.texels(t, texels, t_end, steps, visit);
        };
        let [sx, sy] = level.shift;
        let mut march = March::new(&self.way, t, texels, level.shift);
        loop {
            steps.cell();
            let passage = march.passage(*t_end);
            let (column, row) = (march.x.cell, march.y.cell);
            let cell = level.cell(column as u32, row as u32);
            if meets(cell, passage.w, self.reach.cell, self.per_texel) {
                // A cell at the raster's end may reach beyond it.
                let inner = [
                    column << sx..((column + 1) << sx).min(self.way.x.size),
                    row << sy..((row + 1) << sy).min(self.way.y.size),
                ];
                self.cells(below, march.t, &inner, t_end, steps, visit)?;
            }
            if passage.exit > *t_end {
                return ControlFlow::Break(());
            }
            if !march.goes_on(&passage) {
                return ControlFlow::Continue(());
            }
        }
    }

    /// The same over texels.
    #[inline(always)]
    fn texels(
        &self,
        t: f64,
        texels: &[Range<i32>; 2],
        t_end: &mut f64,
        steps: &mut impl Steps,
        visit: &mut impl FnMut(Range<usize>, &Segment, &mut f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let mut march = March::new(&self.way, t, texels, [0; 2]);
        loop {
            steps.texel();
            let passage = march.passage(*t_end);
            let index = self.stack.raster.index(march.x.cell as u32, march.y.cell as u32);
            let texel = &self.stack.texels[index];
            if occupied(texel, passage.w, self.reach.texel, 0.5 * self.per_texel) {
                let list = texel.start as usize..self.stack.texels[index + 1].start as usize;
                let near = self.within(list, passage.w);
                if !near.is_empty() {
                    steps.samples(near.len());
                    visit(near, &Segment::of(&march, &passage), t_end)?;
                }
            }
            if passage.exit > *t_end {
                return ControlFlow::Break(());
            }
            if !march.goes_on(&passage) {
                return ControlFlow::Continue(());
            }
        }
    }

    /// Those of a texel's samples that may lie within reach of the ray's depths.
    #[inline(always)]
    fn within(&self, list: Range<usize>, [a, b]: [f32; 2]) -> Range<usize> {
        let depths = [a.min(b) - self.reach.sample, a.max(b) + self.reach.sample];
        self.samples.between(list, depths, self.stack.scale)
    }
}

/// Calls `visit` with the samples within reach in every texel the ray passes over, texels in order along the ray, until
/// it breaks. `visit` may shorten the ray through its last argument.
///
/// Samples of a texel are sorted by depth, so those within reach are found without a look at the others: a texel of a
/// wall seen along its length has hundreds.
#[inline(always)]
pub(crate) fn walk<D: Depth>(
    stack: &Stack,
    samples: &Layers<D>,
    ray: &TexelRay,
    t_end: &mut f64,
    reach: Reach,
    steps: &mut impl Steps,
    mut visit: impl FnMut(Range<usize>, &Segment, &mut f64) -> ControlFlow<()>,
) {
    if ray.t_min > *t_end {
        return;
    }
    let search = Search {
        stack,
        samples,
        way: Way::new(&stack.raster, ray),
        reach,
        per_texel: 64.0 / stack.scale,
    };
    let all = [0..search.way.x.size, 0..search.way.y.size];
    // Whether the ray ended in the raster or left it is all the same.
    let _ = search.cells(&stack.levels, ray.t_min, &all, t_end, steps, &mut visit);
}

/// The larger of two numbers, none if either is none.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of two numbers.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}
