//! Curvatures, feature degrees and weights: known answers, invariances, and what weights do to a run. [Yang13]

mod support;

use std::collections::{BTreeMap, BTreeSet};

use coarsen::backend::GpuOptions;
use coarsen::contract::{Feature, FeatureMode, Metric, Options, Placement, Update, Weighting, feature_degrees};
use coarsen::kernel::angle_defects::AngleDefects;
use coarsen::kernel::border_curvatures::BorderCurvatures;
use coarsen::kernel::curvatures::Curvatures;
use coarsen::kernel::face_corners::FaceCorners;
use coarsen::kernel::rows::{BORDER, Face, Position};
use coarsen::math::DVec3;
use coarsen::mesh::{Rings, sample, shapes};
use coarsen::simplify::MOVED;
use coarsen::{Budget, Error, Mesh, Method, simplify};
use support::deviation::Random;
use support::engine::{METRICS, bytes, contract, contract_on, cpu, gpu};
use support::shapes::{bumpy, cube, grid, sphere, torus};

// Definitions

/// The neighbors of every vertex, and whether it lies on a border.
fn neighborhoods(mesh: &Mesh) -> Vec<(BTreeSet<u32>, bool)> {
    let mut uses: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for &[a, b, c] in &mesh.faces {
        for (u, w) in [(a, b), (b, c), (c, a)] {
            *uses.entry((u.min(w), u.max(w))).or_default() += 1;
        }
    }
    let mut around = vec![(BTreeSet::new(), false); mesh.positions.len()];
    for (&(u, w), &count) in &uses {
        for (v, other) in [(u, w), (w, u)] {
            around[v as usize].0.insert(other);
            around[v as usize].1 |= count == 1;
        }
    }
    around
}

/// Mean curvatures and mixed areas from the definition, in double precision, by angles.
fn defined_curvatures(mesh: &Mesh) -> Vec<(f64, f64)> {
    let mut sums = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
    for face in &mesh.faces {
        let points = face.map(|v| mesh.positions[v as usize]);
        let angle = |i: usize| (points[(i + 1) % 3] - points[i]).angle_between(points[(i + 2) % 3] - points[i]);
        let angles = [0, 1, 2].map(angle);
        let area = (points[1] - points[0]).cross(points[2] - points[0]).length() / 2.0;
        let obtuse = angles.iter().any(|&angle| angle > std::f64::consts::FRAC_PI_2 + 1e-12);
        for i in 0..3 {
            let (next, last) = ((i + 1) % 3, (i + 2) % 3);
            let (to_next, to_last) = (points[i] - points[next], points[i] - points[last]);
            let (by_next, by_last) = (angles[next].tan().recip(), angles[last].tan().recip());
            let (turn, sum) = &mut sums[face[i] as usize];
            *turn += to_next * by_last + to_last * by_next;
            *sum += match obtuse {
                false => (to_next.length_squared() * by_last + to_last.length_squared() * by_next) / 8.0,
                true if angles[i] > std::f64::consts::FRAC_PI_2 => area / 2.0,
                true => area / 4.0,
            };
        }
    }
    sums.into_iter().map(|(turn, area)| (turn.length() / (4.0 * area), area)).collect()
}

/// Feature degrees from the definition, with natural logarithms.
fn defined_degrees(mesh: &Mesh, floor: f64) -> Vec<f64> {
    let around = neighborhoods(mesh);
    let of_all = defined_curvatures(mesh);
    let curvature = |v: usize| {
        if !around[v].1 {
            return of_all[v].0;
        }
        let inner: Vec<f64> =
            around[v].0.iter().filter(|&&w| !around[w as usize].1).map(|&w| of_all[w as usize].0).collect();
        inner.iter().sum::<f64>() / inner.len().max(1) as f64
    };
    let curvatures: Vec<f64> = (0..around.len()).map(curvature).collect();
    let floor = floor * curvatures.iter().sum::<f64>() / curvatures.len() as f64;
    let degree = |v: usize| {
        let mut shares: Vec<f64> = around[v].0.iter().map(|&w| curvatures[w as usize] + floor).collect();
        shares.push(curvatures[v] + floor);
        let sum: f64 = shares.iter().sum();
        let entropy: f64 =
            shares.iter().map(|share| share / sum).map(|p| if p > 0.0 { -p * p.ln() } else { 0.0 }).sum();
        if sum > 0.0 { 1.0 - entropy / (shares.len() as f64).ln() } else { 0.0 }
    };
    (0..around.len()).map(degree).collect()
}

