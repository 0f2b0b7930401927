//! Medians with their range.

use std::time::Duration;

use serde::Serialize;

use crate::Time;

/// Median, smallest and largest of some measurements, in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// The middle one; of an even number the mean of the two in the middle.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
}

/// Processor and wall time of some runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Times {
    /// Processor time, milliseconds.
    pub cpu_ms: Spread,
    /// Wall time, milliseconds.
    pub wall_ms: Spread,
}

impl Spread {
    /// Of these durations; zero of none.
    pub fn of(durations: impl IntoIterator<Item = Duration>) -> Self {
        let mut ms: Vec<f64> = durations.into_iter().map(|d| d.as_secs_f64() * 1e3).collect();
        ms.sort_by(f64::total_cmp);
        let (Some(&min), Some(&max)) = (ms.first(), ms.last()) else {
            return Self::default();
        };
        let median = (ms[(ms.len() - 1) / 2] + ms[ms.len() / 2]) / 2.0;
        Self { median, min, max }
    }
}

impl Times {
    /// Of these runs.
    pub fn of(runs: &[Time]) -> Self {
        Self {
            cpu_ms: Spread::of(runs.iter().map(|t| t.cpu)),
            wall_ms: Spread::of(runs.iter().map(|t| t.wall)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_lie_in_the_middle() {
        let spread = |ms: &[u64]| Spread::of(ms.iter().map(|&ms| Duration::from_millis(ms)));
        let of = |median, min, max| Spread { median, min, max };
        assert_eq!(spread(&[]), Spread::default());
        assert_eq!(spread(&[9, 1, 3]), of(3.0, 1.0, 9.0));
        assert_eq!(spread(&[4, 1, 9, 2]), of(3.0, 1.0, 9.0));
    }
}
