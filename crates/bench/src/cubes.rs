//! VMV07, Table 1 and the claims of its text, on the processor: the layered depth cube of five scenes at two resolutions,
//! its build (A) and its reflection rays (B).
//!
//! Everything that the eye sees mirrors, so that B traces a reflection ray for each pixel that sees a surface.

use rayon::prelude::*;
use rayward::scene::{LoadOptions, builtin};
use rayward::trace::ldc::{Coverage, Hierarchy, HitTest, LdcBuild, StepCounts};
use rayward::trace::{Bvh, Ldc, LdcOptions, Ray};
use serde::Serialize;

use crate::claims::{Claim, Verdict, claim};
use crate::structures::mirrored_rays;
use crate::tables::TablesOptions;
use crate::{BenchScene, Result, Spread, Stopwatch, workers};

/// A row of VMV07's Table 1: its name, thousand triangles, layers, and A and B in milliseconds at 512 and 1024; a
/// built-in stand-in by the frequency of a blob, and the mesh of the scenes folder.
struct Paper {
    name: &'static str,
    ktriangles: f64,
    layers: u32,
    ms: [[f64; 2]; 2],
    blob: Option<u32>,
    mesh: &'static str,
}

const TABLE_1: [Paper; 5] = [
    Paper {
        name: "Bunny",
        ktriangles: 8.2,
        layers: 8,
        ms: [[7.0, 61.0], [19.0, 115.0]],
        blob: Some(20),
        mesh: "bunny8k",
    },
    Paper {
        name: "Car",
        ktriangles: 20.3,
        layers: 12,
        ms: [[9.0, 82.0], [25.0, 250.0]],
        blob: Some(32),
        mesh: "beetle20k",
    },
    Paper {
        name: "Dragon",
        ktriangles: 100.0,
        layers: 7,
        ms: [[12.0, 205.0], [31.0, 441.0]],
        blob: Some(71),
        mesh: "dragon100k_closed",
    },
    Paper {
        name: "Max Planck",
        ktriangles: 300.0,
        layers: 6,
        ms: [[19.0, 160.0], [53.0, 346.0]],
        blob: Some(122),
        mesh: "maxplanck300k",
    },
    Paper {
        name: "Tiny",
        ktriangles: 1.6,
        layers: 6,
        ms: [[5.0, 44.0], [16.0, 95.0]],
        blob: None,
        mesh: "animated/tiny.glb",
    },
];

/// One scene at one resolution.
#[derive(Clone, Debug, Serialize)]
pub struct CubeLine {
    /// Name in the paper.
    pub paper_scene: &'static str,
    /// What was measured.
    pub scene: String,
    /// Thousand triangles in the paper.
    pub paper_ktriangles: f64,
    /// Triangles.
    pub triangles: usize,
    /// Texels along the longest side.
    pub resolution: u32,
    /// Layered depth images in the paper.
    pub paper_layers: u32,
    /// Samples in the fullest texel of each direction.
    pub layers: [u32; 3],
    /// A and B in the paper, milliseconds; at 512 and 1024 only.
    pub paper_ms: Option<[f64; 2]>,
    /// Build by peeling, as in the paper, milliseconds of all threads.
    pub peel_ms: f64,
    /// Build by one sweep, conservative: what the exact answers need.
    pub build_ms: f64,
    /// Reflection rays.
    pub rays: usize,
    /// Their exact hits, milliseconds of all threads.
    pub trace_ms: f64,
    /// Their hits by planes of samples.
    pub planes_ms: f64,
    /// Exact hits without anything above the texels, milliseconds for one ray in sixteen, times sixteen.
    pub flat_ms: f64,
    /// The hierarchy's hits, its build not in it.
    pub bvh_ms: f64,
    /// The hierarchy's build.
    pub bvh_build_ms: f64,
    /// Cells and texels that an exact ray passes.
    pub steps: f64,
    /// The same with nothing above the texels.
    pub flat_steps: f64,
    /// Bytes of the exact cube.
    pub bytes: usize,
    /// Share of the rays whose exact answer is not that of the hierarchy.
    pub exact_wrong: f64,
    /// Share of the rays that planes of samples answer with another triangle, farther than two texels away, or with no hit
    /// or a false one.
    pub planes_wrong: f64,
    /// The same of a cube map around the middle of what is seen, which looks up by direction alone.
    pub map_wrong: f64,
}

