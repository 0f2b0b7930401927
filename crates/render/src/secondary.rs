//! What answers rays from anywhere to anywhere: those that leave surfaces, those that pass transparent ones. A batch in,
//! hits out.

use std::fmt::Debug;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex, PoisonError};

use rayward_trace::exact::ExactHit;
use rayward_trace::ldc::{StepCounts, StillCube};
use rayward_trace::{Bvh, Counters, Ldc, LdcOptions, Light, Receiver, SurfaceRay, Triangles, View, ViewRay};

use crate::PixelCost;

/// The first triangle that a ray meets, and where; `None` if it meets none.
pub type SurfaceHit = Option<(u32, ExactHit)>;

/// A structure for rays from anywhere to anywhere.
///
/// Those that answer exactly agree with [`rayward_trace::BruteForce`] bit for bit, and so do the pictures made with
/// them.
pub trait SecondaryTracer: Debug + Send + Sync {
    /// Replaces `hits` by the answers to the rays, in their order.
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>);

    /// Calls `visit` with the triangles between a receiver and a light, in no order that means anything, until it
    /// breaks.
    fn each_between(&self, receiver: &Receiver, light: &Light, visit: &mut dyn FnMut(u32) -> ControlFlow<()>);

    /// Replaces `hits` by all triangles in front of the start of a ray, as parameters and ids in ascending order.
    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>);

    /// What following a ray takes; nothing from structures that do not count.
    fn cost(&self, _ray: &SurfaceRay) -> PixelCost {
        PixelCost::default()
    }

    /// The first triangle that each pixel's ray meets, from structures that would rather have arrays than single rays;
    /// `None` from others, and if they fail.
    fn seen(&self, _view: &View, _pixels: &[[u32; 2]]) -> Option<Vec<Option<u32>>> {
        None
    }

    /// Whether any triangle lies between each receiver and the light, of such structures.
    fn shadowed(&self, _receivers: &[Receiver], _light: &Light) -> Option<Vec<bool>> {
        None
    }

    /// The same with a light for each receiver.
    fn hidden(&self, _queries: &[(Receiver, Light)]) -> Option<Vec<bool>> {
        None
    }
}

/// Builds such a structure for each frame.
pub trait SecondaryBuilder: Debug + Send + Sync {
    /// Builds over all triangles of a frame.
    fn build<'g>(&'g self, triangles: Triangles<'g>) -> BuiltTracer<'g>;

    /// Whether what all pixels see and their shadows are asked of it, too, as arrays.
    fn takes_arrays(&self) -> bool {
        false
    }
}

/// A structure for rays from anywhere to anywhere, and what it is.
#[derive(Debug)]
pub struct BuiltTracer<'g> {
    /// The structure.
    pub tracer: Arc<dyn SecondaryTracer + 'g>,
    /// Its name in what a frame tells of itself.
    pub name: &'static str,
    /// Its memory.
    pub bytes: usize,
    /// Its cells; 0 if it has none.
    pub cells: usize,
    /// Entries of lists of triangles.
    pub references: usize,
}

/// Builds the hierarchy, which is what frames use unless told otherwise.
#[derive(Clone, Copy, Debug, Default)]
pub struct HierarchyBuilder;

impl SecondaryBuilder for HierarchyBuilder {
    fn build<'g>(&'g self, triangles: Triangles<'g>) -> BuiltTracer<'g> {
        let bvh = Bvh::build(triangles);
        BuiltTracer {
            name: "hierarchy for other rays",
            bytes: bvh.bytes(),
            cells: 0,
            references: bvh.stats().triangles,
            tracer: Arc::new(bvh),
        }
    }
}

/// Builds the layered depth cube (VMV07), its samples naming every triangle over a texel: exact. What stands still over
/// the frames it is asked for keeps its cube.
#[derive(Debug, Default)]
pub struct CubeBuilder(Mutex<StillCube>);

impl CubeBuilder {
    /// Builds cubes with these parameters.
    pub fn new(options: LdcOptions) -> Self {
        Self(Mutex::new(StillCube::new(options)))
    }
}

impl SecondaryBuilder for CubeBuilder {
    fn build<'g>(&'g self, triangles: Triangles<'g>) -> BuiltTracer<'g> {
        let cube = self
            .0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .build(triangles);
        BuiltTracer {
            name: if cube.rebuilt() < cube.stats().triangles {
                "layered depth cube for other rays, what stands still kept"
            } else {
                "layered depth cube for other rays"
            },
            bytes: cube.bytes(),
            cells: cube.texels(),
            references: cube.samples().iter().sum(),
            tracer: Arc::new(cube),
        }
    }
}

/// For structures that have these questions as methods of their own.
macro_rules! answers_itself {
    ($($structure:ident, $counts:ident;)*) => {$(
        impl SecondaryTracer for $structure<'_> {
            fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>) {
                hits.clear();
                hits.extend(rays.iter().map(|ray| self.after(ray, &mut ())));
            }

            fn each_between(
                &self,
                receiver: &Receiver,
                light: &Light,
                visit: &mut dyn FnMut(u32) -> ControlFlow<()>,
            ) {
                self.each_shadow(receiver, light, &mut (), visit);
            }

            fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>) {
                $structure::along(self, ray, &mut (), hits);
            }

            fn cost(&self, ray: &SurfaceRay) -> PixelCost {
                let mut counts = $counts::default();
                self.after(ray, &mut counts);
                counts.into()
            }
        }
    )*};
}

answers_itself!(Bvh, Counters; Ldc, StepCounts;);
