//! Small pictures for reports: what was measured, and in false colours what rays cost there.

use std::sync::Arc;

use rayward::{
    CubeBuilder, Film, HeatMap, Layers, Measure, RenderOptions, Renderer, ToneMap, ToneMapper, image_io,
    scene,
};

use crate::Result;
use crate::report::Picture;

/// Scenes that are shown.
const SCENES: [&str; 4] = ["courtyard", "forest", "conference", "teapot-mirror"];

/// The scene whose costs are shown.
const MEASURED: &str = "courtyard";

/// What is shown of them; whether the layered depth cube is in the place of the hierarchy.
const MEASURES: [(Measure, bool, &str); 5] = [
    (
        Measure::Nodes,
        false,
        "nodes of the hierarchy that the eye ray of a pixel and what follows from it open",
    ),
    (Measure::Tests, false, "triangles that these rays are tested with"),
    (
        Measure::Texels,
        true,
        "texels of the layered depth cube that the same rays look at",
    ),
    (
        Measure::Casters,
        false,
        "casters in the cell of the light's grid in which the surface lies",
    ),
    (
        Measure::Spared,
        false,
        "of these casters those that need no test, as the surface lies before the nearest",
    ),
];

/// Width and height of a picture.
fn size(quick: bool) -> [u32; 2] {
    if quick { [160, 100] } else { [360, 225] }
}

/// Pictures of some built-in scenes.
pub(crate) fn of_scenes(quick: bool, progress: &mut dyn FnMut(&str)) -> Result<Vec<Picture>> {
    let mut picture = |name: &str| {
        progress(&format!("picture of {name}"));
        let options = RenderOptions {
            pixel_samples: 4,
            ..options(quick)
        };
        let (film, triangles) = render(name, &options, false)?;
        let rgb = ToneMapper::new(ToneMap::None).encode(&film);
        png(
            name.into(),
            format!("{name}, {triangles} triangles"),
            size(quick),
            &rgb,
        )
    };
    SCENES.into_iter().map(&mut picture).collect()
}

/// Costs of rays in one of them.
pub(crate) fn heat_maps(quick: bool, progress: &mut dyn FnMut(&str)) -> Result<Vec<Picture>> {
    progress(&format!("costs of {MEASURED}"));
    let options = RenderOptions {
        layers: Layers {
            cost: true,
            ..Layers::default()
        },
        ..options(quick)
    };
    let films = [false, true].map(|cube| render(MEASURED, &options, cube));
    let [hierarchy, cube] = films;
    let films = [hierarchy?.0, cube?.0];
    let map = |&(measure, cube, what): &(Measure, bool, &str)| {
        let map = HeatMap::new(&films[usize::from(cube)], measure)?;
        let name = format!("costs-{measure:?}").to_lowercase();
        png(
            name,
            format!("{MEASURED}: {what}"),
            [map.width, map.height],
            &map.rgb,
        )
    };
    MEASURES.iter().map(map).collect()
}

fn options(quick: bool) -> RenderOptions {
    let [width, height] = size(quick);
    RenderOptions {
        width,
        height,
        ..RenderOptions::default()
    }
}

/// A built-in scene at rest, and its number of triangles.
fn render(name: &str, options: &RenderOptions, cube: bool) -> Result<(Film, usize)> {
    let scene = scene::builtin::build(name)?;
    let frame = scene.at(0.0);
    let options = &RenderOptions {
        ambient: scene.ambient,
        ..*options
    };
    let mut renderer = Renderer::new(&scene);
    if cube {
        renderer.set_secondary(Arc::new(CubeBuilder::default()));
    }
    let rendered = renderer.render(&frame, &frame.cameras[0], &frame.lights, options, &|_| {})?;
    Ok((rendered.film, frame.triangle_count()))
}

fn png(name: String, caption: String, [width, height]: [u32; 2], rgb: &[u8]) -> Result<Picture> {
    let mut png = Vec::new();
    image_io::encode_png(&mut png, width, height, rgb)?;
    Ok(Picture { name, caption, png })
}
