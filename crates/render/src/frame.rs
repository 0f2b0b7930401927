//! One frame, in the papers' order: plan, structures, tiles, image.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayward_scene::{FrameGeometry, PosedCamera, PosedLight, Scene};
use rayward_trace::{Clusters, LitScratch, Topology};

use crate::casters::{CasterRules, transparent_triangles};
use crate::distributed::{self, Shutter};
use crate::gather::{self, Gather};
use crate::geometry::triangles;
use crate::light_stats::light_stats;
use crate::plan::FramePlan;
use crate::reference::EveryTriangle;
use crate::secondary::{HierarchyBuilder, SecondaryBuilder, SecondaryTracer};
use crate::shard::{Ingredients, Part};
use crate::solids::{self, FrameSolids};
use crate::structures::FrameStructures;
use crate::tile::coverage::Sharing;
use crate::tile::{TileCounts, TileShader};
use crate::{
    CameraFrame, Environment, Film, FrameStats, RenderOptions, Result, Shader, ShadingBuilder, ShadingLight,
    SurfaceShader,
};

/// Renders frames of one scene. Keeps what outlives a frame: materials, textures, the topology and clusters.
#[derive(Debug)]
pub struct Renderer<'s> {
    scene: &'s Scene,
    shader: Shader<'s>,
    environment: Option<Environment>,
    secondary: Arc<dyn SecondaryBuilder>,
    shading: Option<Arc<dyn ShadingBuilder>>,
    topology: Option<(Vec<[u32; 3]>, Topology, Clusters)>,
    /// Working memory of the last frame.
    scratch: LitScratch,
}

/// A rendered frame.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RenderedFrame {
    /// The picture and its layers.
    pub film: Film,
    /// What it cost.
    pub stats: FrameStats,
}

/// How far a frame has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Tiles done.
    pub done: u64,
    /// Tiles of the frame.
    pub total: u64,
}

impl<'s> Renderer<'s> {
    /// A renderer for this scene; prepares its materials and textures.
    pub fn new(scene: &'s Scene) -> Self {
        Self {
            scene,
            shader: Shader::new(scene),
            environment: None,
            secondary: Arc::new(HierarchyBuilder),
            shading: None,
            topology: None,
            scratch: LitScratch::default(),
        }
    }

    /// Lights the scene with an environment, or with the ambient light of the options again.
    pub fn set_environment(&mut self, environment: Option<Environment>) {
        self.environment = environment;
    }

    /// Has another structure answer rays from anywhere to anywhere. Frames with a lens or a shutter have none.
    pub fn set_secondary(&mut self, builder: Arc<dyn SecondaryBuilder>) {
        self.secondary = builder;
    }

    /// Has arrays of surfaces shaded by something else, made for [`Self::shader`], or by the CPU again. Frames with a lens or a
    /// shutter, HM08's parameters or a reference are shaded by the CPU.
    pub fn set_shading(&mut self, builder: Option<Arc<dyn ShadingBuilder>>) {
        self.shading = builder;
    }

