//! What the engine makes of small samples, as recorded in `golden/engine.txt`: a change there is to be seen and meant.
//!
//! `BLESS=1` writes the file anew.

mod support;

use std::path::Path;

use coarsen::cluster::{self, Representative};
use coarsen::contract::{Options, Placement};
use coarsen::mesh::{SAMPLES, sample};
use coarsen::partition::vsa::{Goal, Solver};
use coarsen::partition::{self, By, Flatness, Superfaces, Variational};
use coarsen::removal::{self, Fill};
use coarsen::{Budget, Mesh, Method, Outcome, simplify, simplify_levels};
use support::deviation::deviation;
use support::engine::{METRICS, asked, bytes, cpu, fnv};

const RECORD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/engine.txt");
const FACES: usize = 6000;
const SHARES: [f64; 3] = [0.5, 0.1, 0.04];

/// One line a run: what it was, vertices, faces, rounds, the symmetric root mean square deviation in diagonals, and the
/// hash of the binary PLY file.
fn record() -> String {
    let mut lines =
        String::from("sample   metric placement share  vertices faces rounds  deviation              hash\n");
    let mut run = |name: &str, [metric, placement]: [&str; 2], mesh: &Mesh, method: Method, share: f64| {
        let outcome = simplify(mesh, &method, &Budget::keep(share), &cpu(1), None).expect("a valid mesh");
        lines += &row(&format!("{name:8} {metric:6} {placement:9} {share:<5}"), mesh, &outcome);
    };
    for &(name, ..) in SAMPLES {
        let mesh = sample(name, Some(FACES)).expect("a sample");
        for metric in METRICS {
            let optimal = SHARES.map(|share| (Placement::Optimal, share));
            for (placement, share) in optimal.into_iter().chain([(Placement::Endpoint, 0.1)]) {
                let method = Method::Contract(Options { metric, placement, ..Options::default() });
                run(name, [&format!("{metric:?}"), &format!("{placement:?}")], &mesh, method, share);
            }
        }
        run(name, ["Plane", "Feature"], &mesh, Method::Contract(Options::feature_weighted()), 0.1);
        run(name, ["Plane", "Average"], &mesh, Method::Contract(Options::averaged()), 0.1);
        for representative in [Representative::Quadric, Representative::Mean, Representative::Input] {
            let method = Method::Cluster(cluster::Options { representative, ..cluster::Options::default() });
            run(name, ["cells", &format!("{representative:?}")], &mesh, method, 0.1);
        }
        for fill in [Fill::Fan, Fill::Ears, Fill::Dynamic, Fill::Exhaustive] {
            let method = Method::Removal(removal::Options { fill, ..removal::Options::default() });
            run(name, ["holes", &format!("{fill:?}")], &mesh, method, 0.1);
        }
    }
    for &(name, ..) in SAMPLES {
        let mesh = sample(name, Some(FACES)).expect("a sample");
        for (by, method) in partitions(&mesh) {
            let outcome = simplify(&mesh, &method, &Budget::default(), &cpu(1), None).expect("a valid mesh");
            lines += &row(&format!("{name:8} Region {by:9} -    "), &mesh, &outcome);
        }
    }
    for &(name, ..) in SAMPLES {
        let mesh = sample(name, Some(FACES)).expect("a sample");
        let budgets = SHARES.map(Budget::keep);
        let levels = simplify_levels(&mesh, &Method::default(), &budgets, &cpu(1), None).expect("a valid mesh");
        for (level, share) in levels.iter().zip(SHARES) {
            lines += &row(&format!("{name:8} Volume Levels    {share:<5}"), &mesh, level);
        }
    }
    lines
}

/// Every way to make regions that a mesh has what it takes for.
fn partitions(mesh: &Mesh) -> Vec<(&'static str, Method)> {
    let solved_by = |solver| {
        let mut variational = Variational::new(Goal::Regions(60));
        variational.regions.solver = solver;
        partition::Options { by: By::Variational(variational), ..partition::Options::variational(Goal::Regions(60)) }
    };
    let bent = Flatness { angle_rad: 0.3, distance: 0.003 };
    let superfaces = mesh.face_colors.is_some() || mesh.colors.is_some();
    let mut all = vec![
        ("Coplanar", partition::Options::coplanar(Flatness::default())),
        ("Bent", partition::Options::coplanar(bent)),
        ("Greedy", solved_by(Solver::Greedy)),
        ("Rounds", solved_by(Solver::Rounds)),
        ("Lloyd", solved_by(Solver::Lloyd)),
    ];
    all.extend(superfaces.then(|| ("Superface", partition::Options::superfaces(Superfaces::default()))));
    all.into_iter().map(|(by, options)| (by, Method::Partition(options))).collect()
}

fn row(what: &str, mesh: &Mesh, outcome: &Outcome) -> String {
    let rms = deviation(mesh, &outcome.mesh, 20_000).rms;
    let hash = fnv(&bytes(&outcome.mesh));
    let (vertices, faces) = (outcome.mesh.positions.len(), outcome.mesh.faces.len());
    format!("{what} {vertices:9} {faces:5} {:6} {rms:10.2e}  {hash:016x}\n", outcome.rounds.len())
}

#[test]
fn results_are_as_recorded() {
    let found = record();
    if asked("BLESS") {
        std::fs::write(RECORD, &found).expect("the record can be written");
        return;
    }
    let recorded = std::fs::read_to_string(Path::new(RECORD)).expect("the record is in the repository");
    let changed: Vec<String> = (recorded.lines().zip(found.lines()))
        .filter(|(was, is)| was != is)
        .map(|(was, is)| format!("- {was}\n+ {is}"))
        .collect();
    assert!(changed.is_empty(), "results changed; BLESS=1 records them:\n{}", changed.join("\n"));
    assert_eq!(recorded.lines().count(), found.lines().count(), "BLESS=1 records a new set of runs");
}
