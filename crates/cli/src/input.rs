//! From the command line to a posed scene.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::DVec3;
use rayward::scene::{self, FrameGeometry, LoadOptions, Scene, builtin};

use crate::args::{MomentArgs, SourceArgs};
use crate::failure::{Code, Failure};
use crate::machine;

/// A scene as it was read.
pub(crate) struct Input {
    pub(crate) scene: Scene,
    /// The file, or the built-in's name.
    pub(crate) path: PathBuf,
    /// Whether it is a built-in scene.
    pub(crate) builtin: bool,
    /// Time to read or make it.
    pub(crate) load: Duration,
}

impl Input {
    /// Reads the file or makes the built-in scene.
    pub(crate) fn read(source: &SourceArgs) -> Result<Self, Failure> {
        let start = Instant::now();
        let (scene, path) = match &source.scene {
            Some(path) => {
                let options = LoadOptions {
                    up: source.up.into(),
                    scale: source.scale,
                };
                (scene::load(path, &options)?, path.clone())
            }
            None => {
                let name = source.builtin.as_deref().unwrap_or(builtin::NAMES[0]);
                (builtin::build(name)?, PathBuf::from(name))
            }
        };
        Ok(Self {
            scene,
            path,
            builtin: source.scene.is_none(),
            load: start.elapsed(),
        })
    }

    /// Poses the scene, if it is not too large to be posed.
    pub(crate) fn pose(&self, moment: &MomentArgs) -> Result<FrameGeometry, Failure> {
        self.check_size()?;
        let animation = self.animation(moment.animation.as_deref())?;
        let mut frame = FrameGeometry::default();
        self.scene.at_animation(Some(animation), moment.time, &mut frame);
        Ok(frame)
    }

    /// Index of the animation of this name or index; the first if none is wanted.
    pub(crate) fn animation(&self, wanted: Option<&str>) -> Result<usize, Failure> {
        let names = self.scene.animations.iter().map(|animation| &*animation.name);
        wanted.map_or(Ok(0), |wanted| choose("animation", wanted, names, &self.path))
    }

    /// A few bytes of a file can ask for any number of instances.
    pub(crate) fn check_size(&self) -> Result<(), Failure> {
        let too_large = |what: String, limit: String| scene::Error::TooLarge {
            path: self.path.clone(),
            place: "all instances together".into(),
            what,
            limit,
        };
        let (vertices, triangles) = self.scene.posed_size();
        for (number, what) in [(vertices, "vertices"), (triangles, "triangles")] {
            if number > u64::from(u32::MAX) {
                return Err(too_large(format!("the number of {number} {what}"), u32::MAX.to_string()).into());
            }
        }
        // Positions and indices alone, see `FrameGeometry`.
        let bytes = 12 * vertices + 16 * triangles;
        match machine::available_memory() {
            Some(memory) if bytes > memory => Err(too_large(
                format!("the size of {bytes} bytes"),
                format!("the memory that could be had now, {memory} bytes"),
            )
            .into()),
            _ => Ok(()),
        }
    }
}

/// Position of the thing of this name, or else of this index; `what` names it, and the option that asks for it.
pub(crate) fn choose<'a>(
    what: &str,
    wanted: &str,
    names: impl Iterator<Item = &'a str> + Clone,
    path: &Path,
) -> Result<usize, Failure> {
    let by_name = names.clone().position(|name| name == wanted);
    let by_index = || wanted.parse().ok().filter(|&index| index < names.clone().count());
    by_name.or_else(by_index).ok_or_else(|| {
        let known: Vec<_> = names
            .enumerate()
            .map(|(i, name)| format!("{i} {name:?}"))
            .collect();
        let known = match known.len() {
            0 => format!("no {what}"),
            _ => known.join(", "),
        };
        Failure::new(
            Code::Usage,
            format_args!("--{what} {wanted}: not in {}, which has {known}", path.display()),
        )
    })
}

/// Middle of the box around the frame, in world space.
pub(crate) fn center(frame: &FrameGeometry) -> DVec3 {
    let middle = |(lo, hi): (glam::Vec3, glam::Vec3)| (lo.as_dvec3() + hi.as_dvec3()) / 2.0;
    frame.origin + frame.bounds().map_or(DVec3::ZERO, middle)
}

/// The format by magic, else by ending, in the order in which the loader decides.
pub(crate) fn format(path: &Path) -> String {
    use std::io::Read;
    let mut head = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    match (read, &head) {
        (Ok(()), b"glTF") => "GLB".into(),
        (Ok(()), b"ply\n" | b"ply\r") => "PLY".into(),
        _ => match path.extension() {
            Some(ending) => ending.to_string_lossy().to_ascii_uppercase(),
            None => "by content".into(),
        },
    }
}