    /// Materials and textures of the scene.
    pub fn shader(&self) -> &Shader<'s> {
        &self.shader
    }

    /// Renders one frame on the threads of the current rayon pool. The picture is the same for any number of
    /// threads and any instruction set. `progress` is told after each tile, from any thread.
    ///
    /// # Errors
    /// [`crate::Error::ImageSize`], [`crate::Error::Camera`] and [`crate::Error::Antialias`].
    ///
    /// # Panics
    /// If the geometry is not of the renderer's scene.
    pub fn render(
        &mut self,
        geometry: &FrameGeometry,
        camera: &PosedCamera,
        lights: &[PosedLight],
        options: &RenderOptions,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<RenderedFrame> {
        if options.lens.is_some() {
            let still = Shutter { geometry, camera };
            return self.render_shutter(geometry, camera, still, lights, options, progress);
        }
        gather::check(options, false)?;
        let posed = camera;
        let camera = CameraFrame::new(posed, geometry.origin, options.width, options.height)?;
        let mut film = Film::new(options.width, options.height, options.layers)?;
        let view = camera.view(geometry);
        let start = Instant::now();
        self.update_topology(geometry);
        let (_, topology, clusters) = self.topology.as_ref().expect("just updated");
        let eye = (!camera.orthographic).then(|| camera.eye.as_dvec3());
        let rules = CasterRules::new(self.scene, geometry, topology, options.casters(), eye);

        let environment = self.environment.as_ref();
        let plan = FramePlan::new(geometry, lights, options)
            .with_secondary(self.scene, geometry, environment.is_some(), options)
            .with_shadow_structures(geometry, &rules, self.secondary.takes_arrays(), options);
        let eye = camera.vantage();
        let samples = options.pixel_samples.max(1);
        let shifted = |sample: u32| view.shifted(options.pixel_filter.offset(sample));
        let sharing = || Sharing::new(self.scene, geometry, options);
        let mut gather = Gather::new(options, &film, sharing)?;
        let order = gather.order(options);
        let first = shifted(order[0]);
        let with = (&*self.secondary, std::mem::take(&mut self.scratch));
        let mut structures =
            FrameStructures::build(&plan, first, geometry, clusters, &rules, eye, options, with);
        let shapes = solids::solids(geometry);
        let mut solids = FrameSolids::of_frame(&shapes, geometry, first, &plan, options, &mut structures);
        let build = start.elapsed();

        let start = Instant::now();
        let shading_lights: Vec<_> = lights
            .iter()
            .map(|l| ShadingLight::new(l, geometry.origin))
            .collect();
        let shading = shading(self.shading.as_deref(), geometry, &shading_lights, options);
        let total = u64::from(structures.eye.tile_count()) * u64::from(samples);
        let done = AtomicU64::new(0);
        let told = || {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress(Progress { done, total });
        };
        let mut counts = TileCounts::default();
        for &sample in &order {
            if sample != order[0] {
                structures.look(shifted(sample), &plan, geometry, clusters, &rules, eye, options);
                solids = solids.map(|solids| solids.looking(shifted(sample)));
            }
            let shader = TileShader {
                shader: &self.shader,
                geometry,
                camera: &camera,
                lights: &shading_lights,
                ends: &plan.lights,
                structures: &structures,
                solids: solids.as_ref(),
                eye,
                environment,
                secondary: structures
                    .secondary
                    .as_deref()
                    .map(|all| all as &dyn SecondaryTracer),
                shading: shading.as_deref(),
                reference: options.reference.then(|| EveryTriangle(triangles(geometry))),
                sample,
                options,
            };
            counts = counts.sum(gather.render(&shader, &mut film, &told));
            counts = counts.sum(structures.counts());
        }
        gather.finish(&mut film, structures.eye.tile_side());
        self.mark(&mut film, geometry, posed, None, lights, options);
        let mut stats = stats(geometry, options, counts);
        stats.lights = light_stats(&plan, &structures.lights);
        stats.structures = std::mem::take(&mut structures.stats);
        self.scratch = std::mem::take(&mut structures.scratch);
        (stats.build, stats.trace) = (build, start.elapsed());
        Ok(RenderedFrame { film, stats })
    }

    /// As [`Self::render`], with a shutter that is open from the time of `geometry` and `camera` to that of `shutter`:
    /// what moves is blurred. Lights stand still. Each pixel is the mean of [`RenderOptions::pixel_samples`] rays.
    ///
    /// # Errors
    /// As [`Self::render`].
    ///
    /// # Panics
    /// If one of the two geometries is not of the renderer's scene.
    pub fn render_shutter(
        &mut self,
        geometry: &FrameGeometry,
        camera: &PosedCamera,
        shutter: Shutter,
        lights: &[PosedLight],
        options: &RenderOptions,
        progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<RenderedFrame> {
        gather::check(options, true)?;
        let opening = (geometry, camera);
        let mut rendered = distributed::render(
            (self.scene, &self.shader),
            opening,
            shutter,
            lights,
            options,
            progress,
        )?;
        self.mark(
            &mut rendered.film,
            geometry,
            camera,
            Some(shutter),
            lights,
            options,
        );
        Ok(rendered)
    }

    /// Has a film know which part of which picture it is, if not all of it was asked for.
    fn mark(
        &self,
        film: &mut Film,
        geometry: &FrameGeometry,
        camera: &PosedCamera,
        shutter: Option<Shutter>,
        lights: &[PosedLight],
        options: &RenderOptions,
    ) {
        let Some(shard) = options.shard else { return };
        let ingredients = Ingredients {
            scene: self.scene,
            geometry,
            camera,
            shutter,
            lights,
            environment: self.environment.as_ref(),
            options,
        };
        let picture = ingredients.checksum();
        film.become_part(Part { shard, picture });
    }

    /// Finds the components and clusters anew only where the triangles are others than in the last frame.
    fn update_topology(&mut self, geometry: &FrameGeometry) {
        let triangles = triangles(geometry);
        match &mut self.topology {
            Some((indices, topology, _)) if *indices == geometry.indices => topology.update(&triangles),
            other => {
                // What is transparent is seen through a grid of its own.
                let transparent = transparent_triangles(self.scene, geometry);
                let opaque = |prim: u32| transparent.get(prim as usize) != Some(&true);
                *other = Some((
                    geometry.indices.clone(),
                    Topology::analyse(&triangles),
                    Clusters::of(&triangles, opaque),
                ));
            }
        }
    }
}

/// What shades arrays of a frame, if it is not shaded one by one, as the papers' frames and references are.
fn shading<'g>(
    builder: Option<&'g dyn ShadingBuilder>,
    geometry: &'g FrameGeometry,
    lights: &[ShadingLight],
    options: &RenderOptions,
) -> Option<Arc<dyn SurfaceShader + 'g>> {
    let one_by_one = options.paper || options.reference;
    builder.filter(|_| !one_by_one)?.build(geometry, lights)
}

/// What was counted.
fn stats(geometry: &FrameGeometry, options: &RenderOptions, counts: TileCounts) -> FrameStats {
    FrameStats {
        triangles: geometry.triangle_count(),
        dropped_non_finite: geometry.dropped_non_finite,
        dropped_degenerate: geometry.dropped_degenerate,
        solids: geometry.solids.len(),
        eye_rays: options.pixels() * u64::from(options.pixel_samples.max(1)),
        shadow_rays: counts.shadow_rays,
        secondary_rays: counts.secondary_rays,
        exact_pixels: counts.exact_pixels,
        lit_by_cell: counts.lit_by_cell,
        dark_by_cell: counts.dark_by_cell,
        surfaces: counts.surfaces,
        ..FrameStats::default()
    }
}
