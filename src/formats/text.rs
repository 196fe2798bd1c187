//! Rows of words and numbers, with the line they stand on.

use std::borrow::Cow;

use crate::error::{Error, Place, Result};
use crate::math::DVec3;

/// What some editors begin UTF-8 with.
pub(super) const MARK: &[u8] = b"\xef\xbb\xbf";

/// A name of a file without a word on its encoding: UTF-8, or Latin-1 where it is not, in which every byte is a character, so that
/// other names stay others.
pub(super) fn name(bytes: &[u8]) -> Cow<'_, str> {
    match str::from_utf8(bytes) {
        Ok(name) => Cow::Borrowed(name),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// The bytes of a text, in Latin-1 where that is asked for and has all of its characters, otherwise in UTF-8.
pub(super) fn encoded(text: &str, in_latin1: bool) -> Cow<'_, [u8]> {
    let latin1 = || text.chars().map(|c| u8::try_from(c).ok()).collect::<Option<Vec<u8>>>();
    in_latin1.then(latin1).flatten().map_or(Cow::Borrowed(text.as_bytes()), Cow::Owned)
}

/// The words of a line.
pub(super) fn tokens(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|token| !token.is_empty())
}

/// The bytes up to the first line end.
pub(super) fn first_line(bytes: &[u8]) -> &[u8] {
    bytes.split(|&b| b == b'\n' || b == b'\r').next().unwrap_or_default()
}

/// User text for an error message: in quotes, readable, short.
pub(super) fn quote(bytes: &[u8]) -> String {
    const GREATEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4 * GREATEST)]);
    let shown: String = text.chars().take(GREATEST).flat_map(char::escape_debug).collect();
    let more = if text.chars().count() > GREATEST { "…" } else { "" };
    format!("'{shown}{more}'")
}

/// Parses a number; infinities and NaN are numbers here.
pub(super) fn number(token: &[u8]) -> Option<f64> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// Parses a whole number of up to 18 digits.
pub(super) fn integer(token: &[u8]) -> Option<i64> {
    let (negative, digits) = match token {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    if digits.is_empty() || digits.len() > 18 || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    let value = digits.iter().fold(0, |value, digit| 10 * value + i64::from(digit - b'0'));
    Some(if negative { -value } else { value })
}

/// The lines of a text with their numbers, without their line ends.
#[derive(Debug, Clone)]
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    /// The number of the line returned last, from 1.
    pub(super) number: u64,
}

impl<'a> Lines<'a> {
    /// Starts at the first byte of line `number + 1`.
    pub(super) fn after(number: u64, rest: &'a [u8]) -> Self {
        Self { rest, number }
    }

    /// The bytes not yet read.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.rest
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = &self.rest[(end + 1).min(self.rest.len())..];
        self.number += 1;
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }
}

/// The rows of a text: its lines without blank ones and, with a comment mark, without comments.
pub(super) struct Rows<'a> {
    format: &'static str,
    lines: Lines<'a>,
    comment: Option<u8>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(format: &'static str, lines: Lines<'a>, comment: Option<u8>) -> Self {
        Self { format, lines, comment }
    }

    /// The bytes not yet read.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.lines.rest()
    }

    /// The next row.
    pub(super) fn next(&mut self) -> Option<Row<'a>> {
        for mut line in self.lines.by_ref() {
            if let Some(mark) = self.comment {
                line = line.split(|&b| b == mark).next().unwrap_or_default();
            }
            let line = line.trim_ascii();
            if !line.is_empty() {
                return Some(Row { format: self.format, line: self.lines.number, rest: line });
            }
        }
        None
    }

    /// Row `at` of `count` rows of `what`; the file may not end before it.
    pub(super) fn expect(&mut self, what: &str, at: u64, count: u64) -> Result<Row<'a>> {
        match self.next() {
            Some(row) => Ok(row),
            None => Err(self.ends(format!("the file ends after {at} of {count} {what}"))),
        }
    }

    /// Nothing but blank lines may be left.
    pub(super) fn expect_end(&mut self) -> Result<()> {
        match self.next() {
            Some(row) => Err(row.error(format!(
                "found {}, expected the end of the file after the rows that the header promises",
                quote(row.rest)
            ))),
            None => Ok(()),
        }
    }

    /// An error at the last line read.
    pub(super) fn ends(&self, message: String) -> Error {
        Error::format(self.format, Place::Line(self.lines.number.max(1)), message)
    }
}

