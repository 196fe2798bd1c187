//! Running the engine as tests do, and what every result must satisfy.

use coarsen::backend::{Buffer, Device, GpuOptions, Queue, Selector};
use coarsen::contract::{Metric, Options, PlaneWeight};
use coarsen::formats::{Format, WriteOptions, write_to};
use coarsen::kernel::face_normals::FaceNormals;
use coarsen::kernel::plane_sums::PlaneSums;
use coarsen::kernel::rows::{Face, Normal, PlaneQuadric, Position};
use coarsen::mesh::{Defect, validate};
use coarsen::progressive::{CollapseLog, Replay};
use coarsen::{Budget, Mesh, Method, Outcome, simplify};

use super::independent::{Topology, topology};

/// Both metrics.
pub const METRICS: [Metric; 2] = [Metric::Volume, Metric::Plane];

/// The default options with this metric.
pub fn options(metric: Metric) -> Options {
    Options { metric, ..Options::default() }
}

/// The CPU with this many threads.
pub fn cpu(threads: usize) -> Device {
    Device::cpu(threads).expect("threads start")
}

/// Contracts on one thread of the CPU.
pub fn contract(mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    contract_on(&cpu(1), mesh, options, budget)
}

/// Contracts on a device.
pub fn contract_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Contract(options.clone()), &budget, device, None).expect("a valid mesh and budget")
}

/// The mesh as a binary PLY file: what "the same bytes" means.
pub fn bytes(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_to(mesh, Format::Ply, &WriteOptions::default(), &mut bytes).expect("a valid mesh");
    bytes
}

/// The 64-bit FNV-1a hash.
pub fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// A hardware GPU or else software Vulkan with these options, or `None` after saying that there is neither;
/// `REQUIRE_GPU=1` makes that a failure.
pub fn gpu(options: &GpuOptions) -> Option<Device> {
    match open_gpu(options) {
        Ok(device) => Some(device),
        Err(reason) if asked("REQUIRE_GPU") => panic!("{reason}"),
        Err(reason) => {
            println!("skipped: {reason}");
            None
        }
    }
}

/// A hardware GPU or else software Vulkan with these options.
pub fn open_gpu(options: &GpuOptions) -> coarsen::Result<Device> {
    Device::open_with(&Selector::Gpu, 2, options).or_else(|_| Device::open_with(&Selector::Software, 2, options))
}

/// Whether an environment variable is 1.
pub fn asked(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|value| value == "1")
}

/// How many defects of each kind: repeated corners, no area, duplicates, crowded edges, bow ties, misoriented, folded.
pub fn defects(mesh: &Mesh) -> [usize; 7] {
    let mut counts = [0; 7];
    for defect in validate(mesh) {
        let kind = match defect {
            Defect::RepeatedCorner { .. } => 0,
            Defect::ZeroArea { .. } => 1,
            Defect::DuplicateFace { .. } => 2,
            Defect::NonManifoldEdge { .. } => 3,
            Defect::BowTie { .. } => 4,
            Defect::Misoriented { .. } => 5,
            Defect::Folded { .. } => 6,
            other => panic!("no valid mesh: {other}"),
        };
        counts[kind] += 1;
    }
    counts
}

/// The surface's topology is that of `before`, and no defect is new, by the library's list and by the definitions; folds
/// aside, which slivers on flats have by the accident of their normals.
///
/// For meshes that welding leaves as they are.
pub fn assert_kept(name: &str, before: &Mesh, outcome: &Outcome) {
    outcome.mesh.check().unwrap_or_else(|error| panic!("{name}: {error}"));
    let (was, is) = (topology(before), topology(&outcome.mesh));
    let kept = |t: Topology| (t.euler, t.components, t.border_loops, t.non_manifold_edges, t.bow_ties);
    assert_eq!(kept(is), kept(was), "{name}: Euler, components, borders, non-manifold edges, bow ties");
    let flaws = |t: Topology| [t.misoriented_edges, t.degenerate_faces, t.duplicate_faces];
    let grown = |was: &[usize], is: &[usize]| was.iter().zip(is).any(|(was, is)| is > was);
    let (flawed, flawless) = (flaws(is), flaws(was));
    assert!(!grown(&flawless, &flawed), "{name}: misoriented, degenerate, duplicate {flawless:?} → {flawed:?}");
    let (had, has) = (defects(before), defects(&outcome.mesh));
    assert!(!grown(&had[..6], &has[..6]), "{name}: {had:?} → {has:?}: {:?}", validate(&outcome.mesh));
    assert_eq!(outcome.mesh.positions.len(), is.vertices, "{name}: vertices without a face");
    assert_eq!(outcome.mesh.positions.len(), outcome.vertex_origin.len(), "{name}: one origin a vertex");
    assert_rounds_add_up(name, outcome);
}

