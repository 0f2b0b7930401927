//! The built-in scenes keep what their table promises: names, counts, closedness, determinism, sane references.

use std::collections::HashMap;

use rayward_scene::{ChannelTarget, FrameGeometry, Scene, builtin};

fn scene(name: &str) -> Scene {
    builtin::build(name).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Corners welded to a tenth of a millimetre, in whatever part of the frame they are.
fn welded(frame: &FrameGeometry) -> Vec<[u32; 3]> {
    let mut known = HashMap::new();
    let mut weld = |i: u32| {
        let key = (frame.position(i) * 1e4).round().as_ivec3();
        let next = known.len() as u32;
        *known.entry(key).or_insert(next)
    };
    frame.indices.iter().map(|t| t.map(&mut weld)).collect()
}

/// Directed edges that do not have exactly one opposite.
fn unpaired_edges(triangles: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let mut uses: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *uses.entry(edge).or_default() += 1;
        }
    }
    let once = |edge: (u32, u32)| uses.get(&edge) == Some(&1);
    let mut bad: Vec<_> = uses
        .keys()
        .copied()
        .filter(|&(a, b)| !once((a, b)) || !once((b, a)))
        .collect();
    bad.sort_unstable();
    bad
}

/// Triangles that hang together by their corners.
fn components(triangles: &[[u32; 3]]) -> Vec<Vec<usize>> {
    let count = triangles.iter().flatten().max().map_or(0, |&m| m as usize + 1);
    let mut leader: Vec<usize> = (0..count).collect();
    fn find(leader: &mut [usize], mut v: usize) -> usize {
        while leader[v] != v {
            leader[v] = leader[leader[v]];
            v = leader[v];
        }
        v
    }
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (one, two) = (find(&mut leader, a as usize), find(&mut leader, other as usize));
            leader[one] = two;
        }
    }
    let mut parts: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, t) in triangles.iter().enumerate() {
        parts.entry(find(&mut leader, t[0] as usize)).or_default().push(i);
    }
    parts.into_values().collect()
}

/// Signed volume enclosed by some triangles, about their own first corner.
fn volume(frame: &FrameGeometry, triangles: impl Iterator<Item = usize>) -> f64 {
    let mut origin = None;
    let mut corner = |i: u32| {
        let p = frame.position(i).as_dvec3();
        p - *origin.get_or_insert(p)
    };
    triangles
        .map(|t| frame.indices[t].map(&mut corner))
        .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
        .sum()
}

#[test]
fn counts_are_those_of_the_paper() {
    let table = [
        ("courtyard", 31_000),
        ("forest", 174_000),
        ("office", 1_000),
        ("conference", 282_000),
        ("blob-1k", 1_000),
        ("blob-4k", 4_000),
        ("blob-16k", 16_000),
        ("blob-69k", 69_451),
        ("collide", 252_000),
        ("teapot-mirror", 16_000),
        ("walker", 1_700),
        ("solids", 1_116),
    ];
    let names: Vec<_> = table.iter().map(|row| row.0).collect();
    assert!(builtin::NAMES.iter().all(|n| names.contains(n)) && names.len() == builtin::NAMES.len());
    for (name, wanted) in table {
        let count = scene(name).at(0.0).triangle_count();
        assert!(
            count.abs_diff(wanted) * 50 <= wanted,
            "{name}: {count} triangles, not {wanted} within 2 %"
        );
    }
}

#[test]
fn an_unknown_name_is_an_error_that_lists_the_known_ones() {
    let message = builtin::build("ballroom").map(|_| ()).unwrap_err().to_string();
    assert!(
        message.contains("ballroom") && message.contains("courtyard"),
        "{message}"
    );
}

#[test]
fn no_triangle_is_dropped_at_any_time() {
    for name in builtin::NAMES {
        let scene = scene(name);
        for step in 0..4 {
            let frame = scene.at(step as f32 * 0.31);
            assert_eq!(
                (frame.dropped_non_finite, frame.dropped_degenerate),
                (0, 0),
                "{name} at step {step}"
            );
        }
    }
}

#[test]
fn the_same_name_gives_the_same_scene() {
    for name in builtin::NAMES {
        assert_eq!(
            format!("{:?}", scene(name)),
            format!("{:?}", scene(name)),
            "{name}"
        );
    }
}

#[test]
fn every_reference_is_in_range_and_parents_come_first() {
    for name in builtin::NAMES {
        let scene = scene(name);
        for (i, node) in scene.nodes.iter().enumerate() {
            assert!(node.parent.is_none_or(|p| p < i), "{name}: parent of node {i}");
            assert!(
                node.mesh.is_none_or(|m| m < scene.meshes.len()),
                "{name}: mesh of node {i}"
            );
            assert!(
                node.solid.is_none_or(|s| s < scene.solids.len()),
                "{name}: solid of node {i}"
            );
            assert!(
                node.skin.is_none_or(|s| s < scene.skins.len()),
                "{name}: skin of node {i}"
            );
            assert!(
                node.camera.is_none_or(|c| c < scene.cameras.len()),
                "{name}: camera of node {i}"
            );
            assert!(
                node.light.is_none_or(|l| l < scene.lights.len()),
                "{name}: light of node {i}"
            );
        }
        for primitive in scene.meshes.iter().flat_map(|m| &m.primitives) {
            let count = primitive.positions.len();
            assert!(primitive.material < scene.materials.len(), "{name}: material");
            assert!(
                primitive
                    .triangles
                    .iter()
                    .flatten()
                    .all(|&i| (i as usize) < count),
                "{name}: corner"
            );
            assert_eq!(primitive.normals.len(), count, "{name}: normals");
            assert!(
                primitive.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-4),
                "{name}: normal length"
            );
        }
        for channel in scene.animations.iter().flat_map(|a| &a.channels) {
            assert!(channel.node < scene.nodes.len(), "{name}: channel");
            assert!(channel.times.is_sorted_by(|a, b| a < b), "{name}: key times");
            let keys = match &channel.target {
                ChannelTarget::Translation(values) | ChannelTarget::Scale(values) => values.len(),
                ChannelTarget::Rotation(values) => values.len(),
                ChannelTarget::Weights { targets, values } => values.len() / targets,
            };
            assert_eq!(keys, channel.times.len(), "{name}: keys");
        }
    }
}

