//! Holes that close where they would keep a run from its number of faces: what a scanner did not see.
//!
//! A hole keeps five faces at least, however small it is. Many of them are more than was asked for, or most of that: the run gets
//! stuck, and on its way has crushed whatever lies between them. Those that its faces are too large to show close first.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use crate::error::Result;
use crate::kernel::rows::BORDER;
use crate::kernel::split::CHUNK;
use crate::math::DVec3;
use crate::mesh::holes::{self, Hole, face_of, with_faces};
use crate::mesh::orient::{TURNED, input_corner};
use crate::mesh::{Mesh, Rings};
use crate::simplify::{Budget, OnProgress, Outcome, Progress};

use super::driver::Job;
use super::prepare::{Prepared, begin};
use super::pressure::has_error;
use super::small_parts::{self, PAST};

/// Faces that a hole keeps at least, with the three sides that are left to it: of a surface with V vertices, of which its b holes
/// have 3 b, by Euler's formula 2 V − 3 b + 2 b − 4.
const KEPT_EACH: usize = 5;
/// The share of the faces asked for that holes may keep before any closes: with a third or a quarter what is asked for comes out 0.97
/// to 1.03 times as far off (RMS), and more holes are lost.
const MOST_KEPT: f64 = 0.5;
/// The share that those which stay may keep then. With a quarter a scan with 2,500 holes is up to 1.07 times as far off.
const LEFT: f64 = 0.1;
/// How large they may be at most, of the sides of as many equal triangles as are asked for. Two made-up scans with holes come out 1.1
/// to 1.4 times as far off (RMS) with half of that, and 1.0 to 1.1 times with the whole side where most of their holes stay.
const MOST: f64 = 0.75;
/// The least [flatness](Hole::flatness) of a hole that nobody saw: the ends of a tube are none. Closed, its length is held by no more than
/// their area: a truck of such parts was 45e-4 diagonals off (RMS) instead of 20e-4.
const LEAST_FLATNESS: f64 = 0.5;
/// What is less flat is the outline of a sheet, −1 where that is even, whose other side would close it.
const OUTLINE: f64 = -0.5;
/// How far what closes a hole comes to lie from its border at most, of its size: all of it is within the border's box.
const REACH: f64 = 0.5;
/// Vertices side by side that are counted together.
const BLOCK: usize = 256;
/// Side and area of an equilateral triangle: side² = this · area.
const SIDE_SQ: f64 = 2.309_401_076_758_503;

