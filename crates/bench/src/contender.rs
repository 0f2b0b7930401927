//! What all contenders are asked to do.

use glam::{DVec3, Vec3};
use rayward::trace::{AreaLight, Facets, Light, Samples, SimdLevel, View};

use crate::packet::{LANES, Lanes};
use crate::{BenchScene, Picture, Result, Time};

/// What a frame consists of, besides shading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameKind {
    /// Closest hits of all pixels.
    Eye,
    /// And one shadow ray to a light from every hit that is turned towards it.
    EyeHard,
    /// And shadow rays to [`SOFT_SAMPLES`] points of an area light from every hit that is turned towards its light.
    EyeSoft,
}

impl FrameKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Eye, Self::EyeHard, Self::EyeSoft];

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Eye => "eye",
            Self::EyeHard => "eye+hard",
            Self::EyeSoft => "eye+soft8",
        }
    }
}

/// Shadow rays of a hit in soft shadows.
pub const SOFT_SAMPLES: u32 = 8;

/// Side of the square of pixels after which sets of samples repeat, so that peers can have them in a table.
pub(crate) const PATTERN: u32 = 64;

/// The pixel whose set of samples pixel (x, y) uses.
#[inline]
pub(crate) fn sample_set(x: u32, y: u32) -> u32 {
    y % PATTERN * PATTERN + x % PATTERN
}

/// Points of an area light: for each block of the pattern and each sample, of sixteen pixels.
pub(crate) type LightPoints = Vec<[[Lanes<f32>; 3]; SOFT_SAMPLES as usize]>;

/// A frame to draw.
#[derive(Debug)]
pub struct Job<'s> {
    /// The scene.
    pub scene: &'s BenchScene,
    /// Its camera's raster.
    pub view: View,
    /// Its light.
    pub light: Light,
    /// Its area light.
    pub area: AreaLight,
    /// Points of it by pixel.
    pub samples: Samples,
    /// These points in a table, for those who do not make them as they go.
    pub(crate) points: LightPoints,
    /// What is asked for.
    pub kind: FrameKind,
    /// Instruction set of our kernels.
    pub level: SimdLevel,
}

impl<'s> Job<'s> {
    /// A frame of a scene.
    ///
    /// # Errors
    /// What [`BenchScene::view`] says.
    pub fn new(scene: &'s BenchScene, size: [u32; 2], kind: FrameKind, level: SimdLevel) -> Result<Self> {
        let (area, samples) = (scene.area_light(), Samples::new(SOFT_SAMPLES, 1));
        Ok(Self {
            scene,
            view: scene.view(size[0], size[1])?,
            light: scene.light(),
            area,
            samples,
            points: match kind {
                FrameKind::EyeSoft => light_points(&area, &samples),
                _ => Vec::new(),
            },
            kind,
            level,
        })
    }

    /// A point in the plane of the area light.
    pub(crate) fn area_center(&self) -> Vec3 {
        let [x, y, z] = self.points[0][0].map(|v| v[0]);
        Vec3::new(x, y, z)
    }

    /// The shading of this frame; all contenders shade by the same code, and each does it anew in every frame.
    pub(crate) fn facets(&self) -> Facets<'s> {
        Facets::new(self.view, self.light, self.scene.triangles(), self.level)
            .with_clusters(&self.scene.clusters)
    }
}

/// All points of a rectangle, which are the same for every receiver of a pixel.
fn light_points(area: &AreaLight, samples: &Samples) -> LightPoints {
    let blocks = PATTERN / 4;
    let block = |block: u32| {
        let corner = [block % blocks * 4, block / blocks * 4];
        std::array::from_fn(|k| {
            let ends: [[f32; 3]; LANES] = std::array::from_fn(|lane| {
                let pixel = sample_set(corner[0] + lane as u32 % 4, corner[1] + lane as u32 / 4);
                let end = area.sample(samples, pixel, DVec3::ZERO, k as u32);
                let (Light::Point(end) | Light::Directional(end)) = end;
                end.to_array()
            });
            std::array::from_fn(|axis| ends.map(|end| end[axis]))
        })
    };
    (0..blocks * blocks).map(block).collect()
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
