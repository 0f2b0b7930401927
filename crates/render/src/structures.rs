//! Builds what the plan says, and times it.

use std::sync::Arc;
use std::time::Instant;

use rayward_scene::FrameGeometry;
use rayward_trace::{
    AreaLightGrid, AreaLightTree, Casts, Clusters, EyeGrid, EyeVeils, Light, LightQuery, LitPixels,
    LitScratch, PointLightGrid, PointLightTree, Receiver, SimdLevel, Tile, Triangles, View, Visibility,
};

use crate::casters::CasterRules;
use crate::costs::Measured;
use crate::geometry::triangles;
use crate::light_stats::Passed;
use crate::plan::{FramePlan, LightPlan};
use crate::reference::EveryTriangle;
use crate::secondary::{SecondaryBuilder, SecondaryTracer};
use crate::tile::TileCounts;
use crate::{CasterPolicy, RenderOptions, ShadowStructure, StructureStats};

/// All structures of one frame.
#[derive(Debug)]
pub struct FrameStructures<'g> {
    /// The camera's grid.
    pub eye: EyeGrid<'g>,
    /// What the camera sees, if the lights were asked for all of it at once.
    pub visibility: Option<Visibility>,
    /// One entry a light, as in the plan.
    pub lights: Vec<LightShadows<'g>>,
    /// The camera's grid over masked and blended triangles; `None` without such.
    pub veils: Option<EyeVeils<'g>>,
    /// One entry a light: its grid over masked and blended triangles, if there are any and it has one end.
    pub light_veils: Vec<Option<PointLightGrid<'g>>>,
    /// A structure of all triangles, for lights with a size where there are masked or blended ones.
    pub layers: Option<Arc<dyn SecondaryTracer + 'g>>,
    /// The same, for rays that leave surfaces; `None` if nothing sends any.
    pub secondary: Option<Arc<dyn SecondaryTracer + 'g>>,
    /// The same, for the light of solids; `None` without such.
    pub others: Option<Arc<dyn SecondaryTracer + 'g>>,
    /// The same, if what all pixels see and their shadows are asked of it.
    pub arrays: Option<Arc<dyn SecondaryTracer + 'g>>,
    /// What is asked of again, to tell what rays cost.
    pub(crate) measured: Option<Measured<'g>>,
    /// Whether any triangle is masked or blended.
    pub transparent: bool,
    /// Working memory of lights whose shadows are found for all pixels.
    pub scratch: LitScratch,
    /// What each structure cost.
    pub stats: Vec<StructureStats>,
}

