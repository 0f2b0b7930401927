//! What a sound glTF says is what the scene holds.

mod gltf_builder;

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{DVec3, Mat4, Quat, Vec2, Vec3, Vec4};
use gltf_builder::{Builder, F32, U8, U16, floats, push};
use rayward_scene::{
    AlphaMode, ChannelTarget, DEFAULT_AMBIENT, Interpolation, LightKind, LoadOptions, Projection, Scene,
    Transform, UpAxis, Wrap, load,
};
use serde_json::json;

const BYTE: u32 = 5120;
const U32: u32 = 5125;

/// Five vertices in a fan around vertex 0.
fn five_points(mode: u32, indices: Option<(&[u8], u32, u64)>) -> Scene {
    let mut file = Builder::triangle();
    let points = [0., 0., 0., 2., 0., 0., 2., 1., 0., 1., 2., 0., 0., 2., 0.];
    let positions = file.accessor(&floats(&points), F32, "VEC3", 5);
    *file.primitive() = json!({"attributes": {"POSITION": positions}, "mode": mode});
    if let Some((bytes, component, count)) = indices {
        let indices = file.accessor(bytes, component, "SCALAR", count);
        file.primitive()["indices"] = json!(indices);
    }
    file.load().expect("a sound file")
}

#[test]
fn lists_strips_and_fans_with_every_index_type() {
    let triangles = |scene: Scene| scene.meshes[0].primitives[0].triangles.clone();
    assert_eq!(triangles(five_points(5, None)), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    assert_eq!(triangles(five_points(6, None)), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
    // The list has two corners too many: they are left out and said.
    let list = five_points(4, None);
    assert!(
        list.notices
            .iter()
            .any(|n| n.message.contains("last whole triangle")),
        "{:?}",
        list.notices
    );
    assert_eq!(triangles(list), [[0, 1, 2]]);
    let reversed = [[4, 3, 2], [3, 1, 2]];
    assert_eq!(triangles(five_points(5, Some((&[4, 3, 2, 1], U8, 4)))), reversed);
    assert_eq!(
        triangles(five_points(5, Some((&[4, 0, 3, 0, 2, 0, 1, 0], U16, 4)))),
        reversed
    );
    let words: Vec<u8> = [4_u32, 3, 2, 1].iter().flat_map(|i| i.to_le_bytes()).collect();
    assert_eq!(triangles(five_points(5, Some((&words, U32, 4)))), reversed);
    // Stitches of a strip are no triangles.
    assert_eq!(
        triangles(five_points(5, Some((&[0, 1, 2, 2, 3, 3, 4], U8, 7)))),
        [[0, 1, 2]]
    );
}

#[test]
fn points_and_lines_are_skipped_and_said_once() {
    let mut file = Builder::triangle();
    for mode in [0, 1, 2, 3] {
        push(
            &mut file.json["meshes"][0]["primitives"],
            json!({"attributes": {"POSITION": 0}, "mode": mode}),
        );
    }
    let scene = file.load().expect("the triangle remains");
    assert_eq!(scene.meshes[0].primitives.len(), 1);
    let [notice] = &scene.notices[..] else {
        panic!("{:?}", scene.notices)
    };
    assert_eq!(
        notice.to_string(),
        "mesh 0 \"roof\", primitive 1 and 3 more: points and lines are not shown"
    );
}

#[test]
fn attributes_of_every_component_type() {
    let mut file = Builder::triangle();
    let rgb8 = file.accessor(&[255, 0, 51, 0, 255, 255, 255, 0, 0], U8, "VEC3", 3);
    let normals = file.accessor(&[0, 0, 127, 0, 0, 0, 127, 0, 129, 0, 0, 0], BYTE, "VEC3", 3);
    let uvs = file.accessor(&[0, 0, 0xff, 0xff, 0, 0, 0, 0, 0, 0, 0, 0], U16, "VEC2", 3);
    let view = file.json["accessors"][normals]["bufferView"]
        .as_u64()
        .expect("an index") as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    for normalized in [normals, uvs] {
        file.json["accessors"][normalized]["normalized"] = json!(true);
    }
    file.primitive()["attributes"] = json!({"POSITION": 0, "COLOR_0": rgb8, "NORMAL": normals, "TEXCOORD_0": uvs, "TEXCOORD_1": uvs, "_ID": 0});
    let scene = file.load().expect("a sound file");
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(
        primitive.colors,
        [
            Vec4::new(1., 0., 0.2, 1.),
            Vec4::new(0., 1., 1., 1.),
            Vec4::new(1., 0., 0., 1.)
        ]
    );
    assert_eq!(primitive.normals, [Vec3::Z, Vec3::Z, Vec3::NEG_X]);
    assert_eq!(primitive.uvs, [Vec2::Y, Vec2::ZERO, Vec2::ZERO]);
    assert_eq!(primitive.uvs1, primitive.uvs);
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut file = Builder::triangle();
    let indices = file.view(&[2]);
    let values = file.view(&floats(&[7., 8., 9.]));
    file.json["accessors"][0]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": U8}, "values": {"bufferView": values}});
    let positions = |file: &Builder| {
        file.load().expect("a sound file").meshes[0].primitives[0]
            .positions
            .clone()
    };
    assert_eq!(positions(&file), [Vec3::ZERO, Vec3::X, Vec3::new(7., 8., 9.)]);
    file.json["accessors"][0]
        .as_object_mut()
        .expect("an object")
        .remove("bufferView");
    assert_eq!(positions(&file), [Vec3::ZERO, Vec3::ZERO, Vec3::new(7., 8., 9.)]);
}

#[test]
fn a_shared_vertex_buffer_is_not_copied_whole() {
    let mut file = Builder::triangle();
    let many: Vec<f32> = (0..3000).map(|i| i as f32).collect();
    let positions = file.accessor(&floats(&many), F32, "VEC3", 1000);
    let indices = file.accessor(&[0x20, 3, 1, 0, 0x20, 2], U16, "SCALAR", 3);
    *file.primitive() =
        json!({"attributes": {"POSITION": positions, "NORMAL": positions}, "indices": indices});
    let scene = file.load().expect("a sound file");
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(
        primitive.positions,
        [1., 544., 800.].map(|i: f32| Vec3::new(3. * i, 3. * i + 1., 3. * i + 2.))
    );
    assert_eq!(primitive.normals, primitive.positions);
    assert_eq!(primitive.triangles, [[2, 0, 1]]);
}

#[test]
fn the_four_strongest_joints_are_kept_and_sum_to_one() {
    let mut file = Builder::triangle();
    let joints = file.accessor(&[0, 1, 2, 3].repeat(3), U8, "VEC4", 3);
    let more = file.accessor(&[4, 5, 6, 7].repeat(3), U8, "VEC4", 3);
    let weights = file.accessor(&floats(&[0.1, 0.4, 0., 0.2].repeat(3)), F32, "VEC4", 3);
    let rest = [0.3, 0., 0., 0.15, 0., 0., f32::NAN, 0., 0., 0., 0., 0.];
    let more_weights = file.accessor(&floats(&rest), F32, "VEC4", 3);
    file.primitive()["attributes"] = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights,
        "JOINTS_1": more, "WEIGHTS_1": more_weights});
    let scene = file.load().expect("a sound file");
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(primitive.joints[0], [1, 4, 3, 7]);
    assert!((primitive.weights[0] - Vec4::new(0.4, 0.3, 0.2, 0.15) / 1.05).length() < 1e-6);
    assert_eq!(primitive.joints[1], [1, 3, 0, 0]);
    for weights in &primitive.weights {
        assert!((weights.element_sum() - 1.0).abs() < 1e-6, "{weights}");
    }
}

