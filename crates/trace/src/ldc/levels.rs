//! Coarser cells above the texels: VMV07's min/max tiles, and the pyramid that extends them.
//!
//! A cell bounds all samples of its texels by a least and a largest depth and, in the pyramid, by 64 bits that say
//! which 64ths of the cube's depth hold any: in a room the space between floor and ceiling is empty, which one
//! interval cannot say. 16 bytes a cell; at 1024 x 1024 the lowest level of 8 x 8 texels is 256 KB.

use super::frame::{Raster, TILE};

/// What lies above the texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Hierarchy {
    /// Nothing: every texel along a ray is visited.
    Flat,
    /// VMV07: one level of min/max tiles, of 2^n x 2^m texels (1 to 4 each).
    Tiles {
        /// n and m.
        log2: [u32; 2],
    },
    /// Levels of 8, 32 and 128 texels a side with depth occupancy.
    #[default]
    Pyramid,
}

/// Bounds of all samples in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cell {
    pub(crate) min: f32,
    pub(crate) max: f32,
    /// Bit `i` for samples in the i-th 64th of the depth.
    pub(crate) occupied: u64,
}

impl Cell {
    pub(crate) const EMPTY: Self = Self {
        min: f32::INFINITY,
        max: f32::NEG_INFINITY,
        occupied: 0,
    };

    #[inline]
    pub(crate) fn add(&mut self, range: [f32; 2], occupied: u64) {
        self.min = self.min.min(range[0]);
        self.max = self.max.max(range[1]);
        self.occupied |= occupied;
    }
}

/// Bits of the 64ths between two depths; `per_texel` is 64 over the cube's size.
#[inline(always)]
pub(crate) fn slots(min: f32, max: f32, per_texel: f32) -> u64 {
    // Casts saturate.
    let (low, high) = ((min * per_texel) as u32, ((max * per_texel) as u32).min(63));
    (u64::MAX << low.min(63)) & (u64::MAX >> (63 - high))
}

/// Where a texel's samples begin, and the 32nds of the depth that hold any, so that most texels that a ray passes beside
/// what is in them cost no look at their samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Texel {
    pub(crate) start: u32,
    pub(crate) occupied: u32,
}

/// Bits of the 32nds between two depths; `per_texel` is 32 over the cube's size.
#[inline(always)]
pub(crate) fn coarse_slots(min: f32, max: f32, per_texel: f32) -> u32 {
    let (low, high) = ((min * per_texel) as u32, ((max * per_texel) as u32).min(31));
    (u32::MAX << low.min(31)) & (u32::MAX >> (31 - high))
}

/// One level of cells.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Level {
    /// Texels of a cell's sides as powers of two.
    pub(crate) shift: [u32; 2],
    pub(crate) columns: u32,
    pub(crate) cells: Vec<Cell>,
}

impl Level {
    pub(crate) fn empty(raster: &Raster, shift: [u32; 2]) -> Self {
        let [columns, rows] = [0, 1].map(|i| raster.size[i].div_ceil(1 << shift[i]));
        Self {
            shift,
            columns,
            cells: vec![Cell::EMPTY; (columns * rows) as usize],
        }
    }

    #[inline(always)]
    pub(crate) fn cell(&self, column: u32, row: u32) -> &Cell {
        &self.cells[(row * self.columns + column) as usize]
    }

    /// The level above, whose cells are 2^`by` of these cells wide and high.
    fn above(&self, raster: &Raster, by: [u32; 2]) -> Self {
        let mut level = Self::empty(raster, [self.shift[0] + by[0], self.shift[1] + by[1]]);
        for (i, cell) in self.cells.iter().enumerate() {
            let (column, row) = (i as u32 % self.columns, i as u32 / self.columns);
            let parent = (row >> by[1]) * level.columns + (column >> by[0]);
            level.cells[parent as usize].add([cell.min, cell.max], cell.occupied);
        }
        level
    }
}

impl Hierarchy {
    /// Shifts of the lowest level, which a row of tiles can fill alone.
    pub(crate) fn base(self) -> Option<[u32; 2]> {
        let row = TILE.ilog2();
        match self {
            Self::Flat => None,
            Self::Tiles { log2: [n, m] } => Some([n.clamp(1, 4), m.clamp(1, row)]),
            Self::Pyramid => Some([row; 2]),
        }
    }

    /// All levels, coarsest first, from the lowest one.
    pub(crate) fn complete(self, raster: &Raster, base: Option<Level>) -> Vec<Level> {
        let Some(base) = base else { return Vec::new() };
        match self {
            Self::Flat => Vec::new(),
            Self::Tiles { log2: [_, m] } if m.clamp(1, 4) > base.shift[1] => vec![base.above(raster, [0, 1])],
            Self::Tiles { .. } => vec![base],
            Self::Pyramid => {
                let middle = base.above(raster, [2; 2]);
                let top = middle.above(raster, [2; 2]);
                vec![top, middle, base]
            }
        }
    }

    /// Whether occupancy is looked at.
    pub(crate) fn occupancy(self) -> bool {
        self == Self::Pyramid
    }
}
