//! The tree of one light for hard shadows: an adaptive structure in perspective space (Hunt and Mark: *Adaptive
//! Acceleration Structures in Perspective Space*; HM08 §5.2 asks the same of a grid).
//!
//! With the center of projection in the light every shadow ray is a point of the light's raster. A grid has cells of one
//! size there; where a few casters are much larger than the others, or most of them lie together, a cell of them is too
//! coarse or too fine. Here casters lie in a hierarchy of rectangles, each with the nearness of its nearest caster, sixteen
//! to a node, that is cut by the area which rays see ([`build`]). Sixteen neighbouring receivers walk it together
//! ([`crate::kernel::light_tree`]); those in no caster's box are lit without a test.
//!
//! Faces, casters and set-up are those of [`crate::PointLightGrid`]. Answers: exactly those of [`crate::BruteForce`].
//!
//! Layout: 72 bytes a caster, 448 bytes a node, of which there is one for some nine casters; 16 bytes a vertex and 28 a
//! caster more while building. Rebuilt every frame. Cost: some 150 ns a caster to build. Limits: those of the grid.

mod build;

use rayon::prelude::*;

use crate::exact;
use crate::eye_grid::project_all;
use crate::kernel::light_tree::{CASTER, Node, walk};
use crate::kernel::points::Caster;
use crate::kernel::project::RasterVertex;
use crate::kernel::{LANES, NEARNESS_BAND, SimdLevel};
use crate::light_grid::{
    CastRule, Cone, ShadowScratch, finite_casters, locate, set_up_all, shadowed_one_by_one, takes_part,
};
use crate::precise::PreciseTriangle;
use crate::view::View;
use crate::{Light, Receiver, Triangles};
use build::{Built, Entry, Metric};

/// A light's tree over one frame's triangles.
#[derive(Clone, Debug)]
pub struct PointLightTree<'a> {
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
    nodes: Vec<Node>,
    casters: Vec<Caster>,
    /// Nodes and casters that a ray of this face is expected to meet.
    predicted: [f64; 2],
    /// Solid extent of what is seen, as a weight among the faces.
    weight: f64,
}

/// What a ray passes in a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TreeSteps {
    /// Nodes that it enters, of sixteen boxes each.
    pub nodes: f64,
    /// Triangles in whose box it lies.
    pub triangles: f64,
}

/// Raster units of a face in each direction. Boxes are f32, so that it matters little.
const SIDE: u32 = 1024;

/// How far outside of its rectangle a caster may be met, see [`crate::bins`].
const SLACK: f32 = 1.0 / 64.0;

impl<'a> PointLightTree<'a> {
    /// Builds the tree, on all threads of the current rayon pool. With a cone only receivers within it are asked about.
    pub fn build(
        light: Light,
        triangles: Triangles<'a>,
        rule: CastRule,
        cone: Option<Cone>,
        level: SimdLevel,
    ) -> Self {
        let mut tree = Self {
            light,
            triangles,
            level,
            faces: Vec::new(),
            unprojected: Vec::new(),
        };
        let takes_part = |prim: u32| takes_part(&light, &triangles, rule(prim), prim);
        if let Some(faces) = crate::light_views::views(&light, &triangles, cone, None) {
            let face = |view: View| {
                let size = [f64::from(view.width), f64::from(view.height)];
                let view = view.window([0.0; 2], size, [SIDE; 2]);
                Face::build(view, &triangles, &takes_part, level)
            };
            tree.faces = faces.views.into_iter().map(face).collect();
        } else {
            tree.unprojected = finite_casters(&light, &triangles, rule);
        }
        tree
    }

    /// Nodes of all faces.
    pub fn node_count(&self) -> usize {
        self.faces.iter().map(|f| f.nodes.len()).sum()
    }

    /// Triangles that cast, counted once a face.
    pub fn caster_count(&self) -> usize {
        self.faces.iter().map(|f| f.casters.len()).sum()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.node_count() * size_of::<Node>() + self.caster_count() * size_of::<Caster>()
    }

    /// What the metric that the tree is built by expects of a ray that nothing stops: receivers spread over the raster
    /// as casters are.
    pub fn predicted(&self) -> TreeSteps {
        let weight: f64 = self.faces.iter().map(|f| f.weight).sum();
        let mean = |i: usize| {
            let sum: f64 = self.faces.iter().map(|f| f.predicted[i] * f.weight).sum();
            sum / weight.max(f64::MIN_POSITIVE)
        };
        TreeSteps {
            nodes: mean(0),
            triangles: mean(1),
        }
    }

    /// For each receiver, whether a triangle lies between it and the light. `shadow` is overwritten and gets one entry a
    /// receiver. Neighbours in the list should be neighbours in space. Receivers that are not finite, or where the light
    /// stands, are not in shadow.
    pub fn shadowed(&self, receivers: &[Receiver], scratch: &mut ShadowScratch, shadow: &mut Vec<bool>) {
        shadow.clear();
        shadow.resize(receivers.len(), false);
        scratch.counts.receivers += receivers.len() as u64;
        if !self.unprojected.is_empty() {
            shadowed_one_by_one(&self.light, &self.triangles, &self.unprojected, receivers, shadow);
            return;
        }
        let mut waiting = Waiting::default();
        for (i, receiver) in receivers.iter().enumerate() {
            let views = self.faces.iter().map(|face| &face.view);
            let Some((face, place)) = locate(views, receiver) else {
                continue;
            };
            if waiting.count == LANES || waiting.face != face {
                self.test(&mut waiting, receivers, scratch, shadow);
                waiting.face = face;
            }
            waiting.receivers[waiting.count] = i;
            scratch.points.set(waiting.count, &place, receiver.prim);
            waiting.count += 1;
        }
        self.test(&mut waiting, receivers, scratch, shadow);
    }

