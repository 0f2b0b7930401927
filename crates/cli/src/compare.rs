//! `rayward compare`: how much two pictures differ.

use std::path::Path;

use rayward::image_io::{read_picture_up_to, write_png};
use rayward::{CompareOptions, Comparison};
use serde::Serialize;

use crate::args::CompareArgs;
use crate::failure::{Code, Failure};
use crate::machine;
use crate::report::{self, clean, thousands};

/// Memory that comparing takes for a pixel of one picture, in bytes.
const PIXEL_BYTES: u64 = 100;

/// The result; its fields are those of the JSON object. Numbers that are not finite are null there.
#[derive(Serialize)]
struct Result {
    a: String,
    b: String,
    width: u32,
    height: u32,
    /// Whether values were compared as displayed, or else as linear light.
    srgb: bool,
    rmse: f64,
    psnr_db: f64,
    mean_flip: f64,
    differing_pixels: usize,
    largest: Option<Largest>,
    non_finite_a: usize,
    non_finite_b: usize,
    tolerance: Option<f64>,
    within: bool,
}

/// The largest difference of one channel.
#[derive(Serialize)]
struct Largest {
    x: u32,
    y: u32,
    channel: &'static str,
    a: f32,
    b: f32,
}

/// Compares, tells, and fails beyond the tolerance.
pub(crate) fn run(args: &CompareArgs) -> std::result::Result<(), Failure> {
    if let Some(path) = &args.difference
        && [&args.a, &args.b].into_iter().any(|input| same_file(path, input))
    {
        return Err(Failure::new(
            Code::Usage,
            format_args!(
                "--difference {} would overwrite a picture to compare",
                path.display()
            ),
        ));
    }
    // Two pictures at once, each with its copies in other values and scales.
    let limit = machine::available_memory().map_or(u64::MAX, |bytes| bytes / (2 * PIXEL_BYTES));
    let read = |path| read_picture_up_to(path, limit);
    let (a, b) = (read(&args.a)?, read(&args.b)?);
    let comparison = rayward::compare(&a, &b, &CompareOptions::default())?;
    if let Some(path) = &args.difference {
        let picture = comparison.difference_picture();
        write_png(path, comparison.width, comparison.height, &picture)?;
    }
    let result = Result::new(args, &comparison);
    if args.json {
        report::to_stdout_json(&result)?;
    } else {
        report::to_stdout(result.text().as_bytes())?;
    }
    if result.within {
        Ok(())
    } else {
        Err(Failure::silent(Code::Beyond))
    }
}

/// Whether two paths lead to one file; no, if either leads nowhere.
fn same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Whether it passes. A mean that is not a number is not within any tolerance.
fn within(comparison: &Comparison, tolerance: Option<f64>) -> bool {
    match tolerance {
        Some(tolerance) => comparison.mean_flip <= tolerance,
        None => comparison.differing == 0,
    }
}

impl Result {
    fn new(args: &CompareArgs, comparison: &Comparison) -> Self {
        Self {
            a: args.a.display().to_string(),
            b: args.b.display().to_string(),
            width: comparison.width,
            height: comparison.height,
            srgb: comparison.srgb,
            rmse: comparison.rmse,
            psnr_db: comparison.psnr,
            mean_flip: comparison.mean_flip,
            differing_pixels: comparison.differing,
            largest: comparison.largest.map(|largest| Largest {
                x: largest.x,
                y: largest.y,
                channel: ["red", "green", "blue", "alpha"][usize::from(largest.channel)],
                a: largest.a,
                b: largest.b,
            }),
            non_finite_a: comparison.non_finite_a,
            non_finite_b: comparison.non_finite_b,
            tolerance: args.tolerance,
            within: within(comparison, args.tolerance),
        }
    }

    fn text(&self) -> String {
        let pixels = u64::from(self.width) * u64::from(self.height);
        let values = if self.srgb { "displayed" } else { "linear" };
        let mut lines = vec![
            format!("pictures    {} and {}", clean(&self.a), clean(&self.b)),
            format!("size        {}x{}, {values} values", self.width, self.height),
            format!("rmse        {:.6}", self.rmse),
            format!("psnr        {:.2} dB", self.psnr_db),
            format!("mean FLIP   {:.6}", self.mean_flip),
            format!(
                "differing   {} of {} pixels",
                thousands(self.differing_pixels as u64),
                thousands(pixels)
            ),
        ];
        if let Some(at) = &self.largest {
            lines.push(format!(
                "largest     {} at column {}, row {}: {} and {}",
                at.channel, at.x, at.y, at.a, at.b
            ));
        }
        if self.non_finite_a + self.non_finite_b > 0 {
            lines.push(format!(
                "not finite  {} and {} pixels",
                self.non_finite_a, self.non_finite_b
            ));
        }
        lines.push(match (self.within, self.tolerance) {
            (true, None) => "equal".into(),
            (false, None) => "different".into(),
            (true, Some(tolerance)) => format!("within the tolerance of {tolerance}"),
            (false, Some(tolerance)) => format!("beyond the tolerance of {tolerance}"),
        });
        lines.push(String::new());
        lines.join("\n")
    }
}
