//! What is said and recorded, and that options do what they say.

use std::fs;

use serde_json::Value;

use crate::{Dir, TETRAHEDRON, TEXTURED};

#[test]
fn nothing_but_data_goes_to_standard_output() {
    let dir = Dir::new();
    let ran = dir.run("simplify sample:part@2k out.ply -f 500 -g cpu -v").succeeds();
    assert!(ran.out.is_empty());
    assert!(ran.err.starts_with("round"), "{}", ran.err);
    let last = ran.err.lines().last().unwrap_or_default();
    assert!(last.contains(" → 500 faces, stop=faces_reached, estimated error 0."), "{last}");
    assert!(last.contains("% of the diagonal, read ") && last.contains(" s, CPU, "), "{last}");

    let quiet = dir.run("simplify sample:part@2k out.ply -f 500 -g cpu -w -q").succeeds();
    assert!(quiet.out.is_empty() && quiet.err.is_empty(), "{}", quiet.err);
}

#[test]
fn warnings_name_the_input() {
    let dir = Dir::new();
    dir.file("in.obj", format!("{TETRAHEDRON}f 1 1 2\n"));
    let ran = dir.run("simplify in.obj out.obj -f 4 -g cpu --json").succeeds();
    assert!(ran.err.starts_with("coarsen: warning: 'in.obj': degenerate faces dropped: 1\n"), "{}", ran.err);
    assert_eq!(ran.json()["warnings"].as_array().map(Vec::len), Some(1));
    assert!(dir.run("simplify in.obj out.obj -f 4 -g cpu -w -q").succeeds().err.is_empty());
}

#[test]
fn numbers_that_are_not_finite_are_told() {
    let dir = Dir::new();
    let corners = "vt 0 0\nvt 1 nan\nvt 1e39 1\nvn 0 0 1\nvn nan 0 1\n";
    let faces = "f 1/1/1 3/1/1 2/2/1\nf 1/1/1 2/1/1 4/1/2\nf 2/3/1 3/2/1 4/1/2\nf 1/1/1 4/1/2 3/1/1\n";
    let positions: String =
        TETRAHEDRON.lines().filter(|line| line.starts_with("v ")).map(|v| format!("{v}\n")).collect();
    dir.file("in.obj", positions + corners + faces);
    let told = "not finite in single precision, read as zero: normals 1, texture coordinates of corners 3";
    let line = format!("coarsen: warning: 'in.obj': {told}\n");
    let ran = dir.run("simplify in.obj out.obj -f 4 -g cpu --json").succeeds();
    assert!(ran.err.starts_with(&line), "{}", ran.err);
    assert_eq!(ran.json()["warnings"], serde_json::json!([told]));
    assert!(dir.run("inspect in.obj").succeeds().err.contains(&line));
    let levels = dir.run("lod in.obj level{level}.ply --ratios 100%,50% -g cpu").succeeds();
    assert_eq!(levels.err.matches(told).count(), 1, "{}", levels.err);
    assert!(dir.run("compare in.obj out.obj -g cpu").succeeds().err.contains(told));
    dir.run("batch in.obj -d out -r 100% -g cpu").succeeds();
    let records = fs::read_to_string(dir.path("out/coarsen.jsonl")).expect("records");
    assert!(records.contains(told), "{records}");
}

#[test]
fn json_has_its_fields() {
    let dir = Dir::new();
    let record = dir.run("simplify sample:part@2k out.ply -r 25% -g cpu -j 1 --json --metric plane").succeeds().json();
    let keys = |value: &Value| {
        let keys: std::collections::BTreeSet<String> =
            value.as_object().into_iter().flatten().map(|(key, _)| key.clone()).collect();
        keys.into_iter().collect::<Vec<_>>()
    };
    let mut expected = [
        "schema",
        "input",
        "output",
        "method",
        "metric",
        "device",
        "driver",
        "version",
        "faces_in",
        "faces_out",
        "vertices_in",
        "vertices_out",
        "target",
        "reached",
        "stop_reason",
        "cell_size",
        "quadrics",
        "regions",
        "flips",
        "simplify_ms",
        "blocked",
        "error",
        "rounds",
        "kernels",
        "seconds",
        "parts",
        "peak_memory",
        "warnings",
    ];
    expected.sort_unstable();
    assert_eq!(keys(&record), expected);
    let seconds = [
        "apply", "build", "cost", "filter", "fit", "flip", "measure", "read", "restore", "select", "solve", "total",
        "transfer", "weld", "write",
    ];
    assert_eq!(keys(&record["seconds"]), seconds);
    assert_eq!(
        keys(&record["blocked"]),
        ["aspect", "border", "crossing", "error", "flip", "link", "lock", "seam", "texture"]
    );
    assert_eq!(keys(&record["error"]), ["estimate", "estimate_relative", "measured"]);
    let input = record["faces_in"].as_f64().expect("a count");
    for (field, value) in [
        ("schema", Value::from(1)),
        ("input", "sample:part@2k".into()),
        ("output", "out.ply".into()),
        ("method", "contract".into()),
        ("metric", "plane".into()),
        ("device", "CPU, 1 thread".into()),
        ("driver", Value::Null),
        ("version", env!("CARGO_PKG_VERSION").into()),
        ("target", Value::from((input / 4.0).round() as u64)),
        ("reached", true.into()),
        ("stop_reason", "faces_reached".into()),
    ] {
        assert_eq!(record[field], value, "{field}");
    }
    let error_only = dir.run("simplify sample:part@2k out.ply -w -e 1% -g cpu --json").succeeds().json();
    assert_eq!((&error_only["target"], &error_only["reached"]), (&Value::Null, &true.into()));
    assert_eq!(error_only["stop_reason"], "error_reached");
}

