//! Lists what is wrong with a mesh.

use std::fmt;

use super::Mesh;
use super::adjacency::{EdgeUse, Rings};
use super::layers::Layers;
use super::topology::{Stars, has_no_area, has_repeated_corner};
use super::weld::Twins;

/// Something that keeps a mesh from being an oriented 2-manifold of proper faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Defect {
    /// A corner that is no vertex.
    IndexOutOfRange {
        /// The face.
        face: u32,
        /// What stands there for a vertex.
        index: u32,
    },
    /// A coordinate that is infinite or not a number.
    NonFinite {
        /// The vertex.
        vertex: u32,
    },
    /// A face with the same vertex at two corners.
    RepeatedCorner {
        /// The face.
        face: u32,
    },
    /// Three distinct corners on one line.
    ZeroArea {
        /// The face.
        face: u32,
    },
    /// The same corners in the same turning sense as a lower face of its material.
    DuplicateFace {
        /// The higher face.
        face: u32,
    },
    /// An edge of more than two faces.
    NonManifoldEdge {
        /// The ends, the lower first.
        edge: [u32; 2],
    },
    /// A vertex whose faces form more than one fan.
    BowTie {
        /// The vertex.
        vertex: u32,
    },
    /// An edge whose two faces run along it in the same direction.
    Misoriented {
        /// The ends, the lower first.
        edge: [u32; 2],
    },
    /// An edge whose two faces, once they agree in orientation, have normals more than 170° apart.
    Folded {
        /// The ends, the lower first.
        edge: [u32; 2],
    },
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::IndexOutOfRange { face, index } => {
                write!(f, "face {face} names vertex {index}, which does not exist")
            }
            Self::NonFinite { vertex } => write!(f, "vertex {vertex} has a coordinate that is not finite"),
            Self::RepeatedCorner { face } => write!(f, "face {face} has the same vertex at two corners"),
            Self::ZeroArea { face } => write!(f, "face {face} has no area"),
            Self::DuplicateFace { face } => write!(f, "face {face} repeats a lower face"),
            Self::NonManifoldEdge { edge: [a, b] } => write!(f, "edge {a}-{b} has more than two faces"),
            Self::BowTie { vertex } => write!(f, "vertex {vertex} joins several fans of faces"),
            Self::Misoriented { edge: [a, b] } => write!(f, "the faces on edge {a}-{b} disagree on the outside"),
            Self::Folded { edge: [a, b] } => write!(f, "the faces on edge {a}-{b} fold onto each other"),
        }
    }
}

/// The cosine of 170°, to six digits.
const FOLDED_COS: f64 = -0.984_808;

/// Everything that is wrong with `mesh`, by kind in the order of [`Defect`], then by index.
///
/// Also takes meshes that [`Mesh::check`] refuses: faces with an index out of range are listed and otherwise left out.
pub fn validate(mesh: &Mesh) -> Vec<Defect> {
    let vertex_count = mesh.positions.len();
    let mut defects = Vec::new();
    let in_range = |v: u32| (v as usize) < vertex_count;
    for (face, corners) in (0..).zip(&mesh.faces) {
        let missing = corners.iter().filter(|&&v| !in_range(v));
        defects.extend(missing.map(|&index| Defect::IndexOutOfRange { face, index }));
    }
    let positions = (0..).zip(&mesh.positions);
    defects.extend(positions.filter(|(_, p)| !p.is_finite()).map(|(vertex, _)| Defect::NonFinite { vertex }));

    let layers = Layers::new(mesh.materials.as_ref());
    if defects.iter().any(|defect| matches!(defect, Defect::IndexOutOfRange { .. })) {
        let (ids, faces): (Vec<u32>, Vec<[u32; 3]>) =
            (0..).zip(&mesh.faces).filter(|(_, corners)| corners.iter().all(|&v| in_range(v))).unzip();
        let sound = Mesh::new(mesh.positions.clone(), faces);
        let of_face = layers.of_faces(&ids);
        let layers = of_face.as_deref().map_or(Layers::ONE, Layers::numbered);
        defects.extend(
            surface_defects(&sound, layers).into_iter().map(|defect| defect.with_face(|face| ids[face as usize])),
        );
    } else {
        defects.extend(surface_defects(mesh, layers));
    }
    defects
}

impl Defect {
    fn with_face(self, id: impl Fn(u32) -> u32) -> Self {
        match self {
            Self::RepeatedCorner { face } => Self::RepeatedCorner { face: id(face) },
            Self::ZeroArea { face } => Self::ZeroArea { face: id(face) },
            Self::DuplicateFace { face } => Self::DuplicateFace { face: id(face) },
            other => other,
        }
    }
}

