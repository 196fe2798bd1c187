//! When a run ends, what it says of it, and which budgets and options it refuses.

mod support;

use std::ops::ControlFlow;

use coarsen::contract::{AttributeWeights, Attributes, Lock, Metric, Options, Weighting};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::{Channel, ChannelKind, shapes};
use coarsen::simplify::Progress;
use coarsen::{Budget, Error, Mesh, Method, StopReason, cluster, formats, partition, removal, simplify};
use support::engine::{METRICS, assert_kept, assert_rounds_add_up, contract, cpu, options};
use support::independent::topology;
use support::models;
use support::shapes::{bumpy, grid, sphere};

fn try_contract(mesh: &Mesh, options: Options, budget: Budget) -> coarsen::Result<coarsen::Outcome> {
    simplify(mesh, &Method::Contract(options), &budget, &cpu(1), None)
}

#[test]
fn a_closed_mesh_ends_at_the_even_count_or_one_below() {
    let ball = bumpy(sphere(3), 0.1);
    for metric in METRICS {
        for target in (4..512).step_by(7).chain([511, 512]) {
            let outcome = contract(&ball, &options(metric), Budget::faces(target));
            assert_eq!(outcome.mesh.faces.len(), target / 2 * 2, "{metric:?}: asked for {target}");
            assert_eq!((outcome.stop, outcome.target), (StopReason::FacesReached, target), "{metric:?}");
            assert_kept("ball", &ball, &outcome);
        }
    }
}

#[test]
fn an_open_mesh_ends_at_any_count_exactly() {
    let sheet = bumpy(grid(5, 4), 0.1);
    for metric in METRICS {
        for target in 1..=40 {
            let outcome = contract(&sheet, &options(metric), Budget::faces(target));
            assert_eq!(outcome.mesh.faces.len(), target, "{metric:?}: {:?} {:?}", outcome.stop, outcome.blocked);
            assert_eq!(topology(&outcome.mesh).border_loops, 1, "{metric:?} → {target}");
        }
    }
}

/// A flat ground, whose last two faces no pair inside can remove, under closed spheres: of the ground alone one face can go, half of it.
#[test]
fn an_odd_count_is_undercut_where_its_last_face_would_cost_far_more_than_all_others() {
    let mut scene = grid(20, 20);
    for place in [[5.0, 5.0], [15.0, 5.0], [5.0, 15.0], [15.0, 15.0]] {
        let (ball, first) = (sphere(3), scene.positions.len() as u32);
        scene.positions.extend(ball.positions.iter().map(|p| *p + DVec3::new(place[0], place[1], 3.0)));
        scene.faces.extend(ball.faces.iter().map(|face| face.map(|v| v + first)));
    }
    for metric in METRICS {
        let [even, odd] = [300, 301].map(|faces| contract(&scene, &options(metric), Budget::faces(faces)).mesh);
        assert_eq!((even.faces.len(), odd.faces.len()), (300, 300), "{metric:?}");
        let share = odd.area() / even.area();
        assert!((share - 1.0).abs() < 0.01, "{metric:?}: {share} of the area");
        assert_eq!(topology(&odd).border_loops, 1, "{metric:?}");
    }
}

/// On a flat all pairs inside cost rounding, and all at a border that is not straight far more: no reason to miss a number.
#[test]
fn odd_counts_are_met_on_a_flat_with_a_jagged_border() {
    let mut sheet = grid(20, 20);
    for (i, p) in sheet.positions.iter_mut().enumerate() {
        let is_on_border = [p.x, p.y].into_iter().any(|x| x == 0.0 || x == 20.0);
        *p += DVec3::new((i * 7 % 5) as f64, (i * 11 % 5) as f64, 0.0) * if is_on_border { 0.1 } else { 0.0 };
    }
    for faces in [401, 201, 101] {
        let outcome = contract(&sheet, &options(Metric::Volume), Budget::faces(faces));
        assert_eq!(outcome.mesh.faces.len(), faces);
    }
}

#[test]
fn a_budget_of_nothing_ends_stuck_and_one_of_everything_at_once() {
    let ball = bumpy(sphere(2), 0.1);
    for metric in METRICS {
        let outcome = contract(&ball, &options(metric), Budget::faces(0));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 4), "{metric:?}");
        for budget in [Budget::faces(128), Budget::faces(usize::MAX), Budget::keep(1.0), Budget::reduction(0.0)] {
            let outcome = contract(&ball, &options(metric), budget);
            assert_eq!((outcome.stop, &outcome.mesh), (StopReason::FacesReached, &ball), "{metric:?} {budget:?}");
            assert!(outcome.rounds.is_empty() && outcome.error_estimate == 0.0, "{metric:?} {budget:?}");
        }
    }
}

