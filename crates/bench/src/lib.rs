//! Measures Rayward beside other ray tracers: the same picture first, then times.
//!
//! A frame is closest hits of all pixels, shadow rays where the kind of frame has them, and n . l shading to 8 bits.
//! Rayward builds every structure anew in every frame; the others keep theirs, and what these cost to build is
//! told apart and never counted. Every contender draws the frame once before any is timed, and the pictures are
//! compared: a contender whose picture differs in more than a stated share of the pixels gets no times.
//!
//! | what | module |
//! |---|---|
//! | frames of scenes, all contenders | [`frames`] |
//! | cost against triangles, pixels, lights, samples and more | [`scaling`] |
//! | binning rate, and what a second thread brings | [`build`] |
//! | each improvement taken away | [`ablation`] |
//! | any structure for any class of rays | [`structures`] |
//! | the papers' tables and claims | [`tables`], [`steps`], [`cubes`] |
//! | all of it as a page, as Markdown and as text | [`report`] |
//!
//! Times are of the whole process, as processor time and as wall time; where the system does not tell the
//! former, it is the latter. Runs of all contenders are interleaved, and a figure is a median with its range. This
//! crate prints nothing.

pub mod ablation;
pub mod all;
pub mod build;
pub mod claims;
mod clock;
pub mod contender;
pub mod cubes;
mod embree;
mod error;
pub mod frames;
mod machine;
mod ours;
mod packet;
mod papers;
mod peers;
mod picture;
mod pictures;
pub mod report;
pub mod scaling;
mod scene;
mod stats;
pub mod steps;
pub mod structures;
pub mod table;
pub mod tables;
mod workers;

pub use clock::{Stopwatch, Time};
pub use contender::FrameKind;
pub use error::{Error, Result};
pub use machine::Machine;
pub use picture::{Difference, Picture};
pub use scene::{BenchScene, all_scenes};
pub use stats::{Spread, Times};
