//! The perspective grid of one light for hard shadows (HM08 §5.2).
//!
//! With the center of projection in the light every shadow ray is a point of the light's raster, so it lies in
//! exactly one cell of a 2-D grid, and only order along the ray remains. Each cell has the list of its casters
//! and a bound on the nearest of them: a receiver before that bound is lit without a test.
//!
//! A light that sees all of the geometry within 120 degrees has one face aimed at it, others have the six faces of
//! a cube, as far as there is geometry in them; a directional light has one parallel face. A face's raster shows only the window in which there is geometry. No
//! near plane is needed: triangles that come close to the light, or reach behind it, are set up in
//! homogeneous coordinates ([`crate::precise`]), so no occluder is clipped away.
//!
//! Casters: where a component is closed and neither the viewer nor the light is inside of it, its
//! back faces alone cast its whole shadow on everything the viewer can see, because every ray that enters it
//! leaves it again before it reaches the light. Elsewhere both sides cast. The caller says which, see
//! [`Casts`].
//!
//! Limits: where coordinates pass 1e30, or all of the geometry is smaller than 1e-27, every caster is tested for every
//! receiver.
//!
//! Layout: 16 bytes a vertex while building; 72 bytes a caster, 4 bytes a reference, 4 bytes a cell and 4 more
//! for each chunk of triangles. Rebuilt every
//! frame. Answers: exactly those of [`crate::BruteForce`], see [`crate::exact`].

mod nearest;
mod sheets;
mod veils;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::bins::{Binning, Bins, CellGrid};
use crate::exact;
use crate::eye_grid::project_all;
use crate::kernel::edges::{EdgeLanes, EdgeRecord, VertexLanes};
use crate::kernel::light_tree::Walk;
use crate::kernel::points::{Caster, PointLanes, RasterPlace, set_up_casters, shadowed};
use crate::kernel::project::RasterVertex;
use crate::kernel::veils::Veiled;
use crate::kernel::{LANES, SimdLevel};
use crate::light_costs::Extents;
use crate::precise::PreciseTriangle;
use crate::view::{Arrangement, View};
use crate::{Light, Receiver, Topology, Triangles};
use nearest::nearest_per_cell;
use sheets::Sheets;

/// Parameters of a [`PointLightGrid`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightGridOptions {
    /// Cells in each direction of a face, at most [`MAX_RESOLUTION`]; `None` chooses by number and size of the
    /// triangles.
    pub resolution: Option<u32>,
    /// How triangles are put into cells.
    pub binning: Binning,
    /// Only receivers within this cone are asked about; one face then serves a light anywhere.
    pub cone: Option<Cone>,
    /// How many receivers are expected to ask: what a build may cost follows from it.
    pub receivers: u64,
}

impl Default for LightGridOptions {
    fn default() -> Self {
        Self {
            resolution: None,
            binning: Binning::Overlap,
            cone: None,
            receivers: 1_000_000,
        }
    }
}

impl LightGridOptions {
    /// The literal parameters of HM08: 200 x 200 cells, filled by bounding rectangle.
    pub fn paper() -> Self {
        Self {
            resolution: Some(200),
            binning: Binning::Rectangle,
            ..Self::default()
        }
    }
}

/// The cone of a spot light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Unit axis.
    pub axis: DVec3,
    /// Half angle in radians, below a quarter turn.
    pub half_angle: f64,
}

/// Which sides of a triangle cast a shadow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Casts {
    /// Neither.
    Nothing,
    /// The back: it casts if it is turned away from the light, or seen edge-on.
    Back,
    /// Both sides.
    #[default]
    Both,
}

/// What each triangle casts.
pub type CastRule<'r> = &'r (dyn Fn(u32) -> Casts + Sync);

/// A light's grid over one frame's triangles.
#[derive(Clone, Debug)]
pub struct PointLightGrid<'a> {
    light: Light,
    triangles: Triangles<'a>,
    level: SimdLevel,
    faces: Vec<Face>,
    /// Casters to be tested one by one, where the geometry is too large or too small to be projected.
    unprojected: Vec<u32>,
}

#[derive(Clone, Debug)]
struct Face {
    view: View,
    bins: Bins,
    casters: Vec<Caster>,
    /// Per cell, a nearness that no caster in it exceeds.
    nearest: Vec<f32>,
    /// Per cell, a nearness below which everything is in shadow; empty if that was not looked for.
    dark: Vec<f32>,
}

