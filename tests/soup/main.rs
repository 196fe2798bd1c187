//! Seeded random rubbish through the engine: no panic, no hang, and nothing in the result that the input did not have.
//! `COARSEN_FUZZ_SECONDS` fuzzes that long from a seed that it prints.
#![expect(clippy::print_stdout, reason = "a long run says how far it came")]

mod regions;
mod rubbish;
#[path = "../support/mod.rs"]
mod support;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use coarsen::contract::{
    AttributeWeights, Attributes, Candidates, ColorSpace, Feature, FeatureMode, Lock, Metric, NonManifold, Options,
    Placement, PlaneWeight, QuadricFormat, QuadricFrame, Quadrics, Update, Weighting,
};
use coarsen::math::DVec3;
use coarsen::mesh::{shapes, weld};
use coarsen::partition::{By, Superfaces};
use coarsen::polish::{Flips, Objective};
use coarsen::simplify::MOVED;
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, StopReason, cluster, removal, simplify};
use rubbish::{below, book, mesh, pick};
use support::deviation::Random;
use support::engine::{METRICS, assert_replays, cpu};
use support::independent::{Topology, topology};
use support::shapes::{sphere, torus};

const PLACEMENTS: [Placement; 4] =
    [Placement::Optimal, Placement::Segment, Placement::EndpointOrMiddle, Placement::Endpoint];

/// Three times what the slowest mesh takes that fuzzing found, which once took longer than this.
const PATIENCE: Duration = Duration::from_secs(20);

fn weighting(random: &mut Random, vertices: usize) -> Weighting {
    let factor = pick(random, &[0.0, 4.0, 1e6]);
    let modes = [
        FeatureMode::Affine { lambda: factor },
        FeatureMode::Gated { lambda: factor },
        FeatureMode::Contrast,
        FeatureMode::Entropy,
    ];
    match below(random, 4) {
        0 => Weighting::Feature(Feature {
            mode: pick(random, &modes),
            curvature_floor: pick(random, &[0.0, 1.0, 1e6]),
            update: pick(random, &[Update::Static, Update::Recompute]),
        }),
        1 => Weighting::Given((0..vertices).map(|_| pick(random, &[0.0, 1.0, 1e-38, 3e38, 1e-45, 0.3])).collect()),
        _ => Weighting::Uniform,
    }
}

fn quadrics(random: &mut Random, metric: Metric) -> Quadrics {
    if metric == Metric::Volume || below(random, 2) == 0 {
        return Quadrics::default();
    }
    let format = pick(random, &QuadricFormat::ALL);
    let frames =
        [QuadricFrame::Normalized, if format.is_local() { QuadricFrame::Normalized } else { QuadricFrame::Raw }];
    let planes = pick(random, &[PlaneWeight::Area, PlaneWeight::One]);
    Quadrics { planes, format: Some(format), frame: pick(random, &frames) }
}

/// Takes no number from the sequence: what the seeds stand for stays.
fn flips(random: &Random) -> Flips {
    let random = &mut Random(random.0 ^ 0xf11b);
    let objective = pick(random, &[Objective::Distance, Objective::Bend, Objective::Shape]);
    Flips { sweeps: pick(random, &[0, 0, 0, 3]), objective }
}

/// Takes no number from the sequence.
fn lock(random: &Random, vertices: usize) -> Option<Lock> {
    let random = &mut Random(random.0 ^ 0x10c);
    let some = vertices > 0 && below(random, 4) == 0;
    some.then(|| Lock::Vertices((0..3).map(|_| below(random, vertices) as u32).collect()))
}

fn attributes(random: &mut Random) -> Attributes {
    let kept = Attributes::default();
    let some = [
        Attributes { color_space: ColorSpace::Luv, ..kept.clone() },
        Attributes { lock_seams: true, ..kept.clone() },
        Attributes { smooth: true, ..kept.clone() },
        Attributes {
            weights: AttributeWeights { normal: 1e6, texcoord: 1e-6, color: 0.0, ..kept.weights.clone() },
            ..kept
        },
        Attributes::drop_all(),
    ];
    some[below(random, some.len())].clone()
}

