//! Makes neighboring faces agree on which side is outside.

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::adjacency::{Rings, corner_of, from_corner};
use super::fan::{Fan, fans, find_complex_again};
use super::topology::has_repeated_corner;

/// Which faces to turn over so that every two faces on a manifold edge run along it in opposite directions.
///
/// `None` when they do already. Otherwise one bit a face. Each part connected over manifold edges is walked from its lowest
/// face, and the orientation of the majority stays (of the lowest face at a tie), so that no more faces are turned than must be.
/// A part that has no consistent orientation (a Möbius strip) keeps some disagreeing edges.
pub fn orient(faces: &[[u32; 3]], rings: &Rings) -> Option<Vec<bool>> {
    orient_fans(faces, rings, &mut fans(faces, rings))
}

/// [`orient`] where the fans are known. Those that are torn apart in a part without an orientation become complex.
///
/// The faces of a fan agree, and its edges are manifold: only edges between complex vertices are looked at one by one.
fn orient_fans(faces: &[[u32; 3]], rings: &Rings, fans: &mut [Fan]) -> Option<Vec<bool>> {
    if !fans.contains(&Fan::Complex) || agrees(faces, rings, |v| fans[v as usize] == Fan::Complex) {
        return None;
    }
    let mut walk = Walk { turned: vec![None; faces.len()], part: Vec::new() };
    let mut seen = vec![false; fans.len()];
    for first in 0..faces.len() as u32 {
        if walk.turned[first as usize].is_some() {
            continue;
        }
        walk.part.clear();
        walk.enter(first, false);
        let mut done = 0;
        while let Some(&face) = walk.part.get(done) {
            done += 1;
            let own = walk.turned[face as usize] == Some(true);
            let corners = faces[face as usize];
            let is_complex = corners.map(|v| fans[v as usize] == Fan::Complex);
            for (v, _) in corners.iter().map(|&v| v as usize).zip(is_complex).filter(|(_, is_complex)| !is_complex) {
                if !std::mem::replace(&mut seen[v], true) {
                    let agree = rings.ring(v as u32).iter().fold(true, |agree, &other| agree & walk.enter(other, own));
                    fans[v] = if agree { fans[v] } else { Fan::Complex };
                }
            }
            for k in (0..3).filter(|&k| is_complex[k] && is_complex[(k + 1) % 3]) {
                if let Some((other, same_way)) = across(faces, rings, face, [corners[k], corners[(k + 1) % 3]]) {
                    walk.enter(other, own ^ same_way);
                }
            }
        }
        walk.keep_majority();
    }
    Some(walk.turned.into_iter().map(|bit| bit == Some(true)).collect())
}

/// A walk over parts.
struct Walk {
    /// Whether a face is turned, where it has been reached.
    turned: Vec<Option<bool>>,
    /// The faces of the part, as they were reached.
    part: Vec<u32>,
}

impl Walk {
    /// Reaches a face from one beside which it is to be turned so, or not; whether it is.
    fn enter(&mut self, face: u32, is_turned: bool) -> bool {
        let bit = &mut self.turned[face as usize];
        if bit.is_none() {
            *bit = Some(is_turned);
            self.part.push(face);
        }
        *bit == Some(is_turned)
    }

    /// Turns the part over if more than half of it is turned.
    fn keep_majority(&mut self) {
        let Self { turned, part } = self;
        let turned_count = part.iter().filter(|&&f| turned[f as usize] == Some(true)).count();
        if turned_count * 2 > part.len() {
            for &f in part.iter() {
                turned[f as usize] = turned[f as usize].map(|bit| !bit);
            }
        }
    }
}

/// Whether no manifold edge is run along in the same direction by both of its faces; both ends of one that is are known to be
/// `suspect`.
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
    let mut fans = fans(faces, rings);
    let Some(turned) = orient_fans(faces, rings, &mut fans) else {
        return Oriented { fans, turned: Vec::new(), warning: None };
    };
    let count = turned.iter().filter(|&&turned| turned).count();
    for ((face, source), _) in faces.iter_mut().zip(sources).zip(&turned).filter(|(_, turned)| **turned) {
        face.swap(1, 2);
        *source |= TURNED;
    }
    let warning = format!("{count} faces are wound against their neighbors; they keep their winding in the result");
    find_complex_again(&mut fans, faces, rings);
    Oriented { fans, turned, warning: Some(warning) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::shapes;
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

    /// Over every manifold edge one by one.
    fn orient_edge_by_edge(faces: &[[u32; 3]], rings: &Rings) -> Vec<bool> {
        let mut walk = Walk { turned: vec![None; faces.len()], part: Vec::new() };
        for first in 0..faces.len() as u32 {
            if walk.turned[first as usize].is_some() {
                continue;
            }
            walk.part.clear();
            walk.enter(first, false);
            let mut done = 0;
            while let Some(&face) = walk.part.get(done) {
                done += 1;
                let [a, b, c] = faces[face as usize];
                for edge in [[a, b], [b, c], [c, a]] {
                    if let Some((other, same_way)) = across(faces, rings, face, edge) {
                        walk.enter(other, (walk.turned[face as usize] == Some(true)) ^ same_way);
                    }
                }
            }
            walk.keep_majority();
        }
        walk.turned.into_iter().map(|bit| bit == Some(true)).collect()
    }

    /// Shapes with and without an orientation, and without any order.
    fn faces_wound_anyhow() -> impl Strategy<Value = Vec<[u32; 3]>> {
        let flips = |faces: Vec<[u32; 3]>| {
            let count = faces.len();
            let turn = |(face, turn): ([u32; 3], bool)| if turn { [face[0], face[2], face[1]] } else { face };
            prop::collection::vec(prop::bool::weighted(0.15), count)
                .prop_map(move |turns| faces.iter().copied().zip(turns).map(turn).collect())
        };
        prop_oneof![
            flips(shapes::torus(7, 5).faces),
            flips(shapes::plane(5, 4).faces),
            (5_u32..12).prop_flat_map(move |n| flips(shapes::moebius(n).faces)),
            prop::collection::vec([0u32..7, 0u32..7, 0u32..7], 0..14),
        ]
    }

    proptest! {
        #[test]
        fn fans_stand_for_their_edges(mut faces in faces_wound_anyhow()) {
            let vertex_count = faces.as_flattened().iter().max().map_or(0, |&v| v as usize + 1);
            let rings = Rings::new(&faces, vertex_count);
            let expected = orient_edge_by_edge(&faces, &rings);
            let mut sources: Vec<u32> = (0..faces.len() as u32).collect();
            let before = faces.clone();
            let oriented = turn_to_agree(&mut faces, &mut sources, &rings);
            prop_assert_eq!(&oriented.fans, &fans(&faces, &rings));
            // Where there is an orientation it is the one; where there is none a walk decides which edges disagree.
            let agree = |turned: &[bool]| {
                let turn = |(face, turned): (&[u32; 3], &bool)| if *turned { [face[0], face[2], face[1]] } else { *face };
                agrees(&before.iter().zip(turned).map(turn).collect::<Vec<_>>(), &rings, |_| true)
            };
            let turned = if oriented.turned.is_empty() { vec![false; faces.len()] } else { oriented.turned };
            prop_assert_eq!(agree(&turned), agree(&expected));
            if agree(&expected) {
                prop_assert_eq!(turned, expected);
            }
        }
    }
}