/// What became of the receivers asked about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounts {
    /// Receivers.
    pub receivers: u64,
    /// Those lit by their cell's bound, or in no caster's box of a tree: without a test.
    pub lit_by_cell: u64,
    /// Those in shadow as casters cover their cell whole, without a test.
    pub dark_by_cell: u64,
    /// Pairs of receiver and triangle decided exactly.
    pub exact_pairs: u64,
    /// Nodes of a tree entered, once for each receiver.
    pub nodes: u64,
    /// Triangles of a tree in whose box a receiver lies, once for each receiver.
    pub tests: u64,
}

/// What a cell has for a receiver in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightCell {
    /// Casters that it lists.
    pub casters: usize,
    /// Whether the cell decides without a test: the receiver lies before all of them, or behind some that cover the cell.
    pub spared: bool,
}

/// Working memory of one thread for shadow queries.
#[derive(Clone, Debug, Default)]
pub struct ShadowScratch {
    pending: Vec<Pending>,
    unsure: Vec<(u32, u32)>,
    pub(crate) points: PointLanes,
    pub(crate) walk: Walk,
    veils: Vec<Veiled>,
    /// Totals of all queries made with this memory.
    pub counts: ShadowCounts,
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    face: u32,
    cell: u32,
    receiver: u32,
    place: RasterPlace,
}

impl<'a> PointLightGrid<'a> {
    /// Builds the grid, on all threads of the current rayon pool.
    pub fn build(
        light: Light,
        triangles: Triangles<'a>,
        rule: CastRule,
        options: LightGridOptions,
        level: SimdLevel,
    ) -> Self {
        Self::build_over(light, (triangles, None), rule, options, level)
    }

    /// As [`Self::build`], over triangles of which is known how they hang together: cells that they cover whole then decide
    /// what is dark, where there are few references for the receivers. It changes no answer about receivers on triangles.
    ///
    /// # Panics
    /// If the topology is not that of as many triangles.
    pub fn build_with_topology(
        light: Light,
        triangles: Triangles<'a>,
        topology: &Topology,
        rule: CastRule,
        options: LightGridOptions,
        level: SimdLevel,
    ) -> Self {
        assert_eq!(topology.neighbours().len(), triangles.len(), "of these triangles");
        Self::build_over(light, (triangles, Some(topology)), rule, options, level)
    }

