//! A marble bust as a scanner would deliver it: large smooth forms, curls and folds, weathering, fine noise.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::super::{Mesh, Rings};
use super::march::{BLOCK, Lattice};
use super::noise::{fractal, noise, random, smoothstep, wave};
use crate::error::Result;
use crate::math::{DVec3, Vec3};

/// A bust of about `faces` faces, 3 high, looking along -y with its head turned, with vertex colors. One closed part of genus 0.
pub fn statue(faces: usize) -> Mesh {
    let off = |mesh: &Mesh| mesh.faces.len() as f64 / faces as f64;
    let mut cell = cell(faces);
    let mut mesh = lattice(cell).surface(&bust);
    // The counts of coarse lattices jump: shift the lattice until one fits.
    for shift in 1..100 {
        if (off(&mesh) - 1.0).abs() < 0.018 {
            break;
        }
        cell *= off(&mesh).sqrt();
        let lattice = lattice(cell);
        mesh = Lattice { low: lattice.low - 0.5 * cell * random(shift), ..lattice }.surface(&bust);
    }
    carve(relax(mesh), cell)
}

fn lattice(cell: f64) -> Lattice {
    Lattice { low: DVec3::new(-1.28, -1.28, -2.28), side: 3.4, cell }
}

/// The side of a cell for so many faces.
fn cell(faces: usize) -> f64 {
    // A cell² of a surface has about 9.3 faces, and the bust's area is 8. A trial then corrects the cell; it sees a little less
    // area than a finer mesh does, hence the last factor.
    let trial = faces.min(TRIAL_FACES);
    let cell = (75.0 / trial as f64).sqrt();
    let off = lattice(cell).surface(&bust).faces.len() as f64 / faces as f64;
    cell * off.sqrt() * if trial < faces { 1.006 } else { 1.0 }
}

/// Cells of a slab along the height, and those around it that its vertices are carved with.
const SLAB: u32 = 128;
const AROUND: u32 = 16;

/// The faces from which [`statue_in_slabs`] makes the statue: the lattice of fewer may have to be shifted.
pub const LEAST_FACES_IN_SLABS: usize = 1_000_000;

/// The statue of [`statue`], the same vertices and faces in another order, in slabs from the foot up: each with its own vertices,
/// and faces that name them by their number in the whole.
pub fn statue_in_slabs(faces: usize, slab: &mut dyn FnMut(&Mesh) -> Result<()>) -> Result<()> {
    let cell = cell(faces);
    let lattice = lattice(cell);
    let blocks = lattice.blocks(&bust);
    let top = blocks.iter().map(|block| block[2] + BLOCK).max().unwrap_or(0);
    let mut seam = FxHashMap::default();
    let mut count = 0;
    for start in (0..top).step_by(SLAB as usize) {
        let end = start + SLAB;
        let near = |block: &[u32; 3]| block[2] + BLOCK + AROUND > start && block[2] < end + AROUND;
        let near: Vec<[u32; 3]> = blocks.iter().copied().filter(near).collect();
        let (low, high) = (lattice.height(start), lattice.height(end));
        let marched = lattice.surface_in(&near, &bust);
        // Vertices between two slabs belong to the lower.
        let mut number = vec![u32::MAX; marched.positions.len()];
        let (mut own, mut next_seam) = (Vec::new(), FxHashMap::default());
        for (v, position) in marched.positions.iter().enumerate() {
            let key = position.to_array().map(f64::to_bits);
            if let Some(&known) = seam.get(&key) {
                number[v] = known;
            } else if position.z >= low && position.z <= high {
                number[v] = count + own.len() as u32;
                own.push(v);
            }
            if position.z == high {
                next_seam.insert(key, number[v]);
            }
        }
        (seam, count) = (next_seam, count + own.len() as u32);
        let is_own = |face: &[u32; 3]| face.iter().all(|&v| number[v as usize] != u32::MAX);
        let faces =
            marched.faces.iter().filter(|face| is_own(face)).map(|face| face.map(|v| number[v as usize])).collect();
        let carved = carve(relax(marched), cell);
        let row = |rows: &Vec<[f32; 4]>| own.iter().map(|&v| rows[v]).collect();
        slab(&Mesh {
            colors: carved.colors.as_ref().map(row),
            ..Mesh::new(own.iter().map(|&v| carved.positions[v]).collect(), faces)
        })?;
    }
    Ok(())
}

/// Enough for the count to tell the area to a percent, little enough to cost next to nothing.
const TRIAL_FACES: usize = 40_000;

/// Moves every vertex to the middle of its neighbors, which evens out the slivers that marching leaves.
fn relax(mesh: Mesh) -> Mesh {
    let rings = Rings::new(&mesh.faces, mesh.positions.len());
    let positions = (0..mesh.positions.len()).into_par_iter().map(|v| middle(&mesh, rings.ring(v as u32), v)).collect();
    Mesh { positions, ..mesh }
}

