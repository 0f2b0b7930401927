//! The f64 point of a plain mesh file that its f32 positions are relative to.
//!
//! Text and double precision hold coordinates, of a map's projection for instance, that f32 would round to half a
//! metre. Positions are read as f64, and the rule of [`crate::pose::origin`] gives a base for them; it goes into the
//! node's matrix. A file near its own zero has base zero and keeps its positions. The base is a multiple of a power
//! of two as large as the mesh, so subtracting it is exact and what is left is rounded to f32 once.
//!
//! Limits: one stray vertex far from the rest makes the mesh large and its f32 as coarse as before.

use glam::{DVec3, Vec3};

use crate::pose::origin;

/// What to subtract from the positions of one file.
#[derive(Clone, Copy, Default)]
pub(super) struct Base(pub(super) DVec3);

impl Base {
    /// The base for these positions; those that are not finite have no say.
    pub(super) fn of(positions: impl IntoIterator<Item = DVec3>) -> Self {
        let mut finite = positions.into_iter().filter(|p| p.is_finite());
        let Some(first) = finite.next() else {
            return Self::default();
        };
        let (lo, hi) = finite.fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p)));
        Self(origin::of_box(lo, hi))
    }

    /// A position relative to the base.
    pub(super) fn local(self, position: DVec3) -> Vec3 {
        (position - self.0).as_vec3()
    }
}
