//! How large a file is, and how large its content, before it is read.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use super::{Compression, Format};

/// Bytes that tell the size of a zstd frame's content.
const ZSTD_HEAD: u64 = 18;
/// No stream of deflate is more times as long when it is unpacked.
const MOST_DEFLATED: u64 = 1032;

/// The size of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FileSize {
    /// Bytes on the disk.
    pub stored: u64,
    /// Bytes of what a compressed file holds, as far as it tells. Of several members or frames that is one's size, and no
    /// promise: whoever unpacks must count.
    pub unpacked: Option<u64>,
}

impl FileSize {
    /// The size of the file at `path`; nothing is told of one that is not there or is no file.
    pub fn of(path: &Path) -> Self {
        let open = || -> io::Result<(File, u64)> {
            let file = File::open(path)?;
            let metadata = file.metadata()?;
            Ok((file, if metadata.is_file() { metadata.len() } else { 0 }))
        };
        let compression = Format::from_path(path).map_or(Compression::None, |(_, compression)| compression);
        match open() {
            Ok((mut file, stored)) => {
                let unpacked = unpacked(&mut file, stored, compression).ok().flatten();
                Self { stored, unpacked: unpacked.filter(|&bytes| bytes >= stored) }
            }
            Err(_) => Self::default(),
        }
    }

    /// The bytes that a file takes at least while it is read, its mesh included, which is smaller than one and a half times
    /// the content in every format.
    pub fn bytes_to_read(self) -> u64 {
        match self.unpacked {
            Some(unpacked) => (unpacked.saturating_mul(5) / 2).saturating_add(self.stored),
            None => self.stored.saturating_mul(5) / 2,
        }
    }
}

/// The size of the content that a compressed file tells.
fn unpacked(file: &mut File, stored: u64, compression: Compression) -> io::Result<Option<u64>> {
    match compression {
        Compression::None => Ok(None),
        // The last four bytes of a member: its size, less multiples of 4 GiB.
        Compression::Gzip => {
            let mut size = [0; 4];
            file.seek(SeekFrom::End(-(size.len() as i64)))?;
            file.read_exact(&mut size)?;
            let size = u64::from(u32::from_le_bytes(size));
            Ok((size <= stored.saturating_mul(MOST_DEFLATED)).then_some(size))
        }
        Compression::Zstd => {
            let mut head = Vec::new();
            file.take(ZSTD_HEAD).read_to_end(&mut head)?;
            Ok(zstd::zstd_safe::get_frame_content_size(&head).ok().flatten())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn compressed_files_tell_the_size_of_their_content() {
        let dir = tempfile::tempdir().expect("a folder");
        let content = b"v 0 0 0\n".repeat(1000);
        let size_of = |name: &str, bytes: &[u8]| {
            let path = dir.path().join(name);
            std::fs::write(&path, bytes).expect("a file");
            FileSize::of(&path)
        };
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packer.write_all(&content).expect("packed");
        let mut packed = packer.finish().expect("packed");
        let stored = packed.len() as u64;
        let size = size_of("a.obj.gz", &packed);
        assert_eq!(size, FileSize { stored, unpacked: Some(8000) });
        assert_eq!(size.bytes_to_read(), 20_000 + stored);
        packed.extend([0xff; 4]);
        assert_eq!(size_of("b.obj.gz", &packed).unpacked, None);
        assert_eq!(size_of("c.obj.gz", b"x"), FileSize { stored: 1, unpacked: None });

        let told = zstd::bulk::compress(&content, 3).expect("packed");
        assert_eq!(size_of("a.obj.zst", &told).unpacked, Some(8000));
        // A stream does not know its size when it begins.
        let untold = zstd::stream::encode_all(&content[..], 3).expect("packed");
        assert_eq!(size_of("b.obj.zst", &untold).unpacked, None);
        assert_eq!(size_of("a.obj", &content), FileSize { stored: 8000, unpacked: None });
        assert_eq!(FileSize::of(&dir.path().join("none.obj")), FileSize::default());
    }
}
