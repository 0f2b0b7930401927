//! Shading against independent values: the BRDF against a table computed from the glTF specification's formulas
//! in double precision by another program, surfaces against closed forms.

use glam::{DVec3, Vec2, Vec3, Vec4};
use rayward::shade::{self, object_of};
use rayward::{Shader, ShadingLight, Surface, SurfacePoint};
use rayward_scene::{
    AlphaMode, Coat, FrameGeometry, Image, LightKind, Material, ObjectRange, PosedLight, Sampler, Scene,
    TextureRef, TextureTransform, VertexAttributes,
};

/// View angle, light angle, azimuth between them (degrees), metallic, roughness; BRDF times cosine for the base
/// colour (0.8, 0.5, 0.2).
#[rustfmt::skip]
const TABLE: [([f32; 5], [f32; 3]); 10] = [
    ([0.0, 0.0, 0.0, 0.0, 1.0], [0.2476451, 0.1559718, 0.0642986]),
    ([30.0, 30.0, 180.0, 0.0, 0.5], [0.2699667, 0.1905788, 0.1111908]),
    ([30.0, 35.0, 180.0, 1.0, 0.25], [8.525008, 5.328507, 2.132005]),
    ([60.0, 75.0, 170.0, 0.5, 0.4], [0.2866514, 0.200222, 0.1137926]),
    ([80.0, 80.0, 180.0, 0.0, 0.3], [20.68218, 20.67239, 20.66261]),
    ([80.0, 82.0, 175.0, 1.0, 0.6], [0.5709061, 0.4569139, 0.3429217]),
    ([45.0, 20.0, 90.0, 0.3, 1.0], [0.1851418, 0.1166673, 0.04819293]),
    ([10.0, 70.0, 40.0, 1.0, 1.0], [0.03282118, 0.02051423, 0.008207272]),
    ([5.0, 5.0, 180.0, 1.0, 0.2], [39.94048, 24.9628, 9.985119]),
    ([75.0, -60.0, 0.0, 0.0, 0.8], [0.1554373, 0.1137098, 0.07198233]),
];

fn direction(polar: f32, azimuth: f32) -> Vec3 {
    let (polar, azimuth) = (polar.to_radians(), azimuth.to_radians());
    Vec3::new(
        polar.sin() * azimuth.cos(),
        polar.sin() * azimuth.sin(),
        polar.cos(),
    )
}

/// A directional light of 1 lux that comes from this direction.
fn sun(towards: Vec3) -> ShadingLight {
    let light = PosedLight {
        name: String::new(),
        position: DVec3::ZERO,
        direction: -towards.as_dvec3(),
        axis_x: DVec3::X,
        axis_y: DVec3::Y,
        power: Vec3::ONE,
        range: f32::INFINITY,
        kind: LightKind::Directional { half_angle: 0.0 },
    };
    ShadingLight::new(&light, DVec3::ZERO)
}

/// The triangle (0,0,0) (1,0,0) (0,1,0) that faces +Z, with texture coordinates like an image seen upright.
fn triangle(material: Material) -> (Scene, FrameGeometry) {
    let geometry = FrameGeometry {
        x: vec![0.0, 1.0, 0.0],
        y: vec![0.0, 0.0, 1.0],
        z: vec![0.0; 3],
        indices: vec![[0, 1, 2]],
        attributes: VertexAttributes {
            uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 0.0)],
            ..VertexAttributes::default()
        },
        objects: vec![ObjectRange {
            triangles: 0..1,
            vertices: 0..3,
            material: 0,
            node: 0,
            double_sided: true,
        }],
        ..FrameGeometry::default()
    };
    (
        Scene {
            materials: vec![material],
            samplers: vec![Sampler::default()],
            ..Scene::default()
        },
        geometry,
    )
}

fn point(view: Vec3) -> SurfacePoint {
    SurfacePoint {
        prim: 0,
        object: 0,
        u: 0.25,
        v: 0.5,
        view,
        footprint: 0.0,
    }
}

fn texture() -> Option<TextureRef> {
    Some(TextureRef {
        image: 0,
        sampler: 0,
        uv_set: 0,
        transform: TextureTransform::default(),
    })
}

fn one_texel(texel: [u8; 4]) -> Image {
    Image {
        name: String::new(),
        width: 1,
        height: 1,
        texels: vec![texel],
    }
}

fn close(a: Vec3, b: Vec3, tolerance: f32) -> bool {
    (a - b).abs().max_element() <= tolerance
}

