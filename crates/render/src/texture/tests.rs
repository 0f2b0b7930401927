use rayward_scene::{Image, TextureTransform};

use super::*;
use crate::tonemap::decode_srgb8;

fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    Image {
        name: "test".into(),
        width,
        height,
        texels,
    }
}

fn scene(image: Image, sampler: Sampler) -> Scene {
    Scene {
        images: vec![image],
        samplers: vec![sampler],
        ..Scene::default()
    }
}

fn reference(transform: TextureTransform) -> TextureRef {
    TextureRef {
        image: 0,
        sampler: 0,
        uv_set: 0,
        transform,
    }
}

/// Samples the only texture of a scene.
fn sample(scene: &Scene, encoding: Encoding, transform: TextureTransform, uv: Vec2, level: f32) -> Vec4 {
    let reference = reference(transform);
    let textures = Textures::new(scene, &[(reference, encoding)]);
    let texture = textures.resolve(scene, &reference, encoding).unwrap();
    textures.sample(&texture, uv, level)
}

/// Red is 16 x, green 16 y: bilinear filtering reproduces a linear ramp exactly.
fn ramp() -> Image {
    image(8, 4, |x, y| [16 * x as u8, 16 * y as u8, 255, 255])
}

const PLAIN: TextureTransform = TextureTransform {
    offset: Vec2::ZERO,
    rotation: 0.0,
    scale: Vec2::ONE,
};

#[test]
fn bilinear_filtering_reproduces_a_ramp() {
    let scene = scene(
        ramp(),
        Sampler {
            wrap_u: Wrap::ClampToEdge,
            ..Sampler::default()
        },
    );
    for (u, v) in [(0.0625, 0.125), (0.5, 0.5), (0.3, 0.7), (0.9, 0.2)] {
        let got = sample(&scene, Encoding::Linear, PLAIN, Vec2::new(u, v), 0.0) * 255.0;
        assert!(
            (got.x - 16.0 * (u * 8.0 - 0.5)).abs() < 1e-3 && (got.y - 16.0 * (v * 4.0 - 0.5)).abs() < 1e-3
        );
        assert_eq!(got.w, 255.0);
    }
}

#[test]
fn nearest_takes_the_texel_under_the_point() {
    let sampler = Sampler {
        mag_nearest: true,
        ..Sampler::default()
    };
    let scene = scene(ramp(), sampler);
    let red = |u: f32| sample(&scene, Encoding::Linear, PLAIN, Vec2::new(u, 0.5), 0.0).x * 255.0;
    assert_eq!(
        [red(0.124), red(0.126), red(0.999), red(1.01)].map(|r| r.round() / 16.0),
        [0.0, 1.0, 7.0, 0.0]
    );
}

#[test]
fn wrapping_continues_the_image() {
    let at = |wrap, u: f32| {
        let scene = scene(
            ramp(),
            Sampler {
                wrap_u: wrap,
                ..Sampler::default()
            },
        );
        sample(&scene, Encoding::Linear, PLAIN, Vec2::new(u, 0.5), 0.0).x * 255.0 / 16.0
    };
    // At the border a repeated image is halfway between its last and first texel.
    for u in [0.0, 1.0, -3.0] {
        assert!((at(Wrap::Repeat, u) - 3.5).abs() < 1e-4);
        assert!((at(Wrap::ClampToEdge, u) - if u > 0.0 { 7.0 } else { 0.0 }).abs() < 1e-4);
    }
    for u in [0.1, 0.4, 0.77] {
        assert!((at(Wrap::Repeat, u) - at(Wrap::Repeat, u - 5.0)).abs() < 1e-4);
        assert!((at(Wrap::MirroredRepeat, u) - at(Wrap::MirroredRepeat, -u)).abs() < 1e-4);
        assert!((at(Wrap::MirroredRepeat, u) - at(Wrap::MirroredRepeat, 2.0 - u)).abs() < 1e-4);
        assert!((at(Wrap::MirroredRepeat, u) - at(Wrap::Repeat, u)).abs() < 1e-4);
    }
    // A quarter of a texel before the right border: three quarters of the last texel and one of the first.
    let near_border = 1.0 - 0.25 / 8.0;
    assert!((at(Wrap::Repeat, near_border) - 0.75 * 7.0).abs() < 1e-4);
    assert!((at(Wrap::ClampToEdge, near_border) - 7.0).abs() < 1e-4);
    assert!(at(Wrap::MirroredRepeat, 1.0) > 6.9 && at(Wrap::MirroredRepeat, 0.0) < 0.1);
}

#[test]
fn coordinates_that_are_not_finite_are_harmless() {
    for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
        for mag_nearest in [false, true] {
            let scene = scene(
                ramp(),
                Sampler {
                    wrap_u: wrap,
                    wrap_v: wrap,
                    mag_nearest,
                    ..Sampler::default()
                },
            );
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1e30] {
                let got = sample(&scene, Encoding::Srgb, PLAIN, Vec2::new(bad, bad), 0.0);
                assert!(got.is_finite(), "{wrap:?} at {bad}");
            }
        }
    }
}

