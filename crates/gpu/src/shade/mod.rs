//! [`GpuShading`]: surfaces of frames and the light they send, worked out on a device.
//!
//! `attributes.wgsl` and `texture.wgsl` make surfaces of hits: interpolated attributes, textures as glTF's samplers prescribe,
//! normal maps. `lit.wgsl` and `brdf.wgsl` add up what surfaces send of the light that reaches them. Both are defined by
//! [`CpuShading`](rayward::CpuShading) and agree with it but for the rounding of f32, hence so do pictures. Which rays go on
//! from a surface, and what lies between it and a light, is asked and answered as ever: the device says what a surface is like,
//! and all rays that start from it are traced exactly.
//!
//! WebGPU has no arrays of textures of any size and filters as each device likes. So the texels of all levels of all images lie
//! one after the other in a single array texture, which has no limit of 128 MiB, and are read one by one and filtered by
//! arithmetic.
//!
//! Layout: 4 bytes a texel; a frame takes 32 bytes a triangle and 12 to 72 a vertex. A surface is 160 bytes each way, a beam
//! 64. Cost: two submissions a tile, and two more for each wave of rays from it. Limits: attributes of all vertices in one
//! binding, 1.8 million vertices if they have all of them; 2^32 texels; 32,768 beams of a surface. Texture coordinates that are not
//! finite show any texel. On the CPU remain: surfaces with a film, sheen or anisotropy and their light, surfaces of solids,
//! directions and radiance of an environment, lights as mirrors show them, and frames with a lens or a shutter as a whole.

pub(crate) mod layout;
mod rows;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, PoisonError};

use bytemuck::Pod;
use glam::Vec3;
use rayward::scene::FrameGeometry;
use rayward::texture::Texture;
use rayward::tonemap::decode_srgb8;
use rayward::{Beam, Shader, ShadingBuilder, ShadingLight, Surface, SurfacePoint, SurfaceShader};
use wgpu::{BindingResource, Buffer};

use crate::ldc::build::groups;
use crate::ldc::shaders::{LIT, SURFACES};
use crate::{Error, Gpu, GpuSecondary, Result};
use layout::{BeamRow, Level, Lit, Material, Row, Shading, Use};

/// Points of one submission: few enough that no driver takes it for a hang.
const BATCH: usize = 1 << 16;
/// Beams of one.
const BEAMS: usize = 1 << 18;
/// Beams of one surface, which one thread adds up: Mesa's software driver leaves loops after some 65,000 rounds.
const MOST_BEAMS: u32 = 1 << 15;

/// What a device has shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadeStats {
    /// Surfaces made of hits.
    pub surfaces: u64,
    /// Beams of light added up.
    pub beams: u64,
}

/// Shades frames of one scene on a device.
#[derive(Debug)]
pub struct GpuShading {
    device: Arc<GpuSecondary>,
    materials: Buffer,
    uses: Buffer,
    levels: Buffer,
    texels: wgpu::TextureView,
    done: Mutex<Done>,
}

#[derive(Debug, Default)]
struct Done {
    stats: ShadeStats,
    problem: Option<Error>,
}

impl GpuShading {
    /// Sends the materials and textures of a scene to the device on which its rays are traced.
    ///
    /// # Errors
    /// Those of the device; [`Error::Limits`] if the textures do not fit.
    pub fn new(device: &Arc<GpuSecondary>, shader: &Shader) -> Result<Self> {
        let gpu = device.gpu();
        let pyramids = shader.textures().pyramids();
        let mut levels = Vec::new();
        let mut images = Vec::new();
        let mut pieces: Vec<&[[u8; 4]]> = Vec::new();
        let mut texels = 0u64;
        for pyramid in pyramids {
            images.push([levels.len() as u32, pyramid.levels.len() as u32]);
            for level in &pyramid.levels {
                levels.push(Level {
                    width: level.width,
                    height: level.height,
                    first: texels as u32,
                    pad: 0,
                });
                texels += level.texels.len() as u64;
                pieces.push(&level.texels);
            }
        }
        let mut uses: Vec<Use> = Vec::new();
        let mut number = |texture: Option<&Texture>| {
            texture.map_or(rows::NOTHING, |texture| {
                let encoding = pyramids[texture.pyramid].encoding;
                uses.push(rows::image_use(texture, encoding, images[texture.pyramid]));
                uses.len() as u32 - 1
            })
        };
        let materials: Vec<Material> = shader
            .materials()
            .iter()
            .map(|material| rows::material(material, material.textures().map(&mut number)))
            .collect();
        Ok(Self {
            materials: gpu.uploaded("materials", &filled(materials))?,
            uses: gpu.uploaded("uses of textures", &filled(uses))?,
            levels: gpu.uploaded("levels of textures", &filled(levels))?,
            texels: gpu.texels("textures", &pieces, texels)?,
            device: Arc::clone(device),
            done: Mutex::default(),
        })
    }