/// A point turned about two axes.
fn turned(p: DVec3) -> DVec3 {
    let (sin, cos) = 0.7_f64.sin_cos();
    let q = DVec3::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y, p.z);
    DVec3::new(q.x, cos * q.y - sin * q.z, sin * q.y + cos * q.z)
}

// What the library finds

fn degrees(mesh: &Mesh, curvature_floor: f32) -> Vec<f32> {
    let feature = Feature { curvature_floor, ..Feature::default() };
    feature_degrees(mesh, &feature, &cpu(1)).expect("a valid mesh")
}

/// Mean curvatures, mixed areas and angle defects of a mesh as it is, by the kernels.
fn curvatures(mesh: &Mesh) -> (Vec<f32>, Vec<f32>, Vec<f32>) {
    let around = neighborhoods(mesh);
    let row = |(p, (_, on_border)): (&DVec3, &(_, bool))| {
        let [x, y, z] = p.as_vec3().to_array();
        Position { x, y, z, flags: if *on_border { BORDER } else { 0 } }
    };
    let rings = Rings::new(&mesh.faces, mesh.positions.len());
    let mut queue = cpu(1).cpu_queue();
    let positions = &queue.buffer_from(mesh.positions.iter().zip(&around).map(row).collect()).expect("memory");
    let faces: Vec<Face> = mesh.faces.iter().map(|&[a, b, c]| Face { a, b, c }).collect();
    let (vertex_count, face_count) = (mesh.positions.len() as u32, faces.len() as u32);
    let corners = &mut queue.buffer(faces.len()).expect("memory");
    let faces = &queue.buffer_from(faces).expect("memory");
    let ring_starts = &queue.buffer_from(rings.starts).expect("memory");
    let ring_faces = &queue.buffer_from(rings.faces).expect("memory");
    let areas = &mut queue.buffer(mesh.positions.len()).expect("memory");
    let curvatures = &mut queue.buffer(mesh.positions.len()).expect("memory");
    queue.run(FaceCorners { positions, faces, face_count, corners }).expect("a kernel on the host");
    queue
        .run(Curvatures { positions, faces, ring_starts, ring_faces, corners, vertex_count, areas, curvatures })
        .expect("a kernel on the host");
    queue
        .run(BorderCurvatures { positions, faces, ring_starts, ring_faces, vertex_count, curvatures })
        .expect("a kernel on the host");
    let defects = &mut queue.buffer(mesh.positions.len()).expect("memory");
    queue
        .run(AngleDefects { positions, faces, ring_starts, ring_faces, corners, vertex_count, defects })
        .expect("a kernel on the host");
    (curvatures.host().to_vec(), areas.host().to_vec(), defects.host().to_vec())
}

/// A flat of 20 × 20 squares with the vertex in its middle pulled out; also which ring of it every vertex is in.
fn spike() -> (Mesh, Vec<u32>) {
    let mut mesh = grid(20, 20);
    let top = 10 * 21 + 10;
    mesh.positions[top].z = 1.0;
    let around = neighborhoods(&mesh);
    let mut ring = vec![u32::MAX; mesh.positions.len()];
    ring[top] = 0;
    for step in 1..40 {
        for v in 0..ring.len() {
            if ring[v] == step - 1 {
                around[v].0.iter().for_each(|&w| ring[w as usize] = ring[w as usize].min(step));
            }
        }
    }
    (mesh, ring)
}

