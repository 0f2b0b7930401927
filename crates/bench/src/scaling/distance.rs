//! The continuum between rays of one point and any rays (HM08 §3): rays that start at a growing distance from the
//! center of perspective grids, beside a regular grid and a hierarchy, for which it makes no difference.

use glam::Vec3;
use rayward::trace::{Bvh, Counters, FaceOptions, Grid3, PerspectiveGrids, Ray, sequence_point};

use super::{Curve, Point, ScalingOptions};
use crate::contender::{FrameKind, Job};
use crate::structures::General;
use crate::{BenchScene, Result, Stopwatch, Times};

/// One of this many pixels along either direction sends a ray.
const STRIDE: usize = 4;

/// A curve for each structure. Builds are not in these times.
pub(super) fn curves(
    options: &ScalingOptions,
    size: [u32; 2],
    distances: &[f32],
    scene: &BenchScene,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<Curve>> {
    let job = Job::new(scene, size, FrameKind::Eye, options.level)?;
    let triangles = scene.triangles();
    let center = job.view.center.as_dvec3();
    let perspective = PerspectiveGrids::build(center, triangles, &FaceOptions::default());
    let regular = Grid3::in_world(triangles, None);
    let bvh = Bvh::build(triangles);
    let mut curves = ["perspective grids", "regular grid", "bvh"].map(|structure| Curve {
        parameter: "distance of origins",
        scene: structure.into(),
        frame: "closest hits",
        points: Vec::new(),
    });
    for &distance in distances {
        progress(&format!("distance of origins {distance}"));
        let rays = rays(&job, distance);
        let at = |structure: &dyn Fn(&[Ray]) -> (Times, Counters)| {
            let (times, counted) = structure(&rays);
            let mut point = Point::new(f64::from(distance), &job, rays.len() as u64, times);
            let a_ray = |count| count as f64 / rays.len() as f64;
            point.steps = Some([a_ray(counted.nodes), a_ray(counted.triangles)]);
            point
        };
        let runs = options.runs;
        let points = [
            at(&|rays| measure(&perspective, rays, runs)),
            at(&|rays| measure(&regular, rays, runs)),
            at(&|rays| measure(&bvh, rays, runs)),
        ];
        for (curve, point) in curves.iter_mut().zip(points) {
            curve.points.push(point);
        }
    }
    Ok(curves.into())
}

fn measure(structure: &impl General, rays: &[Ray], runs: usize) -> (Times, Counters) {
    let mut counters = Counters::default();
    for ray in rays {
        structure.closest(ray, &mut counters);
    }
    let run = |_| {
        let ask = || {
            rays.iter()
                .filter_map(|ray| structure.closest(ray, &mut ()))
                .sum::<f64>()
        };
        Stopwatch::time(|| std::hint::black_box(ask())).1
    };
    let times: Vec<_> = (0..runs).map(run).collect();
    (Times::of(&times), counters)
}

/// Rays of pixels, each moved aside within a ball of that radius, a share of the scene's diagonal.
fn rays(job: &Job, distance: f32) -> Vec<Ray> {
    let (low, high) = job.scene.geometry.bounds().unwrap_or_default();
    let radius = (high - low).length() * distance;
    let pixels = (0..job.view.height)
        .step_by(STRIDE)
        .flat_map(|y| (0..job.view.width).step_by(STRIDE).map(move |x| [x, y]));
    let moved = |[x, y]: [u32; 2]| {
        let [a, b] = sequence_point([0, 0, 1], y * job.view.width + x);
        let [c, _] = sequence_point([0, 0, 2], y * job.view.width + x);
        let offset = Vec3::new(a, b, c) * 2.0 - 1.0;
        let dir = job.view.pixel_ray(x, y).dir.as_vec3();
        Ray::new(job.view.center + offset * radius, dir)
    };
    pixels.map(moved).collect()
}
