//! `--write-log` and `coarsen replay`.

use std::fs;

use crate::{Dir, TETRAHEDRON};

/// A folder with a result of 500 faces and its log.
fn logged() -> Dir {
    let dir = Dir::new();
    dir.run("simplify sample:part@2k low.ply -f 500 -g cpu -j 1 --write-log part.clog").succeeds();
    dir
}

#[test]
fn a_log_leads_to_any_face_count() {
    let dir = logged();
    dir.run("replay sample:part@2k part.clog again.ply -f 500").succeeds();
    let read = |name: &str| fs::read(dir.path(name)).expect("a mesh");
    assert!(read("again.ply") == read("low.ply"), "not the result");
    for (target, least) in [("-f 1001", 1000), ("-f 1k", 1000), ("-r 50% -f 3", 1000), ("--reduction 40%", 1199)] {
        let ran = dir.run(&format!("replay sample:part@2k part.clog out.ply -w --json {target}")).succeeds();
        let record = ran.json();
        let [faces, asked] = ["faces_out", "target"].map(|key| record[key].as_u64().expect("a count"));
        assert!((least..=asked).contains(&faces), "{target}: {record}");
        assert!(record["contractions"].as_u64() < record["contractions_in_log"].as_u64(), "{record}");
        assert!(ran.err.contains(&format!("→ {faces} faces by ")), "{}", ran.err);
    }
    let ran = dir.run("replay sample:part@2k part.clog - --format ply -r 1 -q").succeeds();
    assert!(ran.out.starts_with(b"ply\n") && ran.err.is_empty());
}

#[test]
fn the_log_is_the_same_for_all_threads() {
    let dir = logged();
    dir.run("simplify sample:part@2k low.ply -w -f 500 -g cpu -j 2 --write-log two.clog").succeeds();
    let [one, two] = ["part.clog", "two.clog"].map(|name| fs::read(dir.path(name)).expect("a log"));
    assert!(one == two);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    let dir = logged();
    let log = fs::read(dir.path("part.clog")).expect("a log");
    let mut damaged = log.clone();
    damaged[200] ^= 1;
    dir.file("in.obj", TETRAHEDRON).file("cut.clog", &log[..999]).file("damaged.clog", damaged);
    let files = dir.files();
    for (line, code, parts) in [
        ("replay in.obj part.clog out.ply -f 4", 2, &["the log is of another mesh", "this one has 4 and 4"][..]),
        ("replay sample:part@2k in.obj out.ply -f 4", 4, &["'in.obj': collapse log byte 0", "'COLLAPSE'"]),
        ("replay sample:part@2k cut.clog out.ply -f 4", 4, &["'cut.clog': collapse log byte 999", "ends here"]),
        ("replay sample:part@2k damaged.clog out.ply -f 4", 4, &["'damaged.clog'", "damaged"]),
        ("replay sample:part@2k none.clog out.ply -f 4", 4, &["cannot read 'none.clog'"]),
        ("replay sample:part@2k part.clog out.ply -f 499", 3, &["'part.clog' ends at 500 faces, above the 499"]),
        ("replay sample:part@2k part.clog out.ply", 2, &["no target"]),
        ("replay sample:part@2k part.clog out.ply -f 0", 2, &["whole number"]),
        ("replay sample:part@2k part.clog low.ply -f 600", 8, &["'low.ply' exists"]),
        ("replay low.ply part.clog low.ply -w -f 600", 2, &["'low.ply' is the input as well"]),
        ("replay sample:part@2k part.clog - -f 600 --format ply --json", 2, &["both the mesh"]),
        ("replay sample:part@2k part.clog out.fbx -f 600", 5, &["'.fbx'"]),
    ] {
        dir.run(line).fails(code, parts);
    }
    assert_eq!(dir.files(), files);
}

#[test]
fn a_log_goes_to_a_file_of_its_own() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("old.clog", "precious");
    for (options, code, part) in [
        ("--write-log -", 2, "'-' is none"),
        ("--write-log out.obj", 2, "is the output as well"),
        ("--write-log in.obj", 2, "is the input as well"),
        ("--write-log a.clog --fit 1", 2, "--write-log and --fit contradict each other"),
        ("--write-log old.clog", 8, "'old.clog' exists"),
        ("--write-log none/a.clog", 8, "cannot write 'none/a.clog'"),
    ] {
        dir.run(&format!("simplify in.obj out.obj -f 4 -g cpu {options}")).fails(code, &[part]);
    }
    assert_eq!(dir.files(), ["in.obj", "old.clog"]);
    dir.run("simplify in.obj out.obj -f 4 -g cpu -w --write-log old.clog").succeeds();
    assert!(fs::read(dir.path("old.clog")).expect("a log").starts_with(b"COLLAPSE"));
}
