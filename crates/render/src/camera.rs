//! From a posed camera and a resolution to the view whose raster points are the pixels' rays.
//!
//! Conventions: right-handed; pixel (0, 0) is the top left one, its centre at (0.5, 0.5); pixels are square, the
//! vertical field of view governs and the aspect is width over height, whatever a file prescribes.
//!
//! The eye is rounded once to f32 in the local frame (relative to [`rayward_scene::FrameGeometry::origin`]): the
//! rounded eye *is* the camera of the picture, for every structure alike. Axes stay in f64, see [`View`].

use glam::{DVec3, Vec3};
use rayward_scene::{FrameGeometry, PosedCamera, Projection};
use rayward_trace::{Light, View};

use crate::error::check_size;
use crate::{Error, Result};

/// A camera in the local frame of one frame's geometry, for pictures of one size.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraFrame {
    /// Width of the picture in pixels.
    pub width: u32,
    /// Height of the picture in pixels.
    pub height: u32,
    /// The eye in the local frame, metres.
    pub eye: Vec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Half the width and half the height of the picture at a depth of 1; metres for an orthographic camera.
    pub half: [f64; 2],
    /// Whether the projection is parallel.
    pub orthographic: bool,
}

impl CameraFrame {
    /// The camera for a picture of this size, relative to `origin`.
    ///
    /// # Errors
    /// [`Error::ImageSize`] without pixels; [`Error::Camera`] if position, axes or lens are not finite, the axes
    /// are parallel, or the lens is out of range.
    pub fn new(camera: &PosedCamera, origin: DVec3, width: u32, height: u32) -> Result<Self> {
        check_size(width, height)?;
        let fail = |problem| Error::Camera {
            name: camera.name.clone(),
            problem,
        };
        let (half_height, orthographic) = match camera.projection {
            Projection::Perspective { vfov, .. } => {
                if !(vfov > 0.0 && vfov < std::f64::consts::PI) {
                    return Err(fail(
                        "the vertical field of view is not between 0 and 180 degrees",
                    ));
                }
                ((0.5 * vfov).tan(), false)
            }
            Projection::Orthographic { half_height, .. } => {
                if !(half_height > 0.0 && half_height.is_finite()) {
                    return Err(fail("the height of the orthographic view is not above 0"));
                }
                (half_height, true)
            }
        };
        let eye = (camera.eye - origin).as_vec3();
        if !eye.is_finite() {
            return Err(fail("the position is not finite"));
        }
        let forward = camera
            .forward
            .try_normalize()
            .ok_or_else(|| fail("there is no view direction"))?;
        let right = forward
            .cross(camera.up)
            .try_normalize()
            .ok_or_else(|| fail("the up direction is missing or along the view direction"))?;
        let up = right.cross(forward);

        let half_width = half_height * f64::from(width) / f64::from(height);
        Ok(Self {
            width,
            height,
            eye,
            forward,
            right,
            up,
            half: [half_width, half_height],
            orthographic,
        })
    }

    /// The camera's rays as the structures know them. An orthographic view has to know the depths that occur in
    /// `geometry`.
    pub fn view(&self, geometry: &FrameGeometry) -> View {
        let axes = [self.right, self.up, self.forward];
        let size = [self.width, self.height];
        if !self.orthographic {
            return View::perspective(self.eye, axes, self.half, size);
        }
        let farthest = geometry.bounds().map_or(1.0, |(low, high)| {
            let eye = self.eye.as_dvec3();
            let corner = |p: Vec3| -> DVec3 { (p.as_dvec3() - eye).abs() };
            corner(low).max(corner(high)).length()
        });
        View::parallel(self.eye, axes, self.half, 4.0 * farthest.max(1e-30), size)
    }

    /// From the eye to a raster point in the plane at depth 1; in the plane of the eye for an orthographic camera.
    pub(crate) fn offset(&self, [x, y]: [f64; 2]) -> DVec3 {
        let right = self.half[0] * (2.0 * x / f64::from(self.width) - 1.0);
        let up = self.half[1] * (1.0 - 2.0 * y / f64::from(self.height));
        let ahead = if self.orthographic {
            DVec3::ZERO
        } else {
            self.forward
        };
        ahead + self.right * right + self.up * up
    }

