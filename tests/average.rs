//! Average quadrics and the formats that store them: the identities of the definition, known answers, bounds. [Yu14]

mod support;

use coarsen::backend::Queue;
use coarsen::contract::{
    Metric, Options, Placement, PlaneWeight, QuadricFormat, QuadricFrame, Quadrics, Weighting, initial_quadrics,
};
use coarsen::kernel::block_maxima::BlockMaxima;
use coarsen::kernel::decode_quadrics::{DecodeQuadrics, entries_of};
use coarsen::kernel::encode_quadrics::{EncodeQuadrics, word_count};
use coarsen::kernel::format_frame::FormatFrame;
use coarsen::kernel::pair_quadric::AT_ENDS;
use coarsen::kernel::plane_costs::{Params, PlaneRows};
use coarsen::kernel::quadric_bounds::QuadricBounds;
use coarsen::kernel::quadric_format::{F16, F32, LOCAL8, LOCAL16, RGBA8, SNORM16};
use coarsen::kernel::rows::{BORDER, Face, PlaneQuadric, Position, QuadricBound};
use coarsen::math::DVec3;
use coarsen::mesh::{Rings, sample, shapes};
use coarsen::simplify::MOVED;
use coarsen::{Budget, Error, Mesh, Method, simplify};
use support::average::{Entries, at, averages_of_padded, greatest, meshes, normalized, outer, planes, sum, times};
use support::deviation::{Random, deviation};
use support::engine::{bytes, contract, cpu, plane_quadrics};
use support::shapes::{bumpy, grid, sphere};

const FORMATS: [u32; 6] = [F32, F16, SNORM16, RGBA8, LOCAL16, LOCAL8];

// What the library finds

fn averaged(format: QuadricFormat, frame: QuadricFrame) -> Options {
    Options { quadrics: Quadrics { format: Some(format), frame, planes: PlaneWeight::One }, ..Options::averaged() }
}

/// The kernels on a mesh as it is, on the host.
struct Scene {
    positions: Vec<Position>,
    quadrics: Vec<PlaneQuadric>,
    bound: QuadricBound,
    words: Vec<Vec<u32>>,
    decoded: Vec<Vec<PlaneQuadric>>,
}

impl Scene {
    /// With every ring padded to `slots` faces by one without area, whose plane is zero; 0 for the rings as they are.
    fn new(mesh: &Mesh, slots: usize, frame: FormatFrame) -> Self {
        let mut queue = cpu(2).cpu_queue();
        let mut faces: Vec<Face> = mesh.faces.iter().map(|&[a, b, c]| Face { a, b, c }).collect();
        let Rings { starts, faces: rings } = Rings::new(&mesh.faces, mesh.positions.len());
        let zero = faces.len() as u32;
        // Of a vertex of its own, or it would count as a face at the edges of another.
        let apart = mesh.positions.len() as u32;
        faces.push(Face { a: apart, b: apart, c: apart });
        let (mut padded_starts, mut padded) = (vec![0], Vec::new());
        for ends in starts.windows(2) {
            let ring = &rings[ends[0] as usize..ends[1] as usize];
            padded.extend(ring.iter().copied().chain(std::iter::repeat_n(zero, slots.saturating_sub(ring.len()))));
            padded_starts.push(padded.len() as u32);
        }
        let open = coarsen::mesh::topology(mesh).border_edges > 0;
        let row = |p: &DVec3| {
            let [x, y, z] = p.as_vec3().to_array();
            Position { x, y, z, flags: if open { BORDER } else { 0 } }
        };
        let positions: Vec<Position> = mesh.positions.iter().chain([&DVec3::ZERO]).map(row).collect();
        Self::run(&mut queue, positions, faces, [padded_starts, padded], frame)
    }

