//! Shares of a picture, put together, are the picture: whatever a frame is made of.

use rayward::image_io::{join_parts, write_exr};
use rayward::scene::{FrameGeometry, Scene, builtin};
use rayward::{Antialias, Film, Layers, Lens, RenderOptions, Renderer, Shard, Shutter};

fn options() -> RenderOptions {
    RenderOptions {
        width: 133,
        height: 70,
        samples: 2,
        pixel_samples: 2,
        layers: Layers::ALL,
        ..RenderOptions::default()
    }
}

/// A frame, which moves until the shutter closes if `shutter` is set.
fn film(scene: &Scene, frames: [&FrameGeometry; 2], shutter: bool, options: &RenderOptions) -> Film {
    let [open, close] = frames;
    let (camera, lights) = (&open.cameras[0], &open.lights);
    let mut renderer = Renderer::new(scene);
    let rendered = if shutter {
        let closed = Shutter {
            geometry: close,
            camera: &close.cameras[0],
        };
        renderer.render_shutter(open, camera, closed, lights, options, &|_| ())
    } else {
        renderer.render(open, camera, lights, options, &|_| ())
    };
    rendered.expect("valid input").film
}

fn check(name: &str, shutter: bool, options: &RenderOptions) {
    let scene = builtin::build(name).expect("it exists");
    let (open, close) = (scene.at(0.3), scene.at(0.35));
    let whole = film(&scene, [&open, &close], shutter, options);
    let folder = tempfile::tempdir().expect("a folder");
    let parts: Vec<_> = (1..=3)
        .map(|index| {
            let options = RenderOptions {
                shard: Shard::new(index, 3),
                ..*options
            };
            let film = film(&scene, [&open, &close], shutter, &options);
            let part = film.part().expect("it is one");
            assert_eq!(Some(part.shard), options.shard);
            assert!(film.color != whole.color, "{name}: a part is not all of it");
            let path = folder.path().join(format!("{index}.exr"));
            write_exr(&path, &film).expect("a file");
            path
        })
        .collect();
    let joined = join_parts(&parts, 1 << 20, || ()).expect("all parts");
    assert!(joined == whole, "{name} {options:?}");
}

#[test]
fn parts_joined_are_the_whole() {
    check("courtyard", false, &options());
    check("forest", false, &options());
    let paper = RenderOptions {
        paper: true,
        ..options()
    };
    check("blob-1k", false, &paper);
    let coverage = RenderOptions {
        antialias: Antialias::Coverage,
        pixel_samples: 4,
        ..options()
    };
    check("courtyard", false, &coverage);
}

#[test]
fn parts_with_a_lens_or_a_shutter_are_the_whole() {
    check("walker", true, &options());
    let lens = Some(Lens {
        radius: 0.1,
        focus: 4.0,
    });
    check("blob-1k", false, &RenderOptions { lens, ..options() });
}

#[test]
fn a_part_knows_its_picture() {
    let scene = builtin::build("blob-1k").expect("it exists");
    let geometry = scene.at(0.0);
    let picture = |options: &RenderOptions| {
        let film = film(&scene, [&geometry, &geometry], false, options);
        film.part().expect("it is one").picture
    };
    let first = RenderOptions {
        shard: Shard::new(1, 2),
        pixel_samples: 1,
        ..options()
    };
    let own = picture(&first);
    let same = RenderOptions {
        shard: Shard::new(2, 2),
        layers: Layers::default(),
        ..first
    };
    assert_eq!(picture(&same), own);
    for other in [
        RenderOptions { seed: 1, ..first },
        RenderOptions { width: 134, ..first },
        RenderOptions { bounces: 7, ..first },
        RenderOptions {
            antialias: Antialias::Coverage,
            ..first
        },
    ] {
        assert_ne!(picture(&other), own);
    }
}
