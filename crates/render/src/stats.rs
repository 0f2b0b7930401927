//! What a frame cost.

use std::time::Duration;

use crate::LightStats;

/// Counts and times of one frame.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct FrameStats {
    /// Triangles in the frame.
    pub triangles: usize,
    /// Triangles left out because a corner was not finite.
    pub dropped_non_finite: usize,
    /// Triangles left out because they had no area.
    pub dropped_degenerate: usize,
    /// Solids in the frame.
    pub solids: usize,
    /// The structures built for this frame.
    pub structures: Vec<StructureStats>,
    /// Eye rays traced: one a pixel, or as many as were asked for.
    pub eye_rays: u64,
    /// Shadow rays asked for: one for each sample of a light that a surface faces, the environment's included.
    pub shadow_rays: u64,
    /// Rays that surfaces sent to others: reflected, transmitted, diffused.
    pub secondary_rays: u64,
    /// Pixels whose closest triangle was decided by exact arithmetic.
    pub exact_pixels: u64,
    /// Shadow rays answered by the nearest distance of their cell alone.
    pub lit_by_cell: u64,
    /// Shadow rays that end in shadow by what covers their cell whole, without a test.
    pub dark_by_cell: u64,
    /// Surfaces made for pixels; with HM08's parameters one for each time that a closer one was found.
    pub surfaces: u64,
    /// How the shadows of each light were found.
    pub lights: Vec<LightStats>,
    /// Wall time of all builds.
    pub build: Duration,
    /// Wall time of all tiles: tracing and shading.
    pub trace: Duration,
}

/// Cost of one structure.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StructureStats {
    /// What it is for.
    pub name: String,
    /// Wall time of its build.
    pub build: Duration,
    /// Bytes it holds.
    pub bytes: usize,
    /// Cells, or nodes of a hierarchy.
    pub cells: usize,
    /// References from cells to triangles.
    pub references: usize,
}
