//! Where in its pixel, on the lens and within the shutter each sample of a pixel lies.
//!
//! Each pair of dimensions has a sequence of its own ([`sequence_point`]): any power of two of samples is well spread in
//! every pair, and pixels and pairs know nothing of each other. Values are multiples of 2^-24, in \[0, 1).

use rayward_trace::sequence_point;

/// One sample of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PixelSample {
    /// Place in the pixel.
    pub(crate) pixel: [f64; 2],
    /// Place on the lens, as a point of the unit square.
    pub(crate) lens: [f64; 2],
    /// Time within the shutter.
    pub(crate) time: f64,
}

impl PixelSample {
    /// Sample `index` of a pixel.
    pub(crate) fn new(x: u32, y: u32, index: u32) -> Self {
        let pair = |k: u32| sequence_point([x, y, k], index).map(f64::from);
        Self {
            pixel: pair(1),
            lens: pair(2),
            time: pair(3)[0],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_interval_of_a_pair_holds_one_of_64_samples() {
        for pixel in 0..20 {
            let samples: Vec<_> = (0..64).map(|i| PixelSample::new(pixel, 7, i)).collect();
            for points in [
                samples.iter().map(|s| s.pixel).collect::<Vec<_>>(),
                samples.iter().map(|s| s.lens).collect(),
            ] {
                for bits in 0..=6 {
                    let (columns, rows) = (1u32 << bits, 1u32 << (6 - bits));
                    let mut seen = [false; 64];
                    for [x, y] in &points {
                        let cell = (y * f64::from(rows)) as u32 * columns + (x * f64::from(columns)) as u32;
                        assert!(!seen[cell as usize], "two in cell {cell} of {columns}x{rows}");
                        seen[cell as usize] = true;
                    }
                }
            }
            let mut times: Vec<_> = samples.iter().map(|s| (s.time * 64.0) as u32).collect();
            times.sort_unstable();
            assert_eq!(times, (0..64).collect::<Vec<_>>());
        }
    }

    #[test]
    fn pixels_and_pairs_differ() {
        let (a, b) = (PixelSample::new(3, 4, 0), PixelSample::new(4, 3, 0));
        assert!(a.pixel != b.pixel && a.lens != b.lens && a.time != b.time);
        assert_ne!(a.pixel, a.lens);
    }
}
