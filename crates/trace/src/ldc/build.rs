//! Building the cube.
//!
//! `Csr`, the single sweep that VMV07 hopes for: triangles are sorted into bands of eight texel rows of the direction
//! they are routed to; each band rasterises its own, counts samples per texel, scans, fills, and sorts each texel's
//! list by depth, then id. Bands share nothing, so the result is the same for any number of threads.
//!
//! `Peel`, VMV07's way and a check on the first: a count pass finds the largest number of samples of any texel, and
//! as many passes over all triangles each keep, per texel, the nearest sample beyond the pass before. Samples of
//! equal depth collapse to the one of the smallest id, so with centre coverage `Csr` leaves out the others too.

use rayon::prelude::*;

use super::frame::{CubeFrame, Raster, TILE};
use super::levels::{Cell, Hierarchy, Level, Texel, coarse_slots, slots};
use super::raster::{Coverage, Fragment, Routed};
use super::samples::{Depth, DepthFormat, Layers, Sample, Samples};
use super::{LdcBuild, LdcOptions};
use crate::{BuildStats, Triangles};

/// One direction of the cube.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stack {
    pub(crate) raster: Raster,
    /// Size of the cube along the direction, in texels.
    pub(crate) scale: f32,
    /// Each texel, in memory order, and the end of the last one's samples.
    pub(crate) texels: Vec<Texel>,
    pub(crate) samples: Samples,
    /// Coarsest first.
    pub(crate) levels: Vec<Level>,
    /// Passes over the geometry that peeling would take: samples in the fullest texel.
    pub(crate) layers: u32,
}

/// Ids of the triangles that take part.
pub(crate) fn usable(triangles: &Triangles) -> (Vec<u32>, BuildStats) {
    let all = 0..triangles.len() as u32;
    let prims: Vec<u32> = all
        .clone()
        .into_par_iter()
        .filter(|&p| !triangles.is_degenerate(p))
        .collect();
    let infinite = all
        .into_par_iter()
        .filter(|&p| !triangles.corners(p).iter().all(|c| c.is_finite()))
        .count();
    let stats = BuildStats {
        triangles: prims.len(),
        dropped_non_finite: infinite,
        dropped_degenerate: triangles.len() - prims.len() - infinite,
    };
    (prims, stats)
}

/// A frame of the asked resolution, or of half of it, a quarter and so on if there would be too many samples.
pub(crate) fn fitting_frame(triangles: &Triangles, prims: &[u32], options: &LdcOptions) -> CubeFrame {
    let mut resolution = options.resolution.clamp(LEAST_RESOLUTION, MAX_RESOLUTION);
    loop {
        let frame = CubeFrame::around(triangles, prims, resolution);
        let samples: u64 = prims
            .par_iter()
            .map(|&prim| Routed::new(&frame, triangles, prim).estimated_samples() as u64)
            .sum();
        if samples <= options.max_samples || resolution <= LEAST_RESOLUTION {
            return frame;
        }
        resolution /= 2;
    }
}

const LEAST_RESOLUTION: u32 = 16;
const MAX_RESOLUTION: u32 = 4096;

/// Triangles by direction and band.
struct Bands {
    starts: Vec<u32>,
    prims: Vec<u32>,
    /// First band of each direction, and the end.
    first: [usize; 4],
}

