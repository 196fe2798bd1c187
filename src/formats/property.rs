//! Numbers at vertices that a mesh does not carry: a property of a PLY file, or a list of one number a line.

use std::path::{Path, PathBuf};

use super::faces::Faces;
use super::text::{Lines, Rows};
use super::{Format, WriteOptions, input, output, ply};
use crate::error::{Error, Result};
use crate::mesh::Mesh;

/// Where a number for each vertex of a mesh comes from, such as what it counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Weights {
    /// A text file of one number a line.
    File(PathBuf),
    /// A property of the vertices of the mesh's own file, a PLY.
    Property(String),
}

impl Weights {
    /// Reads them; `content` is that of the mesh's own file, if it has one.
    ///
    /// # Errors
    /// Those of [`read_numbers`] and [`read_property`].
    pub fn read(&self, content: Option<(&[u8], Format)>) -> Result<Vec<f32>> {
        let numbers = match (self, content) {
            (Self::File(path), _) => read_numbers(path)?,
            (Self::Property(name), Some((content, Format::Ply))) => ply::read_property(content, name)?,
            (Self::Property(name), _) => {
                return Err(Error::Unsupported(format!(
                    "'ply:{name}' names numbers in the input, and that is no PLY file"
                )));
            }
        };
        Ok(numbers.into_iter().map(|number| number as f32).collect())
    }
}

/// Reads the property `name` of the vertices of the PLY file at `path`, as it is stored.
///
/// # Errors
/// As [`read`](super::read()); [`Error::Unsupported`] for another format, [`Error::Parameter`] where the vertices have no
/// such number, with the names of those that they have.
pub fn read_property(path: &Path, name: &str) -> Result<Vec<f64>> {
    let (format, compression) = Format::from_path(path)?;
    if format != Format::Ply {
        let file = path.display();
        return Err(Error::Unsupported(format!("'{file}' is no PLY, the only format with properties at its vertices")));
    }
    let content = input::open(path, format, compression)?;
    input::check_content(&content, format)?;
    ply::read_property(&content, name)
}

/// Reads the text file at `path`: one number a line; what follows a `#` and blank lines are skipped.
///
/// # Errors
/// [`Error::Read`] when the system cannot read it, [`Error::Format`] with the line that is no number.
pub fn read_numbers(path: &Path) -> Result<Vec<f64>> {
    numbers(path, "a weight", |_| true)
}

/// Reads the text file at `path`: the number of a vertex a line, from 0 on; what follows a `#` and blank lines are skipped.
///
/// # Errors
/// As [`read_numbers`].
pub fn read_indices(path: &Path) -> Result<Vec<u32>> {
    let is_index = |number: f64| number.fract() == 0.0 && (0.0..f64::from(u32::MAX)).contains(&number);
    let found = numbers(path, "the number of a vertex, from 0 on", is_index)?;
    Ok(found.into_iter().map(|number| number as u32).collect())
}

/// The numbers of a file's lines, each of which is to be `what`.
fn numbers(path: &Path, what: &str, is_one: impl Fn(f64) -> bool) -> Result<Vec<f64>> {
    let content = input::map_or_read(path).map_err(|source| Error::Read { path: path.to_path_buf(), source })?;
    let mut rows = Rows::new("text", Lines::after(0, &content), Some(b'#'));
    let mut numbers = Vec::new();
    while let Some(mut row) = rows.next() {
        let number = row.number(what)?;
        if !is_one(number) {
            return Err(row.error(format!("found {number}, expected {what}")));
        }
        numbers.push(number);
        if row.next().is_some() {
            return Err(row.error("found more than one number on a line, expected one".into()));
        }
    }
    Ok(numbers)
}