    /// What was shaded on the device since this was made.
    pub fn stats(&self) -> ShadeStats {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).stats
    }

    /// The first error. From then on the CPU has shaded.
    pub fn problem(&self) -> Option<Error> {
        let done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        done.problem.clone()
    }

    /// Notes how an operation went.
    fn noted<T>(&self, result: Result<T>, more: impl FnOnce(&mut ShadeStats)) -> Option<T> {
        let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
        match result {
            Ok(answer) => {
                more(&mut done.stats);
                Some(answer)
            }
            Err(problem) => {
                done.problem.get_or_insert(problem);
                None
            }
        }
    }

    fn frame<'g>(&'g self, geometry: &FrameGeometry, lights: &[ShadingLight]) -> Result<FrameShading<'g>> {
        let gpu = self.device.gpu();
        let (vertices, [normals, tangents, colors, uvs, uvs1]) = rows::vertices(geometry);
        let mut srgb = [[0.0; 4]; 64];
        for byte in 0..=255u8 {
            srgb[usize::from(byte / 4)][usize::from(byte % 4)] = decode_srgb8(byte);
        }
        let lamps: Vec<_> = lights.iter().map(rows::lamp).collect();
        Ok(FrameShading {
            of: self,
            constants: Shading {
                points: 0,
                normals,
                tangents,
                colors,
                uvs,
                uvs1,
                pad_a: 0,
                pad_b: 0,
                srgb,
            },
            triangles: gpu.uploaded("triangles of surfaces", &rows::triangle_rows(geometry))?,
            vertices: gpu.uploaded("attributes of vertices", &vertices)?,
            lamps: gpu.uploaded("lights", &filled(lamps))?,
        })
    }
}

impl ShadingBuilder for GpuShading {
    fn build<'g>(
        &'g self,
        geometry: &'g FrameGeometry,
        lights: &[ShadingLight],
    ) -> Option<Arc<dyn SurfaceShader + 'g>> {
        if self.problem().is_some() {
            return None;
        }
        let frame = self.noted(self.frame(geometry, lights), |_| ())?;
        Some(Arc::new(frame))
    }
}

/// One row at least, which a binding has to have.
fn filled<T: Pod>(mut rows: Vec<T>) -> Vec<T> {
    if rows.is_empty() {
        rows.push(T::zeroed());
    }
    rows
}

/// One frame in the device's memory.
#[derive(Debug)]
struct FrameShading<'g> {
    of: &'g GpuShading,
    constants: Shading,
    triangles: Buffer,
    vertices: Buffer,
    lamps: Buffer,
}

