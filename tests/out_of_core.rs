//! Contraction in parts: no cracks, the exact count, the same bytes on every device, nothing left on the disk.

mod support;

use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use coarsen::backend::{Device, GpuOptions};
use coarsen::contract::{Attributes, Dropped, Metric, Normals, Options};
use coarsen::formats::{self, WriteOptions};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::{sample, shapes};
use coarsen::out_of_core::{self, Input, Outcome, Pass};
use coarsen::simplify::Progress;
use coarsen::{Budget, Error, Mesh, Method, StopReason, metrics};
use support::engine::{bytes, contract, cpu, gpu, options};
use support::independent::topology;
use support::models;

/// A folder with an input, and another for scratch files.
struct Bench {
    folder: tempfile::TempDir,
    scratch: tempfile::TempDir,
}

/// Enough for any of the meshes here in one piece.
const PLENTY: u64 = 1 << 30;
/// The least for them in parts, about.
const LITTLE: u64 = 105 << 20;

impl Bench {
    fn new(mesh: &Mesh) -> Self {
        let bench =
            Self { folder: tempfile::tempdir().expect("a folder"), scratch: tempfile::tempdir().expect("a folder") };
        formats::write(mesh, &bench.path(), &WriteOptions::default()).expect("a mesh to write");
        bench
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("in.ply")
    }

    fn run_on(
        &self,
        device: &Device,
        method: &Method,
        budget: Budget,
        limit: u64,
        most: usize,
    ) -> coarsen::Result<Outcome> {
        let options =
            out_of_core::Options { memory_limit: limit, part_faces: Some(most), scratch: self.scratch.path().into() };
        let result = Input::open(&self.path())
            .and_then(|input| out_of_core::simplify(&input, method, &budget, &options, device, None));
        assert_eq!(entries(self.scratch.path()), 0, "scratch files stay");
        result
    }

    /// In parts of `most` faces with the default options.
    fn run(&self, budget: Budget, most: usize) -> Outcome {
        self.run_on(&cpu(2), &Method::default(), budget, PLENTY, most).expect("a valid mesh and budget")
    }

    fn error(&self, limit: u64, most: usize) -> Error {
        self.run_on(&cpu(1), &Method::default(), Budget::faces(100), limit, most).expect_err("a fault")
    }
}

fn entries(folder: &Path) -> usize {
    fs::read_dir(folder).expect("the folder").count()
}

