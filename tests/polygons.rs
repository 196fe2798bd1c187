//! Regions as polygons: known answers, what all of them keep, and files that are read back.

mod support;

use std::collections::BTreeMap;

use coarsen::formats::{self, Document, Format, Scene, WriteOptions};
use coarsen::math::{DVec3, Vec3};
use coarsen::mesh::{Normals, Polygons, sample, shapes};
use coarsen::papers::light;
use coarsen::partition::{Flatness, Options, Superfaces, Triangulation, vsa};
use coarsen::{Budget, Error, Mesh, Method, Outcome, simplify};
use support::engine::cpu;
use support::independent::topology;
use support::shapes::{bumpy, cube, grid, sphere, torus};

fn run(mesh: &Mesh, options: &Options) -> Outcome {
    simplify(mesh, &Method::Partition(options.clone()), &Budget::default(), &cpu(1), None).expect("a valid mesh")
}

fn coplanar() -> Options {
    Options::coplanar(Flatness::default())
}

fn variational(regions: usize) -> Options {
    Options::variational(vsa::Goal::Regions(regions))
}

fn polygons(outcome: &Outcome) -> &Polygons {
    &outcome.regions.as_ref().expect("regions").polygons
}

/// Twice the area vector of a ring.
fn area_vector(mesh: &Mesh, ring: &[u32]) -> DVec3 {
    let at = |v: u32| mesh.positions[v as usize] - mesh.positions[ring[0] as usize];
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| at(a).cross(at(b))).sum()
}

fn sides(ring: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| [a, b])
}

/// How often each directed edge is there.
fn uses(edges: impl Iterator<Item = [u32; 2]>) -> BTreeMap<[u32; 2], i32> {
    let mut uses = BTreeMap::new();
    edges.for_each(|edge| *uses.entry(edge).or_default() += 1);
    uses
}

/// What holds for all: rows, the area vector of the triangles, each directed edge once and as an edge of the triangles; and
/// what has no other side is a border of the triangles. Returns the number of bridges.
fn assert_polygons(name: &str, outcome: &Outcome) -> usize {
    let (mesh, polygons) = (&outcome.mesh, polygons(outcome));
    polygons.check(mesh).unwrap_or_else(|error| panic!("{name}: {error}"));
    let labels = &outcome.regions.as_ref().expect("regions").face_labels;
    let mut bridges = 0;
    for (at, ring) in polygons.iter().enumerate() {
        let faces = polygons.first_face(at)..polygons.first_face(at) + ring.len() - 2;
        assert!(labels[faces.clone()].iter().all(|&label| label == labels[faces.start]), "{name}: {at}, two regions");
        let filled: DVec3 = faces.clone().map(|face| area_vector(mesh, &mesh.faces[face])).sum();
        let off = (filled - area_vector(mesh, ring)).length();
        assert!(off < 1e-12 * mesh.diagonal().powi(2), "{name}: the area of polygon {at} is off by {off}");
        let own = uses(sides(ring));
        bridges += own.keys().filter(|&&[a, b]| a < b && own.contains_key(&[b, a])).count();
    }
    let of_polygons = uses(polygons.iter().flat_map(sides));
    let of_faces = uses(mesh.faces.iter().flat_map(|face| sides(face)));
    for (&[a, b], &count) in &of_polygons {
        assert!(count <= of_faces.get(&[a, b]).copied().unwrap_or(0), "{name}: edge {a} {b} is no triangle's");
        let other = of_polygons.get(&[b, a]).copied().unwrap_or(0);
        assert_eq!(other, of_faces.get(&[b, a]).copied().unwrap_or(0), "{name}: edge {a} {b} has another side too few");
    }
    let border = |uses: &BTreeMap<[u32; 2], i32>| uses.keys().filter(|&&[a, b]| !uses.contains_key(&[b, a])).count();
    assert_eq!(border(&of_polygons), border(&of_faces), "{name}: borders");
    bridges
}

