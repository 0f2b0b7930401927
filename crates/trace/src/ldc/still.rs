//! [`StillCube`]: what has stood still keeps its cube over a row of frames, what moves gets one of its own in each (VMV07
//! has objects that need no peeling again in cubes of their own).
//!
//! Nobody has to say what stands still: positions are compared, bit by bit, with those of the first frame. A triangle
//! that has moved once counts as moving from then on, so the kept cube is rebuilt only in frames in which something
//! moves for the first time. Both cubes have texels of the same size: those of the moving one cost what its share of the
//! surface is. Where little stands still a second cube would cost each ray more than it saves, and there is one.
//!
//! Layout: 13 bytes a vertex and 12 a triangle beside the cubes.

use std::sync::Arc;

use super::build::usable;
use super::{Cube, Ldc, LdcOptions};
use crate::Triangles;

/// One in so many triangles has to stand still for a cube of its own.
const LEAST_SHARE: usize = 4;

/// Which triangles have stood still since the first of a row of frames.
#[derive(Clone, Debug, Default)]
pub struct Stillness {
    /// Positions in the first frame.
    first: [Vec<f32>; 3],
    indices: Vec<[u32; 3]>,
    /// Of vertices, since then.
    moved: Vec<bool>,
}

impl Stillness {
    /// Looks at the next frame. Returns whether triangles move that have stood still until now; if it is the first frame,
    /// or one of other triangles, all count as such and a new row starts in which all stand still.
    pub fn follow(&mut self, triangles: &Triangles) -> bool {
        let now = [triangles.x, triangles.y, triangles.z];
        let same_row = self.indices == triangles.indices && self.moved.len() == triangles.x.len();
        if !same_row {
            self.first = now.map(<[f32]>::to_vec);
            self.indices = triangles.indices.to_vec();
            self.moved = vec![false; triangles.x.len()];
            return true;
        }
        let [x, y, z] = [0, 1, 2].map(|axis| self.first[axis].iter().zip(now[axis]));
        let mut more = false;
        for (((x, y), z), moved) in x.zip(y).zip(z).zip(&mut self.moved) {
            let moves = [x, y, z].into_iter().any(|(a, b)| a.to_bits() != b.to_bits());
            more |= moves && !*moved;
            *moved |= moves;
        }
        more
    }

    /// Whether a triangle has stood still.
    pub fn is_still(&self, prim: u32) -> bool {
        let corners = self.indices[prim as usize];
        !corners.iter().any(|&i| self.moved[i as usize])
    }

    /// Triangles that stand still and those that move, in their order; all of them move where hardly any stands still.
    pub fn split(&self, prims: Vec<u32>) -> [Vec<u32>; 2] {
        let (still, moving): (Vec<u32>, Vec<u32>) = prims.iter().partition(|&&prim| self.is_still(prim));
        if still.len() * LEAST_SHARE < prims.len() {
            [Vec::new(), prims]
        } else {
            [still, moving]
        }
    }
}

/// Builds the cubes of a row of frames.
#[derive(Clone, Debug, Default)]
pub struct StillCube {
    options: LdcOptions,
    stillness: Stillness,
    kept: Option<Arc<Cube>>,
}

impl StillCube {
    /// With nothing kept yet.
    pub fn new(options: LdcOptions) -> Self {
        Self {
            options,
            ..Self::default()
        }
    }

