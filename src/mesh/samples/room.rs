//! Rooms lit by lamps, as stand-ins for the scenes of \[Liu99\]: light at every face that jumps at the edges of shadows.

use rayon::prelude::*;

use super::super::Mesh;
use super::radiosity::Solution;
use super::scene::{Cuboid, grids, mesh, middles};
use crate::math::DVec3;

/// The side of a patch that exchanges light, in meters.
const PATCH: f64 = 0.4;
/// Between what stands on another and that, in meters: boxes do not touch.
const GAP: f64 = 0.004;

const WOOD: [f64; 3] = [0.55, 0.38, 0.22];
const STEEL: [f64; 3] = [0.42, 0.45, 0.48];
const PAPER: [f64; 3] = [0.72, 0.70, 0.66];

/// A closed room of 4 by 4 meters with a large lamp at the ceiling, whose shadows are soft, and a small one, whose are hard;
/// in it a tall box, a cube, a table and a shelf.
pub fn room(faces: usize) -> Mesh {
    let reflectance =
        [[0.62, 0.22, 0.16], [0.20, 0.36, 0.58], [0.70, 0.68, 0.62], [0.70, 0.68, 0.62], [0.55, 0.5, 0.45], [0.75; 3]];
    let room = Cuboid {
        reflectance: reflectance.map(DVec3::from),
        is_room: true,
        ..Cuboid::new([0.0; 3], [4.0, 4.0, 2.8], PAPER)
    };
    let mut boxes = vec![
        room,
        lamp([1.2, 1.6, 2.7], [2.2, 2.6, 2.77], 14.0),
        lamp([3.0, 0.7, 2.45], [3.08, 0.78, 2.53], 1800.0),
        standing([0.6, 2.5, 0.0], [1.4, 3.2, 1.6], PAPER),
        standing([2.4, 2.3, 0.0], [3.1, 3.0, 0.7], [0.68, 0.52, 0.16]),
        Cuboid::new([3.7, 1.6, 1.5], [3.98, 2.9, 1.54], WOOD),
    ];
    boxes.extend(table([1.7, 0.7], [3.0, 1.5], 0.74));
    lit(&boxes, faces)
}

/// An office of 9 by 7 meters: six desks with drawers and screens, cabinets, partitions, and eight lamps of two kinds.
pub fn office(faces: usize) -> Mesh {
    let reflectance = [PAPER, PAPER, PAPER, [0.45, 0.56, 0.52], [0.36, 0.38, 0.42], [0.76; 3]];
    let room = Cuboid {
        reflectance: reflectance.map(DVec3::from),
        is_room: true,
        ..Cuboid::new([0.0; 3], [9.0, 7.0, 2.8], PAPER)
    };
    let mut boxes = vec![room];
    let stands = || places([0.9, 3.7, 6.5], [1.5, 4.9]);
    boxes.extend(stands().flat_map(|(x, y)| desk([x - 0.1, y - 0.2])));
    for i in 0..4 {
        let x = 0.6 + 1.02 * f64::from(i);
        boxes.push(standing([x, 6.55, 0.0], [x + 0.98, 6.96, 1.2 + 0.3 * f64::from(i % 3)], STEEL));
    }
    for x in [3.0, 5.9] {
        boxes.push(standing([x, 1.0, 0.0], [x + 0.05, 2.6, 1.4], [0.30, 0.42, 0.58]));
        boxes.push(standing([x, 4.4, 0.0], [x + 0.05, 6.0, 1.4], [0.58, 0.30, 0.22]));
    }
    boxes.extend(stands().map(|(x, y)| lamp([x, y, 2.72], [x + 1.2, y + 0.3, 2.78], 26.0)));
    // Two small lamps over the corners of desks.
    boxes.push(lamp([0.95, 2.1, 1.5], [1.03, 2.18, 1.56], 200.0));
    boxes.push(lamp([7.75, 5.5, 1.5], [7.83, 5.58, 1.56], 200.0));
    lit(&boxes, faces)
}

/// All pairs of two coordinates.
fn places<const N: usize, const M: usize>(xs: [f64; N], ys: [f64; M]) -> impl Iterator<Item = (f64, f64)> {
    xs.into_iter().flat_map(move |x| ys.into_iter().map(move |y| (x, y)))
}

