//! Where a run may be taken up again, for another in which more seams yield, or small parts go: the surface between two rounds.
//!
//! What early rounds contract is the cheapest, whatever yields. A run that got stuck is taken up where it still had some times as
//! many faces as then, far enough from where it had taken all that it could wherever no seam is.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use crate::backend::Device;
use crate::error::Result;
use crate::kernel::rows::{JOINED, SEAM};
use crate::mesh::parts::{Small, faces_by_size};
use crate::simplify::{Outcome, StopReason};

use super::attempt::Step;
use super::driver::Run;
use super::prepare::Prepared;
use super::small_parts::may_go;
use super::yielding::Yields;
use super::{Metric, Options};

/// How many times fewer faces than one checkpoint the next has at least: copying them all takes about as long as one copy of the
/// surface. Every round would be four times that.
const SHRUNK: usize = 2;
/// How many times as many faces as a run got stuck with it is taken up with at least. With four or eight times as many results are
/// no closer, with as many there is nothing left to weigh seams against.
const AHEAD: usize = 2;
/// From how many times the faces asked for on, which another run kept of other parts than those that go, none is made again in which the
/// same gives way: ten such runs of four meshes came to 0.92 to 1.10 times as many.
const SURELY: f64 = 1.25;

/// Checkpoints of a run, with those that were taken up before it.
#[derive(Debug, Default)]
pub struct Checkpoints {
    /// Those that may still be wanted, one or two, each with fewer faces than the one before.
    kept: VecDeque<Prepared>,
    /// The most faces with which there is another.
    next: Option<usize>,
    /// The face count that is asked for: none is wanted near it.
    target: usize,
    /// What the run came to from its start, or from where it parted.
    came_to: usize,
    phase: Phase,
    /// Whether the run is one after which nothing more yields.
    is_last: bool,
    /// What was to give way in runs that got stuck, one after the other, and how many faces of each part were left, those of the smallest
    /// first.
    tried: Vec<(Step, Vec<usize>)>,
    /// What gives way in the first run from here.
    first: Step,
}

/// What a run is that notes checkpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Phase {
    /// One from the start, or from where it parted.
    #[default]
    First,
    /// One that ends with its checkpoint, from which two others go on.
    Parting,
    /// One that took up the first.
    Again,
}

impl Checkpoints {
    /// Begins with a run from `start` to so many faces at least, after which more may yield, or not: then those of runs before are kept
    /// where small parts may go.
    ///
    /// There are none where the start of all is wanted later on: planes are summed there, and vertices fitted to it.
    pub fn begin(&mut self, start: &Prepared, target: Option<usize>, may_more: bool, options: &Options) {
        let is_first = start.earlier.rounds.is_empty();
        self.is_last = target.is_none() || !may_more;
        if self.is_last && (is_first || !may_go(options)) {
            *self = Self::default();
            return;
        }
        let target = target.unwrap_or_default();
        if !is_first {
            // Those of the first stay: from where others took it up it had not taken all that no seam holds.
            self.phase = if self.phase == Phase::Parting { Phase::First } else { Phase::Again };
            (self.next, self.target) = (None, target);
            return;
        }
        let may_get_stuck = start.positions.iter().any(|p| p.flags & (SEAM | JOINED) != 0);
        let next = (may_get_stuck && may_go_on(options)).then_some(start.faces.len() / SHRUNK);
        *self = Self { next, target, came_to: start.faces.len(), ..Self::default() };
    }

    /// Notes what a run came to in which this was to give way, if it got stuck.
    pub fn note_tried(&mut self, step: Step, outcomes: &[Option<Outcome>]) {
        let stuck = outcomes.iter().flatten().filter(|outcome| outcome.stop == StopReason::Stuck);
        let coarsest = stuck.min_by_key(|outcome| outcome.mesh.faces.len());
        let left = coarsest.filter(|_| !self.kept.is_empty()).map(|outcome| faces_by_size(&outcome.mesh));
        self.tried.extend(left.map(|left| (step, left)));
    }

    /// What gives way in the first run from here.
    pub fn first_step(&self) -> Step {
        self.first
    }

