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
        ("inspect", "inspect --help"),
        ("devices", "devices --help"),
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
    for line in ["--help", "-h", "simplify -h", "simplify --help", "inspect --help", "devices -h", "completions -h"] {
        let help = String::from_utf8(dir.run(line).succeeds().out).expect("help in UTF-8");
        for row in help.lines() {
            // clap alone decides on the line that lists the shells.
            assert!(row.chars().count() <= 79 || row.contains("possible values"), "{line}: {row}");
        }
    }
}

#[test]
fn examples_in_the_help_run() {
    let dir = Dir::new();
    let help = String::from_utf8(dir.run("simplify --help").succeeds().out).expect("help in UTF-8");
    let examples: Vec<&str> = help.lines().filter_map(|row| row.strip_prefix("  coarsen ")).collect();
    assert!(examples.len() >= 4, "{examples:?}");
    for example in examples {
        // Small versions of the samples, on the CPU, without the shell's redirection.
        let line = example.split(" > ").next().unwrap_or_default();
        let small = ["statue@50k", "terrain@100k", "statue", "part"]
            .iter()
            .find(|name| line.contains(&format!("sample:{name} ")))
            .map(|name| {
                line.replace(
                    &format!("sample:{name} "),
                    &format!("sample:{}@1k ", name.split('@').next().unwrap_or(name)),
                )
            })
            .unwrap_or_else(|| panic!("no sample in {line}"));
        dir.run(&format!("{small} -g cpu")).succeeds();
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
