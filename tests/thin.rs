//! What the planes of faces do not tell: where thin sheets end, walls that have two sides, faces like needles, strips.

mod support;

use std::collections::BTreeSet;

use coarsen::contract::Options;
use coarsen::math::DVec3;
use coarsen::mesh::{sample, shapes};
use coarsen::{Budget, Mesh, StopReason};
use support::deviation::deviation;
use support::engine::contract;
use support::shapes::{boxed, grid, sphere};

/// A bent sheet of a square of `n`² squares on either side, so thick in its length, closed along its rim.
fn sheet(n: u32, thickness: f64) -> Mesh {
    let bend = |p: DVec3| DVec3::new(p.x, p.y, 0.2 * (3.0 * p.x).sin() * (2.0 * p.y).cos());
    let flat = grid(n, n);
    let count = flat.positions.len() as u32;
    let side = |up: f64| flat.positions.iter().map(move |&p| bend(p / f64::from(n)) + DVec3::Z * up);
    let positions = side(thickness).chain(side(0.0)).collect();
    let mut faces = flat.faces.clone();
    faces.extend(flat.faces.iter().map(|&[a, b, c]| [a + count, c + count, b + count]));
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let corners = [[0, 0], [n, 0], [n, n], [0, n]];
    for (k, [x, y]) in corners.into_iter().enumerate() {
        let [to_x, to_y] = corners[(k + 1) % 4];
        let step = |from: u32, to: u32, i: u32| if to > from { from + i } else { from - i * u32::from(to < from) };
        let rim = |i: u32| at(step(x, to_x, i), step(y, to_y, i));
        for i in 0..n {
            let (a, b) = (rim(i), rim(i + 1));
            faces.extend([[b, a, a + count], [b, a + count, b + count]]);
        }
    }
    Mesh::new(positions, faces)
}

/// `count`² closed boxes side by side, with n² squares a wall; those inside lie on each other.
fn rooms(count: u32, n: u32) -> Mesh {
    let room = boxed(n);
    let mut all = Mesh::default();
    for at in (0..count * count).map(|room| DVec3::new(f64::from(room % count), f64::from(room / count), 0.0)) {
        let first = all.positions.len() as u32;
        all.positions.extend(room.positions.iter().map(|&p| p + 2.0 * at));
        all.faces.extend(room.faces.iter().map(|face| face.map(|v| v + first)));
    }
    all
}

#[test]
fn thin_sheets_keep_their_rims() {
    let sheet = sheet(100, 5e-4);
    for (faces, most) in [(1000, 0.004), (300, 0.015)] {
        let outcome = contract(&sheet, &Options::default(), Budget::faces(faces));
        assert_eq!(outcome.mesh.faces.len(), faces);
        let found = deviation(&sheet, &outcome.mesh, 20_000);
        assert!(found.rms <= most, "{faces} faces: {} where {most} was asked for", found.rms);
        // What is eaten from the rim is in the estimate.
        assert!(
            outcome.error_estimate >= 0.1 * found.forward_max,
            "{} of {}",
            outcome.error_estimate,
            found.forward_max
        );
    }
}

/// Flat rings so thick, one beside the other, with holes of radius 1 and of `steps` steps.
fn washers(count: u32, steps: u32, thickness: f64) -> Mesh {
    let mut all = Mesh::default();
    for ring in 0..count {
        let mut washer = shapes::torus(steps, 4);
        for (v, p) in washer.positions.iter_mut().enumerate() {
            let (radius, up) = [(3.0, 0.0), (3.0, thickness), (1.0, thickness), (1.0, 0.0)][v % 4];
            let out = DVec3::new(p.x, p.y, 0.0).normalize() * radius;
            *p = DVec3::new(out.x + 7.0 * f64::from(ring), out.y, up);
        }
        let first = all.positions.len() as u32;
        all.positions.extend(washer.positions);
        all.faces.extend(washer.faces.iter().map(|face| face.map(|v| v + first)));
    }
    all
}

#[test]
fn what_rims_of_thin_plates_lose_is_in_the_estimate() {
    let mut shares = Vec::new();
    for thickness in [2e-3, 1e-2, 2e-2, 5e-2] {
        let washers = washers(3, 48, thickness);
        for limit in [0.03, 0.05, 0.07, 0.1, 0.15] {
            let outcome = contract(&washers, &Options::default(), Budget::error_abs(limit));
            let found = deviation(&washers, &outcome.mesh, 20_000);
            let most = found.forward_max.max(found.backward_max) * washers.diagonal();
            let share = outcome.error_estimate / most;
            let is_sure = [(2e-3, 0.1), (2e-3, 0.03), (2e-2, 0.1)].contains(&(thickness, limit));
            let least = if is_sure { 0.25 } else { 0.15 };
            assert!(share > least && most > 0.1 * limit, "{thickness}, {limit}: {share}, {most}");
            shares.push(share);
        }
    }
    // It was a seventh to a hundredth, and holes were closed to triangles.
    let mean = (shares.iter().map(|share| share.ln()).sum::<f64>() / shares.len() as f64).exp();
    assert!(mean > 0.35, "{mean} of {shares:?}");
}

