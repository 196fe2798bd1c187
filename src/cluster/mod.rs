//! Vertex clustering: the vertices in a cell of a grid become one, and the faces that span three cells are left.
//!
//! The fast first pass for enormous or broken meshes: any faces at all are accepted, and topology is ignored. Parts that
//! share a cell are joined; both sides of what is thinner than a cell fall together, and faces that then coincide take
//! each other away; holes open and close; borders shrink by up to a cell. The result depends on where the grid lies.
//!
//! The flow is in `driver`: vertices on a `lattice`, their cells on a device, a `search` for the grid where a number of
//! faces is asked for, the faces `left`, sums and representatives of the cells on a device, and the mesh `made` of them.
//!
//! # Invariants
//! - Every vertex of the result lies in the closed cell that it stands for, so that no vertex is farther from its
//!   representative than the cell's diagonal.
//! - Every face of the result has its corners in three cells; no two have the same three.
//! - Cells are decided in integers, and sums go over the faces of a cell in ascending order: the same bytes on any device.
//!
//! # Grouping
//! On the host: a hash table of the cells that keep a face, which fits a core's cache, places five million vertices in
//! 20 ms on two threads, where sorting them takes 65; faces are sorted by cell by counting. A GPU sends it keys (8 bytes a
//! vertex) and the cells of faces (12 bytes a face), and has little left to do: [`crate::backend::Selector::Auto`] takes the
//! CPU.
//!
//! # Reference
//! \[RB93\] the method; \[Lin00\] the representative of least quadric; \[Wu12\] the survey. Departs: the corners of faces count for
//! the mean, not vertices, so that a soup has the mean of the mesh welded.

mod driver;
mod lattice;
mod left;
mod made;
mod pieces;
mod search;
mod work;

use crate::backend::Device;
use crate::error::{Error, Result};
use crate::kernel::cell_keys::{LEAST_STEPS, SITE_BITS};
use crate::mesh::Mesh;
use crate::polish::Flips;
use crate::simplify::{Budget, OnProgress, Outcome};

/// Where the vertices of a cell go.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Representative {
    /// Where the distances to the planes of the cell's faces are least, held to the cell \[Lin00\].
    #[default]
    Quadric,
    /// To the mean of the corners of faces in the cell.
    Mean,
    /// To the vertex nearest to where [`Representative::Quadric`] is: the result's vertices are a subset of the input's.
    Input,
}

/// Options of vertex clustering.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Options {
    /// Cells along the longest side of the bounding box, up to [`MOST_CELLS`]; exactly as many up to 2,896, a few less
    /// above. The budget is empty then. `None` takes the grid from the budget: with a number of faces the finest found that
    /// leaves at most as many, 98 % or more where the mesh allows it and never exactly as many but by chance; with an error
    /// limit the coarsest whose cells' diagonal is within; with both the finer of the two. A grid that leaves no face gives
    /// way to a finer one.
    pub grid: Option<u32>,
    /// The representative.
    pub representative: Representative,
    /// Edge flips after the grid.
    pub flips: Flips,
}

/// Cells along the longest side of the finest grid.
pub const MOST_CELLS: u32 = (1 << SITE_BITS) / LEAST_STEPS;

impl Options {
    fn check(&self, budget: &Budget) -> Result<()> {
        match self.grid {
            Some(cells) if !(1..=MOST_CELLS).contains(&cells) => Err(Error::Parameter(format!(
                "the grid has {cells} cells along the longest side, not 1 … {MOST_CELLS}"
            ))),
            Some(_) if *budget != Budget::default() => {
                Err(Error::Parameter("a grid and a target contradict each other: give one of them".into()))
            }
            _ => Ok(()),
        }
    }
}

/// Runs vertex clustering: see [`crate::simplify()`].
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    options.check(budget)?;
    device.install(|| driver::run(mesh, options, budget, device, progress))
}
