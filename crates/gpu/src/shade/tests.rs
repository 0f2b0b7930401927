//! Both shaders against the CPU's own shading, point by point.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use rayward::scene::{
    AlphaMode, Coat, FrameGeometry, Image, LightKind, Material, ObjectRange, PosedLight, Sampler, Scene,
    TextureRef, TextureTransform, VertexAttributes, Wrap,
};
use rayward::shade::{Coat as SurfaceCoat, SurfaceFinish, Traced};
use rayward::trace::Light;
use rayward::{
    Beam, CpuShading, Shader, ShadingBuilder, ShadingLight, Source, Surface, SurfacePoint, triangles,
};

use super::{GpuShading, ShadeStats};
use crate::tests::{Numbers, gpu};
use crate::{CubeOptions, Error, GpuSecondary};

/// How many triangles there are.
const TRIANGLES: u32 = 600;
/// How many share a material.
const OF_A_MATERIAL: u32 = 4;

fn device() -> Option<Arc<GpuSecondary>> {
    let gpu = gpu()?;
    Some(Arc::new(GpuSecondary::new(gpu, CubeOptions::default())))
}

/// A number in [0, 1).
fn part(numbers: &mut Numbers) -> f32 {
    0.5 + 0.5 * numbers.next()
}

fn color(numbers: &mut Numbers) -> Vec3 {
    Vec3::new(part(numbers), part(numbers), part(numbers))
}

/// Every wrapping, filtering and use of mipmaps.
fn samplers() -> Vec<Sampler> {
    let wraps = [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge];
    let each = |i: usize| Sampler {
        wrap_u: wraps[i % 3],
        wrap_v: wraps[i / 3 % 3],
        mag_nearest: i / 9 % 2 == 1,
        min_nearest: i / 18 % 2 == 1,
        mipmaps: i / 36 % 2 == 1,
    };
    (0..72).map(each).collect()
}

/// Images whose levels are even, odd, one texel, and a row.
fn images(numbers: &mut Numbers) -> Vec<Image> {
    let sizes = [[16, 8], [7, 5], [1, 1], [13, 1], [32, 32]];
    let image = |[width, height]: [u32; 2]| Image {
        name: String::new(),
        width,
        height,
        texels: (0..width * height)
            .map(|_| [(); 4].map(|()| (part(numbers) * 256.0) as u8))
            .collect(),
    };
    sizes.map(image).into()
}

fn texture(numbers: &mut Numbers, sampler: usize) -> TextureRef {
    TextureRef {
        image: (part(numbers) * 5.0) as usize,
        sampler,
        uv_set: u8::from(numbers.next() > 0.0),
        transform: TextureTransform {
            offset: Vec2::new(numbers.next(), numbers.next()),
            rotation: numbers.next() * 3.0,
            scale: Vec2::new(0.5 + part(numbers), -0.5 - part(numbers)),
        },
    }
}

/// A material that has each kind of texture, or has it not, by the bits of its number.
fn material(numbers: &mut Numbers, number: usize) -> Material {
    let mut some =
        |bit: usize| (((number * 7) >> bit) & 1 == 0).then(|| texture(numbers, (number * 11 + bit) % 72));
    let textures: Vec<Option<TextureRef>> = (0..11).map(&mut some).collect();
    Material {
        base_color: color(numbers).extend(part(numbers)),
        base_color_texture: textures[0],
        metallic: [0.0, 1.0, part(numbers)][number % 3],
        roughness: 0.2 + 0.8 * part(numbers),
        metallic_roughness_texture: textures[1],
        normal_texture: textures[2],
        normal_scale: 0.5 + part(numbers),
        occlusion_texture: textures[3],
        occlusion_strength: part(numbers),
        emissive: color(numbers),
        emissive_texture: textures[4],
        alpha_mode: [
            AlphaMode::Opaque,
            AlphaMode::Mask { cutoff: 0.3 },
            AlphaMode::Blend,
        ][number / 2 % 3],
        unlit: number % 13 == 12,
        transmission: [0.0, part(numbers)][number / 3 % 2],
        transmission_texture: textures[7],
        ior: 1.0 + part(numbers),
        thickness: [0.0, 1.0][number / 5 % 2],
        attenuation_distance: 2.0,
        attenuation_color: color(numbers),
        specular: part(numbers),
        specular_texture: textures[5],
        specular_color: color(numbers) * 1.5,
        specular_color_texture: textures[6],
        coat: Coat {
            factor: [0.0, 0.3 + part(numbers) * 0.7][number / 4 % 2],
            roughness: 0.2 + 0.8 * part(numbers),
            texture: textures[8],
            roughness_texture: textures[9],
            normal_texture: textures[10],
            normal_scale: 0.5 + part(numbers),
        },
        ..Material::default()
    }
}