/// How the shadows of a light are found.
#[derive(Debug)]
pub enum LightShadows<'g> {
    /// It casts none.
    Nothing,
    /// Point by point in its grid.
    Grid(PointLightGrid<'g>),
    /// Point by point in its tree, and what was passed in it.
    Tree(PointLightTree<'g>, Passed),
    /// For all pixels at once, before they are shaded.
    Pixels(LitPixels),
    /// By samples of its area.
    Area(AreaLightTree<'g>),
    /// The same through a 3-D grid, as in the paper.
    AreaGrid(Box<AreaLightGrid<'g>>),
    /// By samples of its area, asked of the structure that takes arrays.
    Asked,
    /// By every triangle, for references.
    Reference,
}

impl<'g> FrameStructures<'g> {
    /// Builds all structures; each build uses all threads. `scratch` is working memory of an earlier frame. Where every pixel
    /// shows one surface, lights are done one after the other, so that memory does not grow with their number but for a bit a
    /// pixel.
    pub fn build(
        plan: &FramePlan,
        view: View,
        geometry: &'g FrameGeometry,
        clusters: &'g Clusters,
        rules: &CasterRules<'g>,
        eye_point: Light,
        options: &RenderOptions,
        (builder, mut scratch): (&'g dyn SecondaryBuilder, LitScratch),
    ) -> Self {
        let triangles = triangles(geometry);
        let mut stats = Timed::default();
        // Layers behind each other are receivers of their own, and the paper looks each ray up.
        let hard = |plan: &Option<LightPlan>| plan.as_ref().is_some_and(LightPlan::at_once);
        let slowly = rules.any_transparent() || options.paper || options.reference;
        let at_once = plan.lights.iter().any(hard) && !slowly;
        let soft = plan.lights.iter().flatten().any(|plan| plan.area.is_some());
        let through = (soft || options.reference) && rules.any_transparent();
        // It knows of no triangles that cast by one side alone.
        let arrays = builder.takes_arrays() && !slowly && options.casters() != CasterPolicy::Back;
        let costs = options.layers.cost;
        let any = through || plan.secondary || arrays || costs || !geometry.solids.is_empty();
        let general = any.then(|| general(triangles, options, builder, &mut stats));
        let asked = general.as_deref().filter(|_| arrays);

        let grid = || eye_grid(plan, view, geometry, clusters, rules, options.level);
        let (eye, visibility) = look_first(asked, plan, view, at_once, grid, options, &mut stats);

        let (mut lights, mut light_veils) = (Vec::new(), Vec::new());
        for (i, plan) in plan.lights.iter().enumerate() {
            let Some(plan) = plan else {
                lights.push(LightShadows::Nothing);
                light_veils.push(None);
                continue;
            };
            if options.reference {
                lights.push(LightShadows::Reference);
                light_veils.push(None);
                continue;
            }
            let name = name_of(plan, i);
            let start = Instant::now();
            let shadows = shadows_of(
                plan,
                visibility.as_ref(),
                (geometry, clusters),
                rules,
                eye_point,
                (options.level, &mut scratch),
                asked,
            );
            stats.0.push(shadows.stats(&name, start));
            lights.push(shadows);
            let has_veils = rules.any_transparent() && plan.area.is_none();
            light_veils.push(has_veils.then(|| {
                stats.build(
                    &format!("light grid of veils {name}"),
                    || veils_before(plan, geometry, rules, options.level),
                    |grid| [grid.bytes(), grid.cell_count(), grid.reference_count()],
                )
            }));
        }

        let veils = (rules.any_transparent() && !options.reference).then(|| {
            let is_veil = |prim| rules.is_transparent(prim);
            stats.build(
                "eye veils",
                || EyeVeils::build(view, triangles, is_veil, options.level),
                |veils| [veils.bytes(), veils.cell_count(), veils.reference_count()],
            )
        });
        let measured = measured(general.clone(), plan, geometry, rules, options);
        Self {
            eye,
            visibility,
            measured,
            lights,
            veils,
            light_veils,
            layers: general.clone().filter(|_| through),
            transparent: rules.any_transparent(),
            secondary: general.clone().filter(|_| plan.secondary),
            others: general.clone().filter(|_| !geometry.solids.is_empty()),
            arrays: general.filter(|_| arrays),
            scratch,
            stats: stats.0,
        }
    }

    /// Builds something else beside these structures and notes its cost; `size` is its bytes, cells and references.
    pub(crate) fn timed<T>(
        &mut self,
        name: &str,
        build: impl FnOnce() -> T,
        size: impl FnOnce(&T) -> [usize; 3],
    ) -> T {
        let mut stats = Timed(std::mem::take(&mut self.stats));
        let built = stats.build(name, build, size);
        self.stats = stats.0;
        built
    }

    /// Looks again with another view of the same camera: all that depends on it is built anew, and not timed.
    pub(crate) fn look(
        &mut self,
        view: View,
        plan: &FramePlan,
        geometry: &'g FrameGeometry,
        clusters: &'g Clusters,
        rules: &CasterRules<'g>,
        eye_point: Light,
        options: &RenderOptions,
    ) {
        let level = options.level;
        let grid = || eye_grid(plan, view, geometry, clusters, rules, level);
        let (asked, at_once) = (self.arrays.as_deref(), self.visibility.is_some());
        let mut untold = Timed::default();
        let seen = look_first(asked, plan, view, at_once, grid, options, &mut untold);
        (self.eye, self.visibility) = seen;
        if self.veils.is_some() {
            let is_veil = |prim| rules.is_transparent(prim);
            self.veils = Some(EyeVeils::build(view, triangles(geometry), is_veil, level));
        }
        if self.visibility.is_none() {
            return;
        }
        let scratch = &mut self.scratch;
        for (plan, shadows) in plan.lights.iter().zip(&mut self.lights) {
            if let (Some(plan), LightShadows::Pixels(_)) = (plan, &shadows) {
                let seen = self.visibility.as_ref();
                let geometry = (geometry, clusters);
                let asked = self.arrays.as_deref();
                let with = (level, &mut *scratch);
                *shadows = shadows_of(plan, seen, geometry, rules, eye_point, with, asked);
            }
        }
    }

    /// What was counted before the tiles.
    pub(crate) fn counts(&self) -> TileCounts {
        let mut counts = TileCounts {
            exact_pixels: self.visibility.as_ref().map_or(0, Visibility::exact_pixels),
            ..TileCounts::default()
        };
        for light in &self.lights {
            if let LightShadows::Pixels(lit) = light {
                counts.shadow_rays += lit.counts.receivers;
                counts.lit_by_cell += lit.counts.untested;
            }
        }
        counts
    }

    /// Triangle seen by pixel (x, y) of a tile, if all tiles have been traced.
    #[inline]
    pub(crate) fn seen(&self, tile: &Tile, x: u32, y: u32) -> Option<Option<u32>> {
        self.visibility.as_ref().map(|v| v.prim(tile.index, x, y))
    }
}

/// Structures built so far.
#[derive(Default)]
struct Timed(Vec<StructureStats>);

impl Timed {
    /// Builds one more; `size` is its bytes, cells and references.
    fn build<T>(&mut self, name: &str, build: impl FnOnce() -> T, size: impl FnOnce(&T) -> [usize; 3]) -> T {
        let start = Instant::now();
        let built = build();
        let [bytes, cells, references] = size(&built);
        self.0.push(StructureStats {
            name: name.into(),
            build: start.elapsed(),
            bytes,
            cells,
            references,
        });
        built
    }
}

/// Builds the camera's grid over what is opaque.
fn eye_grid<'g>(
    plan: &FramePlan,
    view: View,
    geometry: &'g FrameGeometry,
    clusters: &'g Clusters,
    rules: &CasterRules,
    level: SimdLevel,
) -> EyeGrid<'g> {
    let triangles = triangles(geometry);
    if plan.eye.hierarchy {
        return EyeGrid::build_clustered(view, triangles, clusters, plan.eye, level);
    }
    let opaque = |prim| !rules.is_transparent(prim);
    EyeGrid::build_of(view, triangles, opaque, plan.eye, level)
}

/// What a light is called: its own name, or its number.
fn name_of(plan: &LightPlan, number: usize) -> String {
    if plan.name.is_empty() {
        number.to_string()
    } else {
        format!("{:?}", plan.name)
    }
}

/// Traces the tiles that are to be rendered.
fn look_around(eye: &EyeGrid, options: &RenderOptions) -> Visibility {
    Visibility::trace_some(eye, &|tile| options.renders(tile), &|_, _| ())
}

/// The camera's grid, and what all pixels see: if a structure that takes arrays tells, or else if it is wanted at once.
fn look_first<'g>(
    asked: Option<&dyn SecondaryTracer>,
    plan: &FramePlan,
    view: View,
    at_once: bool,
    grid: impl FnOnce() -> EyeGrid<'g>,
    options: &RenderOptions,
    stats: &mut Timed,
) -> (EyeGrid<'g>, Option<Visibility>) {
    if let Some(tracer) = asked {
        let ask = || ask_around(tracer, plan, view, options);
        let size = |seen: &Option<(_, Visibility)>| [seen.as_ref().map_or(0, |s| s.1.bytes()), 0, 0];
        if let Some((eye, visibility)) = stats.build("visibility", ask, size) {
            return (eye, Some(visibility));
        }
    }
    let eye = stats.build("eye grid", grid, |eye| {
        [eye.bytes(), eye.tile_count() as usize, eye.reference_count()]
    });
    let visibility = at_once.then(|| {
        let trace = || look_around(&eye, options);
        stats.build("visibility", trace, |visibility| [visibility.bytes(), 0, 0])
    });
    (eye, visibility)
}

/// What the camera sees by a structure that takes arrays, and a grid of no triangles that has the tiles; `None` if it does
/// not answer.
fn ask_around<'g>(
    tracer: &dyn SecondaryTracer,
    plan: &FramePlan,
    view: View,
    options: &RenderOptions,
) -> Option<(EyeGrid<'g>, Visibility)> {
    let nothing = Triangles::new(&[], &[], &[], &[]);
    let eye = EyeGrid::build_of(view, nothing, |_| true, plan.eye, options.level);
    let seen = |pixels: &[[u32; 2]]| tracer.seen(&view, pixels);
    let visibility = Visibility::asked(&eye, &|tile| options.renders(tile), seen)?;
    Some((eye, visibility))
}

