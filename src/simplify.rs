//! The one entry: a method, a budget, and what came out.

use std::ops::ControlFlow;

use crate::backend::Device;
use crate::cluster;
use crate::contract;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::partition;
use crate::polish::{self, Flips};
use crate::progressive::CollapseLog;
use crate::removal;

/// How to simplify. A closed set: one variant a driver, each with its options.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// Quadric pair contraction in rounds.
    Contract(contract::Options),
    /// Vertex clustering: the fast first pass for enormous or broken meshes. Ignores topology, and meets a number of faces
    /// from below, not exactly.
    Cluster(cluster::Options),
    /// Vertex removal with retriangulation: the result's vertices are vertices of the input.
    Removal(removal::Options),
    /// Regions of faces, each triangulated anew between borders simplified once for both sides: the result's vertices are
    /// vertices of the input, but for those of superfaces that slide to where the light bends.
    Partition(partition::Options),
}

impl Method {
    /// Whether the materials of `mesh` are gone from the result, so that what several nodes of a glTF show has to be part of the mesh
    /// before the run: [`Scene::with_instances`](crate::formats::Scene::with_instances). Not for a log, which is of the mesh as it
    /// was read.
    pub fn drops_materials(&self, mesh: &Mesh) -> bool {
        match self {
            Self::Contract(options) => options.attributes.dropped.materials && !options.log,
            Self::Cluster(_) => false,
            Self::Removal(_) => mesh.materials.as_ref().is_some_and(|materials| materials.names.len() > 1),
            Self::Partition(options) => options.dropped.materials,
        }
    }

    /// The edge flips that follow.
    pub fn flips(&self) -> Flips {
        match self {
            Self::Contract(options) => options.flips,
            Self::Cluster(options) => options.flips,
            Self::Removal(options) => options.flips,
            Self::Partition(options) => options.flips,
        }
    }
}

impl Default for Method {
    fn default() -> Self {
        Self::Contract(contract::Options::default())
    }
}

/// When to stop: the first limit reached ends the run. Contraction and removal need one; clustering does unless a grid is given, and
/// then takes none; partition takes error limits alone, or none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Budget {
    /// Faces to keep.
    pub faces: Option<usize>,
    /// Fraction of the input's faces to keep, in `[0, 1]`.
    pub keep: Option<f64>,
    /// Estimated deviation allowed, as a fraction of the bounding box's diagonal; of clustering how far a vertex may move.
    pub error: Option<f64>,
    /// Estimated deviation allowed, in model units.
    pub error_abs: Option<f64>,
}

impl Budget {
    /// Stop at `faces` faces.
    pub fn faces(faces: usize) -> Self {
        Self { faces: Some(faces), ..Self::default() }
    }

    /// Stop when this fraction of the faces is left, one at least unless it is 0.
    pub fn keep(fraction: f64) -> Self {
        Self { keep: Some(fraction), ..Self::default() }
    }

    /// Stop when this fraction of the faces is gone (the meaning of VTK and trimesh).
    pub fn reduction(fraction: f64) -> Self {
        Self::keep(1.0 - fraction)
    }

    /// Stop before the estimated deviation passes this fraction of the bounding box's diagonal.
    pub fn error(fraction: f64) -> Self {
        Self { error: Some(fraction), ..Self::default() }
    }

    /// Stop before the estimated deviation passes this length in model units.
    pub fn error_abs(length: f64) -> Self {
        Self { error_abs: Some(length), ..Self::default() }
    }

