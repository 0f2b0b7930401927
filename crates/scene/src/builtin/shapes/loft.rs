//! Surfaces drawn through rows of points: lofts, lathes, tubes and ribbons.
//!
//! A loft's rows follow each other along an axis; each row is a loop that runs counter-clockwise as seen from
//! the axis's far end. That makes the faces point outward.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3, vec2, vec3};

use super::Surface;

/// How a loft ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) enum Ends {
    /// A fan of triangles from the first loop to the first point and one from the last loop to the second.
    Fans(Vec3, Vec3),
    /// The last loop is joined to the first: a ring.
    Ring,
}

/// Joins loops of equal length into a closed surface.
pub(in super::super) fn loft(rows: &[Vec<Vec3>], ends: Ends) -> Surface {
    let sides = rows[0].len() as u32;
    let count = rows.len() as u32;
    let mut surface = Surface {
        positions: rows.concat(),
        triangles: Vec::new(),
    };
    let joints = if ends == Ends::Ring { count } else { count - 1 };
    for row in 0..joints {
        let (near, far) = (row * sides, (row + 1) % count * sides);
        for j in 0..sides {
            let k = (j + 1) % sides;
            surface.triangles.push([near + j, near + k, far + k]);
            surface.triangles.push([near + j, far + k, far + j]);
        }
    }
    if let Ends::Fans(first, last) = ends {
        let (low, high, top) = (count * sides, count * sides + 1, (count - 1) * sides);
        surface.positions.extend([first, last]);
        for j in 0..sides {
            let k = (j + 1) % sides;
            surface.triangles.push([low, k, j]);
            surface.triangles.push([high, top + j, top + k]);
        }
    }
    surface
}

/// A loop of `sides` points around `centre` on the ellipse with half axes `u` and `v`; it is seen
/// counter-clockwise from the tip of `u` x `v`.
pub(in super::super) fn disc_loop(centre: Vec3, u: Vec3, v: Vec3, sides: usize) -> Vec<Vec3> {
    (0..sides)
        .map(|j| {
            let (sin, cos) = (j as f32 / sides as f32 * TAU).sin_cos();
            centre + u * cos + v * sin
        })
        .collect()
}

/// Turns a profile of (radius, height) about the Y axis. The profile starts and ends on the axis (radius 0) and
/// keeps the solid on its left: outside upwards, inside downwards.
pub(in super::super) fn lathe(profile: &[Vec2], sides: usize) -> Surface {
    let on_axis = |p: Vec2| vec3(0.0, p.y, 0.0);
    let (first, last) = (profile[0], profile[profile.len() - 1]);
    let rows: Vec<_> = profile[1..profile.len() - 1]
        .iter()
        .map(|&p| disc_loop(on_axis(p), Vec3::X * p.x, Vec3::NEG_Z * p.x, sides))
        .collect();
    loft(&rows, Ends::Fans(on_axis(first), on_axis(last)))
}

/// A tube of round section along `path`; one radius a point. The ends are closed by flat fans.
pub(in super::super) fn tube(path: &[Vec3], radii: &[f32], sides: usize) -> Surface {
    loft(
        &rings(path, radii, sides),
        Ends::Fans(path[0], path[path.len() - 1]),
    )
}

/// The loops of a [`tube`].
pub(in super::super) fn rings(path: &[Vec3], radii: &[f32], sides: usize) -> Vec<Vec<Vec3>> {
    let last = path.len() - 1;
    let mut side = (path[1] - path[0]).normalize().any_orthonormal_vector();
    (0..=last)
        .map(|i| {
            let along = (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
            // Carrying the side vector along keeps the tube from twisting.
            side = side.reject_from_normalized(along).normalize();
            disc_loop(path[i], side * radii[i], along.cross(side) * radii[i], sides)
        })
        .collect()
}

/// A solid between two curves in the XY plane, from `z.x` to `z.y` in depth: an arch, a plank, a gable. The
/// curves run along +X with equally many points, `lower` below `upper`; `rows` and `layers` divide the height
/// and the depth.
pub(in super::super) fn ribbon(
    lower: &[Vec2],
    upper: &[Vec2],
    z: Vec2,
    rows: usize,
    layers: usize,
) -> Surface {
    let section = |low: Vec2, high: Vec2| -> Vec<Vec3> {
        let side = |from: Vec3, to: Vec3, parts: usize| {
            (0..parts).map(move |i| from.lerp(to, i as f32 / parts as f32))
        };
        let (a, b) = (low.extend(z.x), high.extend(z.x));
        let (c, d) = (high.extend(z.y), low.extend(z.y));
        side(a, b, rows)
            .chain(side(b, c, layers))
            .chain(side(c, d, rows))
            .chain(side(d, a, layers))
            .collect()
    };
    let sections: Vec<_> = lower
        .iter()
        .zip(upper)
        .map(|(&low, &high)| section(low, high))
        .collect();
    let middle = |i: usize| ((lower[i] + upper[i]) / 2.0).extend((z.x + z.y) / 2.0);
    loft(&sections, Ends::Fans(middle(0), middle(lower.len() - 1)))
}

/// A board of the given half width and thickness that follows a path, its wide side facing `up`.
pub(in super::super) fn plank(path: &[Vec3], half_width: f32, half_thickness: f32, up: Vec3) -> Surface {
    let last = path.len() - 1;
    let rows: Vec<_> = (0..=last)
        .map(|i| {
            let along = (path[(i + 1).min(last)] - path[i.saturating_sub(1)]).normalize();
            let side = up.cross(along).normalize() * half_width;
            let rise = along.cross(side).normalize() * half_thickness;
            let p = path[i];
            vec![p + side - rise, p + side + rise, p - side + rise, p - side - rise]
        })
        .collect();
    loft(&rows, Ends::Fans(path[0], path[last]))
}

/// Points on an elliptic arc in the XY plane, from angle `from` to `to` in half turns (0 = +X, 0.5 = +Y).
pub(in super::super) fn arc(centre: Vec2, half_axes: Vec2, from: f32, to: f32, segments: usize) -> Vec<Vec2> {
    (0..=segments)
        .map(|i| {
            let angle = (from + (to - from) * i as f32 / segments as f32) * PI;
            centre + vec2(angle.cos(), angle.sin()) * half_axes
        })
        .collect()
}

/// Points on a cubic Bezier curve, both ends included.
pub(in super::super) fn bezier([a, b, c, d]: [Vec2; 4], segments: usize) -> Vec<Vec2> {
    (0..=segments)
        .map(|i| {
            let t = i as f32 / segments as f32;
            let s = 1.0 - t;
            a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
        })
        .collect()
}

/// A smooth curve through all `knots` (Catmull-Rom), `segments` a span.
pub(in super::super) fn smooth_path(knots: &[Vec3], segments: usize) -> Vec<Vec3> {
    let last = knots.len() - 1;
    let mut path: Vec<Vec3> = (0..last)
        .flat_map(|i| {
            let (p, q) = (knots[i], knots[i + 1]);
            let before = if i == 0 { p * 2.0 - q } else { knots[i - 1] };
            let after = if i + 1 == last { q * 2.0 - p } else { knots[i + 2] };
            (0..segments).map(move |s| {
                let t = s as f32 / segments as f32;
                let (t2, t3) = (t * t, t * t * t);
                let (out, into) = ((q - before) / 2.0, (after - p) / 2.0);
                p * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + out * (t3 - 2.0 * t2 + t)
                    + q * (3.0 * t2 - 2.0 * t3)
                    + into * (t3 - t2)
            })
        })
        .collect();
    path.push(knots[last]);
    path
}
