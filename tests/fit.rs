//! The fit of a result to its original: what it gains where that is known, and what it may not touch.
#![allow(clippy::print_stdout, reason = "what a test skipped or measured")]

mod support;

use coarsen::backend::{Device, Selector};
use coarsen::contract::{Metric, Options, Placement};
use coarsen::math::DVec3;
use coarsen::mesh::{sample, shapes, validate};
use coarsen::{Budget, Mesh, Method, Outcome};
use support::deviation::deviation;
use support::shapes::{bumpy, sphere};

fn contract(mesh: &Mesh, options: &Options, faces: usize, device: &Device) -> Outcome {
    coarsen::simplify(mesh, &Method::Contract(options.clone()), &Budget::faces(faces), device, None).unwrap()
}

fn fitted(mesh: &Mesh, fit: u32, faces: usize) -> Mesh {
    contract(mesh, &Options { fit, ..Options::default() }, faces, &Device::cpu(2).unwrap()).mesh
}

/// The root mean square of both directions.
fn rms(a: &Mesh, b: &Mesh) -> f64 {
    deviation(a, b, 40_000).rms.max(deviation(b, a, 40_000).rms)
}

/// Faces between vertices on a sphere lie inside it; fitted vertices lie outside, so that the faces cut it.
#[test]
fn vertices_of_a_sphere_move_outward() {
    let dense = sphere(6);
    let plain = fitted(&dense, 0, 500);
    let moved = fitted(&dense, 2, 500);
    let mean_radius =
        |mesh: &Mesh| mesh.positions.iter().map(|p| p.length()).sum::<f64>() / mesh.positions.len() as f64;
    assert!(mean_radius(&plain) > 1.0 && mean_radius(&moved) > 1.0);
    assert_eq!(plain.faces, moved.faces, "a fit changes no face");
    let (before, after) = (rms(&dense, &plain), rms(&dense, &moved));
    assert!(after < 0.97 * before, "{before:.3e} → {after:.3e}");
    assert_eq!(validate(&moved), []);
}

/// The plane metric leaves its vertices too far out where the surface is round; a fit sees by how much.
#[test]
fn a_fit_gains_a_known_share_on_round_shapes() {
    let dense = bumpy(sphere(6), 0.08);
    let options = |fit| Options { fit, metric: Metric::Plane, ..Options::default() };
    let device = Device::cpu(2).unwrap();
    let [before, one, three] = [0, 1, 3].map(|fit| rms(&dense, &contract(&dense, &options(fit), 800, &device).mesh));
    assert!(one < 0.85 * before && three < one, "{before:.3e}, {one:.3e}, {three:.3e}");
}

#[test]
fn a_plane_stays_exactly() {
    let plane = shapes::plane(40, 40);
    let (plain, moved) = (fitted(&plane, 0, 300), fitted(&plane, 3, 300));
    assert_eq!(plain, moved);
}

#[test]
fn borders_locked_vertices_and_endpoints_stay() {
    let terrain = sample("terrain", Some(8_000)).unwrap();
    let device = Device::cpu(2).unwrap();
    let plain = contract(&terrain, &Options::default(), 800, &device).mesh;
    let moved = contract(&terrain, &Options { fit: 2, ..Options::default() }, 800, &device).mesh;
    assert_eq!(plain.faces, moved.faces);
    let mut uses = std::collections::BTreeMap::new();
    for face in &plain.faces {
        for k in 0..3 {
            let (u, w) = (face[k], face[(k + 1) % 3]);
            *uses.entry((u.min(w), u.max(w))).or_insert(0) += 1;
        }
    }
    let border: Vec<u32> = uses.iter().filter(|(_, uses)| **uses == 1).flat_map(|(&(u, w), _)| [u, w]).collect();
    assert!(border.len() > 40);
    for v in border {
        assert_eq!(plain.positions[v as usize], moved.positions[v as usize], "vertex {v}");
    }
    let moved_count = plain.positions.iter().zip(&moved.positions).filter(|(a, b)| a != b).count();
    assert!(moved_count > plain.positions.len() / 2, "{moved_count} moved");

    let endpoint = |fit| Options { fit, placement: Placement::Endpoint, ..Options::default() };
    let [kept, asked] = [0, 2].map(|fit| contract(&terrain, &endpoint(fit), 800, &device));
    assert_eq!(kept.mesh, asked.mesh);
}

#[test]
fn the_deviation_falls_on_every_sample() {
    for (name, faces) in [("terrain", 1_000), ("terrain", 200), ("statue", 1_600), ("statue", 400), ("part", 800)] {
        let mesh = sample(name, Some(16_000)).unwrap();
        let [before, after] = [0, 1].map(|fit| fitted(&mesh, fit, faces));
        assert_eq!(validate(&after), [], "{name}");
        let (was, is) = (rms(&mesh, &before), rms(&mesh, &after));
        println!("{name} → {faces}: {was:.4e} → {is:.4e}, {:.3}", is / was);
        assert!(is <= was, "{name} → {faces}: {was:.4e} → {is:.4e}");
        // No face turns over against what it was.
        let normal = |mesh: &Mesh, f: usize| {
            let [a, b, c] = mesh.faces[f].map(|v| mesh.positions[v as usize]);
            (b - a).cross(c - a)
        };
        assert!((0..before.faces.len()).all(|f| {
            let (n, m): (DVec3, DVec3) = (normal(&before, f), normal(&after, f));
            n.dot(m) > 0.0 || n.length() < 1e-12
        }));
    }
}

#[test]
fn the_same_bytes_on_threads_and_devices() {
    let mesh = sample("statue", Some(24_000)).unwrap();
    let options = Options { fit: 2, ..Options::default() };
    let want = contract(&mesh, &options, 2_000, &Device::cpu(1).unwrap());
    let threads = contract(&mesh, &options, 2_000, &Device::cpu(3).unwrap());
    assert_eq!((&want.mesh, &want.vertex_origin), (&threads.mesh, &threads.vertex_origin));
    match Device::open(&Selector::Gpu, 2).or_else(|_| Device::open(&Selector::Software, 2)) {
        Ok(device) => {
            let on_gpu = contract(&mesh, &options, 2_000, &device);
            assert!(on_gpu.rounds.iter().any(|round| round.on_gpu), "the fit ran there too");
            assert_eq!(want.mesh, on_gpu.mesh);
            assert!(on_gpu.warnings.is_empty(), "{:?}", on_gpu.warnings);
        }
        Err(reason) => println!("skipped: {reason}"),
    }
}

#[test]
fn hostile_meshes_are_fitted_or_left() {
    let mut spiky = sphere(4);
    for (i, p) in spiky.positions.iter_mut().enumerate() {
        *p *= if i % 17 == 0 { 5.0 } else { 1.0 };
    }
    let flat = Mesh::new(spiky.positions.iter().map(|p| DVec3::new(p.x, p.x, 0.0)).collect(), spiky.faces.clone());
    let tiny = Mesh::new(spiky.positions.iter().map(|p| *p * 1e-30).collect(), spiky.faces.clone());
    for mesh in [spiky, flat, tiny] {
        for faces in [4, 60, 1_000] {
            let result = contract(&mesh, &Options { fit: 5, ..Options::default() }, faces, &Device::cpu(1).unwrap());
            assert!(result.mesh.positions.iter().all(|p| p.is_finite()));
            result.mesh.check().unwrap();
        }
    }
}
