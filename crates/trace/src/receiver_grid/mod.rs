//! Hard shadows of one light on everything the eye sees: a grid of receivers, over which casters are drawn.
//!
//! HM08 §5.2 sorts casters into a light's grid and lets each shadow ray look up its cell. Here the roles are turned round, as in an
//! irregular Z-buffer (Aila and Laine 2004; Johnson et al. 2005): what the eye sees is known ([`Visibility`]), so
//! its points are sorted into the light's raster, and triangles are drawn over them in object order, as the
//! eye's are over pixels. Nothing is kept of a caster, and a triangle costs little where nobody asks:
//! beside all receivers, or behind the farthest of them.
//!
//! Steps: surface points of each of the eye's tiles in lanes, block by block into light tiles ([`gather`]); casters that may
//! come before somebody into light tiles, from clusters ([`casters`]); each light tile by itself ([`light_tile`]). All are
//! parallel, and their results do not depend on the order in which parts are done.
//!
//! A pixel whose triangle turns another side to the light than to the eye gets no light, without a ray.
//!
//! Layout, while one light is done: 12.5 to 25 bytes a pixel of blocks that ask, 44 bytes a block and light tile, 12 bytes
//! a vertex and cluster, 40 bytes a caster and 12 bytes a reference of one face; kept in [`LitScratch`]. What is left
//! is a bit a pixel. Limits: perspective eyes in lanes, others pixel by pixel; where coordinates pass 1e30, or all is
//! smaller than 1e-27, every caster is tested for every pixel.

mod asked;
mod casters;
mod gather;
mod light_tile;

use std::sync::atomic::AtomicU16;

use rayon::prelude::*;

use crate::kernel::pixels::{BlockPoints, LIGHT_TILE, QUICK_ERROR};
use crate::kernel::receivers::Points;
use crate::kernel::{NEARNESS_BAND, SimdLevel};
use crate::light_grid::takes_part;
use crate::view::{Arrangement, View};
use crate::visibility::place;
use crate::{CastRule, Clusters, Cone, Light, Triangles, Visibility, exact};

use casters::{CasterChunk, PlacedChunk, PlacedClusters};
pub(crate) use gather::GatherWork;
use gather::Part;
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

