//! Vertex removal: known answers, its invariants, budgets, and the same bytes everywhere.

mod support;

use std::ops::ControlFlow;

use coarsen::backend::GpuOptions;
use coarsen::math::DVec3;
use coarsen::mesh::{sample, shapes};
use coarsen::metrics::vertex_distances;
use coarsen::removal::{Features, Fill, Options, triangulations};
use coarsen::simplify::{Progress, RoundRecord};
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, StopReason, simplify};
use support::engine::{assert_kept, bytes, cpu, gpu};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, mesh, sphere, torus};

const FILLS: [Fill; 4] = [Fill::Fan, Fill::Ears, Fill::Dynamic, Fill::Exhaustive];

fn run_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Removal(options.clone()), &budget, device, None).expect("a valid mesh and budget")
}

fn run(mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    run_on(&cpu(1), mesh, options, budget)
}

fn with(fill: Fill) -> Options {
    Options { fill, ..Options::default() }
}

/// The result's vertices are the input's, bit for bit, and the topology is kept.
fn assert_removed(name: &str, before: &Mesh, outcome: &Outcome) {
    assert_kept(name, before, outcome);
    for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
        let q = before.positions[origin as usize];
        assert_eq!(p.to_array().map(f64::to_bits), q.to_array().map(f64::to_bits), "{name}: {origin}");
    }
    assert!(outcome.vertex_origin.is_sorted(), "{name}: not in the order of the input");
}

fn normal(mesh: &Mesh, [a, b, c]: [u32; 3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize]);
    (b - a).cross(c - a)
}

#[test]
fn triangulations_are_as_many_as_catalan_counted() {
    let counts: Vec<usize> = (2..9).map(|count| triangulations(count).len()).collect();
    assert_eq!(counts, [0, 1, 2, 5, 14, 42, 132]);
    let mut hexagons = triangulations(6);
    assert!(hexagons.iter().all(|triangles| triangles.len() == 4));
    hexagons.iter_mut().for_each(|triangles| triangles.sort_unstable());
    hexagons.sort_unstable();
    hexagons.dedup();
    assert_eq!(hexagons.len(), 14);
}

#[test]
fn counts_are_exact_and_the_topology_is_kept() {
    for (name, mesh) in [("sphere", sphere(4)), ("torus", torus(40, 24)), ("bumps", bumpy(cube(12), 0.05))] {
        for fill in FILLS {
            for faces in [mesh.faces.len() / 2, 300, 100] {
                let name = format!("{name} {fill:?} {faces}");
                let outcome = run(&mesh, &with(fill), Budget::faces(faces));
                assert_eq!((outcome.mesh.faces.len(), outcome.stop), (faces, StopReason::FacesReached), "{name}");
                assert_removed(&name, &mesh, &outcome);
                assert!(outcome.error_estimate > 0.0, "{name}");
            }
            // Pairs of faces go: an odd number is met from below.
            assert_eq!(run(&mesh, &with(fill), Budget::faces(201)).mesh.faces.len(), 200, "{name} {fill:?}");
        }
    }
}

#[test]
fn borders_keep_their_loops_and_odd_counts_are_met() {
    let sheet = bumpy(grid(24, 20), 0.3);
    for fill in FILLS {
        for faces in [401, 100, 33] {
            let outcome = run(&sheet, &with(fill), Budget::faces(faces));
            assert_eq!(outcome.mesh.faces.len(), faces, "{fill:?}");
            assert_removed(&format!("{fill:?} {faces}"), &sheet, &outcome);
        }
    }
    let options = Options { lock_border: true, ..Options::default() };
    let outcome = run(&sheet, &options, Budget::faces(0));
    let on_border = 2 * (24 + 20);
    assert_eq!(outcome.stop, StopReason::Stuck);
    assert!(outcome.blocked.lock >= on_border, "{:?}", outcome.blocked);
    let is_there = |p: &DVec3| outcome.mesh.positions.contains(p);
    let border = |v: usize| [v % 25, v / 25].iter().zip([24, 20]).any(|(&at, last)| at == 0 || at == last);
    assert!((0..sheet.positions.len()).filter(|&v| border(v)).all(|v| is_there(&sheet.positions[v])));
}

#[test]
fn a_flat_sheet_ends_at_two_faces_and_stays_flat() {
    for fill in FILLS {
        let outcome = run(&grid(20, 20), &with(fill), Budget::error_abs(0.0));
        assert_eq!((outcome.mesh.faces.len(), outcome.stop), (2, StopReason::ErrorReached), "{fill:?}");
        assert_eq!(outcome.error_estimate, 0.0, "{fill:?}");
        assert_eq!(outcome.vertex_origin, [0, 20, 420, 440], "{fill:?}");
        assert_eq!(outcome.mesh.area(), 400.0, "{fill:?}");
    }
}