#[test]
fn fractions_and_counts_agree() {
    let ball = bumpy(sphere(3), 0.1);
    for metric in METRICS {
        let faces = contract(&ball, &options(metric), Budget::faces(128)).mesh;
        let both = Budget { keep: Some(0.1), ..Budget::faces(128) };
        for budget in [Budget::keep(0.25), Budget::reduction(0.75), both] {
            assert_eq!(contract(&ball, &options(metric), budget).mesh, faces, "{metric:?} {budget:?}");
        }
    }
    // Of little the part is a face, and of nothing none.
    let target = |keep: f64, faces_in: usize| Budget::keep(keep).target_faces(faces_in).expect("a target");
    assert_eq!([target(0.1, 1), target(0.1, 14), target(0.1, 15), target(0.0, 14)], [1, 1, 2, 0]);
}

#[test]
fn an_error_limit_is_kept_and_a_larger_one_goes_farther() {
    let ball = bumpy(sphere(4), 0.1);
    let diagonal = ball.diagonal();
    for metric in METRICS {
        let mut faces = ball.faces.len();
        for limit in [1e-3, 3e-3, 1e-2, 1e-1] {
            let outcome = contract(&ball, &options(metric), Budget::error(limit));
            assert_kept("ball", &ball, &outcome);
            let name = format!("{metric:?} {limit}: {} faces", outcome.mesh.faces.len());
            assert!(outcome.error_estimate <= limit * diagonal * (1.0 + 1e-6), "{name}: {}", outcome.error_estimate);
            assert!(outcome.mesh.faces.len() < faces || faces == 4, "{name}, {faces} with a tighter limit");
            if outcome.mesh.faces.len() > 4 {
                assert_eq!(outcome.stop, StopReason::ErrorReached, "{name}");
                assert!(outcome.blocked.error > 0, "{name}");
            }
            faces = outcome.mesh.faces.len();
            let absolute = contract(&ball, &options(metric), Budget::error_abs(limit * diagonal));
            assert_eq!(absolute.mesh, outcome.mesh, "{name}");
        }
    }
}

/// The estimate must be of use: within a small factor of the true distance of the vertices to the smooth surface.
#[test]
fn the_error_estimate_is_of_the_deviation_s_size() {
    let ball = shapes::icosphere(4);
    for metric in METRICS {
        let outcome = contract(&ball, &options(metric), Budget::faces(200));
        let off = outcome.mesh.positions.iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max);
        let ratio = outcome.error_estimate / off;
        assert!((0.25..4.0).contains(&ratio), "{metric:?}: estimated {}, off by {off}", outcome.error_estimate);
    }
}

#[test]
fn the_first_limit_reached_ends_the_run() {
    let ball = bumpy(sphere(3), 0.1);
    for metric in METRICS {
        let loose = Budget { error: Some(1.0), ..Budget::faces(100) };
        let outcome = contract(&ball, &options(metric), loose);
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 100), "{metric:?}");
        let tight = Budget { error: Some(1e-3), ..Budget::faces(4) };
        let outcome = contract(&ball, &options(metric), tight);
        assert_eq!(outcome.stop, StopReason::ErrorReached, "{metric:?}");
    }
}

#[test]
fn budgets_out_of_range_are_refused() {
    let ball = sphere(1);
    let bad = [
        Budget::default(),
        Budget::keep(f64::NAN),
        Budget::keep(-0.1),
        Budget::keep(1.1),
        Budget::reduction(2.0),
        Budget::reduction(f64::INFINITY),
        Budget::error(f64::NAN),
        Budget::error(-1e-9),
        Budget::error(f64::NEG_INFINITY),
        Budget::error_abs(f64::NAN),
        Budget::error_abs(-1.0),
        Budget { error_abs: Some(f64::NAN), ..Budget::faces(8) },
        Budget { keep: Some(f64::NAN), ..Budget::faces(8) },
    ];
    for budget in bad {
        let result = try_contract(&ball, Options::default(), budget);
        assert!(matches!(result, Err(Error::Parameter(_))), "{budget:?}: {result:?}");
    }
}

