//! The pixels of each of the eye's tiles as receivers in a light's raster.

use rayon::prelude::*;

use super::LightQuery;
use crate::kernel::pixels::{
    Asking, BlockPoints, Entry, LightFaces, PixelPlane, Span, TileRays, find_spans, hit_parameters,
    project_receivers,
};
use crate::kernel::{LANES, SimdLevel};
use crate::view::Arrangement;
use crate::visibility::{Visibility, VisibleTile};
use crate::{Triangles, exact};

/// The receivers of one tile of the eye's.
#[derive(Clone, Debug, Default)]
pub(super) struct Gathered {
    pub(super) points: Vec<BlockPoints>,
    pub(super) entries: Vec<Entry>,
    /// Per block, the pixels that are lit without a caster being looked at.
    pub(super) lit: Vec<u16>,
    pub(super) receivers: u64,
    pub(super) undisturbed: u64,
}

impl Gathered {
    pub(super) fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<BlockPoints>()
            + self.entries.capacity() * size_of::<Entry>()
            + self.lit.capacity() * 2
    }
}

/// Working memory of one thread.
#[derive(Default)]
struct GatherWork {
    rays: TileRays,
    spans: Vec<Span>,
    planes: Vec<PixelPlane>,
    table: PrimTable,
    t: Vec<[f64; LANES]>,
    asked: Vec<u16>,
    unsound: Vec<(u32, u32)>,
}

/// Finds the receivers of all tiles.
pub(super) fn gather(
    visibility: &Visibility,
    triangles: &Triangles,
    query: &LightQuery,
    faces: &LightFaces,
    level: SimdLevel,
) -> Vec<Gathered> {
    visibility
        .tiles()
        .par_iter()
        .enumerate()
        .map_init(GatherWork::default, |work, (index, tile)| {
            work.find_spans(visibility, triangles, query, tile, level);
            work.find_points(visibility, triangles, tile, level);
            let mut gathered = Gathered {
                receivers: work.asked.iter().map(|a| u64::from(a.count_ones())).sum(),
                lit: work.asked.clone(),
                ..Gathered::default()
            };
            let asking = Asking {
                eye_tile: index as u32,
                rays: &work.rays,
                t: &work.t,
                pixels: &work.asked,
            };
            let Gathered { points, entries, .. } = &mut gathered;
            project_receivers(level, &asking, faces, points, entries);
            for entry in &gathered.entries {
                let block = gathered.points[entry.points as usize].block;
                gathered.lit[block as usize] &= !entry.lanes;
            }
            gathered.undisturbed = gathered.lit.iter().map(|l| u64::from(l.count_ones())).sum();
            gathered
        })
        .collect()
}

impl GatherWork {
    /// The pixels that see the same triangle, as far as it turns the side they see to the light.
    fn find_spans(
        &mut self,
        visibility: &Visibility,
        triangles: &Triangles,
        query: &LightQuery,
        tile: &VisibleTile,
        level: SimdLevel,
    ) {
        let Self {
            spans,
            planes,
            table,
            asked,
            ..
        } = self;
        planes.clear();
        table.clear();
        let view = visibility.view();
        let in_lanes = matches!(view.arrangement, Arrangement::Perspective);
        let mut plane_of = |prim: u32| {
            table.entry(prim, || {
                query.faces(triangles, prim).then(|| {
                    let plane = PixelPlane::new(view.center.as_dvec3(), triangles.corners(prim));
                    planes.push(if in_lanes { plane } else { plane.unsound() });
                    planes.len() as u32 - 1
                })
            })
        };
        find_spans(level, &tile.prims, &mut plane_of, spans, asked);
    }

    /// Hit parameters of all pixels that ask.
    fn find_points(
        &mut self,
        visibility: &Visibility,
        triangles: &Triangles,
        tile: &VisibleTile,
        level: SimdLevel,
    ) {
        let view = visibility.view();
        let blocks = [tile.stride, tile.prims.len() as u32 / tile.stride];
        self.rays.set(view, [tile.tile.x, tile.tile.y], blocks);
        self.t.clear();
        self.t.resize(tile.prims.len(), [0.0; LANES]);
        self.unsound.clear();
        hit_parameters(
            level,
            &self.rays,
            &self.spans,
            &self.planes,
            &mut self.t,
            &mut self.unsound,
        );
        for &(block, mut lanes) in &self.unsound {
            while lanes != 0 {
                let lane = lanes.trailing_zeros();
                lanes &= lanes - 1;
                let ray = tile.ray(view, block, lane);
                let prim = tile.prims[block as usize][lane as usize];
                match exact::attributes(ray.origin, ray.dir, triangles.corners(prim)) {
                    Some(hit) => self.t[block as usize][lane as usize] = hit.t,
                    None => self.asked[block as usize] &= !(1 << lane),
                }
            }
        }
    }
}

/// What is known of the triangles seen in a tile: open addressing, emptied by counting up.
#[derive(Default)]
struct PrimTable {
    slots: Vec<(u32, u32, Option<u32>)>,
    round: u32,
    used: usize,
}

impl PrimTable {
    fn clear(&mut self) {
        self.round += 1;
        self.used = 0;
        if self.slots.is_empty() {
            self.slots.resize(1024, (0, 0, None));
        }
    }

    #[inline]
    fn entry(&mut self, prim: u32, make: impl FnOnce() -> Option<u32>) -> Option<u32> {
        if self.used * 2 > self.slots.len() {
            self.grow();
        }
        let slot = self.slot(prim);
        let (round, _, value) = self.slots[slot];
        if round == self.round {
            return value;
        }
        let value = make();
        self.slots[slot] = (self.round, prim, value);
        self.used += 1;
        value
    }

    /// The slot of a triangle, or the free one where it belongs.
    #[inline]
    fn slot(&self, prim: u32) -> usize {
        let mask = self.slots.len() - 1;
        let mut slot = prim.wrapping_mul(0x9e37_79b1) as usize & mask;
        while self.slots[slot].0 == self.round && self.slots[slot].1 != prim {
            slot = (slot + 1) & mask;
        }
        slot
    }

    #[cold]
    fn grow(&mut self) {
        let larger = vec![(0, 0, None); self.slots.len() * 2];
        for (round, prim, value) in std::mem::replace(&mut self.slots, larger) {
            if round == self.round {
                let slot = self.slot(prim);
                self.slots[slot] = (round, prim, value);
            }
        }
    }
}
