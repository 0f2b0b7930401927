//! [`SolidGrids`]: any ray at solids, through the perspective grids of a point, also while they move.
//!
//! Source: HM08 §3 (see the [parent module](super)). Layout: [`crate::faces`]. Solids are few beside triangles, so most
//! rays pass none: a ray is first held against the box around all of them, some 10 ns.

use std::borrow::Cow;
use std::cmp::Ordering;
use std::ops::ControlFlow;

use glam::DVec3;

use super::between::{between, bounds_between};
use super::{Crossing, Solid, SolidReceiver, blocks, crossings, first, slab, towards};
use crate::faces::{FaceGrids, FaceOptions, each_of};
use crate::grid3::{Outline, RaySpan};
use crate::{Count, Light, ViewRay};

/// Perspective grids over solids. See the [module](super).
#[derive(Clone, Debug)]
pub struct SolidGrids<'a> {
    open: &'a [Solid],
    close: &'a [Solid],
    /// None if every solid is tested.
    grids: Option<FaceGrids>,
    /// The box around all solids, somewhat enlarged.
    around: [DVec3; 2],
}

impl<'a> SolidGrids<'a> {
    /// Builds over all solids that are finite and not empty, in parallel; the same for any number of threads. Any
    /// `center` will do; one that rays pass close by is fast.
    pub fn build(center: DVec3, solids: &'a [Solid], options: &FaceOptions) -> Self {
        Self::moving(center, [solids, solids], options)
    }

    /// As [`Self::build`], over solids that move: each number that describes one goes evenly from that of the first to
    /// that of the second.
    ///
    /// # Panics
    /// If the two do not have as many solids.
    pub fn moving(center: DVec3, [open, close]: [&'a [Solid]; 2], options: &FaceOptions) -> Self {
        assert!(
            open.len() == close.len(),
            "the number of solids differs between the two times"
        );
        let bounds = |id: u32| bounds_between(&open[id as usize], &close[id as usize]);
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = (0..open.len() as u32)
            .filter_map(bounds)
            .fold(none, |all, next| [all[0].min(next[0]), all[1].max(next[1])]);
        // Crossings are within some 2^-50 of their boxes.
        let pad = (low.abs().max(high.abs())) * 2f64.powi(-40);
        Self {
            open,
            close,
            around: [low - pad, high + pad],
            grids: Some(FaceGrids::build(center, open.len(), options, |id| {
                bounds(id).map(|[low, high]| Outline::boxed(low, high))
            })),
        }
    }

    /// No grids: every ray is tested with every solid, the definition of the right answer.
    ///
    /// # Panics
    /// As [`Self::moving`].
    pub fn every([open, close]: [&'a [Solid]; 2]) -> Self {
        assert!(
            open.len() == close.len(),
            "the number of solids differs between the two times"
        );
        Self {
            open,
            close,
            grids: None,
            around: [DVec3::NEG_INFINITY, DVec3::INFINITY],
        }
    }

    /// The solids at a time from 0 to 1.
    pub fn at(&self, time: f64) -> SolidsAt<'_> {
        SolidsAt { all: self, time }
    }

    /// The first crossing with a parameter above `range[0]` and up to `range[1]`, with its solid; `on` are solid and leaf
    /// that the ray starts on, if any.
    pub fn closest(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        on: Option<(u32, u32)>,
        count: &mut impl Count,
    ) -> Option<(u32, Crossing)> {
        self.at(0.0).closest(ray, range, on, count)
    }

    /// Replaces `hits` by all crossings with parameters above `range[0]` and up to `range[1]`, by parameter, then solid.
    pub fn all(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        hits: &mut Vec<(u32, Crossing)>,
    ) {
        hits.clear();
        let mut ids = Vec::new();
        let _ = self.each_candidate(ray, range, count, |id, _| {
            ids.push(id);
            ControlFlow::Continue(())
        });
        ids.sort_unstable();
        ids.dedup();
        for id in ids {
            let all = crossings(&self.open[id as usize], ray, None);
            hits.extend(
                all.into_iter()
                    .filter(|c| c.t > range[0] && c.t <= range[1])
                    .map(|c| (id, c)),
            );
        }
        // Stable: crossings of one solid at one parameter stay in the order in which the line passes them.
        hits.sort_by(|(p, a), (q, b)| a.t.partial_cmp(&b.t).unwrap_or(Ordering::Equal).then(p.cmp(q)));
    }

    /// Whether some solid lies between a receiver and a light.
    pub fn shadows(&self, receiver: &SolidReceiver, light: &Light, count: &mut impl Count) -> bool {
        self.at(0.0).shadows(receiver, light, count)
    }

    /// Memory of the grids in bytes, the solids themselves left out.
    pub fn bytes(&self) -> usize {
        self.grids.as_ref().map_or(0, FaceGrids::bytes)
    }

    /// Cells that hold something.
    pub fn cell_count(&self) -> usize {
        self.grids.as_ref().map_or(0, FaceGrids::cell_count)
    }

    /// References in all cells and in the near list.
    pub fn reference_count(&self) -> usize {
        self.grids.as_ref().map_or(0, FaceGrids::reference_count)
    }

    fn each_candidate(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        count: &mut impl Count,
        visit: impl FnMut(u32, &mut RaySpan) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        match &self.grids {
            Some(grids) if self.passes(ray, range) => grids.each_candidate(ray, range, count, visit),
            Some(_) => ControlFlow::Continue(()),
            None => each_of(self.open.len() as u32, ray, range, count, visit),
        }
    }

    /// Whether the ray comes into the box around all solids.
    fn passes(&self, ray: &ViewRay, range: [f64; 2]) -> bool {
        let [low, high] = self.around;
        let mut left = RaySpan::new(range).range();
        for axis in 0..3 {
            let Some([from, to]) = slab(ray.origin[axis], ray.dir[axis], low[axis], high[axis]) else {
                return false;
            };
            left = [left[0].max(from), left[1].min(to)];
        }
        left[0] <= left[1]
    }
}

/// Solids at one time.
#[derive(Clone, Copy, Debug)]
pub struct SolidsAt<'g> {
    all: &'g SolidGrids<'g>,
    time: f64,
}

