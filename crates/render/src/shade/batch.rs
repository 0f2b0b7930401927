//! Shading of arrays: hits in, surfaces out; surfaces and the light that reaches them in, what they send to the viewer out.
//!
//! It is the seam for what would rather have arrays than single points, as a GPU does:
//!
//! ```text
//! hits --surfaces--> Surface of each --who sees which light, which rays go on--> beams --lit--> radiance of each surface
//! ```
//!
//! Both are functions of their arguments alone. [`CpuShading`] defines them by the code that frames use without such; another
//! may round differently, nothing more. Whoever fails answers `None`, and is stood in for.
//!
//! Cost of [`CpuShading`]: that of the functions it calls. A [`Beam`] takes 60 bytes.

use std::fmt::Debug;
use std::sync::Arc;

use glam::Vec3;
use rayward_scene::FrameGeometry;
use rayward_trace::Light;

use super::{Shader, ShadingLight, Surface, SurfacePoint, Traced};
use super::{around, direct, lobes_lit, reflected_beside};

/// Light that reaches a surface from somewhere: nothing is left to be asked about what lies in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Index of the surface.
    pub surface: u32,
    /// Share of it that arrives; of a sample, over the number of samples.
    pub share: Vec3,
    /// Where it comes from.
    pub source: Source,
}

/// Where the light of a [`Beam`] comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// What needs no light: emission, and a surrounding of this radiance as far as no lobe is traced ([`super::around`]).
    Around {
        /// Radiance of the surrounding.
        radiance: Vec3,
        /// Lobes that see what is really there.
        traced: Traced,
    },
    /// The light of this index, at its place ([`super::direct`]).
    Light(u32),
    /// A sample of the light of this index, beside rays of reflections that see it, too.
    Sample {
        /// Index of the light.
        light: u32,
        /// Where the sample is.
        end: Light,
        /// Samples per steradian in its direction; not asked for where no rays are drawn.
        density: f32,
        /// Rays of the surface's own reflection and of its coat's that see the light.
        drawn: [u32; 2],
    },
    /// The environment in a direction drawn from it.
    Direction {
        /// Unit direction.
        towards: Vec3,
        /// Radiance from there.
        radiance: Vec3,
        /// Directions per steradian drawn there.
        density: f32,
        /// Rays drawn from the surface's reflection, its coat's, and of diffuse light; 0 of what is not traced.
        drawn: [u32; 3],
    },
}

/// Shades arrays of points of one frame. Frames ask it for no surface with a [`super::SurfaceFinish`], nor for its light.
pub trait SurfaceShader: Debug + Send + Sync {
    /// The surfaces at these points, as [`Shader::surface`] has them.
    fn surfaces(&self, points: &[SurfacePoint]) -> Option<Vec<Surface>>;

    /// Sum of what each surface sends to its viewer of the light of its beams.
    fn lit(&self, surfaces: &[Surface], beams: &[Beam]) -> Option<Vec<Vec3>>;
}

/// Makes such for each frame.
pub trait ShadingBuilder: Debug + Send + Sync {
    /// For a frame of the scene it was made for, and its lights. `None` if it cannot: it tells its maker why.
    fn build<'g>(
        &'g self,
        geometry: &'g FrameGeometry,
        lights: &[ShadingLight],
    ) -> Option<Arc<dyn SurfaceShader + 'g>>;
}

/// The CPU's own shading as one of arrays.
#[derive(Clone, Copy, Debug)]
pub struct CpuShading<'a> {
    /// Materials and textures.
    pub shader: &'a Shader<'a>,
    /// The frame.
    pub geometry: &'a FrameGeometry,
    /// Its lights.
    pub lights: &'a [ShadingLight],
}

impl CpuShading<'_> {
    /// As [`SurfaceShader::surfaces`].
    pub fn surfaces(&self, points: &[SurfacePoint]) -> Vec<Surface> {
        points
            .iter()
            .map(|point| self.shader.surface(self.geometry, point))
            .collect()
    }

    /// As [`SurfaceShader::lit`].
    pub fn lit(&self, surfaces: &[Surface], beams: &[Beam]) -> Vec<Vec3> {
        let mut sums = vec![Vec3::ZERO; surfaces.len()];
        for beam in beams {
            let at = beam.surface as usize;
            sums[at] += self.sent(&surfaces[at], &beam.source) * beam.share;
        }
        sums
    }

    /// What a surface sends on of the whole of a source.
    fn sent(&self, surface: &Surface, source: &Source) -> Vec3 {
        let light = |index: u32| &self.lights[index as usize];
        let incident = match *source {
            Source::Around { radiance, traced } => return around(surface, radiance, traced),
            Source::Light(index) => direct(surface, light(index)),
            Source::Sample {
                light: index,
                end,
                density,
                drawn,
            } => light(index)
                .incident_beside(&end, surface.position)
                .filter(|_| !surface.unlit)
                .and_then(|incident| reflected_beside(surface, incident, density, drawn)),
            Source::Direction {
                towards,
                radiance,
                density,
                drawn,
            } => return radiance * lobes_lit(surface, towards, density, drawn),
        };
        incident.map_or(Vec3::ZERO, |incident| incident.radiance)
    }
}

impl SurfaceShader for CpuShading<'_> {
    fn surfaces(&self, points: &[SurfacePoint]) -> Option<Vec<Surface>> {
        Some(self.surfaces(points))
    }

    fn lit(&self, surfaces: &[Surface], beams: &[Beam]) -> Option<Vec<Vec3>> {
        Some(self.lit(surfaces, beams))
    }
}
