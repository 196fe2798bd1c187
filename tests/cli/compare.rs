//! `coarsen compare` and `simplify --measure`.

use std::fs;

use serde_json::Value;

use crate::{Dir, TETRAHEDRON};

/// The tetrahedron with its top pulled from 1 to 1.5.
fn pulled() -> String {
    TETRAHEDRON.replace("v 0 0 1", "v 0 0 1.5")
}

fn keys(value: &Value) -> Vec<String> {
    let mut keys: Vec<String> = value.as_object().map(|map| map.keys().cloned().collect()).unwrap_or_default();
    keys.sort_unstable();
    keys
}

#[test]
fn a_mesh_is_no_way_from_itself() {
    let dir = Dir::new();
    let record = dir.run("compare sample:part@2k sample:part@2k -g cpu --json").succeeds().json();
    for side in ["forward", "backward"] {
        let distance = &record[side]["distance"];
        let most = 1e-12 * record["diagonal"].as_f64().expect("a length");
        assert!(distance["max"].as_f64().is_some_and(|max| max <= most), "{distance}");
    }
    assert_eq!(record["topology"]["a"], record["topology"]["b"]);
    assert_eq!(record["quality"]["a"], record["quality"]["b"]);
}

#[test]
fn the_table_has_known_answers() {
    let dir = Dir::new();
    dir.file("a.obj", TETRAHEDRON).file("b.obj", pulled());
    let ran = dir.run("compare a.obj b.obj -g cpu --view 5,90,1000").succeeds();
    let table = String::from_utf8(ran.out).expect("a table in UTF-8");
    // B's top is the farthest from A: 0.5 above A's top, whose edges and faces are steeper than 45°.
    for row in [
        "A  a.obj",
        "B  b.obj",
        "                                A to B        B to A     symmetric % of diagonal",
        "                                     A             B",
        "vertices                             4             4",
        "Euler characteristic                 2             2",
        "genus                                0             0",
        "border edges                         0             0",
        "faces below 10°                 0.00 %        0.00 %",
        "diagonal of A           1.7321",
        "farthest from A         0  0  1.5000",
    ] {
        assert!(table.lines().any(|line| line == row), "no line '{row}' in\n{table}");
    }
    let greatest = table.lines().find(|line| line.starts_with("distance, greatest")).expect("a row");
    let cells: Vec<&str> = greatest.split_whitespace().skip(2).collect();
    assert_eq!(cells[1..], ["0.50000", "0.50000", "28.868"], "{table}");
    // At 5 units and 90 degrees the picture is 10 units high.
    assert!(table.contains("on the screen           50.000 pixels at most, "), "{table}");
}

#[test]
fn json_has_its_fields() {
    let dir = Dir::new();
    dir.file("a.obj", TETRAHEDRON).file("b.obj", pulled());
    let record = dir.run("compare a.obj b.obj -g cpu -j 1 --json --samples 1k --seed 7").succeeds().json();
    let expected = [
        "a",
        "b",
        "backward",
        "device",
        "diagonal",
        "forward",
        "heatmap",
        "images",
        "kinds",
        "peak_memory",
        "picture",
        "quality",
        "relative",
        "samples",
        "schema",
        "screen",
        "seconds",
        "seed",
        "symmetric",
        "texture",
        "texture_materials",
        "topology",
        "version",
    ];
    assert_eq!(keys(&record), expected);
    assert_eq!(keys(&record["forward"]), ["colors", "distance", "normals", "samples", "worst"]);
    assert_eq!(keys(&record["forward"]["normals"]), ["max_rad", "mean_rad", "p95_rad"]);
    for spread in ["symmetric", "relative"] {
        assert_eq!(keys(&record[spread]), ["max", "mean", "rms"]);
    }
    assert_eq!(keys(&record["seconds"]), ["draw", "measure", "read", "total"]);
    assert_eq!(keys(&record["quality"]["a"]), ["below_10_degrees", "mean_ratio", "min_angle_rad", "ratio_histogram"]);
    for (field, value) in [
        ("schema", Value::from(1)),
        ("a", "a.obj".into()),
        ("b", "b.obj".into()),
        ("device", "CPU, 1 thread".into()),
        ("samples", 1000.into()),
        ("seed", 7.into()),
        ("images", Value::Null),
        ("screen", Value::Null),
        ("texture", Value::Null),
        ("heatmap", Value::Null),
        ("picture", Value::Null),
    ] {
        assert_eq!(record[field], value, "{field}");
    }
    assert_eq!(record["symmetric"]["max"], 0.5);
    let swapped = dir.run("compare b.obj a.obj -g cpu --json --samples 1k --seed 7").succeeds().json();
    assert_eq!((&swapped["forward"], &swapped["backward"]), (&record["backward"], &record["forward"]));
}

