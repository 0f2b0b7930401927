//! Broken glTF files, made here: each gives its error, with the file and the place in it, and nothing else.

mod gltf_builder;

use std::path::Path;
use std::time::{Duration, Instant};

use base64::Engine;
use gltf_builder::{Builder, F32, U16, floats, push};
use rayward_scene::{Error, LoadOptions, Scene, load};
use serde_json::json;

/// The variant's name.
fn variant(error: &Error) -> &'static str {
    match error {
        Error::Io { .. } => "Io",
        Error::Reference { .. } => "Reference",
        Error::UnknownFormat { .. } => "UnknownFormat",
        Error::Malformed { .. } => "Malformed",
        Error::Unsupported { .. } => "Unsupported",
        Error::TooLarge { .. } => "TooLarge",
        Error::Empty { .. } => "Empty",
        _ => "another",
    }
}

/// The text of a `.gltf` with its buffer inside.
fn text_of(file: &Builder) -> String {
    let mut json = file.json.clone();
    let uri = format!(
        "data:;base64,{}",
        base64::engine::general_purpose::STANDARD.encode(&file.bin)
    );
    json["buffers"] = json!([{"byteLength": file.bin.len(), "uri": uri}]);
    json.to_string()
}

/// Loads a file that must fail: with this variant, a message with the file and all of `parts`, and in no time.
#[track_caller]
fn fails(path: &Path, expected: &str, parts: &[&str]) {
    let start = Instant::now();
    let result = load(path, &LoadOptions::default());
    assert!(
        start.elapsed() < Duration::from_secs(5),
        "it took {:?}",
        start.elapsed()
    );
    let error = result.map(|scene: Scene| scene.name).expect_err("it must fail");
    let message = error.to_string();
    assert_eq!(variant(&error), expected, "{message}");
    let file = path.display().to_string();
    for part in parts.iter().copied().chain([file.as_str()]) {
        assert!(message.contains(part), "{message:?} does not say {part:?}");
    }
}

#[track_caller]
fn glb_fails(file: &Builder, expected: &str, parts: &[&str]) {
    fails(&file.write("broken.glb", file.glb()), expected, parts);
}

#[test]
fn the_unbroken_file_loads() {
    let file = Builder::triangle();
    assert_eq!(
        file.load().expect("it is sound").meshes[0].primitives[0].triangles,
        [[0, 1, 2]]
    );
    let scene = load(&file.write("a.gltf", text_of(&file)), &LoadOptions::default()).expect("it is sound");
    assert_eq!(scene.meshes[0].primitives[0].positions.len(), 3);
}

#[test]
fn files_that_cannot_be_read() {
    let file = Builder::triangle();
    fails(&file.folder.path().join("absent.glb"), "Io", &["No such file"]);
    let folder = file.folder.path().join("folder.glb");
    std::fs::create_dir(&folder).expect("a folder");
    fails(&folder, "Io", &["directory"]);
    fails(&file.write("zero.glb", b""), "Empty", &["0 bytes"]);
    fails(
        &file.write("picture.png", b"\x89PNG\r\n\x1a\n"),
        "UnknownFormat",
        &[".png", "\\x89PNG"],
    );
    fails(
        &file.write("no_ending", b"hello"),
        "UnknownFormat",
        &["no ending"],
    );
}

#[cfg(unix)]
#[test]
fn a_file_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let file = Builder::triangle();
    let path = file.write("secret.glb", file.glb());
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o000)).expect("the mode is set");
    if std::fs::File::open(&path).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    fails(&path, "Io", &["ermission"]);
}

