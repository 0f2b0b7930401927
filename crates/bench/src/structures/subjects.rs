//! Everybody who answers rays.

use rayward::trace::ldc::{HitTest, Steps};
use rayward::trace::space::World;
use rayward::trace::{
    Accel, AreaLightGrid, AreaLightTree, AreaScratch, BruteForce, Bvh, Candidates, Casts, Count, Counters,
    FaceOptions, Grid3, Hit, Ldc, LdcOptions, Light, LightGridOptions, PerspectiveGrids, PointLightGrid,
    PointLightTree, Ray, Receiver, Samples, ShadowScratch, SimdLevel, exact,
};

use super::rays::{Answer, Asked, RaySet, in_tile, visibility};
use super::{BRUTE, RayClass, Structure, StructuresOptions};
use crate::contender::{FrameKind, Job, SOFT_SAMPLES, sample_set};
use crate::embree::{Library, Quality};
use crate::ours::{Rayward, Ways, eye_grid};
use crate::packet::{LANES, NOTHING, Packet, Valid};
use crate::peers::{BvhOfShapes, CUT, Obvhs, ObvhsTree, PacketTracer, Peer};
use crate::{BenchScene, Result, Stopwatch, Time};

type Answering<'s> = dyn Fn(&RaySet, &mut Vec<Answer>) -> bool + Send + Sync + 's;
type Counting<'s> = dyn Fn(&RaySet) -> Option<Counters> + Send + Sync + 's;

/// A structure that answers.
pub(super) struct Subject<'s> {
    pub(super) name: String,
    what: &'static str,
    build: Time,
    bytes: Option<usize>,
    /// Whether it stands for the scene by samples, so that its answers differ by design.
    pub(super) samples: bool,
    /// Answers all rays; `false` if it does not take such.
    pub(super) answer: Box<Answering<'s>>,
    /// Does it again and counts, where there are counters.
    pub(super) count: Option<Box<Counting<'s>>>,
}

impl Subject<'_> {
    pub(super) fn structure(&self) -> Structure {
        Structure {
            name: self.name.clone(),
            what: self.what,
            build_ms: self.build.cpu.as_secs_f64() * 1e3,
            bytes: self.bytes,
        }
    }
}

/// All of them; the first one's answers are those that the others are held against.
pub(super) fn all<'s>(
    scene: &'s BenchScene,
    options: &StructuresOptions,
    libraries: &[Library],
) -> Result<Vec<Subject<'s>>> {
    let triangles = scene.triangles();
    let job = Job::new(scene, [16, 16], FrameKind::EyeSoft, options.level)?;
    let mut subjects = vec![
        general(
            "bvh",
            "hierarchy for any ray",
            || Bvh::build(triangles),
            |bvh| Some(bvh.bytes()),
        ),
        general(
            "regular grid",
            "grid in world space, resolution by number of triangles",
            || Grid3::in_world(triangles, None),
            |grid| Some(grid.bytes()),
        ),
    ];
    let around = |center| move || PerspectiveGrids::build(center, triangles, &FaceOptions::default());
    let mut perspective = |name, what, center| {
        subjects.push(general(name, what, around(center), |grids| Some(grids.bytes())));
    };
    perspective(
        "perspective grids, eye",
        "six perspective grids around the eye",
        job.view.center.as_dvec3(),
    );
    if let Light::Point(center) = job.light {
        perspective(
            "perspective grids, light",
            "six perspective grids around the light",
            center.as_dvec3(),
        );
    }
    let cube = LdcOptions {
        resolution: options.cube,
        ..LdcOptions::default()
    };
    let build = move || Ldc::build(triangles, &cube);
    subjects.push(general("cube", "layered depth cube, exact", build, |cube| {
        Some(cube.bytes())
    }));
    subjects.push(sampled(build));
    subjects.push(eye_rays(&job));
    subjects.push(lit_pixels(&job));
    subjects.push(light_grid(scene, &job));
    subjects.push(light_tree(scene, &job));
    subjects.push(area_tree(scene, &job));
    subjects.push(area_grid(scene, &job));
    subjects.push(brute(scene));
    if options.peers {
        for tree in [ObvhsTree::Wide, ObvhsTree::Binary] {
            subjects.push(peer(Obvhs::build(&triangles, tree), "library, ray by ray"));
        }
        subjects.push(peer(BvhOfShapes::build(&triangles), "library, ray by ray"));
        for library in libraries {
            for quality in Quality::ALL {
                subjects.push(peer(
                    library.build(&triangles, quality, 1)?,
                    "library, packets of rays",
                ));
            }
        }
    }
    Ok(subjects)
}

