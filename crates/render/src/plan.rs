//! Which structure serves which class of rays in a frame, and with what parameters: plain data, decided before
//! anything is built.
//!
//! | rays | structure |
//! |---|---|
//! | eye rays | one tiled perspective grid (HM08 §5.1) |
//! | shadow rays of a light | a grid of receivers, a grid or a tree of casters each (HM08 §5.2), whichever is predicted to cost least |
//! | shadow rays of a light with a size | one tree in its perspective space each (HM08 §5.3); with the papers' parameters one 3-D grid each |
//! | those of eye and lights through masked and blended surfaces | a grid of these alone for each, if there are any |
//! | those of lights with a size through them | a hierarchy, if there are both |
//! | rays that leave surfaces, and the shadow rays of what they meet | the same hierarchy |

use glam::DVec3;
use rayward_scene::{FrameGeometry, LightKind, Material, PosedLight, Scene};
use rayward_trace::{AreaLight, Cone, EyeGridOptions, FaceOptions, Light, LightGridOptions, ShadowCosts};

use crate::bounce::GLOSSY;
use crate::casters::CasterRules;
use crate::geometry::{shadow_end, triangles};
use crate::{Antialias, RenderOptions, ShadowStructure};

/// The structures of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FramePlan {
    /// Parameters of the camera's grid.
    pub eye: EyeGridOptions,
    /// One entry a light: how its shadows are found, or `None` if it casts none.
    pub lights: Vec<Option<LightPlan>>,
    /// Whether surfaces send out rays of their own.
    pub secondary: bool,
}

/// The grid of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPlan {
    /// Name of the light, possibly empty.
    pub name: String,
    /// Where the shadow rays end.
    pub light: Light,
    /// What finds its hard shadows.
    pub structure: ShadowStructure,
    /// What each way is predicted to cost, where that chose.
    pub costs: Option<ShadowCosts>,
    /// Parameters of its grid.
    pub grid: LightGridOptions,
    /// Whether cells of the grid also know beyond which nearness they are dark.
    pub dark_cells: bool,
    /// The light with its size, if it has one: it then has a tree instead of a grid.
    pub area: Option<AreaLight>,
    /// The cells of the 3-D grid that a light with a size has instead of the tree, if it does.
    pub soft_grid: Option<FaceOptions>,
}

impl LightPlan {
    /// Whether its shadows are found for all pixels at once, where every pixel sees one surface.
    pub(crate) fn at_once(&self) -> bool {
        let chosen = matches!(self.structure, ShadowStructure::Receivers | ShadowStructure::Auto);
        self.area.is_none() && chosen
    }
}

/// A spot light wider than this gets the faces of a point light, radians.
const WIDEST_CONE: f32 = 1.2;

impl FramePlan {
    /// The plan for these lights, without rays that leave surfaces.
    pub fn new(geometry: &FrameGeometry, lights: &[PosedLight], options: &RenderOptions) -> Self {
        let eye = if options.paper {
            EyeGridOptions::paper()
        } else {
            EyeGridOptions::default()
        };
        let grid = if options.paper {
            LightGridOptions::paper()
        } else {
            LightGridOptions::default()
        };
        let structure = if options.paper {
            ShadowStructure::Grid
        } else {
            options.shadow_structure
        };
        let plan = |light: &PosedLight| {
            let cone = match light.kind {
                LightKind::Spot { outer, .. } if outer < WIDEST_CONE => Some(Cone {
                    axis: light.direction.normalize_or(DVec3::NEG_Z),
                    half_angle: f64::from(outer),
                }),
                _ => None,
            };
            LightPlan {
                name: light.name.clone(),
                light: shadow_end(light, geometry.origin),
                structure,
                costs: None,
                grid: LightGridOptions { cone, ..grid },
                dark_cells: !options.paper,
                area: area_light(light, geometry.origin),
                soft_grid: options.paper.then(FaceOptions::paper),
            }
        };
        let lights = lights
            .iter()
            .map(|light| options.shadows.then(|| plan(light)))
            .collect();
        Self {
            eye,
            lights,
            secondary: false,
        }
    }

