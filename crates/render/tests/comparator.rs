//! The comparator, above all that it fails where it must.
//!
//! FLIP's values come from its authors' own program (`flip-evaluator` 1.7) on the same pictures.

use glam::{Vec3, Vec4};
use rayward::{CompareOptions, Comparison, Error, Picture, compare};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;

/// Ramps, edges and a texture; defined one column beyond the picture, so that it can be shifted.
fn texel(x: u32, y: u32) -> [u32; 3] {
    [x * 5 % 256, y * 7 % 256, (x / 8 + y / 8) % 2 * 200 + x * y % 56]
}

fn picture(texel: impl Fn(u32, u32) -> [u32; 3]) -> Picture {
    let pixel = |i| {
        let [r, g, b] = texel(i % WIDTH, i / WIDTH).map(|v| v as f32 / 255.0);
        Vec4::new(r, g, b, 1.0)
    };
    Picture {
        width: WIDTH,
        height: HEIGHT,
        pixels: (0..WIDTH * HEIGHT).map(pixel).collect(),
        srgb: true,
    }
}

fn compared(a: &Picture, b: &Picture) -> Comparison {
    compare(a, b, &CompareOptions::default()).unwrap()
}

/// Mean, two pixels and the maximum of FLIP at 67 pixels per degree, then the mean at 30.
type Reference = ([f32; 4], f32);

fn nudged() -> [(&'static str, Picture, Reference); 6] {
    let half = |x, y| {
        let (a, b) = (texel(x, y), texel(x + 1, y));
        [0, 1, 2].map(|c| (a[c] + b[c]) / 2)
    };
    [
        (
            "shifted by a pixel",
            picture(|x, y| texel(x + 1, y)),
            ([0.186_291, 0.041_21, 0.059_37, 0.829_75], 0.260_266),
        ),
        (
            "shifted by half a pixel",
            picture(half),
            ([0.134_919, 0.014_71, 0.163_81, 0.555_56], 0.166_352),
        ),
        (
            "one step brighter",
            picture(|x, y| texel(x, y).map(|v| (v + 1).min(255))),
            ([0.039_940, 0.021_63, 0.039_58, 0.054_17], 0.040_711),
        ),
        (
            "inverted",
            picture(|x, y| texel(x, y).map(|v| 255 - v)),
            ([0.910_144, 0.977_45, 0.977_34, 0.995_20], 0.940_665),
        ),
        (
            "red and blue swapped",
            picture(|x, y| {
                let [r, g, b] = texel(x, y);
                [b, g, r]
            }),
            ([0.613_011, 0.029_57, 0.715_67, 0.967_54], 0.649_990),
        ),
        (
            "half as bright",
            picture(|x, y| texel(x, y).map(|v| v / 2)),
            ([0.844_152, 0.051_84, 0.969_74, 0.980_42], 0.842_851),
        ),
    ]
}

#[test]
fn flip_is_that_of_its_authors() {
    let a = picture(texel);
    for (name, b, ([mean, corner, middle, max], mean_at_30)) in nudged() {
        let got = compared(&a, &b);
        let largest = got.flip.iter().copied().fold(0.0, f32::max);
        let at = |x: u32, y: u32| got.flip[(y * WIDTH + x) as usize];
        for (got, want) in [
            (got.mean_flip as f32, mean),
            (at(0, 0), corner),
            (at(48, 32), middle),
            (largest, max),
        ] {
            assert!((got - want).abs() < 2e-4, "{name}: {got} for {want}");
        }
        let coarse = compare(
            &a,
            &b,
            &CompareOptions {
                pixels_per_degree: 30.0,
                ..Default::default()
            },
        )
        .unwrap();
        assert!(
            (coarse.mean_flip as f32 - mean_at_30).abs() < 2e-4,
            "{name}: {}",
            coarse.mean_flip
        );
    }
}

#[test]
fn equal_pictures_do_not_differ() {
    let a = picture(texel);
    let got = compared(&a, &a.clone());
    assert_eq!((got.rmse, got.psnr, got.mean_flip), (0.0, f64::INFINITY, 0.0));
    assert_eq!(
        (got.differing, got.largest, got.non_finite_a, got.non_finite_b),
        (0, None, 0, 0)
    );
    assert!(got.difference_picture().chunks(3).all(|c| c == [0, 0, 4]));
}

#[test]
fn every_nudge_is_noticed() {
    let a = picture(texel);
    for (name, b, _) in nudged() {
        let got = compared(&a, &b);
        assert!(
            got.differing > (WIDTH * HEIGHT / 2) as usize,
            "{name}: {} pixels",
            got.differing
        );
        assert!(
            got.rmse > 3e-3 && got.psnr < 50.0 && got.mean_flip > 0.03,
            "{name}: {got:?}"
        );
        assert!(got.largest.unwrap().amount() >= 0.99 / 255.0, "{name}");
    }
}

#[test]
fn one_pixel_is_found() {
    let a = picture(texel);
    let mut b = a.clone();
    b.pixels[(17 * WIDTH + 40) as usize].y += 0.25;
    let got = compared(&a, &b);
    assert_eq!(got.differing, 1);
    let largest = got.largest.unwrap();
    assert_eq!((largest.x, largest.y, largest.channel), (40, 17, 1));
    assert!((largest.amount() - 0.25).abs() < 1e-6);
    let values = f64::from(WIDTH * HEIGHT * 3);
    assert!((got.rmse - 0.25 / values.sqrt()).abs() < 1e-8);
    assert!((got.psnr - 20.0 * (values.sqrt() / 0.25).log10()).abs() < 1e-4);
    let brightest = got
        .flip
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap()
        .0 as u32;
    assert!((brightest % WIDTH).abs_diff(40) <= 4 && (brightest / WIDTH).abs_diff(17) <= 4);
}

#[test]
fn tolerance_is_per_channel_and_exclusive() {
    let a = picture(texel);
    let mut b = a.clone();
    b.pixels[7].x += 0.125;
    b.pixels[8].w -= 0.25;
    let differing = |tolerance| {
        compare(
            &a,
            &b,
            &CompareOptions {
                tolerance,
                ..CompareOptions::default()
            },
        )
        .unwrap()
        .differing
    };
    assert_eq!([0.0, 0.1, 0.126, 0.25, 0.3].map(differing), [2, 2, 1, 0, 0]);
}

#[test]
fn sizes_must_be_equal() {
    let a = picture(texel);
    let mut b = a.clone();
    (b.width, b.height) = (HEIGHT, WIDTH);
    let error = compare(&a, &b, &CompareOptions::default()).unwrap_err();
    assert!(matches!(error, Error::SizeMismatch { .. }));
    assert_eq!(error.to_string(), "the images differ in size: 96x64 and 64x96");
    b.width = WIDTH;
    b.height = HEIGHT;
    b.pixels.pop();
    assert!(matches!(
        compare(&a, &b, &CompareOptions::default()),
        Err(Error::ImageSize { .. })
    ));
}

#[test]
fn values_that_are_not_finite_are_counted_and_differ() {
    let a = picture(texel);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut b = a.clone();
        b.pixels[100].z = bad;
        let got = compared(&a, &b);
        assert_eq!(
            (got.differing, got.non_finite_a, got.non_finite_b),
            (1, 0, 1),
            "{bad}"
        );
        assert_eq!(got.largest.unwrap().amount(), f32::INFINITY);
        assert!(got.rmse.is_finite() && got.mean_flip.is_finite() && got.flip.iter().all(|e| e.is_finite()));
        let same = compared(&b, &b.clone());
        assert_eq!(
            (same.differing, same.non_finite_a, same.non_finite_b),
            (0, 1, 1),
            "{bad}"
        );
    }
}

