//! Who may import what, as data; citations, paths and sizes of the sources. Every check is shown to fail.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Which top-level modules each of them may use. An edge that is not here needs a reason, in ARCHITECTURE.md and here.
const MAY_USE: &[(&str, &[&str])] = &[
    ("error", &[]),
    ("math", &[]),
    ("mesh", &["error", "math"]),
    ("spatial", &["math", "mesh"]),
    ("backend", &["error"]),
    // `Device::open` lies here, for it runs the self-test, which is made of kernels.
    ("kernel", &["backend", "error", "math"]),
    // `simplify` is the entry and owns the words that every driver speaks (budget, outcome, records, progress): the
    // drivers use those types, `simplify` calls the drivers. Neither uses more of the other.
    ("contract", &["backend", "error", "kernel", "math", "mesh", "polish", "progressive", "simplify", "spatial"]),
    ("cluster", &["backend", "error", "kernel", "math", "mesh", "polish", "simplify"]),
    ("removal", &["backend", "error", "kernel", "math", "mesh", "polish", "simplify", "spatial"]),
    ("partition", &["backend", "error", "kernel", "math", "mesh", "polish", "simplify", "spatial"]),
    // Follows any driver; those take its options along and never call it.
    ("polish", &["backend", "error", "kernel", "math", "mesh", "spatial"]),
    ("simplify", &["backend", "cluster", "contract", "error", "mesh", "partition", "polish", "progressive", "removal"]),
    // Works on what a run made; its tests run one.
    ("lod", &["backend", "contract", "error", "mesh", "simplify"]),
    // What materials look like: readers make it of files, pictures are made of it.
    ("looks", &["error", "math"]),
    ("formats", &["error", "looks", "math", "mesh"]),
    // From a file, in parts that drivers reduce: above both, beside the command line's own reading and writing.
    ("out_of_core", &["backend", "contract", "error", "formats", "math", "mesh", "polish", "simplify"]),
    // A log needs nothing of the driver that made it, and is written as atomically as a mesh.
    ("progressive", &["error", "formats", "math", "mesh"]),
    ("metrics", &["backend", "error", "kernel", "math", "mesh", "spatial"]),
    // Runs methods over files. The sum that tells one file from another is that of logs.
    (
        "batch",
        &["backend", "contract", "error", "formats", "mesh", "metrics", "out_of_core", "progressive", "simplify"],
    ),
    // Runs methods and measures what they make: above both.
    ("papers", &["backend", "contract", "error", "mesh", "metrics", "partition", "simplify"]),
    ("report", &["error", "looks", "math", "mesh"]),
    // The command line uses the library by its public name and nothing uses the command line.
    ("cli", &[]),
];

/// The types of `simplify` that drivers may use.
const DRIVER_WORDS: &[&str] =
    &["Blocked", "Budget", "MOVED", "OnProgress", "Outcome", "Phases", "Progress", "RoundRecord", "StopReason"];

/// Longest source file.
const MOST_LINES: usize = 500;

