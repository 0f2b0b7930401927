//! What the measurements were made on.

use rayward::trace::SimdLevel;
use serde::Serialize;

/// Machine and versions, for the head of a report.
#[derive(Clone, Debug, Serialize)]
pub struct Machine {
    /// Model of the processor, where the system tells it.
    pub processor: String,
    /// Processors that the system offers.
    pub processors: usize,
    /// Operating system and architecture.
    pub system: String,
    /// Instruction set of Rayward's kernels.
    pub simd: String,
    /// Worker threads of the measurements.
    pub threads: usize,
    /// Whether each of them keeps to a processor of its own.
    pub pinned: bool,
    /// Version of Rayward.
    pub rayward: String,
    /// Load of the system over the last minute before the measurements, where it tells: above 0 something else ran.
    pub load: Option<f64>,
}

impl Machine {
    /// This machine, measured with that many threads.
    pub fn describe(level: SimdLevel, threads: usize, pinned: bool) -> Self {
        Self {
            processor: processor().unwrap_or_else(|| "unknown".into()),
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            simd: level.name().into(),
            threads,
            pinned,
            rayward: env!("CARGO_PKG_VERSION").into(),
            load: load(),
        }
    }
}

fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

fn load() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/loadavg").ok()?;
    text.split_whitespace().next()?.parse().ok()
}
