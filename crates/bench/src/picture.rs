//! Pictures of one byte a pixel, in the order in which tiles are traced.
//!
//! Layout: tiles of one size in rows, in each the blocks of 4 x 4 pixels that the picture covers, in rows. So a tile
//! is one slice that one thread writes, and all contenders write the same layout.

use rayon::prelude::*;
use rayward::trace::BLOCK_LANES;

/// Pixels of a block's side.
const BLOCK: u32 = 4;

/// A picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    width: u32,
    height: u32,
    side: u32,
    blocks: Vec<[u8; BLOCK_LANES]>,
}

/// A tile's place, and its part of a picture.
#[derive(Debug)]
pub(crate) struct TilePixels<'p> {
    /// Index, counted in rows.
    pub(crate) index: u32,
    /// First pixel column and row.
    pub(crate) corner: [u32; 2],
    /// Blocks in a row.
    pub(crate) stride: u32,
    /// The blocks.
    pub(crate) blocks: &'p mut [[u8; BLOCK_LANES]],
}

/// How two pictures differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Difference {
    /// Pixels that differ by more than [`Difference::TOLERATED`].
    pub pixels: u64,
    /// Largest difference.
    pub largest: u8,
}

impl Difference {
    /// A difference that rounding makes, of 255.
    pub const TOLERATED: u8 = 2;
}

impl Picture {
    /// A black picture, in tiles of that side, a multiple of 4.
    pub fn new(width: u32, height: u32, side: u32) -> Self {
        let tiles = width.div_ceil(side) as usize * height.div_ceil(side) as usize;
        let blocks = vec![[0; BLOCK_LANES]; tiles * blocks_of(side)];
        Self {
            width,
            height,
            side,
            blocks,
        }
    }

    /// All tiles, to be written in parallel.
    pub(crate) fn tiles_mut(&mut self) -> impl IndexedParallelIterator<Item = TilePixels<'_>> {
        let (width, height, side) = (self.width, self.height, self.side);
        let columns = width.div_ceil(side);
        let tiles = self.blocks.par_chunks_mut(blocks_of(side)).enumerate();
        tiles.map(move |(index, blocks)| {
            let index = index as u32;
            let corner = [index % columns * side, index / columns * side];
            let stride = side.min(width - corner[0]).div_ceil(BLOCK);
            let rows = side.min(height - corner[1]).div_ceil(BLOCK);
            TilePixels {
                index,
                corner,
                stride,
                blocks: &mut blocks[..(stride * rows) as usize],
            }
        })
    }

    /// The pixels in rows.
    pub fn rows(&self) -> Vec<u8> {
        let (columns, side) = (self.width.div_ceil(self.side), self.side);
        let mut rows = Vec::with_capacity(self.width as usize * self.height as usize);
        for y in 0..self.height {
            for x in 0..self.width {
                let tile = (y / side * columns + x / side) as usize;
                let stride = side.min(self.width - x / side * side).div_ceil(BLOCK);
                let block = (y % side / BLOCK * stride + x % side / BLOCK) as usize;
                let lane = (y % BLOCK * BLOCK + x % BLOCK) as usize;
                rows.push(self.blocks[tile * blocks_of(side) + block][lane]);
            }
        }
        rows
    }

    /// How it differs from another picture of its size.
    pub fn difference(&self, other: &Self) -> Difference {
        let pairs = self.rows().into_iter().zip(other.rows());
        pairs.fold(Difference::default(), |sum, (a, b)| {
            let by = a.abs_diff(b);
            Difference {
                pixels: sum.pixels + u64::from(by > Difference::TOLERATED),
                largest: sum.largest.max(by),
            }
        })
    }
}

fn blocks_of(side: u32) -> usize {
    (side / BLOCK).pow(2) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_has_its_place() {
        let (width, height) = (21, 18);
        let value = |x: u32, y: u32| (x * 7 + y * 31) as u8;
        let mut picture = Picture::new(width, height, 8);
        picture.tiles_mut().for_each(|tile| {
            for (i, block) in tile.blocks.iter_mut().enumerate() {
                let (bx, by) = (i as u32 % tile.stride, i as u32 / tile.stride);
                *block = std::array::from_fn(|lane| {
                    let (x, y) = (lane as u32 % 4, lane as u32 / 4);
                    value(tile.corner[0] + bx * 4 + x, tile.corner[1] + by * 4 + y)
                });
            }
        });
        let expected: Vec<u8> = (0..height)
            .flat_map(|y| (0..width).map(move |x| value(x, y)))
            .collect();
        assert_eq!(picture.rows(), expected);
        assert_eq!(picture.difference(&picture), Difference::default());
        let mut other = picture.clone();
        other.blocks[0][0] = 3;
        other.blocks[0][1] = value(1, 0) + 2;
        let difference = picture.difference(&other);
        assert_eq!((difference.pixels, difference.largest), (1, 3));
    }
}