/// The polygons written as OBJ, binary PLY and text PLY, and read again.
fn read_back(name: &str, mesh: &Mesh, polygons: &Polygons) -> [Mesh; 3] {
    let forms = [(Format::Obj, "f "), (Format::Ply, "element face "), (Format::Ply, "element face ")];
    let mut is_ascii = false;
    forms.map(|(format, line)| {
        is_ascii = !is_ascii;
        let mut bytes = Vec::new();
        let options = WriteOptions { ascii: is_ascii };
        formats::write_polygons_to(mesh, polygons, &Document::None, format, &options, &mut bytes).expect("polygons");
        let rows = bytes.split(|&b| b == b'\n').filter(|row| row.starts_with(line.as_bytes()));
        match format {
            Format::Obj => assert_eq!(rows.count(), polygons.len(), "{name}"),
            _ => assert!(rows.eq([format!("element face {}", polygons.len()).as_bytes()]), "{name}"),
        }
        let read = formats::read_bytes(&bytes, format).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(read.positions.len(), mesh.positions.len(), "{name}");
        assert_eq!(read.faces.len(), mesh.faces.len(), "{name}: a polygon of k corners is k - 2 triangles");
        read
    })
}

/// The polygons of flat regions, read back: the same topology, and the area within a share; binary PLY rounds positions.
fn assert_same_surface(name: &str, mesh: &Mesh, polygons: &Polygons, share: f64) {
    let kept = |mesh: &Mesh| {
        let t = topology(mesh);
        (t.euler, t.components, t.border_loops, t.non_manifold_edges, t.bow_ties, t.misoriented_edges)
    };
    for read in read_back(name, mesh, polygons) {
        assert_eq!(kept(&read), kept(mesh), "{name}");
    }
    assert_same_area(name, mesh, polygons, share);
}

/// Two polygons that share two vertices may get the same diagonal from a reader, which sees one at a time.
fn assert_same_area(name: &str, mesh: &Mesh, polygons: &Polygons, share: f64) {
    for read in read_back(name, mesh, polygons) {
        let (area, volume) = (mesh.area(), mesh.volume());
        assert!((read.area() / area - 1.0).abs() < share, "{name}: an area of {} for {area}", read.area());
        assert!((read.volume() - volume).abs() < share * area.powf(1.5), "{name}: {} for {volume}", read.volume());
    }
}

#[test]
fn a_cube_becomes_six_quads() {
    for n in [1, 2, 9] {
        for (name, options) in [("coplanar", coplanar()), ("vsa", variational(6))] {
            let outcome = run(&cube(n), &options);
            let name = format!("{name} of {n}");
            assert_eq!(assert_polygons(&name, &outcome), 0, "{name}");
            let polygons = polygons(&outcome);
            assert_eq!(polygons.starts, [0, 4, 8, 12, 16, 20, 24], "{name}");
            assert!(polygons.iter().all(|ring| area_vector(&outcome.mesh, ring).length() == 2.0), "{name}");
            assert_same_surface(&name, &outcome.mesh, polygons, 1e-9);
        }
    }
}

