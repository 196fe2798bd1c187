//! What faces are made of and belong to: `usemtl`, `g`, `o`; where materials are described: `mtllib`; and what is no face.

use rustc_hash::FxHashMap;

use super::Libraries;
use crate::formats::text;
use crate::mesh::Materials;

/// The statements that hold until the next of their kind.
pub(super) const KEYWORDS: [&[u8]; 4] = [b"usemtl", b"g", b"o", b"mtllib"];

/// Elements that are no faces, and what they are.
const SKIPPED: [(&[u8], &str); 5] =
    [(b"p", "points"), (b"l", "lines"), (b"curv", "curves"), (b"curv2", "curves"), (b"surf", "free-form surfaces")];

/// What such an element is.
pub(super) fn skipped(keyword: &[u8]) -> Option<&'static str> {
    SKIPPED.iter().find(|(known, _)| *known == keyword).map(|(_, what)| *what)
}

/// Materials and groups of faces, as they come.
///
/// A face's material is named by up to three lines: the name behind `usemtl`, then `o …` and `g …` where the face has them.
#[derive(Debug, Default)]
pub(super) struct Groups {
    libraries: Libraries,
    /// The names behind `usemtl`, `g`, `o` in force.
    current: [String; 3],
    /// The number of the current name, once a face has it.
    number: Option<u32>,
    numbers: FxHashMap<String, u32>,
    names: Vec<String>,
    of_face: Vec<u32>,
    is_told: bool,
}

impl Groups {
    /// Notes elements that are passed over.
    pub(super) fn skip(&mut self, what: &'static str) {
        if !self.libraries.skipped.contains(&what) {
            self.libraries.skipped.push(what);
        }
    }

    /// A statement of [`KEYWORDS`], or an element that is noted; others are passed over.
    pub(super) fn statement(&mut self, keyword: &[u8], name: &[u8]) {
        let Some(kind) = KEYWORDS.iter().position(|known| *known == keyword) else {
            return skipped(keyword).into_iter().for_each(|what| self.skip(what));
        };
        let bytes = name.trim_ascii();
        let name = text::name(bytes);
        self.libraries.in_latin1 |= name.as_bytes() != bytes;
        match kind {
            3 => self.libraries.names.push(name.into()),
            kind => {
                self.is_told = true;
                if self.current[kind] != name {
                    self.current[kind] = name.into();
                    self.number = None;
                }
            }
        }
    }

    /// The next triangles.
    pub(super) fn faces(&mut self, count: usize) {
        if count == 0 {
            return;
        }
        let number = match self.number {
            Some(number) => number,
            None => {
                let name = name(&self.current);
                let next = self.names.len() as u32;
                *self.numbers.entry(name.clone()).or_insert_with(|| {
                    self.names.push(name);
                    next
                })
            }
        };
        self.number = Some(number);
        self.of_face.resize(self.of_face.len() + count, number);
    }

    /// The libraries, and the materials where any are told.
    pub(super) fn finish(self) -> (Libraries, Option<Materials>) {
        let materials = Materials { of_face: self.of_face, names: self.names };
        (self.libraries, self.is_told.then_some(materials))
    }
}

fn name([material, group, object]: &[String; 3]) -> String {
    let mut name = material.clone();
    for (keyword, text) in [("o", object), ("g", group)] {
        if !text.is_empty() {
            name.push_str(&format!("\n{keyword} {text}"));
        }
    }
    name
}

/// The object that faces of this name belong to, or the group where none is told; empty without either.
pub(in crate::formats) fn object_of(name: &str) -> &str {
    let line = |keyword: &str| name.lines().skip(1).find_map(|line| line.strip_prefix(keyword));
    line("o ").or_else(|| line("g ")).unwrap_or_default()
}

/// The name of faces of a material in an object, which may be none.
pub(in crate::formats) fn in_object(material: &str, object: &str) -> String {
    if object.is_empty() { material.into() } else { format!("{material}\no {object}") }
}

/// The statements that lead from faces of one name to faces of another.
pub(super) fn statements(before: Option<&str>, after: &str) -> String {
    let parts = |name: &str| {
        let line = |keyword: &str| {
            let named = name.lines().skip(1).find_map(|line| line.strip_prefix(keyword)?.strip_prefix(' '));
            named.unwrap_or_default().to_string()
        };
        [("o", line("o")), ("g", line("g")), ("usemtl", name.lines().next().unwrap_or_default().to_string())]
    };
    let before = before.map_or_else(|| parts(""), parts);
    let changed = parts(after).into_iter().zip(before).filter(|(after, before)| after != before);
    changed.map(|((keyword, name), _)| format!("{keyword} {name}").trim_end().to_string() + "\n").collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_that_are_no_faces_are_told_once() {
        let mut groups = Groups::default();
        [&b"l"[..], b"p", b"l", b"s", b"surf"].iter().for_each(|keyword| groups.statement(keyword, b" 1 2\xff"));
        let (libraries, materials) = groups.finish();
        assert_eq!((libraries.skipped, materials), (vec!["lines", "points", "free-form surfaces"], None));
        assert!(!libraries.in_latin1);
    }

    #[test]
    fn names_lead_back_to_statements() {
        let mut groups = Groups::default();
        let told: [(&[u8], &[u8]); 5] =
            [(b"mtllib", b" a b.mtl "), (b"o", b"car"), (b"usemtl", b" red #2"), (b"s", b"1"), (b"g", b"door left")];
        groups.faces(1);
        told.iter().for_each(|(keyword, name)| groups.statement(keyword, name));
        groups.faces(2);
        groups.statement(b"g", b"");
        groups.faces(1);
        groups.statement(b"g", b"door left");
        groups.faces(1);
        let (libraries, materials) = groups.finish();
        let materials = materials.expect("some");
        assert!(libraries.skipped.is_empty());
        assert_eq!((libraries.names, &materials.of_face), (vec!["a b.mtl".to_string()], &vec![0, 1, 1, 2, 1]));
        assert!(!libraries.in_latin1);
        assert_eq!(materials.names, ["", "red #2\no car\ng door left", "red #2\no car"]);
        assert_eq!(materials.names.iter().map(|name| object_of(name)).collect::<Vec<_>>(), ["", "car", "car"]);
        assert_eq!((object_of("red\ng door"), object_of("o red")), ("door", ""));
        assert_eq!((object_of(&in_object("red", "car")), in_object("red", "")), ("car", "red".to_string()));
        assert_eq!(statements(None, &materials.names[1]), "o car\ng door left\nusemtl red #2\n");
        assert_eq!(statements(Some(&materials.names[1]), &materials.names[2]), "g\n");
        assert_eq!(statements(Some(&materials.names[2]), ""), "o\nusemtl\n");
    }
}