impl<'g> SolidsAt<'g> {
    /// A solid as it is at that time.
    pub fn solid(&self, id: u32) -> Cow<'g, Solid> {
        let (open, close) = (&self.all.open[id as usize], &self.all.close[id as usize]);
        if self.time == 0.0 || open == close {
            Cow::Borrowed(open)
        } else {
            Cow::Owned(between(open, close, self.time))
        }
    }

    /// As [`SolidGrids::closest`].
    pub fn closest(
        &self,
        ray: &ViewRay,
        range: [f64; 2],
        on: Option<(u32, u32)>,
        count: &mut impl Count,
    ) -> Option<(u32, Crossing)> {
        let mut best: Option<(u32, Crossing)> = None;
        let _ = self.all.each_candidate(ray, range, count, |id, span| {
            if let Some(next) = first(&self.solid(id), id, ray, range, on) {
                let closer = best.is_none_or(|(other, b)| next.t < b.t || (next.t == b.t && id < other));
                if closer {
                    best = Some((id, next));
                    span.shorten(next.t);
                }
            }
            ControlFlow::Continue(())
        });
        best
    }

    /// As [`SolidGrids::shadows`].
    pub fn shadows(&self, receiver: &SolidReceiver, light: &Light, count: &mut impl Count) -> bool {
        let (ray, [_, to]) = towards(receiver, light);
        let visit = |id: u32, _: &mut RaySpan| {
            if blocks(&self.solid(id), id, receiver, light) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        self.all.each_candidate(&ray, [0.0, to], count, visit).is_break()
    }
}
