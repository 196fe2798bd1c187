//! `coarsen lod`: names, levels, the manifest, one list of vertices, what is refused.

use std::fs;

use coarsen::formats;
use serde_json::Value;

use crate::{Dir, TETRAHEDRON, TEXTURED};

fn faces(dir: &Dir, name: &str) -> usize {
    formats::read(&dir.path(name)).expect("a mesh").faces.len()
}

#[test]
fn every_level_is_a_file() {
    let dir = Dir::new();
    let ran = dir.run("lod sample:statue@2k out-{level}.ply --ratios 50%,10%,5% -g cpu --json").succeeds();
    assert_eq!(dir.files(), ["out-1.ply", "out-2.ply", "out-3.ply"]);
    let record = ran.json();
    let levels = record["levels"].as_array().expect("levels");
    for (level, (number, expected)) in levels.iter().zip((1..).zip([0.5, 0.1, 0.05])) {
        let asked = (record["faces_in"].as_f64().expect("a count") * expected).round() as u64;
        let name = format!("out-{number}.ply");
        assert_eq!((level["level"].as_u64(), level["output"].as_str()), (Some(number), Some(name.as_str())), "{level}");
        assert_eq!((level["target"].as_u64(), level["reached"].as_bool()), (Some(asked), Some(true)), "{level}");
        assert_eq!(level["faces"].as_u64(), Some(faces(&dir, &name) as u64), "{level}");
        assert!(
            ran.err.contains(&format!("level {number}: {} faces, stop=faces_reached", level["faces"])),
            "{}",
            ran.err
        );
    }
    assert!(ran.err.contains("→ 3 levels, read "), "{}", ran.err);
    // What the run spent on its phases, those of all levels.
    let seconds = |phase: &str| record["seconds"][phase].as_f64().expect("seconds");
    let spent = ["weld", "build", "cost", "select", "filter", "apply", "restore"].map(seconds);
    assert!(spent.iter().all(|&secs| secs > 0.0) && spent.iter().sum::<f64>() <= seconds("solve"), "{spent:?}");
}

#[test]
fn verbose_tells_rounds_once_where_there_is_one_run() {
    let dir = Dir::new();
    let told = |method: &str| {
        let line = format!("lod sample:statue@2k out-{{level}}.ply --ratios 50%,10% -g cpu -v -w {method}");
        dir.run(&line).succeeds().err
    };
    let (contract, removal) = (told(""), told("--method removal"));
    assert_eq!(contract.matches("round       faces       pairs").count(), 1, "{contract}");
    assert_eq!(removal.matches("round       faces       pairs").count(), 2, "{removal}");
    assert!(removal.contains("level 2:\nround "), "{removal}");
}

#[test]
fn a_chain_of_one_is_what_simplify_writes() {
    let dir = Dir::new();
    dir.run("lod sample:part@2k lod.ply -f 400 -g cpu").succeeds();
    dir.run("simplify sample:part@2k one.ply -f 400 -g cpu").succeeds();
    let [lod, one] = ["lod.ply", "one.ply"].map(|name| fs::read(dir.path(name)).expect("a mesh"));
    assert!(lod == one);
}

#[test]
fn names_follow_the_pattern() {
    let dir = Dir::new();
    dir.run("lod sample:part@1k {stem}_{ratio}.obj --levels 3 -g cpu -q").succeeds();
    dir.run("lod sample:part@1k a{faces}.stl -f 500,40 -g cpu -q").succeeds();
    dir.run("lod sample:part@1k b{level}.off --levels 2 --ratio-step 10% -g cpu -q").succeeds();
    dir.run("lod sample:part@1k c{level}.off -g cpu -q").succeeds();
    assert_eq!(
        dir.files(),
        [
            "a40.stl",
            "a500.stl",
            "b1.off",
            "b2.off",
            "c1.off",
            "c2.off",
            "c3.off",
            "c4.off",
            "part_12.5.obj",
            "part_25.obj",
            "part_50.obj"
        ]
    );
}

#[test]
fn levels_by_errors_and_distances() {
    let dir = Dir::new();
    let ran = dir.run("lod sample:part@2k e{level}.ply --errors 0.01%,0.1%,1% -g cpu --json").succeeds();
    let counts: Vec<u64> =
        ran.json()["levels"].as_array().expect("levels").iter().filter_map(|l| l["faces"].as_u64()).collect();
    assert!(counts.len() == 3 && counts.is_sorted_by(|a, b| a > b), "{counts:?}");
    // At 90° a picture of 1000 pixels shows twice the distance: two pixels at 100 are 0.4.
    let screen = "--screen-error 2 --screen-height 1000 --fov 90";
    let line = format!("lod sample:part@2k d{{level}}.ply --distances 100,1000 {screen} -g cpu --json");
    let ran = dir.run(&line).succeeds();
    assert!(ran.err.contains(", from a distance of "), "{}", ran.err);
    let record = ran.json();
    for (level, distance) in record["levels"].as_array().expect("levels").iter().zip([100.0, 1000.0]) {
        let estimate = level["error"]["estimate"].as_f64().expect("a number");
        assert!(estimate <= 0.004 * distance * (1.0 + 1e-6), "{level}");
        let switch = level["switch_distance"].as_f64().expect("a number");
        assert!((switch - estimate / 0.004).abs() < 1e-6 * distance, "{level}");
    }
    assert_eq!(record["screen"]["error"], "estimate");
}