#[test]
fn curvatures_and_areas_are_those_of_the_definition() {
    let mut open = bumpy(sphere(4), 0.1);
    open.faces.truncate(1500);
    let meshes = [
        ("sphere", bumpy(sphere(4), 0.2)),
        ("torus", bumpy(torus(40, 20), 0.05)),
        ("part", sample("part", Some(3000)).expect("a sample")),
        ("open", open),
    ];
    for (name, mesh) in meshes {
        let (found, areas, _) = curvatures(&mesh);
        let around = neighborhoods(&mesh);
        for (v, &(curvature, area)) in defined_curvatures(&mesh).iter().enumerate() {
            if around[v].0.is_empty() {
                continue;
            }
            let close = |found: f32, defined: f64| (f64::from(found) - defined).abs() <= 1e-3 * defined.abs() + 1e-3;
            assert!(close(areas[v], area), "{name}: area of {v} is {area}, not {}", areas[v]);
            assert!(
                around[v].1 || close(found[v], curvature),
                "{name}: curvature of {v} is {curvature}, not {}",
                found[v]
            );
        }
        let total: f64 = areas.iter().map(|&area| f64::from(area)).sum();
        assert!((total / mesh.area() - 1.0).abs() < 1e-6, "{name}: areas add up to {total}, not {}", mesh.area());
    }
}

/// Gauss and Bonnet: what angles miss adds up to 2π χ, with borders and without.
#[test]
fn defects_add_up_to_the_topology() {
    let ball = bumpy(sphere(4), 0.2);
    let cap = Mesh::new(ball.positions.clone(), ball.faces.iter().copied().filter(|f| !f.contains(&0)).collect());
    for (name, mesh, euler) in [("ball", ball, 2), ("torus", bumpy(torus(40, 20), 0.05), 0), ("cap", cap, 1)] {
        let used = neighborhoods(&mesh);
        let (_, _, defects) = curvatures(&mesh);
        let rows = defects.iter().zip(&used).filter(|(_, (around, _))| !around.is_empty());
        let total: f64 = rows.map(|(&defect, _)| f64::from(defect)).sum();
        assert!((total - std::f64::consts::TAU * f64::from(euler)).abs() < 1e-3, "{name}: {total}");
    }
}

