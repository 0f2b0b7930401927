//! Lines from receivers to the samples of an area light against triangles: one triangle, sixteen receivers, one sample
//! of each.
//!
//! With everything relative to the light's middle, let a triangle's edge have the direction E and the moment
//! M = v x E. The line from receiver p to the sample at d passes the edge on the side of
//!
//! ```text
//! e = d . (M + E x p) - p . M
//! ```
//!
//! (the product of two lines in Plücker coordinates), which is affine in d: receiver and triangle give four numbers an
//! edge, and a sample costs nine multiply-adds. The sun's samples are directions, for which `- p . M` falls away. Planes
//! are tested once for a receiver: the triangle's lies between the two if p is behind it, since the light is before it.
//! A triangle whose plane passes through the light's box is in the group twice, once for each side, and its plane
//! is then tested for each sample as well.
//!
//! Errors: with u the unit roundoff, P the largest coordinate of p and a that of d, the sum of all roundings (of p, d, v,
//! E and M, and of the arithmetic) is below 14 u |E| (|v| + 3 a) (P + a) in the norm of sums. Edges are scaled by
//! 1 / (|E| (|v| + 3 a)), so the bound is a number of the receiver's: [`ReceiverLanes::edge_error`]. Planes likewise.
//! Beyond the bound the sign is certain, within it the pair is decided exactly by the caller.
//!
//! Cost: some 40 operations a triangle and 15 a sample, for sixteen receivers.

use fearless_simd::{Simd, f32x16, prelude::*, u32x16};

use super::{LANES, ROUNDOFF};

/// Three values by axis or corner. Always inlined, which `array::map` over vectors is not.
#[inline(always)]
pub(crate) fn each3<T>(f: impl Fn(usize) -> T) -> [T; 3] {
    [f(0), f(1), f(2)]
}

/// Three absolute values.
#[inline(always)]
pub(crate) fn abs3<S: Simd>(v: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [v[0].abs(), v[1].abs(), v[2].abs()]
}

/// The scalar product with a vector that is the same for all lanes.
#[inline(always)]
pub(crate) fn dot<S: Simd>(simd: S, v: [f32x16<S>; 3], w: [f32; 3]) -> f32x16<S> {
    let splat = |v: f32| f32x16::splat(simd, v);
    v[0].mul_add(splat(w[0]), v[1].mul_add(splat(w[1]), v[2] * splat(w[2])))
}

/// Three vectors of sixteen lanes.
#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, v: &[[f32; LANES]; 3]) -> [f32x16<S>; 3] {
    each3(|axis| f32x16::from_slice(simd, &v[axis]))
}

/// Sixteen triangles as lines. 1.5 KB; lanes that hold none are never asked for.
#[derive(Clone, Debug, Default)]
#[repr(C)]
pub(crate) struct Group {
    /// Directions of the edges, scaled.
    pub(crate) e: [[[f32; LANES]; 3]; 3],
    /// Their moments, scaled likewise.
    pub(crate) m: [[[f32; LANES]; 3]; 3],
    /// Scaled normal, towards the light.
    pub(crate) normal: [[f32; LANES]; 3],
    /// The plane: `normal . q = height`.
    pub(crate) height: [f32; LANES],
    /// The triangles.
    pub(crate) prim: [u32; LANES],
    /// A bit for each whose plane is to be tested for every sample.
    pub(crate) crossing: u32,
    /// A bit for each that turns its back to the light.
    pub(crate) back: u32,
}

/// The light as the kernels see it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightBox {
    /// Middle of the samples: zero, or the direction towards the sun.
    pub(crate) middle: [f32; 3],
    /// Half sides of their box.
    pub(crate) half: [f32; 3],
    /// Largest coordinates of samples: |middle| + half.
    pub(crate) reach: [f32; 3],
    /// 1, or 0 for the sun.
    pub(crate) weight: f32,
    /// The length that edges are scaled by, beside that of their corners.
    pub(crate) edge_scale: f32,
    /// As `edge_scale`, for planes: the extent of the geometry.
    pub(crate) plane_scale: f32,
    /// Error bound of planes at the light.
    pub(crate) plane_error: f32,
}

impl LightBox {
    /// `extent` is the largest sum of coordinates of any vertex, all relative to the origin and scaled.
    pub(crate) fn new(middle: [f32; 3], half: [f32; 3], weight: f32, extent: f32) -> Self {
        let reach = [0, 1, 2].map(|i| middle[i].abs() + half[i]);
        let largest = reach[0].max(reach[1]).max(reach[2]);
        let extent = extent.max(f32::MIN_POSITIVE);
        Self {
            middle,
            half,
            reach,
            weight,
            edge_scale: if weight == 0.0 { extent } else { 3.0 * largest },
            plane_scale: extent,
            plane_error: if weight == 0.0 {
                16.0 * ROUNDOFF * largest / extent
            } else {
                16.0 * ROUNDOFF * (3.0 * largest / extent).max(1.0)
            },
        }
    }

