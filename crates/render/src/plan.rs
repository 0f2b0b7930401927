//! Which structure serves which class of rays in a frame, and with what parameters: plain data, decided before
//! anything is built.
//!
//! | rays | structure |
//! |---|---|
//! | eye rays | one tiled perspective grid (HM08 §5.1) |
//! | shadow rays of a light | one perspective grid each (HM08 §5.2) |
//! | what lies behind masked and blended surfaces | a hierarchy, if there are any |

use glam::DVec3;
use rayward_scene::{FrameGeometry, LightKind, PosedLight};
use rayward_trace::{Cone, EyeGridOptions, Light, LightGridOptions};

use crate::RenderOptions;
use crate::geometry::shadow_end;

/// The structures of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FramePlan {
    /// Parameters of the camera's grid.
    pub eye: EyeGridOptions,
    /// One entry a light: how its shadows are found, or `None` if it casts none.
    pub lights: Vec<Option<LightPlan>>,
}

/// The grid of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPlan {
    /// Name of the light, possibly empty.
    pub name: String,
    /// Where the shadow rays end.
    pub light: Light,
    /// Parameters of its grid.
    pub grid: LightGridOptions,
}

/// A spot light wider than this gets the faces of a point light, radians.
const WIDEST_CONE: f32 = 1.2;

impl FramePlan {
    /// The plan for these lights. Area lights cast the hard shadow of their centre.
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
                grid: LightGridOptions { cone, ..grid },
            }
        };
        let lights = lights
            .iter()
            .map(|light| options.shadows.then(|| plan(light)))
            .collect();
        Self { eye, lights }
    }
}
