//! Rays of a camera with a lens and a shutter.
//!
//! A thin lens stands in the plane of the eye, perpendicular to the view direction. All rays of a point of the picture
//! meet in the plane at depth `focus`, wherever they pass the lens; points before and behind are spread over a disk.
//! While the shutter is open the camera moves from one place to another on a straight line.
//!
//! ```text
//! origin = fl32(eye + lens)    direction = (eye + offset(x, y) focus - origin) / focus, as f32
//! ```
//!
//! The component of the direction along the view direction is 1, so that the parameter of a hit is its view depth.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::DVec3;
use rayward_trace::Ray;

use crate::CameraFrame;
use crate::pixel_samples::PixelSample;

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Half the diameter of its opening, metres.
    pub radius: f64,
    /// View depth of what is sharp, metres, above 0.
    pub focus: f64,
}

/// A camera from the opening of the shutter to its closing.
pub(crate) struct MovingCamera<'c> {
    pub(crate) open: &'c CameraFrame,
    pub(crate) close: &'c CameraFrame,
    pub(crate) lens: Option<Lens>,
}

impl MovingCamera<'_> {
    /// The ray of a sample of pixel (x, y).
    pub(crate) fn ray(&self, x: u32, y: u32, sample: &PixelSample) -> Ray {
        let mix = |of: &dyn Fn(&CameraFrame) -> DVec3| {
            let (open, close) = (of(self.open), of(self.close));
            open + (close - open) * sample.time
        };
        let place = [f64::from(x) + sample.pixel[0], f64::from(y) + sample.pixel[1]];
        let eye = mix(&|c| c.eye.as_dvec3());
        let offset = mix(&|c| c.offset(place));
        let forward = mix(&|c| c.forward);
        let (from, ahead) = if self.open.orthographic {
            (eye + offset, forward)
        } else {
            (eye, offset)
        };
        let Some(lens) = self.lens else {
            return Ray::new(from.as_vec3(), ahead.as_vec3());
        };
        let [u, v] = on_disk(sample.lens);
        let origin = (from + (mix(&|c| c.right) * u + mix(&|c| c.up) * v) * lens.radius).as_vec3();
        let target = from + ahead * lens.focus;
        Ray::new(origin, ((target - origin.as_dvec3()) / lens.focus).as_vec3())
    }
}

/// From the unit square to the unit disk, keeping areas and what is near (Shirley and Chiu 1997).
fn on_disk([x, y]: [f64; 2]) -> [f64; 2] {
    let (a, b) = (2.0 * x - 1.0, 2.0 * y - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let (radius, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    [radius * angle.cos(), radius * angle.sin()]
}

#[cfg(test)]
mod tests {
    use rayward_scene::{PosedCamera, Projection};

    use super::*;

    fn frame(eye: DVec3) -> CameraFrame {
        let camera = PosedCamera {
            name: String::new(),
            eye,
            forward: DVec3::NEG_Z,
            up: DVec3::Y,
            projection: Projection::Perspective {
                vfov: 1.0,
                aspect: None,
            },
        };
        CameraFrame::new(&camera, DVec3::ZERO, 64, 48).expect("a camera")
    }

    #[test]
    fn rays_of_a_point_meet_in_the_plane_of_focus() {
        let (open, close) = (frame(DVec3::ZERO), frame(DVec3::X));
        let lens = Some(Lens {
            radius: 0.1,
            focus: 4.0,
        });
        let camera = MovingCamera {
            open: &open,
            close: &close,
            lens,
        };
        let mut spread = 0.0f32;
        for i in 0..64 {
            let sample = PixelSample {
                pixel: [0.25, 0.75],
                ..PixelSample::new(0, 0, i)
            };
            let ray = camera.ray(10, 20, &sample);
            assert!((ray.dir.z + 1.0).abs() < 1e-6);
            let there = ray.origin + ray.dir * 4.0;
            let wanted = (open.offset([10.25, 20.75]) * 4.0 + DVec3::X * sample.time).as_vec3();
            assert!((there - wanted).length() < 1e-5, "{there} {wanted}");
            let center = DVec3::X * sample.time;
            let beside = (ray.origin.as_dvec3() - center).length() as f32;
            assert!(beside <= 0.1 + 1e-6);
            spread = spread.max(beside);
        }
        assert!(spread > 0.09, "{spread}");
    }
}
