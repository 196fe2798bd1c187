//! The same bytes on every device: threads of the CPU, a GPU or software Vulkan, small pages, a device lost on the way.
//!
//! Without an adapter the tests that need one say so and pass; `REQUIRE_GPU=1` makes that a failure.
#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod support;

use std::ops::ControlFlow;

use coarsen::backend::{Device, Exactness, GpuOptions, Packing};
use coarsen::contract::{
    Attributes, Feature, Metric, Options, Placement, PlaneWeight, QuadricFormat, QuadricFrame, Quadrics, Seams, Update,
    Weighting, initial_quadrics,
};
use coarsen::math::Vec2;
use coarsen::mesh::{SAMPLES, sample, shapes};
use coarsen::simplify::{Progress, RoundRecord};
use coarsen::{Budget, Mesh, Method, Outcome, formats, simplify};
use support::engine::{METRICS, asked, bytes, contract, contract_on, cpu, gpu, open_gpu, options};
use support::models;

/// Enough for several rounds on the GPU before the CPU takes the rest.
const SAMPLE_FACES: usize = 50_000;
const SHARES: [f64; 3] = [0.5, 0.1, 0.01];

/// Many rounds on the GPU, whose copy of the surface follows by itself or is sent anew.
fn many_rounds(replays: bool) -> GpuOptions {
    GpuOptions { replays: Some(replays), handover_faces: Some(5_000), ..GpuOptions::default() }
}

/// Several pages on the samples, and no more bindings than the self-test has room for.
fn small_pages() -> GpuOptions {
    GpuOptions { page_rows: Some(1 << 15), ..many_rounds(true) }
}

/// What a caller sees: the written file, origins, and the rounds' records less the device.
fn record(outcome: &Outcome) -> (Vec<u8>, Vec<u32>, Vec<String>) {
    let rounds = outcome.rounds.iter().map(|round| format!("{:?}", RoundRecord { on_gpu: false, ..*round }));
    (bytes(&outcome.mesh), outcome.vertex_origin.clone(), rounds.collect())
}

/// Fails where the records differ, and says where first.
fn assert_same(name: &str, reference: &Outcome, outcome: &Outcome) {
    let (ours, theirs) = (record(outcome), record(reference));
    for (i, (a, b)) in theirs.2.iter().zip(&ours.2).enumerate() {
        assert_eq!(a, b, "{name}: round {i}");
    }
    assert_eq!(theirs.2.len(), ours.2.len(), "{name}: rounds");
    assert!(theirs.0 == ours.0, "{name}: {} and {} bytes differ", theirs.0.len(), ours.0.len());
    assert_eq!(theirs.1, ours.1, "{name}: origins");
    assert_eq!(reference.error_estimate.to_bits(), outcome.error_estimate.to_bits(), "{name}: error estimate");
    assert_eq!(reference.warnings, outcome.warnings, "{name}");
}

fn samples() -> impl Iterator<Item = (&'static str, Mesh)> {
    SAMPLES.iter().map(|&(name, ..)| (name, sample(name, Some(SAMPLE_FACES)).expect("a sample")))
}

#[test]
fn threads_do_not_change_the_bytes() {
    let devices = [1, 2, 3, 5].map(cpu);
    for (name, mesh) in samples() {
        for metric in METRICS {
            for share in SHARES {
                let name = format!("{name} {metric:?} {share}");
                let reference = contract(&mesh, &options(metric), Budget::keep(share));
                for device in &devices {
                    let outcome = contract_on(device, &mesh, &options(metric), Budget::keep(share));
                    assert_same(&format!("{name}, {}", device.description()), &reference, &outcome);
                }
            }
        }
    }
}

/// Every sample, metric and share on one GPU: the CPU's bytes, and really computed there.
fn assert_as_on_the_cpu(device: &Device) {
    for (name, mesh) in samples() {
        for metric in METRICS {
            for share in SHARES {
                let name = format!("{name} {metric:?} {share}, {}", device.description());
                let reference = contract(&mesh, &options(metric), Budget::keep(share));
                let outcome = contract_on(device, &mesh, &options(metric), Budget::keep(share));
                assert_same(&name, &reference, &outcome);
                assert!(outcome.rounds[0].on_gpu, "{name}: the first round ran on the CPU");
                assert_eq!(outcome.device, device.description(), "{name}");
            }
        }
    }
}

