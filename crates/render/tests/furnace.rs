//! Energy: what a surface reflects under a sky of radiance 1 is its albedo, known in closed form or bounded.

use glam::{DVec3, Vec3};
use rayward::shade::{Anisotropy, Coat, SurfaceFinish, brdf, lobes};
use rayward::{ShadingLight, Surface, shade};
use rayward_scene::{LightKind, PosedLight};

/// A surface in the XY plane, seen from `angle` off its normal.
fn surface(angle: f32, metallic: f32, roughness: f32) -> Surface {
    Surface {
        position: Vec3::ZERO,
        geometric_normal: Vec3::Z,
        normal: Vec3::Z,
        view: Vec3::new(angle.sin(), 0.0, angle.cos()),
        base_color: Vec3::ONE,
        alpha: 1.0,
        metallic,
        roughness,
        f0: Vec3::splat(0.04),
        specular: 1.0,
        transmission: 0.0,
        ior: 1.5,
        thin: true,
        absorption: Vec3::ZERO,
        emissive: Vec3::ZERO,
        occlusion: 1.0,
        unlit: false,
        front: true,
        finish: SurfaceFinish::NONE,
        coat: Coat::NONE,
    }
}

/// Reflected radiance under a sky of radiance 1: directional lights at equal steps of height and azimuth, which
/// are equal solid angles, each with the illuminance of its piece of the sky.
fn reflected(surface: &Surface) -> f32 {
    const RINGS: u32 = 400;
    const SECTORS: u32 = 800;
    let solid_angle = std::f32::consts::TAU / (RINGS * SECTORS) as f32;
    let mut sum = 0.0;
    for ring in 0..RINGS {
        let height = (f64::from(ring) + 0.5) / f64::from(RINGS);
        let radius = (1.0 - height * height).sqrt();
        for sector in 0..SECTORS {
            let azimuth = std::f64::consts::TAU * (f64::from(sector) + 0.5) / f64::from(SECTORS);
            let light = PosedLight {
                name: String::new(),
                position: DVec3::ZERO,
                direction: -DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), height),
                axis_x: DVec3::X,
                axis_y: DVec3::Y,
                power: Vec3::splat(solid_angle),
                range: f32::INFINITY,
                kind: LightKind::Directional { half_angle: 0.0 },
            };
            let light = ShadingLight::new(&light, DVec3::ZERO);
            sum += shade::direct(surface, &light).map_or(0.0, |incident| f64::from(incident.radiance.y));
        }
    }
    sum as f32
}

#[test]
fn a_diffuse_surface_reflects_its_albedo() {
    for angle in [0.0f32, 0.8, 1.4] {
        let mut matte = surface(angle, 0.0, 1.0);
        matte.specular = 0.0;
        matte.base_color = Vec3::new(0.2, 0.6, 1.0);
        let got = reflected(&matte);
        assert!((got - 0.6).abs() < 1e-4, "{got} at {angle}");
    }
}

#[test]
fn metals_reflect_no_more_than_they_receive() {
    for roughness in [0.3, 0.5, 0.75, 1.0] {
        for angle in [0.0f32, 0.7, 1.2, 1.5] {
            let got = reflected(&surface(angle, 1.0, roughness));
            assert!(got < 1.001, "{got} at roughness {roughness} angle {angle}");
        }
    }
}

#[test]
fn dielectrics_gain_no_more_than_the_model_does() {
    // The specification's mix takes the diffuse share from the half vector, not from what the lobe reflects in
    // all: a white dielectric gains up to a third at 86 degrees off the normal, less elsewhere. No more than that.
    for roughness in [0.3, 0.5, 0.75, 1.0] {
        for angle in [0.0f32, 0.7, 1.2, 1.5] {
            let got = reflected(&surface(angle, 0.0, roughness));
            assert!(
                (0.9..1.01 + 0.15 * angle * angle).contains(&got),
                "{got} at roughness {roughness} angle {angle}"
            );
        }
    }
}

#[test]
fn a_smooth_white_metal_reflects_nearly_everything() {
    for angle in [0.0f32, 0.5, 1.0] {
        let got = reflected(&surface(angle, 1.0, 0.3));
        assert!((0.97..1.001).contains(&got), "{got} at {angle}");
    }
}

#[test]
fn a_rough_white_metal_loses_what_is_known() {
    // At alpha 1, seen head on, D = 1 / pi and V = 1 / (2 (1 + cos)), which integrates to 1 - ln 2.
    let got = reflected(&surface(0.0, 1.0, 1.0));
    assert!((got - (1.0 - 2f32.ln())).abs() < 1e-4, "{got}");
}

/// Evenly spread pairs of random numbers.
fn pairs(side: u16) -> impl Iterator<Item = [f32; 2]> {
    let middle = move |i: u16| (f32::from(i) + 0.5) / f32::from(side);
    (0..side).flat_map(move |i| (0..side).map(move |j| [middle(i), middle(j)]))
}

/// Mean of a function of directions over the hemisphere, times its solid angle and the cosine.
fn over_hemisphere(value: impl Fn(Vec3) -> Vec3) -> Vec3 {
    const N: u16 = 600;
    let sum: DVec3 = pairs(N)
        .map(|[height, azimuth]| {
            let radius = (1.0 - height * height).sqrt();
            let (sin, cos) = (azimuth * std::f32::consts::TAU).sin_cos();
            (value(Vec3::new(radius * cos, radius * sin, height)) * height).as_dvec3()
        })
        .sum();
    (sum * (std::f64::consts::TAU / f64::from(N) / f64::from(N))).as_vec3()
}

