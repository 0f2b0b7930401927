//! Hard shadows of one light on everything the eye sees: a grid of receivers, over which casters are drawn.
//!
//! HM08 §5.2 sorts casters into a light's grid and lets each shadow ray look up its cell. Here the roles are turned round, as in an
//! irregular Z-buffer (Aila and Laine 2004; Johnson et al. 2005): what the eye sees is known ([`Visibility`]), so
//! its points are sorted into the light's raster, and triangles are drawn over them in object order, as the
//! eye's are over pixels. Nothing is kept of a caster, and a triangle costs little where nobody asks:
//! beside all receivers, or behind the farthest of them.
//!
//! Steps: surface points of each of the eye's tiles in lanes, into light tiles ([`gather`]); vertices projected and triangles sorted
//! into the light tiles that have receivers ([`crate::bins`]); each light tile by itself ([`light_tile`]). All are
//! parallel, and their results do not depend on the order in which parts are done.
//!
//! A pixel whose triangle turns another side to the light than to the eye gets no light, without a ray.
//!
//! Layout, while one light is done: 12 to 24 bytes a pixel that asks, 16 bytes a block of them and light tile, 16 bytes a vertex and 4 bytes
//! a reference of one face. What is left is a bit a pixel. Limits: perspective eyes in lanes, others pixel by
//! pixel; where coordinates pass 1e30 every caster is tested for every pixel.

mod cube;
mod gather;
mod light_tile;

use rayon::prelude::*;

use crate::bins::{Binning, Bins, CellGrid};
use crate::kernel::pixels::{Entry, LIGHT_TILE};
use crate::kernel::project::RasterVertex;
use crate::kernel::{NEARNESS_BAND, SimdLevel};
use crate::light_grid::takes_part;
use crate::view::View;
use crate::visibility::place;
use crate::{CastRule, Cone, Light, Triangles, Visibility, exact};

use cube::FaceParts;
use gather::Gathered;
use light_tile::LightTileWork;

/// Which pixels' surfaces a light reaches.
#[derive(Clone, Debug)]
pub struct LitPixels {
    tiles: Vec<LitTile>,
    /// What it took.
    pub counts: LitCounts,
}

#[derive(Clone, Debug)]
struct LitTile {
    stride: u32,
    /// A bit for each pixel of each block.
    lit: Vec<u16>,
}

/// What it took to find the lit pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LitCounts {
    /// Pixels whose triangle turns the side that the eye sees towards the light.
    pub receivers: u64,
    /// Those that no caster was held against.
    pub untested: u64,
    /// Pairs of pixel and triangle decided exactly.
    pub exact_pairs: u64,
    /// Casters drawn, once for each light tile.
    pub references: u64,
    /// Light tiles with receivers.
    pub light_tiles: u64,
    /// Bytes held at most.
    pub bytes: usize,
}

/// What is asked of a light.
#[derive(Clone, Copy)]
pub struct LightQuery<'q> {
    /// The light.
    pub light: Light,
    /// If there is one, only pixels within this cone are answered; one face then serves a light anywhere.
    pub cone: Option<Cone>,
    /// Where the eye rays come from.
    pub eye: Light,
    /// What each triangle casts.
    pub rule: CastRule<'q>,
}

/// Pixels of a face for each light tile: enough that cells of the largest size are full, for half of a face is empty
/// as a rule and pixels that turn away do not count. Tests have small pictures and want many tiles all the same.
const PIXELS_A_TILE: u64 = if cfg!(test) { 150 } else { 6000 };

/// Largest number of light tiles of a face in each direction.
const MAX_TILES: u32 = 32;

impl LitPixels {
    /// Finds the pixels that a light reaches: those whose triangle turns the same side to the light as to the eye, and
    /// between which and the light there is no caster. Uses all threads of the current rayon pool.
    pub fn find(
        visibility: &Visibility,
        triangles: &Triangles,
        query: &LightQuery,
        level: SimdLevel,
    ) -> Self {
        let Some(mut faces) = crate::light_views::views(&query.light, triangles, query.cone) else {
            return Self::one_by_one(visibility, triangles, query);
        };
        let pixels = visibility.seen() / (faces.views.len() as u64).max(1);
        let tiles = ((pixels / PIXELS_A_TILE) as f64).sqrt().ceil() as u32;
        let tiles = tiles.clamp(1, MAX_TILES);
        for view in &mut faces.views {
            let size = [f64::from(view.width), f64::from(view.height)];
            *view = view.window([0.0; 2], size, [tiles * LIGHT_TILE; 2]);
        }
        let gathered = gather::gather(visibility, triangles, query, &faces, level);
        let mut lit = Self {
            counts: LitCounts {
                receivers: gathered.iter().map(|g| g.receivers).sum(),
                untested: gathered.iter().map(|g| g.undisturbed).sum(),
                ..LitCounts::default()
            },
            tiles: visibility
                .tiles()
                .iter()
                .zip(&gathered)
                .map(|(tile, gathered)| LitTile {
                    stride: tile.stride,
                    lit: gathered.lit.clone(),
                })
                .collect(),
        };
        let sorted = SortedEntries::of(&gathered, faces.views.len() * (tiles * tiles) as usize);
        lit.counts.bytes = gathered.iter().map(Gathered::bytes).sum::<usize>() + sorted.bytes();
        let parts = FaceParts::of(triangles, &faces, level);
        let (mut vertices, mut of_a_face) = (Vec::new(), 0);
        for face in 0..faces.views.len() {
            let scene = FaceScene {
                visibility,
                triangles,
                query,
                gathered: &gathered,
                view: &faces.views[face],
                face: face as u32,
                parts: &parts,
                level,
            };
            of_a_face = scene.draw(&sorted, &mut vertices, &mut lit).max(of_a_face);
        }
        lit.counts.bytes += of_a_face;
        lit
    }

