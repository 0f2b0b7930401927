//! How a box of a space is cut into cells, and the cells that a segment passes.
//!
//! Cells are told apart by planes, three sorted arrays: evenly spaced in x and y, in z anywhere (HM08 §5.3 leaves
//! open where; quantiles of the triangles' depths are our default). A plane is `low + i * width`, never a sum of
//! steps, and a crossing is computed from its plane alone, so errors do not add up along a ray.
//!
//! *Why no cell is missed.* Things are put into the cells within [`Partition::pad`] of them. On each axis on its own
//! the cell at parameter s is the one that holds the segment's point at s, but for the rounding of one division:
//! some 2^-50 of the box. So the cell at s comes within that, plus the segment's own error, of the point at s, and
//! `pad` is more than both together; a ray whose error is larger is not given to a grid ([`Partition::resolves`]).

use glam::DVec3;

/// Share of a cell's mean width by which things are put into more cells than they touch.
const PAD: f64 = 1.0 / (1u32 << 12) as f64;

/// Cells at most along an axis.
pub(super) const MAX_CELLS: u32 = 4096;

/// A box cut by planes.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Partition {
    cells: [u32; 3],
    low: DVec3,
    high: DVec3,
    /// Cells per unit, for the evenly spaced axes.
    density: DVec3,
    planes: [Vec<f64>; 3],
}

impl Partition {
    /// The box from `low` to `high` in this many cells, with these inner planes of z, ascending, if they are not
    /// evenly spaced.
    pub(crate) fn new([low, high]: [DVec3; 2], cells: [u32; 3], inner: Option<&[f64]>) -> Self {
        let mut cells = cells.map(|n| n.clamp(1, MAX_CELLS));
        if let Some(inner) = inner {
            cells[2] = inner.len() as u32 + 1;
        }
        let size = high - low;
        let mut planes = [0, 1, 2].map(|axis| {
            let (n, width) = (cells[axis], size[axis] / f64::from(cells[axis]));
            (0..=n)
                .map(|i| low[axis] + f64::from(i) * width)
                .collect::<Vec<_>>()
        });
        if let Some(inner) = inner {
            planes[2] = [&[low.z], inner, &[high.z]].concat();
        }
        Self {
            cells,
            low,
            high,
            density: DVec3::from_array(cells.map(f64::from)) / size,
            planes,
        }
    }

    /// Cells along the axes.
    pub(crate) fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// All cells.
    pub(crate) fn cell_count(&self) -> usize {
        self.cells.iter().map(|&n| n as usize).product()
    }

    /// How far from a cell a thing may be that is put into it.
    pub(crate) fn pad(&self) -> DVec3 {
        PAD / self.density
    }

    /// Whether points with this error are still found in cells that hold what they touch.
    pub(crate) fn resolves(&self, error: DVec3) -> bool {
        error.cmple(self.pad() * 0.5).all()
    }

    /// The planes of a cell along an axis, moved out by the pad.
    pub(crate) fn padded(&self, axis: usize, cell: u32) -> [f64; 2] {
        let (planes, pad) = (&self.planes[axis], self.pad()[axis]);
        [planes[cell as usize] - pad, planes[cell as usize + 1] + pad]
    }

    /// The cell along an axis that holds a coordinate; the first or the last for coordinates outside.
    #[inline]
    fn cell_at(&self, axis: usize, x: f64) -> u32 {
        let last = self.cells[axis] - 1;
        if axis == 2 {
            let inner = &self.planes[2][1..=last as usize];
            return inner.partition_point(|&plane| plane <= x) as u32;
        }
        // Conversions saturate: negative coordinates are in cell 0.
        (((x - self.low[axis]) * self.density[axis]) as u32).min(last)
    }

    /// First and last cell along an axis whose padded extent meets an interval.
    pub(crate) fn span(&self, axis: usize, low: f64, high: f64) -> Option<[u32; 2]> {
        let pad = self.pad()[axis];
        let (low, high) = (low - pad, high + pad);
        // Written so that NaN is refused.
        if !(low <= self.high[axis] && high >= self.low[axis]) {
            return None;
        }
        Some([self.cell_at(axis, low), self.cell_at(axis, high)])
    }

    /// The index of a cell.
    #[inline]
    pub(crate) fn index(&self, [x, y, z]: [u32; 3]) -> u32 {
        // Cells of different z side by side: rays of a vantage run along z.
        (y * self.cells[0] + x) * self.cells[2] + z
    }

    /// The cells that the segment from `start` to `end`, which lies within the box, passes in order.
    #[inline]
    pub(crate) fn steps(&self, start: DVec3, end: DVec3) -> Steps<'_> {
        let (start, along) = (start, end - start);
        let mut steps = Steps {
            partition: self,
            start,
            along,
            cell: [0; 3],
            crossing: [f64::INFINITY; 3],
        };
        for axis in 0..3 {
            steps.cell[axis] = self.cell_at(axis, start[axis]);
            steps.find_crossing(axis);
        }
        steps
    }
}

/// A walk from cell to cell.
pub(crate) struct Steps<'p> {
    partition: &'p Partition,
    start: DVec3,
    along: DVec3,
    cell: [u32; 3],
    /// Parameters at which the cell is left through its planes.
    crossing: [f64; 3],
}

impl Steps<'_> {
    /// The present cell.
    #[inline]
    pub(crate) fn cell(&self) -> u32 {
        self.partition.index(self.cell)
    }

    /// The parameter at which the present cell is left; infinite if it is not.
    #[inline]
    pub(crate) fn leaves_at(&self) -> f64 {
        self.crossing[0].min(self.crossing[1]).min(self.crossing[2])
    }

    /// Goes on to the next cell; only if the present one is left.
    #[inline]
    pub(crate) fn advance(&mut self) {
        let [x, y, z] = self.crossing;
        let axis = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        if self.along[axis] > 0.0 {
            self.cell[axis] += 1;
        } else {
            self.cell[axis] -= 1;
        }
        self.find_crossing(axis);
    }

    /// The segment lies within the box, so the outer planes are never crossed: only rounding could.
    #[inline]
    fn find_crossing(&mut self, axis: usize) {
        let (cell, along) = (self.cell[axis], self.along[axis]);
        let plane = if along > 0.0 && cell + 1 < self.partition.cells[axis] {
            cell + 1
        } else if along < 0.0 && cell > 0 {
            cell
        } else {
            self.crossing[axis] = f64::INFINITY;
            return;
        };
        self.crossing[axis] = (self.partition.planes[axis][plane as usize] - self.start[axis]) / along;
    }
}
