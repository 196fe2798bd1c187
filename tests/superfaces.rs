//! Superfaces of rooms with light: what every result keeps, how faces fall with the tolerances, and the same bytes everywhere.
#![expect(clippy::print_stdout, reason = "tests print what a reader of a failure needs")]

mod support;

use std::collections::{BTreeMap, BTreeSet};

use coarsen::backend::GpuOptions;
use coarsen::math::DVec3;
use coarsen::mesh::sample;
use coarsen::metrics::{self, deviation};
use coarsen::papers::light::{PAIRS, curves, superfaces};
use coarsen::partition::superface::{self, Criterion};
use coarsen::partition::{By, Flatness, Options, Superfaces};
use coarsen::simplify::MOVED;
use coarsen::{Budget, Device, Mesh, Method, Outcome, StopReason, simplify};
use support::deviation::Random;
use support::engine::{assert_kept, bytes, cpu, gpu};
use support::independent::topology;
use support::shapes::{grid, torus};

/// Fitting brings the light nearer on the whole.
#[test]
fn fitted_colors_are_nearer_on_average() {
    for name in SCENES {
        let scene = scene(name, FACES);
        let mean = |fits_light| {
            let outcome = run_with(&scene, [f64::INFINITY, 2.0], fits_light);
            let measured = deviation(&scene, &outcome.mesh, &metrics::Options::default(), &cpu(2)).expect("a measure");
            255.0 * measured.forward.colors.expect("colors").rgb.mean
        };
        let [kept, fitted] = [false, true].map(mean);
        println!("{name}: {kept:.3} of 255 as they are, {fitted:.3} fitted");
        assert!(fitted < 0.95 * kept, "{name}: {fitted} of {kept}");
    }
}

/// With the defaults but for δ and whether vertices slide.
fn run_default(device: &Device, scene: &Mesh, border_color: f64, slides: bool) -> Outcome {
    let options = Options::superfaces(Superfaces { border_color, slides, ..Superfaces::default() });
    simplify(scene, &Method::Partition(options), &Budget::default(), device, None).expect("a scene with light")
}

/// Differences fall as faces rise: by so much the light is nearer with as many.
fn at_as_many_faces(kept: (f64, usize), slid: (f64, usize)) -> f64 {
    slid.0 * slid.1 as f64 / (kept.0 * kept.1 as f64)
}

/// Where no vertex goes, neither colors nor places change: on rough ground beside a flat wall.
#[test]
fn what_loses_nothing_stays_as_it_is() {
    const SIDE: u32 = 24;
    let mut mesh = grid(SIDE, SIDE);
    let mut random = Random(7);
    let mut light = vec![[0.5; 4]; mesh.positions.len()];
    for (p, row) in mesh.positions.iter_mut().zip(&mut light).filter(|(p, _)| p.x >= f64::from(SIDE / 2)) {
        p.z = random.unit();
        *row = [(); 4].map(|()| random.unit() as f32);
    }
    let scene = Mesh { colors: Some(light), ..mesh.clone() };
    let outcome = run_default(&cpu(1), &scene, 0.5, true);
    assert!(outcome.mesh.faces.len() < mesh.faces.len() * 3 / 4, "{} faces are left", outcome.mesh.faces.len());
    let colors = outcome.mesh.colors.as_ref().expect("colors");
    let before = scene.colors.as_ref().expect("colors");
    let kept: BTreeSet<u32> = outcome.vertex_origin.iter().copied().collect();
    let lost = |&v: &u32| !kept.contains(&v);
    let lost: Vec<DVec3> = (0..before.len() as u32).filter(lost).map(|v| mesh.positions[v as usize]).collect();
    let is_far = |p: DVec3| lost.iter().all(|&other| (p - other).abs().max_element() > 3.0);
    let far = (0..colors.len()).filter(|&v| is_far(outcome.mesh.positions[v]));
    let stays = |v: &usize| {
        kept.contains(&outcome.vertex_origin[*v]) && colors[*v] == before[outcome.vertex_origin[*v] as usize]
    };
    let [all, same] = [far.clone().count(), far.filter(stays).count()];
    assert!(all > (SIDE * SIDE / 8) as usize && same == all, "{same} of {all}");
}