/// A structure for any ray.
pub(crate) trait General: Send + Sync {
    fn closest(&self, ray: &Ray, count: &mut impl Count) -> Option<f64>;
    fn shadows(&self, receiver: &Receiver, light: &Light, count: &mut impl Count) -> bool;
    fn hits(&self, ray: &Ray, scratch: &mut Vec<Hit>);
}

/// By the methods of this type or trait, which take the counter as it is.
macro_rules! general {
    ($structure:ty, $methods:ident) => {
        impl General for $structure {
            fn closest(&self, ray: &Ray, count: &mut impl Count) -> Option<f64> {
                $methods::closest(self, ray, count).map(|(_, hit)| hit.t)
            }
            fn shadows(&self, receiver: &Receiver, light: &Light, count: &mut impl Count) -> bool {
                $methods::shadows(self, receiver, light, count)
            }
            fn hits(&self, ray: &Ray, scratch: &mut Vec<Hit>) {
                self.all_hits(ray, scratch);
            }
        }
    };
}
general!(Bvh<'_>, Bvh);
general!(Grid3<'_, World>, Candidates);
general!(PerspectiveGrids<'_>, Candidates);

/// Cells and texels as nodes.
struct Nodes<'c, C>(&'c mut C);

impl<C: Count> Steps for Nodes<'_, C> {
    fn cell(&mut self) {
        self.0.node();
    }
    fn texel(&mut self) {
        self.0.node();
    }
    fn samples(&mut self, _: usize) {}
    fn triangle(&mut self) {
        self.0.triangles(1);
    }
}

impl General for Ldc<'_> {
    fn closest(&self, ray: &Ray, count: &mut impl Count) -> Option<f64> {
        Ldc::closest(self, ray, &mut Nodes(count)).map(|(_, hit)| hit.t)
    }
    fn shadows(&self, receiver: &Receiver, light: &Light, count: &mut impl Count) -> bool {
        Ldc::shadows(self, receiver, light, &mut Nodes(count))
    }
    fn hits(&self, ray: &Ray, scratch: &mut Vec<Hit>) {
        self.all_hits(ray, scratch);
    }
}

fn general<'s, T: General + 's>(
    name: &str,
    what: &'static str,
    build: impl FnOnce() -> T,
    bytes: impl FnOnce(&T) -> Option<usize>,
) -> Subject<'s> {
    let (tracer, build) = Stopwatch::time(build);
    let bytes = bytes(&tracer);
    let tracer = std::sync::Arc::new(tracer);
    let counted = tracer.clone();
    Subject {
        name: name.into(),
        what,
        build,
        bytes,
        samples: false,
        answer: Box::new(move |set, answers| {
            answer_all(&*tracer, set, &mut (), answers);
            true
        }),
        count: Some(Box::new(move |set| {
            let mut counters = Counters::default();
            let counts = !matches!(set.asked, Asked::All(_));
            counts.then(|| answer_all(&*counted, set, &mut counters, &mut Vec::new()));
            counts.then_some(counters)
        })),
    }
}

