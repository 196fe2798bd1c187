//! Holes that close where they would keep a run from its number of faces: what a scanner did not see.
//!
//! A hole keeps five faces at least, however small it is. Many of them are more than was asked for, or most of that: the run gets
//! stuck, and on its way has crushed whatever lies between them. Those that its faces are too large to show close first.

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::error::Result;
use crate::kernel::split::CHUNK;
use crate::math::DVec3;
use crate::mesh::holes::{find, of, with_faces};
use crate::mesh::orient::{TURNED, input_corner};
use crate::mesh::{Mesh, Rings};
use crate::simplify::{Budget, OnProgress, Outcome};

use super::driver::Job;
use super::prepare::{Prepared, begin};
use super::pressure::has_error;
use super::{Options, Placement, small_parts};

/// Faces that a hole keeps at least, with the three sides that are left to it: of a surface with V vertices, of which its b holes
/// have 3 b, by Euler's formula 2 V − 3 b + 2 b − 4.
const KEPT_EACH: usize = 5;
/// The share of the faces asked for that holes may keep before any closes: with a third or a quarter what is asked for comes out 0.97
/// to 1.03 times as far off (RMS), and more holes are lost.
const MOST_KEPT: f64 = 0.5;
/// The share that those which stay may keep then.
const LEFT: f64 = 0.1;
/// How large they may be at most, of the sides of as many equal triangles as are asked for. With half of these or 1.5 times as many faces
/// as holes keep come out 1.2 to 1.5 times as far off (RMS), with as much 1.0 to 1.1 times.
const MOST: f64 = 0.75;
/// And of the diagonal, as parts that go: what is larger was meant.
const MOST_OF_MESH: f64 = 0.05;
/// The least [flatness](crate::mesh::holes::Hole::flatness) of a hole that nobody saw: the ends of a tube are none. Closed, its length is held by no more than
/// their area.
const LEAST_FLATNESS: f64 = 0.5;
/// What is less flat is the outline of a sheet, whose other side would close it.
const OUTLINE: f64 = -0.5;
/// How far what closes a hole comes to lie from its border at most, of its size.
const REACH: f64 = 0.5;
/// A limit is past the hole that it takes in by this.
const PAST: f64 = 1.0 + 1e-6;
/// Side and area of an equilateral triangle: side² = this · area.
const SIDE_SQ: f64 = 2.309_401_076_758_503;

/// Runs a job, without the holes that are to close, or that would keep levels from their numbers of faces.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let faces = job.mesh.faces.len();
    let targets: Vec<usize> = job.budgets.iter().map(|budget| budget.target_faces(faces)).collect::<Result<_>>()?;
    let start = begin(job.mesh, job.options)?;
    let Some(Closed { mesh, levels, count, length }) = Closed::of(&start, job, &targets) else {
        return small_parts::run(job, Some(start), progress);
    };
    let (mut budgets, mut others) = (Vec::new(), Vec::new());
    for (level, budget) in job.budgets.iter().enumerate() {
        match levels.contains(&level) {
            // A share is of the faces that were there.
            true if budget.counts_faces() => {
                budgets.push(Budget { faces: Some(targets[level]), keep: None, ..*budget });
            }
            true => budgets.push(*budget),
            false => others.push(*budget),
        }
    }
    let start = (!others.is_empty()).then_some(start);
    let mut closed = small_parts::run(Job { mesh: &mesh, budgets: &budgets, ..job }, None, progress.as_deref_mut())?;
    for outcome in &mut closed {
        outcome.error_estimate = outcome.error_estimate.max(REACH * length);
        outcome.warnings.push(format!(
            "{count} holes up to {:.2}% of the diagonal across close{}",
            length / job.mesh.diagonal() * 100.0,
            if job.options.close_holes.is_none() {
                ": they would keep too many of the faces that were asked for"
            } else {
                ""
            }
        ));
    }
    let mut open = match start {
        Some(start) => small_parts::run(Job { budgets: &others, ..job }, Some(start), progress)?,
        None => Vec::new(),
    }
    .into_iter();
    let mut closed = closed.into_iter();
    let made = (0..job.budgets.len()).map(|level| if levels.contains(&level) { closed.next() } else { open.next() });
    Ok(made.flatten().collect())
}

/// Whether holes may close that nobody named: none where vertices stay or are those of other levels, a log tells of all, or what lies
/// side by side is a border each.
fn may_close(options: &Options) -> bool {
    let is_held = options.locked.is_some() || options.lock.is_some() || options.lock_border;
    options.weld.is_some() && !(is_held || options.placement == Placement::Endpoint || options.log || options.joins())
}

/// A mesh whose holes are closed, as far as they are small.
struct Closed {
    mesh: Mesh,
    /// The levels that are made of it.
    levels: Vec<usize>,
    /// How many holes, and how large the largest, in model units.
    count: usize,
    length: f64,
}

