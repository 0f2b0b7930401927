//! Rayward as a contender: every structure is built anew in every frame. What depends on which vertices make a triangle,
//! not on where they are, is kept as a renderer keeps it: clusters and components.
//!
//! Hard shadows are found for all pixels at once, after the eye rays; soft ones tile by tile.

use std::sync::Mutex;

use rayon::prelude::*;
use rayward::trace::{
    AreaLightGrid, AreaLightTree, AreaScratch, BLOCK_LANES, CastRule, Casts, EyeGrid, EyeGridOptions,
    FaceOptions, Facets, Light, LightGridOptions, LightQuery, LitPixels, LitScratch, PointLightGrid,
    PointLightTree, Receiver, SeenTile, ShadowScratch, SimdLevel, Tile, TileHits, TileSamples, Visibility,
    darken, darken_unlit, exact,
};
use rayward::{CasterPolicy, CasterRules};

use crate::contender::{Contender, FrameKind, Job, SOFT_SAMPLES, sample_set};
use crate::{Picture, Time};

/// A structure of casters in which hard shadows are looked up pixel by pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LookUp {
    /// A grid.
    Grid(LightGridOptions),
    /// A grid whose cells also know what lies in the dark behind them.
    DarkCells,
    /// A tree.
    Tree,
}

/// How Rayward draws: as it usually does, or with something taken away.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ways {
    /// Name, for tables.
    pub(crate) name: &'static str,
    /// Which sides of triangles cast.
    pub(crate) casters: CasterPolicy,
    /// Parameters of the camera's grid.
    pub(crate) eye: EyeGridOptions,
    /// Whether that grid is built over clusters.
    pub(crate) clusters: bool,
    /// Where hard shadows are looked up, instead of found for all pixels at once.
    pub(crate) looked_up: Option<LookUp>,
    /// Whether memory is kept from frame to frame.
    pub(crate) keeps_memory: bool,
    /// Grids through which soft shadows are followed, instead of a tree.
    pub(crate) followed: Option<FaceOptions>,
    /// Whether the tree knows which triangles share edges.
    pub(crate) sheets: bool,
    /// Instruction set of the kernels, if not the job's.
    pub(crate) level: Option<SimdLevel>,
}

impl Ways {
    /// The usual ways.
    pub(crate) fn usual() -> Self {
        Self {
            name: "rayward",
            casters: CasterPolicy::Auto,
            eye: EyeGridOptions::default(),
            clusters: true,
            looked_up: None,
            keeps_memory: true,
            followed: None,
            sheets: true,
            level: None,
        }
    }
}

/// Rayward, drawing in one of its ways.
#[derive(Debug)]
pub(crate) struct Rayward {
    ways: Ways,
    /// Memory of the last frame.
    scratch: Mutex<LitScratch>,
}

/// Side of the tiles of all pictures.
pub(crate) fn tile_side() -> u32 {
    EyeGridOptions::default().tile
}

impl Contender for Rayward {
    fn name(&self) -> String {
        self.ways.name.into()
    }

    fn build(&self) -> Option<Time> {
        None
    }

    fn only_shadows(&self) -> bool {
        self.ways.casters == CasterPolicy::Both
    }

    fn draw(&self, job: &Job, picture: &mut Picture) -> u64 {
        let (eye, facets) = (self.eye(job), job.facets());
        match job.kind {
            FrameKind::Eye => {
                picture.tiles_mut().for_each_init(TileHits::default, |hits, out| {
                    eye.trace_tile(&eye.tile(out.index), hits);
                    facets.shade(hits, out.corner, out.stride, out.blocks);
                });
                0
            }
            FrameKind::EyeHard => match self.ways.looked_up {
                Some(in_what) => self.draw_looked_up(job, &eye, &facets, in_what, picture),
                None => self.draw_hard(job, &eye, &facets, picture),
            },
            FrameKind::EyeSoft => match &self.ways.followed {
                Some(options) => draw_followed(job, &eye, &facets, options, picture),
                None => self.draw_soft(job, &eye, &facets, picture),
            },
        }
    }
}

/// The camera's grid, as usual.
pub(crate) fn eye_grid<'s>(job: &Job<'s>) -> EyeGrid<'s> {
    Rayward::new(Ways::usual()).eye(job)
}

impl Rayward {
    pub(crate) fn new(ways: Ways) -> Self {
        let scratch = Mutex::default();
        Self { ways, scratch }
    }

    fn level(&self, job: &Job) -> SimdLevel {
        self.ways.level.unwrap_or(job.level)
    }

