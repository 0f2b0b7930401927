//! The views of a light: which faces it needs, and the window of each in which there is geometry.
//!
//! HM08 §3 uses six cube-like faces to cover all directions; a light that sees the whole geometry under 120
//! degrees needs one.

use glam::{DVec3, Vec3};

use crate::kernel::pixels::LightFaces;
use crate::light_grid::Cone;
use crate::precise::PreciseTriangle;
use crate::view::View;
use crate::{Light, Triangles};

/// Tangent of the largest half angle that one face serves.
const SINGLE_FACE_TAN: f64 = 1.75;

/// Half the opening of a cube's face as a tangent; the excess over 1 covers rounding at the seams.
const CUBE_FACE_TAN: f64 = 1.001;

/// The axes (right, up, forward) of the six faces of a cube: +X, -X, +Y, -Y, +Z, -Z.
const CUBE_FACES: [[DVec3; 3]; 6] = [
    [DVec3::NEG_Z, DVec3::Y, DVec3::X],
    [DVec3::Z, DVec3::Y, DVec3::NEG_X],
    [DVec3::X, DVec3::NEG_Z, DVec3::Y],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z],
];

/// Coordinates beyond this are not projected: a few products of them leave the range of f32.
const LARGEST: f64 = 1e30;

/// Geometry smaller than this is not projected: in its raster nearness, 1 / depth, leaves the range of f32.
const SMALLEST: f64 = 1e-27;

/// A wider cone than this, in radians, is served like a light without one.
const WIDEST_CONE: f64 = 1.5;

/// The views of a light onto these triangles; none where there is nothing to see, or where the light has no
/// finite position or direction. `None` if the geometry is too large or too small to be projected. `extent` is a box around all
/// triangles, if one is known that is finite.
pub(crate) fn views(
    light: &Light,
    triangles: &Triangles,
    cone: Option<Cone>,
    extent: Option<[Vec3; 2]>,
) -> Option<LightFaces> {
    let Some(bounds) = extent.map_or_else(|| Bounds::of(triangles), |b| Some(Bounds::enlarged(b))) else {
        return Some(LightFaces::default());
    };
    let size = (bounds.max - bounds.min).max_element();
    if bounds.min.abs().max(bounds.max.abs()).max_element() > LARGEST || size < SMALLEST {
        return None;
    }
    let mut cube = None;
    let views = match *light {
        Light::Directional(direction) => {
            let forward = -direction.as_dvec3();
            let valid = forward.is_finite() && forward != DVec3::ZERO;
            if valid {
                vec![parallel(&bounds, forward.normalize())]
            } else {
                Vec::new()
            }
        }
        Light::Point(position) if !position.is_finite() => Vec::new(),
        Light::Point(position) => match cone.filter(|cone| cone.half_angle < WIDEST_CONE) {
            Some(cone) => {
                let tan = (cone.half_angle.tan() * 1.001).clamp(1e-3, 1e3);
                vec![unit_view(position, around(cone.axis), tan)]
            }
            None => match single_face(&bounds, position) {
                Some(view) => vec![view],
                None => {
                    cube = Some([None; 6]);
                    CUBE_FACES
                        .map(|axes| unit_view(position, axes, CUBE_FACE_TAN))
                        .to_vec()
                }
            },
        },
    };
    let mut faces = LightFaces::default();
    for (i, view) in views.iter().enumerate() {
        if let Some(view) = bounds.window(view) {
            if let Some(cube) = &mut cube {
                cube[i] = Some(faces.views.len() as u32);
            }
            faces.views.push(view);
        }
    }
    Some(LightFaces { cube, ..faces })
}

/// The views of a light onto these triangles, each on a raster of one unit that shows all triangles before it: one, or up to
/// six where the light is among them. What one shows may be shown by its neighbours, too. `None` if the geometry is too
/// large or too small to be projected.
pub fn views_of_light(light: &Light, triangles: &Triangles) -> Option<Vec<View>> {
    views(light, triangles, None, None).map(|faces| faces.views)
}

