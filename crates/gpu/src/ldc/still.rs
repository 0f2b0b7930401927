//! What stands still keeps its cube on the device: `trace/src/ldc/still.rs`, built there.

use std::sync::Arc;

use rayward_trace::Triangles;
use rayward_trace::ldc::Stillness;

use super::build::usable;
use super::{Cube, CubeOptions, Stacks};
use crate::{Gpu, PosedVertices, Result};

/// Builds the cubes of a row of frames.
#[derive(Debug, Default)]
pub struct StillCube {
    stillness: Stillness,
    kept: Option<Arc<Stacks>>,
}

impl StillCube {
    /// The cube or cubes of the next frame; answers are those of [`Cube::build`]. All frames are to be built on one device
    /// and with the same options.
    ///
    /// # Errors
    /// Those of the device.
    pub fn build<'a>(
        &mut self,
        gpu: &'a Gpu,
        triangles: Triangles<'a>,
        options: &CubeOptions,
    ) -> Result<Cube<'a>> {
        self.next(gpu, triangles, options, None)
    }

    /// The same over triangles of these vertices, which come from where they were posed.
    ///
    /// # Errors
    /// Those of the device.
    ///
    /// # Panics
    /// If an index is beyond the last vertex.
    pub fn build_posed<'a>(
        &mut self,
        posed: &'a PosedVertices<'a>,
        indices: &'a [[u32; 3]],
        options: &CubeOptions,
    ) -> Result<Cube<'a>> {
        self.next(posed.gpu(), posed.triangles(indices), options, Some(posed))
    }

    fn next<'a>(
        &mut self,
        gpu: &'a Gpu,
        triangles: Triangles<'a>,
        options: &CubeOptions,
        posed: Option<&PosedVertices>,
    ) -> Result<Cube<'a>> {
        let more = self.stillness.follow(&triangles);
        let (prims, stats) = usable(&triangles);
        let [still, moving] = self.stillness.split(prims);
        let mut rebuilt = moving.len();
        if more || still.is_empty() {
            // Not two of them at a time.
            self.kept = None;
        }
        if !still.is_empty() && self.kept.is_none() {
            rebuilt += still.len();
            self.kept = Some(Arc::new(Stacks::build(gpu, &triangles, &still, options, posed)?));
        }
        let mut stacks: Vec<Arc<Stacks>> = self.kept.iter().cloned().collect();
        if !moving.is_empty() || stacks.is_empty() {
            let resolution = self.kept.as_ref().map_or(options.resolution, |kept| {
                kept.frame.resolution_of(&triangles, &moving)
            });
            let options = CubeOptions {
                resolution,
                ..*options
            };
            stacks.push(Arc::new(Stacks::build(
                gpu, &triangles, &moving, &options, posed,
            )?));
        }
        Ok(Cube {
            gpu,
            triangles,
            stacks,
            stats,
            rebuilt,
        })
    }
}