/// Builds the structure for all other rays.
fn general<'g>(
    triangles: Triangles<'g>,
    options: &RenderOptions,
    builder: &'g dyn SecondaryBuilder,
    stats: &mut Timed,
) -> Arc<dyn SecondaryTracer + 'g> {
    if options.reference {
        return Arc::new(EveryTriangle(triangles));
    }
    let start = Instant::now();
    let built = builder.build(triangles);
    stats.0.push(StructureStats {
        name: built.name.into(),
        build: start.elapsed(),
        bytes: built.bytes,
        cells: built.cells,
        references: built.references,
    });
    built.tracer
}

/// The grid of a light over masked and blended triangles.
fn veils_before<'g>(
    plan: &LightPlan,
    geometry: &'g FrameGeometry,
    rules: &CasterRules,
    level: SimdLevel,
) -> PointLightGrid<'g> {
    let rule = |prim| {
        if rules.is_transparent(prim) {
            Casts::Both
        } else {
            Casts::Nothing
        }
    };
    PointLightGrid::build(plan.light, triangles(geometry), &rule, plan.grid, level)
}

/// What is asked of again where costs are to be told, with the grids of all lights without a size.
fn measured<'g>(
    general: Option<Arc<dyn SecondaryTracer + 'g>>,
    plan: &FramePlan,
    geometry: &'g FrameGeometry,
    rules: &CasterRules<'g>,
    options: &RenderOptions,
) -> Option<Measured<'g>> {
    let any = general.filter(|_| options.layers.cost)?;
    let points = plan.lights.iter().flatten().filter(|plan| plan.area.is_none());
    let grid = |plan: &LightPlan| {
        let rule = rules.for_light(geometry, &plan.light);
        PointLightGrid::build(plan.light, triangles(geometry), &rule, plan.grid, options.level)
    };
    let lights = points.map(grid).collect();
    Some(Measured { any, lights })
}

