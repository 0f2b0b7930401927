//! What a picture was made of and what it cost, for people and for programs.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use rayward::scene::{Material, Scene};
use rayward::{FrameStats, LightStats, RenderOptions, ShadowStructure};
use serde::Serialize;

use crate::args::MomentArgs;
use crate::gpu::{Device, DeviceSummary};
use crate::input::Input;
use crate::machine;
use crate::report::{bytes, clean, count, duration, milliseconds, thousands};
use crate::view::{Origin, View};

/// Wall times of what the library does not time itself.
pub(crate) struct Times {
    pub(crate) load: Duration,
    pub(crate) pose: Duration,
    pub(crate) prepare: Duration,
    pub(crate) write: Duration,
    pub(crate) total: Duration,
}

/// The summary; its fields are those of the JSON object.
#[derive(Serialize)]
pub(crate) struct Summary {
    scene: String,
    files: Vec<String>,
    width: u32,
    height: u32,
    time_s: f32,
    camera: String,
    camera_origin: Origin,
    lights: Vec<String>,
    lights_origin: Origin,
    triangles: usize,
    solids: usize,
    dropped_non_finite: usize,
    dropped_degenerate: usize,
    structures: Vec<Structure>,
    eye_rays: u64,
    shadow_rays: u64,
    secondary_rays: u64,
    exact_pixels: u64,
    lit_by_cell: u64,
    dark_by_cell: u64,
    /// Surfaces made for pixels.
    surfaces: u64,
    /// How the shadows of each light were found.
    shadows: Vec<Shadows>,
    /// All rays over the time of builds and tiles, shading included.
    mray_per_s: f64,
    load_ms: f64,
    pose_ms: f64,
    prepare_ms: f64,
    build_ms: f64,
    trace_ms: f64,
    write_ms: f64,
    total_ms: f64,
    threads: usize,
    simd: &'static str,
    peak_memory_bytes: Option<u64>,
    /// What a GPU did, if frames are made on one; of an animation, up to here.
    gpu: Option<DeviceSummary>,
    notices: Vec<String>,
}

#[derive(Serialize)]
struct Structure {
    name: String,
    build_ms: f64,
    bytes: usize,
    cells: usize,
    references: usize,
}

impl Summary {
    /// Gathers it.
    pub(crate) fn new(
        input: &Input,
        moment: &MomentArgs,
        view: &View,
        options: &RenderOptions,
        stats: &FrameStats,
        times: &Times,
        files: Vec<PathBuf>,
    ) -> Self {
        let seconds = (stats.build + stats.trace).as_secs_f64();
        let rays = (stats.eye_rays + stats.shadow_rays + stats.secondary_rays) as f64;
        let mut notices: Vec<_> = input.scene.notices.iter().map(ToString::to_string).collect();
        if options.bounces == 0 {
            notices.extend(not_shaded(&input.scene));
        }
        notices.extend(other_structure(options, stats));
        if moment.time != 0.0 && input.scene.animations.is_empty() {
            notices.push("--time: the scene has no animation".into());
        }
        Self {
            scene: input.path.display().to_string(),
            files: files.iter().map(|file| file.display().to_string()).collect(),
            width: options.width,
            height: options.height,
            time_s: moment.time,
            camera: view.camera.name.clone(),
            camera_origin: view.camera_origin,
            lights: view.lights.iter().map(|light| light.name.clone()).collect(),
            lights_origin: view.lights_origin,
            triangles: stats.triangles,
            solids: stats.solids,
            dropped_non_finite: stats.dropped_non_finite,
            dropped_degenerate: stats.dropped_degenerate,
            structures: stats.structures.iter().map(Structure::from).collect(),
            eye_rays: stats.eye_rays,
            shadow_rays: stats.shadow_rays,
            secondary_rays: stats.secondary_rays,
            exact_pixels: stats.exact_pixels,
            lit_by_cell: stats.lit_by_cell,
            dark_by_cell: stats.dark_by_cell,
            surfaces: stats.surfaces,
            shadows: stats.lights.iter().map(Shadows::from).collect(),
            mray_per_s: rays / seconds.max(1e-9) / 1e6,
            load_ms: milliseconds(times.load),
            pose_ms: milliseconds(times.pose),
            prepare_ms: milliseconds(times.prepare),
            build_ms: milliseconds(stats.build),
            trace_ms: milliseconds(stats.trace),
            write_ms: milliseconds(times.write),
            total_ms: milliseconds(times.total),
            threads: rayon::current_num_threads(),
            simd: options.level.name(),
            peak_memory_bytes: machine::peak_memory(),
            gpu: None,
            notices,
        }
    }

    /// The same with what a device has done.
    pub(crate) fn with_device(self, device: &Device) -> Self {
        Self {
            gpu: device.summary(),
            ..self
        }
    }

    /// The lines for people.
    pub(crate) fn text(&self) -> String {
        let mut out = String::new();
        self.write(&mut out).unwrap_or_default();
        out.truncate(out.trim_end().len());
        out
    }

