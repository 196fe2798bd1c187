//! Deviation of surfaces: known answers, brute force, an independent library, and the same bytes on every device.

mod support;

use coarsen::backend::GpuOptions;
use coarsen::math::{DMat3, DVec3};
use coarsen::mesh::{sample, shapes};
use coarsen::metrics::sampling::{Kind, Sampler};
use coarsen::metrics::{Deviation, Kinds, MOST_SAMPLES, Options, Side, deviation, vertex_distances};
use coarsen::spatial::{Bvh, Frame};
use coarsen::{Budget, Error, Mesh, Method, simplify};
use support::deviation::{Random, brute_force};
use support::engine::{cpu, gpu};
use support::shapes::{bumpy, cube, grid, mesh, sphere};

fn options(samples: usize) -> Options {
    Options { samples: Some(samples), ..Options::default() }
}

fn measure(a: &Mesh, b: &Mesh, samples: usize) -> Deviation {
    deviation(a, b, &options(samples), &cpu(2)).expect("two meshes with faces")
}

fn moved(mesh: &Mesh, by: impl Fn(DVec3) -> DVec3) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|&p| by(p)).collect(), ..mesh.clone() }
}

fn sides(d: &Deviation) -> [&Side; 2] {
    [&d.forward, &d.backward]
}

#[track_caller]
fn assert_close(got: f64, want: f64, relative: f64) {
    assert!((got - want).abs() <= relative * want.abs(), "{got}, not {want}");
}

// Known answers

#[test]
fn a_surface_is_at_no_distance_from_itself() {
    for mesh in [sample("statue", Some(5000)).unwrap(), sample("part", Some(5000)).unwrap(), cube(3), grid(7, 4)] {
        let d = measure(&mesh, &mesh, 20_000);
        for side in sides(&d) {
            assert!(side.distance.max <= 1e-15 * d.diagonal, "{:?}", side.distance);
            assert!(side.normals.mean_rad < 1e-7, "{:?}", side.normals);
            assert!(side.samples > 20_000 + mesh.faces.len() / 3);
        }
        // Vertices and all that a vertex can be: exactly.
        assert!(vertex_distances(&mesh, &mesh, &cpu(2)).unwrap().iter().all(|&distance| distance == 0.0));
    }
}

#[test]
fn a_shifted_plane_is_everywhere_at_its_shift() {
    let plane = grid(6, 5);
    let shifted = moved(&plane, |p| p + DVec3::Z * 0.375);
    let d = measure(&plane, &shifted, 1000);
    for side in sides(&d) {
        for value in [side.distance.max, side.distance.mean, side.distance.rms] {
            assert_close(value, 0.375, 1e-14);
        }
        assert_eq!((side.normals.mean_rad, side.normals.p95_rad, side.normals.max_rad), (0.0, 0.0, 0.0));
    }
    assert_eq!(d.symmetric(), d.forward.distance.greater(d.backward.distance));
    // Turned over, the normals are opposite.
    let turned = Mesh { faces: shifted.faces.iter().map(|&[a, b, c]| [a, c, b]).collect(), ..shifted };
    let angles = measure(&plane, &turned, 1000).forward.normals;
    assert_eq!(angles.max_rad, std::f64::consts::PI);
    assert_close(angles.p95_rad, std::f64::consts::PI, 1e-4);
}

#[test]
fn a_sphere_and_its_larger_copy() {
    let small = sphere(5);
    let large = moved(&small, |p| p * 1.25);
    let d = measure(&large, &small, 200_000);
    // A vertex at 1.25 has its closest point at the vertex at 1.
    assert_close(d.forward.distance.max, 0.25, 1e-14);
    assert_close(d.forward.worst.iter().map(|x| x * x).sum::<f64>(), 1.5625, 1e-14);
    // Every point of the small one lies under a face of the large one: at least 1.25 times the inner radius, less 1.
    let inner = small.faces.iter().map(|f| {
        let [a, b, c] = f.map(|v| small.positions[v as usize]);
        (b - a).cross(c - a).normalize().dot(a)
    });
    let inner = inner.fold(1.0, f64::min);
    assert!(d.backward.distance.max <= 0.25 && d.backward.distance.max >= 1.25 * inner - 1.0);
    for side in sides(&d) {
        assert_close(side.distance.mean, 0.25, 2e-3);
        assert_close(side.distance.rms, 0.25, 2e-3);
        assert!(side.normals.max_rad < 0.1);
    }
}