/// Builds what tells the shadows of one light.
fn shadows_of<'g>(
    plan: &LightPlan,
    visibility: Option<&Visibility>,
    (geometry, clusters): (&'g FrameGeometry, &Clusters),
    rules: &CasterRules<'g>,
    eye: Light,
    (level, scratch): (SimdLevel, &mut LitScratch),
    asked: Option<&(dyn SecondaryTracer + 'g)>,
) -> LightShadows<'g> {
    let triangles = triangles(geometry);
    if let Some(area) = plan.area {
        if asked.is_some() {
            return LightShadows::Asked;
        }
        let rule = rules.for_area(geometry, &area);
        if let Some(cells) = &plan.soft_grid {
            let grid = AreaLightGrid::build(area, triangles, &rule, cells);
            return LightShadows::AreaGrid(Box::new(grid));
        }
        let tree = AreaLightTree::build(area, triangles, &rule, level);
        return LightShadows::Area(tree.with_topology(rules.topology()));
    }
    let rule = rules.for_light(geometry, &plan.light);
    match visibility.filter(|_| plan.at_once()) {
        Some(visibility) => {
            let query = LightQuery {
                light: plan.light,
                cone: plan.grid.cone,
                eye,
                rule: &rule,
            };
            let asked = asked.and_then(|tracer| {
                let shadowed = |receivers: &[Receiver]| tracer.shadowed(receivers, &plan.light);
                LitPixels::asked(visibility, &triangles, &query, shadowed)
            });
            let find = || LitPixels::find(visibility, &triangles, clusters, &query, level, scratch);
            LightShadows::Pixels(asked.unwrap_or_else(find))
        }
        None if plan.structure == ShadowStructure::Tree => {
            let tree = PointLightTree::build(plan.light, triangles, &rule, plan.grid.cone, level);
            LightShadows::Tree(tree, Passed::default())
        }
        None if plan.dark_cells => {
            let (light, topology) = (plan.light, rules.topology());
            let grid =
                PointLightGrid::build_with_topology(light, triangles, topology, &rule, plan.grid, level);
            LightShadows::Grid(grid)
        }
        None => LightShadows::Grid(PointLightGrid::build(
            plan.light, triangles, &rule, plan.grid, level,
        )),
    }
}

impl LightShadows<'_> {
    fn stats(&self, name: &str, start: Instant) -> StructureStats {
        let (what, bytes, cells, references) = match self {
            Self::Nothing | Self::Asked | Self::Reference => ("no shadows", 0, 0, 0),
            Self::Grid(grid) => (
                "light grid",
                grid.bytes(),
                grid.cell_count(),
                grid.reference_count(),
            ),
            Self::Tree(tree, _) => ("light tree", tree.bytes(), tree.node_count(), tree.caster_count()),
            Self::Pixels(LitPixels { counts, .. }) => (
                "receiver grid",
                counts.bytes,
                counts.light_tiles as usize,
                counts.references as usize,
            ),
            Self::Area(tree) => (
                "area light tree",
                tree.bytes(),
                tree.node_count(),
                tree.reference_count(),
            ),
            Self::AreaGrid(grid) => (
                "area light grid",
                grid.bytes(),
                grid.cell_count(),
                grid.reference_count(),
            ),
        };
        StructureStats {
            name: format!("{what} {name}"),
            build: start.elapsed(),
            bytes,
            cells,
            references,
        }
    }
}
