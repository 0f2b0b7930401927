//! Following a ray through one direction of the cube: a 2-D DDA over cells of all levels (VMV07, ray traversal).
//!
//! The ray's projection walks over the raster. In a cell of a coarse level its depths in there are compared with the
//! cell's bounds; where they meet, the walk goes on in the cells below, else it leaves for the next cell, rising a
//! level when it leaves the cell above too. Texels with samples are given to `visit`.
//!
//! Positions are whole texels, and a cell's exit is computed from its edge, not accumulated, so the walk always
//! advances and ends. The texels visited are those of a line within 2^-14 texels of the true one; samples reach
//! [`super::raster::REACH`] beyond their texel. The segments of consecutive cells join without gaps.

use std::ops::ControlFlow;

use super::build::Stack;
use super::frame::TexelRay;
use super::levels::{Cell, Texel, coarse_slots, slots};
use super::samples::{Depth, Sample};

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
    inverse: f64,
    /// Added to parameters: infinity where the ray never leaves.
    never: f64,
    forward: bool,
    size: i32,
}

impl Across {
    fn new(origin: f64, dir: f64, size: u32) -> Self {
        let still = dir == 0.0;
        Self {
            origin,
            dir,
            inverse: if still { 0.0 } else { 1.0 / dir },
            never: if still { f64::INFINITY } else { 0.0 },
            forward: dir > 0.0,
            size: size as i32,
        }
    }

    #[inline(always)]
    fn at(&self, t: f64) -> f64 {
        self.origin + t * self.dir
    }

    /// Texel of the ray's point, between two.
    #[inline(always)]
    fn texel(&self, t: f64, first: i32, end: i32) -> i32 {
        // Casts cut off and saturate; a cell at the raster's end may reach beyond it.
        (self.at(t) as i32).max(first).min(end.min(self.size) - 1)
    }

    /// Parameter at which the ray leaves the texels from `first` to before `end`.
    #[inline(always)]
    fn exit(&self, first: i32, end: i32) -> f64 {
        let edge = if self.forward { end } else { first };
        (f64::from(edge) - self.origin) * self.inverse + self.never
    }

    /// The texel it goes to from there, if it is in the raster.
    #[inline(always)]
    fn next(&self, first: i32, end: i32) -> Option<i32> {
        let next = if self.forward { end } else { first - 1 };
        (0..self.size).contains(&next).then_some(next)
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

/// Those of a texel's samples that may lie within reach of the ray's depths.
#[inline(always)]
fn within<D: Depth>(list: &[Sample<D>], [a, b]: [f32; 2], reach: f32, scale: f32) -> &[Sample<D>] {
    let (low, high) = (a.min(b) - reach, a.max(b) + reach);
    let from = list.partition_point(|sample| sample.depth.texels(scale) < low);
    let list = &list[from..];
    // These are few.
    let beyond = list.iter().position(|sample| sample.depth.texels(scale) > high);
    &list[..beyond.unwrap_or(list.len())]
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

/// Calls `visit` with the samples within reach in every texel the ray passes over, texels in order along the ray, until
/// it breaks. `visit` may shorten the ray through its last argument.
///
/// Samples of a texel are sorted by depth, so those within reach are found by halving: a texel of a wall seen along its
/// length has hundreds.
#[inline(always)]
pub(crate) fn walk<D: Depth>(
    stack: &Stack,
    samples: &[Sample<D>],
    ray: &TexelRay,
    t_end: &mut f64,
    reach: Reach,
    steps: &mut impl Steps,
    mut visit: impl FnMut(&[Sample<D>], &Segment, &mut f64) -> ControlFlow<()>,
) {
    let raster = stack.raster;
    let (origin, dir) = (raster.turned(ray.origin), raster.turned(ray.dir));
    let x = Across::new(origin.x, dir.x, raster.size[0]);
    let y = Across::new(origin.y, dir.y, raster.size[1]);
    let depth_at = |t: f64| (origin.z + t * dir.z) as f32;
    let levels = &stack.levels[..];
    let per_texel = 64.0 / stack.scale;
    let mut t = ray.t_min;
    let (mut column, mut row) = (x.texel(t, 0, x.size), y.texel(t, 0, y.size));
    let mut depth = 0;
    while t <= *t_end {
        let level = levels.get(depth);
        let [sx, sy] = level.map_or([0; 2], |level| level.shift);
        let (left, top) = (column >> sx << sx, row >> sy << sy);
        let (right, bottom) = (left + (1 << sx), top + (1 << sy));
        let (exit_x, exit_y) = (x.exit(left, right), y.exit(top, bottom));
        let sideways = exit_y < exit_x;
        // Rounding must not turn a segment around.
        let exit = if sideways { exit_y } else { exit_x }.max(t);
        let end = exit.min(*t_end);
        let w = [depth_at(t), depth_at(end)];
        if let Some(level) = level {
            steps.cell();
            if meets(level.cell(column as u32, row as u32), w, reach.cell, per_texel) {
                depth += 1;
                continue;
            }
        } else {
            steps.texel();
            let index = raster.index(column as u32, row as u32);
            let near = if occupied(&stack.texels[index], w, reach.texel, 0.5 * per_texel) {
                let list = stack.texels[index].start as usize..stack.texels[index + 1].start as usize;
                within(&samples[list], w, reach.sample, stack.scale)
            } else {
                &[]
            };
            if !near.is_empty() {
                steps.samples(near.len());
                let (u, v) = (f64::from(column) + 0.5, f64::from(row) + 0.5);
                let segment = Segment {
                    t: [t, end],
                    u: [(x.at(t) - u) as f32, (x.at(end) - u) as f32],
                    v: [(y.at(t) - v) as f32, (y.at(end) - v) as f32],
                    w,
                };
                if visit(near, &segment, t_end).is_break() {
                    return;
                }
            }
        }
        if exit > *t_end {
            return;
        }
        let from = (column, row);
        let next = if sideways {
            y.next(top, bottom).map(|next| (x.texel(exit, left, right), next))
        } else {
            x.next(left, right).map(|next| (next, y.texel(exit, top, bottom)))
        };
        let Some(to) = next else { return };
        (column, row) = to;
        t = exit;
        if depth > 0 {
            let [sx, sy] = levels[depth - 1].shift;
            depth -= usize::from((from.0 ^ column) >> sx != 0 || (from.1 ^ row) >> sy != 0);
        }
    }
}