    fn run(
        queue: &mut Queue,
        rows: Vec<Position>,
        faces: Vec<Face>,
        [starts, rings]: [Vec<u32>; 2],
        frame: FormatFrame,
    ) -> Self {
        let count = rows.len() - 1;
        let vertex_count = count as u32;
        let positions = &queue.buffer_from(rows.clone()).expect("memory");
        let faces = &queue.buffer_from(faces).expect("memory");
        let ring_starts = &queue.buffer_from(starts).expect("memory");
        let ring_faces = &queue.buffer_from(rings).expect("memory");
        let (normals, quadrics) =
            &plane_quadrics(queue, [ring_starts, ring_faces], (positions, faces), vertex_count, PlaneWeight::One);
        let bounds = &mut queue.buffer(count).expect("memory");
        let all =
            QuadricBounds { positions, faces, ring_starts, ring_faces, normals, quadrics, vertex_count, frame, bounds };
        queue.run(all).expect("a kernel on the host");
        let mut bound = queue.buffer_from(bounds.host().to_vec()).expect("memory");
        while bound.len() > 1 {
            let mut maxima = queue.buffer(bound.len().div_ceil(256)).expect("memory");
            let bound_count = bound.len() as u32;
            queue.run(BlockMaxima { bounds: &bound, bound_count, maxima: &mut maxima }).expect("a kernel on the host");
            bound = maxima;
        }
        let (mut all_words, mut all_decoded) = (Vec::new(), Vec::new());
        for format in FORMATS {
            let (bound, words) = (&bound, &mut queue.buffer(word_count(format, count)).expect("memory"));
            queue
                .run(EncodeQuadrics { positions, quadrics, bound, vertex_count, frame, format, words })
                .expect("a kernel on the host");
            let decoded = &mut queue.buffer(count).expect("memory");
            queue
                .run(DecodeQuadrics { positions, words, bound, vertex_count, frame, format, quadrics: decoded })
                .expect("a kernel on the host");
            all_words.push(words.host().to_vec());
            all_decoded.push(decoded.host().to_vec());
        }
        Self {
            positions: rows,
            quadrics: quadrics.host().to_vec(),
            bound: bound.host()[0],
            words: all_words,
            decoded: all_decoded,
        }
    }
}

const OWN: FormatFrame = FormatFrame { origin_x: 0.0, origin_y: 0.0, origin_z: 0.0, unit: 1.0 };

fn entries(average: [f32; 10]) -> Entries {
    average.map(f64::from)
}

fn greatest_entry(q: Entries) -> f64 {
    q.into_iter().map(f64::abs).fold(0.0, f64::max)
}

// Identities

#[test]
fn averages_are_bounded_and_their_multiples_are_the_sums() {
    for (name, raw) in meshes() {
        for mesh in [normalized(&raw), raw] {
            let planes = planes(&mesh);
            let (max_num, max_d2) = greatest(&planes);
            let averages = averages_of_padded(&planes, max_num);
            for (v, (&average, planes)) in averages.iter().zip(&planes).enumerate() {
                assert!(greatest_entry(average) <= 1.0, "{name}, {v}: {average:?}");
                let whole = times(average, max_num as f64 * max_d2.max(1.0));
                let sum = sum(planes.iter().map(|&plane| outer(plane)));
                let off = (0..10).map(|i| (whole[i] - sum[i]).abs()).fold(0.0, f64::max);
                assert!(off <= 1e-12 * greatest_entry(sum), "{name}, {v}: {off:e}");
                let trace = average[0] + average[4] + average[7];
                let expected = planes.len() as f64 / (max_num as f64 * max_d2.max(1.0));
                assert!((trace - expected).abs() < 1e-12, "{name}, {v}: a trace of {trace}, not {expected}");
                // What is uploaded as a color.
                assert!(average.iter().all(|q| (0.0..=1.0).contains(&((q + 1.0) / 2.0))));
            }
            // Longer lists divide by more, and nothing else.
            let longer = averages_of_padded(&planes, max_num + 5);
            for (average, longer) in averages.iter().zip(longer) {
                let again = times(longer, (max_num + 5) as f64 / max_num as f64);
                assert!((0..10).all(|i| (average[i] - again[i]).abs() < 1e-14), "{name}");
            }
        }
    }
}