fn surface_defects(mesh: &Mesh, layers: Layers<'_>) -> Vec<Defect> {
    let faces = &mesh.faces;
    let rings = Rings::new(faces, mesh.positions.len());
    let of_faces =
        |bad: &dyn Fn(usize) -> bool| (0..faces.len()).filter(|&f| bad(f)).map(|f| f as u32).collect::<Vec<_>>();
    let repeated = of_faces(&|f| has_repeated_corner(&faces[f]));
    let flat = of_faces(&|f| !has_repeated_corner(&faces[f]) && has_no_area(mesh, f));
    let duplicates = Twins::new(faces.len(), mesh.positions.len(), |f| faces[f], layers).duplicates;

    let (mut crowded, mut misoriented, mut folded) = (Vec::new(), Vec::new(), Vec::new());
    let mut scratch = Vec::new();
    for near in 0..mesh.positions.len() as u32 {
        for uses in rings.edges_from(faces, near, &mut scratch) {
            let edge = [near, uses[0].far()];
            match uses {
                [_] => {}
                [one, other] => {
                    if one.outward() == other.outward() {
                        misoriented.push(Defect::Misoriented { edge });
                    }
                    if is_folded(mesh, *one, *other) {
                        folded.push(Defect::Folded { edge });
                    }
                }
                _ => crowded.push(Defect::NonManifoldEdge { edge }),
            }
        }
    }
    let bow_ties = Stars::count(faces, &rings).bow_ties;

    let mut defects = Vec::new();
    defects.extend(repeated.into_iter().map(|face| Defect::RepeatedCorner { face }));
    defects.extend(flat.into_iter().map(|face| Defect::ZeroArea { face }));
    defects.extend(duplicates.into_iter().map(|face| Defect::DuplicateFace { face }));
    defects.extend(crowded);
    defects.extend(bow_ties.into_iter().map(|vertex| Defect::BowTie { vertex }));
    defects.extend(misoriented);
    defects.extend(folded);
    defects
}

fn is_folded(mesh: &Mesh, one: EdgeUse, other: EdgeUse) -> bool {
    let [n, m] = [one, other].map(|side| mesh.cross(mesh.faces[side.face() as usize]).normalize_or_zero());
    let agreeing = if one.outward() == other.outward() { -m } else { m };
    n.dot(agreeing) < FOLDED_COS
}

#[cfg(test)]
mod tests {
    use super::super::shapes;
    use super::*;
    use crate::math::DVec3;

    #[test]
    fn shapes_have_no_defect() {
        use shapes::*;
        for mesh in
            [tetrahedron(), icosphere(2), cube(3), double_torus(), plane(3, 2), tube(7), cylinder(5), torus(6, 5)]
        {
            assert_eq!(validate(&mesh), []);
        }
        assert_eq!(validate(&Mesh::default()), []);
    }

    #[test]
    fn shapes_that_are_no_surface() {
        assert_eq!(validate(&shapes::fan3()), [Defect::NonManifoldEdge { edge: [0, 1] }]);
        assert_eq!(validate(&shapes::bow_tie()), [Defect::BowTie { vertex: 0 }]);
        assert_eq!(validate(&shapes::moebius(30)), [Defect::Misoriented { edge: [0, 1] }]);
    }

    // A fold: the second face lies under the first, seen from the edge 0–1.
    #[test]
    fn a_fold_is_found_whichever_way_its_faces_turn() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.1]];
        let fold = |second| Mesh::new(corners.map(DVec3::from).to_vec(), vec![[0, 1, 2], second]);
        let folded = Defect::Folded { edge: [0, 1] };
        assert_eq!(validate(&fold([1, 0, 3])), [folded]);
        assert_eq!(validate(&fold([0, 1, 3])), [Defect::Misoriented { edge: [0, 1] }, folded]);
        let mut flat = fold([1, 0, 3]);
        flat.positions[3] = DVec3::new(0.0, -1.0, 0.0);
        assert_eq!(validate(&flat), []);
    }

    #[test]
    fn poor_faces_are_listed_by_their_place() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0]];
        let faces = vec![[0, 7, 2], [0, 1, 2], [0, 0, 2], [0, 1, 3], [1, 2, 0]];
        let defects = validate(&Mesh::new(corners.map(DVec3::from).to_vec(), faces));
        let expected = [
            Defect::IndexOutOfRange { face: 0, index: 7 },
            Defect::NonFinite { vertex: 4 },
            Defect::RepeatedCorner { face: 2 },
            Defect::ZeroArea { face: 3 },
            Defect::DuplicateFace { face: 4 },
            Defect::NonManifoldEdge { edge: [0, 1] },
        ];
        assert_eq!(defects[..6], expected);
        assert_eq!(defects[0].to_string(), "face 0 names vertex 7, which does not exist");
    }
}