#[test]
fn broken_containers() {
    let file = Builder::triangle();
    let glb = file.glb();
    fails(
        &file.write("half.glb", &glb[..glb.len() / 2]),
        "Malformed",
        &["byte 8", "the header says"],
    );
    fails(
        &file.write("head.glb", &glb[..10]),
        "Malformed",
        &["byte 4", "10 of 12"],
    );
    let mut wrong = glb.clone();
    wrong[..4].copy_from_slice(b"glTX");
    fails(&file.write("magic.glb", &wrong), "Malformed", &["byte 0", "glTX"]);
    let mut old = glb.clone();
    old[4] = 1;
    fails(
        &file.write("version.glb", &old),
        "Unsupported",
        &["GLB version 1"],
    );
    let mut chunk = glb.clone();
    chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    fails(
        &file.write("chunk.glb", &chunk),
        "Malformed",
        &["byte 12", "4294967295 bytes"],
    );
    let mut kind = glb.clone();
    kind[16..20].copy_from_slice(b"BIN\0");
    fails(
        &file.write("kind.glb", &kind),
        "Malformed",
        &["byte 16", "instead of JSON"],
    );
    // Every prefix gives an error and no panic.
    for length in 0..glb.len() - 4 {
        let result = load(&file.write("prefix.glb", &glb[..length]), &LoadOptions::default());
        assert!(result.is_err(), "a prefix of {length} bytes loads");
    }
}

#[test]
fn broken_json() {
    let file = Builder::triangle();
    let text = text_of(&file);
    fails(
        &file.write("cut.gltf", &text[..text.len() - 9]),
        "Malformed",
        &["JSON line 1, column"],
    );
    fails(
        &file.write("list.gltf", "[1]"),
        "Malformed",
        &["byte 0", "nor JSON"],
    );
    fails(&file.write("bare.gltf", "{}"), "Malformed", &["asset"]);
    fails(
        &file.write("deep.gltf", "{\"a\":".to_string() + &"[".repeat(100_000)),
        "Malformed",
        &["recursion"],
    );
    let mut file = Builder::triangle();
    file.json["nodes"][0]["mesh"] = json!("roof");
    glb_fails(&file, "Malformed", &["JSON line 1", "roof"]);
    file.json["asset"]["version"] = json!("1.0");
    glb_fails(&file, "Unsupported", &["glTF version 1.0"]);
}

#[test]
fn extensions() {
    let mut file = Builder::triangle();
    file.json["extensionsUsed"] = json!(["EXT_made_up"]);
    let scene = file.load().expect("merely used");
    assert!(
        scene
            .notices
            .iter()
            .any(|notice| notice.message.contains("EXT_made_up")),
        "{:?}",
        scene.notices
    );
    file.json["extensionsRequired"] = json!(["KHR_texture_transform", "EXT_made_up"]);
    glb_fails(&file, "Unsupported", &["requires EXT_made_up"]);
}

#[test]
fn indices_out_of_range() {
    let break_with = |change: &dyn Fn(&mut Builder), parts: &[&str]| {
        let mut file = Builder::triangle();
        change(&mut file);
        glb_fails(&file, "Malformed", parts);
    };
    break_with(
        &|f| f.bin[40] = 9,
        &[
            "mesh 0 \"roof\", primitive 0, accessor 1",
            "index 2 is 9",
            "3 vert",
        ],
    );
    break_with(
        &|f| f.json["nodes"][0]["mesh"] = json!(5),
        &["node 0 \"tri\"", "mesh 5 does not exist"],
    );
    break_with(
        &|f| f.json["nodes"][0]["mesh"] = json!(1_u64 << 32),
        &["node 0 \"tri\"", "does not exist"],
    );
    break_with(
        &|f| f.primitive()["indices"] = json!(7),
        &["primitive 0", "accessor 7 does not exist"],
    );
    break_with(
        &|f| f.primitive()["attributes"]["POSITION"] = json!(1_u64 << 40),
        &["accessor", "does not exist"],
    );
    break_with(
        &|f| f.primitive()["material"] = json!(0),
        &["primitive 0", "material 0 does not exist"],
    );
    break_with(
        &|f| f.json["accessors"][0]["bufferView"] = json!(9),
        &["accessor 0", "bufferView 9"],
    );
    break_with(
        &|f| f.json["bufferViews"][0]["buffer"] = json!(9),
        &["bufferView 0", "buffer 9"],
    );
    break_with(&|f| f.json["scene"] = json!(3), &["scene 3 does not exist"]);
    break_with(
        &|f| f.json["scenes"][0]["nodes"] = json!([1_u64 << 33]),
        &["scene 0", "does not exist"],
    );
    break_with(
        &|f| f.json["nodes"][0]["children"] = json!([4]),
        &["node 0", "child node 4"],
    );
    break_with(
        &|f| f.json["nodes"][0]["camera"] = json!(4),
        &["node 0", "camera 4"],
    );
    break_with(&|f| f.json["nodes"][0]["skin"] = json!(4), &["node 0", "skin 4"]);
    let light = json!({"KHR_lights_punctual": {"light": 2}});
    break_with(
        &|f| f.json["nodes"][0]["extensions"] = light.clone(),
        &["node 0", "light 2"],
    );
    let material = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 3}}}]);
    break_with(
        &|f| f.json["materials"] = material.clone(),
        &["material 0", "baseColorTexture", "texture 3"],
    );
}