fn options(random: &mut Random, vertices: usize) -> Options {
    let join_within = if below(random, 4) == 0 { pick(random, &[1e-9, 0.3, 2.0, 1e30]) } else { 0.0 };
    let by_triangles = join_within == 0.0 && below(random, 4) == 0;
    let metric = pick(random, &METRICS);
    let non_manifold = pick(random, &[NonManifold::Cut, NonManifold::Hold]);
    let options = Options {
        metric,
        candidates: Candidates::Pairs,
        placement: pick(random, &PLACEMENTS),
        weighting: weighting(random, vertices),
        quadrics: quadrics(random, metric),
        border_weight: pick(random, &[0.0, 1.0, 1e-30, 1e6]),
        lock_border: below(random, 4) == 0,
        locked: None,
        lock: lock(random, vertices),
        join_within,
        non_manifold,
        fit: if join_within > 0.0 { 0 } else { below(random, 3) as u32 },
        flips: flips(random),
        max_flip_rad: pick(random, &[1.37, 1e-3, std::f32::consts::FRAC_PI_2]),
        weld: pick(random, &[Some(0.0), Some(0.0), None, Some(1e-3), Some(0.5)]),
        prune: pick(random, &[None, Some(0.0)]),
        close_holes: pick(random, &[None, None, Some(0.0), Some(0.2), Some(1.0)]),
        attributes: attributes(random),
        log: false,
    };
    let log = options.fit == 0 && options.flips.sweeps == 0 && below(random, 2) == 0;
    let close_holes = options.close_holes.filter(|_| !log);
    let options = Options { log, close_holes, ..options };
    if !by_triangles {
        return options;
    }
    let placement = match options.placement {
        Placement::Segment => Placement::Optimal,
        other => other,
    };
    Options { metric: Metric::Plane, candidates: Candidates::Triangles, placement, ..options }
}

fn budget(random: &mut Random, faces: usize) -> Budget {
    let limits = [0.0, 1e-9, 1e-2, 1.0, 1e300];
    match below(random, 7) {
        0 => Budget::faces(0),
        1 => Budget::faces(below(random, faces + 2)),
        2 => Budget::keep(random.unit()),
        3 => Budget::reduction(random.unit()),
        4 => Budget::error(pick(random, &limits)),
        5 => Budget::error_abs(pick(random, &limits)),
        _ => Budget { error: Some(0.01), ..Budget::keep(0.1) },
    }
}

// What must hold

/// The outcome of a run that ends in time, its mesh and its estimate valid; nothing where the input or an option is refused.
fn outcome(mesh: &Mesh, method: Method, budget: Budget, device: &Device) -> Option<Outcome> {
    let clock = Instant::now();
    let result = simplify(mesh, &method, &budget, device, None);
    assert!(clock.elapsed() < PATIENCE, "it took {:?}", clock.elapsed());
    let outcome = match result {
        Ok(outcome) => outcome,
        Err(Error::Mesh(reason)) => {
            let is_face = |face: &[u32; 3]| {
                let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
                a != b && b != c && c != a
            };
            // Others are no colors and no weights.
            let is_said = reason.contains("degenerate") && !matches!(method, Method::Cluster(_)) && !joins(&method);
            assert!(!is_said || !mesh.faces.iter().any(is_face), "a face has three corners: {reason}");
            return None;
        }
        // The diagonal times a limit may be too large for a number, a limit finer than any grid, and there may be no colors.
        Err(Error::Parameter(_)) => return None,
        Err(other) => panic!("{other}"),
    };
    outcome.mesh.check().unwrap_or_else(|error| panic!("{error}"));
    assert!(outcome.error_estimate >= 0.0 && !outcome.error_estimate.is_nan(), "estimate {}", outcome.error_estimate);
    assert_eq!(outcome.mesh.positions.len(), outcome.vertex_origin.len());
    let moves = matches!(method, Method::Contract(_) | Method::Cluster(_));
    // What slides stays between vertices of the input.
    let slides = matches!(&method, Method::Partition(options)
        if matches!(options.by, By::Superfaces(Superfaces { slides: true, .. })));
    let (low, high) = mesh.bounds();
    let rounding = DVec3::splat(1e-9 * mesh.diagonal());
    for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
        let is_inside = p.cmpge(low - rounding).all() && p.cmple(high + rounding).all();
        let may_be_anywhere = origin == MOVED && (moves || (slides && is_inside));
        let stands = may_be_anywhere || mesh.positions.get(origin as usize) == Some(p);
        assert!(stands, "{p} does not come from {origin}");
    }
    Some(outcome)
}

