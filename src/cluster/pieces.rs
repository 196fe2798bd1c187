//! The faces of every cell, ascending, in pieces short enough for one invocation.

use crate::error::{Error, Result};
use crate::kernel::cells::PIECE_FACES;
use crate::kernel::rows::Face;
use crate::mesh::adjacency::{Stretch, group_into};

use super::left::NONE;

/// Pieces of a cell at most on a GPU: software Vulkan ends an invocation's loops after 65,535 turns without a word.
const MOST_PIECES: usize = 60_000;

/// The faces of every cell that touch it, a face once a cell.
#[derive(Debug)]
pub struct Pieces {
    /// The faces of one cell after those of another.
    pub faces: Vec<u32>,
    /// The cell of every piece and where its faces start; one more that ends the last.
    pub rows: Vec<[u32; 2]>,
    /// Where the pieces of every cell start, and the end.
    pub cell_starts: Vec<u32>,
}

impl Pieces {
    /// The pieces of `cell_count` cells; corners outside of these have [`NONE`].
    pub fn new(cell_faces: &[Face], cell_count: usize) -> Self {
        let touched = |f: usize| {
            let [a, b, c] = cell_faces[f].corners();
            [a, if b == a { NONE } else { b }, if c == a || c == b { NONE } else { c }]
        };
        let mut starts = vec![0; cell_count + 1];
        let mut faces = Vec::new();
        group_into(&Stretch::any(cell_faces.len()), touched, &mut starts, rayon::current_num_threads(), |total| {
            faces = vec![0; total];
            &mut faces
        });
        let mut rows = Vec::with_capacity(cell_count + faces.len() / PIECE_FACES as usize + 1);
        let mut cell_starts = Vec::with_capacity(cell_count + 1);
        for (cell, ends) in (0..).zip(starts.windows(2)) {
            cell_starts.push(rows.len() as u32);
            rows.extend((ends[0]..ends[1]).step_by(PIECE_FACES as usize).map(|start| [cell, start]));
        }
        cell_starts.push(rows.len() as u32);
        rows.push([NONE, faces.len() as u32]);
        Self { faces, rows, cell_starts }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.rows.len() - 1
    }

    /// # Errors
    /// [`Error::Limit`] when a cell has too many for a GPU.
    pub fn check_for_gpu(&self) -> Result<()> {
        let most = self.cell_starts.windows(2).map(|ends| (ends[1] - ends[0]) as usize).max().unwrap_or(0);
        if most > MOST_PIECES {
            let faces = most * PIECE_FACES as usize;
            return Err(Error::Limit(format!("a cell of about {faces} faces is too much for one invocation")));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_stands_once_in_every_cell_it_touches() {
        let faces = [[0, 0, 0], [0, 1, 0], [2, 1, 0], [NONE, 1, 1], [NONE; 3]].map(|[a, b, c]| Face { a, b, c });
        let pieces = Pieces::new(&faces, 4);
        assert_eq!(pieces.faces, [0, 1, 2, 1, 2, 3, 2]);
        assert_eq!(pieces.rows, [[0, 0], [1, 3], [2, 6], [NONE, 7]]);
        assert_eq!((pieces.cell_starts, pieces.rows.len()), (vec![0, 1, 2, 3, 3], 4));
    }

    #[test]
    fn many_faces_are_cut() {
        let faces = vec![Face::default(); PIECE_FACES as usize * 2 + 1];
        let pieces = Pieces::new(&faces, 1);
        assert_eq!(pieces.rows, [[0, 0], [0, PIECE_FACES], [0, 2 * PIECE_FACES], [NONE, 2 * PIECE_FACES + 1]]);
        assert_eq!((pieces.cell_starts.as_slice(), pieces.count()), ([0, 3].as_slice(), 3));
        assert!(pieces.check_for_gpu().is_ok());
    }
}
