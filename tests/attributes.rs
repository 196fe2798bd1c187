//! What vertices, corners and faces carry through contractions.

#[path = "support/mod.rs"]
mod support;

use std::collections::{BTreeMap, BTreeSet};

use coarsen::backend::GpuOptions;
use coarsen::contract::{
    AttributeWeights, Attributes, ColorSpace, Dropped, Lock, Metric, Normals, Options, Placement, Seams,
};
use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::{Channel, ChannelKind, Materials, shapes, weld};
use coarsen::metrics;
use coarsen::{Budget, Device, Error, Mesh, Method, Outcome, StopReason, simplify, simplify_levels};
use support::engine::{bytes, cpu, gpu};
use support::independent::topology;
use support::shapes::boxed;
use support::texture::folds;

fn run_on(device: &Device, mesh: &Mesh, options: &Options, budget: Budget) -> Outcome {
    simplify(mesh, &Method::Contract(options.clone()), &budget, device, None).expect("a valid mesh")
}

fn run(mesh: &Mesh, attributes: Attributes, keep: f64) -> Outcome {
    run_on(&cpu(2), mesh, &Options { attributes, ..Options::default() }, Budget::keep(keep))
}

/// A channel whose numbers follow from the position.
fn channel(mesh: &Mesh, name: &str, kind: ChannelKind, of: impl Fn(DVec3) -> Vec<f32>) -> Channel {
    let rows: Vec<Vec<f32>> = mesh.positions.iter().map(|&p| of(p)).collect();
    Channel { name: name.into(), kind, width: rows[0].len(), values: rows.concat() }
}

/// A torus with all that there is: a texture with a seam along either way, a second one without, normals, colors, a tangent,
/// joints, a scalar, and three materials.
fn dressed(around: u32, across: u32) -> Mesh {
    let mut mesh = shapes::torus(around, across);
    let row = |face: usize| {
        let (u, v) = ((face as u32 / 2) / across, (face as u32 / 2) % across);
        let at = |du: u32, dv: u32| Vec2::new((u + du) as f32 / around as f32, (v + dv) as f32 / across as f32);
        if face.is_multiple_of(2) { [at(0, 0), at(1, 0), at(1, 1)] } else { [at(0, 0), at(1, 1), at(0, 1)] }
    };
    mesh.texcoords = Some((0..mesh.faces.len()).map(row).collect());
    mesh.normals = Some(coarsen::mesh::vertex_normals(&mesh));
    mesh.colors =
        Some(mesh.positions.iter().map(|p| [0.5 + p.x as f32 / 8.0, 0.5 - p.y as f32 / 8.0, 0.25, 1.0]).collect());
    let channels = [
        channel(&mesh, "heat", ChannelKind::Linear, |p| vec![(3.0 * p.z) as f32]),
        channel(&mesh, "TEXCOORD_1", ChannelKind::Texcoords, |p| vec![p.x as f32, p.y as f32]),
        channel(&mesh, "TANGENT", ChannelKind::Tangent, |p| {
            let t = DVec3::new(-p.y, p.x, 0.0).normalize().as_vec3();
            vec![t.x, t.y, t.z, -1.0]
        }),
        channel(&mesh, "JOINTS_0", ChannelKind::Joints, |p| {
            let share = (0.5 + p.x / 8.0) as f32;
            vec![3.0, 7.0, 0.0, 0.0, share, 1.0 - share, 0.0, 0.0]
        }),
    ];
    mesh.channels = channels.into();
    let middle = |face: &[u32; 3]| face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
    let of_face =
        mesh.faces.iter().map(|face| if middle(face).x > 1.0 { 2 } else { u32::from(middle(face).y > 0.0) }).collect();
    mesh.materials = Some(Materials { of_face, names: ["left", "right", "front"].map(String::from).into() });
    mesh
}

