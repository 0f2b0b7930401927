//! Lights with a size in mirrors and glossy floors: against closed forms, and against what samples of the light alone bring.

use glam::{DVec3, Vec3, Vec4};
use rayward::scene::{Coat, FrameGeometry, LightKind, Material, PosedCamera, PosedLight, Scene, builtin};
use rayward::{CameraFrame, Film, RenderOptions, Renderer};

const EYE: DVec3 = DVec3::new(0.0, 2.0, 4.0);
const MIDDLE: DVec3 = DVec3::new(0.0, 2.0, -4.0);
const POWER: f32 = 3.0;

/// A wide floor at height 0.
fn floor(material: Material) -> (Scene, FrameGeometry) {
    let mut scene = builtin::build("blob-1k").expect("it exists");
    scene.materials.fill(material);
    let mut geometry = scene.at(0.0);
    geometry.x = vec![-50.0, 50.0, 50.0, -50.0];
    geometry.y = vec![0.0; 4];
    geometry.z = vec![50.0, 50.0, -50.0, -50.0];
    geometry.attributes = Default::default();
    geometry.origin = DVec3::ZERO;
    geometry.indices = vec![[0, 1, 2], [0, 2, 3]];
    geometry.objects.truncate(1);
    geometry.objects[0].triangles = 0..2;
    geometry.objects[0].vertices = 0..4;
    (scene, geometry)
}

/// A light behind the floor that shines towards the eye.
fn light(kind: LightKind) -> PosedLight {
    PosedLight {
        name: String::new(),
        position: MIDDLE,
        direction: match kind {
            LightKind::Directional { .. } => DVec3::new(0.0, -2.0, 4.0).normalize(),
            _ => DVec3::Z,
        },
        axis_x: DVec3::X,
        axis_y: DVec3::Y,
        power: Vec3::splat(POWER),
        range: f32::INFINITY,
        kind,
    }
}

fn camera(geometry: &FrameGeometry) -> PosedCamera {
    PosedCamera {
        eye: EYE,
        forward: DVec3::new(0.0, -2.0, -4.0).normalize(),
        up: DVec3::Y,
        ..geometry.cameras[0].clone()
    }
}

fn render(material: Material, kind: LightKind, options: &RenderOptions) -> Film {
    let (scene, geometry) = floor(material);
    let options = RenderOptions {
        ambient: Vec3::ZERO,
        background: Vec3::ZERO,
        ..*options
    };
    let camera = camera(&geometry);
    Renderer::new(&scene)
        .render(&geometry, &camera, &[light(kind)], &options, &|_| ())
        .expect("valid input")
        .film
}

fn metal(roughness: f32) -> Material {
    Material {
        metallic: 1.0,
        roughness,
        base_color: Vec4::new(0.8, 0.8, 0.8, 1.0),
        ..Material::default()
    }
}

const KINDS: [LightKind; 4] = [
    LightKind::Rectangle {
        width: 2.0,
        height: 1.0,
    },
    LightKind::Disk { radius: 0.7 },
    LightKind::Point { radius: 0.7 },
    LightKind::Directional { half_angle: 0.1 },
];

/// Radiance of the light from a point in a direction; `None` within a hundredth of its rim.
fn radiance(kind: LightKind, from: DVec3, dir: DVec3) -> Option<f64> {
    let pi = std::f64::consts::PI;
    let at = from + dir * ((MIDDLE.z - from.z) / dir.z) - MIDDLE;
    // How far from the middle, of 1 at the rim, and the radiance within.
    let (share, radiance) = match kind {
        LightKind::Rectangle { width, height } => {
            let [x, y] = [at.x / f64::from(width), at.y / f64::from(height)];
            (2.0 * x.abs().max(y.abs()), 1.0)
        }
        LightKind::Disk { radius } => (at.length() / f64::from(radius), 1.0),
        LightKind::Point { radius } => {
            let beside = (MIDDLE - from).cross(dir).length();
            (beside / f64::from(radius), 1.0 / (pi * f64::from(radius).powi(2)))
        }
        LightKind::Directional { half_angle } => {
            let towards = DVec3::new(0.0, 2.0, -4.0).normalize();
            let tan = f64::from(half_angle).tan();
            let cos = towards.dot(dir);
            // A disk of directions whose density is that of its plane.
            (
                towards.cross(dir).length() / cos / tan,
                1.0 / (pi * tan * tan * cos.powi(3)),
            )
        }
        _ => unreachable!("none of these"),
    };
    let within = if share < 1.0 {
        radiance * f64::from(POWER)
    } else {
        0.0
    };
    ((share - 1.0).abs() > 0.01).then_some(within)
}

#[test]
fn a_mirror_shows_the_shape_of_a_light() {
    let options = RenderOptions {
        width: 60,
        height: 45,
        bounces: 1,
        samples: 2,
        ..RenderOptions::default()
    };
    let black_with_coat = Material {
        base_color: Vec4::new(0.0, 0.0, 0.0, 1.0),
        specular: 0.0,
        coat: Coat {
            factor: 1.0,
            ..Coat::default()
        },
        ..Material::default()
    };
    for kind in KINDS {
        for (material, head_on) in [(metal(0.0), 0.8), (black_with_coat.clone(), 0.04)] {
            let film = render(material.clone(), kind, &options);
            let (_, geometry) = floor(material);
            let frame = CameraFrame::new(&camera(&geometry), DVec3::ZERO, 60, 45).expect("valid");
            let view = frame.view(&geometry);
            let mut shown = 0;
            for (i, color) in (0u32..).zip(&film.color) {
                let dir = view.pixel_ray(i % 60, i / 60).dir.normalize();
                if dir.y > -1e-3 {
                    continue;
                }
                let at = EYE - dir * (EYE.y / dir.y);
                let Some(radiance) = radiance(kind, at, DVec3::new(dir.x, -dir.y, dir.z)) else {
                    continue;
                };
                let reflectance = head_on + (1.0 - head_on) * (1.0 + dir.y).powi(5);
                let want = radiance * reflectance;
                shown += u32::from(want > 0.0);
                assert!(
                    (f64::from(color.x) - want).abs() < 1e-3 * want.max(1.0),
                    "{color} for {want} in {kind:?} at {i}"
                );
            }
            assert!(shown > 10, "{shown} of {kind:?}");
        }
    }
}

#[test]
fn glossy_floors_receive_what_samples_of_the_light_bring() {
    let mean = |film: &Film| {
        let sum: f64 = film.color.iter().map(|color| f64::from(color.x)).sum();
        sum / film.color.len() as f64
    };
    let coated = Material {
        coat: Coat {
            factor: 1.0,
            roughness: 0.3,
            ..Coat::default()
        },
        ..metal(0.35)
    };
    for kind in KINDS {
        for material in [metal(0.3), coated.clone()] {
            let of = |bounces, samples| {
                let options = RenderOptions {
                    width: 16,
                    height: 12,
                    bounces,
                    samples,
                    pixel_samples: 4,
                    ..RenderOptions::default()
                };
                mean(&render(material.clone(), kind, &options))
            };
            let (both, samples) = (of(1, 32), of(0, 256));
            assert!(
                (both / samples - 1.0).abs() < 0.03,
                "{both} for {samples} of {kind:?}"
            );
        }
    }
}
