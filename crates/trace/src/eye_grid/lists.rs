//! Clusters by tile, nearest first: what a frame builds when it is given [`Clusters`] (HM08 §8, lazy construction).
//!
//! A cluster's box is found anew and projected; nothing is done with its triangles until a tile asks. A cluster that
//! covers many tiles, because it is close or its triangles are large, would be looked at in vain in most of them: its
//! triangles are put into tiles one by one, as far as their edges reach. Items are ordered by a bound on their
//! nearness to 1.5 %, then sorted into tiles.
//!
//! Layout: 28 bytes a cluster, 12 bytes a vertex of the clusters that are listed, 40 bytes a single triangle and 4
//! bytes a reference. Cost: about 5 ns a vertex for boxes and copies, 100 ns a cluster, 30 ns a single triangle and 200 more where
//! lanes know nothing of it.

use glam::Vec3;
use rayon::prelude::*;

use crate::Triangles;
use crate::bins::{Binning, CellGrid};
use crate::clusters::Clusters;
use crate::kernel::batch::Bits;
use crate::kernel::rects::{ClusterRects, find_rects};
use crate::kernel::{LANES, NEARNESS_BAND, SimdLevel};
use crate::precise::PreciseTriangle;
use crate::view::{View, Window};

/// What the raster knows of a cluster.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Screen {
    /// First pixel column and row, last pixel column and row.
    pub(super) pixels: [u32; 4],
    /// Bound on the nearness, widened by the band.
    pub(super) nearest: f32,
    /// Where its points start in those of its chunk, and how many there are.
    points: [u32; 2],
}

/// A triangle that is listed by itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Single {
    pub(super) prim: u32,
    pub(super) corners: [Vec3; 3],
}

/// A single triangle that reaches behind the start of the view.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) prim: u32,
    pub(super) precise: PreciseTriangle,
    /// As of a [`Screen`].
    pub(super) pixels: [u32; 4],
    pub(super) nearest: f32,
}

/// An entry of a tile's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Item {
    Cluster(u32),
    Single(u32),
    Crossing(u32),
}

/// Marks references to single triangles, and to those that cross.
const SINGLE: u32 = 1 << 31;
const CROSSING: u32 = 1 << 30;

/// Lists of all tiles.
#[derive(Clone, Debug, Default)]
pub(super) struct TileLists {
    found: Vec<Found>,
    starts: Vec<u32>,
    references: Vec<u32>,
    singles: Vec<Single>,
    crossings: Vec<Crossing>,
}

/// What one task found.
#[derive(Clone, Debug, Default)]
struct Found {
    screens: Vec<Screen>,
    points: Vec<[f32; LANES]>,
    singles: Vec<Single>,
    crossings: Vec<Crossing>,
    items: Vec<FoundItem>,
    /// Tiles of all items.
    tiles: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct FoundItem {
    nearest: f32,
    /// Numbered within the task.
    reference: u32,
    /// Where its tiles end.
    end: u32,
}

/// Clusters looked at by one task.
const CHUNK: usize = 128;

/// Tiles that a cluster may cover before its triangles are taken one by one.
const MOST_TILES: u32 = 16;

impl TileLists {
    pub(super) fn build(
        (view, level): (&View, SimdLevel),
        triangles: &Triangles,
        clusters: &Clusters,
        grid: &CellGrid,
        binning: Binning,
    ) -> Self {
        let context = Context {
            view,
            level,
            triangles,
            clusters,
            grid,
            binning,
        };
        let found: Vec<Found> = (0..clusters.len().div_ceil(CHUNK))
            .into_par_iter()
            .map_init(ClusterRects::default, |rects, chunk| {
                let mut found = Found::default();
                for index in chunk * CHUNK..((chunk + 1) * CHUNK).min(clusters.len()) {
                    context.find(index, rects, &mut found);
                }
                found
            })
            .collect();
        Self::sorted(found, (grid.cells[0] * grid.cells[1]) as usize)
    }

