//! How much two images differ: in numbers, in the eye of a viewer, and where.
//!
//! Values are compared as they are in the files: sRGB encoded ones as displayed, linear ones as they are. If only
//! one of the images is encoded, the other is encoded as well. FLIP always sees displayed values.
//!
//! Cost: some 1 microsecond a pixel and core, nearly all of it FLIP.

mod flip;

use glam::Vec4;

use crate::{Error, Picture, Result};

/// What counts as a difference, and for whom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareOptions {
    /// A pixel differs if one of its channels does by more than this; in the units of the compared values.
    pub tolerance: f32,
    /// Pixels per degree of visual angle for FLIP.
    pub pixels_per_degree: f32,
}

impl Default for CompareOptions {
    /// No tolerance, and the viewer of FLIP's authors: 0.7 m from a 0.7 m wide display of 3840 pixels.
    fn default() -> Self {
        Self {
            tolerance: 0.0,
            pixels_per_degree: 67.0,
        }
    }
}

/// One channel of one pixel that differs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// 0 red, 1 green, 2 blue, 3 alpha.
    pub channel: u8,
    /// Value in the first image.
    pub a: f32,
    /// Value in the second image.
    pub b: f32,
}

impl Difference {
    /// The absolute difference, infinite if only one value is finite.
    pub fn amount(&self) -> f32 {
        amount(self.a, self.b)
    }
}

/// How two images of the same size differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Width of both in pixels.
    pub width: u32,
    /// Height of both in pixels.
    pub height: u32,
    /// Whether sRGB encoded values were compared; linear ones otherwise.
    pub srgb: bool,
    /// Root of the mean squared difference of red, green and blue, where both are finite.
    pub rmse: f64,
    /// Peak signal to noise ratio in decibels; infinite without a difference. The peak is 1 for encoded values
    /// and the largest finite component of the first image for linear ones.
    pub psnr: f64,
    /// Mean of FLIP over all pixels, 0 (equal) to 1.
    pub mean_flip: f64,
    /// FLIP of every pixel, row 0 on top.
    pub flip: Vec<f32>,
    /// Pixels with a channel beyond the tolerance.
    pub differing: usize,
    /// The largest difference, the first of equals; `None` without any.
    pub largest: Option<Difference>,
    /// Pixels of the first image with a channel that is not finite.
    pub non_finite_a: usize,
    /// Pixels of the second image with a channel that is not finite.
    pub non_finite_b: usize,
}

/// Compares two images, the first being the reference.
///
/// A value that is not finite differs from every other value but itself; so does a NaN, which equals only NaN.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::ImageSize`] if an image does not have the pixels its size says.
pub fn compare(a: &Picture, b: &Picture, options: &CompareOptions) -> Result<Comparison> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(Error::SizeMismatch {
            a_width: a.width,
            a_height: a.height,
            b_width: b.width,
            b_height: b.height,
        });
    }
    for picture in [a, b] {
        let (width, height) = (picture.width, picture.height);
        if crate::error::check_size(width, height)? != picture.pixels.len() {
            return Err(Error::ImageSize {
                width,
                height,
                problem: "does not match the number of its pixels",
            });
        }
    }
    let srgb = a.srgb || b.srgb;
    let (displayed_a, displayed_b) = (a.to_srgb(), b.to_srgb());
    let numbers = if srgb {
        Numbers::of(&displayed_a, &displayed_b, options.tolerance)
    } else {
        Numbers::of(a, b, options.tolerance)
    };
    let rmse = (numbers.squares / numbers.squared.max(1) as f64).sqrt();
    let peak = if srgb { 1.0 } else { f64::from(numbers.peak) };
    let flip = flip::flip(&displayed_a, &displayed_b, options.pixels_per_degree);
    Ok(Comparison {
        width: a.width,
        height: a.height,
        srgb,
        rmse,
        psnr: if rmse > 0.0 {
            20.0 * (peak / rmse).log10()
        } else {
            f64::INFINITY
        },
        mean_flip: flip.iter().map(|&e| f64::from(e)).sum::<f64>() / flip.len() as f64,
        flip,
        differing: numbers.differing,
        largest: numbers.largest,
        non_finite_a: numbers.non_finite[0],
        non_finite_b: numbers.non_finite[1],
    })
}

impl Comparison {
    /// FLIP of every pixel in false colours, three sRGB bytes a pixel: black where equal, over violet and orange
    /// to pale yellow.
    pub fn difference_picture(&self) -> Vec<u8> {
        self.flip.iter().flat_map(|&error| false_color(error)).collect()
    }
}

fn amount(a: f32, b: f32) -> f32 {
    if a == b || (a.is_nan() && b.is_nan()) {
        0.0
    } else if a.is_finite() && b.is_finite() {
        (a - b).abs()
    } else {
        f32::INFINITY
    }
}

/// Sums over all pixels.
struct Numbers {
    /// Sum of squared differences.
    squares: f64,
    /// Number of values in `squares`.
    squared: usize,
    peak: f32,
    differing: usize,
    largest: Option<Difference>,
    non_finite: [usize; 2],
}

impl Numbers {
    fn of(a: &Picture, b: &Picture, tolerance: f32) -> Self {
        let mut sums = Self {
            squares: 0.0,
            squared: 0,
            peak: 0.0,
            differing: 0,
            largest: None,
            non_finite: [0; 2],
        };
        for (i, (&p, &q)) in a.pixels.iter().zip(&b.pixels).enumerate() {
            let place = (i as u32 % a.width, i as u32 / a.width);
            sums.add(place, p, q, tolerance);
        }
        sums
    }

    fn add(&mut self, (x, y): (u32, u32), p: Vec4, q: Vec4, tolerance: f32) {
        self.non_finite[0] += usize::from(!p.is_finite());
        self.non_finite[1] += usize::from(!q.is_finite());
        let mut differs = false;
        for (channel, (a, b)) in (0..).zip(p.to_array().into_iter().zip(q.to_array())) {
            let amount = amount(a, b);
            differs |= amount > tolerance;
            if amount > self.largest.map_or(0.0, |largest| largest.amount()) {
                self.largest = Some(Difference { x, y, channel, a, b });
            }
            if channel < 3 && a.is_finite() && b.is_finite() {
                self.squares += (f64::from(a) - f64::from(b)).powi(2);
                self.squared += 1;
                self.peak = self.peak.max(a);
            }
        }
        self.differing += usize::from(differs);
    }
}

/// Stops of the colour map, evenly spaced.
const STOPS: [[u8; 3]; 9] = [
    [0, 0, 4],
    [28, 16, 68],
    [79, 18, 123],
    [129, 37, 129],
    [181, 54, 122],
    [229, 89, 100],
    [251, 135, 97],
    [254, 194, 135],
    [252, 253, 191],
];

fn false_color(value: f32) -> [u8; 3] {
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let stop = (place as usize).min(STOPS.len() - 2);
    let fraction = place - stop as f32;
    std::array::from_fn(|c| {
        let (low, high) = (f32::from(STOPS[stop][c]), f32::from(STOPS[stop + 1][c]));
        (low + (high - low) * fraction).round() as u8
    })
}
