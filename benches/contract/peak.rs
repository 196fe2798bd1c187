//! Peak memory of one run, in a process of its own: what a child's greatest resident set grows by.
//!
//! The growth is from before the mesh is read, so it counts the input in the form that the contender takes.

use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;
use std::process::Command;

use bytemuck::{Pod, Zeroable};
use coarsen::Mesh;
use coarsen::math::DVec3;

use crate::contender::{BASELINE, Contender};
use crate::input::Case;

/// Tells a child its job: contender, target, and the folder of the mesh, with spaces between.
const JOB: &str = "COARSEN_BENCH_PEAK";
const POSITIONS: &str = "positions";
const POINTS: &str = "points";
const FACES: &str = "faces";

/// A mesh on the disk for children to read.
pub struct Stored(tempfile::TempDir);

impl Stored {
    /// Writes the rows of a case as they lie in memory.
    pub fn new(case: &Case) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        write(&folder.path().join(POSITIONS), &case.mesh.positions);
        write(&folder.path().join(POINTS), &case.points);
        write(&folder.path().join(FACES), &case.mesh.faces);
        Self(folder)
    }

    /// Bytes that a child's peak grows by; nothing where the system does not say.
    pub fn peak_bytes(&self, contender: &str, target: usize) -> Option<u64> {
        resident("VmHWM:")?;
        let child = Command::new(std::env::current_exe().ok()?)
            .env(JOB, format!("{contender} {target} {}", self.0.path().display()))
            .output()
            .expect("this program starts again");
        assert!(child.status.success(), "{contender}: {}", String::from_utf8_lossy(&child.stderr));
        String::from_utf8_lossy(&child.stdout).trim().parse().ok()
    }
}

/// Does the job of a child, if this process is one.
pub fn measures_this_process() -> bool {
    let Ok(job) = std::env::var(JOB) else { return false };
    let [name, target, folder] = job.splitn(3, ' ').collect::<Vec<_>>()[..] else { panic!("{JOB}: {job}") };
    let contender = Contender::open(name).expect("the parent opened it too");
    let before = resident("VmRSS:").expect("the parent looked");
    let case = read_case(Path::new(folder), name == BASELINE);
    contender.simplify(&case, target.parse().expect("a number of faces"));
    println!("{}", resident("VmHWM:").map_or(0, |peak| peak - before));
    true
}

/// Only what the contender takes.
fn read_case(folder: &Path, single: bool) -> Case {
    let faces: Vec<[u32; 3]> = read(&folder.join(FACES));
    if single {
        return Case { name: "", mesh: Mesh::new(Vec::new(), faces), points: read(&folder.join(POINTS)) };
    }
    let positions: Vec<DVec3> = read(&folder.join(POSITIONS));
    Case { name: "", mesh: Mesh::new(positions, faces), points: Vec::new() }
}

fn write<T: Pod>(path: &Path, rows: &[T]) {
    let mut file = File::create(path).expect("the folder is writable");
    file.write_all(bytemuck::cast_slice(rows)).expect("the disk has room");
}

fn read<T: Pod + Zeroable>(path: &Path) -> Vec<T> {
    let mut file = File::open(path).expect("the parent wrote it");
    let len = file.metadata().expect("an open file").len() as usize / size_of::<T>();
    let mut rows = vec![T::zeroed(); len];
    file.read_exact(bytemuck::cast_slice_mut(&mut rows)).expect("the parent wrote all of it");
    rows
}

/// A size of this process in bytes, by its name in Linux's status file.
fn resident(name: &str) -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}