    /// Whether a run from `start` may part before it comes to so many faces; if so, begins with that run, which ends there.
    pub fn may_part(&mut self, start: &Prepared, target: usize, options: &Options) -> bool {
        let most = target.saturating_mul(SHRUNK * AHEAD);
        let may_part = may_go_on(options) && target > 0 && start.faces.len() > most;
        if may_part {
            let came_to = start.faces.len();
            *self = Self { next: Some(most), target, came_to, phase: Phase::Parting, ..Self::default() };
        }
        may_part
    }

    /// Keeps where a run is between rounds, if that is far from where it was before and from what is asked for. Returns whether the
    /// run is to end.
    pub fn note(&mut self, run: &Run<'_>) -> ControlFlow<()> {
        let faces = run.host.face_count;
        if self.phase != Phase::Again {
            self.came_to = faces;
        }
        let is_far = faces >= self.target.saturating_mul(AHEAD);
        if self.next.is_some_and(|next| faces <= next) && is_far {
            self.next = Some(faces / SHRUNK);
            self.keep(run);
        }
        // A round may go past where runs would have parted.
        let is_over = !is_far || !self.kept.is_empty();
        if self.phase == Phase::Parting && is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Keeps where a run is.
    fn keep(&mut self, run: &Run<'_>) {
        let faces = run.host.face_count;
        // It may get stuck at once, with no fewer faces: of those that are far enough from there the last is wanted.
        while self.kept.get(1).is_some_and(|second| second.faces.len() >= AHEAD * faces) {
            self.kept.pop_front();
        }
        self.kept.push_back(Prepared::of_run(run));
    }

    /// Where the run is to be taken up for so many faces and what it came to, with at most so great an estimated error; nothing where
    /// that is from the start.
    pub fn ahead(&self, faces: usize, most_error: f64) -> Option<Prepared> {
        let least = self.came_to.max(faces).saturating_mul(AHEAD);
        let is_sound = |kept: &Prepared| f64::from(kept.earlier.deviation) <= kept.frame.length_to_rows(most_error);
        let is_taken = |kept: &&Prepared| !self.is_last && kept.faces.len() >= least && is_sound(kept);
        let last = self.kept.iter().rfind(is_taken);
        last.map(|kept| kept.copy().taken_up())
    }

    /// The last one that is far enough from `target`, and from where the run got stuck, without the small parts that are found, as one
    /// where a run parted; none where that is from the start, or where more yields than in a run that begins there.
    ///
    /// It begins with what gave way in the first run that got stuck but kept few enough faces of the other parts, or in the last of all.
    pub(crate) fn without(&mut self, target: usize, find: impl FnOnce() -> Small, device: &Device) -> Result<Self> {
        let is_far = |kept: &Prepared| kept.faces.len() >= AHEAD * self.came_to;
        self.kept.retain(|kept| is_far(kept) && kept.earlier.yields == Yields::Nothing && !kept.complex_yield);
        if self.kept.is_empty() {
            return Ok(Self::default());
        }
        let small = find();
        let is_enough = |kept: &&Prepared| kept.faces_without(&small) >= target.saturating_mul(AHEAD);
        let Some(last) = self.kept.iter().rfind(is_enough).filter(|_| small.parts > 0) else {
            return Ok(Self::default());
        };
        let mut start = last.copy();
        start.leave_out(&small, device)?;
        // Each part is still there, and the order of their sizes hardly changes.
        let kept = |left: &[usize]| left.iter().skip(small.parts).sum::<usize>();
        let may_come_near = |(_, left): &&(Step, Vec<usize>)| kept(left) as f64 <= SURELY * target as f64;
        let first = self.tried.iter().find(may_come_near).or(self.tried.last());
        let first = first.map_or(Step::default(), |&(step, _)| step);
        Ok(Self { kept: [start].into(), target, came_to: target, phase: Phase::Parting, first, ..Self::default() })
    }

    /// Where a run parted; nothing where it did not.
    pub fn parting(&self) -> Option<Prepared> {
        self.kept.back().map(|kept| kept.copy().taken_up())
    }
}

/// Whether a run may go on from a checkpoint.
fn may_go_on(options: &Options) -> bool {
    options.metric == Metric::Volume && options.fit == 0
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::super::Options;
    use super::super::carry::MOVED_FROM;
    use super::super::driver::{self, Job};
    use super::super::levels::Levels;
    use super::super::prepare::{begin, parts_dropped, prepare};
    use super::*;
    use crate::backend::Awake;
    use crate::kernel::rows::{Face, LOCKED};
    use crate::math::{DVec3, Vec2, Vec3};
    use crate::mesh::parts::Parts;
    use crate::mesh::{Materials, Mesh, Rings, shapes};
    use crate::simplify::Budget;

    /// A plane of 40 × 40 squares with a wavy height, whose texture is in charts of 5 × 5: seams meet at every corner of these.
    fn charts() -> Mesh {
        charts_of(40)
    }

    /// The same of `width` × `width` squares.
    fn charts_of(width: u32) -> Mesh {
        let side = 5;
        let mut mesh = shapes::plane(width, width);
        for p in &mut mesh.positions {
            p.z = 0.1 * ((9.0 * p.x).sin() + (7.0 * p.y).cos());
        }
        let chart = |f: usize| (f / 2 % width as usize / side, f / 2 / width as usize / side);
        let at = |(f, face): (usize, &[u32; 3])| {
            let (x, y) = chart(f);
            let shift = Vec2::new(100.0 * x as f32, 100.0 * y as f32);
            face.map(|v| Vec2::new((v % (width + 1)) as f32, (v / (width + 1)) as f32) + shift)
        };
        mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
        mesh
    }

    /// Enough of them for several patches, with normals and, in stripes, three materials.
    fn dressed() -> Mesh {
        let mut mesh = charts_of(100);
        mesh.normals = Some(mesh.positions.iter().map(|p| Vec3::new(p.z as f32, 0.2, 1.0).normalize()).collect());
        let of_face = (0..mesh.faces.len() as u32).map(|f| f / 2 % 100 / 20 % 3).collect();
        mesh.materials = Some(Materials { of_face, names: vec![String::new(); 3] });
        mesh
    }

    /// A run to so few faces from `start`, which seams hold; its outcome, unless it ended before.
    fn run(
        mesh: &Mesh,
        options: &Options,
        faces: usize,
        start: Prepared,
        checkpoints: &mut Checkpoints,
    ) -> Option<Outcome> {
        let (device, budgets) = (Device::cpu(1).expect("a device"), [Budget::faces(faces)]);
        let job = Job {
            mesh,
            options,
            budgets: &budgets,
            device: &device,
            clock: Instant::now(),
            awake: &Awake::new(),
            worst_deviation: f64::INFINITY,
        };
        driver::run(job, start, checkpoints, None).expect("room").pop().expect("one budget")
    }

    /// The checkpoints of a run to so few faces, and its outcome.
    fn checkpoints(mesh: &Mesh, options: &Options, faces: usize) -> (Checkpoints, Outcome) {
        let (start, mut found) = (prepare(mesh, options).expect("a valid mesh"), Checkpoints::default());
        found.begin(&start, Some(faces), true, options);
        let outcome = run(mesh, options, faces, start, &mut found).expect("an outcome");
        (found, outcome)
    }

    #[test]
    fn a_run_ends_where_others_part_from_it() {
        let (mesh, options) = (charts(), Options::default());
        for (asked, parts) in [(200, true), (600, true), (mesh.faces.len() / 3, false)] {
            let (start, mut found) = (prepare(&mesh, &options).expect("a valid mesh"), Checkpoints::default());
            assert_eq!(found.may_part(&start, asked, &options), parts);
            assert_eq!(run(&mesh, &options, asked, start, &mut found).is_none(), parts);
            let at = found.parting().map(|at| at.faces.len());
            let range = AHEAD * asked..=SHRUNK * AHEAD * asked;
            assert!(at.map_or(!parts, |at| range.contains(&at)), "{at:?} for {asked}");
        }
    }

    /// As one is that asks for no fewer faces than there are, in a chain with another that seams press.
    #[test]
    fn no_number_of_faces_is_too_great() {
        let (mesh, options, device) = (charts(), Options::default(), Device::cpu(1).expect("a device"));
        let start = prepare(&mesh, &options).expect("a valid mesh");
        let mut found = Checkpoints::default();
        for asked in [mesh.faces.len(), usize::MAX / 4 + 1, usize::MAX / 2 + 1, usize::MAX] {
            assert!(!found.may_part(&start, asked, &options) && found.ahead(asked, 1.0).is_none(), "{asked}");
        }
        for most in [usize::MAX / 4 + 1, usize::MAX] {
            let levels = super::super::run(&mesh, &options, &[most, 60].map(Budget::faces), &device, None);
            let counts: Vec<usize> = levels.expect("a valid mesh").iter().map(|level| level.mesh.faces.len()).collect();
            assert_eq!(counts, [mesh.faces.len(), 60], "{most}");
        }
    }

    #[test]
    fn a_run_is_kept_where_it_may_be_taken_up() {
        let (mesh, options) = (charts(), Options::default());
        let (kept, outcome) = checkpoints(&mesh, &options, 2);
        let stuck = outcome.mesh.faces.len();
        assert!(stuck > 100, "{stuck}");
        let counts: Vec<usize> = kept.kept.iter().map(|kept| kept.faces.len()).collect();
        assert!(counts.windows(2).all(|pair| SHRUNK * pair[1] <= pair[0]), "{counts:?}");
        // Of those that are far enough from the end the last alone is left, and it is the one that is taken.
        let far: Vec<usize> = counts.iter().copied().filter(|&count| count >= AHEAD * stuck).collect();
        let taken = kept.ahead(0, f64::INFINITY).expect("a checkpoint");
        assert_eq!((far.len(), taken.faces.len()), (1, far[0]), "{counts:?}, stuck with {stuck}");
        assert_eq!(taken.earlier.rounds.first().map(|round| round.faces), Some(mesh.faces.len() as u64));
        let early = Checkpoints { came_to: mesh.faces.len(), ..kept };
        assert!(early.ahead(0, f64::INFINITY).is_none());
        // Nearer to where it may end there is none, and none where the start of all is wanted.
        assert!(checkpoints(&mesh, &options, mesh.faces.len() / 3).0.kept.is_empty());
        for options in [Options { fit: 1, ..Options::default() }, Options { metric: Metric::Plane, ..options }] {
            assert!(checkpoints(&mesh, &options, 2).0.kept.is_empty());
        }
    }

    #[test]
    fn what_seams_held_is_free_again_and_nothing_else() {
        let mesh = charts();
        let options = Options { lock_border: true, ..Options::default() };
        let device = Device::cpu(1).expect("a device");
        let held = prepare(&mesh, &options).expect("a valid mesh");
        let levels = Levels::new(&[Budget::faces(2)], &mesh, held.frame).expect("a budget");
        let locked = |prepared: &Prepared| prepared.positions.iter().filter(|p| p.flags & LOCKED != 0).count();
        let (start, with_seams) = (begin(&mesh, &options).expect("a valid mesh"), locked(&held));
        let run = Run::new(&mesh, held, &options, &device, levels, Instant::now()).expect("room");
        let taken = Prepared::of_run(&run).taken_up();
        assert!(locked(&taken) < with_seams && locked(&taken) > 100);
        assert!(taken.positions == start.positions && taken.fans == start.fans);
        let wedges =
            |prepared: &Prepared| prepared.carried.wedges.as_ref().map(|wedges| wedges.connectivity().0.to_vec());
        assert_eq!(wedges(&taken), wedges(&start));
    }

    /// With seams that hold as before it is the same run: what its rounds told the next one is kept, too.
    #[test]
    fn a_run_that_is_taken_up_goes_on_as_it_would_have() {
        let options = Options::default();
        for mesh in [charts(), dressed()] {
            let (kept, outcome) = checkpoints(&mesh, &options, 2);
            for mut taken in kept.kept.iter().map(|kept| kept.copy().taken_up()) {
                taken.let_yield(&mesh, Yields::Nothing, &options);
                let other = run(&mesh, &options, 2, taken, &mut Checkpoints::default()).expect("an outcome");
                assert!(other.mesh == outcome.mesh && other.rounds == outcome.rounds);
                assert_eq!((other.blocked, other.error_estimate), (outcome.blocked, outcome.error_estimate));
            }
            assert!(kept.kept.len() > 1);
        }
    }

    /// However far the second comes: where the first was stuck it had taken all that no seam holds.
    #[test]
    fn a_third_run_takes_up_the_first_as_the_second_did() {
        let (mesh, options) = (charts(), Options::default());
        let (mut kept, _) = checkpoints(&mesh, &options, 2);
        let mut taken = kept.ahead(0, f64::INFINITY).expect("a checkpoint");
        let faces = taken.faces.len();
        taken.let_yield(&mesh, Yields::Seams, &options);
        kept.begin(&taken, Some(2), true, &options);
        let second = run(&mesh, &options, 2, taken, &mut kept).expect("an outcome");
        let is_later = |kept: &Prepared| (AHEAD * second.mesh.faces.len()..faces).contains(&kept.faces.len());
        assert!(kept.kept.iter().any(is_later), "{} faces", second.mesh.faces.len());
        assert_eq!(kept.ahead(0, f64::INFINITY).map(|taken| taken.faces.len()), Some(faces));
        // After the last one none is wanted; they stay where small parts may go.
        let taken = kept.ahead(0, f64::INFINITY).expect("a checkpoint");
        for (prune, stay) in [(None, true), (Some(0.0), false)] {
            kept.begin(&taken, Some(2), false, &Options { prune, ..options.clone() });
            assert_eq!((kept.ahead(0, f64::INFINITY).is_none(), kept.kept.is_empty()), (true, !stay));
        }
    }

    /// A mesh in charts, and beside it so many tetrahedra, each a chart of its own.
    fn dusty(mut mesh: Mesh, count: u32) -> Mesh {
        let grain = shapes::tetrahedron();
        for i in 0..count {
            let first = mesh.positions.len() as u32;
            let at = DVec3::new(f64::from(i % 20) * 2.0, f64::from(i / 20) * 2.0, 1.0);
            mesh.positions.extend(grain.positions.iter().map(|&p| at + p * 0.1));
            mesh.faces.extend(grain.faces.iter().map(|face| face.map(|v| v + first)));
            let texcoords = mesh.texcoords.get_or_insert_default();
            texcoords.extend(grain.faces.iter().map(|face| face.map(|v| Vec2::new(v as f32, -1.0 - i as f32))));
        }
        mesh
    }

    /// What is left of a checkpoint is what the run had of all else, and a run goes on from there.
    #[test]
    fn a_checkpoint_without_small_parts_has_all_of_the_others() {
        let (mesh, options, device) =
            (dusty(charts_of(100), 300), Options::default(), Device::cpu(1).expect("a device"));
        let of_dust = |input: u32| input as usize >= 101 * 101;
        let (mut kept, stuck) = checkpoints(&mesh, &options, 200);
        assert!(stuck.mesh.faces.len() >= 4 * 300);
        let small = Parts::of(&mesh, 0.0).small(0.05);
        assert_eq!((small.parts, small.vertices.iter().filter(|&&is_small| is_small).count()), (300, 1200));
        let whole = kept.kept.iter().rfind(|kept| kept.faces.len() >= AHEAD * stuck.mesh.faces.len());
        let whole = whole.expect("a checkpoint").copy();
        let found = kept.without(200, || small.clone(), &device).expect("room");
        let start = found.ahead(0, f64::INFINITY).expect("a checkpoint");

        let places = |prepared: &Prepared| {
            let corner =
                |&v: &u32| (prepared.carried.origin[v as usize], prepared.positions[v as usize].xyz().to_array());
            let is_left = |face: &&Face| !of_dust(prepared.carried.origin[face.a as usize] & !MOVED_FROM);
            let faces = prepared.faces.iter().filter(is_left);
            faces.map(|face| face.corners().each_ref().map(corner)).collect::<Vec<_>>()
        };
        let left = places(&whole);
        assert!(places(&start) == left);
        assert_eq!((start.faces.len(), whole.faces.len()), (left.len(), left.len() + 1200));
        assert!(start.carried.origin.iter().all(|origin| !of_dust(origin & !MOVED_FROM)));
        assert_eq!(start.rings, Rings::new(bytemuck::cast_slice(&start.faces), start.positions.len()));
        let wedges = start.carried.wedges.as_ref().expect("a texture");
        assert_eq!(wedges.connectivity().0.len(), start.faces.len());
        assert!(start.warnings.contains(&parts_dropped(300)));
        // What would surely get stuck is not tried again, but for the last.
        let step = |yields: Yields| Step { yields, ..Step::default() };
        let first = |tried: &[(Yields, usize)]| {
            let mut kept = Checkpoints { kept: [whole.copy()].into(), came_to: 2, ..Checkpoints::default() };
            // The parts that go had more faces than they have in the end.
            let left = |others: usize| [vec![9; 300], vec![others]].concat();
            kept.tried = tried.iter().map(|&(yields, others)| (step(yields), left(others))).collect();
            let found = kept.without(200, || small.clone(), &device).expect("room");
            assert!(!found.kept.is_empty());
            found.first_step()
        };
        let (nothing, corners, seams) = (Yields::Nothing, Yields::Corners, Yields::Seams);
        for (tried, expected) in [
            (&[][..], nothing),
            (&[(nothing, 250)], nothing),
            (&[(nothing, 251), (corners, 250), (seams, 100)], corners),
            (&[(nothing, 900), (seams, 700)], seams),
        ] {
            assert_eq!(first(tried), step(expected), "{tried:?}");
        }
        // Too near to what is asked for, and where nothing is small.
        let is_none = |kept: &mut Checkpoints, target: usize, small: &Small| {
            kept.without(target, || small.clone(), &device).expect("room").kept.is_empty()
        };
        assert!(is_none(&mut kept, whole.faces.len(), &small));
        assert!(is_none(&mut kept, 200, &Small { vertices: vec![false; mesh.positions.len()], parts: 0 }));
        // Where more seams yield, or where the run that got stuck was hardly farther than that, none is looked for.
        let mut yielding = Checkpoints { kept: [whole.copy()].into(), came_to: 2, ..Checkpoints::default() };
        assert!(!is_none(&mut yielding, 200, &small));
        yielding.kept[0].earlier.yields = Yields::Corners;
        let mut near =
            Checkpoints { kept: [whole.copy()].into(), came_to: whole.faces.len(), ..Checkpoints::default() };
        for kept in [&mut yielding, &mut near] {
            let found = kept.without(200, || unreachable!("no checkpoint will do"), &device).expect("room");
            assert!(found.kept.is_empty() && kept.kept.is_empty());
        }
        let outcome = super::super::run(&mesh, &options, &[Budget::faces(200)], &device, None);
        let outcome = outcome.expect("a valid mesh").pop().expect("one budget");
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 200));
        assert!(outcome.warnings.iter().any(|warning| warning.contains("across go")), "{:?}", outcome.warnings);
        assert!(outcome.rounds.iter().any(|round| round.faces == start.faces.len() as u64));
    }

    /// A run that seams keep from what is asked goes on from where it was, and comes to it.
    #[test]
    fn another_run_goes_on_from_there() {
        let (mesh, options, device) = (charts(), Options::default(), Device::cpu(1).expect("a device"));
        let (kept, stuck) = checkpoints(&mesh, &options, 2);
        let stuck = stuck.mesh.faces.len();
        let asked = stuck - 20;
        let outcomes = super::super::run(&mesh, &options, &[Budget::faces(asked)], &device, None);
        let outcome = outcomes.expect("a valid mesh").pop().expect("one budget");
        assert_eq!((outcome.stop, outcome.warnings.len()), (StopReason::FacesReached, 1), "{:?}", outcome.warnings);
        let counts: Vec<u64> = outcome.rounds.iter().map(|round| round.faces).collect();
        let taken = kept.ahead(0, f64::INFINITY).expect("a checkpoint");
        assert!(counts.contains(&(taken.faces.len() as u64)) && counts.is_sorted_by(|a, b| a >= b), "{counts:?}");
        assert_eq!(counts[0], mesh.faces.len() as u64);
    }
}
