//! Frames of a scene that moves: all structures are built anew for each, the renderer keeps what does not change.

use rayward::{RenderOptions, Renderer, scene};

fn main() -> rayward::Result<()> {
    let scene = scene::builtin::build("walker")?;
    let options = RenderOptions {
        width: 320,
        height: 180,
        ambient: scene.ambient,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&scene);
    for number in 0..24u8 {
        let frame = scene.at(f32::from(number) / 24.0);
        let rendered = renderer.render(&frame, &frame.cameras[0], &frame.lights, &options, &|_| {})?;
        let stats = &rendered.stats;
        println!(
            "frame {number}: {} triangles, built in {:?}, traced and shaded in {:?}",
            stats.triangles, stats.build, stats.trace
        );
    }
    Ok(())
}
