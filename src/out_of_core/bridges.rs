//! Edges that a part made between frozen vertices: another part may have made the same, and together they would pinch the
//! surface. Each gets a vertex between its ends, which changes no shape and which the last pass may contract.

use rustc_hash::{FxHashMap, FxHashSet};

use super::part::Part;
use crate::math::{DVec3, Vec3};
use crate::mesh::Mesh;
use crate::simplify::{MOVED, Outcome};

/// A position to compare with: two vertices at one are one.
type Key = [u64; 3];

/// Multiples of it lie apart from each other, less their whole parts.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// The key of a position; adding zero turns -0.0 into 0.0.
pub fn key(position: DVec3) -> Key {
    (position + 0.0).to_array().map(f64::to_bits)
}

/// Splits the edges between frozen vertices of `outcome` that `part` did not have, and the faces of three such vertices.
///
/// Where on the edge depends on the `number` of the part: vertices of two parts at one position would be joined.
pub fn split(part: &Part, number: usize, outcome: &mut Outcome) {
    let along = 0.35 + 0.3 * (number as f64 * GOLDEN).fract();
    let before = Frozen::of(&part.mesh, |v| part.frozen[v as usize]);
    let is_frozen: Vec<bool> =
        outcome.vertex_origin.iter().map(|&origin| origin != MOVED && part.frozen[origin as usize]).collect();
    let mesh = &mut outcome.mesh;
    let mut middles: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let mut faces = Vec::with_capacity(mesh.faces.len());
    for face in std::mem::take(&mut mesh.faces) {
        let frozen = face.map(|v| is_frozen[v as usize]);
        let middle = |mesh: &mut Mesh, middles: &mut FxHashMap<[u32; 2], u32>, side: [usize; 2]| {
            let ends = side.map(|i| face[i]);
            let is_new = side.iter().all(|&i| frozen[i]) && !before.edges.contains(&edge(mesh, ends));
            is_new.then(|| {
                *middles
                    .entry([ends[0].min(ends[1]), ends[0].max(ends[1])])
                    .or_insert_with(|| add(mesh, &ordered(mesh, ends), along))
            })
        };
        let sides = [[0, 1], [1, 2], [2, 0]].map(|side| middle(mesh, &mut middles, side));
        if sides == [None; 3] && frozen == [true; 3] && !before.faces.contains(&corners(mesh, face)) {
            let center = add(mesh, &face, along);
            let [a, b, c] = face;
            faces.extend([[a, b, center], [b, c, center], [c, a, center]]);
        } else {
            push_split(face, sides, &mut faces);
        }
    }
    mesh.faces = faces;
    outcome.vertex_origin.resize(mesh.positions.len(), MOVED);
}

/// What a mesh has between frozen vertices alone.
struct Frozen {
    edges: FxHashSet<[Key; 2]>,
    faces: FxHashSet<[Key; 3]>,
}

impl Frozen {
    fn of(mesh: &Mesh, is_frozen: impl Fn(u32) -> bool) -> Self {
        let mut all = Self { edges: FxHashSet::default(), faces: FxHashSet::default() };
        for &face in &mesh.faces {
            let frozen = face.map(&is_frozen);
            for [i, j] in [[0, 1], [1, 2], [2, 0]] {
                if frozen[i] && frozen[j] {
                    all.edges.insert(edge(mesh, [face[i], face[j]]));
                }
            }
            if frozen == [true; 3] {
                all.faces.insert(corners(mesh, face));
            }
        }
        all
    }
}

fn edge(mesh: &Mesh, ends: [u32; 2]) -> [Key; 2] {
    let [a, b] = ends.map(|v| key(mesh.positions[v as usize]));
    [a.min(b), a.max(b)]
}

fn corners(mesh: &Mesh, face: [u32; 3]) -> [Key; 3] {
    let mut keys = face.map(|v| key(mesh.positions[v as usize]));
    keys.sort_unstable();
    keys
}

/// The ends of an edge, in the order of their positions.
fn ordered(mesh: &Mesh, [a, b]: [u32; 2]) -> [u32; 2] {
    if key(mesh.positions[a as usize]) < key(mesh.positions[b as usize]) { [a, b] } else { [b, a] }
}

/// Adds a vertex between others: this share is the first one's.
fn add(mesh: &mut Mesh, of: &[u32], first: f64) -> u32 {
    let share = (1.0 - first) / (of.len() - 1) as f64;
    let shares = || of.iter().map(|&v| v as usize).zip(std::iter::once(first).chain(std::iter::repeat(share)));
    let position = shares().map(|(v, share)| mesh.positions[v] * share).sum();
    mesh.positions.push(position);
    if let Some(normals) = &mut mesh.normals {
        let sum: Vec3 = shares().map(|(v, share)| normals[v] * share as f32).sum();
        normals.push(sum.normalize_or_zero());
    }
    if let Some(colors) = &mut mesh.colors {
        let mean = |i: usize| shares().map(|(v, share)| colors[v][i] * share as f32).sum::<f32>();
        colors.push(std::array::from_fn(mean));
    }
    (mesh.positions.len() - 1) as u32
}

/// Adds `face` split at the middles of its sides: from the first corner to the second, and so on.
fn push_split(face: [u32; 3], sides: [Option<u32>; 3], out: &mut Vec<[u32; 3]>) {
    let turn = |by: usize| ([0, 1, 2].map(|i| face[(i + by) % 3]), [0, 1, 2].map(|i| sides[(i + by) % 3]));
    // With one middle it stands on the first side, with two on the first and the second.
    let (face, sides) = match sides {
        [None, Some(_), None] | [None, Some(_), Some(_)] => turn(1),
        [None, None, Some(_)] | [Some(_), None, Some(_)] => turn(2),
        _ => (face, sides),
    };
    let [a, b, c] = face;
    match sides {
        [Some(ab), Some(bc), Some(ca)] => out.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
        [Some(ab), Some(bc), None] => out.extend([[ab, b, bc], [a, ab, bc], [a, bc, c]]),
        [Some(ab), None, None] => out.extend([[a, ab, c], [ab, b, c]]),
        _ => out.push(face),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_split_face_covers_what_it_was_and_turns_as_it_did() {
        let corners =
            [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        let positions: Vec<DVec3> = corners.map(DVec3::from).to_vec();
        for bits in 0..8_u32 {
            let sides = [0, 1, 2].map(|i| (bits >> i & 1 != 0).then_some(3 + i));
            let mut faces = Vec::new();
            push_split([0, 1, 2], sides, &mut faces);
            assert_eq!(faces.len() as u32, 1 + bits.count_ones());
            let mesh = Mesh::new(positions.clone(), faces);
            assert!(mesh.faces.iter().all(|&face| mesh.cross(face).z > 0.0), "{bits}");
            assert_eq!(mesh.area(), 2.0, "{bits}");
            let uses = |v: u32| mesh.faces.iter().filter(|face| face.contains(&v)).count();
            assert!((0..3).all(|i| (uses(3 + i) > 0) == sides[i as usize].is_some()), "{bits}");
        }
    }
}
