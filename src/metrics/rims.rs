//! Where the charts of a texture end: edges that no second face has with the same points and the same places.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::mesh::Mesh;

/// A corner by its point and its place in the texture, to the bit.
type Corner = ([u64; 3], [u32; 2]);

/// Of each of these faces of a mesh with texture coordinates, as bits, which edges are on a rim: from the corner of that number
/// to the next.
pub(super) fn rims_of(mesh: &Mesh, faces: &[u32]) -> Vec<u8> {
    let Some(texcoords) = &mesh.texcoords else { return vec![0; faces.len()] };
    let mut numbers: FxHashMap<Corner, u32> = FxHashMap::default();
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(3 * faces.len());
    for (number, &face) in (0..).zip(faces) {
        let corners = [0, 1, 2].map(|k| {
            let point = mesh.positions[mesh.faces[face as usize][k] as usize].to_array();
            // Plus zero: negative zeros are zeros.
            let corner = (
                point.map(|x| (x + 0.0).to_bits()),
                texcoords[face as usize][k].to_array().map(|x| (x + 0.0).to_bits()),
            );
            let next = numbers.len() as u32;
            *numbers.entry(corner).or_insert(next)
        });
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            edges.push(([a.min(b), a.max(b)], 3 * number + k as u32));
        }
    }
    edges.par_sort_unstable();
    let mut rims = vec![0; faces.len()];
    for alike in edges.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, edge)] = alike {
            rims[*edge as usize / 3] |= 1 << (edge % 3);
        }
    }
    rims
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;
    use crate::mesh::shapes;

    /// A sheet whose texture is cut along its middle column: the rims are its border, and both sides of the cut.
    #[test]
    fn rims_are_borders_and_cuts() {
        let (width, middle) = (6, 3);
        let mut mesh = shapes::plane(width, width);
        let column = |v: u32| v % (width + 1);
        let cut = |face: &[u32; 3]| face.iter().any(|&v| column(v) > middle);
        let place = |face: &[u32; 3]| {
            let shift = if cut(face) { 10.0 } else { 0.0 };
            face.map(|v| Vec2::new(column(v) as f32 + shift, (v / (width + 1)) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().map(place).collect());
        let faces: Vec<u32> = (0..mesh.faces.len() as u32).collect();
        let count = |rims: Vec<u8>| rims.iter().map(|edges| edges.count_ones()).sum::<u32>();
        assert_eq!(count(rims_of(&mesh, &faces)), 4 * 6 + 2 * 6);
        // Of vertices of its own each face has the same rims, and alone all of them.
        let mut split = mesh.clone();
        split.positions = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
        split.faces = faces.iter().map(|&face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
        assert_eq!(rims_of(&split, &faces), rims_of(&mesh, &faces));
        assert_eq!(rims_of(&mesh, &faces[..1]), [0b111]);
    }
}
