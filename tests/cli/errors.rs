//! What is refused, with which code and in which words.

use std::fs;

use crate::{Dir, Ran, TETRAHEDRON, TEXTURED};

fn ply(vertices: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n{body}"
    )
}

#[test]
fn wrong_arguments_are_usage_errors() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    dir.file("textured.obj", TEXTURED);
    for (line, part) in [
        ("simplify in.obj out.obj --frobnicate", "--frobnicate"),
        ("simplify in.obj", "<OUT>"),
        ("frobnicate", "'frobnicate'"),
        ("simplify in.obj out.obj -f many", "whole number"),
        ("simplify in.obj out.obj -f 0", "whole number"),
        ("simplify in.obj out.obj -f -4", "whole number"),
        ("simplify in.obj out.obj -f 10%", "--ratio 10%"),
        ("simplify in.obj out.obj -r 50", "write 50% for a percentage"),
        ("simplify in.obj out.obj -r 150%", "fraction from 0 to 1"),
        ("simplify in.obj out.obj -e -1", "fraction from 0 to 1"),
        ("simplify in.obj out.obj -f 4 --weld -1", "or 'off'"),
        ("simplify in.obj out.obj -f 4 --max-flip 91", "up to 90"),
        ("simplify in.obj out.obj -f 4 --memory-limit 8XB", "8GiB"),
        ("simplify in.obj out.obj", "no target"),
        ("simplify in.obj out.obj -f 4 -g gpu:x", "gpu:N"),
        ("simplify in.obj out.obj -f 4 --normals no", "possible values: keep, recompute, drop"),
        ("simplify in.obj out.obj -f 4 --drop uv,no", "possible values: normal, uv, color, material, other"),
        ("simplify in.obj out.obj -f 4 --attribute-weights normal", "NAME=WEIGHT"),
        ("simplify in.obj out.obj -f 4 --attribute-weights uv=1e7", "the weight of 'uv'"),
        ("simplify in.obj out.obj -f 4 --lock pin", "no channel 'pin' to lock vertices by: the mesh has none"),
        ("simplify in.obj out.obj -f 4 --method removal --lock pin", "--method removal takes --fill"),
        ("simplify in.obj out.obj -f 4 --seams no", "possible values: yield, hold"),
        ("simplify in.obj out.obj -f 4 --color-space hsv", "possible values: rgb, luv"),
        ("simplify in.obj out.obj -f 4 --candidates faces", "possible values: pairs, triangles"),
        ("simplify in.obj out.obj -f 4 --candidates triangles --metric volume", "give 'plane'"),
        ("simplify in.obj out.obj -f 4 --candidates triangles --placement segment", "a triangle has three"),
        ("simplify in.obj out.obj --method cluster --grid 0", "from 1 to 2097152"),
        ("simplify in.obj out.obj --method cluster --grid 9 -f 4", "--grid and another target"),
        ("simplify in.obj out.obj --method cluster -f 4 --lock-border", "no options of shape but --representative"),
        ("simplify in.obj out.obj --grid 9", "are for --method cluster"),
        ("simplify in.obj out.obj -f 4 --fill ears", "are for --method removal"),
        ("simplify in.obj out.obj -f 4 --method removal --fit 1", "--method removal takes --fill"),
        ("simplify in.obj out.obj -f 4 --method removal --feature-angle 200", "degrees from 0 to 180"),
        ("simplify in.obj out.obj -f 4 --representative mean", "are for --method cluster"),
        ("simplify in.obj out.obj --method cluster --grid 1", "the grid leaves no face: give a finer one"),
        ("simplify in.obj - -f 4", "standard output needs --format"),
        ("simplify - out.obj -f 4", "standard input needs --format"),
        ("simplify in.obj - -f 4 --format ply --json", "both the mesh"),
        ("simplify in.obj out.obj -f 4 --format ply", "--format is for '-'"),
        ("simplify in.obj out.obj -f 4 -q -v", "--quiet and --verbose"),
        ("simplify sample:horse out.obj -f 4", "there are: statue, part, terrain, assembly"),
        ("simplify sample:part@x out.obj -f 4", "sample:NAME@FACES"),
        ("sample part -", "a sample is written to a file"),
        ("simplify sample:part@10 out.obj -f 4", "1000"),
        ("simplify in.obj in.obj -f 4", "is the input as well"),
        ("simplify in.obj in.obj -f 4 -w", "is the input as well"),
        ("simplify in.obj ./in.obj -f 4 -w", "is the input as well"),
    ] {
        dir.run(line).fails(2, &[part]);
    }
    assert_eq!(dir.files(), ["in.obj", "textured.obj"]);
}

