//! The spaces that structures partition (HM08 §3; the projective map and its singularity §4).
//!
//! Axis-aligned planes of the perspective space of a point C are planes through C, or perpendicular to the view
//! axis; lines stay lines. So a grid or tree over that space has its splits parallel to the rays through C, and an
//! ordinary traversal walks it.
//!
//! ```text
//! v = (right . (p - C), up . (p - C), forward . (p - C))
//! X = v.x / (v.z tan_x)    Y = v.y / (v.z tan_y)    Z = (1/near - 1/v.z) / (1/near - 1/far)
//! ```
//!
//! Inside the pyramid X and Y are in [-1, 1] and Z in [0, 1], growing with depth; `far` may be infinite. Z is affine
//! in 1/v.z: any other depth would bend lines. The map is singular at v.z = 0, so rays and triangles are cut at
//! `near` first. All arithmetic is f64; this is for setting structures up and for checking them. Units are the
//! caller's.
//!
//! Six pyramids make a cube around C ([`Face`]); what lies in the cube of half-size `near` is in none of them.

use glam::DVec3;

use crate::{Ray, ViewRay};

/// A space in which lines are lines.
pub trait Space: Copy + Sync {
    /// A world point in this space. Meaningless for points before the near plane of a perspective space.
    fn point(&self, p: DVec3) -> DVec3;

    /// The part with parameters in `range` of the line through a ray that lies within the space's limits; `None` if
    /// there is none, or if it has no beginning.
    fn segment(&self, ray: &ViewRay, range: [f64; 2]) -> Option<SpaceRay>;

    /// The part of a ray that lies within the space's limits; `None` if there is none.
    fn ray(&self, ray: &Ray) -> Option<SpaceRay> {
        let range = [f64::from(ray.t_min), f64::from(ray.t_max)];
        ray.is_valid().then(|| self.segment(&in_f64(ray), range))?
    }

    /// The smallest and the largest point of this space within its limits.
    fn limits(&self) -> [DVec3; 2];

    /// A world triangle in this space, without what the space cannot show.
    fn polygon(&self, corners: [DVec3; 3]) -> Polygon;

    /// The box in this space around the hull of world points; `None` if the space cannot show any of it.
    fn hull(&self, points: &[DVec3]) -> Option<[DVec3; 2]>;

    /// Bound on the error of points within the limits that come from world coordinates of this magnitude: of a
    /// point, of a segment's ends, and of an exact hit's place.
    fn error(&self, magnitude: f64) -> DVec3;
}

/// Some sixty roundings' worth of relative error.
const ROUNDING: f64 = f64::from_bits((1023 - 46) << 52);

fn in_f64(ray: &Ray) -> ViewRay {
    ViewRay {
        origin: ray.origin.as_dvec3(),
        dir: ray.dir.as_dvec3(),
    }
}

fn bounds(points: impl IntoIterator<Item = DVec3>) -> Option<[DVec3; 2]> {
    points
        .into_iter()
        .map(|p| [p, p])
        .reduce(|[low, high], [p, _]| [low.min(p), high.max(p)])
}

/// A ray's segment in a space: points `start + s (end - start)` for s in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpaceRay {
    /// Where it starts, in the space.
    pub start: DVec3,
    /// Where it ends, in the space.
    pub end: DVec3,
    /// The world ray's parameter at the start.
    pub t_start: f64,
    /// The world ray's parameter at the end; infinite if a perspective space without a far plane holds the end.
    pub t_end: f64,
    /// Depth at the start; depth at the end and depth at the start, each divided by the difference in t.
    depth: f64,
    end_rate: f64,
    start_rate: f64,
}

impl SpaceRay {
    fn new(start: DVec3, end: DVec3, [t_start, t_end]: [f64; 2], depth: f64, depth_slope: f64) -> Self {
        let start_rate = depth / (t_end - t_start);
        Self {
            start,
            end,
            t_start,
            t_end,
            depth,
            end_rate: start_rate + depth_slope,
            start_rate,
        }
    }

