//! The engine on meshes of a few faces, where the right answer is known and there is only one.

mod support;

use coarsen::contract::{Metric, NonManifold, Options, Placement, PlaneWeight, Quadrics};
use coarsen::math::{DVec3, Vec3};
use coarsen::mesh::{shapes, validate};
use coarsen::simplify::{Blocked, MOVED};
use coarsen::{Budget, Mesh, Outcome, StopReason};
use support::engine::{METRICS, assert_kept, contract, options};
use support::independent::topology;
use support::shapes::{bumpy, mesh, sphere};

/// The cheapest of the two ends, so that results are exact.
fn at_ends(metric: Metric) -> Options {
    Options { metric, placement: Placement::Endpoint, ..Options::default() }
}

fn octahedron() -> Mesh {
    sphere(0)
}

/// The input vertices that are left, ascending; fails on a moved one.
fn survivors(outcome: &Outcome) -> Vec<u32> {
    let mut origins = outcome.vertex_origin.clone();
    origins.sort_unstable();
    assert!(!origins.contains(&MOVED), "a vertex moved: {:?}", outcome.mesh.positions);
    origins
}

/// A rim of corners around a vertex in the middle, which is the last: a fan of counter-clockwise faces.
fn fan(rim: &[[f64; 2]], middle: [f64; 2]) -> Mesh {
    let flat = |&[x, y]: &[f64; 2]| [x, y, 0.0];
    let positions: Vec<[f64; 3]> = rim.iter().chain([&middle]).map(flat).collect();
    let n = rim.len() as u32;
    mesh(&positions, &(0..n).map(|i| [i, (i + 1) % n, n]).collect::<Vec<_>>())
}

// Refusals

/// Every edge of a tetrahedron has the opposite vertices joined by an edge: contracting one leaves two faces back to back.
#[test]
fn a_tetrahedron_stays() {
    let tetrahedron = shapes::tetrahedron();
    for metric in METRICS {
        let outcome = contract(&tetrahedron, &options(metric), Budget::faces(2));
        assert_eq!((outcome.stop, &outcome.mesh), (StopReason::Stuck, &tetrahedron), "{metric:?}");
        assert_eq!(outcome.blocked, Blocked { link: 6, ..Blocked::default() }, "{metric:?}");
    }
}

#[test]
fn an_octahedron_becomes_a_tetrahedron() {
    for metric in METRICS {
        let outcome = contract(&octahedron(), &options(metric), Budget::faces(4));
        assert_eq!(outcome.stop, StopReason::FacesReached, "{metric:?}");
        assert_eq!((outcome.mesh.positions.len(), outcome.mesh.faces.len()), (4, 4), "{metric:?}");
        assert_kept("octahedron", &octahedron(), &outcome);
        assert!(outcome.mesh.volume() > 0.0, "{metric:?}: inside out");
    }
}

/// ```text
///          4           Two tips over a triangle 0 1 2. Each of its edges closes a tube of three edges: contracting one
///         /|\          would leave two faces back to back under each tip. The other six edges lead to a tetrahedron,
///        / | \         and turn faces by far more than the hundredth of a radian that is allowed.
///       0--1--2
///        \ | /
///         \|/
///          3
/// ```
#[test]
fn a_tube_of_three_edges_is_not_pinched() {
    let corner =
        |turn: f64| [0.1 * (turn * std::f64::consts::TAU).cos(), 0.1 * (turn * std::f64::consts::TAU).sin(), 0.0];
    let positions = [corner(0.0), corner(1.0 / 3.0), corner(2.0 / 3.0), [0.0, 0.0, -9.0], [0.0, 0.0, 9.0]];
    let faces = [[0, 1, 4], [1, 2, 4], [2, 0, 4], [1, 0, 3], [2, 1, 3], [0, 2, 3]];
    let spindle = mesh(&positions, &faces);
    for metric in METRICS {
        let stiff = Options { max_flip_rad: 0.01, ..options(metric) };
        let outcome = contract(&spindle, &stiff, Budget::faces(4));
        assert_eq!((outcome.stop, &outcome.mesh), (StopReason::Stuck, &spindle), "{metric:?}");
        assert_eq!(outcome.blocked, Blocked { link: 3, flip: 6, ..Blocked::default() }, "{metric:?}");
        let outcome = contract(&spindle, &at_ends(metric), Budget::faces(4));
        assert_eq!(survivors(&outcome)[2..], [3, 4], "{metric:?}");
        assert_kept("spindle", &spindle, &outcome);
    }
}