#[test]
fn progress_is_json_when_asked_and_nothing_without_a_terminal() {
    let dir = Dir::new();
    let ran = dir.run("simplify sample:part@5k out.ply -f 500 -g cpu --progress json").succeeds();
    let steps: Vec<Value> = ran.err.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    assert!(!steps.is_empty() && steps.iter().all(|step| step["target"] == 500), "{}", ran.err);
    assert_eq!(ran.err.lines().count(), steps.len() + 1);
    for wish in ["auto", "bar", "never"] {
        let ran = dir.run(&format!("simplify sample:part@5k out.ply -w -f 500 -g cpu --progress {wish}")).succeeds();
        assert_eq!(ran.err.lines().count(), 1, "{wish}: {}", ran.err);
    }
}

#[test]
fn inspect_counts_and_predicts() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    let table = String::from_utf8(dir.run("inspect in.obj").succeeds().out).expect("a table in UTF-8");
    for row in [
        "in.obj",
        "vertices                             4             4",
        "genus                                0             0",
        "box to                  1.000000  1.000000  1.000000",
        "volume                  0.166667",
        "fewest faces possible   4",
        "                        1 closed part without handles: 4 faces each",
    ] {
        assert!(table.lines().any(|line| line == row), "no line '{row}' in\n{table}");
    }
    let record = dir.run("inspect sample:part@2k --json").succeeds().json();
    assert_eq!(record["schema"], 1);
    assert_eq!((&record["stored"]["genus"], &record["welded"]["topology"]["genus"]), (&9.into(), &9.into()));
    assert_eq!(record["welded"]["floor_faces"], 60);
}

#[test]
fn devices_names_what_auto_takes() {
    let dir = Dir::new();
    let record = dir.run("devices --json").succeeds().json();
    let table = String::from_utf8(dir.run("devices").succeeds().out).expect("a table in UTF-8");
    let auto = record["auto"]["device"].as_str().expect("a device");
    assert!(table.contains(&format!("auto   {auto}\n")), "{table}");
    for adapter in record["adapters"].as_array().expect("adapters") {
        assert!(table.contains(adapter["name"].as_str().expect("a name")), "{table}");
        assert!(adapter["kind"] != "software" || auto != adapter["name"].as_str().unwrap_or_default());
    }
}

#[test]
fn shape_options_work() {
    let dir = Dir::new();
    let run = |options: &str| {
        dir.run(&format!("simplify sample:terrain@2k out.ply -w -g cpu --json {options}")).succeeds().json()
    };
    let plain = run("-r 10%");
    for options in ["--metric plane", "--placement endpoint", "--lock-border", "--border-weight 50", "--max-flip 20"] {
        run(&format!("-r 10% {options}"));
        let changed = fs::read(dir.path("out.ply")).expect("the result");
        run("-r 10%");
        assert!(changed != fs::read(dir.path("out.ply")).expect("the result"), "{options} changes nothing");
    }
    assert_eq!(plain["reached"], true);
    dir.file("soup.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n");
    let vertices = |options: &str| {
        dir.run(&format!("simplify soup.obj soup.off -w -f 2 -g cpu --json {options}")).json()["vertices_out"].clone()
    };
    assert_eq!((vertices(""), vertices("--weld off")), (4.into(), 6.into()));
}

#[test]
fn prune_drops_small_parts() {
    let dir = Dir::new();
    let run =
        |options: &str| dir.run(&format!("simplify sample:assembly@5k out.ply -w -r 1 -g cpu --json {options}")).json();
    let faces = |record: Value| record["faces_out"].as_u64().expect("a count");
    assert!(faces(run("--prune 15%")) < faces(run("")), "nothing is dropped");
}

