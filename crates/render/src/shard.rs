//! Shares of one picture, for several processes: squares of pixels, dealt out in turn.
//!
//! Every process builds all structures and traces its own squares. A pixel does not depend on what else is rendered, so
//! the squares put together ([`crate::image_io::join_parts`]) are the whole picture, bit for bit. A share knows which
//! picture it belongs to by a checksum of all that a picture depends on: geometry, materials, textures, camera, lights,
//! environment, options, the version of this library.
//!
//! Squares are dealt out along diagonals, so that each share has some of every part of the picture. Cost of the checksum:
//! some 10 GB/s of what is hashed.

use std::fmt::{self, Debug, Write};

use bytemuck::cast_slice;
use rayward_scene::{FrameGeometry, PosedCamera, PosedLight, Scene};
use xxhash_rust::xxh3::Xxh3Default;

use crate::{Environment, Film, RenderOptions, Sample, Shutter};

/// Side of a square in pixels.
const SIDE: u32 = 64;

/// One of several shares: of a picture's squares, of an animation's frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    of: u32,
}

/// Which share of which picture a film is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The share.
    pub shard: Shard,
    /// Checksum of all that the picture depends on.
    pub picture: u64,
}

impl Shard {
    /// Share `index` of `of`, counted from 1; `None` if there is none such.
    pub fn new(index: u32, of: u32) -> Option<Self> {
        (1..=of).contains(&index).then_some(Self { index, of })
    }

    /// Which one it is, counted from 1.
    pub fn index(self) -> u32 {
        self.index
    }

    /// How many there are.
    pub fn of(self) -> u32 {
        self.of
    }

    /// Whether it gets this one of things that are dealt out in turn.
    pub fn has(self, thing: u32) -> bool {
        thing % self.of == self.index - 1
    }

    /// Whether a pixel is its own.
    pub fn has_pixel(self, x: u32, y: u32) -> bool {
        self.has(x / SIDE + y / SIDE)
    }

    /// Whether any pixel of a rectangle is its own.
    pub(crate) fn has_any(self, [x, y]: [u32; 2], [width, height]: [u32; 2]) -> bool {
        let squares = |from: u32, length: u32| from / SIDE..=(from + length.max(1) - 1) / SIDE;
        squares(y, height).any(|row| squares(x, width).any(|column| self.has(column + row)))
    }

    /// How many pixels of a picture are its own.
    pub(crate) fn pixels(self, width: u32, height: u32) -> u64 {
        let own = |y: u32| {
            (0..width)
                .step_by(SIDE as usize)
                .filter(move |&x| self.has_pixel(x, y))
        };
        let length = |x: u32| u64::from(SIDE.min(width - x));
        (0..height).map(|y| own(y).map(length).sum::<u64>()).sum()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl std::str::FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let parse = || {
            let (index, of) = text.split_once('/')?;
            Self::new(index.parse().ok()?, of.parse().ok()?)
        };
        parse().ok_or("it has to be like 1/4, and not above 4/4")
    }
}

impl Film {
    /// Makes it a part of a picture: pixels that are not its own see a black background.
    pub(crate) fn become_part(&mut self, part: Part) {
        self.part = Some(part);
        let (width, height) = (self.width(), self.height());
        let mut whole = self.tiles_mut(width, height);
        for y in 0..height {
            for x in (0..width).filter(|&x| !part.shard.has_pixel(x, y)) {
                whole[0].put(x, y, &Sample::background(glam::Vec3::ZERO));
            }
        }
    }

    /// Takes over the pixels that are a shard's own from a film of the same size and layers.
    pub(crate) fn take(&mut self, other: &Self, shard: Shard) {
        let (width, height) = (self.width() as usize, self.height());
        for y in 0..height {
            for x in (0..self.width()).step_by(SIDE as usize) {
                if shard.has_pixel(x, y) {
                    let start = y as usize * width;
                    let own = start + x as usize..start + width.min((x + SIDE) as usize);
                    self.copy_row(other, own);
                }
            }
        }
    }
}

/// What the checksum is made of.
pub(crate) struct Ingredients<'p> {
    pub(crate) scene: &'p Scene,
    pub(crate) geometry: &'p FrameGeometry,
    pub(crate) camera: &'p PosedCamera,
    pub(crate) shutter: Option<Shutter<'p>>,
    pub(crate) lights: &'p [PosedLight],
    pub(crate) environment: Option<&'p Environment>,
    pub(crate) options: &'p RenderOptions,
}