#[test]
fn reflection_agrees_with_the_specification() {
    for ([view, light, azimuth, metallic, roughness], want) in TABLE {
        let material = Material {
            base_color: Vec4::new(0.8, 0.5, 0.2, 1.0),
            metallic,
            roughness,
            ..Material::default()
        };
        let (scene, geometry) = triangle(material);
        let surface = Shader::new(&scene).surface(&geometry, &point(direction(view, 0.0)));
        let got = shade::direct(&surface, &sun(direction(light, azimuth))).unwrap();
        let want = Vec3::from(want);
        assert!(
            close(got.radiance / want, Vec3::ONE, 1e-4),
            "{} for {want} at {view} {light}",
            got.radiance
        );
    }
}

#[test]
fn specular_and_ior_change_the_dielectric_only() {
    let lit = |material: Material| {
        let (scene, geometry) = triangle(material);
        let surface = Shader::new(&scene).surface(&geometry, &point(Vec3::Z));
        shade::direct(&surface, &sun(Vec3::Z)).unwrap().radiance
    };
    let base = Material {
        roughness: 0.5,
        base_color: Vec4::new(0.5, 0.5, 0.5, 1.0),
        ..Material::default()
    };
    // Head on there is only F0: with alpha = 1/4, D = 16 / pi and V = 1/4.
    let expected = |f0: f32, weight: f32| {
        let pi = std::f32::consts::PI;
        (1.0 - weight * f0) * 0.5 / pi + weight * f0 * 16.0 / pi / 4.0
    };
    let cases = [
        (base.clone(), expected(0.04, 1.0)),
        (
            Material {
                specular: 0.5,
                ..base.clone()
            },
            expected(0.04, 0.5),
        ),
        (
            Material {
                specular: 0.0,
                ..base.clone()
            },
            expected(0.04, 0.0),
        ),
        (
            Material {
                ior: 2.0,
                ..base.clone()
            },
            expected(1.0 / 9.0, 1.0),
        ),
        (
            Material {
                ior: 2.0,
                specular_color: Vec3::splat(0.5),
                ..base.clone()
            },
            expected(0.5 / 9.0, 1.0),
        ),
        (
            Material {
                ior: 0.0,
                ..base.clone()
            },
            expected(1.0, 1.0),
        ),
    ];
    for (material, want) in cases {
        let name = format!("ior {} specular {}", material.ior, material.specular);
        assert!(close(lit(material), Vec3::splat(want), 1e-5), "{name}");
    }
    let metal = Material {
        metallic: 1.0,
        ..base
    };
    assert_eq!(
        lit(metal.clone()),
        lit(Material {
            ior: 2.0,
            specular: 0.3,
            ..metal
        })
    );
}

/// `KHR_materials_clearcoat` as its text has it, in double precision: a GGX lobe with height-correlated Smith visibility
/// over what is below, mixed by Schlick's reflectance towards the viewer.
fn coated(below: f64, [factor, roughness]: [f64; 2], [normal, view, light]: [DVec3; 3]) -> f64 {
    let half = (view + light).normalize();
    let (nl, nv, nh) = (normal.dot(light), normal.dot(view), normal.dot(half));
    let a2 = roughness.powi(4);
    let d = a2 / (std::f64::consts::PI * (nh * nh * (a2 - 1.0) + 1.0).powi(2));
    let smith = |this: f64, other: f64| this * (other * other * (1.0 - a2) + a2).sqrt();
    let v = 0.5 / (smith(nl, nv) + smith(nv, nl));
    let weight = factor * (0.04 + 0.96 * (1.0 - nv).powi(5));
    below * (1.0 - weight) + weight * d * v * nl
}

