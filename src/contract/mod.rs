//! Pair contraction in rounds: evaluate every pair, let the cheapest through a gate, contract an independent set of them.
//!
//! The loop is in `driver`; its verbs are `evaluate` (on a device), `select`, `commit` (with `filter` and `placement`) and
//! `surface` (what a round leaves, without gaps). Where it meets a budget, `snapshot` makes an outcome, and it goes on to the
//! next of `levels`.
//!
//! # Invariants
//! - Decisions are made on the CPU, from keys that are the same bits on every device.
//! - Between rounds every face lives, and every ring lists its faces in ascending order (`surface`).
//! - A contraction passes the link condition on the state that those before it left: manifold in, manifold out; Euler
//!   characteristic, borders and parts are kept. [`crate::mesh::validate()`] checks a result.
//!
//! # What gives way
//! What each contraction keeps a run may lose, with a warning, where it would keep it from its number of faces:
//! - parts smaller than the error go, unless [`Options::prune`] is `Some(0.0)`;
//! - holes too small to show close, unless [`Options::close_holes`] is `Some(0.0)`;
//! - vertices where the surface is not manifold move, and its topology may change there, unless [`Options::non_manifold`] is
//!   [`NonManifold::Hold`]. Otherwise it is also cut apart where it touches itself, before the run.

mod advance;
mod apply;
mod attempt;
mod attempts;
mod attribute_rows;
mod attributes;
mod between_rounds;
mod blend;
mod carry;
mod chart;
mod checkpoint;
mod commit;
mod committed;
mod compact;
mod cost_lanes;
mod crossings;
mod deal;
mod descend;
mod destination;
mod driver;
mod evaluate;
mod examine;
mod face_terms;
mod features;
mod filter;
mod fit;
mod fit_guard;
mod follower;
mod gate;
mod gather_wedges;
mod history;
mod hold;
mod join;
mod keep_wedges;
mod layout;
mod least_faces;
mod leave_out;
mod levels;
mod listing;
mod lock;
mod meeting;
mod pace;
mod patch;
mod patch_sizes;
mod placement;
mod pose;
mod prepare;
mod pressure;
mod propose;
mod quadrics;
mod quads;
mod quantize;
mod ranks;
mod reach;
mod record;
mod refusals;
mod restore;
mod retreat;
mod rules;
mod scan;
mod seam_filter;
mod seam_flags;
mod seam_pressure;
mod select;
mod shading;
mod side_edges;
mod side_faces;
mod side_sums;
mod sides;
mod small_holes;
mod small_parts;
mod snapshot;
mod star;
mod surface;
mod triangle;
mod triangles;
mod unwedge;
mod uv_kernel;
mod warm_up;
mod wedges;
mod weigh;
mod weighting;
mod work;
mod yielding;

use std::sync::Arc;
use std::time::Instant;

use crate::backend::{Awake, Device};
use crate::error::{Error, Result};
use crate::kernel::pair_quadric::{ANYWHERE, AT_ENDS, AT_THREE, ON_SEGMENT};
use crate::mesh::limits::{MAX_FLIP_RAD, check_max_flip};
use crate::mesh::{Mesh, vertex_normals};
use crate::polish::Flips;
use crate::simplify::{Budget, OnProgress, Outcome};

use driver::Job;

pub use crate::mesh::{Dropped, Normals};
pub use attributes::{AttributeWeights, Attributes, ColorSpace, Seams};
pub use features::feature_degrees;
pub(crate) use follower::auto_faces;
pub use lock::Lock;
pub use quadrics::{PlaneWeight, QuadricFormat, QuadricFrame, QuadricRecord, Quadrics};
pub use quantize::{InitialQuadrics, initial_quadrics};
pub(crate) use warm_up::warm_up;
pub use weighting::{Feature, FeatureMode, Update, Weighting};

/// What a contraction costs and where its vertex goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Metric {
    /// Squared distances to the current faces of both stars by their areas, the volume kept \[LT98\] where planes tell where the vertex
    /// goes.
    #[default]
    Volume,
    /// Squared distances to the planes of the original, accumulated \[GH97\].
    Plane,
}

/// What is contracted \[Wu12\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Candidates {
    /// Two vertices become one.
    #[default]
    Pairs,
    /// The three corners of a face become one vertex, by the [`Plane`](Metric::Plane) metric: four faces at once, with fewer
    /// choices. The last faces before a target, and what no triangle reaches, are left to pairs.
    Triangles,
}

impl Candidates {
    /// Faces that a contraction removes at most.
    fn most_faces(self) -> usize {
        match self {
            Self::Pairs => 2,
            Self::Triangles => 4,
        }
    }
}

/// What becomes of vertices around which the surface is not one fan, once faces agree on which side is outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NonManifold {
    /// A vertex becomes one for each fan around it, so that what only touches there goes its own way; no border opens
    /// \[GTLH98\]. Faces on an edge that cannot be paired stay together, as where three meet: such vertices are held, until they keep
    /// a run from its number of faces, or two fifths of these, or a fifth of a result that is more than 2 % of the diagonal off and is
    /// closer by much without. Then they move, what comes to lie on itself vanishes, and an outcome warns
    /// of it. With [`Placement::Endpoint`], a join distance or a log all are held, with a fit or [`Candidates::Triangles`] these
    /// always.
    #[default]
    Cut,
    /// They stay where they are, and so do the edges between them.
    Hold,
}

