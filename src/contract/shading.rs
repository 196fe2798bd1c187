//! Normals and tangents of the result that changed: each was found by itself, and is put right against the faces and the other.
//!
//! A normal that is the best of what its faces had may point behind one of them: at a vertex where many were. Renderers light
//! such a corner from behind. Where the faces agreed with normals in the input, the normal is turned as little as brings it before
//! all of them but slivers.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::math::{DVec3, Vec3};
use crate::mesh::{ChannelKind, Mesh};

use super::restore::ROWS;

/// The cosine of the angle to each of its faces that a normal is turned to where it was behind one.
const LEAST_COS: f64 = 0.02;
/// Faces of less than this share of the area around a vertex do not turn its normal. Images of a helmet and a pirate with 10 % of
/// their faces are 0.99 and 0.94 times as far off as without turning, 1.02 and 0.94 where slivers turn normals, too.
const LEAST_SHARE: f64 = 0.1;
/// Times that all faces of a vertex are looked at.
const SWEEPS: usize = 8;
/// Twice the area of a face over the square of its longest side, below which it faces nowhere.
const LEAST_SHAPE: f64 = 1e-6;
/// The square of what of a tangent lies in the plane of its normal, below which it is rounding.
const LEAST_FLAT_SQ: f32 = 1e-6;

/// The sides of faces of the input that normals point to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outside {
    /// That which corners turn around to the left.
    Front,
    Back,
    /// Both, or none.
    Unknown,
}

impl Outside {
    fn of(input: &Mesh, normals: &[Vec3], face: u32) -> Self {
        let corners = input.faces[face as usize];
        let cross = input.cross(corners);
        let dots = corners.map(|v| cross.dot(normals[v as usize].as_dvec3()));
        match dots {
            dots if dots.iter().all(|&dot| dot > 0.0) => Self::Front,
            dots if dots.iter().all(|&dot| dot < 0.0) => Self::Back,
            _ => Self::Unknown,
        }
    }
}

/// Puts the normals and tangents right of vertices that have changed; `origins` has for each face of `mesh` the face of `input` that
/// it was.
pub fn mend(mesh: &mut Mesh, input: &Mesh, origins: &[u32], has_changed: impl Fn(usize) -> bool + Sync) {
    let (Some(mut normals), Some(before)) = (mesh.normals.take(), &input.normals) else { return };
    let outward = |face: usize| {
        let corners = mesh.faces[face];
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize]);
        let cross = mesh.cross(corners);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        let faces_somewhere = cross.length() > LEAST_SHAPE * longest;
        match Outside::of(input, before, origins[face]) {
            Outside::Front if faces_somewhere => Some(cross),
            Outside::Back if faces_somewhere => Some(-cross),
            _ => None,
        }
    };
    let is_behind = |face: &usize| {
        let corners = mesh.faces[*face].map(|v| v as usize);
        let behind = |v: usize, outward: DVec3| has_changed(v) && normals[v].as_dvec3().dot(outward) < 0.0;
        outward(*face).is_some_and(|outward| corners.iter().any(|&v| behind(v, outward)))
    };
    let turned: Vec<usize> = (0..mesh.faces.len()).into_par_iter().with_min_len(ROWS).filter(is_behind).collect();
    let mut has_turned = vec![false; if turned.is_empty() { 0 } else { normals.len() }];
    let corners = turned.iter().flat_map(|&face| mesh.faces[face]).map(|v| v as usize);
    corners.filter(|&v| has_changed(v)).for_each(|v| has_turned[v] = true);
    let mut stars: BTreeMap<usize, Vec<DVec3>> = BTreeMap::new();
    for (face, corners) in mesh.faces.iter().enumerate().filter(|_| !turned.is_empty()) {
        for v in corners.map(|v| v as usize).into_iter().filter(|&v| has_turned[v]) {
            stars.entry(v).or_default().extend(outward(face));
        }
    }
    stars.iter().for_each(|(&v, star)| normals[v] = before_all(normals[v], star));
    mesh.normals = Some(normals);
    flatten_tangents(mesh, has_changed);
}

/// Turns the tangents of vertices that have changed into the planes of their normals.
pub fn flatten_tangents(mesh: &mut Mesh, has_changed: impl Fn(usize) -> bool + Sync) {
    let Some(normals) = &mesh.normals else { return };
    for channel in mesh.channels.iter_mut().filter(|channel| channel.kind == ChannelKind::Tangent) {
        let rows = channel.values.par_chunks_mut(4).zip(normals).enumerate().with_min_len(ROWS);
        rows.filter(|(v, _)| has_changed(*v)).for_each(|(_, (tangent, normal))| lie_in_plane(tangent, *normal));
    }
}

