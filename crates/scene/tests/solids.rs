//! Solids in glTF files: what is read, how it is posed, and what is refused.

use glam::DVec3;
use rayward_scene::{Error, LoadOptions, Scene, Shape, UpAxis, load};

fn read_with(text: &str, options: &LoadOptions) -> Result<Scene, Error> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("solids.gltf");
    std::fs::write(&path, text).expect("it is written");
    load(&path, options)
}

/// A file with these nodes; each has an extra node above it that scales by 2.
fn file(node: &str, more: &str) -> String {
    format!(
        r#"{{ "asset": {{ "version": "2.0" }}, "scene": 0, "scenes": [{{ "nodes": [0] }}],
        "materials": [{{ "name": "plain" }}, {{ "name": "see-through", "alphaMode": "BLEND" }},
            {{ "name": "wood", "pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 }} }} }}],
        "textures": [{{ "source": 0 }}],
        "images": [{{ "uri": "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNkYPhfDwAChwGA60e6kgAAAABJRU5ErkJggg==" }}],
        "nodes": [{{ "scale": [2, 2, 2], "children": [1] {more} }}, {node}] }}"#
    )
}

fn solid(content: &str) -> String {
    file(
        &format!(
            r#"{{ "name": "thing", "translation": [1, 0, 0], "extras": {{ "rayward_solid": {content} }} }}"#
        ),
        "",
    )
}

#[test]
fn shapes_are_read_and_posed() {
    let text = solid(
        r#"{ "material": 0, "shape": { "difference": [
            { "union": [ { "sphere": { "radius": 0.5 } },
                         { "capsule": { "from": [0, 0, 0], "to": [0, 1, 0], "radius": 0.25 } } ] },
            { "intersection": [ { "cylinder": { "from": [0, -1, 0], "to": [0, 1, 0], "radius": 0.1 } },
                                { "box": { "min": [-1, -1, -1], "max": [1, 2, 3] } } ] } ] } }"#,
    );
    let scene = read_with(&text, &LoadOptions::default()).expect("it is valid");
    assert_eq!((scene.solids.len(), scene.solids[0].material), (1, 1));
    assert_eq!(scene.materials[1].name, "plain");
    assert_eq!(scene.solids[0].shape.leaf_count(), 4);
    let frame = scene.at(0.0);
    assert!(!frame.is_empty() && frame.triangle_count() == 0);
    assert_eq!((frame.solids[0].material, frame.solids[0].node), (1, 1));
    let Shape::Difference(parts) = &frame.solids[0].shape else {
        panic!("{:?}", frame.solids[0]);
    };
    let at = DVec3::X * 2.0;
    assert_eq!(
        parts[0],
        Shape::Union(vec![
            Shape::Sphere {
                center: at,
                radius: 1.0
            },
            Shape::Capsule {
                from: at,
                to: at + DVec3::Y * 2.0,
                radius: 0.5
            },
        ])
    );
    assert_eq!(
        parts[1],
        Shape::Intersection(vec![
            Shape::Cylinder {
                from: at - DVec3::Y * 2.0,
                to: at + DVec3::Y * 2.0,
                radius: 0.2
            },
            Shape::Box {
                center: at + DVec3::new(0.0, 1.0, 2.0),
                half: [DVec3::X * 2.0, DVec3::Y * 3.0, DVec3::Z * 4.0],
            },
        ])
    );
    let (low, high) = frame.bounds().expect("a box");
    assert!((low.as_dvec3() - DVec3::new(1.0, -1.0, -1.0)).length() < 1e-6);
    assert!((high.as_dvec3() - DVec3::new(3.0, 2.5, 1.0)).length() < 1e-6);
}

