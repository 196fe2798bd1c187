//! Small surfaces whose counts, area and volume are known.

use rustc_hash::FxHashMap;

use super::Mesh;
use super::circle::unit_circle;
use crate::math::DVec3;

/// The regular tetrahedron in the cube from -1 to 1: V 4, F 4, area 8√3, volume 8/3.
pub fn tetrahedron() -> Mesh {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

/// The regular icosahedron in the unit sphere: V 12, F 20.
#[rustfmt::skip]
pub fn icosahedron() -> Mesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let corner = |i: usize| {
        let (short, long) = (if i & 1 == 0 { 1.0 } else { -1.0 }, if i & 2 == 0 { golden } else { -golden });
        let cycled = [[short, long, 0.0], [0.0, short, long], [long, 0.0, short]][i / 4];
        DVec3::from(cycled).normalize()
    };
    let faces = [
        [0, 1, 4], [0, 4, 8], [0, 6, 1], [0, 8, 9], [0, 9, 6], [1, 6, 11], [1, 10, 4], [1, 11, 10], [2, 3, 7], [2, 5, 3],
        [2, 7, 9], [2, 8, 5], [2, 9, 8], [3, 5, 10], [3, 10, 11], [3, 11, 7], [4, 5, 8], [4, 10, 5], [6, 7, 11], [6, 9, 7],
    ];
    Mesh::new((0..12).map(corner).collect(), faces.to_vec())
}

/// The icosahedron with every face cut in four `level` times, on the unit sphere: V 10·4^level + 2, F 20·4^level.
pub fn icosphere(level: u32) -> Mesh {
    (0..level).fold(icosahedron(), |mesh, _| {
        let Mesh { mut positions, faces, .. } = mesh;
        let mut middles = FxHashMap::default();
        let mut middle = |a: u32, b: u32| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        let cut = faces.into_iter().flat_map(|[a, b, c]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        });
        let faces = cut.collect();
        Mesh::new(positions, faces)
    })
}

/// The surface of the unit cells of a grid of `size` for which `solid` holds, each outer square cut in two.
///
/// Manifold when no two cells touch in an edge or a corner only.
pub fn voxels(size: [i32; 3], solid: impl Fn([i32; 3]) -> bool) -> Mesh {
    let inside = |cell: [i32; 3]| (0..3).all(|k| (0..size[k]).contains(&cell[k])) && solid(cell);
    let mut ids = FxHashMap::default();
    let mut mesh = Mesh::default();
    let [nx, ny, nz] = size;
    let cells = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    for cell in cells.filter(|&cell| inside(cell)) {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut beyond = cell;
                beyond[axis] += side * 2 - 1;
                if inside(beyond) {
                    continue;
                }
                let square = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[u, v]| {
                    let mut corner = cell;
                    corner[axis] += side;
                    corner[(axis + 1) % 3] += u;
                    corner[(axis + 2) % 3] += v;
                    *ids.entry(corner).or_insert_with(|| {
                        mesh.positions.push(DVec3::from(corner.map(f64::from)));
                        mesh.positions.len() as u32 - 1
                    })
                });
                let [a, b, c, d] = if side == 1 { square } else { [square[0], square[3], square[2], square[1]] };
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

/// The cube of `n` unit cells a side: V 6n² + 2, F 12n², area 6n², volume n³.
pub fn cube(n: u32) -> Mesh {
    voxels([n as i32; 3], |_| true)
}

/// A slab of 5 × 3 unit cells with two square holes: genus 2, V 48, F 100, area 50, volume 13.
pub fn double_torus() -> Mesh {
    voxels([5, 3, 1], |[x, y, _]| !(y == 1 && (x == 1 || x == 3)))
}

/// A flat grid of `nx` × `ny` unit squares, facing up: V (nx + 1)(ny + 1), F 2·nx·ny, one border.
pub fn plane(nx: u32, ny: u32) -> Mesh {
    let positions = (0..=ny).flat_map(|y| (0..=nx).map(move |x| DVec3::new(f64::from(x), f64::from(y), 0.0)));
    let at = |x: u32, y: u32| y * (nx + 1) + x;
    let squares = (0..ny).flat_map(|y| (0..nx).map(move |x| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]));
    Mesh::new(positions.collect(), squares.flat_map(halves).collect())
}

/// The side of an upright prism of `sides` squares inscribed in a unit cylinder of height 1, open above and below: V 2·sides, F 2·sides.
pub fn tube(sides: u32) -> Mesh {
    let rim = |z: f64| {
        (0..sides).map(move |i| {
            let (x, y) = unit_circle(f64::from(i) / f64::from(sides));
            DVec3::new(x, y, z)
        })
    };
    let squares = (0..sides).map(|i| {
        let next = (i + 1) % sides;
        [i, next, sides + next, sides + i]
    });
    Mesh::new(rim(0.0).chain(rim(1.0)).collect(), squares.flat_map(halves).collect())
}

/// A [`tube`] with both ends closed by fans around a middle vertex: V 2·sides + 2, F 4·sides.
pub fn cylinder(sides: u32) -> Mesh {
    let mut mesh = tube(sides);
    let (low, high) = (2 * sides, 2 * sides + 1);
    mesh.positions.extend([DVec3::ZERO, DVec3::Z]);
    for i in 0..sides {
        let next = (i + 1) % sides;
        mesh.faces.extend([[low, next, i], [high, sides + i, sides + next]]);
    }
    mesh
}

