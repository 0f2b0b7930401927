//! Ctrl-C: the process ends at once, but never in the middle of a file.
//!
//! Files are written beside their place and renamed. An interrupt during that would leave the unfinished one, so it
//! waits until the file is whole; writing is short against rendering.

use std::sync::{Mutex, PoisonError};

use crate::failure::Code;

static WRITING: Mutex<()> = Mutex::new(());

/// From now on Ctrl-C ends the process with its exit code.
pub(crate) fn install() {
    // Without a handler the signal ends the process in the system's way, which is good enough.
    let _ = ctrlc::set_handler(|| {
        let _whole = WRITING.lock();
        std::process::exit(i32::from(Code::Interrupted as u8));
    });
}

/// Does something that Ctrl-C has to wait for.
pub(crate) fn postpone<T>(write: impl FnOnce() -> T) -> T {
    let _writing = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    write()
}
