//! What holds for superfaces of any mesh and light.

use super::*;
use crate::backend::{Device, Selector};
use crate::mesh::dual::NONE;
use crate::mesh::samples::sample;
use crate::mesh::shapes;

/// On the range of light: a quarter.
const CAP: f64 = 0.25;

fn contrast(epsilon: f64) -> Options {
    Options { criterion: Criterion::Contrast { epsilon, range_cap: CAP }, ..Options::default() }
}

fn paper(epsilon: f64, area_unit: f64) -> Options {
    Options { criterion: Criterion::Paper { epsilon, area_unit }, ..Options::default() }
}

fn surface(mesh: &Mesh) -> Surface {
    Surface::new(mesh, Some(0.0)).expect("a valid mesh")
}

fn queue() -> Queue {
    Device::cpu(1).expect("the CPU").cpu_queue()
}

fn superfaces(mesh: &Mesh, options: Options) -> Grown {
    let surface = surface(mesh);
    let found = partition(&surface, mesh, options, &mut queue()).expect("superfaces");
    assert_eq!(found.partition.validate(&surface.neighbors), []);
    assert_eq!([found.planes.len(), found.lights.len()], [found.partition.region_count; 2]);
    found
}

fn room(faces: usize) -> Mesh {
    sample("room", Some(faces)).expect("a sample")
}

fn with_light(mesh: Mesh, light: impl Fn([f32; 4]) -> [f32; 4]) -> Mesh {
    Mesh { face_colors: mesh.face_colors.as_ref().map(|rows| rows.iter().map(|&row| light(row)).collect()), ..mesh }
}

fn lit_evenly(mesh: Mesh) -> Mesh {
    Mesh { face_colors: Some(vec![[0.3, 0.2, 0.1, 1.0]; mesh.faces.len()]), ..mesh }
}

/// C of every face of a room.
fn changes_of(mesh: &Mesh, criterion: Criterion) -> Vec<[f32; 4]> {
    let surface = surface(mesh);
    let lights = Lights::new(&surface, mesh, criterion.area_unit()).expect("light");
    changes(&surface, &lights, criterion, &mut queue()).expect("changes")
}

#[test]
fn brighter_lamps_change_nothing() {
    let mesh = room(3000);
    for options in [contrast(0.1), paper(0.5, 0.01)] {
        let brighter = with_light(mesh.clone(), |row| row.map(|x| x * 4.0));
        assert_eq!(changes_of(&mesh, options.criterion), changes_of(&brighter, options.criterion));
        assert_eq!(superfaces(&mesh, options).partition, superfaces(&brighter, options).partition);
    }
}

#[test]
fn changes_go_with_one_over_the_area_in_the_papers_criterion() {
    let (mesh, [near, far]) = (room(3000), [1.0, 4.0].map(|unit| paper(0.1, unit).criterion));
    let scaled = Mesh { positions: mesh.positions.iter().map(|&p| p * 2.0).collect(), ..mesh.clone() };
    // Twice the length is four times the area; so is a quarter of the unit.
    let quarter = |rows: Vec<[f32; 4]>| rows.into_iter().map(|row| row.map(|x| x / 4.0)).collect::<Vec<_>>();
    assert_eq!(changes_of(&scaled, near), quarter(changes_of(&mesh, near)));
    assert_eq!(changes_of(&mesh, near), quarter(changes_of(&mesh, far)));
    assert_eq!(superfaces(&mesh, paper(0.5, 1.0)).partition, superfaces(&scaled, paper(0.5, 4.0)).partition);
}

#[test]
fn contrast_has_no_unit() {
    let mesh = room(3000);
    for scale in [1e-3, 0.5, 1e4] {
        let scaled = Mesh { positions: mesh.positions.iter().map(|&p| p * scale).collect(), ..mesh.clone() };
        assert_eq!(changes_of(&mesh, Criterion::default()), changes_of(&scaled, Criterion::default()));
        assert_eq!(
            superfaces(&mesh, contrast(0.1)).partition.labels,
            superfaces(&scaled, contrast(0.1)).partition.labels
        );
    }
}

#[test]
fn nothing_merges_at_zero() {
    for options in [contrast(0.0), paper(0.0, 1.0)] {
        let mesh = room(2000);
        assert_eq!(superfaces(&mesh, options).partition.region_count, mesh.faces.len());
    }
}

#[test]
fn even_light_leaves_the_flats() {
    let sides = |mesh: Mesh| superfaces(&lit_evenly(mesh), contrast(0.01)).partition.region_count;
    assert_eq!(sides(shapes::cube(6)), 6);
    assert_eq!(sides(shapes::double_torus()), 6 + 8);
    // A room and what stands in it: six sides each.
    assert_eq!(sides(room(4000)) % 6, 0);
    assert_eq!(sides(room(4000)), sides(room(2000)));
}

#[test]
fn every_superface_is_lit_alike_and_flat() {
    for options in [contrast(0.06), contrast(0.8)] {
        let mesh = room(12_000);
        let found = superfaces(&mesh, options);
        let surface = surface(&mesh);
        let lights = Lights::new(&surface, &mesh, None).expect("light");
        let mut ranges = vec![([f32::MAX; 3], [0.0_f32; 3]); found.partition.region_count];
        for (face, &label) in found.partition.labels.iter().enumerate() {
            let plane = found.planes[label as usize].expect("a plane");
            for v in surface.faces[face] {
                assert!(plane.height(surface.points[v as usize]).abs() <= options.guard.distance * surface.diagonal);
            }
            let (least, greatest) = &mut ranges[label as usize];
            for k in 0..3 {
                least[k] = least[k].min(lights.rows[face][k]);
                greatest[k] = greatest[k].max(lights.rows[face][k]);
            }
        }
        for ((least, greatest), light) in ranges.into_iter().zip(&found.lights) {
            for k in 0..3 {
                let range = greatest[k] - least[k];
                assert!(range <= 0.2501 * greatest[k].max(lights.floor), "{range} of {}", greatest[k]);
                assert!((f64::from(least[k]) - 1e-6..=f64::from(greatest[k]) + 1e-6).contains(&light[k]));
            }
        }
    }
}