#[test]
fn nodes_come_parents_first_and_only_of_the_scene() {
    let mut file = Builder::triangle();
    file.json["nodes"] = json!([
        {"name": "leaf", "mesh": 0, "rotation": [0, 0, 2, 2]}, {"name": "elsewhere", "mesh": 0},
        {"name": "root", "children": [3, 0], "translation": [1, 2, 3]}, {"name": "arm", "scale": [1, -1, 1]}]);
    file.json["scenes"] = json!([{"nodes": [1]}, {"nodes": [2]}]);
    file.json["scene"] = json!(1);
    let scene = file.load().expect("a sound file");
    let names: Vec<_> = scene.nodes.iter().map(|n| (n.name.as_str(), n.parent)).collect();
    assert_eq!(names, [("root", None), ("arm", Some(0)), ("leaf", Some(0))]);
    let Transform::Trs { rotation, .. } = scene.nodes[2].transform else {
        panic!("decomposed")
    };
    assert!((rotation.z - f64::from(FRAC_1_SQRT_2)).abs() < 1e-7 && rotation.is_normalized());
}

#[test]
fn options_become_a_node_above_the_roots() {
    let mut file = Builder::triangle();
    file.json["cameras"] = json!([{"type": "orthographic",
        "orthographic": {"xmag": 4, "ymag": 2, "znear": 0, "zfar": 9}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "range": 50, "intensity": 3, "extras": {"radius": 10}}]}});
    let path = file.write("scene.glb", file.glb());
    let scene = load(
        &path,
        &LoadOptions {
            up: UpAxis::Z,
            scale: 0.5,
        },
    )
    .expect("a sound file");
    assert_eq!((scene.nodes[0].parent, scene.nodes[1].parent), (None, Some(0)));
    let moved = scene.nodes[0]
        .transform
        .matrix()
        .transform_point3(DVec3::new(1., 2., 3.));
    assert!((moved - DVec3::new(0.5, 1.5, -1.)).length() < 1e-12, "{moved}");
    assert_eq!(
        scene.cameras[0].projection,
        Projection::Orthographic {
            half_height: 1.0,
            aspect: Some(2.0)
        }
    );
    assert_eq!((scene.lights[0].range, scene.lights[0].intensity), (25.0, 3.0));
    assert_eq!(scene.lights[0].kind, LightKind::Point { radius: 5.0 });
}

