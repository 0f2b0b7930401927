//! [`AreaLightGrid`]: soft shadows as HM08 §5.3 has them.
//!
//! A 3-D grid of 200 x 200 x 4 cells in the perspective space of the light's middle, six of them where needed
//! ([`crate::PerspectiveGrids`] says how); packets of four rays from one receiver to four samples of the light; and the
//! traversal of Wald et al. 2006 (*Ray Tracing Animated Scenes using Coherent Grid Traversal*) slab by slab from the receiver to
//! the light: in each slab all cells of the rectangle around the packet's rays. Triangles of which the whole light sees the
//! front are left out where back faces cast alone.
//!
//! Answers: exactly those of [`crate::BruteForce::visible_samples`], hence of [`crate::AreaLightTree`], which is
//! some times faster. Layout: that of [`crate::Grid3`]. Cost: for each packet the cells of its rectangles, some 20 ns
//! each, and their triangles. Limits: those of [`crate::PerspectiveGrids`]; rays to a sun share no point and pass many cells.

use glam::{DVec3, Vec3};

use crate::exact::{self, Filter};
use crate::faces::{FaceGrids, FaceOptions, PACKET};
use crate::grid3::Outline;
use crate::light_grid::{CastRule, Casts};
use crate::queries::shadow_ray;
use crate::{AreaLight, AreaScratch, Counters, Light, Receiver, Samples, Triangles};

/// The perspective grids of an area light over one frame's triangles.
#[derive(Clone, Debug)]
pub struct AreaLightGrid<'a> {
    light: AreaLight,
    triangles: Triangles<'a>,
    grids: FaceGrids,
}

impl FaceOptions {
    /// The cells of HM08 for soft shadows: 200 x 200 x 4.
    pub fn paper() -> Self {
        Self {
            resolution: Some([200, 200, 4]),
            ..Self::default()
        }
    }
}

impl<'a> AreaLightGrid<'a> {
    /// Builds over the triangles that cast, on all threads of the current rayon pool.
    pub fn build(light: AreaLight, triangles: Triangles<'a>, rule: CastRule, options: &FaceOptions) -> Self {
        let outline = |prim: u32| {
            let casts = rule(prim);
            if casts == Casts::Nothing || triangles.is_degenerate(prim) {
                return None;
            }
            let corners = triangles.corners(prim);
            let turned_to = casts == Casts::Back && light.side(corners) > 0.0;
            (!turned_to).then(|| Outline::Triangle(corners.map(Vec3::as_dvec3)))
        };
        let center = if light.is_valid() {
            light.center.as_dvec3()
        } else {
            DVec3::ZERO
        };
        Self {
            light,
            triangles,
            grids: FaceGrids::build(center, triangles.len(), options, outline),
        }
    }

    /// The light.
    pub fn light(&self) -> &AreaLight {
        &self.light
    }

    /// Cells of the faces that hold something.
    pub fn cell_count(&self) -> usize {
        self.grids.cell_count()
    }

    /// References in all cells and in the near list.
    pub fn reference_count(&self) -> usize {
        self.grids.reference_count()
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.grids.bytes()
    }

    /// As [`crate::AreaLightTree::visible`]. Nodes counted are cells, tests those of a triangle and a ray.
    ///
    /// # Panics
    /// If there are not as many pixels as receivers.
    pub fn visible(
        &self,
        receivers: &[Receiver],
        pixels: &[u32],
        samples: &Samples,
        scratch: &mut AreaScratch,
        bits: &mut Vec<u32>,
    ) {
        assert_eq!(receivers.len(), pixels.len(), "a pixel for each receiver");
        bits.clear();
        bits.resize(receivers.len() * samples.words(), 0);
        let asked = receivers.iter().zip(pixels);
        for ((receiver, &pixel), bits) in asked.zip(bits.chunks_mut(samples.words())) {
            if !receiver.point.is_finite() {
                continue;
            }
            scratch.counts.receivers += 1;
            scratch.counts.samples += u64::from(samples.count());
            if !self.light.shines_at(receiver.point) {
                scratch.counts.untested += u64::from(samples.count());
                continue;
            }
            for first in (0..samples.count()).step_by(PACKET) {
                let live = self.packet(receiver, pixel, samples, first, scratch);
                bits[first as usize / 32] |= live << (first % 32);
            }
        }
    }

    /// Which of four samples from `first` on a receiver sees, a bit each.
    fn packet(
        &self,
        receiver: &Receiver,
        pixel: u32,
        samples: &Samples,
        first: u32,
        scratch: &mut AreaScratch,
    ) -> u32 {
        let count = (samples.count() - first).min(PACKET as u32);
        let mut live = (1u32 << count) - 1;
        if !self.light.is_valid() {
            return live;
        }
        let ends: [Light; PACKET] = std::array::from_fn(|lane| {
            let k = first + (lane as u32).min(count - 1);
            self.light.sample(samples, pixel, receiver.point, k)
        });
        let rays = ends.map(|end| shadow_ray(receiver, &end));
        // Receivers and lights are finite here, so that all four are there; a ray without a direction meets nothing.
        let [Some(a), Some(b), Some(c), Some(d)] = rays else {
            return live;
        };
        let (lines, range) = ([a.0, b.0, c.0, d.0], a.1);
        let still = (0..PACKET).filter(|&lane| lines[lane].dir == DVec3::ZERO);
        let still = still.fold(0, |lanes, lane| lanes | 1 << lane) & live;
        live &= !still;
        let filters = lines.map(|line| Filter::new(line.origin, line.dir));
        let (mut counters, mut tests) = (Counters::default(), 0);
        self.grids
            .each_of_packet(&lines, range, &mut live, &mut counters, |prim, live| {
                if prim == receiver.prim {
                    return;
                }
                let corners = self.triangles.corners(prim);
                let asking = *live;
                for lane in (0..PACKET).filter(|lane| asking >> lane & 1 != 0) {
                    tests += 1;
                    let hides = !filters[lane].certain_miss(&corners)
                        && exact::shadows(&self.triangles, prim, receiver, &ends[lane]);
                    *live &= !(u32::from(hides) << lane);
                }
            });
        scratch.counts.nodes += counters.nodes;
        scratch.counts.tests += tests;
        live | still
    }
}
