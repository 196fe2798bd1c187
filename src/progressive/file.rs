//! Logs in files.
//!
//! Little-endian, without gaps:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `COLLAPSE` |
//! | 4 | version, 1 |
//! | 4 | flags: 1 for normals, 2 for colors; no other |
//! | 8, 8 | vertices and faces of the mesh |
//! | 8 | its hash |
//! | 8, 8, 8, 8 | J vertices that were joined, D faces that were dropped, C contractions, K cancelled faces |
//! | 8 J | for each the vertex and the one it was joined to, or 2³² − 1 |
//! | 4 D | the faces |
//! | 32 C | for each contraction the vertex that keeps its name, the one that is gone, and x, y, z in `f64` |
//! | 8 K | for each the number of its contraction and the face |
//! | 12 C | with normals: x, y, z in `f32` |
//! | 16 C | with colors: red, green, blue, alpha in `f32` |
//! | 8 | the sum of all bytes before |

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use super::sum;
use super::{CollapseLog, Contraction, Identity, NAME};
use crate::error::{Error, Place, Result};
use crate::formats;
use crate::math::{DVec3, Vec3};

const MAGIC: &[u8; 8] = b"COLLAPSE";
const VERSION: u32 = 1;
const NORMALS: u32 = 1;
const COLORS: u32 = 2;
const HEADER_LEN: usize = 72;
const SUM_LEN: u64 = 8;

/// What the first bytes say.
struct Header {
    flags: u32,
    identity: Identity,
    joined: u64,
    dropped_faces: u64,
    contractions: u64,
    cancelled: u64,
}

impl CollapseLog {
    /// Writes it to `path`; the file appears whole or not at all.
    ///
    /// # Errors
    /// [`Error::Write`] with the path when the system refuses; then a file already there is untouched.
    pub fn write(&self, path: &Path) -> Result<()> {
        formats::write_file(path, &self.to_bytes())
    }

    /// Reads the log at `path`.
    ///
    /// # Errors
    /// [`Error::Read`] when the system cannot open or read the file, [`Error::Format`] when it is no log, or one that is
    /// cut, changed or of another version.
    pub fn read(path: &Path) -> Result<Self> {
        let failed = |source| Error::Read { path: path.to_path_buf(), source };
        let mut file = File::open(path).map_err(failed)?;
        let mut bytes = Vec::with_capacity(HEADER_LEN);
        file.by_ref().take(HEADER_LEN as u64).read_to_end(&mut bytes).map_err(failed)?;
        // Nothing more of a large file that is no log.
        let len = Header::read(&bytes)?.file_len();
        let rest: io::Result<usize> = file.take(len - HEADER_LEN as u64 + 1).read_to_end(&mut bytes);
        rest.map_err(failed)?;
        Self::from_bytes(&bytes)
    }

    /// The content of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header::of(self);
        let mut bytes = Vec::with_capacity(header.file_len() as usize);
        header.write(&mut bytes);
        let mut put = |number: &[u8]| bytes.extend_from_slice(number);
        self.joined.as_flattened().iter().chain(&self.dropped_faces).for_each(|v| put(&v.to_le_bytes()));
        for &Contraction { keep, gone, position } in &self.contractions {
            put(&keep.to_le_bytes());
            put(&gone.to_le_bytes());
            position.to_array().iter().for_each(|x| put(&x.to_le_bytes()));
        }
        self.cancelled.as_flattened().iter().for_each(|v| put(&v.to_le_bytes()));
        for normal in self.normals.iter().flatten() {
            normal.to_array().iter().for_each(|x| put(&x.to_le_bytes()));
        }
        self.colors.iter().flatten().flatten().for_each(|x| put(&x.to_le_bytes()));
        let sum = sum::of_bytes(&bytes);
        bytes.extend_from_slice(&sum.to_le_bytes());
        bytes
    }

    /// Reads the content of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read), without those of the system. Whether the rows fit a mesh is found by
    /// [`Replay::new`](super::Replay::new).
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let header = Header::read(bytes)?;
        // Before any memory is taken: counts are believed as far as there are bytes.
        let (found, expected) = (bytes.len() as u64, header.file_len());
        if found != expected {
            let message = match found < expected {
                true => format!("the file ends here, expected {expected} bytes in all"),
                false => format!("more follows, expected {expected} bytes in all"),
            };
            return Err(wrong(found.min(expected), message));
        }
        let (content, sum) = bytes.split_at(bytes.len() - SUM_LEN as usize);
        if sum != sum::of_bytes(content).to_le_bytes() {
            return Err(wrong(content.len() as u64, "the sum of the bytes is another: the file is damaged"));
        }
        let mut rest = Rest(&content[HEADER_LEN..]);
        Ok(Self {
            identity: header.identity,
            joined: rest.rows(header.joined, Rest::integers),
            dropped_faces: rest.rows(header.dropped_faces, |rest| u32::from_le_bytes(rest.array())),
            contractions: rest.rows(header.contractions, |rest| {
                let [keep, gone] = rest.integers();
                let position = [rest.array(), rest.array(), rest.array()].map(f64::from_le_bytes);
                Contraction { keep, gone, position: DVec3::from(position) }
            }),
            cancelled: rest.rows(header.cancelled, Rest::integers),
            normals: (header.flags & NORMALS != 0)
                .then(|| rest.rows(header.contractions, |rest| Vec3::from(rest.integers().map(f32::from_bits)))),
            colors: (header.flags & COLORS != 0)
                .then(|| rest.rows(header.contractions, |rest| rest.integers().map(f32::from_bits))),
        })
    }
}