/// A box whose lower side shines.
fn lamp(low: [f64; 3], high: [f64; 3], light: f64) -> Cuboid {
    Cuboid { light: DVec3::new(1.0, 0.95, 0.86) * light, ..Cuboid::new(low, high, PAPER) }
}

/// A box on what ends at its lower side.
fn standing(low: [f64; 3], high: [f64; 3], reflectance: [f64; 3]) -> Cuboid {
    Cuboid::new([low[0], low[1], low[2] + GAP], high, reflectance)
}

/// A board on four legs.
fn table([x, y]: [f64; 2], [far_x, far_y]: [f64; 2], height: f64) -> Vec<Cuboid> {
    let mut boxes = vec![standing([x, y, height - 0.04], [far_x, far_y, height], WOOD)];
    for (x, y) in places([x + 0.05, far_x - 0.11], [y + 0.05, far_y - 0.11]) {
        boxes.push(standing([x, y, 0.0], [x + 0.06, y + 0.06, height - 0.04], WOOD));
    }
    boxes
}

/// A board between two sides, with drawers below and a screen and a book on it.
fn desk([x, y]: [f64; 2]) -> [Cuboid; 6] {
    [
        standing([x, y, 0.7], [x + 1.4, y + 0.75, 0.73], WOOD),
        standing([x + 0.02, y + 0.03, 0.0], [x + 0.05, y + 0.72, 0.7], WOOD),
        standing([x + 1.35, y + 0.03, 0.0], [x + 1.38, y + 0.72, 0.7], WOOD),
        standing([x + 0.9, y + 0.1, 0.0], [x + 1.32, y + 0.65, 0.56], STEEL),
        standing([x + 0.4, y + 0.5, 0.73], [x + 0.95, y + 0.56, 1.12], [0.12, 0.12, 0.13]),
        standing([x + 0.1, y + 0.12, 0.73], [x + 0.32, y + 0.42, 0.78], [0.60, 0.18, 0.14]),
    ]
}

/// The mesh of about `faces` faces, with the light of each and its means at the vertices.
fn lit(boxes: &[Cuboid], faces: usize) -> Mesh {
    let solution = Solution::new(boxes, PATCH);
    mesh(boxes, &grids(boxes, faces), |index, panel, counts| {
        let cells: Vec<[f64; 2]> = middles(counts).collect();
        let color = |&at: &[f64; 2]| {
            let light = solution.light(index, panel, at).min(DVec3::ONE);
            [light.x as f32, light.y as f32, light.z as f32, 1.0]
        };
        cells.par_iter().with_min_len(64).map(color).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light of faces that look up and lie at this height, with their middles.
    fn floor(mesh: &Mesh, height: f64) -> Vec<(DVec3, f32)> {
        let colors = mesh.face_colors.as_ref().expect("light");
        let middle = |face: &[u32; 3]| face.iter().map(|&v| mesh.positions[v as usize]).sum::<DVec3>() / 3.0;
        let faces = mesh.faces.iter().zip(colors).map(|(face, color)| (middle(face), color[1], mesh.cross(*face).z));
        faces.filter(|(p, _, z)| *z > 0.0 && (p.z - height).abs() < 1e-9).map(|(p, light, _)| (p, light)).collect()
    }

    #[test]
    fn shadows_have_sharp_edges_and_nothing_is_black() {
        let mesh = room(20_000);
        let floor = floor(&mesh, 0.0);
        assert!(floor.iter().all(|&(_, light)| light > 0.004), "black faces");
        // From one face to the next the light falls by half: squares are a tenth of a meter here.
        let step = 0.13;
        let sharp = floor.iter().any(|&(p, light)| {
            floor.iter().any(|&(q, other)| (p - q).length() < step && other > 2.0 * light && light > 0.02)
        });
        assert!(sharp, "no edge of a shadow is sharp");
    }

    #[test]
    fn most_of_the_light_is_below_the_greatest() {
        for mesh in [room(5000), office(5000)] {
            let colors = mesh.face_colors.as_ref().expect("light");
            let full = colors.iter().filter(|color| color[1] >= 1.0).count();
            let mean = colors.iter().map(|color| color[1]).sum::<f32>() / colors.len() as f32;
            assert!(full * 25 < colors.len() && mean > 0.1 && mean < 0.6, "{full} full, mean {mean}");
        }
    }
}
