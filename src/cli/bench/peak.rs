//! Peak memory of one run, in a process of its own: what a child's greatest resident set grows by.
//!
//! The growth is from before the child takes the mesh, so it counts the input in the form that the contender takes.

use std::env;
use std::fs;
use std::io::{self, Read, Write};
use std::process::{Command, Stdio};

use anyhow::{Context, anyhow};
use bytemuck::{Pod, Zeroable};
use coarsen::Mesh;

use super::case::{Case, Single};
use super::contender::{Contender, Engine, Wish, contract};
use super::plan::wish;
use crate::cli::{Exit, console, memory};

/// Tells a child its job: contender, threads beside an adapter and faces to keep, with tabs between.
const JOB: &str = "COARSEN_BENCH_PEAK";

/// Bytes that the peak of a child grows by that does the job; nothing where the system does not tell.
///
/// # Errors
/// Why the child did not do it.
pub fn peak_bytes(name: &str, threads: usize, case: &Case, faces: usize) -> anyhow::Result<Option<u64>> {
    if memory::peak().is_none() {
        return Ok(None);
    }
    let mut child = Command::new(env::current_exe()?)
        .arg("bench")
        .env(JOB, format!("{name}\t{threads}\t{faces}"))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()?;
    if let Some(mut pipe) = child.stdin.take() {
        // A child that ends early says why in its own words.
        let _ = match wish(name)? {
            Wish::Rival(_) => {
                let Single { positions, indices } = case.single();
                send(&mut pipe, &positions).and_then(|()| send(&mut pipe, &indices))
            }
            _ => send(&mut pipe, &case.mesh.positions).and_then(|()| send(&mut pipe, &case.mesh.faces)),
        };
    }
    let output = child.wait_with_output()?;
    if !output.status.success() {
        return Err(anyhow!("{}, {}", output.status, String::from_utf8_lossy(&output.stderr).trim()));
    }
    Ok(Some(String::from_utf8_lossy(&output.stdout).trim().parse()?))
}

/// The job of this process, if it is such a child.
pub fn job() -> Option<String> {
    env::var(JOB).ok()
}

/// Does the job of a child: simplifies the mesh on standard input and prints what the peak grew by.
///
/// # Errors
/// A device that cannot be opened or fails, an input that ends early.
pub fn serve(job: &str) -> anyhow::Result<Exit> {
    let [name, threads, faces] = job.split('\t').collect::<Vec<_>>()[..] else {
        return Err(anyhow!("{JOB} is '{job}'"));
    };
    let faces = faces.parse()?;
    let contender = Contender::open(&wish(name)?, threads.parse()?).map_err(|reason| anyhow!(reason))?;
    let before = memory::resident().context("the system does not tell sizes")?;
    // Opening the device may have needed more than it keeps; where this is refused, that counts.
    let _ = fs::write("/proc/self/clear_refs", "5");
    let stdin = &mut io::stdin().lock();
    match &contender.engine {
        Engine::Coarsen(device) => {
            let mesh = Mesh::new(receive(stdin)?, receive(stdin)?);
            contract(&mesh, faces, device)?;
        }
        Engine::Meshoptimizer(solver) => {
            solver(Single { positions: receive(stdin)?, indices: receive(stdin)? }, faces);
        }
    }
    let peak = memory::peak().unwrap_or(0).saturating_sub(before);
    console::print(format!("{peak}\n").as_bytes())?;
    Ok(Exit::Done)
}

/// Writes how many rows there are, and the rows.
fn send<T: Pod>(pipe: &mut impl Write, rows: &[T]) -> io::Result<()> {
    pipe.write_all(&(rows.len() as u64).to_ne_bytes())?;
    pipe.write_all(bytemuck::cast_slice(rows))
}

/// Reads what [`send`] wrote.
fn receive<T: Pod + Zeroable>(pipe: &mut impl Read) -> io::Result<Vec<T>> {
    let mut count = [0; 8];
    pipe.read_exact(&mut count)?;
    let mut rows = vec![T::zeroed(); u64::from_ne_bytes(count) as usize];
    pipe.read_exact(bytemuck::cast_slice_mut(&mut rows))?;
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_go_through_a_pipe() {
        let mut pipe = Vec::new();
        send(&mut pipe, &[[1_u32, 2, 3], [4, 5, 6]]).expect("a buffer takes all");
        send::<f64>(&mut pipe, &[]).expect("a buffer takes all");
        let mut pipe = &pipe[..];
        assert_eq!(receive::<[u32; 3]>(&mut pipe).ok(), Some(vec![[1, 2, 3], [4, 5, 6]]));
        assert_eq!(receive::<f64>(&mut pipe).ok(), Some(Vec::new()));
        assert!(receive::<f64>(&mut pipe).is_err());
    }
}
