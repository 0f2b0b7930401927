//! Pictures of masked and blended surfaces against a hierarchy that finds them one ray at a time: bit for bit.

use std::ops::ControlFlow;

use glam::{DVec3, Vec2, Vec3, Vec4};
use rayward::scene::{
    AlphaMode, FrameGeometry, Image, LightKind, Material, Mesh, Node, PosedCamera, PosedLight, Primitive,
    Projection, Sampler, Scene, TextureRef, TextureTransform,
};
use rayward::shade::{ambient, direct, object_of};
use rayward::trace::{Bvh, Light, Receiver, SimdLevel, exact};
use rayward::{
    CameraFrame, Layers, NO_ID, RenderOptions, Renderer, Shader, ShadingLight, SurfacePoint, shadow_end,
    triangles,
};

/// Deterministic numbers in [-1, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as f32) / (1u64 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// Squares with texture coordinates, each two triangles.
fn squares(material: usize, corners: impl Iterator<Item = [Vec3; 3]>) -> Primitive {
    let mut primitive = Primitive {
        material,
        ..Primitive::default()
    };
    for [origin, right, up] in corners {
        let first = primitive.positions.len() as u32;
        for uv in [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y] {
            primitive.positions.push(origin + right * uv.x + up * uv.y);
            primitive.uvs.push(uv);
        }
        primitive
            .triangles
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    primitive
}

/// Leaves and panes in a heap over a floor.
fn scene() -> Scene {
    let mut numbers = Numbers(9);
    let mut heap = |count: usize, size: f32| -> Vec<[Vec3; 3]> {
        let square = |_| [numbers.point(), numbers.point() * size, numbers.point() * size];
        (0..count).map(square).collect()
    };
    let leaf = Material {
        base_color_texture: Some(TextureRef {
            image: 0,
            sampler: 0,
            uv_set: 0,
            transform: TextureTransform::default(),
        }),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        double_sided: true,
        ..Material::default()
    };
    let pane = |color: Vec4| Material {
        base_color: color,
        alpha_mode: AlphaMode::Blend,
        double_sided: true,
        ..Material::default()
    };
    let floor = [Vec3::new(-3.0, -1.2, 3.0), Vec3::X * 6.0, Vec3::NEG_Z * 6.0];
    let texels = (0..64).map(|i: u32| {
        let (x, y) = (i % 8, i / 8);
        [60, 160, 40, if (x ^ y) & 2 == 0 || x == y { 255 } else { 0 }]
    });
    Scene {
        nodes: vec![Node {
            mesh: Some(0),
            ..Node::default()
        }],
        meshes: vec![Mesh {
            primitives: vec![
                squares(1, heap(40, 0.8).into_iter()),
                squares(0, [floor].into_iter().chain(heap(4, 0.4))),
                squares(2, heap(6, 1.0).into_iter()),
                squares(3, heap(6, 1.0).into_iter()),
            ],
            ..Mesh::default()
        }],
        materials: vec![
            Material::default(),
            leaf,
            pane(Vec4::new(0.9, 0.2, 0.1, 0.6)),
            pane(Vec4::new(0.1, 0.3, 1.0, 0.25)),
        ],
        images: vec![Image {
            name: "leaf".into(),
            width: 8,
            height: 8,
            texels: texels.collect(),
        }],
        samplers: vec![Sampler::default()],
        ..Scene::default()
    }
}

fn camera() -> PosedCamera {
    let (eye, forward) = (
        DVec3::new(0.4, 1.1, 3.2),
        DVec3::new(-0.1, -0.35, -1.0).normalize(),
    );
    PosedCamera {
        name: String::new(),
        eye,
        forward,
        up: DVec3::Y.reject_from_normalized(forward).normalize(),
        projection: Projection::Perspective {
            vfov: 0.9,
            aspect: None,
        },
    }
}

fn light(kind: LightKind, position: DVec3) -> PosedLight {
    PosedLight {
        name: String::new(),
        position,
        direction: DVec3::new(-0.3, -1.0, -0.2).normalize(),
        axis_x: DVec3::X,
        axis_y: DVec3::Y,
        power: Vec3::splat(3.0),
        range: f32::INFINITY,
        kind,
    }
}

struct Oracle<'a> {
    shader: &'a Shader<'a>,
    geometry: &'a FrameGeometry,
    camera: &'a CameraFrame,
    lights: &'a [PosedLight],
    bvh: &'a Bvh<'a>,
    options: &'a RenderOptions,
    opaque: &'a dyn Fn(u32) -> bool,
}