#[test]
fn a_plane_with_one_pulled_vertex() {
    // A square of two faces with the diagonal away from the pulled vertex 2:
    //   3───2      only the face 1 2 3 tilts; its height over the ground is h·(x + y − 1) for x + y > 1.
    //   │ ╲ │
    //   0───1
    let faces = [[0, 1, 3], [1, 2, 3]];
    let h = 0.125;
    let flat = mesh(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]], &faces);
    let pulled = mesh(&[[0., 0., 0.], [1., 0., 0.], [1., 1., h], [0., 1., 0.]], &faces);
    let d = measure(&pulled, &flat, 1_000_000);
    // Every point of the tilted face is over the flat one: its distance is its height z, which over a triangle with
    // corners at 0, 0, h has the mean h/3 and the mean square h²/6. The tilted face has √(1 + 2h²) times the area.
    let tilted = (1.0 + 2.0 * h * h).sqrt();
    let share = tilted / (1.0 + tilted);
    assert_eq!(d.forward.distance.max, h);
    assert_eq!(d.forward.worst, [1.0, 1.0, h]);
    assert_close(d.forward.distance.mean, share * h / 3.0, 1e-4);
    assert_close(d.forward.distance.rms, (share * h * h / 6.0).sqrt(), 1e-4);
    // Angles: zero on the flat half, the slope on the other.
    let slope = (h * 2f64.sqrt()).atan();
    assert_close(d.forward.normals.max_rad, slope, 1e-12);
    assert_close(d.forward.normals.mean_rad, share * slope, 1e-4);
    assert_close(d.forward.normals.p95_rad, slope, 1e-3);
}

/// The cube with one corner pulled out along the diagonal: the pulled faces lie outside, and a point outside is as far from
/// the cube as its coordinates exceed 1.
#[test]
fn a_cube_with_one_pulled_corner() {
    let cube = cube(1);
    let corner = cube.positions.iter().position(|&p| p == DVec3::ONE).expect("a corner") as u32;
    let mut pulled = cube.clone();
    pulled.positions[corner as usize] = DVec3::splat(1.25);
    let d = measure(&pulled, &cube, 400_000);
    assert_eq!(d.forward.distance.max, DVec3::splat(0.25).length());
    assert_eq!(d.forward.worst, [1.25; 3]);
    // By the definition: e² is the square of what exceeds 1 in each coordinate. Its integral over a triangle by the
    // midpoints of 4ᵏ parts.
    let excess = |p: DVec3| (p - DVec3::ONE).max(DVec3::ZERO).length_squared();
    let (mut area, mut integral) = (0.0, 0.0);
    for face in &pulled.faces {
        let [a, b, c] = face.map(|v| pulled.positions[v as usize]);
        let of_face = 0.5 * (b - a).cross(c - a).length();
        let n = 256;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n - i {
                let at = |u: f64, v: f64| {
                    a + (b - a) * ((f64::from(i) + u) / f64::from(n)) + (c - a) * ((f64::from(j) + v) / f64::from(n))
                };
                sum += excess(at(1.0 / 3.0, 1.0 / 3.0));
                if i + j + 1 < n {
                    sum += excess(at(2.0 / 3.0, 2.0 / 3.0));
                }
            }
        }
        area += of_face;
        integral += of_face * sum / f64::from(n * n);
    }
    assert_close(d.forward.distance.rms, (integral / area).sqrt(), 1e-3);
}

// Oracles

/// Meshes near each other, and one far away.
fn pairs() -> Vec<(&'static str, Mesh, Mesh)> {
    let statue = sample("statue", Some(2000)).unwrap();
    let coarse = simplify(&statue, &Method::default(), &Budget::keep(0.2), &cpu(1), None).unwrap().mesh;
    let part = sample("part", Some(1500)).unwrap();
    let apart = moved(&part, |p| p * 0.4 + DVec3::new(5.0, 1.0, -2.0));
    vec![("statue", statue, coarse), ("part", part, apart), ("soup", soup(300, 1), soup(200, 2))]
}

