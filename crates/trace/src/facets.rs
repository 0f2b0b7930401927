//! n . l to 8 bits: the plainest picture of a frame, for comparing casters with each other and for previews.
//!
//! A triangle shows the side that the eye sees. A pixel without a triangle is 0; a surface is 32 where no light
//! reaches it, 255 where light falls on it upright.
//!
//! Layout: 4 bytes a triangle, filled when a pixel first sees the triangle, or one of its cluster; so the cost is that of
//! what is seen. A cluster's vertices are read one after the other, for which the memory needs not be waited for
//! triangle by triangle.
//! Values of pixels may differ by 1 between instruction sets: nothing is decided by them.

use std::sync::atomic::{AtomicU32, Ordering};

use crate::clusters::{CLUSTER, Cluster, Clusters};
use crate::kernel::facing::{CORNERS, Facing, TRIANGLES, facing};
use crate::kernel::lambert::{DARK, LambertFrame, LambertTile, lambert};
use crate::view::{Arrangement, View};
use crate::{Light, SimdLevel, Triangles};

/// Pixels of a block: 4 x 4, pixel (x, y) in lane `y * 4 + x`.
pub const BLOCK_LANES: usize = 16;

/// Triangles as one light falls on them and one eye sees them.
#[derive(Debug)]
pub struct Facets<'a> {
    triangles: Triangles<'a>,
    clusters: Option<&'a Clusters>,
    facing: Facing,
    level: SimdLevel,
    frame: LambertFrame,
    /// Per triangle the bits of the light's distance from its plane, or of the cosine for a directional light:
    /// positive on the side that the eye sees. All ones until it is asked for. The last is that of nothing.
    facets: Vec<AtomicU32>,
}

/// Closest triangles of a tile, in blocks of 4 x 4 pixels.
pub trait HitBlocks {
    /// Whether [`Self::block`] has depth, not nearness.
    const DEPTH: bool;

    /// Triangle ids, `u32::MAX` where nothing is seen, and nearness or depth of the pixels of a block.
    fn block(&self, column: u32, row: u32) -> (&[u32; BLOCK_LANES], &[f32; BLOCK_LANES]);
}

/// Bits of a facet that nobody has asked for: a NaN that no arithmetic gives.
const UNASKED: u32 = u32::MAX;

impl<'a> Facets<'a> {
    /// The facets of one frame. Nothing is computed yet.
    pub fn new(view: View, light: Light, triangles: Triangles<'a>, level: SimdLevel) -> Self {
        let center = view.center.as_dvec3();
        let corner = view.ray(0.0, 0.0);
        let (right, down) = (view.ray(1.0, 0.0), view.ray(0.0, 1.0));
        let rows = |at: glam::DVec3, x: glam::DVec3, y: glam::DVec3| {
            [at, x - at, y - at].map(|v| v.as_vec3().to_array())
        };
        let parallel = matches!(view.arrangement, Arrangement::Parallel { .. });
        let frame = LambertFrame {
            dir: rows(corner.dir, right.dir, down.dir),
            origin: rows(
                corner.origin - center,
                right.origin - center,
                down.origin - center,
            ),
            light: match light {
                Light::Point(p) => Some((p - view.center).to_array()),
                Light::Directional(_) => None,
            },
            reach: match view.arrangement {
                Arrangement::Parallel { reach } => reach as f32,
                Arrangement::Perspective => 0.0,
            },
            parallel,
        };
        let mut facets = vec![UNASKED; triangles.len() + 1];
        facets[triangles.len()] = 0;
        let facets = facets.into_iter().map(AtomicU32::new).collect();
        Self {
            triangles,
            clusters: None,
            facing: Facing::new(&view, &light),
            level,
            frame,
            facets,
        }
    }

    /// The same, found for the triangles of a cluster together. The clusters may have been made when the vertices lay
    /// elsewhere.
    ///
    /// # Panics
    /// If the clusters are of another number of triangles.
    pub fn with_clusters(self, clusters: &'a Clusters) -> Self {
        assert_eq!(
            clusters.triangle_count(),
            self.triangles.len(),
            "of these triangles"
        );
        let clusters = Some(clusters);
        Self { clusters, ..self }
    }

    /// Distance of the light from a triangle's plane, positive if it is on the side that the eye sees; for a
    /// directional light the cosine. 0 for triangles without area.
    #[inline]
    pub fn facet(&self, prim: u32) -> f32 {
        let stored = &self.facets[prim as usize];
        let bits = stored.load(Ordering::Relaxed);
        if bits != UNASKED {
            return f32::from_bits(bits);
        }
        self.compute(prim);
        f32::from_bits(stored.load(Ordering::Relaxed))
    }