#[test]
fn every_scene_has_a_camera_and_a_light() {
    for name in builtin::NAMES {
        let frame = scene(name).at(0.0);
        assert!(!frame.cameras.is_empty() && !frame.lights.is_empty(), "{name}");
    }
}

#[test]
fn closed_scenes_are_closed_when_posed() {
    let mut open = Vec::new();
    for name in builtin::NAMES.iter().filter(|n| **n != "forest") {
        let frame = scene(name).at(0.4);
        let triangles = welded(&frame);
        let bad = unpaired_edges(&triangles);
        let places: Vec<_> = frame
            .objects
            .iter()
            .filter(|o| {
                let own = &triangles[o.triangles.start as usize..o.triangles.end as usize];
                own.iter().any(|&[a, b, c]| {
                    [(a, b), (b, c), (c, a)]
                        .iter()
                        .any(|edge| bad.binary_search(edge).is_ok())
                })
            })
            .map(|o| scene(name).nodes[o.node as usize].name.clone())
            .collect();
        if !bad.is_empty() {
            open.push(format!(
                "{name}: {} edges without one opposite, in {places:?}",
                bad.len()
            ));
        }
    }
    assert!(open.is_empty(), "{open:#?}");
}

#[test]
fn closed_components_face_outward() {
    for name in builtin::NAMES.iter().filter(|n| **n != "forest") {
        let scene = scene(name);
        let frame = scene.at(0.4);
        let components = components(&welded(&frame));
        for triangles in components {
            let first = triangles[0];
            let volume = volume(&frame, triangles.into_iter());
            let object = frame
                .objects
                .iter()
                .find(|o| o.triangles.contains(&(first as u32)));
            let node = object.map(|o| &scene.nodes[o.node as usize].name);
            assert!(volume > 0.0, "{name}: a part of {node:?} has volume {volume}");
        }
    }
}

#[test]
fn the_forest_spans_a_huge_range_of_triangle_sizes() {
    let frame = scene("forest").at(0.0);
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| frame.position(i));
        (b - a).cross(c - a).length() / 2.0
    };
    let mut areas: Vec<f32> = frame.indices.iter().map(area).collect();
    areas.sort_unstable_by(f32::total_cmp);
    let ratio = areas[areas.len() - 1] / areas[areas.len() / 100];
    assert!(ratio > 1e5, "largest over first percentile: {ratio}");
}

#[test]
fn the_collision_comes_and_goes() {
    let scene = scene("collide");
    let gap = |time: f32| {
        let frame = scene.at(time);
        let reach = |object: usize, pick: fn(f32, f32) -> f32, start: f32| {
            let range = frame.objects[object].vertices.clone();
            range.map(|v| frame.x[v as usize]).fold(start, pick)
        };
        reach(1, f32::min, f32::INFINITY) - reach(0, f32::max, f32::NEG_INFINITY)
    };
    assert_eq!(scene.animations[0].duration(), 4.0);
    assert!(
        gap(0.0) > 0.5 && gap(4.0) > 0.5,
        "apart at both ends: {} {}",
        gap(0.0),
        gap(4.0)
    );
    assert!(gap(2.0) < 0.02, "in contact in between: {}", gap(2.0));
}

#[test]
fn the_walker_loops_and_keeps_its_feet_on_the_ground() {
    let scene = scene("walker");
    let duration = scene.animations[0].duration();
    let (first, last) = (scene.at(0.0), scene.at(duration));
    let moved = (0..first.x.len() as u32).map(|i| first.position(i).distance(last.position(i)));
    assert!(moved.fold(0.0, f32::max) < 1e-3, "the last frame is the first");
    let body = first
        .objects
        .iter()
        .filter(|o| scene.nodes[o.node as usize].skin.is_some());
    let vertices: Vec<u32> = body.flat_map(|o| o.vertices.clone()).collect();
    assert!(!vertices.is_empty());
    for step in 0..20 {
        let frame = scene.at(duration * step as f32 / 20.0);
        let lowest = vertices
            .iter()
            .map(|&v| frame.y[v as usize])
            .fold(f32::INFINITY, f32::min);
        assert!(lowest.abs() < 0.03, "step {step}: lowest point at {lowest} m");
    }
    for primitive in scene.meshes.iter().flat_map(|m| &m.primitives) {
        for weights in &primitive.weights {
            assert!((weights.element_sum() - 1.0).abs() < 1e-5 && weights.min_element() >= 0.0);
        }
    }
}
