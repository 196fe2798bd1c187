//! What holds on every mesh: topology, exact counts, repeatability, invariance. `COARSEN_LONG=1` takes larger meshes and more of them.
#![expect(clippy::print_stdout, reason = "tests print what a reader of a failure needs")]

mod support;

use std::ops::ControlFlow;

use coarsen::contract::{Metric, Options, Placement};
use coarsen::math::DVec3;
use coarsen::mesh::{Rings, SAMPLES, dual, sample, shapes};
use coarsen::partition::vsa::Goal;
use coarsen::partition::{self, Flatness, Partition, Superfaces};
use coarsen::simplify::{MOVED, Progress};
use coarsen::{Budget, Device, Mesh, Method, Outcome, StopReason, simplify};
use support::deviation::{Random, deviation};
use support::engine::{METRICS, asked, assert_kept, bytes, contract, contract_on, cpu, defects, options};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, sphere, torus};

/// How many random meshes of each kind.
fn cases() -> u64 {
    if asked("COARSEN_LONG") { 40 } else { 3 }
}

/// Moves every vertex by up to `amplitude` along each axis.
fn jitter(mut mesh: Mesh, amplitude: f64, random: &mut Random) -> Mesh {
    for p in &mut mesh.positions {
        *p += DVec3::from_array([(); 3].map(|()| amplitude * (2.0 * random.unit() - 1.0)));
    }
    mesh
}

/// Cuts `holes` holes of the faces around a vertex each, no two of them next to each other.
fn punched(mesh: Mesh, holes: usize, random: &mut Random) -> Mesh {
    let mut used = vec![false; mesh.positions.len()];
    let mut gone = vec![false; mesh.faces.len()];
    for _ in 0..holes {
        let center = (random.bits() % mesh.positions.len() as u64) as u32;
        let around: Vec<usize> = (0..mesh.faces.len()).filter(|&f| mesh.faces[f].contains(&center)).collect();
        let ring = around.iter().flat_map(|&f| mesh.faces[f]);
        // A border vertex would leave a bow tie or an island.
        let apart = ring.clone().all(|v| !used[v as usize]) && around.len() > 3;
        let rim: Vec<u32> = ring.clone().filter(|&v| v != center).collect();
        let closed = rim.iter().all(|v| rim.iter().filter(|w| *w == v).count() == 2);
        if apart && closed {
            around.iter().for_each(|&f| gone[f] = true);
            mesh.faces
                .iter()
                .filter(|face| face.iter().any(|v| rim.contains(v)))
                .flatten()
                .for_each(|&v| used[v as usize] = true);
        }
    }
    let mut renamed = vec![u32::MAX; mesh.positions.len()];
    let mut left = Mesh::default();
    for (face, _) in mesh.faces.iter().zip(&gone).filter(|(_, gone)| !**gone) {
        left.faces.push(face.map(|v| {
            if renamed[v as usize] == u32::MAX {
                renamed[v as usize] = left.positions.len() as u32;
                left.positions.push(mesh.positions[v as usize]);
            }
            renamed[v as usize]
        }));
    }
    left
}

/// An open sheet of smooth hills, twenty squares a unit.
fn sheet(columns: u32, rows: u32) -> Mesh {
    bumpy(mapped(&grid(columns, rows), |p| p / 20.0), 0.1)
}

/// Closed and open, smooth and rough, of one part and of many.
fn meshes() -> Vec<(String, Mesh)> {
    let mut all = Vec::new();
    for case in 0..cases() {
        let mut random = Random(case);
        let mut add = |name: &str, mesh: Mesh| all.push((format!("{name} {case}"), mesh));
        let level = if case % 2 == 0 { 4 } else { 5 };
        add("ball", jitter(bumpy(sphere(level), 0.15 * random.unit()), 0.01, &mut random));
        let (around, across) = (40 + random.bits() as u32 % 60, 16 + random.bits() as u32 % 30);
        add("torus", jitter(bumpy(torus(around, across), 0.05), 0.005, &mut random));
        let columns = 20 + random.bits() as u32 % 50;
        add("sheet", jitter(sheet(columns, 30), 0.003, &mut random));
        let holes = 5 + random.bits() as usize % 20;
        add("punched ball", punched(bumpy(sphere(5), 0.1), holes, &mut random));
        add("punched torus", punched(bumpy(torus(60, 30), 0.05), holes, &mut random));
        add("cube", cube(10 + random.bits() as u32 % 15));
    }
    all.push(("double torus".into(), shapes::double_torus()));
    let faces = if asked("COARSEN_LONG") { 40_000 } else { 6000 };
    // Boards of an office, thinner than its squares, fold where a few faces each are left.
    let samples = SAMPLES.iter().map(|&(name, ..)| name).filter(|&name| name != "office");
    // Colors of faces go, whatever is done.
    let plain = |name| Mesh { face_colors: None, ..sample(name, Some(faces)).expect("a sample") };
    all.extend(samples.map(|name| (name.to_string(), plain(name))));
    all
}

