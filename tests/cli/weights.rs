//! Weights of vertices: features, a list, a property of the input.

use std::fs;

use coarsen::formats::{read, read_property};
use coarsen::mesh::sample;

use crate::Dir;

#[test]
fn features_are_written_and_read_again() {
    let dir = Dir::new();
    let line = "simplify sample:part@4k out.ply -f 400 -g cpu --method feature --json --write-feature feature.ply";
    let record = dir.run(line).succeeds().json();
    assert_eq!((&record["method"], &record["metric"]), (&"feature".into(), &"plane".into()));
    assert_eq!(record["faces_out"], 400);

    let (featured, plain) =
        (read(&dir.path("feature.ply")).expect("a mesh"), sample("part", Some(4000)).expect("a sample"));
    assert_eq!(featured.faces, plain.faces);
    assert!(featured.colors.is_some());
    let degrees = read_property(&dir.path("feature.ply"), "feature").expect("the degrees");
    assert!(degrees.len() == plain.positions.len() && degrees.iter().all(|degree| (0.0..=1.0).contains(degree)));
    assert!(degrees.contains(&0.0) && degrees.iter().any(|&degree| degree > 0.05));

    // The degrees alone are what the mode 'contrast' with this floor counts, but for its least weight.
    let contract = "-f 400 -g cpu --metric plane --placement endpoint";
    dir.run(&format!("simplify feature.ply a.ply {contract} --weight ply:feature")).succeeds();
    let text: String = degrees.iter().map(|degree| format!("{degree}\n")).collect();
    dir.file("weights.txt", format!("# one a vertex\n{text}"));
    dir.run(&format!("simplify feature.ply b.ply {contract} --weight weights.txt")).succeeds();
    dir.run(&format!("simplify feature.ply c.ply {contract}")).succeeds();
    let [a, b, c] = ["a.ply", "b.ply", "c.ply"].map(|name| fs::read(dir.path(name)).expect("a file"));
    assert!(a == b && a != c);
}

#[test]
fn options_of_features_change_the_result() {
    let dir = Dir::new();
    dir.run("simplify sample:statue@4k plain.ply -f 400 -g cpu --method feature").succeeds();
    let plain = fs::read(dir.path("plain.ply")).expect("a file");
    for (i, options) in [
        "--feature-mode gated",
        "--feature-mode contrast",
        "--feature-mode entropy",
        "--feature-lambda 9",
        "--feature-floor 3",
        "--feature-update recompute",
        "--placement optimal",
        "--metric volume",
    ]
    .iter()
    .enumerate()
    {
        dir.run(&format!("simplify sample:statue@4k {i}.ply -f 400 -g cpu --method feature {options}")).succeeds();
        assert!(fs::read(dir.path(&format!("{i}.ply"))).expect("a file") != plain, "{options}");
    }
}

#[test]
fn bad_weights_are_told() {
    let dir = Dir::new();
    dir.file("in.obj", crate::TETRAHEDRON);
    dir.run("simplify in.obj in.ply -f 4").succeeds();
    dir.file("three", "1\n2\n3\n").file("nan", "1\n1\nnan\n1\n").file("minus", "1\n1\n1\n-2\n").file("word", "1\nx\n");
    for (options, code, part) in [
        ("--weight three", 2, "3 weights for a mesh of 4 vertices"),
        ("--weight nan", 2, "the weight of vertex 2 is NaN"),
        ("--weight minus", 2, "the weight of vertex 3 is -2"),
        ("--weight word", 4, "text line 2: found 'x'"),
        ("--weight missing.txt", 4, "missing.txt"),
        ("--weight ply:", 2, "give the property a name"),
        ("--weight ply:mass", 2, "the vertices have no number 'mass', they have: x, y, z"),
        ("--feature-lambda 3", 2, "--feature-lambda is for --method feature"),
        ("--method feature --feature-lambda -3", 2, "number from 0"),
        ("--write-feature out.ply", 2, "is the output as well"),
        ("--write-feature in.ply", 2, "is the input as well"),
        ("--write-feature three.txt", 2, "is no PLY"),
    ] {
        dir.run(&format!("simplify in.ply out.ply -f 4 {options}")).fails(code, &[part]);
    }
    dir.run("simplify in.obj out.ply -f 4 --weight ply:mass").fails(2, &["'in.obj' is no PLY file"]);
    dir.file("there.ply", "");
    dir.run("simplify in.obj out.ply -f 4 --write-feature there.ply").fails(8, &["give -w"]);
    assert!(!dir.files().contains(&"out.ply".into()));
}
