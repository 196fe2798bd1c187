//! Progress of many files: one bar for people, lines of JSON for programs, and a line for every file that fails.

use std::collections::BTreeSet;
use std::env;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use coarsen::batch::{Ended, Event, Job, Plan};
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::json;

use crate::cli::args::Progress as Wish;
use crate::cli::console::{self, Verbosity};

/// How often a line of JSON tells how far the files at work are.
const BETWEEN: Duration = Duration::from_secs(1);
/// Names of files at work that fit into the line of the bar.
const NAMES: usize = 3;

/// Shows how far a run is.
pub struct Board {
    look: Look,
    verbosity: Verbosity,
    files: usize,
    /// Faces that all files are estimated to have.
    faces: u64,
    start: Instant,
    state: Mutex<State>,
}

enum Look {
    Nothing,
    Json,
    Bar(ProgressBar),
}

/// What is known so far.
struct State {
    ended: usize,
    failed: usize,
    /// Faces of the files that ended, as estimated; and of those that were not skipped.
    faces: u64,
    worked: u64,
    current: BTreeSet<String>,
    told: Instant,
}

impl Board {
    /// What `wish` means here. A bar shows itself on a terminal only.
    pub fn new(plan: &Plan, wish: Wish, verbosity: Verbosity) -> Self {
        let is_ci = env::var_os("CI").is_some_and(|ci| !ci.is_empty());
        let faces = plan.jobs().iter().map(weight).sum();
        let look = match wish {
            Wish::Never => Look::Nothing,
            Wish::Json => Look::Json,
            Wish::Auto if is_ci || verbosity == Verbosity::Quiet => Look::Nothing,
            Wish::Auto | Wish::Bar => Look::Bar(bar(faces)),
        };
        let start = Instant::now();
        let state = State { ended: 0, failed: 0, faces: 0, worked: 0, current: BTreeSet::new(), told: start };
        Self { look, verbosity, files: plan.jobs().len(), faces, start, state: Mutex::new(state) }
    }

    /// Shows an event.
    pub fn show(&self, event: &Event<'_>) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            Event::Started { job } => {
                state.current.insert(job.input.name.clone());
                self.tell(json!({"event": "started", "input": job.input.name, "faces": job.faces}));
            }
            Event::Progress { job, progress } => {
                if state.told.elapsed() < BETWEEN {
                    return;
                }
                state.told = Instant::now();
                let (faces, faces_in) = (progress.faces, progress.faces_in);
                self.tell(json!({"event": "progress", "input": job.input.name, "faces": faces, "faces_in": faces_in}));
            }
            Event::Finished { job, ended } => {
                state.current.remove(&job.input.name);
                state.ended += usize::from(**ended != Ended::Dropped);
                state.faces += weight(job);
                state.worked += if **ended == Ended::Skipped { 0 } else { weight(job) };
                self.finished(job, ended, &mut state);
            }
            _ => {}
        }
        self.draw(&state);
    }

    fn finished(&self, job: &Job, ended: &Ended, state: &mut State) {
        let name = &job.input.name;
        let (status, failure) = match ended {
            Ended::Done(_) => ("done", None),
            Ended::Skipped => ("skipped", None),
            Ended::Failed(failure) => ("failed", Some(failure)),
            _ => ("dropped", None),
        };
        if let Some(failure) = failure {
            state.failed += 1;
            self.above(|| console::warning(self.verbosity, &format!("'{name}': {failure}")));
        }
        self.tell(json!({
            "event": "finished",
            "input": name,
            "status": status,
            "reason": failure.map(|failure| failure.reason),
            "files_ended": state.ended,
            "files_failed": state.failed,
            "files": self.files,
            "faces_ended": state.faces,
            "faces": self.faces,
            "seconds": self.start.elapsed().as_secs_f64(),
            "seconds_left": self.seconds_left(state),
        }));
    }

    /// Seconds that what is left will take at the speed so far; none before the first file that was worked on.
    fn seconds_left(&self, state: &State) -> Option<f64> {
        let left = self.faces.saturating_sub(state.faces) as f64;
        (state.worked > 0).then(|| self.start.elapsed().as_secs_f64() / state.worked as f64 * left)
    }

    fn draw(&self, state: &State) {
        let Look::Bar(bar) = &self.look else { return };
        let speed = state.worked as f64 / self.start.elapsed().as_secs_f64().max(1e-3) / 1e6;
        let mut line = format!("{}/{} files, {speed:.2} M faces/s", state.ended, self.files);
        if let Some(seconds) = self.seconds_left(state) {
            line += &format!(", {} left", HumanDuration(Duration::from_secs_f64(seconds)));
        }
        if state.failed > 0 {
            line += &format!(", {} failed", state.failed);
        }
        let names: Vec<&str> = state.current.iter().take(NAMES).map(String::as_str).collect();
        bar.set_position(state.faces);
        bar.set_message(format!("{line}: {}", names.join(", ")));
    }

    fn tell(&self, event: serde_json::Value) {
        if matches!(self.look, Look::Json) {
            console::say(event);
        }
    }

    /// Says something above the bar.
    fn above(&self, say: impl FnOnce()) {
        match &self.look {
            Look::Bar(bar) => bar.suspend(say),
            // The event tells it.
            Look::Json => {}
            Look::Nothing => say(),
        }
    }

    /// Clears what is drawn, so that the next line stands alone.
    pub fn clear(&self) {
        if let Look::Bar(bar) = &self.look {
            bar.finish_and_clear();
        }
    }
}

/// What a file counts: its faces, and something for opening it at all.
fn weight(job: &Job) -> u64 {
    job.faces + 1000
}

/// Plain characters without color, so that `NO_COLOR` has nothing to take away.
fn bar(faces: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(faces), ProgressDrawTarget::stderr());
    match ProgressStyle::with_template("{bar:24} {percent:>3} % {msg}") {
        Ok(style) => bar.with_style(style.progress_chars("━━─")),
        Err(_) => bar,
    }
}