impl Header {
    fn of(log: &CollapseLog) -> Self {
        Self {
            flags: if log.normals.is_some() { NORMALS } else { 0 } | if log.colors.is_some() { COLORS } else { 0 },
            identity: log.identity,
            joined: log.joined.len() as u64,
            dropped_faces: log.dropped_faces.len() as u64,
            contractions: log.contractions.len() as u64,
            cancelled: log.cancelled.len() as u64,
        }
    }

    fn write(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(MAGIC);
        bytes.extend_from_slice(&VERSION.to_le_bytes());
        bytes.extend_from_slice(&self.flags.to_le_bytes());
        let Identity { vertices, faces, hash } = self.identity;
        let counts = [self.joined, self.dropped_faces, self.contractions, self.cancelled];
        for number in [vertices.into(), faces.into(), hash].into_iter().chain(counts) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
    }

    fn read(bytes: &[u8]) -> Result<Self> {
        if !bytes.starts_with(MAGIC) {
            return Err(wrong(
                0,
                "found something else, expected 'COLLAPSE', as `coarsen simplify --write-log` writes",
            ));
        }
        if bytes.len() < HEADER_LEN {
            return Err(wrong(
                bytes.len() as u64,
                format!("the file ends here, expected {HEADER_LEN} bytes of header"),
            ));
        }
        let mut rest = Rest(&bytes[MAGIC.len()..]);
        let [version, flags] = rest.integers();
        if version != VERSION {
            return Err(wrong(8, format!("version {version}, expected {VERSION}: written by another program version")));
        }
        if flags & !(NORMALS | COLORS) != 0 {
            return Err(wrong(12, format!("unknown flags {flags:#x}")));
        }
        let [vertices, faces, hash, joined, dropped_faces, contractions, cancelled] =
            std::array::from_fn(|_| u64::from_le_bytes(rest.array()));
        let limit = u64::from(u32::MAX);
        // A vertex is joined or contracted once, a face dropped once.
        let fits = vertices <= limit / 2
            && faces <= limit / 3
            && dropped_faces.checked_add(cancelled).is_some_and(|gone| gone <= faces)
            && joined.checked_add(contractions).is_some_and(|used| used <= vertices);
        if !fits {
            let counts = format!("{joined} joined and {contractions} contracted of {vertices} vertices");
            return Err(wrong(
                16,
                format!(
                    "impossible counts: {counts}, {dropped_faces} dropped and {cancelled} cancelled of {faces} faces"
                ),
            ));
        }
        let identity = Identity { vertices: vertices as u32, faces: faces as u32, hash };
        Ok(Self { flags, identity, joined, dropped_faces, contractions, cancelled })
    }

    /// The length of the whole file; counts below 2³² cannot overflow it.
    fn file_len(&self) -> u64 {
        let carried = if self.flags & NORMALS != 0 { 12 } else { 0 } + if self.flags & COLORS != 0 { 16 } else { 0 };
        let rows = 8 * self.joined + 4 * self.dropped_faces + 8 * self.cancelled + (32 + carried) * self.contractions;
        HEADER_LEN as u64 + rows + SUM_LEN
    }
}

