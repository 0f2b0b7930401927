//! An environment: light from infinitely far away, as an image of all directions.
//!
//! Layout of the image (equirectangular): row 0 is up, the last row down; columns run around +Y, to the right for
//! someone who stands inside. The middle column is +Z, a quarter to its left +X:
//!
//! ```text
//! u = atan2(x, -z) / 2 pi mod 1        v = acos(y) / pi
//! ```
//!
//! Radiance is interpolated linearly between texels, around the seam too. As a light it is sampled by importance:
//! a row by its share of the light, then a column in the row (Pharr, Jakob and Humphreys, *Physically Based
//! Rendering*, 4th edition, §A.5.1: piecewise constant 2-D distributions). The distribution is that of the largest
//! texel around each place, so that it is above 0 wherever the interpolated radiance is: estimates have no bias. Half
//! of it follows the light, half the root of the light, so that the sky is drawn where the sun is hidden, too.
//! Maps larger than [`MAX_DISTRIBUTION`] are reduced for it, not for what is seen.
//!
//! Units: nits a unit of the file times the intensity. Cost: 12 bytes a texel and 4 bytes a texel of the
//! distribution; some 60 ns a lookup, 150 ns a sample. Limits: no mip levels, so a rough mirror sees single texels
//! and leaves it to samples to average them.

use std::f32::consts::{PI, TAU};
use std::path::Path;

use glam::{Vec3, Vec4Swizzles};
use rayon::prelude::*;

use crate::image_io::{Picture, read_picture};
use crate::{Error, Result};

/// Largest width of the distribution that light is sampled by.
pub const MAX_DISTRIBUTION: usize = 2048;

/// Light from all around. See the [module](self).
#[derive(Clone, Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    texels: Vec<Vec3>,
    /// Sine and cosine of the turn around +Y.
    turn: [f32; 2],
    intensity: f32,
    distribution: Distribution,
}

/// A direction drawn by importance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit direction towards the light.
    pub towards: Vec3,
    /// What arrives from there.
    pub radiance: Vec3,
    /// Probability density of the direction, per steradian.
    pub density: f32,
}

impl Environment {
    /// Reads an image of all directions: .hdr, .exr, or any other that is read here.
    ///
    /// # Errors
    /// Those of [`read_picture`]; [`Error::MalformedImage`] for texels that are negative or not finite, and for an
    /// image that is black, which could light nothing.
    pub fn read(path: &Path) -> Result<Self> {
        Self::new(&read_picture(path)?.to_linear(), path)
    }

    /// All that it is made of: texels, and turn, intensity, width.
    pub(crate) fn values(&self) -> (&[Vec3], ([f32; 2], f32, usize)) {
        (&self.texels, (self.turn, self.intensity, self.width))
    }

    /// An environment of these linear texels; `path` is for messages.
    ///
    /// # Errors
    /// As [`Environment::read`].
    pub fn new(picture: &Picture, path: &Path) -> Result<Self> {
        let (width, height) = (picture.width as usize, picture.height as usize);
        let texels: Vec<Vec3> = picture.pixels.iter().map(|pixel| pixel.xyz()).collect();
        let unusable = |texel: &Vec3| !(texel.is_finite() && texel.min_element() >= 0.0);
        if let Some(index) = texels.iter().position(unusable) {
            let (x, y, [r, g, b]) = (index % width, index / width, texels[index].to_array());
            return Err(Error::malformed(
                path,
                format_args!("texel ({x}, {y}) of the environment is {r}, {g}, {b}: no radiance"),
            ));
        }
        let distribution = Distribution::new(&texels, width, height)
            .ok_or_else(|| Error::malformed(path, "the environment is black and lights nothing"))?;
        Ok(Self {
            width,
            height,
            texels,
            turn: [0.0, 1.0],
            intensity: 1.0,
            distribution,
        })
    }

    /// The same turned around +Y by an angle in radians, counter-clockwise as seen from above.
    pub fn turned(mut self, angle: f32) -> Self {
        self.turn = [angle.sin(), angle.cos()];
        self
    }

