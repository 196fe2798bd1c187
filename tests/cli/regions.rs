//! `--polygons` and `--write-regions`.

use std::fs;

use serde_json::Value;

use super::{Dir, TETRAHEDRON};

fn faces(file: &[u8]) -> usize {
    file.split(|&b| b == b'\n').filter(|line| line.starts_with(b"f ")).count()
}

/// A cube of side 2, every side cut in two.
const CUBE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n\
    f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";

#[test]
fn regions_are_written_as_polygons() {
    let dir = Dir::new();
    dir.file("in.obj", CUBE);
    dir.run("simplify in.obj out.obj --method coplanar --polygons -g cpu").succeeds();
    assert_eq!(faces(&fs::read(dir.path("out.obj")).expect("the result")), 6);
    let piped = dir.run("simplify in.obj - --format obj --method vsa --regions 6 --polygons -g cpu").succeeds();
    assert_eq!(faces(&piped.out), 6);
    dir.run("simplify in.obj out.ply --method coplanar --polygons -g cpu").succeeds();
    let ply = fs::read(dir.path("out.ply")).expect("the result");
    assert!(String::from_utf8_lossy(&ply).contains("element face 6\n"));
    dir.run("simplify in.obj out.ply.gz --method coplanar --polygons -g cpu").succeeds();
    let lit = |line: &str| format!("{line}{}\n", if line.starts_with('v') { " .5 .5 .5" } else { "" });
    dir.file("lit.obj", CUBE.lines().map(lit).collect::<String>());
    let piped = dir.run("simplify lit.obj - --format obj --method superface --polygons -g cpu").succeeds();
    assert_eq!(faces(&piped.out), 6);
    let inspected = dir.run("inspect out.ply.gz --json").succeeds().json();
    assert_eq!((&inspected["stored"]["faces"], &inspected["stored"]["border_edges"]), (&12.into(), &0.into()));
    assert_eq!(dir.files(), ["in.obj", "lit.obj", "out.obj", "out.ply", "out.ply.gz"]);
}

#[test]
fn regions_are_told_in_a_file() {
    let dir = Dir::new();
    // Two faces more that are dropped: one without area, one that repeats another.
    dir.file("in.obj", format!("{CUBE}f 1 1 2\nf 4 3 1\n"));
    let told = |line: &str| -> Value {
        dir.run(line).succeeds();
        serde_json::from_slice(&fs::read(dir.path("regions.json")).expect("the regions")).expect("JSON")
    };
    let flat = told("simplify in.obj out.ply --method coplanar --write-regions regions.json -g cpu");
    assert_eq!((&flat["schema"], &flat["method"], &flat["count"]), (&1.into(), &"coplanar".into(), &6.into()));
    assert_eq!((&flat["proxies"], &flat["energies"]), (&Value::Null, &Value::Null));
    let labels: Vec<Option<u64>> = flat["labels"].as_array().expect("labels").iter().map(Value::as_u64).collect();
    assert_eq!(labels.len(), 14);
    assert!((0..6).all(|side| labels[2 * side].is_some() && labels[2 * side] == labels[2 * side + 1]), "{labels:?}");
    assert_eq!(labels[12..], [None, None]);

    let vsa = told("simplify in.obj out.ply -w --method vsa --regions 6 --write-regions regions.json -g cpu");
    let proxies = vsa["proxies"].as_array().expect("proxies");
    assert_eq!((&vsa["method"], proxies.len()), (&"vsa".into(), 6));
    for proxy in proxies {
        let numbers = |name: &str| -> Vec<f64> {
            proxy[name].as_array().expect(name).iter().map(|x| x.as_f64().expect("a number")).collect()
        };
        // A side of the cube: its middle is one from the cube's.
        let (normal, point) = (numbers("normal"), numbers("point"));
        let off: f64 = (0..3).map(|k| (point[k] - 1.0 - normal[k]).abs()).sum();
        assert!(off < 1e-6, "{proxy}");
        assert!((proxy["area"].as_f64().expect("an area") - 4.0).abs() < 1e-5, "{proxy}");
        assert!(proxy["energy"].as_f64().expect("an energy").abs() < 1e-9, "{proxy}");
    }
    let energies = vsa["energies"].as_array().expect("energies");
    assert!(energies.last().and_then(Value::as_f64).is_some_and(|energy| energy < 1e-9), "{energies:?}");
}

#[test]
fn wrong_uses_are_told_before_anything_is_written() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("old.json", "precious");
    for (options, code, part) in [
        ("out.obj -f 4 --polygons", 2, "--polygons is for --method vsa, superface and coplanar"),
        ("out.obj --method coplanar --keep-colors", 2, "--method coplanar takes --flat-angle"),
        ("out.obj -f 4 --write-regions a.json", 2, "--write-regions is for --method vsa"),
        ("out.stl --method coplanar --polygons", 2, "--polygons writes OBJ or PLY, not STL"),
        ("- --format off --method coplanar --polygons", 2, "not OFF"),
        ("out.obj --method coplanar --polygons --flips 2", 2, "--polygons and --flips contradict each other"),
        ("out.obj --method coplanar --write-regions -", 2, "'-' is none"),
        ("out.obj --method coplanar --write-regions out.obj", 2, "is the output as well"),
        ("out.obj --method coplanar --write-regions in.obj", 2, "is the input as well"),
        (
            "out.obj --method coplanar --write-regions a.ply --write-feature a.ply",
            2,
            "give --write-regions another name",
        ),
        ("out.obj --method coplanar --write-regions old.json", 8, "'old.json' exists"),
        ("out.obj --method coplanar --write-regions none/a.json", 8, "cannot write 'none/a.json'"),
    ] {
        dir.run(&format!("simplify in.obj {options} -g cpu")).fails(code, &[part]);
    }
    assert_eq!(dir.files(), ["in.obj", "old.json"]);
    dir.run("simplify in.obj out.obj --method coplanar -w --write-regions old.json -g cpu").succeeds();
    assert!(fs::read(dir.path("old.json")).expect("the regions").starts_with(b"{\"schema\":1,"));
}