#[test]
fn coats_agree_with_the_extension() {
    let normal_map = |texel| Image {
        name: "bent".into(),
        ..one_texel(texel)
    };
    for (angles, factor, roughness, metallic) in [
        ([0.0, 0.0, 0.0], 1.0, 0.5, 0.0),
        ([30.0, 35.0, 170.0], 1.0, 0.3, 1.0),
        ([60.0, 75.0, 175.0], 0.5, 0.6, 0.3),
        ([80.0, 70.0, 180.0], 0.8, 1.0, 0.0),
        ([50.0, 50.0, 20.0], 1.0, 0.8, 1.0),
    ] {
        let [view, light] = [direction(angles[0], 0.0), direction(angles[1], angles[2])];
        let below = Material {
            base_color: Vec4::new(0.8, 0.5, 0.2, 1.0),
            metallic,
            roughness: 0.4,
            emissive: Vec3::new(0.0, 3.0, 0.0),
            ..Material::default()
        };
        let lit = |material: Material| {
            let (mut scene, geometry) = triangle(material);
            // Factor 0.6 and roughness 0.8, then two normal maps.
            scene.images = vec![
                one_texel([153, 204, 0, 255]),
                normal_map([128, 128, 255, 255]),
                normal_map([90, 190, 230, 255]),
            ];
            let surface = Shader::new(&scene).surface(&geometry, &point(view));
            (shade::direct(&surface, &sun(light)).unwrap().radiance, surface)
        };
        let of = |image| texture().map(|t| TextureRef { image, ..t });
        let bare = lit(below.clone()).0;
        for textured in [false, true] {
            let coat = Coat {
                factor,
                roughness,
                texture: of(0).filter(|_| textured),
                roughness_texture: of(0).filter(|_| textured),
                ..Coat::default()
            };
            let scale = if textured { [0.6, 0.8] } else { [1.0, 1.0] };
            let values = [f64::from(factor) * scale[0], f64::from(roughness) * scale[1]];
            let (got, surface) = lit(Material {
                coat: coat.clone(),
                ..below.clone()
            });
            let directions = [DVec3::Z, view.as_dvec3(), light.as_dvec3()];
            for i in 0..3 {
                let want = coated(f64::from(bare[i]), values, directions);
                assert!(
                    (f64::from(got[i]) / want - 1.0).abs() < 1e-4,
                    "{got} for {want} at {angles:?}"
                );
            }
            // Emission passes the coat, and a white surrounding is reflected.
            let weight = 1.0 - surface.coat.passed;
            let want = Vec3::new(0.8, 0.5, 0.2) * (1.0 - weight) + weight + Vec3::Y * 3.0 * (1.0 - weight);
            assert!(close(shade::ambient(&surface, Vec3::ONE), want, 1e-5));
            // The coat has the normal of its own map, not that of the surface's.
            let bent = |coat_map, below_map| {
                lit(Material {
                    coat: Coat {
                        normal_texture: coat_map,
                        ..coat.clone()
                    },
                    normal_texture: below_map,
                    ..below.clone()
                })
                .1
            };
            assert_eq!(bent(None, of(2)).coat.normal, Vec3::Z);
            assert!(bent(None, of(2)).normal.z < 0.95);
            let own = bent(of(2), None);
            assert_eq!((own.normal, own.coat.normal), (Vec3::Z, bent(None, of(2)).normal));
        }
    }
}

#[test]
fn mirrors_keep_a_finite_highlight() {
    let material = Material {
        metallic: 1.0,
        roughness: 0.0,
        ..Material::default()
    };
    let (scene, geometry) = triangle(material);
    let surface = Shader::new(&scene).surface(&geometry, &point(direction(30.0, 0.0)));
    let at = |angle| {
        shade::direct(&surface, &sun(direction(angle, 180.0)))
            .unwrap()
            .radiance
            .x
    };
    assert!(at(30.0) > 1e4 && at(30.0).is_finite());
    assert!(at(31.0) < 1e-1 * at(30.0) && at(31.0) > 0.0);
}

#[test]
fn light_from_behind_does_not_arrive() {
    let (scene, geometry) = triangle(Material::default());
    let shader = Shader::new(&scene);
    for view in [Vec3::Z, Vec3::NEG_Z] {
        let surface = shader.surface(&geometry, &point(view));
        assert_eq!(surface.front, view == Vec3::Z);
        assert_eq!((surface.geometric_normal, surface.normal), (view, view));
        assert!(shade::direct(&surface, &sun(view)).is_some());
        assert_eq!(shade::direct(&surface, &sun(-view)), None);
    }
}

