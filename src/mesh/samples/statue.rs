//! A marble bust as a scanner would deliver it: large smooth forms, curls and folds, weathering, fine noise.

use rayon::prelude::*;

use super::super::{Mesh, Rings};
use super::march::Lattice;
use super::noise::{fractal, noise, smoothstep, wave};
use crate::math::{DVec3, Vec3};

/// A bust of about `faces` faces, 3 high, looking along -y with its head turned, with vertex colors. One closed part of genus 0.
pub fn statue(faces: usize) -> Mesh {
    let lattice = |cell| Lattice { low: DVec3::new(-1.28, -1.28, -2.28), side: 3.2, cell };
    // A closed surface of area A has about 9.3 faces a cell² of it; the bust has A = 8. Measured counts then correct the cell.
    let trial = faces.min(40_000);
    let mut cell = (75.0 / trial as f64).sqrt();
    let mut mesh = lattice(cell).surface(&bust);
    if trial < faces {
        cell *= (mesh.faces.len() as f64 / faces as f64).sqrt();
        mesh = lattice(cell).surface(&bust);
    }
    for _ in 0..12 {
        let ratio = mesh.faces.len() as f64 / faces as f64;
        if (ratio - 1.0).abs() < 0.015 {
            break;
        }
        cell *= ratio.sqrt();
        mesh = lattice(cell).surface(&bust);
    }
    carve(relax(mesh), cell)
}

/// Moves every vertex to the middle of its neighbors, which evens out the slivers that marching leaves.
fn relax(mesh: Mesh) -> Mesh {
    let rings = Rings::new(&mesh.faces, mesh.positions.len());
    let middle = |v: usize| {
        let ring = rings.ring(v as u32);
        let corners = ring.iter().flat_map(|&f| mesh.faces[f as usize]).map(|corner| mesh.positions[corner as usize]);
        let sum: DVec3 = corners.sum();
        let count = ring.len() as f64;
        (sum - mesh.positions[v] * count) / (2.0 * count)
    };
    let positions = (0..mesh.positions.len()).into_par_iter().map(middle).collect();
    Mesh { positions, ..mesh }
}

/// Puts the vertices back on the smooth form, then displaces and colors them.
fn carve(mesh: Mesh, cell: f64) -> Mesh {
    let (positions, colors) = mesh
        .positions
        .par_iter()
        .map(|&p| {
            let step = cell * 0.05;
            let here = bust(p);
            let slope = DVec3::new(
                bust(p + DVec3::X * step) - here,
                bust(p + DVec3::Y * step) - here,
                bust(p + DVec3::Z * step) - here,
            ) / step;
            let normal = slope / slope.length().max(0.3);
            let back = (-here / slope.length().max(0.3)).clamp(-0.5 * cell, 0.5 * cell);
            let p = p + normal * back;
            let (relief, depth) = relief(p);
            (p + normal * relief, color(p, depth))
        })
        .unzip();
    Mesh { positions, colors: Some(colors), ..mesh }
}

/// The distance to the smooth form, nearly: negative inside.
fn bust(p: DVec3) -> f64 {
    blend(head(turned(p)), torso(p), 0.10)
}

/// Into the coordinates of the head, which is turned above the collar bones.
fn turned(p: DVec3) -> DVec3 {
    // A rotation by up to 20° with the tangent of the half angle as its parameter: cosine and sine without series.
    let tangent = -0.17 * smoothstep(-1.05, -0.45, p.z);
    let scale = 1.0 / (1.0 + tangent * tangent);
    let (cos, sin) = ((1.0 - tangent * tangent) * scale, 2.0 * tangent * scale);
    DVec3::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos, p.z)
}

