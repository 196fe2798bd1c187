//! Procedural meshes for the oracles, built without the library.

use std::collections::BTreeMap;

use coarsen::Mesh;
use coarsen::math::DVec3;

/// A mesh from rows of coordinates.
pub fn mesh(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Mesh {
    Mesh::new(positions.iter().map(|&p| DVec3::from_array(p)).collect(), faces.to_vec())
}

/// The unit sphere: an octahedron whose faces are split in four `levels` times; 8·4^levels faces, closed.
pub fn sphere(levels: u32) -> Mesh {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let mut positions = vec![x, -x, y, -y, z, -z];
    let mut faces: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..levels {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh::new(positions, faces)
}

/// `columns` × `rows` unit squares in the plane z = 0, each cut in two.
pub fn grid(columns: u32, rows: u32) -> Mesh {
    let at = |i: u32, j: u32| j * (columns + 1) + i;
    let positions = (0..=rows).flat_map(|j| (0..=columns).map(move |i| DVec3::new(f64::from(i), f64::from(j), 0.0)));
    let faces = (0..rows).flat_map(|j| {
        (0..columns)
            .flat_map(move |i| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
    });
    Mesh::new(positions.collect(), faces.collect())
}

/// A torus of radii 1 and 0.4 with `around` × `across` squares, each cut in two; closed, genus 1.
pub fn torus(around: u32, across: u32) -> Mesh {
    let angle = |i: u32, n: u32| std::f64::consts::TAU * f64::from(i) / f64::from(n);
    let at = |i: u32, j: u32| (j % across) * around + i % around;
    let point = |i: u32, j: u32| {
        let (outer, inner) = (angle(i, around), angle(j, across));
        let radius = 1.0 + 0.4 * inner.cos();
        DVec3::new(radius * outer.cos(), radius * outer.sin(), 0.4 * inner.sin())
    };
    let positions = (0..across).flat_map(|j| (0..around).map(move |i| point(i, j)));
    let faces = (0..across).flat_map(|j| {
        (0..around)
            .flat_map(move |i| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
    });
    Mesh::new(positions.collect(), faces.collect())
}

/// The cube `[0, 1]³` with every side cut into `cells` × `cells` squares of two faces; closed.
pub fn cube(cells: u32) -> Mesh {
    let mut vertices = BTreeMap::new();
    let mut mesh = Mesh::default();
    // Each side: a corner and two directions whose cross product points out.
    let sides = [
        ([0, 0, 0], [0, 1, 0], [1, 0, 0]),
        ([0, 0, 1], [1, 0, 0], [0, 1, 0]),
        ([0, 0, 0], [1, 0, 0], [0, 0, 1]),
        ([0, 1, 0], [0, 0, 1], [1, 0, 0]),
        ([0, 0, 0], [0, 0, 1], [0, 1, 0]),
        ([1, 0, 0], [0, 1, 0], [0, 0, 1]),
    ];
    for (corner, across, up) in sides {
        let mut at = |i: u32, j: u32| {
            let lattice: [u32; 3] = std::array::from_fn(|k| corner[k] * cells + across[k] * i + up[k] * j);
            *vertices.entry(lattice).or_insert_with(|| {
                mesh.positions.push(DVec3::from_array(lattice.map(|c| f64::from(c) / f64::from(cells))));
                mesh.positions.len() as u32 - 1
            })
        };
        for (i, j) in (0..cells).flat_map(|i| (0..cells).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// Moves every vertex by a smooth bumpy field of this amplitude: waves of three lengths, no symmetry.
pub fn bumpy(mut mesh: Mesh, amplitude: f64) -> Mesh {
    for p in &mut mesh.positions {
        let wave = |k: f64, shift: f64| {
            let q = *p * k + DVec3::splat(shift);
            DVec3::new((q.y + 0.7 * q.z).sin(), (q.z + 0.6 * q.x).sin(), (q.x + 0.8 * q.y).sin())
        };
        *p += amplitude * (wave(2.3, 0.4) + 0.5 * wave(5.1, 1.3) + 0.25 * wave(11.7, 2.9));
    }
    mesh
}

/// The volume enclosed by a closed mesh (signed: positive with faces counter-clockwise from outside).
pub fn volume(mesh: &Mesh) -> f64 {
    let corner = |v: u32| mesh.positions[v as usize];
    mesh.faces.iter().map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0).sum()
}

/// A box of 6·n² squares, n a power of two, whose sides have vertices and normals of their own.
pub fn boxed(n: u32) -> Mesh {
    let mut mesh = Mesh { normals: Some(Vec::new()), ..Mesh::default() };
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let normal = DVec3::AXES[axis] * sign;
            let (e, f) = (DVec3::AXES[(axis + 1) % 3] * sign, DVec3::AXES[(axis + 2) % 3]);
            let first = mesh.positions.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
                    mesh.positions.push(normal + e * at(i) + f * at(j));
                    mesh.normals.as_mut().expect("normals").push(normal.as_vec3());
                }
            }
            let v = |i: u32, j: u32| first + i * (n + 1) + j;
            for i in 0..n {
                for j in 0..n {
                    mesh.faces.push([v(i, j), v(i + 1, j), v(i + 1, j + 1)]);
                    mesh.faces.push([v(i, j), v(i + 1, j + 1), v(i, j + 1)]);
                }
            }
        }
    }
    mesh
}