// Topology and counts

#[test]
fn surfaces_keep_their_topology_and_meet_the_count() {
    let (mut folds, mut faces) = (0, 0);
    for (name, mesh) in meshes() {
        assert_eq!(defects(&mesh), [0; 7], "{name}: not a test of what it should be");
        let closed = topology(&mesh).border_edges == 0;
        for metric in METRICS {
            for (share, placement) in
                [(2, Placement::Optimal), (10, Placement::Optimal), (10, Placement::Segment), (10, Placement::Endpoint)]
            {
                let target = mesh.faces.len() / share / 2 * 2;
                let options = Options { placement, ..options(metric) };
                let name = format!("{name} {metric:?} {placement:?} {} → {target}", mesh.faces.len());
                let outcome = contract(&mesh, &options, Budget::faces(target));
                assert_kept(&name, &mesh, &outcome);
                if outcome.stop == StopReason::FacesReached {
                    assert_eq!(outcome.mesh.faces.len(), target, "{name}");
                } else {
                    assert!(!closed || target < 200, "{name}: {:?} at {}", outcome.stop, outcome.mesh.faces.len());
                }
                let folded = defects(&outcome.mesh)[6];
                assert!(folded <= 4 + target / 100, "{name}: {folded} folded edges");
                (folds, faces) = (folds + folded, faces + target);
            }
        }
    }
    println!("{folds} folded edges on {faces} faces");
    assert!(folds <= faces / 2000, "{folds} folded edges on {faces} faces");
}

/// As far as it goes: whatever is left has the topology it began with.
#[test]
fn the_last_faces_still_have_the_topology() {
    for (name, mesh) in meshes() {
        let was = topology(&mesh);
        for metric in METRICS {
            let outcome = contract(&mesh, &options(metric), Budget::faces(0));
            let (is, name) = (topology(&outcome.mesh), format!("{name} {metric:?} → {}", outcome.mesh.faces.len()));
            assert_eq!(outcome.stop, StopReason::Stuck, "{name}");
            assert_eq!(
                (is.euler, is.components, is.border_loops),
                (was.euler, was.components, was.border_loops),
                "{name}"
            );
            let flaws =
                [is.non_manifold_edges, is.bow_ties, is.misoriented_edges, is.degenerate_faces, is.duplicate_faces];
            assert_eq!(flaws, [0; 5], "{name}: {is:?}");
        }
    }
}

/// Cancelled after each round in turn: the invariants hold between rounds, not only at the end.
#[test]
fn every_round_keeps_the_topology() {
    let mut random = Random(9);
    let meshes =
        [("punched torus", punched(bumpy(torus(50, 24), 0.05), 9, &mut random)), ("ball", bumpy(sphere(4), 0.1))];
    for (name, mesh) in &meshes {
        for metric in METRICS {
            for rounds in 1.. {
                let mut left = rounds;
                let mut stop = |_: Progress| {
                    left -= 1;
                    if left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                };
                let method = Method::Contract(options(metric));
                let outcome = simplify(mesh, &method, &Budget::keep(0.02), &cpu(1), Some(&mut stop)).expect("valid");
                assert_kept(&format!("{name} {metric:?}, {rounds} rounds"), mesh, &outcome);
                if outcome.stop != StopReason::Cancelled {
                    assert!(rounds > 4, "{name}: over after {rounds} rounds");
                    break;
                }
            }
        }
    }
}

#[test]
fn a_moebius_strip_stays_one() {
    for n in [30, 31, 400] {
        let strip = shapes::moebius(n);
        let was = topology(&strip);
        for metric in METRICS {
            let outcome = contract(&strip, &options(metric), Budget::keep(0.3));
            let is = topology(&outcome.mesh);
            assert_eq!((is.euler, is.components, is.border_loops), (was.euler, 1, 1), "{n} {metric:?}");
            assert_eq!(
                [is.non_manifold_edges, is.bow_ties, is.degenerate_faces, is.duplicate_faces],
                [0; 4],
                "{n} {metric:?}"
            );
            assert!(is.misoriented_edges >= 1, "{n} {metric:?}: a Möbius strip has no orientation");
        }
    }
}

