//! `render`: pictures, summaries, and what does not change them.

use crate::support::{Folder, text};

/// Arguments of a small picture.
const SMALL: [&str; 5] = ["render", "--builtin", "blob-1k", "--resolution", "64x48"];

/// One triangle that faces +Z.
const TRIANGLE: &str = "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 2 3\n";

fn small<'a>(more: &[&'a str]) -> Vec<&'a str> {
    [&SMALL, more].concat()
}

fn size_of_png(bytes: &[u8]) -> (u32, u32) {
    assert!(bytes.starts_with(b"\x89PNG\r\n\x1a\n"));
    let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    (number(16), number(20))
}

#[test]
fn a_picture_and_a_summary() {
    let folder = Folder::new();
    let run = folder.run(&small(&[])).expect(0);
    assert!(run.stdout.is_empty(), "nothing but data goes to standard output");
    assert_eq!(folder.names(), ["rayward.png"]);
    let png = std::fs::read(folder.path("rayward.png")).expect("the picture");
    assert_eq!(size_of_png(&png), (64, 48));
    for word in [
        "blob-1k",
        "980 triangles",
        "eye grid",
        "3,072 eye",
        "Mray/s",
        "at peak",
        "rayward.png",
    ] {
        assert!(run.stderr.contains(word), "{word} is not in\n{}", run.stderr);
    }
    assert!(
        !run.stderr.contains('\x1b'),
        "no escape codes where there is no terminal"
    );
}

#[test]
fn the_default_is_the_courtyard() {
    let folder = Folder::new();
    let run = folder.run(&["render", "--width", "32", "--json"]).expect(0);
    let json = run.json();
    assert_eq!(json["scene"], "courtyard");
    assert_eq!(
        (&json["width"], &json["height"]),
        (&32.into(), &18.into()),
        "16:9"
    );
    assert_eq!(folder.names(), ["rayward.png"]);
}

#[test]
fn the_picture_does_not_depend_on_threads_or_instruction_set() {
    let folder = Folder::new();
    let doctor = folder.run(&["doctor", "--json"]).expect(0).json();
    let levels = doctor["simd_levels"].as_array().expect("levels").clone();
    assert!(!levels.is_empty());
    folder
        .run(&small(&["--quiet", "-o", "one.png", "--threads", "1"]))
        .expect(0);
    let one = std::fs::read(folder.path("one.png")).expect("the picture");
    let mut others = vec![("threads", serde_json::json!(2))];
    others.extend(levels.into_iter().map(|level| ("simd", level)));
    for (option, value) in others {
        let argument = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let option_name = format!("--{option}");
        let run = folder.run(&small(&["--json", "-o", "other.png", &option_name, &argument]));
        assert_eq!(run.expect(0).json()[option], value, "the one asked for is used");
        let other = std::fs::read(folder.path("other.png")).expect("the picture");
        assert!(one == other, "{option} {value} changes the picture");
    }
    folder
        .run(&small(&["--simd", "mmx"]))
        .expect(2)
        .says(&["--simd mmx"]);
}

#[test]
fn standard_output_takes_the_picture_and_nothing_else() {
    let folder = Folder::new();
    let run = folder.run(&small(&["-o", "-"])).expect(0);
    assert_eq!(size_of_png(&run.stdout), (64, 48));
    assert!(run.stdout.ends_with(b"IEND\xaeB`\x82"), "data after the picture");
    assert!(folder.names().is_empty());
    let both = small(&["-o", "-", "--json"]);
    folder.run(&both).expect(2).says(&["--json", "--output -"]);
}

#[test]
fn json_is_one_object_and_quiet_is_quiet() {
    let folder = Folder::new();
    let run = folder.run(&small(&["--json"])).expect(0);
    let json = run.json();
    assert!(run.stderr.is_empty(), "{}", run.stderr);
    assert_eq!(json["triangles"], 980);
    assert_eq!(json["eye_rays"], 64 * 48);
    assert!(json["structures"].as_array().is_some_and(|s| !s.is_empty()));
    assert!(json["mray_per_s"].as_f64().is_some_and(|rate| rate > 0.0));
    let run = folder.run(&small(&["--quiet"])).expect(0);
    assert!(run.stdout.is_empty() && run.stderr.is_empty());
}

