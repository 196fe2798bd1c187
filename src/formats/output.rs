//! Bytes on their way out: atomic files, compression, rows formatted by all threads.

use std::borrow::Cow;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::Compression;

/// Calls `write` with a new file beside `path`, puts it on the disk and renames it to `path`.
///
/// On an error the temporary file is removed. What exists and is no regular file is written in place.
pub(super) fn atomically(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let path = &target(path);
    match fs::metadata(path) {
        // Links that lead round in a circle.
        Err(error) if path.is_symlink() => return Err(error),
        Ok(metadata) if metadata.is_dir() => return Err(io::ErrorKind::IsADirectory.into()),
        Ok(metadata) if !metadata.is_file() => return write(&mut OpenOptions::new().write(true).open(path)?),
        _ => {}
    }
    let (mut file, temporary) = create_beside(path)?;
    let written = write(&mut file).and_then(|()| file.sync_all());
    drop(file);
    written.and_then(|()| fs::rename(&temporary, path)).inspect_err(|_| {
        // The first error is the one to tell.
        let _ = fs::remove_file(&temporary);
    })
}

/// What a path stands for where it is a link, even if nothing is there yet: a rename would put a file in the place of the link.
fn target(path: &Path) -> PathBuf {
    /// As many links in a row as systems follow.
    const MOST_LINKS: usize = 40;
    if let Ok(path) = fs::canonicalize(path) {
        return path;
    }
    let follow = |path: &PathBuf| Some(path.parent()?.join(fs::read_link(path).ok()?));
    let links = std::iter::successors(Some(path.to_path_buf()), follow);
    links.take(MOST_LINKS).last().unwrap_or_else(|| path.to_path_buf())
}

