//! Pairs without an edge: parts that join, gaps that close, and what edges alone cannot reach.

mod support;

use coarsen::contract::{Metric, NonManifold, Options};
use coarsen::math::DVec3;
use coarsen::mesh::survey::survey;
use coarsen::mesh::{sample, shapes, weld};
use coarsen::{Budget, Error, Mesh, Method, Outcome, StopReason, simplify};
use support::engine::{METRICS, cpu};
use support::independent::topology;
use support::shapes::volume;

fn options(metric: Metric, join_within: f64) -> Options {
    Options { metric, join_within, ..Options::default() }
}

fn run(mesh: &Mesh, options: Options, budget: Budget, threads: usize) -> Outcome {
    simplify(mesh, &Method::Contract(options), &budget, &cpu(threads), None).expect("a good mesh")
}

/// Both meshes in one, the second moved by `offset`.
fn beside(first: &Mesh, second: &Mesh, offset: DVec3) -> Mesh {
    let mut mesh = first.clone();
    let count = mesh.positions.len() as u32;
    mesh.positions.extend(second.positions.iter().map(|&p| p + offset));
    mesh.faces.extend(second.faces.iter().map(|face| face.map(|v| v + count)));
    mesh
}

#[test]
fn a_distance_of_zero_is_edges_alone_bit_for_bit() {
    for (name, ..) in [("statue", 0), ("assembly", 0), ("terrain", 0)] {
        let mesh = sample(name, Some(6000)).expect("a sample");
        for metric in METRICS {
            let with = |options| run(&mesh, options, Budget::keep(0.2), 2).mesh;
            assert_eq!(with(options(metric, 0.0)), with(Options { metric, ..Options::default() }), "{name}");
        }
    }
}

/// Without pairs in reach the rounds are those of edges alone.
#[test]
fn nothing_in_reach_changes_nothing() {
    let mesh = sample("statue", Some(6000)).expect("a sample");
    let [without, with] =
        [0.0, 1e-7].map(|within| run(&mesh, options(Metric::Volume, within), Budget::keep(0.2), 2).mesh);
    assert_eq!(without, with);
}

/// Two boxes face to face, a thousandth apart and triangulated alike: the faces between them meet back to back and vanish,
/// and one box is left.
#[test]
fn facing_boxes_become_one() {
    let mut mirrored = shapes::cube(1);
    let (low, high) = mirrored.bounds();
    let side = (high - low).x;
    mirrored.positions.iter_mut().for_each(|p| p.x = low.x + high.x - p.x);
    mirrored.faces.iter_mut().for_each(|face| face.swap(1, 2));
    let mesh = beside(&shapes::cube(1), &mirrored, DVec3::X * side * 1.001);
    for metric in METRICS {
        let outcome = run(&mesh, options(metric, side * 0.002), Budget::faces(12), 2);
        assert_eq!(outcome.stop, StopReason::FacesReached, "{metric:?}: {:?}", outcome.blocked);
        let found = topology(&outcome.mesh);
        assert_eq!((found.components, found.euler, found.border_edges), (1, 2, 0), "{metric:?}: {found:?}");
        if metric == Metric::Plane {
            // The planes of the faces that vanished still count, so it is as dear to remove their corners as the box's.
            continue;
        }
        let expected = 2.001 * side.powi(3);
        assert!((volume(&outcome.mesh) / expected - 1.0).abs() < 1e-3, "{metric:?}: {}", volume(&outcome.mesh));
    }
}

/// Two strips along a slit, in a plane: they become one where the distance spans the slit, and only there.
#[test]
fn a_slit_closes() {
    let strip = shapes::plane(20, 10);
    let size = strip.bounds().1 - strip.bounds().0;
    let mesh = beside(&strip, &strip, DVec3::Y * (size.y + 1e-3));
    let whole = size.x * (2.0 * size.y + 1e-3);
    let fewest = |within| run(&mesh, options(Metric::Volume, within), Budget::faces(2), 2).mesh;
    let [open, closed] = [0.5e-3, 2e-3].map(fewest);
    assert_eq!([&open, &closed].map(|mesh| topology(mesh).components), [2, 1]);
    assert!(closed.faces.len() <= 2 && (closed.area() / whole - 1.0).abs() < 1e-3, "{}", closed.area());
}