#[test]
fn what_nothing_happens_to_comes_back_as_it_was() {
    let mesh = dressed(24, 12);
    assert_eq!(run(&mesh, Attributes::default(), 1.0).mesh, mesh);
    // A crease: every side of the box has vertices of its own.
    let mesh = boxed(4);
    assert_eq!(run(&mesh, Attributes::default(), 1.0).mesh, mesh);
}

#[test]
fn everything_is_carried() {
    let mesh = dressed(96, 48);
    let outcome = run(&mesh, Attributes::default(), 0.1);
    let result = &outcome.mesh;
    result.check().expect("a valid result");
    assert_eq!(outcome.stop, StopReason::FacesReached);
    assert_eq!(folds(result), 0);
    let found = topology(&weld(result, 0.0).mesh);
    assert_eq!((found.components, found.border_edges, found.euler), (1, 0, 0));
    let near = |a: f32, b: f64, what: &str| assert!((f64::from(a) - b).abs() < 0.1, "{what}: {a} for {b}");
    let channels: BTreeMap<&str, &Channel> = result.channels.iter().map(|c| (c.name.as_str(), c)).collect();
    for (v, p) in result.positions.iter().enumerate() {
        near(result.colors.as_ref().expect("colors")[v][0], 0.5 + p.x / 8.0, "red");
        near(channels["heat"].row(v)[0] / 3.0, p.z, "heat");
        near(channels["TEXCOORD_1"].row(v)[1], p.y, "second texture");
        let tangent = channels["TANGENT"].row(v);
        assert!((Vec3::from_slice(tangent).length() - 1.0).abs() < 1e-5 && tangent[3] == -1.0, "{tangent:?}");
        let joints = channels["JOINTS_0"].row(v);
        assert!((joints[4..].iter().sum::<f32>() - 1.0).abs() < 1e-5, "{joints:?}");
        let third = (0..4).find(|&i| joints[i] == 3.0).map_or(0.0, |i| joints[4 + i]);
        near(third, 0.5 + p.x / 8.0, "joint");
        let normal = result.normals.as_ref().expect("normals")[v];
        assert!((normal.length() - 1.0).abs() < 1e-5);
        assert!(normal.dot(Vec3::from_slice(tangent)).abs() < 1e-4, "{normal} and {tangent:?}");
    }
}

/// The area that every material covers.
fn areas(mesh: &Mesh) -> Vec<f64> {
    let materials = mesh.materials.as_ref().expect("materials");
    let mut areas = vec![0.0; materials.names.len()];
    for (face, &material) in mesh.faces.iter().zip(&materials.of_face) {
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        areas[material as usize] += (b - a).cross(c - a).length() / 2.0;
    }
    areas
}

#[test]
fn materials_keep_their_borders() {
    let plain = shapes::torus(96, 48);
    let materials = dressed(96, 48).materials;
    let mesh = Mesh { materials, ..plain };
    let outcome = run(&mesh, Attributes::default(), 0.1);
    let was = areas(&mesh);
    for (was, is) in was.iter().zip(areas(&outcome.mesh)) {
        assert!((is - was).abs() < 0.03 * was, "{was} → {is}");
    }
    // Vertices are not split for materials: nothing that they carry differs.
    let found = topology(&outcome.mesh);
    assert_eq!((found.components, found.border_edges, found.euler), (1, 0, 0));
    let dropped = Attributes { dropped: Dropped { materials: true, ..Dropped::default() }, ..Attributes::default() };
    assert_eq!(run(&mesh, dropped, 0.1).mesh.materials, None);
}

#[test]
fn creases_contract_along_themselves() {
    let mesh = boxed(16);
    let outcome = simplify(&mesh, &Method::Contract(Options::default()), &Budget::faces(12), &cpu(2), None)
        .expect("a valid mesh");
    assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (12, 24));
    for (face, normals) in outcome.mesh.faces.iter().zip(outcome.mesh.faces.iter()) {
        let [a, b, c] = face.map(|v| outcome.mesh.positions[v as usize]);
        let own = (b - a).cross(c - a).normalize().as_vec3();
        let stored = normals.map(|v| outcome.mesh.normals.as_ref().expect("normals")[v as usize]);
        assert!(stored.iter().all(|n| n.distance(own) < 1e-6), "{stored:?} on a face with {own}");
    }
}