/// Triangles of all sizes: every tenth is a segment or a point, many share corners.
fn soup(faces: usize, seed: u64) -> Mesh {
    let mut random = Random(seed);
    let mut positions = Vec::new();
    for _ in 0..faces {
        let [at, size] = [4.0, 0.5].map(|s| DVec3::new(random.unit(), random.unit(), random.unit()) * s);
        positions.push(at);
        positions.push(at + size * random.unit());
        positions.push(at + DVec3::new(size.y, -size.x, size.z));
    }
    let face = |f: u32| match f % 30 {
        7 => [3 * f, 3 * f + 1, 3 * f],
        17 => [3 * f; 3],
        27 => [3 * f, 3 * f + 1, 3 * (f - 1)],
        _ => [3 * f, 3 * f + 1, 3 * f + 2],
    };
    Mesh::new(positions, (0..faces as u32).map(face).collect())
}

#[test]
fn every_sample_agrees_with_brute_force() {
    for (name, a, b) in pairs() {
        let frame = Frame::of(&a, &b);
        let (sampler, bvh) = (Sampler::new(&a, frame, 500, 1), Bvh::new(&b, frame));
        let mut counts = [0; 3];
        for (kind, indices) in sampler.chunks(Kinds::default()) {
            for sample in sampler.samples(kind, indices) {
                let p = frame.to_model(sample.position);
                let want = brute_force(p, &b);
                let hit = bvh.closest(sample.position, 0).unwrap();
                let got = frame.length_to_model(hit.distance_sq.sqrt());
                assert!((got - want).abs() <= 1e-9 * want + 1e-15 * a.diagonal(), "{name} {p}: {got}, not {want}");
                counts[kind as usize] += 1;
            }
        }
        assert!(counts[Kind::Vertex as usize] > 100 && counts[Kind::Face as usize] == 500, "{name} {counts:?}");
    }
}

#[test]
fn distances_agree_with_parry() {
    use parry3d_f64::math::Vector;
    use parry3d_f64::query::PointQuery;
    use parry3d_f64::shape::TriMesh;
    for (name, a, b) in pairs() {
        let at = |p: DVec3| Vector::new(p.x, p.y, p.z);
        // Its triangles have an area.
        let faces: Vec<[u32; 3]> = b.faces.iter().copied().filter(|[u, v, w]| u != v && v != w && w != u).collect();
        let theirs = TriMesh::new(b.positions.iter().map(|&p| at(p)).collect(), faces.clone()).expect("a mesh");
        let b = Mesh { faces, ..b };
        for (v, distance) in vertex_distances(&a, &b, &cpu(2)).unwrap().into_iter().enumerate() {
            let want = theirs.distance_to_local_point(at(a.positions[v]), false);
            assert!((distance - want).abs() <= 1e-6 * want + 1e-9, "{name} {v}: {distance}, not {want}");
        }
    }
}

/// The kinds of samples that can be chosen.
fn choices() -> Vec<Kinds> {
    let choices = (0..8).map(|bits| Kinds { vertices: bits & 1 > 0, edges: bits & 2 > 0, faces: bits & 4 > 0 });
    choices.filter(|kinds| kinds.vertices || kinds.faces).collect()
}

/// The reported figures are those of the chosen samples, added up plainly.
#[test]
fn figures_are_those_of_the_samples() {
    for (name, a, b) in pairs() {
        let frame = Frame::of(&a, &b);
        let sampler = Sampler::new(&a, frame, 600, Options::default().seed);
        let of = |kind| -> Vec<f64> {
            let samples = sampler.samples(kind, 0..sampler.indices(kind));
            samples.iter().map(|sample| brute_force(frame.to_model(sample.position), &b)).collect()
        };
        let found = [Kind::Vertex, Kind::Edge, Kind::Face].map(|kind| (kind, of(kind)));
        for kinds in choices() {
            let d = deviation(&a, &b, &Options { kinds, ..options(600) }, &cpu(2)).unwrap().forward;
            let chosen = || found.iter().filter(|(kind, _)| kinds.contains(*kind)).flat_map(|(_, all)| all);
            let means = &found[if kinds.faces { 2 } else { 0 }].1;
            let count = means.len() as f64;
            assert_eq!(d.samples, chosen().count(), "{name} {kinds:?}");
            assert_close(d.distance.max, chosen().copied().fold(0.0, f64::max), 1e-9);
            assert_close(d.distance.mean, means.iter().sum::<f64>() / count, 1e-9);
            assert_close(d.distance.rms, (means.iter().map(|d| d * d).sum::<f64>() / count).sqrt(), 1e-9);
        }
    }
}

