//! The rays of each class, the same for all structures, and their answers.

use glam::{DVec3, Vec3};
use rayward::trace::{
    BLOCK_LANES, Light, Ray, Receiver, Samples, SimdLevel, View, ViewRay, Visibility, exact, sequence_point,
};

use super::StructuresOptions;
use crate::contender::{FrameKind, Job, SOFT_SAMPLES, sample_set};
use crate::ours::{eye_grid, tile_side};
use crate::{BenchScene, Result};

/// A class of rays; see the [module](super).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RayClass {
    /// Of all pixels.
    Eye,
    /// To a light.
    Hard,
    /// To points of an area light.
    Soft,
    /// Mirrored.
    Reflection,
    /// Between random points.
    Random,
    /// All hits between random points.
    Through,
}

impl RayClass {
    /// All classes.
    pub const ALL: [Self; 6] = [
        Self::Eye,
        Self::Hard,
        Self::Soft,
        Self::Reflection,
        Self::Random,
        Self::Through,
    ];

    /// Its name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Eye => "eye",
            Self::Hard => "hard",
            Self::Soft => "soft",
            Self::Reflection => "reflection",
            Self::Random => "random",
            Self::Through => "through",
        }
    }

    /// What its rays are.
    pub fn what(self) -> &'static str {
        match self {
            Self::Eye => "rays of all pixels, closest hits",
            Self::Hard => "shadow rays from what the eye sees to the light",
            Self::Soft => "shadow rays from what the eye sees to eight points of an area light",
            Self::Reflection => "rays mirrored by what the eye sees, closest hits",
            Self::Random => "rays between random points, closest hits",
            Self::Through => "rays between random points, all hits",
        }
    }
}

/// What a ray was answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Answer {
    /// Hits: at most 1, unless all were asked for.
    pub(super) count: u32,
    /// Parameter of the closest, 0 where it was not asked for.
    pub(super) t: f32,
}

impl Answer {
    /// A closest hit.
    pub(super) fn closest(t: Option<f64>) -> Self {
        let count = u32::from(t.is_some());
        let t = t.unwrap_or(0.0) as f32;
        Self { count, t }
    }

    /// Whether something was between.
    pub(super) fn shadow(shadow: bool) -> Self {
        let count = u32::from(shadow);
        Self { count, t: 0.0 }
    }

    pub(super) fn hits(&self) -> bool {
        self.count > 0
    }

    /// Whether another answer is more than rounding away.
    pub(super) fn differs(&self, other: &Self) -> bool {
        self.count != other.count || (self.t - other.t).abs() > 1e-3 * other.t.abs()
    }
}

/// What is asked.
pub(super) enum Asked {
    /// The closest hit of each ray.
    Closest(Vec<Ray>),
    /// All hits of each ray.
    All(Vec<Ray>),
    /// Whether anything is between a receiver and a light, for each in turn.
    Shadow(Vec<(Receiver, Light)>),
}

/// The rays of a class.
pub(super) struct RaySet<'s> {
    pub(super) class: RayClass,
    pub(super) asked: Asked,
    /// The frame that they belong to.
    pub(super) job: Job<'s>,
    /// Pixels of the rays, or of the receivers.
    pub(super) pixels: Vec<[u32; 2]>,
    /// What the eye sees, where rays start there.
    pub(super) visibility: Option<Visibility>,
}

impl<'s> RaySet<'s> {
    /// The rays of a scene.
    pub(super) fn new(scene: &'s BenchScene, class: RayClass, options: &StructuresOptions) -> Result<Self> {
        let pixels = match class {
            RayClass::Soft => options.rays / SOFT_SAMPLES,
            _ => options.rays,
        };
        // Three to two, in whole squares of 16 pixels.
        let columns = (f64::from(pixels) * 1.5).sqrt() / 16.0;
        let width = (columns.ceil() as u32).max(1) * 16;
        let height = pixels.div_ceil(width).next_multiple_of(16);
        let job = Job::new(scene, [width, height], FrameKind::EyeSoft, options.level)?;
        let mut seen = None;
        let (pixels, asked) = match class {
            RayClass::Eye => eye(&job.view),
            RayClass::Random => (Vec::new(), Asked::Closest(random(scene, options.rays))),
            RayClass::Through => (Vec::new(), Asked::All(random(scene, options.rays))),
            RayClass::Hard | RayClass::Soft | RayClass::Reflection => {
                from_surfaces(&job, seen.insert(visibility(&job)), class)
            }
        };
        Ok(Self {
            class,
            asked,
            job,
            pixels,
            visibility: seen,
        })
    }
}

/// All pixels, by blocks of 4 x 4 in squares of 16 x 16.
fn in_squares(view: &View) -> impl Iterator<Item = [u32; 2]> + use<> {
    let (width, height) = (view.width, view.height);
    let squares = (0..height / 16).flat_map(move |y| (0..width / 16).map(move |x| [x * 16, y * 16]));
    let lanes = BLOCK_LANES as u32;
    squares.flat_map(move |[x, y]| {
        (0..256).map(move |i| {
            let (block, lane) = (i / lanes, i % lanes);
            [x + block % 4 * 4 + lane % 4, y + block / 4 * 4 + lane / 4]
        })
    })
}

