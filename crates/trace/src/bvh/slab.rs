//! The conservative ray-box test (after Ize, "Robust BVH Ray Traversal", JCGT 2013).
//!
//! The test is in f32 and never misses a box whose triangles have an exact hit inside the current range; it
//! takes boxes missed by a few ulps of the distance for hit. How:
//!
//! - The direction is scaled by a power of two so that its largest component is in [1, 2). Parameters then are
//!   distances, and no reciprocal overflows.
//! - A component below 2^-80 of the largest is raised to that. Over the length of the scene the ray strays by
//!   less than 2^-80 of it; the origin is widened to an interval of 2^-60 of the scene's size and at least one
//!   ulp to each side. So there is neither an infinity nor a 0 * inf, and a ray within a slab's face is inside.
//! - A difference of two f32, a reciprocal and a product are each within 2^-24 of their value: the far parameter
//!   is moved out by 2^-20 of itself, and so are the ends of the ray's range.
//!
//! Limit: where coordinates pass 2^125 a difference could overflow; such a ray takes every box for hit.

use glam::DVec3;

use super::node::{Node, WIDTH};

const FAR_PAD: f32 = 1.0 / (1u32 << 20) as f32;
const TINY: f64 = f64::from_bits((1023 - 140) << 52);
const SMALLEST_COMPONENT: f64 = f64::from_bits((1023 - 80) << 52);
const ORIGIN_PAD: f64 = f64::from_bits((1023 - 60) << 52);
const LARGEST_COORDINATE: f64 = f64::from_bits((1023 + 125) << 52);

/// A ray prepared for box tests. Its parameters are the ray's `t` times `scale`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    /// Upper end of the origin's interval, lower end.
    origin: [[f32; 3]; 2],
    inverse: [f32; 3],
    /// 1 where the ray runs towards smaller coordinates, so that it enters through the upper face.
    entry: [usize; 3],
    t_min: f32,
    pub(super) t_max: f32,
    scale: f64,
}

fn rounded_up(x: f64) -> f32 {
    (x + x.abs() * f64::from(FAR_PAD) + TINY) as f32
}

impl Slab {
    /// The ray `origin + t dir` for `t_min <= t <= t_max` through a scene whose coordinates are at most `reach`
    /// in magnitude. `None` if it cannot hit anything.
    pub(super) fn new(origin: DVec3, dir: DVec3, t_min: f64, t_max: f64, reach: f64) -> Option<Self> {
        if !origin.is_finite() || !dir.is_finite() || dir == DVec3::ZERO {
            return None;
        }
        // The power of two below the largest component: its exponent bits alone.
        let scale = f64::from_bits(dir.abs().max_element().to_bits() & 0x7ff0_0000_0000_0000);
        let size = reach + origin.abs().max_element();
        if size > LARGEST_COORDINATE || scale == 0.0 {
            return Some(Self {
                origin: [[0.0; 3]; 2],
                inverse: [0.0; 3],
                entry: [0; 3],
                t_min: f32::NEG_INFINITY,
                t_max: f32::INFINITY,
                scale: 0.0,
            });
        }
        let pad = size * ORIGIN_PAD + TINY;
        let dir = (dir / scale).to_array();
        let component = dir.map(|d| {
            if d.abs() < SMALLEST_COMPONENT {
                SMALLEST_COMPONENT.copysign(d)
            } else {
                d
            }
        });
        Some(Self {
            origin: [
                origin.to_array().map(|o| ((o + pad) as f32).next_up()),
                origin.to_array().map(|o| ((o - pad) as f32).next_down()),
            ],
            inverse: component.map(|d| (1.0 / d) as f32),
            entry: component.map(|d| usize::from(d < 0.0)),
            t_min: -rounded_up(-t_min * scale),
            t_max: rounded_up(t_max * scale),
            scale,
        })
    }

    /// Lets nothing beyond this `t` count any more.
    pub(super) fn shorten(&mut self, t: f64) {
        self.t_max = rounded_up(t * self.scale);
    }

    /// Parameters at which the ray enters the node's boxes, and whether it does.
    #[inline(always)]
    pub(super) fn enter(&self, node: &Node) -> ([f32; WIDTH], [bool; WIDTH]) {
        let mut near = [self.t_min; WIDTH];
        let mut far = [self.t_max; WIDTH];
        for axis in 0..3 {
            let entry = self.entry[axis] & 1;
            let exit = entry ^ 1;
            let (enter_at, leave_at) = (&node.bounds[axis][entry], &node.bounds[axis][exit]);
            let inverse = self.inverse[axis];
            let (enter_from, leave_from) = (self.origin[entry][axis], self.origin[exit][axis]);
            for lane in 0..WIDTH {
                let t = (enter_at[lane] - enter_from) * inverse;
                near[lane] = if t > near[lane] { t } else { near[lane] };
                let t = (leave_at[lane] - leave_from) * inverse;
                far[lane] = if t < far[lane] { t } else { far[lane] };
            }
        }
        let mut hit = [false; WIDTH];
        for lane in 0..WIDTH {
            hit[lane] = near[lane] <= far[lane] + far[lane].abs() * FAR_PAD;
        }
        (near, hit)
    }
}
