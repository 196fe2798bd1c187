//! Help, manual and completions.

use std::fs;
use std::path::Path;

use crate::Dir;

#[test]
fn help_is_as_recorded() {
    let dir = Dir::new();
    for (name, line) in [
        ("coarsen", "--help"),
        ("simplify-short", "simplify -h"),
        ("simplify", "simplify --help"),
        ("lod", "lod --help"),
        ("batch", "batch --help"),
        ("replay", "replay --help"),
        ("inspect", "inspect --help"),
        ("sample", "sample --help"),
        ("devices", "devices --help"),
        ("bench", "bench --help"),
        ("compare", "compare --help"),
        ("completions", "completions --help"),
    ] {
        let ran = dir.run(line).succeeds();
        let text = String::from_utf8(ran.out).expect("help in UTF-8");
        let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/help-{name}.txt"));
        if std::env::var_os("BLESS").is_some() {
            fs::write(&golden, &text).expect("a golden file to write");
        }
        let expected = fs::read_to_string(&golden).unwrap_or_default();
        assert_eq!(text, expected, "{} differs: look, then run again with BLESS=1", golden.display());
    }
}

#[test]
fn help_fits_a_terminal() {
    let dir = Dir::new();
    for line in [
        "--help",
        "-h",
        "simplify -h",
        "simplify --help",
        "lod -h",
        "lod --help",
        "batch -h",
        "batch --help",
        "replay -h",
        "replay --help",
        "inspect --help",
        "devices -h",
        "bench -h",
        "bench --help",
        "compare -h",
        "compare --help",
        "completions -h",
    ] {
        let help = String::from_utf8(dir.run(line).succeeds().out).expect("help in UTF-8");
        for row in help.lines() {
            // clap alone decides on the line that lists the shells.
            assert!(row.chars().count() <= 79 || row.contains("possible values"), "{line}: {row}");
        }
    }
}

/// An example with small samples, on the CPU, without the shell's redirection and comment.
fn small(example: &str) -> String {
    let line = example.split(['>', '#']).next().unwrap_or_default();
    let shrink = |word: &str| match word.strip_prefix("sample:") {
        Some(name) => format!("sample:{}@1k", name.split('@').next().unwrap_or_default()),
        None if word.starts_with("100k,") => "1k,2k".to_string(),
        None if word == "statue@50M" => "statue@1k".to_string(),
        None if word == "500k" => "500".to_string(),
        None => word.replace('\'', ""),
    };
    let words: Vec<String> = line.split_whitespace().map(shrink).collect();
    let options = match words[0].as_str() {
        "simplify" | "lod" => " -g cpu -w",
        "replay" | "sample" => " -w",
        "batch" if line.contains("--resume") => " -g cpu",
        "batch" => " -g cpu -w",
        "compare" => " -g cpu",
        "bench" if line.contains("--papers") => " --repeats 1",
        "bench" if words.len() == 1 => " sample:part@1k -g cpu,gpu --repeats 1 --samples 1k",
        "bench" if !line.contains("--repeats") => " --repeats 1 --samples 1k",
        "bench" => " --samples 1k",
        _ => "",
    };
    words.join(" ") + options
}

#[test]
fn examples_run() {
    let dir = Dir::new();
    // Of the examples with files of one's own.
    fs::create_dir(dir.path("scans")).expect("a folder");
    for file in ["scans/a.ply", "scans/b.stl"] {
        dir.run(&format!("simplify sample:part@1k {file} -r 50% -g cpu")).succeeds();
    }
    dir.file("jobs.jsonl", "{\"input\": \"scans/a.ply\"}\n");
    let readme = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("README.md");
    let mut texts = vec![readme.replace("cargo run --release -- ", "coarsen ")];
    let verbs = [
        "",
        "simplify",
        "lod",
        "batch",
        "replay",
        "sample",
        "inspect",
        "devices",
        "bench",
        "compare",
        "completions",
        "man",
    ];
    for verb in verbs {
        texts.push(String::from_utf8(dir.run(&format!("{verb} --help")).succeeds().out).expect("help in UTF-8"));
    }
    let examples: Vec<&str> = (texts.iter().flat_map(|text| text.lines()))
        .filter_map(|row| row.strip_prefix("  ").unwrap_or(row).strip_prefix("coarsen "))
        .collect();
    assert!(examples.len() >= 15, "{examples:?}");
    for example in examples {
        dir.run(&small(example)).succeeds();
    }
}

#[test]
fn manual_and_completions_know_every_option() {
    let dir = Dir::new();
    let man = String::from_utf8(dir.run("man").succeeds().out).expect("roff in UTF-8");
    let bash = String::from_utf8(dir.run("completions bash").succeeds().out).expect("a script in UTF-8");
    for option in ["faces", "ratio", "error-abs", "require-target", "metric", "memory-limit", "overwrite", "progress"] {
        assert!(bash.contains(&format!("--{option}")), "{option}");
        assert!(man.contains(&format!("\\-\\-{}", option.replace('-', "\\-"))), "{option}");
    }
    assert!(man.contains(".TH coarsen 1") && man.contains(".TH coarsen-simplify 1"));
}

#[test]
fn version_is_the_packages() {
    assert_eq!(
        Dir::new().run("--version").succeeds().out,
        format!("coarsen {}\n", env!("CARGO_PKG_VERSION")).into_bytes()
    );
}