#[test]
fn a_gpu_returns_the_cpu_s_bytes() {
    let Some(device) = gpu(&GpuOptions::default()) else { return };
    assert_as_on_the_cpu(&device);
    assert_eq!(device.gpu_bytes(), 0, "buffers outlive the runs");
}

#[test]
fn a_copy_that_follows_by_itself_returns_the_cpu_s_bytes() {
    let Some(device) = gpu(&many_rounds(true)) else { return };
    assert_as_on_the_cpu(&device);
}

#[test]
fn a_copy_that_is_sent_anew_returns_the_cpu_s_bytes() {
    let Some(device) = gpu(&many_rounds(false)) else { return };
    assert_as_on_the_cpu(&device);
}

#[test]
fn what_touches_itself_is_cut_alike() {
    // A chessboard of towers.
    let mesh = shapes::voxels([32, 32, 8], |[x, y, _]| (x / 4 + y / 4) % 2 == 0);
    let options = Options::default();
    let reference = contract(&mesh, &options, Budget::keep(0.3));
    assert!(reference.warnings.iter().any(|warning| warning.contains("touches itself")), "{:?}", reference.warnings);
    for device in [Some(cpu(1)), Some(cpu(3)), gpu(&many_rounds(true)), gpu(&many_rounds(false))].into_iter().flatten()
    {
        let outcome = contract_on(&device, &mesh, &options, Budget::keep(0.3));
        assert_same(&device.description(), &reference, &outcome);
    }
}

/// Where vertices at which the surface is not manifold keep too many faces, the run goes on from a copy of an earlier round.
#[test]
fn what_is_not_manifold_yields_alike() {
    let Mesh { positions, faces, .. } = sample("statue", Some(SAMPLE_FACES)).expect("a sample");
    let mut mesh = Mesh::new(positions, faces);
    let sides = mesh.faces.iter().step_by(9).map(|&[a, b, _]| [a, b]).collect::<Vec<_>>();
    for [a, b] in sides {
        let fin = (mesh.positions[a as usize] + mesh.positions[b as usize]) * 0.51;
        mesh.faces.push([a, b, mesh.positions.len() as u32]);
        mesh.positions.push(fin);
    }
    let reference = contract(&mesh, &Options::default(), Budget::faces(2_000));
    assert!(reference.warnings.iter().any(|warning| warning.contains("not manifold move")), "{:?}", reference.warnings);
    let on_gpu = gpu(&many_rounds(true));
    for device in [Some(cpu(3)), on_gpu].iter().flatten() {
        let outcome = contract_on(device, &mesh, &Options::default(), Budget::faces(2_000));
        assert_same(&device.description(), &reference, &outcome);
    }
}

/// The CPU takes over where it was asked to.
#[test]
fn few_faces_are_left_to_the_cpu() {
    let mesh = sample("statue", Some(SAMPLE_FACES)).expect("a sample");
    for handover_faces in [1_000, 20_000] {
        let asked = GpuOptions { handover_faces: Some(handover_faces), ..GpuOptions::default() };
        let Some(device) = gpu(&asked) else { return };
        let outcome = contract_on(&device, &mesh, &options(Metric::Volume), Budget::keep(0.01));
        assert!(outcome.rounds.iter().all(|round| round.on_gpu == (round.faces >= handover_faces as u64)));
    }
}

#[test]
fn warming_up_changes_nothing() {
    let Some(device) = gpu(&many_rounds(true)) else { return };
    let mesh = sample("part", Some(20_000)).expect("a sample");
    for metric in METRICS {
        coarsen::warm_up(&Method::Contract(options(metric)), &device).expect("good options");
        let reference = contract(&mesh, &options(metric), Budget::keep(0.1));
        assert_same("warm", &reference, &contract_on(&device, &mesh, &options(metric), Budget::keep(0.1)));
    }
    assert_eq!(device.gpu_bytes(), 0);
    let method = Method::Contract(Options { border_weight: -1.0, ..Options::default() });
    assert!(coarsen::warm_up(&method, &cpu(1)).is_err() && coarsen::warm_up(&method, &device).is_err());
}