#[test]
fn sizes_that_lie() {
    let mut file = Builder::triangle();
    file.json["accessors"][0]["count"] = json!(4);
    glb_fails(
        &file,
        "Malformed",
        &[
            "accessor 0",
            "48 bytes from byte 0 on are needed, bufferView 0 has 36",
        ],
    );
    file.json["accessors"][0]["count"] = json!(1_u64 << 31);
    glb_fails(&file, "TooLarge", &["accessor 0", "2147483648", "over the limit"]);
    file.json["accessors"][0]["count"] = json!(u64::MAX);
    glb_fails(&file, "TooLarge", &["accessor 0"]);

    let mut file = Builder::triangle();
    file.json["accessors"][0]["byteOffset"] = json!(u64::MAX);
    glb_fails(&file, "Malformed", &["accessor 0"]);
    let mut file = Builder::triangle();
    file.json["bufferViews"][0]["byteLength"] = json!(u64::MAX);
    glb_fails(&file, "Malformed", &["bufferView 0", "are beyond"]);
    let mut file = Builder::triangle();
    file.json["bufferViews"][0]["byteStride"] = json!(4);
    glb_fails(&file, "Malformed", &["byteStride is 4"]);

    let mut file = Builder::triangle();
    file.json["accessors"][0] = json!({"componentType": F32, "type": "VEC3", "count": 1 << 26});
    glb_fails(&file, "TooLarge", &["accessor 0", "without a bufferView"]);
    let entries = json!({"count": u64::MAX / 2, "indices": {"bufferView": 1, "componentType": U16},
        "values": {"bufferView": 0}});
    file.json["accessors"][0] = json!({"componentType": F32, "type": "VEC3", "count": 3, "sparse": entries});
    glb_fails(&file, "Malformed", &["accessor 0, sparse", "do not fit"]);

    let file = Builder::triangle();
    let text = text_of(&file).replace("\"byteLength\":44", "\"byteLength\":9000000000");
    let text = text.replace("\"byteLength\":42", "\"byteLength\":9000000000");
    fails(
        &file.write("long.gltf", text),
        "Malformed",
        &["buffer 0", "byteLength is 9000000000"],
    );
}

