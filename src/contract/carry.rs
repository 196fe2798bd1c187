//! What vertices carry through a run: their origin, their weights, how far they drifted, and their wedges.

use super::compact::keep_live;
use super::wedges::{WedgeRows, Wedges};

/// Set in the origin of a vertex that stands at no input vertex's position; input vertices are below it.
pub const MOVED_FROM: u32 = 1 << 31;

/// Rows beside the positions, one a live vertex.
#[derive(Debug)]
pub struct Carried {
    /// The input vertex at the same position; or, with the bit [`MOVED_FROM`], one of those that became this one.
    pub origin: Vec<u32>,
    /// Attributes, where there are any that are kept.
    pub wedges: Option<Wedges>,
    /// How far a vertex may have drifted off the surface, step by step, in the normalized frame; empty where accumulated
    /// quadrics tell.
    pub drift: Vec<f32>,
    /// What a vertex counts; empty where all count the same, or the quadrics hold it already.
    pub weights: Vec<f32>,
    /// The input face of every live face, with the bit [`TURNED`](crate::mesh::orient::TURNED) where it was turned over to agree with its neighbors.
    pub face_origin: Vec<u32>,
}

impl Carried {
    /// A copy between rounds, of so many live vertices and faces.
    pub fn copy(&self, vertices: usize, faces: usize) -> Self {
        Self {
            origin: self.origin.clone(),
            wedges: self.wedges.as_ref().map(|wedges| wedges.copy(vertices, faces)),
            drift: self.drift.clone(),
            weights: self.weights.clone(),
            face_origin: self.face_origin[..faces].to_vec(),
        }
    }

    /// The rows of all vertices, to change.
    pub fn rows(&mut self) -> CarriedRows<'_> {
        CarriedRows {
            origin: &mut self.origin,
            wedges: self.wedges.as_mut().map(Wedges::rows),
            drift: &mut self.drift,
            weights: &mut self.weights,
        }
    }

    /// Keeps the rows of live vertices: where the next entry of `new_vertex` is greater.
    pub fn compact(&mut self, new_vertex: &[u32]) {
        keep_live(&mut self.origin, new_vertex);
        if !self.drift.is_empty() {
            keep_live(&mut self.drift, new_vertex);
        }
        if !self.weights.is_empty() {
            keep_live(&mut self.weights, new_vertex);
        }
    }
}

/// The rows of consecutive vertices; empty where nothing of the kind is carried.
#[derive(Debug)]
pub struct CarriedRows<'a> {
    origin: &'a mut [u32],
    pub wedges: Option<WedgeRows<'a>>,
    drift: &'a mut [f32],
    weights: &'a mut [f32],
}

impl CarriedRows<'_> {
    /// The greater drift of two vertices, where they drift.
    pub fn drift(&self, first: usize, second: usize) -> f32 {
        self.drift[first].max(self.drift[second])
    }

    /// The weights of two vertices, where they have any.
    pub fn weights(&self, [first, second]: [usize; 2]) -> Option<[f32; 2]> {
        Some([*self.weights.get(first)?, *self.weights.get(second)?])
    }

    /// Notes that a vertex has drifted so far.
    pub fn set_drift(&mut self, vertex: usize, drift: f32) {
        self.drift[vertex] = drift;
    }

    /// Notes in `keep` that it stands at `t` of the way between the ends.
    pub fn contract(&mut self, keep: usize, [first, second]: [usize; 2], t: f32) {
        if let Some([first, second]) = self.weights([first, second]) {
            self.weights[keep] = first.max(second);
        }
        self.origin[keep] = match t {
            0.0 => self.origin[first],
            1.0 => self.origin[second],
            _ => self.origin[keep] | MOVED_FROM,
        };
    }
}

impl<'a> CarriedRows<'a> {
    /// The first `size` rows and the others.
    pub fn split_at(self, size: usize) -> (Self, Self) {
        let (origin, other_origin) = self.origin.split_at_mut(size);
        let (wedges, other_wedges) = self.wedges.map(|rows| rows.split_at(size)).unzip();
        let (drift, other_drift) = split(self.drift, size);
        let (weights, other_weights) = split(self.weights, size);
        let others = Self { origin: other_origin, wedges: other_wedges, drift: other_drift, weights: other_weights };
        (Self { origin, wedges, drift, weights }, others)
    }
}

/// Splits rows that may not be there.
pub fn split<T>(rows: &mut [T], size: usize) -> (&mut [T], &mut [T]) {
    rows.split_at_mut(size.min(rows.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What three vertices carry at the start.
    fn three_vertices() -> Carried {
        Carried {
            origin: vec![7, 8, 9],
            wedges: None,
            drift: vec![0.0; 3],
            weights: Vec::new(),
            face_origin: Vec::new(),
        }
    }

    #[test]
    fn origins_survive_only_at_the_ends() {
        let mut carried = three_vertices();
        carried.rows().contract(0, [0, 1], 0.25);
        assert_eq!(carried.origin[0], 7 | MOVED_FROM);
        carried.rows().contract(0, [0, 2], 1.0);
        assert_eq!(carried.origin[0], 9);
        carried.compact(&[0, 1, 1, 2]);
        assert_eq!(carried.origin, [9, 9]);
    }

    #[test]
    fn drifts_stay_with_their_vertices() {
        let mut carried = three_vertices();
        let mut rows = carried.rows();
        rows.set_drift(2, 0.5);
        rows.set_drift(0, 0.25);
        assert_eq!([rows.drift(0, 1), rows.drift(1, 2), rows.drift(2, 0)], [0.25, 0.5, 0.5]);
        carried.compact(&[0, 1, 1, 2]);
        assert_eq!(carried.drift, [0.25, 0.5]);
    }
}
