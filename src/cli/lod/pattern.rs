//! Names of levels, by a pattern.

use std::path::PathBuf;

use coarsen::Budget;

use crate::cli::Exit;
use crate::cli::failure::refuse;
use crate::cli::source::Source;

/// A pattern such as `{stem}-{level}.ply`.
#[derive(Debug)]
pub struct Pattern {
    text: String,
    pieces: Vec<Piece>,
}

#[derive(Debug, PartialEq)]
enum Piece {
    Text(String),
    Stem,
    Level,
    Ratio,
    Faces,
}

impl Pattern {
    /// Reads a pattern.
    ///
    /// # Errors
    /// A word in braces that is none, and a brace without its other.
    pub fn new(text: &str) -> anyhow::Result<Self> {
        let wrong = |why: &str| refuse(Exit::Usage, format!("the pattern '{text}' {why}"));
        let (mut pieces, mut rest) = (Vec::new(), text);
        while let Some(at) = rest.find(['{', '}']) {
            pieces.push(Piece::Text(rest[..at].into()));
            let inside = rest[at..].strip_prefix('{').and_then(|rest| rest.split_once('}'));
            let (word, after) = inside.ok_or_else(|| wrong("has a brace without its other"))?;
            pieces.push(match word {
                "stem" => Piece::Stem,
                "level" => Piece::Level,
                "ratio" => Piece::Ratio,
                "faces" => Piece::Faces,
                _ => {
                    return Err(wrong(&format!(
                        "has {{{word}}}: known are {{level}}, {{stem}}, {{ratio}} and {{faces}}"
                    )));
                }
            });
            rest = after;
        }
        pieces.push(Piece::Text(rest.into()));
        Ok(Self { text: text.into(), pieces })
    }

    /// The names of the levels of `source` by these budgets.
    ///
    /// # Errors
    /// A word for what the budgets do not say, and one name for two levels.
    pub fn fill_all(&self, source: &Source, budgets: &[Budget]) -> anyhow::Result<Vec<PathBuf>> {
        let stem = stem(source);
        let names = (1..).zip(budgets).map(|(level, budget)| self.fill(&stem, level, budget));
        let names: Vec<PathBuf> = names.collect::<anyhow::Result<_>>()?;
        match (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
            Some(i) => {
                let (name, text, count) = (names[i].display(), &self.text, names.len());
                let message =
                    format!("'{name}' is one name for several of {count} levels: put {{level}} into '{text}'");
                Err(refuse(Exit::Usage, message))
            }
            None => Ok(names),
        }
    }

    /// The name of one file for all levels.
    ///
    /// # Errors
    /// A word that differs from level to level.
    pub fn fill_one(&self, source: &Source) -> anyhow::Result<PathBuf> {
        if self.pieces.iter().any(|piece| matches!(piece, Piece::Level | Piece::Ratio | Piece::Faces)) {
            let text = &self.text;
            let message =
                format!("--shared-vertices writes one file for all levels: leave all but {{stem}} out of '{text}'");
            return Err(refuse(Exit::Usage, message));
        }
        self.fill(&stem(source), 0, &Budget::default())
    }

    fn fill(&self, stem: &str, level: usize, budget: &Budget) -> anyhow::Result<PathBuf> {
        let missing = |word: &str, option: &str| refuse(Exit::Usage, format!("{word} in a pattern needs {option}"));
        let mut name = String::new();
        for piece in &self.pieces {
            match piece {
                Piece::Text(text) => name += text,
                Piece::Stem => name += stem,
                Piece::Level => name += &level.to_string(),
                Piece::Ratio => {
                    let ratio = budget.keep.ok_or_else(|| missing("{ratio}", "--ratios or --levels"))?;
                    // As written in percent: 0.07 × 100 is 7.000000000000001.
                    name += &((ratio * 1e12).round() / 1e10).to_string();
                }
                Piece::Faces => name += &budget.faces.ok_or_else(|| missing("{faces}", "--faces"))?.to_string(),
            }
        }
        Ok(name.into())
    }
}

/// The name of a source without folder and extensions.
fn stem(source: &Source) -> String {
    match source {
        Source::File(path) => {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            let inner = name.strip_suffix(".gz").or_else(|| name.strip_suffix(".zst")).unwrap_or(&name);
            inner.rsplit_once('.').map_or(inner, |(stem, _)| stem).into()
        }
        Source::Stdin(_) => "stdin".into(),
        Source::Sample { name, .. } => name.clone(),
    }
}

#[cfg(test)]
mod tests {
    use coarsen::formats::Format;

    use super::*;

    fn names(pattern: &str, source: &Source, budgets: &[Budget]) -> Result<Vec<String>, String> {
        let names = Pattern::new(pattern).and_then(|pattern| pattern.fill_all(source, budgets));
        names.map(|names| names.iter().map(|name| name.display().to_string()).collect()).map_err(|e| e.to_string())
    }

    #[test]
    fn words_are_filled_in() {
        let scan = Source::File("scans/x.v2.ply.gz".into());
        let shares = [0.5, 0.07].map(Budget::keep);
        assert_eq!(names("a/{stem}-{level}.obj", &scan, &shares).unwrap(), ["a/x.v2-1.obj", "a/x.v2-2.obj"]);
        assert_eq!(names("{ratio}.ply", &Source::Stdin(Format::Ply), &shares).unwrap(), ["50.ply", "7.ply"]);
        assert_eq!(names("{stem}{faces}.stl", &scan, &[Budget::faces(500)]).unwrap(), ["x.v2500.stl"]);
        assert_eq!(names("one.ply", &scan, &shares[..1]).unwrap(), ["one.ply"]);
        for (pattern, part) in [
            ("one.ply", "'one.ply' is one name for several of 2 levels"),
            ("{faces}.ply", "{faces} in a pattern needs --faces"),
            ("{name}.ply", "known are {level}, {stem}, {ratio} and {faces}"),
            ("{stem.ply", "brace without its other"),
            ("stem}.ply", "brace without its other"),
        ] {
            let error = names(pattern, &scan, &shares).expect_err(pattern);
            assert!(error.contains(part), "{pattern}: {error}");
        }
    }

    #[test]
    fn one_file_has_one_name() {
        let one = |pattern: &str| Pattern::new(pattern).and_then(|p| p.fill_one(&Source::File("x.off".into())));
        assert_eq!(one("{stem}-lod.obj").ok(), Some("x-lod.obj".into()));
        assert!(one("{level}.obj").is_err_and(|error| error.to_string().contains("leave all but {stem}")));
    }
}