/// A text of the repository, by its path from the root with slashes.
struct Source {
    path: String,
    text: String,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        Self { path: path.into(), text: text.into() }
    }

    /// The top-level module of a file in `src`; the crate roots have none.
    fn module(&self) -> Option<&str> {
        let inside = self.path.strip_prefix("src/")?;
        let name = inside.split('/').next()?.trim_end_matches(".rs");
        (name != "lib" && name != "main").then_some(name)
    }

    /// The text without line comments.
    fn code(&self) -> String {
        let without_comment = |line: &str| line.find("//").map_or(line, |at| &line[..at]).to_string() + "\n";
        self.text.lines().map(without_comment).collect()
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of these extensions below `folder`, sorted; with an empty one also those without any.
fn sources(folder: &str, extensions: &[&str]) -> Vec<Source> {
    let mut files = Vec::new();
    collect(&root().join(folder), &mut files);
    files.sort();
    let named = |path: &Path| extensions.iter().any(|wanted| path.extension().unwrap_or_default() == *wanted);
    files
        .into_iter()
        .filter(|path| named(path))
        .map(|path| {
            let inside = path.strip_prefix(root()).expect("a path in the repository");
            let name = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
            Source { text: fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}")), path: name }
        })
        .collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.expect("an entry").path();
        if path.is_dir() { collect(&path, files) } else { files.push(path) }
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The paths below `crate::` that `code` names, groups taken apart: `a::b` for each of `use crate::a::{b, c::d}`.
fn crate_paths(code: &str) -> Vec<String> {
    let mut paths = Vec::new();
    for (at, name) in code.match_indices("crate::") {
        if !code[..at].ends_with(is_word) {
            expand("", &code[at + name.len()..], &mut paths);
        }
    }
    paths
}

/// Reads one path or group at the start of `rest`, of two segments at most, and returns how long it is.
fn expand(prefix: &str, rest: &str, paths: &mut Vec<String>) -> usize {
    if rest.starts_with('{') {
        let mut at = 1;
        while at < rest.len() {
            match rest[at..].chars().next() {
                Some('}') => return at + 1,
                Some(c) if is_word(c) => at += expand(prefix, &rest[at..], paths),
                Some(c) => at += c.len_utf8(),
                None => break,
            }
        }
        return at;
    }
    let end = rest.find(|c: char| !is_word(c)).unwrap_or(rest.len());
    let path = if prefix.is_empty() { rest[..end].to_string() } else { format!("{prefix}::{}", &rest[..end]) };
    match rest[end..].strip_prefix("::") {
        Some(deeper) if deeper.starts_with(|c: char| is_word(c) || c == '{') => end + 2 + expand(&path, deeper, paths),
        _ => {
            paths.push(path);
            end
        }
    }
}

/// Imports that the table does not allow.
fn forbidden_imports(source: &Source) -> Vec<String> {
    let Some(module) = source.module() else { return Vec::new() };
    let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == module) else {
        return vec![format!("{}: the table has no module '{module}'", source.path)];
    };
    // `simplify` and its drivers use each other: these only its types.
    let is_driver = MAY_USE.iter().any(|(name, used)| *name == "simplify" && used.contains(&module));
    let mut faults = Vec::new();
    for path in crate_paths(&source.code()) {
        let (used, word) = (used_module(&path), path.split("::").nth(1));
        if used != module && !allowed.contains(&used) {
            faults.push(format!("{}: {module} must not use {path}", source.path));
        } else if is_driver && used == "simplify" && !word.is_some_and(|word| DRIVER_WORDS.contains(&word)) {
            faults.push(format!("{}: {module} may use the types of simplify, not {path}", source.path));
        }
    }
    faults
}

/// Ways to the crate's root by `super`, which [`forbidden_imports`] would not see.
fn super_to_the_root(source: &Source) -> Vec<String> {
    let Some(inside) = source.path.strip_prefix("src/") else { return Vec::new() };
    let file = inside.trim_end_matches(".rs").trim_end_matches("/mod");
    let depth = if matches!(file, "lib" | "main") { 0 } else { file.split('/').count() };
    let mut nested = 0;
    let mut faults = Vec::new();
    for line in source.code().lines() {
        // rustfmt puts the ends of a module in the first column.
        if line.contains("mod ") && line.trim_end().ends_with('{') && !line.starts_with(' ') {
            nested = 1;
        } else if line.starts_with('}') {
            nested = 0;
        }
        let mut rest = line;
        while let Some(at) = rest.find("super::") {
            rest = &rest[at..];
            let mut steps = 0;
            while let Some(after) = rest.strip_prefix("super::") {
                rest = after;
                steps += 1;
            }
            if steps >= depth + nested {
                faults.push(format!("{}: reaches the root of the crate: {}", source.path, line.trim()));
            }
        }
    }
    faults
}

/// Packages that only files whose paths begin so may know.
const KNOWN_BY: [(&str, &str); 2] = [("wgpu", "src/backend/gpu"), ("glam", "src/math/")];

/// Names of packages outside the files that may know them.
fn stray_packages(source: &Source) -> Vec<String> {
    let code = source.code();
    let is_named = |package: &str| {
        let is_whole =
            |(at, name): (usize, &str)| !code[..at].ends_with(is_word) && !code[at + name.len()..].starts_with(is_word);
        code.match_indices(package).any(is_whole)
    };
    let strays = KNOWN_BY.iter().filter(|(package, place)| !source.path.starts_with(place) && is_named(package));
    strays.map(|(package, _)| format!("{}: names {package}", source.path)).collect()
}

/// Edges of the table that no source takes.
fn unused_edges(sources: &[Source]) -> Vec<String> {
    let taken: BTreeSet<(&str, String)> = sources
        .iter()
        .filter_map(|source| Some((source.module()?, source.code())))
        .flat_map(|(module, code)| crate_paths(&code).into_iter().map(move |path| (module, used_module(&path).into())))
        .collect();
    let all = MAY_USE.iter().flat_map(|(module, used)| used.iter().map(move |used| (*module, (*used).to_string())));
    let unused = all.filter(|edge| !taken.contains(edge));
    unused.map(|(module, used)| format!("{module} does not use {used}: take it out of the table")).collect()
}

/// The top-level module that a path below the crate leads to.
fn used_module(path: &str) -> &str {
    // Names that the crate's root gives out stand for the module they come from.
    match path.split("::").next().unwrap_or_default() {
        "Mesh" => "mesh",
        "Device" => "backend",
        "Error" | "Result" => "error",
        used => used,
    }
}

/// The citation keys in a text: `LT98` in `[LT98]` and `\[LT98\]`.
fn citations(text: &str) -> Vec<&str> {
    let is_key = |key: &str| {
        let letters = key.trim_end_matches(|c: char| c.is_ascii_digit());
        key.len() == letters.len() + 2
            && letters.starts_with(|c: char| c.is_ascii_uppercase())
            && letters.len() >= 2
            && letters.chars().all(|c| c.is_ascii_alphabetic())
    };
    let after_bracket = text.split('[').skip(1);
    after_bracket
        .filter_map(|rest| rest.split_once(']'))
        .map(|(key, _)| key.trim_end_matches('\\'))
        .filter(|key| is_key(key))
        .collect()
}

/// Keys that the list of references does not have.
fn unknown_citations(source: &Source, references: &BTreeSet<&str>) -> Vec<String> {
    let unknown = citations(&source.text).into_iter().filter(|key| !references.contains(key));
    unknown.map(|key| format!("{}: [{key}] is not in REFERENCES.md", source.path)).collect()
}

/// The keys of REFERENCES.md: lines that start with one.
fn reference_keys(references: &str) -> BTreeSet<&str> {
    references
        .lines()
        .filter(|line| line.starts_with("- ["))
        .filter_map(|line| citations(line).first().copied())
        .collect()
}

/// Paths that are good on one machine only.
fn machine_paths(source: &Source) -> Vec<String> {
    let folders = [["/", "home/"], ["/", "root/"], ["/", "Users/"], ["/", "work/"], ["/", "tmp/"], ["C:", "\\"]]
        .map(|p| p.concat());
    let mut faults = Vec::new();
    for (i, line) in source.text.lines().enumerate() {
        for folder in &folders {
            // A relative path may have a folder of that name.
            let starts = |at: usize| !line[..at].ends_with(|c: char| is_word(c) || c == '.' || c == '}' || c == '>');
            if line.match_indices(folder.as_str()).any(|(at, _)| starts(at)) {
                faults.push(format!("{}:{}: names a path of one machine: {}", source.path, i + 1, line.trim()));
            }
        }
    }
    faults
}

/// Files that are two things.
fn too_long(source: &Source) -> Vec<String> {
    match source.text.lines().count() {
        lines if lines > MOST_LINES => vec![format!("{}: {lines} lines, at most {MOST_LINES}", source.path)],
        _ => Vec::new(),
    }
}

#[track_caller]
fn assert_none(faults: Vec<String>) {
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn modules_use_only_what_the_table_allows() {
    let sources = sources("src", &["rs"]);
    assert!(sources.len() > 50, "{} files found", sources.len());
    let edges: usize = sources.iter().map(|source| crate_paths(&source.code()).len()).sum();
    assert!(edges > 100, "{edges} imports found");
    assert_none(sources.iter().flat_map(forbidden_imports).collect());
    assert_none(sources.iter().flat_map(super_to_the_root).collect());
    assert_none(sources.iter().flat_map(stray_packages).collect());
    assert_none(unused_edges(&sources));
}

#[test]
fn citations_are_in_the_references() {
    let text = fs::read_to_string(root().join("REFERENCES.md")).expect("REFERENCES.md");
    let references = reference_keys(&text);
    assert!(references.len() >= 8, "{references:?}");
    let mut sources = [sources("src", &["rs"]), sources("shaders", &["wgsl"]), sources("tests", &["rs"])].concat_all();
    // This file has keys that are wrong on purpose.
    sources.retain(|source| source.path != "tests/architecture.rs");
    let found: usize = sources.iter().map(|source| citations(&source.text).len()).sum();
    assert!(found >= 5, "{found} citations found");
    assert_none(sources.iter().flat_map(|source| unknown_citations(source, &references)).collect());
}

#[test]
fn nothing_names_a_path_of_one_machine() {
    let texts = ["rs", "wgsl", "md", "toml", "sh", "txt", ""];
    let mut sources = ["src", "shaders", "tests", "benches", "docs", ".cargo", ".ci"]
        .map(|folder| sources(folder, &texts))
        .concat_all();
    let has = |path: &str| sources.iter().any(|source| source.path == path);
    assert!(has("docs/DECISIONS.md") && has(".ci/run") && has("tests/run.sh"));
    for entry in fs::read_dir(root()).expect("the root") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|e| e == "md" || e == "toml") {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            sources.push(Source::new(&name, &fs::read_to_string(&path).expect("text")));
        }
    }
    assert!(sources.len() > 100, "{} files found", sources.len());
    assert_none(sources.iter().flat_map(machine_paths).collect());
}

