//! What may be written on the command line; help, man page and completions are generated from here.
//!
//! Parsing touches no file. A doc comment's first line is the short help, all of it the long help.

mod attributes;
mod batch;
mod bench;
mod compare;
mod how;
mod lod;
mod regions;
mod removal;
mod replay;
mod sample;
mod simplify;
mod weights;

use std::ffi::OsString;

use clap::{Args, Command, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;

pub use attributes::{Attributes, ColorSpace, Dropped, Normals, Seams};
pub use batch::{Batch, Each, Levels as BatchLevels};
pub use bench::{Bench, Job as BenchJob};
pub use compare::{Compare, Up};
pub use how::{How, Measuring};
pub use lod::{Levels, Lod, Screen};
pub use regions::{RegionFiles, Regions, Solver, Triangulation};
pub use removal::{Fill, Removal};
pub use replay::Replay;
pub use sample::Sample;
pub use simplify::{
    Candidates, Device, FlipBy, Method, Metric, NonManifold, Placement, Progress, QuadricFormat, QuadricFrame,
    Representative, Shape, Simplify, Target, Writing,
};
pub use weights::{FeatureFile, FeatureMode, FeatureUpdate, Weights};

/// As [`coarsen::backend::Device::MOST_THREADS`], in the type that ranges of numbers are of here.
const MOST_THREADS: i64 = coarsen::backend::Device::MOST_THREADS as i64;

/// Reduce triangle meshes, on the GPU or the CPU, with the same bytes on both.
#[derive(Debug, Parser)]
#[command(name = "coarsen", version, arg_required_else_help = true)]
#[command(after_help = after_exit_codes(EXAMPLES))]
pub struct Arguments {
    #[command(subcommand)]
    pub verb: Verb,
    /// The whole line as it was given, the program's name first.
    #[arg(skip)]
    pub line: Vec<OsString>,
}

/// The definition, with long texts broken into lines.
///
/// The width is fixed, so that the help is the same in a terminal, a file and a test.
pub fn command() -> Command {
    // Of the verb in use only: those of all take as long as reading a small mesh.
    Arguments::command().mut_subcommands(|verb| verb.defer(with_lines))
}

/// A verb with long texts broken into lines.
fn with_lines(verb: Command) -> Command {
    let about = verb.get_long_about().map(|text| wrapped(&text.to_string(), 79)).unwrap_or_default();
    let verb = match (verb.get_after_long_help(), verb.get_after_help()) {
        (None, Some(examples)) => {
            let notes = format!("The exit codes are those of 'coarsen --help'.\n\n{examples}");
            verb.after_long_help(notes)
        }
        _ => verb,
    };
    verb.long_about(about).mut_args(|arg| match arg.get_long_help().map(|text| wrapped(&text.to_string(), 69)) {
        Some(text) => arg.long_help(text),
        None => arg,
    })
}

/// Breaks every line of `text` between words so that none is longer than `width`, if it has a space.
fn wrapped(text: &str, width: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    for paragraph in text.lines() {
        let (mut line, mut line_chars) = (String::new(), 0);
        for word in paragraph.split_whitespace() {
            let word_chars = word.chars().count();
            if line_chars > 0 && line_chars + 1 + word_chars > width {
                lines.push(std::mem::take(&mut line));
                line_chars = 0;
            }
            if line_chars > 0 {
                line.push(' ');
                line_chars += 1;
            }
            line.push_str(word);
            line_chars += word_chars;
        }
        lines.push(line);
    }
    lines.join("\n")
}

#[derive(Debug, Subcommand)]
pub enum Verb {
    Simplify(Box<Simplify>),
    Lod(Box<Lod>),
    Batch(Box<Batch>),
    Replay(Replay),
    Inspect(Inspect),
    Sample(Sample),
    Compare(Box<Compare>),
    Devices(Devices),
    Bench(Bench),
    Completions(Completions),
    /// Print the manual page
    ///
    /// Prints the manual page of the program and all its commands in roff to standard output.
    #[command(after_help = "Example:\n  coarsen man > coarsen.1")]
    Man,
}

/// Tell what a mesh is and what blocks its reduction
///
/// Counts what is in a mesh, tells what is wrong with it, and predicts the fewest faces that a reduction can reach and
/// why not fewer.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  coarsen inspect sample:part\n  coarsen inspect sample:terrain@10k --json")]
pub struct Inspect {
    /// Mesh to read: a file, '-', or sample:NAME[@FACES]
    ///
    /// As in `coarsen simplify`.
    #[arg(value_name = "IN")]
    pub input: String,

    /// Format of '-': obj, ply, stl, off, gltf or glb
    ///
    /// The format of standard input, needed where IN is '-'.
    #[arg(long, value_name = "EXT")]
    pub format: Option<String>,

    /// Print one JSON object on standard output
    ///
    /// Prints the same facts as one JSON object on one line. Its fields are stable under "schema": 1.
    #[arg(long)]
    pub json: bool,
}

/// List the adapters and what 'auto' would take
///
/// Lists every graphics adapter with its limits, and says which device `--device auto` would take, where it gains, and
/// why.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  coarsen devices")]
pub struct Devices {
    /// Print one JSON object on standard output
    ///
    /// Prints the same facts as one JSON object on one line. Its fields are stable under "schema": 1.
    #[arg(long)]
    pub json: bool,
}

/// Print a completion script for a shell
///
/// Prints a script to standard output that lets a shell complete commands and options.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  coarsen completions bash > coarsen.bash")]
pub struct Completions {
    /// Shell to print the script for
    #[arg(value_enum)]
    pub shell: Shell,
}

/// The table of exit codes, then the first paragraph of `examples`: a further one points to the long help, which this ends.
fn after_exit_codes(examples: &str) -> String {
    format!("{EXIT_CODES}\n\n{}", examples.split("\n\n").next().unwrap_or_default())
}

const EXIT_CODES: &str = "\
Exit codes:
  0  done                             5    unsupported content or extension
  1  unexpected                       6    over a memory or index limit
  2  usage                            7    device missing or lost
  3  target not reached, required     8    output not written
  4  input unreadable or malformed    9    some files of a batch failed
                                      130  ended by Ctrl-C, SIGTERM, SIGHUP";

const EXAMPLES: &str = "\
Examples:
  coarsen simplify sample:statue out.ply --faces 20000
  coarsen lod sample:statue statue-{level}.ply --ratios 50%,10%,1%
  coarsen batch scans -d out --ratios 50%,10%,1%
  coarsen inspect sample:part
  coarsen compare sample:statue@100k sample:statue@10k
  coarsen bench sample:statue@100k --device cpu,software
  coarsen devices";

#[cfg(test)]
mod tests {
    use clap::ArgAction;

    use super::*;

    #[test]
    fn the_definition_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn every_option_has_a_line_and_a_sentence() {
        let mut seen = 0;
        for verb in command().get_subcommands() {
            assert!(verb.get_long_about().is_some_and(|text| text.to_string().ends_with('.')), "{}", verb.get_name());
            for option in verb.get_arguments().filter(|arg| !arg.is_positional()) {
                let long = option.get_long_help().unwrap_or_default().to_string();
                assert!(option.get_help().is_some_and(|text| !text.to_string().ends_with('.')), "{option}");
                assert!(long.ends_with(['.', ')']), "{option} has no sentence: {long}");
                seen += 1;
            }
        }
        assert!(seen > 20, "{seen} options");
    }

    #[test]
    fn flags_take_no_value() {
        let command = command();
        let simplify = command.find_subcommand("simplify").expect("the verb");
        let flags = simplify.get_arguments().filter(|arg| matches!(arg.get_action(), ArgAction::SetTrue)).count();
        assert_eq!(flags, 12);
    }

    #[test]
    fn lines_break_between_words() {
        assert_eq!(wrapped("aa bb cc\n\ndd abcdefgh e", 5), "aa bb\ncc\n\ndd\nabcdefgh\ne");
    }
}
