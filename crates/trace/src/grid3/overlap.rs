//! The cells that a shape reaches.
//!
//! A flat polygon is cut to each slab of cells along z, the rest to each row along y; what is left spans a run of
//! cells along x. Up to rounding these are exactly the cells whose padded boxes the polygon meets, so a wall across
//! the grid is in the cells along it and not in all of its bounding box. Other shapes (boxes, things that move) are
//! put into all cells that their bounds reach.

use glam::DVec3;

use super::partition::Partition;
use crate::space::Space;

/// The outline of an item, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outline {
    /// A triangle that fills the polygon of its corners.
    Triangle([DVec3; 3]),
    /// Something within the hull of these points, the corners of a box.
    Hull([DVec3; 8]),
}

/// A triangle cut by the near plane and by two pairs of planes has five corners more at most, one cut to a cube six;
/// the rest is for corners that rounding sets apart.
const CORNERS: usize = 12;

#[derive(Clone, Copy)]
struct Polygon {
    points: [DVec3; CORNERS],
    len: usize,
}

impl Polygon {
    fn new(points: &[DVec3]) -> Self {
        let mut polygon = Self {
            points: [DVec3::ZERO; CORNERS],
            len: points.len(),
        };
        polygon.points[..points.len()].copy_from_slice(points);
        polygon
    }

    fn points(&self) -> &[DVec3] {
        &self.points[..self.len]
    }

    fn extent(&self, axis: usize) -> [f64; 2] {
        let coordinates = self.points().iter().map(|p| p[axis]);
        coordinates.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
    }

    /// The part between two planes across an axis.
    fn between(&self, axis: usize, [low, high]: [f64; 2]) -> Self {
        self.cut(axis, 1.0, low).cut(axis, -1.0, -high)
    }

    /// The part where `sign * coordinate >= limit`.
    fn cut(&self, axis: usize, sign: f64, limit: f64) -> Self {
        let mut cut = Self { len: 0, ..*self };
        for (i, &a) in self.points().iter().enumerate() {
            let b = self.points[(i + 1) % self.len];
            let (height_a, height_b) = (sign * a[axis] - limit, sign * b[axis] - limit);
            if height_a >= 0.0 {
                cut.push(a);
            }
            if (height_a >= 0.0) != (height_b >= 0.0) {
                cut.push(a + (b - a) * (height_a / (height_a - height_b)));
            }
        }
        cut
    }

    fn push(&mut self, p: DVec3) {
        if self.len < CORNERS {
            self.points[self.len] = p;
            self.len += 1;
        }
    }
}

/// Calls `emit` with every cell that an item's outline reaches.
pub(crate) fn each_cell(
    space: &impl Space,
    partition: &Partition,
    outline: &Outline,
    emit: &mut dyn FnMut(u32),
) {
    match outline {
        Outline::Triangle(corners) => {
            let polygon = space.polygon(*corners);
            if !polygon.points().is_empty() {
                polygon_cells(partition, &Polygon::new(polygon.points()), emit);
            }
        }
        Outline::Hull(points) => {
            if let Some([low, high]) = space.hull(points)
                && let Some(spans) = spans(partition, low, high)
            {
                box_cells(partition, spans, emit);
            }
        }
    }
}

fn spans(partition: &Partition, low: DVec3, high: DVec3) -> Option<[[u32; 2]; 3]> {
    Some([
        partition.span(0, low.x, high.x)?,
        partition.span(1, low.y, high.y)?,
        partition.span(2, low.z, high.z)?,
    ])
}

fn box_cells(partition: &Partition, [xs, ys, zs]: [[u32; 2]; 3], emit: &mut dyn FnMut(u32)) {
    for y in ys[0]..=ys[1] {
        for x in xs[0]..=xs[1] {
            for z in zs[0]..=zs[1] {
                emit(partition.index([x, y, z]));
            }
        }
    }
}

fn polygon_cells(partition: &Partition, polygon: &Polygon, emit: &mut dyn FnMut(u32)) {
    let [x, y, z] = [0, 1, 2].map(|axis| polygon.extent(axis));
    let (low, high) = (DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]));
    let Some(all) = spans(partition, low, high) else {
        return;
    };
    if all.iter().filter(|[first, last]| first < last).count() <= 1 {
        return box_cells(partition, all, emit);
    }
    let [_, _, [first_z, last_z]] = all;
    for z in first_z..=last_z {
        let slab = polygon.between(2, partition.padded(2, z));
        let [low, high] = slab.extent(1);
        let Some([first_y, last_y]) = partition.span(1, low, high) else {
            continue;
        };
        for y in first_y..=last_y {
            let row = slab.between(1, partition.padded(1, y));
            let [low, high] = row.extent(0);
            if let Some([first_x, last_x]) = partition.span(0, low, high) {
                (first_x..=last_x).for_each(|x| emit(partition.index([x, y, z])));
            }
        }
    }
}

/// Whether an item's outline may reach the cube of half-size `half` around a point.
pub(crate) fn reaches_cube(outline: &Outline, center: DVec3, half: f64) -> bool {
    let outside = |points: &[DVec3]| {
        let low = points.iter().fold(DVec3::INFINITY, |low, &p| low.min(p - center));
        let high = points
            .iter()
            .fold(DVec3::NEG_INFINITY, |high, &p| high.max(p - center));
        low.cmpgt(DVec3::splat(half)).any() || high.cmplt(DVec3::splat(-half)).any()
    };
    match outline {
        Outline::Hull(points) => !outside(points),
        Outline::Triangle(corners) => {
            let whole = Polygon::new(&corners.map(|p| p - center));
            let inside = (0..3).fold(whole, |polygon, axis| polygon.between(axis, [-half, half]));
            !outside(corners) && inside.len > 0
        }
    }
}

impl Outline {
    /// Something within a box.
    pub(crate) fn boxed(low: DVec3, high: DVec3) -> Self {
        Self::Hull(std::array::from_fn(|i| {
            let of = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            DVec3::new(of(0), of(1), of(2))
        }))
    }

    /// The points whose hull holds the item.
    pub(crate) fn points(&self) -> &[DVec3] {
        match self {
            Self::Triangle(corners) => corners,
            Self::Hull(points) => points,
        }
    }
}
