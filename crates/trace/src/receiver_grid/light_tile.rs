//! One light tile: its receivers into cells, its casters over them, what is unsure decided exactly.

use super::FaceScene;
use crate::exact;
use crate::kernel::LANES;
use crate::kernel::edges::{EdgeLanes, VertexLanes};
use crate::kernel::pixels::{BlockPoints, Entry, LIGHT_TILE};
use crate::kernel::project::RasterVertex;
use crate::kernel::receivers::{CasterArea, ReceiverTile, draw_caster, draw_casters};
use crate::precise::PreciseTriangle;

/// Working memory of one thread.
#[derive(Default)]
pub(super) struct LightTileWork {
    receivers: ReceiverTile,
    vertices: VertexLanes,
    edges: EdgeLanes,
}

/// What became of a light tile.
#[derive(Default)]
pub(super) struct DrawnTile {
    /// Per entry, the receivers that are lit.
    pub(super) lit: Vec<u16>,
    pub(super) untested: u64,
    pub(super) exact_pairs: u64,
    pub(super) references: u64,
}

impl FaceScene<'_> {
    /// Finds the lit receivers among those of the entries.
    pub(super) fn draw_tile<'b>(
        &self,
        work: &mut LightTileWork,
        entries: &[Entry],
        casters: impl Iterator<Item = &'b [u32]>,
        vertices: &[RasterVertex],
        (corner, rounding): ([f32; 2], f32),
    ) -> DrawnTile {
        let points_of = |entry: &Entry| self.points_of(entry);
        work.receivers.set(self.level, entries, &points_of);
        let own = |id: u32| {
            let entry = &entries[id as usize / LANES];
            let block = self.points_of(entry).block as usize;
            self.visibility.tiles()[entry.eye_tile as usize].prims[block][id as usize % LANES]
        };
        let mut drawn = DrawnTile::default();
        let LightTileWork {
            receivers,
            vertices: lanes,
            edges,
        } = work;
        for casters in casters {
            drawn.references += casters.len() as u64;
            for batch in casters.chunks(LANES) {
                lanes.count = 0;
                for &prim in batch {
                    let corners = self.triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
                    lanes.push(prim, corners);
                }
                let mut bad = draw_casters(self.level, receivers, lanes, edges, (corner, rounding), &own);
                while bad != 0 {
                    let lane = bad.trailing_zeros() as usize;
                    let prim = batch[lane];
                    bad &= bad - 1;
                    let corners = self.triangles.corners(prim);
                    if let Some(precise) = PreciseTriangle::new(self.view, corners) {
                        let reach = f64::from(2 * LIGHT_TILE);
                        let record = precise.record(prim, corner.map(f64::from), reach);
                        let area = CasterArea::of_lane(lanes, lane, corner);
                        draw_caster(self.level, receivers, &record, &area, &own);
                    }
                }
            }
        }
        self.settle(receivers, entries, &mut drawn);
        drawn
    }

    fn points_of(&self, entry: &Entry) -> &BlockPoints {
        &self.gathered[entry.eye_tile as usize].points[entry.points as usize]
    }

    /// Decides the unsure pairs and sums up.
    fn settle(&self, receivers: &mut ReceiverTile, entries: &[Entry], drawn: &mut DrawnTile) {
        let unsure = std::mem::take(&mut receivers.unsure);
        for &(group, lane, prim) in &unsure {
            let held = &receivers.groups()[group as usize];
            if held.open & 1 << lane == 0 {
                continue;
            }
            drawn.exact_pairs += 1;
            let id = held.id[lane as usize];
            let entry = &entries[id as usize / LANES];
            let (block, pixel) = (self.points_of(entry).block, id % LANES as u32);
            let tile = &self.visibility.tiles()[entry.eye_tile as usize];
            let receiver = tile.receiver(self.visibility.view(), self.triangles, block, pixel);
            let hides = |r| exact::shadows(self.triangles, prim, &r, &self.query.light);
            if receiver.is_some_and(hides) {
                receivers.close(group, lane);
            }
        }
        receivers.unsure = unsure;
        drawn.lit.extend(entries.iter().map(|e| e.lanes));
        for group in receivers.groups() {
            if !group.tested {
                drawn.untested += u64::from(group.all.count_ones());
            }
            let mut shadowed = group.all & !group.open;
            while shadowed != 0 {
                let id = group.id[shadowed.trailing_zeros() as usize] as usize;
                shadowed &= shadowed - 1;
                drawn.lit[id / LANES] &= !(1 << (id % LANES));
            }
        }
    }
}