#[test]
fn averages_order_pairs_as_sums_do() {
    for (name, mesh) in meshes() {
        let planes = planes(&mesh);
        let (max_num, _) = greatest(&planes);
        let sums: Vec<Entries> = planes.iter().map(|planes| sum(planes.iter().map(|&plane| outer(plane)))).collect();
        let averages = averages_of_padded(&planes, max_num);
        let mut costs: Vec<(f64, f64)> = Vec::new();
        for [a, b, c] in &mesh.faces {
            for [u, w] in [[a, b], [b, c], [c, a]].map(|pair| pair.map(|&v| v as usize)) {
                let cost = |of: &[Entries]| {
                    let both = sum([of[u], of[w]]);
                    at(both, mesh.positions[u]).min(at(both, mesh.positions[w]))
                };
                costs.push((cost(&sums), cost(&averages)));
            }
        }
        costs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let scale = costs.last().map_or(0.0, |last| last.0);
        let clear = costs.windows(2).filter(|pair| pair[1].0 - pair[0].0 > 1e-9 * scale);
        assert!(clear.clone().count() > 20, "{name}: all pairs cost the same");
        assert!(clear.clone().all(|pair| pair[0].1 < pair[1].1), "{name}");
    }
}

#[test]
fn stored_averages_are_those_of_the_definition() {
    for (name, mesh) in meshes() {
        for (frame, own) in [(QuadricFrame::Normalized, normalized(&mesh)), (QuadricFrame::Raw, mesh.clone())] {
            let planes = planes(&own);
            let (max_num, max_d2) = greatest(&planes);
            let averages = averages_of_padded(&planes, max_num);
            let found = initial_quadrics(&mesh, &averaged(QuadricFormat::F32, frame), &cpu(2)).expect("a valid mesh");
            assert_eq!(found.record.max_num, max_num as f32, "{name}: the greatest number of planes");
            let off = (f64::from(found.record.max_d2) / max_d2 - 1.0).abs();
            assert!(off < 2e-5, "{name}, {frame:?}: {} is not {max_d2}", found.record.max_d2);
            assert_eq!(found.vertices.len(), mesh.positions.len(), "{name}");
            let worst = (found.vertices.iter().enumerate())
                .map(|(i, &v)| {
                    let (stored, average) = (entries(found.average(i).expect("a vertex")), averages[v as usize]);
                    (0..10).map(|k| (stored[k] - average[k]).abs()).fold(0.0, f64::max)
                })
                .fold(0.0, f64::max);
            // A normal of a small face in single precision.
            assert!(worst < 1e-5, "{name}, {frame:?}: off by {worst:e}");
        }
    }
}

#[test]
fn every_format_stays_within_its_bound() {
    for (name, mesh) in meshes() {
        for frame in [QuadricFrame::Normalized, QuadricFrame::Raw] {
            let in_full = |format: QuadricFormat| {
                let frame = if format.is_local() { QuadricFrame::Normalized } else { frame };
                initial_quadrics(&mesh, &averaged(format, frame), &cpu(1)).expect("a valid mesh")
            };
            let exact = in_full(QuadricFormat::F32);
            for format in QuadricFormat::ALL {
                let found = in_full(format);
                assert_eq!(found.words.len() * 4, found.vertices.len().next_multiple_of(2) * format.bytes() as usize);
                assert_eq!(found.vertices, exact.vertices);
                let scale = if format.is_local() { f64::from(exact.record.max_d2.max(1.0)) } else { 1.0 };
                for i in 0..found.vertices.len() {
                    let (stored, whole) =
                        (entries(found.average(i).expect("a vertex")), entries(exact.average(i).expect("a vertex")));
                    assert!(greatest_entry(stored) <= 1.0, "{name}, {format:?}: {stored:?}");
                    for k in (0..10).filter(|k| !format.is_local() || ![3, 6, 8, 9].contains(k)) {
                        let off = (stored[k] - whole[k] * scale).abs();
                        assert!(
                            off <= format.entry_bound() * 1.005 + 1e-6,
                            "{name}, {format:?}: entry {k} off {off:e}"
                        );
                    }
                    let trace = stored[0] + stored[4] + stored[7];
                    let expected = (whole[0] + whole[4] + whole[7]) * scale;
                    assert!((trace - expected).abs() <= 3.1 * format.entry_bound() + 1e-6, "{name}, {format:?}");
                }
            }
        }
    }
}

