//! What all contenders are asked to do.

use rayward::trace::{Facets, Light, SimdLevel, View};

use crate::{BenchScene, Picture, Time};

/// What a frame consists of, besides shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameKind {
    /// Closest hits of all pixels.
    Eye,
    /// And one shadow ray from every hit to a light.
    EyeHard,
}

impl FrameKind {
    /// All kinds.
    pub const ALL: [Self; 2] = [Self::Eye, Self::EyeHard];

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Eye => "eye",
            Self::EyeHard => "eye+hard",
        }
    }
}

/// A frame to draw.
#[derive(Debug)]
pub struct Job<'s> {
    /// The scene.
    pub scene: &'s BenchScene,
    /// Its camera's raster.
    pub view: View,
    /// Its light.
    pub light: Light,
    /// What is asked for.
    pub kind: FrameKind,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
}

impl<'s> Job<'s> {
    /// The shading of this frame; all contenders shade by the same code, and each does it anew in every frame.
    pub(crate) fn facets(&self) -> Facets<'s> {
        Facets::new(self.view, self.light, self.scene.triangles(), self.level)
    }
}

/// Somebody who draws frames of one scene.
pub trait Contender {
    /// Name, for tables.
    fn name(&self) -> String;

    /// What the structures took that are kept between frames; `None` if there are none.
    fn build(&self) -> Option<Time>;

    /// Whether it differs from another contender only in frames with shadows.
    fn only_shadows(&self) -> bool {
        false
    }

    /// Draws a frame on the threads of the current rayon pool; gives the number of shadow rays.
    fn draw(&self, job: &Job, picture: &mut Picture) -> u64;
}
