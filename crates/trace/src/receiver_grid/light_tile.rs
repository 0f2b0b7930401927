//! One light tile: its receivers into boxes, its casters over them, what is unsure decided exactly.

use std::sync::atomic::Ordering;

use super::FaceScene;
use super::casters::Caster;
use crate::exact;
use crate::kernel::LANES;
use crate::kernel::edges::{EdgeLanes, VertexLanes};
use crate::kernel::pixels::LIGHT_TILE;
use crate::kernel::receivers::{CasterArea, ReceiverTile, draw_caster, draw_casters};
use crate::precise::PreciseTriangle;

/// Working memory of one thread.
#[derive(Default)]
pub(super) struct LightTileWork {
    receivers: ReceiverTile,
    vertices: VertexLanes,
    edges: EdgeLanes,
}

/// What it took to do a light tile.
#[derive(Clone, Copy, Default)]
pub(super) struct DrawnTile {
    pub(super) untested: u64,
    pub(super) exact_pairs: u64,
    pub(super) references: u64,
}

impl FaceScene<'_> {
    /// Puts out the pixels of a light tile, counted through all faces, that are in shadow.
    pub(super) fn draw_tile<'b>(
        &self,
        work: &mut LightTileWork,
        light_tile: usize,
        casters: impl Iterator<Item = &'b Caster>,
        place: ([f32; 2], f32),
    ) -> DrawnTile {
        let entries = self.parts.iter().map(|part| part.of_tile(light_tile));
        work.receivers.set(self.level, entries);
        let mut drawn = DrawnTile::default();
        work.vertices.count = 0;
        for caster in casters {
            drawn.references += 1;
            work.vertices
                .push_lanes(caster.prim, caster.x, caster.y, caster.nearness);
            if work.vertices.count == LANES {
                self.draw_batch(work, place);
            }
        }
        if work.vertices.count > 0 {
            self.draw_batch(work, place);
        }
        self.settle(&mut work.receivers, &mut drawn);
        drawn
    }

    /// Draws the casters that wait.
    fn draw_batch(&self, work: &mut LightTileWork, (corner, rounding): ([f32; 2], f32)) {
        let LightTileWork {
            receivers,
            vertices,
            edges,
        } = work;
        let mut bad = draw_casters(
            self.level,
            receivers,
            vertices,
            edges,
            (corner, rounding),
            self.points,
        );
        while bad != 0 {
            let lane = bad.trailing_zeros() as usize;
            bad &= bad - 1;
            let prim = vertices.prim[lane];
            if let Some(precise) = PreciseTriangle::new(self.view, self.triangles.corners(prim)) {
                // Twice as far as receivers lie, for they are rounded themselves: by half an ulp of the raster's size, and by
                // QUICK_ERROR.
                let reach = f64::from(4 * LIGHT_TILE);
                let record = precise.record(prim, corner.map(f64::from), reach);
                let area = CasterArea::of_lane(vertices, lane, corner);
                draw_caster(self.level, receivers, &record, &area, self.points);
            }
        }
        vertices.count = 0;
    }

    /// Decides the unsure pairs and puts out what is dark.
    fn settle(&self, receivers: &mut ReceiverTile, drawn: &mut DrawnTile) {
        let unsure = std::mem::take(&mut receivers.unsure);
        for &(entry, lane, prim) in &unsure {
            let held = &receivers.held()[entry as usize];
            if held.open & 1 << lane == 0 {
                continue;
            }
            drawn.exact_pairs += 1;
            let points = held.points(self.points);
            let tile = &self.visibility.tiles()[points.eye_tile as usize];
            let receiver = tile.receiver(self.visibility.view(), self.triangles, points.block, lane);
            let hides = |r| exact::shadows(self.triangles, prim, &r, &self.query.light);
            if receiver.is_some_and(hides) {
                receivers.close(entry, lane);
            }
        }
        receivers.unsure = unsure;
        for held in receivers.held() {
            if !held.tested {
                drawn.untested += u64::from(held.all.count_ones());
            }
            if held.open != held.all {
                let points = held.points(self.points);
                let lit = &self.lit[points.eye_tile as usize][points.block as usize];
                // Pixels are put out one by one, in any order.
                lit.fetch_and(!(held.all & !held.open), Ordering::Relaxed);
            }
        }
    }
}
