//! What vertices carry through a run without taking part: their origin, normals, colors.

use crate::math::Vec3;

use super::compact::keep_live;

/// Set in the origin of a vertex that stands at no input vertex's position; input vertices are below it.
pub const MOVED_FROM: u32 = 1 << 31;
/// Set in the origin of a face that was turned over; input faces are below it.
pub const TURNED: u32 = 1 << 31;

/// Rows beside the positions, one a live vertex.
#[derive(Debug)]
pub struct Carried {
    /// The input vertex at the same position; or, with the bit [`MOVED_FROM`], one of those that became this one.
    pub origin: Vec<u32>,
    pub normals: Option<Vec<Vec3>>,
    pub colors: Option<Vec<[f32; 4]>>,
    /// How far a vertex may have drifted off the surface, step by step, in the normalized frame; empty where the
    /// accumulated quadrics tell.
    pub drift: Vec<f32>,
    /// The input face of every live face, with the bit [`TURNED`] where it was turned over to agree with its neighbors.
    pub face_origin: Vec<u32>,
}

impl Carried {
    /// The greater drift of two vertices.
    pub fn drift(&self, first: u32, second: u32) -> f32 {
        let of = |v: u32| self.drift.get(v as usize).copied().unwrap_or(0.0);
        of(first).max(of(second))
    }

    /// Interpolates into `keep` at `t` of the way between the ends; its drift is given.
    pub fn contract(&mut self, keep: u32, [first, second]: [u32; 2], t: f32, drift: f32) {
        let (keep, first, second) = (keep as usize, first as usize, second as usize);
        if let Some(row) = self.drift.get_mut(keep) {
            *row = drift;
        }
        self.origin[keep] = match t {
            0.0 => self.origin[first],
            1.0 => self.origin[second],
            _ => self.origin[keep] | MOVED_FROM,
        };
        if let Some(normals) = &mut self.normals {
            let sum = normals[first] * (1.0 - t) + normals[second] * t;
            normals[keep] = sum.try_normalize().unwrap_or(normals[first]);
        }
        if let Some(colors) = &mut self.colors {
            let (a, b) = (colors[first], colors[second]);
            colors[keep] = std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t);
        }
    }

    /// Keeps the rows of live vertices: where the next entry of `new_vertex` is greater.
    pub fn compact(&mut self, new_vertex: &[u32]) {
        keep_live(&mut self.origin, new_vertex);
        if !self.drift.is_empty() {
            keep_live(&mut self.drift, new_vertex);
        }
        if let Some(normals) = &mut self.normals {
            keep_live(normals, new_vertex);
        }
        if let Some(colors) = &mut self.colors {
            keep_live(colors, new_vertex);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colors_blend_and_origins_survive_only_at_the_ends() {
        let mut carried = Carried {
            origin: vec![7, 8, 9],
            normals: None,
            colors: Some(vec![[0.0; 4], [1.0; 4], [0.5; 4]]),
            drift: vec![0.0; 3],
            face_origin: Vec::new(),
        };
        carried.contract(0, [0, 1], 0.25, 0.5);
        assert_eq!((carried.origin[0], carried.colors.as_ref().map(|c| c[0])), (7 | MOVED_FROM, Some([0.25; 4])));
        assert_eq!(carried.drift(0, 1), 0.5);
        carried.contract(0, [0, 2], 1.0, 0.5);
        assert_eq!(carried.origin[0], 9);
        carried.compact(&[0, 1, 1, 2]);
        assert_eq!(carried.origin, [9, 9]);
    }
}
