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

use glam::DVec3;

use super::build::Stack;
use super::frame::TexelRay;
use super::levels::{Level, slots};

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
        let [gu, gv] = slopes.map(|g| f32::from(g) * (1.0 / 127.0));
        [0, 1].map(|i| self.w[i] - (depth + gu * self.u[i] + gv * self.v[i]))
    }
}

/// A ray in one direction's raster.
struct Walk {
    origin: DVec3,
    dir: DVec3,
    inverse: [f64; 2],
    size: [i32; 2],
}

impl Walk {
    /// Parameter at which the ray passes coordinate `edge` of a raster axis.
    #[inline(always)]
    fn at_edge(&self, axis: usize, edge: i32) -> f64 {
        (f64::from(edge) - self.origin[axis]) * self.inverse[axis]
    }

    #[inline(always)]
    fn depth(&self, t: f64) -> f64 {
        self.origin.z + t * self.dir.z
    }

    /// Texel of the ray's point on a raster axis, between two.
    #[inline(always)]
    fn texel(&self, axis: usize, t: f64, first: i32, last: i32) -> i32 {
        // Casts cut off and saturate.
        ((self.origin[axis] + t * self.dir[axis]) as i32).clamp(first, last)
    }

    /// Whether the ray's depths between two parameters meet what a cell holds.
    #[inline(always)]
    fn meets(&self, level: &Level, at: [i32; 2], t: [f64; 2], pad: f32, per_texel: f32) -> bool {
        let cell = level.cell(at[0] as u32, at[1] as u32);
        let [a, b] = t.map(|t| self.depth(t) as f32);
        let (low, high) = (a.min(b) - pad, a.max(b) + pad);
        low <= cell.max && high >= cell.min && slots(low, high, per_texel) & cell.occupied != 0
    }
}

/// Calls `visit` with the samples (as a range of the stack's) of every texel the ray passes over, in order along the
/// ray, until it breaks. `visit` may shorten the ray through its last argument. Cells count as met when the ray
/// comes within `pad` texels of their depths.
#[inline(always)]
pub(crate) fn walk(
    stack: &Stack,
    ray: &TexelRay,
    t_end: &mut f64,
    pad: f32,
    steps: &mut impl Steps,
    mut visit: impl FnMut([usize; 2], &Segment, &mut f64) -> ControlFlow<()>,
) {
    let raster = stack.raster;
    let (origin, dir) = (raster.turned(ray.origin), raster.turned(ray.dir));
    let walk = Walk {
        origin,
        dir,
        inverse: [1.0 / dir.x, 1.0 / dir.y],
        size: raster.size.map(|s| s as i32),
    };
    let levels = &stack.levels[..];
    let per_texel = 64.0 / stack.scale;
    let mut t = ray.t_min;
    let mut at = [0, 1].map(|i| walk.texel(i, t, 0, walk.size[i] - 1));
    let mut depth = 0;
    while t <= *t_end {
        let shift = levels.get(depth).map_or([0; 2], |level| level.shift);
        let low = [0, 1].map(|i| at[i] >> shift[i] << shift[i]);
        let high = [0, 1].map(|i| low[i] + (1 << shift[i]));
        let exits = [0, 1].map(|i| {
            if dir[i] > 0.0 {
                walk.at_edge(i, high[i])
            } else if dir[i] < 0.0 {
                walk.at_edge(i, low[i])
            } else {
                f64::INFINITY
            }
        });
        let side = usize::from(exits[1] < exits[0]);
        // Rounding must not turn a segment around.
        let exit = exits[side].max(t);
        let end = exit.min(*t_end);
        if let Some(level) = levels.get(depth) {
            steps.cell();
            if walk.meets(level, at, [t, end], pad, per_texel) {
                depth += 1;
                continue;
            }
        } else {
            steps.texel();
            let index = raster.index(at[0] as u32, at[1] as u32);
            let range = [stack.starts[index] as usize, stack.starts[index + 1] as usize];
            if range[0] < range[1] {
                steps.samples(range[1] - range[0]);
                let ends = [t, end];
                let centre = at.map(|i| f64::from(i) + 0.5);
                let segment = Segment {
                    t: ends,
                    u: ends.map(|t| (origin.x + t * dir.x - centre[0]) as f32),
                    v: ends.map(|t| (origin.y + t * dir.y - centre[1]) as f32),
                    w: ends.map(|t| walk.depth(t) as f32),
                };
                if visit(range, &segment, t_end).is_break() {
                    return;
                }
            }
        }
        if exit > *t_end {
            return;
        }
        let other = 1 - side;
        let from = at;
        at[side] = if dir[side] > 0.0 {
            high[side]
        } else {
            low[side] - 1
        };
        at[other] = walk.texel(other, exit, low[other], high[other] - 1);
        if at[side] < 0 || at[side] >= walk.size[side] {
            return;
        }
        // A cell at the raster's end may reach beyond it.
        at[other] = at[other].min(walk.size[other] - 1);
        t = exit;
        if depth > 0 {
            let above = levels[depth - 1].shift;
            let left = [0, 1]
                .into_iter()
                .any(|i| from[i] >> above[i] != at[i] >> above[i]);
            depth -= usize::from(left);
        }
    }
}
