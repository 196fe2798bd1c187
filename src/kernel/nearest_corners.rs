//! The corner of every piece nearest to its cell's representative, the lowest vertex among the equally near. Twin:
//! `shaders/nearest_corners.wgsl`, line for line.

use rayon::prelude::*;

use super::cells::{Pieces, cell_box, is_in};
use super::rows::{Face, Site};
use crate::backend::{Access, Binding, Buffer, Kernel, params};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, dot3, flush3, sub3};

/// The nearest before any corner.
const NOTHING: [u32; 2] = [u32::MAX, u32::MAX];

/// One invocation a piece.
pub struct NearestCorners<'a> {
    /// V sites.
    pub sites: &'a Buffer<Site>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// The site of the first vertex of every cell.
    pub origins: &'a Buffer<Site>,
    /// The cell of every piece and where its faces start; one more that ends the last.
    pub pieces: &'a Buffer<[u32; 2]>,
    /// The faces of every cell, ascending.
    pub piece_faces: &'a Buffer<u32>,
    /// The point of every cell.
    pub representatives: &'a Buffer<[f32; 4]>,
    /// P.
    pub piece_count: u32,
    /// Steps to the side of a cell.
    pub steps: u32,
    /// Units a step: a power of two.
    pub unit: f32,
    /// Writes for P pieces the bits of the squared distance in units, which order as it does, and the vertex.
    pub nearest: &'a mut Buffer<[u32; 2]>,
}

params! {
    /// The uniform block.
    pub struct Params {
        steps: u32,
        unit: f32,
    }
}

/// The nearer of what is nearest so far and the vertex at `p`.
#[inline(always)]
fn nearer(nearest: [u32; 2], vertex: u32, p: Vec3, x: Vec3) -> [u32; 2] {
    let away = flush3(sub3(p, x), LEAST_FACTOR);
    let key = dot3(away, away).to_bits();
    if key < nearest[0] || (key == nearest[0] && vertex < nearest[1]) {
        return [key, vertex];
    }
    nearest
}

impl Kernel for NearestCorners<'_> {
    const NAME: &'static str = "nearest_corners";
    const SOURCE: &'static str = include_str!("../../shaders/nearest_corners.wgsl");
    const SHARED: &'static [&'static str] = &[include_str!("../../shaders/shared/cells.wgsl")];
    type Params = Params;
    const PARAMS: &'static [(&'static str, &'static str)] = Params::FIELDS;

    fn params(&self) -> Params {
        Params { steps: self.steps, unit: self.unit }
    }

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("sites", Access::Read, self.sites),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("origins", Access::Read, self.origins),
            Binding::new("pieces", Access::Read, self.pieces),
            Binding::new("piece_faces", Access::Read, self.piece_faces),
            Binding::new("representatives", Access::Read, self.representatives),
            Binding::new("nearest", Access::Write, self.nearest),
        ]
    }

    fn invocations(&self) -> u32 {
        self.piece_count
    }

    fn run_cpu(&mut self) {
        let mesh = Pieces {
            sites: self.sites.host(),
            faces: self.faces.host(),
            origins: self.origins.host(),
            pieces: self.pieces.host(),
            piece_faces: self.piece_faces.host(),
        };
        let Self { steps, unit, .. } = *self;
        let points = self.representatives.host();
        let rows = &mut self.nearest.host_mut()[..self.piece_count as usize];
        rows.par_iter_mut().enumerate().with_min_len(16).for_each(|(piece, row)| {
            let number = mesh.pieces[piece][0] as usize;
            let origin = mesh.origins[number];
            let cell = cell_box(origin, steps, unit);
            let [x, y, z, _] = points[number];
            *row = NOTHING;
            for &face in mesh.faces_of(piece) {
                let vertices = mesh.faces[face as usize].corners();
                for (vertex, p) in vertices.into_iter().zip(mesh.corners_about(face, origin, unit)) {
                    if is_in(p, cell) {
                        *row = nearer(*row, vertex, p, Vec3::new(x, y, z));
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lowest_of_the_equally_near_is_taken() {
        let far = nearer(NOTHING, 5, Vec3::X * 2.0, Vec3::ZERO);
        assert_eq!(far, [4.0_f32.to_bits(), 5]);
        let near = nearer(far, 9, Vec3::Y, Vec3::ZERO);
        assert_eq!(near, [1.0_f32.to_bits(), 9]);
        assert_eq!(nearer(near, 7, Vec3::Z, Vec3::ZERO)[1], 7);
        assert_eq!(nearer(near, 11, Vec3::Z, Vec3::ZERO)[1], 9);
    }
}
