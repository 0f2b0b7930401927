//! Scenes to measure: geometry, a camera, a light, and an area light where there is one.

use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};
use rayward::scene::{
    self, CameraEntry, FrameGeometry, LightKind, LoadOptions, ObjectRange, PosedCamera, PosedLight, Scene,
    builtin,
};
use rayward::trace::{AreaLight, Clusters, Light, Topology, Triangles, View};
use rayward::{CameraFrame, FramePlan, RenderOptions};

use crate::{Error, Result};

/// Built-in scenes that are measured unless others are asked for.
const BUILT_IN: &[&str] = &[
    "blob-1k",
    "blob-16k",
    "blob-69k",
    "office",
    "courtyard",
    "forest",
    "collide",
    "conference",
];

/// Meshes of the scenes folder that are measured beside them.
const MESHES: &[&str] = &[
    "bunny69k",
    "conference331k",
    "sponza66k",
    "crytek_sponza279k",
    "forest174k",
    "dragon_bunny252k",
];

/// Names of all scenes that are measured unless others are asked for; those of the scenes folder where there is one.
pub fn all_scenes(folder: bool) -> impl Iterator<Item = &'static str> {
    let meshes = if folder { MESHES } else { &[] };
    BUILT_IN.iter().chain(meshes).copied()
}

/// A scene, posed at its beginning.
#[derive(Debug)]
pub struct BenchScene {
    /// Name, or path.
    pub name: String,
    /// The scene, for its materials.
    pub scene: Scene,
    /// Its triangles.
    pub geometry: FrameGeometry,
    /// Which triangles belong together; kept between frames as a renderer keeps it.
    pub topology: Topology,
    /// Clusters of its triangles, found once.
    pub clusters: Clusters,
    camera: PosedCamera,
    light: PosedLight,
    area: AreaLight,
    /// The same, as it is posed.
    posed_area: PosedLight,
}

impl BenchScene {
    /// A built-in scene, a mesh of the scenes folder, or a file, in this order.
    ///
    /// # Errors
    /// [`Error::UnknownScene`], and what the scene's reader says.
    pub fn load(name: &str, folder: Option<&Path>) -> Result<Self> {
        if builtin::NAMES.contains(&name) {
            return Self::new(name, builtin::build(name)?, None);
        }
        let entries = match folder {
            Some(folder) => Some((folder, scene::read_camera_file(&folder.join("cameras.json"))?)),
            None => None,
        };
        if let Some((folder, entries)) = &entries
            && let Some(entry) = entries.get(name)
            && let Some(file) = &entry.file
        {
            let scene = scene::load(&folder.join(file), &LoadOptions::default())?;
            return Self::new(name, scene, Some(entry));
        }
        let path = PathBuf::from(name);
        if path.is_file() {
            let scene = scene::load(&path, &LoadOptions::default())?;
            let entry = entries
                .as_ref()
                .and_then(|(_, entries)| scene::find_camera(entries, &path));
            return Self::new(name, scene, entry);
        }
        let mut known = builtin::NAMES.join(", ");
        if let Some((_, entries)) = &entries {
            known += "; in the scenes folder are ";
            known += &entries.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        }
        let name = name.into();
        Err(Error::UnknownScene { name, known })
    }

    /// A scene seen by its first camera and lit by its first light that has a place or a direction, or by what a
    /// camera file says.
    ///
    /// # Errors
    /// [`Error::Scene`] if there is no triangle.
    pub fn new(name: &str, scene: Scene, entry: Option<&CameraEntry>) -> Result<Self> {
        let geometry = scene.at(0.0);
        if geometry.indices.is_empty() {
            let (name, problem) = (name.into(), "there is no triangle in it");
            return Err(Error::Scene { name, problem });
        }
        let camera = match (entry, geometry.cameras.first()) {
            (Some(entry), _) => entry.camera(),
            (None, Some(camera)) => camera.clone(),
            (None, None) => scene::default_camera(&geometry, 1.6),
        };
        let mut lights = entry.map_or(Vec::new(), CameraEntry::lights);
        lights.extend(geometry.lights.iter().cloned());
        lights.extend(scene::default_lights(&camera));
        let rectangle = |light: &&PosedLight| matches!(light.kind, LightKind::Rectangle { .. });
        let square = scene::square_light_at(&lights[0], &geometry);
        let posed = lights.iter().find(rectangle).unwrap_or(&square).clone();
        let area = posed_area(&geometry, &posed).ok_or(Error::Scene {
            name: name.into(),
            problem: "its area light has no area",
        })?;
        let light = lights.swap_remove(0);
        let topology = Topology::analyse(&triangles_of(&geometry));
        let clusters = Clusters::new(&triangles_of(&geometry));
        Ok(Self {
            name: name.into(),
            scene,
            geometry,
            topology,
            clusters,
            camera,
            light,
            area,
            posed_area: posed,
        })
    }

