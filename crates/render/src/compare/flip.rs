//! LDR-FLIP: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020.
//!
//! ```text
//! sRGB -> YCxCz -> contrast sensitivity (Gaussians) -> linear RGB -> L*a*b*, Hunt -> HyAB -> redistributed: Ec
//!      -> Y     -> edges and points (Gaussian derivatives)                             -> largest change:  Ef
//! FLIP = Ec ^ (1 - Ef)
//! ```
//!
//! All kernels are separable and run as rows and columns; images continue with their edge pixels. Values outside
//! of \[0, 1\] are cut off, what is not a number counts as 0.

use std::f32::consts::PI;

use glam::{Mat3, Vec2, Vec3};
use rayon::prelude::*;

use crate::Picture;
use crate::tonemap::{decode_srgb, unit};

/// Exponent of colour differences.
const COLOR_EXPONENT: f32 = 0.7;
/// Share of the largest colour difference that is mapped to `TURN_VALUE`.
const TURN: f32 = 0.4;
const TURN_VALUE: f32 = 0.95;
/// Exponent of feature differences.
const FEATURE_EXPONENT: f32 = 0.5;
/// Width of the feature detectors in degrees.
const FEATURE_WIDTH: f32 = 0.082;
/// Gaussians of the contrast sensitivity functions, (a, b) of a sqrt(pi / b) exp(-pi^2 d^2 / b) with d in degrees:
/// achromatic, red-green, and the two of blue-yellow.
const ACHROMATIC: (f32, f32) = (1.0, 0.0047);
const RED_GREEN: (f32, f32) = (1.0, 0.0053);
const BLUE_YELLOW: [(f32, f32); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// CIE XYZ from linear RGB, columns. The exact matrix of sRGB's primaries and white.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(
        10_135_552.0 / 24_577_794.0,
        2_613_072.0 / 12_288_897.0,
        1_425_312.0 / 73_733_382.0,
    ),
    Vec3::new(
        8_788_810.0 / 24_577_794.0,
        8_788_810.0 / 12_288_897.0,
        8_788_810.0 / 73_733_382.0,
    ),
    Vec3::new(
        4_435_075.0 / 24_577_794.0,
        887_015.0 / 12_288_897.0,
        70_074_185.0 / 73_733_382.0,
    ),
);