/// The mean of the neighbors of `vertex`.
fn middle(mesh: &Mesh, ring: &[u32], vertex: usize) -> DVec3 {
    let corners = ring.iter().flat_map(|&f| mesh.faces[f as usize]).map(|corner| mesh.positions[corner as usize]);
    let (sum, count) = (corners.sum::<DVec3>(), ring.len() as f64);
    (sum - mesh.positions[vertex] * count) / (2.0 * count)
}

/// Puts the vertices back on the smooth form, then displaces and colors them.
fn carve(mesh: Mesh, cell: f64) -> Mesh {
    let rings = Rings::new(&mesh.faces, mesh.positions.len());
    let carve_vertex = |v: usize| {
        let ring = rings.ring(v as u32);
        let normal = ring.iter().map(|&f| mesh.cross(mesh.faces[f as usize])).sum::<DVec3>().normalize_or_zero();
        // Coarse meshes cannot follow what is finer than they are: bounded moves keep their faces from folding.
        let back = (-bust(mesh.positions[v])).clamp(-0.3 * cell, 0.3 * cell);
        let p = mesh.positions[v] + normal * back;
        let (relief, depth) = relief(p);
        (p + normal * relief * (0.06 / cell).min(1.0), color(p, depth))
    };
    let (positions, colors) = (0..mesh.positions.len()).into_par_iter().map(carve_vertex).unzip();
    let mut carved = Mesh { positions, colors: Some(colors), ..mesh };
    unfold(&mut carved, &rings);
    carved
}

/// Smooths the few places where the carving has turned faces sharply against each other.
fn unfold(mesh: &mut Mesh, rings: &Rings) {
    let mut suspects: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for _ in 0..30 {
        let sharp: Vec<u32> = suspects.into_par_iter().filter(|&v| is_sharp(mesh, rings.ring(v))).collect();
        if sharp.is_empty() {
            return;
        }
        // Their neighbors move along, or they would hold a deep fold open.
        let around = widened(mesh, rings, &sharp);
        let moved: Vec<DVec3> = around.iter().map(|&v| middle(mesh, rings.ring(v), v as usize)).collect();
        for (&v, p) in around.iter().zip(moved) {
            mesh.positions[v as usize] = p;
        }
        suspects = widened(mesh, rings, &around);
    }
}

/// The vertices and their neighbors, ascending.
fn widened(mesh: &Mesh, rings: &Rings, vertices: &[u32]) -> Vec<u32> {
    let mut wide: Vec<u32> =
        vertices.iter().flat_map(|&v| rings.ring(v)).flat_map(|&f| mesh.faces[f as usize]).collect();
    wide.sort_unstable();
    wide.dedup();
    wide
}

/// Whether two faces of a ring are turned more than 140° against each other, or one has no area.
fn is_sharp(mesh: &Mesh, ring: &[u32]) -> bool {
    let normal = |&f: &u32| mesh.cross(mesh.faces[f as usize]).normalize_or_zero();
    ring.iter().enumerate().any(|(i, f)| {
        let one = normal(f);
        one == DVec3::ZERO || ring[..i].iter().any(|other| one.dot(normal(other)) < -0.77)
    })
}

/// The distance to the smooth form, nearly: negative inside.
fn bust(p: DVec3) -> f64 {
    let head = head(turned(p));
    // What is farther than the blend reaches changes nothing.
    let torso_at = DVec3::new(0.0, 0.1, -1.5);
    if p.distance(torso_at) - 1.15 > head + 0.1 { head } else { blend(head, torso(p), 0.10) }
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
    // Jaw from under the ear to the chin, neck and its two strands.
    let mut d = ellipsoid(m, at(0.0, 0.07, 0.17), at(0.42, 0.52, 0.45));
    d = blend(d, ellipsoid(m, at(0.0, -0.14, -0.14), at(0.325, 0.36, 0.47)), 0.12);
    d = blend(d, capsule(m, at(0.25, 0.02, -0.24), at(0.07, -0.33, -0.47), [0.09, 0.10]), 0.14);
    d = blend(d, capsule(m, at(0.0, 0.10, -0.35), at(0.0, 0.14, -1.1), [0.23, 0.25]), 0.10);
    d = blend(d, capsule(m, at(0.27, 0.12, -0.32), at(0.06, -0.14, -0.98), [0.05, 0.05]), 0.09);
    // The finer parts matter only near them: their blends are at most 0.12 wide.
    let beyond = |d: f64, center: DVec3, radius: f64| m.distance(center) - radius > d.abs() + 0.12;
    if !beyond(d, at(0.12, -0.42, -0.16), 0.46) {
        d = face(m, d);
    }
    if !beyond(d, at(0.41, 0.06, -0.04), 0.19) {
        // Ear: a shell with a hollow and a lobe.
        let shell = ellipsoid(m, at(0.405, 0.08, -0.02), at(0.05, 0.085, 0.135));
        let shell = carve_out(shell, ellipsoid(m, at(0.465, 0.06, 0.0), at(0.03, 0.045, 0.085)), 0.03);
        d = blend(d, shell, 0.04);
        d = blend(d, ellipsoid(m, at(0.385, 0.04, -0.15), at(0.03, 0.04, 0.045)), 0.04);
    }
    d
}