    /// The same with its radiance multiplied.
    pub fn scaled(mut self, intensity: f32) -> Self {
        self.intensity = intensity;
        self
    }

    /// Radiance from a unit direction.
    pub fn radiance(&self, towards: Vec3) -> Vec3 {
        let [u, v] = self.place(towards);
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (column, row) = (x.floor(), y.floor());
        let (wx, wy) = (x - column, y - row);
        let columns = [0, 1].map(|i| (column as isize + i).rem_euclid(self.width as isize) as usize);
        let rows = [0, 1].map(|i| (row as isize + i).clamp(0, self.height as isize - 1) as usize);
        let texel = |x: usize, y: usize| self.texels[y * self.width + x];
        let line = |y: usize| texel(columns[0], y).lerp(texel(columns[1], y), wx);
        line(rows[0]).lerp(line(rows[1]), wy) * self.intensity
    }

    /// A direction drawn by importance from two random numbers in \[0, 1).
    pub fn sample(&self, random: [f32; 2]) -> EnvironmentSample {
        let ([u, v], density) = self.distribution.sample(random);
        let (sin, cos) = (v * PI).sin_cos();
        let (sin_u, cos_u) = (u * TAU).sin_cos();
        let local = Vec3::new(sin * sin_u, cos, -sin * cos_u);
        let towards = self.turn(local, 1.0);
        EnvironmentSample {
            towards,
            radiance: self.radiance(towards),
            density: density / (2.0 * PI * PI * sin.max(1e-6)),
        }
    }

    /// Probability density with which [`Self::sample`] draws a unit direction, per steradian.
    pub fn density(&self, towards: Vec3) -> f32 {
        let [u, v] = self.place(towards);
        let sin = (v * PI).sin().max(1e-6);
        self.distribution.density([u, v]) / (2.0 * PI * PI * sin)
    }

    /// Where a direction lies in the image, both in \[0, 1\].
    fn place(&self, towards: Vec3) -> [f32; 2] {
        let d = self.turn(towards, -1.0);
        let u = d.x.atan2(-d.z) * (1.0 / TAU);
        let u = if u < 0.0 { u + 1.0 } else { u };
        // acos(y) loses all digits at the poles.
        let v = d.x.hypot(d.z).atan2(d.y) * (1.0 / PI);
        [u.min(1.0), v]
    }

    #[inline]
    fn turn(&self, d: Vec3, sense: f32) -> Vec3 {
        let [sin, cos] = [self.turn[0] * sense, self.turn[1]];
        Vec3::new(d.x * cos + d.z * sin, d.y, d.z * cos - d.x * sin)
    }
}

/// A piecewise constant density over the unit square.
#[derive(Clone, Debug)]
struct Distribution {
    width: usize,
    height: usize,
    /// Cumulative share of rows 0..=i, the last exactly 1.
    rows: Vec<f32>,
    /// For each row, the cumulative share of its columns.
    columns: Vec<f32>,
}

