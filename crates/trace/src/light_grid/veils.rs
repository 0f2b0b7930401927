//! All casters between a receiver and the light, for casters that light may pass.
//!
//! HM08 §5.2's grid with another question: not whether, but which. A masked triangle casts where its texture covers,
//! a blended one lets a share through, and neither is known here; so every caster in between is handed out, with the
//! place where the ray meets it. Cost: as [`PointLightGrid::shadowed`], and the exact hit of every pair.

use std::ops::ControlFlow;

use super::{PointLightGrid, ShadowScratch};
use crate::Receiver;
use crate::exact::{self, ExactHit};
use crate::kernel::LANES;
use crate::kernel::veils::veiled;

/// References looked at before what they hold is handed out: receivers that are done early are then left out.
const STRIDE: usize = 16;

impl PointLightGrid<'_> {
    /// Calls `visit` with every caster between a receiver and the light: position of the receiver, triangle, and
    /// where the ray meets it. The casters of one receiver come by ascending id, each once, until `visit` breaks;
    /// receivers come in no order that means anything.
    pub fn each_between(
        &self,
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        mut visit: impl FnMut(usize, u32, &ExactHit) -> ControlFlow<()>,
    ) {
        if !self.unprojected.is_empty() {
            for (i, receiver) in receivers.iter().enumerate().filter(|(_, r)| r.point.is_finite()) {
                let between = |&prim: &u32| Some((prim, self.between(receiver, prim, false)?));
                let _ = self
                    .unprojected
                    .iter()
                    .filter_map(between)
                    .try_for_each(|(prim, hit)| visit(i, prim, &hit));
            }
            return;
        }
        self.sort_into_cells(receivers, scratch, |_| ());
        let ShadowScratch {
            pending,
            points,
            veils,
            ..
        } = scratch;
        for same_cell in pending.chunk_by(|a, b| (a.face, a.cell) == (b.face, b.cell)) {
            let face = &self.faces[same_cell[0].face as usize];
            for batch in same_cell.chunks(LANES) {
                for (lane, pending) in batch.iter().enumerate() {
                    let own = receivers[pending.receiver as usize].prim;
                    points.set(lane, &pending.place, own);
                }
                let mut open = u32::MAX >> (32 - batch.len() as u32);
                let lists = face.bins.cell(batch[0].cell as usize);
                for refs in lists.flat_map(|refs| refs.chunks(STRIDE)) {
                    veils.clear();
                    veiled(self.level, points, open, &face.casters, refs, veils);
                    for found in veils.iter() {
                        let index = batch[found.lane as usize].receiver as usize;
                        if open & (1 << found.lane) != 0
                            && let Some(hit) = self.between(&receivers[index], found.prim, found.met)
                            && visit(index, found.prim, &hit).is_break()
                        {
                            open &= !(1 << found.lane);
                        }
                    }
                    if open == 0 {
                        break;
                    }
                }
            }
        }
    }

    /// The hit by which a triangle lies between a receiver and the light; `met` if their line is known to meet it.
    fn between(&self, receiver: &Receiver, prim: u32, met: bool) -> Option<ExactHit> {
        if !met {
            return exact::shadow_hit(&self.triangles, prim, receiver, &self.light);
        }
        let (origin, dir) = exact::shadow_line(receiver, &self.light);
        let hit = exact::attributes(origin, dir, self.triangles.corners(prim))?;
        exact::lies_between(&hit, dir, receiver, &self.light).then_some(hit)
    }
}

#[cfg(test)]
mod tests;