/// Every face with vertices of its own.
fn soup(mesh: &Mesh) -> Mesh {
    let positions = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    Mesh::new(positions, (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect())
}

#[test]
fn closed_meshes_stay_closed_and_as_they_are_connected() {
    for (name, faces, target, most) in
        [("statue", 30_000, 2_000, 4_000), ("part", 40_000, 3_000, 3_000), ("assembly", 50_000, 9_000, 7_000)]
    {
        let mesh = sample(name, Some(faces)).expect("a sample");
        let Outcome { outcome, passes, .. } = Bench::new(&mesh).run(Budget::faces(target), most);
        let (before, after) = (topology(&mesh), topology(&outcome.mesh));
        assert_eq!((after.components, after.euler, after.border_edges), (before.components, before.euler, 0), "{name}");
        assert_eq!((outcome.mesh.faces.len(), outcome.stop), (target, StopReason::FacesReached), "{name}");
        assert_eq!((outcome.faces_in, outcome.target), (mesh.faces.len(), target), "{name}");
        assert!(passes.len() == 1 && passes[0].parts >= mesh.faces.len() / most, "{name}: {passes:?}");
        assert!(outcome.error_estimate >= passes[0].error_estimate && passes[0].frozen > 0, "{name}: {passes:?}");
        // Where parts part is no fault of the mesh.
        assert!(outcome.warnings.is_empty(), "{name}: {:?}", outcome.warnings);
    }
}

#[test]
fn an_open_mesh_keeps_its_border() {
    let mesh = sample("terrain", Some(30_000)).expect("a sample");
    let result = Bench::new(&mesh).run(Budget::faces(1_500), 4_000).outcome.mesh;
    let (before, after) = (topology(&mesh), topology(&result));
    assert_eq!((after.euler, after.border_loops, after.components), (before.euler, before.border_loops, 1));
}

#[test]
fn the_bytes_depend_on_no_thread_and_no_device() {
    let mesh = sample("statue", Some(60_000)).expect("a sample");
    let bench = Bench::new(&mesh);
    for metric in [Metric::Volume, Metric::Plane] {
        let method = Method::Contract(options(metric));
        let run = |device: &Device| {
            let Outcome { outcome, passes, .. } =
                bench.run_on(device, &method, Budget::faces(3_000), PLENTY, 20_000).expect("a valid mesh");
            let facts = passes.iter().map(|pass| Pass { cut_seconds: 0.0, seconds: 0.0, ..*pass });
            (bytes(&outcome.mesh), outcome.error_estimate.to_bits(), format!("{:?}", facts.collect::<Vec<_>>()))
        };
        let reference = run(&cpu(1));
        for threads in [2, 5] {
            assert!(run(&cpu(threads)) == reference, "{metric:?}, {threads} threads");
        }
        let on_gpu = GpuOptions { handover_faces: Some(2_000), ..GpuOptions::default() };
        if let Some(device) = gpu(&on_gpu) {
            assert!(run(&device) == reference, "{metric:?}, {}", device.description());
        }
    }
}

#[test]
fn parts_are_cut_again_until_they_fit() {
    let mesh = sample("statue", Some(200_000)).expect("a sample");
    let bench = Bench::new(&mesh);
    let Outcome { outcome, passes, .. } =
        bench.run_on(&cpu(2), &Method::default(), Budget::faces(2_000), LITTLE, 150).expect("enough memory");
    assert!(passes.len() > 1 && passes[1].faces_in == passes[0].faces_out, "{passes:?}");
    assert_eq!(outcome.mesh.faces.len(), 2_000);
    let after = topology(&outcome.mesh);
    assert_eq!((after.components, after.euler, after.border_edges), (1, 2, 0));
    assert!(outcome.error_estimate >= passes.iter().map(|pass| pass.error_estimate).sum());
}

#[test]
fn vertices_that_repeat_positions_do_not_crack() {
    let mesh = sample("part", Some(30_000)).expect("a sample");
    let run = |mesh: &Mesh| Bench::new(mesh).run(Budget::faces(2_000), 3_000);
    let (joined, Outcome { outcome, passes, .. }) = (run(&mesh).passes, run(&soup(&mesh)));
    let result = outcome.mesh;
    let ratio = passes[0].error_limit / joined[0].error_limit;
    assert!(ratio > 0.5 && ratio < 2.0, "{ratio} times the limit of joined vertices");
    let (before, after) = (topology(&mesh), topology(&result));
    assert_eq!((result.faces.len(), after.euler, after.border_edges), (2_000, before.euler, 0));
}

#[test]
fn stl_has_no_cracks_either() {
    let mesh = sample("part", Some(30_000)).expect("a sample");
    let bench = Bench::new(&mesh);
    let path = bench.folder.path().join("in.stl");
    formats::write(&mesh, &path, &WriteOptions::default()).expect("a mesh to write");
    let input = Input::open(&path).expect("a binary STL");
    assert_eq!((input.faces(), input.vertices()), (mesh.faces.len(), 3 * mesh.faces.len()));
    let options =
        out_of_core::Options { memory_limit: PLENTY, part_faces: Some(3_000), scratch: bench.scratch.path().into() };
    let run = |method: &Method, device: &Device| {
        out_of_core::simplify(&input, method, &Budget::faces(2_000), &options, device, None)
    };
    let outcome = run(&Method::default(), &cpu(2)).expect("a valid mesh");
    let (before, after) = (topology(&mesh), topology(&outcome.outcome.mesh));
    assert_eq!((outcome.outcome.mesh.faces.len(), after.euler, after.border_edges), (2_000, before.euler, 0));
    assert!(outcome.passes[0].parts > 9);
    let again = run(&Method::default(), &cpu(1)).expect("a valid mesh").outcome.mesh;
    assert!(bytes(&again) == bytes(&outcome.outcome.mesh));
    let apart = Method::Contract(Options { weld: None, ..Options::default() });
    assert!(matches!(run(&apart, &cpu(1)), Err(Error::Unsupported(_))));
}

#[test]
fn without_welding_repeats_stay_apart() {
    let ball = shapes::icosphere(4);
    let bench = Bench::new(&soup(&ball));
    let method = Method::Contract(Options { weld: None, ..Options::default() });
    let outcome = bench.run_on(&cpu(1), &method, Budget::keep(0.5), PLENTY, 1_000).expect("a valid mesh").outcome;
    let Method::Contract(options) = &method else { return };
    let whole = contract(&soup(&ball), options, Budget::keep(0.5));
    assert_eq!((outcome.stop, outcome.mesh.faces.len()), (whole.stop, whole.mesh.faces.len()));
}

#[test]
fn the_deviation_is_that_of_one_piece() {
    for (name, faces, target, most) in [("statue", 300_000, 3_000, 30_000), ("part", 100_000, 2_000, 10_000)] {
        let mesh = sample(name, Some(faces)).expect("a sample");
        let parts = Bench::new(&mesh).run(Budget::faces(target), most).outcome.mesh;
        let whole = contract(&mesh, &Options::default(), Budget::faces(target)).mesh;
        let samples = metrics::Options { samples: Some(300_000), ..metrics::Options::default() };
        let rms =
            |result: &Mesh| metrics::deviation(&mesh, result, &samples, &cpu(2)).expect("two meshes").symmetric().rms;
        let ratio = rms(&parts) / rms(&whole);
        assert!(ratio < 1.05, "{name}: {ratio}");
    }
}

/// Where sheets cross, pieces are mostly rim, and what is frozen there is no measure of what the rest keeps.
#[test]
fn sheets_that_cross_come_out_as_in_one_piece() {
    let sheet = |tilt: f64| {
        let mut sheet = shapes::plane(300, 300);
        for p in &mut sheet.positions {
            let (x, y) = (p.x / 150.0 - 1.0, p.y / 150.0 - 1.0);
            *p = DVec3::new(x, y, tilt * x + 0.05 * (4.0 * x).sin() * (3.0 * y).cos());
        }
        sheet
    };
    let (mut mesh, other) = (sheet(0.3), sheet(-0.3));
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(other.positions);
    mesh.faces.extend(other.faces.iter().map(|face| face.map(|v| v + first)));
    let in_parts = Bench::new(&mesh).run(Budget::faces(1_000), 16_000);
    let whole = contract(&mesh, &Options::default(), Budget::faces(1_000));
    let rms = |result: &Mesh| {
        let options = metrics::Options { samples: Some(100_000), ..metrics::Options::default() };
        metrics::deviation(&mesh, result, &options, &cpu(2)).expect("two meshes").symmetric().rms
    };
    let [parts, whole] = [rms(&in_parts.outcome.mesh), rms(&whole.mesh)];
    assert!(in_parts.passes[0].parts > 10 && parts < 1.3 * whole, "{parts}, {whole} in one piece");
}

#[test]
fn an_error_limit_holds() {
    let mesh = sample("statue", Some(40_000)).expect("a sample");
    let bench = Bench::new(&mesh);
    let Outcome { outcome, diagonal, .. } = bench.run(Budget::error(0.002), 6_000);
    assert!((diagonal - mesh.diagonal()).abs() < 1e-6 * diagonal);
    assert_eq!(outcome.stop, StopReason::ErrorReached);
    assert!(outcome.error_estimate <= 0.002 * diagonal, "{}", outcome.error_estimate);
    let whole = contract(&mesh, &Options::default(), Budget::error(0.002)).mesh.faces.len();
    let faces = outcome.mesh.faces.len();
    assert!(faces < mesh.faces.len() / 4 && faces < 2 * whole, "{faces}, {whole} in one piece");
}

#[test]
fn normals_and_colors_come_along() {
    let mut mesh = shapes::icosphere(5);
    mesh.normals = Some(mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect());
    mesh.colors = Some(mesh.positions.iter().map(|p| [if p.x > 0.0 { 1.0 } else { 0.0 }, 0.2, 0.4, 1.0]).collect());
    mesh.texcoords = Some(vec![[Vec2::X; 3]; mesh.faces.len()]);
    mesh.face_colors = Some(vec![[1.0; 4]; mesh.faces.len()]);
    let outcome = Bench::new(&mesh).run(Budget::faces(1_000), 4_000).outcome;
    let (normals, colors) = (outcome.mesh.normals.expect("normals"), outcome.mesh.colors.expect("colors"));
    for (vertex, position) in outcome.mesh.positions.iter().enumerate() {
        assert!(normals[vertex].dot(Vec3::normalize(position.as_vec3())) > 0.98);
        assert!(position.x.abs() < 0.2 || (colors[vertex][0] > 0.5) == (position.x > 0.0));
    }
    for dropped in ["texture coordinates are dropped", "face colors are dropped"] {
        assert!(outcome.warnings.iter().any(|warning| warning.starts_with(dropped)), "{:?}", outcome.warnings);
    }
}

/// Rows of parts hold what parts carry, not what the input does.
#[test]
fn normals_and_colors_are_left_out_or_found_anew() {
    let mut mesh = shapes::icosphere(5);
    mesh.colors = Some(mesh.positions.iter().map(|p| [p.x as f32 * 0.5 + 0.5, 0.2, 0.4, 1.0]).collect());
    let bare = Bench::new(&mesh);
    mesh.normals = Some(mesh.positions.iter().map(|p| p.as_vec3().normalize()).collect());
    let full = Bench::new(&mesh);
    let run = |bench: &Bench, normals, dropped| {
        let attributes = Attributes { normals, dropped, ..Attributes::default() };
        let method = Method::Contract(Options { attributes, ..Options::default() });
        let outcome =
            bench.run_on(&cpu(2), &method, Budget::faces(1_000), PLENTY, 4_000).expect("a valid mesh").outcome;
        assert_eq!((outcome.mesh.faces.len(), &outcome.warnings[..]), (1_000, &[][..]));
        assert!(outcome.mesh.positions.iter().all(|p| (p.length() - 1.0).abs() < 0.05));
        [outcome.mesh.normals.is_some(), outcome.mesh.colors.is_some()]
    };
    for bench in [&bare, &full] {
        assert_eq!(run(bench, Normals::Recompute, Dropped::default()), [true, true]);
        assert_eq!(run(bench, Normals::Keep, Dropped { normals: true, ..Dropped::default() }), [false, true]);
        assert_eq!(run(bench, Normals::Recompute, Dropped { colors: true, ..Dropped::default() }), [true, false]);
    }
}

/// In one piece and in several.
#[test]
fn attributes_that_are_not_finite_are_zero_and_told() {
    let mut mesh = shapes::icosphere(5);
    // Not the numbers of positions, which are looked for below.
    mesh.normals = Some(mesh.positions.iter().map(|p| -p.as_vec3().normalize()).collect());
    mesh.colors = Some(vec![[0.5; 4]; mesh.positions.len()]);
    let bench = Bench::new(&mesh);
    let mut bytes = fs::read(bench.path()).expect("the file");
    let normal: Vec<u8> =
        mesh.normals.as_ref().expect("normals")[7].to_array().iter().flat_map(|x| x.to_le_bytes()).collect();
    let at = bytes.windows(12).position(|window| window == normal).expect("the normal");
    bytes[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    for (content, most, is_told) in
        [(&bytes, 4_000, true), (&bytes, 1 << 20, true), (&fs::read(bench.path()).expect("the file"), 4_000, false)]
    {
        fs::write(bench.path(), content).expect("a file");
        // Nothing goes but what is asked for least, so that the vertex stays.
        let outcome = bench.run(Budget::keep(0.9), most).outcome;
        let told =
            outcome.warnings.iter().any(|warning| warning == "normals or colors that are not finite are read as zero");
        assert_eq!(told, is_told, "{:?}", outcome.warnings);
        assert!(outcome.mesh.normals.expect("normals").iter().all(|normal| normal.is_finite()));
    }
}

#[test]
fn broken_meshes_give_a_result_or_an_error() {
    let mut mesh = sample("statue", Some(20_000)).expect("a sample");
    let faces = mesh.faces.clone();
    // Degenerate and duplicate faces, a third face at an edge, vertices without faces, one of them far away.
    mesh.faces.extend(faces.iter().step_by(7).map(|&[a, b, _]| [a, b, b]));
    mesh.faces.extend(faces.iter().step_by(11));
    mesh.positions.extend([DVec3::splat(1e30), DVec3::ZERO, DVec3::new(0.3, 0.2, 0.1)]);
    mesh.colors = None;
    let fin = mesh.positions.len() as u32 - 1;
    mesh.faces.push([faces[50][0], faces[50][1], fin]);
    let outcome = Bench::new(&mesh).run(Budget::faces(2_000), 3_000).outcome;
    outcome.mesh.check().expect("a valid mesh");
    // Where an odd number of faces meets an odd border, one too many may go.
    assert!((1_999..=2_000).contains(&outcome.mesh.faces.len()), "{} faces", outcome.mesh.faces.len());
    assert!(outcome.warnings.iter().any(|w| w.contains("degenerate")), "{:?}", outcome.warnings);

    // All faces at one point, a part without an area, more faces in one place than a part may have.
    let point = Mesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]; 50]);
    assert!(matches!(Bench::new(&point).error(PLENTY, 100), Error::Mesh(_)));
    assert!(matches!(Bench::new(&point).error(PLENTY, 10), Error::Limit(_)));
    let mut with_points = shapes::icosphere(4);
    with_points.faces.extend(vec![[0, 0, 1]; 900]);
    assert_eq!(Bench::new(&with_points).run(Budget::faces(500), 1_000).outcome.mesh.faces.len(), 500);

    // More faces than there are.
    let ball = shapes::icosphere(3);
    let more = Bench::new(&ball).run(Budget::faces(5_000), 500).outcome;
    assert_eq!(more.stop, StopReason::FacesReached);
    assert!(more.mesh.faces.len() <= ball.faces.len());
}

