//! The `coarsen` program: parse, run, print the error, exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    let args = match cli::parse(std::env::args_os()) {
        Ok(args) => args,
        Err(answer) => return cli::explain(&answer),
    };
    match cli::run(args) {
        Ok(exit) => exit.into(),
        Err(error) => cli::report(&error),
    }
}