/// A GPU loads all that meshes may need, software, which compiles on the cores that have the mesh to read, what a closed one does.
#[test]
fn what_is_warm_loads_no_kernel() {
    let Some(device) = gpu(&GpuOptions { handover_faces: Some(0), ..many_rounds(true) }) else { return };
    let mut mesh = if device.is_software() { shapes::icosphere(4) } else { shapes::plane(40, 40) };
    let mut options = options(Metric::Volume);
    coarsen::warm_up(&Method::Contract(options.clone()), &device).expect("good options");
    let loaded = device.loaded_kernels();
    if !device.is_software() {
        mesh.colors =
            Some(mesh.positions.iter().map(|p| [(0.01 * p.x) as f32, (0.02 * p.y) as f32, 0.5, 1.0]).collect());
        options.lock_border = true;
    }
    let outcome = contract_on(&device, &mesh, &options, Budget::keep(0.2));
    assert!(outcome.rounds.iter().filter(|round| round.on_gpu).count() > 2 && loaded > 10, "{:?}", outcome.rounds);
    assert_eq!(device.loaded_kernels(), loaded);
}

#[test]
fn small_pages_return_the_cpu_s_bytes() {
    let Some(device) = gpu(&small_pages()) else { return };
    assert_as_on_the_cpu(&device);
}

/// Pairs without an edge are found on the GPU; the rounds are the host's.
#[test]
fn a_gpu_finds_the_cpu_s_joins() {
    let Some(device) = gpu(&small_pages()) else { return };
    let mesh = sample("assembly", Some(SAMPLE_FACES)).expect("a sample");
    for metric in METRICS {
        for share in [0.1, 0.01] {
            let joining = Options { join_within: 0.02 * mesh.diagonal(), ..options(metric) };
            let reference = contract(&mesh, &joining, Budget::keep(share));
            let outcome = contract_on(&device, &mesh, &joining, Budget::keep(share));
            assert_same(&format!("{metric:?} {share}"), &reference, &outcome);
            let edges = contract(&mesh, &options(metric), Budget::keep(share));
            assert!(edges.mesh != outcome.mesh, "{metric:?} {share}: nothing joins");
            assert!(outcome.bytes_moved > 0, "nothing ran on the GPU");
        }
    }
}

#[test]
fn a_device_repeats_itself() {
    let Some(device) = gpu(&GpuOptions::default()) else { return };
    let mesh = sample("statue", Some(SAMPLE_FACES)).expect("a sample");
    for metric in METRICS {
        let [first, second] = [0, 1].map(|_| contract_on(&device, &mesh, &options(metric), Budget::keep(0.05)));
        assert_same(&format!("{metric:?}"), &first, &second);
    }
}

#[test]
fn guards_of_the_arithmetic_do_not_change_the_bytes() {
    let (packing, texels) = (Some(Packing::Words), Some(false));
    let guarded = GpuOptions { exactness: Some(Exactness::Guarded), packing, texels, ..many_rounds(true) };
    let Some(device) = gpu(&guarded) else { return };
    let mesh = sample("statue", Some(SAMPLE_FACES)).expect("a sample");
    for metric in METRICS {
        let reference = contract(&mesh, &options(metric), Budget::keep(0.1));
        assert_same(
            &format!("{metric:?}"),
            &reference,
            &contract_on(&device, &mesh, &options(metric), Budget::keep(0.1)),
        );
    }
}