/// Every round's record agrees with the next one's and with the result.
pub fn assert_rounds_add_up(name: &str, outcome: &Outcome) {
    let ends = outcome.rounds.iter().skip(1).map(|round| round.faces).chain([outcome.mesh.faces.len() as u64]);
    for (i, (round, faces)) in outcome.rounds.iter().zip(ends).enumerate() {
        let removed = round.faces.checked_sub(faces).unwrap_or_else(|| panic!("{name}: round {i} added faces"));
        let contracted = round.contracted;
        assert!(
            (contracted..=2 * contracted).contains(&removed),
            "{name}: round {i} lost {removed} faces by {contracted} contractions"
        );
        assert!(contracted <= round.candidates && round.candidates <= round.pairs, "{name}: round {i}: {round:?}");
    }
    if let Some(last) = outcome.rounds.last() {
        assert_eq!(outcome.blocked, last.blocked, "{name}");
    }
}

/// The log of a run, read back from the bytes of its file, leads from the input to the result and back; returns the start.
pub fn assert_replays(name: &str, input: &Mesh, outcome: &Outcome) -> Mesh {
    let written = outcome.log.as_ref().unwrap_or_else(|| panic!("{name}: no log"));
    let log = CollapseLog::from_bytes(&written.to_bytes()).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(log == *written, "{name}: the log that is read is another");
    let mut replay = Replay::new(input, &log).unwrap_or_else(|error| panic!("{name}: {error}"));
    let start = replay.mesh();
    replay.seek(usize::MAX);
    assert_eq!(replay.step(), log.contractions().len(), "{name}");
    assert_same_mesh(&format!("{name}, the result"), &replay.mesh(), &outcome.mesh);
    while replay.back() {}
    assert_same_mesh(&format!("{name}, the start again"), &replay.mesh(), &start);
    start
}

/// The same numbers bit for bit.
#[track_caller]
pub fn assert_same_mesh(name: &str, a: &Mesh, b: &Mesh) {
    assert_eq!(a, b, "{name}");
    let bits =
        |mesh: &Mesh| -> Vec<[u64; 3]> { mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect() };
    assert!(bits(a) == bits(b), "{name}: the signs of zeros");
}

/// The normals of all faces, and the quadrics of planes of so many vertices.
pub fn plane_quadrics(
    queue: &mut Queue,
    [ring_starts, ring_faces]: [&Buffer<u32>; 2],
    (positions, faces): (&Buffer<Position>, &Buffer<Face>),
    vertex_count: u32,
    planes: PlaneWeight,
) -> (Buffer<Normal>, Buffer<PlaneQuadric>) {
    let mut normals = queue.buffer(faces.len()).expect("memory");
    let face_count = faces.len() as u32;
    queue.run(FaceNormals { positions, faces, face_count, normals: &mut normals }).expect("a kernel on the host");
    let mut quadrics = queue.buffer(vertex_count as usize).expect("memory");
    let sums = PlaneSums {
        positions,
        faces,
        ring_starts,
        ring_faces,
        normals: &normals,
        vertex_count,
        border_weight: 1.0,
        by_area: u32::from(planes == PlaneWeight::Area),
        quadrics: &mut quadrics,
    };
    queue.run(sums).expect("a kernel on the host");
    (normals, quadrics)
}
