//! A vantage's view: the map between space and a raster, and the rays through raster points.
//!
//! A raster point (x, y) in \[0, width\] x \[0, height\], row 0 on top, names one ray of the vantage. For a
//! perspective view all rays leave `center`; for a parallel one they share the direction `forward`. Either way
//! lines through the vantage become points of the raster, so triangles become 2-D triangles and visibility a
//! question of coverage and order (HM08 §3: perspective space; its X and Y are the raster's up to scale).
//!
//! Order along a ray is kept as *nearness*, larger being nearer and affine in the raster for every plane:
//! 1 / depth in a perspective view, `reach - depth` in a parallel one. Depth is measured along `forward`, which
//! has length 1, so it equals the parameter t of the ray.
//!
//! The center is an f32 point, and the geometry is f32, so differences are exact to the last bit; the axes are
//! f64.

use glam::{DVec3, Vec3};

/// How the rays of a view are arranged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Arrangement {
    /// All rays leave one point.
    Perspective,
    /// All rays have one direction; nearness is `reach - depth`.
    Parallel {
        /// Larger than twice every depth that occurs, so that nearness has a stable relative precision.
        reach: f64,
    },
}

/// The view of a camera, or of one face of a light, onto its raster.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Center of projection, or the middle of the raster's plane in a parallel view; exactly representable.
    pub center: Vec3,
    /// Unit axis of growing x.
    pub right: DVec3,
    /// Unit axis of falling y (row 0 is on top).
    pub up: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Raster units per unit of tangent (perspective) or length (parallel).
    pub scale_x: f64,
    /// As `scale_x`, for y.
    pub scale_y: f64,
    /// Raster point of the ray along `forward`.
    pub middle: [f64; 2],
    /// Raster width.
    pub width: u32,
    /// Raster height.
    pub height: u32,
    /// Arrangement of the rays.
    pub arrangement: Arrangement,
}

/// A ray in f64: `origin + t * dir`, t > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewRay {
    /// Start.
    pub origin: DVec3,
    /// Direction; its component along the view's `forward` is 1.
    pub dir: DVec3,
}

/// Homogeneous raster coordinates of a point: raster = (x, y) / w, nearness = m / w.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Homogeneous {
    /// (x, y, w).
    pub p: DVec3,
    /// Nearness times w.
    pub m: f64,
}

/// A rectangle of the raster, and a bound on the nearness of what it shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    pub(crate) min: [f64; 2],
    pub(crate) max: [f64; 2],
    pub(crate) nearest: f64,
}

impl View {
    /// A perspective view whose half angles have the tangents `tan_x` and `tan_y`.
    pub fn perspective(center: Vec3, axes: [DVec3; 3], tan: [f64; 2], size: [u32; 2]) -> Self {
        let [right, up, forward] = axes;
        let [width, height] = size;
        Self {
            center,
            right,
            up,
            forward,
            scale_x: f64::from(width) / (2.0 * tan[0]),
            scale_y: f64::from(height) / (2.0 * tan[1]),
            middle: [f64::from(width) * 0.5, f64::from(height) * 0.5],
            width,
            height,
            arrangement: Arrangement::Perspective,
        }
    }

    /// A parallel view of half extents `half`, for depths up to half of `reach` in magnitude.
    pub fn parallel(center: Vec3, axes: [DVec3; 3], half: [f64; 2], reach: f64, size: [u32; 2]) -> Self {
        let arrangement = Arrangement::Parallel { reach };
        Self {
            arrangement,
            ..Self::perspective(center, axes, half, size)
        }
    }

    /// The same rays on a raster of `size` that shows only the window from `min` to `max` of this raster.
    pub fn window(&self, min: [f64; 2], max: [f64; 2], size: [u32; 2]) -> Self {
        let zoom = [0, 1].map(|i| f64::from(size[i]) / (max[i] - min[i]));
        Self {
            scale_x: self.scale_x * zoom[0],
            scale_y: self.scale_y * zoom[1],
            middle: [0, 1].map(|i| (self.middle[i] - min[i]) * zoom[i]),
            width: size[0],
            height: size[1],
            ..*self
        }
    }

    /// The same view whose rays pass this far, in raster units, to the right and below of where they did.
    pub fn shifted(&self, [x, y]: [f64; 2]) -> Self {
        Self {
            middle: [self.middle[0] - x, self.middle[1] - y],
            ..*self
        }
    }

    /// Bound on the f64 error of a raster coordinate of a point within the raster, or of the ray through it, in
    /// raster units. Below 1e-9 but for extremely narrow or far views.
    pub fn rounding(&self) -> f64 {
        let size = [f64::from(self.width), f64::from(self.height)];
        let (scale, lateral) = (0..2).fold((0.0f64, 0.0f64), |(scale, lateral), axis| {
            let s = [self.scale_x, self.scale_y][axis].abs();
            let farthest = self.middle[axis]
                .abs()
                .max((size[axis] - self.middle[axis]).abs());
            (scale.max(s), lateral.max(farthest / s))
        });
        let raster = self.middle[0].abs() + self.middle[1].abs() + size[0] + size[1];
        let center = f64::from(self.center.abs().max_element());
        let reach = match self.arrangement {
            Arrangement::Perspective => (1.0 + lateral) * (1.0 + lateral),
            Arrangement::Parallel { reach } => reach + lateral + center,
        };
        (scale * reach + raster) * 2f64.powi(-49)
    }

