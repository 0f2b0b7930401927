//! Signals that ask the process to end: it ends at once, and no file is left unfinished.
//!
//! Files are written beside their place and renamed; those that are under way are removed. The exit code is 128 and
//! the signal's number, as shells have it.

/// From now on Ctrl-C, a request to terminate and the end of the terminal clean up first.
///
/// A signal that whoever started this process has it ignore (`nohup`) stays ignored.
#[cfg(unix)]
pub(crate) fn install() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let ignored = ignored_signals();
    let wanted = [SIGINT, SIGTERM, SIGHUP]
        .into_iter()
        .filter(|signal| ignored & (1 << (signal - 1)) == 0);
    // Without a handler a signal ends the process in the system's way, which is good enough.
    let Ok(mut signals) = Signals::new(wanted) else {
        return;
    };
    std::thread::spawn(move || {
        if let Some(signal) = signals.forever().next() {
            let _discarded = rayward::image_io::discard_unfinished();
            std::process::exit(128 + signal);
        }
    });
}

/// Elsewhere the process ends in the system's way.
#[cfg(not(unix))]
pub(crate) fn install() {}

/// The set of ignored signals, the first one as the lowest bit, where the system tells.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}