/// Runs a job, without the holes that are to close, or that would keep levels from their numbers of faces.
pub fn run(job: Job<'_>, mut progress: Option<&mut OnProgress<'_>>) -> Result<Vec<Outcome>> {
    let faces_in = job.mesh.faces.len();
    let targets: Vec<usize> = job.budgets.iter().map(|budget| budget.target_faces(faces_in)).collect::<Result<_>>()?;
    let mut start = begin(job.mesh, job.options)?;
    let (groups, stay) = find(&start, job, &targets);
    if groups.is_empty() {
        start.warnings.extend((stay > 0).then(|| told_of_open(stay)));
        return small_parts::run(job, Some(start), progress);
    }
    // Of all runs as of one: it tells of the faces that were there, and who ends it ends those that follow.
    let mut is_over = false;
    let mut report = |now: Progress| {
        let report = progress.as_deref_mut().filter(|_| !is_over);
        is_over |= report.is_some_and(|report| report(Progress { faces_in, ..now }).is_break());
        if is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let mut made: Vec<Option<Outcome>> = vec![None; targets.len()];
    let is_closed = |level: &usize| groups.iter().any(|group| group.levels.contains(level));
    let open: Vec<usize> = (0..targets.len()).filter(|level| !is_closed(level)).collect();
    if open.is_empty() {
        drop(start);
    } else {
        let budgets: Vec<Budget> = open.iter().map(|&level| job.budgets[level]).collect();
        let outcomes = small_parts::run(Job { budgets: &budgets, ..job }, Some(start), Some(&mut report))?;
        open.into_iter().zip(outcomes).for_each(|(level, outcome)| made[level] = Some(outcome));
    }
    for Closed { mesh, levels, count, length, diagonal } in groups {
        // A share is of the faces that were there.
        let budget = |&level: &usize| match job.budgets[level] {
            budget if budget.counts_faces() => Budget { faces: Some(targets[level]), keep: None, ..budget },
            budget => budget,
        };
        let budgets: Vec<Budget> = levels.iter().map(budget).collect();
        let outcomes = small_parts::run(Job { mesh: &mesh, budgets: &budgets, ..job }, None, Some(&mut report))?;
        for (level, mut outcome) in levels.into_iter().zip(outcomes) {
            outcome.faces_in = faces_in;
            outcome.error_estimate = outcome.error_estimate.max(REACH * length);
            let share = length / diagonal * 100.0;
            let why = match job.options.close_holes {
                Some(_) => "",
                None => ": they would keep too many of the faces that were asked for",
            };
            let told = format!("holes closed: {count}, up to {share:.2}% of the diagonal across{why}");
            outcome.warnings.push(told);
            outcome.warnings.extend((stay > 0).then(|| told_of_open(stay)));
            made[level] = Some(outcome);
        }
    }
    Ok(made.into_iter().flatten().collect())
}

/// What the user is told where so many holes that were to close do not.
fn told_of_open(count: usize) -> String {
    format!(
        "holes left open: {count}, of more than 64 sides, or among faces that disagree in winding, material or texture"
    )
}

/// A mesh whose holes are closed, as far as they are small, and the levels that are made of it.
struct Closed {
    mesh: Mesh,
    levels: Vec<usize>,
    /// How many holes, and how large the largest, in model units.
    count: usize,
    length: f64,
    /// Of the start, in model units.
    diagonal: f64,
}

/// What closes for levels with so many faces at a job's start, and how many of the holes that are named stay.
fn find(start: &Prepared, job: Job<'_>, targets: &[usize]) -> (Vec<Closed>, usize) {
    let presses = |level: usize, holes: usize| {
        let budget = &job.budgets[level];
        let may_press = job.options.may_lose_parts() && budget.counts_faces() && !has_error(budget);
        // Who asks for none wants as few as there can be with all holes.
        may_press && targets[level] > 0 && (KEPT_EACH * holes) as f64 > MOST_KEPT * targets[level] as f64
    };
    let press = |holes: usize| (0..targets.len()).any(|level| presses(level, holes));
    let (least_flatness, is_asked) = match job.options.close_holes {
        Some(limit) => (OUTLINE, limit > 0.0 && start.border_vertices > 0),
        None => (LEAST_FLATNESS, press(expected(start))),
    };
    if !is_asked {
        return (Vec::new(), 0);
    }
    let holes = Holes::of(start, job, least_flatness);
    let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    if let Some(limit) = job.options.close_holes {
        groups.insert(holes.up_to(limit * holes.diagonal), (0..targets.len()).collect());
    } else if press(holes.all.len()) {
        let area = area(start);
        for level in (0..targets.len()).filter(|&level| presses(level, holes.all.len())) {
            groups.entry(holes.pressing(targets[level], area)).or_default().push(level);
        }
    }
    groups.remove(&0);
    let groups = holes.close(groups, start, job.mesh);
    let stay = job.options.close_holes.map_or(0, |limit| {
        let named = holes.all.partition_point(|&size| size <= limit * holes.diagonal);
        named - groups.iter().map(|group| group.count).max().unwrap_or(0)
    });
    (groups, stay)
}

/// The holes of a start, in its rows.
struct Holes {
    /// Those that can close, the smallest first.
    found: Vec<Hole>,
    /// The sizes of these and of others.
    all: Vec<f64>,
    /// Of the start.
    diagonal: f64,
}

impl Holes {
    /// Those that are flatter than this.
    fn of(start: &Prepared, job: Job<'_>, least_flatness: f64) -> Self {
        let (faces, at) = (faces_of(start), |v: u32| place_of(start, v));
        let of_box = |(low, high): (DVec3, DVec3), v: u32| (low.min(at(v)), high.max(at(v)));
        let vertices = 0..start.positions.len() as u32;
        let (low, high) = vertices.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), of_box);
        let mut found = holes::find(faces, &start.rings, &start.fans, &start.carried.origin, at);
        found.retain(|hole| hole.flatness(faces, at) > least_flatness);
        found.sort_by(|a, b| a.size.total_cmp(&b.size));
        let all = found.iter().map(|hole| hole.size).collect();
        found.retain(|hole| hole.has_few_sides() && is_within_one_piece(hole, start, job));
        Self { found, all, diagonal: (high - low).length() }
    }

    /// How many can close that are no larger.
    fn up_to(&self, size: f64) -> usize {
        self.found.partition_point(|hole| hole.size <= size)
    }

    /// How many close for so many faces, of such an area, on which they press; none where the others keep more.
    fn pressing(&self, target: usize, area: f64) -> usize {
        let side = (SIDE_SQ * area / target as f64).sqrt();
        let stay = (LEFT * target as f64) as usize / KEPT_EACH;
        let small = self.up_to((MOST * side).min(small_parts::MOST * self.diagonal));
        let most = small.min(self.all.len().saturating_sub(stay));
        // Those as large as the last that goes go as well.
        let count = self.found[..most].last().map_or(0, |last| self.up_to(last.size * PAST));
        if KEPT_EACH * (self.all.len() - count) <= target { count } else { 0 }
    }

    /// Closes so many for each group of levels.
    fn close(&self, groups: BTreeMap<usize, Vec<usize>>, start: &Prepared, mesh: &Mesh) -> Vec<Closed> {
        if groups.is_empty() {
            return Vec::new();
        }
        let faces = faces_of(start);
        let placed: Vec<[u32; 3]> = faces.iter().map(|face| face.map(|v| start.carried.origin[v as usize])).collect();
        let rings = Rings::new(&placed, mesh.positions.len());
        let at_corner = |corner: u32| place_of(start, faces.as_flattened()[corner as usize]);
        let of_rows = 1.0 / start.frame.length_to_rows(1.0);
        let close = |(count, levels): (usize, Vec<usize>)| {
            let (mut taken, mut added, mut closed, mut largest) = (FxHashSet::default(), Vec::new(), 0, 0.0);
            for hole in &self.found[..count] {
                let patch = hole.close(&placed, &rings, &mut taken, at_corner);
                if !patch.is_empty() {
                    (closed, largest) = (closed + 1, hole.size);
                    // Wound as the faces beside it are in the input.
                    let is_turned = is_turned(start, hole.sides[0]);
                    added.extend(patch.into_iter().map(|corners| {
                        let [a, b, c] = corners.map(|corner| of_input(start, corner));
                        if is_turned { [a, c, b] } else { [a, b, c] }
                    }));
                }
            }
            let (length, diagonal) = (largest * of_rows, self.diagonal * of_rows);
            (closed > 0).then(|| Closed { mesh: with_faces(mesh, &added), levels, count: closed, length, diagonal })
        };
        groups.into_iter().filter_map(close).collect()
    }
}

