//! The command line: parse without touching a file, resolve into domain values, run.
//!
//! Standard output carries data only, so everything a person reads goes to standard error; only `inspect`, `compare` and
//! `devices`, whose data is for people, print a table there, and `bench` Markdown.

mod args;
mod batch;
mod bench;
mod compare;
mod console;
mod devices;
mod failure;
mod generated;
mod inspect;
mod interrupt;
mod lod;
mod memory;
mod method;
mod parts;
mod progress;
mod quadrics;
mod record;
mod regions;
mod removal;
mod replay;
mod resolve;
mod sample;
mod setup;
mod simplify;
mod sink;
mod source;
mod values;
mod verbose;
mod weights;

use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

use clap::FromArgMatches;

pub use args::Arguments;
use args::Verb;
pub use failure::Exit;

/// Parses the arguments, the program's name first.
///
/// # Errors
/// What clap has to say: a mistake, or the help or version asked for.
pub fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Arguments, clap::Error> {
    let line: Vec<OsString> = args.into_iter().collect();
    let arguments = Arguments::from_arg_matches(&args::command().try_get_matches_from(&line)?)?;
    Ok(Arguments { line, ..arguments })
}

/// Prints the help asked for, or what is wrong with the arguments in the form of all other errors.
pub fn explain(answer: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind::{DisplayHelp, DisplayHelpOnMissingArgumentOrSubcommand, DisplayVersion};
    // Nobody is left to tell when the stream is gone.
    let _ = match answer.kind() {
        DisplayHelp | DisplayVersion | DisplayHelpOnMissingArgumentOrSubcommand => answer.print(),
        _ => write!(std::io::stderr(), "coarsen: {}", answer.render()),
    };
    if answer.use_stderr() { Exit::Usage.into() } else { Exit::Done.into() }
}

/// Runs what was asked for.
///
/// # Errors
/// Whatever kept it from being done; [`report`] prints it.
pub fn run(arguments: Arguments) -> anyhow::Result<Exit> {
    match arguments.verb {
        Verb::Simplify(args) => simplify::run(resolve::simplify(&args)?),
        Verb::Lod(args) => lod::run(&lod::Job::new(&args)?),
        Verb::Batch(args) => batch::run(&batch::Job::new(&args, &arguments.line)?),
        Verb::Replay(args) => replay::run(&replay::Job::new(&args)?),
        Verb::Inspect(args) => inspect::run(&resolve::inspect(&args)?, args.json),
        Verb::Sample(args) => sample::run(&args),
        Verb::Devices(args) => devices::run(args.json),
        Verb::Compare(args) => compare::run(&compare::Job::new(&args)?),
        Verb::Bench(args) => bench::run(&args),
        Verb::Completions(args) => generated::completions(args.shell),
        Verb::Man => generated::man(),
    }
}

/// Prints an error and tells its exit code.
pub fn report(error: &anyhow::Error) -> ExitCode {
    let exit = failure::exit_of(error);
    if exit != Exit::Done {
        console::error(&failure::message(error));
    }
    exit.into()
}