    /// Whether the light reaches pixel (x, y) of a tile of the eye's grid, counted from the tile's corner.
    #[inline]
    pub fn is_lit(&self, tile: u32, x: u32, y: u32) -> bool {
        let tile = &self.tiles[tile as usize];
        let (block, lane) = place(tile.stride, x, y);
        tile.lit[block] & 1 << lane != 0
    }

    /// Of a tile, a bit for each pixel of each block of 4 x 4, blocks in rows; pixel (x, y) of a block is bit
    /// `y * 4 + x`.
    pub fn blocks(&self, tile: u32) -> &[u16] {
        &self.tiles[tile as usize].lit
    }

    /// Tests every caster for every pixel.
    fn one_by_one(visibility: &Visibility, triangles: &Triangles, query: &LightQuery) -> Self {
        let casts = |prim: &u32| {
            triangles.corners(*prim).iter().all(|c| c.is_finite())
                && takes_part(&query.light, triangles, (query.rule)(*prim), *prim)
        };
        let casters: Vec<u32> = (0..triangles.len() as u32).filter(casts).collect();
        let tiles: Vec<(LitTile, u64)> = visibility
            .tiles()
            .par_iter()
            .map(|tile| {
                let mut asked = 0;
                let lit = (0..tile.prims.len() as u32).map(|block| {
                    let mut lit = 0;
                    for lane in 0..16 {
                        let receiver = tile.receiver(visibility.view(), triangles, block, lane);
                        let Some(receiver) = receiver.filter(|r| query.faces(triangles, r.prim)) else {
                            continue;
                        };
                        asked += 1;
                        let hides = |&prim: &u32| exact::shadows(triangles, prim, &receiver, &query.light);
                        lit |= u16::from(!casters.iter().any(hides)) << lane;
                    }
                    lit
                });
                let lit = lit.collect();
                (
                    LitTile {
                        stride: tile.stride,
                        lit,
                    },
                    asked,
                )
            })
            .collect();
        let receivers = tiles.iter().map(|t| t.1).sum();
        Self {
            tiles: tiles.into_iter().map(|t| t.0).collect(),
            counts: LitCounts {
                receivers,
                exact_pairs: receivers * casters.len() as u64,
                ..LitCounts::default()
            },
        }
    }
}

impl LightQuery<'_> {
    /// Whether the light is on the side of a triangle that the eye sees.
    fn faces(&self, triangles: &Triangles, prim: u32) -> bool {
        let corners = triangles.corners(prim);
        let (lit, seen) = (exact::side(corners, &self.light), exact::side(corners, &self.eye));
        (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0)
    }
}

/// All entries, by light tile.
struct SortedEntries {
    starts: Vec<u32>,
    entries: Vec<Entry>,
    /// Per light tile, the nearness of its farthest receiver.
    farthest: Vec<f32>,
}

impl SortedEntries {
    fn of(gathered: &[Gathered], tiles: usize) -> Self {
        let all = || gathered.iter().flat_map(|g| &g.entries);
        let mut starts = vec![0u32; tiles + 1];
        let mut farthest = vec![f32::INFINITY; tiles];
        for entry in all() {
            let tile = entry.light_tile as usize;
            starts[tile + 1] += 1;
            farthest[tile] = farthest[tile].min(entry.farthest);
        }
        for i in 0..tiles {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let blank = Entry {
            light_tile: 0,
            eye_tile: 0,
            points: 0,
            lanes: 0,
            farthest: 0.0,
        };
        let mut entries = vec![blank; starts[tiles] as usize];
        for entry in all() {
            let slot = &mut next[entry.light_tile as usize];
            entries[*slot as usize] = *entry;
            *slot += 1;
        }
        Self {
            starts,
            entries,
            farthest,
        }
    }

    fn of_tile(&self, tile: usize) -> &[Entry] {
        &self.entries[self.starts[tile] as usize..self.starts[tile + 1] as usize]
    }

    fn bytes(&self) -> usize {
        self.entries.capacity() * size_of::<Entry>() + self.starts.capacity() * 8
    }
}

/// One face of a light and all there is to draw in it.
struct FaceScene<'f> {
    visibility: &'f Visibility,
    triangles: &'f Triangles<'f>,
    query: &'f LightQuery<'f>,
    gathered: &'f [Gathered],
    view: &'f View,
    face: u32,
    parts: &'f FaceParts,
    level: SimdLevel,
}