#[test]
fn the_manifest_tells_an_engine_all_and_nothing_of_the_machine() {
    let dir = Dir::new();
    fs::create_dir(dir.path("lod")).expect("a folder");
    let line =
        "lod sample:part@2k lod/{level}.ply --ratios 50%,10% --manifest lod/part.json --measure --samples 20k -g cpu";
    dir.run(&format!("{line} -j 1")).succeeds();
    let text = fs::read(dir.path("lod/part.json")).expect("the manifest");
    let manifest: Value = serde_json::from_slice(&text).expect("JSON");
    let levels = manifest["levels"].as_array().expect("levels");
    assert_eq!(levels.iter().map(|level| level["file"].as_str()).collect::<Vec<_>>(), [Some("1.ply"), Some("2.ply")]);
    let number = |value: &Value| value.as_f64().expect("a number");
    let [radius, diagonal] = [&manifest["sphere"]["radius"], &manifest["diagonal"]].map(number);
    assert!(radius <= 0.5 * diagonal * (1.0 + 1e-9) && radius > 0.2 * diagonal, "{manifest}");
    assert_eq!(manifest["screen"]["error"], "measured");
    for level in levels {
        let [measured, switch] = [&level["error"]["measured"]["max"], &level["switch_distance"]].map(number);
        let view = 2.0 * (30.0_f64).to_radians().tan() / 1080.0;
        assert!((switch * view - measured).abs() < 1e-9 * diagonal, "{level}");
    }
    dir.run(&format!("{line} -w -j 2")).succeeds();
    assert!(fs::read(dir.path("lod/part.json")).expect("the manifest") == text);
}

#[test]
fn shared_vertices_are_one_list_of_which_levels_use_the_first() {
    let dir = Dir::new();
    let line = "lod sample:part@2k all.obj --ratios 50%,20%,5% --shared-vertices -g cpu --json";
    let levels = dir.run(line).succeeds().json()["levels"].clone();
    let text = fs::read_to_string(dir.path("all.obj")).expect("text");
    assert_eq!(text.matches("\no lod").count(), 3);
    let objects: Vec<&str> = text.split("\no lod").skip(1).collect();
    for (object, level) in objects.iter().zip(levels.as_array().expect("levels")) {
        let corners = object.lines().skip(1).flat_map(|line| line.split_whitespace().skip(1));
        let greatest = corners.map(|corner| corner.parse::<u64>().expect("an index")).max();
        assert_eq!(greatest, level["vertices"].as_u64(), "{level}");
        assert_eq!(Some(object.lines().skip(1).count() as u64), level["faces"].as_u64(), "{level}");
    }
    assert_eq!(text.lines().filter(|line| line.starts_with("v ")).count() as u64, levels[0]["vertices"]);

    let line = "lod sample:part@2k all.ply.gz --ratios 50%,20%,5% --shared-vertices --manifest all.json -g cpu";
    dir.run(line).succeeds();
    assert_eq!(dir.files(), ["all.idx", "all.json", "all.obj", "all.ply.gz"]);
    let mesh = formats::read(&dir.path("all.ply.gz")).expect("a mesh");
    let indices: Vec<u32> = fs::read(dir.path("all.idx"))
        .expect("indices")
        .chunks_exact(4)
        .map(|bytes| u32::from_le_bytes(bytes.try_into().expect("four bytes")))
        .collect();
    let manifest: Value = serde_json::from_slice(&fs::read(dir.path("all.json")).expect("JSON")).expect("JSON");
    assert_eq!(manifest["indices"], "all.idx");
    let mut next = 0;
    for level in manifest["levels"].as_array().expect("levels") {
        let number = |value: &Value| value.as_u64().expect("a count") as usize;
        let [first, count] = [&level["indices"]["first"], &level["indices"]["count"]].map(number);
        assert_eq!((first, count), (next, 3 * number(&level["faces"])), "{level}");
        next += count;
        let greatest = indices[first..next].iter().max().map(|&index| index as usize + 1);
        assert_eq!(greatest, Some(number(&level["vertices"])), "{level}");
    }
    assert_eq!(next, indices.len());
    assert_eq!(mesh.faces.as_flattened(), &indices[..3 * mesh.faces.len()]);
}