/// A sphere whose every face has the vertices and the normal of its own: creases everywhere would hold all of it.
#[test]
fn facets_do_not_hold_a_surface() {
    let sphere = shapes::icosphere(4);
    let positions: Vec<DVec3> = sphere.faces.iter().flatten().map(|&v| sphere.positions[v as usize]).collect();
    let faces: Vec<[u32; 3]> = (0..sphere.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let normal = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| positions[v as usize]);
        [(b - a).cross(c - a).normalize().as_vec3(); 3]
    };
    let normals = Some(faces.iter().flat_map(normal).collect());
    let mesh = Mesh { normals, ..Mesh::new(positions, faces) };
    let outcome = run(&mesh, Attributes::default(), 0.1);
    assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, mesh.faces.len() / 10));
    assert!(outcome.warnings.iter().any(|warning| warning.contains("facets")), "{:?}", outcome.warnings);
    for (p, n) in outcome.mesh.positions.iter().zip(outcome.mesh.normals.iter().flatten()) {
        assert!(n.as_dvec3().dot(p.normalize()) > 0.95, "{n} at {p}");
    }
}

#[test]
fn colors_decide_on_a_flat() {
    // A dark disk on a bright plane: without weights its rim is lost.
    let mut mesh = shapes::plane(64, 64);
    let is_dark = |p: DVec3| (p - DVec3::new(30.0, 34.0, 0.0)).length() < 17.0;
    let color = |p: &DVec3| if is_dark(*p) { [0.1, 0.1, 0.1, 1.0] } else { [0.9, 0.9, 0.8, 1.0] };
    mesh.colors = Some(mesh.positions.iter().map(color).collect());
    let wrong = |weight: f32| {
        let weights = AttributeWeights { color: weight, ..AttributeWeights::default() };
        let outcome = run(&mesh, Attributes { weights, ..Attributes::default() }, 0.05);
        let found = metrics::compare(&mesh, &outcome.mesh, &Default::default(), &cpu(2)).expect("valid meshes");
        found.deviation.forward.colors.expect("colors").rgb.mean
    };
    let (with, without) = (wrong(1.0), wrong(0.0));
    assert!(with < 0.3 * without && with < 0.02, "{with} with weights, {without} without");
}

#[test]
fn normals_are_found_anew_where_asked_for() {
    let mut mesh = dressed(48, 24);
    mesh.normals.iter_mut().flatten().for_each(|n| *n = -*n);
    for normals in [mesh.normals.clone(), None] {
        let mesh = Mesh { normals, ..mesh.clone() };
        let outcome = run(&mesh, Attributes { normals: Normals::Recompute, ..Attributes::default() }, 0.3);
        let expected = coarsen::mesh::vertex_normals(&outcome.mesh);
        assert_eq!(outcome.mesh.normals.as_ref(), Some(&expected));
        let tangents = outcome.mesh.channels.iter().find(|channel| channel.kind == ChannelKind::Tangent).expect("some");
        let off = |v: usize| expected[v].dot(Vec3::from_slice(tangents.row(v))).abs();
        assert!((0..expected.len()).all(|v| off(v) < 1e-4));
    }
}

#[test]
fn all_can_be_dropped() {
    let outcome = run(&dressed(48, 24), Attributes::drop_all(), 0.3);
    let plain = run(&shapes::torus(48, 24), Attributes::default(), 0.3);
    assert_eq!(outcome.mesh, plain.mesh);
}

#[test]
fn ends_keep_their_own() {
    let mesh = boxed(16);
    let options = Options { placement: Placement::Endpoint, ..Options::default() };
    let outcome = run_on(&cpu(2), &mesh, &options, Budget::keep(0.2));
    let normals = (mesh.normals.as_ref().expect("normals"), outcome.mesh.normals.as_ref().expect("normals"));
    for (v, &origin) in outcome.vertex_origin.iter().enumerate() {
        assert_eq!(outcome.mesh.positions[v], mesh.positions[origin as usize]);
        assert_eq!(normals.1[v], normals.0[origin as usize]);
    }
    let distinct: BTreeSet<u32> = outcome.vertex_origin.iter().copied().collect();
    assert_eq!(distinct.len(), outcome.mesh.positions.len());
}

