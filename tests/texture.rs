//! Textures through contractions: they follow the surface, do not fold, and their seams stay.
#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod support;

use coarsen::backend::GpuOptions;
use coarsen::contract::{Attributes, Metric, Options, Placement};
use coarsen::formats;
use coarsen::math::{DVec3, Vec2};
use coarsen::mesh::{sample, shapes, weld};
use coarsen::metrics::texture_deviation;
use coarsen::{Budget, Device, Mesh, Method, Outcome, StopReason, simplify};
use support::engine::{METRICS, bytes, cpu, gpu};
use support::models;
use support::texture::{area, folds, rows, seam_ends, textured};

/// Texels along the longer side.
const TEXELS: usize = 512;

const PLACEMENTS: [Placement; 4] =
    [Placement::Optimal, Placement::Segment, Placement::EndpointOrMiddle, Placement::Endpoint];

fn keeping() -> Options {
    Options::default()
}

fn run_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Contract(options.clone()), &budget, device, None).expect("a valid mesh")
}

fn run(mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    run_on(&cpu(2), mesh, options, budget)
}

/// The way around a torus is u, the way around its tube v, with a seam along either.
fn wrapped_torus() -> Mesh {
    let (around, across) = (48, 24);
    let mut mesh = shapes::torus(around, across);
    let row = |face: usize| {
        let (u, v) = ((face as u32 / 2) / across, (face as u32 / 2) % across);
        let at = |du: u32, dv: u32| Vec2::new((u + du) as f32 / around as f32, (v + dv) as f32 / across as f32);
        if face.is_multiple_of(2) { [at(0, 0), at(1, 0), at(1, 1)] } else { [at(0, 0), at(1, 1), at(0, 1)] }
    };
    mesh.texcoords = Some((0..mesh.faces.len()).map(row).collect());
    mesh
}

/// Seen from above: one chart without a fold.
fn terrain(faces: usize) -> Mesh {
    let mesh = sample("terrain", Some(faces)).expect("a sample");
    let (low, high) = mesh.bounds();
    let size = high - low;
    textured(mesh, |p| [(p.x - low.x) / size.x, (p.y - low.y) / size.y])
}

fn mirrored(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.texcoords.iter_mut().flatten().flatten().for_each(|uv| uv.x = -uv.x);
    mesh
}

/// On a plane whose texture is a linear map of it, it stays that map.
#[test]
fn a_linear_texture_of_a_plane_stays_linear() {
    let map = |p: DVec3| [0.25 * p.x - 0.5 * p.y + 3.0, 0.125 * p.x + p.y];
    let mesh = textured(shapes::plane(24, 16), map);
    for metric in METRICS {
        for placement in PLACEMENTS {
            let outcome = run(&mesh, &Options { metric, placement, ..keeping() }, Budget::faces(40));
            assert_eq!(outcome.mesh.faces.len(), 40);
            for (face, uv) in outcome.mesh.faces.iter().zip(rows(&outcome.mesh)) {
                for (&v, uv) in face.iter().zip(uv) {
                    let expected = Vec2::from(map(outcome.mesh.positions[v as usize]).map(|x| x as f32));
                    // Of a texture that is 19 wide.
                    assert!(uv.distance(expected) < 1e-4, "{metric:?} {placement:?}: {uv}, expected {expected}");
                }
            }
        }
    }
}

#[test]
fn no_face_turns_over_in_the_texture() {
    let terrain = terrain(20_000);
    for mesh in [mirrored(&terrain), terrain] {
        let side = area(&rows(&mesh)[0]).signum();
        assert!(rows(&mesh).iter().all(|uv| area(uv) * side > 0.0));
        for metric in METRICS {
            for placement in PLACEMENTS {
                let outcome = run(&mesh, &Options { metric, placement, ..keeping() }, Budget::keep(0.05));
                assert_eq!(outcome.stop, StopReason::FacesReached, "{metric:?} {placement:?}: {:?}", outcome.blocked);
                let turned = rows(&outcome.mesh).iter().filter(|uv| area(uv) * side < 0.0).count();
                assert_eq!(turned, 0, "{metric:?} {placement:?}");
            }
        }
    }
}