#[test]
fn close_holes_closes_what_is_named() {
    let dir = Dir::new();
    // A box of two by two squares above a tip, without the last square.
    let grid = |x: usize, y: usize| 3 * y + x + 1;
    let mut obj: String =
        (0..9).map(|i| format!("v {} {} {}\n", i % 3, i / 3, if i == 4 { 0.1 } else { 0.0 })).collect();
    obj += "v 1 1 -3\n";
    let rim = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
    for (i, &(x, y)) in rim.iter().enumerate() {
        let (next_x, next_y) = rim[(i + 1) % rim.len()];
        obj += &format!("f {} {} 10\n", grid(next_x, next_y), grid(x, y));
    }
    for (x, y) in [(0, 0), (1, 0), (0, 1)] {
        obj += &format!("f {} {} {} {}\n", grid(x, y), grid(x + 1, y), grid(x + 1, y + 1), grid(x, y + 1));
    }
    fs::write(dir.path("box.obj"), obj).expect("a file");
    let run = |options: &str| dir.run(&format!("simplify box.obj out.ply -w -f 100 -g cpu --json {options}")).json();
    let faces = |record: &Value| record["faces_out"].as_u64().expect("a count");
    let closed = run("--close-holes 50%");
    assert_eq!([faces(&run("")), faces(&run("--close-holes 10%")), faces(&closed)], [14, 14, 16]);
    assert_eq!(closed["faces_in"], 14);
    let warning = closed["warnings"].to_string();
    assert!(warning.contains("holes closed: 1, up to"), "{warning}");
}

#[test]
fn threads_do_not_show() {
    let dir = Dir::new();
    for (name, options) in [("one.ply", "-j 1"), ("two.ply", "-j 2"), ("all.ply", "")] {
        dir.run(&format!("simplify sample:statue@20k {name} -f 2k -g cpu {options}")).succeeds();
    }
    let [one, two, all] = ["one.ply", "two.ply", "all.ply"].map(|name| fs::read(dir.path(name)).expect("a result"));
    assert!(one == two && one == all);
}

#[test]
fn ascii_is_text() {
    let dir = Dir::new();
    dir.run("simplify sample:part@1k out.ply -f 500 -g cpu --ascii").succeeds();
    let text = fs::read_to_string(dir.path("out.ply")).expect("text");
    assert!(text.starts_with("ply\nformat ascii 1.0\n"), "{}", &text[..40]);
}

#[test]
fn clustering_tells_its_cells() {
    let dir = Dir::new();
    let line = "simplify sample:statue@5k out.ply -g cpu -w --method cluster";
    let by_grid = dir.run(&format!("{line} --grid 9 --representative mean --json")).succeeds().json();
    assert_eq!((&by_grid["method"], &by_grid["metric"]), (&"cluster".into(), &Value::Null));
    assert_eq!((&by_grid["stop_reason"], &by_grid["target"]), (&"grid_reached".into(), &Value::Null));
    assert!(by_grid["cell_size"].as_f64().is_some_and(|side| side > 0.0), "{by_grid}");
    assert_eq!(by_grid["rounds"], serde_json::json!([]));
    dir.run(&format!("{line} --grid 9 --require-target")).succeeds();

    // The table of the rounds has none to show.
    let ran = dir.run(&format!("{line} -f 500 -v")).succeeds();
    assert!(!ran.err.starts_with("round"), "{}", ran.err);
    assert!(ran.err.contains(" faces, stop=faces_reached, estimated error "), "{}", ran.err);
    let by_error = dir.run(&format!("{line} -e 5% --json")).succeeds().json();
    assert_eq!((&by_error["stop_reason"], &by_error["reached"]), (&"error_reached".into(), &true.into()));
    let contracted = dir.run("simplify sample:statue@5k out.ply -g cpu -w -f 500 --json").succeeds().json();
    assert_eq!(contracted["cell_size"], Value::Null);
}

#[test]
fn textures_are_kept_unless_dropped() {
    let dir = Dir::new();
    dir.file("in.obj", TEXTURED);
    let coordinates = |options: &str| {
        let ran = dir.run(&format!("simplify in.obj out.obj -f 7 -g cpu -w --json {options}")).succeeds();
        let text = fs::read_to_string(dir.path("out.obj")).expect("text");
        (text.lines().any(|line| line.starts_with("vt ")), ran.err.contains("texture coordinates"))
    };
    assert_eq!(coordinates(""), (true, false));
    assert_eq!(coordinates("--drop uv"), (false, false));
    assert_eq!(coordinates("--write-log a.log"), (false, true));
}

#[test]
fn triangles_take_the_metric_that_they_need() {
    let dir = Dir::new();
    let line = "simplify sample:statue@5k out.ply -f 500 -g cpu -w --json --candidates";
    let triangles = dir.run(&format!("{line} triangles")).succeeds().json();
    assert_eq!((&triangles["metric"], &triangles["faces_out"]), (&"plane".into(), &500.into()));
    assert_eq!(dir.run(&format!("{line} pairs")).succeeds().json()["metric"], "volume");
}