#[test]
fn colors_are_compared_where_both_have_them() {
    let dir = Dir::new();
    let colored = |rgb: &str| {
        let rows = TETRAHEDRON
            .lines()
            .map(|line| if line.starts_with('v') { format!("{line} {rgb}\n") } else { format!("{line}\n") });
        rows.collect::<String>()
    };
    dir.file("plain.obj", TETRAHEDRON).file("black.obj", colored("0 0 0")).file("white.obj", colored("1 1 1"));
    let record = dir.run("compare black.obj white.obj -g cpu --json").succeeds().json();
    let luv = &record["forward"]["colors"]["luv"];
    assert!(luv["mean"].as_f64().is_some_and(|mean| (mean - 100.0).abs() < 1e-3), "{luv}");
    let table = String::from_utf8(dir.run("compare black.obj white.obj -g cpu").succeeds().out).expect("UTF-8");
    assert!(table.lines().any(|line| line.starts_with("colors L*u*v*, mean") && line.contains("100.00")), "{table}");
    let record = dir.run("compare black.obj plain.obj -g cpu --json").succeeds().json();
    assert_eq!(record["forward"]["colors"], Value::Null);
}

#[test]
fn textures_are_compared_where_both_have_them() {
    let dir = Dir::new();
    let square = |v: &str| {
        format!(
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 {v}\nvt 0 {v}\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
        )
    };
    dir.file("a.obj", square("1")).file("b.obj", square("2"));
    let record = dir.run("compare a.obj b.obj -g cpu --json").succeeds().json();
    // What is at height y on A is at y / 2 on B.
    let greatest = record["texture"]["mapping_distance"].as_f64().expect("a length");
    assert!((greatest - 0.5).abs() < 1e-6, "{greatest}");
    let table = String::from_utf8(dir.run("compare a.obj b.obj -g cpu").succeeds().out).expect("UTF-8");
    assert!(table.lines().any(|line| line == "texture, mapping        0.50000"), "{table}");
}

#[test]
fn images_show_what_materials_do() {
    let dir = Dir::new();
    let square = |material: &str| {
        format!("mtllib colors.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl {material}\nf 1 2 3\nf 1 3 4\n")
    };
    dir.file("colors.mtl", "newmtl black\nKd 0\nnewmtl gray\nKd 0.5\nnewmtl lost\nKd 0.5\nmap_Kd gone.png\n");
    dir.file("black.obj", square("black")).file("gray.obj", square("gray")).file("lost.obj", square("lost"));
    let record = dir.run("compare black.obj gray.obj -g cpu --images --json").succeeds().json();
    let images = &record["images"];
    assert_eq!((keys(images), keys(&images["greatest"])), (keys_of("greatest rmse"), keys_of("rmse view")));
    // Half of what a white square sends to the eye.
    let rmse = images["rmse"].as_f64().expect("a number");
    assert!((rmse - 0.5 * (0.92_f64 * 0.80773).sqrt()).abs() < 1e-4, "{images}");
    assert_eq!(images["greatest"]["view"], "+z");
    let ran = dir.run("compare gray.obj lost.obj -g cpu --images").succeeds();
    let table = String::from_utf8(ran.out.clone()).expect("UTF-8");
    assert!(table.lines().any(|line| line == "images, six sides       0 root mean square, 0 from +x"), "{table}");
    assert!(ran.err.contains("warning: 'lost.obj': the texture 'gone.png' is not drawn: cannot read"), "{}", ran.err);
    // Nobody looks, nothing is missed.
    let ran = dir.run("compare gray.obj lost.obj -g cpu").succeeds();
    assert!(!ran.err.contains("texture"), "{}", ran.err);
}

fn keys_of(words: &str) -> Vec<String> {
    words.split(' ').map(Into::into).collect()
}

#[test]
fn heat_map_and_picture_are_written() {
    let dir = Dir::new();
    let line = "compare sample:part@2k sample:part@1k -g cpu --heatmap hot.ply --picture out.png";
    dir.run(line).succeeds();
    let png = fs::read(dir.path("out.png")).expect("a picture");
    let info = png::Decoder::new(std::io::Cursor::new(&png)).read_info().expect("a PNG").info().size();
    assert_eq!(info.0, 1800);
    let facts = dir.run("inspect hot.ply --json").succeeds().json();
    assert_eq!(facts["has_colors"], true);
    assert_eq!(dir.files(), ["hot.ply", "out.png"]);

    dir.run(line).fails(8, &["'hot.ply' exists: give -w to replace it", "'out.png' exists"]);
    dir.run(&format!("{line} -w -j 1")).succeeds();
    assert!(png == fs::read(dir.path("out.png")).expect("a picture"), "the threads show");
    dir.run(&format!("{line} -w --views 2 --up y --heat-limit 1")).succeeds();
    assert!(png != fs::read(dir.path("out.png")).expect("a picture"));
}

