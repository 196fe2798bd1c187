//! Outlines to test with, and what triangles of theirs must be.

use std::f64::consts::TAU;

use super::outline::signed_area;
use super::sides::turn;
use super::{Outline, Triangulation, triangulate};
use crate::math::{DVec2, tie_hash};

pub const BOTH: [Triangulation; 2] = [Triangulation::Earcut, Triangulation::Ears];

/// An outline of these rings; points at one place are one mesh vertex.
pub fn outline(rings: &[Vec<[f64; 2]>]) -> Outline {
    let points: Vec<[f64; 2]> = rings.concat();
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].partial_cmp(&points[b]).expect("numbers").then(a.cmp(&b)));
    let mut vertices = vec![0; points.len()];
    for places in order.chunk_by(|&a, &b| points[a] == points[b]) {
        places.iter().for_each(|&i| vertices[i] = places[0] as u32);
    }
    let mut ring_starts = vec![0];
    rings.iter().for_each(|ring| ring_starts.push(ring_starts[ring_starts.len() - 1] + ring.len() as u32));
    Outline { points: points.into_iter().map(DVec2::from).collect(), vertices, ring_starts }
}

/// Turned about the origin.
pub fn turned(mut outline: Outline, angle: f64) -> Outline {
    outline.points.iter_mut().for_each(|p| *p = DVec2::from_angle(angle).rotate(*p));
    outline
}

/// Numbers in [0, 1) without order.
pub fn random(index: u32, seed: u32) -> f64 {
    f64::from(tie_hash(index, seed)) / (f64::from(u32::MAX) + 1.0)
}

/// A back with teeth of seeded lengths, corners all along the back.
pub fn comb(teeth: u32) -> Outline {
    let mut ring = Vec::new();
    for tooth in 0..teeth {
        let (x, length) = (2.0 * f64::from(tooth), 1.0 + 20.0 * random(tooth, 1));
        ring.extend([[x, 0.0], [x, length], [x + 1.0, length], [x + 1.0, 0.0]]);
    }
    ring.reverse();
    ring.splice(0..0, (0..teeth).map(|i| [2.0 * f64::from(i), -1.0]));
    outline(&[ring])
}

/// A band of so many points on each side that goes around so often.
pub fn spiral(count: u32, rounds: f64) -> Outline {
    let at = |i: u32, offset: f64| {
        let t = f64::from(i) / f64::from(count - 1) * rounds;
        (DVec2::from_angle(t * TAU) * (1.0 + t + offset)).to_array()
    };
    let outer = (0..count).map(|i| at(i, 0.4));
    let inner = (0..count).rev().map(|i| at(i, 0.0));
    outline(&[outer.chain(inner).collect()])
}

/// A circle of radii in seeded bounds, counter-clockwise.
pub fn star(center: [f64; 2], count: u32, radius: f64, roughness: f64, seed: u32) -> Vec<[f64; 2]> {
    let at = |i: u32| {
        let angle = f64::from(i) / f64::from(count) * TAU;
        (DVec2::from(center) + DVec2::from_angle(angle) * radius * (1.0 - roughness * random(i, seed))).to_array()
    };
    (0..count).map(at).collect()
}

/// A square plate with a grid of star-shaped holes, and corners all along its sides.
pub fn plate(holes_a_side: u32, corners: u32, roughness: f64, seed: u32) -> Outline {
    let n = holes_a_side;
    let side = |from: [f64; 2], step: [f64; 2]| {
        (0..n).map(move |i| [from[0] + step[0] * f64::from(i), from[1] + step[1] * f64::from(i)])
    };
    let end = f64::from(n);
    let frame = side([0., 0.], [1., 0.])
        .chain(side([end, 0.], [0., 1.]))
        .chain(side([end, end], [-1., 0.]))
        .chain(side([0., end], [0., -1.]));
    let mut rings: Vec<Vec<[f64; 2]>> = vec![frame.collect()];
    for hole in 0..n * n {
        let jitter = |k: u32| 0.1 * (random(hole, seed + k) - 0.5);
        let center = [f64::from(hole % n) + 0.5 + jitter(1), f64::from(hole / n) + 0.5 + jitter(2)];
        let mut ring = star(center, corners, 0.42, roughness, seed + 3 + hole);
        ring.reverse();
        rings.push(ring);
    }
    outline(&rings)
}

/// Triangulates and looks at the result without the help of `is_whole`.
pub fn checked(outline: &Outline, by: Triangulation) -> Vec<[u32; 3]> {
    assert_eq!(outline.fault(), None);
    let triangles = triangulate(outline, by).expect("an outline without fault");
    check(outline, &triangles);
    triangles
}

pub fn check(outline: &Outline, triangles: &[[u32; 3]]) {
    let vertex = |i: u32| outline.vertices[i as usize];
    let mut edges: Vec<[u32; 2]> =
        triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|edge| edge.map(vertex)).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|pair| pair[0] != pair[1]), "an edge occurs twice");
    assert!(edges.iter().all(|[a, b]| a != b), "an edge without length");
    let ring_edges = (0..).zip(outline.successors()).map(|(a, b)| [a, b].map(vertex));
    let mut borders: Vec<[u32; 2]> = ring_edges.collect();
    borders.sort_unstable();
    let alone: Vec<[u32; 2]> = edges.iter().copied().filter(|&[a, b]| edges.binary_search(&[b, a]).is_err()).collect();
    assert_eq!(alone, borders, "edges with one triangle are those of the outline");
    let points = outline.scaled();
    let areas = triangles.iter().map(|t| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        assert!(turn(a, b, c) > 0.0, "{t:?} has no area");
        (b - a).perp_dot(c - a) / 2.0
    });
    let whole: f64 = outline.rings().map(|ring| signed_area(&points[ring])).sum();
    assert!((areas.sum::<f64>() - whole).abs() <= 1e-9 * whole);
}

pub fn plain_count(outline: &Outline) -> usize {
    outline.points.len() + 2 * (outline.rings().len() - 1) - 2
}