    /// Where the eye rays come from, as a light that would light what they see.
    pub fn vantage(&self) -> Light {
        if self.orthographic {
            Light::Directional((-self.forward).as_vec3())
        } else {
            Light::Point(self.eye)
        }
    }

    /// Width of a pixel, in metres, at this view depth: the footprint by which textures are filtered.
    #[inline]
    pub fn footprint(&self, depth: f32) -> f32 {
        let step = (2.0 * self.half[1] / f64::from(self.height)) as f32;
        if self.orthographic { step } else { step * depth }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(projection: Projection) -> PosedCamera {
        PosedCamera {
            name: "test".into(),
            eye: DVec3::new(1e6 + 1.0, 2.0, 3.0),
            forward: DVec3::NEG_Z,
            up: DVec3::Y,
            projection,
        }
    }

    const PERSPECTIVE: Projection = Projection::Perspective {
        vfov: std::f64::consts::FRAC_PI_2,
        aspect: Some(7.0),
    };

    #[test]
    fn perspective_pixels_lie_where_the_convention_says() {
        let frame = CameraFrame::new(&camera(PERSPECTIVE), DVec3::new(1e6, 0.0, 0.0), 8, 4).unwrap();
        assert_eq!(frame.eye, Vec3::new(1.0, 2.0, 3.0));
        // 90 degrees vertically, aspect 2: the picture spans [-2, 2] x [-1, 1] at depth 1.
        let view = frame.view(&FrameGeometry::default());
        let [top_left, bottom_right] = [view.pixel_ray(0, 0), view.pixel_ray(7, 3)];
        assert_eq!(top_left.origin, DVec3::new(1.0, 2.0, 3.0));
        assert!((top_left.dir - DVec3::new(-1.75, 0.75, -1.0)).length() < 1e-12);
        assert!((bottom_right.dir - DVec3::new(1.75, -0.75, -1.0)).length() < 1e-12);
        assert!((frame.footprint(2.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn orthographic_rays_are_parallel() {
        let lens = Projection::Orthographic {
            half_height: 2.0,
            aspect: None,
        };
        let frame = CameraFrame::new(&camera(lens), DVec3::new(1e6, 0.0, 0.0), 4, 4).unwrap();
        let ray = frame.view(&FrameGeometry::default()).pixel_ray(0, 3);
        assert_eq!(ray.dir, DVec3::NEG_Z);
        assert!((ray.origin - DVec3::new(-0.5, 0.5, 3.0)).length() < 1e-12);
        assert!((frame.footprint(100.0) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn axes_are_made_orthonormal() {
        let mut tilted = camera(PERSPECTIVE);
        tilted.forward = DVec3::new(0.3, -0.2, -2.0);
        let frame = CameraFrame::new(&tilted, DVec3::ZERO, 5, 3).unwrap();
        assert!((frame.up.length() - 1.0).abs() < 1e-12 && frame.up.dot(frame.forward).abs() < 1e-12);
        assert!(
            (frame.right.cross(frame.up) + frame.forward).length() < 1e-12,
            "right-handed"
        );
        let ray = frame.view(&FrameGeometry::default()).ray(1.3, 0.2);
        assert!((ray.dir.dot(frame.forward) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unusable_cameras_are_errors() {
        let size = |w, h| CameraFrame::new(&camera(PERSPECTIVE), DVec3::ZERO, w, h);
        assert!(matches!(size(0, 4), Err(Error::ImageSize { .. })));
        assert!(matches!(size(u32::MAX, u32::MAX), Err(Error::ImageSize { .. })));
        for vfov in [0.0, -1.0, 4.0, f64::NAN] {
            let lens = Projection::Perspective { vfov, aspect: None };
            assert!(matches!(
                CameraFrame::new(&camera(lens), DVec3::ZERO, 4, 4),
                Err(Error::Camera { .. })
            ));
        }
        let mut twisted = camera(PERSPECTIVE);
        twisted.up = twisted.forward;
        assert!(matches!(
            CameraFrame::new(&twisted, DVec3::ZERO, 4, 4),
            Err(Error::Camera { .. })
        ));
        let mut lost = camera(PERSPECTIVE);
        lost.eye.y = f64::INFINITY;
        assert!(matches!(
            CameraFrame::new(&lost, DVec3::ZERO, 4, 4),
            Err(Error::Camera { .. })
        ));
    }
}