#[test]
fn more_samples_than_anybody_waits_for_are_refused() {
    for samples in [usize::MAX, MOST_SAMPLES as usize + 1] {
        let result = deviation(&cube(1), &cube(1), &options(samples), &cpu(1));
        assert!(matches!(result, Err(Error::Parameter(_))), "{samples}: {result:?}");
    }
    assert!(options(MOST_SAMPLES as usize).check().is_ok());
}

#[test]
fn edges_alone_are_refused_and_a_surface_without_area_has_its_vertices() {
    let with = |vertices, edges, faces| Options { kinds: Kinds { vertices, edges, faces }, ..options(100) };
    for edges in [false, true] {
        let result = deviation(&cube(1), &cube(1), &with(false, edges, false), &cpu(1));
        assert!(matches!(result, Err(Error::Parameter(_))), "{result:?}");
    }
    let segment = mesh(&[[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]], &[[0, 1, 2]]);
    let shifted = moved(&segment, |p| p + DVec3::Y);
    let d = deviation(&segment, &shifted, &with(false, false, true), &cpu(1)).unwrap().forward;
    assert_eq!((d.samples, d.distance.mean), (3, 1.0));
}

// Invariances

#[test]
fn swapped_meshes_swap_the_sides() {
    for (name, a, b) in pairs() {
        let (there, back) = (measure(&a, &b, 5000), measure(&b, &a, 5000));
        assert!(there.forward == back.backward && there.backward == back.forward, "{name}");
        assert_eq!(there.symmetric(), back.symmetric(), "{name}");
    }
}

/// Where a point goes.
type Motion<'a> = &'a dyn Fn(DVec3) -> DVec3;

/// Scaling by a power of two changes no bit but the exponent; any other motion and scale moves samples by rounding only: within
/// 1e-9 of the diagonal, and a million units from the origin within 1e-6, by the digits that are left there.
#[test]
fn motion_and_scale_do_not_count() {
    let (s, c) = 0.7f64.sin_cos();
    let turn = DMat3::from_cols(DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0), DVec3::Z);
    for (name, a, b) in pairs() {
        let d = measure(&a, &b, 5000);
        let both = |by: Motion<'_>| measure(&moved(&a, by), &moved(&b, by), 5000);
        for power in [-300, -3, 5, 300] {
            let factor = 2f64.powi(power);
            let scaled = both(&|p| p * factor);
            for (side, was) in sides(&scaled).into_iter().zip(sides(&d)) {
                assert_eq!(side.distance.rms, was.distance.rms * factor, "{name} {power}");
                assert_eq!(side.distance.max, was.distance.max * factor, "{name} {power}");
                assert_eq!(side.normals, was.normals, "{name} {power}");
            }
        }
        let motions: [(Motion<'_>, f64, f64); 3] = [
            (&|p| turn * p + DVec3::new(3.0, -2.0, 1.0), 1.0, 1e-9),
            (&|p| p * 3.3, 3.3, 1e-9),
            (&|p| p + DVec3::splat(1e6), 1.0, 1e-6),
        ];
        for (by, factor, bound) in motions {
            let was_and_is = sides(&d).map(|side| side.distance).into_iter().zip(sides(&both(by)).map(|s| s.distance));
            for (was, is) in was_and_is {
                for (was, is) in [(was.rms, is.rms), (was.mean, is.mean), (was.max, is.max)] {
                    assert!((is / factor - was).abs() <= bound * d.diagonal, "{name}: {was} {}", is / factor);
                }
            }
        }
    }
}

