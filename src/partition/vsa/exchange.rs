//! Regions spent where they gain more: merging and splitting.
//!
//! # Reference
//! \[CSAD04\] teleports a region from where it is of little use to where the error is greatest. Here many at once: cheap merges
//! and dear splits of regions that have nothing to do with each other, in pairs that lower the energy by themselves, before any
//! face moves.

use rayon::prelude::*;

use super::greedy::Greedy;
use super::labeling::{Labeling, Sum};
use super::scene::Scene;
use super::split::{Members, Split, split};

/// Share of the energy that a pair must gain.
const LEAST_GAIN: f64 = 1e-6;
/// Share of the area below which the energy of a region is rounding: its faces are alike.
const ALIKE: f64 = 1e-12;

/// Merges that a partition may take, the cheapest first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Merge {
    cost: f64,
    pair: [u32; 2],
}

/// All merges of neighbors, but for those that leave a closed component without a border.
fn merges(scene: &Scene<'_>, regions: &Labeling) -> Vec<Merge> {
    let counts = regions.by_component(scene);
    let is_last = |sum: &Sum| scene.is_closed[sum.component as usize] && counts[sum.component as usize] <= 2;
    let sum = |region: u32| &regions.sums[region as usize];
    let mut merges: Vec<Merge> = (regions.adjacent(scene).into_iter())
        .filter(|pair| !is_last(sum(pair[0])))
        .map(|pair| Merge { cost: sum(pair[0]).merging_cost(sum(pair[1])), pair })
        .collect();
    merges.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.pair.cmp(&b.pair)));
    merges
}

/// The best splits of these regions, the dearest first.
fn splits(scene: &Scene<'_>, regions: &Labeling, members: &Members, which: &[u32]) -> Vec<Split> {
    let mut splits: Vec<Split> =
        which.par_iter().with_max_len(1).filter_map(|&region| split(scene, regions, members, region)).collect();
    splits.sort_by(|a, b| b.gain.total_cmp(&a.gain).then(a.region.cmp(&b.region)));
    splits
}

/// The regions with the most energy, as long as that is more than `least` asks of the first, the second and so on.
fn worst(regions: &Labeling, least: impl Fn(usize) -> f64) -> Vec<u32> {
    let energy = |region: u32| regions.sums[region as usize].energy();
    let mut order: Vec<u32> = (0..regions.count() as u32).collect();
    order.sort_by(|&a, &b| energy(b).total_cmp(&energy(a)).then(a.cmp(&b)));
    let count = (0..order.len()).take_while(|&rank| energy(order[rank]) > least(rank)).count();
    order.truncate(count);
    order
}

/// Merges cheap pairs and splits dear regions instead, as many as gain, and tells what moves faces, if that goes on. How many.
pub fn exchange(scene: &Scene<'_>, regions: &mut Labeling, mut greedy: Option<&mut Greedy<'_>>) -> usize {
    let merges = merges(scene, regions);
    let least = LEAST_GAIN * regions.energy();
    let members = Members::new(regions);
    // A split gains less than its region's energy: where that is less than the merge of the same rank costs, no pair gains.
    let which = worst(regions, |rank| merges.get(rank).map_or(f64::INFINITY, |merge| merge.cost + least));
    let splits = splits(scene, regions, &members, &which);
    let mut picked = Picked::new(scene, regions);
    let mut chosen = Vec::new();
    let mut merges = merges.into_iter();
    for split in splits {
        let region = split.region as usize;
        if picked.is_taken[region] {
            continue;
        }
        picked.is_taken[region] = true;
        // A merge that is not free is lost: the next exchange sees it again.
        let Some(merge) = merges.find(|merge| picked.is_free(merge)) else { break };
        if split.gain <= merge.cost + least {
            break;
        }
        picked.pick(&merge);
        chosen.push((merge, split));
    }
    for (merge, split) in &chosen {
        let [kept, freed] = merge.pair;
        relabel(scene, regions, members.of(freed), kept);
        regions.sums[freed as usize].component = regions.sums[split.region as usize].component;
        relabel(scene, regions, &split.second, freed);
        if let Some(greedy) = &mut greedy {
            let touched = members.of(split.region).iter().chain(members.of(freed)).copied();
            greedy.note(regions, &[kept, freed, split.region], touched);
        }
    }
    chosen.len()
}

