//! `coarsen man` and `coarsen completions`: made from the definition of the arguments.

use clap_complete::Shell;
use clap_mangen::Man;

use super::args::command;
use super::{Exit, console};

/// Prints a completion script.
///
/// # Errors
/// An output that cannot be written.
pub fn completions(shell: Shell) -> anyhow::Result<Exit> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command(), "coarsen", &mut script);
    console::print(&script)?;
    Ok(Exit::Done)
}

/// Prints the manual: a page for the program, then one for every command.
///
/// # Errors
/// An output that cannot be written.
pub fn man() -> anyhow::Result<Exit> {
    let mut command = command().disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    for command in std::iter::once(&command).chain(command.get_subcommands()) {
        Man::new(command.clone()).source(concat!("coarsen ", env!("CARGO_PKG_VERSION"))).render(&mut pages)?;
    }
    console::print(&pages)?;
    Ok(Exit::Done)
}
