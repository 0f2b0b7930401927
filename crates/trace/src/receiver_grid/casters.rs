//! Casters by light tile: what of the geometry may come between a light and the receivers of a face.
//!
//! Whole clusters are left out that lie beside the face, in light tiles where nobody asks or behind the farthest who
//! do; then triangles likewise. A triangle over more than 2 x 2 light tiles is put only into those that its edges may
//! reach. Chunks of clusters are done by themselves, each with a counting sort of its own.
//!
//! Layout: 12 bytes a vertex and cluster, for a frame; of one face 40 bytes a triangle that is left and 4 bytes a
//! reference. Cost: some 5 ns a vertex for boxes and copies, 30 ns a cluster and face, and of clusters that are left
//! 10 ns a triangle and 10 more if it is left itself.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::FaceScene;
use crate::clusters::Clusters;
use crate::kernel::casters::{CasterBatch, CasterLanes, LightRaster, sift_casters};
use crate::kernel::pixels::LIGHT_TILE;
use crate::kernel::{LANES, NEARNESS_BAND};
use crate::light_grid::takes_part;
use crate::precise::PreciseTriangle;
use crate::view::Arrangement;
use crate::{Casts, Triangles};

/// Clusters done by one task.
const CHUNK: usize = 128;

/// All clusters where they are now.
pub(super) struct PlacedClusters<'c> {
    clusters: &'c Clusters,
    chunks: &'c [PlacedChunk],
}

/// Some of them.
#[derive(Clone, Debug, Default)]
pub(super) struct PlacedChunk {
    /// See [`Clusters::place`].
    points: Vec<[f32; LANES]>,
    boxes: Vec<[Vec3; 2]>,
    /// Where the points of each cluster end.
    ends: Vec<u32>,
}

impl<'c> PlacedClusters<'c> {
    /// Places them in `chunks`, whatever these held.
    pub(super) fn new(
        clusters: &'c Clusters,
        triangles: &Triangles,
        chunks: &'c mut Vec<PlacedChunk>,
    ) -> Self {
        let count = clusters.len_with_copies();
        chunks.resize_with(count.div_ceil(CHUNK), PlacedChunk::default);
        chunks.par_iter_mut().enumerate().for_each(|(chunk, placed)| {
            placed.points.clear();
            placed.boxes.clear();
            placed.ends.clear();
            for index in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
                let place = clusters.place(index, triangles, &mut placed.points);
                placed.boxes.push(place);
                placed.ends.push(placed.points.len() as u32);
            }
        });
        Self { clusters, chunks }
    }

    /// Box around everything, if all of it is finite.
    pub(super) fn bounds(&self) -> Option<[Vec3; 2]> {
        let boxes = || self.chunks.iter().flat_map(|chunk| &chunk.boxes);
        let low = boxes().fold(Vec3::INFINITY, |low, b| low.min(b[0]));
        let high = boxes().fold(Vec3::NEG_INFINITY, |high, b| high.max(b[1]));
        (low.is_finite() && high.is_finite()).then_some([low, high])
    }

    pub(super) fn bytes(&self) -> usize {
        let bytes = |c: &PlacedChunk| c.points.capacity() * 4 * LANES + c.boxes.capacity() * 28;
        self.chunks.iter().map(bytes).sum()
    }
}

/// A triangle in the raster of a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Caster {
    pub(super) x: [f32; 3],
    pub(super) y: [f32; 3],
    pub(super) nearness: [f32; 3],
    pub(super) prim: u32,
}

/// The casters of a face.
pub(super) struct Casters<'c> {
    chunks: &'c [CasterChunk],
}

/// Those of some clusters.
#[derive(Clone, Debug, Default)]
pub(super) struct CasterChunk {
    casters: Vec<Caster>,
    /// Where each light tile's references start, and the end.
    starts: Vec<u32>,
    references: Vec<u32>,
    /// Light tile and caster of each, before they are sorted.
    pairs: Vec<(u32, u32)>,
}

impl Casters<'_> {
    /// The casters of a light tile of the face.
    pub(super) fn of_tile(&self, tile: usize) -> impl Iterator<Item = &Caster> {
        self.chunks.iter().flat_map(move |chunk| {
            let range = chunk.starts[tile] as usize..chunk.starts[tile + 1] as usize;
            chunk.references[range]
                .iter()
                .map(|&r| &chunk.casters[r as usize])
        })
    }

    pub(super) fn bytes(&self) -> usize {
        let bytes = |c: &CasterChunk| {
            c.casters.capacity() * size_of::<Caster>()
                + (c.starts.capacity() + c.references.capacity() + 2 * c.pairs.capacity()) * 4
        };
        self.chunks.iter().map(bytes).sum()
    }
}

