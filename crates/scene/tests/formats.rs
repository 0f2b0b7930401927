//! OBJ, PLY and STL: what is read, and what is said about files that are broken.

use std::path::{Path, PathBuf};

use glam::{Vec2, Vec3, Vec4};
use rayward_scene::{AlphaMode, Error, LoadOptions, Material, Scene, UpAxis, load};

/// A folder of files that goes away with it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    /// A texture of one row of texels.
    fn put_png(&self, name: &str, texels: &[[u8; 4]]) {
        let bytes = texels.concat();
        let path = self.0.path().join(name);
        image::save_buffer(&path, &bytes, texels.len() as u32, 1, image::ColorType::Rgba8).unwrap();
    }
}

fn read(name: &str, content: impl AsRef<[u8]>) -> Result<Scene, Error> {
    let folder = Folder::new();
    load(&folder.put(name, content), &LoadOptions::default())
}

/// The message of a malformed file, which has to name the file too.
fn complaint(name: &str, content: impl AsRef<[u8]>) -> String {
    match read(name, content) {
        Err(error @ Error::Malformed { .. }) => {
            let message = error.to_string();
            assert!(message.contains(name), "{message}");
            message
        }
        other => panic!("{name}: not malformed but {other:?}"),
    }
}

fn triangles(scene: &Scene) -> &[[u32; 3]] {
    &scene.meshes[0].primitives[0].triangles
}

fn ply(format: &str, body: &[u8]) -> Vec<u8> {
    let header = format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty double y\n\
         property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement extra 1\n\
         property list uchar short bits\nelement face 2\nproperty uchar flags\nproperty list uchar int vertex_indices\n\
         end_header\n"
    );
    [header.as_bytes(), body].concat()
}

/// The rows of the file above in binary, for either byte order.
fn ply_rows(
    bytes_of_f32: fn(f32) -> [u8; 4],
    f64: fn(f64) -> [u8; 8],
    i32: fn(i32) -> [u8; 4],
    i16: fn(i16) -> [u8; 2],
) -> Vec<u8> {
    let mut body = Vec::new();
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
        body.extend(bytes_of_f32(x));
        body.extend(f64(y));
        body.extend(bytes_of_f32(0.5));
        body.extend([255, 0, 188]);
    }
    body.push(2);
    body.extend([i16(300), i16(-1)].concat());
    body.extend([7, 4]);
    body.extend([0, 1, 2, 3].map(i32).concat());
    body.extend([7, 3]);
    body.extend([0, 1, 2].map(i32).concat());
    body
}

