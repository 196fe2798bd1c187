//! Edge flips after a run: known answers, what they keep, and the same bytes everywhere.

mod support;

use coarsen::backend::GpuOptions;
use coarsen::cluster;
use coarsen::contract::Options;
use coarsen::math::DVec3;
use coarsen::mesh::sample;
use coarsen::partition::{self, vsa};
use coarsen::polish::{Flips, Objective, flip};
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, removal, simplify};
use support::deviation::deviation;
use support::engine::{assert_kept, bytes, cpu, gpu};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, mesh, sphere};

const OBJECTIVES: [Objective; 3] = [Objective::Distance, Objective::Bend, Objective::Shape];

fn by(objective: Objective) -> Flips {
    Flips { sweeps: 8, objective }
}

fn flipped(original: &Mesh, result: &Mesh, flips: Flips) -> (Mesh, usize) {
    let mut mesh = result.clone();
    let flipped = flip(original, &mut mesh, flips, &cpu(1)).expect("a valid mesh");
    (mesh, flipped.edges)
}

/// Every method, with these flips after it.
fn methods(flips: Flips) -> [Method; 4] {
    [
        Method::Contract(Options { flips, ..Options::default() }),
        Method::Cluster(cluster::Options { flips, ..cluster::Options::default() }),
        Method::Removal(removal::Options { flips, ..removal::Options::default() }),
        Method::Partition(partition::Options { flips, ..partition::Options::variational(vsa::Goal::Regions(40)) }),
    ]
}

/// Regions alone say how many faces partition leaves.
fn run(mesh: &Mesh, method: &Method, budget: Budget, device: &Device) -> Outcome {
    let budget = if matches!(method, Method::Partition(_)) { Budget::default() } else { budget };
    simplify(mesh, method, &budget, device, None).expect("a valid mesh and budget")
}

fn corners(mesh: &Mesh, face: [u32; 3]) -> [DVec3; 3] {
    face.map(|v| mesh.positions[v as usize])
}

/// A roof over a square: along the ridge is right, across is wrong.
fn roof(along: bool) -> Mesh {
    let points = [[0.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 2.0, 0.0], [0.0, 2.0, 1.0]];
    let faces = if along { [[0, 1, 3], [1, 2, 3]] } else { [[0, 1, 2], [0, 2, 3]] };
    mesh(&points, &faces)
}

#[test]
fn an_edge_turns_to_the_ridge_of_the_original_and_stays() {
    let (turned, count) = flipped(&roof(true), &roof(false), by(Objective::Distance));
    assert_eq!(count, 1);
    let has_ridge = |face: &[u32; 3]| face.contains(&1) && face.contains(&3);
    assert!(turned.faces.iter().all(has_ridge), "{:?}", turned.faces);
    assert_eq!(turned.area(), roof(true).area());
    assert_eq!(flipped(&roof(true), &roof(true), by(Objective::Distance)), (roof(true), 0));
}

