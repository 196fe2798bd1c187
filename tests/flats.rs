//! What flat regions carry: materials, textures, normals and channels, all of them as they were.

mod support;

use std::collections::BTreeMap;

use coarsen::math::{DVec3, Vec2, Vec3};
use coarsen::mesh::{Channel, ChannelKind, Dropped, Materials, Normals, vertex_normals};
use coarsen::metrics::texture_deviation;
use coarsen::partition::{Flatness, Options, Superfaces, Triangulation, vsa};
use coarsen::{Budget, Mesh, Method, Outcome, cluster, removal, simplify};
use support::engine::{assert_kept, cpu};
use support::shapes::{bumpy, cube, grid, sphere};
use support::texture::{rows, textured};

fn run(mesh: &Mesh, options: &Options) -> Outcome {
    simplify(mesh, &Method::Partition(options.clone()), &Budget::default(), &cpu(1), None).expect("a valid mesh")
}

fn coplanar() -> Options {
    Options::coplanar(Flatness::default())
}

/// Materials by the middle of each face.
fn made_of(mut mesh: Mesh, names: &[&str], material: impl Fn(DVec3) -> usize) -> Mesh {
    let middle = |face: &[u32; 3]| face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
    let of_face = mesh.faces.iter().map(|face| material(middle(face)) as u32).collect();
    mesh.materials = Some(Materials { of_face, names: names.iter().map(|name| name.to_string()).collect() });
    mesh
}

/// The area of every material, by its name.
fn areas(mesh: &Mesh) -> BTreeMap<&str, f64> {
    let materials = mesh.materials.as_ref().expect("materials");
    let mut areas = BTreeMap::new();
    for (face, &material) in mesh.faces.iter().zip(&materials.of_face) {
        let [a, b, c] = face.map(|v| mesh.positions[v as usize]);
        *areas.entry(materials.names[material as usize].as_str()).or_default() += (b - a).cross(c - a).length() / 2.0;
    }
    areas
}

fn assert_same_areas(name: &str, before: &Mesh, after: &Mesh) {
    let (before, after) = (areas(before), areas(after));
    assert!(before.keys().eq(after.keys()), "{name}: {after:?}");
    for (material, area) in before {
        assert!((after[material] / area - 1.0).abs() < 1e-12, "{name}: {material} {area} {}", after[material]);
    }
}

const SIDES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

/// Which side of the cube a point is on.
fn side(p: DVec3) -> usize {
    let off = [p.x, 1.0 - p.x, p.y, 1.0 - p.y, p.z, 1.0 - p.z];
    (0..6).min_by(|&a, &b| off[a].abs().total_cmp(&off[b].abs())).expect("six sides")
}

#[test]
fn a_cube_of_six_materials_becomes_twelve_faces() {
    for n in [1, 2, 7, 30] {
        let cube = made_of(cube(n), &SIDES, side);
        for (name, options) in [("coplanar", coplanar()), ("vsa", Options::variational(vsa::Goal::Regions(6)))] {
            let outcome = run(&cube, &options);
            assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (12, 8), "{name} of {n}");
            assert_same_areas(&format!("{name} of {n}"), &cube, &outcome.mesh);
            assert_eq!(outcome.warnings, [""; 0]);
        }
    }
}

/// Sixteen squares of a board: borders stay where nothing else marks them, until materials are left out.
#[test]
fn a_checkered_plane_keeps_its_squares() {
    let board = made_of(grid(16, 16), &["black", "white"], |p| ((p.x / 4.0) as usize + (p.y / 4.0) as usize) % 2);
    let outcome = run(&board, &coplanar());
    assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (32, 25));
    assert_same_areas("board", &board, &outcome.mesh);
    assert!(outcome.mesh.positions.iter().all(|p| p.x % 4.0 == 0.0 && p.y % 4.0 == 0.0));
    let dropped = Dropped { materials: true, ..Dropped::default() };
    let bare = run(&board, &Options { dropped, ..coplanar() });
    assert_eq!((bare.mesh.faces.len(), bare.mesh.materials), (2, None));
}

