//! Whole pictures with soft shadows against brute force, bit for bit, and the light of areas against formulas.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use rayward::scene::{FrameGeometry, LightKind, PosedCamera, PosedLight, Scene, builtin, point_light_for};
use rayward::shade::{ambient, direct, direct_from, object_of};
use rayward::trace::{AreaLight, Triangles, View};
use rayward::trace::{
    BruteForce, EyeGrid, EyeGridOptions, Light, Receiver, Samples, SimdLevel, TileHits, exact,
};
use rayward::{
    CameraFrame, CasterPolicy, Film, FramePlan, RenderOptions, Renderer, Shader, ShadingLight, SurfacePoint,
};

fn triangles(geometry: &FrameGeometry) -> Triangles<'_> {
    Triangles::new(&geometry.x, &geometry.y, &geometry.z, &geometry.indices)
}

/// A light of this kind at a share of the way from the geometry's lower to its upper corner, which shines down.
fn light(geometry: &FrameGeometry, share: Vec3, kind: LightKind) -> PosedLight {
    let (low, high) = geometry.bounds().expect("triangles");
    let position = geometry.origin + (low + (high - low) * share).as_dvec3();
    let light = point_light_for(position, geometry.origin + ((low + high) * 0.5).as_dvec3());
    PosedLight {
        direction: DVec3::NEG_Y,
        axis_x: DVec3::X,
        axis_y: DVec3::Z,
        kind,
        ..light
    }
}

/// Colour of a pixel by brute force, given the triangle that it sees.
fn reference_pixel(
    shader: &Shader,
    geometry: &FrameGeometry,
    camera: &CameraFrame,
    lights: &[PosedLight],
    options: &RenderOptions,
    (pixel, view, prim): (u32, &View, u32),
) -> Vec3 {
    let triangles = triangles(geometry);
    let ray = view.pixel_ray(pixel % view.width, pixel / view.width);
    let corners = triangles.corners(prim);
    let hit = exact::attributes(ray.origin, ray.dir, corners).expect("it was hit");
    let point = SurfacePoint {
        prim,
        object: object_of(geometry, prim),
        u: hit.u as f32,
        v: hit.v as f32,
        view: (-ray.dir.normalize()).as_vec3(),
        footprint: camera.footprint(hit.t as f32),
    };
    let surface = shader.surface(geometry, &point);
    let receiver = Receiver::along(&ray, hit.t, prim);
    let seen = exact::side(corners, &Light::Point(camera.eye));
    let mut color = ambient(&surface, options.ambient);
    let plan = FramePlan::new(geometry, lights, options);
    for (i, (light, plan)) in lights.iter().zip(&plan.lights).enumerate() {
        let area = plan
            .as_ref()
            .and_then(|plan| plan.area)
            .expect("a light with a size");
        let seed = options.seed.wrapping_add((i as u32).wrapping_mul(0x9e37_79b9));
        let samples = Samples::new(options.samples, seed);
        let shading = ShadingLight::new(light, geometry.origin);
        let visible = BruteForce::new(triangles).visible_samples(&receiver, &area, &samples, pixel);
        let mut sum = Vec3::ZERO;
        for k in (0..samples.count()).filter(|k| visible[*k as usize / 32] >> (k % 32) & 1 != 0) {
            let end = area.sample(&samples, pixel, receiver.point, k);
            let lit = exact::side(corners, &end);
            if (lit > 0.0 && seen > 0.0) || (lit < 0.0 && seen < 0.0) {
                let sent = if options.paper {
                    direct(&surface, &shading)
                } else {
                    direct_from(&surface, &shading, &area, &end)
                };
                sum += sent.map_or(Vec3::ZERO, |sent| sent.radiance);
            }
        }
        color += sum * (1.0 / samples.count() as f32);
    }
    color
}

fn render(
    scene: &Scene,
    geometry: &FrameGeometry,
    camera: &PosedCamera,
    lights: &[PosedLight],
    options: &RenderOptions,
) -> Film {
    Renderer::new(scene)
        .render(geometry, camera, lights, options, &|_| ())
        .expect("valid input")
        .film
}

fn check(name: &str, size: [u32; 2], lights: impl Fn(&FrameGeometry) -> Vec<PosedLight>, samples: u32) {
    let options = RenderOptions {
        samples,
        ..RenderOptions::default()
    };
    check_with(name, size, lights, options);
}

