//! Points of the unit square for the samples of an area light: Owen-scrambled Sobol points, one set a pixel.
//!
//! The first two dimensions of Sobol's sequence make a (0, 2)-sequence: of the first 2^m points exactly one lies in
//! each box of sides 2^-i and 2^-(m-i). Owen's nested scrambling keeps that and makes the points random; it is done
//! by hashing (Burley 2020), with the constants of Vegdahl. Every pixel scrambles with seeds of its own, so that
//! neighbours err independently. Integers only until the end: the same bits everywhere.
//!
//! Cost: some 60 operations a point; [`crate::kernel::light_points`] does the same for sixteen pixels at once.

/// Samples at most.
pub const MAX_SAMPLES: u32 = 256;

/// How many points of a light each receiver asks about, and which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    count: u32,
    seed: u32,
}

impl Samples {
    /// Sets of `count` points, from 1 to [`MAX_SAMPLES`] (others are taken to the nearest of these). Different
    /// seeds give independent sets.
    pub fn new(count: u32, seed: u32) -> Self {
        Self {
            count: count.clamp(1, MAX_SAMPLES),
            seed: hash(seed),
        }
    }

    /// Points of a set.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// `u32` words that hold one bit a sample.
    pub fn words(&self) -> usize {
        self.count.div_ceil(32) as usize
    }

    /// The set's hashed seed.
    pub(crate) fn seed(&self) -> u32 {
        self.seed
    }

    /// Point `k` of a pixel's set, each coordinate in \[0, 1) and a multiple of 2^-24.
    pub fn point(&self, pixel: u32, k: u32) -> [f32; 2] {
        let [x, y] = seeds(self.seed, pixel);
        [unit(scrambled(k, x)), unit(scrambled(second(k), y))]
    }
}

/// Point `index` of the sequence that three numbers name, each coordinate in \[0, 1) and a multiple of 2^-24. Sequences are
/// shuffled as well as scrambled, so that points with equal index in two of them know nothing of each other: any pair of
/// dimensions may have one of its own. Each 2^m points from a multiple of 2^m on are spread as those of [`Samples`].
pub fn sequence_point(of: [u32; 3], index: u32) -> [f32; 2] {
    let [a, b, c] = of;
    let seed = hash(hash(a ^ hash(b)) ^ c.wrapping_mul(DIMENSION));
    let shuffled = scrambled(index.reverse_bits(), seed);
    [
        unit(scrambled(shuffled, hash(seed ^ 1))),
        unit(scrambled(second(shuffled), hash(seed ^ 2))),
    ]
}

/// Multipliers of [`hash`].
pub(crate) const HASH: [u32; 2] = [0x7feb_352d, 0x846c_a68b];

/// Multipliers of the scrambling hash. They are even, so that a bit depends on the bits below it alone.
pub(crate) const SCRAMBLE: [u32; 3] = [0x3d20_adea, 0x0552_6c56, 0x53a2_2864];

/// Added to tell the seeds of the two dimensions apart.
pub(crate) const DIMENSION: u32 = 0x9e37_79b9;

/// A mix of 32 bits in which every bit depends on all.
pub(crate) fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(HASH[0]);
    x ^= x >> 15;
    x = x.wrapping_mul(HASH[1]);
    x ^ (x >> 16)
}

/// The seeds of a pixel's two scramblings.
fn seeds(seed: u32, pixel: u32) -> [u32; 2] {
    let base = hash(pixel ^ seed);
    [base, hash(base.wrapping_add(DIMENSION))]
}

/// Owen's scrambling of a number whose bits are given in reversed order; the result's are not.
fn scrambled(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(SCRAMBLE[0]);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(SCRAMBLE[1]);
    x ^= x.wrapping_mul(SCRAMBLE[2]);
    x.reverse_bits()
}

/// Sobol's second dimension with its bits in reversed order. The first one's are those of `k` itself.
pub(crate) fn second(k: u32) -> u32 {
    let (mut sum, mut direction, mut left) = (0, 1u32, k);
    while left != 0 {
        if left & 1 != 0 {
            sum ^= direction;
        }
        direction ^= direction << 1;
        left >>= 1;
    }
    sum
}

/// The 24 leading bits as a number in [0, 1).
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_box_of_a_power_of_two_holds_one_point() {
        for (seed, pixel) in [(0, 0), (1, 77), (9, 123_456), (u32::MAX, u32::MAX)] {
            for m in 0..=8 {
                let samples = Samples::new(1 << m, seed);
                for i in 0..=m {
                    let mut boxes = vec![0; 1 << m];
                    for k in 0..1 << m {
                        let [x, y] = samples.point(pixel, k);
                        let column = (x * (1 << i) as f32) as usize;
                        let row = (y * (1 << (m - i)) as f32) as usize;
                        boxes[(row << i) + column] += 1;
                    }
                    assert!(
                        boxes.iter().all(|&n| n == 1),
                        "2^{m} points, 2^{i} columns: {boxes:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn pixels_and_seeds_have_sets_of_their_own_with_the_right_mean() {
        let (mut sum, mut square, mut product) = ([0.0; 2], 0.0, 0.0);
        let pixels = 20_000;
        for pixel in 0..pixels {
            let [x, y] = Samples::new(4, 3).point(pixel, 2).map(f64::from);
            sum = [sum[0] + x, sum[1] + y];
            square += x * x;
            product += (x - 0.5) * (y - 0.5);
        }
        let n = f64::from(pixels);
        assert!((sum[0] / n - 0.5).abs() < 0.01 && (sum[1] / n - 0.5).abs() < 0.01);
        assert!((square / n - 1.0 / 3.0).abs() < 0.01 && (product / n).abs() < 0.003);
        assert_ne!(Samples::new(4, 3).point(0, 0), Samples::new(4, 4).point(0, 0));
    }

    #[test]
    fn counts_are_kept_in_range() {
        let counts = [0, 1, 33, 256, 1000]
            .map(|n| Samples::new(n, 0))
            .map(|s| (s.count(), s.words()));
        assert_eq!(counts, [(1, 1), (1, 1), (33, 2), (256, 8), (256, 8)]);
    }
}