#[test]
fn all_contradictions_are_told_together() {
    Dir::new().run("simplify missing.ply - --json -q -v -g gpu:x").fails(
        2,
        &["6 problems:", "no target", "gpu:x", "both the mesh", "--verbose", "missing.ply", "needs --format"],
    );
}

#[cfg(unix)]
#[test]
fn a_link_to_the_input_is_the_input() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    std::os::unix::fs::symlink("in.obj", dir.path("link.obj")).expect("a link");
    dir.run("simplify in.obj link.obj -f 4 -w").fails(2, &["is the input as well"]);
    dir.run("simplify link.obj in.obj -f 4 -w").fails(2, &["is the input as well"]);
}

#[test]
fn a_required_target_that_is_missed_is_an_error_with_the_result_written() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON);
    dir.run("simplify in.obj out.obj -f 2 -g cpu --require-target").fails(
        3,
        &["4 → 4 faces, stop=stuck, blocked by", "the target is not reached: 4 faces are left of 2 asked for"]
            .map(|part| if part.starts_with("4 →") { "blocked by" } else { part }),
    );
    assert_eq!(dir.files(), ["in.obj", "out.obj"]);
    let ran = dir.run("simplify in.obj out.obj -w -f 2 -g cpu").succeeds();
    assert!(ran.err.contains("4 → 4 faces, stop=stuck, blocked by"), "{}", ran.err);
    dir.run("simplify in.obj out.obj -w -f 4 -g cpu --require-target").succeeds();
}

