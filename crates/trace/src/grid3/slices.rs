//! Four rays at once through the cells of a space, slab by slab along z (Wald et al. 2006, with z as major axis, as HM08
//! §5.3 has it).
//!
//! *Why no cell is missed.* A ray's part in a slab is that between its crossings of the slab's planes, which are moved out
//! by [`Partition::pad`]; the rectangle around these parts is widened by the pad once more. What rounding does to a crossing
//! is below a share 2^-50 of the box over the ray's extent along z; rays whose extent is below the pad count with all of
//! their length.

use super::walk::{Mailbox, SpaceGrid};
use crate::Count;
use crate::space::{Space, SpaceRay};

/// Rays of a packet.
pub(crate) const PACKET: usize = 4;

impl<S: Space> SpaceGrid<S> {
    /// Visits the items of all cells around the live rays, the slabs of largest z first; `visit` takes rays that are done
    /// out of the live ones.
    pub(crate) fn slices(
        &self,
        segments: &[Option<SpaceRay>; PACKET],
        live: &mut u32,
        mailbox: &mut Mailbox,
        count: &mut impl Count,
        visit: &mut impl FnMut(u32, &mut u32),
    ) {
        let partition = &self.partition;
        let present = || segments.iter().flatten();
        let low = present().fold(f64::INFINITY, |z, s| z.min(s.start.z).min(s.end.z));
        let high = present().fold(f64::NEG_INFINITY, |z, s| z.max(s.start.z).max(s.end.z));
        let Some([first, last]) = partition.span(2, low, high) else {
            return;
        };
        for slab in (first..=last).rev() {
            let mut around = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
            for (lane, segment) in segments.iter().enumerate() {
                let Some(segment) = segment.as_ref().filter(|_| *live >> lane & 1 != 0) else {
                    continue;
                };
                let Some(part) = part_in(segment, partition.padded(2, slab), partition.pad().z) else {
                    continue;
                };
                for s in part {
                    let at = segment.start + (segment.end - segment.start) * s;
                    for (axis, [low, high]) in around.iter_mut().enumerate() {
                        (*low, *high) = (low.min(at[axis]), high.max(at[axis]));
                    }
                }
            }
            let [xs, ys] = [0, 1].map(|axis| partition.span(axis, around[axis][0], around[axis][1]));
            let (Some(xs), Some(ys)) = (xs, ys) else { continue };
            for y in ys[0]..=ys[1] {
                for x in xs[0]..=xs[1] {
                    count.node();
                    for &item in self.cells.of(partition.index([x, y, slab])) {
                        if mailbox.is_new(item) {
                            visit(item, live);
                        }
                    }
                    if *live == 0 {
                        return;
                    }
                }
            }
        }
    }
}

/// The parameters at which a segment is between two planes of z.
fn part_in(segment: &SpaceRay, [low, high]: [f64; 2], pad: f64) -> Option<[f64; 2]> {
    let (from, along) = (segment.start.z, segment.end.z - segment.start.z);
    if along.abs() <= pad {
        let apart = from.max(segment.end.z) < low || from.min(segment.end.z) > high;
        return (!apart).then_some([0.0, 1.0]);
    }
    let (s, t) = ((low - from) / along, (high - from) / along);
    let (enter, leave) = (s.min(t).max(0.0), s.max(t).min(1.0));
    (enter <= leave).then_some([enter, leave])
}