#[test]
fn cameras_and_lights() {
    let mut file = Builder::triangle();
    file.json["cameras"] = json!([{"name": "eye", "type": "perspective",
        "perspective": {"yfov": 0.5, "aspectRatio": 1.5, "znear": 0.1}}]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "color": [1, 0.5, 0.25], "intensity": 40, "name": "lamp", "extras": {"radius": 0.2},
         "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.6}, "extensions": {"EXT_any": {}}},
        {"type": "directional"}]}});
    file.json["nodes"][0]["camera"] = json!(0);
    file.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 1}});
    let scene = file.load().expect("a sound file");
    let vfov = f64::from(0.5_f32);
    assert_eq!(
        scene.cameras[0].projection,
        Projection::Perspective {
            vfov,
            aspect: Some(1.5)
        }
    );
    assert_eq!((scene.nodes[0].camera, scene.nodes[0].light), (Some(0), Some(1)));
    let lamp = &scene.lights[0];
    assert_eq!(
        (lamp.color, lamp.intensity, lamp.range),
        (Vec3::new(1., 0.5, 0.25), 40.0, f32::INFINITY)
    );
    assert_eq!(
        lamp.kind,
        LightKind::Spot {
            inner: 0.1,
            outer: 0.6,
            radius: 0.2
        }
    );
    assert_eq!(scene.lights[1].kind, LightKind::Directional { half_angle: 0.0 });
    assert_eq!(scene.ambient, Vec3::ZERO);
    // Lights that stand nowhere light nothing.
    file.json["nodes"][0]["extensions"] = json!({});
    assert_eq!(file.load().expect("a sound file").ambient, DEFAULT_AMBIENT);
}

