//! Packets of sixteen rays, or eight or four, as structures of arrays. The layout is that of Embree's `RTCRay16` and
//! `RTCHit16` (API 3 and 4) and their smaller kin, so that no ray is copied on its way where sixteen are native; the
//! other peers read it lane by lane.

/// Rays of a packet: a block of 4 x 4 pixels.
pub(crate) const LANES: usize = 16;

/// Id of "nothing".
pub(crate) const NOTHING: u32 = u32::MAX;

/// One value a ray.
pub(crate) type Lanes<T> = [T; LANES];

/// Which rays of a packet are asked about: -1 for those, 0 for the others.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Valid<const N: usize = LANES>(pub(crate) [i32; N]);

impl Valid {
    /// How many are asked about.
    #[inline]
    pub(crate) fn count(&self) -> u64 {
        self.0.iter().filter(|&&v| v != 0).count() as u64
    }
}

/// Rays: origin and direction by component; hits lie beyond `near` and before `far`.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Rays<const N: usize = LANES> {
    pub(crate) origin: [[f32; N]; 3],
    pub(crate) near: [f32; N],
    pub(crate) dir: [[f32; N]; 3],
    pub(crate) time: [f32; N],
    /// Becomes the hit's parameter, or minus infinity where the ray is found occluded.
    pub(crate) far: [f32; N],
    pub(crate) mask: [u32; N],
    pub(crate) id: [u32; N],
    pub(crate) flags: [u32; N],
}

/// What they hit. Only `prim` and `geometry` are used here.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Hits<const N: usize = LANES> {
    pub(crate) normal: [[f32; N]; 3],
    pub(crate) barycentric: [[f32; N]; 2],
    pub(crate) prim: [u32; N],
    pub(crate) geometry: [u32; N],
    /// Room for the ids of several levels of instances, however many the library was built with.
    pub(crate) instance: [[u32; N]; 16],
}

/// Rays and their hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Packet<const N: usize = LANES> {
    pub(crate) rays: Rays<N>,
    pub(crate) hits: Hits<N>,
}

impl<const N: usize> Default for Packet<N> {
    fn default() -> Self {
        let zero = [0.0; N];
        Self {
            rays: Rays {
                origin: [zero; 3],
                near: zero,
                dir: [zero; 3],
                time: zero,
                far: [f32::INFINITY; N],
                mask: [u32::MAX; N],
                id: [0; N],
                flags: [0; N],
            },
            hits: Hits {
                normal: [zero; 3],
                barycentric: [zero; 2],
                prim: [NOTHING; N],
                geometry: [NOTHING; N],
                instance: [[NOTHING; N]; 16],
            },
        }
    }
}