fn check_with(
    name: &str,
    size: [u32; 2],
    lights: impl Fn(&FrameGeometry) -> Vec<PosedLight>,
    options: RenderOptions,
) {
    let scene = builtin::build(name).expect("it exists");
    let geometry = scene.at(0.0);
    let lights = lights(&geometry);
    let camera = geometry.cameras[0].clone();
    let options = RenderOptions {
        width: size[0],
        height: size[1],
        seed: 3,
        bounces: 0,
        ..options
    };
    let frame = CameraFrame::new(&camera, geometry.origin, size[0], size[1]).expect("valid camera");
    let view = frame.view(&geometry);
    let shader = Shader::new(&scene);
    let seen = closest_of_all(&geometry, view);
    let expected: Vec<Vec3> = seen
        .par_iter()
        .enumerate()
        .map(|(pixel, prim)| match prim {
            Some(prim) => reference_pixel(
                &shader,
                &geometry,
                &frame,
                &lights,
                &options,
                (pixel as u32, &view, *prim),
            ),
            None => options.background,
        })
        .collect();
    assert!(
        seen.iter().flatten().count() > 100,
        "an empty picture proves nothing"
    );
    for level in SimdLevel::available() {
        for casters in [CasterPolicy::Auto, CasterPolicy::Both] {
            let options = RenderOptions {
                level,
                casters,
                ..options
            };
            let film = render(&scene, &geometry, &camera, &lights, &options);
            for (i, color) in expected.iter().enumerate() {
                let place = || format!("{name}, {}, {casters:?}, pixel {i}", level.name());
                assert_eq!(film.color[i], *color, "{}", place());
            }
        }
    }
}

/// The triangle that each pixel sees: eye rays have tests of their own.
fn closest_of_all(geometry: &FrameGeometry, view: View) -> Vec<Option<u32>> {
    let grid = EyeGrid::build(
        view,
        triangles(geometry),
        EyeGridOptions::default(),
        SimdLevel::detect(),
    );
    let mut seen = vec![None; (view.width * view.height) as usize];
    let mut hits = TileHits::default();
    for index in 0..grid.tile_count() {
        let tile = grid.tile(index);
        grid.trace_tile(&tile, &mut hits);
        for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
            seen[((tile.y + y) * view.width + tile.x + x) as usize] = hits.prim(x, y);
        }
    }
    seen
}

const SQUARE: LightKind = LightKind::Rectangle {
    width: 0.6,
    height: 0.6,
};

#[test]
fn closed_models() {
    check(
        "blob-1k",
        [64, 48],
        |g| vec![light(g, Vec3::new(0.7, 1.5, 0.7), SQUARE)],
        8,
    );
}

#[test]
fn the_papers_grid() {
    let options = RenderOptions {
        samples: 6,
        paper: true,
        ..RenderOptions::default()
    };
    let lights = |g: &FrameGeometry| {
        vec![
            light(g, Vec3::new(0.7, 1.5, 0.7), SQUARE),
            light(g, Vec3::new(-0.5, 0.9, 1.2), LightKind::Point { radius: 0.3 }),
        ]
    };
    check_with("blob-1k", [64, 48], lights, options);
}

#[test]
fn rooms_with_lights_of_every_shape() {
    check(
        "office",
        [64, 48],
        |g| {
            let spot = LightKind::Spot {
                inner: 0.3,
                outer: 0.9,
                radius: 0.1,
            };
            vec![
                light(g, Vec3::new(0.4, 0.95, 0.5), SQUARE),
                light(g, Vec3::new(0.7, 0.7, 0.4), LightKind::Disk { radius: 0.3 }),
                light(g, Vec3::new(0.5, 0.5, 0.5), LightKind::Point { radius: 0.2 }),
                light(g, Vec3::new(0.6, 0.9, 0.6), spot),
                light(g, Vec3::ONE, LightKind::Directional { half_angle: 0.2 }),
            ]
        },
        5,
    );
}

#[test]
fn a_light_half_in_a_closed_model() {
    // Of the component it touches, back faces alone would not do.
    check(
        "blob-1k",
        [48, 36],
        |g| vec![light(g, Vec3::new(0.5, 0.97, 0.5), SQUARE)],
        4,
    );
}