/// A file with a PNG of two texels as texture 0.
fn textured() -> Builder {
    let mut file = Builder::triangle();
    let mut png = Vec::new();
    let picture = image::RgbaImage::from_raw(2, 1, vec![10, 20, 30, 255, 40, 50, 60, 0]).expect("two texels");
    picture
        .write_to(&mut std::io::Cursor::new(&mut png), image::ImageFormat::Png)
        .expect("a PNG");
    let view = file.view(&png);
    file.json["images"] = json!([{"uri": "never/read.png"}, {"bufferView": view, "mimeType": "image/png"}]);
    file.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9985}]);
    file.json["textures"] = json!([{"source": 1, "sampler": 0}]);
    file.primitive()["material"] = json!(0);
    file
}

#[test]
fn films_sheen_and_anisotropy() {
    let mut file = textured();
    let moved = json!({"index": 0, "texCoord": 1});
    file.json["materials"] = json!([{"extensions": {
        "KHR_materials_iridescence": {"iridescenceFactor": 0.9, "iridescenceTexture": moved, "iridescenceIor": 1.7,
            "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 900,
            "iridescenceThicknessTexture": {"index": 0}},
        "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenColorTexture": moved,
            "sheenRoughnessFactor": 0.4, "sheenRoughnessTexture": {"index": 0}},
        "KHR_materials_anisotropy": {"anisotropyStrength": 0.5, "anisotropyRotation": -1.2,
            "anisotropyTexture": moved}}},
        {"extensions": {"KHR_materials_iridescence": {"iridescenceFactor": 7}}}]);
    let scene = file.load().expect("a sound file");
    let m = &scene.materials[1];
    let sets = [m.iridescence.texture, m.iridescence.thickness_texture];
    assert_eq!(sets.map(|t| t.expect("a texture").uv_set), [1, 0]);
    let film = &m.iridescence;
    assert_eq!((film.factor, film.ior), (0.9, 1.7));
    assert_eq!((film.thickness_min, film.thickness_max), (200.0, 900.0));
    let sheen = &m.sheen;
    assert_eq!((sheen.color, sheen.roughness), (Vec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!([sheen.color_texture, sheen.roughness_texture], sets);
    assert_eq!((m.anisotropy.strength, m.anisotropy.rotation), (0.5, -1.2));
    assert_eq!(m.anisotropy.texture, sets[0]);
    let usual = &scene.materials[2].iridescence;
    assert_eq!((usual.factor, usual.ior), (1.0, 1.3));
    assert_eq!((usual.thickness_min, usual.thickness_max), (100.0, 400.0));

    file.json["materials"] =
        json!([{"extensions": {"KHR_materials_sheen": {"sheenRoughnessFactor": "much"}}}]);
    let error = file.load().expect_err("no number").to_string();
    assert!(
        error.contains("material 0") && error.contains("KHR_materials_sheen"),
        "{error}"
    );
}

#[test]
fn materials_with_their_extensions_and_textures() {
    let mut file = textured();
    let moved = json!({"index": 0, "texCoord": 0, "scale": 0.5, "extensions": {"KHR_texture_transform":
        {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [2, 3], "texCoord": 1, "extras": {"a": 1}}}});
    file.json["materials"] = json!([{
        "name": "glass", "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
        "emissiveFactor": [1, 0.5, 0], "normalTexture": moved,
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "roughnessFactor": 0.5,
            "baseColorTexture": moved},
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 4, "extras": 5},
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": {"index": 0}},
            "KHR_materials_volume": {"thicknessFactor": 2, "attenuationDistance": 3,
                "attenuationColor": [0.5, 0.6, 0.7]},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0.7, "specularColorFactor": [0.3, 2, 1]},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.6, "clearcoatTexture": {"index": 0},
                "clearcoatRoughnessFactor": 0.25, "clearcoatRoughnessTexture": moved,
                "clearcoatNormalTexture": moved},
            "KHR_materials_unlit": {}}}]);
    let scene = file.load().expect("a sound file");
    assert_eq!(scene.meshes[0].primitives[0].material, 1);
    assert_eq!((scene.materials.len(), scene.materials[0].metallic), (2, 1.0));
    let m = &scene.materials[1];
    assert_eq!(
        (m.base_color, m.metallic, m.roughness),
        (Vec4::new(0.1, 0.2, 0.3, 0.4), 1.0, 0.5)
    );
    assert_eq!(
        (m.alpha_mode, m.double_sided, m.unlit),
        (AlphaMode::Mask { cutoff: 0.3 }, true, true)
    );
    assert_eq!(
        (m.emissive, m.transmission, m.ior),
        (Vec3::new(4., 2., 0.), 0.9, 1.33)
    );
    assert_eq!((m.thickness, m.attenuation_distance), (2.0, 3.0));
    assert_eq!(m.attenuation_color, Vec3::new(0.5, 0.6, 0.7));
    assert_eq!((m.specular, m.specular_color), (0.7, Vec3::new(0.3, 2., 1.)));
    let texture = m.base_color_texture.expect("a texture");
    assert_eq!((texture.image, texture.sampler, texture.uv_set), (0, 1, 1));
    assert_eq!(
        (texture.transform.offset, texture.transform.rotation),
        (Vec2::new(0.1, 0.2), 0.3)
    );
    assert_eq!((m.normal_texture, m.normal_scale), (Some(texture), 0.5));
    assert_eq!(m.transmission_texture.expect("a texture").uv_set, 0);
    let coat = &m.coat;
    assert_eq!((coat.factor, coat.roughness, coat.normal_scale), (0.6, 0.25, 0.5));
    assert_eq!(coat.texture, m.transmission_texture);
    assert_eq!(
        (coat.roughness_texture, coat.normal_texture),
        (Some(texture), Some(texture))
    );
    assert_eq!(scene.images.len(), 1, "only what materials use is read");
    assert_eq!(scene.images[0].texels, [[10, 20, 30, 255], [40, 50, 60, 0]]);
    let sampler = scene.samplers[1];
    assert_eq!(
        (sampler.wrap_u, sampler.wrap_v),
        (Wrap::ClampToEdge, Wrap::MirroredRepeat)
    );
    assert_eq!(
        (sampler.mag_nearest, sampler.min_nearest, sampler.mipmaps),
        (true, false, true)
    );
}