    /// The triangles.
    pub fn triangles(&self) -> Triangles<'_> {
        triangles_of(&self.geometry)
    }

    /// The camera's raster of that size.
    ///
    /// # Errors
    /// What [`CameraFrame::new`] says; [`Error::Scene`] for a parallel camera.
    pub fn view(&self, width: u32, height: u32) -> Result<View> {
        let camera = CameraFrame::new(&self.camera, self.geometry.origin, width, height)?;
        if camera.orthographic {
            let (name, problem) = (self.name.clone(), "its camera is orthographic");
            return Err(Error::Scene { name, problem });
        }
        Ok(camera.view(&self.geometry))
    }

    /// The light, as a point or a direction.
    pub fn light(&self) -> Light {
        match self.light.kind {
            LightKind::Directional { .. } => Light::Directional((-self.light.direction).as_vec3()),
            _ => Light::Point(self.local(self.light.position)),
        }
    }

    /// Its area light: the first rectangle among its lights, or else a square in the place of its light.
    pub fn area_light(&self) -> AreaLight {
        self.area
    }

    /// The same with sides so many times as long.
    pub(crate) fn area_light_of_size(&self, times: f32) -> AreaLight {
        let mut light = self.posed_area.clone();
        if let LightKind::Rectangle { width, height } = &mut light.kind {
            (*width, *height) = (*width * times, *height * times);
        }
        posed_area(&self.geometry, &light).unwrap_or(self.area)
    }

    /// The same triangles so many times, one behind the other as its camera sees them.
    pub(crate) fn stacked(mut self, layers: usize) -> Self {
        let one = self.geometry.clone();
        let (low, high) = one.bounds().unwrap_or_default();
        let step = self.camera.forward.as_vec3() * (high - low).length();
        let (vertices, triangles) = (one.x.len() as u32, one.indices.len() as u32);
        for layer in 1..layers as u32 {
            let (geometry, to) = (&mut self.geometry, step * layer as f32);
            geometry.x.extend(one.x.iter().map(|x| x + to.x));
            geometry.y.extend(one.y.iter().map(|y| y + to.y));
            geometry.z.extend(one.z.iter().map(|z| z + to.z));
            let shifted = |i: u32| i + layer * vertices;
            geometry
                .indices
                .extend(one.indices.iter().map(|corners| corners.map(shifted)));
            geometry
                .objects
                .extend(one.objects.iter().map(|object| ObjectRange {
                    triangles: object.triangles.start + layer * triangles
                        ..object.triangles.end + layer * triangles,
                    vertices: shifted(object.vertices.start)..shifted(object.vertices.end),
                    ..object.clone()
                }));
        }
        self.topology = Topology::analyse(&triangles_of(&self.geometry));
        self.clusters = Clusters::new(&triangles_of(&self.geometry));
        self
    }

    /// Lights on a circle around the line from the middle of the scene to its light, for scenes with many.
    pub fn lights_around(&self, number: usize) -> Vec<Light> {
        let (low, high) = self.geometry.bounds().unwrap_or_default();
        let middle = (low + high) * 0.5;
        let Light::Point(light) = self.light() else {
            return vec![self.light(); number];
        };
        let axis = (light - middle).try_normalize().unwrap_or(Vec3::Y);
        let (u, v) = axis.any_orthonormal_pair();
        let radius = 0.1 * (light - middle).length();
        let around = |i: usize| {
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let share = (i as f32 / number as f32).sqrt();
            Light::Point(light + (u * cos + v * sin) * (radius * share))
        };
        (0..number).map(around).collect()
    }

    /// Moves the camera back to so many times its distance from the middle of the scene.
    pub(crate) fn step_back(&mut self, times: f64) {
        let (low, high) = self.geometry.bounds().unwrap_or_default();
        let middle = self.geometry.origin + (low + high).as_dvec3() * 0.5;
        self.camera.eye = middle + (self.camera.eye - middle) * times;
    }

    /// Turns the camera around, so that it sees nothing of what was before it.
    pub(crate) fn turn_away(&mut self) {
        self.camera.forward = -self.camera.forward;
    }

    fn local(&self, point: DVec3) -> Vec3 {
        (point - self.geometry.origin).as_vec3()
    }
}

fn posed_area(geometry: &FrameGeometry, light: &PosedLight) -> Option<AreaLight> {
    let plan = FramePlan::new(geometry, std::slice::from_ref(light), &RenderOptions::default());
    plan.lights[0].as_ref()?.area
}

fn triangles_of(geometry: &FrameGeometry) -> Triangles<'_> {
    Triangles {
        x: &geometry.x,
        y: &geometry.y,
        z: &geometry.z,
        indices: &geometry.indices,
    }
}