#[test]
fn threads_and_devices_give_the_same_bytes() {
    let mesh = dressed(120, 60);
    let weights = AttributeWeights { channels: [("heat".to_owned(), 1.0)].into(), ..AttributeWeights::default() };
    for attributes in [Attributes::default(), Attributes { weights, ..Attributes::default() }] {
        let options = Options { attributes, ..Options::default() };
        let reference = run_on(&cpu(1), &mesh, &options, Budget::keep(0.1));
        let devices = [2, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default()));
        for device in devices {
            let outcome = run_on(&device, &mesh, &options, Budget::keep(0.1));
            assert_eq!(outcome.mesh, reference.mesh, "{}", device.description());
            assert!(bytes(&outcome.mesh) == bytes(&reference.mesh), "{}", device.description());
        }
    }
}

/// Options under which seams yield, and under which they do not.
fn yielding_and_holding() -> [Options; 2] {
    [Seams::Yield, Seams::Hold].map(|seams| {
        let attributes = Attributes { seams, ..Attributes::default() };
        Options { attributes, ..Options::default() }
    })
}

/// The corners of a box are creases' ends: without them there are fewer faces than twelve.
#[test]
fn creases_yield_where_they_hold_too_much() {
    let mesh = boxed(8);
    let [yielding, holding] = yielding_and_holding();
    let held = run_on(&cpu(2), &mesh, &holding, Budget::faces(8));
    assert_eq!((held.stop, held.mesh.faces.len()), (StopReason::Stuck, 12));
    assert!(held.blocked.seam > 0);
    let outcome = run_on(&cpu(2), &mesh, &yielding, Budget::faces(8));
    assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 8));
    assert!(outcome.warnings.iter().any(|warning| warning.starts_with("creases")), "{:?}", outcome.warnings);
    let found = topology(&weld(&outcome.mesh, 0.0).mesh);
    assert_eq!((found.components, found.border_edges, found.euler), (1, 0, 2));
    for n in outcome.mesh.normals.iter().flatten() {
        assert!((n.length() - 1.0).abs() < 1e-5 && n.abs().max_element() > 0.999, "{n} is of no side of the box");
    }
    // What does not need it is as it was: with 40 faces no run without creases is closer.
    let runs = [&yielding, &holding].map(|options| run_on(&cpu(2), &mesh, options, Budget::faces(40)).mesh);
    assert_eq!(runs[0], runs[1]);
    let runs = [&yielding, &holding].map(|options| run_on(&cpu(2), &mesh, options, Budget::error(0.5)).mesh);
    assert_eq!(runs[0], runs[1]);
}

#[test]
fn levels_before_seams_yield_stay() {
    let mesh = boxed(8);
    let [yielding, holding] = yielding_and_holding();
    let levels = [40, 8].map(Budget::faces);
    let of = |options: Options| {
        let levels = simplify_levels(&mesh, &Method::Contract(options), &levels, &cpu(2), None).expect("a valid mesh");
        [0, 1].map(|level| levels[level].mesh.clone())
    };
    let (found, held) = (of(yielding.clone()), of(holding));
    assert_eq!((&found[0], found[1].faces.len(), held[1].faces.len()), (&held[0], 8, 12));
    // What may only have vertices of the input holds its seams.
    let of_input = Options { placement: Placement::Endpoint, ..yielding };
    let held = run_on(&cpu(2), &mesh, &of_input, Budget::faces(8));
    assert_eq!((held.stop, held.mesh.faces.len()), (StopReason::Stuck, 12));
}