#[test]
fn drawn_reflections_bring_what_the_model_reflects() {
    for (roughness, metallic, strength) in
        [(0.3, 1.0, 0.0), (0.6, 0.0, 0.0), (1.0, 0.5, 0.0), (0.5, 1.0, 0.7)]
    {
        for angle in [0.0f32, 0.8, 1.3] {
            let mut surface = surface(angle, metallic, roughness);
            surface.finish.anisotropy = Anisotropy {
                strength,
                direction: Vec3::new(0.8, 0.6, 0.3),
            };
            surface.base_color = Vec3::new(0.9, 0.5, 0.1);
            let exact = over_hemisphere(|towards| brdf::specular(&surface, towards));
            let mut drawn = Vec3::ZERO;
            for random in pairs(256) {
                if let Some(lobe) = lobes::reflected(&surface, random) {
                    drawn += lobe.weight / 65536.0;
                    // A weight is the model times the cosine over the density.
                    let model = brdf::specular(&surface, lobe.towards) * lobe.towards.z / lobe.density;
                    assert!(
                        (model - lobe.weight).abs().max_element() < 2e-2 * lobe.weight.max_element() + 1e-4
                    );
                }
            }
            assert!(
                (drawn - exact).abs().max_element() < 0.01,
                "{drawn} {exact} at {roughness}, {angle}"
            );
            let whole = over_hemisphere(|towards| {
                Vec3::splat(lobes::reflection_density(&surface, towards) / towards.z)
            });
            assert!(whole.x < 1.01, "a density is no more than 1 in all: {whole}");
        }
    }
}

#[test]
fn drawn_diffusion_brings_what_the_model_diffuses() {
    let mut matte = surface(0.7, 0.2, 0.9);
    matte.base_color = Vec3::new(0.9, 0.5, 0.1);
    let exact = over_hemisphere(|towards| brdf::diffuse(&matte, towards));
    let drawn: Vec3 = pairs(256)
        .filter_map(|random| lobes::diffused(&matte, random))
        .map(|lobe| lobe.weight / 65536.0)
        .sum();
    assert!((drawn - exact).abs().max_element() < 2e-3, "{drawn} {exact}");
}

/// Clear glass seen from an angle, from outside or from within.
fn glass(angle: f32, front: bool) -> Surface {
    Surface {
        transmission: 1.0,
        thin: false,
        front,
        ..surface(angle, 0.0, 0.0)
    }
}

#[test]
fn glass_bends_light_by_snell_and_loses_none() {
    for (angle, front) in [
        (0.0f32, true),
        (0.6, true),
        (1.4, true),
        (0.3, false),
        (0.7, false),
    ] {
        let glass = glass(angle, front);
        let through = lobes::transmitted(&glass, [0.5; 2]).expect("below the critical angle");
        let back = lobes::reflected(&glass, [0.5; 2]).expect("a mirror always reflects");
        assert!((through.weight + back.weight - Vec3::ONE).abs().max_element() < 1e-5);
        let ratio = if front { 1.0 / 1.5 } else { 1.5 };
        let sin = through.towards.x.hypot(through.towards.y);
        assert!(
            (sin - angle.sin() * ratio).abs() < 1e-5 && through.towards.z < 0.0,
            "{through:?}"
        );
    }
    // Head on 4 %, and Fresnel's value at 60 degrees for 1.5.
    assert!((lobes::reflected(&glass(0.0, true), [0.5; 2]).unwrap().weight.x - 0.04).abs() < 1e-5);
    let slanted = lobes::reflected(&glass(std::f32::consts::FRAC_PI_3, true), [0.5; 2]).unwrap();
    assert!((slanted.weight.x - 0.089_2).abs() < 1e-4, "{slanted:?}");
}

#[test]
fn glass_reflects_all_beyond_the_critical_angle() {
    let within = glass(0.8, false);
    assert_eq!(lobes::transmitted(&within, [0.5; 2]), None);
    assert_eq!(lobes::reflected(&within, [0.5; 2]).unwrap().weight, Vec3::ONE);
}

#[test]
fn thin_walls_are_passed_straight() {
    let mut wall = glass(0.9, false);
    wall.thin = true;
    wall.base_color = Vec3::new(1.0, 0.5, 0.25);
    let through = lobes::transmitted(&wall, [0.5; 2]).unwrap();
    assert_eq!(through.towards, -wall.view);
    assert!((through.weight.x / through.weight.y - 2.0).abs() < 1e-6);
    // A frosted one spreads the same light about that direction.
    wall.roughness = 0.3;
    let spread: Vec<_> = pairs(64)
        .filter_map(|random| lobes::transmitted(&wall, random))
        .collect();
    let mean = spread.iter().map(|lobe| lobe.towards).sum::<Vec3>().normalize();
    assert!(mean.dot(-wall.view) > 0.97, "{mean}");
    assert!(
        spread
            .iter()
            .all(|lobe| lobe.towards.z < 0.0 && lobe.weight.x <= 1.0)
    );
}
