//! What is known to be wrong, each shown by a test that must fail: mending one makes its test here fail, and it moves to
//! `regression.rs`.

mod support;

use coarsen::mesh::shapes;
use coarsen::{Budget, Mesh};
use support::engine::{METRICS, assert_kept, contract, options};

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