#[test]
fn attributes_are_interpolated() {
    let (scene, mut geometry) = triangle(Material {
        base_color: Vec4::splat(0.5),
        ..Material::default()
    });
    geometry.attributes.colors = vec![
        Vec4::new(1.0, 0.0, 0.0, 1.0),
        Vec4::new(0.0, 1.0, 0.0, 1.0),
        Vec4::new(0.0, 0.0, 1.0, 1.0),
    ];
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    geometry.attributes.normals = vec![Vec3::Z, tilted, Vec3::Z];
    let shader = Shader::new(&scene);
    let surface = shader.surface(&geometry, &point(Vec3::Z));
    assert_eq!(surface.position, Vec3::new(0.25, 0.5, 0.0));
    assert_eq!(surface.base_color, Vec3::new(0.125, 0.125, 0.25));
    assert!(close(
        surface.normal,
        (0.75 * Vec3::Z + 0.25 * tilted).normalize(),
        1e-6
    ));
    assert_eq!(surface.geometric_normal, Vec3::Z);
    // Seen from behind, and with normals on the wrong side, everything turns over.
    let behind = shader.surface(&geometry, &point(Vec3::NEG_Z));
    assert!(close(behind.normal, -surface.normal, 1e-6));
    for normal in &mut geometry.attributes.normals {
        *normal = -*normal;
    }
    assert!(close(
        shader.surface(&geometry, &point(Vec3::Z)).normal,
        surface.normal,
        1e-6
    ));
    geometry.attributes.normals[2] = Vec3::ZERO;
    assert_eq!(
        shader.surface(&geometry, &point(Vec3::Z)).normal,
        Vec3::Z,
        "no normal at a corner: flat"
    );
}

#[test]
fn normal_maps_bend_to_the_right_and_up_in_the_image() {
    let bent = Vec3::new(0.6, 0.0, 0.8);
    for (texel, mirrored, want) in [
        ([204, 128, 230, 255], false, bent),
        ([128, 204, 230, 255], false, Vec3::new(0.0, 0.6, 0.8)),
        ([204, 128, 230, 255], true, Vec3::new(-0.6, 0.0, 0.8)),
        ([128, 204, 230, 255], true, Vec3::new(0.0, 0.6, 0.8)),
    ] {
        let (mut scene, mut geometry) = triangle(Material {
            normal_texture: texture(),
            ..Material::default()
        });
        scene.images.push(one_texel(texel));
        if mirrored {
            for uv in &mut geometry.attributes.uvs {
                uv.x = -uv.x;
            }
        }
        let shader = Shader::new(&scene);
        let derived = shader.surface(&geometry, &point(Vec3::Z)).normal;
        assert!(close(derived, want, 0.01), "{derived} for {want}");
        let from_behind = shader.surface(&geometry, &point(Vec3::NEG_Z)).normal;
        assert!(close(from_behind, -want, 0.01), "{from_behind} for {}", -want);
        let handedness = if mirrored { -1.0 } else { 1.0 };
        geometry.attributes.tangents = vec![Vec4::new(handedness, 0.0, 0.0, handedness); 3];
        let given = shader.surface(&geometry, &point(Vec3::Z)).normal;
        assert!(
            close(given, derived, 1e-5),
            "{given} with tangents, {derived} without"
        );
    }
}

#[test]
fn normal_scale_flattens() {
    let material = Material {
        normal_texture: texture(),
        normal_scale: 0.5,
        ..Material::default()
    };
    let (mut scene, geometry) = triangle(material);
    scene.images.push(one_texel([204, 128, 230, 255]));
    let normal = Shader::new(&scene).surface(&geometry, &point(Vec3::Z)).normal;
    assert!(
        close(normal, Vec3::new(0.3, 0.0, 0.8).normalize(), 0.01),
        "{normal}"
    );
}

#[test]
fn textures_multiply_their_factors() {
    let material = Material {
        base_color: Vec4::new(0.5, 1.0, 1.0, 0.5),
        base_color_texture: texture(),
        metallic: 0.5,
        roughness: 0.5,
        metallic_roughness_texture: texture(),
        occlusion_texture: texture(),
        occlusion_strength: 0.5,
        emissive: Vec3::new(2.0, 0.0, 0.0),
        emissive_texture: texture(),
        specular: 0.5,
        specular_texture: texture(),
        alpha_mode: AlphaMode::Blend,
        ..Material::default()
    };
    let (mut scene, geometry) = triangle(material);
    scene.images.push(one_texel([255, 51, 102, 204]));
    let surface = Shader::new(&scene).surface(&geometry, &point(Vec3::Z));
    let (green, blue) = (0.033_105, 0.132_868);
    assert!(
        close(surface.base_color, Vec3::new(0.5, green, blue), 1e-5),
        "{}",
        surface.base_color
    );
    assert!((surface.alpha - 0.4).abs() < 1e-6);
    assert!((surface.roughness - 0.1).abs() < 1e-6 && (surface.metallic - 0.2).abs() < 1e-6);
    assert!((surface.occlusion - 1.0).abs() < 1e-6);
    assert!((surface.specular - 0.4).abs() < 1e-6);
    assert!(close(surface.emissive, Vec3::new(2.0, 0.0, 0.0), 1e-6));
    let surrounding = shade::ambient(&surface, Vec3::splat(0.1));
    assert!(close(surrounding, Vec3::new(2.05, 0.1 * green, 0.1 * blue), 1e-5));
}