    /// The face count at which a mesh of `faces_in` faces is done; 0 with only error limits.
    ///
    /// # Errors
    /// [`Error::Parameter`] when no limit is given or one is out of range.
    pub fn target_faces(&self, faces_in: usize) -> Result<usize> {
        if *self == Self::default() {
            return Err(Error::Parameter("no target: give a face count, a fraction to keep or an error limit".into()));
        }
        let by_keep = match self.keep {
            // A part of a mesh is no less than a face.
            Some(keep) if (0.0..=1.0).contains(&keep) => {
                Some(((faces_in as f64 * keep).round() as usize).max(usize::from(keep > 0.0)))
            }
            Some(keep) => return Err(Error::Parameter(format!("the fraction to keep is {keep}, not in 0 … 1"))),
            None => None,
        };
        Ok(self.faces.into_iter().chain(by_keep).max().unwrap_or(0))
    }

    /// Refuses limits that are out of range on every mesh. Whether there must be one is for the method to say.
    fn check(&self) -> Result<()> {
        if *self == Self::default() {
            return Ok(());
        }
        self.target_faces(0).and(self.max_deviation(1.0)).map(drop)
    }

    /// Whether a number of faces is asked for.
    pub fn counts_faces(&self) -> bool {
        self.faces.is_some() || self.keep.is_some()
    }

    /// Whether a run that ended by `stop` is where it was to go: an error limit beside a face count is a limit, not the target.
    pub fn is_reached(&self, stop: StopReason) -> bool {
        match stop {
            StopReason::FacesReached | StopReason::GridReached | StopReason::RegionsRebuilt => true,
            StopReason::ErrorReached => !self.counts_faces(),
            StopReason::Stuck | StopReason::Cancelled => false,
        }
    }

    /// The deviation allowed in model units on a mesh of this diagonal; infinite without an error limit.
    ///
    /// # Errors
    /// [`Error::Parameter`] when a limit is negative or not a number.
    pub fn max_deviation(&self, diagonal: f64) -> Result<f64> {
        let limits = [(self.error, diagonal, "of the diagonal"), (self.error_abs, 1.0, "in model units")];
        limits.into_iter().try_fold(f64::INFINITY, |least, limit| match limit {
            (None, ..) => Ok(least),
            (Some(given), unit, _) if given >= 0.0 => Ok(least.min(given * unit)),
            (Some(given), _, of) => Err(Error::Parameter(format!("the error limit is {given} {of}: give 0 or more"))),
        })
    }
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The face count was reached.
    FacesReached,
    /// No contraction is left that is legal and within the error limit, or no coarser grid is within.
    ErrorReached,
    /// Every pair that is left is refused; [`Outcome::blocked`] counts the reasons. Of clustering: no coarser grid leaves a
    /// face.
    Stuck,
    /// The grid that was asked for is done.
    GridReached,
    /// Every region is rebuilt.
    RegionsRebuilt,
    /// The progress callback asked to stop.
    Cancelled,
}

/// How many pairs, or vertices of vertex removal, were refused in a round, by reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Blocked {
    /// Would join two borders or pull a border into the surface.
    pub border: u64,
    /// Both ends are locked, or one is a hub of hundreds of faces; of vertex removal the vertices that stay. Counted when
    /// a run is stuck, or ends at its error limit.
    pub lock: u64,
    /// Both ends are on a seam of the texture, which stays.
    pub seam: u64,
    /// The link condition fails: the surface would change its topology or lose manifoldness.
    pub link: u64,
    /// A face would turn over or fold.
    pub flip: u64,
    /// A face would become a sliver.
    pub aspect: u64,
    /// The texture would fold or tear.
    pub texture: u64,
    /// A face would come to pass through another: asked within an error limit, where few faces are left. Without one such pairs wait.
    pub crossing: u64,
    /// The estimated deviation would pass the limit.
    pub error: u64,
}

/// What one round did.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct RoundRecord {
    /// Live faces at the start.
    pub faces: u64,
    /// Pairs evaluated; of vertex removal vertices.
    pub pairs: u64,
    /// Those that passed the gate.
    pub candidates: u64,
    /// Contractions, two for each triangle, or vertices removed.
    pub contracted: u64,
    /// Those refused, by reason.
    pub blocked: Blocked,
    /// Greatest cost contracted, in the metric's own unit.
    pub greatest_cost: f32,
    /// Whether a GPU evaluated the round.
    pub on_gpu: bool,
}