/// Sliding brings the light nearer, with no more faces, and neither changes the shape nor lays faces on each other.
#[test]
fn sliding_vertices_bring_the_light_nearer() {
    for (name, border_color) in SCENES.into_iter().flat_map(|name| [0.5, 4.0].map(|delta| (name, delta))) {
        let scene = scene(name, FACES);
        let [kept, slid] = [false, true].map(|slides| run_default(&cpu(2), &scene, border_color, slides));
        let [were, are] = [&kept, &slid].map(|outcome| outcome.mesh.faces.len());
        assert!(are <= were, "{name}: {are} faces of {were}");
        assert_kept(name, &scene, &slid);
        let mean = |outcome: &Outcome| {
            let measured = deviation(&scene, &outcome.mesh, &metrics::Options::default(), &cpu(2)).expect("a measure");
            assert!(measured.symmetric().max < 1e-9 * measured.diagonal, "{name}: the walls stay where they are");
            255.0 * measured.forward.colors.expect("colors").rgb.mean
        };
        let [before, after] = [mean(&kept), mean(&slid)];
        let moved = slid.vertex_origin.iter().filter(|&&origin| origin == MOVED).count();
        let share = at_as_many_faces((before, were), (after, are));
        println!(
            "{name} at {border_color}: {before:.3} in {were} faces, {after:.3} in {are}: {share:.3}, {moved} moved"
        );
        // Where few vertices are left there is most to gain.
        let most = if border_color < 1.0 { 0.93 } else { 0.85 };
        assert!(share < most && moved * 3 > slid.mesh.positions.len(), "{name}: {share}, {moved}");
        let (is, was) = (slid.mesh.area(), scene.area());
        assert!((is / was - 1.0).abs() < 1e-9, "{name}: area {is} of {was}: faces lie on each other");
        for (v, &origin) in slid.vertex_origin.iter().enumerate().filter(|(_, origin)| **origin != MOVED) {
            assert_eq!(slid.mesh.positions[v], scene.positions[origin as usize], "{name}: the place of {origin}");
        }
    }
}

/// A color is no farther from the light where its vertex came to stand than colors may be moved.
#[test]
fn slid_colors_are_near_the_light_at_their_places() {
    let (scene, delta) = (scene("room", 5000), 2.0);
    let slid = run_default(&cpu(2), &scene, delta, true);
    let (rows, light) = (slid.mesh.colors.expect("colors"), scene.colors.as_ref().expect("light"));
    let most = delta / 255.0 + 1e-6;
    for (p, row) in slid.mesh.positions.iter().zip(&rows) {
        let is_near = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| scene.positions[v as usize]);
            let normal = (b - a).cross(c - a);
            let share = |from: DVec3, to: DVec3| (to - from).cross(*p - from).dot(normal) / normal.length_squared();
            let shares = [share(b, c), share(c, a), share(a, b)];
            let is_on =
                (*p - a).dot(normal).abs() < 1e-7 * normal.length() && shares.iter().all(|&share| share > -1e-7);
            let colors = face.map(|v| light[v as usize]);
            let there = |k: usize| (0..3).map(|i| shares[i] * f64::from(colors[i][k])).sum::<f64>();
            is_on && (0..3).all(|k| (f64::from(row[k]) - there(k)).abs() <= most)
        };
        assert!(scene.faces.iter().any(is_near), "{p} has {row:?}");
    }
}

/// The edge of a shadow across a plane, aslant and between its vertices: those of the result come to it.
#[test]
fn vertices_slide_to_the_edge_of_a_shadow() {
    let mut plane = grid(24, 24);
    let (low, high) = plane.bounds();
    let light = |p: &DVec3| {
        let at = (*p - low) / (high - low).max(DVec3::splat(f64::MIN_POSITIVE));
        let depth = (at.x + 0.37 * at.y - 0.63).clamp(0.0, 0.3);
        [0.2 + 2.0 * depth as f32, 0.5, 0.5, 1.0]
    };
    plane.colors = Some(plane.positions.iter().map(light).collect());
    let mean = |slides| {
        let outcome = run_default(&cpu(1), &plane, 2.0, slides);
        let measured = deviation(&plane, &outcome.mesh, &metrics::Options::default(), &cpu(1)).expect("a measure");
        (255.0 * measured.forward.colors.expect("colors").rgb.mean, outcome.mesh.faces.len())
    };
    let [kept, slid] = [false, true].map(mean);
    println!("{kept:.3?} of 255 and faces with the input's vertices, {slid:.3?} with those that slid");
    assert!(at_as_many_faces(kept, slid) < 0.8 && slid.1 < kept.1, "{slid:?} of {kept:?}");
}

#[test]
fn slid_vertices_are_the_same_everywhere() {
    let on_gpu = gpu(&GpuOptions::default());
    for name in SCENES {
        let scene = scene(name, FACES);
        let known = bytes(&run_default(&cpu(1), &scene, 1.0, true).mesh);
        for device in [cpu(2), cpu(3)].iter().chain(&on_gpu) {
            let outcome = run_default(device, &scene, 1.0, true);
            assert!(bytes(&outcome.mesh) == known, "{name} by {}", device.description());
        }
        assert!(bytes(&run_default(&cpu(2), &scene, 1.0, false).mesh) != known, "{name}: nothing slid");
    }
}