/// A perspective view on a raster of one unit.
fn unit_view(position: Vec3, axes: [DVec3; 3], tan: f64) -> View {
    View::perspective(position, axes, [tan; 2], [1; 2])
}

/// Right, up and forward around a direction.
fn around(forward: DVec3) -> [DVec3; 3] {
    let right = forward.any_orthonormal_vector();
    [right, right.cross(forward), forward]
}

/// One face that sees all of the geometry, if the light is far enough outside.
fn single_face(bounds: &Bounds, position: Vec3) -> Option<View> {
    let from = position.as_dvec3();
    let axes = around((bounds.middle() - from).try_normalize()?);
    let [right, up, forward] = axes;
    let mut tan = 0.0f64;
    for corner in bounds.corners() {
        let a = corner - from;
        let depth = a.dot(forward);
        if depth <= 0.0 {
            return None;
        }
        tan = tan.max(a.dot(right).abs() / depth).max(a.dot(up).abs() / depth);
    }
    (tan <= SINGLE_FACE_TAN).then(|| unit_view(position, axes, tan * 1.001))
}

/// The parallel view of a directional light, from before the geometry.
fn parallel(bounds: &Bounds, forward: DVec3) -> View {
    let radius = (bounds.max - bounds.min).length() * 0.5;
    let center = (bounds.middle() - forward * (radius * 1.5)).as_vec3();
    View::parallel(center, around(forward), [radius * 1.01; 2], radius * 8.0, [1; 2])
}

/// A box around all finite vertices, a little enlarged so that it has volume.
struct Bounds {
    min: DVec3,
    max: DVec3,
}

impl Bounds {
    fn of(triangles: &Triangles) -> Option<Self> {
        let range = |values: &[f32]| {
            let finite = values.iter().filter(|v| v.is_finite());
            finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), &v| {
                (low.min(v), high.max(v))
            })
        };
        let axes = [triangles.x, triangles.y, triangles.z].map(range);
        if triangles.is_empty() || axes.iter().any(|(low, high)| low > high) {
            return None;
        }
        Some(Self::enlarged([
            Vec3::from(axes.map(|a| a.0)),
            Vec3::from(axes.map(|a| a.1)),
        ]))
    }

    fn enlarged(range: [Vec3; 2]) -> Self {
        let [min, max] = range.map(Vec3::as_dvec3);
        let largest = min.abs().max(max.abs()).max_element();
        let slack = DVec3::splat((max - min).length() * 1e-3 + largest * 1e-6 + 1e-30);
        Self {
            min: min - slack,
            max: max + slack,
        }
    }

    fn middle(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    fn corner(&self, i: usize) -> DVec3 {
        let pick = |axis: usize| {
            if i >> axis & 1 == 0 {
                self.min[axis]
            } else {
                self.max[axis]
            }
        };
        DVec3::new(pick(0), pick(1), pick(2))
    }

    fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| self.corner(i))
    }

    /// The view cut to the part of its raster that shows the box.
    fn window(&self, view: &View) -> Option<View> {
        const QUADS: [[usize; 4]; 6] = [
            [0, 1, 3, 2],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 3, 7, 5],
        ];
        let mut window: Option<[[f64; 2]; 2]> = None;
        for [a, b, c, d] in QUADS {
            for triangle in [[a, b, c], [a, c, d]] {
                let corners = triangle.map(|i| self.corner(i).as_vec3());
                let seen = PreciseTriangle::new(view, corners).and_then(|p| p.bounds(view));
                if let Some([min, max]) = seen {
                    let [low, high] = window.unwrap_or([min, max]);
                    window = Some([
                        [low[0].min(min[0]), low[1].min(min[1])],
                        [high[0].max(max[0]), high[1].max(max[1])],
                    ]);
                }
            }
        }
        let [min, max] = window?;
        let slack = [0, 1].map(|i| (max[i] - min[i]) * 1e-3 + 1e-9);
        let min = [0, 1].map(|i| min[i] - slack[i]);
        let max = [0, 1].map(|i| max[i] + slack[i]);
        Some(view.window(min, max, [1; 2]))
    }
}
