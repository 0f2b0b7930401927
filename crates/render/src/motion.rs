//! Motion vectors: how far what each pixel sees has come in the picture since a moment before.
//!
//! A pixel's triangle and barycentric weights name the same point of the surface at both moments, so its two places in
//! the picture follow from the geometry of both, whatever moved: the object, its skin, the camera. Pixels that see no
//! surface see something infinitely far away, which moves as the camera turns. Cost: some 50 ns a pixel.

use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;
use rayward_scene::{FrameGeometry, PosedCamera};

use crate::film::{LayerKind, NO_ID};
use crate::{CameraFrame, Error, Film, Result};

/// Geometry and camera of one moment.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'g> {
    /// The geometry.
    pub geometry: &'g FrameGeometry,
    /// The camera.
    pub camera: &'g PosedCamera,
}

/// Fills a film's motion layer: the place of what a pixel sees in the frame `now`, less its place in the frame `before`,
/// in pixels to the right and down. Zero where it was behind the camera. The film is of `now`, both are of one scene.
///
/// # Errors
/// [`Error::MissingLayer`] if the film does not hold prim and bary; [`Error::Camera`].
///
/// # Panics
/// If a geometry is not of the film's scene.
pub fn add_motion(film: &mut Film, now: Moment, before: Moment) -> Result<()> {
    for layer in [LayerKind::Prim, LayerKind::Bary] {
        if !film.holds(layer) {
            return Err(Error::MissingLayer { layer: layer.name() });
        }
    }
    let (width, height) = (film.width(), film.height());
    let camera = |moment: Moment| CameraFrame::new(moment.camera, now.geometry.origin, width, height);
    let cameras = [camera(now)?, camera(before)?];
    let seen = |pixel: usize| -> [Seen; 2] {
        let prim = film.prim[pixel];
        if prim == NO_ID {
            let (x, y) = (pixel as u32 % width, pixel as u32 / width);
            let middle = [x, y].map(|v| f64::from(v) + 0.5);
            return [Seen::Beyond(cameras[0].offset(middle)); 2];
        }
        // By the same corners at both times: which triangles have area may differ.
        let corners = now.geometry.indices[prim as usize];
        let [u, v] = film.bary[pixel].to_array().map(f64::from);
        [now, before].map(|moment| {
            let [a, b, c] = corners.map(|corner| moment.geometry.position(corner).as_dvec3());
            Seen::At(a + (b - a) * u + (c - a) * v)
        })
    };
    let motion = |pixel: usize| {
        let [now, before] = seen(pixel);
        let places = cameras[0].place(now).zip(cameras[1].place(before));
        places.map_or(Vec2::ZERO, |(now, before)| (now - before).as_vec2())
    };
    let pixels = width as usize * height as usize;
    let own = |pixel: &usize| {
        let (x, y) = (*pixel as u32 % width, *pixel as u32 / width);
        film.part.is_none_or(|part| part.shard.has_pixel(x, y))
    };
    let motions = (0..pixels)
        .into_par_iter()
        .map(|pixel| if own(&pixel) { motion(pixel) } else { Vec2::ZERO });
    film.motion = motions.collect();
    film.note_layers();
    Ok(())
}

/// What a pixel sees.
#[derive(Clone, Copy)]
enum Seen {
    /// A point, in the local frame.
    At(DVec3),
    /// Nothing, in this direction.
    Beyond(DVec3),
}

impl CameraFrame {
    /// Where something is in the picture, in pixels; `None` behind the camera.
    fn place(&self, seen: Seen) -> Option<DVec2> {
        let from_eye = match seen {
            Seen::At(point) => point - self.eye.as_dvec3(),
            // With parallel rays nothing is beyond but the picture's own plane.
            Seen::Beyond(_) if self.orthographic => return None,
            Seen::Beyond(direction) => direction,
        };
        let depth = if self.orthographic {
            1.0
        } else {
            from_eye.dot(self.forward)
        };
        let right = from_eye.dot(self.right) / (depth * self.half[0]);
        let up = from_eye.dot(self.up) / (depth * self.half[1]);
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        (depth > 0.0).then(|| DVec2::new(1.0 + right, 1.0 - up) * 0.5 * size)
    }
}
