//! How the shadows of each light were found, and whether that cost what was predicted.

use std::sync::atomic::{AtomicU64, Ordering};

use rayward_trace::{PointLightTree, ShadowCosts, ShadowCounts, TreeSteps};

use crate::plan::FramePlan;
use crate::structures::LightShadows;

/// How the shadows of a light were found.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LightStats {
    /// Name of the light, possibly empty.
    pub name: String,
    /// What found them: `receivers`, `grid`, `tree`, `area tree`, `reference`, or `nothing`.
    pub structure: &'static str,
    /// What each way was predicted to cost, if it was chosen by that.
    pub costs: Option<ShadowCosts>,
    /// What rays passed in its tree, if it has one.
    pub steps: Option<LightSteps>,
}

/// What the metric that a tree is built by predicted, and what became of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LightSteps {
    /// Shadow rays.
    pub rays: u64,
    /// Expected of a ray that nothing stops.
    pub predicted: TreeSteps,
    /// Passed by a ray on average.
    pub measured: TreeSteps,
}

/// What the rays of a light passed in its tree, counted by all threads.
#[derive(Debug, Default)]
#[non_exhaustive]
pub struct Passed {
    rays: AtomicU64,
    nodes: AtomicU64,
    triangles: AtomicU64,
}

impl Passed {
    /// Adds what was counted between two moments.
    pub(crate) fn add(&self, before: &ShadowCounts, after: &ShadowCounts) {
        let add = |to: &AtomicU64, before: u64, after: u64| to.fetch_add(after - before, Ordering::Relaxed);
        add(&self.rays, before.receivers, after.receivers);
        add(&self.nodes, before.nodes, after.nodes);
        add(&self.triangles, before.tests, after.tests);
    }

    fn steps(&self, tree: &PointLightTree) -> LightSteps {
        let [rays, nodes, triangles] =
            [&self.rays, &self.nodes, &self.triangles].map(|count| count.load(Ordering::Relaxed));
        let mean = |sum: u64| sum as f64 / rays.max(1) as f64;
        LightSteps {
            rays,
            predicted: tree.predicted(),
            measured: TreeSteps {
                nodes: mean(nodes),
                triangles: mean(triangles),
            },
        }
    }
}

/// Of all lights of a plan.
pub(crate) fn light_stats(plan: &FramePlan, shadows: &[LightShadows]) -> Vec<LightStats> {
    let lights = plan.lights.iter().zip(shadows);
    lights
        .map(|(plan, shadows)| LightStats {
            name: plan.as_ref().map_or_else(String::new, |plan| plan.name.clone()),
            structure: match shadows {
                LightShadows::Nothing => "nothing",
                LightShadows::Grid(_) => "grid",
                LightShadows::Tree(..) => "tree",
                LightShadows::Pixels(_) => "receivers",
                LightShadows::Area(_) => "area tree",
                LightShadows::AreaGrid(_) => "area grid",
                LightShadows::Asked => "cube",
                LightShadows::Reference => "reference",
            },
            costs: plan.as_ref().and_then(|plan| plan.costs),
            steps: match shadows {
                LightShadows::Tree(tree, passed) => Some(passed.steps(tree)),
                _ => None,
            },
        })
        .collect()
}