    /// Error bounds of edges and planes for a receiver, from its largest coordinate and its own error.
    pub(crate) fn errors(&self, size: f32, own: f32) -> [f32; 2] {
        let largest = self.reach[0].max(self.reach[1]).max(self.reach[2]);
        let far = (3.0 * size / self.plane_scale).max(1.0);
        let edge = if self.weight == 0.0 {
            largest * far
        } else {
            size + largest
        };
        [
            14.5 * ROUNDOFF * edge,
            16.0 * ROUNDOFF * far + 2.0 * own / self.plane_scale,
        ]
    }
}

/// Sixteen receivers relative to the origin, scaled.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReceiverLanes {
    pub(crate) p: [[f32; LANES]; 3],
    /// Largest coordinate of each.
    pub(crate) size: [f32; LANES],
    /// Edges of smaller magnitude are unsure.
    pub(crate) edge_error: [f32; LANES],
    /// As `edge_error`, for planes; the receiver's own error included.
    pub(crate) plane_error: [f32; LANES],
    /// The triangle each lies on.
    pub(crate) own: [u32; LANES],
}

/// Sixteen triangles by their corners, relative to nothing yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct CornerLanes {
    pub(crate) v: [[[f32; LANES]; 3]; 3],
    /// 1 to look at the front, -1 to look at the back.
    pub(crate) side: [f32; LANES],
}

/// A pair that f32 cannot tell: a sample of a receiver, and a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unsure {
    pub(crate) sample: u32,
    pub(crate) lane: u32,
    pub(crate) prim: u32,
}

/// Sets up sixteen triangles. Corners are taken relative to `origin` and scaled by `unit`; `side` is 1 where the light
/// is on the front, -1 where it is on the back. What f32 cannot hold becomes a triangle that is unsure everywhere.
#[inline(always)]
pub(crate) fn set_up<S: Simd>(
    simd: S,
    corners: &CornerLanes,
    origin: [f32; 3],
    unit: f32,
    light: &LightBox,
    out: &mut Group,
) {
    let splat = |v: f32| f32x16::splat(simd, v);
    let raw = each3(|corner| load3(simd, &corners.v[corner]));
    let side = f32x16::from_slice(simd, &corners.side);
    let v = each3(|corner| each3(|axis| (raw[corner][axis] - splat(origin[axis])) * splat(unit)));
    let between = |a: usize, b: usize| each3(|axis| (raw[b][axis] - raw[a][axis]) * splat(unit));
    let size = |v: [f32x16<S>; 3]| v[0].abs() + v[1].abs() + v[2].abs();
    let cross = |a: [f32x16<S>; 3], b: [f32x16<S>; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let reach = size(v[0]).max(size(v[1])).max(size(v[2]));
    let edges = [between(1, 2), between(2, 0), between(0, 1)];
    // Below this, products leave the range in which f32 has a relative precision.
    let smallest = splat(1e-15);
    let mut good = reach.simd_lt(splat(16.0));
    for i in 0..3 {
        let length = size(edges[i]);
        let scale = splat(1.0) / (length * (reach + splat(light.edge_scale)));
        good = good & length.simd_gt(smallest) & scale.simd_lt(splat(1e25));
        let scale = scale * side;
        let moment = cross(v[(i + 1) % 3], edges[i]);
        for axis in 0..3 {
            (edges[i][axis] * scale).store_slice(&mut out.e[i][axis]);
            (moment[axis] * scale).store_slice(&mut out.m[i][axis]);
        }
    }
    let normal = cross(edges[1], edges[2]);
    let scale = side / (size(edges[2]) * size(edges[1]) * (reach + splat(light.plane_scale)));
    let normal = each3(|axis| normal[axis] * scale);
    let height = normal[0] * v[0][0] + normal[1] * v[0][1] + normal[2] * v[0][2];
    (0..3).for_each(|axis| normal[axis].store_slice(&mut out.normal[axis]));
    height.store_slice(&mut out.height);
    let good = good.to_bitmask() as u32;
    for lane in (0..LANES).filter(|lane| good & (1 << lane) == 0) {
        for i in 0..3 {
            (0..3).for_each(|axis| (out.e[i][axis][lane], out.m[i][axis][lane]) = (0.0, 0.0));
            out.normal[i][lane] = 0.0;
        }
        out.height[lane] = 0.0;
    }
}

/// What is known of the samples of a batch of receivers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Answers {
    /// A word a sample, with a bit for every receiver that still sees it.
    pub(crate) open: Vec<u32>,
    /// Pairs left to the exact decision.
    pub(crate) unsure: Vec<Unsure>,
}

