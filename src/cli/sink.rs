//! Where a mesh goes: a file, or standard output.

use std::fmt;
use std::fs::{self, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use coarsen::formats::{self, Document, Format, WriteOptions};
use coarsen::mesh::Polygons;
use coarsen::{Error, Mesh};

use super::Exit;
use super::failure::refuse;

/// An output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    File(PathBuf),
    Stdout(Format),
}

impl Sink {
    /// The output that `text` names; `format` is that of standard output.
    ///
    /// # Errors
    /// An unknown extension, or standard output without a format.
    pub fn new(text: &str, format: Option<Format>) -> coarsen::Result<Self> {
        if text == "-" {
            let missing = || Error::Parameter("standard output needs --format, such as --format ply".into());
            return format.map(Self::Stdout).ok_or_else(missing);
        }
        let path = PathBuf::from(text);
        // A folder is told by the check of the disk.
        if !path.is_dir() {
            Format::from_path(&path)?;
        }
        Ok(Self::File(path))
    }

    /// The file, if it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            Self::Stdout(_) => None,
        }
    }

    /// Checks that writing can succeed, so that a long run does not end in vain.
    ///
    /// # Errors
    /// A file that exists unless `overwrite`, the file `input`, a folder that is missing or cannot be written to.
    pub fn check(&self, input: Option<&Path>, overwrite: bool) -> anyhow::Result<()> {
        let Self::File(path) = self else { return Ok(()) };
        if input.is_some_and(|input| same_file(input, path)) {
            let message = format!("'{}' is the input as well: give the output another name", path.display());
            return Err(refuse(Exit::Usage, message));
        }
        let failed = |source| Error::Write { path: path.clone(), source };
        match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => return Err(failed(io::ErrorKind::IsADirectory.into()).into()),
            // A device or a pipe is written in place.
            Ok(metadata) if !metadata.is_file() => return Ok(()),
            Ok(_) if !overwrite => {
                let message = format!("'{}' exists: give -w to replace it", path.display());
                return Err(refuse(Exit::NotWritten, message));
            }
            _ => {}
        }
        let from = input.and_then(|input| Format::from_path(input).ok()).map(|(format, _)| format);
        if let Some(beside) = formats::file_beside(path, from) {
            let what = if self.format() == Some(Format::Obj) { "materials" } else { "bytes" };
            if input.is_some_and(|input| same_file(input, &beside)) {
                let message = format!("'{}', where the {what} go, is the input as well", beside.display());
                return Err(refuse(Exit::Usage, message));
            }
            if beside.exists() && !overwrite {
                let message =
                    format!("'{}', where the {what} of a glTF go, exists: give -w to replace it", beside.display());
                return Err(refuse(Exit::NotWritten, message));
            }
        }
        Ok(probe(path).map_err(failed)?)
    }

    /// Checks that writing leaves whole what an input with this document was read from.
    ///
    /// # Errors
    /// As [`Document::check_output`].
    pub fn check_against(&self, document: &Document) -> coarsen::Result<()> {
        self.path().map_or(Ok(()), |path| document.check_output(path))
    }

    /// The format, unless the name of a folder stands for a file.
    pub fn format(&self) -> Option<Format> {
        match self {
            Self::File(path) => Format::from_path(path).ok().map(|(format, _)| format),
            Self::Stdout(format) => Some(*format),
        }
    }

    /// Writes `mesh` and what the input said beside it; returns what is lost.
    ///
    /// # Errors
    /// As [`formats::write_scene`].
    pub fn write(&self, mesh: &Mesh, document: &Document, options: &WriteOptions) -> coarsen::Result<Vec<String>> {
        match self {
            Self::File(path) => formats::write_scene(mesh, document, path, options),
            Self::Stdout(format) => formats::write_scene_to(mesh, document, *format, options, &mut stdout()),
        }
    }

    /// Writes `polygons` in the place of the faces of `mesh`, and what the input said beside it; returns what is lost.
    ///
    /// # Errors
    /// As [`formats::write_polygons`].
    pub fn write_polygons(
        &self,
        mesh: &Mesh,
        polygons: &Polygons,
        document: &Document,
        options: &WriteOptions,
    ) -> coarsen::Result<Vec<String>> {
        match self {
            Self::File(path) => formats::write_polygons(mesh, polygons, document, path, options),
            Self::Stdout(format) => {
                formats::write_polygons_to(mesh, polygons, document, *format, options, &mut stdout())
            }
        }
    }
}

impl fmt::Display for Sink {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Stdout(_) => f.write_str("-"),
        }
    }
}

fn stdout() -> impl io::Write {
    io::BufWriter::with_capacity(1 << 18, io::stdout())
}

/// Whether two names lead to one file, through links too.
///
/// Two hard links are two names here: the output replaces its name and leaves the input's content as it was.
pub fn same_file(a: &Path, b: &Path) -> bool {
    matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
}

/// A hidden name in the same folder that no other process takes.
fn beside(path: &Path) -> PathBuf {
    path.with_file_name(format!(".coarsen-{}.tmp", std::process::id()))
}

/// Makes a file in the folder where `path` will stand, and removes it.
fn probe(path: &Path) -> io::Result<()> {
    let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let probe = beside(&path);
    OpenOptions::new().write(true).create_new(true).open(&probe)?;
    fs::remove_file(&probe)
}
