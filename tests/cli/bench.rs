//! `coarsen bench`: tiny meshes, every figure, the picture, wrong uses.

use std::fs;

use serde_json::Value;

use crate::{Dir, TETRAHEDRON};

/// The names in a list of objects with names.
fn names<'a>(list: &'a Value, key: &str) -> Vec<&'a str> {
    list.as_array().expect("a list").iter().map(|item| item[key].as_str().expect("a name")).collect()
}

#[test]
fn papers_have_their_tables() {
    let dir = Dir::new();
    let ran = dir.run("bench --papers sample:part@2k sample:room@2k --repeats 1 -j 2 -q --plot curves.svg").succeeds();
    let text = String::from_utf8(ran.out).expect("text in UTF-8");
    assert!(ran.err.is_empty() && text.starts_with("# The papers' tables by coarsen "), "{text}");
    let lines_of = |title: &str| -> Vec<&str> {
        let (_, part) = text.split_once(&format!("\n## [{title}]")).unwrap_or_else(|| panic!("no {title} in {text}"));
        part.lines().take_while(|line| !line.starts_with("## ")).filter(|line| line.starts_with("| ")).collect()
    };
    // Heads, rules, and a row for each share and quadric, each method, each format, the mesh and each timed format.
    assert_eq!(["Wu12", "Yang13", "Yu14"].map(|title| lines_of(title).len()), [2 + 9, 2 + 10, 2 + 8 + 2 + 1 + 2 + 6]);
    // A row for each solver; for each pair, each color and what has it, each step of either curve and its rise.
    assert_eq!(["Jin09", "Liu99"].map(|title| lines_of(title).len()), [2 + 5, 2 + 4 + 2 + 5 * 3 + 2 * (2 + 10 + 1)]);
    // The sample is no cow: nothing of the paper's is beside it.
    assert!(lines_of("Wu12")[2..].iter().all(|row| row.starts_with("| sample:part@2k |") && row.contains(" | -")));
    assert!(lines_of("Yu14").iter().any(|row| row.starts_with("| local16 ") && row.contains(" 12 ")));
    assert!(lines_of("Jin09")[2..].iter().all(|row| row.starts_with("| sample:part@2k |") && row.contains(" 100 ")));
    // What has light is judged by it, and by nothing else.
    assert!(
        lines_of("Liu99")[2..6].iter().all(|row| row.starts_with("| sample:room@2k |"))
            && !lines_of("Wu12").join("").contains("room")
    );
    let picture = fs::read_to_string(dir.path("curves.svg")).expect("a picture");
    assert!(picture.starts_with("<svg") && picture.matches("sample:room@2k").count() == 2, "{picture}");
    let wrong = dir.run("bench --papers sample:part@2k --ratio 5%");
    assert!(wrong.err.contains("--papers"), "{}", wrong.err);
}

#[test]
fn papers_draw_only_what_has_light() {
    let dir = Dir::new();
    let wrong = dir.run("bench --papers sample:part@2k --plot curves.svg -q");
    assert!(wrong.code == Some(2) && wrong.err.contains("sample:room"), "{}", wrong.err);
    let ran = dir.run("bench --papers sample:part@1k --repeats 1 -j 2 -q").succeeds();
    let text = String::from_utf8(ran.out).expect("text in UTF-8");
    assert!(text.ends_with("sample:room and sample:office have.\n"), "{text}");
}