    /// Answers for the receivers that wait.
    fn test(
        &self,
        waiting: &mut Waiting,
        receivers: &[Receiver],
        scratch: &mut ShadowScratch,
        shadow: &mut [bool],
    ) {
        let count = std::mem::take(&mut waiting.count);
        if count == 0 {
            return;
        }
        let face = &self.faces[waiting.face];
        let all = u32::MAX >> (32 - count as u32);
        let ShadowScratch {
            points,
            walk: work,
            counts,
            ..
        } = scratch;
        work.tested = 0;
        work.unsure.clear();
        let mut open = all;
        if !face.nodes.is_empty() {
            open = walk(self.level, (&face.nodes, &face.casters), points, all, work);
        }
        for &(lane, prim) in &work.unsure {
            if open & (1 << lane) != 0 {
                counts.exact_pairs += 1;
                let receiver = &receivers[waiting.receivers[lane as usize]];
                if exact::shadows(&self.triangles, prim, receiver, &self.light) {
                    open &= !(1 << lane);
                }
            }
        }
        counts.lit_by_cell += u64::from((all & !work.tested).count_ones());
        counts.nodes += std::mem::take(&mut work.nodes);
        counts.tests += std::mem::take(&mut work.tests);
        for (lane, &receiver) in waiting.receivers[..count].iter().enumerate() {
            shadow[receiver] = open & (1 << lane) == 0;
        }
    }
}

/// Receivers of one face that wait until there are sixteen.
#[derive(Default)]
struct Waiting {
    face: usize,
    count: usize,
    receivers: [usize; LANES],
}

/// Triangles done by one task.
const CHUNK: usize = 8 * 1024;

impl Face {
    fn build(
        view: View,
        triangles: &Triangles,
        takes_part: &(dyn Fn(u32) -> bool + Sync),
        level: SimdLevel,
    ) -> Self {
        let vertices = project_all(level, &view, triangles);
        let count = triangles.len();
        let chunk = |chunk: usize| {
            let prims = (chunk * CHUNK) as u32..((chunk + 1) * CHUNK).min(count) as u32;
            let entry = |prim: u32| {
                let bounds = bounds(&view, triangles, &vertices, prim)?;
                takes_part(prim).then_some(Entry { bounds, prim })
            };
            prims.filter_map(entry).collect::<Vec<_>>()
        };
        let chunks = (0..count.div_ceil(CHUNK)).into_par_iter();
        let mut entries: Vec<Entry> = chunks.flat_map_iter(chunk).collect();
        let side = SIDE as f32;
        let metric = Metric::of(&entries, side);
        let Built {
            nodes,
            prims,
            predicted,
        } = Built::new(&mut entries, &metric, side);
        let casters = set_up_all(level, &view, triangles, &vertices, &prims);
        debug_assert!(casters.len() < CASTER as usize, "positions have a bit to spare");
        Self {
            weight: metric.covered() / (view.scale_x * view.scale_y).abs(),
            view,
            nodes,
            casters,
            predicted,
        }
    }
}

/// The box of a triangle in a raster, as far as it is seen; `None` if it is not.
fn bounds(view: &View, triangles: &Triangles, vertices: &[RasterVertex], prim: u32) -> Option<[f32; 6]> {
    let [a, b, c] = triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
    let n = [a.nearness, b.nearness, c.nearness];
    if n.iter().all(|&n| n < 0.0) {
        return None;
    }
    let known = n.iter().all(|&n| n > 0.0);
    let (min, max) = if n.iter().all(|&n| n >= 0.0) {
        (
            [a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y)],
            [a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y)],
        )
    } else {
        let precise = PreciseTriangle::new(view, triangles.corners(prim))?;
        let [min, max] = precise.bounds(view)?;
        (min.map(|v| v as f32), max.map(|v| v as f32))
    };
    let mut range = [[0.0; 2]; 2];
    for axis in 0..2 {
        let (low, high) = (min[axis] - SLACK, max[axis] + SLACK);
        // Receivers may lie a unit outside. Written so that what is no number is refused.
        let (start, end) = (-1.0 - SLACK, SIDE as f32 + 1.0 + SLACK);
        if !(low <= high && high >= start && low <= end) {
            return None;
        }
        range[axis] = [low.max(start), high.min(end)];
    }
    let (nearest, farthest) = if known {
        (n[0].max(n[1]).max(n[2]), n[0].min(n[1]).min(n[2]))
    } else {
        (f32::INFINITY, 0.0)
    };
    let [[x0, x1], [y0, y1]] = range;
    Some([x0, x1, y0, y1, nearest * (1.0 + 2.0 * NEARNESS_BAND), farthest])
}
