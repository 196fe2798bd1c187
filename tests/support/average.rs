//! Average quadrics from the definition, in double precision. [Yu14]

use std::collections::BTreeMap;

use coarsen::Mesh;
use coarsen::math::DVec3;
use coarsen::mesh::sample;

use super::shapes::{bumpy, grid, sphere, torus};

/// xx, xy, xz, xd, yy, yz, yd, zz, zd, dd.
pub type Entries = [f64; 10];

/// p pᵀ.
pub fn outer([a, b, c, d]: [f64; 4]) -> Entries {
    [a * a, a * b, a * c, a * d, b * b, b * c, b * d, c * c, c * d, d * d]
}

/// The sum of some.
pub fn sum(quadrics: impl IntoIterator<Item = Entries>) -> Entries {
    quadrics.into_iter().fold([0.0; 10], |sum, q| std::array::from_fn(|i| sum[i] + q[i]))
}

/// A multiple.
pub fn times(q: Entries, by: f64) -> Entries {
    q.map(|entry| entry * by)
}

/// (x, 1)ᵀ Q (x, 1).
pub fn at(q: Entries, p: DVec3) -> f64 {
    let DVec3 { x, y, z } = p;
    let square = q[0] * x * x + q[4] * y * y + q[7] * z * z;
    square + 2.0 * (q[1] * x * y + q[2] * x * z + q[5] * y * z + q[3] * x + q[6] * y + q[8] * z) + q[9]
}

/// The planes (n, d) of every vertex: of its faces, and across its border edges, as the metric `plane` has them.
pub fn planes(mesh: &Mesh) -> Vec<Vec<[f64; 4]>> {
    let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
    let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    for [u, w] in mesh.faces.iter().flat_map(|&face| sides(face)) {
        *uses.entry([u.min(w), u.max(w)]).or_default() += 1;
    }
    let mut planes = vec![Vec::new(); mesh.positions.len()];
    for &face in &mesh.faces {
        let [p0, p1, p2] = face.map(|v| mesh.positions[v as usize]);
        let Some(n) = (p1 - p0).cross(p2 - p0).try_normalize() else { continue };
        face.iter().for_each(|&v| planes[v as usize].push([n.x, n.y, n.z, -n.dot(p0)]));
        for [u, w] in sides(face) {
            if uses[&[u.min(w), u.max(w)]] == 1 {
                let from = mesh.positions[u as usize];
                let across = (mesh.positions[w as usize] - from).cross(n).normalize();
                [u, w].iter().for_each(|&v| {
                    planes[v as usize].push([across.x, across.y, across.z, -across.dot(from)]);
                });
            }
        }
    }
    planes
}

/// MaxNum and Maxd2.
pub fn greatest(planes: &[Vec<[f64; 4]>]) -> (usize, f64) {
    let max_num = planes.iter().map(Vec::len).max().unwrap_or(0);
    (max_num, planes.iter().flatten().map(|p| p[3] * p[3]).fold(0.0, f64::max))
}

/// The average quadrics from lists of planes that are padded with zeros to `slots`, one slot of all vertices after the other.
pub fn averages_of_padded(planes: &[Vec<[f64; 4]>], slots: usize) -> Vec<Entries> {
    let (_, max_d2) = greatest(planes);
    let scale = max_d2.max(1.0).sqrt().recip();
    let count = planes.len();
    let mut padded = vec![[0.0; 4]; slots * count];
    for (v, planes) in planes.iter().enumerate() {
        planes.iter().enumerate().for_each(|(k, plane)| padded[k * count + v] = plane.map(|x| x * scale));
    }
    let of = |v: usize| sum((0..slots).map(|k| outer(padded[k * count + v])));
    (0..count).map(|v| times(of(v), 1.0 / slots as f64)).collect()
}

/// In half the diagonal of the box, about its middle.
pub fn normalized(mesh: &Mesh) -> Mesh {
    let (low, high) = mesh.bounds();
    let positions = mesh.positions.iter().map(|&p| (p - (low + high) / 2.0) * (2.0 / (high - low).length()));
    Mesh::new(positions.collect(), mesh.faces.clone())
}

/// Closed and open, near the origin and far off it.
pub fn meshes() -> Vec<(&'static str, Mesh)> {
    let mut far = bumpy(torus(24, 12), 0.05);
    far.positions.iter_mut().for_each(|p| *p = *p * 3.0 + DVec3::new(20.0, -7.0, 4.0));
    vec![
        ("ball", bumpy(sphere(3), 0.15)),
        ("torus", far),
        ("sheet", bumpy(grid(9, 7), 0.3)),
        ("part", sample("part", Some(2000)).expect("a sample")),
    ]
}
