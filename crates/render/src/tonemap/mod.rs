//! From linear colour to eight bits: tone map, then sRGB encoding.
//!
//! [`ToneMap::PreviousFrame`] is the operator of HM08 §5: a linear scale by the smallest and largest intensity of
//! the *previous* frame, so that every tile can be finished as soon as it is shaded. The picture follows a
//! change of brightness with a delay of exactly one frame; the first frame uses \[0, 1\]. What differs from the
//! paper: the result is sRGB encoded as the file's tag says, not stored linearly.
//!
//! Determinism: minimum and maximum do not depend on the order of pixels, so neither does the next frame.
//! Cost: some 10 ns a pixel and core.

mod srgb;

use glam::Vec3;
use rayon::prelude::*;

pub(crate) use srgb::{decode_srgb, encode_srgb, linear_from_srgb8};
pub use srgb::{decode_srgb8, encode_srgb8};

use crate::Film;

/// How linear colour becomes displayable, each component in \[0, 1\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum ToneMap {
    /// Components are cut off at 1.
    #[default]
    None,
    /// Scaled by 2^stops, then cut off at 1.
    Exposure {
        /// Photographic stops; 0 changes nothing.
        stops: f32,
    },
    /// Scaled by 2^stops, then the filmic curve that Narkowicz fitted to the ACES reference in 2016.
    Aces {
        /// Photographic stops.
        stops: f32,
    },
    /// Scaled so that the previous frame's intensities would have filled \[0, 1\] (HM08 §5).
    PreviousFrame,
}

impl ToneMap {
    /// The same operator with another exposure; the others stay as they are.
    pub fn exposed(self, stops: f32) -> Self {
        match self {
            Self::Exposure { .. } => Self::Exposure { stops },
            Self::Aces { .. } => Self::Aces { stops },
            Self::None | Self::PreviousFrame => self,
        }
    }
}

/// The exposure, in stops, that makes a picture's log average luminance the mid grey of 18 % (Reinhard et al.,
/// *Photographic Tone Reproduction for Digital Images*, SIGGRAPH 2002, §2). Black pixels and such that are not
/// finite do not count; 0 if none are left.
pub fn automatic_exposure(colors: &[Vec3]) -> f32 {
    let logarithms = |colors: &[Vec3]| {
        let luminances = colors.iter().map(|c| c.dot(Vec3::new(0.2126, 0.7152, 0.0722)));
        let shown = luminances.filter(|l| l.is_finite() && *l > 1e-6);
        shown.fold((0.0, 0u64), |(sum, count), l| {
            (sum + f64::from(l).log2(), count + 1)
        })
    };
    let blocks: Vec<_> = colors.par_chunks(BLOCK).map(logarithms).collect();
    let (sum, count) = blocks
        .into_iter()
        .fold((0.0, 0), |(sum, count), block| (sum + block.0, count + block.1));
    if count == 0 {
        0.0
    } else {
        (0.18f64.log2() - sum / count as f64) as f32
    }
}

/// Smallest and largest colour component of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntensityRange {
    /// Smallest component.
    pub min: f32,
    /// Largest component.
    pub max: f32,
}

impl IntensityRange {
    /// The range of no pixels at all: the neutral element of [`Self::union`].
    pub const EMPTY: Self = Self {
        min: f32::INFINITY,
        max: f32::NEG_INFINITY,
    };
    /// What the first frame is scaled by.
    pub const UNIT: Self = Self { min: 0.0, max: 1.0 };

    /// The range of these colours; components that are not finite do not count.
    pub fn of(colors: &[Vec3]) -> Self {
        let mut min = Vec3::INFINITY;
        let mut max = Vec3::NEG_INFINITY;
        for &color in colors {
            let finite = color.abs().cmplt(Vec3::INFINITY);
            min = min.min(Vec3::select(finite, color, min));
            max = max.max(Vec3::select(finite, color, max));
        }
        Self {
            min: min.min_element(),
            max: max.max_element(),
        }
    }

    /// The range of both pictures together.
    pub fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Whether no pixel has been seen.
    pub fn is_empty(&self) -> bool {
        self.min > self.max
    }
}

