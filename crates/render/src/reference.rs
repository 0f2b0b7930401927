//! References: the same frame with every ray answered by testing every triangle in f64.
//!
//! Shading, random numbers and the order of sums are shared with the structures' frames, so the two pictures are
//! equal bit for bit, or a structure is wrong. Cost: some 30 ns a ray and triangle; for small pictures.

use std::ops::ControlFlow;

use rayward_trace::{AreaLight, BruteForce, Light, Receiver, Samples, SurfaceRay, Triangles, ViewRay, exact};

use crate::secondary::{SecondaryTracer, SurfaceHit};

/// Tests all triangles for each ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EveryTriangle<'a>(pub(crate) Triangles<'a>);

impl EveryTriangle<'_> {
    fn prims(&self) -> impl Iterator<Item = u32> + '_ {
        let finite = |prim: &u32| self.0.corners(*prim).iter().all(|corner| corner.is_finite());
        (0..self.0.len() as u32).filter(finite)
    }

    fn hides(&self, is_opaque: &impl Fn(u32) -> bool, receiver: &Receiver, end: &Light) -> bool {
        self.prims()
            .any(|prim| is_opaque(prim) && exact::shadows(&self.0, prim, receiver, end))
    }

    /// Which receivers an opaque triangle hides from a light.
    pub(crate) fn shadowed(
        &self,
        is_opaque: &impl Fn(u32) -> bool,
        light: &Light,
        receivers: &[Receiver],
        shadow: &mut Vec<bool>,
    ) {
        shadow.clear();
        shadow.extend(
            receivers
                .iter()
                .map(|receiver| self.hides(is_opaque, receiver, light)),
        );
    }

    /// Which samples of a light with a size each receiver sees, as [`rayward_trace::AreaLightTree::visible`] has it.
    pub(crate) fn visible(
        &self,
        is_opaque: &impl Fn(u32) -> bool,
        area: &AreaLight,
        samples: &Samples,
        (receivers, pixels): (&[Receiver], &[u32]),
        bits: &mut Vec<u32>,
    ) {
        bits.clear();
        bits.resize(receivers.len() * samples.words(), 0);
        let asked = receivers.iter().zip(pixels);
        for ((receiver, &pixel), bits) in asked.zip(bits.chunks_mut(samples.words())) {
            for k in 0..samples.count() {
                let end = area.sample(samples, pixel, receiver.point, k);
                let seen = !self.hides(is_opaque, receiver, &end);
                bits[k as usize / 32] |= u32::from(seen) << (k % 32);
            }
        }
    }
}

impl SecondaryTracer for EveryTriangle<'_> {
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>) {
        let brute = BruteForce::new(self.0);
        hits.clear();
        hits.extend(rays.iter().map(|ray| brute.after(ray)));
    }

    fn each_between(
        &self,
        receiver: &Receiver,
        light: &Light,
        visit: &mut dyn FnMut(u32) -> ControlFlow<()>,
    ) {
        for prim in self.prims() {
            if exact::shadows(&self.0, prim, receiver, light) && visit(prim).is_break() {
                return;
            }
        }
    }

    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>) {
        hits.clear();
        hits.extend(self.prims().filter_map(|prim| {
            let hit = exact::hit(ray.origin, ray.dir, self.0.corners(prim))?;
            (hit.t > 0.0).then_some((hit.t, prim))
        }));
        hits.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    }
}