/// Hundreds of small shells: edges alone stop at the fewest faces of closed surfaces, which `survey` tells before.
#[test]
fn shells_that_edges_cannot_reduce_join() {
    let parts = sample("assembly", Some(50_000)).expect("a sample");
    let shells = run(&parts, options(Metric::Volume, 0.0), Budget::faces(1), 2).mesh;
    let target = shells.faces.len() / 20;
    let floor = survey(&shells).floor_faces;
    assert!(floor > target, "{floor} faces are as few as edges reach, {target} the target");
    let alone = run(&shells, options(Metric::Volume, 0.0), Budget::faces(target), 2);
    assert!(alone.stop == StopReason::Stuck && alone.mesh.faces.len() >= floor);
    for metric in METRICS {
        // Within 2 units the last hundred faces have no partner, or have, by how the shells came out.
        let joined = run(&shells, options(metric, 2.5), Budget::faces(target), 2);
        assert_eq!(joined.stop, StopReason::FacesReached, "{metric:?}: {:?}", joined.blocked);
        assert!(joined.mesh.faces.len() <= target);
        let found = topology(&joined.mesh);
        assert_eq!(found.duplicate_faces, 0, "{metric:?}");
        let used = joined.mesh.faces.iter().flatten().collect::<std::collections::BTreeSet<_>>().len();
        assert_eq!(used, joined.mesh.positions.len(), "{metric:?}: a vertex without a face");
    }
}

/// Surfaces that meet in vertices and edges are cut apart, or locked: pairs there may contract when parts may join.
#[test]
fn what_is_not_manifold_reduces_too() {
    let cube = shapes::cube(6);
    let side = (cube.bounds().1 - cube.bounds().0).x;
    // They touch along an edge, which then has four faces.
    let mesh = weld(&beside(&cube, &cube, DVec3::new(side, side, 0.0)), 0.0).mesh;
    assert!(topology(&mesh).non_manifold_edges > 0);
    let [apart, joined] = [0.0, 1e-6].map(|within| options(Metric::Volume, within));
    let alone = Options { non_manifold: NonManifold::Hold, ..apart.clone() };
    let [alone, apart, joined] = [alone, apart, joined].map(|options| run(&mesh, options, Budget::faces(24), 1));
    assert_eq!(alone.stop, StopReason::Stuck, "{:?}", alone.blocked);
    for outcome in [apart, joined] {
        assert_eq!(outcome.stop, StopReason::FacesReached, "{:?}", outcome.blocked);
        assert!((volume(&outcome.mesh) / volume(&mesh) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn threads_do_not_change_the_bytes() {
    let mesh = sample("assembly", Some(20_000)).expect("a sample");
    for metric in METRICS {
        let one = run(&mesh, options(metric, 1.5), Budget::faces(300), 1).mesh;
        assert!(
            [2, 3, 5]
                .into_iter()
                .all(|threads| run(&mesh, options(metric, 1.5), Budget::faces(300), threads).mesh == one)
        );
    }
}

#[test]
fn bad_distances_are_refused() {
    let mesh = shapes::cube(2);
    let refused = |options: Options| {
        let result = simplify(&mesh, &Method::Contract(options), &Budget::faces(12), &cpu(1), None);
        assert!(matches!(&result, Err(Error::Parameter(_))), "{result:?}");
    };
    [-1.0, f64::NAN, f64::INFINITY].into_iter().for_each(|distance| refused(options(Metric::Volume, distance)));
    refused(Options { fit: 1, ..options(Metric::Volume, 1.0) });
}
