//! The perspective frames of an area light, and the boxes of triangles in them (HM08 §3, §5.3).
//!
//! The center of projection stands behind the light by about its size: from a center in its plane all that is near that
//! plane, a lamp around the light, would reach to infinity and be found by every search. A rectangle or disk needs one
//! frame, for nothing behind its plane sees it and perspective space has no border: the half space before it is a part of the
//! raster plane. A sphere has the six frames of a cube, the sun a parallel one.
//!
//! A triangle that reaches behind the center's plane, or far to the side, gets a box without an end on that side. No
//! triangle is clipped away or listed apart.

use glam::{DVec3, Vec3};

use crate::kernel::light_boxes::Sight;
use crate::kernel::lines::LightBox;
use crate::kernel::project::RasterVertex;
use crate::kernel::shaft::{FAR, FrameLanes};
use crate::view::{Arrangement, View};
use crate::{AreaLight, Triangles};

/// Where a light's coordinates start, and by what they are scaled: differences to `origin` times `unit` (a power of two)
/// are at most 1 for all of the geometry.
#[derive(Clone, Copy, Debug)]
pub(super) struct Local {
    pub(super) origin: Vec3,
    pub(super) unit: f64,
    pub(super) light: LightBox,
}

/// A frame of a light.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) view: View,
    pub(super) lanes: FrameLanes,
    /// Factors of raster coordinates and nearness, which the view gives unscaled.
    scale: [f64; 2],
    /// Of a cube's face, how far from its pyramid a triangle can still come between a receiver in it and the light.
    reach: Option<f64>,
    /// What is nearer than this lies behind a flat light.
    limit: f32,
}

impl Local {
    /// For geometry within these bounds.
    pub(super) fn new(light: &AreaLight, min: DVec3, max: DVec3) -> Self {
        let origin = if light.is_sun() {
            ((min + max) * 0.5).as_vec3()
        } else {
            light.center
        };
        let from = origin.as_dvec3();
        let largest = (min - from).abs().max((max - from).abs()).max_element();
        let half = light.half_box();
        let largest = if light.is_sun() {
            largest
        } else {
            largest.max(f64::from(half.max_element()))
        };
        // The power of two that takes it to at most 1.
        let unit = 2f64.powi(-(largest.max(1e-30).log2().floor() as i32) - 1);
        let extent = (3.0 * largest * unit) as f32 * 1.00001;
        let (scale, middle, weight) = if light.is_sun() {
            (1.0, light.center.to_array(), 0.0)
        } else {
            (unit as f32, [0.0; 3], 1.0)
        };
        let mut lanes = LightBox::new(middle, (half * scale).to_array(), weight, extent);
        if light.is_flat() {
            let edges = [light.half_u, light.half_v];
            let beside = half - (edges[0].abs() + edges[1].abs());
            lanes = lanes.flat(
                edges.map(|edge| (edge * scale).to_array()),
                beside.max_element() * scale * 1.01,
            );
        }
        let light = lanes;
        Self { origin, unit, light }
    }
}

/// The axes (right, up, forward) of the six faces of a cube: +X, -X, +Y, -Y, +Z, -Z.
const CUBE: [[DVec3; 3]; 6] = [
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
    [DVec3::Z, DVec3::Y, DVec3::NEG_X],
    [DVec3::X, DVec3::NEG_Z, DVec3::Y],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z],
];

/// Index of the cube's face that a direction is in.
#[inline]
pub(super) fn face_of(direction: DVec3) -> usize {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    2 * axis + usize::from(direction[axis] < 0.0)
}

/// The frames of a light over geometry within these bounds: one, or six in the order of [`face_of`].
pub(super) fn frames(light: &AreaLight, local: &Local, min: DVec3, max: DVec3) -> Vec<Frame> {
    if light.is_sun() {
        return vec![Frame::parallel(light, local, min, max)];
    }
    let normal = light.normal();
    match normal.try_normalize() {
        Some(forward) => {
            let right = light.half_u.as_dvec3().reject_from_normalized(forward);
            let right = right
                .try_normalize()
                .unwrap_or_else(|| forward.any_orthonormal_vector());
            vec![Frame::perspective(
                light,
                local,
                [right, right.cross(forward), forward],
                None,
            )]
        }
        // A sphere, or a light without area, which shines to all sides.
        None => CUBE
            .map(|axes| Frame::perspective(light, local, axes, Some(f64::from(light.half_box().length()))))
            .to_vec(),
    }
}

fn plain_view(center: Vec3, axes: [DVec3; 3], arrangement: Arrangement) -> View {
    View {
        middle: [0.0; 2],
        arrangement,
        ..View::perspective(center, axes, [0.5; 2], [1; 2])
    }
}

