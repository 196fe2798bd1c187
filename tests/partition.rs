//! Regions drawn anew: known answers, what every result keeps, and the same bytes everywhere.

mod support;

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use coarsen::backend::GpuOptions;
use coarsen::math::DVec3;
use coarsen::mesh::{Rings, dual, sample, shapes, weld};
use coarsen::metrics::{self, deviation};
use coarsen::partition::{Flatness, NO_REGION, Options, Partition, Triangulation, vsa};
use coarsen::simplify::Progress;
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, StopReason, simplify};
use support::engine::{assert_kept, bytes, cpu, gpu};
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, sphere, torus};

fn run_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Partition(options.clone()), &budget, device, None).expect("a valid mesh and budget")
}

fn run(mesh: &Mesh, options: &Options) -> Outcome {
    run_on(&cpu(1), mesh, options, Budget::default())
}

fn coplanar() -> Options {
    Options::coplanar(Flatness::default())
}

fn variational(regions: usize) -> Options {
    Options::variational(vsa::Goal::Regions(regions))
}

/// Every kind of partition, with both ways to triangulate.
fn kinds() -> Vec<(String, Options)> {
    let by = [("coplanar", coplanar()), ("bent", bent()), ("vsa 40", variational(40)), ("vsa 6", variational(6))];
    let ways = [Triangulation::Earcut, Triangulation::Ears];
    by.into_iter()
        .flat_map(|(name, options)| {
            ways.map(|triangulation| {
                (format!("{name} {triangulation:?}"), Options { triangulation, ..options.clone() })
            })
        })
        .collect()
}

fn bent() -> Options {
    Options::coplanar(Flatness { angle_rad: 0.5, distance: 0.01 })
}

/// The result's vertices are the input's, bit for bit; the topology is kept, and every face of the input has a region that
/// hangs together.
fn assert_rebuilt(name: &str, before: &Mesh, outcome: &Outcome) {
    assert_kept(name, before, outcome);
    assert_eq!(outcome.stop, StopReason::RegionsRebuilt, "{name}");
    for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
        let q = before.positions[origin as usize];
        assert_eq!(p.to_array().map(f64::to_bits), q.to_array().map(f64::to_bits), "{name}: {origin}");
    }
    let regions = outcome.regions.as_ref().expect("regions");
    assert_eq!(regions.face_labels.len(), outcome.mesh.faces.len(), "{name}");
    assert!(regions.face_labels.iter().all(|&label| (label as usize) < regions.count), "{name}");
    assert!(regions.labels.iter().all(|&label| label != NO_REGION), "{name}: a face has no region");
    let welded = weld(before, 0.0);
    let neighbors = dual::neighbors(&welded.mesh.faces, &Rings::new(&welded.mesh.faces, welded.mesh.positions.len()));
    let partition = Partition { labels: regions.labels.clone(), region_count: regions.count };
    assert_eq!(partition.validate(&neighbors), [], "{name}");
}

#[test]
fn a_cube_of_many_faces_becomes_twelve() {
    for n in [1, 2, 7, 30] {
        let cube = cube(n);
        for (name, options) in [("coplanar", coplanar()), ("vsa", variational(6))] {
            for triangulation in [Triangulation::Earcut, Triangulation::Ears] {
                let outcome = run(&cube, &Options { triangulation, ..options.clone() });
                let name = format!("{name} {triangulation:?} of {n}");
                assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (12, 8), "{name}");
                assert_rebuilt(&name, &cube, &outcome);
                assert!((outcome.mesh.volume() - cube.volume()).abs() < 1e-12 * cube.volume(), "{name}");
            }
        }
        assert!(run(&cube, &variational(6)).regions.expect("regions").energies.last().is_some_and(|&e| e < 1e-12));
    }
}

#[test]
fn flats_with_holes_keep_their_holes() {
    let slab = shapes::double_torus();
    for triangulation in [Triangulation::Earcut, Triangulation::Ears] {
        let outcome = run(&slab, &Options { triangulation, ..coplanar() });
        assert_rebuilt("slab", &slab, &outcome);
        // Eight corners and two square holes of eight: V − E + F = −2 with 24 vertices.
        assert_eq!((outcome.mesh.positions.len(), outcome.mesh.faces.len()), (24, 52));
        assert!(
            (outcome.mesh.area() - slab.area()).abs() < 1e-9 && (outcome.mesh.volume() - slab.volume()).abs() < 1e-9
        );
    }
}