impl Closed {
    /// For a job that starts so, of such numbers of faces; nothing where no hole closes.
    fn of(start: &Prepared, job: Job<'_>, targets: &[usize]) -> Option<Self> {
        let given = job.options.close_holes;
        let may_press = |budget: &Budget| budget.counts_faces() && !has_error(budget) && may_close(job.options);
        let presses = |level: &usize, holes: usize| {
            let keep = (KEPT_EACH * holes) as f64;
            // As few as can be is as few as there can be with holes.
            may_press(&job.budgets[*level]) && targets[*level] > 0 && keep > MOST_KEPT * targets[*level] as f64
        };
        // Without a look at them: none has fewer than three vertices.
        let most = start.border_vertices / 3;
        let mut levels: Vec<usize> = (0..targets.len()).collect();
        match given {
            Some(limit) => levels.retain(|_| limit > 0.0 && most > 0),
            None => levels.retain(|level| presses(level, most)),
        }
        let target = *levels.iter().map(|&level| &targets[level]).min()?;

        let faces: &[[u32; 3]] = bytemuck::cast_slice(&start.faces);
        let at = |v: u32| start.positions[v as usize].xyz().as_dvec3();
        let diagonal = start.frame.length_to_rows(job.mesh.diagonal());
        let largest = match given {
            Some(limit) => limit * diagonal,
            None => (MOST * (SIDE_SQ * area(faces, at) / target as f64).sqrt()).min(MOST_OF_MESH * diagonal),
        };
        let mut holes = find(faces, &start.rings, &start.fans, &start.carried.origin, at);
        let least_flatness = if given.is_some() { OUTLINE } else { LEAST_FLATNESS };
        holes.retain(|hole| hole.flatness(faces, at) > least_flatness);
        if given.is_none() {
            levels.retain(|level| presses(level, holes.len()));
        }
        let target = *levels.iter().map(|&level| &targets[level]).min()?;
        holes.sort_by(|a, b| a.size.total_cmp(&b.size));
        let stay = if given.is_some() { 0 } else { (LEFT * target as f64) as usize / KEPT_EACH };
        let go = holes.len().saturating_sub(stay);
        // Those as large as the last that goes go as well.
        let last = holes[..go].iter().rfind(|hole| hole.size <= largest)?.size * PAST;
        let mut closed = Self { mesh: Mesh::default(), levels, count: 0, length: 0.0 };
        let placed: Vec<[u32; 3]> = faces.iter().map(|face| face.map(|v| start.carried.origin[v as usize])).collect();
        let rings = Rings::new(&placed, job.mesh.positions.len());
        let at_corner = |corner: u32| at(faces.as_flattened()[corner as usize]);
        let (mut taken, mut added) = (FxHashSet::default(), Vec::new());
        for hole in holes.iter().take_while(|hole| hole.size <= last) {
            // Wound as the faces beside it are in the input, if these agree.
            let is_turned = |side: &u32| start.carried.face_origin[of(*side).0] & TURNED != 0;
            let turned = hole.sides.iter().filter(|&side| is_turned(side)).count();
            if turned > 0 && turned < hole.sides.len() {
                continue;
            }
            let patch = hole.close(&placed, &rings, &mut taken, at_corner);
            if !patch.is_empty() {
                (closed.count, closed.length) = (closed.count + 1, hole.size / start.frame.length_to_rows(1.0));
                added.extend(patch.into_iter().map(|corners| {
                    let [a, b, c] = corners.map(|corner| of_input(start, corner));
                    if turned > 0 { [a, c, b] } else { [a, b, c] }
                }));
            }
        }
        closed.mesh = with_faces(job.mesh, &added);
        (closed.count > 0).then_some(closed)
    }
}

/// The corner of the input's faces that one of the start's is.
fn of_input(start: &Prepared, corner: u32) -> u32 {
    let (face, corner) = of(corner);
    let (face, corner) = input_corner(start.carried.face_origin[face], corner);
    (3 * face + corner) as u32
}