/// Whether vertices that lie apart are joined first, which may leave no face.
fn joins(method: &Method) -> bool {
    let weld = match method {
        Method::Contract(options) => options.weld,
        Method::Removal(options) => options.weld,
        Method::Partition(options) => options.weld,
        _ => None,
    };
    weld.is_some_and(|distance| distance > 0.0)
}

/// What a run starts from: degenerate faces are dropped in any case, and would count at the edges they double. Faces that repeat
/// those of another material stay where the surface is cut apart.
fn start(mesh: &Mesh, weld_within: Option<f64>, has_layers: bool) -> Mesh {
    let mut start = match weld_within {
        Some(tolerance) if has_layers => weld(mesh, tolerance).mesh,
        Some(tolerance) => weld(&Mesh { materials: None, ..mesh.clone() }, tolerance).mesh,
        None => mesh.clone(),
    };
    start.faces.retain(|[a, b, c]| a != b && b != c && c != a);
    start
}

fn assert_sound(mesh: &Mesh, options: &Options, budget: Budget, device: &Device) {
    let Some(outcome) = outcome(mesh, Method::Contract(options.clone()), budget, device) else { return };
    let Attributes { dropped, smooth, .. } = &options.attributes;
    let result = &outcome.mesh;
    assert_eq!(result.colors.is_some(), mesh.colors.is_some() && !dropped.colors);
    assert_eq!(result.normals.is_some(), mesh.normals.is_some() && !dropped.normals);
    let is_split = !smooth && !options.log;
    assert_eq!(result.texcoords.is_some(), mesh.texcoords.is_some() && !dropped.texcoords && is_split);
    assert_eq!(result.materials.is_some(), mesh.materials.is_some() && !dropped.materials && is_split);
    assert_eq!(result.channels.is_empty(), mesh.channels.is_empty() || dropped.channels || !is_split);
    for rows in outcome.mesh.colors.iter().flatten() {
        assert!(rows.iter().all(|c| (0.0..=1.0).contains(c)), "color {rows:?}");
    }
    if options.log {
        assert_replays("the log", mesh, &outcome);
    }
    // Where corners disagree in what vertices carry, there are several at one place.
    let is_split = is_split && (result.normals.is_some() || !result.channels.is_empty());
    let is_cut = options.non_manifold == NonManifold::Cut && options.placement != Placement::Endpoint && !options.log;
    let has_layers = is_cut && options.join_within <= 0.0 && !dropped.materials && !smooth;
    let start = start(mesh, options.weld, has_layers);
    // Where they would keep too many faces, vertices move at which it is not manifold.
    let yields = outcome.warnings.iter().any(|warning| warning.contains("not manifold move"));
    assert!(is_cut || !yields, "nothing may yield: {:?}", outcome.warnings);
    // A hole takes fewer faces to close than it has sides.
    let closes = outcome.warnings.iter().any(|warning| warning.starts_with("holes closed"));
    let added = if closes { topology(&start).border_edges } else { 0 };
    let parts = match (options.join_within > 0.0 || yields, is_cut) {
        (true, _) => Parts::MayJoin,
        // Which of several vertices at one place are one nobody can tell from the result: others may have come to the same place.
        _ if is_split => {
            let (was, is) = (topology(&start), topology(result));
            assert!(is.non_manifold_edges <= was.non_manifold_edges, "{was:?} → {is:?}");
            assert!(is.duplicate_faces <= was.duplicate_faces && is.faces <= was.faces + added, "{was:?} → {is:?}");
            return;
        }
        (_, true) => Parts::MayBeMore,
        _ => Parts::Stay,
    };
    assert_topology(&start, result, parts, added);
}

/// What may become of the parts of a mesh.
#[derive(Clone, Copy, PartialEq)]
enum Parts {
    Stay,
    /// Where the surface touches itself it may be cut.
    MayBeMore,
    /// What was wound both ways is wound as most of its region, so that so many edges between regions may disagree.
    MayTurn(usize),
    MayJoin,
}