/// Regions of each kind.
fn partitions() -> [(&'static str, Method); 5] {
    let bent = Flatness { angle_rad: 0.3, distance: 0.003 };
    [
        ("coplanar", partition::Options::coplanar(Flatness::default())),
        ("bent", partition::Options::coplanar(bent)),
        ("vsa", partition::Options::variational(Goal::Regions(60))),
        ("superface", partition::Options::superfaces(Superfaces { slides: false, ..Superfaces::default() })),
        ("sliding", partition::Options::superfaces(Superfaces::default())),
    ]
    .map(|(name, options)| (name, Method::Partition(options)))
}

/// The meshes with light that runs evenly over them, so that superfaces have it too.
fn lit_meshes() -> Vec<(String, Mesh)> {
    let lit = |mesh: Mesh| {
        let (low, high) = mesh.bounds();
        let light = |&p: &DVec3| {
            let share = (p - low) / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
            [share.x as f32, share.y as f32, share.z as f32, 1.0]
        };
        Mesh { colors: Some(mesh.positions.iter().map(light).collect()), ..mesh }
    };
    meshes().into_iter().map(|(name, mesh)| (name, lit(mesh))).collect()
}

fn partition_on(device: &Device, mesh: &Mesh, method: &Method) -> Outcome {
    simplify(mesh, method, &Budget::default(), device, None).expect("a valid mesh")
}

/// Every face has a region, none of them is torn, and what is drawn in their place has the topology, no more faces, and only
/// vertices of the input but for those that slid.
#[test]
fn regions_keep_the_topology() {
    for (name, mesh) in lit_meshes() {
        let across = dual::neighbors(&mesh.faces, &Rings::new(&mesh.faces, mesh.positions.len()));
        for (kind, method) in partitions() {
            let (name, outcome) = (format!("{name} {kind}"), partition_on(&cpu(1), &mesh, &method));
            assert_kept(&name, &mesh, &outcome);
            assert!(outcome.mesh.faces.len() <= mesh.faces.len(), "{name}: {} faces", outcome.mesh.faces.len());
            let is_moved = |origin: u32| kind == "sliding" && origin == MOVED;
            let vertices = outcome.mesh.positions.iter().zip(&outcome.vertex_origin);
            for (&p, &origin) in vertices.filter(|(_, origin)| !is_moved(**origin)) {
                assert_eq!(p, mesh.positions[origin as usize], "{name}: vertex {origin}");
            }
            let regions = outcome.regions.expect("regions");
            let partition = Partition { labels: regions.labels, region_count: regions.count };
            assert_eq!(partition.validate(&across), [], "{name}");
        }
    }
}

// The same again

#[test]
fn regions_are_the_same_on_any_number_of_threads() {
    let threads = [2, 3, 1].map(cpu);
    for (name, mesh) in lit_meshes() {
        let input = mesh.clone();
        for (kind, method) in partitions() {
            let first = partition_on(&cpu(1), &mesh, &method);
            for device in &threads {
                let again = partition_on(device, &mesh, &method);
                assert!(bytes(&again.mesh) == bytes(&first.mesh), "{name} {kind}: {}", device.description());
                assert_eq!(again.regions, first.regions, "{name} {kind}: {}", device.description());
            }
        }
        assert_eq!(input, mesh, "{name}: the input changed");
    }
}

#[test]
fn the_same_call_returns_the_same_bytes_and_leaves_the_input() {
    let threads = [1, 2, 3].map(cpu);
    for (name, mesh) in meshes() {
        let input = mesh.clone();
        for metric in METRICS {
            let mut first: Option<Vec<u8>> = None;
            for device in threads.iter().chain(&threads[..1]) {
                let found = bytes(&contract_on(device, &mesh, &options(metric), Budget::keep(0.1)).mesh);
                let first = first.get_or_insert_with(|| found.clone());
                assert!(*first == found, "{name} {metric:?}: {}", device.description());
            }
        }
        assert_eq!(input, mesh, "{name}: the input changed");
    }
}

#[test]
fn the_input_s_own_count_returns_the_input() {
    for (name, mesh) in meshes() {
        for metric in METRICS {
            let outcome = contract(&mesh, &options(metric), Budget::faces(mesh.faces.len()));
            assert_eq!(outcome.mesh, mesh, "{name} {metric:?}");
            let once = contract(&mesh, &options(metric), Budget::keep(0.5)).mesh;
            let again = contract(&once, &options(metric), Budget::faces(once.faces.len())).mesh;
            assert_eq!(again, once, "{name} {metric:?}");
        }
    }
}

// Invariance

fn mapped(mesh: &Mesh, map: impl Fn(DVec3) -> DVec3) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| map(p)).collect(), ..mesh.clone() }
}

