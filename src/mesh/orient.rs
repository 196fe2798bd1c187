//! Makes neighboring faces agree on which side is outside.

use rayon::prelude::*;

use super::adjacency::{EdgeUse, Rings};
use super::fan::{Fan, VERTICES_EACH, fans, find_complex_again};
use super::regions::Regions;

/// Which faces to turn over so that every two faces on a manifold edge run along it in opposite directions.
///
/// `None` where none has to be. Otherwise one bit a face. In each part connected over manifold edges the orientation of the
/// majority stays (of the lowest face at a tie), so that no more faces are turned than must be. A part that has no consistent
/// orientation (a Möbius strip) keeps some disagreeing edges, at most those that it has.
pub fn orient(faces: &[[u32; 3]], rings: &Rings) -> Option<Vec<bool>> {
    orient_fans(faces, rings, &fans(faces, rings))
}

/// [`orient`] where the fans are known.
fn orient_fans(faces: &[[u32; 3]], rings: &Rings, fans: &[Fan]) -> Option<Vec<bool>> {
    let edges = disagreeing(faces, rings, |v| fans[v as usize] == Fan::Complex);
    let turned_faces = Regions::grown(faces, rings, fans, &edges).turned();
    if turned_faces.is_empty() {
        return None;
    }
    let mut turned = vec![false; faces.len()];
    turned_faces.into_iter().for_each(|face| turned[face as usize] = true);
    Some(turned)
}

/// Both faces of every manifold edge that they run along in the same direction, by the edges' lower ends; both ends of such an
/// edge are known to be `suspect`.
fn disagreeing(faces: &[[u32; 3]], rings: &Rings, suspect: impl Fn(u32) -> bool + Sync) -> Vec<[u32; 2]> {
    let on_edges_from = |(mut found, mut scratch): (Vec<[u32; 2]>, Vec<EdgeUse>), v: u32| {
        let edges = rings.edges_from(faces, v, &mut scratch);
        let disagree = edges.filter(|uses| uses.len() == 2 && uses[0].outward() == uses[1].outward());
        found.extend(disagree.map(|uses| [uses[0].face(), uses[1].face()]));
        (found, scratch)
    };
    let suspects = (0..rings.vertex_count() as u32).into_par_iter().with_min_len(VERTICES_EACH).filter(|&v| suspect(v));
    let found = suspects.fold(|| (Vec::new(), Vec::new()), on_edges_from).map(|(found, _)| found);
    found.reduce(Vec::new, |mut all, found| {
        all.extend(found);
        all
    })
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
    let Some(turned) = orient_fans(faces, rings, &fans) else {
        return Oriented { fans, turned: Vec::new(), warning: None };
    };
    let count = turned.iter().filter(|&&turned| turned).count();
    for ((face, source), _) in faces.iter_mut().zip(sources).zip(&turned).filter(|(_, turned)| **turned) {
        face.swap(1, 2);
        *source |= TURNED;
    }
    let warning = format!("faces wound against their neighbors, which keep their winding in the result: {count}");
    find_complex_again(&mut fans, faces, rings, &turned);
    Oriented { fans, turned, warning: Some(warning) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::adjacency::across;
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

    /// Over every manifold edge one by one, each part from its lowest face.
    fn orient_edge_by_edge(faces: &[[u32; 3]], rings: &Rings) -> Vec<bool> {
        let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
        for first in 0..faces.len() as u32 {
            if turned[first as usize].is_some() {
                continue;
            }
            turned[first as usize] = Some(false);
            let mut part = vec![first];
            let mut done = 0;
            while let Some(&face) = part.get(done) {
                done += 1;
                let [a, b, c] = faces[face as usize];
                for edge in [[a, b], [b, c], [c, a]] {
                    if let Some((other, same_way)) = across(faces, rings, face, edge)
                        && turned[other as usize].is_none()
                    {
                        turned[other as usize] = turned[face as usize].map(|own| own ^ same_way);
                        part.push(other);
                    }
                }
            }
            let turned_count = part.iter().filter(|&&f| turned[f as usize] == Some(true)).count();
            if turned_count * 2 > part.len() {
                part.iter().for_each(|&f| turned[f as usize] = turned[f as usize].map(|bit| !bit));
            }
        }
        turned.into_iter().map(|bit| bit == Some(true)).collect()
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
            // Where there is an orientation it is the one; where there is none, no more edges disagree than before.
            let odd_edges = |turned: &[bool]| {
                let turn = |(face, turned): (&[u32; 3], &bool)| if *turned { [face[0], face[2], face[1]] } else { *face };
                disagreeing(&before.iter().zip(turned).map(turn).collect::<Vec<_>>(), &rings, |_| true).len()
            };
            let untouched = vec![false; faces.len()];
            let turned = if oriented.turned.is_empty() { &untouched } else { &oriented.turned };
            if odd_edges(&expected) == 0 {
                prop_assert_eq!(turned, &expected);
            }
            prop_assert!(odd_edges(turned) <= odd_edges(&untouched));
        }

        /// Large enough that regions meet, and that some end long before others.
        #[test]
        fn large_parts_are_oriented_as_if_walked(
            islands in prop::collection::vec((0usize..1800, 1usize..400), 0..6),
            sides in prop::collection::vec(prop::bool::ANY, 1800),
            is_odd in prop::bool::weighted(0.2),
        ) {
            let mut faces = shapes::torus(30, 30).faces;
            for (first, count) in islands {
                (first..(first + count).min(faces.len())).for_each(|f| faces[f].swap(0, 1));
            }
            if is_odd {
                faces.iter_mut().zip(sides).filter(|(_, side)| *side).for_each(|(face, _)| face.swap(0, 1));
            }
            let rings = Rings::new(&faces, 900);
            let expected = orient_edge_by_edge(&faces, &rings);
            prop_assert_eq!(orient(&faces, &rings).unwrap_or_else(|| vec![false; faces.len()]), expected);
        }
    }
}
