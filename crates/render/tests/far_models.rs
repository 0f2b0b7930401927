//! Pictures of text models far from their zero equal those of near ones.

use std::fmt::Write;

use glam::DVec3;
use rayward::scene::{self, LoadOptions, builtin, default_camera, default_lights};
use rayward::{Film, Layers, RenderOptions, Renderer};

/// A built-in model as text, moved; coordinates are multiples of 2^-12, so that neither place rounds them.
fn model(name: &str, place: DVec3) -> String {
    let frame = builtin::build(name).expect("it exists").at(0.0);
    let (low, high) = frame.bounds().expect("triangles");
    let middle = (low.as_dvec3() + high.as_dvec3()) / 2.0;
    let mut text = String::new();
    for i in 0..frame.x.len() as u32 {
        let local = ((frame.position(i).as_dvec3() - middle) * 4096.0).round() / 4096.0;
        let p = place + local;
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("a string takes all");
    }
    for [a, b, c] in &frame.indices {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("a string takes all");
    }
    text
}

fn picture(name: &str, place: DVec3) -> Film {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.obj");
    std::fs::write(&path, model(name, place)).expect("written");
    let scene = scene::load(&path, &LoadOptions::default()).expect("a model");
    let frame = scene.at(0.0);
    let camera = default_camera(&frame, 4.0 / 3.0);
    let options = RenderOptions {
        width: 160,
        height: 120,
        layers: Layers::ALL,
        ..RenderOptions::default()
    };
    Renderer::new(&scene)
        .render(&frame, &camera, &default_lights(&camera), &options, &|_| ())
        .expect("valid input")
        .film
}

#[test]
fn five_hundred_kilometres_away_is_the_same_picture() {
    for name in ["blob-4k", "walker"] {
        let near = picture(name, DVec3::ZERO);
        let far = picture(name, DVec3::new(524_288.0, 1024.0, -524_288.0));
        let seen = near.prim.iter().filter(|&&p| p != rayward::NO_ID).count();
        assert!(seen * 10 > near.prim.len(), "{name}: {seen} pixels see it");
        assert!(near == far, "{name}");
    }
}