fn answer_all(tracer: &impl General, set: &RaySet, count: &mut impl Count, answers: &mut Vec<Answer>) {
    answers.clear();
    match &set.asked {
        Asked::Closest(rays) => {
            answers.extend(rays.iter().map(|ray| Answer::closest(tracer.closest(ray, count))));
        }
        Asked::Shadow(pairs) => {
            let shadow = |(receiver, light): &(Receiver, Light)| tracer.shadows(receiver, light, count);
            answers.extend(pairs.iter().map(shadow).map(Answer::shadow));
        }
        Asked::All(rays) => {
            let mut hits = Vec::new();
            answers.extend(rays.iter().map(|ray| {
                tracer.hits(ray, &mut hits);
                Answer {
                    count: hits.len() as u32,
                    t: hits.first().map_or(0.0, |hit| hit.t),
                }
            }));
        }
    }
}

/// The cube by its samples alone.
fn sampled<'s>(build: impl FnOnce() -> Ldc<'s>) -> Subject<'s> {
    let (cube, build) = Stopwatch::time(build);
    Subject {
        name: "cube, planes of samples".into(),
        what: "layered depth cube, answers by its samples",
        build,
        bytes: Some(cube.bytes()),
        samples: true,
        answer: Box::new(move |set, answers| {
            let Asked::Closest(rays) = &set.asked else {
                return false;
            };
            let test = HitTest::Plane { margin: 0.25 };
            answers.clear();
            let closest = |ray| {
                cube.closest_sampled(ray, test, &mut ())
                    .map(|hit| f64::from(hit.t))
            };
            answers.extend(rays.iter().map(closest).map(Answer::closest));
            true
        }),
        count: None,
    }
}

/// A structure that is made anew for each set, whose answers come all at once.
fn at_once<'s>(
    name: &str,
    what: &'static str,
    (build, bytes): (Time, Option<usize>),
    answer: impl Fn(&RaySet, &mut Vec<Answer>) -> bool + Send + Sync + 's,
) -> Subject<'s> {
    Subject {
        name: name.into(),
        what,
        build,
        bytes,
        samples: false,
        answer: Box::new(answer),
        count: None,
    }
}

fn eye_rays<'s>(job: &Job) -> Subject<'s> {
    let (grid, build) = Stopwatch::time(|| eye_grid(job));
    let what = "tiles of the camera; its build is in the time of its rays";
    at_once("eye grid", what, (build, Some(grid.bytes())), |set, answers| {
        if set.class != RayClass::Eye {
            return false;
        }
        let Asked::Closest(rays) = &set.asked else {
            return false;
        };
        let visibility = visibility(&set.job);
        answers.clear();
        let triangles = set.job.scene.triangles();
        answers.extend(set.pixels.iter().zip(rays).map(|(&pixel, ray)| {
            let [tile, x, y] = in_tile(&set.job.view, pixel);
            let prim = visibility.prim(tile, x, y);
            let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
            let attributes = |prim| exact::attributes(origin, dir, triangles.corners(prim));
            Answer::closest(prim.and_then(attributes).map(|at| at.t))
        }));
        true
    })
}

fn lit_pixels<'s>(job: &Job) -> Subject<'s> {
    let ours = Rayward::new(Ways::usual());
    let build = Stopwatch::time(|| ours.lit(job, &visibility(job), job.light)).1;
    let what =
        "receivers of all pixels in the light's raster, casters over them; it is all in the time of its rays";
    at_once("lit pixels", what, (build, None), move |set, answers| {
        // What the eye sees is no part of the question.
        let (RayClass::Hard, Some(visibility)) = (set.class, &set.visibility) else {
            return false;
        };
        let lit = ours.lit(&set.job, visibility, set.job.light);
        answers.clear();
        answers.extend(set.pixels.iter().map(|&pixel| {
            let [tile, x, y] = in_tile(&set.job.view, pixel);
            Answer::shadow(!lit.is_lit(tile, x, y))
        }));
        true
    })
}