/// Where most of what would be contracted is refused once, so that the filter is seen to work: without it, faces turn.
#[test]
fn what_would_fold_is_refused_and_counted() {
    // Squeezed to one side, where the texture's triangles are thin and turn at a touch.
    let mut mesh = terrain(20_000);
    mesh.texcoords.iter_mut().flatten().flatten().for_each(|uv| uv.x = (uv.x + 0.02 * (40.0 * uv.y).sin()).powi(5));
    assert_eq!(folds(&mesh), 0);
    let outcome = run(&mesh, &Options { placement: Placement::Endpoint, ..keeping() }, Budget::keep(0.02));
    assert!(outcome.rounds.iter().map(|round| round.blocked.texture).sum::<u64>() > 0);
    assert_eq!(folds(&outcome.mesh), 0);

    // Coordinates at random fold everywhere: no face may turn over, whichever way it lies, and what would is told.
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let mut mesh = shapes::torus(12, 8);
    let of_vertex: Vec<Vec2> = mesh.positions.iter().map(|_| Vec2::new(random(), random())).collect();
    mesh.texcoords = Some(mesh.faces.iter().map(|face| face.map(|v| of_vertex[v as usize])).collect());
    let outcome = run(&mesh, &keeping(), Budget::keep(0.5));
    assert!(outcome.rounds.iter().map(|round| round.blocked.texture).sum::<u64>() > 0);
    assert!(folds(&mesh) > 50 && folds(&outcome.mesh) <= folds(&mesh), "{}", folds(&outcome.mesh));
}

/// Seams contract along themselves, both sides together: two loops that cross once, as before, and all of the texture.
#[test]
fn seams_stay_closed_and_keep_their_coordinates() {
    let mesh = wrapped_torus();
    assert_eq!(seam_ends(&mesh).len(), 48 + 24 - 1);
    for options in [keeping(), Options { metric: Metric::Plane, ..keeping() }, Options { fit: 2, ..keeping() }] {
        let outcome = run(&mesh, &options, Budget::keep(0.2));
        assert_eq!(outcome.stop, StopReason::FacesReached);
        let seams = seam_ends(&outcome.mesh).len();
        assert!((8..48 + 24 - 1).contains(&seams), "{:?}: {seams} vertices on seams", options.metric);
        assert_eq!((folds(&outcome.mesh), seam_degrees(&outcome.mesh)), (0, vec![(2, seams - 1), (4, 1)]));
        let found = texture_deviation(&mesh, &outcome.mesh, TEXELS).expect("valid meshes").expect("textures");
        assert!(found.covered > 0.99, "{found:?}");
        assert!(found.deviation.rms < 0.01 * mesh.diagonal(), "{found:?}");
    }
}

#[test]
fn locked_seams_stay() {
    let mesh = wrapped_torus();
    let seams = seam_ends(&mesh);
    let attributes = Attributes { lock_seams: true, ..Attributes::default() };
    let locking = Options { attributes, ..keeping() };
    for options in
        [locking.clone(), Options { metric: Metric::Plane, ..locking.clone() }, Options { fit: 2, ..locking.clone() }]
    {
        let outcome = run(&mesh, &options, Budget::keep(0.2));
        assert_eq!((outcome.stop, seam_ends(&outcome.mesh)), (StopReason::FacesReached, seams.clone()));
    }
    // Asked for more than seams leave, a run is stuck at them.
    let stuck = run(&mesh, &locking, Budget::faces(4));
    assert_eq!((stuck.stop, seam_ends(&stuck.mesh)), (StopReason::Stuck, seams));
    assert!(stuck.blocked.seam > 0 && stuck.blocked.lock == 0, "{:?}", stuck.blocked);
}

