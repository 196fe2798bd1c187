//! A folder of files, reduced by one `coarsen batch`, by a loop of `coarsen simplify`, and by a loop of a small program around
//! meshoptimizer, as gltfpack is called in loops. One file in forty is corrupt.
//!
//! `COARSEN_BATCH_FILES` says how many (60 without it), `COARSEN_BATCH_FOLDER` where they are kept for the next time, and
//! `COARSEN_BATCH_MEMORY` what memory the run may take.
#![allow(clippy::print_stdout, missing_docs, reason = "a bench prints what it measures")]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use coarsen::formats::{self, WriteOptions};
use coarsen::math::DVec3;
use coarsen::mesh::samples::sample;
use coarsen::{Mesh, Result};
use rayon::prelude::*;

const LEAST_FACES: f64 = 1e3;
const MOST_FACES: f64 = 5e5;
/// Formats of files, in the shares that they have here.
const EXTENSIONS: [&str; 10] = ["ply", "ply", "ply", "ply", "ply", "ply", "stl", "stl", "obj", "off"];
const SAMPLES: [&str; 4] = ["statue", "part", "terrain", "assembly"];

fn main() {
    let arguments: Vec<String> = env::args().collect();
    if let [_, mode, input, output] = &arguments[..]
        && mode == "meshoptimizer"
    {
        // A corrupt file is for the loop to see.
        std::process::exit(i32::from(rival(input.as_ref(), output.as_ref()).is_err()));
    }
    let count = env::var("COARSEN_BATCH_FILES").ok().and_then(|text| text.parse().ok()).unwrap_or(60);
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = env::var_os("COARSEN_BATCH_FOLDER").map_or_else(|| temporary.path().join("in"), PathBuf::from);
    let corrupt = generate(&folder, count);
    let files = files(&folder);
    let bytes: u64 = files.iter().filter_map(|file| file.metadata().ok()).map(|file| file.len()).sum();
    println!("{} files, {corrupt} of them corrupt, {:.2} GB", files.len(), bytes as f64 / 1e9);

    let out = |name: &str| temporary.path().join(name);
    let coarsen = env!("CARGO_BIN_EXE_coarsen");
    let own = env::current_exe().expect("this program");
    let memory = env::var("COARSEN_BATCH_MEMORY").unwrap_or_else(|_| "8GiB".into());
    let batch = timed("coarsen batch", || {
        let mut command = Command::new(coarsen);
        command.arg("batch").arg(&folder).arg("-d").arg(out("batch"));
        command.args(["-r", "10%", "-g", "cpu", "--json", "-q", "--memory-limit", &memory]);
        let output = command.output().expect("the program");
        assert_eq!(output.status.code(), Some(if corrupt > 0 { 9 } else { 0 }));
        print!("{}", String::from_utf8_lossy(&output.stdout));
    });
    let looped = timed("loop of coarsen simplify", || {
        run_loop(&files, &out("loop"), corrupt, |input, output| {
            let mut command = Command::new(coarsen);
            command.arg("simplify").arg(input).arg(output).args(["-r", "10%", "-g", "cpu", "-q"]);
            command
        });
    });
    let rival = timed("loop around meshoptimizer", || {
        run_loop(&files, &out("rival"), corrupt, |input, output| {
            let mut command = Command::new(&own);
            command.arg("meshoptimizer").arg(input).arg(output);
            command
        });
    });
    println!("loop of simplify / batch {:.2}, loop around meshoptimizer / batch {:.2}", looped / batch, rival / batch);
}

fn timed(name: &str, work: impl FnOnce()) -> f64 {
    let clock = Instant::now();
    work();
    let seconds = clock.elapsed().as_secs_f64();
    println!("{name:<28} {seconds:>8.1} s");
    seconds
}

/// One program after the other, as a loop of a shell.
fn run_loop(files: &[PathBuf], out: &Path, corrupt: usize, command: impl Fn(&Path, &Path) -> Command) {
    fs::create_dir_all(out).expect("a folder");
    let failed = files.iter().filter(|file| {
        let output = out.join(file.file_name().expect("a name"));
        let status = command(file, &output).stdout(Stdio::null()).stderr(Stdio::null()).status();
        !status.expect("the program").success()
    });
    assert_eq!(failed.count(), corrupt);
}

/// Reads, simplifies with meshoptimizer to a tenth and writes, with this library's reader and writer.
fn rival(input: &Path, output: &Path) -> Result<()> {
    let mesh = formats::read(input)?;
    let points: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&points);
    let adapter = meshopt::VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0).expect("positions");
    let indices: &[u32] = bytemuck::cast_slice(&mesh.faces);
    let target = indices.len() / 30 * 3;
    let kept = meshopt::simplify(indices, &adapter, target, f32::MAX, meshopt::SimplifyOptions::None, None);
    // Only the vertices that are left, as gltfpack writes them.
    let mut names = vec![u32::MAX; points.len()];
    let mut positions: Vec<DVec3> = Vec::new();
    let mut name = |vertex: u32| {
        let name = &mut names[vertex as usize];
        if *name == u32::MAX {
            *name = positions.len() as u32;
            positions.push(mesh.positions[vertex as usize]);
        }
        *name
    };
    let faces = kept.chunks_exact(3).map(|face| [name(face[0]), name(face[1]), name(face[2])]).collect();
    formats::write(&Mesh::new(positions, faces), output, &WriteOptions::default())
}

/// Makes `count` files of log-uniform sizes unless they are there, and tells how many are corrupt.
fn generate(folder: &Path, count: usize) -> usize {
    fs::create_dir_all(folder).expect("a folder");
    let is_corrupt = |i: usize| i % 40 == 20;
    (0..count).into_par_iter().for_each(|i| {
        // The golden ratio spreads sizes evenly, whatever the count.
        let share = (i as f64 * 0.618_033_988_749_894_9).fract();
        let faces = LEAST_FACES * (MOST_FACES / LEAST_FACES).powf(share);
        let extension = if is_corrupt(i) { "ply" } else { EXTENSIONS[i % EXTENSIONS.len()] };
        let path = folder.join(format!("{i:05}.{extension}"));
        if path.exists() {
            return;
        }
        let mesh = sample(SAMPLES[(i / 3) % SAMPLES.len()], Some(faces as usize)).expect("a sample");
        formats::write(&mesh, &path, &WriteOptions::default()).expect("a file");
        if is_corrupt(i) {
            corrupt(&path, i / 40);
        }
    });
    (0..count).filter(|&i| is_corrupt(i)).count()
}

/// Spoils a binary PLY in one of four ways.
fn corrupt(path: &Path, way: usize) {
    let mut bytes = fs::read(path).expect("a file");
    let end = bytes.len();
    match way % 4 {
        0 => bytes.truncate(end * 3 / 5),
        1 => bytes.clear(),
        // An index far beyond the vertices.
        2 => bytes[end - 4..].fill(0x7f),
        _ => bytes[..3].copy_from_slice(b"PLZ"),
    }
    fs::write(path, bytes).expect("a file");
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}
