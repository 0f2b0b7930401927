//! One frame, in the papers' order: plan, structures, tiles, image.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use rayward_scene::{FrameGeometry, PosedCamera, PosedLight, Scene};
use rayward_trace::{Clusters, Topology};

use crate::casters::{CasterRules, transparent_triangles};
use crate::distributed::{self, Shutter};
use crate::geometry::triangles;
use crate::plan::FramePlan;
use crate::structures::FrameStructures;
use crate::tile::{TileCounts, TileShader, TileWork};
use crate::{CameraFrame, Film, FrameStats, RenderOptions, Result, Shader, ShadingLight};

/// Renders frames of one scene. Keeps what outlives a frame: materials, textures, the topology and clusters.
#[derive(Debug)]
pub struct Renderer<'s> {
    scene: &'s Scene,
    shader: Shader<'s>,
    topology: Option<(Vec<[u32; 3]>, Topology, Clusters)>,
}

/// A rendered frame.
#[derive(Clone, Debug)]
pub struct RenderedFrame {
    /// The picture and its layers.
    pub film: Film,
    /// What it cost.
    pub stats: FrameStats,
}

/// How far a frame has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
            topology: None,
        }
    }

    /// Renders one frame on the threads of the current rayon pool. The picture is the same for any number of
    /// threads and any instruction set. `progress` is told after each tile, from any thread.
    ///
    /// # Errors
    /// [`crate::Error::ImageSize`] and [`crate::Error::Camera`].
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
        if options.pixel_samples > 1 || options.lens.is_some() {
            let still = Shutter { geometry, camera };
            return self.render_shutter(geometry, camera, still, lights, options, progress);
        }
        let camera = CameraFrame::new(camera, geometry.origin, options.width, options.height)?;
        let mut film = Film::new(options.width, options.height, options.layers)?;
        let view = camera.view(geometry);
        let start = Instant::now();
        self.update_topology(geometry);
        let (_, topology, clusters) = self.topology.as_ref().expect("just updated");
        let eye = (!camera.orthographic).then(|| camera.eye.as_dvec3());
        let rules = CasterRules::new(self.scene, geometry, topology, options.casters(), eye);

        let plan = FramePlan::new(geometry, lights, options);
        let eye = camera.vantage();
        let structures = FrameStructures::build(&plan, view, geometry, clusters, &rules, eye, options);
        let build = start.elapsed();

        let start = Instant::now();
        let shading_lights: Vec<_> = lights
            .iter()
            .map(|l| ShadingLight::new(l, geometry.origin))
            .collect();
        let shader = TileShader {
            shader: &self.shader,
            geometry,
            camera: &camera,
            lights: &shading_lights,
            ends: &plan.lights,
            structures: &structures,
            eye: camera.vantage(),
            options,
        };
        let side = structures.eye.tile_side();
        let mut tiles = film.tiles_mut(side, side);
        let (done, total) = (AtomicU64::new(0), tiles.len() as u64);
        let counts = tiles
            .par_iter_mut()
            .enumerate()
            .map_init(TileWork::default, |work, (index, out)| {
                let counts = shader.render(index as u32, work, out);
                progress(Progress {
                    done: done.fetch_add(1, Ordering::Relaxed) + 1,
                    total,
                });
                counts
            })
            .reduce(TileCounts::default, TileCounts::sum);
        drop(tiles);
        let counts = structures.counts().sum(counts);

        let stats = FrameStats {
            triangles: geometry.triangle_count(),
            dropped_non_finite: geometry.dropped_non_finite,
            dropped_degenerate: geometry.dropped_degenerate,
            structures: structures.stats,
            eye_rays: u64::from(options.width) * u64::from(options.height),
            shadow_rays: counts.shadow_rays,
            exact_pixels: counts.exact_pixels,
            lit_by_cell: counts.lit_by_cell,
            build,
            trace: start.elapsed(),
        };
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
        let opening = (geometry, camera);
        distributed::render(
            (self.scene, &self.shader),
            opening,
            shutter,
            lights,
            options,
            progress,
        )
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