    /// The point at `s`.
    pub fn at(&self, s: f64) -> DVec3 {
        self.start * (1.0 - s) + self.end * s
    }

    /// The world ray's parameter at `s`. Monotone: cells in order of `s` are in order of `t`.
    pub fn t_of_s(&self, s: f64) -> f64 {
        self.t_start + s * self.depth / ((1.0 - s) * self.end_rate + s * self.start_rate)
    }

    /// Inverse of [`SpaceRay::t_of_s`].
    pub fn s_of_t(&self, t: f64) -> f64 {
        let along = t - self.t_start;
        let share = along / (self.t_end - self.t_start);
        along * self.end_rate / ((1.0 - share) * self.depth + along * self.end_rate)
    }
}

/// World space within a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct World {
    /// Lower corner.
    pub min: DVec3,
    /// Upper corner.
    pub max: DVec3,
}

/// The perspective space of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perspective {
    /// The center of projection C.
    pub center: DVec3,
    /// Unit vector of growing X, perpendicular to the other two.
    pub right: DVec3,
    /// Unit vector of growing Y.
    pub up: DVec3,
    /// Unit vector of the view axis.
    pub forward: DVec3,
    /// Tangent of half the angle in X.
    pub tan_x: f64,
    /// Tangent of half the angle in Y.
    pub tan_y: f64,
    /// Smallest depth, positive.
    pub near: f64,
    /// Largest depth; may be infinite.
    pub far: f64,
}

/// The space of parallel rays: a turned box. X and Y are in [-1, 1], Z in [0, 1] inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orthographic {
    /// Where depth is zero and X and Y are zero.
    pub center: DVec3,
    /// Unit vector of growing X, perpendicular to the other two.
    pub right: DVec3,
    /// Unit vector of growing Y.
    pub up: DVec3,
    /// Unit vector of the rays.
    pub forward: DVec3,
    /// Half the extent in X.
    pub half_x: f64,
    /// Half the extent in Y.
    pub half_y: f64,
    /// Smallest depth.
    pub near: f64,
    /// Largest depth.
    pub far: f64,
}

/// The parameters at which something affine along a ray is not negative.
#[derive(Clone, Copy, Debug)]
struct Range([f64; 2]);

impl Range {
    /// Cuts off where `value + t slope` is negative.
    fn cut(&mut self, value: f64, slope: f64) {
        let t = -value / slope;
        if slope > 0.0 {
            self.0[0] = self.0[0].max(t);
        } else if slope < 0.0 {
            self.0[1] = self.0[1].min(t);
        } else if value < 0.0 {
            self.0 = [f64::INFINITY, f64::NEG_INFINITY];
        }
    }

    /// The range if anything is left of it and it begins somewhere.
    fn left(self) -> Option<[f64; 2]> {
        (self.0[0] < self.0[1] && self.0[0].is_finite()).then_some(self.0)
    }
}

impl Space for World {
    fn point(&self, p: DVec3) -> DVec3 {
        p
    }

    fn segment(&self, &ViewRay { origin: o, dir: d }: &ViewRay, range: [f64; 2]) -> Option<SpaceRay> {
        let mut range = Range(range);
        for axis in 0..3 {
            range.cut(o[axis] - self.min[axis], d[axis]);
            range.cut(self.max[axis] - o[axis], -d[axis]);
        }
        let range = range.left()?;
        Some(SpaceRay::new(o + d * range[0], o + d * range[1], range, 1.0, 0.0))
    }

    fn limits(&self) -> [DVec3; 2] {
        [self.min, self.max]
    }

    fn polygon(&self, corners: [DVec3; 3]) -> Polygon {
        Polygon::triangle(corners)
    }

    fn hull(&self, points: &[DVec3]) -> Option<[DVec3; 2]> {
        bounds(points.iter().copied())
    }