fn check_ply(scene: &Scene) {
    assert_eq!(triangles(scene), [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(primitive.positions[2], Vec3::new(1.0, 1.0, 0.5));
    // sRGB 188 is 0.503 linear.
    assert!(primitive.colors[0].distance(Vec4::new(1.0, 0.0, 0.5029, 1.0)) < 1e-4);
    assert!(
        scene.notices.iter().any(|n| n.to_string().contains("extra")),
        "{:?}",
        scene.notices
    );
}

#[test]
fn ply_reads_the_same_in_all_three_encodings() {
    let text = b"0 0 .5 255 0 188\n1 0 0.5 255 0 188\r\n\n1 1 5e-1 255 0 188\n0 1 0.5 255 0 188\n2 300 -1\n7 4 0 1 2 3\n7 3 0 1 2";
    check_ply(&read("a.ply", ply("ascii", text)).unwrap());
    let little = ply_rows(
        f32::to_le_bytes,
        f64::to_le_bytes,
        i32::to_le_bytes,
        i16::to_le_bytes,
    );
    check_ply(&read("a.ply", ply("binary_little_endian", &little)).unwrap());
    let big = ply_rows(
        f32::to_be_bytes,
        f64::to_be_bytes,
        i32::to_be_bytes,
        i16::to_be_bytes,
    );
    check_ply(&read("a.ply", ply("binary_big_endian", &big)).unwrap());
}

#[test]
fn ply_broken_anywhere_is_an_error_with_its_place() {
    let little = ply_rows(
        f32::to_le_bytes,
        f64::to_le_bytes,
        i32::to_le_bytes,
        i16::to_le_bytes,
    );
    let whole = ply("binary_little_endian", &little);
    for length in 1..whole.len() {
        let result = read("a.ply", &whole[..length]);
        assert!(
            matches!(result, Err(Error::Malformed { .. })),
            "cut at {length}: {result:?}"
        );
    }
    let mut outside = whole.clone();
    let last = outside.len() - 4;
    outside[last..].copy_from_slice(&4i32.to_le_bytes());
    assert!(complaint("a.ply", &outside).contains("face 1"));
    outside[last..].copy_from_slice(&(-1i32).to_le_bytes());
    assert!(complaint("a.ply", &outside).contains("face 1"));

    let text = ply("ascii", b"0 0 0 1 1 1\n1 0 0 1 1\n");
    assert!(complaint("a.ply", text).contains("header promises"));
    let text = ply(
        "ascii",
        b"0 0 0 1 1 1\n1 0 zero 1 1 1\n1 1 0 1 1 1\n0 1 0 1 1 1\n0\n0 3 0 1 2\n0 3 0 1 2\n",
    );
    assert!(complaint("a.ply", text).contains("line 18 (vertex 1)"));
}

#[test]
fn ply_headers_that_lie_neither_allocate_nor_hang() {
    let huge = u64::MAX / 2;
    let header =
        |element: &str| format!("ply\nformat binary_little_endian 1.0\n{element}\nend_header\n1234567890");
    for element in [
        format!("element vertex {huge}\nproperty float x\nproperty float y\nproperty float z"),
        format!("element face {huge}\nproperty list uchar int vertex_indices"),
        "element face 1\nproperty list uint int vertex_indices".to_owned(),
        format!("element other {huge}\nproperty list uchar uchar a"),
    ] {
        assert!(
            complaint("a.ply", header(&element)).contains("room for"),
            "{element}"
        );
    }
    // Rows without properties take no bytes, so any number of them may be there.
    assert!(matches!(
        read("a.ply", header(&format!("element nothing {huge}"))),
        Err(Error::Empty { .. })
    ));
}

#[test]
fn ply_strips_normals_and_numbers_that_are_none() {
    let text = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty float ny\nproperty float nz\nproperty float s\nproperty float t\n\
        element tristrips 1\nproperty list int int vertex_indices\nend_header\n\
        0 0 0 0 0 1 0 0\n1 0 0 0 0 1 1 0\n0 1 0 0 0 1 0 0.25\n1 1 0 0 0 1 1 1\nnan inf -inf 0 0 1 0 0\n\
        8 0 1 2 3 -1 2 3 4\n";
    let scene = read("a.ply", text).unwrap();
    assert_eq!(triangles(&scene), [[0, 1, 2], [2, 1, 3], [2, 3, 4]]);
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(
        (primitive.normals[0], primitive.uvs[2]),
        (Vec3::Z, Vec2::new(0.0, 0.75))
    );
    let frame = scene.at(0.0);
    assert_eq!((frame.triangle_count(), frame.dropped_non_finite), (2, 1));
}

const CUBE_FACE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn obj_corners_with_the_same_indices_are_one_vertex() {
    let text =
        format!("{CUBE_FACE}vt 0 0\nvt 1 .25 0\nvn 0 0 1\nf 1/1/1 2/2/1 3/1/1\nf -4/-2/-1 -2/-2/-1 -1//\n");
    let scene = read("a.obj", text).unwrap();
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(primitive.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(primitive.uvs[1], Vec2::new(1.0, 0.75));
    assert_eq!(primitive.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::ZERO]);
}

#[test]
fn obj_takes_text_as_programs_write_it() {
    let text = "\u{feff}# x\r\nv\t0 0 0 1.0\r\nv  1 0 0 \r\nv 0 1 0\r\nv nan 1.#IND inf\r\n\
        g  a b\r\nf 1// 2// \\\r\n 3// # end\r\nf 1 2 4\r\nl 1 2\r\nf 1 2\r\n";
    let scene = read("a.obj", text).unwrap();
    assert_eq!(triangles(&scene), [[0, 1, 2], [0, 1, 3]]);
    assert_eq!(scene.at(0.0).dropped_non_finite, 1);
    let notices: Vec<String> = scene.notices.iter().map(ToString::to_string).collect();
    assert_eq!(notices.len(), 2, "{notices:?}");
    // Colours are sRGB, with or without a weight before them.
    let scene = read(
        "a.obj",
        "v 0 0 0 1 0 0\nv 1 0 0 1 0 0 1\nv 0 1 0\nf 1 2 3\nf 4 2 3\nv 2 2 2\n",
    )
    .unwrap();
    let colors = &scene.meshes[0].primitives[0].colors;
    assert_eq!(
        colors[..],
        [
            Vec4::new(1., 0., 0., 1.),
            Vec4::new(0., 0., 1., 1.),
            Vec4::ONE,
            Vec4::ONE
        ]
    );
}

#[test]
fn obj_concave_polygons_keep_their_area() {
    let text = "v 0 0 5\nv 2 1 5\nv 0 2 5\nv 1 1 5\nf 1 2 3 4\n";
    let frame = read("a.obj", text).unwrap().at(0.0);
    let area: f32 = (0..frame.triangle_count())
        .map(|i| {
            let [a, b, c] = frame.indices[i].map(|i| frame.position(i));
            (b - a).cross(c - a).z / 2.0
        })
        .inspect(|&area| assert!(area > 0.0))
        .sum();
    assert_eq!(area, 1.0);
}

#[test]
fn obj_broken_lines_are_named() {
    for (line, problem) in [
        ("f 1 2 9", "vertex 9"),
        ("f 1 2 -7", "out of range"),
        ("f 0 1 2", "index 0"),
        ("f 1/1 2/1 3/1", "texture coordinate 1"),
        ("f 1//1 2//1 3//1", "normal 1"),
        ("f 1 2 x", "\"x\""),
        ("f 1/1/1/1 2 3", "more than three"),
        ("v 1 2", "2 numbers"),
        ("vn 1 2 z", "\"z\""),
    ] {
        let message = complaint("a.obj", format!("{CUBE_FACE}{line}\nf 1 2 3\n"));
        assert!(
            message.contains("line 5") && message.contains(problem),
            "{message}"
        );
    }
    assert!(complaint("a.obj", b"\xFF\xFEv\0 \0").contains("UTF-16"));
    assert!(complaint("a.obj", b"v 1 2 3\n\0").contains("byte 8"));
    for text in ["# nothing\n", "v 0 0 0\n", "v 0 0 0\nv 1 0 0\nl 1 2\n"] {
        assert!(matches!(read("a.obj", text), Err(Error::Empty { .. })));
    }
}

/// The material that one face gets from a library of this text.
fn material(folder: &Folder, library: &str) -> Result<(Material, Scene), Error> {
    folder.put(
        "m.mtl",
        format!("newmtl first one\n{library}\nnewmtl unused\nmap_Kd missing.png\n"),
    );
    let text = format!("mtllib m.mtl\n{CUBE_FACE}vt 0 0\nusemtl first one\nf 1/1 2/1 3/1\n");
    let scene = load(&folder.put("a.obj", text), &LoadOptions::default())?;
    let index = scene.meshes[0].primitives[0].material;
    Ok((scene.materials[index].clone(), scene))
}

#[test]
fn mtl_surfaces_become_metallic_roughness() {
    let folder = Folder::new();
    let of = |library: &str| material(&folder, library).unwrap().0;
    let matt = of("Kd 0.5 0.25 0 # brown\nKs 0 0 0\nNs 10\nillum 2");
    assert_eq!(matt.base_color, Vec4::new(0.5, 0.25, 0.0, 1.0));
    assert_eq!(
        (matt.name.as_str(), matt.specular, matt.roughness),
        ("first one", 0.0, 1.0)
    );
    assert!(matt.double_sided && matt.alpha_mode == AlphaMode::Opaque);
    let shiny = of("Kd 1 1 1\nKs 0.4 0.2 0.4\nNs 30\nKe 2 0 0");
    assert_eq!(
        (shiny.specular, shiny.specular_color),
        (1.0, Vec3::new(1.0, 0.5, 1.0))
    );
    assert!((shiny.roughness - 0.5).abs() < 1e-6 && shiny.emissive == Vec3::X * 2.0);
    let mirror = of("Kd .1 .1 .1\nKs 0.9 0.8 0.7\nNs 1000\nillum 3");
    assert_eq!((mirror.metallic, mirror.roughness), (1.0, 0.0));
    assert_eq!(mirror.base_color, Vec4::new(0.9, 0.8, 0.7, 1.0));
    let glass = of("Kd 0 0 0\nTf .5 1 1\nNi 1.33\nillum 7");
    assert_eq!((glass.transmission, glass.ior, glass.roughness), (1.0, 1.33, 0.0));
    assert!(glass.thickness > 0.0 && glass.base_color == Vec4::new(0.5, 1.0, 1.0, 1.0));
    let veil = of("Tr 0.5\nd 0.75");
    assert_eq!((veil.base_color.w, veil.alpha_mode), (0.75, AlphaMode::Blend));
    assert_eq!(of("Tr 0.5").base_color.w, 0.5);
    for broken in [
        "Kd 0.5 0.5",
        "Kd a b c",
        "Ns",
        "Ni nan",
        "map_Kd -frob x.png",
        "map_Kd -clamp on",
    ] {
        let error = material(&folder, broken).unwrap_err();
        assert!(
            matches!(error, Error::Malformed { .. }) && error.to_string().contains("first one"),
            "{error}"
        );
    }
}

#[test]
fn mtl_textures_are_found_masked_and_placed() {
    let folder = Folder::new();
    folder.put_png("Leaf.PNG", &[[10, 20, 30, 255], [40, 50, 60, 255]]);
    folder.put_png("mask.png", &[[0, 0, 0, 255], [255, 255, 255, 255]]);
    folder.put_png("cut.png", &[[1, 2, 3, 0]]);
    let (leaf, scene) = material(
        &folder,
        "Kd 0 0 0\nmap_Kd -s 2 3 1 -o 0.5 0.25 -clamp on leaf.png",
    )
    .unwrap();
    let texture = leaf.base_color_texture.unwrap();
    assert_eq!(
        scene.images[texture.image].texels,
        [[10, 20, 30, 255], [40, 50, 60, 255]]
    );
    assert_eq!(leaf.base_color, Vec4::ONE, "black does not darken the texture");
    assert_eq!(leaf.alpha_mode, AlphaMode::Opaque);
    // From the bottom, v' = 0.25 + 3 v; from the top, 1 - v' = 1 - 0.25 - 3 (1 - w) = -2.25 + 3 w.
    assert_eq!(
        (texture.transform.offset, texture.transform.scale),
        (Vec2::new(0.5, -2.25), Vec2::new(2.0, 3.0))
    );
    assert!(texture.sampler != 0);
    assert!(
        scene.notices.iter().any(|n| n.message.contains("letter case")),
        "{:?}",
        scene.notices
    );

    let (masked, scene) = material(&folder, "map_Kd Leaf.PNG\nmap_d mask.png\nbump mask.png").unwrap();
    assert_eq!(masked.alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    let texels = &scene.images[masked.base_color_texture.unwrap().image].texels;
    assert_eq!(*texels, [[10, 20, 30, 0], [40, 50, 60, 255]]);
    assert!(
        scene.notices.iter().any(|n| n.message.contains("bump")),
        "{:?}",
        scene.notices
    );
    assert_eq!(
        material(&folder, "map_Kd cut.png").unwrap().0.alpha_mode,
        AlphaMode::Mask { cutoff: 0.5 }
    );

    let error = material(&folder, "map_Kd none.png").unwrap_err();
    assert!(
        matches!(error, Error::Reference { .. }) && error.to_string().contains("none.png"),
        "{error}"
    );
    folder.put("broken.png", b"\x89PNG\r\n\x1a\n and then nothing");
    assert!(material(&folder, "map_Kd broken.png").is_err());
    folder.put("strange.tga", b"not an image");
    assert!(matches!(
        material(&folder, "map_Kd strange.tga"),
        Err(Error::Unsupported { .. })
    ));
}

#[test]
fn obj_without_its_library_is_white_and_says_so() {
    let scene = read(
        "a.obj",
        format!("mtllib none.mtl\nusemtl x\n{CUBE_FACE}f 1 2 3\nusemtl y\nf 1 3 4\n"),
    )
    .unwrap();
    assert_eq!(scene.meshes[0].primitives.len(), 2);
    assert!(
        scene.notices.iter().any(|n| n.place.contains("none.mtl")),
        "{:?}",
        scene.notices
    );
}

fn binary_stl(head: &[u8], facets: &[[f32; 9]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..head.len()].copy_from_slice(head);
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        bytes.extend(facet.iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const FACETS: [[f32; 9]; 2] = [
    [0., 0., 0., 1., 0., 0., 0., 1., 0.],
    [1., 0., 0., 1., 1., 0., -0., 1., 0.],
];

#[test]
fn stl_binary_is_welded_whatever_its_header_says() {
    for head in [&b"solid as many write"[..], b"made by hand"] {
        let bytes = binary_stl(head, &FACETS);
        let scene = read("a.stl", &bytes).unwrap();
        assert_eq!(triangles(&scene), [[0, 1, 2], [1, 3, 2]], "the two zeros are one");
        for length in [1, 83, 84, 100, bytes.len() - 1] {
            let result = read("a.stl", &bytes[..length]);
            assert!(
                matches!(result, Err(Error::Malformed { .. })),
                "cut at {length}: {result:?}"
            );
        }
    }
    let mut absurd = binary_stl(b"x", &FACETS);
    absurd[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(complaint("a.stl", absurd).contains("4294967295 facets"));
    assert!(matches!(
        read("a.stl", binary_stl(b"x", &[])),
        Err(Error::Empty { .. })
    ));
}

#[test]
fn stl_ascii_reads_every_solid_and_names_broken_lines() {
    let facet = "FACET normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1e0 nan\n endloop\nendfacet\n";
    let text = format!(
        "solid\n{facet}endsolid\nsolid nothing\nendsolid nothing\n  Solid b\r\n{facet}{facet}endsolid b\n"
    );
    let scene = read("a.stl", &text).unwrap();
    let counts: Vec<usize> = scene.meshes[0]
        .primitives
        .iter()
        .map(|p| p.triangles.len())
        .collect();
    assert_eq!(counts, [1, 2]);
    assert_eq!(scene.at(0.0).dropped_non_finite, 3);
    for (text, problem) in [
        ("solid\nfacet\nouter loop\nvertex 0 0\n", "line 4: a vertex needs"),
        (
            "solid\nfacet\nouter loop\nvertex 0 0 0\nendloop\nendfacet\n",
            "line 6: a facet of 1",
        ),
        ("solid\nfacet\nouter loop\n", "line 3: the file ends"),
        ("solid\nhello\n", "line 2: \"hello\""),
    ] {
        assert!(
            complaint("a.stl", text).contains(problem),
            "{}",
            complaint("a.stl", text)
        );
    }
    assert!(matches!(
        read("a.stl", "solid\nendsolid\n"),
        Err(Error::Empty { .. })
    ));
}

#[test]
fn options_turn_and_scale_exactly() {
    let folder = Folder::new();
    let path: &Path = &folder.put("a.obj", "v 1 2 3\nv 4 2 3\nv 1 2 9\nf 1 2 3\n");
    let frame = load(
        path,
        &LoadOptions {
            up: UpAxis::Z,
            scale: 0.5,
        },
    )
    .unwrap()
    .at(0.0);
    assert_eq!(frame.position(0), Vec3::new(0.5, 1.5, -1.0));
    let frame = load(
        path,
        &LoadOptions {
            up: UpAxis::Y,
            scale: 2.0,
        },
    )
    .unwrap()
    .at(0.0);
    assert_eq!(frame.position(0), Vec3::new(2.0, 4.0, 6.0));
}
