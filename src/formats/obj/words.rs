//! Words of plain OBJ text, and the indices among them.

use crate::formats::text::{integer, number};

/// The mark of a corner without an index.
pub(super) const NONE: u32 = u32::MAX;

/// Indices of one kind, from 0, for each corner up to the last that has one.
#[derive(Default)]
pub(super) struct Indices {
    pub(super) values: Vec<u32>,
    /// Corners with an index that counts back from where it stands, and that index from the start of the chunk.
    relative: Vec<(usize, i64)>,
}

impl Indices {
    /// Adds the index that is written at corner `at`, if there is one, after `seen` rows of this chunk.
    pub(super) fn push(&mut self, at: usize, written: &[u8], seen: usize) -> Option<()> {
        if written.is_empty() {
            return Some(());
        }
        self.values.resize(at, NONE);
        match integer(written)? {
            0 => return None,
            index if index < 0 => {
                self.relative.push((at, seen as i64 + index));
                self.values.push(NONE);
            }
            index => self.values.push(u32::try_from(index - 1).ok().filter(|&index| index != NONE)?),
        }
        Some(())
    }

    /// Replaces relative indices, of a chunk that comes after `before` rows of `total`; `None` when one is out of range.
    pub(super) fn resolve(&mut self, before: usize, total: usize) -> Option<()> {
        for &(at, index) in &self.relative {
            self.values[at] = u32::try_from(before as i64 + index).ok()?;
        }
        self.values.iter().all(|&index| index == NONE || (index as usize) < total).then_some(())
    }

    pub(super) fn at(&self, corner: usize) -> Option<u32> {
        self.values.get(corner).copied().filter(|&index| index != NONE)
    }

    pub(super) fn has_any(&self) -> bool {
        !self.values.is_empty()
    }
}

/// The words of several lines.
pub(super) struct Words<'a> {
    pub(super) rest: &'a [u8],
}

impl<'a> Words<'a> {
    /// The next word on this line before a comment.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|&b| b == b'\n' || !b.is_ascii_whitespace())?;
        self.rest = &self.rest[start..];
        let end = self.rest.iter().position(|&b| b == b'#' || b.is_ascii_whitespace()).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// The numbers up to the end of the line, zeros after them, and how many there are; at most `N`.
    pub(super) fn numbers<const N: usize>(&mut self) -> Option<([f64; N], usize)> {
        let mut values = [0.0; N];
        let mut count = 0;
        while let Some(word) = self.next() {
            *values.get_mut(count)? = number(word)?;
            count += 1;
        }
        Some((values, count))
    }

    /// What stands on this line behind a word that ended at a space, comments too: names may have any letter.
    pub(super) fn name(&self) -> &'a [u8] {
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        if self.rest.starts_with(b"#") { b"" } else { &self.rest[..end] }
    }

    pub(super) fn skip_line(&mut self) {
        let end = self.rest.iter().position(|&b| b == b'\n').map_or(self.rest.len(), |at| at + 1);
        self.rest = &self.rest[end..];
    }
}