/// Wall-clock seconds by phase.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Phases {
    /// Joining equal positions, dropping degenerate and duplicate faces.
    pub weld: f64,
    /// Normalisation, adjacency, first sums; of clustering the lattice.
    pub build: f64,
    /// Sums, pairs and costs; of clustering the representatives.
    pub cost: f64,
    /// Gate and ordering; of clustering the search for the grid, and what it leaves.
    pub select: f64,
    /// Filters and placements; an estimate from one attempt in sixteen, since they alternate with contractions.
    pub filter: f64,
    /// Contractions and compaction; of clustering the mesh.
    pub apply: f64,
    /// Fitting the vertices to the original, where asked for.
    pub fit: f64,
    /// Turning edges, where asked for.
    pub flip: f64,
    /// Moving data to and from the GPU.
    pub transfer: f64,
    /// Back to meshes in the input's order.
    pub restore: f64,
    /// The whole call.
    pub total: f64,
}

impl Phases {
    /// All that was not building.
    pub(crate) fn but_building(&self) -> f64 {
        let Self { weld, cost, select, filter, apply, fit, flip, transfer, restore, .. } = *self;
        weld + cost + select + filter + apply + fit + flip + transfer + restore
    }
}

impl std::iter::Sum for Phases {
    fn sum<I: Iterator<Item = Self>>(runs: I) -> Self {
        runs.fold(Self::default(), |a, b| Self {
            weld: a.weld + b.weld,
            build: a.build + b.build,
            cost: a.cost + b.cost,
            select: a.select + b.select,
            filter: a.filter + b.filter,
            apply: a.apply + b.apply,
            fit: a.fit + b.fit,
            flip: a.flip + b.flip,
            transfer: a.transfer + b.transfer,
            restore: a.restore + b.restore,
            total: a.total + b.total,
        })
    }
}

/// A simplified mesh and how it came about.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The result.
    pub mesh: Mesh,
    /// For every vertex of the result the input vertex at the same position, or [`MOVED`]. Several have one where the surface was
    /// cut apart.
    pub vertex_origin: Vec<u32>,
    /// Faces of the input.
    pub faces_in: usize,
    /// The face count asked for; 0 with only error limits.
    pub target: usize,
    /// Why the run ended.
    pub stop: StopReason,
    /// What blocked further reduction, counted in the last round.
    pub blocked: Blocked,
    /// Largest estimated deviation of a contraction, in model units: with the `volume` metric the greater sum of steps of
    /// both ends and its own, the root of the area-weighted mean squared distance to the planes of the faces around the
    /// pair, and to border edges there; with `plane` the root of that to the planes of the input which the new vertex
    /// stands for. Of clustering the latter, of a representative and the faces that touch its cell. An estimate, not a bound. Of vertex removal no less
    /// than the distance of any vertex of the input to the result. Of partition the greatest distance of a vertex from its
    /// region's plane, or of one on a border from the segment in its place. Flips that follow do not change it.
    pub error_estimate: f64,
    /// Of clustering the side of a cell in model units; the diagonal, √3 times as long, bounds how far a vertex of the
    /// input is from its representative.
    pub cell_size: Option<f64>,
    /// How the initial quadrics were stored, where a format was asked for.
    pub quadrics: Option<contract::QuadricRecord>,
    /// Edges turned after the run, some more than once.
    pub flips: usize,
    /// The contractions one by one, where asked for.
    pub log: Option<CollapseLog>,
    /// The regions, of simplification by partition.
    pub regions: Option<partition::Regions>,
    /// One record a round of contraction or removal; clustering and partition have none.
    pub rounds: Vec<RoundRecord>,
    /// Seconds by phase.
    pub seconds: Phases,
    /// Bytes moved to and from the GPU; 0 on the CPU.
    pub bytes_moved: u64,
    /// The device that did the work, in words.
    pub device: String,
    /// What the caller should know: repaired input, a device that was lost.
    pub warnings: Vec<String>,
}

