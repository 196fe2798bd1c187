//! Runs in which creases would keep many of the faces asked for: the better of two is taken.

#[path = "support/mod.rs"]
mod support;

use std::ops::ControlFlow;

use coarsen::backend::GpuOptions;
use coarsen::contract::{Attributes, Options, Seams};
use coarsen::math::{DVec3, Vec3};
use coarsen::mesh::shapes;
use coarsen::simplify::Progress;
use coarsen::{Budget, Device, Mesh, Method, Outcome, StopReason, metrics, simplify, simplify_levels};
use support::engine::{bytes, cpu, gpu};
use support::shapes::boxed;

/// A number of faces near the 360 of the boxes.
const NEAR: usize = 390;

/// A ball of 1,280 faces beside thirty small boxes.
fn ball_and_boxes() -> Mesh {
    boxes_beside(shapes::icosphere(3))
}

/// Thirty small boxes beside a ball.
fn boxes_beside(mut mesh: Mesh) -> Mesh {
    let mut normals: Vec<Vec3> = mesh.positions.iter().map(|p| p.normalize().as_vec3()).collect();
    let small = boxed(1);
    for number in 0..30 {
        let (first, at) = (mesh.positions.len() as u32, DVec3::new(2.0 + 0.2 * f64::from(number), 0.0, 0.0));
        mesh.positions.extend(small.positions.iter().map(|&p| p * 0.05 + at));
        mesh.faces.extend(small.faces.iter().map(|face| face.map(|v| v + first)));
        normals.extend(small.normals.iter().flatten());
    }
    mesh.normals = Some(normals);
    mesh
}

fn method(seams: Seams) -> Method {
    let attributes = Attributes { seams, ..Attributes::default() };
    Method::Contract(Options { attributes, ..Options::default() })
}

fn run(device: &Device, mesh: &Mesh, seams: Seams, budget: Budget) -> Outcome {
    simplify(mesh, &method(seams), &budget, device, None).expect("a valid mesh")
}

/// Whether the user is told that a run without creases was taken.
fn is_told(outcome: &Outcome) -> bool {
    outcome.warnings.iter().any(|warning| warning.contains("farther off with them"))
}

/// The fewest faces that progress tells of each run: it begins anew where there are more.
fn runs(mesh: &Mesh, budget: Budget) -> Vec<usize> {
    let (mut fewest, mut before) = (Vec::new(), 0);
    let mut note = |progress: Progress| {
        if progress.faces > before {
            fewest.push(progress.faces);
        }
        before = progress.faces;
        fewest.last_mut().into_iter().for_each(|fewest| *fewest = progress.faces);
        ControlFlow::Continue(())
    };
    simplify(mesh, &method(Seams::Yield), &budget, &cpu(1), Some(&mut note)).expect("a valid mesh");
    fewest
}

#[test]
fn creases_yield_where_the_surface_is_closer_without() {
    let mesh = ball_and_boxes();
    let off = |result: &Mesh| {
        metrics::deviation(&mesh, result, &metrics::Options::default(), &cpu(2)).expect("meshes").symmetric().rms
    };
    let [found, held] = [Seams::Yield, Seams::Hold].map(|seams| run(&cpu(2), &mesh, seams, Budget::faces(NEAR)));
    assert_eq!([held.stop, found.stop], [StopReason::FacesReached; 2]);
    assert_eq!([&held, &found].map(is_told), [false, true]);
    let [held_off, found_off] = [&held.mesh, &found.mesh].map(off);
    assert!(found_off < 0.5 * held_off, "{found_off} of {held_off}");
    // That with creases comes second, and ends where it is known to be farther off.
    assert!(matches!(runs(&mesh, Budget::faces(NEAR))[..], [NEAR, second] if second > NEAR));
    for device in [1, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default())) {
        let other = run(&device, &mesh, Seams::Yield, Budget::faces(NEAR));
        assert!(bytes(&other.mesh) == bytes(&found.mesh), "{}", device.description());
    }
}

