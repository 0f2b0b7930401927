//! What the eye sees through: all masked and blended triangles before what is opaque, by pixel, front to back.
//!
//! HM08 §5.1's grid with a list in each pixel instead of one triangle. Masked and blended triangles are sorted into
//! cells of 4 x 4 pixels, and each cell's are tested against its rays at once; where a pixel has an opaque triangle
//! (of an [`crate::EyeGrid`] without them), only what lies before that is kept. The order is that of hits: by `t`, then by
//! id, so a picture does not depend on the order of triangles.
//!
//! Layout: 72 bytes a triangle, 4 bytes a reference, 4 bytes a cell and chunk of triangles; 40 bytes a hit and 8 bytes
//! a pixel while a tile is traced. Rebuilt every frame. Answers: exactly those of testing every triangle with
//! [`crate::exact`] for [`View::pixel_ray`].

use crate::bins::{Binning, Bins, CellGrid};
use crate::exact::{self, ExactHit};
use crate::eye_grid::project_all;
use crate::kernel::points::{Caster, PointLanes};
use crate::kernel::tile::BLOCK;
use crate::kernel::veils::{Veiled, veiled};
use crate::kernel::{LANES, SimdLevel};
use crate::light_grid::set_up_all;
use crate::{Tile, Triangles, View, ViewRay};

/// The grid of a camera over the triangles that its rays may pass.
#[derive(Clone, Debug)]
pub struct EyeVeils<'a> {
    view: View,
    triangles: Triangles<'a>,
    level: SimdLevel,
    columns: u32,
    bins: Bins,
    casters: Vec<Caster>,
}

/// A triangle that a pixel's ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VeilHit {
    /// The triangle.
    pub prim: u32,
    /// Where the ray meets it.
    pub hit: ExactHit,
}

/// Working memory of one thread, and the hits of the last tile.
#[derive(Clone, Debug, Default)]
pub struct TileVeils {
    width: u32,
    hits: Vec<VeilHit>,
    /// First hit of each pixel, and the one after its last.
    ranges: Vec<[u32; 2]>,
    points: PointLanes,
    found: Vec<Veiled>,
    cell: Vec<(u32, VeilHit)>,
}

impl TileVeils {
    /// What pixel (x, y) of the tile, counted from its corner, sees through, front to back.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> &[VeilHit] {
        let range = self.ranges.get((y * self.width + x) as usize);
        range.map_or(&[], |&[first, end]| &self.hits[first as usize..end as usize])
    }
}

impl<'a> EyeVeils<'a> {
    /// Builds the grid over those triangles for which `is_veil` holds, on all threads of the current rayon pool.
    pub fn build(
        view: View,
        triangles: Triangles<'a>,
        is_veil: impl Fn(u32) -> bool + Sync,
        level: SimdLevel,
    ) -> Self {
        let cells = [view.width.div_ceil(BLOCK), view.height.div_ceil(BLOCK)];
        let grid = CellGrid {
            cells,
            side: BLOCK as f32,
            size: [view.width as f32, view.height as f32],
            pixel_centres: true,
        };
        let vertices = project_all(level, &view, &triangles);
        let mut bins = Bins::build(&view, &triangles, &vertices, &grid, Binning::Overlap, is_veil);
        let prims = bins.number_references(triangles.len());
        Self {
            view,
            triangles,
            level,
            columns: cells[0],
            casters: set_up_all(level, &view, &triangles, &vertices, &prims),
            bins,
        }
    }

    /// Cells of the grid.
    pub fn cell_count(&self) -> usize {
        (self.columns * self.view.height.div_ceil(BLOCK)) as usize
    }

    /// References from cells to triangles.
    pub fn reference_count(&self) -> usize {
        self.bins.reference_count()
    }

    /// Bytes held by the grid.
    pub fn bytes(&self) -> usize {
        self.bins.bytes() + self.casters.capacity() * size_of::<Caster>()
    }

