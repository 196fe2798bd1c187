//! What vertices carry through a run without taking part: their origin, normals, colors.

use crate::math::Vec3;

use super::charts::{ChartRows, Charts};
use super::compact::keep_live;

/// Set in the origin of a vertex that stands at no input vertex's position; input vertices are below it.
pub const MOVED_FROM: u32 = 1 << 31;

/// Rows beside the positions, one a live vertex.
#[derive(Debug)]
pub struct Carried {
    /// The input vertex at the same position; or, with the bit [`MOVED_FROM`], one of those that became this one.
    pub origin: Vec<u32>,
    pub normals: Option<Vec<Vec3>>,
    pub colors: Option<Vec<[f32; 4]>>,
    /// Texture coordinates, where they are kept.
    pub charts: Option<Charts>,
    /// How far a vertex may have drifted off the surface, step by step, in the normalized frame; empty where the
    /// accumulated quadrics tell.
    pub drift: Vec<f32>,
    /// What a vertex counts; empty where all count the same, or the quadrics hold it already.
    pub weights: Vec<f32>,
    /// The input face of every live face, with the bit [`TURNED`](crate::mesh::orient::TURNED) where it was turned over to agree with its neighbors.
    pub face_origin: Vec<u32>,
}

impl Carried {
    /// The rows of all vertices, to change.
    pub fn rows(&mut self) -> CarriedRows<'_> {
        CarriedRows {
            origin: &mut self.origin,
            normals: self.normals.as_deref_mut().unwrap_or_default(),
            colors: self.colors.as_deref_mut().unwrap_or_default(),
            charts: self.charts.as_mut().map(Charts::rows),
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
        if let Some(normals) = &mut self.normals {
            keep_live(normals, new_vertex);
        }
        if let Some(colors) = &mut self.colors {
            keep_live(colors, new_vertex);
        }
        if let Some(charts) = &mut self.charts {
            charts.compact(new_vertex);
        }
    }
}

/// The rows of consecutive vertices; empty where nothing of the kind is carried.
#[derive(Debug)]
pub struct CarriedRows<'a> {
    origin: &'a mut [u32],
    normals: &'a mut [Vec3],
    colors: &'a mut [[f32; 4]],
    pub charts: Option<ChartRows<'a>>,
    drift: &'a mut [f32],
    weights: &'a mut [f32],
}

impl CarriedRows<'_> {
    /// The greater drift of two vertices.
    pub fn drift(&self, first: usize, second: usize) -> f32 {
        let of = |v: usize| self.drift.get(v).copied().unwrap_or(0.0);
        of(first).max(of(second))
    }

    /// The weights of two vertices, where they have any.
    pub fn weights(&self, [first, second]: [usize; 2]) -> Option<[f32; 2]> {
        Some([*self.weights.get(first)?, *self.weights.get(second)?])
    }

    /// Interpolates into `keep` at `t` of the way between the ends; its drift is given.
    pub fn contract(&mut self, keep: usize, [first, second]: [usize; 2], t: f32, drift: f32) {
        if let Some(row) = self.drift.get_mut(keep) {
            *row = drift;
        }
        if let Some([first, second]) = self.weights([first, second]) {
            self.weights[keep] = first.max(second);
        }
        self.origin[keep] = match t {
            0.0 => self.origin[first],
            1.0 => self.origin[second],
            _ => self.origin[keep] | MOVED_FROM,
        };
        if !self.normals.is_empty() {
            let sum = self.normals[first] * (1.0 - t) + self.normals[second] * t;
            self.normals[keep] = sum.try_normalize().unwrap_or(self.normals[first]);
        }
        if !self.colors.is_empty() {
            let (a, b) = (self.colors[first], self.colors[second]);
            self.colors[keep] = std::array::from_fn(|i| a[i] * (1.0 - t) + b[i] * t);
        }
    }
}

impl<'a> CarriedRows<'a> {
    /// The first `size` rows and the others.
    pub fn split_at(self, size: usize) -> (Self, Self) {
        let (origin, other_origin) = self.origin.split_at_mut(size);
        let (normals, other_normals) = split(self.normals, size);
        let (colors, other_colors) = split(self.colors, size);
        let (charts, other_charts) = self.charts.map(|rows| rows.split_at(size)).unzip();
        let (drift, other_drift) = split(self.drift, size);
        let (weights, other_weights) = split(self.weights, size);
        let others = Self {
            origin: other_origin,
            normals: other_normals,
            colors: other_colors,
            charts: other_charts,
            drift: other_drift,
            weights: other_weights,
        };
        (Self { origin, normals, colors, charts, drift, weights }, others)
    }
}

/// Splits rows that may not be there.
fn split<T>(rows: &mut [T], size: usize) -> (&mut [T], &mut [T]) {
    rows.split_at_mut(size.min(rows.len()))
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
            charts: None,
            drift: vec![0.0; 3],
            weights: Vec::new(),
            face_origin: Vec::new(),
        };
        carried.rows().contract(0, [0, 1], 0.25, 0.5);
        assert_eq!((carried.origin[0], carried.colors.as_ref().map(|c| c[0])), (7 | MOVED_FROM, Some([0.25; 4])));
        assert_eq!(carried.rows().drift(0, 1), 0.5);
        carried.rows().contract(0, [0, 2], 1.0, 0.5);
        assert_eq!(carried.origin[0], 9);
        carried.compact(&[0, 1, 1, 2]);
        assert_eq!(carried.origin, [9, 9]);
    }
}
