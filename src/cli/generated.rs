//! `coarsen man` and `coarsen completions`: made from the definition of the arguments.

use clap::CommandFactory;
use clap_complete::Shell;

use super::args::Arguments;
use super::{Exit, console};

/// Prints a completion script.
///
/// # Errors
/// An output that cannot be written.
pub fn completions(shell: Shell) -> anyhow::Result<Exit> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "coarsen", &mut script);
    console::print(&script)?;
    Ok(Exit::Done)
}

/// Prints the manual: a page for the program, then one for every command.
///
/// # Errors
/// An output that cannot be written.
pub fn man() -> anyhow::Result<Exit> {
    let mut command = Arguments::command().disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut pages)?;
    for verb in command.get_subcommands() {
        clap_mangen::Man::new(verb.clone()).render(&mut pages)?;
    }
    console::print(&pages)?;
    Ok(Exit::Done)
}
