//! Logs of runs: they lead to the result and back, every state between is a mesh as good as both, and every device
//! writes the same.

mod support;

use coarsen::contract::{Metric, Options, Placement};
use coarsen::math::{DVec3, Vec3};
use coarsen::mesh::{sample, shapes, weld};
use coarsen::progressive::{CollapseLog, Replay};
use coarsen::{Budget, Error, Mesh, Method, Outcome, simplify};
use support::engine::{METRICS, assert_replays, assert_same_mesh, contract, contract_on, cpu, defects, gpu};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, sphere, torus};

fn logged(metric: Metric) -> Options {
    Options { metric, log: true, ..Options::default() }
}

fn run(mesh: &Mesh, options: &Options, budget: Budget) -> (Outcome, CollapseLog) {
    let outcome = contract(mesh, options, budget);
    let log = outcome.log.clone().expect("a log was asked for");
    (outcome, log)
}

/// Every face with vertices of its own, normals and colors that differ among those that will be joined.
fn soup(mesh: &Mesh) -> Mesh {
    let corners = mesh.faces.as_flattened();
    let mut soup = Mesh::new(
        corners.iter().map(|&v| mesh.positions[v as usize]).collect(),
        (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(),
    );
    soup.normals = Some(soup.positions.iter().map(|p| p.as_vec3().normalize_or(Vec3::X)).collect());
    soup.colors =
        Some((0..corners.len()).map(|i| [0.25 * (i % 5) as f32, 0.5, 1.0, 1.0 / (1 + i % 3) as f32]).collect());
    soup
}

/// `mesh` with faces and vertices that preparing drops.
fn littered(mut mesh: Mesh) -> Mesh {
    let far = mesh.positions.len() as u32;
    mesh.positions.insert(0, DVec3::splat(0.5));
    mesh.faces.iter_mut().for_each(|face| *face = face.map(|v| v + 1));
    let [a, b, c] = mesh.faces[7];
    mesh.faces.splice(3..3, [[a, a, b], [b, c, a]]);
    mesh.faces.insert(0, [0, far, 0]);
    mesh
}

fn holed(mut mesh: Mesh) -> Mesh {
    mesh.faces = mesh.faces.iter().copied().enumerate().filter(|(f, _)| f % 97 != 0).map(|(_, face)| face).collect();
    mesh
}

/// Closed, open, of one side, of several parts, not manifold, wound both ways, not welded, with rubbish.
fn meshes() -> Vec<(&'static str, Mesh)> {
    let part = |name| sample(name, Some(2_000)).expect("a sample");
    let mut wound = bumpy(torus(30, 20), 0.05);
    wound.faces.iter_mut().step_by(9).for_each(|face| face.swap(1, 2));
    // Three sheets on one edge, beside a sphere.
    let mut book = sphere(3);
    let first = book.positions.len() as u32;
    book.positions.extend(
        [[3.0, 0.0, 0.0], [3.0, 0.0, 1.0], [4.0, 0.0, 0.0], [4.0, 1.0, 0.0], [4.0, -1.0, 0.0]].map(DVec3::from),
    );
    book.faces.extend([2, 3, 4].map(|page| [first, first + 1, first + page]));
    vec![
        ("sphere", bumpy(sphere(3), 0.1)),
        ("statue", part("statue")),
        ("terrain", part("terrain")),
        ("grid", grid(20, 15)),
        ("strip", shapes::moebius(300)),
        ("assembly", part("assembly")),
        ("holes", holed(part("part"))),
        ("book", book),
        ("wound", wound),
        ("soup", soup(&part("statue"))),
        ("litter", littered(part("part"))),
    ]
}

#[test]
fn a_log_leads_to_the_result_and_back() {
    for (name, mesh) in meshes() {
        for metric in METRICS {
            let with = logged(metric);
            let variants = [
                Options { placement: Placement::Endpoint, ..with.clone() },
                Options { placement: Placement::EndpointOrMiddle, ..with.clone() },
                Options { weld: None, ..with.clone() },
                Options { weld: Some(0.02), ..with.clone() },
                with,
            ];
            for options in variants {
                let name = format!("{name} {options:?}");
                let (outcome, log) = run(&mesh, &options, Budget::keep(0.1));
                assert!(!log.contractions().is_empty() || name.starts_with("soup"), "{name}: nothing is contracted");
                assert_eq!((log.vertices_in(), log.faces_in()), (mesh.positions.len(), mesh.faces.len()), "{name}");
                let start = assert_replays(&name, &mesh, &outcome);
                assert_faces_fall(&name, &mesh, &log);
                if let Some(tolerance) = options.weld {
                    assert_same_mesh(&name, &start, &weld(&mesh, tolerance).mesh);
                }
            }
        }
    }
}

/// Every contraction of an edge removes one face or two.
fn assert_faces_fall(name: &str, mesh: &Mesh, log: &CollapseLog) {
    let mut replay = Replay::new(mesh, log).expect("its own mesh");
    loop {
        let faces = replay.face_count();
        if !replay.forward() {
            return;
        }
        let lost = faces - replay.face_count();
        assert!((1..=2).contains(&lost), "{name}: contraction {} removes {lost} faces", replay.step());
    }
}

/// Where parts join, a contraction may remove no face, or faces that cancel each other out.
#[test]
fn parts_that_join_are_replayed() {
    let parts = sample("assembly", Some(20_000)).expect("a sample");
    let shells = contract(&parts, &Options::default(), Budget::faces(1)).mesh;
    let mut facing = shapes::cube(1);
    let count = facing.positions.len() as u32;
    let (low, high) = facing.bounds();
    let mirrored = |p: &DVec3| DVec3::new(2.0 * high.x - p.x + 1e-3 * (high - low).x, p.y, p.z);
    let others: Vec<DVec3> = facing.positions.iter().map(mirrored).collect();
    let faces: Vec<[u32; 3]> = facing.faces.iter().map(|&[a, b, c]| [a + count, c + count, b + count]).collect();
    facing.positions.extend(others);
    facing.faces.extend(faces);
    for metric in METRICS {
        let cases = [("facing", &facing, 2e-3 * (high - low).x, 0.5), ("shells", &shells, 2.0, 0.05)];
        for (name, mesh, join_within, share) in cases {
            let options = Options { join_within, ..logged(metric) };
            let (outcome, log) = run(mesh, &options, Budget::keep(share));
            let start = assert_replays(name, mesh, &outcome);
            assert_same_mesh(name, &start, &weld(mesh, 0.0).mesh);
            assert!(topology(&outcome.mesh).components < topology(&start).components, "{name}: nothing joins");
            let mut replay = Replay::new(mesh, &log).expect("its own mesh");
            let mut losses = Vec::new();
            loop {
                let faces = replay.face_count();
                if !replay.forward() {
                    break;
                }
                losses.push(faces - replay.face_count());
                assert_eq!(replay.vertex_count(), replay.mesh().positions.len(), "{name} at {}", replay.step());
            }
            // The first pairs have no edge, and no face vanishes until all three corners meet.
            assert!(name != "facing" || losses.iter().sum::<usize>() >= 4 && losses[0] == 0, "{metric:?}: {losses:?}");
        }
    }
}

#[test]
fn what_is_pruned_is_no_part_of_the_log() {
    let assembly = soup(&sample("assembly", Some(5_000)).expect("a sample"));
    let options = Options { prune: Some(0.15), ..logged(Metric::Volume) };
    let (outcome, log) = run(&assembly, &options, Budget::keep(0.2));
    let start = assert_replays("assembly", &assembly, &outcome);
    assert_eq!(start.faces.len() + log.dropped_faces().len(), assembly.faces.len());
    let whole = weld(&assembly, 0.0).mesh;
    assert!(start.faces.len() < whole.faces.len(), "nothing is pruned");
    assert!(topology(&start).components < topology(&whole).components);
    for v in 0..assembly.positions.len() as u32 {
        let at = log.representative(v).map(|to| assembly.positions[to as usize]);
        assert!(at.is_none_or(|p| p == assembly.positions[v as usize]), "vertex {v} is joined to another place");
    }
    assert_eq!(log.representative(assembly.positions.len() as u32), None);
}

#[test]
fn every_state_is_as_good_as_the_start() {
    for (name, mesh) in meshes().into_iter().filter(|(name, _)| !["soup", "litter", "book", "wound"].contains(name)) {
        for metric in METRICS {
            let (_, log) = run(&mesh, &logged(metric), Budget::keep(0.05));
            let mut replay = Replay::new(&mesh, &log).expect("its own mesh");
            let start = replay.mesh();
            let (was, had) = (topology(&start), defects(&start));
            for step in (0..=log.contractions().len()).step_by(7) {
                replay.seek(step);
                let mesh = replay.mesh();
                let (is, has) = (topology(&mesh), defects(&mesh));
                assert_eq!((replay.face_count(), replay.vertex_count()), (mesh.faces.len(), mesh.positions.len()));
                assert_eq!(
                    (is.euler, is.components, is.border_loops, is.non_manifold_edges, is.bow_ties, is.vertices),
                    (
                        was.euler,
                        was.components,
                        was.border_loops,
                        was.non_manifold_edges,
                        was.bow_ties,
                        mesh.positions.len()
                    ),
                    "{name} {metric:?} at {step}"
                );
                // Folds aside, as for results.
                let grown = has[..6].iter().zip(&had[..6]).any(|(has, had)| has > had);
                assert!(!grown, "{name} {metric:?} at {step}: {had:?} → {has:?}");
            }
        }
    }
}

#[test]
fn states_do_not_depend_on_the_way_to_them() {
    let mesh = soup(&sample("statue", Some(2_000)).expect("a sample"));
    let (outcome, log) = run(&mesh, &logged(Metric::Volume), Budget::faces(300));
    let mut walker = Replay::new(&mesh, &log).expect("its own mesh");
    for faces in [1_000, 1_001, 400, 1_999, 300, 299, 5_000, 0, 301] {
        let found = walker.to_faces(faces);
        let mut fresh = Replay::new(&mesh, &log).expect("its own mesh");
        while fresh.face_count() > faces && fresh.forward() {}
        assert_eq!((found, walker.step()), (fresh.face_count(), fresh.step()), "{faces}");
        assert!(found <= faces || walker.step() == log.contractions().len(), "{faces}");
        assert_same_mesh(&format!("{faces} faces"), &walker.mesh(), &fresh.mesh());
    }
    walker.seek(usize::MAX);
    assert!(!walker.forward());
    assert_same_mesh("the end", &walker.mesh(), &outcome.mesh);
    walker.seek(0);
    assert!(!walker.back());
}

/// ```text
///       3---2        Vertex 6 lies in the plane of a hexagon whose border is locked: it goes to the corner that is free
///      / \ / \       of charge, whichever it is, and only faces 0 to 5 around it can go.
///     4---6---1
///      \ / \ /
///       5---0
/// ```
#[test]
fn a_record_names_input_vertices() {
    let hexagon = [[1.0, -2.1], [2.2, 0.1], [1.1, 2.0], [-0.9, 1.8], [-2.0, -0.2], [-1.1, -1.9], [0.1, 0.2]];
    let faces = (0..6).map(|i| [i, (i + 1) % 6, 6]).collect();
    let fan = Mesh::new(hexagon.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec(), faces);
    for metric in METRICS {
        let (_, log) = run(&fan, &Options { lock_border: true, ..logged(metric) }, Budget::faces(4));
        let [only] = log.contractions() else { panic!("{} contractions", log.contractions().len()) };
        assert_eq!((only.gone, only.position), (6, fan.positions[only.keep as usize]), "{metric:?}");
        let mut replay = Replay::new(&fan, &log).expect("its own mesh");
        assert!(replay.forward());
        assert_eq!(replay.mesh().positions, fan.positions[..6]);
    }
}

#[test]
fn every_device_writes_the_same_log() {
    let mut devices: Vec<_> = [1, 2, 3].map(cpu).into();
    devices.extend(gpu(&Default::default()));
    for name in ["statue", "terrain"] {
        let mesh = sample(name, Some(30_000)).expect("a sample");
        for metric in METRICS {
            let log =
                |device| contract_on(device, &mesh, &logged(metric), Budget::keep(0.05)).log.map(|log| log.to_bytes());
            let reference = log(&devices[0]);
            assert!(reference.is_some());
            for device in &devices[1..] {
                assert!(log(device) == reference, "{name} {metric:?}: {}", device.description());
            }
        }
    }
}

#[test]
fn a_log_changes_nothing_else() {
    let mesh = sample("part", Some(5_000)).expect("a sample");
    for metric in METRICS {
        let plain = contract(&mesh, &Options { log: false, ..logged(metric) }, Budget::keep(0.1));
        let (outcome, _) = run(&mesh, &logged(metric), Budget::keep(0.1));
        assert_eq!(plain.log, None);
        assert_same_mesh("with a log", &outcome.mesh, &plain.mesh);
        assert_eq!((outcome.rounds, outcome.vertex_origin), (plain.rounds, plain.vertex_origin));
    }
}

#[test]
fn another_mesh_is_refused() {
    let mesh = cube(4);
    let (_, log) = run(&mesh, &logged(Metric::Volume), Budget::keep(0.5));
    let refusal = |mesh: &Mesh| match Replay::new(mesh, &log) {
        Err(Error::Parameter(message)) => message,
        other => panic!("{other:?}"),
    };
    let mut moved = mesh.clone();
    moved.positions[5].x += 1e-15;
    assert!(refusal(&moved).contains("another mesh: it too has"), "{}", refusal(&moved));
    let mut turned = mesh.clone();
    turned.faces[3].rotate_left(1);
    assert!(refusal(&turned).contains("but others"));
    let counts = format!("of {} vertices and {} faces, this one has 12 and 20", mesh.positions.len(), mesh.faces.len());
    assert!(refusal(&shapes::icosahedron()).contains(&counts), "{}", refusal(&shapes::icosahedron()));
    let broken = Mesh { faces: vec![[0, 1, 999]], ..mesh.clone() };
    assert!(matches!(Replay::new(&broken, &log), Err(Error::Mesh(_))));
}

#[test]
fn a_log_and_a_fit_exclude_each_other() {
    let method = Method::Contract(Options { fit: 1, ..logged(Metric::Volume) });
    let error = simplify(&cube(3), &method, &Budget::faces(12), &cpu(1), None).expect_err("both");
    assert!(matches!(&error, Error::Parameter(message) if message.contains("a log and a fit")), "{error}");
}

#[test]
fn files_come_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("cube.clog");
    let (_, log) = run(&cube(4), &logged(Metric::Plane), Budget::keep(0.5));
    log.write(&path).expect("a folder to write to");
    assert_eq!(CollapseLog::read(&path).ok(), Some(log));
    let missing = folder.path().join("none").join("cube.clog");
    assert!(matches!(CollapseLog::read(&missing), Err(Error::Read { .. })));
    assert!(matches!(CollapseLog::read(folder.path()), Err(Error::Read { .. })));
}