/// The torus of 24 by 12 with other materials: eighteen places where four blocks of them meet.
fn with_blocks(mesh: Mesh) -> Mesh {
    let block = |face: u32| face / 2 / 12 / 4 + face / 2 % 12 / 4;
    let of_face = (0..mesh.faces.len() as u32).map(|face| block(face) % 3).collect();
    Mesh { materials: mesh.materials.map(|materials| Materials { of_face, ..materials }), ..mesh }
}

/// A texture cut along two lines, creases and three materials, down to a few faces.
#[test]
fn seams_yield_without_cracks_and_folds() {
    let mut mesh = dressed(24, 12);
    // One that folds holds everything.
    mesh.channels.retain(|channel| channel.name != "TEXCOORD_1");
    let mesh = with_blocks(mesh);
    let [yielding, holding] = yielding_and_holding();
    for metric in [Metric::Volume, Metric::Plane] {
        let [yielding, holding] = [&yielding, &holding].map(|options| Options { metric, ..options.clone() });
        let held = run_on(&cpu(2), &mesh, &holding, Budget::faces(30));
        assert_eq!(held.stop, StopReason::Stuck);
        let outcome = run_on(&cpu(1), &mesh, &yielding, Budget::faces(30));
        let result = &outcome.mesh;
        assert!(result.faces.len() < held.mesh.faces.len(), "{} faces", result.faces.len());
        assert!(outcome.warnings.iter().any(|warning| warning.contains("yield")), "{:?}", outcome.warnings);
        result.check().expect("a valid result");
        assert_eq!(folds(result), 0);
        let found = topology(&weld(result, 0.0).mesh);
        assert_eq!((found.components, found.border_edges, found.euler), (1, 0, 0));
        assert!(areas(result).iter().all(|&area| area > 0.0), "{:?}", areas(result));
        let devices = [2, 5].map(cpu).into_iter().chain(gpu(&GpuOptions::default()));
        for device in devices {
            let other = run_on(&device, &mesh, &yielding, Budget::faces(30));
            assert!(bytes(&other.mesh) == bytes(result), "{}", device.description());
        }
    }
}

#[test]
fn materials_of_a_box_stay_closed() {
    let mut mesh = boxed(8);
    let per_side = mesh.faces.len() / 6;
    let of_face = (0..mesh.faces.len()).map(|face| u32::from((face / per_side).is_multiple_of(3))).collect();
    mesh.materials = Some(Materials { of_face, names: ["sides", "ends"].map(String::from).into() });
    let outcome = run(&mesh, Attributes::default(), 0.0);
    assert!(outcome.mesh.faces.len() < 12, "{} faces", outcome.mesh.faces.len());
    let found = topology(&weld(&outcome.mesh, 0.0).mesh);
    assert_eq!((found.components, found.border_edges, found.euler), (1, 0, 2));
    assert!(areas(&outcome.mesh).iter().all(|&area| area > 0.0));
}

#[test]
fn locked_vertices_stay_bit_for_bit() {
    let mut mesh = shapes::torus(48, 24);
    let is_pinned = |p: &DVec3| p.x > 1.0 && p.y.abs() < 0.5;
    let pinned: Vec<u32> = (0..).zip(&mesh.positions).filter(|(_, p)| is_pinned(p)).map(|(v, _)| v).collect();
    mesh.channels = vec![channel(&mesh, "pin", ChannelKind::Linear, |p| vec![f32::from(u8::from(is_pinned(&p)))])];
    let by = |lock: Lock| Options { lock: Some(lock), ..Options::default() };
    let outcomes = [by(Lock::Channel("pin".into())), by(Lock::Vertices(pinned.clone().into()))]
        .map(|options| run_on(&cpu(2), &mesh, &options, Budget::keep(0.3)));
    assert_eq!(outcomes[0].mesh, outcomes[1].mesh);
    let kept: BTreeSet<[u64; 3]> = outcomes[0].mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    assert_eq!((pinned.len() > 10, outcomes[0].stop), (true, StopReason::FacesReached), "{} of them", pinned.len());
    for &v in &pinned {
        assert!(kept.contains(&mesh.positions[v as usize].to_array().map(f64::to_bits)), "vertex {v} is gone");
    }
    let unknown = Method::Contract(by(Lock::Channel("pins".into())));
    let refused = simplify(&mesh, &unknown, &Budget::keep(0.1), &cpu(2), None);
    assert!(matches!(refused, Err(Error::Parameter(_))));
}

