//! Files and time in, frame geometry out.
//!
//! A [`Scene`] is what a file says: a node hierarchy, meshes, materials, textures, skins, animations, cameras
//! and lights. [`Scene::at`] poses it at a time and yields the [`FrameGeometry`] of one frame: flat world-space
//! triangles as a structure of arrays, relative to an f64 origin, and the posed cameras and lights.
//!
//! This crate knows nothing of rays. Units: metres, radians, seconds; right-handed, +Y up (files with another
//! up axis are turned when read, see [`LoadOptions`]).

pub mod builtin;
mod camera_file;
mod defaults;
mod error;
mod frame;
mod load;
mod material;
mod pose;
mod scene;
mod solid;

pub use camera_file::{
    AreaLight, CameraEntry, find_camera, point_light_for, read_camera_file, square_light_at,
};
pub use defaults::{DEFAULT_AMBIENT, default_camera, default_lights};
pub use error::{Error, Notice};
pub use frame::{FrameGeometry, ObjectRange, PosedCamera, PosedLight, VertexAttributes};
pub use load::{LoadOptions, UpAxis, load};
pub use material::{
    AlphaMode, Anisotropy, Coat, Image, Iridescence, Material, Sampler, Sheen, TextureRef, TextureTransform,
    Wrap,
};
pub use pose::ObjectMotion;
pub use scene::{
    Animation, Camera, Channel, ChannelTarget, Interpolation, Light, LightKind, Mesh, MorphTarget, Node,
    Primitive, Projection, Scene, Skin, Transform,
};
pub use solid::{PosedSolid, Shape, Solid};