/// The edges sharper than 20 degrees are as long together as those of the input.
#[test]
fn sharp_edges_of_a_part_survive() {
    let part = sample("part", Some(20_000)).expect("a sample");
    let outcome = run(&part, &coplanar());
    assert_rebuilt("part", &part, &outcome);
    assert!(outcome.mesh.faces.len() < part.faces.len() / 3, "{} faces", outcome.mesh.faces.len());
    let length = |mesh: &Mesh| -> f64 {
        let mut edges: BTreeMap<[u32; 2], Vec<DVec3>> = BTreeMap::new();
        for &[a, b, c] in &mesh.faces {
            let normal = {
                let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize]);
                (b - a).cross(c - a).normalize()
            };
            for [a, b] in [[a, b], [b, c], [c, a]] {
                edges.entry([a.min(b), a.max(b)]).or_default().push(normal);
            }
        }
        let sharp = |normals: &[DVec3]| normals.len() == 2 && normals[0].dot(normals[1]) < 20_f64.to_radians().cos();
        let long = |[a, b]: [u32; 2]| (mesh.positions[a as usize] - mesh.positions[b as usize]).length();
        edges.into_iter().filter(|(_, normals)| sharp(normals)).map(|(ends, _)| long(ends)).sum()
    };
    let (before, after) = (length(&part), length(&outcome.mesh));
    assert!((after / before - 1.0).abs() < 1e-3, "{after} of {before}");
    let measured = deviation(&part, &outcome.mesh, &metrics::Options::default(), &cpu(2)).expect("a measure");
    assert!(measured.symmetric().max < 3.0 * Flatness::default().distance * measured.diagonal, "{measured:?}");
}

#[test]
fn topology_is_kept_whatever_the_regions() {
    let meshes = [
        ("sphere", sphere(4)),
        ("torus", torus(40, 24)),
        ("bumps", bumpy(cube(12), 0.05)),
        ("sheet", bumpy(grid(24, 20), 0.3)),
        ("slab", shapes::double_torus()),
        ("tube", shapes::tube(30)),
        ("statue", sample("statue", Some(6000)).expect("a sample")),
        ("assembly", sample("assembly", Some(6000)).expect("a sample")),
    ];
    for (name, mesh) in meshes {
        for (kind, options) in kinds() {
            let name = format!("{name} {kind}");
            let outcome = run(&mesh, &options);
            assert_rebuilt(&name, &mesh, &outcome);
            assert!(outcome.mesh.faces.len() <= mesh.faces.len(), "{name}");
            let (before, after) = (topology(&mesh), topology(&outcome.mesh));
            assert_eq!((before.euler, before.border_loops), (after.euler, after.border_loops), "{name}");
        }
    }
}