fn create_beside(path: &Path) -> io::Result<(File, PathBuf)> {
    static SERIAL: AtomicU64 = AtomicU64::new(0);
    let Some(name) = path.file_name() else { return Err(io::ErrorKind::InvalidFilename.into()) };
    let stem = temporary_stem(name);
    loop {
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
        let mut hidden = OsString::from(".");
        hidden.push(&stem);
        hidden.push(format!(".{}-{serial}.tmp", std::process::id()));
        let temporary = path.with_file_name(hidden);
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            Ok(file) => return Ok((file, temporary)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

/// Bytes of a name that its temporary file has whole. File systems take 255, some with encryption 143, numbers and dots included.
const WHOLE_STEM: usize = 96;

/// The name of a file as its temporary ones have it: if it is long the beginning, and a sum that tells it from others.
pub fn temporary_stem(name: &OsStr) -> Cow<'_, OsStr> {
    const BEGINNING: usize = WHOLE_STEM - 9;
    if name.len() <= WHOLE_STEM {
        return Cow::Borrowed(name);
    }
    let text = name.to_string_lossy();
    let mut sum = flate2::Crc::new();
    sum.update(name.as_encoded_bytes());
    let end = (0..=BEGINNING).rev().find(|&at| text.is_char_boundary(at)).unwrap_or(0);
    Cow::Owned(format!("{}~{:08x}", &text[..end], sum.sum()).into())
}

/// The [`temporary_stem`] of the file that a temporary one of [`atomically`] was to become: `x.ply` of `.x.ply.4711-0.tmp`.
pub fn stem_of_temporary(name: &str) -> Option<&str> {
    let (output, numbers) = name.strip_prefix('.')?.strip_suffix(".tmp")?.rsplit_once('.')?;
    let (process, serial) = numbers.split_once('-')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    (!output.is_empty() && is_number(process) && is_number(serial)).then_some(output)
}

/// Calls `write` with a stream that compresses into `file`, and completes it.
pub(super) fn compressed(
    file: &mut File,
    compression: Compression,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 18, file);
    match compression {
        Compression::None => write(&mut out)?,
        Compression::Gzip => {
            let mut encoder = flate2::write::GzEncoder::new(&mut out, flate2::Compression::default());
            write(&mut encoder)?;
            encoder.finish()?;
        }
        Compression::Zstd => {
            let mut encoder = zstd::stream::write::Encoder::new(&mut out, zstd::DEFAULT_COMPRESSION_LEVEL)?;
            write(&mut encoder)?;
            encoder.finish()?;
        }
    }
    out.flush()
}

/// Rows a thread formats at a time; about half a megabyte of text.
const CHUNK_ROWS: usize = 1 << 14;
/// Chunks in memory at a time.
const BATCH_CHUNKS: usize = 32;

/// Writes rows `0..count`, which `format` appends to a buffer; the bytes do not depend on the number of threads.
pub(super) fn rows(out: &mut dyn Write, count: usize, format: impl Fn(usize, &mut Vec<u8>) + Sync) -> io::Result<()> {
    let chunk = |rows: Range<usize>| {
        let mut buffer = Vec::new();
        for row in rows {
            format(row, &mut buffer);
        }
        buffer
    };
    for start in (0..count).step_by(CHUNK_ROWS * BATCH_CHUNKS) {
        let end = count.min(start + CHUNK_ROWS * BATCH_CHUNKS);
        let buffers: Vec<Vec<u8>> = (0..(end - start).div_ceil(CHUNK_ROWS))
            .into_par_iter()
            .map(|i| chunk(start + i * CHUNK_ROWS..end.min(start + (i + 1) * CHUNK_ROWS)))
            .collect();
        for buffer in buffers {
            out.write_all(&buffer)?;
        }
    }
    Ok(())
}

/// Appends a whole number.
pub(super) fn push_integer(buffer: &mut Vec<u8>, mut value: u32) {
    let mut digits = [0; 10];
    let mut start = digits.len();
    loop {
        start -= 1;
        digits[start] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    buffer.extend_from_slice(&digits[start..]);
}

/// Appends the shortest text that reads back as `value`, which must be finite.
pub(super) fn push_float<F: zmij::Float>(buffer: &mut Vec<u8>, value: F) {
    let mut digits = zmij::Buffer::new();
    let text = digits.format_finite(value);
    buffer.extend_from_slice(text.strip_suffix(".0").unwrap_or(text).as_bytes());
}

/// Appends `values`, each after a space.
pub(super) fn push_floats<F: zmij::Float + Copy>(buffer: &mut Vec<u8>, values: &[F]) {
    for &value in values {
        buffer.push(b' ');
        push_float(buffer, value);
    }
}

/// Appends channels of a color, each after a space.
pub(super) fn push_channels(buffer: &mut Vec<u8>, channels: &[u8]) {
    for &channel in channels {
        buffer.push(b' ');
        push_integer(buffer, u32::from(channel));
    }
}

/// Appends `3 a b c` for a triangle and so on, the same in OFF and text PLY.
pub(super) fn push_face(buffer: &mut Vec<u8>, corners: &[u32]) {
    push_integer(buffer, corners.len() as u32);
    for &corner in corners {
        buffer.push(b' ');
        push_integer(buffer, corner);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_exact() {
        let text = |value: f64| {
            let mut buffer = Vec::new();
            push_float(&mut buffer, value);
            String::from_utf8(buffer).unwrap()
        };
        assert_eq!([text(1.0), text(-0.5), text(0.1 + 0.2), text(-0.0)], ["1", "-0.5", "0.30000000000000004", "-0"]);
        for value in [f64::MIN_POSITIVE, f64::MAX, 5e-324, 1e21, 123_456_789.125] {
            assert_eq!(text(value).parse(), Ok(value));
        }
        let mut buffer = Vec::new();
        for value in [0, 9, 10, u32::MAX] {
            push_integer(&mut buffer, value);
            buffer.push(b' ');
        }
        assert_eq!(buffer, b"0 9 10 4294967295 ");
    }

    /// By a link beside it to another, where nothing is there yet.
    #[cfg(unix)]
    #[test]
    fn links_to_what_is_not_there_stay_links() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::os::unix::fs::symlink("inner", path("outer")).unwrap();
        std::os::unix::fs::symlink(path("new"), path("inner")).unwrap();
        atomically(&path("outer"), |file| file.write_all(b"all")).unwrap();
        assert!(["inner", "outer"].iter().all(|link| path(link).is_symlink()));
        assert_eq!((fs::read(path("new")).unwrap(), path("new").is_symlink()), (b"all".to_vec(), false));
        std::os::unix::fs::symlink("round", path("round")).unwrap();
        atomically(&path("round"), |file| file.write_all(b"all")).unwrap_err();
        assert!(path("round").is_symlink());
    }

    /// As long as file systems allow, and told apart and known again where they do not fit.
    #[test]
    fn long_names_have_temporary_files_too() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a", "é", "👪"].map(|letter| letter.repeat(251 / letter.len()) + ".off");
        for name in &names {
            let path = folder.path().join(name);
            let mut seen = Vec::new();
            atomically(&path, |_| {
                seen = fs::read_dir(folder.path())?.map(|entry| entry.unwrap().file_name()).collect();
                Ok(())
            })
            .unwrap();
            let stems = seen.iter().filter_map(|name| stem_of_temporary(name.to_str().unwrap()));
            assert_eq!(stems.collect::<Vec<_>>(), [&*temporary_stem(OsStr::new(name))]);
            fs::remove_file(path).unwrap();
        }
        let stem = |name: &str| temporary_stem(OsStr::new(name)).into_owned();
        let same_beginning = [1, 2].map(|number| stem(&format!("{}{number}.ply", "x".repeat(200))));
        assert_ne!(same_beginning[0], same_beginning[1]);
        assert!(same_beginning[0].len() == WHOLE_STEM && stem("x.ply") == "x.ply");
        assert_eq!(stem_of_temporary(".x.ply.4711-0.tmp"), Some("x.ply"));
        assert_eq!([".x.ply.4711-.tmp", "x.ply.4711-0.tmp", "..1-1.tmp"].map(stem_of_temporary), [None; 3]);
    }

    #[test]
    fn rows_come_in_order_whatever_the_threads() {
        let count = CHUNK_ROWS * BATCH_CHUNKS + CHUNK_ROWS + 3;
        let text = |threads| {
            let mut out = Vec::new();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rows(&mut out, count, |row, buffer| push_integer(buffer, row as u32 % 10))).unwrap();
            out
        };
        let one = text(1);
        assert_eq!(one.len(), count);
        assert!(one.iter().enumerate().all(|(row, &digit)| usize::from(digit - b'0') == row % 10));
        assert_eq!(one, text(3));
    }
}