/// No region spans two materials, whatever makes it, and materials that a border parts stay parted.
#[test]
fn borders_between_materials_stay_closed() {
    let names = ["north", "south", "island"];
    let material = |p: DVec3| if p.x > 0.7 { 2 } else { usize::from(p.z < 0.1) };
    let mut ball = made_of(bumpy(sphere(5), 0.05), &names, material);
    ball.colors = Some(ball.positions.iter().map(|p| [p.y as f32 / 4.0 + 0.5, 0.5, 0.5, 1.0]).collect());
    let bent = Options::coplanar(Flatness { angle_rad: 0.5, distance: 0.01 });
    let superfaces = Options::superfaces(Superfaces::default());
    for options in [bent, Options::variational(vsa::Goal::Regions(40)), superfaces] {
        let outcome = run(&ball, &options);
        let name = format!("{:?}", options.by);
        assert_kept(&name, &ball, &outcome);
        let (regions, materials) = (outcome.regions.expect("regions"), ball.materials.as_ref().expect("materials"));
        let mut of_region = vec![None; regions.count];
        for (&region, &material) in regions.labels.iter().zip(&materials.of_face) {
            assert_eq!(*of_region[region as usize].get_or_insert(material), material, "{name}");
        }
        let after = outcome.mesh.materials.as_ref().expect("materials");
        for (&region, &material) in regions.face_labels.iter().zip(&after.of_face) {
            assert_eq!(of_region[region as usize], Some(material), "{name}");
        }
        for (material, area) in areas(&ball) {
            assert!((areas(&outcome.mesh)[material] / area - 1.0).abs() < 0.3, "{name}: {material}");
        }
    }
}

/// A face that clustering leaves is one of the input, of the same material; removal keeps one that all faces have.
#[test]
fn clusters_keep_materials() {
    let cube = made_of(cube(30), &SIDES, side);
    let run =
        |mesh: &Mesh, method: Method| simplify(mesh, &method, &Budget::keep(0.1), &cpu(1), None).expect("a valid mesh");
    let outcome = run(&cube, Method::Cluster(cluster::Options::default()));
    assert_eq!(outcome.warnings, [""; 0]);
    for (material, area) in areas(&outcome.mesh) {
        assert!((area - 1.0).abs() < 0.1, "{material}: {area}");
    }
    let removed = run(&cube, Method::Removal(removal::Options::default()));
    assert!(removed.mesh.materials.is_none() && removed.warnings[0].starts_with("materials are dropped"));
    let one = made_of(cube.clone(), &["wood"], |_| 0);
    let removed = run(&one, Method::Removal(removal::Options::default()));
    assert_eq!((areas(&removed.mesh).len(), removed.warnings), (1, Vec::new()));
}

/// The map of a textured sheet.
fn map(p: DVec3) -> [f64; 2] {
    [0.25 + 0.02 * p.x - 0.003 * p.y, 0.5 + 0.001 * p.x + 0.017 * p.y]
}

/// Coordinates by position; those of the input's corners, bit for bit.
fn assert_corners(before: &Mesh, after: &Mesh) {
    let mut known: BTreeMap<[u64; 3], Vec<Vec2>> = BTreeMap::new();
    let bits = |mesh: &Mesh, v: u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
    for (face, uv) in before.faces.iter().zip(rows(before)) {
        face.iter().zip(uv).for_each(|(&v, &uv)| known.entry(bits(before, v)).or_default().push(uv));
    }
    for (face, uv) in after.faces.iter().zip(rows(after)) {
        assert!(face.iter().zip(uv).all(|(&v, uv)| known[&bits(after, v)].contains(uv)));
    }
}

