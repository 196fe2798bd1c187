//! Reads binary and text STL.

use rayon::prelude::*;

use super::join::Joiner;
use super::{FACET_BYTES, FORMAT, HEADER_BYTES};
use crate::error::{Error, Place, Result};
use crate::formats::text::{Lines, Row, Rows, quote};
use crate::math::DVec3;
use crate::mesh::Mesh;
use crate::mesh::key_table::distinct;

/// Reads either form.
pub(in crate::formats) fn read(bytes: &[u8]) -> Result<Mesh> {
    let starts_as_text = bytes.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // No text holds a zero byte: a binary file that was cut short may start with "solid" too.
    let is_text = starts_as_text && !bytes.contains(&0);
    if is_binary(bytes) || !is_text { read_binary(bytes) } else { read_text(bytes) }
}

/// Whether the length is exactly what the facet count of a binary header asks for.
pub(in crate::formats) fn is_binary(bytes: &[u8]) -> bool {
    facet_count(bytes).is_some_and(|count| expected_bytes(count) == bytes.len() as u64)
}

/// Whether a binary file has anything in the two bytes that each facet ends with.
pub(in crate::formats) fn has_more(bytes: &[u8]) -> bool {
    let facets = if is_binary(bytes) { bytes.get(HEADER_BYTES..).unwrap_or_default() } else { &[] };
    facets.par_chunks(PIECE_FACETS * FACET_BYTES).any(|piece| {
        piece.chunks_exact(FACET_BYTES).fold(0, |all, facet| all | facet[FACET_BYTES - 2] | facet[FACET_BYTES - 1]) != 0
    })
}

fn facet_count(bytes: &[u8]) -> Option<u32> {
    let field = bytes.get(HEADER_BYTES - 4..HEADER_BYTES)?;
    Some(u32::from_le_bytes(field.try_into().ok()?))
}

pub(super) fn expected_bytes(facet_count: u32) -> u64 {
    HEADER_BYTES as u64 + FACET_BYTES as u64 * u64::from(facet_count)
}

fn read_binary(bytes: &[u8]) -> Result<Mesh> {
    let error = |place, message| Err(Error::format(FORMAT, place, message));
    let Some(count) = facet_count(bytes) else {
        let message = format!("found {} bytes, expected a header of {HEADER_BYTES} or a line 'solid'", bytes.len());
        return error(Place::Byte(bytes.len() as u64), message);
    };
    if expected_bytes(count) != bytes.len() as u64 {
        let place = Place::Byte(HEADER_BYTES as u64 - 4);
        let message = format!(
            "the header promises {count} facets, which take {} bytes, and the file has {}",
            expected_bytes(count),
            bytes.len()
        );
        return error(place, message);
    }
    if count > u32::MAX / 3 {
        return Err(Error::Limit(format!("{count} facets have more corners than 32-bit indices can hold")));
    }
    let mut faces = vec![[0; 3]; count as usize];
    let pieces: Vec<Result<Vec<DVec3>>> = faces
        .par_chunks_mut(PIECE_FACETS)
        .zip(bytes[HEADER_BYTES..].par_chunks(PIECE_FACETS * FACET_BYTES))
        .enumerate()
        .map(|(piece, (faces, facets))| join_piece(facets, HEADER_BYTES + piece * PIECE_FACETS * FACET_BYTES, faces))
        .collect();
    // The first error, whatever the threads.
    let pieces: Vec<Vec<DVec3>> = pieces.into_iter().collect::<Result<_>>()?;
    let (positions, numbers) = distinct(&pieces.concat());
    let starts: Vec<usize> =
        pieces.iter().scan(0, |start, piece| Some(std::mem::replace(start, *start + piece.len()))).collect();
    faces.par_chunks_mut(PIECE_FACETS).zip(&starts).for_each(|(faces, start)| {
        faces.iter_mut().for_each(|face| *face = face.map(|corner| numbers[start + corner as usize]));
    });
    Ok(Mesh::new(positions, faces))
}

