//! Faces of several materials that lie on each other: a decal on a wall, two figures in one pose.

#[path = "support/mod.rs"]
mod support;

use coarsen::backend::GpuOptions;
use coarsen::contract::{Attributes, Dropped, Options};
use coarsen::mesh::{Defect, Materials, shapes, validate};
use coarsen::{Budget, Device, Mesh, Method, Outcome, metrics, simplify};
use support::engine::{bytes, cpu, gpu};
use support::independent::topology;

/// A ball, a patch on it and a second ball in the same place, each of a material of its own.
fn layered(is_welded: bool) -> Mesh {
    let ball = shapes::icosphere(4);
    let count = ball.positions.len() as u32;
    let patch: Vec<[u32; 3]> =
        ball.faces.iter().filter(|face| face.iter().all(|&v| ball.positions[v as usize].z > 0.5)).copied().collect();
    let mut of_face = vec![0; ball.faces.len()];
    let mut mesh = ball.clone();
    for (material, faces) in [(1, &patch), (2, &ball.faces)] {
        let first = if is_welded { 0 } else { mesh.positions.len() as u32 };
        if !is_welded {
            mesh.positions.extend_from_slice(&ball.positions);
        }
        mesh.faces.extend(faces.iter().map(|face| face.map(|v| v + first)));
        of_face.resize(mesh.faces.len(), material);
    }
    assert_eq!(mesh.positions.len() as u32, if is_welded { count } else { 3 * count });
    mesh.materials = Some(Materials { of_face, names: ["ball", "patch", "twin"].map(String::from).to_vec() });
    mesh
}

fn run(device: &Device, mesh: &Mesh, options: Options, keep: f64) -> Outcome {
    let budget = Budget::keep(keep);
    simplify(mesh, &Method::Contract(options), &budget, device, None).expect("a valid mesh")
}

/// The faces of one material as a mesh.
fn of_material(mesh: &Mesh, material: u32) -> Mesh {
    let materials = mesh.materials.as_ref().expect("materials");
    let faces = mesh.faces.iter().zip(&materials.of_face).filter(|&(_, &of_face)| of_face == material);
    Mesh::new(mesh.positions.clone(), faces.map(|(&face, _)| face).collect())
}

fn is_told(outcome: &Outcome, text: &str) -> bool {
    outcome.warnings.iter().any(|warning| warning.contains(text))
}

#[test]
fn each_layer_is_reduced_and_none_is_dropped() {
    for is_welded in [false, true] {
        let mesh = layered(is_welded);
        let outcome = run(&cpu(1), &mesh, Options::default(), 0.1);
        assert!(outcome.mesh.faces.len() <= mesh.faces.len() / 10 && !is_told(&outcome, "duplicate"), "{outcome:?}");
        for (material, border_loops) in [(0, 0), (1, 1), (2, 0)] {
            let [before, after] = [&mesh, &outcome.mesh].map(|mesh| of_material(mesh, material));
            let share = after.faces.len() as f64 / before.faces.len() as f64;
            assert!((0.05..0.2).contains(&share), "{is_welded} {material}: {share}");
            let found = topology(&after);
            assert_eq!((found.components, found.non_manifold_edges, found.border_loops), (1, 0, border_loops));
            let apart =
                metrics::deviation(&before, &after, &metrics::Options::default(), &cpu(1)).expect("two surfaces");
            assert!(apart.symmetric().rms < 0.01, "{material}: {apart:?}");
        }
    }
}

#[test]
fn what_pruning_leaves_comes_apart_too() {
    let mut mesh = layered(true);
    let crumb = shapes::tetrahedron();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(crumb.positions.iter().map(|&p| 0.01 * p + 3.0));
    mesh.faces.extend(crumb.faces.iter().map(|face| face.map(|v| v + first)));
    mesh.materials.iter_mut().for_each(|materials| materials.of_face.resize(mesh.faces.len(), 1));
    for weld in [None, Some(0.0)] {
        let options = Options { prune: Some(0.05), weld, ..Options::default() };
        let outcome = run(&cpu(1), &mesh, options, 0.1);
        assert!(is_told(&outcome, "small parts dropped: 1"), "{:?}", outcome.warnings);
        assert!(outcome.mesh.faces.len() <= mesh.faces.len() / 10, "{weld:?}: {}", outcome.mesh.faces.len());
        assert!((0..3).all(|material| !of_material(&outcome.mesh, material).faces.is_empty()));
    }
}

#[test]
fn only_faces_of_one_material_repeat_each_other() {
    let mesh = layered(true);
    let repeated = |mesh: &Mesh| {
        let defects = validate(mesh);
        defects.iter().filter(|defect| matches!(defect, Defect::DuplicateFace { .. })).count()
    };
    let count = mesh.faces.len() - shapes::icosphere(4).faces.len();
    assert_eq!(repeated(&mesh), 0);
    assert_eq!(repeated(&Mesh { materials: None, ..mesh.clone() }), count);
    // With another defect, which takes a face out; and with materials that are no materials of this mesh.
    let mut broken = mesh.clone();
    broken.faces[0][0] = u32::MAX;
    assert_eq!(repeated(&broken), 0);
    let mut short = mesh;
    short.materials.iter_mut().for_each(|materials| materials.of_face.clear());
    assert_eq!(repeated(&short), count);
}

#[test]
fn of_one_material_all_but_one_are_dropped() {
    let mesh = layered(false);
    let ball = shapes::icosphere(4).faces.len();
    let dropped = Attributes { dropped: Dropped { materials: true, ..Dropped::default() }, ..Attributes::default() };
    let outcome = run(&cpu(1), &mesh, Options { attributes: dropped, ..Options::default() }, 0.9);
    assert!(
        is_told(&outcome, &format!("duplicate faces dropped: {}", mesh.faces.len() - ball)),
        "{:?}",
        outcome.warnings
    );
    assert_eq!(outcome.mesh.faces.len(), ball);
    // Nor where the surface is not cut: there nothing that four faces share could contract.
    let log = run(&cpu(1), &mesh, Options { log: true, ..Options::default() }, 0.1);
    assert!(is_told(&log, "duplicate faces dropped"), "{:?}", log.warnings);
}

#[test]
fn threads_and_devices_give_the_same_bytes() {
    let mesh = layered(false);
    let expected = bytes(&run(&cpu(1), &mesh, Options::default(), 0.1).mesh);
    assert_eq!(bytes(&run(&cpu(2), &mesh, Options::default(), 0.1).mesh), expected);
    if let Some(device) = gpu(&GpuOptions::default()) {
        assert_eq!(bytes(&run(&device, &mesh, Options::default(), 0.1).mesh), expected);
    }
}
