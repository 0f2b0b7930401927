//! A progress bar on standard error, if that is a terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressFinish, ProgressStyle};
use rayward::Progress;

/// Shows how far a picture is.
pub(crate) struct Bar(ProgressBar);

impl Bar {
    /// A bar, hidden if it is not wanted or standard error is no terminal. It has no colours, and goes with this.
    pub(crate) fn new(shown: bool) -> Self {
        let target = if shown {
            ProgressDrawTarget::stderr_with_hz(10)
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(1), target).with_finish(ProgressFinish::AndClear);
        let style = ProgressStyle::with_template("{msg} {bar:40} {percent:>3} % {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self(bar)
    }

    /// As [`Bar::new`], for many frames: shows the time that is left.
    pub(crate) fn of_frames(shown: bool) -> Self {
        let bar = Self::new(shown);
        let style = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}, {eta} left");
        bar.0
            .set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar
    }

    /// Sets the number of frames.
    pub(crate) fn frames(&self, frames: u64) {
        self.0.set_length(frames);
        self.0.reset_eta();
    }

    /// One frame is done.
    pub(crate) fn next_frame(&self) {
        self.0.inc(1);
    }

    /// Names what is being done.
    pub(crate) fn phase(&self, name: &'static str) {
        self.0.set_message(name);
        self.0.tick();
    }

    /// Called from all threads; the bar never goes back.
    pub(crate) fn show(&self, progress: Progress) {
        if self.0.length() != Some(progress.total) {
            self.0.set_length(progress.total);
        }
        if progress.done > self.0.position() {
            self.0.set_position(progress.done);
        }
    }
}