/// Working memory, kept from light to light and frame to frame.
#[derive(Clone, Debug, Default)]
pub struct LitScratch {
    parts: Vec<Part>,
    placed: Vec<PlacedChunk>,
    casters: Vec<CasterChunk>,
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
const PIXELS_A_TILE: u64 = if cfg!(test) { 150 } else { 3000 };

/// Largest number of light tiles of a face in each direction.
const MAX_TILES: u32 = 32;

impl LitPixels {
    /// Finds the pixels that a light reaches: those whose triangle turns the same side to the light as to the eye, and
    /// between which and the light there is no caster. The clusters may have been made when the vertices lay elsewhere.
    /// Uses all threads of the current rayon pool.
    ///
    /// # Panics
    /// If the clusters are of another number of triangles.
    pub fn find(
        visibility: &Visibility,
        triangles: &Triangles,
        clusters: &Clusters,
        query: &LightQuery,
        level: SimdLevel,
        scratch: &mut LitScratch,
    ) -> Self {
        assert_eq!(
            clusters.triangle_count(),
            triangles.len(),
            "clusters of other triangles"
        );
        let LitScratch {
            parts,
            placed,
            casters,
        } = scratch;
        let placed = PlacedClusters::new(clusters, triangles, placed);
        let bounds = placed.bounds();
        let Some(mut faces) = crate::light_views::views(&query.light, triangles, query.cone, bounds) else {
            return Self::one_by_one(visibility, triangles, query);
        };
        let pixels = visibility.seen() / (faces.views.len() as u64).max(1);
        let tiles = ((pixels / PIXELS_A_TILE) as f64).sqrt().ceil() as u32;
        let tiles = tiles.clamp(1, MAX_TILES);
        for view in &mut faces.views {
            let size = [f64::from(view.width), f64::from(view.height)];
            *view = view.window([0.0; 2], size, [tiles * LIGHT_TILE; 2]);
        }
        let light_tiles = faces.views.len() * (tiles * tiles) as usize;
        gather::gather(visibility, triangles, query, (&faces, light_tiles), level, parts);
        let parts: &[Part] = parts;
        let points: Vec<&[BlockPoints]> = parts.iter().map(|part| &part.points[..]).collect();
        let points = Points {
            parts: &points,
            tiles: visibility.tiles(),
            surest: 0.0,
        };
        let lit: Vec<Vec<AtomicU16>> = parts
            .iter()
            .flat_map(|part| &part.asked)
            .map(|asked| asked.iter().map(|&a| AtomicU16::new(a)).collect())
            .collect();
        let mut counts = LitCounts {
            receivers: parts.iter().map(|p| p.receivers).sum(),
            untested: parts.iter().map(|p| p.undisturbed).sum(),
            bytes: parts.iter().map(Part::bytes).sum(),
            ..LitCounts::default()
        };
        let mut of_a_face = 0;
        for face in 0..faces.views.len() {
            let scene = FaceScene {
                visibility,
                triangles,
                query,
                parts,
                points: Points {
                    surest: surest(visibility.view(), &faces.views[face]),
                    ..points
                },
                lit: &lit,
                view: &faces.views[face],
                face: face as u32,
                placed: &placed,
                level,
            };
            of_a_face = scene.draw(&mut counts, casters).max(of_a_face);
        }
        counts.bytes += placed.bytes() + of_a_face;
        let strides = visibility.tiles().iter().map(|tile| tile.stride);
        let tiles = strides.zip(lit).map(|(stride, lit)| LitTile {
            stride,
            lit: lit.into_iter().map(AtomicU16::into_inner).collect(),
        });
        Self {
            tiles: tiles.collect(),
            counts,
        }
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

/// Up to which nearness to a light what the eye sees has errors ([`crate::Receiver::error`]) below a quarter of the band in which
/// nearness is unsure.
fn surest(eye: &View, light: &View) -> f32 {
    let size = |view: &View| {
        let across = f64::from(view.width) / view.scale_x + f64::from(view.height) / view.scale_y;
        (f64::from(view.center.abs().max_element()), across)
    };
    let ((eye_center, across), (light_center, beside)) = (size(eye), size(light));
    let start = match eye.arrangement {
        Arrangement::Perspective => eye_center,
        Arrangement::Parallel { .. } => eye_center + across,
    };
    // Starts, and ways from there to what lies not much farther from the light than its center.
    let error = (2.0 * start + light_center) * 2f64.powi(-40);
    let band = f64::from(NEARNESS_BAND) * 0.25;
    match light.arrangement {
        Arrangement::Perspective => (band / error) as f32,
        Arrangement::Parallel { reach } if error + (reach + beside) * 2f64.powi(-40) < band * 0.5 * reach => {
            f32::INFINITY
        }
        Arrangement::Parallel { .. } => 0.0,
    }
}

impl LightQuery<'_> {
    /// Whether the pixels of a triangle ask: it turns the side that they see to the light. Of both is known in front of
    /// which they lie, if it is beyond doubt.
    fn asks(&self, triangles: &Triangles, prim: u32, fronts: [Option<bool>; 2]) -> bool {
        match fronts {
            [Some(lit), Some(seen)] => lit == seen,
            _ => self.faces(triangles, prim),
        }
    }

    /// Whether the light is on the side of a triangle that the eye sees.
    fn faces(&self, triangles: &Triangles, prim: u32) -> bool {
        exact::same_side(triangles.corners(prim), &self.light, &self.eye)
    }
}

/// One face of a light and all there is to draw in it.
struct FaceScene<'f> {
    visibility: &'f Visibility,
    triangles: &'f Triangles<'f>,
    query: &'f LightQuery<'f>,
    parts: &'f [Part],
    /// Points of the parts.
    points: Points<'f>,
    /// Of each of the eye's tiles the pixels that no caster was found for yet.
    lit: &'f [Vec<AtomicU16>],
    view: &'f View,
    face: u32,
    placed: &'f PlacedClusters<'f>,
    level: SimdLevel,
}

impl FaceScene<'_> {
    /// Draws all casters of a face and puts out what they shadow; returns the bytes held at most.
    fn draw(&self, counts: &mut LitCounts, chunks: &mut Vec<CasterChunk>) -> usize {
        let tiles = self.view.width / LIGHT_TILE;
        let first = (self.face * tiles * tiles) as usize;
        let mut farthest = vec![f32::INFINITY; (tiles * tiles) as usize];
        for part in self.parts {
            for (all, own) in farthest.iter_mut().zip(&part.farthest[first..]) {
                *all = all.min(*own);
            }
        }
        let asked: Vec<usize> = (0..farthest.len())
            .filter(|&t| farthest[t] < f32::INFINITY)
            .collect();
        if asked.is_empty() {
            return 0;
        }
        let casters = self.find_casters(&farthest, chunks);
        let rounding = (self.view.rounding() + QUICK_ERROR) as f32;
        let drawn: Vec<_> = asked
            .par_iter()
            .map_init(LightTileWork::default, |work, &tile| {
                let corner = [tile as u32 % tiles, tile as u32 / tiles].map(|i| (i * LIGHT_TILE) as f32);
                self.draw_tile(work, first + tile, casters.of_tile(tile), (corner, rounding))
            })
            .collect();
        for drawn in drawn {
            counts.untested += drawn.untested;
            counts.exact_pairs += drawn.exact_pairs;
            counts.references += drawn.references;
            counts.light_tiles += 1;
        }
        casters.bytes()
    }
}

#[cfg(test)]
mod tests;