#[test]
fn structures_of_hard_shadows_are_chosen_or_asked_for() {
    let folder = Folder::new();
    let with = |structure: &str| {
        let name = format!("{structure}.png");
        let args = [
            "--json",
            "--light",
            "point:3,4,2",
            "-o",
            &name,
            "--shadow-structure",
            structure,
        ];
        let json = folder.run(&small(&args)).expect(0).json();
        (
            std::fs::read(folder.path(&name)).expect("the picture"),
            json["shadows"][0].clone(),
        )
    };
    let (auto, chosen) = with("auto");
    let predicted = |way: &str| chosen["predicted_ms"][way].as_f64();
    assert!(
        ["receivers", "grid", "tree"]
            .iter()
            .all(|way| predicted(way).is_some_and(|ms| ms > 0.0))
    );
    for structure in ["receivers", "grid", "tree"] {
        let (picture, shadows) = with(structure);
        assert!(picture == auto, "{structure} changes the picture");
        assert_eq!(shadows["structure"], structure);
        assert!(shadows["predicted_ms"].is_null());
        let steps = &shadows["steps"];
        let both = ["predicted_nodes", "measured_nodes"].map(|key| steps[key].as_f64().unwrap_or(0.0));
        assert_eq!(
            both.iter().all(|&nodes| nodes > 0.0),
            structure == "tree",
            "{steps}"
        );
    }
    let both = small(&["--paper", "--shadow-structure", "tree"]);
    let refused = folder.run(&both).expect(2).stderr;
    assert!(
        ["--paper", "--shadow-structure"]
            .iter()
            .all(|name| refused.contains(name)),
        "{refused}"
    );
}

#[test]
fn layers_go_to_exr_and_npy() {
    let folder = Folder::new();
    folder
        .run(&small(&[
            "-o",
            "a.exr",
            "--npy",
            "arrays",
            "--layers",
            "depth,normal",
        ]))
        .expect(0);
    assert_eq!(folder.names(), ["a.exr", "arrays"]);
    let exr = std::fs::read(folder.path("a.exr")).expect("the picture");
    let header = &exr[..1000];
    let has = |name: &[u8]| header.windows(name.len()).any(|window| window == name);
    assert!(has(b"depth.Z\0") && has(b"N.X\0") && !has(b"id.prim\0"));
    let mut arrays: Vec<_> = std::fs::read_dir(folder.path("arrays"))
        .expect("arrays")
        .collect();
    assert_eq!(arrays.len(), 3);
    arrays.clear();
    let depth = std::fs::read(folder.path("arrays/depth.npy")).expect("an array");
    assert_eq!(depth.len() % 64, (64 * 48 * 4) % 64);
    assert!(depth.starts_with(b"\x93NUMPY"));

    let folder = Folder::new();
    folder.run(&small(&["--npy", "arrays"])).expect(0);
    assert_eq!(folder.names(), ["arrays"], "no picture unless asked for");
    assert!(
        folder.path("arrays/bary.npy").exists(),
        "all layers unless some are named"
    );
    let run = folder.run(&small(&["--layers", "depth"])).expect(2);
    run.says(&["--layers"]);
}

#[test]
fn camera_and_light_are_made_up_and_said() {
    let folder = Folder::new();
    folder.file("triangle.obj", TRIANGLE);
    let run = folder
        .run(&["render", "triangle.obj", "--resolution", "64x48"])
        .expect(0);
    let made_up = |word: &str| {
        let line = run.stderr.lines().find(|line| line.starts_with(word));
        line.is_some_and(|line| line.contains("made up"))
    };
    assert!(made_up("camera") && made_up("light"), "{}", run.stderr);
}

/// Share of pixels in which depth is finite.
fn coverage(folder: &Folder, arguments: &[&str]) -> f64 {
    let all = [
        &["render", "triangle.obj", "--resolution", "64x64", "--npy", "out"],
        arguments,
    ]
    .concat();
    folder.run(&all).expect(0);
    let bytes = std::fs::read(folder.path("out/alpha.npy")).expect("an array");
    let data = &bytes[bytes.len() - 64 * 64 * 4..];
    let alpha = data
        .chunks_exact(4)
        .map(|c| f32::from_le_bytes(c.try_into().expect("four bytes")));
    alpha.filter(|&a| a > 0.0).count() as f64 / (64.0 * 64.0)
}