fn eye(view: &View) -> (Vec<[u32; 2]>, Asked) {
    let pixels: Vec<_> = in_squares(view).collect();
    let ray = |&[x, y]: &[u32; 2]| Ray::new(view.center, view.pixel_ray(x, y).dir.as_vec3());
    let rays = pixels.iter().map(ray).collect();
    (pixels, Asked::Closest(rays))
}

/// The tile of a pixel, and where in it the pixel is.
pub(super) fn in_tile(view: &View, [x, y]: [u32; 2]) -> [u32; 3] {
    let side = tile_side();
    [
        y / side * view.width.div_ceil(side) + x / side,
        x % side,
        y % side,
    ]
}

fn from_surfaces(job: &Job, visibility: &Visibility, class: RayClass) -> (Vec<[u32; 2]>, Asked) {
    let (view, triangles, facets) = (&job.view, job.scene.triangles(), job.facets());
    let (mut pixels, mut receivers, mut mirrored) = (Vec::new(), Vec::new(), Vec::new());
    let (low, high) = job.scene.geometry.bounds().unwrap_or_default();
    let start = (high - low).length() * 1e-4;
    for pixel in in_squares(view) {
        let [tile, x, y] = in_tile(view, pixel);
        let Some(prim) = visibility.prim(tile, x, y) else {
            continue;
        };
        let ray = view.pixel_ray(pixel[0], pixel[1]);
        let corners = triangles.corners(prim);
        let Some(hit) = exact::attributes(ray.origin, ray.dir, corners) else {
            continue;
        };
        let receiver = Receiver::along(&ray, hit.t, prim);
        if class == RayClass::Reflection {
            mirrored.push(reflected(&ray, &receiver, corners, start));
        } else if facets.facet(prim) <= 0.0 || !job.area.shines_at(receiver.point) {
            continue;
        }
        receivers.push(receiver);
        pixels.push(pixel);
    }
    let asked = match class {
        RayClass::Reflection => Asked::Closest(mirrored),
        RayClass::Soft => Asked::Shadow(to_samples(job, &pixels, &receivers)),
        _ => Asked::Shadow(
            receivers
                .into_iter()
                .map(|receiver| (receiver, job.light))
                .collect(),
        ),
    };
    (pixels, asked)
}

/// Starts a little off the surface, for all alike.
fn reflected(ray: &ViewRay, receiver: &Receiver, corners: [Vec3; 3], start: f32) -> Ray {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let dir = ray.dir.normalize_or(DVec3::Z).reflect(normal);
    Ray {
        t_min: start,
        ..Ray::new(receiver.point.as_vec3(), dir.as_vec3())
    }
}

fn to_samples(job: &Job, pixels: &[[u32; 2]], receivers: &[Receiver]) -> Vec<(Receiver, Light)> {
    let samples: &Samples = &job.samples;
    let ends = |(receiver, &[x, y]): (&Receiver, &[u32; 2])| {
        let (receiver, pixel) = (*receiver, sample_set(x, y));
        let end = move |k| (receiver, job.area.sample(samples, pixel, receiver.point, k));
        (0..SOFT_SAMPLES).map(end).collect::<Vec<_>>()
    };
    receivers.iter().zip(pixels).flat_map(ends).collect()
}

/// Rays between points of the scene's box, made a tenth larger.
fn random(scene: &BenchScene, count: u32) -> Vec<Ray> {
    let (low, high) = scene.geometry.bounds().unwrap_or_default();
    let (middle, half) = ((low + high) * 0.5, (high - low) * 0.55);
    let ray = |i: u32| {
        let [[a, b], [c, d], [e, f]] = [1, 2, 3].map(|pair| sequence_point([0, 0, pair], i));
        let [from, to] = [Vec3::new(a, b, c), Vec3::new(d, e, f)].map(|p| middle + half * (p * 2.0 - 1.0));
        Ray::new(from, to - from)
    };
    (0..count).map(ray).collect()
}

/// The rays of the class [`RayClass::Reflection`] in a picture of about that size.
///
/// # Errors
/// What [`BenchScene::view`] says.
pub(crate) fn mirrored_rays(
    scene: &BenchScene,
    [width, height]: [u32; 2],
    level: SimdLevel,
) -> Result<Vec<Ray>> {
    let size = [width, height].map(|side| side.next_multiple_of(16));
    let job = Job::new(scene, size, FrameKind::Eye, level)?;
    Ok(
        match from_surfaces(&job, &visibility(&job), RayClass::Reflection).1 {
            Asked::Closest(rays) => rays,
            Asked::All(_) | Asked::Shadow(_) => Vec::new(),
        },
    )
}

/// What the eye sees, as [`Visibility`].
pub(super) fn visibility(job: &Job) -> Visibility {
    Visibility::trace(&eye_grid(job), &|| ())
}
