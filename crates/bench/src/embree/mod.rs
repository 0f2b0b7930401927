//! Embree, where a shared library of it is on the system: loaded at run time, no build dependency.
//!
//! Packets of coherent rays, as wide as the library has them natively on this processor: sixteen with AVX-512, eight with
//! AVX, four below. Narrower ones are copied from and to the sixteen of a block, which costs some 2 %; wider ones the
//! library would take apart into single rays. `RAYWARD_EMBREE` names the library, or several as in `PATH`; without
//! it the usual names are tried, newest first. API 3 and 4 are known.

mod ffi;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayward::trace::Triangles;

use crate::packet::{LANES, NOTHING, Packet, Rays, Valid};
use crate::peers::{PacketTracer, Peer};
use crate::{Error, Result, Stopwatch};

/// Environment variable that names libraries.
pub(crate) const VARIABLE: &str = "RAYWARD_EMBREE";

/// Names tried without it.
const USUAL: &[&str] = &[
    "libembree4.so.4",
    "libembree4.so",
    "libembree3.so.3",
    "libembree3.so",
    "libembree4.4.dylib",
    "libembree4.dylib",
    "embree4.dll",
    "embree3.dll",
];

/// How its structure is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quality {
    /// Morton codes.
    Low,
    /// Binned surface area heuristic.
    Medium,
    /// With spatial splits.
    High,
    /// As high, with conservative traversal.
    Robust,
}

impl Quality {
    /// All of them.
    pub(crate) const ALL: [Self; 4] = [Self::Low, Self::Medium, Self::High, Self::Robust];

    fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
            Self::Robust => "high, robust",
        }
    }

    fn option(self) -> (i32, bool) {
        match self {
            Self::Low => (0, false),
            Self::Medium => (1, false),
            Self::High => (2, false),
            Self::Robust => (2, true),
        }
    }
}

/// A library that can be used.
#[derive(Clone)]
pub(crate) struct Library {
    embree: Arc<ffi::Embree>,
    name: String,
}

/// The libraries asked for, or else the newest that the system has; none is no error then.
pub(crate) fn libraries() -> Result<Vec<Library>> {
    let wanted = std::env::var_os(VARIABLE).filter(|paths| !paths.is_empty());
    if let Some(paths) = wanted {
        return std::env::split_paths(&paths)
            .map(|path| Library::open(&path))
            .collect();
    }
    let found = USUAL
        .iter()
        .find_map(|name| Library::open(&PathBuf::from(name)).ok());
    Ok(found.into_iter().collect())
}

impl Library {
    fn open(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        match ffi::Embree::open(path) {
            Ok(embree) => Ok(Self {
                embree: Arc::new(embree),
                name,
            }),
            Err(problem) => Err(Error::Embree {
                library: name,
                problem,
            }),
        }
    }

    /// Its version.
    pub(crate) fn version(&self) -> String {
        self.embree.version()
    }

    /// Version and width of its packets.
    pub(crate) fn description(&self) -> String {
        format!("{}, packets of {} rays", self.version(), self.embree.width())
    }

    /// Builds a structure; the build is that of committing the scene, on that many threads.
    pub(crate) fn build(
        &self,
        triangles: &Triangles,
        quality: Quality,
        threads: usize,
    ) -> Result<Peer<Embree>> {
        let fail = |problem| Error::Embree {
            library: self.name.clone(),
            problem,
        };
        let vertices: Vec<[f32; 3]> = (0..triangles.x.len() as u32)
            .map(|i| triangles.vertex(i).to_array())
            .collect();
        let option = quality.option();
        let scene = ffi::Scene::new(&self.embree, threads, option, &vertices, triangles.indices);
        let mut scene = scene.map_err(fail)?;
        let (built, build) = Stopwatch::time(|| scene.commit());
        built.map_err(fail)?;
        Ok(Peer {
            name: format!("Embree {}, {}", self.version(), quality.name()),
            build,
            tracer: Embree(scene),
        })
    }
}

/// A scene of Embree.
pub(crate) struct Embree(ffi::Scene);

impl PacketTracer for Embree {
    type Scratch = Parts;

    #[inline]
    fn closest(&self, valid: &Valid, packet: &mut Packet, parts: &mut Parts) {
        match self.0.width() {
            16 => self.0.closest(valid, packet),
            8 => closest_in_parts(&self.0, valid, packet, &mut parts.eight),
            _ => closest_in_parts(&self.0, valid, packet, &mut parts.four),
        }
    }

    #[inline]
    fn occluded(&self, valid: &Valid, rays: &mut Rays, parts: &mut Parts) {
        match self.0.width() {
            16 => self.0.occluded(valid, rays),
            8 => occluded_in_parts(&self.0, valid, rays, &mut parts.eight.rays),
            _ => occluded_in_parts(&self.0, valid, rays, &mut parts.four.rays),
        }
    }
}

/// Narrower packets of a thread.
#[derive(Default)]
pub(crate) struct Parts {
    eight: Packet<8>,
    four: Packet<4>,
}

fn closest_in_parts<const N: usize>(
    scene: &ffi::Scene,
    valid: &Valid,
    packet: &mut Packet,
    part: &mut Packet<N>,
) {
    for start in (0..LANES).step_by(N) {
        let end = start + N;
        let valid = take(&mut part.rays, &packet.rays, valid, start);
        part.hits.prim = [NOTHING; N];
        part.hits.geometry = [NOTHING; N];
        scene.closest(&valid, part);
        packet.rays.far[start..end].copy_from_slice(&part.rays.far);
        packet.hits.prim[start..end].copy_from_slice(&part.hits.prim);
    }
}

fn occluded_in_parts<const N: usize>(scene: &ffi::Scene, valid: &Valid, rays: &mut Rays, part: &mut Rays<N>) {
    for start in (0..LANES).step_by(N) {
        let valid = take(part, rays, valid, start);
        if valid.0 != [0; N] {
            scene.occluded(&valid, part);
        }
        rays.far[start..start + N].copy_from_slice(&part.far);
    }
}

/// Copies the rays from `start` on into a narrower packet.
#[inline]
fn take<const N: usize>(part: &mut Rays<N>, rays: &Rays, valid: &Valid, start: usize) -> Valid<N> {
    let end = start + N;
    for i in 0..3 {
        part.origin[i].copy_from_slice(&rays.origin[i][start..end]);
        part.dir[i].copy_from_slice(&rays.dir[i][start..end]);
    }
    part.near.copy_from_slice(&rays.near[start..end]);
    part.far.copy_from_slice(&rays.far[start..end]);
    let mut taken = Valid([0; N]);
    taken.0.copy_from_slice(&valid.0[start..end]);
    taken
}
