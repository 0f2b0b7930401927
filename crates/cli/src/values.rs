//! Values of the command line: parsed, checked, and nothing else.

use glam::{DVec3, Vec3};
use rayward::{
    Antialias, CasterPolicy, LayerKind, Layers, Measure, PixelFilter, ShadowStructure, Shard, scene,
};

/// What a parser returns.
type Parsed<T> = Result<T, String>;

fn number(text: &str) -> Parsed<f64> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("{text:?} is not a finite number")),
    }
}

/// Three numbers `x,y,z`.
pub(crate) fn vector(text: &str) -> Parsed<DVec3> {
    let numbers: Vec<f64> = text.split(',').map(number).collect::<Parsed<_>>()?;
    match *numbers {
        [x, y, z] => Ok(DVec3::new(x, y, z)),
        _ => Err("three numbers x,y,z are needed".into()),
    }
}

/// A unit vector along `x,y,z`, which are not all of them 0.
pub(crate) fn direction(text: &str) -> Parsed<DVec3> {
    vector(text)?
        .try_normalize()
        .ok_or_else(|| "it has no direction".into())
}

/// A linear colour `r,g,b`, no component below 0.
pub(crate) fn color(text: &str) -> Parsed<Vec3> {
    let [r, g, b] = *text.split(',').collect::<Vec<_>>() else {
        return Err("a colour has three numbers r,g,b".into());
    };
    let color = Vec3::new(single(r)?, single(g)?, single(b)?);
    if color.min_element() >= 0.0 {
        Ok(color)
    } else {
        Err("no component of a colour may be below 0".into())
    }
}

/// A number above 0.
pub(crate) fn positive(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value > 0.0 => Ok(value),
        _ => Err("it has to be above 0".into()),
    }
}

/// A number not below 0.
pub(crate) fn not_negative(text: &str) -> Parsed<f64> {
    match number(text)? {
        value if value >= 0.0 => Ok(value),
        _ => Err("it has to be 0 or more".into()),
    }
}

/// A finite number in single precision.
pub(crate) fn single(text: &str) -> Parsed<f32> {
    match number(text)? as f32 {
        value if value.is_finite() => Ok(value),
        _ => Err("it is too large for single precision".into()),
    }
}

/// A factor in single precision, above 0.
pub(crate) fn factor(text: &str) -> Parsed<f32> {
    match single(text)? {
        value if value > 0.0 => Ok(value),
        _ => Err("it has to be above 0".into()),
    }
}

/// An exposure, in stops or found from the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// Photographic stops.
    Stops(f32),
    /// The one that makes the picture's log average a mid grey.
    Auto,
}

/// An exposure, see [`Exposure`].
pub(crate) fn exposure(text: &str) -> Parsed<Exposure> {
    if text == "auto" {
        return Ok(Exposure::Auto);
    }
    single(text)
        .map(Exposure::Stops)
        .map_err(|problem| format!("{problem}, nor auto"))
}

/// A full vertical field of view in degrees.
pub(crate) fn field_of_view(text: &str) -> Parsed<f64> {
    match number(text)? {
        degrees if degrees > 0.0 && degrees < 180.0 => Ok(degrees),
        _ => Err("it has to be above 0 and below 180 degrees".into()),
    }
}

/// Width and height of a picture, `1920x1080`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// A size `WxH`.
pub(crate) fn size(text: &str) -> Parsed<Size> {
    let side = |side: &str| side.parse::<u32>().ok().filter(|&pixels| pixels > 0);
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| {
            Some(Size {
                width: side(w)?,
                height: side(h)?,
            })
        })
        .ok_or_else(|| "it has to be like 1920x1080".into())
}

/// From a start to the end that no longer belongs to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span<T> {
    pub(crate) start: T,
    pub(crate) end: T,
}

fn span<T: PartialOrd>(text: &str, part: impl Fn(&str) -> Parsed<T>) -> Parsed<Span<T>> {
    let (start, end) = text.split_once("..").ok_or("it has to be like 0..48")?;
    let (start, end) = (part(start)?, part(end)?);
    if start < end {
        Ok(Span { start, end })
    } else {
        Err("its start is not before its end".into())
    }
}

