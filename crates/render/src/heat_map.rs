//! Layers in false colours, with a legend: people look before they read.
//!
//! Values run from black over red to pale yellow, evenly to the eye (the map `inferno` of matplotlib). The legend below the
//! picture names the measure and its unit, and has the numbers at both ends of the scale. Depths run from the nearest to
//! the farthest surface. All else runs from zero to the value that a thousandth of the pixels exceed, so that a few extreme
//! ones do not darken the rest; the legend then names the largest, too. Grey is where there is nothing to measure.

use colorous::INFERNO;
use font8x8::legacy::BASIC_LEGACY;

use crate::film::LayerKind;
use crate::{Error, Film, Layers, PixelCost, Result};

/// What a heat map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Measure {
    /// See [`Layers::depth`].
    Depth,
    /// See [`Layers::distance`].
    Distance,
    /// Length of the motion vectors, see [`Layers::motion`].
    Motion,
    /// See [`PixelCost::nodes`].
    Nodes,
    /// See [`PixelCost::tests`].
    Tests,
    /// See [`PixelCost::cells`].
    Cells,
    /// See [`PixelCost::texels`].
    Texels,
    /// See [`PixelCost::casters`].
    Casters,
    /// See [`PixelCost::spared`].
    Spared,
}

/// A picture of three sRGB bytes a pixel, row 0 on top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HeatMap {
    /// Width in pixels: that of the film.
    pub width: u32,
    /// Height in pixels: that of the film and of the legend.
    pub height: u32,
    /// Three bytes a pixel.
    pub rgb: Vec<u8>,
}

const GREY: [u8; 3] = [110; 3];
const PAPER: [u8; 3] = [24; 3];
const INK: [u8; 3] = [235; 3];

/// Side of a letter before it is enlarged, and the space around lines.
const LETTER: u32 = 8;
const SPACE: u32 = 4;

impl Measure {
    /// The layer that a film has to hold.
    pub fn layer(self) -> LayerKind {
        match self {
            Self::Depth => LayerKind::Depth,
            Self::Distance => LayerKind::Distance,
            Self::Motion => LayerKind::Motion,
            _ => LayerKind::Cost,
        }
    }

    /// The same as layers to ask for.
    pub fn layers(self) -> Layers {
        let layer = self.layer();
        Layers {
            depth: layer == LayerKind::Depth,
            distance: layer == LayerKind::Distance,
            motion: layer == LayerKind::Motion,
            cost: layer == LayerKind::Cost,
            ..Layers::default()
        }
    }

    /// What it is, with its unit.
    fn title(self) -> &'static str {
        match self {
            Self::Depth => "depth along the view, m",
            Self::Distance => "distance from the eye, m",
            Self::Motion => "motion, pixels",
            Self::Nodes => "nodes of the hierarchy opened",
            Self::Tests => "triangles tested by any rays",
            Self::Cells => "cells of the cube looked at",
            Self::Texels => "texels of the cube looked at",
            Self::Casters => "casters in the light cells",
            Self::Spared => "casters spared by the nearest",
        }
    }

    /// Its value at each pixel; not finite where there is none.
    fn values(self, film: &Film) -> Vec<f32> {
        let costs = |name: &str| {
            let number = PixelCost::NAMES.iter().position(|own| *own == name);
            film.cost_of(number.unwrap_or_default()).collect()
        };
        match self {
            Self::Depth => film.depth.clone(),
            Self::Distance => film.distance.clone(),
            Self::Motion => film.motion.iter().map(|motion| motion.length()).collect(),
            Self::Nodes => costs("nodes"),
            Self::Tests => costs("tests"),
            Self::Cells => costs("cells"),
            Self::Texels => costs("texels"),
            Self::Casters => costs("casters"),
            Self::Spared => costs("spared"),
        }
    }
}

/// The ends of a scale, and the largest value that there is.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    low: f32,
    high: f32,
    most: f32,
}

impl Scale {
    fn of(measure: Measure, values: &[f32]) -> Self {
        let mut finite: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let Some(last) = finite.len().checked_sub(1) else {
            return Self {
                low: 0.0,
                high: 1.0,
                most: 0.0,
            };
        };
        let mut at = |index: usize| *finite.select_nth_unstable_by(index, f32::total_cmp).1;
        let (least, most) = (at(0), at(last));
        let (low, high) = match measure {
            Measure::Depth | Measure::Distance => (least, most),
            _ => (0.0, at(last - last / 1000)),
        };
        // An empty scale would have no colours.
        let high = if high > low { high } else { most.max(low + 1.0) };
        Self { low, high, most }
    }

    fn color(self, value: f32) -> [u8; 3] {
        if !value.is_finite() {
            return GREY;
        }
        let share = f64::from((value - self.low) / (self.high - self.low));
        let color = INFERNO.eval_continuous(share.clamp(0.0, 1.0));
        [color.r, color.g, color.b]
    }
}

impl HeatMap {
    /// A measure of a film in false colours, with its legend.
    ///
    /// # Errors
    /// [`Error::MissingLayer`] if the film does not hold the measure's layer.
    pub fn new(film: &Film, measure: Measure) -> Result<Self> {
        if !film.holds(measure.layer()) {
            let layer = measure.layer().name();
            return Err(Error::MissingLayer { layer });
        }
        let values = measure.values(film);
        let scale = Scale::of(measure, &values);
        let letter = letter_scale(film.width());
        let height = film.height() + legend_height(film.width());
        let mut map = Self {
            width: film.width(),
            height,
            rgb: values.iter().flat_map(|&value| scale.color(value)).collect(),
        };
        map.rgb.resize(map.width as usize * height as usize * 3, 0);
        let top = film.height();
        map.fill([0, top], [map.width, height - top], |_| PAPER);
        let line = (LETTER + SPACE) * letter;
        let first = top + SPACE * letter;
        map.text(measure.title(), [SPACE * letter, first], letter);
        map.legend(scale, first + line, letter);
        Ok(map)
    }

