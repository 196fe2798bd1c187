//! Files that must not be touched or left behind, pipes, interruption.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::{Dir, Ran, TETRAHEDRON};

#[test]
fn an_existing_file_is_replaced_only_when_asked() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("out.obj", "precious");
    dir.run("simplify in.obj out.obj -f 4 -g cpu").fails(8, &["'out.obj' exists: give -w to replace it"]);
    assert_eq!(fs::read(dir.path("out.obj")).expect("still there"), b"precious");
    dir.run("simplify in.obj out.obj -f 4 -g cpu -w").succeeds();
    assert!(fs::read_to_string(dir.path("out.obj")).expect("a mesh").contains("f "));
    assert_eq!(dir.files(), ["in.obj", "out.obj"]);
}

#[test]
fn a_bad_output_is_told_before_the_input_is_read() {
    let dir = Dir::new();
    dir.file("bad.ply", "this is never read\n");
    fs::create_dir(dir.path("folder.ply")).expect("a folder");
    dir.run("simplify bad.ply none/out.ply -f 4").fails(8, &["cannot write 'none/out.ply'"]);
    dir.run("simplify bad.ply bad.ply/out.ply -f 4").fails(8, &["cannot write 'bad.ply/out.ply'"]);
    dir.run("simplify bad.ply folder.ply -f 4 -w").fails(8, &["cannot write 'folder.ply'", "is a directory"]);
    assert_eq!(dir.files(), ["bad.ply", "folder.ply"]);
}