#[test]
fn specular_glossiness_becomes_a_coloured_dielectric() {
    let mut file = textured();
    file.json["materials"] = json!([{"extensions": {"KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [0.04, 0.4, 0.8], "glossinessFactor": 0.5,
        "specularGlossinessTexture": {"index": 0}}}}]);
    let scene = file.load().expect("a sound file");
    let m = &scene.materials[1];
    assert_eq!(
        (m.metallic, m.roughness, m.base_color),
        (0.0, 1.0, Vec4::new(0.5, 0.5, 0.5, 1.0))
    );
    assert!((m.specular_color - Vec3::new(1., 10., 20.)).length() < 1e-5);
    assert_eq!(
        scene.images[m.specular_color_texture.expect("a texture").image].texels[0],
        [10, 20, 30, 255]
    );
    let rough = &scene.images[m.metallic_roughness_texture.expect("a texture").image];
    assert_eq!(
        [rough.texels[0][1], rough.texels[1][1]],
        [127, 255],
        "1 - 0.5 * alpha"
    );
    assert_eq!(scene.notices.len(), 1, "{:?}", scene.notices);
}

#[test]
fn skins_morph_targets_and_animations() {
    let mut file = Builder::triangle();
    let joints = file.accessor(&[0; 12], U8, "VEC4", 3);
    let weights = file.accessor(&[255, 0, 0, 0].repeat(3), U8, "VEC4", 3);
    let shift = file.accessor(&floats(&[0.5; 9]), F32, "VEC3", 3);
    let bind = file.accessor(
        &floats(&Mat4::from_scale(Vec3::splat(2.)).to_cols_array()),
        F32,
        "MAT4",
        1,
    );
    file.primitive()["attributes"] = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    file.primitive()["targets"] = json!([{"POSITION": shift}, {"NORMAL": shift}]);
    // The joint is outside of the scene.
    file.json["nodes"] = json!([{"mesh": 0, "skin": 1, "weights": [0.25, 1]}, {"name": "joint", "mesh": 0}]);
    file.json["skins"] = json!([{"joints": [0]}, {"joints": [1], "inverseBindMatrices": bind}]);
    let times = file.accessor(&floats(&[0., 2.]), F32, "SCALAR", 2);
    let turns = file.accessor(&[0, 0, 0, 127, 0, 0, 127, 0], BYTE, "VEC4", 2);
    file.json["accessors"][turns]["normalized"] = json!(true);
    let spline = file.accessor(&floats(&[9., 1., 9., 9., 2., 9.].repeat(2)), F32, "SCALAR", 12);
    file.json["animations"] = json!([{"name": "wave",
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "rotation"}},
            {"sampler": 1, "target": {"node": 0, "path": "weights"}},
            {"sampler": 0, "target": {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/a"}}}}],
        "samplers": [{"input": times, "output": turns, "interpolation": "STEP"},
            {"input": times, "output": spline, "interpolation": "CUBICSPLINE"}]}]);
    let scene = file.load().expect("a sound file");
    assert_eq!(
        (scene.nodes.len(), scene.nodes[0].skin, scene.nodes[1].mesh),
        (2, Some(0), None)
    );
    assert_eq!(scene.skins[0].joints, [1]);
    assert_eq!(scene.skins[0].inverse_bind, [Mat4::from_scale(Vec3::splat(2.))]);
    assert_eq!(scene.nodes[0].weights, [0.25, 1.0]);
    let primitive = &scene.meshes[0].primitives[0];
    assert_eq!(primitive.weights, [Vec4::X; 3]);
    assert_eq!(primitive.morph_targets[0].positions, [Vec3::splat(0.5); 3]);
    assert!(primitive.morph_targets[1].positions.is_empty() && primitive.morph_targets[1].normals.len() == 3);
    let [turn, morph] = &scene.animations[0].channels[..] else {
        panic!("two channels")
    };
    assert_eq!(
        (turn.node, turn.interpolation, turn.times.as_slice()),
        (1, Interpolation::Step, &[0., 2.][..])
    );
    let ChannelTarget::Rotation(turns) = &turn.target else {
        panic!("a rotation")
    };
    assert_eq!(turns[..], [Quat::IDENTITY, Quat::from_xyzw(0., 0., 1., 0.)]);
    let ChannelTarget::Weights { targets: 2, values } = &morph.target else {
        panic!("two targets")
    };
    assert_eq!(
        (morph.interpolation, values.len()),
        (Interpolation::CubicSpline, 12)
    );
    assert_eq!(scene.notices.len(), 2, "{:?}", scene.notices);
}

#[test]
fn instances_become_nodes() {
    let mut file = Builder::triangle();
    let places = file.accessor(&floats(&[1., 0., 0., 0., 5., 0.]), F32, "VEC3", 2);
    file.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    let scene = file.load().expect("a sound file");
    let shown: Vec<_> = scene.nodes.iter().map(|n| (n.parent, n.mesh)).collect();
    assert_eq!(shown, [(None, None), (Some(0), Some(0)), (Some(0), Some(0))]);
    assert_eq!(
        scene.nodes[2].transform.matrix().w_axis.truncate(),
        DVec3::new(0., 5., 0.)
    );
}