    /// Counting sorts: of all items by nearness, then of references by tile.
    fn sorted(mut found: Vec<Found>, tile_count: usize) -> Self {
        let key = |nearest: f32| KEYS - 1 - (nearest.to_bits() >> 17) as usize;
        let mut next = vec![0u32; KEYS + 1];
        let mut starts = vec![0u32; tile_count + 1];
        for f in &found {
            for item in &f.items {
                next[key(item.nearest) + 1] += 1;
            }
            for &tile in &f.tiles {
                starts[tile as usize + 1] += 1;
            }
        }
        sum_up(&mut next);
        sum_up(&mut starts);
        let mut order = vec![(0u32, 0u32); next[KEYS] as usize];
        for (chunk, f) in found.iter().enumerate() {
            for (i, item) in f.items.iter().enumerate() {
                let slot = &mut next[key(item.nearest)];
                order[*slot as usize] = (chunk as u32, i as u32);
                *slot += 1;
            }
        }
        let bases: Vec<[u32; 2]> = found
            .iter()
            .scan([0; 2], |base, f| {
                let start = *base;
                *base = [
                    start[0] + f.singles.len() as u32,
                    start[1] + f.crossings.len() as u32,
                ];
                Some(start)
            })
            .collect();
        let mut next = starts.clone();
        let mut references = vec![0u32; starts[tile_count] as usize];
        for (chunk, i) in order {
            let (f, base) = (&found[chunk as usize], bases[chunk as usize]);
            let FoundItem { reference, end, .. } = f.items[i as usize];
            let start = i.checked_sub(1).map_or(0, |i| f.items[i as usize].end);
            let reference = match Item::from(reference) {
                Item::Cluster(index) => index,
                Item::Single(index) => (base[0] + index) | SINGLE,
                Item::Crossing(index) => (base[1] + index) | CROSSING,
            };
            for &tile in &f.tiles[start as usize..end as usize] {
                let slot = &mut next[tile as usize];
                references[*slot as usize] = reference;
                *slot += 1;
            }
        }
        let (mut singles, mut crossings) = (Vec::new(), Vec::new());
        for f in &mut found {
            singles.append(&mut f.singles);
            crossings.append(&mut f.crossings);
            (f.items, f.tiles) = (Vec::new(), Vec::new());
        }
        Self {
            found,
            starts,
            references,
            singles,
            crossings,
        }
    }

    /// The items of a tile, nearest first.
    pub(super) fn tile(&self, tile: usize) -> impl Iterator<Item = Item> {
        let range = self.starts[tile] as usize..self.starts[tile + 1] as usize;
        self.references[range].iter().map(|&r| Item::from(r))
    }

    pub(super) fn screen(&self, cluster: u32) -> &Screen {
        &self.found[cluster as usize / CHUNK].screens[cluster as usize % CHUNK]
    }

    /// Points of a cluster as [`Clusters::place`] puts them.
    pub(super) fn points(&self, cluster: u32) -> &[[f32; LANES]] {
        let [start, count] = self.screen(cluster).points.map(|n| n as usize);
        &self.found[cluster as usize / CHUNK].points[start..start + count]
    }

    pub(super) fn single(&self, index: u32) -> &Single {
        &self.singles[index as usize]
    }

    pub(super) fn crossing(&self, index: u32) -> &Crossing {
        &self.crossings[index as usize]
    }

    pub(super) fn reference_count(&self) -> usize {
        self.references.len()
    }

    pub(super) fn bytes(&self) -> usize {
        let found = |f: &Found| f.screens.capacity() * size_of::<Screen>() + f.points.capacity() * 4 * LANES;
        self.found.iter().map(found).sum::<usize>()
            + self.singles.capacity() * size_of::<Single>()
            + self.crossings.capacity() * size_of::<Crossing>()
            + (self.starts.capacity() + self.references.capacity()) * 4
    }
}

impl From<u32> for Item {
    fn from(reference: u32) -> Self {
        if reference & SINGLE != 0 {
            Self::Single(reference & !SINGLE)
        } else if reference & CROSSING != 0 {
            Self::Crossing(reference & !CROSSING)
        } else {
            Self::Cluster(reference)
        }
    }
}

/// Steps of nearness that are told apart in ordering items.
const KEYS: usize = 1 << 14;

fn sum_up(counts: &mut [u32]) {
    for i in 1..counts.len() {
        counts[i] += counts[i - 1];
    }
}

struct Context<'c> {
    view: &'c View,
    level: SimdLevel,
    triangles: &'c Triangles<'c>,
    clusters: &'c Clusters,
    grid: &'c CellGrid,
    binning: Binning,
}