#[test]
fn walls_with_two_sides_stay() {
    for (count, n, faces) in [(5, 16, 600), (3, 16, 432), (3, 16, 350)] {
        let rooms = rooms(count, n);
        let outcome = contract(&rooms, &Options::default(), Budget::faces(faces));
        let share = outcome.mesh.area() / rooms.area();
        assert!(outcome.mesh.faces.len() <= faces && (0.999..1.001).contains(&share), "{count}: {share} of the area");
    }
}

#[test]
fn needles_are_no_reason_to_stay() {
    for length in [1.0, 400.0, 2e3] {
        let mut tube = shapes::tube(96);
        tube.positions.iter_mut().for_each(|p| p.z *= length);
        let outcome = contract(&tube, &Options::default(), Budget::keep(0.25));
        assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, 48), "{length}");
        let found = deviation(&tube, &outcome.mesh, 20_000);
        assert!(found.forward_max < 0.03, "{length}: {}", found.forward_max);
    }
}

/// A ball with eight spikes around it.
fn spiked() -> Mesh {
    let mut mesh = sphere(5);
    for p in &mut mesh.positions {
        let around = (4.0 * p.y.atan2(p.x)).cos().abs() * p.x.hypot(p.y);
        *p *= 0.3 + around.powi(16);
    }
    mesh
}

/// Planes of the faces of a spike meet far out of it.
#[test]
fn spikes_end_where_they_did() {
    let spiked = spiked();
    for (faces, most) in [(300, 0.012), (150, 0.036)] {
        let outcome = contract(&spiked, &Options::default(), Budget::faces(faces));
        let found = deviation(&spiked, &outcome.mesh, 20_000);
        // It was 0.0163 and 0.0392.
        assert!(found.backward_max <= most, "{faces} faces: {}", found.backward_max);
    }
}

/// Rooms, desks and walls of twelve faces each, at fewer than five a box.
#[test]
fn what_is_drawn_back_does_not_keep_the_last_boxes() {
    let office = sample("office", Some(6000)).expect("a sample");
    let outcome = contract(&office, &Options::default(), Budget::faces(240));
    let found = deviation(&office, &outcome.mesh, 20_000);
    // It was 0.058 where faces that would fold kept boxes, and a room went instead.
    assert!(found.rms < 0.01, "{}", found.rms);
}

/// Of a perforated plate no pair is left at the end whose faces hold with its vertex at the best place.
#[test]
fn where_faces_fold_a_vertex_goes_to_an_end() {
    let plate = shapes::voxels([25, 25, 1], |[x, y, _]| x % 3 != 1 || y % 3 != 1);
    let outcome = contract(&plate, &Options::default(), Budget::faces(100));
    let found = deviation(&plate, &outcome.mesh, 20_000);
    // It was stuck at 714, and RMS 0.0044.
    assert!(outcome.mesh.faces.len() <= 690, "{} faces", outcome.mesh.faces.len());
    assert!(found.rms < 0.008, "{}", found.rms);
}

/// A profile turned around an axis: rings of so many vertices, between which faces are as long as the profile's edges.
fn turned(profile: &[[f64; 2]], around: u32, is_closed: bool) -> Mesh {
    let rows = profile.len() as u32;
    let at = |i: u32, j: u32| i % around * rows + j % rows;
    let point = |(i, [out, z]): (u32, [f64; 2])| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(around)).sin_cos();
        DVec3::new(out * cos, out * sin, z)
    };
    let positions = (0..around).flat_map(|i| profile.iter().map(move |&at| (i, at))).map(point).collect();
    let strips = if is_closed { rows } else { rows - 1 };
    let quads = (0..around).flat_map(|i| (0..strips).map(move |j| (i, j)));
    let faces = quads.flat_map(|(i, j)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    Mesh::new(positions, faces.collect())
}

