//! Posing a scene at a time.
use crate::{FrameGeometry, Scene};

impl Scene {
    /// The frame at `time` seconds.
    pub fn at(&self, _time: f32) -> FrameGeometry {
        FrameGeometry::default()
    }
}
