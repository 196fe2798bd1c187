//! What is known to be wrong, each shown by a test that must fail: mending one makes its test here fail, and it moves to
//! `regression.rs`.

mod support;

use coarsen::contract::{Metric, Options, Placement};
use coarsen::mesh::shapes;
use coarsen::{Budget, Mesh};
use support::engine::{METRICS, assert_kept, contract, defects, options};
use support::shapes::{cube, grid};

fn assert_keeps_topology(name: &str, mesh: &Mesh) {
    for metric in METRICS {
        assert_kept(&format!("{name} {metric:?}"), mesh, &contract(mesh, &options(metric), Budget::faces(0)));
    }
}

/// A face with no neighbor but over its locked corner is contracted to an edge that no face has: its last vertex stays
/// behind without a face. A border pair whose end has no other face needs exactly one other face on the third edge.
#[test]
#[should_panic(expected = "bow tie Volume: Euler, components, borders, non-manifold edges, bow ties")]
fn the_last_face_at_a_bow_tie_vanishes() {
    assert_keeps_topology("bow tie", &shapes::bow_tie());
}

/// The same on an edge of three faces: a flap of one face vanishes, and with it the edge's third face.
#[test]
#[should_panic(expected = "fan Volume: Euler, components, borders, non-manifold edges, bow ties")]
fn the_last_face_at_an_edge_of_three_vanishes() {
    assert_keeps_topology("fan", &shapes::fan3());
}

/// The test for flips compares directions only, so a face may shrink to a sliver as thin as single precision rounds; in
/// the input's own coordinates its corners are on one line. It should refuse areas lost in the rounding of the sides.
#[test]
#[should_panic(expected = "faces without area")]
fn endpoints_on_a_flat_lattice_leave_faces_without_area() {
    let mut lattice = grid(11, 11);
    lattice.positions.iter_mut().for_each(|p| *p /= 11.0);
    let outcome =
        contract(&lattice, &Options { placement: Placement::Endpoint, ..Options::default() }, Budget::keep(0.2));
    assert_eq!(defects(&outcome.mesh)[1], 0, "faces without area");
}

/// The same slivers with optimal placement: their normals are noise, and the next contraction lays them over.
#[test]
#[should_panic(expected = "folded edges")]
fn slivers_on_flats_fold() {
    let outcome = contract(&cube(3), &options(Metric::Plane), Budget::keep(0.5));
    assert_eq!(defects(&outcome.mesh)[6], 0, "folded edges");
}