impl CasterChunk {
    /// A counting sort of the pairs by light tile.
    fn sort(&mut self, tiles: usize) {
        self.starts.clear();
        self.starts.resize(tiles + 2, 0);
        for &(tile, _) in &self.pairs {
            self.starts[tile as usize + 2] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        self.references.clear();
        self.references.resize(self.pairs.len(), 0);
        // Each start becomes the next one's while its references are put down.
        for &(tile, caster) in &self.pairs {
            let slot = &mut self.starts[tile as usize + 1];
            self.references[*slot as usize] = caster;
            *slot += 1;
        }
    }
}

/// What a task finds for a chunk, before it is sorted.
struct Finder<'f> {
    scene: &'f FaceScene<'f>,
    /// Per light tile, the nearness of the farthest receiver.
    farthest: &'f [f32],
    tiles: u32,
    raster: LightRaster<'f>,
    found: &'f mut CasterChunk,
}

impl FaceScene<'_> {
    /// Finds the casters of a face; they are kept in `chunks`, whatever these held.
    pub(super) fn find_casters<'c>(&self, farthest: &[f32], chunks: &'c mut Vec<CasterChunk>) -> Casters<'c> {
        let placed = self.placed;
        let tiles = self.view.width / LIGHT_TILE;
        chunks.resize_with(placed.chunks.len(), CasterChunk::default);
        let raster = LightRaster::new(self.view, tiles);
        let both = placed.chunks.par_iter().zip(&mut *chunks).enumerate();
        both.for_each_init(CasterLanes::default, |lanes, (i, (chunk, found))| {
            found.casters.clear();
            found.pairs.clear();
            let mut finder = Finder {
                scene: self,
                farthest,
                tiles,
                raster,
                found,
            };
            let mut start = 0;
            for (k, (place, &end)) in chunk.boxes.iter().zip(&chunk.ends).enumerate() {
                let points = &chunk.points[start as usize..end as usize];
                start = end;
                if finder.box_matters(*place) {
                    finder.take_cluster(i * CHUNK + k, points, lanes);
                }
            }
            finder.found.sort(farthest.len());
        });
        Casters { chunks }
    }
}

