//! `rayward info`: what is in a scene, and what of it will be skipped.

use std::fmt::Write;

use glam::DVec3;
use rayward::scene::{FrameGeometry, LightKind, PosedCamera, PosedLight, Projection};
use rayward::trace::topology::NO_COMPONENT;
use rayward::trace::{Topology, Triangles};
use serde::Serialize;

use crate::args::InfoArgs;
use crate::failure::Failure;
use crate::input::{self, Input};
use crate::report::{self, clean, count, thousands};

/// The findings; its fields are those of the JSON object. Lengths are metres, angles degrees.
#[derive(Serialize)]
struct Info {
    scene: String,
    format: String,
    triangles: usize,
    vertices: usize,
    objects: usize,
    solids: usize,
    dropped_non_finite: usize,
    dropped_degenerate: usize,
    nodes: usize,
    meshes: usize,
    skins: usize,
    materials: Vec<String>,
    textures: Vec<Texture>,
    cameras: Vec<Camera>,
    lights: Vec<Light>,
    animations: Vec<Animation>,
    bounds: Option<Bounds>,
    components: Components,
    notices: Vec<String>,
}

#[derive(Serialize)]
struct Texture {
    name: String,
    width: u32,
    height: u32,
}

#[derive(Serialize)]
struct Camera {
    name: String,
    projection: &'static str,
    eye: Point,
    vfov_deg: Option<f64>,
    height: Option<f64>,
}

#[derive(Serialize)]
struct Light {
    name: String,
    kind: &'static str,
    position: Option<Point>,
    direction: Option<Point>,
    power: [f32; 3],
    unit: &'static str,
}

#[derive(Serialize)]
struct Animation {
    name: String,
    duration_s: f32,
    channels: usize,
}

#[derive(Serialize)]
struct Bounds {
    min: Point,
    max: Point,
}

/// Surfaces by whether they bound a volume.
#[derive(Serialize)]
struct Components {
    closed: usize,
    closed_triangles: usize,
    open: usize,
    open_triangles: usize,
    /// Triangles with two corners at one position.
    loose_triangles: usize,
}

/// A point in world space.
type Point = [f64; 3];

/// Reads, looks and tells.
pub(crate) fn run(args: &InfoArgs) -> Result<(), Failure> {
    let input = Input::read(&args.source)?;
    let frame = input.pose(&args.moment)?;
    let info = Info::new(&input, &frame);
    if args.json {
        report::to_stdout_json(&info)
    } else {
        report::to_stdout(info.text().as_bytes())
    }
}

impl Info {
    fn new(input: &Input, frame: &FrameGeometry) -> Self {
        let scene = &input.scene;
        // Index 0 of the materials is the loader's own, which a scene may or may not use.
        let default_used = frame.objects.iter().any(|object| object.material == 0);
        let materials = scene.materials.iter().skip(usize::from(!default_used));
        Self {
            scene: input.path.display().to_string(),
            format: if input.builtin {
                "built-in".into()
            } else {
                input::format(&input.path)
            },
            triangles: frame.triangle_count(),
            vertices: frame.x.len(),
            objects: frame.objects.len(),
            solids: frame.solids.len(),
            dropped_non_finite: frame.dropped_non_finite,
            dropped_degenerate: frame.dropped_degenerate,
            nodes: scene.nodes.len(),
            meshes: scene.meshes.len(),
            skins: scene.skins.len(),
            materials: materials.map(|material| material.name.clone()).collect(),
            textures: scene
                .images
                .iter()
                .map(|image| Texture {
                    name: image.name.clone(),
                    width: image.width,
                    height: image.height,
                })
                .collect(),
            cameras: frame.cameras.iter().map(Camera::from).collect(),
            lights: frame.lights.iter().map(Light::from).collect(),
            animations: scene
                .animations
                .iter()
                .map(|animation| Animation {
                    name: animation.name.clone(),
                    duration_s: animation.duration(),
                    channels: animation.channels.len(),
                })
                .collect(),
            bounds: frame.bounds().map(|(min, max)| Bounds {
                min: (frame.origin + min.as_dvec3()).to_array(),
                max: (frame.origin + max.as_dvec3()).to_array(),
            }),
            components: Components::of(frame),
            notices: scene.notices.iter().map(ToString::to_string).collect(),
        }
    }

    fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out).unwrap_or_default();
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "scene       {}, {}", clean(&self.scene), self.format)?;
        writeln!(
            out,
            "geometry    {}, {}, {}",
            count(self.triangles, "triangle"),
            format_args!("{} vertices", thousands(self.vertices as u64)),
            count(self.objects, "object")
        )?;
        if self.solids > 0 {
            writeln!(out, "solids      {}", thousands(self.solids as u64))?;
        }
        if self.dropped_non_finite + self.dropped_degenerate > 0 {
            writeln!(
                out,
                "dropped     {} not finite, {} without area",
                count(self.dropped_non_finite, "triangle"),
                thousands(self.dropped_degenerate as u64)
            )?;
        }
        self.components.write(out)?;
        if let Some(Bounds { min, max }) = &self.bounds {
            writeln!(out, "bounds      {} to {}", point(*min), point(*max))?;
        }
        writeln!(
            out,
            "holds       {}, {}, {}, {}",
            count(self.nodes, "node"),
            count(self.meshes, "mesh"),
            count(self.skins, "skin"),
            count(self.materials.len(), "material")
        )?;
        for texture in &self.textures {
            let name = clean(&texture.name);
            writeln!(out, "texture     {name:?}, {}x{}", texture.width, texture.height)?;
        }
        for camera in &self.cameras {
            camera.write(out)?;
        }
        if self.cameras.is_empty() {
            writeln!(out, "camera      none: one is made up")?;
        }
        for light in &self.lights {
            light.write(out)?;
        }
        if self.lights.is_empty() {
            writeln!(out, "light       none: one is made up")?;
        }
        for (i, animation) in self.animations.iter().enumerate() {
            let name = clean(&animation.name);
            let channels = count(animation.channels, "channel");
            writeln!(
                out,
                "animation   {i} \"{name}\", {} s, {channels}",
                animation.duration_s
            )?;
        }
        for notice in &self.notices {
            writeln!(out, "notice      {}", clean(notice))?;
        }
        Ok(())
    }
}

fn point([x, y, z]: Point) -> String {
    // Six significant digits or so: what f32 holds.
    format!("({}, {}, {})", x as f32, y as f32, z as f32)
}

impl Components {
    fn of(frame: &FrameGeometry) -> Self {
        let triangles = Triangles::new(&frame.x, &frame.y, &frame.z, &frame.indices);
        let topology = Topology::analyse(&triangles);
        let sum = |closed: bool| {
            let of_kind = topology.components.iter().filter(|c| c.closed == closed);
            of_kind.fold((0, 0), |(number, triangles), c| {
                (number + 1, triangles + c.triangles)
            })
        };
        let ((closed, closed_triangles), (open, open_triangles)) = (sum(true), sum(false));
        let of_triangle = topology.component_of_triangle.iter();
        Self {
            closed,
            closed_triangles,
            open,
            open_triangles,
            loose_triangles: of_triangle.filter(|&&c| c == NO_COMPONENT).count(),
        }
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        write!(
            out,
            "surfaces    {} closed ({}), {} open ({})",
            thousands(self.closed as u64),
            count(self.closed_triangles, "triangle"),
            thousands(self.open as u64),
            count(self.open_triangles, "triangle")
        )?;
        match self.loose_triangles {
            0 => writeln!(out),
            loose => writeln!(out, ", {} of neither", count(loose, "triangle")),
        }
    }
}

impl From<&PosedCamera> for Camera {
    fn from(camera: &PosedCamera) -> Self {
        let (projection, vfov_deg, height) = match camera.projection {
            Projection::Perspective { vfov, .. } => ("perspective", Some(vfov.to_degrees()), None),
            Projection::Orthographic { half_height, .. } => ("orthographic", None, Some(2.0 * half_height)),
        };
        Self {
            name: camera.name.clone(),
            projection,
            eye: camera.eye.to_array(),
            vfov_deg,
            height,
        }
    }
}

impl Camera {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        let (name, projection, eye) = (clean(&self.name), self.projection, point(self.eye));
        write!(out, "camera      \"{name}\", {projection}, at {eye}")?;
        match (self.vfov_deg, self.height) {
            (Some(degrees), _) => writeln!(out, ", {degrees:.1} degrees"),
            (None, Some(metres)) => writeln!(out, ", {metres} m high"),
            (None, None) => writeln!(out),
        }
    }
}

impl From<&PosedLight> for Light {
    fn from(light: &PosedLight) -> Self {
        let (kind, placed, directed, unit) = match light.kind {
            LightKind::Point { .. } => ("point", true, false, "cd"),
            LightKind::Directional { .. } => ("directional", false, true, "lx"),
            LightKind::Spot { .. } => ("spot", true, true, "cd"),
            LightKind::Rectangle { .. } => ("rectangle", true, true, "nt"),
            LightKind::Disk { .. } => ("disk", true, true, "nt"),
        };
        let array = |wanted: bool, vector: DVec3| wanted.then(|| vector.to_array());
        Self {
            name: light.name.clone(),
            kind,
            position: array(placed, light.position),
            direction: array(directed, light.direction),
            power: light.power.to_array(),
            unit,
        }
    }
}

impl Light {
    fn write(&self, out: &mut String) -> std::fmt::Result {
        let (name, kind) = (clean(&self.name), self.kind);
        write!(out, "light       \"{name}\", {kind}")?;
        if let Some(position) = self.position {
            write!(out, ", at {}", point(position))?;
        }
        if let Some(direction) = self.direction {
            write!(out, ", towards {}", point(direction))?;
        }
        let [r, g, b] = self.power;
        writeln!(out, ", {r} {g} {b} {}", self.unit)
    }
}