#[test]
fn seeds_and_threads() {
    let scene = builtin::build("office").expect("it exists");
    let geometry = scene.at(0.0);
    let lights = [light(&geometry, Vec3::new(0.4, 0.9, 0.5), SQUARE)];
    let on = |threads: usize, seed: u32| {
        let options = RenderOptions {
            width: 160,
            height: 120,
            seed,
            ..RenderOptions::default()
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a pool")
            .install(|| render(&scene, &geometry, &geometry.cameras[0], &lights, &options))
    };
    let one = on(1, 0);
    assert!(one == on(2, 0));
    assert!(one != on(2, 1));
}

/// Mean irradiance of a surface at `point` that faces `normal`, from many samples and nothing in between.
fn irradiance(light: &PosedLight, point: DVec3, normal: Vec3) -> f32 {
    let geometry = FrameGeometry::default();
    let plan = FramePlan::new(&geometry, std::slice::from_ref(light), &RenderOptions::default());
    let area: AreaLight = plan.lights[0]
        .as_ref()
        .and_then(|l| l.area)
        .expect("it has a size");
    let shading = ShadingLight::new(light, DVec3::ZERO);
    let samples = Samples::new(256, 0);
    let pixels = 16;
    let sum: f32 = (0..pixels)
        .flat_map(|pixel| (0..256).map(move |k| area.sample(&samples, pixel, point, k)))
        .filter_map(|end| shading.incident_from(&area, &end, point.as_vec3()))
        .map(|incident| incident.radiance.x * incident.towards.dot(normal).max(0.0))
        .sum();
    sum / (256 * pixels) as f32
}

#[test]
fn areas_send_what_formulas_say() {
    let geometry = builtin::build("blob-1k").expect("it exists").at(0.0);
    let with = |kind: LightKind| PosedLight {
        position: DVec3::Y * 2.0,
        power: Vec3::splat(3.0),
        ..light(&geometry, Vec3::ZERO, kind)
    };
    let near = |got: f32, want: f32| assert!((got / want - 1.0).abs() < 2e-3, "{got} is not {want}");
    let pi = std::f32::consts::PI;
    // A disk of radiance L and radius r at height h above a parallel surface: pi L r^2 / (h^2 + r^2).
    let disk = with(LightKind::Disk { radius: 1.5 });
    near(
        irradiance(&disk, DVec3::ZERO, Vec3::Y),
        pi * 3.0 * 2.25 / (4.0 + 2.25),
    );
    assert_eq!(irradiance(&disk, DVec3::Y * 3.0, Vec3::NEG_Y), 0.0, "behind it");
    // A sphere gives what a point of the same intensity gives, I cos / d^2, as long as all of it is above the horizon.
    for radius in [0.1, 1.0, 1.9] {
        let sphere = with(LightKind::Point { radius });
        near(irradiance(&sphere, DVec3::ZERO, Vec3::Y), 3.0 / 4.0);
    }
    let sphere = with(LightKind::Point { radius: 0.5 });
    let (point, d2) = (DVec3::new(1.5, 0.0, 0.0), 4.0 + 2.25f32);
    near(irradiance(&sphere, point, Vec3::Y), 3.0 / d2 * 2.0 / d2.sqrt());
    // Rectangles: four quarters, each by the formula of a rectangle seen from below its corner.
    let rectangle = with(LightKind::Rectangle {
        width: 3.0,
        height: 1.0,
    });
    let (a, b) = (1.5f32 / 2.0, 0.5f32 / 2.0);
    let (ra, rb) = ((1.0 + a * a).sqrt(), (1.0 + b * b).sqrt());
    let quarter = 3.0 / 2.0 * (a / ra * (b / ra).atan() + b / rb * (a / rb).atan());
    near(irradiance(&rectangle, DVec3::ZERO, Vec3::Y), 4.0 * quarter);
    // The sun's lux reach a surface that faces it, but for the cosine over its disk.
    let sun = with(LightKind::Directional { half_angle: 0.01 });
    near(irradiance(&sun, DVec3::ZERO, Vec3::Y), 3.0);
}

#[test]
fn the_papers_way_is_the_share_of_the_light_that_is_seen() {
    let scene = builtin::build("office").expect("it exists");
    let geometry = scene.at(0.0);
    let lights = [light(&geometry, Vec3::new(0.4, 0.9, 0.5), SQUARE)];
    let with = |paper: bool, shadows: bool| {
        let options = RenderOptions {
            width: 96,
            height: 64,
            samples: 4,
            bounces: 0,
            paper,
            shadows,
            ..RenderOptions::default()
        };
        render(&scene, &geometry, &geometry.cameras[0], &lights, &options)
    };
    let (soft, unshadowed) = (with(true, true), with(true, false));
    let dark = render(
        &scene,
        &geometry,
        &geometry.cameras[0],
        &[],
        &RenderOptions {
            width: 96,
            height: 64,
            bounces: 0,
            paper: true,
            ..RenderOptions::default()
        },
    );
    let mut shares = [0; 5];
    for i in 0..soft.color.len() {
        let (full, part) = (unshadowed.color[i] - dark.color[i], soft.color[i] - dark.color[i]);
        if full.x > 0.01 {
            let share = part.x / full.x * 4.0;
            assert!((share - share.round()).abs() < 1e-3, "{share}");
            shares[share.round() as usize] += 1;
        }
    }
    assert!(shares.iter().all(|&n| n > 5), "{shares:?}");
}
