//! The rows of the kernels' buffers. Declared again in `shaders/shared/rows.wgsl`; a test compares the layouts.

use bytemuck::{Pod, Zeroable};

use crate::backend::{Constant, row};
use crate::math::Vec3;
use crate::math::exact::{Sym3, scale3};

/// A vertex lies on a border edge.
pub const BORDER: u32 = 1;
/// A vertex may neither move nor vanish: others may only contract onto it.
pub const LOCKED: u32 = 2;
/// A vertex has more than [`HUB_FACES`] faces and takes part in no contraction.
pub const HUB: u32 = 4;
/// Parts met in a vertex: pairs there may change the topology.
pub const JOINED: u32 = 8;
/// A vertex is on a seam of the attributes: it may only move along the seam. Where it may not even do that, it is locked.
pub const SEAM: u32 = 16;
/// Seams begin, end or cross in a vertex, and yield there: others contract onto it, and only two such may do without one of them.
pub const CORNER: u32 = 32;
/// A vertex is locked whatever seams yield. Only the host looks at it.
pub const HELD: u32 = 64;
/// Faces around a vertex past which it is a hub: work at a vertex grows with its ring, and a ring of thousands shrinks by
/// the pairs on its rim. Real meshes stay below 100.
pub const HUB_FACES: u32 = 512;

/// The flags under their names in WGSL.
pub const FLAGS: &[(&str, Constant)] = &[
    ("BORDER", Constant::U32(BORDER)),
    ("LOCKED", Constant::U32(LOCKED)),
    ("HUB", Constant::U32(HUB)),
    ("HUB_FACES", Constant::U32(HUB_FACES)),
];

/// The flags of a vertex that now has this many faces.
#[inline(always)]
pub fn with_hub(flags: u32, faces: u32) -> u32 {
    if faces > HUB_FACES { flags | HUB } else { flags & !HUB }
}

/// A vertex position in the normalized frame (mean edge length about 1), with its flags.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Position {
    /// Coordinate along the first axis.
    pub x: f32,
    /// Coordinate along the second axis.
    pub y: f32,
    /// Coordinate along the third axis.
    pub z: f32,
    /// [`BORDER`], [`LOCKED`], [`HUB`], [`JOINED`], [`SEAM`], [`CORNER`] and [`HELD`].
    pub flags: u32,
}

impl Position {
    /// A vertex there.
    #[inline(always)]
    pub fn new(at: Vec3, flags: u32) -> Self {
        Self { x: at.x, y: at.y, z: at.z, flags }
    }

    /// The coordinates.
    #[inline(always)]
    pub fn xyz(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }
}

/// The corners of a face. A face with two equal corners is dead.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Face {
    /// First corner.
    pub a: u32,
    /// Second corner.
    pub b: u32,
    /// Third corner.
    pub c: u32,
}

impl Face {
    /// The corners in order.
    #[inline(always)]
    pub fn corners(self) -> [u32; 3] {
        [self.a, self.b, self.c]
    }

    /// Whether all corners differ.
    #[inline(always)]
    pub fn is_live(self) -> bool {
        self.a != self.b && self.b != self.c && self.c != self.a
    }
}

/// An accepted contraction: `gone` becomes `keep`, which moves.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Contraction {
    /// The vertex that stays.
    pub keep: u32,
    /// The vertex that vanishes.
    pub gone: u32,
    /// Placement along the first axis.
    pub x: f32,
    /// Placement along the second axis.
    pub y: f32,
    /// Placement along the third axis.
    pub z: f32,
    /// Flags of the new vertex.
    pub flags: u32,
}

/// The normal of a face, n = (b − a)×(c − a), in two parts: n/√|n|, whose outer product is n nᵀ/|n|, and √|n|.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct Normal {
    /// n/√|n| along the first axis.
    pub x: f32,
    /// n/√|n| along the second axis.
    pub y: f32,
    /// n/√|n| along the third axis.
    pub z: f32,
    /// √|n|.
    pub root: f32,
}

impl Normal {
    /// n/√|n|.
    #[inline(always)]
    pub fn weighted(self) -> Vec3 {
        Vec3::new(self.x, self.y, self.z)
    }

    /// n, as long as twice the area.
    #[inline(always)]
    pub fn doubled_area(self) -> Vec3 {
        scale3(self.weighted(), self.root)
    }
}

/// What turns the numbers at the corners of a face, a and the differences from it to b and c, into √|n| times their gradient.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a matrix of two columns, named by corner")]
pub struct GradientOperator {
    pub bx: f32,
    pub by: f32,
    pub bz: f32,
    pub cx: f32,
    pub cy: f32,
    pub cz: f32,
    /// √|n|.
    pub root: f32,
}

/// The cotangents at the corners of a face, and their shares of its area.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "named by corner")]
pub struct Corners {
    pub cot_a: f32,
    pub cot_b: f32,
    pub cot_c: f32,
    pub area_a: f32,
    pub area_b: f32,
    pub area_c: f32,
}

/// What the `volume` metric needs of a vertex: sums over the faces of its star of n nᵀ/|n| and n, the normals as long as
/// twice the area.
///
/// The vertex lies on all these planes, so about its own position the other terms of the quadric are zero.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a symmetric matrix and of a vector")]
pub struct VolumeSum {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
    pub nx: f32,
    pub ny: f32,
    pub nz: f32,
}

/// What border edges e at a vertex add: Σ |e|²·I − e eᵀ, the squared distance to their lines times |e|².
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a symmetric matrix")]
pub struct BorderSum {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
}

/// An accumulated quadric about its vertex's position p: q(x) = yᵀA y + 2 b·y + c with y = x − p.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a symmetric matrix and of a vector")]
pub struct PlaneQuadric {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
    pub bx: f32,
    pub by: f32,
    pub bz: f32,
    /// Constant term.
    pub c: f32,
    /// Sum of the planes' weights: √(q/weight) is a root mean squared distance.
    pub weight: f32,
}