/// The words of one line that are not read yet.
#[derive(Clone)]
pub(super) struct Row<'a> {
    format: &'static str,
    /// The line's number, from 1.
    pub(super) line: u64,
    rest: &'a [u8],
}

impl<'a> Row<'a> {
    /// An error on this line.
    pub(super) fn error(&self, message: String) -> Error {
        Error::format(self.format, Place::Line(self.line), message)
    }

    /// The next word.
    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        let line = self.rest.trim_ascii_start();
        if line.is_empty() {
            return None;
        }
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (token, rest) = line.split_at(end);
        self.rest = rest;
        Some(token)
    }

    /// How many words are left.
    pub(super) fn words(&self) -> usize {
        tokens(self.rest).count()
    }

    /// The next word, which must be there.
    pub(super) fn expect(&mut self, what: &str) -> Result<&'a [u8]> {
        match self.next() {
            Some(token) => Ok(token),
            None => Err(self.error(format!("the line ends, expected {what}"))),
        }
    }

    /// A number, which may be infinite or NaN.
    pub(super) fn number(&mut self, what: &str) -> Result<f64> {
        let token = self.expect(what)?;
        match number(token) {
            Some(value) => Ok(value),
            None => Err(self.error(format!("found {}, expected {what}, a number", quote(token)))),
        }
    }

    /// A finite number.
    pub(super) fn finite(&mut self, what: &str) -> Result<f64> {
        let mut word = self.clone();
        let value = self.number(what)?;
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.error(format!("found {}, expected {what}, a finite number", quote(word.expect(what)?))))
    }

    /// Three finite coordinates.
    pub(super) fn point(&mut self) -> Result<DVec3> {
        Ok(DVec3::new(self.finite("x")?, self.finite("y")?, self.finite("z")?))
    }

    /// A whole number that is not negative.
    pub(super) fn count(&mut self, what: &str) -> Result<u64> {
        let token = self.expect(what)?;
        match integer(token).and_then(|value| u64::try_from(value).ok()) {
            Some(value) => Ok(value),
            None => Err(self.error(format!("found {}, expected {what}", quote(token)))),
        }
    }

    /// A vertex index, counted from 0, below `vertex_count`.
    pub(super) fn index(&mut self, vertex_count: usize) -> Result<u32> {
        let token = self.expect("a vertex index")?;
        match integer(token).and_then(|value| u32::try_from(value).ok()) {
            Some(index) if (index as usize) < vertex_count => Ok(index),
            _ => Err(self.error(format!(
                "found {}, expected a vertex index from 0 to {}",
                quote(token),
                vertex_count as i64 - 1
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers() {
        for (token, value) in [("0", Some(0)), ("-17", Some(-17)), ("+4", Some(4)), ("", None), ("-", None)] {
            assert_eq!(integer(token.as_bytes()), value, "{token}");
        }
        assert_eq!(integer(b"1.0"), None);
        assert_eq!(integer(b"9999999999999999999"), None);
        assert_eq!(integer(b"999999999999999999"), Some(999_999_999_999_999_999));
    }

    #[test]
    fn rows_skip_comments_and_count_lines() {
        let mut rows = Rows::new("OFF", Lines::after(0, b"# a\r\n\n 1 2 # b\r\n#\n3"), Some(b'#'));
        let mut row = rows.next().unwrap();
        assert_eq!((row.line, row.next(), row.next(), row.next()), (3, Some(b"1" as _), Some(b"2" as _), None));
        assert_eq!(rows.next().map(|row| row.line), Some(5));
        assert!(rows.next().is_none());
        assert_eq!(
            rows.expect("faces", 1, 2).err().unwrap().to_string(),
            "OFF line 5: the file ends after 1 of 2 faces"
        );
    }

    #[test]
    fn messages_quote_what_was_found() {
        let mut rows = Rows::new("OFF", Lines::after(6, b"0 nan 1"), None);
        assert_eq!(
            rows.next().unwrap().point().unwrap_err().to_string(),
            "OFF line 7: found 'nan', expected y, a finite number"
        );
        assert_eq!(quote(&[b'a'; 100]), format!("'{}…'", "a".repeat(40)));
        assert_eq!(quote(b"a\x07\xff"), "'a\\u{7}\u{fffd}'");
    }
}
