//! Where a mesh comes from: a file, standard input, or a built-in sample.

use std::fmt;
use std::fs;
use std::io::{self, BufRead};
use std::path::{Path, PathBuf};

use coarsen::batch::faces_in_file;
use coarsen::formats::{self, Compression, Format, Scene};
use coarsen::mesh::samples::{LEAST_FACES, MOST_FACES, SAMPLES, parse_sample, sample};
use coarsen::{Error, Mesh};

use super::failure::at;

/// An input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Source {
    File(PathBuf),
    Stdin(Format),
    /// As written, its name, its faces.
    Sample {
        text: String,
        name: String,
        faces: Option<usize>,
    },
}

impl Source {
    /// The input that `text` names; `format` is that of standard input. Looks whether a file is there, not into it.
    ///
    /// # Errors
    /// An unknown extension or sample, a missing file, or standard input without a format.
    pub fn new(text: &str, format: Option<Format>) -> coarsen::Result<Self> {
        if text == "-" {
            let missing = || Error::Parameter("standard input needs --format, such as --format ply".into());
            return format.map(Self::Stdin).ok_or_else(missing);
        }
        if text.starts_with("sample:") {
            let malformed =
                || Error::Parameter(format!("'{text}' is no sample: write sample:NAME or sample:NAME@FACES"));
            let (name, faces) = parse_sample(text).ok_or_else(malformed)?;
            check_sample(name, faces)?;
            return Ok(Self::Sample { text: text.into(), name: name.into(), faces });
        }
        let path = PathBuf::from(text);
        match fs::metadata(&path) {
            Err(source) => Err(Error::Read { path, source }),
            Ok(metadata) if metadata.is_dir() => Err(Error::Read { path, source: io::ErrorKind::IsADirectory.into() }),
            Ok(_) => Format::from_path(&path).map(|_| Self::File(path)),
        }
    }

    /// The file, if it is one.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            _ => None,
        }
    }

    /// About how many faces it has, as far as can be told before it is read: none of standard input, and of samples as they
    /// come, which are small.
    pub fn faces(&self) -> u64 {
        match self {
            Self::File(path) => faces_in_file(path),
            Self::Sample { faces, .. } => faces.unwrap_or(0) as u64,
            Self::Stdin(_) => 0,
        }
    }

    /// Reads or makes the mesh.
    ///
    /// # Errors
    /// As [`Source::read_scene`].
    pub fn read(&self) -> anyhow::Result<Mesh> {
        self.read_scene().map(Scene::into_mesh)
    }

    /// Reads or makes the mesh, with what its file says beside it.
    ///
    /// # Errors
    /// As [`formats::read_scene`], with the name of the input in front.
    pub fn read_scene(&self) -> anyhow::Result<Scene> {
        match self {
            Self::File(path) => formats::read_scene(path),
            Self::Stdin(format) => read_stdin(*format),
            Self::Sample { name, faces, .. } => sample(name, *faces).map(|mesh| Scene { mesh, ..Scene::default() }),
        }
        .map_err(|error| at(Path::new(&self.to_string()), error))
    }
}

/// Reads standard input, which has no name to tell how it is compressed: its first bytes do.
fn read_stdin(format: Format) -> coarsen::Result<Scene> {
    let mut stdin = io::stdin().lock();
    let start = stdin.fill_buf().map_err(|source| Error::Read { path: "-".into(), source })?;
    let compression = Compression::of_content(start);
    formats::read_scene_from(&mut stdin, format, compression, None)
}

/// Refuses a sample that cannot be made, before anything is made.
fn check_sample(name: &str, faces: Option<usize>) -> coarsen::Result<()> {
    if !SAMPLES.iter().any(|(known, ..)| *known == name) {
        let names: Vec<&str> = SAMPLES.iter().map(|(name, ..)| *name).collect();
        return Err(Error::Parameter(format!("no sample '{name}', there are: {}", names.join(", "))));
    }
    match faces {
        Some(faces) if !(LEAST_FACES..=MOST_FACES).contains(&faces) => {
            Err(Error::Parameter(format!("a sample has {LEAST_FACES} to {MOST_FACES} faces, not {faces}")))
        }
        _ => Ok(()),
    }
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(path) => path.display().fmt(f),
            Self::Stdin(_) => f.write_str("-"),
            Self::Sample { text, .. } => f.write_str(text),
        }
    }
}