/// A tone map with its memory of the previous frame.
#[derive(Clone, Debug)]
pub struct ToneMapper {
    operator: ToneMap,
    /// 2^stops, 1 without an exposure.
    scale: f32,
    previous: IntensityRange,
}

impl ToneMapper {
    /// A tone mapper before its first frame.
    pub fn new(operator: ToneMap) -> Self {
        let scale = match operator {
            ToneMap::Exposure { stops } | ToneMap::Aces { stops } => stops.exp2(),
            ToneMap::None | ToneMap::PreviousFrame => 1.0,
        };
        Self {
            operator,
            scale,
            previous: IntensityRange::UNIT,
        }
    }

    /// The range by which [`ToneMap::PreviousFrame`] scales the current frame.
    pub fn range(&self) -> IntensityRange {
        self.previous
    }

    /// One displayable colour, components in \[0, 1\]; what is not a number becomes 0.
    #[inline]
    pub fn map(&self, color: Vec3) -> Vec3 {
        let mapped = match self.operator {
            ToneMap::None => color,
            ToneMap::Exposure { .. } => color * self.scale,
            ToneMap::Aces { .. } => aces(color * self.scale),
            ToneMap::PreviousFrame => {
                let width = self.previous.max - self.previous.min;
                let width = if width < 1e-6 { 1.0 } else { width };
                (color - Vec3::splat(self.previous.min)) / width
            }
        };
        Vec3::new(unit(mapped.x), unit(mapped.y), unit(mapped.z))
    }

    /// Finishes a frame: its range scales the next one. An empty range changes nothing.
    pub fn end_frame(&mut self, range: IntensityRange) {
        if !range.is_empty() {
            self.previous = range;
        }
    }

    /// Maps and encodes a whole frame to eight bits RGB, three bytes a pixel, and finishes it.
    pub fn encode(&mut self, film: &Film) -> Vec<u8> {
        let mut bytes = vec![0; film.color.len() * 3];
        let ranges: Vec<_> = bytes
            .par_chunks_mut(BLOCK * 3)
            .zip(film.color.par_chunks(BLOCK))
            .map(|(out, colors)| {
                for (pixel, &color) in out.chunks_exact_mut(3).zip(colors) {
                    pixel.copy_from_slice(&self.map(color).to_array().map(encode_srgb8));
                }
                if self.operator == ToneMap::PreviousFrame {
                    IntensityRange::of(colors)
                } else {
                    IntensityRange::EMPTY
                }
            })
            .collect();
        self.end_frame(
            ranges
                .into_iter()
                .fold(IntensityRange::EMPTY, IntensityRange::union),
        );
        bytes
    }
}

