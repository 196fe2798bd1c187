//! What to read: files, folders, globs and samples, each with a name that no other has.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::error::{Error, Result};
use crate::formats::{FileSize, Format};
use crate::mesh::samples::parse_sample;

/// Where a mesh comes from.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Origin {
    /// A file.
    File(PathBuf),
    /// A built-in mesh, as written: `sample:part@5k`.
    Sample(String),
}

/// A mesh to read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Where it comes from.
    pub origin: Origin,
    /// Its name below the folder that all inputs have in common, with slashes on every system: what outputs are named after
    /// and shards are dealt by.
    pub name: String,
    /// Size of the file; none of one that is not there, and of a sample.
    pub size: FileSize,
    /// The recipe to follow, by its number in the plan.
    pub recipe: usize,
}

/// A text that names inputs, and the recipe that they follow.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// A file, a folder, a glob, or `sample:NAME[@FACES]`.
    pub text: String,
    /// Whether its wildcards are characters like others, so that it is no glob.
    pub is_literal: bool,
    /// By its number in the plan.
    pub recipe: usize,
}

impl Request {
    /// What somebody wrote who may mean a glob.
    pub fn new(text: impl Into<String>, recipe: usize) -> Self {
        Self { text: text.into(), is_literal: false, recipe }
    }

    /// The name of one input, as it is.
    pub fn literal(text: impl Into<String>, recipe: usize) -> Self {
        Self { is_literal: true, ..Self::new(text, recipe) }
    }
}

/// A file or sample, and the folder that was searched for it.
struct Found {
    origin: Origin,
    root: Option<PathBuf>,
    recipe: usize,
}

/// The inputs that `requests` name, sorted by name, each once.
///
/// A folder is searched with all its folders, hidden ones and links to folders left out; folders and globs give the files
/// whose extension names a mesh format, and none of those in `outputs`, unless it is a folder in there that is searched. A file
/// that is named itself is an input even if it is not there: reading tells. One without an extension is taken for a folder, which
/// has to be there.
///
/// # Errors
/// [`Error::Parameter`] for a glob or folder without a mesh file, and for a malformed glob or sample;
/// [`Error::Read`] for a folder that is not there or cannot be listed.
pub fn list(requests: &[Request], outputs: &Path) -> Result<Vec<Input>> {
    let outputs = fs::canonicalize(outputs).ok();
    let mut found = Vec::new();
    for request in requests {
        found.extend(find(request, outputs.as_deref())?);
    }
    let common = common_folder(found.iter().filter_map(|found| found.root.as_deref()));
    let mut seen = BTreeSet::new();
    let mut inputs = Vec::with_capacity(found.len());
    for Found { origin, recipe, .. } in found {
        if seen.insert((origin.clone(), recipe)) {
            let (name, size) = match &origin {
                Origin::File(path) => (relative(path, &common), FileSize::of(path)),
                // A dot would begin an extension.
                Origin::Sample(text) => (text.trim_start_matches("sample:").replace('.', "_"), FileSize::default()),
            };
            inputs.push(Input { origin, name, size, recipe });
        }
    }
    inputs.sort_by(|a, b| (&a.name, a.recipe).cmp(&(&b.name, b.recipe)));
    Ok(inputs)
}

fn find(request: &Request, outputs: Option<&Path>) -> Result<Vec<Found>> {
    let Request { text, is_literal, recipe } = request;
    let one = |origin, root| Ok(vec![Found { origin, root, recipe: *recipe }]);
    if text.starts_with("sample:") {
        return match parse_sample(text) {
            Some(_) => one(Origin::Sample(text.clone()), None),
            None => Err(Error::Parameter(format!("'{text}' is no sample: write sample:NAME or sample:NAME@FACES"))),
        };
    }
    let path = Path::new(text);
    let mut files = Vec::new();
    let root = if path.is_dir() {
        let root = fs::canonicalize(path).map_err(|source| Error::Read { path: path.into(), source })?;
        walk(&root, &mut files)?;
        root
    } else if path.exists() || *is_literal || !text.contains(['*', '?', '[']) {
        // Without an extension a folder was meant.
        if !is_literal && path.extension().is_none() {
            fs::metadata(path).map_err(|source| Error::Read { path: path.into(), source })?;
        }
        let file = absolute(path);
        let root = file.parent().map(Path::to_path_buf);
        return one(Origin::File(file), root);
    } else {
        let malformed = |error: glob::PatternError| Error::Parameter(format!("'{text}' is no glob: {error}"));
        let options = glob::MatchOptions { require_literal_leading_dot: true, ..glob::MatchOptions::new() };
        for matched in glob::glob_with(text, options).map_err(malformed)? {
            let path = matched.map_err(|error| {
                let path = error.path().to_path_buf();
                Error::Read { path, source: error.into() }
            })?;
            files.extend(Some(absolute(&path)).filter(|file| path.is_file() && is_mesh(file)));
        }
        let fixed = fixed_part(path);
        let folder = if fixed.as_os_str().is_empty() { Path::new(".") } else { &fixed };
        fs::canonicalize(folder).unwrap_or_else(|_| absolute(folder))
    };
    let found_any = !files.is_empty();
    // Who searches a folder among the outputs means what is in it.
    if let Some(outputs) = outputs.filter(|&outputs| root == outputs || !root.starts_with(outputs)) {
        files.retain(|file| !file.starts_with(outputs));
    }
    if files.is_empty() {
        let why = match found_any {
            true => "names only files in the folder of outputs: choose another for these",
            false => "names no mesh file: known are .obj, .ply, .stl, .off, .gltf and .glb, also with .gz or .zst",
        };
        return Err(Error::Parameter(format!("'{text}' {why}")));
    }
    let found = |file| Found { origin: Origin::File(file), root: Some(root.clone()), recipe: *recipe };
    Ok(files.into_iter().map(found).collect())
}

