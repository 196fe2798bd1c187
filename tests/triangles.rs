//! Contraction of triangles: two contractions of edges at once, and the target all the same.

mod support;

use coarsen::backend::GpuOptions;
use coarsen::contract::{Candidates, Feature, Metric, Options, Placement, Update, Weighting};
use coarsen::mesh::{SAMPLES, sample, shapes};
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, StopReason, simplify};
use support::deviation::deviation;
use support::engine::{assert_replays, bytes, cpu, defects, gpu};
use support::independent::topology;
use support::texture::{folds, textured};

const PLACEMENTS: [Placement; 3] = [Placement::Optimal, Placement::EndpointOrMiddle, Placement::Endpoint];

fn triangles() -> Options {
    Options { metric: Metric::Plane, candidates: Candidates::Triangles, ..Options::default() }
}

fn run_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Contract(options.clone()), &budget, device, None).expect("a valid mesh")
}

fn run(mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    run_on(&cpu(2), mesh, options, budget)
}

fn samples(faces: usize) -> impl Iterator<Item = (&'static str, Mesh)> {
    SAMPLES.iter().map(move |&(name, ..)| (name, sample(name, Some(faces)).expect("a sample")))
}

/// Each of the first round's triangles takes four faces of a closed surface, and two vertices.
#[test]
fn a_triangle_takes_four_faces_and_two_vertices() {
    let mesh = shapes::icosphere(4);
    let outcome = run(&mesh, &triangles(), Budget::keep(0.5));
    let first = outcome.rounds[0];
    let after = outcome.rounds.get(1).map_or(outcome.mesh.faces.len() as u64, |round| round.faces);
    assert_eq!(first.pairs, mesh.faces.len() as u64);
    assert!(first.contracted > 100 && first.contracted.is_multiple_of(2));
    assert_eq!(first.faces - after, 2 * first.contracted);
    assert_eq!(outcome.mesh.positions.len() as u64 * 2 - 4, outcome.mesh.faces.len() as u64);
}

/// The face count is met to the face, whatever remains after fours.
#[test]
fn targets_are_met_exactly() {
    let mesh = shapes::icosphere(3);
    for target in [4, 6, 96, 98, 100, 102] {
        let outcome = run(&mesh, &triangles(), Budget::faces(target));
        assert_eq!((outcome.mesh.faces.len(), outcome.stop), (target, StopReason::FacesReached));
    }
    let open = sample("terrain", Some(3_000)).expect("a sample");
    for target in [300, 301, 302, 303] {
        assert_eq!(run(&open, &triangles(), Budget::faces(target)).mesh.faces.len(), target);
    }
}

#[test]
fn topology_and_shape_are_kept() {
    for (name, mesh) in samples(12_000) {
        let before = topology(&mesh);
        for placement in PLACEMENTS {
            let outcome = run(&mesh, &Options { placement, ..triangles() }, Budget::keep(0.1));
            let after = topology(&outcome.mesh);
            assert_eq!(outcome.stop, StopReason::FacesReached, "{name} {placement:?}");
            assert_eq!((after.components, after.euler), (before.components, before.euler), "{name} {placement:?}");
            assert_eq!(defects(&outcome.mesh)[..6], [0; 6], "{name} {placement:?}");
            if placement == Placement::Endpoint {
                assert!(outcome.vertex_origin.iter().all(|&origin| (origin as usize) < mesh.positions.len()));
            }
        }
    }
}

/// A flat stays flat and is reduced at no cost.
#[test]
fn a_flat_costs_nothing() {
    let outcome = run(&shapes::plane(20, 20), &triangles(), Budget::faces(60));
    assert!(outcome.rounds[0].greatest_cost < 1e-9 && outcome.mesh.faces.len() == 60);
    assert!(outcome.mesh.positions.iter().all(|p| p.z.abs() < 1e-6));
}

/// Fewer choices, more error: on an even surface within half of that of pairs, with ridges within four times, or hardly any.
#[test]
fn the_deviation_is_near_that_of_pairs() {
    for (name, mesh) in samples(12_000) {
        let rms = |options: &Options| deviation(&mesh, &run(&mesh, options, Budget::keep(0.2)).mesh, 20_000).rms;
        let pairs = rms(&Options { metric: Metric::Plane, ..Options::default() });
        let found = rms(&triangles());
        let most = if name == "statue" { 1.5 * pairs } else { 4.0 * pairs + 2e-4 };
        assert!(found < most, "{name}: {found} diagonals, by pairs {pairs}");
    }
}

#[test]
fn threads_and_devices_give_the_same_bytes() {
    for (name, mesh) in samples(50_000) {
        for placement in [Placement::Optimal, Placement::Endpoint] {
            let options = Options { placement, ..triangles() };
            let reference = run_on(&cpu(1), &mesh, &options, Budget::keep(0.1));
            let devices = [2, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default()));
            for device in devices {
                let outcome = run_on(&device, &mesh, &options, Budget::keep(0.1));
                let name = format!("{name} {placement:?}, {}", device.description());
                assert!(bytes(&outcome.mesh) == bytes(&reference.mesh), "{name}");
                assert_eq!(outcome.vertex_origin, reference.vertex_origin, "{name}");
                assert_eq!(device.is_gpu(), outcome.rounds[0].on_gpu, "{name}");
            }
        }
    }
}

/// The log has two contractions for each triangle, and leads to the result and back.
#[test]
fn a_log_holds_two_contractions_each() {
    for (name, mesh) in samples(6_000) {
        for placement in PLACEMENTS {
            let outcome = run(&mesh, &Options { placement, log: true, ..triangles() }, Budget::keep(0.1));
            let contracted: u64 = outcome.rounds.iter().map(|round| round.contracted).sum();
            let log = outcome.log.as_ref().expect("asked for");
            assert_eq!(log.contractions().len() as u64, contracted, "{name}");
            assert_replays(&format!("{name} {placement:?}"), &mesh, &outcome);
        }
    }
}

#[test]
fn textures_fits_and_locks_go_along() {
    let mesh = sample("terrain", Some(12_000)).expect("a sample");
    let (low, size) = (mesh.bounds().0, mesh.bounds().1 - mesh.bounds().0);
    let mesh = textured(mesh, |p| [(p.x - low.x) / size.x, (p.y - low.y) / size.y]);
    let options = Options { fit: 1, lock_border: true, ..triangles() };
    let outcome = run(&mesh, &options, Budget::keep(0.2));
    assert_eq!((outcome.stop, folds(&outcome.mesh)), (StopReason::FacesReached, 0));
    let border = |mesh: &Mesh| topology(mesh).border_edges;
    assert_eq!(border(&outcome.mesh), border(&mesh));
}

#[test]
fn what_does_not_go_with_triangles_is_said() {
    let recompute = Weighting::Feature(Feature { update: Update::Recompute, ..Feature::default() });
    for (options, part) in [
        (Options { metric: Metric::Volume, ..triangles() }, "'volume'"),
        (Options { placement: Placement::Segment, ..triangles() }, "segment"),
        (Options { join_within: 1.0, ..triangles() }, "join"),
        (Options { weighting: recompute, ..triangles() }, "weights"),
    ] {
        let result = simplify(&shapes::cube(2), &Method::Contract(options), &Budget::keep(0.5), &cpu(1), None);
        assert!(matches!(&result, Err(Error::Parameter(text)) if text.contains(part)), "{part}: {result:?}");
    }
}