/// Cut off at 0 and 1; 0 for what is not a number, which `clamp` would keep.
#[inline]
pub(crate) fn unit(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// Pixels a task, enough to make the scheduling free.
const BLOCK: usize = 16 * 1024;

/// Narkowicz, "ACES filmic tone mapping curve", per component, with the 0.6 that matches its mid grey.
fn aces(color: Vec3) -> Vec3 {
    let x = color.max(Vec3::ZERO) * 0.6;
    let curve = (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    // Far above white both parabolas overflow; the curve is long at its end there.
    Vec3::select(x.cmplt(Vec3::splat(1e6)), curve, Vec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Layers;

    fn film(colors: &[Vec3]) -> Film {
        let mut film = Film::new(colors.len() as u32, 1, Layers::default()).unwrap();
        film.color.copy_from_slice(colors);
        film
    }

    #[test]
    fn previous_frame_lags_by_exactly_one_frame() {
        let mut mapper = ToneMapper::new(ToneMap::PreviousFrame);
        let dark = film(&[Vec3::splat(0.25), Vec3::new(0.25, 0.5, 0.75)]);
        let bright = film(&[Vec3::splat(2.0), Vec3::splat(4.0)]);
        let plain = |c: f32| encode_srgb8(c);

        // Frame 0 has no past: [0, 1].
        assert_eq!(mapper.encode(&dark)[3..], [0.25, 0.5, 0.75].map(plain));
        // Frame 1 is scaled by frame 0, although it is itself bright.
        assert_eq!(mapper.encode(&bright), [255; 6]);
        assert_eq!(mapper.range(), IntensityRange { min: 2.0, max: 4.0 });
        // Frame 2 is scaled by frame 1, frame 3 by frame 2: dark again, in full range.
        assert_eq!(mapper.encode(&dark), [0; 6]);
        assert_eq!(mapper.encode(&dark)[3..], [0.0, 0.5, 1.0].map(plain));
    }

    #[test]
    fn a_flat_frame_scales_by_one() {
        let mut mapper = ToneMapper::new(ToneMap::PreviousFrame);
        mapper.end_frame(IntensityRange { min: 0.5, max: 0.5 });
        assert_eq!(mapper.map(Vec3::splat(0.75)), Vec3::splat(0.25));
    }

    #[test]
    fn pixels_that_are_not_finite_do_not_set_the_range() {
        let mut mapper = ToneMapper::new(ToneMap::PreviousFrame);
        let bytes = mapper.encode(&film(&[
            Vec3::new(f32::NAN, f32::INFINITY, f32::NEG_INFINITY),
            Vec3::splat(0.5),
        ]));
        assert_eq!(bytes[..3], [0, 255, 0]);
        assert_eq!(mapper.range(), IntensityRange { min: 0.5, max: 0.5 });
        mapper.encode(&film(&[Vec3::NAN]));
        assert_eq!(mapper.range(), IntensityRange { min: 0.5, max: 0.5 });
    }

    #[test]
    fn the_range_does_not_depend_on_the_order_of_tiles() {
        let colors: Vec<_> = (0..100_000)
            .map(|i| Vec3::splat((i as f32 * 0.7).sin()))
            .collect();
        let whole = IntensityRange::of(&colors);
        let tiles = colors.chunks(77).rev().map(IntensityRange::of);
        assert_eq!(tiles.fold(IntensityRange::EMPTY, IntensityRange::union), whole);
    }

    #[test]
    fn the_automatic_exposure_makes_the_middle_grey() {
        let colors = [
            Vec3::splat(0.045),
            Vec3::splat(0.72),
            Vec3::ZERO,
            Vec3::NAN,
            Vec3::INFINITY,
        ];
        assert!(
            automatic_exposure(&colors).abs() < 1e-5,
            "their geometric mean is 0.18"
        );
        let brighter = colors.map(|c| c * 8.0);
        assert!((automatic_exposure(&brighter) + 3.0).abs() < 1e-5);
        assert_eq!(automatic_exposure(&[Vec3::ZERO]), 0.0);
        let map = ToneMap::Aces { stops: 0.0 };
        assert_eq!(map.exposed(2.0), ToneMap::Aces { stops: 2.0 });
    }

    #[test]
    fn operators_do_what_they_say() {
        let color = Vec3::new(0.1, 0.2, 3.0);
        assert_eq!(
            ToneMapper::new(ToneMap::None).map(color),
            Vec3::new(0.1, 0.2, 1.0)
        );
        let exposed = ToneMapper::new(ToneMap::Exposure { stops: 2.0 }).map(color);
        assert_eq!(exposed, Vec3::new(0.4, 0.8, 1.0));
        let filmic = ToneMapper::new(ToneMap::Aces { stops: 0.0 });
        assert_eq!(filmic.map(Vec3::ZERO), Vec3::ZERO);
        assert_eq!(filmic.map(Vec3::splat(f32::MAX)), Vec3::ONE);
        let ramp: Vec<f32> = (0..100)
            .map(|i| filmic.map(Vec3::splat(i as f32 * 0.05)).x)
            .collect();
        assert!(ramp.is_sorted(), "the curve rises");
        // The published curve at 1, with the factor of 0.6: 0.9216 / 1.3688 of the two parabolas.
        assert!(
            (filmic.map(Vec3::ONE).x - 0.6732).abs() < 1e-3,
            "{}",
            filmic.map(Vec3::ONE).x
        );
    }
}
