//! Faces on borders move to the region beside them while that lowers the energy.
//!
//! # Reference
//! \[Jin09\]: with N = Σ ρ n a region, the energy is 2 (Σ ρ − Σ |N|), so a move changes two terms. A face is looked at again only
//! when a region that it depends on has changed.
//!
//! # Invariants
//! Every move lowers the energy by more than [`Greedy::least_gain`], and leaves the region that the face left in one piece, if
//! need be by taking a neighbor along that would be left alone; no region becomes empty.

use crate::kernel::boundary_gains::{Labeled, stays_connected};

use super::Connectivity;
use super::labeling::Labeling;
use super::scene::Scene;
use super::search::Detours;

/// Share of the area that a move must gain.
const LEAST_GAIN: f64 = 1e-12;
/// Passes after which a run ends though moves are left; twenty to sixty are usual.
const MOST_PASSES: usize = 10_000;

/// A face that moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    pub face: u32,
    /// How much the sum of all |N| grew: half of what the energy fell by.
    pub gain: f64,
}

/// The boundary moves of one partition.
#[derive(Debug)]
pub struct Greedy<'a> {
    scene: &'a Scene<'a>,
    /// The faces to look at: all on borders, and some that were.
    list: Vec<u32>,
    is_listed: Vec<bool>,
    /// What the clock showed when each face was last looked at without moving.
    looked_at: Vec<u32>,
    /// What it shows since each region changed.
    changed_at: Vec<u32>,
    /// Counts moves.
    clock: u32,
    /// Of [`Connectivity::Exact`].
    search: Option<Detours>,
    /// Whether searches are made: once no other move is left, for they take longer.
    is_searching: bool,
}

impl<'a> Greedy<'a> {
    /// All borders of `regions` are to be looked at.
    pub fn new(scene: &'a Scene<'a>, regions: &Labeling, connectivity: Connectivity) -> Self {
        let face_count = scene.face_count();
        let mut greedy = Self {
            scene,
            list: Vec::new(),
            is_listed: vec![false; face_count],
            looked_at: vec![0; face_count],
            changed_at: vec![1; regions.count()],
            clock: 1,
            search: (connectivity == Connectivity::Exact).then(|| Detours::new(face_count)),
            is_searching: false,
        };
        greedy.list(regions, 0..face_count as u32);
        greedy
    }

    /// The gain of Σ |N| that a move must exceed.
    pub fn least_gain(&self) -> f64 {
        LEAST_GAIN * self.scene.area
    }

    /// Lists those of `faces` that lie on a border.
    fn list(&mut self, regions: &Labeling, faces: impl IntoIterator<Item = u32>) {
        for face in faces {
            if !self.is_listed[face as usize] && is_on_border(self.scene, regions, face) {
                self.is_listed[face as usize] = true;
                self.list.push(face);
            }
        }
    }

    /// Takes note of regions that were changed from outside, and of `faces` that have another label since.
    pub fn note(&mut self, regions: &Labeling, changed: &[u32], faces: impl IntoIterator<Item = u32>) {
        self.clock += 1;
        self.changed_at.resize(regions.count(), self.clock);
        changed.iter().for_each(|&region| self.changed_at[region as usize] = self.clock);
        for face in faces {
            self.list(regions, self.scene.around(face).chain([face]));
        }
    }

    /// Passes over the borders until none moves, or `go_on` says no after one. Returns the moves in all.
    pub fn run(&mut self, regions: &mut Labeling, mut go_on: impl FnMut(&Labeling) -> bool) -> usize {
        let mut moves = 0;
        for _ in 0..MOST_PASSES {
            let moved = self.pass(regions);
            moves += moved;
            if moved > 0 && !go_on(regions) {
                break;
            }
            if moved == 0 {
                // First without searches, then with those; what was taken from memory is searched once more.
                let is_sure = self.search.as_mut().is_none_or(Detours::forget);
                if is_sure && (self.is_searching || self.search.is_none()) {
                    break;
                }
                self.is_searching = true;
                self.looked_at.fill(0);
            }
        }
        self.is_searching = false;
        regions.sum_anew(self.scene);
        moves
    }

    /// Looks at every listed face once, and at those that a move adds. Returns the moves.
    pub fn pass(&mut self, regions: &mut Labeling) -> usize {
        let mut moves = 0;
        let mut at = 0;
        while at < self.list.len() {
            moves += usize::from(self.look(regions, self.list[at]).is_some());
            at += 1;
        }
        let (scene, is_listed) = (self.scene, &mut self.is_listed);
        self.list.retain(|&face| {
            is_listed[face as usize] = is_on_border(scene, regions, face);
            is_listed[face as usize]
        });
        moves
    }