/// Options that take other ways through the kernels.
#[test]
fn options_do_not_part_the_devices() {
    let Some(device) = gpu(&many_rounds(true)) else { return };
    let mut terrain = sample("terrain", Some(20_000)).expect("a sample");
    terrain.faces.iter_mut().step_by(11).for_each(|face| face.swap(1, 2));
    let mut holed = sample("part", Some(20_000)).expect("a sample");
    holed.faces = holed.faces.iter().copied().enumerate().filter(|(f, _)| f % 97 != 0).map(|(_, face)| face).collect();
    let moebius = shapes::moebius(6000);
    for (name, mesh) in [("terrain", &terrain), ("holed part", &holed), ("strip", &moebius)] {
        for metric in METRICS {
            let with = options(metric);
            let variants = [
                Options { placement: Placement::Endpoint, ..with.clone() },
                Options { placement: Placement::Segment, ..with.clone() },
                Options { placement: Placement::EndpointOrMiddle, ..with.clone() },
                Options { lock_border: true, ..with.clone() },
                Options { border_weight: 0.0, ..with.clone() },
                Options { border_weight: 100.0, max_flip_rad: 0.5, ..with },
            ];
            for (budget, options) in
                [Budget::keep(0.1), Budget::error(1e-3)].iter().flat_map(|b| variants.iter().map(move |o| (b, o)))
            {
                let reference = contract(mesh, options, *budget);
                let outcome = contract_on(&device, mesh, options, *budget);
                assert_same(&format!("{name} {options:?} {budget:?}"), &reference, &outcome);
                assert!(outcome.rounds[0].on_gpu, "{name}");
            }
        }
    }
}

/// Initial quadrics in every format, with borders, features and both kinds of planes.
#[test]
fn stored_quadrics_do_not_part_the_devices() {
    let Some(device) = gpu(&GpuOptions::default()) else { return };
    let terrain = sample("terrain", Some(20_000)).expect("a sample");
    let features = Options::feature_weighted().weighting;
    for format in QuadricFormat::ALL {
        let raw = if format.is_local() { QuadricFrame::Normalized } else { QuadricFrame::Raw };
        for (frame, planes) in [(QuadricFrame::Normalized, PlaneWeight::One), (raw, PlaneWeight::Area)] {
            let weighting = if frame == raw { features.clone() } else { Options::averaged().weighting };
            let quadrics = Quadrics { planes, format: Some(format), frame };
            let options = Options { quadrics, weighting, ..Options::averaged() };
            let reference = contract(&terrain, &options, Budget::keep(0.1));
            for device in [&device, &cpu(3)] {
                let outcome = contract_on(device, &terrain, &options, Budget::keep(0.1));
                let name = format!("{options:?}, {}", device.description());
                assert_same(&name, &reference, &outcome);
                assert_eq!(outcome.rounds[0].on_gpu, device.is_gpu(), "{name}");
            }
            let stored = |device| initial_quadrics(&terrain, &options, device).expect("a valid mesh");
            let (ours, theirs) = (stored(&device), stored(&cpu(1)));
            assert!(ours.words == theirs.words && ours.vertices == theirs.vertices, "{options:?}");
            assert_eq!((ours.record.max_num, ours.record.max_d2), (theirs.record.max_num, theirs.record.max_d2));
        }
    }
}

/// Weights that the quadrics hold, that the host carries and that are found in every round, on a copy of either kind.
#[test]
fn weights_do_not_part_the_devices() {
    let mut terrain = sample("terrain", Some(30_000)).expect("a sample");
    terrain.faces.iter_mut().step_by(11).for_each(|face| face.swap(1, 2));
    let given: Vec<f32> = (0..terrain.positions.len()).map(|v| 1.0 + (v % 7) as f32).collect();
    let weightings = [
        Weighting::Feature(Feature::default()),
        Weighting::Feature(Feature { update: Update::Recompute, ..Feature::default() }),
        Weighting::Given(given.into()),
    ];
    for replays in [true, false] {
        let Some(device) = gpu(&many_rounds(replays)) else { return };
        for metric in METRICS {
            for (i, weighting) in weightings.iter().enumerate() {
                let options = Options { weighting: weighting.clone(), ..options(metric) };
                let reference = contract(&terrain, &options, Budget::keep(0.1));
                let outcome = contract_on(&device, &terrain, &options, Budget::keep(0.1));
                let name = format!("{metric:?}, replays {replays}, weighting {i}");
                assert_same(&name, &reference, &outcome);
                assert!(outcome.rounds.iter().filter(|round| round.on_gpu).count() > 2, "{name}");
            }
        }
    }
}