/// Frames `first..end`.
pub(crate) fn frames(text: &str) -> Parsed<Span<u32>> {
    span(text, |part| {
        part.parse()
            .map_err(|_| format!("{part:?} is not a frame's number"))
    })
}

/// Seconds `from..to`, from 0 on.
pub(crate) fn seconds(text: &str) -> Parsed<Span<f64>> {
    span(text, not_negative)
}

/// An angle in degrees.
pub(crate) fn degrees(text: &str) -> Parsed<f64> {
    number(text)
}

/// A share `i/n`.
pub(crate) fn shard(text: &str) -> Parsed<Shard> {
    text.parse().map_err(String::from)
}

/// A light on the command line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum LightValue {
    /// `point:x,y,z[:candela]`, or `sphere:x,y,z:radius[:candela]`
    Point {
        position: DVec3,
        radius: f32,
        candela: Option<f32>,
    },
    /// `disk:x,y,z:radius[:nits]`, or `square:x,y,z:side[:nits]`
    Flat {
        position: DVec3,
        kind: scene::LightKind,
        nits: Option<f32>,
    },
    /// `sun:x,y,z[:lux[:degrees]]`
    Sun {
        towards: DVec3,
        half_angle: f32,
        lux: Option<f32>,
    },
}

/// A light, see [`LightValue`].
pub(crate) fn light(text: &str) -> Parsed<LightValue> {
    let parts: Vec<&str> = text.split(':').collect();
    let [kind, place, ref numbers @ ..] = parts[..] else {
        return Err("it has to be like point:1,2,3 or sun:1,2,3".into());
    };
    let most = if kind == "point" { 1 } else { 2 };
    if numbers.len() > most {
        return Err(format!("there are more than {} parts between colons", most + 2));
    }
    let intensity = |at: usize| match numbers.get(at).map(|text| single(text)).transpose()? {
        Some(value) if value < 0.0 => Err(String::from("the intensity may not be below 0")),
        value => Ok(value),
    };
    let size = || {
        let text = numbers.first().ok_or("its size is missing")?;
        positive(text).map(|size| size as f32)
    };
    Ok(match kind {
        "point" | "sphere" => {
            let radius = if kind == "sphere" { size()? } else { 0.0 };
            LightValue::Point {
                position: vector(place)?,
                radius,
                candela: intensity(usize::from(kind == "sphere"))?,
            }
        }
        "disk" | "square" => {
            let size = size()?;
            LightValue::Flat {
                position: vector(place)?,
                kind: match kind {
                    "disk" => scene::LightKind::Disk { radius: size },
                    _ => scene::LightKind::Rectangle {
                        width: size,
                        height: size,
                    },
                },
                nits: intensity(1)?,
            }
        }
        "sun" => {
            let degrees = numbers.get(1).map_or(Ok(0.0), |text| not_negative(text))?;
            if degrees > 90.0 {
                return Err("the sun may not be more than 90 degrees across".into());
            }
            LightValue::Sun {
                towards: direction(place)?,
                half_angle: (degrees * 0.5).to_radians() as f32,
                lux: intensity(0)?,
            }
        }
        _ => return Err(format!("{kind:?} is none of point, sphere, disk, square and sun")),
    })
}

/// Up axis of a file.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Up {
    Y,
    Z,
}

impl From<Up> for scene::UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::Y => Self::Y,
            Up::Z => Self::Z,
        }
    }
}

/// Whether a GPU is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum GpuUse {
    /// Any there is, also one in software; an error if there is none
    On,
    /// Hardware, or else the CPU
    Auto,
    /// The CPU
    Off,
}

/// What shades frames whose rays are traced on a GPU.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum GpuShadingUse {
    /// The GPU, too
    Device,
    /// The CPU: the bits of a frame without a GPU
    Cpu,
}

/// A structure for rays from anywhere to anywhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SecondaryUse {
    /// A tree of boxes
    Hierarchy,
    /// The layered depth cube
    Cube,
}

