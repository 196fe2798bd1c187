//! Attributes through files, welding and measuring: a mesh that was only rewritten has no deviation.

use coarsen::formats::{self, Format, WriteOptions};
use coarsen::math::{DVec3, Vec2};
use coarsen::mesh::{shapes, weld};
use coarsen::metrics::{Options, Spread, TextureDeviation, deviation, quality, texture_deviation};
use coarsen::{Budget, Device, Mesh, Method, simplify};

/// A torus with a chart for each half of its tube: a seam on all of it, whose vertices are shared.
fn two_charts() -> Mesh {
    let (around, across) = (24, 16);
    let mut mesh = shapes::torus(around, across);
    let row = |face: usize| {
        let (u, v) = ((face as u32 / 2) / across, (face as u32 / 2) % across);
        // The square's corners in the order of shapes: (0, 0), (1, 0), (1, 1), (0, 1).
        let at = |du: u32, dv: u32| {
            let beside = if v < across / 2 { 0.0 } else { 1.25 };
            Vec2::new((u + du) as f32 / around as f32 + beside, (v % (across / 2) + dv) as f32 / 8.0)
        };
        if face.is_multiple_of(2) { [at(0, 0), at(1, 0), at(1, 1)] } else { [at(0, 0), at(1, 1), at(0, 1)] }
    };
    mesh.texcoords = Some((0..mesh.faces.len()).map(row).collect());
    mesh
}

fn compare(a: &Mesh, b: &Mesh) -> TextureDeviation {
    texture_deviation(a, b, 200).expect("valid meshes").expect("texture coordinates")
}

#[test]
fn files_and_welding_keep_the_texture_in_place() {
    let mesh = two_charts();
    let same = TextureDeviation { covered: 1.0, ..TextureDeviation::default() };
    // A soup of the same faces.
    let corners = mesh.faces.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
    let soup =
        Mesh { faces: (0..mesh.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect(), ..mesh.clone() };
    let soup = Mesh { positions: corners, ..soup };
    assert_eq!(compare(&mesh, &weld(&soup, 0.0).mesh), same);
    for (format, ascii) in [(Format::Obj, true), (Format::Ply, true), (Format::Ply, false)] {
        let mut bytes = Vec::new();
        formats::write_to(&soup, format, &WriteOptions { ascii }, &mut bytes).expect("memory is writable");
        let read = weld(&formats::read_bytes(&bytes, format).expect("what was written"), 0.0).mesh;
        assert_eq!(read.texcoords, mesh.texcoords, "{format:?}");
        let found = compare(&mesh, &read);
        // Binary PLY rounds positions to f32.
        assert!(found.mapping_distance < 1e-6 && found.covered == 1.0, "{format:?}: {found:?}");
    }
}

#[test]
fn a_texture_pushed_along_the_seam_is_as_far_as_it_was_pushed() {
    let mesh = two_charts();
    let mut pushed = mesh.clone();
    // The upper chart is at rest, the lower one a step of 15° further. Both reach the outer rim, of radius 4.
    let rows = pushed.texcoords.iter_mut().flatten().flatten();
    rows.filter(|uv| uv.x >= 1.25).for_each(|uv| uv.x += 1.0 / 24.0);
    let found = compare(&mesh, &pushed);
    let chord = 2.0 * 4.0 * 7.5_f64.to_radians().sin();
    assert!((found.mapping_distance - chord).abs() < 1e-5, "{found:?}, expected {}", chord);
    assert!(found.covered > 47.0 / 48.0 - 0.01 && found.covered < 1.0, "{found:?}");
}

/// No map between two surfaces is shorter than their distance.
#[test]
fn a_mapping_is_no_shorter_than_the_surfaces_are_apart() {
    let mesh = two_charts();
    let device = Device::cpu(2).expect("the CPU");
    for (bend, twist) in [(0.1, 0.0), (0.0, 0.2), (0.3, 0.05)] {
        let mut bent = mesh.clone();
        bent.positions.iter_mut().for_each(|p| *p = DVec3::new(p.x - twist * p.y, p.y, p.z + bend * p.x));
        let mapped = compare(&mesh, &bent).mapping_distance;
        let apart = deviation(&mesh, &bent, &Options::default(), &device).expect("two meshes with faces");
        for side in [apart.forward, apart.backward] {
            assert!(0.0 < side.distance.max && side.distance.max <= mapped * (1.0 + 1e-9), "{mapped} maps {side:?}");
        }
    }
}

#[test]
fn measures_do_not_depend_on_place_and_grow_with_size() {
    let mesh = two_charts();
    let mut bent = mesh.clone();
    bent.positions.iter_mut().for_each(|p| p.z += 0.1 * p.x);
    let (found, shape) = (compare(&mesh, &bent), quality(&bent));
    assert!(found.deviation.mean > 0.1 && found.mapping_distance < 0.4 + 1e-9, "{found:?}");
    for (scale, offset) in [(1e-3, DVec3::ZERO), (1e3, DVec3::new(-5e5, 3e5, 7e5))] {
        let mapped = |mesh: &Mesh| {
            let positions = mesh.positions.iter().map(|&p| scale * DVec3::new(p.y, p.z, p.x) + offset).collect();
            Mesh { positions, ..mesh.clone() }
        };
        let (far, near) = (compare(&mapped(&mesh), &mapped(&bent)), quality(&mapped(&bent)));
        let Spread { max, mean, rms } = far.deviation;
        let pairs = [
            (max, found.deviation.max),
            (mean, found.deviation.mean),
            (rms, found.deviation.rms),
            (far.mapping_distance, found.mapping_distance),
        ];
        assert!(pairs.iter().all(|(far, near)| (far - scale * near).abs() < 1e-6 * scale), "{far:?}, {found:?}");
        assert_eq!((far.covered, near.ratio_histogram), (found.covered, shape.ratio_histogram));
        assert!((near.mean_ratio - shape.mean_ratio).abs() < 1e-6);
    }
}

#[test]
fn methods_without_seams_say_that_they_drop_the_texture() {
    let device = Device::cpu(1).expect("the CPU");
    let dropped = |mesh: &Mesh, method: Method| {
        let outcome = simplify(mesh, &method, &Budget::faces(200), &device, None).expect("a valid mesh");
        let is_told = outcome.warnings.iter().any(|warning| warning.contains("texture coordinates are dropped"));
        assert_eq!(outcome.mesh.texcoords.is_none(), is_told || mesh.texcoords.is_none());
        is_told
    };
    let removal = || Method::Removal(coarsen::removal::Options::default());
    assert!(dropped(&two_charts(), removal()));
    assert!(!dropped(&shapes::torus(24, 16), removal()));
    assert!(!dropped(&two_charts(), Method::default()));
}