#[test]
fn neither_threads_nor_a_gpu_change_the_bytes() {
    let gpu = gpu(&GpuOptions::default());
    for (name, mut a, mut b) in pairs() {
        // More than one batch for one of them.
        let samples = if name == "statue" { 270_000 } else { 10_000 };
        for mesh in [&mut a, &mut b] {
            mesh.colors = Some(mesh.positions.iter().map(|p| [p.x as f32 * 0.1, p.y as f32 * 0.1, 0.5, 1.0]).collect());
        }
        let bytes = |d: Deviation| serde_json::to_string(&d).expect("numbers");
        let reference = bytes(deviation(&a, &b, &options(samples), &cpu(1)).unwrap());
        assert!(reference.contains("luv"), "{reference}");
        for device in [cpu(2), cpu(5)].iter().chain(&gpu) {
            let again = bytes(deviation(&a, &b, &options(samples), device).unwrap());
            assert_eq!(again, reference, "{name}, {}", device.description());
        }
        let moved = measure(&a, &moved(&b, |p| p + DVec3::X * 1e-3), samples);
        assert!(bytes(moved) != reference, "{name}: nothing is compared");
    }
}

#[test]
fn a_lost_gpu_changes_nothing() {
    let Some(device) = gpu(&GpuOptions::default()) else { return };
    let [a, b] = [sphere(3), bumpy(sphere(3), 0.05)];
    let reference = measure(&a, &b, 5000);
    device.lose_gpu();
    assert_eq!(deviation(&a, &b, &options(5000), &device).unwrap(), reference);
}

// Small and degenerate

#[test]
fn there_is_no_distance_to_nothing() {
    let (nothing, points) = (Mesh::default(), mesh(&[[0.0; 3], [1.0; 3]], &[]));
    for empty in [&nothing, &points] {
        for (a, b, which) in [(empty, &cube(1), "first"), (&cube(1), empty, "second")] {
            let Err(Error::Mesh(message)) = deviation(a, b, &Options::default(), &cpu(1)) else { panic!("{which}") };
            assert_eq!(message, format!("the {which} mesh has no faces to compare"));
        }
        assert!(vertex_distances(&cube(1), empty, &cpu(1)).is_err());
    }
    assert_eq!(vertex_distances(&points, &cube(1), &cpu(1)).unwrap(), [0.0, 0.0]);
    let poisoned = mesh(&[[f64::NAN; 3], [1.0; 3], [0.0; 3]], &[[0, 1, 2]]);
    assert!(deviation(&cube(1), &poisoned, &Options::default(), &cpu(1)).is_err());
}

#[test]
fn one_face_against_one_face() {
    let at = |z: f64| mesh(&[[0., 0., z], [1., 0., z], [0., 1., z]], &[[0, 1, 2]]);
    let d = measure(&at(0.0), &at(2.0), 100);
    for side in sides(&d) {
        assert_eq!([side.distance.max, side.distance.mean, side.distance.rms], [2.0; 3]);
        assert!(side.samples > 103, "{}", side.samples);
    }
    let none = deviation(&at(0.0), &at(2.0), &options(0), &cpu(1)).unwrap();
    assert_eq!((none.forward.samples, none.forward.distance.rms), (3, 2.0));
}

/// A surface without area is measured at its vertices; to it the distance is that to its segments and points.
#[test]
fn surfaces_without_area_are_measured_at_their_vertices() {
    let segment = mesh(&[[0., 0., 3.], [0., 0., 3.], [4., 0., 3.]], &[[0, 1, 2], [2, 2, 0]]);
    let square = mesh(&[[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]], &[[0, 1, 2], [0, 2, 3]]);
    let d = measure(&segment, &square, 10_000);
    assert_eq!([d.forward.distance.max, d.forward.distance.mean, d.forward.distance.rms], [3.0; 3]);
    assert_eq!(d.forward.normals, coarsen::metrics::AngleSpread::default());
    // From the square: 5 at the far side, and the mean square of 9 + y² is 9 + 16/3.
    assert_eq!(d.backward.distance.max, 5.0);
    assert_close(d.backward.distance.rms, (9.0 + 16.0 / 3.0f64).sqrt(), 1e-3);
    let point = mesh(&[[1.0; 3]], &[[0, 0, 0]]);
    assert_eq!(measure(&point, &point, 10).forward.distance.max, 0.0);
    assert_eq!(measure(&point, &segment, 10).forward.distance.max, 5f64.sqrt());
}

