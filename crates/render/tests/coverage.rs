//! Antialiasing by coverage: the same edges as with every sample shaded, for a fraction of the surfaces.

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{FrameGeometry, LightKind, PosedLight, Scene, builtin};
use rayward::{
    Antialias, Error, Film, Layers, Lens, PixelFilter, RenderOptions, RenderedFrame, Renderer,
    ShadowStructure, Shutter,
};

const SAMPLES: u32 = 16;

fn options(antialias: Antialias) -> RenderOptions {
    RenderOptions {
        width: 160,
        height: 100,
        pixel_samples: SAMPLES,
        antialias,
        layers: Layers::ALL,
        ..RenderOptions::default()
    }
}

fn render(scene: &Scene, frame: &FrameGeometry, options: &RenderOptions) -> RenderedFrame {
    let mut renderer = Renderer::new(scene);
    let rendered = renderer.render(frame, &frame.cameras[0], &frame.lights, options, &|_| {});
    rendered.expect("valid input")
}

/// In both ways: every sample shaded, and by coverage.
fn both(scene: &Scene, frame: &FrameGeometry, of: &RenderOptions) -> [RenderedFrame; 2] {
    [Antialias::Samples, Antialias::Coverage]
        .map(|antialias| render(scene, frame, &RenderOptions { antialias, ..*of }))
}

/// The largest difference of two pictures, in colour and in alpha, over what is there and 1.
fn apart(a: &Film, b: &Film) -> f32 {
    let colors = a.color.iter().zip(&b.color);
    let alphas = a.alpha.iter().zip(&b.alpha);
    let color = colors.map(|(a, b)| ((*a - *b).abs() / (1.0 + *a)).max_element());
    alphas
        .map(|(a, b)| (a - b).abs())
        .chain(color)
        .fold(0.0, f32::max)
}

/// Every material of one colour without any light, by its number.
fn flat(name: &str) -> (Scene, FrameGeometry) {
    let mut scene = builtin::build(name).expect("it exists");
    for (i, material) in scene.materials.iter_mut().enumerate() {
        let part = |k: usize| (i * k % 7) as f32 / 6.0;
        material.base_color = Vec4::new(part(1), part(2), part(3), 1.0);
        material.base_color_texture = None;
        material.unlit = true;
    }
    let mut frame = scene.at(0.5);
    frame.attributes.colors.clear();
    (scene, frame)
}

#[test]
fn edges_of_things_are_those_of_all_samples() {
    for name in ["courtyard", "office", "walker", "blob-4k"] {
        let (scene, frame) = flat(name);
        for pixel_filter in [PixelFilter::Box, PixelFilter::BlackmanHarris] {
            let options = RenderOptions {
                pixel_filter,
                ..options(Antialias::Samples)
            };
            let [all, cover] = both(&scene, &frame, &options);
            assert!(apart(&all.film, &cover.film) < 1e-5, "{name}");
            assert!(
                all.film.color
                    != render(
                        &scene,
                        &frame,
                        &RenderOptions {
                            pixel_samples: 1,
                            ..options
                        }
                    )
                    .film
                    .color
            );
            let [many, few] = [all, cover].map(|frame| frame.stats.surfaces);
            assert!(few * 4 < many, "{name}: {few} surfaces instead of {many}");
        }
    }
}

/// Blocks on a plane that a parallel camera looks at from above, in parallel light: each face has one brightness.
fn blocks() -> (Scene, FrameGeometry) {
    let scene = builtin::build("office").expect("it exists");
    let mut scene = Scene {
        nodes: Vec::new(),
        meshes: Vec::new(),
        ..scene
    };
    let mut primitive = rayward::scene::Primitive::default();
    let mut quad = |corner: Vec3, u: Vec3, v: Vec3| {
        let first = primitive.positions.len() as u32;
        primitive
            .positions
            .extend([corner, corner + u, corner + u + v, corner + v]);
        primitive
            .triangles
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    quad(Vec3::new(-4.0, 0.0, 4.0), Vec3::X * 8.0, Vec3::NEG_Z * 8.0);
    for i in 0..9 {
        let (x, z) = ((i % 3) as f32 * 1.1 - 1.3, (i / 3) as f32 * 1.1 - 1.2);
        let (corner, side) = (Vec3::new(x, 0.2 + 0.1 * i as f32, z), Vec3::splat(0.5));
        let turn = glam::Quat::from_rotation_y(0.3 * i as f32);
        let [u, v, w] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| turn * (axis * side));
        quad(corner + v, w, u);
        quad(corner, u, w);
        quad(corner, w, v);
        quad(corner, v, u);
        quad(corner + u, v, w);
        quad(corner + w, u, v);
    }
    scene.meshes.push(rayward::scene::Mesh {
        primitives: vec![primitive],
        ..rayward::scene::Mesh::default()
    });
    scene.nodes.push(rayward::scene::Node {
        mesh: Some(0),
        ..rayward::scene::Node::default()
    });
    let mut frame = scene.at(0.0);
    frame.cameras = vec![rayward::scene::PosedCamera {
        name: String::new(),
        eye: DVec3::new(3.0, 6.0, 4.0),
        forward: DVec3::new(-3.0, -6.0, -4.0).normalize(),
        up: DVec3::Y,
        projection: rayward::scene::Projection::Orthographic {
            half_height: 1.8,
            aspect: None,
        },
    }];
    let sun = |direction: DVec3, power: f32| PosedLight {
        name: String::new(),
        position: DVec3::ZERO,
        direction: direction.normalize(),
        axis_x: DVec3::X,
        axis_y: DVec3::Y,
        power: Vec3::splat(power),
        range: f32::INFINITY,
        kind: LightKind::Directional { half_angle: 0.0 },
    };
    frame.lights = vec![
        sun(DVec3::new(-0.6, -1.0, 0.2), 2.0),
        sun(DVec3::new(0.5, -1.0, -0.9), 1.0),
    ];
    (scene, frame)
}