/// The area of faces, in the same order whatever the threads.
fn area(faces: &[[u32; 3]], at: impl Fn(u32) -> DVec3 + Sync) -> f64 {
    let doubled = |face: &[u32; 3]| {
        let [a, b, c] = face.map(&at);
        (b - a).cross(c - a).length()
    };
    let sums: Vec<f64> = faces.par_chunks(CHUNK).map(|chunk| chunk.iter().map(doubled).sum()).collect();
    sums.iter().sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Device;
    use crate::mesh::shapes;
    use crate::mesh::topology::topology;
    use crate::simplify::StopReason;

    /// A sphere of 5,120 faces, less every so many.
    fn holed(every: usize) -> Mesh {
        let mut mesh = shapes::icosphere(4);
        let mut number = 0;
        mesh.faces.retain(|_| {
            number += 1;
            number % every != 0
        });
        mesh
    }

    fn to(mesh: &Mesh, budgets: &[Budget], options: &Options) -> Vec<Outcome> {
        let device = Device::cpu(1).expect("a device");
        super::super::run(mesh, options, budgets, &device, None).expect("a valid mesh")
    }

    fn told(outcome: &Outcome) -> Option<&String> {
        outcome.warnings.iter().find(|warning| warning.contains(" close"))
    }

    fn loops(outcome: &Outcome) -> usize {
        topology(&outcome.mesh).border_loops
    }

    #[test]
    fn holes_close_that_would_keep_too_many_faces() {
        let (mesh, options) = (holed(40), Options::default());
        let open = Options { close_holes: Some(0.0), ..options.clone() };
        let few = [Budget::keep(0.04)];
        let kept = to(&mesh, &few, &open).pop().expect("one budget");
        assert_eq!((kept.stop, loops(&kept), told(&kept)), (StopReason::Stuck, 128, None));
        let outcome = to(&mesh, &few, &options).pop().expect("one budget");
        outcome.mesh.check().expect("a valid mesh");
        // Of the faces that were there, not of those with what closes the holes.
        assert!(outcome.stop == StopReason::FacesReached && (199..=200).contains(&outcome.mesh.faces.len()));
        assert!(loops(&outcome) <= 4 && outcome.error_estimate < kept.error_estimate);
        let warning = told(&outcome).expect("a warning");
        assert!(warning.contains(" holes up to ") && warning.contains("too many of the faces"), "{warning}");
        // Half of twice as many is more than they keep.
        let enough = to(&mesh, &[Budget::faces(1300)], &options).pop().expect("one budget");
        assert_eq!((enough.stop, loops(&enough), told(&enough)), (StopReason::FacesReached, 128, None));
    }

    #[test]
    fn levels_that_have_room_for_holes_keep_them() {
        let budgets = [Budget::faces(2000), Budget::faces(200), Budget::faces(1500), Budget::faces(100)];
        let made = to(&holed(40), &budgets, &Options::default());
        for (outcome, budget) in made.iter().zip(&budgets) {
            let (asked, has_room) = (budget.faces.unwrap_or_default(), budget.faces > Some(1280));
            assert!((asked - 1..=asked).contains(&outcome.mesh.faces.len()), "{} of {asked}", outcome.mesh.faces.len());
            assert_eq!((loops(outcome) == 128, told(outcome).is_none()), (has_room, has_room), "{asked}");
        }
    }

    #[test]
    fn what_is_named_closes_and_nothing_else() {
        let mesh = holed(40);
        let named = |limit: f64, budget: Budget| {
            let options = Options { close_holes: Some(limit), ..Options::default() };
            to(&mesh, &[budget], &options).pop().expect("one budget")
        };
        for budget in [Budget::faces(3000), Budget::error(0.001)] {
            let closed = named(0.1, budget);
            assert_eq!(loops(&closed), 0);
            let warning = told(&closed).expect("a warning");
            assert!(warning.starts_with("128 holes up to ") && warning.ends_with("across close"), "{warning}");
            assert!(closed.error_estimate > 0.005, "half of a side: {}", closed.error_estimate);
            assert_eq!((loops(&named(0.001, budget)), told(&named(0.0, budget))), (128, None));
        }
        // A sheet has an outline, whatever its size, and a tube ends at both sides.
        let options = Options { close_holes: Some(1.0), ..Options::default() };
        let sheet = to(&shapes::plane(12, 12), &[Budget::faces(100)], &options).pop().expect("one budget");
        assert_eq!((loops(&sheet), told(&sheet)), (1, None));
    }

    #[test]
    fn none_closes_where_all_is_to_stay() {
        let mesh = holed(40);
        let bounded = Budget { error: Some(0.5), ..Budget::faces(200) };
        let locked = Some(vec![false; mesh.positions.len()].into());
        for (options, budget) in [
            (Options { placement: Placement::Endpoint, ..Options::default() }, Budget::faces(200)),
            (Options { locked, ..Options::default() }, Budget::faces(200)),
            (Options { lock_border: true, ..Options::default() }, Budget::faces(200)),
            (Options { weld: None, ..Options::default() }, Budget::faces(200)),
            (Options { log: true, ..Options::default() }, Budget::faces(200)),
            (Options::default(), bounded),
            (Options::default(), Budget::faces(0)),
        ] {
            let outcome = to(&mesh, &[budget], &options).pop().expect("one budget");
            assert_eq!((loops(&outcome), told(&outcome)), (128, None), "{options:?}");
        }
    }
}
