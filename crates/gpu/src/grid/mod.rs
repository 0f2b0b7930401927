//! [`GpuGrid`]: a perspective grid in a GPU's memory, for the rays of one vantage: what a camera sees, the hard shadows of
//! one light (HM08 §5.1 and §5.2, which hopes for such on GPUs).
//!
//! Triangles are flattened by the vantage on the CPU, in f64 (`plates.rs`); rows of flat triangles are counted into the
//! cells that they touch, scanned, filled in and sorted by depth in `grid.wgsl`. A ray is one cell: `look.wgsl` tests its
//! triangles front to back, in the same coordinates and with the same test as the cube, so what f32 cannot tell is asked of
//! a structure on the CPU here, too. A light among the triangles has up to six faces, whose cells follow each other.
//!
//! Layout: 4 bytes a cell, 8 an entry, 44 a flat triangle while it is built. Limits: what the cube's are for coordinates; a
//! grid of more entries than a binding takes gets cells of twice the side. Cells of more than 1,024 entries are in no order, and their
//! rays are asked of the CPU: Mesa's software driver leaves a thread's loops after some 65,000 rounds, sorted or not.

mod plates;
#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use rayward_trace::{Accel, Bvh, Light, Receiver, Triangles, View, ViewRay, views_of_light};
use wgpu::Buffer;

use crate::batch::{Structure, Traced};
use crate::ldc::build::{Placed, groups, usable};
use crate::ldc::shaders::{GRID, LOOK};
use crate::{Error, Gpu, Result, TraceStats};
pub(crate) use plates::Plate;
use plates::plates;

/// Pixels of a cell's side in a camera's grid.
const PIXELS: u32 = 4;

/// Cells of a light's grid for each triangle, and bounds of its side.
const CELLS: f64 = 4.0;
const SIDES: [f64; 2] = [32.0, 1024.0];

/// Bytes of an entry.
const ENTRY: u64 = 8;

/// `Grid` of `grid.wgsl`.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Grid {
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    pub(crate) plates: u32,
    pub(crate) cells: u32,
}

/// `Place` of `look.wgsl`.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Place {
    pub(crate) cell: u32,
    pub(crate) depth: f32,
    pub(crate) rate: f32,
    pub(crate) pad: u32,
}

/// The triangles of one frame on the device, as all grids of the frame test them.
#[derive(Debug)]
pub struct GridGeometry<'a> {
    gpu: &'a Gpu,
    triangles: Triangles<'a>,
    prims: Vec<u32>,
    placed: Placed,
}

impl<'a> GridGeometry<'a> {
    /// Sends triangles to the device.
    ///
    /// # Errors
    /// Those of the device.
    pub fn new(gpu: &'a Gpu, triangles: Triangles<'a>) -> Result<Self> {
        let (prims, _) = usable(&triangles);
        Ok(Self {
            placed: Placed::new(gpu, &triangles, &prims)?,
            gpu,
            triangles,
            prims,
        })
    }
}

/// A perspective grid over the triangles of one frame.
#[derive(Debug)]
pub struct GpuGrid<'a> {
    geometry: &'a GridGeometry<'a>,
    /// The vantage, if it is a camera's: rays are then numbered by its pixels.
    camera: Option<View>,
    /// Rasters of cells.
    faces: Vec<View>,
    starts: Buffer,
    entries: Buffer,
    entry_count: u64,
}

impl<'a> GpuGrid<'a> {
    /// The grid of a camera.
    ///
    /// # Errors
    /// Those of the device.
    pub fn of_camera(geometry: &'a GridGeometry<'a>, view: &View) -> Result<Self> {
        let size = [view.width, view.height].map(|pixels| pixels.div_ceil(PIXELS));
        let covered = size.map(|cells| f64::from(cells * PIXELS));
        Self::build(geometry, Some(*view), vec![view.window([0.0; 2], covered, size)])
    }

    /// The grid of a light; `None` if the geometry is too large or too small to be projected.
    ///
    /// # Errors
    /// Those of the device.
    pub fn of_light(geometry: &'a GridGeometry<'a>, light: &Light) -> Result<Option<Self>> {
        let Some(views) = views_of_light(light, &geometry.triangles) else {
            return Ok(None);
        };
        let cells = CELLS * geometry.prims.len() as f64 / views.len().max(1) as f64;
        let side = cells.sqrt().clamp(SIDES[0], SIDES[1]) as u32;
        let faces = views
            .iter()
            .map(|view| view.window([0.0; 2], [1.0; 2], [side; 2]));
        Self::build(geometry, None, faces.collect()).map(Some)
    }

    fn build(geometry: &'a GridGeometry<'a>, camera: Option<View>, mut faces: Vec<View>) -> Result<Self> {
        let gpu = geometry.gpu;
        let most = gpu.largest_binding() / ENTRY;
        loop {
            let (starts, layout, bound) = Self::count(geometry, &faces)?;
            let count = u64::from(gpu.read::<u32>(&starts, u64::from(layout.cells), 1)?[0]);
            let least = faces.iter().all(|face| face.width <= 16 && face.height <= 16);
            if count <= most {
                let entries = gpu.storage("a grid's entries", ENTRY * count)?;
                Self::fill(gpu, layout, &bound, &starts, &entries)?;
                return Ok(Self {
                    geometry,
                    camera,
                    faces,
                    starts,
                    entries,
                    entry_count: count,
                });
            }
            if least {
                return Err(Error::Limits {
                    adapter: gpu.name(),
                    what: "a grid's entries",
                    needed: count,
                    limit: most,
                });
            }
            for face in &mut faces {
                let size = [face.width, face.height].map(|cells| cells.div_ceil(2));
                *face = face.window([0.0; 2], size.map(|cells| f64::from(2 * cells)), size);
            }
        }
    }

