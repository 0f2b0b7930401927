//! Builds what the plan says, and times it.

use std::time::Instant;

use rayward_scene::FrameGeometry;
use rayward_trace::{Bvh, Clusters, EyeGrid, PointLightGrid, View};

use crate::casters::{CasterRules, triangles};
use crate::plan::FramePlan;
use crate::{RenderOptions, StructureStats};

/// All structures of one frame.
#[derive(Debug)]
pub struct FrameStructures<'g> {
    /// The camera's grid.
    pub eye: EyeGrid<'g>,
    /// One entry a light, as in the plan.
    pub lights: Vec<Option<PointLightGrid<'g>>>,
    /// A hierarchy of all triangles, for rays that pass through masked and blended ones; `None` without such.
    pub layers: Option<Bvh<'g>>,
    /// What each structure cost.
    pub stats: Vec<StructureStats>,
}

impl<'g> FrameStructures<'g> {
    /// Builds all structures; each build uses all threads.
    pub fn build(
        plan: &FramePlan,
        view: View,
        geometry: &'g FrameGeometry,
        clusters: &'g Clusters,
        rules: &CasterRules,
        options: &RenderOptions,
    ) -> Self {
        let triangles = triangles(geometry);
        let mut stats = Vec::new();

        let start = Instant::now();
        let eye = if plan.eye.hierarchy {
            EyeGrid::build_clustered(view, triangles, clusters, plan.eye, options.level)
        } else {
            EyeGrid::build(view, triangles, plan.eye, options.level)
        };
        stats.push(StructureStats {
            name: "eye grid".into(),
            build: start.elapsed(),
            bytes: eye.bytes(),
            cells: eye.tile_count() as usize,
            references: eye.reference_count(),
        });

        let mut lights = Vec::with_capacity(plan.lights.len());
        for (i, plan) in plan.lights.iter().enumerate() {
            let Some(plan) = plan else {
                lights.push(None);
                continue;
            };
            let start = Instant::now();
            let rule = rules.for_light(geometry, &plan.light);
            let grid = PointLightGrid::build(plan.light, triangles, &rule, plan.grid, options.level);
            let name = if plan.name.is_empty() {
                i.to_string()
            } else {
                format!("{:?}", plan.name)
            };
            stats.push(StructureStats {
                name: format!("light grid {name}"),
                build: start.elapsed(),
                bytes: grid.bytes(),
                cells: grid.cell_count(),
                references: grid.reference_count(),
            });
            lights.push(Some(grid));
        }

        let layers = rules.any_transparent().then(|| {
            let start = Instant::now();
            let bvh = Bvh::build(triangles);
            stats.push(StructureStats {
                name: "hierarchy behind transparent surfaces".into(),
                build: start.elapsed(),
                bytes: bvh.bytes(),
                cells: 0,
                references: bvh.stats().triangles,
            });
            bvh
        });
        Self {
            eye,
            lights,
            layers,
            stats,
        }
    }
}
