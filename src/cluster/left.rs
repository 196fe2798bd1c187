//! The faces that a grid leaves: those with corners in three cells, without repetitions.

use rayon::prelude::*;

use crate::kernel::count_spanning::spans;
use crate::mesh::key_table::KeyTable;
use crate::mesh::layers::Layers;
use crate::mesh::weld::{Twins, used_vertices};

/// Rows that a thread takes at a time.
const ROWS: usize = 1 << 12;
/// No cell, or none that is left.
pub const NONE: u32 = u32::MAX;

/// The faces that a grid leaves, and the cells of their corners.
#[derive(Debug, Default)]
pub struct Left {
    /// The input face of each, ascending.
    pub sources: Vec<u32>,
    /// The cells, in the order of the input face's corners.
    pub faces: Vec<[u32; 3]>,
    /// The key of every cell.
    keys: Vec<[u32; 2]>,
}

impl Left {
    /// What the cells with these `keys`, one a vertex, leave of `faces`.
    ///
    /// Of faces on the same three cells with the same turning sense the lowest stays. Where both senses are left they
    /// enclose nothing, and both go.
    pub fn new(faces: &[[u32; 3]], keys: &[[u32; 2]]) -> Self {
        let corner = |v: u32| keys[v as usize];
        let mut sources: Vec<u32> = (0..faces.len() as u32)
            .into_par_iter()
            .with_min_len(ROWS)
            .filter(|&f| {
                let [a, b, c] = faces[f as usize].map(corner);
                spans(a, b, c)
            })
            .collect();
        let corners: Vec<[u32; 3]> = sources.par_iter().map(|&f| faces[f as usize]).collect();
        // Of all vertices only the corners are worth a place in a table.
        let (vertices, mut corners) = renumbered(&corners, keys.len());
        let vertex_keys: Vec<[u32; 2]> = vertices.par_iter().with_min_len(ROWS).map(|&v| corner(v)).collect();
        let (_, lowest) = KeyTable::new(&vertex_keys);
        corners.par_iter_mut().with_min_len(ROWS).for_each(|face| *face = face.map(|v| lowest[v as usize]));

        let twins = Twins::new(corners.len(), vertices.len(), |f| corners[f], Layers::ONE);
        if !(twins.duplicates.is_empty() && twins.opposites.is_empty()) {
            let mut stays = vec![true; corners.len()];
            let dropped = twins.duplicates.iter().chain(twins.opposites.as_flattened());
            dropped.for_each(|&f| stays[f as usize] = false);
            let mut row = stays.iter();
            sources.retain(|_| row.next() == Some(&true));
            let mut row = stays.iter();
            corners.retain(|_| row.next() == Some(&true));
        }
        let (cells, faces) = renumbered(&corners, vertex_keys.len());
        Self { sources, faces, keys: cells.into_iter().map(|cell| vertex_keys[cell as usize]).collect() }
    }

    /// Numbers the cells in the order of their lowest vertices, which it returns after the cell of every vertex: [`NONE`]
    /// where no face is left.
    pub fn number(&mut self, keys: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
        let (table, _) = KeyTable::new(&self.keys);
        let mut vertex_cells: Vec<u32> =
            keys.par_iter().with_min_len(ROWS).map(|&key| table.find(key).unwrap_or(NONE)).collect();
        let mut numbers = vec![NONE; self.keys.len()];
        let mut firsts = Vec::with_capacity(self.keys.len());
        for (vertex, &cell) in (0..).zip(&vertex_cells).filter(|&(_, &cell)| cell != NONE) {
            let number = &mut numbers[cell as usize];
            if *number == NONE {
                *number = firsts.len() as u32;
                firsts.push(vertex);
            }
        }
        let number = |cell: u32| numbers.get(cell as usize).copied().unwrap_or(NONE);
        vertex_cells.par_iter_mut().with_min_len(ROWS).for_each(|cell| *cell = number(*cell));
        self.faces.par_iter_mut().with_min_len(ROWS).for_each(|face| *face = face.map(number));
        (vertex_cells, firsts)
    }
}

/// The vertices that `faces` use, ascending, and the faces with their places among them.
fn renumbered(faces: &[[u32; 3]], vertex_count: usize) -> (Vec<u32>, Vec<[u32; 3]>) {
    let used = used_vertices(faces, vertex_count);
    let mut places = vec![NONE; vertex_count];
    let mut vertices = Vec::new();
    for (vertex, place) in (0..).zip(&mut places).filter(|&(vertex, _)| used[vertex as usize]) {
        *place = vertices.len() as u32;
        vertices.push(vertex);
    }
    let renumber = |face: &[u32; 3]| face.map(|v| places[v as usize]);
    (vertices, faces.par_iter().with_min_len(ROWS).map(renumber).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keys of cells in a row.
    fn keys<const N: usize>(cells: [u32; N]) -> [[u32; 2]; N] {
        cells.map(|cell| [cell, 0])
    }

    #[test]
    fn faces_in_fewer_than_three_cells_vanish() {
        let left = Left::new(&[[0, 1, 2], [2, 1, 3], [3, 4, 5], [0, 0, 4]], &keys([7, 7, 8, 9, 5, 8]));
        assert_eq!(left.sources, [1, 2]);
    }

    #[test]
    fn repetitions_go_and_opposite_faces_take_each_other_away() {
        let keys = keys([1, 2, 3, 4, 1, 2, 3]);
        // Twice the same and once turned; twice the same; turned only.
        let faces = [[0, 1, 2], [5, 6, 4], [2, 1, 0], [1, 2, 3], [3, 5, 6], [3, 0, 1]];
        assert_eq!(Left::new(&faces, &keys).sources, [3, 5]);
        assert_eq!(Left::new(&faces[..2], &keys).sources, [0]);
        assert_eq!(Left::new(&faces[1..3], &keys).sources, [] as [u32; 0]);
        assert_eq!(Left::new(&[], &[]).sources, [] as [u32; 0]);
    }

    #[test]
    fn cells_are_numbered_by_their_lowest_vertex() {
        // The cell 9 has no face; 6 has the vertices 2, 3 and 5.
        let keys = keys([9, 4, 6, 6, 5, 6]);
        let mut left = Left::new(&[[5, 4, 1]], &keys);
        let (cells, firsts) = left.number(&keys);
        assert_eq!((cells, firsts), (vec![NONE, 0, 1, 1, 2, 1], vec![1, 2, 4]));
        assert_eq!(left.faces, [[1, 2, 0]]);
    }
}