#[test]
fn a_log_of_the_chain_leads_to_every_level() {
    let dir = Dir::new();
    dir.run("lod sample:statue@2k out-{level}.ply -f 1k,400,100 -g cpu --write-log statue.clog").succeeds();
    for (level, faces) in [(1, 1000), (2, 400), (3, 100)] {
        dir.run(&format!("replay sample:statue@2k statue.clog again.ply -w -f {faces}")).succeeds();
        let [own, again] =
            [format!("out-{level}.ply"), "again.ply".into()].map(|name| fs::read(dir.path(&name)).expect("a mesh"));
        assert!(own == again, "level {level}");
    }
}

#[test]
fn a_level_that_is_missed_is_told() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    let ran = dir.run("lod in.obj {level}.obj -f 4,2 -g cpu").succeeds();
    assert!(ran.err.contains("level 2: 4 faces, stop=stuck, blocked by "), "{}", ran.err);
    dir.run("lod in.obj {level}.obj -f 4,2 -g cpu -w --require-target")
        .fails(3, &["level 2 is not reached: 4 faces are left of 2 asked for (stop=stuck"]);
    assert_eq!(dir.files(), ["1.obj", "2.obj", "in.obj"]);
}

#[test]
fn wrong_uses_are_refused_before_the_work() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("1.ply", "").file("textured.obj", TEXTURED);
    for (line, part) in [
        ("lod in.obj", "<OUT_PATTERN>"),
        ("lod in.obj out.ply", "'out.ply' is one name for several of 4 levels: put {level} into 'out.ply'"),
        ("lod in.obj {name}.ply", "known are {dir}, {stem}, {ext}, {level}, {ratio} and {faces}"),
        ("lod in.obj {level.ply", "brace without its other"),
        ("lod in.obj -", "levels go to files"),
        ("lod in.obj {ratio}.ply -f 3,2", "{ratio} in a pattern needs ratios"),
        ("lod in.obj {faces}.ply", "{faces} in a pattern needs numbers of faces"),
        ("lod in.obj {level}.ply -f 3,2 -r 50%", "--ratios and --faces contradict each other"),
        ("lod in.obj {level}.ply --distances 1,2 --levels 3", "--distances and --levels contradict each other"),
        ("lod in.obj {level}.ply -r 10%,50%", "--ratios go from fine to coarse, without repeats: such as 50%,10%,1%"),
        ("lod in.obj {level}.ply -f 3,3", "--faces go from fine to coarse"),
        ("lod in.obj {level}.ply -e 1%,0.1%", "--errors go from fine to coarse, without repeats: such as 0.1%,0.5%,1%"),
        ("lod in.obj {level}.ply --distances 9,1", "such as 0.5,5,50"),
        ("lod in.obj {level}.ply -r 50", "write 50% for a percentage"),
        ("lod in.obj {level}.ply --levels 0", "1..=64"),
        ("lod in.obj {level}.ply --ratio-step 1", "above 0 and below 1"),
        ("lod in.obj {level}.ply --fov 180", "below 180"),
        ("lod in.obj {level}.ply --screen-error 0", "above 0"),
        ("lod in.obj {level}.obj --format ply", "--format is for '-'"),
        ("lod in.obj in.obj -f 3", "is the input as well"),
        ("lod in.obj {level}.obj --manifest 1.obj", "give --manifest another name"),
        ("lod in.obj {level}.obj --write-log 2.obj", "give --write-log another name"),
        ("lod in.obj {level}.obj --write-log a --manifest a", "give --manifest another name"),
        ("lod in.obj {level}.obj --write-log a --fit 1", "--write-log and --fit contradict"),
        ("lod in.obj {level}.obj -q -v", "--quiet and --verbose"),
        ("lod in.obj {level}.obj --fill ears", "are for --method removal"),
        ("lod in.obj {level}.obj --shared-vertices", "leave what tells them out of '{level}.obj'"),
        ("lod in.obj x.ply --shared-vertices", "needs --manifest"),
        ("lod in.obj x.stl --shared-vertices", "STL has no vertices to share"),
        ("lod in.obj x.obj --shared-vertices --placement optimal", "needs contraction with --placement endpoint"),
        ("lod in.obj x.obj --shared-vertices --method removal", "needs contraction with --placement endpoint"),
    ] {
        dir.run(line).fails(2, &[part]);
    }
    dir.run("lod in.obj {level}.ply").fails(8, &["'1.ply' exists: give -w"]);
    dir.run("lod in.obj none/{level}.ply").fails(8, &["none"]);
    dir.run("lod missing.obj {level}.ply").fails(4, &["missing.obj"]);
    dir.run("lod in.obj {level}.step").fails(5, &["'.step'"]);
    assert_eq!(dir.files(), ["1.ply", "in.obj", "textured.obj"]);
}