fn scene() -> Scene {
    let mut numbers = Numbers(77);
    let images = images(&mut numbers);
    let materials = (0..(TRIANGLES / OF_A_MATERIAL) as usize).map(|i| material(&mut numbers, i));
    Scene {
        materials: materials.collect(),
        images,
        samplers: samplers(),
        ..Scene::default()
    }
}

/// Which attributes vertices have: all, or none, or one of them not.
fn geometry(left_out: Option<usize>) -> FrameGeometry {
    let mut numbers = Numbers(5);
    let count = 3 * TRIANGLES as usize;
    let mut points = Vec::new();
    for _ in 0..TRIANGLES {
        let middle = numbers.point() * 3.0;
        points.extend([(); 3].map(|()| middle + numbers.point() * 0.5));
    }
    let has = |attribute: usize| left_out != Some(attribute) && left_out != Some(9);
    let vertices = |attribute: usize| if has(attribute) { count } else { 0 };
    // Some triangles have no normals or tangents of their own.
    let normals = (0..vertices(0)).map(|i| {
        let own = numbers.point().normalize_or(Vec3::Z) * 0.3;
        let plane = points[i / 3 * 3..i / 3 * 3 + 3].to_vec();
        let plane = (plane[1] - plane[0])
            .cross(plane[2] - plane[0])
            .normalize_or(Vec3::Z);
        if i / 3 % 7 == 6 {
            Vec3::ZERO
        } else {
            (plane + own).normalize()
        }
    });
    let normals = normals.collect();
    let side = |x: f32| if x < 0.0 { -1.0 } else { 1.0 };
    let tangents = (0..vertices(1)).map(|i| {
        let along = numbers.point().normalize_or(Vec3::X);
        if i / 3 % 5 == 4 {
            Vec4::ZERO
        } else {
            along.extend(side((i / 3 % 2) as f32 - 0.5))
        }
    });
    let tangents = tangents.collect();
    let mut uv = |_: usize| Vec2::new(numbers.next(), numbers.next()) * 2.5;
    let uvs = (0..vertices(2)).map(&mut uv).collect();
    let uvs1 = (0..vertices(3)).map(&mut uv).collect();
    let colors = (0..vertices(4))
        .map(|_| color(&mut numbers).extend(part(&mut numbers)))
        .collect();
    FrameGeometry {
        x: points.iter().map(|p| p.x).collect(),
        y: points.iter().map(|p| p.y).collect(),
        z: points.iter().map(|p| p.z).collect(),
        indices: (0..TRIANGLES).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        attributes: VertexAttributes {
            normals,
            tangents,
            uvs,
            uvs1,
            colors,
        },
        objects: (0..TRIANGLES / OF_A_MATERIAL)
            .map(|i| ObjectRange {
                triangles: i * OF_A_MATERIAL..(i + 1) * OF_A_MATERIAL,
                vertices: 3 * i * OF_A_MATERIAL..3 * (i + 1) * OF_A_MATERIAL,
                material: i,
                node: 0,
                double_sided: true,
            })
            .collect(),
        ..FrameGeometry::default()
    }
}

