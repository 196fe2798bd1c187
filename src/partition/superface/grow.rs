//! Seeds in the order of their light, and superfaces grown from them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::super::Partition;
use super::super::surface::Surface;
use super::light::Lights;
use super::region::{Patch, Region, Rules};
use super::{Options, Superfaces};
use crate::math::DVec3;
use crate::mesh::dual::NONE;

/// Set in the key of a face without a direction: it has no plane to grow in, so it comes last.
const FLAWED: u64 = 1 << 63;
/// Faces that a thread takes at a time.
const ROWS: usize = 1 << 12;

/// Grows superfaces from every face that is in none yet, the one with the least change around it first, ties to the lower.
///
/// A superface takes the face with the least change on its border next \[Liu99\]. One that may not join is asked again when
/// another face beside it has joined. Every face is asked once for each of its neighbors at most: O(F log F).
pub fn grow(surface: &Surface, lights: Lights, changes: &[[f32; 4]], options: Options) -> Superfaces {
    let rules = Rules::new(options, lights.floor, surface.diagonal);
    let rows = lights.rows.par_iter().zip(changes).enumerate().with_min_len(ROWS);
    let patches: Vec<Patch> = rows.map(|(face, (&light, &change))| Patch::new(surface, face, light, change)).collect();
    // Changes are not negative: their bits order as they do.
    let key = |face: u32| u64::from(changes[face as usize][3].to_bits()) << 32 | u64::from(face);
    let mut seeds: Vec<u64> = (0..patches.len() as u32)
        .into_par_iter()
        .with_min_len(ROWS)
        .map(|face| key(face) | if patches[face as usize].normal == DVec3::ZERO { FLAWED } else { 0 })
        .collect();
    seeds.par_sort_unstable();

    let mut labels = vec![NONE; patches.len()];
    // The superface on whose border a face waits.
    let mut waits = vec![NONE; patches.len()];
    let mut border = BinaryHeap::new();
    let (mut planes, mut means) = (Vec::new(), Vec::new());
    for seed in seeds.into_iter().map(|key| key as u32) {
        if labels[seed as usize] != NONE {
            continue;
        }
        let label = planes.len() as u32;
        let mut region = Region::new(seed, &patches[seed as usize]);
        let mut joined = Some(seed);
        loop {
            if let Some(face) = joined {
                labels[face as usize] = label;
                for &other in &surface.neighbors[face as usize] {
                    if other != NONE && labels[other as usize] == NONE && waits[other as usize] != label {
                        waits[other as usize] = label;
                        border.push(Reverse(key(other)));
                    }
                }
            }
            let Some(Reverse(next)) = border.pop() else { break };
            let face = next as u32;
            waits[face as usize] = NONE;
            joined = region.takes(&patches[face as usize], &rules).then_some(face);
            if joined.is_some() {
                region.join(face, &patches[face as usize]);
                region.fit_when_due(surface, &rules);
            }
        }
        region.fit(surface, &rules);
        planes.push(region.plane);
        means.push(DVec3::from(region.light));
    }
    let flawed = (lights.flawed > 0)
        .then(|| format!("the light of {} faces is below zero, too bright or no number, and is cut", lights.flawed));
    let (partition, order) = Partition::in_face_order(labels, planes.len());
    Superfaces {
        partition,
        planes: order.iter().map(|&old| planes[old as usize]).collect(),
        lights: order.iter().map(|&old| means[old as usize]).collect(),
        warnings: flawed.into_iter().collect(),
    }
}