    /// How far, in raster units, a point moves at most that moves by one unit of its depth, or of length in a parallel view.
    pub(crate) fn spread(&self) -> f64 {
        let far = |middle: f64, size: u32, scale: f64| {
            let farthest = middle.abs().max((f64::from(size) - middle).abs());
            match self.arrangement {
                Arrangement::Perspective => scale.abs() + farthest,
                Arrangement::Parallel { .. } => scale.abs(),
            }
        };
        let x = far(self.middle[0], self.width, self.scale_x);
        x.max(far(self.middle[1], self.height, self.scale_y)) * 2.0
    }

    /// The ray through raster point (x, y).
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> ViewRay {
        let [cx, cy] = self.middle;
        let offset = self.right * ((x - cx) / self.scale_x) + self.up * ((cy - y) / self.scale_y);
        let center = self.center.as_dvec3();
        match self.arrangement {
            Arrangement::Perspective => ViewRay {
                origin: center,
                dir: self.forward + offset,
            },
            Arrangement::Parallel { .. } => ViewRay {
                origin: center + offset,
                dir: self.forward,
            },
        }
    }

    /// The ray through the centre of pixel (x, y).
    #[inline]
    pub fn pixel_ray(&self, x: u32, y: u32) -> ViewRay {
        self.ray(f64::from(x) + 0.5, f64::from(y) + 0.5)
    }

    /// Homogeneous raster coordinates of a point; `w` is its depth in a perspective view and 1 otherwise.
    #[inline]
    pub fn homogeneous(&self, point: DVec3) -> Homogeneous {
        let a = point - self.center.as_dvec3();
        let depth = a.dot(self.forward);
        let (w, m) = match self.arrangement {
            Arrangement::Perspective => (depth, 1.0),
            Arrangement::Parallel { reach } => (1.0, reach - depth),
        };
        let [cx, cy] = self.middle;
        let x = a.dot(self.right) * self.scale_x + cx * w;
        let y = cy * w - a.dot(self.up) * self.scale_y;
        Homogeneous {
            p: DVec3::new(x, y, w),
            m,
        }
    }

    /// Nearness of a depth.
    #[inline]
    pub fn nearness(&self, depth: f64) -> f64 {
        match self.arrangement {
            Arrangement::Perspective => 1.0 / depth,
            Arrangement::Parallel { reach } => reach - depth,
        }
    }

    /// Where the raster shows a box; all of it where the box reaches behind the start of the view. `None` if nothing
    /// of the box lies in front.
    pub(crate) fn window_of_box(&self, low: DVec3, high: DVec3) -> Option<Window> {
        let corner = |i: usize| {
            let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
            DVec3::new(
                pick(1, low.x, high.x),
                pick(2, low.y, high.y),
                pick(4, low.z, high.z),
            )
        };
        let nearest = self.nearest_in_box(low, high);
        let all = Window {
            min: [0.0; 2],
            max: [f64::from(self.width), f64::from(self.height)],
            nearest,
        };
        // A box that is not finite, or whose depth is not certain to be positive, may be anywhere.
        if !(low.is_finite() && high.is_finite() && nearest.is_finite()) {
            let center = self.center.as_dvec3();
            let behind = (0..8).all(|i| (corner(i) - center).dot(self.forward) < 0.0);
            return (!behind).then_some(all);
        }
        let window = self.window_of((0..8).map(corner));
        Some(window.map_or(all, |w| Window { nearest, ..w }))
    }

    /// Smallest window that holds these points; `None` if one does not lie in front.
    pub(crate) fn window_of(&self, points: impl Iterator<Item = DVec3>) -> Option<Window> {
        let mut window = Window {
            min: [f64::INFINITY; 2],
            max: [f64::NEG_INFINITY; 2],
            nearest: 0.0,
        };
        for point in points {
            let h = self.homogeneous(point);
            let inverse = 1.0 / h.p.z;
            if !(h.p.z > 0.0 && inverse.is_finite()) {
                return None;
            }
            let [x, y] = [h.p.x * inverse, h.p.y * inverse];
            window.min = [window.min[0].min(x), window.min[1].min(y)];
            window.max = [window.max[0].max(x), window.max[1].max(y)];
            window.nearest = window.nearest.max(h.m * inverse);
        }
        Some(window)
    }

    /// Bound on the nearness of all points of a box that lie in front.
    pub(crate) fn nearest_in_box(&self, low: DVec3, high: DVec3) -> f64 {
        let center = self.center.as_dvec3();
        let products = |corner: DVec3| (corner - center) * self.forward;
        let (a, b) = (products(low), products(high));
        let rounding = (a.abs() + b.abs()).element_sum() * 2f64.powi(-50);
        let depth = a.min(b).element_sum() - rounding;
        match self.arrangement {
            Arrangement::Perspective if depth > 0.0 => 1.0 / depth,
            Arrangement::Perspective => f64::INFINITY,
            Arrangement::Parallel { reach } => reach - depth.max(0.0),
        }
    }
}
