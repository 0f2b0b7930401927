//! Films, sheen and anisotropy against the formulas of their extensions, written out in double precision.

use std::f64::consts::PI;

use glam::{DVec3, Vec2, Vec3, Vec4};
use rayward::shade::{self, Iridescence, Sheen, SurfaceFinish};
use rayward::{Shader, ShadingLight, Surface, SurfacePoint};
use rayward_scene::{
    Anisotropy, FrameGeometry, Image, LightKind, Material, ObjectRange, PosedLight, Sampler, Scene,
    TextureRef, TextureTransform, VertexAttributes,
};

const BASE: DVec3 = DVec3::new(0.8, 0.5, 0.2);

fn direction(polar: f64, azimuth: f64) -> DVec3 {
    let (polar, azimuth) = (polar.to_radians(), azimuth.to_radians());
    DVec3::new(
        polar.sin() * azimuth.cos(),
        polar.sin() * azimuth.sin(),
        polar.cos(),
    )
}

/// A light of 1 lux from this direction.
fn sun(towards: DVec3) -> ShadingLight {
    let light = PosedLight {
        name: String::new(),
        position: DVec3::ZERO,
        direction: -towards,
        axis_x: DVec3::X,
        axis_y: DVec3::Y,
        power: Vec3::ONE,
        range: f32::INFINITY,
        kind: LightKind::Directional { half_angle: 0.0 },
    };
    ShadingLight::new(&light, DVec3::ZERO)
}