fn face(m: DVec3, d: f64) -> f64 {
    let at = DVec3::new;
    // Chin, cheek bone.
    let mut d = blend(d, ellipsoid(m, at(0.0, -0.40, -0.46), at(0.11, 0.10, 0.10)), 0.10);
    d = blend(d, capsule(m, at(0.17, -0.36, -0.09), at(0.29, -0.16, -0.04), [0.07, 0.06]), 0.12);
    // Eye sockets, then what lies in them.
    d = carve_out(d, ellipsoid(m, at(0.145, -0.52, 0.015), at(0.10, 0.11, 0.07)), 0.10);
    d = blend(d, ellipsoid(m, at(0.145, -0.375, 0.0), at(0.085, 0.075, 0.062)), 0.05);
    // Brows.
    d = blend(d, capsule(m, at(0.05, -0.455, 0.085), at(0.17, -0.430, 0.105), [0.026, 0.028]), 0.09);
    d = blend(d, capsule(m, at(0.17, -0.430, 0.105), at(0.27, -0.34, 0.07), [0.028, 0.020]), 0.09);
    // Nose: ridge, tip, wings.
    d = blend(d, capsule(m, at(0.0, -0.465, 0.10), at(0.0, -0.595, -0.125), [0.032, 0.045]), 0.07);
    d = blend(d, ellipsoid(m, at(0.0, -0.585, -0.14), at(0.05, 0.06, 0.045)), 0.05);
    d = blend(d, ellipsoid(m, at(0.05, -0.53, -0.155), at(0.035, 0.05, 0.035)), 0.05);
    // Lips on their mound, and the hollow below.
    d = blend(d, ellipsoid(m, at(0.0, -0.475, -0.30), at(0.14, 0.06, 0.10)), 0.08);
    d = blend(d, capsule(m, at(0.025, -0.53, -0.268), at(0.10, -0.475, -0.290), [0.022, 0.012]), 0.04);
    d = blend(d, capsule(m, at(0.0, -0.52, -0.325), at(0.075, -0.485, -0.313), [0.026, 0.014]), 0.04);
    carve_out(d, ellipsoid(m, at(0.0, -0.55, -0.385), at(0.10, 0.05, 0.03)), 0.06)
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
    let mantle = capsule(p, at(0.56, -0.02, -1.02), at(-0.40, -0.22, -1.55), [0.15, 0.12]);
    d = blend(d, mantle, 0.12);
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
    // Lids around the blank eyes, the line of the mouth, nostrils.
    let m = DVec3::new(q.x.abs(), q.y, q.z);
    if m.y < -0.36 && m.distance(DVec3::new(0.1, -0.46, -0.14)) < 0.36 {
        let eye = DVec3::new((m.x - 0.142) / 0.082, (m.z + 0.004) / 0.042, 0.0).length();
        let lid = smoothstep(0.35, 0.0, (eye - 1.0).abs());
        let mouth = DVec3::new((m.x / 0.125).powi(4), (m.z + 0.294 - 0.25 * m.x * m.x) / 0.010, 0.0).length();
        let mouth = smoothstep(1.3, 0.2, mouth);
        let nostril = DVec3::new((m.x - 0.030) / 0.017, (m.y + 0.56) / 0.03, (m.z + 0.185) / 0.022).length();
        let nostril = smoothstep(1.4, 0.4, nostril);
        out += 0.010 * lid - 0.011 * mouth - 0.016 * nostril;
        depth += mouth + nostril;
    }
    // A tunic: folds sag from both shoulders, below a round neckline with a hem.
    let neckline = DVec3::new(p.x, p.y + 0.10, (p.z + 0.86) * 0.9).length() + 0.012 * noise(p * 6.0);
    let cloth = smoothstep(0.44, 0.48, neckline) * smoothstep(-0.86, -0.98, p.z) * smoothstep(-1.74, -1.62, p.z);
    if cloth > 0.0 {
        let sag = DVec3::new(p.x.abs() - 0.72, 0.35 * p.y, p.z + 0.80).length();
        let hang = 0.16 * noise(p * 1.9) + 0.05 * noise(p * 4.3 + DVec3::splat(3.3));
        let fold = wave((sag + hang) * 6.5);
        let hem = smoothstep(0.05, 0.02, (neckline - 0.50).abs());
        out += cloth * (0.012 + 0.034 * fold * (1.0 - hem) + 0.016 * hem);
        depth += cloth * (1.0 - fold) * (1.0 - hem) * 0.7;
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
