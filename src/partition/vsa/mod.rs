//! Faces to regions by variational shape approximation: a region is as good as its faces' normals agree.
//!
//! # Reference
//! \[Jin09\]: regions grow from seeds spread by Gaussian curvature, then faces on borders move to the region beside them while
//! that lowers the energy Σ ρ |n − u|², ρ the area of a face, n its normal and u its region's. Beside the paper: regions are
//! exchanged between where they gain little and where they gain much (\[CSAD04\]'s teleports, many at once), and moves may be
//! found in parallel rounds by kernels.
//!
//! # Invariants
//! - Every face has a region, and the faces of a region are connected across edges, after every pass.
//! - The energy never rises, whether by a face that moves, a round of them or an exchange (but between the iterations of
//!   [`Solver::Lloyd`], and where regions are merged for a [`Goal`] that allows it).
//! - A component without a border has two regions or more, so that every region has a border.
//! - The result depends on the mesh, the options and nothing else.
//!
//! # Units
//! Energies are of the surface with half its bounding box's diagonal as the unit of length, as the papers print them: between
//! zero and twice the area.

mod attempt;
mod driver;
mod exchange;
mod flood;
mod goals;
mod greedy;
mod labeling;
mod lloyd;
mod rounds;
mod scene;
mod search;
mod seeds;
mod split;

use std::ops::ControlFlow;

use crate::error::{Error, Result};
use crate::math::DVec3;

use super::Partition;

pub use driver::partition;
pub(super) use driver::partition_on;

/// How to partition.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// What to reach.
    pub goal: Goal,
    /// How.
    pub solver: Solver,
    /// How carefully regions are kept in one piece.
    pub connectivity: Connectivity,
    /// Attempts from other seeds, at least 1; the best is kept.
    pub restarts: usize,
    /// Exchanges of regions an attempt, at most; 0 leaves the paper's local optimum.
    pub teleports: usize,
    /// Chooses the seeds.
    pub seed: u64,
}

impl Options {
    /// The defaults for a goal.
    pub fn new(goal: Goal) -> Self {
        Self {
            goal,
            solver: Solver::default(),
            connectivity: Connectivity::default(),
            restarts: RESTARTS,
            teleports: TELEPORTS,
            seed: 0,
        }
    }

    /// [`Error::Parameter`] for what is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        let wrong = |what: String| Err(Error::Parameter(what));
        match self.goal {
            Goal::Regions(0) => wrong("0 regions: give 1 or more".into()),
            Goal::Energy(limit) if !(limit >= 0.0 && limit.is_finite()) => {
                wrong(format!("the energy limit is {limit}: give 0 or more"))
            }
            Goal::Deviation(limit) if !(limit >= 0.0 && limit.is_finite()) => {
                wrong(format!("the deviation limit is {limit}: give 0 or more"))
            }
            _ if self.restarts == 0 => wrong("0 attempts: give 1 or more".into()),
            _ => Ok(()),
        }
    }
}

/// Attempts by default, as in the paper's comparison.
const RESTARTS: usize = 3;
/// Exchanges by default: later ones gain less than a thousandth.
const TELEPORTS: usize = 8;

/// What to reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Goal {
    /// So many regions; fewer where more would be alike, more where parts of the surface are apart.
    Regions(usize),
    /// At most this energy, with few regions.
    Energy(f64),
    /// No vertex farther than this from the plane of a region that it is a corner of, in model units, with few regions.
    Deviation(f64),
}

/// How to partition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Solver {
    /// Faces on borders move one by one.
    #[default]
    Greedy,
    /// Many faces move at once, by kernels; the last ones one by one.
    Rounds,
    /// Regions are grown anew around their directions: the slower classic, to compare with.
    Lloyd,
}

/// How carefully regions are kept in one piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Connectivity {
    /// A face may leave if those around it hang together without it: never wrong, sometimes too strict.
    Local,
    /// Where that says no and no other move is left, a search of bounded length decides.
    #[default]
    Exact,
}

/// What a region is like on the whole.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Proxy {
    /// The unit normal: the mean of the faces' by area; zero where they cancel.
    pub normal: DVec3,
    /// The mean of the faces' points by area, in the surface's frame.
    pub point: DVec3,
    /// In square units of the frame.
    pub area: f64,
    /// Its share of the energy.
    pub energy: f64,
}

impl Proxy {
    /// The proxy in model units; energies stay as they are.
    pub(super) fn in_model(self, surface: &super::Surface) -> Self {
        let frame = surface.frame;
        let side = frame.length_to_model(self.area.sqrt());
        Self { point: frame.point_to_model(self.point), area: side * side, ..self }
    }
}

/// Faces by region, and how it came about.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Vsa {
    /// The regions.
    pub partition: Partition,
    /// One a region.
    pub proxies: Vec<Proxy>,
    /// The energy after every pass, round, exchange or iteration of the attempt that was kept; the last is the result's.
    pub energies: Vec<f64>,
    /// Which attempt was kept.
    pub attempt: usize,
    /// Whether it ended early because it was asked to; the partition is valid all the same.
    pub is_cancelled: bool,
    /// Whether kernels ran on a GPU to the end.
    pub on_gpu: bool,
    /// To and from a GPU.
    pub bytes_moved: u64,
    /// Where the time went.
    pub seconds: Seconds,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// Where the time went.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seconds {
    /// Normals, areas, curvature and components.
    pub measure: f64,
    /// All attempts.
    pub solve: f64,
    /// Of those, moving bytes to and from a GPU.
    pub transfer: f64,
}

/// Told after every pass of every attempt; may ask to stop.
pub type OnPass<'a> = dyn FnMut(Pass) -> ControlFlow<()> + Send + 'a;

/// Where a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pass {
    /// Which attempt, from 0; several may run at once.
    pub attempt: usize,
    /// How many regions it has now.
    pub regions: usize,
    /// Its energy now.
    pub energy: f64,
}
