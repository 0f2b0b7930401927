//! Posing against closed forms: transforms, mirroring, animation, morphing, skinning, origin, threads.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{DMat4, DQuat, DVec3, Mat4, Quat, Vec3, Vec4};
use rayward_scene::{
    Animation, Camera, Channel, ChannelTarget, FrameGeometry, Interpolation, Light, LightKind, Material,
    Mesh, MorphTarget, Node, Primitive, Projection, Scene, Skin, Transform,
};

const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn triangle() -> Primitive {
    Primitive {
        positions: CORNERS.to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Primitive::default()
    }
}

fn scene_of(primitive: Primitive, nodes: Vec<Node>) -> Scene {
    Scene {
        nodes,
        meshes: vec![Mesh {
            primitives: vec![primitive],
            ..Mesh::default()
        }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

fn at(transform: Transform) -> Node {
    Node {
        mesh: Some(0),
        transform,
        ..Node::default()
    }
}

fn moved(translation: DVec3) -> Transform {
    Transform::Trs {
        translation,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
    }
}

fn scaled(scale: DVec3) -> Transform {
    Transform::Matrix(DMat4::from_scale(scale))
}

fn position(frame: &FrameGeometry, vertex: u32) -> Vec3 {
    (frame.position(vertex).as_dvec3() + frame.origin).as_vec3()
}

fn geometric_normal(frame: &FrameGeometry, triangle: usize) -> Vec3 {
    let [a, b, c] = frame.indices[triangle].map(|i| frame.position(i));
    (b - a).cross(c - a).normalize()
}

/// One node, driven by one channel of keys at 1 and 3 seconds.
fn animated(interpolation: Interpolation, target: ChannelTarget) -> Scene {
    let mut scene = scene_of(triangle(), vec![at(Transform::default())]);
    let channel = Channel {
        node: 0,
        times: vec![1.0, 3.0],
        interpolation,
        target,
    };
    scene.animations = vec![Animation {
        channels: vec![channel],
        ..Animation::default()
    }];
    scene
}

#[test]
fn children_follow_their_parents() {
    let turn = Transform::Trs {
        translation: DVec3::new(10.0, 0.0, 0.0),
        rotation: DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2),
        scale: DVec3::splat(2.0),
    };
    let parent = Node {
        transform: turn,
        ..Node::default()
    };
    let child = Node {
        parent: Some(0),
        ..at(moved(DVec3::new(1.0, 0.0, 0.0)))
    };
    let frame = scene_of(triangle(), vec![parent, child]).at(0.0);
    // (1, 0, 0) is moved to (2, 0, 0), doubled, turned to (0, 4, 0) and moved to (10, 4, 0).
    assert!(position(&frame, 1).distance(Vec3::new(10.0, 4.0, 0.0)) < 1e-6);
    assert_eq!((frame.objects.len(), frame.objects[0].node), (1, 1));
}

#[test]
fn mirroring_keeps_the_front_in_front() {
    let mut primitive = triangle();
    primitive.normals = vec![Vec3::Z; 3];
    primitive.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 3];
    for scale in [
        DVec3::ONE,
        DVec3::new(-1., 1., 1.),
        DVec3::new(1., 1., -3.),
        DVec3::splat(-2.),
    ] {
        let frame = scene_of(primitive.clone(), vec![at(scaled(scale))]).at(0.0);
        let facing = Vec3::Z * scale.z.signum() as f32;
        assert_eq!(geometric_normal(&frame, 0), facing, "winding under {scale}");
        assert_eq!(frame.attributes.normals[0], facing, "normal under {scale}");
        // The bitangent stays the direction in which v grows: +Y of the mesh.
        let tangent = frame.attributes.tangents[0];
        let bitangent = facing.cross(tangent.truncate()) * tangent.w;
        assert_eq!(
            bitangent,
            Vec3::Y * scale.y.signum() as f32,
            "tangent under {scale}"
        );
    }
}

#[test]
fn normals_take_the_inverse_transpose() {
    let mut primitive = triangle();
    primitive.normals = vec![Vec3::new(1.0, 1.0, 0.0).normalize(); 3];
    let frame = scene_of(primitive.clone(), vec![at(scaled(DVec3::new(2.0, 1.0, 1.0)))]).at(0.0);
    assert!(frame.attributes.normals[0].distance(Vec3::new(1.0, 2.0, 0.0).normalize()) < 1e-6);
    // A flattening transform has no inverse; the direction is still defined.
    primitive.normals = vec![Vec3::new(0.0, 0.6, 0.8); 3];
    let frame = scene_of(primitive, vec![at(scaled(DVec3::new(1.0, 1.0, 0.0)))]).at(0.0);
    assert_eq!(frame.attributes.normals[0], Vec3::Z);
}

#[test]
fn keys_are_interpolated_as_gltf_says_and_clamped() {
    let x = |scene: &Scene, time: f32| f64::from(position(&scene.at(time), 0).x);
    let keys = vec![Vec3::X * 2.0, Vec3::X * 6.0];
    let linear = animated(Interpolation::Linear, ChannelTarget::Translation(keys.clone()));
    let step = animated(Interpolation::Step, ChannelTarget::Translation(keys));
    for (time, on_line, on_step) in [
        (-1.0, 2.0, 2.0),
        (1.0, 2.0, 2.0),
        (1.5, 3.0, 2.0),
        (2.999, 5.998, 2.0),
        (3.0, 6.0, 6.0),
        (9.0, 6.0, 6.0),
    ] {
        assert!((x(&linear, time) - on_line).abs() < 1e-5, "linear at {time}");
        assert_eq!(x(&step, time), on_step, "step at {time}");
    }
    assert_eq!(x(&linear, f32::NAN), 2.0);

    // in-tangent, value, out-tangent of each key. With p = 2, 6, m = 3 at the start and -1 at the end over 2 s,
    // at the middle: (p0 + p1) / 2 + 2 (m0 - m1) / 8 = 5.
    let spline = [9.0, 2.0, 3.0, -1.0, 6.0, 9.0].map(|v| Vec3::X * v).to_vec();
    let spline = animated(Interpolation::CubicSpline, ChannelTarget::Translation(spline));
    for (time, expected) in [(0.0, 2.0), (1.0, 2.0), (2.0, 5.0), (3.0, 6.0), (4.0, 6.0)] {
        assert!(
            (x(&spline, time) - expected).abs() < 1e-6,
            "spline at {time}: {}",
            x(&spline, time)
        );
    }
}

#[test]
fn rotations_take_the_shorter_arc_at_constant_speed() {
    // A quarter turn, the end given as the opposite quaternion: the long way round would be three quarters.
    let end = Quat::from_xyzw(0.0, 0.0, -FRAC_1_SQRT_2, -FRAC_1_SQRT_2);
    let scene = animated(
        Interpolation::Linear,
        ChannelTarget::Rotation(vec![Quat::IDENTITY, end]),
    );
    for (time, degrees) in [(1.0, 0.0f32), (1.5, 22.5), (2.0, 45.0), (3.0, 90.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let tip = position(&scene.at(time), 1);
        assert!(tip.distance(Vec3::new(cos, sin, 0.0)) < 1e-6, "at {time}: {tip}");
    }
}

#[test]
fn animations_are_chosen_and_leave_other_properties_alone() {
    let mut scene = animated(
        Interpolation::Linear,
        ChannelTarget::Scale(vec![Vec3::ONE, Vec3::splat(3.0)]),
    );
    scene.nodes[0].transform = moved(DVec3::Z);
    assert_eq!(position(&scene.at(3.0), 1), Vec3::new(3.0, 0.0, 1.0));
    let mut frame = FrameGeometry::default();
    for rest in [None, Some(1)] {
        scene.at_animation(rest, 3.0, &mut frame);
        assert_eq!(position(&frame, 1), Vec3::new(1.0, 0.0, 1.0));
    }
    // A matrix is taken apart when a channel drives it.
    scene.nodes[0].transform = Transform::Matrix(DMat4::from_translation(DVec3::Z));
    assert!(position(&scene.at(3.0), 1).distance(Vec3::new(3.0, 0.0, 1.0)) < 1e-6);
}

#[test]
fn morph_targets_add_up_with_their_weights() {
    let mut primitive = triangle();
    primitive.normals = vec![Vec3::Z; 3];
    let target = |v: Vec3| MorphTarget {
        positions: vec![v; 3],
        ..MorphTarget::default()
    };
    primitive.morph_targets = vec![target(Vec3::X), target(Vec3::Y)];
    primitive.morph_targets[0].normals = vec![Vec3::X; 3];
    let mut scene = scene_of(primitive, vec![at(Transform::default())]);
    scene.meshes[0].weights = vec![0.5, 2.0];
    assert_eq!(position(&scene.at(0.0), 0), Vec3::new(0.5, 2.0, 0.0));
    assert!(scene.at(0.0).attributes.normals[0].distance(Vec3::new(0.5, 0.0, 1.0).normalize()) < 1e-6);
    scene.nodes[0].weights = vec![1.0, 0.0];
    assert_eq!(
        position(&scene.at(0.0), 0),
        Vec3::X,
        "a node's weights replace the mesh's"
    );
    let values = vec![0.0, 1.0, 4.0, 3.0];
    let target = ChannelTarget::Weights { targets: 2, values };
    scene.animations = animated(Interpolation::Linear, target).animations;
    assert_eq!(position(&scene.at(2.0), 0), Vec3::new(2.0, 2.0, 0.0));
}

/// A triangle on two joints: corner 0 on the first, corner 1 on the second, corner 2 on both.
fn skinned() -> Scene {
    let mut primitive = triangle();
    primitive.joints = vec![[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]];
    primitive.weights = vec![Vec4::X, Vec4::X, Vec4::new(0.5, 0.5, 0.0, 0.0)];
    let joint = |translation| Node {
        transform: moved(translation),
        ..Node::default()
    };
    let far = Node {
        skin: Some(0),
        ..at(moved(DVec3::splat(100.0)))
    };
    let mut scene = scene_of(
        primitive,
        vec![joint(DVec3::ZERO), joint(DVec3::new(0.0, 0.0, 3.0)), far],
    );
    let bind = Mat4::from_translation(Vec3::new(0.0, 0.0, -1.0));
    scene.skins = vec![Skin {
        joints: vec![0, 1],
        inverse_bind: vec![Mat4::IDENTITY, bind],
        ..Skin::default()
    }];
    scene
}

#[test]
fn skins_blend_joints_and_ignore_the_node() {
    let frame = skinned().at(0.0);
    assert_eq!(position(&frame, 0), Vec3::ZERO);
    assert_eq!(position(&frame, 1), Vec3::new(1.0, 0.0, 2.0));
    assert_eq!(position(&frame, 2), Vec3::new(0.0, 1.0, 1.0));
}

/// Whether what moves vertices gives the frame's positions, but for the last bit.
fn assert_motions_match(scene: &Scene, time: f32) {
    let frame = scene.at(time);
    let mut vertex = 0;
    for motion in scene.motions(Some(0), time) {
        for v in 0..motion.primitive.positions.len() {
            let local = motion.local(v);
            let moved = motion
                .influences(v)
                .into_iter()
                .filter(|(_, weight)| *weight != 0.0)
                .map(|(joint, weight)| motion.matrices[joint].transform_point3(local) * weight)
                .sum::<DVec3>();
            let error = moved.as_vec3().distance(frame.position(vertex));
            assert!(
                error <= 2e-7 * moved.length() as f32 + 1e-7,
                "{} at {time}, vertex {vertex}: off by {error}",
                scene.name
            );
            vertex += 1;
        }
    }
    assert_eq!(vertex as usize, frame.x.len());
}

#[test]
fn motions_take_vertices_where_frames_have_them() {
    let mut morphed = skinned();
    morphed.meshes[0].primitives[0].morph_targets = vec![MorphTarget {
        positions: vec![Vec3::X, Vec3::Y, Vec3::NEG_Z],
        ..MorphTarget::default()
    }];
    morphed.meshes[0].weights = vec![0.25];
    morphed.nodes.push(at(moved(DVec3::new(0.0, 7.0, 0.0))));
    assert!(morphed.motions(None, 0.0)[0].skinned && !morphed.motions(None, 0.0)[1].skinned);
    assert_motions_match(&morphed, 0.0);
    let far = scene_of(triangle(), vec![at(moved(DVec3::splat(1e6)))]);
    assert_motions_match(&far, 0.0);
    for name in ["walker", "courtyard"] {
        let scene = rayward_scene::builtin::build(name).expect("a built-in scene");
        for time in [0.0, 0.37, 1.9] {
            assert_motions_match(&scene, time);
        }
    }
}

#[test]
fn mirrored_joints_turn_the_winding() {
    let mut scene = skinned();
    let front = geometric_normal(&scene.at(0.0), 0);
    let mirror = Node {
        transform: scaled(DVec3::new(-1.0, 1.0, 1.0)),
        ..Node::default()
    };
    scene.nodes.insert(0, mirror);
    scene.nodes[1].parent = Some(0);
    scene.nodes[2].parent = Some(0);
    scene.skins[0].joints = vec![1, 2];
    let mirrored = geometric_normal(&scene.at(0.0), 0);
    assert!(
        mirrored.distance(front * Vec3::new(-1.0, 1.0, 1.0)) < 1e-6,
        "{mirrored} from {front}"
    );
}

#[test]
fn triangles_that_cannot_be_hit_are_dropped_and_counted() {
    let mut primitive = triangle();
    primitive.positions.extend([
        Vec3::new(f32::NAN, 0.0, 0.0),
        Vec3::X * 2.0,
        Vec3::Y * f32::INFINITY,
    ]);
    let keep = [0, 1, 2];
    primitive.triangles = vec![keep, [0, 1, 3], [0, 1, 4], keep, [1, 1, 2], [0, 5, 1], keep];
    let nodes = vec![
        at(Transform::default()),
        at(scaled(DVec3::ZERO)),
        at(moved(DVec3::Z)),
    ];
    let frame = scene_of(primitive, nodes).at(0.0);
    assert_eq!(
        (frame.dropped_non_finite, frame.dropped_degenerate),
        (6, 2 + 5 + 2)
    );
    let ranges: Vec<_> = frame.objects.iter().map(|o| o.triangles.clone()).collect();
    assert_eq!(ranges, [0..3, 3..3, 3..6]);
    assert_eq!(
        frame.indices,
        [
            [0, 1, 2],
            [0, 1, 2],
            [0, 1, 2],
            [12, 13, 14],
            [12, 13, 14],
            [12, 13, 14]
        ]
    );
}

#[test]
fn attributes_are_there_if_any_object_has_them() {
    let mut scene = scene_of(triangle(), vec![at(Transform::default())]);
    let frame = scene.at(0.0);
    assert!(frame.attributes.uvs.is_empty() && frame.attributes.normals.is_empty());
    let mut other = triangle();
    other.colors = vec![Vec4::W; 3];
    other.normals = vec![Vec3::Z; 3];
    scene.meshes[0].primitives.push(other);
    let attributes = scene.at(0.0).attributes;
    assert_eq!(attributes.colors, [[Vec4::ONE; 3], [Vec4::W; 3]].concat());
    assert_eq!(attributes.normals, [[Vec3::ZERO; 3], [Vec3::Z; 3]].concat());
    assert!(attributes.tangents.is_empty() && attributes.uvs1.is_empty());
}

#[test]
fn far_from_the_world_is_as_near() {
    let far = DVec3::new(100_000.0, 0.0, -300_000.0);
    let mut primitive = triangle();
    primitive.positions = CORNERS.map(|p| p * 0.1 + Vec3::splat(0.001)).to_vec();
    let near = scene_of(primitive.clone(), vec![at(Transform::default())]).at(0.0);
    let distant = scene_of(primitive, vec![at(moved(far))]).at(0.0);
    assert_eq!((near.origin, distant.origin), (DVec3::ZERO, far));
    for i in 0..3 {
        let error = (near.position(i) - distant.position(i)).abs().max_element();
        assert!(error < 1e-9, "vertex {i} is off by {error}");
    }
}

#[test]
fn the_origin_does_not_move_with_the_animation() {
    let keys = vec![Vec3::ZERO, Vec3::X * 1e4];
    let mut scene = animated(Interpolation::Linear, ChannelTarget::Translation(keys));
    scene.nodes[0].parent = Some(0);
    scene.nodes.insert(
        0,
        Node {
            transform: moved(DVec3::splat(1e6)),
            ..Node::default()
        },
    );
    scene.animations[0].channels[0].node = 1;
    let origins: Vec<DVec3> = [0.0, 2.0, 3.0].map(|t| scene.at(t).origin).to_vec();
    assert!(
        origins[0] != DVec3::ZERO && origins.iter().all(|&o| o == origins[0]),
        "{origins:?}"
    );
}

/// Some 100,000 vertices and triangles, a few of them dropped, in several objects.
fn large() -> Scene {
    let side = 180u32;
    let mut primitive = Primitive::default();
    for i in 0..side * side {
        let (x, y) = ((i % side) as f32, (i / side) as f32);
        let height = if i % 977 == 0 {
            f32::NAN
        } else {
            (x * 0.7).sin() * (y * 0.3).cos()
        };
        primitive.positions.push(Vec3::new(x, y, height));
        primitive.normals.push(Vec3::new(x, 1.0, y));
    }
    for i in 0..side * (side - 1) - 1 {
        primitive
            .triangles
            .extend([[i, i + 1, i + side], [i + 1, i + side + 1, i + side]]);
    }
    let spin = |i: usize| Transform::Trs {
        translation: DVec3::X * 200.0 * i as f64,
        rotation: DQuat::from_rotation_y(0.3 * i as f64),
        scale: DVec3::ONE,
    };
    scene_of(primitive, (0..3).map(|i| at(spin(i))).collect())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let scene = large();
    let bits = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let frame = pool.install(|| scene.at(0.0));
        let coordinates: Vec<u32> = [&frame.x, &frame.y, &frame.z]
            .into_iter()
            .flatten()
            .map(|v| v.to_bits())
            .collect();
        let normals: Vec<_> = frame
            .attributes
            .normals
            .iter()
            .map(|n| n.to_array().map(f32::to_bits))
            .collect();
        (
            coordinates,
            normals,
            frame.indices,
            frame.objects,
            frame.dropped_non_finite,
        )
    };
    let one = bits(1);
    assert!(one.4 > 0);
    for threads in [2, 3, 8] {
        assert!(bits(threads) == one, "{threads} threads differ from one");
    }
}

#[test]
fn a_frame_posed_again_keeps_its_memory_and_forgets_what_was() {
    let mut frame = FrameGeometry::default();
    let big = large();
    big.at_into(0.0, &mut frame);
    let capacities = |f: &FrameGeometry| {
        (
            f.x.capacity(),
            f.indices.capacity(),
            f.attributes.normals.capacity(),
        )
    };
    let before = (capacities(&frame), frame.x.as_ptr(), frame.indices.as_ptr());
    big.at_into(1.0, &mut frame);
    assert_eq!(
        (capacities(&frame), frame.x.as_ptr(), frame.indices.as_ptr()),
        before
    );
    skinned().at_into(0.0, &mut frame);
    assert_eq!(
        (frame.x.len(), frame.triangle_count(), frame.objects.len()),
        (3, 1, 1)
    );
    assert!(frame.attributes.normals.is_empty() && frame.dropped_non_finite == 0);
}

#[test]
fn cameras_and_lights_look_along_minus_z() {
    let mut scene = scene_of(triangle(), vec![at(Transform::default())]);
    let transform = Transform::Trs {
        translation: DVec3::new(0.0, 5.0, 0.0),
        rotation: DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
        scale: DVec3::new(2.0, 3.0, 1.0),
    };
    scene.nodes.push(Node {
        name: "lamp".into(),
        transform,
        camera: Some(0),
        light: Some(0),
        ..Node::default()
    });
    let projection = Projection::Orthographic {
        half_height: 1.0,
        aspect: None,
    };
    scene.cameras = vec![Camera {
        name: String::new(),
        projection,
    }];
    scene.lights = vec![Light {
        name: String::new(),
        color: Vec3::new(1.0, 0.5, 0.0),
        intensity: 4.0,
        range: 7.0,
        kind: LightKind::Rectangle {
            width: 1.0,
            height: 1.0,
        },
    }];
    let frame = scene.at(0.0);
    let (camera, light) = (&frame.cameras[0], &frame.lights[0]);
    assert_eq!((camera.name.as_str(), camera.eye), ("lamp", DVec3::Y * 5.0));
    assert!(camera.forward.distance(DVec3::NEG_Y) < 1e-12 && camera.up.distance(DVec3::NEG_Z) < 1e-12);
    assert_eq!(
        camera.projection,
        Projection::Orthographic {
            half_height: 3.0,
            aspect: None
        }
    );
    assert!(light.direction.distance(DVec3::NEG_Y) < 1e-12 && light.axis_x.distance(DVec3::X) < 1e-12);
    assert_eq!((light.power, light.range), (Vec3::new(4.0, 2.0, 0.0), 7.0));
    assert_eq!(
        light.kind,
        LightKind::Rectangle {
            width: 2.0,
            height: 3.0
        }
    );
}