impl Bands {
    fn sort(frame: &CubeFrame, rasters: &[Raster; 3], triangles: &Triangles, prims: &[u32]) -> Self {
        let mut first = [0; 4];
        for axis in 0..3 {
            first[axis + 1] = first[axis] + (rasters[axis].size[1] / TILE) as usize;
        }
        let pairs: Vec<(u32, u32)> = prims
            .par_chunks(4096)
            .flat_map_iter(|chunk| {
                chunk.iter().flat_map(|&prim| {
                    let routed = Routed::new(frame, triangles, prim);
                    let [from, to] = routed.rows(&rasters[routed.axis]);
                    let base = first[routed.axis] as u32;
                    (from / TILE..to.div_ceil(TILE)).map(move |band| (base + band, prim))
                })
            })
            .collect();
        let mut starts = vec![0u32; first[3] + 1];
        for &(band, _) in &pairs {
            starts[band as usize + 1] += 1;
        }
        for i in 0..first[3] {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut sorted = vec![0; pairs.len()];
        for &(band, prim) in &pairs {
            let slot = &mut next[band as usize];
            sorted[*slot as usize] = prim;
            *slot += 1;
        }
        Self {
            starts,
            prims: sorted,
            first,
        }
    }

    fn prims(&self, axis: usize, band: usize) -> &[u32] {
        let i = self.first[axis] + band;
        &self.prims[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}

/// The three directions.
pub(crate) fn build(
    frame: &CubeFrame,
    triangles: &Triangles,
    prims: &[u32],
    options: &LdcOptions,
) -> [Stack; 3] {
    let rasters = [0, 1, 2].map(|axis| Raster::new(frame, axis));
    let bands = Bands::sort(frame, &rasters, triangles, prims);
    let fragments = |axis: usize, band: usize, emit: &mut dyn FnMut(u32, Fragment)| {
        let rows = [band as u32 * TILE, (band as u32 + 1) * TILE];
        for &prim in bands.prims(axis, band) {
            let routed = Routed::new(frame, triangles, prim);
            let [from, to] = routed.rows(&rasters[axis]);
            for row in from.max(rows[0])..to.min(rows[1]) {
                routed.fragments(&rasters[axis], options.build.coverage(), row, |f| emit(prim, f));
            }
        }
    };
    rasters.map(|raster| {
        let source = |band: usize, emit: &mut dyn FnMut(u32, Fragment)| fragments(raster.axis, band, emit);
        let scale = frame.size[raster.axis] as f32;
        match options.depth {
            DepthFormat::F16 => stack(raster, scale, options, source, Samples::F16),
            DepthFormat::U16 => stack(raster, scale, options, source, Samples::U16),
            DepthFormat::F32 => stack(raster, scale, options, source, Samples::F32),
        }
    })
}

/// Rows of tiles and their samples, joined to one direction.
fn stack<D: Depth>(
    raster: Raster,
    scale: f32,
    options: &LdcOptions,
    source: impl Fn(usize, &mut dyn FnMut(u32, Fragment)) + Sync,
    wrap: impl Fn(Layers<D>) -> Samples,
) -> Stack {
    let count = (raster.size[1] / TILE) as usize;
    let bands: Vec<Band> = (0..count)
        .into_par_iter()
        .map(|band| {
            let source = |emit: &mut dyn FnMut(u32, Fragment)| source(band, emit);
            match options.build {
                LdcBuild::Csr(coverage) => Band::swept(&raster, coverage, source),
                LdcBuild::Peel => Band::peeled(&raster, source),
            }
        })
        .collect();
    let total = bands.iter().map(|b| b.samples.len()).sum();
    let (mut texels, mut samples) = (
        Vec::with_capacity(raster.texels() + 1),
        Layers::with_capacity(total),
    );
    let mut base = options.hierarchy.base().map(|shift| Level::empty(&raster, shift));
    let mut layers = 0;
    for (index, band) in bands.iter().enumerate() {
        let offset = samples.len() as u32;
        texels.extend(band.starts.windows(2).map(|range| Texel {
            start: range[0] + offset,
            occupied: band.occupied(range, options.hierarchy, scale, D::error(scale)),
        }));
        for (prim, fragment) in &band.samples {
            samples.push(Sample::of(fragment, *prim, scale));
        }
        layers = band.starts.windows(2).map(|w| w[1] - w[0]).fold(layers, u32::max);
        if let Some(level) = &mut base {
            band.bound(level, index as u32, options.hierarchy, scale, D::error(scale));
        }
    }
    texels.push(Texel {
        start: samples.len() as u32,
        occupied: 0,
    });
    Stack {
        raster,
        scale,
        texels,
        samples: wrap(samples.finished()),
        levels: options.hierarchy.complete(&raster, base),
        layers,
    }
}

/// The samples of one row of tiles, by texel in memory order.
struct Band {
    starts: Vec<u32>,
    samples: Vec<(u32, Fragment)>,
}

/// Position in a band of a texel, in memory order.
fn place(fragment: &Fragment) -> usize {
    let (column, row) = (fragment.column, fragment.row % TILE);
    ((column / TILE * TILE + row) * TILE + column % TILE) as usize
}

impl Band {
    /// Count, scan, fill, sort.
    fn swept(raster: &Raster, coverage: Coverage, source: impl Fn(&mut dyn FnMut(u32, Fragment))) -> Self {
        let texels = (raster.size[0] * TILE) as usize;
        let mut starts = vec![0u32; texels + 1];
        let mut found = Vec::new();
        source(&mut |prim, fragment| {
            starts[place(&fragment) + 1] += 1;
            found.push((prim, fragment));
        });
        for i in 0..texels {
            starts[i + 1] += starts[i];
        }
        let Some(&filler) = found.first() else {
            return Self {
                starts,
                samples: Vec::new(),
            };
        };
        let mut next = starts.clone();
        let mut samples = vec![filler; found.len()];
        for sample in found {
            let slot = &mut next[place(&sample.1)];
            samples[*slot as usize] = sample;
            *slot += 1;
        }
        for texel in 0..texels {
            let list = &mut samples[starts[texel] as usize..starts[texel + 1] as usize];
            if list.len() > 1 {
                list.sort_unstable_by(|(p, a), (q, b)| a.depth.total_cmp(&b.depth).then(p.cmp(q)));
            }
        }
        let band = Self { starts, samples };
        match coverage {
            Coverage::Conservative => band,
            Coverage::Centre => band.without_equal_depths(),
        }
    }

    /// Of samples of equal depth in a texel, the first.
    fn without_equal_depths(mut self) -> Self {
        let mut kept = Vec::with_capacity(self.samples.len());
        let mut from = 0;
        for i in 0..self.starts.len() - 1 {
            let to = self.starts[i + 1] as usize;
            let first = kept.len();
            for sample in &self.samples[from..to] {
                let repeated = kept[first..]
                    .last()
                    .is_some_and(|(_, f): &(u32, Fragment)| f.depth == sample.1.depth);
                if !repeated {
                    kept.push(*sample);
                }
            }
            from = to;
            self.starts[i + 1] = kept.len() as u32;
        }
        self.samples = kept;
        self
    }

    /// One layer a pass.
    fn peeled(raster: &Raster, source: impl Fn(&mut dyn FnMut(u32, Fragment))) -> Self {
        let texels = (raster.size[0] * TILE) as usize;
        let mut complexity = vec![0u32; texels];
        source(&mut |_, fragment| complexity[place(&fragment)] += 1);
        let passes = complexity.iter().copied().max().unwrap_or(0);
        let mut reached = vec![f32::NEG_INFINITY; texels];
        let mut lists: Vec<Vec<(u32, Fragment)>> = vec![Vec::new(); texels];
        for _ in 0..passes {
            let mut nearest: Vec<Option<(u32, Fragment)>> = vec![None; texels];
            source(&mut |prim, fragment| {
                let texel = place(&fragment);
                let nearer = nearest[texel].is_none_or(|(_, f)| fragment.depth < f.depth);
                if fragment.depth > reached[texel] && nearer {
                    nearest[texel] = Some((prim, fragment));
                }
            });
            for (texel, found) in nearest.into_iter().enumerate() {
                if let Some(found) = found {
                    reached[texel] = found.1.depth;
                    lists[texel].push(found);
                }
            }
        }
        let mut starts = vec![0u32; texels + 1];
        for (i, list) in lists.iter().enumerate() {
            starts[i + 1] = starts[i] + list.len() as u32;
        }
        Self {
            starts,
            samples: lists.into_iter().flatten().collect(),
        }
    }

    /// The 32nds of the depth that samples of a texel lie in.
    fn occupied(&self, range: &[u32], hierarchy: Hierarchy, scale: f32, error: f32) -> u32 {
        if !hierarchy.occupancy() {
            return u32::MAX;
        }
        let samples = &self.samples[range[0] as usize..range[1] as usize];
        samples.iter().fold(0, |occupied, (_, fragment)| {
            let [low, high] = [fragment.range[0] - error, fragment.range[1] + error];
            occupied | coarse_slots(low, high, 32.0 / scale)
        })
    }

    /// Adds the samples to the lowest level's cells.
    fn bound(&self, level: &mut Level, band: u32, hierarchy: Hierarchy, scale: f32, error: f32) {
        let per_texel = 64.0 / scale;
        for (_, fragment) in &self.samples {
            let [column, row] = [fragment.column, band * TILE + fragment.row % TILE];
            let cell = (row >> level.shift[1]) * level.columns + (column >> level.shift[0]);
            let cell: &mut Cell = &mut level.cells[cell as usize];
            let range = [fragment.range[0] - error, fragment.range[1] + error];
            let occupied = if hierarchy.occupancy() {
                slots(range[0], range[1], per_texel)
            } else {
                u64::MAX
            };
            cell.add(range, occupied);
        }
    }
}