/// The sides of a triangle's edges on which the lines from sixteen receivers pass, as functions of the sample.
pub(crate) struct EdgeSides<S: Simd> {
    constant: [f32x16<S>; 3],
    gradient: [[f32x16<S>; 3]; 3],
}

impl<S: Simd> EdgeSides<S> {
    #[inline(always)]
    pub(crate) fn new(
        simd: S,
        receivers: &ReceiverLanes,
        group: &Group,
        lane: usize,
        light: &LightBox,
    ) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let p = load3(simd, &receivers.p);
        let (mut constant, mut gradient) = ([splat(0.0); 3], [[splat(0.0); 3]; 3]);
        for i in 0..3 {
            let m = each3(|axis| group.m[i][axis][lane]);
            let e = each3(|axis| group.e[i][axis][lane]);
            let g =
                |a: usize, b: usize, c: usize| splat(e[a]).mul_add(p[b], splat(m[c])) - splat(e[b]) * p[a];
            gradient[i] = [g(1, 2, 0), g(2, 0, 1), g(0, 1, 2)];
            constant[i] = if light.weight == 0.0 {
                dot(simd, gradient[i], light.middle)
            } else {
                -dot(simd, p, m)
            };
        }
        Self { constant, gradient }
    }

    /// The smallest of the three, for samples relative to the light's middle.
    #[inline(always)]
    fn at(&self, d: [f32x16<S>; 3]) -> f32x16<S> {
        let side = |i: usize| {
            let g = self.gradient[i];
            d[0].mul_add(g[0], d[1].mul_add(g[1], d[2].mul_add(g[2], self.constant[i])))
        };
        side(0).min(side(1)).min(side(2))
    }
}

/// A triangle that may come between some receivers and the light.
pub(crate) struct Candidate {
    /// The receivers in question.
    pub(crate) lanes: u32,
    pub(crate) prim: u32,
    /// Those that are certainly behind it.
    surely_behind: u32,
    normal: [f32; 3],
    /// Its plane at the light's middle.
    above: f32,
    crossing: bool,
}

impl Candidate {
    /// What a triangle of a group means for the receivers `active`; `None` if it lies before none of them.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(
        simd: S,
        receivers: &ReceiverLanes,
        group: &Group,
        lane: usize,
        light: &LightBox,
        active: u32,
    ) -> Option<Self> {
        let p = load3(simd, &receivers.p);
        let normal = each3(|axis| group.normal[axis][lane]);
        let (height, prim) = (group.height[lane], group.prim[lane]);
        let plane = dot(simd, p, normal) - f32x16::splat(simd, height);
        let plane_error = f32x16::from_slice(simd, &receivers.plane_error);
        let own = u32x16::from_slice(simd, &receivers.own).simd_eq(u32x16::splat(simd, prim));
        let behind = plane.simd_le(plane_error);
        let lanes = behind.to_bitmask() as u32 & !(own.to_bitmask() as u32) & active;
        if lanes == 0 {
            return None;
        }
        let surely_behind = (plane + plane_error).simd_lt(f32x16::splat(simd, 0.0));
        Some(Self {
            lanes,
            prim,
            surely_behind: surely_behind.to_bitmask() as u32,
            above: normal[0] * light.middle[0] + normal[1] * light.middle[1] + normal[2] * light.middle[2]
                - height * light.weight,
            normal,
            crossing: group.crossing & (1 << lane) != 0,
        })
    }

    /// From which receivers the triangle certainly hides the samples `d`, and from which it perhaps does.
    #[inline(always)]
    pub(crate) fn hides<S: Simd>(
        &self,
        simd: S,
        receivers: &ReceiverLanes,
        light: &LightBox,
        sides: &EdgeSides<S>,
        d: &[[f32; LANES]; 3],
    ) -> [u32; 2] {
        let splat = |v: f32| f32x16::splat(simd, v);
        let error = f32x16::from_slice(simd, &receivers.edge_error);
        let d = load3(simd, d);
        let inside = sides.at(d);
        let mut possible = inside.simd_ge(-error).to_bitmask() as u32 & self.lanes;
        if possible == 0 {
            return [0; 2];
        }
        let mut sure = inside.simd_gt(error).to_bitmask() as u32 & self.surely_behind;
        if self.crossing {
            let before = dot(simd, d, self.normal) + splat(self.above);
            possible &= before.simd_ge(splat(-light.plane_error)).to_bitmask() as u32;
            sure &= before.simd_gt(splat(light.plane_error)).to_bitmask() as u32;
        }
        sure &= possible;
        [sure, possible & !sure]
    }
}