#[test]
fn a_sphere_is_curved_by_one_over_its_radius() {
    for (level, radius) in [(2, 1.0), (3, 0.25), (4, 20.0)] {
        let mut mesh = shapes::icosphere(level);
        mesh.positions.iter_mut().for_each(|p| *p *= radius);
        let (found, _, defects) = curvatures(&mesh);
        let worst = found.iter().map(|&k| (f64::from(k) * radius - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-3, "level {level}: off by {worst}");
        assert!(defects.iter().all(|&defect| defect > 0.0), "level {level}");
        let worst = degrees(&mesh, 1.0).into_iter().fold(0.0, f32::max);
        assert!(worst < 1e-3, "level {level}: a feature of degree {worst}");
    }
}

#[test]
fn a_flat_has_no_curvature_and_no_feature() {
    for mesh in [grid(9, 7), shapes::plane(12, 5)] {
        assert!(curvatures(&mesh).0.iter().all(|&k| k == 0.0));
        for floor in [0.0, 1.0] {
            assert!(degrees(&mesh, floor).iter().all(|&degree| degree == 0.0));
        }
    }
    // Turned, it has the noise of rounding: the floor drowns it, and without a floor it would be a feature.
    let mut mesh = grid(40, 40);
    mesh.positions.iter_mut().for_each(|p| *p = turned(*p));
    assert!(degrees(&mesh, 1.0).iter().all(|&degree| degree < 0.01));
    assert!(degrees(&mesh, 0.0).iter().any(|&degree| degree > 0.2));
}

#[test]
fn a_spike_is_a_feature_of_three_rings() {
    let (mesh, ring) = spike();
    for (degree, &ring) in degrees(&mesh, 1.0).iter().zip(&ring) {
        match ring {
            0 | 1 => assert!(*degree > 0.01, "ring {ring}: {degree}"),
            2 => {}
            _ => assert_eq!(*degree, 0.0, "ring {ring}"),
        }
    }
}

#[test]
fn a_cube_has_features_along_its_edges_and_beside_them() {
    const CELLS: u32 = 8;
    let mesh = cube(CELLS);
    for (p, degree) in mesh.positions.iter().zip(degrees(&mesh, 1.0)) {
        // How many cells lie between it and the nearest edge: all sides but its own are at least so far.
        let to_side = p.to_array().map(|x| (x.min(1.0 - x) * f64::from(CELLS)).round() as u32);
        let mut sides = to_side;
        sides.sort_unstable();
        match sides[1] {
            0 | 1 => assert!(degree > 0.005, "{p}: {degree}"),
            _ => assert_eq!(degree, 0.0, "{p}"),
        }
    }
}

#[test]
fn degrees_are_those_of_the_definition() {
    // Without a floor the noise on a flat would decide.
    let meshes = [
        ("sphere", bumpy(sphere(4), 0.2), 0.0),
        ("terrain", sample("terrain", Some(4000)).expect("a sample"), 0.0),
        ("statue", sample("statue", Some(4000)).expect("a sample"), 0.5),
        ("cube", cube(6), 0.5),
    ];
    for (name, mesh, least) in meshes {
        for floor in [0.0, 0.5, 1.0].into_iter().filter(|&floor| floor >= least) {
            let found = degrees(&mesh, floor);
            assert!(found.iter().all(|degree| (0.0..=1.0).contains(degree)), "{name}");
            let mut worst: f64 = 0.0;
            for (found, defined) in found.iter().zip(defined_degrees(&mesh, f64::from(floor))) {
                worst = worst.max((f64::from(*found) - defined).abs());
            }
            assert!(worst < 2e-3, "{name}, floor {floor}: off by {worst}");
        }
    }
}

#[test]
fn degrees_do_not_depend_on_scale_place_or_order() {
    let mesh = bumpy(sphere(4), 0.2);
    let reference = degrees(&mesh, 1.0);
    let moved = |map: &dyn Fn(DVec3) -> DVec3| {
        let mut other = mesh.clone();
        other.positions.iter_mut().for_each(|p| *p = map(*p));
        degrees(&other, 1.0)
    };
    assert!(moved(&|p| p * 1024.0) == reference, "a power of two changes bits");
    let near = |other: &[f32]| other.iter().zip(&reference).all(|(a, b)| (a - b).abs() < 2e-4);
    assert!(near(&moved(&|p| p * 3.7)), "scale");
    assert!(near(&moved(&turned)), "rotation");
    assert!(near(&moved(&|p| p + DVec3::new(10.0, -5.0, 3.0))), "translation");

    let mut shuffled = mesh.clone();
    shuffled.faces.reverse();
    shuffled.faces.iter_mut().for_each(|face| face.rotate_left(1));
    assert!(near(&degrees(&shuffled, 1.0)), "order of the faces");
    let last = mesh.positions.len() as u32 - 1;
    shuffled.positions.reverse();
    shuffled.faces.iter_mut().for_each(|face| *face = face.map(|v| last - v));
    let mut renumbered = degrees(&shuffled, 1.0);
    renumbered.reverse();
    assert!(near(&renumbered), "order of the vertices");
}

#[test]
fn joined_and_unused_vertices_have_degrees_too() {
    let (mut mesh, _) = spike();
    let reference = degrees(&mesh, 1.0);
    let top = 10 * 21 + 10;
    let copy = mesh.positions.len() as u32;
    mesh.positions.extend([mesh.positions[top], DVec3::splat(7.0)]);
    let corner = mesh.faces.iter_mut().flatten().find(|v| **v == top as u32).expect("a face there");
    *corner = copy;
    let found = degrees(&mesh, 1.0);
    assert_eq!(found[..reference.len()], reference[..]);
    assert_eq!(found[copy as usize..], [reference[top], 0.0]);
}

// What weights do

/// Every mode, both updates.
fn features() -> Vec<Feature> {
    let modes = [
        FeatureMode::Affine { lambda: 4.0 },
        FeatureMode::Gated { lambda: 16.0 },
        FeatureMode::Contrast,
        FeatureMode::Entropy,
    ];
    let with = |mode| [Update::Static, Update::Recompute].map(|update| Feature { mode, curvature_floor: 1.0, update });
    modes.into_iter().flat_map(with).collect()
}

fn weighted(metric: Metric, placement: Placement, weighting: Weighting) -> Options {
    Options { metric, placement, weighting, ..Options::default() }
}

/// Both metrics and placements.
fn ways() -> impl Iterator<Item = (Metric, Placement)> {
    METRICS
        .into_iter()
        .flat_map(|metric| [Placement::Optimal, Placement::Endpoint].map(|placement| (metric, placement)))
}

#[test]
fn weights_of_one_change_no_bit() {
    let mut mesh = sample("terrain", Some(5000)).expect("a sample");
    mesh.faces.extend(
        sample("part", Some(2000)).expect("a sample").faces.iter().map(|f| f.map(|v| v + mesh.positions.len() as u32)),
    );
    mesh.positions.extend(sample("part", Some(2000)).expect("a sample").positions);
    let none = FeatureMode::Affine { lambda: 0.0 };
    for (metric, placement) in ways() {
        let reference = contract(&mesh, &weighted(metric, placement, Weighting::Uniform), Budget::keep(0.1));
        for weighting in [
            Weighting::Feature(Feature { mode: none, ..Feature::default() }),
            Weighting::Feature(Feature { mode: none, update: Update::Recompute, ..Feature::default() }),
            Weighting::Given(vec![1.0; mesh.positions.len()].into()),
            Weighting::Given(vec![0.125; mesh.positions.len()].into()),
            Weighting::Given(vec![0.0; mesh.positions.len()].into()),
        ] {
            let outcome = contract(&mesh, &weighted(metric, placement, weighting.clone()), Budget::keep(0.1));
            assert!(bytes(&outcome.mesh) == bytes(&reference.mesh), "{metric:?} {placement:?}");
            assert_eq!(outcome.error_estimate.to_bits(), reference.error_estimate.to_bits());
        }
    }
}

#[test]
fn half_edges_leave_a_subset_of_the_vertices() {
    let mesh = sample("statue", Some(5000)).expect("a sample");
    for feature in features() {
        let options = Options { weighting: Weighting::Feature(feature), ..Options::feature_weighted() };
        let outcome = contract(&mesh, &options, Budget::keep(0.1));
        assert_eq!(outcome.mesh.faces.len(), mesh.faces.len() / 10 / 2 * 2, "{feature:?}");
        for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
            assert!(origin != MOVED && mesh.positions[origin as usize] == *p, "{feature:?}");
        }
    }
}

