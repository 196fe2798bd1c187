//! Which faces lie across the edges of each: the graph that regions of faces grow in.

use rayon::prelude::*;

use super::PARALLEL_ROWS;
use super::adjacency::Rings;
use super::topology::has_repeated_corner;

/// No face lies across: a wall.
pub const NONE: u32 = u32::MAX;

/// The face across each edge of every face, the edge `k` from corner `k` to the corner after it; [`NONE`] at a wall.
///
/// Walls are borders, edges of more than two faces, and edges whose two faces disagree in orientation; faces with a repeated
/// corner have nothing else. The relation is symmetric.
pub fn neighbors(faces: &[[u32; 3]], rings: &Rings) -> Vec<[u32; 3]> {
    let across = |(f, &face): (usize, &[u32; 3])| {
        if has_repeated_corner(&face) {
            return [NONE; 3];
        }
        [0, 1, 2].map(|k| {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let mut others = rings.faces_of_edge(faces, a, b).filter(|&other| other != f as u32);
            match (others.next(), others.next()) {
                (Some(other), None) if edge_of(faces[other as usize], b, a).is_some() => other,
                _ => NONE,
            }
        })
    };
    faces.par_iter().enumerate().with_min_len(PARALLEL_ROWS).map(across).collect()
}

/// The edge of a face that runs from `a` to `b`.
pub fn edge_of(face: [u32; 3], a: u32, b: u32) -> Option<usize> {
    (0..3).find(|&k| face[k] == a && face[(k + 1) % 3] == b)
}

/// The component of every face, numbered by their first faces, and these: what hangs together across edges between faces of
/// which `belong` says that they do.
pub(crate) fn components(neighbors: &[[u32; 3]], belong: impl Fn(u32, u32) -> bool) -> (Vec<u32>, Vec<u32>) {
    let mut components = vec![NONE; neighbors.len()];
    let mut firsts = Vec::new();
    let mut stack = Vec::new();
    for first in 0..neighbors.len() as u32 {
        if components[first as usize] != NONE {
            continue;
        }
        let component = firsts.len() as u32;
        firsts.push(first);
        components[first as usize] = component;
        stack.push(first);
        while let Some(face) = stack.pop() {
            for other in neighbors[face as usize] {
                if other != NONE && components[other as usize] == NONE && belong(face, other) {
                    components[other as usize] = component;
                    stack.push(other);
                }
            }
        }
    }
    (components, firsts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn two_triangles_meet_across_their_diagonal() {
        // 2 - 3
        // | \ |
        // 0 - 1
        let faces = [[0, 1, 2], [1, 3, 2]];
        assert_eq!(neighbors(&faces, &Rings::new(&faces, 4)), [[NONE, 1, NONE], [NONE, NONE, 0]]);
        // Turned over, they no longer agree.
        let faces = [[0, 1, 2], [1, 2, 3]];
        assert_eq!(neighbors(&faces, &Rings::new(&faces, 4)), [[NONE; 3]; 2]);
        // A third face on the diagonal, and one that repeats a corner.
        let faces = [[0, 1, 2], [1, 3, 2], [1, 4, 2], [0, 0, 1]];
        assert_eq!(neighbors(&faces, &Rings::new(&faces, 5))[..2], [[NONE; 3]; 2]);
    }

    #[test]
    fn neighbors_are_symmetric() {
        let torus = shapes::torus(8, 5);
        let rows = neighbors(&torus.faces, &Rings::new(&torus.faces, torus.positions.len()));
        for (f, row) in rows.iter().enumerate() {
            for (k, &other) in row.iter().enumerate() {
                let [a, b] = [torus.faces[f][k], torus.faces[f][(k + 1) % 3]];
                let back = edge_of(torus.faces[other as usize], b, a).expect("an edge");
                assert_eq!(rows[other as usize][back], f as u32);
            }
        }
    }
}