#[test]
fn no_file_is_two_things() {
    let sources = [
        sources("src", &["rs"]),
        sources("shaders", &["wgsl"]),
        sources("tests", &["rs"]),
        sources("benches", &["rs"]),
    ]
    .concat_all();
    assert!(sources.len() > 100, "{} files found", sources.len());
    assert_none(sources.iter().flat_map(too_long).collect());
}

/// Joins lists.
trait ConcatAll {
    fn concat_all(self) -> Vec<Source>;
}

impl<const N: usize> ConcatAll for [Vec<Source>; N] {
    fn concat_all(self) -> Vec<Source> {
        self.into_iter().flatten().collect()
    }
}

#[test]
fn paths_are_found_in_every_form() {
    let code = "use crate::mesh::Mesh;\nuse crate::{a::{B, c::D}, e};\nlet x = crate::kernel::run::<u32>();\n\
        mycrate::no; pub(crate) fn f() {} crate::{\n    g::*,\n}";
    assert_eq!(crate_paths(code), ["mesh::Mesh", "a::B", "a::c::D", "e", "kernel::run", "g"]);
}

#[test]
fn a_wrong_import_is_found() {
    let faults = |path: &str, text: &str| forbidden_imports(&Source::new(path, text)).len();
    assert_eq!(faults("src/mesh/weld.rs", "use crate::contract::run;"), 1);
    assert_eq!(faults("src/mesh/weld.rs", "use crate::{math, formats};"), 1);
    assert_eq!(faults("src/kernel/pairs.rs", "use crate::Mesh;"), 1);
    assert_eq!(faults("src/backend/queue.rs", "fn f() { crate::kernel::rows::x() }"), 1);
    assert_eq!(faults("src/contract/driver.rs", "use crate::simplify::simplify;"), 1);
    assert_eq!(faults("src/contract/driver.rs", "use crate::simplify::{Method, Outcome};"), 1);
    assert_eq!(faults("src/formats/ply.rs", "use crate::cli::Exit;"), 1);
    assert_eq!(faults("src/cli/sink.rs", "use crate::mesh::Mesh;"), 1);
    assert_eq!(faults("src/gadget.rs", ""), 1);

    assert_eq!(faults("src/mesh/weld.rs", "use crate::math::DVec3;\n// crate::contract is far away\n"), 0);
    assert_eq!(faults("src/contract/driver.rs", "use crate::simplify::{Budget, Outcome};"), 0);
    assert_eq!(faults("src/lib.rs", "pub use crate::contract::run;"), 0);
}