/// By every method, with what was given, and before it looks at the mesh.
#[test]
fn limits_out_of_range_are_told_as_they_were_given() {
    let methods = [
        Method::default(),
        Method::Cluster(cluster::Options::default()),
        Method::Removal(removal::Options::default()),
        Method::Partition(partition::Options::coplanar(partition::Flatness::default())),
    ];
    for (budget, told) in [
        (Budget::error(-0.5), "the error limit is -0.5 of the diagonal: give 0 or more"),
        (Budget::error_abs(-2.0), "the error limit is -2 in model units: give 0 or more"),
        (
            Budget { error: Some(f64::NAN), ..Budget::faces(9) },
            "the error limit is NaN of the diagonal: give 0 or more",
        ),
        (Budget::keep(1.5), "the fraction to keep is 1.5, not in 0 … 1"),
    ] {
        for method in &methods {
            match simplify(&Mesh::default(), method, &budget, &cpu(1), None) {
                Err(Error::Parameter(message)) => assert_eq!(message, told, "{method:?}"),
                other => panic!("{method:?}, {budget:?}: {other:?}"),
            }
        }
    }
    assert_eq!(Budget::error(0.5).max_deviation(4.0).ok(), Some(2.0));
}

#[test]
fn options_out_of_range_are_refused() {
    let fine = Options::default();
    let bad = [
        Options { border_weight: -1.0, ..fine.clone() },
        Options { border_weight: f32::NAN, ..fine.clone() },
        Options { border_weight: f32::INFINITY, ..fine.clone() },
        Options { max_flip_rad: 0.0, ..fine.clone() },
        Options { max_flip_rad: f32::NAN, ..fine.clone() },
        Options { max_flip_rad: 2.0, ..fine.clone() },
        Options { weld: Some(f64::NAN), ..fine.clone() },
        Options { weld: Some(-1.0), ..fine.clone() },
        Options { prune: Some(f64::NAN), ..fine.clone() },
        Options { prune: Some(1.5), ..fine.clone() },
        Options { close_holes: Some(-0.1), ..fine.clone() },
        Options { close_holes: Some(0.1), log: true, ..fine },
    ];
    for options in bad {
        let result = try_contract(&sphere(1), options.clone(), Budget::faces(8));
        assert!(matches!(result, Err(Error::Parameter(_))), "{options:?}: {result:?}");
    }
}

#[test]
fn meshes_that_are_none_are_refused() {
    let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let with = |v: usize, p: DVec3| {
        let mut mesh = Mesh::new(triangle.to_vec(), vec![[0, 1, 2]]);
        mesh.positions[v] = p;
        mesh
    };
    let bad = [
        Mesh::default(),
        Mesh::new(triangle.to_vec(), vec![]),
        Mesh::new(triangle.to_vec(), vec![[0, 1, 3]]),
        Mesh::new(triangle.to_vec(), vec![[0, 1, 1], [2, 2, 2]]),
        with(1, DVec3::new(f64::NAN, 0.0, 0.0)),
        with(2, DVec3::new(0.0, f64::INFINITY, 0.0)),
        with(0, DVec3::new(0.0, 0.0, f64::NEG_INFINITY)),
        Mesh { colors: Some(vec![[0.0; 4]; 2]), ..with(0, DVec3::ZERO) },
        Mesh { normals: Some(vec![]), ..with(0, DVec3::ZERO) },
        Mesh { texcoords: Some(vec![[Vec2::ZERO; 3]; 2]), ..with(0, DVec3::ZERO) },
        Mesh { face_colors: Some(vec![[0.0; 4]; 2]), ..with(0, DVec3::ZERO) },
        Mesh { texcoords: Some(vec![[Vec2::ZERO, Vec2::NAN, Vec2::ZERO]]), ..with(0, DVec3::ZERO) },
        Mesh { normals: Some(vec![Vec3::Z, Vec3::Z, Vec3::INFINITY]), ..with(0, DVec3::ZERO) },
        Mesh { colors: Some(vec![[0.0; 4], [0.5, 0.5, f32::NAN, 1.0], [1.0; 4]]), ..with(0, DVec3::ZERO) },
        Mesh { face_colors: Some(vec![[0.0, 0.0, 0.0, f32::NEG_INFINITY]]), ..with(0, DVec3::ZERO) },
    ];
    for mesh in bad {
        let result = try_contract(&mesh, Options::default(), Budget::faces(1));
        assert!(matches!(result, Err(Error::Mesh(_))), "{mesh:?}: {result:?}");
    }
}

