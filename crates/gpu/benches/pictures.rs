//! Pictures of VMV07's set-ups by what may answer the rays that surfaces send: every triangle's hierarchy, the cube exactly,
//! its samples, and a cube map, which is what the paper compares with. FLIP of each beside the first.
//!
//! `cargo bench -p rayward-gpu --bench pictures [-- FOLDER]`; with a folder it gets a picture a set-up, the four side by
//! side. Shadows and what the camera sees are the same in all of them. Run as a test it makes small pictures.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayward::scene::{FrameGeometry, Scene, builtin, default_camera, default_lights};
use rayward::trace::exact::ExactHit;
use rayward::trace::ldc::{Coverage, HitTest, LdcBuild};
use rayward::trace::{Bvh, Ldc, LdcOptions, Light, Ray, Receiver, SurfaceRay, Triangles, ViewRay};
use rayward::{
    BuiltTracer, CompareOptions, CubeBuilder, Film, Picture, RenderOptions, Renderer, SecondaryBuilder,
    SecondaryTracer, SurfaceHit, ToneMap, ToneMapper, compare,
};

/// Who answers the rays that surfaces send.
#[derive(Clone, Debug)]
enum By {
    /// Samples of a cube of this resolution and as the paper has it or with planes.
    Samples(u32, HitTest),
    /// What the middle of each object sees of the others, by direction alone; objects as ranges of triangles.
    Map(Vec<std::ops::Range<u32>>),
}

#[derive(Debug)]
struct Sampled<'g>(Ldc<'g>, HitTest);

/// Of one object: its middle, and all other triangles.
#[derive(Debug)]
struct View<'g> {
    of: std::ops::Range<u32>,
    middle: Vec3,
    others: Bvh<'g>,
}

#[derive(Debug)]
struct Tracer<'g> {
    triangles: Triangles<'g>,
    samples: Option<Sampled<'g>>,
    map: Vec<View<'g>>,
    /// For the light of what is hit.
    all: Bvh<'g>,
}

impl Tracer<'_> {
    fn first(&self, ray: &SurfaceRay) -> SurfaceHit {
        let (prim, dir) = (ray.from.prim, ray.dir.as_dvec3());
        if let Some(Sampled(cube, test)) = &self.samples {
            let normal = self.triangles.normal(prim).normalize_or_zero().as_vec3();
            let leaving = cube.leaving(ray.from.point.as_vec3(), normal, ray.dir);
            let hit = cube.closest_sampled(&leaving, *test, &mut ())?;
            let [t, u, v] = [hit.t, hit.u, hit.v].map(f64::from);
            return Some((hit.prim, ExactHit { t, u, v }));
        }
        let view = self.map.iter().find(|view| view.of.contains(&prim))?;
        let (hit, at) = view.others.closest(&Ray::new(view.middle, ray.dir), &mut ())?;
        // The map knows no distance: what it shows is lit where it is.
        let point: DVec3 = view.middle.as_dvec3() + dir * at.t;
        let t = (point - ray.from.point).dot(dir) / dir.length_squared();
        (t > 0.0).then_some((hit, ExactHit { t, ..at }))
    }
}

impl SecondaryTracer for Tracer<'_> {
    fn trace(&self, rays: &[SurfaceRay], hits: &mut Vec<SurfaceHit>) {
        hits.clear();
        hits.extend(rays.iter().map(|ray| self.first(ray)));
    }

    fn each_between(
        &self,
        receiver: &Receiver,
        light: &Light,
        visit: &mut dyn FnMut(u32) -> ControlFlow<()>,
    ) {
        SecondaryTracer::each_between(&self.all, receiver, light, visit);
    }

    fn along(&self, ray: &ViewRay, hits: &mut Vec<(f64, u32)>) {
        SecondaryTracer::along(&self.all, ray, hits);
    }
}

/// A triangle list with that of an object left out: its triangles shrunk to nothing, so that the others keep their ids.
#[derive(Debug)]
struct Without(Vec<[u32; 3]>);

#[derive(Debug)]
struct Builder {
    by: By,
    without: Vec<Without>,
}

impl Builder {
    fn new(by: By, geometry: &FrameGeometry) -> Self {
        let without = match &by {
            By::Samples(..) => Vec::new(),
            By::Map(objects) => {
                let all = objects.iter().map(|object| {
                    let mut indices = geometry.indices.clone();
                    for corners in &mut indices[object.start as usize..object.end as usize] {
                        *corners = [corners[0]; 3];
                    }
                    Without(indices)
                });
                all.collect()
            }
        };
        Self { by, without }
    }
}