impl Outcome {
    /// With another warning, if there is one.
    pub(crate) fn with_warning(mut self, warning: Option<&str>) -> Self {
        self.warnings.extend(warning.map(String::from));
        self
    }

    /// Where others were tried, which took so many seconds after it was there.
    pub(crate) fn later(mut self, spent: f64) -> Self {
        self.seconds.build += spent;
        self.seconds.total += spent;
        self
    }
}

/// Marks a vertex of the result that stands at no input vertex's position.
pub const MOVED: u32 = u32::MAX;

/// How far a run is.
///
/// Where a result comes from several runs, as those that are compared or made again without small parts, each reports for itself: from
/// one to the next `faces` jumps back up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Live faces now; of clustering those that a grid leaves.
    pub faces: usize,
    /// Faces of the input.
    pub faces_in: usize,
    /// Faces asked for: of the levels that a run has to make the coarsest; 0 with only error limits.
    pub target: usize,
}

/// Called after every round of contraction and removal, every grid that clustering tries, and often while a partition looks for its
/// regions; break to cancel. A weld before, a fit and flips after report nothing, and cannot be cancelled.
pub type OnProgress<'a> = dyn FnMut(Progress) -> ControlFlow<()> + Send + 'a;

/// Loads what `method` runs on a GPU, so that the first mesh does not wait for kernels to be compiled. Meant to go on while
/// the mesh is read; on the CPU there is nothing to load.
///
/// # Errors
/// [`Error::Parameter`] for an option out of range. A GPU that fails is told when a mesh is simplified.
pub fn warm_up(method: &Method, device: &Device) -> Result<()> {
    match method {
        Method::Contract(options) => contract::warm_up(options, device),
        Method::Cluster(_) | Method::Removal(_) | Method::Partition(_) => Ok(()),
    }
}