/// How many vertices have how many edges of seams.
fn seam_degrees(mesh: &Mesh) -> Vec<(usize, usize)> {
    let mut sides = std::collections::BTreeMap::<[u32; 2], Vec<[[u32; 2]; 2]>>::new();
    for (face, uv) in mesh.faces.iter().zip(rows(mesh)) {
        for k in 0..3 {
            let (a, b) = ((face[k], uv[k]), (face[(k + 1) % 3], uv[(k + 1) % 3]));
            let (low, high) = if a.0 < b.0 { (a, b) } else { (b, a) };
            let bits = [low.1, high.1].map(|uv| uv.to_array().map(f32::to_bits));
            sides.entry([low.0, high.0]).or_default().push(bits);
        }
    }
    let mut degrees = std::collections::BTreeMap::<u32, usize>::new();
    for (ends, uses) in sides.iter().filter(|(_, uses)| uses.iter().any(|uv| *uv != uses[0])) {
        assert_eq!(uses.len(), 2);
        ends.iter().for_each(|&v| *degrees.entry(v).or_default() += 1);
    }
    let mut counts = std::collections::BTreeMap::<usize, usize>::new();
    degrees.values().for_each(|&degree| *counts.entry(degree).or_default() += 1);
    counts.into_iter().collect()
}

/// The input's coordinates at the input's vertices, when nothing else is allowed.
#[test]
fn ends_keep_their_coordinates() {
    let mesh = terrain(10_000);
    let outcome = run(&mesh, &Options { placement: Placement::Endpoint, ..keeping() }, Budget::keep(0.1));
    let mut of_vertex = vec![Vec2::NAN; mesh.positions.len()];
    for (face, uv) in mesh.faces.iter().zip(rows(&mesh)) {
        face.iter().zip(uv).for_each(|(&v, &uv)| of_vertex[v as usize] = uv);
    }
    for (face, uv) in outcome.mesh.faces.iter().zip(rows(&outcome.mesh)) {
        for (&v, uv) in face.iter().zip(uv) {
            assert_eq!(*uv, of_vertex[outcome.vertex_origin[v as usize] as usize]);
        }
    }
}

/// Coordinates stay in the square where they are in it, and outside where they are outside.
#[test]
fn tiles_are_left_alone() {
    let inside = terrain(10_000);
    let outcome = run(&inside, &keeping(), Budget::keep(0.05));
    assert!(rows(&outcome.mesh).iter().flatten().all(|uv| uv.min_element() >= 0.0 && uv.max_element() <= 1.0));
    let mut tiled = inside;
    tiled.texcoords.iter_mut().flatten().flatten().for_each(|uv| *uv = *uv * 8.0 - 4.0);
    let outcome = run(&tiled, &keeping(), Budget::keep(0.05));
    let far = rows(&outcome.mesh).iter().flatten().filter(|uv| uv.abs().max_element() > 3.9).count();
    assert!(far > 0);
}

#[test]
fn threads_and_devices_give_the_same_bytes() {
    // Large enough for patches that the border between halves cuts.
    for (mesh, metrics) in [(wrapped_torus(), &METRICS[..]), (terrain(80_000), &METRICS[..1])] {
        for &metric in metrics {
            let options = Options { metric, ..keeping() };
            let reference = run_on(&cpu(1), &mesh, &options, Budget::keep(0.2));
            let devices = [2, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default()));
            for device in devices {
                let outcome = run_on(&device, &mesh, &options, Budget::keep(0.2));
                assert!(bytes(&outcome.mesh) == bytes(&reference.mesh), "{metric:?}, {}", device.description());
            }
        }
    }
}

