//! Vertex clustering: its invariants, known answers, an oracle by the definitions, budgets, and the same bytes everywhere.
#![expect(clippy::print_stdout, reason = "tests print what a reader of a failure needs")]

mod support;

use std::collections::BTreeSet;
use std::ops::ControlFlow;

use coarsen::backend::{Device, Exactness, GpuOptions};
use coarsen::cluster::{MOST_CELLS, Options, Representative};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::{SAMPLES, sample};
use coarsen::simplify::{MOVED, Progress};
use coarsen::{Budget, Error, Mesh, Method, Outcome, StopReason, formats, simplify};
use support::cells::{ALL, Cells, assert_clustered, meshes, moved, on_grid, run, soup, with};
use support::engine::{asked, bytes, cpu, gpu, open_gpu};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, sphere};
use support::{models, shapes as own};

/// What the number of faces follows of which nothing is left.
const VANISHED: &str = "faces of parts thinner than a cell, which are gone: ";

// Invariants

#[test]
fn vertices_lie_in_their_cells() {
    for (name, mesh) in meshes() {
        for cells in [6, 10, 77, MOST_CELLS] {
            // All have the same cells in the same order, and those at vertices tell which.
            let by_input = on_grid(&mesh, cells, Representative::Input);
            let grid = Cells::new(&mesh, &by_input);
            for representative in ALL {
                let name = format!("{name}, {cells} cells, {representative:?}");
                let outcome = on_grid(&mesh, cells, representative);
                assert_clustered(&name, &mesh, &outcome);
                assert_eq!((outcome.stop, &outcome.mesh.faces), (StopReason::GridReached, &by_input.mesh.faces));
                for (p, q) in outcome.mesh.positions.iter().zip(&by_input.mesh.positions) {
                    assert!(grid.hold(grid.of(*q), *p), "{name}: {p} is not in the cell of {q}");
                }
            }
        }
    }
}

/// The limit to how far a vertex moves says nothing of a part that lies in one cell.
#[test]
fn parts_that_vanish_are_told() {
    let mut mesh = sphere(4);
    let told = |mesh: &Mesh| {
        let outcome = run(&cpu(2), mesh, &Options::default(), Budget::error(0.05)).expect("a valid mesh");
        outcome.warnings.iter().find_map(|warning| warning.strip_prefix(VANISHED)?.parse().ok())
    };
    assert_eq!(told(&mesh), None::<usize>);
    let (first, small) = (mesh.positions.len() as u32, sphere(1));
    mesh.positions.extend(small.positions.iter().map(|&p| p * 0.01 + DVec3::new(2.1, 0.013, 0.017)));
    mesh.faces.extend(small.faces.iter().map(|face| face.map(|v| v + first)));
    assert_eq!(told(&mesh), Some(small.faces.len()));
}

#[test]
fn input_vertices_are_a_subset_of_the_input() {
    for (name, mesh) in meshes() {
        let outcome = on_grid(&mesh, 12, Representative::Input);
        assert!(outcome.vertex_origin.iter().all(|&origin| origin != MOVED), "{name}");
        assert!(outcome.mesh.positions.iter().all(|p| mesh.positions.contains(p)), "{name}");
    }
}

// An oracle

/// The faces of the result by the definition: cells in a map, then rules one by one; as cells of their corners.
fn faces_by_definition(mesh: &Mesh, cells: &Cells) -> BTreeSet<[[i64; 3]; 3]> {
    let rotated = |[a, b, c]: [[i64; 3]; 3]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three");
    let spanning: BTreeSet<[[i64; 3]; 3]> = mesh
        .faces
        .iter()
        .map(|face| face.map(|v| cells.of(mesh.positions[v as usize])))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .map(rotated)
        .collect();
    spanning.iter().copied().filter(|&[a, b, c]| !spanning.contains(&rotated([a, c, b]))).collect()
}

