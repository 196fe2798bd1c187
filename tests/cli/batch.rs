//! Many files in one run: what it writes and tells, and that nothing that ends it costs more than what was at work.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use coarsen::formats::{self, WriteOptions};
use coarsen::mesh::samples::sample;
use serde_json::Value;

use crate::{Dir, Ran};

/// Makes `count` meshes below `in`, of the sizes given and larger.
fn inputs(dir: &Dir, count: usize, faces: usize) {
    for i in 0..count {
        let mesh = sample(["part", "terrain", "statue"][i % 3], Some(faces + 700 * i)).expect("a sample");
        let path = dir.path("in").join(["", "deep"][i % 2]).join(format!("{i}.{}", ["ply", "stl", "obj"][i / 2 % 3]));
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        formats::write(&mesh, &path, &WriteOptions::default()).expect("a file");
    }
}

/// The files below `folder`, temporary ones, records and locks left out, with their bytes.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(inner) = folders.pop() {
        for path in fs::read_dir(inner).into_iter().flatten().flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                folders.push(path);
            } else if !path.extension().is_some_and(|kind| kind == "jsonl" || kind == "tmp" || kind == "lock") {
                let name = path.strip_prefix(folder).expect("inside").display().to_string();
                found.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

/// Whether a temporary file is left below `folder`.
fn has_leftovers(folder: &Path) -> bool {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).any(|path| {
        if path.is_dir() { has_leftovers(&path) } else { path.extension().is_some_and(|extension| extension == "tmp") }
    })
}

/// The whole lines of a file of records; the last may be torn.
fn records(path: &Path) -> Vec<Value> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let whole = text.rfind('\n').map_or("", |end| &text[..=end]);
    whole.lines().map(|line| serde_json::from_str(line).expect("a line of JSON")).collect()
}

fn batch(dir: &Dir, out: &str, more: &str) -> Ran {
    dir.run(&format!("batch in -d {out} -r 50%,10% -g cpu {more}"))
}

/// What an undisturbed run writes.
fn undisturbed(dir: &Dir, files: usize) -> BTreeMap<String, Vec<u8>> {
    batch(dir, "whole", "-j 2").succeeds();
    let whole = contents(&dir.path("whole"));
    assert_eq!(whole.len(), 2 * files);
    whole
}

#[test]
fn a_run_writes_levels_and_records_and_goes_on() {
    let dir = Dir::new();
    inputs(&dir, 4, 1000);
    dir.file("in/broken.ply", "ply\nformat");
    let ran = batch(&dir, "out", "");
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    for part in [
        "warning: 'broken.ply': PLY",
        "failed        files",
        "malformed         1  broken.ply: PLY",
        "4 of 5 files done, 1 short of what was asked for, 1 failed",
    ] {
        assert!(ran.err.contains(part), "{part} is not in {}", ran.err);
    }
    let names: Vec<String> = contents(&dir.path("out")).into_keys().collect();
    let expected =
        ["0-1.ply", "0-2.ply", "2-1.stl", "2-2.stl", "deep/1-1.ply", "deep/1-2.ply", "deep/3-1.stl", "deep/3-2.stl"];
    assert_eq!(names, expected);
    let lines = records(&dir.path("out/coarsen.jsonl"));
    assert_eq!(lines.len(), 10);
    let line = |output: &str| lines.iter().find(|line| line["output"] == output).expect("a record");
    let (done, failed) = (line("deep/1-2.ply"), line("broken-1.ply"));
    assert_eq!((&done["status"], &done["input"], &done["level"]), (&"done".into(), &"deep/1.ply".into(), &2.into()));
    let faces = sample("terrain", Some(1700)).expect("a sample").faces.len();
    assert_eq!(done["faces_in"], faces);
    assert_eq!((&done["reached"], &done["stop_reason"]), (&true.into(), &"faces_reached".into()));
    assert_eq!((&failed["status"], &failed["reason"]), (&"failed".into(), &"malformed".into()));

    let before = contents(&dir.path("out"));
    batch(&dir, "out", "").fails(8, &["coarsen.jsonl': it exists"]);
    let ran = batch(&dir, "out", "--resume --json");
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    let told = ran.json();
    assert_eq!((&told["done"], &told["skipped"], &told["reasons"]["malformed"]), (&0.into(), &4.into(), &1.into()));
    fs::remove_file(dir.path("in/broken.ply")).expect("a file gone");
    batch(&dir, "out", "-w -j 1").succeeds();
    assert!(contents(&dir.path("out")) == before);
}