    fn build_over(
        light: Light,
        (triangles, topology): (Triangles<'a>, Option<&Topology>),
        rule: CastRule,
        options: LightGridOptions,
        level: SimdLevel,
    ) -> Self {
        let mut grid = Self {
            light,
            triangles,
            level,
            faces: Vec::new(),
            unprojected: Vec::new(),
        };
        if let Some(faces) = crate::light_views::views(&light, &triangles, options.cone, None) {
            let keep = |prim: u32| takes_part(&light, &triangles, rule(prim), prim);
            let over = (&triangles, topology);
            let face = |view| Face::build(view, over, &keep, &options, level);
            grid.faces = faces.views.into_iter().map(face).collect();
        } else {
            grid.unprojected = finite_casters(&light, &triangles, rule);
        }
        grid
    }

    /// Cells of all faces.
    pub fn cell_count(&self) -> usize {
        self.faces.iter().map(|f| f.nearest.len()).sum()
    }

    /// References from cells to casters.
    pub fn reference_count(&self) -> usize {
        self.faces.iter().map(|f| f.bins.reference_count()).sum()
    }

    /// Triangles that cast, counted once a face.
    pub fn caster_count(&self) -> usize {
        self.faces.iter().map(|f| f.casters.len()).sum()
    }

    /// Bytes held by the grid.
    pub fn bytes(&self) -> usize {
        let face = |f: &Face| {
            let cells = (f.nearest.capacity() + f.dark.capacity()) * 4;
            f.bins.bytes() + f.casters.capacity() * size_of::<Caster>() + cells
        };
        self.faces.iter().map(face).sum()
    }

    /// For each receiver, whether a triangle lies between it and the light. `shadow` is overwritten and gets
    /// one entry a receiver. Receivers that are not finite, or where the light stands, are not in shadow.
    pub fn shadowed(&self, receivers: &[Receiver], scratch: &mut ShadowScratch, shadow: &mut Vec<bool>) {
        shadow.clear();
        shadow.resize(receivers.len(), false);
        if !self.unprojected.is_empty() {
            scratch.counts.receivers += receivers.len() as u64;
            shadowed_one_by_one(&self.light, &self.triangles, &self.unprojected, receivers, shadow);
            return;
        }
        self.sort_into_cells(receivers, scratch, |i| shadow[i] = true);
        let pending = std::mem::take(&mut scratch.pending);
        for same_cell in pending.chunk_by(|a, b| (a.face, a.cell) == (b.face, b.cell)) {
            for batch in same_cell.chunks(LANES) {
                self.test_batch(batch, receivers, scratch, shadow);
            }
        }
        scratch.pending = pending;
    }

    /// What the cell that a receiver lies in holds; `None` if no caster can be before the receiver.
    pub fn cell_of(&self, receiver: &Receiver) -> Option<LightCell> {
        let (face, place) = locate(self.faces.iter().map(|face| &face.view), receiver)?;
        let face = &self.faces[face];
        let cell = face.cell(place.x, place.y);
        Some(LightCell {
            casters: face.bins.cell(cell).map(<[u32]>::len).sum(),
            spared: place.nearness >= face.nearest[cell] || face.hides(cell, &place),
        })
    }

    /// Leaves in `scratch.pending` the receivers that their cell does not decide, ordered by cell; tells of those that it
    /// finds dark.
    fn sort_into_cells(
        &self,
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        mut is_dark: impl FnMut(usize),
    ) {
        scratch.pending.clear();
        scratch.counts.receivers += receivers.len() as u64;
        for (i, receiver) in receivers.iter().enumerate() {
            let views = self.faces.iter().map(|face| &face.view);
            let Some((face, place)) = locate(views, receiver) else {
                continue;
            };
            let f = &self.faces[face];
            let cell = f.cell(place.x, place.y);
            if place.nearness >= f.nearest[cell] {
                scratch.counts.lit_by_cell += 1;
                continue;
            }
            if f.hides(cell, &place) {
                scratch.counts.dark_by_cell += 1;
                is_dark(i);
                continue;
            }
            let (face, cell) = (face as u32, cell as u32);
            scratch.pending.push(Pending {
                face,
                cell,
                receiver: i as u32,
                place,
            });
        }
        scratch
            .pending
            .sort_unstable_by_key(|p| (p.face, p.cell, p.receiver));
    }

    fn test_batch(
        &self,
        batch: &[Pending],
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        shadow: &mut [bool],
    ) {
        let face = &self.faces[batch[0].face as usize];
        for (lane, pending) in batch.iter().enumerate() {
            let own = receivers[pending.receiver as usize].prim;
            scratch.points.set(lane, &pending.place, own);
        }
        let all = u32::MAX >> (32 - batch.len() as u32);
        let mut open = all;
        scratch.unsure.clear();
        for refs in face
            .bins
            .cell(batch[0].cell as usize)
            .filter(|refs| !refs.is_empty())
        {
            open = shadowed(
                self.level,
                &scratch.points,
                open,
                &face.casters,
                refs,
                &mut scratch.unsure,
            );
            if open == 0 {
                break;
            }
        }
        for &(lane, prim) in &scratch.unsure {
            if open & (1 << lane) != 0 {
                scratch.counts.exact_pairs += 1;
                let receiver = &receivers[batch[lane as usize].receiver as usize];
                if exact::shadows(&self.triangles, prim, receiver, &self.light) {
                    open &= !(1 << lane);
                }
            }
        }
        for (lane, pending) in batch.iter().enumerate() {
            shadow[pending.receiver as usize] = open & (1 << lane) == 0;
        }
    }
}

impl Face {
    fn build(
        view: View,
        (triangles, topology): (&Triangles, Option<&Topology>),
        keep: &(dyn Fn(u32) -> bool + Sync),
        options: &LightGridOptions,
        level: SimdLevel,
    ) -> Self {
        let raster = |resolution: u32| {
            let size = [f64::from(view.width), f64::from(view.height)];
            view.window([0.0; 2], size, [resolution; 2])
        };
        let resolution = options.resolution.unwrap_or_else(|| {
            let coarse = raster(SURVEY_RESOLUTION);
            survey(
                &project_all(level, &coarse, triangles),
                triangles,
                options.receivers,
            )
        });
        let view = raster(resolution.clamp(1, MAX_RESOLUTION));
        let grid = CellGrid {
            cells: [view.width, view.height],
            side: 1.0,
            size: [view.width as f32, view.height as f32],
            pixel_centres: false,
        };
        let vertices = project_all(level, &view, triangles);
        let mut bins = Bins::build(&view, triangles, &vertices, &grid, options.binning, keep);
        let prims = bins.number_references(triangles.len());
        let casters = set_up_all(level, &view, triangles, &vertices, &prims);
        let nearest = nearest_per_cell(&view, triangles, &vertices, &bins, &prims, &casters);
        let few = bins.reference_count() as u64 * RECEIVERS_A_REFERENCE <= options.receivers;
        let dark = topology.filter(|_| few).map_or_else(Vec::new, |topology| {
            let sheets = Sheets::new(triangles, &vertices, (&prims, &casters), topology);
            sheets.dark_per_cell(&view, &bins)
        });
        Self {
            view,
            bins,
            casters,
            nearest,
            dark,
        }
    }