    /// The size of a heat map of a picture of this size.
    pub fn size(width: u32, height: u32) -> [u32; 2] {
        [width, height + legend_height(width)]
    }

    /// The line with the scale and the numbers at its ends.
    fn legend(&mut self, scale: Scale, y: u32, letter: u32) {
        let space = SPACE * letter;
        let low = number(scale.low);
        let high = if scale.most > scale.high {
            format!("{}, most {}", number(scale.high), number(scale.most))
        } else {
            number(scale.high)
        };
        let wide = |text: &str| text.len() as u32 * LETTER * letter;
        self.text(&low, [space, y], letter);
        let start = space + wide(&low) + space;
        let end = self.width.saturating_sub(space + wide(&high));
        self.text(&high, [end.max(start), y], letter);
        let length = end.saturating_sub(space).saturating_sub(start);
        let color = |x: u32| {
            let share = x as f32 / length.max(2).saturating_sub(1) as f32;
            scale.color(scale.low + (scale.high - scale.low) * share)
        };
        self.fill([start, y], [length, LETTER * letter], color);
    }

    /// Fills a rectangle, of which what lies outside is cut off, by the column within it.
    fn fill(&mut self, [x, y]: [u32; 2], [width, height]: [u32; 2], color: impl Fn(u32) -> [u8; 3]) {
        for row in y..(y + height).min(self.height) {
            for column in x..(x + width).min(self.width) {
                let at = (row as usize * self.width as usize + column as usize) * 3;
                self.rgb[at..at + 3].copy_from_slice(&color(column - x));
            }
        }
    }

    fn text(&mut self, text: &str, [x, y]: [u32; 2], letter: u32) {
        for (place, byte) in (0..).zip(text.bytes()) {
            let rows = BASIC_LEGACY[usize::from(byte % 128)];
            for (row, bits) in (0..).zip(rows) {
                for column in (0..LETTER).filter(|column| bits & (1 << column) != 0) {
                    let at = [x + (place * LETTER + column) * letter, y + row * letter];
                    self.fill(at, [letter, letter], |_| INK);
                }
            }
        }
    }
}

/// How many pixels a pixel of a letter is wide.
fn letter_scale(width: u32) -> u32 {
    (width / 480 + 1).min(4)
}

/// Two lines and the space around them.
fn legend_height(width: u32) -> u32 {
    (2 * LETTER + 3 * SPACE) * letter_scale(width)
}

/// Three digits of a number, all of a whole one.
fn number(value: f32) -> String {
    let digits = match value.abs() {
        0.0 => 0,
        v if v >= 100.0 || (v >= 1.0 && v.fract() == 0.0) => 0,
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use glam::Vec2;

    use super::*;

    fn film(layers: Layers) -> Film {
        Film::new(120, 50, layers).expect("it has pixels")
    }

    #[test]
    fn values_have_the_colours_of_the_scale() {
        let mut film = film(Measure::Motion.layers());
        film.motion[0] = Vec2::new(3.0, -4.0);
        film.motion[1] = Vec2::new(2.5, 0.0);
        let map = HeatMap::new(&film, Measure::Motion).expect("it holds it");
        assert_eq!([map.width, map.height], HeatMap::size(120, 50));
        assert_eq!(map.rgb.len(), (map.width * map.height * 3) as usize);
        let color = |share: f64| {
            let color = INFERNO.eval_continuous(share);
            [color.r, color.g, color.b]
        };
        assert_eq!(map.rgb[..3], color(1.0));
        assert_eq!(map.rgb[3..6], color(0.5));
        assert_eq!(map.rgb[6..9], color(0.0));
        let legend = &map.rgb[120 * 50 * 3..];
        assert!(legend.chunks(3).any(|pixel| pixel == INK), "letters");
        assert!(legend.chunks(3).any(|pixel| pixel == color(1.0)), "the scale");
    }

    #[test]
    fn a_few_extreme_values_do_not_set_the_scale() {
        let mut values: Vec<f32> = (0..10_000).map(|i| (i % 100) as f32).collect();
        values[7] = 1e6;
        let scale = Scale::of(Measure::Nodes, &values);
        assert_eq!([scale.low, scale.high, scale.most], [0.0, 99.0, 1e6]);
        let depth = Scale::of(Measure::Depth, &[f32::INFINITY, 2.0, 5.0]);
        assert_eq!([depth.low, depth.high], [2.0, 5.0]);
        assert_eq!(depth.color(f32::INFINITY), GREY);
        for nothing in [&[][..], &[0.0; 9], &[f32::NAN]] {
            let scale = Scale::of(Measure::Cells, nothing);
            assert!(scale.high > scale.low, "{nothing:?}");
        }
    }

    #[test]
    fn numbers_are_short() {
        let short = [0.0, 7.0, 143.26, 12.34, 1.234, 0.0123].map(number);
        assert_eq!(short, ["0", "7", "143", "12.3", "1.23", "0.012"]);
    }

    #[test]
    fn a_missing_layer_is_said() {
        let film = film(Layers::default());
        for measure in [Measure::Depth, Measure::Motion, Measure::Texels] {
            let error = HeatMap::new(&film, measure).expect_err("it holds nothing");
            assert!(error.to_string().contains(measure.layer().name()));
        }
    }
}
