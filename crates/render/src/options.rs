//! What is asked of a frame, as plain data.

use glam::Vec3;
use rayward_trace::{SimdLevel, Tile};

use crate::{Layers, Lens, PixelFilter, Shard};

/// Parameters of a frame. `..RenderOptions::default()` gives a full HD picture with shadows.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// Whether lights cast shadows.
    pub shadows: bool,
    /// Which sides of triangles cast them.
    pub casters: CasterPolicy,
    /// What finds the hard shadows of lights without a size. The picture does not depend on it.
    pub shadow_structure: ShadowStructure,
    /// Whether blended surfaces colour the light they let through; they dim it otherwise.
    pub tinted_shadows: bool,
    /// Radiance that surrounds the scene, for surfaces that no light reaches: none by default, and
    /// [`rayward_scene::Scene::ambient`] to see a scene as it is meant. An environment takes its place.
    pub ambient: Vec3,
    /// Radiance where no surface is seen.
    pub background: Vec3,
    /// Whether an environment is seen behind everything; the background is if not. Reflections see it either way.
    pub show_environment: bool,
    /// Directions to the environment drawn for each surface that a pixel sees.
    pub environment_samples: u32,
    /// Longest chain of reflections and refractions; 0 traces none.
    pub bounces: u32,
    /// How many of these may be diffuse, for light from other surfaces.
    pub diffuse_bounces: u32,
    /// Eye rays a pixel, whose mean it is: as many frames, or with a lens or a shutter distributed rays, see
    /// [`crate::Renderer::render_shutter`].
    pub pixel_samples: u32,
    /// How many of them are shaded.
    pub antialias: Antialias,
    /// How they lie about the pixel, but for distributed rays.
    pub pixel_filter: PixelFilter,
    /// The lens of the camera; `None` is a pinhole, before which all is sharp.
    pub lens: Option<Lens>,
    /// Samples of a light with a size, and of a glossy reflection, for each surface a pixel sees: from 1 to [`rayward_trace::MAX_SAMPLES`].
    pub samples: u32,
    /// Chooses the samples. The same seed gives the same picture.
    pub seed: u32,
    /// Layers to keep besides the colour.
    pub layers: Layers,
    /// The share of the picture that is rendered; all of it unless given. Pixels of other shares see nothing.
    pub shard: Option<Shard>,
    /// The literal parameters of HM08: 100 x 100 tiles, 200 x 200 light grids, binning by bounding rectangle,
    /// back faces alone as casters, surfaces shaded each time that a closer one is found, lights with a size shaded from
    /// their middle times the share of samples seen.
    pub paper: bool,
    /// Every ray answered by testing every triangle in f64: the same picture, slowly, to check structures against.
    pub reference: bool,
    /// Instruction set of the kernels; the picture does not depend on it.
    pub level: SimdLevel,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            width: 1920,
            height: 1080,
            shadows: true,
            casters: CasterPolicy::Auto,
            shadow_structure: ShadowStructure::Auto,
            tinted_shadows: false,
            ambient: Vec3::ZERO,
            background: Vec3::new(0.44, 0.54, 0.68),
            show_environment: true,
            environment_samples: 16,
            bounces: 8,
            diffuse_bounces: 0,
            pixel_samples: 1,
            antialias: Antialias::Samples,
            pixel_filter: PixelFilter::default(),
            lens: None,
            samples: 8,
            seed: 0,
            layers: Layers::default(),
            shard: None,
            paper: false,
            reference: false,
            level: SimdLevel::detect(),
        }
    }
}

/// Which of a pixel's samples are shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Antialias {
    /// All.
    #[default]
    Samples,
    /// Of those that see one smooth surface in the same hard light the first. Edges, also of hard shadows, are as smooth; what
    /// is drawn by chance is as noisy as with one sample. Not with a lens, a shutter, HM08's parameters, for references, or
    /// with a structure of casters for all shadows.
    Coverage,
}

/// Which sides of triangles cast shadows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CasterPolicy {
    /// Back faces of closed components that hold neither the eye nor the light, both sides of the rest: the
    /// same shadows as `Both`, at a lower cost.
    #[default]
    Auto,
    /// Both sides of all.
    Both,
    /// Back faces of all, as in HM08: wrong shadows where surfaces are open.
    Back,
}

/// What finds the hard shadows of a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShadowStructure {
    /// What is predicted to cost the least ([`rayward_trace::ShadowCosts`]); HM08's grid with its parameters.
    #[default]
    Auto,
    /// All that the eye sees, sorted into the light's raster, over which casters are drawn
    /// ([`rayward_trace::LitPixels`]). A grid where pixels may see several surfaces behind each other, or with HM08's
    /// parameters.
    Receivers,
    /// A grid of casters ([`rayward_trace::PointLightGrid`]).
    Grid,
    /// A hierarchy of casters ([`rayward_trace::PointLightTree`]).
    Tree,
}

impl RenderOptions {
    /// Whether any pixel of a tile is to be rendered.
    pub(crate) fn renders(&self, tile: &Tile) -> bool {
        let size = [tile.width, tile.height];
        self.shard
            .is_none_or(|shard| shard.has_any([tile.x, tile.y], size))
    }

    /// How many pixels are rendered.
    pub(crate) fn pixels(&self) -> u64 {
        let (width, height) = (self.width, self.height);
        let all = u64::from(width) * u64::from(height);
        self.shard.map_or(all, |shard| shard.pixels(width, height))
    }

    /// The part of a pixel's width by which textures are filtered. Each of several shaded samples stands for a part of the
    /// pixel only, and the mean of all filters the rest; not below an eighth, so that distant textures stay in the cache
    /// (Pharr, Jakob and Humphreys, *Physically Based Rendering*, 4th ed., §10.1, has the same bounds).
    pub fn footprint_share(&self) -> f32 {
        match self.antialias {
            // One sample is shaded for all.
            Antialias::Coverage => 1.0,
            Antialias::Samples => (self.pixel_samples.max(1) as f32).sqrt().recip().max(0.125),
        }
    }

    /// The policy in force: the papers' parameters bring their own.
    pub(crate) fn casters(&self) -> CasterPolicy {
        if self.paper {
            CasterPolicy::Back
        } else {
            self.casters
        }
    }
}
