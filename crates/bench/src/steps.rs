//! HM08, Table 5: cells that a shadow ray of an area light passes, in a perspective grid and in a regular one with as
//! many cells. Counts, not times: the same on every machine.

use glam::DVec3;
use rayward::trace::space::Perspective;
use rayward::trace::{Candidates, Counters, Grid3, Light, Ray, Receiver, Triangles};
use serde::Serialize;

use crate::{BenchScene, Result};

/// Cells along each axis of the regular grid, as in the paper.
const REGULAR: u32 = 54;

/// Cells of the perspective grid: the paper's, and one slab of twice as many along the other axes.
const PERSPECTIVE: [[u32; 3]; 2] = [[200, 200, 4], [400, 400, 1]];

/// Shadow rays of a receiver.
const SAMPLES: usize = 8;

/// What rays pass in one grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Steps {
    /// Cells along each axis.
    pub cells: [u32; 3],
    /// Whether they are those of a perspective space.
    pub perspective: bool,
    /// Cells a ray.
    pub steps: f64,
    /// Triangles tested a ray.
    pub tests: f64,
    /// References from cells to triangles.
    pub references: usize,
}

/// Counts of all grids for the same rays.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepReport {
    /// Scene.
    pub scene: String,
    /// Shadow rays.
    pub rays: usize,
    /// Share of them that ends in shadow.
    pub in_shadow: f64,
    /// Whether all grids answered all rays alike.
    pub same_answers: bool,
    /// The regular grid first.
    pub grids: Vec<Steps>,
}

impl StepReport {
    /// Cells a ray of the paper's perspective grid over those of the regular one.
    pub fn ratio(&self) -> f64 {
        self.grids[1].steps / self.grids[0].steps
    }
}

/// A square light above the scene and the receivers seen from its camera.
struct Setting {
    light: DVec3,
    forward: DVec3,
    half_side: f64,
    receivers: Vec<Receiver>,
}

/// Counts the steps of a scene's shadow rays.
///
/// # Errors
/// What [`BenchScene::view`] says.
pub fn measure(scene: &BenchScene) -> Result<StepReport> {
    let triangles = scene.triangles();
    let regular = Grid3::in_world(triangles, Some([REGULAR; 3]));
    let setting = setting(scene, &regular)?;
    let space = pyramid(&setting, triangles);
    let (counted, shadows) = cast(&regular, &setting);
    let steps = |cells, perspective, (steps, tests): (f64, f64), references| Steps {
        cells,
        perspective,
        steps,
        tests,
        references,
    };
    let mut report = StepReport {
        scene: scene.name.clone(),
        rays: shadows.len(),
        in_shadow: shadows.iter().filter(|s| **s).count() as f64 / shadows.len() as f64,
        same_answers: true,
        grids: vec![steps(regular.cells(), false, counted, regular.reference_count())],
    };
    for cells in PERSPECTIVE {
        let grid = Grid3::new(space, triangles, cells, None);
        let (counted, answers) = cast(&grid, &setting);
        report.same_answers &= answers == shadows;
        report
            .grids
            .push(steps(grid.cells(), true, counted, grid.reference_count()));
    }
    Ok(report)
}

/// Points of the light: eight for each receiver, in strata that differ from one receiver to the next.
fn sample(setting: &Setting, receiver: usize, k: usize) -> Light {
    let right = setting.forward.any_orthonormal_vector();
    let up = right.cross(setting.forward);
    let jitter = |salt: u64| {
        let bits = ((receiver * SAMPLES + k) as u64 + 1).wrapping_mul(salt);
        ((bits ^ (bits >> 31)).wrapping_mul(0x94d0_49bb_1331_11eb) >> 11) as f64 / (1u64 << 53) as f64
    };
    let x = ((k % 4) as f64 + jitter(0x9e37_79b9_7f4a_7c15)) / 2.0 - 1.0;
    let y = ((k / 4) as f64 + jitter(0xbf58_476d_1ce4_e5b9)) - 1.0;
    Light::Point((setting.light + (right * x + up * y) * setting.half_side).as_vec3())
}

fn setting(scene: &BenchScene, grid: &impl Candidates) -> Result<Setting> {
    let (low, high) = scene.geometry.bounds().unwrap_or_default();
    let (middle, size) = (((low + high) * 0.5).as_dvec3(), f64::from((high - low).length()));
    let light = middle + DVec3::new(0.3, 0.9, 0.2) * size;
    let view = scene.view(96, 60)?;
    let mut receivers = Vec::new();
    for (x, y) in (0..60).flat_map(|y| (0..96).map(move |x| (x, y))) {
        let ray = Ray::new(view.center, view.pixel_ray(x, y).dir.as_vec3());
        if let Some((prim, hit)) = grid.closest(&ray, &mut ()) {
            receivers.push(Receiver::on_surface(&ray, hit.t, prim));
        }
    }
    Ok(Setting {
        light,
        forward: (middle - light).normalize(),
        half_side: size * 0.02,
        receivers,
    })
}

/// The pyramid of the light that holds all triangles and all of the light's rays to them.
fn pyramid(setting: &Setting, triangles: Triangles) -> Perspective {
    let right = setting.forward.any_orthonormal_vector();
    let mut space = Perspective {
        center: setting.light,
        right,
        up: right.cross(setting.forward),
        forward: setting.forward,
        tan_x: 0.0,
        tan_y: 0.0,
        near: f64::INFINITY,
        far: 0.0,
    };
    for i in 0..triangles.x.len() as u32 {
        let v = space.view(triangles.vertex(i).as_dvec3());
        space.tan_x = space.tan_x.max((v.x / v.z).abs());
        space.tan_y = space.tan_y.max((v.y / v.z).abs());
        (space.near, space.far) = (space.near.min(v.z), space.far.max(v.z));
    }
    (space.near, space.far) = (space.near * 0.999, space.far * 1.001);
    // A ray starts at most this far beside the centre and comes nearer to its straight line all the way.
    let guard = setting.half_side * std::f64::consts::SQRT_2 / space.near;
    (space.tan_x, space.tan_y) = (space.tan_x + guard, space.tan_y + guard);
    space
}

/// Cells and tests a ray, and the answers.
fn cast(grid: &impl Candidates, setting: &Setting) -> ((f64, f64), Vec<bool>) {
    let mut count = Counters::default();
    let mut shadows = Vec::new();
    for (i, receiver) in setting.receivers.iter().enumerate() {
        let answers = (0..SAMPLES).map(|k| grid.shadows(receiver, &sample(setting, i, k), &mut count));
        shadows.extend(answers);
    }
    let rays = shadows.len().max(1) as f64;
    (
        (count.nodes as f64 / rays, count.triangles as f64 / rays),
        shadows,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn soft_shadow_rays_pass_less_than_a_third_of_the_cells() {
        let scene = BenchScene::load("courtyard", None).expect("it is built in");
        let report = measure(&scene).expect("a camera that can be used");
        assert!(
            report.rays > 16_000 && (0.05..0.95).contains(&report.in_shadow),
            "{report:?}"
        );
        assert!(report.same_answers && report.ratio() < 1.0 / 3.0, "{report:?}");
        assert!(report.grids[2].steps < report.grids[0].steps / 3.0, "{report:?}");
    }
}
