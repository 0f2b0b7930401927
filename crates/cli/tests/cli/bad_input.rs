//! Broken inputs: each ends with its exit code and one line that names the file, and leaves no output.

use std::path::{Path, PathBuf};

use crate::support::{Folder, Run, text};

/// A GLB of this JSON and these bytes.
fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let total = 12 + 8 + json.len() + 8 + binary.len();
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend((total as u32).to_le_bytes());
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend((binary.len() as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(binary);
    out
}

/// glTF of one triangle: `nodes` and `accessor` as given, with a buffer of 36 bytes.
fn gltf(nodes: &str, accessor: &str) -> String {
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": {nodes},
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }} }}] }}],
            "accessors": [{accessor}], "bufferViews": [{{ "buffer": 0, "byteLength": 36 }}],
            "buffers": [{{ "byteLength": 36 }}] }}"#
    )
}

const NODE: &str = r#"[{ "mesh": 0 }]"#;
const ACCESSOR: &str = r#"{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
    "min": [0, 0, 0], "max": [1, 1, 0] }"#;

fn corners() -> Vec<u8> {
    let numbers = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Renders a file small; fails on output that is left beside an error.
#[track_caller]
fn render(folder: &Folder, file: &Path, code: i32) -> Run {
    let output = folder.path("out.png");
    let run = folder.run(&["render", text(file), "--resolution", "16x12", "-o", text(&output)]);
    let run = run.expect(code);
    assert_eq!(output.exists(), code == 0);
    assert!(!folder.names().iter().any(|name| name.starts_with(".rayward")));
    run
}

#[test]
fn the_sound_file_of_the_corpus_renders() {
    let folder = Folder::new();
    let file = folder.file("sound.glb", glb(&gltf(NODE, ACCESSOR), &corners()));
    render(&folder, &file, 0);
}

#[test]
fn broken_files_end_with_3_and_are_named() {
    let folder = Folder::new();
    let sound = glb(&gltf(NODE, ACCESSOR), &corners());
    let cyclic = r#"[{ "mesh": 0, "children": [1] }, { "children": [0] }]"#;
    let long = ACCESSOR.replace("\"count\": 3", "\"count\": 4");
    let required = gltf(NODE, ACCESSOR).replacen('{', r#"{ "extensionsRequired": ["EXT_no_such_thing"],"#, 1);
    let corpus: [(&str, Vec<u8>, &str); 14] = [
        ("empty.glb", vec![], "0 bytes"),
        ("truncated.glb", sound[..sound.len() - 20].to_vec(), ""),
        ("header.glb", sound[..11].to_vec(), ""),
        ("magic.glb", [b"flTG", &sound[4..]].concat(), ""),
        ("cyclic.glb", glb(&gltf(cyclic, ACCESSOR), &corners()), "node"),
        ("long.glb", glb(&gltf(NODE, &long), &corners()), "accessor 0"),
        ("mesh.glb", glb(&gltf(r#"[{ "mesh": 7 }]"#, ACCESSOR), &corners()), ""),
        ("required.glb", glb(&required, &corners()), "EXT_no_such_thing"),
        ("json.gltf", b"{ \"asset\": ".to_vec(), ""),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nf 1 2 9\n".to_vec(), "line 3"),
        ("none.obj", b"v 0 0 0\n".to_vec(), "no triangles"),
        ("short.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\0\0".to_vec(), ""),
        ("short.stl", [&[0; 80][..], &[9, 0, 0, 0, 1, 2, 3]].concat(), ""),
        ("picture.jpg", b"\xff\xd8\xff\xe0".to_vec(), ".jpg"),
    ];
    for (name, content, place) in corpus {
        let file = folder.file(name, content);
        render(&folder, &file, 3).says(&[name, place]);
        folder.run(&["info", text(&file)]).expect(3).says(&[name]);
    }
}

#[test]
fn files_that_are_none_end_with_3() {
    let folder = Folder::new();
    render(&folder, &folder.path("missing.glb"), 3).says(&["missing.glb"]);
    let directory = folder.path("directory.glb");
    std::fs::create_dir(&directory).expect("a folder");
    render(&folder, &directory, 3).says(&["directory.glb", "directory"]);
    let camera = ["render", "--builtin", "blob-1k", "--camera-file"];
    folder.file("cameras.json", "{ \"a\": { \"eye\": [1, 2] } }");
    folder
        .run(&[&camera[..], &["missing.json"]].concat())
        .expect(3)
        .says(&["missing.json"]);
    folder
        .run(&[&camera[..], &["cameras.json"]].concat())
        .expect(3)
        .says(&["cameras.json", "line 1"]);
}

#[cfg(unix)]
#[test]
fn files_without_permission_end_with_3() {
    use std::os::unix::fs::PermissionsExt;

    let folder = Folder::new();
    let file = folder.file("closed.obj", "v 0 0 0\n");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o000)).expect("permissions");
    if std::fs::read(&file).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    render(&folder, &file, 3).says(&["closed.obj"]);
}

#[test]
fn absurd_sizes_end_without_taking_the_memory() {
    let folder = Folder::new();
    // Two to the 28 instances of each other's children cannot be written, but many nodes share one mesh of many
    // triangles: here 70,000 nodes times 65,535 triangles, above 2^32.
    let node = r#"{ "mesh": 0 },"#.repeat(69_999);
    let children: Vec<_> = (1..70_000).map(|i| i.to_string()).collect();
    let nodes = format!(
        r#"[{{ "children": [{}] }}, {} {{ "mesh": 0 }}]"#,
        children.join(","),
        &node[..node.len() - 14]
    );
    let indices = vec![0_u8; 65_535 * 3];
    let json = format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}], "nodes": {nodes},
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "indices": 1 }}] }}],
            "accessors": [{ACCESSOR}, {{ "bufferView": 1, "componentType": 5121, "count": {}, "type": "SCALAR" }}],
            "bufferViews": [{{ "buffer": 0, "byteLength": 36 }},
                {{ "buffer": 0, "byteOffset": 36, "byteLength": {} }}],
            "buffers": [{{ "byteLength": {} }}] }}"#,
        indices.len(),
        indices.len(),
        36 + indices.len()
    );
    let file = folder.file("instances.glb", glb(&json, &[corners(), indices].concat()));
    render(&folder, &file, 4).says(&["instances.glb", "limit"]);

    let huge = [
        "render",
        "--builtin",
        "blob-1k",
        "--resolution",
        "4000000000x4000000000",
    ];
    folder.run(&huge).expect(4).says(&["4000000000x4000000000"]);
    assert_eq!(folder.names(), ["instances.glb"]);
}