#[test]
fn the_edges_of_a_cube_are_kept() {
    for features in [Features::default(), Features::Guide(0.7), Features::Keep(0.7)] {
        for fill in FILLS {
            let options = Options { fill, features, ..Options::default() };
            let outcome = run(&cube(8), &options, Budget::error_abs(0.0));
            assert_eq!(outcome.mesh.faces.len(), 12, "{features:?} {fill:?}");
            let (area, volume) = (outcome.mesh.area(), outcome.mesh.volume());
            assert!(area == 6.0 && (volume - 1.0).abs() < 1e-15, "{features:?} {fill:?}: {area} {volume}");
        }
    }
    // With no limit corners that are features stay, and others go.
    let options = Options { features: Features::Keep(0.7), ..Options::default() };
    let kept = run(&cube(8), &options, Budget::faces(4));
    assert_eq!((kept.mesh.faces.len(), kept.stop, kept.blocked.lock), (12, StopReason::Stuck, 8));
    assert!(run(&cube(8), &Options::default(), Budget::faces(4)).mesh.faces.len() < 12);
}

#[test]
fn nothing_goes_from_a_tetrahedron_or_a_triangle() {
    let outcome = run(&shapes::tetrahedron(), &Options::default(), Budget::faces(0));
    assert_eq!((outcome.mesh.faces.len(), outcome.stop), (4, StopReason::Stuck));
    assert_eq!((outcome.blocked.link, outcome.blocked.flip), (4, 0));
    let triangle = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    let outcome = run(&triangle, &Options::default(), Budget::faces(0));
    assert_eq!((outcome.mesh, outcome.stop), (triangle, StopReason::Stuck));
    assert_eq!(outcome.blocked.link, 3);
}

/// Two pyramids on one triangle: either tip may go, but not both.
#[test]
fn of_two_tips_on_a_triangle_one_stays() {
    let tips = mesh(
        &[[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]],
        &[[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]],
    );
    let options = Options { features: Features::Ignore, ..Options::default() };
    let outcome = run(&tips, &options, Budget::faces(0));
    assert_eq!((outcome.mesh.faces.len(), outcome.stop), (4, StopReason::Stuck));
    assert_removed("tips", &tips, &outcome);
}

/// A disk of twelve faces around a vertex: it goes, and the best fill of its rim is found by all that look at it.
#[test]
fn the_hub_of_a_fan_goes() {
    let rim = (0..12).map(|i| f64::from(i) * std::f64::consts::TAU / 12.0).map(|a| DVec3::new(a.cos(), a.sin(), 0.0));
    let faces = (0..12).map(|i| [12, i, (i + 1) % 12]).collect();
    let fan = Mesh::new(rim.chain([DVec3::new(0.0, 0.0, 0.1)]).collect(), faces);
    for fill in FILLS {
        let options = Options { lock_border: true, ..with(fill) };
        let outcome = run(&fan, &options, Budget::faces(0));
        assert_eq!((outcome.mesh.faces.len(), outcome.stop, outcome.blocked.lock), (10, StopReason::Stuck, 12));
        assert_eq!(outcome.mesh.positions, fan.positions[..12]);
        assert!((outcome.error_estimate - 0.1).abs() < 1e-6, "{fill:?}: {}", outcome.error_estimate);
    }
}

#[test]
fn no_face_turns_over() {
    let sphere = sphere(4);
    for fill in FILLS {
        let outcome = run(&sphere, &with(fill), Budget::faces(60));
        let is_out = |&face: &[u32; 3]| normal(&outcome.mesh, face).dot(outcome.mesh.positions[face[0] as usize]) > 0.0;
        assert!(outcome.mesh.faces.iter().all(is_out), "{fill:?}");
    }
}

/// The limit holds for every vertex of the input, and the estimate is what it says.
#[test]
fn no_vertex_of_the_input_is_farther_than_the_estimate() {
    for (name, mesh) in [("bumps", bumpy(sphere(4), 0.1)), ("sheet", bumpy(grid(30, 30), 0.3))] {
        for limit in [5e-3, 2e-2] {
            let outcome = run(&mesh, &Options::default(), Budget::error(limit));
            assert_eq!(outcome.stop, StopReason::ErrorReached, "{name} {limit}");
            assert!(outcome.blocked.error > 0 && outcome.mesh.faces.len() < mesh.faces.len(), "{name} {limit}");
            let distances = vertex_distances(&mesh, &outcome.mesh, &cpu(1)).expect("two meshes");
            let greatest = distances.into_iter().fold(0.0, f64::max);
            let (estimate, limit) = (outcome.error_estimate, limit * mesh.diagonal());
            assert!(greatest <= estimate * 1.000_01 && estimate <= limit, "{name}: {greatest} {estimate} {limit}");
            assert!(estimate > 0.8 * limit, "{name}: {estimate} of {limit}");
        }
    }
}