/// Small enough for seconds, large enough for shadows with edges.
const SCENES: [&str; 2] = ["room", "office"];
const FACES: usize = 20_000;

fn scene(name: &str, faces: usize) -> Mesh {
    sample(name, Some(faces)).expect("a sample")
}

fn run_on(device: &Device, scene: &Mesh, pair: [f64; 2]) -> Outcome {
    simplify(scene, &superfaces(pair), &Budget::default(), device, None).expect("a scene with light")
}

/// With colors of vertices as they are, or fitted.
fn run_with(scene: &Mesh, pair: [f64; 2], fits_light: bool) -> Outcome {
    run_changed(scene, pair, |superfaces| superfaces.fits_light = fits_light)
}

fn run_changed(scene: &Mesh, pair: [f64; 2], change: impl FnOnce(&mut Superfaces)) -> Outcome {
    let Method::Partition(mut options) = superfaces(pair) else { panic!("another method") };
    if let By::Superfaces(superfaces) = &mut options.by {
        change(superfaces);
    }
    simplify(scene, &Method::Partition(options), &Budget::default(), &cpu(2), None).expect("a scene with light")
}

fn run(scene: &Mesh, pair: [f64; 2]) -> Outcome {
    run_on(&cpu(2), scene, pair)
}

/// Every vertex lies within the limit of the plane that its superface is drawn in, and of what takes the place of its borders.
#[test]
fn bent_superfaces_keep_to_an_error_limit() {
    let ring = torus(120, 60);
    let lit = Mesh { colors: Some(vec![[0.5, 0.5, 0.5, 1.0]; ring.positions.len()]), ..ring };
    let guard = Flatness { angle_rad: 20_f64.to_radians(), distance: 1e-3 };
    let regions = superface::Options { guard, ..superface::Options::default() };
    let method = Method::Partition(Options::superfaces(Superfaces { regions, ..Superfaces::default() }));
    for share in [0.0005, 0.001, 0.002, 0.005, 0.01] {
        let outcome = simplify(&lit, &method, &Budget::error(share), &cpu(2), None).expect("a mesh with light");
        let (estimate, limit) = (outcome.error_estimate, share * lit.diagonal());
        println!("{} faces, {estimate:.5} of {limit:.5}", outcome.mesh.faces.len());
        assert!(
            estimate <= limit * (1.0 + 1e-9) && outcome.mesh.faces.len() < lit.faces.len(),
            "{share}: {estimate} of {limit}"
        );
        assert_kept(&format!("{share}"), &lit, &outcome);
    }
}

#[test]
fn faces_fall_with_either_tolerance() {
    for name in SCENES {
        for (curve, over) in curves(&scene(name, FACES), &cpu(2)).expect("curves").into_iter().zip(["ε", "δ"]) {
            println!("{name}, faces over {over}: {:?}, rise {:.4}", curve.faces, curve.rise());
            assert!(curve.is_held(), "{name}: faces over {over} rise: {curve:?}");
            let (first, last) = (curve.faces[0], curve.faces[curve.faces.len() - 1]);
            assert!(4 * last < 3 * first, "{name}: faces over {over} hardly fall: {curve:?}");
        }
    }
}

/// Shadows stay where the paper's first pictures show them.
#[test]
fn colors_are_within_the_tolerance_on_average() {
    for name in SCENES {
        let scene = scene(name, FACES);
        let color = |pair| {
            let outcome = run(&scene, pair);
            let measured = deviation(&scene, &outcome.mesh, &metrics::Options::default(), &cpu(2)).expect("a measure");
            assert!(measured.symmetric().max < 1e-9 * measured.diagonal, "{name}: the walls stay where they are");
            255.0 * measured.forward.colors.expect("colors").rgb.mean
        };
        let [tight, loose] = [PAIRS[0], PAIRS[1]].map(color);
        println!("{name}: {tight:.3} of 255 at the first pair, {loose:.3} at the loosest");
        assert!(tight <= PAIRS[0][1], "{name}: {tight}");
        assert!(tight < loose, "{name}: {tight} and {loose}");
    }
}

