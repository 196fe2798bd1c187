//! Whether seams made the faces of a run dear that came to the number asked for, and the closer of two outcomes: of that run, and of
//! one in which all seams yield.
//!
//! Seams that hold keep faces where they are many: around the poles of a globe, along the rims of small charts. The others have to be
//! so much fewer, and what no seam is on is wrecked for them, the texture as well.

use crate::simplify::{Budget, Outcome, RoundRecord, StopReason};

/// The share of the pairs of a round from which those that seams and textures refuse press.
const PRESSING: f64 = 0.125;
/// The share of the faces asked for that seams keep by themselves from which they press: what stays locked is no pair that could be
/// refused.
const KEPT: f64 = 0.4;
/// And only if so many times as many faces were there: before, the others have room, and no checkpoint is far enough ahead.
const FAR: usize = 3;
/// Rounds count from this many times as many faces as were asked for.
const LATE: usize = 2;
/// The estimated error that is looked at, of the diagonal: a run to the tenth of a percent has what it needs.
const SEEN: f64 = 1e-3;
/// The estimated error from which a result is a wreck, of the diagonal: whatever holds at all is worth a try without it.
const WRECKED: f64 = 0.02;
/// The share of its faces that vertices which are not manifold keep at least, to be to blame. With a tenth a car with 65 of them is
/// made again to 1,242 faces, at twice the time, for nothing.
const KEPT_OF_WRECK: f64 = 0.2;
/// The estimated error up to which it is none yet, and a run may be taken up to go another way.
pub const SOUND: f64 = WRECKED / 4.0;
/// What the estimated error of a run in which seams yield is of that with them at most, for it to be worth what they show.
const CLOSER: f64 = 0.8;

/// What the user is told where seams yield for that.
pub const FARTHER_WITH_SEAMS: &str = "seams yield: the surface is estimated farther off with them";

/// Whether an outcome is so far off that a run in which seams yield may be worth it.
pub fn is_seen(outcome: &Outcome, budget: &Budget, diagonal: f64) -> bool {
    let is_reached = outcome.stop == StopReason::FacesReached && budget.counts_faces();
    is_reached && outcome.error_estimate > SEEN * diagonal
}

/// Whether an outcome is so far off that hardly anything is left of the shape.
pub fn is_wrecked(outcome: &Outcome, diagonal: f64) -> bool {
    outcome.error_estimate > WRECKED * diagonal
}

/// Whether seams pressed on the run of an outcome from so many faces, of which they keep some.
pub fn are_pressing(outcome: &Outcome, faces: usize, kept: usize) -> bool {
    let most =
        refusing(outcome).map(|round| (round.blocked.seam + round.blocked.texture) as f64 / round.pairs.max(1) as f64);
    keep_many(outcome, faces, kept) || most.fold(0.0, f64::max) >= PRESSING
}

/// Whether seams, which keep so many faces, kept the run of an outcome from anything late: where they did not, another in which they
/// yield comes to the same.
pub fn are_felt(outcome: &Outcome, kept: usize) -> bool {
    kept > 0 || refusing(outcome).next().is_some()
}

/// The late rounds of the run of an outcome in which seams refused pairs: textures alone have nothing that could yield.
fn refusing(outcome: &Outcome) -> impl Iterator<Item = &RoundRecord> {
    let is_late = |round: &&RoundRecord| round.faces as usize <= LATE * outcome.mesh.faces.len();
    outcome.rounds.iter().filter(is_late).filter(|round| round.blocked.seam > 0)
}

/// Whether so many faces, kept by what holds, are many of those of an outcome of a run from `faces`.
pub fn keep_many(outcome: &Outcome, faces: usize, kept: usize) -> bool {
    let left = outcome.mesh.faces.len();
    kept as f64 >= KEPT * left as f64 && faces >= FAR * left
}

/// Whether they are enough to have made a wreck of it.
pub fn keep_some(outcome: &Outcome, kept: usize) -> bool {
    kept as f64 >= KEPT_OF_WRECK * outcome.mesh.faces.len() as f64
}

/// The greatest error with which any of the levels `left` may be taken instead of what was made.
pub fn worst_error(made: &[Option<Outcome>], left: &[usize]) -> f64 {
    // Others may be coarser, and closer.
    let share = if made.len() == 1 { CLOSER } else { 1.0 };
    left.iter().filter_map(|&level| Some(share * made[level].as_ref()?.error_estimate)).fold(0.0, f64::max)
}