/// The cost of every removal of a vertex onto a neighbor as a run begins, by the definition with this weight at `heavy`.
fn removals(mesh: &Mesh, heavy: usize, weight: f64) -> BTreeMap<(usize, u32), f64> {
    let mut costs = BTreeMap::new();
    for (v, (neighbors, _)) in neighborhoods(mesh).iter().enumerate() {
        for &onto in neighbors {
            // A face about `onto` has its plane through it: only those about v cost.
            let target = mesh.positions[onto as usize];
            let cost = |face: &&[u32; 3]| {
                let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
                let n = (b - a).cross(c - a);
                n.dot(target - a).powi(2) / (2.0 * n.length())
            };
            let sum: f64 = mesh.faces.iter().filter(|face| face.contains(&(v as u32))).map(|face| cost(&face)).sum();
            costs.insert((v, onto), sum * if v == heavy { weight } else { 1.0 });
        }
    }
    costs
}

/// Raising a weight raises the cost of every removal of its vertex and of no other; so in the engine, where a heavy vertex
/// stays.
#[test]
fn heavy_vertices_stay() {
    let mesh = bumpy(sphere(3), 0.1);
    let (light, heavy) = (removals(&mesh, 17, 1.0), removals(&mesh, 17, 3.0));
    for (&(v, onto), cost) in &light {
        let raised = heavy[&(v, onto)];
        assert!(if v == 17 { raised >= *cost } else { raised == *cost }, "{v} onto {onto}");
    }

    let mut random = Random(3);
    let kept: BTreeSet<u32> = (0..12).map(|_| (random.bits() % mesh.positions.len() as u64) as u32).collect();
    let weights: Vec<f32> =
        (0..mesh.positions.len() as u32).map(|v| if kept.contains(&v) { 1e6 } else { 1.0 }).collect();
    for metric in METRICS {
        let run = |weighting| {
            let outcome = contract(&mesh, &weighted(metric, Placement::Endpoint, weighting), Budget::faces(60));
            let left: BTreeSet<u32> = outcome.vertex_origin.iter().copied().collect();
            kept.iter().filter(|v| left.contains(v)).count()
        };
        assert_eq!(run(Weighting::Given(weights.clone().into())), kept.len(), "{metric:?}");
        assert!(run(Weighting::Uniform) < kept.len(), "{metric:?}: they stay anyway");
    }
}

