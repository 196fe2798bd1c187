//! Names of outputs, by a pattern.

use std::path::{Component, Path};

use crate::error::{Error, Result};
use crate::simplify::Budget;

/// A pattern such as `{dir}/{stem}-{level}.{ext}`.
///
/// | word | stands for |
/// |---|---|
/// | `{dir}` | the folder of the input below the folder that all inputs have in common |
/// | `{stem}` | the input's name without its extensions |
/// | `{ext}` | its extensions, the compression's too; `ply` of a sample |
/// | `{level}` | 1 for the finest level, 2 for the next, … |
/// | `{ratio}` | the ratio asked for in percent: `10`, `0.5` |
/// | `{faces}` | the number of faces asked for |
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(Vec<Piece>);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Piece {
    Text(String),
    Dir,
    Stem,
    Ext,
    Level,
    Ratio,
    Faces,
}

/// What the words of a pattern stand for.
#[derive(Debug, Clone, Copy)]
pub struct Words<'a> {
    /// The folder of the input.
    pub dir: &'a str,
    /// The name of the input's file, or of a sample.
    pub file: &'a str,
    /// Counted from 0.
    pub level: usize,
    /// Of the level.
    pub budget: &'a Budget,
}

impl Pattern {
    /// Reads a pattern of names inside a folder.
    ///
    /// # Errors
    /// Those of [`anywhere`](Self::anywhere), and [`Error::Parameter`] for a name that leads out of the folder.
    pub fn new(text: &str) -> Result<Self> {
        let pattern = Self::anywhere(text)?;
        if text.is_empty() || text.starts_with('/') || text.split(['/', '\\']).any(|part| part == "..") {
            return Err(Error::Parameter(format!("the pattern '{text}' must name a file inside the folder")));
        }
        Ok(pattern)
    }

    /// Reads a pattern of any names.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a word that is none, and a brace without its other.
    pub fn anywhere(text: &str) -> Result<Self> {
        let wrong = |why: &str| Error::Parameter(format!("the pattern '{text}' {why}"));
        let (mut pieces, mut rest) = (Vec::new(), text);
        while let Some(at) = rest.find(['{', '}']) {
            if at > 0 {
                pieces.push(Piece::Text(rest[..at].into()));
            }
            let inside = rest[at..].strip_prefix('{').and_then(|rest| rest.split_once('}'));
            let (word, after) = inside.ok_or_else(|| wrong("has a brace without its other"))?;
            pieces.push(match word {
                "dir" => Piece::Dir,
                "stem" => Piece::Stem,
                "ext" => Piece::Ext,
                "level" => Piece::Level,
                "ratio" => Piece::Ratio,
                "faces" => Piece::Faces,
                _ => {
                    let known = "known are {dir}, {stem}, {ext}, {level}, {ratio} and {faces}";
                    return Err(wrong(&format!("has {{{word}}}: {known}")));
                }
            });
            rest = after;
        }
        if !rest.is_empty() {
            pieces.push(Piece::Text(rest.into()));
        }
        Ok(Self(pieces))
    }

    /// Whether names differ from level to level.
    pub fn tells_levels(&self) -> bool {
        self.0.iter().any(|piece| matches!(piece, Piece::Level | Piece::Ratio | Piece::Faces))
    }

    /// The name that words make.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the pattern asks for what the budget does not say.
    pub fn name(&self, words: Words<'_>) -> Result<String> {
        let Words { dir, file, level, budget } = words;
        let (stem, ext) = split(file);
        let missing = |word: &str, option: &str| Error::Parameter(format!("{word} in a pattern needs {option}"));
        let mut name = String::new();
        for piece in &self.0 {
            match piece {
                Piece::Text(text) => name += text,
                Piece::Dir => name += dir,
                Piece::Stem => name += stem,
                Piece::Ext => name += ext,
                Piece::Level => name += &(level + 1).to_string(),
                Piece::Ratio => {
                    let ratio = budget.keep.ok_or_else(|| missing("{ratio}", "ratios"))?;
                    // As written in percent: 0.07 × 100 is 7.000000000000001.
                    name += &((ratio * 1e12).round() / 1e10).to_string();
                }
                Piece::Faces => {
                    name += &budget.faces.ok_or_else(|| missing("{faces}", "numbers of faces"))?.to_string()
                }
            }
        }
        Ok(name)
    }