impl Oracle<'_> {
    /// What the light's triangles in between let through, by ascending id.
    fn passed(&self, receiver: &Receiver, light: &Light) -> Vec3 {
        let mut between = Vec::new();
        self.bvh.each_shadow(receiver, light, &mut (), |prim| {
            between.push(prim);
            ControlFlow::Continue(())
        });
        between.sort_unstable();
        if between.iter().any(|&prim| (self.opaque)(prim)) {
            return Vec3::ZERO;
        }
        let (origin, dir) = exact::shadow_line(receiver, light);
        between.iter().fold(Vec3::ONE, |passed, &prim| {
            let corners = triangles(self.geometry).corners(prim);
            let hit = exact::attributes(origin, dir, corners).expect("it was hit");
            let (object, uv) = (object_of(self.geometry, prim), [hit.u as f32, hit.v as f32]);
            let tinted = self.options.tinted_shadows;
            passed * self.shader.transmittance(self.geometry, prim, object, uv, tinted)
        })
    }

    /// Colour, alpha and first visible triangle of a pixel.
    fn pixel(&self, x: u32, y: u32) -> (Vec3, f32, u32) {
        let ray = self.camera.view(self.geometry).pixel_ray(x, y);
        let mut hits = Vec::new();
        self.bvh.along(&ray, &mut (), &mut hits);
        let (mut left, mut first) = (1.0_f32, NO_ID);
        let mut colors = Vec::new();
        for (t, prim) in hits {
            let corners = triangles(self.geometry).corners(prim);
            let hit = exact::attributes(ray.origin, ray.dir, corners).expect("it was hit");
            let point = SurfacePoint {
                prim,
                object: object_of(self.geometry, prim),
                u: hit.u as f32,
                v: hit.v as f32,
                view: (-ray.dir.normalize()).as_vec3(),
                footprint: self.camera.footprint(t as f32),
            };
            let surface = self.shader.surface(self.geometry, &point);
            let weight = left * surface.alpha;
            if weight > 0.0 {
                first = if first == NO_ID { prim } else { first };
                let mut color = ambient(&surface, self.options.ambient);
                let receiver = Receiver::along(&ray, t, prim);
                for light in self.lights {
                    let end = shadow_end(light, self.geometry.origin);
                    let seen = exact::side(corners, &self.camera.vantage());
                    let incident = direct(&surface, &ShadingLight::new(light, self.geometry.origin));
                    if let Some(incident) = incident.filter(|_| exact::side(corners, &end) * seen > 0.0) {
                        color += incident.radiance * self.passed(&receiver, &end);
                    }
                }
                colors.push(color * weight);
                left -= weight;
            }
            if left < 1.0 / 512.0 {
                left = 0.0;
                break;
            }
        }
        let background = self.options.background * left;
        (
            colors.into_iter().fold(background, |sum, c| sum + c),
            1.0 - left,
            first,
        )
    }
}

#[test]
fn grids_equal_the_hierarchy() {
    let scene = scene();
    let geometry = scene.at(0.0);
    let lights = [
        light(LightKind::Point { radius: 0.0 }, DVec3::new(1.0, 2.5, 1.5)),
        light(LightKind::Point { radius: 0.0 }, DVec3::new(0.1, 0.0, 0.05)),
        light(LightKind::Directional { half_angle: 0.0 }, DVec3::ZERO),
    ];
    let options = RenderOptions {
        width: 60,
        height: 44,
        layers: Layers::ALL,
        ..RenderOptions::default()
    };
    let camera_frame =
        CameraFrame::new(&camera(), geometry.origin, options.width, options.height).expect("valid");
    let (shader, bvh) = (Shader::new(&scene), Bvh::build(triangles(&geometry)));
    let opaque = |prim: u32| geometry.objects[object_of(&geometry, prim) as usize].material == 0;
    let mut pictures = Vec::new();
    for tinted_shadows in [false, true] {
        let options = RenderOptions {
            tinted_shadows,
            ..options
        };
        let oracle = Oracle {
            shader: &shader,
            geometry: &geometry,
            camera: &camera_frame,
            lights: &lights,
            bvh: &bvh,
            options: &options,
            opaque: &opaque,
        };
        let place = |i: u32| (i % options.width, i / options.width);
        let pixels = (0..options.width * options.height).map(place);
        let expected: Vec<_> = pixels.map(|(x, y)| oracle.pixel(x, y)).collect();
        for level in SimdLevel::available() {
            let options = RenderOptions { level, ..options };
            let film = Renderer::new(&scene)
                .render(&geometry, &camera(), &lights, &options, &|_| ())
                .expect("valid input")
                .film;
            for (i, want) in expected.iter().enumerate() {
                let got = (film.color[i], film.alpha[i], film.prim[i]);
                assert_eq!(got, *want, "{}, pixel {:?}", level.name(), place(i as u32));
            }
        }
        pictures.push(expected);
    }
    let partly = pictures[0].iter().filter(|p| p.1 > 0.0 && p.1 < 1.0).count();
    assert!(partly > 20, "{partly} pixels are covered in part");
    let colored = pictures[0]
        .iter()
        .zip(&pictures[1])
        .filter(|(a, b)| a.0 != b.0)
        .count();
    assert!(colored > 100, "{colored} pixels are tinted");
}