/// No face is new but so many that were added, and no flaw, and parts stay parts; where these may join, no face is there twice.
fn assert_topology(start: &Mesh, result: &Mesh, parts: Parts, added: usize) {
    let (was, is) = (topology(start), topology(result));
    let counts = |t: Topology| [t.non_manifold_edges, t.bow_ties, t.misoriented_edges, t.duplicate_faces];
    let repeated = result.faces.iter().any(|[a, b, c]| a == b || b == c || c == a);
    assert!(!repeated, "a face with a repeated corner");
    assert!(is.faces <= was.faces + added, "{was:?} → {is:?}");
    if parts == Parts::MayJoin {
        assert!(is.duplicate_faces <= was.duplicate_faces, "{was:?} → {is:?}");
        assert!(is.faces > 0 || was.faces == 0, "all canceled out: {was:?}");
        return;
    }
    // Faces keep their winding, and of an edge of four nobody asked whether they agree.
    let cut_edges = was.non_manifold_edges.saturating_sub(is.non_manifold_edges);
    let asked = match parts {
        Parts::MayBeMore => 2 * cut_edges,
        Parts::MayTurn(edges) => edges,
        Parts::Stay | Parts::MayJoin => 0,
    };
    let was = Topology { misoriented_edges: was.misoriented_edges + asked, ..was };
    let grown = counts(was).iter().zip(counts(is)).any(|(was, is)| is > *was);
    assert!(!grown, "crowded edges, bow ties, misoriented, duplicates: {:?} → {:?}", counts(was), counts(is));
    let is_kept = is.components == was.components || (parts == Parts::MayBeMore && is.components > was.components);
    assert!(is_kept, "{was:?} → {is:?}");
}

/// Clustering takes anything, and leaves faces of three corners of which no two are the same.
fn assert_clusters(mesh: &Mesh, options: &cluster::Options, budget: Budget, device: &Device) {
    let Some(outcome) = outcome(mesh, Method::Cluster(options.clone()), budget, device) else { return };
    let mut seen = std::collections::BTreeSet::new();
    for &face in &outcome.mesh.faces {
        let mut corners = face;
        corners.sort_unstable();
        assert!(corners[0] < corners[1] && corners[1] < corners[2] && seen.insert(corners), "{face:?}");
    }
    assert!(outcome.stop != StopReason::FacesReached || outcome.mesh.faces.len() <= outcome.target);
}

fn cluster_options(random: &mut Random) -> cluster::Options {
    use cluster::Representative::{Input, Mean, Quadric};
    cluster::Options {
        grid: pick(random, &[None, Some(1), Some(2), Some(7), Some(100), Some(cluster::MOST_CELLS)]),
        representative: pick(random, &[Quadric, Mean, Input]),
        flips: flips(random),
    }
}

/// Removal keeps the topology, and of the vertices some.
fn assert_removes(mesh: &Mesh, options: &removal::Options, budget: Budget, device: &Device) {
    let Some(outcome) = outcome(mesh, Method::Removal(options.clone()), budget, device) else { return };
    assert_eq!(outcome.mesh.colors.is_some(), mesh.colors.is_some());
    assert_topology(&start(mesh, options.weld, false), &outcome.mesh, Parts::Stay, 0);
}

fn removal_options(random: &mut Random) -> removal::Options {
    use removal::{Features, Fill};
    removal::Options {
        fill: pick(random, &[Fill::Fan, Fill::Ears, Fill::Dynamic, Fill::Exhaustive]),
        features: pick(random, &[Features::Ignore, Features::Guide(0.5), Features::Keep(0.7), Features::default()]),
        lock_border: below(random, 4) == 0,
        max_flip_rad: pick(random, &[1.37, 1e-3, std::f32::consts::FRAC_PI_2]),
        weld: pick(random, &[Some(0.0), Some(0.0), None, Some(1e-3), Some(0.5)]),
        flips: flips(random),
    }
}

/// One seed's mesh, options and budget; a failure names them all.
fn run(seed: u64, device: &Device) {
    let mut random = Random(seed);
    let mesh = mesh(&mut random);
    let options = options(&mut random, mesh.positions.len());
    let budget = budget(&mut random, mesh.faces.len());
    attempt(&format!("seed {seed}"), &mesh, &options, budget, device);

    let removed = removal_options(&mut random);
    if catch_unwind(AssertUnwindSafe(|| assert_removes(&mesh, &removed, budget, device))).is_err() {
        panic!("seed {seed}: {removed:?} {budget:?}");
    }

    regions::run(seed, &mesh, device);

    let options = cluster_options(&mut random);
    let budget = if options.grid.is_some() { Budget::default() } else { budget };
    if catch_unwind(AssertUnwindSafe(|| assert_clusters(&mesh, &options, budget, device))).is_err() {
        panic!("seed {seed}: {options:?} {budget:?}");
    }
}

