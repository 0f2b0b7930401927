//! Camera files, and the camera and light made up where a scene has none.

use std::collections::BTreeMap;
use std::f32::consts::PI;
use std::path::Path;

use glam::{DVec3, Vec3};
use rayward_scene::{
    CameraEntry, Error, FrameGeometry, LightKind, PosedCamera, Projection, default_camera, default_lights,
    find_camera, read_camera_file,
};

fn read(text: &str) -> Result<BTreeMap<String, CameraEntry>, Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cameras.json");
    std::fs::write(&path, text).unwrap();
    read_camera_file(&path)
}

const TWO: &str = r#"{
    "low": { "file": "bench/pot.ply", "triangles": 12, "eye": [0, 0, 5], "target": [0, 0, 0], "remark": "any",
             "up": [0, 1, 1], "vfov_deg": 60, "point_light": [3, 0, 0],
             "area_light": { "center": [0, 2, 0], "edge_u": [0.5, 0, 0], "edge_v": [0, 0, 0.2] } },
    "high": { "eye": [1, 2, 3], "target": [1, 2, 4.5] } }"#;

#[test]
fn entries_are_found_by_file_then_by_stem() {
    let entries = read(TWO).unwrap();
    assert_eq!(entries["low"].triangles, Some(12));
    let eye = |path: &str| find_camera(&entries, Path::new(path)).map(|e| e.eye.z);
    assert_eq!(eye("/scenes/bench/pot.ply"), Some(5.0));
    assert_eq!(eye("elsewhere/high.glb"), Some(3.0));
    assert_eq!(eye("elsewhere/low.ply"), Some(5.0));
    assert_eq!(eye("workbench/pot.ply"), None);
}

#[test]
fn an_entry_gives_camera_and_lights() {
    let entries = read(TWO).unwrap();
    let camera = entries["low"].camera();
    assert_eq!((camera.eye, camera.forward), (DVec3::Z * 5.0, DVec3::NEG_Z));
    assert!(
        camera.up.distance(DVec3::Y) < 1e-12,
        "up is made perpendicular: {}",
        camera.up
    );
    assert_eq!(
        camera.projection,
        Projection::Perspective {
            vfov: 60f64.to_radians(),
            aspect: None
        }
    );

    let lights = entries["low"].lights();
    let [point, area] = &lights[..] else {
        panic!("{lights:?}")
    };
    assert_eq!(point.kind, LightKind::Point { radius: 0.0 });
    // Irradiance = intensity / distance squared.
    assert!((point.power.x / 9.0 - PI).abs() < 1e-5);
    assert_eq!(
        area.kind,
        LightKind::Rectangle {
            width: 0.5,
            height: 0.2
        }
    );
    // u x v points down, at the centre; irradiance = radiance * area / distance squared.
    assert!(area.direction.distance(DVec3::NEG_Y) < 1e-12);
    assert!(area.axis_x.cross(area.axis_y).distance(-area.direction) < 1e-12);
    assert!((area.power.x * 0.1 / 4.0 - PI).abs() < 1e-5);
    assert!(entries["high"].lights().is_empty());
}

#[test]
fn broken_camera_files_name_the_place() {
    for (text, place) in [
        (
            "{\n \"a\": { \"eye\": [0, 0], \"target\": [0, 0, 0] } }",
            "line 2",
        ),
        ("{ \"a\": { \"eye\": [0, 0, 1] } }", "`target`"),
        (
            "{ \"a\": { \"eye\": [0, 0, 1], \"target\": [0, 0, 1] } }",
            "scene \"a\"",
        ),
        (
            "{ \"a\": { \"eye\": [0, 0, 1], \"target\": [0, 0, 0], \"vfov_deg\": 180 } }",
            "vfov_deg",
        ),
        ("", "line 1"),
    ] {
        let error = read(text).unwrap_err();
        assert!(matches!(error, Error::Malformed { .. }), "{error:?}");
        assert!(error.to_string().contains(place), "{error} lacks {place}");
    }
    assert!(matches!(
        read_camera_file(Path::new("no such file")),
        Err(Error::Io { .. })
    ));
}