    fn error(&self, magnitude: f64) -> DVec3 {
        DVec3::splat(magnitude * ROUNDING)
    }
}

impl Perspective {
    /// View coordinates of a world point: right, up and depth.
    pub fn view(&self, p: DVec3) -> DVec3 {
        self.turned(p - self.center)
    }

    fn turned(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(v), self.up.dot(v), self.forward.dot(v))
    }

    /// 1/near - 1/far.
    fn inverse_depth_span(&self) -> f64 {
        1.0 / self.near - 1.0 / self.far
    }

    /// The point of this space for view coordinates with a positive depth.
    pub fn project(&self, v: DVec3) -> DVec3 {
        let z = (1.0 / self.near - 1.0 / v.z) / self.inverse_depth_span();
        DVec3::new(v.x / (v.z * self.tan_x), v.y / (v.z * self.tan_y), z)
    }

    /// Inverse of [`Space::point`].
    pub fn world(&self, q: DVec3) -> DVec3 {
        let depth = 1.0 / (1.0 / self.near - q.z * self.inverse_depth_span());
        let (x, y) = (q.x * self.tan_x * depth, q.y * self.tan_y * depth);
        self.center + self.right * x + self.up * y + self.forward * depth
    }

    /// The parameters in `range` of a ray's line inside the pyramid.
    pub fn interval(&self, ray: &ViewRay, range: [f64; 2]) -> Option<[f64; 2]> {
        let (o, d) = (self.view(ray.origin), self.turned(ray.dir));
        let mut range = Range(range);
        range.cut(o.z - self.near, d.z);
        if self.far.is_finite() {
            range.cut(self.far - o.z, -d.z);
        }
        for (tan, o_side, d_side) in [(self.tan_x, o.x, d.x), (self.tan_y, o.y, d.y)] {
            range.cut(tan * o.z - o_side, tan * d.z - d_side);
            range.cut(tan * o.z + o_side, tan * d.z + d_side);
        }
        range.left()
    }

    /// The part of a world segment at or beyond the near plane, in view coordinates.
    pub fn clip_segment(&self, a: DVec3, b: DVec3) -> Option<[DVec3; 2]> {
        let (a, b) = (self.view(a), self.view(b));
        match (a.z >= self.near, b.z >= self.near) {
            (true, true) => Some([a, b]),
            (true, false) => Some([a, self.at_near(a, b)]),
            (false, true) => Some([self.at_near(a, b), b]),
            (false, false) => None,
        }
    }

    /// The part of a world triangle at or beyond the near plane (Sutherland and Hodgman 1974): no points, three or
    /// four, in view coordinates, in the triangle's order of turn.
    pub fn clip_triangle(&self, corners: [DVec3; 3]) -> Polygon {
        let corners = corners.map(|p| self.view(p));
        let mut polygon = Polygon {
            points: [DVec3::ZERO; 4],
            len: 0,
        };
        for (i, &a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % 3];
            if a.z >= self.near {
                polygon.push(a);
            }
            if (a.z >= self.near) != (b.z >= self.near) {
                polygon.push(self.at_near(a, b));
            }
        }
        // A corner that only touches the plane leaves fewer points than a polygon has.
        if polygon.len < 3 {
            Polygon { len: 0, ..polygon }
        } else {
            polygon
        }
    }

    /// Where the view segment crosses the near plane; the same for both directions of the segment.
    fn at_near(&self, a: DVec3, b: DVec3) -> DVec3 {
        let (a, b) = if a.z < b.z { (a, b) } else { (b, a) };
        let mut p = a + (b - a) * ((self.near - a.z) / (b.z - a.z));
        p.z = self.near;
        p
    }
}

/// Up to four points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polygon {
    points: [DVec3; 4],
    len: usize,
}