/// All scenes at both resolutions.
///
/// # Errors
/// [`crate::Error`], if a scene cannot be read or threads not be started.
pub(crate) fn table(options: &TablesOptions, progress: &mut dyn FnMut(&str)) -> Result<Vec<CubeLine>> {
    let pool = workers::pool(options.threads, options.pinned)?;
    let mut lines = Vec::new();
    for paper in &TABLE_1 {
        let scene = match (&options.folder, paper.blob) {
            (Some(folder), _) => {
                let file = folder.join(paper.mesh);
                if file.is_file() {
                    let read = rayward::scene::load(&file, &LoadOptions::default())?;
                    BenchScene::new(paper.mesh, read, None)?
                } else {
                    BenchScene::load(paper.mesh, Some(folder))?
                }
            }
            (None, Some(frequency)) => BenchScene::new("blob", builtin::blob_of(frequency), None)?,
            (None, None) => BenchScene::load("walker", None)?,
        };
        let rays = pool.install(|| mirrored_rays(&scene, options.size, options.level))?;
        for &resolution in &options.cubes {
            progress(&format!("VMV07, Table 1: {}, {resolution}", paper.name));
            let mut line = pool.install(|| line(&scene, &rays, resolution, options.runs));
            line.paper_scene = paper.name;
            line.paper_ktriangles = paper.ktriangles;
            line.paper_layers = paper.layers;
            line.paper_ms = match resolution {
                512 => Some(paper.ms[0]),
                1024 => Some(paper.ms[1]),
                _ => None,
            };
            lines.push(line);
        }
    }
    Ok(lines)
}

fn line(scene: &BenchScene, rays: &[Ray], resolution: u32, runs: usize) -> CubeLine {
    let triangles = scene.triangles();
    let exact = LdcOptions {
        resolution,
        ..LdcOptions::default()
    };
    let flat = LdcOptions {
        hierarchy: Hierarchy::Flat,
        ..exact
    };
    let swept = LdcOptions {
        build: LdcBuild::Csr(Coverage::Centre),
        ..exact
    };
    let (peel_ms, _) = timed(runs, || Ldc::build(triangles, &LdcOptions::paper(resolution)));
    let (build_ms, cube) = timed(runs, || Ldc::build(triangles, &exact));
    let (bvh_build_ms, bvh) = timed(runs, || Bvh::build(triangles));
    let centred = Ldc::build(triangles, &swept);
    let flat = Ldc::build(triangles, &flat);
    let some: Vec<Ray> = rays.iter().step_by(16).copied().collect();
    let (bvh_ms, truth) = timed(runs, || {
        hits(rays, |ray| bvh.closest(ray, &mut ()).map(|(p, hit)| (p, hit.t)))
    });
    let (trace_ms, found) = timed(runs, || {
        hits(rays, |ray| cube.closest(ray, &mut ()).map(|(p, hit)| (p, hit.t)))
    });
    let test = HitTest::Plane { margin: 0.25 };
    let (planes_ms, planes) = timed(runs, || {
        hits(rays, |ray| {
            let hit = centred.closest_sampled(ray, test, &mut ());
            hit.map(|hit| (hit.prim, f64::from(hit.t)))
        })
    });
    let (flat_ms, _) = timed(1, || {
        hits(&some, |ray| flat.closest(ray, &mut ()).map(|(p, hit)| (p, hit.t)))
    });
    let near = 2.0 * cube.texel_size();
    let wrong = |answers: &[Found]| {
        let wrong = answers
            .iter()
            .zip(&truth)
            .filter(|(a, b)| is_wrong(a, b, near))
            .count();
        wrong as f64 / rays.len().max(1) as f64
    };
    let steps = |cube: &Ldc| {
        let mut counts = StepCounts::default();
        for ray in &some {
            cube.closest(ray, &mut counts);
        }
        (counts.cells + counts.texels) as f64 / some.len().max(1) as f64
    };
    CubeLine {
        paper_scene: "",
        scene: scene.name.clone(),
        paper_ktriangles: 0.0,
        triangles: triangles.len(),
        resolution,
        paper_layers: 0,
        layers: centred.layers(),
        paper_ms: None,
        peel_ms,
        build_ms,
        rays: rays.len(),
        trace_ms,
        planes_ms,
        flat_ms: flat_ms * 16.0,
        bvh_ms,
        bvh_build_ms,
        steps: steps(&cube),
        flat_steps: steps(&flat),
        bytes: cube.bytes(),
        exact_wrong: wrong(&found),
        planes_wrong: wrong(&planes),
        map_wrong: wrong(&looked_up(rays, &bvh)),
    }
}

/// Triangle and parameter of a hit.
type Found = Option<(u32, f64)>;

fn hits(rays: &[Ray], closest: impl Fn(&Ray) -> Found + Send + Sync) -> Vec<Found> {
    rays.par_iter().with_min_len(1024).map(closest).collect()
}

/// Reflections as a cube map has them: what the middle of the surfaces sees in the direction of the ray.
fn looked_up(rays: &[Ray], bvh: &Bvh) -> Vec<Found> {
    let sum: glam::DVec3 = rays.iter().map(|ray| ray.origin.as_dvec3()).sum();
    let middle = (sum / rays.len().max(1) as f64).as_vec3();
    hits(rays, |ray| {
        let from_middle = Ray::new(middle, ray.dir);
        let (prim, hit) = bvh.closest(&from_middle, &mut ())?;
        // Where that point lies as seen along the ray itself.
        let point = middle.as_dvec3() + ray.dir.as_dvec3() * hit.t;
        Some((prim, (point - ray.origin.as_dvec3()).dot(ray.dir.as_dvec3())))
    })
}

