//! What becomes of textures, by slow and obvious means.

use std::collections::{BTreeMap, BTreeSet};

use coarsen::Mesh;
use coarsen::math::{DVec2, DVec3, Vec2};

/// The mesh with these texture coordinates at its vertices.
pub fn textured(mut mesh: Mesh, uv: impl Fn(DVec3) -> [f64; 2]) -> Mesh {
    let at = |v: u32| DVec2::from(uv(mesh.positions[v as usize])).as_vec2();
    mesh.texcoords = Some(mesh.faces.iter().map(|face| face.map(at)).collect());
    mesh
}

/// The texture coordinates of a mesh that has them.
pub fn rows(mesh: &Mesh) -> &[[Vec2; 3]] {
    mesh.texcoords.as_deref().expect("texture coordinates")
}

/// Twice the area of a face in the texture, with its sign; 0 for less than a millionth of its longest side's square.
pub fn area(uv: &[Vec2; 3]) -> f64 {
    let [a, b, c] = uv.map(Vec2::as_dvec2);
    let area = (b - a).perp_dot(c - a);
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    if area.abs() > 1e-6 * longest { area } else { 0.0 }
}

/// A face at an edge, with the bits of its coordinates at either end.
type Use = (usize, [[u32; 2]; 2]);

/// Edges by the positions of their ends; for each its faces.
fn edges(mesh: &Mesh) -> BTreeMap<[[u64; 3]; 2], Vec<Use>> {
    let mut edges = BTreeMap::<_, Vec<_>>::new();
    let bits = |v: u32| mesh.positions[v as usize].to_array().map(|x| (x + 0.0).to_bits());
    for (f, (face, uv)) in mesh.faces.iter().zip(rows(mesh)).enumerate() {
        let corner = |i: usize| (bits(face[i % 3]), uv[i % 3].to_array().map(|x| (x + 0.0).to_bits()));
        for i in 0..3 {
            let mut ends = [corner(i), corner(i + 1)];
            ends.sort_unstable();
            edges.entry(ends.map(|end| end.0)).or_default().push((f, ends.map(|end| end.1)));
        }
    }
    edges
}

/// How many edges the texture folds over: two faces that agree at both ends and lie on the same side.
pub fn folds(mesh: &Mesh) -> usize {
    let uv = rows(mesh);
    let folds = |uses: &Vec<Use>| match uses[..] {
        [(f, at_f), (g, at_g)] => at_f == at_g && area(&uv[f]) * area(&uv[g]) < 0.0,
        _ => false,
    };
    edges(mesh).values().filter(|uses| folds(uses)).count()
}

/// The positions of the ends of all seams, as bits.
pub fn seam_ends(mesh: &Mesh) -> BTreeSet<[u64; 3]> {
    let edges = edges(mesh);
    let seams = edges.iter().filter(|(_, uses)| uses.iter().any(|used| used.1 != uses[0].1));
    seams.flat_map(|(ends, _)| *ends).collect()
}