/// Gives faces of one region another label.
fn relabel(scene: &Scene<'_>, regions: &mut Labeling, faces: &[u32], label: u32) {
    for &face in faces {
        regions.shift(scene, face, label);
    }
}

/// Splits the regions that gain most, `most` at most, without paying for it. How many.
pub fn add(scene: &Scene<'_>, regions: &mut Labeling, most: usize) -> usize {
    let members = Members::new(regions);
    let which = worst(regions, |_| ALIKE * scene.area);
    let mut splits = splits(scene, regions, &members, &which);
    splits.truncate(most);
    apply(scene, regions, &splits)
}

/// Splits these regions. How many could be.
pub fn split_all(scene: &Scene<'_>, regions: &mut Labeling, which: &[u32]) -> usize {
    let members = Members::new(regions);
    let splits: Vec<Split> = which.par_iter().filter_map(|&region| split(scene, regions, &members, region)).collect();
    apply(scene, regions, &splits)
}

fn apply(scene: &Scene<'_>, regions: &mut Labeling, splits: &[Split]) -> usize {
    for split in splits {
        let label = regions.count() as u32;
        let component = regions.sums[split.region as usize].component;
        regions.sums.push(Sum { component, ..Sum::default() });
        relabel(scene, regions, &split.second, label);
    }
    regions.sum_anew(scene);
    splits.len()
}

/// Merges the cheapest pairs until `count` regions are left or the energy would pass `most`. How many were merged.
pub fn merge_down(scene: &Scene<'_>, regions: &mut Labeling, count: usize, most: f64) -> usize {
    let mut merged = 0;
    loop {
        let mut energy = regions.energy();
        let mut picked = Picked::new(scene, regions);
        for merge in merges(scene, regions) {
            if regions.count() - picked.count <= count || energy + merge.cost > most {
                break;
            }
            if picked.is_free(&merge) {
                energy += merge.cost;
                picked.pick(&merge);
            }
        }
        if picked.count == 0 {
            return merged;
        }
        merged += picked.count;
        let into = picked.into;
        renumber(scene, regions, &into);
    }
}

/// Merges neighbors, the cheapest first, where the faces of both together are fit for it. How many.
pub fn merge_where(scene: &Scene<'_>, regions: &mut Labeling, fits: impl Fn(&Sum, &[u32]) -> bool + Sync) -> usize {
    let members = Members::new(regions);
    let fits_both = |merge: &Merge| {
        let [first, second] = merge.pair;
        let sum = regions.sums[first as usize].joined(&regions.sums[second as usize]);
        fits(&sum, &[members.of(first), members.of(second)].concat())
    };
    let merges: Vec<Merge> = merges(scene, regions).into_par_iter().filter(fits_both).collect();
    let mut picked = Picked::new(scene, regions);
    merges.iter().for_each(|merge| picked.pick(merge));
    let merged = picked.count;
    let into = picked.into;
    renumber(scene, regions, &into);
    merged
}

/// Merges that have nothing to do with each other.
struct Picked<'a> {
    scene: &'a Scene<'a>,
    components: Vec<u32>,
    /// The region that each goes into.
    into: Vec<u32>,
    is_taken: Vec<bool>,
    /// Regions of each component that are left.
    left: Vec<u32>,
    count: usize,
}

impl<'a> Picked<'a> {
    fn new(scene: &'a Scene<'a>, regions: &Labeling) -> Self {
        Self {
            scene,
            components: regions.sums.iter().map(|sum| sum.component).collect(),
            into: (0..regions.count() as u32).collect(),
            is_taken: vec![false; regions.count()],
            left: regions.by_component(scene),
            count: 0,
        }
    }

    /// Whether the two may still be merged.
    fn is_free(&self, merge: &Merge) -> bool {
        let component = self.components[merge.pair[0] as usize] as usize;
        merge.pair.iter().all(|&region| !self.is_taken[region as usize])
            && !(self.scene.is_closed[component] && self.left[component] <= 2)
    }