#[test]
fn a_sheet_with_one_map_becomes_two_faces() {
    let mut sheet = textured(grid(30, 20), map);
    // Some of them wound the other way: they come back as they were.
    for (face, uv) in sheet.faces.iter_mut().zip(sheet.texcoords.iter_mut().flatten()).step_by(7) {
        (*face, *uv) = ([face[0], face[2], face[1]], [uv[0], uv[2], uv[1]]);
    }
    for triangulation in [Triangulation::Earcut, Triangulation::Ears] {
        let outcome = run(&sheet, &Options { triangulation, ..coplanar() });
        assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (2, 4));
        for (face, uv) in outcome.mesh.faces.iter().zip(rows(&outcome.mesh)) {
            for (&v, uv) in face.iter().zip(uv) {
                let wanted = Vec2::from(map(outcome.mesh.positions[v as usize]).map(|x| x as f32));
                assert_eq!(*uv, wanted);
            }
        }
    }
}

/// The right half is on another chart: two faces on either side, and the vertices between them have both.
#[test]
fn seams_stay_until_textures_are_left_out() {
    let mut sheet = textured(grid(30, 20), map);
    let positions = sheet.positions.clone();
    for (face, uv) in sheet.faces.iter().zip(sheet.texcoords.iter_mut().flatten()) {
        if face.iter().all(|&v| positions[v as usize].x >= 15.0) {
            uv.iter_mut().for_each(|uv| uv.x += 2.0);
        }
    }
    let outcome = run(&sheet, &coplanar());
    assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (4, 6));
    assert_corners(&sheet, &outcome.mesh);
    let found = texture_deviation(&sheet, &outcome.mesh, 256).expect("valid meshes").expect("textures");
    assert!(found.covered > 0.999 && found.mapping_distance < 1e-4, "{found:?}");
    let dropped = Dropped { texcoords: true, ..Dropped::default() };
    let bare = run(&sheet, &Options { dropped, ..coplanar() });
    assert_eq!((bare.mesh.faces.len(), bare.mesh.texcoords), (2, None));
}

/// A texture that bends keeps as many faces as it needs, and slips by no more than was allowed on either side.
#[test]
fn what_is_not_linear_is_parted() {
    let bent = |p: DVec3| [0.02 * p.x + 1e-4 * p.x * p.x, 0.03 * p.y];
    let sheet = textured(grid(40, 20), bent);
    let outcome = run(&sheet, &coplanar());
    assert!((4..400).contains(&outcome.mesh.faces.len()), "{} faces", outcome.mesh.faces.len());
    assert_corners(&sheet, &outcome.mesh);
    let found = texture_deviation(&sheet, &outcome.mesh, 512).expect("valid meshes").expect("textures");
    assert!(found.covered > 0.999 && found.mapping_distance < 2.5e-4 / 0.02, "{found:?}");
}