#[test]
fn json_has_every_figure() {
    let dir = Dir::new();
    let ran = dir.run("bench sample:part@1k --repeats 3 --samples 2k -g cpu,baseline -j 1,2 --json -q").succeeds();
    assert_eq!(ran.err, "");
    let record = ran.json();
    assert_eq!((&record["schema"], &record["repeats"]), (&1.into(), &3.into()));
    assert_eq!(record["version"], env!("CARGO_PKG_VERSION"));
    assert!(record["machine"]["cores"].as_u64() > Some(0) && record["machine"]["cpu"].is_string());
    assert_eq!(names(&record["devices"], "name"), ["cpu:1", "cpu:2", "meshopt", "meshopt-update"]);
    assert_eq!(record["devices"][1]["device"], "CPU, 2 threads");
    assert_eq!(record["baseline"].is_string(), cfg!(feature = "baseline"));

    let case = &record["cases"][0];
    let faces = case["faces"].as_u64().expect("a count");
    let jobs = case["jobs"].as_array().expect("jobs");
    assert_eq!(jobs.iter().map(|job| job["keep"].as_f64()).collect::<Vec<_>>(), [Some(0.1), Some(0.01)]);
    for job in jobs {
        let results = job["results"].as_array().expect("results");
        assert_eq!(results.len(), if cfg!(feature = "baseline") { 4 } else { 2 });
        assert_eq!(results[1]["same_bytes_as"], "cpu:1");
        for result in results {
            let second = |name: &str| result["seconds"][name].as_f64().expect("seconds");
            assert!(0.0 < second("min") && second("min") <= second("median") && second("median") <= second("max"));
            assert_eq!(result["seconds"]["runs"].as_array().map(Vec::len), Some(3));
            let speed = result["faces_per_second"].as_f64().expect("a speed");
            assert!((speed * second("median") / faces as f64 - 1.0).abs() < 1e-9);
            assert_eq!(result["repeatable"], true);
            if cfg!(target_os = "linux") {
                // The faces alone are 12 bytes each.
                assert!(result["peak_bytes"].as_u64() > Some(12 * faces), "{result}");
            }
        }
        // Equal outputs have one measurement, and a rival's is its own.
        assert_eq!(results[0]["deviation"], results[1]["deviation"]);
        for result in results {
            let rms = result["deviation"]["forward"]["distance"]["rms"].as_f64().expect("a deviation");
            let diagonal = result["deviation"]["diagonal"].as_f64().expect("a length");
            assert!(0.0 < rms && rms < diagonal, "{result}");
        }
        let first = &results[0];
        assert!(first["same_bytes_as"].is_null() && first["rounds"].as_u64() > Some(0));
        assert_eq!((&first["rounds_on_gpu"], &first["bytes_moved"]), (&0.into(), &0.into()));
        for phase in
            ["read", "weld", "build", "cost", "select", "filter", "apply", "transfer", "restore", "write", "total"]
        {
            assert!(first["phases"][phase].as_f64() >= Some(0.0), "{phase}");
        }
    }
}

#[test]
fn an_adapter_moves_bytes_and_makes_the_same() {
    let dir = Dir::new();
    let ran = dir.run("bench sample:part@2k --repeats 1 -r 10% --samples 1k -g cpu:1,software --json -q").succeeds();
    let record = ran.json();
    let software = &record["devices"][1];
    if software["failure"].is_string() {
        assert!(std::env::var_os("REQUIRE_GPU").is_none(), "{software}");
        return;
    }
    assert_eq!(software["is_software"], true);
    let result = &record["cases"][0]["jobs"][0]["results"][1];
    assert_eq!(result["same_bytes_as"], "cpu:1");
    assert!(result["rounds_on_gpu"].as_u64() > Some(0), "{result}");
    // The surface goes up once at least: 12 bytes a face.
    assert!(result["bytes_moved"].as_u64() > Some(12 * 2000), "{result}");
}

#[test]
fn tables_have_a_row_a_device_and_say_who_is_missing() {
    let dir = Dir::new();
    let ran = dir.run("bench sample:part@1k --faces 500 --repeats 1 --samples 2k -g cpu:1,cpu:2,nonesuch").succeeds();
    let text = String::from_utf8(ran.out).expect("Markdown in UTF-8");
    assert!(text.starts_with("# coarsen "), "{text}");
    for part in [
        "## sample:part@1k: ",
        "### To 500 faces",
        "same bytes as cpu:1",
        "| cpu:2    | CPU, 2 threads",
        "| cpu:1, cpu:2 ",
    ] {
        assert!(text.contains(part), "expected '{part}' in\n{text}");
    }
    let missing = text.lines().find(|line| line.starts_with("| nonesuch")).expect("a row");
    assert!(missing.contains("not run: ") && !text.contains("cpu:3"), "{missing}");
    // Every row of a table has its columns, and tables are apart.
    let mut columns = 0;
    for line in text.lines() {
        let found = line.matches('|').count();
        assert!(found == 0 || columns == 0 || found == columns, "{line}");
        columns = found;
    }
    assert!(ran.err.contains("sample:part@1k to 500 faces"), "{}", ran.err);
}