/// Simplifies `mesh` by `method` until `budget` is met, on `device`.
///
/// The result does not depend on the device or its thread count. Running out of legal contractions is a result
/// ([`StopReason::Stuck`]), not an error.
///
/// # Errors
/// [`Error::Mesh`] for an invalid mesh or one without faces, [`Error::Parameter`] for a budget or option out of range,
/// [`Error::Limit`] for more vertices or faces than indices hold.
/// A device that is lost on the way is no error: the CPU finishes, and a warning says so.
pub fn simplify(
    mesh: &Mesh,
    method: &Method,
    budget: &Budget,
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Outcome> {
    // One budget, one outcome.
    simplify_levels(mesh, method, std::slice::from_ref(budget), device, progress)
        .map(|mut outcomes| outcomes.swap_remove(0))
}

/// Simplifies `mesh` by `method` to every one of `budgets`, on `device`: a chain of levels of detail, for little more than the
/// coarsest of them costs alone. Returns one outcome a budget, in their order.
///
/// Contraction makes all levels in one run. It meets the budgets from fine to coarse, whatever their order, and restores a mesh
/// where it meets one, so that each level's contractions are the first of the next one's. A level is as near as a run of its own,
/// and the same bytes on every device, but not the bytes of that run: rounds are chosen for the coarsest level. Fits and
/// flips are applied to each level, and the run goes on from where it was. Where seams yield, creases are compared
/// ([`Seams`](contract::Seams)), or vertices that are not manifold move ([`NonManifold`](contract::NonManifold)), levels come from
/// several runs, and each is the best that any of these made of it; one
/// that small parts keep from its number of faces is made by itself without them, and finer ones that are farther off; those that
/// small holes keep from theirs are made of a mesh without these, by themselves where others close. Every other method runs once
/// a budget.
///
/// [`rounds`](Outcome::rounds), [`seconds`](Outcome::seconds), [`bytes_moved`](Outcome::bytes_moved), the estimated error and
/// warnings of a level tell of the run from the input on. The [`log`](Outcome::log) is with the coarsest level, and those met together
/// with it: another is reached after as many contractions as its rounds contracted. Where the run is stuck, the budgets that are left get what
/// there is, [`StopReason::Stuck`]; where `progress` ends it, [`StopReason::Cancelled`]. To `progress` the target is that of the
/// coarsest level that a run of contraction is to make, and otherwise of each.
///
/// ```
/// use coarsen::{Budget, Device, Method, mesh, simplify_levels};
///
/// # fn main() -> coarsen::Result<()> {
/// let part = mesh::sample("part", Some(5_000))?;
/// let budgets = [0.5, 0.25, 0.1].map(Budget::keep);
/// let levels = simplify_levels(&part, &Method::default(), &budgets, &Device::cpu(0)?, None)?;
/// for (level, budget) in levels.iter().zip(&budgets) {
///     // One less where a closed surface has no odd number of faces.
///     assert!(budget.target_faces(part.faces.len())? - level.mesh.faces.len() <= 1);
/// }
/// assert!(levels.is_sorted_by_key(|level| level.error_estimate));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Those of [`simplify()`]; one budget that is out of range refuses all.
pub fn simplify_levels(
    mesh: &Mesh,
    method: &Method,
    budgets: &[Budget],
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Outcome>> {
    if budgets.is_empty() {
        return Ok(Vec::new());
    }
    budgets.iter().try_for_each(Budget::check)?;
    let mut outcomes = match method {
        Method::Contract(options) => contract::run(mesh, options, budgets, device, progress),
        Method::Cluster(options) => {
            one_by_one(budgets, progress, |budget, progress| cluster::run(mesh, options, budget, device, progress))
        }
        Method::Removal(options) => {
            one_by_one(budgets, progress, |budget, progress| removal::run(mesh, options, budget, device, progress))
        }
        Method::Partition(options) => {
            one_by_one(budgets, progress, |budget, progress| partition::run(mesh, options, budget, device, progress))
        }
    }?;
    for outcome in outcomes.iter_mut().filter(|outcome| outcome.stop != StopReason::Cancelled) {
        let had_face_colors = outcome.mesh.face_colors.is_some();
        let flipped = polish::flip(mesh, &mut outcome.mesh, method.flips(), device)?;
        if flipped.edges > 0 {
            let dropped = had_face_colors && outcome.mesh.face_colors.is_none();
            outcome.warnings.extend(dropped.then(|| "face colors are dropped: edges between them were turned".into()));
            // Faces lie on both sides of borders now.
            outcome.regions.iter_mut().for_each(|regions| regions.face_labels.clear());
        }
        outcome.flips = flipped.edges;
        outcome.seconds.flip = flipped.seconds;
        outcome.seconds.total += flipped.seconds;
        outcome.warnings.extend(flipped.warning);
    }
    Ok(outcomes)
}

/// Runs once a budget. What is left when `progress` ends a run gets what that has come to.
fn one_by_one(
    budgets: &[Budget],
    mut progress: Option<&mut OnProgress<'_>>,
    mut run: impl FnMut(&Budget, Option<&mut OnProgress<'_>>) -> Result<Outcome>,
) -> Result<Vec<Outcome>> {
    let mut outcomes: Vec<Outcome> = Vec::with_capacity(budgets.len());
    for budget in budgets {
        let outcome = match outcomes.last().filter(|last| last.stop == StopReason::Cancelled) {
            Some(last) => Outcome { target: budget.target_faces(last.faces_in).unwrap_or(0), ..last.clone() },
            None => match progress.as_deref_mut() {
                Some(report) => run(budget, Some(&mut |step| report(step)))?,
                None => run(budget, None)?,
            },
        };
        outcomes.push(outcome);
    }
    Ok(outcomes)
}
