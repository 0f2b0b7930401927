//! Lists of items by cell: one array of references and where each cell's begin (HM08 §7; compressed sparse rows).
//!
//! Items are cut into chunks, cells into ranges. Each chunk finds the cells of its items and sorts them by range; each
//! range then takes its parts of all chunks, in order, through one counting sort. Nothing is shared and nothing
//! depends on the number of threads: every list ascends. 4 bytes a reference and 4 bytes a cell; while it is built, 8
//! bytes a reference more.

use rayon::prelude::*;

/// Items in a chunk.
const CHUNK: usize = 2048;

/// Ranges of cells at most.
const RANGES: usize = 64;

/// Items by cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cells {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Cells {
    /// Sorts items 0 .. `items` into `cells` cells; `each_cell` calls its last argument with every cell of an item.
    pub(crate) fn build(
        cells: usize,
        items: usize,
        each_cell: impl Fn(u32, &mut dyn FnMut(u32)) + Sync,
    ) -> Self {
        let range_size = cells.div_ceil(RANGES).max(1);
        let ranges = cells.div_ceil(range_size);
        let chunks: Vec<Vec<Vec<[u32; 2]>>> = (0..items.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut parts = vec![Vec::new(); ranges];
                for item in chunk * CHUNK..((chunk + 1) * CHUNK).min(items) {
                    let item = item as u32;
                    each_cell(item, &mut |cell| {
                        parts[cell as usize / range_size].push([cell, item]);
                    });
                }
                parts
            })
            .collect();
        let sorted: Vec<Self> = (0..ranges)
            .into_par_iter()
            .map(|range| {
                let first = range * range_size;
                let size = range_size.min(cells - first);
                let pairs = || chunks.iter().flat_map(|parts| &parts[range]);
                Self::sorted(size, first as u32, pairs)
            })
            .collect();
        let mut whole = Self {
            starts: Vec::with_capacity(cells + 1),
            items: Vec::with_capacity(sorted.iter().map(|part| part.items.len()).sum()),
        };
        for part in sorted {
            let before = whole.items.len() as u32;
            let starts = &part.starts[..part.starts.len() - 1];
            whole.starts.extend(starts.iter().map(|start| before + start));
            whole.items.extend(part.items);
        }
        whole.starts.push(whole.items.len() as u32);
        whole
    }

    fn sorted<'a, P: Iterator<Item = &'a [u32; 2]>>(cells: usize, first: u32, pairs: impl Fn() -> P) -> Self {
        let mut starts = vec![0u32; cells + 1];
        for &[cell, _] in pairs() {
            starts[(cell - first) as usize + 1] += 1;
        }
        for i in 0..cells {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[cells] as usize];
        for &[cell, item] in pairs() {
            let slot = &mut next[(cell - first) as usize];
            items[*slot as usize] = item;
            *slot += 1;
        }
        Self { starts, items }
    }

    /// The items of a cell, ascending.
    #[inline]
    pub(crate) fn of(&self, cell: u32) -> &[u32] {
        let cell = cell as usize;
        &self.items[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// References in all cells.
    pub(crate) fn reference_count(&self) -> usize {
        self.items.len()
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        (self.items.capacity() + self.starts.capacity()) * 4
    }
}