/// [`assert_sound`], with everything that it takes to repeat it on failure.
fn attempt(name: &str, mesh: &Mesh, options: &Options, budget: Budget, device: &Device) {
    if catch_unwind(AssertUnwindSafe(|| assert_sound(mesh, options, budget, device))).is_err() {
        let small = if mesh.faces.len() <= 12 { format!("{mesh:?}") } else { format!("{} faces", mesh.faces.len()) };
        panic!("{name}: {options:?} {budget:?} {small}");
    }
}

/// Seeds of long runs that something was wrong with: a region that touches itself was drawn so that it closed around the vertex; the
/// sides of hundreds of seams at one vertex were asked each about each.
const FOUND: [u64; 2] = [30_123_759_344_028_235, 30_123_911_412_713_382];

#[test]
fn rubbish_does_no_harm() {
    let device = cpu(2);
    (0..3000).chain(FOUND).for_each(|seed| run(seed, &device));
}

#[test]
fn long_fuzzing() {
    let seconds = std::env::var("COARSEN_FUZZ_SECONDS").ok().and_then(|text| text.parse::<u64>().ok());
    let Some(seconds) = seconds else {
        println!("skipped: COARSEN_FUZZ_SECONDS=60 fuzzes for a minute");
        return;
    };
    let device = cpu(2);
    let epoch = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).map_or(0, |t| t.as_secs());
    let first = epoch << 24;
    let clock = Instant::now();
    let mut seed = first;
    while clock.elapsed().as_secs() < seconds {
        run(seed, &device);
        seed += 1;
    }
    println!("{} meshes from seed {first}", seed - first);
}

// Rubbish with a name

/// Every budget and option on meshes in which nothing, or everything, ties.
#[test]
fn flat_straight_and_pointlike_meshes_end() {
    let device = cpu(1);
    let shrunk = |map: fn(DVec3) -> DVec3| {
        let mut mesh = torus(12, 8);
        mesh.positions.iter_mut().for_each(|p| *p = map(*p));
        mesh
    };
    let meshes = [
        ("flat", shrunk(|p| DVec3::new(p.x, p.y, 0.0))),
        ("straight", shrunk(|p| DVec3::X * p.x)),
        ("two points", shrunk(|p| if p.x > 0.0 { DVec3::X } else { DVec3::ZERO })),
        ("a point", shrunk(|_| DVec3::ONE)),
        ("smallest", shrunk(|p| p * 5e-324)),
        ("largest", shrunk(|p| p * 1e307)),
        ("thin", shrunk(|p| DVec3::new(p.x, p.y * 1e-200, p.z * 1e-300))),
        ("far", shrunk(|p| p * 1e-10 + DVec3::splat(1e10))),
    ];
    for (name, mesh) in &meshes {
        for weld in [Some(0.0), None] {
            for budget in [Budget::faces(0), Budget::keep(0.5), Budget::error(0.01), Budget::error_abs(0.0)] {
                println!("{name}: {weld:?} {budget:?}");
                assert_removes(mesh, &removal::Options { weld, ..removal::Options::default() }, budget, &device);
            }
        }
        for metric in METRICS {
            for (placement, weld) in [(Placement::Optimal, Some(0.0)), (Placement::Endpoint, None)] {
                let options = Options { metric, placement, weld, ..Options::default() };
                for budget in [Budget::faces(0), Budget::keep(0.5), Budget::error(0.01), Budget::error_abs(0.0)] {
                    attempt(name, mesh, &options, budget, &device);
                }
            }
        }
    }
}

/// One vertex in 20,000 faces, and many edges of 1000 faces each.
#[test]
fn crowded_vertices_and_edges_end() {
    let device = cpu(1);
    let mut books = book(1000);
    books.faces.extend((2..1001).map(|i| [0, i, i + 1]));
    for mesh in [shapes::cylinder(10_000), books] {
        for metric in METRICS {
            attempt("crowded", &mesh, &Options { metric, ..Options::default() }, Budget::keep(0.01), &device);
        }
        assert_removes(&mesh, &removal::Options::default(), Budget::keep(0.01), &device);
    }
}

#[test]
fn poison_is_refused() {
    for poison in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for v in [0, 7, 65] {
            let mut mesh = sphere(2);
            mesh.positions[v].y = poison;
            for metric in METRICS {
                let method = Method::Contract(Options { metric, ..Options::default() });
                let result = simplify(&mesh, &method, &Budget::keep(0.5), &cpu(1), None);
                assert!(matches!(result, Err(Error::Mesh(_))), "{poison} at {v}: {result:?}");
            }
        }
    }
}