/// The GPU's costs must differ where the mesh does: without this the comparisons above might compare nothing.
#[test]
fn a_moved_vertex_changes_the_bytes() {
    let mesh = sample("statue", Some(5000)).expect("a sample");
    let mut moved = mesh.clone();
    moved.positions[100].x += 1e-3 * mesh.diagonal();
    let [one, other] = [&mesh, &moved].map(|mesh| contract(mesh, &options(Metric::Volume), Budget::keep(0.5)));
    assert!(record(&one) != record(&other));
}

// Faults

/// Runs with the GPU lost after this many rounds.
fn lose_after(device: &Device, mesh: &Mesh, metric: Metric, rounds: usize) -> Outcome {
    let mut seen = 0;
    let mut lose = |_: Progress| {
        seen += 1;
        if seen == rounds {
            device.lose_gpu();
        }
        ControlFlow::Continue(())
    };
    let method = Method::Contract(options(metric));
    simplify(mesh, &method, &Budget::keep(0.05), device, Some(&mut lose)).expect("the CPU goes on")
}

#[test]
fn a_device_lost_on_the_way_leaves_the_same_bytes() {
    let mesh = sample("statue", Some(SAMPLE_FACES)).expect("a sample");
    for metric in METRICS {
        let reference = contract(&mesh, &options(metric), Budget::keep(0.05));
        for (rounds, replays) in [(1, true), (2, true), (1, false), (2, false)] {
            let Some(device) = gpu(&many_rounds(replays)) else { return };
            let mut outcome = lose_after(&device, &mesh, metric, rounds);
            let name = format!("{metric:?}, lost after {rounds}, {replays}");
            assert_eq!(outcome.warnings.len(), 1, "{name}: {:?}", outcome.warnings);
            assert!(
                outcome.warnings[0].starts_with("the CPU went on where the GPU failed: "),
                "{:?}",
                outcome.warnings
            );
            outcome.warnings.clear();
            assert_same(&name, &reference, &outcome);
            let on_gpu: Vec<bool> = outcome.rounds.iter().map(|round| round.on_gpu).collect();
            assert!(
                on_gpu[..rounds].iter().all(|on| *on) && !on_gpu[rounds + 1..].contains(&true),
                "{name}: {on_gpu:?}"
            );
        }
    }
}

/// A wavy plane of 40 × 40 squares whose texture is in charts of 5 × 5: seams meet at every corner of these.
fn charts() -> Mesh {
    let (width, side) = (40, 5);
    let mut mesh = shapes::plane(width, width);
    mesh.positions.iter_mut().for_each(|p| p.z = 0.1 * ((9.0 * p.x).sin() + (7.0 * p.y).cos()));
    let at = |(f, face): (usize, &[u32; 3])| {
        let square = f as u32 / 2;
        let chart = Vec2::new((square % width / side) as f32, (square / width / side) as f32);
        face.map(|v| Vec2::new((v % (width + 1)) as f32, (v / (width + 1)) as f32) + 100.0 * chart)
    };
    mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
    mesh
}

/// A run in which more seams yield begins where another was, on the device that failed since.
#[test]
fn a_device_lost_before_a_run_is_taken_up_is_told_of_once() {
    let (mesh, options) = (charts(), Options::default());
    let attributes = Attributes { seams: Seams::Hold, ..Attributes::default() };
    let held = contract(&mesh, &Options { attributes, ..options.clone() }, Budget::faces(2));
    let budget = || Budget::faces(held.mesh.faces.len() - 20);
    let reference = contract(&mesh, &options, budget());
    assert_eq!(reference.warnings.len(), 1, "{:?}", reference.warnings);
    for replays in [true, false] {
        let few = GpuOptions { handover_faces: Some(100), ..many_rounds(replays) };
        let Some(device) = gpu(&few) else { return };
        let mut faces = Vec::new();
        let mut lose = |progress: Progress| {
            if faces.is_empty() {
                device.lose_gpu();
            }
            faces.push(progress.faces);
            ControlFlow::Continue(())
        };
        let method = Method::Contract(options.clone());
        let outcome = simplify(&mesh, &method, &budget(), &device, Some(&mut lose)).expect("the CPU goes on");
        assert!(outcome.rounds[0].on_gpu && !outcome.rounds[2..].iter().any(|round| round.on_gpu));
        assert!(!faces.is_sorted_by(|a, b| a >= b), "one run: {faces:?}");
        let failed = |warning: &&String| warning.starts_with("the CPU went on where the GPU failed: ");
        assert_eq!(outcome.warnings.iter().filter(failed).count(), 1, "{:?}", outcome.warnings);
        let warnings: Vec<String> = outcome.warnings.iter().filter(|warning| !failed(warning)).cloned().collect();
        assert_same("taken up", &reference, &Outcome { warnings, ..outcome });
    }
}

