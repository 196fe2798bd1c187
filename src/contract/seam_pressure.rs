//! Whether seams made the faces of a run dear that came to the number asked for, and the closer of two outcomes: of that run, and of
//! one in which all seams yield.
//!
//! Seams that hold keep faces where they are many: around the poles of a globe, along the rims of small charts. The others have to be
//! so much fewer, and what no seam is on is wrecked for them, the texture as well. Of a run to one number of faces, not of a chain.

use crate::simplify::{Budget, Outcome, RoundRecord, StopReason};

use super::pressure::has_error;

/// The share of the pairs of a round from which those that seams and textures refuse press.
const PRESSING: f64 = 0.125;
/// Rounds count from this many times as many faces as were asked for.
const LATE: usize = 2;
/// The estimated error that is looked at, of the diagonal: a run to the tenth of a percent has what it needs.
const SEEN: f64 = 1e-3;
/// What the estimated error of a run in which seams yield is of that with them at most, for it to be worth what they show.
const CLOSER: f64 = 0.7;

/// What the user is told where seams yield for that.
pub const FARTHER_WITH_SEAMS: &str = "seams yield: the surface is estimated farther off with them";

/// Whether seams pressed on the run of an outcome, and it is so far off that another in which they yield may be closer. Under an error
/// limit it is as far off as it may be.
pub fn are_pressing(outcome: &Outcome, budget: &Budget, diagonal: f64) -> bool {
    let is_reached = outcome.stop == StopReason::FacesReached && budget.counts_faces() && !has_error(budget);
    // Textures alone have nothing that could yield.
    let is_late = |round: &&RoundRecord| round.faces as usize <= LATE * outcome.mesh.faces.len();
    let late = outcome.rounds.iter().filter(is_late).filter(|round| round.blocked.seam > 0);
    let most = late.map(|round| (round.blocked.seam + round.blocked.texture) as f64 / round.pairs.max(1) as f64);
    is_reached && outcome.error_estimate > SEEN * diagonal && most.fold(0.0, f64::max) >= PRESSING
}

/// The closer of two outcomes, of which the other took so many seconds more, and has to be closer by much; the first if that was
/// cancelled, as it is through.
pub fn closer(held: Outcome, yielding: Outcome, spent: f64) -> Outcome {
    if yielding.stop == StopReason::Cancelled {
        return Outcome { stop: StopReason::Cancelled, ..held.later(spent) };
    }
    let is_closer = yielding.stop == held.stop && yielding.error_estimate <= CLOSER * held.error_estimate;
    if is_closer { yielding } else { held.later(spent) }
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
            are_pressing(&Outcome { rounds, ..with(StopReason::FacesReached, error) }, &budget, 1.0)
        };
        let counted = Budget::faces(20);
        assert!(press(&[[40, 8], [22, 0]], 0.01, counted) && !press(&[[41, 8], [22, 7]], 0.01, counted));
        assert!(!press(&[[40, 8]], 1e-3, counted) && !press(&[[40, 8]], 0.01, Budget { error: Some(0.1), ..counted }));
        let folded = Outcome {
            rounds: vec![RoundRecord { blocked: Blocked { texture: 70, ..Blocked::default() }, ..round(30, 0) }],
            ..with(StopReason::FacesReached, 0.01)
        };
        assert!(!are_pressing(&folded, &counted, 1.0));
        let stuck = Outcome { rounds: vec![round(30, 70)], ..with(StopReason::Stuck, 0.01) };
        assert!(!are_pressing(&stuck, &counted, 1.0));
    }

    #[test]
    fn only_what_is_much_closer_is_taken() {
        use StopReason::{Cancelled, FacesReached, Stuck};
        let chosen = |yielding: (StopReason, f64)| {
            let chosen = closer(with(FacesReached, 1.0), with(yielding.0, yielding.1), 2.0);
            (chosen.error_estimate, chosen.stop, chosen.seconds.total > 2.0)
        };
        assert_eq!(chosen((FacesReached, 0.7)), (0.7, FacesReached, false));
        assert_eq!(chosen((FacesReached, 0.71)), (1.0, FacesReached, true));
        assert_eq!(chosen((Stuck, 0.1)), (1.0, FacesReached, true));
        assert_eq!(chosen((Cancelled, 0.1)), (1.0, Cancelled, true));
    }

    /// A globe whose poles have a place in the texture for every face: held, these are most of what is left of it.
    fn globe() -> Mesh {
        let (around, down) = (48, 24);
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
        let globe = globe();
        let mut options = Options::default();
        let outcome = made(&globe, 140, &options);
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 140));
        assert!(outcome.warnings.iter().any(|warning| warning == FARTHER_WITH_SEAMS), "{:?}", outcome.warnings);
        options.attributes.seams = Seams::Hold;
        let held = made(&globe, 140, &options);
        let [closer, farther] = [&outcome, &held].map(|outcome| outcome.error_estimate);
        assert!(closer < 0.5 * farther, "{closer} with seams that yield, {farther} with those that hold");
    }

    /// Whose levels would have to be as close as those that are coarser.
    #[test]
    fn a_chain_is_not_compared() {
        let (globe, device) = (globe(), Device::cpu(1).expect("a device"));
        let chain = |seams: Seams| {
            let mut options = Options::default();
            options.attributes.seams = seams;
            let levels = [Budget::faces(400), Budget::faces(140)];
            run(&globe, &options, &levels, &device, None).expect("a valid mesh")
        };
        for (found, held) in chain(Seams::Yield).iter().zip(chain(Seams::Hold)) {
            assert_eq!(found.stop, StopReason::FacesReached);
            assert!(found.warnings.iter().all(|warning| warning != FARTHER_WITH_SEAMS), "{:?}", found.warnings);
            assert!(found.mesh.faces.len() <= held.mesh.faces.len());
        }
    }
}
