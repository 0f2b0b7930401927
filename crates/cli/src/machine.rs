//! What this machine offers and what the process takes of it.

use rayward::trace::SimdLevel;

use crate::failure::{Code, Failure};

/// Starts the worker threads; without a number, one for each core.
pub(crate) fn start_threads(number: Option<u32>) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(number.unwrap_or(0) as usize)
        .build_global()
        .map_err(|error| Failure::new(Code::Runtime, format_args!("cannot start threads: {error}")))
}

/// The instruction set of this name, or the best.
pub(crate) fn simd_level(name: Option<&str>) -> Result<SimdLevel, Failure> {
    let Some(name) = name else {
        return Ok(SimdLevel::detect());
    };
    let available = SimdLevel::available();
    if let Some(level) = available.iter().find(|level| plain(level.name()) == plain(name)) {
        return Ok(*level);
    }
    let known: Vec<_> = available.iter().map(SimdLevel::name).collect();
    Err(Failure::new(
        Code::Usage,
        format_args!(
            "--simd {name}: not on this machine, which has {}",
            known.join(", ")
        ),
    ))
}

/// So that `avx512` means AVX-512 and `sse4.2` means SSE4.2.
fn plain(name: &str) -> String {
    let name = name.chars().filter(char::is_ascii_alphanumeric);
    name.map(|c| c.to_ascii_lowercase()).collect()
}

/// The most memory this process has held, in bytes, where the system tells.
pub(crate) fn peak_memory() -> Option<u64> {
    kibibytes("/proc/self/status", "VmHWM:")
}

/// Memory of the machine in bytes, where the system tells.
pub(crate) fn total_memory() -> Option<u64> {
    kibibytes("/proc/meminfo", "MemTotal:")
}

/// Memory that could be had now, in bytes, where the system tells: what is free or could be freed, or what is left
/// of a smaller limit for this process's control group.
pub(crate) fn available_memory() -> Option<u64> {
    let machine = kibibytes("/proc/meminfo", "MemAvailable:");
    let bytes = |file| std::fs::read_to_string(file).ok()?.trim().parse::<u64>().ok();
    let limit = bytes("/sys/fs/cgroup/memory.max");
    let used = bytes("/sys/fs/cgroup/memory.current").unwrap_or(0);
    let group = limit.map(|limit| limit.saturating_sub(used));
    machine.into_iter().chain(group).min()
}

fn kibibytes(file: &str, key: &str) -> Option<u64> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let number: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    number.checked_mul(1024)
}