impl Frame {
    fn perspective(light: &AreaLight, local: &Local, axes: [DVec3; 3], size: Option<f64>) -> Self {
        let [right, up, forward] = axes;
        let middle = light.center.as_dvec3();
        let half = light.half_box().as_dvec3();
        let half = if size.is_some() {
            let across = |axis: DVec3| axis.abs().dot(half);
            [across(right), across(up), across(forward)]
        } else {
            // Half edges, and what rounding of the samples may add.
            let slack = (middle.abs() + half).max_element() * 2f64.powi(-20);
            let across = |axis: DVec3| {
                let [u, v] = [light.half_u, light.half_v].map(|v| v.as_dvec3().dot(axis).abs());
                (u + v) * 1.00001 + slack
            };
            [across(right), across(up), across(forward)]
        };
        // Rounding the center may move it by no more than this.
        let rounding = middle.abs().max_element() * 2f64.powi(-20) + f64::from(f32::MIN_POSITIVE);
        let behind = if size.is_some() { 0.0 } else { half[0].max(half[1]) };
        let center = (middle - forward * (half[2] * 1.001 + rounding + behind)).as_vec3();
        let view = plain_view(center, axes, Arrangement::Perspective);
        let offset = middle - center.as_dvec3();
        let (unit, wide) = (local.unit, 1.00001);
        let depths = [offset.dot(forward) - half[2], offset.dot(forward) + half[2]];
        let lanes = FrameLanes {
            half: [
                ((half[0] + offset.dot(right).abs()) * unit * wide) as f32,
                ((half[1] + offset.dot(up).abs()) * unit * wide) as f32,
            ],
            near: (depths[0] * unit / wide).max(0.0) as f32,
            depth: (depths[1] * unit * wide) as f32,
            reach: None,
            ..Self::axes(axes, (center.as_dvec3() - local.origin.as_dvec3()) * unit)
        };
        Self {
            view,
            lanes,
            scale: [1.0, 1.0 / unit],
            reach: size.map(|size| 3.0 * (size + rounding)),
            limit: if size.is_none() && depths[0] > 0.0 {
                (wide / depths[0]) as f32
            } else {
                f32::INFINITY
            },
        }
    }

    fn parallel(light: &AreaLight, local: &Local, min: DVec3, max: DVec3) -> Self {
        let forward = -light.center.as_dvec3().normalize_or(DVec3::Y);
        let right = forward.any_orthonormal_vector();
        let axes = [right, right.cross(forward), forward];
        let radius = (max - min).length() * 0.5 + f64::from(f32::MIN_POSITIVE);
        let center = ((min + max) * 0.5 - forward * (radius * 1.5)).as_vec3();
        let reach = radius * 8.0;
        let view = plain_view(center, axes, Arrangement::Parallel { reach });
        // Directions as slopes towards the light; the radii are at right angles to it but for rounding.
        let slope = |axis: DVec3| {
            let [u, v] = [light.half_u, light.half_v].map(|v| v.as_dvec3().dot(axis).abs());
            (u + v) * 1.001 + 1e-6
        };
        let unit = local.unit;
        let lanes = FrameLanes {
            half: [slope(right) as f32, slope(axes[1]) as f32],
            depth: 0.0,
            reach: Some((reach * unit) as f32),
            ..Self::axes(axes, (center.as_dvec3() - local.origin.as_dvec3()) * unit)
        };
        Self {
            view,
            lanes,
            scale: [unit, unit],
            reach: None,
            limit: f32::INFINITY,
        }
    }

    fn axes([right, up, forward]: [DVec3; 3], center: DVec3) -> FrameLanes {
        FrameLanes {
            right: right.as_vec3().to_array(),
            up: up.as_vec3().to_array(),
            forward: forward.as_vec3().to_array(),
            center: center.as_vec3().to_array(),
            half: [0.0; 2],
            near: 0.0,
            depth: 0.0,
            reach: None,
        }
    }

    /// What the kernels have to know of it.
    pub(super) fn sight(&self, light: &AreaLight) -> Sight {
        Sight {
            scale: self.scale.map(|scale| scale as f32),
            limit: self.limit,
            reach: self.reach.map(|reach| reach as f32),
            center: light.center.as_dvec3(),
            is_sun: light.is_sun(),
            half: light.half_box().as_dvec3(),
        }
    }