/// Which sides of triangles cast shadows.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Casters {
    /// Back faces where surfaces are closed, both sides elsewhere
    Auto,
    /// Both sides of all
    Both,
    /// Back faces of all: wrong where surfaces are open
    Back,
}

impl From<Casters> for CasterPolicy {
    fn from(casters: Casters) -> Self {
        match casters {
            Casters::Auto => Self::Auto,
            Casters::Both => Self::Both,
            Casters::Back => Self::Back,
        }
    }
}

/// What finds hard shadows.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Shadows {
    /// Whichever is predicted to cost the least
    Auto,
    /// What the eye sees sorted into the light's raster, casters drawn over it; a grid where surfaces let light through
    Receivers,
    /// A grid of casters, each receiver looked up in it
    Grid,
    /// A hierarchy of casters in the light's perspective space
    Tree,
}

impl From<Shadows> for ShadowStructure {
    fn from(shadows: Shadows) -> Self {
        match shadows {
            Shadows::Auto => Self::Auto,
            Shadows::Receivers => Self::Receivers,
            Shadows::Grid => Self::Grid,
            Shadows::Tree => Self::Tree,
        }
    }
}

/// Which of a pixel's samples are shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Antialiasing {
    /// All
    Samples,
    /// Of those that see one smooth surface in the same light the first
    Coverage,
}

impl From<Antialiasing> for Antialias {
    fn from(antialiasing: Antialiasing) -> Self {
        match antialiasing {
            Antialiasing::Samples => Self::Samples,
            Antialiasing::Coverage => Self::Coverage,
        }
    }
}

/// How a pixel weighs its samples.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Filter {
    /// The pixel's square, evenly
    Box,
    /// A smooth window over three pixels
    BlackmanHarris,
}

impl From<Filter> for PixelFilter {
    fn from(filter: Filter) -> Self {
        match filter {
            Filter::Box => Self::Box,
            Filter::BlackmanHarris => Self::BlackmanHarris,
        }
    }
}

/// The tone map by name; its exposure is an option of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Operator {
    /// Cut off at 1
    None,
    /// Scaled by 2^exposure, then cut off
    Exposure,
    /// Scaled by 2^exposure, then a filmic curve
    Aces,
    /// Scaled as if the frame before had been the same
    PreviousFrame,
}

/// A layer by name, or all but motion and cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum LayerName {
    All,
    Color,
    Alpha,
    Depth,
    Distance,
    Normal,
    Object,
    Prim,
    Bary,
    Motion,
    Cost,
}

/// A measure by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Shown {
    /// Depth along the view
    Depth,
    /// Distance from the eye
    Distance,
    /// Length of motion vectors
    Motion,
    /// Nodes of the hierarchy for any ray that a pixel's rays open
    Nodes,
    /// Triangles that they test
    Tests,
    /// Cells of the layered depth cube that they look at, with --secondary cube
    Cells,
    /// Its texels
    Texels,
    /// Casters in the cells of light grids in which a pixel's surfaces lie
    Casters,
    /// Those that no surface has to be tested with, lying before the nearest
    Spared,
}

impl From<Shown> for Measure {
    fn from(shown: Shown) -> Self {
        match shown {
            Shown::Depth => Self::Depth,
            Shown::Distance => Self::Distance,
            Shown::Motion => Self::Motion,
            Shown::Nodes => Self::Nodes,
            Shown::Tests => Self::Tests,
            Shown::Cells => Self::Cells,
            Shown::Texels => Self::Texels,
            Shown::Casters => Self::Casters,
            Shown::Spared => Self::Spared,
        }
    }
}

/// The layers of these names; if there are none, all that cost nothing more. Colour is always there.
pub(crate) fn layers(names: &[LayerName]) -> Layers {
    let named = |name| names.contains(&name);
    let has = |name| names.is_empty() || named(LayerName::All) || named(name);
    Layers {
        alpha: has(LayerName::Alpha),
        depth: has(LayerName::Depth),
        distance: has(LayerName::Distance),
        normal: has(LayerName::Normal),
        object: has(LayerName::Object),
        prim: has(LayerName::Prim),
        bary: has(LayerName::Bary),
        motion: named(LayerName::Motion),
        cost: named(LayerName::Cost),
    }
}