/// A device lost before the run is one that fails at once.
#[test]
fn a_device_lost_before_leaves_the_same_bytes() {
    let Some(device) = gpu(&GpuOptions::default()) else { return };
    device.lose_gpu();
    let mesh = sample("part", Some(10_000)).expect("a sample");
    let reference = contract(&mesh, &options(Metric::Volume), Budget::keep(0.05));
    let mut outcome = contract_on(&device, &mesh, &options(Metric::Volume), Budget::keep(0.05));
    assert!(outcome.warnings.len() == 1 && outcome.device == device.cpu_description(), "{:?}", outcome.warnings);
    outcome.warnings.clear();
    assert_same("lost before", &reference, &outcome);
}

/// From a limit that the self-test just passes to one that holds all: the fault comes at one allocation after the other.
#[test]
fn too_little_memory_leaves_the_same_bytes() {
    if gpu(&GpuOptions::default()).is_none() {
        return;
    }
    let mesh = sample("part", Some(30_000)).expect("a sample");
    for metric in METRICS {
        let reference = contract(&mesh, &options(metric), Budget::keep(0.3));
        let (mut failed, mut complete) = (0, 0);
        for limit in [1_300_000, 1_700_000, 2_400_000, 3_400_000, 5_000_000, 1 << 30] {
            let limited = GpuOptions { memory_limit: Some(limit), ..GpuOptions::default() };
            let Ok(device) = open_gpu(&limited) else { continue };
            let mut outcome = contract_on(&device, &mesh, &options(metric), Budget::keep(0.3));
            println!("{metric:?} {limit}: {:?}", outcome.warnings);
            if outcome.warnings.is_empty() {
                complete += 1;
                assert!(outcome.rounds[0].on_gpu, "{limit}");
            } else {
                failed += 1;
                assert!(outcome.warnings[0].contains("memory limit"), "{limit}: {:?}", outcome.warnings);
            }
            outcome.warnings.clear();
            assert_same(&format!("{metric:?}, {limit} bytes"), &reference, &outcome);
            assert_eq!(device.gpu_bytes(), 0, "{limit}: buffers outlive the run");
        }
        assert!(failed >= 2 && complete >= 1, "{metric:?}: {failed} runs short of memory, {complete} complete");
    }
}

// Real meshes

#[test]
fn real_meshes_return_the_same_bytes() {
    if !asked("COARSEN_LONG") {
        println!("skipped: COARSEN_LONG=1 compares devices on real meshes");
        return;
    }
    let threads = cpu(2);
    let graphics = gpu(&GpuOptions::default());
    let mut compared = 0;
    for path in models::all() {
        let Ok(mesh) = formats::read(&path) else { continue };
        if mesh.faces.len() > 1_000_000 {
            continue;
        }
        for (metric, share) in METRICS.iter().flat_map(|&metric| SHARES.map(|share| (metric, share))) {
            let run = |device: &Device| {
                simplify(&mesh, &Method::Contract(options(metric)), &Budget::keep(share), device, None)
            };
            let Ok(reference) = run(&cpu(1)) else { continue };
            for device in [Some(&threads), graphics.as_ref(), graphics.as_ref()].into_iter().flatten() {
                let name = format!("{} {metric:?}, {}", path.display(), device.description());
                assert_same(&name, &reference, &run(device).expect("the CPU could"));
            }
            compared += 1;
        }
    }
    println!("{compared} runs compared");
    assert!(compared > 0 || models::all().is_empty(), "no model could be read");
}
