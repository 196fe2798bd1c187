//! Makes neighboring faces agree on which side is outside.

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::adjacency::{Rings, corner_of, from_corner};
use super::fan::{Fan, fans};
use super::topology::has_repeated_corner;

/// Which faces to turn over so that every two faces on a manifold edge run along it in opposite directions.
///
/// `None` when they do already. Otherwise one bit a face. Each part connected over manifold edges is walked from its lowest
/// face, and the orientation of the majority stays (of the lowest face at a tie), so that no more faces are turned than must be.
/// A part that has no consistent orientation (a Möbius strip) keeps some disagreeing edges.
pub fn orient(faces: &[[u32; 3]], rings: &Rings) -> Option<Vec<bool>> {
    orient_around(faces, rings, |_| true)
}

/// [`orient`] where both ends of every edge whose faces disagree are known to be `suspect`.
fn orient_around(faces: &[[u32; 3]], rings: &Rings, suspect: impl Fn(u32) -> bool + Sync) -> Option<Vec<bool>> {
    if agrees(faces, rings, suspect) {
        return None;
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    let mut part = Vec::new();
    for first in 0..faces.len() as u32 {
        if turned[first as usize].is_some() {
            continue;
        }
        turned[first as usize] = Some(false);
        part.clear();
        part.push(first);
        let mut done = 0;
        while let Some(&face) = part.get(done) {
            done += 1;
            for [a, b] in edges(faces[face as usize]) {
                let Some((other, same_way)) = across(faces, rings, face, [a, b]) else { continue };
                if turned[other as usize].is_none() {
                    turned[other as usize] = turned[face as usize].map(|own| own ^ same_way);
                    part.push(other);
                }
            }
        }
        let turned_count = part.iter().filter(|&&f| turned[f as usize] == Some(true)).count();
        if turned_count * 2 > part.len() {
            for &f in &part {
                turned[f as usize] = turned[f as usize].map(|bit| !bit);
            }
        }
    }
    Some(turned.into_iter().map(|bit| bit == Some(true)).collect())
}

/// Whether no manifold edge is run along in the same direction by both of its faces.
fn agrees(faces: &[[u32; 3]], rings: &Rings, suspect: impl Fn(u32) -> bool + Sync) -> bool {
    (0..rings.vertex_count() as u32)
        .into_par_iter()
        .with_min_len(PARALLEL_ROWS)
        .filter(|&v| suspect(v))
        .map_init(Vec::new, |scratch, v| {
            rings.edges_from(faces, v, scratch).all(|uses| uses.len() != 2 || uses[0].outward() != uses[1].outward())
        })
        .all(|agrees| agrees)
}

/// The one other face on a manifold edge, and whether it runs along it in the same direction; read from the shorter ring of the
/// two, without a branch that depends on a face.
fn across(faces: &[[u32; 3]], rings: &Rings, face: u32, [a, b]: [u32; 2]) -> Option<(u32, bool)> {
    from_corner(faces[face as usize], a)?;
    let (near, far) = if rings.ring(a).len() <= rings.ring(b).len() { (a, b) } else { (b, a) };
    let (mut found, mut count) = ((0, false), 0);
    for &f in rings.ring(near) {
        let corners = faces[f as usize];
        let k = corner_of(corners, near);
        let (next, last) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let is_other = ((next == far) | (last == far)) & (f != face) & !has_repeated_corner(&corners);
        found = if is_other { (f, (next == far) == (near == a)) } else { found };
        count += u32::from(is_other);
    }
    (count == 1).then_some(found)
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Set in the source of a face that was turned over; input faces are below it.
pub const TURNED: u32 = 1 << 31;

/// The corner of the input's face that the `k`-th corner of a face from this source is.
pub(crate) fn input_corner(source: u32, k: usize) -> (usize, usize) {
    let face = (source & !TURNED) as usize;
    (face, if source & TURNED == 0 { k } else { (3 - k) % 3 })
}

/// Faces after as many as possible were turned to agree with their neighbors.
#[derive(Debug)]
pub struct Oriented {
    /// The fans of the vertices.
    pub fans: Vec<Fan>,
    /// Which faces were turned; empty where none had to be.
    pub turned: Vec<bool>,
    /// What a user should know.
    pub warning: Option<String>,
}

/// Turns faces over until neighbors agree, as far as they can, and marks them in their sources by [`TURNED`].
pub fn turn_to_agree(faces: &mut [[u32; 3]], sources: &mut [u32], rings: &Rings) -> Oriented {
    let found = fans(faces, rings);
    let is_complex = |v: u32| found[v as usize] == Fan::Complex;
    let turned = if found.contains(&Fan::Complex) { orient_around(faces, rings, is_complex) } else { None };
    let Some(turned) = turned else { return Oriented { fans: found, turned: Vec::new(), warning: None } };
    let count = turned.iter().filter(|&&turned| turned).count();
    for ((face, source), _) in faces.iter_mut().zip(sources).zip(&turned).filter(|(_, turned)| **turned) {
        face.swap(1, 2);
        *source |= TURNED;
    }
    let warning = format!("{count} faces are wound against their neighbors; they keep their winding in the result");
    Oriented { fans: fans(faces, rings), turned, warning: Some(warning) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orient_all(faces: &[[u32; 3]]) -> Option<Vec<bool>> {
        let vertex_count = faces.as_flattened().iter().max().map_or(0, |&v| v as usize + 1);
        orient(faces, &Rings::new(faces, vertex_count))
    }

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn what_agrees_is_left_alone() {
        assert_eq!(orient_all(&TETRAHEDRON), None);
        assert_eq!(orient_all(&TETRAHEDRON.map(|[a, b, c]| [a, c, b])), None);
        assert_eq!(orient_all(&[]), None);
    }

    #[test]
    fn the_majority_keeps_its_orientation() {
        for odd in 0..4 {
            let mut faces = TETRAHEDRON;
            faces[odd].swap(0, 1);
            let expected: Vec<bool> = (0..4).map(|f| f == odd).collect();
            assert_eq!(orient_all(&faces), Some(expected));
        }
    }

    #[test]
    fn the_lowest_face_decides_a_tie() {
        assert_eq!(orient_all(&[[0, 1, 2], [1, 2, 3]]), Some(vec![false, true]));
    }

    #[test]
    fn parts_are_oriented_on_their_own() {
        let faces = [[0, 1, 2], [3, 4, 5], [1, 3, 2], [4, 5, 6], [3, 4, 7]];
        // Faces 1, 3 and 4 hang together; turning the one between the others is the least.
        assert_eq!(orient_all(&faces), Some(vec![false, true, false, false, false]));
    }

    #[test]
    fn a_non_manifold_edge_does_not_connect() {
        assert_eq!(orient_all(&[[0, 1, 2], [0, 1, 3], [0, 1, 4]]), None);
    }

    #[test]
    fn a_moebius_strip_keeps_one_disagreeing_edge() {
        // Five triangles around: every edge {i, i + 1} is inner but for the border's {i, i + 2}.
        let faces: Vec<[u32; 3]> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let turned = orient_all(&faces).expect("a Möbius strip cannot agree");
        let turned_faces: Vec<[u32; 3]> =
            faces.iter().zip(turned).map(|(&[a, b, c], turn)| if turn { [a, c, b] } else { [a, b, c] }).collect();
        let rings = Rings::new(&turned_faces, 5);
        let mut scratch = Vec::new();
        let disagreeing: usize = (0..5)
            .map(|v| {
                let edges = rings.edges_from(&turned_faces, v, &mut scratch);
                edges.filter(|uses| uses.len() == 2 && uses[0].outward() == uses[1].outward()).count()
            })
            .sum();
        assert_eq!(disagreeing, 1);
    }
}