#[test]
fn colors_may_be_compared_as_they_are_seen() {
    let mesh = dressed(96, 48);
    let with = |color_space| run(&mesh, Attributes { color_space, ..Attributes::default() }, 0.1).mesh;
    let (rgb, luv) = (with(ColorSpace::Rgb), with(ColorSpace::Luv));
    assert_ne!(rgb, luv);
    for (p, color) in luv.positions.iter().zip(luv.colors.iter().flatten()) {
        assert!(
            (f64::from(color[0]) - 0.5 - p.x / 8.0).abs() < 0.1 && (color[2] - 0.25).abs() < 0.1,
            "{color:?} at {p}"
        );
        assert!(color[3] == 1.0 && color.iter().all(|channel| (0.0..=1.0).contains(channel)), "{color:?}");
    }
}

/// A large round of which seams refuse much lets the next have it beside what that needs, on every device.
#[test]
fn what_seams_refuse_does_not_fill_the_next_gate() {
    let (around, across) = (128, 96);
    let mut mesh = shapes::torus(around, across);
    // Charts of 4 × 4 squares, each in a place of its own.
    let row = |face: usize| {
        let (u, v) = ((face as u32 / 2) / across, (face as u32 / 2) % across);
        let at = |du: u32, dv: u32| {
            let [u, v] = [(u / 4, u + du), (v / 4, v + dv)].map(|(chart, at)| (at + 4 * chart) as f32 / 256.0);
            Vec2::new(u, v)
        };
        if face.is_multiple_of(2) { [at(0, 0), at(1, 0), at(1, 1)] } else { [at(0, 0), at(1, 1), at(0, 1)] }
    };
    mesh.texcoords = Some((0..mesh.faces.len()).map(row).collect());
    let attributes = Attributes { seams: Seams::Hold, ..Attributes::default() };
    let options = Options { attributes, ..Options::default() };
    let outcome = run_on(&cpu(2), &mesh, &options, Budget::keep(0.5));
    let mut met = 0;
    for rounds in outcome.rounds.windows(2) {
        let (before, round) = (&rounds[0], &rounds[1]);
        let refused = before.blocked.seam + before.blocked.link + before.blocked.flip + before.blocked.texture;
        let needed = (round.faces - outcome.target as u64).div_ceil(2);
        let wanted = (3 * needed).div_ceil(2) + 5 * refused / 4;
        if before.faces >= 10_000 && 10 * refused > before.contracted && wanted < round.pairs / 2 {
            assert!(round.candidates >= wanted, "{wanted} of {round:?} after {before:?}");
            met += 1;
        }
    }
    assert!(met > 0, "{:?}", outcome.rounds);
    if let Some(device) = gpu(&GpuOptions::default()) {
        let on_gpu = run_on(&device, &mesh, &options, Budget::keep(0.5));
        assert_eq!(bytes(&on_gpu.mesh), bytes(&outcome.mesh));
        assert!(on_gpu.rounds.iter().any(|round| round.on_gpu));
    }
}