#[test]
fn faces_are_those_of_the_definition() {
    for (name, mesh) in meshes() {
        // The cell of a member names that of a vertex.
        for cells in [6, 19, 60] {
            let outcome = on_grid(&mesh, cells, Representative::Input);
            let grid = Cells::new(&mesh, &outcome);
            let of = |v: u32| grid.of(outcome.mesh.positions[v as usize]);
            let found: BTreeSet<[[i64; 3]; 3]> = outcome
                .mesh
                .faces
                .iter()
                .map(|face| face.map(of))
                .map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three"))
                .collect();
            assert!(found == faces_by_definition(&mesh, &grid), "{name}, {cells} cells");
            assert_eq!(found.len(), outcome.mesh.faces.len(), "{name}, {cells} cells");
        }
    }
}

/// The area-weighted sum of squared distances from `p` to the planes of the faces with a corner in the cell.
fn plane_error(mesh: &Mesh, cells: &Cells, cell: [i64; 3], p: DVec3) -> f64 {
    let corners = |face: &[u32; 3]| face.map(|v| mesh.positions[v as usize]);
    let touching = mesh.faces.iter().map(corners).filter(|points| points.iter().any(|&q| cells.of(q) == cell));
    touching
        .map(|[a, b, c]| {
            let n = (b - a).cross(c - a);
            if n.length() > 0.0 { n.dot(p - a).powi(2) / n.length() / 2.0 } else { 0.0 }
        })
        .sum()
}

#[test]
fn quadric_representatives_are_nearer_to_the_planes_than_others() {
    let mesh = bumpy(cube(12), 0.1);
    let [best, mean, input] = ALL.map(|representative| on_grid(&mesh, 5, representative));
    let cells = Cells::new(&mesh, &best);
    let (mut gained, mut all) = (0.0, 0.0);
    for (v, &p) in input.mesh.positions.iter().enumerate() {
        let cell = cells.of(p);
        let error = |outcome: &Outcome| plane_error(&mesh, &cells, cell, outcome.mesh.positions[v]);
        let (least, at_mean) = (error(&best), error(&mean));
        // What the planes leave open within a thousandth is left to the mean.
        assert!(least <= at_mean * (1.0 + 1e-5) + 1e-12, "{least:e} {at_mean:e}");
        (gained, all) = (gained + least, all + at_mean);
    }
    assert!(gained < 0.5 * all, "{gained:e} of {all:e}");
    // And the estimate is the root of the worst mean square.
    assert!(best.error_estimate < mean.error_estimate && best.error_estimate <= input.error_estimate);
    assert!(input.error_estimate <= 3_f64.sqrt() * cells.side);
}

#[test]
fn means_are_of_the_corners() {
    let mesh = bumpy(sphere(4), 0.1);
    let outcome = on_grid(&mesh, 4, Representative::Mean);
    let by_input = on_grid(&mesh, 4, Representative::Input);
    let cells = Cells::new(&mesh, &outcome);
    for (p, q) in outcome.mesh.positions.iter().zip(&by_input.mesh.positions) {
        let cell = cells.of(*q);
        let corners = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]);
        let inside: Vec<DVec3> = corners.filter(|&p| cells.of(p) == cell).collect();
        let mean = inside.iter().sum::<DVec3>() / inside.len() as f64;
        assert!(mean.distance(*p) < 1e-6, "{mean} {p}");
    }
}

// Known answers

#[test]
fn a_cube_stays_a_cube() {
    // Cells of 0.25, vertices at multiples of 1/6: each cell of a side has vertices of the side.
    let mesh = cube(6);
    let outcome = on_grid(&mesh, 4, Representative::Quadric);
    for corner in (0..8).map(|i| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))) {
        let nearest = outcome.mesh.positions.iter().map(|p| p.distance(corner)).fold(1.0, f64::min);
        assert!(nearest < 1e-6, "{corner} is {nearest} away");
    }
    assert!((own::volume(&outcome.mesh) - 1.0).abs() < 1e-6, "{}", own::volume(&outcome.mesh));
    assert_eq!(topology(&outcome.mesh).border_edges, 0);
    assert!(own::volume(&on_grid(&mesh, 4, Representative::Mean).mesh) < 0.9);
}

#[test]
fn a_flat_stays_flat_bit_for_bit() {
    let mesh = moved(&grid(40, 30), |p| p + DVec3::new(0.1, 0.2, 0.3));
    for representative in ALL {
        let outcome = on_grid(&mesh, 7, representative);
        assert!(outcome.mesh.positions.iter().all(|p| p.z.to_bits() == 0.3_f64.to_bits()), "{representative:?}");
        assert_eq!(outcome.error_estimate == 0.0, representative != Representative::Input);
    }
}