/// A normal turned before the larger of these faces, whose normals are as long as twice their areas, or as it was where that does
/// not bring it before more of them.
fn before_all(normal: Vec3, faces: &[DVec3]) -> Vec3 {
    let least = LEAST_SHARE * faces.iter().map(|face| face.length()).sum::<f64>();
    let larger = || faces.iter().filter(|face| face.length() >= least).map(|face| face.normalize_or_zero());
    let behind = |normal: DVec3| larger().filter(|face| normal.dot(*face) < 0.0).count();
    let given = normal.as_dvec3();
    let (mut best, mut fewest, mut turned) = (normal, behind(given), given);
    for _ in 0..SWEEPS {
        for face in larger() {
            let missing = LEAST_COS - turned.dot(face);
            if missing > 0.0 {
                turned = (turned + face * missing).normalize_or(given);
            }
        }
        let left = behind(turned);
        if left < fewest {
            (best, fewest) = (turned.as_vec3(), left);
        }
        if left == 0 {
            break;
        }
    }
    best
}

/// Turns a tangent into the plane of its normal, as renderers expect, unless it is the normal but for rounding.
fn lie_in_plane(tangent: &mut [f32], normal: Vec3) {
    let given = Vec3::from_slice(tangent);
    let flat = given - normal * normal.dot(given);
    if flat.length_squared() > LEAST_FLAT_SQ {
        tangent[..3].copy_from_slice(&flat.normalize().to_array());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Channel, shapes};

    #[test]
    fn tangents_are_turned_into_the_plane_of_their_normals() {
        let turned = |tangent: [f32; 4]| {
            let mut numbers = tangent;
            lie_in_plane(&mut numbers, Vec3::Z);
            numbers
        };
        assert_eq!(turned([0.6, 0.0, 0.8, -1.0]), [1.0, 0.0, 0.0, -1.0]);
        assert_eq!(turned([0.0, 0.0, 1.0, 1.0]), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(turned([0.0; 4]), [0.0; 4]);
    }

    #[test]
    fn normals_are_turned_before_their_faces() {
        let faces = [DVec3::X, DVec3::Y, DVec3::Z];
        let turned = before_all(Vec3::new(-0.6, 0.0, 0.8), &faces);
        assert!(faces.iter().all(|face| face.as_vec3().dot(turned) >= 0.0) && turned.is_normalized(), "{turned}");
        assert_eq!(before_all(Vec3::X, &faces), Vec3::X);
        // A sliver turns nothing.
        assert_eq!(before_all(Vec3::X, &[DVec3::X, DVec3::Y, -1e-3 * DVec3::X]), Vec3::X);
        // Nothing is before faces that are opposite.
        assert_eq!(before_all(Vec3::X, &[DVec3::Z, -DVec3::Z]), Vec3::X);
        assert_eq!(before_all(Vec3::ZERO, &[DVec3::Z]), Vec3::ZERO);
    }

    /// A sphere whose vertex 0 has a normal that points inside: put right where it has changed and faces agreed with normals.
    #[test]
    fn only_what_changed_and_once_agreed_is_put_right() {
        let mut input = shapes::icosphere(2);
        input.normals = Some(input.positions.iter().map(|p| p.as_vec3().normalize()).collect());
        let origins: Vec<u32> = (0..input.faces.len() as u32).collect();
        let mut turned = input.clone();
        let rows = turned.normals.as_mut().expect("normals");
        let was = rows[0];
        rows[0] = -was;
        let tangents = [1.0, 0.0, 0.0, 1.0].repeat(rows.len());
        turned.channels = vec![Channel { name: "t".into(), kind: ChannelKind::Tangent, width: 4, values: tangents }];
        let mended = |input: &Mesh, turned: &Mesh, changed: usize| {
            let mut mesh = turned.clone();
            mend(&mut mesh, input, &origins, |v| v == changed);
            mesh
        };
        let right = mended(&input, &turned, 0);
        let normal = right.normals.as_ref().expect("normals")[0];
        assert!(normal.dot(was) > 0.0, "{normal} for {was}");
        assert!(Vec3::from_slice(&right.channels[0].values).dot(normal).abs() < 1e-6);
        assert_eq!(mended(&input, &turned, 1).normals, turned.normals);
        // Normals that point inside all over are meant to.
        let inside = |mesh: &Mesh| mesh.normals.as_ref().map(|rows| rows.iter().map(|&normal| -normal).collect());
        let away = Mesh { normals: inside(&input), ..input.clone() };
        let back = mended(&away, &Mesh { normals: inside(&turned), ..turned.clone() }, 0);
        assert!(back.normals.expect("normals")[0].dot(was) < 0.0);
        let mut mixed = input.clone();
        mixed.normals.as_mut().expect("normals").iter_mut().step_by(2).for_each(|normal| *normal = -*normal);
        assert_eq!(mended(&mixed, &turned, 0).normals, turned.normals);
    }
}
