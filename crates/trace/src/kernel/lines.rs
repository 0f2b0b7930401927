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
//! (the product of two lines in Plücker coordinates), which is E . (p x d) + M . (d - p) with numbers of the ray, and affine
//! in d with four numbers of receiver and edge, which tell at once for all of the light. The sun's samples are directions,
//! for which `- p . M` falls away. Planes
//! are tested once for a receiver: the triangle's lies between the two if p is behind it, since the light is before it.
//! A triangle whose plane passes through the light's box is in the group twice, once for each side, and its plane
//! is then tested for each sample as well.
//!
//! Errors: with u the unit roundoff, P the largest coordinate of p and a that of d, the sum of all roundings (of p, d, v,
//! E and M, and of the arithmetic in either order) is below 19 u |E| (|v| + 3 a) (P + a) in the norm of sums. Edges are scaled by
//! 1 / (|E| (|v| + 3 a)), so the bound is a number of the receiver's: [`ReceiverLanes::edge_error`]. Planes likewise.
//! Beyond the bound the sign is certain, within it the pair is decided exactly by the caller.
//!
//! Cost: some 25 operations a triangle and sample, 60 a triangle and the whole light, for sixteen receivers.

use fearless_simd::{Simd, f32x16, prelude::*, u32x16};

use super::{LANES, ROUNDOFF, load3, splat3};

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

/// One coordinate, of axes `a` and `b`, of the cross product of `e` and `p`, and `add`.
#[inline(always)]
pub(crate) fn minor<S: Simd>(
    e: [f32x16<S>; 3],
    p: [f32x16<S>; 3],
    [a, b]: [usize; 2],
    add: f32x16<S>,
) -> f32x16<S> {
    e[a].mul_add(p[b], add) - e[b] * p[a]
}

/// The sum of the sizes of three coordinates.
#[inline(always)]
fn size3<S: Simd>(v: [f32x16<S>; 3]) -> f32x16<S> {
    v[0].abs() + v[1].abs() + v[2].abs()
}

