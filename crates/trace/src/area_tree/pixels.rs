//! The pixels of one of the eye's tiles as receivers of an area light: points made in lanes, answers by block.
//!
//! Squares of 16 x 16 pixels are searched for together, blocks of 4 x 4 pixels tested together. Cost, beside what a search
//! finds: some 150 vector instructions for sixteen pixels. Layout: 8 bytes a pixel and 2 bytes a block and sample.

use super::{AreaLightTree, AreaScratch, Asking, BATCHES, FAR_RECEIVER};
use crate::kernel::LANES;
use crate::kernel::askers::{Origin, PixelPoints, place_blocks};
use crate::receiver_grid::GatherWork;
use crate::visibility::VisibleTile;
use crate::{Receiver, Samples, Tile, TileHits, View};

/// What the pixels of one of the eye's tiles see.
#[derive(Clone, Copy, Debug)]
pub struct SeenTile<'h> {
    /// The view.
    pub view: &'h View,
    /// The tile.
    pub tile: Tile,
    /// The triangles that its pixels see.
    pub hits: &'h TileHits,
}

/// Which samples of an area light the pixels of a tile see, and the memory to find it out.
#[derive(Debug, Default)]
pub struct TileSamples {
    work: GatherWork,
    /// For each block and sample the pixels that see it.
    open: Vec<u16>,
    samples: usize,
}

impl TileSamples {
    /// The pixels of a block that were asked for, a bit each. Blocks are counted in rows.
    #[inline]
    pub fn asked(&self, block: usize) -> u16 {
        self.work.asked[block]
    }

    /// For each sample the pixels of a block that see it, a bit each.
    #[inline]
    pub fn open(&self, block: usize) -> &[u16] {
        &self.open[block * self.samples..(block + 1) * self.samples]
    }

    /// How many samples each pixel of a block sees.
    #[inline]
    pub fn counts(&self, block: usize) -> [u16; LANES] {
        let open = self.open(block);
        let mut counts = [0; LANES];
        if open.iter().all(|&lanes| lanes == open[0]) {
            for (lane, count) in counts.iter_mut().enumerate() {
                *count = (open[0] >> lane & 1) * open.len() as u16;
            }
            return counts;
        }
        for lanes in open {
            for (lane, count) in counts.iter_mut().enumerate() {
                *count += lanes >> lane & 1;
            }
        }
        counts
    }
}

/// A block of the tile, and the pixels in it that ask.
type Block = (u32, u16);

/// The blocks of a tile that are searched for together.
struct Square<'t> {
    tile: &'t VisibleTile,
    view: &'t View,
    t: &'t [[f64; LANES]],
    blocks: [Option<Block>; BATCHES],
}

impl Square<'_> {
    /// The blocks around a place, along a Z-curve, so that neighbours in it are neighbours in the picture.
    fn blocks(tile: &VisibleTile, asked: &[u16], [x, y]: [u32; 2]) -> [Option<Block>; BATCHES] {
        let rows = tile.prims.len() as u32 / tile.stride;
        std::array::from_fn(|i| {
            let i = i as u32;
            let column = x + (i & 1 | i >> 1 & 2);
            let row = y + (i >> 1 & 1 | i >> 2 & 2);
            if column >= tile.stride || row >= rows {
                return None;
            }
            let block = row * tile.stride + column;
            let asked = asked[block as usize];
            (asked != 0).then_some((block, asked))
        })
    }

    fn receiver(&self, batch: usize, lane: usize) -> Receiver {
        let (block, _) = self.blocks[batch].expect("only blocks that ask have receivers");
        let (t, prim) = (
            self.t[block as usize][lane],
            self.tile.prims[block as usize][lane],
        );
        Receiver::along(&self.tile.ray(self.view, block, lane as u32), t, prim)
    }
}

