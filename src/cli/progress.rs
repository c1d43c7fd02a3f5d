//! The progress bar on a terminal.

use std::cell::Cell;

use indicatif::{ProgressBar, ProgressStyle};
use photolith::render::Progress;

/// A bar with rate and time left; invisible where stderr is no terminal.
pub struct Bar {
    bar: ProgressBar,
    /// Whether it has been moved.
    moved: Cell<bool>,
}

impl Bar {
    /// A bar over a number of samples that the first report of progress tells.
    pub fn new() -> Self {
        let bar = ProgressBar::new(0);
        let template = "{percent:>3}% [{bar:40}] {human_pos} of {human_len} samples, {per_sec}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        Self { bar, moved: Cell::new(false) }
    }

    /// Moves the bar.
    pub fn set(&self, progress: &Progress) {
        // Adaptive sampling learns as it goes on how many it will take; so does the sample map of one sample.
        self.bar.set_length(progress.total);
        self.bar.set_position(progress.done);
        if !self.moved.replace(true) {
            // What was done before says nothing of the rate.
            self.bar.reset_eta();
        }
    }

    /// Removes it.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