#[test]
fn local_camera_file_fits_its_scenes() {
    let Some(root) = std::env::var_os("RAYWARD_SCENES").filter(|value| !value.is_empty()) else {
        println!("skipped: RAYWARD_SCENES is not set");
        return;
    };
    let entries = read_camera_file(&Path::new(&root).join("cameras.json")).unwrap();
    assert!(entries.len() > 10);
    for entry in entries.values() {
        let path = Path::new(&root).join(entry.file.as_ref().unwrap());
        assert!(path.is_file(), "{}", path.display());
        assert_eq!(find_camera(&entries, &path).unwrap().file, entry.file);
    }
}

fn frame_of(corners: &[Vec3], origin: DVec3) -> FrameGeometry {
    FrameGeometry {
        origin,
        x: corners.iter().map(|p| p.x).collect(),
        y: corners.iter().map(|p| p.y).collect(),
        z: corners.iter().map(|p| p.z).collect(),
        indices: (0..corners.len() as u32).map(|i| [i, i, i]).collect(),
        ..FrameGeometry::default()
    }
}

/// Largest share of the half view, in x or y, at which any of the points is seen.
fn extent(camera: &PosedCamera, aspect: f64, points: &[DVec3]) -> f64 {
    let Projection::Perspective { vfov, .. } = camera.projection else {
        panic!()
    };
    let right = camera.forward.cross(camera.up);
    let tan = (vfov / 2.0).tan();
    let share = |p: &DVec3| {
        let d = *p - camera.eye;
        let depth = d.dot(camera.forward);
        assert!(depth > 0.0, "{p} is behind the camera");
        (d.dot(right).abs() / (depth * tan * aspect)).max(d.dot(camera.up).abs() / (depth * tan))
    };
    points.iter().map(share).fold(0.0, f64::max)
}

#[test]
fn the_made_up_camera_fills_the_view_and_no_more() {
    let box_of = |half: Vec3| -> Vec<Vec3> {
        (0..8)
            .map(|i| half * (Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0))
            .collect()
    };
    for origin in [DVec3::ZERO, DVec3::new(1e7, 0.0, -3e6)] {
        for half in [
            Vec3::ONE,
            Vec3::new(5.0, 0.0, 5.0),
            Vec3::new(0.0, 1e-3, 0.0),
            Vec3::new(1.0, 1e4, 1.0),
        ] {
            for aspect in [0.5, 1.0, 1.6] {
                let corners = box_of(half);
                let camera = default_camera(&frame_of(&corners, origin), aspect);
                let points: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() + origin).collect();
                let share = extent(&camera, aspect, &points);
                assert!(
                    (share - 0.9).abs() < 1e-3,
                    "{half} at aspect {aspect} fills {share}"
                );
            }
        }
    }
}

#[test]
fn the_made_up_camera_is_front_right_above_and_never_broken() {
    let scenes = [frame_of(&[], DVec3::ZERO), frame_of(&[Vec3::ONE], DVec3::ZERO)];
    for (frame, center) in scenes.iter().zip([DVec3::ZERO, DVec3::ONE]) {
        for aspect in [1.5, 0.0, f64::NAN] {
            let camera = default_camera(frame, aspect);
            let from = camera.eye - center;
            assert!(
                from.is_finite() && from.x > 0.0 && from.y > 0.0 && from.z > from.x,
                "{from}"
            );
            assert!(camera.forward.dot(camera.up).abs() < 1e-12 && camera.up.y > 0.9);
        }
    }
}

#[test]
fn the_made_up_light_comes_from_the_upper_left() {
    let camera = default_camera(&frame_of(&[], DVec3::ZERO), 1.0);
    let [light] = &default_lights(&camera)[..] else {
        panic!()
    };
    let right = camera.forward.cross(camera.up);
    assert!(light.direction.dot(right) > 0.2 && light.direction.dot(camera.up) < -0.2);
    assert!(
        light.direction.dot(camera.forward) > 0.2,
        "it lights what the camera sees"
    );
    assert!((light.power.x / PI - 0.9).abs() < 1e-6);
    assert_eq!(light.kind, LightKind::Directional { half_angle: 0.0 });
}
