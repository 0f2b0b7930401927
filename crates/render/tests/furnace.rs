//! Energy: what a surface reflects under a sky of radiance 1 is its albedo, known in closed form or bounded.

use glam::{DVec3, Vec3};
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
        emissive: Vec3::ZERO,
        occlusion: 1.0,
        unlit: false,
        front: true,
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
