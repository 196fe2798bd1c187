//! Which contender runs: one line on standard error that changes, or a line a job where that is no terminal.

use std::io::{IsTerminal, stderr};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::console::{self, Verbosity};

/// Tells how far a job is.
pub struct Ticker(Option<ProgressBar>);

impl Ticker {
    /// Starts telling about `job`.
    pub fn new(verbosity: Verbosity, job: String) -> Self {
        if verbosity == Verbosity::Quiet {
            return Self(None);
        }
        if !stderr().is_terminal() {
            console::note(verbosity, &job);
            return Self(None);
        }
        let line = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr()).with_prefix(job);
        // Nothing is drawn while a run is on the clock: the line changes when it is told to.
        Self(Some(match ProgressStyle::with_template("{prefix}: {msg}") {
            Ok(style) => line.with_style(style),
            Err(_) => line,
        }))
    }

    /// Shows what is done now.
    pub fn show(&self, step: &str) {
        if let Some(line) = &self.0 {
            line.set_message(step.to_string());
            line.tick();
        }
    }
}

impl Drop for Ticker {
    fn drop(&mut self) {
        if let Some(line) = &self.0 {
            line.finish_and_clear();
        }
    }
}
