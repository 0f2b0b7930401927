//! Processor time of the threads that work, and wall time.

use std::time::{Duration, Instant};

/// What something took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Time {
    /// Processor time of the threads of the pool that it was measured in, or else of the calling thread; wall time where
    /// the system does not tell it. Threads that a peer's library started and that wait in a loop are not in it.
    pub cpu: Duration,
    /// Wall time.
    pub wall: Duration,
}

/// A running measurement.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    cpu: Duration,
    wall: Instant,
}

impl Stopwatch {
    /// Starts.
    pub fn start() -> Self {
        Self {
            cpu: cpu_time(),
            wall: Instant::now(),
        }
    }

    /// Time since the start.
    pub fn elapsed(&self) -> Time {
        let wall = self.wall.elapsed();
        let cpu = if cfg!(unix) { cpu_time() - self.cpu } else { wall };
        Time { cpu, wall }
    }

    /// What a piece of work gives, and what it takes.
    pub fn time<R>(work: impl FnOnce() -> R) -> (R, Time) {
        let watch = Self::start();
        let result = work();
        (result, watch.elapsed())
    }
}

#[cfg(unix)]
fn cpu_time() -> Duration {
    let of_thread = || {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
    };
    if rayon::current_thread_index().is_some() {
        rayon::broadcast(|_| of_thread()).into_iter().sum()
    } else {
        of_thread()
    }
}

#[cfg(not(unix))]
fn cpu_time() -> Duration {
    Duration::ZERO
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_takes_wall_time_and_work_takes_both() {
        let ((), slept) = Stopwatch::time(|| std::thread::sleep(Duration::from_millis(30)));
        assert!(slept.wall >= Duration::from_millis(30));
        let (sum, worked) = Stopwatch::time(|| (0..20_000_000u64).map(std::hint::black_box).sum::<u64>());
        assert!(sum > 0 && worked.cpu > Duration::ZERO && worked.wall > Duration::ZERO);
    }
}
