//! Packets of sixteen rays, as structures of arrays. The layout is that of Embree's `RTCRay16` and `RTCHit16` (API 3
//! and 4), so that no ray is copied on its way there; the other peers read it lane by lane.

/// Rays of a packet: a block of 4 x 4 pixels.
pub(crate) const LANES: usize = 16;

/// Id of "nothing".
pub(crate) const NOTHING: u32 = u32::MAX;

/// One value a ray.
pub(crate) type Lanes<T> = [T; LANES];

/// Which rays of a packet are asked about: -1 for those, 0 for the others.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Valid(pub(crate) Lanes<i32>);

impl Valid {
    /// How many are asked about.
    #[inline]
    pub(crate) fn count(&self) -> u64 {
        self.0.iter().filter(|&&v| v != 0).count() as u64
    }
}

/// Sixteen rays: origin and direction by component; hits lie beyond `near` and before `far`.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Rays {
    pub(crate) origin: [Lanes<f32>; 3],
    pub(crate) near: Lanes<f32>,
    pub(crate) dir: [Lanes<f32>; 3],
    pub(crate) time: Lanes<f32>,
    /// Becomes the hit's parameter, or minus infinity where the ray is found occluded.
    pub(crate) far: Lanes<f32>,
    pub(crate) mask: Lanes<u32>,
    pub(crate) id: Lanes<u32>,
    pub(crate) flags: Lanes<u32>,
}

/// What sixteen rays hit. Only `prim` and `geometry` are used here.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Hits {
    pub(crate) normal: [Lanes<f32>; 3],
    pub(crate) barycentric: [Lanes<f32>; 2],
    pub(crate) prim: Lanes<u32>,
    pub(crate) geometry: Lanes<u32>,
    /// Room for the ids of several levels of instances, however many the library was built with.
    pub(crate) instance: [Lanes<u32>; 16],
}

/// Rays and their hits.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Packet {
    pub(crate) rays: Rays,
    pub(crate) hits: Hits,
}

impl Default for Packet {
    fn default() -> Self {
        let zero = [0.0; LANES];
        Self {
            rays: Rays {
                origin: [zero; 3],
                near: zero,
                dir: [zero; 3],
                time: zero,
                far: [f32::INFINITY; LANES],
                mask: [u32::MAX; LANES],
                id: [0; LANES],
                flags: [0; LANES],
            },
            hits: Hits {
                normal: [zero; 3],
                barycentric: [zero; 2],
                prim: [NOTHING; LANES],
                geometry: [NOTHING; LANES],
                instance: [[NOTHING; LANES]; 16],
            },
        }
    }
}