    /// Whether what covers a point's cell whole lies before it.
    #[inline]
    fn hides(&self, cell: usize, place: &RasterPlace) -> bool {
        self.dark.get(cell).is_some_and(|&dark| place.beyond < dark) && self.shows(place)
    }

    /// Whether a raster point lies within the raster, and not only next to it.
    #[inline]
    fn shows(&self, &RasterPlace { x, y, .. }: &RasterPlace) -> bool {
        x >= 0.0 && y >= 0.0 && x <= self.view.width as f32 && y <= self.view.height as f32
    }

    /// Cell of a raster point; points a little outside belong to the border.
    #[inline]
    fn cell(&self, x: f32, y: f32) -> usize {
        let column = (x.max(0.0) as u32).min(self.view.width - 1);
        let row = (y.max(0.0) as u32).min(self.view.height - 1);
        (row * self.view.width + column) as usize
    }
}

/// Of a light's faces the one a receiver lies in, and where; `None` if no caster can be before it.
#[inline]
pub(crate) fn locate<'v>(
    views: impl Iterator<Item = &'v View> + Clone,
    receiver: &Receiver,
) -> Option<(usize, RasterPlace)> {
    let point = receiver.point;
    let depth = |view: &View| (point - view.center.as_dvec3()).dot(view.forward);
    // Of a cube's faces the one whose axis is closest; a single face is its own maximum.
    let best = |best: (usize, f64), next: (usize, f64)| if next.1 > best.1 { next } else { best };
    let (face, along) = views.clone().map(depth).enumerate().reduce(best)?;
    if !(along > 0.0 && point.is_finite()) {
        return None;
    }
    let view = views.clone().nth(face)?;
    let h = view.homogeneous(point);
    let inverse = 1.0 / h.p.z;
    let nearness = h.m * inverse;
    let place = RasterPlace {
        x: (h.p.x * inverse) as f32,
        y: (h.p.y * inverse) as f32,
        nearness: nearness as f32,
        beyond: beyond(view, (along, nearness), receiver.error) as f32,
    };
    let within = |v: f32, size: u32| v >= -1.0 && v <= size as f32 + 1.0;
    let seen = within(place.x, view.width) && within(place.y, view.height);
    seen.then_some((face, place))
}

/// Nearness of what lies `error` before a point of that depth and nearness, at least that of the point itself. Written so that an
/// error which is no number leaves nothing sure.
#[inline]
fn beyond(view: &View, (depth, nearness): (f64, f64), error: f64) -> f64 {
    let beyond = match view.arrangement {
        Arrangement::Perspective if depth > error => 1.0 / (depth - error),
        Arrangement::Parallel { .. } if error < f64::INFINITY => nearness + error,
        _ => f64::INFINITY,
    };
    beyond.max(nearness)
}

/// Largest number of cells in each direction of a face.
pub const MAX_RESOLUTION: u32 = 2048;

/// Raster on which casters are measured before the resolution is chosen.
const SURVEY_RESOLUTION: u32 = 256;

/// To look at one reference for what a cell hides whole costs about as much as is saved for a receiver; so many receivers
/// have to be asking for each that it pays, for one in some eight is found dark.
const RECEIVERS_A_REFERENCE: u64 = 8;

/// Triangles measured to choose a resolution; more would not change it.
const SURVEY_TRIANGLES: usize = 16 * 1024;