/// Of the scenes that stand for the paper's, along its range of ε.
#[test]
fn superfaces_do_not_grow_in_number_with_the_step() {
    for name in ["room", "office"] {
        let mesh = sample(name, Some(20_000)).expect("a sample");
        let mut last = f64::INFINITY;
        for epsilon in [0.02, 0.04, 0.06, 0.1, 0.2, 0.4, 0.8] {
            let count = superfaces(&mesh, contrast(epsilon)).partition.region_count as f64;
            assert!(count <= 1.02 * last, "{name}: {count} at {epsilon} after {last}");
            last = count;
        }
        assert!(last < 20_000.0 / 15.0, "{name}: {last} superfaces at the loosest");
    }
}

/// By default light does not divide what is flat.
#[test]
fn any_light_joins_without_a_step() {
    let mesh = room(4000);
    let sides = superfaces(&lit_evenly(mesh.clone()), contrast(0.01)).partition;
    assert_eq!(superfaces(&mesh, Options::default()).partition, sides);
}

#[test]
fn bent_surfaces_merge_within_their_guard() {
    let mesh = lit_evenly(shapes::icosphere(4));
    let count = |guard| superfaces(&mesh, Options { guard, ..contrast(0.1) }).partition.region_count;
    assert_eq!(count(Options::FLAT), mesh.faces.len());
    let bent = count(Flatness { distance: 0.01, ..Options::BENT });
    assert!(bent < mesh.faces.len() / 10 && bent > 20, "{bent} superfaces");
}

#[test]
fn a_mesh_without_light_is_an_error_and_so_are_poor_options() {
    let dark = shapes::cube(2);
    let error = partition(&surface(&dark), &dark, Options::default(), &mut queue()).expect_err("no light");
    assert!(error.to_string().contains("superfaces need colors"), "{error}");
    let mesh = lit_evenly(dark);
    let bad_cap = Criterion::Contrast { epsilon: 0.1, range_cap: 1.5 };
    for options in
        [contrast(-0.1), contrast(f64::NAN), paper(0.1, 0.0), Options { criterion: bad_cap, ..Options::default() }]
    {
        let error = partition(&surface(&mesh), &mesh, options, &mut queue()).expect_err("out of range");
        assert!(matches!(error, Error::Parameter(_)), "{error}");
    }
}

/// Triangles that join anyhow, many without area, with any light.
#[test]
fn any_mesh_has_superfaces() {
    let mut state = 7_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for case in 0..60 {
        let vertices = 3 + (random() * 40.0) as usize;
        let mut place = || if case % 3 == 0 { (random() * 3.0).floor() } else { random() * 1e6 - 5e5 };
        let positions = (0..vertices).map(|_| DVec3::new(place(), place(), place())).collect();
        let faces = (0..3 * vertices).map(|_| [(); 3].map(|()| (random() * vertices as f64) as u32)).collect();
        let mut mesh = Mesh::new(positions, faces);
        let mut light = || [0.0, -1.0, 0.5, 7.0, 1e38, f32::INFINITY, random() as f32][(random() * 7.0) as usize];
        mesh.colors = Some((0..vertices).map(|_| [(); 4].map(|()| light())).collect());
        if case % 2 == 0 {
            mesh.face_colors = Some(mesh.faces.iter().map(|_| [(); 4].map(|()| light())).collect());
        }
        let Ok(surface) = Surface::new(&mesh, Some(0.0)) else { continue };
        for options in [contrast(0.1), paper(0.1, 1.0), Options { guard: Options::BENT, ..contrast(0.8) }] {
            let found = partition(&surface, &mesh, options, &mut queue()).expect("superfaces");
            assert_eq!(found.partition.validate(&surface.neighbors), [], "case {case}");
        }
    }
}

/// Three faces at an edge: none merges across it, though all are lit alike.
#[test]
fn superfaces_end_at_walls() {
    let mesh = lit_evenly(shapes::fan3());
    let surface = surface(&mesh);
    assert!(surface.neighbors.as_flattened().iter().all(|&other| other == NONE));
    assert_eq!(superfaces(&mesh, contrast(0.5)).partition.region_count, mesh.faces.len());
}

#[test]
fn threads_and_devices_do_not_show() {
    let mesh = room(8000);
    let surface = surface(&mesh);
    let on = |device: &Device| {
        let mut queue = device.gpu_queue().unwrap_or_else(|| device.cpu_queue());
        device.install(|| partition(&surface, &mesh, contrast(0.1), &mut queue).expect("superfaces"))
    };
    let one = on(&Device::cpu(1).expect("the CPU"));
    let same =
        |other: Grown| (&one.partition, &one.planes, &one.lights) == (&other.partition, &other.planes, &other.lights);
    assert!(same(on(&Device::cpu(3).expect("the CPU"))), "threads show");
    match Device::open(&Selector::Software, 2) {
        Ok(device) => assert!(same(on(&device)), "the device shows"),
        Err(reason) => assert!(std::env::var_os("REQUIRE_GPU").is_none_or(|value| value != "1"), "{reason}"),
    }
}
