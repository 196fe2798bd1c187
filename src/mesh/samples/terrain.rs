//! A mountain range: a height field on a grid with ridges, valleys and one border.

use rayon::prelude::*;

use super::super::Mesh;
use super::super::shapes::halves;
use super::noise::{fractal, noise, smoothstep};
use crate::math::DVec3;

/// The grid of about `faces` faces, 10 by 10 in size. V (n + 1)(m + 1), F 2nm, χ 1.
pub fn terrain(faces: usize) -> Mesh {
    let squares = (faces as f64 / 2.0).max(1.0);
    let nx = squares.sqrt().round().max(1.0) as u32;
    let ny = (squares / f64::from(nx)).round().max(1.0) as u32;
    let positions = (0..(nx + 1) * (ny + 1))
        .into_par_iter()
        .map(|i| {
            let (x, y) = (f64::from(i % (nx + 1)) / f64::from(nx), f64::from(i / (nx + 1)) / f64::from(ny));
            DVec3::new(x * 10.0, y * 10.0, height(x * 10.0, y * 10.0))
        })
        .collect();
    let faces = (0..nx * ny)
        .into_par_iter()
        .flat_map_iter(|i| {
            let (x, y) = (i % nx, i / nx);
            let at = |dx: u32, dy: u32| (y + dy) * (nx + 1) + x + dx;
            let square = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
            // Diagonals alternate, so that the grid prefers no direction.
            halves(if (x + y) % 2 == 0 { square } else { [square[1], square[2], square[3], square[0]] })
        })
        .collect();
    Mesh::new(positions, faces)
}

/// Sharp ridges where noise changes its sign, bent by slower noise, rougher the higher they rise.
fn height(x: f64, y: f64) -> f64 {
    let p = DVec3::new(x, y, 0.0);
    let bend = DVec3::new(noise(p * 0.35), noise(p * 0.35 + DVec3::splat(31.7)), 0.0);
    let mut at = (p + bend * 1.2) * 0.32;
    let mut sum = 0.0;
    let (mut scale, mut weight) = (1.0, 1.0);
    for _ in 0..9 {
        let ridge = 1.0 - noise(at).abs();
        let ridge = ridge * ridge * weight;
        sum += ridge * scale;
        weight = (ridge * 1.6).clamp(0.0, 1.0);
        scale *= 0.44;
        at = at * 2.07 + DVec3::new(11.3, 5.9, 3.1);
    }
    let mountains = 1.2 * (sum - 0.95);
    // A valley floor with low dunes where the mountains would go below it.
    let floor = 0.12 * fractal(p * 0.8, 6);
    let rise = smoothstep(-0.25, 0.35, mountains - floor);
    floor + (mountains - floor) * rise
}