#[test]
fn bad_files_are_told_with_place_and_expectation() {
    let dir = Dir::new();
    let triangle = "0 0 0\n1 0 0\n0 1 0\n";
    dir.file("empty.ply", "")
        .file("text.ply", "hello world\n")
        .file("truncated.ply", ply("3", "0 0 0\n1 0 0\n"))
        .file("huge.ply", ply("4294967295", &format!("{triangle}3 0 1 2\n")).replace("ascii", "binary_little_endian"))
        .file("nan.ply", ply("3", "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"))
        .file("infinite.obj", "v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n")
        .file("index.ply", ply("3", &format!("{triangle}3 0 1 7\n")))
        .file("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n")
        .file("points.obj", "v 0 0 0\n")
        .file("point.obj", "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n")
        .file("counts.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
        .file("cut.stl", [&[0; 80], &2_u32.to_le_bytes()[..], &[0; 50]].concat())
        .file("plain.ply.gz", "ply\n");
    fs::create_dir(dir.path("folder.ply")).expect("a folder");
    fs::create_dir(dir.path("folder")).expect("a folder");
    let before = dir.files();
    for (name, parts) in [
        ("empty.ply", &["PLY byte 0", "found an empty file", "expected the line 'ply'"] as &[_]),
        ("text.ply", &["PLY byte 0", "text starting with 'hello world'", "expected the line 'ply'"]),
        ("truncated.ply", &["PLY line 9", "promises 3 rows of 'vertex'"]),
        ("huge.ply", &["PLY line 9", "promises 4294967295 rows"]),
        ("nan.ply", &["PLY line 11", "nan", "finite"]),
        ("infinite.obj", &["OBJ line 2", "inf", "finite"]),
        ("index.ply", &["PLY line 13", "7"]),
        ("index.obj", &["OBJ line 4", "9"]),
        ("points.obj", &["OBJ", "no faces"]),
        ("point.obj", &["degenerate"]),
        ("counts.off", &["OFF line"]),
        ("cut.stl", &["STL byte"]),
        ("plain.ply.gz", &["gzip byte 0"]),
        ("missing.ply", &["cannot read 'missing.ply'"]),
        ("folder.ply", &["cannot read 'folder.ply'", "is a directory"]),
        ("folder", &["cannot read 'folder'", "is a directory"]),
    ] {
        let ran = dir.run(&format!("simplify {name} out.ply -f 2 -g cpu")).fails(4, parts);
        assert!(ran.err.contains(&format!("'{name}'")), "{name} is not named: {}", ran.err);
        assert_eq!(ran.err.lines().count(), 1, "{}", ran.err);
    }
    assert_eq!(dir.files(), before);
    dir.run("inspect text.ply").fails(4, &["'text.ply': PLY byte 0"]);
}

#[test]
fn unknown_formats_are_unsupported() {
    let dir = Dir::new();
    dir.file("in.obj", TETRAHEDRON).file("in.step", "ISO-10303-21;\n");
    dir.run("simplify in.step out.ply -f 4").fails(5, &["'.step'", "obj, ply, stl, off"]);
    dir.run("simplify in.obj out.fbx -f 4").fails(5, &["'.fbx'", "obj, ply, stl, off, gltf, glb"]);
    dir.run("simplify in.obj out -f 4").fails(5, &["'out'", "no extension"]);
    dir.run("simplify in.obj - --format fbx -f 4").fails(5, &["'fbx'", "obj, ply, stl, off"]);
    assert_eq!(dir.files(), ["in.obj", "in.step"]);
}

#[test]
fn a_job_over_the_memory_limit_is_refused() {
    let dir = Dir::new();
    dir.run("simplify sample:part@5k out.ply -f 1k -g cpu --memory-limit 1MiB")
        .fails(6, &["faces need about 65", "more than the memory limit of 1 MiB"]);
    assert!(dir.files().is_empty());
    dir.run("simplify sample:part@5k out.ply -f 1k -g cpu --memory-limit 1GiB").succeeds();
}

#[test]
fn a_missing_device_is_told() {
    let dir = Dir::new();
    dir.run("simplify sample:part@1k out.ply -f 500 -g gpu:99").fails(7, &["device: "]);
    dir.run("simplify sample:part@1k out.ply -f 500 -g NoSuchAdapter").fails(7, &["device: "]);
    assert!(dir.files().is_empty());
}

#[expect(clippy::print_stdout, reason = "a skip must be seen")]
#[test]
fn without_a_driver_auto_runs_on_the_cpu_and_gpu_says_what_to_install() {
    let dir = Dir::new();
    let without_driver = |line: &str| {
        let mut command = dir.command(line);
        Ran::of(
            command.env("VK_DRIVER_FILES", "none.json").env("VK_ICD_FILENAMES", "none.json").output().expect("it runs"),
        )
    };
    if !cfg!(target_os = "linux") {
        return println!("skipped: only the Vulkan loader can be told to find nothing");
    }
    // A GPU is looked for where it could gain, and nothing is said of it elsewhere.
    let small = without_driver("simplify sample:part@1k small.ply -f 500").succeeds();
    assert!(small.err.lines().count() == 1 && small.err.contains("CPU"), "{}", small.err);
    let ran = without_driver("simplify sample:part@1500k out.ply -r 95% -j 1").succeeds();
    let lines: Vec<&str> = ran.err.lines().collect();
    assert!(lines.len() == 2 && lines[0].starts_with("coarsen: no GPU is used: "), "{}", ran.err);
    assert!(lines[1].contains("CPU"), "{}", ran.err);
    assert!(without_driver("simplify sample:part@1k out.ply -f 500 -w -q").succeeds().err.is_empty());
    without_driver("simplify sample:part@1k other.ply -f 500 -g gpu").fails(7, &["mesa-vulkan-drivers"]);
    assert_eq!(without_driver("devices --json").succeeds().json()["adapters"], serde_json::json!([]));
}