/// The middles of all edges, as the corners of triangles within the faces.
fn middles(mesh: &Mesh) -> Mesh {
    let middle = |a: u32, b: u32| (mesh.positions[a as usize] + mesh.positions[b as usize]) / 2.0;
    let positions = mesh.faces.iter().flat_map(|&[a, b, c]| [middle(a, b), middle(b, c), middle(c, a)]).collect();
    Mesh::new(positions, (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect())
}

/// Where a rim bends inward a vertex lies inside of what fills its hole: edges tell how far off that is.
#[test]
fn rims_that_bend_inward_keep_within_the_limit() {
    let mut plate = grid(48, 48);
    let center = (plate.positions[0] + plate.positions[plate.positions.len() - 1]) / 2.0;
    let radius = 0.3 * (plate.positions[0] - center).length();
    let positions = plate.positions.clone();
    let middle = |face: &[u32; 3]| face.iter().map(|&v| positions[v as usize]).sum::<DVec3>() / 3.0;
    plate.faces.retain(|face| (middle(face) - center).length() > radius);
    for limit in [1e-3, 1e-2] {
        let outcome = run(&plate, &Options::default(), Budget::error(limit));
        let (area, most) = (outcome.mesh.area() - plate.area(), limit * plate.diagonal());
        let distances = vertex_distances(&middles(&outcome.mesh), &plate, &cpu(1)).expect("two meshes");
        let greatest = distances.into_iter().fold(0.0, f64::max);
        assert!(greatest <= outcome.error_estimate * 1.000_01 && outcome.error_estimate <= most, "{limit}: {greatest}");
        assert!(area.abs() < 4.0 * radius * most, "{limit}: {area}");
        assert!(outcome.mesh.faces.len() < plate.faces.len() / 4, "{limit}: {}", outcome.mesh.faces.len());
    }
}

#[test]
fn untouched_faces_and_attributes_come_back() {
    let mut sheet = bumpy(grid(20, 10), 0.3);
    sheet.colors = Some(sheet.positions.iter().map(|p| [p.x as f32 / 20.0, 0.5, 0.25, 1.0]).collect());
    let outcome = run(&sheet, &Options::default(), Budget::faces(sheet.faces.len() - 2));
    let named = outcome.mesh.faces.iter().map(|face| face.map(|v| outcome.vertex_origin[v as usize]));
    let same = named.filter(|face| sheet.faces.contains(face)).count();
    assert!(same >= 390, "{same} of {} faces where they were", sheet.faces.len());
    let colors = outcome.mesh.colors.as_ref().expect("they are carried");
    let of_origin = outcome.vertex_origin.iter().map(|&v| sheet.colors.as_ref().expect("given")[v as usize]);
    assert!(colors.iter().copied().eq(of_origin));
    // Nothing to do gives the input back.
    assert_eq!(run(&sheet, &Options::default(), Budget::keep(1.0)).mesh, sheet);
}

#[test]
fn faces_wound_the_other_way_are_no_obstacle() {
    let mut mesh = sphere(3);
    mesh.faces[..200].iter_mut().for_each(|face| face.swap(0, 1));
    let outcome = run(&mesh, &Options::default(), Budget::faces(150));
    assert!(outcome.warnings.iter().any(|warning| warning.contains("wound against")), "{:?}", outcome.warnings);
    assert_eq!(outcome.stop, StopReason::FacesReached);
    assert_removed("wound", &mesh, &outcome);
    assert!(topology(&outcome.mesh).misoriented_edges > 0);
}

#[test]
fn a_wish_to_stop_is_heard_and_bad_options_are_told() {
    let mesh = sphere(4);
    let mut calls = 0;
    let mut stop = |_: Progress| {
        calls += 1;
        ControlFlow::Break(())
    };
    let method = Method::Removal(Options::default());
    let outcome = simplify(&mesh, &method, &Budget::faces(50), &cpu(1), Some(&mut stop)).expect("a result");
    assert_eq!((outcome.stop, calls, outcome.rounds.len()), (StopReason::Cancelled, 1, 1));
    for wrong in [
        Options { features: Features::Keep(4.0), ..Options::default() },
        Options { features: Features::Guide(f32::NAN), ..Options::default() },
        Options { max_flip_rad: 2.0, ..Options::default() },
        Options { weld: Some(-1.0), ..Options::default() },
    ] {
        let result = simplify(&mesh, &Method::Removal(wrong.clone()), &Budget::faces(50), &cpu(1), None);
        assert!(matches!(result, Err(Error::Parameter(_))), "{wrong:?}");
    }
}

#[test]
fn devices_and_threads_do_not_change_the_bytes() {
    let devices: Vec<Device> = [1, 2, 3, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default())).collect();
    let record = |outcome: &Outcome| {
        let rounds: Vec<_> = outcome.rounds.iter().map(|round| RoundRecord { on_gpu: false, ..*round }).collect();
        (bytes(&outcome.mesh), outcome.vertex_origin.clone(), rounds, outcome.error_estimate.to_bits())
    };
    for name in ["statue", "part", "terrain", "assembly"] {
        let mesh = sample(name, Some(20_000)).expect("a sample");
        let outcomes: Vec<Outcome> =
            devices.iter().map(|device| run_on(device, &mesh, &Options::default(), Budget::keep(0.1))).collect();
        for (outcome, device) in outcomes.iter().zip(&devices) {
            assert!(record(outcome) == record(&outcomes[0]), "{name}, {}", device.description());
            assert_eq!(outcome.rounds[0].on_gpu, device.is_gpu(), "{name}, {}", device.description());
        }
    }
}