#[test]
fn linear_pictures_are_compared_as_they_are() {
    let bright = |v: f32| Picture {
        width: 2,
        height: 1,
        pixels: vec![Vec3::splat(v).extend(1.0), Vec3::splat(8.0).extend(1.0)],
        srgb: false,
    };
    let got = compared(&bright(4.0), &bright(5.0));
    // Both are white when displayed, so only the numbers tell.
    assert_eq!((got.differing, got.srgb, got.mean_flip), (1, false, 0.0));
    assert!((got.rmse - 0.5f64.sqrt()).abs() < 1e-9);
    assert!(
        (got.psnr - 20.0 * (8.0 / 0.5f64.sqrt()).log10()).abs() < 1e-9,
        "the peak is that of the picture"
    );
}

#[test]
fn encoded_and_linear_pictures_meet_encoded() {
    let a = picture(texel);
    let linear = a.to_linear();
    assert!(!linear.srgb);
    let got = compare(
        &a,
        &linear,
        &CompareOptions {
            tolerance: 1e-5,
            ..CompareOptions::default()
        },
    )
    .unwrap();
    assert!(got.srgb && got.differing == 0, "{}", got.differing);
    let wrong = Picture { srgb: true, ..linear };
    assert!(
        compared(&a, &wrong).differing > 0,
        "linear values taken for encoded ones differ"
    );
}

#[test]
fn false_colours_rise_in_brightness() {
    let a = picture(|_, _| [0; 3]);
    let mut comparison = compared(&a, &a.clone());
    for (i, error) in comparison.flip.iter_mut().enumerate() {
        *error = i as f32 / (WIDTH * HEIGHT - 1) as f32;
    }
    let picture = comparison.difference_picture();
    let brightness: Vec<u32> = picture
        .chunks(3)
        .map(|c| 2 * u32::from(c[0]) + 5 * u32::from(c[1]) + u32::from(c[2]))
        .collect();
    assert!(brightness.windows(2).all(|w| w[1] + 8 >= w[0]) && brightness.last() > Some(&1500));
    assert_eq!(picture[picture.len() - 3..], [252, 253, 191]);
}