    /// The camera's grid.
    fn eye<'s>(&self, job: &Job<'s>) -> EyeGrid<'s> {
        let (triangles, options, level) = (job.scene.triangles(), self.ways.eye, self.level(job));
        if self.ways.clusters {
            EyeGrid::build_clustered(job.view, triangles, &job.scene.clusters, options, level)
        } else {
            EyeGrid::build(job.view, triangles, options, level)
        }
    }

    fn draw_hard(&self, job: &Job, eye: &EyeGrid, facets: &Facets, picture: &mut Picture) -> u64 {
        let mut tiles: Vec<_> = picture.tiles_mut().map(Mutex::new).collect();
        let visibility = Visibility::trace_and(eye, &|tile: &Tile, hits: &TileHits| {
            let mut out = tiles[tile.index as usize].lock().expect("no tile panics");
            let out = &mut *out;
            facets.shade(hits, out.corner, out.stride, out.blocks);
        });
        let lit = self.lit(job, &visibility, job.light);
        tiles.par_iter_mut().for_each(|tile| {
            let tile = tile.get_mut().expect("no tile panics");
            for (block, &lit) in tile.blocks.iter_mut().zip(lit.blocks(tile.index)) {
                darken_unlit(block, lit);
            }
        });
        lit.counts.receivers
    }

    /// Which pixels a light reaches, caster rules included.
    pub(crate) fn lit(&self, job: &Job, visibility: &Visibility, light: Light) -> LitPixels {
        if !self.ways.keeps_memory {
            *self.scratch.lock().expect("no light panics") = LitScratch::default();
        }
        self.with_rule(job, light, |rule| {
            let query = LightQuery {
                light,
                cone: None,
                eye: Light::Point(job.view.center),
                rule,
            };
            LitPixels::find(
                visibility,
                &job.scene.triangles(),
                &job.scene.clusters,
                &query,
                self.level(job),
                &mut self.scratch.lock().expect("no light panics"),
            )
        })
    }

    /// Hard shadows from a structure of casters, tile by tile, as HM08 has them.
    fn draw_looked_up(
        &self,
        job: &Job,
        eye: &EyeGrid,
        facets: &Facets,
        in_what: LookUp,
        picture: &mut Picture,
    ) -> u64 {
        let casters = self.with_rule(job, job.light, |rule| self.casters(job, in_what, rule));
        let tiles = picture.tiles_mut().map_init(AskingWork::default, |work, out| {
            let tile = eye.tile(out.index);
            eye.trace_tile(&tile, &mut work.hits);
            facets.shade(&work.hits, out.corner, out.stride, out.blocks);
            work.receive(facets, &tile, job);
            let (scratch, shadow) = (&mut work.scratch, &mut work.shadow);
            match &casters {
                Casters::Grid(grid) => grid.shadowed(&work.receivers, scratch, shadow),
                Casters::Tree(tree) => tree.shadowed(&work.receivers, scratch, shadow),
            }
            for (&[block, lane], &shadow) in work.places.iter().zip(&work.shadow) {
                work.lit[block][lane] = u8::from(!shadow);
            }
            for (block, lit) in out.blocks.iter_mut().zip(&work.lit) {
                darken(block, lit, 1);
            }
            work.receivers.len() as u64
        });
        tiles.sum()
    }

    /// The structure in which hard shadows are looked up.
    fn casters<'s>(&self, job: &Job<'s>, in_what: LookUp, rule: CastRule) -> Casters<'s> {
        let (light, triangles, level) = (job.light, job.scene.triangles(), self.level(job));
        match in_what {
            LookUp::Grid(options) => {
                Casters::Grid(PointLightGrid::build(light, triangles, rule, options, level))
            }
            LookUp::DarkCells => {
                let options = LightGridOptions {
                    receivers: u64::from(job.view.width) * u64::from(job.view.height) / 2,
                    ..LightGridOptions::default()
                };
                let topology = &job.scene.topology;
                Casters::Grid(PointLightGrid::build_with_topology(
                    light, triangles, topology, rule, options, level,
                ))
            }
            LookUp::Tree => Casters::Tree(PointLightTree::build(light, triangles, rule, None, level)),
        }
    }

    /// Eye rays and a shadow ray from every hit to each of these lights, one light at a time, without shading; gives
    /// the number of shadow rays.
    pub(crate) fn ask_lights(&self, job: &Job, lights: &[Light]) -> u64 {
        let visibility = Visibility::trace(&eye_grid(job), &|| ());
        let lit = lights.iter().map(|&light| self.lit(job, &visibility, light));
        lit.map(|lit| lit.counts.receivers).sum()
    }

    fn draw_soft(&self, job: &Job, eye: &EyeGrid, facets: &Facets, picture: &mut Picture) -> u64 {
        let triangles = job.scene.triangles();
        // Only both sides cast the shadow of a light with a size.
        let mut tree = AreaLightTree::build(job.area, triangles, &|_| Casts::Both, self.level(job));
        if self.ways.sheets {
            tree = tree.with_topology(&job.scene.topology);
        }
        let tiles = picture.tiles_mut().map_init(SoftWork::default, |work, out| {
            let tile = eye.tile(out.index);
            eye.trace_tile(&tile, &mut work.hits);
            facets.shade(&work.hits, out.corner, out.stride, out.blocks);
            let seen = SeenTile {
                view: &job.view,
                tile,
                hits: &work.hits,
            };
            let asks = |prim: u32| facets.facet(prim) > 0.0;
            let set_of = |[x, y]: [u32; 2]| sample_set(x, y);
            let memory = (&mut work.scratch, &mut work.lit);
            tree.visible_pixels(&seen, &asks, &set_of, &job.samples, memory);
            let mut asking = 0;
            let samples = job.samples.count();
            for (i, block) in out.blocks.iter_mut().enumerate() {
                let seen = work.lit.counts(i);
                let mut lit = [0; BLOCK_LANES];
                for lane in 0..BLOCK_LANES {
                    // The share of all samples as so many of the usual number.
                    lit[lane] = if samples == SOFT_SAMPLES {
                        seen[lane] as u8
                    } else {
                        (u32::from(seen[lane]) * SOFT_SAMPLES / samples) as u8
                    };
                }
                darken(block, &lit, SOFT_SAMPLES as u8);
                asking += u64::from(work.lit.asked(i).count_ones());
            }
            asking * u64::from(job.samples.count())
        });
        tiles.sum()
    }

    /// What each triangle casts in this light, given to `use_it`.
    fn with_rule<R>(&self, job: &Job, light: Light, use_it: impl FnOnce(CastRule) -> R) -> R {
        if self.ways.casters == CasterPolicy::Both {
            return use_it(&|_| Casts::Both);
        }
        let (scene, eye) = (job.scene, job.view.center.as_dvec3());
        let (policy, topology) = (self.ways.casters, &scene.topology);
        let rules = CasterRules::new(&scene.scene, &scene.geometry, topology, policy, Some(eye));
        let rule = rules.for_light(&scene.geometry, &light);
        use_it(&rule)
    }
}

