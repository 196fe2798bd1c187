//! The start of a run: what gives way in it, what holds, and the seams that are flagged for that.

use crate::error::Result;
use crate::simplify::Budget;

use super::driver::Job;
use super::prepare::{Prepared, begin};
use super::pressure::{Pressure, has_error};
use super::yielding::Yields;
use super::{Attributes, Candidates, Options, Placement, Seams};

/// What gives way in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Step {
    pub yields: Yields,
    /// Whether vertices move where the surface is not manifold.
    pub complex: bool,
}

/// What holds in a run, and could give way.
#[derive(Debug, Clone, Copy, Default)]
pub struct Holds {
    /// The seams that yield if this is not enough.
    pub seams: Option<Yields>,
    /// How many faces more those that hold leave than there would be without them, at least.
    pub by_seams: usize,
    /// How many vertices stay for nothing but that the surface is not manifold there.
    pub complex: usize,
}

/// The start of a run.
pub struct Attempt {
    pub prepared: Prepared,
    pub step: Step,
    pub holds: Holds,
    /// Whether creases press, and a run in which they yield is to be compared with one in which they hold: its seams are not flagged.
    pub is_pressed: bool,
}

impl Attempt {
    /// A run in which this yields, or the first more of the seams that do not hold all of it from the start: `at` a checkpoint, or at
    /// the start of the mesh.
    pub fn new(
        Job { mesh, options, budgets, .. }: Job<'_>,
        Step { mut yields, complex }: Step,
        at: Option<Prepared>,
    ) -> Result<Self> {
        let faces = mesh.faces.len();
        let first = first_count(faces, budgets)?;
        let mut prepared = at.map_or_else(|| begin(mesh, options), Ok)?;
        if complex && !prepared.complex_yield {
            prepared.let_complex_yield();
        }
        let held_complex = if may_loosen(&prepared, options) { prepared.held_complex() } else { 0 };
        let has_wedges = prepared.carried.wedges.is_some();
        let holds = |seams: Option<Yields>, by_seams| Holds {
            seams: seams.filter(|_| has_wedges),
            by_seams,
            complex: held_complex,
        };
        let more = |prepared: &Prepared, yields: Yields| {
            may_yield(options).then(|| more_than(yields, prepared.has_shading())).flatten()
        };
        loop {
            let seams = prepared.seam_flags(mesh, yields, options);
            let held = prepared.least_faces(&seams);
            let free = if seams.is_empty() { held } else { prepared.least_faces(&[]) };
            let next = more(&prepared, yields);
            // Charts keep faces that no flag tells of. Where parts keep as many anyway, all seams would yield for nothing.
            let charts_hold = || {
                let least = prepared.carried.wedges.as_ref().map(|wedges| wedges.least_faces_of_parts(mesh));
                least.is_some_and(|[of_charts, of_materials]| of_charts > first && of_materials <= first)
            };
            let holds_all = || held > first || (yields == Yields::Corners && charts_hold());
            if let Some(next) = next.filter(|_| free <= first && holds_all()) {
                yields = next;
                continue;
            }
            // Without another look at the seams: no more than if all of them were creases.
            let most = Pressure { start: prepared.faces.len(), held, by_creases: held };
            if next == Some(Yields::Creases) && most.is_on_any(budgets, faces) {
                let without = prepared.seam_flags(mesh, Yields::Creases, options);
                let by_creases = held.saturating_sub(prepared.least_faces(&without));
                if (Pressure { by_creases, ..most }).is_on_any(budgets, faces) {
                    let step = Step { yields: Yields::Creases, complex };
                    let holds = holds(Yields::Creases.more(), held.saturating_sub(by_creases + free));
                    return Ok(Self { prepared, step, holds, is_pressed: true });
                }
            }
            prepared.flag_seams(mesh, &seams, yields);
            let (step, holds) = (Step { yields, complex }, holds(next, held.saturating_sub(free)));
            return Ok(Self { prepared, step, holds, is_pressed: false });
        }
    }
}

/// What yields when this was not enough: without shading there are no creases.
fn more_than(yields: Yields, has_shading: bool) -> Option<Yields> {
    yields.more().and_then(|more| if more == Yields::Creases && !has_shading { more.more() } else { Some(more) })
}

/// The face count that comes first, where all that is asked for is a count; an error limit may end a run before seams do.
fn first_count(faces: usize, budgets: &[Budget]) -> Result<usize> {
    let count = |budget: &Budget| if has_error(budget) { Ok(usize::MAX) } else { budget.target_faces(faces) };
    budgets.iter().map(count).try_fold(0, |most, faces| Ok(most.max(faces?)))
}

/// Whether seams may yield at all. What reaches a vertex of the input from beside a seam brings numbers that it never had.
pub fn may_yield(options: &Options) -> bool {
    let Attributes { seams, lock_seams, .. } = options.attributes;
    let of_input = options.placement == Placement::Endpoint;
    seams == Seams::Yield && !(lock_seams || of_input || options.log || options.joins())
}

/// Whether vertices that stay may move, where the surface is not manifold. A fit needs a surface there, and triangles do not ask.
fn may_loosen(prepared: &Prepared, options: &Options) -> bool {
    options.cuts() && options.fit == 0 && options.candidates == Candidates::Pairs && !prepared.complex_yield
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;
    use crate::backend::{Awake, Device};
    use crate::math::Vec2;
    use crate::mesh::{Mesh, shapes};

    /// A plane of 20 × 20 squares whose texture is a wall of bricks, each a chart of four squares, but for halves at the ends of
    /// every second row: 110 in all, and three meet at most corners.
    fn bricks() -> Mesh {
        let mut mesh = shapes::plane(20, 20);
        let brick = |f: usize| 6 * (f / 40) + (f % 40 + 4 * (f / 40 % 2)) / 8;
        let at = |(f, face): (usize, &[u32; 3])| {
            face.map(|v| Vec2::new((v % 21) as f32 + 30.0 * brick(f) as f32, (v / 21) as f32))
        };
        mesh.texcoords = Some(mesh.faces.iter().enumerate().map(at).collect());
        mesh
    }

    #[test]
    fn creases_are_given_up_only_where_there_is_shading() {
        let chain = |has_shading: bool| {
            let next = |yields: &Yields| more_than(*yields, has_shading);
            std::iter::successors(Some(Yields::Nothing), next).collect::<Vec<_>>()
        };
        assert_eq!(chain(true), [Yields::Nothing, Yields::Creases, Yields::Corners, Yields::Seams]);
        assert_eq!(chain(false), [Yields::Nothing, Yields::Corners, Yields::Seams]);
    }

    #[test]
    fn a_run_that_charts_would_hold_is_not_made() {
        let (mesh, options, device) = (bricks(), Options::default(), Device::cpu(1).expect("a device"));
        let yields = |faces: usize| {
            let budgets = [Budget::faces(faces)];
            let job = Job {
                mesh: &mesh,
                options: &options,
                budgets: &budgets,
                device: &device,
                clock: Instant::now(),
                awake: &Awake::new(),
                worst_deviation: f64::INFINITY,
            };
            Attempt::new(job, Step::default(), None).expect("a valid mesh").step.yields
        };
        // Corners of bricks hold more than two faces each; where they do not, that is what bricks keep. A face is kept by the plane
        // itself.
        assert_eq!([500, 220, 219, 2, 1].map(yields), {
            use Yields::{Corners, Nothing, Seams};
            [Nothing, Corners, Seams, Seams, Corners]
        });
    }
}