/// The result's vertices are the input's, with their colors unless these are fitted, the topology is kept, so that both sides of a
/// border have the same vertices, and the area is that of the input.
#[test]
fn scenes_are_kept() {
    for (name, pair) in SCENES.into_iter().flat_map(|name| PAIRS.map(|pair| (name, pair))) {
        let (scene, name) = (scene(name, FACES), format!("{name} {pair:?}"));
        let outcome = run(&scene, pair);
        assert_kept(&name, &scene, &outcome);
        assert_eq!((outcome.stop, topology(&outcome.mesh).border_loops), (StopReason::RegionsRebuilt, 0), "{name}");
        let exact = run_with(&scene, pair, false);
        assert_eq!(exact.mesh.faces, outcome.mesh.faces, "{name}: colors decide no face");
        let colors = |mesh: &Mesh| mesh.colors.clone().expect("colors at vertices");
        let [before, kept, moved] = [&scene, &exact.mesh, &outcome.mesh].map(colors);
        for (v, &origin) in outcome.vertex_origin.iter().enumerate() {
            let origin = origin as usize;
            assert_eq!(outcome.mesh.positions[v], scene.positions[origin], "{name}: the place of {origin}");
            assert_eq!(kept[v].map(f32::to_bits), before[origin].map(f32::to_bits), "{name}: the color of {origin}");
            let most = (pair[1] / 255.0) as f32 + 1e-6;
            let is_near = (0..4).all(|k| (moved[v][k] - before[origin][k]).abs() <= most && moved[v][k] >= 0.0);
            assert!(is_near, "{name}: {:?} for {:?}", moved[v], before[origin]);
        }
        let (is, was) = (outcome.mesh.area(), scene.area());
        assert!((is / was - 1.0).abs() < 1e-9, "{name}: area {is} of {was}");
    }
}

/// A region as its triangles: how many corners its outline has, along how many loops, and whether vertices lie inside.
struct Outline {
    corners: usize,
    loops: usize,
    has_inner: bool,
    /// Whether the outline touches itself.
    is_pinched: bool,
}

fn outline(faces: &[[u32; 3]]) -> Outline {
    let sides: Vec<[u32; 2]> = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    let inside: BTreeSet<[u32; 2]> = sides.iter().copied().collect();
    let mut next = BTreeMap::new();
    let mut corners = 0;
    for [a, b] in sides.into_iter().filter(|&[a, b]| !inside.contains(&[b, a])) {
        next.insert(a, b);
        corners += 1;
    }
    let is_pinched = next.len() < corners;
    let has_inner = faces.iter().flatten().any(|v| !next.contains_key(v));
    let mut loops = 0;
    while let Some((&start, _)) = next.first_key_value() {
        let mut at = start;
        while let Some(to) = next.remove(&at) {
            at = to;
        }
        loops += 1;
    }
    Outline { corners, loops, has_inner, is_pinched }
}

/// k corners and h holes make k + 2h − 2 triangles.
#[test]
fn outlines_have_the_triangles_that_they_must() {
    for name in SCENES {
        // Any light inside, so that nothing comes back there, and spots of light that are holes in what is around them.
        let any = |superfaces: &mut Superfaces| {
            superfaces.inner_color = Some(f64::INFINITY);
            superfaces.regions.criterion = Criterion::Contrast { epsilon: PAIRS[1][0], range_cap: 0.25 };
        };
        let outcome = run_changed(&scene(name, FACES), PAIRS[1], any);
        let regions = outcome.regions.as_ref().expect("regions");
        let mut of_region = vec![Vec::new(); regions.count];
        for (face, &label) in outcome.mesh.faces.iter().zip(&regions.face_labels) {
            of_region[label as usize].push(*face);
        }
        let (mut plain, mut holed) = (0, 0);
        for faces in &of_region {
            let Outline { corners, loops, has_inner, is_pinched } = outline(faces);
            if !has_inner && !is_pinched {
                assert_eq!(faces.len(), corners + 2 * (loops - 1) - 2, "{name}: {faces:?}");
                plain += 1;
                holed += usize::from(loops > 1);
            }
        }
        println!("{name}: {plain} of {} superfaces, {holed} of them with holes", regions.count);
        assert!(plain > regions.count / 2 && holed > 0, "{name}: {plain} of {}, {holed}", regions.count);
    }
}

#[test]
fn bytes_are_the_same_everywhere() {
    let on_gpu = gpu(&GpuOptions::default());
    for (name, pair) in SCENES.into_iter().zip([PAIRS[0], PAIRS[3]]) {
        let scene = scene(name, FACES);
        let known = run_on(&cpu(1), &scene, pair);
        for device in [cpu(2), cpu(3)].iter().chain(&on_gpu) {
            let outcome = run_on(device, &scene, pair);
            assert!(bytes(&outcome.mesh) == bytes(&known.mesh), "{name} by {}", device.description());
            assert_eq!(outcome.regions, known.regions, "{name} by {}", device.description());
        }
        if let Some(device) = &on_gpu {
            // The kernels of light and of chains, each with what it reads.
            let moved = run_on(device, &scene, pair).bytes_moved;
            assert!(moved > 50 * scene.faces.len() as u64, "{name}: {moved} bytes moved: nothing ran on the device");
        }
    }
}

/// Another pair gives other bytes, so that comparing them can fail.
#[test]
fn tolerances_matter() {
    let room = scene("room", 5000);
    assert!(bytes(&run(&room, PAIRS[0]).mesh) != bytes(&run(&room, PAIRS[2]).mesh));
}
