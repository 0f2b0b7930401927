//! Triangles in groups that lie together, found once per topology and kept while it moves.
//!
//! A structure that knows where a cluster is need not look at its triangles: it is skipped whole if it lies outside
//! of the raster, or behind what is already seen (HM08 §8 names lazy construction from a hierarchy of the scene;
//! this is its lowest level). Clusters are made by halving at the median of centroids along the longest axis, so
//! each is compact and nearly full. Where parts of one cluster move apart its box grows and less can be skipped;
//! answers do not change.
//!
//! Layout: a cluster's triangles and vertices lie together, corners are bytes: 11 bytes a triangle, 4 bytes a vertex
//! and cluster. Cost: some 100 ns a triangle to find, once.

use glam::Vec3;

use crate::Triangles;
use crate::kernel::LANES;

/// Triangles of a cluster at most. Three corners each are still numbered by a byte.
pub(crate) const CLUSTER: usize = 64;
const _: () = assert!(3 * CLUSTER <= 256);

/// Groups of up to 64 triangles that lie together.
#[derive(Clone, Debug, Default)]
pub struct Clusters {
    /// Triangles in all.
    triangles: usize,
    /// Clusters before those of copies.
    distinct: usize,
    /// Of each cluster the first entry of `prims` and of `vertices`, and where the last ends.
    starts: Vec<[u32; 2]>,
    prims: Vec<u32>,
    vertices: Vec<u32>,
    corners: Vec<[u8; 3]>,
    /// The cluster of each triangle; [`Self::NOWHERE`] for those that are in none.
    holders: Vec<u32>,
}

/// One cluster.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cluster<'a> {
    /// Its triangles.
    pub(crate) prims: &'a [u32],
    /// Its vertices.
    pub(crate) vertices: &'a [u32],
    /// Of each triangle the corners, as positions in `vertices`.
    pub(crate) corners: &'a [[u8; 3]],
}

impl Clusters {
    const NOWHERE: u32 = u32::MAX;

    /// Groups these triangles, wherever they will move.
    pub fn new(triangles: &Triangles) -> Self {
        Self::of(triangles, |_| true)
    }

    /// As [`Clusters::new`], of those triangles alone for which `keep` holds; the others are not seen.
    pub fn of(triangles: &Triangles, keep: impl Fn(u32) -> bool) -> Self {
        let centroids: Vec<Vec3> = (0..triangles.len() as u32)
            .map(|prim| {
                let [a, b, c] = triangles.corners(prim);
                a + b + c
            })
            .collect();
        // Of several triangles with the same corners in the same order the first is always the closest.
        let mut prims: Vec<u32> = (0..triangles.len() as u32).filter(|&prim| keep(prim)).collect();
        prims.sort_unstable_by_key(|&p| (triangles.indices[p as usize], p));
        let mut copies = Vec::new();
        prims.dedup_by(|later, first| {
            let copy = triangles.indices[*later as usize] == triangles.indices[*first as usize];
            if copy {
                copies.push(*later);
            }
            copy
        });
        let mut clusters = Self {
            triangles: triangles.len(),
            starts: vec![[0, 0]],
            corners: Vec::with_capacity(triangles.len()),
            ..Self::default()
        };
        clusters.add(triangles, &centroids, prims);
        clusters.distinct = clusters.len_with_copies();
        clusters.add(triangles, &centroids, copies);
        clusters.holders = vec![Self::NOWHERE; triangles.len()];
        for index in 0..clusters.len_with_copies() {
            let [first, last] = [clusters.starts[index][0], clusters.starts[index + 1][0]];
            for &prim in &clusters.prims[first as usize..last as usize] {
                clusters.holders[prim as usize] = index as u32;
            }
        }
        clusters
    }

