//! A folder of files, reduced by one `coarsen batch`, by a loop of `coarsen simplify`, and by a loop of a small program around
//! meshoptimizer, as gltfpack is called in loops; the first and the last with the colors that some files have, and without.
//! One file in forty is corrupt.
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
/// What the program around meshoptimizer is asked for: positions alone, or colors too.
const PLAIN: &str = "meshoptimizer";
const COLORED: &str = "meshoptimizer-with-colors";
const SAMPLES: [&str; 4] = ["statue", "part", "terrain", "assembly"];

fn main() {
    let arguments: Vec<String> = env::args().collect();
    if let [_, mode, input, output] = &arguments[..]
        && let Some(with_colors) = [PLAIN, COLORED].iter().position(|known| known == mode)
    {
        // A corrupt file is for the loop to see.
        std::process::exit(i32::from(rival(input.as_ref(), output.as_ref(), with_colors == 1).is_err()));
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
    let batch = |name: &str, options: &[&str]| {
        timed(name, || {
            let mut command = Command::new(coarsen);
            command.arg("batch").arg(&folder).arg("-d").arg(out(name)).args(options);
            command.args(["-r", "10%", "-g", "cpu", "--json", "-q", "--memory-limit", &memory]);
            let output = command.output().expect("the program");
            assert_eq!(output.status.code(), Some(if corrupt > 0 { 9 } else { 0 }));
            print!("{}", String::from_utf8_lossy(&output.stdout));
        })
    };
    let around_meshoptimizer = |name: &str, mode: &str| {
        timed(name, || {
            run_loop(&files, &out(name), corrupt, |input, output| {
                let mut command = Command::new(&own);
                command.arg(mode).arg(input).arg(output);
                command
            });
        })
    };
    let own_batch = batch("coarsen batch", &[]);
    let looped = timed("loop of coarsen simplify", || {
        run_loop(&files, &out("loop"), corrupt, |input, output| {
            let mut command = Command::new(coarsen);
            command.arg("simplify").arg(input).arg(output).args(["-r", "10%", "-g", "cpu", "-q"]);
            command
        });
    });
    let rival = around_meshoptimizer("loop around meshoptimizer", COLORED);
    let plain_batch = batch("batch without colors", &["--drop", "color"]);
    let plain_rival = around_meshoptimizer("the loop without colors", PLAIN);
    println!("loop of simplify / batch {:.2}", looped / own_batch);
    println!(
        "loop around meshoptimizer / batch {:.2}, without colors {:.2}",
        rival / own_batch,
        plain_rival / plain_batch
    );
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

/// Reads, simplifies with meshoptimizer to a tenth and writes, with this library's reader and writer. Colors weigh 1, as they
/// do in gltfpack.
fn rival(input: &Path, output: &Path, with_colors: bool) -> Result<()> {
    let mesh = formats::read(input)?;
    let points: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.as_vec3().to_array()).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&points);
    let adapter = meshopt::VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0).expect("positions");
    let indices: &[u32] = bytemuck::cast_slice(&mesh.faces);
    let (target, options) = (indices.len() / 30 * 3, meshopt::SimplifyOptions::None);
    let colors = mesh.colors.as_deref().filter(|_| with_colors);
    let kept = match colors {
        Some(colors) => meshopt::simplify_with_attributes_and_locks(
            indices,
            &adapter,
            bytemuck::cast_slice(colors),
            &[1.0; 4],
            size_of::<[f32; 4]>(),
            &vec![false; points.len()],
            target,
            f32::MAX,
            options,
            None,
        ),
        None => meshopt::simplify(indices, &adapter, target, f32::MAX, options, None),
    };
    // Only the vertices that are left, as gltfpack writes them.
    let mut names = vec![u32::MAX; points.len()];
    let mut left = Vec::new();
    let mut name = |vertex: u32| {
        let name = &mut names[vertex as usize];
        if *name == u32::MAX {
            *name = left.len() as u32;
            left.push(vertex as usize);
        }
        *name
    };
    let faces = kept.chunks_exact(3).map(|face| [name(face[0]), name(face[1]), name(face[2])]).collect();
    let positions: Vec<DVec3> = left.iter().map(|&vertex| mesh.positions[vertex]).collect();
    let colors = colors.map(|colors| left.iter().map(|&vertex| colors[vertex]).collect());
    formats::write(&Mesh { colors, ..Mesh::new(positions, faces) }, output, &WriteOptions::default())
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
