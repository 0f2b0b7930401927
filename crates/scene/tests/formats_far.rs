//! Plain mesh files whose coordinates lie far from zero, as those of a map's projection do.

use std::fmt::Write;
use std::path::Path;

use glam::{DVec3, Vec3};
use rayward_scene::{FrameGeometry, LoadOptions, UpAxis, load};

/// Easting, northing and height of a place, in metres: a whole number of steps of any origin in these tests.
const PLACE: DVec3 = DVec3::new(512_000.0, 5_427_200.0, 1024.0);

/// A pyramid around zero, in multiples of 1/64.
const CORNERS: [DVec3; 5] = [
    DVec3::new(-2.015_625, -2.0, -2.25),
    DVec3::new(2.0, -2.0, -2.25),
    DVec3::new(2.0, 2.015_625, -2.25),
    DVec3::new(-2.0, 2.0, -2.265_625),
    DVec3::new(0.015_625, 0.0, 2.25),
];
const FACES: [[usize; 3]; 4] = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];

fn obj(corners: &[DVec3]) -> Vec<u8> {
    let mut text = String::new();
    for p in corners {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in FACES {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    text.into_bytes()
}

fn ply(format: &str, vertices: &[u8], faces: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\nelement vertex 5\nproperty double x\nproperty double y\nproperty double z\n\
         element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [header.as_bytes(), vertices, faces].concat()
}

fn ascii_ply(corners: &[DVec3]) -> Vec<u8> {
    let vertices: String = corners
        .iter()
        .map(|p| format!("{} {} {}\n", p.x, p.y, p.z))
        .collect();
    let faces: String = FACES.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    ply("ascii", vertices.as_bytes(), faces.as_bytes())
}

fn binary_ply(corners: &[DVec3]) -> Vec<u8> {
    let vertices: Vec<u8> = corners
        .iter()
        .flat_map(|p| p.to_array())
        .flat_map(f64::to_le_bytes)
        .collect();
    let mut faces = Vec::new();
    for face in FACES {
        faces.push(3);
        faces.extend(face.iter().flat_map(|&i| (i as i32).to_le_bytes()));
    }
    ply("binary_little_endian", &vertices, &faces)
}

fn ascii_stl(corners: &[DVec3]) -> Vec<u8> {
    let mut text = "solid pyramid\n".to_owned();
    for face in FACES {
        text += "facet normal 0 0 0\nouter loop\n";
        for p in face.map(|i| corners[i]) {
            writeln!(text, "vertex {} {} {}", p.x, p.y, p.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text += "endsolid\n";
    text.into_bytes()
}

type Writer = fn(&[DVec3]) -> Vec<u8>;
const FORMATS: [(&str, Writer); 4] = [
    ("a.obj", obj),
    ("ascii.ply", ascii_ply),
    ("binary.ply", binary_ply),
    ("a.stl", ascii_stl),
];

fn pose(name: &str, bytes: &[u8], options: LoadOptions) -> FrameGeometry {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(Path::new(name));
    std::fs::write(&path, bytes).unwrap();
    load(&path, &options).unwrap().at(0.0)
}

#[test]
fn five_thousand_kilometres_away_is_the_same_geometry() {
    for (name, write) in FORMATS {
        let [near, far] = [DVec3::ZERO, PLACE].map(|place| {
            let corners = CORNERS.map(|p| p + place);
            pose(name, &write(&corners), LoadOptions::default())
        });
        assert_eq!(near.origin, DVec3::ZERO, "{name}");
        assert_eq!(far.origin, PLACE, "{name}");
        assert_eq!((&near.x, &near.y, &near.z), (&far.x, &far.y, &far.z), "{name}");
        assert_eq!(near.indices, far.indices, "{name}");
    }
}

#[test]
fn far_text_keeps_what_f64_holds_under_any_options() {
    let options = LoadOptions {
        up: UpAxis::Z,
        scale: 0.3048,
    };
    for (name, write) in FORMATS {
        let corners = CORNERS.map(|p| p * 0.9 + DVec3::new(500_000.123_4, 5_400_000.567_8, 321.098_7));
        let frame = pose(name, &write(&corners), options);
        for corner in corners {
            let expected = DVec3::new(corner.x, corner.z, -corner.y) * 0.3048;
            let distance = |i| (frame.origin + frame.position(i).as_dvec3() - expected).length();
            let nearest = (0..frame.x.len() as u32).map(distance).fold(f64::MAX, f64::min);
            assert!(nearest < 4e-7, "{name}: {nearest} m");
        }
    }
}

#[test]
fn numbers_are_rounded_once() {
    // Just above the middle between two f32, where f64 has the middle itself and would round it down.
    let above = "1.000000059604644775390625000000001";
    let text = format!("{above} 0 0");
    let second = Vec3::new(1.000_000_1, 0.0, 0.0);
    let obj = format!("v {text}\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{text}\n0 1 0\n0 0 1\n3 0 1 2\n"
    );
    let stl =
        format!("solid\nfacet\nouter loop\nvertex {text}\nvertex 0 1 0\nvertex 0 0 1\nendloop\nendfacet\n");
    for (name, content) in [("a.obj", obj), ("a.ply", ply), ("a.stl", stl)] {
        let frame = pose(name, content.as_bytes(), LoadOptions::default());
        assert_eq!(frame.position(0), second, "{name}");
    }
}