    /// Flattens the triangles and counts entries: where each cell's start, what was counted, the plates and their rows.
    fn count(geometry: &GridGeometry, faces: &[View]) -> Result<(Buffer, Grid, [Buffer; 2])> {
        let gpu = geometry.gpu;
        let of_face = faces.first().map_or(0, |face| face.width * face.height);
        let mut all = Vec::new();
        for (i, face) in faces.iter().enumerate() {
            all.extend(plates(
                face,
                &geometry.triangles,
                &geometry.prims,
                i as u32 * of_face,
            ));
        }
        let mut rows: Vec<u32> = Vec::with_capacity(all.len() + 1);
        let mut total = 0u32;
        for (_, count) in &all {
            rows.push(total);
            total = total.saturating_add(*count);
        }
        rows.push(total);
        let layout = Grid {
            columns: faces.first().map_or(1, |face| face.width),
            rows: total,
            plates: all.len() as u32,
            cells: faces.len() as u32 * of_face,
        };
        let flat: Vec<Plate> = all.iter().map(|(plate, _)| *plate).collect();
        let buffers = [
            gpu.uploaded("flat triangles", &flat)?,
            gpu.uploaded("rows of flat triangles", &rows)?,
        ];
        let starts = gpu.storage("a grid's cells", 4 * (u64::from(layout.cells) + 1))?;
        let constants = gpu.uniform("a grid", &layout)?;
        let bindings = [(1, &constants), (2, &buffers[0]), (3, &buffers[1]), (4, &starts)];
        gpu.dispatch(&GRID, "count", &bindings, groups(u64::from(layout.rows)))?;
        gpu.scan(&starts, u64::from(layout.cells) + 1)?;
        Ok((starts, layout, buffers))
    }

    /// The second sweep, and the order within cells.
    fn fill(
        gpu: &Gpu,
        layout: Grid,
        [plates, rows]: &[Buffer; 2],
        starts: &Buffer,
        entries: &Buffer,
    ) -> Result<()> {
        let bytes = 4 * (u64::from(layout.cells) + 1);
        let next = gpu.storage("a grid's cells", bytes)?;
        gpu.copy(starts, &next, bytes)?;
        let constants = gpu.uniform("a grid", &layout)?;
        let bindings = [(1, &constants), (2, plates), (3, rows), (4, &next), (5, entries)];
        gpu.dispatch(&GRID, "fill", &bindings, groups(u64::from(layout.rows)))?;
        let bindings = [(1, &constants), (5, entries), (6, starts)];
        gpu.dispatch(&GRID, "order", &bindings, groups(u64::from(layout.cells)))?;
        gpu.wait()
    }

    /// Entries of all cells.
    pub fn entries(&self) -> u64 {
        self.entry_count
    }

    /// Memory of the grid on the device in bytes, without the triangles.
    pub fn bytes(&self) -> u64 {
        self.starts.size() + self.entries.size()
    }

    /// The first triangle that each pixel's ray meets; nothing but for a camera's grid.
    ///
    /// # Errors
    /// Those of the device.
    pub fn seen(&self, pixels: &[[u32; 2]], cpu: &Bvh) -> Result<(Vec<Option<u32>>, TraceStats)> {
        let Some(camera) = self.camera else {
            return Ok((vec![None; pixels.len()], TraceStats::default()));
        };
        let rays: Vec<ViewRay> = pixels.iter().map(|&[x, y]| camera.pixel_ray(x, y)).collect();
        let face = &self.faces[0];
        let scale = f64::from(camera.width.div_ceil(PIXELS) * PIXELS) / f64::from(face.width);
        let rows = f64::from(camera.height.div_ceil(PIXELS) * PIXELS) / f64::from(face.height);
        let place = |i: usize| {
            let [x, y] = pixels[i];
            let column = ((f64::from(x) + 0.5) / scale) as u32;
            let row = ((f64::from(y) + 0.5) / rows) as u32;
            let cell = row.min(face.height - 1) * face.width + column.min(face.width - 1);
            Some((cell, face))
        };
        self.traced(&place).seen(&rays, cpu)
    }

    /// Whether some triangle lies between each receiver and the light of the grid.
    ///
    /// # Errors
    /// Those of the device.
    pub fn shadowed(
        &self,
        receivers: &[Receiver],
        light: &Light,
        cpu: &impl Accel,
    ) -> Result<(Vec<bool>, TraceStats)> {
        let queries: Vec<(Receiver, Light)> = receivers.iter().map(|r| (*r, *light)).collect();
        let place = |i: usize| {
            let point = receivers[i].point;
            self.faces.iter().enumerate().find_map(|(n, face)| {
                let p = face.homogeneous(point).p;
                let [x, y] = [p.x / p.z, p.y / p.z];
                let [width, height] = [face.width, face.height].map(f64::from);
                let inside = p.z > 0.0 && x >= 0.0 && y >= 0.0 && x < width && y < height;
                let cell = (n as u32 * face.height + y as u32) * face.width + x as u32;
                inside.then_some((cell, face))
            })
        };
        self.traced(&place).shadowed(&queries, cpu)
    }

    fn traced<'c>(&'c self, placing: &'c crate::batch::Placing<'c>) -> Traced<'c> {
        let geometry = self.geometry;
        let mut bindings = geometry.placed.bindings().to_vec();
        bindings.extend([(3, &self.starts), (4, &self.entries)]);
        let grid = Structure {
            frame: geometry.placed.frame,
            empty: geometry.prims.is_empty() || self.faces.is_empty(),
            complete: true,
            bindings,
            placing: Some(placing),
        };
        Traced {
            gpu: geometry.gpu,
            triangles: geometry.triangles,
            program: &LOOK,
            structures: vec![grid],
        }
    }
}
