//! Nodes of the hierarchy: four boxes side by side.

/// Children of a node.
pub(super) const WIDTH: usize = 4;

/// Four child boxes and where the children are. 128 bytes: two cache lines.
///
/// A child is another node, or `count` triangles from `first` on. Missing children have an inverted infinite box
/// and no triangles.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Axis, lower and upper face, child.
    pub bounds: [[[f32; WIDTH]; 2]; 3],
    /// Index of a node, or of the first of the child's triangles.
    pub first: [u32; WIDTH],
    /// Triangles of the child; `u32::MAX` for a node.
    pub count: [u32; WIDTH],
}

/// The count that marks a child that is itself a node.
pub(super) const INNER: u32 = u32::MAX;

impl Node {
    /// A node without children.
    pub(super) const EMPTY: Self = Self {
        bounds: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        first: [0; WIDTH],
        count: [0; WIDTH],
    };

    pub(super) fn set_box(&mut self, lane: usize, bounds: &Bounds) {
        for axis in 0..3 {
            self.bounds[axis][0][lane] = bounds.min[axis];
            self.bounds[axis][1][lane] = bounds.max[axis];
        }
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) min: glam::Vec3A,
    pub(super) max: glam::Vec3A,
}

impl Bounds {
    /// The box of three corners.
    pub(super) fn of(corners: &[glam::Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(glam::Vec3A::from);
        Self {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
    }

    /// The box around both.
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }

    /// Half the surface, in f64 since the extents of f32 coordinates may overflow f32.
    pub(super) fn half_area(&self) -> f64 {
        let e = self.max.as_dvec3() - self.min.as_dvec3();
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}