#[test]
fn pictures_of_gltf_stand_upright() {
    let dir = Dir::new();
    dir.run("simplify sample:part@2k part.glb -r 50% -g cpu").succeeds();
    let picture = |up: &str| {
        dir.run(&format!("compare part.glb part.glb -g cpu --picture up.png --width 600 -w {up}")).succeeds();
        fs::read(dir.path("up.png")).expect("a picture")
    };
    assert!(picture("") == picture("--up y") && picture("") != picture("--up z"));
}

#[test]
fn what_cannot_be_compared_is_told() {
    let dir = Dir::new();
    dir.file("a.obj", TETRAHEDRON)
        .file("nan.obj", TETRAHEDRON.replace("v 0 0 1", "v 0 0 nan"))
        .file("old.png", "precious");
    for (line, code, part) in [
        ("compare a.obj", 2, "<B>"),
        ("compare a.obj missing.obj", 4, "cannot read 'missing.obj'"),
        ("compare a.obj nan.obj", 4, "'nan.obj'"),
        ("compare a.obj sample:horse", 2, "there are: statue"),
        ("compare a.obj a.step", 4, "a.step"),
        ("compare - -", 2, "holds one mesh"),
        ("compare - a.obj", 2, "needs --format"),
        ("compare a.obj a.obj --samples 0", 2, "whole number"),
        ("compare a.obj a.obj --picture p.png --width 100", 2, "240..=9600"),
        ("compare a.obj a.obj --kinds edges", 2, "edges alone have no mean"),
        ("compare a.obj a.obj --kinds corners", 2, "vertices, edges and faces"),
        ("compare a.obj a.obj --samples nan", 2, "whole number"),
        ("compare a.obj a.obj --view 10,45", 2, "such as 10,45,1080"),
        ("compare a.obj a.obj --view 10,200,1080", 2, "between 0° and 180°"),
        ("compare a.obj a.obj --view 0,45,1080", 2, "distance"),
        ("compare a.obj a.obj --picture old.png", 8, "'old.png' exists: give -w"),
        ("compare a.obj a.obj --picture old.jpg", 2, "ends in .png"),
        ("compare a.obj a.obj --picture none/new.png", 8, "cannot write 'none/new.png'"),
        ("compare a.obj a.obj --heatmap hot.stl", 5, "STL carries no colors"),
        ("compare a.obj a.obj --heatmap a.obj -w", 2, "is the input as well"),
        ("compare a.obj a.obj --views 3 --picture new.png", 2, "3"),
        ("compare a.obj a.obj -g gpu:99", 7, "device: "),
    ] {
        dir.run(line).fails(code, &[part]);
    }
    assert_eq!(dir.files(), ["a.obj", "nan.obj", "old.png"]);
}

#[test]
fn a_mesh_comes_through_a_pipe() {
    let dir = Dir::new();
    dir.file("a.obj", TETRAHEDRON);
    let stdin = fs::File::open(dir.path("a.obj")).expect("the input");
    let output = dir.command("compare - a.obj --format obj -g cpu --json").stdin(stdin).output().expect("it runs");
    assert_eq!(crate::Ran::of(output).succeeds().json()["a"], "-");
}

#[test]
fn measure_tells_what_compare_tells() {
    let dir = Dir::new();
    let line = "simplify sample:part@3k out.off -f 500 -g cpu -w";
    let record = dir.run(&format!("{line} --measure --json")).succeeds().json();
    let measured = &record["error"]["measured"];
    assert_eq!(keys(measured), ["max", "max_relative", "mean", "mean_relative", "rms", "rms_relative"]);
    assert!(record["seconds"]["measure"].as_f64().is_some_and(|seconds| seconds > 0.0));
    let compared = dir.run("compare sample:part@3k out.off -g cpu --json").succeeds().json();
    for figure in ["max", "mean", "rms"] {
        assert_eq!(measured[figure], compared["symmetric"][figure]);
        assert_eq!(measured[format!("{figure}_relative")], compared["relative"][figure]);
    }
    let few = dir.run(&format!("{line} --measure --samples 500 --json")).succeeds().json();
    assert_ne!(few["error"]["measured"]["mean"], measured["mean"]);
    let words = dir.run(&format!("{line} --measure")).succeeds().err;
    assert!(
        words.lines().any(|line| line.starts_with("measured: greatest ") && line.contains("% of the diagonal, ")),
        "{words}"
    );
    assert_eq!(dir.run(&format!("{line} --json")).succeeds().json()["error"]["measured"], Value::Null);
    dir.run(&format!("{line} --samples 500")).fails(2, &["--measure"]);
}