/// Writes `mesh` to the PLY file at `path` with the property `name` at its vertices, as atomically as
/// [`write`](super::write()).
///
/// # Errors
/// As [`write`](super::write()); [`Error::Unsupported`] for another format, [`Error::Parameter`] unless there is one value
/// for each vertex and the name is one word of letters, digits and `_`.
pub fn write_with_property(
    mesh: &Mesh,
    path: &Path,
    options: &WriteOptions,
    (name, values): (&str, &[f32]),
) -> Result<()> {
    let (format, compression) = Format::from_path(path)?;
    if format != Format::Ply {
        let file = path.display();
        return Err(Error::Unsupported(format!("'{file}' is no PLY, the only format with properties at its vertices")));
    }
    if name.is_empty() || !name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_') {
        return Err(Error::Parameter(format!("'{name}' cannot name a property: write letters, digits and '_'")));
    }
    if values.len() != mesh.positions.len() {
        let (given, vertices) = (values.len(), mesh.positions.len());
        return Err(Error::Parameter(format!("{given} values for a mesh of {vertices} vertices: give one each")));
    }
    mesh.check()?;
    let property = Some((name, values));
    output::atomically(path, |file| {
        output::compressed(file, compression, |out| ply::write(mesh, Faces::of(mesh), options, (property, &[]), out))
    })
    .map_err(|source| Error::Write { path: path.to_path_buf(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::read;
    use crate::mesh::shapes::{cube, tetrahedron};

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().expect("a folder")
    }

    #[test]
    fn a_property_comes_back() {
        let folder = folder();
        let values = [0.0, 0.5, 1e-30, 7.25, -1.0, 1e20, 3.0, 0.1];
        for (file, ascii) in [("a.ply", false), ("b.ply", true), ("c.ply.gz", false)] {
            let path = folder.path().join(file);
            let mut mesh = cube(1);
            mesh.colors = Some(vec![[1.0, 0.0, 0.0, 1.0]; 8]);
            write_with_property(&mesh, &path, &WriteOptions { ascii }, ("feature", &values)).expect("written");
            let mut found = read(&path).expect("a mesh");
            let channel = found.channels.pop().expect("a channel");
            assert_eq!((channel.name.as_str(), &channel.values[..]), ("feature", &values[..]), "{file}");
            assert_eq!(found, mesh, "{file}");
            let found = read_property(&path, "feature").expect("the property");
            assert_eq!(found.iter().map(|&x| x as f32).collect::<Vec<_>>(), values, "{file}");
            assert_eq!(read_property(&path, "red").expect("a color"), [255.0; 8], "{file}");
            let missing = read_property(&path, "saliency").expect_err("no such property").to_string();
            assert!(
                missing.contains("'saliency'") && missing.contains("x, y, z, red, green, blue, feature"),
                "{missing}"
            );
        }
    }

    #[test]
    fn properties_stand_behind_other_elements_and_lists() {
        let folder = folder();
        let path = folder.path().join("a.ply");
        let head = "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nelement vertex 3\nproperty float x\n\
            property list uchar int ids\nproperty float y\nproperty float z\nproperty short w\nelement face 1\n\
            property list uchar int vertex_indices\nend_header\n";
        std::fs::write(&path, format!("{head}9\n0 2 5 6 0 0 -3\n1 0 0 0 4\n0 1 7 1 0 5\n3 0 1 2\n")).expect("written");
        assert_eq!(read_property(&path, "w").expect("the property"), [-3.0, 4.0, 5.0]);
        assert!(read_property(&path, "ids").is_err());
    }

    #[test]
    fn lists_of_numbers_are_read() {
        let folder = folder();
        let path = folder.path().join("weights.txt");
        let numbers = |text: &str| {
            std::fs::write(&path, text).expect("written");
            read_numbers(&path).map_err(|error| error.to_string())
        };
        assert_eq!(numbers("1\n# a comment\n\n 2.5 # too\r\n1e-3"), Ok(vec![1.0, 2.5, 1e-3]));
        assert_eq!(numbers(""), Ok(vec![]));
        assert_eq!(numbers("1\nx\n"), Err("text line 2: found 'x', expected a weight, a number".into()));
        assert_eq!(numbers("1 2\n"), Err("text line 1: found more than one number on a line, expected one".into()));
        assert!(read_numbers(Path::new("missing.txt")).is_err());
    }

    #[test]
    fn what_cannot_be_written_is_refused() {
        let folder = folder();
        let write = |file: &str, name: &str, values: &[f32]| {
            write_with_property(&tetrahedron(), &folder.path().join(file), &WriteOptions::default(), (name, values))
        };
        assert!(matches!(write("a.obj", "w", &[0.0; 4]), Err(Error::Unsupported(_))));
        assert!(matches!(write("a.ply", "two words", &[0.0; 4]), Err(Error::Parameter(_))));
        assert!(matches!(write("a.ply", "w", &[0.0; 3]), Err(Error::Parameter(_))));
        assert!(matches!(read_property(Path::new("a.obj"), "w"), Err(Error::Unsupported(_))));
        assert!(std::fs::read_dir(folder.path()).expect("the folder").next().is_none());
    }
}