impl FrameShading<'_> {
    fn gpu(&self) -> &Gpu {
        self.of.device.gpu()
    }

    fn surfaces_of(&self, points: &[SurfacePoint]) -> Result<Vec<Surface>> {
        let gpu = self.gpu();
        let constants = Shading {
            points: points.len() as u32,
            ..self.constants
        };
        let constants = gpu.uniform("points", &constants)?;
        let rows: Vec<_> = points.iter().map(rows::point).collect();
        let sent = gpu.uploaded("points", &rows)?;
        let made = gpu.storage("surfaces", (size_of::<Row>() * points.len()) as u64)?;
        let bindings = [
            (0, constants.as_entire_binding()),
            (1, sent.as_entire_binding()),
            (2, self.triangles.as_entire_binding()),
            (3, self.vertices.as_entire_binding()),
            (4, self.of.uses.as_entire_binding()),
            (5, self.of.levels.as_entire_binding()),
            (6, BindingResource::TextureView(&self.of.texels)),
            (7, self.of.materials.as_entire_binding()),
            (8, made.as_entire_binding()),
        ];
        gpu.dispatch_bound(&SURFACES, "surface", &bindings, groups(points.len() as u64))?;
        let made: Vec<Row> = gpu.read(&made, 0, points.len() as u64)?;
        Ok(made.iter().map(rows::surface).collect())
    }

    /// As [`SurfaceShader::lit`], in parts that have a bounded number of beams.
    fn light_of(&self, surfaces: &[Surface], beams: &[Beam]) -> Result<Vec<Vec3>> {
        let (beams, firsts) = rows::by_surface(beams, surfaces.len());
        let most = firsts.windows(2).map(|ends| ends[1] - ends[0]).max();
        if let Some(needed) = most.filter(|&most| most > MOST_BEAMS) {
            return Err(Error::Limits {
                adapter: self.gpu().adapter().name.clone(),
                what: "the light of one surface, in beams,",
                needed: needed.into(),
                limit: MOST_BEAMS.into(),
            });
        }
        let mut sums = Vec::with_capacity(surfaces.len());
        while sums.len() < surfaces.len() {
            let first = sums.len();
            let fits = |end: &usize| (firsts[end + 1] - firsts[first]) as usize <= BEAMS;
            let last = (first + 1..surfaces.len()).take_while(|end| fits(end) && end - first < BATCH);
            let end = last.last().unwrap_or(first) + 1;
            let own = &beams[firsts[first] as usize..firsts[end] as usize];
            let from = |at: &u32| at - firsts[first];
            let starts: Vec<u32> = firsts[first..=end].iter().map(from).collect();
            sums.extend(self.light_of_part(&surfaces[first..end], own, &starts)?);
        }
        Ok(sums)
    }

    fn light_of_part(&self, surfaces: &[Surface], beams: &[BeamRow], firsts: &[u32]) -> Result<Vec<Vec3>> {
        let (gpu, count) = (self.gpu(), surfaces.len());
        if beams.is_empty() {
            return Ok(vec![Vec3::ZERO; count]);
        }
        let constants = Lit {
            surfaces: count as u32,
            pad_a: 0,
            pad_b: 0,
            pad_c: 0,
        };
        let constants = gpu.uniform("light", &constants)?;
        let rows: Vec<_> = surfaces.iter().map(rows::surface_row).collect();
        let sent = gpu.uploaded("surfaces", &rows)?;
        let beams = gpu.uploaded("beams", beams)?;
        let firsts = gpu.uploaded("beams of surfaces", firsts)?;
        let sums = gpu.storage("light", 16 * count as u64)?;
        let bindings = [
            (0, &constants),
            (1, &sent),
            (2, &self.lamps),
            (3, &beams),
            (4, &firsts),
            (5, &sums),
        ];
        gpu.dispatch(&LIT, "light", &bindings, groups(count as u64))?;
        let sums: Vec<[f32; 4]> = gpu.read(&sums, 0, count as u64)?;
        Ok(sums.iter().map(|&[r, g, b, _]| Vec3::new(r, g, b)).collect())
    }
}

impl SurfaceShader for FrameShading<'_> {
    fn surfaces(&self, points: &[SurfacePoint]) -> Option<Vec<Surface>> {
        if self.of.problem().is_some() {
            return None;
        }
        let made: Result<Vec<_>> = points.chunks(BATCH).map(|part| self.surfaces_of(part)).collect();
        let made = self
            .of
            .noted(made, |stats| stats.surfaces += points.len() as u64)?;
        Some(made.concat())
    }

    fn lit(&self, surfaces: &[Surface], beams: &[Beam]) -> Option<Vec<Vec3>> {
        if self.of.problem().is_some() {
            return None;
        }
        let lit = self.light_of(surfaces, beams);
        self.of.noted(lit, |stats| stats.beams += beams.len() as u64)
    }
}