#[test]
fn edges_of_hard_shadows_are_those_of_all_samples() {
    let (scene, frame) = blocks();
    let [all, cover] = both(&scene, &frame, &options(Antialias::Samples));
    assert!(apart(&all.film, &cover.film) < 1e-5);
    let [many, few] = [&all, &cover].map(|frame| frame.stats.surfaces);
    assert!(few * 8 < many, "{few} surfaces instead of {many}");
    let dark = RenderOptions {
        shadows: false,
        ..options(Antialias::Coverage)
    };
    assert!(
        apart(&render(&scene, &frame, &dark).film, &cover.film) > 0.1,
        "there are shadows"
    );
}

#[test]
fn edges_of_hard_shadows_are_those_of_all_samples_where_something_is_transparent() {
    let (mut scene, plain) = blocks();
    let pane = |height: f32| {
        let corner = Vec3::new(-0.5, height, 0.7);
        let (u, v) = (Vec3::new(1.4, 0.0, 0.3), Vec3::new(-0.2, 0.0, -1.3));
        rayward::scene::Primitive {
            positions: vec![corner, corner + u, corner + u + v, corner + v],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            material: 1,
            ..rayward::scene::Primitive::default()
        }
    };
    scene.materials.truncate(1);
    scene.materials.push(rayward::scene::Material {
        base_color: Vec4::new(0.2, 0.4, 0.9, 0.5),
        alpha_mode: rayward::scene::AlphaMode::Blend,
        double_sided: true,
        ..rayward::scene::Material::default()
    });
    scene.meshes[0].primitives.push(pane(1.6));
    let mut frame = scene.at(0.0);
    (frame.cameras, frame.lights) = (plain.cameras, plain.lights);
    for tinted_shadows in [false, true] {
        let options = RenderOptions {
            tinted_shadows,
            ..options(Antialias::Samples)
        };
        let [all, cover] = both(&scene, &frame, &options);
        assert!(apart(&all.film, &cover.film) < 1e-5, "{tinted_shadows}");
        let [many, few] = [&all, &cover].map(|frame| frame.stats.surfaces);
        assert!(few * 3 < many, "{few} surfaces instead of {many}");
    }
}

#[test]
fn layers_are_those_of_the_centres() {
    let (scene, frame) = blocks();
    let [all, cover] = both(&scene, &frame, &options(Antialias::Samples));
    assert!(all.film.prim == cover.film.prim && all.film.depth == cover.film.depth);
    assert!(all.film.normal == cover.film.normal && all.film.bary == cover.film.bary);
}

#[test]
fn what_is_seen_through_or_mirrored_is_shaded_for_each_sample() {
    for name in ["forest", "solids"] {
        let mut scene = builtin::build(name).expect("it exists");
        for material in &mut scene.materials {
            material.unlit = true;
        }
        let frame = scene.at(0.0);
        let small = RenderOptions {
            width: 96,
            height: 60,
            ..options(Antialias::Samples)
        };
        let [all, cover] = both(&scene, &frame, &small);
        assert!(all.stats.surfaces > cover.stats.surfaces, "{name}");
        // Textures are looked up once a share.
        let far = apart(&all.film, &cover.film);
        assert!(far < 0.2, "{name}: {far}");
    }
    let mut scene = builtin::build("blob-1k").expect("it exists");
    for material in &mut scene.materials {
        (material.metallic, material.roughness) = (1.0, 0.0);
    }
    let frame = scene.at(0.0);
    let [all, cover] = both(&scene, &frame, &options(Antialias::Samples));
    assert_eq!(all.stats.secondary_rays, cover.stats.secondary_rays);
    assert!(apart(&all.film, &cover.film) < 1e-5);
}

#[test]
fn the_picture_does_not_depend_on_threads_and_levels() {
    let scene = builtin::build("courtyard").expect("it exists");
    let frame = scene.at(0.5);
    let picture = |threads: usize, level| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let options = RenderOptions {
            level,
            ..options(Antialias::Coverage)
        };
        pool.expect("threads")
            .install(|| render(&scene, &frame, &options).film)
    };
    let levels = rayward::trace::SimdLevel::available();
    let first = picture(1, levels[0]);
    for &level in &levels {
        assert!(picture(3, level) == first, "{}", level.name());
    }
}

#[test]
fn what_knows_of_no_shares_is_refused() {
    let (scene, frame) = blocks();
    let cover = options(Antialias::Coverage);
    let lens = Some(Lens {
        radius: 0.1,
        focus: 4.0,
    });
    let mut renderer = Renderer::new(&scene);
    let (camera, lights) = (&frame.cameras[0], &frame.lights);
    for refused in [
        RenderOptions { lens, ..cover },
        RenderOptions { paper: true, ..cover },
        RenderOptions {
            reference: true,
            ..cover
        },
        RenderOptions {
            shadow_structure: ShadowStructure::Grid,
            ..cover
        },
        RenderOptions {
            shadow_structure: ShadowStructure::Tree,
            ..cover
        },
    ] {
        let rendered = renderer.render(&frame, camera, lights, &refused, &|_| {});
        assert!(matches!(rendered, Err(Error::Antialias { .. })), "{refused:?}");
    }
    let shutter = Shutter {
        geometry: &frame,
        camera,
    };
    let rendered = renderer.render_shutter(&frame, camera, shutter, lights, &cover, &|_| {});
    assert!(matches!(rendered, Err(Error::Antialias { .. })));
}