impl Context<'_> {
    fn find(&self, index: usize, rects: &mut ClusterRects, found: &mut Found) {
        let start = found.points.len();
        let [low, high] = self.clusters.place(index, self.triangles, &mut found.points);
        let window = self.view.window_of_box(low.as_dvec3(), high.as_dvec3());
        let seen = window.and_then(|w| pixels(self.view, &w).map(|p| (p, w.nearest)));
        let Some((pixels, nearest)) = seen else {
            found.points.truncate(start);
            found.screens.push(Screen::default());
            return;
        };
        let [x0, y0, x1, y1] = self.tiles(pixels);
        if (x1 - x0 + 1) * (y1 - y0 + 1) > MOST_TILES {
            let mut points = std::mem::take(&mut found.points);
            self.find_singles(index, &points[start..], rects, found);
            points.truncate(start);
            found.points = points;
            found.screens.push(Screen::default());
            return;
        }
        let nearest = widened(nearest);
        found.screens.push(Screen {
            pixels,
            nearest,
            points: [start as u32, (found.points.len() - start) as u32],
        });
        let columns = self.grid.cells[0];
        let tiles = (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| y * columns + x));
        found.tiles.extend(tiles);
        found.list(nearest, index as u32);
    }

    /// Tile rectangle of a pixel rectangle.
    fn tiles(&self, pixels: [u32; 4]) -> [u32; 4] {
        pixels.map(|p| p / self.grid.side as u32)
    }

    /// Lists the triangles of a cluster, whose vertices lie at `points`, one by one.
    fn find_singles(
        &self,
        index: usize,
        points: &[[f32; LANES]],
        rects: &mut ClusterRects,
        found: &mut Found,
    ) {
        let cluster = self.clusters.cluster(index);
        let batches = find_rects(self.level, self.view, points, cluster.corners, rects);
        let all = cluster.prims.chunks(LANES).zip(cluster.corners.chunks(LANES));
        for (batch, (prims, numbers)) in rects.batches[..batches].iter().zip(all) {
            for lane in Bits(batch.seen) {
                let corners = numbers[lane].map(|number| {
                    let (first, at) = (usize::from(number) / LANES * 3, usize::from(number) % LANES);
                    Vec3::new(points[first][at], points[first + 1][at], points[first + 2][at])
                });
                if self.put(batch.rect(lane), None, corners, found) {
                    found.list_single(prims[lane], corners, batch.nearest[lane]);
                }
            }
            for lane in Bits(batch.unknown) {
                self.find_triangle(prims[lane], found);
            }
        }
    }

    /// Lists a triangle of which lanes know nothing.
    fn find_triangle(&self, prim: u32, found: &mut Found) {
        let corners = self.triangles.corners(prim);
        if !corners.iter().all(|c| c.is_finite()) {
            return;
        }
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let nearest = self.view.nearest_in_box(a.min(b).min(c), a.max(b).max(c));
        let mut precise = None;
        let window = self.view.window_of([a, b, c].into_iter()).or_else(|| {
            precise = PreciseTriangle::new(self.view, corners);
            let [min, max] = precise.as_ref()?.bounds(self.view)?;
            Some(Window { min, max, nearest })
        });
        let Some(rect) = window.and_then(|w| pixels(self.view, &w)) else {
            return;
        };
        if !self.put(rect, precise, corners, found) {
            return;
        }
        let nearest = widened(nearest);
        if let Some(precise) = precise {
            found.list(nearest, found.crossings.len() as u32 | CROSSING);
            found.crossings.push(Crossing {
                prim,
                precise,
                pixels: rect,
                nearest,
            });
        } else {
            found.list_single(prim, corners, nearest);
        }
    }

    /// Puts a triangle with this rectangle of pixels into tiles; of many into those that its edges may reach. Whether there
    /// are any.
    fn put(
        &self,
        rect: [u32; 4],
        precise: Option<PreciseTriangle>,
        corners: [Vec3; 3],
        found: &mut Found,
    ) -> bool {
        let [x0, y0, x1, y1] = self.tiles(rect);
        let columns = self.grid.cells[0];
        let before = found.tiles.len();
        let small = (x1 - x0 + 1) * (y1 - y0 + 1) <= MOST_TILES;
        if small || self.binning == Binning::Rectangle {
            for y in y0..=y1 {
                found.tiles.extend((x0..=x1).map(|x| y * columns + x));
            }
        } else if let Some(precise) = precise.or_else(|| PreciseTriangle::new(self.view, corners)) {
            let side = f64::from(self.grid.side);
            for y in y0..=y1 {
                let top = f64::from(y) * side;
                let Some([from, to]) = precise.row_span(top - SLACK, top + side + SLACK) else {
                    continue;
                };
                let (from, to) = ((from - SLACK) / side, (to + SLACK) / side);
                let column = |x: f64| x.clamp(f64::from(x0), f64::from(x1)) as u32;
                if to >= f64::from(x0) && from <= f64::from(x1 + 1) {
                    let row = y * columns;
                    found.tiles.extend((column(from)..=column(to)).map(|x| row + x));
                }
            }
        }
        found.tiles.len() > before
    }
}

impl Found {
    /// Notes a single triangle whose tiles are those found since the last.
    fn list_single(&mut self, prim: u32, corners: [Vec3; 3], nearest: f32) {
        self.list(nearest, self.singles.len() as u32 | SINGLE);
        self.singles.push(Single { prim, corners });
    }

    /// Notes an item whose tiles are those found since the last.
    fn list(&mut self, nearest: f32, reference: u32) {
        self.items.push(FoundItem {
            nearest,
            reference,
            end: self.tiles.len() as u32,
        });
    }
}

/// How far from a triangle's or a box's rectangle its pixels may lie, for the rounding of f64.
const SLACK: f64 = 1.0 / 64.0;

/// The pixels whose centres lie in a window, if any.
fn pixels(view: &View, window: &Window) -> Option<[u32; 4]> {
    let size = [view.width, view.height];
    let mut pixels = [0; 4];
    for axis in 0..2 {
        let first = (window.min[axis] - 0.5 - SLACK).max(0.0).ceil();
        let last = (window.max[axis] - 0.5 + SLACK)
            .min(f64::from(size[axis]) - 1.0)
            .floor();
        // What is no number is refused as well.
        if first > last || first.is_nan() || last.is_nan() {
            return None;
        }
        (pixels[axis], pixels[axis + 2]) = (first as u32, last as u32);
    }
    Some(pixels)
}

/// A bound as the kernels compare it.
fn widened(nearest: f64) -> f32 {
    (nearest.max(0.0) * f64::from(1.0 + NEARNESS_BAND)) as f32
}