fn light_grid<'s>(scene: &'s BenchScene, job: &Job) -> Subject<'s> {
    let options = LightGridOptions::default();
    let (light, level) = (job.light, job.level);
    let build = || PointLightGrid::build(light, scene.triangles(), &|_| Casts::Both, options, level);
    let (grid, build) = Stopwatch::time(build);
    let (what, cost) = (
        "perspective grid of the light, casters in cells",
        (build, Some(grid.bytes())),
    );
    hard_shadows("light grid", what, cost, move |receivers, scratch, shadow| {
        grid.shadowed(receivers, scratch, shadow);
    })
}

fn light_tree<'s>(scene: &'s BenchScene, job: &Job) -> Subject<'s> {
    let (light, level) = (job.light, job.level);
    let build = || PointLightTree::build(light, scene.triangles(), &|_| Casts::Both, None, level);
    let (tree, build) = Stopwatch::time(build);
    let (what, cost) = (
        "hierarchy in the light's perspective space",
        (build, Some(tree.bytes())),
    );
    hard_shadows("light tree", what, cost, move |receivers, scratch, shadow| {
        tree.shadowed(receivers, scratch, shadow);
    })
}

/// What takes receivers of the scene's light.
fn hard_shadows<'s>(
    name: &str,
    what: &'static str,
    cost: (Time, Option<usize>),
    shadowed: impl Fn(&[Receiver], &mut ShadowScratch, &mut Vec<bool>) + Send + Sync + 's,
) -> Subject<'s> {
    at_once(name, what, cost, move |set, answers| {
        let (RayClass::Hard, Asked::Shadow(pairs)) = (set.class, &set.asked) else {
            return false;
        };
        let receivers: Vec<Receiver> = pairs.iter().map(|(receiver, _)| *receiver).collect();
        let (mut scratch, mut shadow) = (ShadowScratch::default(), Vec::new());
        answers.clear();
        for receivers in receivers.chunks(4096) {
            shadowed(receivers, &mut scratch, &mut shadow);
            answers.extend(shadow.iter().map(|&shadow| Answer::shadow(shadow)));
        }
        true
    })
}

fn area_tree<'s>(scene: &'s BenchScene, job: &Job) -> Subject<'s> {
    let (area, level): (_, SimdLevel) = (job.area, job.level);
    let build = || AreaLightTree::build(area, scene.triangles(), &|_| Casts::Both, level);
    let (tree, build) = Stopwatch::time(build);
    let tree = tree.with_topology(&scene.topology);
    let (what, cost) = (
        "hierarchy in the area light's perspective space",
        (build, Some(tree.bytes())),
    );
    soft_shadows(
        "area tree",
        what,
        cost,
        move |receivers, pixels, samples, scratch, bits| {
            tree.visible(receivers, pixels, samples, scratch, bits);
        },
    )
}

fn area_grid<'s>(scene: &'s BenchScene, job: &Job) -> Subject<'s> {
    let (area, cells) = (job.area, FaceOptions::paper());
    let build = || AreaLightGrid::build(area, scene.triangles(), &|_| Casts::Both, &cells);
    let (grid, build) = Stopwatch::time(build);
    let (what, cost) = (
        "3-D perspective grid of the area light, as in HM08",
        (build, Some(grid.bytes())),
    );
    soft_shadows(
        "area grid",
        what,
        cost,
        move |receivers, pixels, samples, scratch, bits| {
            grid.visible(receivers, pixels, samples, scratch, bits);
        },
    )
}

/// What takes receivers of the scene's area light, a sample set for each, and gives a bit for each sample seen.
fn soft_shadows<'s>(
    name: &str,
    what: &'static str,
    cost: (Time, Option<usize>),
    visible: impl Fn(&[Receiver], &[u32], &Samples, &mut AreaScratch, &mut Vec<u32>) + Send + Sync + 's,
) -> Subject<'s> {
    at_once(name, what, cost, move |set, answers| {
        let (RayClass::Soft, Asked::Shadow(pairs)) = (set.class, &set.asked) else {
            return false;
        };
        let of_each = pairs.iter().step_by(SOFT_SAMPLES as usize);
        let receivers: Vec<Receiver> = of_each.map(|(receiver, _)| *receiver).collect();
        let pixels: Vec<u32> = set.pixels.iter().map(|&[x, y]| sample_set(x, y)).collect();
        let (mut scratch, mut bits) = (AreaScratch::default(), Vec::new());
        visible(&receivers, &pixels, &set.job.samples, &mut scratch, &mut bits);
        answers.clear();
        for bits in &bits {
            answers.extend((0..SOFT_SAMPLES).map(|k| Answer::shadow(bits >> k & 1 == 0)));
        }
        true
    })
}

