//! How many faces a file holds and how much memory they take: told by its size before it is read, by its faces after.

use std::path::Path;

use super::input::{Input, Origin};
use crate::formats::{Compression, FileSize, Format};
use crate::mesh::samples::{SAMPLES, parse_sample};
pub use crate::out_of_core::{BYTES_ALWAYS, bytes_needed, bytes_of_levels};

/// The faces of an input as far as its size tells.
pub(super) fn faces(input: &Input) -> u64 {
    match &input.origin {
        Origin::File(path) => faces_of_file(path, input.size, usual_bytes),
        Origin::Sample(text) => faces_of_sample(text),
    }
}

/// The most faces that an input may well have: what memory is kept free for until it is read.
pub(super) fn most_faces(input: &Input) -> u64 {
    match &input.origin {
        Origin::File(path) => faces_of_file(path, input.size, least_bytes),
        Origin::Sample(text) => faces_of_sample(text),
    }
}

/// The faces of a file as far as its size tells; none of what is no mesh.
pub fn faces_in_file(path: &Path) -> u64 {
    faces_of_file(path, FileSize::of(path), usual_bytes)
}

fn faces_of_file(path: &Path, size: FileSize, bytes_a_face: fn(Format) -> u64) -> u64 {
    let Ok((format, compression)) = Format::from_path(path) else { return 0 };
    let bytes = match (compression, size.unpacked) {
        (Compression::None, _) => size.stored,
        (_, Some(unpacked)) => unpacked,
        // Meshes shrink to a third, more where their coordinates are coarse.
        (_, None) => size.stored.saturating_mul(4),
    };
    bytes / bytes_a_face(format)
}

/// Bytes a face of a closed surface, with half a vertex: binary PLY and STL, text as programs write it.
fn usual_bytes(format: Format) -> u64 {
    match format {
        Format::Ply => 19,
        Format::Stl => 50,
        Format::Obj => 35,
        Format::Off => 32,
        // Half a vertex with a normal and texture coordinates, three short indices; text has it in base64.
        Format::Glb => 22,
        Format::Gltf => 30,
    }
}

/// Bytes a face of a file without attributes and with short numbers.
fn least_bytes(format: Format) -> u64 {
    match format {
        Format::Ply => 16,
        Format::Stl => 50,
        Format::Obj => 22,
        Format::Off => 20,
        // Positions of 12 bytes for half as many vertices, three short indices.
        Format::Glb | Format::Gltf => 12,
    }
}

fn faces_of_sample(text: &str) -> u64 {
    let known = |name: &str| SAMPLES.iter().find(|(known, ..)| *known == name).map(|&(_, faces, _)| faces);
    parse_sample(text).and_then(|(name, faces)| faces.or_else(|| known(name))).unwrap_or(0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{self, WriteOptions};
    use crate::mesh::sample;

    #[test]
    fn sizes_tell_faces() {
        let dir = tempfile::tempdir().expect("a folder");
        let mesh = sample("statue", Some(5000)).expect("a sample");
        let faces_in = mesh.faces.len() as u64;
        for name in ["x.ply", "x.stl", "x.obj", "x.off", "x.ply.gz", "x.obj.zst"] {
            let path = dir.path().join(name);
            formats::write(&mesh, &path, &WriteOptions::default()).expect("a file");
            let size = FileSize::of(&path);
            let input = Input { origin: Origin::File(path), name: name.into(), size, recipe: 0 };
            let (about, most) = (faces(&input), most_faces(&input));
            assert!((faces_in / 2..=faces_in * 3).contains(&about), "{name}: {about} faces of {faces_in}");
            assert!((faces_in..=faces_in * 5).contains(&most), "{name}: at most {most} of {faces_in}");
        }
    }

    #[test]
    fn samples_tell_theirs() {
        assert_eq!((faces_of_sample("sample:part@5k"), faces_of_sample("sample:?")), (5000, 0));
        assert!(faces_of_sample("sample:statue") > 100_000);
    }
}