fn head(q: DVec3) -> f64 {
    // Left and right alike.
    let m = DVec3::new(q.x.abs(), q.y, q.z);
    let at = DVec3::new;
    let mut d = ellipsoid(m, at(0.0, 0.07, 0.17), at(0.42, 0.52, 0.45));
    d = blend(d, ellipsoid(m, at(0.0, -0.14, -0.14), at(0.325, 0.36, 0.47)), 0.12);
    // Jaw: from under the ear to the chin.
    d = blend(d, capsule(m, at(0.25, 0.02, -0.24), at(0.07, -0.33, -0.47), [0.09, 0.10]), 0.14);
    d = blend(d, ellipsoid(m, at(0.0, -0.40, -0.46), at(0.11, 0.10, 0.10)), 0.10);
    // Cheek bone.
    d = blend(d, capsule(m, at(0.17, -0.36, -0.09), at(0.29, -0.16, -0.04), [0.07, 0.06]), 0.12);
    // Eye sockets, then what lies in them.
    d = carve_out(d, ellipsoid(m, at(0.145, -0.52, 0.02), at(0.115, 0.12, 0.075)), 0.10);
    d = blend(d, ellipsoid(m, at(0.145, -0.39, 0.0), at(0.085, 0.07, 0.062)), 0.015);
    d = blend(d, capsule(m, at(0.06, -0.455, 0.005), at(0.225, -0.405, 0.0), [0.012, 0.012]), 0.02);
    // Brows.
    d = blend(d, capsule(m, at(0.05, -0.475, 0.095), at(0.19, -0.445, 0.125), [0.034, 0.034]), 0.07);
    d = blend(d, capsule(m, at(0.19, -0.445, 0.125), at(0.285, -0.34, 0.075), [0.034, 0.022]), 0.07);
    // Nose: ridge, tip, wings, nostrils.
    d = blend(d, capsule(m, at(0.0, -0.475, 0.10), at(0.0, -0.605, -0.125), [0.030, 0.045]), 0.05);
    d = blend(d, ellipsoid(m, at(0.0, -0.595, -0.14), at(0.05, 0.06, 0.045)), 0.04);
    d = blend(d, ellipsoid(m, at(0.05, -0.54, -0.155), at(0.035, 0.05, 0.035)), 0.03);
    d = carve_out(d, ellipsoid(m, at(0.028, -0.58, -0.19), at(0.016, 0.025, 0.025)), 0.02);
    // Lips, the line between them, and the hollow below.
    d = blend(d, ellipsoid(m, at(0.0, -0.475, -0.30), at(0.14, 0.06, 0.10)), 0.08);
    d = blend(d, capsule(m, at(0.025, -0.535, -0.268), at(0.105, -0.475, -0.292), [0.022, 0.010]), 0.03);
    d = blend(d, capsule(m, at(0.0, -0.525, -0.325), at(0.075, -0.485, -0.315), [0.026, 0.012]), 0.03);
    d = carve_out(d, capsule(m, at(0.0, -0.557, -0.294), at(0.125, -0.480, -0.300), [0.009, 0.007]), 0.02);
    d = carve_out(d, ellipsoid(m, at(0.0, -0.55, -0.385), at(0.10, 0.05, 0.03)), 0.06);
    // Ear: a shell with a hollow and a lobe.
    let shell = ellipsoid(m, at(0.405, 0.08, -0.02), at(0.045, 0.085, 0.135));
    let shell = carve_out(shell, ellipsoid(m, at(0.455, 0.06, 0.0), at(0.03, 0.045, 0.085)), 0.02);
    d = blend(d, shell, 0.03);
    d = blend(d, ellipsoid(m, at(0.385, 0.04, -0.15), at(0.03, 0.04, 0.045)), 0.03);
    // Neck with its two strands.
    d = blend(d, capsule(m, at(0.0, 0.10, -0.35), at(0.0, 0.14, -1.1), [0.23, 0.25]), 0.10);
    blend(d, capsule(m, at(0.27, 0.12, -0.32), at(0.06, -0.14, -0.98), [0.05, 0.05]), 0.09)
}

fn torso(p: DVec3) -> f64 {
    let m = DVec3::new(p.x.abs(), p.y, p.z);
    let at = DVec3::new;
    let mut d = ellipsoid(m, at(0.0, 0.14, -1.40), at(0.62, 0.40, 0.50));
    // Shoulders, chest, collar bones.
    d = blend(d, capsule(m, at(0.25, 0.16, -1.02), at(0.72, 0.15, -1.20), [0.17, 0.21]), 0.18);
    d = blend(d, ellipsoid(m, at(0.27, -0.12, -1.40), at(0.29, 0.17, 0.22)), 0.15);
    d = blend(d, capsule(m, at(0.06, -0.20, -1.05), at(0.55, -0.02, -1.02), [0.035, 0.04]), 0.08);
    // A mantle from one shoulder across.
    let mantle = capsule(p, at(0.62, -0.10, -1.06), at(-0.42, -0.26, -1.58), [0.15, 0.12]);
    d = blend(d, mantle, 0.07);
    // Cut to the shape of a bust: rounded below.
    let cut = ellipsoid(m, at(0.0, 0.12, -1.05), at(0.93, 0.62, 0.72));
    d = blend_max(d, cut, 0.05);
    // Socle: a waist between two mouldings, on a plinth.
    let round = at((p.x * p.x + (p.y - 0.12) * (p.y - 0.12)).sqrt(), p.z, 0.0);
    let slab = |radius: f64, z: f64, half: f64, edge: f64| {
        let out = DVec3::new(round.x - (radius - edge), (round.y - z).abs() - (half - edge), 0.0);
        out.max(DVec3::ZERO).length() + out.x.max(out.y).min(0.0) - edge
    };
    d = blend(d, slab(0.19, -1.80, 0.26, 0.05), 0.16);
    d = blend(d, slab(0.30, -1.93, 0.05, 0.05), 0.03);
    blend(d, slab(0.42, -2.08, 0.09, 0.02), 0.05)
}