/// Facets joined by themselves before the whole file is: neighbors mostly lie close together in it, so that all but a
/// sixth of the corners find their equal in a table that fits the cache.
const PIECE_FACETS: usize = 1 << 13;

/// Numbers the corners of `facets`, which begin at byte `offset`, by their first appearance; returns the positions.
fn join_piece(facets: &[u8], offset: usize, faces: &mut [[u32; 3]]) -> Result<Vec<DVec3>> {
    // A closed mesh has half as many vertices as faces.
    let mut joiner = Joiner::new(faces.len() / 2 + 2);
    for (facet, (row, face)) in facets.chunks_exact(FACET_BYTES).zip(faces).enumerate() {
        for (corner, vertex) in row[12..48].chunks_exact(12).enumerate() {
            let coordinates = [0, 4, 8].map(|at| coordinate(&vertex[at..]));
            if !coordinates.iter().all(|c| c.is_finite()) {
                let place = Place::Byte((offset + FACET_BYTES * facet + 12 + 12 * corner) as u64);
                let message = format!("found the vertex {coordinates:?}, expected finite coordinates");
                return Err(Error::format(FORMAT, place, message));
            }
            // A tuple hashes number by number, an array byte by byte.
            face[corner] = joiner.number(coordinates.map(f32::to_bits).into());
        }
    }
    let position =
        |&bits: &(u32, u32, u32)| DVec3::from(<[u32; 3]>::from(bits).map(|bits| f64::from(f32::from_bits(bits))));
    Ok(joiner.positions.iter().map(position).collect())
}

/// A little-endian f32; −0 becomes 0, which is the same place.
fn coordinate(bytes: &[u8]) -> f32 {
    f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]) + 0.0
}

fn read_text(bytes: &[u8]) -> Result<Mesh> {
    let mut rows = Rows::new(FORMAT, Lines::after(0, bytes), None);
    let mut joiner = Joiner::new(16);
    let mut faces = Vec::new();
    let mut corners: Vec<u32> = Vec::new();
    // What must still come: the keywords that close what is open, innermost last.
    let mut open: Vec<&str> = Vec::new();
    while let Some(mut row) = rows.next() {
        let word = row.expect("a keyword")?.to_ascii_lowercase();
        match (word.as_slice(), open.last().copied()) {
            (b"solid", None) => open.push("endsolid"),
            (b"facet", Some("endsolid")) => open.push("endfacet"),
            (b"outer", Some("endfacet")) => open.push("endloop"),
            (b"vertex", Some("endloop")) => {
                let position = row.point()? + DVec3::ZERO;
                corners.push(joiner.number(position.to_array().map(f64::to_bits)));
            }
            (b"endloop", Some("endloop")) => {
                faces.push(take_face(&row, &mut corners)?);
                open.pop();
            }
            (closing, Some(expected)) if closing == expected.as_bytes() => {
                open.pop();
            }
            (_, expected) => {
                let expected = match expected {
                    None => "'solid'",
                    Some("endsolid") => "'facet' or 'endsolid'",
                    Some("endfacet") => "'outer loop' or 'endfacet'",
                    Some(_) => "'vertex' or 'endloop'",
                };
                return Err(row.error(format!("found {}, expected {expected}", quote(&word))));
            }
        }
    }
    if let Some(expected) = open.last() {
        return Err(rows.ends(format!("the file ends, expected '{expected}'")));
    }
    let position = |bits: &[u64; 3]| DVec3::from(bits.map(f64::from_bits));
    Ok(Mesh::new(joiner.positions.iter().map(position).collect(), faces))
}