#[test]
fn amplified_sizes() {
    // 2^16 vertices times 4096 primitives, and a node for each of 2^20 instances of them.
    let mut file = Builder::empty();
    let positions = file.accessor(&vec![0; 12 << 16], F32, "VEC3", 1 << 16);
    let primitive = json!({"attributes": {"POSITION": positions}});
    file.json["meshes"] = json!([{"primitives": vec![primitive.clone(); 4096]}]);
    file.json["nodes"] = json!([{"mesh": 0}]);
    glb_fails(&file, "TooLarge", &["mesh 0, primitive 2048", "vertices"]);

    file.json["meshes"] = json!([{"primitives": [primitive]}]);
    file.json["nodes"] = json!(vec![json!({"mesh": 0}); 1 << 13]);
    glb_fails(&file, "TooLarge", &["all instances"]);

    let mut file = Builder::triangle();
    let translations = file.accessor(&vec![0; 12 << 15], F32, "VEC3", 1 << 15);
    let instancing = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translations}}});
    file.json["nodes"] = json!(vec![json!({"mesh": 0, "extensions": instancing}); 200]);
    file.json["scenes"] = json!([{"nodes": (0..200).collect::<Vec<_>>()}]);
    glb_fails(&file, "TooLarge", &["node 127", "nodes up to here"]);
}