#[inline(always)]
fn cross3<S: Simd>(a: [f32x16<S>; 3], b: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn difference3<S: Simd>(a: [f32x16<S>; 3], b: [f32x16<S>; 3], unit: f32x16<S>) -> [f32x16<S>; 3] {
    [(a[0] - b[0]) * unit, (a[1] - b[1]) * unit, (a[2] - b[2]) * unit]
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
    /// Half edges of a flat light.
    pub(crate) flat: Option<[[f32; 3]; 2]>,
    /// How far beside these samples may lie, by rounding.
    pub(crate) beside: f32,
}

impl LightBox {
    /// Factors of the error bounds of edges and planes.
    pub(crate) const ROUNDOFFS: [f32; 2] = [19.5 * ROUNDOFF, 16.0 * ROUNDOFF];

    /// Largest coordinate of a sample.
    #[inline(always)]
    pub(crate) fn largest(&self) -> f32 {
        self.reach[0].max(self.reach[1]).max(self.reach[2])
    }

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
            flat: None,
            beside: 0.0,
        }
    }

    /// The same, of a light whose samples lie between these half edges on both sides, or that far beside them.
    pub(crate) fn flat(self, edges: [[f32; 3]; 2], beside: f32) -> Self {
        Self {
            flat: Some(edges),
            beside,
            ..self
        }
    }

    /// Most by which edge functions of these gradients differ between the middle and any sample, but for [`Self::slack`].
    #[inline(always)]
    pub(crate) fn spread<S: Simd>(&self, simd: S, gradient: [f32x16<S>; 3]) -> f32x16<S> {
        match self.flat {
            Some([u, v]) => dot(simd, gradient, u).abs() + dot(simd, gradient, v).abs(),
            None => dot(simd, abs3(gradient), self.half),
        }
    }

    /// As [`Self::slack`].
    #[inline(always)]
    pub(crate) fn slacks<S: Simd>(&self, simd: S, size: f32x16<S>) -> f32x16<S> {
        let splat = |v: f32| f32x16::splat(simd, v);
        let beside = self.beside * 1.01;
        size.mul_add(splat(beside * 3.0 / self.edge_scale), splat(beside))
    }

    /// What edge functions of receivers with coordinates up to `size` may differ by beside [`Self::spread`] as samples are
    /// rounded: coordinates of a gradient add up to at most 1 and what the edge's direction, 1 / `edge_scale`, makes of
    /// the receiver's coordinates.
    #[inline(always)]
    pub(crate) fn slack(&self, size: f32) -> f32 {
        self.beside * (1.0 + 3.0 * size / self.edge_scale) * 1.01
    }

    /// Error bounds of edges and planes for a receiver, from its largest coordinate and its own error.
    pub(crate) fn errors(&self, size: f32, own: f32) -> [f32; 2] {
        let [edge_roundoff, plane_roundoff] = Self::ROUNDOFFS;
        let largest = self.largest();
        let far = (3.0 * size / self.plane_scale).max(1.0);
        let edge = if self.weight == 0.0 {
            largest * far
        } else {
            size + largest
        };
        [
            edge_roundoff * edge,
            plane_roundoff * far + 2.0 * own / self.plane_scale,
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
    let [a, b, c] = &corners.v;
    let raw = [load3(simd, a), load3(simd, b), load3(simd, c)];
    let side = f32x16::from_slice(simd, &corners.side);
    let (origin, unit) = (
        [splat(origin[0]), splat(origin[1]), splat(origin[2])],
        splat(unit),
    );
    let v = [
        difference3(raw[0], origin, unit),
        difference3(raw[1], origin, unit),
        difference3(raw[2], origin, unit),
    ];
    let reach = size3(v[0]).max(size3(v[1])).max(size3(v[2]));
    let edges = [
        difference3(raw[2], raw[1], unit),
        difference3(raw[0], raw[2], unit),
        difference3(raw[1], raw[0], unit),
    ];
    // Below this, products leave the range in which f32 has a relative precision.
    let smallest = splat(1e-15);
    let mut good = reach.simd_lt(splat(16.0));
    for i in 0..3 {
        let length = size3(edges[i]);
        let scale = splat(1.0) / (length * (reach + splat(light.edge_scale)));
        good = good & length.simd_gt(smallest) & scale.simd_lt(splat(1e25));
        let scale = scale * side;
        let moment = cross3(v[(i + 1) % 3], edges[i]);
        for axis in 0..3 {
            (edges[i][axis] * scale).store_slice(&mut out.e[i][axis]);
            (moment[axis] * scale).store_slice(&mut out.m[i][axis]);
        }
    }
    let normal = cross3(edges[1], edges[2]);
    let scale = side / (size3(edges[2]) * size3(edges[1]) * (reach + splat(light.plane_scale)));
    let normal = [normal[0] * scale, normal[1] * scale, normal[2] * scale];
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
struct EdgeSides<S: Simd> {
    constant: [f32x16<S>; 3],
    gradient: [[f32x16<S>; 3]; 3],
}

impl<S: Simd> EdgeSides<S> {
    #[inline(always)]
    fn new(simd: S, receivers: &ReceiverLanes, triangle: &Record, light: &LightBox) -> Self {
        let splat = |v: f32| f32x16::splat(simd, v);
        let p = load3(simd, &receivers.p);
        let (mut constant, mut gradient) = ([splat(0.0); 3], [[splat(0.0); 3]; 3]);
        for i in 0..3 {
            let (m, e) = (triangle.m[i], splat3(simd, triangle.e[i]));
            gradient[i] = [
                minor(e, p, [1, 2], splat(m[0])),
                minor(e, p, [2, 0], splat(m[1])),
                minor(e, p, [0, 1], splat(m[2])),
            ];
            constant[i] = if light.weight == 0.0 {
                dot(simd, gradient[i], light.middle)
            } else {
                -dot(simd, p, m)
            };
        }
        Self { constant, gradient }
    }

    /// From which receivers all lines to the light pass outside of some edge for certain, and from which all pass inside of
    /// all edges. What is between `bound` and its negative is neither.
    #[inline(always)]
    fn over_light(&self, simd: S, light: &LightBox, bound: f32x16<S>) -> [u32; 2] {
        let mut least = f32x16::splat(simd, f32::INFINITY);
        let mut most = least;
        for i in 0..3 {
            let spread = light.spread(simd, self.gradient[i]);
            least = least.min(self.constant[i] - spread);
            most = most.min(self.constant[i] + spread);
        }
        let outside = most.simd_lt(-bound).to_bitmask() as u32;
        [outside, least.simd_gt(bound).to_bitmask() as u32]
    }
}

/// One triangle of a group, copied together. 100 bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Record {
    e: [[f32; 3]; 3],
    m: [[f32; 3]; 3],
    normal: [f32; 3],
    height: f32,
    pub(crate) prim: u32,
    crossing: bool,
}

impl Record {
    #[inline(always)]
    pub(crate) fn of(group: &Group, lane: usize) -> Self {
        let lane = lane % LANES;
        Self {
            e: each3(|i| each3(|axis| group.e[i][axis][lane])),
            m: each3(|i| each3(|axis| group.m[i][axis][lane])),
            normal: each3(|axis| group.normal[axis][lane]),
            height: group.height[lane],
            prim: group.prim[lane],
            crossing: group.crossing & (1 << lane) != 0,
        }
    }

    /// Which of the receivers `active` are perhaps behind the triangle, not being on it, and which of them certainly.
    #[inline(always)]
    pub(crate) fn before<S: Simd>(&self, simd: S, receivers: &ReceiverLanes, active: u32) -> [u32; 2] {
        let p = load3(simd, &receivers.p);
        let plane = dot(simd, p, self.normal) - f32x16::splat(simd, self.height);
        let plane_error = f32x16::from_slice(simd, &receivers.plane_error);
        let own = u32x16::from_slice(simd, &receivers.own).simd_eq(u32x16::splat(simd, self.prim));
        let behind = plane.simd_le(plane_error);
        let lanes = behind.to_bitmask() as u32 & !(own.to_bitmask() as u32) & active;
        let surely = (plane + plane_error).simd_lt(f32x16::splat(simd, 0.0));
        [lanes, surely.to_bitmask() as u32 & lanes]
    }

    /// Of the receivers `active` those of which the triangle leaves samples in question, and those from which it certainly
    /// hides all of the light. What is between `bound` and its negative is in question.
    #[inline(always)]
    pub(crate) fn over_light<S: Simd>(
        &self,
        simd: S,
        receivers: &ReceiverLanes,
        (light, bound): (&LightBox, f32x16<S>),
        active: u32,
    ) -> [u32; 2] {
        let [lanes, surely] = self.before(simd, receivers, active);
        if lanes == 0 {
            return [0; 2];
        }
        let sides = EdgeSides::new(simd, receivers, self, light);
        let [outside, inside] = sides.over_light(simd, light, bound);
        let covered = if self.crossing { 0 } else { inside & surely };
        [lanes & !(outside | covered), covered]
    }

    /// From which of the receivers `active` the triangle certainly hides the samples at the ends of `rays`, and from which
    /// it perhaps does.
    #[inline(always)]
    pub(crate) fn hides<S: Simd>(
        &self,
        simd: S,
        receivers: &ReceiverLanes,
        light: &LightBox,
        rays: &Rays,
        active: u32,
    ) -> [u32; 2] {
        let (moment, direction) = (load3(simd, &rays.moment), load3(simd, &rays.direction));
        let inside = self
            .side(simd, 0, moment, direction)
            .min(self.side(simd, 1, moment, direction))
            .min(self.side(simd, 2, moment, direction));
        let error = f32x16::from_slice(simd, &receivers.edge_error);
        let possible = inside.simd_ge(-error).to_bitmask() as u32 & active;
        if possible == 0 {
            return [0; 2];
        }
        let [mut possible, surely] = self.before(simd, receivers, possible);
        let mut sure = inside.simd_gt(error).to_bitmask() as u32 & surely;
        if self.crossing {
            let splat = |v: f32| f32x16::splat(simd, v);
            let above = self.normal[0] * light.middle[0]
                + self.normal[1] * light.middle[1]
                + self.normal[2] * light.middle[2]
                - self.height * light.weight;
            let before = dot(simd, load3(simd, &rays.sample), self.normal) + splat(above);
            possible &= before.simd_ge(splat(-light.plane_error)).to_bitmask() as u32;
            sure &= before.simd_gt(splat(light.plane_error)).to_bitmask() as u32;
        }
        sure &= possible;
        [sure, possible & !sure]
    }

    /// On which side of an edge the lines pass.
    #[inline(always)]
    fn side<S: Simd>(
        &self,
        simd: S,
        edge: usize,
        moment: [f32x16<S>; 3],
        direction: [f32x16<S>; 3],
    ) -> f32x16<S> {
        let (e, m) = (splat3(simd, self.e[edge]), splat3(simd, self.m[edge]));
        let along = direction[0].mul_add(m[0], direction[1].mul_add(m[1], direction[2] * m[2]));
        moment[0].mul_add(e[0], moment[1].mul_add(e[1], moment[2].mul_add(e[2], along)))
    }
}

/// Lines from sixteen receivers to a sample each, in Plücker coordinates.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rays {
    moment: [[f32; LANES]; 3],
    direction: [[f32; LANES]; 3],
    /// The samples, relative to the light's middle.
    sample: [[f32; LANES]; 3],
}

impl Rays {
    #[inline(always)]
    pub(crate) fn set<S: Simd>(
        &mut self,
        simd: S,
        receivers: &ReceiverLanes,
        light: &LightBox,
        sample: &[[f32; LANES]; 3],
    ) {
        self.sample = *sample;
        let (p, offset) = (load3(simd, &receivers.p), load3(simd, sample));
        let middle = splat3(simd, light.middle);
        let d = [
            offset[0] + middle[0],
            offset[1] + middle[1],
            offset[2] + middle[2],
        ];
        let zero = f32x16::splat(simd, 0.0);
        minor(p, d, [1, 2], zero).store_slice(&mut self.moment[0]);
        minor(p, d, [2, 0], zero).store_slice(&mut self.moment[1]);
        minor(p, d, [0, 1], zero).store_slice(&mut self.moment[2]);
        let weight = f32x16::splat(simd, light.weight);
        (d[0] - p[0] * weight).store_slice(&mut self.direction[0]);
        (d[1] - p[1] * weight).store_slice(&mut self.direction[1]);
        (d[2] - p[2] * weight).store_slice(&mut self.direction[2]);
    }
}