/// The kinds of layers a film with these layers holds.
pub(crate) fn kinds(film: &rayward::Film) -> impl Iterator<Item = LayerKind> {
    LayerKind::ALL.into_iter().filter(|&kind| film.holds(kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_have_three_finite_parts() {
        assert_eq!(vector("-1,2.5, 3e2"), Ok(DVec3::new(-1.0, 2.5, 300.0)));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,x", "1,nan,2", "1,inf,2"] {
            assert!(vector(wrong).is_err(), "{wrong}");
        }
        assert!(direction("0,0,0").is_err());
        assert!(color("0.1,-0.1,0").is_err());
        assert_eq!(
            color("0,1,1e39"),
            Err("it is too large for single precision".into())
        );
        assert!(color("1e39").is_err_and(|message| message.contains("three numbers")));
    }

    #[test]
    fn lights_have_a_kind_a_place_and_perhaps_an_intensity() {
        let position = DVec3::new(1.0, -2.0, 3.0);
        let point = |radius: f32, candela: Option<f32>| LightValue::Point {
            position,
            radius,
            candela,
        };
        assert_eq!(light("point:1,-2,3"), Ok(point(0.0, None)));
        assert_eq!(light("sphere:1,-2,3:0.5"), Ok(point(0.5, None)));
        assert_eq!(light("sphere:1,-2,3:0.5:7"), Ok(point(0.5, Some(7.0))));
        let sun = |half_angle: f32| LightValue::Sun {
            towards: DVec3::Y,
            half_angle,
            lux: Some(1000.0),
        };
        assert_eq!(light("sun:0,1,0:1000"), Ok(sun(0.0)));
        assert_eq!(light("sun:0,1,0:1000:2"), Ok(sun(1f32.to_radians())));
        let flat = |kind: scene::LightKind, nits: Option<f32>| LightValue::Flat { position, kind, nits };
        assert_eq!(
            light("disk:1,-2,3:2"),
            Ok(flat(scene::LightKind::Disk { radius: 2.0 }, None))
        );
        let square = scene::LightKind::Rectangle {
            width: 2.0,
            height: 2.0,
        };
        assert_eq!(light("square:1,-2,3:2:9"), Ok(flat(square, Some(9.0))));
        for wrong in [
            "point",
            "sun:0,0,0",
            "lamp:1,2,3",
            "point:1,2,3:-1",
            "point:1,2,3:4:5",
            "point:1,2,3:1e99",
            "sphere:1,2,3",
            "sphere:1,2,3:0",
            "disk:1,2,3:1:2:3",
            "square:1,2,3:-1",
            "sun:1,2,3:1:91",
        ] {
            assert!(light(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn exposures_are_stops_or_automatic() {
        assert_eq!(exposure("-1.5"), Ok(Exposure::Stops(-1.5)));
        assert_eq!(exposure("auto"), Ok(Exposure::Auto));
        assert!(exposure("bright").is_err() && factor("0").is_err());
    }

    #[test]
    fn sizes_and_angles() {
        assert_eq!(
            size("64x48"),
            Ok(Size {
                width: 64,
                height: 48
            })
        );
        for wrong in ["64", "0x48", "64x", "-1x5", "64x48x2", "99999999999x1"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
        assert_eq!(frames("3..9"), Ok(Span { start: 3, end: 9 }));
        assert!(seconds("0..0.5").is_ok() && shard("4/4").is_ok());
        for wrong in ["9..3", "3..3", "3", "-1..2", "a..b"] {
            assert!(frames(wrong).is_err() && seconds(wrong).is_err(), "{wrong}");
        }
        assert!(shard("5/4").is_err());
        assert!(field_of_view("0").is_err() && field_of_view("180").is_err() && field_of_view("40").is_ok());
    }
}