/// Two wavy strips with charts of their own, along a slit: where they meet is a seam with both charts' coordinates.
#[test]
fn joined_parts_keep_their_charts() {
    let (first, second) = (|p: DVec3| [p.x / 40.0, p.y / 40.0], |p: DVec3| [p.x / 40.0, p.y / 40.0 - 2.0]);
    let strip = shapes::plane(20, 10);
    let mut other = strip.clone();
    other.positions.iter_mut().for_each(|p| p.y += 10.0 + 1e-3);
    let (mut mesh, other) = (textured(strip, first), textured(other, second));
    let count = mesh.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.faces.extend(other.faces.iter().map(|face| face.map(|v| v + count)));
    mesh.texcoords.as_mut().expect("texture").extend(rows(&other));
    mesh.positions.iter_mut().for_each(|p| p.z = (0.9 * p.x).sin() * (0.7 * p.y).cos());
    let outcome = run(&mesh, &Options { join_within: 2e-3, ..keeping() }, Budget::faces(100));
    assert_eq!(support::independent::topology(&outcome.mesh).components, 1);
    let mut charts = [0, 0];
    for (face, uv) in outcome.mesh.faces.iter().zip(rows(&outcome.mesh)) {
        let fits = |map: &dyn Fn(DVec3) -> [f64; 2]| {
            face.iter().zip(uv).all(|(&v, uv)| {
                let expected = Vec2::from(map(outcome.mesh.positions[v as usize]).map(|x| x as f32));
                uv.distance(expected) < 0.1
            })
        };
        let fitting = [fits(&first), fits(&second)];
        assert!(fitting[0] != fitting[1], "{uv:?}");
        charts[usize::from(fitting[1])] += 1;
    }
    assert!(charts[0] > 10 && charts[1] > 10, "{charts:?}");
    // Where they meet, vertices have coordinates in both.
    let mut seen = std::collections::BTreeMap::<u32, Vec<Vec2>>::new();
    for (face, uv) in outcome.mesh.faces.iter().zip(rows(&outcome.mesh)) {
        face.iter().zip(uv).for_each(|(&v, &uv)| seen.entry(v).or_default().push(uv));
    }
    let both = seen.values().filter(|uvs| uvs.iter().any(|uv| uv.y > -0.5) && uvs.iter().any(|uv| uv.y < -0.5)).count();
    assert!(both > 2, "{both} vertices");
}

#[test]
fn a_log_holds_no_texture() {
    let mesh = terrain(2_000);
    let outcome = run(&mesh, &Options { log: true, ..keeping() }, Budget::keep(0.5));
    assert!(outcome.mesh.texcoords.is_none() && outcome.log.is_some());
    assert!(outcome.warnings.iter().any(|warning| warning.starts_with("a log holds")), "{:?}", outcome.warnings);
}

/// The real meshes with texture coordinates: no more folds than there were, and the texture near where it was.
#[test]
fn real_textures_follow_the_surface() {
    for name in ["attributes/spot/spot.obj", "attributes/pirate.obj", "open/pizza.obj", "papers/feline.obj"] {
        let Some(path) = models::model(name) else { continue };
        let mesh = weld(&formats::read(&path).expect("a mesh"), 0.0).mesh;
        for share in [0.8, 0.6] {
            let outcome = run(&mesh, &keeping(), Budget::keep(share));
            assert!(folds(&outcome.mesh) <= folds(&mesh), "{name} {share}: {} folds", folds(&outcome.mesh));
            let found = texture_deviation(&mesh, &outcome.mesh, TEXELS).expect("valid meshes").expect("textures");
            let diagonal = mesh.diagonal();
            let [max, rms] = [found.deviation.max, found.deviation.rms].map(|length| length / diagonal);
            println!("{name} {share}: {:?}, texture {max:.2e} {rms:.2e} on {:.3}", outcome.stop, found.covered);
            assert!(rms < 2e-3 && found.covered > 0.97, "{name} {share}: {rms:.1e} {}", found.covered);
        }
    }
}

/// A truck whose halves share a texture, mirrored: its seams yield until it has as few faces as asked for.
#[test]
fn mirrored_halves_do_not_hold_each_other() {
    let Some(path) = models::model("attributes/milk_truck.glb") else { return };
    let mesh = formats::read(&path).expect("a mesh");
    let outcome = run(&mesh, &keeping(), Budget::faces(192));
    assert!((187..=192).contains(&outcome.mesh.faces.len()), "{:?}: {}", outcome.stop, outcome.mesh.faces.len());
    assert!(outcome.mesh.area() > 0.8 * mesh.area(), "{} of {}", outcome.mesh.area(), mesh.area());
}