/// ```text
///            5             The border is locked, so vertex 6 must go to one of the rim. From all but 5 a part of the
///          /   \           rim is hidden behind the spikes 1 and 3, and a face would turn over. All six costs are 0:
///        /   6   \         without the test for flips five of six orders choose wrong.
///      /   1   3   \
///    / /     2     \ \
///   0                 4
/// ```
#[test]
fn the_only_contraction_that_flips_no_face_is_found() {
    let crown = fan(&[[0.0, 0.0], [2.0, 1.0], [3.0, 0.0], [4.0, 1.0], [6.0, 0.0], [3.0, 5.0]], [3.0, 2.0]);
    for metric in METRICS {
        let options = Options { lock_border: true, ..options(metric) };
        let outcome = contract(&crown, &options, Budget::faces(0));
        assert_eq!(outcome.mesh.faces, [[0, 1, 5], [1, 2, 5], [2, 3, 5], [3, 4, 5]], "{metric:?}");
        assert_eq!(outcome.mesh.positions, crown.positions[..6], "{metric:?}");
        assert_eq!(outcome.stop, StopReason::Stuck, "{metric:?}");
    }
}

// Borders

/// ```text
///       3---2        Vertex 6 lies in the plane of an irregular hexagon: it costs nothing, every corner something.
///      / \ / \       A border weight that is not applied would take a corner as soon.
///     4---6---1
///      \ / \ /
///       5---0
/// ```
#[test]
fn a_vertex_in_a_plane_vanishes_and_the_border_stays() {
    let hexagon = [[1.0, -2.1], [2.2, 0.1], [1.1, 2.0], [-0.9, 1.8], [-2.0, -0.2], [-1.1, -1.9]];
    let fan = fan(&hexagon, [0.1, 0.2]);
    for metric in METRICS {
        let outcome = contract(&fan, &at_ends(metric), Budget::faces(4));
        assert_eq!(survivors(&outcome), [0, 1, 2, 3, 4, 5], "{metric:?}");
        assert!((outcome.mesh.area() - fan.area()).abs() < 1e-12, "{metric:?}");

        let outcome = contract(&fan, &options(metric), Budget::faces(4));
        let moved = |p: &DVec3| fan.positions[..6].iter().map(|q| p.distance(*q)).fold(f64::INFINITY, f64::min);
        let farthest = outcome.mesh.positions.iter().map(moved).fold(0.0, f64::max);
        // The pull to the pair's midpoint is a ten-thousandth.
        assert!(farthest < 1e-3, "{metric:?}: the border moved by {farthest}");
    }
}

/// ```text
///   3---4---5        1 and 4 lie on straight borders; 0, 2, 3 and 5 are corners.
///   | / | / |
///   0---1---2
/// ```
#[test]
fn corners_of_the_border_stay() {
    let strip = shapes::plane(2, 1);
    for metric in METRICS {
        let outcome = contract(&strip, &at_ends(metric), Budget::faces(2));
        assert_eq!(survivors(&outcome), [0, 2, 3, 5], "{metric:?}");
        assert_eq!(outcome.mesh.area(), 2.0, "{metric:?}");
    }
}

/// ```text
///   A strip around a triangular hole, outside with nine corners. Both borders of the least such strip have three
///   edges and six faces lie between them: contracting once more would close the hole.
/// ```
#[test]
fn a_hole_of_three_edges_is_not_closed() {
    let turn = |i: u32, n: u32, r: f64| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        [r * angle.cos(), r * angle.sin(), 0.0]
    };
    let positions: Vec<[f64; 3]> = (0..3).map(|i| turn(i, 3, 1.0)).chain((0..9).map(|i| turn(i, 9, 4.0))).collect();
    let outside = (0..9).map(|i| [i / 3, 3 + i, 3 + (i + 1) % 9]);
    let inside = (0..3).map(|i| [i, 3 + (3 * i + 3) % 9, (i + 1) % 3]);
    let strip = mesh(&positions, &outside.chain(inside).collect::<Vec<_>>());
    assert_eq!(topology(&strip).border_loops, 2);
    for metric in METRICS {
        let outcome = contract(&strip, &options(metric), Budget::faces(0));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 6), "{metric:?}");
        assert_kept("strip", &strip, &outcome);
    }
}