    fn write(&self, out: &mut String) -> std::fmt::Result {
        let ms = |ms: f64| duration(Duration::from_secs_f64(ms / 1e3));
        for notice in &self.notices {
            writeln!(out, "notice: {}", clean(notice))?;
        }
        write!(
            out,
            "scene       {}, {}",
            clean(&self.scene),
            count(self.triangles, "triangle")
        )?;
        if self.solids > 0 {
            write!(out, ", {}", count(self.solids, "solid"))?;
        }
        match self.dropped_non_finite + self.dropped_degenerate {
            0 => writeln!(out)?,
            dropped => writeln!(
                out,
                "; {} dropped: {} not finite, {} without area",
                thousands(dropped as u64),
                thousands(self.dropped_non_finite as u64),
                thousands(self.dropped_degenerate as u64)
            )?,
        }
        writeln!(
            out,
            "camera      {}{}",
            quoted(&self.camera, self.camera_origin),
            self.camera_origin.words()
        )?;
        let lights = match self.lights.as_slice() {
            [] => "none ".into(),
            [one] => quoted(one, self.lights_origin),
            more => format!("{} ", more.len()),
        };
        writeln!(out, "light       {lights}{}", self.lights_origin.words())?;
        for structure in &self.structures {
            writeln!(
                out,
                "built       {} in {}, {}",
                clean(&structure.name),
                ms(structure.build_ms),
                bytes(structure.bytes as u64)
            )?;
        }
        writeln!(
            out,
            "rays        {} eye, {} shadow, {} secondary: {:.1} Mray/s with builds and shading",
            thousands(self.eye_rays),
            thousands(self.shadow_rays),
            thousands(self.secondary_rays),
            self.mray_per_s
        )?;
        writeln!(
            out,
            "time        {}: read {}, pose {}, prepare {}, build {}, trace and shade {}, write {}",
            ms(self.total_ms),
            ms(self.load_ms),
            ms(self.pose_ms),
            ms(self.prepare_ms),
            ms(self.build_ms),
            ms(self.trace_ms),
            ms(self.write_ms)
        )?;
        let peak = self.peak_memory_bytes.map_or("unknown".into(), bytes);
        writeln!(
            out,
            "memory      {peak} at peak; {}, {}",
            count(self.threads, "thread"),
            self.simd
        )?;
        match self.files.as_slice() {
            [] => writeln!(out, "written     standard output, {}x{}", self.width, self.height),
            files => {
                for file in files {
                    writeln!(out, "written     {}, {}x{}", clean(file), self.width, self.height)?;
                }
                Ok(())
            }
        }
    }
}

/// A name from a file in quotes; nothing for the others, which say nothing more than the origin.
fn quoted(name: &str, origin: Origin) -> String {
    if name.is_empty() || origin == Origin::MadeUp {
        String::new()
    } else {
        format!("\"{}\" ", clean(name))
    }
}

impl From<&rayward::StructureStats> for Structure {
    fn from(stats: &rayward::StructureStats) -> Self {
        Self {
            name: stats.name.clone(),
            build_ms: milliseconds(stats.build),
            bytes: stats.bytes,
            cells: stats.cells,
            references: stats.references,
        }
    }
}

/// Said where receivers were asked for and could not be taken all at once.
fn other_structure(options: &RenderOptions, stats: &FrameStats) -> Option<String> {
    let grids = stats
        .lights
        .iter()
        .filter(|light| light.structure == "grid")
        .count();
    let asked = options.shadow_structure == ShadowStructure::Receivers;
    (asked && grids > 0).then(|| {
        format!(
            "--shadow-structure receivers: {grids} lights have grids, for some surfaces let light through"
        )
    })
}

/// How the shadows of a light were found.
#[derive(Serialize)]
struct Shadows {
    light: String,
    structure: &'static str,
    /// What chose the structure, if it was not asked for: milliseconds on one thread.
    predicted_ms: Option<Costs>,
    steps: Option<Steps>,
}

#[derive(Serialize)]
struct Costs {
    receivers: f64,
    grid: f64,
    tree: f64,
}

/// Of a light's tree: what a ray was expected to pass, and what rays passed on average.
#[derive(Serialize)]
struct Steps {
    rays: u64,
    predicted_nodes: f64,
    measured_nodes: f64,
    predicted_triangles: f64,
    measured_triangles: f64,
}

impl From<&LightStats> for Shadows {
    fn from(stats: &LightStats) -> Self {
        Self {
            light: stats.name.clone(),
            structure: stats.structure,
            predicted_ms: stats.costs.map(|costs| Costs {
                receivers: costs.receivers,
                grid: costs.grid,
                tree: costs.tree,
            }),
            steps: stats.steps.map(|steps| Steps {
                rays: steps.rays,
                predicted_nodes: steps.predicted.nodes,
                measured_nodes: steps.measured.nodes,
                predicted_triangles: steps.predicted.triangles,
                measured_triangles: steps.measured.triangles,
            }),
        }
    }
}

/// What materials ask for that is not rendered without reflections and refractions, each said once.
fn not_shaded(scene: &Scene) -> Vec<String> {
    let count = |asks: fn(&Material) -> bool| scene.materials.iter().filter(|m| asks(m)).count();
    let transmitting = count(|m| m.transmission > 0.0);
    let mirrors =
        count(|m| m.metallic >= 0.9 && m.roughness <= 0.1 && m.metallic_roughness_texture.is_none());
    let mut notices = Vec::new();
    if transmitting > 0 {
        notices.push(format!(
            "--bounces 0: {transmitting} materials that transmit light are shown opaque"
        ));
    }
    if mirrors > 0 {
        notices.push(format!(
            "--bounces 0: {mirrors} materials that are mirrors reflect no surfaces"
        ));
    }
    notices
}