/// Zeros take a region away first.
#[test]
fn weightless_regions_go_first() {
    let mesh = bumpy(sphere(4), 0.2);
    let weights: Vec<f32> = mesh.positions.iter().map(|p| if p.z > 0.0 { 1.0 } else { 0.0 }).collect();
    for metric in METRICS {
        let options = weighted(metric, Placement::Endpoint, Weighting::Given(weights.clone().into()));
        let outcome = contract(&mesh, &options, Budget::keep(0.5));
        let above = outcome.mesh.positions.iter().filter(|p| p.z > 0.0).count();
        assert!(
            above * 4 > outcome.mesh.positions.len() * 3,
            "{metric:?}: {above} of {}",
            outcome.mesh.positions.len()
        );
    }
}

#[test]
fn bad_weights_are_refused() {
    let mesh = sphere(2);
    let run = |weighting| {
        let method = Method::Contract(weighted(Metric::Plane, Placement::Endpoint, weighting));
        simplify(&mesh, &method, &Budget::keep(0.5), &cpu(1), None).map(|_| ()).map_err(|error| match error {
            Error::Parameter(message) => message,
            other => panic!("{other}"),
        })
    };
    let with = |v: usize, weight: f32| {
        let mut weights = vec![1.0; mesh.positions.len()];
        weights[v] = weight;
        run(Weighting::Given(weights.into()))
    };
    assert_eq!(with(3, 0.0), Ok(()));
    assert_eq!(with(3, -1.0), Err("the weight of vertex 3 is -1: give finite numbers from 0".into()));
    assert!(with(0, f32::NAN).is_err() && with(0, f32::INFINITY).is_err());
    assert_eq!(
        run(Weighting::Given(vec![1.0; 65].into())),
        Err("65 weights for a mesh of 66 vertices: give one each".into())
    );
    let feature = Feature { curvature_floor: -1.0, ..Feature::default() };
    assert_eq!(run(Weighting::Feature(feature)), Err("the curvature floor is -1, not in 0 … 1e6".into()));
    assert!(feature_degrees(&mesh, &feature, &cpu(1)).is_err());
}

// Devices

/// Every kind of weights, on a mesh with a border, locks and a seam.
#[test]
fn threads_and_devices_do_not_change_the_bytes() {
    let mut mesh = sample("terrain", Some(30_000)).expect("a sample");
    mesh.faces.push([0, 5000, 9000]);
    let mut random = Random(5);
    let given: Vec<f32> = mesh.positions.iter().map(|_| random.unit() as f32).collect();
    let mut weightings = vec![Weighting::Given(given.into())];
    weightings.extend(features().into_iter().map(Weighting::Feature));
    let graphics = gpu(&GpuOptions::default());
    for (metric, placement) in ways() {
        for weighting in &weightings {
            let options = weighted(metric, placement, weighting.clone());
            let reference = contract(&mesh, &options, Budget::keep(0.2));
            for device in [Some(&cpu(3)), graphics.as_ref()].into_iter().flatten() {
                let outcome = contract_on(device, &mesh, &options, Budget::keep(0.2));
                let name = format!("{metric:?} {placement:?}, {}", device.description());
                assert!(outcome.warnings == reference.warnings, "{name}: {:?}", outcome.warnings);
                assert!(bytes(&outcome.mesh) == bytes(&reference.mesh), "{name}");
                assert!(!device.is_gpu() || outcome.rounds[0].on_gpu, "{name}");
            }
        }
    }
}