/// Evenly lit, sides are superfaces; a spot keeps vertices inside its side, which is then a polygon a face.
#[test]
fn superfaces_become_polygons() {
    let cube = cube(6);
    let lit = |light: fn(DVec3) -> f32| Mesh {
        colors: Some(cube.positions.iter().map(|&p| [light(p), 0.5, 0.5, 1.0]).collect()),
        ..cube.clone()
    };
    let options = Options::superfaces(Superfaces::default());
    let even = run(&lit(|_| 0.25), &options);
    assert_eq!(assert_polygons("even", &even), 0);
    assert_eq!(polygons(&even).starts, [0, 4, 8, 12, 16, 20, 24]);
    assert_same_surface("even", &even.mesh, polygons(&even), 1e-9);
    let top = cube.positions.iter().map(|p| p.z).fold(f64::MIN, f64::max);
    assert_eq!(top, 1.0, "the spot below is on a side");
    let spot = run(&lit(|p| if p == DVec3::new(0.5, 0.5, 1.0) { 0.9 } else { 0.25 }), &options);
    assert_polygons("spot", &spot);
    let rings = || polygons(&spot).iter().map(<[u32]>::len);
    assert_eq!(rings().filter(|&corners| corners == 4).count(), 5);
    assert!(rings().filter(|&corners| corners == 3).count() >= 4, "{:?}", polygons(&spot).starts);
    assert_same_surface("spot", &spot.mesh, polygons(&spot), 1e-9);
    // Of a room with its shadows, on either side of steps of light.
    let room = sample("room", Some(3000)).expect("a sample");
    for pair in [light::PAIRS[0], light::PAIRS[1]] {
        let Method::Partition(options) = light::superfaces(pair) else { panic!("another method") };
        let outcome = run(&room, &options);
        assert_polygons("room", &outcome);
        assert_same_area("room", &outcome.mesh, polygons(&outcome), 1e-6);
        assert!(polygons(&outcome).len() < outcome.mesh.faces.len(), "{pair:?}: no superface is a polygon");
    }
}

#[test]
fn holes_are_joined_by_bridges() {
    let slab = shapes::double_torus();
    for triangulation in [Triangulation::Earcut, Triangulation::Ears] {
        let outcome = run(&slab, &Options { triangulation, ..coplanar() });
        // Top and bottom with two holes each: 4 + 2 · 4 corners, and two more for each bridge.
        assert_eq!(assert_polygons("slab", &outcome), 4);
        let mut corners: Vec<usize> = polygons(&outcome).iter().map(<[u32]>::len).collect();
        corners.sort_unstable();
        assert_eq!(corners, [[4; 12].as_slice(), &[16, 16]].concat());
        assert_same_surface("slab", &outcome.mesh, polygons(&outcome), 1e-9);
    }
}

/// A plate of `n` × `n` square holes, whose bridges lie on lines with the sides of others; 12 n² corners inside at least.
fn sieve(n: u32) -> Mesh {
    let cells = 2 * n + 1;
    let mut plate = grid(cells, cells);
    let cell_of = |face: usize| [face as u32 / 2 % cells, face as u32 / 2 / cells];
    let faces = std::mem::take(&mut plate.faces);
    plate.faces = faces
        .into_iter()
        .enumerate()
        .filter(|&(face, _)| !cell_of(face).iter().all(|cell| cell % 2 == 1))
        .map(|(_, face)| face)
        .collect();
    plate
}

#[test]
fn plates_of_many_holes_are_read_back() {
    for (n, counts) in [(1, "uchar"), (3, "uchar"), (12, "int")] {
        for turned in [0.0, 0.3, 1.1] {
            let mut plate = sieve(n);
            for p in &mut plate.positions {
                *p = DVec3::new(p.x * f64::cos(turned) - p.y * f64::sin(turned), p.y, p.x * f64::sin(turned) + p.y);
            }
            let name = format!("{n}² holes turned by {turned}");
            let outcome = run(&plate, &coplanar());
            let holes = (n * n) as usize;
            assert_eq!(assert_polygons(&name, &outcome), holes, "{name}");
            assert_eq!(polygons(&outcome).starts, [0, 4 + 6 * holes as u32], "{name}");
            assert_same_surface(&name, &outcome.mesh, polygons(&outcome), 1e-6);
            let mut bytes = Vec::new();
            let options = WriteOptions::default();
            formats::write_polygons_to(
                &outcome.mesh,
                polygons(&outcome),
                &Document::None,
                Format::Ply,
                &options,
                &mut bytes,
            )
            .expect("polygons");
            let property = format!("property list {counts} int vertex_indices\n");
            assert!(bytes.windows(property.len()).any(|window| window == property.as_bytes()), "{name}");
        }
    }
}