    /// The same with a structure chosen for the hard shadows of each light that leaves the choice. `together` tells whether
    /// another structure answers all pixels at once.
    pub fn with_shadow_structures(
        mut self,
        geometry: &FrameGeometry,
        rules: &CasterRules,
        together: bool,
        options: &RenderOptions,
    ) -> Self {
        // Layers behind each other are receivers of their own, and the paper looks each ray up.
        let one_surface = !rules.any_transparent() && !options.paper;
        // Shares of pixels know a light by a bit a pixel.
        let for_shares = options.antialias == Antialias::Coverage;
        // Half of what is seen is turned away from a light.
        let pixels = u64::from(options.width) * u64::from(options.height) / 2;
        for plan in self
            .lights
            .iter_mut()
            .flatten()
            .filter(|plan| plan.area.is_none())
        {
            plan.grid.receivers = pixels;
            plan.structure = match plan.structure {
                ShadowStructure::Receivers if !one_surface => ShadowStructure::Grid,
                ShadowStructure::Auto if options.reference || (one_surface && (together || for_shares)) => {
                    ShadowStructure::Receivers
                }
                ShadowStructure::Auto => {
                    let rule = rules.for_light(geometry, &plan.light);
                    let (light, cone) = (&plan.light, plan.grid.cone);
                    let costs = ShadowCosts::predict(light, &triangles(geometry), &rule, cone, pixels);
                    plan.costs = Some(costs);
                    cheapest(&costs, one_surface)
                }
                chosen => chosen,
            };
        }
        self
    }

    /// The same with rays that leave surfaces, where the materials seen or an environment ask for such.
    pub fn with_secondary(
        self,
        scene: &Scene,
        geometry: &FrameGeometry,
        environment: bool,
        options: &RenderOptions,
    ) -> Self {
        let shown = |material: u32| sends_rays(&scene.materials[material as usize]);
        let of_triangles = geometry.objects.iter().map(|object| object.material);
        let of_solids = geometry.solids.iter().map(|solid| solid.material);
        let any_shown = || of_triangles.chain(of_solids).any(shown);
        let bounces = options.bounces > 0 && (options.diffuse_bounces > 0 || any_shown());
        Self {
            secondary: environment || bounces,
            ..self
        }
    }
}

/// What costs the least; all at once only where every pixel sees one surface.
fn cheapest(costs: &ShadowCosts, one_surface: bool) -> ShadowStructure {
    let by_caster = if costs.tree < costs.grid {
        (costs.tree, ShadowStructure::Tree)
    } else {
        (costs.grid, ShadowStructure::Grid)
    };
    if one_surface && costs.receivers <= by_caster.0 {
        ShadowStructure::Receivers
    } else {
        by_caster.1
    }
}

/// Whether a material may reflect or transmit along rays.
fn sends_rays(material: &Material) -> bool {
    let coat = &material.coat;
    let may_be_glossy = material.roughness <= GLOSSY
        || material.metallic_roughness_texture.is_some()
        || (coat.factor > 0.0 && (coat.roughness <= GLOSSY || coat.roughness_texture.is_some()));
    !material.unlit && (may_be_glossy || material.transmission > 0.0)
}

/// A light's size in the local frame; `None` for a point and a single direction.
fn area_light(light: &PosedLight, origin: DVec3) -> Option<AreaLight> {
    let center = (light.position - origin).as_vec3();
    // In the order in which they turn towards where the light shines.
    let turned = light.axis_y.cross(light.axis_x).dot(light.direction) < 0.0;
    let half = |x: f32, y: f32| {
        let [x, y] = [light.axis_x * f64::from(x), light.axis_y * f64::from(y)].map(|v| v.as_vec3());
        if turned { [x, y] } else { [y, x] }
    };
    match light.kind {
        LightKind::Rectangle { width, height } if width > 0.0 && height > 0.0 => {
            let [u, v] = half(width * 0.5, height * 0.5);
            Some(AreaLight::rectangle(center, u, v))
        }
        LightKind::Disk { radius } if radius > 0.0 => {
            let [u, v] = half(radius, radius);
            Some(AreaLight::disk(center, u, v))
        }
        LightKind::Point { radius } | LightKind::Spot { radius, .. } if radius > 0.0 => {
            Some(AreaLight::sphere(center, radius))
        }
        LightKind::Directional { half_angle } if half_angle > 0.0 => {
            Some(AreaLight::sun((-light.direction).as_vec3(), half_angle))
        }
        _ => None,
    }
}