fn points(geometry: &FrameGeometry, each: u32) -> Vec<SurfacePoint> {
    let mut numbers = Numbers(31);
    let point = |i: u32| {
        let prim = i % TRIANGLES;
        let (mut u, mut v) = (part(&mut numbers), part(&mut numbers));
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let plane = triangles(geometry).normal(prim).as_vec3().normalize();
        // Not seen edge-on: there rounding decides which side is seen.
        let view = (plane * if i.is_multiple_of(2) { 1.0 } else { -1.0 } + numbers.point() * 0.6).normalize();
        // From a share of a texel to many.
        let footprint = [0.0, 1e-4, 0.02, 0.3][i as usize / 2 % 4] * (0.3 + part(&mut numbers));
        SurfacePoint {
            prim,
            object: prim / OF_A_MATERIAL,
            u,
            v,
            view,
            footprint,
        }
    };
    (0..each * TRIANGLES).map(point).collect()
}

/// All numbers of a surface that are to agree.
fn numbers_of(s: &Surface) -> Vec<f32> {
    let vectors = [
        s.position,
        s.geometric_normal,
        s.normal,
        s.view,
        s.base_color,
        s.f0,
        s.absorption,
        s.emissive,
        s.coat.normal,
    ];
    let scalars = [
        s.alpha,
        s.metallic,
        s.roughness,
        s.specular,
        s.transmission,
        s.ior,
        s.occlusion,
        s.coat.reflectance,
        s.coat.passed,
        s.coat.roughness,
    ];
    vectors.iter().flat_map(Vec3::to_array).chain(scalars).collect()
}

#[test]
fn surfaces_are_the_cpus_but_for_rounding() {
    let Some(device) = device() else { return };
    let scene = scene();
    let shader = Shader::new(&scene);
    let shading = GpuShading::new(&device, &shader).expect("it fits");
    let mut asked = 0;
    for left_out in [None, Some(0), Some(1), Some(2), Some(3), Some(4), Some(9)] {
        let geometry = geometry(left_out);
        let points = points(&geometry, 6);
        let frame = shading.build(&geometry, &[]).expect("it fits");
        let made = frame.surfaces(&points).expect("a working device");
        let cpu = CpuShading {
            shader: &shader,
            geometry: &geometry,
            lights: &[],
        };
        let mut off = 0;
        for (i, (made, own)) in made.iter().zip(cpu.surfaces(&points)).enumerate() {
            assert_eq!(
                (made.thin, made.unlit, made.front),
                (own.thin, own.unlit, own.front)
            );
            let differs = |(a, b): (&f32, &f32)| (a - b).abs() > 1e-4 * b.abs().max(0.1);
            let (a, b) = (numbers_of(made), numbers_of(&own));
            if a.iter().zip(&b).any(differs) {
                off += 1;
                // Rounding decides between two texels or sides of a cutoff here and there, and nothing else.
                assert!(
                    off <= points.len() / 500,
                    "{left_out:?}: point {i} of {off}: {made:?}\n{own:?}"
                );
            }
        }
        asked += points.len() as u64;
    }
    assert_eq!(
        shading.stats(),
        ShadeStats {
            surfaces: asked,
            beams: 0
        }
    );
    assert_eq!(shading.problem(), None);
}

fn unit(numbers: &mut Numbers) -> Vec3 {
    numbers.point().normalize_or(Vec3::Y)
}

/// A surface that may be of any material; of every third everything is a mirror.
fn random_surface(numbers: &mut Numbers, i: usize) -> Surface {
    let geometric_normal = unit(numbers);
    let near = |numbers: &mut Numbers, by: f32| (geometric_normal + unit(numbers) * by).normalize();
    let reflectance = [0.0, 0.1 + 0.8 * part(numbers)][i / 2 % 2];
    Surface {
        position: numbers.point(),
        geometric_normal,
        normal: near(numbers, 0.4),
        view: near(numbers, 0.9),
        base_color: color(numbers),
        alpha: 1.0,
        metallic: [0.0, 1.0, part(numbers)][i % 3],
        roughness: [0.1 + 0.9 * part(numbers), 0.35, 0.02][i % 3],
        f0: color(numbers) * 0.1,
        specular: part(numbers),
        transmission: [0.0, part(numbers)][i / 3 % 2],
        ior: 1.1 + part(numbers),
        thin: (i / 5).is_multiple_of(2),
        absorption: Vec3::ZERO,
        emissive: color(numbers),
        occlusion: part(numbers),
        unlit: i % 17 == 16,
        front: (i / 7).is_multiple_of(2),
        finish: SurfaceFinish::NONE,
        coat: SurfaceCoat {
            reflectance,
            passed: 1.0 - reflectance,
            roughness: [0.3, 0.02][i / 4 % 2],
            normal: near(numbers, 0.4),
        },
    }
}

