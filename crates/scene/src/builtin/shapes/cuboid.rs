//! Boxes: divided into cells, and with rounded edges.

use glam::{Vec3, vec3};

use super::Surface;

/// A box from `low` to `high` whose edges are divided into the given numbers of cells.
pub(in super::super) fn cuboid(low: Vec3, high: Vec3, cells: [usize; 3]) -> Surface {
    let stops: [Vec<f32>; 3] = std::array::from_fn(|axis| {
        let (lo, hi, n) = (low[axis], high[axis], cells[axis]);
        (0..=n)
            .map(|i| {
                if i == n {
                    hi
                } else {
                    lo + (hi - lo) * i as f32 / n as f32
                }
            })
            .collect()
    });
    cuboid_of(&stops)
}

/// A box with edges rounded to `radius`: `steps` cells across each rounding, `cells` along the flat parts.
pub(in super::super) fn rounded_cuboid(
    low: Vec3,
    high: Vec3,
    radius: f32,
    steps: usize,
    cells: [usize; 3],
) -> Surface {
    let (inner_low, inner_high) = (low + radius, high - radius);
    let stops: [Vec<f32>; 3] = std::array::from_fn(|axis| {
        let round = |i: usize| (i as f32 / steps as f32) * radius;
        let flat =
            |i: usize| inner_low[axis] + (inner_high[axis] - inner_low[axis]) * i as f32 / cells[axis] as f32;
        let lower = (0..steps).map(|i| low[axis] + round(i));
        let upper = (1..=steps).map(|i| inner_high[axis] + round(i));
        lower.chain((0..=cells[axis]).map(flat)).chain(upper).collect()
    });
    cuboid_of(&stops).warped(|p| {
        let core = p.clamp(inner_low, inner_high);
        // Tangents of equal angle, so that the rounding's cells are of equal width.
        let bend = ((p - core) / radius * std::f32::consts::FRAC_PI_4).map(f32::tan);
        core + bend.normalize_or_zero() * radius
    })
}

/// A box with cell borders at the given increasing coordinates along X, Y and Z.
fn cuboid_of(stops: &[Vec<f32>; 3]) -> Surface {
    let cells = stops.each_ref().map(|s| s.len() - 1);
    let mut surface = Surface::default();
    let mut known = vec![u32::MAX; stops.iter().map(Vec::len).product()];
    let mut vertex = |at: [usize; 3], positions: &mut Vec<Vec3>| {
        let slot = &mut known[(at[2] * stops[1].len() + at[1]) * stops[0].len() + at[0]];
        if *slot == u32::MAX {
            *slot = positions.len() as u32;
            positions.push(vec3(stops[0][at[0]], stops[1][at[1]], stops[2][at[2]]));
        }
        *slot
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (i, j) in (0..cells[u]).flat_map(|i| (0..cells[v]).map(move |j| (i, j))) {
            for end in [0, cells[axis]] {
                let mut corner = |i: usize, j: usize| {
                    let mut at = [0; 3];
                    (at[axis], at[u], at[v]) = (end, i, j);
                    vertex(at, &mut surface.positions)
                };
                let mut quad = [
                    corner(i, j),
                    corner(i + 1, j),
                    corner(i + 1, j + 1),
                    corner(i, j + 1),
                ];
                if end == 0 {
                    quad.reverse();
                }
                surface.triangles.push([quad[0], quad[1], quad[2]]);
                surface.triangles.push([quad[0], quad[2], quad[3]]);
            }
        }
    }
    surface
}