/// Pairs of ray and triangle that brute force takes on; it answers as many rays as that.
const PAIRS: usize = 100_000_000;

fn brute(scene: &BenchScene) -> Subject<'_> {
    let brute = BruteForce::new(scene.triangles());
    let most = (PAIRS / scene.triangles().len().max(1)).max(1);
    at_once(
        BRUTE,
        "every triangle in double precision, the definition; of the first rays only",
        (Time::default(), Some(0)),
        move |set, answers| {
            answers.clear();
            match &set.asked {
                Asked::Closest(rays) => {
                    let closest = |ray| brute.closest(ray).map(|(_, hit)| hit.t);
                    answers.extend(rays.iter().take(most).map(closest).map(Answer::closest));
                }
                Asked::Shadow(pairs) => {
                    let shadow = |(receiver, light): &(Receiver, Light)| brute.shadowed(receiver, light);
                    answers.extend(pairs.iter().take(most).map(shadow).map(Answer::shadow));
                }
                Asked::All(_) => return false,
            }
            true
        },
    )
}

fn peer<'s, T: PacketTracer + Send + 's>(peer: Peer<T>, what: &'static str) -> Subject<'s> {
    let Peer { name, build, tracer } = peer;
    at_once(&name, what, (build, None), move |set, answers| {
        answers.clear();
        let mut scratch = T::Scratch::default();
        let mut packet = Packet::default();
        match &set.asked {
            Asked::Closest(rays) => {
                for rays in rays.chunks(LANES) {
                    let valid = fill(&mut packet, rays.iter().copied());
                    tracer.closest(&valid, &mut packet, &mut scratch);
                    let closest = |lane: usize| {
                        let hit = packet.hits.prim[lane] != NOTHING;
                        Answer::closest(hit.then(|| f64::from(packet.rays.far[lane])))
                    };
                    answers.extend((0..rays.len()).map(closest));
                }
                true
            }
            Asked::Shadow(pairs) => {
                for pairs in pairs.chunks(LANES) {
                    let valid = fill(&mut packet, pairs.iter().map(shadow_ray));
                    tracer.occluded(&valid, &mut packet.rays, &mut scratch);
                    answers.extend((0..pairs.len()).map(|lane| Answer::shadow(packet.rays.far[lane] < 0.0)));
                }
                true
            }
            Asked::All(_) => false,
        }
    })
}

/// With its ends cut off, as in frames.
fn shadow_ray((receiver, light): &(Receiver, Light)) -> Ray {
    let origin = receiver.point.as_vec3();
    match *light {
        Light::Point(end) => Ray {
            t_min: CUT,
            t_max: 1.0 - CUT,
            ..Ray::new(origin, end - origin)
        },
        Light::Directional(dir) => Ray {
            t_min: CUT,
            ..Ray::new(origin, dir)
        },
    }
}

/// Puts up to sixteen rays into a packet.
fn fill(packet: &mut Packet, rays: impl Iterator<Item = Ray>) -> Valid {
    let mut valid = Valid([0; LANES]);
    packet.hits.prim = [NOTHING; LANES];
    packet.hits.geometry = [NOTHING; LANES];
    for (lane, ray) in rays.enumerate() {
        valid.0[lane] = -1;
        for axis in 0..3 {
            packet.rays.origin[axis][lane] = ray.origin[axis];
            packet.rays.dir[axis][lane] = ray.dir[axis];
        }
        packet.rays.near[lane] = ray.t_min;
        packet.rays.far[lane] = ray.t_max;
    }
    valid
}