impl FaceScene<'_> {
    /// Draws all casters of a face and enters what is left lit; returns the bytes held at most.
    fn draw(&self, sorted: &SortedEntries, vertices: &mut Vec<RasterVertex>, lit: &mut LitPixels) -> usize {
        let tiles = self.view.width / LIGHT_TILE;
        let first = (self.face * tiles * tiles) as usize;
        let farthest = &sorted.farthest[first..first + (tiles * tiles) as usize];
        let asked: Vec<usize> = (0..farthest.len())
            .filter(|&t| farthest[t] < f32::INFINITY)
            .collect();
        if asked.is_empty() {
            return 0;
        }
        self.parts
            .project(self.face, self.view, self.triangles, self.level, vertices);
        let vertices: &[RasterVertex] = vertices;
        let (bins, rounding) = (self.bin(vertices, farthest), self.view.rounding() as f32);
        let drawn: Vec<_> = asked
            .par_iter()
            .map_init(LightTileWork::default, |work, &tile| {
                let corner = [tile as u32 % tiles, tile as u32 / tiles].map(|i| (i * LIGHT_TILE) as f32);
                let entries = sorted.of_tile(first + tile);
                self.draw_tile(work, entries, bins.cell(tile), vertices, (corner, rounding))
            })
            .collect();
        for (&tile, drawn) in asked.iter().zip(&drawn) {
            for (entry, left) in sorted.of_tile(first + tile).iter().zip(&drawn.lit) {
                let points = self.gathered[entry.eye_tile as usize].points[entry.points as usize];
                lit.tiles[entry.eye_tile as usize].lit[points.block as usize] |= left;
            }
            lit.counts.untested += drawn.untested;
            lit.counts.exact_pairs += drawn.exact_pairs;
            lit.counts.references += drawn.references;
            lit.counts.light_tiles += 1;
        }
        bins.bytes() + size_of_val(vertices)
    }

    /// Sorts the triangles that may matter into light tiles.
    fn bin(&self, vertices: &[RasterVertex], farthest: &[f32]) -> Bins {
        let tiles = self.view.width / LIGHT_TILE;
        let grid = CellGrid {
            cells: [tiles; 2],
            side: LIGHT_TILE as f32,
            size: [self.view.width as f32; 2],
            pixel_centres: false,
        };
        let keep = |prim: u32| {
            if !self.parts.has(self.face, prim) {
                return false;
            }
            let corners = self.triangles.indices[prim as usize].map(|i| vertices[i as usize]);
            may_matter(&corners, farthest, tiles)
                && takes_part(&self.query.light, self.triangles, (self.query.rule)(prim), prim)
        };
        Bins::build(self.view, self.triangles, vertices, &grid, Binning::Overlap, keep)
    }
}

/// Whether a triangle may come before a receiver of the light tiles that its rectangle touches.
#[inline]
fn may_matter(corners: &[RasterVertex; 3], farthest: &[f32], tiles: u32) -> bool {
    let [a, b, c] = corners;
    if !(a.nearness > 0.0 && b.nearness > 0.0 && c.nearness > 0.0) {
        // Behind the light, if all are. Otherwise nothing simple can be said.
        return !(a.nearness < 0.0 && b.nearness < 0.0 && c.nearness < 0.0);
    }
    let last = (tiles - 1) as f32;
    let range = |v: [f32; 3]| {
        // Wider than the binning's own slack.
        let low = (v[0].min(v[1]).min(v[2]) - 1.0) * (1.0 / LIGHT_TILE as f32);
        let high = (v[0].max(v[1]).max(v[2]) + 1.0) * (1.0 / LIGHT_TILE as f32);
        (high >= 0.0 && low <= tiles as f32)
            .then(|| low.clamp(0.0, last) as u32..=high.clamp(0.0, last) as u32)
    };
    let (Some(columns), Some(rows)) = (range([a.x, b.x, c.x]), range([a.y, b.y, c.y])) else {
        return false;
    };
    let nearest = a.nearness.max(b.nearness).max(c.nearness) * (1.0 + 2.0 * NEARNESS_BAND);
    rows.into_iter().any(|row| {
        let row = (row * tiles) as usize;
        farthest[row + *columns.start() as usize..=row + *columns.end() as usize]
            .iter()
            .any(|&f| nearest >= f)
    })
}

#[cfg(test)]
mod tests;
