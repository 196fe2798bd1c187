//! Who simplifies: coarsen on a device, or meshoptimizer.

use std::fmt;
use std::time::Instant;

use coarsen::backend::Selector;
use coarsen::{Budget, Device, Mesh, Method, Outcome, simplify};

use super::baseline::{Rival, Solver};
use super::case::Case;

/// A contender to open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wish {
    /// The CPU with this many threads.
    Cpu(usize),
    /// An adapter, by the name it was asked for.
    Adapter(String, Selector),
    /// A function of meshoptimizer.
    Rival(Rival),
}

impl fmt::Display for Wish {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cpu(threads) => write!(f, "cpu:{threads}"),
            Self::Adapter(name, _) => f.write_str(name),
            Self::Rival(rival) => f.write_str(rival.name()),
        }
    }
}

/// A contender that is there.
pub struct Contender {
    /// As the command line names it.
    pub name: String,
    /// What it is, in words: adapter and driver, or function and version.
    pub what: String,
    pub engine: Engine,
}

/// What does the work.
pub enum Engine {
    Coarsen(Device),
    Meshoptimizer(Solver),
}

/// One run of a job.
pub struct Run {
    pub mesh: Mesh,
    /// From mesh in memory to mesh in memory.
    pub secs: f64,
    /// What coarsen tells beside its mesh, which is taken out of it.
    pub outcome: Option<Outcome>,
}

impl Contender {
    /// Opens what `wish` names; an adapter has `threads` threads of the CPU beside it.
    ///
    /// # Errors
    /// Why it cannot be opened, in words.
    pub fn open(wish: &Wish, threads: usize) -> Result<Self, String> {
        let device = match wish {
            Wish::Cpu(threads) => Device::cpu(*threads),
            Wish::Adapter(_, selector) => Device::open(selector, threads),
            Wish::Rival(rival) => {
                let solver = rival.solver().ok_or("not built in: build with --features baseline")?;
                let (name, what) = (rival.name().into(), rival.description());
                return Ok(Self { name, what, engine: Engine::Meshoptimizer(solver) });
            }
        };
        let device = device.map_err(|error| error.to_string())?;
        Ok(Self { name: wish.to_string(), what: device.description(), engine: Engine::Coarsen(device) })
    }

    /// Whether it is software that stands in for a GPU.
    pub fn is_software(&self) -> bool {
        matches!(&self.engine, Engine::Coarsen(device) if device.is_software())
    }

    /// Simplifies to `faces` faces. What a rival's input is made of is made off the clock.
    ///
    /// # Errors
    /// As [`simplify`].
    pub fn run(&self, case: &Case, faces: usize) -> coarsen::Result<Run> {
        match &self.engine {
            Engine::Coarsen(device) => contract(&case.mesh, faces, device),
            Engine::Meshoptimizer(solver) => {
                let input = case.single();
                let clock = Instant::now();
                let result = solver(input, faces);
                let secs = clock.elapsed().as_secs_f64();
                Ok(Run { mesh: result.into_mesh(), secs, outcome: None })
            }
        }
    }
}

/// Simplifies `mesh` by the default method.
///
/// # Errors
/// As [`simplify`].
pub fn contract(mesh: &Mesh, faces: usize, device: &Device) -> coarsen::Result<Run> {
    let clock = Instant::now();
    let mut outcome = simplify(mesh, &Method::default(), &Budget::faces(faces), device, None)?;
    let secs = clock.elapsed().as_secs_f64();
    Ok(Run { mesh: std::mem::take(&mut outcome.mesh), secs, outcome: Some(outcome) })
}
