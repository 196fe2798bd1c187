//! The `coarsen` program: parse, run, print the error, exit code.

mod cli;

use std::process::ExitCode;

/// The largest block whose return teaches glibc's allocator to keep blocks of its size, less what it adds.
const KEPT_BLOCK: usize = (32 << 20) - (64 << 10);

/// Has the allocator keep memory that one phase frees for the next, instead of giving it back to the system and faulting it in
/// again page by page, a microsecond or two each. glibc raises its thresholds for that to the size of the largest block that was
/// returned. Nothing is touched, and other allocators only give out a block and take it back.
fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(KEPT_BLOCK)));
}

fn main() -> ExitCode {
    keep_freed_memory();
    let args = match cli::parse(std::env::args_os()) {
        Ok(args) => args,
        Err(answer) => return cli::explain(&answer),
    };
    match cli::run(args) {
        Ok(exit) => exit.into(),
        Err(error) => cli::report(&error),
    }
}