/// Powers of two scale exactly, so the result must.
#[test]
fn a_power_of_two_scales_the_result_exactly() {
    for (name, mesh) in meshes().into_iter().take(6) {
        for metric in METRICS {
            let plain = contract(&mesh, &options(metric), Budget::keep(0.1));
            for scale in [-300, -20, -1, 1, 3, 20, 300].map(|exponent| 2f64.powi(exponent)) {
                let scaled = contract(&mapped(&mesh, |p| p * scale), &options(metric), Budget::keep(0.1));
                let expected = mapped(&plain.mesh, |p| p * scale);
                assert!(scaled.mesh == expected, "{name} {metric:?} {scale:e}");
                assert_eq!(scaled.error_estimate, plain.error_estimate * scale, "{name} {metric:?} {scale:e}");
            }
        }
    }
}

#[test]
fn a_power_of_two_scales_regions_exactly() {
    for (name, mesh) in lit_meshes().into_iter().take(6) {
        for (kind, method) in partitions() {
            let plain = partition_on(&cpu(1), &mesh, &method);
            for scale in [-300, -20, -1, 1, 3, 20, 300].map(|exponent| 2f64.powi(exponent)) {
                let scaled = partition_on(&cpu(1), &mapped(&mesh, |p| p * scale), &method);
                assert!(scaled.mesh == mapped(&plain.mesh, |p| p * scale), "{name} {kind} {scale:e}");
                assert_eq!(scaled.error_estimate, plain.error_estimate * scale, "{name} {kind} {scale:e}");
            }
        }
    }
}

type Map = fn(DVec3) -> DVec3;

/// Cyclic changes of the axes, reflections and rotations by a quarter change only the order of sums.
const MOVES: [(&str, Map); 8] = [
    ("1e-6", |p| p * 1e-6),
    ("1e6", |p| p * 1e6),
    ("0.3", |p| p * 0.3),
    ("zxy", |p| DVec3::new(p.z, p.x, p.y)),
    ("quarter turn", |p| DVec3::new(-p.y, p.x, p.z)),
    ("turn", |p| {
        DVec3::new(0.6 * p.x - 0.8 * p.y, 0.48 * p.x + 0.36 * p.y - 0.8 * p.z, 0.64 * p.x + 0.48 * p.y + 0.6 * p.z)
    }),
    ("a diagonal away", |p| p + DVec3::new(2.0, -1.0, 3.0)),
    ("1000 diagonals away", |p| p + DVec3::new(2000.0, -1000.0, 3000.0)),
];

/// Single runs scatter by some per cent, since ties and near ties fall otherwise: the mean over the meshes must not move.
#[test]
fn moving_turning_and_scaling_keep_the_quality() {
    let mut random = Random(3);
    // Thousands of faces are left: with hundreds, means over three meshes still scatter by a per cent.
    let meshes = [bumpy(sphere(5), 0.1), jitter(bumpy(torus(160, 80), 0.05), 0.0015, &mut random), sheet(120, 100)];
    for metric in METRICS {
        for (name, map) in MOVES {
            let mut mean = 0.0;
            let mut worst: f64 = 0.0;
            for mesh in &meshes {
                // Relative to the mean side of the faces: the box's diagonal changes as the mesh turns.
                let rms = |mesh: &Mesh| {
                    let result = contract(mesh, &options(metric), Budget::keep(0.1)).mesh;
                    deviation(mesh, &result, 30_000).rms * mesh.diagonal() / mesh.area().sqrt()
                };
                let ratio = rms(&mapped(mesh, map)) / rms(mesh);
                mean += ratio.ln() / meshes.len() as f64;
                worst = worst.max(ratio.ln().abs());
            }
            println!("{metric:?} {name}: mean {:.4} worst {:.4}", mean.exp(), worst.exp());
            assert!(mean.abs() <= 0.01, "{metric:?} {name}: {:.4} times the deviation", mean.exp());
            assert!(worst <= 0.03, "{metric:?} {name}: up to {:.4} times", worst.exp());
        }
    }
}

/// Volume and area of a closed surface hardly change, and its inside stays inside.
#[test]
fn the_volume_is_kept() {
    for (name, mesh) in [("ball", bumpy(sphere(5), 0.1)), ("torus", bumpy(torus(80, 40), 0.05))] {
        for (metric, most) in [(Metric::Volume, 1e-4), (Metric::Plane, 1e-2)] {
            let outcome: Outcome = contract(&mesh, &options(metric), Budget::keep(0.1));
            let change = outcome.mesh.volume() / mesh.volume() - 1.0;
            println!("{name} {metric:?}: the volume changed by {change:e}");
            assert!(change.abs() < most, "{name} {metric:?}: the volume changed by {change:e}");
        }
    }
}
