//! Rays in, hits out.
//!
//! | rays | structure | source |
//! |---|---|---|
//! | eye rays of one camera | [`EyeGrid`] | HM08 §5.1 |
//! | hard shadow rays of one light, from all that the eye sees | [`LitPixels`] | HM08 §5.2, turned round |
//! | hard shadow rays of one light, from any points | [`PointLightGrid`] | HM08 §5.2 |
//! | the same where casters are of many sizes | [`PointLightTree`] | HM08 §5.2, in a hierarchy |
//! | rays that nearly share an origin, and any other | [`PerspectiveGrids`] | HM08 §5.3 |
//! | the same at any time of a shutter | [`MovingGrids`] | HM08 §5.1 |
//! | soft shadow rays of one light | [`AreaLightTree`] | HM08 §5.3, in a hierarchy |
//! | the same as in the paper | [`AreaLightGrid`] | HM08 §5.3 |
//! | any ray, at spheres, cylinders, capsules, boxes and what is made of them | [`solids::SolidGrids`] | HM08 §3 |
//! | eye rays of one camera at such solids | [`solids::EyeSolids`] | HM08 §5.1 |
//! | eye rays through masked and blended triangles | [`EyeVeils`] | HM08 §5.1 |
//! | shadow rays through them | [`PointLightGrid::each_between`] | HM08 §5.2 |
//! | any ray | [`Bvh`] | general hierarchy |
//! | any ray | [`Grid3`] in world space | the regular grid of HM08, Table 5 |
//! | any ray | [`Ldc`] | VMV07 |
//! | any ray, by definition right | [`BruteForce`] | [`exact`] |
//!
//! All of them give the same answers, bit for bit: whether a ray meets a triangle is one exact decision
//! ([`exact`]), and the vector kernels only filter the cases that are certain. No structure here ever fails or
//! prints; builders take any floats and drop and count what is not finite or has no area.
//!
//! Positions are f32 in one local frame (the caller keeps its f64 origin). Units are the caller's.

mod accel;
mod area_grid;
mod area_light;
mod area_tree;
mod bins;
pub mod brute;
pub mod bvh;
mod clusters;
mod determinant;
pub mod exact;
mod eye_grid;
mod eye_veils;
mod faces;
mod facets;
mod grid3;
mod kernel;
pub mod ldc;
mod light_costs;
mod light_grid;
mod light_tree;
mod light_views;
mod moving;
mod perspective_grids;
mod precise;
mod queries;
mod ray;
mod receiver_grid;
mod samples;
pub mod solids;
pub mod space;
mod surface_ray;
#[cfg(test)]
mod test_meshes;
pub mod topology;
mod triangles;
pub mod view;
mod visibility;

pub use accel::{Accel, BuildStats, Count, Counters};
pub use area_grid::AreaLightGrid;
pub use area_light::AreaLight;
pub use area_tree::{AreaCounts, AreaLightTree, AreaScratch, SeenTile, TileSamples};
pub use bins::Binning;
pub use brute::BruteForce;
pub use bvh::{Bvh, Node as BvhNode};
pub use clusters::Clusters;
pub use eye_grid::{EyeCounts, EyeGrid, EyeGridOptions, Tile, TileHits};
pub use eye_veils::{EyeVeils, TileVeils, VeilHit};
pub use faces::FaceOptions;
pub use facets::{BLOCK_LANES, Facets, HitBlocks, darken, darken_unlit};
pub use grid3::{Grid3, RaySpan};
pub use kernel::SimdLevel;
pub use kernel::tile::BlockPixels;
pub use ldc::{Ldc, LdcOptions};
pub use light_costs::ShadowCosts;
pub use light_grid::{
    CastRule, Casts, Cone, LightCell, LightGridOptions, MAX_RESOLUTION, PointLightGrid, ShadowCounts,
    ShadowScratch,
};
pub use light_tree::{PointLightTree, TreeSteps};
pub use light_views::views_of_light;
pub use moving::{MovingAt, MovingGrids, MovingTriangles, Vertices};
pub use perspective_grids::PerspectiveGrids;
pub use queries::Candidates;
pub use ray::{Hit, Light, Ray, Receiver};
pub use receiver_grid::{LightQuery, LitCounts, LitPixels, LitScratch};
pub use samples::{MAX_SAMPLES, Samples, sequence_point};
pub use surface_ray::SurfaceRay;
pub use topology::Topology;
pub use triangles::Triangles;
pub use view::{View, ViewRay};
pub use visibility::Visibility;