/// One light of each kind, and the same with a range.
fn shading_lights(numbers: &mut Numbers) -> Vec<ShadingLight> {
    let kinds = [
        LightKind::Directional { half_angle: 0.1 },
        LightKind::Point { radius: 0.0 },
        LightKind::Point { radius: 0.8 },
        LightKind::Spot {
            inner: 0.3,
            outer: 1.2,
            radius: 0.1,
        },
        LightKind::Rectangle {
            width: 0.5,
            height: 2.0,
        },
        LightKind::Disk { radius: 0.7 },
    ];
    let light = |i: usize| {
        let light = PosedLight {
            name: String::new(),
            position: (numbers.point() * 2.0).as_dvec3(),
            direction: unit(numbers).as_dvec3(),
            axis_x: glam::DVec3::X,
            axis_y: glam::DVec3::Y,
            power: color(numbers) * 5.0,
            range: [f32::INFINITY, 4.0][i / 6],
            kind: kinds[i % 6],
        };
        ShadingLight::new(&light, glam::DVec3::ZERO)
    };
    (0..12).map(light).collect()
}

/// Beams of every kind that reach a surface.
fn beams(numbers: &mut Numbers, surface: u32) -> Vec<Beam> {
    let mut beam = |source| Beam {
        surface,
        share: color(numbers),
        source,
    };
    let bits = surface as usize;
    let traced = Traced {
        reflection: bits.is_multiple_of(2),
        transmission: (bits / 2).is_multiple_of(2),
        diffusion: (bits / 4).is_multiple_of(2),
        coat: (bits / 8).is_multiple_of(2),
    };
    let mut all = vec![beam(Source::Around {
        radiance: Vec3::new(0.3, 0.4, 0.5),
        traced,
    })];
    all.extend((0..12).map(|light| beam(Source::Light(light))));
    for k in 0..24 {
        let drawn = [[0, 0], [3, 0], [0, 2], [5, 4]][k as usize % 4];
        let end = numbers.point() * 2.0;
        let end = if k % 6 == 0 {
            Light::Directional(end)
        } else {
            Light::Point(end)
        };
        let source = Source::Sample {
            light: k % 12,
            end,
            density: part(numbers) * 20.0,
            drawn,
        };
        all.push(Beam {
            surface,
            share: color(numbers),
            source,
        });
        let drawn = [[0, 0, 0], [3, 0, 0], [0, 4, 0], [2, 1, 6]][k as usize / 2 % 4];
        let source = Source::Direction {
            towards: unit(numbers),
            radiance: color(numbers),
            density: 0.1 + part(numbers) * 9.0,
            drawn,
        };
        all.push(Beam {
            surface,
            share: color(numbers),
            source,
        });
    }
    all
}