/// ```text
///   A vertex, a ring of eight around it and a border of eight. With the border locked the nine inner ones go, and an
///   octagon of six faces is left.
/// ```
#[test]
fn a_locked_border_stays_to_the_bit() {
    let turn = |i: u32, r: f64| {
        let angle = std::f64::consts::TAU * f64::from(i) / 8.0;
        [r * angle.cos(), r * angle.sin(), 0.0]
    };
    let positions: Vec<[f64; 3]> =
        (0..8).map(|i| turn(i, 3.1)).chain((0..8).map(|i| turn(i, 1.3))).chain([[0.0; 3]]).collect();
    let sector = |i: u32| {
        let (j, ring) = ((i + 1) % 8, 8);
        [[i, j, ring + j], [i, ring + j, ring + i], [ring + i, ring + j, 16]]
    };
    let disk = mesh(&positions, &(0..8).flat_map(sector).collect::<Vec<_>>());
    for metric in METRICS {
        let locked = Options { lock_border: true, ..options(metric) };
        let outcome = contract(&disk, &locked, Budget::faces(0));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 6), "{metric:?}");
        assert_eq!(survivors(&outcome), [0, 1, 2, 3, 4, 5, 6, 7], "{metric:?}");
        assert_eq!(outcome.mesh.positions, disk.positions[..8], "{metric:?}");
        let free = contract(&disk, &options(metric), Budget::faces(0));
        assert_eq!(free.mesh.faces.len(), 1, "{metric:?}: unlocked, the border goes too");
    }
}

// Surfaces that are not manifold

/// ```text
///   o---o---0---o---o      Three such pages on the edge 0 1, one behind the other.
///   | / | / | \ | \ |
///   o---o---1---o---o
/// ```
#[test]
fn an_edge_of_three_faces_stays() {
    let directions = [[1.0, 0.0], [-0.5, 0.9], [-0.5, -0.9]];
    let mut positions = vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    let mut faces = Vec::new();
    for [x, y] in directions {
        let (mut low, mut high) = (0, 1);
        for r in [1.0, 2.0] {
            let next = positions.len() as u32;
            positions.extend([[r * x, r * y, 0.0], [r * x, r * y, 1.0]]);
            faces.extend([[low, next, next + 1], [low, next + 1, high]]);
            (low, high) = (next, next + 1);
        }
    }
    let book = mesh(&positions, &faces);
    assert_eq!(topology(&book).non_manifold_edges, 1);
    for metric in METRICS {
        let outcome = contract(&book, &at_ends(metric), Budget::faces(6));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 6), "{metric:?}");
        assert_kept("book", &book, &outcome);
        assert_eq!(outcome.mesh.positions[..2], book.positions[..2], "{metric:?}");
        assert!((outcome.mesh.area() - book.area()).abs() < 1e-12, "{metric:?}");
        assert!(
            outcome.warnings.iter().any(|w| w.starts_with("vertices that stay") && w.ends_with(": 2")),
            "{:?}",
            outcome.warnings
        );
    }
}

/// Two squares of eight faces that share one corner and nothing else.
#[test]
fn a_vertex_that_joins_two_sheets_stays() {
    let sheet = shapes::plane(2, 2);
    let mut pair = sheet.clone();
    pair.positions.extend(sheet.positions[..8].iter().map(|p| *p - DVec3::new(2.0, 2.0, 0.0)));
    pair.faces.extend(sheet.faces.iter().map(|face| face.map(|v| if v == 8 { 0 } else { 9 + v })));
    assert_eq!(topology(&pair).bow_ties, 1);
    for metric in METRICS {
        let outcome = contract(&pair, &at_ends(metric), Budget::faces(4));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 4), "{metric:?}");
        assert_kept("two sheets", &pair, &outcome);
        assert!(survivors(&outcome).contains(&0), "{metric:?}");
        assert_eq!(outcome.mesh.area(), 8.0, "{metric:?}");
    }
}

/// Two blocks that touch in a line of four edges.
fn touching_blocks() -> Mesh {
    shapes::voxels([8, 8, 4], |[x, y, _]| (x < 4) == (y < 4))
}

#[test]
fn what_only_touches_goes_its_own_way() {
    let blocks = touching_blocks();
    assert_eq!(topology(&blocks).non_manifold_edges, 4);
    for metric in METRICS {
        let outcome = contract(&blocks, &options(metric), Budget::faces(24));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 24), "{metric:?}");
        let left = topology(&outcome.mesh);
        assert_eq!((left.components, left.border_edges, left.non_manifold_edges), (2, 0, 0), "{metric:?}: {left:?}");
        assert!((outcome.mesh.volume() - 128.0).abs() < 1e-3, "{metric:?}: {}", outcome.mesh.volume());
        assert!(outcome.warnings.iter().any(|w| w.contains("takes 5 more vertices")), "{:?}", outcome.warnings);
    }
}