#[test]
fn broken_hierarchies() {
    let mut file = Builder::triangle();
    file.json["nodes"] = json!([{"mesh": 0}, {"name": "a", "children": [2]}, {"children": [1]}]);
    glb_fails(&file, "Malformed", &["node 1 \"a\"", "its own ancestor"]);
    file.json["nodes"] = json!([{"mesh": 0, "children": [0]}]);
    glb_fails(&file, "Malformed", &["node 0", "its own ancestor"]);
    // A chain in which each node lists the next twice would be 2^40 paths.
    let mut chain: Vec<_> = (1..=40).map(|next| json!({"children": [next, next]})).collect();
    chain.push(json!({"mesh": 0}));
    file.json["nodes"] = json!(chain);
    glb_fails(&file, "Malformed", &["node 1", "a node has one parent"]);
    file.json["nodes"] = json!([{"children": [1]}, {"mesh": 0}]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    glb_fails(&file, "Malformed", &["scene 0", "node 1 is listed as a root"]);
    file.json["nodes"] = json!([{"mesh": 0, "scale": [1e39, 1, 1]}]);
    file.json["scenes"][0]["nodes"] = json!([0]);
    glb_fails(&file, "Malformed", &["node 0", "not finite"]);
}

#[test]
fn a_deep_chain_does_not_overflow_the_stack() {
    let mut file = Builder::triangle();
    let mut chain: Vec<_> = (1..=200_000).map(|next| json!({"children": [next]})).collect();
    chain.push(json!({"mesh": 0}));
    file.json["nodes"] = json!(chain);
    let scene = file.load().expect("deep is not broken");
    assert_eq!(scene.nodes.len(), 200_001);
    assert!(
        scene
            .nodes
            .iter()
            .enumerate()
            .all(|(i, node)| node.parent == i.checked_sub(1))
    );
}

#[test]
fn nothing_to_show() {
    let mut file = Builder::triangle();
    file.json["nodes"] = json!([{}]);
    glb_fails(&file, "Empty", &["1 node, 1 mesh"]);
    let mut file = Builder::triangle();
    file.primitive()["mode"] = json!(1);
    glb_fails(&file, "Empty", &["no triangles"]);
    let mut file = Builder::triangle();
    file.json["accessors"][1]["count"] = json!(0);
    glb_fails(&file, "Empty", &["no triangles"]);
    glb_fails(&Builder::empty(), "Empty", &["0 nodes, 0 meshes"]);
}

#[test]
fn positions_that_are_not_finite_are_kept_for_posing() {
    let mut file = Builder::triangle();
    file.bin[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    file.bin[4..8].copy_from_slice(&f32::INFINITY.to_le_bytes());
    let scene = file.load().expect("posing drops them");
    let first = scene.meshes[0].primitives[0].positions[0];
    assert!(first.x.is_nan() && first.y.is_infinite());
}

#[test]
fn referenced_files() {
    let file = Builder::triangle();
    let with_uri = |uri: &str| {
        let mut json = file.json.clone();
        json["buffers"] = json!([{"name": "geometry", "byteLength": file.bin.len(), "uri": uri}]);
        file.write("scene.gltf", json.to_string())
    };
    fails(
        &with_uri("absent.bin"),
        "Reference",
        &["buffer 0 \"geometry\"", "absent.bin", "No such file"],
    );
    fails(&with_uri(""), "Malformed", &["buffer 0", "is empty"]);
    fails(
        &with_uri("/etc/hostname"),
        "Malformed",
        &["buffer 0", "absolute path"],
    );
    fails(
        &with_uri("%2Fetc%2Fhostname"),
        "Malformed",
        &["buffer 0", "absolute path"],
    );
    fails(
        &with_uri("http://example.com/a.bin"),
        "Malformed",
        &["buffer 0", "scheme"],
    );
    fails(
        &with_uri("file:///etc/hostname"),
        "Malformed",
        &["buffer 0", "scheme"],
    );
    fails(
        &with_uri("data:application/octet-stream;base64,AA*A"),
        "Malformed",
        &["buffer 0", "not base64"],
    );
    fails(
        &with_uri("data:application/octet-stream"),
        "Malformed",
        &["buffer 0", "comma"],
    );
    file.write("short.bin", &file.bin[..20]);
    fails(
        &with_uri("short.bin"),
        "Malformed",
        &["buffer 0", "there are 20 bytes"],
    );
    file.write("with space.bin", &file.bin);
    load(&with_uri("with%20space.bin"), &LoadOptions::default()).expect("a percent-encoded name");
}

#[test]
fn broken_textures() {
    let mut file = Builder::triangle();
    file.json["materials"] =
        json!([{"name": "bark", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
    file.json["textures"] = json!([{"source": 0}]);
    file.json["images"] = json!([{"name": "bark", "uri": "textures/bark.png"}]);
    glb_fails(
        &file,
        "Reference",
        &["image 0 \"bark\"", "textures/bark.png", "No such file"],
    );

    let mut png = Vec::new();
    let picture = image::RgbImage::from_fn(16, 16, |x, y| image::Rgb([(x * 16) as u8, (y * 16) as u8, 77]));
    picture
        .write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)
        .expect("a PNG");
    file.json["images"] = json!([{"name": "bark", "uri": "bark.png"}]);
    file.write("bark.png", &png);
    file.load().expect("the whole image");
    file.write("bark.png", &png[..png.len() / 2]);
    glb_fails(&file, "Malformed", &["image 0 \"bark\" (bark.png)"]);
    file.write("bark.png", b"");
    glb_fails(&file, "Malformed", &["image 0", "neither PNG nor JPEG"]);
    // Width and height of 2^31 - 1 in the header.
    let mut huge = png;
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = crc32(&huge[12..29]).to_be_bytes();
    huge[29..33].copy_from_slice(&crc);
    file.write("bark.png", &huge);
    glb_fails(&file, "TooLarge", &["image 0", "16384x16384"]);
    file.json["images"] = json!([{"bufferView": 8}]);
    glb_fails(&file, "Malformed", &["image 0", "bufferView 8"]);
    file.json["images"] = json!([{}]);
    glb_fails(&file, "Malformed", &["image 0", "neither a uri nor a bufferView"]);
}

/// The checksum of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| {
        if crc & 1 == 1 {
            (crc >> 1) ^ 0xedb8_8320
        } else {
            crc >> 1
        }
    };
    !bytes
        .iter()
        .fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

#[test]
fn broken_attributes_and_skins() {
    let mut file = Builder::triangle();
    let normals = file.accessor(&floats(&[0., 0., 1., 0., 0., 1.]), F32, "VEC3", 2);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    glb_fails(
        &file,
        "Malformed",
        &["primitive 0, NORMAL, accessor 2", "2 elements for 3 vertices"],
    );
    file.primitive()["attributes"] = json!({"POSITION": 0, "NORMAL": 1});
    glb_fails(&file, "Malformed", &["NORMAL, accessor 1", "Scalar where [Vec3]"]);

    let mut file = Builder::triangle();
    let joints = file.accessor(&[0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0], 5121, "VEC4", 3);
    let weights = file.accessor(&floats(&[1., 0., 0., 0.].repeat(3)), F32, "VEC4", 3);
    file.primitive()["attributes"] = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    file.json["skins"] = json!([{"joints": [0]}]);
    file.json["nodes"][0]["skin"] = json!(0);
    glb_fails(&file, "Malformed", &["node 0", "uses joint 3, skin 0 has 1"]);
    file.json["skins"] = json!([{"joints": [0, 0, 0, 0], "inverseBindMatrices": weights}]);
    glb_fails(&file, "Malformed", &["skin 0", "Vec4 where [Mat4]"]);
    file.json["skins"] = json!([{"joints": [9]}]);
    glb_fails(&file, "Malformed", &["skin 0", "joint node 9"]);
    file.primitive()["attributes"] = json!({"POSITION": 0, "JOINTS_0": joints});
    glb_fails(&file, "Malformed", &["do not come in pairs"]);
}

#[test]
fn broken_animations() {
    let animate = |times: &[f32], values: usize, path: &str| {
        let mut file = Builder::triangle();
        let input = file.accessor(&floats(times), F32, "SCALAR", times.len() as u64);
        let output = file.accessor(&floats(&vec![0.; values * 3]), F32, "VEC3", values as u64);
        let channel = json!({"sampler": 0, "target": {"node": 0, "path": path}});
        let animation = json!({"name": "walk", "channels": [channel],
            "samplers": [{"input": input, "output": output}]});
        push(&mut file.json["animations"], animation);
        file
    };
    animate(&[0., 1.], 2, "translation")
        .load()
        .expect("a sound animation");
    let place = "animation 0 \"walk\", channel 0, accessor 2";
    glb_fails(
        &animate(&[0., 1., 1.], 3, "scale"),
        "Malformed",
        &[place, "do not increase: 1 at 1, then 1"],
    );
    glb_fails(
        &animate(&[0., f32::NAN], 2, "scale"),
        "Malformed",
        &[place, "key time 1 is not finite"],
    );
    glb_fails(&animate(&[], 0, "scale"), "Malformed", &[place, "no key times"]);
    glb_fails(
        &animate(&[0., 1.], 3, "scale"),
        "Malformed",
        &["accessor 3", "3 output values for 2 keys"],
    );
    glb_fails(
        &animate(&[0., 1.], 2, "rotation"),
        "Malformed",
        &["accessor 3", "Vec3 where [Vec4]"],
    );
    glb_fails(
        &animate(&[0., 1.], 2, "colour"),
        "Malformed",
        &["channel 0", "\"path\""],
    );
    let mut file = animate(&[0., 1.], 2, "scale");
    file.json["animations"][0]["channels"][0]["sampler"] = json!(5);
    glb_fails(&file, "Malformed", &["channel 0", "sampler 5"]);
    file.json["animations"][0]["channels"][0] = json!({"sampler": 0, "target": {"node": 5, "path": "scale"}});
    glb_fails(&file, "Malformed", &["channel 0", "node 5"]);
}

#[test]
fn one_changed_byte_never_panics() {
    let mut file = Builder::triangle();
    let joints = file.accessor(&[0; 12], gltf_builder::U8, "VEC4", 3);
    let weights = file.accessor(&floats(&[1., 0., 0., 0.].repeat(3)), F32, "VEC4", 3);
    file.primitive()["attributes"] = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    file.json["skins"] = json!([{"joints": [0]}]);
    file.json["nodes"][0]["skin"] = json!(0);
    let glb = file.glb();
    for at in 0..glb.len() {
        for change in [2, 128] {
            let mut changed = glb.clone();
            changed[at] ^= change;
            let _ = load(&file.write("changed.glb", changed), &LoadOptions::default());
        }
    }
}