/// A point in or near the box of a mesh.
fn somewhere(mesh: &Mesh, random: &mut Random) -> DVec3 {
    let (low, high) = mesh.bounds();
    low + (high - low) * DVec3::from_array([(); 3].map(|()| random.unit()))
}

#[test]
fn squared_distances_stay_within_the_bound() {
    for (name, mesh) in meshes() {
        let mesh = normalized(&mesh);
        let (planes, scene) = (planes(&mesh), Scene::new(&mesh, 0, OWN));
        let mut random = Random(7);
        for ((format, code), decoded) in QuadricFormat::ALL.into_iter().zip(FORMATS).zip(&scene.decoded) {
            let record =
                initial_quadrics(&mesh, &averaged(format, QuadricFrame::Normalized), &cpu(1)).expect("a mesh").record;
            let (mut worst, mut closest) = (f64::NEG_INFINITY, f64::INFINITY);
            for (v, (planes, q)) in planes.iter().zip(decoded).enumerate() {
                let x = somewhere(&mesh, &mut random);
                let y = x - scene.positions[v].xyz().as_dvec3();
                let a = [q.xx, q.xy, q.xz, q.bx, q.yy, q.yz, q.by, q.zz, q.bz, q.c];
                let exact: f64 = planes.iter().map(|p| (p[0] * x.x + p[1] * x.y + p[2] * x.z + p[3]).powi(2)).sum();
                let off = (at(entries(a), y) - exact).abs();
                let from = if format.is_local() { y } else { x };
                // Arithmetic in single precision on top.
                let bound = record.cost_bound(from.abs().element_sum()) * 1.005 + 1e-5 * f64::from(record.max_num);
                worst = worst.max(off / bound);
                closest = closest.min(off / bound);
            }
            assert!(worst <= 1.0, "{name}, {format:?}: {worst} times the bound");
            assert!(code == F32 || worst > 1e-3, "{name}, {format:?}: {worst} of the bound, which bounds nothing");
            assert!(closest < worst);
        }
    }
}

#[test]
fn a_local_quadric_is_the_global_one_where_it_begins() {
    for (name, mesh) in meshes() {
        let mesh = normalized(&mesh);
        let (planes, scene) = (planes(&mesh), Scene::new(&mesh, 0, OWN));
        let mut random = Random(3);
        for (v, (planes, q)) in planes.iter().zip(&scene.quadrics).enumerate() {
            assert_eq!([q.bx, q.by, q.bz, q.c], [0.0; 4]);
            let u = mesh.positions[v];
            let global = sum(planes.iter().map(|&plane| outer(plane)));
            let local = [q.xx, q.xy, q.xz, 0.0, q.yy, q.yz, 0.0, q.zz, 0.0, 0.0];
            for _ in 0..4 {
                let x = somewhere(&mesh, &mut random);
                let off = (at(entries(local), x - u) - at(global, x)).abs();
                // Normals are of positions in single precision.
                assert!(off < 1e-5 * planes.len() as f64, "{name}, {v}: {off:e}");
            }
        }
        // Zero at the vertex itself, whatever is rounded.
        for decoded in &scene.decoded[4..] {
            assert!(decoded.iter().all(|q| [q.bx, q.by, q.bz, q.c] == [0.0; 4] && q.weight >= 0.0), "{name}");
        }
    }
}