#[test]
fn what_touches_stays_where_it_is_to_be_held() {
    let blocks = touching_blocks();
    let on_line = |p: &&DVec3| p.x == 4.0 && p.y == 4.0;
    for metric in METRICS {
        let held = Options { non_manifold: NonManifold::Hold, ..options(metric) };
        let outcome = contract(&blocks, &held, Budget::faces(40));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 40), "{metric:?}");
        assert_kept("blocks", &blocks, &outcome);
        assert_eq!(outcome.mesh.positions.iter().filter(on_line).count(), 5, "{metric:?}");
    }
}

#[test]
fn copies_carry_what_their_vertex_did() {
    let mut blocks = touching_blocks();
    blocks.colors = Some((0..blocks.positions.len()).map(|v| [v as f32 / 256.0, 0.5, 0.25, 1.0]).collect());
    let corner = |face: &[u32; 3]| face.map(|v| blocks.positions[v as usize].truncate().as_vec2() / 8.0);
    blocks.texcoords = Some(blocks.faces.iter().map(corner).collect());
    for mesh in [&blocks, &touching_blocks()] {
        let outcome = contract(mesh, &Options::default(), Budget::keep(0.8));
        let left = &outcome.mesh;
        left.check().expect("a valid mesh");
        let stands = outcome.vertex_origin.iter().enumerate().filter(|(_, origin)| **origin != MOVED);
        for (v, &origin) in stands.clone() {
            assert_eq!(left.positions[v], mesh.positions[origin as usize]);
            if let (Some(now), Some(before)) = (&left.colors, &mesh.colors) {
                assert_eq!(now[v], before[origin as usize]);
            }
        }
        assert!(stands.count() > 50);
        assert_eq!((left.colors.is_some(), topology(left).components), (mesh.colors.is_some(), 2));
    }
}

/// Faces wound the other way round keep their winding, and the rest of the surface does not notice.
#[test]
fn a_face_wound_the_other_way_keeps_its_winding() {
    let sphere = bumpy(sphere(3), 0.05);
    let mut mixed = sphere.clone();
    mixed.faces.iter_mut().step_by(7).for_each(|face| face.swap(1, 2));
    for metric in METRICS {
        let straight = contract(&sphere, &options(metric), Budget::faces(200));
        let outcome = contract(&mixed, &options(metric), Budget::faces(200));
        assert_eq!(outcome.mesh.positions, straight.mesh.positions, "{metric:?}");
        let as_sets = |mesh: &Mesh| {
            let mut faces = mesh.faces.clone();
            faces.iter_mut().for_each(|face| face.sort_unstable());
            faces
        };
        assert_eq!(as_sets(&outcome.mesh), as_sets(&straight.mesh), "{metric:?}");
        let turned = outcome.mesh.faces.iter().zip(&straight.mesh.faces).filter(|(a, b)| {
            let first = b.iter().position(|v| *v == a[0]).unwrap_or(0);
            a[1] != b[(first + 1) % 3]
        });
        let turned = turned.count();
        assert!((10..=60).contains(&turned), "{metric:?}: {turned} of 200 faces turned, one in seven was");
    }
}

// Components and hubs

#[test]
fn two_components_both_stay() {
    let mut pair = octahedron();
    let other = octahedron();
    pair.positions.extend(other.positions.iter().map(|p| *p * 0.01 + DVec3::X * 9.0));
    pair.faces.extend(other.faces.iter().map(|face| face.map(|v| v + 6)));
    for metric in METRICS {
        let outcome = contract(&pair, &options(metric), Budget::faces(0));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 8), "{metric:?}");
        assert_kept("two octahedra", &pair, &outcome);
    }
}

/// Two vertices of 3000 faces each: what costs the square of a ring would take minutes.
#[test]
fn hubs_of_thousands_of_faces_are_no_trap() {
    let can = shapes::cylinder(3000);
    for metric in METRICS {
        let clock = std::time::Instant::now();
        let outcome = contract(&can, &options(metric), Budget::faces(400));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 400), "{metric:?}");
        assert_kept("can", &can, &outcome);
        assert!((outcome.mesh.volume() / can.volume() - 1.0).abs() < 0.01, "{metric:?}: {}", outcome.mesh.volume());
        assert!(clock.elapsed().as_secs() < 10, "{metric:?}: {:?}", clock.elapsed());
    }
}