#[test]
fn the_finest_grid_returns_the_input() {
    let mut mesh = bumpy(sphere(4), 0.1);
    mesh.colors = Some(mesh.positions.iter().map(|p| [p.x.abs() as f32 * 0.5, 0.25, 0.5, 1.0]).collect());
    mesh.normals = Some(mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect());
    let outcome = on_grid(&mesh, MOST_CELLS, Representative::Quadric);
    assert_eq!(outcome.mesh, mesh);
    assert!(outcome.vertex_origin.iter().copied().eq(0..mesh.positions.len() as u32));
}

// 3 - - 2      The corners of a square lie in four cells, those of a second one beside them. Faces 0 and 1 stay.
// | \   |      The second square is the first once more but for one face turned: face 2 repeats face 0, face 3
// |   \ |      takes face 1 away with it.
// 0 - - 1
#[test]
fn repeated_faces_go_and_opposite_ones_with_each_other() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions: Vec<[f64; 3]> =
        [0.0, 0.1].into_iter().flat_map(|shift| corners.map(|[x, y]| [f64::abs(x - shift), y, 0.0])).collect();
    let square = [[0, 1, 3], [1, 2, 3]];
    let alone = on_grid(&own::mesh(&positions, &square), 2, Representative::Mean);
    assert_eq!(alone.mesh.faces, square);
    let both = own::mesh(&positions, &[square[0], square[1], [5, 7, 4], [5, 7, 6]]);
    let left = on_grid(&both, 2, Representative::Mean);
    assert_eq!(left.mesh.faces, [[0, 1, 2]]);
    assert_eq!(left.vertex_origin.len(), 3);
    assert!((left.mesh.positions[0] - DVec3::new(0.05, 0.0, 0.0)).length() < 1e-7, "{}", left.mesh.positions[0]);
}

#[test]
fn sides_that_fall_together_take_each_other_away() {
    let plate = moved(&sphere(4), |p| p * DVec3::new(1.0, 1.0, 1e-6));
    let result = run(&cpu(1), &plate, &Options { grid: Some(10), ..Options::default() }, Budget::default());
    assert!(matches!(result, Err(Error::Parameter(text)) if text.contains("leaves no face")));
    // A number of faces or an error limit takes a grid that leaves some.
    for budget in [Budget::faces(100), Budget::error(0.1)] {
        let outcome = run(&cpu(1), &plate, &Options::default(), budget).expect("a valid mesh");
        assert_clustered("plate", &plate, &outcome);
        assert!(outcome.cell_size < Some(1e-5), "{:?}", outcome.cell_size);
    }
}

#[test]
fn a_soup_gives_what_its_mesh_gives() {
    let mesh = bumpy(sphere(4), 0.1);
    for representative in ALL {
        let [whole, pieces] = [&mesh, &soup(&mesh)].map(|mesh| on_grid(mesh, 9, representative).mesh);
        assert_eq!((whole.positions.len(), whole.faces.len()), (pieces.positions.len(), pieces.faces.len()));
        // In another order, and rounded about other vertices.
        for p in &pieces.positions {
            let nearest = whole.positions.iter().map(|q| q.distance(*p)).fold(1.0, f64::min);
            assert!(nearest < 1e-5, "{representative:?}: {nearest}");
        }
        assert_eq!(topology(&pieces).euler, topology(&whole).euler);
    }
}

