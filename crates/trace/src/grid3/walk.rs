//! Walking a ray through the cells of a space, or through several spaces.

use std::ops::ControlFlow;

use glam::DVec3;

use super::cells::Cells;
use super::overlap::{self, Outline};
use super::partition::Partition;
use crate::space::{Space, SpaceRay};
use crate::{Count, ViewRay};

/// The share of itself by which the parameter of a hit may be wrong, with room to spare ([`crate::exact`]).
const T_PAD: f64 = 1.0 / (1u32 << 20) as f64;

/// The part of a ray at which hits still count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaySpan {
    range: [f64; 2],
}

impl RaySpan {
    /// Hits with parameters in this range, which may be infinite.
    pub(crate) fn new([from, to]: [f64; 2]) -> Self {
        Self {
            range: [from - from.abs() * T_PAD, to + to.abs() * T_PAD],
        }
    }

    /// Lets nothing beyond this parameter count any more.
    #[inline]
    pub fn shorten(&mut self, t: f64) {
        self.range[1] = self.range[1].min(t + t.abs() * T_PAD);
    }

    /// The range, widened by what hits may be wrong.
    pub(crate) fn range(&self) -> [f64; 2] {
        self.range
    }
}

/// The items a ray has lately been tested with, by the low bits of their ids: most of those that lie in several cells
/// of the ray are tested once. 1 KB.
pub(crate) struct Mailbox([u32; 256]);

impl Mailbox {
    pub(crate) fn new() -> Self {
        Self([u32::MAX; 256])
    }

    #[inline]
    pub(crate) fn is_new(&mut self, item: u32) -> bool {
        let slot = &mut self.0[(item & 255) as usize];
        let new = *slot != item;
        *slot = item;
        new
    }
}

/// A ray on its way.
pub(crate) struct Walk {
    pub(crate) ray: ViewRay,
    pub(crate) span: RaySpan,
    mailbox: Mailbox,
}

impl Walk {
    /// `None` for rays that hit nothing because they are not finite or have no direction.
    pub(crate) fn new(ray: &ViewRay, range: [f64; 2]) -> Option<Self> {
        let usable = ray.origin.is_finite() && ray.dir.is_finite() && ray.dir != DVec3::ZERO;
        (usable && range[0] < range[1]).then(|| Self {
            ray: *ray,
            span: RaySpan::new(range),
            mailbox: Mailbox::new(),
        })
    }

    /// Visits items that it has not visited just before.
    #[inline]
    pub(crate) fn visit(
        &mut self,
        items: impl Iterator<Item = u32>,
        count: &mut impl Count,
        visit: &mut impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        for item in items {
            if self.mailbox.is_new(item) {
                count.triangles(1);
                visit(item, &mut self.span)?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// Items in the cells of one space.
#[derive(Clone, Debug)]
pub(crate) struct SpaceGrid<S> {
    pub(crate) space: S,
    pub(crate) partition: Partition,
    pub(crate) cells: Cells,
}

impl<S: Space> SpaceGrid<S> {
    /// Sorts items 0 .. `items` into cells; those without an outline are left out.
    pub(crate) fn build(
        space: S,
        partition: Partition,
        items: usize,
        outline: impl Fn(u32) -> Option<Outline> + Sync,
    ) -> Self {
        let cells = Cells::build(partition.cell_count(), items, |item, emit| {
            if let Some(outline) = outline(item) {
                overlap::each_cell(&space, &partition, &outline, emit);
            }
        });
        Self {
            space,
            partition,
            cells,
        }
    }

    /// Whether cells tell apart what comes from coordinates of this magnitude.
    pub(crate) fn resolves(&self, magnitude: f64) -> bool {
        self.partition.resolves(self.space.error(magnitude))
    }

    /// Visits the items of all cells that the ray passes, in order, as far as its span goes.
    #[inline]
    pub(crate) fn walk(
        &self,
        walk: &mut Walk,
        count: &mut impl Count,
        visit: &mut impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some(segment) = self.space.segment(&walk.ray, walk.span.range()) else {
            return ControlFlow::Continue(());
        };
        let mut steps = self.partition.steps(segment.start, segment.end);
        let (mut end, mut t_end) = (1.0, walk.span.range()[1]);
        loop {
            count.node();
            walk.visit(self.cells.of(steps.cell()).iter().copied(), count, visit)?;
            let span = walk.span.range()[1];
            if span < t_end {
                t_end = span;
                end = end_of(&segment, span);
            }
            // Written so that NaN ends the walk.
            if steps.leaves_at() < end {
                steps.advance();
            } else {
                return ControlFlow::Continue(());
            }
        }
    }
}

/// A parameter of the segment by which a parameter of its ray is certainly passed. The rounding of the conversion is
/// some 2^-50 of the larger of the depths over the smaller one, which is below 2^-36 wherever cells resolve.
fn end_of(segment: &SpaceRay, t: f64) -> f64 {
    const SLACK: f64 = 1.0 / (1u64 << 36) as f64;
    if t >= segment.t_end {
        return 1.0;
    }
    let t = t + segment.t_start.abs() * SLACK;
    let s = segment.s_of_t(t.clamp(segment.t_start, segment.t_end));
    s * (1.0 + SLACK) + SLACK
}
