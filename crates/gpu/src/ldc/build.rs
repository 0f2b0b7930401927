//! Building the cube: `raster.wgsl`, `scan.wgsl`, `sort.wgsl`, `peel.wgsl`, `levels.wgsl` in turn.
//!
//! Vertices are turned into texel coordinates in f64 here and rounded once, unless they are on the device already
//! (`skin/`); all that shaders do is in those.

use std::sync::Arc;

use rayon::prelude::*;
use rayward_trace::ldc::{Coverage, CubeFrame, DepthFormat, Hierarchy, LdcBuild, TILE};
use rayward_trace::{BuildStats, Triangles};
use wgpu::Buffer;

use super::layout::{Frame, Raise};
use super::shaders::{LEVELS, PACK, RASTER, SORT};
use super::{Buffers, Cube, CubeOptions, Stacks};
use crate::{Error, Gpu, PosedVertices, Result};

const LEAST_RESOLUTION: u32 = 16;
const MAX_RESOLUTION: u32 = 2048;
/// Rows of all triangles together, at most.
const MAX_ROWS: f64 = (1u64 << 28) as f64;
/// Bytes of a sample while it is built, and with sixteen bits of depth.
const SAMPLE: u64 = 12;
const PACKED: u64 = 8;
/// `doubt` of `common.wgsl`, for corners that came from f64 and for corners that the device has turned itself.
const DOUBT: f32 = 64.0;
const DEVICE_DOUBT: f32 = 96.0;
/// Threads of a workgroup of the shaders dispatched by [`groups`].
const GROUP: u64 = 64;
/// Workgroups for so many threads.
pub(crate) fn groups(threads: u64) -> u64 {
    threads.div_ceil(GROUP)
}

impl<'a> Cube<'a> {
    /// Builds over all triangles that are finite and have area. The same for any order in which the device runs its
    /// threads.
    pub fn build(gpu: &'a Gpu, triangles: Triangles<'a>, options: &CubeOptions) -> Result<Self> {
        let (prims, stats) = usable(&triangles);
        Ok(Self {
            gpu,
            triangles,
            stacks: vec![Arc::new(Stacks::build(gpu, &triangles, &prims, options, None)?)],
            rebuilt: stats.triangles,
            stats,
        })
    }

    /// [`Cube::build`] over triangles of these vertices, which come from where they were posed.
    ///
    /// # Errors
    /// As [`Cube::build`].
    ///
    /// # Panics
    /// If an index is beyond the last vertex.
    pub fn build_posed(
        posed: &'a PosedVertices<'a>,
        indices: &'a [[u32; 3]],
        options: &CubeOptions,
    ) -> Result<Self> {
        let (gpu, triangles) = (posed.gpu(), posed.triangles(indices));
        let (prims, stats) = usable(&triangles);
        let stacks = Stacks::build(gpu, &triangles, &prims, options, Some(posed))?;
        Ok(Self {
            gpu,
            triangles,
            stacks: vec![Arc::new(stacks)],
            rebuilt: stats.triangles,
            stats,
        })
    }
}

impl Stacks {
    /// Builds over these triangles, of vertices that are on the device already if they were posed there.
    pub(crate) fn build(
        gpu: &Gpu,
        triangles: &Triangles,
        prims: &[u32],
        options: &CubeOptions,
        posed: Option<&PosedVertices>,
    ) -> Result<Self> {
        let most = options.max_samples.min(gpu.largest_binding() / SAMPLE);
        let mut resolution = options.resolution.clamp(LEAST_RESOLUTION, MAX_RESOLUTION);
        loop {
            let last = resolution <= LEAST_RESOLUTION;
            let around = CubeFrame::around(triangles, prims, resolution);
            let snapped = posed.and_then(|posed| Some((posed, PosedVertices::frame(&around)?)));
            let frame = snapped.map_or(around, |(_, frame)| frame);
            let size = Size::estimate(&frame, triangles, prims);
            // Estimates are rather high; the count on the device decides.
            if last || (size.rows <= MAX_ROWS && size.samples <= 4.0 * most as f64) {
                let vertices = match snapped {
                    Some((posed, frame)) => (posed.texels(&frame)?, DEVICE_DOUBT),
                    None => (texels(gpu, &frame, triangles)?, DOUBT),
                };
                let stage = Stage::new(gpu, &frame, triangles, options, prims, size, vertices)?;
                let (samples, layers) = stage.count()?;
                if samples <= most {
                    return stage.finish(frame, options, samples, layers);
                }
                if last {
                    return Err(Error::Limits {
                        adapter: gpu.name(),
                        what: "the cube's samples",
                        needed: samples,
                        limit: most,
                    });
                }
            }
            resolution /= 2;
        }
    }
}