impl SecondaryBuilder for Builder {
    fn build<'g>(&'g self, triangles: Triangles<'g>) -> BuiltTracer<'g> {
        let mut tracer = Tracer {
            triangles,
            samples: None,
            map: Vec::new(),
            all: Bvh::build(triangles),
        };
        match &self.by {
            By::Samples(resolution, test) => {
                let options = match test {
                    HitTest::Plane { .. } => LdcOptions {
                        resolution: *resolution,
                        build: LdcBuild::Csr(Coverage::Centre),
                        ..LdcOptions::default()
                    },
                    _ => LdcOptions::paper(*resolution),
                };
                tracer.samples = Some(Sampled(Ldc::build(triangles, &options), *test));
            }
            By::Map(objects) => {
                for (object, without) in objects.iter().zip(&self.without) {
                    let corners = object.clone().flat_map(|prim| triangles.corners(prim));
                    let (low, high) = corners.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| {
                        (low.min(p), high.max(p))
                    });
                    let others = Triangles::new(triangles.x, triangles.y, triangles.z, &without.0);
                    tracer.map.push(View {
                        of: object.clone(),
                        middle: (low + high) * 0.5,
                        others: Bvh::build(others),
                    });
                }
            }
        }
        BuiltTracer {
            tracer: Arc::new(tracer),
            name: "for comparison",
            bytes: 0,
            cells: 0,
            references: 0,
        }
    }
}

/// A scene of the paper: its name, what it is made of, and a time.
fn set_ups() -> Vec<(&'static str, Scene, f32)> {
    let mirror = |scene: &mut Scene, name: &str| {
        for material in scene.materials.iter_mut().filter(|m| m.name == name) {
            (material.metallic, material.roughness) = (1.0, 0.0);
            material.base_color = Vec3::splat(0.9).extend(1.0);
        }
    };
    let teapot = || builtin::build("teapot-mirror").expect("a built-in scene");
    let mut shiny = teapot();
    mirror(&mut shiny, "glaze");
    let mut glass = teapot();
    for material in &mut glass.materials {
        if material.name == "ball" {
            (material.transmission, material.ior, material.roughness) = (1.0, 1.5, 0.0);
            (material.thickness, material.base_color) = (1.0, Vec3::splat(0.95).extend(1.0));
        }
    }
    let mut walker = builtin::build("walker").expect("a built-in scene");
    mirror(&mut walker, "ground");
    vec![
        ("teapot-over-mirror", teapot(), 0.0),
        ("reflective-teapot", shiny, 0.0),
        ("refractive-balls", glass, 0.0),
        ("skinned-walker", walker, 0.4),
    ]
}

fn main() {
    let test = !std::env::args().any(|a| a == "--bench");
    let folder = std::env::args()
        .skip(1)
        .find(|a| !a.starts_with('-'))
        .map(PathBuf::from);
    let (width, height) = if test { (40, 30) } else { (240, 180) };
    for (name, scene, time) in set_ups() {
        let geometry = scene.at(time);
        let camera = geometry.cameras.first().cloned();
        let camera = camera.unwrap_or_else(|| default_camera(&geometry, 4.0 / 3.0));
        let lights = if geometry.lights.is_empty() {
            default_lights(&camera)
        } else {
            geometry.lights.clone()
        };
        let options = RenderOptions {
            width,
            height,
            bounces: 4,
            ambient: scene.ambient,
            pixel_samples: if test { 1 } else { 4 },
            ..RenderOptions::default()
        };
        let render = |builder: Option<Arc<dyn SecondaryBuilder>>| {
            let mut renderer = Renderer::new(&scene);
            if let Some(builder) = builder {
                renderer.set_secondary(builder);
            }
            let picture = renderer.render(&geometry, &camera, &lights, &options, &|_| ());
            picture.expect("a picture").film
        };
        let objects = geometry
            .objects
            .iter()
            .map(|object| object.triangles.clone())
            .collect();
        let by = |by| Some(Arc::new(Builder::new(by, &geometry)) as Arc<dyn SecondaryBuilder>);
        let paper = |resolution| HitTest::Interval {
            tolerance: HitTest::paper_tolerance(resolution),
        };
        let reference = render(None);
        let films = [
            ("cube, exact", render(Some(Arc::new(CubeBuilder::default())))),
            (
                "planes, 1024",
                render(by(By::Samples(1024, HitTest::Plane { margin: 0.25 }))),
            ),
            ("as the paper, 1024", render(by(By::Samples(1024, paper(1024))))),
            (
                "planes, 512",
                render(by(By::Samples(512, HitTest::Plane { margin: 0.25 }))),
            ),
            ("as the paper, 512", render(by(By::Samples(512, paper(512))))),
            ("cube map", render(by(By::Map(objects)))),
        ];
        for (how, film) in &films {
            let found = compare(
                &Picture::from(&reference).to_srgb(),
                &Picture::from(film).to_srgb(),
                &CompareOptions::default(),
            );
            let found = found.expect("pictures of one size");
            println!(
                "{name}: {how}: mean FLIP {:.4}, {} pixels differ",
                found.mean_flip, found.differing
            );
        }
        if let Some(folder) = &folder {
            let strip = [&reference, &films[1].1, &films[2].1, &films[5].1];
            write(&folder.join(format!("{name}.png")), &strip);
        }
    }
}

/// Pictures side by side.
fn write(path: &std::path::Path, films: &[&Film]) {
    let [width, height] = [films[0].width(), films[0].height()];
    let rows: Vec<Vec<u8>> = films
        .iter()
        .map(|film| ToneMapper::new(ToneMap::None).encode(film))
        .collect();
    let mut all = Vec::new();
    for y in 0..height as usize {
        for rgb in &rows {
            all.extend_from_slice(&rgb[y * width as usize * 3..(y + 1) * width as usize * 3]);
        }
    }
    rayward::image_io::write_png(path, width * films.len() as u32, height, &all).expect("written");
}
