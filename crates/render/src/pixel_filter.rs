//! Antialiasing: where the samples of a pixel lie.
//!
//! Sample `k` of all pixels lies at the same offset from their centres, so each is one more frame of the eye grid
//! with its raster shifted (the accumulation buffer of Haeberli and Akeley, SIGGRAPH 1990), and the mean of the
//! frames is the picture. Offsets are distributed as the filter weighs them (filter importance sampling: Ernst,
//! Stamminger and Greiner, *Filter Importance Sampling*, RT 2006), hence all samples weigh the same, and no sample
//! has to be kept for the pixels around.
//!
//! The offsets are one set of Sobol's points, moved around the square so that sample 0 is the centre of the pixel: what
//! layers besides colour and alpha hold.

use rayward_trace::Samples;

/// How a pixel weighs what lies around its centre.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum PixelFilter {
    /// The square of the pixel, evenly: the mean over its area.
    Box,
    /// Blackman and Harris' window over three pixels: smooth edges without ringing.
    #[default]
    BlackmanHarris,
}

impl PixelFilter {
    /// Offset of sample `k` from a pixel's centre, in pixels.
    pub fn offset(self, k: u32) -> [f64; 2] {
        let set = Samples::new(1, 0);
        let (first, point) = (set.point(0, 0), set.point(0, k));
        [0, 1].map(|axis| {
            let moved = (f64::from(point[axis]) - f64::from(first[axis]) + 1.5).fract();
            match self {
                Self::Box => moved - 0.5,
                Self::BlackmanHarris => blackman_harris(moved),
            }
        })
    }
}

/// The place in \[-1.5, 1.5\] at which the window's integral has the share `share` of the whole.
fn blackman_harris(share: f64) -> f64 {
    use std::f64::consts::TAU;
    const TERMS: [f64; 4] = [0.35875, 0.48829, 0.14128, 0.01168];
    // Integral from the window's start to x in [0, 1]: a0 x - a1 sin(2 pi x) / 2 pi + ...
    let integral = |x: f64| {
        let wave = |k: usize| TERMS[k] * (TAU * k as f64 * x).sin() / (TAU * k as f64);
        (TERMS[0] * x - wave(1) + wave(2) - wave(3)) / TERMS[0]
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if integral(middle) < share {
            low = middle;
        } else {
            high = middle;
        }
    }
    if share == 0.5 {
        0.0
    } else {
        3.0 * (0.5 * (low + high) - 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sample_is_the_centre_and_all_balance() {
        for (filter, reach, spread) in [
            (PixelFilter::Box, 0.5, 1.0 / 12.0),
            (PixelFilter::BlackmanHarris, 1.5, 0.173),
        ] {
            assert_eq!(filter.offset(0), [0.0, 0.0]);
            let offsets: Vec<[f64; 2]> = (0..256).map(|k| filter.offset(k)).collect();
            for axis in 0..2 {
                let moment = |power| offsets.iter().map(|o| o[axis].powi(power)).sum::<f64>() / 256.0;
                assert!(offsets.iter().all(|o| o[axis].abs() <= reach));
                assert!(moment(1).abs() < 0.01, "{filter:?}: mean {}", moment(1));
                assert!(
                    (moment(2) - spread).abs() < 0.01,
                    "{filter:?}: variance {}",
                    moment(2)
                );
            }
        }
    }
}