#[test]
fn the_options_turn_and_scale_solids_too() {
    let text = solid(r#"{ "shape": { "box": { "min": [0, 0, 0], "max": [1, 2, 4] } } }"#);
    let options = LoadOptions {
        up: UpAxis::Z,
        scale: 0.5,
    };
    let scene = read_with(&text, &options).expect("it is valid");
    assert_eq!(scene.solids[0].material, 0);
    let (low, high) = scene.at(0.0).bounds().expect("a box");
    // Scaled by 2 and 0.5; y goes to -z, z to y.
    assert!(
        (low.as_dvec3() - DVec3::new(1.0, 0.0, -2.0)).length() < 1e-6,
        "{low}"
    );
    assert!(
        (high.as_dvec3() - DVec3::new(2.0, 4.0, 0.0)).length() < 1e-6,
        "{high}"
    );
}

fn fails(text: &str, words: &[&str]) {
    let message = match read_with(text, &LoadOptions::default()) {
        Ok(_) => panic!("it was read: {text}"),
        Err(error @ (Error::Malformed { .. } | Error::TooLarge { .. })) => error.to_string(),
        Err(error) => panic!("{error}"),
    };
    for word in words.iter().chain(&["solids.gltf", "thing", "rayward_solid"]) {
        assert!(message.contains(word), "no {word:?} in {message:?}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    fails(&solid("3"), &["invalid type"]);
    fails(&solid("{}"), &["shape"]);
    fails(&solid(r#"{ "shape": { "torus": {} } }"#), &["torus", "sphere"]);
    fails(&solid(r#"{ "shape": { "sphere": {} } }"#), &["radius"]);
    fails(
        &solid(r#"{ "shape": { "sphere": { "radius": 1, "size": 2 } } }"#),
        &["size"],
    );
    fails(
        &solid(r#"{ "shape": { "sphere": { "radius": -1 } } }"#),
        &["radius", "-1", "above 0"],
    );
    fails(
        &solid(r#"{ "shape": { "cylinder": { "from": [1, 1, 1], "to": [1, 1, 1], "radius": 1 } } }"#),
        &["cylinder", "one place"],
    );
    fails(
        &solid(r#"{ "shape": { "box": { "min": [0, 0, 0], "max": [1, 0, 1] } } }"#),
        &["box", "below"],
    );
    fails(&solid(r#"{ "shape": { "union": [] } }"#), &["union", "empty"]);
    fails(
        &solid(r#"{ "material": 3, "shape": { "sphere": { "radius": 1 } } }"#),
        &["material 3", "are 3"],
    );
    fails(
        &solid(r#"{ "material": 1, "shape": { "sphere": { "radius": 1 } } }"#),
        &["OPAQUE"],
    );
    fails(
        &solid(r#"{ "material": 2, "shape": { "sphere": { "radius": 1 } } }"#),
        &["textures"],
    );
    let many = vec![r#"{ "sphere": { "radius": 1 } }"#; 5000].join(",");
    fails(
        &solid(&format!(r#"{{ "shape": {{ "union": [{many}] }} }}"#)),
        &["5000", "4096"],
    );
}

#[test]
fn unequal_scale_is_refused_wherever_it_comes_from() {
    let sphere = r#""extras": { "rayward_solid": { "shape": { "sphere": { "radius": 1 } } } }"#;
    let thing = |more: &str| format!(r#"{{ "name": "thing", {sphere} {more} }}"#);
    fails(&file(&thing(r#", "scale": [1, 2, 1]"#), ""), &["unequally"]);
    let shear = r#", "matrix": [1,0,0,0, 0.5,1,0,0, 0,0,1,0, 0,0,0,1]"#;
    fails(&file(&thing(shear), ""), &["shears"]);
    let mirrored = r#", "matrix": [0,2,0,0, 2,0,0,0, 0,0,2,0, 0,0,0,1]"#;
    assert!(read_with(&file(&thing(mirrored), ""), &LoadOptions::default()).is_ok());
    let above = file(&thing(""), r#", "name": "wide""#).replace("[2, 2, 2]", "[2, 2, 3]");
    fails(&above, &["\"wide\"", "unequally"]);
}

#[test]
fn other_extras_are_nobody_s_business() {
    for extras in [
        "3",
        r#""text""#,
        r#"{ "solid": true }"#,
        "[1]",
        r#"{ "rayward_solid": null }"#,
    ] {
        let node = format!(r#"{{ "name": "thing", "extras": {extras} }}"#);
        match read_with(&file(&node, ""), &LoadOptions::default()) {
            Err(Error::Empty { .. }) => {}
            other => panic!("{extras}: {:?}", other.map(|_| ())),
        }
    }
}
