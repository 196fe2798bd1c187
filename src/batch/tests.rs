//! Whole runs over small files: faults in the work, what a run that goes on does again, and that nothing reaches the bytes.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::time::Duration;

use super::*;
use crate::backend::Selector;
use crate::formats::{self, WriteOptions};
use crate::mesh::{Mesh, sample, shapes};
use crate::simplify::{Budget, Method, OnProgress, Outcome};

const FILES: [&str; 5] = ["a/one.ply", "a/two.obj", "b/one.ply", "b/three.stl", "four.off.gz"];

/// A folder with meshes in `in`.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    for (i, file) in FILES.iter().enumerate() {
        let path = dir.path().join("in").join(file);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        let mesh = sample(["part", "terrain"][i % 2], Some(1000 + 400 * i)).expect("a sample");
        formats::write(&mesh, &path, &WriteOptions::default()).expect("a file");
    }
    dir
}

fn recipe() -> Recipe {
    Recipe {
        method: Method::default(),
        budgets: vec![Budget::keep(0.5), Budget::keep(0.1)],
        writing: WriteOptions::default(),
        pattern: Pattern::for_levels(2),
        timeout: None,
        weights: None,
        measure: None,
    }
}

fn plan(dir: &Path, out: &str, recipe: Recipe, shard: Shard) -> Plan {
    let requests = [Request::new(dir.join("in").display().to_string(), 0)];
    Plan::new(&requests, vec![recipe], &dir.join(out), shard).expect("a plan")
}

const RESUME: Options = Options { resume: true, overwrite: false, memory_limit: None, memory_shared: None };

fn go(plan: &Plan, options: Options) -> Summary {
    run(plan, &Device::cpu(2).expect("threads"), &options, &|_| ControlFlow::Continue(())).expect("a run")
}