/// Bytes yet to be read; their number is checked before, and what is missing would read as zero.
struct Rest<'a>(&'a [u8]);

impl Rest<'_> {
    fn array<const N: usize>(&mut self) -> [u8; N] {
        let Some((&array, rest)) = self.0.split_first_chunk() else { return [0; N] };
        self.0 = rest;
        array
    }

    fn integers<const N: usize>(&mut self) -> [u32; N] {
        std::array::from_fn(|_| u32::from_le_bytes(self.array()))
    }

    fn rows<T>(&mut self, count: u64, mut read: impl FnMut(&mut Self) -> T) -> Vec<T> {
        (0..count).map(|_| read(self)).collect()
    }
}

fn wrong(byte: u64, message: impl Into<String>) -> Error {
    Error::format(NAME, Place::Byte(byte), message)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log() -> CollapseLog {
        let contraction = |keep, gone| Contraction { keep, gone, position: DVec3::new(0.5, -0.0, f64::MIN_POSITIVE) };
        CollapseLog {
            identity: Identity { vertices: 9, faces: 8, hash: 7 },
            joined: vec![[4, 1], [6, u32::MAX]],
            dropped_faces: vec![0, 5],
            contractions: vec![contraction(1, 2), contraction(3, 1)],
            cancelled: vec![[1, 7]],
            normals: Some(vec![Vec3::X, Vec3::NEG_Y]),
            colors: Some(vec![[0.25; 4], [1.0, 0.5, 0.0, 1.0]]),
        }
    }

    fn message(bytes: &[u8]) -> String {
        CollapseLog::from_bytes(bytes).expect_err("a bad log").to_string()
    }

    #[test]
    fn what_is_written_is_read() {
        let full = log();
        let bare = CollapseLog { normals: None, colors: None, joined: Vec::new(), ..full.clone() };
        for log in [full, bare] {
            let bytes = log.to_bytes();
            assert_eq!(bytes.len() as u64, Header::of(&log).file_len());
            assert_eq!(CollapseLog::from_bytes(&bytes).ok(), Some(log));
        }
    }

    #[test]
    fn prefixes_and_damage_are_refused() {
        let bytes = log().to_bytes();
        for len in 0..bytes.len() {
            assert!(message(&bytes[..len]).starts_with("collapse log byte "), "{len}");
        }
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut bytes = bytes.clone();
                bytes[at] ^= 1 << bit;
                assert!(CollapseLog::from_bytes(&bytes).is_err(), "bit {bit} of byte {at}");
            }
        }
        assert!(message(&[&bytes[..], &[0]].concat()).contains("more follows"));
    }

    #[test]
    fn every_fault_is_named() {
        let with = |at: usize, number: &[u8]| {
            let mut bytes = log().to_bytes();
            bytes[at..at + number.len()].copy_from_slice(number);
            message(&bytes)
        };
        assert!(message(b"ply\nformat").contains("expected 'COLLAPSE'"));
        assert!(message(&log().to_bytes()[..20]).contains("expected 72 bytes of header"));
        assert!(with(8, &2_u32.to_le_bytes()).contains("version 2, expected 1"));
        assert!(with(12, &4_u32.to_le_bytes()).contains("unknown flags 0x4"));
        assert!(with(88, &[9]).contains("damaged"));
        // More contractions than memory or vertices: refused by the header alone.
        for count in [10, u64::from(u32::MAX), u64::MAX] {
            assert!(with(56, &count.to_le_bytes()).contains("impossible counts"), "{count}");
        }
        assert!(with(16, &u64::MAX.to_le_bytes()).contains("impossible counts"));
        let full = with(16, &1_000_000_u64.to_le_bytes());
        assert!(full.contains("damaged"), "{full}");
        let mut lying = log().to_bytes();
        lying[16..24].copy_from_slice(&2_000_000_000_u64.to_le_bytes());
        lying[56..64].copy_from_slice(&1_000_000_000_u64.to_le_bytes());
        assert!(message(&lying).contains("the file ends here, expected 60000000"), "{}", message(&lying));
    }
}