#[test]
fn light_is_the_cpus_but_for_rounding() {
    let Some(device) = device() else { return };
    let scene = scene();
    let shader = Shader::new(&scene);
    let shading = GpuShading::new(&device, &shader).expect("it fits");
    let geometry = geometry(Some(9));
    let mut numbers = Numbers(123);
    let lights = shading_lights(&mut numbers);
    let surfaces: Vec<Surface> = (0..200).map(|i| random_surface(&mut numbers, i)).collect();
    let frame = shading.build(&geometry, &lights).expect("it fits");
    let cpu = CpuShading {
        shader: &shader,
        geometry: &geometry,
        lights: &lights,
    };
    // Each beam by itself, on a surface of its own; what is behind a surface counts as nothing on both sides.
    let (mut alone, mut own) = (Vec::new(), Vec::new());
    for (i, surface) in surfaces.iter().enumerate() {
        for beam in beams(&mut numbers, i as u32) {
            own.push(Beam {
                surface: alone.len() as u32,
                ..beam
            });
            alone.push(*surface);
        }
    }
    let made = frame.lit(&alone, &own).expect("a working device");
    let expected = cpu.lit(&alone, &own);
    let mut seen = 0;
    for (i, (made, expected)) in made.iter().zip(&expected).enumerate() {
        let (off, size) = (
            (*made - *expected).abs().max_element(),
            expected.abs().max_element(),
        );
        // A mirror's highlight of a point is a thousandth wide: there the rounding of a direction counts as much more.
        let smooth = alone[i].roughness < 0.1 || alone[i].coat.roughness < 0.1;
        let bound = if smooth { 3e-3 } else { 1e-4 };
        assert!(
            off <= bound * size + 1e-6,
            "{made} instead of {expected} of {:?} on {:?}",
            own[i],
            alone[i]
        );
        seen += usize::from(size > 0.0);
    }
    assert!(seen > made.len() / 4, "{seen} of {}", made.len());
    // And several beams of a surface, in no order, and surfaces without.
    let mut mixed: Vec<Beam> = (0..200).step_by(2).flat_map(|i| beams(&mut numbers, i)).collect();
    mixed.reverse();
    let made = frame.lit(&surfaces, &mixed).expect("a working device");
    for (i, (made, expected)) in made.iter().zip(cpu.lit(&surfaces, &mixed)).enumerate() {
        let off = (*made - expected).abs().max_element();
        assert!(off <= 3e-3 * (expected.max_element() + 0.1), "{made} {expected}");
        assert_eq!(expected == Vec3::ZERO, i % 2 == 1);
    }
    let beams = (own.len() + mixed.len()) as u64;
    assert_eq!(shading.stats(), ShadeStats { surfaces: 0, beams });
}

#[test]
fn nothing_is_an_answer_to_nothing_and_a_lost_device_says_so() {
    let Some(device) = device() else { return };
    let bare = Scene {
        materials: vec![Material::default()],
        ..Scene::default()
    };
    let shader = Shader::new(&bare);
    let shading = GpuShading::new(&device, &shader).expect("it fits");
    let geometry = FrameGeometry {
        objects: vec![ObjectRange {
            material: 0,
            ..geometry(None).objects[0].clone()
        }],
        ..geometry(Some(9))
    };
    let frame = shading.build(&geometry, &[]).expect("it fits");
    assert_eq!(frame.surfaces(&[]), Some(Vec::new()));
    assert_eq!(frame.lit(&[], &[]), Some(Vec::new()));
    let points = &points(&geometry, 1)[..4];
    let surfaces = frame.surfaces(points).expect("a working device");
    assert_eq!(frame.lit(&surfaces, &[]), Some(vec![Vec3::ZERO; 4]));
    let around = Beam {
        surface: 2,
        share: Vec3::ONE,
        source: Source::Around {
            radiance: Vec3::ONE,
            traced: Traced::default(),
        },
    };
    assert!(frame.lit(&surfaces, &vec![around; 1 << 15]).is_some());
    device.gpu().destroy();
    assert_eq!(frame.surfaces(points), None);
    assert!(matches!(shading.problem(), Some(Error::Lost { .. })));
    assert!(shading.build(&geometry, &[]).is_none());
}

#[test]
fn more_light_than_a_thread_adds_up_is_left_to_the_cpu() {
    let Some(device) = device() else { return };
    let scene = scene();
    let shader = Shader::new(&scene);
    let shading = GpuShading::new(&device, &shader).expect("it fits");
    let geometry = geometry(Some(9));
    let mut numbers = Numbers(7);
    let lights = shading_lights(&mut numbers);
    let frame = shading.build(&geometry, &lights).expect("it fits");
    let surfaces = [random_surface(&mut numbers, 0)];
    let beam = Beam {
        surface: 0,
        share: Vec3::ONE,
        source: Source::Light(0),
    };
    assert_eq!(frame.lit(&surfaces, &vec![beam; (1 << 15) + 1]), None);
    assert!(matches!(
        shading.problem(),
        Some(Error::Limits { needed: 32_769, .. })
    ));
}