/// Where the vertex of a contraction may go \[Wu12\].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// Where the metric is least.
    #[default]
    Optimal,
    /// Where the metric is least between the two ends.
    Segment,
    /// At an end or midway.
    EndpointOrMiddle,
    /// At one of the two ends: the result's vertices are a subset of the input's.
    Endpoint,
}

impl Placement {
    /// Its number in the kernels.
    fn code(self) -> u32 {
        match self {
            Self::Optimal => ANYWHERE,
            Self::Segment => ON_SEGMENT,
            Self::EndpointOrMiddle => AT_THREE,
            Self::Endpoint => AT_ENDS,
        }
    }
}

/// Options of pair contraction.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// The metric.
    pub metric: Metric,
    /// What is contracted.
    pub candidates: Candidates,
    /// The placement policy.
    pub placement: Placement,
    /// What every vertex counts. A fit after the rounds does not know it.
    pub weighting: Weighting,
    /// What the planes of the metric `plane` count, and how its initial quadrics are stored.
    pub quadrics: Quadrics,
    /// Weight of border edges against faces; 0 lets borders move freely.
    pub border_weight: f32,
    /// Whether border vertices stay where they are.
    pub lock_border: bool,
    /// Vertices that stay where they are, one entry a vertex of the input; a joined vertex stays if any of its members
    /// does. `None` holds nobody.
    pub locked: Option<Arc<[bool]>>,
    /// Further such vertices.
    pub lock: Option<Lock>,
    /// Largest turn of a face's normal in one contraction, in radians.
    pub max_flip_rad: f32,
    /// Contract pairs of vertices without an edge too, where they lie closer than this in model units: across components,
    /// and from border to border. Parts then join, gaps close, and surfaces may meet in vertices and edges of more than two
    /// faces; faces that come to lie on each other back to back vanish \[Wu12\]. 0 for edges alone.
    pub join_within: f64,
    /// What becomes of vertices where the surface is not manifold.
    pub non_manifold: NonManifold,
    /// Join vertices at most this far apart first, in model units; `None` joins nothing, 0 joins equal positions.
    pub weld: Option<f64>,
    /// Sweeps that fit the result's vertices to the original after the rounds; 0 for none. Each takes about as long as the
    /// rounds. Borders and locked vertices stay; with [`Placement::Endpoint`] all do.
    pub fit: u32,
    /// Edge flips after the rounds and the fit. Not together with a log.
    pub flips: Flips,
    /// Drop components whose bounding box's diagonal is below this fraction of the mesh's first; with 0 none. `None` drops those
    /// without which a run comes to its number of faces and that keep it from it, for none can have fewer than its topology needs:
    /// as far as they are smaller than what it came to with them is off, and than a twentieth of the diagonal. An outcome warns of it,
    /// and counts their size in its estimate, not how far they were from the rest. `None` is 0 with a log, a join distance, locks,
    /// [`Placement::Endpoint`], an error limit, and where nothing is welded.
    pub prune: Option<f64>,
    /// Close holes whose border's bounding box has a diagonal below this fraction of the mesh's first; with 0 none. Those of up to 64
    /// sides, among faces of one winding, material and piece of a texture, and no outline of a sheet; an outcome warns of others. `None`
    /// closes those across which the surface goes on, where they would keep more than half of the faces asked for, none fewer than
    /// five: the smallest first, as far as they are smaller than three quarters of the sides of that many equal faces, and than
    /// a twentieth of the diagonal, if the others keep no more. An outcome warns of what closes, and counts half its size in its
    /// estimate. `None` is 0 with a log, a join distance, locks, [`Placement::Endpoint`], an error limit, and where nothing is welded.
    pub close_holes: Option<f64>,
    /// What becomes of normals, colors, texture coordinates and other attributes.
    pub attributes: Attributes,
    /// Whether to keep a log of the contractions: [`Outcome::log`]. Not together with a fit, whose moves are no
    /// contractions. It holds one normal and one color a vertex; what else there is, is dropped.
    pub log: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            metric: Metric::Volume,
            candidates: Candidates::Pairs,
            placement: Placement::Optimal,
            weighting: Weighting::Uniform,
            quadrics: Quadrics::default(),
            border_weight: 1.0,
            lock_border: false,
            locked: None,
            lock: None,
            max_flip_rad: MAX_FLIP_RAD,
            join_within: 0.0,
            non_manifold: NonManifold::default(),
            weld: Some(0.0),
            fit: 0,
            flips: Flips::default(),
            prune: None,
            close_holes: None,
            attributes: Attributes::default(),
            log: false,
        }
    }
}

