//! Progress on standard error: a bar for people, lines of JSON for programs.

use std::env;

use coarsen::simplify::Progress as Step;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use super::args::Progress as Wish;
use super::console::{self, Verbosity};

/// Shows how far a run is.
pub enum Meter {
    Nothing,
    Json,
    Bar(ProgressBar),
}

impl Meter {
    /// What `wish` means here. A bar shows itself on a terminal only.
    pub fn new(wish: Wish, verbosity: Verbosity) -> Self {
        let is_ci = env::var_os("CI").is_some_and(|ci| !ci.is_empty());
        match wish {
            Wish::Never => Self::Nothing,
            Wish::Json => Self::Json,
            Wish::Auto if is_ci || verbosity == Verbosity::Quiet => Self::Nothing,
            Wish::Auto | Wish::Bar => Self::Bar(bar()),
        }
    }

    /// Shows a step.
    pub fn show(&self, step: Step) {
        match self {
            Self::Nothing => {}
            Self::Json => {
                console::say(json!({"faces": step.faces, "faces_in": step.faces_in, "target": step.target}));
            }
            Self::Bar(bar) => {
                bar.set_length(step.faces_in.saturating_sub(step.target) as u64);
                bar.set_position(step.faces_in.saturating_sub(step.faces) as u64);
                bar.set_message(format!("{} faces", step.faces));
            }
        }
    }

    /// Clears what is drawn, so that the next line stands alone.
    pub fn clear(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Plain characters without color, so that `NO_COLOR` has nothing to take away.
fn bar() -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
    match ProgressStyle::with_template("{bar:40} {percent:>3} % {msg}") {
        Ok(style) => bar.with_style(style.progress_chars("━━─")),
        Err(_) => bar,
    }
}