#[test]
fn cameras_from_the_command_line_and_from_a_file() {
    let folder = Folder::new();
    folder.file("triangle.obj", TRIANGLE);
    // The triangle has an area of 2; 90 degrees at a distance of 2 show 16, at a distance of 4 they show 64.
    let near = coverage(
        &folder,
        &[
            "--camera-position",
            "0,0,2",
            "--camera-target",
            "0,0,0",
            "--camera-vfov",
            "90",
        ],
    );
    assert!((near - 2.0 / 16.0).abs() < 0.01, "{near}");
    let away = ["--camera-position", "0,0,2", "--camera-target", "0,0,4"];
    assert_eq!(coverage(&folder, &away), 0.0);
    folder.file(
        "cameras.json",
        r#"{ "triangle": { "eye": [0, 0, 4], "target": [0, 0, 0], "vfov_deg": 90, "point_light": [0, 0, 3] } }"#,
    );
    let far = coverage(&folder, &["--camera-file", "cameras.json"]);
    assert!((far - 2.0 / 64.0).abs() < 0.01, "{far}");

    let base = ["render", "triangle.obj", "--resolution", "8x8"];
    let wrong = |more: &[&str]| folder.run(&[&base, more].concat());
    wrong(&["--camera-file", "cameras.json", "--camera-entry", "x"])
        .expect(3)
        .says(&["cameras.json", "\"x\""]);
    wrong(&["--camera", "3"])
        .expect(2)
        .says(&["--camera 3", "no camera"]);
    wrong(&["--camera-position", "0,0,3"]).expect(0);
    wrong(&["--camera-position", "0,0,2", "--camera-target", "0,0,2"])
        .expect(2)
        .says(&["--camera-position"]);
    wrong(&["--camera-position", "0,5,0", "--camera-target", "0,0,0"])
        .expect(2)
        .says(&["--camera-up"]);
    wrong(&["--animation", "0"])
        .expect(2)
        .says(&["--animation 0", "no animation"]);
    wrong(&["--background", "0,1e39,0"]).expect(2);
}

#[test]
fn animations_are_chosen_by_name_or_index() {
    let folder = Folder::new();
    let run = |more: &[&str]| {
        let base = [
            "render",
            "--builtin",
            "walker",
            "--time",
            "0.3",
            "--resolution",
            "16x16",
            "-q",
        ];
        folder.run(&[&base, more].concat())
    };
    let picture = |more: &[&str]| {
        run(&[more, &["-o", "x.png"]].concat()).expect(0);
        std::fs::read(folder.path("x.png")).expect("the picture")
    };
    let first = picture(&[]);
    assert!(first == picture(&["--animation", "walk"]) && first == picture(&["--animation", "0"]));
    for wanted in ["run", "1", "-1", ""] {
        run(&[&format!("--animation={wanted}")])
            .expect(2)
            .says(&[&format!("--animation {wanted}"), "0 \"walk\""]);
    }
}

/// A glTF of one triangle, with a light that shines along it and so reaches nothing.
const LAMP: &str = r#"{ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "directional" }] } },
    "nodes": [{ "mesh": 0, "children": [1] },
        { "rotation": [0, 0.70710678, 0, 0.70710678], "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
        "min": [0, 0, 0], "max": [1, 1, 0] }],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
    "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }] }"#;

#[test]
fn light_from_all_around_goes_with_lights_that_are_made_up() {
    let folder = Folder::new();
    folder.file("triangle.obj", TRIANGLE);
    folder.file("lamp.gltf", LAMP);
    let entry = r#"{"triangle": {"eye": [0, 0, 4], "target": [0, 0, 0], "point_light": [3, 1, 2]}}"#;
    folder.file("cameras.json", entry);
    let picture = |source: &[&str], ambient: &[&str]| {
        let size = ["--resolution", "32x24", "-q", "-o", "x.png"];
        folder
            .run(&[&["render"], source, ambient, &size].concat())
            .expect(0);
        std::fs::read(folder.path("x.png")).expect("the picture")
    };
    for (source, ambient) in [
        (&["triangle.obj"][..], "0.1,0.1,0.1"),
        (&["--builtin", "blob-1k"], "0.1,0.1,0.1"),
        (&["lamp.gltf"], "0,0,0"),
        (&["--builtin", "blob-1k", "--light", "sun:1,1,1"], "0,0,0"),
        (&["triangle.obj", "--camera-file", "cameras.json"], "0,0,0"),
    ] {
        let seen = picture(source, &[]);
        assert!(seen == picture(source, &["--ambient", ambient]), "{source:?}");
        assert!(
            seen != picture(source, &["--ambient", "0.2,0.2,0.2"]),
            "{source:?}"
        );
    }
    folder
        .run(&[
            "animate",
            "lamp.gltf",
            "--frames",
            "0..1",
            "--resolution",
            "32x24",
            "-q",
            "-o",
            "f#.png",
        ])
        .expect(0);
    let frame = std::fs::read(folder.path("f0.png")).expect("the frame");
    assert!(frame == picture(&["lamp.gltf"], &["--ambient", "0,0,0"]));
}

