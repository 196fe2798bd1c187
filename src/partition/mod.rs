//! Simplification by partition: faces into regions, the borders between regions simplified once for both sides, every region
//! triangulated anew. Vertices of the result are vertices of the input, but for those that slide to where light bends.
//!
//! The flow is in `driver`: the `surface`, its regions ([`By`]), their `boundary` as loops and chains, the `chains` simplified,
//! regions triangulated by `rebuild`, vertices that carry light `slide` and colors `fit`, and the mesh is `restore`d.
//!
//! # Invariants
//! - A [`Partition`] puts every face into one region, and the faces of a region are connected across edges
//!   ([`Partition::validate`]).
//! - Both sides of a chain keep the same vertices: no cracks, no T-junctions; closed in, closed out.
//! - No edge inside a region is an edge anywhere else, and a region keeps its loops: manifold in, manifold out. A region that
//!   cannot be drawn anew keeps its faces.
//! - A region has one material, so that borders between materials are borders between regions.
//! - Decisions are the host's, in double precision and in a fixed order: the same bytes on any device.

mod boundary;
mod chains;
mod coplanar;
mod corners;
mod cut;
mod driver;
mod find;
mod fit;
mod interior;
mod labels;
mod named;
mod plane;
mod polygons;
mod queues;
mod rebuild;
mod restore;
mod slide;
pub mod superface;
mod surface;
mod triangulate;
pub mod vsa;

pub use coplanar::Flatness;
pub use labels::{Fault, Partition};
pub use restore::{NO_REGION, NotPlanar, Regions};
pub use surface::Surface;
pub use triangulate::Triangulation;

use crate::backend::Device;
use crate::error::{Error, Result};
use crate::mesh::limits::check_weld;
use crate::mesh::{Dropped, Mesh, Normals, vertex_normals};
use crate::polish::Flips;
use crate::simplify::{Budget, OnProgress, Outcome};

/// What makes a region.
#[derive(Debug, Clone, PartialEq)]
pub enum By {
    /// Lying in a plane \[Wu12\]: what is flat collapses, and all else stays.
    Coplanar(Flatness),
    /// Lit alike and flat \[Liu99\]: a mesh whose signal lies in its colors.
    Superfaces(Superfaces),
    /// Facing one way as nearly as can be with a number of regions \[Jin09\].
    Variational(Variational),
}

/// Superfaces, and what becomes of their borders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Superfaces {
    /// The regions. A budget with an error limit takes the place of its distance from a plane.
    pub regions: superface::Options,
    /// Greatest difference of color along a border, in 255ths: the paper's δ.
    pub border_color: f64,
    /// Greatest distance of a border from what takes its place, as a fraction of the bounding box's diagonal: the paper's d.
    pub border_distance: f64,
    /// Greatest difference of color at a vertex inside a region, in 255ths; four times that along borders without one. Most
    /// vertices are off by far less: what all of them lose together decides.
    pub inner_color: Option<f64>,
    /// Whether colors of vertices are moved, by a quarter of that at most, so that the light between them is right on average.
    pub fits_light: bool,
    /// Whether vertices slide to where the light bends, within flat regions and along their straight borders: the shape stays, but
    /// they are the input's no more. Their colors go with them, so that it takes `fits_light` too.
    pub slides: bool,
}

impl Default for Superfaces {
    fn default() -> Self {
        let regions = superface::Options::default();
        Self { regions, border_color: 2.0, border_distance: 1e-3, inner_color: None, fits_light: true, slides: true }
    }
}

impl Superfaces {
    fn check(&self) -> Result<()> {
        self.regions.check()?;
        let tolerances = [
            ("color along borders", self.border_color),
            ("distance of borders", self.border_distance),
            ("color inside regions", self.inner_color.unwrap_or(1.0)),
        ];
        match tolerances.into_iter().find(|&(_, tolerance)| tolerance.is_nan() || tolerance <= 0.0) {
            Some((of, tolerance)) => Err(Error::Parameter(format!("the {of} may be off by {tolerance}, not above 0"))),
            None => Ok(()),
        }
    }
}

/// Regions by variational shape approximation, and what becomes of their borders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variational {
    /// The regions. A budget with an error limit takes the place of the goal, as [`vsa::Goal::Deviation`].
    pub regions: vsa::Options,
    /// How far vertices may be off the segment that takes their place, as a fraction of its length.
    pub chord_ratio: f64,
}

impl Variational {
    /// The defaults for a goal.
    pub fn new(goal: vsa::Goal) -> Self {
        Self { regions: vsa::Options::new(goal), chord_ratio: CHORD_RATIO }
    }

    fn check(&self) -> Result<()> {
        self.regions.check()?;
        if self.chord_ratio > 0.0 {
            Ok(())
        } else {
            Err(Error::Parameter(format!("the ratio of chords is {}, not above 0", self.chord_ratio)))
        }
    }
}

/// The paper leaves it open; a fifth is what its pictures show.
const CHORD_RATIO: f64 = 0.2;

/// Options of simplification by partition.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// What makes a region.
    pub by: By,
    /// How outlines become triangles.
    pub triangulation: Triangulation,
    /// Join vertices at most this far apart first, in model units; `None` joins nothing, 0 joins equal positions.
    pub weld: Option<f64>,
    /// Edge flips after the rebuilding.
    pub flips: Flips,
    /// What becomes of normals.
    pub normals: Normals,
    /// What is left out, and holds nothing.
    pub dropped: Dropped,
}

impl Options {
    /// Flat regions: the budget is empty, or an error limit is the distance from a plane.
    pub fn coplanar(flatness: Flatness) -> Self {
        Self::new(By::Coplanar(flatness))
    }

    /// Superfaces, their outlines cut into the roundest ears first as the paper has it.
    pub fn superfaces(superfaces: Superfaces) -> Self {
        Self { triangulation: Triangulation::Ears, ..Self::new(By::Superfaces(superfaces)) }
    }

    /// Variational shape approximation to a goal; an error limit as the budget takes its place.
    pub fn variational(goal: vsa::Goal) -> Self {
        Self::new(By::Variational(Variational::new(goal)))
    }

    fn new(by: By) -> Self {
        Self {
            by,
            triangulation: Triangulation::default(),
            weld: Some(0.0),
            flips: Flips::default(),
            normals: Normals::default(),
            dropped: Dropped::default(),
        }
    }

    fn check(&self, budget: &Budget) -> Result<()> {
        check_weld(self.weld)?;
        if budget.counts_faces() {
            return Err(Error::Parameter("a number of faces cannot be asked for: it follows from the regions".into()));
        }
        match &self.by {
            By::Coplanar(flatness) => flatness.check(),
            By::Variational(variational) => variational.check(),
            By::Superfaces(superfaces) => superfaces.check(),
        }
    }
}

/// Runs simplification by partition: see [`crate::simplify()`].
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budget: &Budget,
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    options.check(budget)?;
    let recomputes = options.normals == Normals::Recompute && !options.dropped.normals;
    let dropped = Dropped { normals: options.dropped.normals || recomputes, ..options.dropped.clone() };
    device.install(|| {
        mesh.check()?;
        let mut outcome = driver::run(&dropped.leave(mesh), options, budget, device, progress)?;
        if recomputes {
            outcome.mesh.normals = Some(vertex_normals(&outcome.mesh));
        }
        Ok(outcome)
    })
}