    /// The pattern where none is given: the input's name, with the number of the level where there are several.
    pub fn for_levels(levels: usize) -> Self {
        let dot = || Piece::Text(".".into());
        let head = [Piece::Dir, Piece::Text("/".into()), Piece::Stem];
        let level = if levels > 1 { vec![Piece::Text("-".into()), Piece::Level] } else { Vec::new() };
        Self(head.into_iter().chain(level).chain([dot(), Piece::Ext]).collect())
    }

    /// The name of level `level`, counted from 0, of the input called `name`.
    ///
    /// # Errors
    /// [`Error::Parameter`] where the pattern asks for what `budget` does not say.
    pub(super) fn fill(&self, name: &str, level: usize, budget: &Budget) -> Result<String> {
        let (dir, file) = name.rsplit_once('/').unwrap_or(("", name));
        let filled = self.name(Words { dir, file, level, budget })?;
        // An empty {dir} leaves its slash behind.
        let name = filled.split('/').filter(|part| !part.is_empty() && *part != ".").collect::<Vec<_>>().join("/");
        if !Path::new(&name).components().all(|part| matches!(part, Component::Normal(_))) {
            return Err(Error::Parameter(format!("the pattern makes '{name}', which leads out of the folder")));
        }
        Ok(name)
    }
}

/// The stem of a file's name and its extensions, that of the compression with that of the format.
fn split(file: &str) -> (&str, &str) {
    let Some((stem, ext)) = file.rsplit_once('.').filter(|(stem, _)| !stem.is_empty()) else {
        return (file, "ply");
    };
    match stem.rsplit_once('.') {
        Some((inner, _)) if matches!(ext.to_ascii_lowercase().as_str(), "gz" | "zst") && !inner.is_empty() => {
            (inner, &file[inner.len() + 1..])
        }
        _ => (stem, ext),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_filled_in() {
        let fill = |pattern: &str, name: &str, budget: Budget| {
            Pattern::new(pattern).and_then(|pattern| pattern.fill(name, 1, &budget)).map_err(|error| error.to_string())
        };
        let ok = |text: &str| Ok(text.to_string());
        let tenth = Budget::keep(0.1);
        assert_eq!(fill("{dir}/{stem}-{level}.{ext}", "a/b/x.ply.gz", tenth), ok("a/b/x-2.ply.gz"));
        assert_eq!(fill("{dir}/{stem}-{level}.{ext}", "x.v2.obj", tenth), ok("x.v2-2.obj"));
        assert_eq!(fill("lod{level}/{stem}_{ratio}.stl", "part@5k", tenth), ok("lod2/part@5k_10.stl"));
        assert_eq!(fill("{stem}_{ratio}.{ext}", "part@5k", Budget::keep(0.07)), ok("part@5k_7.ply"));
        assert_eq!(fill("{stem}_{ratio}.{ext}", "x.off", Budget::keep(0.0005)), ok("x_0.05.off"));
        assert_eq!(fill("{stem}_{faces}.{ext}", "x.off", Budget::faces(500)), ok("x_500.off"));
        assert!(fill("{stem}_{faces}.{ext}", "x.off", tenth).is_err());
        assert!(fill("{ratio}.ply", "x.off", Budget::faces(500)).is_err());
        assert!(fill(".{dir}./x.ply", "x.off", tenth).is_err_and(|error| error.contains("out of the folder")));
        for wrong in ["", "{stem", "stem}.ply", "{name}.ply", "/x.ply", "../{stem}.ply", "a/../../x.ply"] {
            assert!(Pattern::new(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn without_a_pattern_levels_are_numbered_where_there_are_several() {
        let fill = |levels| Pattern::for_levels(levels).fill("a/x.ply", 0, &Budget::keep(0.5)).ok();
        assert_eq!((fill(1).as_deref(), fill(3).as_deref()), (Some("a/x.ply"), Some("a/x-1.ply")));
    }
}
