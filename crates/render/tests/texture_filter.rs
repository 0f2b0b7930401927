//! Textures of whole frames: several samples a pixel show what their number can tell apart.

use glam::{DVec3, Vec2, Vec3};
use rayward::scene::{
    FrameGeometry, Image, Material, Mesh, Node, PosedCamera, Primitive, Projection, Sampler, Scene,
    TextureRef, TextureTransform,
};
use rayward::{Antialias, Lens, PixelFilter, RenderOptions, Renderer};

const SIZE: u32 = 64;

/// Stripes four texels wide on a square that fills a parallel camera's view, at four texels a pixel, a quarter of a pixel
/// off the pixels.
fn stripes() -> (Scene, FrameGeometry, PosedCamera) {
    let side = 4 * SIZE;
    let texel = |i: u32| {
        if ((i % side) / 4).is_multiple_of(2) {
            [0, 0, 0, 255]
        } else {
            [255; 4]
        }
    };
    let texture = TextureRef {
        image: 0,
        sampler: 0,
        uv_set: 0,
        transform: TextureTransform::default(),
    };
    let off = Vec2::X / side as f32;
    let scene = Scene {
        nodes: vec![Node {
            mesh: Some(0),
            ..Node::default()
        }],
        meshes: vec![Mesh {
            primitives: vec![Primitive {
                positions: [[-1, -1], [1, -1], [1, 1], [-1, 1]]
                    .map(|[x, y]| Vec3::new(x as f32, y as f32, 0.0))
                    .into(),
                uvs: [Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]
                    .map(|uv| uv + off)
                    .into(),
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Primitive::default()
            }],
            ..Mesh::default()
        }],
        materials: vec![Material {
            base_color_texture: Some(texture),
            unlit: true,
            ..Material::default()
        }],
        images: vec![Image {
            name: String::new(),
            width: side,
            height: side,
            texels: (0..side * side).map(texel).collect(),
        }],
        samplers: vec![Sampler {
            mipmaps: true,
            ..Sampler::default()
        }],
        ..Scene::default()
    };
    let camera = PosedCamera {
        name: String::new(),
        eye: 2.0 * DVec3::Z,
        forward: DVec3::NEG_Z,
        up: DVec3::Y,
        projection: Projection::Orthographic {
            half_height: 1.0,
            aspect: None,
        },
    };
    let frame = scene.at(0.0);
    (scene, frame, camera)
}

/// Two pixels in the middle of the picture.
fn pixels(options: RenderOptions) -> [f32; 2] {
    let (scene, frame, camera) = stripes();
    let options = RenderOptions {
        width: SIZE,
        height: SIZE,
        pixel_filter: PixelFilter::Box,
        ..options
    };
    let rendered = Renderer::new(&scene).render(&frame, &camera, &[], &options, &|_| ());
    let film = rendered.expect("valid input").film;
    [0, 1].map(|x| film.color[(SIZE * SIZE / 2 + SIZE / 2 + x) as usize].x)
}

#[test]
fn each_of_several_samples_filters_its_share_of_the_pixel() {
    let share = |pixel_samples, antialias| {
        let options = RenderOptions {
            pixel_samples,
            antialias,
            ..RenderOptions::default()
        };
        options.footprint_share()
    };
    assert_eq!(
        [1, 4, 16, 4096].map(|n| share(n, Antialias::Samples)),
        [1.0, 0.5, 0.25, 0.125]
    );
    assert_eq!(share(16, Antialias::Coverage), 1.0);
    // A pixel holds a quarter of one stripe and three quarters of the next.
    let samples = RenderOptions {
        pixel_samples: 64,
        ..RenderOptions::default()
    };
    for lens in [
        None,
        Some(Lens {
            radius: 1e-6,
            focus: 2.0,
        }),
    ] {
        let seen = pixels(RenderOptions { lens, ..samples });
        let off = seen.iter().zip([0.25, 0.75]).map(|(a, b)| (a - b).abs());
        assert!(off.clone().all(|off| off < 0.02), "{lens:?}: {seen:?}");
    }
}