#[test]
fn a_way_to_the_root_by_super_is_found() {
    let faults = |path: &str, text: &str| super_to_the_root(&Source::new(path, text)).len();
    assert_eq!(faults("src/simplify.rs", "use super::contract;"), 1);
    assert_eq!(faults("src/mesh/mod.rs", "use super::contract;"), 1);
    assert_eq!(faults("src/mesh/weld.rs", "use super::super::contract;"), 1);
    assert_eq!(faults("src/mesh/weld.rs", "mod tests {\n    use super::super::super::contract;\n}\n"), 1);
    assert_eq!(faults("src/mesh/weld.rs", "use super::Mesh;\nmod tests {\n    use super::super::Mesh;\n}\n"), 0);
    assert_eq!(faults("src/mesh/weld.rs", "mod tests {\n}\nuse super::super::Mesh;\n"), 1);
    assert_eq!(faults("src/mesh/samples/part.rs", "use super::super::Mesh;"), 0);
}

#[test]
fn a_stray_package_is_found() {
    let faults = |path: &str, text: &str| stray_packages(&Source::new(path, text)).len();
    assert_eq!(faults("src/contract/driver.rs", "use glam::Vec3;"), 1);
    assert_eq!(faults("src/math/mod.rs", "pub use glam::{Vec2, Vec3};"), 0);
    assert_eq!(faults("src/contract/driver.rs", "let device: wgpu::Device;"), 1);
    assert_eq!(faults("src/backend/queue.rs", "use wgpu;"), 1);
    assert_eq!(faults("src/backend/gpu_buffer.rs", "use wgpu::Buffer;"), 0);
    assert_eq!(faults("src/backend/mod.rs", "// only gpu*.rs may name wgpu\nlet wgpus = 1;"), 0);
}

