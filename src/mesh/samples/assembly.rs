//! A tray of bolts, nuts, washers, blocks, pins and pipes: many small closed parts.

use rayon::prelude::*;

use super::super::Mesh;
use super::lathe::Outline::{Regular, Round};
use super::lathe::Profile;
use super::noise::random;
use crate::math::{DMat3, DVec3};

/// Faces of a part, unless few are asked for.
const PART_FACES: usize = 250;
/// Parts fit into a ball of this radius.
const REACH: f64 = 1.55;

/// About `faces` faces in parts of 250, at least four parts; a third of them (nuts, washers) of genus 1, the rest of genus 0.
pub fn assembly(faces: usize) -> Mesh {
    let part_count = (faces / PART_FACES).max(4);
    let row = (part_count as f64).sqrt().ceil() as usize;
    // Parts come in steps of whole bands: each makes up for what the ones before it left.
    let mut made = 0;
    let wanted: Vec<(Profile, u32, usize)> = (0..part_count)
        .map(|i| {
            let profile = profile(i as u32);
            let wanted = ((i + 1) * faces / part_count).saturating_sub(made);
            // Steps around that both triangles and squares divide, about as long as the bands are high.
            let count = (((wanted as f64 * 0.75).sqrt() / 12.0).round() as u32).max(1) * 12;
            made += profile.faces(count, wanted);
            (profile, count, wanted)
        })
        .collect();
    let parts: Vec<Mesh> = wanted
        .into_par_iter()
        .enumerate()
        .map(|(i, (profile, count, wanted))| {
            let place = DVec3::new((i % row) as f64, (i / row) as f64, 0.0) * 2.0 * REACH;
            placed(profile.turn(count, wanted), i as u32, place)
        })
        .collect();
    let mut mesh = Mesh::default();
    for part in parts {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(part.positions);
        mesh.faces.extend(part.faces.into_iter().map(|face| face.map(|v| v + first)));
    }
    mesh
}

fn profile(i: u32) -> Profile {
    let (rows, is_ring) = match i % 6 {
        0 => {
            let (head, shank) = (Regular(6, 0.6), Round(0.34));
            let thread = (0..3).flat_map(|k| {
                let z = 0.5 + 0.28 * f64::from(k);
                [(z, Round(0.34)), (z + 0.14, Round(0.27))]
            });
            let rows = [(-1.2, head), (-0.75, head), (-0.75, shank)].into_iter().chain(thread);
            (rows.chain([(1.3, Round(0.24))]).collect(), false)
        }
        1 => {
            let (hexagon, bore) = (Regular(6, 1.0), Round(0.55));
            (vec![(-0.4, bore), (-0.4, hexagon), (0.4, hexagon), (0.4, bore)], true)
        }
        2 => {
            let block = Regular(4, 0.8);
            (vec![(-0.7, Regular(4, 0.7)), (-0.6, block), (0.6, block), (0.7, Regular(4, 0.7))], false)
        }
        3 => (vec![(-1.3, Round(0.3)), (-1.2, Round(0.4)), (1.2, Round(0.4)), (1.3, Round(0.3))], false),
        4 => {
            let (outer, inner) = (1.3, 0.7);
            (vec![(-0.1, Round(inner)), (-0.1, Round(outer)), (0.1, Round(outer)), (0.1, Round(inner))], true)
        }
        _ => {
            let plate = Regular(3, 0.6);
            (vec![(-0.2, plate), (0.1, plate), (0.1, Round(0.45)), (1.1, Round(0.3))], false)
        }
    };
    Profile { rows, is_ring }
}

/// Scaled and turned by chance, and moved.
fn placed(mut mesh: Mesh, i: u32, place: DVec3) -> Mesh {
    let [x, y, z] = [1, 2, 3].map(|k| random(i * 4 + k) - 0.5);
    let axis = (DVec3::new(x, y, z) + DVec3::Z * 0.01).normalize_or(DVec3::Z);
    let size = 0.75 + 0.25 * random(i * 4);
    let side = axis.any_orthonormal_vector();
    let turn = DMat3::from_cols(side, axis.cross(side), axis);
    for p in &mut mesh.positions {
        *p = turn * *p * size + place;
    }
    mesh
}
