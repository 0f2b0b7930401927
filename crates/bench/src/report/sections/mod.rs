//! What each measurement has to say, as sections of a report.

mod ablation;
mod build;
mod frames;
mod scaling;
mod structures;
mod tables;

pub use ablation::ablation;
pub use build::build;
pub use frames::frames;
pub use scaling::scaling;
pub use structures::structures;
pub use tables::tables;