impl Options {
    /// Half-edge contraction by plane quadrics that count features more \[Yang13\]: keeps vertices of the input where the
    /// curvature changes.
    pub fn feature_weighted() -> Self {
        Self {
            metric: Metric::Plane,
            placement: Placement::Endpoint,
            weighting: Weighting::Feature(Feature::default()),
            ..Self::default()
        }
    }

    /// Contraction by quadrics of planes that count alike, stored as average quadrics in single precision \[Yu14\]. Without
    /// a format these are the quadrics of \[GH97\].
    pub fn averaged() -> Self {
        let quadrics = Quadrics { planes: PlaneWeight::One, format: Some(QuadricFormat::F32), ..Quadrics::default() };
        Self { metric: Metric::Plane, quadrics, ..Self::default() }
    }

    /// Whether parts may join.
    fn joins(&self) -> bool {
        self.join_within > 0.0
    }

    /// Whether the surface is cut apart where it touches itself. What joins parts would join it again, a log and what keeps
    /// the vertices of the input have one name for each of these.
    fn cuts(&self) -> bool {
        let is_of_input = self.placement == Placement::Endpoint;
        self.non_manifold == NonManifold::Cut && !(self.joins() || self.log || is_of_input)
    }

    /// Whether parts may go, or holes close, that nobody named: not where vertices stay or are those of other levels, a log tells of
    /// all, parts join, or faces that lie side by side are parts of their own.
    fn may_lose_parts(&self) -> bool {
        let is_held = self.locked.is_some() || self.lock.is_some() || self.lock_border;
        let is_of_input = self.placement == Placement::Endpoint;
        self.weld.is_some() && !(is_held || is_of_input || self.log || self.joins())
    }

    fn check_triangles(&self) -> Result<()> {
        let found_anew = matches!(self.weighting, Weighting::Feature(Feature { update: Update::Recompute, .. }));
        let refused = [
            (self.metric == Metric::Volume, "the metric 'volume': give 'plane'"),
            (self.placement == Placement::Segment, "a placement on a segment: a triangle has three"),
            (self.joins(), "a join distance: parts join by pairs"),
            (found_anew, "weights that are found anew in every round"),
        ];
        match refused.into_iter().find(|(is_given, _)| *is_given) {
            Some((_, what)) => Err(Error::Parameter(format!("triangles as candidates do not go with {what}"))),
            None => Ok(()),
        }
    }

    fn check(&self) -> Result<()> {
        self.attributes.check()?;
        self.quadrics.check(self.metric == Metric::Plane)?;
        let positive = |x: f32| x >= 0.0 && x.is_finite();
        if !positive(self.border_weight) || self.border_weight > 1e6 {
            return Err(Error::Parameter(format!("the border weight is {}, not in 0 … 1e6", self.border_weight)));
        }
        check_max_flip(self.max_flip_rad)?;
        if !(self.join_within >= 0.0 && self.join_within.is_finite()) {
            return Err(Error::Parameter(format!("the join distance is {}: give 0 or more", self.join_within)));
        }
        if self.joins() && self.fit > 0 {
            return Err(Error::Parameter(
                "a fit needs surfaces, and joined parts are none: leave out one of both".into(),
            ));
        }
        if self.candidates == Candidates::Triangles {
            self.check_triangles()?;
        }
        if let Some(limit) = self.prune.filter(|limit| !(0.0..=1.0).contains(limit)) {
            return Err(Error::Parameter(format!("the prune limit is {limit}, not in 0 … 1")));
        }
        if let Some(limit) = self.close_holes.filter(|limit| !(0.0..=1.0).contains(limit)) {
            return Err(Error::Parameter(format!("the limit of holes that close is {limit}, not in 0 … 1")));
        }
        if self.log && self.close_holes.is_some_and(|limit| limit > 0.0) {
            return Err(Error::Parameter(
                "a log and holes that close exclude each other: new faces are in no record".into(),
            ));
        }
        if self.log && self.fit > 0 {
            return Err(Error::Parameter(
                "a log and a fit exclude each other: fitted positions are in no record".into(),
            ));
        }
        if self.log && self.flips.sweeps > 0 {
            return Err(Error::Parameter("a log and flips exclude each other: turned edges are in no record".into()));
        }
        Ok(())
    }
}

/// Runs pair contraction for all of `budgets`, several times where runs are compared: see [`crate::simplify_levels()`].
pub fn run(
    mesh: &Mesh,
    options: &Options,
    budgets: &[Budget],
    device: &Device,
    progress: Option<&mut OnProgress<'_>>,
) -> Result<Vec<Outcome>> {
    options.check()?;
    options.weighting.check(mesh.positions.len())?;
    device.install(|| {
        let (clock, awake) = (Instant::now(), &Awake::new());
        let job = Job { mesh, options, budgets, device, clock, awake, worst_deviation: f64::INFINITY };
        let mut outcomes = small_holes::run(job, progress)?;
        if options.attributes.recomputes() {
            for outcome in &mut outcomes {
                outcome.mesh.normals = Some(vertex_normals(&outcome.mesh));
                shading::flatten_tangents(&mut outcome.mesh, |_| true);
            }
        }
        Ok(outcomes)
    })
}