impl Polygon {
    fn triangle([a, b, c]: [DVec3; 3]) -> Self {
        Self {
            points: [a, b, c, c],
            len: 3,
        }
    }

    fn push(&mut self, p: DVec3) {
        self.points[self.len] = p;
        self.len += 1;
    }

    /// The points.
    pub fn points(&self) -> &[DVec3] {
        &self.points[..self.len]
    }
}

impl Space for Perspective {
    fn point(&self, p: DVec3) -> DVec3 {
        self.project(self.view(p))
    }

    fn segment(&self, ray: &ViewRay, range: [f64; 2]) -> Option<SpaceRay> {
        let range = self.interval(ray, range)?;
        let (o, d) = (self.view(ray.origin), self.turned(ray.dir));
        let start = o + d * range[0];
        // A ray without an end goes to the point at infinity in its direction.
        let end = if range[1].is_finite() {
            self.project(o + d * range[1])
        } else {
            DVec3::new(d.x / (d.z * self.tan_x), d.y / (d.z * self.tan_y), 1.0)
        };
        Some(SpaceRay::new(self.project(start), end, range, start.z, d.z))
    }

    fn limits(&self) -> [DVec3; 2] {
        [DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE]
    }

    fn polygon(&self, corners: [DVec3; 3]) -> Polygon {
        let mut polygon = self.clip_triangle(corners);
        for point in &mut polygon.points[..polygon.len] {
            *point = self.project(*point);
        }
        polygon
    }

    fn hull(&self, points: &[DVec3]) -> Option<[DVec3; 2]> {
        let ahead = |p: &DVec3| p.z >= self.near;
        let view = points.iter().map(|&p| self.view(p));
        let cut = view.clone().enumerate().flat_map(|(i, a)| {
            let others = points[..i].iter().map(|&p| self.view(p));
            others
                .filter(move |b| ahead(&a) != ahead(b))
                .map(move |b| self.at_near(a, b))
        });
        bounds(view.clone().filter(ahead).chain(cut).map(|v| self.project(v)))
    }

    fn error(&self, magnitude: f64) -> DVec3 {
        // Of view coordinates, then over the smallest depth; 1/near - 1/depth loses the same share, and more where
        // near and far are close.
        let view = (magnitude + self.center.abs().max_element()) * ROUNDING / self.near;
        let depth = view / (self.near * self.inverse_depth_span());
        DVec3::new(view / self.tan_x, view / self.tan_y, depth)
    }
}

impl Space for Orthographic {
    fn point(&self, p: DVec3) -> DVec3 {
        let v = self.turned(p - self.center);
        DVec3::new(
            v.x / self.half_x,
            v.y / self.half_y,
            (v.z - self.near) / (self.far - self.near),
        )
    }

    fn segment(&self, ray: &ViewRay, range: [f64; 2]) -> Option<SpaceRay> {
        let (o, d) = (self.turned(ray.origin - self.center), self.turned(ray.dir));
        let mut range = Range(range);
        range.cut(o.z - self.near, d.z);
        range.cut(self.far - o.z, -d.z);
        for (half, o_side, d_side) in [(self.half_x, o.x, d.x), (self.half_y, o.y, d.y)] {
            range.cut(half - o_side, -d_side);
            range.cut(half + o_side, d_side);
        }
        let range = range.left()?;
        let world = |t: f64| self.point(ray.origin + ray.dir * t);
        Some(SpaceRay::new(world(range[0]), world(range[1]), range, 1.0, 0.0))
    }

    fn limits(&self) -> [DVec3; 2] {
        [DVec3::new(-1.0, -1.0, 0.0), DVec3::ONE]
    }

    fn polygon(&self, corners: [DVec3; 3]) -> Polygon {
        Polygon::triangle(corners.map(|p| self.point(p)))
    }

    fn hull(&self, points: &[DVec3]) -> Option<[DVec3; 2]> {
        bounds(points.iter().map(|&p| self.point(p)))
    }

