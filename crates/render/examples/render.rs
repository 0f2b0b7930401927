//! Renders a scene file, or a built-in scene, to a PNG: `cargo run --release --example render -- model.glb`.

use std::path::Path;

use rayward::{RenderOptions, Renderer, ToneMap, ToneMapper, image_io, scene};

fn main() -> rayward::Result<()> {
    let scene = match std::env::args().nth(1) {
        Some(file) => scene::load(Path::new(&file), &scene::LoadOptions::default())?,
        None => scene::builtin::build("teapot-mirror")?,
    };
    let frame = scene.at(0.0);
    let options = RenderOptions {
        width: 640,
        height: 480,
        ambient: scene.ambient,
        pixel_samples: 4,
        ..RenderOptions::default()
    };
    let aspect = f64::from(options.width) / f64::from(options.height);
    let camera = frame
        .cameras
        .first()
        .cloned()
        .unwrap_or_else(|| scene::default_camera(&frame, aspect));
    let lights = if frame.lights.is_empty() {
        scene::default_lights(&camera)
    } else {
        frame.lights.clone()
    };
    let mut renderer = Renderer::new(&scene);
    let rendered = renderer.render(&frame, &camera, &lights, &options, &|_progress| {})?;
    let rgb = ToneMapper::new(ToneMap::None).encode(&rendered.film);
    image_io::write_png(Path::new("example.png"), options.width, options.height, &rgb)
}
