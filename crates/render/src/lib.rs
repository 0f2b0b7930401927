//! Ray tracing and visibility on the CPU, without ray tracing hardware: one structure for every camera and
//! light, rebuilt every frame.
//!
//! Units: metres, radians, candela, lux; right-handed, +Y up; row 0 of every image on top; linear colours with
//! the primaries of sRGB until the tone map.

mod camera;
pub mod compare;
mod error;
mod film;
pub mod image_io;
pub mod shade;
pub mod texture;
pub mod tonemap;

pub use camera::CameraFrame;
pub use compare::{CompareOptions, Comparison, compare};
pub use error::{Error, Result};
pub use film::{Film, LayerKind, Layers, NO_ID, Sample, TileMut};
pub use image_io::{Picture, read_picture};
pub use shade::{Incident, Shader, ShadingLight, Surface, SurfacePoint};
pub use tonemap::{IntensityRange, ToneMap, ToneMapper};