/// Three classes on a torus, with numbers that no mean of two others is.
#[test]
fn labels_are_those_of_a_corner() {
    const CLASSES: [f32; 3] = [7.0, 100.0, 16_777_215.0];
    let class = |p: DVec3| CLASSES[if p.x < 0.5 { 0 } else { usize::from(p.y > 0.3) + 1 }];
    let found = |kind: ChannelKind, weight: Option<f32>| {
        let mut mesh = shapes::torus(96, 48);
        mesh.channels = vec![channel(&mesh, "class", kind, |p| vec![class(p), -class(p)])];
        let channels = weight.map(|weight| ("class".to_string(), weight)).into_iter().collect();
        let weights = AttributeWeights { channels, ..AttributeWeights::default() };
        let mut found = run(&mesh, Attributes { weights, ..Attributes::default() }, 0.1).mesh;
        (found.channels.pop().expect("a channel"), found.positions)
    };
    let (labels, positions) = found(ChannelKind::Label, None);
    assert_eq!(labels.kind, ChannelKind::Label);
    let is_class = |row: &[f32]| CLASSES.contains(&row[0]) && row[1] == -row[0];
    assert!(positions.len() < 500 && (0..positions.len()).all(|v| is_class(labels.row(v))));
    // Where nothing but one class is near, it stays.
    let is_far = |p: &DVec3| (p.x - 0.5).abs() > 0.5 && (p.y - 0.3).abs() > 0.5;
    let far: Vec<usize> = (0..positions.len()).filter(|&v| is_far(&positions[v])).collect();
    assert!(far.len() > 100 && far.iter().all(|&v| labels.row(v)[0] == class(positions[v])));
    // Amounts have means, and so have labels that are given a weight.
    for (kind, weight) in
        [(ChannelKind::Linear, Some(0.0)), (ChannelKind::Label, Some(1e-3)), (ChannelKind::Label, Some(0.0))]
    {
        let (amounts, positions) = found(kind, weight);
        assert!((0..positions.len()).any(|v| !is_class(amounts.row(v))), "{kind:?} {weight:?}");
        assert_eq!(amounts.kind, ChannelKind::Linear);
    }
}

#[test]
fn a_weight_for_nothing_is_told() {
    let weights = AttributeWeights {
        channels: [("heat".into(), 1.0), ("haet".into(), 1.0), ("JOINTS_0".into(), 1.0)].into(),
        ..AttributeWeights::default()
    };
    let outcome = run(&dressed(24, 12), Attributes { weights, ..Attributes::default() }, 0.5);
    let told: Vec<_> = outcome.warnings.iter().filter(|warning| warning.contains("weight")).collect();
    let expected = [
        "no channel 'haet' to give a weight to: the mesh has heat, TEXCOORD_1, TANGENT, JOINTS_0",
        "the weight of 'JOINTS_0' counts nothing: the one of joints is called 'pose'",
    ];
    assert_eq!(told, expected);
}

/// Differences of such numbers are infinite, along seams that hold and along others that yield.
#[test]
fn numbers_of_any_size_are_carried() {
    let wild = |texture: bool| {
        let mut mesh = with_blocks(dressed(24, 12));
        let mut number = [f32::MAX, f32::MIN, 0.0, 1.0, -f32::MAX / 3.0].into_iter().cycle();
        // A second texture that folds holds everything.
        mesh.channels.retain(|channel| channel.name == "heat");
        mesh.channels[0].values.iter_mut().for_each(|x| *x = number.next().unwrap_or(0.0));
        if let Some(rows) = mesh.texcoords.as_mut().filter(|_| texture) {
            rows.iter_mut().flatten().for_each(|uv| *uv = (*uv - 0.5) * f32::MAX);
        }
        mesh
    };
    for (seams, texture) in [(Seams::Hold, false), (Seams::Hold, true), (Seams::Yield, false), (Seams::Yield, true)] {
        let mesh = wild(texture);
        let outcome = run(&mesh, Attributes { seams, ..Attributes::default() }, 0.05);
        let yields = outcome.warnings.iter().any(|warning| warning.contains("yield"));
        assert_eq!(yields, seams == Seams::Yield, "{:?}", outcome.warnings);
        assert!(outcome.mesh.faces.len() < mesh.faces.len(), "nothing was contracted");
        let mut numbers = outcome.mesh.channels.iter().flat_map(|channel| &channel.values);
        assert!(numbers.all(|x| x.is_finite()), "texture {texture}, {seams:?}");
        let mut texcoords = outcome.mesh.texcoords.iter().flatten().flatten();
        assert!(texcoords.all(|uv| uv.is_finite()), "texture {texture}, {seams:?}");
    }
}