impl Distribution {
    /// By the luminance of texels; `None` if there is none.
    fn new(texels: &[Vec3], width: usize, height: usize) -> Option<Self> {
        let factor = width.div_ceil(MAX_DISTRIBUTION).max(1);
        let (cells_x, cells_y) = (width.div_ceil(factor), height.div_ceil(factor));
        let brightest = |x: usize, y: usize| {
            // The cell and one texel around it, which the interpolation reaches.
            let (low, high) = ((y * factor).saturating_sub(1), ((y + 1) * factor).min(height - 1));
            let reach = (0..factor + 2).map(|i| (x * factor + i + width - 1) % width);
            let rows = low..=high;
            rows.flat_map(|row| reach.clone().map(move |column| row * width + column))
                .map(|i| f64::from(luminance(texels[i])))
                .fold(0.0, f64::max)
        };
        let area = |y: usize| ((y as f64 + 0.5) / cells_y as f64 * std::f64::consts::PI).sin();
        let cells: Vec<Vec<f64>> = (0..cells_y)
            .into_par_iter()
            .map(|y| (0..cells_x).map(|x| brightest(x, y)).collect())
            .collect();
        let total = |of: fn(f64) -> f64| -> f64 {
            let line = |(y, cells): (usize, &Vec<f64>)| area(y) * cells.iter().map(|&l| of(l)).sum::<f64>();
            cells
                .iter()
                .enumerate()
                .map(line)
                .sum::<f64>()
                .max(f64::MIN_POSITIVE)
        };
        let (light, root) = (total(|l| l), total(f64::sqrt));
        let lines = cells.iter().enumerate().map(|(y, cells)| {
            let (sum, line) = cumulative(cells.iter().map(|&l| l / light + l.sqrt() / root));
            (sum * area(y), line)
        });
        let lines: Vec<(f64, Vec<f32>)> = lines.collect();
        let (sum, rows) = cumulative(lines.iter().map(|line| line.0));
        (sum > 0.0).then(|| Self {
            width: cells_x,
            height: cells_y,
            rows,
            columns: lines.into_iter().flat_map(|line| line.1).collect(),
        })
    }

    fn columns(&self, row: usize) -> &[f32] {
        &self.columns[row * self.width..][..self.width]
    }

    fn sample(&self, random: [f32; 2]) -> ([f32; 2], f32) {
        let (row, v, by_row) = invert(&self.rows, random[1]);
        let (_, u, by_column) = invert(self.columns(row), random[0]);
        ([u, v], by_row * by_column)
    }

    fn density(&self, [u, v]: [f32; 2]) -> f32 {
        let index = |x: f32, size: usize| ((x * size as f32) as usize).min(size - 1);
        let (row, column) = (index(v, self.height), index(u, self.width));
        share(&self.rows, row) * share(self.columns(row), column)
    }
}

/// The sum, and the cumulative shares of it; equal ones where there is nothing.
fn cumulative(values: impl Iterator<Item = f64>) -> (f64, Vec<f32>) {
    let mut sum = 0.0;
    let sums: Vec<f64> = values
        .map(|value| {
            sum += value;
            sum
        })
        .collect();
    let count = sums.len() as f64;
    let mut shares: Vec<f32> = sums
        .iter()
        .enumerate()
        .map(|(i, &partial)| {
            let even = (i + 1) as f64 / count;
            (if sum > 0.0 { partial / sum } else { even }) as f32
        })
        .collect();
    if let Some(last) = shares.last_mut() {
        *last = 1.0;
    }
    (sum, shares)
}

/// Density of a cell: its share times the number of cells.
fn share(cumulative: &[f32], index: usize) -> f32 {
    let before = if index == 0 { 0.0 } else { cumulative[index - 1] };
    (cumulative[index] - before) * cumulative.len() as f32
}

/// The cell in which the cumulative shares pass `random`, the place in \[0, 1) it stands for, and its density.
fn invert(cumulative: &[f32], random: f32) -> (usize, f32, f32) {
    let cell = cumulative
        .partition_point(|&share| share <= random)
        .min(cumulative.len() - 1);
    let before = if cell == 0 { 0.0 } else { cumulative[cell - 1] };
    let width = cumulative[cell] - before;
    let within = if width > 0.0 {
        ((random - before) / width).clamp(0.0, 1.0)
    } else {
        0.5
    };
    let place = (cell as f32 + within) / cumulative.len() as f32;
    // Rounding may not carry the place into the next cell, which has another density.
    let end = (cell + 1) as f32 / cumulative.len() as f32;
    (cell, place.min(end.next_down()), width * cumulative.len() as f32)
}

fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    fn environment(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3) -> Result<Environment> {
        let pixels = (0..width * height)
            .map(|i| Vec4::from((texel(i % width, i / width), 1.0)))
            .collect();
        let picture = Picture {
            width,
            height,
            pixels,
            srgb: false,
        };
        Environment::new(&picture, Path::new("sky.hdr"))
    }

    #[test]
    fn directions_lie_where_the_convention_says() {
        let columns = environment(400, 200, |x, _| Vec3::splat(x as f32 + 0.5)).unwrap();
        for (towards, column) in [(Vec3::X, 100.0), (Vec3::Z, 200.0), (Vec3::NEG_X, 300.0)] {
            assert!((columns.radiance(towards).x - column).abs() < 1e-2, "{towards}");
        }
        let rows = environment(400, 200, |_, y| Vec3::splat(y as f32 + 0.5)).unwrap();
        assert_eq!(rows.radiance(Vec3::Y).x, 0.5);
        assert!((rows.radiance(Vec3::X).x - 100.0).abs() < 1e-2);
        assert_eq!(rows.radiance(Vec3::NEG_Y).x, 199.5);
        // What lay towards +Z is seen towards +X after a quarter turn.
        let turned = columns.turned(PI / 2.0).scaled(2.0);
        assert!((turned.radiance(Vec3::X).x - 400.0).abs() < 1e-2);
    }

    #[test]
    fn samples_have_the_density_they_say_and_sum_up_to_the_light() {
        let sun = |x: u32, y: u32| {
            let spot = x == 20 && y == 9;
            Vec3::new(1.0, 0.5, 0.2) * if spot { 900.0 } else { 0.3 + (x % 3) as f32 }
        };
        let sky = environment(64, 32, sun).unwrap().turned(1.0);
        let (mut estimate, mut exact, mut all) = (0.0, 0.0, 0.0);
        const N: usize = 1024;
        let mut elsewhere = 0;
        for i in 0..N * N {
            let random = [(i % N) as f32 + 0.5, (i / N) as f32 + 0.5].map(|x| x / N as f32);
            let sample = sky.sample(random);
            let density = sky.density(sample.towards);
            elsewhere += usize::from((density / sample.density - 1.0).abs() > 1e-2);
            estimate += f64::from(sample.radiance.x / sample.density) / (N * N) as f64;
            // Squares of the image by their middles, none of which is on the border of a texel.
            let ((sin, cos), (sin_u, cos_u)) = ((random[1] * PI).sin_cos(), (random[0] * TAU).sin_cos());
            let towards = sky.turn(Vec3::new(sin * sin_u, cos, -sin * cos_u), 1.0);
            let share = f64::from(2.0 * PI * PI * sin) / (N * N) as f64;
            exact += f64::from(sky.radiance(towards).x) * share;
            all += f64::from(sky.density(towards)) * share;
        }
        // Rounding carries a few across the border of a cell.
        assert!(elsewhere < N * N / 500, "{elsewhere}");
        assert!((all - 1.0).abs() < 2e-3, "{all}");
        // Squares of random numbers, unlike those of the image, have borders of texels within.
        assert!((estimate / exact - 1.0).abs() < 5e-3, "{estimate} {exact}");
    }

    #[test]
    fn what_is_no_radiance_is_an_error_with_the_name_and_the_place() {
        for (value, expected) in [
            (
                f32::NAN,
                "sky.hdr: texel (3, 1) of the environment is NaN, NaN, NaN: no radiance",
            ),
            (
                f32::INFINITY,
                "sky.hdr: texel (3, 1) of the environment is inf, inf, inf: no radiance",
            ),
            (
                -1.0,
                "sky.hdr: texel (3, 1) of the environment is -1, -1, -1: no radiance",
            ),
        ] {
            let broken = environment(4, 2, |x, y| {
                Vec3::splat(if (x, y) == (3, 1) { value } else { 1.0 })
            });
            assert_eq!(broken.unwrap_err().to_string(), expected);
        }
        let black = environment(4, 2, |_, _| Vec3::ZERO).unwrap_err();
        assert_eq!(
            black.to_string(),
            "sky.hdr: the environment is black and lights nothing"
        );
    }
}