/// A torus about the z axis with radii 3 and 1, `nu` squares around the axis and `nv` around the tube: V nu·nv, F 2·nu·nv.
pub fn torus(nu: u32, nv: u32) -> Mesh {
    let position = |u: u32, v: u32| {
        let (x, y) = unit_circle(f64::from(u) / f64::from(nu));
        let (out, up) = unit_circle(f64::from(v) / f64::from(nv));
        DVec3::new(x * (3.0 + out), y * (3.0 + out), up)
    };
    let at = |u: u32, v: u32| (u % nu) * nv + v % nv;
    let squares = (0..nu).flat_map(|u| (0..nv).map(move |v| [at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)]));
    let positions = (0..nu).flat_map(|u| (0..nv).map(move |v| position(u, v)));
    Mesh::new(positions.collect(), squares.flat_map(halves).collect())
}

/// A strip of `n` squares with half a twist: V 2n, F 2n, one border, χ 0, no consistent orientation.
pub fn moebius(n: u32) -> Mesh {
    let edge = |i: u32| {
        let turns = f64::from(i) / f64::from(n);
        let ((x, y), (out, up)) = (unit_circle(turns), unit_circle(turns / 2.0));
        [0.5, -0.5].map(|side| DVec3::new(x * (2.0 + side * out), y * (2.0 + side * out), side * up))
    };
    let squares = (0..n).map(|i| {
        let [a, b] = [2 * i, 2 * i + 1];
        let [c, d] = if i + 1 < n { [2 * i + 2, 2 * i + 3] } else { [1, 0] };
        [a, c, d, b]
    });
    Mesh::new((0..n).flat_map(edge).collect(), squares.flat_map(halves).collect())
}

/// Three triangles on one edge: V 5, F 3, one non-manifold edge.
pub fn fan3() -> Mesh {
    let corners = [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]];
    Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]])
}

/// Two triangles that share one vertex only: V 5, F 2, one non-manifold vertex.
pub fn bow_tie() -> Mesh {
    let corners = [[0.0, 0.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]];
    Mesh::new(corners.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec(), vec![[0, 1, 2], [0, 3, 4]])
}

pub(super) fn halves([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// An icosahedron of diagonal about 3.4 and, after it, one of a tenth of that beside it.
#[cfg(test)]
pub fn large_and_small() -> Mesh {
    let mut mesh = icosahedron();
    let count = mesh.positions.len() as u32;
    let small: Vec<DVec3> = mesh.positions.iter().map(|&p| p * 0.1 + DVec3::X * 2.0).collect();
    let faces: Vec<[u32; 3]> = mesh.faces.iter().map(|face| face.map(|v| v + count)).collect();
    mesh.positions.extend(small);
    mesh.faces.extend(faces);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices, faces, Euler characteristic, borders.
    fn counts(mesh: &Mesh) -> [i64; 4] {
        mesh.check().expect("a shape is a valid mesh");
        let topology = super::super::topology(mesh);
        [topology.vertices as i64, topology.faces as i64, topology.euler, topology.border_loops as i64]
    }

    fn assert_close(value: f64, expected: f64) {
        assert!((value - expected).abs() <= 1e-12 * expected.abs(), "{value} is not {expected}");
    }

    #[test]
    fn counts_are_as_documented() {
        assert_eq!(counts(&tetrahedron()), [4, 4, 2, 0]);
        assert_eq!(counts(&icosahedron()), [12, 20, 2, 0]);
        assert_eq!(counts(&icosphere(3)), [642, 1280, 2, 0]);
        assert_eq!(counts(&cube(1)), [8, 12, 2, 0]);
        assert_eq!(counts(&cube(4)), [98, 192, 2, 0]);
        assert_eq!(counts(&double_torus()), [48, 100, -2, 0]);
        assert_eq!(counts(&plane(3, 2)), [12, 12, 1, 1]);
        assert_eq!(counts(&tube(5)), [10, 10, 0, 2]);
        assert_eq!(counts(&cylinder(5)), [12, 20, 2, 0]);
        assert_eq!(counts(&torus(7, 4)), [28, 56, 0, 0]);
        assert_eq!(counts(&moebius(8)), [16, 16, 0, 1]);
        assert_eq!(counts(&fan3()), [5, 3, 1, 1]);
        assert_eq!(counts(&bow_tie()), [5, 2, 1, 1]);
    }

    #[test]
    fn areas_and_volumes_are_as_documented() {
        assert_close(tetrahedron().area(), 8.0 * 3f64.sqrt());
        assert_close(tetrahedron().volume(), 8.0 / 3.0);
        // Edge 1/sin(2π/5) for a circumradius of 1.
        let edge = 1.0 / (std::f64::consts::TAU / 5.0).sin();
        assert_close(icosahedron().area(), 5.0 * 3f64.sqrt() * edge * edge);
        assert_close(icosahedron().volume(), 5.0 / 12.0 * (3.0 + 5f64.sqrt()) * edge.powi(3));
        assert_close(cube(3).area(), 54.0);
        assert_close(cube(3).volume(), 27.0);
        assert_close(double_torus().area(), 50.0);
        assert_close(double_torus().volume(), 13.0);
        assert_close(plane(3, 2).area(), 6.0);
        assert_close(cylinder(4).volume(), 2.0);
        assert_close(cylinder(4).area(), 4.0 + 4.0 * 2f64.sqrt());
    }

    #[test]
    fn fine_round_shapes_come_near_the_smooth_ones() {
        use std::f64::consts::PI;
        assert!((icosphere(5).volume() / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
        assert!((torus(200, 80).volume() / (6.0 * PI * PI) - 1.0).abs() < 2e-3);
        assert!((torus(200, 80).area() / (12.0 * PI * PI) - 1.0).abs() < 2e-3);
    }
}