#[test]
fn polygons_cover_what_triangles_do() {
    let meshes = [
        ("part", sample("part", Some(20_000)).expect("a sample")),
        ("assembly", sample("assembly", Some(6000)).expect("a sample")),
        ("statue", sample("statue", Some(6000)).expect("a sample")),
        ("torus", torus(40, 24)),
        ("sheet", bumpy(grid(24, 20), 0.3)),
        ("tube", shapes::tube(30)),
        ("sphere", sphere(4)),
    ];
    for (name, mesh) in &meshes {
        for (kind, options) in [
            ("coplanar", coplanar()),
            ("bent", Options::coplanar(Flatness { angle_rad: 0.5, distance: 0.01 })),
            ("vsa", variational(40)),
        ] {
            let name = format!("{name} {kind}");
            let outcome = run(mesh, &options);
            assert_polygons(&name, &outcome);
            if kind == "coplanar" {
                assert_same_surface(&name, &outcome.mesh, polygons(&outcome), 1e-4);
            }
        }
    }
}

#[test]
fn attributes_go_along() {
    let mut mesh = cube(4);
    mesh.normals = Some(mesh.positions.iter().map(|p| (*p - 0.5).as_vec3().normalize()).collect());
    mesh.colors = Some(mesh.positions.iter().map(|p| p.as_vec3().extend(1.0).to_array()).collect());
    let color = |face: usize| [(face / 32) as f32 / 5.0, 0.0, 1.0, 1.0];
    mesh.face_colors = Some((0..mesh.faces.len()).map(color).collect());
    // Normals that bend would hold the faces along the edges.
    let outcome = run(&mesh, &Options { normals: Normals::Recompute, ..coplanar() });
    let mut bytes = Vec::new();
    formats::write_polygons_to(
        &outcome.mesh,
        polygons(&outcome),
        &Document::None,
        Format::Ply,
        &WriteOptions::default(),
        &mut bytes,
    )
    .expect("polygons");
    let read = formats::read_bytes(&bytes, Format::Ply).expect("a mesh");
    assert_eq!((read.colors, read.face_colors), (outcome.mesh.colors, outcome.mesh.face_colors));
    let off = |(a, b): (&Vec3, &Vec3)| (*a - *b).length();
    let [was, is] = [outcome.mesh.normals, read.normals].map(|normals| normals.expect("normals"));
    assert!(was.iter().zip(&is).map(off).all(|off| off < 1e-6));
}

#[test]
fn wrong_uses_are_refused() {
    let outcome = run(&cube(2), &coplanar());
    let (mesh, polygons) = (&outcome.mesh, polygons(&outcome));
    let to = |format, polygons: &Polygons| {
        formats::write_polygons_to(mesh, polygons, &Document::None, format, &WriteOptions::default(), &mut Vec::new())
    };
    for format in [Format::Stl, Format::Off] {
        let error = to(format, polygons).expect_err("no polygons");
        assert!(matches!(&error, Error::Unsupported(message) if message.contains("OBJ or PLY")), "{error}");
    }
    let fewer = Polygons { starts: polygons.starts[..6].to_vec(), corners: polygons.corners[..20].to_vec() };
    assert!(matches!(to(Format::Obj, &fewer), Err(Error::Mesh(_))));
}

/// What the input says beside its faces goes along with polygons as with triangles.
#[test]
fn materials_keep_their_library() {
    let text =
        "mtllib things.mtl\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\nf 1/1 3/1 4/1\n";
    let Scene { mesh, document, .. } = formats::read_scene_bytes(text.as_bytes(), Format::Obj, None).expect("a scene");
    let outcome = run(&mesh, &coplanar());
    let mut bytes = Vec::new();
    let losses = formats::write_polygons_to(
        &outcome.mesh,
        polygons(&outcome),
        &document,
        Format::Obj,
        &WriteOptions::default(),
        &mut bytes,
    );
    let written = String::from_utf8(bytes).expect("text");
    assert!(written.contains("mtllib things.mtl\n") && written.contains("usemtl red\nf 1 2 3 4\n"), "{written}");
    let told = ["texture coordinates are not written: they belong to triangles, not to polygons"];
    assert_eq!(losses.expect("written"), told);
}