/// Ids of the triangles that take part.
pub(crate) fn usable(triangles: &Triangles) -> (Vec<u32>, BuildStats) {
    let all = || (0..triangles.len() as u32).into_par_iter();
    let prims: Vec<u32> = all().filter(|&p| !triangles.is_degenerate(p)).collect();
    let infinite = all()
        .filter(|&p| !triangles.corners(p).iter().all(|c| c.is_finite()))
        .count();
    let stats = BuildStats {
        triangles: prims.len(),
        dropped_non_finite: infinite,
        dropped_degenerate: triangles.len() - prims.len() - infinite,
    };
    (prims, stats)
}

/// What building will come to.
#[derive(Clone, Copy, Debug)]
struct Size {
    /// An upper bound.
    rows: f64,
    /// Rather more than there will be.
    samples: f64,
}

impl Size {
    fn estimate(frame: &CubeFrame, triangles: &Triangles, prims: &[u32]) -> Self {
        let (rows, samples) = prims
            .par_iter()
            .map(|&prim| {
                let [a, b, c] = triangles.corners(prim).map(|p| frame.texel(p.as_dvec3()));
                let extent = a.max(b).max(c) - a.min(b).min(c);
                let area = (b - a).cross(c - a).abs().max_element() * 0.5;
                (
                    extent.max_element() + 3.0,
                    area + 2.0 * extent.max_element() + 2.0,
                )
            })
            .reduce(|| (0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        Self { rows, samples }
    }
}

fn layout(frame: &CubeFrame, triangles: usize, options: &CubeOptions) -> (Frame, u64) {
    let raster = |axis: usize| [frame.size[(axis + 1) % 3], frame.size[(axis + 2) % 3]];
    let shifts: Vec<[u32; 2]> = match options.hierarchy {
        Hierarchy::Flat => Vec::new(),
        Hierarchy::Tiles { log2 } => vec![log2.map(|n| n.clamp(1, 4))],
        Hierarchy::Pyramid => [7, 5, 3].map(|shift| [shift; 2]).to_vec(),
    };
    let mut first_texel = [0; 4];
    let mut cells = [[0; 4]; 9];
    let mut first_cell = 0;
    for axis in 0..3 {
        let size = raster(axis);
        first_texel[axis + 1] = first_texel[axis] + size[0] * size[1];
        for (level, shift) in shifts.iter().enumerate() {
            let [columns, rows] = [0, 1].map(|i| size[i].div_ceil(1 << shift[i]));
            cells[3 * axis + level] = [first_cell, columns, shift[0], shift[1]];
            first_cell += columns * rows;
        }
    }
    let conservative = options.build == LdcBuild::Csr(Coverage::Conservative);
    let layout = Frame {
        size: frame.size,
        triangles: triangles as u32,
        first_texel,
        levels: shifts.len() as u32,
        conservative: u32::from(conservative),
        occupancy: u32::from(options.hierarchy == Hierarchy::Pyramid),
        doubt: DOUBT,
        // As `common.wgsl` counts them.
        depth: match options.depth {
            DepthFormat::F32 => 0,
            DepthFormat::U16 => 1,
            DepthFormat::F16 => 2,
        },
        pad_a: 0,
        pad_b: 0,
        pad_c: 0,
        cells,
    };
    (layout, u64::from(first_cell))
}

/// Triangles on the device in the coordinates of a cube that is not built: what structures that test triangles as the cube
/// does have in common.
#[derive(Debug)]
pub(crate) struct Placed {
    pub(crate) frame: CubeFrame,
    layout: Buffer,
    positions: Buffer,
    indices: Buffer,
}

impl Placed {
    /// Texels along the longest side.
    const RESOLUTION: u32 = 1024;

    pub(crate) fn new(gpu: &Gpu, triangles: &Triangles, prims: &[u32]) -> Result<Self> {
        let frame = CubeFrame::around(triangles, prims, Self::RESOLUTION);
        let options = CubeOptions {
            hierarchy: Hierarchy::Flat,
            ..CubeOptions::default()
        };
        let (layout, _) = layout(&frame, triangles.len(), &options);
        Ok(Self {
            frame,
            layout: gpu.uniform("the frame of coordinates", &layout)?,
            positions: texels(gpu, &frame, triangles)?,
            indices: corners(gpu, triangles, prims)?,
        })
    }

    /// What `meet.wgsl` needs.
    pub(crate) fn bindings(&self) -> [(u32, &Buffer); 3] {
        [(0, &self.layout), (1, &self.positions), (2, &self.indices)]
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.positions.size() + self.indices.size()
    }
}

/// Vertices in texel coordinates.
fn texels(gpu: &Gpu, frame: &CubeFrame, triangles: &Triangles) -> Result<Buffer> {
    let positions: Vec<[f32; 3]> = (0..triangles.x.len() as u32)
        .into_par_iter()
        .map(|i| frame.texel(triangles.vertex(i).as_dvec3()).as_vec3().to_array())
        .collect();
    gpu.uploaded("vertices", &positions)
}

/// The corners of all triangles that take part.
fn corners(gpu: &Gpu, triangles: &Triangles, prims: &[u32]) -> Result<Buffer> {
    let mut indices = vec![[u32::MAX; 3]; triangles.len()];
    for &prim in prims {
        indices[prim as usize] = triangles.indices[prim as usize];
    }
    gpu.uploaded("triangles", &indices)
}

/// A build at one resolution, under way.
struct Stage<'a> {
    gpu: &'a Gpu,
    triangles: u64,
    layout: Frame,
    cells: u64,
    rows: u64,
    frame: Buffer,
    positions: Buffer,
    indices: Buffer,
    row_starts: Buffer,
    starts: Buffer,
}

impl<'a> Stage<'a> {
    fn new(
        gpu: &'a Gpu,
        frame: &CubeFrame,
        triangles: &Triangles,
        options: &CubeOptions,
        prims: &[u32],
        size: Size,
        (positions, doubt): (Buffer, f32),
    ) -> Result<Self> {
        if size.rows > MAX_ROWS {
            return Err(Error::Limits {
                adapter: gpu.name(),
                what: "rows of triangles",
                needed: size.rows as u64,
                limit: MAX_ROWS as u64,
            });
        }
        let indices = corners(gpu, triangles, prims)?;
        let (layout, cells) = layout(frame, triangles.len(), options);
        let layout = Frame { doubt, ..layout };
        let texels = u64::from(layout.first_texel[3]);
        Ok(Self {
            gpu,
            triangles: triangles.len() as u64,
            layout,
            cells,
            rows: size.rows as u64,
            frame: gpu.uniform("the cube's layout", &layout)?,
            positions,
            indices,
            row_starts: gpu.storage("rows of triangles", 4 * (triangles.len() as u64 + 1))?,
            starts: gpu.storage("the cube's texels", 4 * (texels + 1))?,
        })
    }