#[test]
fn wrong_lines_are_refused_before_anything_is_made() {
    let dir = Dir::new();
    inputs(&dir, 2, 1000);
    for (line, code, part) in [
        ("batch in -d out", 2, "no levels"),
        ("batch in -d out -r 50%,50%", 2, "given twice"),
        ("batch in -d out -r 50%,10% --pattern {stem}.{ext}", 2, "'0.ply' is the output of both"),
        ("batch in -d out -r 50% --pattern {faces}.ply", 2, "{faces} in a pattern needs numbers of faces"),
        ("batch in -d out -r 50% --pattern {stem}.fbx", 5, "'.fbx'"),
        ("batch in -d in -r 50%", 2, "names only files in the folder of outputs"),
        ("batch in/0.ply -d in -r 50%", 2, "'0.ply' is an input as well"),
        ("batch nothing/*.ply -d out -r 50%", 2, ".gltf and .glb"),
        ("batch in nothing -d out -r 50%", 4, "cannot read 'nothing': No such file"),
        ("batch in -d out -r 50% --grid 3", 2, ""),
        ("batch in -d out -r 50% -w --resume", 2, ""),
        ("batch in -d out -r 50% --shard 4/3", 2, ""),
        ("batch in -d in/0.ply -r 50%", 8, "cannot write 'in/0.ply': a file, where a folder is needed"),
        ("batch --manifest none.jsonl -d out -r 50%", 4, "cannot read 'none.jsonl'"),
    ] {
        let ran = dir.run(line);
        assert_eq!(ran.code, Some(code), "{line}: {}", ran.err);
        assert!(ran.err.contains(part), "{line}: {}", ran.err);
        assert!(!dir.path("out").exists(), "{line}");
    }
}

#[test]
fn a_manifest_has_options_of_its_own_for_each_file() {
    let dir = Dir::new();
    inputs(&dir, 2, 1000);
    let lines = "{\"input\": \"in/0.ply\", \"faces\": 300, \"pattern\": \"special/{stem}_{faces}.obj\"}\n\
        {\"input\": \"in/deep/1.ply\"}\n{\"input\": \"in/gone.ply\"}\n";
    dir.file("jobs.jsonl", lines);
    let ran = dir.run("batch --manifest jobs.jsonl -d out -r 50%,25% -g cpu");
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    assert!(ran.err.contains("unreadable        1  gone.ply: cannot read"), "{}", ran.err);
    let names: Vec<String> = contents(&dir.path("out")).into_keys().collect();
    assert_eq!(names, ["deep/1-1.ply", "deep/1-2.ply", "special/0_300.obj"]);
    let mesh = formats::read(&dir.path("out/special/0_300.obj")).expect("a mesh");
    assert_eq!(mesh.faces.len(), 300);
}

#[test]
fn weights_and_measures_are_those_of_a_run_of_its_own() {
    let dir = Dir::new();
    fs::create_dir(dir.path("in")).expect("a folder");
    dir.run("simplify sample:part@3k in/0.ply -r 90% --write-feature in/weighed.ply -q").succeeds();
    fs::rename(dir.path("in/weighed.ply"), dir.path("in/1.ply")).expect("a file to move");
    let weights =
        (0..formats::read(&dir.path("in/0.ply")).expect("a mesh").positions.len()).map(|i| format!("{}\n", i % 7 + 1));
    dir.file("w.txt", weights.collect::<String>());
    let lines = "{\"input\": \"in/0.ply\", \"weight\": \"w.txt\", \"measure\": true}\n\
        {\"input\": \"in/1.ply\", \"weight\": \"ply:feature\"}\n";
    dir.file("jobs.jsonl", lines);
    dir.run("batch --manifest jobs.jsonl -d out -r 20% -g cpu -q").succeeds();
    let told = dir.run("simplify in/0.ply one.ply -r 20% --weight w.txt --measure -g cpu -q --json").succeeds().json();
    dir.run("simplify in/1.ply two.ply -r 20% --weight ply:feature -g cpu -q").succeeds();
    for (own, of_batch) in [("one.ply", "out/0.ply"), ("two.ply", "out/1.ply")] {
        let [own, of_batch] = [own, of_batch].map(|name| fs::read(dir.path(name)).expect("a file"));
        assert!(own == of_batch);
    }
    let lines = records(&dir.path("out/coarsen.jsonl"));
    let line = |input: &str| lines.iter().find(|line| line["input"] == input).expect("a record");
    assert_eq!(line("0.ply")["error"], told["error"]);
    assert!(line("0.ply")["error"]["measured"]["rms"].as_f64().is_some_and(|rms| rms > 0.0));
    assert!(line("1.ply")["error"]["measured"].is_null());

    // Other weights are other options.
    dir.file("w.txt", "1\n2\n");
    let ran = dir.run("batch --manifest jobs.jsonl -d out -r 20% -g cpu --resume");
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    assert!(ran.err.contains("options           1  0.ply: ") && ran.err.contains("1 done before"), "{}", ran.err);
}

