//! The cube's coordinates: where the three rasters lie in space.
//!
//! All three directions share one texel size `side`, so that lengths along a ray compare between them. In *texel
//! coordinates* the cube's corner is the origin and a texel has side 1; direction `a` looks along axis `w = a`,
//! its raster's axes are `u = (a + 1) % 3` and `v = (a + 2) % 3`. The scene keeps a margin of one texel to every
//! side, and rasters cover the scene's box only, in whole tiles.
//!
//! Conversions are in f64: a position is known to 2^-50 of its distance from the cube's corner.

use glam::{DVec3, Vec3};

use crate::Triangles;

/// Texels of a tile's side; texels are stored tile by tile.
pub const TILE: u32 = 8;

/// Space to texel coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CubeFrame {
    /// Corner of the cube in space.
    pub corner: DVec3,
    /// Side of a texel in space.
    pub side: f64,
    /// Texels along each axis, whole tiles.
    pub size: [u32; 3],
}

/// A line in texel coordinates. `t` is that of the ray in space.
#[derive(Clone, Copy, Debug)]
pub struct TexelRay {
    /// Where `t` is 0.
    pub origin: DVec3,
    /// Direction; its length is that of the ray in space, in texels.
    pub dir: DVec3,
    /// Where the line enters the cube or starts.
    pub t_min: f64,
    /// Where it leaves the cube or ends.
    pub t_max: f64,
}

/// Origins farther away, in texels, leave a line known to no better than a fraction of a texel.
const FARTHEST: f64 = (1u64 << 36) as f64;

/// What a traversal can do with a ray.
#[derive(Clone, Copy, Debug)]
pub enum Clipped {
    /// It does not meet the cube within its range.
    Misses,
    /// The part within the cube.
    Inside(TexelRay),
    /// It starts too far away for texels to be told apart.
    TooFar,
}

impl CubeFrame {
    /// The frame around all triangles that take part, `resolution` texels along the longest side of their box.
    pub fn around(triangles: &Triangles, prims: &[u32], resolution: u32) -> Self {
        let (low, high) = bounds(triangles, prims);
        if prims.is_empty() {
            return Self {
                corner: DVec3::ZERO,
                side: 1.0,
                size: [TILE; 3],
            };
        }
        let (low, extent) = (low.as_dvec3(), high.as_dvec3() - low.as_dvec3());
        let side = extent.max_element() / f64::from(resolution - 2);
        let size = extent.to_array().map(|length| {
            // A rounded quotient must not cost a tile.
            let texels = (length / side * (1.0 - 1e-12)).ceil() as u32 + 2;
            texels.next_multiple_of(TILE)
        });
        Self {
            corner: low - side,
            side,
            size,
        }
    }

    /// The resolution at which a frame around these triangles has about the texels of this one.
    pub fn resolution_of(&self, triangles: &Triangles, prims: &[u32]) -> u32 {
        let (low, high) = bounds(triangles, prims);
        let extent = (high.as_dvec3() - low.as_dvec3()).max_element();
        // Casts saturate; of nothing it is the least.
        (extent / self.side).ceil().max(0.0) as u32 + 2
    }

    /// A point in texel coordinates.
    pub fn texel(&self, point: DVec3) -> DVec3 {
        (point - self.corner) / self.side
    }

    /// The part of a ray within the cube. The range is widened by 2^-20 of its ends, beyond the error of any `t`.
    pub fn clip(&self, origin: DVec3, dir: DVec3, t_min: f64, t_max: f64) -> Clipped {
        let (origin, dir) = (self.texel(origin), dir / self.side);
        let certain = origin.abs().max_element() < FARTHEST && dir.is_finite() && dir != DVec3::ZERO;
        if !certain {
            return Clipped::TooFar;
        }
        let (mut enter, mut leave) = (-widened(-t_min), widened(t_max));
        for axis in 0..3 {
            let (o, d, end) = (origin[axis], dir[axis], f64::from(self.size[axis]));
            if d == 0.0 {
                if o < 0.0 || o > end {
                    return Clipped::Misses;
                }
                continue;
            }
            let (s, t) = (-o / d, (end - o) / d);
            enter = enter.max(s.min(t));
            leave = leave.min(s.max(t));
        }
        if enter <= leave {
            Clipped::Inside(TexelRay {
                origin,
                dir,
                t_min: enter,
                t_max: leave,
            })
        } else {
            Clipped::Misses
        }
    }
}

fn bounds(triangles: &Triangles, prims: &[u32]) -> (Vec3, Vec3) {
    let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    prims.iter().fold(nothing, |(low, high), &prim| {
        let [a, b, c] = triangles.corners(prim);
        (low.min(a.min(b).min(c)), high.max(a.max(b).max(c)))
    })
}

/// An upper end of a range, moved out beyond the error of a hit's parameter.
pub(crate) fn widened(t: f64) -> f64 {
    t + t.abs() * (1.0 / (1u64 << 20) as f64)
}

/// The raster of one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Raster {
    pub(crate) axis: usize,
    /// Columns and rows of texels.
    pub(crate) size: [u32; 2],
}

impl Raster {
    pub(crate) fn new(frame: &CubeFrame, axis: usize) -> Self {
        Self {
            axis,
            size: [frame.size[(axis + 1) % 3], frame.size[(axis + 2) % 3]],
        }
    }

    /// Texels in memory order: tiles in rows, texels of a tile in rows.
    #[inline(always)]
    pub(crate) fn index(&self, column: u32, row: u32) -> usize {
        let tile = (row / TILE) * (self.size[0] / TILE) + column / TILE;
        (tile * TILE * TILE + (row % TILE) * TILE + column % TILE) as usize
    }

    pub(crate) fn texels(&self) -> usize {
        (self.size[0] * self.size[1]) as usize
    }

    /// A point as (u, v, w).
    #[inline(always)]
    pub(crate) fn turned(&self, p: DVec3) -> DVec3 {
        match self.axis {
            0 => DVec3::new(p.y, p.z, p.x),
            1 => DVec3::new(p.z, p.x, p.y),
            _ => p,
        }
    }
}
