//! What was wrong once, a test each.

mod support;

use coarsen::contract::{Metric, NonManifold, Options, Placement};
use coarsen::math::DVec3;
use coarsen::mesh::{sample, shapes};
use coarsen::{Budget, Mesh};
use support::deviation::deviation;
use support::engine::{METRICS, assert_kept, contract, defects, options};
use support::shapes::{cube, grid, mesh, torus};

/// Where the surface is not manifold it stays as it is.
fn held(metric: Metric) -> Options {
    Options { non_manifold: NonManifold::Hold, ..options(metric) }
}

fn assert_keeps_topology(name: &str, mesh: &Mesh) {
    for metric in METRICS {
        assert_kept(&format!("{name} {metric:?}"), mesh, &contract(mesh, &held(metric), Budget::faces(0)));
    }
}

/// A face with no neighbor but over its locked corner is contracted to an edge that no face has: its last vertex stays
/// behind without a face. A border pair whose end has no other face needs exactly one other face on the third edge.
#[test]
fn the_last_face_at_a_bow_tie_vanishes() {
    assert_keeps_topology("bow tie", &shapes::bow_tie());
}

/// The same on an edge of three faces: a flap of one face vanishes, and with it the edge's third face.
#[test]
fn the_last_face_at_an_edge_of_three_vanishes() {
    assert_keeps_topology("fan", &shapes::fan3());
}

/// ```text
///   2---1   8   9   5---6      Two cones 0 1 2 3 and 0 5 6 7 with a common tip, joined by the faces 0 4 1 and 0 5 4.
///    \ / \ / \ / \ / \ /       The wings 4 8 1 and 4 5 9 keep 4 on a border and the edges 0 1 and 0 5 at three faces.
///     3   \ - 4 - /   7        Contracting 0 and 4 parts the cones. A locked vertex that is not manifold and one on a
///      \   \  |  /   /         border contract along a border only.
///       \---- 0 ----/
/// ```
#[test]
fn a_bridge_between_two_cones_tears() {
    #[rustfmt::skip]
    let positions = [
        [0.0, 0.0, 0.0], [-1.0, 0.3, 1.0], [-1.5, 1.0, 0.0], [-1.5, -1.0, 0.0], [0.0, 0.1, 0.2],
        [1.0, 0.3, 1.0], [1.5, 1.0, 0.0], [1.5, -1.0, 0.0], [-0.5, 0.2, 2.0], [0.5, 0.2, 2.0],
    ];
    let left = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [0, 4, 1], [4, 8, 1]];
    let right = [[0, 6, 5], [0, 7, 6], [0, 5, 7], [0, 5, 4], [4, 5, 9]];
    let bridge = mesh(&positions, &[left, right].concat());
    for metric in METRICS {
        let name = format!("bridge {metric:?}");
        assert_kept(&name, &bridge, &contract(&bridge, &held(metric), Budget::faces(8)));
    }
}

/// The test for flips compares directions only, so a face may shrink to a sliver as thin as single precision rounds; in
/// the input's own coordinates its corners are on one line. It should refuse areas lost in the rounding of the sides.
#[test]
fn endpoints_on_a_flat_lattice_leave_faces_without_area() {
    let mut lattice = grid(11, 11);
    lattice.positions.iter_mut().for_each(|p| *p /= 11.0);
    let outcome =
        contract(&lattice, &Options { placement: Placement::Endpoint, ..Options::default() }, Budget::keep(0.2));
    assert_eq!(defects(&outcome.mesh)[1], 0, "faces without area");
}

/// The same slivers with optimal placement: their normals are noise, and the next contraction lays them over.
#[test]
fn slivers_on_flats_fold() {
    let outcome = contract(&cube(3), &options(Metric::Plane), Budget::keep(0.5));
    assert_eq!(defects(&outcome.mesh)[6], 0, "folded edges");
}

/// A vertex may be placed outside the box, and the box may end where numbers do. Optimal placements should be refused, or
/// kept inside, where they are not finite in model units.
#[test]
fn meshes_as_large_as_numbers_leave_them() {
    let mut ball = torus(12, 8);
    ball.positions.iter_mut().for_each(|p| *p *= 1.2e308);
    let outcome = contract(&ball, &options(Metric::Volume), Budget::faces(0));
    outcome.mesh.check().unwrap_or_else(|error| panic!("{error}"));
}

/// Half of the part's faces lie in flats and could go for nothing, as they do with `Plane`. A contraction is placed on the
/// state its neighbors left, but never costed there: one that has become a hundred times dearer should wait for the
/// next round. (Refusing what costs more than twice its key brings 3e-7 diagonals to 2e-9 here.)
#[test]
fn contractions_grown_dear_since_they_were_costed_are_made() {
    let part = sample("part", Some(20_000)).expect("a sample");
    let outcome = contract(&part, &options(Metric::Volume), Budget::keep(0.5));
    let rms = deviation(&part, &outcome.mesh, 20_000).rms;
    assert!(rms < 1e-8, "{rms:e} diagonals at half of the faces");
}

/// Where the estimate of `Volume` came from plane quadrics, which do not guide its placements, single vertices that slid along a
/// flat had one of a hundred times the deviation, and error budgets stopped far too early. Half of the faces lie in flats, where
/// nothing deviates.
#[test]
fn the_estimate_of_the_volume_metric_does_not_jump_at_sharp_edges() {
    let assembly = sample("assembly", Some(20_000)).expect("a sample");
    let estimates = [0.5, 0.25, 0.1].map(|share| {
        let outcome = contract(&assembly, &options(Metric::Volume), Budget::keep(share));
        let measured = deviation(&assembly, &outcome.mesh, 20_000);
        (outcome.error_estimate / assembly.diagonal(), measured.forward_max.max(measured.backward_max))
    });
    assert!(estimates[0].0 < 1e-6, "{estimates:?}");
    assert!(
        estimates[1..].iter().all(|(estimate, measured)| (0.25..4.0).contains(&(estimate / measured))),
        "{estimates:?}"
    );
}

/// Coordinates that the frame cannot bring into single precision (an unused vertex lies 1e200 boxes away, and the weight of
/// borders is large) leave a trace with its sign bit set; the exponent taken from it is past what it is subtracted from.
/// A release build wraps, and a shader may do as it likes.
#[test]
fn a_trace_that_is_no_number_overflows_an_exponent() {
    let mut far = mesh(&[[0.0; 3]; 6], &[[2, 5, 3], [5, 0, 3]]);
    far.positions = [
        [-1.9658153609580605e-59, -2.1738021751594065e-66, -6.716213466724685e-22],
        [5.230282489803305e155, -8.788897629629044e-264, -6.858543207730255e-206],
        [-9.747297842989641e-293, 0.0015092251638708643, 2.9084127848951787e86],
        [-7.652839238994713e-24, -8.59513583237823e-258, -1.9161473449168517e-58],
        [4.683863005588166e139, 9.60160544314914e287, 3.207787680983543e95],
        [-9.258470589165796e-278, -8.705081526238523e-28, -8.63385311021099e-260],
    ]
    .map(DVec3::from)
    .to_vec();
    let options = Options { border_weight: 1e6, weld: None, ..Options::default() };
    contract(&far, &options, Budget::faces(0));
}
