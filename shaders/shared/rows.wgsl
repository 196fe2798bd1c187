// Rows of the kernels' buffers. Twin: src/kernel/rows.rs

struct Position { x: f32, y: f32, z: f32, flags: u32 }
struct Face { a: u32, b: u32, c: u32 }
struct Contraction { keep: u32, gone: u32, x: f32, y: f32, z: f32, flags: u32 }
struct Normal { x: f32, y: f32, z: f32, root: f32 }
struct GradientOperator { bx: f32, by: f32, bz: f32, cx: f32, cy: f32, cz: f32, root: f32 }
struct Corners { cot_a: f32, cot_b: f32, cot_c: f32, area_a: f32, area_b: f32, area_c: f32 }
struct VolumeSum { xx: f32, xy: f32, xz: f32, yy: f32, yz: f32, zz: f32, nx: f32, ny: f32, nz: f32 }
struct BorderSum { xx: f32, xy: f32, xz: f32, yy: f32, yz: f32, zz: f32 }
struct PlaneQuadric {
    xx: f32, xy: f32, xz: f32, yy: f32, yz: f32, zz: f32,
    bx: f32, by: f32, bz: f32,
    c: f32,
    weight: f32,
}
struct QuadricBound { weight: f32, offset_sq: f32 }
struct FaceFit {
    nx: f32, ny: f32, nz: f32,
    aa: f32, ab: f32, ac: f32, bb: f32, bc: f32, cc: f32,
    a: f32, b: f32, c: f32,
    error: f32,
}
struct Site { x: u32, y: u32, z: u32 }
struct CellSum {
    xx: f32, xy: f32, xz: f32, yy: f32, yz: f32, zz: f32,
    bx: f32, by: f32, bz: f32,
    c: f32,
    weight: f32,
    x: f32, y: f32, z: f32,
    corners: f32,
}
struct Edge { half_edge: u32, across: u32 }
struct Candidate { key: u32, half_edge: u32 }
struct Threshold { pairs: u32, key: u32, passing: u32 }
struct TreeNode { low_x: f32, low_y: f32, low_z: f32, first: u32, high_x: f32, high_y: f32, high_z: f32, count: u32 }

fn xyz(p: Position) -> vec3f {
    return vec3f(p.x, p.y, p.z);
}

// n/√|n|.
fn weighted(n: Normal) -> vec3f {
    return vec3f(n.x, n.y, n.z);
}

fn doubled_area(n: Normal) -> vec3f {
    return scale3(weighted(n), n.root);
}

fn volume_matrix(sum: VolumeSum) -> Sym3 {
    return Sym3(sum.xx, sum.xy, sum.xz, sum.yy, sum.yz, sum.zz);
}

fn is_live(face: Face) -> bool {
    return face.a != face.b && face.b != face.c && face.c != face.a;
}
