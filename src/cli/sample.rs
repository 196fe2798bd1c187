//! `coarsen sample`: write a built-in mesh.

use coarsen::Error;
use coarsen::formats::{self, Compression, Document, Format, WriteOptions};
use coarsen::mesh::samples::{comes_in_pieces, sample, sample_in_pieces};

use super::failure::refuse;
use super::sink::Sink;
use super::source::Source;
use super::{Exit, args, console, interrupt};

/// Makes the sample and writes it.
///
/// # Errors
/// A sample that is none, or an output that cannot be written.
pub fn run(args: &args::Sample) -> anyhow::Result<Exit> {
    interrupt::listen();
    let spec = args.sample.strip_prefix("sample:").unwrap_or(&args.sample);
    let Source::Sample { name, faces, .. } = Source::new(&format!("sample:{spec}"), None)? else {
        return Err(refuse(Exit::Usage, format!("'{}' is no sample", args.sample)));
    };
    if args.output == "-" {
        return Err(refuse(
            Exit::Usage,
            "a sample is written to a file, not to standard output: name one, such as out.ply",
        ));
    }
    let sink = Sink::new(&args.output, None)?;
    sink.check(None, args.overwrite)?;
    let path = args.output.as_ref();
    let mut counts = [0; 2];
    if comes_in_pieces(&name, faces) && Format::from_path(path)? == (Format::Ply, Compression::None) {
        let written = interrupt::shielded(|| {
            formats::write_pieces(path, |write| {
                sample_in_pieces(&name, faces, &mut |piece| {
                    counts = [counts[0] + piece.positions.len(), counts[1] + piece.faces.len()];
                    // Any error ends it: this one is told in other words below.
                    if interrupt::asked() { Err(Error::Parameter("interrupted".into())) } else { write(piece) }
                })
            })
        });
        if written.is_err() && interrupt::asked() {
            return Err(refuse(Exit::Interrupted, "interrupted, nothing is written"));
        }
        written?;
    } else {
        // Before there is a file, Ctrl-C ends the program at once.
        let mesh = sample(&name, faces)?;
        counts = [mesh.positions.len(), mesh.faces.len()];
        interrupt::shielded(|| sink.write(&mesh, &Document::None, &WriteOptions::default()))?;
    }
    if !args.quiet {
        console::say(format!("'{}': {} vertices, {} faces", args.output, counts[0], counts[1]));
    }
    // The file was complete before the interruption could be heeded; the shell is to know of it all the same.
    Ok(if interrupt::asked() { Exit::Interrupted } else { Exit::Done })
}