/// What bounds the average quadric of a vertex, or of a block of them.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
pub struct QuadricBound {
    /// Sum of the planes' weights: their number where each counts 1.
    pub weight: f32,
    /// Greatest squared distance of a plane from the origin.
    pub offset_sq: f32,
}

/// A pair as its lower end lists it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Edge {
    /// The half-edge that stands for it: 3·face + corner.
    pub half_edge: u32,
    /// The face on its other side, or [`NO_FACE`](super::pairs::NO_FACE).
    pub across: u32,
}

/// A pair that passed the gate.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Candidate {
    /// The bits of its cost, which order as the cost does.
    pub key: u32,
    /// Its half-edge: 3·face + corner.
    pub half_edge: u32,
}

/// Which pairs pass the gate.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Threshold {
    /// How many pairs there are.
    pub pairs: u32,
    /// Those with keys below this pass.
    pub key: u32,
    /// How many those are.
    pub passing: u32,
}

/// A box of a bounding volume hierarchy, and what is in it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the corners of a box")]
pub struct TreeNode {
    pub low_x: f32,
    pub low_y: f32,
    pub low_z: f32,
    /// The first of two nodes below, which stand side by side, or of a leaf's triangles.
    pub first: u32,
    pub high_x: f32,
    pub high_y: f32,
    pub high_z: f32,
    /// Triangles of a leaf; 0 for an inner node.
    pub count: u32,
}

/// What the samples of a fit ask of a face: its unit normal n, the sums of w·vᵢ·vⱼ and of w·vᵢ·h over the samples with
/// weight w, corner weights v and height h along n, and the sum of w·|r|² with r the whole way to the sample.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a vector, a symmetric matrix and a vector, named by corner")]
pub struct FaceFit {
    pub nx: f32,
    pub ny: f32,
    pub nz: f32,
    pub aa: f32,
    pub ab: f32,
    pub ac: f32,
    pub bb: f32,
    pub bc: f32,
    pub cc: f32,
    pub a: f32,
    pub b: f32,
    pub c: f32,
    pub error: f32,
}

impl FaceFit {
    /// The unit normal; zero for a face without area.
    #[inline(always)]
    pub fn normal(self) -> Vec3 {
        Vec3::new(self.nx, self.ny, self.nz)
    }
}

/// A vertex on the lattice of vertex clustering, in steps below 2²⁴.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Pod, Zeroable)]
pub struct Site {
    /// Steps along the first axis, or [`UNUSED`](super::cell_keys::UNUSED).
    pub x: u32,
    /// Steps along the second axis.
    pub y: u32,
    /// Steps along the third axis.
    pub z: u32,
}

/// What faces tell a cell, about its first vertex and in units of about its side: the quadric xᵀA x − 2 b·x + c of their
/// planes weighted by area, and the sum of their corners inside.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[expect(missing_docs, reason = "the entries of a symmetric matrix and of vectors")]
pub struct CellSum {
    pub xx: f32,
    pub xy: f32,
    pub xz: f32,
    pub yy: f32,
    pub yz: f32,
    pub zz: f32,
    pub bx: f32,
    pub by: f32,
    pub bz: f32,
    /// Constant term.
    pub c: f32,
    /// Sum of the planes' weights.
    pub weight: f32,
    pub x: f32,
    pub y: f32,
    pub z: f32,
    /// Corners summed.
    pub corners: f32,
}

macro_rules! matrix {
    ($row:ty) => {
        impl $row {
            /// The symmetric matrix.
            #[inline(always)]
            pub fn matrix(self) -> Sym3 {
                Sym3 { xx: self.xx, xy: self.xy, xz: self.xz, yy: self.yy, yz: self.yz, zz: self.zz }
            }
        }
    };
}
matrix!(VolumeSum);
matrix!(BorderSum);
matrix!(PlaneQuadric);
matrix!(CellSum);

impl VolumeSum {
    /// The sum of n.
    #[inline(always)]
    pub fn normal(self) -> Vec3 {
        Vec3::new(self.nx, self.ny, self.nz)
    }
}

impl PlaneQuadric {
    /// The linear term.
    #[inline(always)]
    pub fn linear(self) -> Vec3 {
        Vec3::new(self.bx, self.by, self.bz)
    }
}

row!(Position { x, y, z: f32; flags: u32 });
row!(Face { a, b, c: u32 });
row!(Contraction { keep, gone: u32; x, y, z: f32; flags: u32 });
row!(Normal { x, y, z, root: f32 });
row!(GradientOperator { bx, by, bz, cx, cy, cz, root: f32 });
row!(Corners { cot_a, cot_b, cot_c, area_a, area_b, area_c: f32 });
row!(VolumeSum { xx, xy, xz, yy, yz, zz, nx, ny, nz: f32 });
row!(BorderSum { xx, xy, xz, yy, yz, zz: f32 });
row!(PlaneQuadric { xx, xy, xz, yy, yz, zz, bx, by, bz, c, weight: f32 });
row!(QuadricBound { weight, offset_sq: f32 });
row!(Edge { half_edge, across: u32 });
row!(FaceFit { nx, ny, nz, aa, ab, ac, bb, bc, cc, a, b, c, error: f32 });
row!(Candidate { key, half_edge: u32 });
row!(Threshold { pairs, key, passing: u32 });
row!(Site { x, y, z: u32 });
row!(CellSum { xx, xy, xz, yy, yz, zz, bx, by, bz, c, weight, x, y, z, corners: f32 });
row!(TreeNode { low_x, low_y, low_z: f32; first: u32; high_x, high_y, high_z: f32; count: u32 });