#[test]
fn compressed_files_are_refused_by_what_they_hold() {
    let dir = Dir::new();
    fs::create_dir(dir.path("in")).expect("a folder");
    let mesh = sample("statue", Some(200_000)).expect("a sample");
    formats::write(&mesh, &dir.path("in/a.obj.gz"), &WriteOptions::default()).expect("a file");
    formats::write(&mesh, &dir.path("in/b.obj.zst"), &WriteOptions::default()).expect("a file");
    let ran = batch(&dir, "out", "--memory-limit 80MiB");
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    for part in ["'a.obj.gz': reading it takes about", "'b.obj.zst': limit: it holds more than", "memory            2"]
    {
        assert!(ran.err.contains(part), "{part} is not in {}", ran.err);
    }
    let refused = dir.run("simplify in/a.obj.gz out.ply -r 10% --memory-limit 80MiB");
    refused.fails(6, &["reading 'in/a.obj.gz' takes about", "more than the memory limit of 80 MiB"]);
}

#[test]
fn progress_is_told_as_lines_of_json() {
    let dir = Dir::new();
    inputs(&dir, 3, 1000);
    let ran = batch(&dir, "out", "--progress json").succeeds();
    let events: Vec<Value> = ran
        .err
        .lines()
        .filter(|line| line.starts_with('{'))
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let of = |kind: &str| events.iter().filter(|event| event["event"] == kind).count();
    assert_eq!((of("started"), of("finished")), (3, 3), "{}", ran.err);
    let last = events.last().expect("an event");
    assert_eq!((&last["files_ended"], &last["files"], &last["seconds_left"]), (&3.into(), &3.into(), &0.0.into()));
}

#[test]
fn shards_write_together_what_one_run_writes_and_know_of_each_other() {
    let dir = Dir::new();
    inputs(&dir, 7, 1000);
    let whole = undisturbed(&dir, 7);
    for number in 1..=3 {
        batch(&dir, "out", &format!("--shard {number}/3")).succeeds();
    }
    assert!(contents(&dir.path("out")) == whole);
    assert!(dir.path("out/coarsen-3-of-3.jsonl").exists() && !dir.path("out/coarsen.jsonl").exists());
    let told = batch(&dir, "out", "--resume --json").succeeds().json();
    assert_eq!((&told["done"], &told["skipped"]), (&0.into(), &7.into()));
}

#[test]
fn a_shard_has_one_process_at_a_time_and_is_free_when_that_is_killed() {
    let dir = Dir::new();
    inputs(&dir, 3, 1000);
    let mut command = dir.command("batch sample:statue@2M -d out -r 50%,10% -g cpu -q --shard 1/1");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
    let lock = dir.path("out/.coarsen.jsonl.lock");
    while !fs::read_to_string(&lock).is_ok_and(|text| text.contains("process")) {
        thread::sleep(Duration::from_millis(1));
    }
    let who = format!("process {}", child.id());
    let refused = ["cannot write 'out/coarsen.jsonl'", &who, "wait for it, or end it"];
    batch(&dir, "out", "--resume").fails(8, &refused);
    batch(&dir, "out", "-w").fails(8, &refused);
    // It would write what the other does.
    batch(&dir, "out", "--shard 2/3").fails(8, &["'out/coarsen-2-of-3.jsonl'", &who, "at work on 'coarsen.jsonl'"]);
    assert!(contents(&dir.path("out")).is_empty() && child.try_wait().expect("a state").is_none());
    child.kill().expect("a process to kill");
    child.wait().expect("its end");
    batch(&dir, "out", "--resume").succeeds();
}

/// A number below `end`, the same in every run.
fn random(state: &mut u64, end: u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 33) % end
}

