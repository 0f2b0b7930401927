//! `render`: environments, mirrors, samples of pixels, automatic exposure, references.

use crate::support::{Folder, text};

const SMALL: [&str; 6] = [
    "render",
    "--builtin",
    "teapot-mirror",
    "--resolution",
    "32x24",
    "--quiet",
];

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL, more].concat()
}

/// A picture of ours as a sky.
fn sky(folder: &Folder) {
    let sky = ["render", "--resolution", "64x32", "--quiet", "-o", "sky.exr"];
    folder.run(&sky).expect(0);
}

#[test]
fn an_environment_is_the_light_and_the_background() {
    let folder = Folder::new();
    sky(&folder);
    let lit = ["--environment", "sky.exr", "--json", "-o", "lit.png"];
    let json = folder.run(&small(&lit)).expect(0).json();
    assert_eq!(json["lights_origin"], "scene");
    assert!(json["secondary_rays"].as_u64() > Some(100));
    let turned = ["--environment-rotation", "90", "--environment-intensity", "0.5"];
    let turned = [&lit[..2], &turned, &["-o", "turned.png"]].concat();
    folder.run(&small(&turned)).expect(0);
    folder
        .run(&["compare", "lit.png", "turned.png", "--json"])
        .expect(5);
    let file = folder.file("triangle.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n");
    let alone = ["render", text(&file), "--resolution", "16x16", "--json"];
    let json = folder.run(&[&alone[..], &lit[..2]].concat()).expect(0).json();
    assert_eq!(json["lights_origin"], "environment");
    assert_eq!(json["lights"].as_array().map(Vec::len), Some(0));
}

#[test]
fn environments_that_are_none_end_with_3_and_are_named() {
    let folder = Folder::new();
    sky(&folder);
    let whole = std::fs::read(folder.path("sky.exr")).expect("the sky");
    folder.file("cut.exr", &whole[..whole.len() / 2]);
    folder.file("words.hdr", "not a picture");
    folder.file("cut.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n");
    let pfm = |texel: f32| {
        let texels = [[texel; 3], [1.0; 3]].concat();
        let mut bytes = b"PF\n2 1\n-1.0\n".to_vec();
        bytes.extend(texels.iter().flat_map(|value| value.to_le_bytes()));
        bytes
    };
    folder.file("nan.pfm", pfm(f32::NAN));
    folder.file("negative.pfm", pfm(-1.0));
    let names = [
        ("cut.exr", ""),
        ("words.hdr", ""),
        ("cut.hdr", ""),
        ("missing.hdr", "cannot read"),
        ("nan.pfm", "texel (0, 0)"),
        ("negative.pfm", "texel (0, 0)"),
    ];
    for (name, problem) in names {
        let run = folder.run(&small(&["--environment", name])).expect(3);
        run.says(&[name, problem]);
    }
    folder.run(&small(&["--environment-rotation", "90"])).expect(2);
}

#[test]
fn references_are_the_same_picture() {
    let folder = Folder::new();
    sky(&folder);
    let picture = [
        "render",
        "--builtin",
        "blob-1k",
        "--resolution",
        "24x16",
        "--quiet",
        "--environment",
        "sky.exr",
        "--pixel-samples",
        "2",
        "-o",
    ];
    folder.run(&[&picture[..], &["a.exr"]].concat()).expect(0);
    folder
        .run(&[&picture[..], &["b.exr", "--reference"]].concat())
        .expect(0);
    folder.run(&["compare", "a.exr", "b.exr"]).expect(0);
}

#[test]
fn exposure_is_found_from_the_picture() {
    let folder = Folder::new();
    let dim = ["--light", "sun:1,2,1:0.01", "--ambient", "0.001,0.001,0.001"];
    let dim = [&dim[..], &["--background", "0,0,0"]].concat();
    folder
        .run(&small(&[&dim[..], &["-o", "dim.png"]].concat()))
        .expect(0);
    let exposed = [&dim[..], &["--exposure", "auto", "-o", "exposed.png"]].concat();
    folder.run(&small(&exposed)).expect(0);
    folder.run(&["compare", "dim.png", "exposed.png"]).expect(5);
    let size = |name: &str| std::fs::metadata(folder.path(name)).expect("written").len();
    assert!(size("exposed.png") > size("dim.png"), "dark pictures hold less");
    folder
        .run(&small(&["--exposure", "auto", "--tone-map", "none"]))
        .expect(2);
}