#[test]
fn what_cannot_be_read_in_pieces_is_told() {
    let bench = Bench::new(&shapes::icosphere(3));
    let path = bench.path();
    let good = fs::read(&path).expect("the file");
    let header = good.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    let corner = |value: i32| {
        let mut bytes = good.clone();
        let at = bytes.len() - 4;
        bytes[at..].copy_from_slice(&value.to_le_bytes());
        bytes
    };
    let mut not_a_number = good.clone();
    not_a_number[header + 24..header + 28].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut polygon = good.clone();
    let last_face = polygon.len() - 13;
    polygon[last_face] = 4;
    polygon.extend_from_slice(&[0; 4]);
    for (content, part) in [
        (&good[..good.len() - 1], "the file ends"),
        (&corner(9_999), "expected vertex indices from 0 to 641"),
        (&corner(-1), "found a face with the corners"),
        (&not_a_number, "found vertex 2 at"),
        (&polygon, "face 1279 is no triangle"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
           element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n",
            "a PLY of text",
        ),
        (b"not a mesh", "expected the line 'ply'"),
    ] {
        fs::write(&path, content).expect("a file to write");
        let error = bench.error(PLENTY, 500).to_string();
        assert!(error.contains(part), "expected '{part}' in {error}");
    }
    let other = bench.folder.path().join("in.obj");
    fs::write(&other, "v 0 0 0\n").expect("a file to write");
    assert!(matches!(Input::open(&other), Err(Error::Unsupported(_))));
}