#[test]
fn lights_change_the_picture() {
    let folder = Folder::new();
    let picture = |more: &[&str]| {
        folder
            .run(&small(&[more, &["-q", "-o", "x.png"]].concat()))
            .expect(0);
        std::fs::read(folder.path("x.png")).expect("the picture")
    };
    let pictures = [
        picture(&[]),
        picture(&["--light", "sun:1,1,1"]),
        picture(&["--light", "sun:1,1,1:1"]),
        picture(&["--light", "point:2,3,4"]),
        picture(&["--light", "sun:1,1,1", "--light", "point:2,3,4"]),
        picture(&["--light", "sun:1,1,1", "--exposure", "-1"]),
        picture(&["--light", "sun:1,1,1", "--tone-map", "aces"]),
        picture(&["--light", "sun:1,1,1", "--tone-map", "previous-frame"]),
        picture(&["--light", "sun:1,1,1", "--background", "0,0,1"]),
        picture(&["--light", "sun:1,1,1", "--ambient", "1,0,0"]),
    ];
    for (i, a) in pictures.iter().enumerate() {
        for (j, b) in pictures.iter().enumerate().skip(i + 1) {
            assert!(a != b, "pictures {i} and {j} are the same");
        }
    }
    assert!(pictures[1] == picture(&["--light", "sun:1,1,1", "--exposure", "0"]));
    let soft = |more: &[&str]| picture(&[&["--light", "sphere:2,3,4:1.5"], more].concat());
    let softs = [
        soft(&[]),
        soft(&["--samples", "3"]),
        soft(&["--seed", "1"]),
        picture(&["--light", "disk:2,3,4:1.5"]),
        picture(&["--light", "square:2,3,4:2"]),
        picture(&["--light", "sun:1,1,1:3:20"]),
    ];
    assert!(softs[0] == soft(&["--samples", "8", "--seed", "0"]));
    for (i, a) in softs.iter().enumerate() {
        assert!(
            softs[i + 1..].iter().all(|b| a != b) && pictures.iter().all(|b| a != b),
            "{i}"
        );
    }
}

#[test]
fn files_are_turned_and_scaled() {
    let folder = Folder::new();
    let path = folder.file("triangle.obj", TRIANGLE);
    let bounds = |more: &[&str]| {
        let json = folder
            .run(&[&["info", text(&path), "--json"], more].concat())
            .expect(0)
            .json();
        json["bounds"]["max"].clone()
    };
    assert_eq!(bounds(&[]), serde_json::json!([1.0, 1.0, 0.0]));
    let turned = bounds(&["--up", "z", "--scale", "2"]);
    assert_eq!((turned[0].as_f64(), turned[1].as_f64()), (Some(2.0), Some(0.0)));
    folder
        .run(&["info", "--builtin", "walker", "--up", "z"])
        .expect(2);
}

#[test]
fn a_lens_and_a_shutter() {
    let folder = Folder::new();
    let lens = [
        "--aperture",
        "0.3",
        "--pixel-samples",
        "2",
        "--json",
        "-o",
        "lens.png",
    ];
    let json = folder.run(&small(&lens)).expect(0).json();
    assert_eq!(json["eye_rays"], 2 * 64 * 48);
    let shutter = [
        "--builtin",
        "walker",
        "--resolution",
        "32x24",
        "--time",
        "0.4",
        "--shutter",
        "0.05",
        "--json",
    ];
    let json = folder.run(&[&["render"], &shutter[..]].concat()).expect(0).json();
    assert_eq!(
        json["eye_rays"],
        16 * 32 * 24,
        "16 rays a pixel unless told otherwise"
    );
    let refused = folder.run(&small(&["--focus", "3"])).expect(2);
    assert!(refused.stderr.contains("--aperture"), "{}", refused.stderr);
    folder.run(&small(&["--aperture", "0"])).expect(2);
}

#[test]
fn antialiasing_by_coverage() {
    let folder = Folder::new();
    let run = |more: &[&str]| folder.run(&small(&[&["--json", "-q"], more].concat()));
    let number = |more: &[&str], name: &str| run(more).expect(0).json()[name].as_u64().expect("a number");
    let coverage = ["--antialias", "coverage"];
    let pixels = 64 * 48;
    assert_eq!(number(&coverage, "eye_rays"), 16 * pixels);
    let few = [&coverage[..], &["--pixel-samples", "4"]].concat();
    assert_eq!(number(&few, "eye_rays"), 4 * pixels);
    let all = number(&["--pixel-samples", "4"], "surfaces");
    assert!(number(&few, "surfaces") < all);
    for other in [
        &["--paper"][..],
        &["--reference"],
        &["--aperture", "0.1"],
        &["--shutter", "0.1"],
        &["--shadow-structure", "grid"],
    ] {
        let refused = run(&[&coverage[..], other].concat()).expect(2);
        assert!(refused.stderr.contains(other[0]), "{}", refused.stderr);
    }
}
