//! Regions of faces that agree on which side is outside, grown from the edges where two faces do not.

use std::cmp::Reverse;
use std::collections::VecDeque;

use super::adjacency::{Rings, across};
use super::disjoint::DisjointSets;
use super::fan::Fan;

const NONE: u32 = u32::MAX;
/// Faces whose neighbors a region reaches before the others go on; the second time twice as many, and so forth.
const STEPS: usize = 64;

/// Regions that grow side by side over the edges where faces agree, so that small ones are complete long before the surface around
/// them is: that needs not be walked.
pub struct Regions<'a> {
    faces: &'a [[u32; 3]],
    rings: &'a Rings,
    fans: &'a [Fan],
    /// The region of every face as it was reached, or `NONE`.
    of_face: Vec<u32>,
    /// Whether the faces of a vertex' fan have been reached.
    is_reached: Vec<bool>,
    regions: Vec<Region>,
    /// Regions that met and are one.
    met: DisjointSets,
    /// Regions on both sides of an edge where two faces disagree.
    links: Vec<[u32; 2]>,
}

/// A region that has met no lower one.
#[derive(Default)]
struct Region {
    faces: Vec<u32>,
    /// Those among them whose neighbors have not been reached, in order.
    open: VecDeque<u32>,
}

/// Which regions are turned if those on one side of a link or those on the other are: twice as many sets as regions, the latter
/// half of them for the others.
struct Sides {
    sets: DisjointSets,
    all: Vec<Side>,
}

/// The regions that are wound alike, as far as links tell.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    faces: usize,
    lowest: Reverse<u32>,
    /// How many can grow.
    open: usize,
}

impl<'a> Regions<'a> {
    /// Regions from the two faces of every one of `edges`, until it is known which of them hold the most.
    pub fn grown(faces: &'a [[u32; 3]], rings: &'a Rings, fans: &'a [Fan], edges: &[[u32; 2]]) -> Self {
        let mut of_face = vec![NONE; faces.len()];
        let mut regions: Vec<Region> = Vec::new();
        let mut begin = |face: u32| {
            let region = &mut of_face[face as usize];
            if *region == NONE {
                *region = regions.len() as u32;
                regions.push(Region { faces: vec![face], open: VecDeque::from([face]) });
            }
            *region
        };
        let links: Vec<[u32; 2]> = edges.iter().map(|edge| edge.map(&mut begin)).collect();
        let (is_reached, met) = (vec![false; fans.len()], DisjointSets::new(regions.len()));
        let mut grown = Self { faces, rings, fans, of_face, is_reached, regions, met, links };
        let mut steps = STEPS;
        loop {
            let growing = grown.growing();
            if growing.is_empty() {
                return grown;
            }
            growing.into_iter().for_each(|region| grown.grow(region, steps));
            steps *= 2;
        }
    }

    /// Those on whose faces it depends what is turned: of two that are linked both may be the one that does not end.
    fn growing(&mut self) -> Vec<u32> {
        let Sides { mut sets, all } = self.sides();
        let count = self.regions.len() as u32;
        let mut depends = |&region: &u32| {
            let [own, other] = [region, region + count].map(|side| all[sets.find(side) as usize]);
            let is_most = own.open + other.open == 1 && own.faces > other.faces;
            !self.regions[region as usize].open.is_empty() && !is_most
        };
        (0..count).filter(&mut depends).collect()
    }

    fn sides(&mut self) -> Sides {
        let count = self.regions.len();
        let mut sets = DisjointSets::new(2 * count);
        let count = count as u32;
        for link in &self.links {
            let [a, b] = link.map(|region| self.met.find(region));
            let [to, alike, opposite] = [a, b, b + count].map(|side| sets.find(side));
            // Where there is no orientation, the links that come first are obeyed.
            if to != alike && to != opposite {
                sets.join(a, b + count);
                sets.join(b, a + count);
            }
        }
        let mut all = vec![Side { lowest: Reverse(NONE), ..Side::default() }; 2 * self.regions.len()];
        for (region, Region { faces, open }) in (0..).zip(&self.regions) {
            let side = &mut all[sets.find(region) as usize];
            side.faces += faces.len();
            side.lowest = side.lowest.max(Reverse(faces.iter().copied().min().unwrap_or(NONE)));
            side.open += usize::from(!open.is_empty());
        }
        Sides { sets, all }
    }

    /// Lets a region reach the neighbors of so many of its faces.
    fn grow(&mut self, region: u32, steps: usize) {
        for _ in 0..steps {
            let region = self.met.find(region);
            let Some(face) = self.regions[region as usize].open.pop_front() else { return };
            let corners = self.faces[face as usize];
            let is_complex = corners.map(|v| self.fans[v as usize] == Fan::Complex);
            // The faces of a fan agree, and its edges are manifold: only edges between complex vertices are looked at one by one.
            for k in 0..3 {
                let (v, next) = (corners[k], corners[(k + 1) % 3]);
                if !is_complex[k] {
                    if !std::mem::replace(&mut self.is_reached[v as usize], true) {
                        self.rings.ring(v).iter().for_each(|&other| self.reach(other, region));
                    }
                } else if is_complex[(k + 1) % 3]
                    && let Some((other, false)) = across(self.faces, self.rings, face, [v, next])
                {
                    self.reach(other, region);
                }
            }
        }
    }

    /// Reaches a face from a region; where another has it, both are one.
    fn reach(&mut self, face: u32, region: u32) {
        let of_face = &mut self.of_face[face as usize];
        let to = self.met.find(region);
        if *of_face == NONE {
            *of_face = to;
            self.regions[to as usize].faces.push(face);
            self.regions[to as usize].open.push_back(face);
            return;
        }
        let other = self.met.find(*of_face);
        if self.met.join(to, other) {
            let [mut less, mut more] = [to, other].map(|region| std::mem::take(&mut self.regions[region as usize]));
            if less.faces.len() > more.faces.len() {
                std::mem::swap(&mut less, &mut more);
            }
            more.faces.extend(less.faces);
            more.open.extend(less.open);
            self.regions[to.min(other) as usize] = more;
        }
    }

    /// The faces to turn, so that those linked disagree no more, as far as that goes: of two sides the one with fewer faces; without
    /// the lowest, where there are as many.
    pub fn turned(mut self) -> Vec<u32> {
        let Sides { mut sets, all } = self.sides();
        let count = self.regions.len() as u32;
        let stays = |Side { faces, lowest, .. }: Side| (faces, lowest);
        let mut is_turned = |region: u32| {
            let [own, other] = [region, region + count].map(|side| stays(all[sets.find(side) as usize]));
            own < other
        };
        let turned = (0..count).zip(self.regions).filter(|(region, _)| is_turned(*region));
        turned.flat_map(|(_, region)| region.faces).collect()
    }
}