impl AreaLightTree<'_> {
    /// Which samples the pixels of a tile see whose triangle `asks`; a pixel that does not ask sees none. `set_of` gives the
    /// pixel whose set of samples a pixel of the picture uses.
    pub fn visible_pixels(
        &self,
        seen: &SeenTile,
        asks: &dyn Fn(u32) -> bool,
        set_of: &dyn Fn([u32; 2]) -> u32,
        samples: &Samples,
        (scratch, out): (&mut AreaScratch, &mut TileSamples),
    ) {
        let SeenTile { view, hits, .. } = *seen;
        let tile = &VisibleTile::of(seen.tile, hits);
        out.samples = samples.count() as usize;
        out.open.clear();
        out.open.resize(tile.prims.len() * out.samples, 0);
        let asks = |prim, []: [Option<bool>; 0]| asks(prim);
        out.work.find((view, []), &self.triangles, tile, asks, self.level);
        let GatherWork { rays, t, asked, .. } = &out.work;
        let points = PixelPoints {
            rays,
            eye: rays.farthest_start(),
            t,
            prims: &tile.prims,
        };
        let side = BATCHES.isqrt();
        let rows = tile.prims.len() / tile.stride as usize;
        for y in (0..rows as u32).step_by(side) {
            for x in (0..tile.stride).step_by(side) {
                let blocks = Square::blocks(tile, asked, [x, y]);
                let square = Square {
                    tile,
                    view,
                    t,
                    blocks,
                };
                self.square(&square, &points, set_of, samples, (scratch, &mut out.open));
            }
        }
    }

    fn square(
        &self,
        square: &Square,
        points: &PixelPoints,
        set_of: &dyn Fn([u32; 2]) -> u32,
        samples: &Samples,
        (scratch, open): (&mut AreaScratch, &mut [u16]),
    ) {
        if square.blocks.iter().all(Option::is_none) {
            return;
        }
        let asking = self.place_pixels(square, points, scratch);
        for (askers, block) in scratch.work.askers.iter_mut().zip(square.blocks) {
            let Some((block, _)) = block else { continue };
            for (lane, pixel) in askers.pixel.iter_mut().enumerate() {
                *pixel = set_of(square.tile.pixel(block, lane as u32));
            }
        }
        self.answer(
            &asking,
            samples,
            &|batch, lane| square.receiver(batch, lane),
            scratch,
        );
        for (answers, block) in scratch.work.answers.iter().zip(square.blocks) {
            let Some((block, _)) = block else { continue };
            let first = block as usize * answers.open.len();
            for (open, &lanes) in open[first..].iter_mut().zip(&answers.open) {
                *open = lanes as u16;
            }
        }
    }

    /// Puts the pixels of a square into lanes.
    fn place_pixels(&self, square: &Square, points: &PixelPoints, scratch: &mut AreaScratch) -> Asking {
        let mut asking = Asking::default();
        for (all, block) in asking.all.iter_mut().zip(square.blocks) {
            *all = block.map_or(0, |(_, asked)| u32::from(asked));
        }
        let Some(local) = &self.local else {
            let lanes = if self.unsorted.is_empty() {
                &mut asking.near
            } else {
                &mut asking.far
            };
            for (batch, lanes) in lanes.iter_mut().enumerate() {
                let shines = |lane: &usize| {
                    asking.all[batch] & 1 << lane != 0
                        && self.light.shines_at(square.receiver(batch, *lane).point)
                };
                *lanes = (0..LANES).filter(shines).fold(0, |bits, lane| bits | 1 << lane);
            }
            return asking;
        };
        let origin = Origin {
            origin: local.origin.as_dvec3(),
            unit: local.unit,
            center: self.light.center.as_dvec3(),
            normal: self.light.normal(),
            light: &local.light,
            farthest: FAR_RECEIVER as f32,
        };
        let lanes = [&mut asking.near[..], &mut asking.far[..]];
        let work = &mut scratch.work;
        let places = (&mut work.receivers[..], &mut work.askers[..]);
        place_blocks(self.level, &origin, points, &square.blocks, places, lanes);
        asking
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::test_meshes::{Mesh, axes, looking};
    use crate::{AreaLight, BruteForce, Casts, EyeGrid, EyeGridOptions, SimdLevel, exact};

    fn lights() -> [AreaLight; 5] {
        [
            AreaLight::rectangle(Vec3::new(0.5, 2.0, 0.4), Vec3::X * 0.3, Vec3::Z * 0.3),
            // Its plane passes through the middle of what is seen.
            AreaLight::disk(Vec3::new(-0.8, 0.1, 0.9), Vec3::Y * 0.2, Vec3::Z * 0.3),
            AreaLight::sphere(Vec3::new(0.3, 0.9, 0.8), 0.3),
            AreaLight::sun(Vec3::new(0.3, 1.0, 0.2), 0.1),
            AreaLight::rectangle(Vec3::NAN, Vec3::X, Vec3::Z),
        ]
    }

    /// Compares each pixel's samples with brute force; gives how many samples are seen, and how many not.
    fn check(name: &str, mesh: &Mesh, view: View, light: AreaLight, level: SimdLevel) -> [u32; 2] {
        let triangles = mesh.triangles();
        let (samples, brute) = (Samples::new(5, 3), BruteForce::new(triangles));
        let grid = EyeGrid::build(view, triangles, EyeGridOptions::default(), level);
        let tree = AreaLightTree::build(light, triangles, &|_| Casts::Both, level);
        let (asks, set_of) = (
            |prim: u32| !prim.is_multiple_of(3),
            |[x, y]: [u32; 2]| y * 1000 + x,
        );
        let (mut hits, mut scratch) = (TileHits::default(), AreaScratch::default());
        let (mut out, mut found) = (TileSamples::default(), [0; 2]);
        for tile in (0..grid.tile_count()).map(|index| grid.tile(index)) {
            grid.trace_tile(&tile, &mut hits);
            let (view, hits) = (&view, &hits);
            let memory = (&mut scratch, &mut out);
            tree.visible_pixels(&SeenTile { view, tile, hits }, &asks, &set_of, &samples, memory);
            let seen = VisibleTile::of(tile, hits);
            for (block, lane) in (0..seen.prims.len()).flat_map(|b| (0..LANES).map(move |l| (b, l))) {
                let prim = seen.prims[block][lane];
                let asked = prim != u32::MAX && asks(prim);
                assert_eq!(out.asked(block) >> lane & 1 != 0, asked, "{name} {block} {lane}");
                let got: Vec<bool> = out.open(block).iter().map(|b| b >> lane & 1 != 0).collect();
                assert_eq!(
                    usize::from(out.counts(block)[lane]),
                    got.iter().filter(|&&b| b).count()
                );
                let [x, y] = seen.pixel(block as u32, lane as u32);
                let want = asked.then(|| {
                    let ray = view.pixel_ray(x, y);
                    let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim)).expect("seen");
                    let receiver = Receiver::along(&ray, hit.t, prim);
                    brute.visible_samples(&receiver, &light, &samples, set_of([x, y]))[0]
                });
                let want: Vec<bool> = (0..5).map(|k| want.unwrap_or(0) >> k & 1 != 0).collect();
                assert_eq!(got, want, "{name} {light:?} {} ({x}, {y})", level.name());
                found[0] += want.iter().filter(|&&b| b).count() as u32;
                found[1] += want.iter().filter(|&&b| asked && !b).count() as u32;
            }
        }
        found
    }

    #[test]
    fn pixels_see_what_brute_force_sees() {
        let mut total = [0; 2];
        for level in SimdLevel::available() {
            for (name, mesh) in [("soup", Mesh::soup(3, 150, 0.4, 1.0)), ("blob", Mesh::blob(10))] {
                let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [70, 46]);
                for light in lights() {
                    let found = check(name, &mesh, view, light, level);
                    total = [total[0] + found[0], total[1] + found[1]];
                }
            }
        }
        assert!(total[0] > 5000 && total[1] > 5000, "{total:?}");
    }

    #[test]
    fn a_parallel_eye_and_coordinates_that_no_tree_takes() {
        let level = SimdLevel::detect();
        let axes = axes(DVec3::new(-0.3, -0.5, -1.0));
        let view = View::parallel(Vec3::new(0.9, 1.5, 3.0), axes, [1.5, 1.0], 40.0, [30, 20]);
        let mut mesh = Mesh::soup(21, 100, 0.3, 1.0);
        let few = check("parallel", &mesh, view, lights()[0], level);
        assert!(few[0] > 100 && few[1] > 50, "{few:?}");
        mesh.triangle([
            Vec3::new(5.0, 0.0, 0.0),
            Vec3::new(1e31, 1.0, 0.0),
            Vec3::new(5.0, 1.0, 1.0),
        ]);
        let view = looking(Vec3::new(0.2, 0.5, 2.5), Vec3::ZERO, 0.5, [30, 20]);
        for light in lights() {
            check("huge", &mesh, view, light, level);
        }
    }
}