    /// Groups these triangles.
    fn add(&mut self, triangles: &Triangles, centroids: &[Vec3], mut prims: Vec<u32>) {
        let mut counts = Vec::new();
        halve(centroids, &mut prims, &mut counts);
        let mut rest = prims.as_mut_slice();
        for count in counts {
            let (group, later) = rest.split_at_mut(count);
            rest = later;
            group.sort_unstable();
            let mut own: Vec<u32> = group
                .iter()
                .flat_map(|&p| triangles.indices[p as usize])
                .collect();
            own.sort_unstable();
            own.dedup();
            let place = |v: u32| own.partition_point(|&o| o < v) as u8;
            self.corners
                .extend(group.iter().map(|&p| triangles.indices[p as usize].map(place)));
            self.vertices.append(&mut own);
            self.starts
                .push([self.corners.len() as u32, self.vertices.len() as u32]);
        }
        self.prims.append(&mut prims);
    }

    /// Number of clusters, without those of copies: triangles with the corners of one before them, in the same order,
    /// which a ray never sees.
    pub fn len(&self) -> usize {
        self.distinct
    }

    /// Number of all clusters; those of copies come last.
    pub(crate) fn len_with_copies(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of triangles they were made of.
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.starts.capacity() * 8
            + (self.prims.capacity() + self.vertices.capacity() + self.holders.capacity()) * 4
            + self.corners.capacity() * 3
    }

    #[inline]
    pub(crate) fn cluster(&self, index: usize) -> Cluster<'_> {
        let ([p0, v0], [p1, v1]) = (self.starts[index], self.starts[index + 1]);
        let (prims, vertices) = (p0 as usize..p1 as usize, v0 as usize..v1 as usize);
        Cluster {
            prims: &self.prims[prims.clone()],
            vertices: &self.vertices[vertices],
            corners: &self.corners[prims],
        }
    }

    /// The cluster of a triangle.
    #[inline]
    pub(crate) fn holder(&self, prim: u32) -> Option<Cluster<'_>> {
        let index = self.holders[prim as usize];
        (index != Self::NOWHERE).then(|| self.cluster(index as usize))
    }

    /// Adds a cluster's vertices, where they are now, to `points`: sixteen x, y and z each, the last filled up with
    /// one of them. Returns their box: smallest and largest of the coordinates that are numbers.
    pub(crate) fn place(
        &self,
        index: usize,
        triangles: &Triangles,
        points: &mut Vec<[f32; LANES]>,
    ) -> [Vec3; 2] {
        let (mut low, mut high) = ([[f32::INFINITY; LANES]; 3], [[f32::NEG_INFINITY; LANES]; 3]);
        for vertices in self.cluster(index).vertices.chunks(LANES) {
            let first = triangles.vertex(vertices[0]);
            let mut place = [[first.x; LANES], [first.y; LANES], [first.z; LANES]];
            for (lane, &v) in vertices.iter().enumerate() {
                let p = triangles.vertex(v);
                (place[0][lane], place[1][lane], place[2][lane]) = (p.x, p.y, p.z);
            }
            for axis in 0..3 {
                for lane in 0..LANES {
                    let x = place[axis][lane];
                    let (l, h) = (&mut low[axis][lane], &mut high[axis][lane]);
                    *l = if x < *l { x } else { *l };
                    *h = if x > *h { x } else { *h };
                }
            }
            points.extend(place);
        }
        let least = |axis: usize| low[axis].into_iter().fold(f32::INFINITY, f32::min);
        let most = |axis: usize| high[axis].into_iter().fold(f32::NEG_INFINITY, f32::max);
        [
            Vec3::new(least(0), least(1), least(2)),
            Vec3::new(most(0), most(1), most(2)),
        ]
    }
}

/// The smaller of each coordinate; what is no number is passed over.
#[inline(always)]
fn below(p: Vec3, least: Vec3) -> Vec3 {
    let min = |a: f32, b: f32| if a < b { a } else { b };
    Vec3::new(min(p.x, least.x), min(p.y, least.y), min(p.z, least.z))
}