    fn texels(&self) -> u64 {
        u64::from(self.layout.first_texel[3])
    }

    /// Counts samples; returns how many there are, and how many in the fullest texel.
    fn count(&self) -> Result<(u64, u32)> {
        let triangles = self.triangles;
        let mut bindings = vec![
            (0, &self.frame),
            (1, &self.positions),
            (2, &self.indices),
            (3, &self.row_starts),
        ];
        self.gpu.dispatch(&RASTER, "rows", &bindings, groups(triangles))?;
        self.gpu.scan(&self.row_starts, triangles + 1)?;
        bindings.push((4, &self.starts));
        self.gpu
            .dispatch(&RASTER, "count", &bindings, groups(self.rows))?;
        let layers = self.gpu.scan(&self.starts, self.texels() + 1)?;
        let total: u32 = self.gpu.read(&self.starts, self.texels(), 1)?[0];
        Ok((u64::from(total), layers))
    }

    fn finish(self, frame: CubeFrame, options: &CubeOptions, count: u64, layers: u32) -> Result<Stacks> {
        let next = self.gpu.storage("the cube's texels", 4 * (self.texels() + 1))?;
        self.gpu.copy(&self.starts, &next, 4 * (self.texels() + 1))?;
        let samples = self.gpu.storage("the cube's samples", SAMPLE * count)?;
        let cells = self.gpu.storage("the cube's cells", 16 * self.cells)?;
        match options.build {
            LdcBuild::Csr(_) => self.fill(&next, &samples, &cells)?,
            LdcBuild::Peel => self.peel(&next, &samples, &cells, layers)?,
        }
        for level in (1..self.layout.levels).rev() {
            for axis in 0..3 {
                self.raise(&cells, axis, level - 1)?;
            }
        }
        let samples = match options.depth {
            DepthFormat::F32 => samples,
            DepthFormat::U16 | DepthFormat::F16 => self.packed(&samples, count)?,
        };
        self.gpu.wait()?;
        Ok(Stacks {
            frame,
            layout: self.layout,
            depth: options.depth,
            samples: count,
            layers,
            complete: self.layout.conservative == 1,
            buffers: Buffers {
                frame: self.frame,
                positions: self.positions,
                indices: self.indices,
                starts: self.starts,
                samples,
                cells,
            },
        })
    }