#[test]
fn normals_of_flats_stay_and_bent_ones_hold() {
    // Every side with vertices of its own and its own normal: 24 vertices.
    let whole = cube(9);
    let mut faceted = Mesh::default();
    let mut normals = Vec::new();
    for &face in &whole.faces {
        let [a, b, c] = face.map(|v| whole.positions[v as usize]);
        faceted.faces.push([0, 1, 2].map(|k| faceted.positions.len() as u32 + k));
        faceted.positions.extend([a, b, c]);
        normals.extend([(b - a).cross(c - a).normalize().as_vec3(); 3]);
    }
    faceted.normals = Some(normals);
    let outcome = run(&faceted, &coplanar());
    assert_eq!((outcome.mesh.faces.len(), outcome.mesh.positions.len()), (12, 24));
    let normals = outcome.mesh.normals.as_ref().expect("normals");
    for face in &outcome.mesh.faces {
        let [a, b, c] = face.map(|v| outcome.mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize().as_vec3();
        assert!(face.iter().all(|&v| normals[v as usize] == normal));
    }
    for (v, &origin) in outcome.vertex_origin.iter().enumerate() {
        assert_eq!(outcome.mesh.positions[v], faceted.positions[origin as usize]);
    }
    // Smooth ones bend along the cube's edges.
    let smooth = Mesh { normals: Some(vertex_normals(&whole)), ..whole };
    let kept = run(&smooth, &coplanar());
    assert!(kept.mesh.faces.len() > 100 && kept.mesh.faces.len() < smooth.faces.len(), "{}", kept.mesh.faces.len());
    for (v, &origin) in kept.vertex_origin.iter().enumerate() {
        let rows = [&kept.mesh, &smooth].map(|mesh| mesh.normals.as_ref().expect("normals"));
        assert_eq!(rows[0][v], rows[1][origin as usize]);
    }
    let free = run(&smooth, &Options { normals: Normals::Recompute, ..coplanar() });
    assert_eq!((free.mesh.faces.len(), free.mesh.normals.as_ref().map(Vec::len)), (12, Some(8)));
    let dropped = Dropped { normals: true, ..Dropped::default() };
    assert_eq!(run(&smooth, &Options { dropped, ..coplanar() }).mesh.normals, None);
}

/// Scalars and colors that are linear over a sheet stay at its corners; joints do not lie between two others.
#[test]
fn channels_of_flats_stay() {
    let mut sheet = grid(12, 9);
    let channel = |name: &str, kind: ChannelKind, width: usize, of: &dyn Fn(DVec3) -> Vec<f32>| Channel {
        name: name.into(),
        kind,
        width,
        values: grid(12, 9).positions.iter().flat_map(|&p| of(p)).collect(),
    };
    sheet.channels.push(channel("heat", ChannelKind::Linear, 1, &|p| vec![(3.0 * p.x - p.y) as f32]));
    sheet.channels.push(channel("TANGENT", ChannelKind::Tangent, 4, &|_| vec![1.0, 0.0, 0.0, -1.0]));
    let skin = |p: DVec3| vec![1.0, 2.0, 1.0 - p.x as f32 / 12.0, p.x as f32 / 12.0];
    sheet.channels.push(channel("JOINTS_0", ChannelKind::Joints, 4, &skin));
    sheet.colors = Some(sheet.positions.iter().map(|p| [p.x as f32 / 12.0, 0.5, 0.0, 1.0]).collect());
    let outcome = run(&sheet, &coplanar());
    assert_eq!((outcome.mesh.faces.len(), outcome.mesh.channels.len()), (2, 3));
    for (v, &origin) in outcome.vertex_origin.iter().enumerate() {
        for (after, before) in outcome.mesh.channels.iter().zip(&sheet.channels) {
            assert_eq!(after.row(v), before.row(origin as usize), "{}", before.name);
        }
        let colors = [&outcome.mesh, &sheet].map(|mesh| mesh.colors.as_ref().expect("colors"));
        assert_eq!(colors[0][v], colors[1][origin as usize]);
    }
    // A joint a column: the numbers are linear, and yet no joint is between two.
    sheet.channels[2] = channel("JOINTS_0", ChannelKind::Joints, 2, &|p| vec![p.x as f32, 1.0]);
    assert!(run(&sheet, &coplanar()).mesh.faces.len() > 100);
    let dropped = Dropped { channels: true, ..Dropped::default() };
    assert_eq!(run(&sheet, &Options { dropped, ..coplanar() }).mesh.faces.len(), 2);
}

#[test]
fn threads_give_the_same_meshes() {
    let mut mesh = made_of(textured(bumpy(cube(20), 0.002), |p| [p.x + 0.3 * p.z, p.y]), &SIDES, side);
    mesh.normals = Some(mesh.positions.iter().map(|p| Vec3::new(p.x as f32, 0.0, 1.0).normalize()).collect());
    let options = Options::coplanar(Flatness { angle_rad: 0.2, distance: 0.01 });
    let reference = run(&mesh, &options).mesh;
    assert!(reference.faces.len() < mesh.faces.len() / 4, "{} faces", reference.faces.len());
    for threads in [2, 5] {
        let method = Method::Partition(options.clone());
        let outcome = simplify(&mesh, &method, &Budget::default(), &cpu(threads), None).expect("a valid mesh");
        assert!(outcome.mesh == reference, "{threads} threads");
    }
}