    /// The cube or cubes of the next frame; answers are those of [`Ldc::build`].
    pub fn build<'a>(&mut self, triangles: Triangles<'a>) -> Ldc<'a> {
        let more = self.stillness.follow(&triangles);
        let (prims, stats) = usable(&triangles);
        let [still, moving] = self.stillness.split(prims);
        let mut rebuilt = moving.len();
        if still.is_empty() {
            self.kept = None;
        } else if more || self.kept.is_none() {
            rebuilt += still.len();
            // Not two of them at a time.
            self.kept = None;
            self.kept = Some(Arc::new(Cube::over(&triangles, still, &self.options)));
        }
        let mut cubes: Vec<Arc<Cube>> = self.kept.iter().cloned().collect();
        if !moving.is_empty() || cubes.is_empty() {
            let options = match &self.kept {
                Some(kept) => LdcOptions {
                    resolution: kept.frame.resolution_of(&triangles, &moving),
                    ..self.options
                },
                None => self.options,
            };
            cubes.push(Arc::new(Cube::over(&triangles, moving, &options)));
        }
        Ldc {
            triangles,
            cubes,
            stats,
            rebuilt,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::ldc::HitTest;
    use crate::test_meshes::{Mesh, Numbers};
    use crate::{Accel, BruteForce, Ray};

    /// A blob that stands still and a smaller one that is somewhere else at each time.
    fn frame(time: f32) -> Mesh {
        let (mut mesh, mover) = (Mesh::blob(24), Mesh::blob(8));
        let first = mesh.x.len() as u32;
        mesh.x.extend(mover.x.iter().map(|x| x * 0.3 + 1.5 - time));
        mesh.y.extend(mover.y.iter().map(|y| y * 0.3));
        mesh.z.extend(mover.z.iter().map(|z| z * 0.3 + time));
        let corners = |corners: &[u32; 3]| corners.map(|i| i + first);
        mesh.indices.extend(mover.indices.iter().map(corners));
        mesh
    }

    /// Triangles with area.
    fn taking_part(mesh: &Mesh) -> usize {
        Ldc::build(mesh.triangles(), &LdcOptions::default())
            .stats()
            .triangles
    }

    #[test]
    fn what_stands_still_keeps_its_cube_and_answers_stay_those_of_brute_force() {
        let options = LdcOptions {
            resolution: 72,
            ..LdcOptions::default()
        };
        let mut still = StillCube::new(options);
        let frames = [0.0, 0.4, 0.8, 0.8, 1.2].map(frame);
        let first_moving = Mesh::blob(24).indices.len() as u32;
        let [all, moving] = [&frames[0], &Mesh::blob(8)].map(taking_part);
        // All of it, then both, then what moves.
        let expected = [all, all, moving, moving, moving];
        let mut kept: Option<Arc<Cube>> = None;
        for (n, mesh) in frames.iter().enumerate() {
            let ldc = still.build(mesh.triangles());
            assert_eq!(ldc.rebuilt(), expected[n], "frame {n}");
            assert_eq!(ldc.cubes.len(), if n == 0 { 1 } else { 2 });
            if n > 1 {
                let before = kept.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, &ldc.cubes[0]));
                assert!(before, "frame {n}");
                let [a, b] = [0, 1].map(|i| ldc.cubes[i].frame.side);
                assert!((a / b - 1.0).abs() < 0.15, "texels of {a} and {b}");
            }
            kept = Some(Arc::clone(&ldc.cubes[0]));
            let (brute, alone) = (
                BruteForce::new(mesh.triangles()),
                Ldc::build(mesh.triangles(), &options),
            );
            let mut numbers = Numbers(n as u64);
            let (mut moving_hit, mut near) = (0, 0);
            for _ in 0..2000 {
                let ray = Ray::new(numbers.point() * 2.0, numbers.point());
                let (found, truth) = (ldc.intersect(&ray), brute.intersect(&ray));
                assert_eq!(found, truth, "frame {n}: {ray:?}");
                assert_eq!(ldc.occluded(&ray), truth.is_some());
                let (mut hits, mut others) = (Vec::new(), Vec::new());
                ldc.all_hits(&ray, &mut hits);
                brute.all_hits(&ray, &mut others);
                assert_eq!(hits, others);
                moving_hit += usize::from(truth.is_some_and(|hit| hit.prim >= first_moving));
                let test = HitTest::Plane { margin: 0.25 };
                let by_samples = [&ldc, &alone].map(|cube| cube.closest_sampled(&ray, test, &mut ()));
                near += usize::from(by_samples[0].map(|hit| hit.prim) == by_samples[1].map(|hit| hit.prim));
            }
            assert!(moving_hit > 2, "frame {n}: {moving_hit}");
            assert!(near > 1500, "frame {n}: {near} alike by samples");
        }
    }

    #[test]
    fn a_row_ends_with_other_triangles_and_where_all_moves_there_is_one_cube() {
        let mut still = StillCube::new(LdcOptions::default());
        let mesh = Mesh::blob(8);
        let all = taking_part(&mesh);
        assert_eq!(still.build(mesh.triangles()).rebuilt(), all);
        assert_eq!(still.build(mesh.triangles()).rebuilt(), 0);
        let mut moved = Mesh::blob(8);
        moved.x.iter_mut().for_each(|x| *x += 1.0);
        let ldc = still.build(moved.triangles());
        assert_eq!((ldc.rebuilt(), ldc.cubes.len()), (all, 1));
        let ray = Ray::new(Vec3::new(1.0, 0.0, 5.0), Vec3::NEG_Z);
        assert_eq!(
            ldc.intersect(&ray),
            BruteForce::new(moved.triangles()).intersect(&ray)
        );
        let other = Mesh::blob(6);
        let ldc = still.build(other.triangles());
        assert_eq!((ldc.rebuilt(), ldc.cubes.len()), (taking_part(&other), 1));
        assert_eq!(still.build(other.triangles()).rebuilt(), 0);
        let nothing = Mesh::default();
        assert_eq!(still.build(nothing.triangles()).intersect(&ray), None);
    }
}
