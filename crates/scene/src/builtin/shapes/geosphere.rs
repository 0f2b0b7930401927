//! The geodesic sphere: an icosahedron whose faces are divided into smaller triangles.

use std::collections::HashMap;

use glam::{Vec3, vec3};

use super::Surface;

/// A unit sphere of `20 * frequency^2` triangles of nearly equal size.
pub(in super::super) fn geosphere(frequency: u32) -> Surface {
    let mut surface = Surface::default();
    let mut borders: HashMap<[(u32, u32); 2], u32> = HashMap::new();
    for face in FACES {
        let corners = face.map(corner);
        let mut vertex = |j: u32, k: u32| {
            let shares = [frequency - j - k, j, k];
            let mut place = || {
                let p: Vec3 = corners
                    .iter()
                    .zip(shares)
                    .map(|(&c, share)| c * share as f32)
                    .sum();
                surface.positions.push(p.normalize());
                surface.positions.len() as u32 - 1
            };
            let Some(inner) = shares.iter().position(|&share| share == 0) else {
                return place();
            };
            // Two faces name a point of their common border alike: by its corners with a share, in order.
            let mut name = [1, 2]
                .map(|step| (inner + step) % 3)
                .map(|c| (face[c], shares[c]));
            name.sort_unstable();
            if let Some(whole) = name.iter().find(|n| n.1 == frequency) {
                name = [*whole; 2];
            }
            *borders.entry(name).or_insert_with(place)
        };
        let mut row: Vec<u32> = (0..=frequency).map(|k| vertex(0, k)).collect();
        for j in 1..=frequency {
            let next: Vec<u32> = (0..=frequency - j).map(|k| vertex(j, k)).collect();
            for k in 0..next.len() {
                surface.triangles.push([row[k], next[k], row[k + 1]]);
                if k + 1 < next.len() {
                    surface.triangles.push([next[k], next[k + 1], row[k + 1]]);
                }
            }
            row = next;
        }
    }
    surface
}

/// Corner of the icosahedron: 0 is the top, 1 to 5 the upper ring, 6 to 10 the lower ring, 11 the bottom.
fn corner(index: u32) -> Vec3 {
    let ring = |turn: f32, side: f32| {
        let (sin, cos) = (turn * std::f32::consts::TAU / 5.0).sin_cos();
        vec3(2.0 * cos, side, -2.0 * sin) / 5f32.sqrt()
    };
    match index {
        0 => Vec3::Y,
        11 => Vec3::NEG_Y,
        i if i < 6 => ring(i as f32, 1.0),
        i => ring(i as f32 + 0.5, -1.0),
    }
}

const FACES: [[u32; 3]; 20] = [
    [0, 1, 2],
    [0, 2, 3],
    [0, 3, 4],
    [0, 4, 5],
    [0, 5, 1],
    [1, 6, 2],
    [2, 7, 3],
    [3, 8, 4],
    [4, 9, 5],
    [5, 10, 1],
    [6, 7, 2],
    [7, 8, 3],
    [8, 9, 4],
    [9, 10, 5],
    [10, 6, 1],
    [11, 7, 6],
    [11, 8, 7],
    [11, 9, 8],
    [11, 10, 9],
    [11, 6, 10],
];