    /// Finds the hits of all pixels of a tile whose corner lies at a multiple of four pixels. `opaque` gives the
    /// closest opaque triangle of a pixel, counted from the tile's corner.
    pub fn trace_tile(&self, tile: &Tile, opaque: impl Fn(u32, u32) -> Option<u32>, veils: &mut TileVeils) {
        veils.hits.clear();
        veils.width = tile.width;
        veils.ranges.clear();
        for y in (0..tile.height).step_by(BLOCK as usize) {
            for x in (0..tile.width).step_by(BLOCK as usize) {
                let cell = (tile.y + y) / BLOCK * self.columns + (tile.x + x) / BLOCK;
                if self.bins.cell(cell as usize).any(|refs| !refs.is_empty()) {
                    veils.ranges.resize((tile.width * tile.height) as usize, [0; 2]);
                    self.trace_cell(tile, [x, y], cell, &opaque, veils);
                }
            }
        }
    }

    fn trace_cell(
        &self,
        tile: &Tile,
        [x, y]: [u32; 2],
        cell: u32,
        opaque: &impl Fn(u32, u32) -> Option<u32>,
        veils: &mut TileVeils,
    ) {
        let mut rays = [(); LANES].map(|()| None);
        let mut open = 0;
        for lane in 0..LANES as u32 {
            let (x, y) = (x + lane % BLOCK, y + lane / BLOCK);
            if x >= tile.width || y >= tile.height {
                continue;
            }
            open |= 1 << lane;
            let ray = self.view.pixel_ray(tile.x + x, tile.y + y);
            let wall = opaque(x, y).and_then(|prim| {
                let hit = exact::attributes(ray.origin, ray.dir, self.triangles.corners(prim))?;
                Some((hit.t, prim))
            });
            let points = &mut veils.points;
            points.x[lane as usize] = (tile.x + x) as f32 + 0.5;
            points.y[lane as usize] = (tile.y + y) as f32 + 0.5;
            points.nearness[lane as usize] = wall.map_or(0.0, |(t, _)| self.view.nearness(t) as f32);
            points.own[lane as usize] = u32::MAX;
            rays[lane as usize] = Some((ray, wall));
        }
        veils.found.clear();
        for refs in self.bins.cell(cell as usize) {
            veiled(
                self.level,
                &veils.points,
                open,
                &self.casters,
                refs,
                &mut veils.found,
            );
        }
        veils.cell.clear();
        for found in &veils.found {
            let Some((ray, wall)) = rays[found.lane as usize] else {
                continue;
            };
            let hit = self.hit(&ray, found.prim, found.met);
            let before = |hit: &ExactHit| wall.is_none_or(|(t, prim)| (hit.t, found.prim) < (t, prim));
            let prim = found.prim;
            veils
                .cell
                .extend(hit.filter(before).map(|hit| (found.lane, VeilHit { prim, hit })));
        }
        veils.cell.sort_unstable_by(|(a, p), (b, q)| {
            let depth = p.hit.t.total_cmp(&q.hit.t);
            a.cmp(b).then(depth).then(p.prim.cmp(&q.prim))
        });
        for same_pixel in veils.cell.chunk_by(|a, b| a.0 == b.0) {
            let lane = same_pixel[0].0;
            let first = veils.hits.len() as u32;
            veils.hits.extend(same_pixel.iter().map(|(_, hit)| hit));
            let pixel = (y + lane / BLOCK) * tile.width + x + lane % BLOCK;
            veils.ranges[pixel as usize] = [first, veils.hits.len() as u32];
        }
    }

    /// The hit of a triangle in front; `met` if the ray is known to meet it.
    fn hit(&self, ray: &ViewRay, prim: u32, met: bool) -> Option<ExactHit> {
        let corners = self.triangles.corners(prim);
        let hit = if met {
            exact::attributes(ray.origin, ray.dir, corners)
        } else {
            exact::hit(ray.origin, ray.dir, corners)
        };
        hit.filter(|hit| hit.t > 0.0)
    }
}

#[cfg(test)]
mod tests;
