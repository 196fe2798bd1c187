//! The program from end to end: help, exit codes, messages, pipes, files that must not be touched.

mod batch;
mod bench;
mod compare;
mod errors;
mod gltf;
mod help;
mod lod;
#[path = "../support/models.rs"]
#[expect(dead_code, clippy::print_stdout, reason = "shared by test crates; a skip must be seen")]
mod models;
mod output;
mod regions;
mod replay;
mod weights;
mod words;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;

/// A folder to run the program in.
struct Dir(tempfile::TempDir);

/// What a run gave.
struct Ran {
    code: Option<i32>,
    out: Vec<u8>,
    err: String,
}

impl Dir {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        fs::write(self.path(name), content).expect("a file to write");
        self
    }

    fn command(&self, line: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_coarsen"));
        // Mesa's layer for choosing a device writes to standard error without it.
        command.args(line.split_whitespace()).current_dir(self.0.path()).env("NODEVICE_SELECT", "1").env_remove("CI");
        command
    }

    fn run(&self, line: &str) -> Ran {
        Ran::of(self.command(line).output().expect("the program"))
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("the folder");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Ran {
    fn of(output: Output) -> Self {
        Self {
            code: output.status.code(),
            out: output.stdout,
            err: String::from_utf8(output.stderr).expect("messages in UTF-8"),
        }
    }

    /// Asserts the exit code and what standard error holds.
    #[track_caller]
    fn fails(self, code: i32, parts: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{}", self.err);
        assert!(self.err.lines().any(|line| line.starts_with("coarsen: error: ")), "{}", self.err);
        for part in parts {
            assert!(self.err.contains(part), "expected '{part}' in\n{}", self.err);
        }
        assert!(self.out.is_empty(), "{} bytes on standard output", self.out.len());
        self
    }

    #[track_caller]
    fn succeeds(self) -> Self {
        assert_eq!(self.code, Some(0), "{}", self.err);
        self
    }

    #[track_caller]
    fn json(&self) -> Value {
        let text = std::str::from_utf8(&self.out).expect("JSON in UTF-8");
        assert_eq!(text.matches('\n').count(), 1, "not one line: {text}");
        serde_json::from_str(text).expect("JSON")
    }
}

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

/// A square of four squares with the texture laid over it.
const TEXTURED: &str = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 0 2 0\nv 1 2 0\nv 2 2 0\n\
    vt 0 0\nvt .5 0\nvt 1 0\nvt 0 .5\nvt .5 .5\nvt 1 .5\nvt 0 1\nvt .5 1\nvt 1 1\n\
    f 1/1 2/2 5/5\nf 1/1 5/5 4/4\nf 2/2 3/3 6/6\nf 2/2 6/6 5/5\nf 4/4 5/5 8/8\nf 4/4 8/8 7/7\nf 5/5 6/6 9/9\nf 5/5 9/9 8/8\n";