    /// Finds the facet of a triangle, and of the others of its cluster.
    #[cold]
    fn compute(&self, prim: u32) {
        match self.clusters.and_then(|clusters| clusters.holder(prim)) {
            Some(Cluster {
                prims,
                vertices,
                corners,
            }) => {
                let mut places = [[0.0; 4]; CORNERS * CLUSTER];
                for (place, &vertex) in places.iter_mut().zip(vertices) {
                    *place = self.place(vertex);
                }
                for (prims, corners) in prims.chunks(TRIANGLES).zip(corners.chunks(TRIANGLES)) {
                    self.fill(prims, &|lane, corner| places[usize::from(corners[lane][corner])]);
                }
            }
            None => {
                let vertices = self.triangles.indices[prim as usize];
                self.fill(&[prim], &|_, corner| self.place(vertices[corner]));
            }
        }
    }

    #[inline(always)]
    fn place(&self, vertex: u32) -> [f32; 4] {
        self.triangles.vertex(vertex).extend(0.0).to_array()
    }

    /// Finds the facets of up to sixteen triangles, of which `place` gives the corners.
    #[inline(always)]
    fn fill(&self, prims: &[u32], place: &impl Fn(usize, usize) -> [f32; 4]) {
        let mut corners = [[[0.0; 4]; TRIANGLES]; CORNERS];
        for lane in 0..prims.len().min(TRIANGLES) {
            for (number, corner) in corners.iter_mut().enumerate() {
                corner[lane] = place(lane, number);
            }
        }
        let facets = facing(self.level, &self.facing, &corners);
        for (&prim, facet) in prims.iter().zip(facets) {
            self.facets[prim as usize].store(facet.to_bits(), Ordering::Relaxed);
        }
    }

    /// Shades the pixels of a tile whose first pixel is `corner`. `out` has one entry a block, in rows of `stride`.
    pub fn shade<H: HitBlocks>(
        &self,
        hits: &H,
        corner: [u32; 2],
        stride: u32,
        out: &mut [[u8; BLOCK_LANES]],
    ) {
        let depth = H::DEPTH;
        let tile = LambertTile {
            stride,
            corner,
            depth,
        };
        let block = |column, row| hits.block(column, row);
        let nothing = self.facets.len() - 1;
        let known = |prim: u32| {
            let bits = self.facets[(prim as usize).min(nothing)].load(Ordering::Relaxed);
            (bits != UNASKED).then_some(f32::from_bits(bits))
        };
        let all = |prims: &[u32; BLOCK_LANES]| self.of_block(prims);
        lambert(self.level, &self.frame, &tile, block, (known, all), out);
    }

    /// The facets of a block's triangles, 0 where there is none.
    #[cold]
    fn of_block(&self, prims: &[u32; BLOCK_LANES]) -> [f32; BLOCK_LANES] {
        let exists = |prim: u32| (prim as usize) < self.triangles.len();
        prims.map(|prim| if exists(prim) { self.facet(prim) } else { 0.0 })
    }
}

/// Takes from a shaded block what does not reach it of the light: `lit` of `samples` samples do.
#[inline]
pub fn darken(block: &mut [u8; BLOCK_LANES], lit: &[u8; BLOCK_LANES], samples: u8) {
    // Of numbers below 2^16 and divisors below 2^8 the product's upper word is the quotient.
    let reciprocal = (1 << 32) / u64::from(samples.max(1)) + 1;
    for lane in 0..BLOCK_LANES {
        let value = block[lane];
        let light = u64::from(value.saturating_sub(DARK as u8)) * u64::from(lit[lane]);
        block[lane] = value.min(DARK as u8) + ((light * reciprocal) >> 32) as u8;
    }
}