#[test]
fn costs_of_single_precision_agree() {
    let mesh = normalized(&bumpy(sphere(1), 0.1));
    let scene = Scene::new(&mesh, 0, OWN);
    let mut queue = cpu(1).cpu_queue();
    let positions = &queue.buffer_from(scene.positions.clone()).expect("memory");
    let faces = &queue.buffer_from(vec![Face::default()]).expect("memory");
    let mut costs = |quadrics: &[PlaneQuadric]| -> Vec<f32> {
        let quadrics = &queue.buffer_from(quadrics.to_vec()).expect("memory");
        let rows = PlaneRows::on_host(positions, faces, quadrics, Params::new(AT_ENDS));
        let edges = mesh.faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|edge| f32::from_bits(rows.key_apart(edge))).collect()
    };
    let (exact, stored) = (costs(&scene.quadrics), costs(&scene.decoded[0]));
    for (exact, stored) in exact.iter().zip(&stored) {
        assert!((stored / exact - 1.0).abs() < 1e-5, "{stored} instead of {exact}");
    }
    // Of 8 bits they do not, or nothing was stored at all.
    assert!(costs(&scene.decoded[3]).iter().zip(&exact).any(|(stored, exact)| (stored / exact - 1.0).abs() > 0.01));
}

// Layouts and edge cases

#[test]
fn padding_changes_nothing() {
    for (name, mesh) in meshes() {
        let rows = Scene::new(&mesh, 0, OWN);
        let (max_num, _) = greatest(&planes(&mesh));
        // All rings of one length: slot k of vertex v is number v·slots + k, one transposition from a column a slot.
        for slots in [max_num, max_num + 3] {
            let padded = Scene::new(&mesh, slots, OWN);
            assert!(padded.quadrics == rows.quadrics, "{name}");
            assert_eq!(padded.bound, rows.bound, "{name}");
            assert!(padded.words == rows.words && padded.decoded == rows.decoded, "{name}");
        }
    }
}

#[test]
fn faces_without_area_and_vertices_without_faces_add_nothing() {
    let ball = bumpy(sphere(2), 0.1);
    let mut more = ball.clone();
    // A vertex of no face, and a face along the edge of another.
    more.positions.push(DVec3::splat(0.3));
    let [a, b, _] = more.faces[0];
    more.positions.push(more.positions[a as usize].midpoint(more.positions[b as usize]));
    let [plain, scene] = [&ball, &more].map(|mesh| Scene::new(mesh, 0, OWN));
    assert!(scene.quadrics[..plain.quadrics.len()] == plain.quadrics[..]);
    let alone = ball.positions.len() as u32;
    for (format, words) in FORMATS.into_iter().zip(&scene.words) {
        let [nothing, plain_first] = [entries_of(alone, words, format), entries_of(0, words, format)];
        // The patent's pixels have no zero.
        let zero = if format == RGBA8 { 1.01 / 255.0 } else { 0.0 };
        assert!(nothing.iter().all(|x| x.abs() <= zero), "{format}: {nothing:?}");
        assert!(plain_first.iter().any(|x| x.abs() > 0.1));
    }
    assert!(scene.decoded.iter().flatten().all(|q| q.c.is_finite() && q.weight.is_finite()));

    let line = Mesh::new([0.0, 1.0, 2.0, 3.0].map(|x| DVec3::X * x).to_vec(), vec![[0, 1, 2], [1, 2, 3]]);
    let result = simplify(&line, &Method::Contract(Options::averaged()), &Budget::faces(1), &cpu(1), None);
    assert!(matches!(&result, Err(Error::Mesh(reason)) if reason.contains("no face has an area")), "{result:?}");
    // Without a format there is nothing to divide by.
    let full = Options { quadrics: Quadrics::default(), ..Options::averaged() };
    assert!(simplify(&line, &Method::Contract(full), &Budget::faces(1), &cpu(1), None).is_ok());
}