/// Whatever an option reads of it.
#[test]
fn a_mesh_is_checked_before_options_read_it() {
    let mut mesh = sphere(1);
    let count = mesh.positions.len();
    mesh.channels = vec![Channel { name: "pin".into(), kind: ChannelKind::Linear, width: 2, values: vec![0.5; 3] }];
    let weights = AttributeWeights { channels: [("pin".to_owned(), 1.0)].into(), ..AttributeWeights::default() };
    for options in [
        Options { lock: Some(Lock::Channel("pin".into())), ..Options::default() },
        Options { lock: Some(Lock::Vertices([0].into())), ..Options::default() },
        Options { locked: Some(vec![true; count].into()), ..Options::default() },
        Options { weighting: Weighting::Given(vec![1.0; count].into()), ..Options::default() },
        Options { attributes: Attributes { weights, ..Attributes::default() }, ..Options::default() },
        Options { close_holes: Some(0.1), prune: Some(0.1), ..Options::default() },
        Options { metric: Metric::Plane, ..Options::feature_weighted() },
    ] {
        let result = try_contract(&mesh, options.clone(), Budget::faces(8));
        assert!(matches!(result, Err(Error::Mesh(_))), "{options:?}: {result:?}");
    }
}

#[test]
fn a_run_can_be_cancelled_and_leaves_a_valid_mesh() {
    let ball = bumpy(sphere(4), 0.1);
    for metric in METRICS {
        for rounds in 1..4 {
            let mut calls = Vec::new();
            let mut stop_later = |progress: Progress| {
                calls.push(progress);
                if calls.len() == rounds { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let method = Method::Contract(options(metric));
            let outcome = simplify(&ball, &method, &Budget::faces(20), &cpu(1), Some(&mut stop_later)).expect("valid");
            assert_eq!((outcome.stop, outcome.rounds.len()), (StopReason::Cancelled, rounds), "{metric:?}");
            assert_kept("ball", &ball, &outcome);
            let left: Vec<usize> = calls.iter().map(|progress| progress.faces).collect();
            assert!(left.is_sorted_by(|a, b| a > b) && left[0] < ball.faces.len(), "{metric:?}: {left:?}");
            assert_eq!(left.last(), Some(&outcome.mesh.faces.len()), "{metric:?}");
            assert!(calls.iter().all(|progress| (progress.faces_in, progress.target) == (2048, 20)), "{metric:?}");
        }
    }
}

#[test]
fn the_records_of_the_rounds_add_up() {
    let meshes = [("ball", bumpy(sphere(4), 0.1)), ("sheet", bumpy(grid(40, 30), 0.2))];
    for (name, mesh) in &meshes {
        for metric in METRICS {
            let outcome = contract(mesh, &options(metric), Budget::keep(0.05));
            assert_rounds_add_up(name, &outcome);
            assert_eq!(outcome.rounds[0].faces, mesh.faces.len() as u64, "{name} {metric:?}");
            // V − E + F = 1 on the sheet and 2 on the ball.
            let edges = mesh.positions.len() + mesh.faces.len() - topology(mesh).euler as usize;
            assert_eq!(outcome.rounds[0].pairs, edges as u64, "{name} {metric:?}: every edge is a pair");
            let contracted: u64 = outcome.rounds.iter().map(|round| round.contracted).sum();
            let vertices_lost = mesh.positions.len() - outcome.mesh.positions.len();
            assert_eq!(contracted, vertices_lost as u64, "{name} {metric:?}: a contraction takes one vertex");
            assert!(outcome.rounds.iter().all(|round| !round.on_gpu && round.greatest_cost.is_finite()), "{name}");
            assert!(outcome.seconds.total > 0.0 && outcome.device == "CPU, 1 thread", "{name}: {}", outcome.device);
        }
    }
}

/// The counts of the survey's table; the cow is closed, but one of its vertices joins two fans.
#[test]
fn the_cow_reaches_its_papers_counts() {
    let Some(path) = models::model("papers/cow.obj") else { return };
    let cow = formats::read(&path).expect("a readable model");
    assert_eq!(cow.faces.len(), 5804);
    for metric in METRICS {
        for faces in [2636, 366, 326] {
            let outcome = contract(&cow, &options(metric), Budget::faces(faces));
            assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, faces), "{metric:?}");
        }
    }
}
