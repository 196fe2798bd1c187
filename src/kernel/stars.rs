//! The faces around a vertex. In WGSL: `shaders/shared/stars.wgsl`.

use super::rows::{Face, Position};
use crate::backend::Buffer;
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, divide, flush3, scale3};

/// The live mesh as kernels see it.
#[derive(Debug, Clone, Copy)]
pub struct Stars<'a> {
    /// V positions.
    pub positions: &'a [Position],
    /// F faces.
    pub faces: &'a [Face],
    /// V + 1 starts into `ring_faces`.
    pub ring_starts: &'a [u32],
    /// The faces around every vertex, ascending.
    pub ring_faces: &'a [u32],
}

impl<'a> Stars<'a> {
    /// The mesh in these buffers of the host.
    pub fn on_host(
        positions: &'a Buffer<Position>,
        faces: &'a Buffer<Face>,
        ring_starts: &'a Buffer<u32>,
        ring_faces: &'a Buffer<u32>,
    ) -> Self {
        Self {
            positions: positions.host(),
            faces: faces.host(),
            ring_starts: ring_starts.host(),
            ring_faces: ring_faces.host(),
        }
    }

    /// The faces around a vertex.
    #[inline(always)]
    pub fn ring(&self, vertex: u32) -> &'a [u32] {
        &self.ring_faces[self.ring_starts[vertex as usize] as usize..self.ring_starts[vertex as usize + 1] as usize]
    }
}

/// A face seen from one of its corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Spoke {
    /// Which corner, from 0 to 2.
    pub corner: u32,
    /// The corner after it.
    pub next: u32,
    /// The corner before it.
    pub last: u32,
}

/// A face from its corner `vertex`.
#[inline(always)]
pub fn spoke(face: Face, vertex: u32) -> Spoke {
    let (is_b, is_c) = (face.b == vertex, face.c == vertex);
    Spoke {
        corner: u32::from(is_b) + 2 * u32::from(is_c),
        next: if is_c {
            face.a
        } else if is_b {
            face.c
        } else {
            face.b
        },
        last: if is_c {
            face.b
        } else if is_b {
            face.a
        } else {
            face.c
        },
    }
}

/// A vector by its length; zero where that is.
#[inline(always)]
pub fn unit(n: Vec3, length: f32) -> Vec3 {
    flush3(scale3(n, divide(1.0, length)), LEAST_FACTOR)
}

/// Whether a face has this vertex as a corner.
#[inline(always)]
pub fn has(face: Face, vertex: u32) -> bool {
    face.a == vertex || face.b == vertex || face.c == vertex
}

/// How many faces of the ring of `around` have this vertex as a corner.
#[inline(always)]
pub fn faces_with(vertex: u32, around: u32, stars: &Stars<'_>) -> u32 {
    let mut count = 0;
    for &f in stars.ring(around) {
        if has(stars.faces[f as usize], vertex) {
            count += 1;
        }
    }
    count
}
