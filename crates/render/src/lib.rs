//! Ray tracing and visibility on the CPU, without ray tracing hardware: one structure for every camera and
//! light, rebuilt every frame.
//!
//! Units: metres, radians, candela, lux; right-handed, +Y up; row 0 of every image on top; linear colours with
//! the primaries of sRGB until the tone map.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use rayward::{RenderOptions, Renderer, ToneMap, ToneMapper, image_io, scene};
//!
//! fn main() -> rayward::Result<()> {
//!     // A file: scene::load(Path::new("model.glb"), &scene::LoadOptions::default())?
//!     let scene = scene::builtin::build("courtyard")?;
//!     let frame = scene.at(1.5); // seconds
//!     let ambient = scene.ambient;
//!     let options = RenderOptions { width: 640, height: 360, ambient, ..RenderOptions::default() };
//!
//!     let mut renderer = Renderer::new(&scene);
//!     let rendered = renderer.render(&frame, &frame.cameras[0], &frame.lights, &options, &|_progress| {})?;
//!
//!     let rgb = ToneMapper::new(ToneMap::None).encode(&rendered.film);
//!     image_io::write_png(Path::new("courtyard.png"), options.width, options.height, &rgb)
//! }
//! ```

mod bounce;
mod camera;
mod casters;
pub mod compare;
mod costs;
mod distributed;
pub mod environment;
mod error;
mod film;
mod frame;
mod gather;
mod geometry;
mod heat_map;
pub mod image_io;
mod lens;
mod light_stats;
mod mean;
mod motion;
mod options;
mod pixel_filter;
mod pixel_samples;
mod plan;
mod reference;
mod secondary;
pub mod shade;
mod shard;
mod solids;
mod stats;
mod structures;
pub mod texture;
mod tile;
pub mod tonemap;

pub use camera::CameraFrame;
pub use casters::CasterRules;
pub use compare::{CompareOptions, Comparison, compare};
pub use costs::PixelCost;
pub use distributed::Shutter;
pub use environment::Environment;
pub use error::{Error, Result};
pub use film::{Film, LayerKind, Layers, NO_ID, Sample, TileMut};
pub use frame::{Progress, RenderedFrame, Renderer};
pub use geometry::{shadow_end, triangles};
pub use heat_map::{HeatMap, Measure};
pub use image_io::{Picture, read_picture};
pub use lens::Lens;
pub use light_stats::{LightStats, LightSteps};
pub use motion::{Moment, add_motion};
pub use options::{Antialias, CasterPolicy, RenderOptions, ShadowStructure};
pub use pixel_filter::PixelFilter;
pub use plan::{FramePlan, LightPlan};
pub use secondary::{
    BuiltTracer, CubeBuilder, HierarchyBuilder, SecondaryBuilder, SecondaryTracer, SurfaceHit,
};
pub use shade::{
    Beam, CpuShading, Incident, Shader, ShadingBuilder, ShadingLight, Source, Surface, SurfacePoint,
    SurfaceShader,
};
pub use shard::{Part, Shard};
pub use solids::solids;
pub use stats::{FrameStats, StructureStats};
pub use structures::{FrameStructures, LightShadows};
pub use tonemap::{IntensityRange, ToneMap, ToneMapper};

pub use rayward_scene as scene;
pub use rayward_trace as trace;