/// Where every edge is a seam every vertex is a corner of seams, and moves all the same once seams yield.
#[test]
fn faces_of_a_color_each_come_near_the_shape_alone() {
    let sphere = shapes::icosphere(4);
    let positions = sphere.faces.iter().flatten().map(|&v| sphere.positions[v as usize]).collect();
    let faces = (0..sphere.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let color = |f: usize| [(f % 7) as f32 / 7.0, (f % 11) as f32 / 11.0, (f % 13) as f32 / 13.0, 1.0];
    let mesh = Mesh {
        colors: Some((0..sphere.faces.len()).flat_map(|f| [color(f); 3]).collect()),
        ..Mesh::new(positions, faces)
    };
    let budget = Budget::faces(sphere.faces.len() / 4);
    let rms = |attributes| {
        let method = Method::Contract(Options { attributes, ..Options::default() });
        let outcome = simplify(&mesh, &method, &budget, &cpu(2), None).expect("a valid mesh");
        assert_eq!(outcome.mesh.faces.len(), sphere.faces.len() / 4);
        let samples = metrics::Options { samples: Some(50_000), ..metrics::Options::default() };
        metrics::deviation(&sphere, &outcome.mesh, &samples, &cpu(2)).expect("two meshes").symmetric().rms
    };
    let [colored, alone] = [rms(Attributes::default()), rms(Attributes::drop_all())];
    assert!(colored < 2.4 * alone, "{colored}, {alone} without colors");
}

#[test]
fn creases_hold_where_they_are_not_in_the_way() {
    let mesh = ball_and_boxes();
    // With three times as many there is room for the ball, and of a limit to the error nobody knows where it ends.
    for budget in [Budget::faces(1200), Budget::error(0.2)] {
        let [found, held] = [Seams::Yield, Seams::Hold].map(|seams| run(&cpu(2), &mesh, seams, budget));
        assert!(found.mesh == held.mesh && found.warnings.is_empty(), "{:?}", found.warnings);
        assert_eq!(runs(&mesh, budget).len(), 1);
    }
    // A box is exact with 40 faces, of which its creases keep twelve: the other run is made for nothing.
    let mesh = boxed(8);
    let [found, held] = [Seams::Yield, Seams::Hold].map(|seams| run(&cpu(2), &mesh, seams, Budget::faces(40)));
    assert!(found.mesh == held.mesh && !is_told(&found), "{:?}", found.warnings);
    assert_eq!(runs(&mesh, Budget::faces(40)), [40, 40]);
    assert!(found.seconds.total >= found.seconds.build);
    // Of several, the least: a busy machine may hold up any one.
    let build = |seams| {
        let builds = (0..9).map(|_| run(&cpu(2), &mesh, seams, Budget::faces(40)).seconds.build);
        builds.fold(f64::INFINITY, f64::min)
    };
    let [both, one] = [Seams::Yield, Seams::Hold].map(build);
    assert!(both > one, "{both} s of two runs, {one} s of one");
}

#[test]
fn no_level_is_farther_off_than_a_coarser_one() {
    // The second ball has more than four times as many faces as any level: the runs part on the way.
    let chains =
        [(ball_and_boxes(), [900, 600, NEAR, 200]), (boxes_beside(shapes::icosphere(4)), [900, 600, NEAR, 200])];
    for (mesh, counts) in chains {
        let budgets = counts.map(Budget::faces);
        let levels = simplify_levels(&mesh, &method(Seams::Yield), &budgets, &cpu(2), None).expect("a valid mesh");
        let faces: Vec<usize> = levels.iter().map(|level| level.mesh.faces.len()).collect();
        assert_eq!(faces, counts);
        let errors: Vec<f64> = levels.iter().map(|level| level.error_estimate).collect();
        assert!(errors.is_sorted() && is_told(&levels[2]), "{errors:?}");
        let rounds = &levels[2].rounds;
        assert_eq!(rounds[0].faces, mesh.faces.len() as u64);
        assert!(rounds.is_sorted_by(|a, b| a.faces >= b.faces));
    }
}

#[test]
fn a_run_that_is_cancelled_before_it_compares_says_so() {
    let (mesh, method, budget) = (boxes_beside(shapes::icosphere(4)), method(Seams::Yield), Budget::faces(NEAR));
    // With more than four times as many faces the runs are one, in which creases hold.
    for (faces, is_parted) in [(usize::MAX, false), (2 * NEAR, true)] {
        let mut stop = |progress: Progress| match progress.faces < faces {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        let outcome = simplify(&mesh, &method, &budget, &cpu(1), Some(&mut stop)).expect("a valid mesh");
        assert_eq!(outcome.stop, StopReason::Cancelled);
        let is_told = outcome.warnings.iter().any(|warning| warning.contains("cancelled before"));
        assert_eq!(is_told, is_parted, "{:?}", outcome.warnings);
        assert!((NEAR + 1..faces).contains(&outcome.mesh.faces.len()));
    }
}

/// How far a limit to the error lets a run go nobody knows: a chain with one is not compared.
#[test]
fn a_chain_with_a_limit_to_the_error_keeps_its_creases() {
    let mesh = ball_and_boxes();
    let budgets = [Budget { error: Some(0.5), ..Budget::faces(10) }, Budget::faces(NEAR)];
    let of = |seams: Seams| {
        let levels = simplify_levels(&mesh, &method(seams), &budgets, &cpu(2), None).expect("a valid mesh");
        levels[1].mesh.clone()
    };
    let level = of(Seams::Yield);
    assert!(level == of(Seams::Hold) && level.faces.len() == NEAR);
}

#[test]
fn a_run_that_is_cancelled_while_it_compares_is_cancelled() {
    let mesh = ball_and_boxes();
    let mut before = usize::MAX;
    let mut stop = |progress: Progress| {
        let is_second = progress.faces > before;
        before = progress.faces;
        if is_second { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let budget = Budget::faces(NEAR);
    let outcome = simplify(&mesh, &method(Seams::Yield), &budget, &cpu(1), Some(&mut stop)).expect("a valid mesh");
    // What was met before is there.
    assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Cancelled, NEAR));
}