/// Two flat sides that meet at their rim, about the origin: every plane holds it.
fn pillow(cells: u32) -> Mesh {
    let mut mesh = grid(cells, cells);
    let half = f64::from(cells) / 2.0;
    mesh.positions.iter_mut().for_each(|p| *p -= DVec3::new(half, half, 0.0));
    let upper = mesh.positions.clone();
    let mut below: Vec<u32> = (0..).take(upper.len()).collect();
    for (own, p) in below.iter_mut().zip(&upper) {
        if p.abs().max_element() < half {
            *own = mesh.positions.len() as u32;
            // A little aside, for vertices at one position would be joined.
            mesh.positions.push(p + DVec3::new(0.25, 0.125, 0.0));
        }
    }
    let lower: Vec<[u32; 3]> = mesh.faces.iter().map(|&[a, b, c]| [a, c, b].map(|v| below[v as usize])).collect();
    mesh.faces.extend(lower);
    mesh
}

#[test]
fn planes_at_no_distance_and_at_one() {
    let flat = pillow(6);
    for frame in [QuadricFrame::Normalized, QuadricFrame::Raw] {
        let found = initial_quadrics(&flat, &averaged(QuadricFormat::F32, frame), &cpu(1)).expect("a valid mesh");
        assert_eq!(found.record.max_d2, 0.0);
        assert!(
            (0..found.vertices.len())
                .all(|i| found.average(i).expect("a vertex")[7] > 0.0 && found.average(i).expect("a vertex")[9] == 0.0)
        );
        for format in QuadricFormat::ALL.into_iter().filter(|f| frame == QuadricFrame::Normalized || !f.is_local()) {
            let outcome = contract(&flat, &averaged(format, frame), Budget::faces(60));
            assert!(outcome.mesh.positions.iter().all(|p| p.z.abs() < 1e-3), "{format:?}");
        }
    }
    // The planes of this cube are 1 away: dividing by √1 and not dividing are one.
    let mut cube = shapes::cube(4);
    let (low, high) = cube.bounds();
    cube.positions.iter_mut().for_each(|p| *p = (*p - low) / (high - low) * 2.0 - 1.0);
    let found = initial_quadrics(&cube, &averaged(QuadricFormat::F32, QuadricFrame::Raw), &cpu(1)).expect("a mesh");
    assert_eq!(found.record.max_d2, 1.0);
    let max_num = f64::from(found.record.max_num);
    let (planes, averages) =
        (planes(&cube), (0..found.vertices.len()).map(|i| entries(found.average(i).expect("a vertex"))));
    for (average, &v) in averages.zip(&found.vertices) {
        let expected = times(sum(planes[v as usize].iter().map(|&plane| outer(plane))), 1.0 / max_num);
        assert!((0..10).all(|k| (average[k] - expected[k]).abs() < 1e-6), "{average:?}, not {expected:?}");
    }
}

// The engine