#[test]
fn attributes_are_means_and_unused_vertices_do_not_count() {
    let mut mesh = own::mesh(
        &[[9e9, 0.0, 0.0], [0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        &[[1, 3, 4], [2, 3, 4]],
    );
    mesh.colors = Some(vec![[1.0; 4], [0.0; 4], [1.0, 0.5, 0.0, 1.0], [0.25; 4], [0.75; 4]]);
    mesh.normals = Some(vec![Vec3::X, Vec3::Z, Vec3::Y, Vec3::Z, Vec3::Z]);
    mesh.texcoords = Some(vec![[Vec2::ZERO; 3]; 2]);
    mesh.face_colors = Some(vec![[0.5; 4]; 2]);
    let outcome = on_grid(&mesh, 2, Representative::Mean);
    assert_eq!(outcome.mesh.faces, [[0, 1, 2]]);
    assert_eq!(outcome.mesh.colors, Some(vec![[0.5, 0.25, 0.0, 0.5], [0.25; 4], [0.75; 4]]));
    let normals = outcome.mesh.normals.expect("normals");
    assert!(normals[0].abs_diff_eq(Vec3::new(0.0, 0.5_f32.sqrt(), 0.5_f32.sqrt()), 1e-6));
    assert_eq!(outcome.vertex_origin, [MOVED, 3, 4]);
    assert!(outcome.mesh.texcoords.is_none() && outcome.mesh.face_colors.is_none());
    for what in ["texture coordinates", "face colors"] {
        let told = format!("{what} are dropped");
        assert!(outcome.warnings.iter().any(|warning| warning.starts_with(&told)), "{what}");
    }
}

// Budgets

#[test]
fn a_number_of_faces_is_met_from_below() {
    for (name, mesh) in meshes() {
        let name = &name;
        for (share, representative) in [(0.5, ALL[0]), (0.1, ALL[1]), (0.02, ALL[2])] {
            let outcome = run(&cpu(1), &mesh, &with(representative), Budget::keep(share)).expect("a valid mesh");
            let (faces, target) = (outcome.mesh.faces.len(), outcome.target);
            println!("{name} {share}: {faces} of {target}, {:?}", outcome.stop);
            assert_clustered(name, &mesh, &outcome);
            assert_eq!(outcome.stop, StopReason::FacesReached, "{name}: {faces} of {target}");
            // Every other grid of a lattice of equal steps jumps, and along the walls of a room all at once.
            let least = if ["room", "office"].contains(&name.as_str()) { 5 } else { 7 };
            assert!(faces <= target && faces * 10 >= target * least, "{name}: {faces} of {target}");
        }
    }
}

#[test]
fn an_error_limit_bounds_how_far_vertices_move() {
    for (name, mesh) in meshes() {
        for (budget, limit) in [(Budget::error(0.05), 0.05 * mesh.diagonal()), (Budget::error_abs(0.1), 0.1)] {
            let result = run(&cpu(1), &mesh, &with(Representative::Quadric), budget);
            let outcome = match result {
                Ok(outcome) => outcome,
                // A tenth of a unit is nothing to a huge mesh.
                Err(Error::Parameter(text)) => {
                    assert!(name == "huge" && text.contains("is below"), "{name}: {text}");
                    continue;
                }
                Err(other) => panic!("{name}: {other}"),
            };
            assert_clustered(&name, &mesh, &outcome);
            let diagonal = outcome.cell_size.expect("a cell") * 3_f64.sqrt();
            assert!(diagonal <= limit * (1.0 + 1e-9), "{name}: {diagonal} above {limit}");
            assert!(outcome.error_estimate <= diagonal, "{name}");
            if outcome.stop == StopReason::ErrorReached {
                assert!(diagonal >= 0.999 * limit, "{name}: {diagonal} well below {limit}");
            } else {
                assert_eq!(outcome.stop, StopReason::Stuck, "{name}");
            }
        }
    }
}

#[test]
fn the_first_limit_reached_ends_the_run() {
    let (ball, device) = (bumpy(sphere(5), 0.1), cpu(1));
    let run = |budget| run(&device, &ball, &Options::default(), budget).expect("a valid mesh");
    let by_faces = run(Budget { error: Some(0.2), ..Budget::faces(2000) });
    assert_eq!((by_faces.stop, by_faces.target), (StopReason::FacesReached, 2000));
    let by_error = run(Budget { error: Some(0.02), ..Budget::faces(100) });
    assert_eq!(by_error.stop, StopReason::ErrorReached);
    assert_eq!(by_error.mesh, run(Budget::error(0.02)).mesh);
    assert!(by_error.mesh.faces.len() > 100);
}

#[test]
fn a_face_is_always_left() {
    for (name, mesh) in [("sphere", sphere(4)), ("part", sample("part", Some(3000)).expect("a sample"))] {
        for budget in [Budget::faces(0), Budget::keep(0.0), Budget::error(1.0), Budget::error(0.9)] {
            let outcome = run(&cpu(1), &mesh, &Options::default(), budget).expect("a valid mesh");
            assert_clustered(name, &mesh, &outcome);
            assert_eq!(outcome.stop, StopReason::Stuck, "{name}");
            assert!(outcome.mesh.faces.len() < 100, "{name}: {}", outcome.mesh.faces.len());
        }
    }
    let all = run(&cpu(1), &sphere(4), &Options::default(), Budget::keep(1.0)).expect("a valid mesh");
    assert_eq!((all.stop, all.mesh), (StopReason::FacesReached, sphere(4)));
}

#[test]
fn what_makes_no_sense_is_refused() {
    let (ball, device) = (sphere(2), cpu(1));
    let refusal = |mesh: &Mesh, options: &Options, budget| match run(&device, mesh, options, budget) {
        Err(error) => error.to_string(),
        Ok(outcome) => panic!("{} faces", outcome.mesh.faces.len()),
    };
    let grid = |cells| Options { grid: Some(cells), ..Options::default() };
    assert!(refusal(&ball, &grid(0), Budget::default()).contains("not 1 … 2097152"));
    assert!(refusal(&ball, &grid(MOST_CELLS + 1), Budget::default()).contains("2097153 cells"));
    assert!(refusal(&ball, &grid(10), Budget::faces(10)).contains("contradict"));
    assert!(refusal(&ball, &grid(1), Budget::default()).contains("leaves no face: give a finer one"));
    assert!(refusal(&ball, &Options::default(), Budget::default()).contains("no target"));
    assert!(refusal(&ball, &Options::default(), Budget::error(1e-9)).contains("the diagonal of the smallest cells"));
    assert!(refusal(&ball, &Options::default(), Budget::error(0.0)).contains("the diagonal of the smallest cells"));
    assert!(
        refusal(&ball, &Options::default(), Budget::error(f64::NAN)).contains("the error limit is NaN of the diagonal")
    );
    assert!(refusal(&Mesh::default(), &grid(10), Budget::default()).contains("no faces"));
    let point = own::mesh(&[[1.0; 3]; 3], &[[0, 1, 2]]);
    assert!(refusal(&point, &grid(10), Budget::default()).contains("degenerate"));
    let line = own::mesh(&[[0.0; 3], [1.0; 3]], &[[0, 1, 0], [1, 1, 0]]);
    assert!(refusal(&line, &Options::default(), Budget::faces(1)).contains("degenerate"));
    assert!(refusal(&line, &Options::default(), Budget::error(0.1)).contains("degenerate"));
    let mut poisoned = ball.clone();
    poisoned.positions[7].y = f64::NAN;
    assert!(refusal(&poisoned, &grid(10), Budget::default()).contains("vertex 7"));
}

#[test]
fn a_wish_to_stop_is_heard() {
    let ball = bumpy(sphere(5), 0.1);
    for wanted in 1..=2 {
        let mut seen = 0;
        let mut stop = |progress: Progress| {
            assert_eq!((progress.faces_in, progress.target), (ball.faces.len(), 500));
            seen += 1;
            if seen == wanted { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let method = Method::Cluster(Options::default());
        let outcome = simplify(&ball, &method, &Budget::faces(500), &cpu(1), Some(&mut stop)).expect("a valid mesh");
        assert_eq!((outcome.stop, seen), (StopReason::Cancelled, wanted));
        assert_eq!((outcome.mesh, outcome.cell_size), (ball.clone(), None));
    }
}

// Devices

/// Results of all representatives by grid and by faces: bytes, origins, estimates.
fn results(device: &Device, mesh: &Mesh) -> Vec<(Vec<u8>, Vec<u32>, u64)> {
    let budgets = [(Some(25), Budget::default()), (None, Budget::keep(0.1)), (None, Budget::error(0.01))];
    let jobs = ALL.into_iter().flat_map(|representative| budgets.map(|budget| (representative, budget)));
    jobs.map(|(representative, (grid, budget))| {
        let outcome =
            run(device, mesh, &Options { grid, representative, ..Options::default() }, budget).expect("a valid mesh");
        let expected =
            mesh.face_colors.is_some().then_some("face colors are dropped: only those of vertices are carried");
        let told = outcome.warnings.iter().filter(|warning| !warning.starts_with(VANISHED));
        assert_eq!(Vec::from_iter(told), Vec::from_iter(expected));
        assert_eq!(outcome.device, device.description());
        (bytes(&outcome.mesh), outcome.vertex_origin, outcome.error_estimate.to_bits())
    })
    .collect()
}

#[test]
fn every_device_gives_the_same_bytes() {
    let options = [
        GpuOptions::default(),
        GpuOptions { page_rows: Some(1 << 15), ..GpuOptions::default() },
        GpuOptions { exactness: Some(Exactness::Guarded), ..GpuOptions::default() },
    ];
    let devices: Vec<Device> = [2, 3, 5].map(cpu).into_iter().chain(options.iter().filter_map(gpu)).collect();
    let meshes = SAMPLES.iter().map(|&(name, ..)| (name, sample(name, Some(40_000)).expect("a sample")));
    for (name, mesh) in meshes.chain([("soup", soup(&sphere(6)))]) {
        let reference = results(&cpu(1), &mesh);
        assert!(reference[0] != reference[1], "{name}: not a test of what it should be");
        for device in &devices {
            assert!(results(device, &mesh) == reference, "{name}, {}", device.description());
        }
    }
    assert!(devices.iter().all(|device| device.gpu_bytes() == 0), "buffers outlive the runs");
}

#[test]
fn a_gpu_that_fails_leaves_the_same_bytes() {
    let Some(lost) = gpu(&GpuOptions::default()) else { return };
    lost.lose_gpu();
    let mesh = sample("part", Some(150_000)).expect("a sample");
    let (method, budget) = (Method::Cluster(with(Representative::Input)), Budget::keep(0.1));
    let reference = simplify(&mesh, &method, &budget, &cpu(1), None).expect("a valid mesh");
    let (mut failed, mut complete) = (0, 0);
    let limited = [1_400_000, 2_500_000, 3_500_000, 4_500_000, 1 << 30].into_iter().filter_map(|limit| {
        let options = GpuOptions { memory_limit: Some(limit), ..GpuOptions::default() };
        open_gpu(&options).ok()
    });
    for device in [lost].into_iter().chain(limited) {
        let outcome = simplify(&mesh, &method, &budget, &device, None).expect("the CPU goes on");
        match outcome.warnings.as_slice() {
            [] => complete += 1,
            [warning] => {
                assert!(warning.starts_with("the CPU went on where the GPU failed: "), "{warning}");
                assert_eq!(outcome.device, device.cpu_description());
                failed += 1;
            }
            more => panic!("{more:?}"),
        }
        assert!(bytes(&outcome.mesh) == bytes(&reference.mesh) && outcome.vertex_origin == reference.vertex_origin);
        assert_eq!(device.gpu_bytes(), 0, "buffers outlive the run");
    }
    println!("{failed} failed, {complete} complete");
    assert!(failed >= 3 && complete >= 1);
}

// Real meshes

#[test]
fn real_meshes_are_accepted_whatever_is_wrong_with_them() {
    let (device, mut clustered) = (cpu(2), 0);
    for path in models::all() {
        let Ok(mesh) = formats::read(&path) else { continue };
        if mesh.faces.len() > 300_000 && !asked("COARSEN_LONG") {
            continue;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if mesh.check().is_err() {
            assert!(
                matches!(run(&device, &mesh, &Options::default(), Budget::keep(0.5)), Err(Error::Mesh(_))),
                "{name}"
            );
            continue;
        }
        let representative = ALL[clustered % 3];
        let outcome = run(&device, &mesh, &with(representative), Budget::keep(0.1))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_clustered(&name, &mesh, &outcome);
        let [before, after] = [&mesh, &outcome.mesh].map(|mesh| mesh.faces.len());
        assert!(outcome.stop == StopReason::Stuck || after <= outcome.target, "{name}: {after} of {before}");
        clustered += 1;
    }
    println!("{clustered} real meshes");
    assert!(clustered > 20 || models::all().is_empty());
}