    /// Moves a face if that gains.
    pub fn look(&mut self, regions: &mut Labeling, face: u32) -> Option<Move> {
        let own = regions.labels[face as usize];
        let last = self.looked_at[face as usize];
        let around = self.scene.around(face).map(|other| regions.labels[other as usize]);
        if around.chain([own]).all(|label| self.changed_at[label as usize] <= last) {
            return None;
        }
        self.looked_at[face as usize] = self.clock;
        let (label, mut gain) = best_move(self.scene, regions, face)?;
        let mut along = None;
        if gain > self.least_gain() && !self.may_leave(regions, face) {
            let other = left_alone(self.scene, regions, face)?;
            gain = gain_of_both(self.scene, regions, [face, other], label);
            along = Some(other);
        }
        if gain <= self.least_gain() {
            return None;
        }
        self.clock += 1;
        self.changed_at[own as usize] = self.clock;
        self.changed_at[label as usize] = self.clock;
        for moved in along.into_iter().chain([face]) {
            regions.shift(self.scene, moved, label);
            if let Some(search) = &mut self.search {
                search.changed(self.scene, moved);
            }
        }
        for moved in along.into_iter().chain([face]) {
            self.list(regions, self.scene.around(moved).chain([moved]));
        }
        Some(Move { face, gain })
    }

    /// Whether the face's region stays in one piece without it, as far as is asked for.
    fn may_leave(&mut self, regions: &Labeling, face: u32) -> bool {
        let surface = self.scene.surface;
        let (faces, neighbors) = (bytemuck::cast_slice(&surface.faces), bytemuck::cast_slice(&surface.neighbors));
        let seen = Labeled { faces, neighbors, labels: &regions.labels };
        let mut search = self.search.as_mut().filter(|_| self.is_searching);
        stays_connected(face, regions.labels[face as usize], &seen)
            || search.as_mut().is_some_and(|search| search.stays_connected(self.scene, &regions.labels, face))
    }
}

fn is_on_border(scene: &Scene<'_>, regions: &Labeling, face: u32) -> bool {
    let own = regions.labels[face as usize];
    scene.around(face).any(|other| regions.labels[other as usize] != own)
}

/// The one neighbor of a face in its region that has no other neighbor there, where the face has two: it may come along, for
/// one face left at a corner would hold a whole row back.
fn left_alone(scene: &Scene<'_>, regions: &Labeling, face: u32) -> Option<u32> {
    let own = regions.labels[face as usize];
    let inside = |face: u32| scene.around(face).filter(|&other| regions.labels[other as usize] == own);
    let is_alone = |other: &u32| inside(*other).all(|beyond| beyond == face);
    if inside(face).count() != 2 || inside(face).all(|other| is_alone(&other)) {
        return None;
    }
    inside(face).find(is_alone)
}

/// What Σ |N| gains when two faces of a region go to another.
fn gain_of_both(scene: &Scene<'_>, regions: &Labeling, faces: [u32; 2], label: u32) -> f64 {
    let weighted = faces.map(|face| scene.shapes[face as usize].weighted());
    let (from, to) = (&regions.sums[regions.labels[faces[0] as usize] as usize], &regions.sums[label as usize]);
    let both = weighted[0] + weighted[1];
    (from.normal - both).length() - from.length + (to.normal + both).length() - to.length
}