/// The files in `out` but the records and locks, with their bytes.
fn contents(dir: &Path, out: &str) -> BTreeMap<String, Vec<u8>> {
    fn collect(root: &Path, folder: &Path, found: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                collect(root, &path, found);
            } else if path.extension().is_none_or(|kind| kind != "jsonl" && kind != "lock") {
                let name = path.strip_prefix(root).expect("inside").display().to_string();
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    let mut found = BTreeMap::new();
    collect(&dir.join(out), &dir.join(out), &mut found);
    found
}

/// What an undisturbed run writes.
fn undisturbed(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let summary = go(&plan(dir, "whole", recipe(), Shard::WHOLE), Options::default());
    assert_eq!((summary.done, summary.failed.len(), summary.left), (FILES.len(), 0, 0), "{summary:?}");
    let contents = contents(dir, "whole");
    assert_eq!(contents.len(), 2 * FILES.len());
    assert!(contents.contains_key("a/one-1.ply") && contents.contains_key("four-2.off.gz"));
    contents
}

#[test]
fn nothing_but_a_file_and_its_recipe_reaches_the_bytes() {
    let dir = folder();
    let whole = undisturbed(dir.path());
    // Each alone, on another number of threads.
    for (file, outputs) in FILES.iter().zip([["a/one-1.ply", "a/one-2.ply"], ["a/two-1.obj", "a/two-2.obj"]]) {
        let mesh = formats::read(&dir.path().join("in").join(file)).expect("a mesh");
        let device = Device::cpu(3).expect("threads");
        let levels = simplify_levels(&mesh, &Method::default(), &recipe().budgets, &device, None).expect("levels");
        for (level, output) in levels.iter().zip(outputs) {
            let path = dir.path().join(format!("alone.{}", output.rsplit('.').next().expect("an extension")));
            formats::write(&level.mesh, &path, &WriteOptions::default()).expect("a file");
            assert!(fs::read(&path).expect("a file") == whole[output], "{output}");
        }
    }
    for number in 1..=3 {
        let plan = plan(dir.path(), "shards", recipe(), Shard::new(number, 3).expect("a shard"));
        assert_eq!(go(&plan, Options::default()).done, plan.jobs().len());
    }
    assert!(contents(dir.path(), "shards") == whole);
    let tight = Options { memory_shared: Some(1), ..Options::default() };
    assert_eq!(go(&plan(dir.path(), "tight", recipe(), Shard::WHOLE), tight).done, FILES.len());
    assert!(contents(dir.path(), "tight") == whole);
}

/// Panics for meshes from b/one.ply, else does the work.
fn panics_once(
    mesh: &Mesh,
    method: &Method,
    budgets: &[Budget],
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Outcome>> {
    let faces = sample("part", Some(1800)).expect("a sample").faces.len();
    assert!(mesh.faces.len() != faces, "a fault of the program");
    simplify_levels(mesh, method, budgets, device, progress)
}

#[test]
fn a_panic_is_a_failure_of_its_file_alone_and_is_mended_by_going_on() {
    let dir = folder();
    let whole = undisturbed(dir.path());
    let plan = plan(dir.path(), "out", recipe(), Shard::WHOLE);
    let device = Device::cpu(2).expect("threads");
    let observe = |_: Event<'_>| ControlFlow::Continue(());
    let summary = run_with(&plan, &device, &Options::default(), &observe, &panics_once).expect("a run");
    assert_eq!(summary.reasons(), [(Reason::Panicked, 1)]);
    assert_eq!((summary.done, summary.failed[0].0.as_str()), (FILES.len() - 1, "b/one.ply"));
    assert_eq!(summary.failed[0].1.message, "a fault of the program");
    assert_eq!(contents(dir.path(), "out").len(), whole.len() - 2);
    let records = fs::read_to_string(plan.ledger()).expect("records");
    assert_eq!(records.lines().count(), whole.len());
    assert_eq!(records.matches("\"reason\":\"panicked\"").count(), 2);

    let summary = go(&plan, RESUME);
    assert_eq!((summary.done, summary.skipped, summary.failed.len()), (1, FILES.len() - 1, 0));
    assert!(contents(dir.path(), "out") == whole);
}

#[test]
fn what_does_not_agree_with_its_record_is_done_again() {
    let dir = folder();
    let whole = undisturbed(dir.path());
    let out = dir.path().join("whole");
    let go_on = |recipe: Recipe| {
        let summary = go(&plan(dir.path(), "whole", recipe, Shard::WHOLE), RESUME);
        (summary.done, summary.skipped)
    };
    assert_eq!(go_on(recipe()), (0, 5));

    fs::remove_file(out.join("a/one-2.ply")).expect("a file gone");
    fs::write(out.join("a/two-1.obj"), "half").expect("a file cut short");
    fs::write(out.join(".b-1.ply.1-2.tmp"), "another's").expect("a file");
    fs::write(out.join(".four-1.off.gz.4711-0.tmp"), "left").expect("a file");
    assert_eq!(go_on(recipe()), (2, 3));
    let mut mended = contents(dir.path(), "whole");
    assert_eq!(mended.remove(".b-1.ply.1-2.tmp").as_deref(), Some(&b"another's"[..]));
    assert!(mended == whole, "{:?}", mended.keys());

    // Another input of the same name, other options.
    let other = sample("assembly", Some(1000)).expect("a sample");
    formats::write(&other, &dir.path().join("in/b/one.ply"), &WriteOptions::default()).expect("a file");
    assert_eq!(go_on(recipe()), (1, 4));
    let coarser = Recipe { budgets: vec![Budget::keep(0.5), Budget::keep(0.2)], ..recipe() };
    assert_eq!((go_on(coarser.clone()), go_on(coarser)), ((5, 0), (0, 5)));
}

#[test]
fn an_end_at_any_event_leaves_what_going_on_completes() {
    let dir = folder();
    let whole = undisturbed(dir.path());
    let device = Device::cpu(2).expect("threads");
    for most in [0, 1, 3, 8, 20, 40] {
        let out = format!("out-{most}");
        let plan = plan(dir.path(), &out, recipe(), Shard::WHOLE);
        let seen = Mutex::new(0);
        let observe = |_: Event<'_>| {
            let mut seen = seen.lock().expect("a lock");
            *seen += 1;
            if *seen > most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let ended = run(&plan, &device, &Options::default(), &observe).expect("a run");
        assert_eq!(ended.done + ended.left, FILES.len(), "{ended:?}");
        assert!(ended.failed.is_empty() && (most > 3 || ended.left > 0), "{ended:?}");
        assert!(contents(dir.path(), &out).iter().all(|(name, bytes)| whole[name] == *bytes));
        let summary = go(&plan, RESUME);
        assert_eq!((summary.done, summary.skipped), (ended.left, ended.done));
        assert!(contents(dir.path(), &out) == whole);
    }
}

#[test]
fn files_that_cannot_be_done_are_told_by_reason_and_stop_no_other() {
    let dir = folder();
    let input = dir.path().join("in");
    fs::write(input.join("prose.ply"), "once upon a time").expect("a file");
    fs::write(input.join("cut.stl"), vec![0; 90]).expect("a file");
    fs::write(input.join("gone.obj"), "f 1 2 3\n").expect("a file");
    let plan = plan(dir.path(), "out", recipe(), Shard::WHOLE);
    fs::remove_file(input.join("gone.obj")).expect("a file gone");
    let summary = go(&plan, Options::default());
    assert_eq!(summary.reasons(), [(Reason::Unreadable, 1), (Reason::Malformed, 2)]);
    assert_eq!(
        summary.failed.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        ["cut.stl", "gone.obj", "prose.ply"]
    );
    assert_eq!(summary.done, FILES.len());
    // What failed is tried again.
    assert_eq!(go(&plan, RESUME).failed.len(), 3);
}

#[test]
fn memory_and_time_are_limits_of_each_file() {
    let dir = folder();
    let limit = BYTES_ALWAYS + bytes_needed(1500, false) + bytes_of_levels(1500, &recipe().budgets);
    let options = Options { memory_limit: Some(limit), ..Options::default() };
    let summary = go(&plan(dir.path(), "memory", recipe(), Shard::WHOLE), options);
    assert_eq!((summary.done, summary.reasons()), (2, vec![(Reason::Memory, 3)]));
    assert!(summary.failed[0].1.message.contains("more than the limit of 65 MiB"), "{summary:?}");

    let hasty = Recipe { timeout: Some(Duration::from_nanos(1)), ..recipe() };
    let summary = go(&plan(dir.path(), "time", hasty, Shard::WHOLE), Options::default());
    assert_eq!((summary.done, summary.reasons()), (0, vec![(Reason::Timeout, 5)]));
    assert!(contents(dir.path(), "time").is_empty());
}

/// A file that is no mesh at all is refused for its size alone: it was never read.
#[test]
fn what_does_not_fit_while_it_is_read_is_not_read() {
    let dir = folder();
    fs::write(dir.path().join("in/large.ply"), vec![b'x'; 1 << 20]).expect("a file");
    let run = |out: &str, memory| {
        let options = Options { memory_limit: Some(BYTES_ALWAYS + memory), ..Options::default() };
        go(&plan(dir.path(), out, recipe(), Shard::WHOLE), options)
    };
    let enough = run("enough", 5 << 19);
    assert_eq!((enough.done, enough.reasons()), (5, vec![(Reason::Malformed, 1)]));
    let less = run("less", (5 << 19) - 1);
    assert_eq!(less.reasons(), [(Reason::Memory, 1)]);
    assert!(less.failed[0].1.message.starts_with("reading it takes about 67 MiB"), "{less:?}");
}

#[test]
fn an_earlier_run_is_neither_replaced_nor_resumed_unasked() {
    let dir = folder();
    undisturbed(dir.path());
    let device = Device::cpu(1).expect("a thread");
    let observe = |_: Event<'_>| ControlFlow::Continue(());
    let plan = plan(dir.path(), "whole", recipe(), Shard::WHOLE);
    let refused = |options| run(&plan, &device, &options, &observe).map_err(|error| error.to_string());
    let error = refused(Options::default()).expect_err("records are there");
    assert!(error.contains("coarsen.jsonl': it exists"), "{error}");
    fs::remove_file(plan.ledger()).expect("a file gone");
    let error = refused(Options::default()).expect_err("outputs are there");
    assert!(error.contains("a/one-1.ply': it exists"), "{error}");
    assert_eq!(refused(Options { overwrite: true, ..Options::default() }).map(|summary| summary.done), Ok(5));
}

/// The bytes of a glTF lie beside it: they are neither replaced unasked, nor trusted when they have changed.
#[test]
fn what_lies_beside_outputs_belongs_to_them() {
    let dir = folder();
    let apart = || Recipe { pattern: Pattern::new("{dir}/{stem}-{level}.gltf").expect("a pattern"), ..recipe() };
    let plan = plan(dir.path(), "apart", apart(), Shard::WHOLE);
    let count = plan.jobs().len();
    assert_eq!(go(&plan, Options::default()).done, count);
    let beside = dir.path().join("apart/a/one-1.bin");
    let bytes = fs::read(&beside).expect("bytes");
    assert_eq!(go(&plan, RESUME).skipped, count);
    for broken in [None, Some(&bytes[..bytes.len() / 2])] {
        match broken {
            None => fs::remove_file(&beside).expect("a file gone"),
            Some(half) => fs::write(&beside, half).expect("written"),
        }
        let summary = go(&plan, RESUME);
        assert_eq!((summary.done, summary.skipped), (1, count - 1), "{summary:?}");
        assert!(fs::read(&beside).is_ok_and(|again| again == bytes));
    }
    fs::remove_file(plan.ledger()).expect("a file gone");
    let outputs = plan.jobs().iter().flat_map(|job| &job.outputs);
    outputs.for_each(|output| fs::remove_file(plan.folder().join(output)).expect("a file gone"));
    let device = Device::cpu(1).expect("a thread");
    let refused = run(&plan, &device, &Options::default(), &|_: Event<'_>| ControlFlow::Continue(()));
    let error = refused.expect_err("bytes are there").to_string();
    assert!(error.contains(".bin': it exists"), "{error}");
}

/// Bytes of a glTF, libraries and pictures of an OBJ: what goes into an output counts as the input's own bytes do.
#[test]
fn what_lies_beside_inputs_belongs_to_them() {
    let dir = tempfile::tempdir().expect("a folder");
    let input = |name: &str| dir.path().join("in").join(name);
    fs::create_dir(dir.path().join("in")).expect("a folder");
    let [small, large] = [1000, 1400].map(|faces| sample("part", Some(faces)).expect("a sample"));
    let write = |mesh: &Mesh| formats::write(mesh, &input("one.gltf"), &WriteOptions::default()).expect("a file");
    let mut moved = large.clone();
    moved.positions.iter_mut().for_each(|position| *position *= 2.0);
    write(&moved);
    let moved = fs::read(input("one.bin")).expect("bytes");
    write(&large);
    formats::write(&small, &input("plain.ply"), &WriteOptions::default()).expect("a file");
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n";
    let faces = "f 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 3/1 1/2 4/3\n";
    let obj = format!("mtllib a.mtl b.mtl\nusemtl red\n{corners}{faces}");
    fs::write(input("two.obj"), obj).expect("a file");
    let made = |out: &str, options: Options| {
        let apart = Recipe { pattern: Pattern::new("{stem}-{level}.glb").expect("a pattern"), ..recipe() };
        let plan = plan(dir.path(), out, apart, Shard::WHOLE);
        let summary = go(&plan, options);
        assert_eq!((summary.failed.len(), summary.left), (0, 0), "{summary:?}");
        (summary.done, contents(dir.path(), out))
    };
    assert_eq!(made("out", Options::default()).0, 3);
    assert_eq!(made("out", RESUME).0, 0);
    let library = |color: &str| format!("newmtl red\nKd {color}\nmap_Kd where\\it\\was\\p.png\n").into_bytes();
    let picture = |end: &[u8]| [b"\x89PNG\r\n\x1a\n", end].concat();
    let changes = [
        ("one.bin", moved),
        ("a.mtl", b"newmtl blue\n".to_vec()),
        ("b.mtl", library("1 0 0")),
        ("b.mtl", library("0 1 0")),
        ("p.png", picture(b"one")),
        ("p.png", picture(b"two")),
    ];
    for (number, (name, bytes)) in changes.iter().enumerate() {
        fs::write(input(name), bytes).expect("a file");
        let (done, resumed) = made("out", RESUME);
        let (_, whole) = made(&format!("whole-{number}"), Options::default());
        assert!(done == 1 && resumed == whole, "{name}: {done} done");
        assert_eq!(made("out", RESUME).0, 0, "{name}");
    }
}

#[test]
fn what_is_left_of_long_names_is_removed() {
    let dir = tempfile::tempdir().expect("a folder");
    let name = format!("{}.ply", "x".repeat(240));
    for folder in ["in", "out"] {
        fs::create_dir(dir.path().join(folder)).expect("a folder");
    }
    let mesh = sample("part", Some(1000)).expect("a sample");
    formats::write(&mesh, &dir.path().join("in").join(&name), &WriteOptions::default()).expect("a file");
    let stem = formats::temporary_stem(name.as_ref()).to_string_lossy().into_owned();
    let [own, other] = [stem, "y".repeat(97)].map(|stem| dir.path().join("out").join(format!(".{stem}.1-0.tmp")));
    [&own, &other].iter().for_each(|path| fs::write(path, "torn").expect("a file"));
    let one = Recipe { budgets: vec![Budget::keep(0.5)], pattern: Pattern::for_levels(1), ..recipe() };
    assert_eq!(go(&plan(dir.path(), "out", one, Shard::WHOLE), RESUME).done, 1);
    assert!(!own.exists() && other.exists() && dir.path().join("out").join(name).exists());
}

/// A closed surface has four faces at least, and a touching one warns.
#[test]
fn files_that_are_short_or_warned_about_are_counted() {
    let dir = tempfile::tempdir().expect("a folder");
    fs::create_dir_all(dir.path().join("in")).expect("a folder");
    let write = |name: &str, mesh: &Mesh| {
        formats::write(mesh, &dir.path().join("in").join(name), &WriteOptions::default()).expect("a file");
    };
    let ball = shapes::icosphere(1);
    write("whole.ply", &ball);
    let mut twice = ball;
    twice.faces.push(twice.faces[0]);
    write("twice.ply", &twice);
    let few = Recipe { budgets: vec![Budget::keep(0.5), Budget::faces(2)], ..recipe() };
    let summary = go(&plan(dir.path(), "few", few, Shard::WHOLE), Options::default());
    assert_eq!((summary.done, summary.missed, summary.warned), (2, 2, 1), "{summary:?}");
    let half = Recipe { budgets: vec![Budget::keep(0.5)], pattern: Pattern::for_levels(1), ..recipe() };
    let summary = go(&plan(dir.path(), "half", half, Shard::WHOLE), Options::default());
    assert_eq!((summary.done, summary.missed, summary.warned), (2, 0, 1), "{summary:?}");
}

#[expect(clippy::print_stdout, reason = "a skip must be seen")]
#[test]
fn a_lost_device_changes_no_byte() {
    let dir = tempfile::tempdir().expect("a folder");
    let requests = ["sample:statue@120k", "sample:part@5k"].map(|text| Request::new(text, 0));
    let go = |out: &str, device: &Device| {
        let plan = Plan::new(&requests, vec![recipe()], &dir.path().join(out), Shard::WHOLE).expect("a plan");
        let lose = |event: Event<'_>| {
            if matches!(event, Event::Progress { .. }) {
                device.lose_gpu();
            }
            ControlFlow::Continue(())
        };
        let summary = run(&plan, device, &Options::default(), &lose).expect("a run");
        assert_eq!((summary.done, summary.failed.len()), (2, 0), "{summary:?}");
        (contents(dir.path(), out), fs::read_to_string(plan.ledger()).expect("records"))
    };
    let Ok(gpu) = Device::open(&Selector::Software, 2) else {
        return println!("skipped: no software adapter");
    };
    let (lost, records) = go("gpu", &gpu);
    assert!(records.contains("\"warnings\":[\""), "{records}");
    assert!(lost == go("cpu", &Device::cpu(2).expect("threads")).0);
}