#[test]
fn what_parts_cannot_do_is_refused() {
    let bench = Bench::new(&shapes::icosphere(3));
    for options in [
        Options { weld: Some(0.1), ..Options::default() },
        Options { join_within: 0.1, ..Options::default() },
        Options { log: true, ..Options::default() },
        Options { locked: Some([false; 642].into()), ..Options::default() },
    ] {
        let result = bench.run_on(&cpu(1), &Method::Contract(options), Budget::faces(100), PLENTY, 500);
        assert!(matches!(result, Err(Error::Unsupported(_))));
    }
    let error = bench.error(1 << 20, 500).to_string();
    assert!(error.starts_with("limit: the memory limit is 1MiB, ") && error.contains("at least 105MiB, "), "{error}");
    let missing = out_of_core::Options { scratch: bench.path(), ..out_of_core::Options::new(PLENTY) };
    let input = Input::open(&bench.path()).expect("a mesh");
    let result = out_of_core::simplify(&input, &Method::default(), &Budget::faces(100), &missing, &cpu(1), None);
    assert!(matches!(result, Err(Error::Write { .. })), "{result:?}");
}

#[test]
fn a_run_can_be_watched_and_stopped() {
    let bench = Bench::new(&sample("statue", Some(30_000)).expect("a sample"));
    let options = out_of_core::Options {
        part_faces: Some(5_000),
        scratch: bench.scratch.path().into(),
        ..out_of_core::Options::new(PLENTY)
    };
    let input = Input::open(&bench.path()).expect("a mesh");
    for most in [usize::MAX, 0, 3, 30] {
        let mut seen: Vec<Progress> = Vec::new();
        let mut report = |step: Progress| {
            seen.push(step);
            if seen.len() > most { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let method = Method::default();
        let outcome =
            out_of_core::simplify(&input, &method, &Budget::faces(1_000), &options, &cpu(1), Some(&mut report));
        let outcome = outcome.expect("a valid mesh").outcome;
        assert_eq!(outcome.stop == StopReason::Cancelled, most < usize::MAX);
        // Edges between parts may be split when a part is done.
        assert!(seen.windows(2).all(|pair| pair[0].faces + 500 >= pair[1].faces), "{seen:?}");
        assert!(seen.iter().all(|step| (step.faces_in, step.target) == (input.faces(), 1_000)));
        assert_eq!(entries(bench.scratch.path()), 0);
    }
}

#[test]
fn real_scans_stay_as_they_are_connected() {
    for name in ["closed/nefertiti70k.obj", "closed/skull.obj", "closed/wingnut.obj"] {
        let Some(path) = models::model(name) else { continue };
        let mesh = Mesh { texcoords: None, ..formats::read(&path).expect("a mesh") };
        let before = topology(&coarsen::mesh::weld(&mesh, 0.0).mesh);
        let bench = Bench::new(&mesh);
        let result = bench.run(Budget::keep(0.05), mesh.faces.len() / 9).outcome.mesh;
        let after = topology(&result);
        assert_eq!((after.euler, after.border_edges == 0), (before.euler, before.border_edges == 0), "{name}");
    }
}