    /// Takes a merge that is free.
    fn pick(&mut self, merge: &Merge) {
        if !self.is_free(merge) {
            return;
        }
        let [kept, freed] = merge.pair;
        merge.pair.iter().for_each(|&region| self.is_taken[region as usize] = true);
        self.into[freed as usize] = kept;
        self.left[self.components[kept as usize] as usize] -= 1;
        self.count += 1;
    }
}

/// Gives every region the number of the one it goes into, without gaps.
fn renumber(scene: &Scene<'_>, regions: &mut Labeling, into: &[u32]) {
    let mut numbers = vec![0; into.len()];
    let mut count = 0;
    for (region, &other) in (0..).zip(into) {
        if region == other {
            numbers[region as usize] = count;
            count += 1;
        }
    }
    regions.labels.iter_mut().for_each(|label| *label = numbers[into[*label as usize] as usize]);
    regions.sums.truncate(count as usize);
    regions.sum_anew(scene);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::partition::Partition;
    use crate::partition::vsa::Connectivity;
    use crate::partition::vsa::attempt::start;
    use crate::partition::vsa::scene::tests::{bumpy_torus, scene, surface};

    fn assert_valid(scene: &Scene<'_>, regions: &Labeling) {
        let partition = Partition { labels: regions.labels.clone(), region_count: regions.count() };
        assert_eq!(partition.validate(&scene.surface.neighbors), []);
        let mut anew = regions.clone();
        anew.sum_anew(scene);
        for (running, sum) in regions.sums.iter().zip(&anew.sums) {
            assert!((running.normal - sum.normal).length() < 1e-9 && running.faces == sum.faces);
            assert_eq!(running.component, sum.component);
        }
    }

    #[test]
    fn an_exchange_lowers_the_energy_and_keeps_the_count() {
        let surface = surface(&bumpy_torus(60, 40));
        let scene = scene(&surface);
        let mut regions = start(&scene, 40, 1);
        let mut greedy = Greedy::new(&scene, &regions, Connectivity::Local);
        greedy.run(&mut regions, |_| true);
        let mut exchanges = 0;
        loop {
            let before = regions.energy();
            let count = exchange(&scene, &mut regions, Some(&mut greedy));
            if count == 0 {
                break;
            }
            assert_valid(&scene, &regions);
            assert!(regions.energy() < before);
            assert_eq!(regions.count(), 40);
            greedy.run(&mut regions, |_| true);
            exchanges += count;
        }
        assert!(exchanges > 0);
    }

    #[test]
    fn regions_are_added_and_merged_to_any_number() {
        let surface = surface(&bumpy_torus(30, 20));
        let scene = scene(&surface);
        let mut regions = start(&scene, 10, 1);
        let mut energy = regions.energy();
        for wanted in [11, 19, 30, 55, 100] {
            while regions.count() < wanted {
                let missing = wanted - regions.count();
                assert!(add(&scene, &mut regions, missing) > 0);
                assert!(regions.energy() < energy);
                energy = regions.energy();
            }
            assert_eq!(regions.count(), wanted);
            assert_valid(&scene, &regions);
        }
        for wanted in [99, 50, 7, 2, 1] {
            merge_down(&scene, &mut regions, wanted, f64::INFINITY);
            // A closed surface keeps a border.
            assert_eq!(regions.count(), wanted.max(2));
            assert!(regions.energy() >= energy);
            energy = regions.energy();
            assert_valid(&scene, &regions);
        }
    }

    #[test]
    fn merging_stops_at_an_energy() {
        let surface = surface(&bumpy_torus(30, 20));
        let scene = scene(&surface);
        let mut regions = start(&scene, 60, 4);
        let most = 1.2 * regions.energy();
        assert!(merge_down(&scene, &mut regions, 1, most) > 0);
        assert!(regions.energy() <= most && regions.count() > 2);
        let cheapest = merges(&scene, &regions)[0];
        assert!(regions.energy() + cheapest.cost > most);
    }
}