    /// The box of a triangle: smallest and largest x and y, largest and smallest nearness. `None` if it cannot come between a
    /// receiver of this frame and the light.
    #[inline]
    pub(super) fn bounds(
        &self,
        triangles: &Triangles,
        vertices: &[RasterVertex],
        prim: u32,
    ) -> Option<[f32; 6]> {
        let [a, b, c] = triangles.indices[prim as usize].map(|i| &vertices[i as usize]);
        let behind = a.nearness < 0.0 && b.nearness < 0.0 && c.nearness < 0.0;
        let beyond = a.nearness > self.limit && b.nearness > self.limit && c.nearness > self.limit;
        if behind || beyond {
            return None;
        }
        let bounds = if a.nearness > 0.0 && b.nearness > 0.0 && c.nearness > 0.0 {
            [
                a.x.min(b.x).min(c.x),
                a.x.max(b.x).max(c.x),
                a.y.min(b.y).min(c.y),
                a.y.max(b.y).max(c.y),
                a.nearness.max(b.nearness).max(c.nearness),
                a.nearness.min(b.nearness).min(c.nearness),
            ]
        } else {
            let [x0, x1, y0, y1, nearest] = self.unbounded(triangles.corners(prim));
            [x0, x1, y0, y1, nearest, -FAR]
        };
        if let Some(reach) = self.reach
            && Self::is_beside(reach as f32, &bounds, [a, b, c])
        {
            return None;
        }
        let wider = |v: f32, side: f32| {
            let v = v * self.scale[0] as f32;
            (v + side * (v.abs() * 2.0 * f32::EPSILON + 1e-37)).clamp(-FAR, FAR)
        };
        let nearest =
            (f64::from(bounds[4].min(self.limit)) * self.scale[1]) as f32 * (1.0 + 4.0 * f32::EPSILON);
        let farthest = (f64::from(bounds[5]) * self.scale[1]) as f32;
        Some([
            wider(bounds[0], -1.0),
            wider(bounds[1], 1.0),
            wider(bounds[2], -1.0),
            wider(bounds[3], 1.0),
            nearest.min(FAR),
            (farthest - farthest.abs() * (4.0 * f32::EPSILON)).max(-FAR),
        ])
    }

    /// Whether a triangle is on the outer side of one of the planes of a cube's face, moved out by `reach`.
    fn is_beside(reach: f32, bounds: &[f32; 6], vertices: [&RasterVertex; 3]) -> bool {
        // |x| > depth + reach at all corners, which all lie ahead.
        let nearness = vertices.map(|v| v.nearness);
        if !nearness.iter().all(|&n| n > 0.0) {
            return false;
        }
        let beyond =
            |at: fn(&RasterVertex) -> f32| vertices.iter().all(|v| at(v) > 1.0 + reach * v.nearness + 1e-5);
        let [x0, x1, y0, y1, ..] = *bounds;
        (x0 > 1.0 && beyond(|v| v.x))
            || (x1 < -1.0 && beyond(|v| -v.x))
            || (y0 > 1.0 && beyond(|v| v.y))
            || (y1 < -1.0 && beyond(|v| -v.y))
    }

    /// The box of the part of a triangle in front of the center's plane.
    #[cold]
    fn unbounded(&self, corners: [Vec3; 3]) -> [f32; 5] {
        let h = corners.map(|c| self.view.homogeneous(c.as_dvec3()));
        let p = h.map(|h| h.p);
        if self.lanes.reach.is_some() {
            let low = p[0].min(p[1]).min(p[2]);
            let high = p[0].max(p[1]).max(p[2]);
            let nearest = h[0].m.max(h[1].m).max(h[2].m);
            return [low.x, high.x, low.y, high.y, nearest].map(|v| v as f32);
        }
        let size = p.iter().fold(0.0, |size: f64, p| size.max(p.abs().max_element()));
        let (none, far) = (size * 1e-12, f64::from(FAR));
        let (mut low, mut high) = ([far; 2], [-far; 2]);
        let mut nearest = 0.0f64;
        for i in 0..3 {
            let (a, b) = (p[i], p[(i + 1) % 3]);
            if a.z > none {
                nearest = nearest.max(1.0 / a.z);
                for axis in 0..2 {
                    let at = a[axis] / a.z;
                    let slack = at.abs() * 1e-7 + none / a.z;
                    low[axis] = low[axis].min(at - slack);
                    high[axis] = high[axis].max(at + slack);
                }
            } else {
                nearest = far;
            }
            if (a.z > none) != (b.z > none) {
                // Towards the plane it goes to infinity on the side where it passes the plane.
                let at = a + (b - a) * ((a.z - none) / (a.z - b.z));
                for axis in 0..2 {
                    if at[axis] > -2.0 * none {
                        high[axis] = far;
                    }
                    if at[axis] < 2.0 * none {
                        low[axis] = -far;
                    }
                }
            }
        }
        if low[0] > high[0] {
            // All of it lies in the plane, or as good as.
            (low, high) = ([-far; 2], [far; 2]);
        }
        [low[0], high[0], low[1], high[1], nearest].map(|v| (v as f32).clamp(-FAR, FAR))
    }
}