/// Orders `prims` so that clusters lie together, and notes their sizes.
fn halve(centroids: &[Vec3], prims: &mut [u32], counts: &mut Vec<usize>) {
    if prims.len() <= CLUSTER {
        if !prims.is_empty() {
            counts.push(prims.len());
        }
        return;
    }
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &p in prims.iter() {
        let c = centroids[p as usize];
        low = below(c, low);
        high = -below(-c, -high);
    }
    let size = high - low;
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    // Full clusters on the left, so that only one of all is not.
    let left = (prims.len() / 2).next_multiple_of(CLUSTER).min(prims.len() - 1);
    prims.select_nth_unstable_by(left, |&a, &b| {
        let key = |p: u32| centroids[p as usize][axis];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    let (before, after) = prims.split_at_mut(left);
    halve(centroids, before, counts);
    halve(centroids, after, counts);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::Mesh;

    #[test]
    fn hold_every_triangle_once_and_its_corners() {
        for (mesh, copies) in [
            (Mesh::blob(24), 0),
            (Mesh::soup(1, 1000, 0.1, 1.0), 0),
            (Mesh::blob(3), 5),
        ] {
            let mut mesh = mesh;
            let first = mesh.indices[0];
            mesh.indices.extend((0..copies).map(|_| first));
            let triangles = mesh.triangles();
            let clusters = Clusters::new(&triangles);
            assert_eq!(clusters.triangle_count(), triangles.len());
            let mut seen = vec![0; triangles.len()];
            for index in 0..clusters.len() {
                let cluster = clusters.cluster(index);
                assert!((1..=CLUSTER).contains(&cluster.prims.len()));
                assert_eq!(cluster.prims.len(), cluster.corners.len());
                for (&prim, corners) in cluster.prims.iter().zip(cluster.corners) {
                    seen[prim as usize] += 1;
                    assert_eq!(clusters.holder(prim).map(|c| c.prims), Some(cluster.prims));
                    let ids = corners.map(|c| cluster.vertices[c as usize]);
                    assert_eq!(ids, triangles.indices[prim as usize]);
                }
            }
            let (kept, left_out) = seen.split_at(seen.len() - copies);
            assert!(kept.iter().all(|&n| n == 1) && left_out.iter().all(|&n| n == 0));
            let of_copies = (clusters.len()..clusters.len_with_copies()).map(|i| clusters.cluster(i));
            let copied: Vec<u32> = of_copies.flat_map(|c| c.prims).copied().collect();
            let last = triangles.len() as u32;
            assert_eq!(copied, (last - copies as u32..last).collect::<Vec<_>>());
        }
    }

    #[test]
    fn are_compact_and_nearly_full() {
        let mesh = Mesh::blob(60);
        let triangles = mesh.triangles();
        let clusters = Clusters::new(&triangles);
        assert!(clusters.len() <= triangles.len().div_ceil(CLUSTER) + 1);
        let boxes = (0..clusters.len()).map(|i| clusters.place(i, &triangles, &mut Vec::new()));
        let largest = boxes.map(|[low, high]| (high - low).max_element());
        assert!(
            largest.fold(0.0, f32::max) < 0.7,
            "clusters of a blob of radius 1"
        );
    }

    #[test]
    fn boxes_pass_over_what_is_no_number() {
        let mut mesh = Mesh::soup(3, 40, 0.3, 1.0);
        mesh.x[7] = f32::NAN;
        mesh.y[30] = f32::NAN;
        let triangles = mesh.triangles();
        let clusters = Clusters::new(&triangles);
        for index in 0..clusters.len() {
            let [low, high] = clusters.place(index, &triangles, &mut Vec::new());
            for &v in clusters.cluster(index).vertices {
                let p = triangles.vertex(v);
                let within =
                    |axis: usize| p[axis].is_nan() || (low[axis] <= p[axis] && p[axis] <= high[axis]);
                assert!((0..3).all(within));
            }
        }
    }
}