/// Measures casters on the raster of [`SURVEY_RESOLUTION`] to choose the resolution of a face.
fn survey(vertices: &[RasterVertex], triangles: &Triangles, receivers: u64) -> u32 {
    let unit = SURVEY_RESOLUTION as f32;
    let step = (triangles.len() / SURVEY_TRIANGLES).max(1);
    let mut extents = Extents::default();
    for indices in triangles.indices.iter().step_by(step) {
        let [a, b, c] = indices.map(|i| &vertices[i as usize]);
        if a.nearness >= 0.0 && b.nearness >= 0.0 && c.nearness >= 0.0 {
            let [x, y] = [[a.x, b.x, c.x], [a.y, b.y, c.y]];
            extents.add([x.map(|v| v / unit), y.map(|v| v / unit)], step as f64);
        }
    }
    extents.resolution(receivers as f64)
}

/// The casters of a light that cannot be projected: all that are finite.
pub(crate) fn finite_casters(light: &Light, triangles: &Triangles, rule: CastRule) -> Vec<u32> {
    let casts = |&prim: &u32| takes_part(light, triangles, rule(prim), prim);
    let finite = |&prim: &u32| triangles.corners(prim).iter().all(|c| c.is_finite());
    let prims = 0..triangles.len() as u32;
    prims.filter(finite).filter(casts).collect()
}

/// Which receivers any of these casters hides from a light, each tested with each.
pub(crate) fn shadowed_one_by_one(
    light: &Light,
    triangles: &Triangles,
    casters: &[u32],
    receivers: &[Receiver],
    shadow: &mut [bool],
) {
    for (receiver, shadow) in receivers.iter().zip(shadow) {
        let hides = |&prim: &u32| exact::shadows(triangles, prim, receiver, light);
        *shadow = receiver.point.is_finite() && casters.iter().any(hides);
    }
}

/// Whether a triangle is put into the grid.
pub(crate) fn takes_part(light: &Light, triangles: &Triangles, casts: Casts, prim: u32) -> bool {
    match casts {
        Casts::Nothing => false,
        Casts::Both => true,
        Casts::Back => {
            // What is not finite stays and is sorted out later.
            let front = exact::side(triangles.corners(prim), light) > 0.0;
            !front
        }
    }
}

/// Set-ups done by one task.
const CASTER_CHUNK: usize = 8 * 1024;

pub(crate) fn set_up_all(
    level: SimdLevel,
    view: &View,
    triangles: &Triangles,
    vertices: &[RasterVertex],
    prims: &[u32],
) -> Vec<Caster> {
    let mut casters = vec![Caster::default(); prims.len()];
    let chunks = casters
        .par_chunks_mut(CASTER_CHUNK)
        .zip(prims.par_chunks(CASTER_CHUNK));
    chunks.for_each(|(casters, prims)| {
        let (mut lanes, mut edges) = (VertexLanes::default(), EdgeLanes::default());
        for (casters, prims) in casters.chunks_mut(LANES).zip(prims.chunks(LANES)) {
            lanes.count = 0;
            for &prim in prims {
                lanes.push(
                    prim,
                    triangles.indices[prim as usize].map(|i| &vertices[i as usize]),
                );
            }
            set_up_casters(level, &lanes, view.rounding() as f32, &mut edges);
            for (lane, caster) in casters.iter_mut().enumerate() {
                *caster = if edges.good & (1 << lane) != 0 {
                    let origin = [lanes.x[0][lane], lanes.y[0][lane]];
                    Caster {
                        record: edges.record(lane, prims[lane]),
                        origin,
                    }
                } else {
                    precise_caster(view, triangles.corners(prims[lane]), prims[lane])
                };
            }
        }
    });
    casters
}

/// A caster set up in f64 relative to the middle of the raster.
fn precise_caster(view: &View, corners: [Vec3; 3], prim: u32) -> Caster {
    let origin = [f64::from(view.width / 2), f64::from(view.height / 2)];
    let reach = f64::from(view.width.max(view.height));
    let record = PreciseTriangle::new(view, corners).map_or_else(
        // Nothing hits it: outside everywhere.
        || EdgeRecord {
            c: [f32::NEG_INFINITY; 3],
            prim,
            ..EdgeRecord::default()
        },
        |precise| precise.record(prim, origin, reach),
    );
    Caster {
        record,
        origin: origin.map(|v| v as f32),
    }
}

#[cfg(test)]
mod tests;
