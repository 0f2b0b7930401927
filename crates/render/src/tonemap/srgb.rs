//! The sRGB transfer function of IEC 61966-2-1, exact and fast for eight bits.
//!
//! Encoding is a table of the 255 values at which the rounded result steps up. The upper bits of the float
//! select a bucket that holds one step at most, so one table entry and one comparison give the same byte as the
//! formula in f64 would: it is exact because the steps are found with the formula itself. 3.8 kB of tables.

use std::sync::LazyLock;

/// Encoded value of a linear one, both in \[0, 1\].
pub(crate) fn encode_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear value of an encoded one, both in \[0, 1\].
pub(crate) fn decode_srgb(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// The byte by the formula: round(255 encode(x)), halves up.
fn encode_by_formula(linear: f32) -> u8 {
    (255.0 * encode_srgb(f64::from(linear)) + 0.5) as u8
}

/// Mantissa bits that take part in the bucket's index: 256 buckets an octave, 67 steps in the last octave.
const MANTISSA_BITS: u32 = 8;
const SHIFT: u32 = f32::MANTISSA_DIGITS - 1 - MANTISSA_BITS;
/// 2^-13: below, every value rounds to 0 (the first step is at 1 / (2 * 255 * 12.92) = 2^-12.7).
const SMALLEST: f32 = 1.0 / 8192.0;
const FIRST_BUCKET: u32 = SMALLEST.to_bits() >> SHIFT;
const BUCKETS: usize = ((1.0f32.to_bits() >> SHIFT) - FIRST_BUCKET + 1) as usize;

struct EncodeTable {
    /// The byte at the start of each bucket.
    floor: [u8; BUCKETS],
    /// The smallest float that encodes to more than the index; infinite at 255.
    step: [f32; 256],
}

static ENCODE: LazyLock<EncodeTable> = LazyLock::new(|| {
    let mut step = [f32::INFINITY; 256];
    for (byte, step) in step[..255].iter_mut().enumerate() {
        let mut x = decode_srgb((byte as f64 + 0.5) / 255.0) as f32;
        while encode_by_formula(x) as usize > byte {
            x = x.next_down();
        }
        while encode_by_formula(x) as usize <= byte {
            x = x.next_up();
        }
        *step = x;
    }
    let mut floor = [0; BUCKETS];
    for (bucket, floor) in (FIRST_BUCKET..).zip(&mut floor) {
        *floor = encode_by_formula(f32::from_bits(bucket << SHIFT));
    }
    EncodeTable { floor, step }
});

static DECODE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| decode_srgb(byte as f64 / 255.0) as f32));

/// Encodes a linear value to eight bits, rounded to nearest exactly as the formula is. Values outside of \[0, 1\]
/// are clamped, what is not a number becomes 0.
#[inline]
pub fn encode_srgb8(linear: f32) -> u8 {
    let table = &*ENCODE;
    // Not `clamp`, which keeps a NaN.
    let x = if linear > SMALLEST {
        linear.min(1.0)
    } else {
        SMALLEST
    };
    let floor = table.floor[((x.to_bits() >> SHIFT) - FIRST_BUCKET) as usize];
    floor + u8::from(x >= table.step[floor as usize])
}

/// The linear value of an sRGB byte.
#[inline]
pub fn decode_srgb8(byte: u8) -> f32 {
    DECODE[byte as usize]
}

/// The table behind [`decode_srgb8`], for loops that decode many.
pub(crate) fn linear_from_srgb8() -> &'static [f32; 256] {
    &DECODE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_equals_the_formula_at_every_step_and_between() {
        // Both are monotonic, so equality on both sides of every step is equality everywhere.
        for byte in 0..255u8 {
            let step = ENCODE.step[byte as usize];
            for x in [step.next_down(), step, step.next_up()] {
                assert_eq!(encode_srgb8(x), encode_by_formula(x), "at {x:e}");
            }
            assert_eq!(
                (encode_srgb8(step.next_down()), encode_srgb8(step)),
                (byte, byte + 1)
            );
        }
        for bits in (0..=1.0f32.to_bits()).step_by(4999) {
            let x = f32::from_bits(bits);
            assert_eq!(encode_srgb8(x), encode_by_formula(x), "at {x:e}");
        }
    }

    #[test]
    fn no_bucket_holds_two_steps() {
        let bucket = |x: f32| x.to_bits() >> SHIFT;
        let steps = &ENCODE.step[..255];
        assert!(steps.windows(2).all(|pair| bucket(pair[0]) < bucket(pair[1])));
    }

    #[test]
    fn values_out_of_range_are_clamped() {
        let cases = [
            (f32::NAN, 0),
            (-1.0, 0),
            (f32::NEG_INFINITY, 0),
            (2.0, 255),
            (f32::INFINITY, 255),
            (1.0, 255),
        ];
        for (x, byte) in cases {
            assert_eq!(encode_srgb8(x), byte, "at {x}");
        }
    }

    #[test]
    fn every_byte_survives_the_round_trip() {
        assert!((0..=255).all(|byte| encode_srgb8(decode_srgb8(byte)) == byte));
        assert_eq!((decode_srgb8(0), decode_srgb8(255)), (0.0, 1.0));
        // 188 is the byte next to a linear half.
        assert!((decode_srgb8(188) - 0.502_886).abs() < 1e-6);
    }
}