#[test]
fn masks_are_solid_or_absent() {
    for (cutoff, want) in [(0.3, 1.0), (0.7, 0.0)] {
        let material = Material {
            base_color: Vec4::new(1.0, 1.0, 1.0, 0.5),
            alpha_mode: AlphaMode::Mask { cutoff },
            ..Material::default()
        };
        let (scene, geometry) = triangle(material);
        let shader = Shader::new(&scene);
        assert_eq!(shader.surface(&geometry, &point(Vec3::Z)).alpha, want);
        assert_eq!(
            shader.transmittance(&geometry, 0, 0, [0.2, 0.2], false),
            Vec3::splat(1.0 - want)
        );
    }
}

#[test]
fn unlit_shows_its_base_colour() {
    let material = Material {
        unlit: true,
        base_color: Vec4::new(0.1, 0.2, 0.3, 1.0),
        ..Material::default()
    };
    let (scene, geometry) = triangle(material);
    let surface = Shader::new(&scene).surface(&geometry, &point(Vec3::Z));
    assert_eq!(shade::direct(&surface, &sun(Vec3::Z)), None);
    assert_eq!(shade::ambient(&surface, Vec3::ONE), Vec3::new(0.1, 0.2, 0.3));
}

#[test]
fn distant_textures_are_averaged() {
    let (mut scene, geometry) = triangle(Material {
        base_color_texture: texture(),
        ..Material::default()
    });
    let checker = (0..64 * 64).map(|i| {
        if (i % 64 + i / 64) % 2 == 0 {
            [255; 4]
        } else {
            [0, 0, 0, 255]
        }
    });
    scene.images.push(Image {
        name: String::new(),
        width: 64,
        height: 64,
        texels: checker.collect(),
    });
    scene.samplers[0].mipmaps = true;
    let shader = Shader::new(&scene);
    // At 10.3 texels from the left the sample lies 0.2 texels off a centre.
    let at = |footprint, view| {
        let surface = shader.surface(
            &geometry,
            &SurfacePoint {
                u: 10.3 / 64.0,
                v: 0.5 / 64.0,
                footprint,
                ..point(view)
            },
        );
        surface.base_color.x
    };
    assert!((at(0.0, Vec3::Z) - 0.5).abs() > 0.2, "{}", at(0.0, Vec3::Z));
    assert!((at(2.0 / 64.0, Vec3::Z) - 0.5).abs() < 0.01, "two texels a pixel");
    assert!(
        (at(1.0 / 64.0, direction(60.0, 0.0)) - 0.5).abs() < 0.01,
        "a slanted view doubles the footprint"
    );
}

#[test]
fn objects_are_found_by_triangle() {
    let range = |triangles| ObjectRange {
        triangles,
        vertices: 0..0,
        material: 0,
        node: 0,
        double_sided: false,
    };
    let objects = vec![range(0..3), range(3..3), range(3..4), range(4..9)];
    let geometry = FrameGeometry {
        objects,
        ..FrameGeometry::default()
    };
    assert_eq!(
        [0, 2, 3, 4, 8].map(|prim| object_of(&geometry, prim)),
        [0, 0, 2, 3, 3]
    );
}

#[test]
fn slivers_and_zero_sizes_stay_finite() {
    let (mut scene, mut geometry) = triangle(Material {
        base_color_texture: texture(),
        normal_texture: texture(),
        ..Material::default()
    });
    scene.images.push(one_texel([128, 128, 255, 255]));
    scene.samplers[0].mipmaps = true;
    geometry.x = vec![0.0, 1e-18, 0.0];
    geometry.y = vec![0.0, 0.0, 1e-20];
    geometry.attributes.uvs = vec![Vec2::ZERO; 3];
    let shader = Shader::new(&scene);
    let surface = shader.surface(
        &geometry,
        &SurfacePoint {
            footprint: 1.0,
            ..point(Vec3::Z)
        },
    );
    assert_eq!((surface.geometric_normal, surface.normal), (Vec3::Z, Vec3::Z));
    let Surface {
        base_color,
        roughness,
        ..
    } = surface;
    assert!(base_color.is_finite() && roughness.is_finite());
}