/// FLIP of every pixel of two sRGB encoded pictures of the same size.
pub(super) fn flip(reference: &Picture, test: &Picture, pixels_per_degree: f32) -> Vec<f32> {
    let seen = [reference, test].map(|picture| Seen::new(picture, pixels_per_degree));
    let [reference, test] = &seen;
    let largest = hyab(lab(Vec3::Y), lab(Vec3::Z)).powf(COLOR_EXPONENT);
    (0..reference.colors.len())
        .into_par_iter()
        .map(|i| {
            let color = redistributed(
                hyab(reference.colors[i], test.colors[i]).powf(COLOR_EXPONENT),
                largest,
            );
            let change = (reference.features[i] - test.features[i]).abs().max_element();
            let feature = (change * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
            color.powf(1.0 - feature)
        })
        .collect()
}

/// What a viewer sees of one picture.
struct Seen {
    /// Hunt-adjusted L*a*b* after the contrast sensitivity.
    colors: Vec<Vec3>,
    /// Strength of edges and points.
    features: Vec<Vec2>,
}

impl Seen {
    fn new(picture: &Picture, pixels_per_degree: f32) -> Self {
        let white = XYZ_FROM_RGB * Vec3::ONE;
        // X, Y, Z relative to white: all that follows is linear in them up to L*a*b*.
        let opponent: Vec<Vec3> = picture
            .pixels
            .par_iter()
            .map(|pixel| {
                let linear = pixel
                    .truncate()
                    .to_array()
                    .map(|v| decode_srgb(f64::from(unit(v))) as f32);
                let xyz = XYZ_FROM_RGB * Vec3::from(linear) / white;
                Vec3::new(
                    116.0 * xyz.y - 16.0,
                    500.0 * (xyz.x - xyz.y),
                    200.0 * (xyz.y - xyz.z),
                )
            })
            .collect();
        let plane = |channel: usize| Plane {
            width: picture.width as usize,
            values: opponent.iter().map(|p| p[channel]).collect(),
        };
        let [y, x, z] = [plane(0), plane(1), plane(2)];
        let radius = sensitivity_radius(pixels_per_degree);
        let gaussian =
            |(_, b): (f32, f32)| Kernel::new(radius, |i| (-(PI * i / pixels_per_degree).powi(2) / b).exp());
        let blurred = |plane: &Plane, gauss: (f32, f32)| {
            let kernel = gaussian(gauss).normalized();
            plane.filtered(&kernel, &kernel).values
        };
        let [wide, narrow] = BLUE_YELLOW.map(|gauss| blurred(&z, gauss));
        let [wide_weight, narrow_weight] = BLUE_YELLOW.map(|gauss| {
            let sum = gaussian(gauss).sum();
            gauss.0 * (PI / gauss.1).sqrt() * sum * sum
        });
        let share = wide_weight / (wide_weight + narrow_weight);
        let (achromatic, red_green) = (blurred(&y, ACHROMATIC), blurred(&x, RED_GREEN));

        let rgb_from_xyz = XYZ_FROM_RGB.inverse();
        let colors = (0..opponent.len())
            .into_par_iter()
            .map(|i| {
                let luminance = (achromatic[i] + 16.0) / 116.0;
                let blue_yellow = wide[i] * share + narrow[i] * (1.0 - share);
                let xyz = Vec3::new(
                    luminance + red_green[i] / 500.0,
                    luminance,
                    luminance - blue_yellow / 200.0,
                );
                lab((rgb_from_xyz * (xyz * white)).clamp(Vec3::ZERO, Vec3::ONE))
            })
            .collect();
        let luminance = Plane {
            values: y.values.iter().map(|y| (y + 16.0) / 116.0).collect(),
            ..y
        };
        Self {
            colors,
            features: features(&luminance, pixels_per_degree),
        }
    }
}

/// Pixels to each side that hold three standard deviations of the widest Gaussian.
fn sensitivity_radius(pixels_per_degree: f32) -> i32 {
    let widest = BLUE_YELLOW[0].1;
    (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32
}

/// Edge and point strength: lengths of the first and second Gaussian derivatives' responses.
fn features(luminance: &Plane, pixels_per_degree: f32) -> Vec<Vec2> {
    let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
    let radius = (3.0 * deviation).ceil() as i32;
    let gaussian = |i: f32| (-i * i / (2.0 * deviation * deviation)).exp();
    let smooth = Kernel::new(radius, gaussian).normalized();
    let edge = Kernel::new(radius, |i| -i * gaussian(i)).balanced();
    let point = Kernel::new(radius, |i| (i * i / (deviation * deviation) - 1.0) * gaussian(i)).balanced();
    let strength = |kernel: &Kernel| -> Vec<f32> {
        let along_x = luminance.filtered(kernel, &smooth).values;
        let along_y = luminance.filtered(&smooth, kernel).values;
        along_x
            .into_iter()
            .zip(along_y)
            .map(|(x, y)| x.hypot(y))
            .collect()
    };
    strength(&edge)
        .into_iter()
        .zip(strength(&point))
        .map(|(edge, point)| Vec2::new(edge, point))
        .collect()
}

/// Hunt-adjusted L*a*b* of linear RGB.
fn lab(rgb: Vec3) -> Vec3 {
    const KNEE: f32 = 6.0 / 29.0;
    let response = |t: f32| {
        if t > KNEE * KNEE * KNEE {
            t.cbrt()
        } else {
            t / (3.0 * KNEE * KNEE) + 4.0 / 29.0
        }
    };
    let xyz = XYZ_FROM_RGB * rgb / (XYZ_FROM_RGB * Vec3::ONE);
    let [x, y, z] = xyz.to_array().map(response);
    let lightness = 116.0 * y - 16.0;
    Vec3::new(
        lightness,
        0.01 * lightness * 500.0 * (x - y),
        0.01 * lightness * 200.0 * (y - z),
    )
}

/// City-block distance of lightness plus Euclidean distance of chroma.
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

/// Spreads the differences that occur over most of \[0, 1\].
fn redistributed(error: f32, largest: f32) -> f32 {
    let turn = TURN * largest;
    if error < turn {
        error * TURN_VALUE / turn
    } else {
        TURN_VALUE + (error - turn) / (largest - turn) * (1.0 - TURN_VALUE)
    }
}

/// One half of a separable filter: weights at -radius ..= radius.
struct Kernel(Vec<f32>);

impl Kernel {
    fn new(radius: i32, weight: impl Fn(f32) -> f32) -> Self {
        Self((-radius..=radius).map(|i| weight(i as f32)).collect())
    }

    fn sum(&self) -> f32 {
        self.0.iter().sum()
    }

    /// Weights that sum to 1.
    fn normalized(self) -> Self {
        let sum = self.sum();
        Self(self.0.into_iter().map(|w| w / sum).collect())
    }

    /// Positive weights that sum to 1 and negative ones that sum to -1.
    fn balanced(self) -> Self {
        let positive: f32 = self.0.iter().filter(|w| **w > 0.0).sum();
        let negative: f32 = self.0.iter().filter(|w| **w < 0.0).sum();
        Self(
            self.0
                .into_iter()
                .map(|w| if w > 0.0 { w / positive } else { w / -negative })
                .collect(),
        )
    }
}

/// One channel of a picture.
struct Plane {
    width: usize,
    values: Vec<f32>,
}

impl Plane {
    /// Filtered along rows, then along columns.
    fn filtered(&self, along_x: &Kernel, along_y: &Kernel) -> Self {
        let width = self.width;
        let mut rows = vec![0.0; self.values.len()];
        rows.par_chunks_mut(width)
            .zip(self.values.par_chunks(width))
            .for_each(|(out, row)| {
                let radius = along_x.0.len() / 2;
                let mut padded = vec![row[0]; width + 2 * radius];
                padded[radius..radius + width].copy_from_slice(row);
                padded[radius + width..].fill(row[width - 1]);
                for (x, out) in out.iter_mut().enumerate() {
                    *out = along_x.0.iter().zip(&padded[x..]).map(|(w, v)| w * v).sum();
                }
            });
        let height = rows.len() / width;
        let mut values = vec![0.0; rows.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, out)| {
            let radius = along_y.0.len() / 2;
            for (i, weight) in along_y.0.iter().enumerate() {
                let from = (y + i).saturating_sub(radius).min(height - 1);
                for (out, value) in out.iter_mut().zip(&rows[from * width..]) {
                    *out += weight * value;
                }
            }
        });
        Self { width, values }
    }
}
