//! Files that hold what does not fit the memory, and that no end of the program leaves behind.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// A folder for such files.
#[derive(Debug, Clone, Copy)]
pub struct Scratch<'a>(pub &'a Path);

impl Scratch<'_> {
    /// A new file to write and read. Its name is gone when this returns: the system frees it when the program ends, however.
    ///
    /// # Errors
    /// [`Error::Write`] when the system refuses.
    pub fn file(self) -> Result<ScratchFile> {
        static SERIAL: AtomicU64 = AtomicU64::new(0);
        loop {
            let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
            let path = self.0.join(format!(".coarsen-{}-{serial}.part", std::process::id()));
            match OpenOptions::new().read(true).write(true).create_new(true).open(&path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                opened => {
                    let nameless = opened.and_then(|file| fs::remove_file(&path).map(|()| file));
                    let file = nameless.map_err(|source| Error::Write { path: self.0.into(), source })?;
                    return Ok(ScratchFile { folder: self.0.into(), file });
                }
            }
        }
    }
}

/// A file without a name.
#[derive(Debug)]
pub struct ScratchFile {
    pub folder: PathBuf,
    pub file: File,
}

impl ScratchFile {
    /// Appends `bytes` where the file's cursor is, and empties them.
    ///
    /// # Errors
    /// [`Error::Write`] names the folder, whose disk may be full.
    pub fn write(&self, bytes: &mut Vec<u8>) -> Result<()> {
        let written = (&self.file).write_all(bytes);
        bytes.clear();
        written.map_err(|source| Error::Write { path: self.folder.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Seek};

    use super::*;

    #[test]
    fn files_hold_bytes_and_have_no_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let scratch = Scratch(folder.path()).file().expect("a file");
        scratch.write(&mut b"some bytes".to_vec()).expect("room");
        assert_eq!(fs::read_dir(folder.path()).expect("the folder").count(), 0);
        let mut text = String::new();
        (&scratch.file).rewind().and_then(|()| (&scratch.file).read_to_string(&mut text)).expect("the bytes");
        assert_eq!(text, "some bytes");
        assert!(matches!(Scratch(&folder.path().join("missing")).file(), Err(Error::Write { .. })));
    }
}