#[cfg(unix)]
#[expect(clippy::print_stdout, reason = "a skip must be seen")]
#[test]
fn a_folder_without_permission_is_told_before_the_input_is_read() {
    use std::os::unix::fs::PermissionsExt;
    let dir = Dir::new();
    dir.file("bad.ply", "this is never read\n");
    fs::create_dir(dir.path("locked")).expect("a folder");
    fs::set_permissions(dir.path("locked"), fs::Permissions::from_mode(0o555)).expect("permissions");
    if fs::write(dir.path("locked/probe"), "").is_ok() {
        return println!("skipped: this user may write everywhere");
    }
    dir.run("simplify bad.ply locked/out.ply -f 4").fails(8, &["cannot write 'locked/out.ply'", "ermission denied"]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let dir = Dir::new();
    let full = || fs::OpenOptions::new().write(true).open("/dev/full").expect("the full device");
    let mut command = dir.command("simplify sample:part@1k - --format ply -f 500 -g cpu");
    Ran::of(command.stdout(full()).output().expect("it runs")).fails(8, &["cannot write '-'", "No space left"]);
    let mut command = dir.command("simplify sample:part@1k out.ply -f 500 -g cpu --json");
    Ran::of(command.stdout(full()).output().expect("it runs")).fails(8, &["cannot write '-'", "No space left"]);

    std::os::unix::fs::symlink("/dev/full", dir.path("full.ply")).expect("a link");
    dir.run("simplify sample:part@1k full.ply -f 500 -g cpu").fails(8, &["cannot write 'full.ply'", "No space left"]);
    assert_eq!(dir.files(), ["full.ply", "out.ply"]);
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_behind() {
    let dir = Dir::new();
    let mut command = dir.command("simplify sample:statue@500k out.ply -f 100 -g cpu -j 1 --progress json");
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program");
    let mut messages = BufReader::new(child.stderr.take().expect("its messages"));
    let mut first = String::new();
    messages.read_line(&mut first).expect("a line");
    assert!(first.starts_with("{\"faces\":"), "{first}");
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill");
    assert!(sent.success());
    let mut rest = String::new();
    messages.read_to_string(&mut rest).expect("messages");
    assert_eq!(child.wait().expect("its end").code(), Some(130), "{rest}");
    assert!(rest.ends_with("coarsen: error: interrupted, nothing is written\n"), "{rest}");
    assert!(dir.files().is_empty(), "{:?}", dir.files());
}

/// Whether SIGHUP is ignored here, as under `nohup`, and so by every program that is begun.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).map(str::trim);
    ignored.is_some_and(|mask| u64::from_str_radix(mask, 16).expect("a mask") & 1 != 0)
}

/// As `kill`, `timeout` and schedulers ask, twice at once, and as a terminal that closes does, unless it is to be ignored (`nohup`).
#[cfg(unix)]
#[expect(clippy::print_stdout, reason = "a skip must be seen")]
#[test]
fn whatever_asks_a_run_to_end_leaves_nothing_behind() {
    let line = "sample:statue@300k out.ply -f 100 -g cpu -j 1 --progress json";
    for (signals, prefix, code) in [
        (&["-TERM"][..], "", 130),
        (&["-TERM", "-TERM"], "", 130),
        (&["-HUP"], "", 130),
        (&["-HUP"], "trap '' HUP; ", 0),
        (&["-HUP", "-TERM"], "trap '' HUP; ", 130),
    ] {
        if signals == ["-HUP"] && prefix.is_empty() && is_hangup_ignored() {
            println!("skipped: SIGHUP is ignored by all that is begun here");
            continue;
        }
        let dir = Dir::new();
        let mut command = Command::new("sh");
        command.args(["-c", &format!("{prefix}exec {} simplify {line}", env!("CARGO_BIN_EXE_coarsen"))]);
        command.current_dir(dir.path("")).env("NODEVICE_SELECT", "1").stderr(Stdio::piped()).stdout(Stdio::null());
        let mut child = command.spawn().expect("the program");
        let mut messages = BufReader::new(child.stderr.take().expect("its messages"));
        let mut first = String::new();
        messages.read_line(&mut first).expect("a line");
        assert!(first.starts_with("{\"faces\":"), "{first}");
        let id = child.id();
        let send = signals.iter().map(|signal| format!("kill {signal} {id}")).collect::<Vec<_>>().join("; ");
        assert!(Command::new("sh").args(["-c", &send]).status().expect("kill").success());
        let mut rest = String::new();
        messages.read_to_string(&mut rest).expect("messages");
        assert_eq!(child.wait().expect("its end").code(), Some(code), "{signals:?}: {rest}");
        // Twice at once is once: it was not ended on the spot.
        let is_told = rest.ends_with("coarsen: error: interrupted, nothing is written\n");
        assert_eq!(is_told, code == 130, "{signals:?}: {rest}");
        assert_eq!(dir.files().len(), usize::from(code == 0), "{signals:?}: {:?}", dir.files());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_sample_that_is_interrupted_is_not_written() {
    let dir = Dir::new();
    // An OBJ is made as a whole, a PLY of this size in slabs.
    for output in ["out.obj", "out.ply"] {
        let mut child = dir.command(&format!("sample statue@20M {output}")).stderr(Stdio::null()).spawn().expect("it");
        let status = format!("/proc/{}/status", child.id());
        let catches_it = || {
            let text = fs::read_to_string(&status).expect("its status");
            let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:")).expect("signals");
            u64::from_str_radix(caught.trim(), 16).expect("a number") & 2 != 0
        };
        while !catches_it() {
            assert!(child.try_wait().expect("its state").is_none(), "{output}: it ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill").success());
        assert_eq!(child.wait().expect("its end").code(), Some(130), "{output}");
        assert!(dir.files().is_empty(), "{:?}", dir.files());
    }
}

#[test]
fn coordinates_that_do_not_fit_a_format_are_refused() {
    let dir = Dir::new();
    let grid = |side: u32| -> String {
        let vertices = (0..side * side).map(|i| format!("v {}e38 {}e38 {}e37\n", i % side, i / side, i * i % 7));
        let corners = |i: u32| format!("f {} {} {}\nf {0} {2} {}\n", i, i + 1, i + side + 1, i + side);
        let cells = (1..side * (side - 1)).filter(|i| i % side != 0).map(corners);
        vertices.chain(cells).collect()
    };
    dir.file("in.obj", grid(24));
    dir.run("simplify in.obj kept.obj -f 200 -g cpu --write-log kept.clog").succeeds();
    for output in ["out.stl", "out.glb", "out.gltf", "out.gltf.gz"] {
        let parts = [&*format!("cannot write '{output}'"), "a coordinate is too large for the f32 of "];
        dir.run(&format!("simplify in.obj {output} -f 200 -g cpu")).fails(8, &parts);
        dir.run(&format!("replay in.obj kept.clog {output} -f 200")).fails(8, &parts);
    }
    dir.run("simplify in.obj - --format glb -f 200 -g cpu").fails(8, &["cannot write '-'", "of glTF"]);
    assert_eq!(dir.files(), ["in.obj", "kept.clog", "kept.obj"]);
    for output in ["out.off", "out.ply", "text.ply --ascii", "text.stl --ascii"] {
        dir.run(&format!("simplify in.obj {output} -f 200 -g cpu")).succeeds();
        let name = output.split(' ').next().unwrap_or_default();
        dir.run(&format!("inspect {name}")).succeeds();
    }
}

#[test]
fn names_may_be_as_long_as_the_file_system_takes_them() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    let name = format!("{}.off", "o".repeat(245));
    dir.run(&format!("simplify in.obj {name} -f 4 -g cpu")).succeeds();
    assert_eq!(dir.files(), ["in.obj", &*name]);
}

#[test]
fn meshes_go_through_pipes() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    let stdin = fs::File::open(dir.path("in.obj")).expect("the input");
    let output = dir.command("simplify - - --format obj -f 4 -g cpu").stdin(stdin).output().expect("it runs");
    let ran = Ran::of(output).succeeds();
    let text = String::from_utf8(ran.out).expect("OBJ text");
    assert_eq!((text.matches("v ").count(), text.matches("f ").count()), (4, 4), "{text}");
    assert!(ran.err.contains("4 → 4 faces, stop=faces_reached"), "{}", ran.err);

    // A stream has no name to tell that it is compressed.
    for name in ["packed.obj.gz", "packed.obj.zst"] {
        dir.run(&format!("simplify in.obj {name} -f 4 -g cpu")).succeeds();
        let stdin = fs::File::open(dir.path(name)).expect("the input");
        let output = dir.command("inspect - --format obj").stdin(stdin).output().expect("it runs");
        let told = String::from_utf8(Ran::of(output).succeeds().out).expect("a table");
        assert!(told.contains("fewest faces possible"), "{name}: {told}");
    }

    let piped = dir.run("simplify sample:part@2k - --format ply -f 500 -g cpu").succeeds().out;
    dir.run("simplify sample:part@2k out.ply -f 500 -g cpu").succeeds();
    assert!(piped == fs::read(dir.path("out.ply")).expect("the file"), "a pipe and a file get different bytes");
    dir.command("inspect - --format obj")
        .stdin(Stdio::null())
        .output()
        .map(Ran::of)
        .expect("it runs")
        .fails(4, &["'-'"]);
}

#[test]
fn a_reader_that_leaves_is_no_error() {
    let dir = Dir::new();
    for line in ["simplify sample:part@20k - --format obj -r 1 -g cpu -q", "man", "completions zsh"] {
        let mut command = dir.command(line);
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program");
        drop(child.stdout.take());
        let ran = Ran::of(child.wait_with_output().expect("its end")).succeeds();
        assert!(ran.err.is_empty(), "{line}: {}", ran.err);
    }
}

#[test]
fn a_mesh_above_the_memory_limit_is_done_in_parts() {
    let dir = Dir::new();
    dir.run("sample statue@300k in.ply").succeeds();
    let record = dir.run("simplify in.ply out.ply -f 3k -g cpu --memory-limit 120MiB --json").succeeds().json();
    assert_eq!((&record["faces_out"], &record["stop_reason"]), (&3000.into(), &"faces_reached".into()));
    let parts = &record["parts"];
    assert!(parts["count"].as_u64() >= Some(6), "{parts}");
    assert_eq!(parts["passes"].as_array().map(Vec::len), Some(1), "{parts}");
    assert!(record["peak_memory"].as_u64() <= Some(120 << 20), "{}", record["peak_memory"]);
    let found = dir.run("inspect out.ply --json").succeeds().json();
    assert_eq!(
        (&found["stored"]["faces"], &found["stored"]["border_edges"], &found["stored"]["genus"]),
        (&3000.into(), &0.into(), &0.into()),
        "{found}"
    );

    let whole = dir.run("simplify in.ply whole.ply -f 3k -g cpu --memory-limit 1GiB --json").succeeds().json();
    assert!(whole["parts"].is_null());
    assert_eq!(dir.files(), ["in.ply", "out.ply", "whole.ply"]);
}

#[test]
fn what_parts_cannot_do_is_refused_before_the_work() {
    let dir = Dir::new();
    dir.run("sample statue@300k in.ply").succeeds();
    for (options, reason) in [
        ("-f 3k --memory-limit 120MiB --measure", "--measure needs the whole mesh in memory"),
        ("-f 3k --memory-limit 120MiB --method cluster", "only contraction works in parts"),
        ("-f 3k --memory-limit 90MiB", "need at least"),
        ("-f 200k --memory-limit 120MiB", "need at least"),
    ] {
        dir.run(&format!("simplify in.ply out.ply -g cpu {options}")).fails(6, &["'in.ply'", reason]);
    }
    dir.run("simplify in.ply out.ply -f 3k -g cpu --memory-limit 120MiB --temp-dir none").fails(8, &["'none'"]);
    assert_eq!(dir.files(), ["in.ply"]);
}

#[cfg(unix)]
#[test]
fn a_run_in_parts_leaves_nothing_behind_when_it_is_killed() {
    let dir = Dir::new();
    dir.run("sample statue@300k in.ply").succeeds();
    for (signal, code) in [("-KILL", None), ("-INT", Some(130))] {
        let line = "simplify in.ply out.ply -f 3k -g cpu -j 1 --memory-limit 120MiB --progress json";
        let mut child = dir.command(line).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().expect("the program");
        let mut messages = BufReader::new(child.stderr.take().expect("its messages"));
        let mut first = String::new();
        messages.read_line(&mut first).expect("a line");
        assert!(first.starts_with("{\"faces\":"), "{first}");
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().expect("kill");
        assert!(sent.success());
        let mut rest = String::new();
        messages.read_to_string(&mut rest).expect("messages");
        assert_eq!(child.wait().expect("its end").code(), code, "{rest}");
        assert_eq!(dir.files(), ["in.ply"], "{signal}");
    }
}

#[test]
fn samples_are_written() {
    let dir = Dir::new();
    dir.run("sample part@2k part.stl").succeeds();
    dir.run("simplify sample:part@2k same.stl -r 1 -g cpu").succeeds();
    assert!(fs::read(dir.path("part.stl")).expect("a file") == fs::read(dir.path("same.stl")).expect("a file"));
    dir.run("sample part@2k part.stl").fails(8, &["'part.stl' exists: give -w to replace it"]);
    let [told, quiet] = ["", " -q"].map(|option| dir.run(&format!("sample part@2k part.stl -w{option}")));
    assert!(told.err.contains("'part.stl': ") && quiet.err.is_empty(), "{} {}", told.err, quiet.err);
    dir.run("sample horse horse.ply").fails(2, &["no sample 'horse'"]);
    dir.run("sample part part.xyz").fails(5, &["'.xyz'"]);
    assert_eq!(dir.files(), ["part.stl", "same.stl"]);
}
