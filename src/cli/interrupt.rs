//! Ctrl-C: at once where nothing can be left behind, else after a moment.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};

use super::Exit;

static ASKED: AtomicBool = AtomicBool::new(false);
static SHIELDED: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C end the program with the code 130. A second one always ends it at once.
pub fn listen() {
    // Where a handler cannot be set the system's own stays, which ends the program too.
    let _ = ctrlc::set_handler(|| {
        if ASKED.swap(true, SeqCst) || !SHIELDED.load(SeqCst) {
            process::exit(Exit::Interrupted as i32);
        }
    });
}

/// Does `work` to its end though Ctrl-C is pressed: work that looks at [`asked`], or that would leave a file behind.
pub fn shielded<R>(work: impl FnOnce() -> R) -> R {
    SHIELDED.store(true, SeqCst);
    let result = work();
    SHIELDED.store(false, SeqCst);
    result
}

/// Whether Ctrl-C was pressed.
pub fn asked() -> bool {
    ASKED.load(SeqCst)
}