fn faces_of(start: &Prepared) -> &[[u32; 3]] {
    bytemuck::cast_slice(&start.faces)
}

fn place_of(start: &Prepared, vertex: u32) -> DVec3 {
    start.positions[vertex as usize].xyz().as_dvec3()
}

/// Twice as many holes as there seem to be, without a look at any: where vertices off the border have six faces each, those around a
/// hole have three, and six more together, those along an outline six fewer, and those at the end of a tube neither (Gauss and Bonnet).
/// Many small sheets, as of grass, are told so in no time. Vertices stand by where they are, so that what is elsewhere does not count
/// against it.
fn expected(start: &Prepared) -> usize {
    let of = |first: usize| {
        let rows = first..(first + BLOCK).min(start.positions.len());
        let on_border = rows.filter(|&vertex| start.positions[vertex].flags & BORDER != 0);
        on_border.map(|vertex| start.rings.ring(vertex as u32).len() as isize - 3).sum::<isize>().max(0) as usize
    };
    (0..start.positions.len()).step_by(BLOCK).map(of).sum::<usize>() / 3
}

/// Whether all faces at a hole are wound alike, and of one material and one piece of a texture, as far as these are kept.
fn is_within_one_piece(hole: &Hole, start: &Prepared, Job { mesh, options, .. }: Job<'_>) -> bool {
    let dropped = &options.attributes.dropped;
    let texcoords = mesh.texcoords.as_ref().filter(|_| !dropped.texcoords);
    let materials = mesh.materials.as_ref().filter(|_| !dropped.materials);
    let place = |corner: u32| texcoords.map(|rows| rows.as_flattened()[corner as usize].to_array().map(f32::to_bits));
    let material = |corner: u32| materials.map(|materials| materials.of_face[face_of(corner).0]);
    let after = hole.sides.iter().cycle().skip(1);
    hole.sides.iter().zip(after).all(|(&side, &after)| {
        let [from, to, next] = [side, holes::next(side), after].map(|corner| of_input(start, corner));
        is_turned(start, side) == is_turned(start, after)
            && material(from) == material(next)
            && place(to) == place(next)
    })
}

/// Whether the face of a corner is wound the other way in the input.
fn is_turned(start: &Prepared, corner: u32) -> bool {
    start.carried.face_origin[face_of(corner).0] & TURNED != 0
}