/// What turned parts are exported as: strips of faces many times as long as wide.
#[test]
fn strips_are_no_reason_to_stay() {
    let pipe = turned(&[[1.0, 0.0], [1.0, 10.0]], 1000, false);
    let bolt =
        turned(&[[0.5, 0.0], [20.0, 0.0], [20.0, 5.0], [12.0, 5.0], [12.0, 30.0], [6.0, 80.0], [0.5, 80.0]], 500, true);
    for mesh in [pipe, bolt] {
        for (keep, most) in [(0.1, 1e-4), (0.05, 4e-4)] {
            let outcome = contract(&mesh, &Options::default(), Budget::keep(keep));
            let faces = (mesh.faces.len() as f64 * keep) as usize;
            assert_eq!((outcome.stop, outcome.mesh.faces.len()), (StopReason::FacesReached, faces));
            let found = deviation(&mesh, &outcome.mesh, 20_000);
            assert!(found.rms <= most, "{faces} faces: {}", found.rms);
        }
    }
}

/// `count`² blades of two by eight triangles, which bend and come to a point, each turned another way.
fn blades(count: u32) -> Mesh {
    let mut all = Mesh::default();
    for blade in 0..count * count {
        let at = DVec3::new(f64::from(blade % count), f64::from(blade / count), 0.0);
        let (sin, cos) = (f64::from(blade) * 2.4).sin_cos();
        let first = all.positions.len() as u32;
        for step in 0..8 {
            let up = f64::from(step) / 8.0;
            let out = DVec3::new(cos, sin, 0.0) * (0.3 * up * up);
            let half = DVec3::new(-sin, cos, 0.0) * (0.05 * (1.0 - up));
            all.positions.extend([at + out + DVec3::Z * up - half, at + out + DVec3::Z * up + half]);
        }
        all.positions.push(at + DVec3::new(cos, sin, 0.0) * 0.3 + DVec3::Z);
        for [a, b, c, d] in (0..7).map(|step| [0, 1, 2, 3].map(|v| first + 2 * step + v)) {
            all.faces.extend([[a, b, c], [c, b, d]]);
        }
        all.faces.push([first + 14, first + 15, first + 16]);
    }
    all
}

#[test]
fn tips_of_blades_stay() {
    let blades = blades(20);
    let outcome = contract(&blades, &Options::default(), Budget::faces(600));
    assert_eq!(outcome.mesh.faces.len(), 600);
    let found = deviation(&blades, &outcome.mesh, 20_000);
    // 0.001; with the vertex where planes have it 0.0028.
    assert!(found.rms <= 0.0015, "{}", found.rms);
}

/// Of a washer a third of the pairs are cheap: no other is contracted for want of those.
#[test]
fn nothing_dear_goes_where_few_pairs_are_cheap() {
    let washer = turned(&[[9.5, 0.0], [10.0, 0.0], [10.0, 0.2], [9.5, 0.2]], 5000, true);
    let outcome = contract(&washer, &Options::default(), Budget::keep(0.1));
    let found = deviation(&washer, &outcome.mesh, 20_000);
    assert!(found.backward_max < 1e-4, "{}", found.backward_max);
}

/// A sheet with one rounded bend of `arc` steps, so thick: two flanges of 20, extruded by 100.
fn bent(arc: u32, thickness: f64) -> Mesh {
    let line = |inward: f64| {
        let radius = 3.0 - inward;
        let bend = (0..=arc).map(move |k| {
            let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(arc)).sin_cos();
            DVec3::new(20.0 + radius * sin, 3.0 - radius * cos, 0.0)
        });
        let first = DVec3::new(0.0, inward, 0.0);
        std::iter::once(first).chain(bend).chain([DVec3::new(23.0 - inward, 23.0, 0.0)])
    };
    let outline: Vec<DVec3> = line(0.0).chain(line(thickness).collect::<Vec<_>>().into_iter().rev()).collect();
    let (count, half) = (outline.len() as u32, arc + 3);
    let positions = outline.iter().copied().chain(outline.iter().map(|&p| p + DVec3::Z * 100.0)).collect();
    let mut faces = Vec::new();
    for (a, b) in (0..count).map(|k| (k, (k + 1) % count)) {
        faces.extend([[a, b, b + count], [a, b + count, a + count]]);
    }
    for k in 0..half - 1 {
        let [a, b, c, d] = [k, k + 1, count - 2 - k, count - 1 - k];
        faces.extend([[a, c, b], [a, d, c]]);
        faces.extend([[a, b, c], [a, c, d]].map(|face| face.map(|v| v + count)));
    }
    Mesh::new(positions, faces)
}

/// The cheapest pairs of a thin sheet, those across it, are refused: the few that are left in a round are no reason to tear a flange
/// off.
#[test]
fn flanges_stay_where_nearly_all_pairs_are_refused() {
    let sheet = bent(4, 0.02);
    let outcome = contract(&sheet, &Options::default(), Budget::faces(24));
    assert_eq!(outcome.mesh.faces.len(), 24);
    let found = deviation(&sheet, &outcome.mesh, 20_000);
    assert!(found.rms < 1e-3, "{}", found.rms);
}