impl Finder<'_> {
    /// Whether something in a box may come before a receiver.
    fn box_matters(&self, [low, high]: [Vec3; 2]) -> bool {
        let view = self.scene.view;
        let (low, high) = (low.as_dvec3(), high.as_dvec3());
        if matches!(view.arrangement, Arrangement::Perspective) && beside(self.scene, low, high) {
            return false;
        }
        let Some(window) = view.window_of_box(low, high) else {
            return false;
        };
        let size = f64::from(self.tiles * LIGHT_TILE);
        let mut tiles = [[0; 2]; 2];
        for (tiles, (min, max)) in tiles.iter_mut().zip(window.min.into_iter().zip(window.max)) {
            // Written so that what is no number is kept.
            if min - SLACK >= size || max + SLACK < 0.0 {
                return false;
            }
            *tiles = [self.tile_at(min - SLACK), self.tile_at(max + SLACK)];
        }
        let nearest = (window.nearest * f64::from(1.0 + 4.0 * NEARNESS_BAND)) as f32;
        let [[x0, x1], [y0, y1]] = tiles;
        self.any_tile([x0, y0, x1, y1], nearest)
    }

    /// Column or row of light tiles of a coordinate.
    fn tile_at(&self, v: f64) -> u32 {
        ((v / f64::from(LIGHT_TILE)).max(0.0) as u32).min(self.tiles - 1)
    }

    /// Whether somebody in these light tiles is as far as that.
    #[inline]
    fn any_tile(&self, [x0, y0, x1, y1]: [u32; 4], nearest: f32) -> bool {
        (y0..=y1).any(|y| {
            let row = (y * self.tiles) as usize;
            let farthest = &self.farthest[row + x0 as usize..=row + x1 as usize];
            farthest.iter().any(|&f| asked_before(nearest, f))
        })
    }

    fn take_cluster(&mut self, index: usize, points: &[[f32; LANES]], lanes: &mut CasterLanes) {
        let cluster = self.scene.placed.clusters.cluster(index);
        let batches = sift_casters(self.scene.level, &self.raster, points, cluster.corners, lanes);
        for (batch, prims) in lanes.batches[..batches].iter().zip(cluster.prims.chunks(LANES)) {
            for (lane, &prim) in prims.iter().enumerate() {
                if batch.ahead >> lane & 1 != 0 {
                    self.take_ahead(batch, lane, prim);
                } else if batch.crossing >> lane & 1 != 0 {
                    self.take_crossing(batch, lane, prim);
                }
            }
        }
    }

    /// Takes a triangle that lies in front.
    #[inline]
    fn take_ahead(&mut self, batch: &CasterBatch, lane: usize, prim: u32) {
        let tile = |i: usize| batch.tiles[i][lane] as u32;
        let rect = [tile(0), tile(1), tile(2), tile(3)];
        let nearest = batch.nearest[lane];
        if !self.any_tile(rect, nearest) || !self.casts(prim, batch.front(lane)) {
            return;
        }
        let [x0, y0, x1, y1] = rect;
        if x1 > x0 + 1 || y1 > y0 + 1 {
            let precise = PreciseTriangle::new(self.scene.view, self.scene.triangles.corners(prim));
            if let Some(precise) = precise {
                self.take_rows(&precise, rect, nearest);
            }
        } else {
            for y in y0..=y1 {
                for x in x0..=x1 {
                    self.pair(y * self.tiles + x, nearest);
                }
            }
        }
        self.keep(batch, lane, prim);
    }

    /// Takes a triangle of which only f64 can tell where it lies.
    #[cold]
    fn take_crossing(&mut self, batch: &CasterBatch, lane: usize, prim: u32) {
        let view = self.scene.view;
        let Some(precise) = PreciseTriangle::new(view, self.scene.triangles.corners(prim)) else {
            return;
        };
        let Some([min, max]) = precise.bounds(view) else {
            return;
        };
        if !self.casts(prim, None) {
            return;
        }
        let rect = [
            self.tile_at(min[0] - SLACK),
            self.tile_at(min[1] - SLACK),
            self.tile_at(max[0] + SLACK),
            self.tile_at(max[1] + SLACK),
        ];
        self.take_rows(&precise, rect, f32::INFINITY);
        self.keep(batch, lane, prim);
    }

    /// Puts a triangle into those light tiles that its edges may reach.
    fn take_rows(&mut self, precise: &PreciseTriangle, [x0, y0, x1, y1]: [u32; 4], nearest: f32) {
        let side = f64::from(LIGHT_TILE);
        for y in y0..=y1 {
            let top = f64::from(y) * side;
            let Some([from, to]) = precise.row_span(top - SLACK, top + side + SLACK) else {
                continue;
            };
            let (from, to) = ((from - SLACK) / side, (to + SLACK) / side);
            let column = |x: f64| x.clamp(f64::from(x0), f64::from(x1)) as u32;
            if to >= f64::from(x0) && from <= f64::from(x1 + 1) {
                for x in column(from)..=column(to) {
                    self.pair(y * self.tiles + x, nearest);
                }
            }
        }
    }

    /// Whether a triangle casts, of which the light sees the front, or not, if that is known.
    #[inline]
    fn casts(&self, prim: u32, front: Option<bool>) -> bool {
        let FaceScene { query, triangles, .. } = self.scene;
        match ((query.rule)(prim), front) {
            (Casts::Back, Some(front)) => !front,
            (casts, _) => takes_part(&query.light, triangles, casts, prim),
        }
    }

    /// Refers to the next caster from a light tile.
    #[inline]
    fn pair(&mut self, tile: u32, nearest: f32) {
        if asked_before(nearest, self.farthest[tile as usize]) {
            self.found.pairs.push((tile, self.found.casters.len() as u32));
        }
    }

    /// Notes the caster whose pairs were found.
    #[inline]
    fn keep(&mut self, batch: &CasterBatch, lane: usize, prim: u32) {
        let next = self.found.casters.len() as u32;
        if self.found.pairs.last().is_none_or(|p| p.1 != next) {
            return;
        }
        let of = |v: &[[f32; LANES]; 3]| [v[0][lane], v[1][lane], v[2][lane]];
        let corners = &batch.corners;
        self.found.casters.push(Caster {
            x: of(&corners.x),
            y: of(&corners.y),
            nearness: of(&corners.nearness),
            prim,
        });
    }
}

/// Whether there is somebody whose farthest receiver is not before that nearness.
#[inline(always)]
fn asked_before(nearest: f32, farthest: f32) -> bool {
    farthest < f32::INFINITY && nearest >= farthest
}

/// How far outside of its rectangle a caster may be met, see [`crate::bins`].
const SLACK: f64 = 1.0 / 64.0;

/// Whether a box certainly lies outside of the pyramid that a face shows: the cheap test that most boxes around a light
/// fail for most faces.
fn beside(scene: &FaceScene, low: DVec3, high: DVec3) -> bool {
    let view = scene.view;
    let center = view.center.as_dvec3();
    let (middle, half) = ((low + high) * 0.5 - center, (high - low) * 0.5);
    let rounding = (middle.abs() + half + center.abs()).max_element() * 2f64.powi(-45);
    // The plane through the light and one end of the raster: `normal . v > 0` outside.
    let outside = |normal: DVec3| {
        let reach = half.dot(normal.abs()) + rounding * normal.abs().element_sum();
        middle.dot(normal) > reach
    };
    [
        (view.right, view.middle[0], view.width, view.scale_x),
        (-view.up, view.middle[1], view.height, view.scale_y),
    ]
    .into_iter()
    .any(|(axis, middle, size, scale)| {
        let before = (-SLACK * 4.0 - middle) / scale;
        let beyond = (f64::from(size) + SLACK * 4.0 - middle) / scale;
        outside(view.forward * before - axis) || outside(axis - view.forward * beyond)
    })
}