/// Kills runs at random moments, `COARSEN_KILLS` of them or a few; every one goes on with what the last left.
#[expect(clippy::print_stdout, reason = "a long run says how far it came")]
#[test]
fn whatever_is_killed_is_completed_by_going_on() {
    let kills: usize = std::env::var("COARSEN_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(4);
    let dir = Dir::new();
    inputs(&dir, 8, 1500);
    let clock = Instant::now();
    let whole = undisturbed(&dir, 8);
    let usual = clock.elapsed().as_micros() as u64;
    let out = dir.path("out");
    let (mut killed, mut complete, mut at_work, mut state) = (0, 0, 0, 7);
    while killed < kills {
        let mut command = dir.command("batch in -d out -r 50%,10% -g cpu -j 2 -q --resume");
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program");
        thread::sleep(Duration::from_micros(random(&mut state, usual / 2)));
        child.kill().expect("a process to kill");
        child.wait().expect("its end");
        at_work += usize::from(has_leftovers(&out));

        let found = contents(&out);
        for (name, bytes) in &found {
            assert!(whole[name] == *bytes, "{name} is half written");
        }
        for record in records(&out.join("coarsen.jsonl")) {
            let output = record["output"].as_str().expect("a name");
            assert!(record["status"] == "done" && found.contains_key(output), "told done: {record}");
        }
        if found.len() < whole.len() {
            killed += 1;
        } else {
            // It came too late, or was the last that was needed.
            complete += 1;
            fs::remove_dir_all(&out).expect("a folder gone");
        }
    }
    batch(&dir, "out", "--resume").succeeds();
    assert!(contents(&out) == whole && !has_leftovers(&out));
    let done = records(&out.join("coarsen.jsonl"));
    assert!(whole.keys().all(|name| done.iter().any(|record| record["output"] == *name)));
    println!("{killed} kills, {at_work} with a file half written, {complete} after the last file");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_a_folder_that_can_be_completed() {
    let dir = Dir::new();
    inputs(&dir, 8, 3000);
    let whole = undisturbed(&dir, 8);
    let mut command = dir.command("batch in -d out -r 50%,10% -g cpu -j 1");
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program");
    while records(&dir.path("out/coarsen.jsonl")).is_empty() {
        thread::sleep(Duration::from_millis(1));
    }
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill").success());
    let ran = Ran::of(child.wait_with_output().expect("its end"));
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    assert!(ran.err.contains("left for --resume"), "{}", ran.err);
    let found = contents(&dir.path("out"));
    assert!(found.len() < whole.len() && !has_leftovers(&dir.path("out")));
    assert!(found.iter().all(|(name, bytes)| whole[name] == *bytes));
    batch(&dir, "out", "--resume").succeeds();
    assert!(contents(&dir.path("out")) == whole);
}

/// A disk of its own for the program, full at first, then larger.
#[cfg(target_os = "linux")]
#[expect(clippy::print_stdout, reason = "a skip must be seen")]
#[test]
fn a_full_disk_fails_files_and_going_on_completes_them() {
    let dir = Dir::new();
    inputs(&dir, 6, 1500);
    let whole = undisturbed(&dir, 6);
    fs::create_dir(dir.path("out")).expect("a folder");
    let run = |script: &str| {
        let mut command = dir.command("");
        let program = command.get_program().to_os_string();
        command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", script, "sh"]).arg(program);
        command.current_dir(dir.path("")).env("NODEVICE_SELECT", "1");
        Ran::of(command.output().expect("unshare"))
    };
    if run("mount -t tmpfs -o size=64k none out").code != Some(0) {
        return println!("skipped: no disk can be mounted here; a limit on the size of files stands in for it");
    }
    let line = "\"$1\" batch in -d out -r 50%,10% -g cpu";
    let ran = run(&format!(
        "mount -t tmpfs -o size=64k none out && {line}; echo \"exit $?\" >&2; find out -name '*.tmp' >&2
        cp -r out full && mount -o remount,size=64m out && {line} --resume && cp -r out more"
    ));
    assert_eq!(ran.code, Some(0), "{}", ran.err);
    assert!(
        ran.err.contains("exit 9") && ran.err.contains("No space left") && !ran.err.contains(".tmp\n"),
        "{}",
        ran.err
    );
    let full = contents(&dir.path("full"));
    assert!(full.len() < whole.len() && full.iter().all(|(name, bytes)| whole[name] == *bytes));
    for record in records(&dir.path("full/coarsen.jsonl")) {
        let output = record["output"].as_str().expect("a name");
        assert!(record["status"] == "failed" || full.contains_key(output), "{record}");
    }
    assert!(contents(&dir.path("more")) == whole);
}

/// Files may not grow past a limit, as on a disk with quotas.
#[cfg(unix)]
#[test]
fn a_limit_on_files_fails_the_large_ones_only() {
    let dir = Dir::new();
    inputs(&dir, 6, 1500);
    let whole = undisturbed(&dir, 6);
    let program = dir.command("").get_program().to_os_string();
    // Blocks of 512 bytes; without the trap the signal would end the program.
    let script = "trap '' XFSZ; ulimit -f 48; exec \"$1\" batch in -d out -r 50%,10% -g cpu";
    let output = Command::new("sh").args(["-c", script, "sh"]).arg(program).current_dir(dir.path("")).output();
    let ran = Ran::of(output.expect("a shell"));
    assert_eq!(ran.code, Some(9), "{}", ran.err);
    assert!(ran.err.contains("not written") && !has_leftovers(&dir.path("out")), "{}", ran.err);
    let found = contents(&dir.path("out"));
    assert!((1..whole.len()).contains(&found.len()) && found.iter().all(|(name, bytes)| whole[name] == *bytes));
    batch(&dir, "out", "--resume").succeeds();
    assert!(contents(&dir.path("out")) == whole);
}

#[test]
fn globs_name_outputs_from_their_folder_wherever_they_begin() {
    let dir = Dir::new();
    inputs(&dir, 2, 1000);
    let run = |line: &str| dir.run(&format!("batch {line} -r 50% -g cpu -q")).succeeds();
    run("in/*.ply -d one");
    run("in/../in/*.ply -d two");
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(dir.path("in"), dir.path("link")).expect("a link");
        run("link/*.ply -d three");
    }
    for out in ["one", "two", "three"].into_iter().filter(|out| dir.path(out).exists()) {
        assert_eq!(contents(&dir.path(out)).into_keys().collect::<Vec<_>>(), ["0.ply"], "{out}");
    }
    dir.file("0.ply", fs::read(dir.path("in/0.ply")).expect("a mesh"));
    run("*.ply -d four");
    assert_eq!(contents(&dir.path("four")).into_keys().collect::<Vec<_>>(), ["0.ply"]);
}

#[test]
fn what_no_record_speaks_of_is_not_replaced() {
    let dir = Dir::new();
    inputs(&dir, 1, 1000);
    fs::create_dir(dir.path("out")).expect("a folder");
    dir.file("out/0-1.ply", "mine");
    let refused = batch(&dir, "out", "--resume");
    assert_eq!(refused.code, Some(8), "{}", refused.err);
    assert_eq!(fs::read(dir.path("out/0-1.ply")).expect("a file"), b"mine");
    // Nor an input, through a link.
    #[cfg(unix)]
    {
        fs::create_dir(dir.path("linked")).expect("a folder");
        std::os::unix::fs::symlink(dir.path("in/0.ply"), dir.path("linked/0.ply")).expect("a link");
        let refused = dir.run("batch in -d linked -r 50% --pattern {stem}.{ext} -g cpu -w");
        assert!(refused.code == Some(2) && refused.err.contains("is an input as well"), "{}", refused.err);
    }
}

/// The same names and hashes, but of other levels.
#[test]
fn levels_that_change_their_names_are_made_again() {
    let dir = Dir::new();
    fs::create_dir(dir.path("in")).expect("a folder");
    let statue = sample("statue", Some(20_000)).expect("a sample");
    formats::write(&statue, &dir.path("in/x.ply"), &WriteOptions::default()).expect("a file");
    let run = |ratios: &str, pattern: &str| {
        dir.run(&format!("batch in -d out -r {ratios} --pattern {pattern} --resume -g cpu -q")).succeeds();
        let faces = |name: &str| {
            let path = dir.path("out").join(name);
            formats::read(&path).expect("a mesh").faces.len()
        };
        [faces("x-1.ply"), faces("x-2.ply")]
    };
    let by_level = run("2%,1%", "x-{level}.ply");
    assert!(by_level[0] > by_level[1], "{by_level:?}");
    let by_ratio = run("2%,1%", "x-{ratio}.ply");
    assert_eq!(by_ratio, [by_level[1], by_level[0]]);
}
