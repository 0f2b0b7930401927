//! A determinant of three vectors to almost the last bit, whatever cancels (Shewchuk 1997: expansions).
//!
//! Cost: some thousand operations, for the few hits whose f64 determinants have lost their digits. Limit: no product
//! of three components may underflow, which f32 values and differences of them cannot bring about.

use glam::DVec3;

/// a . (b x c), within 2^-50 of its value; an exact 0 is 0.
pub(crate) fn determinant(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let mut sum = Expansion::default();
    for (i, j, k) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        sum.add_product(a[i], b[j], c[k]);
        sum.add_product(-a[i], b[k], c[j]);
    }
    sum.value()
}

/// An exact sum: parts that do not overlap, by growing magnitude. Six products have four parts each.
#[derive(Default)]
struct Expansion {
    parts: [f64; 24],
    len: usize,
}

impl Expansion {
    fn add_product(&mut self, a: f64, b: f64, c: f64) {
        let (high, low) = two_product(b, c);
        for factor in [low, high] {
            let (high, low) = two_product(a, factor);
            self.add(low);
            self.add(high);
        }
    }

    fn add(&mut self, value: f64) {
        let mut carried = value;
        for part in &mut self.parts[..self.len] {
            (carried, *part) = two_sum(carried, *part);
        }
        self.parts[self.len] = carried;
        self.len += 1;
    }

    fn value(&self) -> f64 {
        self.parts[..self.len].iter().sum()
    }
}

/// The rounded sum and what rounding took away.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// The rounded product and what rounding took away.
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    (product, a.mul_add(b, -product))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_meshes::Numbers;

    #[test]
    fn nothing_is_lost_to_cancellation() {
        let (big, unit) = (DVec3::new(1e15, 1e15, -1e15), 2f64.powi(-30));
        // Rows that are equal but for the last bits: the determinant is what is left of terms of 1e45.
        let a = big + DVec3::new(0.0, 0.125, 0.0);
        let b = big + DVec3::new(0.125, 0.0, 0.0);
        // c . (a x b) = unit (a.y b.z - a.z b.y)
        let c = DVec3::new(unit, 0.0, 0.0);
        let exact = -unit * 0.125e15;
        assert_eq!(determinant(a, b, c), exact);
        assert_eq!(determinant(b, a, c), -exact);
        assert_eq!(determinant(a, b, a - b), 0.0);
        assert_eq!(determinant(DVec3::X, DVec3::Y, DVec3::Z), 1.0);
    }

    /// Vectors that all but lie in a plane, in whole numbers of 40 bits.
    #[test]
    fn what_is_left_is_right_to_the_last_bits() {
        let mut numbers = Numbers(5);
        let mut whole = |bits: u32| i128::from((numbers.bits() as i64) >> (64 - bits));
        for _ in 0..2000 {
            let (a, b, off) = (
                [(); 3].map(|()| whole(40)),
                [(); 3].map(|()| whole(40)),
                [(); 3].map(|()| whole(3)),
            );
            let c = [0, 1, 2].map(|i| a[i] - 3 * b[i] + off[i]);
            let minor = |i: usize, j: usize| b[i] * c[j] - b[j] * c[i];
            let exact = (a[0] * minor(1, 2) + a[1] * minor(2, 0) + a[2] * minor(0, 1)) as f64;
            let [a, b, c] = [a, b, c].map(|v| DVec3::from_array(v.map(|x| x as f64)));
            let found = determinant(a, b, c);
            assert!(
                (found - exact).abs() <= exact.abs() * 2f64.powi(-50),
                "{found}, should be {exact}"
            );
        }
    }

    #[test]
    fn a_ray_almost_in_a_plane_hits_where_the_triangle_is() {
        let mut numbers = Numbers(7);
        let mut next = |range: i64| (numbers.bits() >> 20) as i64 % range - range / 2;
        let (mut hits, mut astray) = (0, 0);
        for _ in 0..4000 {
            let corners: [[i64; 3]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| 3 * next(1 << 15)));
            let e: [[i64; 3]; 2] =
                std::array::from_fn(|i| std::array::from_fn(|k| corners[i + 1][k] - corners[0][k]));
            let n: [i64; 3] = std::array::from_fn(|i| {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                e[0][j] * e[1][k] - e[0][k] * e[1][j]
            });
            // From beside the plane by a step in x, along it but for a step in z.
            let (s, t, step) = (next(4), next(4), 2f64.powi(-30));
            let origin: [i64; 3] = std::array::from_fn(|i| corners[0][i] - s * e[0][i] - t * e[1][i]);
            let target: [i64; 3] = std::array::from_fn(|i| corners[0][i] + (e[0][i] + e[1][i]) / 3);
            let vector = |v: [i64; 3]| DVec3::from_array(v.map(|x| x as f64));
            let from = vector(origin) - DVec3::X * step;
            let dir = vector(target) - vector(origin) + DVec3::Z * step;
            let truth = n[0] as f64 / n[2] as f64;
            let Some(hit) = crate::exact::hit(from, dir, corners.map(|c| vector(c).as_vec3())) else {
                continue;
            };
            hits += 1;
            assert!(
                (hit.t - truth).abs() <= truth.abs() * 1e-6,
                "{} is not {truth}",
                hit.t
            );
            let plain = (vector(corners[0]) - from).dot(vector(n)) / dir.dot(vector(n));
            astray += usize::from((plain - truth).abs() > truth.abs() * 1e-3);
        }
        assert!(hits > 300 && astray > 100, "{hits} {astray}");
    }
}
