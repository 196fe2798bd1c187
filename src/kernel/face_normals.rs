//! The normal of every face, and the root of its length. Twin: `shaders/face_normals.wgsl`, line for line.
//!
//! Once a face instead of once for each corner and each side, and the same bits in all: what a pair subtracts for its
//! shared faces is what the sums of its ends have added.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::rows::{Face, Normal, Position};
use super::split::{CHUNK, rows_each};
use crate::backend::{Access, Binding, Buffer, Kernel};
use crate::math::Vec3;
use crate::math::exact::{LEAST_FACTOR, cross3, divide, dot3, flush3, root, scale3, sub3};
use crate::math::lanes::{self, Columns, LANES, Lane, QUAD, Quad};

/// Faces of a task of the host, at least and at most.
const FACES_EACH: [usize; 2] = [1 << 10, CHUNK];

/// One invocation a face.
pub struct FaceNormals<'a> {
    /// V positions.
    pub positions: &'a Buffer<Position>,
    /// F faces.
    pub faces: &'a Buffer<Face>,
    /// F.
    pub face_count: u32,
    /// Writes F normals.
    pub normals: &'a mut Buffer<Normal>,
}

/// The corners of a face.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
struct Corners {
    a: Vec3,
    b: Vec3,
    c: Vec3,
}

const CORNER_WORDS: usize = size_of::<Corners>() / 4;

#[inline(always)]
fn face_normal(a: Vec3, b: Vec3, c: Vec3) -> Normal {
    let n = flush3(cross3(sub3(b, a), sub3(c, a)), LEAST_FACTOR);
    let root = root(root(dot3(n, n)));
    let weighted = flush3(scale3(n, divide(1.0, root)), LEAST_FACTOR);
    Normal { x: weighted.x, y: weighted.y, z: weighted.z, root }
}

impl Lane for Corners {
    type Source<'a> = (&'a [Position], &'a [Face]);
    type Params = ();
    type Output = Normal;

    #[inline(always)]
    fn gather(indices: [usize; QUAD], (positions, faces): Self::Source<'_>, lanes: &mut Quad<'_>) {
        let faces = indices.map(|index| &faces[index]);
        lanes.put::<_, 3>(faces.map(|face| &positions[face.a as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.b as usize]));
        lanes.put::<_, 3>(faces.map(|face| &positions[face.c as usize]));
    }

    #[inline(always)]
    fn compute(self, (): ()) -> Normal {
        face_normal(self.a, self.b, self.c)
    }
}

impl Kernel for FaceNormals<'_> {
    const NAME: &'static str = "face_normals";
    const SOURCE: &'static str = include_str!("../../shaders/face_normals.wgsl");
    type Params = ();
    const PARAMS: &'static [(&'static str, &'static str)] = &[];

    fn params(&self) {}

    fn bindings(&self) -> Vec<Binding<'_>> {
        vec![
            Binding::new("positions", Access::Read, self.positions),
            Binding::new("faces", Access::Read, self.faces),
            Binding::new("normals", Access::Write, self.normals),
        ]
    }

    fn invocations(&self) -> u32 {
        self.face_count
    }

    fn run_cpu(&mut self) {
        let source = (self.positions.host(), self.faces.host());
        let blocks = self.normals.host_mut()[..self.face_count as usize].par_chunks_mut(LANES).enumerate();
        blocks.with_min_len(rows_each(self.face_count as usize, FACES_EACH) / LANES).for_each_init(
            Columns::<Corners, CORNER_WORDS>::new,
            |block, (i, normals)| {
                lanes::compute(i * LANES, source, (), block, normals);
            },
        );
    }
}