#[test]
fn names_in_files_do_not_command_the_terminal() {
    let folder = Folder::new();
    let named = gltf(r#"[{ "mesh": 0, "camera": 0 }]"#, ACCESSOR).replacen(
        '{',
        r#"{ "cameras": [{ "name": "\u001b[2J", "type": "perspective",
            "perspective": { "yfov": 1, "znear": 0.1 } }],"#,
        1,
    );
    let required = named.replacen('{', r#"{ "extensionsRequired": ["EXT_\u001b[2J"],"#, 1);
    for (name, json) in [("named.glb", named), ("required.glb", required)] {
        let file = folder.file(name, glb(&json, &corners()));
        for command in ["info", "render"] {
            let run = folder.run(&[command, text(&file)]);
            let said = String::from_utf8_lossy(&run.stdout).into_owned() + &run.stderr;
            assert!(!said.contains('\x1b') && said.contains("\\u{1b}[2J"), "{said}");
        }
    }
}

/// All files below a folder, sorted.
fn files_below(folder: PathBuf) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
            let path = entry.expect("a folder entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Broken files made by others. Needs `RAYWARD_SCENES`, the folder of the scenes.
#[test]
fn broken_files_of_others_end_with_0_3_or_4() {
    let Some(scenes) = std::env::var_os("RAYWARD_SCENES").filter(|value| !value.is_empty()) else {
        println!("skipped: RAYWARD_SCENES is not set");
        return;
    };
    let folder = Folder::new();
    let output = folder.path("out.png");
    for file in files_below(Path::new(&scenes).join("nasty")) {
        let run = folder.run(&[
            "render",
            text(&file),
            "--resolution",
            "16x12",
            "-o",
            text(&output),
        ]);
        let name = file.file_name().expect("a name").to_string_lossy();
        assert!(
            matches!(run.code, Some(0 | 3 | 4)),
            "{name}: {:?}, {}",
            run.code,
            run.stderr
        );
        assert_eq!(output.exists(), run.code == Some(0), "{name}");
        if run.code == Some(0) {
            std::fs::remove_file(&output).expect("the picture goes");
        } else {
            run.says(&[&name]);
        }
        let run = folder.run(&["compare", text(&file), text(&file)]);
        assert!(
            matches!(run.code, Some(0 | 3 | 4)),
            "{name}: {:?}, {}",
            run.code,
            run.stderr
        );
        assert!(folder.names().is_empty(), "{name} leaves {:?}", folder.names());
    }
}

#[test]
fn a_scene_without_a_usable_triangle_is_an_error() {
    let folder = Folder::new();
    let file = folder.file("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    let run = render(&folder, &file, 3);
    assert!(
        run.stderr.contains("flat.obj") && run.stderr.contains("1 without area"),
        "{}",
        run.stderr
    );
}
