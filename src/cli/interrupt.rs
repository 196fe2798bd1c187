//! Ctrl-C, and what asks a program to end (SIGTERM, SIGHUP): at once where nothing can be left behind, else after a moment.

use std::process;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::{Duration, Instant};

use super::Exit;

/// When the program was first asked to end.
static ASKED: OnceLock<Instant> = OnceLock::new();
static SHIELDED: AtomicBool = AtomicBool::new(false);

/// What comes again within this time was meant once: `timeout` signals a process and then its group, a terminal that closes
/// does, and then its shell.
const ONCE: Duration = Duration::from_millis(250);

/// Lets Ctrl-C, SIGTERM and SIGHUP end the program with the code 130. A later one ends it at once, whatever it does (see [`ONCE`]).
pub fn listen() {
    let is_hangup_ignored = hangup::is_ignored();
    // Where a handler cannot be set the system's own stays, which ends the program too.
    let _ = ctrlc::set_handler(|| {
        let now = Instant::now();
        let first = *ASKED.get_or_init(|| now);
        if !SHIELDED.load(SeqCst) || now.duration_since(first) > ONCE {
            process::exit(Exit::Interrupted as i32);
        }
    });
    if is_hangup_ignored {
        hangup::ignore();
    }
}

/// Does `work` to its end though the program is asked to end: work that looks at [`asked`], or that would leave a file behind.
pub fn shielded<R>(work: impl FnOnce() -> R) -> R {
    SHIELDED.store(true, SeqCst);
    let result = work();
    SHIELDED.store(false, SeqCst);
    result
}

/// Whether the program was asked to end.
pub fn asked() -> bool {
    ASKED.get().is_some()
}

/// SIGHUP is one of the signals that are listened to or not, all of them together, and `nohup` has it ignored: so it has to stay. It
/// is listened to for the moment between the two calls. Of a shell's `&` SIGINT is ignored too, but nothing sends it from there.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library has no signals")]
mod hangup {
    use std::ffi::c_int;

    /// These have the same values on every Unix.
    const SIGHUP: c_int = 1;
    const SIG_IGN: usize = 1;

    unsafe extern "C" {
        /// Of the C library: sets what a signal does, a function or a small number, and returns what it did.
        fn signal(number: c_int, handler: usize) -> usize;
    }

    /// Whether it is ignored, which only setting it tells.
    pub fn is_ignored() -> bool {
        // SAFETY: no function is set.
        let before = unsafe { signal(SIGHUP, SIG_IGN) };
        // SAFETY: what was set before is set again.
        unsafe { signal(SIGHUP, before) };
        before == SIG_IGN
    }

    pub fn ignore() {
        // SAFETY: no function is set.
        unsafe { signal(SIGHUP, SIG_IGN) };
    }
}

#[cfg(not(unix))]
mod hangup {
    pub fn is_ignored() -> bool {
        false
    }

    pub fn ignore() {}
}