#[test]
fn an_edge_that_nobody_takes_is_found() {
    let one = [Source::new("src/mesh/weld.rs", "use crate::{Error, math::Vec3};")];
    let unused = unused_edges(&one);
    let count: usize = MAY_USE.iter().map(|(_, used)| used.len()).sum();
    assert_eq!(unused.len(), count - 2);
    assert!(unused.iter().all(|fault| !fault.starts_with("mesh ")), "{unused:?}");
}

#[test]
fn an_unknown_citation_is_found() {
    let references = reference_keys("- [LT98] Lindstrom, Turk.\nsee also [GH97]\n- [DEGN99] Dey.\n");
    assert_eq!(references.iter().copied().collect::<Vec<_>>(), ["DEGN99", "LT98"]);
    let faults = |text: &str| unknown_citations(&Source::new("src/x.rs", text), &references).len();
    assert_eq!(faults("/// From \\[GH97\\] and [Xy01]."), 2);
    assert_eq!(faults("/// \\[LT98\\], [DEGN99]; not a[12], [A1], [u32; 10], [X12a], [[0; 10]]"), 0);
}

#[test]
fn a_path_of_one_machine_is_found() {
    let faults = |text: String| machine_paths(&Source::new("README.md", &text)).len();
    for folder in ["home", "root", "Users", "work", "tmp"] {
        assert_eq!(faults(format!("see /{folder}/me/mesh.ply")), 1, "{folder}");
        assert_eq!(faults(format!("see ../{folder}/mesh.ply and docs/{folder}/x")), 0, "{folder}");
    }
    assert_eq!(faults(["C:", "\\mesh.ply"].concat()), 1);
}

#[test]
fn a_file_too_long_is_found() {
    assert_eq!(too_long(&Source::new("src/x.rs", &"\n".repeat(MOST_LINES + 1))).len(), 1);
    assert!(too_long(&Source::new("src/x.rs", &"\n".repeat(MOST_LINES))).is_empty());
}