/// A triangle in the XY plane whose texture has u along X, with tangents along Y if asked for.
fn surface(material: Material, images: Vec<Image>, view: DVec3, tangents: bool) -> Surface {
    let geometry = FrameGeometry {
        x: vec![0.0, 1.0, 0.0],
        y: vec![0.0, 0.0, 1.0],
        z: vec![0.0; 3],
        indices: vec![[0, 1, 2]],
        attributes: VertexAttributes {
            uvs: vec![Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 0.0)],
            tangents: if tangents {
                vec![Vec4::new(0.0, 1.0, 0.0, 1.0); 3]
            } else {
                Vec::new()
            },
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
    let scene = Scene {
        materials: vec![material],
        samplers: vec![Sampler::default()],
        images,
        ..Scene::default()
    };
    let point = SurfacePoint {
        prim: 0,
        object: 0,
        u: 0.25,
        v: 0.5,
        view: view.as_vec3(),
        footprint: 0.0,
    };
    Shader::new(&scene).surface(&geometry, &point)
}

fn lit(surface: &Surface, light: DVec3) -> DVec3 {
    let incident = shade::direct(surface, &sun(light)).expect("it faces the light");
    incident.radiance.as_dvec3()
}

/// A material of this metalness and roughness.
fn material(metallic: f32, roughness: f32) -> Material {
    Material {
        base_color: BASE.as_vec3().extend(1.0),
        metallic,
        roughness,
        ..Material::default()
    }
}

fn texture(image: usize) -> Option<TextureRef> {
    Some(TextureRef {
        image,
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

#[track_caller]
fn same(got: DVec3, want: DVec3) {
    let off = (got - want).abs() / want.abs().max(DVec3::splat(1e-3));
    assert!(off.max_element() < 1e-4, "{got} for {want}");
}

/// Schlick's approximation of one number.
fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// `iridescent_fresnel` of the extension.
fn film(ior: f64, nanometres: f64, f0: DVec3, cos1: f64) -> DVec3 {
    let reflect = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let cos2 = (1.0 - (1.0 - cos1 * cos1) / (ior * ior)).sqrt();
    let r12 = schlick(reflect(ior, 1.0), cos1);
    let t121 = 1.0 - r12;
    let opd = 2.0 * ior * nanometres * cos2;
    let mut shift = [0.0; 3];
    let mut r23 = [0.0; 3];
    for c in 0..3 {
        let root = (f0[c] + 1e-4).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        r23[c] = schlick(reflect(base, ior), cos2);
        shift[c] = PI + if base < ior { PI } else { 0.0 };
    }
    let response = |m: f64| {
        let k = 2.0 * PI * m * opd * 1e-9;
        let gauss = |value: f64, place: f64, variance: f64, shift: f64| {
            value * (2.0 * PI * variance).sqrt() * (place * k + m * shift).cos() * (-k * k * variance).exp()
                / 1.0685e-7
        };
        let x =
            gauss(5.4856e-13, 1.6810e6, 4.3278e9, shift[0]) + gauss(9.7470e-14, 2.2399e6, 4.5282e9, shift[0]);
        let y = gauss(4.4201e-13, 1.7953e6, 9.3046e9, shift[1]);
        let z = gauss(5.2481e-13, 2.2084e6, 6.6121e9, shift[2]);
        DVec3::new(
            3.2404542 * x - 1.5371385 * y - 0.4985314 * z,
            -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
            0.0556434 * x - 0.2040259 * y + 1.0572252 * z,
        )
    };
    let (first, second) = (response(1.0), response(2.0));
    let color = |c: usize| {
        let r123 = (r12 * r23[c]).clamp(1e-5, 0.9999);
        let rs = t121 * t121 * r23[c] / (1.0 - r123);
        let cm = rs - t121;
        (r12 + rs + 2.0 * cm * r123.sqrt() * first[c] + 2.0 * cm * r123 * second[c]).max(0.0)
    };
    DVec3::new(color(0), color(1), color(2))
}

/// D V of the metallic-roughness model, with roughnesses along and across a direction.
fn lobe([along, across]: [DVec3; 2], [at, ab]: [f64; 2], view: DVec3, light: DVec3) -> f64 {
    let half = (view + light).normalize();
    let f = DVec3::new(ab * along.dot(half), at * across.dot(half), at * ab * half.z);
    let w2 = at * ab / f.length_squared();
    let d = at * ab * w2 * w2 / PI;
    let length = |v: DVec3| DVec3::new(at * along.dot(v), ab * across.dot(v), v.z).length();
    d * 0.5 / (light.z * length(view) + view.z * length(light))
}

const ANGLES: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [30.0, 35.0, 170.0],
    [60.0, 50.0, 90.0],
    [75.0, 70.0, 175.0],
    [20.0, 65.0, 40.0],
];

#[test]
fn films_agree_with_the_extension() {
    for [view, light, azimuth] in ANGLES {
        let [view, light] = [direction(view, 0.0), direction(light, azimuth)];
        let cos = view.dot((view + light).normalize());
        for (metallic, ior, least, most, textured) in [
            (1.0, 1.3, 100.0, 400.0, false),
            (1.0, 2.2, 100.0, 550.0, true),
            (0.0, 1.3, 100.0, 300.0, false),
            (0.0, 1.8, 50.0, 900.0, true),
            (0.3, 1.5, 200.0, 100.0, true),
        ] {
            let mut with = material(metallic, 0.5);
            with.specular = 0.7;
            with.iridescence.factor = 0.8;
            with.iridescence.ior = ior;
            (with.iridescence.thickness_min, with.iridescence.thickness_max) = (least, most);
            let (mut strength, mut share) = (0.8, 1.0);
            if textured {
                with.iridescence.texture = texture(0);
                with.iridescence.thickness_texture = texture(0);
                (strength, share) = (0.8 * 0.6, 0.2);
            }
            let seen = surface(with, vec![one_texel([153, 51, 0, 255])], view, false);
            let thickness = f64::from(least) + f64::from(most - least) * share;

            let fresnel = |f0: DVec3, weight: f64| {
                let bare = DVec3::from_array([0, 1, 2].map(|c| weight * schlick(f0[c], cos)));
                bare.lerp(film(f64::from(ior), thickness, weight * f0, cos), strength)
            };
            let of_metal = fresnel(BASE, 1.0);
            let of_dielectric = fresnel(DVec3::splat(0.04), f64::from(0.7f32));
            let spread = lobe([DVec3::X, DVec3::Y], [0.25; 2], view, light);
            let below = BASE / PI * (1.0 - of_dielectric.max_element()).max(0.0);
            let dielectric = below + of_dielectric * spread;
            let want = dielectric.lerp(of_metal * spread, f64::from(metallic)) * light.z;
            same(lit(&seen, light), want);
        }
    }
}

#[test]
fn a_film_of_no_strength_changes_nothing() {
    let view = direction(40.0, 0.0);
    let mut with = material(0.5, 0.3);
    with.iridescence.thickness_max = 700.0;
    with.sheen.roughness = 0.5;
    with.anisotropy.rotation = 1.0;
    let seen = surface(with, Vec::new(), view, true);
    assert_eq!(seen, surface(material(0.5, 0.3), Vec::new(), view, true));
    assert_eq!(seen.finish, SurfaceFinish::NONE);
    let bare = Vec3::new(0.1, 0.2, 0.3);
    assert_eq!(Iridescence::NONE.over(bare, Vec3::ONE, 0.3), bare);
}

#[test]
fn anisotropy_agrees_with_the_extension() {
    for [view, light, azimuth] in ANGLES {
        // Turned about the normal so that neither axis is special.
        let [view, light] = [direction(view, 25.0), direction(light, azimuth + 25.0)];
        for (strength, rotation, textured, tangents) in [
            (0.5, 0.0, false, false),
            (1.0, 0.7, false, true),
            (0.6, -2.0, true, false),
            (0.9, 0.3, true, true),
        ] {
            let mut with = material(1.0, 0.4);
            with.anisotropy = Anisotropy {
                strength,
                rotation,
                texture: texture(0).filter(|_| textured),
            };
            // Direction (0.6, 0.8), strength 0.6.
            let seen = surface(with, vec![one_texel([204, 230, 153, 255])], view, tangents);
            let (mut x, mut y, mut strength) = (1.0, 0.0, f64::from(strength));
            if textured {
                let (r, g) = (204.0 / 127.5 - 1.0, 230.0 / 127.5 - 1.0);
                let length = f64::hypot(r, g);
                (x, y, strength) = (r / length, g / length, strength * 0.6);
            }
            let (sin, cos) = f64::from(rotation).sin_cos();
            let (x, y) = (x * cos - y * sin, x * sin + y * cos);
            let [tangent, bitangent] = if tangents {
                [DVec3::Y, DVec3::NEG_X]
            } else {
                [DVec3::X, DVec3::Y]
            };
            let along = tangent * x + bitangent * y;
            let alpha = f64::from(0.4f32).powi(2);
            let alphas = [alpha + (1.0 - alpha) * strength * strength, alpha];
            let half_cos = view.dot((view + light).normalize());
            let fresnel = DVec3::from_array([0, 1, 2].map(|c| schlick(BASE[c], half_cos)));
            let spread = lobe([along, DVec3::Z.cross(along)], alphas, view, light);
            same(lit(&seen, light), fresnel * spread * light.z);
        }
    }
}

/// `sheenDistribution * sheenVisibility` of the extension.
fn sheen(roughness: f64, cos_view: f64, cos_light: f64, cos_half: f64) -> f64 {
    let alpha = roughness * roughness;
    let distribution =
        (2.0 + 1.0 / alpha) * (1.0 - cos_half * cos_half).max(0.0).powf(0.5 / alpha) / (2.0 * PI);
    let l = |x: f64| {
        let t = (1.0 - alpha).powi(2);
        let mix = |a: f64, b: f64| a * (1.0 - t) + b * t;
        mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * x.powf(mix(0.19823, 0.16801)))
            + mix(-1.97760, -1.27393) * x
            + mix(-4.32054, -4.85967)
    };
    let lambda = |cos: f64| {
        if cos < 0.5 {
            l(cos).exp()
        } else {
            (2.0 * l(0.5) - l(1.0 - cos)).exp()
        }
    };
    distribution / ((1.0 + lambda(cos_view) + lambda(cos_light)) * 4.0 * cos_view * cos_light)
}

/// What white sheen reflects of light from all around, by summing over a fine grid of directions.
fn sheen_albedo(roughness: f64, view: DVec3) -> f64 {
    const N: u32 = 400;
    let mut sum = 0.0;
    for i in 0..N {
        for j in 0..N {
            let [height, turn] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(N));
            let radius = (1.0 - height * height).sqrt();
            let light = DVec3::new(
                radius * (turn * 2.0 * PI).cos(),
                radius * (turn * 2.0 * PI).sin(),
                height,
            );
            let half = (view + light).normalize();
            sum += sheen(roughness, view.z, height, half.z) * height;
        }
    }
    sum * 2.0 * PI / f64::from(N * N)
}

#[test]
fn sheen_agrees_with_the_extension() {
    let color = Vec3::new(0.9, 0.3, 0.6);
    for [view, light, azimuth] in ANGLES {
        let [view, light] = [direction(view, 0.0), direction(light, azimuth)];
        for (roughness, textured) in [(0.3, false), (0.5, true), (1.0, false)] {
            let bare = lit(&surface(material(0.2, 0.6), Vec::new(), view, false), light);
            let mut with = material(0.2, 0.6);
            (with.sheen.color, with.sheen.roughness) = (color, roughness);
            let (mut tint, mut rough) = (color.as_dvec3(), f64::from(roughness));
            if textured {
                with.sheen.color_texture = texture(0);
                with.sheen.roughness_texture = texture(1);
                // 188 of 255 in sRGB is 0.5029.
                (tint, rough) = (tint * 0.502_886_5, rough * 0.8);
            }
            let images = vec![one_texel([188, 188, 188, 255]), one_texel([0, 0, 0, 204])];
            let seen = surface(with, images, view, false);
            let passed = f64::from(seen.finish.sheen.passed);
            let half = (view + light).normalize();
            let own = sheen(rough, view.z, light.z, half.z) * light.z;
            same(lit(&seen, light), tint * own + bare * passed);

            let want = 1.0 - tint.max_element() * sheen_albedo(rough, view);
            assert!((passed - want).abs() < 5e-3, "{passed} for {want}");
            // Sheen and what is below take their parts of a white surrounding.
            let around = shade::ambient(&seen, Vec3::ONE).as_dvec3();
            let reflected = seen.finish.sheen.reflectance.as_dvec3();
            assert!((around - (BASE * passed + reflected)).abs().max_element() < 1e-5);
            assert!((reflected - tint * sheen_albedo(rough, view)).abs().max_element() < 5e-3);
        }
    }
    assert_eq!(Sheen::NONE.evaluate(Vec3::Z, Vec3::Z, Vec3::Z), Vec3::ZERO);
}
