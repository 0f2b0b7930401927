//! Procedural scenes of our own: stand-ins for the test scenes of HM08 (Table 1) with their triangle counts and
//! character, so that pictures, tests and benchmarks need no files.
//!
//! Each scene has its cameras and lights, is made of seeded and constant numbers only, and is the same at every
//! call. Units: metres, seconds. Cost: below 0.2 s each.
//!
//! | name | triangles | character |
//! |---|---|---|
//! | `courtyard` | 31k | arcades on two storeys around a fountain; even triangle sizes; a figure walks across in 4 s |
//! | `forest` | 174k | trees, mushrooms, grass, animals, a fairy; huge range of triangle sizes; all of it moves, 4 s |
//! | `office` | 1k | desks, chairs and cabinets of large triangles |
//! | `conference` | 282k | a long table with thirty upholstered chairs; walls of two triangles |
//! | `blob-1k` .. `blob-69k` | 980, 3,920, 15,680, 69,620 | one organic surface |
//! | `collide` | 252k | two organic surfaces, one slides against the other and back in 4 s |
//! | `teapot-mirror` | 16k | a teapot and balls on a mirror |
//! | `walker` | 1.7k | a skinned figure walks on the spot, 1 s |
//! | `solids` | 1.1k | spheres, capsules, boxes and what is made of them, between triangles; some of it moves, 4 s |
//!
//! All but `forest` consist of closed 2-manifolds with outward faces that share no edge with each other, also when
//! their frames are welded; parts overlap where they are joined.

mod blob;
mod conference;
mod courtyard;
mod figure;
mod forest;
mod office;
mod plants;
mod random;
mod shapes;
mod solids;
mod stage;
mod statue;
mod teapot;
mod walker;

use crate::{Error, Scene};

/// Names of all built-in scenes. The first is the default of the command line.
pub const NAMES: &[&str] = &[
    "courtyard",
    "forest",
    "office",
    "conference",
    "blob-1k",
    "blob-4k",
    "blob-16k",
    "blob-69k",
    "collide",
    "teapot-mirror",
    "walker",
    "solids",
];

/// The scene `blob-*` of any size: one organic surface of `20 * frequency^2` triangles.
pub fn blob_of(frequency: u32) -> Scene {
    blob::blob("blob", frequency)
}

/// Makes a built-in scene.
///
/// # Errors
/// [`Error::UnknownBuiltin`] with the names that exist.
pub fn build(name: &str) -> Result<Scene, Error> {
    Ok(match name {
        "courtyard" => courtyard::courtyard(),
        "forest" => forest::forest(),
        "office" => office::office(),
        "conference" => conference::conference(),
        "blob-1k" => blob::blob(name, 7),
        "blob-4k" => blob::blob(name, 14),
        "blob-16k" => blob::blob(name, 28),
        "blob-69k" => blob::blob(name, 59),
        "collide" => blob::collide(),
        "teapot-mirror" => teapot::teapot_mirror(),
        "walker" => walker::walker(),
        "solids" => solids::solids(),
        _ => {
            return Err(Error::UnknownBuiltin {
                name: name.into(),
                known: NAMES.join(", "),
            });
        }
    })
}