/// Of levels that were made, and those `found` in which all seams yield, by their numbers, keeps the closer ones. The latter took so
/// many seconds more, and have to be closer by much; by little where a coarser one is closer than what was made. Those that are not
/// there came to be farther off. All that were made if the others were cancelled, as they are through.
pub fn keep_closer(made: &mut [Option<Outcome>], found: Vec<(usize, Option<Outcome>)>, spent: f64) {
    let is_cancelled = |yielding: &Outcome| yielding.stop == StopReason::Cancelled;
    let was_cancelled = found.iter().any(|(_, yielding)| yielding.as_ref().is_some_and(is_cancelled));
    let mut others: Vec<Option<Option<Outcome>>> = vec![None; made.len()];
    found.into_iter().for_each(|(level, yielding)| others[level] = Some(yielding));
    let faces = |level: &Option<Outcome>| level.as_ref().map(|level| level.mesh.faces.len());
    let mut levels: Vec<_> = made.iter_mut().zip(others).collect();
    levels.sort_by_key(|(level, _)| faces(level));
    // The least error of those that are coarser.
    let mut limit = f64::INFINITY;
    for (level, yielding) in levels {
        let Some(mut held) = level.take() else { continue };
        let most = if held.error_estimate > limit { 1.0 } else { CLOSER };
        let is_closer = |yielding: &Outcome| {
            !was_cancelled && yielding.stop == held.stop && yielding.error_estimate <= most * held.error_estimate
        };
        let is_found = yielding.is_some();
        let kept = yielding.flatten().filter(is_closer).unwrap_or_else(|| {
            if is_found && was_cancelled {
                held.stop = StopReason::Cancelled;
            }
            if is_found { held.later(spent) } else { held }
        });
        limit = limit.min(kept.error_estimate);
        *level = Some(kept);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Options, Seams, run};
    use super::*;
    use crate::backend::Device;
    use crate::math::Vec2;
    use crate::mesh::{Mesh, shapes};
    use crate::simplify::Blocked;

    fn made(mesh: &Mesh, faces: usize, options: &Options) -> Outcome {
        let device = Device::cpu(1).expect("a device");
        let made = run(mesh, options, &[Budget::faces(faces)], &device, None);
        made.expect("a valid mesh").pop().expect("one budget")
    }

    fn with(stop: StopReason, error_estimate: f64) -> Outcome {
        Outcome { stop, error_estimate, ..made(&shapes::icosphere(0), 20, &Options::default()) }
    }

    #[test]
    fn seams_press_where_they_refuse_many_pairs_of_a_late_round() {
        let round = |faces: u64, seam: u64| RoundRecord {
            faces,
            pairs: 80,
            blocked: Blocked { seam, texture: 2, ..Blocked::default() },
            ..RoundRecord::default()
        };
        let press = |rounds: &[[u64; 2]], error: f64, budget: Budget| {
            let rounds = rounds.iter().map(|&[faces, seam]| round(faces, seam)).collect();
            let outcome = Outcome { rounds, ..with(StopReason::FacesReached, error) };
            is_seen(&outcome, &budget, 1.0) && are_pressing(&outcome, 60, 7)
        };
        let counted = Budget::faces(20);
        assert!(press(&[[40, 8], [22, 0]], 0.01, counted) && !press(&[[41, 8], [22, 7]], 0.01, counted));
        assert!(!press(&[[40, 8]], 1e-3, counted));
        assert_eq!([0.021, 0.019].map(|error| is_wrecked(&with(StopReason::FacesReached, error), 1.0)), [true, false]);
        let felt = [[[41, 8], [22, 0]], [[41, 0], [22, 1]]].map(|rounds| {
            let rounds = rounds.iter().map(|&[faces, seam]| round(faces, seam)).collect();
            let outcome = Outcome { rounds, ..with(StopReason::FacesReached, 0.03) };
            [0, 1].map(|kept| are_felt(&outcome, kept))
        });
        assert_eq!(felt, [[false, true], [true, true]]);
        let folded = Outcome {
            rounds: vec![RoundRecord { blocked: Blocked { texture: 70, ..Blocked::default() }, ..round(30, 0) }],
            ..with(StopReason::FacesReached, 0.01)
        };
        let keep_many = [[60, 7], [59, 8], [60, 8]].map(|[faces, kept]| are_pressing(&folded, faces, kept));
        assert_eq!(keep_many, [false, false, true]);
        assert!(!is_seen(&with(StopReason::Stuck, 0.01), &counted, 1.0));
    }

    /// Which of levels are taken, from such ends and errors with seams that hold and with those that yield; the finest first.
    fn taken<const N: usize>(held: [f64; N], yielding: [(StopReason, f64); N]) -> [bool; N] {
        let of_level = |level: usize, stop: StopReason, error: f64| {
            let mut outcome = with(stop, error);
            outcome.mesh.faces.truncate(20 - level);
            outcome
        };
        let mut made: Vec<_> =
            (0..N).map(|level| Some(of_level(level, StopReason::FacesReached, held[level]))).collect();
        let found = (0..N).map(|level| (level, Some(of_level(level, yielding[level].0, yielding[level].1))));
        keep_closer(&mut made, found.collect(), 2.0);
        std::array::from_fn(|level| {
            let kept = made[level].as_ref().expect("a level");
            let is_yielding = kept.error_estimate.to_bits() != held[level].to_bits();
            assert_eq!(kept.seconds.total > 2.0, !is_yielding);
            let was_cancelled = yielding.iter().any(|(stop, _)| *stop == StopReason::Cancelled);
            assert_eq!(kept.stop == StopReason::Cancelled, was_cancelled);
            is_yielding
        })
    }

    #[test]
    fn only_what_is_much_closer_is_taken() {
        use StopReason::{Cancelled, FacesReached, Stuck};
        let is_taken = |yielding: (StopReason, f64)| taken([1.0], [yielding]) == [true];
        assert!(is_taken((FacesReached, 0.8)) && !is_taken((FacesReached, 0.81)));
        assert!(!is_taken((Stuck, 0.1)) && !is_taken((Cancelled, 0.1)));
    }

    #[test]
    fn levels_that_came_to_be_farther_off_are_not_there_and_not_taken() {
        let level = |faces: usize, error: f64| {
            let mut outcome = with(StopReason::FacesReached, error);
            outcome.mesh.faces.truncate(faces);
            Some(outcome)
        };
        let mut made = vec![level(20, 1.0), level(10, 3.0), level(5, 2.0)];
        assert_eq!((worst_error(&made[..1], &[0]), worst_error(&made, &[0, 2])), (CLOSER, 2.0));
        // The middle one was farther off than wanted, and the last was not asked for.
        keep_closer(&mut made, vec![(0, level(20, 0.5)), (1, None)], 7.0);
        let kept = made.iter().flatten().map(|level| (level.error_estimate, level.seconds.total > 7.0));
        assert!(kept.eq([(0.5, false), (3.0, true), (2.0, false)]));
    }

    /// The coarsest had been stuck, and was made again by itself.
    #[test]
    fn levels_that_are_not_compared_count_too() {
        let level = |faces: usize, error: f64| {
            let mut outcome = with(StopReason::FacesReached, error);
            outcome.mesh.faces.truncate(faces);
            outcome
        };
        let kept = |coarsest: f64| {
            let mut made = vec![Some(level(20, 1.0)), Some(level(10, coarsest))];
            keep_closer(&mut made, vec![(0, Some(level(20, 0.85)))], 2.0);
            [0, 1].map(|level| made[level].as_ref().map(|level| level.error_estimate))
        };
        assert_eq!([0.9, 1.1].map(kept), [[Some(0.85), Some(0.9)], [Some(1.0), Some(1.1)]]);
    }

    #[test]
    fn no_level_is_farther_off_than_a_coarser_one() {
        let all = |errors: [f64; 3]| errors.map(|error| (StopReason::FacesReached, error));
        // What is closer by little alone is taken where a coarser one is closer than it.
        assert_eq!(taken([1.0, 2.0, 9.0], all([0.9, 1.7, 1.8])), [false, true, true]);
        assert_eq!(taken([1.0, 2.0, 9.0], all([0.9, 1.7, 2.5])), [false, false, true]);
        assert_eq!(taken([1.0, 2.0, 3.0], all([0.2, 1.9, 2.9])), [true, false, false]);
        let [finest, middle, coarsest] = all([0.1, 0.1, 0.1]);
        assert_eq!(taken([1.0, 2.0, 3.0], [finest, (StopReason::Cancelled, 0.1), coarsest]), [false; 3]);
        assert_eq!(taken([1.0, 2.0, 3.0], [finest, middle, (StopReason::Stuck, 0.1)]), [true, true, false]);
    }

    /// A globe of so many columns and rows whose poles have a place in the texture for every face: held, these are most of what is
    /// left of it.
    fn globe(around: usize, down: usize) -> Mesh {
        let place = |column: usize, row: usize| {
            let angles = [column as f64 / around as f64, row as f64 / (2 * down) as f64];
            let [(sin, cos), (height, width)] = angles.map(|turns| {
                let turn = turns * std::f64::consts::TAU;
                (turn.sin(), turn.cos())
            });
            crate::math::DVec3::new(cos * height, sin * height, width)
        };
        let number = |column: usize, row: usize| match row {
            0 => 0,
            row if row == down => 1,
            row => (2 + (row - 1) * around + column % around) as u32,
        };
        let mut globe = Mesh { positions: vec![place(0, 0), place(0, down)], ..Mesh::default() };
        globe.positions.extend((1..down).flat_map(|row| (0..around).map(move |column| place(column, row))));
        let mut texcoords = Vec::new();
        for row in 0..down {
            for column in 0..around {
                let at = |right: usize, below: usize| {
                    // At a pole each face has the middle of its own column.
                    let is_pole = row + below == 0 || row + below == down;
                    let u = column as f32 + if is_pole { 0.5 } else { right as f32 };
                    (
                        number(column + right, row + below),
                        Vec2::new(u / around as f32, (row + below) as f32 / down as f32),
                    )
                };
                let corners = [[(0, 0), (0, 1), (1, 1)], [(0, 0), (1, 1), (1, 0)]];
                for corners in corners {
                    let corners = corners.map(|(right, below)| at(right, below));
                    let face = corners.map(|(vertex, _)| vertex);
                    if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
                        globe.faces.push(face);
                        texcoords.push(corners.map(|(_, uv)| uv));
                    }
                }
            }
        }
        globe.texcoords = Some(texcoords);
        globe
    }

    #[test]
    fn the_poles_of_a_globe_do_not_wreck_it() {
        let globe = globe(48, 24);
        let mut options = Options::default();
        let outcome = made(&globe, 140, &options);
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 140));
        assert!(outcome.warnings.iter().any(|warning| warning == FARTHER_WITH_SEAMS), "{:?}", outcome.warnings);
        options.attributes.seams = Seams::Hold;
        let held = made(&globe, 140, &options);
        let [closer, farther] = [&outcome, &held].map(|outcome| outcome.error_estimate);
        assert!(closer < 0.5 * farther, "{closer} with seams that yield, {farther} with those that hold");
    }

    /// To so few faces that corners yield from the start, and the rest is a wreck long before it is reached.
    #[test]
    fn a_wreck_is_made_again_from_where_it_was_none() {
        let globe = globe(32, 16);
        let (outcome, shape) = (
            made(&globe, 48, &Options::default()),
            made(&Mesh::new(globe.positions.clone(), globe.faces.clone()), 48, &Options::default()),
        );
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 48));
        let [textured, shape] = [&outcome, &shape].map(|outcome| outcome.error_estimate);
        assert!(textured < 2.0 * shape, "{textured}, and {shape} of the shape alone");
    }

    #[test]
    fn levels_of_a_chain_are_compared_as_one_number_is() {
        let (globe, device) = (globe(48, 24), Device::cpu(1).expect("a device"));
        // Also where the coarsest is stuck with seams that hold, and is made again by itself.
        for (coarsest, is_stuck) in [(200, false), (60, true)] {
            let chain = |seams: Seams| {
                let mut options = Options::default();
                options.attributes.seams = seams;
                let levels = [1400, 400, 240, coarsest].map(Budget::faces);
                run(&globe, &options, &levels, &device, None).expect("a valid mesh")
            };
            let (found, held) = (chain(Seams::Yield), chain(Seams::Hold));
            assert_eq!(held[3].stop == StopReason::Stuck, is_stuck);
            assert_eq!([0, 1, 2, 3].map(|level| found[level].mesh.faces.len()), [1400, 400, 240, coarsest]);
            let is_told = |outcome: &Outcome| outcome.warnings.iter().any(|warning| warning == FARTHER_WITH_SEAMS);
            assert_eq!([0, 2, 3].map(|level| is_told(&found[level])), [false, true, !is_stuck]);
            assert_eq!(found[0].mesh, held[0].mesh);
            assert!(found[2].error_estimate < 0.5 * held[2].error_estimate);
            let errors = [0, 1, 2, 3].map(|level| found[level].error_estimate);
            assert!(errors.is_sorted(), "{errors:?}");
        }
    }
}