/// One triangle has nothing to give, two give one.
#[test]
fn a_face_is_left() {
    let one = mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]);
    for metric in METRICS {
        let outcome = contract(&one, &options(metric), Budget::faces(0));
        assert_eq!((outcome.stop, &outcome.mesh), (StopReason::Stuck, &one), "{metric:?}");
        assert_eq!(outcome.blocked, Blocked { link: 3, ..Blocked::default() }, "{metric:?}");
        let outcome = contract(&shapes::plane(1, 1), &at_ends(metric), Budget::faces(0));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::Stuck, 1), "{metric:?}");
        assert_eq!(validate(&outcome.mesh), [], "{metric:?}");
    }
}

// What vertices carry

/// Far from the origin, where a detour over single precision would show.
#[test]
fn endpoints_are_vertices_of_the_input_to_the_bit() {
    let mut sphere = bumpy(sphere(3), 0.1);
    sphere.positions.iter_mut().for_each(|p| *p = *p * 0.3 + DVec3::new(1000.1, -77.7, 3.3));
    for metric in METRICS {
        let outcome = contract(&sphere, &at_ends(metric), Budget::faces(100));
        let origins = survivors(&outcome);
        assert!(origins.windows(2).all(|pair| pair[0] < pair[1]), "{metric:?}: a vertex came twice");
        for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
            assert_eq!(*p, sphere.positions[origin as usize], "{metric:?}: vertex {origin}");
        }

        let outcome = contract(&sphere, &options(metric), Budget::faces(300));
        let moved = outcome.vertex_origin.iter().filter(|&&origin| origin == MOVED).count();
        assert!(moved > 0 && moved < outcome.vertex_origin.len(), "{metric:?}: {moved} moved");
        for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
            assert_eq!(origin == MOVED, !sphere.positions.contains(p), "{metric:?}: {p} from {origin}");
        }
    }
}

/// Every face with corners of its own, as in an STL file: origins are the input's numbers, not those after welding.
#[test]
fn origins_count_as_the_input_does() {
    let sphere = bumpy(sphere(2), 0.1);
    let corners = sphere.faces.iter().flatten().map(|&v| sphere.positions[v as usize]);
    let soup = Mesh::new(corners.collect(), (0..128).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect());
    for metric in METRICS {
        let outcome = contract(&soup, &at_ends(metric), Budget::faces(40));
        assert_eq!(outcome.mesh.faces.len(), 40, "{metric:?}");
        for (p, &origin) in outcome.mesh.positions.iter().zip(&outcome.vertex_origin) {
            assert_eq!(*p, soup.positions[origin as usize], "{metric:?}: vertex {origin}");
        }
    }
}

/// ```text
///   2---3        Left red and facing x, right green and facing y. The short sides go, to their midpoints: half red, half
///   |  /|        green, facing between. The long sides would cost nine times as much.
///   | / |
///   |/  |
///   0---1
/// ```
/// Planes count one each: by area, those of the long edges weigh nine times as much, and both sides cost the same.
#[test]
fn colors_and_normals_are_interpolated() {
    let (red, green) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 0.5]);
    let tall = Mesh {
        colors: Some(vec![red, green, red, green]),
        normals: Some(vec![Vec3::X, Vec3::Y, Vec3::X, Vec3::Y]),
        ..mesh(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 3.0, 0.0]], &[[0, 1, 3], [0, 3, 2]])
    };
    for metric in METRICS {
        let planes = if metric == Metric::Plane { PlaneWeight::One } else { PlaneWeight::default() };
        let quadrics = Quadrics { planes, ..Quadrics::default() };
        let outcome = contract(&tall, &Options { quadrics, ..options(metric) }, Budget::faces(1));
        let middle = outcome.vertex_origin.iter().position(|&origin| origin == MOVED).expect("a new vertex");
        let (colors, normals) = (outcome.mesh.colors.expect("colors"), outcome.mesh.normals.expect("normals"));
        assert!((outcome.mesh.positions[middle].x - 0.5).abs() < 1e-6, "{metric:?}");
        let expected = [0.5, 0.5, 0.0, 0.75];
        let off = colors[middle].iter().zip(expected).map(|(a, b): (&f32, f32)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 1e-6, "{metric:?}: {:?}", colors[middle]);
        assert!((normals[middle] - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6, "{metric:?}");
        for (i, &origin) in outcome.vertex_origin.iter().enumerate().filter(|&(i, _)| i != middle) {
            assert_eq!(colors[i], if origin % 2 == 0 { red } else { green }, "{metric:?}: vertex {origin}");
        }
    }
}