#[test]
fn formats_reach_the_rounds() {
    let mesh = sample("part", Some(6000)).expect("a sample");
    let run = |quadrics: Quadrics, placement| {
        let options = Options { quadrics, placement, ..Options::averaged() };
        contract(&mesh, &options, Budget::faces(600))
    };
    let off = |outcome: &coarsen::Outcome| deviation(&mesh, &outcome.mesh, 20_000).rms;
    let averaged = Options::averaged().quadrics;
    for placement in [Placement::Optimal, Placement::Endpoint] {
        let full = run(Quadrics { format: None, ..averaged }, placement);
        assert_eq!(full.quadrics, None);
        for format in QuadricFormat::ALL {
            let outcome = run(Quadrics { format: Some(format), ..averaged }, placement);
            let record = outcome.quadrics.expect("a format was asked for");
            assert_eq!((record.format, outcome.mesh.faces.len()), (format, 600));
            assert!(record.max_num >= 6.0 && record.max_d2 > 0.0 && record.max_d2 <= 1.0, "{record:?}");
            assert!(record.secs > 0.0 && record.secs < outcome.seconds.total);
            let fine = matches!(format, QuadricFormat::F32 | QuadricFormat::Local16);
            let ratio = off(&outcome) / off(&full);
            assert!(!fine || (0.7..1.3).contains(&ratio), "{format:?}, {placement:?}: {ratio} times the deviation");
            if placement == Placement::Endpoint {
                assert!(outcome.vertex_origin.iter().all(|&origin| origin != MOVED), "{format:?}");
            }
        }
        // A few bits tell.
        let coarse = run(Quadrics { format: Some(QuadricFormat::Rgba8), ..averaged }, placement);
        assert!(off(&coarse) > 2.0 * off(&full), "{placement:?}");
    }
    // By area too, and with features.
    for options in [Options { metric: Metric::Plane, ..Options::default() }, Options::feature_weighted()] {
        let stored = Quadrics { format: Some(QuadricFormat::Local16), ..Quadrics::default() };
        let [plain, stored] = [Quadrics::default(), stored]
            .map(|quadrics| contract(&mesh, &Options { quadrics, ..options.clone() }, Budget::faces(600)));
        let ratio = off(&stored) / off(&plain);
        assert!((0.7..1.3).contains(&ratio), "{ratio}");
        assert!(stored.quadrics.is_some() && bytes(&stored.mesh) != bytes(&plain.mesh));
    }
}

#[test]
fn planes_that_count_alike_are_another_metric() {
    let mesh = sample("statue", Some(3000)).expect("a sample");
    let by_area = Options { metric: Metric::Plane, ..Options::default() };
    let alike = Options { quadrics: Quadrics { planes: PlaneWeight::One, ..Quadrics::default() }, ..by_area.clone() };
    assert_eq!(
        Options { quadrics: Quadrics { format: None, ..Options::averaged().quadrics }, ..Options::averaged() },
        alike
    );
    let [by_area, alike] = [by_area, alike].map(|options| contract(&mesh, &options, Budget::keep(0.1)));
    assert_eq!(by_area.mesh.faces.len(), alike.mesh.faces.len());
    assert!(bytes(&by_area.mesh) != bytes(&alike.mesh));
}

#[test]
fn what_has_no_quadrics_to_store_is_refused() {
    let ball = sphere(1);
    let stored = |format, frame| Quadrics { format, frame, planes: PlaneWeight::One };
    let bad = [
        (Metric::Volume, stored(None, QuadricFrame::Normalized), "for the metric 'plane'"),
        (Metric::Volume, stored(Some(QuadricFormat::Local8), QuadricFrame::Normalized), "for the metric 'plane'"),
        (Metric::Plane, stored(None, QuadricFrame::Raw), "about one origin"),
        (Metric::Plane, stored(Some(QuadricFormat::Local16), QuadricFrame::Raw), "about one origin"),
    ];
    for (metric, quadrics, part) in bad {
        let options = Options { metric, quadrics, ..Options::default() };
        let result = simplify(&ball, &Method::Contract(options), &Budget::faces(8), &cpu(1), None);
        assert!(matches!(&result, Err(Error::Parameter(text)) if text.contains(part)), "{quadrics:?}: {result:?}");
    }
    let mut vast = ball.clone();
    vast.positions.iter_mut().for_each(|p| *p *= 1e20);
    let raw = averaged(QuadricFormat::F32, QuadricFrame::Raw);
    let result = simplify(&vast, &Method::Contract(raw), &Budget::faces(8), &cpu(1), None);
    assert!(matches!(&result, Err(Error::Parameter(text)) if text.contains("raw coordinates")), "{result:?}");
    let full = Options { weighting: Weighting::Uniform, quadrics: Quadrics::default(), ..Options::averaged() };
    assert!(matches!(initial_quadrics(&ball, &full, &cpu(1)), Err(Error::Parameter(_))));
}