/// Edges of one face, by the places of their ends.
fn borders(mesh: &Mesh) -> BTreeSet<[[u64; 3]; 2]> {
    let place = |v: u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
    let mut edges = std::collections::BTreeMap::new();
    for &[a, b, c] in &mesh.faces {
        for [u, w] in [[a, b], [b, c], [c, a]] {
            let mut ends = [place(u), place(w)];
            ends.sort_unstable();
            *edges.entry(ends).or_insert(0) += 1;
        }
    }
    edges.into_iter().filter(|&(_, count)| count == 1).map(|(ends, _)| ends).collect()
}

#[test]
fn locked_borders_stay_where_vertices_yield() {
    // A tube with fins, that stand on it where three faces meet.
    let (around, down) = (48, 60);
    let turn = |i: u32| std::f64::consts::TAU * f64::from(i % around) / f64::from(around);
    let at = |i: u32, j: u32| j * around + i % around;
    let point = |i: u32, j: u32, out: f64| {
        let (sin, cos) = turn(i).sin_cos();
        let z = 0.05 * f64::from(j);
        DVec3::new(out * cos, out * sin, 0.0) * (1.0 + 0.1 * (3.0 * z).sin()) + DVec3::Z * z
    };
    let mut mesh = Mesh::default();
    mesh.positions.extend((0..=down).flat_map(|j| (0..around).map(move |i| point(i, j, 1.0))));
    for (i, j) in (0..down).flat_map(|j| (0..around).map(move |i| (i, j))) {
        mesh.faces.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    }
    for i in (0..around).step_by(4) {
        let first = mesh.positions.len() as u32;
        let row = |out: u32, j: u32| if out == 0 { at(i, j) } else { first + (out - 1) * (down + 1) + j };
        let outs = 1..=6_u32;
        let points = outs.flat_map(|out| (0..=down).map(move |j| (out, j)));
        mesh.positions.extend(points.map(|(out, j)| point(i, j, 1.0 + 0.1 * f64::from(out))));
        for (out, j) in (0..6).flat_map(|out| (0..down).map(move |j| (out, j))) {
            let [a, b, c, d] = [row(out, j), row(out + 1, j), row(out + 1, j + 1), row(out, j + 1)];
            mesh.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let options = Options { lock_border: true, ..Options::default() };
    for faces in [1200, 1000, 800] {
        let outcome = contract(&mesh, &options, Budget::faces(faces));
        let is_told = outcome.warnings.iter().any(|warning| warning.contains("not manifold move"));
        assert!(is_told, "{:?}", outcome.warnings);
        let lost = borders(&mesh).difference(&borders(&outcome.mesh)).count();
        assert_eq!(lost, 0, "at {} faces", outcome.mesh.faces.len());
    }
}

/// Posts with three arms, each a wall with two sides, in rows of `count`, and one far from all others.
fn posts(count: u32) -> Mesh {
    let mut all = Mesh::default();
    let mut post = |x: f64, y: f64, size: f64| {
        let axis = all.positions.len() as u32;
        for arm in 0..4_u32 {
            let angle = f64::from(arm) * std::f64::consts::TAU / 3.0;
            // First the axis that the arms share, then their outer sides.
            let out = DVec3::new(angle.cos(), angle.sin(), 0.0) * if arm == 0 { 0.0 } else { size };
            all.positions.extend((0..4).map(|k| DVec3::new(x, y, size * f64::from(k) / 3.0) + out));
        }
        for (side, k) in (1..4).flat_map(|arm| (0..3).map(move |k| (4 * arm, k))) {
            let [a, b, c, d] = [k, side + k, side + k + 1, k + 1].map(|v| axis + v);
            all.faces.extend([[a, b, c], [a, c, d], [a, c, b], [a, d, c]]);
        }
    };
    for i in 0..count * count {
        post(f64::from(4 * (i / count)), f64::from(4 * (i % count)), 1.0 + 0.05 * f64::from(i % 5));
    }
    post(-300.0, 20.0, 1.1);
    all
}

#[test]
fn what_is_a_part_by_itself_does_not_vanish_where_the_topology_may_change() {
    let posts = posts(12);
    let faces = posts.faces.len() / 10;
    let outcome = contract(&posts, &Options::default(), Budget::faces(faces));
    let found = deviation(&posts, &outcome.mesh, 20_000);
    // It was 0.0034, as whole arms went for nothing.
    assert!(
        outcome.mesh.faces.len() <= faces && found.rms < 0.002,
        "{} faces, {}",
        outcome.mesh.faces.len(),
        found.rms
    );
}