fn take_face(row: &Row<'_>, corners: &mut Vec<u32>) -> Result<[u32; 3]> {
    let face = <[u32; 3]>::try_from(corners.as_slice())
        .map_err(|_| row.error(format!("found a loop of {} vertices, expected 3", corners.len())))?;
    corners.clear();
    Ok(face)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One facet; `start` overwrites the head of the free header.
    fn binary(start: &[u8], first_x: f32) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..start.len()].copy_from_slice(start);
        bytes.extend(1_u32.to_le_bytes());
        for value in [0., 0., 1., first_x, 0., 0., 1., 0., 0., 0., 1., 0.] {
            bytes.extend(f32::to_le_bytes(value));
        }
        bytes.extend([0; 2]);
        bytes
    }

    #[test]
    fn a_binary_file_may_start_with_solid() {
        let mesh = read(&binary(b"solid exported by somebody", 0.0)).unwrap();
        assert_eq!(mesh.faces, [[0, 1, 2]]);
    }

    #[test]
    fn what_stands_beside_facets_is_noticed() {
        for (at, is_free) in [(0, false), (79, false), (84, false), (131, false), (132, true), (133, true)] {
            let mut bytes = binary(b"", 0.0);
            assert!(!has_more(&bytes));
            bytes[at] = 1;
            assert_eq!(has_more(&bytes), is_free, "{at}");
        }
        assert!(!has_more(b"solid\nendsolid\n") && !has_more(b""));
    }

    #[test]
    fn negative_zero_is_zero() {
        let mut bytes = binary(b"", 0.0);
        bytes[80] = 2;
        bytes.extend(binary(b"", -0.0).split_off(84));
        let mesh = read(&bytes).unwrap();
        assert_eq!((mesh.positions.len(), mesh.faces), (3, vec![[0, 1, 2], [0, 1, 2]]));
    }

    #[test]
    fn vertices_are_numbered_by_first_appearance_in_the_whole_file() {
        const FACETS: usize = 3 * PIECE_FACETS + 5;
        // Some positions recur at once, some far away, some never.
        let place = |i: usize| [i % 7, i * i % 30_011, i % 5 * (i / 3)].map(|c| c as f32);
        let mut bytes = vec![0; HEADER_BYTES - 4];
        bytes.extend((FACETS as u32).to_le_bytes());
        for facet in 0..FACETS {
            bytes.extend([0; 12]);
            let corners = (3 * facet..3 * facet + 3).flat_map(place);
            bytes.extend(corners.flat_map(f32::to_le_bytes));
            bytes.extend([0; 2]);
        }
        let mesh = read(&bytes).unwrap();
        let mut joiner = Joiner::new(16);
        let numbers: Vec<u32> = (0..3 * FACETS).map(|i| joiner.number(place(i).map(f32::to_bits))).collect();
        assert_eq!(mesh.faces.as_flattened(), numbers);
        let positions: Vec<_> = mesh.positions.iter().map(|p| p.as_vec3().to_array().map(f32::to_bits)).collect();
        assert!(positions == joiner.positions && positions.len() < 3 * FACETS && positions.len() > 2 * PIECE_FACETS);

        // Of two bad coordinates the first is named.
        for facet in [FACETS - 1, PIECE_FACETS + 1] {
            let at = HEADER_BYTES + FACET_BYTES * facet + 12;
            bytes[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
            let message = read(&bytes).unwrap_err().to_string();
            assert!(message.starts_with(&format!("STL byte {at}: found the vertex [inf")), "{message}");
        }
    }

    #[test]
    fn length_and_coordinates_are_checked() {
        let mut long = binary(b"", 0.0);
        long.push(0);
        assert_eq!(
            read(&long).unwrap_err().to_string(),
            "STL byte 80: the header promises 1 facets, which take 134 bytes, and the file has 135"
        );
        let message = read(&binary(b"", f32::NAN)).unwrap_err().to_string();
        assert!(message.starts_with("STL byte 96: found the vertex [NaN, 0.0, 0.0]"), "{message}");
    }

    #[test]
    fn text_errors_have_a_line() {
        let text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n";
        assert_eq!(read(text).unwrap_err().to_string(), "STL line 6: found a loop of 2 vertices, expected 3");
        let text = b"solid a\nfacet normal 0 0 1\nvertex 0 0 0\n";
        assert_eq!(
            read(text).unwrap_err().to_string(),
            "STL line 3: found 'vertex', expected 'outer loop' or 'endfacet'"
        );
    }
}