/// A sheet's border is made of vertices of its border, and goes around all of it.
#[test]
fn there_are_no_cracks() {
    let sheet = bumpy(grid(24, 20), 0.3);
    let on_border = |mesh: &Mesh| {
        let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        for &[a, b, c] in &mesh.faces {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                *uses.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        let ends = uses.into_iter().filter(|&(_, uses)| uses == 1).flat_map(|(ends, _)| ends);
        ends.collect::<std::collections::BTreeSet<u32>>()
    };
    let border = on_border(&sheet);
    for (name, options) in kinds() {
        let outcome = run(&sheet, &options);
        let kept = on_border(&outcome.mesh);
        assert!(kept.iter().all(|&v| border.contains(&outcome.vertex_origin[v as usize])), "{name}");
        let origins: std::collections::BTreeSet<u32> =
            kept.iter().map(|&v| outcome.vertex_origin[v as usize]).collect();
        let corners = [0, 24, 20 * 25, 20 * 25 + 24];
        assert!(corners.iter().all(|corner| origins.contains(corner)), "{name}: {origins:?}");
        let after = topology(&outcome.mesh);
        assert_eq!((after.border_loops, after.non_manifold_edges), (1, 0), "{name}");
    }
}

#[test]
fn a_mesh_that_is_not_manifold_gets_no_worse() {
    // A third sheet on an edge, a sheet that touches another at a vertex, a face on its back.
    let mut mesh = bumpy(grid(12, 12), 0.2);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([DVec3::new(3.0, 3.0, 5.0), DVec3::new(4.0, 3.0, 5.0)]);
    mesh.faces.extend([[3 * 13 + 3, 3 * 13 + 4, first], [3 * 13 + 4, first + 1, first]]);
    mesh.positions.extend([DVec3::new(8.0, 8.0, 5.0), DVec3::new(9.0, 8.0, 5.0)]);
    mesh.faces.push([8 * 13 + 8, first + 2, first + 3]);
    mesh.faces.push([0, 14, 1]);
    let before = topology(&mesh);
    assert!(before.non_manifold_edges > 0 && before.bow_ties > 0 && before.duplicate_faces > 0, "{before:?}");
    for (name, options) in kinds() {
        let outcome = run(&mesh, &options);
        let after = topology(&outcome.mesh);
        assert!(after.non_manifold_edges <= before.non_manifold_edges, "{name}: {after:?}");
        assert!(
            after.bow_ties <= before.bow_ties && after.duplicate_faces <= before.duplicate_faces,
            "{name}: {after:?}"
        );
    }
}

#[test]
fn devices_and_threads_do_not_change_the_bytes() {
    let device = gpu(&GpuOptions { page_rows: Some(1 << 15), ..GpuOptions::default() });
    for name in ["statue", "part"] {
        let mesh = sample(name, Some(20_000)).expect("a sample");
        for (kind, options) in kinds() {
            let reference = bytes(&run(&mesh, &options).mesh);
            for threads in [2, 3, 5] {
                let outcome = run_on(&cpu(threads), &mesh, &options, Budget::default());
                assert!(bytes(&outcome.mesh) == reference, "{name} {kind} on {threads} threads");
            }
            if let Some(device) = &device {
                let outcome = run_on(device, &mesh, &options, Budget::default());
                assert!(bytes(&outcome.mesh) == reference, "{name} {kind} on {}", outcome.device);
                assert!(outcome.bytes_moved > 0, "{name} {kind}: nothing ran on the device");
            }
        }
    }
}

#[test]
fn error_limits_bound_the_planes() {
    let mesh = bumpy(cube(16), 0.02);
    let within = |mesh: &Mesh, options: &Options, limit: f64| {
        let outcome = run_on(&cpu(1), mesh, options, Budget::error(limit));
        let measured = deviation(mesh, &outcome.mesh, &metrics::Options::default(), &cpu(1)).expect("two meshes");
        let (estimate, most) = (outcome.error_estimate, limit * mesh.diagonal());
        assert!(0.0 < estimate && estimate <= most * (1.0 + 1e-9), "{estimate} of {most}");
        // A vertex that stays may be as far off its plane as one that goes.
        assert!(measured.symmetric().max <= 2.0 * most, "{} of {most}", measured.symmetric().max);
        (outcome.mesh.faces.len(), outcome.regions.expect("regions").count)
    };
    let (near, far) = (within(&mesh, &coplanar(), 0.002).0, within(&mesh, &bent(), 0.05).0);
    assert!(far < near && near <= mesh.faces.len(), "{far} {near}");
    let (few, many) = (within(&sphere(4), &variational(1), 0.05).1, within(&sphere(4), &variational(1), 0.005).1);
    assert!(2 < few && 2 * few < many, "{few} {many}");
}

#[test]
fn wrong_options_are_refused() {
    let refused = |options: Options, budget: Budget| {
        let result = simplify(&sphere(1), &Method::Partition(options), &budget, &cpu(1), None);
        matches!(result, Err(Error::Parameter(_)))
    };
    let none = Budget::default();
    assert!(refused(coplanar(), Budget::faces(10)) && refused(variational(3), Budget::keep(0.5)));
    assert!(refused(variational(0), none) && refused(Options::variational(vsa::Goal::Energy(-1.0)), none));
    for flatness in [(2.0, 0.1), (-0.1, 0.1), (f64::NAN, 0.1), (0.1, -1.0), (0.1, f64::NAN), (0.1, f64::INFINITY)] {
        let flatness = Flatness { angle_rad: flatness.0, distance: flatness.1 };
        assert!(refused(Options::coplanar(flatness), none), "{flatness:?}");
    }
    assert!(refused(Options { weld: Some(-1.0), ..coplanar() }, none));
    assert!(refused(coplanar(), Budget::error(f64::NAN)));
}

#[test]
fn a_run_can_be_cancelled() {
    let mut stop = |_: Progress| ControlFlow::Break(());
    for options in [coplanar(), variational(20)] {
        let method = Method::Partition(options);
        let outcome = simplify(&sphere(4), &method, &Budget::default(), &cpu(1), Some(&mut stop)).expect("a mesh");
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Cancelled, sphere(4).faces.len()));
    }
}