    /// The second sweep, and the order within texels.
    fn fill(&self, next: &Buffer, samples: &Buffer, cells: &Buffer) -> Result<()> {
        let bindings = [
            (0, &self.frame),
            (1, &self.positions),
            (2, &self.indices),
            (3, &self.row_starts),
            (4, next),
            (5, samples),
            (6, cells),
        ];
        self.gpu.dispatch(&RASTER, "fill", &bindings, groups(self.rows))?;
        let bindings = [(0, &self.frame), (1, &self.starts), (2, samples)];
        self.gpu.dispatch(&SORT, "sort", &bindings, groups(self.texels()))
    }

    /// The samples with sixteen bits of depth.
    fn packed(&self, samples: &Buffer, count: u64) -> Result<Buffer> {
        let packed = self.gpu.storage("the cube's packed samples", PACKED * count)?;
        let bindings = [(0, &self.frame), (1, &self.starts), (2, samples), (3, &packed)];
        self.gpu
            .dispatch(&PACK, "pack", &bindings, groups(self.texels()))?;
        Ok(packed)
    }

    /// A pass for each layer.
    fn peel(&self, next: &Buffer, samples: &Buffer, cells: &Buffer, layers: u32) -> Result<()> {
        let peeled = self.gpu.storage("peeling", 12 * self.texels())?;
        let read = [
            (0, &self.frame),
            (1, &self.positions),
            (2, &self.indices),
            (3, &self.row_starts),
            (7, &peeled),
        ];
        let take = [&read[..], &[(4, next), (5, samples), (6, cells)]].concat();
        let rows = groups(self.rows);
        for _ in 0..layers {
            self.gpu.dispatch(&RASTER, "peel_depth", &read, rows)?;
            self.gpu.dispatch(&RASTER, "peel_owner", &read, rows)?;
            self.gpu.dispatch(&RASTER, "peel_take", &take, rows)?;
            let all = [(0, &self.frame), (7, &peeled)];
            self.gpu
                .dispatch(&RASTER, "peel_next", &all, groups(self.texels()))?;
        }
        let end = [(0, &self.frame), (4, next), (5, samples), (8, &self.starts)];
        self.gpu
            .dispatch(&RASTER, "peel_end", &end, groups(self.texels()))
    }

    /// Makes one level of one direction from the level below.
    fn raise(&self, cells: &Buffer, axis: usize, level: u32) -> Result<()> {
        let size = self.layout.size[(axis + 2) % 3];
        let rows = |level: u32| size.div_ceil(1 << self.layout.cells[3 * axis + level as usize][3]);
        let constants = Raise {
            axis: axis as u32,
            level,
            rows: rows(level),
            rows_below: rows(level + 1),
        };
        let raise = self.gpu.uniform("a level of cells", &constants)?;
        let count = self.layout.cells[3 * axis + level as usize][1] * constants.rows;
        let bindings = [(0, &self.frame), (1, cells), (2, &raise)];
        self.gpu
            .dispatch(&LEVELS, "raise", &bindings, groups(u64::from(count)))
    }
}

const _: () = assert!(TILE == 8, "common.wgsl has tiles of this size");