    fn error(&self, magnitude: f64) -> DVec3 {
        let view = (magnitude + self.center.abs().max_element()) * ROUNDING;
        DVec3::new(
            view / self.half_x,
            view / self.half_y,
            view / (self.far - self.near),
        )
    }
}

impl Orthographic {
    fn turned(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(v), self.up.dot(v), self.forward.dot(v))
    }

    /// Inverse of [`Space::point`].
    pub fn world(&self, q: DVec3) -> DVec3 {
        let depth = self.near + q.z * (self.far - self.near);
        self.center + self.right * (q.x * self.half_x) + self.up * (q.y * self.half_y) + self.forward * depth
    }
}

/// A face of the cube around a center of projection.
///
/// | face | forward | right | up |
/// |---|---|---|---|
/// | `PosX`, `NegX` | +x, -x | +y | +z, -z |
/// | `PosY`, `NegY` | +y, -y | +z | +x, -x |
/// | `PosZ`, `NegZ` | +z, -z | +x | +y, -y |
///
/// right x up = forward throughout.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the table above says it")]
pub enum Face {
    PosX,
    NegX,
    PosY,
    NegY,
    PosZ,
    NegZ,
}

impl Face {
    /// All faces in order.
    pub const ALL: [Self; 6] = [
        Self::PosX,
        Self::NegX,
        Self::PosY,
        Self::NegY,
        Self::PosZ,
        Self::NegZ,
    ];

    /// The face whose pyramid holds the point `v` relative to the center: that of the component largest in
    /// magnitude, of equal ones the first of x, y, z. The center itself belongs to `PosX`.
    pub fn of(v: DVec3) -> Self {
        let a = v.abs();
        let axis = if a.x >= a.y && a.x >= a.z {
            0
        } else if a.y >= a.z {
            1
        } else {
            2
        };
        Self::ALL[2 * axis + usize::from(v[axis] < 0.0)]
    }

    /// Right, up and forward, see the table.
    pub fn axes(self) -> [DVec3; 3] {
        let axis = self as usize / 2;
        let sign = if (self as usize).is_multiple_of(2) {
            1.0
        } else {
            -1.0
        };
        let unit = |axis: usize| DVec3::AXES[axis % 3];
        [unit(axis + 1), unit(axis + 2) * sign, unit(axis) * sign]
    }

    /// The face's pyramid around `center`, 90 degrees wide.
    pub fn perspective(self, center: DVec3, near: f64, far: f64) -> Perspective {
        let [right, up, forward] = self.axes();
        Perspective {
            center,
            right,
            up,
            forward,
            tan_x: 1.0,
            tan_y: 1.0,
            near,
            far,
        }
    }
}

/// The faces that a ray's line passes, with its parameters there, by ascending start, equal ones by face.
#[derive(Clone, Copy, Debug)]
pub struct FaceIntervals {
    faces: [(Face, [f64; 2]); 6],
    len: usize,
}

impl FaceIntervals {
    /// Of the part of a line with parameters in `range`; `spaces` are those of [`Face::ALL`].
    ///
    /// For pyramids of 90 degrees around one center the intervals cover the line from `near` to `far` (in the
    /// largest component of the distance to the center); where two meet they have the same parameter.
    pub fn new(spaces: &[Perspective; 6], ray: &ViewRay, range: [f64; 2]) -> Self {
        let mut intervals = Self {
            faces: [(Face::PosX, [0.0; 2]); 6],
            len: 0,
        };
        for (face, space) in Face::ALL.into_iter().zip(spaces) {
            if let Some(interval) = space.interval(ray, range) {
                intervals.faces[intervals.len] = (face, interval);
                intervals.len += 1;
            }
        }
        intervals.faces[..intervals.len].sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
        intervals
    }

    /// The faces and intervals.
    pub fn faces(&self) -> &[(Face, [f64; 2])] {
        &self.faces[..self.len]
    }
}
