//! The mean of several frames: samples of the same pixels.

use glam::Vec3;

use crate::Film;

/// Colour and alpha of several frames, summed in their order. 16 bytes a pixel.
pub(crate) struct Mean {
    color: Vec<Vec3>,
    alpha: Vec<f32>,
    frames: f32,
}

impl Mean {
    /// Of no frames yet, for frames like this one.
    pub(crate) fn new(film: &Film) -> Self {
        Self {
            color: vec![Vec3::ZERO; film.color.len()],
            alpha: vec![0.0; film.alpha.len()],
            frames: 0.0,
        }
    }

    /// Takes a frame in.
    pub(crate) fn add(&mut self, film: &Film) {
        let colors = self.color.iter_mut().zip(&film.color);
        colors.for_each(|(sum, &color)| *sum += color);
        let alphas = self.alpha.iter_mut().zip(&film.alpha);
        alphas.for_each(|(sum, &alpha)| *sum += alpha);
        self.frames += 1.0;
    }

    /// Makes a frame's colour and alpha the means.
    pub(crate) fn finish(self, film: &mut Film) {
        let colors = film.color.iter_mut().zip(self.color);
        colors.for_each(|(out, sum)| *out = sum / self.frames);
        let alphas = film.alpha.iter_mut().zip(self.alpha);
        alphas.for_each(|(out, sum)| *out = sum / self.frames);
    }
}
