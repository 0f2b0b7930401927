//! Shading on every pass (HM08 §5.1): triangles come in object order, and each time that one is found to be closer than
//! those before it, the pixel's surface is shaded and takes the place of the last.
//!
//! It is the paper's way and the dearer one, for a pixel is shaded as often as something closer comes along; otherwise
//! surfaces are made once, when it is known what is seen. The picture is the same. Shadow rays come later in both; without
//! them, the light of all sources belongs to a pass.

use std::ops::Range;

use rayward_trace::Tile;

use super::{Shaded, TileShader, TileWork};
use crate::shade::direct;

/// The last surface of each pixel of a tile, row by row; nothing but with the paper's parameters.
#[derive(Default)]
pub(crate) struct Passes(Vec<Option<Shaded>>);

impl Passes {
    /// Takes out the surface of a pixel.
    pub(super) fn take(&mut self, tile: &Tile, [x, y]: [u32; 2]) -> Option<Shaded> {
        self.0.get_mut((y * tile.width + x) as usize)?.take()
    }
}

impl TileShader<'_> {
    /// Whether the light of sources is added on each pass: where none casts a shadow, and all that is seen are passes.
    fn lights_passes(&self) -> bool {
        let only_passes = self.structures.veils.is_none() && self.solids.is_none();
        self.options.paper && !self.options.shadows && only_passes
    }

    /// The lights that are added once it is known what is seen.
    pub(super) fn shadowed_lights(&self) -> Range<usize> {
        if self.lights_passes() {
            0..0
        } else {
            0..self.lights.len()
        }
    }

    /// Traces a tile and shades on every pass.
    pub(super) fn shade_passes(&self, tile: &Tile, work: &mut TileWork) {
        let TileWork {
            hits,
            passes,
            surfaces,
            ..
        } = work;
        passes.0.clear();
        passes.0.resize_with((tile.width * tile.height) as usize, || None);
        let eye = &self.structures.eye;
        eye.trace_tile_passes(tile, hits, |x, y, prim| {
            let ray = eye.view().pixel_ray(tile.x + x, tile.y + y);
            *surfaces += 1;
            passes.0[(y * tile.width + x) as usize] = self.shade_hit(&ray, prim).map(|mut shaded| {
                if self.lights_passes() {
                    for light in self.lights {
                        let incident = direct(&shaded.surface, light);
                        shaded.color += incident.map_or(glam::Vec3::ZERO, |incident| incident.radiance);
                    }
                }
                shaded
            });
        });
    }
}
