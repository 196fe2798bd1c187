//! Seeds in the order of their light, and superfaces grown from them.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::super::Partition;
use super::super::surface::Surface;
use super::light::Lights;
use super::region::{Patch, Region, Rules};
use super::{Grown, Options};
use crate::math::DVec3;
use crate::mesh::dual::NONE;

/// Set in the key of a face without a direction: it has no plane to grow in, so it comes last.
const FLAWED: u64 = 1 << 63;
/// Faces that a thread takes at a time.
const ROWS: usize = 1 << 12;

/// Grows superfaces from every face that is in none yet, the one with the least change around it first, ties to the lower.
pub fn grow(surface: &Surface, lights: Lights, changes: &[[f32; 4]], options: Options) -> Grown {
    let rows = lights.rows.par_iter().zip(changes).enumerate().with_min_len(ROWS);
    let patches: Vec<Patch> = rows.map(|(face, (&light, &change))| Patch::new(surface, face, light, change)).collect();
    let mut growth = Growth {
        surface,
        changes,
        rules: Rules::new(options, lights.floor, surface.diagonal),
        labels: vec![NONE; patches.len()],
        waits: vec![NONE; patches.len()],
        border: BinaryHeap::new(),
        patches,
    };
    let (mut planes, mut means) = (Vec::new(), Vec::new());
    for seed in growth.seeds() {
        if growth.labels[seed as usize] == NONE {
            let region = growth.grow(seed, planes.len() as u32);
            planes.push(region.plane);
            means.push(DVec3::from(region.light));
        }
    }
    let flawed = (lights.flawed > 0)
        .then(|| format!("the light of {} faces is below zero, too bright or no number, and is cut", lights.flawed));
    let (partition, order) = Partition::in_face_order(growth.labels, planes.len());
    Grown {
        partition,
        planes: order.iter().map(|&old| planes[old as usize]).collect(),
        lights: order.iter().map(|&old| means[old as usize]).collect(),
        warnings: flawed.into_iter().collect(),
    }
}

struct Growth<'a> {
    surface: &'a Surface,
    changes: &'a [[f32; 4]],
    patches: Vec<Patch>,
    rules: Rules,
    labels: Vec<u32>,
    /// The superface on whose border a face waits.
    waits: Vec<u32>,
    border: BinaryHeap<Reverse<u64>>,
}

impl Growth<'_> {
    /// Orders faces by the change around them, ties by their index.
    fn key(&self, face: u32) -> u64 {
        // Changes are not negative: their bits order as they do.
        u64::from(self.changes[face as usize][3].to_bits()) << 32 | u64::from(face)
    }

    /// All faces in the order in which they begin superfaces.
    fn seeds(&self) -> Vec<u32> {
        let flaw = |face: u32| if self.patches[face as usize].normal == DVec3::ZERO { FLAWED } else { 0 };
        let faces = (0..self.patches.len() as u32).into_par_iter().with_min_len(ROWS);
        let mut seeds: Vec<u64> = faces.map(|face| self.key(face) | flaw(face)).collect();
        seeds.par_sort_unstable();
        seeds.into_iter().map(|key| key as u32).collect()
    }

    /// Grows one superface: it takes the face with the least change on its border next \[Liu99\]. One that may not join is asked
    /// again when another face beside it has joined. Every face is asked once for each of its neighbors at most: O(F log F) for
    /// all superfaces.
    fn grow(&mut self, seed: u32, label: u32) -> Region {
        let mut region = Region::new(seed, &self.patches[seed as usize]);
        self.join(seed, label);
        while let Some(Reverse(next)) = self.border.pop() {
            let face = next as u32;
            let patch = &self.patches[face as usize];
            self.waits[face as usize] = NONE;
            if region.takes(patch, &self.rules) {
                region.join(face, patch);
                region.fit_when_due(self.surface, &self.rules);
                self.join(face, label);
            }
        }
        region.fit(self.surface, &self.rules);
        region
    }

    /// Labels a face, and lets those beside it wait.
    fn join(&mut self, face: u32, label: u32) {
        self.labels[face as usize] = label;
        let surface = self.surface;
        for &other in &surface.neighbors[face as usize] {
            if other != NONE && self.labels[other as usize] == NONE && self.waits[other as usize] != label {
                self.waits[other as usize] = label;
                self.border.push(Reverse(self.key(other)));
            }
        }
    }
}
