//! Polygons to triangles: a fan where the polygon is convex, ear clipping where it is not.
//!
//! Source: the two-ears theorem (Meisters 1975). The polygon is projected along the largest component of its Newell
//! normal, so it may be slightly warped. Cost: linear for convex polygons, else the number of corners times that of
//! reflex corners; a concave polygon of more than [`MAX_CLIPPED`] corners is fanned, as is one with corners that
//! are not finite. No corner is added or left out, so neighbours still meet edge to edge.

use glam::{DVec2, DVec3, Vec3};

/// Largest concave polygon that is clipped: keeps hostile files from costing quadratic time.
const MAX_CLIPPED: usize = 4096;

/// Reusable memory for triangulation.
#[derive(Default)]
pub(super) struct Triangulator {
    points: Vec<DVec2>,
    remaining: Vec<usize>,
}

impl Triangulator {
    /// Calls `emit` with the corner numbers of each triangle of the polygon, in its winding.
    pub(super) fn triangulate(
        &mut self,
        count: usize,
        position: impl Fn(usize) -> Vec3,
        mut emit: impl FnMut([usize; 3]),
    ) {
        if count > 3 && !self.project(count, position) {
            self.clip(&mut emit);
        } else {
            for i in 2..count {
                emit([0, i - 1, i]);
            }
        }
    }

    /// Fills `points`; tells whether a fan will do.
    fn project(&mut self, count: usize, position: impl Fn(usize) -> Vec3) -> bool {
        let corner = |i: usize| position(i % count).as_dvec3();
        let base = corner(0);
        let newell = (1..count)
            .map(|i| (corner(i) - base).cross(corner(i + 1) - base))
            .sum::<DVec3>();
        if !newell.is_finite() || newell == DVec3::ZERO {
            return true;
        }
        let size = newell.abs();
        let flat = |p: DVec3| match size.max_element() {
            m if m == size.x => DVec2::new(p.y, p.z * newell.x.signum()),
            m if m == size.y => DVec2::new(p.z, p.x * newell.y.signum()),
            _ => DVec2::new(p.x, p.y * newell.z.signum()),
        };
        self.points.clear();
        self.points.extend((0..count).map(|i| flat(corner(i) - base)));
        let convex = (0..count).all(|i| self.turn([i, (i + 1) % count, (i + 2) % count]) >= 0.0);
        // All turns may be to the left along a star too; a fan then has a triangle that is turned over.
        let fan = convex && (2..count).all(|i| self.turn([0, i - 1, i]) >= 0.0);
        fan || count > MAX_CLIPPED
    }

    fn clip(&mut self, emit: &mut impl FnMut([usize; 3])) {
        let mut remaining = std::mem::take(&mut self.remaining);
        remaining.clear();
        remaining.extend(0..self.points.len());
        let mut start = 0;
        while remaining.len() > 3 {
            let n = remaining.len();
            let corners = |i: usize| [remaining[(i + n - 1) % n], remaining[i], remaining[(i + 1) % n]];
            let candidates = || (0..n).map(|k| (start + k) % n);
            // A polygon that crosses itself may have no ear; anything is as good then.
            let ear = candidates()
                .find(|&i| self.is_ear(corners(i), &remaining))
                .or_else(|| candidates().find(|&i| self.turn(corners(i)) >= 0.0))
                .unwrap_or(0);
            emit(corners(ear));
            remaining.remove(ear);
            start = ear % remaining.len();
        }
        emit([remaining[0], remaining[1], remaining[2]]);
        self.remaining = remaining;
    }

    /// Whether the corner is convex and no other corner lies in its triangle, its border included.
    fn is_ear(&self, corners: [usize; 3], remaining: &[usize]) -> bool {
        let [a, b, c] = corners;
        let points = corners.map(|i| self.points[i]);
        self.turn(corners) > 0.0
            && !remaining.iter().any(|&i| {
                !points.contains(&self.points[i])
                    && self.turn([a, b, i]) >= 0.0
                    && self.turn([b, c, i]) >= 0.0
                    && self.turn([c, a, i]) >= 0.0
            })
    }

    /// Twice the signed area: positive for a left turn.
    fn turn(&self, [a, b, c]: [usize; 3]) -> f64 {
        (self.points[b] - self.points[a]).perp_dot(self.points[c] - self.points[a])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_and_count(corners: &[Vec3]) -> (f64, usize) {
        let (mut area, mut count) = (0.0, 0);
        Triangulator::default().triangulate(
            corners.len(),
            |i| corners[i],
            |[a, b, c]| {
                let [a, b, c] = [a, b, c].map(|i| corners[i].as_dvec3());
                let normal = (b - a).cross(c - a) / 2.0;
                assert!(normal.z >= 0.0, "a triangle is turned over");
                area += normal.length();
                count += 1;
            },
        );
        (area, count)
    }

    #[test]
    fn concave_polygons_keep_area_and_winding() {
        let arrow = [(0., 0.), (2., 1.), (0., 2.), (1., 1.)].map(|(x, y)| Vec3::new(x, y, 0.0));
        for shift in 0..4 {
            let mut turned = arrow;
            turned.rotate_left(shift);
            assert_eq!(area_and_count(&turned), (1.0, 2));
        }
        let comb = [
            (0., 0.),
            (5., 0.),
            (5., 3.),
            (4., 3.),
            (4., 1.),
            (3., 1.),
            (3., 3.),
            (2., 3.),
            (2., 1.),
        ];
        let comb: Vec<Vec3> = comb
            .into_iter()
            .chain([(1., 1.), (1., 3.), (0., 3.)])
            .map(|(x, y)| Vec3::new(x, y, x))
            .collect();
        let (area, count) = area_and_count(&comb);
        assert!(
            (area - 11.0 * 2f64.sqrt()).abs() < 1e-12 && count == 10,
            "{area} {count}"
        );
    }

    #[test]
    fn any_polygon_gives_two_triangles_less_than_corners() {
        let bow_tie = [(0., 0.), (1., 1.), (1., 0.), (0., 1.), (0.5, 3.0)];
        let line = [(0., 0.), (1., 0.), (2., 0.), (3., 0.), (1.5, 0.)];
        let nan = [(0., 0.), (1., 0.), (f32::NAN, 0.), (3., 0.), (1.5, 0.)];
        for corners in [bow_tie, line, nan] {
            let corners = corners.map(|(x, y)| Vec3::new(x, y, 0.0));
            let mut count = 0;
            Triangulator::default().triangulate(5, |i| corners[i], |_| count += 1);
            assert_eq!(count, 3);
        }
    }
}