/// The angles opposite the long diagonal of a flat kite are obtuse.
#[test]
fn a_flat_kite_gets_its_short_diagonal() {
    let points = [[-3.0, 0.0, 0.0], [0.0, -1.0, 0.0], [3.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let long = mesh(&points, &[[0, 1, 2], [0, 2, 3]]);
    let (short, count) = flipped(&long, &long, by(Objective::Shape));
    assert_eq!((count, short.faces.iter().all(|face| face.contains(&1) && face.contains(&3))), (1, true));
    assert_eq!(flipped(&short, &short, by(Objective::Shape)), (short.clone(), 0));
    // No distance and no bend changes on a flat.
    for objective in [Objective::Distance, Objective::Bend] {
        assert_eq!(flipped(&long, &long, by(objective)), (long.clone(), 0), "{objective:?}");
    }
}

#[test]
fn what_a_flip_would_break_stays() {
    // The new edge of a tetrahedron is there already, of a dart it lies outside.
    let tetrahedron = coarsen::mesh::shapes::tetrahedron();
    let far = bumpy(sphere(2), 0.3);
    let dart = mesh(&[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 4.0, 0.0]], &[[0, 1, 2], [0, 2, 3]]);
    for objective in OBJECTIVES {
        assert_eq!(flipped(&far, &tetrahedron, by(objective)).1, 0, "{objective:?}");
        assert_eq!(flipped(&far, &dart, by(objective)).1, 0, "{objective:?}");
    }
    // A cube is as close to itself as can be.
    assert_eq!(flipped(&cube(6), &cube(6), by(Objective::Distance)).1, 0);
}

#[test]
fn flips_keep_topology_vertices_and_sides() {
    let sheet = bumpy(grid(40, 40), 0.3);
    for (name, mesh) in [("ball", bumpy(sphere(4), 0.1)), ("sheet", sheet)] {
        for objective in OBJECTIVES {
            for (plain, with) in methods(Flips::default()).iter().zip(&methods(by(objective))) {
                let name = format!("{name} {objective:?} {with:?}");
                let before = run(&mesh, plain, Budget::keep(0.1), &cpu(1));
                let after = run(&mesh, with, Budget::keep(0.1), &cpu(1));
                assert!(after.flips > 0, "{name}");
                assert_eq!((before.flips, before.seconds.flip), (0, 0.0));
                assert_eq!(after.mesh.positions, before.mesh.positions, "{name}");
                assert_eq!(after.vertex_origin, before.vertex_origin, "{name}");
                assert_eq!(after.mesh.faces.len(), before.mesh.faces.len(), "{name}");
                let (was, is) = (topology(&before.mesh), topology(&after.mesh));
                assert_eq!((is.euler, is.border_loops), (was.euler, was.border_loops), "{name}");
                assert!(is.non_manifold_edges <= was.non_manifold_edges, "{name}");
                assert!(is.misoriented_edges <= was.misoriented_edges, "{name}");
                if !matches!(with, Method::Cluster(_)) {
                    assert_kept(&name, &mesh, &after);
                }
                // Every changed face looks to the side that its neighborhood did: within 78° of a mean of two.
                let old: std::collections::BTreeSet<_> = before.mesh.faces.iter().collect();
                let is_flat = |face: &[u32; 3]| {
                    let [a, b, c] = corners(&after.mesh, *face);
                    (b - a).cross(c - a).length() > 0.0
                };
                assert!(after.mesh.faces.iter().filter(|face| !old.contains(face)).all(is_flat), "{name}");
            }
        }
    }
}

#[test]
fn flips_by_distance_lower_the_deviation() {
    for name in ["statue", "terrain"] {
        let mesh = sample(name, Some(20_000)).expect("a sample");
        for (plain, with) in methods(Flips::default()).iter().zip(&methods(by(Objective::Distance))) {
            let [before, after] = [plain, with].map(|method| {
                let outcome = run(&mesh, method, Budget::keep(0.05), &cpu(2));
                deviation(&mesh, &outcome.mesh, 20_000).rms
            });
            assert!(after < before, "{name} {with:?}: {before} → {after}");
        }
    }
}

#[test]
fn a_log_and_flips_exclude_each_other() {
    let options = Options { log: true, flips: by(Objective::Shape), ..Options::default() };
    let result = simplify(&sphere(2), &Method::Contract(options), &Budget::faces(20), &cpu(1), None);
    assert!(matches!(result, Err(Error::Parameter(_))), "{result:?}");
}

#[test]
fn devices_and_threads_do_not_change_the_bytes() {
    let devices: Vec<Device> = [1, 2, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default())).collect();
    let mesh = sample("statue", Some(20_000)).expect("a sample");
    for objective in OBJECTIVES {
        for method in methods(by(objective)) {
            let outcomes = devices.iter().map(|device| run(&mesh, &method, Budget::keep(0.1), device));
            let found: Vec<_> = outcomes.map(|outcome| (bytes(&outcome.mesh), outcome.flips)).collect();
            assert!(found.iter().all(|other| *other == found[0]), "{method:?}");
        }
    }
}