/// The corner of the input's faces that one of the start's is.
fn of_input(start: &Prepared, corner: u32) -> u32 {
    let (face, corner) = face_of(corner);
    let (face, corner) = input_corner(start.carried.face_origin[face], corner);
    (3 * face + corner) as u32
}

/// The area of a start in its rows, summed in the same order whatever the threads.
fn area(start: &Prepared) -> f64 {
    let doubled = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| place_of(start, v));
        (b - a).cross(c - a).length()
    };
    let sums: Vec<f64> = faces_of(start).par_chunks(CHUNK).map(|chunk| chunk.iter().map(doubled).sum()).collect();
    sums.iter().sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::super::{Lock, Options, Placement};
    use super::*;
    use crate::backend::Device;
    use crate::math::Vec2;
    use crate::mesh::shapes;
    use crate::mesh::topology::topology;
    use crate::simplify::StopReason;

    /// A sphere of 5,120 faces, less every so many.
    fn holed(every: usize) -> Mesh {
        less_every(shapes::icosphere(4), every)
    }

    fn less_every(mut mesh: Mesh, every: usize) -> Mesh {
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
        outcome.warnings.iter().find(|warning| warning.starts_with("holes closed"))
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
        assert_eq!(outcome.faces_in, mesh.faces.len());
        assert!(outcome.stop == StopReason::FacesReached && (199..=200).contains(&outcome.mesh.faces.len()));
        assert!(loops(&outcome) <= 4 && outcome.error_estimate < kept.error_estimate);
        let warning = told(&outcome).expect("a warning");
        assert!(warning.contains(", up to ") && warning.contains("too many of the faces"), "{warning}");
        // Half of twice as many is more than they keep.
        let enough = to(&mesh, &[Budget::faces(1300)], &options).pop().expect("one budget");
        assert_eq!((enough.stop, loops(&enough), told(&enough)), (StopReason::FacesReached, 128, None));
    }

    #[test]
    fn sheets_and_tubes_are_told_from_holes_by_their_rings() {
        let of = |mesh: &Mesh| expected(&begin(mesh, &Options::default()).expect("a valid mesh"));
        let mut tube = shapes::tube(24);
        assert!(topology(&tube).border_loops == 2 && of(&tube) == 0);
        let first = tube.positions.len() as u32;
        let sheet = shapes::plane(3, 8);
        tube.positions.extend(sheet.positions.iter().map(|&p| p + DVec3::X * 5.0));
        tube.faces.extend(sheet.faces.iter().map(|face| face.map(|v| v + first)));
        assert_eq!((of(&sheet), of(&tube)), (0, 0));
        // Twice 128 and 32, whatever there is beside.
        let mut with_sheet = holed(40);
        let first = with_sheet.positions.len() as u32;
        with_sheet.positions.extend(sheet.positions.iter().map(|&p| p + DVec3::X * 5.0));
        with_sheet.faces.extend(sheet.faces.iter().map(|face| face.map(|v| v + first)));
        let found = [holed(40), holed(160), with_sheet].map(|mesh| of(&mesh));
        assert!(
            (256..260).contains(&found[0]) && (64..70).contains(&found[1]) && (252..260).contains(&found[2]),
            "{found:?}"
        );
    }

    #[test]
    fn what_is_large_stays() {
        // Of a twelfth of the diagonal.
        let mesh = less_every(shapes::icosphere(2), 8);
        let open = Options { close_holes: Some(0.0), ..Options::default() };
        let [outcome, kept] = [Options::default(), open].map(|options| to(&mesh, &[Budget::faces(60)], &options));
        assert!(outcome[0].mesh == kept[0].mesh && told(&outcome[0]).is_none());
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
            assert!(warning.starts_with("holes closed: 128, up to ") && warning.ends_with("across"), "{warning}");
            assert!(closed.error_estimate > 0.005, "half of a side: {}", closed.error_estimate);
            assert_eq!((loops(&named(0.001, budget)), told(&named(0.0, budget))), (128, None));
        }
        // A sheet has an outline, whatever its size.
        let options = Options { close_holes: Some(1.0), ..Options::default() };
        let sheet = to(&shapes::plane(12, 12), &[Budget::faces(100)], &options).pop().expect("one budget");
        assert_eq!((loops(&sheet), told(&sheet)), (1, None));
    }

    /// As far as is asked for alone, whatever other levels there are.
    #[test]
    fn a_level_loses_no_holes_for_a_coarser_one() {
        let mesh = holed(40);
        let alone = to(&mesh, &[Budget::faces(1200)], &Options::default()).pop().expect("one budget");
        let made = to(&mesh, &[Budget::faces(1200), Budget::faces(20)], &Options::default());
        assert!(loops(&alone) > 4 && loops(&made[0]) == loops(&alone) && loops(&made[1]) == 0, "{}", loops(&alone));
        assert_eq!(made[0].error_estimate.to_bits(), alone.error_estimate.to_bits());
    }

    #[test]
    fn who_cancels_one_run_cancels_all() {
        let (mesh, device) = (holed(40), Device::cpu(1).expect("a device"));
        let budgets = [Budget::faces(2000), Budget::faces(200)];
        let mut calls = 0;
        let mut cancel = |now: Progress| {
            calls += 1;
            assert_eq!(now.faces_in, mesh.faces.len());
            ControlFlow::Break(())
        };
        let made = super::super::run(&mesh, &Options::default(), &budgets, &device, Some(&mut cancel));
        let stops: Vec<StopReason> = made.expect("a valid mesh").into_iter().map(|outcome| outcome.stop).collect();
        assert_eq!((stops, calls), (vec![StopReason::Cancelled; 2], 1));
    }

    /// A third of the faces turned over: no edge disagrees that did not before, and what lies between both stays.
    #[test]
    fn new_faces_are_wound_as_those_beside_them() {
        let mut mesh = holed(40);
        let is_low = |face: &[u32; 3]| face.iter().map(|&v| mesh.positions[v as usize].z).sum::<f64>() < -0.8;
        let low: Vec<bool> = mesh.faces.iter().map(is_low).collect();
        mesh.faces.iter_mut().zip(&low).filter(|(_, low)| **low).for_each(|(face, _)| face.swap(1, 2));
        let turned = low.iter().filter(|&&low| low).count();
        assert!(mesh.faces.len() / 5 < turned && turned < mesh.faces.len() / 2, "{turned}");
        let options = Options { close_holes: Some(0.1), ..Options::default() };
        let all = to(&mesh, &[Budget::faces(9999)], &options).pop().expect("one budget");
        let (was, is) = (topology(&mesh), topology(&all.mesh));
        assert!(is.border_loops > 0 && is.border_loops < 20, "{}", is.border_loops);
        assert_eq!((is.misoriented_edges, is.nonmanifold_edges), (was.misoriented_edges, 0));
        assert_eq!(is.faces - was.faces, 128 - is.border_loops);
        assert!(all.warnings.contains(&told_of_open(is.border_loops)), "{:?}", all.warnings);
    }

    #[test]
    fn what_closes_a_hole_is_of_one_piece() {
        let mut mesh = holed(40);
        let place = |v: u32| mesh.positions[v as usize];
        // A texture in two pieces, and a material in each.
        let side = |face: &[u32; 3]| u32::from(face.iter().map(|&v| place(v).x).sum::<f64>() > 0.0);
        let uv =
            |face: &[u32; 3]| face.map(|v| Vec2::new(place(v).y as f32 + 9.0 * side(face) as f32, place(v).z as f32));
        let texcoords = mesh.faces.iter().map(uv).collect();
        let materials =
            crate::mesh::Materials { of_face: mesh.faces.iter().map(side).collect(), names: vec![String::new(); 2] };
        (mesh.texcoords, mesh.materials) = (Some(texcoords), Some(materials));
        let options = Options { close_holes: Some(0.1), ..Options::default() };
        let all = to(&mesh, &[Budget::faces(9999)], &options).pop().expect("one budget").mesh;
        let (added, of_face) =
            (all.faces.len() - mesh.faces.len(), &all.materials.as_ref().expect("materials").of_face);
        assert!((100..128).contains(&added), "{added}");
        for (texcoords, &side) in all.texcoords.as_ref().expect("a texture").iter().zip(of_face) {
            assert!(texcoords.iter().all(|uv| (uv.x > 4.0) == (side == 1)), "{texcoords:?} of {side}");
        }
        // What is dropped parts nothing.
        let shape = Options { attributes: super::super::Attributes::drop_all(), ..options };
        assert_eq!(loops(&to(&mesh, &[Budget::faces(9999)], &shape)[0]), 0);
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
            (Options { join_within: 1e-9, ..Options::default() }, Budget::faces(200)),
            (Options { lock: Some(Lock::Vertices([0].into())), ..Options::default() }, Budget::faces(200)),
            (Options::default(), bounded),
            (Options::default(), Budget::faces(0)),
        ] {
            let outcome = to(&mesh, &[budget], &options).pop().expect("one budget");
            assert_eq!((loops(&outcome), told(&outcome)), (128, None), "{options:?}");
        }
    }
}