/// How far the carving, the weather and the scanner move the surface outwards; and the depth of the carving, 0 to 1.
fn relief(p: DVec3) -> (f64, f64) {
    let q = turned(p);
    // Hair: behind a line from the forehead to the nape; the ears stay free.
    let ear = DVec3::new((q.x.abs() - 0.42) / 0.12, (q.y - 0.05) / 0.12, (q.z + 0.03) / 0.17).length();
    let behind = q.z + 0.85 * q.y + 0.015 + 0.03 * noise(q * 9.0);
    let hair = smoothstep(0.0, 0.07, behind) * smoothstep(0.9, 1.25, ear) * smoothstep(-0.62, -0.52, q.z);
    let mut out = 0.0;
    let mut depth = 0.0;
    if hair > 0.0 {
        let bend = DVec3::new(noise(q * 3.1), noise(q * 3.1 + DVec3::splat(9.2)), noise(q * 3.1 + DVec3::splat(-4.4)));
        let s = q + bend * 0.16;
        let lock = wave(s.y * 3.0 + s.z * 4.6 + 1.1 * noise(q * 4.0));
        let strand = wave(s.y * 11.0 + s.z * 15.0 - s.x * 6.0 + 0.8 * bend.x);
        out += hair * (0.022 + 0.034 * lock + 0.011 * strand);
        depth += hair * (1.0 - 0.6 * lock - 0.4 * strand);
    }
    // Folds of the mantle, running along it, on the body below the neck.
    let cloth = smoothstep(-1.02, -1.16, p.z) * smoothstep(-1.72, -1.62, p.z);
    if cloth > 0.0 {
        let across = p.x * 0.45 + p.z * 0.9;
        let hang = 0.12 * noise(p * 2.2) + 0.05 * noise(p * 5.0 + DVec3::splat(3.3));
        let fold = wave((across + hang) * 4.6);
        out += cloth * 0.036 * (fold - 0.4);
        depth += cloth * (1.0 - fold) * 0.7;
    }
    let weather = 0.0035 * fractal(p * 7.0, 4);
    let scan = 0.0006 * fractal(p * 90.0, 3);
    (out + weather + scan, depth)
}

/// Marble: warm white, gray veins, dust in the hollows.
fn color(p: DVec3, depth: f64) -> [f32; 4] {
    let vein = 1.0 - (fractal(p * 1.7, 4) * 2.6).abs();
    let vein = 0.28 * vein.max(0.0) * vein.max(0.0);
    let dust = 0.35 * depth.clamp(0.0, 1.0);
    let marble = Vec3::new(0.93, 0.90, 0.85) * (1.0 - vein as f32);
    let shade = marble.lerp(Vec3::new(0.52, 0.44, 0.36), dust as f32);
    [shade.x, shade.y, shade.z, 1.0]
}

/// The distance to an ellipsoid, exact on it and nearly so elsewhere (Quilez 2008).
fn ellipsoid(p: DVec3, center: DVec3, radii: DVec3) -> f64 {
    let scaled = (p - center) / radii;
    let length = scaled.length();
    let slope = (scaled / radii).length();
    if slope > 0.0 { length * (length - 1.0) / slope } else { -radii.min_element() }
}

/// The distance to the segment from `a` to `b`, less a radius that changes along it.
fn capsule(p: DVec3, a: DVec3, b: DVec3, [at_a, at_b]: [f64; 2]) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.dot(along)).clamp(0.0, 1.0);
    p.distance(a + along * t) - (at_a + (at_b - at_a) * t)
}

/// The union, rounded over a width of `k`.
fn blend(a: f64, b: f64, k: f64) -> f64 {
    let near = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - near * near * k * 0.25
}

fn blend_max(a: f64, b: f64, k: f64) -> f64 {
    -blend(-a, -b, k)
}

/// `a` without `b`, rounded.
fn carve_out(a: f64, b: f64, k: f64) -> f64 {
    blend_max(a, -b, k)
}