/// Soft shadows through perspective grids around the middle of the light.
fn draw_followed(
    job: &Job,
    eye: &EyeGrid,
    facets: &Facets,
    options: &FaceOptions,
    picture: &mut Picture,
) -> u64 {
    let grids = AreaLightGrid::build(job.area, job.scene.triangles(), &|_| Casts::Both, options);
    let tiles = picture.tiles_mut().map_init(AskingWork::default, |work, out| {
        let tile = eye.tile(out.index);
        eye.trace_tile(&tile, &mut work.hits);
        facets.shade(&work.hits, out.corner, out.stride, out.blocks);
        work.receive(facets, &tile, job);
        let (receivers, pixels, samples) = (&work.receivers, &work.pixels, &job.samples);
        grids.visible(receivers, pixels, samples, &mut work.area, &mut work.bits);
        let bits = work.bits.chunks(samples.words());
        for (&[block, lane], bits) in work.places.iter().zip(bits) {
            let count: u32 = bits.iter().map(|bits| bits.count_ones()).sum();
            work.lit[block][lane] = (count * SOFT_SAMPLES / samples.count()) as u8;
        }
        for (block, lit) in out.blocks.iter_mut().zip(&work.lit) {
            darken(block, lit, SOFT_SAMPLES as u8);
        }
        work.receivers.len() as u64 * u64::from(job.samples.count())
    });
    tiles.sum()
}

/// A light's casters, in which receivers are looked up.
enum Casters<'s> {
    Grid(PointLightGrid<'s>),
    Tree(PointLightTree<'s>),
}

/// Working memory of a thread for shadows tile by tile.
#[derive(Default)]
struct SoftWork {
    hits: TileHits,
    scratch: AreaScratch,
    lit: TileSamples,
}

/// Working memory of a thread for shadows that are asked for receiver by receiver.
#[derive(Default)]
struct AskingWork {
    hits: TileHits,
    receivers: Vec<Receiver>,
    /// Sample set of each receiver, its block, and its lane there.
    pixels: Vec<u32>,
    places: Vec<[usize; 2]>,
    scratch: ShadowScratch,
    shadow: Vec<bool>,
    area: AreaScratch,
    bits: Vec<u32>,
    /// How much light the pixels of each block get.
    lit: Vec<[u8; BLOCK_LANES]>,
}

impl AskingWork {
    /// The hits of a tile that are turned towards the light.
    fn receive(&mut self, facets: &Facets, tile: &Tile, job: &Job) {
        let triangles = job.scene.triangles();
        let (columns, rows) = (tile.width.div_ceil(4), tile.height.div_ceil(4));
        self.receivers.clear();
        self.pixels.clear();
        self.places.clear();
        self.lit.clear();
        self.lit.resize((columns * rows) as usize, [0; BLOCK_LANES]);
        for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            let prims = self.hits.block(column, row).prim;
            for (lane, prim) in prims.into_iter().enumerate() {
                let (x, y) = (column * 4 + lane as u32 % 4, row * 4 + lane as u32 / 4);
                let sees = prim != u32::MAX && x < tile.width && y < tile.height;
                if !sees || facets.facet(prim) <= 0.0 {
                    continue;
                }
                let (x, y) = (tile.x + x, tile.y + y);
                let ray = job.view.pixel_ray(x, y);
                let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim));
                if let Some(hit) = hit {
                    self.receivers.push(Receiver::along(&ray, hit.t, prim));
                    self.pixels.push(sample_set(x, y));
                    self.places.push([(row * columns + column) as usize, lane]);
                }
            }
        }
    }
}