/// Adds the mesh files in `folder` and below.
fn walk(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let failed = |source| Error::Read { path: folder.to_path_buf(), source };
    for entry in fs::read_dir(folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
        if entry.file_name().to_string_lossy().starts_with('.') {
            continue;
        }
        if kind.is_dir() {
            walk(&path, files)?;
        } else if is_mesh(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}

fn is_mesh(path: &Path) -> bool {
    Format::from_path(path).is_ok()
}

/// The path with the links of its folder followed, even if there is no such file.
fn absolute(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match (fs::canonicalize(folder), path.file_name()) {
        (Ok(folder), Some(name)) => folder.join(name),
        _ => std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()),
    }
}

/// The folders of a glob before the first with a wildcard.
fn fixed_part(glob: &Path) -> PathBuf {
    let is_plain = |part: &Component| !part.as_os_str().to_string_lossy().contains(['*', '?', '[']);
    glob.components().take_while(is_plain).collect()
}

/// The folder that all of `folders` are in.
fn common_folder<'a>(mut folders: impl Iterator<Item = &'a Path>) -> PathBuf {
    let first = folders.next().map(Path::to_path_buf).unwrap_or_default();
    folders.fold(first, |common, folder| {
        let same = common.components().zip(folder.components()).take_while(|(a, b)| a == b);
        same.map(|(part, _)| part).collect()
    })
}

fn relative(path: &Path, folder: &Path) -> String {
    let path = path.strip_prefix(folder).unwrap_or(path);
    let parts = path.components().filter(|part| matches!(part, Component::Normal(_)));
    parts.map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn request(path: &Path) -> Request {
        Request::new(path.display().to_string(), 0)
    }

    fn names(requests: &[Request], outputs: &Path) -> Vec<String> {
        list(requests, outputs).expect("inputs").into_iter().map(|input| input.name).collect()
    }

    #[test]
    fn names_are_globs_or_what_they_are() {
        let dir = tempfile::tempdir().expect("a folder");
        fs::write(dir.path().join("x1.ply"), "").expect("a file");
        let text = dir.path().join("x[1].ply").display().to_string();
        let outputs = dir.path().join("out");
        assert_eq!(names(&[Request::new(&text, 0)], &outputs), ["x1.ply"]);
        assert_eq!(names(&[Request::literal(&text, 0)], &outputs), ["x[1].ply"]);
        fs::write(&text, "").expect("a file");
        assert_eq!(names(&[Request::new(&text, 0)], &outputs), ["x[1].ply"]);
    }

    #[test]
    fn folders_globs_and_files_have_names_below_what_they_have_in_common() {
        let dir = tempfile::tempdir().expect("a folder");
        let root = dir.path();
        for file in ["a/x.ply", "a/deep/y.obj.gz", "b/x.ply", "b/.hidden.ply", "b/notes.txt", "out/z.ply"] {
            fs::create_dir_all(root.join(file).parent().expect("a folder")).expect("a folder");
            fs::write(root.join(file), "").expect("a file");
        }
        let outputs = root.join("out");
        assert_eq!(names(&[request(root)], &outputs), ["a/deep/y.obj.gz", "a/x.ply", "b/x.ply"]);
        assert_eq!(names(&[request(&root.join("a"))], &outputs), ["deep/y.obj.gz", "x.ply"]);
        let both = [request(&root.join("a")), request(&root.join("b")), request(&root.join("b/x.ply"))];
        assert_eq!(names(&both, &outputs), ["a/deep/y.obj.gz", "a/x.ply", "b/x.ply"]);
        assert_eq!(names(&[request(&root.join("*/x.ply"))], &outputs), ["a/x.ply", "b/x.ply"]);
        assert_eq!(names(&[request(&root.join("**/*"))], &outputs), ["a/deep/y.obj.gz", "a/x.ply", "b/x.ply"]);
        assert_eq!(names(&[request(&root.join("gone.ply"))], &outputs), ["gone.ply"]);
        assert_eq!(names(&[Request::new("sample:part@5k", 0)], &outputs), ["part@5k"]);
        // Folders and globs agree on what is no input: what lies among the outputs, unless one searches there.
        for (text, found) in [("out", "z.ply"), ("out/*", "z.ply"), ("a/x.ply", "x.ply"), ("a/x*", "x.ply")] {
            assert_eq!(names(&[request(&root.join(text))], root), [found], "{text}");
        }
        assert!(list(&[request(root)], root).is_err() && list(&[request(&root.join("**/*"))], root).is_err());
        for wrong in [root.join("*.obj"), root.join("out"), PathBuf::from("sample:part@x"), root.join("***")] {
            assert!(matches!(list(&[request(&wrong)], &outputs), Err(Error::Parameter(_))), "{}", wrong.display());
        }
    }
}
