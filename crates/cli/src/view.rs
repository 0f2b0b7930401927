//! Camera and lights of a picture: from the command line, a camera file, the scene, or made up.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DVec3, Vec3};
use rayward::scene::{
    self, CameraEntry, FrameGeometry, LightKind, PosedCamera, PosedLight, Projection, point_light_for,
};
use serde::Serialize;

use crate::args::ViewArgs;
use crate::failure::{Code, Failure};
use crate::input::{self, Input};
use crate::values::LightValue;

/// Field of view of a camera that is placed without one, as in camera files.
const VFOV_DEGREES: f64 = 45.0;

/// Where something was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Origin {
    CommandLine,
    CameraFile,
    Scene,
    Environment,
    MadeUp,
}

impl Origin {
    /// In words.
    pub(crate) fn words(self) -> &'static str {
        match self {
            Self::CommandLine => "from the command line",
            Self::CameraFile => "from the camera file",
            Self::Scene => "of the scene",
            Self::Environment => "but the environment",
            Self::MadeUp => "made up",
        }
    }
}

/// Camera and lights with their origins.
pub(crate) struct View {
    pub(crate) camera: PosedCamera,
    pub(crate) camera_origin: Origin,
    pub(crate) lights: Vec<PosedLight>,
    pub(crate) lights_origin: Origin,
    /// Light from all around, unless the arguments say otherwise.
    pub(crate) ambient: Vec3,
}

impl View {
    /// Chooses them for a picture of this width over height.
    pub(crate) fn choose(
        args: &ViewArgs,
        input: &Input,
        frame: &FrameGeometry,
        aspect: f64,
    ) -> Result<Self, Failure> {
        let entry = match &args.camera_file {
            Some(file) => Some(entry(file, args.camera_entry.as_deref(), input)?),
            None => None,
        };
        let (mut camera, camera_origin) = if let Some(eye) = args.camera_position {
            (placed(args, eye, frame)?, Origin::CommandLine)
        } else if let Some(entry) = &entry {
            (entry.camera(), Origin::CameraFile)
        } else if let Some(wanted) = &args.camera {
            let names = frame.cameras.iter().map(|camera| &*camera.name);
            let chosen = input::choose("camera", wanted, names, &input.path)?;
            (frame.cameras[chosen].clone(), Origin::Scene)
        } else if let Some(first) = frame.cameras.first() {
            (first.clone(), Origin::Scene)
        } else {
            (scene::default_camera(frame, aspect), Origin::MadeUp)
        };
        if let Some(degrees) = args.camera_vfov {
            camera.projection = perspective(degrees);
        }

        let center = input::center(frame);
        let of_file = match entry {
            Some(entry) => of_entry(&entry, args.area_light)?,
            None => Vec::new(),
        };
        let (lights, lights_origin) = if !args.lights.is_empty() {
            let lights = args.lights.iter().map(|light| posed(light, center));
            (lights.collect(), Origin::CommandLine)
        } else if !of_file.is_empty() {
            (of_file, Origin::CameraFile)
        } else if !frame.lights.is_empty() {
            (frame.lights.clone(), Origin::Scene)
        } else if args.environment.is_some() {
            (Vec::new(), Origin::Environment)
        } else {
            (scene::default_lights(&camera), Origin::MadeUp)
        };
        let ambient = match lights_origin {
            // Lights that are named shine alone.
            Origin::CommandLine | Origin::CameraFile => Vec3::ZERO,
            Origin::Scene | Origin::Environment | Origin::MadeUp => input.scene.ambient,
        };
        Ok(Self {
            camera,
            camera_origin,
            lights,
            lights_origin,
            ambient,
        })
    }
}

/// The one light of a camera file's entry that is used. Its area light stands where its point light does: the same light
/// for soft shadows.
fn of_entry(entry: &CameraEntry, area: bool) -> Result<Vec<PosedLight>, Failure> {
    let lights = entry.lights();
    if !area {
        return Ok(lights.into_iter().take(1).collect());
    }
    if entry.area_light.is_none() {
        return Err(Failure::new(
            Code::Input,
            "--area-light: the entry of the camera file has none",
        ));
    }
    Ok(lights.into_iter().last().into_iter().collect())
}

fn perspective(degrees: f64) -> Projection {
    Projection::Perspective {
        vfov: degrees.to_radians(),
        aspect: None,
    }
}

fn placed(args: &ViewArgs, eye: DVec3, frame: &FrameGeometry) -> Result<PosedCamera, Failure> {
    let target = args.camera_target.unwrap_or_else(|| input::center(frame));
    let usage = |problem: &str| Failure::new(Code::Usage, problem);
    let forward = (target - eye)
        .try_normalize()
        .ok_or_else(|| usage("--camera-position: the camera stands in its target"))?;
    let up = args.camera_up.reject_from_normalized(forward);
    // Nearer than this to the view direction, what is left of it is rounding.
    if up.length() < 1e-9 {
        return Err(usage(
            "--camera-up: it is the direction in which the camera looks",
        ));
    }
    Ok(PosedCamera {
        name: String::new(),
        eye,
        forward,
        up: up.normalize(),
        projection: perspective(VFOV_DEGREES),
    })
}

fn entry(file: &Path, name: Option<&str>, input: &Input) -> Result<CameraEntry, Failure> {
    let entries = scene::read_camera_file(file)?;
    let found = match name {
        Some(name) => entries.get(name),
        None => scene::find_camera(&entries, &input.path),
    };
    found.cloned().ok_or_else(|| {
        let wanted = name.map_or_else(|| input.path.display().to_string(), |name| format!("{name:?}"));
        Failure::new(
            Code::Input,
            format_args!("{}: no entry for {wanted}", file.display()),
        )
    })
}

fn posed(light: &LightValue, center: DVec3) -> PosedLight {
    match *light {
        LightValue::Point {
            position,
            radius,
            candela,
        } => {
            let mut light = point_light_for(position, center);
            light.kind = LightKind::Point { radius };
            if let Some(candela) = candela {
                light.power = Vec3::splat(candela);
            }
            light
        }
        LightValue::Flat { position, kind, nits } => {
            let light = point_light_for(position, center);
            let area = match kind {
                LightKind::Disk { radius } => PI as f32 * radius * radius,
                LightKind::Rectangle { width, height } => width * height,
                _ => 1.0,
            };
            let power = nits.map_or(light.power / area, Vec3::splat);
            PosedLight { kind, power, ..light }
        }
        LightValue::Sun {
            towards,
            half_angle,
            lux,
        } => {
            let direction = -towards;
            let (axis_x, axis_y) = direction.any_orthonormal_pair();
            PosedLight {
                name: "sun".into(),
                position: center,
                direction,
                axis_x,
                axis_y,
                power: Vec3::splat(lux.unwrap_or(PI as f32)),
                range: f32::INFINITY,
                kind: LightKind::Directional { half_angle },
            }
        }
    }
}