/// Checks that tags are closed in order, and returns the texts between them.
fn svg_texts(svg: &str) -> Vec<&str> {
    let mut open = Vec::new();
    let mut texts = Vec::new();
    for piece in svg.split('<').skip(1) {
        let (tag, text) = piece.split_once('>').expect("a closed tag");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().expect("a name"));
        }
        texts.push(text.trim());
    }
    assert!(open.is_empty(), "{open:?}");
    texts
}

#[test]
fn the_picture_names_every_device() {
    let dir = Dir::new();
    dir.run("bench sample:part@1k --repeats 1 --samples 1k -g cpu:1,cpu:2 --plot bars.svg").succeeds();
    let bars = fs::read_to_string(dir.path("bars.svg")).expect("a picture");
    assert!(bars.starts_with("<svg ") && bars.matches("<rect ").count() == 1 + 4, "{bars}");
    let texts = svg_texts(&bars);
    assert_eq!(texts.iter().filter(|text| **text == "cpu:1").count(), 2);

    dir.run("bench --scale part --sizes 1k,2k --repeats 1 -g cpu:1 --plot bars.svg")
        .fails(8, &["'bars.svg' exists: give -w to replace it"]);
    dir.run("bench --scale part --sizes 1k,2k --repeats 1 -g cpu:1 --plot bars.svg -w").succeeds();
    let lines = fs::read_to_string(dir.path("bars.svg")).expect("a picture");
    assert!(svg_texts(&lines).iter().any(|text| text.starts_with("cpu:1 (power ")), "{lines}");
    assert_eq!(dir.files(), ["bars.svg"]);
}

#[test]
fn growth_is_told_by_device() {
    let dir = Dir::new();
    let line = "bench --scale part --sizes 1k,2k,4k --repeats 1 -r 10% -g cpu:1,cpu:2";
    let record = dir.run(&format!("{line} --json -q")).succeeds().json();
    assert_eq!(names(&record["cases"], "input"), ["sample:part@1k", "sample:part@2k", "sample:part@4k"]);
    assert_eq!(names(&record["growth"], "device"), ["cpu:1", "cpu:2"]);
    assert!(record["growth"][0]["exponent"].is_f64() && record["samples"].is_null());
    let text = String::from_utf8(dir.run(line).succeeds().out).expect("Markdown in UTF-8");
    for part in ["## sample:part by size", "| 1k: ms |", "| power |"] {
        assert!(text.contains(part), "expected '{part}' in\n{text}");
    }
}

#[test]
fn wrong_uses_are_told() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("empty.obj", "v 0 0 0\n");
    for (line, code, part) in [
        ("bench -", 2, "no standard input"),
        ("bench in.obj --repeats 0", 2, "1..=1000"),
        ("bench in.obj -j 0", 2, "1..=1024"),
        ("bench in.obj -g cpu:0", 2, "cpu:N"),
        ("bench in.obj -g cpu,", 2, "empty"),
        ("bench in.obj -r 50", 2, "50%"),
        ("bench in.obj --scale part", 2, "--scale"),
        ("bench --scale horse", 2, "error: invalid parameter: no sample 'horse', there are: statue"),
        ("bench --sizes 1k", 2, "--scale"),
        ("bench in.obj --plot out.png", 2, "ends in .svg"),
        ("bench in.obj --plot none/out.svg", 8, "cannot write 'none/out.svg'"),
        ("bench missing.ply", 4, "missing.ply"),
        ("bench empty.obj -g cpu:1 -q", 4, "no faces"),
        ("bench in.obj -g nonesuch", 7, "nothing to run: nonesuch: "),
        ("bench - -g cpu:x --plot out.png", 2, "3 problems"),
    ] {
        let ran = dir.run(line);
        assert!(ran.out.is_empty() && ran.code == Some(code), "{line}: {:?} {}", ran.code, ran.err);
        assert!(ran.err.contains(part), "{line}: expected '{part}' in\n{}", ran.err);
    }
    assert_eq!(dir.files(), ["empty.obj", "in.obj"]);
}

#[test]
fn a_mesh_that_cannot_shrink_is_measured_all_the_same() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    let record = dir.run("bench in.obj --repeats 1 -r 1% --samples 100 -g cpu:1 --json -q").succeeds().json();
    assert_eq!(record["cases"][0]["jobs"][0]["results"][0]["faces_out"], 4);
}