/// Whether one of two hits is missing, or they are of different triangles and not near each other either.
fn is_wrong(answer: &Found, truth: &Found, near: f64) -> bool {
    match (answer, truth) {
        (None, None) => false,
        (Some((prim, t)), Some((other, at))) => prim != other && (t - at).abs() > near,
        _ => true,
    }
}

/// Median of the wall time, milliseconds, and what the last run gave.
fn timed<R>(runs: usize, work: impl Fn() -> R) -> (f64, R) {
    let mut last = work();
    let mut walls = Vec::new();
    for _ in 0..runs {
        let (result, time) = Stopwatch::time(&work);
        walls.push(time.wall);
        last = result;
    }
    (Spread::of(walls).median, last)
}

/// The six claims, in the paper's order.
pub(crate) fn claims(lines: &[CubeLine]) -> Vec<Claim> {
    let range = |of: &dyn Fn(&CubeLine) -> f64| {
        let values = lines.iter().map(of);
        values.fold([f64::INFINITY, 0.0], |[low, high], v: f64| {
            [low.min(v), high.max(v)]
        })
    };
    let [fewest, most] =
        range(&|line| f64::from(line.layers.iter().sum::<u32>()) / f64::from(most_layers(line)));
    let [least_flat, most_flat] = range(&|line| line.flat_ms / line.trace_ms);
    let [fewer_steps, _] = range(&|line| line.flat_steps / line.steps);
    let [_, wrong] = range(&|line| line.exact_wrong);
    let [_, planes] = range(&|line| line.planes_wrong);
    let [map_least, map_most] = range(&|line| line.map_wrong);
    let [smallest, largest] = range(&|line| line.bytes as f64 / (4.0 * f64::from(line.resolution).powi(3)));
    let [quick, slow] = range(&|line| line.build_ms / (line.build_ms + line.trace_ms));
    let over = |good: bool, exceeded: bool| match (good, exceeded) {
        (_, true) => Verdict::Exceeded,
        (true, false) => Verdict::Reproduced,
        (false, false) => Verdict::Not,
    };
    vec![
        claim(
            "geometry is processed once for each layer and not three times: as often as the fullest direction has layers",
            Verdict::Exceeded,
            format!(
                "the default is one sweep; by peeling, the sum over directions is {fewest:.1} to {most:.1} times the largest"
            ),
        ),
        claim(
            "two levels are traversed much faster than one",
            over(least_flat > 1.5, false),
            format!(
                "a pyramid takes 1/{least_flat:.1} to 1/{most_flat:.1} of the time and at most 1/{fewer_steps:.1} of the steps of \
                 texels alone"
            ),
        ),
        claim(
            "pictures are almost exactly those of a double precision ray tracer",
            over(planes < 0.01, wrong == 0.0),
            format!(
                "exact cubes give its answers, {:.2} % of the rays differ; planes of samples go wrong in up to {:.2} %",
                wrong * 100.0,
                planes * 100.0
            ),
        ),
        claim(
            "better than a cube map for near objects and self-reflection",
            over(map_least > planes, false),
            format!(
                "a cube map shows another place in {:.0} to {:.0} % of the reflection rays",
                map_least * 100.0,
                map_most * 100.0
            ),
        ),
        claim(
            "less memory than a uniform grid of the same resolution",
            over(largest < 1.0, false),
            format!(
                "{:.1} to {:.1} % of a grid with 4 bytes a cell",
                smallest * 100.0,
                largest * 100.0
            ),
        ),
        claim(
            "built fast enough for every frame: 5 to 15 % of it",
            over(slow < 0.5, slow < 0.15),
            format!(
                "{:.0} to {:.0} % of build and reflection rays on the processor",
                quick * 100.0,
                slow * 100.0
            ),
        ),
    ]
}

fn most_layers(line: &CubeLine) -> u32 {
    line.layers.into_iter().max().unwrap_or(0).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_cube_answers_exactly_and_a_cube_map_does_not() {
        let scene = BenchScene::new("blob", builtin::blob_of(14), None).expect("triangles");
        let level = rayward::trace::SimdLevel::detect();
        let rays = mirrored_rays(&scene, [160, 128], level).expect("a camera");
        assert!(rays.len() > 1000, "{}", rays.len());
        let line = line(&scene, &rays, 64, 1);
        assert_eq!(line.exact_wrong, 0.0);
        assert!(line.map_wrong > line.planes_wrong, "{line:?}");
        assert!(line.steps < line.flat_steps, "{line:?}");
        assert_eq!(claims(&[line]).len(), 6);
    }
}
