//! Names of levels, by a pattern.

use std::path::PathBuf;

use coarsen::Budget;
use coarsen::batch::{Pattern, Words};

use crate::cli::Exit;
use crate::cli::failure::refuse;
use crate::cli::source::Source;

/// The names of the levels of `source` by these budgets.
///
/// # Errors
/// A word that is none or for what the budgets do not say, and one name for two levels.
pub fn of_levels(text: &str, source: &Source, budgets: &[Budget]) -> anyhow::Result<Vec<PathBuf>> {
    let pattern = Pattern::anywhere(text)?;
    let (dir, file) = parts(source);
    let name = |(level, budget)| pattern.name(Words { dir: &dir, file: &file, level, budget }).map(PathBuf::from);
    let names: Vec<PathBuf> = budgets.iter().enumerate().map(name).collect::<coarsen::Result<_>>()?;
    match (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        Some(i) => {
            let (name, count) = (names[i].display(), names.len());
            let message = format!("'{name}' is one name for several of {count} levels: put {{level}} into '{text}'");
            Err(refuse(Exit::Usage, message))
        }
        None => Ok(names),
    }
}

/// The name of one file for all levels.
///
/// # Errors
/// A word that is none or differs from level to level.
pub fn of_all(text: &str, source: &Source) -> anyhow::Result<PathBuf> {
    let pattern = Pattern::anywhere(text)?;
    if pattern.tells_levels() {
        let message =
            format!("--shared-vertices writes one file for all levels: leave what tells them out of '{text}'");
        return Err(refuse(Exit::Usage, message));
    }
    let (dir, file) = parts(source);
    Ok(pattern.name(Words { dir: &dir, file: &file, level: 0, budget: &Budget::default() })?.into())
}

/// The folder and the name of a source.
fn parts(source: &Source) -> (String, String) {
    match source {
        Source::File(path) => {
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
            let folder = folder.map_or(".".into(), |folder| folder.display().to_string());
            (folder, path.file_name().unwrap_or_default().to_string_lossy().into())
        }
        Source::Stdin(_) => (".".into(), "stdin".into()),
        Source::Sample { name, .. } => (".".into(), name.clone()),
    }
}

#[cfg(test)]
mod tests {
    use coarsen::formats::Format;

    use super::*;

    fn names(pattern: &str, source: &Source, budgets: &[Budget]) -> Result<Vec<String>, String> {
        of_levels(pattern, source, budgets)
            .map(|names| names.iter().map(|name| name.display().to_string()).collect())
            .map_err(|e| e.to_string())
    }

    #[test]
    fn words_are_filled_in() {
        let scan = Source::File("scans/x.v2.ply.gz".into());
        let shares = [0.5, 0.07].map(Budget::keep);
        assert_eq!(names("a/{stem}-{level}.obj", &scan, &shares).unwrap(), ["a/x.v2-1.obj", "a/x.v2-2.obj"]);
        assert_eq!(names("{ratio}.ply", &Source::Stdin(Format::Ply), &shares).unwrap(), ["50.ply", "7.ply"]);
        assert_eq!(names("{stem}{faces}.stl", &scan, &[Budget::faces(500)]).unwrap(), ["x.v2500.stl"]);
        assert_eq!(names("one.ply", &scan, &shares[..1]).unwrap(), ["one.ply"]);
        assert_eq!(names("/far/{dir}/{stem}.{ext}", &scan, &shares[..1]).unwrap(), ["/far/scans/x.v2.ply.gz"]);
        for (pattern, part) in [
            ("one.ply", "'one.ply' is one name for several of 2 levels"),
            ("{faces}.ply", "{faces} in a pattern needs numbers of faces"),
            ("{name}.ply", "has {name}: known are {dir}, {stem}"),
            ("{stem.ply", "brace without its other"),
            ("stem}.ply", "brace without its other"),
        ] {
            let error = names(pattern, &scan, &shares).expect_err(pattern);
            assert!(error.contains(part), "{pattern}: {error}");
        }
    }

    #[test]
    fn one_file_has_one_name() {
        let one = |pattern: &str| of_all(pattern, &Source::File("x.off".into()));
        assert_eq!(one("{stem}-lod.obj").ok(), Some("x-lod.obj".into()));
        assert!(one("{level}.obj").is_err_and(|error| error.to_string().contains("leave what tells them")));
    }
}