/// The region beside a face that gains most by it, the lowest of such, and what Σ |N| gains.
pub fn best_move(scene: &Scene<'_>, regions: &Labeling, face: u32) -> Option<(u32, f64)> {
    let own = regions.labels[face as usize];
    let weighted = scene.shapes[face as usize].weighted();
    let mut best: Option<(u32, f64)> = None;
    for other in scene.around(face) {
        let label = regions.labels[other as usize];
        if label == own || best.is_some_and(|(found, _)| found == label) {
            continue;
        }
        let sum = &regions.sums[label as usize];
        let gain = (sum.normal + weighted).length() - sum.length;
        if best.is_none_or(|(found, most)| gain > most || gain == most && label < found) {
            best = Some((label, gain));
        }
    }
    let left = &regions.sums[own as usize];
    best.map(|(label, gain)| (label, gain + (left.normal - weighted).length() - left.length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::partition::Partition;
    use crate::partition::vsa::attempt::start;
    use crate::partition::vsa::scene::tests::{bumpy_torus, scene, surface};
    use crate::partition::vsa::search::is_free_to_leave;

    const BOTH: [Connectivity; 2] = [Connectivity::Local, Connectivity::Exact];

    #[test]
    fn every_move_lowers_the_energy_by_what_it_says() {
        let surface = surface(&bumpy_torus(40, 24));
        let scene = scene(&surface);
        for connectivity in BOTH {
            let mut regions = start(&scene, 15, 2);
            let mut greedy = Greedy::new(&scene, &regions, connectivity);
            let mut moves = 0;
            for _ in 0..3 {
                for face in 0..scene.face_count() as u32 {
                    let before = Labeling::new(&scene, regions.labels.clone(), regions.count()).energy();
                    if let Some(Move { face: moved, gain }) = greedy.look(&mut regions, face) {
                        let after = Labeling::new(&scene, regions.labels.clone(), regions.count()).energy();
                        assert!(after < before && (before - after - 2.0 * gain).abs() < 1e-12, "{before} {after}");
                        assert_eq!(moved, face);
                        moves += 1;
                    }
                }
            }
            assert!(moves > 100, "{moves}");
        }
    }

    /// After every pass; and at the end no legal move gains.
    #[test]
    fn regions_stay_connected_and_end_in_a_local_optimum() {
        for mesh in [bumpy_torus(50, 30), shapes::icosphere(4), shapes::moebius(900)] {
            let surface = surface(&mesh);
            let scene = scene(&surface);
            for connectivity in BOTH {
                let mut regions = start(&scene, 20, 7);
                let count = regions.count();
                let mut greedy = Greedy::new(&scene, &regions, connectivity);
                let mut energy = regions.energy();
                greedy.run(&mut regions, |regions| {
                    let partition = Partition { labels: regions.labels.clone(), region_count: count };
                    assert_eq!(partition.validate(&surface.neighbors), []);
                    assert_eq!(regions.count(), count);
                    assert!(regions.energy() <= energy + 1e-13);
                    energy = regions.energy();
                    true
                });
                for face in 0..scene.face_count() as u32 {
                    let Some((_, gain)) = best_move(&scene, &regions, face) else { continue };
                    let labels = &regions.labels;
                    let (faces, neighbors) =
                        (bytemuck::cast_slice(&surface.faces), bytemuck::cast_slice(&surface.neighbors));
                    let local = stays_connected(face, labels[face as usize], &Labeled { faces, neighbors, labels });
                    // What the ring allows, a search without bounds must; these regions are within a search's bounds.
                    let is_free = is_free_to_leave(&scene, &regions, face);
                    assert!(is_free || !local);
                    let is_legal = if connectivity == Connectivity::Exact { is_free } else { local };
                    let is_small = regions.sums[labels[face as usize] as usize].faces <= 250;
                    assert!(gain <= greedy.least_gain() * 1.01 || !is_legal || !(local || is_small), "{face}: {gain}");
                }
            }
        }
    }

    #[test]
    fn exact_moves_end_no_higher_on_the_whole() {
        let mut sums = [0.0, 0.0];
        let surface = surface(&bumpy_torus(60, 40));
        let scene = scene(&surface);
        for seed in 0..8 {
            for (connectivity, sum) in BOTH.into_iter().zip(&mut sums) {
                let mut regions = start(&scene, 25, seed);
                Greedy::new(&scene, &regions, connectivity).run(&mut regions, |_| true);
                *sum += regions.energy();
            }
        }
        assert!(sums[1] < 1.02 * sums[0], "{sums:?}");
    }

    /// Two sides of a cube as one region and a strip of the next as another: the strip takes its side back.
    #[test]
    fn a_border_finds_the_edge() {
        let surface = surface(&shapes::cube(6));
        let scene = scene(&surface);
        let side = |face: usize| {
            let n = scene.shapes[face].normal;
            (0..3).position(|axis| n[axis].abs() > 0.5).unwrap_or(0) as u32 * 2 + u32::from(n.max_element() > 0.5)
        };
        let right: Vec<u32> = (0..scene.face_count()).map(side).collect();
        // Every face beside another side goes to it, where that leaves all in one piece.
        let mut regions = Labeling::new(&scene, right.clone(), 6);
        let mut greedy = Greedy::new(&scene, &regions, Connectivity::Local);
        let mut moved = 0;
        for face in 0..scene.face_count() as u32 {
            let other =
                scene.around(face).map(|other| right[other as usize]).find(|&label| label != right[face as usize]);
            if let Some(label) = other
                && face % 3 == 0
                && greedy.may_leave(&regions, face)
            {
                regions.shift(&scene, face, label);
                greedy.note(&regions, &[right[face as usize], label], [face]);
                moved += 1;
            }
        }
        assert!(moved > 20 && regions.energy() > 0.1, "{moved}");
        greedy.run(&mut regions, |_| true);
        assert_eq!(regions.labels, right);
        assert_eq!(regions.energy(), 0.0);
    }
}
