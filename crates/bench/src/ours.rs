//! Rayward as a contender: every structure is built anew in every frame.

use rayon::prelude::*;
use rayward::trace::{
    BLOCK_LANES, Casts, EyeGrid, EyeGridOptions, Light, LightGridOptions, PointLightGrid, Receiver,
    ShadowScratch, Tile, TileHits, Triangles, View, darken, exact,
};
use rayward::{CasterPolicy, CasterRules};

use crate::contender::{Contender, FrameKind, Job};
use crate::{Picture, Time};

/// Rayward with one choice of casters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rayward {
    /// Which sides of triangles cast.
    pub(crate) casters: CasterPolicy,
}

/// Working memory of a thread.
#[derive(Default)]
struct Work {
    hits: TileHits,
    receivers: Vec<Receiver>,
    places: Vec<u16>,
    shadow: Vec<bool>,
    scratch: ShadowScratch,
    lit: Vec<[u8; BLOCK_LANES]>,
}

/// Side of the tiles of all pictures.
pub(crate) fn tile_side() -> u32 {
    EyeGridOptions::default().tile
}

impl Contender for Rayward {
    fn name(&self) -> String {
        match self.casters {
            CasterPolicy::Both => "rayward, both sides cast".into(),
            _ => "rayward".into(),
        }
    }

    fn build(&self) -> Option<Time> {
        None
    }

    fn only_shadows(&self) -> bool {
        self.casters == CasterPolicy::Both
    }

    fn draw(&self, job: &Job, picture: &mut Picture) -> u64 {
        let triangles = job.scene.triangles();
        let eye = EyeGrid::build_clustered(
            job.view,
            triangles,
            &job.scene.clusters,
            EyeGridOptions::default(),
            job.level,
        );
        let light = match job.kind {
            FrameKind::Eye => None,
            FrameKind::EyeHard => Some(self.light_grid(job, job.light)),
        };
        let facets = job.facets();
        let tiles = picture.tiles_mut().map_init(Work::default, |work, out| {
            let tile = eye.tile(out.index);
            eye.trace_tile(&tile, &mut work.hits);
            facets.shade(&work.hits, out.corner, out.stride, out.blocks);
            let Some(light) = &light else {
                return 0;
            };
            let asked = work.ask(&eye, &triangles, &tile, light);
            for (block, lit) in out.blocks.iter_mut().zip(&work.lit) {
                darken(block, lit, 1);
            }
            asked
        });
        tiles.sum()
    }
}

impl Rayward {
    /// Eye rays and a shadow ray from every hit to each of these lights, without shading; gives the number of shadow
    /// rays.
    pub(crate) fn ask_lights(&self, job: &Job, lights: &[Light]) -> u64 {
        let triangles = job.scene.triangles();
        let eye = EyeGrid::build_clustered(
            job.view,
            triangles,
            &job.scene.clusters,
            EyeGridOptions::default(),
            job.level,
        );
        let grids: Vec<_> = lights.iter().map(|&light| self.light_grid(job, light)).collect();
        let tiles = (0..eye.tile_count())
            .into_par_iter()
            .map_init(Work::default, |work, index| {
                let tile = eye.tile(index);
                eye.trace_tile(&tile, &mut work.hits);
                work.receive(eye.view(), &triangles, &tile);
                for grid in &grids {
                    grid.shadowed(&work.receivers, &mut work.scratch, &mut work.shadow);
                }
                (work.receivers.len() * grids.len()) as u64
            });
        tiles.sum()
    }

    /// One light's grid, caster rules included.
    pub(crate) fn light_grid<'s>(&self, job: &Job<'s>, light: Light) -> PointLightGrid<'s> {
        let (scene, options) = (job.scene, LightGridOptions::default());
        let triangles = scene.triangles();
        if self.casters == CasterPolicy::Both {
            return PointLightGrid::build(light, triangles, &|_| Casts::Both, options, job.level);
        }
        let eye = job.view.center.as_dvec3();
        let rules = CasterRules::new(
            &scene.scene,
            &scene.geometry,
            &scene.topology,
            self.casters,
            Some(eye),
        );
        let rule = rules.for_light(&scene.geometry, &light);
        PointLightGrid::build(light, triangles, &rule, options, job.level)
    }
}

impl Work {
    /// Asks a light about every hit of a tile; `lit` holds the answers.
    fn ask(&mut self, eye: &EyeGrid, triangles: &Triangles, tile: &Tile, light: &PointLightGrid) -> u64 {
        self.receive(eye.view(), triangles, tile);
        light.shadowed(&self.receivers, &mut self.scratch, &mut self.shadow);
        for (&place, &shadow) in self.places.iter().zip(&self.shadow) {
            let place = usize::from(place);
            self.lit[place / BLOCK_LANES][place % BLOCK_LANES] = u8::from(!shadow);
        }
        self.receivers.len() as u64
    }

    fn receive(&mut self, view: &View, triangles: &Triangles, tile: &Tile) {
        self.receivers.clear();
        self.places.clear();
        let (columns, rows) = (tile.width.div_ceil(4), tile.height.div_ceil(4));
        self.lit.clear();
        self.lit.resize((columns * rows) as usize, [0; BLOCK_LANES]);
        for i in 0..self.lit.len() {
            let (column, row) = (i as u32 % columns, i as u32 / columns);
            for (lane, &prim) in self.hits.block(column, row).prim.iter().enumerate() {
                let (x, y) = (column * 4 + lane as u32 % 4, row * 4 + lane as u32 / 4);
                if prim == u32::MAX || x >= tile.width || y >= tile.height {
                    continue;
                }
                let ray = view.pixel_ray(tile.x + x, tile.y + y);
                let corners = triangles.corners(prim);
                if let Some(hit) = exact::attributes(ray.origin, ray.dir, corners) {
                    self.receivers.push(Receiver::along(&ray, hit.t, prim));
                    self.places.push((i * BLOCK_LANES + lane) as u16);
                }
            }
        }
    }
}