#[test]
fn colours_are_filtered_in_linear_light() {
    let half = scene(image(2, 1, |x, _| [255 * x as u8; 4]), Sampler::default());
    let middle = sample(&half, Encoding::Srgb, PLAIN, Vec2::splat(0.5), 0.0);
    assert_eq!(middle, Vec4::splat(0.5));
    let grey = scene(image(1, 1, |_, _| [188, 64, 0, 128]), Sampler::default());
    let got = sample(&grey, Encoding::Srgb, PLAIN, Vec2::ZERO, 0.0);
    assert_eq!(
        got,
        Vec4::new(decode_srgb8(188), decode_srgb8(64), 0.0, 128.0 / 255.0)
    );
}

#[test]
fn transform_follows_the_extension() {
    let transform = TextureTransform {
        offset: Vec2::new(0.1, 0.2),
        rotation: std::f32::consts::FRAC_PI_2,
        scale: Vec2::new(2.0, 3.0),
    };
    let scene = scene(ramp(), Sampler::default());
    let reference = reference(transform);
    let textures = Textures::new(&scene, &[(reference, Encoding::Linear)]);
    let texture = textures.resolve(&scene, &reference, Encoding::Linear).unwrap();
    // Scaled to (1, 0.75), then a quarter turn that takes +u to -v (up in the image) and +v to +u.
    let got = texture.transform(Vec2::new(0.5, 0.25));
    assert!((got - Vec2::new(0.1 + 0.75, 0.2 - 1.0)).length() < 1e-6, "{got}");
    // 32 texels, scaled by 6: a footprint of 1/192 in texture coordinates is one texel.
    assert!(texture.level_of(1.0 / 192.0).abs() < 1e-5);
    assert!((texture.level_of(4.0 / 192.0) - 1.0).abs() < 1e-5);
}

#[test]
fn levels_are_averages_in_linear_light() {
    let checker = image(8, 8, |x, y| {
        if (x + y) % 2 == 0 {
            [255; 4]
        } else {
            [0, 0, 0, 255]
        }
    });
    let scene = scene(
        checker,
        Sampler {
            mipmaps: true,
            ..Sampler::default()
        },
    );
    for level in [1.0, 1.5, 2.0, 3.0, 99.0] {
        let got = sample(&scene, Encoding::Srgb, PLAIN, Vec2::new(0.3, 0.6), level);
        assert!(
            (got.truncate() - 0.5).abs().max_element() < 4e-3,
            "{got} at level {level}"
        );
        assert_eq!(got.w, 1.0);
    }
}

#[test]
fn levels_of_odd_sizes_keep_the_mean() {
    for (width, height) in [(5, 3), (7, 1), (1, 9), (13, 6)] {
        let texel = |x: u32, y: u32| {
            [
                (x * 37 % 251) as u8,
                (y * 91 % 251) as u8,
                ((x + y) * 53 % 251) as u8,
                255,
            ]
        };
        let picture = image(width, height, texel);
        let mean = picture
            .texels
            .iter()
            .fold(Vec4::ZERO, |sum, t| sum + Vec4::from(t.map(f32::from)))
            / (width * height) as f32;
        let scene = scene(
            picture,
            Sampler {
                mipmaps: true,
                ..Sampler::default()
            },
        );
        let got = sample(&scene, Encoding::Linear, PLAIN, Vec2::splat(0.5), 99.0) * 255.0;
        assert!(
            (got - mean).abs().max_element() < 1.5,
            "{width}x{height}: {got} for {mean}"
        );
    }
}

#[test]
fn levels_blend_linearly() {
    let ramp = image(4, 4, |x, _| [if x == 0 { 240 } else { 0 }; 4]);
    let scene = scene(
        ramp,
        Sampler {
            mipmaps: true,
            wrap_u: Wrap::ClampToEdge,
            ..Sampler::default()
        },
    );
    let at = |level| sample(&scene, Encoding::Linear, PLAIN, Vec2::new(0.25, 0.5), level).x * 255.0;
    assert!((at(1.0) - 120.0).abs() < 1e-3 && (at(2.0) - 60.0).abs() < 1e-3);
    assert!((at(1.25) - 105.0).abs() < 1e-3);
}

#[test]
fn samplers_without_mipmaps_stay_at_the_image() {
    let scene = scene(
        ramp(),
        Sampler {
            mag_nearest: true,
            mipmaps: false,
            ..Sampler::default()
        },
    );
    let uv = Vec2::new(0.5, 0.5);
    let (near, far) = (
        sample(&scene, Encoding::Linear, PLAIN, uv, 0.0),
        sample(&scene, Encoding::Linear, PLAIN, uv, 9.0),
    );
    // Magnified: nearest, texel 4; minified: linear, halfway between texels 3 and 4.
    assert!((near.x * 255.0 - 64.0).abs() < 1e-3 && (far.x * 255.0 - 56.0).abs() < 1e-3);
}

#[test]
fn references_to_nothing_resolve_to_nothing() {
    let mut scene = scene(ramp(), Sampler::default());
    scene.images[0].texels.pop();
    let missing = TextureRef {
        image: 7,
        ..reference(PLAIN)
    };
    let uses = [(missing, Encoding::Srgb), (reference(PLAIN), Encoding::Srgb)];
    let textures = Textures::new(&scene, &uses);
    assert!(
        uses.iter()
            .all(|(r, e)| textures.resolve(&scene, r, *e).is_none())
    );
}