/// Takes all light from those pixels of a shaded block whose bit is not set.
#[inline]
pub fn darken_unlit(block: &mut [u8; BLOCK_LANES], lit: u16) {
    if lit == u16::MAX {
        return;
    }
    for (lane, value) in block.iter_mut().enumerate() {
        if lit & 1 << lane == 0 {
            *value = (*value).min(DARK as u8);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::test_meshes::Mesh;
    use crate::{EyeGrid, EyeGridOptions, TileHits, exact};

    /// The picture by definition, in f64.
    fn expected(view: &View, light: Light, triangles: &Triangles, x: u32, y: u32, prim: Option<u32>) -> f64 {
        let Some(prim) = prim else { return 0.0 };
        let ray = view.pixel_ray(x, y);
        let hit = exact::attributes(ray.origin, ray.dir, triangles.corners(prim)).expect("it is seen");
        let point = ray.origin + ray.dir * hit.t;
        let normal = triangles.normal(prim).normalize();
        let normal = normal * -normal.dot(ray.dir).signum();
        32.0 + 223.0 * normal.dot(light.towards(point).normalize()).max(0.0)
    }

    fn check(view: View, light: Light, level: SimdLevel) {
        let mesh = Mesh::blob(12);
        let triangles = mesh.triangles();
        let grid = EyeGrid::build(view, triangles, EyeGridOptions::default(), level);
        let clusters = Clusters::of(&triangles, |prim| prim % 5 != 0);
        let facets = Facets::new(view, light, triangles, level).with_clusters(&clusters);
        let alone = Facets::new(view, light, triangles, level);
        for prim in 0..triangles.len() as u32 {
            assert_eq!(facets.facet(prim).to_bits(), alone.facet(prim).to_bits());
        }
        let mut hits = TileHits::default();
        let mut bright = 0;
        for index in 0..grid.tile_count() {
            let tile = grid.tile(index);
            grid.trace_tile(&tile, &mut hits);
            let columns = tile.width.div_ceil(4);
            let mut out = vec![[0; BLOCK_LANES]; (columns * tile.height.div_ceil(4)) as usize];
            facets.shade(&hits, [tile.x, tile.y], columns, &mut out);
            let mut again = out.clone();
            facets.shade(
                &ByDepth::of(&hits, &view, columns, out.len()),
                [tile.x, tile.y],
                columns,
                &mut again,
            );
            let mut halved = out.clone();
            halved
                .iter_mut()
                .for_each(|block| darken(block, &[4; BLOCK_LANES], 8));
            for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                let block = (y / 4 * columns + x / 4) as usize;
                let lane = (y % 4 * 4 + x % 4) as usize;
                let wanted = expected(&view, light, &triangles, tile.x + x, tile.y + y, hits.prim(x, y));
                let half = if wanted > 0.0 { 16.0 + 0.5 * wanted } else { 0.0 };
                for (value, wanted) in [
                    (out[block][lane], wanted),
                    (again[block][lane], wanted),
                    (halved[block][lane], half),
                ] {
                    assert!(
                        (f64::from(value) - wanted).abs() < 1.6,
                        "{x} {y}: {value} for {wanted}"
                    );
                }
                bright += u32::from(wanted > 128.0);
            }
        }
        assert!(bright > 100, "{bright} pixels are bright");
    }

    /// The hits of a tile with their depth.
    struct ByDepth {
        columns: u32,
        prim: Vec<[u32; BLOCK_LANES]>,
        depth: Vec<[f32; BLOCK_LANES]>,
    }

    impl ByDepth {
        fn of(hits: &TileHits, view: &View, columns: u32, count: usize) -> Self {
            let depth = |nearness: f32| match view.arrangement {
                Arrangement::Perspective => 1.0 / nearness,
                Arrangement::Parallel { reach } => reach as f32 - nearness,
            };
            let blocks = (0..count as u32).map(|i| hits.block(i % columns, i / columns));
            let (prim, depth) = blocks.map(|b| (b.prim, b.nearness.map(depth))).unzip();
            Self { columns, prim, depth }
        }
    }

    impl HitBlocks for ByDepth {
        const DEPTH: bool = true;

        fn block(&self, column: u32, row: u32) -> (&[u32; BLOCK_LANES], &[f32; BLOCK_LANES]) {
            let i = (row * self.columns + column) as usize;
            (&self.prim[i], &self.depth[i])
        }
    }

    #[test]
    fn every_level_shades_as_defined() {
        let axes = [DVec3::X, DVec3::Y, DVec3::NEG_Z];
        let eye = Vec3::new(0.2, -0.1, 4.0);
        let perspective = View::perspective(eye, axes, [0.4, 0.3], [93, 70]);
        let parallel = View::parallel(eye, axes, [1.6, 1.2], 20.0, [93, 70]);
        for level in SimdLevel::available() {
            for view in [perspective, parallel] {
                check(view, Light::Point(Vec3::new(2.0, 3.0, 2.5)), level);
                check(view, Light::Directional(Vec3::new(0.5, 1.0, 1.5)), level);
            }
        }
    }

    #[test]
    fn shares_of_light_are_rounded_down() {
        for samples in 1..=255u8 {
            for lit in 0..=samples {
                let first = (lit as usize * 7) % 200;
                let values: [u8; BLOCK_LANES] = std::array::from_fn(|lane| 32 + (first + lane) as u8);
                let mut block = values;
                darken(&mut block, &[lit; BLOCK_LANES], samples);
                let share = |value: u8| 32 + u32::from(value - 32) * u32::from(lit) / u32::from(samples);
                assert_eq!(block.map(u32::from), values.map(share), "{lit} of {samples}");
            }
        }
    }

    #[test]
    fn light_is_taken_where_it_does_not_reach() {
        let mut block: [u8; BLOCK_LANES] = std::array::from_fn(|i| (i * 17) as u8);
        let bright = block;
        darken_unlit(&mut block, u16::MAX);
        assert_eq!(block, bright);
        darken_unlit(&mut block, 1 << 15 | 1);
        assert_eq!(block[..4], [0, 17, 32, 32]);
        assert_eq!(block[15], 255);
        let mut quarter = bright;
        darken(&mut quarter, &[2; BLOCK_LANES], 8);
        assert_eq!(quarter[..3], [0, 17, 32]);
        assert_eq!(quarter[15], 32 + 223 / 4);
    }
}
