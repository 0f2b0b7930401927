//! Images in and out of files.
//!
//! | format | written | read | values |
//! |---|---|---|---|
//! | APNG, GIF | movies: 8 bit RGB, 256 colours | | sRGB encoded |
//! | MP4, `WebM`, MKV | movies, by an installed `ffmpeg` | | sRGB encoded |
//! | PNG | 8 bit RGB, tagged sRGB | 8 and 16 bit, all colour types | sRGB encoded |
//! | JPEG | | 8 bit | sRGB encoded |
//! | EXR | all layers of a film, f32 and u32, ZIP; parts of a picture | those parts; R, G, B, A or Y of the first part that has them | linear |
//! | NPY | one layer of a film | `(h, w)`, `(h, w, 1..=4)`; bool, integers, floats | linear; `u1` sRGB encoded |
//! | HDR | | RGBE | linear |
//! | PFM | | both endians | linear |
//!
//! Row 0 is on top in memory, whatever the file says. Writers fill a temporary file beside the target and rename
//! it: a file is there as a whole or not at all. Readers know a format by its first bytes, and believe no size
//! before the file is long enough for it.

mod exr;
mod file;
mod movie;
mod npy;
mod parts;
mod pfm;
mod picture;
mod png;

pub use exr::{encode_exr, write_exr};
pub use file::{Discarded, discard_unfinished, remove_abandoned, write_bytes};
pub use movie::{MovieOptions, is_movie, write_movie};
pub use npy::{encode_npy, write_npy};
pub use parts::join_parts;
pub use picture::{Picture, read_picture, read_picture_up_to};
pub use png::{encode_png, write_png};
