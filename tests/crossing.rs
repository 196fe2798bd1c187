//! Faces of thin walls do not come to pass through each other.

mod support;

use coarsen::contract::Options;
use coarsen::math::DVec3;
use coarsen::mesh::shapes;
use coarsen::{Budget, Mesh, StopReason};
use support::engine::contract;

/// A sphere and another within it, wound the other way, whose radius is less by `gap` of it.
fn shell(level: u32, gap: f64) -> Mesh {
    let sphere = shapes::icosphere(level);
    let count = sphere.positions.len() as u32;
    let mut positions = sphere.positions.clone();
    positions.extend(sphere.positions.iter().map(|&p| p * (1.0 - gap)));
    let mut faces = sphere.faces.clone();
    faces.extend(sphere.faces.iter().map(|&[a, b, c]| [a + count, c + count, b + count]));
    Mesh::new(positions, faces)
}

/// How many pairs of faces without a common corner pass through each other: an edge of one through the inside of the other.
fn crossings(mesh: &Mesh) -> usize {
    let corners: Vec<[DVec3; 3]> = mesh.faces.iter().map(|face| face.map(|v| mesh.positions[v as usize])).collect();
    let pierces = |s: DVec3, t: DVec3, [a, b, c]: [DVec3; 3]| {
        // Where s + x (t − s) = a + y (b − a) + z (c − a), by Cramer's rule.
        let (d, e, f) = (s - t, b - a, c - a);
        let det = d.dot(e.cross(f));
        let from_a = s - a;
        let [x, y, z] = [from_a.dot(e.cross(f)), d.dot(from_a.cross(f)), d.dot(e.cross(from_a))].map(|part| part / det);
        let inside = 1e-6..1.0 - 1e-6;
        inside.contains(&x) && y > 1e-6 && z > 1e-6 && y + z < 1.0 - 1e-6
    };
    let pierce = |p: [DVec3; 3], q: [DVec3; 3]| (0..3).any(|k| pierces(p[k], p[(k + 1) % 3], q));
    let mut count = 0;
    for (f, p) in corners.iter().enumerate() {
        for (g, q) in corners.iter().enumerate().take(f) {
            let is_apart = !mesh.faces[f].iter().any(|v| mesh.faces[g].contains(v));
            count += usize::from(is_apart && (pierce(*p, *q) || pierce(*q, *p)));
        }
    }
    count
}

/// Of either sphere by itself, in the place of the other's: what a shell would be whose sides know nothing of each other.
fn apart(faces: usize, gap: f64) -> Mesh {
    let sphere = |scale: f64| {
        let mut sphere = shapes::icosphere(5);
        sphere.positions.iter_mut().for_each(|p| *p *= scale);
        contract(&sphere, &Options::default(), Budget::faces(faces)).mesh
    };
    let (outer, mut inner) = (sphere(1.0), sphere(1.0 - gap));
    let count = outer.positions.len() as u32;
    inner.faces.iter_mut().for_each(|face| *face = face.map(|v| v + count));
    // Turned: of the same faces none would be through another.
    inner.positions.iter_mut().for_each(|p| *p = DVec3::new(p.y, p.z, p.x));
    Mesh::new([outer.positions, inner.positions].concat(), [outer.faces, inner.faces].concat())
}

#[test]
fn the_sides_of_a_thin_shell_do_not_pass_through_each_other() {
    // The second began with more than 32,768 vertices, and is watched from fewer faces on.
    for (level, gap, faces) in [(5, 0.006, 2000), (5, 0.006, 1500), (6, 0.005, 1600)] {
        let outcome = contract(&shell(level, gap), &Options::default(), Budget::faces(faces));
        assert_eq!(outcome.mesh.faces.len(), faces);
        assert_eq!(crossings(&outcome.mesh), 0, "{faces} faces");
        let apart = crossings(&apart(faces / 2, gap));
        assert!(apart > 50, "{apart} where each is by itself");
    }
}

#[test]
fn faces_that_are_asked_for_are_had_if_through_each_other() {
    let shell = shell(5, 0.01);
    for asked in [60, 61] {
        let outcome = contract(&shell, &Options::default(), Budget::faces(asked));
        // Of two closed surfaces an odd number of faces is not to be had.
        assert_eq!((outcome.mesh.faces.len(), outcome.stop), (60, StopReason::FacesReached), "{asked}");
        assert!(crossings(&outcome.mesh) > 0);
    }
}

#[test]
fn within_an_error_limit_faces_never_pass_through_each_other() {
    let shell = shell(5, 0.01);
    // Several times the gap.
    let limit = 0.03;
    for budget in [Budget::error(limit), Budget { error: Some(limit), ..Budget::faces(60) }] {
        let outcome = contract(&shell, &Options::default(), budget);
        assert_eq!(crossings(&outcome.mesh), 0);
        assert!((61..1500).contains(&outcome.mesh.faces.len()), "{}", outcome.mesh.faces.len());
        assert!(outcome.stop != StopReason::FacesReached);
        assert!(outcome.rounds.last().is_some_and(|round| round.blocked.crossing > 0));
    }
}