#[test]
fn extreme_sizes_and_places_stay_finite() {
    for factor in [1e-300, 1e-160, 1e-20, 1e20, 1e160, 1e300] {
        let [a, b] = [1.0, 1.5].map(|s| moved(&cube(2), |p| (p - DVec3::splat(0.5)) * (s * factor)));
        let d = measure(&a, &b, 1000);
        assert_close(d.forward.distance.max, 0.25 * factor, 1e-12);
        assert_close(d.backward.distance.max, 0.25 * factor * 3f64.sqrt(), 1e-12);
    }
}

/// Sliver after sliver: edges far longer than the root of the area must not ask for samples without end.
#[test]
fn slivers_are_sampled_within_bounds() {
    let thin = moved(&shapes::plane(40, 40), |p| DVec3::new(p.x, p.y * 1e-9, 0.0));
    let d = measure(&thin, &thin, 10_000);
    assert!(d.forward.samples < 4 * 10_000, "{}", d.forward.samples);
}

// Sampling

#[test]
fn samples_lie_where_they_say_and_cover_the_surface() {
    let mesh = bumpy(sphere(3), 0.05);
    let frame = Frame::of(&mesh, &mesh);
    let sampler = Sampler::new(&mesh, frame, 50_000, 7);
    let mut counts = [0; 3];
    let mut per_face = vec![0.0; mesh.faces.len()];
    for (kind, indices) in sampler.chunks(Kinds::default()) {
        for sample in sampler.samples(kind, indices) {
            let corners = frame.corners(&mesh, mesh.faces[sample.face as usize]);
            let at: DVec3 = sample.weights.iter().zip(corners).map(|(&w, corner)| corner * w).sum();
            assert!(at.distance(sample.position) < 1e-15);
            assert!(sample.weights.iter().all(|&w| w >= 0.0));
            assert_eq!(sample.weights.iter().filter(|&&w| w == 0.0).count(), 2 - kind_order(kind));
            counts[kind_order(kind)] += 1;
            if kind == Kind::Face {
                per_face[sample.face as usize] += 1.0;
            }
        }
    }
    assert_eq!((counts[0], counts[2]), (mesh.positions.len(), 50_000));
    // Every edge once, at steps of the root of the area of a sample: the count follows from the lengths.
    let step = (mesh.area() / 50_000.0).sqrt();
    let half_edges = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).filter(|[a, b]| a < b);
    let length = |[a, b]: [u32; 2]| mesh.positions[a as usize].distance(mesh.positions[b as usize]);
    let want: usize = half_edges.map(|edge| ((length(edge) / step) as usize).saturating_sub(1)).sum();
    assert!(want > 0 && counts[1].abs_diff(want) <= want / 1000, "{} {want}", counts[1]);
    // Stratified: a face has its share of the samples to within two.
    for (f, count) in per_face.into_iter().enumerate() {
        let [a, b, c] = mesh.faces[f].map(|v| mesh.positions[v as usize]);
        let share = 0.5 * (b - a).cross(c - a).length() / mesh.area() * 50_000.0;
        assert!((count - share).abs() <= 2.0, "{f}: {count} {share}");
    }
}

fn kind_order(kind: Kind) -> usize {
    match kind {
        Kind::Vertex => 0,
        Kind::Edge => 1,
        Kind::Face => 2,
    }
}

/// Seeds move the samples and hardly the figures.
#[test]
fn seeds_agree() {
    let [a, b] = [sphere(4), bumpy(sphere(4), 0.02)];
    let with = |seed| deviation(&a, &b, &Options { seed, ..options(100_000) }, &cpu(2)).unwrap().forward.distance;
    let [one, other] = [1, 2].map(with);
    assert!(one.rms != other.rms);
    assert_close(one.rms, other.rms, 1e-3);
    assert_close(one.max, other.max, 1e-3);
}