impl Ingredients<'_> {
    /// The checksum. Numbers that are not in large arrays go in as text, which tells every f32 and f64 apart.
    pub(crate) fn checksum(&self) -> u64 {
        let mut sum = Checksum(Xxh3Default::new());
        sum.text(&env!("CARGO_PKG_VERSION"));
        let Scene {
            materials,
            images,
            samplers,
            ..
        } = self.scene;
        sum.text(&(materials, samplers, images));
        for image in images {
            sum.0.update(cast_slice(&image.texels));
        }
        sum.geometry(self.geometry);
        sum.text(&(self.camera, self.lights));
        if let Some(shutter) = &self.shutter {
            sum.geometry(shutter.geometry);
            sum.text(shutter.camera);
        }
        if let Some(environment) = self.environment {
            let (texels, rest) = environment.values();
            sum.0.update(cast_slice(texels));
            sum.text(&rest);
        }
        sum.options(self.options);
        sum.0.digest()
    }
}

struct Checksum(Xxh3Default);

impl Write for Checksum {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

impl Checksum {
    fn text(&mut self, value: &(impl Debug + ?Sized)) {
        write!(self, "{value:?};").expect("a checksum takes anything");
    }

    /// All but what no pixel depends on.
    fn options(&mut self, options: &RenderOptions) {
        let &RenderOptions {
            width,
            height,
            shadows,
            casters,
            tinted_shadows,
            ambient,
            background,
            show_environment,
            environment_samples,
            bounces,
            diffuse_bounces,
            pixel_samples,
            antialias,
            pixel_filter,
            lens,
            samples,
            seed,
            layers: _,
            shard: _,
            paper,
            reference,
            shadow_structure: _,
            level: _,
        } = options;
        self.text(&(width, height, lens, samples, seed, paper, reference));
        self.text(&(shadows, casters, tinted_shadows, ambient, background));
        self.text(&(show_environment, environment_samples, bounces, diffuse_bounces));
        self.text(&(pixel_samples, antialias, pixel_filter));
    }

    fn geometry(&mut self, geometry: &FrameGeometry) {
        let FrameGeometry {
            origin,
            x,
            y,
            z,
            indices,
            attributes,
            objects,
            solids,
            ..
        } = geometry;
        self.text(&(origin, objects, solids, x.len(), indices.len()));
        let arrays: [&[u8]; 9] = [
            cast_slice(x),
            cast_slice(y),
            cast_slice(z),
            cast_slice(indices),
            cast_slice(&attributes.normals),
            cast_slice(&attributes.tangents),
            cast_slice(&attributes.uvs),
            cast_slice(&attributes.uvs1),
            cast_slice(&attributes.colors),
        ];
        for array in arrays {
            self.0.update(array);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_one_shards_own() {
        let (width, height) = (333, 200);
        for of in [1, 2, 3, 5, 7] {
            let shards: Vec<_> = (1..=of).filter_map(|index| Shard::new(index, of)).collect();
            let total: u64 = shards.iter().map(|shard| shard.pixels(width, height)).sum();
            assert_eq!((shards.len() as u32, total), (of, u64::from(width * height)));
            for (x, y) in [(0, 0), (63, 64), (64, 63), (332, 199), (128, 5)] {
                assert_eq!(shards.iter().filter(|shard| shard.has_pixel(x, y)).count(), 1);
                let touched = |shard: &&Shard| shard.has_any([x, y], [1, 1]);
                assert_eq!(shards.iter().filter(touched).count(), 1);
            }
        }
        let second = Shard::new(2, 4).unwrap();
        assert!(!second.has_any([0, 0], [64, 64]) && second.has_any([0, 0], [65, 64]));
    }

    #[test]
    fn shards_have_a_number_not_above_that_of_all() {
        assert_eq!("4/4".parse(), Ok(Shard { index: 4, of: 4 }));
        assert_eq!(Shard::new(2, 3).unwrap().to_string(), "2/3");
        for wrong in ["0/4", "5/4", "1", "1/0", "a/b", "1/2/3", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
